//! The clock, for those who ask how long a step takes. Nothing of it reaches the physics.

use std::time::Instant;

/// Measures what follows each other; or nothing, and then it does not read the clock.
#[derive(Clone, Copy, Debug)]
pub struct Clock(Option<Instant>);

impl Clock {
    /// Starts, if it is `wanted`.
    pub fn start(wanted: bool) -> Self {
        Self(wanted.then(Instant::now))
    }

    /// Adds the time since the start or the last call \[s\].
    pub fn lap(&mut self, sum: &mut f64) {
        if let Some(last) = &mut self.0 {
            let now = Instant::now();
            *sum += (now - *last).as_secs_f64();
            *last = now;
        }
    }
}
