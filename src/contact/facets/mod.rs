//! Facets: for contacts that contain a flat face or a straight edge.
//!
//! The facet is the polygon over which a face of one coat meets the other: the face itself on a half-space, what two
//! faces have in common, or the segment that an edge or a capsule lies on. Over it the pressure is nearly linear; beyond
//! its edges and corners the coats are rounded, and the fields' curvature jumps. So it is integrated in pieces with no
//! jump inside: the polygon, as far as there is pressure, by a rule on its moments; a strip outwards from each edge and
//! a fan round each corner, both to the border, where the pressure is zero. The plane is the face's own, so that a small
//! tilt changes the pressure and nothing else.

mod polygon;
mod rules;

use polygon::{CORNERS, Corner, Owner, Place, Polygon, between, cross, dot, layout};
use rules::{ALONG, LEVELS, OUTWARDS};

use super::column::{Column, Solver};
use super::deepest::Deepest;
use super::patch::Node;
use super::polar::{RULES, SOLVING};
use super::target::{Integrated, Target, Unfit};
use crate::field::Shape;
use crate::math::Vec3;

/// Most evaluations of a patch; what needs more is not made of facets.
const MOST_EVALUATIONS: u32 = 6_000;
/// Part of the pressure's peak below which a corner or an edge makes no piece.
const NOTHING: f64 = 1e-9;

/// What a piece adds up to.
#[derive(Clone, Copy, Debug, Default)]
struct Tally {
    force: Vec3,
    error: f64,
    /// Its nodes in the pool.
    nodes: (usize, usize),
}

/// A part of the facet itself.
#[derive(Clone, Copy, Debug)]
struct Flat {
    polygon: Polygon,
    /// The line that would halve it best: a place and a unit normal.
    halving: (Place, Place),
    tally: Tally,
}

/// A strip outwards from an edge, or a fan round a corner.
#[derive(Clone, Copy, Debug)]
struct Wing {
    /// The ends of the edge; of a fan, twice the corner.
    base: [Corner; 2],
    /// Directions outwards from them.
    rays: [Place; 2],
    fan: bool,
    /// Whether the pressure ends there, and the strip with it.
    narrow: [bool; 2],
    level: usize,
    tally: Tally,
}

/// What is left of an integration, and its memory.
#[derive(Debug, Default)]
pub struct Workspace {
    flats: Vec<Flat>,
    wings: Vec<Wing>,
    pool: Vec<Node>,
}

/// Integrates the patch round a deepest point to the relative tolerance asked for, appending to `nodes`, and to `outline` the
/// places round its border, counter-clockwise.
pub fn integrate(
    target: &Target,
    workspace: &mut Workspace,
    nodes: &mut Vec<Node>,
    outline: &mut Vec<Place>,
) -> Result<Integrated, Unfit> {
    let Target { pair, at, tolerance, .. } = *target;
    let first = outline.len();
    let mut evaluations = 0;
    // A face that leans so far that only its edge is in contact gives way to that edge.
    for faces in [true, false] {
        let Some((frame, polygon)) = layout(pair, at, faces) else { continue };
        let solver = Solver { evaluations, ..target.solver(frame) };
        let [i, j] = at.skeletons;
        let endless = |shape: &Shape| matches!(shape, Shape::Plane { .. });
        let against_plane = endless(&pair.a.skeletons[i].shape) || endless(&pair.b.skeletons[j].shape);
        let alone = pair.a.skeletons.len() + pair.b.skeletons.len() == 2;
        let distrust = if against_plane && alone { 0.0 } else { CROSSING };
        let mut work =
            Work { solver, workspace, peak: at.sum, curvature: 0.0, bend: 0.0, slopes: (0.0, 0.0), distrust };
        let error = work.integrate(at, polygon, tolerance, outline);
        evaluations = work.solver.evaluations;
        if let Some(error) = error {
            for tally in workspace.tallies() {
                nodes.extend_from_slice(&workspace.pool[tally.nodes.0..tally.nodes.1]);
            }
            return Ok(Integrated { error, evaluations, frame });
        }
        outline.truncate(first);
    }
    Err(Unfit { evaluations })
}

impl Workspace {
    fn tallies(&self) -> impl Iterator<Item = &Tally> {
        self.flats.iter().map(|flat| &flat.tally).chain(self.wings.iter().map(|wing| &wing.tally))
    }
}

/// Part of a difference between two rules that stays, where edges of both coats may cross within a piece.
const CROSSING: f64 = 0.25;

struct Work<'a, 'b> {
    solver: Solver<'a>,
    workspace: &'b mut Workspace,
    peak: f64,
    /// Curvature of `σ` outwards, as last seen.
    curvature: f64,
    /// Fall of the surface over a strip, over the square of its width, as last seen.
    bend: f64,
    /// Slopes of the surface over the facet.
    slopes: Place,
    /// Least part of a difference between two rules that counts as error.
    distrust: f64,
}

impl Work<'_, '_> {
    /// Integrates all pieces to the tolerance; gives the error estimate.
    fn integrate(&mut self, at: &Deepest, polygon: Polygon, tolerance: f64, outline: &mut Vec<Place>) -> Option<f64> {
        self.workspace.flats.clear();
        self.workspace.wings.clear();
        self.workspace.pool.clear();
        let polygon = self.pressed(polygon)?;
        self.solver.aim(self.peak, tolerance);
        let [i, j] = at.skeletons;
        let [a, b] = [&self.solver.pair.a.skeletons[i], &self.solver.pair.b.skeletons[j]];
        let thickness = match (a.shape, b.shape) {
            (Shape::Plane { .. }, _) => b.profile.thickness,
            (_, Shape::Plane { .. }) => a.profile.thickness,
            _ => a.profile.thickness.min(b.profile.thickness),
        };
        self.curvature = at.slope / thickness;
        let level = match tolerance {
            t if t >= 2e-3 => 0,
            t if t >= 2e-4 => 1,
            _ => 2,
        };
        self.arrange(&polygon, level);
        if polygon.count > 2 {
            let flat = self.flat(polygon)?;
            self.workspace.flats.push(flat);
        }
        for index in 0..self.workspace.wings.len() {
            self.wing(index, Some(outline))?;
        }
        loop {
            let (mut force, mut error, mut worst) = (Vec3::zeros(), 0.0, 0.0f64);
            for tally in self.workspace.tallies() {
                force += tally.force;
                error += tally.error;
                worst = worst.max(tally.error);
            }
            let size = force.norm();
            if size <= 0.0 {
                return None;
            }
            // The roots are solved to a part of the tolerance.
            let relative = error / size + SOLVING * tolerance + 1e-14;
            if relative <= tolerance {
                return Some(relative);
            }
            if self.solver.evaluations > MOST_EVALUATIONS || !worst.is_finite() {
                return None;
            }
            self.refine(0.3 * worst)?;
        }
    }

    /// Refines the pieces whose error is above a limit.
    fn refine(&mut self, limit: f64) -> Option<()> {
        for index in 0..self.workspace.flats.len() {
            let Flat { polygon, halving: (place, normal), tally } = self.workspace.flats[index];
            if tally.error >= limit {
                let offset = dot(place, normal);
                let near = polygon.clip(normal, offset, Owner::Pressure);
                let far = polygon.clip((-normal.0, -normal.1), -offset, Owner::Pressure);
                if near.count > CORNERS || far.count > CORNERS {
                    return None;
                }
                let far = self.flat(far)?;
                self.workspace.flats[index] = self.flat(near)?;
                self.workspace.flats.push(far);
            }
        }
        for index in 0..self.workspace.wings.len() {
            let wing = self.workspace.wings[index];
            if wing.tally.error < limit {
                continue;
            }
            if wing.level + 1 < LEVELS.len() {
                self.workspace.wings[index].level += 1;
            } else {
                let (near, far) = wing.halves();
                self.workspace.wings[index] = near;
                self.workspace.wings.push(far);
                self.wing(self.workspace.wings.len() - 1, None)?;
            }
            self.wing(index, None)?;
        }
        Some(())
    }

    /// The part of the facet under pressure, with the surface over its corners.
    fn pressed(&mut self, mut polygon: Polygon) -> Option<Polygon> {
        let mut height = 0.0;
        let mut deepest = 0;
        for index in 0..polygon.count {
            let Corner { at: (x, y), .. } = polygon.corners[index];
            let column = self.solver.column(x, y, height)?;
            height = column.height;
            self.peak = self.peak.max(column.sum);
            let density = self.density((x, y), &column);
            let rise = self.rise(&column);
            let corner = &mut polygon.corners[index];
            (corner.height, corner.sum, corner.rise, corner.density) = (column.height, column.sum, rise, density);
            if polygon.corners[index].sum >= polygon.corners[deepest].sum {
                deepest = index;
                self.slopes = self.slopes(&column);
            }
        }
        if polygon.corners().iter().all(|corner| corner.sum > 0.0) {
            return Some(polygon);
        }
        let mut part = Polygon::default();
        for index in 0..polygon.count {
            let (p, q) = (polygon.corners[index], *polygon.next(index));
            if p.sum > 0.0 {
                part.push(p);
            }
            if (p.sum > 0.0) != (q.sum > 0.0) {
                let (inside, outside) = if p.sum > 0.0 { (p, q) } else { (q, p) };
                let t = inside.sum / (inside.sum - outside.sum);
                let along = (t * (outside.at.0 - inside.at.0), t * (outside.at.1 - inside.at.1));
                let guess = inside.height + t * (outside.height - inside.height);
                let from = (inside.at.0, inside.at.1, inside.height);
                let (s, height) = self.solver.border_from(from, along, self.peak, guess)?;
                let s = s.min(1.0 / t);
                let at = (inside.at.0 + s * along.0, inside.at.1 + s * along.1);
                let rise = inside.rise;
                let meeting = Corner { at, height, sum: 0.0, rise, density: Vec3::zeros(), ..p };
                part.push(if p.sum > 0.0 { Corner { owner: Owner::Pressure, ..meeting } } else { meeting });
            }
        }
        if !(2..=CORNERS).contains(&part.count) {
            return None;
        }
        for index in 0..part.count {
            if part.corners[index].owner == Owner::Pressure {
                let (p, q) = (part.corners[index].at, part.next(index).at);
                let length = (q.0 - p.0).hypot(q.1 - p.1);
                let rise = part.corners[index].rise;
                let (x, y) = if length > 0.0 { (q.1 - p.1, p.0 - q.0) } else { (-rise.0, -rise.1) };
                let length = x.hypot(y).max(1e-300);
                part.corners[index].normal = (x / length, y / length);
            }
        }
        Some(part)
    }

    /// Slopes of the surface at a column.
    fn slopes(&self, column: &Column) -> Place {
        let frame = &self.solver.frame;
        let gradient = &column.sample.difference_gradient;
        let fall = gradient.dot(&frame.normal);
        (-gradient.dot(&frame.u) / fall, -gradient.dot(&frame.v) / fall)
    }

    /// Gradient of `σ` along the surface at a column.
    fn rise(&self, column: &Column) -> Place {
        let frame = &self.solver.frame;
        let gradient = &column.sample.sum_gradient;
        let slopes = self.slopes(column);
        let up = gradient.dot(&frame.normal);
        (gradient.dot(&frame.u) + up * slopes.0, gradient.dot(&frame.v) + up * slopes.1)
    }

    /// Force an area of the plane.
    fn density(&self, (x, y): Place, column: &Column) -> Vec3 {
        self.solver.node(x, y, column, 1.0).map_or(Vec3::zeros(), |node| node.force)
    }

    /// Sets up the strips and fans round the facet, counter-clockwise.
    fn arrange(&mut self, polygon: &Polygon, level: usize) {
        let count = polygon.count;
        // Where edges of both coats cross aslant, a break runs through a piece: two points along would not see it.
        let aslant = |index: usize| {
            let (p, q) = (&polygon.corners[index], polygon.next(index));
            let coats = p.owner != Owner::Pressure && q.owner != Owner::Pressure && p.owner != q.owner;
            coats && (0.02..0.9998).contains(&dot(p.normal, q.normal).abs())
        };
        let level = if (0..count).any(aslant) { level + 1 } else { level };
        let size = polygon.corners().iter().map(|c| c.at.0.hypot(c.at.1)).fold(0.0, f64::max);
        // Where the strip of the edge before a corner ends, and where that of the edge after it begins: at right angles,
        // as the coat of one skeleton has it; but where edges of two cross, along the other's. Where the pressure ends
        // first, what is left beyond the edge is bounded by the pressure's end.
        let mut rays = [[(0.0, 0.0); 2]; CORNERS];
        for (index, ray) in rays.iter_mut().enumerate().take(count) {
            let (before, after) = (&polygon.corners[(index + count - 1) % count], &polygon.corners[index]);
            let (ahead, back) = ((-before.normal.1, before.normal.0), (after.normal.1, -after.normal.0));
            *ray = match (before.owner, after.owner) {
                (_, Owner::Pressure) => [before.normal, back],
                (Owner::Pressure, _) => [ahead, after.normal],
                (p, q) if p != q && dot(before.normal, back) > 0.5 => {
                    let across = dot(before.normal, back);
                    [(back.0 / across, back.1 / across), (ahead.0 / across, ahead.1 / across)]
                }
                _ => [before.normal, after.normal],
            };
        }
        for index in 0..count {
            let (start, end) = (polygon.corners[index], *polygon.next(index));
            let length = (end.at.0 - start.at.0).hypot(end.at.1 - start.at.1);
            let highest = start.sum.max(end.sum);
            let wing = |base: [Corner; 2], rays: [Place; 2], fan: bool, narrow: [bool; 2]| Wing {
                base,
                rays,
                fan,
                narrow,
                level,
                tally: Tally::default(),
            };
            if start.owner != Owner::Pressure && length > 1e-12 * size && highest > NOTHING * self.peak {
                let narrow = [start.sum < 0.25 * highest, end.sum < 0.25 * highest];
                let outwards = [rays[index][1], rays[(index + 1) % count][0]];
                self.workspace.wings.push(wing([start, end], outwards, false, narrow));
            }
            // From the normal of this edge round to that of the next; half a turn in two.
            let (from, to) = (rays[(index + 1) % count][0], rays[(index + 1) % count][1]);
            let mut turn = libm::atan2(cross(from, to), dot(from, to));
            let cut = start.owner == Owner::Pressure || end.owner == Owner::Pressure;
            if turn < -3.0 && !cut {
                turn += 2.0 * std::f64::consts::PI;
            }
            if turn < if cut { 1e-3 } else { 1e-9 } {
                continue;
            }
            let from = (from.0 / from.0.hypot(from.1), from.1 / from.0.hypot(from.1));
            let parts = if turn > 1.9 { 2 } else { 1 };
            for part in 0..parts {
                let ends = [part, part + 1].map(|k| rotated(from, turn * f64::from(k) / f64::from(parts)));
                self.workspace.wings.push(wing([end, end], ends, true, [false; 2]));
            }
        }
    }

    /// Integrates a part of the facet: four points at the distance that matches its second moments, which for a convex
    /// polygon are always inside. Exact for a pressure that is linear, and for its torque.
    fn flat(&mut self, polygon: Polygon) -> Option<Flat> {
        let first = self.workspace.pool.len();
        let mut flat = Flat {
            polygon,
            halving: ((0.0, 0.0), (1.0, 0.0)),
            tally: Tally { nodes: (first, first), ..Tally::default() },
        };
        let Some((area, center, axes, spread)) = polygon.moments() else { return Some(flat) };
        let middle = self.solver.column(center.0, center.1, self.over(center, &polygon.corners[0]))?;
        let density = self.density(center, &middle);
        let slopes = self.slopes(&middle);
        let mut bends = [0.0; 2];
        for axis in 0..2 {
            let mut bend = density * -2.0;
            for side in [-1.0, 1.0] {
                let step = side * spread[axis] * std::f64::consts::SQRT_2;
                let (dx, dy) = (step * axes[axis].0, step * axes[axis].1);
                let (x, y) = (center.0 + dx, center.1 + dy);
                let column = self.solver.column(x, y, middle.height + slopes.0 * dx + slopes.1 * dy)?;
                if column.sum < -1e-3 * self.peak {
                    return None;
                }
                if let Some(node) = self.solver.node(x, y, &column, 0.25 * area) {
                    bend += node.force / (0.25 * area);
                    flat.tally.force += node.force;
                    self.workspace.pool.push(node);
                }
            }
            bends[axis] = bend.norm();
        }
        flat.tally.nodes.1 = self.workspace.pool.len();
        flat.tally.error = self.trusted(0.25 * area * (bends[0] + bends[1]), flat.tally.force.norm());
        flat.halving = (center, axes[usize::from(bends[1] > bends[0])]);
        Some(flat)
    }

    /// What is left of the difference between a rule and a coarser one: the better rule errs by about its square where
    /// the fields are smooth within a piece.
    fn trusted(&self, difference: f64, size: f64) -> f64 {
        if difference < size { difference * (difference / size).max(self.distrust) } else { difference }
    }

    /// Height over a place of the facet as a corner predicts it.
    fn over(&self, at: Place, corner: &Corner) -> f64 {
        corner.height + dot(self.slopes, (at.0 - corner.at.0, at.1 - corner.at.1))
    }

    /// Integrates a strip or a fan; gives the border's places when asked.
    fn wing(&mut self, index: usize, mut outline: Option<&mut Vec<Place>>) -> Option<()> {
        let wing = self.workspace.wings[index];
        let (along, outwards, radial) = LEVELS[wing.level];
        let along = &ALONG[along];
        let (s, weight, coarse, center) = if wing.fan {
            let rule = &RULES[radial];
            (rule.s, rule.weight, rule.coarse, rule.center)
        } else {
            let rule = &OUTWARDS[outwards];
            (rule.s, rule.weight, rule.coarse, 0.0)
        };
        let first = self.workspace.pool.len();
        let (mut force, mut radially, mut coarsely) = (Vec3::zeros(), Vec3::zeros(), Vec3::zeros());
        if let Some(outline) = &mut outline
            && wing.narrow[0]
        {
            outline.push(wing.base[0].at);
        }
        for (index, t) in along.s.iter().enumerate() {
            let spoke = wing.spoke(*t);
            let Spoke { from, height, direction, measure, .. } = spoke;
            let (reach, border) = self.reach(&spoke)?;
            if let Some(outline) = &mut outline {
                outline.push((from.0 + reach * direction.0, from.1 + reach * direction.1));
            }
            let level = dot(self.slopes, direction) * reach;
            // A fan's coarse rule has a point at the corner; its weights, and this one's, count the radius in.
            let (mut line, mut line_coarse) =
                (Vec3::zeros(), wing.base[0].density * (center * reach * reach * measure.1));
            for (k, x) in s.iter().enumerate() {
                let r = x * reach;
                let place = (from.0 + r * direction.0, from.1 + r * direction.1);
                let guess = height + level * x + (border - height - level) * x * x;
                let column = self.solver.column(place.0, place.1, guess)?;
                if column.sum < -1e-3 * self.peak {
                    // Out of the contact before its border: there is a bay.
                    return None;
                }
                let spread = if wing.fan { reach * measure.1 } else { measure.0 + r * measure.1 };
                let unit = reach * spread;
                if let Some(node) = self.solver.node(place.0, place.1, &column, along.weight[index] * weight[k] * unit)
                {
                    let density = node.force / (along.weight[index] * weight[k]);
                    line += density * weight[k];
                    line_coarse += density * coarse[k];
                    self.workspace.pool.push(node);
                }
            }
            force += line * along.weight[index];
            radially += (line_coarse - line) * along.weight[index];
            coarsely += line * (along.coarse[index] - along.weight[index]);
        }
        if let Some(outline) = &mut outline
            && wing.narrow[1]
        {
            outline.push(wing.base[1].at);
        }
        let size = force.norm();
        self.workspace.wings[index].tally = Tally {
            force,
            error: self.trusted(radially.norm(), size) + self.trusted(coarsely.norm(), size),
            nodes: (first, self.workspace.pool.len()),
        };
        Some(())
    }

    /// Distance and height of the border, in units of a direction.
    fn reach(&mut self, spoke: &Spoke) -> Option<(f64, f64)> {
        let Spoke { from, height, sum, rise, direction, .. } = *spoke;
        // A parabola from the edge, with the curvature last seen.
        let (sum, rise) = (sum.max(0.0), dot(rise, direction));
        let root = |curvature: f64| (rise + (rise * rise + 2.0 * curvature * sum).sqrt()) / curvature;
        let expected = root(self.curvature);
        if expected <= 1e-6 * (2.0 * self.peak / self.curvature).sqrt() {
            return Some((0.0, height));
        }
        let level = dot(self.slopes, direction);
        let guess = height + level * expected + self.bend * expected * expected;
        let scaled = (expected * direction.0, expected * direction.1);
        let (s, border) = self.solver.border_from((from.0, from.1, height), scaled, self.peak, guess)?;
        let reach = s * expected;
        let curvature = 2.0 * (sum + rise * reach) / (reach * reach);
        if curvature > 0.0 && curvature.is_finite() {
            self.curvature = curvature;
            self.bend = (border - height - level * reach) / (reach * reach);
        }
        Some((reach, border))
    }
}

fn rotated((x, y): Place, angle: f64) -> Place {
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    (x * cosine - y * sine, x * sine + y * cosine)
}

/// A line outwards across a wing.
struct Spoke {
    from: Place,
    height: f64,
    sum: f64,
    rise: Place,
    direction: Place,
    /// Width of the wing there, a unit of the parameter along: constant, and in proportion to the way outwards.
    measure: (f64, f64),
}

impl Wing {
    /// The line at a parameter along. It comes densely to a narrow end: there the pressure goes as a root, which has no
    /// expansion, but one has in the root.
    fn spoke(&self, t: f64) -> Spoke {
        let (t, rate) = match self.narrow {
            [false, false] => (t, 1.0),
            [true, false] => (t * t, 2.0 * t),
            [false, true] => (t * (2.0 - t), 2.0 - 2.0 * t),
            [true, true] => (t * t * (3.0 - 2.0 * t), 6.0 * t * (1.0 - t)),
        };
        let [start, end] = &self.base;
        let [first, last] = self.rays;
        let height = start.height + t * (end.height - start.height);
        let sum = start.sum + t * (end.sum - start.sum);
        let rise = between(start.rise, end.rise, t);
        if self.fan {
            let turn = libm::atan2(cross(first, last), dot(first, last));
            return Spoke {
                from: start.at,
                height,
                sum,
                rise,
                direction: rotated(first, turn * t),
                measure: (0.0, turn * rate),
            };
        }
        let direction = between(first, last, t);
        let along = (end.at.0 - start.at.0, end.at.1 - start.at.1);
        let spread = (last.0 - first.0, last.1 - first.1);
        let measure = (-cross(along, direction) * rate, -cross(spread, direction) * rate);
        Spoke { from: between(start.at, end.at, t), height, sum, rise, direction, measure }
    }

    /// The wing cut in two at its middle, each half at the level before.
    fn halves(&self) -> (Wing, Wing) {
        let [start, end] = self.base;
        let middle = Corner {
            at: between(start.at, end.at, 0.5),
            height: 0.5 * (start.height + end.height),
            sum: 0.5 * (start.sum + end.sum),
            rise: between(start.rise, end.rise, 0.5),
            ..start
        };
        let ray = self.spoke_at_middle();
        let level = self.level - 1;
        (
            Wing { base: [start, middle], rays: [self.rays[0], ray], narrow: [self.narrow[0], false], level, ..*self },
            Wing { base: [middle, end], rays: [ray, self.rays[1]], narrow: [false, self.narrow[1]], level, ..*self },
        )
    }

    fn spoke_at_middle(&self) -> Place {
        if self.fan {
            Wing { narrow: [false; 2], ..*self }.spoke(0.5).direction
        } else {
            between(self.rays[0], self.rays[1], 0.5)
        }
    }
}
