//! A candidate: two bodies that may touch in this step, and what is remembered of them from the last.

use super::friction::Bristle;
use super::pair::Pair;
use super::patch::Sums;
use super::press::Material;
use super::surface::Surface;
use crate::handle::RawId;

/// Two bodies whose bounds meet.
#[derive(Debug, Default)]
pub struct Candidate {
    /// Slots of the bodies, the smaller first.
    pub bodies: [u32; 2],
    /// The link whose centre of mass is the origin of the pair's frame.
    pub lead: u32,
    /// Their coats.
    pub pair: Pair,
    /// How they rub and damp.
    pub material: Material,
    /// Their contact surface at the last evaluation.
    pub surface: Surface,
    /// What each of its patches came to.
    pub loads: Vec<Sums>,
    /// What lasts from step to step.
    pub memory: Memory,
}

/// What lasts from step to step while two bodies are candidates.
#[derive(Debug, Default)]
pub struct Memory {
    /// The bodies' handles, for the event that ends the contact.
    pub ids: [RawId; 2],
    /// They touched at the end of the last step.
    pub touching: bool,
    /// They touched at some time in this step.
    pub touched: bool,
    /// They were pressed past the most that they can carry in this step.
    pub overloaded: bool,
    /// They already were in the last step.
    pub was_overloaded: bool,
    /// Square of the largest rate since they touched: sub-steps never get coarser during a contact \[1/s²\].
    pub rate2: f64,
    /// One a sticking patch.
    pub bristles: Vec<Bristle>,
}

impl Memory {
    /// Forgets all but the room for bristles.
    pub fn forget(&mut self) {
        let mut bristles = std::mem::take(&mut self.bristles);
        bristles.clear();
        *self = Memory { bristles, ..Memory::default() };
    }
}
