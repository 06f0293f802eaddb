//! Border-adaptive subdivision: for patches that are not star-shaped, have several deepest points, or corners.
//!
//! The contact surface is a height over a [`Sheet`](cells::Sheet), which square [`cells`] divide. A [`plane`] through the
//! deepest point, which cells cover as far as there is contact, sees all of a surface that nowhere leans over. What is
//! pressed deep into something softer is wrapped in the surface; then the sheet is its [`core`], and the heights are the
//! distances from that.

mod cells;
mod core;
mod plane;

use super::column::Frame;
use super::deepest::Deepest;
use super::pair::Pair;
use super::patch::Node;

pub use plane::grid_cell;

/// What is left of an integration, and its memory.
#[derive(Debug, Default)]
pub struct Workspace {
    cells: cells::Workspace,
    spread: plane::Spread,
}

/// An integrated patch.
pub struct Integrated {
    /// Estimated relative error of its force.
    pub error: f64,
    /// Evaluations it took.
    pub evaluations: u32,
    /// Its frame.
    pub frame: Frame,
}

/// The surface leans over somewhere: it is no height over a sheet.
pub struct LeansOver {
    /// Evaluations it took to find out.
    pub evaluations: u32,
}

/// Integrates the connected patch that holds a deepest point, appending to `nodes`, and to `cells` those
/// of the first grid that hold contact, in order.
pub fn integrate(
    pair: &Pair,
    at: &Deepest,
    extent: f64,
    tolerance: f64,
    workspace: &mut Workspace,
    nodes: &mut Vec<Node>,
    cells: &mut Vec<(i32, i32)>,
) -> Result<Integrated, LeansOver> {
    let wrapped = core::integrate(pair, at, extent, tolerance, &mut workspace.cells, nodes);
    let LeansOver { evaluations: spent } = match wrapped {
        Ok(done) => return Ok(done),
        Err(lost) => lost,
    };
    let flat = plane::integrate(pair, at, extent, tolerance, workspace, nodes, cells);
    flat.map(|done| Integrated { evaluations: done.evaluations + spent, ..done })
        .map_err(|LeansOver { evaluations }| LeansOver { evaluations: evaluations + spent })
}
