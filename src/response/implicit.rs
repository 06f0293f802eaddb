//! Implicit response: velocities, contact forces and springs of a whole island that agree at the end of the step.
//!
//! Backward Euler with the contact surfaces evaluated at the end pose (docs/model.md, "Implicit response"). The
//! velocities start as they were, with what would carry bodies into each other taken away; then, in turn, the surfaces
//! are evaluated where the velocities lead, and all links are solved together for the forces there, linear in the
//! velocities ([`coupled`](super::coupled)). When the two do not agree after a few rounds, the step is taken in two
//! halves. Frozen at the first pose, stiff contacts would gain energy and rolling would be braked.

use super::bundle::{Bundle, Part};
use super::coupled::{Coupled, Problem, put_twist, twist_of};
use super::envelope::{BLOCK, OrderBuffers, narrow_order};
use super::group::{Group, Member, Source};
use super::grouping::{CREEP, Grouping, RECOVERY, combinations, thicknesses, thinner};
use super::springs::{self, Tie};
use super::substep::{Island, Step, bend_bristles, drift};
use crate::base::Motion;
use crate::clock::Clock;
use crate::contact::candidate::{Candidate, Kept};
use crate::contact::deepest;
use crate::contact::pair::Pair;
use crate::contact::patch::Sums;
use crate::contact::press::Carriers;
use crate::contact::surface::Surface;
use crate::math::{Twist, Vec3, Wrench};
use std::sync::atomic::{AtomicBool, Ordering};

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

/// Candidates that a worker takes in one go, and springs.
const TOGETHER: usize = 8;
const SPRINGS_TOGETHER: usize = 32;

/// Velocity that a round may leave unsolved, over the velocity at work and the motion that it may leave unseen.
const ACCURACY: f64 = 2e-5;

/// How much faster a link may get in a step than any is before it, or differ from its free motion, by guess.
const RUSH: f64 = 4.0;

/// Approach in a step, over the thickness of the coats, that may stay in the first guess.
const SLIGHT: f64 = 1e-3;

/// Sweeps that take the approach out of the first guess.
const SWEEPS: usize = 10;

/// Slip over the creep velocity at which a bristle lets go: friction is then within 2% of its most.
const LET_GO: f64 = 5.0;

/// Part of the speeds of a step below which a change between two rounds does not matter.
const NEGLIGIBLE: f64 = 1e-4;

/// Part of their stiffness that contacts keep where the last resort cannot be solved: nobody tells stiffer ones apart in
/// so short a step. And how often; then nothing is pushed.
const SOFTENING: f64 = 0.01;
const MOST_SOFTENINGS: u32 = 4;

/// Working memory of the implicit response.
#[derive(Debug, Default)]
pub struct Solver {
    /// Links as they would be at the end of the step; a place for each slot.
    trial: Vec<Motion>,
    graph: Graph,
    coupled: Coupled,
    /// The velocities at the start of the step, those at its end without contact, and those that are sought.
    start: Vec<f64>,
    free: Vec<f64>,
    x: Vec<f64>,
    /// Where the surfaces were evaluated.
    looked: Vec<f64>,
    nearby: Vec<Nearby>,
    rows: Vec<Row>,
    /// The longest arm of a contact \[m\].
    arm: f64,
    /// How far apart two skeletons are that nothing in the round can bring together \[m\].
    reach: f64,
    /// Impulses that the links of articulations had before, articulation by articulation.
    before: Vec<Wrench>,
    /// Rounds of the last step, all halves together.
    pub rounds: u32,
    /// Halvings of the last step.
    pub splits: u32,
}

#[derive(Debug, Default)]
struct Graph {
    /// The island's links with unknowns, in the order of the system.
    nodes: Vec<u32>,
    /// Of each link among the nodes, by slot.
    places: Vec<Option<u32>>,
    edges: Vec<(u32, u32)>,
    order: Vec<u32>,
    buffers: OrderBuffers,
}

/// A direction in which two skeletons may not come closer than they are apart.
#[derive(Clone, Copy, Debug)]
struct Row {
    links: [u32; 2],
    arms: [Vec3; 2],
    normal: Vec3,
    /// Least velocity of b away from a \[m/s\].
    least: f64,
    mobility: f64,
    impulse: f64,
}

impl Row {
    /// Velocities of both links there.
    fn velocities(&self, links: &[Motion]) -> [Vec3; 2] {
        [0, 1].map(|side| links[self.links[side] as usize].twist.at(&self.arms[side]))
    }
}

/// Rows of some candidates.
#[derive(Debug, Default)]
struct Nearby {
    rows: Vec<Row>,
    /// The highest speed at their ends, and their longest arm.
    fastest: f64,
    arm: f64,
    /// Some come closer than they may.
    close: bool,
}

impl Nearby {
    fn add(&mut self, pair: &Pair, motions: &[Motion], h: f64) {
        for (i, j) in combinations(pair) {
            let approach = deepest::approach(pair, i, j);
            if pair.is_covered(&approach.meeting) {
                continue;
            }
            let links = [pair.a.links[i], pair.b.links[j]];
            let arms = links.map(|link| approach.meeting - (motions[link as usize].center - pair.origin));
            let thickness = thicknesses(pair, i, j);
            let gap = approach.distance - thickness;
            let (least, mobility, impulse) = (-gap.max(0.0) / h, 0.0, 0.0);
            let row = Row { links, arms, normal: approach.direction, least, mobility, impulse };
            let velocities = row.velocities(motions);
            for (velocity, arm) in velocities.iter().zip(&row.arms) {
                self.fastest = self.fastest.max(velocity.norm());
                self.arm = self.arm.max(arm.norm());
            }
            let parting = (velocities[1] - velocities[0]).dot(&row.normal);
            self.close |= (least - parting) * h > SLIGHT * thickness;
            self.rows.push(row);
        }
    }
}

/// Advances an island by `dt`.
pub fn step(step: &mut Step, dt: f64, effort: &Effort, solver: &mut Solver) {
    (solver.rounds, solver.splits) = (0, 0);
    if step.candidates.is_empty() && step.island.springs.is_empty() {
        fly(step.motions, step.island, dt);
        return;
    }
    solver.trial.resize(step.motions.len(), Motion::default());
    solver.order_links(step);
    halves(step, dt, effort, effort.splits, solver);
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
fn halves(step: &mut Step, dt: f64, effort: &Effort, splits: u32, solver: &mut Solver) {
    if solver.attempt(step, dt, effort, splits == 0) {
        return;
    }
    solver.splits += 1;
    for _ in 0..2 {
        halves(step, 0.5 * dt, effort, splits - 1, solver);
    }
}

impl Solver {
    /// The links with unknowns, and the order in which neighbours are near each other. Those that contacts touch and do not
    /// move are the same throughout the step.
    fn order_links(&mut self, step: &Step) {
        let Step { island, candidates, motions, .. } = step;
        let Graph { nodes, places, edges, order, buffers } = &mut self.graph;
        // An island may be small, and the world large.
        for link in nodes.drain(..) {
            places[link as usize] = None;
        }
        nodes.extend(island.links.iter().filter(|link| motions[**link as usize].is_movable()));
        nodes.sort_unstable();
        places.resize(motions.len().max(places.len()), None);
        for (place, link) in nodes.iter().enumerate() {
            places[*link as usize] = Some(place as u32);
        }
        let place = |link: &u32| places[*link as usize];
        edges.clear();
        for candidate in candidates.iter() {
            let Pair { a, b, .. } = &candidate.pair;
            for a in a.links.iter().filter_map(place) {
                edges.extend(b.links.iter().filter_map(place).filter(|b| a != *b).map(|b| (a.min(b), a.max(b))));
            }
            let covers = candidate.pair.covers.iter().map(|cover| &cover.link);
            for link in a.links.iter().chain(&b.links).chain(covers).filter(|link| place(link).is_none()) {
                self.trial[*link as usize] = motions[*link as usize];
            }
        }
        for [a, b] in island.springs.iter().map(|spring| spring.links) {
            if let (Some(a), Some(b)) = (place(&a), place(&b)) {
                edges.push((a.min(b), a.max(b)));
            }
        }
        for articulation in step.articulations_of_island() {
            let places = || articulation.links.iter().filter_map(place);
            edges.extend(places().flat_map(|a| places().filter(move |b| a < *b).map(move |b| (a, b))));
        }
        edges.sort_unstable();
        edges.dedup();
        narrow_order(nodes.len(), edges, order, buffers);
        self.coupled.joined.set(nodes, step.articulations_of_island());
    }

    /// Tries a step. Unless it is the `last_resort`, nothing is changed when it fails.
    fn attempt(&mut self, step: &mut Step, h: f64, effort: &Effort, last_resort: bool) -> bool {
        self.coupled.set_links(&self.graph.nodes, &self.graph.order, step.motions, step.team);
        for twists in [&mut self.start, &mut self.free] {
            twists.clear();
            twists.resize(self.graph.nodes.len() * BLOCK, 0.0);
        }
        for (block, link) in self.graph.nodes.iter().enumerate() {
            let motion = &step.motions[*link as usize];
            let twist = Twist {
                linear: motion.twist.linear + motion.acceleration * h,
                angular: motion.twist.angular + motion.angular_acceleration * h,
            };
            put_twist(&mut self.start, block as u32, &motion.twist);
            put_twist(&mut self.free, block as u32, &twist);
        }
        let mut clock = Clock::start(step.work.timed);
        self.first_guess(step, h);
        clock.lap(&mut step.work.solve_time);
        // Nearly all that contacts can do is to take away what makes the free motion differ.
        self.reach = RUSH * h * self.change(&self.free);
        let nobody_near = step.candidates.is_empty();
        let (mut converged, mut overloaded) = (false, false);
        for round in 0..effort.rounds {
            self.rounds += 1;
            self.look(step, h, round == 0);
            if round == 0 {
                overloaded = step.candidates.iter().any(|candidate| !candidate.surface.overloads.is_empty());
            }
            clock.lap(&mut step.work.contact_time);
            self.couple_all(step, h, false);
            let problem = Problem { start: &self.start, free: &self.free, fixed: step.motions, h, team: step.team };
            let solved = self.coupled.solve(&mut self.x, &problem, ACCURACY * effort.tolerance);
            let closed = 2.0 * h * self.change(&self.looked);
            converged = solved && (closed <= self.reach || nobody_near) && self.agrees(step, h, effort.tolerance);
            self.reach = self.reach.max(RUSH * closed);
            clock.lap(&mut step.work.solve_time);
            if !solved || converged {
                break;
            }
        }
        if !converged {
            // Halves of a step are no better where it takes the push-out to part bodies.
            if !last_resort && !overloaded {
                return false;
            }
            // One solve with the surfaces as they are now: what moves on is small in so short a step, or stopped by the
            // walls of an overload, and no gap closes.
            self.x.fill(0.0);
            self.look(step, h, false);
            clock.lap(&mut step.work.contact_time);
            self.couple_all(step, h, true);
            let accuracy = ACCURACY * effort.tolerance;
            let mut softenings = 0;
            let problem = Problem { start: &self.start, free: &self.free, fixed: step.motions, h, team: step.team };
            while !self.coupled.solve(&mut self.x, &problem, accuracy) {
                // Forces that belong to no velocities could have any size.
                if softenings == MOST_SOFTENINGS {
                    self.coupled.bundles_mut().iter_mut().for_each(Bundle::clear);
                    break;
                }
                softenings += 1;
                self.coupled.bundles_mut().iter_mut().for_each(|bundle| bundle.soften(SOFTENING));
                self.x.fill(0.0);
            }
        }
        self.commit(step, h);
        clock.lap(&mut step.work.solve_time);
        true
    }

    /// The velocities at the start of the step, without what would carry bodies into each other.
    fn first_guess(&mut self, step: &mut Step, h: f64) {
        let Step { motions, island, candidates, team, .. } = step;
        let motions = &**motions;
        let count = candidates.len().div_ceil(TOGETHER);
        self.nearby.resize_with(count.max(self.nearby.len()), Nearby::default);
        team.each_row(candidates, TOGETHER, &mut self.nearby[..count], |_, candidates, nearby| {
            nearby.rows.clear();
            (nearby.fastest, nearby.arm, nearby.close) = (0.0, 0.0, false);
            for candidate in candidates {
                candidate.pair.place(motions, candidate.lead);
                nearby.add(&candidate.pair, motions, h);
            }
        });
        let nearby = &self.nearby[..count];
        self.arm = nearby.iter().map(|nearby| nearby.arm).fold(0.0, f64::max);
        let close = nearby.iter().any(|nearby| nearby.close);
        self.x.clone_from(&self.start);
        if close {
            for link in &island.links {
                self.trial[*link as usize] = motions[*link as usize];
            }
            self.take_approach_out(count);
        }
    }

    /// Changes velocities so that nobody comes closer than the rows of the first `count` of those nearby allow, roughly.
    fn take_approach_out(&mut self, count: usize) {
        let nearby = &self.nearby[..count];
        let fastest = nearby.iter().map(|nearby| nearby.fastest).fold(0.0, f64::max);
        self.rows.clear();
        // Nobody closes the other gaps.
        let near = |row: &&Row| -row.least <= RUSH * fastest;
        self.rows.extend(nearby.iter().flat_map(|nearby| &nearby.rows).filter(near));
        for row in &mut self.rows {
            let mobility = |side: usize| self.trial[row.links[side] as usize].mobility(&row.arms[side], &row.normal);
            row.mobility = mobility(0) + mobility(1);
        }
        for _ in 0..SWEEPS {
            let mut changed = false;
            for row in &mut self.rows {
                let [a, b] = row.velocities(&self.trial);
                let parting = (b - a).dot(&row.normal);
                if row.mobility <= 0.0 || row.impulse == 0.0 && parting >= row.least {
                    continue;
                }
                let impulse = (row.impulse + (row.least - parting) / row.mobility).max(0.0);
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
        for (block, link) in self.graph.nodes.iter().enumerate() {
            let block = block as u32;
            let (now, free) = (twist_of(&self.x, block), twist_of(&self.free, block));
            let guess = &self.trial[*link as usize].twist;
            // Where contacts hold a link nearly as it is, it will be held as it is: what the sweeps left is no motion.
            if (guess.linear - now.linear).norm() >= 0.5 * (free.linear - now.linear).norm() {
                put_twist(&mut self.x, block, guess);
            }
        }
    }

    /// How much the velocity of any contact differs from `other` velocities, at most \[m/s\].
    fn change(&self, other: &[f64]) -> f64 {
        let size = |block: usize| {
            let (now, then) = (twist_of(&self.x, block as u32), twist_of(other, block as u32));
            (now.linear - then.linear).norm() + (now.angular - then.angular).norm() * self.arm
        };
        (0..self.graph.nodes.len()).map(size).fold(0.0, f64::max)
    }

    /// Evaluates the contacts where the velocities lead; in the `first` round, those that do not stand.
    fn look(&mut self, step: &mut Step, h: f64, first: bool) {
        self.looked.clone_from(&self.x);
        let Step { motions, island, candidates, settings, work, team, .. } = step;
        for link in &island.links {
            self.trial[*link as usize] = motions[*link as usize];
        }
        for (block, link) in self.graph.nodes.iter().enumerate() {
            self.trial[*link as usize].twist = twist_of(&self.x, block as u32);
        }
        drift(&mut self.trial, island, h);
        let trial = &self.trial;
        work.look(candidates, team, |candidate| candidate.look_in_round(trial, settings, first));
    }

    /// Puts contact surfaces and springs into the system; as a `last_resort`, the surfaces frozen where they are.
    fn couple_all(&mut self, step: &Step, h: f64, last_resort: bool) {
        let Self { coupled, trial, x, reach, .. } = self;
        let Step { motions, island, candidates, team, .. } = step;
        let (motions, candidates, trial, reach) = (&**motions, &**candidates, &**trial, *reach);
        let (of_candidates, of_springs) =
            (candidates.len().div_ceil(TOGETHER), island.springs.len().div_ceil(SPRINGS_TOGETHER));
        coupled.put_together(of_candidates + of_springs, x, motions, team, |number, bundle| {
            let Some(number) = number.checked_sub(of_candidates) else {
                for (index, candidate) in candidates.iter().enumerate().skip(number * TOGETHER).take(TOGETHER) {
                    let index = index as u32;
                    Grouping { bundle: &mut *bundle, motions, trial, candidate, index, h, reach, last_resort }
                        .add_all();
                }
                return;
            };
            for spring in island.springs.iter().skip(number * SPRINGS_TOGETHER).take(SPRINGS_TOGETHER) {
                bundle.ties.push(Tie::new(spring, trial, &mut bundle.members));
            }
        });
    }

    /// Whether the contacts and the springs moved so little since they were evaluated that they are still what they were.
    fn agrees(&self, step: &Step, h: f64, tolerance: f64) -> bool {
        let (bundles, off) = (self.coupled.bundles(), AtomicBool::new(false));
        let (motions, candidates) = (&*step.motions, &*step.candidates);
        step.team.each(bundles.len(), 1, |numbers| {
            let agrees = |bundle: &Bundle| {
                bundle.groups.iter().all(|group| self.group_agrees(bundle, group, motions, candidates, h, tolerance))
                    && bundle.ties.iter().all(|tie| self.tie_agrees(bundle, tie, motions, h, tolerance))
            };
            if !off.load(Ordering::Relaxed) && !bundles[numbers].iter().all(agrees) {
                off.store(true, Ordering::Relaxed);
            }
        });
        !off.into_inner()
    }

    fn group_agrees(
        &self,
        bundle: &Bundle,
        group: &Group,
        motions: &[Motion],
        candidates: &[Kept],
        h: f64,
        tolerance: f64,
    ) -> bool {
        let members = bundle.members_of(group.members);
        let now = self.coupled.velocities(&self.x, motions).over(members);
        let change = Twist { linear: now.linear - group.base.linear, angular: now.angular - group.base.angular };
        let pair = &candidates[group.candidate as usize];
        let speed = speed(members, motions, h);
        let Source::Patch(patch) = group.source else {
            // A wall or a gap is exact, until it begins to push where it did not.
            let point = bundle.points.get(group.points.0);
            let closed = point.load - h * point.stiffness * point.normal.dot(&change.linear);
            return point.load > 0.0 || closed <= 0.0 || change.linear.norm() <= NEGLIGIBLE * speed;
        };
        let patch = &pair.surface.patches[patch as usize];
        let depth = patch.depth(&pair.pair);
        let size = bundle.size(group).max(depth);
        let moved = change.linear.norm() + change.angular.norm() * size;
        // In each step anew, what is negligible in one would add up.
        if !group.looked && moved <= NEGLIGIBLE * speed {
            return true;
        }
        let along = change.linear - patch.normal * change.linear.dot(&patch.normal);
        let across = change.linear.dot(&patch.normal).abs() + change.angular.norm() * size;
        h * across <= tolerance * depth && h * along.norm() <= tolerance * size
    }

    /// Whether a tie's ends came where the system took them to be. In a turn they go round, and not straight on.
    fn tie_agrees(&self, bundle: &Bundle, tie: &Tie, motions: &[Motion], h: f64, tolerance: f64) -> bool {
        let members = bundle.members_of(tie.members);
        let turned = |member: &Member| {
            let turn = |x| self.coupled.twist_in(member.link, x).map_or_else(Vec3::zeros, |twist| twist.angular);
            if member.turns { (turn(&self.x) - turn(&self.looked)).norm_squared() * h * member.arm.norm() } else { 0.0 }
        };
        let off = members.iter().map(turned).sum::<f64>();
        let velocity = self.coupled.velocities(&self.x, motions).over(members).linear;
        h * off <= tolerance * tie.stretch(&velocity, h).abs() || off <= NEGLIGIBLE * speed(members, motions, h)
    }

    /// Moves the links by the velocities found, and hands every contact its forces.
    fn commit(&mut self, step: &mut Step, h: f64) {
        self.before.clear();
        let articulations = step.articulations_of_island();
        for articulation in articulations.clone() {
            self.before.extend(articulation.links.iter().map(|link| step.motions[*link as usize].contact_impulse));
        }
        let Step { motions, island, candidates, team, .. } = step;
        let of_candidates = candidates.len().div_ceil(TOGETHER);
        let bundles = self.coupled.bundles_mut();
        team.each_row(candidates, TOGETHER, &mut bundles[..of_candidates], |number, candidates, bundle| {
            hand_out(bundle, number * TOGETHER, candidates);
        });
        let pushes = || bundles.iter().flat_map(Bundle::pushes);
        let untouched = pushes().all(|(_, push)| push.all == Wrench::default());
        if untouched && island.springs.is_empty() {
            fly(motions, island, h);
            return;
        }
        for link in &island.links {
            motions[*link as usize].kick(h);
        }
        for bundle in bundles.iter() {
            for (index, (range, Part { push, .. })) in bundle.ranges().zip(&bundle.parts).enumerate() {
                // A slack spring touches too.
                let acts = push.all.force != Vec3::zeros() || index >= bundle.groups.len();
                for member in bundle.members_of(range).iter().filter(|_| acts) {
                    let force = push.all.force * (h * member.weight);
                    let torque = push.all.torque * (h * member.weight) + member.arm.cross(&force);
                    motions[member.link as usize].push(&Wrench { force, torque });
                }
            }
        }
        let mut before = self.before.iter();
        for articulation in articulations {
            for (from, (link, before)) in articulation.links.iter().zip(&mut before).enumerate() {
                let mut impulse = motions[*link as usize].contact_impulse;
                impulse.add_scaled(before, -1.0);
                if impulse != Wrench::default() {
                    articulation.pass_on(from, &impulse, motions, |link| self.coupled.is_joined(link));
                }
            }
        }
        drift(motions, island, h);
        if let Some(fall) = springs::fall_as_one(&island.springs, &island.links, motions).filter(|_| untouched) {
            for link in &island.links {
                let motion = &mut motions[*link as usize];
                motion.center -= if motion.is_movable() { fall * (0.5 * h * h) } else { Vec3::zeros() };
            }
        }
        let (motions, bundles) = (&**motions, self.coupled.bundles_mut());
        team.each_row(candidates, TOGETHER, &mut bundles[..of_candidates], |_, candidates, bundle| {
            for candidate in candidates.iter_mut().filter(|candidate| candidate.material.static_friction > 0.0) {
                bend_bristles(candidate, motions, h, &mut bundle.carriers);
                let_go(candidate, motions, h, &mut bundle.carriers);
            }
        });
    }
}

/// Hands candidates, from the `first` on, what the groups of their patches came to.
fn hand_out(bundle: &Bundle, first: usize, candidates: &mut [Kept]) {
    for candidate in candidates.iter_mut() {
        candidate.loads.clear();
        let Surface { patches, overloads, .. } = &candidate.surface;
        candidate.loads.resize(patches.len() + overloads.len(), Sums::default());
        if !candidate.surface.overloads.is_empty() {
            (candidate.memory.overloaded, candidate.memory.touched) = (true, true);
        }
    }
    let same = |a: &Group, b: &Group| (a.candidate, a.source) == (b.candidate, b.source);
    let mut begin = 0;
    for groups in bundle.groups.chunk_by(same) {
        let range = begin..begin + groups.len();
        begin = range.end;
        let candidate = &mut candidates[groups[0].candidate as usize - first];
        let place = match groups[0].source {
            Source::Patch(patch) => patch as usize,
            Source::Overload(overload) => candidate.surface.patches.len() + overload as usize,
            Source::Gap => continue,
        };
        let sums = bundle.sums_of(range);
        candidate.memory.touched |= sums.force != Vec3::zeros();
        candidate.loads[place] = sums;
    }
}

/// The speeds that are at work among some members in this step.
fn speed(members: &[Member], motions: &[Motion], h: f64) -> f64 {
    let speed = |member: &Member| {
        let motion = &motions[member.link as usize];
        motion.acceleration.norm() * h + NEGLIGIBLE * motion.twist.at(&member.arm).norm()
    };
    members.iter().map(speed).sum()
}

/// Bristles of patches that slide bend no further.
fn let_go(candidate: &mut Candidate, motions: &[Motion], h: f64, carriers: &mut Carriers) {
    let Candidate { pair, surface, loads, memory, .. } = candidate;
    for (patch, load) in surface.patches.iter().zip(loads.iter()) {
        if load.force == Vec3::zeros() {
            continue;
        }
        let [i, j] = patch.skeletons;
        let key = patch.key(pair);
        let Some(bristle) = memory.bristles.iter_mut().find(|bristle| bristle.key == key) else { continue };
        let thickness = thinner(pair, i, j);
        carriers.find(pair, &load.center);
        let normal = load.force.normalize();
        let slip = carriers.slip(motions, &pair.origin, &load.center);
        let slip = slip - normal * slip.dot(&normal);
        let wanted = slip + bristle.slip * (RECOVERY / h);
        bristle.sliding = wanted.norm() > LET_GO * CREEP * thickness;
        if bristle.sliding {
            (bristle.slip, bristle.turn) = (Vec3::zeros(), 0.0);
        }
    }
}
