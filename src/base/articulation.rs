//! Articulations: links of a host that its joints hold together, so that a push on one moves all of them.

use nalgebra::Matrix6;

use super::motion::{Inertia, Motion, answer};
use crate::math::{Twist, Wrench};

/// Numbers of a link's twist or wrench.
const SIX: usize = 6;

/// Links that move each other.
#[derive(Clone, Debug, Default)]
pub struct Articulation {
    /// Their slots, each once.
    pub links: Vec<u32>,
    /// From impulses on all of them, about their centres of mass, to the changes of all their velocities, in the world:
    /// row by row, six a link, linear before angular.
    pub inverse_inertia: Vec<f64>,
}

impl Articulation {
    /// What a unit impulse on the link at `from` does to the one at `to`; both are places in the list.
    pub fn block(&self, to: usize, from: usize) -> Matrix6<f64> {
        let width = SIX * self.links.len();
        Matrix6::from_fn(|row, column| self.inverse_inertia[(SIX * to + row) * width + SIX * from + column])
    }

    /// Gives those that can move the inertia that they have while nobody pushes the others.
    pub fn set_inertias(&self, motions: &mut [Motion]) {
        for (place, link) in self.links.iter().enumerate() {
            let motion = &mut motions[*link as usize];
            if motion.is_movable() {
                motion.inertia = Inertia::Effective(self.block(place, place));
            }
        }
    }

    /// Moves the others, as far as `moves` says of their slots, by an impulse on the link at `from`.
    pub fn pass_on(&self, from: usize, impulse: &Wrench, motions: &mut [Motion], moves: impl Fn(u32) -> bool) {
        for (to, link) in self.links.iter().enumerate() {
            if to != from && motions[*link as usize].is_movable() && moves(*link) {
                let Twist { linear, angular } = answer(&self.block(to, from), impulse);
                let twist = &mut motions[*link as usize].twist;
                twist.linear += linear;
                twist.angular += angular;
            }
        }
    }
}
