//! The surface as a height over the core of a point, a segment, a triangle or a box: for what is wrapped in the surface.
//!
//! Of two coats, the surface lies over the core of the steeper one wherever the other is: along a ray outwards from the
//! core the steeper pressure falls faster than the other can, so that `Φ` has one zero at most. The rays from the faces,
//! the edges, by quarters of a turn, and the corners, by octants, go through all of space round a core. Where a ray leaves
//! its own coat the other's field tells whether there is contact, since the border lies where both pressures are nil. So
//! the parts of the core end where the other coat no longer reaches their rays' ends: what is small lies on the corner of
//! something a million times as large as it does on one of its own size.
//!
//! Where a face is pressed into the core of its box, its rays go on inwards, at a slant to where those of its neighbours
//! end: the surface has no gap between faces. Of two pressures that are about as steep, the other may rise faster along
//! a slant, and the surface be folded over it: that is looked for, and counts as doubt. When the surface is lost over
//! such rays, they go straight in, and end where another face is nearer, which takes far more cells.

use std::f64::consts::PI;

use super::SOLVED;
use super::cells::{Cells, FIRST_HALF, GRID, Place, Sheet, Vertex, Workspace};
use crate::contact::column::{Frame, STEEPEST, accept};
use crate::contact::deepest::Deepest;
use crate::contact::pair::{Pair, Sample, Side};
use crate::contact::patch::Node;
use crate::contact::target::{Integrated, Target, Unfit};
use crate::field::Shape;
use crate::math::{Vec3, tangents};

/// A face, a turn about an edge or a corner's share of all directions. Its two coordinates are lengths along its sides,
/// then the angles of its rays.
#[derive(Clone, Copy, Default)]
struct Part {
    /// Its middle; of a triangle a corner.
    foot: Vec3,
    /// The directions of its sides, of a face two, of an edge one, and half their lengths. Of a triangle, the side from
    /// that corner and the next, whose coordinates go from 0 to 1.
    sides: [Vec3; 2],
    triangle: bool,
    half: [f64; 2],
    /// The directions that its rays are between.
    outwards: [Vec3; 3],
    /// How many of those.
    count: usize,
    /// How far a face may be pressed in \[m\].
    depth: f64,
    /// The middle and the length of what counts of each coordinate.
    middle: [f64; 2],
    span: [f64; 2],
}

impl Part {
    /// Whether a coordinate is an angle.
    fn turns(&self) -> [bool; 2] {
        [self.count > 2, self.count > 1]
    }
}

/// Most parts: those of a box.
const MOST_PARTS: usize = 26;
/// Most evaluations over a place.
const MOST_LOOKS: usize = 40;
/// Sine of the angle between a segment and the normal below which the segment has no side that faces the other.
const LEVEL: f64 = 1e-6;
/// Predicted half width of a contact, over the thickness of the coat, beyond which it goes round what is round.
const WRAPPED: f64 = 1.0;
/// Most that a slanting ray is longer than the distance it goes, in a corner of a box.
const LONGEST: f64 = 1.732_050_807_568_877_2;
/// Ends of a part are trimmed by so many of it at a time, and so often at most.
const TRIM: u32 = 4;
const MOST_TRIMS: u32 = 100;

/// A ray from within the core through a place on it outwards. Heights are signed distances from the core.
struct Ray {
    foot: Vec3,
    /// Unit normal of the core.
    normal: Vec3,
    /// Whether it leaves the face of a triangle.
    triangle: bool,
    /// Where it begins: below nil from faces only.
    bottom: f64,
    /// The way up inside the core.
    inside: Vec3,
    /// How the foot changes a unit of the coordinates, and the way up, outside and inside.
    along: [Vec3; 2],
    turn: [Vec3; 2],
    turn_inside: [Vec3; 2],
}

impl Ray {
    fn up(&self, height: f64) -> Vec3 {
        if height < 0.0 { self.inside } else { self.normal }
    }

    fn point(&self, height: f64) -> Vec3 {
        self.foot + self.up(height) * height
    }

    fn tangents(&self, height: f64) -> [Vec3; 2] {
        let turn = if height < 0.0 { &self.turn_inside } else { &self.turn };
        [self.along[0] + turn[0] * height, self.along[1] + turn[1] * height]
    }

    /// Area that a unit of the coordinates has at a height \[m²\].
    fn unit_area(&self, height: f64) -> f64 {
        let [x, y] = self.tangents(height);
        x.cross(&y).norm()
    }
}

/// The surface where it meets a ray.
struct Hit {
    height: f64,
    sum: f64,
    /// Both fields a Newton step away from there at most.
    sample: Sample,
    /// How fast `Φ` falls along the ray, if it is the surface's.
    fall: Option<f64>,
}

/// The core of one side's only skeleton.
pub struct Core<'a> {
    pair: &'a Pair,
    parts: [Part; MOST_PARTS],
    count: usize,
    /// The least of a box's half sizes.
    thinnest: f64,
    /// Whether rays slant inside, to leave no gap between faces.
    slanted: bool,
    /// Whether `Φ` has but one zero along them.
    single: bool,
    /// Whether the contact goes round the core, by what the deepest point tells.
    wraps: bool,
    thickness: f64,
    /// Whether it is a's, and its share of the stiffness.
    of_a: bool,
    share: f64,
    /// `|Φ|` below which the last Newton step is extrapolated instead of evaluated.
    accept: f64,
    evaluations: u32,
    /// How many rays met the surface inside the core, and of those how many once more.
    below: u32,
    folded: u32,
    lost: bool,
}

/// The same as [`super::integrate`], over a core.
pub fn integrate(
    mut core: Core,
    target: &Target,
    workspace: &mut Workspace,
    nodes: &mut Vec<Node>,
) -> Result<Integrated, Unfit> {
    let mut parts = [0; MOST_PARTS];
    let mut count = 0;
    for part in 0..core.count as u8 {
        if core.trim(part) {
            parts[count] = part;
            count += 1;
        }
    }
    loop {
        workspace.clear();
        let mut work = Cells { sheet: core, workspace };
        for part in &parts[..count] {
            let guess = work.sheet.thickness;
            if let Some(cell) = work.measure(*part, (0, 0), FIRST_HALF, guess) {
                work.workspace.cells.push(cell);
            }
            if work.sheet.lost {
                break;
            }
        }
        let error = work.refine(target.tolerance);
        core = work.sheet;
        let evaluations = core.evaluations;
        if core.lost && core.slanted {
            (core.slanted, core.lost) = (false, false);
            continue;
        }
        if core.lost || workspace.cells.is_empty() {
            return Err(Unfit { evaluations });
        }
        workspace.collect(&core, nodes);
        let folded = if core.slanted { f64::from(core.folded) / f64::from(core.below.max(1)) } else { 0.0 };
        let frame = Frame::new(target.at, [target.extent; 2]);
        return Ok(Integrated { error: (error + folded).min(1.0), evaluations, frame });
    }
}

/// What a core is, for its parts.
#[derive(Clone, Copy)]
enum Outline {
    /// A box that may be flat: its middle, half its sizes, and their directions.
    Box { center: Vec3, half: [f64; 3], axes: [Vec3; 3] },
    /// A triangle and its unit normal.
    Triangle { corners: [Vec3; 3], normal: Vec3 },
}

/// The outline of a shape; of what is round such that the parts meet at the deepest point.
fn core_of(shape: &Shape, at: &Deepest) -> Option<Outline> {
    match shape {
        Shape::Point(center) => {
            Some(Outline::Box { center: *center, half: [0.0; 3], axes: [at.normal, at.axes[0], at.axes[1]] })
        }
        // One whose length squared is nil has no direction.
        Shape::Segment(a, b) if (b - a).norm_squared() == 0.0 => core_of(&Shape::Point(*a), at),
        Shape::Segment(a, b) => {
            let half = 0.5 * (b - a);
            let length = half.norm();
            let along = half / length;
            let across = (at.normal - along * at.normal.dot(&along)).try_normalize(LEVEL);
            let across = across.unwrap_or_else(|| tangents(&along).0);
            let axes = [along, across, along.cross(&across)];
            Some(Outline::Box { center: 0.5 * (a + b), half: [length, 0.0, 0.0], axes })
        }
        Shape::Box { center, half, axes } => {
            let axes = [0, 1, 2].map(|axis| axes.column(axis).into());
            Some(Outline::Box { center: *center, half: [half.x, half.y, half.z], axes })
        }
        Shape::Triangle(a, b, c) => {
            let normal = (b - a).cross(&(c - a)).try_normalize(f64::MIN_POSITIVE)?;
            Some(Outline::Triangle { corners: [*a, *b, *c], normal })
        }
        Shape::Plane { .. } => None,
    }
}

/// Faces, quarters of a turn about edges and octants about corners.
fn parts_of_box(center: Vec3, half: [f64; 3], axes: [Vec3; 3]) -> ([Part; MOST_PARTS], usize) {
    let (mut parts, mut count) = ([Part::default(); MOST_PARTS], 0);
    for number in 0..27 {
        let ends = [number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1];
        // Nothing is between two ends that are one.
        if ends == [0; 3] || (0..3).any(|axis| ends[axis] == 0 && half[axis] == 0.0) {
            continue;
        }
        let mut part = Part { foot: center, middle: [0.25 * PI; 2], span: [0.5 * PI; 2], ..Part::default() };
        let mut free = 0;
        for axis in 0..3 {
            if ends[axis] == 0 {
                part.sides[free] = axes[axis];
                part.half[free] = half[axis];
                (part.middle[free], part.span[free]) = (0.0, 2.0 * half[axis]);
                free += 1;
            } else {
                let outwards = axes[axis] * f64::from(ends[axis]);
                part.foot += outwards * half[axis];
                part.depth = half[axis];
                part.outwards[part.count] = outwards;
                part.count += 1;
            }
        }
        parts[count] = part;
        count += 1;
    }
    (parts, count)
}

/// Both faces, half turns about edges from one to the other, and what is between those about corners.
fn parts_of_triangle(corners: [Vec3; 3], normal: Vec3) -> ([Part; MOST_PARTS], usize) {
    let mut parts = [Part::default(); MOST_PARTS];
    let sides = [0, 1, 2].map(|i| corners[(i + 1) % 3] - corners[i]);
    let outwards = sides.map(|side| side.cross(&normal).normalize());
    for (index, face) in [normal, -normal].into_iter().enumerate() {
        parts[index] = Part {
            foot: corners[0],
            sides: [sides[0], sides[1]],
            triangle: true,
            outwards: [face, Vec3::zeros(), Vec3::zeros()],
            count: 1,
            middle: [0.5; 2],
            span: [1.0; 2],
            ..Part::default()
        };
    }
    for index in 0..3 {
        let (out, next) = (outwards[index], outwards[(index + 1) % 3]);
        let length = sides[index].norm();
        parts[2 + index] = Part {
            foot: 0.5 * (corners[index] + corners[(index + 1) % 3]),
            sides: [sides[index] / length, Vec3::zeros()],
            outwards: [normal, out, Vec3::zeros()],
            count: 2,
            middle: [0.0, 0.5 * PI],
            span: [length, PI],
            ..Part::default()
        };
        let turn = libm::atan2(out.cross(&next).dot(&normal), out.dot(&next));
        parts[5 + index] = Part {
            foot: corners[(index + 1) % 3],
            outwards: [normal, out, normal.cross(&out)],
            count: 3,
            middle: [0.5 * PI, 0.5 * turn],
            span: [PI, turn],
            ..Part::default()
        };
    }
    (parts, 8)
}

/// Whether a contact goes round what is round, with its axis if it is a segment, by what the deepest point predicts.
fn goes_round(at: &Deepest, long: bool, axis: &Vec3, thickness: f64) -> bool {
    let wide = |curvature: f64| 2.0 * at.sum > -curvature * (WRAPPED * thickness).powi(2);
    let across = if long { at.normal.cross(axis).try_normalize(LEVEL) } else { None };
    match across {
        // How long it is along a segment does not matter.
        Some(across) => wide((0..2).map(|i| at.curvature[i] * at.axes[i].dot(&across).powi(2)).sum()),
        None => at.curvature.into_iter().any(wide),
    }
}

/// The least and the greatest slope of a side's pressure within its coat and its core \[Pa/m\].
fn slopes_within(side: &Side) -> (f64, f64) {
    let (slope, stiffening) = (side.slope(0), side.skeletons[0].profile.stiffening);
    (slope * stiffening.min(1.0), slope * stiffening.max(1.0))
}

impl<'a> Core<'a> {
    /// The core of the steeper coat, if it has one that is known here.
    pub fn new(target: &Target<'a>) -> Option<Self> {
        let Target { pair, at, tolerance, .. } = *target;
        if !pair.is_simple() {
            return None;
        }
        let sides = [&pair.a, &pair.b];
        let slopes = sides.map(|side| side.slope(0));
        let cores = sides.map(|side| core_of(&side.skeletons[0].shape, at));
        // Of equals the smaller, whichever comes first.
        let sizes = sides.map(|side| side.skeletons[0].shape.half_extent());
        let of_a = slopes[0] > slopes[1]
            || slopes[0] == slopes[1] && cores[0].is_some() && (sizes[0] <= sizes[1] || cores[1].is_none());
        let own = usize::from(!of_a);
        let core = cores[own]?;
        let skeleton = &sides[own].skeletons[0];
        let thickness = skeleton.profile.thickness;
        let [(least, _), (_, greatest)] = [own, 1 - own].map(|side| slopes_within(sides[side]));
        let single = least > LONGEST * greatest;
        let (parts, count, thinnest, wraps) = match core {
            Outline::Box { center, half, axes } => {
                let thinnest = half.into_iter().fold(f64::INFINITY, f64::min);
                let wraps = thinnest > 0.0 || goes_round(at, half[0] > 0.0, &axes[0], thickness);
                let (parts, count) = parts_of_box(center, half, axes);
                (parts, count, thinnest, wraps)
            }
            Outline::Triangle { corners, normal } => {
                let (parts, count) = parts_of_triangle(corners, normal);
                // Whether the other's coat goes on behind it.
                let closest = skeleton.shape.closest(&at.position);
                let behind = at.position - closest.normal * (closest.distance + thickness);
                let wraps = sides[1 - own].excess(&behind).0 > 0.0;
                (parts, count, 0.0, wraps)
            }
        };
        let share = pair.shares()[own];
        let accept = SOLVED * accept(at.sum, tolerance);
        Some(Self {
            pair,
            parts,
            count,
            thinnest,
            slanted: thinnest > 0.0,
            single,
            wraps,
            thickness,
            of_a,
            share,
            accept,
            evaluations: 0,
            below: 0,
            folded: 0,
            lost: false,
        })
    }

    /// Whether to look for the surface here first: a plane does as well, with fewer cells, for what is narrower than the
    /// coat of something round is thick.
    pub fn wraps(&self) -> bool {
        self.wraps
    }

    /// The ray over a place; what counts of a part's coordinates goes from `-GRID / 2` to `GRID / 2`.
    fn ray(&self, place: Place) -> Ray {
        let part = &self.parts[usize::from(place.part)];
        let rates = part.span.map(|span| span / GRID);
        let (x, y) = (part.middle[0] + rates[0] * place.x, part.middle[1] + rates[1] * place.y);
        let none = [Vec3::zeros(); 2];
        let circle = |angle: f64| (libm::cos(angle), libm::sin(angle));
        let round = |foot: Vec3, normal: Vec3, along: [Vec3; 2], turn: [Vec3; 2]| Ray {
            foot,
            normal,
            triangle: part.triangle,
            bottom: 0.0,
            inside: normal,
            along,
            turn,
            turn_inside: none,
        };
        let [e1, e2, e3] = part.outwards;
        match part.count {
            1 if part.triangle => {
                let across = part.sides[0] + part.sides[1] * y;
                let along = [across * rates[0], part.sides[1] * (x * rates[1])];
                round(part.foot + across * x, e1, along, none)
            }
            1 => {
                let foot = part.foot + part.sides[0] * x + part.sides[1] * y;
                let along = [part.sides[0] * rates[0], part.sides[1] * rates[1]];
                if self.slanted {
                    // From where the boxes that are smaller by as much all round have that place.
                    let lean = [0, 1].map(|axis| part.sides[axis] / part.half[axis]);
                    let inside = e1 + lean[0] * x + lean[1] * y;
                    let turn_inside = [lean[0] * rates[0], lean[1] * rates[1]];
                    return Ray {
                        foot,
                        normal: e1,
                        triangle: false,
                        bottom: -self.thinnest,
                        inside,
                        along,
                        turn: none,
                        turn_inside,
                    };
                }
                let nearest = (part.half[0] - x.abs()).min(part.half[1] - y.abs()).max(0.0);
                let bottom = -nearest.min(part.depth);
                Ray { foot, normal: e1, triangle: false, bottom, inside: e1, along, turn: none, turn_inside: none }
            }
            2 => {
                let (cos, sin) = circle(y);
                let turn = (e2 * cos - e1 * sin) * rates[1];
                let along = [part.sides[0] * rates[0], none[1]];
                round(part.foot + part.sides[0] * x, e1 * cos + e2 * sin, along, [none[0], turn])
            }
            _ => {
                // From the first direction away, and about it.
                let (cos_away, sin_away) = circle(x);
                let (cos, sin) = circle(y);
                let about = e2 * cos + e3 * sin;
                let turn =
                    [(about * cos_away - e1 * sin_away) * rates[0], (e3 * cos - e2 * sin) * (rates[1] * sin_away)];
                round(part.foot, e1 * cos_away + about * sin_away, none, turn)
            }
        }
    }

    /// Leaves of a part what the other's coat may reach. False when that is nothing.
    fn trim(&mut self, part: u8) -> bool {
        let middle = Place { part, x: 0.0, y: 0.0 };
        if self.reach(middle, [GRID; 2]) <= 0.0 {
            return false;
        }
        for _ in 0..MOST_TRIMS {
            let mut trimmed = false;
            for (axis, end) in [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0)] {
                let mut sides = [GRID; 2];
                sides[axis] = GRID / f64::from(TRIM);
                let away = end * 0.5 * (GRID - sides[axis]);
                let place = if axis == 0 { Place { x: away, ..middle } } else { Place { y: away, ..middle } };
                if self.reach(place, sides) <= 0.0 {
                    let part = &mut self.parts[usize::from(part)];
                    let less = part.span[axis] / f64::from(TRIM);
                    part.span[axis] -= less;
                    part.middle[axis] -= 0.5 * end * less;
                    trimmed = true;
                }
            }
            if !trimmed {
                break;
            }
        }
        true
    }

    /// A bound from above of the other's excess, on the own surface over a rectangle about a place.
    fn reach(&self, middle: Place, sides: [f64; 2]) -> f64 {
        let ray = self.ray(middle);
        let part = &self.parts[usize::from(middle.part)];
        let turns = part.turns();
        let half = [0, 1].map(|axis| 0.5 * sides[axis] * part.span[axis] / GRID);
        let angle = (0..2).filter(|axis| turns[*axis]).map(|axis| half[axis]).sum::<f64>();
        let drop = self.thickness * (1.0 - libm::cos(angle));
        let leg = |axis: usize| {
            if turns[axis] {
                ray.turn[axis].normalize() * (self.thickness * angle)
            } else {
                // The farther from its corner, the wider is a triangle.
                let widening = if part.triangle && axis == 1 { half[0] * half[1] } else { 0.0 };
                ray.along[axis] * (0.5 * sides[axis]) + part.sides[1] * widening
            }
        };
        let center = ray.point(self.thickness - 0.5 * drop);
        let other = if self.of_a { &self.pair.b } else { &self.pair.a };
        other.most(&center, &[leg(0), leg(1), ray.normal * (0.5 * drop)])
    }

    /// The sign that `Φ` has on its own side of the surface.
    fn sign(&self) -> f64 {
        if self.of_a { 1.0 } else { -1.0 }
    }

    /// The surface over a ray, or the own coat's where there is no contact. `None` where another part has it, or when it
    /// is lost.
    fn find(&mut self, ray: &Ray, guess: f64) -> Option<Hit> {
        // Heights known to be below the surface, and above it.
        let (mut low, mut high) = (None, None);
        let mut height = guess.clamp(ray.bottom, self.thickness);
        for _ in 0..MOST_LOOKS {
            let sample = self.pair.sample(&ray.point(height));
            self.evaluations += 1;
            let up = ray.up(height);
            let rest = self.sign() * sample.difference;
            let fall = -self.sign() * sample.difference_gradient.dot(&up);
            if rest.abs() <= self.accept || (height == self.thickness && rest >= 0.0) {
                let fall = (fall > STEEPEST * sample.difference_gradient.norm()).then_some(fall);
                let step = fall.map_or(0.0, |fall| rest / fall);
                let sum = sample.sum + step * sample.sum_gradient.dot(&up);
                // Without contact it need be nobody's surface.
                if fall.is_none() && sum > 0.0 {
                    return self.lose();
                }
                if self.slanted && height < 0.0 {
                    self.below += 1;
                    self.folded += u32::from(!self.single && self.is_folded(ray));
                }
                return Some(Hit { height: height + step, sum, sample, fall });
            }
            if rest > 0.0 {
                low = Some(height);
            } else if height > ray.bottom {
                high = Some(height);
            } else if height == 0.0 && !ray.triangle {
                // Pressed through an edge or a corner there is nothing over it.
                return Some(Hit { height, sum: sample.sum, sample, fall: None });
            } else {
                return self.lose();
            }
            let (least, most) = (low.unwrap_or(ray.bottom), high.unwrap_or(self.thickness));
            let next = if fall > 0.0 { height + rest / fall } else { 0.5 * (least + most) };
            let next = next.clamp(least, most);
            height = if Some(next) == low || Some(next) == high { 0.5 * (least + most) } else { next };
        }
        self.lose()
    }

    /// Gives up, unless rays go straight in: they end where another part may have the surface.
    fn lose(&mut self) -> Option<Hit> {
        self.lost = self.slanted || self.thinnest == 0.0;
        None
    }

    /// Whether a ray that met the surface inside the core meets it again below the face. As far as profiles are linear
    /// `Φ` is convex along it, so that the own side is there again at the face.
    fn is_folded(&mut self, ray: &Ray) -> bool {
        self.evaluations += 1;
        self.sign() * self.pair.sample(&ray.foot).difference > 0.0
    }
}

impl Sheet for Core<'_> {
    fn pair(&self) -> &Pair {
        self.pair
    }

    fn point(&self, place: Place, height: f64) -> Vec3 {
        self.ray(place).point(height)
    }

    fn flat(&self, place: Place, height: f64) -> (f64, Vec3) {
        let ray = self.ray(place);
        (ray.unit_area(height), ray.normal)
    }

    fn look(&mut self, place: Place, guess: f64, _: f64) -> Option<Vertex> {
        if self.lost {
            return None;
        }
        let ray = self.ray(place);
        let Hit { height, sum, sample, fall } = self.find(&ray, guess)?;
        let unit = ray.unit_area(height);
        let Some(fall) = fall else {
            let (area, none) = (ray.normal * unit, [0.0; 2]);
            return Some(Vertex { place, height, slopes: none, sum, gradient: none, area, stiffness: 0.0 });
        };
        let rise = sample.sum_gradient.dot(&ray.up(height));
        let (mut slopes, mut gradient) = ([0.0; 2], [0.0; 2]);
        for (axis, tangent) in ray.tangents(height).into_iter().enumerate() {
            slopes[axis] = self.sign() * sample.difference_gradient.dot(&tangent) / fall;
            gradient[axis] = sample.sum_gradient.dot(&tangent) + rise * slopes[axis];
        }
        // Vector area from a to b: n dA = ∇Φ / (∇Φ·up) times that of the sheet.
        let area = sample.difference_gradient * (-unit / fall);
        let density = sample.difference_gradient.norm() / fall;
        let normal = sample.difference_gradient / (fall * density);
        let stiffness = unit * density * self.pair.normal_stiffness(&sample, &normal);
        Some(Vertex { place, height, slopes, sum, gradient, area, stiffness })
    }

    fn most(&self, corners: &[Vertex; 4], side: f64) -> f64 {
        let place = corners[0].place;
        let middle = Place { part: place.part, x: place.x + 0.5 * side, y: place.y + 0.5 * side };
        self.reach(middle, [side; 2]) / self.share
    }

    fn is_lost(&self) -> bool {
        self.lost
    }
}
