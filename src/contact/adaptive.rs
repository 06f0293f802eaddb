//! Border-adaptive subdivision: for patches that are not star-shaped, have several deepest points, or corners.
//!
//! Square cells of the plane spread from the deepest point as far as there is contact. Inside the contact a cell takes
//! a 2×2 Gauss rule; across the border it is clipped along the line where the pressure, linear over the cell, is zero.
//! Both are of fourth order, since the pressure vanishes at the border. Cells are split where a split changed most,
//! until what is left meets the tolerance.

use std::collections::HashMap;

use super::column::{Column, Frame, Solver};
use super::deepest::Deepest;
use super::pair::Pair;
use super::patch::Node;
use crate::math::Vec3;

/// Side of a cell of the first grid, in units of the patch's predicted radius.
const GRID: f64 = 0.5;
/// Most cells of one patch, split ones included.
const MOST_CELLS: usize = 30_000;
/// Most halvings of a cell.
const DEEPEST_LEVEL: u32 = 14;

/// A square of the plane.
#[derive(Clone, Copy, Debug)]
struct Cell {
    x: f64,
    y: f64,
    /// Half of its side.
    half: f64,
    level: u32,
    /// Height of the surface over the centre, and its slopes.
    height: f64,
    slopes: [f64; 2],
    force: Vec3,
    error: f64,
    /// Its nodes in the pool.
    nodes: (usize, usize),
    split: bool,
}

/// What is left of an integration, and its memory.
#[derive(Debug, Default)]
pub struct Workspace {
    cells: Vec<Cell>,
    pool: Vec<Node>,
    visited: HashMap<(i32, i32), bool>,
    queue: Vec<(i32, i32, f64)>,
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

/// The surface leans over somewhere: it is no height over one plane.
pub struct LeansOver {
    /// Evaluations it took to find out.
    pub evaluations: u32,
}

/// The cell of the first grid that holds a point of the plane.
pub fn grid_cell(x: f64, y: f64) -> (i32, i32) {
    ((x / GRID).round() as i32, (y / GRID).round() as i32)
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
    let mut solver = Solver { pair, frame: Frame::new(at, [1.0, 1.0]), accept: 0.0, border_step: 0.0, evaluations: 0 };
    solver.aim(at.sum, tolerance);
    // Solved out, so that a symmetric contact comes out symmetric: no guess from a neighbour shows.
    solver.accept *= 1e-2;
    if solver.fit(at, extent).is_none() {
        // No clear border along an axis: the prediction will do, the cells spread by themselves.
        let scale = solver.frame.scale.map(|s| s.min(extent));
        solver.frame = Frame::new(at, scale);
    }
    let mut work = Work { solver, workspace, leans: false };
    work.spread(at);
    let error = work.refine(tolerance);
    let (frame, evaluations) = (work.solver.frame, work.solver.evaluations);
    if work.leans {
        return Err(LeansOver { evaluations });
    }
    for cell in workspace.cells.iter().filter(|cell| !cell.split) {
        nodes.extend_from_slice(&workspace.pool[cell.nodes.0..cell.nodes.1]);
    }
    let first = cells.len();
    cells.extend(workspace.visited.iter().filter(|(_, active)| **active).map(|(key, _)| *key));
    cells[first..].sort_unstable();
    Ok(Integrated { error, evaluations, frame })
}

struct Work<'a, 'b> {
    solver: Solver<'a>,
    workspace: &'b mut Workspace,
    leans: bool,
}

impl Work<'_, '_> {
    /// Covers the contact with cells of the first grid, from the deepest point outwards.
    fn spread(&mut self, at: &Deepest) {
        self.workspace.cells.clear();
        self.workspace.pool.clear();
        self.workspace.visited.clear();
        self.workspace.queue.clear();
        let (x, y, height) = self.solver.frame.coordinates(&at.position);
        let (i, j) = grid_cell(x, y);
        self.workspace.queue.push((i, j, height));
        self.workspace.visited.insert((i, j), false);
        let mut next = 0;
        while next < self.workspace.queue.len() && self.workspace.cells.len() < MOST_CELLS / 8 {
            let (i, j, guess) = self.workspace.queue[next];
            next += 1;
            let (x, y) = (f64::from(i) * GRID, f64::from(j) * GRID);
            let Some((cell, active)) = self.measure(x, y, 0.5 * GRID, 0, guess) else { continue };
            if !active {
                continue;
            }
            self.workspace.visited.insert((i, j), true);
            for (di, dj) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
                let key = (i + di, j + dj);
                if let std::collections::hash_map::Entry::Vacant(entry) = self.workspace.visited.entry(key) {
                    entry.insert(false);
                    let along = [f64::from(di) * GRID, f64::from(dj) * GRID];
                    let guess = cell.height + cell.slopes[0] * along[0] + cell.slopes[1] * along[1];
                    self.workspace.queue.push((key.0, key.1, guess));
                }
            }
            self.workspace.cells.push(cell);
        }
    }

    /// Splits the cells that matter most until the estimate meets the tolerance; gives the estimate.
    fn refine(&mut self, tolerance: f64) -> f64 {
        loop {
            let (mut force, mut error, mut worst, mut live) = (Vec3::zeros(), 0.0, 0.0f64, 0usize);
            for cell in self.workspace.cells.iter().filter(|cell| !cell.split) {
                force += cell.force;
                error += cell.error;
                worst = worst.max(cell.error);
                live += 1;
            }
            let size = force.norm();
            let relative = if size > 0.0 { error / size } else { 0.0 };
            if relative <= tolerance || worst == 0.0 || self.workspace.cells.len() + 4 > MOST_CELLS {
                return relative + 1e-14;
            }
            let limit = (0.2 * worst).max(0.25 * tolerance * size / live as f64);
            for index in 0..self.workspace.cells.len() {
                let cell = self.workspace.cells[index];
                if !cell.split && cell.error >= limit && cell.level < DEEPEST_LEVEL {
                    self.split(index);
                } else if !cell.split && cell.level >= DEEPEST_LEVEL {
                    self.workspace.cells[index].error = 0.0;
                }
            }
        }
    }

    fn split(&mut self, index: usize) {
        let parent = self.workspace.cells[index];
        self.workspace.cells[index].split = true;
        let first = self.workspace.cells.len();
        let mut force = Vec3::zeros();
        let half = 0.5 * parent.half;
        for (sx, sy) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let guess = parent.height + (parent.slopes[0] * sx + parent.slopes[1] * sy) * half;
            let (x, y) = (parent.x + sx * half, parent.y + sy * half);
            if let Some((cell, true)) = self.measure(x, y, half, parent.level + 1, guess) {
                force += cell.force;
                self.workspace.cells.push(cell);
            }
        }
        let count = self.workspace.cells.len() - first;
        if count == 0 {
            return;
        }
        // A fourth-order rule is fifteen times better after a split where the fields are smooth, and hardly better
        // where a kink of theirs crosses the cell. Count on the kink.
        let error = 0.75 * (parent.force - force).norm() / count as f64;
        for cell in &mut self.workspace.cells[first..] {
            cell.error = error;
        }
    }

    /// Integrates one cell; says whether it holds contact.
    fn measure(&mut self, x: f64, y: f64, half: f64, level: u32, guess: f64) -> Option<(Cell, bool)> {
        let first = self.workspace.pool.len();
        let Some(center) = self.solver.column(x, y, guess) else {
            self.leans |= self.contact_leans(x, y, guess);
            return None;
        };
        let (slopes, gradient) = self.slopes(&center);
        let height_at = |dx: f64, dy: f64| center.height + slopes[0] * dx + slopes[1] * dy;
        let gauss = half / 3f64.sqrt();
        let corners = [(-gauss, -gauss), (gauss, -gauss), (-gauss, gauss), (gauss, gauss)];
        let mut columns = [center; 4];
        for (column, (dx, dy)) in columns.iter_mut().zip(corners) {
            *column = self.solver.column(x + dx, y + dy, height_at(dx, dy))?;
        }
        let sums = columns.map(|column| column.sum);
        let lowest = sums.into_iter().fold(center.sum, f64::min);
        let highest = sums.into_iter().fold(center.sum, f64::max);
        // The plane through the four samples, and how far they are from it.
        let mean = 0.25 * (sums[0] + sums[1] + sums[2] + sums[3]);
        let gx = 0.25 * (sums[1] + sums[3] - sums[0] - sums[2]) / gauss;
        let gy = 0.25 * (sums[2] + sums[3] - sums[0] - sums[1]) / gauss;
        let bend = (center.sum - mean).abs() + 0.25 * (sums[0] + sums[3] - sums[1] - sums[2]).abs();
        let reach = (gx.abs().max(gradient[0].abs()) + gy.abs().max(gradient[1].abs())) * half + 3.0 * bend;
        let mut cell = Cell {
            x,
            y,
            half,
            level,
            height: center.height,
            slopes,
            force: Vec3::zeros(),
            error: 0.0,
            nodes: (first, first),
            split: false,
        };
        if highest <= 0.0 && mean.max(center.sum) + reach <= 0.0 {
            return Some((cell, false));
        }
        if lowest > 0.0 && mean.min(center.sum) - reach > 0.0 {
            for (column, (dx, dy)) in columns.iter().zip(corners) {
                let node = self.solver.node(x + dx, y + dy, column, half * half);
                self.workspace.pool.extend(node);
            }
        } else {
            self.clip(&cell, mean, gx, gy);
        }
        cell.nodes = (first, self.workspace.pool.len());
        cell.force = self.workspace.pool[first..].iter().map(|node| node.force).sum();
        // Unknown until a split tells: count it whole.
        cell.error = cell.force.norm().max(1e-300);
        Some((cell, true))
    }

    /// Integrates over the part of a cell where `mean + gx dx + gy dy` is positive.
    fn clip(&mut self, cell: &Cell, mean: f64, gx: f64, gy: f64) {
        let h = cell.half;
        let square = [(-h, -h), (h, -h), (h, h), (-h, h)];
        let level = |(dx, dy): (f64, f64)| mean + gx * dx + gy * dy;
        let mut polygon = [(0.0, 0.0); 5];
        let mut count = 0;
        for index in 0..4 {
            let (p, q) = (square[index], square[(index + 1) % 4]);
            let (lp, lq) = (level(p), level(q));
            if lp > 0.0 {
                polygon[count] = p;
                count += 1;
            }
            if (lp > 0.0) != (lq > 0.0) {
                let t = lp / (lp - lq);
                polygon[count] = (p.0 + t * (q.0 - p.0), p.1 + t * (q.1 - p.1));
                count += 1;
            }
        }
        if count < 3 {
            return;
        }
        // Triangles round the centroid, each by its edges' midpoints: of second order, and the same turned half way
        // round, so that opposite cells of a symmetric contact balance.
        let polygon = &polygon[..count];
        let cross = |p: (f64, f64), q: (f64, f64)| p.0 * q.1 - p.1 * q.0;
        let mut center = (0.0, 0.0);
        let mut total = 0.0;
        for index in 0..count {
            let (p, q) = (polygon[index], polygon[(index + 1) % count]);
            let area = cross(p, q);
            total += area;
            center = (center.0 + area * (p.0 + q.0), center.1 + area * (p.1 + q.1));
        }
        if total <= 0.0 {
            return;
        }
        center = (center.0 / (3.0 * total), center.1 / (3.0 * total));
        let triangle = |index: usize| {
            let (p, q) = (polygon[index % count], polygon[(index + 1) % count]);
            0.5 * cross((p.0 - center.0, p.1 - center.1), (q.0 - center.0, q.1 - center.1))
        };
        for index in 0..count {
            let (p, q) = (polygon[index], polygon[(index + 1) % count]);
            let spoke = (0.5 * (center.0 + p.0), 0.5 * (center.1 + p.1));
            let edge = (0.5 * (p.0 + q.0), 0.5 * (p.1 + q.1));
            self.add(cell, spoke, (triangle(index + count - 1) + triangle(index)) / 3.0);
            self.add(cell, edge, triangle(index) / 3.0);
        }
    }

    /// Adds the node of a place in a cell, if there is contact.
    fn add(&mut self, cell: &Cell, (dx, dy): (f64, f64), weight: f64) {
        let guess = cell.height + cell.slopes[0] * dx + cell.slopes[1] * dy;
        if let Some(column) = self.solver.column(cell.x + dx, cell.y + dy, guess) {
            let node = self.solver.node(cell.x + dx, cell.y + dy, &column, weight);
            self.workspace.pool.extend(node);
        }
    }

    /// Slopes of the height, and of `σ` along the surface, a unit of the coordinates.
    fn slopes(&self, column: &Column) -> ([f64; 2], [f64; 2]) {
        let frame = &self.solver.frame;
        let sample = &column.sample;
        let fall = sample.difference_gradient.dot(&frame.normal);
        let rise = sample.sum_gradient.dot(&frame.normal);
        let mut slopes = [0.0; 2];
        let mut gradient = [0.0; 2];
        for (axis, direction) in [frame.u, frame.v].into_iter().enumerate() {
            slopes[axis] = -sample.difference_gradient.dot(&direction) / fall * frame.scale[axis];
            gradient[axis] = sample.sum_gradient.dot(&direction) * frame.scale[axis] + rise * slopes[axis];
        }
        (slopes, gradient)
    }

    /// Whether there is still pressure where a column was not found.
    fn contact_leans(&mut self, x: f64, y: f64, guess: f64) -> bool {
        let sample = self.solver.pair.sample(&self.solver.frame.point(x, y, guess));
        let square = sample.difference_gradient.norm_squared();
        square > 0.0
            && sample.sum - sample.difference * sample.sum_gradient.dot(&sample.difference_gradient) / square > 0.0
    }
}
