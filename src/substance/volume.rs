//! What each particle has of the coat: its volume and its part of the surface; with whom it hangs together.
//!
//! Rays leave a particle for all directions. One ends where the field of another that it blends with is as high as its
//! own, or on the surface. Fields of one substance are one function of the distance less the offset, so the border of two
//! territories is where `d_i - ε_i = d_j - ε_j`: a closed form on a ray. A ray that ends at a border within the solid
//! shows that the two hang together.

use std::f64::consts::PI;

use super::locale::Locale;
use super::system::Swarm;
use crate::coat::volume::OFFSETS;
use crate::math::Vec3;

/// Longest way of an offset in one step, as a fraction of the thickness.
const STRIDE: f64 = 0.1;
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

/// How a ray meets its neighbours.
struct Rival {
    index: u32,
    offset: Vec3,
    /// `(|q|² - e²) / 2` and `e`: the border is at `first / (u·q + e)`, `e` how much farther out its offset is.
    first: f64,
    excess: f64,
    /// Shortest ray that can end at it.
    shortest: f64,
    /// How far it blends.
    weight: f64,
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
    let mut rivals = Vec::with_capacity(64);
    for j in swarm.near.of(index) {
        let j_at = *j as usize;
        let weight = if swarm.label[j_at] == label { 1.0 } else { swarm.bond(index, j_at) };
        let offset = swarm.place[j_at] - center;
        let excess = swarm.offset[j_at] - own_offset;
        let square = offset.norm_squared();
        // Beyond, the border is farther away than the surface.
        if weight > 0.0 && square < (2.0 * farthest + excess).powi(2) {
            let shortest = 0.5 * (square.sqrt() - excess);
            rivals.push(Rival { index: *j, offset, first: 0.5 * (square - excess * excess), excess, shortest, weight });
        }
    }
    rivals.sort_unstable_by(|a, b| a.shortest.total_cmp(&b.shortest).then(a.index.cmp(&b.index)));
    // The neck of two may be thinner than what rays see.
    for other in &rivals {
        let reach = (other.first / (2.0 * other.shortest + 2.0 * other.excess)).max(0.0);
        if other.first <= 0.0 || 2.0 * matter.profile.value_slope(reach - own_offset).0 >= isovalue {
            share.join(other.index);
        }
    }
    let solid_angle = 4.0 * PI / directions.len() as f64;
    for u in directions {
        let (mut near, mut rival) = (farthest, None);
        for other in &rivals {
            if other.shortest >= near {
                break;
            }
            let slope = u.dot(&other.offset) + other.excess;
            // Those whose border lies farther out lose, without a division.
            if slope > 0.0 && other.first < near * slope {
                (near, rival) = ((other.first / slope).max(0.0), Some(other));
            }
        }
        let Some(rival) = rival else {
            let distance = surface(locale, &center, u, farthest, thickness, isovalue);
            share.add(solid_angle, distance, 1.0);
            continue;
        };
        // Both have the same field at the border, and most often these two are enough.
        let two = 2.0 * matter.profile.value_slope(near - own_offset).0;
        let is_solid = near <= thickness || two >= isovalue || locale.value(&(center + u * near)) >= isovalue;
        if is_solid {
            share.join(rival.index);
        }
        if rival.weight >= 1.0 {
            let distance = if is_solid { near } else { surface(locale, &center, u, near, thickness, isovalue) };
            share.add(solid_angle, distance, f64::from(u8::from(!is_solid)));
        } else {
            // Half way of becoming one: between where the ray would end alone, and where it ends with the other.
            let alone = surface(locale, &center, u, farthest, thickness, isovalue);
            let distance = alone + (near.min(alone) - alone) * rival.weight;
            share.add(solid_angle, distance, 1.0 - rival.weight);
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
    let change = (-gain * error).clamp(-STRIDE * thickness, STRIDE * thickness);
    (offset + change).clamp(OFFSETS.0 * thickness, OFFSETS.1 * thickness)
}
