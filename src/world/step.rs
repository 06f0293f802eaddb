//! The pipeline of one step: hosts' poses in, candidate pairs, islands, response, impulses and events out.

use std::sync::Mutex;

use super::candidates::Meeting;
use super::events::{Contact, Counters, Event, LogLevel, Times};
use super::islands::Group;
use super::report::Conclusion;
use super::respond::{Worker, unlocked};
use super::volume::Control;
use super::{BodyId, Link, World, units};
use crate::base::{Kind, Motion};
use crate::clock::Clock;
use crate::contact::broad_phase::{Bounds, BroadPhase};
use crate::contact::candidate::{Candidate, Kept, Memory};
use crate::contact::patch::Sums;
use crate::contact::surface;
use crate::error::{Result, require};
use crate::math::Wrench;
use crate::response::Response;
use crate::response::mirror::Host;
use crate::substance::system::System;
use crate::team::Team;

/// Least links that a worker takes in one go.
const LINKS: usize = 16;

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
    pub(super) bounded_for: (u64, f64),
    pub(super) broad_phase: BroadPhase,
    pub(super) pairs: Vec<[u32; 2]>,
    pub(super) meetings: Vec<Meeting>,
    /// In the order of their bodies.
    pub(super) candidates: Vec<Kept>,
    /// Those of the last step, while these are found, and those that are none any more.
    pub(super) previous: Vec<Kept>,
    pub(super) gone: Vec<Kept>,
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
    pub(super) roots: Vec<u32>,
    pub(super) island_of: Vec<u32>,
    /// The island of each candidate.
    pub(super) owners: Vec<u32>,
    /// Contacts at the end of the last step, by slot of the body.
    pub(super) touches: Vec<u32>,
    /// Working memory of each worker; the first always is the thread that steps.
    pub(super) workers: Vec<Mutex<Worker>>,
    pub(super) contacts: Vec<Contact>,
    /// Of each candidate, what is to be said, and the end of its contacts behind those asleep.
    pub(super) conclusions: Vec<Conclusion>,
    pub(super) contact_ends: Vec<usize>,
    pub(super) system: System,
    pub(super) substance_contacts: Vec<Contact>,
    pub(super) events: Vec<Event>,
    pub(super) counters: Counters,
    pub(super) times: Times,
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
            candidate.loads.extend(candidate.surface.overloads.iter().map(|_| Sums::default()));
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
