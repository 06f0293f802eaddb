//! The facet: the polygon over which a face or an edge of one coat meets the other.

use crate::contact::column::Frame;
use crate::contact::deepest::Deepest;
use crate::contact::pair::Pair;
use crate::field::Shape;
use crate::math::{Vec3, tangents};

/// A place of the plane.
pub(super) type Place = (f64, f64);

/// Sine of the lean up to which a face or an edge counts as facing the other coat.
const LEAN: f64 = 0.35;
/// Most corners of a facet: two quadrilaterals make eight, the end of the pressure one more.
pub(super) const CORNERS: usize = 12;

/// A corner of a facet, and the edge from it to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Corner {
    pub at: Place,
    /// The edge's unit normal, outwards.
    pub normal: Place,
    /// Whose edge it is.
    pub owner: Owner,
    /// Of the surface over the corner.
    pub height: f64,
    /// `σ` there.
    pub sum: f64,
    /// Its gradient along the surface.
    pub rise: Place,
    /// Force an area there.
    pub density: Vec3,
}

/// What an edge of a facet is the end of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Owner {
    /// A face or an edge of a.
    #[default]
    A,
    /// A face or an edge of b.
    B,
    /// The pressure.
    Pressure,
}

/// A convex polygon, counter-clockwise; two corners are a segment.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Polygon {
    pub corners: [Corner; CORNERS],
    pub count: usize,
}

pub(super) fn cross(p: Place, q: Place) -> f64 {
    p.0 * q.1 - p.1 * q.0
}

pub(super) fn dot(p: Place, q: Place) -> f64 {
    p.0 * q.0 + p.1 * q.1
}

pub(super) fn between(p: Place, q: Place, t: f64) -> Place {
    (p.0 + t * (q.0 - p.0), p.1 + t * (q.1 - p.1))
}

/// The feature of a shape that faces a direction: corners in order, and the direction in which it is offset.
struct Support {
    points: [Vec3; 4],
    count: usize,
    normal: Vec3,
    /// A half-space, which has no corners.
    endless: bool,
}

impl Support {
    /// The feature that faces `n`; with `faces` off an edge at most.
    fn new(shape: &Shape, n: &Vec3, faces: bool) -> Self {
        let mut support = Self { points: [Vec3::zeros(); 4], count: 0, normal: *n, endless: false };
        match shape {
            Shape::Point(a) => support.set(&[*a]),
            Shape::Segment(a, b) => support.set_edge(a, b),
            Shape::Triangle(a, b, c) => {
                let normal = (b - a).cross(&(c - a)).normalize();
                let along = normal.dot(n);
                if faces && along.abs() > (1.0 - LEAN * LEAN).sqrt() {
                    support.set(&[*a, *b, *c]);
                    support.normal = normal * along.signum();
                } else {
                    let mut points = [*a, *b, *c];
                    points.sort_by(|p, q| q.dot(n).total_cmp(&p.dot(n)));
                    support.set_edge(&points[0], &points[1]);
                }
            }
            Shape::Box { center, half, axes } => {
                let local = axes.tr_mul(n);
                let corner = |signs: [f64; 3]| {
                    center + axes * Vec3::new(signs[0] * half.x, signs[1] * half.y, signs[2] * half.z)
                };
                let main = local.iamax();
                let (i, j) = ((main + 1) % 3, (main + 2) % 3);
                let mut signs = [0, 1, 2].map(|axis| 1f64.copysign(local[axis]));
                if faces && local[i].abs() < LEAN && local[j].abs() < LEAN {
                    for (x, y) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
                        (signs[i], signs[j]) = (x, y);
                        support.points[support.count] = corner(signs);
                        support.count += 1;
                    }
                    support.normal = axes.column(main) * signs[main];
                } else {
                    let least = local.iamin();
                    signs[least] = -1.0;
                    let start = corner(signs);
                    signs[least] = 1.0;
                    let end = corner(signs);
                    support.set_edge(&start, &end);
                }
            }
            Shape::Plane { .. } => support.endless = true,
        }
        support
    }

    fn set(&mut self, points: &[Vec3]) {
        self.points[..points.len()].copy_from_slice(points);
        self.count = points.len();
    }

    /// An edge, or the end of it that is ahead when it leans too much.
    fn set_edge(&mut self, a: &Vec3, b: &Vec3) {
        let direction = (b - a).normalize();
        let lean = direction.dot(&self.normal);
        if lean.abs() < LEAN {
            self.set(&[*a, *b]);
            self.normal = (self.normal - direction * lean).normalize();
        } else {
            self.set(&[if lean > 0.0 { *b } else { *a }]);
        }
    }

    /// The feature in the plane of a frame, moved along its own normal to the surface.
    fn project(&self, frame: &Frame, owner: Owner) -> Polygon {
        let mut polygon = Polygon::default();
        let rise = self.normal.dot(&frame.normal);
        for point in &self.points[..self.count] {
            let (_, _, height) = frame.coordinates(point);
            let (x, y, _) = frame.coordinates(&(point - self.normal * (height / rise)));
            polygon.push(Corner { at: (x, y), owner, ..Corner::default() });
        }
        if polygon.double_area() < 0.0 {
            polygon.corners[..polygon.count].reverse();
        }
        for index in 0..polygon.count {
            let (p, q) = (polygon.corners[index].at, polygon.next(index).at);
            let (x, y) = (q.0 - p.0, q.1 - p.1);
            let length = x.hypot(y);
            polygon.corners[index].normal = (y / length, -x / length);
        }
        polygon
    }
}

impl Polygon {
    pub fn push(&mut self, corner: Corner) {
        if self.count < CORNERS {
            self.corners[self.count] = corner;
        }
        self.count += 1;
    }

    pub fn corners(&self) -> &[Corner] {
        &self.corners[..self.count]
    }

    pub fn next(&self, index: usize) -> &Corner {
        &self.corners[(index + 1) % self.count]
    }

    pub fn double_area(&self) -> f64 {
        (0..self.count).map(|index| cross(self.corners[index].at, self.next(index).at)).sum()
    }

    /// The part behind a line: where `normal · x <= offset`.
    pub fn clip(&self, normal: Place, offset: f64, owner: Owner) -> Self {
        let mut part = Self::default();
        for (index, p) in self.corners().iter().enumerate() {
            let q = self.next(index);
            let (ahead, ahead_next) = (dot(normal, p.at) - offset, dot(normal, q.at) - offset);
            if ahead <= 0.0 {
                part.push(*p);
            }
            if (ahead <= 0.0) != (ahead_next <= 0.0) {
                let t = ahead / (ahead - ahead_next);
                let meeting = Corner { at: between(p.at, q.at, t), height: p.height + t * (q.height - p.height), ..*p };
                part.push(if ahead <= 0.0 { Corner { normal, owner, ..meeting } } else { meeting });
            }
        }
        part
    }

    /// Area, centroid, principal axes and the square roots of the second moments along them; `None` without an area.
    pub fn moments(&self) -> Option<(f64, Place, [Place; 2], [f64; 2])> {
        let first = self.corners[0].at;
        let (mut area, mut center, mut xx, mut xy, mut yy) = (0.0, (0.0, 0.0), 0.0, 0.0, 0.0);
        for index in 0..self.count {
            let (p, q) = (self.corners[index].at, self.next(index).at);
            let (p, q) = ((p.0 - first.0, p.1 - first.1), (q.0 - first.0, q.1 - first.1));
            let twice = cross(p, q);
            area += twice / 2.0;
            center = (center.0 + twice * (p.0 + q.0) / 6.0, center.1 + twice * (p.1 + q.1) / 6.0);
            xx += twice * (p.0 * p.0 + p.0 * q.0 + q.0 * q.0) / 12.0;
            yy += twice * (p.1 * p.1 + p.1 * q.1 + q.1 * q.1) / 12.0;
            xy += twice * (p.0 * q.1 + 2.0 * p.0 * p.1 + 2.0 * q.0 * q.1 + q.0 * p.1) / 24.0;
        }
        if area <= 0.0 {
            return None;
        }
        let center = (center.0 / area, center.1 / area);
        let (xx, yy) = (xx / area - center.0 * center.0, yy / area - center.1 * center.1);
        let xy = xy / area - center.0 * center.1;
        let (mean, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
        let radius = half.hypot(xy);
        let angle = 0.5 * libm::atan2(xy, half);
        let (sine, cosine) = (libm::sin(angle), libm::cos(angle));
        let spread = [mean + radius, mean - radius].map(|moment| moment.max(0.0).sqrt());
        Some((area, (first.0 + center.0, first.1 + center.1), [(cosine, sine), (-sine, cosine)], spread))
    }
}

/// The plane of a contact and its facet there; `None` when the two features meet in a point.
pub(super) fn layout(pair: &Pair, at: &Deepest, faces: bool) -> Option<(Frame, Polygon)> {
    let [i, j] = at.skeletons;
    let a = Support::new(&pair.a.skeletons[i].shape, &at.normal, faces);
    let b = Support::new(&pair.b.skeletons[j].shape, &-at.normal, faces);
    let (along, normal) = match (&a, &b) {
        _ if a.count > 2 => (a.points[1] - a.points[0], a.normal),
        _ if b.count > 2 => (b.points[1] - b.points[0], -b.normal),
        _ if a.count == 2 && (b.count == 2 || b.endless) => (a.points[1] - a.points[0], a.normal),
        _ if b.count == 2 && a.endless => (b.points[1] - b.points[0], -b.normal),
        _ => return None,
    };
    if !a.endless && a.count < 2 || !b.endless && b.count < 2 {
        return None;
    }
    let along = along - normal * along.dot(&normal);
    let u = if along.norm() > 0.0 { along.normalize() } else { tangents(&normal).0 };
    let frame = Frame { origin: at.position, normal, u, v: normal.cross(&u), scale: [1.0, 1.0] };
    let (on_a, on_b) = (a.project(&frame, Owner::A), b.project(&frame, Owner::B));
    let polygon = match (on_a.count, on_b.count) {
        (0, _) => on_b,
        (_, 0) => on_a,
        (2, 2) => shared(&on_a, &on_b)?,
        (2, _) => common(on_a, &on_b),
        (_, 2) => common(on_b, &on_a),
        _ => common(on_a, &on_b),
    };
    (2..=CORNERS).contains(&polygon.count).then_some((frame, polygon))
}

/// What a polygon or segment has in common with a polygon.
fn common(first: Polygon, second: &Polygon) -> Polygon {
    let mut polygon = first;
    for edge in second.corners() {
        polygon = polygon.clip(edge.normal, dot(edge.normal, edge.at), edge.owner);
        if !(1..=CORNERS).contains(&polygon.count) {
            return Polygon::default();
        }
    }
    polygon
}

/// What two nearly parallel segments have in common: the part of the first beside the second, moved half way to it.
fn shared(first: &Polygon, second: &Polygon) -> Option<Polygon> {
    let [p, q] = [second.corners[0], second.corners[1]];
    let across = first.corners[0].normal;
    if dot(across, p.normal).abs() < 1.0 - 0.5 * LEAN * LEAN {
        return None;
    }
    let along = (-across.1, across.0);
    let along = if dot(along, (q.at.0 - p.at.0, q.at.1 - p.at.1)) < 0.0 { (-along.0, -along.1) } else { along };
    let mut part = first.clip(along, dot(along, q.at), Owner::B);
    if part.count < 2 {
        return None;
    }
    part = part.clip((-along.0, -along.1), -dot(along, p.at), Owner::B);
    if part.count < 2 || part.count > CORNERS {
        return None;
    }
    let length = dot(along, (q.at.0 - p.at.0, q.at.1 - p.at.1));
    let count = part.count;
    for corner in &mut part.corners[..count] {
        let t = (dot(along, corner.at) - dot(along, p.at)) / length;
        corner.at = between(corner.at, between(p.at, q.at, t), 0.5);
    }
    Some(part)
}
