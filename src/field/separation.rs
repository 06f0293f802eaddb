//! How far two bounded shapes are apart, or inside one another, along the axis that says most.
//!
//! Two convex polytopes are apart exactly when they are apart along a face's normal of either or along a cross product
//! of an edge of each. When they meet, the axis of the smallest overlap is the shortest way out.

use super::skeleton::{Shape, closest_points};
use crate::math::{Pose, Vec3, tangents};

/// Two shapes along an axis.
#[derive(Clone, Copy, Debug)]
pub struct Separation {
    /// Distance along the axis: negative when the shapes meet, and then the smallest overlap of all \[m\].
    pub distance: f64,
    /// The axis: a unit vector from a to b.
    pub direction: Vec3,
}

/// Up to as many directions as a shape has edges or faces of.
#[derive(Default)]
struct Directions {
    items: [Vec3; 4],
    count: usize,
}

impl Directions {
    fn add(&mut self, direction: Vec3) {
        self.items[self.count] = direction;
        self.count += 1;
    }

    fn iter(&self) -> impl Iterator<Item = &Vec3> {
        self.items[..self.count].iter()
    }
}

fn edges(shape: &Shape) -> Directions {
    let mut directions = Directions::default();
    match shape {
        Shape::Point(_) | Shape::Plane { .. } => {}
        Shape::Segment(a, b) => directions.add((b - a).normalize()),
        Shape::Triangle(a, b, c) => {
            [b - a, c - b, a - c].map(|edge| directions.add(edge.normalize())).into_iter().collect()
        }
        Shape::Box { axes, .. } => (0..3).for_each(|axis| directions.add(axes.column(axis).into_owned())),
    }
    directions
}

/// Normals of the faces; of a triangle also those of its edges in its plane, for others in the same plane.
fn normals(shape: &Shape) -> Directions {
    match shape {
        Shape::Triangle(a, b, c) => {
            let normal = (b - a).cross(&(c - a)).normalize();
            let mut directions = Directions::default();
            directions.add(normal);
            edges(shape).iter().for_each(|edge| directions.add(edge.cross(&normal)));
            directions
        }
        Shape::Box { .. } => edges(shape),
        _ => Directions::default(),
    }
}

/// The lowest and the highest of a bounded shape along a direction.
pub fn interval(shape: &Shape, direction: &Vec3) -> (f64, f64) {
    let among = |points: &[Vec3]| {
        points
            .iter()
            .map(|p| p.dot(direction))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    match shape {
        Shape::Point(a) => among(&[*a]),
        Shape::Segment(a, b) => among(&[*a, *b]),
        Shape::Triangle(a, b, c) => among(&[*a, *b, *c]),
        Shape::Box { center, half, axes } => {
            let (middle, extent) = (center.dot(direction), axes.tr_mul(direction).abs().dot(half));
            (middle - extent, middle + extent)
        }
        Shape::Plane { .. } => (f64::NEG_INFINITY, f64::INFINITY),
    }
}

/// How far b is beyond a along a unit vector \[m\].
pub fn gap(a: &Shape, b: &Shape, direction: &Vec3) -> f64 {
    interval(b, direction).0 - interval(a, direction).1
}

/// The axis along which two bounded shapes are farthest apart, or the shortest way out when they meet.
pub fn separation(a: &Shape, b: &Shape) -> Separation {
    let mut best = Separation { distance: f64::NEG_INFINITY, direction: Vec3::zeros() };
    let mut consider = |axis: &Vec3, margin: f64| {
        for direction in [*axis, -axis] {
            let distance = gap(a, b, &direction);
            if distance > best.distance + margin {
                best = Separation { distance, direction };
            }
        }
    };
    let (normals_a, normals_b) = (normals(a), normals(b));
    normals_a.iter().chain(normals_b.iter()).for_each(|axis| consider(axis, 0.0));
    let (edges_a, edges_b) = (edges(a), edges(b));
    let mut crossing = false;
    for edge_a in edges_a.iter() {
        for edge_b in edges_b.iter() {
            let cross = edge_a.cross(edge_b);
            let sine = cross.norm();
            if sine > 1e-6 {
                crossing = true;
                // A face's normal is the steadier one of two that are as good.
                consider(&(cross / sine), 1e-12 * gap(a, b, &(cross / sine)).abs());
            }
        }
    }
    let none = normals_a.count + normals_b.count == 0 && !crossing;
    if none {
        // Points, and segments in one line, that meet: all ways across are as short.
        let along = edges_a.iter().chain(edges_b.iter()).next().copied();
        consider(&along.map_or(Vec3::z(), |along| tangents(&along).0), 0.0);
    }
    best
}

/// A point of a where two bounded shapes that meet would touch, once b were moved out along their separation.
pub fn touching_point(a: &Shape, b: &Shape, out: &Separation) -> Vec3 {
    let height = |shape: &Shape| {
        let (low, high) = interval(shape, &out.direction);
        high - low
    };
    // A little apart the closest points are found at once.
    let shift = out.direction * (height(a).max(height(b)) - out.distance);
    let moved = b.transformed(&Pose { position: shift, ..Pose::default() });
    // Those from the middle of either: half way between them is nearer the middle of two faces.
    0.5 * (closest_points(a, &moved).0 + closest_points(&moved, a).1)
}

#[cfg(test)]
mod tests {
    use super::super::skeleton::tests::shapes;
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_way_out_ends_the_meeting_and_none_is_shorter(
            a in shapes(),
            b in shapes(),
            (x, y, z) in (-1.0..1.0f64, -1.0..1.0f64, -1.0..1.0f64),
        ) {
            let bounded = |shape: &Shape| !matches!(shape, Shape::Plane { .. });
            let other = Vec3::new(x, y, z);
            prop_assume!(bounded(&a) && bounded(&b) && other.norm() > 0.1);
            let out = separation(&a, &b);
            prop_assert!((out.direction.norm() - 1.0).abs() < 1e-9);
            let place = |by: Vec3| b.transformed(&Pose { position: by, ..Pose::default() });
            if out.distance > 0.0 {
                let (on_a, on_b) = closest_points(&a, &b);
                prop_assert!((on_b - on_a).norm() >= out.distance - 1e-9);
            } else {
                // Moved out by the overlap, the two touch; along no other direction are they apart sooner.
                prop_assert!(gap(&a, &place(out.direction * -out.distance), &out.direction).abs() < 1e-9);
                prop_assert!(gap(&a, &b, &other.normalize()) <= out.distance + 1e-9);
                let touch = touching_point(&a, &b, &out);
                prop_assert!(a.closest(&touch).distance < 1e-9);
                prop_assert!(place(out.direction * -out.distance).closest(&touch).distance < 0.02);
            }
        }
    }
}
