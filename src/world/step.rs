//! The pipeline of one step: hosts' poses in, candidate pairs, islands, response, impulses and events out.

use std::sync::Mutex;

use super::events::{Contact, Counters, Event, EventKind, LogLevel, Times};
use super::respond::{Worker, unlocked};
use super::volume::Control;
use super::{BodyId, Link, World, units};
use crate::base::{Articulation, Kind, Motion};
use crate::clock::Clock;
use crate::coat::cliques::Block;
use crate::contact::broad_phase::{Bounds, BroadPhase};
use crate::contact::candidate::{Candidate, Kept, Memory};
use crate::contact::pair::{Pair, Side};
use crate::contact::surface;
use crate::error::{Result, require};
use crate::math::{Quat, Vec3, Wrench};
use crate::response::Response;
use crate::response::mirror::Host;
use crate::response::substep::Island;
use crate::substance::system::System;
use crate::team::Team;

/// Least links, and bodies, that a worker takes in one go.
const LINKS: usize = 16;
const BODIES: usize = 16;

/// Candidates that a worker fills in one go.
const FILLED: usize = 16;

/// What the pipeline keeps between steps, and its buffers.
#[derive(Default)]
pub(crate) struct Stepping {
    /// One a slot of a link.
    pub(super) motions: Vec<Motion>,
    /// How each link was moved, by slot.
    pub(super) responses: Vec<Response>,
    /// Bounds of the bodies, by their slots, and all that there are; of those asleep they last.
    pub(super) bounds_of: Vec<Option<Bounds>>,
    pub(super) bounds: Vec<Bounds>,
    /// Who slept when they were found, as a revision, and the length of that step.
    bounded_for: (u64, f64),
    broad_phase: BroadPhase,
    pub(super) pairs: Vec<[u32; 2]>,
    meetings: Vec<Meeting>,
    /// In the order of their bodies.
    pub(super) candidates: Vec<Kept>,
    /// Those of the last step, while these are found, and those that are none any more.
    previous: Vec<Kept>,
    gone: Vec<Kept>,
    pub(super) spare: Vec<Kept>,
    /// Of the pairs that are asleep, in the order of their bodies.
    pub(super) resting: Vec<Memory>,
    /// How many contacts at the front are of bodies asleep, and a number that changes whenever these do.
    pub(super) resting_contacts: usize,
    pub(super) rest_revision: u64,
    /// The motions of links asleep are in place.
    settled: bool,
    pub(super) probe: Candidate,
    /// Bodies whose volumes this step controls.
    pub(super) controlled: Vec<(usize, Box<Control>)>,
    pub(super) islands: Vec<Group>,
    pub(super) island_count: usize,
    roots: Vec<u32>,
    island_of: Vec<u32>,
    /// The island of each candidate.
    pub(super) owners: Vec<u32>,
    /// Contacts at the end of the last step, by slot of the body.
    pub(super) touches: Vec<u32>,
    /// Working memory of each worker; the first always is the thread that steps.
    pub(super) workers: Vec<Mutex<Worker>>,
    pub(super) contacts: Vec<Contact>,
    /// Of each candidate, what is to be said, and the end of its contacts behind those asleep.
    conclusions: Vec<Conclusion>,
    contact_ends: Vec<usize>,
    pub(super) system: System,
    pub(super) substance_contacts: Vec<Contact>,
    events: Vec<Event>,
    pub(super) counters: Counters,
    pub(super) times: Times,
}

/// Two bodies, or two parts of one body by the first skeleton of each, and which of its blocks these are.
#[derive(Clone, Copy, Debug)]
struct Meeting {
    bodies: [u32; 2],
    part: [u32; 2],
    block: u32,
}

/// An island, and what the world notes about it.
#[derive(Debug, Default)]
pub(super) struct Group {
    pub island: Island,
    pub response: Response,
    /// The world or a body asks for it.
    pub forced: bool,
    /// Sub-steps that it asks for.
    pub substeps: f64,
    /// Links that it leans on: they do not move, and other islands may lean on them too.
    pub supports: Vec<u32>,
    /// The contact impulses that they got from it.
    pub carried: Vec<Wrench>,
    /// Its own candidates, while it is stepped.
    pub candidates: Vec<Kept>,
    /// Links that the host moves whatever happens, with the poses that they start from.
    pub driven: Vec<(u32, (Vec3, Quat))>,
    /// It is stepped beside others, by which worker, and what came out.
    pub beside: bool,
    pub worker: usize,
    pub outcome: Outcome,
}

/// What is to be said of a candidate at the end of a step.
#[derive(Clone, Copy, Debug, Default)]
struct Conclusion {
    contacts: usize,
    begins: bool,
    ends: bool,
    overloads: bool,
}

impl Conclusion {
    /// What happened, noted in the candidate's memory too.
    fn of(candidate: &mut Candidate, implicit: bool) -> Self {
        let overloaded = !candidate.surface.overloads.is_empty();
        let contacts = candidate.pressing().count();
        let touching = contacts > 0 || overloaded;
        let held = if implicit { 0.0 } else { candidate.elastic_energy() };
        let memory = &mut candidate.memory;
        // It may have come and gone within the step.
        let passed = !memory.touching && !touching && memory.touched;
        let conclusion = Self {
            contacts,
            begins: !memory.touching && touching || passed,
            ends: memory.touching && !touching || passed,
            overloads: memory.overloaded && !memory.was_overloaded,
        };
        (memory.touching, memory.held) = (touching, held);
        memory.was_overloaded = overloaded || memory.overloaded && touching;
        memory.overloaded = false;
        conclusion
    }
}

/// What stepping an island took.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Outcome {
    pub substeps: u32,
    pub rounds: u32,
    pub splits: u32,
}

impl Stepping {
    pub fn contacts(&self) -> &[Contact] {
        &self.contacts
    }

    pub fn resting_contacts(&self) -> (usize, u64) {
        (self.resting_contacts, self.rest_revision)
    }

    pub fn events(&self) -> &[Event] {
        &self.events
    }

    pub fn counters(&self) -> Counters {
        self.counters
    }

    pub fn times(&self) -> Times {
        self.times
    }

    /// What a snapshot keeps. The rest are buffers and reports; whoever adds a field decides here.
    pub fn lasting(&self) -> (&[Kept], &[Memory], &[Contact]) {
        let Self {
            candidates,
            resting,
            resting_contacts,
            rest_revision: _,
            settled: _,
            probe: _,
            motions: _,
            responses: _,
            bounds: _,
            bounds_of: _,
            pairs: _,
            meetings: _,
            bounded_for: _,
            broad_phase: _,
            previous: _,
            gone: _,
            spare: _,
            controlled: _,
            islands: _,
            island_count: _,
            roots: _,
            island_of: _,
            owners: _,
            touches: _,
            workers: _,
            contacts,
            conclusions: _,
            contact_ends: _,
            system: _,
            substance_contacts: _,
            events: _,
            counters: _,
            times: _,
        } = self;
        (candidates, resting, &contacts[..*resting_contacts])
    }

    /// Goes on from what a snapshot has kept, in the buffers that are there. Until the next step nothing is reported but
    /// the contacts of those who sleep.
    pub fn restart(&mut self, memories: Vec<Memory>, resting: Vec<Memory>, contacts: Vec<Contact>) {
        // Whose buffers a candidate has does not matter: those that stay where they are need not be moved.
        while self.candidates.len() < memories.len() {
            self.candidates.push(self.spare.pop().unwrap_or_default());
        }
        self.spare.extend(self.candidates.drain(memories.len()..));
        for (candidate, memory) in self.candidates.iter_mut().zip(memories) {
            candidate.recall(memory);
        }
        (self.resting, self.settled) = (resting, false);
        (self.resting_contacts, self.contacts) = (contacts.len(), contacts);
        self.rest_revision += 1;
        self.events.clear();
        (self.counters, self.times) = (Counters::default(), Times::default());
    }

    /// What the contacts of a body went through no longer counts: it was put elsewhere.
    pub fn forget_contacts_of(&mut self, body: u32) {
        let memories = self.candidates.iter_mut().map(|candidate| &mut candidate.memory).chain(&mut self.resting);
        for memory in memories.filter(|memory| memory.ids.iter().any(|id| id.index == body)) {
            memory.forget_history();
        }
    }
}

impl World {
    /// Advances the world by `dt` seconds: links that the library moves are moved; for host-driven ones the impulses
    /// are worked out that the host is to apply before it advances by the same `dt`.
    pub fn step(&mut self, dt: f64) -> Result<()> {
        require("dt", dt, "> 0 and at most 10 s (and at least 1e-12 s)", |x| (1e-12..=10.0).contains(&x))?;
        let mut tasks = self.tasks.get_mut().take();
        let mut state = std::mem::take(&mut self.stepping);
        Team::with(tasks.as_deref_mut(), |team| self.run(&mut state, dt, team));
        self.stepping = state;
        *self.tasks.get_mut() = tasks;
        Ok(())
    }

    /// The pipeline.
    fn run(&mut self, state: &mut Stepping, dt: f64, team: &Team) {
        let timed = self.desc.timed;
        let (mut whole, mut clock, mut times) = (Clock::start(timed), Clock::start(timed), Times::default());
        self.ramp_blends(state, dt);
        self.control_volumes(state, team);
        self.wake_near_substances(state, dt);
        self.begin(state, dt, team);
        clock.lap(&mut times.begin);
        self.find_candidates(state, dt, team);
        self.check_units(state, dt);
        clock.lap(&mut times.pairs);
        self.group(state);
        clock.lap(&mut times.islands);
        self.step_substances(state, dt, team);
        clock.lap(&mut times.substances);
        self.respond(state, dt, team);
        clock.lap(&mut times.respond);
        self.finish(state, dt);
        self.report(state, team);
        self.let_sleep(state, dt);
        clock.lap(&mut times.report);
        whole.lap(&mut times.step);
        for worker in &mut state.workers {
            let work = &unlocked(worker).work;
            times.contact += work.contact_time;
            times.solve += work.solve_time;
        }
        state.times = times;
    }

    /// Motions from the descriptors, host-driven ones through their mirrors; the host's pushes on our own.
    fn begin(&mut self, state: &mut Stepping, dt: f64, team: &Team) {
        let settled = std::mem::replace(&mut state.settled, true);
        let is_new =
            |world: &Self, index: usize| world.links.is_live(index) && !(settled && world.sleeps(&world.links[index]));
        let count = self.links.capacity();
        state.motions.resize(count, Motion::default());
        let world = &*self;
        team.each_mut(&mut state.motions, team.share(count, LINKS), |index, motion| {
            if is_new(world, index) {
                *motion = world.motion_of(&world.links[index]);
            }
        });
        for index in 0..count {
            if !is_new(self, index) {
                continue;
            }
            let hosted = self.links[index].desc.kind == Kind::Host;
            let host = if hosted { self.host(&self.links[index]) } else { Host::default() };
            let (link, motion) = (&mut self.links[index], &mut state.motions[index]);
            if hosted && motion.is_movable() {
                if link.mirror.enter(&host, motion, dt) {
                    let body = link.body;
                    state.forget_contacts_of(body);
                }
            } else if motion.is_movable() && (link.applied_force, link.applied_impulse) != Default::default() {
                let pushed = motion.answer(&link.applied_impulse);
                motion.twist.linear += pushed.linear;
                motion.twist.angular += pushed.angular;
                let pulled = motion.answer(&link.applied_force);
                motion.acceleration += pulled.linear;
                motion.angular_acceleration += pulled.angular;
            }
            let link = &mut self.links[index];
            (link.applied_force, link.applied_impulse) = (Wrench::default(), Wrench::default());
        }
        self.foresee_bounces(state);
        for articulation in &self.articulations {
            articulation.set_inertias(&mut state.motions);
        }
    }

    /// Pairs of bodies whose bounds meet and that may touch.
    fn find_candidates(&mut self, state: &mut Stepping, dt: f64, team: &Team) {
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

    pub(super) fn may_touch(
        &self,
        pair: &[u32; 2],
        motions: &[Motion],
        filter: &mut Option<super::PairFilter>,
    ) -> bool {
        let [a, b] = pair.map(|body| &self.bodies[body as usize]);
        // A host-driven kinematic link may still have its wrench asked for: only bodies that are fixed all over are
        // skipped.
        let still = |body: &super::Body| {
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

    /// Says once a body when its units cannot work.
    fn check_units(&mut self, state: &Stepping, dt: f64) {
        let Some(mut log) = self.log.get_mut().take() else { return };
        for index in 0..self.bodies.capacity() {
            if self.bodies.is_live(index) && self.bodies[index].enabled {
                let warned = units::check(self, index, &state.motions, dt, &mut |text| log(LogLevel::Warning, text));
                self.bodies[index].units = warned;
            }
        }
        *self.log.get_mut() = Some(log);
    }

    /// Islands: bodies that touch, directly or through others that can move.
    fn group(&self, state: &mut Stepping) {
        let bodies = self.bodies.capacity();
        state.roots.clear();
        state.roots.extend(0..bodies as u32);
        fn find(roots: &mut [u32], mut body: u32) -> u32 {
            while roots[body as usize] != body {
                roots[body as usize] = roots[roots[body as usize] as usize];
                body = roots[body as usize];
            }
            body
        }
        let movable = |body: u32| {
            let body = &self.bodies[body as usize];
            !body.is_asleep() && body.links.iter().any(|link| state.motions[*link as usize].is_movable())
        };
        for candidate in &state.candidates {
            let [a, b] = candidate.bodies;
            if movable(a) && movable(b) {
                let (a, b) = (find(&mut state.roots, a), find(&mut state.roots, b));
                state.roots[a.max(b) as usize] = a.min(b);
            }
        }
        for Articulation { links, .. } in &self.articulations {
            let mut bodies = links.iter().map(|link| self.links[*link as usize].body).filter(|body| movable(*body));
            let Some(first) = bodies.next() else { continue };
            for body in bodies {
                let (a, b) = (find(&mut state.roots, first), find(&mut state.roots, body));
                state.roots[a.max(b) as usize] = a.min(b);
            }
        }
        for group in &mut state.islands {
            group.island.links.clear();
            group.island.springs.clear();
            group.island.articulations.clear();
            group.supports.clear();
        }
        state.island_of.clear();
        state.island_of.resize(bodies, u32::MAX);
        let mut count = 0;
        let mut island_for = |root: u32, islands: &mut Vec<Group>, island_of: &mut [u32]| {
            if island_of[root as usize] == u32::MAX {
                island_of[root as usize] = count as u32;
                count += 1;
                if islands.len() < count {
                    islands.push(Group::default());
                }
            }
            island_of[root as usize] as usize
        };
        state.owners.clear();
        for candidate in &state.candidates {
            let [a, b] = candidate.bodies;
            let root = find(&mut state.roots, if movable(a) { a } else { b });
            let island = island_for(root, &mut state.islands, &mut state.island_of);
            state.owners.push(island as u32);
        }
        for body in self.bodies.indices() {
            if !self.bodies[body].enabled {
                continue;
            }
            // A kinematic body touched only by others is drifted in each of their islands; see `respond`.
            if movable(body as u32) {
                let root = find(&mut state.roots, body as u32);
                let island = island_for(root, &mut state.islands, &mut state.island_of);
                let island = &mut state.islands[island].island;
                island.links.extend(&self.bodies[body].links);
                self.gather_springs(&self.bodies[body], &state.motions, &mut island.springs);
            }
        }
        state.island_count = count;
        for (index, Articulation { links, .. }) in self.articulations.iter().enumerate() {
            let mut bodies = links.iter().map(|link| self.links[*link as usize].body);
            if let Some(body) = bodies.find(|body| movable(*body) && self.bodies[*body as usize].enabled) {
                let island = state.island_of[find(&mut state.roots, body) as usize];
                state.islands[island as usize].island.articulations.push(index as u32);
            }
        }
        for (candidate, owner) in state.candidates.iter().zip(&state.owners) {
            let Group { island, supports, .. } = &mut state.islands[*owner as usize];
            for (body, side) in candidate.bodies.into_iter().zip([&candidate.pair.a, &candidate.pair.b]) {
                if movable(body) {
                    continue;
                }
                supports.extend(side.links.iter().copied().chain(candidate.pair.covers.iter().map(|cover| cover.link)));
                let moving = |link: &&u32| self.links[**link as usize].desc.kind == Kind::Host;
                for link in self.bodies[body as usize].links.iter().filter(moving) {
                    if !island.links.contains(link) {
                        island.links.push(*link);
                    }
                }
            }
        }
        for Group { supports, .. } in &mut state.islands[..count] {
            supports.sort_unstable();
            supports.dedup();
        }
    }

    /// Writes back what moved, and what the host is to do.
    fn finish(&mut self, state: &mut Stepping, dt: f64) {
        for index in 0..self.links.capacity() {
            if !self.links.is_live(index) || self.sleeps(&self.links[index]) {
                continue;
            }
            state.motions[index].recoil = 0.0;
            let motion = &state.motions[index];
            let hosted = self.links[index].desc.kind == Kind::Host && motion.is_movable();
            let host = if hosted { self.host(&self.links[index]) } else { Host::default() };
            let link = &mut self.links[index];
            link.contact_impulse = motion.contact_impulse;
            link.substance_impulse = state.system.carried.get(index).copied().unwrap_or_default();
            link.last_dt = dt;
            link.host_impulse = Wrench::default();
            match link.desc.kind {
                Kind::PointMass | Kind::Rigid => {
                    link.desc.pose = motion.pose();
                    link.desc.twist = motion.twist;
                }
                Kind::Host if hosted && state.responses[index] == Response::Substepped => {
                    let center = link.desc.pose.transform_point(&link.desc.local_center);
                    let rotation = link.desc.pose.rotation;
                    link.host_impulse = link.mirror.leave(&host, motion, &center, &rotation, dt);
                }
                Kind::Host if hosted => {
                    link.host_impulse = link.mirror.hand_over(&host, motion, &link.desc.pose.rotation, dt);
                }
                Kind::Host | Kind::Fixed => {}
            }
        }
    }

    fn sleeps(&self, link: &Link) -> bool {
        self.bodies[link.body as usize].is_asleep()
    }

    /// What of a host-driven link matters to its mirror.
    pub(super) fn host(&self, link: &Link) -> Host {
        Host {
            twist: link.desc.twist,
            convention: link.desc.velocity_convention,
            gyroscopic: link.desc.host_gyroscopic,
            teleport: 0.5 * self.thinnest(link),
        }
    }

    /// Contacts and events. What sleeps is at the front of the contacts.
    fn report(&mut self, state: &mut Stepping, team: &Team) {
        self.keep_resting_contacts(state);
        let Stepping { candidates, gone, spare, events, contacts, conclusions, contact_ends, .. } = state;
        let (islands, owners) = (&state.islands, &state.owners);
        events.clear();
        // Pairs that are no longer candidates cannot touch.
        for mut gone in gone.drain(..) {
            if gone.memory.touching {
                let bodies = gone.memory.ids.map(BodyId::from_raw);
                events.push(Event { kind: EventKind::End, bodies });
            }
            gone.memory.forget();
            spare.push(gone);
        }
        conclusions.resize(candidates.len(), Conclusion::default());
        team.each_row(candidates, 1, conclusions, |index, candidates, conclusion| {
            let implicit = islands[owners[index] as usize].outcome.rounds > 0;
            *conclusion = Conclusion::of(&mut candidates[0], implicit);
        });
        let candidates = &*candidates;
        let mut end = 0;
        contact_ends.clear();
        for (candidate, Conclusion { contacts, begins, ends, overloads }) in candidates.iter().zip(conclusions) {
            end += *contacts;
            contact_ends.push(end);
            let mut say = |kind| events.push(Event { kind, bodies: candidate.memory.ids.map(BodyId::from_raw) });
            for (happened, kind) in
                [(*begins, EventKind::Begin), (*ends, EventKind::End), (*overloads, EventKind::Overload)]
            {
                if happened {
                    say(kind);
                }
            }
        }
        contacts.resize(state.resting_contacts + end, Contact::default());
        team.each_piece(&mut contacts[state.resting_contacts..], contact_ends, |index, contacts| {
            for (place, contact) in contacts.iter_mut().zip(self.contacts_of(&candidates[index])) {
                *place = contact;
            }
        });
        contacts.extend_from_slice(&state.substance_contacts);
        state.counters.patches = contacts.len() as u32;
    }

    /// The contacts of a candidate as they were last evaluated.
    pub(super) fn contacts_of<'a>(&'a self, candidate: &'a Candidate) -> impl Iterator<Item = Contact> + 'a {
        let pair = &candidate.pair;
        candidate.pressing().map(move |(patch, sums)| {
            let link = |side: &Side, index: usize| self.links.id_of(side.links[index] as usize);
            let skeleton = |side: &Side, index: usize| self.skeletons.id_of(side.ids[index] as usize);
            let [i, j] = patch.skeletons;
            Contact {
                bodies: candidate.bodies.map(|body| self.bodies.id_of(body as usize)),
                links: [link(&pair.a, i), link(&pair.b, j)],
                skeletons: [skeleton(&pair.a, i), skeleton(&pair.b, j)],
                position: pair.origin + sums.center,
                normal: sums.force.normalize(),
                force: sums.force,
                torque: sums.torque,
                area: sums.area,
                peak_pressure: patch.peak_pressure,
                stiffness: sums.stiffness,
                error_estimate: patch.error_estimate,
                evaluations: patch.evaluations,
                scheme: patch.scheme,
                overloaded: patch.overloaded,
            }
        })
    }

    /// The contacts of two bodies at their present poses, without stepping: the elastic forces alone. Of a body with
    /// itself, those of its parts that don't blend.
    pub fn collide(&self, a: BodyId, b: BodyId, scheme: super::Scheme, tolerance: f64) -> Result<Vec<Contact>> {
        require("tolerance", tolerance, "from 1e-9 to 0.5", |x| (1e-9..=0.5).contains(&x))?;
        self.bodies.get(a)?;
        self.bodies.get(b)?;
        let motions = self.motions();
        let mut candidate = Candidate::default();
        candidate.bodies = [a.raw.index, b.raw.index];
        let mut contacts = Vec::new();
        let settings = surface::Settings { scheme, tolerance };
        let mut add = |candidate: &mut Candidate| {
            candidate.pair.place(&motions, candidate.lead);
            surface::integrate(&candidate.pair, &settings, &mut candidate.surface);
            candidate.loads.clear();
            candidate.loads.extend(candidate.surface.sums());
            contacts.extend(self.contacts_of(candidate));
        };
        if a == b {
            let blocks = self.bodies[a.index()].blending.as_ref().map_or(0, |blending| blending.blocks.len());
            for block in 0..blocks as u32 {
                candidate.block = block;
                if self.fill_block(&mut candidate, &motions, 0.0) {
                    add(&mut candidate);
                }
            }
            return Ok(contacts);
        }
        let bounds = [a, b].map(|body| self.bounds_of(body.index(), &motions, 0.0));
        if let [Some(first), Some(second)] = &bounds
            && self.fill(&mut candidate, &motions, [first, second], 0.0)
        {
            add(&mut candidate);
        }
        Ok(contacts)
    }
}
