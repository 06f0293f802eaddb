//! A coat as its contacts deform it: pressed flat where it meets obstacles, and bulging round them \[97, III-B\].
//!
//! With `α = f_i - c_i` of the coat and `β = f_j - c_j` of an obstacle, `w = K_j / (K_i + K_j)` (1 for a rigid obstacle):
//!
//! - where the coats overlap the term `-w (α + β)` is added, which leaves `Φ = w_i α - w_j β`: the deformed surface is
//!   the contact surface, and for a rigid obstacle that of the obstacle;
//! - outside both the same expression is the gap `G = -w (α + β) > 0`, and `A(G)` is added, an [`Attenuation`] with
//!   `A(0) = 0`, `A'(0) = 1`: the two pieces join with one tangent plane, whatever the fields' slopes;
//! - inside the coat and outside the obstacle the first term fades, so that the field has no step. The sign is not
//!   changed there, so no surface depends on it.
//!
//! `A(x) <= x` keeps the bulge on its own side of `Φ = 0`, where the obstacle's stays on the other. With several
//! obstacles the strongest compression holds, so that coats share space without gaps, each point going to the one with
//! the highest pressure; bulges add up, as far as the room that each obstacle leaves.

use super::SurfaceHit;
use super::closest::{self, first_exit};
use super::ray;
use crate::coat::Coat;
use crate::coat::root::bracketed;
use crate::field::{Shape, blend};
use crate::math::{Vec3, tangents};

/// Field at which a bulge ends, over the isovalue: the most that all obstacles together can add.
const HIGHEST: f64 = 2.0 / 3.0;
/// Shortest stride of a ray, as a fraction of the smallest radius of influence.
const STRIDE: f64 = 1.0 / 1024.0;
/// Longest stride, likewise: how far round a point a Lipschitz constant has to hold.
const FARTHEST: f64 = 0.25;
/// Most steps of a ray through the fields of obstacles.
const STEPS: usize = 1 << 16;

/// The height of a bulge against the gap to the obstacle, both in units of field: \[97, eq. (10)\] with slope 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Attenuation {
    /// The maximum, at half the width.
    pub height: f64,
    /// The gap from which on there is none.
    pub width: f64,
}

impl Attenuation {
    /// As high and as wide as asked, but at most a third as high as wide, and at most six heights wide: then `A(x)` is
    /// at most `x`, its slope at most 1 either way, and it goes to zero with the height.
    pub fn new(height: f64, width: f64) -> Self {
        let height = height.min(width / 3.0);
        Self { height, width: width.min(6.0 * height) }
    }

    /// Value and slope at a gap `x >= 0`.
    pub fn value_slope(&self, x: f64) -> (f64, f64) {
        let (a, w) = (self.height, self.width);
        if x >= w {
            return (0.0, 0.0);
        }
        // In x/w, so that no cube under- or overflows.
        let (u, q) = (x / w, a / w);
        if u <= 0.5 {
            let (p1, p2) = (4.0 * (1.0 - 4.0 * q), 4.0 * (3.0 * q - 1.0));
            (x * (1.0 + u * (p2 + u * p1)), 1.0 + u * (2.0 * p2 + 3.0 * u * p1))
        } else {
            (4.0 * a * (u - 1.0).powi(2) * (4.0 * u - 1.0), 24.0 * q * (u - 1.0) * (2.0 * u - 1.0))
        }
    }
}

/// What presses on a coat.
#[derive(Clone, Debug)]
pub struct Obstacle {
    /// Its undeformed coat, in the frame of the coat that it presses on.
    pub coat: Coat,
    /// Its share of the stiffness, `K_j / (K_i + K_j)`: 1 when it is rigid.
    pub share: f64,
    /// How far below its isovalue its field still deforms, in its own units: more than 0, at most its isovalue.
    pub reach: f64,
    /// The bulge it raises; zero for none.
    pub bulge: Attenuation,
}

/// A value and its gradient.
type Jet = (f64, Vec3);

const NOTHING: Jet = (0.0, Vec3::new(0.0, 0.0, 0.0));

/// A coat and what presses on it: the solid is where [`Deformed::excess`] is not negative.
#[derive(Clone, Debug, Default)]
pub struct Deformed {
    /// The undeformed coat.
    pub coat: Coat,
    /// What presses on it; none for a rigid body.
    pub obstacles: Vec<Obstacle>,
}

/// What one obstacle makes of a point outside it.
struct Near {
    bulge: Jet,
    /// How much higher than its bulge others may raise the coat here.
    room: Jet,
}

impl Deformed {
    /// How far the deformed field is above the isovalue, and its gradient, at a point of the frame.
    pub fn excess_gradient(&self, p: &Vec3) -> (f64, Vec3) {
        let excess = self.coat.excess_gradient(p);
        let term = self.term(p, &excess);
        (excess.0 + term.0, excess.1 + term.1)
    }

    /// How far the deformed field is above the isovalue: not negative inside the deformed solid.
    pub fn excess(&self, p: &Vec3) -> f64 {
        self.excess_gradient(p).0
    }

    /// What the obstacles add to the field, where the undeformed coat has this excess and gradient.
    pub fn term(&self, p: &Vec3, excess: &(f64, Vec3)) -> (f64, Vec3) {
        let (alpha, gradient) = excess;
        let mut compression = NOTHING;
        let mut bulges = NOTHING;
        let mut touching = false;
        let mut near = Vec::new();
        for obstacle in &self.obstacles {
            let (beta, slope) = obstacle.coat.excess_gradient(p);
            if beta <= -obstacle.coat.isovalue {
                continue;
            }
            let w = obstacle.share;
            let (outside, away) = if *alpha < 0.0 { (-alpha, -gradient) } else { NOTHING };
            let gap = (w * (outside - beta), (away - slope) * w);
            let mut pressed = if gap.0 <= 0.0 { gap } else { NOTHING };
            let kept = 1.0 + beta.min(0.0) / obstacle.reach;
            if *alpha > 0.0 && kept > 0.0 {
                let fading = if beta < 0.0 { slope * (alpha / obstacle.reach) } else { Vec3::zeros() };
                pressed = (pressed.0 - w * alpha * kept, pressed.1 - (gradient * kept + fading) * w);
            }
            if pressed.0 < compression.0 {
                compression = pressed;
            }
            if gap.0 <= 0.0 {
                touching = true;
                continue;
            }
            let (height, rise) = obstacle.bulge.value_slope(gap.0);
            let bulge = (height, gap.1 * rise);
            bulges = (bulges.0 + bulge.0, bulges.1 + bulge.1);
            if self.obstacles.len() > 1 {
                near.push(Near { bulge, room: room(obstacle, &gap, &bulge, &(beta, slope)) });
            }
        }
        if touching || bulges.0 <= 0.0 {
            return compression;
        }
        let mut raised = bulges;
        if near.len() > 1 {
            let all = limited(&(HIGHEST * self.coat.isovalue, Vec3::zeros()), &bulges);
            raised = all;
            for Near { bulge, room } in &near {
                let others = limited(room, &(all.0 - bulge.0, all.1 - bulge.1));
                if bulge.0 + others.0 < raised.0 {
                    raised = (bulge.0 + others.0, bulge.1 + others.1);
                }
            }
        }
        (compression.0 + raised.0, compression.1 + raised.1)
    }

    /// Outward unit normal of the level surface through a point; `fallback` where the field is flat.
    pub fn normal(&self, p: &Vec3, fallback: &Vec3) -> Vec3 {
        (-self.excess_gradient(p).1).try_normalize(0.0).unwrap_or(*fallback)
    }

    /// Follows a ray to the first point of the deformed solid, as [`ray::cast`] does for the undeformed one.
    ///
    /// Where an obstacle's field reaches, a chord shorter than 1/1024 of a radius of influence may be missed.
    pub fn cast(&self, origin: &Vec3, direction: &Vec3, length: f64) -> Option<SurfaceHit> {
        let (line, abreast) = ray::Line::abreast(&self.coat, origin, direction, length);
        let (mut s, end) = (-abreast, length - abreast);
        loop {
            // Before the first obstacle's field the coat is undeformed.
            let entries = self.obstacles.iter().filter_map(|obstacle| line.entry_into(&obstacle.coat, s, end));
            let entry = entries.reduce(f64::min);
            let event = entry.unwrap_or(end);
            if let Some(hit) = ray::cast(&self.coat, &line.at(s), direction, event - s) {
                // At the event itself the field may be deformed already.
                if s + hit.distance < event || entry.is_none() {
                    return Some(SurfaceHit { distance: (abreast + s + hit.distance).max(0.0), ..hit });
                }
            }
            entry?;
            match self.march(&line, event, end) {
                March::Hit(root) => return Some(self.hit(line.at(root), (abreast + root).max(0.0), &-direction)),
                March::Out(at) => s = at,
                March::Missed => return None,
            }
        }
    }

    fn hit(&self, position: Vec3, distance: f64, fallback: &Vec3) -> SurfaceHit {
        let skeleton = blend::territory(&self.coat.skeletons, &position);
        SurfaceHit { distance, position, normal: self.normal(&position, fallback), skeleton }
    }

    /// Goes on along a line through the fields of obstacles.
    fn march(&self, line: &ray::Line, start: f64, end: f64) -> March {
        let radii = self.coats().flat_map(|coat| coat.skeletons.iter().map(|k| k.profile.radius));
        let radius = radii.fold(f64::INFINITY, f64::min);
        let mut s = start;
        let mut here = self.excess(&line.at(s));
        for _ in 0..STEPS {
            if here >= 0.0 {
                return March::Hit(s);
            }
            let p = line.at(s);
            let stride = if self.coat.excess(&p) <= -self.coat.isovalue {
                // No field of its own: nothing before it enters one.
                match line.entry_into(&self.coat, s, end) {
                    Some(entry) => entry - s,
                    None => return March::Missed,
                }
            } else {
                let farthest = FARTHEST * radius;
                (-here / self.lipschitz(&p, farthest)).min(farthest)
            };
            if s > start && self.obstacles.iter().all(|o| o.coat.excess(&p) <= -o.coat.isovalue) {
                return March::Out(s);
            }
            let next = (s + stride.max(STRIDE * radius)).min(end);
            let ahead = self.excess(&line.at(next));
            if ahead >= 0.0 {
                return March::Hit(bracketed(s, next, -here, -ahead, |x| -self.excess(&line.at(x))));
            }
            if next >= end {
                return March::Missed;
            }
            (s, here) = (next, ahead);
        }
        March::Missed
    }

    /// A Lipschitz constant of the deformed field outside the solid, within a distance of a point. The attenuation's
    /// slope is at most 1, and so are those of [`limited`], in either argument and together; only where a limit fades
    /// (see [`room`]) may a field be steeper.
    fn lipschitz(&self, p: &Vec3, within: f64) -> f64 {
        let steepest = |coat: &Coat| {
            let near = coat.skeletons.iter().filter(|k| k.shape.closest(p).distance < k.profile.radius + within);
            near.map(|k| k.profile.lipschitz()).sum::<f64>()
        };
        let own = steepest(&self.coat);
        let others = |o: &Obstacle| 1.25 * o.share * (own + steepest(&o.coat));
        own + self.obstacles.iter().map(others).sum::<f64>()
    }

    fn coats(&self) -> impl Iterator<Item = &Coat> {
        std::iter::once(&self.coat).chain(self.obstacles.iter().map(|obstacle| &obstacle.coat))
    }

    /// The closest point of the deformed surface, from outside or inside; `None` if there is no surface.
    ///
    /// As for blends there is no closed form: rays give starts, which slide along the surface, and along the border of
    /// a contact without bulges, where the surface has an edge.
    pub fn closest(&self, p: &Vec3) -> Option<SurfaceHit> {
        let undeformed = closest::closest(&self.coat, p)?;
        // Nothing nearer than that point is deformed.
        if !self.obstacles.iter().any(|o| reaches(&o.coat, p, undeformed.distance.abs())) {
            return Some(undeformed);
        }
        let inside = self.excess(p) >= 0.0;
        let mut directions = if inside { closest::outward(&self.coat, p) } else { closest::toward(&self.coat, p) };
        directions.extend((undeformed.position - p).try_normalize(0.0));
        directions.extend((-self.excess_gradient(p).1 * if inside { 1.0 } else { -1.0 }).try_normalize(0.0));
        // Where an obstacle presses: towards it from inside, away from it from outside.
        let obstacles = self.obstacles.iter().flat_map(|o| &o.coat.skeletons);
        directions.extend(obstacles.map(|k| k.shape.closest(p).normal * if inside { -1.0 } else { 1.0 }));
        let first = self.best(p, inside, directions.into_iter(), None)?;
        let best = match (first - p).try_normalize(0.0) {
            Some(axis) => self.best(p, inside, closest::cone(&axis), Some(first))?,
            None => first,
        };
        let length = (best - p).norm();
        Some(self.hit(best, if inside { -length } else { length }, &undeformed.normal))
    }

    /// The closest point of the surface that sliding down from rays in these directions leads to.
    fn best(
        &self,
        p: &Vec3,
        inside: bool,
        directions: impl Iterator<Item = Vec3>,
        known: Option<Vec3>,
    ) -> Option<Vec3> {
        const SLIDES: usize = 6;
        let distance = |x: &Vec3| (x - p).norm_squared();
        let nearer = |x: &Vec3, y: &Vec3| distance(x).total_cmp(&distance(y));
        let probe = |u: Vec3| {
            if inside { self.exit(p, &u) } else { self.cast(p, &u, f64::INFINITY).map(|hit| hit.position) }
        };
        let mut starts: Vec<Vec3> = directions.filter_map(probe).chain(known).collect();
        starts.sort_by(nearer);
        starts.truncate(SLIDES);
        let ends = starts.iter().map(|x| {
            let down = self.descend(p, *x);
            if inside { down } else { self.along_edge(p, &down).unwrap_or(down) }
        });
        ends.min_by(nearer)
    }

    /// Where a ray from the inside leaves the deformed solid.
    fn exit(&self, p: &Vec3, direction: &Vec3) -> Option<Vec3> {
        let thinnest = self.coat.skeletons.iter().map(|k| k.profile.thickness).fold(f64::INFINITY, f64::min);
        first_exit(|s| self.excess(&(p + direction * s)), 0.0625 * thinnest, 1.1, 200).map(|s| p + direction * s)
    }

    /// Slides from `x`, on the surface, to a local minimum of the distance to `p`: Newton's steps in the tangent plane,
    /// with the surface's curvature from differences of the gradient.
    fn descend(&self, p: &Vec3, mut x: Vec3) -> Vec3 {
        let thinnest = self.coat.skeletons.iter().map(|k| k.profile.thickness).fold(f64::INFINITY, f64::min);
        let h = 1e-5 * thinnest;
        for _ in 0..60 {
            let gradient = self.excess_gradient(&x).1;
            let slope = gradient.norm();
            if slope == 0.0 {
                break;
            }
            let normal = -gradient / slope;
            let (offset, (e1, e2)) = (p - x, tangents(&normal));
            let along = offset.dot(&normal);
            let pull = (offset.dot(&e1), offset.dot(&e2));
            if pull.0.hypot(pull.1) <= 1e-12 * thinnest {
                break;
            }
            let change = |e: &Vec3| self.excess_gradient(&(x + e * h)).1 - self.excess_gradient(&(x - e * h)).1;
            let (d1, d2) = (change(&e1) / (2.0 * h), change(&e2) / (2.0 * h));
            let bend = -along / slope;
            let (h11, h22) = (1.0 + bend * d1.dot(&e1), 1.0 + bend * d2.dot(&e2));
            let h12 = bend * 0.5 * (d1.dot(&e2) + d2.dot(&e1));
            let determinant = h11 * h22 - h12 * h12;
            let (z1, z2) = if h11 > 0.0 && determinant > 1e-6 * h11.max(h22).powi(2) {
                ((h22 * pull.0 - h12 * pull.1) / determinant, (h11 * pull.1 - h12 * pull.0) / determinant)
            } else {
                pull
            };
            let step = e1 * z1 + e2 * z2;
            let shorter = |k: i32| self.onto_surface(x + step * 0.5_f64.powi(k));
            let better = |y: &Vec3| (y - p).norm_squared() < offset.norm_squared();
            match (0..32).filter_map(shorter).find(better) {
                Some(next) => x = next,
                None => break,
            }
        }
        x
    }

    /// Newton's steps along the gradient to the surface; `None` if they do not get there.
    fn onto_surface(&self, mut x: Vec3) -> Option<Vec3> {
        let mut best = f64::INFINITY;
        for _ in 0..30 {
            let (excess, gradient) = self.excess_gradient(&x);
            let slope2 = gradient.norm_squared();
            if slope2 == 0.0 || excess.abs() > 2.0 * best {
                return None;
            }
            if excess.abs() <= 4e-16 * self.coat.isovalue || excess.abs() >= best && best <= 1e-12 * self.coat.isovalue
            {
                return Some(x);
            }
            best = excess.abs().min(best);
            x -= gradient * (excess / slope2);
        }
        (best <= 1e-12 * self.coat.isovalue).then_some(x)
    }

    /// The smooth surfaces that bound the solid at a point of it, with those that nearly do: the coat's own, and the
    /// contact surface with each obstacle.
    fn walls(&self, x: &Vec3) -> Vec<Wall<'_>> {
        let near = |wall: &Wall| {
            let (value, gradient) = wall.jet(&self.coat, x);
            value.abs() <= 1e-2 * self.coat.isovalue.min(gradient.norm())
        };
        let own = (self.obstacles.iter().all(|o| o.bulge.height == 0.0)).then_some(Wall::Own);
        own.into_iter().chain(self.obstacles.iter().map(Wall::Contact)).filter(near).collect()
    }

    /// Slides along the edge that the surface has near `x`, if it has one, to a local minimum of the distance to `p`.
    fn along_edge(&self, p: &Vec3, x: &Vec3) -> Option<Vec3> {
        let walls = self.walls(x);
        let ends = (0..walls.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let ends = ends.filter_map(|(a, b)| self.slide(p, *x, [&walls[a], &walls[b]]));
        let best = ends.min_by(|x, y| (x - p).norm_squared().total_cmp(&(y - p).norm_squared()))?;
        ((best - p).norm_squared() < (x - p).norm_squared()).then_some(best)
    }

    /// The same along the line in which two walls meet; `None` where that is not on the solid.
    fn slide(&self, p: &Vec3, x: Vec3, walls: [&Wall; 2]) -> Option<Vec3> {
        let onto = |mut x: Vec3| {
            for _ in 0..20 {
                let [(u, gu), (v, gv)] = walls.map(|wall| wall.jet(&self.coat, &x));
                let (uu, uv, vv) = (gu.norm_squared(), gu.dot(&gv), gv.norm_squared());
                let determinant = uu * vv - uv * uv;
                if determinant <= 1e-12 * uu * vv {
                    return None;
                }
                let step = gu * ((vv * u - uv * v) / determinant) + gv * ((uu * v - uv * u) / determinant);
                x -= step;
                if step.norm() <= 1e-14 * (x - p).norm() + 1e-15 * x.norm() {
                    break;
                }
            }
            Some(x)
        };
        let mut x = onto(x)?;
        let mut rate = 1.0;
        let mut last: Option<(Vec3, f64)> = None;
        for _ in 0..60 {
            let [(_, gu), (_, gv)] = walls.map(|wall| wall.jet(&self.coat, &x));
            let tangent = gu.cross(&gv).try_normalize(0.0)?;
            let pull = (p - x).dot(&tangent);
            if pull.abs() <= 1e-12 * (p - x).norm() {
                break;
            }
            if let Some((from, before)) = last {
                // Secant: the pull falls to zero at the minimum.
                let fall = before - pull;
                if fall.abs() > 1e-3 * before.abs() {
                    rate = ((x - from).norm() * before.signum() / fall).abs().clamp(1e-3, 1e3);
                }
            }
            let shorter = |k: i32| onto(x + tangent * (pull * rate * 0.5_f64.powi(k)));
            let better = |y: &Vec3| (y - p).norm_squared() < (x - p).norm_squared();
            let Some(next) = (0..24).filter_map(shorter).find(better) else { break };
            last = Some((x, pull));
            x = next;
        }
        (self.excess(&x).abs() <= 1e-9 * self.coat.isovalue).then_some(x)
    }
}

enum March {
    Hit(f64),
    /// Left the fields of all obstacles here.
    Out(f64),
    Missed,
}

/// A smooth piece of a deformed surface.
enum Wall<'a> {
    Own,
    Contact(&'a Obstacle),
}

impl Wall<'_> {
    /// Zero on the piece.
    fn jet(&self, coat: &Coat, x: &Vec3) -> Jet {
        let (alpha, gradient) = coat.excess_gradient(x);
        match self {
            Wall::Own => (alpha, gradient),
            Wall::Contact(Obstacle { coat, share, .. }) => {
                let (beta, slope) = coat.excess_gradient(x);
                ((1.0 - share) * alpha - share * beta, gradient * (1.0 - share) - slope * *share)
            }
        }
    }
}

/// Whether a coat's field reaches the ball of this radius round `p`.
fn reaches(coat: &Coat, p: &Vec3, radius: f64) -> bool {
    coat.skeletons.iter().any(|k| k.shape.closest(p).distance - k.profile.radius < radius * (1.0 + 1e-9))
}

/// How much higher than an obstacle's own bulge a coat may be raised by others before it meets the obstacle, or the
/// bulge of that. Without bound where the obstacle's field ends: no bulge of it comes near there.
fn room(obstacle: &Obstacle, gap: &Jet, bulge: &Jet, excess: &Jet) -> Jet {
    let isovalue = obstacle.coat.isovalue;
    let left = (1.0 - HIGHEST) * isovalue;
    let u = (excess.0 + isovalue) / left;
    if u >= 1.0 {
        return (gap.0 - bulge.0, gap.1 - bulge.1);
    }
    let fade = (u * u * (3.0 - 2.0 * u)).max(1e-12);
    let slope = 6.0 * u * (1.0 - u) / left;
    (gap.0 / fade - bulge.0, gap.1 / fade - excess.1 * (gap.0 * slope / (fade * fade)) - bulge.1)
}

/// The smaller of two, joined smoothly: `wanted` where there is room for twice as much, then less, never more than
/// the room.
fn limited(room: &Jet, wanted: &Jet) -> Jet {
    if room.0 >= 2.0 * wanted.0 || wanted.0 <= 0.0 {
        return *wanted;
    }
    let x = room.0 / wanted.0;
    (room.0 * (1.0 - 0.25 * x), room.1 * (1.0 - 0.5 * x) + wanted.1 * (0.25 * x * x))
}

impl ray::Line {
    /// Where the line, from `s` on, first comes within reach of a coat's field.
    fn entry_into(&self, coat: &Coat, s: f64, end: f64) -> Option<f64> {
        let entry = |shape: &Shape, radius: f64| self.entry(shape, radius, s, end);
        coat.skeletons.iter().filter_map(|k| entry(&k.shape, k.profile.radius)).min_by(f64::total_cmp)
    }
}
