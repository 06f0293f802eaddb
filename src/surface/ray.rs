//! Where a ray first meets a coat.
//!
//! The distance to a convex shape is a convex function along a ray (so is the signed distance of boxes and planes):
//! ahead, it stays above its tangent. As profiles fall with distance, the fields at the tangents' distances bound the
//! field from above, and the ray may go on to where this bound reaches the isovalue. Such a step never skips a surface,
//! jumps over empty space at once, is exact against flat faces, and doubles the digits near a root like Newton's.
//! Where several fields overlap, very short steps along a grazing ray give way to a stride of 1/1024 of the thinnest
//! field and a bracketed root.
//!
//! [`cast`] looks at all skeletons; a [`Caster`] is made ready once for many rays, and sorts the skeletons into a tree.

use super::SurfaceHit;
use super::tree::Tree;
use crate::coat::Coat;
use crate::coat::root::bracketed;
use crate::field::{Outer, Placed, Shape, blend};
use crate::math::Vec3;

/// Shortest stride through overlapping fields, as a fraction of the smallest radius of influence among them.
const STRIDE: f64 = 1.0 / 1024.0;
/// Rounding of a sum of fields, over the isovalue.
const ROUNDING: f64 = 1e-14;
/// A Newton's step over the shortest stride that needs none after it: its square, over a radius of influence, is 1e-13
/// of that.
const SETTLED: f64 = 3e-4;

/// Follows a ray to the first point where the coat's field reaches the isovalue.
///
/// `origin` \[m\] is in the frame of the coat, `direction` has unit length, `length` \[m\] may be infinite. A ray that
/// starts in the solid meets it at distance 0. `None` if the ray does not meet the coat within its length. A chord
/// through a blend that is shorter than 1/1024 of a radius of influence may be missed; single skeletons are exact.
pub fn cast(coat: &Coat, origin: &Vec3, direction: &Vec3, length: f64) -> Option<SurfaceHit> {
    let (line, abreast) = Line::abreast(coat, origin, direction, length);
    let mut work = Work::default();
    (0..coat.skeletons.len() as u32).for_each(|k| work.meet(coat, k, &line, -abreast, length - abreast));
    work.hit(coat, &line, abreast, length)
}

/// Whether a ray comes within reach of a coat's field: cheaper than [`cast`], and true wherever that finds something.
pub fn enters(coat: &Coat, origin: &Vec3, direction: &Vec3, length: f64) -> bool {
    let (ray, abreast) = Line::abreast(coat, origin, direction, length);
    let enter = |k: &Placed| ray.entry(&k.shape, k.profile.radius, -abreast, length - abreast);
    coat.skeletons.iter().any(|k| enter(k).is_some())
}

/// A coat's skeletons in a tree, for many rays against one coat; with the memory that rays use again.
#[derive(Clone, Debug, Default)]
pub struct Caster {
    tree: Tree,
    middle: Vec3,
    work: Work,
}

impl Caster {
    /// Makes it ready for this coat.
    pub fn prepare(&mut self, coat: &Coat) {
        self.tree.build_of(coat);
        self.middle = middle(coat);
    }

    /// The skeletons of the coat.
    pub fn tree(&self) -> &Tree {
        &self.tree
    }

    /// [`cast`] against the coat that it was made ready for.
    pub fn cast(&mut self, coat: &Coat, origin: &Vec3, direction: &Vec3, length: f64) -> Option<SurfaceHit> {
        let (line, abreast) = Line::abreast_of(&self.middle, origin, direction, length);
        let Self { tree, work, .. } = self;
        tree.meet(origin, direction, length, |k, _| work.meet(coat, k, &line, -abreast, length - abreast));
        work.hit(coat, &line, abreast, length)
    }
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
        Self::abreast_of(&middle(coat), origin, direction, length)
    }

    fn abreast_of(middle: &Vec3, origin: &Vec3, direction: &Vec3, length: f64) -> (Self, f64) {
        let abreast = (middle - origin).dot(direction).clamp(0.0, length);
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

/// A skeleton whose field a line meets.
#[derive(Clone, Copy, Debug)]
struct Passage {
    /// Where the line comes within reach.
    entry: f64,
    position: u32,
    /// Whether its distance has a sign.
    solid: bool,
    /// Of a point: where the line is abreast of it, and the square of its distance there.
    point: Option<(f64, f64)>,
}

impl Passage {
    /// `None` if the line does not come within reach between `start` and `end`.
    #[inline]
    fn new(skeleton: &Placed, position: u32, line: &Line, start: f64, end: f64) -> Option<Self> {
        let radius = skeleton.profile.radius;
        let Shape::Point(center) = &skeleton.shape else {
            let entry = line.entry(&skeleton.shape, radius, start, end)?;
            return Some(Self { entry, position, solid: skeleton.shape.is_solid(), point: None });
        };
        let offset = center - line.base;
        let abreast = offset.dot(&line.direction);
        let square = (offset - line.direction * abreast).norm_squared();
        if square >= radius * radius {
            return None;
        }
        let half = (radius * radius - square).sqrt();
        let entry = (abreast - half).max(start);
        let point = Some((abreast, square));
        (entry <= end && abreast + half > start).then_some(Self { entry, position, solid: false, point })
    }

    /// Distance of the line from the skeleton at `s`, and its slope along the line.
    #[inline]
    fn tangent(&self, coat: &Coat, line: &Line, s: f64) -> (f64, f64) {
        let Some((abreast, square)) = self.point else {
            return line.tangent(&coat.skeletons[self.position as usize].shape, s);
        };
        let along = s - abreast;
        let distance = (along * along + square).sqrt();
        (distance, if distance > 0.0 { along / distance } else { 0.0 })
    }
}

/// A skeleton whose field the line is in.
#[derive(Clone, Copy, Debug)]
struct Term {
    passage: Passage,
    outer: Outer,
    /// Tangent of the distance.
    distance: f64,
    slope: f64,
    /// Its field, and what that gains per metre along the line.
    value: f64,
    rise: f64,
}

impl Term {
    fn new(passage: &Passage, coat: &Coat) -> Self {
        let outer = coat.skeletons[passage.position as usize].profile.outer();
        Self { passage: *passage, outer, distance: 0.0, slope: 0.0, value: 0.0, rise: 0.0 }
    }

    fn skeleton<'a>(&self, coat: &'a Coat) -> &'a Placed {
        &coat.skeletons[self.passage.position as usize]
    }

    #[inline]
    fn value_slope(&self, coat: &Coat, distance: f64) -> (f64, f64) {
        self.outer.value_slope(distance).unwrap_or_else(|| self.skeleton(coat).profile.value_slope(distance))
    }

    /// Takes the tangent at `s`; whether the field may still rise beyond.
    #[inline]
    fn touch(&mut self, coat: &Coat, line: &Line, s: f64) -> bool {
        (self.distance, self.slope) = self.passage.tangent(coat, line, s);
        let (value, gain) = self.value_slope(coat, self.distance);
        (self.value, self.rise) = (value, gain * self.slope);
        // Convexity: a line that leaves the support of a field never comes back to it.
        self.distance < self.outer.radius() || self.slope < 0.0
    }

    /// The field at `s`.
    #[inline]
    fn value_at(&self, coat: &Coat, line: &Line, s: f64) -> f64 {
        self.value_slope(coat, self.passage.tangent(coat, line, s).0).0
    }

    /// The field at `s`, and what it gains per metre.
    #[inline]
    fn jet_at(&self, coat: &Coat, line: &Line, s: f64) -> (f64, f64) {
        let (distance, slope) = self.passage.tangent(coat, line, s);
        let (value, gain) = self.value_slope(coat, distance);
        (value, gain * slope)
    }

    /// The most the field can be after `h` more metres.
    #[inline]
    fn bound(&self, coat: &Coat, h: f64) -> f64 {
        if self.slope >= 0.0 {
            return self.value;
        }
        let distance = self.distance + self.slope * h;
        // Thin skeletons have no negative distances.
        self.value_slope(coat, if self.passage.solid { distance } else { distance.max(0.0) }).0
    }

    /// Length after which the tangent reaches the skeleton's own surface.
    #[inline]
    fn length_to_surface(&self) -> f64 {
        if self.slope < 0.0 { (self.distance - self.outer.thickness()) / -self.slope } else { f64::INFINITY }
    }
}

/// Memory of a ray.
#[derive(Clone, Debug, Default)]
struct Work {
    /// The skeletons whose fields the line meets, in the order of their entries.
    passages: Vec<Passage>,
    /// Those of them whose fields it is in.
    terms: Vec<Term>,
}

impl Work {
    /// Takes a skeleton in, if the line meets its field.
    #[inline]
    fn meet(&mut self, coat: &Coat, position: u32, line: &Line, start: f64, end: f64) {
        self.passages.extend(Passage::new(&coat.skeletons[position as usize], position, line, start, end));
    }

    /// The first point of the surface on a ray whose skeletons have been taken in; afterwards there are none.
    fn hit(&mut self, coat: &Coat, line: &Line, abreast: f64, length: f64) -> Option<SurfaceHit> {
        self.passages.sort_unstable_by(|a, b| a.entry.total_cmp(&b.entry).then(a.position.cmp(&b.position)));
        let root = self.first_root(coat, line, -abreast, length - abreast);
        self.passages.clear();
        let s = root?;
        let position = line.at(s);
        let terms = || self.terms.iter().map(|term| (term.passage.position as usize, term.skeleton(coat)));
        let (mut territory, mut gradient) = ((0, f64::NEG_INFINITY), Vec3::zeros());
        for (index, skeleton) in terms() {
            let (value, slope) = skeleton.value_gradient(&position);
            gradient += slope;
            if value > territory.1 || value == territory.1 && index < territory.0 {
                territory = (index, value);
            }
        }
        if !coat.graph.is_complete() {
            gradient = blend::value_gradient_of(&coat.graph, terms(), &position).1;
        }
        let normal = (-gradient).try_normalize(0.0).unwrap_or(-line.direction);
        Some(SurfaceHit { distance: (abreast + s).max(0.0), position, normal, skeleton: territory.0 })
    }

    /// The first `s` in `[start, end)` where the field reaches the isovalue; the terms are then those that may have a
    /// field there.
    fn first_root(&mut self, coat: &Coat, line: &Line, start: f64, end: f64) -> Option<f64> {
        let Self { passages, terms } = self;
        let complete = coat.graph.is_complete();
        terms.clear();
        let mut next = 0;
        let mut s = start;
        // Where it last was outside, when steps may go too far.
        let mut outside: Option<(f64, f64)> = None;
        loop {
            if terms.is_empty() {
                s = s.max(passages.get(next)?.entry);
            }
            while let Some(passage) = passages.get(next).filter(|passage| passage.entry <= s) {
                terms.push(Term::new(passage, coat));
                next += 1;
            }
            let mut sum = 0.0;
            terms.retain_mut(|term| {
                let keep = term.touch(coat, line, s);
                sum += term.value;
                keep
            });
            // Zero where it is lost in rounding: roots end there.
            let excess_at = |terms: &[Term], x: f64| {
                let value = |term: &Term| term.value_at(coat, line, x);
                let value = if complete {
                    terms.iter().map(value).sum()
                } else {
                    let fields = terms.iter().map(|term| (term.passage.position as usize, value(term)));
                    blend::together(&coat.graph, fields)
                };
                let excess = value - coat.isovalue;
                if excess.abs() <= ROUNDING * coat.isovalue { 0.0 } else { excess }
            };
            // Where not all fields add up, their sum is a bound only.
            let level = coat.isovalue - coat.graph.rise();
            let most = sum - level;
            let excess = if complete { most } else { excess_at(terms, s) };
            if excess >= 0.0 {
                let Some((before, excess_before)) = outside else { return Some(s) };
                // Also what it has left since then.
                terms.clear();
                let entered = passages[..next].iter();
                terms.extend(entered.map(|passage| Term::new(passage, coat)));
                return Some(bracketed(before, s, -excess_before, -excess, |x| -excess_at(terms, x)));
            }
            if !complete {
                outside = Some((s, excess));
            }
            let event = passages.get(next).map_or(end, |passage| passage.entry);
            let radii = terms.iter().map(|term| STRIDE * term.outer.radius());
            let stride = radii.fold(f64::INFINITY, f64::min);
            if complete && terms.len() > 1 {
                let jet = |x: f64| {
                    terms.iter().fold((-coat.isovalue, 0.0), |sum, term| {
                        let (value, rise) = term.jet_at(coat, line, x);
                        (sum.0 + value, sum.1 + rise)
                    })
                };
                let rise = terms.iter().map(|term| term.rise).sum();
                if let Some(root) = close_root(s, stride.min(event - s), (excess, rise), jet) {
                    return Some(root);
                }
            }
            let surface = terms.iter().map(Term::length_to_surface);
            let room = surface.fold(event - s, f64::min);
            let bound = |h: f64| terms.iter().map(|term| term.bound(coat, h)).sum::<f64>() - level;
            let step = if most >= 0.0 {
                0.0
            } else if terms.len() <= 1 {
                // On the tangent of a single field the bound reaches the isovalue exactly at the end of the room.
                room
            } else {
                safe_step(room, most, terms.iter().map(|term| term.rise.max(0.0)).sum(), bound)
            };
            // Nor does the field rise faster than all slopes together, or hardly so: a step too far is noticed.
            let slopes = || terms.iter().map(|term| term.skeleton(coat).profile.lipschitz()).sum::<f64>();
            let step = if complete { step } else { step.max((-excess / slopes()).min(event - s)) };
            if step >= event - s {
                if event >= end {
                    return None;
                }
                s = event;
                continue;
            }
            if terms.len() > 1 && step < stride {
                let ahead = (s + stride).min(event);
                let at_ahead = excess_at(terms, ahead);
                if at_ahead >= 0.0 {
                    return Some(bracketed(s, ahead, -excess, -at_ahead, |x| -excess_at(terms, x)));
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
}

/// A root no farther on than `room`, by Newton's steps, if they go straight to it; `jet` is value and slope.
fn close_root(start: f64, room: f64, mut at: (f64, f64), jet: impl Fn(f64) -> (f64, f64)) -> Option<f64> {
    let (low, high) = (start, start + room);
    let mut s = start;
    let mut last = room;
    for _ in 0..8 {
        let step = -at.0 / at.1;
        s += step;
        // Also when there is no slope: then it is no number.
        if !(at.1 > 0.0 && step.abs() <= last && s >= low && s <= high) {
            return None;
        }
        if step.abs() <= SETTLED * room {
            return Some(s);
        }
        last = 0.5 * step.abs();
        at = jet(s);
    }
    None
}

/// A step within the room along which a rising bound, with this value and slope at its beginning, stays negative: near
/// the longest one if the bound is convex.
fn safe_step(room: f64, most: f64, slope: f64, bound: impl Fn(f64) -> f64) -> f64 {
    let mut high = if slope > 0.0 { room.min(-most / slope) } else { room };
    for _ in 0..6 {
        let at_high = bound(high);
        if at_high <= 0.0 {
            return high;
        }
        high *= most / (most - at_high);
    }
    0.0
}
