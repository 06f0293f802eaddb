//! The contacts of an island at one pose, linear in the velocities, and the velocities that satisfy them all at once:
//! the inner problem of the [implicit response](super::implicit).
//!
//! What is sought is `M (v - v*) = h Σ forces`, with the forces of [groups](super::group) and [springs](super::springs) at
//! `v`, by Newton's method on a system that stays symmetric and positive definite.

use nalgebra::{Matrix6, Vector6};

use super::conjugate::{Block, Blocks};
use super::envelope::{BLOCK, Envelope};
use super::group::{Group, Member, Points, Push, Slope, relative};
use super::grouping::Bundle;
use super::joined::Joined;
use super::springs::Tie;
use crate::base::{Inertia, Motion};
use crate::math::{Mat3, Quat, Twist, Vec3, Wrench, rotate_tensor};
use crate::team::Team;

/// The contacts of an island at one pose.
#[derive(Debug, Default)]
pub struct Coupled {
    /// All groups.
    pub groups: Vec<Group>,
    /// Points of all groups.
    pub points: Points,
    /// Springs.
    pub ties: Vec<Tie>,
    /// Members of all groups, then of all ties.
    pub members: Vec<Member>,
    /// What articulations add to the inertia of the links.
    pub joined: Joined,
    masses: Vec<Matrix6<f64>>,
    mobilities: Vec<Matrix6<f64>>,
    blocks: Vec<u32>,
    first: Vec<u32>,
    /// The system is too wide for a factor.
    wide: bool,
    matrix: Envelope,
    blocks_of_matrix: Blocks,
    /// The part of each group, then of each tie, in the system.
    parts: Vec<Part>,
    /// The members that are each row of blocks, in the order of the parts, and where each row's begin.
    roles: Vec<Role>,
    starts: Vec<u32>,
    /// The blocks off the diagonal, row by row.
    couplings: Vec<Coupling>,
    diagonal: Vec<Matrix6<f64>>,
    residual: Vec<f64>,
    base: Vec<f64>,
    step: Vec<f64>,
}

/// The part of a group or a tie in the system.
#[derive(Clone, Copy, Debug, Default)]
struct Part {
    /// On b, about the group's centre.
    push: Push,
    slope: Slope,
    /// The slope is more than nothing.
    resists: bool,
}

/// A group or a tie in which a row's link takes part.
#[derive(Clone, Copy, Debug, Default)]
struct Role {
    part: u32,
    member: u32,
}

/// A block off the diagonal.
#[derive(Clone, Copy, Debug)]
enum Coupling {
    /// How a member of a group or a tie answers to another.
    Part { part: u32, members: [u32; 2] },
    /// The inertia of an articulation, by the number of its entry.
    Joined(u32),
}

/// Least parts, rows and blocks that a worker takes in one go.
const GROUPS: usize = 16;

/// Steps of Newton's method in one solve.
const MOST_STEPS: usize = 60;

/// Looks along one step for its lowest point.
const MOST_LOOKS: usize = 12;

/// Slope along a step, over the slope at its start, that counts as lowest.
const FLAT: f64 = 0.2;

/// Residual over the kinetic energy at work, both squared, at which nothing is left to solve.
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
    /// Sets the links with unknowns, in the order of the system, with their inertia at the start of the step.
    pub fn set_links(&mut self, links: &[u32], motions: &[Motion]) {
        self.masses.clear();
        self.mobilities.clear();
        self.blocks.clear();
        self.blocks.resize(motions.len(), NONE);
        for (block, link) in links.iter().enumerate() {
            self.blocks[*link as usize] = block as u32;
            let (mass, mobility) = inertia(&motions[*link as usize]);
            self.masses.push(mass);
            self.mobilities.push(mobility);
        }
    }

    /// Forgets groups and ties.
    pub fn clear(&mut self) {
        self.groups.clear();
        self.points.clear();
        self.ties.clear();
        self.members.clear();
    }

    /// Leaves the patches, but not the walls, a part of their stiffness.
    pub fn soften(&mut self, part: f64) {
        for group in self.groups.iter().filter(|group| group.patch.is_some()) {
            self.points.soften(group.points.0..group.points.1, part);
        }
    }

    /// Adds the groups of a bundle.
    pub fn append(&mut self, bundle: &Bundle) {
        let (points, members) = (self.points.count(), self.members.len());
        let behind = |range: (usize, usize), first: usize| (range.0 + first, range.1 + first);
        self.groups.extend(bundle.groups.iter().map(|group| Group {
            points: behind(group.points, points),
            members: behind(group.members, members),
            ..*group
        }));
        self.points.append(&bundle.points);
        self.members.extend_from_slice(&bundle.members);
    }

    /// Sets the velocities at which the contact surfaces were evaluated in this round.
    pub fn set_base(&mut self, x: &[f64], fixed: &[Motion], team: &Team) {
        let mut groups = std::mem::take(&mut self.groups);
        let block = team.share(groups.len(), GROUPS);
        team.each_mut(&mut groups, block, |_, group| {
            if !group.looked {
                group.base = self.relative_of(group.members, x, fixed);
            }
        });
        self.groups = groups;
    }

    /// The relative velocity over some members for the unknowns `x`; `fixed` has the velocities of links without unknowns.
    pub fn relative_of(&self, members: (usize, usize), x: &[f64], fixed: &[Motion]) -> Twist {
        relative(&self.members[members.0..members.1], |link| match self.blocks[link as usize] {
            NONE => fixed[link as usize].twist,
            block => twist_of(x, block),
        })
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

    /// What each group came to at the unknowns that [`solve`](Self::solve) found.
    pub fn pushes(&self) -> impl Iterator<Item = (&Group, &Push)> + Clone {
        self.groups.iter().zip(self.parts.iter().map(|part| &part.push))
    }

    /// Solves for the velocities at the end of the step, in place; `free` has those without contact, `fixed` those of
    /// the links without unknowns. False when it does not get there.
    ///
    /// But for the pressure's part in friction, the residual is the gradient of a convex function. Newton's method
    /// overshoots its lowest point where a slip comes to rest, so each step goes to the lowest point along it.
    ///
    /// One step at least is taken, however small the residual: so what lies comes to rest in the course of time. After
    /// it a residual of `accuracy`, over the momentum at work, will do.
    pub fn solve(&mut self, x: &mut [f64], free: &[f64], fixed: &[Motion], h: f64, accuracy: f64, team: &Team) -> bool {
        self.shape();
        self.assemble(x, free, fixed, h, true, team);
        let mut norm = self.norm(&self.residual);
        let scale = norm + self.energy(x) + self.energy(free);
        let (solved, enough) =
            if self.ties.is_empty() { (SOLVED, accuracy * accuracy) } else { (SOLVED_TIES, SOLVED_TIES) };
        if norm <= solved * scale {
            return true;
        }
        let enough = enough * scale;
        let (mut last, mut fresh) = (f64::INFINITY, true);
        for _ in 0..MOST_STEPS {
            if !fresh && norm > QUICK * last {
                self.assemble(x, free, fixed, h, true, team);
                fresh = true;
            }
            self.step.clone_from(&self.residual);
            let needed = 0.3 * (enough / norm).sqrt();
            let lost = if last.is_finite() { LACK * (norm / last).sqrt() } else { 0.0 };
            let left = needed.max(lost).clamp(GRADIENTS.0, GRADIENTS.1);
            if !self.solve_step(left, fresh, team) {
                return false;
            }
            fresh = false;
            self.base.clear();
            self.base.extend_from_slice(x);
            last = norm;
            self.go_lowest(x, free, fixed, h, team);
            norm = self.norm(&self.residual);
            // Sums of contact forces round off.
            if norm <= enough || norm > 0.9 * last && norm <= 1e-16 * scale {
                return true;
            }
        }
        norm <= 1e-10 * scale
    }

    /// Solves for a step; with the matrix of the last one unless it is `fresh`.
    fn solve_step(&mut self, left: f64, fresh: bool, team: &Team) -> bool {
        if self.wide {
            return self.blocks_of_matrix.solve(&self.diagonal, fresh, &mut self.step, left, MOST_GRADIENTS, team);
        }
        let definite = !fresh || self.matrix.factor();
        if definite {
            self.matrix.solve(&mut self.step);
        }
        definite
    }

    fn put_step(&self, x: &mut [f64], part: f64) {
        for (x, (base, step)) in x.iter_mut().zip(self.base.iter().zip(&self.step)) {
            *x = base - part * step;
        }
    }

    /// Takes the step to where the slope along it has fallen to a small part, with the residual there.
    fn go_lowest(&mut self, x: &mut [f64], free: &[f64], fixed: &[Motion], h: f64, team: &Team) {
        let along = |residual: &[f64], step: &[f64]| -> f64 { residual.iter().zip(step).map(|(r, s)| r * s).sum() };
        let start = along(&self.residual, &self.step);
        let (mut low, mut slope_low) = (0.0, start);
        let (mut high, mut slope_high) = (1.0, 0.0);
        let mut part = 1.0;
        for _ in 0..MOST_LOOKS {
            self.put_step(x, part);
            self.assemble(x, free, fixed, h, false, team);
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
        self.assemble(x, free, fixed, h, false, team);
    }

    /// Square of a residual's size: the kinetic energy of the velocities that it stands for, twice.
    fn norm(&self, residual: &[f64]) -> f64 {
        let size = |(part, mobility): (&[f64], &Matrix6<f64>)| {
            let part = Vector6::from_column_slice(part);
            part.dot(&(mobility * part))
        };
        residual.chunks_exact(BLOCK).zip(&self.mobilities).map(size).sum()
    }

    /// Twice the kinetic energy of velocities.
    fn energy(&self, x: &[f64]) -> f64 {
        let size = |(part, mass): (&[f64], &Matrix6<f64>)| {
            let part = Vector6::from_column_slice(part);
            part.dot(&(mass * part))
        };
        x.chunks_exact(BLOCK).zip(&self.masses).map(size).sum()
    }

    /// Who is coupled with whom, and the shape of the matrix.
    fn shape(&mut self) {
        let Self { groups, ties, members, joined, blocks, roles, starts, couplings, first, .. } = self;
        let parts = groups.iter().map(|group| group.members).chain(ties.iter().map(|tie| tie.members));
        let count = self.masses.len();
        let block = |member: usize| blocks[members[member].link as usize];
        let taking_part = |(first, end): (usize, usize)| (first..end).filter(|member| block(*member) != NONE);
        let members_of = |part: usize| match groups.get(part) {
            Some(group) => group.members,
            None => ties[part - groups.len()].members,
        };
        first.clear();
        first.extend(0..count as u32);
        starts.clear();
        starts.resize(count + 2, 0);
        for part in parts.clone() {
            let lowest = taking_part(part).map(block).min().unwrap_or(NONE);
            for row in taking_part(part).map(block) {
                first[row as usize] = lowest.min(first[row as usize]);
                starts[row as usize + 2] += 1;
            }
        }
        for row in 2..starts.len() {
            starts[row] += starts[row - 1];
        }
        roles.clear();
        roles.resize(starts[count + 1] as usize, Role::default());
        for (index, part) in parts.enumerate() {
            for member in taking_part(part) {
                // Each row's start, kept one place up meanwhile, moves to the next one's.
                let place = &mut starts[block(member) as usize + 1];
                roles[*place as usize] = Role { part: index as u32, member: member as u32 };
                *place += 1;
            }
        }
        for entry in joined.entries() {
            first[entry.row as usize] = first[entry.row as usize].min(entry.other);
        }
        self.wide = Envelope::cost(first) > if joined.is_empty() { WIDE } else { WIDE_JOINED };
        if !self.wide {
            self.matrix.reset(first);
        }
        let (wide, matrix) = (self.wide, &mut self.blocks_of_matrix);
        // Of a factor the lower half.
        let is_needed = |row: usize, other: u32| other < row as u32 || wide && other > row as u32;
        couplings.clear();
        matrix.clear();
        for row in 0..count {
            for role in &roles[starts[row] as usize..starts[row + 1] as usize] {
                for other in taking_part(members_of(role.part as usize)) {
                    if is_needed(row, block(other)) {
                        couplings.push(Coupling::Part { part: role.part, members: [role.member, other as u32] });
                        matrix.couple(block(other));
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
    }

    /// Residual `M (x - free) - h Σ forces` and its derivative. Each part, then each row and each block is worked out by
    /// one worker.
    fn assemble(&mut self, x: &[f64], free: &[f64], fixed: &[Motion], h: f64, with_matrix: bool, team: &Team) {
        let mut parts = std::mem::take(&mut self.parts);
        let count = self.groups.len() + self.ties.len();
        parts.resize(count, Part::default());
        team.each_mut(&mut parts, team.share(count, GROUPS), |index, part| match self.groups.get(index) {
            Some(group) => {
                let relative = self.relative_of(group.members, x, fixed);
                part.push = group.respond(&self.points, &relative, h, with_matrix.then_some(&mut part.slope));
                part.resists = part.push.all != Wrench::default();
            }
            None => {
                let tie = &self.ties[index - self.groups.len()];
                let (force, ll) = tie.respond(&self.relative_of(tie.members, x, fixed).linear, h);
                part.push.all = Wrench { force, torque: Vec3::zeros() };
                (part.slope, part.resists) = (Slope { ll, ..Slope::default() }, true);
            }
        });
        self.parts = parts;
        let Self { parts, members, joined, masses, roles, starts, couplings, diagonal, residual, .. } = self;
        let (parts, members, masses, roles) = (&*parts, &*members, &*masses, &*roles);
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
                let member = &members[role.member as usize];
                let Wrench { force, torque } = member.wrench(&parts[role.part as usize].push.all);
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
                let (part, member) = (&parts[role.part as usize], &members[role.member as usize]);
                if part.resists {
                    *sum += member.block(&part.slope, member) * h;
                }
            }
        });
        let couplings = &*couplings;
        let block = |index: usize| match couplings[index] {
            Coupling::Part { part, members: [row, other] } => {
                let part = &parts[part as usize];
                part.resists.then(|| members[row as usize].block(&part.slope, &members[other as usize]) * h)
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
            self.matrix.add(row, row, block);
        }
        for (index, coupling) in couplings.iter().enumerate() {
            if let Some(block) = block(index) {
                let [row, other] = match coupling {
                    Coupling::Part { members: pair, .. } => {
                        pair.map(|member| self.blocks[members[member as usize].link as usize])
                    }
                    Coupling::Joined(entry) => {
                        let entry = &joined.entries()[*entry as usize];
                        [entry.row, entry.other]
                    }
                };
                self.matrix.add(row as usize, other as usize, &block);
            }
        }
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
