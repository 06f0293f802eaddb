//! Sub-stepped response: as many small steps as the stiffest contact within reach asks for.
//!
//! The rate of a contact is `w² = k W`, with `k` the largest stiffness that it can reach in the step and `W` the
//! mobility of its two bodies there; the rates of all contacts of a link add up. Sub-steps keep `w h` below the world's
//! `substep_phase`, do not move a body by more than a part of its coat, and never get coarser while a contact lasts.

use super::springs;
use super::substep::{Island, Step};
use crate::base::Motion;
use crate::contact::candidate::{Candidate, Kept};
use crate::contact::deepest::{self, Approach};
use crate::contact::pair::{Pair, Side};
use crate::contact::stiffness::reachable;
use crate::math::Vec3;

/// Most of the thinner coat that two bodies may approach in one sub-step.
const TRAVEL: f64 = 0.25;

/// Depth at which a contact stops a body, over `v / w` with the rate `w` reached there: 1 for a linear spring, √3 for
/// two balls, whose force grows with the square of the depth.
const STOPPING: f64 = 1.75;

/// Sub-steps that an island's step of `dt` asks for, with `phase` the largest product of contact frequency and sub-step
/// \[rad\]. `rates` has a place for each link, all zero, and is left so.
pub fn plan(
    motions: &[Motion],
    island: &Island,
    candidates: &mut [Kept],
    dt: f64,
    phase: f64,
    rates: &mut [f64],
) -> f64 {
    let (mut travel, mut rate2) = (0.0f64, 0.0f64);
    for candidate in candidates.iter_mut() {
        candidate.pair.place(motions, candidate.lead);
        let (reached, crossed) = demand(&candidate.pair, motions, dt, |_| 0.0);
        candidate.memory.rate2 = if candidate.memory.touching { reached.max(candidate.memory.rate2) } else { reached };
        travel = travel.max(crossed);
        for link in links(&candidate.pair) {
            if motions[link as usize].is_movable() {
                rates[link as usize] += candidate.memory.rate2;
            }
        }
    }
    // Those that bounce off one may meet another in the same step: by then mostly out of the first.
    for candidate in candidates.iter_mut() {
        let Candidate { pair, memory, .. } = &mut **candidate;
        let thrown = |link: u32| {
            let others = rates[link as usize] > memory.rate2;
            if others { motions[link as usize].recoil } else { 0.0 }
        };
        if !memory.touching && links(pair).any(|link| thrown(link) > 0.0) {
            let (reached, crossed) = demand(pair, motions, dt, thrown);
            memory.rate2 = reached;
            (rate2, travel) = (rate2.max(reached), travel.max(crossed));
        }
    }
    springs::add_rates(&island.springs, motions, rates);
    for link in &island.links {
        rate2 = rate2.max(std::mem::take(&mut rates[*link as usize]));
    }
    (rate2.sqrt() * dt / phase).max(travel / TRAVEL).ceil().max(1.0)
}

/// Advances an island by `dt` in as many sub-steps as [`plan`] wants. Gives how many there were, and the time that is
/// left where an overload ended them.
pub fn step(step: &mut Step, dt: f64, substeps: u32) -> (u32, f64) {
    let h = dt / f64::from(substeps);
    let taken = (0..substeps).take_while(|index| step.advance(h, 0.5, *index == 0)).count() as u32;
    (taken, f64::from(substeps - taken) * h)
}

/// The links of a pair, each once.
fn links(pair: &Pair) -> impl Iterator<Item = u32> + '_ {
    let both = || pair.a.links.iter().chain(&pair.b.links);
    both()
        .enumerate()
        .filter(move |(index, link)| both().take(*index).all(|other| other != *link))
        .map(|(_, link)| *link)
}

/// Square of the largest rate that a pair can reach in a step, and how many times the thinner coat its skeletons may
/// approach each other, as fast as they do or as other contacts have `thrown` their links. Zeros for what will not meet.
fn demand(pair: &Pair, motions: &[Motion], dt: f64, thrown: impl Fn(u32) -> f64) -> (f64, f64) {
    let (mut rate2, mut crossed) = (0.0, 0.0f64);
    for i in 0..pair.a.skeletons.len() {
        for j in 0..pair.b.skeletons.len() {
            let approach = deepest::approach(pair, i, j);
            if pair.is_covered(&approach.meeting) {
                continue;
            }
            let overlap = pair.a.reach[i] + pair.b.reach[j] - approach.distance;
            let closing = closing_speed(pair, i, j, &approach, motions, dt);
            let speed = closing.max(thrown(pair.a.links[i]) + thrown(pair.b.links[j]));
            if overlap + speed * dt <= 0.0 {
                continue;
            }
            let thickness = pair.a.skeletons[i].profile.thickness.min(pair.b.skeletons[j].profile.thickness);
            crossed = crossed.max(speed * dt / thickness);
            let rate2_at = |overlap: f64| {
                let bound = reachable(pair, i, j, overlap);
                let mobility = |link: u32| {
                    let motion = &motions[link as usize];
                    let arm = approach.meeting - (motion.center - pair.origin);
                    // A patch below the centre of mass rocks apart from heaving: the faster of the two counts.
                    let heave =
                        motion.inverse_mass() + arm.cross(&approach.direction).norm_squared() * motion.inverse_moment();
                    heave.max(bound.gyration2 * motion.inverse_moment())
                };
                bound.stiffness * (mobility(pair.a.links[i]) + mobility(pair.b.links[j]))
            };
            // How deep the speed carries: v / w for a spring, a little more for one that stiffens as it gives. The
            // rate depends on the depth in turn; the iteration settles within a few per cent.
            let mut deepest = pair.a.reach[i] + pair.b.reach[j];
            for _ in 0..5 {
                let rate2 = rate2_at(deepest);
                deepest = overlap.max(0.0) + if rate2 > 0.0 { STOPPING * speed / rate2.sqrt() } else { 0.0 };
            }
            rate2 += rate2_at(deepest);
        }
    }
    (rate2, crossed)
}

/// How fast two skeletons come closer, at most, during a step.
fn closing_speed(pair: &Pair, i: usize, j: usize, approach: &Approach, motions: &[Motion], dt: f64) -> f64 {
    let (a, b) = (&motions[pair.a.links[i] as usize], &motions[pair.b.links[j] as usize]);
    let velocity = |motion: &Motion| motion.twist.at(&(approach.meeting - (motion.center - pair.origin)));
    let acceleration = |motion: &Motion| if motion.is_movable() { motion.acceleration } else { Vec3::zeros() };
    let speed = (velocity(a) - velocity(b)).dot(&approach.direction);
    let gain = (acceleration(a) - acceleration(b)).dot(&approach.direction).max(0.0);
    // The other end of a turning body may swing in before the step is over.
    let swing = |side: &Side, skeleton: usize, motion: &Motion| {
        let (low, high) = side.skeletons[skeleton].shape.bounds(0.0);
        let size = (high - low).norm();
        let turning = motion.twist.angular.cross(&approach.direction).norm();
        if size.is_finite() { turning * size } else { 0.0 }
    };
    (speed + gain * dt).max(0.0) + swing(&pair.a, i, a) + swing(&pair.b, j, b)
}
