//! Pressure on the coat of a substance, a particle at a time.
//!
//! Where a substance A meets something B, the contact surface is where both pressures are equal, `Φ = w_a α - w_b β = 0`,
//! and the pressure there is `p = K σ`, as between any coats (docs/model.md, "Contact surface"). The particles of A share
//! the integral of `p n dA` by their share of the field, `f_i / f_A`, which is smooth, adds up to one, and ends at the
//! particle's radius: what the papers call distribution by field contribution is here a partition of unity. Each particle
//! integrates its part on rays from its centre towards B, in a fan of meridians about the way to the foot; along each,
//! Gauss points lie between the centre and the border of the pressure, so that light contacts have as many as deep ones.
//! On a ray, `n dA = r² dω ∇Φ / (∇Φ·u)`.

use std::f64::consts::TAU;

use super::locale::{Locale, round_sector};
use crate::contact::pair::Side;
use crate::math::{Vec3, tangents};

/// Meridians of a fan.
const MERIDIANS: usize = 8;
/// Gauss-Legendre on (0, 1).
const NODES: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];
/// Half angle of the widest fan.
const WIDEST: f64 = 1.4;
/// Steps towards the deepest point.
const CLIMBS: usize = 4;
/// Farthest that it may be, over the radius: beyond, the particle's share is too small to count.
const FARTHEST: f64 = 0.9;
/// Rounds of Newton's method along a ray.
const ROUNDS: usize = 8;
/// Closest that the surface may be to where the rays begin, over the radius: they do behind a particle that is nearer, so
/// that the widest fan still sees all of it.
const CLOSEST: f64 = 0.2;

/// What a particle meets.
pub enum Opposite<'a> {
    /// A body's coat, or the part of it by these of its skeletons.
    Coat(&'a Side, &'a [u32]),
    /// The others of its locale.
    Piece {
        /// Field on their surface.
        isovalue: f64,
    },
}

/// How stiff both are.
#[derive(Clone, Copy, Debug)]
pub struct Stiffness {
    /// Pressure a unit of field of the substance \[Pa\].
    pub own: f64,
    /// The same of what it meets; infinite when that is rigid.
    pub other: f64,
}

impl Stiffness {
    /// Pressure a unit of `σ` \[Pa\].
    pub fn joint(&self) -> f64 {
        self.weights().2
    }

    /// `w_a`, `w_b` and `K`.
    fn weights(&self) -> (f64, f64, f64) {
        if self.other.is_infinite() {
            (0.0, 1.0, self.own)
        } else {
            let sum = self.own + self.other;
            (self.own / sum, self.other / sum, self.own * (self.other / sum))
        }
    }
}

/// What presses on one particle.
#[derive(Clone, Copy, Debug, Default)]
pub struct Press {
    /// Force on the particle \[N\].
    pub push: Vec3,
    /// How much it grows along itself a metre of approach \[N/m\].
    pub stiffness: f64,
    /// Centre of pressure; where there is none, the foot.
    pub point: Vec3,
    /// Highest pressure \[Pa\], and where.
    pub peak: (f64, Vec3),
    /// Area \[m²\].
    pub area: f64,
    /// How near the foot is; none when it is out of reach.
    pub gap: Option<f64>,
}

impl Opposite<'_> {
    /// How far its field is above the isovalue, and the gradient.
    pub fn excess(&self, locale: &Locale, p: &Vec3) -> (f64, Vec3) {
        match self {
            Opposite::Piece { isovalue } => {
                let (value, gradient) = locale.other_gradient(p);
                (value - isovalue, gradient)
            }
            Opposite::Coat(side, near) if side.graph.is_complete() => {
                let mut sum = (-side.isovalue, Vec3::zeros());
                for index in *near {
                    let (value, gradient) = side.skeletons[*index as usize].value_gradient(p);
                    sum = (sum.0 + value, sum.1 + gradient);
                }
                sum
            }
            Opposite::Coat(side, _) => side.excess(p),
        }
    }
}

/// A point of the contact surface on a ray.
struct Node {
    p: Vec3,
    /// `n dA` over the solid angle.
    area: Vec3,
    /// `σ`.
    sum: f64,
    /// The particle's share of the field there.
    share: f64,
    /// Fraction that has not become one.
    apart: f64,
    /// Stiffness an area along the normal \[Pa/m\].
    rate: f64,
    /// How the pressure's `σ` rises along the surface.
    rise: Vec3,
}

struct Fan<'a, 'b> {
    /// Where the rays begin: at the particle, or behind it; and where they end.
    origin: Vec3,
    reach: f64,
    isovalue: f64,
    /// Of the particle.
    radius: f64,
    stiffness: Stiffness,
    opposite: &'a Opposite<'b>,
    locale: &'a mut Locale,
}

impl Fan<'_, '_> {
    /// `Φ` and its gradient; of a rigid opposite only its own field counts.
    fn difference(&self, p: &Vec3) -> (f64, Vec3) {
        let (wa, wb, _) = self.stiffness.weights();
        let (beta, slope) = self.opposite.excess(self.locale, p);
        if wa == 0.0 {
            return (-wb * beta, slope * -wb);
        }
        let (own, gradient) = self.locale.own_gradient(p);
        (wa * (own - self.isovalue) - wb * beta, gradient * wa - slope * wb)
    }

    /// The surface along a ray, not before `low`: Newton's method from a guess, kept in a bracket.
    fn root(&self, u: &Vec3, guess: f64, mut low: f64) -> Option<(f64, Vec3)> {
        let mut high = self.reach;
        let mut r = guess.clamp(low, high);
        let mut last = None;
        for _ in 0..ROUNDS {
            let (difference, gradient) = self.difference(&(self.origin + u * r));
            let along = gradient.dot(u);
            if difference > 0.0 {
                low = r;
            } else {
                high = r;
            }
            last = Some((r, gradient, along));
            let step = if along < 0.0 { -difference / along } else { f64::NAN };
            if step.abs() <= 1e-9 * self.radius {
                break;
            }
            let next = r + step;
            r = if next > low && next < high { next } else { 0.5 * (low + high) };
            if high - low <= 1e-9 * self.radius {
                break;
            }
        }
        let (r, gradient, along) = last?;
        (r < self.reach * (1.0 - 1e-6) && along < 0.0).then_some((r, gradient / along))
    }

    /// `σ` on the surface along a ray.
    fn sum(&self, u: &Vec3, guess: f64) -> Option<f64> {
        let (r, _) = self.root(u, guess, 0.0)?;
        let (_, wb, _) = self.stiffness.weights();
        Some((self.locale.own(&(self.origin + u * r)) - self.isovalue) / wb)
    }

    fn node(&mut self, u: &Vec3, guess: f64) -> Option<(f64, Node)> {
        let (r, area) = self.root(u, guess, 0.0)?;
        let p = self.origin + u * r;
        let (own, gradient) = self.locale.own_gradient(&p);
        let alpha = own - self.isovalue;
        let n = area.normalize();
        let steep = self.stiffness.own * gradient.dot(&n).abs();
        let (_, wb, _) = self.stiffness.weights();
        let (sum, rate, apart, rise) = if self.stiffness.other.is_infinite() {
            (alpha, steep, 1.0, gradient)
        } else {
            let (beta, slope) = self.opposite.excess(self.locale, &p);
            let others = self.stiffness.other * slope.dot(&n).abs();
            let apart = match self.opposite {
                Opposite::Piece { isovalue } if self.locale.is_bonded() && alpha > -self.isovalue => {
                    (1.0 - self.locale.bonded(&p) / (own * (beta + isovalue)).max(1e-300)).clamp(0.0, 1.0)
                }
                _ => 1.0,
            };
            (alpha / wb, steep * others / (steep + others).max(1e-300), apart, gradient + slope)
        };
        let rise = rise - n * rise.dot(&n);
        let share = if own > 0.0 { self.locale.self_value(&p) / own } else { 0.0 };
        Some((r, Node { p, area: area * (r * r), sum, share, apart, rate, rise }))
    }

    /// The deepest point of the contact that is near the way along `axis`: light contacts are small, and need not be on
    /// the way to their particles. Its direction, its distance, and what is there.
    fn deepest(&mut self, mut axis: Vec3, guess: f64) -> Option<(Vec3, f64, Node)> {
        let (mut foot, mut node) = self.node(&axis, guess)?;
        if node.sum > 0.0 {
            return Some((axis, foot, node));
        }
        let mut last: Option<(Vec3, Vec3)> = None;
        for _ in 0..CLIMBS {
            // Secant on the rise, from the curvature of one field.
            let usual = foot * foot / (2.0 * self.isovalue);
            let rate = match last {
                Some((place, rise)) => {
                    let (way, change) = (node.p - place, rise - node.rise);
                    let fall = way.dot(&change);
                    if fall > 0.0 { way.norm_squared() / fall } else { 2.0 * usual }
                }
                None => usual,
            };
            let mut step = node.rise * rate;
            let most = 0.5 * foot;
            if step.norm() > most {
                step *= most / step.norm();
            }
            let to = node.p + step - self.origin;
            if step.norm() < 0.02 * foot || to.norm() > FARTHEST * self.radius {
                break;
            }
            last = Some((node.p, node.rise));
            let next = to.normalize();
            match self.node(&next, to.norm()) {
                Some((distance, found)) if found.sum > node.sum && distance < FARTHEST * self.radius => {
                    (axis, foot, node) = (next, distance, found);
                }
                _ => break,
            }
        }
        Some((axis, foot, node))
    }
}

/// What presses on a particle from about the direction `axis`; `guess` is how far the surface may be.
pub fn press(
    locale: &mut Locale,
    center: Vec3,
    axis: Vec3,
    guess: f64,
    (isovalue, radius): (f64, f64),
    stiffness: Stiffness,
    opposite: &Opposite,
) -> Press {
    let mut fan = Fan { origin: center, reach: radius, isovalue, radius, stiffness, opposite, locale };
    let (_, _, scale) = stiffness.weights();
    let mut press = Press::default();
    // Pressed hard, a particle is at the surface, or past it.
    let Some((depth, _)) = fan.root(&axis, guess, -radius) else { return press };
    let back = (CLOSEST * radius - depth).max(0.0);
    (fan.origin, fan.reach) = (center - axis * back, radius + back);
    let Some((straight, foot, first)) = fan.deepest(axis, depth + back) else { return press };
    press.gap = Some(foot - back);
    press.point = first.p;
    press.peak = (scale * first.sum * first.apart, first.p);
    let across = (radius * radius - depth * depth).max(0.0).sqrt();
    let half_angle = libm::atan2(across, depth + back) + libm::acos(axis.dot(&straight).min(1.0));
    let half_angle = half_angle.min(WIDEST);
    // Square of the distance from the axis, on the plane at the foot.
    let height = foot;
    let farthest = (height * libm::tan(half_angle)).powi(2);
    if farthest <= 0.0 {
        return press;
    }
    let (middle, ball) = round_sector(&straight, libm::cos(half_angle), fan.reach);
    fan.locale.narrow(&(fan.origin + middle), ball);
    let normal = first.area.normalize();
    let (e1, e2) = tangents(&straight);
    let (mut total, mut moment) = (0.0, Vec3::zeros());
    let mut forces: Vec<(Vec3, f64)> = Vec::with_capacity(MERIDIANS * NODES.len());
    // What is not under the particle varies more about the axis.
    let meridians = if axis == straight { MERIDIANS } else { 2 * MERIDIANS };
    let axis = straight;
    for meridian in 0..meridians {
        let (sine, cosine) = libm::sincos(TAU * meridian as f64 / meridians as f64);
        let outwards = e1 * cosine + e2 * sine;
        let ray = |q: f64| {
            let across = axis * height + outwards * q.sqrt();
            let length = across.norm();
            let u = across / length;
            (u, foot * normal.dot(&axis) / normal.dot(&u).max(0.1), length)
        };
        let sum_at = |q: f64| {
            let (u, guess, _) = ray(q);
            fan.sum(&u, guess).unwrap_or(-isovalue)
        };
        let Some((from, to)) = positive_part(first.sum, farthest, sum_at) else { continue };
        for (x, weight) in NODES {
            let (u, guess, length) = ray(from + (to - from) * x);
            let Some((_, node)) = fan.node(&u, guess) else { continue };
            let angle = height / (length * length * length);
            if node.sum <= 0.0 {
                continue;
            }
            let pressure = scale * node.sum * node.apart;
            if pressure > press.peak.0 {
                press.peak = (pressure, node.p);
            }
            // dω = height dq dφ / (2 length³)
            let measure = 0.5 * (to - from) * weight * (TAU / meridians as f64) * angle * node.share;
            let area = node.area * measure;
            let force = area * -pressure;
            press.push += force;
            let size = force.norm();
            total += size;
            moment += node.p * size;
            press.area += area.norm();
            forces.push((area, node.rate * node.apart));
        }
    }
    if total > 0.0 {
        press.point = moment / total;
    }
    let along = press.push.try_normalize(0.0).unwrap_or(-axis);
    // A shift along the force moves each element by its part along the normal.
    for (area, rate) in forces {
        let size = area.norm();
        if size > 0.0 {
            press.stiffness += rate * area.dot(&along).powi(2) / size;
        }
    }
    press
}

/// Where along a meridian the pressure is positive, from the value at its beginning and a few more: it is nearly linear
/// in the square of the distance from the axis.
fn positive_part(first: f64, farthest: f64, mut sum: impl FnMut(f64) -> f64) -> Option<(f64, f64)> {
    let middle = 0.5 * farthest;
    let half_way = sum(middle);
    if first <= 0.0 && half_way <= 0.0 {
        return None;
    }
    if first > 0.0 && half_way > 0.0 {
        // A share of the field ends with the fan in any case.
        return Some((0.0, farthest));
    }
    // Where the line through both is zero, once more with the value there.
    let (mut low, mut high) = ((0.0, first), (middle, half_way));
    let mut zero = middle * first / (first - half_way);
    for _ in 0..2 {
        let value = sum(zero);
        if (value > 0.0) == (low.1 > 0.0) {
            low = (zero, value);
        } else {
            high = (zero, value);
        }
        zero = low.0 + (high.0 - low.0) * low.1 / (low.1 - high.1);
    }
    Some(if first > 0.0 { (0.0, zero) } else { (zero, farthest) })
}
