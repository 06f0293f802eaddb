//! Contact: where two coats meet, and with what pressure.
//!
//! [`pair`] puts two coats into one frame; [`deepest`] finds where they meet; [`closed_form`], [`facets`], [`polar`],
//! [`adaptive`] and [`seeds`] integrate the surface, each in its own way, and [`surface`] chooses among them.

pub mod adaptive;
pub mod broad_phase;
pub mod candidate;
pub mod closed_form;
pub mod column;
pub mod deepest;
pub mod facets;
pub mod friction;
pub mod overload;
pub mod pair;
pub mod patch;
pub mod polar;
pub mod press;
pub mod seeds;
pub mod standing;
pub mod stiffness;
pub mod surface;
pub mod tally;
mod target;

/// How the contact surface is integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Scheme {
    /// The cheapest that meets the tolerance.
    #[default]
    Auto,
    /// Closed form; pairs without one as [`Scheme::Auto`].
    ClosedForm,
    /// Polar Gauss patch round the deepest point.
    Polar,
    /// Border-adaptive subdivision.
    Adaptive,
    /// Energy-consistent seeds, the papers' sampling.
    Seeds,
    /// Flat faces and straight edges with their strips and fans; pairs without them as [`Scheme::Auto`].
    Facets,
}
