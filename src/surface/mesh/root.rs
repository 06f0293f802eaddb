//! Where the surface crosses edges of the lattice: many roots at once.

use super::Solid;
use crate::math::Vec3;

/// Longest step along the edge that is trusted, in cells: the normal is that of the point before it.
const LAST_STEP: f64 = 0.05;
/// What the bend of the field may leave of an error after the last step, over the length scale of the solid.
const ERROR: f64 = 4e-5;
/// Longest last step, over the same, where the slope may jump on the way: neither end of the edge tells of a narrow
/// bulge between them, so the point before the step has to be this near already.
const LAST_STEP_AT_KINKS: f64 = 3e-4;
/// A step, over the same, that needs no look at the bend.
const NO_STEP: f64 = 1e-6;
/// Nearest to an end of the edge, in cells: vertices of edges that meet there stay apart.
const MARGIN: f64 = 1e-6;
/// Evaluations of a root at most: enough to halve the edge down to rounding.
const ROUNDS: usize = 48;

/// An edge of the lattice whose ends differ.
#[derive(Clone, Copy, Debug)]
pub struct Crossing {
    base: [f64; 3],
    axis: usize,
    /// Where the surface is, as far as is known, in cells from the base.
    place: f64,
    /// Nearest places on either side of it, with the excess there.
    inside: [f64; 2],
    outside: [f64; 2],
    /// Outward unit normal.
    pub normal: [f64; 3],
}

impl Crossing {
    /// From the excess at both ends.
    pub fn new(base: [f64; 3], axis: usize, ends: [f64; 2]) -> Self {
        let (lower, upper) = ([0.0, ends[0]], [1.0, ends[1]]);
        let (inside, outside) = if ends[0] >= 0.0 { (lower, upper) } else { (upper, lower) };
        let mut crossing = Self { base, axis, place: 0.5, inside, outside, normal: [0.0; 3] };
        crossing.place = crossing.secant();
        crossing
    }

    /// Where a straight line between the ends has its root; the middle if rounding leaves none.
    fn secant(&self) -> f64 {
        let [[a, high], [b, low]] = [self.inside, self.outside];
        let place = a + (b - a) * (high / (high - low));
        if place > a.min(b) && place < a.max(b) { place } else { 0.5 * (a + b) }
    }

    /// The point on the edge.
    pub fn position(&self, cell: f64) -> [f64; 3] {
        let mut position = self.base;
        position[self.axis] += self.place * cell;
        position
    }

    /// Takes the field at the place; whether that is the root, or the next one is.
    fn settle(&mut self, excess: f64, gradient: &[f64; 3], sizes: &Sizes, round: usize) -> bool {
        let slope = gradient[self.axis] * sizes.cell;
        let normal = (-Vec3::from(*gradient)).try_normalize(0.0).filter(|n| n.iter().all(|x| x.is_finite()));
        self.normal = normal.map_or_else(|| self.along(), Into::into);
        let (near, other) =
            if excess >= 0.0 { (&mut self.inside, &self.outside) } else { (&mut self.outside, &self.inside) };
        let (place, far, step) = (self.place, other[0] - self.place, -excess / slope);
        // What the field at either end says about how it bends on the way there.
        let error_by = |end: &[f64; 2]| {
            let length = end[0] - place;
            let change = ((end[1] - excess) / length / slope - 1.0).abs();
            change * step * step / length.abs()
        };
        let error = error_by(near).max(error_by(other));
        *near = [place, excess];
        let within = step / far >= 0.0 && step / far <= 1.0;
        let at_most = |length: f64, part: f64| length * sizes.cell <= part * sizes.scale;
        let near_enough = if sizes.kinks { at_most(step.abs(), LAST_STEP_AT_KINKS) } else { at_most(error, ERROR) };
        let short = step.abs() <= LAST_STEP && near_enough || at_most(step.abs(), NO_STEP);
        let done = excess == 0.0 || within && short || far.abs() <= 1e-12;
        self.place = match done {
            true if within => (self.place + step).clamp(MARGIN, 1.0 - MARGIN),
            true => self.place.clamp(MARGIN, 1.0 - MARGIN),
            false if within && round % 3 < 2 => self.place + step,
            false if round.is_multiple_of(3) => self.secant(),
            false => 0.5 * (self.inside[0] + self.outside[0]),
        };
        done
    }

    /// Along the edge outwards: the normal where the field is flat.
    fn along(&self) -> [f64; 3] {
        let mut normal = [0.0; 3];
        normal[self.axis] = if self.outside[0] > self.inside[0] { 1.0 } else { -1.0 };
        normal
    }
}

/// Lengths that matter to roots \[m\].
#[derive(Clone, Copy, Debug)]
pub struct Sizes {
    /// Edge of a cell.
    pub cell: f64,
    /// [`Solid::scale`].
    pub scale: f64,
    /// [`Solid::has_kinks`].
    pub kinks: bool,
}

/// Memory of [`Roots::find`].
#[derive(Debug, Default)]
pub struct Roots {
    open: Vec<u32>,
    points: Vec<[f64; 3]>,
    excess: Vec<f64>,
    gradients: Vec<[f64; 3]>,
}

impl Roots {
    /// Moves each crossing to its root, and gives it its normal. Newton's steps along the edge, kept between the ends
    /// by what is known of their signs: nothing leaves its edge, whatever the field is like.
    pub fn find(&mut self, solid: &mut impl Solid, parts: &[u32], sizes: &Sizes, crossings: &mut [Crossing]) {
        self.open.clear();
        self.open.extend(0..crossings.len() as u32);
        for round in 0..ROUNDS {
            let count = self.open.len();
            self.points.clear();
            self.points.extend(self.open.iter().map(|index| crossings[*index as usize].position(sizes.cell)));
            self.excess.resize(count, 0.0);
            self.gradients.resize(count, [0.0; 3]);
            solid.evaluate(parts, &self.points, &mut self.excess, Some(&mut self.gradients));
            let mut at = 0;
            self.open.retain(|index| {
                let found = crossings[*index as usize].settle(self.excess[at], &self.gradients[at], sizes, round);
                at += 1;
                !found
            });
            if self.open.is_empty() {
                break;
            }
        }
    }
}
