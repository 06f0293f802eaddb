//! Overload: loads past the most that a contact can carry.
//!
//! A coat's compression has an end. Two unequal balls carry less when pressed together beyond a depth that goes with
//! the ratio of their radii, a ball whose core reaches the surface of a hard body carries no more, and a ball wholly inside another
//! feels no force at all (docs/model.md, "Overload"). The contact of two round coats of the same thicknesses tells
//! where that is: exact for balls; shapes with faces count as half-spaces with an end to their core.

use super::closed_form::{Round, contact};
use super::deepest::Approach;
use super::pair::{Pair, Side};
use crate::field::Shape;
use crate::field::separation::interval;

/// A skeleton as a round coat, and how much flesh it has in all, its solid core included.
fn round(side: &Side, skeleton: usize) -> (Round, f64) {
    let placed = &side.skeletons[skeleton];
    let (plane, core) = match &placed.shape {
        Shape::Point(_) | Shape::Segment(..) => (false, 0.0),
        // A face is pressed through when its field can rise no more, which under the cap is before its distance is nil.
        Shape::Triangle(..) => (true, -0.5 * placed.profile.cap),
        Shape::Box { half, .. } => (true, half.min()),
        Shape::Plane { .. } => (true, f64::INFINITY),
    };
    let round = Round { thickness: placed.profile.thickness, compliance: 1.0 / side.slope(skeleton), plane };
    (round, placed.profile.thickness + core)
}

/// Whether a skeleton's coat lies wholly below the surface of another, a half-space.
fn swallowed(side: &Side, skeleton: usize, ground: &Side, plane: usize) -> bool {
    let (placed, ground) = (&side.skeletons[skeleton], &ground.skeletons[plane]);
    let Shape::Plane { point, normal } = &ground.shape else { return false };
    let (_, top) = interval(&placed.shape, normal);
    top - point.dot(normal) + placed.profile.thickness <= ground.profile.thickness
}

/// Whether skeletons `i` of a and `j` of b are pressed together past the most that they can carry.
pub fn is_overloaded(pair: &Pair, i: usize, j: usize, approach: &Approach) -> bool {
    let ((a, flesh_a), (b, flesh_b)) = (round(&pair.a, i), round(&pair.b, j));
    let overlap = a.thickness + b.thickness - approach.distance;
    if overlap < 0.5 * a.thickness.min(b.thickness) {
        // No pair of round coats gives way this early.
        return false;
    }
    // A box in a box, as deep as the middle of one: further on, the way out would turn, and be through.
    if let (Shape::Box { half: a, .. }, Shape::Box { half: b, .. }) =
        (&pair.a.skeletons[i].shape, &pair.b.skeletons[j].shape)
        && -approach.distance >= a.min().min(b.min())
    {
        return true;
    }
    // Wholly under the surface of a half-space, as much presses down on it as up.
    if swallowed(&pair.a, i, &pair.b, j) || swallowed(&pair.b, j, &pair.a, i) {
        return true;
    }
    // All the flesh of one is pressed together.
    let peak = overlap / (a.compliance + b.compliance);
    let reached = |round: &Round, flesh: f64| round.compliance > 0.0 && peak * round.compliance >= flesh;
    if reached(&a, flesh_a) || reached(&b, flesh_b) {
        return true;
    }
    // A ball carries less the deeper it goes, or is swallowed.
    let (a, b) = if a.plane { (b, a) } else { (a, b) };
    if a.plane {
        return false;
    }
    let swallowed = !b.plane && approach.distance <= (a.thickness - b.thickness).abs();
    swallowed || contact(&a, &b, approach.distance).is_some_and(|axial| axial.slope >= 0.0)
}
