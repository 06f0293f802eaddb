//! One sub-step: drift, evaluate the contact surfaces, kick, drift. Symplectic, of second order, with one evaluation.

use super::springs;
use crate::base::{Articulation, Motion, Spring};
use crate::clock::Clock;
use crate::contact::candidate::{Candidate, Kept};
use crate::contact::friction;
use crate::contact::patch;
use crate::contact::press::{Carriers, Grip, friction_radius, press};
use crate::contact::surface::Settings;
use crate::contact::tally::Tally;
use crate::math::Vec3;
use crate::team::Team;

/// Bodies that are stepped together.
#[derive(Clone, Debug, Default)]
pub struct Island {
    /// Slots of the links that move, each once.
    pub links: Vec<u32>,
    /// Springs between the links.
    pub springs: Vec<Spring>,
    /// Positions in a list of articulations; none where each link is taken by itself.
    pub articulations: Vec<u32>,
}

/// Candidates that a worker looks at in one go.
const BLOCK: usize = 4;

/// A step of an island: what moves, what is known of its contacts, and who works at it.
pub struct Step<'a> {
    /// All links, by slot.
    pub motions: &'a mut [Motion],
    /// Who is stepped.
    pub island: &'a Island,
    /// Their candidates.
    pub candidates: &'a mut [Kept],
    /// Which links the host's joints hold together.
    pub articulations: &'a [Articulation],
    /// How contact surfaces are integrated.
    pub settings: &'a Settings,
    /// Working memory.
    pub work: &'a mut Work,
    /// Who helps.
    pub team: &'a Team<'a>,
}

/// Working memory of a sub-step.
#[derive(Debug, Default)]
pub struct Work {
    grips: Vec<Grip>,
    carriers: Carriers,
    forces: Vec<Vec3>,
    /// What the contact surfaces took since it was last cleared.
    pub tally: Tally,
    /// Whether anybody wants to know the times.
    pub timed: bool,
    /// Time with contact surfaces since it was last cleared \[s\].
    pub contact_time: f64,
    /// Time with what follows from them \[s\].
    pub solve_time: f64,
}

impl Work {
    /// Brings contact surfaces up to the present poses, each by `look`.
    pub fn look(&mut self, candidates: &mut [Kept], team: &Team, look: impl Fn(&mut Candidate) + Sync) {
        team.each_mut(candidates, BLOCK, |_, candidate| look(candidate));
        for candidate in candidates.iter().filter(|candidate| candidate.fresh) {
            self.tally.add(&candidate.surface);
        }
    }
}

impl<'a> Step<'a> {
    /// The articulations of the island.
    pub fn articulations_of_island(&self) -> impl Iterator<Item = &'a Articulation> + Clone + use<'a> {
        let (island, articulations) = (self.island, self.articulations);
        island.articulations.iter().map(|index| &articulations[*index as usize])
    }

    /// Advances by `h`, with the part `before` of the drift before the kick: a half for the symplectic second order, none
    /// for the force at the pose of the beginning. With `fresh`, all contact surfaces are integrated anew.
    ///
    /// Where a contact is past the most that it carries, no force would part the bodies: false then, and everybody is
    /// back where he was, but for rounding.
    pub fn advance(&mut self, h: f64, before: f64, fresh: bool) -> bool {
        let Self { motions, island, candidates, settings, work, team, .. } = self;
        drift(motions, island, before * h);
        let mut clock = Clock::start(work.timed);
        let motions = &mut **motions;
        work.look(candidates, team, |candidate| candidate.look(motions, settings, fresh));
        clock.lap(&mut work.contact_time);
        let mut overloaded = false;
        for candidate in candidates.iter_mut() {
            let Candidate { surface, memory, .. } = &mut **candidate;
            if !surface.overloads.is_empty() {
                (memory.overloaded, memory.touched, overloaded) = (true, true, true);
            }
        }
        if overloaded {
            drift(motions, island, -before * h);
            return false;
        }
        for candidate in candidates.iter_mut().filter(|candidate| candidate.material.static_friction > 0.0) {
            bend_bristles(candidate, motions, h, &mut work.carriers);
        }
        springs::damp(island.springs.iter(), motions, 0.5 * h);
        for link in &island.links {
            motions[*link as usize].kick(h);
        }
        springs::kick(&island.springs, motions, h);
        work.grips.clear();
        for (index, candidate) in candidates.iter_mut().enumerate() {
            press_candidate(candidate, index, motions, h, work);
        }
        rub(candidates, motions, h, work);
        springs::damp(island.springs.iter().rev(), motions, 0.5 * h);
        drift(motions, island, (1.0 - before) * h);
        clock.lap(&mut work.solve_time);
        true
    }
}

pub(super) fn drift(motions: &mut [Motion], island: &Island, h: f64) {
    if h != 0.0 {
        for link in &island.links {
            motions[*link as usize].drift(h);
        }
    }
}

pub(super) fn bend_bristles(candidate: &mut Candidate, motions: &[Motion], h: f64, carriers: &mut Carriers) {
    let Candidate { pair, surface, nodes, memory, .. } = candidate;
    for bristle in &mut memory.bristles {
        bristle.seen = false;
    }
    for patch in surface.patches.iter().filter(|patch| !patch.overloaded) {
        let sums = patch::sum(&nodes[patch.nodes.0..patch.nodes.1]);
        let size = sums.force.norm();
        if size > 0.0 {
            let normal = sums.force / size;
            carriers.find(pair, &sums.center);
            let place = friction::Place { key: patch.key(pair), position: sums.center, normal };
            friction::bend(&mut memory.bristles, &place, carriers, motions, &pair.origin, h);
        }
    }
    memory.bristles.retain(|bristle| bristle.seen);
}

fn press_candidate(candidate: &mut Candidate, index: usize, motions: &mut [Motion], h: f64, work: &mut Work) {
    let Candidate { pair, surface, nodes, material, memory, loads, .. } = candidate;
    loads.clear();
    for patch in &surface.patches {
        let nodes = &nodes[patch.nodes.0..patch.nodes.1];
        let pressed = press(pair, nodes, material, h, motions, &mut work.carriers, &mut work.forces);
        let Some(sums) = pressed else {
            loads.push(patch::Sums::default());
            continue;
        };
        loads.push(sums);
        memory.touched = true;
        let load = sums.force.norm();
        if load > 0.0 && (material.friction > 0.0 || material.static_friction > 0.0) {
            work.grips.push(Grip {
                candidate: index,
                key: patch.key(pair),
                position: sums.center,
                normal: sums.force / load,
                load,
                radius: friction_radius(nodes, &sums),
            });
        }
    }
}

fn rub(candidates: &mut [Kept], motions: &mut [Motion], h: f64, work: &mut Work) {
    for grip in &work.grips {
        let Candidate { pair, material, memory, .. } = &mut *candidates[grip.candidate];
        work.carriers.find(pair, &grip.position);
        let bristle = memory.bristles.iter_mut().find(|bristle| bristle.key == grip.key);
        friction::rub(grip, material, bristle, h, &work.carriers, motions, &pair.origin);
    }
}
