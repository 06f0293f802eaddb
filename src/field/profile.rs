//! Profiles: the field value `F(d)` of a skeleton at distance `d`.
//!
//! Three pieces, joined with a continuous slope (docs/model.md, "Profiles"):
//!
//! - inside, `d <= t`: linear \[97, Fig. 5a\], or stiffening towards the skeleton \[97, Fig. 5b\];
//! - outside, `t <= d <= R`: the cubic with `F(t) = c`, `F'(t) = -k`, `F(R) = F'(R) = 0`;
//! - near the skeleton, `d < δ`: a parabolic cap, so that thin skeletons have no kink at `d = 0`.

use crate::error::{Result, require};

/// Width of the cap of thin skeletons, as a fraction of the thickness.
pub const CAP: f64 = 0.05;

/// Field value against distance; see the [module](self).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Profile {
    /// Field value on the surface, `c`.
    pub isovalue: f64,
    /// Distance of the surface from an isolated skeleton, `t` \[m\].
    pub thickness: f64,
    /// Slope at the surface, `k` \[1/m\].
    pub stiffness: f64,
    /// Slope at the skeleton over the slope at the surface: 1 is linear.
    pub stiffening: f64,
    /// Distance beyond which the field is zero, `R` \[m\].
    pub radius: f64,
    /// Width of the cap at the skeleton, `δ` \[m\]: zero for solid skeletons, whose distance is signed.
    pub cap: f64,
}

/// Value and derivatives of a profile at one distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jet {
    /// `F(d)`.
    pub value: f64,
    /// `F'(d)`.
    pub slope: f64,
    /// `F'(d) / d`, finite at `d = 0` under a cap.
    pub slope_over_distance: f64,
    /// `F''(d)`.
    pub curvature: f64,
}

/// The outer piece of a profile, with what does not depend on the distance worked out.
#[derive(Clone, Copy, Debug)]
pub struct Outer {
    thickness: f64,
    radius: f64,
    inverse_width: f64,
    a: f64,
    b: f64,
}

impl Outer {
    /// Distance of the surface \[m\].
    pub fn thickness(&self) -> f64 {
        self.thickness
    }

    /// Distance where the field ends \[m\].
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// `F`, `F'` at a distance larger than the thickness; `None` for others.
    #[inline(always)]
    pub fn value_slope(&self, d: f64) -> Option<(f64, f64)> {
        if d <= self.thickness {
            return None;
        }
        let u = (self.radius - d) * self.inverse_width;
        let u = if u > 0.0 { u } else { 0.0 };
        Some((u * u * (self.a + self.b * u), -u * (2.0 * self.a + 3.0 * self.b * u) * self.inverse_width))
    }
}

impl Profile {
    /// Its outer piece, for many distances.
    #[inline]
    pub fn outer(&self) -> Outer {
        let width = self.radius - self.thickness;
        let kw = self.stiffness * width;
        let (a, b) = (3.0 * self.isovalue - kw, kw - 2.0 * self.isovalue);
        Outer { thickness: self.thickness, radius: self.radius, inverse_width: 1.0 / width, a, b }
    }

    /// Checks the ranges; `solid` skeletons have a signed distance and need no cap.
    ///
    /// `stiffness` 0 stands for `2 c / (R - t)`, which makes the outer piece a parabola with the smallest curvature;
    /// `radius` 0 stands for `2 t`.
    pub fn new(
        isovalue: f64,
        thickness: f64,
        stiffness: f64,
        stiffening: f64,
        radius: f64,
        solid: bool,
    ) -> Result<Self> {
        require("thickness", thickness, "> 0 and at most 1e9", |x| x > 0.0 && x <= 1e9)?;
        let radius = if radius == 0.0 { 2.0 * thickness } else { radius };
        require("radius", radius, "larger than thickness and at most 1e9 (or 0 for twice the thickness)", |x| {
            x > thickness && x <= 1e9 && x - thickness > 1e-9 * x
        })?;
        let width = radius - thickness;
        let stiffness = if stiffness == 0.0 { 2.0 * isovalue / width } else { stiffness };
        // Beyond 3 c / (R - t) the cubic dips below zero before R: the field would not be monotone.
        require(
            "stiffness",
            stiffness,
            "> 0 and at most 3 isovalue / (radius - thickness) (or 0 for 2 isovalue / (radius - thickness))",
            |x| x > 0.0 && x * width <= 3.0 * isovalue * (1.0 + 1e-12),
        )?;
        require("stiffening", stiffening, "from 0 to 1e6", |x| (0.0..=1e6).contains(&x))?;
        let cap = if solid { 0.0 } else { CAP * thickness };
        Ok(Self { isovalue, thickness, stiffness, stiffening, radius, cap })
    }

    /// The profile with its surface moved outwards by `offset`, more than `-t` \[m\]: `F(d - offset)` \[97, eq. (23)\]
    /// from the surface outwards. Inside, it keeps its slopes at the surface and at the skeleton.
    pub fn inflated(&self, offset: f64) -> Self {
        let thickness = self.thickness + offset;
        let cap = if self.cap > 0.0 { CAP * thickness } else { 0.0 };
        Self { thickness, radius: self.radius + offset, cap, ..*self }
    }

    /// `F`, `F'` at distance `d` (negative inside a solid skeleton).
    #[inline]
    pub fn value_slope(&self, d: f64) -> (f64, f64) {
        if d > self.thickness {
            if d >= self.radius {
                return (0.0, 0.0);
            }
            let width = self.radius - self.thickness;
            let u = (self.radius - d) / width;
            // F = u² (a + b u) with a = 3c - kw, b = kw - 2c: the cubic of the module's text in u = 1 - s.
            let kw = self.stiffness * width;
            let (a, b) = (3.0 * self.isovalue - kw, kw - 2.0 * self.isovalue);
            return (u * u * (a + b * u), -u * (2.0 * a + 3.0 * b * u) / width);
        }
        let (capped, factor) = self.capped_distance(d);
        let (value, slope) = self.inner(self.thickness - capped);
        (value, slope * factor)
    }

    /// Value and the derivatives that a Hessian needs.
    pub fn jet(&self, d: f64) -> Jet {
        let (value, slope) = self.value_slope(d);
        if d > self.thickness {
            if d >= self.radius {
                return Jet { value, slope, slope_over_distance: 0.0, curvature: 0.0 };
            }
            let width = self.radius - self.thickness;
            let u = (self.radius - d) / width;
            let kw = self.stiffness * width;
            let (a, b) = (3.0 * self.isovalue - kw, kw - 2.0 * self.isovalue);
            let curvature = (2.0 * a + 6.0 * b * u) / (width * width);
            return Jet { value, slope, slope_over_distance: slope / d, curvature };
        }
        let (capped, factor) = self.capped_distance(d);
        let x = self.thickness - capped;
        let bend = if x < self.thickness { (self.stiffening - 1.0) * self.stiffness / self.thickness } else { 0.0 };
        if self.is_capped(d) {
            let (_, inner_slope) = self.inner(x);
            let slope_over_distance = inner_slope / self.cap;
            Jet { value, slope, slope_over_distance, curvature: bend * factor * factor + slope_over_distance }
        } else {
            let slope_over_distance = if d > 0.0 { slope / d } else { 0.0 };
            Jet { value, slope, slope_over_distance, curvature: bend }
        }
    }

    /// The largest field value an isolated thin skeleton reaches, at `d = 0`. Solid skeletons go on rising inside;
    /// for them it is the value on the core's surface.
    pub fn peak(&self) -> f64 {
        self.value_slope(0.0).0
    }

    /// The largest slope `|F'|` at any distance: a Lipschitz constant of the field (docs/model.md, "Profiles").
    pub fn lipschitz(&self) -> f64 {
        let width = self.radius - self.thickness;
        let q = self.stiffness * width / self.isovalue;
        let outer =
            if q >= 1.5 { self.stiffness } else { (3.0 - q).powi(2) / (3.0 * (2.0 - q)) * self.isovalue / width };
        outer.max(self.stiffness * self.stiffening.max(1.0))
    }

    /// The distance at which the field has fallen to `level`, for `0 < level <= isovalue`: how far a surface can lie
    /// from this skeleton when others add to its field.
    pub fn distance_of_level(&self, level: f64) -> f64 {
        if level >= self.isovalue {
            return self.thickness;
        }
        let (mut near, mut far) = (self.thickness, self.radius);
        for _ in 0..60 {
            let middle = 0.5 * (near + far);
            if self.value_slope(middle).0 > level {
                near = middle;
            } else {
                far = middle;
            }
        }
        far
    }

    /// The inner piece at depth `x` below the surface: value, and slope with respect to the distance.
    #[inline]
    fn inner(&self, x: f64) -> (f64, f64) {
        let (t, k) = (self.thickness, self.stiffness);
        if self.stiffening == 1.0 {
            return (self.isovalue + k * x, -k);
        }
        let bend = (self.stiffening - 1.0) * k / t;
        if x <= t {
            (self.isovalue + x * (k + 0.5 * bend * x), -(k + bend * x))
        } else {
            // Inside a solid core: on with the slope reached at its surface.
            (self.isovalue + t * (k + 0.5 * bend * t) + k * self.stiffening * (x - t), -k * self.stiffening)
        }
    }

    /// Solid skeletons have no cap, and negative distances.
    #[inline]
    fn is_capped(&self, d: f64) -> bool {
        self.cap > 0.0 && d < self.cap
    }

    /// The distance with the cap's parabola near the skeleton, and its derivative.
    #[inline]
    fn capped_distance(&self, d: f64) -> (f64, f64) {
        if self.is_capped(d) { (0.5 * (d * d / self.cap + self.cap), d / self.cap) } else { (d, 1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn profiles() -> impl Strategy<Value = Profile> {
        (0.1..10.0f64, 0.01..5.0f64, 0.05..3.0f64, 0.0..20.0f64, 0.1..4.0f64, any::<bool>()).prop_map(
            |(c, t, q, kappa, width, solid)| {
                Profile::new(c, t, q * c / (width * t), kappa, t * (1.0 + width), solid).unwrap()
            },
        )
    }

    proptest! {
        #[test]
        fn field_decreases_and_its_slope_is_its_derivative(f in profiles(), x in 0.0..1.2f64) {
            let d = x * f.radius;
            let h = 1e-6 * f.thickness;
            let (value, slope) = f.value_slope(d);
            prop_assert!(slope <= 1e-12 && value >= -1e-12);
            let numeric = (f.value_slope(d + h).0 - f.value_slope((d - h).max(0.0)).0) / (d + h - (d - h).max(0.0));
            prop_assert!((slope - numeric).abs() < 2e-4 * f.lipschitz() , "{slope} {numeric}");
            prop_assert!(slope.abs() <= f.lipschitz() * (1.0 + 1e-12));
        }

        #[test]
        fn jet_agrees_with_differences(f in profiles(), x in 0.0..1.2f64) {
            let d = x * f.radius;
            let h = 1e-7 * f.thickness;
            // The second derivative jumps at the joints: stay off them.
            for joint in [f.cap, f.thickness, f.radius] {
                prop_assume!((d - joint).abs() > 4.0 * h && d > 4.0 * h);
            }
            let jet = f.jet(d);
            let numeric = (f.value_slope(d + h).1 - f.value_slope(d - h).1) / (2.0 * h);
            let scale = f.lipschitz() / f.thickness.min(f.radius - f.thickness).min(if f.cap > 0.0 { f.cap } else { 1e9 });
            prop_assert!((jet.curvature - numeric).abs() < 1e-5 * scale, "{} {numeric}", jet.curvature);
            prop_assert!((jet.slope_over_distance * d - jet.slope).abs() <= 1e-12 * f.lipschitz());
        }

        #[test]
        fn surface_value_is_the_isovalue(f in profiles()) {
            let (value, slope) = f.value_slope(f.thickness);
            prop_assert!((value - f.isovalue).abs() < 1e-12 * f.isovalue);
            prop_assert!((slope + f.stiffness).abs() < 1e-9 * f.stiffness);
        }

        #[test]
        fn level_distance_inverts_the_profile(f in profiles(), level in 0.05..0.99f64) {
            let d = f.distance_of_level(level * f.isovalue);
            prop_assert!((f.value_slope(d).0 - level * f.isovalue).abs() < 1e-9 * f.isovalue);
        }
    }

    #[test]
    fn too_steep_a_profile_is_refused_with_value_and_range() {
        let error = Profile::new(1.0, 0.1, 40.0, 1.0, 0.2, false).unwrap_err().to_string();
        assert!(error.contains("40") && error.contains("3 isovalue"), "{error}");
        assert!(Profile::new(1.0, 0.3, 1.0, 1.0, 0.2, false).is_err());
        assert!(Profile::new(1.0, f64::NAN, 1.0, 1.0, 0.2, false).is_err());
    }
}
