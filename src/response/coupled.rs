//! The contacts of an island at one pose, linear in the velocities, and the velocities that satisfy them all at once:
//! the inner problem of the [implicit response](super::implicit).
//!
//! What is sought is `M (v - v*) = h Σ forces`, with the forces of [groups](super::group) and [springs](super::springs) at
//! `v`, by Newton's method on a system that stays symmetric and positive definite.

use nalgebra::{Matrix6, Vector6};

use super::bundle::{Bundle, Taker};
use super::conjugate::{Block, Blocks};
use super::envelope::{BLOCK, Envelope};
use super::group::{Member, relative};
use super::joined::Joined;
use crate::base::{Inertia, Motion};
use crate::math::{Mat3, Quat, Twist, Vec3, Wrench, rotate_tensor};
use crate::team::Team;

/// The contacts of an island at one pose.
#[derive(Debug, Default)]
pub struct Coupled {
    /// Contacts and springs, in the first `count` of them.
    bundles: Vec<Bundle>,
    count: usize,
    /// What articulations add to the inertia of the links.
    pub joined: Joined,
    masses: Vec<Matrix6<f64>>,
    mobilities: Vec<Matrix6<f64>>,
    /// The links with unknowns, and the row of each in the system, by slot.
    links: Vec<u32>,
    blocks: Vec<u32>,
    /// The rows in the order in which they are solved for, where neighbours are near each other, and the place of each.
    order: Vec<u32>,
    places: Vec<u32>,
    first: Vec<u32>,
    /// The system is too wide for a factor.
    wide: bool,
    matrix: Envelope,
    blocks_of_matrix: Blocks,
    /// The members that are each row of blocks, in the order of the parts, and where each row's begin.
    roles: Vec<Role>,
    starts: Vec<u32>,
    /// The blocks off the diagonal, row by row.
    couplings: Vec<Coupling>,
    diagonal: Vec<Matrix6<f64>>,
    residual: Vec<f64>,
    base: Vec<f64>,
    step: Vec<f64>,
    /// The step in the order of solving.
    ordered: Vec<f64>,
}

/// What [`Coupled::solve`] works on.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// The velocities at the start of the step.
    pub start: &'a [f64],
    /// Those at its end without contact.
    pub free: &'a [f64],
    /// Those of links without unknowns.
    pub fixed: &'a [Motion],
    /// Length of the step \[s\].
    pub h: f64,
    /// Who works at it.
    pub team: &'a Team<'a>,
}

/// A group or a tie in which a row's link takes part: the bundle, and the places in it of the part, of the member, and of
/// the first and the last-plus-one of all that take part in it.
#[derive(Clone, Copy, Debug, Default)]
struct Role {
    bundle: u32,
    part: u32,
    member: u32,
    takers: (u32, u32),
}

/// A block off the diagonal.
#[derive(Clone, Copy, Debug)]
enum Coupling {
    /// How a member of a group or a tie answers to another.
    Part { role: Role, other: u32 },
    /// The inertia of an articulation, by the number of its entry.
    Joined(u32),
}

/// Least blocks that a worker takes in one go.
const GROUPS: usize = 16;

/// Steps of Newton's method in one solve.
const MOST_STEPS: usize = 60;

/// Looks along one step for its lowest point.
const MOST_LOOKS: usize = 12;

/// Slope along a step, over the slope at its start, that counts as lowest.
const FLAT: f64 = 0.2;

/// Square of what rounding leaves of sums, over the square of what is summed up.
const ROUNDING: f64 = 1e-29;

/// Residual over the kinetic energy at work, both squared, that will do where Newton's method gets no further, or not in
/// so many steps.
const STALLED: f64 = 1e-16;
const TIRED: f64 = 1e-10;

/// The same at which nothing is left to solve.
const SOLVED: f64 = 1e-18;

/// The same with springs: what the residual leaves is a velocity, which stretches a stiff one.
const SOLVED_TIES: f64 = 1e-26;

/// Part of its size in the last step to which a residual's square must have fallen for the next step to be made with the
/// same matrix.
const QUICK: f64 = 1e-3;

/// Products of a factor beyond which conjugate gradients are quicker.
const WIDE: usize = 100_000;

/// The same with articulations, whose stiff joints take gradients many turns.
const WIDE_JOINED: usize = 5_000_000;

/// Least and most that conjugate gradients leave of a Newton step.
const GRADIENTS: (f64, f64) = (5e-3, 1e-1);

/// What they may leave, over what the last Newton step left: that is what the matrix lacks, and nothing else mends it.
const LACK: f64 = 0.2;

/// Most conjugate gradients in one Newton step.
const MOST_GRADIENTS: usize = 400;

/// Slot without unknowns.
const NONE: u32 = u32::MAX;

impl Coupled {
    /// Sets the links with unknowns, with their inertia at the start of the step, and the order in which they are to be
    /// solved for. The system has them in their own order, so that who puts contacts together puts them together with
    /// the links that they are on.
    pub fn set_links(&mut self, links: &[u32], order: &[u32], motions: &[Motion], team: &Team) {
        let Self { masses, mobilities, blocks, places, .. } = self;
        self.order.clear();
        self.order.extend_from_slice(order);
        places.resize(order.len(), 0);
        for (place, row) in order.iter().enumerate() {
            places[*row as usize] = place as u32;
        }
        blocks.resize(motions.len().max(blocks.len()), NONE);
        // An island may be small, and the world large.
        for link in self.links.drain(..) {
            blocks[link as usize] = NONE;
        }
        for (block, link) in links.iter().enumerate() {
            blocks[*link as usize] = block as u32;
        }
        self.links.extend_from_slice(links);
        masses.resize(links.len(), Matrix6::zeros());
        mobilities.resize(links.len(), Matrix6::zeros());
        team.each_row(masses, 1, mobilities, |block, mass, mobility| {
            (mass[0], *mobility) = inertia(&motions[links[block] as usize]);
        });
    }

    /// Has `count` bundles put together anew, by their numbers, for surfaces and springs that were evaluated where the
    /// unknowns `x` lead; `fixed` has the velocities of links without unknowns.
    pub fn put_together(
        &mut self,
        count: usize,
        x: &[f64],
        fixed: &[Motion],
        team: &Team,
        put: impl Fn(usize, &mut Bundle) + Sync,
    ) {
        self.count = count;
        self.bundles.resize_with(count.max(self.bundles.len()), Bundle::default);
        let velocities = Velocities { blocks: &self.blocks, x, fixed };
        team.each_mut(&mut self.bundles[..count], 1, |number, bundle| {
            bundle.clear();
            put(number, bundle);
            bundle.set_base(|link| velocities.of(link));
            bundle.find_takers(|link| Some(velocities.blocks[link as usize]).filter(|row| *row != NONE));
        });
    }

    /// The bundles.
    pub fn bundles(&self) -> &[Bundle] {
        &self.bundles[..self.count]
    }

    /// The bundles, for changes.
    pub fn bundles_mut(&mut self) -> &mut [Bundle] {
        &mut self.bundles[..self.count]
    }

    /// The velocities of all links for the unknowns `x`; `fixed` has those of links without unknowns.
    pub fn velocities<'a>(&'a self, x: &'a [f64], fixed: &'a [Motion]) -> Velocities<'a> {
        Velocities { blocks: &self.blocks, x, fixed }
    }

    /// The velocities of a link in the unknowns `x`, if it has any.
    pub fn twist_in(&self, link: u32, x: &[f64]) -> Option<Twist> {
        Some(self.blocks[link as usize]).filter(|block| *block != NONE).map(|block| twist_of(x, block))
    }

    /// Whether a link is solved together with others of its articulation.
    pub fn is_joined(&self, link: u32) -> bool {
        let block = self.blocks[link as usize];
        block != NONE && !self.joined.range_of(block as usize).is_empty()
    }

    /// Solves for the velocities at the end of the step, in place. False when it does not get there.
    ///
    /// But for the pressure's part in friction, the residual is the gradient of a convex function. Newton's method
    /// overshoots its lowest point where a slip comes to rest, so each step goes to the lowest point along it.
    ///
    /// One step at least is taken, however small the residual: so what lies comes to rest in the course of time. After
    /// it a residual of `accuracy` will do, over the momentum that contacts and what pulls bring: not over that which is
    /// there, which only depends on who looks; nor over the residual at the start, since that of a stiff contact which the
    /// guess closes is out of all proportion.
    pub fn solve(&mut self, x: &mut [f64], problem: &Problem, accuracy: f64) -> bool {
        self.shape();
        self.assemble(x, problem, true);
        let mut norm = self.norm(&self.residual);
        let pull = self.energy(problem.free, problem.start);
        // What forces leave that cancel each other, and velocities.
        let rounding =
            ROUNDING * (self.size_of_forces(problem.h) + self.energy(x, &[]) + self.energy(problem.free, &[]));
        let (solved, part) = if self.bundles().iter().all(|bundle| bundle.ties.is_empty()) {
            (SOLVED, accuracy * accuracy)
        } else {
            (SOLVED_TIES, SOLVED_TIES)
        };
        let mut work = self.energy(x, problem.free) + pull;
        if norm <= solved * work + rounding {
            return true;
        }
        let (mut last, mut fresh) = (f64::INFINITY, true);
        for _ in 0..MOST_STEPS {
            if !fresh && norm > QUICK * last {
                self.assemble(x, problem, true);
                fresh = true;
            }
            self.step.clone_from(&self.residual);
            let needed = 0.3 * ((part * work + rounding) / norm).sqrt();
            let lost = if last.is_finite() { LACK * (norm / last).sqrt() } else { 0.0 };
            let left = needed.max(lost).clamp(GRADIENTS.0, GRADIENTS.1);
            if !self.solve_step(left, fresh, problem.team) {
                return false;
            }
            self.base.clear();
            self.base.extend_from_slice(x);
            self.go_lowest(x, problem);
            last = norm;
            norm = self.norm(&self.residual);
            work = self.energy(x, problem.free) + pull;
            let stalls = fresh && norm > 0.9 * last;
            if norm <= part * work + rounding || stalls && norm <= STALLED * work + 1e4 * rounding {
                return true;
            }
            fresh = false;
        }
        norm <= TIRED * work + 1e4 * rounding
    }

    /// Square of the size of the forces that act on the links, together with those that they cancel: twice the kinetic
    /// energy that they would bring in `h` seconds.
    fn size_of_forces(&self, h: f64) -> f64 {
        let of_row = |row: usize| {
            let (mut force, mut torque) = (0.0, 0.0);
            for role in &self.roles[self.starts[row] as usize..self.starts[row + 1] as usize] {
                let bundle = &self.bundles[role.bundle as usize];
                let member = &bundle.members[role.member as usize];
                let size = bundle.parts[role.part as usize].push.all.force.norm() * (h * member.weight);
                force += size.abs();
                torque += size.abs() * member.arm.norm();
            }
            let mobility = &self.mobilities[row];
            force * force * mobility[(0, 0)] + torque * torque * mobility.fixed_view::<3, 3>(3, 3).trace()
        };
        (0..self.masses.len()).map(of_row).sum()
    }

    /// Solves for a step; with the matrix of the last one unless it is `fresh`.
    fn solve_step(&mut self, left: f64, fresh: bool, team: &Team) -> bool {
        if self.wide {
            return self.blocks_of_matrix.solve(&self.diagonal, fresh, &mut self.step, left, MOST_GRADIENTS, team);
        }
        if fresh && !self.matrix.factor() {
            return false;
        }
        let Self { order, step, ordered, .. } = self;
        let (step, _) = step.as_chunks_mut::<BLOCK>();
        ordered.clear();
        ordered.extend(order.iter().flat_map(|row| step[*row as usize]));
        self.matrix.solve(ordered);
        for (row, part) in order.iter().zip(ordered.chunks_exact(BLOCK)) {
            step[*row as usize].copy_from_slice(part);
        }
        true
    }

    fn put_step(&self, x: &mut [f64], part: f64) {
        for (x, (base, step)) in x.iter_mut().zip(self.base.iter().zip(&self.step)) {
            *x = base - part * step;
        }
    }

    /// Takes the step to where the slope along it has fallen to a small part, with the residual there.
    fn go_lowest(&mut self, x: &mut [f64], problem: &Problem) {
        let along = |residual: &[f64], step: &[f64]| -> f64 { residual.iter().zip(step).map(|(r, s)| r * s).sum() };
        let start = along(&self.residual, &self.step);
        let (mut low, mut slope_low) = (0.0, start);
        let (mut high, mut slope_high) = (1.0, 0.0);
        let mut part = 1.0;
        for _ in 0..MOST_LOOKS {
            self.put_step(x, part);
            self.assemble(x, problem, false);
            let slope = along(&self.residual, &self.step);
            // Nearly all steps are good as a whole.
            if slope.abs() <= FLAT * start || slope >= 0.0 && part == 1.0 {
                return;
            }
            if slope > 0.0 {
                // Keeps the other end from standing still.
                slope_high *= if low > 0.0 { 0.5 } else { 1.0 };
                (low, slope_low) = (part, slope);
            } else {
                slope_low *= if slope_high < 0.0 { 0.5 } else { 1.0 };
                (high, slope_high) = (part, slope);
            }
            part = low + (high - low) * slope_low / (slope_low - slope_high);
            part = part.clamp(low + 0.01 * (high - low), high - 0.01 * (high - low));
        }
        self.put_step(x, part);
        self.assemble(x, problem, false);
    }

    /// Square of a residual's size: the kinetic energy of the velocities that it stands for, twice.
    fn norm(&self, residual: &[f64]) -> f64 {
        let size = |(part, mobility): (&[f64], &Matrix6<f64>)| {
            let part = Vector6::from_column_slice(part);
            part.dot(&(mobility * part))
        };
        residual.chunks_exact(BLOCK).zip(&self.mobilities).map(size).sum()
    }

    /// Twice the kinetic energy of velocities against `others`, or against none.
    fn energy(&self, x: &[f64], others: &[f64]) -> f64 {
        let size = |(row, (part, mass)): (usize, (&[f64], &Matrix6<f64>))| {
            let mut part = Vector6::from_column_slice(part);
            if let Some(other) = others.get(row * BLOCK..(row + 1) * BLOCK) {
                part -= Vector6::from_column_slice(other);
            }
            part.dot(&(mass * part))
        };
        x.chunks_exact(BLOCK).zip(&self.masses).enumerate().map(size).sum()
    }

    /// Who is coupled with whom, and the shape of the matrix.
    fn shape(&mut self) {
        let Self { bundles, joined, roles, starts, couplings, first, places, .. } = self;
        let bundles = &bundles[..self.count];
        let count = self.masses.len();
        first.clear();
        first.extend(0..count as u32);
        starts.clear();
        starts.resize(count + 2, 0);
        for takers in bundles.iter().flat_map(Bundle::takers_by_part) {
            let place = |taker: &Taker| places[taker.row as usize];
            let lowest = takers.iter().map(place).min().unwrap_or(NONE);
            for taker in takers {
                let first = &mut first[place(taker) as usize];
                *first = lowest.min(*first);
                starts[taker.row as usize + 2] += 1;
            }
        }
        for row in 2..starts.len() {
            starts[row] += starts[row - 1];
        }
        roles.clear();
        roles.resize(starts[count + 1] as usize, Role::default());
        for (number, bundle) in bundles.iter().enumerate() {
            let mut end = 0;
            for all in bundle.takers_by_part() {
                let takers = (end, end + all.len() as u32);
                end = takers.1;
                for Taker { part, member, row } in all {
                    // Each row's start, kept one place up meanwhile, moves to the next one's.
                    let place = &mut starts[*row as usize + 1];
                    roles[*place as usize] = Role { bundle: number as u32, part: *part, member: *member, takers };
                    *place += 1;
                }
            }
        }
        for entry in joined.entries() {
            let [place, other] = [entry.row, entry.other].map(|row| places[row as usize]);
            first[place as usize] = first[place as usize].min(other);
        }
        self.wide = Envelope::cost(first) > if joined.is_empty() { WIDE } else { WIDE_JOINED };
        if !self.wide {
            self.matrix.reset(first);
        }
        let (wide, matrix) = (self.wide, &mut self.blocks_of_matrix);
        // Of a factor the lower half.
        let is_needed = |row: usize, other: u32| {
            let [place, other] = [row, other as usize].map(|row| places[row]);
            other < place || wide && other > place
        };
        couplings.clear();
        matrix.clear();
        for row in 0..count {
            for role in &roles[starts[row] as usize..starts[row + 1] as usize] {
                let (first, end) = role.takers;
                for taker in &bundles[role.bundle as usize].takers[first as usize..end as usize] {
                    if is_needed(row, taker.row) {
                        couplings.push(Coupling::Part { role: *role, other: taker.member });
                        matrix.couple(taker.row);
                    }
                }
            }
            for index in joined.range_of(row) {
                let other = joined.entries()[index].other;
                if is_needed(row, other) {
                    couplings.push(Coupling::Joined(index as u32));
                    matrix.couple(other);
                }
            }
            matrix.end_row();
        }
        if wide {
            matrix.arrange(&self.order, places);
        }
    }

    /// Residual `M (x - free) - h Σ forces` and its derivative. Each part, then each row and each block is worked out by
    /// one worker.
    fn assemble(&mut self, x: &[f64], problem: &Problem, with_matrix: bool) {
        let Problem { free, fixed, h, team, .. } = *problem;
        let velocities = Velocities { blocks: &self.blocks, x, fixed };
        team.each_mut(&mut self.bundles[..self.count], 1, |_, bundle| {
            bundle.respond(|link| velocities.of(link), h, with_matrix);
        });
        let Self { bundles, joined, masses, roles, starts, couplings, diagonal, residual, .. } = self;
        let (bundles, masses, roles) = (&*bundles, &*masses, &*roles);
        let of_role = |role: &Role| {
            let bundle = &bundles[role.bundle as usize];
            (&bundle.parts[role.part as usize], &bundle.members[role.member as usize])
        };
        let roles_of = |row: usize| &roles[starts[row] as usize..starts[row + 1] as usize];
        residual.resize(masses.len() * BLOCK, 0.0);
        let work_out = |row: usize, residual: &mut [f64]| {
            let change = |row: usize| {
                let range = row * BLOCK..(row + 1) * BLOCK;
                Vector6::from_column_slice(&x[range.clone()]) - Vector6::from_column_slice(&free[range])
            };
            let mut sum = masses[row] * change(row);
            for entry in &joined.entries()[joined.range_of(row)] {
                sum += entry.block * change(entry.other as usize);
            }
            for role in roles_of(row) {
                let (part, member) = of_role(role);
                let Wrench { force, torque } = member.wrench(&part.push.all);
                sum -= Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z) * (h * member.weight);
            }
            residual.copy_from_slice(sum.as_slice());
        };
        if !with_matrix {
            team.each_row(residual, BLOCK, &mut vec![(); masses.len()], |row, residual, ()| work_out(row, residual));
            return;
        }
        diagonal.resize(masses.len(), Matrix6::zeros());
        team.each_row(residual, BLOCK, diagonal, |row, residual, sum| {
            work_out(row, residual);
            *sum = masses[row];
            for entry in &joined.entries()[joined.range_of(row)] {
                if entry.other as usize == row {
                    *sum += entry.block;
                }
            }
            for role in roles_of(row) {
                let (part, member) = of_role(role);
                if part.resists {
                    *sum += member.block(&part.slope, member) * h;
                }
            }
        });
        let couplings = &*couplings;
        let block = |index: usize| match couplings[index] {
            Coupling::Part { role, other } => {
                let (part, member) = of_role(&role);
                let other = &bundles[role.bundle as usize].members[other as usize];
                part.resists.then(|| member.block(&part.slope, other) * h)
            }
            Coupling::Joined(entry) => Some(joined.entries()[entry as usize].block),
        };
        if self.wide {
            let entries = self.blocks_of_matrix.entries();
            team.each_mut(entries, team.share(couplings.len(), GROUPS), |index, entry| {
                *entry = block(index).map_or_else(Block::default, |block| Block::of(&block));
            });
            return;
        }
        self.matrix.zero();
        for (row, block) in diagonal.iter().enumerate() {
            let place = self.places[row] as usize;
            self.matrix.add(place, place, block);
        }
        for (index, coupling) in couplings.iter().enumerate() {
            if let Some(block) = block(index) {
                let [row, other] = match coupling {
                    Coupling::Part { role, other } => {
                        let members = &bundles[role.bundle as usize].members;
                        [role.member, *other].map(|member| self.blocks[members[member as usize].link as usize])
                    }
                    Coupling::Joined(entry) => {
                        let entry = &joined.entries()[*entry as usize];
                        [entry.row, entry.other]
                    }
                };
                let [place, other] = [row, other].map(|row| self.places[row as usize] as usize);
                self.matrix.add(place, other, &block);
            }
        }
    }
}

/// The velocities of all links: those of the unknowns, and the others'.
#[derive(Clone, Copy)]
pub struct Velocities<'a> {
    blocks: &'a [u32],
    x: &'a [f64],
    fixed: &'a [Motion],
}

impl Velocities<'_> {
    /// Those of a link.
    pub fn of(&self, link: u32) -> Twist {
        match self.blocks[link as usize] {
            NONE => self.fixed[link as usize].twist,
            block => twist_of(self.x, block),
        }
    }

    /// The relative velocity over some members.
    pub fn over(&self, members: &[Member]) -> Twist {
        relative(members, |link| self.of(link))
    }
}

/// The twist of a block of unknowns.
pub fn twist_of(x: &[f64], block: u32) -> Twist {
    let at = &x[block as usize * BLOCK..];
    Twist { linear: Vec3::new(at[0], at[1], at[2]), angular: Vec3::new(at[3], at[4], at[5]) }
}

/// Writes a twist into a block of unknowns.
pub fn put_twist(x: &mut [f64], block: u32, twist: &Twist) {
    let at = &mut x[block as usize * BLOCK..][..BLOCK];
    at[..3].copy_from_slice(twist.linear.as_slice());
    at[3..].copy_from_slice(twist.angular.as_slice());
}

/// Inertia of a link as a matrix, and its inverse. A point mass does not turn: the block for it stands by itself.
fn inertia(motion: &Motion) -> (Matrix6<f64>, Matrix6<f64>) {
    let diagonal = |mass: f64, tensor: &Mat3| {
        let mut matrix = Matrix6::identity() * mass;
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(tensor);
        matrix
    };
    match &motion.inertia {
        Inertia::Immovable => (Matrix6::identity(), Matrix6::identity()),
        Inertia::Point { inverse_mass } => {
            let mass = 1.0 / inverse_mass;
            (diagonal(mass, &(Mat3::identity() * mass)), diagonal(*inverse_mass, &(Mat3::identity() * *inverse_mass)))
        }
        Inertia::Solid { inverse_mass, local, inverse_local, .. } => {
            let turned = |tensor: &Mat3, rotation: &Quat| rotate_tensor(rotation, tensor);
            (
                diagonal(1.0 / inverse_mass, &turned(local, &motion.rotation)),
                diagonal(*inverse_mass, &turned(inverse_local, &motion.rotation)),
            )
        }
        Inertia::Effective(mobility) => {
            let mass = mobility.cholesky().map_or_else(Matrix6::identity, |factor| factor.inverse());
            (mass, *mobility)
        }
    }
}
