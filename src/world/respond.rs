//! The response of each island: which one, and its run.

use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

use super::World;
use super::events::{Counters, LogLevel};
use super::islands::{Group, Outcome};
use super::step::Stepping;
use crate::base::{Articulation, Kind, Motion};
use crate::contact::surface;
use crate::contact::tally::Tally;
use crate::math::Wrench;
use crate::response::substep::{Step, Work};
use crate::response::{Response, explicit, implicit, substepped};
use crate::team::Team;

/// Steps for which a body that was in a stack counts as in one still: a stack that rattles should not fall between two
/// responses.
const STACKED: u8 = 10;

/// Turn of a spring's swing in a step from which on it is stiff \[rad\].
const STIFF: f64 = 0.3;

/// Candidates from which on an island is stepped by all workers, and not by one of them beside other islands.
const WIDE: usize = 24;

/// Islands that a worker takes in one go.
const BLOCK: usize = 4;

/// What each worker needs for itself.
#[derive(Debug, Default)]
pub(super) struct Worker {
    /// The links of the islands that are stepped beside others, each in its slot, until all are gathered up.
    motions: Vec<Motion>,
    /// A place for each link.
    rates: Vec<f64>,
    pub work: Work,
    implicit: implicit::Solver,
}

/// How islands are stepped.
struct Rules<'a> {
    dt: f64,
    articulations: &'a [Articulation],
    settings: surface::Settings,
    /// Largest product of contact frequency and sub-step \[rad\].
    phase: f64,
    effort: implicit::Effort,
}

impl Rules<'_> {
    fn step(
        &self,
        group: &mut Group,
        motions: &mut [Motion],
        work: &mut Work,
        solver: &mut implicit::Solver,
        team: &Team,
    ) {
        let dt = self.dt;
        let Group { island, candidates, response, substeps, supports, driven, carried, outcome, .. } = group;
        driven.clear();
        for link in &island.links {
            let motion = &motions[*link as usize];
            if !motion.is_movable() {
                driven.push((*link, (motion.center, motion.rotation)));
            }
        }
        // What leans on it elsewhere is added up in the order of the islands, whoever steps them.
        for link in supports.iter() {
            motions[*link as usize].contact_impulse = Wrench::default();
        }
        let articulations = self.articulations;
        let mut step = Step { motions, island, candidates, articulations, settings: &self.settings, work, team };
        // What is past the most that its contacts carry is held by the implicit response alone, whoever forces another.
        let (substeps, left) = match response {
            Response::Explicit => explicit::step(&mut step, dt),
            Response::Implicit => (0, dt),
            Response::Auto | Response::Substepped => substepped::step(&mut step, dt, *substeps as u32),
        };
        *outcome = Outcome { substeps, ..Outcome::default() };
        if left > 0.0 {
            implicit::step(&mut step, left, &self.effort, solver);
            (outcome.rounds, outcome.splits) = (solver.rounds, solver.splits);
        }
        // Links that the host moves whatever happens start every island from the host's pose.
        for (link, pose) in driven.iter() {
            (motions[*link as usize].center, motions[*link as usize].rotation) = *pose;
        }
        carried.clear();
        carried.extend(supports.iter().map(|link| motions[*link as usize].contact_impulse));
    }
}

/// The worker, by one who has the lock to himself.
pub(super) fn unlocked(worker: &mut Mutex<Worker>) -> &mut Worker {
    worker.get_mut().unwrap_or_else(PoisonError::into_inner)
}

/// A worker that nobody is using, and its number.
fn idle(workers: &[Mutex<Worker>]) -> (usize, MutexGuard<'_, Worker>) {
    // There are as many as threads, so that one always is.
    loop {
        for (number, worker) in workers.iter().enumerate() {
            match worker.try_lock() {
                Ok(worker) => return (number, worker),
                Err(TryLockError::Poisoned(poisoned)) => return (number, poisoned.into_inner()),
                Err(TryLockError::WouldBlock) => {}
            }
        }
    }
}

/// Steps the islands that are marked for it, each by one worker who has its links for himself.
fn step_beside_each_other(state: &mut Stepping, rules: &Rules, team: &Team) {
    let Stepping { islands, motions, workers, .. } = state;
    team.each_mut(&mut islands[..state.island_count], BLOCK, |_, group| {
        if !group.beside {
            return;
        }
        let (number, mut worker) = idle(workers);
        let Worker { motions: own, work, implicit, .. } = &mut *worker;
        own.resize(motions.len(), Motion::default());
        let articulations = group.island.articulations.iter().map(|index| &rules.articulations[*index as usize]);
        let held = articulations.flat_map(|articulation| &articulation.links);
        for link in group.island.links.iter().chain(&group.supports).chain(held) {
            own[*link as usize] = motions[*link as usize];
        }
        rules.step(group, own, work, implicit, &Team::alone());
        group.worker = number;
    });
}

/// Sub-steps that each island asks for which may be taken in such.
fn plan(state: &mut Stepping, rules: &Rules, team: &Team) {
    let Stepping { islands, motions, workers, .. } = state;
    team.each_mut(&mut islands[..state.island_count], BLOCK, |_, group| {
        if group.response == Response::Substepped {
            let Group { island, candidates, .. } = group;
            let rates = &mut idle(workers).1.rates;
            group.substeps = substepped::plan(motions, island, candidates, rules.dt, rules.phase, rates);
        }
    });
}

impl Group {
    /// Whether one worker is enough for it.
    fn is_small(&self) -> bool {
        self.candidates.len() < WIDE
    }
}

impl Stepping {
    /// Gives each island its candidates.
    fn hand_out_candidates(&mut self) {
        for (candidate, owner) in self.candidates.drain(..).zip(&self.owners) {
            self.islands[*owner as usize].candidates.push(candidate);
        }
    }

    /// Takes them back, in their order.
    fn collect_candidates(&mut self) {
        let last = |owner: &u32| self.islands[*owner as usize].candidates.pop();
        self.candidates.extend(self.owners.iter().rev().filter_map(last));
        self.candidates.reverse();
    }
}

impl World {
    pub(super) fn respond(&mut self, state: &mut Stepping, dt: f64, team: &Team) {
        let articulations = std::mem::take(&mut self.articulations);
        let rules = Rules {
            dt,
            articulations: &articulations,
            settings: surface::Settings { scheme: self.desc.scheme, tolerance: self.desc.force_tolerance },
            phase: self.desc.substep_phase,
            effort: implicit::Effort {
                rounds: self.desc.implicit_rounds,
                tolerance: self.desc.implicit_tolerance,
                splits: self.desc.implicit_splits,
            },
        };
        state.responses.clear();
        state.responses.resize(self.links.capacity(), Response::Auto);
        self.notice_stacks(state);
        while state.workers.len() < team.workers() {
            state.workers.push(Mutex::default());
        }
        for worker in &mut state.workers {
            unlocked(worker).rates.resize(state.motions.len(), 0.0);
        }
        state.hand_out_candidates();
        for index in 0..state.island_count {
            let (response, forced) = self.choose(&state.islands[index], state, dt);
            let group = &mut state.islands[index];
            (group.response, group.forced, group.substeps) = (response, forced, 0.0);
        }
        // Others than the implicit response take each link by itself.
        for Group { island, response, .. } in &state.islands[..state.island_count] {
            for articulation in island.articulations.iter().filter(|_| *response != Response::Implicit) {
                for link in &articulations[*articulation as usize].links {
                    state.motions[*link as usize].inertia = self.motion_of(&self.links[*link as usize]).inertia;
                }
            }
        }
        plan(state, &rules, team);
        let most = f64::from(self.desc.max_substeps);
        for index in 0..state.island_count {
            let group = &mut state.islands[index];
            // Too few sub-steps would gain energy without end.
            if group.substeps > most {
                group.response = Response::Implicit;
                for articulation in &group.island.articulations {
                    articulations[*articulation as usize].set_inertias(&mut state.motions);
                }
            }
            let response = group.response;
            if response != Response::Implicit {
                group.island.articulations.clear();
            }
            self.meet_hosts(state, index, response, dt, &articulations);
        }
        for worker in &mut state.workers {
            let work = &mut unlocked(worker).work;
            (work.tally, work.timed) = (Tally::default(), self.desc.timed);
            (work.contact_time, work.solve_time) = (0.0, 0.0);
        }
        let groups = &mut state.islands[..state.island_count];
        let several = team.workers() > 1 && groups.iter().filter(|group| group.is_small()).count() > 1;
        for group in groups.iter_mut() {
            group.beside = several && group.is_small();
        }
        if several {
            step_beside_each_other(state, &rules, team);
        }
        let groups = &mut state.islands[..state.island_count];
        let Worker { work, implicit, .. } = unlocked(&mut state.workers[0]);
        for group in groups.iter_mut().filter(|group| !group.beside) {
            rules.step(group, &mut state.motions, work, implicit, team);
        }
        state.collect_candidates();
        self.gather_up(state);
        self.articulations = articulations;
    }

    /// What the islands come to, in their order.
    fn gather_up(&mut self, state: &mut Stepping) {
        let Stepping { islands, workers, motions, candidates, .. } = state;
        let groups = &mut islands[..state.island_count];
        let mut counters =
            Counters { pairs: candidates.len() as u32, islands: groups.len() as u32, ..Counters::default() };
        let mut short = 0.0f64;
        for group in groups.iter_mut() {
            if group.beside {
                let moved = &unlocked(&mut workers[group.worker]).motions;
                // Who is pushed is in no other island; what others lean on too is as it was.
                for link in group.island.links.iter().filter(|link| moved[**link as usize].is_movable()) {
                    motions[*link as usize] = moved[*link as usize];
                }
            }
            let Outcome { substeps, rounds, splits } = group.outcome;
            counters.substeps = counters.substeps.max(substeps);
            counters.implicit_rounds = counters.implicit_rounds.max(rounds);
            counters.implicit_splits = counters.implicit_splits.max(splits);
            if group.forced {
                short = short.max(group.substeps);
            }
            for link in &group.supports {
                motions[*link as usize].contact_impulse = Wrench::default();
            }
        }
        for group in groups {
            for (link, carried) in group.supports.iter().zip(&group.carried) {
                motions[*link as usize].contact_impulse.add_scaled(carried, 1.0);
            }
        }
        for worker in workers {
            counters.by_scheme.merge(&unlocked(worker).work.tally);
        }
        counters.evaluations = counters.by_scheme.total();
        counters.substeps = counters.substeps.max(state.system.substeps);
        state.counters = counters;
        let most = self.desc.max_substeps;
        if short > f64::from(most)
            && let Some(log) = self.log.get_mut()
        {
            let text = format!(
                "the stiffest contact asks for {short:.0} sub-steps, max_substeps allows {most}: the step was implicit; \
                 raise max_substeps, or lower stiffness_scale or dt"
            );
            log(LogLevel::Warning, &text);
        }
    }

    /// Notes which bodies are in a stack: those that touch two others.
    fn notice_stacks(&mut self, state: &mut Stepping) {
        state.touches.clear();
        state.touches.resize(self.bodies.capacity(), 0);
        for candidate in state
            .candidates
            .iter()
            .filter(|candidate| candidate.memory.touching && candidate.bodies[0] != candidate.bodies[1])
        {
            for body in candidate.bodies {
                state.touches[body as usize] += 1;
            }
        }
        for index in 0..self.bodies.capacity() {
            if self.bodies.is_live(index) && !self.bodies[index].is_asleep() {
                let body = &mut self.bodies[index];
                body.stacked = if state.touches[index] >= 2 { STACKED } else { body.stacked.saturating_sub(1) };
            }
        }
    }

    /// The response of an island. What a body or the world forces holds for all that it touches, the most stable first;
    /// left to itself, implicit is for what is jointed, held by its host, stacked, or on stiff springs, and sub-steps for
    /// the rest. Also whether it is forced.
    fn choose(&self, group: &Group, state: &Stepping, dt: f64) -> (Response, bool) {
        let Group { island, candidates, .. } = group;
        let movable = |link: &&u32| state.motions[**link as usize].is_movable();
        let links = || island.links.iter().filter(movable).map(|link| &self.links[*link as usize]);
        let forced = |response| {
            links().any(|link| match self.bodies[link.body as usize].desc.response {
                Response::Auto => self.desc.response == response,
                own => own == response,
            })
        };
        for response in [Response::Implicit, Response::Substepped, Response::Explicit] {
            if forced(response) {
                return (response, true);
            }
        }
        let held = links().any(|link| link.is_held() || self.bodies[link.body as usize].stacked > 0);
        let stiff = island.springs.iter().any(|spring| spring.rate2(&state.motions).sqrt() * dt > STIFF);
        // Substances have pushed by now.
        let pushed = || island.links.iter().any(|link| state.motions[*link as usize].touched);
        let implicit = held && (!candidates.is_empty() || pushed()) || stiff;
        (if implicit { Response::Implicit } else { Response::Substepped }, false)
    }

    /// Gives host-driven links the velocities that a response starts from. What substances did to a link of an articulation
    /// moves the others too.
    fn meet_hosts(
        &mut self,
        state: &mut Stepping,
        index: usize,
        response: Response,
        dt: f64,
        articulations: &[Articulation],
    ) {
        for link in &state.islands[index].island.links {
            let slot = *link as usize;
            state.responses[slot] = response;
            if self.links[slot].desc.kind == Kind::Host
                && state.motions[slot].is_movable()
                && response != Response::Substepped
            {
                let host = self.host(&self.links[slot]);
                let link = &mut self.links[slot];
                // With the effective inertia, the host's own answer is known; unless it turns out to be off.
                let articulated = link.articulated && response == Response::Implicit;
                let known = link.desc.inverse_effective_inertia.is_some() || articulated;
                if articulated {
                    // What it owes the host would be passed on to the others, of which each owes the same.
                    link.mirror.let_go();
                }
                let held = link.desc.constrained && !known || link.mirror.is_doubtful();
                link.mirror.bypass(&host, &mut state.motions[slot], held, dt);
            }
        }
        if response == Response::Implicit {
            for articulation in &state.islands[index].island.articulations {
                let articulation = &articulations[*articulation as usize];
                for (from, link) in articulation.links.iter().enumerate() {
                    let impulse = state.motions[*link as usize].contact_impulse;
                    if impulse != Wrench::default() {
                        articulation.pass_on(from, &impulse, &mut state.motions, |_| true);
                    }
                }
            }
        }
    }
}
