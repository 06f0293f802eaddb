//! What each particle has of the coat: its volume and its part of the surface; with whom it hangs together.
//!
//! Rays leave a particle for all directions. One ends where the field of another that it blends with is as high as its
//! own, or on the surface. Fields of one substance are one function of the distance less the offset, so the border of two
//! territories is where `d_i - ε_i = d_j - ε_j`: a closed form on a ray. A ray that ends at a border within the solid
//! shows that the two hang together.

use std::f64::consts::PI;
use std::sync::atomic::{Ordering, compiler_fence};

use super::locale::Locale;
use super::swarm::Swarm;
use crate::coat::volume::OFFSETS;
use crate::field::lanes::Lanes;
use crate::math::Vec3;

/// Longest way of an offset in one step, as a fraction of the thickness.
const STRIDE: f64 = 0.1;
/// Errors below this, as lengths over the thickness, are taken back in proportion.
const CALM: f64 = 0.02;
/// How near a ray's end must be, over the thickness.
const CLOSE: f64 = 1e-4;
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

/// Rivals are looked at eight at a time.
const WIDTH: usize = 8;

/// Those whose territories border on that of a particle: the border with one at `q` is at `first / (u·q + excess)` on a ray,
/// `first = (|q|² - excess²) / 2`, `excess` how much farther out its offset is. Eight of them, as columns.
#[derive(Clone, Copy)]
struct Rivals {
    q: [Lanes<WIDTH>; 3],
    first: Lanes<WIDTH>,
    excess: Lanes<WIDTH>,
}

/// Eight whose borders no ray meets.
const NOBODY: Rivals = Rivals { q: [Lanes([0.0; WIDTH]); 3], first: Lanes([1.0; WIDTH]), excess: Lanes([0.0; WIDTH]) };

/// The nearest border that a ray meets before `end`, and whose it is. Borders are fractions, compared without dividing.
#[inline(always)]
fn nearest(rivals: &[Rivals], u: &Vec3, end: f64) -> (f64, Option<usize>) {
    let (mut firsts, mut slopes, mut blocks) = ([end; WIDTH], [1.0; WIDTH], [-1.0; WIDTH]);
    let mut block = 0.0;
    for rivals in rivals {
        compiler_fence(Ordering::SeqCst);
        for lane in 0..WIDTH {
            let first = rivals.first.0[lane];
            let slope = u.x * rivals.q[0].0[lane]
                + u.y * rivals.q[1].0[lane]
                + u.z * rivals.q[2].0[lane]
                + rivals.excess.0[lane];
            let ahead = if slope > 0.0 { slope } else { 0.0 };
            let is_nearer = first * slopes[lane] < firsts[lane] * ahead;
            firsts[lane] = if is_nearer { first } else { firsts[lane] };
            slopes[lane] = if is_nearer { ahead } else { slopes[lane] };
            blocks[lane] = if is_nearer { block } else { blocks[lane] };
        }
        block += 1.0;
    }
    let mut best = (end, None);
    for lane in 0..WIDTH {
        let border = firsts[lane] / slopes[lane];
        if blocks[lane] >= 0.0 && border < best.0 {
            best = (border, Some(blocks[lane] as usize * WIDTH + lane));
        }
    }
    (best.0.max(0.0), best.1)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn nearest_avx2(rivals: &[Rivals], u: &Vec3, end: f64) -> (f64, Option<usize>) {
    nearest(rivals, u, end)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn nearest_avx512(rivals: &[Rivals], u: &Vec3, end: f64) -> (f64, Option<usize>) {
    nearest(rivals, u, end)
}

/// [`nearest`] with the widest registers of this processor; the same bits with any.
fn nearest_border(rivals: &[Rivals], u: &Vec3, end: f64) -> (f64, Option<usize>) {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has it.
            return unsafe { nearest_avx512(rivals, u, end) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has it.
            return unsafe { nearest_avx2(rivals, u, end) };
        }
    }
    nearest(rivals, u, end)
}

/// Measures particle `index` by rays of these directions, each of the same solid angle.
pub fn measure(swarm: &Swarm, index: usize, directions: &[Vec3], locale: &mut Locale, share: &mut Share) {
    share.volume = 0.0;
    share.exposed = 0.0;
    share.joined.clear();
    let (center, own_offset, label) = (swarm.place[index], swarm.offset[index], swarm.label[index]);
    let matter = swarm.matter_of(index);
    let thickness = matter.profile.thickness + own_offset;
    let isovalue = matter.profile.isovalue;
    let farthest = matter.farthest + own_offset;
    locale.gather(swarm, index, None, farthest + swarm.widest);
    // Whose borders they are, and how far they blend.
    let mut owners: Vec<(u32, f64)> = Vec::with_capacity(64);
    let mut rivals: Vec<Rivals> = Vec::with_capacity(8);
    for j in swarm.near.of(index) {
        let j_at = *j as usize;
        let weight = if swarm.label[j_at] == label { 1.0 } else { swarm.bond(index, j_at) };
        let q = swarm.place[j_at] - center;
        let excess = swarm.offset[j_at] - own_offset;
        let square = q.norm_squared();
        // Beyond, the border is farther away than the surface.
        if weight <= 0.0 || square >= (2.0 * farthest + excess).powi(2) {
            continue;
        }
        let (lane, first) = (owners.len() % WIDTH, 0.5 * (square - excess * excess));
        if lane == 0 {
            rivals.push(NOBODY);
        }
        if let Some(block) = rivals.last_mut() {
            for axis in 0..3 {
                block.q[axis].0[lane] = q[axis];
            }
            (block.first.0[lane], block.excess.0[lane]) = (first, excess);
        }
        owners.push((*j, weight));
        // The neck of two may be thinner than what rays see.
        let reach = first / (square.sqrt() + excess);
        if first <= 0.0 || reach - own_offset <= matter.half {
            share.join(*j);
        }
    }
    let solid_angle = 4.0 * PI / directions.len() as f64;
    for u in directions {
        let (near, rival) = nearest_border(&rivals, u, farthest);
        let rival = rival.map(|place| owners[place]);
        let Some((other, weight)) = rival else {
            let distance = surface(locale, &center, u, farthest, thickness, isovalue);
            share.add(solid_angle, distance, 1.0);
            continue;
        };
        // Both have the same field at the border, and most often these two are enough.
        let is_solid = near - own_offset <= matter.half || locale.value(&(center + u * near)) >= isovalue;
        if is_solid {
            share.join(other);
        }
        if weight >= 1.0 {
            let distance = if is_solid { near } else { surface(locale, &center, u, near, thickness, isovalue) };
            share.add(solid_angle, distance, f64::from(u8::from(!is_solid)));
        } else {
            // Half way of becoming one: between where the ray would end alone, and where it ends with the other.
            let alone = surface(locale, &center, u, farthest, thickness, isovalue);
            let distance = alone + (near.min(alone) - alone) * weight;
            share.add(solid_angle, distance, 1.0 - weight);
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

/// Where a ray leaves the solid, before `end`: Newton's method from outside, where fields are convex, in a bracket. What
/// is left is far below what the number of rays leaves out.
fn surface(locale: &mut Locale, center: &Vec3, u: &Vec3, end: f64, thickness: f64, isovalue: f64) -> f64 {
    let (mut low, mut high) = (thickness, end);
    let mut r = high;
    while high - low > CLOSE * thickness {
        let (value, slope) = locale.value_slope(&(center + u * r), u);
        let excess = value - isovalue;
        if excess >= 0.0 {
            low = r;
        } else {
            high = r;
        }
        let step = -excess / slope;
        if slope < 0.0 && step.abs() <= CLOSE * thickness {
            return (r + step).clamp(thickness, end);
        }
        let next = r + step;
        r = if slope < 0.0 && next > low && next < high { next } else { 0.5 * (low + high) };
    }
    low
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
