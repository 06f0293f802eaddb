//! Columns: the contact surface as a height over a plane, for the schemes that integrate it there.
//!
//! A frame is put on the deepest point; over each point of its plane the surface is the root of `Φ` along the normal.
//! A column costs one or two evaluations, since the height is guessed from its neighbours and `σ` is extrapolated
//! along the last Newton step, whose error is of second order.

use super::deepest::Deepest;
use super::pair::{Pair, Sample};
use super::patch::Node;
use crate::math::Vec3;

/// A frame on the contact surface; lengths along `u` and `v` are in units of `scale`.
#[derive(Clone, Copy, Debug)]
pub struct Frame {
    /// Origin, in the pair's frame.
    pub origin: Vec3,
    /// Unit vector along the heights, from a to b.
    pub normal: Vec3,
    /// First axis in the plane, a unit vector.
    pub u: Vec3,
    /// Second axis in the plane, a unit vector.
    pub v: Vec3,
    /// Length of a unit of the first and the second coordinate \[m\].
    pub scale: [f64; 2],
}

/// The surface over a point of the plane.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Height over the plane \[m\].
    pub height: f64,
    /// `σ` on the surface.
    pub sum: f64,
    /// Both fields at the last evaluation, a Newton step away from the surface at most.
    pub sample: Sample,
}

impl Frame {
    /// A frame on a deepest point.
    pub fn new(at: &Deepest, scale: [f64; 2]) -> Self {
        Self { origin: at.position, normal: at.normal, u: at.axes[0], v: at.axes[1], scale }
    }

    /// The point at coordinates `(x, y)` and a height.
    #[inline]
    pub fn point(&self, x: f64, y: f64, height: f64) -> Vec3 {
        self.origin + self.u * (x * self.scale[0]) + self.v * (y * self.scale[1]) + self.normal * height
    }

    /// Coordinates and height of a point.
    pub fn coordinates(&self, p: &Vec3) -> (f64, f64, f64) {
        let d = p - self.origin;
        (d.dot(&self.u) / self.scale[0], d.dot(&self.v) / self.scale[1], d.dot(&self.normal))
    }

    /// The frame turned to have its heights along a direction, which is not against them.
    pub fn facing(&self, direction: &Vec3) -> Self {
        let normal = direction.normalize();
        let along = [self.u, self.v].map(|axis| axis - normal * axis.dot(&normal));
        let u = if along[0].norm_squared() > along[1].norm_squared() { along[0] } else { along[1].cross(&normal) };
        let u = u.normalize();
        Self { normal, u, v: normal.cross(&u), ..*self }
    }

    /// Area of a unit of the coordinates \[m²\].
    pub fn unit_area(&self) -> f64 {
        self.scale[0] * self.scale[1]
    }
}

/// `|Φ|` below which the last Newton step is extrapolated instead of evaluated, for a contact of this highest `σ`: what
/// is left of `Φ` tilts the vector area in proportion.
pub fn accept(peak: f64, tolerance: f64) -> f64 {
    peak * tolerance.min(0.015)
}

/// What a column needs besides its place.
pub struct Solver<'a> {
    /// The two coats.
    pub pair: &'a Pair,
    /// The plane and its axes.
    pub frame: Frame,
    /// `|Φ|` below which the last Newton step is extrapolated instead of evaluated.
    pub accept: f64,
    /// Relative Newton step below which the border is taken without another look.
    pub border_step: f64,
    /// Evaluations so far.
    pub evaluations: u32,
}

/// How a frame came to its size.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fit {
    /// From the pressure's curvature: the patch is smooth and nearly elliptic.
    Predicted,
    /// From the border: it has corners, or flat parts.
    Measured,
}

/// What the border looks like from a frame.
enum Look {
    /// Near enough to the unit circle.
    Round,
    /// The frame was changed.
    Refitted,
}

/// A polygon's centroid, the direction of its longer principal axis, and the semi-axes of the ellipse with its second
/// moments.
#[expect(clippy::type_complexity, reason = "three plain figures")]
fn moments(polygon: &[(f64, f64)]) -> Option<((f64, f64), (f64, f64), [f64; 2])> {
    let (mut area, mut x, mut y, mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    for (index, p) in polygon.iter().enumerate() {
        let q = polygon[(index + 1) % polygon.len()];
        let cross = p.0 * q.1 - q.0 * p.1;
        area += cross / 2.0;
        x += cross * (p.0 + q.0) / 6.0;
        y += cross * (p.1 + q.1) / 6.0;
        xx += cross * (p.0 * p.0 + p.0 * q.0 + q.0 * q.0) / 12.0;
        yy += cross * (p.1 * p.1 + p.1 * q.1 + q.1 * q.1) / 12.0;
        xy += cross * (p.0 * q.1 + 2.0 * p.0 * p.1 + 2.0 * q.0 * q.1 + q.0 * p.1) / 24.0;
    }
    if area <= 0.0 {
        return None;
    }
    let center = (x / area, y / area);
    let (xx, yy) = (xx / area - center.0 * center.0, yy / area - center.1 * center.1);
    let xy = xy / area - center.0 * center.1;
    let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let radius = half.hypot(xy);
    let angle = 0.5 * libm::atan2(xy, half);
    let semi = |moment: f64| 2.0 * moment.max(1e-12 * mean).sqrt();
    Some((center, (libm::cos(angle), libm::sin(angle)), [semi(mean + radius), semi(mean - radius)]))
}

/// Steepest surface that still counts as a height over the plane, as the cosine of its tilt.
pub const STEEPEST: f64 = 0.12;

impl Solver<'_> {
    /// Sets how far the roots are solved for a contact of this highest `σ`. What a last Newton step leaves of the border
    /// is its square, and the rules count on the pressure being zero there.
    pub fn aim(&mut self, peak: f64, tolerance: f64) {
        self.accept = accept(peak, tolerance);
        self.border_step = 0.3 * tolerance.sqrt();
    }

    /// Finds the surface over `(x, y)` from a guess of its height. `None` where it leans over or is not found.
    #[inline]
    pub fn column(&mut self, x: f64, y: f64, guess: f64) -> Option<Column> {
        let mut height = guess;
        for _ in 0..12 {
            let point = self.frame.point(x, y, height);
            let sample = self.pair.sample(&point);
            self.evaluations += 1;
            let fall = -sample.difference_gradient.dot(&self.frame.normal);
            if fall <= STEEPEST * sample.difference_gradient.norm() {
                return None;
            }
            let step = sample.difference / fall;
            height += step;
            if sample.difference.abs() <= self.accept {
                let sum = sample.sum + step * sample.sum_gradient.dot(&self.frame.normal);
                return Some(Column { height, sum, sample });
            }
        }
        None
    }

    /// The node that a column stands for, with `weight` in units of the coordinates; none outside the contact.
    #[inline]
    pub fn node(&self, x: f64, y: f64, column: &Column, weight: f64) -> Option<Node> {
        if column.sum <= 0.0 {
            return None;
        }
        let gradient = column.sample.difference_gradient;
        let fall = -gradient.dot(&self.frame.normal);
        // Vector area: n dA = ∇Φ / (∇Φ·normal) times the area in the plane.
        let vector_area = gradient * (-weight * self.frame.unit_area() / fall);
        let area = vector_area.norm();
        let normal = vector_area / area;
        Some(Node {
            position: self.frame.point(x, y, column.height),
            force: vector_area * (self.pair.scale * column.sum),
            area,
            stiffness: area * self.pair.normal_stiffness(&column.sample, &normal),
        })
    }

    /// Scales the frame so that the border is near the unit circle: first as the pressure's curvature predicts, then, if
    /// that is off, by the border itself; `None` where there is no border. A tilted face is deepest at its rounded edge,
    /// which tells nothing of its size.
    pub fn fit(&mut self, at: &Deepest, extent: f64) -> Option<Fit> {
        let predicted = at.curvature.map(|c| if c < 0.0 { (2.0 * at.sum / -c).sqrt().min(extent) } else { extent });
        self.frame.scale = predicted;
        // Where the pressure is flat nothing was predicted.
        let curved = predicted.iter().all(|scale| *scale < extent);
        for round in 0..4 {
            if let Look::Round = self.look_round(at.sum)? {
                return Some(if round == 0 && curved { Fit::Predicted } else { Fit::Measured });
            }
        }
        Some(Fit::Measured)
    }

    /// Finds the border at eight azimuths; where it is far from the unit circle, moves the frame to the middle of what
    /// they enclose, with its principal axes and sizes.
    fn look_round(&mut self, peak: f64) -> Option<Look> {
        const COUNT: usize = 8;
        let mut polygon = [(0.0, 0.0); COUNT];
        let (mut nearest, mut farthest, mut height) = (f64::INFINITY, 0.0f64, 0.0);
        // First along both axes, both ways: what is round there is no face seen from its rounded edge or corner.
        for (seen, azimuth) in [0, 4, 2, 6, 1, 5, 3, 7].into_iter().enumerate() {
            let angle = 2.0 * std::f64::consts::PI * azimuth as f64 / COUNT as f64;
            let direction = (libm::cos(angle), libm::sin(angle));
            let (s, z) = self.border(direction, peak, height)?;
            // Opposite borders of a round patch are as high; else start level again.
            height = if (0.7..1.4).contains(&s) { z } else { 0.0 };
            polygon[azimuth] = (direction.0 * s * self.frame.scale[0], direction.1 * s * self.frame.scale[1]);
            nearest = nearest.min(s);
            farthest = farthest.max(s);
            if seen == 3 && (0.8..1.25).contains(&nearest) && (0.8..1.25).contains(&farthest) {
                // As predicted so far: the rest will be too, or the estimate will tell.
                return Some(Look::Round);
            }
        }
        if nearest > 0.6 && farthest < 1.7 {
            return Some(Look::Round);
        }
        let (center, axes, scale) = moments(&polygon)?;
        let (x, y) = (center.0 / self.frame.scale[0], center.1 / self.frame.scale[1]);
        let column = self.column(x, y, 0.0)?;
        if column.sum <= 0.0 {
            return None;
        }
        let origin = self.frame.point(x, y, column.height);
        let normal = column.sample.normal()?;
        let old = self.frame;
        let u = old.u * axes.0 + old.v * axes.1;
        let u = (u - normal * u.dot(&normal)).normalize();
        self.frame = Frame { origin, normal, u, v: normal.cross(&u), scale };
        Some(Look::Refitted)
    }

    /// The border along a direction of the frame: its radius and height.
    pub fn border(&mut self, direction: (f64, f64), peak: f64, guess: f64) -> Option<(f64, f64)> {
        self.border_from((0.0, 0.0, 0.0), direction, peak, guess)
    }

    /// The border along a direction from a place `(x, y, height)` in the contact: its distance, near 1 if the direction
    /// is as long as expected, and its height. Newton on `Φ = σ = 0` in the half-plane, kept between a point inside the
    /// contact and, once seen, one outside.
    pub fn border_from(
        &mut self,
        (x, y, height): (f64, f64, f64),
        (dx, dy): (f64, f64),
        peak: f64,
        guess: f64,
    ) -> Option<(f64, f64)> {
        let frame = self.frame;
        let foot = frame.point(x, y, 0.0);
        let along = frame.u * (dx * frame.scale[0]) + frame.v * (dy * frame.scale[1]);
        let (mut inside, mut height_inside, mut outside) = (0.0, height, f64::INFINITY);
        let (mut s, mut z, mut climbs) = (1.0, guess, 0);
        // Whether the height was that of the contact before the last climb.
        let mut from_inside = false;
        for _ in 0..80 {
            let sample = self.pair.sample(&(foot + along * s + frame.normal * z));
            self.evaluations += 1;
            let (phi_s, phi_z) =
                (sample.difference_gradient.dot(&along), sample.difference_gradient.dot(&frame.normal));
            let on_slope = phi_z < -STEEPEST * sample.difference_gradient.norm();
            if !on_slope || sample.difference.abs() >= 0.1 * peak {
                // Too far off the surface to tell. Climb back to it; where there is none, this is outside.
                climbs += 1;
                if on_slope && climbs <= 4 {
                    z -= sample.difference / phi_z;
                } else if from_inside {
                    outside = outside.min(s);
                    (s, z, climbs) = (0.5 * (inside + outside), height_inside, 0);
                } else {
                    // Perhaps only because of where the search came from.
                    (z, climbs, from_inside) = (height_inside, 0, true);
                }
                continue;
            }
            (climbs, from_inside) = (0, false);
            let (sum_s, sum_z) = (sample.sum_gradient.dot(&along), sample.sum_gradient.dot(&frame.normal));
            // σ on the surface here, and its change a unit of s.
            let sum = sample.sum - sample.difference * sum_z / phi_z;
            let rate = sum_s - sum_z * phi_s / phi_z;
            // The sign of an extrapolated value counts when the extrapolation was small beside it.
            if sample.difference.abs() < 0.2 * sum.abs() {
                if sum > 0.0 {
                    (inside, height_inside) = (s, z - sample.difference / phi_z);
                } else {
                    outside = outside.min(s);
                }
            }
            let mut next = if rate < 0.0 { s - sum / rate } else { f64::INFINITY };
            let upper = if outside.is_finite() { outside } else { 2.0 * s.max(0.05) };
            if !(next > inside && next < upper) {
                next = if outside.is_finite() { 0.5 * (inside + outside) } else { upper };
            }
            let step = next - s;
            z -= (sample.difference + phi_s * step) / phi_z;
            s = next;
            let near = rate < 0.0 && step.abs() <= self.border_step * s && sum.abs() < 0.3 * peak;
            if near || outside - inside <= 1e-9 * s {
                return Some((s, z));
            }
            if s > 1e4 {
                return None;
            }
        }
        None
    }
}
