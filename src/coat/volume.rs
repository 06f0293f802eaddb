//! The volume of a territory, and the law that keeps it \[97, section 5.1\] (docs/model.md, "Volume control").
//!
//! A skeleton's rays end on the coat's surface or on the border of another territory, so that they also measure the
//! volume of its own. Where coats blend or part, the sum of the fields gains or loses volume; an offset for each skeleton,
//! \[97, eq. (23)\], takes it back. What one swells by, its neighbours would lose: all offsets of a body move together.

use std::f64::consts::PI;

use super::Coat;
use super::seeds::{Ray, core_volume};
use super::territory::{End, follow, neighbours};
use crate::math::Pose;

/// How far an offset may go, as fractions of the thickness without it: what is squeezed to nothing, or what swells in
/// vain, must come back soon.
pub const OFFSETS: (f64, f64) = (-0.5, 1.0);
/// Longest way of an offset from one look at the volumes to the next, as a fraction of the thickness: neighbours are off
/// by what the border did not do as its slopes said.
const STRIDE: f64 = 0.03;
/// How often a step may look at the volumes of a body whose offsets go their longest way.
pub const LOOKS: usize = 4;
/// Changes of an offset below this fraction of the thickness are not made, so that control comes to rest.
const REST: f64 = 1e-6;
/// Least area that counts as exposed, as a fraction of the area of a ball of the same volume.
const LEAST_AREA: f64 = 0.2;
/// Most that a border counts as moving, over the offset.
const FASTEST: f64 = 10.0;
/// Sweeps over all skeletons of a body in which their changes are made to agree.
const SWEEPS: usize = 100;

/// What a skeleton has of its body's coat.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Share {
    /// Volume of its territory \[m³\].
    pub volume: f64,
    /// Area of the coat's surface in its territory \[m²\], as the offset surface through each seed.
    pub exposed: f64,
    /// The same of the borders to other territories, times how far the own offset moves each of them.
    pub border: f64,
}

/// What the offset of a skeleton takes from the volume of another one, over the offset \[m²\].
#[derive(Clone, Copy, Debug)]
pub struct Loss {
    /// Who takes it.
    pub to: u32,
    /// Area of the border between them, times how far that offset moves it.
    pub area: f64,
}

/// The volume of the territory of skeleton `index` by its rays \[m³\], which `pose` puts into the frame of the coat. A
/// core that is solid counts as its own. `around` is a buffer.
pub fn volume(coat: &Coat, index: usize, rays: &[Ray], pose: &Pose, around: &mut Vec<usize>) -> f64 {
    neighbours(&coat.skeletons, index, around);
    let of_ray = |ray: &Ray| ray.volume(follow(coat, index, around, &ray.transformed(pose)).0);
    core_volume(&coat.skeletons[index].shape) + rays.iter().map(of_ray).sum::<f64>()
}

/// The same with what follows from the offsets: appends what those around it take.
pub fn measure(
    coat: &Coat,
    index: usize,
    rays: &[Ray],
    pose: &Pose,
    around: &mut Vec<usize>,
    losses: &mut Vec<Loss>,
) -> Share {
    neighbours(&coat.skeletons, index, around);
    let first = losses.len();
    let mut share = Share { volume: core_volume(&coat.skeletons[index].shape), ..Share::default() };
    for ray in rays {
        let ray = ray.transformed(pose);
        let (distance, end) = follow(coat, index, around, &ray);
        let area = ray.weight * ray.jacobian(distance);
        share.volume += ray.volume(distance);
        match end {
            End::Surface => share.exposed += area,
            End::Territory(rival) => {
                let (own, other) = border_motions(coat, index, rival, &ray, distance);
                share.border += area * own;
                match losses[first..].iter_mut().find(|loss| loss.to == rival as u32) {
                    Some(loss) => loss.area += area * other,
                    None => losses.push(Loss { to: rival as u32, area: area * other }),
                }
            }
        }
    }
    share
}

/// How far a border moves along a ray for each unit of the own offset, and back for each of the rival's: each field grows
/// by its slope, and the difference of the two falls along the ray by both slopes.
fn border_motions(coat: &Coat, index: usize, rival: usize, ray: &Ray, distance: f64) -> (f64, f64) {
    let own = -coat.skeletons[index].profile.value_slope(distance).1;
    // Under a cap the own field does not change.
    if own <= 0.0 {
        return (0.0, 0.0);
    }
    let other = coat.skeletons[rival].value_gradient(&ray.at(distance)).1;
    // Along a border no finite step gets anywhere.
    let fall = (own + other.dot(&ray.direction)).max(own / FASTEST);
    (own / fall, other.norm() / fall)
}

/// What the law needs of a skeleton.
#[derive(Clone, Copy, Debug, Default)]
pub struct Part {
    /// What it has of the coat.
    pub share: Share,
    /// What it is to have \[m³\].
    pub target: f64,
    /// Thickness without an offset \[m\].
    pub thickness: f64,
    /// The offset \[m\].
    pub offset: f64,
    /// What the law adds to it \[m\].
    pub change: f64,
    /// Where its losses end in the list of all.
    pub end: usize,
}

/// Moves the offsets of all skeletons of a body. `losses` has those of one skeleton after the other. True when all went
/// as far as they wanted to.
///
/// \[97, eq. (25)\] as printed has the wrong sign, and diverges; with the right one and its constant gains it is stable
/// for some sizes and steps only. This is Newton's method, damped by `gain`: the same at every size and step. What swells
/// takes from its neighbours, who move in the same step by what makes up for it.
pub fn move_offsets(parts: &mut [Part], losses: &[Loss], gain: f64) -> bool {
    parts.iter_mut().for_each(|part| part.change = 0.0);
    let mut held_back = false;
    for _ in 0..SWEEPS {
        let (mut start, mut moved) = (0, 0.0f64);
        held_back = false;
        for index in 0..parts.len() {
            let Part { share, target, thickness, offset, change, end } = parts[index];
            let lost: f64 = losses[start..end].iter().map(|loss| loss.area * parts[loss.to as usize].change).sum();
            start = end;
            // Buried: more offset would expose nothing.
            if share.exposed <= 0.0 {
                continue;
            }
            let ball = libm::cbrt(36.0 * PI * target * target);
            let area = (share.exposed + share.border).max(LEAST_AREA * ball);
            let wanted = (gain * (target - share.volume) + lost) / area;
            let next = wanted
                .clamp(-STRIDE * thickness, STRIDE * thickness)
                .clamp(OFFSETS.0 * thickness - offset, OFFSETS.1 * thickness - offset);
            held_back |= next.abs() >= STRIDE * thickness;
            moved = moved.max((next - change).abs() / thickness);
            parts[index].change = next;
        }
        if moved <= 0.1 * REST {
            break;
        }
    }
    for part in parts {
        if part.change.abs() <= REST * part.thickness {
            part.change = 0.0;
        }
        part.offset += part.change;
    }
    !held_back
}
