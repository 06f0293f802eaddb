//! Implicit response: velocities and contact forces of a whole island that agree at the end of the step.
//!
//! Backward Euler with the contact surfaces evaluated at the end pose (docs/model.md, "Implicit response"). The
//! velocities start as they were, with what would carry bodies into each other taken away; then, in turn, the surfaces
//! are evaluated where the velocities lead, and all links are solved together for the forces there, linear in the
//! velocities ([`coupled`](super::coupled)). When the two do not agree after a few rounds, the step is taken in two
//! halves. Frozen at the first pose, stiff contacts would gain energy and rolling would be braked.

use super::coupled::{Coupled, Grip, Group, Member, Point, Push, put_twist, twist_of};
use super::envelope::{BLOCK, OrderBuffers, narrow_order};
use super::substep::{Island, PUSH_OUT, Work, bend_bristles, drift};
use crate::base::{Inertia, Motion};
use crate::clock::Clock;
use crate::contact::candidate::Candidate;
use crate::contact::pair::Pair;
use crate::contact::patch::Sums;
use crate::contact::press::{Carriers, friction_radius};
use crate::contact::stiffness::reachable;
use crate::contact::surface::Settings;
use crate::contact::{deepest, patch};
use crate::math::{Twist, Vec3, Wrench};
use crate::team::Team;

/// What the solver may spend.
#[derive(Clone, Copy, Debug)]
pub struct Effort {
    /// Most evaluations of a contact surface before the step is split.
    pub rounds: u32,
    /// Motion of a contact between two rounds, over its depth and its size, below which they agree.
    pub tolerance: f64,
    /// How often a step may be split in two halves.
    pub splits: u32,
}

/// Pairs that a worker places in one go.
const BLOCK_OF_PAIRS: usize = 16;

/// Sweeps that take the approach out of the first guess.
const SWEEPS: usize = 10;

/// Slip velocity up to which friction grows, in thicknesses of the thinner coat a second.
const CREEP: f64 = 0.01;

/// Slip over the creep velocity at which a bristle lets go: friction is then within 2% of its most.
const LET_GO: f64 = 5.0;

/// Part of a bristle's bend that is taken back in one step.
const RECOVERY: f64 = 0.2;

/// Stiffness of a wall, over what would take up a mass within a step.
const WALL: f64 = 1e3;

/// Part of the speeds of a step below which a change between two rounds does not matter.
const NEGLIGIBLE: f64 = 1e-4;

/// Working memory of the implicit response.
#[derive(Debug, Default)]
pub struct Solver {
    /// Links as they would be at the end of the step; a place for each slot.
    trial: Vec<Motion>,
    /// The island's links with unknowns, in the order of the system.
    order: Vec<u32>,
    graph: Graph,
    coupled: Coupled,
    free: Vec<f64>,
    x: Vec<f64>,
    rows: Vec<Row>,
    carriers: Carriers,
    /// The surfaces are frozen where they are.
    last_resort: bool,
    pushes: Vec<Push>,
    /// Rounds of the last step, all halves together.
    pub rounds: u32,
    /// Halvings of the last step.
    pub splits: u32,
}

#[derive(Debug, Default)]
struct Graph {
    nodes: Vec<u32>,
    edges: Vec<(u32, u32)>,
    order: Vec<u32>,
    buffers: OrderBuffers,
}

/// A direction in which two skeletons may not come closer than they are apart.
#[derive(Debug)]
struct Row {
    links: [u32; 2],
    arms: [Vec3; 2],
    normal: Vec3,
    /// Least velocity of b away from a \[m/s\].
    least: f64,
    impulse: f64,
}

/// Advances an island by `dt`.
#[expect(clippy::too_many_arguments, reason = "an island's step touches the whole state")]
pub fn step(
    motions: &mut [Motion],
    island: &Island,
    candidates: &mut [Candidate],
    dt: f64,
    settings: &Settings,
    effort: &Effort,
    solver: &mut Solver,
    work: &mut Work,
    team: &Team,
) {
    (solver.rounds, solver.splits) = (0, 0);
    if island.candidates.is_empty() {
        fly(motions, island, dt);
        return;
    }
    solver.trial.resize(motions.len(), Motion::default());
    solver.order_links(island, candidates, motions);
    halves(motions, island, candidates, dt, settings, effort, effort.splits, solver, work, team);
}

/// Moves links that nothing touches: exact under a steady acceleration, where backward Euler would lose energy.
fn fly(motions: &mut [Motion], island: &Island, h: f64) {
    drift(motions, island, 0.5 * h);
    for link in &island.links {
        motions[*link as usize].kick(h);
    }
    drift(motions, island, 0.5 * h);
}

/// Takes a step whole, or in two halves when it does not converge.
#[expect(clippy::too_many_arguments, reason = "an island's step touches the whole state")]
fn halves(
    motions: &mut [Motion],
    island: &Island,
    candidates: &mut [Candidate],
    dt: f64,
    settings: &Settings,
    effort: &Effort,
    splits: u32,
    solver: &mut Solver,
    work: &mut Work,
    team: &Team,
) {
    let last_resort = splits == 0;
    if solver.attempt(motions, island, candidates, dt, settings, effort, last_resort, work, team) {
        return;
    }
    solver.splits += 1;
    for _ in 0..2 {
        halves(motions, island, candidates, 0.5 * dt, settings, effort, splits - 1, solver, work, team);
    }
}

impl Solver {
    /// The links with unknowns, neighbours near each other.
    fn order_links(&mut self, island: &Island, candidates: &[Candidate], motions: &[Motion]) {
        let Graph { nodes, edges, order, buffers } = &mut self.graph;
        nodes.clear();
        nodes.extend(island.links.iter().filter(|link| motions[**link as usize].is_movable()));
        nodes.sort_unstable();
        edges.clear();
        for index in &island.candidates {
            let pair = &candidates[*index as usize].pair;
            let place = |link: &u32| nodes.binary_search(link).ok().map(|place| place as u32);
            for a in pair.a.links.iter().filter_map(place) {
                for b in pair.b.links.iter().filter_map(place) {
                    if a != b {
                        edges.push((a.min(b), a.max(b)));
                    }
                }
            }
        }
        edges.sort_unstable();
        edges.dedup();
        narrow_order(nodes.len(), edges, order, buffers);
        self.order.clear();
        self.order.extend(order.iter().map(|place| nodes[*place as usize]));
    }

    /// Tries a step. Unless it is the `last_resort`, nothing is changed when it fails.
    #[expect(clippy::too_many_arguments, reason = "an island's step touches the whole state")]
    fn attempt(
        &mut self,
        motions: &mut [Motion],
        island: &Island,
        candidates: &mut [Candidate],
        h: f64,
        settings: &Settings,
        effort: &Effort,
        last_resort: bool,
        work: &mut Work,
        team: &Team,
    ) -> bool {
        self.coupled.set_links(&self.order, motions);
        self.free.clear();
        self.free.resize(self.order.len() * BLOCK, 0.0);
        for (block, link) in self.order.iter().enumerate() {
            let motion = &motions[*link as usize];
            let twist = Twist {
                linear: motion.twist.linear + motion.acceleration * h,
                angular: motion.twist.angular + motion.angular_acceleration * h,
            };
            put_twist(&mut self.free, block as u32, &twist);
        }
        let mut clock = Clock::start(work.timed);
        self.first_guess(motions, island, candidates, h, team);
        clock.lap(&mut work.solve_time);
        let mut converged = false;
        for _ in 0..effort.rounds {
            self.rounds += 1;
            self.look(motions, island, candidates, h, settings, work, team);
            clock.lap(&mut work.contact_time);
            self.couple_all(motions, island, candidates, h);
            let solved = self.coupled.solve(&mut self.x, &self.free, motions, h, team);
            converged = solved && self.agrees(motions, candidates, h, effort.tolerance);
            clock.lap(&mut work.solve_time);
            if !solved || converged {
                break;
            }
        }
        if !converged {
            if !last_resort {
                return false;
            }
            // One solve with the surfaces as they are now: what moves on is small in so short a step, and no gap closes.
            self.x.fill(0.0);
            self.look(motions, island, candidates, h, settings, work, team);
            clock.lap(&mut work.contact_time);
            self.last_resort = true;
            self.couple_all(motions, island, candidates, h);
            self.last_resort = false;
            self.coupled.solve(&mut self.x, &self.free, motions, h, team);
        }
        self.commit(motions, island, candidates, h);
        clock.lap(&mut work.solve_time);
        true
    }

    /// The velocities at the start of the step, without what would carry bodies into each other.
    fn first_guess(&mut self, motions: &[Motion], island: &Island, candidates: &mut [Candidate], h: f64, team: &Team) {
        for link in &island.links {
            self.trial[*link as usize] = motions[*link as usize];
        }
        self.rows.clear();
        team.each_at(candidates, &island.candidates, BLOCK_OF_PAIRS, |candidate| {
            candidate.pair.place(motions, candidate.lead);
        });
        for index in &island.candidates {
            let pair = &candidates[*index as usize].pair;
            // Those that move are the island's, and there already.
            for link in pair.a.links.iter().chain(&pair.b.links) {
                if !motions[*link as usize].is_movable() {
                    self.trial[*link as usize] = motions[*link as usize];
                }
            }
            for (i, j) in combinations(pair) {
                let approach = deepest::approach(pair, i, j);
                let links = [pair.a.links[i], pair.b.links[j]];
                let arms = links.map(|link| approach.meeting - (motions[link as usize].center - pair.origin));
                let gap = approach.distance - thicknesses(pair, i, j);
                self.rows.push(Row { links, arms, normal: approach.direction, least: -gap.max(0.0) / h, impulse: 0.0 });
            }
        }
        for _ in 0..SWEEPS {
            let mut changed = false;
            for row in &mut self.rows {
                let [a, b] = row.links.map(|link| &self.trial[link as usize]);
                let parting = (b.twist.at(&row.arms[1]) - a.twist.at(&row.arms[0])).dot(&row.normal);
                let mobility = a.mobility(&row.arms[0], &row.normal) + b.mobility(&row.arms[1], &row.normal);
                if mobility <= 0.0 {
                    continue;
                }
                let impulse = (row.impulse + (row.least - parting) / mobility).max(0.0);
                let push = row.normal * (impulse - row.impulse);
                changed |= impulse != row.impulse;
                row.impulse = impulse;
                for (side, sign) in [(0, -1.0), (1, 1.0)] {
                    let motion = &mut self.trial[row.links[side] as usize];
                    let mut wrench = Wrench::default();
                    wrench.add_force_at(&(push * sign), &row.arms[side]);
                    let change = motion.answer(&wrench);
                    motion.twist.linear += change.linear;
                    motion.twist.angular += change.angular;
                }
            }
            if !changed {
                break;
            }
        }
        self.x.clear();
        self.x.resize(self.order.len() * BLOCK, 0.0);
        for (block, link) in self.order.iter().enumerate() {
            let (now, guess) = (&motions[*link as usize].twist, &self.trial[*link as usize].twist);
            let free = twist_of(&self.free, block as u32);
            // Where contacts hold a link nearly as it is, it will be held as it is: what the sweeps left is no motion.
            let held = (guess.linear - now.linear).norm() < 0.5 * (free.linear - now.linear).norm();
            put_twist(&mut self.x, block as u32, if held { now } else { guess });
        }
    }

    /// Evaluates the contacts where the velocities lead.
    #[expect(clippy::too_many_arguments, reason = "an island's step touches the whole state")]
    fn look(
        &mut self,
        motions: &[Motion],
        island: &Island,
        candidates: &mut [Candidate],
        h: f64,
        settings: &Settings,
        work: &mut Work,
        team: &Team,
    ) {
        for link in &island.links {
            self.trial[*link as usize] = motions[*link as usize];
        }
        for (block, link) in self.order.iter().enumerate() {
            self.trial[*link as usize].twist = twist_of(&self.x, block as u32);
        }
        drift(&mut self.trial, island, h);
        work.look(&self.trial, island, candidates, settings, true, team);
    }

    /// Puts the contact surfaces into the system.
    fn couple_all(&mut self, motions: &[Motion], island: &Island, candidates: &[Candidate], h: f64) {
        self.coupled.clear();
        for index in &island.candidates {
            self.couple(&candidates[*index as usize], *index, h);
        }
        for index in 0..self.coupled.groups.len() {
            let group = self.coupled.groups[index];
            self.coupled.groups[index].base = self.coupled.relative_of(&group, &self.x, motions);
        }
    }

    /// Puts a candidate's contact surface into the system.
    fn couple(&mut self, candidate: &Candidate, index: u32, h: f64) {
        let Candidate { pair, surface, .. } = candidate;
        let single = pair.a.only_link().is_some() && pair.b.only_link().is_some();
        for (number, patch) in surface.patches.iter().enumerate() {
            let nodes = &surface.nodes[patch.nodes.0..patch.nodes.1];
            let sums = patch::sum(nodes);
            if sums.force == Vec3::zeros() {
                continue;
            }
            let grip = self.grip(candidate, patch, &sums, nodes, h);
            let members = single.then(|| self.members(pair, &sums.center));
            let first = self.coupled.points.len();
            for node in nodes {
                let load = node.force.norm();
                if load <= 0.0 {
                    continue;
                }
                let begin = self.coupled.points.len();
                let center = if single { sums.center } else { node.position };
                self.coupled.points.push(Point {
                    arm: node.position - center,
                    normal: node.force / load,
                    load,
                    stiffness: node.stiffness,
                    area: node.area,
                });
                if !single {
                    let members = self.members(pair, &node.position);
                    let mut grip = grip;
                    grip.slip += grip.spin.cross(&(node.position - sums.center));
                    self.add_group(index, Some(number), center, (begin, begin + 1), members, candidate, grip);
                }
            }
            if let Some(members) = members {
                let points = (first, self.coupled.points.len());
                self.add_group(index, Some(number), sums.center, points, members, candidate, grip);
            }
        }
        // What must come apart, from where the step began.
        for (i, j, approach) in &surface.overloads {
            self.carriers.find(pair, &approach.meeting);
            let come = self.closing(pair, approach) * h;
            self.add_wall(candidate, index, [*i, *j], approach, -PUSH_OUT * thinner(pair, *i, *j) * h - come, h);
        }
        if !surface.overloads.is_empty() {
            return;
        }
        for (i, j) in combinations(pair) {
            let approach = deepest::approach(pair, i, j);
            let gap = approach.distance - thicknesses(pair, i, j);
            if self.last_resort {
                // Nothing comes deeper than a coat bears, whatever its speed.
                self.add_wall(candidate, index, [i, j], &approach, (gap + 0.5 * thinner(pair, i, j)).max(0.0), h);
            } else if surface.patches.is_empty() {
                // A gap that may close, so that the next round starts from a shallow touch; one without depth has no
                // patch yet.
                self.add_gap(candidate, index, [i, j], &approach, gap.max(0.0));
            }
        }
    }

    /// Dry friction of a patch.
    fn grip(&self, candidate: &Candidate, patch: &patch::Patch, sums: &Sums, nodes: &[patch::Node], h: f64) -> Grip {
        let Candidate { pair, material, memory, .. } = candidate;
        if material.friction <= 0.0 && material.static_friction <= 0.0 {
            return Grip::default();
        }
        let [i, j] = patch.skeletons;
        let thickness = thinner(pair, i, j);
        let key = [pair.a.ids[i], pair.b.ids[j]];
        let mut grip = Grip {
            coefficient: material.friction,
            creep: CREEP * thickness,
            radius: if nodes.len() == 1 { friction_radius(nodes, sums) } else { 0.0 },
            ..Grip::default()
        };
        if material.static_friction > 0.0 {
            let bristle = memory.bristles.iter().find(|bristle| bristle.key == key);
            if bristle.is_none_or(|bristle| !bristle.sliding) {
                grip.coefficient = material.static_friction;
            }
            if let Some(bristle) = bristle {
                grip.slip = bristle.slip * (-RECOVERY / h);
                grip.spin = sums.force.normalize() * (bristle.turn * (-RECOVERY / h));
            }
        }
        grip
    }

    /// The links that carry a point; gives their range.
    fn members(&mut self, pair: &Pair, position: &Vec3) -> (usize, usize) {
        let first = self.coupled.members.len();
        self.carriers.find(pair, position);
        for (shares, sign) in [(&self.carriers.a, -1.0), (&self.carriers.b, 1.0)] {
            for share in shares {
                let motion = &self.trial[share.link as usize];
                self.coupled.members.push(Member {
                    link: share.link,
                    weight: sign * share.weight,
                    arm: position - (motion.center - pair.origin),
                    turns: !matches!(motion.inertia, Inertia::Point { .. }),
                });
            }
        }
        (first, self.coupled.members.len())
    }

    #[expect(clippy::too_many_arguments, reason = "a group has this many parts")]
    fn add_group(
        &mut self,
        index: u32,
        patch: Option<usize>,
        center: Vec3,
        points: (usize, usize),
        members: (usize, usize),
        candidate: &Candidate,
        grip: Grip,
    ) {
        self.coupled.groups.push(Group {
            candidate: index,
            patch: patch.map(|patch| patch as u32),
            center,
            points,
            members,
            material: if patch.is_some() { candidate.material } else { Default::default() },
            grip,
            base: Twist::default(),
        });
    }

    /// A gap that pushes once the velocities close it, as softly as a shallow contact would.
    fn add_gap(
        &mut self,
        candidate: &Candidate,
        index: u32,
        [i, j]: [usize; 2],
        approach: &deepest::Approach,
        gap: f64,
    ) {
        let stiffness = reachable(&candidate.pair, i, j, 0.1 * thinner(&candidate.pair, i, j)).stiffness;
        self.add_lone(candidate, index, approach, -stiffness * gap, stiffness);
    }

    /// A wall beyond which two skeletons come no closer than `room` metres from where they are; negative room parts them.
    fn add_wall(
        &mut self,
        candidate: &Candidate,
        index: u32,
        [i, j]: [usize; 2],
        approach: &deepest::Approach,
        room: f64,
        h: f64,
    ) {
        let pair = &candidate.pair;
        self.carriers.find(pair, &approach.meeting);
        let mobility = self.carriers.mobility(&self.trial, &pair.origin, &approach.meeting);
        let along = approach.direction.dot(&(mobility * approach.direction));
        if along > 0.0 {
            let stiffness = (WALL / (along * h * h)).max(reachable(pair, i, j, f64::INFINITY).stiffness);
            self.add_lone(candidate, index, approach, -stiffness * room, stiffness);
        }
    }

    /// How fast b comes towards a where two skeletons are closest, at the trial's velocities.
    fn closing(&self, pair: &Pair, approach: &deepest::Approach) -> f64 {
        -self.carriers.slip(&self.trial, &pair.origin, &approach.meeting).dot(&approach.direction)
    }

    fn add_lone(&mut self, candidate: &Candidate, index: u32, approach: &deepest::Approach, load: f64, stiffness: f64) {
        let first = self.coupled.points.len();
        self.coupled.points.push(Point { arm: Vec3::zeros(), normal: approach.direction, load, stiffness, area: 0.0 });
        let members = self.members(&candidate.pair, &approach.meeting);
        self.add_group(index, None, approach.meeting, (first, first + 1), members, candidate, Grip::default());
    }

    /// Whether the contacts moved so little since they were evaluated that they are still what they were.
    fn agrees(&self, motions: &[Motion], candidates: &[Candidate], h: f64, tolerance: f64) -> bool {
        self.coupled.groups.iter().all(|group| {
            let now = self.coupled.relative_of(group, &self.x, motions);
            let change = Twist { linear: now.linear - group.base.linear, angular: now.angular - group.base.angular };
            let pair = &candidates[group.candidate as usize];
            let speed = self.speed(group, motions, h);
            let Some(patch) = group.patch else {
                // A wall or a gap is exact, until it begins to push where it did not.
                let point = &self.coupled.points[group.points.0];
                let closed = point.load - h * point.stiffness * point.normal.dot(&change.linear);
                return point.load > 0.0 || closed <= 0.0 || change.linear.norm() <= NEGLIGIBLE * speed;
            };
            let patch = &pair.surface.patches[patch as usize];
            let depth = patch.peak_pressure / pair.pair.scale / patch.slope;
            let size = self.size(group).max(depth);
            let moved = change.linear.norm() + change.angular.norm() * size;
            if moved <= NEGLIGIBLE * speed {
                return true;
            }
            let along = change.linear - patch.normal * change.linear.dot(&patch.normal);
            let across = change.linear.dot(&patch.normal).abs() + change.angular.norm() * size;
            h * across <= tolerance * depth && h * along.norm() <= tolerance * size
        })
    }

    /// Half the width of a group's patch.
    fn size(&self, group: &Group) -> f64 {
        let points = &self.coupled.points[group.points.0..group.points.1];
        (points.iter().map(|point| point.area).sum::<f64>() / std::f64::consts::PI).sqrt()
    }

    /// The speeds that are at work in a group in this step.
    fn speed(&self, group: &Group, motions: &[Motion], h: f64) -> f64 {
        let members = &self.coupled.members[group.members.0..group.members.1];
        let speed = |member: &Member| {
            let motion = &motions[member.link as usize];
            motion.acceleration.norm() * h + NEGLIGIBLE * motion.twist.at(&member.arm).norm()
        };
        members.iter().map(speed).sum()
    }

    /// Moves the links by the velocities found, and hands every contact its forces.
    fn commit(&mut self, motions: &mut [Motion], island: &Island, candidates: &mut [Candidate], h: f64) {
        for index in &island.candidates {
            let candidate = &mut candidates[*index as usize];
            candidate.loads.clear();
            candidate.loads.resize(candidate.surface.patches.len(), Sums::default());
            if !candidate.surface.overloads.is_empty() {
                candidate.memory.overloaded = true;
                candidate.memory.touched = true;
            }
        }
        self.pushes.clear();
        for group in &self.coupled.groups {
            self.pushes.push(self.coupled.push(group, &self.x, &self.trial, h));
        }
        if self.pushes.iter().all(|push| push.all == Wrench::default()) {
            fly(motions, island, h);
            return;
        }
        for link in &island.links {
            motions[*link as usize].kick(h);
        }
        for (group, push) in self.coupled.groups.iter().zip(&self.pushes) {
            for member in &self.coupled.members[group.members.0..group.members.1] {
                let force = push.all.force * (h * member.weight);
                let torque = push.all.torque * (h * member.weight) + member.arm.cross(&force);
                if push.all.force != Vec3::zeros() {
                    motions[member.link as usize].push(&Wrench { force, torque });
                }
            }
        }
        let same = |a: &Group, b: &Group| (a.candidate, a.patch) == (b.candidate, b.patch);
        let mut first = 0;
        for groups in self.coupled.groups.chunk_by(same) {
            let pushes = &self.pushes[first..first + groups.len()];
            first += groups.len();
            let Some(patch) = groups[0].patch else { continue };
            let candidate = &mut candidates[groups[0].candidate as usize];
            let sums = patch_sums(groups, pushes, &self.coupled.points);
            candidate.memory.touched |= sums.force != Vec3::zeros();
            candidate.loads[patch as usize] = sums;
        }
        drift(motions, island, h);
        for index in &island.candidates {
            let candidate = &mut candidates[*index as usize];
            if candidate.material.static_friction > 0.0 {
                bend_bristles(candidate, motions, h, &mut self.carriers);
                self.let_go(candidate, motions, h);
            }
        }
    }

    /// Bristles of patches that slide bend no further.
    fn let_go(&mut self, candidate: &mut Candidate, motions: &[Motion], h: f64) {
        let Candidate { pair, surface, loads, memory, .. } = candidate;
        for (patch, load) in surface.patches.iter().zip(loads.iter()) {
            if load.force == Vec3::zeros() {
                continue;
            }
            let [i, j] = patch.skeletons;
            let key = [pair.a.ids[i], pair.b.ids[j]];
            let Some(bristle) = memory.bristles.iter_mut().find(|bristle| bristle.key == key) else { continue };
            let thickness = thinner(pair, i, j);
            self.carriers.find(pair, &load.center);
            let normal = load.force.normalize();
            let slip = self.carriers.slip(motions, &pair.origin, &load.center);
            let slip = slip - normal * slip.dot(&normal);
            let wanted = slip + bristle.slip * (RECOVERY / h);
            bristle.sliding = wanted.norm() > LET_GO * CREEP * thickness;
            if bristle.sliding {
                (bristle.slip, bristle.turn) = (Vec3::zeros(), 0.0);
            }
        }
    }
}

/// What the groups of one patch come to, about their common centre of pressure.
fn patch_sums(groups: &[Group], pushes: &[Push], points: &[Point]) -> Sums {
    let mut sums = Sums::default();
    let mut load = 0.0;
    for (group, push) in groups.iter().zip(pushes) {
        let size = push.pressing.force.norm();
        sums.center += group.center * size;
        load += size;
        sums.force += push.pressing.force;
        for point in &points[group.points.0..group.points.1] {
            sums.area += point.area;
            sums.stiffness += point.stiffness;
        }
    }
    if load > 0.0 {
        sums.center /= load;
    }
    for (group, push) in groups.iter().zip(pushes) {
        sums.torque += push.pressing.torque + (group.center - sums.center).cross(&push.pressing.force);
    }
    sums
}

/// All pairs of skeletons of a pair.
fn combinations(pair: &Pair) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (a, b) = (pair.a.skeletons.len(), pair.b.skeletons.len());
    (0..a).flat_map(move |i| (0..b).map(move |j| (i, j)))
}

fn thinner(pair: &Pair, i: usize, j: usize) -> f64 {
    pair.a.skeletons[i].profile.thickness.min(pair.b.skeletons[j].profile.thickness)
}

fn thicknesses(pair: &Pair, i: usize, j: usize) -> f64 {
    pair.a.skeletons[i].profile.thickness + pair.b.skeletons[j].profile.thickness
}
