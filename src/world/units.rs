//! Units: whether a body's stiffness can carry its weight, and whether its speed suits its thickness.

use std::f64::consts::PI;

use super::World;
use crate::base::Motion;
use crate::field::{Placed, Shape};

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
        let load = |skeleton: &super::Skeleton| {
            let slope = body.desc.stiffness_scale * skeleton.profile.stiffness;
            carried(&Placed { shape: skeleton.desc.shape, profile: skeleton.profile }, slope)
        };
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

/// Force that a skeleton's coat carries on a hard floor at the deepest sink that works.
fn carried(placed: &Placed, slope: f64) -> f64 {
    let t = placed.profile.thickness;
    let sink = SINK * t;
    // Corners, edges and faces on the floor: ∫ of the pressure under a ball, a cylinder (chord law) and a plane.
    let corner = PI * slope * sink * sink * (t - 2.0 * sink / 3.0);
    let edge = slope * (4.0 / 3.0) * sink * (2.0 * t * sink).sqrt();
    match &placed.shape {
        Shape::Point(_) => corner,
        Shape::Segment(a, b) => corner + edge * (b - a).norm(),
        Shape::Triangle(a, b, c) => {
            corner + edge * (b - a).norm() + slope * sink * 0.5 * (b - a).cross(&(c - a)).norm()
        }
        Shape::Box { half, .. } => corner + slope * sink * 4.0 * half.x * half.y * half.z / half.min(),
        Shape::Plane { .. } => f64::INFINITY,
    }
}
