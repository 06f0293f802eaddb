//! Where a ray first meets a coat.
//!
//! The distance to a convex shape is a convex function along a ray (so is the signed distance of boxes and planes):
//! ahead, it stays above its tangent. As profiles fall with distance, the fields at the tangents' distances bound the
//! field from above, and the ray may go on to where this bound reaches the isovalue. Such a step never skips a surface,
//! jumps over empty space at once, is exact against flat faces, and doubles the digits near a root like Newton's.
//! Where several fields overlap, very short steps along a grazing ray give way to a stride of 1/1024 of the thinnest
//! field and a bracketed root.

use super::SurfaceHit;
use crate::coat::Coat;
use crate::coat::root::bracketed;
use crate::field::{Placed, Shape, blend};
use crate::math::Vec3;

/// Shortest stride through overlapping fields, as a fraction of the smallest radius of influence among them.
const STRIDE: f64 = 1.0 / 1024.0;

/// Follows a ray to the first point where the coat's field reaches the isovalue.
///
/// `origin` \[m\] is in the frame of the coat, `direction` has unit length, `length` \[m\] may be infinite. A ray that
/// starts in the solid meets it at distance 0. `None` if the ray does not meet the coat within its length. A chord
/// through a blend that is shorter than 1/1024 of a radius of influence may be missed; single skeletons are exact.
pub fn cast(coat: &Coat, origin: &Vec3, direction: &Vec3, length: f64) -> Option<SurfaceHit> {
    let (ray, abreast) = Line::abreast(coat, origin, direction, length);
    let s = first_root(coat, &ray, -abreast, length - abreast)?;
    let position = ray.at(s);
    Some(SurfaceHit {
        distance: (abreast + s).max(0.0),
        position,
        normal: coat.normal(&position, &-direction),
        skeleton: blend::territory(&coat.skeletons, &position),
    })
}

/// Whether a ray comes within reach of a coat's field: cheaper than [`cast`], and true wherever that finds something.
pub fn enters(coat: &Coat, origin: &Vec3, direction: &Vec3, length: f64) -> bool {
    let (ray, abreast) = Line::abreast(coat, origin, direction, length);
    let enter = |k: &Placed| ray.entry(&k.shape, k.profile.radius, -abreast, length - abreast);
    coat.skeletons.iter().any(|k| enter(k).is_some())
}

/// A point in the middle of the bounded skeletons, or on the first plane.
fn middle(coat: &Coat) -> Vec3 {
    let bounded = coat.skeletons.iter().filter(|skeleton| !matches!(skeleton.shape, Shape::Plane { .. }));
    let (sum, count) =
        bounded.fold((Vec3::zeros(), 0.0), |(sum, n), skeleton| (sum + skeleton.shape.middle(), n + 1.0));
    if count > 0.0 { sum / count } else { coat.skeletons.first().map_or(Vec3::zeros(), |plane| plane.shape.middle()) }
}

/// A line, with distances along it from `base`.
pub(super) struct Line {
    base: Vec3,
    direction: Vec3,
}

impl Line {
    /// The line of a ray, and how far along the ray its base is: distances run from the point of the ray that is
    /// abreast of the body, as far away they would lose digits.
    pub(super) fn abreast(coat: &Coat, origin: &Vec3, direction: &Vec3, length: f64) -> (Self, f64) {
        let abreast = (middle(coat) - origin).dot(direction).clamp(0.0, length);
        (Self { base: origin + direction * abreast, direction: *direction }, abreast)
    }

    pub(super) fn at(&self, s: f64) -> Vec3 {
        self.base + self.direction * s
    }

    /// Distance to a shape at `s`, and its slope along the line.
    fn tangent(&self, shape: &Shape, s: f64) -> (f64, f64) {
        let closest = shape.closest(&self.at(s));
        (closest.distance, closest.normal.dot(&self.direction))
    }

    /// Where the line, from `s` on, comes within `radius` of a shape: Newton's steps, which convexity keeps short.
    pub(super) fn entry(&self, shape: &Shape, radius: f64, mut s: f64, end: f64) -> Option<f64> {
        for _ in 0..100 {
            let (distance, slope) = self.tangent(shape, s);
            if distance <= radius {
                return Some(s);
            }
            let next = s + (radius - distance) / slope;
            if slope >= 0.0 || next > end {
                return None;
            }
            if next <= s {
                return Some(s);
            }
            s = next;
        }
        Some(s)
    }
}

/// A skeleton whose field the line is in: tangent of its distance.
struct Term<'a> {
    position: usize,
    skeleton: &'a Placed,
    distance: f64,
    slope: f64,
}

impl Term<'_> {
    /// The most the field can be after `h` more metres.
    fn bound(&self, h: f64) -> f64 {
        let mut distance = if self.slope < 0.0 { self.distance + self.slope * h } else { self.distance };
        if !self.skeleton.shape.is_solid() {
            distance = distance.max(0.0);
        }
        self.skeleton.profile.value_slope(distance).0
    }

    /// Length after which the tangent reaches the skeleton's own surface.
    fn length_to_surface(&self) -> f64 {
        if self.slope < 0.0 { (self.distance - self.skeleton.profile.thickness) / -self.slope } else { f64::INFINITY }
    }
}

/// The first `s` in `[start, end)` where the field reaches the isovalue.
fn first_root(coat: &Coat, line: &Line, start: f64, end: f64) -> Option<f64> {
    let enter = |skeleton: &Placed| line.entry(&skeleton.shape, skeleton.profile.radius, start, end);
    let skeletons = coat.skeletons.iter().enumerate();
    let mut entries: Vec<(f64, usize)> = skeletons.filter_map(|(position, k)| Some((enter(k)?, position))).collect();
    entries.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut entries = entries.into_iter().peekable();
    let mut active: Vec<usize> = Vec::new();
    let mut terms: Vec<Term> = Vec::new();
    let mut s = start;
    // Where it last was outside, when steps may go too far.
    let mut outside: Option<(f64, f64)> = None;
    loop {
        if active.is_empty() {
            s = s.max(entries.peek()?.0);
        }
        while let Some((_, position)) = entries.next_if(|entry| entry.0 <= s) {
            active.push(position);
        }
        terms.clear();
        // Convexity: a line that leaves the support of a field never comes back to it.
        active.retain(|position| {
            let skeleton = &coat.skeletons[*position];
            let (distance, slope) = line.tangent(&skeleton.shape, s);
            let keep = distance < skeleton.profile.radius || slope < 0.0;
            if keep {
                terms.push(Term { position: *position, skeleton, distance, slope });
            }
            keep
        });
        let level = coat.isovalue - coat.graph.rise();
        let bound = |h: f64| terms.iter().map(|term| term.bound(h)).sum::<f64>() - level;
        let excess_at = |x: f64| {
            let p = line.at(x);
            let fields = terms.iter().map(|term| (term.position, term.skeleton.value(&p)));
            blend::together(&coat.graph, fields) - coat.isovalue
        };
        // Where not all fields add up, their sum is a bound only.
        let most = bound(0.0);
        let excess = if coat.graph.is_complete() { most } else { excess_at(s) };
        if excess >= 0.0 {
            let Some((before, excess_before)) = outside else { return Some(s) };
            return Some(bracketed(before, s, -excess_before, -excess, |x| -coat.excess(&line.at(x))));
        }
        if !coat.graph.is_complete() {
            outside = Some((s, excess));
        }
        let event = entries.peek().map_or(end, |entry| entry.0);
        let room = terms.iter().map(Term::length_to_surface).fold(event - s, f64::min);
        // On the tangent of a single field the bound reaches the isovalue exactly at the end of the room.
        let at_room = if terms.len() == 1 { 0.0 } else { bound(room) };
        let step = if most >= 0.0 {
            0.0
        } else if at_room <= 0.0 {
            room
        } else {
            bracketed(0.0, room, -most, -at_room, |h| -bound(h))
        };
        // Nor does the field rise faster than all slopes together, or hardly so: a step too far is noticed.
        let slopes = || terms.iter().map(|term| term.skeleton.profile.lipschitz()).sum::<f64>();
        let step = if coat.graph.is_complete() { step } else { step.max((-excess / slopes()).min(event - s)) };
        if step >= event - s {
            if event >= end {
                return None;
            }
            s = event;
            continue;
        }
        let stride = terms.iter().map(|term| STRIDE * term.skeleton.profile.radius).fold(f64::INFINITY, f64::min);
        if terms.len() > 1 && step < stride {
            let ahead = (s + stride).min(event);
            let at_ahead = excess_at(ahead);
            if at_ahead >= 0.0 {
                return Some(bracketed(s, ahead, -excess, -at_ahead, |x| -excess_at(x)));
            }
            if ahead >= end {
                return None;
            }
            s = ahead;
        } else if step <= 4.0 * f64::EPSILON * (s.abs() + line.at(s).norm()) {
            return Some(s);
        } else {
            s += step;
        }
    }
}
