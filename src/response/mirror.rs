//! The persistent mirror of a host-driven body.

/// State of a mirror between ticks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mirror {}
