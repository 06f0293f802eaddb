//! What a scheme is asked, and what it answers.

use super::column::{Frame, Solver};
use super::deepest::Deepest;
use super::pair::Pair;

/// What a scheme is asked to integrate: the connected patch that holds a deepest point.
#[derive(Clone, Copy, Debug)]
pub struct Target<'a> {
    /// The two coats.
    pub pair: &'a Pair,
    /// The deepest point.
    pub at: &'a Deepest,
    /// Farthest that the patch can go from there \[m\].
    pub extent: f64,
    /// Relative error accepted in the force.
    pub tolerance: f64,
}

impl<'a> Target<'a> {
    /// A solver over a plane, aimed at this.
    pub fn solver(&self, frame: Frame) -> Solver<'a> {
        let mut solver = Solver { pair: self.pair, frame, accept: 0.0, border_step: 0.0, evaluations: 0 };
        solver.aim(self.at.sum, self.tolerance);
        solver
    }
}

/// An integrated patch.
#[derive(Clone, Copy, Debug)]
pub struct Integrated {
    /// Estimated relative error of its force.
    pub error: f64,
    /// Evaluations it took.
    pub evaluations: u32,
    /// Its frame.
    pub frame: Frame,
}

/// The patch is none for the scheme that was asked.
#[derive(Clone, Copy, Debug)]
pub struct Unfit {
    /// Evaluations it took to find out.
    pub evaluations: u32,
}
