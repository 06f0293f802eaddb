//! Springs: damped, between points of two links, on the line through them.
//!
//! The law is written in vectors, so that a spring may have no length at all: with the line `d` from the first end to the
//! second and the rest length `L`, the force on the second end is `-k (|d| - L) d/|d|`, which for `L = 0` is `-k d`.

use super::Motion;
use crate::math::{Mat3, Vec3};

/// Two ends nearer to each other than this are in one point: the direction between them is rounding only \[m\].
const POINT: f64 = 1e-12;

/// How a spring answers its length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Law {
    /// Length without force \[m\].
    pub rest_length: f64,
    /// Force a metre of stretch \[N/m\].
    pub stiffness: f64,
    /// Force a metre a second of lengthening \[N s/m\].
    pub damping: f64,
}

/// A spring during a step.
#[derive(Clone, Copy, Debug)]
pub struct Spring {
    /// Slots of its two links.
    pub links: [u32; 2],
    /// Its ends, from the links' centres of mass, in the links' axes \[m\].
    pub ends: [Vec3; 2],
    /// How it pulls.
    pub law: Law,
}

/// The line of a spring: where its ends are and how they move.
#[derive(Clone, Copy, Debug, Default)]
pub struct Line {
    /// Ends from the links' centres of mass, in the world \[m\].
    pub arms: [Vec3; 2],
    /// From the first end to the second \[m\].
    pub separation: Vec3,
    /// Velocity of the second end against the first \[m/s\].
    pub velocity: Vec3,
}

impl Line {
    /// The length.
    pub fn length(&self) -> f64 {
        self.separation.norm()
    }

    /// From the first end to the second.
    pub fn direction(&self) -> Option<Vec3> {
        direction(&self.separation, &self.velocity)
    }

    /// How fast it lengthens \[m/s\].
    pub fn rate(&self) -> f64 {
        self.direction().map_or(0.0, |direction| direction.dot(&self.velocity))
    }
}

/// Direction of a spring from its first end to the second. Of ends in one point it is the one in which they are about to
/// part; at rest there they have none, and no force between them.
pub fn direction(separation: &Vec3, velocity: &Vec3) -> Option<Vec3> {
    let length = separation.norm();
    if length > POINT {
        return Some(separation / length);
    }
    let speed = velocity.norm();
    (speed > 0.0).then(|| velocity / speed)
}

impl Law {
    /// Pull on its ends at a stretch and a rate of lengthening; negative when it pushes \[N\].
    pub fn tension(&self, stretch: f64, rate: f64) -> f64 {
        self.stiffness * stretch + self.damping * rate
    }

    /// What it stores at a length \[J\].
    pub fn energy(&self, length: f64) -> f64 {
        0.5 * self.stiffness * (length - self.rest_length).powi(2)
    }

    /// Pull of the damper alone over `h` seconds on ends of this `mobility` against each other \[1/kg\], as an impulse: it
    /// lets the rate decay as it does in time, `dv/dt = -W c v`, which is stable whatever its size \[N s\].
    pub fn damping_impulse(&self, rate: f64, mobility: f64, h: f64) -> f64 {
        if mobility > 0.0 { -rate * libm::expm1(-self.damping * mobility * h) / mobility } else { 0.0 }
    }

    /// Minus the derivative of the elastic force on the second end by its place, without what would make it indefinite: a
    /// spring that pushes has no stiffness across its line, where it would give way sideways.
    pub fn tangent(&self, direction: &Vec3, length: f64, stretch: f64) -> Mat3 {
        let across = if length > 0.0 { (stretch / length).clamp(0.0, 1.0) } else { 0.0 };
        let across = if self.rest_length == 0.0 { 1.0 } else { across };
        let along = direction * direction.transpose();
        Mat3::identity() * (self.stiffness * across) + along * (self.stiffness * (1.0 - across))
    }
}

impl Spring {
    /// Where it is while its links move like this.
    pub fn line(&self, motions: &[Motion]) -> Line {
        let [a, b] = self.links.map(|link| &motions[link as usize]);
        let arms = [a.rotation * self.ends[0], b.rotation * self.ends[1]];
        Line {
            arms,
            // The difference of two small arms joins that of the centres last, for the sake of its digits.
            separation: (b.center - a.center) + (arms[1] - arms[0]),
            velocity: b.twist.at(&arms[1]) - a.twist.at(&arms[0]),
        }
    }

    /// Square of the rate that the spring and its two links would have by themselves, in whatever direction \[1/s²\].
    pub fn rate2(&self, motions: &[Motion]) -> f64 {
        let mobility = |(link, end): (u32, &Vec3)| {
            let motion = &motions[link as usize];
            motion.inverse_mass() + end.norm_squared() * motion.inverse_moment()
        };
        self.law.stiffness * self.links.into_iter().zip(&self.ends).map(mobility).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn force(law: &Law, separation: &Vec3) -> Vec3 {
        let line = Line { separation: *separation, ..Line::default() };
        let stretch = line.length() - law.rest_length;
        line.direction().map_or_else(Vec3::zeros, |direction| -direction * law.tension(stretch, 0.0))
    }

    proptest! {
        #[test]
        fn the_tangent_is_the_derivative_of_a_stretched_spring(
            x in 0.2..1.0f64, y in -1.0..1.0f64, z in -1.0..1.0f64, part in 0.0..0.99f64, stiffness in 1.0..1e6f64,
        ) {
            let separation = Vec3::new(x, y, z);
            let length = separation.norm();
            let law = Law { rest_length: part * length, stiffness, damping: 0.0 };
            let tangent = law.tangent(&(separation / length), length, length - law.rest_length);
            for axis in 0..3 {
                let mut step = Vec3::zeros();
                step[axis] = 1e-6;
                let change = (force(&law, &(separation - step)) - force(&law, &(separation + step))) / 2e-6;
                prop_assert!((change - tangent.column(axis)).norm() < 1e-6 * stiffness);
            }
        }
    }

    #[test]
    fn a_spring_without_length_pulls_as_its_vector_does() {
        let law = Law { rest_length: 0.0, stiffness: 7.0, damping: 0.0 };
        for size in [0.0, 1e-200, 1e-13, 1e-3, 10.0] {
            let separation = Vec3::new(1.0, -2.0, 0.5) * size;
            assert!((force(&law, &separation) + separation * 7.0).norm() <= 7.0 * POINT.min(3.0 * size) + 1e-15 * size);
        }
        assert_eq!(law.tangent(&Vec3::x(), 0.0, 0.0), Mat3::identity() * 7.0);
    }

    #[test]
    fn two_ends_in_one_point_at_rest_have_no_force() {
        let law = Law { rest_length: 1.0, stiffness: 7.0, damping: 3.0 };
        assert_eq!(force(&law, &Vec3::zeros()), Vec3::zeros());
        assert!(law.tangent(&Vec3::x(), 0.0, -1.0).iter().all(|x| x.is_finite()));
        // About to part, they are pushed apart.
        let line = Line { velocity: Vec3::new(0.0, 2.0, 0.0), ..Line::default() };
        assert_eq!((line.direction(), line.rate()), (Some(Vec3::y()), 2.0));
    }

    #[test]
    fn any_damper_only_ever_slows_down() {
        for damping in [1e-20, 1e-3, 1.0, 1e9] {
            let law = Law { rest_length: 0.0, stiffness: 0.0, damping };
            let rate = 1.0;
            let after = rate - 2.0 * law.damping_impulse(rate, 2.0, 0.01);
            assert!((after - (-0.02 * damping).exp()).abs() < 1e-12, "{damping}: {after}");
        }
    }
}
