//! Border-adaptive subdivision: for patches that are not star-shaped, have several deepest points, or corners.
//!
//! The contact surface is a height over a [`Sheet`](cells::Sheet), which square [`cells`] divide. A [`plane`] through the
//! deepest point, which cells cover as far as there is contact, sees all of a surface that nowhere leans over. What is
//! pressed deep into something softer is wrapped in the surface; then the sheet is its [`core`], and the heights are the
//! distances from that.

mod cells;
mod core;
mod plane;

use super::patch::Node;
use super::target::{Integrated, Target, Unfit};

pub use plane::grid_cell;

/// What is left of an integration, and its memory.
#[derive(Debug, Default)]
pub struct Workspace {
    cells: cells::Workspace,
    spread: plane::Spread,
}

/// Part of `|Φ|` elsewhere to which heights are solved here, so that a symmetric contact comes out symmetric: no guess
/// from a neighbour shows.
const SOLVED: f64 = 1e-2;

/// Integrates the connected patch that holds a deepest point, appending to `nodes`, and to `cells` those of the first
/// grid that hold contact, in order. Unfit when the surface is no height over a sheet.
pub fn integrate(
    target: &Target,
    workspace: &mut Workspace,
    nodes: &mut Vec<Node>,
    cells: &mut Vec<(i32, i32)>,
) -> Result<Integrated, Unfit> {
    let spent = match core::integrate(target, &mut workspace.cells, nodes) {
        Ok(done) => return Ok(done),
        Err(Unfit { evaluations }) => evaluations,
    };
    let flat = plane::integrate(target, workspace, nodes, cells);
    flat.map(|done| Integrated { evaluations: done.evaluations + spent, ..done })
        .map_err(|Unfit { evaluations }| Unfit { evaluations: evaluations + spent })
}
