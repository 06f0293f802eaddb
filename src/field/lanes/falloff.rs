//! Profiles without branches, their constants worked out once for many points.

use super::vector::Lanes;
use crate::field::Profile;

/// The profile of a skeleton, ready for lanes: [`Profile::value_slope`] without branches and divisions.
///
/// With `u = clamp((R - d) / (R - t), 0, 1)` and the depth `x = max(t - d, 0)` the pieces of value and slope add up,
/// because the outer piece keeps its value and slope of the surface inside, and the inner one is zero outside:
/// `F = u² (a + b u) + x (k + bend x / 2)`, and likewise for the slope.
#[derive(Clone, Copy)]
pub struct Falloff {
    /// What it was made from: bodies of many skeletons often have one profile.
    profile: Profile,
    solid: bool,
    thickness: f64,
    pub radius: f64,
    /// `1 / (R - t)`.
    inverse_width: f64,
    /// The outer cubic: `u² (a + b u)`, and its slope `u (slope_a + slope_b u)`.
    a: f64,
    b: f64,
    slope_a: f64,
    slope_b: f64,
    /// Slope at the surface, and inside a solid core.
    stiffness: f64,
    core_stiffness: f64,
    /// What the slope gains per metre of depth, down to the skeleton.
    bend: f64,
    half_cap: f64,
    inverse_cap: f64,
}

impl Falloff {
    /// Of no profile.
    pub const NONE: Self = Self {
        profile: Profile { isovalue: 0.0, thickness: 0.0, stiffness: 0.0, stiffening: 0.0, radius: 0.0, cap: 0.0 },
        solid: false,
        thickness: 0.0,
        radius: 0.0,
        inverse_width: 0.0,
        a: 0.0,
        b: 0.0,
        slope_a: 0.0,
        slope_b: 0.0,
        stiffness: 0.0,
        core_stiffness: 0.0,
        bend: 0.0,
        half_cap: 0.0,
        inverse_cap: 0.0,
    };

    /// Becomes that of this profile.
    #[inline(always)]
    pub fn fit(&mut self, profile: &Profile, solid: bool) {
        if self.profile != *profile || self.solid != solid {
            *self = Self::new(profile, solid);
        }
    }

    #[inline(always)]
    fn new(profile: &Profile, solid: bool) -> Self {
        let &Profile { isovalue, thickness, stiffness, stiffening, radius, cap } = profile;
        let inverse_width = 1.0 / (radius - thickness);
        let kw = stiffness * (radius - thickness);
        let (a, b) = (3.0 * isovalue - kw, kw - 2.0 * isovalue);
        let cap = if solid { 0.0 } else { cap };
        Self {
            profile: *profile,
            solid,
            thickness,
            radius,
            inverse_width,
            a,
            b,
            slope_a: -2.0 * a * inverse_width,
            slope_b: -3.0 * b * inverse_width,
            stiffness,
            core_stiffness: stiffness * stiffening,
            bend: (stiffening - 1.0) * stiffness / thickness,
            half_cap: 0.5 * cap,
            inverse_cap: 1.0 / cap.max(TINY),
        }
    }

    /// `F(d)` and the slope `F'(d)`, for a shape that is solid or not, which is known when compiling; with the
    /// cap of a thin skeleton, the slope before the factor `min(d / cap, 1)`.
    #[inline(always)]
    pub fn value_slope<const W: usize>(&self, d: Lanes<W>, solid: bool) -> (Lanes<W>, Lanes<W>) {
        let s = Lanes::splat;
        let (zero, one) = (s(0.0), s(1.0));

        let u = ((s(self.radius) - d) * s(self.inverse_width)).clamp(zero, one);
        let outer = u * u * (s(self.a) + s(self.b) * u);
        let outer_slope = u * (s(self.slope_a) + s(self.slope_b) * u);

        let (depth, core) = if solid {
            // Below the surface of the core, at depth t, the field rises linearly.
            let depth = (s(self.thickness) - d).max(zero);
            let bent = depth.min(s(self.thickness));
            (bent, (depth - bent) * s(self.core_stiffness))
        } else {
            // The cap puts `(d²/cap + cap) / 2` in the place of d: below, with f = d/cap; beyond the cap, f = 1.
            let (half_cap, f) = (s(self.half_cap), (d * s(self.inverse_cap)).min(one));
            let capped = (d - half_cap * f) * f + half_cap;
            ((s(self.thickness) - capped).max(zero), zero)
        };
        let inner = depth * (s(self.stiffness) + s(0.5 * self.bend) * depth);
        let value = outer + inner;
        (if solid { value + core } else { value }, outer_slope - s(self.bend) * depth)
    }

    /// `min(1 / length, 1 / cap)`: what turns a slope before the cap's factor, and an offset of this length, into a
    /// gradient; finite on a thin skeleton itself, where the offset is zero.
    #[inline(always)]
    pub fn inverse_length<const W: usize>(&self, length: Lanes<W>) -> Lanes<W> {
        (Lanes::splat(1.0) / length).min(Lanes::splat(self.inverse_cap))
    }
}

/// Stands for a cap of no width \[m\]: its inverse is finite, and no length of importance is as short.
pub const TINY: f64 = 1e-150;
