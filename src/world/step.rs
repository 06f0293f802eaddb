//! The pipeline of one step: hosts' poses in, candidate pairs, islands, response, impulses and events out.

use std::sync::Mutex;

use super::events::{Contact, Counters, Event, EventKind, LogLevel, Times};
use super::respond::{Worker, unlocked};
use super::volume::Control;
use super::{BodyId, Link, World, units};
use crate::base::{Articulation, Kind, Motion};
use crate::clock::Clock;
use crate::coat::cliques::Block;
use crate::contact::broad_phase::{self, Bounds};
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

/// Candidates that a worker fills in one go.
const FILLED: usize = 16;

/// What the pipeline keeps between steps, and its buffers.
#[derive(Default)]
pub(crate) struct Stepping {
    /// One a slot of a link.
    pub(super) motions: Vec<Motion>,
    /// How each link was moved, by slot.
    pub(super) responses: Vec<Response>,
    pub(super) bounds: Vec<Bounds>,
    pub(super) bounds_of: Vec<usize>,
    pub(super) pairs: Vec<[u32; 2]>,
    /// Bounds of the last step, body by body, and the pairs that meet among them: while nobody moves, nobody else meets.
    pub(super) last_bounds: Vec<Bounds>,
    new_bounds: Vec<Bounds>,
    /// Who slept when they were found, as a revision, and the length of that step.
    bounded_for: (u64, f64),
    met: Vec<[u32; 2]>,
    meetings: Vec<Meeting>,
    /// In the order of their bodies.
    pub(super) candidates: Vec<Kept>,
    /// Those of the last step, then their memory for reuse.
    previous: Vec<Kept>,
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
            last_bounds: _,
            new_bounds: _,
            bounded_for: _,
            met: _,
            previous: _,
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
        self.begin(state, dt);
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
        self.report(state);
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
    fn begin(&mut self, state: &mut Stepping, dt: f64) {
        let settled = std::mem::replace(&mut state.settled, true);
        state.motions.resize(self.links.capacity(), Motion::default());
        for index in 0..self.links.capacity() {
            if !self.links.is_live(index) || settled && self.sleeps(&self.links[index]) {
                continue;
            }
            let mut motion = self.motion_of(&self.links[index]);
            let hosted = self.links[index].desc.kind == Kind::Host;
            let host = if hosted { self.host(&self.links[index]) } else { Host::default() };
            let link = &mut self.links[index];
            if hosted && motion.is_movable() {
                if link.mirror.enter(&host, &mut motion, dt) {
                    let body = link.body;
                    state.forget_contacts_of(body);
                }
            } else if motion.is_movable() {
                let pushed = motion.answer(&link.applied_impulse);
                motion.twist.linear += pushed.linear;
                motion.twist.angular += pushed.angular;
                let pulled = motion.answer(&link.applied_force);
                motion.acceleration += pulled.linear;
                motion.angular_acceleration += pulled.angular;
            }
            (link.applied_force, link.applied_impulse) = (Wrench::default(), Wrench::default());
            state.motions[index] = motion;
        }
        self.foresee_bounces(state);
        for articulation in &self.articulations {
            articulation.set_inertias(&mut state.motions);
        }
    }

    /// Pairs of bodies whose bounds meet and that may touch.
    fn find_candidates(&mut self, state: &mut Stepping, dt: f64, team: &Team) {
        self.find_bounds(state, dt);
        if state.new_bounds != state.last_bounds {
            state.bounds.clone_from(&state.new_bounds);
            broad_phase::pairs(&mut state.bounds, &mut state.met);
            std::mem::swap(&mut state.new_bounds, &mut state.last_bounds);
        }
        state.pairs.clear();
        self.take_up_memories(state);
        if !self.all_rest(state) {
            state.pairs.extend_from_slice(&state.met);
            state.bounds_of.clear();
            state.bounds_of.resize(self.bodies.capacity(), usize::MAX);
            for (position, bounds) in state.bounds.iter().enumerate() {
                state.bounds_of[bounds.body as usize] = position;
            }
            self.wake_touched(state, dt);
            let mut filter = self.pair_filter.get_mut().take();
            state.pairs.retain(|pair| {
                let asleep = pair.iter().any(|body| self.bodies[*body as usize].is_asleep());
                !asleep && self.may_touch(pair, &state.motions, &mut filter)
            });
            *self.pair_filter.get_mut() = filter;
        }
        std::mem::swap(&mut state.candidates, &mut state.previous);
        self.list_meetings(state);
        let mut old = 0;
        for Meeting { bodies, part, block } in &state.meetings {
            let key = (*bodies, *part);
            while old < state.previous.len() && state.previous[old].key() < key {
                old += 1;
            }
            // A body that took over the slot of a destroyed one is another body.
            let ids = bodies.map(|body| self.bodies.id_of(body as usize).raw);
            let known = state.previous.get(old).is_some_and(|last| last.key() == key && last.memory.ids == ids);
            let mut candidate = state.spare.pop().unwrap_or_default();
            candidate.memory.forget();
            if known {
                std::mem::swap(&mut candidate, &mut state.previous[old]);
                old += 1;
            } else {
                (candidate.memory.ids, candidate.memory.part) = (ids, *part);
            }
            (candidate.bodies, candidate.block) = (*bodies, *block);
            state.candidates.push(candidate);
        }
        let (motions, bounds, bounds_of) = (&state.motions, &state.bounds, &state.bounds_of);
        team.each_mut(&mut state.candidates, FILLED, |_, candidate| {
            let [a, b] = candidate.bodies;
            candidate.close = if a == b {
                self.fill_block(candidate, motions, dt) && !self.are_fixed(&candidate.pair)
            } else {
                let bounds = [a, b].map(|body| &bounds[bounds_of[body as usize]]);
                self.fill(candidate, motions, bounds, dt)
            };
            candidate.memory.touched = false;
        });
        // What no skeleton is close enough for goes back to where it came from.
        for candidate in state.candidates.extract_if(.., |candidate| !candidate.close) {
            state.previous.push(candidate);
        }
    }

    /// Bounds of all bodies, in their order; of one asleep, those of the last step.
    fn find_bounds(&self, state: &mut Stepping, dt: f64) {
        let now = (state.rest_revision, dt);
        let slept = if state.bounded_for == now { &state.last_bounds[..] } else { &[] };
        state.bounded_for = now;
        let mut slept = slept.iter().peekable();
        state.new_bounds.clear();
        for index in self.bodies.indices() {
            let body = &self.bodies[index];
            while slept.next_if(|bounds| bounds.body < index as u32).is_some() {}
            let last = slept.next_if(|bounds| bounds.body == index as u32);
            match last.filter(|_| body.is_asleep()) {
                _ if !body.enabled => {}
                Some(last) => state.new_bounds.push(*last),
                None => state.new_bounds.extend(self.bounds_of(index, &state.motions, dt)),
            }
        }
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
            group.island.candidates.clear();
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
        for (index, candidate) in state.candidates.iter().enumerate() {
            let [a, b] = candidate.bodies;
            let root = find(&mut state.roots, if movable(a) { a } else { b });
            let island = island_for(root, &mut state.islands, &mut state.island_of);
            state.islands[island].island.candidates.push(index as u32);
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
        for Group { island, supports, .. } in &mut state.islands[..count] {
            for index in &island.candidates {
                let candidate = &state.candidates[*index as usize];
                for (body, side) in candidate.bodies.into_iter().zip([&candidate.pair.a, &candidate.pair.b]) {
                    if movable(body) {
                        continue;
                    }
                    supports.extend(&side.links);
                    let moving = |link: &&u32| self.links[**link as usize].desc.kind == Kind::Host;
                    for link in self.bodies[body as usize].links.iter().filter(moving) {
                        if !island.links.contains(link) {
                            island.links.push(*link);
                        }
                    }
                }
            }
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

    /// Contacts and events.
    fn report(&mut self, state: &mut Stepping) {
        self.keep_resting_contacts(state);
        state.events.clear();
        // Pairs that are no longer candidates cannot touch.
        for mut gone in state.previous.drain(..) {
            if gone.memory.touching {
                let bodies = gone.memory.ids.map(BodyId::from_raw);
                state.events.push(Event { kind: EventKind::End, bodies });
            }
            gone.memory.forget();
            state.spare.push(gone);
        }
        for (index, candidate) in state.candidates.iter_mut().enumerate() {
            let bodies = candidate.bodies.map(|body| self.bodies.id_of(body as usize));
            let first = state.contacts.len();
            self.contacts_of(candidate, &mut state.contacts);
            let overloaded = !candidate.surface.overloads.is_empty();
            let touching = state.contacts.len() > first || overloaded;
            let elastic_energy = candidate.elastic_energy();
            let memory = &mut candidate.memory;
            memory.ids = bodies.map(|body| body.raw);
            let mut say = |kind| state.events.push(Event { kind, bodies });
            match (memory.touching, touching) {
                (false, true) => say(EventKind::Begin),
                (true, false) => say(EventKind::End),
                // It came and went within the step.
                (false, false) if memory.touched => {
                    say(EventKind::Begin);
                    say(EventKind::End);
                }
                _ => {}
            }
            if memory.overloaded && !memory.was_overloaded {
                say(EventKind::Overload);
            }
            memory.touching = touching;
            let implicit = state.islands[state.owners[index] as usize].outcome.rounds > 0;
            memory.held = if implicit { 0.0 } else { elastic_energy };
            memory.was_overloaded = overloaded || memory.overloaded && touching;
            memory.overloaded = false;
        }
        state.contacts.extend_from_slice(&state.substance_contacts);
        state.counters.patches = state.contacts.len() as u32;
    }

    /// The contacts of a candidate as they were last evaluated.
    pub(super) fn contacts_of(&self, candidate: &Candidate, out: &mut Vec<Contact>) {
        let pair = &candidate.pair;
        for (patch, sums) in candidate.surface.patches.iter().zip(&candidate.loads) {
            let size = sums.force.norm();
            if size <= 0.0 {
                continue;
            }
            let link = |side: &Side, index: usize| self.links.id_of(side.links[index] as usize);
            let skeleton = |side: &Side, index: usize| self.skeletons.id_of(side.ids[index] as usize);
            let [i, j] = patch.skeletons;
            out.push(Contact {
                bodies: candidate.bodies.map(|body| self.bodies.id_of(body as usize)),
                links: [link(&pair.a, i), link(&pair.b, j)],
                skeletons: [skeleton(&pair.a, i), skeleton(&pair.b, j)],
                position: pair.origin + sums.center,
                normal: sums.force / size,
                force: sums.force,
                torque: sums.torque,
                area: sums.area,
                peak_pressure: patch.peak_pressure,
                stiffness: sums.stiffness,
                error_estimate: patch.error_estimate,
                evaluations: patch.evaluations,
                scheme: patch.scheme,
                overloaded: patch.overloaded,
            });
        }
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
            self.contacts_of(candidate, &mut contacts);
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
