//! Explicit response: the force at the pose of the beginning, for the whole step.

use super::substep::{Island, Work, advance};
use crate::base::Motion;
use crate::contact::candidate::Candidate;
use crate::contact::surface::Settings;
use crate::team::Team;

/// Advances an island by one step of semi-implicit Euler.
pub fn step(
    motions: &mut [Motion],
    island: &Island,
    candidates: &mut [Candidate],
    dt: f64,
    settings: &Settings,
    work: &mut Work,
    team: &Team,
) {
    advance(motions, island, candidates, dt, 0.0, settings, true, work, team);
}
