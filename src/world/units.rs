//! Units: whether a body's stiffness can carry its weight, and whether its speed suits its thickness; and the stiffness
//! that a user gives as a sink or a frequency.

use std::f64::consts::PI;

use super::desc::{LinkDesc, StiffnessRule};
use super::{Body, Skeleton, World};
use crate::base::{Kind, Motion};
use crate::field::Shape;

/// What has been said about a body's units since its last change.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Said {
    /// The static sink was looked at.
    pub sink: bool,
    /// The travel was found too long.
    pub travel: bool,
}

/// Sink that still works, as a fraction of the thickness.
const SINK: f64 = 0.25;

/// Looks at a body and says what cannot work. Gives what has now been said.
pub(super) fn check(world: &World, index: usize, motions: &[Motion], dt: f64, say: &mut dyn FnMut(&str)) -> Said {
    let body = &world.bodies[index];
    let mut said = body.units;
    let movable = || body.links.iter().map(|link| &motions[*link as usize]).filter(|motion| motion.is_movable());
    if movable().next().is_none() {
        return said;
    }
    let id = world.bodies.id_of(index);
    let skeletons = || world.skeletons_of(body).map(|(_, _, skeleton)| skeleton);
    let Some(thinnest) = skeletons().map(|skeleton| skeleton.profile.thickness).min_by(f64::total_cmp) else {
        return said;
    };
    if !said.sink {
        said.sink = true;
        let weight: f64 = movable().map(|motion| motion.acceleration.norm() / motion.inverse_mass()).sum();
        let load = |skeleton: &Skeleton| body.stiffness_scale * carried(skeleton, skeleton.profile.thickness, SINK);
        let most: f64 = skeletons().map(load).sum();
        if !body.desc.rigid && weight > most {
            say(&format!(
                "body {id:?}: its weight of {weight:.3e} N sinks it by more than a quarter of its thickness of \
                 {thinnest:.3e} m, where it carries {most:.3e} N: stiffness_scale is about {:.0} times too small for \
                 its mass and size",
                weight / most
            ));
        }
    }
    if !said.travel {
        let travel = |motion: &Motion| motion.twist.linear.norm() * dt + 0.5 * motion.acceleration.norm() * dt * dt;
        let longest = movable().map(travel).fold(0.0, f64::max);
        if longest > thinnest {
            said.travel = true;
            say(&format!(
                "body {id:?}: it travels {longest:.3e} m in a step of {dt:.3e} s, more than its thickness of \
                 {thinnest:.3e} m: shorten the step, or make the coat thicker"
            ));
        }
    }
    said
}

/// Stiffness scale \[Pa\] and dissipation \[s/m\] of a body by what its descriptor says, for rest on a hard floor on all
/// its skeletons, under gravity; or the standard gravity where a world has none. Flesh does not change its stiffness
/// with its volume: it is that of the coat without offsets.
pub(super) fn derive(world: &World, body: &Body) -> (f64, f64) {
    let desc = &body.desc;
    let given = (desc.stiffness_scale, desc.dissipation);
    let mass: f64 = body.links.iter().map(|link| &world.links[*link as usize].desc).map(mass_of).sum();
    let gravity = match world.desc.gravity.norm() {
        0.0 => STANDARD_GRAVITY,
        gravity => gravity,
    };
    let skeletons = || world.skeletons_of(body).map(|(_, _, skeleton)| skeleton);
    let carried_at = |sink: f64| skeletons().map(|k| carried(k, k.desc.thickness, sink)).sum::<f64>();
    let scale_at = |sink: f64| mass * gravity / carried_at(sink);
    let usable = |scale: f64| scale.is_finite() && scale > 0.0;
    match desc.stiffness {
        StiffnessRule::Scale => given,
        StiffnessRule::Sink { fraction } => match scale_at(fraction) {
            scale if usable(scale) => (scale, desc.dissipation),
            _ => given,
        },
        StiffnessRule::Frequency { hertz, damping_ratio } => {
            let rate = 2.0 * PI * hertz;
            let thickness = skeletons().map(|skeleton| skeleton.desc.thickness);
            let thickness = thickness.fold(f64::INFINITY, f64::min);
            // w² = (dF/ds) g / F at the sink of rest, which falls as the sink grows.
            let rate2_at = |sink: f64| {
                let step = 1e-4 * sink;
                let slope = (carried_at(sink + step) - carried_at(sink - step)) / (2.0 * step * thickness);
                slope * gravity / carried_at(sink)
            };
            let (mut low, mut high) = (1e-12, 1.0);
            for _ in 0..80 {
                let middle = f64::sqrt(low * high);
                if rate2_at(middle) > rate * rate { low = middle } else { high = middle }
            }
            match scale_at(low) {
                // c = F d = 2 ζ m w with F = m g.
                scale if usable(scale) => (scale, 2.0 * damping_ratio * rate / gravity),
                _ => given,
            }
        }
    }
}

/// Gravity for worlds without \[m/s²\].
const STANDARD_GRAVITY: f64 = 9.806_65;

fn mass_of(link: &LinkDesc) -> f64 {
    if link.kind == Kind::Fixed { 0.0 } else { link.mass }
}

/// Force that a skeleton's coat of thickness `t` carries on a hard floor at a sink of this fraction of it, over the
/// stiffness scale \[m²\].
fn carried(skeleton: &Skeleton, t: f64, fraction: f64) -> f64 {
    let slope = skeleton.profile.stiffness;
    let sink = fraction * t;
    // Corners, edges and faces on the floor: ∫ of the pressure under a ball, a cylinder (chord law) and a plane.
    let corner = PI * slope * sink * sink * (t - 2.0 * sink / 3.0);
    let edge = slope * (4.0 / 3.0) * sink * (2.0 * t * sink).sqrt();
    match &skeleton.desc.shape {
        Shape::Point(_) => corner,
        Shape::Segment(a, b) => corner + edge * (b - a).norm(),
        Shape::Triangle(a, b, c) => {
            corner + edge * (b - a).norm() + slope * sink * 0.5 * (b - a).cross(&(c - a)).norm()
        }
        Shape::Box { half, .. } => corner + slope * sink * 4.0 * half.x * half.y * half.z / half.min(),
        Shape::Plane { .. } => f64::INFINITY,
    }
}
