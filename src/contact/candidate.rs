//! A candidate: two bodies, or two parts of one, that may touch in this step, and what is remembered of them from the
//! last.
//!
//! While two bodies hardly move against each other from one sub-step to the next, their contact surface is not
//! integrated anew: each node's pressure follows the motion by its stiffness, `p + g n·Δ`. The force is then off by the
//! square of the motion over the depth, so the motion that is allowed goes with the root of the tolerance. A step always
//! begins with a fresh surface, so that nothing but the poses decides; an implicit one with a surface that
//! [stands](super::standing), if there is one.

use super::deepest::Approach;
use super::friction::Bristle;
use super::pair::Pair;
use super::patch::{Node, Patch, Sums};
use super::press::Material;
use super::standing::{self, Standing};
use super::surface::{Settings, Surface, integrate};
use crate::base::Motion;
use crate::handle::RawId;
use crate::math::{Quat, Twist, Vec3, rotation_to_vector};

/// Motion of the nodes over the depth of the contact, over the root of the tolerance, up to which the surface is kept.
const KEEP: f64 = 0.1;

/// Two bodies, or parts of one, whose bounds meet.
#[derive(Debug, Default)]
pub struct Candidate {
    /// Slots of the bodies, the smaller first; the same twice for parts of one.
    pub bodies: [u32; 2],
    /// Of parts of one body, which of its pairs of groups.
    pub block: u32,
    /// The link whose centre of mass is the origin of the pair's frame.
    pub lead: u32,
    /// Their coats.
    pub pair: Pair,
    /// How they rub and damp.
    pub material: Material,
    /// Their contact surface at the last evaluation.
    pub surface: Surface,
    /// The nodes of the surface, brought up to the present poses.
    pub nodes: Vec<Node>,
    /// Where the two links were when the surface was integrated; none when there is more than one a side.
    reference: Option<[Placement; 2]>,
    /// Skeletons of both are within reach of each other.
    pub close: bool,
    /// The surface was integrated by the last look, not kept.
    pub fresh: bool,
    /// The surface is the one of which [`Memory::standing`] tells.
    standing: bool,
    /// What each of its patches came to, and behind them the push-out of each overload.
    pub loads: Vec<Sums>,
    /// What lasts from step to step.
    pub memory: Memory,
}

/// A candidate where it stays: lists of them are put together anew in each step.
pub type Kept = Box<Candidate>;

/// A link in the pair's frame.
#[derive(Clone, Copy, Debug, Default)]
struct Placement {
    center: Vec3,
    rotation: Quat,
}

impl Placement {
    /// How far the material point at `p` has moved, and the link turned, from here to `now`.
    fn moved(&self, now: &Placement, p: &Vec3) -> (Vec3, Vec3) {
        let turn = now.rotation * self.rotation.inverse();
        let arm = p - self.center;
        (now.center + turn * arm - p, rotation_to_vector(&turn))
    }
}

impl Candidate {
    /// What a snapshot keeps. The rest is made anew in each step; whoever adds a field decides here.
    pub fn lasting(&self) -> &Memory {
        let Self {
            bodies: _,
            block: _,
            lead: _,
            close: _,
            pair: _,
            material: _,
            surface: _,
            nodes: _,
            reference: _,
            fresh: _,
            standing: _,
            loads: _,
            memory,
        } = self;
        memory
    }

    /// The order of candidates: slots of the bodies, then the part.
    pub fn key(&self) -> ([u32; 2], [u32; 2]) {
        (self.bodies, self.memory.part)
    }

    /// Remembers what came from elsewhere: the surface is of something else.
    pub fn recall(&mut self, memory: Memory) {
        self.bodies = memory.ids.map(|id| id.index);
        self.memory = memory;
        self.standing = false;
    }

    /// The contact surface for a round of an implicit step, at the poses where the round begins; in the `first` the one
    /// of the last step, if it stands.
    pub fn look_in_round(&mut self, motions: &[Motion], settings: &Settings, first: bool) {
        let likeness = standing::likeness(&self.pair, self.lead, settings, motions);
        self.fresh = !(first && self.stands(motions, settings, likeness));
        if !self.fresh {
            return;
        }
        self.pair.place(motions, self.lead);
        self.integrate(settings);
        self.memory.standing.forget();
        // What has no depth says nothing of how far it may move.
        self.standing = self.surface.is_sound();
        if self.standing {
            self.memory.standing.set(&self.pair, self.lead, likeness, motions);
        }
    }

    /// Whether the surface of the last step stands; the pair is placed in its frame then. If it is no longer there, it is
    /// made again where it was.
    fn stands(&mut self, motions: &[Motion], settings: &Settings, likeness: u64) -> bool {
        let standing = &self.memory.standing;
        if standing.likeness != likeness || standing.places.first().is_none_or(|place| place.link != self.lead) {
            return false;
        }
        if !self.standing {
            standing.put_back(&mut self.pair, motions);
            self.integrate(settings);
            self.standing = true;
        }
        self.pair.place_about(motions, &self.memory.standing.places[0].center);
        self.memory.standing.stands(&self.pair, &self.surface, motions)
    }

    /// The velocity that in `h` seconds would take a link to where a surface that stands was evaluated.
    pub fn velocity_looked_at(&self, link: u32, motions: &[Motion], h: f64) -> Twist {
        self.memory.standing.velocity(&self.pair, link, &motions[link as usize], h)
    }

    /// The centre of a link from which its arms to the surface go.
    pub fn center_looked_at(&self, link: u32, motions: &[Motion]) -> Vec3 {
        let motion = &motions[link as usize];
        if self.fresh { motion.center } else { self.memory.standing.center(&self.pair, link, motion) }
    }

    /// The patches that press, with what they came to.
    pub fn pressing(&self) -> impl Iterator<Item = (&Patch, &Sums)> {
        self.surface.patches.iter().zip(&self.loads).filter(|(_, load)| load.force != Vec3::zeros())
    }

    /// The overloads, with what pushed them apart.
    pub fn push_outs(&self) -> impl Iterator<Item = (&(usize, usize, Approach), &Sums)> {
        let first = self.surface.patches.len();
        self.surface.overloads.iter().zip(self.loads.iter().skip(first))
    }

    /// Elastic energy in the compression of the present surface, at most: that of a force which grows in proportion to
    /// the overlap; others hold less \[J\].
    pub fn elastic_energy(&self) -> f64 {
        let of = |(patch, load): (&Patch, &Sums)| {
            let [i, j] = patch.skeletons;
            let overlap = patch.peak_pressure * (1.0 / self.pair.a.slope(i) + 1.0 / self.pair.b.slope(j));
            0.5 * load.force.norm() * overlap
        };
        self.surface.patches.iter().zip(&self.loads).map(of).sum()
    }

    fn integrate(&mut self, settings: &Settings) {
        integrate(&self.pair, settings, &mut self.surface);
        self.nodes.clone_from(&self.surface.nodes);
    }

    /// Brings the contact surface up to the present poses, by a fresh integration when `fresh` or when the bodies have
    /// moved too far against each other.
    pub fn look(&mut self, motions: &[Motion], settings: &Settings, fresh: bool) {
        self.fresh = fresh || !self.follow(motions, settings.tolerance);
        if !self.fresh {
            return;
        }
        self.pair.place(motions, self.lead);
        self.integrate(settings);
        self.memory.standing.forget();
        self.reference = self.placements(motions);
    }

    /// Where the two links are, when there is one a side, and nothing between them.
    fn placements(&self, motions: &[Motion]) -> Option<[Placement; 2]> {
        if !self.pair.covers.is_empty() {
            return None;
        }
        let origin = motions[self.lead as usize].center;
        let place = |link: u32| {
            let motion = &motions[link as usize];
            Placement { center: motion.center - origin, rotation: motion.rotation }
        };
        Some([place(self.pair.a.only_link()?), place(self.pair.b.only_link()?)])
    }

    /// Lets the nodes follow the motion since the surface was integrated. False when it is too much.
    fn follow(&mut self, motions: &[Motion], tolerance: f64) -> bool {
        let (Some(then), Some(now)) = (self.reference, self.placements(motions)) else { return false };
        if self.surface.patches.is_empty() || !self.surface.overloads.is_empty() {
            return false;
        }
        for patch in &self.surface.patches {
            if patch.nodes.0 >= patch.nodes.1 {
                return false;
            }
            let depth = patch.depth(&self.pair);
            let size = (patch.deepest - self.surface.nodes[patch.nodes.0].position).norm();
            let limit = KEEP * tolerance.sqrt() * depth;
            for (then, now) in then.iter().zip(&now) {
                let (moved, turned) = then.moved(now, &patch.deepest);
                if moved.norm() + turned.norm() * size > limit {
                    return false;
                }
            }
        }
        self.pair.origin = motions[self.lead as usize].center;
        self.nodes.clear();
        for node in &self.surface.nodes {
            let moved = |side: usize| then[side].moved(&now[side], &node.position).0;
            let size = node.force.norm();
            if size <= 0.0 {
                self.nodes.push(*node);
                continue;
            }
            let normal = node.force / size;
            let closing = (moved(0) - moved(1)).dot(&normal);
            let force = normal * (size + node.stiffness * closing).max(0.0);
            self.nodes.push(Node { force, ..*node });
        }
        true
    }
}

/// What lasts from step to step while two bodies are candidates.
#[derive(Debug, Default)]
pub struct Memory {
    /// The bodies' handles, for the event that ends the contact.
    pub ids: [RawId; 2],
    /// Of parts of one body, the slots of the first skeletons of both; zeros for two bodies.
    pub part: [u32; 2],
    /// They touched at the end of the last step.
    pub touching: bool,
    /// They touched at some time in this step.
    pub touched: bool,
    /// They were pressed past the most that they can carry in this step.
    pub overloaded: bool,
    /// They already were in the last step.
    pub was_overloaded: bool,
    /// Square of the largest rate since they touched: sub-steps never get coarser during a contact \[1/s²\].
    pub rate2: f64,
    /// Elastic energy that they held in their compression at the end of the last step, at most; nothing where that ended
    /// implicitly, which gives none of it back as motion \[J\].
    pub held: f64,
    /// One a sticking patch.
    pub bristles: Vec<Bristle>,
    /// Of the surface that the last implicit step ended with.
    pub standing: Standing,
}

impl Memory {
    /// The order of memories: slots of the bodies, then the part.
    pub fn key(&self) -> ([u32; 2], [u32; 2]) {
        (self.ids.map(|id| id.index), self.part)
    }

    /// Forgets what the contact went through, but not that it is one.
    pub fn forget_history(&mut self) {
        (self.rate2, self.held) = (0.0, 0.0);
        self.bristles.clear();
        self.standing.forget();
    }

    /// Forgets all but the room for bristles and places.
    pub fn forget(&mut self) {
        self.forget_history();
        let (bristles, standing) = (std::mem::take(&mut self.bristles), std::mem::take(&mut self.standing));
        *self = Memory { bristles, standing, ..Memory::default() };
    }
}
