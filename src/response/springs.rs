//! Springs in a sub-step, how many sub-steps they ask for, and springs in an implicit step.

use super::group::Member;
use crate::base::springs::{Law, Line, Spring, direction};
use crate::base::{Inertia, Motion};
use crate::math::{Mat3, Vec3, Wrench};

/// Gives the links the impulses of their springs over `h` seconds, without damping.
pub fn kick(springs: &[Spring], motions: &mut [Motion], h: f64) {
    for spring in springs {
        let line = spring.line(motions);
        let pull = spring.law.tension(line.length() - spring.law.rest_length, 0.0) * h;
        push(spring, &line, pull, motions);
    }
}

/// Damps springs for `h` seconds, one after the other: each sees what those before it have left, which keeps any number
/// of them stable. Half before everything else that acts in a sub-step and half after it, in opposite orders, it is of
/// second order, and no obstacle to rest.
pub fn damp<'a>(springs: impl Iterator<Item = &'a Spring>, motions: &mut [Motion], h: f64) {
    for spring in springs.filter(|spring| spring.law.damping > 0.0) {
        let line = spring.line(motions);
        let Some(direction) = line.direction() else { continue };
        let [a, b] = spring.links.map(|link| &motions[link as usize]);
        let mobility = a.mobility(&line.arms[0], &direction) + b.mobility(&line.arms[1], &direction);
        push(spring, &line, spring.law.damping_impulse(line.rate(), mobility, h), motions);
    }
}

/// Pulls on both ends of a spring, with an impulse.
fn push(spring: &Spring, line: &Line, pull: f64, motions: &mut [Motion]) {
    let Some(direction) = line.direction() else { return };
    for ((link, arm), force) in spring.links.into_iter().zip(&line.arms).zip([direction * pull, direction * -pull]) {
        motions[link as usize].push(&Wrench { force, torque: arm.cross(&force) });
    }
}

/// Adds to each link's square of the rate what its springs bring.
pub fn add_rates(springs: &[Spring], motions: &[Motion], rates: &mut [f64]) {
    for spring in springs {
        let rate2 = spring.rate2(motions);
        for link in spring.links.into_iter().filter(|link| motions[*link as usize].is_movable()) {
            rates[link as usize] += rate2;
        }
    }
}

/// A spring in the system of an [implicit step](super::implicit): its line where the velocities of a round led.
#[derive(Clone, Copy, Debug)]
pub struct Tie {
    /// First and last-plus-one of its two members.
    pub members: (usize, usize),
    law: Law,
    separation: Vec3,
    stretch: f64,
    /// Velocity of the second end against the first by which it came there.
    velocity: Vec3,
}

impl Tie {
    /// A spring at the poses of the trial. Its members, which come to the end of `members`, are its two ends; their
    /// `velocity` against each other is to be set.
    pub fn new(spring: &Spring, trial: &[Motion], members: &mut Vec<Member>) -> Self {
        let line = spring.line(trial);
        let first = members.len();
        for ((link, arm), weight) in spring.links.into_iter().zip(line.arms).zip([-1.0, 1.0]) {
            let turns = !matches!(trial[link as usize].inertia, Inertia::Point { .. });
            members.push(Member { link, weight, arm, turns });
        }
        Self {
            members: (first, first + 2),
            law: spring.law,
            separation: line.separation,
            stretch: line.length() - spring.law.rest_length,
            velocity: Vec3::zeros(),
        }
    }

    /// Says by which velocity it came where it is.
    pub fn set_velocity(&mut self, velocity: &Vec3) {
        self.velocity = *velocity;
    }

    /// How long it is, and how far it is stretched, where another velocity leads.
    fn lead(&self, velocity: &Vec3, h: f64) -> (Vec3, f64) {
        let moved = (velocity - self.velocity) * h;
        let separation = self.separation + moved;
        let lengths = separation.norm() + self.separation.norm();
        // The change of length as a difference of squares: what a stiff spring gives way is lost in a difference of
        // lengths.
        let change = if lengths > 0.0 { (self.separation * 2.0 + moved).dot(&moved) / lengths } else { 0.0 };
        (separation, self.stretch + change)
    }

    /// How far it is stretched where a velocity leads \[m\].
    pub fn stretch(&self, velocity: &Vec3, h: f64) -> f64 {
        self.lead(velocity, h).1
    }

    /// Force on the second end where a velocity leads, and minus its derivative by the velocity, positive semidefinite.
    pub fn respond(&self, velocity: &Vec3, h: f64) -> (Vec3, Mat3) {
        let (separation, stretch) = self.lead(velocity, h);
        // Where there is no direction there is no force along it.
        let direction = direction(&separation, velocity).unwrap_or_else(Vec3::zeros);
        let force = direction * -self.law.tension(stretch, direction.dot(velocity));
        let elastic = self.law.tangent(&direction, separation.norm(), stretch);
        (force, elastic * h + direction * direction.transpose() * self.law.damping)
    }
}

/// Whether the links that no contact pushes fall as one: then they do so exactly, seen from a frame that falls with them,
/// whatever their springs do to each other.
pub fn fall_as_one(springs: &[Spring], links: &[u32], motions: &[Motion]) -> Option<Vec3> {
    let mut movable = links.iter().map(|link| &motions[*link as usize]).filter(|motion| motion.is_movable());
    let free = |spring: &Spring| spring.links.iter().all(|link| motions[*link as usize].is_movable());
    let acceleration = movable.next()?.acceleration;
    (springs.iter().all(free) && movable.all(|motion| motion.acceleration == acceleration)).then_some(acceleration)
}
