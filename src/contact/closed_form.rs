//! Closed form: the contact of two balls, or of a ball and a half-space, with linear profiles.
//!
//! The pressure `p` labels the surface: at `p` the level sets of the two bodies are spheres of radius
//! `t - p/(K k)` (planes at that offset; a rigid body keeps `t`), they meet in a circle of radius `ρ(p)`, and
//!
//! ```text
//! F = π ∫₀^p* ρ²(p) dp,    p* = (t_a + t_b - D) / (1/(K_a k_a) + 1/(K_b k_b)).
//! ```
//!
//! `ρ²` is a quartic in `p`, so three Gauss points are exact. The same integral gives every other figure of a contact.

use std::f64::consts::PI;

/// A ball, or a half-space.
#[derive(Clone, Copy, Debug)]
pub struct Round {
    /// Distance of the surface from the centre, or from the boundary plane \[m\].
    pub thickness: f64,
    /// `1 / (K k)`: depth a unit of pressure \[m/Pa\]; zero for a rigid body.
    pub compliance: f64,
    /// A half-space rather than a ball.
    pub plane: bool,
}

/// What a contact of two round coats comes to, on the line from a's centre to b's.
#[derive(Clone, Copy, Debug, Default)]
pub struct Axial {
    /// Force \[N\].
    pub force: f64,
    /// Area of the contact surface \[m²\].
    pub area: f64,
    /// Highest pressure \[Pa\].
    pub peak_pressure: f64,
    /// Stiffness, as in [`Contact`](crate::world::Contact) \[N/m\].
    pub stiffness: f64,
    /// Centre of pressure, as a distance from a's centre towards b \[m\].
    pub center: f64,
    /// `dF/dD`: negative while pushing deeper needs more force \[N/m\].
    pub slope: f64,
}

/// Gauss-Legendre on [0, 1], five points.
const GAUSS: [(f64, f64); 5] = [
    (0.046_910_077_030_668, 0.118_463_442_528_094_54),
    (0.230_765_344_947_158_45, 0.239_314_335_249_683_24),
    (0.5, 0.284_444_444_444_444_44),
    (0.769_234_655_052_841_5, 0.239_314_335_249_683_24),
    (0.953_089_922_969_332, 0.118_463_442_528_094_54),
];

impl Round {
    fn radius(&self, p: f64) -> f64 {
        self.thickness - p * self.compliance
    }
}

/// The contact of ball `a` and `b` with their centres at a distance `d` (from a half-space: the signed distance of
/// a's centre from its boundary plane). `None` when they do not touch.
pub fn contact(a: &Round, b: &Round, d: f64) -> Option<Axial> {
    debug_assert!(!a.plane && a.compliance + b.compliance > 0.0);
    let overlap = a.thickness + b.thickness - d;
    if overlap <= 0.0 {
        return None;
    }
    let peak_pressure = overlap / (a.compliance + b.compliance);
    let mut sum = Axial { peak_pressure, ..Axial::default() };
    let mut moment = 0.0;
    for (x, weight) in GAUSS {
        let p = x * peak_pressure;
        let (ra, rb) = (a.radius(p), b.radius(p));
        // Height of the circle over a's centre, and its derivatives by p and by d.
        let (z, z_p, z_d) = if b.plane {
            (d - rb, b.compliance, 1.0)
        } else {
            let q = ra * ra - rb * rb;
            let q_p = 2.0 * (rb * b.compliance - ra * a.compliance);
            (0.5 * (d + q / d), 0.5 * q_p / d, 0.5 * (1.0 - q / (d * d)))
        };
        let rho2 = ra * ra - z * z;
        let rho2_p = -2.0 * (ra * a.compliance + z * z_p);
        let dp = weight * peak_pressure * PI;
        sum.force += rho2 * dp;
        sum.slope += -2.0 * z * z_d * dp;
        moment -= z * p * rho2_p * dp;
        // The generator of the surface is (ρ, z)(p); its length times 2πρ is the area, its normal (−z', ρ').
        let generator = (rho2_p * rho2_p + 4.0 * rho2.max(0.0) * z_p * z_p).sqrt();
        if generator > 0.0 {
            let rho = rho2.max(0.0).sqrt();
            let normal = (2.0 * rho * z_p / generator, -rho2_p / generator);
            let along = |radial: f64, axial: f64, compliance: f64, length: f64| {
                let cosine = ((radial * normal.0 + axial * normal.1) / length).abs();
                if compliance > 0.0 { cosine / compliance } else { f64::INFINITY }
            };
            let ga = along(rho, z, a.compliance, ra);
            let gb = if b.plane { along(0.0, 1.0, b.compliance, 1.0) } else { along(rho, z - d, b.compliance, rb) };
            let g = if ga.is_infinite() {
                gb
            } else if gb.is_infinite() {
                ga
            } else {
                ga * gb / (ga + gb)
            };
            sum.area += generator * dp;
            sum.stiffness += g * generator * dp;
        }
    }
    sum.center = if sum.force > 0.0 { moment / sum.force } else { a.radius(peak_pressure) };
    Some(sum)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_balls_match_the_textbook_formula() {
        let (e, r) = (2e5, 0.1);
        let ball = Round { thickness: r, compliance: r / e, plane: false };
        for indentation in [0.01, 0.05, 0.2] {
            let delta = indentation * r;
            let exact = PI * e * delta * delta * (1.0 - 2.0 * delta / (3.0 * r));
            let axial = contact(&ball, &ball, 2.0 * (r - delta)).unwrap();
            assert!((axial.force / exact - 1.0).abs() < 1e-13);
            // The surface is a disc, and dF/dD = -π E h (1 - h/R) is minus the stiffness.
            let h = r - delta;
            assert!((axial.area / (PI * (r * r - h * h)) - 1.0).abs() < 1e-12);
            assert!((axial.slope / (-PI * e * h * (1.0 - h / r)) - 1.0).abs() < 1e-12);
            assert!((axial.stiffness / -axial.slope - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn slope_is_the_derivative_of_the_force() {
        let a = Round { thickness: 0.1, compliance: 1e-6, plane: false };
        for b in [
            Round { thickness: 0.4, compliance: 3e-7, plane: false },
            Round { thickness: 0.4, compliance: 0.0, plane: false },
            Round { thickness: 0.05, compliance: 2e-6, plane: true },
            Round { thickness: 0.05, compliance: 0.0, plane: true },
        ] {
            let d = a.thickness + b.thickness - 0.03;
            let h = 1e-6;
            let force = |d| contact(&a, &b, d).unwrap().force;
            let numeric = (force(d + h) - force(d - h)) / (2.0 * h);
            let slope = contact(&a, &b, d).unwrap().slope;
            assert!((slope / numeric - 1.0).abs() < 1e-6, "{slope} {numeric}");
        }
    }

    #[test]
    fn unequal_balls_carry_less_beyond_seven_tenths_of_the_overlap() {
        let (small, large) = (0.1, 0.3);
        let round = |thickness| Round { thickness, compliance: 1e-6, plane: false };
        let slope = |fraction: f64| {
            let d = small + large - fraction * 2.0 * small;
            contact(&round(small), &round(large), d).unwrap().slope
        };
        assert!(slope(0.65) < 0.0 && slope(0.8) > 0.0);
    }
}
