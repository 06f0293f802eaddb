//! Sleep: islands at rest that cost nothing until something touches them.
//!
//! An island whose bodies have all been slow for the world's `sleep_time` falls asleep as a whole: its bodies stop where
//! they are, its contacts stay as they were last reported, and of its pairs only the memory is kept. It wakes as a
//! whole, with nothing forgotten, in the step in which anything new comes into reach of one of its bodies, or at once
//! when the host changes one of them or what they lean on. Substances, which are in no island, do it in
//! [`substance`](super::substance).

use super::step::Stepping;
use super::volume::Control;
use super::{Body, BodyId, Contact, Link, World};
use crate::base::Kind;
use crate::contact::candidate::Memory;
use crate::error::Result;
use crate::handle::Arena;
use crate::math::Twist;

/// A body's sleep.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Sleep {
    /// For how long it has been slow, and not been changed \[s\].
    pub quiet: f64,
    /// With whom it sleeps: the lowest slot of them, plus one; 0 when awake.
    pub group: u32,
}

impl Body {
    pub(super) fn is_asleep(&self) -> bool {
        self.sleep.group != 0
    }
}

/// Sleep.
impl World {
    /// Whether a body is awake: those that cannot move always are.
    pub fn body_is_awake(&self, id: BodyId) -> Result<bool> {
        Ok(!self.bodies.get(id)?.is_asleep())
    }

    /// Wakes a body with all that sleep with it; of one that cannot move, those that lean on it. Whatever the host
    /// changes about a body wakes it by itself.
    pub fn wake_body(&mut self, id: BodyId) -> Result<()> {
        self.bodies.get(id)?;
        self.rouse(id.raw.index);
        Ok(())
    }

    /// Wakes a body with its group, or, if it is not asleep, those that lean on it.
    pub(super) fn rouse(&mut self, slot: u32) {
        rouse(&mut self.bodies, &self.stepping.resting, slot);
    }

    /// Wakes all.
    pub(super) fn rouse_all(&mut self) {
        for slot in 0..self.bodies.capacity() {
            if let Some(body) = self.bodies.at_mut(slot) {
                body.sleep = Sleep::default();
            }
        }
    }

    /// Wakes whom something new has come into reach of, in turn. Those who are awake get the memory of their pairs
    /// back.
    pub(super) fn wake_touched(&mut self, state: &mut Stepping, dt: f64) {
        if self.desc.sleep_time <= 0.0 && state.resting.is_empty() {
            return;
        }
        let mut filter = self.pair_filter.get_mut().take();
        let pairs = std::mem::take(&mut state.pairs);
        loop {
            let (mut woken, mut next) = (false, 0);
            for pair in &pairs {
                let asleep = pair.map(|body| self.bodies[body as usize].is_asleep());
                if asleep[0] == asleep[1] || self.is_still(pair[usize::from(asleep[0])], state) {
                    continue;
                }
                // Both lists are in order.
                let at = |next: usize| state.resting.get(next).map(|memory| memory.ids.map(|id| id.index));
                while at(next).is_some_and(|resting| resting < *pair) {
                    next += 1;
                }
                if at(next) == Some(*pair) || !self.may_touch(pair, &state.motions, &mut filter) {
                    continue;
                }
                let [Some(a), Some(b)] = pair.map(|body| &state.bounds_of[body as usize]) else { continue };
                let mut probe = std::mem::take(&mut state.probe);
                probe.bodies = *pair;
                if self.fill(&mut probe, &state.motions, [a, b], dt) {
                    for body in pair {
                        woken |= wake(&mut self.bodies, *body);
                    }
                }
                state.probe = probe;
            }
            if !woken {
                break;
            }
            self.take_up_memories(state);
        }
        state.pairs = pairs;
        *self.pair_filter.get_mut() = filter;
    }

    /// Whether nobody is awake but what is fixed: nobody meets anybody.
    pub(super) fn all_rest(&self, state: &Stepping) -> bool {
        let fixed = |link: &u32| self.links[*link as usize].desc.kind == Kind::Fixed;
        let rests = |slot: usize| {
            let body = &self.bodies[slot];
            // Substances have no links.
            let still = body.substance.is_none() && body.links.iter().all(fixed) && self.is_still(slot as u32, state);
            body.is_asleep() || still
        };
        self.bodies.indices().all(rests)
    }

    /// Whether a body that is awake does not move, and has not been changed since the last step: who sleeps near it has
    /// its peace.
    pub(super) fn is_still(&self, body: u32, state: &Stepping) -> bool {
        let body = &self.bodies[body as usize];
        body.sleep.quiet > 0.0
            && body.links.iter().all(|link| {
                let motion = &state.motions[*link as usize];
                !motion.is_movable() && motion.twist == Twist::default()
            })
    }

    /// Pairs of which nobody sleeps any more go on as candidates of the last step.
    pub(super) fn take_up_memories(&self, state: &mut Stepping) {
        let before = state.candidates.len();
        let rests = |memory: &mut Memory| memory.ids.iter().any(|id| is_asleep(&self.bodies, id.index));
        for memory in state.resting.extract_if(.., |memory| !rests(memory)) {
            let mut candidate = state.spare.pop().unwrap_or_default();
            candidate.recall(memory);
            state.candidates.push(candidate);
        }
        if state.candidates.len() > before {
            state.candidates.sort_unstable_by_key(|candidate| candidate.key());
        }
    }

    /// Forgets the contacts of those who woke up.
    pub(super) fn keep_resting_contacts(&self, state: &mut Stepping) {
        let front = &state.contacts[..state.resting_contacts];
        let rests = |contact: &Contact| contact.bodies.iter().any(|id| is_asleep(&self.bodies, id.raw.index));
        if !front.iter().all(rests) {
            state.contacts.truncate(state.resting_contacts);
            state.contacts.retain(rests);
            state.resting_contacts = state.contacts.len();
            state.rest_revision += 1;
        }
    }

    /// Lets islands fall asleep that have been at rest for long enough.
    pub(super) fn let_sleep(&mut self, state: &mut Stepping, dt: f64) {
        if self.desc.sleep_time <= 0.0 {
            return;
        }
        for slot in 0..self.bodies.capacity() {
            if self.bodies.is_live(slot) && !self.bodies[slot].is_asleep() {
                let slow = self.is_slow(slot, state);
                let quiet = &mut self.bodies[slot].sleep.quiet;
                *quiet = if slow { *quiet + dt } else { 0.0 };
            }
        }
        let mut fell = false;
        for group in &state.islands[..state.island_count] {
            let tired = |link: &u32| {
                let Link { desc, body, .. } = &self.links[*link as usize];
                if desc.kind == Kind::Host && !state.motions[*link as usize].is_movable() {
                    // What leans on it rests if it does.
                    return desc.twist == Twist::default();
                }
                self.bodies[*body as usize].sleep.quiet >= self.desc.sleep_time
            };
            let own = |link: &&u32| state.motions[**link as usize].is_movable();
            let links = || group.island.links.iter().filter(own);
            let lowest = links().map(|link| self.links[*link as usize].body).min();
            let Some(lowest) = lowest.filter(|_| group.island.links.iter().all(tired)) else { continue };
            fell = true;
            for link in links() {
                self.bodies[self.links[*link as usize].body as usize].sleep.group = lowest + 1;
                self.links[*link as usize].desc.twist = Twist::default();
            }
        }
        fell |= self.let_substances_sleep(state, dt);
        if !fell {
            return;
        }
        for link in 0..self.links.capacity() {
            if self.links.is_live(link) && is_asleep(&self.bodies, self.links[link].body) {
                state.motions[link] = self.motion_of(&self.links[link]);
            }
        }
        let bodies = &self.bodies;
        for mut candidate in
            state.candidates.extract_if(.., |candidate| candidate.bodies.iter().any(|body| is_asleep(bodies, *body)))
        {
            state.resting.push(std::mem::take(&mut candidate.memory));
            state.spare.push(candidate);
        }
        state.resting.sort_unstable_by_key(Memory::key);
        let rests = |contact: &Contact| contact.bodies.iter().any(|id| is_asleep(bodies, id.raw.index));
        state.contacts.sort_by_key(|contact| !rests(contact));
        state.resting_contacts = state.contacts.partition_point(rests);
        state.rest_revision += 1;
    }

    /// Whether a body that may sleep hardly moves.
    fn is_slow(&self, slot: usize, state: &Stepping) -> bool {
        let body = &self.bodies[slot];
        if let Some(substance) = &body.substance {
            let thickness = substance.desc.profile(body.desc.isovalue).map_or(0.0, |profile| profile.thickness);
            return body.desc.may_sleep && substance.is_slow(self.desc.sleep_speed * thickness);
        }
        let thickness = self.skeletons_of(body).map(|(_, _, s)| s.profile.thickness).fold(f64::INFINITY, f64::min);
        let bounds = state.bounds_of.get(slot).and_then(Option::as_ref);
        let size = bounds.map_or(0.0, |bounds| 0.5 * (bounds.high - bounds.low).norm());
        let most = if thickness.is_finite() { self.desc.sleep_speed * thickness } else { 0.0 };
        body.desc.may_sleep
            && Control::is_settled(body)
            && body.links.iter().all(|link| {
                let (kind, twist) = (self.links[*link as usize].desc.kind, state.motions[*link as usize].twist);
                let moving = state.motions[*link as usize].is_movable();
                let turning = twist.angular.norm() * if size.is_finite() { size } else { thickness };
                !moving || kind != Kind::Host && twist.linear.norm() + turning <= most
            })
    }
}

pub(super) fn is_asleep(bodies: &Arena<Body>, slot: u32) -> bool {
    bodies.is_live(slot as usize) && bodies[slot as usize].is_asleep()
}

/// [`World::rouse`], with the pairs that are asleep.
pub(super) fn rouse(bodies: &mut Arena<Body>, resting: &[Memory], slot: u32) {
    if wake(bodies, slot) {
        return;
    }
    bodies[slot as usize].sleep.quiet = 0.0;
    for Memory { ids, .. } in resting {
        if ids.iter().any(|id| id.index == slot) {
            for id in ids {
                wake(bodies, id.index);
            }
        }
    }
}

/// Wakes a body that is asleep, with its group. False when it is not.
fn wake(bodies: &mut Arena<Body>, slot: u32) -> bool {
    if !is_asleep(bodies, slot) {
        return false;
    }
    let group = bodies[slot as usize].sleep.group;
    for slot in 0..bodies.capacity() {
        if let Some(body) = bodies.at_mut(slot).filter(|body| body.sleep.group == group) {
            body.sleep = Sleep::default();
        }
    }
    true
}
