//! The pipeline of one step.

use super::{Contact, Counters, Event};

/// What the pipeline keeps between steps, and its buffers.
#[derive(Default)]
pub(crate) struct Stepping {
    contacts: Vec<Contact>,
    events: Vec<Event>,
    counters: Counters,
}

impl Stepping {
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    pub fn events(&self) -> &[Event] {
        &self.events
    }

    pub fn counters(&self) -> Counters {
        self.counters
    }
}

impl super::World {
    /// Advances the world by `dt` seconds.
    pub fn step(&mut self, dt: f64) -> crate::error::Result<()> {
        crate::error::require("dt", dt, "> 0 and at most 10 s", |x| x > 0.0 && x <= 10.0)
    }
}
