//! Vertices on their way to where the field has a given value, all of a block side by side.
//!
//! Each goes along the gradient, by Newton's steps of a bounded length. Once it has been on both sides of its level, it
//! stays between. Where the gradient turns sharply from one step to the next, between parts that don't blend, it has
//! come to the border of their territories: there it stops, as the level beyond is another part's.

use crate::math::{Vec3, ball_round};
use crate::surface::deformed::Deformed;
use crate::surface::prepared::Prepared;

/// Longest last step, over the smallest thickness near a vertex: after Newton's step what is left is about its square.
const LAST: f64 = 1e-3;
/// Longest step, likewise.
const STRIDE: f64 = 0.25;
/// How far skeletons are looked for beyond the vertices, over the smallest thickness of all.
const MARGIN: f64 = 0.5;
/// Most evaluations.
const ROUNDS: usize = 40;
/// Cosine of the sharpest turn of a gradient that is no border: 55 degrees, as in Vaillant et al. 2013.
const SHARP: f64 = 0.57;
/// Halvings of the step across a border.
const HALVINGS: u32 = 6;

/// A vertex.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Where it is \[m\].
    pub position: Vec3,
    /// Where it is going; none if it stays.
    level: Option<f64>,
    /// Gradient of the deformed field where it is.
    gradient: Vec3,
    /// The last place on the other side of its level, and how far off the level was there.
    across: Option<(Vec3, f64)>,
    /// How far off the level it was one step ago.
    before: f64,
    /// Where it was one step ago, and the coat's own gradient there.
    last: Option<(Vec3, Vec3)>,
    /// On the way to a border: a place beyond it, and the halvings left.
    border: Option<(Vec3, u32)>,
}

impl Vertex {
    pub fn new(position: Vec3, level: Option<f64>) -> Self {
        Self { position, level, gradient: Vec3::zeros(), across: None, before: f64::INFINITY, last: None, border: None }
    }

    /// Goes on from where the coat's own field has this value and gradient; false when it has arrived.
    fn step(&mut self, near: &Deformed, pressed: bool, value: f64, own: &Vec3, thin: f64) -> bool {
        let Some(level) = self.level else { return false };
        if let Some((beyond, left)) = &mut self.border {
            let Some((inner, slope)) = &mut self.last else { return false };
            if is_sharp(slope, own) {
                *beyond = self.position;
            } else {
                (*inner, *slope) = (self.position, *own);
            }
            *left -= 1;
            self.position = if *left == 0 { *inner } else { (*inner + *beyond) * 0.5 };
            return *left > 0;
        }
        // The coat that ends at the vertex' own level is deformed as the coat itself is.
        let alone = (value - level, *own);
        let term = if pressed { near.term(&self.position, &alone) } else { (0.0, Vec3::zeros()) };
        let (excess, gradient) = (alone.0 + term.0, own + term.1);
        let is_held = term.0 < 0.0 && excess < 0.0;
        if let Some((inner, slope)) = self.last
            && !near.coat.graph.is_complete()
            && !is_held
            && is_sharp(&slope, own)
        {
            self.border = Some((self.position, HALVINGS));
            self.position = (inner + self.position) * 0.5;
            return true;
        }
        self.gradient = gradient;
        let slope = gradient.norm();
        if slope == 0.0 {
            return false;
        }
        if excess.abs() <= LAST * thin * slope {
            self.position -= gradient * (excess / (slope * slope));
            return false;
        }
        if let Some((inner, _)) = self.last
            && (excess < 0.0) != (self.before < 0.0)
        {
            self.across = Some((inner, self.before));
        }
        let length = (excess.abs() / slope).min(STRIDE * thin);
        let newton = gradient * (-excess.signum() * length / slope);
        let next = match self.across {
            None => self.position + newton,
            Some((other, _)) if excess.abs() > 0.5 * self.before.abs() => (self.position + other) * 0.5,
            Some((other, at_other)) if length > (other - self.position).norm() => {
                self.position + (other - self.position) * (excess / (excess - at_other))
            }
            Some(_) => self.position + newton,
        };
        (self.last, self.before) = (Some((self.position, *own)), excess);
        self.position = next;
        true
    }

    /// The outward unit normal of the deformed field, if it has one.
    pub fn outward(&self) -> Option<Vec3> {
        (-self.gradient).try_normalize(0.0)
    }
}

/// Memory of [`Settler::settle`].
#[derive(Debug, Default)]
pub struct Settler {
    /// Those that are still on their way.
    going: Vec<u32>,
    points: Vec<[f64; 3]>,
    values: Vec<f64>,
    gradients: Vec<[f64; 3]>,
}

impl Settler {
    /// Brings vertices, which are near each other, to their levels.
    pub fn settle(&mut self, coat: &mut Prepared, vertices: &mut [Vertex]) {
        let Self { going, points, values, gradients } = self;
        going.clear();
        going.extend((0..vertices.len() as u32).filter(|index| vertices[*index as usize].level.is_some()));
        let thinnest = coat.thinnest();
        for _ in 0..ROUNDS {
            if going.is_empty() {
                return;
            }
            points.clear();
            points.extend(going.iter().map(|index| <[f64; 3]>::from(vertices[*index as usize].position)));
            let (center, radius) = ball_round(points);
            let near = coat.around(&center, radius + MARGIN * thinnest);
            values.resize(points.len(), 0.0);
            gradients.resize(points.len(), [0.0; 3]);
            near.coat.evaluate(points, Some(&mut *values), Some(&mut *gradients));
            let thicknesses = near.coat.skeletons.iter().map(|skeleton| skeleton.profile.thickness);
            let thin = thicknesses.fold(f64::INFINITY, f64::min);
            let pressed = near.obstacles.iter().any(|obstacle| !obstacle.coat.skeletons.is_empty());
            let mut fields = values.iter().zip(&*gradients);
            going.retain(|index| {
                let Some((value, own)) = fields.next() else { return false };
                vertices[*index as usize].step(near, pressed, *value, &Vec3::from(*own), thin)
            });
        }
    }
}

/// Whether a gradient turns so sharply that there must be a border in between.
fn is_sharp(a: &Vec3, b: &Vec3) -> bool {
    a.dot(b) < SHARP * a.norm() * b.norm()
}
