//! Vertices that go with several links at once: blended rigid motions as dual quaternions, so that a twisted limb is
//! not pinched (Kavan et al. 2007, doi:10.1145/1230100.1230107).

use nalgebra::Quaternion;

use crate::math::{Pose, Quat, Vec3};

/// A rigid motion from one frame to another, as a unit dual quaternion.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    rotation: Quaternion<f64>,
    /// Half the translation times the rotation.
    dual: Quaternion<f64>,
}

impl Motion {
    /// That takes a frame with the first pose to the second.
    pub fn between(before: &Pose, now: &Pose) -> Self {
        let turn: Quat = now.rotation * before.rotation.inverse();
        let rotation = *turn.quaternion();
        let shift = now.position - turn * before.position;
        Self { rotation, dual: Quaternion::from_imag(shift * 0.5) * rotation }
    }
}

/// What motions come to together.
#[derive(Clone, Copy, Debug)]
pub struct Blend {
    rotation: Quat,
    shift: Vec3,
}

impl Blend {
    /// By these weights; the first motion says which of its two signs each of the others has.
    pub fn of(motions: &[Motion], weights: &[(u32, f64)]) -> Self {
        let lead = motions[weights[0].0 as usize];
        if weights.len() == 1 {
            return Self::from_sums(lead.rotation, lead.dual);
        }
        let zero = Quaternion::from_imag(Vec3::zeros());
        let (mut rotation, mut dual) = (zero, zero);
        for (link, weight) in weights {
            let motion = &motions[*link as usize];
            let weight = if motion.rotation.dot(&lead.rotation) < 0.0 { -weight } else { *weight };
            rotation += motion.rotation * weight;
            dual += motion.dual * weight;
        }
        if rotation.norm_squared() < 1e-12 {
            return Self::from_sums(lead.rotation, lead.dual);
        }
        Self::from_sums(rotation, dual)
    }

    fn from_sums(rotation: Quaternion<f64>, dual: Quaternion<f64>) -> Self {
        let shift = (dual * rotation.conjugate()).imag() * (2.0 / rotation.norm_squared());
        Self { rotation: Quat::new_normalize(rotation), shift }
    }

    pub fn point(&self, p: &Vec3) -> Vec3 {
        self.rotation * p + self.shift
    }

    pub fn direction(&self, v: &Vec3) -> Vec3 {
        self.rotation * v
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::rotation_from_vector;

    fn pose(position: [f64; 3], turn: [f64; 3]) -> Pose {
        Pose { position: position.into(), rotation: rotation_from_vector(&turn.into()) }
    }

    #[test]
    fn a_blend_of_equal_motions_is_that_motion_whatever_the_signs() {
        let (before, now) = (pose([1.0, 2.0, 3.0], [0.1, 0.2, -0.3]), pose([-1.0, 0.5, 0.0], [2.5, 0.4, 1.0]));
        let motion = Motion::between(&before, &now);
        let other = Motion { rotation: -motion.rotation, dual: -motion.dual };
        let p = Vec3::new(0.3, -0.4, 2.0);
        let expected = now.transform_point(&before.inverse_transform_point(&p));
        let blend = Blend::of(&[motion, other], &[(0, 0.6), (1, 0.4)]);
        assert!((blend.point(&p) - expected).norm() < 1e-14);
        assert!((Blend::of(&[motion], &[(0, 1.0)]).point(&p) - expected).norm() < 1e-14);
    }

    #[test]
    fn half_a_turn_about_an_axis_keeps_the_distance_from_it() {
        let still = Motion::between(&Pose::default(), &Pose::default());
        let turned = Motion::between(&Pose::default(), &pose([0.0; 3], [2.0, 0.0, 0.0]));
        let moved = Blend::of(&[still, turned], &[(0, 0.5), (1, 0.5)]).point(&Vec3::new(0.7, 1.0, 0.0));
        assert!((moved - Vec3::new(0.7, 1.0_f64.cos(), 1.0_f64.sin())).norm() < 1e-14);
    }
}
