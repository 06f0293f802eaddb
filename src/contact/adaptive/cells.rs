//! Cells: squares of a sheet that look at the surface over it, and are split where most is in doubt.
//!
//! Each looks at the surface at its corners, its edges' middles and its centre, which neighbours and halves share. The
//! distance to a convex core is convex, so a cell that is in contact at all nine is in contact wherever else, and takes
//! Simpson's rule, of fourth order. Where a cell is cut by the border, the pressure between its nine places is the mean
//! of two readings, the values joined up and the tangents blended, which err by the same amount to opposite sides when
//! the pressure is quadratic. How far they are apart is the estimate there: beside a flat face, which ends within a
//! small part of a cell, they differ by all that may be missed. Cells are split where most is in doubt, until what is
//! left meets the tolerance.

use std::collections::HashMap;

use crate::contact::pair::Pair;
use crate::contact::patch::Node;
use crate::math::Vec3;

/// Side of a cell of the first grid, in units of its sheet.
pub const GRID: f64 = 0.5;
/// Most cells of one patch, split ones included, at the finest tolerance, and at the coarsest; in between, this over
/// the tolerance. What cannot be resolved, such as a patch that is bent round an edge, must not hold up a step.
const MOST_CELLS: f64 = 30_000.0;
const FEWEST_CELLS: f64 = 1_000.0;
const CELLS: f64 = 10.0;
/// Most cells of the first grid: more are finer than it takes to begin with.
pub const MOST_FIRST_CELLS: usize = 256;
/// Most halvings of a cell.
const DEEPEST_LEVEL: u32 = 14;
/// Half a side of a cell of the first grid, on the lattice that all places lie on.
pub const FIRST_HALF: i32 = 1 << DEEPEST_LEVEL;
/// Parts that a quarter of a cell is read in across each side.
const PARTS: i32 = 4;

/// A place on a part of a sheet.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub part: u8,
    pub x: f64,
    pub y: f64,
}

/// The surface over a place.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    pub place: Place,
    /// Height of the surface, and its slopes.
    pub height: f64,
    pub slopes: [f64; 2],
    /// `σ` there, and its slopes along the surface.
    pub sum: f64,
    pub gradient: [f64; 2],
    /// Vector area, and stiffness, of a unit of the sheet.
    pub area: Vec3,
    pub stiffness: f64,
}

/// What the surface is a height over: a plane, or parts that together go round something.
pub trait Sheet {
    /// The two coats.
    fn pair(&self) -> &Pair;
    /// The point at a height over a place.
    fn point(&self, place: Place, height: f64) -> Vec3;
    /// Area of a unit of the sheet, lifted to a height, and its normal there.
    fn flat(&self, place: Place, height: f64) -> (f64, Vec3);
    /// The surface over a place, from a guess of its height, or a second one.
    fn look(&mut self, place: Place, guess: f64, second: f64) -> Option<Vertex>;
    /// A bound of `σ` from above over a square between four vertices without contact.
    fn most(&self, corners: &[Vertex; 4], side: f64) -> f64;
    /// The surface turned out not to be a height over the sheet.
    fn is_lost(&self) -> bool;
}

/// A square of a sheet.
#[derive(Clone, Copy, Debug)]
pub struct Cell {
    /// The part of the sheet.
    part: u8,
    /// Its centre and half its side on the lattice.
    center: (i32, i32),
    half: i32,
    /// The nine places, row by row; `None` where no surface was found.
    pub vertices: [Option<u32>; 9],
    /// In contact all over.
    inside: bool,
    force: Vec3,
    /// How far the force may be off, along the sheet's normal and, in a cell that is inside, sideways.
    error: f64,
    aside: f64,
    /// The nodes of a cell on the border, in the pool.
    nodes: (usize, usize),
    split: bool,
}

/// What is left of an integration, and its memory.
#[derive(Debug, Default)]
pub struct Workspace {
    pub vertices: Vec<Vertex>,
    /// What Simpson's rule gives each in all cells together.
    weights: Vec<f64>,
    places: HashMap<(u8, i32, i32), Option<u32>>,
    pub cells: Vec<Cell>,
    pool: Vec<Node>,
}

/// Part of the difference between Simpson's rule and the trapezes' that counts as the former's error.
const SIDEWAYS: f64 = 0.25;

/// Simpson's weights along a side, and those of two trapezes, of a side of length one.
const SIMPSON: [f64; 3] = [1.0 / 6.0, 4.0 / 6.0, 1.0 / 6.0];
const TRAPEZES: [f64; 3] = [0.25, 0.5, 0.25];

impl Workspace {
    /// Forgets all, with room for twice as many as the last time: what rests asks for no memory, though its counts
    /// change a little.
    pub fn clear(&mut self) {
        let Self { vertices, weights, places, cells, pool } = self;
        vertices.reserve(vertices.len());
        weights.reserve(weights.len());
        places.reserve(places.len());
        cells.reserve(cells.len());
        pool.reserve(pool.len());
        vertices.clear();
        weights.clear();
        places.clear();
        cells.clear();
        pool.clear();
    }

    /// Gives the nodes of all cells: the places inside, each once, and what lies at the border.
    pub fn collect(&mut self, sheet: &impl Sheet, nodes: &mut Vec<Node>) {
        self.weights.resize(self.vertices.len(), 0.0);
        for cell in self.cells.iter().filter(|cell| cell.inside && !cell.split) {
            let area = (2.0 * length(cell.half)).powi(2);
            for (index, vertex) in cell.vertices.iter().enumerate() {
                if let Some(vertex) = vertex {
                    self.weights[*vertex as usize] += SIMPSON[index % 3] * SIMPSON[index / 3] * area;
                }
            }
        }
        let scale = sheet.pair().scale;
        let weighted = self.vertices.iter().zip(&self.weights).filter(|(_, weight)| **weight > 0.0);
        nodes.extend(weighted.map(|(vertex, weight)| Node {
            position: sheet.point(vertex.place, vertex.height),
            force: vertex.area * (scale * vertex.sum * weight),
            area: vertex.area.norm() * weight,
            stiffness: vertex.stiffness * weight,
        }));
        for cell in self.cells.iter().filter(|cell| !cell.split) {
            nodes.extend_from_slice(&self.pool[cell.nodes.0..cell.nodes.1]);
        }
    }
}

/// A length on the lattice in units of the sheet.
pub fn length(steps: i32) -> f64 {
    f64::from(steps) * (0.5 * GRID / f64::from(FIRST_HALF))
}

/// The cells of a sheet at work.
pub struct Cells<'a, S> {
    pub sheet: S,
    pub workspace: &'a mut Workspace,
}

impl<S: Sheet> Cells<'_, S> {
    /// Splits the cells that matter most until the estimate meets the tolerance; gives the estimate.
    pub fn refine(&mut self, tolerance: f64) -> f64 {
        let most = (CELLS / tolerance).clamp(FEWEST_CELLS, MOST_CELLS) as usize;
        loop {
            let (mut force, mut error, mut worst, mut live) = (Vec3::zeros(), 0.0, 0.0f64, 0usize);
            for cell in self.workspace.cells.iter().filter(|cell| !cell.split) {
                force += cell.force;
                error += cell.error + cell.aside;
                live += 1;
                if cell.half > 1 {
                    worst = worst.max(cell.error + cell.aside);
                }
            }
            let size = force.norm();
            let relative = if size > 0.0 { error / size } else { 1.0 };
            if self.sheet.is_lost() || relative <= tolerance || worst == 0.0 || self.workspace.cells.len() + 4 > most {
                return relative.min(1.0) + 1e-14;
            }
            let limit = (0.2 * worst).max(0.25 * tolerance * size / live as f64).min(worst);
            for index in 0..self.workspace.cells.len() {
                let cell = &self.workspace.cells[index];
                let room = self.workspace.cells.len() + 4 <= most;
                if !cell.split && cell.half > 1 && cell.error + cell.aside >= limit && room {
                    self.split(index);
                }
            }
        }
    }

    fn split(&mut self, index: usize) {
        let parent = self.workspace.cells[index];
        self.workspace.cells[index].split = true;
        let half = parent.half / 2;
        let first = self.workspace.cells.len();
        for (sx, sy) in [(-1, -1), (1, -1), (-1, 1), (1, 1)] {
            let center = (parent.center.0 + sx * half, parent.center.1 + sy * half);
            // From the middle of the parent, or else from a corner of it.
            let corner = ((sy + 1) * 3 + sx + 1) as usize;
            let (from, away) = if parent.vertices[4].is_some() { (4, 1) } else { (corner, -1) };
            let guess = parent.vertices[from].map_or(0.0, |from| {
                let from = &self.workspace.vertices[from as usize];
                let (dx, dy) = (length(away * sx * half), length(away * sy * half));
                from.height + from.slopes[0] * dx + from.slopes[1] * dy
            });
            if let Some(cell) = self.measure(parent.part, center, half, guess) {
                self.workspace.cells.push(cell);
            }
        }
        let children = &self.workspace.cells[first..];
        if let (true, Some(middle)) = (parent.inside && children.iter().all(|cell| cell.inside), parent.vertices[4]) {
            // Where the fields are smooth a split makes Simpson's rule fifteen times better, across a kink hardly so.
            let change = parent.force - children.iter().map(|cell| cell.force).sum::<Vec3>();
            let middle = &self.workspace.vertices[middle as usize];
            let (_, normal) = self.sheet.flat(middle.place, middle.height);
            let aside = across(&change, &normal) / 4.0;
            for cell in &mut self.workspace.cells[first..] {
                cell.aside = cell.aside.min(aside);
            }
        }
    }

    /// Integrates one cell; `None` when it holds no contact.
    pub fn measure(&mut self, part: u8, center: (i32, i32), half: i32, guess: f64) -> Option<Cell> {
        let middle = self.vertex((part, center.0, center.1), guess, guess);
        let mut vertices = [middle; 9];
        for (index, vertex) in vertices.iter_mut().enumerate().filter(|(index, _)| *index != 4) {
            let (i, j) = ((index % 3) as i32 - 1, (index / 3) as i32 - 1);
            let (height, slopes) = middle.map_or((guess, [0.0; 2]), |middle| {
                let middle = &self.workspace.vertices[middle as usize];
                (middle.height, middle.slopes)
            });
            let along = height + slopes[0] * length(i * half) + slopes[1] * length(j * half);
            *vertex = self.vertex((part, center.0 + i * half, center.1 + j * half), along, height);
        }
        let first = self.workspace.pool.len();
        let mut cell = Cell {
            part,
            center,
            half,
            vertices,
            inside: true,
            force: Vec3::zeros(),
            error: 0.0,
            aside: 0.0,
            nodes: (first, first),
            split: false,
        };
        let scale = self.sheet.pair().scale * (2.0 * length(half)).powi(2);
        // Simpson's rule, and the trapezes' with their ends corrected, which is of fourth order too; of the sideways
        // part, whose slopes are not known, the trapezes' alone.
        let (mut simpson, mut corrected, mut rough) = (0.0, 0.0, Vec3::zeros());
        for (index, vertex) in vertices.iter().enumerate() {
            let Some(vertex) = vertex.map(|vertex| &self.workspace.vertices[vertex as usize]).filter(|v| v.sum > 0.0)
            else {
                cell.inside = false;
                break;
            };
            let (column, row) = (index % 3, index / 3);
            let weight = SIMPSON[column] * SIMPSON[row];
            let force = vertex.area * (scale * vertex.sum);
            cell.force += force * weight;
            rough += force * (TRAPEZES[column] * TRAPEZES[row]);
            simpson += vertex.sum * weight;
            let ends = [TRAPEZES[row] * (1.0 - column as f64), TRAPEZES[column] * (1.0 - row as f64)];
            corrected += vertex.sum * TRAPEZES[column] * TRAPEZES[row]
                + (ends[0] * vertex.gradient[0] + ends[1] * vertex.gradient[1]) * length(half) / 24.0;
        }
        if let (true, Some(middle)) = (cell.inside, middle) {
            let middle = &self.workspace.vertices[middle as usize];
            let (unit, normal) = self.sheet.flat(middle.place, middle.height);
            cell.error = (simpson - corrected).abs() * scale * unit;
            cell.aside = SIDEWAYS * across(&(cell.force - rough), &normal);
        } else {
            cell.force = Vec3::zeros();
            let mut touched = false;
            for corner in [0, 1, 3, 4] {
                let quarter = [corner, corner + 1, corner + 3, corner + 4].map(|index| vertices[index]);
                touched |= self.quarter(quarter, &mut cell);
            }
            cell.nodes.1 = self.workspace.pool.len();
            if !touched {
                return None;
            }
        }
        Some(cell)
    }

    /// Adds what a quarter of a cell on the border carries. False when it holds no contact.
    fn quarter(&mut self, corners: [Option<u32>; 4], cell: &mut Cell) -> bool {
        let side = length(cell.half);
        let scale = self.sheet.pair().scale;
        let mut found = [None; 4];
        for (vertex, index) in found.iter_mut().zip(corners) {
            *vertex = index.map(|index| self.workspace.vertices[index as usize]);
        }
        let [Some(v00), Some(v10), Some(v01), Some(v11)] = found else {
            // Part of the surface is out of sight: at most all of it is pressed like what is seen.
            let highest = found.into_iter().flatten().max_by(|v, w| v.sum.total_cmp(&w.sum));
            let Some(vertex) = highest.filter(|vertex| vertex.sum > 0.0) else { return false };
            let weight = 0.5 * side * side;
            let force = vertex.area * (scale * vertex.sum * weight);
            self.workspace.pool.push(Node {
                position: self.sheet.point(vertex.place, vertex.height),
                force,
                area: vertex.area.norm() * weight,
                stiffness: vertex.stiffness * weight,
            });
            cell.force += force;
            cell.error += force.norm();
            return true;
        };
        let corners = [v00, v10, v01, v11];
        let bound =
            if corners.iter().any(|vertex| vertex.sum > 0.0) { None } else { Some(self.sheet.most(&corners, side)) };
        if bound.is_some_and(|bound| bound <= 0.0) {
            return false;
        }
        let part = 1.0 / f64::from(PARTS);
        let (mut force, mut area, mut stiffness, mut doubt) = (Vec3::zeros(), 0.0, 0.0, 0.0);
        let (mut moment, mut load) = ([0.0; 3], 0.0);
        for i in 0..PARTS {
            for j in 0..PARTS {
                let (x, y) = ((f64::from(i) + 0.5) * part, (f64::from(j) + 0.5) * part);
                let weights = [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y];
                let read = Reading::new(&corners, &weights, (x, y), side, part);
                let mut density = Vec3::zeros();
                let (mut height, mut hardness) = (0.0, 0.0);
                for (vertex, weight) in corners.iter().zip(weights) {
                    density += vertex.area * weight;
                    height += vertex.height * weight;
                    hardness += vertex.stiffness * weight;
                }
                let unit = (side * part).powi(2);
                let pressed = bound.map_or(read.pressed, |bound| read.pressed.min(bound));
                force += density * (scale * pressed * unit);
                doubt += bound.unwrap_or(read.doubt) * density.norm() * scale * unit;
                area += density.norm() * read.covered * unit;
                stiffness += hardness * read.covered * unit;
                load += pressed;
                for (sum, value) in moment.iter_mut().zip([x, y, height]) {
                    *sum += pressed * value;
                }
            }
        }
        cell.error += doubt;
        if load > 0.0 {
            cell.force += force;
            let [x, y, height] = moment.map(|sum| sum / load);
            let place = Place { part: cell.part, x: v00.place.x + x * side, y: v00.place.y + y * side };
            let position = self.sheet.point(place, height);
            self.workspace.pool.push(Node { position, force, area, stiffness });
        }
        true
    }

    /// The surface over a place of the lattice, from a guess of its height, or a second one.
    fn vertex(&mut self, key: (u8, i32, i32), guess: f64, second: f64) -> Option<u32> {
        if let Some(known) = self.workspace.places.get(&key) {
            return *known;
        }
        let place = Place { part: key.0, x: length(key.1), y: length(key.2) };
        let found = self.sheet.look(place, guess, second).map(|vertex| {
            self.workspace.vertices.push(vertex);
            (self.workspace.vertices.len() - 1) as u32
        });
        self.workspace.places.insert(key, found);
        found
    }
}

/// Length of the part of a vector across a unit vector.
fn across(v: &Vec3, direction: &Vec3) -> f64 {
    (v - direction * v.dot(direction)).norm()
}

/// `σ` in a part of a quarter of a cell, from the quarter's corners.
struct Reading {
    /// Share of it that is in contact.
    covered: f64,
    /// Mean of what is positive.
    pressed: f64,
    /// How far that may be off.
    doubt: f64,
}

impl Reading {
    fn new(corners: &[Vertex; 4], weights: &[f64; 4], (x, y): (f64, f64), side: f64, part: f64) -> Self {
        let (mut joined, mut blended, mut inside) = (0.0, 0.0, true);
        // The lowest tangent of a place in contact: what a concave pressure stays below.
        let (mut below, mut slope_below) = (f64::INFINITY, [0.0; 2]);
        let (mut slope_joined, mut slope_blended) = ([0.0; 2], [0.0; 2]);
        for (index, (vertex, weight)) in corners.iter().zip(weights).enumerate() {
            let (cx, cy) = ((index % 2) as f64, (index / 2) as f64);
            let tangent = vertex.sum + side * (vertex.gradient[0] * (x - cx) + vertex.gradient[1] * (y - cy));
            joined += weight * vertex.sum;
            blended += weight * tangent;
            // Outside, where fields run out into nothing, tangents bound nothing.
            inside &= vertex.sum > 0.0;
            if vertex.sum > 0.0 && tangent < below {
                (below, slope_below) = (tangent, vertex.gradient);
            }
            // Slopes of the weights, a unit of the coordinates.
            let towards = [
                (2.0 * cx - 1.0) * if cy > 0.0 { y } else { 1.0 - y } / side,
                (2.0 * cy - 1.0) * if cx > 0.0 { x } else { 1.0 - x } / side,
            ];
            for axis in 0..2 {
                slope_joined[axis] += towards[axis] * vertex.sum;
                slope_blended[axis] += towards[axis] * tangent + weight * vertex.gradient[axis];
            }
        }
        let positive = |value: f64, gradient: [f64; 2]| positive_part(value, gradient.map(|slope| slope * side * part));
        let mean = |x: [f64; 2], y: [f64; 2]| [0, 1].map(|axis| 0.5 * (x[axis] + y[axis]));
        let (covered, pressed) = positive(0.5 * (joined + blended), mean(slope_joined, slope_blended));
        if inside {
            return Self { covered, pressed, doubt: 0.5 * (blended - joined).abs() };
        }
        let least = positive(joined, slope_joined);
        if below == f64::INFINITY {
            return Self { covered, pressed, doubt: least.1 };
        }
        // Tangents from outside, where profiles have another slope, may lead away from what both of these agree on.
        let most = positive(below, slope_below);
        let (low, high) = if least.1 < most.1 { (least, most) } else { (most, least) };
        let (covered, pressed) = if pressed < low.1 {
            low
        } else if pressed > high.1 {
            high
        } else {
            (covered, pressed)
        };
        let doubt = high.1 - low.1;
        Self { covered, pressed, doubt }
    }
}

/// Over a square on which a value at the centre changes linearly by `(a, b)` from side to side: the part where it is
/// positive, and the mean of its positive part.
fn positive_part(value: f64, [a, b]: [f64; 2]) -> (f64, f64) {
    let (a, b) = (a.abs(), b.abs());
    let reach = 0.5 * (a + b);
    if value >= reach {
        return (1.0, value);
    }
    if value <= -reach {
        return (0.0, 0.0);
    }
    // Divided differences of the cube; a slope that is nearly nil must not cancel.
    let least = 1e-4 * reach;
    let (a, b) = (a.max(least), b.max(least));
    let (mut square, mut cube) = (0.0, 0.0);
    for (sign, at) in [(1.0, a + b), (-1.0, a - b), (-1.0, b - a), (1.0, -a - b)] {
        let level: f64 = (value + 0.5 * at).max(0.0);
        square += sign * level * level;
        cube += sign * level * level * level;
    }
    (square / (2.0 * a * b), cube / (6.0 * a * b))
}

#[cfg(test)]
mod tests {
    use super::positive_part;

    #[test]
    fn the_positive_part_of_a_linear_function_is_that_of_many_samples() {
        let n = 400;
        for (value, slopes) in [(0.1, [1.0, 0.4]), (-0.3, [0.2, 0.9]), (0.0, [1.0, 0.0]), (0.2, [-0.5, 0.5])] {
            let (mut part, mut mean) = (0.0, 0.0);
            for i in 0..n {
                for j in 0..n {
                    let at = |k: usize| (k as f64 + 0.5) / n as f64 - 0.5;
                    let level: f64 = value + slopes[0] * at(i) + slopes[1] * at(j);
                    part += f64::from(level > 0.0) / (n * n) as f64;
                    mean += level.max(0.0) / (n * n) as f64;
                }
            }
            let (covered, pressed) = positive_part(value, slopes);
            assert!((covered - part).abs() < 3e-3, "{value} {slopes:?}: {covered} of {part}");
            assert!((pressed - mean).abs() < 1e-4, "{value} {slopes:?}: {pressed} of {mean}");
        }
    }
}
