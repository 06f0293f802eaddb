//! Motion: the state of a link while a step runs, and how it drifts and takes impulses.

use nalgebra::{Matrix6, Vector6};

use crate::math::{Mat3, Pose, Quat, Twist, Vec3, Wrench, advance_rotation, rotate_tensor};

/// How a link answers an impulse.
#[derive(Clone, Copy, Debug, Default)]
pub enum Inertia {
    /// Not at all.
    #[default]
    Immovable,
    /// It moves but does not turn.
    Point {
        /// One over the mass \[1/kg\].
        inverse_mass: f64,
    },
    /// A rigid solid.
    Solid {
        /// One over the mass \[1/kg\].
        inverse_mass: f64,
        /// Inertia about the centre of mass, in the link's axes \[kg m²\].
        local: Mat3,
        /// Its inverse, in the link's axes.
        inverse_local: Mat3,
        /// Its inverse, in the world, at the present rotation.
        inverse: Mat3,
        /// All principal moments are equal: turning changes nothing.
        isotropic: bool,
    },
    /// The host's matrix from wrench to acceleration, in the world.
    Effective(Matrix6<f64>),
}

/// Position, velocity and inertia of a link during a step.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    /// Centre of mass in the world \[m\].
    pub center: Vec3,
    /// Rotation from the link's frame to the world.
    pub rotation: Quat,
    /// Centre of mass in the link's frame \[m\].
    pub local_center: Vec3,
    /// Velocities.
    pub twist: Twist,
    /// Acceleration of everything but contacts and springs \[m/s²\].
    pub acceleration: Vec3,
    /// Angular acceleration of everything but contacts, springs and gyroscopic terms \[rad/s²\].
    pub angular_acceleration: Vec3,
    /// Answer to impulses.
    pub inertia: Inertia,
    /// Impulses of contacts and springs so far, about the centre of mass.
    pub contact_impulse: Wrench,
    /// A contact or a spring pushed it.
    pub touched: bool,
    /// Speed that it may have in any direction after it bounced within the step: that it comes with, and what its contacts
    /// hold in their compression \[m/s\].
    pub recoil: f64,
}

impl Inertia {
    /// The inertia of a rigid solid of this rotation.
    pub fn solid(mass: f64, local: Mat3, rotation: &Quat) -> Self {
        let inverse_local = local.try_inverse().unwrap_or_else(Mat3::zeros);
        let trace = local.trace() / 3.0;
        let isotropic = (local - Mat3::identity() * trace).abs().max() <= 1e-12 * trace;
        let inverse = rotate_tensor(rotation, &inverse_local);
        Inertia::Solid { inverse_mass: 1.0 / mass, local, inverse_local, inverse, isotropic }
    }
}

impl Motion {
    /// The pose of the link's frame.
    pub fn pose(&self) -> Pose {
        Pose { position: self.center - self.rotation * self.local_center, rotation: self.rotation }
    }

    /// Whether impulses move it.
    pub fn is_movable(&self) -> bool {
        !matches!(self.inertia, Inertia::Immovable)
    }

    /// Moves by the present velocities for `h` seconds. A free solid keeps its angular momentum exactly.
    pub fn drift(&mut self, h: f64) {
        self.center += self.twist.linear * h;
        if self.twist.angular == Vec3::zeros() {
            return;
        }
        let Inertia::Solid { local, inverse_local, inverse, isotropic, .. } = &mut self.inertia else {
            self.rotation = advance_rotation(&self.rotation, &self.twist.angular, h);
            return;
        };
        if *isotropic {
            self.rotation = advance_rotation(&self.rotation, &self.twist.angular, h);
            return;
        }
        // Euler's equations by the implicit midpoint rule, in three fixed-point rounds: the angular velocity over the
        // drift is the one that the (constant) angular momentum has at the rotation half way.
        let momentum = rotate_tensor(&self.rotation, local) * self.twist.angular;
        let mut middle = self.twist.angular;
        for _ in 0..3 {
            let half_way = advance_rotation(&self.rotation, &middle, 0.5 * h);
            middle = rotate_tensor(&half_way, inverse_local) * momentum;
        }
        self.rotation = advance_rotation(&self.rotation, &middle, h);
        *inverse = rotate_tensor(&self.rotation, inverse_local);
        self.twist.angular = *inverse * momentum;
    }

    /// Adds the velocity that everything but contacts and springs brings in `h` seconds.
    pub fn kick(&mut self, h: f64) {
        if self.is_movable() {
            self.twist.linear += self.acceleration * h;
            self.twist.angular += self.angular_acceleration * h;
        }
    }

    /// Change of velocity by an impulse about the centre of mass.
    pub fn answer(&self, impulse: &Wrench) -> Twist {
        match &self.inertia {
            Inertia::Immovable => Twist::default(),
            Inertia::Point { inverse_mass } => Twist { linear: impulse.force * *inverse_mass, angular: Vec3::zeros() },
            Inertia::Solid { inverse_mass, inverse, .. } => {
                Twist { linear: impulse.force * *inverse_mass, angular: inverse * impulse.torque }
            }
            Inertia::Effective(matrix) => answer(matrix, impulse),
        }
    }

    /// Takes the impulse of a contact or a spring about the centre of mass.
    pub fn push(&mut self, impulse: &Wrench) {
        self.contact_impulse.add_scaled(impulse, 1.0);
        self.touched = true;
        let change = self.answer(impulse);
        self.twist.linear += change.linear;
        self.twist.angular += change.angular;
    }

    /// Change of the velocity along `direction`, at `arm` from the centre of mass, by a unit impulse there
    /// \[1/kg\].
    pub fn mobility(&self, arm: &Vec3, direction: &Vec3) -> f64 {
        let change = match &self.inertia {
            Inertia::Immovable => return 0.0,
            Inertia::Point { inverse_mass } => return *inverse_mass,
            _ => self.answer(&Wrench { force: *direction, torque: arm.cross(direction) }),
        };
        change.at(arm).dot(direction)
    }

    /// Change of the velocity at `arm` by a unit impulse there, as a matrix \[1/kg\].
    pub fn mobility_matrix(&self, arm: &Vec3) -> Mat3 {
        match &self.inertia {
            Inertia::Immovable => Mat3::zeros(),
            Inertia::Point { inverse_mass } => Mat3::identity() * *inverse_mass,
            _ => Mat3::from_columns(
                &[Vec3::x(), Vec3::y(), Vec3::z()]
                    .map(|axis| self.answer(&Wrench { force: axis, torque: arm.cross(&axis) }).at(arm)),
            ),
        }
    }

    /// An upper bound of one over any principal moment of inertia \[1/(kg m²)\].
    pub fn inverse_moment(&self) -> f64 {
        match &self.inertia {
            Inertia::Immovable | Inertia::Point { .. } => 0.0,
            // No eigenvalue is above the largest row sum; exact for principal axes.
            Inertia::Solid { inverse_local, .. } => {
                inverse_local.row_iter().map(|row| row.abs().sum()).fold(0.0, f64::max)
            }
            Inertia::Effective(matrix) => matrix.fixed_view::<3, 3>(3, 3).trace(),
        }
    }

    /// One over the mass; of an effective inertia, a bound \[1/kg\].
    pub fn inverse_mass(&self) -> f64 {
        match &self.inertia {
            Inertia::Immovable => 0.0,
            Inertia::Point { inverse_mass } | Inertia::Solid { inverse_mass, .. } => *inverse_mass,
            Inertia::Effective(matrix) => matrix.fixed_view::<3, 3>(0, 0).trace(),
        }
    }
}

/// A matrix from impulses to velocities times an impulse.
pub(super) fn answer(matrix: &Matrix6<f64>, impulse: &Wrench) -> Twist {
    let Wrench { force: f, torque: t } = impulse;
    let answer = matrix * Vector6::new(f.x, f.y, f.z, t.x, t.y, t.z);
    Twist { linear: answer.fixed_rows::<3>(0).into_owned(), angular: answer.fixed_rows::<3>(3).into_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_free_tumbling_box_keeps_momentum_and_energy() {
        let local = Mat3::from_diagonal(&Vec3::new(1.0, 2.0, 2.5));
        let rotation = Quat::identity();
        let mut motion = Motion {
            twist: Twist { linear: Vec3::zeros(), angular: Vec3::new(0.1, 5.0, 0.05) },
            inertia: Inertia::solid(1.0, local, &rotation),
            ..Motion::default()
        };
        let momentum = |m: &Motion| rotate_tensor(&m.rotation, &local) * m.twist.angular;
        let energy = |m: &Motion| 0.5 * m.twist.angular.dot(&momentum(m));
        let (l0, e0) = (momentum(&motion), energy(&motion));
        let mut flipped = false;
        for _ in 0..20_000 {
            motion.drift(1e-3);
            flipped |= motion.rotation.inverse() * motion.twist.angular != Vec3::zeros()
                && (motion.rotation.inverse() * motion.twist.angular).y < -2.0;
            assert!((momentum(&motion) - l0).norm() < 1e-9 * l0.norm());
            assert!((energy(&motion) / e0 - 1.0).abs() < 1e-5);
        }
        assert!(flipped, "the middle axis is unstable: it must flip");
    }
}
