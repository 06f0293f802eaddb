//! Dry friction: Coulomb's law on a patch, solved for the velocity at the end of the sub-step, and a bristle that
//! makes sticking true: it remembers how far the patch has slipped and takes it back.

use super::press::{Carriers, Grip, Material};
use crate::base::Motion;
use crate::math::{Mat3, Vec3, Wrench, tangents};

/// What a sticking patch remembers.
#[derive(Clone, Copy, Debug)]
pub struct Bristle {
    /// What names the patch, [`Patch::key`](super::patch::Patch::key).
    pub key: [u32; 3],
    /// How far b has slipped over a since they stuck \[m\].
    pub slip: Vec3,
    /// How far it has turned about the normal \[rad\].
    pub turn: f64,
    /// It slides: the dynamic coefficient holds.
    pub sliding: bool,
    /// It was seen in this sub-step.
    pub seen: bool,
}

/// Where a patch is, for its bristle.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// What names the patch, [`Patch::key`](super::patch::Patch::key).
    pub key: [u32; 3],
    /// Centre of pressure, in the pair's frame.
    pub position: Vec3,
    /// Mean normal, from a to b.
    pub normal: Vec3,
}

/// Part of a bristle's bend that is taken back in one sub-step.
const RECOVERY: f64 = 0.2;

/// Moves the patch's bristle along with what happened since the last sub-step, or sets a new one.
pub fn bend(
    bristles: &mut Vec<Bristle>,
    place: &Place,
    carriers: &Carriers,
    motions: &[Motion],
    origin: &Vec3,
    h: f64,
) {
    let index = bristles.iter().position(|bristle| bristle.key == place.key).unwrap_or_else(|| {
        bristles.push(Bristle { key: place.key, slip: Vec3::zeros(), turn: 0.0, sliding: false, seen: false });
        bristles.len() - 1
    });
    let bristle = &mut bristles[index];
    bristle.seen = true;
    if bristle.sliding {
        return;
    }
    // The velocities are still those of the drift that led here.
    let moved = bristle.slip + carriers.slip(motions, origin, &place.position) * h;
    bristle.slip = moved - place.normal * moved.dot(&place.normal);
    bristle.turn += carriers.spin(motions).dot(&place.normal) * h;
}

/// Applies dry friction to a patch for `h` seconds.
///
/// The impulse that would stop the slip, or bring it to the bristle's recovery, is found from the full tangential
/// mobility; where it exceeds the coefficient times the normal impulse it is cut to that. Torsional friction likewise,
/// with the pressure's mean lever.
pub fn rub(
    grip: &Grip,
    material: &Material,
    mut bristle: Option<&mut Bristle>,
    h: f64,
    carriers: &Carriers,
    motions: &mut [Motion],
    origin: &Vec3,
) {
    let sticking = bristle.as_ref().is_some_and(|bristle| !bristle.sliding);
    let coefficient = if sticking { material.static_friction } else { material.friction };
    let target = match &bristle {
        Some(bristle) if sticking => (bristle.slip * (-RECOVERY / h), bristle.turn * (-RECOVERY / h)),
        _ => (Vec3::zeros(), 0.0),
    };
    let (e1, e2) = tangents(&grip.normal);
    let slip = carriers.slip(motions, origin, &grip.position) - target.0;
    let mobility = carriers.mobility(motions, origin, &grip.position);
    let mut stop = stopping_impulse(&mobility, &e1, &e2, &slip);
    let limit = coefficient * grip.load * h;
    let held = stop.norm() <= limit;
    if !held {
        stop *= material.friction.min(coefficient) * grip.load * h / stop.norm();
    }
    carriers.push(motions, origin, &grip.position, &Wrench { force: stop, torque: Vec3::zeros() });

    let spin_mobility = carriers.spin_mobility(motions, &grip.normal);
    if spin_mobility > 0.0 {
        let spin = carriers.spin(motions).dot(&grip.normal) - target.1;
        let limit = limit * grip.radius;
        let stop = -spin / spin_mobility;
        let twist = stop.clamp(-limit, limit);
        if twist != stop
            && let Some(bristle) = &mut bristle
        {
            // It turns on: what has slipped is lost.
            bristle.turn = 0.0;
        }
        let impulse = Wrench { force: Vec3::zeros(), torque: grip.normal * twist };
        carriers.push(motions, origin, &grip.position, &impulse);
    }
    if let Some(bristle) = bristle {
        bristle.sliding = !held;
        if !held {
            bristle.slip = Vec3::zeros();
            bristle.turn = 0.0;
        }
    }
}

/// The impulse in the plane of `e1` and `e2` that takes away the slip in that plane.
fn stopping_impulse(mobility: &Mat3, e1: &Vec3, e2: &Vec3, slip: &Vec3) -> Vec3 {
    let (m1, m2) = (mobility * e1, mobility * e2);
    let (a, b, c) = (e1.dot(&m1), e1.dot(&m2), e2.dot(&m2));
    let determinant = a * c - b * b;
    if determinant <= 0.0 {
        return Vec3::zeros();
    }
    let (s1, s2) = (slip.dot(e1), slip.dot(e2));
    e1 * (-(c * s1 - b * s2) / determinant) + e2 * (-(a * s2 - b * s1) / determinant)
}
