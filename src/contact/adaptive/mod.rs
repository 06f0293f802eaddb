//! Border-adaptive subdivision: for patches that are not star-shaped, have several deepest points, or corners.
//!
//! The contact surface is a height over a [`Sheet`](cells::Sheet), which square [`cells`] divide. A [`plane`] through the
//! deepest point, which cells cover as far as there is contact, sees all of a surface that nowhere leans over. What is
//! pressed deep into something softer is wrapped in the surface; then the sheet is its [`core`], and the heights are the
//! distances from that.

mod cells;
mod core;
mod plane;

use self::core::Core;
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

/// Estimated error beyond which the other sheet is asked as well.
const POOR: f64 = 0.1;

/// Integrates the connected patch that holds a deepest point, appending to `nodes`, and to `cells` those of the first
/// grid of a plane that hold contact, in order. Unfit when the surface is no height over a sheet.
pub fn integrate(
    target: &Target,
    workspace: &mut Workspace,
    nodes: &mut Vec<Node>,
    cells: &mut Vec<(i32, i32)>,
) -> Result<Integrated, Unfit> {
    let Some(core) = Core::new(target) else { return plane::integrate(target, workspace, nodes, cells) };
    let (first, first_cell) = (nodes.len(), cells.len());
    let core_first = core.wraps();
    let mut core = Some(core);
    let (mut best, mut evaluations) = (None::<Integrated>, 0);
    for over_core in [core_first, !core_first] {
        let (end, end_cell) = (nodes.len(), cells.len());
        let done = match core.take_if(|_| over_core) {
            Some(core) => core::integrate(core, target, &mut workspace.cells, nodes),
            None => plane::integrate(target, workspace, nodes, cells),
        };
        let (Ok(Integrated { evaluations: spent, .. }) | Err(Unfit { evaluations: spent })) = done;
        evaluations += spent;
        if let Some(done) = done.ok().filter(|done| best.is_none_or(|best| done.error < best.error)) {
            nodes.drain(first..end);
            cells.drain(first_cell..end_cell);
            best = Some(done);
        } else {
            nodes.truncate(end);
            cells.truncate(end_cell);
        }
        if best.is_some_and(|best| best.error <= POOR) {
            break;
        }
    }
    best.map(|best| Integrated { evaluations, ..best }).ok_or(Unfit { evaluations })
}
