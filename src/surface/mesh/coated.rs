//! A coat, as others press on it or not, as the mesher sees it: its parts are its skeletons.

use super::{Cubes, Solid, Spans};
use crate::field::{Graph, Placed, Shape, blend, lanes};
use crate::math::{Vec3, ball_round};
use crate::surface::deformed::{Deformed, Obstacle};

/// Rounding of a sum of fields, over the isovalue: bounds that are closer to it than that decide nothing.
const ROUNDING: f64 = 1e-9;

/// Memory of [`Coated`], to be used again.
#[derive(Debug, Default)]
pub struct Scratch {
    graph: Graph,
    placed: Vec<Placed>,
    gradients: Vec<[f64; 3]>,
    /// Bounds of the fields of the obstacles.
    obstacles: Vec<(Vec3, Vec3)>,
}

/// A coat to be meshed; it has no planes.
pub struct Coated<'a> {
    deformed: &'a Deformed,
    scratch: &'a mut Scratch,
}

impl<'a> Coated<'a> {
    /// A coat with what presses on it.
    pub fn new(deformed: &'a Deformed, scratch: &'a mut Scratch) -> Self {
        scratch.obstacles.clear();
        scratch.obstacles.extend(deformed.obstacles.iter().map(|obstacle| obstacle.coat.bounds()));
        Self { deformed, scratch }
    }

    /// Whether the coat has bounds at all.
    pub fn is_bounded(deformed: &Deformed) -> bool {
        !deformed.coat.skeletons.iter().any(|skeleton| matches!(skeleton.shape, Shape::Plane { .. }))
    }

    /// The obstacles whose fields may reach a ball round `center`.
    fn pressing(&self, center: Vec3, radius: f64) -> impl Iterator<Item = &Obstacle> {
        let with_bounds = self.deformed.obstacles.iter().zip(&self.scratch.obstacles);
        let near = move |(obstacle, (low, high)): &(&Obstacle, &(Vec3, Vec3))| {
            let apart = (0..3).any(|k| center[k] + radius < low[k] || center[k] - radius > high[k]);
            let reaches = |k: &Placed| k.shape.closest(&center).distance < k.profile.radius + radius;
            !apart && obstacle.coat.skeletons.iter().any(reaches)
        };
        with_bounds.filter(near).map(|(obstacle, _)| obstacle)
    }

    /// The field of the undeformed coat.
    fn field(&mut self, parts: &[u32], points: &[[f64; 3]], values: &mut [f64], gradients: Option<&mut [[f64; 3]]>) {
        let coat = &self.deformed.coat;
        let Scratch { graph, placed, .. } = &mut *self.scratch;
        if coat.graph.is_complete() {
            graph.clear();
        } else {
            coat.graph.restrict(parts, graph);
        }
        if graph.is_complete() {
            return lanes::evaluate_some(&coat.skeletons, parts, points, Some(values), gradients);
        }
        placed.clear();
        placed.extend(parts.iter().map(|part| coat.skeletons[*part as usize]));
        blend::evaluate(placed, graph, points, Some(values), gradients);
    }
}

impl Solid for Coated<'_> {
    fn parts(&self) -> usize {
        self.deformed.coat.skeletons.len()
    }

    fn bounds(&self, part: usize) -> (Vec3, Vec3) {
        let skeleton = &self.deformed.coat.skeletons[part];
        skeleton.shape.bounds(skeleton.profile.radius)
    }

    fn scale(&self) -> f64 {
        self.deformed.coat.skeletons.iter().map(|skeleton| skeleton.profile.thickness).fold(f64::INFINITY, f64::min)
    }

    fn has_kinks(&self) -> bool {
        !self.deformed.obstacles.is_empty() || !self.deformed.coat.graph.is_complete()
    }

    fn look(&mut self, parts: &[u32], cubes: &Cubes, spans: &mut Spans) -> [Option<bool>; 8] {
        let coat = &self.deformed.coat;
        lanes::spans(&coat.skeletons, parts, cubes, spans);
        // Any single field is at most what a graph makes of all; that is at most their sum and what it rounds off.
        let least = if coat.graph.is_complete() { &spans.least } else { &spans.strongest };
        let (level, slack) = (coat.isovalue, ROUNDING * coat.isovalue);
        std::array::from_fn(|k| {
            let (mut low, mut high) = (least[k] - level, spans.most[k] + coat.graph.rise() - level);
            for obstacle in self.pressing(cubes.centers[k].into(), cubes.half * 3.0_f64.sqrt()) {
                low = f64::NEG_INFINITY;
                high += obstacle.bulge.height;
            }
            // Nothing reaches it: no obstacle can raise a surface there.
            let empty = spans.most[k] == 0.0;
            if high < -slack || empty {
                Some(false)
            } else if low > slack {
                Some(true)
            } else {
                None
            }
        })
    }

    fn evaluate(&mut self, parts: &[u32], points: &[[f64; 3]], excess: &mut [f64], gradients: Option<&mut [[f64; 3]]>) {
        let isovalue = self.deformed.coat.isovalue;
        let pressed = !self.deformed.obstacles.is_empty() && {
            let (center, radius) = ball_round(points);
            self.pressing(center, radius).next().is_some()
        };
        if !pressed {
            self.field(parts, points, excess, gradients);
            return excess.iter_mut().for_each(|excess| *excess -= isovalue);
        }
        // The terms need gradients.
        let mut own = std::mem::take(&mut self.scratch.gradients);
        own.resize(points.len(), [0.0; 3]);
        let gradients = gradients.unwrap_or(&mut own);
        self.field(parts, points, excess, Some(&mut *gradients));
        for ((p, excess), gradient) in points.iter().zip(excess).zip(&mut *gradients) {
            let slope = Vec3::from(*gradient);
            *excess -= isovalue;
            let term = self.deformed.term(&Vec3::from(*p), &(*excess, slope));
            *excess += term.0;
            *gradient = (slope + term.1).into();
        }
        self.scratch.gradients = own;
    }
}
