//! A group of contact points in an [implicit step](super::implicit): what it comes to at a velocity, and how that changes
//! with the velocity.
//!
//! At a point of a contact surface with pressure `p`, stiffness an area `g` and normal `n` (from a to b), the pressure
//! at the end of the step is `[p - h g n·(u - u_k)]₊` for the relative velocity `u` of b, when the surface was evaluated
//! at the pose that `u_k` leads to. Friction and dissipation act with that pressure.

use nalgebra::Matrix6;

use crate::contact::press::Material;
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

impl Slope {
    /// Adds what resists motion along `direction` at `arm`: as much force as motion there, `factor` times.
    fn add_along(&mut self, direction: &Vec3, arm: &Vec3, factor: f64) {
        let lever = arm.cross(direction);
        let (scaled, scaled_lever) = (direction * factor, lever * factor);
        self.ll += direction * scaled.transpose();
        self.la += direction * scaled_lever.transpose();
        self.aa += lever * scaled_lever.transpose();
    }

    /// Adds what resists all motion at `arm`.
    fn add_all(&mut self, arm: &Vec3, factor: f64) {
        let moment = arm * factor;
        self.ll += Mat3::from_diagonal_element(factor);
        self.la -= moment.cross_matrix();
        self.aa += Mat3::from_diagonal_element(arm.dot(&moment)) - arm * moment.transpose();
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

impl Group {
    /// What its points come to at a relative velocity; in `slope` minus the derivative by that velocity, without the
    /// part that would make it lopsided.
    pub fn respond(&self, points: &[Point], relative: &Twist, h: f64, slope: Option<&mut Slope>) -> Push {
        let Material { dissipation, viscous, .. } = self.material;
        let grip = &self.grip;
        let since = Twist { linear: relative.linear - self.base.linear, angular: relative.angular - self.base.angular };
        let (mut normal_load, mut mean_normal) = (0.0, Vec3::zeros());
        let mut push = Push::default();
        let (mut sum, with_slope) = (Slope::default(), slope.is_some());
        for point in points {
            let Point { arm, normal, .. } = point;
            let pressing = point.load - h * point.stiffness * normal.dot(&since.at(arm));
            if pressing <= 0.0 {
                continue;
            }
            let velocity = relative.at(arm);
            let parting = normal.dot(&velocity);
            let damping = (1.0 - dissipation * parting).max(0.0);
            let drag = viscous * point.area;
            let load = (pressing * damping - drag * parting).max(0.0);
            let mut force = normal * load - (velocity - normal * parting) * drag;
            push.pressing.add_force_at(&force, arm);
            // What resists across, along, and less along the slip.
            let mut across = 0.0;
            if load > 0.0 {
                let damped = if damping > 0.0 { pressing * dissipation } else { 0.0 };
                across = h * point.stiffness * damping + damped + drag;
            }
            let mut along = drag;
            if grip.coefficient > 0.0 && load > 0.0 {
                normal_load += load;
                mean_normal += normal * load;
                let wanted = grip.slip + grip.spin.cross(arm);
                let slip = velocity - wanted;
                let slip = slip - normal * slip.dot(normal);
                let speed2 = slip.norm_squared() + grip.creep * grip.creep;
                let most = grip.coefficient * load / speed2.sqrt();
                force -= slip * most;
                if with_slope {
                    along += most;
                    sum.add_along(&slip, arm, -most / speed2);
                }
            }
            push.all.add_force_at(&force, arm);
            if with_slope {
                sum.add_along(normal, arm, across - along);
                if along > 0.0 {
                    sum.add_all(arm, along);
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
            sum.aa += axis * axis.transpose() * (most / rate * (1.0 - (spin / rate).powi(2)));
        }
        if let Some(slope) = slope {
            *slope = sum;
        }
        push
    }
}

/// What a group's points come to at some velocity.
#[derive(Clone, Copy, Debug, Default)]
pub struct Push {
    /// Force and torque on b about the centre, all told.
    pub all: Wrench,
    /// The same without dry friction.
    pub pressing: Wrench,
}
