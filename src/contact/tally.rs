//! What the contact surfaces of a step took, by scheme.

use super::Scheme;
use super::surface::Surface;

/// Number of schemes, [`Scheme::Auto`] among them.
pub const SCHEMES: usize = 6;

/// Counts, by the number of the scheme: [`Scheme::Auto`] for what the searches took that found no patch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Patches that were integrated.
    pub patches: [u64; SCHEMES],
    /// Evaluations of a pair of fields.
    pub evaluations: [u64; SCHEMES],
}

impl Tally {
    /// Counts a surface that was integrated.
    pub fn add(&mut self, surface: &Surface) {
        let mut rest = u64::from(surface.evaluations);
        for patch in &surface.patches {
            self.patches[patch.scheme as usize] += 1;
            self.evaluations[patch.scheme as usize] += u64::from(patch.evaluations);
            rest = rest.saturating_sub(u64::from(patch.evaluations));
        }
        self.evaluations[Scheme::Auto as usize] += rest;
    }

    /// Adds the counts of another.
    pub fn merge(&mut self, other: &Tally) {
        for scheme in 0..SCHEMES {
            self.patches[scheme] += other.patches[scheme];
            self.evaluations[scheme] += other.evaluations[scheme];
        }
    }

    /// Evaluations by all schemes.
    pub fn total(&self) -> u64 {
        self.evaluations.iter().sum()
    }
}
