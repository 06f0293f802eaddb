//! Seeds: the fixed, well distributed rays that a skeleton sends out to sample its coat.
//!
//! Every point at distance `r` from a convex shape is `X = y + r u`: a foot `y` on the shape and a unit direction `u`
//! of the shape's normal cone at that foot. A ray stands for the measure `weight` of such pairs `(y, u)`, so that
//! the volume element is `J(r) dr · weight` with `J(r) = r^power` (docs/model.md, "Volume and vector-area elements";
//! it generalises \[97, eq. (22)\] from points to every shape):
//!
//! | part                                        | measure   | power |
//! | ------------------------------------------- | --------- | ----- |
//! | point; fan of a segment's end, of a corner  | `dω`      | 2     |
//! | tube round a segment or along an edge       | `dφ ds`   | 1     |
//! | face                                        | `dA`      | 0     |
//!
//! The weights of each part add up to its measure, so areas and volumes of an isolated coat are exact at any number of
//! rays (Steiner's formula). Inside a part the rays form a lattice that steps by the golden ratio, which stays even
//! at any aspect ratio, all of the same weight. The same input gives the same rays.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use crate::field::Shape;
use crate::math::{Pose, Vec3, tangents};

/// A ray from a skeleton outwards, and the share of the coat it stands for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts on the skeleton \[m\].
    pub foot: Vec3,
    /// Unit direction; the distance to the skeleton grows along it by exactly the length walked.
    pub direction: Vec3,
    /// Measure of feet and directions that it stands for: \[sr\], \[rad m\] or \[m²\] for power 2, 1 or 0.
    pub weight: f64,
    /// Exponent of the Jacobian `J(r) = r^power`.
    pub power: u8,
    /// How far the ray reaches back into a solid core before another face is nearer \[m\]: along it the signed
    /// distance runs from `-core`. Zero for thin shapes, edges and corners; infinite for planes.
    pub core: f64,
}

impl Ray {
    /// The point at distance `r` from the foot \[m\].
    pub fn at(&self, r: f64) -> Vec3 {
        self.foot + self.direction * r
    }

    /// The Jacobian `J(r)`: `weight · J(r)` is the area this ray stands for on the offset surface at `r >= 0` \[m²\].
    pub fn jacobian(&self, r: f64) -> f64 {
        match self.power {
            0 => 1.0,
            1 => r,
            _ => r * r,
        }
    }

    /// The volume this ray stands for between the skeleton and the offset surface at `r >= 0` \[m³\].
    pub fn volume(&self, r: f64) -> f64 {
        self.weight * self.jacobian(r) * r / f64::from(self.power + 1)
    }

    /// The ray moved by a pose.
    pub fn transformed(&self, pose: &Pose) -> Ray {
        Ray { foot: pose.transform_point(&self.foot), direction: pose.rotation * self.direction, ..*self }
    }
}

/// Appends the rays of a shape that carries a coat of this thickness \[m\], in the frame of the shape.
///
/// `count` rays are split over the parts of the shape (faces, edges, corners) in proportion to their share of the
/// offset surface at `thickness`; each part gets at least one, so there are `max(count, number of parts)`: at least 1
/// for a point, 3 for a segment, 8 for a triangle, 26 for a box. A plane has no bounds and gets none: see
/// [`plane_rays`].
pub fn rays(shape: &Shape, thickness: f64, count: usize, out: &mut Vec<Ray>) {
    let parts = parts(shape);
    let areas: Vec<f64> = parts.iter().map(|part| part.area(thickness)).collect();
    for (part, n) in parts.iter().zip(apportion(&areas, count)) {
        part.emit(n, out);
    }
}

/// Appends the columns of a square lattice on a plane's boundary that cover a box: directions along the normal, feet on
/// the boundary, weight `spacing²`.
///
/// The lattice is fixed to the plane (its nodes lie `spacing` apart from `point` along [`tangents`] of the normal), so
/// the same columns come back wherever the box `[low, high]` moves; all lengths in metres, the box finite. The solid
/// lies at negative `r`, down to minus infinity.
pub fn plane_rays(point: &Vec3, normal: &Vec3, spacing: f64, low: &Vec3, high: &Vec3, out: &mut Vec<Ray>) {
    let (e1, e2) = tangents(normal);
    let (center, half) = ((low + high) * 0.5 - point, (high - low) * 0.5);
    // The shadow of the box along one tangent, in steps of the lattice.
    let steps = |e: &Vec3| {
        let (middle, reach) = (center.dot(e), half.dot(&e.abs()));
        (((middle - reach) / spacing).ceil() as i64, ((middle + reach) / spacing).floor() as i64)
    };
    let (rows, columns) = (steps(&e1), steps(&e2));
    for i in rows.0..=rows.1 {
        for j in columns.0..=columns.1 {
            let foot = point + e1 * (i as f64 * spacing) + e2 * (j as f64 * spacing);
            out.push(Ray { foot, direction: *normal, weight: spacing * spacing, power: 0, core: f64::INFINITY });
        }
    }
}

/// Volume of a shape that is solid \[m³\]: what lies within it, and no ray counts. Zero for thin shapes, infinite for
/// planes.
pub fn core_volume(shape: &Shape) -> f64 {
    match shape {
        Shape::Box { half, .. } => 8.0 * half.x * half.y * half.z,
        Shape::Plane { .. } => f64::INFINITY,
        Shape::Point(_) | Shape::Segment(..) | Shape::Triangle(..) => 0.0,
    }
}

/// One piece of a shape's normal bundle.
enum Part {
    /// Directions from one foot: `z` along `axis` from `low` to 1, azimuth from `e1` towards `e2` by `angle`.
    Fan { foot: Vec3, e1: Vec3, e2: Vec3, axis: Vec3, low: f64, angle: f64 },
    /// Directions square to the line `from + s along`, `s` in 0..1, turning from `e1` towards `e2` by `angle`.
    Tube { from: Vec3, along: Vec3, e1: Vec3, e2: Vec3, angle: f64 },
    /// A face of a box: `center ± long ± short`, half of a box whose depth from this face is `depth`.
    Rectangle { center: Vec3, long: Vec3, short: Vec3, normal: Vec3, depth: f64 },
    /// One side of a triangle.
    Facet { corners: [Vec3; 3], normal: Vec3 },
}

fn parts(shape: &Shape) -> Vec<Part> {
    let mut parts = Vec::new();
    match shape {
        Shape::Point(a) => {
            let (e1, e2, axis) = (Vec3::x(), Vec3::y(), Vec3::z());
            parts.push(Part::Fan { foot: *a, e1, e2, axis, low: -1.0, angle: TAU });
        }
        Shape::Segment(a, b) => {
            let axis = (b - a).normalize();
            let (e1, e2) = tangents(&axis);
            parts.push(Part::Tube { from: *a, along: b - a, e1, e2, angle: TAU });
            parts.push(Part::Fan { foot: *a, e1, e2: -e2, axis: -axis, low: 0.0, angle: TAU });
            parts.push(Part::Fan { foot: *b, e1, e2, axis, low: 0.0, angle: TAU });
        }
        Shape::Triangle(a, b, c) => triangle_parts([*a, *b, *c], &mut parts),
        Shape::Box { center, half, axes } => {
            let axes = [0, 1, 2].map(|k| axes.column(k).into_owned());
            box_parts(center, half, &axes, &mut parts);
        }
        Shape::Plane { .. } => {}
    }
    parts
}

fn triangle_parts(corners: [Vec3; 3], parts: &mut Vec<Part>) {
    let [a, b, c] = corners;
    let normal = (b - a).cross(&(c - a)).normalize();
    parts.push(Part::Facet { corners, normal });
    parts.push(Part::Facet { corners: [a, c, b], normal: -normal });
    let outward = |edge: &Vec3| edge.cross(&normal).normalize();
    for k in 0..3 {
        let (from, corner, to) = (corners[k], corners[(k + 1) % 3], corners[(k + 2) % 3]);
        let (edge, next) = (corner - from, to - corner);
        let e = outward(&edge);
        parts.push(Part::Tube { from, along: edge, e1: normal, e2: e, angle: PI });
        // The lune between the outward normals of the two edges, from pole to pole.
        let turn = libm::atan2(edge.cross(&next).norm(), edge.dot(&next));
        parts.push(Part::Fan { foot: corner, e1: e, e2: normal.cross(&e), axis: normal, low: -1.0, angle: turn });
    }
}

fn box_parts(center: &Vec3, half: &Vec3, axes: &[Vec3; 3], parts: &mut Vec<Part>) {
    let signs = [-1.0, 1.0];
    for k in 0..3 {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        let (long, short) = if half[i] >= half[j] { (i, j) } else { (j, i) };
        let (along, across) = (axes[long] * half[long], axes[short] * half[short]);
        for sign in signs {
            let normal = axes[k] * sign;
            let center = center + normal * half[k];
            parts.push(Part::Rectangle { center, long: along, short: across, normal, depth: half[k] });
        }
        for si in signs {
            for sj in signs {
                let (e1, e2) = (axes[i] * si, axes[j] * sj);
                let from = center + e1 * half[i] + e2 * half[j] - axes[k] * half[k];
                parts.push(Part::Tube { from, along: axes[k] * (2.0 * half[k]), e1, e2, angle: FRAC_PI_2 });
            }
        }
    }
    for corner in 0..8 {
        let sign = |k: usize| signs[corner >> k & 1];
        let [e1, e2, axis] = [0, 1, 2].map(|k| axes[k] * sign(k));
        let foot = center + e1 * half.x + e2 * half.y + axis * half.z;
        parts.push(Part::Fan { foot, e1, e2, axis, low: 0.0, angle: FRAC_PI_2 });
    }
}

impl Part {
    /// Total measure of feet and directions, and the power of the Jacobian.
    fn measure(&self) -> (f64, u8) {
        match self {
            Part::Fan { low, angle, .. } => (angle * (1.0 - low), 2),
            Part::Tube { along, angle, .. } => (angle * along.norm(), 1),
            Part::Rectangle { long, short, .. } => (4.0 * long.norm() * short.norm(), 0),
            Part::Facet { corners: [a, b, c], .. } => (0.5 * (b - a).cross(&(c - a)).norm(), 0),
        }
    }

    /// Area of the part on the offset surface at distance `r`.
    fn area(&self, r: f64) -> f64 {
        let (measure, power) = self.measure();
        measure * r.powi(i32::from(power))
    }

    fn emit(&self, n: usize, out: &mut Vec<Ray>) {
        let (measure, power) = self.measure();
        let weight = measure / n as f64;
        let mut push = |foot, direction, core| out.push(Ray { foot, direction, weight, power, core });
        match self {
            // A single ray goes through the centroid, which the lattice's first point would miss here.
            Part::Fan { foot, e1, e2, axis, low, angle } if n == 1 => {
                let middle = fan_centroid(*low, *angle);
                let direction = (e1 * middle.x + e2 * middle.y + axis * middle.z).try_normalize(1e-9).unwrap_or(*axis);
                push(*foot, direction, 0.0);
            }
            Part::Facet { corners: [a, b, c], normal } if n == 1 => push((a + b + c) / 3.0, *normal, 0.0),
            Part::Fan { foot, e1, e2, axis, low, angle } => {
                for (u, v) in lattice(n) {
                    let z = low + (1.0 - low) * u;
                    let (sine, cosine) = libm::sincos(angle * v);
                    let side = e1 * cosine + e2 * sine;
                    push(*foot, (side * ((1.0 - z) * (1.0 + z)).sqrt() + axis * z).normalize(), 0.0);
                }
            }
            Part::Tube { from, along, e1, e2, angle } => {
                for (u, v) in lattice(n) {
                    let (sine, cosine) = libm::sincos(angle * v);
                    push(from + along * u, (e1 * cosine + e2 * sine).normalize(), 0.0);
                }
            }
            Part::Rectangle { center, long, short, normal, depth } => {
                for (u, v) in lattice(n) {
                    let (x, y) = (2.0 * u - 1.0, 2.0 * v - 1.0);
                    let to_side = ((1.0 - x.abs()) * long.norm()).min((1.0 - y.abs()) * short.norm());
                    push(center + long * x + short * y, *normal, to_side.min(*depth));
                }
            }
            Part::Facet { corners: [a, b, c], normal } => {
                for (u, v) in lattice(n) {
                    // Heitz, "A low-distortion map between triangle and square" (2019): keeps areas.
                    let (s, t) = if v > u { (0.5 * u, v - 0.5 * u) } else { (u - 0.5 * v, 0.5 * v) };
                    push(a + (b - a) * s + (c - a) * t, *normal, 0.0);
                }
            }
        }
    }
}

/// Integral of the direction over a fan, in the fan's frame.
fn fan_centroid(low: f64, angle: f64) -> Vec3 {
    // The integral of sqrt(1 - z²) from `low` to 1.
    let ring = 0.5 * (FRAC_PI_2 - low * (1.0 - low * low).sqrt() - libm::asin(low));
    Vec3::new(ring * libm::sin(angle), ring * (1.0 - libm::cos(angle)), 0.5 * angle * (1.0 - low * low))
}

/// `n` evenly spread points of the unit square: even steps in the first coordinate, steps of the golden ratio in the
/// second; the set is its own mirror image about the middle of the square. Wrapped round a sphere it is the spherical
/// Fibonacci lattice.
fn lattice(n: usize) -> impl Iterator<Item = (f64, f64)> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let middle = 0.5 * (n as f64 - 1.0);
    (0..n).map(move |i| {
        let y = 0.5 + (i as f64 - middle) * GOLDEN;
        ((i as f64 + 0.5) / n as f64, y - y.floor())
    })
}

/// Splits `count` over parts in proportion to their areas, at least one each.
fn apportion(areas: &[f64], count: usize) -> Vec<usize> {
    let total: f64 = areas.iter().sum();
    let share = |area: &f64| ((count as f64 * area / total) as usize).max(1);
    let mut counts: Vec<usize> = areas.iter().map(share).collect();
    let mut sum: usize = counts.iter().sum();
    // What rounding left over goes where a ray stands for the most area; what the smallest parts took beyond their
    // share comes from where a ray stands for the least.
    let area_a_ray = |counts: &[usize], k: usize| areas[k] / counts[k] as f64;
    while sum < count && !areas.is_empty() {
        let order = |a: &usize, b: &usize| area_a_ray(&counts, *a).total_cmp(&area_a_ray(&counts, *b)).then(b.cmp(a));
        let Some(most) = (0..areas.len()).max_by(order) else { break };
        counts[most] += 1;
        sum += 1;
    }
    while sum > count {
        let order = |a: &usize, b: &usize| area_a_ray(&counts, *a).total_cmp(&area_a_ray(&counts, *b));
        let Some(least) = (0..areas.len()).filter(|k| counts[*k] > 1).min_by(order) else { break };
        counts[least] -= 1;
        sum -= 1;
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::skeleton::tests::{bounded_shapes, vectors};
    use proptest::prelude::*;

    /// Steiner's polynomial: volume of the core, its area, the integral of its mean curvature, all about the offset.
    fn steiner(shape: &Shape) -> (f64, f64, f64) {
        match shape {
            Shape::Point(_) | Shape::Plane { .. } => (0.0, 0.0, 0.0),
            Shape::Segment(a, b) => (0.0, 0.0, PI * (b - a).norm()),
            Shape::Triangle(a, b, c) => {
                let perimeter = (b - a).norm() + (c - b).norm() + (a - c).norm();
                (0.0, (b - a).cross(&(c - a)).norm(), FRAC_PI_2 * perimeter)
            }
            Shape::Box { half, .. } => {
                let (a, b, c) = (2.0 * half.x, 2.0 * half.y, 2.0 * half.z);
                (a * b * c, 2.0 * (a * b + b * c + c * a), PI * (a + b + c))
            }
        }
    }

    fn rays_of(shape: &Shape, thickness: f64, count: usize) -> Vec<Ray> {
        let mut out = Vec::new();
        rays(shape, thickness, count, &mut out);
        out
    }

    proptest! {
        #[test]
        fn areas_and_volumes_of_offsets_are_exact(
            shape in bounded_shapes(0.01), thickness in 0.01..2.0f64, r in 0.01..3.0f64, count in 4usize..300,
        ) {
            let rays = rays_of(&shape, thickness, count);
            let (core, flat, curved) = steiner(&shape);
            let area: f64 = rays.iter().map(|ray| ray.weight * ray.jacobian(r)).sum();
            let volume: f64 = rays.iter().map(|ray| ray.volume(r)).sum();
            let exact_area = flat + 2.0 * curved * r + 4.0 * PI * r * r;
            let exact_volume = core + flat * r + curved * r * r + 4.0 / 3.0 * PI * r * r * r;
            prop_assert!((area / exact_area - 1.0).abs() < 1e-12);
            prop_assert!(((core + volume) / exact_volume - 1.0).abs() < 1e-12);
            let parts = parts(&shape).len();
            prop_assert_eq!(rays.len(), count.max(parts));
        }

        #[test]
        fn distance_to_the_skeleton_grows_by_the_length_of_the_ray(
            shape in bounded_shapes(0.01), thickness in 0.01..2.0f64, r in 0.0..3.0f64, count in 4usize..300,
        ) {
            for ray in rays_of(&shape, thickness, count) {
                prop_assert!((ray.direction.norm() - 1.0).abs() < 1e-14);
                prop_assert!((shape.closest(&ray.at(r)).distance - r).abs() < 1e-12);
                prop_assert!((shape.closest_point(&ray.at(r)) - ray.foot).norm() < 1e-7);
                let inside = -0.999 * ray.core;
                prop_assert!((shape.closest(&ray.at(inside)).distance - inside).abs() < 1e-12);
            }
        }

        #[test]
        fn columns_of_a_plane_stay_where_they_are(
            point in vectors(5.0), n in vectors(1.0), center in vectors(20.0), half in vectors(2.0),
            shift in vectors(0.2), spacing in 0.1..0.5f64,
        ) {
            prop_assume!(n.norm() > 0.1);
            let (n, half) = (n.normalize(), half.map(|x| 0.5 + x.abs()));
            let columns = |center: Vec3| {
                let mut out = Vec::new();
                plane_rays(&point, &n, spacing, &(center - half), &(center + half), &mut out);
                out
            };
            let (first, moved) = (columns(center), columns(center + shift));
            for ray in &first {
                prop_assert!((ray.foot - point).dot(&n).abs() < 1e-12);
                // A column that both boxes cast a shadow on is bit for bit the same.
                prop_assert!(moved.iter().all(|m| m.foot == ray.foot || (m.foot - ray.foot).norm() > 0.5 * spacing));
            }
            // The columns cover the box: every point of it has one within half a diagonal of the lattice, but for a
            // rim of half a step.
            let inner = center + half.component_mul(&shift) * 4.0 * (1.0 - spacing / half.min()).max(0.0);
            let foot = inner - n * (inner - point).dot(&n);
            let nearest = first.iter().map(|ray| (ray.foot - foot).norm()).fold(f64::INFINITY, f64::min);
            prop_assert!(nearest <= spacing * 0.7072, "{nearest} {spacing}");
        }
    }

    /// Largest and root mean square error of the rays' share of offset surface in half-spaces through the middle: a
    /// discrepancy that thousands of random rays would need to reach.
    #[test]
    fn rays_are_spread_evenly() {
        let segment = Shape::Segment(Vec3::zeros(), Vec3::new(0.0, 0.0, 2.0));
        let triangle = Shape::Triangle(Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.5, 1.5, 0.0));
        let slab =
            Shape::Box { center: Vec3::zeros(), half: Vec3::new(1.0, 0.5, 0.2), axes: crate::math::Mat3::identity() };
        for shape in [Shape::Point(Vec3::zeros()), segment, triangle, slab] {
            let (coarse, fine) = (rays_of(&shape, 0.3, 256), rays_of(&shape, 0.3, 40_000));
            let share = |rays: &[Ray], n: &Vec3, offset: f64| {
                let area = |ray: &Ray| ray.weight * ray.jacobian(0.3);
                let inside = |ray: &&Ray| (ray.at(0.3) - shape.middle()).dot(n) < offset;
                rays.iter().filter(inside).map(area).sum::<f64>() / rays.iter().map(area).sum::<f64>()
            };
            let mut worst: f64 = 0.0;
            for direction in rays_of(&Shape::Point(Vec3::zeros()), 1.0, 50) {
                for offset in [-0.5, -0.2, 0.0, 0.1, 0.4] {
                    let n = direction.direction;
                    worst = worst.max((share(&coarse, &n, offset) - share(&fine, &n, offset)).abs());
                }
            }
            // Independent random rays would give about 2.5 / (2 sqrt(256)) = 0.08.
            assert!(worst < 0.035, "{shape:?}: {worst}");
        }
    }

    #[test]
    fn few_rays_still_reach_every_part() {
        let cube = Shape::Box { center: Vec3::zeros(), half: Vec3::repeat(1.0), axes: crate::math::Mat3::identity() };
        let rays = rays_of(&cube, 0.1, 4);
        assert_eq!(rays.len(), 26);
        let sum: Vec3 = rays.iter().map(|ray| ray.direction * ray.weight).sum();
        assert!(sum.norm() < 1e-12);
        let corner = Vec3::repeat(1.0).normalize();
        assert!(rays.iter().any(|ray| (ray.direction - corner).norm() < 1e-12));
        assert!(rays_of(&Shape::Plane { point: Vec3::zeros(), normal: Vec3::z() }, 0.1, 64).is_empty());
    }
}
