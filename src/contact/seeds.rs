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
use super::deepest::Deepest;
use super::pair::{Pair, Side};
use super::patch::Node;
use super::surface::Surface;
use crate::coat::seeds::{Ray, plane_rays};
use crate::coat::territory;
use crate::field::Shape;
use crate::math::Vec3;

/// Smallest part of both gradients' lengths that the fields must change by along a ray to count as they are; the other
/// body's rays carry the rest.
const GRAZING: f64 = 0.05;

/// Integrates all of a pair's contact with the seeds of both coats.
pub fn integrate(pair: &Pair, out: &mut Surface) {
    if out.maxima().is_empty() {
        return;
    }
    let mut samples = 0u32;
    let first = out.nodes.len();
    for from_a in [true, false] {
        let (own, other) = if from_a { (&pair.a, &pair.b) } else { (&pair.b, &pair.a) };
        // A rigid body stores no energy: its partner's rays carry all of it.
        if own.rigid {
            continue;
        }
        let mut lattice = Vec::new();
        for index in 0..own.skeletons.len() {
            let shape = own.skeletons[index].shape;
            let rays: &[Ray] = if let Shape::Plane { point, normal } = &shape {
                let (low, high) = finite_bounds(other);
                lattice.clear();
                plane_rays(point, normal, spacing(other), &low, &high, &mut lattice);
                &lattice
            } else {
                &own.rays[index]
            };
            let pose = own.poses[index];
            for ray in rays {
                let ray = if matches!(shape, Shape::Plane { .. }) { *ray } else { ray.transformed(&pose) };
                samples += cast(pair, from_a, index, &ray, &mut out.nodes);
            }
        }
    }
    share_out(pair, first, samples, out);
}

/// How far behind its surface a half-space is searched for the contact surface, in thicknesses.
const DEEPEST: f64 = 64.0;

/// Follows one ray to the contact surface and adds its node. Gives the evaluations it took.
fn cast(pair: &Pair, from_a: bool, skeleton: usize, ray: &Ray, nodes: &mut Vec<Node>) -> u32 {
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
    let mut evaluations = 1;
    if sign * end.difference >= 0.0 {
        return evaluations;
    }
    let plane = matches!(own.skeletons[skeleton].shape, Shape::Plane { .. });
    // Rays reach back into a solid core as far as their face is the nearest; a half-space goes on.
    let (mut low, mut high) = (if plane { outer - DEEPEST * profile.thickness } else { -ray.core }, outer);
    let start = pair.sample(&at(low));
    evaluations += 1;
    if sign * start.difference <= 0.0 {
        // Pressed beyond the skeleton itself: see `overload`.
        return evaluations;
    }
    let mut r = outer;
    let mut sample = end;
    for _ in 0..60 {
        let value = sign * sample.difference;
        if value > 0.0 {
            low = r;
        } else {
            high = r;
        }
        let slope = sign * sample.difference_gradient.dot(&ray.direction);
        let newton = r - value / slope;
        let next = if slope < 0.0 && newton > low && newton < high { newton } else { 0.5 * (low + high) };
        if (next - r).abs() <= 1e-14 * outer.abs() {
            break;
        }
        r = next;
        sample = pair.sample(&at(r));
        evaluations += 1;
        if sample.difference.abs() <= 1e-13 {
            break;
        }
    }
    let position = at(r);
    let pressure = pair.scale * sample.sum;
    if pressure <= 0.0 || !territory::owns(&own.skeletons, own.isovalue, skeleton, &position) {
        return evaluations;
    }
    let steepness = sample.difference_gradient.norm();
    let others_part = pair.others_part(&sample, from_a);
    // Where the two parts cancel, their difference is no measure: neither force nor area may grow past `1 / GRAZING`.
    let least = GRAZING * (others_part.norm() + pair.others_part(&sample, !from_a).norm());
    let along = (-sign * sample.difference_gradient.dot(&ray.direction)).max(least);
    let measure = ray.weight * r.powi(i32::from(ray.power));
    // On b: the partner of an a ray is b itself.
    let force = others_part * (sign * pressure * measure / along);
    // Both bodies' rays cover the surface: each counts for the share of its partner's gradient.
    let area = measure * others_part.norm() / along;
    let normal = sample.difference_gradient / -steepness;
    nodes.push(Node { position, force, area, stiffness: area * pair.normal_stiffness(&sample, &normal) });
    evaluations
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
fn spacing(side: &Side) -> f64 {
    let (mut area, mut count) = (0.0, 0usize);
    for (skeleton, rays) in side.skeletons.iter().zip(&side.rays) {
        let t = skeleton.profile.thickness;
        area += rays.iter().map(|ray| ray.weight * t.powi(i32::from(ray.power))).sum::<f64>();
        count += rays.len();
    }
    (area / count.max(1) as f64).sqrt()
}

/// Gives each node to its nearest deepest point: one patch a deepest point that received any.
fn share_out(pair: &Pair, first: usize, samples: u32, out: &mut Surface) {
    let maxima: Vec<Deepest> = out.maxima().to_vec();
    let nearest = |p: &Vec3| {
        let distance = |m: &Deepest| (m.position - p).norm_squared();
        (0..maxima.len()).min_by(|i, j| distance(&maxima[*i]).total_cmp(&distance(&maxima[*j]))).unwrap_or(0)
    };
    let mut owners: Vec<(usize, Node)> = out.nodes.drain(first..).map(|node| (nearest(&node.position), node)).collect();
    owners.sort_by_key(|(owner, _)| *owner);
    let mut rest = samples;
    for (index, at) in maxima.iter().enumerate() {
        let begin = out.nodes.len();
        out.nodes.extend(owners.iter().filter(|(owner, _)| *owner == index).map(|(_, node)| *node));
        let count = out.nodes.len() - begin;
        if count > 0 {
            // Measured law of seeds in contact (docs/model.md), doubled to hold for nearly all poses.
            let error = (0.9 * (count as f64).powf(-1.2)).min(1.0);
            out.push(at, begin, pair.scale, error, rest, Scheme::Seeds);
            rest = 0;
        }
    }
}
