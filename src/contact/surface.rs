//! The contact surface of a pair: finds its patches and has each integrated by the cheapest scheme that meets the
//! tolerance.

use super::Scheme;
use super::closed_form::{self, Round};
use super::column::Frame;
use super::deepest::{self, Approach, Deepest};
use super::overload::is_overloaded;
use super::pair::{Pair, Side};
use super::patch::{self, Node, Patch};
use super::target::{Target, Unfit};
use super::{adaptive, facets, polar, seeds};
use crate::coat::seeds::Ray;
use crate::field::Shape;
use crate::math::Vec3;

/// What is asked of the integration.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// A scheme to take, or the choice by tolerance.
    pub scheme: Scheme,
    /// Relative error accepted in the force.
    pub tolerance: f64,
}

/// The patches of a pair and their nodes. Kept between uses for its memory.
#[derive(Debug, Default)]
pub struct Surface {
    /// The patches, the deepest first; then those that lie beside the closest places.
    pub patches: Vec<Patch>,
    /// The nodes of all patches.
    pub nodes: Vec<Node>,
    /// Skeletons pressed together past the most that they can carry, with where they come closest.
    pub overloads: Vec<(usize, usize, Approach)>,
    /// Evaluations of the two fields, fruitless ones included.
    pub evaluations: u32,
    /// What the last integration found, the deepest first.
    pub(super) maxima: Vec<Deepest>,
    /// The region of each patch.
    covered: Vec<Covered>,
    /// Skeletons within reach of each other.
    close: Vec<(usize, usize)>,
    borders: Vec<f64>,
    cells: Vec<(i32, i32)>,
    outlines: Vec<(f64, f64)>,
    workspace: adaptive::Workspace,
    polar: polar::Workspace,
    /// Rays that the seeds made for one use.
    pub(super) rays: Vec<Ray>,
    /// Their nodes, each with the place of its nearest maximum.
    pub(super) owned: Vec<(usize, Node)>,
    pieces: facets::Workspace,
}

impl Surface {
    /// Whether it has patches, and nothing is pressed past what it can carry.
    pub fn is_sound(&self) -> bool {
        !self.patches.is_empty() && self.overloads.is_empty()
    }
}

/// A region of the surface that a patch already accounts for.
#[derive(Clone, Copy, Debug)]
enum Covered {
    /// Within the border found at equally spaced azimuths: a range of `borders`.
    Polar(Frame, (usize, usize)),
    /// Within cells of the first grid, in order: a range of `cells`.
    Cells(Frame, (usize, usize)),
    /// Within a polygon, counter-clockwise: a range of `outlines`.
    Outline(Frame, (usize, usize)),
}

/// Finds and integrates the contact surface of a pair.
pub fn integrate(pair: &Pair, settings: &Settings, out: &mut Surface) {
    out.patches.clear();
    out.nodes.clear();
    out.overloads.clear();
    out.maxima.clear();
    out.covered.clear();
    out.close.clear();
    out.borders.clear();
    out.cells.clear();
    out.outlines.clear();
    out.evaluations = 0;
    let deepest = find_patches(pair, settings, out);
    // What overlaps is pushed apart, if not by a pressure then as an overload.
    if out.nodes.is_empty()
        && out.overloads.is_empty()
        && let Some(deepest) = deepest
    {
        out.overloads.push(deepest);
    }
}

/// Overlaps below this part of the thinner coat may have no pressure left to be found.
const FAINT: f64 = 1e-6;
/// The same for seeds, which have gaps between them.
const FAINT_SEEDED: f64 = 0.5;

/// Finds and integrates the patches. Gives the two skeletons whose coats overlap most.
fn find_patches(pair: &Pair, settings: &Settings, out: &mut Surface) -> Option<(usize, usize, Approach)> {
    let mut most = (if settings.scheme == Scheme::Seeds { FAINT_SEEDED } else { FAINT }, None);
    for i in 0..pair.a.skeletons.len() {
        for j in 0..pair.b.skeletons.len() {
            let approach = deepest::approach(pair, i, j);
            if approach.distance >= pair.a.reach[i] + pair.b.reach[j] {
                continue;
            }
            out.close.push((i, j));
            let (ta, tb) = (pair.a.skeletons[i].profile.thickness, pair.b.skeletons[j].profile.thickness);
            let overlap = (ta + tb - approach.distance) / ta.min(tb);
            // Where a neighbour lies between two parts of a body, these may be as close as they like.
            let between = pair.is_covered(&approach.meeting);
            if overlap > most.0 && !between {
                most = (overlap, Some((i, j, approach)));
            }
            let overloaded = !between && is_overloaded(pair, i, j, &approach);
            if overloaded {
                out.overloads.push((i, j, approach));
            }
            let closed = pair.covers.is_empty() && matches!(settings.scheme, Scheme::Auto | Scheme::ClosedForm);
            if closed && closed_patch(pair, &approach, out) {
                return most.1;
            }
            if let Some(found) = deepest::find(pair, i, j, &approach) {
                out.evaluations += found.evaluations;
                out.maxima.push(found);
            } else if !overloaded && !between && approach.distance <= 0.0 {
                // Core in core, and no surface between them.
                out.overloads.push((i, j, approach));
            }
        }
    }
    // The deepest first; equal ones stay in the order of the skeletons.
    out.maxima.sort_by(|x, y| y.sum.total_cmp(&x.sum));
    if settings.scheme == Scheme::Seeds {
        seeds::integrate(pair, 0, out);
        return most.1;
    }
    let extent = extent(&pair.a).min(extent(&pair.b));
    let held = (0..out.maxima.len()).all(|index| {
        let at = out.maxima[index];
        out.holder(&at.position, &at.normal).is_some() || patch(pair, settings, &at, extent, out)
    });
    if !(held && find_missed(pair, settings, extent, out)) {
        // The surface wraps round: no plane sees all of it, the seeds do.
        out.patches.clear();
        out.nodes.clear();
        seeds::integrate(pair, seeds::STAND_IN, out);
    }
    most.1
}

/// Finds and integrates what is in contact, but in no patch so far. Two skeletons have one place where they come
/// closest, but where others blend with them, their coats may touch at more: at the corners of either. And a patch that
/// was taken for star-shaped may go on behind a bay. False when a surface leans over.
fn find_missed(pair: &Pair, settings: &Settings, extent: f64, out: &mut Surface) -> bool {
    if pair.is_simple() {
        return true;
    }
    for index in 0..out.close.len() {
        let (i, j) = out.close[index];
        for from in deepest::approaches_of_corners(pair, i, j) {
            if from.distance >= pair.a.reach[i] + pair.b.reach[j]
                || out.holder(&from.meeting, &from.direction).is_some()
            {
                continue;
            }
            let Some(near) = deepest::surface_near(pair, i, j, &from.meeting, &mut out.evaluations) else { continue };
            if out.holder(&near.position, &near.normal).is_some() {
                continue;
            }
            let from = Approach { meeting: near.position, ..from };
            let Some(at) = deepest::find(pair, i, j, &from) else { continue };
            out.evaluations += at.evaluations;
            let settings = match out.holder(&at.position, &at.normal) {
                None => *settings,
                // Cells have all that hangs together.
                Some(Covered::Cells(..)) => continue,
                Some(_) if settings.scheme == Scheme::Polar => continue,
                // Up there is a patch that left this out.
                Some(_) => Settings { scheme: Scheme::Adaptive, ..*settings },
            };
            out.maxima.push(at);
            if !patch(pair, &settings, &at, extent, out) {
                return false;
            }
        }
    }
    true
}

impl Surface {
    /// Whether a point of the surface, with its normal, lies within a region.
    fn contains(&self, region: &Covered, p: &Vec3, normal: &Vec3) -> bool {
        let (Covered::Polar(frame, range) | Covered::Cells(frame, range) | Covered::Outline(frame, range)) = region;
        // The other side of something thin is another contact.
        if frame.normal.dot(normal) <= 0.0 {
            return false;
        }
        let (x, y, height) = frame.coordinates(p);
        let size = frame.scale[0].max(frame.scale[1]);
        match region {
            Covered::Polar(..) => {
                let border = &self.borders[range.0..range.1];
                let count = border.len() as f64;
                let turn = libm::atan2(y, x) / (2.0 * std::f64::consts::PI) * count;
                let below = turn.floor();
                let at = |i: f64| border[i.rem_euclid(count) as usize];
                let limit = at(below) + (turn - below) * (at(below + 1.0) - at(below));
                x.hypot(y) < 1.02 * limit && height.abs() < size * limit
            }
            Covered::Cells(..) => {
                let cells = &self.cells[range.0..range.1];
                let reach = || cells.iter().map(|(i, j)| i.abs().max(j.abs())).max().unwrap_or(0);
                cells.binary_search(&adaptive::grid_cell(x, y)).is_ok() && height.abs() < size * f64::from(reach() + 1)
            }
            Covered::Outline(..) => {
                let outline = &self.outlines[range.0..range.1];
                let reach = outline.iter().map(|(x, y)| x.hypot(*y)).fold(0.0, f64::max);
                // The border was found at some places only, and between them it bulges.
                let margin = 0.02 * reach;
                let behind = |index: usize| {
                    let (p, q) = (outline[index], outline[(index + 1) % outline.len()]);
                    let along = (q.0 - p.0, q.1 - p.1);
                    along.0 * (y - p.1) - along.1 * (x - p.0) >= -margin * along.0.hypot(along.1)
                };
                (0..outline.len()).all(behind) && height.abs() < reach
            }
        }
    }

    /// The region of the patch that a point of the surface, with its normal, lies in.
    fn holder(&self, p: &Vec3, normal: &Vec3) -> Option<&Covered> {
        self.covered.iter().find(|region| self.contains(region, p, normal))
    }

    /// Notes the region of the last patch, and drops the patches before that it holds too, with theirs: they would count
    /// twice.
    fn cover(&mut self, region: Covered) {
        let last = self.patches.len() - 1;
        for index in (0..last).rev() {
            if self.contains(&region, &self.patches[index].deepest, &self.patches[index].normal) {
                self.covered.remove(index);
                let (first, end) = self.patches.remove(index).nodes;
                self.nodes.drain(first..end);
                for patch in &mut self.patches[index..] {
                    patch.nodes = (patch.nodes.0 - (end - first), patch.nodes.1 - (end - first));
                }
            }
        }
        self.covered.push(region);
    }

    /// What each patch comes to.
    pub fn sums(&self) -> impl Iterator<Item = patch::Sums> + '_ {
        self.patches.iter().map(|patch| patch::sum(&self.nodes[patch.nodes.0..patch.nodes.1]))
    }

    /// Adds a patch whose nodes start at `first`.
    pub fn push(&mut self, at: &Deepest, first: usize, scale: f64, error: f64, evaluations: u32, scheme: Scheme) {
        let same = self.patches.iter().filter(|patch| patch.skeletons == at.skeletons);
        let ordinal = same.map(|patch| patch.ordinal + 1).max().unwrap_or(0);
        let overloaded = self.overloads.iter().any(|(i, j, _)| [*i, *j] == at.skeletons);
        self.patches.push(Patch {
            skeletons: at.skeletons,
            ordinal,
            deepest: at.position,
            normal: at.normal,
            peak_pressure: scale * at.sum,
            slope: at.slope,
            nodes: (first, self.nodes.len()),
            error_estimate: error,
            evaluations: evaluations + at.evaluations,
            scheme,
            overloaded,
        });
        self.evaluations += evaluations;
    }
}

/// Integrates the patch round a maximum. False when its surface leans over and no height can describe it.
fn patch(pair: &Pair, settings: &Settings, at: &Deepest, extent: f64, out: &mut Surface) -> bool {
    let first = out.nodes.len();
    let (first_border, first_cell) = (out.borders.len(), out.cells.len());
    let target = Target { pair, at, extent, tolerance: settings.tolerance };
    let mut spent = 0;
    // Where skeletons blend, the surface has more than one face, and what lies between them may be missed.
    let facets = pair.is_simple() && !matches!(settings.scheme, Scheme::Polar | Scheme::Adaptive);
    if facets {
        let first_corner = out.outlines.len();
        match facets::integrate(&target, &mut out.pieces, &mut out.nodes, &mut out.outlines) {
            Ok(done) => {
                out.push(at, first, pair.scale, done.error, done.evaluations, Scheme::Facets);
                out.cover(Covered::Outline(done.frame, (first_corner, out.outlines.len())));
                return true;
            }
            Err(Unfit { evaluations }) => spent = evaluations,
        }
    }
    if settings.scheme != Scheme::Adaptive {
        let Surface { polar, nodes, borders, .. } = out;
        match polar::integrate(&target, settings.scheme == Scheme::Polar, polar, nodes, borders) {
            Ok(done) => {
                let region = Covered::Polar(done.frame, (first_border, out.borders.len()));
                // A border that was searched too far out may be another patch's.
                if out.contains(&region, &at.position, &at.normal) {
                    out.push(at, first, pair.scale, done.error, done.evaluations + spent, Scheme::Polar);
                    out.cover(region);
                    return true;
                }
                out.nodes.truncate(first);
                spent += done.evaluations;
            }
            Err(Unfit { evaluations }) => spent += evaluations,
        }
    }
    match adaptive::integrate(&target, &mut out.workspace, &mut out.nodes, &mut out.cells) {
        Ok(done) => {
            out.push(at, first, pair.scale, done.error, done.evaluations + spent, Scheme::Adaptive);
            out.cover(Covered::Cells(done.frame, (first_cell, out.cells.len())));
            true
        }
        Err(Unfit { evaluations }) => {
            out.evaluations += evaluations + spent;
            false
        }
    }
}

/// Size of a coat's finite skeletons, grown by their reach \[m\].
pub(super) fn extent(side: &Side) -> f64 {
    let mut bounds: Option<(Vec3, Vec3)> = None;
    for (skeleton, reach) in side.skeletons.iter().zip(&side.reach) {
        if matches!(skeleton.shape, Shape::Plane { .. }) {
            return f64::INFINITY;
        }
        let (low, high) = skeleton.shape.bounds(*reach);
        bounds = Some(bounds.map_or((low, high), |(l, h)| (l.inf(&low), h.sup(&high))));
    }
    bounds.map_or(0.0, |(low, high)| 0.5 * (high - low).norm())
}

/// A side as a round coat, when it is one.
fn round(side: &Side) -> Option<(Round, Vec3)> {
    let [only] = side.skeletons.as_slice() else { return None };
    if only.profile.stiffening != 1.0 && !side.rigid {
        return None;
    }
    let compliance = 1.0 / side.slope(0);
    let thickness = only.profile.thickness;
    match only.shape {
        Shape::Point(center) => Some((Round { thickness, compliance, plane: false }, center)),
        Shape::Plane { .. } => Some((Round { thickness, compliance, plane: true }, Vec3::zeros())),
        _ => None,
    }
}

/// Integrates the pair in closed form. False when there is none for it.
fn closed_patch(pair: &Pair, approach: &Approach, out: &mut Surface) -> bool {
    let (Some((a, center_a)), Some((b, center_b))) = (round(&pair.a), round(&pair.b)) else { return false };
    if a.plane && b.plane {
        return false;
    }
    // From the ball, or from a of two balls.
    let (first, second, center, direction) =
        if a.plane { (b, a, center_b, -approach.direction) } else { (a, b, center_a, approach.direction) };
    // Past the overload, and under the profiles' caps, the formula no longer holds.
    let peak = (a.thickness + b.thickness - approach.distance) / (a.compliance + b.compliance);
    let inside_cap = |side: &Side, round: &Round| {
        !round.plane && round.thickness - peak * round.compliance <= side.skeletons[0].profile.cap
    };
    let swallowed = !second.plane && approach.distance <= (a.thickness - b.thickness).abs();
    if inside_cap(&pair.a, &a) || inside_cap(&pair.b, &b) || swallowed {
        return false;
    }
    let Some(axial) = closed_form::contact(&first, &second, approach.distance) else { return true };
    let normal = approach.direction;
    let first_node = out.nodes.len();
    out.nodes.push(Node {
        position: center + direction * axial.center,
        force: normal * axial.force,
        area: axial.area,
        stiffness: axial.stiffness,
    });
    let at = Deepest {
        position: approach.meeting,
        normal,
        axes: [Vec3::zeros(); 2],
        curvature: [0.0; 2],
        sum: axial.peak_pressure / pair.scale,
        slope: [&pair.a, &pair.b].map(|side| side.skeletons[0].profile.stiffness).into_iter().fold(0.0, f64::max),
        skeletons: [0, 0],
        evaluations: 0,
    };
    out.push(&at, first_node, pair.scale, 1e-14, 0, Scheme::ClosedForm);
    true
}
