//! The field round one particle: who reaches there, packed for many evaluations.
//!
//! Particles of one label blend: `f_A` is the sum over those of label A. Two of different labels blend as far as their
//! bond says, weight `b_ij`. At a point where A has the most field,
//!
//! `f = f_A + Σ b_ij f_i f_j / f_A`   over `i` in A, `j` not in A,
//!
//! which is `f_A + f_B` where all bonds of A and B are 1, `max(f_A, f_B)` where all are 0, and continuous in between:
//! where `f_A = f_B` both ways of looking give the same. The same fraction, `Σ b_ij f_i f_j / (f_A f_B)`, is how far A and
//! B have become one at a point; the rest of them collides ([`field::graph`](crate::field::graph) has it for queries).

use std::sync::atomic::{Ordering, compiler_fence};

use super::swarm::{Matter, Swarm};
use crate::field::Profile;
use crate::field::lanes::{Dispatch, Kernel, Lanes};
use crate::math::Vec3;

/// Fields are summed eight at a time, in eight sums: the same bits whatever registers there are.
const WIDTH: usize = 8;

/// Eight particles, as columns. The field of a particle is `c u²` outside its surface and `c (2 u - 1)` inside, with
/// `u = (R - d) / (R - t)`: that is what [`SubstanceDesc::profile`](super::SubstanceDesc::profile) makes.
#[derive(Clone, Copy, Debug)]
struct Block {
    place: [Lanes<WIDTH>; 3],
    radius: Lanes<WIDTH>,
    /// One over `R - t`.
    inverse_width: Lanes<WIDTH>,
    isovalue: Lanes<WIDTH>,
}

/// One particle of a [`Block`].
struct One {
    place: Vec3,
    radius: f64,
    inverse_width: f64,
    isovalue: f64,
}

const ZERO: Lanes<WIDTH> = Lanes([0.0; WIDTH]);

/// One that has no field.
const NO_ONE: One = One { place: Vec3::new(1e30, 0.0, 0.0), radius: 0.0, inverse_width: 0.0, isovalue: 0.0 };

/// Eight of these.
const NOBODY: Block =
    Block { place: [Lanes([1e30; WIDTH]), ZERO, ZERO], radius: ZERO, inverse_width: ZERO, isovalue: ZERO };

/// Particles whose fields add up.
#[derive(Debug, Default)]
struct Group {
    blocks: Vec<Block>,
    indices: Vec<u32>,
}

/// Sum of fields, and its gradient.
pub type Sum = (f64, Vec3);

impl Group {
    fn clear(&mut self) {
        self.blocks.clear();
        self.indices.clear();
    }

    /// Lets go of those who have no field in a ball, but for the first one.
    fn narrow(&mut self, center: &Vec3, radius: f64) {
        let count = self.indices.len();
        let mut kept = 0;
        for k in 0..count {
            let one = self.blocks[k / WIDTH].lane(k % WIDTH);
            let reach = radius + one.radius;
            if k == 0 || (one.place - center).norm_squared() <= reach * reach {
                self.blocks[kept / WIDTH].set_lane(kept % WIDTH, &one);
                self.indices[kept] = self.indices[k];
                kept += 1;
            }
        }
        self.indices.truncate(kept);
        self.blocks.truncate(kept.div_ceil(WIDTH));
        for k in kept..self.blocks.len() * WIDTH {
            self.blocks[k / WIDTH].set_lane(k % WIDTH, &NO_ONE);
        }
    }

    fn add(&mut self, index: u32, place: &Vec3, offset: f64, matter: &Matter) {
        let lane = self.indices.len() % WIDTH;
        if lane == 0 {
            self.blocks.push(NOBODY);
        }
        let Some(block) = self.blocks.last_mut() else { return };
        let Profile { radius, isovalue, .. } = matter.profile;
        let one = One { place: *place, radius: radius + offset, inverse_width: matter.inverse_width, isovalue };
        block.set_lane(lane, &one);
        self.indices.push(index);
    }

    /// The field of one.
    fn one(&self, k: usize, p: &Vec3) -> f64 {
        self.blocks[k / WIDTH].fields::<false>(p)[0].0[k % WIDTH]
    }

    fn value(&self, p: &Vec3) -> f64 {
        self.run::<false>(p)[0]
    }

    fn sum(&self, p: &Vec3) -> Sum {
        let [value, x, y, z] = self.run::<true>(p);
        (value, Vec3::new(x, y, z))
    }

    fn values(&self, p: &Vec3, out: &mut Vec<f64>) {
        out.clear();
        out.extend(self.blocks.iter().flat_map(|block| block.fields::<false>(p)[0].0));
    }

    /// Fields and slopes at points on rays from `center`, with the widest registers of this processor.
    fn along(&self, center: &Vec3, on: &mut OnRays) {
        Dispatch::best().run(Along { blocks: &self.blocks, count: self.indices.len(), center, on });
    }

    /// Sums of the columns of [`Block::fields`], with the widest registers of this processor.
    fn run<const GRADIENT: bool>(&self, p: &Vec3) -> [f64; 4] {
        Dispatch::best().run(Sums::<GRADIENT> { blocks: &self.blocks, p })
    }
}

/// The arguments of [`Group::run`].
struct Sums<'a, const GRADIENT: bool> {
    blocks: &'a [Block],
    p: &'a Vec3,
}

impl<const GRADIENT: bool> Kernel for Sums<'_, GRADIENT> {
    type Output = [f64; 4];

    #[inline(always)]
    fn run<const W: usize>(self) -> [f64; 4] {
        // Written out: what is not inlined here would not use the wide registers.
        let (mut value, mut x, mut y, mut z) = (ZERO, ZERO, ZERO, ZERO);
        for block in self.blocks {
            // No cost at run time: keeps the compiler from spreading vectors over several blocks, as in `field::lanes`.
            compiler_fence(Ordering::SeqCst);
            let [field, gx, gy, gz] = block.fields::<GRADIENT>(self.p);
            value = value + field;
            if GRADIENT {
                (x, y, z) = (x + gx, y + gy, z + gz);
            }
        }
        [value.sum(), x.sum(), y.sum(), z.sum()]
    }
}

impl Block {
    fn lane(&self, lane: usize) -> One {
        One {
            place: Vec3::new(self.place[0].0[lane], self.place[1].0[lane], self.place[2].0[lane]),
            radius: self.radius.0[lane],
            inverse_width: self.inverse_width.0[lane],
            isovalue: self.isovalue.0[lane],
        }
    }

    fn set_lane(&mut self, lane: usize, one: &One) {
        for (column, x) in self.place.iter_mut().zip(one.place.iter()) {
            column.0[lane] = *x;
        }
        self.radius.0[lane] = one.radius;
        self.inverse_width.0[lane] = one.inverse_width;
        self.isovalue.0[lane] = one.isovalue;
    }

    /// Each one's field, and its gradient if asked for. One loop over all of it becomes vector instructions; operations on
    /// whole [`Lanes`] become them in part only.
    #[inline(always)]
    fn fields<const GRADIENT: bool>(&self, p: &Vec3) -> [Lanes<WIDTH>; 4] {
        let mut out = [ZERO; 4];
        for lane in 0..WIDTH {
            let [x, y, z] = [p.x - self.place[0].0[lane], p.y - self.place[1].0[lane], p.z - self.place[2].0[lane]];
            let distance = (x * x + y * y + z * z).sqrt();
            let (inverse_width, isovalue) = (self.inverse_width.0[lane], self.isovalue.0[lane]);
            let (field, slope) = field((self.radius.0[lane] - distance) * inverse_width);
            out[0].0[lane] = isovalue * field;
            if GRADIENT {
                // At the particle itself the direction is lost, and with it nothing that counts.
                let over = -slope * isovalue * inverse_width / if distance > 1e-150 { distance } else { 1e-150 };
                out[1].0[lane] = over * x;
                out[2].0[lane] = over * y;
                out[3].0[lane] = over * z;
            }
        }
        out
    }
}

/// The field over the isovalue, and its slope, at `u` (see [`Block`]).
#[inline(always)]
fn field(u: f64) -> (f64, f64) {
    let u = if u > 0.0 { u } else { 0.0 };
    let outer = if u < 1.0 { u } else { 1.0 };
    (outer * outer + 2.0 * (u - outer), 2.0 * outer)
}

/// Points on rays from one point, as columns.
#[derive(Debug, Default)]
pub struct OnRays {
    /// Directions, by axis.
    pub u: [Vec<f64>; 3],
    /// How far out \[m\].
    pub r: Vec<f64>,
    /// The field there, once it was looked up.
    pub value: Vec<f64>,
    /// How it changes along the ray.
    pub slope: Vec<f64>,
}

impl OnRays {
    /// None.
    pub fn clear(&mut self) {
        self.u.iter_mut().for_each(Vec::clear);
        self.r.clear();
    }

    /// One more.
    pub fn push(&mut self, u: &Vec3, r: f64) {
        self.u.iter_mut().zip(u.iter()).for_each(|(column, x)| column.push(*x));
        self.r.push(r);
    }

    /// Makes them a multiple of eight by copies of the last one: what is left over would be done one by one.
    fn pad(&mut self) {
        let count = self.r.len().next_multiple_of(WIDTH);
        for column in self.u.iter_mut().chain([&mut self.r]) {
            column.resize(count, column.last().copied().unwrap_or_default());
        }
        self.value.resize(count, 0.0);
        self.slope.resize(count, 0.0);
    }

    /// Only the first ones.
    pub fn truncate(&mut self, count: usize) {
        self.u.iter_mut().for_each(|column| column.truncate(count));
        self.r.truncate(count);
    }
}

/// The arguments of [`Group::along`].
struct Along<'a> {
    blocks: &'a [Block],
    count: usize,
    center: &'a Vec3,
    on: &'a mut OnRays,
}

impl Kernel for Along<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const W: usize>(self) {
        let OnRays { u: [x, y, z], r, value, slope } = self.on;
        value.fill(0.0);
        slope.fill(0.0);
        for k in 0..self.count {
            let (block, lane) = (&self.blocks[k / WIDTH], k % WIDTH);
            let from = [0, 1, 2].map(|axis| self.center[axis] - block.place[axis].0[lane]);
            let sizes = (block.radius.0[lane], block.inverse_width.0[lane], block.isovalue.0[lane]);
            along_one(x, y, z, r, from, sizes, value, slope);
        }
    }
}

/// A plain loop over columns: the compiler makes vectors of it, and the bits are the same with any.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "slices of their own are known not to overlap")]
fn along_one(
    x: &[f64],
    y: &[f64],
    z: &[f64],
    r: &[f64],
    from: [f64; 3],
    (radius, inverse_width, isovalue): (f64, f64, f64),
    value: &mut [f64],
    slope: &mut [f64],
) {
    let count = x.len();
    let (y, z, r) = (&y[..count], &z[..count], &r[..count]);
    let (value, slope) = (&mut value[..count], &mut slope[..count]);
    let steepness = isovalue * inverse_width;
    for at in 0..count {
        let d = [from[0] + x[at] * r[at], from[1] + y[at] * r[at], from[2] + z[at] * r[at]];
        let distance = (d[0] * d[0] + d[1] * d[1] + d[2] * d[2]).sqrt();
        let (own, steep) = field((radius - distance) * inverse_width);
        let along = d[0] * x[at] + d[1] * y[at] + d[2] * z[at];
        value[at] += isovalue * own;
        slope[at] -= steep * steepness * along / if distance > 1e-150 { distance } else { 1e-150 };
    }
}

/// Centre and radius of a ball round all who are at most this far from the origin, in directions that make an angle with
/// the unit vector `axis` whose cosine is at least this.
pub fn round_sector(axis: &Vec3, cosine: f64, length: f64) -> (Vec3, f64) {
    if cosine <= 0.0 {
        return (Vec3::zeros(), length);
    }
    // Through the rim; of a narrow sector, through the origin too.
    let middle = length * cosine.min(0.5 / cosine);
    (axis * middle, middle.max(length * (1.0 - cosine * cosine).max(0.0).sqrt()))
}

/// The field round one particle.
#[derive(Debug, Default)]
pub struct Locale {
    /// Its own label; it is the first itself.
    own: Group,
    /// Those of one other label, or of all others.
    other: Group,
    /// Bonds between the two, by places in them: for each of the own where its bonds begin, and all.
    bond_starts: Vec<u32>,
    bonds: Vec<(u32, f64)>,
    /// Where each particle is in `other`, for those with the number of this gathering.
    places: Vec<(u64, u32)>,
    gathering: u64,
    own_values: Vec<f64>,
    other_values: Vec<f64>,
}

impl Locale {
    fn clear(&mut self) {
        self.own.clear();
        self.other.clear();
        self.bonds.clear();
        self.bond_starts.clear();
    }

    /// Gathers particle `index` and some of its label, whose fields add up to the whole one at most.
    pub fn gather_only(&mut self, swarm: &Swarm, index: usize, others: impl Iterator<Item = usize>) {
        self.clear();
        for j in std::iter::once(index).chain(others) {
            self.own.add(j as u32, &swarm.place[j], swarm.offset[j], swarm.matter_of(j));
        }
    }

    /// Gathers particle `index` and who near it has a field in a ball: those of its label, and those of label `rival`, or
    /// of all other labels to which there are bonds when that is none.
    pub fn gather(&mut self, swarm: &Swarm, index: usize, rival: Option<u32>, center: &Vec3, radius: f64) {
        self.clear();
        let add = |group: &mut Group, j: usize| {
            group.add(j as u32, &swarm.place[j], swarm.offset[j], swarm.matter_of(j));
        };
        let label = swarm.label[index];
        add(&mut self.own, index);
        let mut bonded = swarm.is_bonded(index);
        let reach = radius + swarm.widest;
        for j in swarm.near.of(index) {
            let j = *j as usize;
            if (swarm.place[j] - center).norm_squared() > reach * reach {
                continue;
            }
            if swarm.label[j] == label {
                add(&mut self.own, j);
                bonded |= swarm.is_bonded(j);
            } else if match rival {
                Some(rival) => swarm.label[j] == rival,
                None => swarm.is_bonded(j),
            } {
                add(&mut self.other, j);
            }
        }
        if bonded && !self.other.indices.is_empty() {
            self.gather_bonds(swarm);
        }
    }

    /// Lets go of those who have no field in a ball that the particle is in; not of bonds.
    pub fn narrow(&mut self, center: &Vec3, radius: f64) {
        if !self.is_bonded() {
            self.own.narrow(center, radius);
            self.other.narrow(center, radius);
        }
    }

    fn gather_bonds(&mut self, swarm: &Swarm) {
        self.gathering += 1;
        self.places.resize(self.places.len().max(swarm.place.len()), (0, 0));
        for (place, particle) in self.other.indices.iter().enumerate() {
            self.places[*particle as usize] = (self.gathering, place as u32);
        }
        for particle in &self.own.indices {
            self.bond_starts.push(self.bonds.len() as u32);
            for (other, weight) in swarm.bonds_of(*particle as usize) {
                let (gathering, place) = self.places[*other as usize];
                if gathering == self.gathering {
                    self.bonds.push((place, *weight));
                }
            }
        }
        self.bond_starts.push(self.bonds.len() as u32);
    }

    /// Field on the surface of the particle that it was gathered for.
    pub fn isovalue(&self) -> f64 {
        self.own.blocks.first().map_or(0.0, |block| block.isovalue.0[0])
    }

    /// Whether any bond matters here.
    pub fn is_bonded(&self) -> bool {
        !self.bonds.is_empty()
    }

    /// Field of the own label.
    pub fn own(&self, p: &Vec3) -> f64 {
        self.own.value(p)
    }

    /// The same with its gradient.
    pub fn own_gradient(&self, p: &Vec3) -> Sum {
        self.own.sum(p)
    }

    /// Field of the others with its gradient.
    pub fn other_gradient(&self, p: &Vec3) -> Sum {
        self.other.sum(p)
    }

    /// The particle's own part of the field.
    pub fn self_value(&self, p: &Vec3) -> f64 {
        self.own.one(0, p)
    }

    /// `Σ b_ij f_i f_j`.
    pub fn bonded(&mut self, p: &Vec3) -> f64 {
        if self.bonds.is_empty() {
            return 0.0;
        }
        self.own.values(p, &mut self.own_values);
        self.other.values(p, &mut self.other_values);
        let mut sum = 0.0;
        for (own, bonds) in self.own_values.iter().zip(self.bond_starts.windows(2)).filter(|(own, _)| **own > 0.0) {
            let bonds = &self.bonds[bonds[0] as usize..bonds[1] as usize];
            sum += own * bonds.iter().map(|(place, weight)| weight * self.other_values[*place as usize]).sum::<f64>();
        }
        sum
    }

    /// The field as one sees it from the own label, bonds and all.
    pub fn value(&mut self, p: &Vec3) -> f64 {
        let own = self.own(p);
        if self.bonds.is_empty() || own <= 0.0 { own } else { own + self.bonded(p) / own }
    }

    /// The same at points on rays from `center`, and how it changes along the rays.
    pub fn look(&mut self, center: &Vec3, on: &mut OnRays) {
        on.pad();
        self.own.along(center, on);
        if self.bonds.is_empty() {
            return;
        }
        // Bonds come and go within a part of a piece: a difference will do for the slope of theirs.
        let step = 1e-6 * self.own.blocks[0].radius.0[0];
        for at in 0..on.r.len() {
            if on.value[at] <= 0.0 {
                continue;
            }
            let u = Vec3::new(on.u[0][at], on.u[1][at], on.u[2][at]);
            let [here, there] = [on.r[at], on.r[at] + step].map(|r| self.value(&(center + u * r)));
            (on.value[at], on.slope[at]) = (here, (there - here) / step);
        }
    }

    /// Those of the others that have a field at a point, with their parts of it.
    pub fn others_at(&self, p: &Vec3, mut each: impl FnMut(u32, f64)) {
        for (k, index) in self.other.indices.iter().enumerate() {
            let value = self.other.one(k, p);
            if value > 0.0 {
                each(*index, value);
            }
        }
    }

    /// Those of the own label that have a field at a point, with their parts of it.
    pub fn owners_at(&self, p: &Vec3, mut each: impl FnMut(u32, f64)) {
        for (k, index) in self.own.indices.iter().enumerate() {
            let value = self.own.one(k, p);
            if value > 0.0 {
                each(*index, value);
            }
        }
    }
}
