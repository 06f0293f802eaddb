//! A group of contact points in an [implicit step](super::implicit): what it comes to at a velocity, and how that changes
//! with the velocity.
//!
//! At a point of a contact surface with pressure `p`, stiffness an area `g` and normal `n` (from a to b), the pressure
//! at the end of the step is `[p - h g n·(u - u_k)]₊` for the relative velocity `u` of b, when the surface was evaluated
//! at the pose that `u_k` leads to. Friction and dissipation act with that pressure.

use std::ops::Range;

use nalgebra::Matrix6;

use crate::contact::patch::Node;
use crate::contact::press::Material;
use crate::field::lanes::{Dispatch, Kernel, Lanes};
use crate::math::{Mat3, Twist, Vec3, Wrench};

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

/// Points that are worked on side by side: always as many, so that sums are the same in registers of any width.
const LANES: usize = 8;

/// Points of many groups, each figure in a row of its own. Behind a group of more than one come points without a load,
/// to a multiple of [`LANES`].
#[derive(Debug, Default)]
pub struct Points {
    arm: [Vec<f64>; 3],
    normal: [Vec<f64>; 3],
    load: Vec<f64>,
    stiffness: Vec<f64>,
    area: Vec<f64>,
}

impl Points {
    fn rows_mut(&mut self) -> [&mut Vec<f64>; 9] {
        let Self { arm: [x, y, z], normal: [u, v, w], load, stiffness, area } = self;
        [x, y, z, u, v, w, load, stiffness, area]
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.load.len()
    }

    /// Forgets them.
    pub fn clear(&mut self) {
        for row in self.rows_mut() {
            row.clear();
        }
    }

    /// Leaves a range of them a part of their stiffness, with as much less load at the same depth.
    pub fn soften(&mut self, range: Range<usize>, part: f64) {
        for figure in self.load[range.clone()].iter_mut().chain(&mut self.stiffness[range]) {
            *figure *= part;
        }
    }

    /// Adds a point.
    pub fn push(&mut self, Point { arm, normal, load, stiffness, area }: &Point) {
        let figures = [arm.x, arm.y, arm.z, normal.x, normal.y, normal.z, *load, *stiffness, *area];
        for (row, figure) in self.rows_mut().into_iter().zip(figures) {
            row.push(figure);
        }
    }

    /// Adds nodes, and gives their centre of pressure, from which their arms go.
    pub fn extend<'a>(&mut self, nodes: impl Iterator<Item = &'a Node>) -> Vec3 {
        let first = self.count();
        let mut center = Vec3::zeros();
        for node in nodes {
            let load = node.force.norm();
            center += node.position * load;
            let (arm, normal, stiffness, area) = (node.position, node.force / load, node.stiffness, node.area);
            self.push(&Point { arm, normal, load, stiffness, area });
        }
        center /= self.load[first..].iter().sum::<f64>();
        for (row, center) in self.arm.iter_mut().zip(center.iter()) {
            row[first..].iter_mut().for_each(|arm| *arm -= center);
        }
        let count = self.count() - first;
        if count > 1 {
            let end = first + count.next_multiple_of(LANES);
            for row in self.rows_mut() {
                row.resize(end, 0.0);
            }
        }
        center
    }

    /// One of them.
    pub fn get(&self, index: usize) -> Point {
        Point {
            arm: Vec3::from(self.arm.each_ref().map(|row| row[index])),
            normal: Vec3::from(self.normal.each_ref().map(|row| row[index])),
            load: self.load[index],
            stiffness: self.stiffness[index],
            area: self.area[index],
        }
    }

    /// Areas and stiffnesses of some, added up.
    pub fn sums(&self, (first, end): (usize, usize)) -> (f64, f64) {
        (self.area[first..end].iter().sum(), self.stiffness[first..end].iter().sum())
    }
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
    pub fn twist(&self, of_link: &Twist) -> Twist {
        if self.turns {
            Twist { linear: of_link.at(&self.arm), angular: of_link.angular }
        } else {
            Twist { linear: of_link.linear, angular: Vec3::zeros() }
        }
    }

    /// What a wrench about the group's centre is to the link.
    pub fn wrench(&self, about_center: &Wrench) -> Wrench {
        let torque = if self.turns { about_center.torque + self.arm.cross(&about_center.force) } else { Vec3::zeros() };
        Wrench { force: about_center.force, torque }
    }

    /// What a wrench that follows a twist by `slope`, both about the group's centre, is to this link when `other` moves:
    /// [`wrench`](Self::wrench) of each column, by [`twist`](Self::twist) of each row.
    pub fn block(&self, slope: &Slope, other: &Member) -> Matrix6<f64> {
        let Slope { ll, mut la, mut aa } = *slope;
        let mut al = la.transpose();
        if other.turns {
            la -= times_cross(&ll, &other.arm);
            aa -= times_cross(&al, &other.arm);
        } else {
            (la, aa) = (Mat3::zeros(), Mat3::zeros());
        }
        if self.turns {
            al += cross_times(&self.arm, &ll);
            aa += cross_times(&self.arm, &la);
        } else {
            (al, aa) = (Mat3::zeros(), Mat3::zeros());
        }
        let mut matrix = Matrix6::zeros();
        for (row, column, block) in [(0, 0, ll), (0, 3, la), (3, 0, al), (3, 3, aa)] {
            matrix.fixed_view_mut::<3, 3>(row, column).copy_from(&(block * (self.weight * other.weight)));
        }
        matrix
    }
}

/// Velocity of b relative to a over the members of a group, about its centre, or of a tie, for velocities `of` the links.
pub fn relative(members: &[Member], of: impl Fn(u32) -> Twist) -> Twist {
    let mut sum = Twist::default();
    for member in members {
        let twist = member.twist(&of(member.link));
        sum.linear += twist.linear * member.weight;
        sum.angular += twist.angular * member.weight;
    }
    sum
}

/// `[arm] matrix`: the cross product with each column.
fn cross_times(arm: &Vec3, matrix: &Mat3) -> Mat3 {
    Mat3::from_columns(&[0, 1, 2].map(|column| arm.cross(&matrix.column(column))))
}

/// `matrix [arm]`.
fn times_cross(matrix: &Mat3, arm: &Vec3) -> Mat3 {
    -cross_times(arm, &matrix.transpose()).transpose()
}

/// A symmetric matrix from twists to wrenches about one point, in blocks. Torque by linear velocity is the transpose of
/// force by angular velocity.
#[derive(Clone, Copy, Debug, Default)]
pub struct Slope {
    /// Force by linear velocity.
    pub ll: Mat3,
    /// Force by angular velocity.
    pub la: Mat3,
    /// Torque by angular velocity.
    pub aa: Mat3,
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

/// What a group is of, in its candidate's surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// One of the patches, or the part of it that some links carry.
    Patch(u32),
    /// The push-out of one of the overloads.
    Overload(u32),
    /// A gap that may close, or a wall of the last resort.
    Gap,
}

/// Points that the same links carry, in the same parts.
#[derive(Clone, Copy, Debug)]
pub struct Group {
    /// Which candidate it belongs to.
    pub candidate: u32,
    /// What of it.
    pub source: Source,
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
    /// Its surface was evaluated before this step: the base is known.
    pub looked: bool,
    /// Relative velocity at the evaluation.
    pub base: Twist,
}

impl Group {
    /// What its points come to at a relative velocity; in `slope` minus the derivative by that velocity, without the
    /// part that would make it lopsided.
    pub fn respond(&self, points: &Points, relative: &Twist, h: f64, slope: Option<&mut Slope>) -> Push {
        let question = Question { group: self, points, relative, h, with_slope: slope.is_some() };
        let sums = match (self.points.1 - self.points.0, question.with_slope) {
            (1, false) => question.of_one::<LL>(),
            (1, true) => question.of_one::<COUNT>(),
            _ => Dispatch::best().run(question),
        };
        let vector = |first: usize| Vec3::from_column_slice(&sums[first..first + 3]);
        let wrench = |first: usize| Wrench { force: vector(first), torque: vector(first + 3) };
        let mut push = Push { all: wrench(ALL), pressing: wrench(PRESSING) };
        let twist = self.torsion(relative, sums[LOAD], vector(NORMAL));
        if let Some((torque, _)) = twist {
            push.all.torque += torque;
        }
        if let Some(slope) = slope {
            let symmetric = |first: usize| {
                let [xx, xy, xz, yy, yz, zz] = std::array::from_fn(|entry| sums[first + entry]);
                Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
            };
            let la = Mat3::from_row_slice(&sums[AL..AL + 9]);
            *slope = Slope { ll: symmetric(LL), la, aa: symmetric(AA) };
            if let Some((_, along)) = twist {
                slope.aa += along;
            }
        }
        push
    }

    /// Torque of the torsional friction of a patch that is one point, and its slope.
    fn torsion(&self, relative: &Twist, load: f64, mean_normal: Vec3) -> Option<(Vec3, Mat3)> {
        let grip = &self.grip;
        if grip.radius <= 0.0 || load <= 0.0 || mean_normal == Vec3::zeros() {
            return None;
        }
        let axis = mean_normal.normalize();
        let spin = (relative.angular - grip.spin).dot(&axis);
        let creep = grip.creep / grip.radius;
        let rate = (spin * spin + creep * creep).sqrt();
        let most = grip.coefficient * load * grip.radius;
        let slope = axis * axis.transpose() * (most / rate * (1.0 - (spin / rate).powi(2)));
        Some((-axis * (most * spin / rate), slope))
    }
}

/// A question to a group.
struct Question<'a> {
    group: &'a Group,
    points: &'a Points,
    relative: &'a Twist,
    h: f64,
    with_slope: bool,
}

/// Points that are worked on in one go.
const CHUNK: usize = 2 * LANES;

// What is summed over the points of a group, in a list: where each begins.
/// The wrench of what presses.
const PRESSING: usize = 0;
/// The whole wrench.
const ALL: usize = PRESSING + 6;
/// The load that rubs.
const LOAD: usize = ALL + 6;
/// Its normals, weighted with it.
const NORMAL: usize = LOAD + 1;
/// Minus the derivative of force by velocity: on and below the diagonal.
const LL: usize = NORMAL + 3;
/// Of torque by velocity: all of it.
const AL: usize = LL + 6;
/// Of torque by angular velocity: on and below the diagonal.
const AA: usize = AL + 9;
/// Length of the list.
const COUNT: usize = AA + 6;

impl Kernel for Question<'_> {
    type Output = [f64; COUNT];

    #[inline(always)]
    fn run<const W: usize>(self) -> [f64; COUNT] {
        if self.with_slope { self.sums::<COUNT>() } else { self.sums::<LL>() }
    }
}

impl Question<'_> {
    /// The first `ROWS` of the list, over all points. Room for more than is wanted would have to be cleared each time.
    #[inline(always)]
    fn sums<const ROWS: usize>(&self) -> [f64; COUNT] {
        let (first, end) = self.group.points;
        // As constants they are cleared at once, and not row by row.
        let (mut sums, mut values) = const { ([[0.0; LANES]; ROWS], [[0.0; CHUNK]; ROWS]) };
        for first in (first..end).step_by(CHUNK) {
            let count = CHUNK.min((end - first).next_multiple_of(LANES));
            self.answer(first, count, &mut values);
            for (sums, values) in sums.iter_mut().zip(&values) {
                for values in values[..count].chunks_exact(LANES) {
                    for (sum, value) in sums.iter_mut().zip(values) {
                        *sum += value;
                    }
                }
            }
        }
        let mut list = [0.0; COUNT];
        for (figure, sums) in list.iter_mut().zip(sums) {
            *figure = Lanes(sums).sum();
        }
        list
    }

    /// The same for a lone point.
    #[inline(always)]
    fn of_one<const ROWS: usize>(&self) -> [f64; COUNT] {
        let mut values = [[0.0]; ROWS];
        self.answer(self.group.points.0, 1, &mut values);
        let mut list = [0.0; COUNT];
        list[..ROWS].copy_from_slice(values.as_flattened());
        list
    }

    /// What each of `count` points comes to.
    #[inline(always)]
    fn answer<const N: usize, const ROWS: usize>(&self, first: usize, count: usize, values: &mut [[f64; N]; ROWS]) {
        if self.group.grip.coefficient > 0.0 {
            self.each::<N, ROWS, true>(first, count, values);
        } else {
            self.each::<N, ROWS, false>(first, count, values);
        }
    }

    // Plain numbers point by point, without a branch: so the compiler works on many side by side.
    #[inline(always)]
    fn each<const N: usize, const ROWS: usize, const FRICTION: bool>(
        &self,
        first: usize,
        count: usize,
        values: &mut [[f64; N]; ROWS],
    ) {
        let Self {
            group: Group { material: Material { dissipation, viscous, .. }, grip, base, .. }, relative, h, ..
        } = self;
        let since = Twist { linear: relative.linear - base.linear, angular: relative.angular - base.angular };
        let creep2 = grip.creep * grip.creep;
        let count = count.min(N);
        // Slices of one length, for which one check will do.
        let Points { arm: [x, y, z], normal: [u, v, w], load, stiffness, area } = self.points;
        let range = first..first + count;
        let (x, y, z) = (&x[range.clone()], &y[range.clone()], &z[range.clone()]);
        let (u, v, w) = (&u[range.clone()], &v[range.clone()], &w[range.clone()]);
        let (load, stiffness, area) = (&load[range.clone()], &stiffness[range.clone()], &area[range]);
        for i in 0..count {
            let (arm, normal) = (Vec3::new(x[i], y[i], z[i]), Vec3::new(u[i], v[i], w[i]));
            let pressing = load[i] - h * stiffness[i] * normal.dot(&since.at(&arm));
            let presses = pressing > 0.0;
            let velocity = relative.at(&arm);
            let parting = normal.dot(&velocity);
            let damping = larger(1.0 - dissipation * parting, 0.0);
            let drag = if presses { viscous * area[i] } else { 0.0 };
            let load = if presses { larger(pressing * damping - drag * parting, 0.0) } else { 0.0 };
            let mut put = |at: usize, value: f64| values[at][i] = value;
            let mut put_vector = |at: usize, value: Vec3| {
                put(at, value.x);
                put(at + 1, value.y);
                put(at + 2, value.z);
            };
            let mut force = normal * load - (velocity - normal * parting) * drag;
            put_vector(PRESSING, force);
            put_vector(PRESSING + 3, arm.cross(&force));
            // What resists across, along, and less along the slip.
            let damped = if damping > 0.0 { pressing * dissipation } else { 0.0 };
            let across = if load > 0.0 { h * stiffness[i] * damping + damped + drag } else { 0.0 };
            let (mut along, mut slip, mut spared) = (drag, Vec3::zeros(), 0.0);
            if FRICTION {
                slip = velocity - grip.slip - grip.spin.cross(&arm);
                slip -= normal * slip.dot(&normal);
                let speed2 = slip.norm_squared() + creep2;
                let most = grip.coefficient * load / speed2.sqrt();
                force -= slip * most;
                along += most;
                spared = most / speed2;
            }
            put_vector(ALL, force);
            put_vector(ALL + 3, arm.cross(&force));
            put_vector(NORMAL, normal * load);
            values[LOAD][i] = load;
            if ROWS > LL {
                let mut ll = normal * (normal * (across - along)).transpose();
                if FRICTION {
                    ll -= slip * (slip * spared).transpose();
                }
                ll += Mat3::from_diagonal_element(along);
                // Torque by velocity, by columns and by rows; force by turn is its transpose.
                let [a, b, c] = [arm.cross(&ll.column(0)), arm.cross(&ll.column(1)), arm.cross(&ll.column(2))];
                let rows = [Vec3::new(a.x, b.x, c.x), Vec3::new(a.y, b.y, c.y), Vec3::new(a.z, b.z, c.z)];
                let [d, e, f] = [arm.cross(&rows[0]), arm.cross(&rows[1]), arm.cross(&rows[2])];
                let figures = [
                    (LL, [ll.m11, ll.m21, ll.m31]),
                    (LL + 3, [ll.m22, ll.m32, ll.m33]),
                    (AL, [a.x, a.y, a.z]),
                    (AL + 3, [b.x, b.y, b.z]),
                    (AL + 6, [c.x, c.y, c.z]),
                    (AA, [d.x, d.y, d.z]),
                    (AA + 3, [e.y, e.z, f.z]),
                ];
                for (at, [x, y, z]) in figures {
                    values[at][i] = x;
                    values[at + 1][i] = y;
                    values[at + 2][i] = z;
                }
            }
        }
    }
}

/// The larger of two numbers, by one instruction.
#[inline(always)]
fn larger(x: f64, y: f64) -> f64 {
    if y > x { y } else { x }
}

/// What a group's points come to at some velocity.
#[derive(Clone, Copy, Debug, Default)]
pub struct Push {
    /// Force and torque on b about the centre, all told.
    pub all: Wrench,
    /// The same without dry friction.
    pub pressing: Wrench,
}

#[cfg(test)]
mod tests {
    use super::*;

    const H: f64 = 1.0 / 60.0;

    /// A patch of uneven points on a dome, of which some press at this velocity and others don't.
    fn patch(count: usize, friction: f64) -> (Group, Points) {
        let mut points = Points::default();
        let node = |index: usize| {
            let (x, y) = ((index as f64 * 1.3).sin() * 0.1, (index as f64 * 2.1).cos() * 0.1);
            let normal = Vec3::new(x, y, 1.0).normalize();
            Node {
                position: Vec3::new(x, y, -0.5 * (x * x + y * y)),
                force: normal * (1.0 + x),
                area: 0.01,
                stiffness: 400.0,
            }
        };
        let nodes: Vec<Node> = (0..count).map(node).collect();
        let center = points.extend(nodes.iter());
        let group = Group {
            candidate: 0,
            source: Source::Patch(0),
            center,
            points: (0, count),
            members: (0, 0),
            material: Material { dissipation: 0.4, viscous: 3.0, ..Material::default() },
            grip: Grip { coefficient: friction, creep: 0.01, ..Grip::default() },
            looked: false,
            base: Twist { linear: Vec3::new(0.0, 0.01, 0.02), angular: Vec3::new(0.3, 0.0, 0.1) },
        };
        (group, points)
    }

    fn twist() -> Twist {
        Twist { linear: Vec3::new(0.02, -0.03, 0.1), angular: Vec3::new(1.5, -0.7, 0.4) }
    }

    fn six(wrench: &Wrench) -> [f64; 6] {
        let Wrench { force, torque } = wrench;
        [force.x, force.y, force.z, torque.x, torque.y, torque.z]
    }

    #[test]
    fn points_side_by_side_come_to_what_each_does_alone() {
        for (count, friction) in [(2, 0.0), (8, 0.3), (25, 0.0), (25, 0.3), (40, 0.3)] {
            let (group, points) = patch(count, friction);
            let mut slope = Slope::default();
            let push = group.respond(&points, &twist(), H, Some(&mut slope));
            let (mut all, mut ll, mut aa) = ([0.0; 6], Mat3::zeros(), Mat3::zeros());
            let mut pressing = 0;
            for point in 0..count {
                let mut alone = Slope::default();
                let alone_push =
                    Group { points: (point, point + 1), ..group }.respond(&points, &twist(), H, Some(&mut alone));
                pressing += usize::from(alone_push.all != Wrench::default());
                for (sum, x) in all.iter_mut().zip(six(&alone_push.all)) {
                    *sum += x;
                }
                (ll, aa) = (ll + alone.ll, aa + alone.aa);
            }
            assert!(count < 25 || pressing > 0 && pressing < count, "{pressing} of {count} press");
            for (x, sum) in six(&push.all).into_iter().zip(all) {
                assert!((x - sum).abs() < 1e-12);
            }
            assert!((ll - slope.ll).norm() < 1e-11 && (aa - slope.aa).norm() < 1e-12);
        }
    }

    #[test]
    fn without_friction_the_slope_is_the_derivative() {
        let (group, points) = patch(25, 0.0);
        let mut slope = Slope::default();
        group.respond(&points, &twist(), H, Some(&mut slope));
        for column in 0..6 {
            let moved = |by: f64| {
                let mut moved = twist();
                if column < 3 {
                    moved.linear[column] += by
                } else {
                    moved.angular[column - 3] += by
                }
                six(&group.respond(&points, &moved, H, None).all)
            };
            let (less, more) = (moved(-1e-6), moved(1e-6));
            for row in 0..6 {
                let measured = (less[row] - more[row]) / 2e-6;
                let stated = match (row < 3, column < 3) {
                    (true, true) => slope.ll[(row, column)],
                    (true, false) => slope.la[(row, column - 3)],
                    (false, true) => slope.la[(column, row - 3)],
                    (false, false) => slope.aa[(row - 3, column - 3)],
                };
                assert!((measured - stated).abs() < 1e-6 * slope.ll.norm(), "{row} {column}: {measured} {stated}");
            }
        }
    }
}
