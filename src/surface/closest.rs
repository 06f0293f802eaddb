//! The point of a coat's surface that is closest to a given point.
//!
//! Where only one field reaches, the answer is a closed form. Where several blend, rays from the point (towards each
//! skeleton in reach, or outwards) give starts on the surface, from which Newton's method on the distance along the
//! surface goes down to a local minimum; the lowest one wins, after one more look round it.

use super::SurfaceHit;
use super::ray::cast;
use crate::coat::Coat;
use crate::coat::root::bracketed;
use crate::field::{Placed, Shape, blend};
use crate::math::{Vec3, tangents};

/// The closest point of the coat's surface, from outside or inside, in the frame of the coat; `None` if there is no
/// surface.
///
/// The sign of the distance is that of the solid: negative where the field is at least the isovalue. The position is
/// exact to rounding where a single field reaches and a root of the stationarity condition `(x - p) ∥ ∇f` elsewhere. A
/// blend has no closed form: the search could miss the closest of several dents or bulges that none of its rays meets.
pub fn closest(coat: &Coat, p: &Vec3) -> Option<SurfaceHit> {
    let depth = |skeleton: &Placed| skeleton.shape.closest(p).distance - skeleton.profile.thickness;
    let depths: Vec<f64> = coat.skeletons.iter().map(depth).collect();
    let nearest = (0..depths.len()).min_by(|a, b| depths[*a].total_cmp(&depths[*b]))?;
    let inside = coat.excess(p) >= 0.0;
    let alone = on_isolated(&coat.skeletons[nearest], p);
    let position = if subset(coat, p, depths[nearest].abs()).skeletons.len() <= 1 {
        alone
    } else {
        search(coat, p, inside, depths[nearest].abs())?
    };
    let offset = position - p;
    // On the surface itself the offset has no direction, and its length is the distance.
    let distance = if inside { -offset.norm() } else { offset.norm() };
    let normal = coat.normal(&position, &coat.skeletons[nearest].shape.closest(&position).normal);
    Some(SurfaceHit { distance, position, normal, skeleton: blend::territory(&coat.skeletons, &position) })
}

/// The closest point of a blend. Outside, `limit` is a bound of the distance: the isolated surface of the nearest
/// skeleton lies in the solid.
fn search(coat: &Coat, p: &Vec3, inside: bool, limit: f64) -> Option<Vec3> {
    let length = |x: &Vec3| (x - p).norm();
    // Starts up to twice as far as the closest may still slide below it.
    let probe = |coat: &Coat, u: &Vec3, reach: f64| {
        let hit = if inside { exit(coat, p, u) } else { cast(coat, p, u, reach).map(|hit| hit.position) };
        hit.filter(|x| length(x) <= reach)
    };
    let (first, reach) =
        if inside { (coat.clone(), f64::INFINITY) } else { (subset(coat, p, 2.0 * limit), 2.0 * limit) };
    let directions = if inside { outward(&first, p) } else { toward(&first, p) };
    let hits: Vec<Vec3> = directions.iter().filter_map(|u| probe(&first, u, reach)).collect();
    let reach = 2.0 * hits.iter().map(length).min_by(f64::total_cmp)?;
    let near = subset(coat, p, reach);
    let best = lowest(&near, p, hits.into_iter().filter(|x| length(x) <= reach))?;
    // A look round the best finds its lower neighbours.
    let Some(axis) = (best - p).try_normalize(0.0) else { return Some(best) };
    let again = cone(&axis).filter_map(|u| probe(&near, &u, reach)).chain([best]);
    lowest(&near, p, again)
}

/// The skeletons whose field reaches the ball of this radius round `p`.
fn subset(coat: &Coat, p: &Vec3, radius: f64) -> Coat {
    let limit = radius * (1.0 + 1e-9);
    let reaches = |k: &Placed| k.shape.closest(p).distance - k.profile.radius < limit;
    let near = coat.skeletons.iter().enumerate().filter(|(_, k)| reaches(k));
    coat.subset(&near.map(|(position, _)| position as u32).collect::<Vec<_>>())
}

/// The closest point of the surface of an isolated skeleton.
fn on_isolated(skeleton: &Placed, p: &Vec3) -> Vec3 {
    let (shape, thickness) = (&skeleton.shape, skeleton.profile.thickness);
    let closest = shape.closest(p);
    let thin = !shape.is_solid();
    // On a thin skeleton the direction to it is lost to rounding: any direction square to it is as good.
    if thin && closest.distance <= 1e-10 * thickness + 8.0 * f64::EPSILON * p.norm() {
        let across = across(shape);
        let side = if across.dot(&closest.normal) < 0.0 { -1.0 } else { 1.0 };
        return shape.closest_point(p) + across * (side * thickness);
    }
    let foot = if closest.distance > 0.0 { shape.closest_point(p) } else { p - closest.normal * closest.distance };
    let position = foot + closest.normal * thickness;
    // Near a thin skeleton the direction has few digits: one more step puts the point on the surface to the last one.
    let again = shape.closest(&position);
    position + again.normal * (thickness - again.distance)
}

/// A unit vector square to a thin shape.
fn across(shape: &Shape) -> Vec3 {
    match shape {
        Shape::Segment(a, b) => tangents(&(b - a).normalize()).0,
        Shape::Triangle(a, b, c) => (b - a).cross(&(c - a)).normalize(),
        _ => Vec3::x(),
    }
}

/// Directions in which to look for the surface from inside: away from each skeleton, down the field, and a fixed fan
/// of axes and diagonals.
pub(super) fn outward(coat: &Coat, p: &Vec3) -> Vec<Vec3> {
    let away = coat.skeletons.iter().map(|k| k.shape.closest(p).normal);
    let downhill = -coat.excess_gradient(p).1;
    let fan = (0..27).map(|i| Vec3::new(f64::from(i % 3 - 1), f64::from(i / 3 % 3 - 1), f64::from(i / 9 - 1)));
    away.chain([downhill]).chain(fan).filter_map(|u| u.try_normalize(0.0)).collect()
}

/// Directions in which to look from outside: to each skeleton, between the isolated surfaces of neighbours, and to
/// where a skeleton comes close to another that is close to `p`, as a blend bulges there.
pub(super) fn toward(coat: &Coat, p: &Vec3) -> Vec<Vec3> {
    const PAIRED: usize = 8;
    let mut targets: Vec<Vec3> = coat.skeletons.iter().map(|k| on_isolated(k, p)).collect();
    for a in coat.skeletons.iter().take(PAIRED) {
        for b in coat.skeletons.iter().take(PAIRED) {
            targets.push((on_isolated(a, p) + on_isolated(b, p)) * 0.5);
            let on_b = b.shape.closest_point(&a.shape.closest_point(p));
            targets.extend([on_b, a.shape.closest_point(&on_b)]);
        }
    }
    targets.iter().filter_map(|x| (x - p).try_normalize(0.0)).collect()
}

/// Three rings of directions round an axis.
pub(super) fn cone(axis: &Vec3) -> impl Iterator<Item = Vec3> {
    let (axis, (e1, e2)) = (*axis, tangents(axis));
    (0..24).map(move |k| {
        let (sine, cosine) = libm::sincos(f64::from(k % 8) * std::f64::consts::FRAC_PI_4);
        (axis + (e1 * cosine + e2 * sine) * [0.15, 0.45, 1.2][k as usize / 8]).normalize()
    })
}

/// Where a ray from the inside leaves the solid; `None` if it does not.
fn exit(coat: &Coat, p: &Vec3, direction: &Vec3) -> Option<Vec3> {
    let stride = coat.skeletons.iter().map(|k| 0.25 * k.profile.thickness).fold(f64::INFINITY, f64::min);
    first_exit(|s| coat.excess(&(p + direction * s)), stride, 1.25, 100).map(|s| p + direction * s)
}

/// Where an excess that is not negative at 0 first becomes so, looked for in so many strides, each longer than the one
/// before by a factor.
pub(super) fn first_exit(excess: impl Fn(f64) -> f64, mut stride: f64, growth: f64, strides: usize) -> Option<f64> {
    let (mut s, mut here) = (0.0, excess(0.0));
    for _ in 0..strides {
        let ahead = excess(s + stride);
        if ahead < 0.0 {
            return Some(bracketed(s, s + stride, here, ahead, excess));
        }
        (s, here) = (s + stride, ahead);
        stride *= growth;
    }
    None
}

/// The closest to `p` of the local minima that the starts lead to.
fn lowest(coat: &Coat, p: &Vec3, starts: impl Iterator<Item = Vec3>) -> Option<Vec3> {
    let ends = starts.map(|x| descend(coat, p, x));
    ends.min_by(|a, b| (a - p).norm_squared().total_cmp(&(b - p).norm_squared()))
}

/// Slides from `x`, on the surface, to a local minimum of the distance to `p`: Newton's steps in the tangent plane,
/// each brought back to the surface and shortened until it gains.
fn descend(coat: &Coat, p: &Vec3, mut x: Vec3) -> Vec3 {
    for _ in 0..60 {
        let (_, gradient, hessian) = blend::value_gradient_hessian(&coat.skeletons, &coat.graph, &x);
        let slope = gradient.norm();
        if slope == 0.0 {
            break;
        }
        let normal = -gradient / slope;
        let (offset, (e1, e2)) = (p - x, tangents(&normal));
        let along = offset.dot(&normal);
        let pull = (offset.dot(&e1), offset.dot(&e2));
        if pull.0.hypot(pull.1) <= 1e-15 * offset.norm() {
            break;
        }
        // Hessian of the Lagrangian |x - p|²/2 + λ (f - c) in the tangent plane, with λ = -along / slope.
        let bend = |a: &Vec3, b: &Vec3| -(along / slope) * a.dot(&(hessian * b));
        let (h11, h12, h22) = (1.0 + bend(&e1, &e1), bend(&e1, &e2), 1.0 + bend(&e2, &e2));
        let determinant = h11 * h22 - h12 * h12;
        let (z1, z2) = if h11 > 0.0 && determinant > 1e-6 * h11.max(h22).powi(2) {
            ((h22 * pull.0 - h12 * pull.1) / determinant, (h11 * pull.1 - h12 * pull.0) / determinant)
        } else {
            pull
        };
        let step = e1 * z1 + e2 * z2;
        let shorter = |k: i32| onto_surface(coat, x + step * 0.5_f64.powi(k));
        let better = |y: &Vec3| (y - p).norm_squared() < offset.norm_squared();
        match (0..24).filter_map(shorter).find(better) {
            Some(next) => x = next,
            None => break,
        }
    }
    x
}

/// Newton's steps along the gradient to the surface; `None` if they do not get there.
fn onto_surface(coat: &Coat, mut x: Vec3) -> Option<Vec3> {
    let mut best = f64::INFINITY;
    for _ in 0..20 {
        let (excess, gradient) = coat.excess_gradient(&x);
        let slope2 = gradient.norm_squared();
        if slope2 == 0.0 || excess.abs() > 2.0 * best {
            return None;
        }
        if excess.abs() <= 2e-16 * coat.isovalue || excess.abs() >= best && best <= 1e-12 * coat.isovalue {
            return Some(x);
        }
        best = excess.abs().min(best);
        x -= gradient * (excess / slope2);
    }
    (best <= 1e-12 * coat.isovalue).then_some(x)
}
