//! The surface as a height over the core of a point, a segment or a box: for what is wrapped in the surface.
//!
//! Of two coats, the surface lies over the core of the steeper one wherever the other is: along a ray outwards from the
//! core the steeper pressure falls faster than the other can, so that `Φ` has one zero at most. The rays from the faces,
//! the edges, by quarters of a turn, and the corners, by octants, go through all of space round a core. Where a face
//! is pressed into the core of its box, its rays go on inwards, to where those of its neighbours end. Where a ray leaves
//! its own coat the other's field tells whether there is contact, since the border lies where both pressures are nil.

use std::f64::consts::PI;

use super::SOLVED;
use super::cells::{Cells, FIRST_HALF, GRID, Place, Sheet, Vertex, Workspace};
use crate::contact::column::{Frame, STEEPEST, accept};
use crate::contact::deepest::Deepest;
use crate::contact::pair::{Pair, Sample};
use crate::contact::patch::Node;
use crate::contact::target::{Integrated, Target, Unfit};
use crate::field::Shape;
use crate::math::{Vec3, tangents};

/// A face, a quarter of an edge or an octant of a corner.
#[derive(Clone, Copy, Default)]
struct Part {
    /// Its middle.
    foot: Vec3,
    /// Its sides: of a face two, of an edge one.
    sides: [Vec3; 2],
    /// The directions that its rays are between.
    outwards: [Vec3; 3],
    /// How many of those.
    count: usize,
}

/// Most parts: those of a box.
const MOST_PARTS: usize = 26;
/// Most evaluations over a place.
const MOST_LOOKS: usize = 40;
/// Sine of the angle between a segment and the normal below which the segment has no side that faces the other.
const LEVEL: f64 = 1e-6;
/// Predicted half width of a contact, over the thickness of the coat, beyond which it goes round what is round.
const WRAPPED: f64 = 1.0;

/// A ray from within the core through a place on it outwards. Heights are signed distances from the core: rays from a
/// face leave at right angles, and come from where the boxes that are smaller by as much all round have that place.
struct Ray {
    foot: Vec3,
    /// Unit normal of the core.
    normal: Vec3,
    /// The way up inside the core; none from edges and corners.
    inside: Option<Vec3>,
    /// How the foot changes a unit of the coordinates, and the way up, outside and inside.
    along: [Vec3; 2],
    turn: [Vec3; 2],
    turn_inside: [Vec3; 2],
}

impl Ray {
    fn up(&self, height: f64) -> Vec3 {
        self.inside.filter(|_| height < 0.0).unwrap_or(self.normal)
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
struct Core<'a> {
    pair: &'a Pair,
    parts: [Part; MOST_PARTS],
    count: usize,
    /// How far a face may be pressed in \[m\].
    depth: f64,
    thickness: f64,
    /// Whether it is a's, and its share of the stiffness.
    of_a: bool,
    share: f64,
    /// `|Φ|` below which the last Newton step is extrapolated instead of evaluated.
    accept: f64,
    evaluations: u32,
    lost: bool,
}

/// The same as [`super::integrate`], if the steeper coat has a core that is known here.
pub fn integrate(target: &Target, workspace: &mut Workspace, nodes: &mut Vec<Node>) -> Result<Integrated, Unfit> {
    let Target { at, extent, tolerance, .. } = *target;
    let Some(sheet) = Core::new(target) else {
        return Err(Unfit { evaluations: 0 });
    };
    workspace.clear();
    let mut work = Cells { sheet, workspace };
    for part in 0..work.sheet.count as u8 {
        if work.sheet.reach(Place { part, x: 0.0, y: 0.0 }, GRID) <= 0.0 {
            continue;
        }
        let guess = work.sheet.thickness;
        if let Some(cell) = work.measure(part, (0, 0), FIRST_HALF, guess) {
            work.workspace.cells.push(cell);
        }
        if work.sheet.is_lost() {
            break;
        }
    }
    let error = work.refine(tolerance);
    let Cells { sheet, workspace } = work;
    let evaluations = sheet.evaluations;
    if sheet.is_lost() || workspace.cells.is_empty() {
        return Err(Unfit { evaluations });
    }
    workspace.collect(&sheet, nodes);
    Ok(Integrated { error, evaluations, frame: Frame::new(at, [extent; 2]) })
}

/// A shape as a box that may be flat: its middle, half its sizes, and their directions, for what is round such that the
/// parts meet at the deepest point.
fn core_of(shape: &Shape, at: &Deepest) -> Option<(Vec3, [f64; 3], [Vec3; 3])> {
    match shape {
        Shape::Point(center) => Some((*center, [0.0; 3], [at.normal, at.axes[0], at.axes[1]])),
        Shape::Segment(a, b) => {
            let half = 0.5 * (b - a);
            let length = half.norm();
            let along = half / length;
            let across = (at.normal - along * at.normal.dot(&along)).try_normalize(LEVEL);
            let across = across.unwrap_or_else(|| tangents(&along).0);
            Some((0.5 * (a + b), [length, 0.0, 0.0], [along, across, along.cross(&across)]))
        }
        Shape::Box { center, half, axes } => {
            Some((*center, [half.x, half.y, half.z], [0, 1, 2].map(|axis| axes.column(axis).into())))
        }
        Shape::Triangle(..) | Shape::Plane { .. } => None,
    }
}

impl<'a> Core<'a> {
    fn new(target: &Target<'a>) -> Option<Self> {
        let Target { pair, at, tolerance, .. } = *target;
        if !pair.is_simple() {
            return None;
        }
        let slopes = [pair.a.slope(0), pair.b.slope(0)];
        let cores = [&pair.a, &pair.b].map(|side| core_of(&side.skeletons[0].shape, at));
        let of_a = slopes[0] > slopes[1] || slopes[0] == slopes[1] && cores[0].is_some();
        let own = usize::from(!of_a);
        let (center, half, axes) = cores[own]?;
        let thickness = [&pair.a, &pair.b][own].skeletons[0].profile.thickness;
        let edged = half.iter().all(|half| *half > 0.0);
        let flat = at.curvature.iter().any(|c| *c < 0.0 && 2.0 * at.sum <= -c * (WRAPPED * thickness).powi(2));
        if !edged && flat {
            // A plane does as well there, with fewer cells.
            return None;
        }
        let (mut parts, mut count) = ([Part::default(); MOST_PARTS], 0);
        for number in 0..27 {
            let ends = [number % 3 - 1, number / 3 % 3 - 1, number / 9 - 1];
            // Nothing is between two ends that are one.
            if ends == [0; 3] || (0..3).any(|axis| ends[axis] == 0 && half[axis] == 0.0) {
                continue;
            }
            let mut part = Part { foot: center, ..Part::default() };
            let mut free = 0;
            for axis in 0..3 {
                if ends[axis] == 0 {
                    part.sides[free] = axes[axis] * (2.0 * half[axis]);
                    free += 1;
                } else {
                    let outwards = axes[axis] * f64::from(ends[axis]);
                    part.foot += outwards * half[axis];
                    part.outwards[part.count] = outwards;
                    part.count += 1;
                }
            }
            parts[count] = part;
            count += 1;
        }
        let share = pair.shares()[own];
        let depth = half.into_iter().fold(f64::INFINITY, f64::min);
        let accept = SOLVED * accept(at.sum, tolerance);
        Some(Self { pair, parts, count, depth, thickness, of_a, share, accept, evaluations: 0, lost: false })
    }

    /// The ray over a place; each part's coordinates go from `-GRID / 2` to `GRID / 2`.
    fn ray(&self, place: Place) -> Ray {
        let part = &self.parts[usize::from(place.part)];
        let (x, y) = (place.x / GRID, place.y / GRID);
        let sides = part.sides.map(|side| side / GRID);
        let none = [Vec3::zeros(); 2];
        let round = |foot: Vec3, normal: Vec3, along: [Vec3; 2], turn: [Vec3; 2]| Ray {
            foot,
            normal,
            inside: None,
            along,
            turn,
            turn_inside: none,
        };
        // A quarter of a turn goes from end to end.
        let circle = |coordinate: f64| {
            let angle = 0.5 * PI * (coordinate + 0.5);
            (libm::cos(angle), libm::sin(angle))
        };
        let rate = 0.5 * PI / GRID;
        let [e1, e2, e3] = part.outwards;
        match part.count {
            1 => {
                let foot = part.foot + part.sides[0] * x + part.sides[1] * y;
                let turn_inside = sides.map(|side| side.normalize() * (2.0 / GRID));
                let inside = e1 + turn_inside[0] * place.x + turn_inside[1] * place.y;
                Ray { foot, normal: e1, inside: Some(inside), along: sides, turn: none, turn_inside }
            }
            2 => {
                let (cos, sin) = circle(y);
                let turn = (e2 * cos - e1 * sin) * rate;
                round(part.foot + part.sides[0] * x, e1 * cos + e2 * sin, sides, [none[0], turn])
            }
            _ => {
                // From the first direction away, and about it.
                let (cos_away, sin_away) = circle(x);
                let (cos, sin) = circle(y);
                let about = e2 * cos + e3 * sin;
                let turn = [(about * cos_away - e1 * sin_away) * rate, (e3 * cos - e2 * sin) * (rate * sin_away)];
                round(part.foot, e1 * cos_away + about * sin_away, none, turn)
            }
        }
    }

    /// A bound from above of the other's excess, on the own surface over a square about a place.
    fn reach(&self, middle: Place, side: f64) -> f64 {
        let ray = self.ray(middle);
        let turns = ray.turn.map(|turn| turn != Vec3::zeros());
        let angle = turns.iter().filter(|turns| **turns).count() as f64 * (0.5 * side * 0.5 * PI / GRID);
        let drop = self.thickness * (1.0 - libm::cos(angle));
        let leg = |axis: usize| {
            if turns[axis] {
                ray.turn[axis].normalize() * (self.thickness * angle)
            } else {
                ray.along[axis] * (0.5 * side)
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

    /// The surface over a ray, or the own coat's where there is no contact. `None` when it is none of the ray's.
    fn find(&mut self, ray: &Ray, guess: f64) -> Option<Hit> {
        let bottom = if ray.inside.is_some() { -self.depth } else { 0.0 };
        // Heights known to be below the surface, and above it.
        let (mut low, mut high) = (None, None);
        let mut height = guess.clamp(bottom, self.thickness);
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
                return (fall.is_some() || sum <= 0.0).then_some(Hit { height: height + step, sum, sample, fall });
            }
            if rest > 0.0 {
                low = Some(height);
            } else if height > bottom {
                high = Some(height);
            } else {
                // Pressed through an edge or a corner there is nothing over it.
                return ray.inside.is_none().then_some(Hit { height, sum: sample.sum, sample, fall: None });
            }
            let (least, most) = (low.unwrap_or(bottom), high.unwrap_or(self.thickness));
            let next = if fall > 0.0 { height + rest / fall } else { 0.5 * (least + most) };
            let next = next.clamp(least, most);
            height = if Some(next) == low || Some(next) == high { 0.5 * (least + most) } else { next };
        }
        None
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
        let Some(Hit { height, sum, sample, fall }) = self.find(&ray, guess) else {
            self.lost = true;
            return None;
        };
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
        self.reach(middle, side) / self.share
    }

    fn is_lost(&self) -> bool {
        self.lost
    }
}
