//! Who may touch whom in a step: bounds, pairs, and a candidate for each, with its memory of the steps before.

use super::step::Stepping;
use super::{Body, PairFilter, World};
use crate::base::{Kind, Motion};
use crate::coat::cliques::Block;
use crate::contact::pair::Pair;
use crate::team::Team;

/// Least bodies that a worker takes in one go.
const BODIES: usize = 16;

/// Candidates that a worker fills in one go.
const FILLED: usize = 16;

/// Two bodies, or two parts of one body by the first skeleton of each, and which of its blocks these are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Meeting {
    bodies: [u32; 2],
    part: [u32; 2],
    block: u32,
}

impl World {
    /// Pairs of bodies whose bounds meet and that may touch.
    pub(super) fn find_candidates(&mut self, state: &mut Stepping, dt: f64, team: &Team) {
        self.find_bounds(state, dt, team);
        state.pairs.clear();
        self.take_up_memories(state);
        if !self.all_rest(state) {
            state.broad_phase.find(&state.bounds, &mut state.pairs);
            self.wake_touched(state, dt);
            let mut filter = self.pair_filter.get_mut().take();
            state.pairs.retain(|pair| {
                let asleep = pair.iter().any(|body| self.bodies[*body as usize].is_asleep());
                !asleep && self.may_touch(pair, &state.motions, &mut filter)
            });
            *self.pair_filter.get_mut() = filter;
        }
        self.list_meetings(state);
        self.take_up_candidates(state);
        let Stepping { motions, bounds_of, meetings, candidates, .. } = state;
        let (motions, bounds_of, meetings) = (&*motions, &*bounds_of, &*meetings);
        team.each_mut(candidates, FILLED, |place, candidate| {
            candidate.block = meetings[place].block;
            let [a, b] = candidate.bodies;
            candidate.close = if a == b {
                self.fill_block(candidate, motions, dt) && !self.are_fixed(&candidate.pair)
            } else {
                let bounds = [a, b].map(|body| &bounds_of[body as usize]);
                matches!(bounds, [Some(a), Some(b)] if self.fill(candidate, motions, [a, b], dt))
            };
            candidate.memory.touched = false;
        });
        // What no skeleton is close enough for goes back to where it came from.
        for candidate in state.candidates.extract_if(.., |candidate| !candidate.close) {
            state.gone.push(candidate);
        }
    }

    /// A candidate for each meeting: the last step's, or a new one.
    fn take_up_candidates(&self, state: &mut Stepping) {
        let Stepping { candidates, previous, gone, spare, meetings, .. } = state;
        std::mem::swap(candidates, previous);
        let mut left = previous.drain(..);
        let mut next = left.next();
        for Meeting { bodies, part, .. } in meetings.iter() {
            let key = (*bodies, *part);
            while let Some(last) = next.take_if(|last| last.key() < key) {
                gone.push(last);
                next = left.next();
            }
            // A body that took over the slot of a destroyed one is another body.
            let ids = bodies.map(|body| self.bodies.id_of(body as usize).raw);
            let known = next.take_if(|last| last.key() == key && last.memory.ids == ids);
            if known.is_some() {
                next = left.next();
            }
            candidates.push(known.unwrap_or_else(|| {
                let mut new = spare.pop().unwrap_or_default();
                new.memory.forget();
                (new.bodies, new.memory.ids, new.memory.part) = (*bodies, ids, *part);
                new
            }));
        }
        gone.extend(next.into_iter().chain(left));
    }

    /// Bounds of all bodies, in their order; of one asleep, those of the last step.
    fn find_bounds(&self, state: &mut Stepping, dt: f64, team: &Team) {
        let now = (state.rest_revision, dt);
        let same = state.bounded_for == now;
        state.bounded_for = now;
        let Stepping { motions, bounds, bounds_of, .. } = state;
        let motions = &*motions;
        let count = self.bodies.capacity();
        bounds_of.resize(count, None);
        team.each_mut(bounds_of, team.share(count, BODIES), |slot, bounds| {
            if !self.bodies.is_live(slot) || !self.bodies[slot].enabled {
                *bounds = None;
            } else if !(same && bounds.is_some() && self.bodies[slot].is_asleep()) {
                *bounds = self.bounds_of(slot, motions, dt);
            }
        });
        bounds.clear();
        bounds.extend(bounds_of.iter().flatten());
    }

    /// Whether nothing of a pair can ever move.
    fn are_fixed(&self, pair: &Pair) -> bool {
        let mut links = pair.a.links.iter().chain(&pair.b.links);
        links.all(|link| self.links[*link as usize].desc.kind == Kind::Fixed)
    }

    /// What may meet: pairs of bodies, and of parts that collide of one body, in order.
    fn list_meetings(&self, state: &mut Stepping) {
        state.meetings.clear();
        state.meetings.extend(state.pairs.iter().map(|bodies| Meeting { bodies: *bodies, part: [0; 2], block: 0 }));
        let between = state.meetings.len();
        for slot in self.bodies.indices() {
            let body = &self.bodies[slot];
            let Some(blending) = body.blending.as_ref().filter(|_| body.enabled && !body.is_asleep()) else { continue };
            for (block, Block { sides, .. }) in blending.blocks.iter().enumerate() {
                let part = [&sides[0], &sides[1]].map(|side| blending.order[side[0] as usize]);
                state.meetings.push(Meeting { bodies: [slot as u32; 2], part, block: block as u32 });
            }
        }
        if state.meetings.len() > between {
            state.meetings.sort_unstable_by_key(|meeting| (meeting.bodies, meeting.part));
        }
    }

    pub(super) fn may_touch(&self, pair: &[u32; 2], motions: &[Motion], filter: &mut Option<PairFilter>) -> bool {
        let [a, b] = pair.map(|body| &self.bodies[body as usize]);
        // A host-driven kinematic link may still have its wrench asked for: only bodies that are fixed all over are
        // skipped.
        let still = |body: &Body| {
            body.links.iter().all(|link| {
                self.links[*link as usize].desc.kind == Kind::Fixed && !motions[*link as usize].is_movable()
            })
        };
        a.desc.mask & b.desc.category != 0
            && b.desc.mask & a.desc.category != 0
            && !(still(a) && still(b))
            && filter.as_mut().is_none_or(|filter| {
                let [a, b] = pair.map(|body| self.bodies.id_of(body as usize));
                filter(a, b)
            })
    }
}
