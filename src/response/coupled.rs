//! The contacts of an island at one pose, linear in the velocities, and the velocities that satisfy them all at once:
//! the inner problem of the [implicit response](super::implicit).
//!
//! At a point of a contact surface with pressure `p`, stiffness an area `g` and normal `n` (from a to b), the pressure
//! at the end of the step is `[p - h g n·(u - u_k)]₊` for the relative velocity `u` of b, when the surface was evaluated
//! at the pose that `u_k` leads to. Friction and dissipation act with that pressure. What is sought is
//! `M (v - v*) = h Σ forces`, by Newton's method on a system that stays symmetric and positive definite.

use nalgebra::{Matrix6, Vector6};

use super::conjugate::Blocks;
use super::envelope::{BLOCK, Envelope};
use super::springs::Tie;
use crate::base::{Inertia, Motion};
use crate::contact::press::Material;
use crate::math::{Mat3, Quat, Twist, Vec3, Wrench, rotate_tensor};
use crate::team::Team;

/// A point of a contact.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Where, from the group's centre \[m\].
    pub arm: Vec3,
    /// From a to b.
    pub normal: Vec3,
    /// Force along the normal at the pose of the evaluation; negative where there is a gap yet \[N\].
    pub load: f64,
    /// Its change a metre of approach \[N/m\].
    pub stiffness: f64,
    /// Its area \[m²\].
    pub area: f64,
}

/// A link that carries a group of points.
#[derive(Clone, Copy, Debug)]
pub struct Member {
    /// Slot of the link.
    pub link: u32,
    /// Its part of the points' velocity: positive on b, negative on a.
    pub weight: f64,
    /// The group's centre from the link's centre of mass \[m\].
    pub arm: Vec3,
    /// The link can turn; a point mass cannot.
    pub turns: bool,
}

impl Member {
    /// Velocity of the link's material about the group's centre.
    fn twist(&self, of_link: &Twist) -> Twist {
        if self.turns {
            Twist { linear: of_link.at(&self.arm), angular: of_link.angular }
        } else {
            Twist { linear: of_link.linear, angular: Vec3::zeros() }
        }
    }

    /// What a wrench about the group's centre is to the link.
    fn wrench(&self, about_center: &Wrench) -> Wrench {
        let torque = if self.turns { about_center.torque + self.arm.cross(&about_center.force) } else { Vec3::zeros() };
        Wrench { force: about_center.force, torque }
    }

    /// Rows of a slope about the group's centre, as rows about the link's: [`wrench`](Self::wrench) of each column.
    fn back(&self, slope: &Slope) -> Slope {
        if !self.turns {
            return Slope { al: Mat3::zeros(), aa: Mat3::zeros(), ..*slope };
        }
        let cross = self.arm.cross_matrix();
        Slope { al: slope.al + cross * slope.ll, aa: slope.aa + cross * slope.la, ..*slope }
    }

    /// Columns of a slope about the group's centre, as columns for the link's velocities: [`twist`](Self::twist) of each
    /// row.
    fn forth(&self, slope: &Slope) -> Slope {
        if !self.turns {
            return Slope { la: Mat3::zeros(), aa: Mat3::zeros(), ..*slope };
        }
        let cross = self.arm.cross_matrix();
        Slope { la: slope.la - slope.ll * cross, aa: slope.aa - slope.al * cross, ..*slope }
    }
}

/// A matrix from velocities to wrenches, in four blocks: force and torque by linear and angular velocity.
#[derive(Clone, Copy, Debug, Default)]
struct Slope {
    ll: Mat3,
    la: Mat3,
    al: Mat3,
    aa: Mat3,
}

impl Slope {
    fn to_matrix(self, scale: f64) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        for (row, column, block) in [(0, 0, self.ll), (0, 3, self.la), (3, 0, self.al), (3, 3, self.aa)] {
            matrix.fixed_view_mut::<3, 3>(row, column).copy_from(&(block * scale));
        }
        matrix
    }
}

/// Dry friction of a group.
#[derive(Clone, Copy, Debug, Default)]
pub struct Grip {
    /// Friction force over normal force.
    pub coefficient: f64,
    /// Slip velocity up to which the force grows \[m/s\].
    pub creep: f64,
    /// Slip that it wants at the centre: what takes back the bend of a bristle \[m/s\].
    pub slip: Vec3,
    /// Turn about the mean normal that it wants \[rad/s\].
    pub spin: Vec3,
    /// Lever of its torsional friction, for a patch that is one point \[m\].
    pub radius: f64,
}

/// Points that the same links carry, in the same parts.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    /// Which candidate it belongs to.
    pub candidate: u32,
    /// Which of its patches; none for a gap that may close.
    pub patch: Option<u32>,
    /// Centre of the group, in the pair's frame.
    pub center: Vec3,
    /// First and last-plus-one of its points.
    pub points: (usize, usize),
    /// First and last-plus-one of its members.
    pub members: (usize, usize),
    /// How it damps.
    pub material: Material,
    /// How it rubs.
    pub grip: Grip,
    /// Relative velocity at the evaluation.
    pub base: Twist,
}

/// What a group's points come to at some velocity.
#[derive(Clone, Copy, Debug, Default)]
pub struct Push {
    /// Force and torque on b about the centre, all told.
    pub all: Wrench,
    /// The same without dry friction.
    pub pressing: Wrench,
}

/// The contacts of an island at one pose.
#[derive(Debug, Default)]
pub struct Coupled {
    /// All groups.
    pub groups: Vec<Group>,
    /// Points of all groups.
    pub points: Vec<Point>,
    /// Springs.
    pub ties: Vec<Tie>,
    /// Members of all groups, then of all ties.
    pub members: Vec<Member>,
    masses: Vec<Matrix6<f64>>,
    mobilities: Vec<Matrix6<f64>>,
    blocks: Vec<u32>,
    first: Vec<u32>,
    /// The system is too wide for a factor.
    wide: bool,
    matrix: Envelope,
    blocks_of_matrix: Blocks,
    parts: Vec<Part>,
    residual: Vec<f64>,
    base: Vec<f64>,
    step: Vec<f64>,
}

/// A group's part of the system.
#[derive(Clone, Debug, Default)]
struct Part {
    /// On b, about the group's centre.
    push: Wrench,
    slope: Slope,
    /// Rows and columns of the matrix: those of two members, and of the second by the first between them.
    blocks: [Matrix6<f64>; 3],
}

/// Least groups that a worker takes in one go.
const GROUPS: usize = 16;

/// Steps of Newton's method in one solve.
const MOST_STEPS: usize = 60;

/// Looks along one step for its lowest point.
const MOST_LOOKS: usize = 12;

/// Slope along a step, over the slope at its start, that counts as lowest.
const FLAT: f64 = 0.2;

/// Residual over the kinetic energy at work, both squared, that counts as solved.
const SOLVED: f64 = 1e-18;

/// The same with springs: what the residual leaves is a velocity, which stretches a stiff one.
const SOLVED_TIES: f64 = 1e-26;

/// Products of a factor beyond which conjugate gradients are quicker.
const WIDE: usize = 100_000;

/// Least and most that conjugate gradients leave of a Newton step.
const GRADIENTS: (f64, f64) = (1e-6, 1e-2);

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

    /// Velocity of b relative to a over the members of a group, about its centre, or of a tie, for velocities `of` the
    /// links.
    pub fn relative(&self, members: (usize, usize), of: impl Fn(u32) -> Twist) -> Twist {
        let mut sum = Twist::default();
        for member in &self.members[members.0..members.1] {
            let twist = member.twist(&of(member.link));
            sum.linear += twist.linear * member.weight;
            sum.angular += twist.angular * member.weight;
        }
        sum
    }

    /// The relative velocity over some members for the unknowns `x`; `fixed` has the velocities of links without unknowns.
    pub fn relative_of(&self, members: (usize, usize), x: &[f64], fixed: &[Motion]) -> Twist {
        self.relative(members, |link| match self.blocks[link as usize] {
            NONE => fixed[link as usize].twist,
            block => twist_of(x, block),
        })
    }

    /// The velocities of a link in the unknowns `x`, if it has any.
    pub fn twist_in(&self, link: u32, x: &[f64]) -> Option<Twist> {
        Some(self.blocks[link as usize]).filter(|block| *block != NONE).map(|block| twist_of(x, block))
    }

    /// What a group comes to at the unknowns `x`.
    pub fn push(&self, group: &Group, x: &[f64], fixed: &[Motion], h: f64) -> Push {
        self.respond(group, &self.relative_of(group.members, x, fixed), h, None)
    }

    /// Solves for the velocities at the end of the step, in place; `free` has those without contact, `fixed` those of
    /// the links without unknowns. False when it does not get there.
    ///
    /// But for the pressure's part in friction, the residual is the gradient of a convex function. Newton's method
    /// overshoots its lowest point where a slip comes to rest, so each step goes to the lowest point along it.
    pub fn solve(&mut self, x: &mut [f64], free: &[f64], fixed: &[Motion], h: f64, team: &Team) -> bool {
        self.shape(x.len() / BLOCK);
        self.assemble(x, free, fixed, h, true, team);
        let mut norm = self.norm(&self.residual);
        let scale = norm + self.energy(x) + self.energy(free);
        let solved = if self.ties.is_empty() { SOLVED } else { SOLVED_TIES };
        for _ in 0..MOST_STEPS {
            if norm <= solved * scale {
                return true;
            }
            self.step.clone_from(&self.residual);
            // As exactly as it takes to be done after this step, or as a step of Newton's method can use.
            let enough = (0.3 * (solved * scale / norm).sqrt()).clamp(GRADIENTS.0, GRADIENTS.1);
            if !self.solve_step(enough, team) {
                return false;
            }
            self.base.clear();
            self.base.extend_from_slice(x);
            let last = norm;
            self.go_lowest(x, free, fixed, h, team);
            norm = self.norm(&self.residual);
            // Sums of contact forces round off.
            if norm > 0.9 * last && norm <= 1e-16 * scale {
                return true;
            }
        }
        norm <= 1e-10 * scale
    }

    fn solve_step(&mut self, enough: f64, team: &Team) -> bool {
        if self.wide {
            return self.blocks_of_matrix.solve(&mut self.step, enough, MOST_GRADIENTS, team);
        }
        let definite = self.matrix.factor();
        if definite {
            self.matrix.solve(&mut self.step);
        }
        definite
    }

    fn add(&mut self, i: usize, j: usize, block: &Matrix6<f64>) {
        if self.wide {
            self.blocks_of_matrix.add(i, j, block);
        } else {
            self.matrix.add(i, j, block);
        }
    }

    fn put_step(&self, x: &mut [f64], part: f64) {
        for (x, (base, step)) in x.iter_mut().zip(self.base.iter().zip(&self.step)) {
            *x = base - part * step;
        }
    }

    /// Takes the step to where the slope along it has fallen to a small part, and assembles the system there.
    fn go_lowest(&mut self, x: &mut [f64], free: &[f64], fixed: &[Motion], h: f64, team: &Team) {
        let along = |residual: &[f64], step: &[f64]| -> f64 { residual.iter().zip(step).map(|(r, s)| r * s).sum() };
        let start = along(&self.residual, &self.step);
        let (mut low, mut slope_low) = (0.0, start);
        let (mut high, mut slope_high) = (1.0, 0.0);
        let mut part = 1.0;
        for look in 0..MOST_LOOKS {
            self.put_step(x, part);
            // Nearly all steps are good as a whole.
            self.assemble(x, free, fixed, h, look == 0, team);
            let slope = along(&self.residual, &self.step);
            if slope.abs() <= FLAT * start || slope >= 0.0 && part == 1.0 {
                if look == 0 {
                    return;
                }
                break;
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
        self.assemble(x, free, fixed, h, true, team);
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

    /// The envelope that groups and ties need.
    fn shape(&mut self, count: usize) {
        self.first.clear();
        self.first.extend(0..count as u32);
        let groups = self.groups.iter().map(|group| group.members);
        for (first, end) in groups.chain(self.ties.iter().map(|tie| tie.members)) {
            let blocks = || {
                let members = self.members[first..end].iter();
                members.map(|member| self.blocks[member.link as usize]).filter(|block| *block != NONE)
            };
            let Some(lowest) = blocks().min() else { continue };
            for block in blocks() {
                let first = &mut self.first[block as usize];
                *first = lowest.min(*first);
            }
        }
        self.wide = Envelope::cost(&self.first) > WIDE;
        if !self.wide {
            self.matrix.reset(&self.first);
        }
    }

    /// Residual `M (x - free) - h Σ forces` and its derivative.
    fn assemble(&mut self, x: &[f64], free: &[f64], fixed: &[Motion], h: f64, with_matrix: bool, team: &Team) {
        if with_matrix && self.wide {
            self.blocks_of_matrix.reset(self.masses.len());
        } else if with_matrix {
            self.matrix.zero();
        }
        self.residual.clear();
        for block in 0..self.masses.len() {
            let mass = self.masses[block];
            let range = block * BLOCK..(block + 1) * BLOCK;
            let change =
                Vector6::from_column_slice(&x[range.clone()]) - Vector6::from_column_slice(&free[range.clone()]);
            self.residual.extend_from_slice((mass * change).as_slice());
            if with_matrix {
                self.add(block, block, &mass);
            }
        }
        let mut parts = std::mem::take(&mut self.parts);
        let groups = self.groups.len();
        parts.resize_with(groups + self.ties.len(), Part::default);
        let block = team.share(parts.len(), GROUPS);
        team.each_mut(&mut parts, block, |index, part| match self.groups.get(index) {
            Some(group) => self.work_out(group, x, fixed, h, with_matrix, part),
            None => self.work_out_tie(&self.ties[index - groups], x, fixed, h, with_matrix, part),
        });
        for (index, part) in parts[..groups].iter().enumerate() {
            if part.push != Wrench::default() {
                self.put(self.groups[index].members, part, h, with_matrix);
            }
        }
        for (index, part) in parts[groups..].iter().enumerate() {
            self.put(self.ties[index].members, part, h, with_matrix);
        }
        self.parts = parts;
    }

    /// Works out a group's part of the system.
    fn work_out(&self, group: &Group, x: &[f64], fixed: &[Motion], h: f64, with_matrix: bool, part: &mut Part) {
        let relative = self.relative_of(group.members, x, fixed);
        part.push = self.respond(group, &relative, h, with_matrix.then_some(&mut part.slope)).all;
        let (first, end) = group.members;
        if with_matrix && end - first <= 2 && part.push != Wrench::default() {
            self.work_out_blocks(group.members, h, part);
        }
    }

    /// Works out a tie's part of the system.
    fn work_out_tie(&self, tie: &Tie, x: &[f64], fixed: &[Motion], h: f64, with_matrix: bool, part: &mut Part) {
        let (force, ll) = tie.respond(&self.relative_of(tie.members, x, fixed).linear, h);
        part.push = Wrench { force, torque: Vec3::zeros() };
        if with_matrix {
            part.slope = Slope { ll, ..Slope::default() };
            self.work_out_blocks(tie.members, h, part);
        }
    }

    /// Works out the blocks of at most two members.
    fn work_out_blocks(&self, (first, end): (usize, usize), h: f64, part: &mut Part) {
        for row in 0..end - first {
            for other in 0..=row {
                part.blocks[row + other] = self.block(&part.slope, first + row, first + other, h);
            }
        }
    }

    /// How a member's rows of the system change with the velocities of another.
    fn block(&self, slope: &Slope, row: usize, other: usize, h: f64) -> Matrix6<f64> {
        let (member, other) = (self.members[row], self.members[other]);
        other.forth(&member.back(slope)).to_matrix(h * member.weight * other.weight)
    }

    /// Adds a group's part to the system.
    fn put(&mut self, (first, end): (usize, usize), part: &Part, h: f64, with_matrix: bool) {
        for row in first..end {
            let member = self.members[row];
            let i = self.blocks[member.link as usize];
            if i == NONE {
                continue;
            }
            let push = member.wrench(&part.push);
            let residual = &mut self.residual[i as usize * BLOCK..];
            for axis in 0..3 {
                residual[axis] -= h * member.weight * push.force[axis];
                residual[3 + axis] -= h * member.weight * push.torque[axis];
            }
            if !with_matrix {
                continue;
            }
            for other in first..=row {
                let link = self.members[other].link;
                let j = self.blocks[link as usize];
                if j == NONE {
                    continue;
                }
                let block = if end - first <= 2 {
                    part.blocks[row + other - 2 * first]
                } else {
                    self.block(&part.slope, row, other, h)
                };
                if i > j || i == j && link == member.link {
                    self.add(i as usize, j as usize, &block);
                } else {
                    self.add(j as usize, i as usize, &block.transpose());
                }
            }
        }
    }

    /// Force and torque of a group on b at a relative velocity; in `slope` minus their derivative by that velocity, without the part that would make it lopsided.
    fn respond(&self, group: &Group, relative: &Twist, h: f64, slope: Option<&mut Slope>) -> Push {
        let Material { dissipation, viscous, .. } = group.material;
        let grip = &group.grip;
        let since =
            Twist { linear: relative.linear - group.base.linear, angular: relative.angular - group.base.angular };
        let (mut normal_load, mut mean_normal) = (0.0, Vec3::zeros());
        let mut push = Push::default();
        // Everything about the centre; the slope as blocks.
        let (mut ll, mut la, mut aa) = (Mat3::zeros(), Mat3::zeros(), Mat3::zeros());
        for point in &self.points[group.points.0..group.points.1] {
            let pressing = point.load - h * point.stiffness * point.normal.dot(&since.at(&point.arm));
            if pressing <= 0.0 {
                continue;
            }
            let velocity = relative.at(&point.arm);
            let parting = point.normal.dot(&velocity);
            let damping = (1.0 - dissipation * parting).max(0.0);
            let drag = viscous * point.area;
            let load = (pressing * damping - drag * parting).max(0.0);
            let mut force = point.normal * load - (velocity - point.normal * parting) * drag;
            push.pressing.add_force_at(&force, &point.arm);
            let stiff = if load > 0.0 {
                let damped = if damping > 0.0 { pressing * dissipation } else { 0.0 };
                h * point.stiffness * damping + damped + drag
            } else {
                0.0
            };
            let mut matrix = None;
            if drag > 0.0 {
                let along = point.normal * point.normal.transpose();
                matrix = Some(Mat3::identity() * drag - along * drag);
            }
            if grip.coefficient > 0.0 && load > 0.0 {
                normal_load += load;
                mean_normal += point.normal * load;
                let wanted = grip.slip + grip.spin.cross(&point.arm);
                let slip = velocity - wanted;
                let slip = slip - point.normal * slip.dot(&point.normal);
                let speed = (slip.norm_squared() + grip.creep * grip.creep).sqrt();
                let most = grip.coefficient * load / speed;
                force -= slip * most;
                if slope.is_some() {
                    let plane = Mat3::identity() - point.normal * point.normal.transpose();
                    let resists = (plane - slip * slip.transpose() / (speed * speed)) * most;
                    matrix = Some(matrix.map_or(resists, |drag| drag + resists));
                }
            }
            push.all.add_force_at(&force, &point.arm);
            if slope.is_some() {
                let lever = point.arm.cross(&point.normal);
                let stiff_normal = point.normal * stiff;
                ll += stiff_normal * point.normal.transpose();
                la += stiff_normal * lever.transpose();
                aa += lever * lever.transpose() * stiff;
                if let Some(matrix) = matrix {
                    // d(force)/d(linear, angular) = matrix (I, -[arm]), and the torque is [arm] times the force.
                    let cross = point.arm.cross_matrix();
                    ll += matrix;
                    la -= matrix * cross;
                    aa -= cross * matrix * cross;
                }
            }
        }
        if grip.radius > 0.0 && normal_load > 0.0 && mean_normal != Vec3::zeros() {
            let axis = mean_normal.normalize();
            let spin = (relative.angular - grip.spin).dot(&axis);
            let creep = grip.creep / grip.radius;
            let rate = (spin * spin + creep * creep).sqrt();
            let most = grip.coefficient * normal_load * grip.radius;
            push.all.torque -= axis * (most * spin / rate);
            aa += axis * axis.transpose() * (most / rate * (1.0 - (spin / rate).powi(2)));
        }
        if let Some(slope) = slope {
            *slope = Slope { ll, la, al: la.transpose(), aa };
        }
        push
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
