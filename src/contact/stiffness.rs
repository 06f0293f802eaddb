//! The largest stiffness that a contact can reach within a step: what the sub-steps must resolve.
//!
//! Today's patch does not tell: a ball that is about to hit, or a box that stands on its edge, will be far stiffer in a
//! moment. So the area is bounded by the shapes: the flat part of a skeleton, a strip along its edges and a cap at its
//! corners, as wide as the deepest overlap within reach makes them.

use std::f64::consts::PI;

use super::pair::Pair;
use crate::field::Shape;

/// Flat area, and length of edge round it, that a shape can lay on another.
struct Footprint {
    face: f64,
    edge: f64,
    /// Length of its longest side.
    length: f64,
}

fn footprint(shape: &Shape) -> Option<Footprint> {
    match shape {
        Shape::Point(_) => Some(Footprint { face: 0.0, edge: 0.0, length: 0.0 }),
        Shape::Segment(a, b) => {
            let length = (b - a).norm();
            Some(Footprint { face: 0.0, edge: 2.0 * length, length })
        }
        Shape::Triangle(a, b, c) => Some(Footprint {
            face: 0.5 * (b - a).cross(&(c - a)).norm(),
            edge: (b - a).norm() + (c - b).norm() + (a - c).norm(),
            length: (b - a).norm().max((c - b).norm()).max((a - c).norm()),
        }),
        Shape::Box { half, .. } => {
            let mut sides = [2.0 * half.x, 2.0 * half.y, 2.0 * half.z];
            sides.sort_by(f64::total_cmp);
            Some(Footprint { face: sides[1] * sides[2], edge: 2.0 * (sides[1] + sides[2]), length: sides[2] })
        }
        Shape::Plane { .. } => None,
    }
}

/// Bounds of a contact of two skeletons.
#[derive(Clone, Copy, Debug)]
pub struct Reachable {
    /// Normal stiffness \[N/m\].
    pub stiffness: f64,
    /// Square of the patch's radius of gyration: the lever that its own size gives it on a turn \[m²\].
    pub gyration2: f64,
}

/// Bounds for skeletons `i` and `j` when their coats overlap by at most `overlap`.
pub fn reachable(pair: &Pair, i: usize, j: usize, overlap: f64) -> Reachable {
    let (a, b) = (&pair.a.skeletons[i], &pair.b.skeletons[j]);
    let (ta, tb) = (a.profile.thickness, b.profile.thickness);
    let overlap = overlap.clamp(0.0, ta + tb);
    // Half width of the strip: the chord of the rounding on something flat, and of both where both are round all over.
    let chord2 = |t: f64| (2.0 * t * overlap).min(t * t);
    let chords2 = match (&a.shape, &b.shape) {
        (Shape::Point(_), Shape::Point(_)) => {
            let t = ta * tb / (ta + tb);
            [(2.0 * t * overlap).min(ta.min(tb).powi(2)); 2]
        }
        _ => [chord2(ta), chord2(tb)],
    };
    // The patch is within what either would lay on something flat.
    let within = |bound: fn(&Footprint, f64) -> f64| {
        let of = |shape: &Shape, c2: f64| footprint(shape).map_or(f64::INFINITY, |footprint| bound(&footprint, c2));
        of(&a.shape, chords2[0]).min(of(&b.shape, chords2[1]))
    };
    let area = within(|footprint, c2| footprint.face + footprint.edge * c2.sqrt() + PI * c2);
    // A uniform bar of this length with round ends.
    let length = within(|footprint, c2| if footprint.length > 0.0 { footprint.length + 2.0 * c2.sqrt() } else { 0.0 });
    let gyration2 = length.powi(2) / 12.0;
    let slope = |side: &super::pair::Side, skeleton: usize| {
        let profile = &side.skeletons[skeleton].profile;
        let depth = (overlap / profile.thickness).min(1.0);
        side.slope(skeleton) * (1.0 + (profile.stiffening - 1.0).max(0.0) * depth)
    };
    let (ga, gb) = (slope(&pair.a, i), slope(&pair.b, j));
    let series = 1.0 / (1.0 / ga + 1.0 / gb);
    Reachable { stiffness: series * area, gyration2 }
}
