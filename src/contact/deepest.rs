//! Discovery: the deepest points of a contact, found from the closest points of two primitives, so that no contact is
//! too narrow to be found.

use super::pair::{Pair, Sample, Side};
use crate::field::separation::{gap, separation, touching_point};
use crate::field::{Shape, skeleton::closest_points};
use crate::math::{Vec3, tangents};

/// A local maximum of the pressure on the contact surface, and the surface's shape there.
#[derive(Clone, Copy, Debug)]
pub struct Deepest {
    /// Where, in the pair's frame.
    pub position: Vec3,
    /// Unit normal of the surface, from a to b.
    pub normal: Vec3,
    /// Principal directions of the pressure along the surface.
    pub axes: [Vec3; 2],
    /// Second derivatives of `σ` along them \[1/m²\]: negative where it falls off.
    pub curvature: [f64; 2],
    /// `σ` here: positive in contact.
    pub sum: f64,
    /// Rate at which `σ`'s two parts change across the surface, `|∇σ|` at most \[1/m\].
    pub slope: f64,
    /// The skeletons it was found from.
    pub skeletons: [usize; 2],
    /// Evaluations it took.
    pub evaluations: u32,
}

/// Two primitives where they come closest.
#[derive(Clone, Copy, Debug)]
pub struct Approach {
    /// Distance; negative when one reaches into the other's solid core \[m\].
    pub distance: f64,
    /// Unit vector from a to b.
    pub direction: Vec3,
    /// Where two isolated coats with linear profiles would meet at equal pressure.
    pub meeting: Vec3,
}

/// Where skeletons `i` of a and `j` of b come closest.
pub fn approach(pair: &Pair, i: usize, j: usize) -> Approach {
    approach_of(pair, i, j, &pair.a.skeletons[i].shape, &pair.b.skeletons[j].shape)
}

/// Where each corner of skeletons `i` of a and `j` of b comes closest to the other skeleton.
pub fn approaches_of_corners(pair: &Pair, i: usize, j: usize) -> impl Iterator<Item = Approach> {
    let (a, b) = (&pair.a.skeletons[i].shape, &pair.b.skeletons[j].shape);
    let of_a = a.corners().map(move |corner| approach_of(pair, i, j, &Shape::Point(corner), b));
    of_a.chain(b.corners().map(move |corner| approach_of(pair, i, j, a, &Shape::Point(corner))))
}

/// Where shapes `a` and `b`, all of skeletons `i` and `j` or a part of them, come closest.
fn approach_of(pair: &Pair, i: usize, j: usize, a: &Shape, b: &Shape) -> Approach {
    let (on_a, on_b) = closest_points(a, b);
    let (distance, direction, from) = match (a, b) {
        (_, Shape::Plane { normal, .. }) => (b.closest(&on_a).distance, -normal, on_a),
        (Shape::Plane { normal, .. }, _) => {
            let distance = a.closest(&on_b).distance;
            (distance, *normal, on_b - normal * distance)
        }
        _ => apart(a, b, on_a, on_b),
    };
    let thickness = |side: &Side, skeleton: usize| side.skeletons[skeleton].profile.thickness;
    let (ta, tb) = (thickness(&pair.a, i), thickness(&pair.b, j));
    let (sa, sb) = (pair.a.slope(i), pair.b.slope(j));
    let along = if sa.is_infinite() {
        ta
    } else if sb.is_infinite() {
        distance - tb
    } else {
        (sa * ta - sb * tb + sb * distance) / (sa + sb)
    };
    Approach { distance, direction, meeting: from + direction * along }
}

/// Distance and direction of two bounded shapes from a to b, and the point of a that is closest to b. When they meet,
/// the shortest way out with a negative distance: the closest points say nothing then.
fn apart(a: &Shape, b: &Shape, on_a: Vec3, on_b: Vec3) -> (f64, Vec3, Vec3) {
    let (distance, across) = ((on_b - on_a).norm(), on_b - on_a);
    let direction = across / distance.max(f64::MIN_POSITIVE);
    let clear = if distance > 0.0 { gap(a, b, &direction) } else { f64::NEG_INFINITY };
    if clear >= 0.999 * distance {
        return (distance, direction, on_a);
    }
    // They meet, or the search for the closest points stopped short of them.
    let out = separation(a, b);
    if out.distance < clear {
        (distance, direction, on_a)
    } else if out.distance > 0.0 {
        (out.distance, out.direction, on_a)
    } else {
        (out.distance, out.direction, touching_point(a, b, &out))
    }
}

/// Most steps of the climb, and of the fall onto the surface after a climb that failed.
const ROUNDS: usize = 32;

/// One look at the two fields during the climb.
struct Look {
    found: Deepest,
    sample: Sample,
    /// Way to the surface along the normal, to first order.
    across: f64,
}

/// What both fields are at a point, read as if it were on the surface. `None` where there is no normal.
fn look(pair: &Pair, skeletons: [usize; 2], position: &Vec3) -> Option<Look> {
    let (sample, hessian) = pair.sample_hessian(position);
    let normal = sample.normal()?;
    let across = sample.difference / sample.difference_gradient.norm();
    let (e1, e2) = tangents(&normal);
    let reduce = |u: &Vec3, v: &Vec3| u.dot(&(hessian * v));
    let (axes, curvature) = principal(&e1, &e2, reduce(&e1, &e1), reduce(&e1, &e2), reduce(&e2, &e2));
    let found = Deepest {
        position: position + normal * across,
        normal,
        axes,
        curvature,
        // On the surface the sum is what the first order predicts there.
        sum: sample.sum + across * sample.sum_gradient.dot(&normal),
        slope: sample.gradient_a.norm().max(sample.gradient_b.norm()),
        skeletons,
        evaluations: 0,
    };
    Some(Look { found, sample, across })
}

/// Climbs to the deepest point from where two skeletons come closest. `None` when they do not touch.
pub fn find(pair: &Pair, i: usize, j: usize, from: &Approach) -> Option<Deepest> {
    let size = pair.a.skeletons[i].profile.thickness.min(pair.b.skeletons[j].profile.thickness);
    let settled = 1e-4 * size;
    let mut evaluations = 0;
    let mut position = from.meeting;
    let mut trust = 0.5 * size;
    let mut last = f64::INFINITY;
    let mut best: Option<Deepest> = None;
    // The point nearest to the surface that seemed to be in contact, for a climb that never comes to rest.
    let mut nearest = (f64::INFINITY, from.meeting);
    for _ in 0..ROUNDS {
        evaluations += 1;
        let Some(Look { found, sample, across }) = look(pair, [i, j], &position) else { break };
        if across.abs() > settled {
            if found.sum > 0.0 && across.abs() < nearest.0 {
                nearest = (across.abs(), position);
            }
            if across.abs() >= last {
                // Where the fields have a kink, every step of this length leaves the surface again.
                trust *= 0.25;
            }
            last = across.abs();
        } else if let Some(previous) = &best
            && found.sum < previous.sum - 1e-9 * previous.sum.abs()
        {
            // Overshot: go back half way.
            trust *= 0.25;
            if trust < 1e-6 * size {
                break;
            }
            position = 0.5 * (position + previous.position);
            continue;
        }
        let step = climb(&found, &sample, trust);
        if across.abs() <= settled {
            last = f64::INFINITY;
            best = Some(found);
            if step.norm() <= 1e-3 * size {
                break;
            }
        }
        position += found.normal * across.clamp(-2.0 * size, 2.0 * size) + step;
    }
    if best.is_none_or(|best| best.sum <= 0.0) {
        let starts = [nearest.1, from.meeting];
        best = starts.iter().find_map(|start| fall(pair, [i, j], start, size, &mut evaluations));
    }
    let mut found = best?;
    found.evaluations = evaluations;
    (found.sum > touch(pair)).then_some(found)
}

/// The surface near a point, where it is in contact.
pub fn surface_near(pair: &Pair, i: usize, j: usize, position: &Vec3, evaluations: &mut u32) -> Option<Deepest> {
    *evaluations += 1;
    if !pair.sample(position).is_pressed(touch(pair)) {
        return None;
    }
    let size = pair.a.skeletons[i].profile.thickness.min(pair.b.skeletons[j].profile.thickness);
    fall(pair, [i, j], position, size, evaluations)
}

/// The highest `σ` on the whole contact surface: the most that the two coats together are compressed, in units of
/// field. Zero without contact.
pub fn greatest(pair: &Pair) -> f64 {
    let mut greatest = 0.0_f64;
    for i in 0..pair.a.skeletons.len() {
        for j in 0..pair.b.skeletons.len() {
            let reach = pair.a.reach[i] + pair.b.reach[j];
            let from = approach(pair, i, j);
            if from.distance >= reach {
                continue;
            }
            let corners = approaches_of_corners(pair, i, j).filter(|_| !pair.is_simple());
            for from in std::iter::once(from).chain(corners.filter(|from| from.distance < reach)) {
                greatest = find(pair, i, j, &from).map_or(greatest, |found| greatest.max(found.sum));
            }
        }
    }
    greatest
}

/// The least `σ` that counts: a touch shallower than what rounding makes of the fields has no surface to integrate.
fn touch(pair: &Pair) -> f64 {
    1e-12 * (pair.a.isovalue + pair.b.isovalue)
}

/// The surface near a point, without a climb; `None` where it is not found, or not in contact.
fn fall(pair: &Pair, skeletons: [usize; 2], start: &Vec3, size: f64, evaluations: &mut u32) -> Option<Deepest> {
    let (mut position, mut stride, mut last) = (*start, 2.0 * size, f64::INFINITY);
    for _ in 0..ROUNDS {
        *evaluations += 1;
        let Look { found, across, .. } = look(pair, skeletons, &position)?;
        if across.abs() <= 1e-4 * size {
            return (found.sum > touch(pair)).then_some(found);
        }
        if across.abs() >= last {
            stride = 0.5 * stride.min(last);
        }
        last = across.abs();
        position += found.normal * across.clamp(-stride, stride);
    }
    None
}

/// Eigenvectors and eigenvalues of the 2×2 matrix of second derivatives in the plane of `e1`, `e2`.
fn principal(e1: &Vec3, e2: &Vec3, h11: f64, h12: f64, h22: f64) -> ([Vec3; 2], [f64; 2]) {
    let (mean, half) = (0.5 * (h11 + h22), 0.5 * (h11 - h22));
    let radius = half.hypot(h12);
    if radius <= 1e-9 * mean.abs() {
        return ([*e1, *e2], [mean, mean]);
    }
    let angle = 0.5 * libm::atan2(h12, half);
    let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
    ([e1 * cosine + e2 * sine, e2 * cosine - e1 * sine], [mean + radius, mean - radius])
}

/// A Newton step towards the maximum along the surface, cut to the trust radius.
fn climb(at: &Deepest, sample: &Sample, trust: f64) -> Vec3 {
    let mut step = Vec3::zeros();
    for (axis, curvature) in at.axes.iter().zip(at.curvature) {
        let gradient = sample.sum_gradient.dot(axis);
        let flat = 1e-3 * at.slope / trust.max(1e-300);
        let along = if curvature < -flat {
            -gradient / curvature
        } else if gradient.abs() > 1e-6 * at.slope {
            gradient.signum() * trust
        } else {
            0.0
        };
        step += axis * along.clamp(-trust, trust);
    }
    step
}
