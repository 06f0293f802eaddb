//! The volume of a territory, and the law that keeps it \[97, section 5.1\] (docs/model.md, "Volume control").
//!
//! A skeleton's rays end on the coat's surface or on the border of another territory, so that they also measure the
//! volume of its own. Where coats blend or part, the sum of the fields gains or loses volume; an offset for each skeleton,
//! \[97, eq. (23)\], takes it back.

use std::f64::consts::PI;

use super::Coat;
use super::seeds::{Ray, core_volume};
use super::territory::{End, follow, neighbours};
use crate::math::Pose;

/// How far an offset may go, as fractions of the thickness without it: what is squeezed to nothing, or what swells in
/// vain, must come back soon.
pub const OFFSETS: (f64, f64) = (-0.5, 1.0);
/// Longest way of an offset in one step, as a fraction of the thickness.
const STRIDE: f64 = 0.1;
/// Changes of an offset below this fraction of the thickness are not made, so that control comes to rest.
const REST: f64 = 1e-6;
/// Least area that counts as exposed, as a fraction of the area of a ball of the same volume.
const LEAST_AREA: f64 = 0.2;
/// Most that a border counts as moving, over the offset.
const FASTEST: f64 = 10.0;

/// What a skeleton has of its body's coat.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// Volume of its territory \[m³\].
    pub volume: f64,
    /// Area of the coat's surface in its territory \[m²\], as the offset surface through each seed.
    pub exposed: f64,
    /// The same of the borders to other territories, times how far an offset moves each of them.
    pub border: f64,
}

/// Measures the territory of skeleton `index` by its rays, which `pose` puts into the frame of the coat. A core that is
/// solid counts as its own. `around` is a buffer.
pub fn measure(coat: &Coat, index: usize, rays: &[Ray], pose: &Pose, around: &mut Vec<usize>) -> Share {
    neighbours(&coat.skeletons, index, around);
    let mut share = Share { volume: core_volume(&coat.skeletons[index].shape), ..Share::default() };
    for ray in rays {
        let ray = ray.transformed(pose);
        let (distance, end) = follow(coat, index, around, &ray);
        let area = ray.weight * ray.jacobian(distance);
        share.volume += ray.volume(distance);
        match end {
            End::Surface => share.exposed += area,
            End::Territory(rival) => share.border += area * border_motion(coat, index, rival, &ray, distance),
        }
    }
    share
}

/// How far a border moves along a ray for each unit of offset: the own field grows by its slope, and the difference of
/// the two fields falls along the ray by both slopes.
fn border_motion(coat: &Coat, index: usize, rival: usize, ray: &Ray, distance: f64) -> f64 {
    let own = -coat.skeletons[index].profile.value_slope(distance).1;
    let other = coat.skeletons[rival].value_gradient(&ray.at(distance)).1.dot(&ray.direction);
    // Along a border no finite step gets anywhere.
    own / (own + other).max(own / FASTEST)
}

/// The next offset of a skeleton of this thickness (that without an offset), or the same where nothing is to change.
///
/// \[97, eq. (25)\] as printed has the wrong sign, and diverges; with the right one and its constant gains it is stable
/// for some sizes and steps only. This is Newton's method, damped by `gain`: the same at every size and step.
pub fn next_offset(offset: f64, gain: f64, share: &Share, target: f64, thickness: f64) -> f64 {
    // Buried: more offset would expose nothing.
    if share.exposed <= 0.0 {
        return offset;
    }
    let ball = libm::cbrt(36.0 * PI * target * target);
    let area = (share.exposed + share.border).max(LEAST_AREA * ball);
    let change = (-gain * (share.volume - target) / area).clamp(-STRIDE * thickness, STRIDE * thickness);
    if change.abs() <= REST * thickness {
        return offset;
    }
    (offset + change).clamp(OFFSETS.0 * thickness, OFFSETS.1 * thickness)
}
