//! Forces between particles: attraction and repulsion \[97, eq. (26)\] as a shifted force, and central friction
//! \[97, eq. (27)\] (docs/model.md, "Particles").
//!
//! `F(r) = γ/r ((r_0/r)^8 - (r_0/r)^4)` repels below `r_0` and attracts above. Cut at `r_c = 1.6 r_0`, with
//! `F(r) - F(r_c)`, particles at rest are equally far apart however many they are, `1.024 r_0`, which is the spacing, and
//! each has few neighbours. Nearer than [`HARDEST`] the force goes on as a line, so that it is finite.

use crate::math::Vec3;

/// Distance beyond which there is no force, over the spacing.
pub const CUT: f64 = 1.6 / REST;
/// Distance below which the stiffness grows no more, over the spacing.
pub const HARDEST: f64 = 0.7;

/// Where the shifted force is zero, over `r_0`: particles are to rest at the spacing.
const REST: f64 = 1.024_156_065_016_251;

/// Attraction and repulsion of one substance.
#[derive(Clone, Copy, Debug, Default)]
pub struct Law {
    spacing: f64,
    cohesion: f64,
    /// `F(r_c)`.
    shift: f64,
    /// Stiffness at rest, the most beyond `r_0` \[N/m\].
    rest: f64,
    /// Where the force ends, and where the line begins: distance, force and stiffness there.
    cut: f64,
    hard: f64,
    hard_force: f64,
    hard_stiffness: f64,
}

/// `F(r)` and `-F'(r)` without the shift, from `1 / r`.
#[inline(always)]
fn bare(spacing: f64, cohesion: f64, inverse: f64) -> (f64, f64) {
    let u2 = (spacing * inverse) * (spacing * inverse);
    let u4 = u2 * u2;
    let scale = cohesion * inverse;
    (scale * (u4 * u4 - u4), scale * inverse * (9.0 * u4 * u4 - 5.0 * u4))
}

impl Law {
    /// The law of a substance, with its stiffness bounded by `most` \[N/m\].
    pub fn new(spacing: f64, cohesion: f64, most: f64) -> Self {
        let spacing = spacing / REST;
        // What cannot be followed in time is made softer, as little as needed.
        let rest = 4.0 * cohesion / (spacing * spacing);
        let cohesion = if rest > most { cohesion * most / rest } else { cohesion };
        let rest = 4.0 * cohesion / (spacing * spacing);
        let cut = CUT * REST * spacing;
        let (shift, _) = bare(spacing, cohesion, 1.0 / cut);
        let stiffness = |r: f64| bare(spacing, cohesion, 1.0 / r).1;
        let (mut hard, mut soft) = (HARDEST * spacing, spacing);
        if stiffness(hard) > most {
            for _ in 0..60 {
                let middle = 0.5 * (hard + soft);
                if stiffness(middle) > most {
                    hard = middle;
                } else {
                    soft = middle;
                }
            }
            hard = soft;
        }
        let (force, hard_stiffness) = bare(spacing, cohesion, 1.0 / hard);
        Self { spacing, cohesion, shift, rest, cut, hard, hard_force: force - shift, hard_stiffness }
    }

    /// The strength that it has: less than asked for where that could not be followed \[J\].
    pub fn cohesion(&self) -> f64 {
        self.cohesion
    }

    /// Repulsion at a distance below the cut \[N\], and the most that its stiffness is up to there \[N/m\]; `inverse` is one
    /// over the distance.
    #[inline(always)]
    pub fn push(&self, r: f64, inverse: f64) -> (f64, f64) {
        // Both are worked out, so that several at a time can be.
        let line = self.hard_force + self.hard_stiffness * (self.hard - r);
        let (force, stiffness) = bare(self.spacing, self.cohesion, inverse);
        let stiffness = if r < self.spacing { stiffness } else { self.rest };
        if r < self.hard { (line, self.hard_stiffness) } else { (force - self.shift, stiffness) }
    }

    /// Potential energy of a pair \[J\]: zero at the cut.
    pub fn energy(&self, r: f64) -> f64 {
        if r >= self.cut {
            return 0.0;
        }
        let bare_energy = |r: f64| {
            let u4 = (self.spacing / r).powi(4);
            self.cohesion * (u4 * u4 / 8.0 - u4 / 4.0)
        };
        let at = r.max(self.hard);
        let shifted = bare_energy(at) - bare_energy(self.cut) - self.shift * (self.cut - at);
        let x = (self.hard - r).max(0.0);
        shifted + x * (self.hard_force + 0.5 * self.hard_stiffness * x)
    }
}

/// Unit vector from `a` to `b` and their distance; two at one point part along a direction that their numbers choose.
pub fn direction(a: &Vec3, b: &Vec3, numbers: [u32; 2]) -> (Vec3, f64) {
    let offset = b - a;
    let distance = offset.norm();
    if distance > 0.0 { (offset / distance, distance) } else { (parting(numbers), 0.0) }
}

/// The direction in which two at one point part.
#[cold]
pub fn parting(numbers: [u32; 2]) -> Vec3 {
    let angle = f64::from(numbers[0] ^ numbers[1].rotate_left(7)) * 2.399_963_229_728_653;
    let (sine, cosine) = libm::sincos(angle);
    Vec3::new(0.8 * cosine, 0.8 * sine, 0.6)
}

/// What is left of the speed of approach of a pair after `h` seconds of friction, `v' = -w (c + μ |v|) v` with `w` one over
/// the reduced mass: exact for the part in `μ`, of first order for that in `c`, and stable in any step.
pub fn braked(speed: f64, linear: f64, quadratic: f64, mobility: f64, h: f64) -> f64 {
    speed / (1.0 + (linear + quadratic * speed.abs()) * (h * mobility))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_force_is_the_slope_of_the_energy_and_ends_at_the_cut() {
        let law = Law::new(0.2, 3.0, f64::INFINITY);
        let push = |r: f64| law.push(r, 1.0 / r);
        for r in [0.02, 0.1, 0.135, 0.15, 0.19, 0.2, 0.22, 0.3, 0.312] {
            let h = 1e-6;
            let slope = (law.energy(r - h) - law.energy(r + h)) / (2.0 * h);
            assert!((slope - push(r).0).abs() < 1e-5 * push(r).0.abs().max(1.0), "{r}: {slope} {}", push(r).0);
            assert!(push(r).1 >= (push(r - h).0 - push(r + h).0) / (2.0 * h) * (1.0 - 1e-6));
        }
        assert!(push(0.2).0.abs() < 1e-12, "at rest at the spacing");
        assert!(push(CUT * 0.2).0.abs() < 1e-12 && law.energy(CUT * 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_bound_of_the_stiffness_holds_everywhere() {
        for most in [1.0, 299.0, 301.0, 5000.0] {
            let law = Law::new(0.2, 3.0, most);
            let push = |r: f64| law.push(r, 1.0 / r);
            for k in 1..400 {
                let (r, h) = (k as f64 * 8e-4, 1e-7);
                let stiffness = (push(r - h).0 - push(r + h).0) / (2.0 * h);
                assert!(stiffness <= most * (1.0 + 1e-4), "{most} at {r}: {stiffness}");
            }
        }
    }

    #[test]
    fn friction_follows_its_equation() {
        let (linear, quadratic, mass) = (0.3, 2.0, 0.7);
        let follow = |steps: usize, linear: f64| {
            (0..steps).fold(1.5, |speed, _| braked(speed, linear, quadratic, 1.0 / mass, 0.8 / steps as f64))
        };
        let exact = 1.5 / (1.0 + quadratic * 1.5 * 0.8 / mass);
        assert!((follow(1, 0.0) - exact).abs() < 1e-15 && (follow(7, 0.0) - exact).abs() < 1e-15);
        let (fall, drag) = (libm::exp(-linear * 0.8 / mass), quadratic / linear * 1.5);
        let exact = 1.5 * fall / (1.0 + drag * (1.0 - fall));
        assert!((follow(100_000, linear) - exact).abs() < 1e-5);
        assert!(braked(-1e30, 0.0, 1e10, 1e3, 1.0).abs() < 1e-3, "stable at any speed");
    }
}
