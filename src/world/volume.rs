//! Volume control: how a step keeps the volumes of bodies that ask for it, and what can be asked and said about volumes.
//!
//! [`coat::volume`](crate::coat::volume) has the law. A body is looked at before the step's contacts, at the poses that
//! its links have then, in a frame of its own: only how they lie to each other counts.

use super::query::PosedCoat;
use super::step::Stepping;
use super::{Body, BodyId, Skeleton, SkeletonId, World, sleep};
use crate::coat::volume::{self, LOOKS, Loss, Part};
use crate::error::{Error, Result, require};
use crate::field::Shape;
use crate::math::Pose;
use crate::team::Team;

/// What volume control remembers of a body. It saves work and decides nothing: without it the next step does the same.
#[derive(Default)]
pub(crate) struct Control {
    /// There was nothing to change, and nothing has changed since.
    pub(super) settled: bool,
    /// The links, in the frame of the first.
    poses: Vec<Pose>,
    posed: PosedCoat,
    around: Vec<usize>,
    /// One for each skeleton of `posed`.
    parts: Vec<Part>,
    losses: Vec<Loss>,
}

/// The links of a body in the frame of the first, which is the same for every motion of the body as a whole.
fn relative_poses<'a>(world: &'a World, body: &'a Body) -> impl Iterator<Item = Pose> + 'a {
    let poses = || body.links.iter().map(|link| world.links[*link as usize].desc.pose);
    let first = poses().next().unwrap_or_default();
    poses().enumerate().map(move |(index, pose)| match index {
        // Free of rounding: bodies of one link are at rest in themselves.
        0 => Pose::default(),
        _ => Pose {
            position: first.inverse_transform_point(&pose.position),
            rotation: first.rotation.inverse() * pose.rotation,
        },
    })
}

/// The step's part.
impl World {
    /// Moves the offsets of all bodies with volume control that are awake.
    pub(super) fn control_volumes(&mut self, state: &mut Stepping, team: &Team) {
        if !self.controls_volumes {
            return;
        }
        for index in 0..self.bodies.capacity() {
            let Some(body) = self.bodies.at_mut(index) else { continue };
            if body.desc.volume_gain > 0.0 && body.enabled && !body.is_asleep() {
                state.controlled.push((index, body.volume.take().unwrap_or_default()));
            }
        }
        team.each_mut(&mut state.controlled, 1, |_, (index, control)| self.look(&self.bodies[*index], control));
        for (index, mut control) in state.controlled.drain(..) {
            if !control.settled {
                control.settled = !self.apply(index, &control);
                if !control.settled {
                    // Who leans on it must not go on sleeping.
                    sleep::rouse(&mut self.bodies, &state.resting, index as u32);
                }
            }
            self.bodies[index].volume = Some(control);
        }
    }

    /// Finds the next offsets of a body, unless it is settled.
    fn look(&self, body: &Body, control: &mut Control) {
        let Control { settled, poses, posed, around, parts, losses } = control;
        *settled &= relative_poses(self, body).eq(poses.iter().copied());
        if *settled {
            return;
        }
        poses.clear();
        poses.extend(relative_poses(self, body));
        self.fill_coat(body, poses.iter().copied(), posed);
        parts.clear();
        parts.extend(posed.skeletons.iter().map(|index| {
            let Skeleton { desc, offset, .. } = &self.skeletons[*index];
            Part { thickness: desc.thickness, offset: *offset, ..Part::default() }
        }));
        for look in 0..LOOKS {
            losses.clear();
            for (index, part) in parts.iter_mut().enumerate() {
                let skeleton = &self.skeletons[posed.skeletons[index]];
                // A plane has no bounds: nothing of it is ever exposed.
                if !matches!(skeleton.desc.shape, Shape::Plane { .. }) {
                    let rays = skeleton.rays(self.desc.seed_count);
                    let pose = &posed.poses[index];
                    part.share = volume::measure(&posed.coat, index, &rays, pose, around, losses);
                }
                if look == 0 {
                    part.target = skeleton.target.unwrap_or(part.share.volume);
                }
                part.end = losses.len();
            }
            if volume::move_offsets(parts, losses, body.desc.volume_gain) {
                break;
            }
            for (placed, part) in posed.coat.skeletons.iter_mut().zip(&*parts) {
                placed.profile = placed.profile.inflated(part.change);
            }
        }
    }

    /// The volume of skeleton `index` of a coat. None for a plane, which has no bounds.
    fn volume(&self, posed: &PosedCoat, index: usize, around: &mut Vec<usize>) -> Option<f64> {
        let skeleton = &self.skeletons[posed.skeletons[index]];
        if matches!(skeleton.desc.shape, Shape::Plane { .. }) {
            return None;
        }
        let rays = skeleton.rays(self.desc.seed_count);
        Some(volume::volume(&posed.coat, index, &rays, &posed.poses[index], around))
    }

    /// Sets what was found. Whether an offset has changed.
    fn apply(&mut self, body: usize, control: &Control) -> bool {
        let isovalue = self.bodies[body].desc.isovalue;
        let mut changed = false;
        for (index, part) in control.posed.skeletons.iter().zip(&control.parts) {
            let skeleton = &mut self.skeletons[*index];
            if matches!(skeleton.desc.shape, Shape::Plane { .. }) {
                continue;
            }
            skeleton.target = Some(part.target);
            if part.offset != skeleton.offset {
                changed = true;
                skeleton.offset = part.offset;
                // Its descriptor was checked when it came.
                if let Ok(profile) = skeleton.desc.profile(isovalue) {
                    skeleton.profile = profile.inflated(skeleton.offset);
                }
            }
        }
        if changed {
            self.measure_reach(body);
        }
        changed
    }

    /// A body's coat is no longer what volume control has seen last.
    pub(super) fn unsettle(&mut self, body: usize) {
        if let Some(control) = &mut self.bodies[body].volume {
            control.settled = false;
        }
    }

    /// Switches volume control on or off for what a body's descriptor says: off, the coat is again what the descriptors
    /// say; on, the volumes of the coming step become the targets.
    pub(super) fn reset_volumes(&mut self, body: usize) {
        let Body { links, desc, volume, .. } = &mut self.bodies[body];
        *volume = None;
        for skeleton in links.iter().flat_map(|link| &self.links[*link as usize].skeletons) {
            let skeleton = &mut self.skeletons[*skeleton as usize];
            (skeleton.offset, skeleton.target) = (0.0, None);
            if let Ok(profile) = skeleton.desc.profile(desc.isovalue) {
                skeleton.profile = profile;
            }
        }
    }
}

impl Control {
    /// Whether the volumes of a body are where they are to be, as near as they can come.
    pub(super) fn is_settled(body: &Body) -> bool {
        body.volume.as_ref().is_none_or(|control| control.settled)
    }
}

/// Volumes.
impl World {
    /// The volume of a skeleton's territory now \[m³\], by its seeds: the part of its body's solid where its field is the
    /// highest. Contacts do not count. Zero while it or its link is disabled; refused for a plane, which has no bounds.
    pub fn skeleton_volume(&self, id: SkeletonId) -> Result<f64> {
        let skeleton = self.skeletons.get(id)?;
        if matches!(skeleton.desc.shape, Shape::Plane { .. }) {
            return Err(NO_BOUNDS);
        }
        let posed = self.own_coat(self.links[skeleton.link as usize].body as usize);
        let index = posed.skeletons.iter().position(|index| *index == id.index());
        Ok(index.and_then(|index| self.volume(&posed, index, &mut Vec::new())).unwrap_or(0.0))
    }

    /// The volume of a body's solid now \[m³\]: that of all territories of its enabled skeletons, or, of a substance, of
    /// its particles after the last step. Also without volume
    /// control; refused for a body with a plane, which has no bounds.
    pub fn body_volume(&self, id: BodyId) -> Result<f64> {
        if let Some(substance) = &self.bodies.get(id)?.substance {
            return Ok(substance.particles.iter().map(|particle| particle.volume).sum());
        }
        let (posed, mut around) = (self.own_coat(id.index()), Vec::new());
        let volumes = (0..posed.skeletons.len()).map(|index| self.volume(&posed, index, &mut around));
        volumes.sum::<Option<f64>>().ok_or(NO_BOUNDS)
    }

    /// The volume that volume control aims at for a skeleton \[m³\].
    ///
    /// It is what the skeleton had in the first step with control, or what the host has set; before that step, what it
    /// has now. A new shape, profile or seed count begins anew.
    pub fn skeleton_target_volume(&self, id: SkeletonId) -> Result<f64> {
        match self.controlled(id)?.target {
            Some(target) => Ok(target),
            None => self.skeleton_volume(id),
        }
    }

    /// Sets the volume that volume control aims at for a skeleton, > 0 and at most 1e30 \[m³\]: a muscle that flexes.
    /// Refused without volume control, see [`BodyDesc::volume_gain`](super::BodyDesc::volume_gain), and for a plane.
    ///
    /// The surface moves by at most an eighth of the thickness in a step, and by at most half the thickness inwards and
    /// one thickness outwards in all.
    pub fn set_skeleton_target_volume(&mut self, id: SkeletonId, target: f64) -> Result<()> {
        let skeleton = self.controlled(id)?;
        require("target volume", target, "> 0 and at most 1e30", |x| x > 0.0 && x <= 1e30)?;
        let body = self.links[skeleton.link as usize].body;
        let skeleton = self.skeletons.get_mut(id)?;
        if skeleton.target.replace(target) != Some(target) {
            self.rouse(body);
            self.unsettle(body as usize);
        }
        Ok(())
    }

    /// How far volume control has moved a skeleton's surface outwards \[m\]: the `ε` of \[97, eq. (23)\].
    pub fn skeleton_offset(&self, id: SkeletonId) -> Result<f64> {
        Ok(self.skeletons.get(id)?.offset)
    }

    /// A skeleton whose volume is controlled.
    fn controlled(&self, id: SkeletonId) -> Result<&Skeleton> {
        let skeleton = self.skeletons.get(id)?;
        if matches!(skeleton.desc.shape, Shape::Plane { .. }) {
            return Err(NO_BOUNDS);
        }
        if self.bodies[self.links[skeleton.link as usize].body as usize].desc.volume_gain == 0.0 {
            return Err(Error::Unsupported("its body has no volume control: set volume_gain first"));
        }
        Ok(skeleton)
    }

    /// A body's coat in the frame of its first link.
    fn own_coat(&self, body: usize) -> PosedCoat {
        let (body, mut posed) = (&self.bodies[body], PosedCoat::default());
        self.fill_coat(body, relative_poses(self, body), &mut posed);
        posed
    }
}

const NO_BOUNDS: Error = Error::Unsupported("a plane has no bounds, so it has no volume");
