//! Explicit response: the force at the pose of the beginning, for the whole step.

use super::substep::Step;

/// Advances an island by one step of semi-implicit Euler. Gives how many there were, and the time that is left: all of
/// it where an overload leaves the step to others.
pub fn step(step: &mut Step, dt: f64) -> (u32, f64) {
    if step.advance(dt, 0.0, true) { (1, 0.0) } else { (0, dt) }
}
