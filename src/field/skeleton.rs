//! Skeletons: the primitives that emit fields, their distances, and where they come closest to each other.

use super::profile::Profile;
use crate::error::{Result, require_finite};
use crate::math::{Mat3, Pose, Vec3};

/// A geometric primitive. Points, segments and triangles are thin: their distance is at least zero. Boxes and planes
/// are solid: their distance is signed, negative inside, so that the field keeps a gradient in the core.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape {
    /// A point.
    Point(Vec3),
    /// A segment between two distinct points.
    Segment(Vec3, Vec3),
    /// A triangle of positive area.
    Triangle(Vec3, Vec3, Vec3),
    /// A solid box: centre, half extents (each > 0), and the axes as the columns of a rotation.
    Box {
        /// Centre.
        center: Vec3,
        /// Half extents along the axes.
        half: Vec3,
        /// The axes as columns.
        axes: Mat3,
    },
    /// A half-space: everything behind a point of its boundary, against the unit normal.
    Plane {
        /// A point of the boundary.
        point: Vec3,
        /// The outward unit normal.
        normal: Vec3,
    },
}

/// Which feature of a shape is closest: it decides the curvature of the distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Feature {
    /// A point or a corner: the distance is curved in two directions.
    Vertex,
    /// A straight line with this unit direction: curved in one.
    Edge(Vec3),
    /// A flat face: not curved.
    Face,
}

/// The closest feature of a shape to a point.
#[derive(Clone, Copy, Debug)]
pub struct Closest {
    /// Signed distance \[m\].
    pub distance: f64,
    /// Gradient of the distance: a unit vector, or zero on a thin skeleton itself.
    pub normal: Vec3,
    /// What kind of feature it is.
    pub feature: Feature,
}

/// Clamped parameter of the point on `a + s (b - a)` closest to `p`.
#[inline]
fn segment_parameter(a: &Vec3, ab: &Vec3, p: &Vec3) -> f64 {
    ((p - a).dot(ab) / ab.norm_squared()).clamp(0.0, 1.0)
}

#[inline]
fn from_offset(offset: Vec3, feature: Feature) -> Closest {
    let distance = offset.norm();
    let normal = if distance > 0.0 { offset / distance } else { Vec3::zeros() };
    Closest { distance, normal, feature }
}

fn closest_on_segment(a: &Vec3, b: &Vec3, p: &Vec3) -> (Vec3, Feature) {
    let ab = b - a;
    let s = segment_parameter(a, &ab, p);
    let feature = if s > 0.0 && s < 1.0 { Feature::Edge(ab.normalize()) } else { Feature::Vertex };
    (a + ab * s, feature)
}

/// Closest point on a triangle by its Voronoi regions.
fn closest_on_triangle(a: &Vec3, b: &Vec3, c: &Vec3, p: &Vec3) -> (Vec3, Feature) {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(&ap), ac.dot(&ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return (*a, Feature::Vertex);
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(&bp), ac.dot(&bp));
    if d3 >= 0.0 && d4 <= d3 {
        return (*b, Feature::Vertex);
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return (a + ab * (d1 / (d1 - d3)), Feature::Edge(ab.normalize()));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(&cp), ac.dot(&cp));
    if d6 >= 0.0 && d5 <= d6 {
        return (*c, Feature::Vertex);
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return (a + ac * (d2 / (d2 - d6)), Feature::Edge(ac.normalize()));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        let bc = c - b;
        return (b + bc * ((d4 - d3) / ((d4 - d3) + (d5 - d6))), Feature::Edge(bc.normalize()));
    }
    let scale = 1.0 / (va + vb + vc);
    (a + ab * (vb * scale) + ac * (vc * scale), Feature::Face)
}

fn closest_to_box(center: &Vec3, half: &Vec3, axes: &Mat3, p: &Vec3) -> Closest {
    let local = axes.tr_mul(&(p - center));
    let excess = Vec3::new(local.x.abs() - half.x, local.y.abs() - half.y, local.z.abs() - half.z);
    let sign = local.map(|x| if x < 0.0 { -1.0 } else { 1.0 });
    let outside = excess.map(|x| x.max(0.0));
    let count = excess.iter().filter(|x| **x > 0.0).count();
    if count == 0 {
        let axis = excess.imax();
        return Closest { distance: excess[axis], normal: axes.column(axis) * sign[axis], feature: Feature::Face };
    }
    let distance = outside.norm();
    let normal = axes * (outside.component_mul(&sign) / distance);
    let feature = match count {
        1 => Feature::Face,
        2 => Feature::Edge(axes.column(excess.imin()).into_owned()),
        _ => Feature::Vertex,
    };
    Closest { distance, normal, feature }
}

impl Shape {
    /// A segment, or the point that a segment of no length is.
    pub fn segment(a: Vec3, b: Vec3) -> Self {
        let scale = a.norm().max(b.norm());
        if (b - a).norm() <= (1e-12 * scale).max(1e-150) { Shape::Point(a) } else { Shape::Segment(a, b) }
    }

    /// A triangle, or the segment or point that three collinear points span.
    pub fn triangle(a: Vec3, b: Vec3, c: Vec3) -> Self {
        let edges = [(a, b), (b, c), (c, a)];
        let longest = edges
            .into_iter()
            .max_by(|x, y| (x.1 - x.0).norm_squared().total_cmp(&(y.1 - y.0).norm_squared()))
            .unwrap_or((a, b));
        let length2 = (longest.1 - longest.0).norm_squared();
        if (b - a).cross(&(c - a)).norm() <= 1e-10 * length2 {
            Shape::segment(longest.0, longest.1)
        } else {
            Shape::Triangle(a, b, c)
        }
    }

    /// A half-space through `point`; `normal` points out of the solid and needs no unit length.
    pub fn plane(point: Vec3, normal: Vec3) -> Result<Self> {
        require_finite("plane normal", &normal)?;
        let length = normal.norm();
        crate::error::require("length of the plane normal", length, "> 0", |x| x > 1e-150)?;
        Ok(Shape::Plane { point, normal: normal / length })
    }

    /// True for shapes with a signed distance.
    pub fn is_solid(&self) -> bool {
        matches!(self, Shape::Box { .. } | Shape::Plane { .. })
    }

    /// The shape moved by a pose.
    pub fn transformed(&self, pose: &Pose) -> Shape {
        let at = |p: &Vec3| pose.transform_point(p);
        match self {
            Shape::Point(a) => Shape::Point(at(a)),
            Shape::Segment(a, b) => Shape::Segment(at(a), at(b)),
            Shape::Triangle(a, b, c) => Shape::Triangle(at(a), at(b), at(c)),
            Shape::Box { center, half, axes } => {
                Shape::Box { center: at(center), half: *half, axes: pose.rotation.to_rotation_matrix().matrix() * axes }
            }
            Shape::Plane { point, normal } => Shape::Plane { point: at(point), normal: pose.rotation * normal },
        }
    }

    /// Distance, its gradient, and the feature it belongs to.
    pub fn closest(&self, p: &Vec3) -> Closest {
        match self {
            Shape::Point(a) => from_offset(p - a, Feature::Vertex),
            Shape::Segment(a, b) => {
                let (y, feature) = closest_on_segment(a, b, p);
                from_offset(p - y, feature)
            }
            Shape::Triangle(a, b, c) => {
                let (y, feature) = closest_on_triangle(a, b, c, p);
                from_offset(p - y, feature)
            }
            Shape::Box { center, half, axes } => closest_to_box(center, half, axes, p),
            Shape::Plane { point, normal } => {
                Closest { distance: (p - point).dot(normal), normal: *normal, feature: Feature::Face }
            }
        }
    }

    /// The point of the shape (of its solid, for boxes and planes) closest to `p`.
    pub fn closest_point(&self, p: &Vec3) -> Vec3 {
        match self {
            Shape::Point(a) => *a,
            Shape::Segment(a, b) => closest_on_segment(a, b, p).0,
            Shape::Triangle(a, b, c) => closest_on_triangle(a, b, c, p).0,
            Shape::Box { center, half, axes } => {
                let local = axes.tr_mul(&(p - center));
                center + axes * Vec3::from_fn(|i, _| local[i].clamp(-half[i], half[i]))
            }
            Shape::Plane { point, normal } => p - normal * (p - point).dot(normal).max(0.0),
        }
    }

    /// Axis-aligned bounds of the shape grown by `margin`, as (low, high); infinite for planes.
    pub fn bounds(&self, margin: f64) -> (Vec3, Vec3) {
        let grow = Vec3::repeat(margin);
        let (low, high) = match self {
            Shape::Point(a) => (*a, *a),
            Shape::Segment(a, b) => (a.inf(b), a.sup(b)),
            Shape::Triangle(a, b, c) => (a.inf(b).inf(c), a.sup(b).sup(c)),
            Shape::Box { center, half, axes } => {
                let extent = axes.abs() * half;
                (center - extent, center + extent)
            }
            Shape::Plane { .. } => (Vec3::repeat(f64::NEG_INFINITY), Vec3::repeat(f64::INFINITY)),
        };
        (low - grow, high + grow)
    }

    /// A point in the middle of the shape (of a plane: its point).
    pub fn middle(&self) -> Vec3 {
        match self {
            Shape::Point(a) => *a,
            Shape::Segment(a, b) => (a + b) * 0.5,
            Shape::Triangle(a, b, c) => (a + b + c) / 3.0,
            Shape::Box { center, .. } => *center,
            Shape::Plane { point, .. } => *point,
        }
    }

    /// Half the largest extent of the shape: all of it is this near to its middle \[m\]; infinite for a plane.
    pub fn half_extent(&self) -> f64 {
        match self {
            Shape::Box { half, .. } => half.norm(),
            Shape::Plane { .. } => f64::INFINITY,
            _ => self.corners().map(|corner| (corner - self.middle()).norm()).fold(0.0, f64::max),
        }
    }

    /// The corners of the shape; a point and a plane have none.
    pub fn corners(&self) -> impl Iterator<Item = Vec3> {
        let count = match self {
            Shape::Point(_) | Shape::Plane { .. } => 0,
            Shape::Segment(..) => 2,
            Shape::Triangle(..) => 3,
            Shape::Box { .. } => 8,
        };
        (0..count).map(|index| match self {
            Shape::Segment(a, b) => [*a, *b][index],
            Shape::Triangle(a, b, c) => [*a, *b, *c][index],
            Shape::Box { center, half, axes } => {
                let side = |axis: usize| if index >> axis & 1 == 0 { half[axis] } else { -half[axis] };
                center + axes * Vec3::new(side(0), side(1), side(2))
            }
            Shape::Point(point) | Shape::Plane { point, .. } => *point,
        })
    }
}

/// Closest points of two shapes, as (on a, on b); two equal points when the shapes meet.
///
/// All shapes are convex, so alternating projections converge to the closest pair; pairs that involve a point or a
/// plane are exact at once.
pub fn closest_points(a: &Shape, b: &Shape) -> (Vec3, Vec3) {
    if let Shape::Plane { normal, .. } = b {
        let support = deepest_point(a, normal);
        return (support, b.closest_point(&support));
    }
    if let Shape::Plane { normal, .. } = a {
        let support = deepest_point(b, normal);
        return (a.closest_point(&support), support);
    }
    let mut on_a = a.closest_point(&b.middle());
    let mut on_b = b.closest_point(&on_a);
    let mut gap = f64::INFINITY;
    let mut stride = f64::INFINITY;
    for _ in 0..64 {
        let before = on_b;
        on_a = a.closest_point(&on_b);
        on_b = b.closest_point(&on_a);
        let now = (on_b - on_a).norm_squared();
        if now >= gap * (1.0 - 1e-9) {
            break;
        }
        gap = now;
        // Between nearly parallel parts the steps shrink slowly, by one ratio: go to where they add up to.
        let step = on_b - before;
        let ratio = step.norm() / stride;
        stride = step.norm();
        if ratio > 0.3 && ratio < 1.0 {
            let ahead_a = a.closest_point(&(on_b + step * (ratio / (1.0 - ratio))));
            let ahead_b = b.closest_point(&ahead_a);
            let ahead = (ahead_b - ahead_a).norm_squared();
            if ahead < gap {
                (on_a, on_b, gap, stride) = (ahead_a, ahead_b, ahead, f64::INFINITY);
            }
        }
    }
    (on_a, on_b)
}

/// The middle of the part of a bounded shape that lies deepest against `normal`.
fn deepest_point(shape: &Shape, normal: &Vec3) -> Vec3 {
    let average = |points: &[Vec3]| {
        let lowest = points.iter().map(|p| p.dot(normal)).fold(f64::INFINITY, f64::min);
        let highest = points.iter().map(|p| p.dot(normal)).fold(f64::NEG_INFINITY, f64::max);
        // Corners within a thousandth of the height count as equally deep: a face at rest starts at its middle.
        let limit = lowest + 1e-3 * (highest - lowest) + 1e-12 * lowest.abs();
        let (mut sum, mut count) = (Vec3::zeros(), 0.0);
        for p in points.iter().filter(|p| p.dot(normal) <= limit) {
            sum += p;
            count += 1.0;
        }
        sum / count
    };
    match shape {
        Shape::Point(a) => *a,
        Shape::Segment(a, b) => average(&[*a, *b]),
        Shape::Triangle(a, b, c) => average(&[*a, *b, *c]),
        Shape::Box { center, half, axes } => {
            let local = axes.tr_mul(normal);
            // Axes that lie in the plane do not choose a corner.
            let corner = Vec3::from_fn(|i, _| if local[i].abs() < 1e-3 { 0.0 } else { -local[i].signum() * half[i] });
            center + axes * corner
        }
        Shape::Plane { point, .. } => *point,
    }
}

/// A skeleton placed in the frame in which fields are evaluated.
#[derive(Clone, Copy, Debug)]
pub struct Placed {
    /// Where the primitive is.
    pub shape: Shape,
    /// What it emits.
    pub profile: Profile,
}

impl Placed {
    /// Field value at a point.
    #[inline]
    pub fn value(&self, p: &Vec3) -> f64 {
        self.profile.value_slope(self.shape.closest(p).distance).0
    }

    /// Field value and gradient at a point.
    #[inline]
    pub fn value_gradient(&self, p: &Vec3) -> (f64, Vec3) {
        let closest = self.shape.closest(p);
        let (value, slope) = self.profile.value_slope(closest.distance);
        (value, closest.normal * slope)
    }

    /// Field value, gradient and Hessian at a point.
    pub fn value_gradient_hessian(&self, p: &Vec3) -> (f64, Vec3, Mat3) {
        let closest = self.shape.closest(p);
        let jet = self.profile.jet(closest.distance);
        let n = closest.normal;
        let nn = n * n.transpose();
        let across = match closest.feature {
            Feature::Face => Mat3::zeros(),
            Feature::Edge(t) => Mat3::identity() - nn - t * t.transpose(),
            Feature::Vertex => Mat3::identity() - nn,
        };
        (jet.value, n * jet.slope, nn * jet.curvature + across * jet.slope_over_distance)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use proptest::prelude::*;

    pub fn vectors(size: f64) -> impl Strategy<Value = Vec3> {
        (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    /// All but planes; half sides of boxes are longer than `least`.
    pub fn bounded_shapes(least: f64) -> impl Strategy<Value = Shape> {
        prop_oneof![
            vectors(1.0).prop_map(Shape::Point),
            (vectors(1.0), vectors(1.0)).prop_map(|(a, b)| Shape::segment(a, b)),
            (vectors(1.0), vectors(1.0), vectors(1.0)).prop_map(|(a, b, c)| Shape::triangle(a, b, c)),
            (vectors(1.0), vectors(1.0), vectors(2.0)).prop_map(move |(center, h, r)| Shape::Box {
                center,
                half: h.map(|x| least + x.abs()),
                axes: *crate::math::rotation_from_vector(&r).to_rotation_matrix().matrix(),
            }),
        ]
    }

    pub fn shapes() -> impl Strategy<Value = Shape> {
        prop_oneof![
            4 => bounded_shapes(0.1),
            1 => (vectors(1.0), vectors(1.0)).prop_filter_map("no normal", |(p, n)| Shape::plane(p, n).ok()),
        ]
    }

    proptest! {
        #[test]
        fn distance_is_the_distance_to_the_closest_point(shape in shapes(), p in vectors(3.0)) {
            let d = shape.closest(&p).distance;
            let reached = (p - shape.closest_point(&p)).norm();
            if d >= 0.0 { prop_assert!((d - reached).abs() < 1e-12) } else { prop_assert!(reached < 1e-12) }
        }

        #[test]
        fn no_point_of_the_shape_is_closer(shape in shapes(), p in vectors(3.0), q in vectors(3.0)) {
            let other = shape.closest_point(&q);
            prop_assert!((p - other).norm() >= shape.closest(&p).distance - 1e-12);
        }

        #[test]
        fn gradient_and_hessian_are_derivatives(shape in shapes(), p in vectors(2.5)) {
            let profile = Profile::new(1.0, 1.0, 0.9, 2.5, 3.0, shape.is_solid()).unwrap();
            let placed = Placed { shape, profile };
            let h = 1e-6;
            let (_, gradient, hessian) = placed.value_gradient_hessian(&p);
            for i in 0..3 {
                let mut step = Vec3::zeros();
                step[i] = h;
                let (plus, minus) = (placed.value_gradient(&(p + step)), placed.value_gradient(&(p - step)));
                // A kink of the signed distance within the step makes the difference meaningless.
                let features = (shape.closest(&(p + step)).feature, shape.closest(&(p - step)).feature);
                let same = match features {
                    (Feature::Edge(s), Feature::Edge(t)) => s.dot(&t).abs() > 0.999_999,
                    (s, t) => s == t,
                };
                let turned = shape.closest(&(p + step)).normal.dot(&shape.closest(&(p - step)).normal);
                let d = shape.closest(&p).distance;
                let joint = [profile.cap, 1.0, 3.0].iter().any(|j| (d - j).abs() < 3.0 * h);
                prop_assume!(same && turned > 0.99 && !joint && (shape.is_solid() || d > 10.0 * h));
                prop_assert!((gradient[i] - (plus.0 - minus.0) / (2.0 * h)).abs() < 1e-5);
                let column = (plus.1 - minus.1) / (2.0 * h);
                prop_assert!((hessian.column(i) - column).norm() < 2e-3, "{hessian} {column}");
            }
        }

        #[test]
        fn closest_points_beat_random_pairs(a in shapes(), b in shapes(), q in vectors(3.0)) {
            let both_planes = matches!((&a, &b), (Shape::Plane { .. }, Shape::Plane { .. }));
            prop_assume!(!both_planes);
            let (x, y) = closest_points(&a, &b);
            let on_a = a.closest_point(&q);
            let on_b = b.closest_point(&on_a);
            let (x2, y2) = (a.closest_point(&y), b.closest_point(&x));
            prop_assert!((x - y).norm() <= (on_a - on_b).norm() + 0.02, "{x} {y} {x2} {y2}");
        }
    }

    #[test]
    fn degenerate_shapes_are_what_they_are() {
        let (a, b) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 4.0, 6.0));
        assert_eq!(Shape::segment(a, a), Shape::Point(a));
        assert_eq!(Shape::triangle(a, a, a), Shape::Point(a));
        assert_eq!(Shape::triangle(a, b, (a + b) * 0.5), Shape::Segment(a, b));
    }
}
