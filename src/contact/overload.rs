//! Overload: loads past the most that a contact can carry.
//!
//! A coat's compression has an end. Two unequal balls carry less when pressed together beyond seven tenths of their
//! overlap, a ball whose core reaches the surface of a hard body carries no more, and a ball wholly inside another
//! feels no force at all (docs/model.md, "Overload"). The contact of two round coats of the same thicknesses tells
//! where that is: exact for balls, and a fair measure for other shapes, whose solid cores count as thickness.

use super::closed_form::{Round, contact};
use super::deepest::Approach;
use super::pair::{Pair, Side};
use crate::field::Shape;

fn round(side: &Side, skeleton: usize) -> (Round, f64) {
    let placed = &side.skeletons[skeleton];
    let core = if let Shape::Box { half, .. } = &placed.shape { half.min() } else { 0.0 };
    let round = Round {
        thickness: placed.profile.thickness + core,
        compliance: 1.0 / side.slope(skeleton),
        plane: matches!(placed.shape, Shape::Plane { .. }),
    };
    (round, core)
}

/// Whether skeletons `i` of a and `j` of b are pressed together past the most that they can carry.
pub fn is_overloaded(pair: &Pair, i: usize, j: usize, approach: &Approach) -> bool {
    let ((a, core_a), (b, core_b)) = (round(&pair.a, i), round(&pair.b, j));
    let (a, b) = if a.plane { (b, a) } else { (a, b) };
    let distance = approach.distance + core_a + core_b;
    let softest = (a.thickness).min(if b.plane { f64::INFINITY } else { b.thickness });
    if distance > a.thickness + b.thickness - 0.5 * softest {
        // No pair of round coats gives way this early.
        return false;
    }
    if !b.plane && distance <= (a.thickness - b.thickness).abs() {
        return true;
    }
    // One of the cores is reached, or deeper means weaker.
    let peak = (a.thickness + b.thickness - distance) / (a.compliance + b.compliance);
    let reached = |r: &Round| !r.plane && r.thickness - peak * r.compliance <= 0.0;
    reached(&a) || reached(&b) || contact(&a, &b, distance).is_none_or(|axial| axial.slope >= 0.0)
}
