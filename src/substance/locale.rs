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
use crate::field::lanes::Lanes;
use crate::math::Vec3;

/// Fields are summed eight at a time, in eight sums: the same bits whatever registers there are.
const WIDTH: usize = 8;

/// Eight particles, as columns.
#[derive(Clone, Copy, Debug)]
struct Block {
    place: [Lanes<WIDTH>; 3],
    thickness: Lanes<WIDTH>,
    /// One over the width of the outer part, and the two coefficients of its cubic.
    inverse_width: Lanes<WIDTH>,
    cubic: Lanes<WIDTH>,
    square: Lanes<WIDTH>,
    isovalue: Lanes<WIDTH>,
    stiffness: Lanes<WIDTH>,
}

const ZERO: Lanes<WIDTH> = Lanes([0.0; WIDTH]);

/// Eight that have no field.
const NOBODY: Block = Block {
    place: [Lanes([1e30; WIDTH]), ZERO, ZERO],
    thickness: ZERO,
    inverse_width: Lanes([1.0; WIDTH]),
    cubic: ZERO,
    square: ZERO,
    isovalue: ZERO,
    stiffness: ZERO,
};

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

    fn add(&mut self, index: u32, place: &Vec3, offset: f64, matter: &Matter) {
        let lane = self.indices.len() % WIDTH;
        if lane == 0 {
            self.blocks.push(NOBODY);
        }
        let Some(block) = self.blocks.last_mut() else { return };
        let profile = &matter.profile;
        let width = profile.radius - profile.thickness;
        let kw = profile.stiffness * width;
        for (axis, column) in block.place.iter_mut().enumerate() {
            column.0[lane] = place[axis];
        }
        block.thickness.0[lane] = profile.thickness + offset;
        block.inverse_width.0[lane] = 1.0 / width;
        block.cubic.0[lane] = kw - 2.0 * profile.isovalue;
        block.square.0[lane] = 3.0 * profile.isovalue - kw;
        block.isovalue.0[lane] = profile.isovalue;
        block.stiffness.0[lane] = profile.stiffness;
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

    /// Sums of the columns of [`Block::fields`], with the widest registers of this processor.
    fn run<const GRADIENT: bool>(&self, p: &Vec3) -> [f64; 4] {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                // SAFETY: the processor has it.
                return unsafe { run_avx512::<GRADIENT>(&self.blocks, p) };
            }
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has it.
                return unsafe { run_avx2::<GRADIENT>(&self.blocks, p) };
            }
        }
        sums::<GRADIENT>(&self.blocks, p)
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<const GRADIENT: bool>(blocks: &[Block], p: &Vec3) -> [f64; 4] {
    sums::<GRADIENT>(blocks, p)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512<const GRADIENT: bool>(blocks: &[Block], p: &Vec3) -> [f64; 4] {
    sums::<GRADIENT>(blocks, p)
}

#[inline(always)]
fn sums<const GRADIENT: bool>(blocks: &[Block], p: &Vec3) -> [f64; 4] {
    // Written out: what is not inlined here would not use the wide registers.
    let (mut value, mut x, mut y, mut z) = (ZERO, ZERO, ZERO, ZERO);
    for block in blocks {
        // No cost at run time: keeps the compiler from spreading vectors over several blocks, as in `field::lanes`.
        compiler_fence(Ordering::SeqCst);
        let [field, gx, gy, gz] = block.fields::<GRADIENT>(p);
        value = value + field;
        if GRADIENT {
            (x, y, z) = (x + gx, y + gy, z + gz);
        }
    }
    [value.sum(), x.sum(), y.sum(), z.sum()]
}

impl Block {
    /// Each one's field, and its gradient if asked for. One loop over all of it becomes vector instructions; operations on
    /// whole [`Lanes`] become them in part only.
    #[inline(always)]
    fn fields<const GRADIENT: bool>(&self, p: &Vec3) -> [Lanes<WIDTH>; 4] {
        let mut out = [ZERO; 4];
        for lane in 0..WIDTH {
            let [x, y, z] = [p.x - self.place[0].0[lane], p.y - self.place[1].0[lane], p.z - self.place[2].0[lane]];
            let distance = (x * x + y * y + z * z).sqrt();
            let depth = self.thickness.0[lane] - distance;
            // Outside, a cubic in u, which runs from 1 on the surface to 0 where the field ends; inside, a line.
            let u = 1.0 + depth * self.inverse_width.0[lane];
            let u = if u > 0.0 { u } else { 0.0 };
            let outer = u * u * (self.square.0[lane] + self.cubic.0[lane] * u);
            let inner = self.isovalue.0[lane] + self.stiffness.0[lane] * depth;
            let inside = depth > 0.0;
            out[0].0[lane] = if inside { inner } else { outer };
            if GRADIENT {
                let outer_slope =
                    u * (2.0 * self.square.0[lane] + 3.0 * self.cubic.0[lane] * u) * self.inverse_width.0[lane];
                let slope = if inside { self.stiffness.0[lane] } else { outer_slope };
                // At the particle itself the direction is lost, and with it nothing that counts.
                let over = -slope / if distance > 1e-150 { distance } else { 1e-150 };
                out[1].0[lane] = over * x;
                out[2].0[lane] = over * y;
                out[3].0[lane] = over * z;
            }
        }
        out
    }
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
    reach: f64,
    own_values: Vec<f64>,
    other_values: Vec<f64>,
}

impl Locale {
    /// Gathers who is near particle `index`, up to `reach` away: those of its label, and those of label `rival`, or of all
    /// other labels to which there are bonds when that is none.
    pub fn gather(&mut self, swarm: &Swarm, index: usize, rival: Option<u32>, reach: f64) {
        self.own.clear();
        self.other.clear();
        self.bonds.clear();
        self.bond_starts.clear();
        self.reach = reach;
        let add = |group: &mut Group, j: usize| {
            group.add(j as u32, &swarm.place[j], swarm.offset[j], swarm.matter_of(j));
        };
        let label = swarm.label[index];
        add(&mut self.own, index);
        let mut bonded = swarm.is_bonded(index);
        for j in swarm.near.of(index) {
            let j = *j as usize;
            if (swarm.place[j] - swarm.place[index]).norm_squared() > reach * reach {
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

    /// The same, and how it changes along a direction.
    pub fn value_slope(&mut self, p: &Vec3, u: &Vec3) -> (f64, f64) {
        let (own, gradient) = self.own_gradient(p);
        if self.bonds.is_empty() || own <= 0.0 {
            return (own, gradient.dot(u));
        }
        // Bonds come and go within a part of a piece: a difference will do for the slope of theirs.
        let step = 1e-6 * self.reach;
        let (here, there) = (self.value(p), self.value(&(p + u * step)));
        (here, (there - here) / step)
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
