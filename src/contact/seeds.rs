//! Energy-consistent seeds: the papers' sampling, with forces that conserve energy exactly.
//!
//! Each ray of a coat starts in its skeleton and meets the contact surface at `X`. The energy
//! `U = ∫ min(p_a, p_b) dV` is summed over the rays of both bodies, and the force is its exact derivative
//! (docs/model.md, "Seeds"): a ray of a with measure `J dμ` pushes b with
//!
//! ```text
//! p J dμ (w_b ∇β) / (w_b ∇β·u - w_a ∇α·u)
//! ```
//!
//! and a with the opposite, both at `X`; likewise with the roles exchanged. So action equals reaction at any number of
//! seeds, and moving two bodies round a closed loop does no work. A ray that only grazes the surface would get a
//! boundless force, also where the gradients of the two fields cancel: below a smallest part of what they come to
//! without signs it counts as if it had that, and the loop closes to what such rays carry.

use super::Scheme;
use super::deepest::{Deepest, approach};
use super::pair::{Pair, Side};
use super::patch::Node;
use super::surface::Surface;
use crate::coat::seeds::{Ray, plane_rays, rays};
use crate::coat::territory;
use crate::field::Shape;
use crate::math::Vec3;

/// Smallest part of both gradients' lengths that the fields must change by along a ray to count as they are; the other
/// body's rays carry the rest.
const GRAZING: f64 = 0.05;
/// Share of the load on rays that fall short of that, beyond which the sum says nothing sure.
const GRAZED: f64 = 0.05;

/// Estimated error of a patch is this, times the number of its seeds to the power -1.2: measured (docs/model.md, "Seeds")
/// to hold for nearly all poses. The rays of points are spread evenly over all directions; those of lines and faces
/// come in parts, and a contact cuts each part somewhere.
const POINTS: f64 = 1.5;
const PARTS: f64 = 9.0;

/// What the rays came to.
#[derive(Default)]
struct Tally {
    evaluations: u32,
    /// Load of all nodes, and of those whose ray grazes the surface \[N\].
    load: f64,
    grazed: f64,
    /// Rays that found the surface, and those that should have.
    met: u32,
    missed: u32,
}

impl Tally {
    /// Part of the force that is in doubt because of rays that graze the surface or miss it.
    fn doubt(&self) -> f64 {
        let grazed = if self.load > 0.0 { self.grazed / self.load } else { 0.0 };
        let missed = f64::from(self.missed) / f64::from((self.met + self.missed).max(1));
        if grazed > GRAZED { 1.0 } else { (grazed + missed).min(1.0) }
    }
}

/// Least rays of a skeleton where seeds stand in for a scheme that a tolerance was asked of.
pub const STAND_IN: usize = 1024;

/// Integrates all of a pair's contact with the seeds of both coats, at `least` so many a skeleton.
pub fn integrate(pair: &Pair, least: usize, out: &mut Surface) {
    if out.maxima.is_empty() {
        return;
    }
    let mut tally = Tally::default();
    let first = out.nodes.len();
    for from_a in [true, false] {
        let (own, other) = if from_a { (&pair.a, &pair.b) } else { (&pair.b, &pair.a) };
        // A rigid body stores no energy: its partner's rays carry all of it.
        if own.rigid {
            continue;
        }
        let mut made = std::mem::take(&mut out.rays);
        for index in 0..own.skeletons.len() {
            let shape = own.skeletons[index].shape;
            // Where the partner's coat reaches a skeleton, its rays may start on the partner's side.
            let reached = (0..other.skeletons.len()).any(|partner| {
                let [i, j] = if from_a { [index, partner] } else { [partner, index] };
                approach(pair, i, j).distance < other.reach[partner]
            });
            let sent: &[Ray] = if let Shape::Plane { point, normal } = &shape {
                let (low, high) = finite_bounds(other);
                made.clear();
                plane_rays(point, normal, spacing(other, least), &low, &high, &mut made);
                &made
            } else if own.rays[index].len() < least {
                made.clear();
                rays(&own.locals[index], own.skeletons[index].profile.thickness, least, &mut made);
                &made
            } else {
                &own.rays[index]
            };
            let pose = own.poses[index];
            for ray in sent {
                let ray = if matches!(shape, Shape::Plane { .. }) { *ray } else { ray.transformed(&pose) };
                cast(pair, from_a, index, reached, &ray, &mut out.nodes, &mut tally);
            }
        }
        out.rays = made;
    }
    share_out(pair, first, &tally, out);
}

/// How far behind its surface a half-space is searched for the contact surface, in thicknesses.
const DEEPEST: f64 = 64.0;

/// Follows one ray to the contact surface and adds its node. A ray that starts on its own side counts its flesh from the
/// surface on; one that starts on the other's, which it may only where the skeleton is `reached`, counts it up to there.
fn cast(
    pair: &Pair,
    from_a: bool,
    skeleton: usize,
    reached: bool,
    ray: &Ray,
    nodes: &mut Vec<Node>,
    tally: &mut Tally,
) {
    let own = if from_a { &pair.a } else { &pair.b };
    let profile = &own.skeletons[skeleton].profile;
    let sign = if from_a { 1.0 } else { -1.0 };
    let at = |r: f64| ray.foot + ray.direction * r;
    // The coat's own surface, where the ray's flesh ends.
    let mut outer = profile.thickness;
    if own.skeletons.len() > 1 {
        outer = own_surface(own, ray, profile.thickness, own.reach[skeleton]);
    }
    let end = pair.sample(&at(outer));
    tally.evaluations += 1;
    let own_at_end = sign * end.difference >= 0.0;
    if own_at_end && !reached {
        return;
    }
    let plane = matches!(own.skeletons[skeleton].shape, Shape::Plane { .. });
    // Rays reach back into a solid core as far as their face is the nearest; a half-space goes on.
    let (mut low, mut high) = (if plane { outer - DEEPEST * profile.thickness } else { -ray.core }, outer);
    let start = pair.sample(&at(low));
    tally.evaluations += 1;
    let own_at_start = sign * start.difference > 0.0;
    if own_at_start == own_at_end {
        // Without a change of sides there is no surface; all on the other's side is pressed beyond the skeleton itself.
        tally.missed += u32::from(!own_at_start);
        return;
    }
    let turn = if own_at_start { sign } else { -sign };
    let mut r = outer;
    let mut sample = end;
    for _ in 0..60 {
        let value = turn * sample.difference;
        if value > 0.0 {
            low = r;
        } else {
            high = r;
        }
        let slope = turn * sample.difference_gradient.dot(&ray.direction);
        let newton = r - value / slope;
        let next = if slope < 0.0 && newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - r).abs() <= 1e-14 * outer.abs() {
            break;
        }
        r = next;
        sample = pair.sample(&at(r));
        tally.evaluations += 1;
        if sample.difference.abs() <= 1e-13 {
            break;
        }
    }
    let position = at(r);
    let pressure = pair.scale * sample.sum;
    if pressure <= 0.0 || !territory::owns(&own.skeletons, own.isovalue, skeleton, &position) {
        return;
    }
    let across = -turn * sample.difference_gradient.dot(&ray.direction);
    if across <= 0.0 {
        // It leaves by the wrong side: a kink, or round-off.
        tally.missed += 1;
        return;
    }
    let steepness = sample.difference_gradient.norm();
    let others_part = pair.others_part(&sample, from_a);
    // Where the parts cancel, their difference is no measure: neither force nor area may grow past `1 / GRAZING`.
    let least = GRAZING * (others_part.norm() + pair.others_part(&sample, !from_a).norm());
    let along = across.max(least);
    let measure = ray.weight * r.powi(i32::from(ray.power));
    // On b: the partner of an a ray is b itself.
    let force = others_part * (sign * pressure * measure / along);
    tally.met += 1;
    tally.load += force.norm();
    if across < least {
        tally.grazed += force.norm();
    }
    // Both bodies' rays cover the surface: each counts for the share of its partner's gradient.
    let area = measure * others_part.norm() / along;
    let normal = sample.difference_gradient / -steepness;
    nodes.push(Node { position, force, area, stiffness: area * pair.normal_stiffness(&sample, &normal) });
}

/// Where a ray leaves its blended coat, between the thickness and the reach of its skeleton.
fn own_surface(own: &Side, ray: &Ray, thickness: f64, reach: f64) -> f64 {
    let (mut low, mut high) = (thickness, reach);
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if own.excess(&(ray.foot + ray.direction * middle)).0 > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
        if high - low <= 1e-6 * thickness {
            break;
        }
    }
    0.5 * (low + high)
}

/// Bounds of a side's finite skeletons with their coats.
fn finite_bounds(side: &Side) -> (Vec3, Vec3) {
    let mut bounds = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    for (skeleton, reach) in side.skeletons.iter().zip(&side.reach) {
        if !matches!(skeleton.shape, Shape::Plane { .. }) {
            let (low, high) = skeleton.shape.bounds(*reach);
            bounds = (bounds.0.inf(&low), bounds.1.sup(&high));
        }
    }
    bounds
}

/// Distance between the seeds of a side on its surface: what a plane's lattice takes over.
fn spacing(side: &Side, least: usize) -> f64 {
    let (mut area, mut count) = (0.0, 0usize);
    for (skeleton, rays) in side.skeletons.iter().zip(&side.rays) {
        let t = skeleton.profile.thickness;
        area += rays.iter().map(|ray| ray.weight * t.powi(i32::from(ray.power))).sum::<f64>();
        count += rays.len().max(least);
    }
    (area / count.max(1) as f64).sqrt()
}

/// Gives each node to its nearest deepest point: one patch a deepest point that received any.
fn share_out(pair: &Pair, first: usize, tally: &Tally, out: &mut Surface) {
    // Coats never pull: what does, and is in doubt, is worth nothing. The overlap is left to the push-out then.
    let normal = out.maxima[0].normal;
    let pull = -out.nodes[first..].iter().map(|node| node.force.dot(&normal)).sum::<f64>();
    if pull >= 0.0 && tally.doubt() >= 1.0 {
        out.nodes.truncate(first);
        out.evaluations += tally.evaluations;
        return;
    }
    let maxima = &out.maxima;
    let nearest = |p: &Vec3| {
        let distance = |m: &Deepest| (m.position - p).norm_squared();
        (0..maxima.len()).min_by(|i, j| distance(&maxima[*i]).total_cmp(&distance(&maxima[*j]))).unwrap_or(0)
    };
    let mut owned = std::mem::take(&mut out.owned);
    owned.clear();
    owned.extend(out.nodes.drain(first..).map(|node| (nearest(&node.position), node)));
    // Nodes of one owner stay in the order of their rays.
    owned.sort_by_key(|(owner, _)| *owner);
    let points =
        [&pair.a, &pair.b].iter().all(|side| side.skeletons.iter().all(|one| matches!(one.shape, Shape::Point(_))));
    let law = if points { POINTS } else { PARTS };
    let mut rest = tally.evaluations;
    for patch in owned.chunk_by(|x, y| x.0 == y.0) {
        let begin = out.nodes.len();
        out.nodes.extend(patch.iter().map(|(_, node)| *node));
        // What is pressed from all sides is the small rest of large loads, each of which errs by its part.
        let (load, force) = patch
            .iter()
            .fold((0.0, Vec3::zeros()), |(load, force), (_, node)| (load + node.force.norm(), force + node.force));
        let error = (law * (patch.len() as f64).powf(-1.2) + tally.doubt()) * (load / force.norm());
        let error = if error < 1.0 { error } else { 1.0 };
        let at = out.maxima[patch[0].0];
        out.push(&at, begin, pair.scale, error, rest, Scheme::Seeds);
        rest = 0;
    }
    out.owned = owned;
}
