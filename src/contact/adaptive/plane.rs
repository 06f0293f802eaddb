//! The surface as a height over a plane through its deepest point, turned where it leans over.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::cells::{Cells, FIRST_HALF, GRID, MOST_FIRST_CELLS, Place, Sheet, Vertex};
use super::{SOLVED, Workspace};
use crate::contact::column::{Frame, Solver};
use crate::contact::deepest::Deepest;
use crate::contact::pair::Pair;
use crate::contact::patch::Node;
use crate::contact::target::{Integrated, Target, Unfit};
use crate::math::Vec3;

/// Sum of two unit normals below which they are opposite: no plane is between.
const OPPOSITE: f64 = 0.1;

/// How often the plane is turned towards a part of the surface that leans over.
const MOST_TURNS: u32 = 2;

/// The cell of the first grid that holds a point of the plane.
pub fn grid_cell(x: f64, y: f64) -> (i32, i32) {
    ((x / GRID).round() as i32, (y / GRID).round() as i32)
}

/// How far the first grid has come.
#[derive(Debug, Default)]
pub struct Spread {
    visited: HashMap<(i32, i32), bool>,
    queue: Vec<(i32, i32, f64)>,
}

/// The plane of a frame.
struct Plane<'a> {
    solver: Solver<'a>,
    /// The normal where the surface leans over.
    leans: Option<Vec3>,
}

/// The same as [`super::integrate`], over planes.
pub fn integrate(
    target: &Target,
    workspace: &mut Workspace,
    nodes: &mut Vec<Node>,
    cells: &mut Vec<(i32, i32)>,
) -> Result<Integrated, Unfit> {
    let Target { at, extent, tolerance, .. } = *target;
    let Workspace { cells: workspace, spread } = workspace;
    let mut solver = target.solver(Frame::new(at, [1.0, 1.0]));
    solver.accept *= SOLVED;
    if solver.fit(at, extent).is_none() {
        // No clear border along an axis: the prediction will do, the cells spread by themselves.
        let scale = solver.frame.scale.map(|s| s.min(extent));
        solver.frame = Frame::new(at, scale);
    }
    let mut sheet = Plane { solver, leans: None };
    let mut turns = 0;
    let error = loop {
        let mut work = Cells { sheet, workspace };
        // A tilted face is deepest at its rounded edge, which says nothing of its size.
        while !spread.cover(&mut work, at) {
            let frame = &mut work.sheet.solver.frame;
            frame.scale = frame.scale.map(|scale| 4.0 * scale);
        }
        let error = work.refine(tolerance);
        sheet = work.sheet;
        let Some(normal) = sheet.leans.take() else { break error };
        // Round an edge, a plane half way between sees both sides.
        let solver = &mut sheet.solver;
        let between = solver.frame.normal + normal;
        if turns == MOST_TURNS || between.norm() < OPPOSITE {
            return Err(Unfit { evaluations: solver.evaluations });
        }
        turns += 1;
        solver.frame = solver.frame.facing(&between);
    };
    let (frame, evaluations) = (sheet.solver.frame, sheet.solver.evaluations);
    if workspace.cells.is_empty() {
        // Nothing of it is seen along the plane's normal.
        return Err(Unfit { evaluations });
    }
    workspace.collect(&sheet, nodes);
    let first = cells.len();
    cells.extend(spread.visited.iter().filter(|(_, active)| **active).map(|(key, _)| *key));
    cells[first..].sort_unstable();
    Ok(Integrated { error, evaluations, frame })
}

impl Spread {
    /// Covers the contact with cells of the first grid, from the deepest point outwards. False when they are too many.
    fn cover(&mut self, work: &mut Cells<Plane>, at: &Deepest) -> bool {
        let Self { visited, queue } = self;
        work.workspace.clear();
        visited.reserve(visited.len());
        queue.reserve(queue.len());
        visited.clear();
        queue.clear();
        let (x, y, height) = work.sheet.solver.frame.coordinates(&at.position);
        let (i, j) = grid_cell(x, y);
        queue.push((i, j, height));
        visited.insert((i, j), false);
        let mut next = 0;
        while !work.sheet.is_lost() && next < queue.len() {
            if work.workspace.cells.len() >= MOST_FIRST_CELLS {
                return false;
            }
            let (i, j, guess) = queue[next];
            next += 1;
            let Some(cell) = work.measure(0, (2 * i * FIRST_HALF, 2 * j * FIRST_HALF), FIRST_HALF, guess) else {
                continue;
            };
            visited.insert((i, j), true);
            for (di, dj) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (1, -1), (-1, 1), (-1, -1)] {
                let key = (i + di, j + dj);
                if let Entry::Vacant(entry) = visited.entry(key) {
                    entry.insert(false);
                    // From the place of this cell that is next to the other's centre.
                    let near = cell.vertices[((dj + 1) * 3 + di + 1) as usize];
                    let guess = near.map_or(guess, |near| {
                        let near = &work.workspace.vertices[near as usize];
                        near.height + 0.5 * GRID * (near.slopes[0] * f64::from(di) + near.slopes[1] * f64::from(dj))
                    });
                    queue.push((key.0, key.1, guess));
                }
            }
            work.workspace.cells.push(cell);
        }
        true
    }
}

impl Plane<'_> {
    /// The normal where a column was not found, if there is still pressure.
    fn contact_leaning(&mut self, x: f64, y: f64, guess: f64) -> Option<Vec3> {
        let sample = self.solver.pair.sample(&self.solver.frame.point(x, y, guess));
        if sample.is_pressed(0.0) { sample.normal() } else { None }
    }
}

impl Sheet for Plane<'_> {
    fn pair(&self) -> &Pair {
        self.solver.pair
    }

    fn point(&self, place: Place, height: f64) -> Vec3 {
        self.solver.frame.point(place.x, place.y, height)
    }

    fn flat(&self, _: Place, _: f64) -> (f64, Vec3) {
        (self.solver.frame.unit_area(), self.solver.frame.normal)
    }

    fn look(&mut self, place: Place, guess: f64, second: f64) -> Option<Vertex> {
        let Place { x, y, .. } = place;
        let column = [guess, second, 0.0].into_iter().find_map(|guess| self.solver.column(x, y, guess));
        let Some(column) = column else {
            if self.leans.is_none() {
                self.leans = self.contact_leaning(x, y, guess);
            }
            return None;
        };
        let frame = &self.solver.frame;
        let sample = &column.sample;
        let fall = -sample.difference_gradient.dot(&frame.normal);
        let rise = sample.sum_gradient.dot(&frame.normal);
        let (mut slopes, mut gradient) = ([0.0; 2], [0.0; 2]);
        for (axis, direction) in [frame.u, frame.v].into_iter().enumerate() {
            slopes[axis] = sample.difference_gradient.dot(&direction) / fall * frame.scale[axis];
            gradient[axis] = sample.sum_gradient.dot(&direction) * frame.scale[axis] + rise * slopes[axis];
        }
        // Vector area: n dA = ∇Φ / (∇Φ·normal) times the area in the plane.
        let area = sample.difference_gradient * (-frame.unit_area() / fall);
        let size = area.norm();
        let stiffness = size * self.solver.pair.normal_stiffness(sample, &(area / size));
        Some(Vertex { place, height: column.height, slopes, sum: column.sum, gradient, area, stiffness })
    }

    /// What the fields can at most be within the slanted box that the surface lies in.
    fn most(&self, corners: &[Vertex; 4], side: f64) -> f64 {
        let frame = &self.solver.frame;
        let [v00, v10, v01, v11] = corners;
        let mean = |value: &dyn Fn(&Vertex) -> f64| 0.25 * corners.iter().map(value).sum::<f64>();
        let (height, half) = (mean(&|vertex| vertex.height), 0.5 * side);
        let rise =
            [v10.height + v11.height - v00.height - v01.height, v01.height + v11.height - v00.height - v10.height]
                .map(|rise| 0.25 * rise);
        let twist = 0.25 * (v00.height + v11.height - v10.height - v01.height).abs();
        let turn = |axis: usize| {
            let slopes = corners.map(|vertex| vertex.slopes[axis]);
            slopes.iter().fold(f64::MIN, |x, y| x.max(*y)) - slopes.iter().fold(f64::MAX, |x, y| x.min(*y))
        };
        let bend = twist + 0.25 * side * (turn(0) + turn(1));
        let center = frame.point(v00.place.x + half, v00.place.y + half, height);
        let legs = [
            frame.u * (half * frame.scale[0]) + frame.normal * rise[0],
            frame.v * (half * frame.scale[1]) + frame.normal * rise[1],
            frame.normal * bend,
        ];
        self.solver.pair.most(&center, &legs)
    }

    fn is_lost(&self) -> bool {
        self.leans.is_some()
    }
}
