//! Islands: bodies that touch, directly or through others that can move.

use super::World;
use super::step::Stepping;
use crate::base::{Articulation, Kind};
use crate::contact::candidate::Kept;
use crate::math::{Quat, Vec3, Wrench};
use crate::response::Response;
use crate::response::substep::Island;

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

impl World {
    /// Islands: bodies that touch, directly or through others that can move.
    pub(super) fn group(&self, state: &mut Stepping) {
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
}
