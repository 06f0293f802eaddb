//! What of a world's shape changes from frame to frame: taken from a world, and put into one.

use super::pack::Moment;
use crate::error::Result;
use crate::math::{Pose, Quat, Vec3};
use crate::world::{Body, World};

impl World {
    /// The skeletons of a body, in the order of its links.
    fn all_skeletons<'a>(&'a self, body: &'a Body) -> impl Iterator<Item = usize> + 'a {
        body.links.iter().flat_map(|link| &self.links[*link as usize].skeletons).map(|slot| *slot as usize)
    }

    /// Takes what a frame is made of, in place of what is in `out`.
    pub(super) fn take_moment(&self, out: &mut Moment) {
        let Moment { numbers, counts, bonds } = out;
        numbers.clear();
        counts.clear();
        let mut substances = 0;
        for link in self.links.indices() {
            let Pose { position, rotation } = &self.links[link].desc.pose;
            numbers.extend(position.iter().chain(rotation.coords.iter()));
        }
        for body in self.bodies.indices().map(|body| &self.bodies[body]) {
            if body.desc.volume_gain > 0.0 {
                numbers.extend(self.all_skeletons(body).map(|slot| self.skeletons[slot].offset));
            }
            if let Some(blending) = &body.blending {
                numbers.extend(blending.pairs.iter().filter_map(|pair| pair.weight));
            }
            if let Some(substance) = &body.substance {
                for particle in &substance.particles {
                    numbers.extend(particle.position.iter());
                    numbers.extend([particle.offset, particle.volume]);
                    counts.extend([particle.label, particle.piece]);
                }
                substances += 1;
                bonds.resize_with(bonds.len().max(substances), Vec::new);
                bonds[substances - 1].clone_from(&substance.bonds);
            }
        }
        bonds.truncate(substances);
    }

    /// Shows a frame of this structure; refuses one that no world can be in, and is then as it was.
    pub(super) fn show_moment(&mut self, moment: &Moment) -> Result<()> {
        let mut before = Moment::default();
        self.take_moment(&mut before);
        let changed = self.put_moment(moment);
        if let Err(error) = self.check_state() {
            self.put_moment(&before);
            return Err(error);
        }
        for slot in changed {
            let body = &self.bodies[slot];
            let isovalue = body.desc.isovalue;
            for skeleton in self.all_skeletons(body).collect::<Vec<_>>() {
                let skeleton = &mut self.skeletons[skeleton];
                skeleton.profile = skeleton.desc.profile(isovalue)?.inflated(skeleton.offset);
            }
            self.compile_blending(slot);
            self.measure_reach(slot);
        }
        Ok(())
    }

    /// Sets what a frame says. Gives the bodies whose coats are another field now, wherever their links are.
    fn put_moment(&mut self, moment: &Moment) -> Vec<usize> {
        let mut numbers = moment.numbers.iter().copied();
        let mut counts = moment.counts.iter().copied();
        let mut bonds = moment.bonds.iter();
        // The structure says how many there are.
        let mut number = || numbers.next().unwrap_or_default();
        let mut changed = Vec::new();
        for link in 0..self.links.capacity() {
            let Some(link) = self.links.at_mut(link) else { continue };
            let position = Vec3::new(number(), number(), number());
            let rotation = nalgebra::Quaternion { coords: [number(), number(), number(), number()].into() };
            link.desc.pose = Pose { position, rotation: Quat::new_unchecked(rotation) };
        }
        for slot in 0..self.bodies.capacity() {
            if !self.bodies.is_live(slot) {
                continue;
            }
            let mut changes = false;
            let mut replace =
                |old: &mut f64, new: f64| changes |= std::mem::replace(old, new).to_bits() != new.to_bits();
            if self.bodies[slot].desc.volume_gain > 0.0 {
                for skeleton in self.all_skeletons(&self.bodies[slot]).collect::<Vec<_>>() {
                    replace(&mut self.skeletons[skeleton].offset, number());
                }
            }
            let body = &mut self.bodies[slot];
            if let Some(blending) = &mut body.blending {
                blending
                    .pairs
                    .iter_mut()
                    .filter_map(|pair| pair.weight.as_mut())
                    .for_each(|old| replace(old, number()));
            }
            if let Some(substance) = &mut body.substance {
                let mut most = 0;
                for particle in &mut substance.particles {
                    particle.position = Vec3::new(number(), number(), number());
                    (particle.offset, particle.volume) = (number(), number());
                    particle.label = counts.next().unwrap_or_default();
                    particle.piece = counts.next().unwrap_or_default();
                    most = most.max(particle.label);
                }
                substance.next_label = most.saturating_add(1);
                substance.bonds.clone_from(bonds.next().unwrap_or(&Vec::new()));
            }
            if changes {
                changed.push(slot);
            }
        }
        changed
    }
}
