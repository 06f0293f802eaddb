//! Skeletons on their way to where their summed field has its isovalue on the mesh: Levenberg's and Marquardt's method.
//!
//! The field of a skeleton at distance `d` is `F((t - d) / w)` for all of one width `w = R - t`. What is made small is
//! the distance of both surfaces, to the first order: at points of the mesh, and at points of the coat's surface, which
//! is meshed anew in each round, so that what sticks out and what is hollow is seen. The residual at a point that is to
//! be `s` outside the coat (0 on the mesh; for a point of the coat, how far it is outside the mesh) is
//!
//! ```text
//! r = (h(f) - h(c)) / |∇h(f)| + s
//! ```
//!
//! where `h(f)` straightens the field, so that it falls off evenly round a single skeleton: the square root outside, as the
//! outer piece of a profile of that stiffness is a parabola. In the derivatives of `r`, `|∇h|` is held.

use super::measure::Mesher;
use super::sparse::Rows;
use super::target::{Sample, Target};
use super::{Primitive, Settings};
use crate::coat::Coat;
use crate::error::Result;
use crate::field::{Placed, Profile, Shape};
use crate::math::Vec3;
use crate::surface::tree::Tree;

/// Most rounds.
const ROUNDS: usize = 60;
/// Rounds in a row that gain less than a part of the sum of squares, after which no more is to be had.
const IDLE: usize = 4;
const GAIN: f64 = 2e-3;
/// Tries of a round, each with more damping than the last.
const TRIES: usize = 8;
/// Most steps of conjugate gradients, and where they end.
const STEPS: usize = 60;
const TOLERANCE: f64 = 1e-3;
/// Longest step of an end in a round, over the thickness and the width.
const STRIDE: f64 = 0.5;
/// Least slope of the straightened field that a residual is measured by, over the slope round a single skeleton, `1 / w`.
const FLAT: f64 = 0.25;

/// A skeleton, in the frame of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted {
    /// The ends of a segment; twice a point.
    pub ends: [Vec3; 2],
    /// Distance of its surface, were it alone.
    pub thickness: f64,
    /// The bone that it belongs to.
    pub bone: u32,
}

impl Fitted {
    /// The skeleton with a field of this width, for an isovalue of 1.
    fn placed(&self, width: f64) -> Placed {
        let shape = Shape::segment(self.ends[0], self.ends[1]);
        let profile = Profile::new(1.0, self.thickness, 0.0, 1.0, self.thickness + width, false);
        Placed { shape, profile: profile.expect("thickness and width are kept within their ranges") }
    }
}

/// The coat of some skeletons.
pub fn coat(skeletons: &[Fitted], width: f64) -> Coat {
    let mut coat = Coat::new(Vec3::zeros(), 1.0);
    coat.skeletons.extend(skeletons.iter().map(|skeleton| skeleton.placed(width)));
    coat
}

/// A point where the field is looked at.
#[derive(Clone, Copy, Debug)]
struct Point {
    at: Vec3,
    /// How far outside the coat it is to be.
    outside: f64,
    weight: f64,
    /// Slope of the straightened field at the beginning of the round; 0 where there is no field.
    slope: f64,
}

/// The straightened field, less its value at the surface; and its derivative.
fn straight(f: f64) -> (f64, f64) {
    if f < 1.0 { (f.sqrt() - 1.0, 0.5 / f.sqrt()) } else { (0.5 * (f - 1.0), 0.5) }
}

/// A coat, with its fields in a tree.
struct Field {
    coat: Coat,
    tree: Tree,
}

impl Field {
    fn new(skeletons: &[Fitted], width: f64) -> Self {
        let coat = coat(skeletons, width);
        let mut tree = Tree::default();
        tree.build_of(&coat);
        Self { coat, tree }
    }

    /// The skeletons that may have a field at a point, in ascending order.
    fn near(&self, p: &Vec3, near: &mut Vec<u32>) {
        near.clear();
        self.tree.near(p, 0.0, |skeleton| near.push(skeleton));
        near.sort_unstable();
    }

    /// The sum of squares of the residuals.
    fn cost(&self, points: &[Point], near: &mut Vec<u32>) -> f64 {
        let square = |point: &Point| {
            if point.slope == 0.0 {
                return 0.0;
            }
            self.near(&point.at, near);
            let f = near.iter().map(|skeleton| self.coat.skeletons[*skeleton as usize].value(&point.at)).sum();
            point.weight * (straight(f).0 / point.slope + point.outside).powi(2)
        };
        points.iter().map(square).sum()
    }
}

/// Moves skeletons, and changes their thicknesses, until the surfaces come no closer.
pub fn refine(target: &Target, samples: &[Sample], settings: &Settings, skeletons: &mut Vec<Fitted>) -> Result<()> {
    let cell = (target.area / samples.len() as f64).sqrt();
    let on_mesh = samples.iter().map(|sample| Point {
        at: sample.point,
        outside: 0.0,
        weight: 1.0 / samples.len() as f64,
        slope: 0.0,
    });
    let mut points: Vec<Point> = on_mesh.collect();
    let (mut mesher, mut rows) = (Mesher::default(), Rows::default());
    let (mut near, mut step) = (Vec::new(), Vec::new());
    let (mut damping, mut idle) = (1e-2, 0);
    for _ in 0..ROUNDS {
        let mut field = Field::new(skeletons, settings.width);
        field.coat = mesher.make(field.coat, cell)?;
        points.truncate(samples.len());
        let areas = mesher.areas();
        let all: f64 = areas.iter().sum();
        for (position, area) in mesher.mesh.positions.iter().zip(areas) {
            let at = Vec3::from(*position);
            points.push(Point { at, outside: target.foot(&at).distance, weight: area / all, slope: 0.0 });
        }
        fill(&mut rows, &field, skeletons, &mut points, settings, &mut near);
        let cost = field.cost(&points, &mut near);
        let mut better = None;
        for _ in 0..TRIES {
            rows.solve(damping, STEPS, TOLERANCE, &mut step, skeletons.len());
            let moved = settings.moved(target, skeletons, &step);
            let now = Field::new(&moved, settings.width).cost(&points, &mut near);
            if now < cost {
                better = Some((moved, now));
                damping = f64::max(damping / 3.0, 1e-4);
                break;
            }
            damping *= 10.0;
        }
        let Some((moved, now)) = better else { break };
        *skeletons = moved;
        idle = if now > cost * (1.0 - GAIN) { idle + 1 } else { 0 };
        if idle == IDLE {
            break;
        }
    }
    Ok(())
}

/// The residuals and their derivatives, a row a point; and the slopes at the points.
fn fill(
    rows: &mut Rows,
    field: &Field,
    skeletons: &[Fitted],
    points: &mut [Point],
    settings: &Settings,
    near: &mut Vec<u32>,
) {
    let stride = settings.unknowns();
    rows.clear(stride);
    let mut parts = Vec::new();
    for point in points {
        field.near(&point.at, near);
        parts.clear();
        let (mut f, mut gradient) = (0.0, Vec3::zeros());
        for skeleton in &*near {
            let Placed { shape, profile } = &field.coat.skeletons[*skeleton as usize];
            let closest = shape.closest(&point.at);
            let (value, slope) = profile.value_slope(closest.distance);
            if value > 0.0 {
                f += value;
                gradient += closest.normal * slope;
                parts.push((*skeleton, closest.normal, slope));
            }
        }
        point.slope = 0.0;
        if f > 0.0 {
            let (excess, bend) = straight(f);
            point.slope = (bend * gradient.norm()).max(FLAT / settings.width);
            for (skeleton, normal, slope) in &parts {
                // By the distance, and so against the thickness.
                let by_distance = bend / point.slope * slope;
                let ends = &skeletons[*skeleton as usize].ends;
                let along = share(ends, &point.at);
                let mut entries = [0.0; Settings::MOST_UNKNOWNS];
                entries[..3].copy_from_slice((normal * (-by_distance * (1.0 - along))).as_slice());
                entries[3..6].copy_from_slice((normal * (-by_distance * along)).as_slice());
                entries[stride - 1] = -by_distance;
                rows.block(*skeleton as usize, &entries[..stride]);
            }
            rows.end_row(-(excess / point.slope + point.outside), point.weight);
        }
    }
}

/// How far along a segment the closest point of it is, from 0 to 1; 0 of a point.
fn share([a, b]: &[Vec3; 2], p: &Vec3) -> f64 {
    let along = b - a;
    let length2 = along.norm_squared();
    if length2 > 0.0 { ((p - a).dot(&along) / length2).clamp(0.0, 1.0) } else { 0.0 }
}

impl Settings {
    /// Unknowns of a segment.
    const MOST_UNKNOWNS: usize = 7;

    /// Unknowns of a skeleton: its ends, and last its thickness.
    fn unknowns(&self) -> usize {
        if self.primitive == Primitive::Segment { Self::MOST_UNKNOWNS } else { 4 }
    }

    /// The skeletons after a step, which is cut where it is long. Ends stay inside the mesh, and with their bone.
    fn moved(&self, target: &Target, skeletons: &[Fitted], step: &[f64]) -> Vec<Fitted> {
        let moved = |(skeleton, step): (&Fitted, &[f64])| {
            let stride = STRIDE * (skeleton.thickness + self.width);
            let mut moved = *skeleton;
            for (k, end) in moved.ends.iter_mut().enumerate() {
                let first = if self.primitive == Primitive::Segment { 3 * k } else { 0 };
                let step = Vec3::from_column_slice(&step[first..first + 3]);
                let to = *end + step * (stride / step.norm().max(stride));
                let foot = target.foot(&to);
                if foot.bone == skeleton.bone {
                    *end = if foot.distance > 0.0 { foot.point } else { to };
                }
            }
            let change = step[step.len() - 1].clamp(-STRIDE * skeleton.thickness, STRIDE * skeleton.thickness);
            moved.thickness = (skeleton.thickness + change).clamp(self.thinnest(), 1.0);
            moved
        };
        skeletons.iter().zip(step.chunks_exact(self.unknowns())).map(moved).collect()
    }
}
