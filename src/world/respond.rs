//! The response of each island: which one, and its run.

use super::World;
use super::events::{Counters, LogLevel};
use super::step::Stepping;
use crate::base::Kind;
use crate::contact::surface;
use crate::response::substep::Island;
use crate::response::{Response, explicit, implicit, substepped};

/// Steps for which a body that was in a stack counts as in one still: a stack that rattles should not fall between two
/// responses.
const STACKED: u8 = 10;

impl World {
    pub(super) fn respond(&mut self, state: &mut Stepping, dt: f64) {
        let settings = surface::Settings { scheme: self.desc.scheme, tolerance: self.desc.force_tolerance };
        let limits = substepped::Limits { phase: self.desc.substep_phase, most: self.desc.max_substeps };
        let effort = implicit::Effort {
            rounds: self.desc.implicit_rounds,
            tolerance: self.desc.implicit_tolerance,
            splits: self.desc.implicit_splits,
        };
        state.work.evaluations = 0;
        state.responses.clear();
        state.responses.resize(self.links.capacity(), Response::Auto);
        state.counters = Counters {
            pairs: state.candidates.len() as u32,
            islands: state.island_count as u32,
            ..Counters::default()
        };
        self.notice_stacks(state);
        let mut short = 0.0f64;
        for index in 0..state.island_count {
            let (mut response, forced) = self.choose(&state.islands[index], state);
            let mut wanted = 1.0;
            if response == Response::Substepped {
                let (island, rates) = (&state.islands[index], &mut state.rates);
                wanted = substepped::plan(&state.motions, island, &mut state.candidates, dt, &limits, rates);
                // Too few sub-steps would gain energy without end.
                if wanted > f64::from(limits.most) && !forced {
                    response = Response::Implicit;
                }
            }
            self.meet_hosts(state, index, response, dt);
            let island = &state.islands[index];
            let (motions, candidates, work) = (&mut state.motions, &mut state.candidates, &mut state.work);
            let counters = &mut state.counters;
            match response {
                Response::Explicit => {
                    explicit::step(motions, island, candidates, dt, &settings, work);
                    counters.substeps = counters.substeps.max(1);
                }
                Response::Implicit => {
                    let solver = &mut state.implicit;
                    implicit::step(motions, island, candidates, dt, &settings, &effort, solver, work);
                    counters.implicit_rounds = counters.implicit_rounds.max(solver.rounds);
                    counters.implicit_splits = counters.implicit_splits.max(solver.splits);
                }
                Response::Auto | Response::Substepped => {
                    let taken = substepped::step(motions, island, candidates, dt, &settings, &limits, wanted, work);
                    counters.substeps = counters.substeps.max(taken);
                    short = short.max(wanted / f64::from(taken));
                }
            }
            // Kinematic links start every island from the host's pose.
            for link in &island.links {
                let motion = &mut motions[*link as usize];
                if !motion.is_movable() {
                    let desc = &self.links[*link as usize].desc;
                    motion.center = desc.pose.transform_point(&desc.local_center);
                    motion.rotation = desc.pose.rotation;
                }
            }
        }
        state.counters.evaluations = state.work.evaluations;
        if short > 1.0
            && let Some(log) = &mut self.log
        {
            let text = format!(
                "the stiffest contact asks for {:.0} sub-steps, max_substeps allows {}: raise it, or lower \
                 stiffness_scale or dt",
                short * f64::from(self.desc.max_substeps),
                self.desc.max_substeps
            );
            log(LogLevel::Warning, &text);
        }
    }

    /// Notes which bodies are in a stack: those that touch two others.
    fn notice_stacks(&mut self, state: &mut Stepping) {
        state.touches.clear();
        state.touches.resize(self.bodies.capacity(), 0);
        for candidate in state.candidates.iter().filter(|candidate| candidate.memory.touching) {
            for body in candidate.bodies {
                state.touches[body as usize] += 1;
            }
        }
        for index in 0..self.bodies.capacity() {
            if self.bodies.is_live(index) {
                let body = &mut self.bodies[index];
                body.stacked = if state.touches[index] >= 2 { STACKED } else { body.stacked.saturating_sub(1) };
            }
        }
    }

    /// The response of an island. What a body or the world forces holds for all that it touches, the most stable first;
    /// left to itself, implicit is for what is jointed, held by its host, or stacked, and sub-steps for the rest. Also
    /// whether it is forced.
    fn choose(&self, island: &Island, state: &Stepping) -> (Response, bool) {
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
        let held = links().any(|link| {
            let host = link.desc.kind == Kind::Host && (link.desc.constrained || link.mirror.is_doubtful());
            host || self.bodies[link.body as usize].stacked > 0
        });
        let implicit = held && !island.candidates.is_empty();
        (if implicit { Response::Implicit } else { Response::Substepped }, false)
    }

    /// Gives host-driven links the velocities that a response starts from.
    fn meet_hosts(&mut self, state: &mut Stepping, index: usize, response: Response, dt: f64) {
        for link in &state.islands[index].links {
            let slot = *link as usize;
            state.responses[slot] = response;
            if self.links[slot].desc.kind == Kind::Host
                && state.motions[slot].is_movable()
                && response != Response::Substepped
            {
                let host = self.host(&self.links[slot]);
                let link = &mut self.links[slot];
                // With the effective inertia, the host's own answer is known; unless it turns out to be off.
                let known = link.desc.inverse_effective_inertia.is_some();
                let held = link.desc.constrained && !known || link.mirror.is_doubtful();
                link.mirror.bypass(&host, &mut state.motions[slot], held, dt);
            }
        }
    }
}
