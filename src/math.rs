//! Vectors, poses, twists and wrenches, and the few rotations everything else needs.
//!
//! All lengths are in metres, masses in kilograms, times in seconds, angles in radians. Trigonometry comes from
//! `libm`, so that the same input gives the same bits on every platform.

use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// A vector or a point in three dimensions.
pub type Vec3 = Vector3<f64>;
/// A 3×3 matrix.
pub type Mat3 = Matrix3<f64>;
/// A rotation as a unit quaternion.
pub type Quat = UnitQuaternion<f64>;

/// Position and orientation of a frame in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Origin of the frame \[m\].
    pub position: Vec3,
    /// Rotation from the frame to the world.
    pub rotation: Quat,
}

impl Default for Pose {
    fn default() -> Self {
        Self { position: Vec3::zeros(), rotation: Quat::identity() }
    }
}

impl Pose {
    /// A pose with the identity rotation.
    pub fn at(x: f64, y: f64, z: f64) -> Self {
        Self { position: Vec3::new(x, y, z), ..Self::default() }
    }

    /// A point of the frame, in the world.
    pub fn transform_point(&self, local: &Vec3) -> Vec3 {
        self.position + self.rotation * local
    }

    /// A point of the world, in the frame.
    pub fn inverse_transform_point(&self, world: &Vec3) -> Vec3 {
        self.rotation.inverse() * (world - self.position)
    }
}

/// Linear and angular velocity, in the world frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// Velocity of the centre of mass \[m/s\].
    pub linear: Vec3,
    /// Angular velocity \[rad/s\].
    pub angular: Vec3,
}

impl Twist {
    /// Velocity of the material point at `arm` from the centre of mass.
    pub fn at(&self, arm: &Vec3) -> Vec3 {
        self.linear + self.angular.cross(arm)
    }
}

/// A force and a torque about a stated point (for a link: its centre of mass), in the world frame. Also used for
/// impulses, with the units multiplied by seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wrench {
    /// Force \[N\].
    pub force: Vec3,
    /// Torque \[N m\].
    pub torque: Vec3,
}

impl Wrench {
    /// Adds a force that acts at `arm` from the point of reference.
    pub fn add_force_at(&mut self, force: &Vec3, arm: &Vec3) {
        self.force += force;
        self.torque += arm.cross(force);
    }

    /// Adds another wrench about the same point, scaled.
    pub fn add_scaled(&mut self, other: &Wrench, scale: f64) {
        self.force += other.force * scale;
        self.torque += other.torque * scale;
    }
}

/// The rotation by the vector `w` (axis times angle).
pub fn rotation_from_vector(w: &Vec3) -> Quat {
    let angle = w.norm();
    // sin(x/2)/x, with its series where the quotient loses digits.
    let s = if angle < 1e-4 { 0.5 - angle * angle / 48.0 } else { libm::sin(0.5 * angle) / angle };
    let q = Quaternion::new(libm::cos(0.5 * angle), w.x * s, w.y * s, w.z * s);
    Quat::new_normalize(q)
}

/// The vector (axis times angle, angle in [0, π]) of a rotation: the inverse of [`rotation_from_vector`].
pub fn rotation_to_vector(q: &Quat) -> Vec3 {
    let (w, v) = if q.w < 0.0 { (-q.w, -q.imag()) } else { (q.w, q.imag()) };
    let sine = v.norm();
    if sine < 1e-8 {
        return v * 2.0;
    }
    v * (2.0 * libm::atan2(sine, w) / sine)
}

/// Rotates `q` by the angular velocity `w` for `dt` seconds.
pub fn advance_rotation(q: &Quat, w: &Vec3, dt: f64) -> Quat {
    let mut turned = rotation_from_vector(&(w * dt)) * q;
    // Products drift off unit length, step by step in the same direction.
    turned.renormalize_fast();
    turned
}

/// Two unit vectors that complete the unit vector `n` to a right-handed frame `(e1, e2, n)`; continuous in `n` away
/// from the switch of its smallest component.
pub fn tangents(n: &Vec3) -> (Vec3, Vec3) {
    let seed = if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let e1 = n.cross(&seed).normalize();
    (e1, n.cross(&e1))
}

/// A symmetric tensor of the body frame, in the world.
pub fn rotate_tensor(q: &Quat, local: &Mat3) -> Mat3 {
    let r = q.to_rotation_matrix();
    r.matrix() * local * r.matrix().transpose()
}

/// Middle and radius of a ball that holds all points.
pub fn ball_round(points: &[[f64; 3]]) -> (Vec3, f64) {
    let each = points.iter().map(|p| Vec3::from(*p));
    let empty = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = each.fold(empty, |(low, high), p| (low.inf(&p), high.sup(&p)));
    ((low + high) * 0.5, 0.5 * (high - low).norm())
}

/// True when every component is a finite number.
pub fn is_finite(v: &Vec3) -> bool {
    v.iter().all(|x| x.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn rotation_vector_round_trips(x in -1.8..1.8f64, y in -1.8..1.8f64, z in -1.8..1.8f64) {
            let v = Vec3::new(x, y, z);
            prop_assert!((rotation_to_vector(&rotation_from_vector(&v)) - v).norm() < 1e-12);
        }
    }

    #[test]
    fn tiny_rotation_vectors_survive() {
        for scale in [1e-3, 1e-6, 1e-9, 1e-12] {
            let v = Vec3::new(0.3, -0.5, 0.8) * scale;
            assert!((rotation_to_vector(&rotation_from_vector(&v)) - v).norm() < 1e-12 * scale);
        }
    }
}
