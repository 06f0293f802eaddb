//! What each particle has of the coat: its volume and its part of the surface; with whom it hangs together.
//!
//! Rays leave a particle for all directions. One ends where the field of another that it blends with is as high as its
//! own, or on the surface. Fields of one substance are one function of the distance less the offset, so the border of two
//! territories is where `d_i - ε_i = d_j - ε_j`: a closed form on a ray. A ray that ends at a border within the solid
//! shows that the two hang together.
//!
//! Most particles are buried, and the nearest around them show it. So the field is summed over these first, which leaves
//! it too low if anything; all who have a field there are gathered for what is still open then.

use std::cell::RefCell;
use std::f64::consts::PI;

use super::locale::{Locale, OnRays, round_sector};
use super::swarm::Swarm;
use crate::coat::volume::OFFSETS;
use crate::field::lanes::{Dispatch, Kernel};
use crate::math::Vec3;

/// Longest way of an offset in one step, as a fraction of the thickness.
const STRIDE: f64 = 0.1;
/// Errors below this, as lengths over the thickness, are taken back in proportion.
const CALM: f64 = 0.02;
/// Last step of Newton's method along a ray, over the thickness: what is left after it is a hundredth of that, far below
/// what the number of rays leaves out.
const CLOSE: f64 = 0.01;
/// Least area that counts as exposed, as a fraction of the area of a ball of the same volume.
const LEAST_AREA: f64 = 0.2;

/// What a particle has of the coat.
#[derive(Clone, Debug, Default)]
pub struct Share {
    /// Volume of its territory \[m³\].
    pub volume: f64,
    /// Area of the surface in its territory \[m²\].
    pub exposed: f64,
    /// Whom it hangs together with.
    pub joined: Vec<u32>,
}

/// Directions of rays that have the same solid angle each, as columns.
#[derive(Debug, Default)]
pub struct Rays {
    u: [Vec<f64>; 3],
}

impl Rays {
    /// In these directions.
    pub fn new(directions: impl Iterator<Item = Vec3>) -> Self {
        let mut rays = Self::default();
        for direction in directions {
            rays.u.iter_mut().zip(direction.iter()).for_each(|(column, x)| column.push(*x));
        }
        rays
    }

    fn count(&self) -> usize {
        self.u[0].len()
    }

    /// Only those with these numbers, in their order.
    fn keep(&mut self, all: &Rays, numbers: &[usize]) {
        for (own, column) in self.u.iter_mut().zip(&all.u) {
            own.clear();
            own.extend(numbers.iter().map(|number| column[*number]));
        }
    }

    fn direction(&self, ray: usize) -> Vec3 {
        Vec3::new(self.u[0][ray], self.u[1][ray], self.u[2][ray])
    }
}

/// One whose territory borders on that of a particle: the border is at `first / (u·q + excess)` on a ray,
/// `first = (|q|² - excess²) / 2`, `excess` how much farther out its offset is.
#[derive(Clone, Copy, Debug)]
struct Rival {
    q: [f64; 3],
    first: f64,
    excess: f64,
    /// Who it is, and how far the two blend.
    owner: u32,
    weight: f64,
}

/// The nearest border that each ray meets: `first / slope`, and the number of the rival.
#[derive(Debug, Default)]
struct Borders {
    first: Vec<f64>,
    slope: Vec<f64>,
    rival: Vec<f64>,
}

/// No rival.
const NONE: f64 = -1.0;

impl Borders {
    /// None nearer than `end`.
    fn reset(&mut self, count: usize, end: f64) {
        for (column, x) in [(&mut self.first, end), (&mut self.slope, 1.0), (&mut self.rival, NONE)] {
            column.clear();
            column.resize(count, x);
        }
    }

    /// Only those of the rays with these numbers, which are in ascending order.
    fn keep(&mut self, numbers: &[usize]) {
        for column in [&mut self.first, &mut self.slope, &mut self.rival] {
            numbers.iter().enumerate().for_each(|(at, number)| column[at] = column[*number]);
            column.truncate(numbers.len());
        }
    }

    fn distance(&self, ray: usize) -> f64 {
        (self.first[ray] / self.slope[ray]).max(0.0)
    }

    fn rival(&self, ray: usize) -> Option<usize> {
        (self.rival[ray] >= 0.0).then_some(self.rival[ray] as usize)
    }

    /// Looks at these rivals too, the first of which has this number, with the widest registers of this processor; the same
    /// bits with any.
    fn meet(&mut self, rays: &Rays, rivals: &[Rival], number: usize) {
        Dispatch::best().run(Meet { rays, rivals, number, borders: self });
    }
}

/// The arguments of [`Borders::meet`].
struct Meet<'a> {
    rays: &'a Rays,
    rivals: &'a [Rival],
    number: usize,
    borders: &'a mut Borders,
}

impl Kernel for Meet<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const W: usize>(self) {
        let ([x, y, z], Borders { first, slope, rival: nearest }) = (&self.rays.u, self.borders);
        for (at, rival) in self.rivals.iter().enumerate() {
            meet_one(x, y, z, rival, (self.number + at) as f64, first, slope, nearest);
        }
    }
}

/// Borders are fractions, compared without dividing. A plain loop over columns: the compiler makes vectors of it.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "slices of their own are known not to overlap")]
fn meet_one(
    x: &[f64],
    y: &[f64],
    z: &[f64],
    rival: &Rival,
    number: f64,
    first: &mut [f64],
    slope: &mut [f64],
    nearest: &mut [f64],
) {
    let count = x.len();
    let (y, z) = (&y[..count], &z[..count]);
    let (first, slope, nearest) = (&mut first[..count], &mut slope[..count], &mut nearest[..count]);
    let (q, border, excess) = (rival.q, rival.first, rival.excess);
    for ray in 0..count {
        let along = x[ray] * q[0] + y[ray] * q[1] + z[ray] * q[2] + excess;
        let ahead = if along > 0.0 { along } else { 0.0 };
        let is_nearer = border * slope[ray] < first[ray] * ahead;
        first[ray] = if is_nearer { border } else { first[ray] };
        slope[ray] = if is_nearer { ahead } else { slope[ray] };
        nearest[ray] = if is_nearer { number } else { nearest[ray] };
    }
}

/// A ray that does not end at a border close by.
#[derive(Clone, Copy, Debug)]
struct Open {
    ray: usize,
    /// Whose border it meets, if any, and where; that may be outside the solid.
    rival: Option<usize>,
    border: f64,
    /// How far the field of those who were gathered is above the isovalue there, and how it changes along the ray.
    excess: f64,
    slope: f64,
}

/// A ray that does not end at a border within the solid.
#[derive(Clone, Copy, Debug)]
struct Late {
    ray: usize,
    /// The surface lies between these, perhaps here.
    low: f64,
    high: f64,
    guess: f64,
    /// Of the particle that the ray meets: how far the two blend, and where the border is.
    weight: f64,
    border: f64,
}

/// Measures particles. Each thread has its own.
#[derive(Debug, Default)]
pub struct Ruler {
    locale: Locale,
    rivals: Vec<Rival>,
    borders: Borders,
    /// Rays that do not end at a border close by: their numbers among all, their directions, and where they are.
    numbers: Vec<usize>,
    directions: Rays,
    open: Vec<Open>,
    late: Vec<Late>,
    points: OnRays,
}

thread_local! {
    static RULER: RefCell<Ruler> = RefCell::default();
}

/// Measures particle `index` by its rays.
pub fn measure(swarm: &Swarm, index: usize, share: &mut Share) {
    RULER.with_borrow_mut(|ruler| ruler.measure(swarm, index, share));
}

impl Ruler {
    fn measure(&mut self, swarm: &Swarm, index: usize, share: &mut Share) {
        share.volume = 0.0;
        share.exposed = 0.0;
        share.joined.clear();
        let (matter, offset, center) = (swarm.matter_of(index), swarm.offset[index], &swarm.place[index]);
        let farthest = matter.farthest + offset;
        let solid_angle = 4.0 * PI / matter.rays.count() as f64;
        // Up to here two alone are a solid together; and the neck of two may be thinner than what rays see.
        let close = matter.half + offset;
        self.rivals.clear();
        self.list_rivals(swarm, index, (f64::NEG_INFINITY, close));
        share.joined.extend(self.rivals.iter().map(|rival| rival.owner));
        let near = self.rivals.len();
        self.borders.reset(matter.rays.count(), farthest);
        self.borders.meet(&matter.rays, &self.rivals, 0);
        self.end_close(&matter.rays, close, solid_angle, share);
        if self.numbers.is_empty() {
            return;
        }
        let far = (0..self.numbers.len()).map(|ray| self.borders.distance(ray)).fold(0.0, f64::max);
        if far > close {
            self.list_rivals(swarm, index, (close, far));
            self.borders.meet(&self.directions, &self.rivals[near..], near);
        }
        self.list_open();
        let blended = self.rivals[..near].iter().filter(|rival| rival.weight >= 1.0);
        self.locale.gather_only(swarm, index, blended.map(|rival| rival.owner as usize));
        self.end_within(center, close, solid_angle, share);
        if self.open.is_empty() {
            return;
        }
        let (middle, radius) = self.ball_round_open(farthest);
        self.locale.gather(swarm, index, None, &(center + middle), radius);
        self.end_within(center, close, solid_angle, share);
        let thickness = matter.profile.thickness + offset;
        // Between where it is of one alone and of two: a guess from which most need two rounds.
        self.let_on(thickness.min(farthest), 0.5 * (thickness + close), farthest);
        self.find_surface(center, CLOSE * thickness, solid_angle, share);
    }

    /// Ends rays at borders close by with those that blend fully; the others are left.
    fn end_close(&mut self, rays: &Rays, close: f64, solid_angle: f64, share: &mut Share) {
        let Self { rivals, borders, numbers, directions, .. } = self;
        numbers.clear();
        for ray in 0..rays.count() {
            let border = borders.distance(ray);
            match borders.rival(ray) {
                Some(rival) if rivals[rival].weight >= 1.0 && border <= close => share.add(solid_angle, border, 0.0),
                _ => numbers.push(ray),
            }
        }
        borders.keep(numbers);
        directions.keep(rays, numbers);
    }

    fn list_open(&mut self) {
        let Self { borders, numbers, open, .. } = self;
        open.clear();
        open.extend((0..numbers.len()).map(|ray| Open {
            ray,
            rival: borders.rival(ray),
            border: borders.distance(ray),
            excess: 0.0,
            slope: 0.0,
        }));
    }

    /// A ball round all open rays up to this length, as seen from the particle.
    fn ball_round_open(&self, length: f64) -> (Vec3, f64) {
        let directions = || self.open.iter().map(|open| self.directions.direction(open.ray));
        let axis = directions().sum::<Vec3>().try_normalize(1e-9).unwrap_or_else(Vec3::x);
        let cosine = directions().map(|u| u.dot(&axis)).fold(1.0, f64::min);
        round_sector(&axis, cosine, length)
    }

    /// Lists with whom particle `index` blends and has a border whose nearest point is within this range.
    fn list_rivals(&mut self, swarm: &Swarm, index: usize, (from, to): (f64, f64)) {
        let (center, offset, label) = (swarm.place[index], swarm.offset[index], swarm.label[index]);
        for owner in swarm.near.of(index) {
            let other = *owner as usize;
            let q = swarm.place[other] - center;
            let excess = swarm.offset[other] - offset;
            let square = q.norm_squared();
            // The nearest point is at (|q| - excess) / 2.
            let is_within = |end: f64| 2.0 * end + excess >= 0.0 && square <= (2.0 * end + excess).powi(2);
            if !is_within(to) || is_within(from) {
                continue;
            }
            let weight = if swarm.label[other] == label { 1.0 } else { swarm.bond(index, other) };
            if weight > 0.0 {
                let first = 0.5 * (square - excess * excess);
                self.rivals.push(Rival { q: q.into(), first, excess, owner: *owner, weight });
            }
        }
    }

    /// Ends rays at borders that are within the solid, as far as the fields of those gathered show it.
    fn end_within(&mut self, center: &Vec3, close: f64, solid_angle: f64, share: &mut Share) {
        let Self { locale, rivals, directions, open, points, .. } = self;
        points.clear();
        for ray in open.iter().filter(|ray| ray.rival.is_some()) {
            points.push(&directions.direction(ray.ray), ray.border);
        }
        locale.look(center, points);
        let mut at = 0;
        open.retain_mut(|ray| {
            let Some(rival) = ray.rival.map(|rival| &rivals[rival]) else { return true };
            ray.excess = points.value[at] - locale.isovalue();
            ray.slope = points.slope[at];
            at += 1;
            // Both have the same field at the border, and most often these two are enough.
            let is_solid = ray.border <= close || ray.excess >= 0.0;
            if is_solid {
                share.join(rival.owner);
            }
            let ends = is_solid && rival.weight >= 1.0;
            if ends {
                share.add(solid_angle, ray.border, 0.0);
            }
            !ends
        });
    }

    /// Open rays are late ones now: their surface is between `low` and `high`, perhaps at the guess.
    fn let_on(&mut self, low: f64, guess: f64, high: f64) {
        let Self { rivals, open, late, .. } = self;
        late.clear();
        late.extend(open.iter().map(|Open { ray, rival, border, excess, slope }| {
            let (ray, border) = (*ray, *border);
            match rival.map(|rival| rivals[rival].weight) {
                Some(weight) if weight >= 1.0 => {
                    // The surface is before the border.
                    let step = -excess / slope;
                    let guess = if step < 0.0 { border + step } else { guess };
                    Late { ray, low, high: border.max(low), guess, weight: 0.0, border }
                }
                weight => Late { ray, low, high, guess, weight: weight.unwrap_or(0.0), border },
            }
        }));
    }

    /// Where late rays leave the solid, to a last step of `near`: Newton's method in a bracket.
    fn find_surface(&mut self, center: &Vec3, near: f64, solid_angle: f64, share: &mut Share) {
        let Self { locale, directions, late, points, .. } = self;
        points.clear();
        for ray in &*late {
            points.push(&directions.direction(ray.ray), ray.guess.clamp(ray.low, ray.high));
        }
        while !late.is_empty() {
            locale.look(center, points);
            let mut left = 0;
            for at in 0..late.len() {
                let mut ray = late[at];
                let (r, slope) = (points.r[at], points.slope[at]);
                let excess = points.value[at] - locale.isovalue();
                if excess >= 0.0 {
                    ray.low = r;
                } else {
                    ray.high = r;
                }
                let step = -excess / slope;
                let is_near = slope < 0.0 && step.abs() <= near;
                if is_near || ray.high - ray.low <= 1e-3 * near {
                    let alone = if is_near { (r + step).clamp(ray.low, ray.high) } else { ray.low };
                    // Half way of becoming one: between where the ray would end alone, and where it ends with the other.
                    let distance = alone + (ray.border.min(alone) - alone) * ray.weight;
                    share.add(solid_angle, distance, 1.0 - ray.weight);
                    continue;
                }
                let next = r + step;
                let is_within = slope < 0.0 && next > ray.low && next < ray.high;
                late[left] = ray;
                points.r[left] = if is_within { next } else { 0.5 * (ray.low + ray.high) };
                for column in &mut points.u {
                    column[left] = column[at];
                }
                left += 1;
            }
            late.truncate(left);
            points.truncate(left);
        }
    }
}

impl Share {
    /// Adds a ray of this length, of which this part ends on the surface.
    fn add(&mut self, solid_angle: f64, distance: f64, exposed: f64) {
        self.volume += solid_angle * distance.powi(3) / 3.0;
        self.exposed += solid_angle * distance * distance * exposed;
    }

    fn join(&mut self, other: u32) {
        if !self.joined.contains(&other) {
            self.joined.push(other);
        }
    }
}

/// The next offset of a particle: Newton's method on the volume, damped by `gain`; `missing` is what its piece lacks
/// elsewhere, as a length over the piece's surface.
pub fn next_offset(offset: f64, gain: f64, share: &Share, target: f64, missing: f64, thickness: f64) -> f64 {
    // Buried: more offset would expose nothing.
    if share.exposed <= 0.0 {
        return offset;
    }
    let ball = libm::cbrt(36.0 * PI * target * target);
    let error = (share.volume - target) / share.exposed.max(LEAST_AREA * ball) - missing;
    // Near the aim, a seed more or less must not shake the coat: what is small is taken back slowly.
    let gain = gain * (error.abs() / (CALM * thickness)).min(1.0);
    let change = (-gain * error).clamp(-STRIDE * thickness, STRIDE * thickness);
    (offset + change).clamp(OFFSETS.0 * thickness, OFFSETS.1 * thickness)
}
