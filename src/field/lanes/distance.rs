//! Shapes without branches: how far points are from one, the constants of the shape worked out once for many points.

use super::vector::{Lanes, dot, splat, sub};
use crate::math::{Mat3, Vec3, tangents};

/// Half the diagonal of a cube over half its edge.
const SQRT_3: f64 = 1.732_050_807_568_877_3;

/// How far points are from a shape, and which way: the gradient of the distance is `direction / length`.
#[derive(Clone, Copy)]
pub struct Away<const W: usize> {
    pub distance: Lanes<W>,
    /// In the frame of the shape, see [`Distance::to_world`].
    pub direction: [Lanes<W>; 3],
    /// Length of `direction`, where it has one: the division is left to the caller, who can put it off.
    pub length: Lanes<W>,
}

/// A shape with its constants, ready for lanes: [`Shape::closest`](crate::field::Shape::closest) without branches.
pub trait Distance {
    /// [`Shape::is_solid`](crate::field::Shape::is_solid).
    const SOLID: bool;

    /// Whether all distances of a chunk are worked out before the profiles. One after the other, geometry and profile
    /// of these shapes are a chain of dependent operations too long for the processor to overlap with the next block's.
    const TWO_PASSES: bool;

    fn away<const W: usize>(&self, p: [Lanes<W>; 3]) -> Away<W>;

    /// The distance alone, with the same bits.
    #[inline(always)]
    fn distance<const W: usize>(&self, p: [Lanes<W>; 3]) -> Lanes<W> {
        self.away(p).distance
    }

    /// Bounds of the distance in a cube with this middle and half this edge.
    #[inline(always)]
    fn span<const W: usize>(&self, center: [Lanes<W>; 3], half: f64) -> (Lanes<W>, Lanes<W>) {
        let (distance, radius) = (self.distance(center), Lanes::splat(half * SQRT_3));
        let near = distance - radius;
        (if Self::SOLID { near } else { near.max(Lanes::splat(0.0)) }, distance + radius)
    }

    /// The squares of such bounds; 0 within a shape.
    #[inline(always)]
    fn square_span<const W: usize>(&self, center: [Lanes<W>; 3], half: f64) -> (Lanes<W>, Lanes<W>) {
        let (near, far) = self.span(center, half);
        let (near, far) = (near.max(Lanes::splat(0.0)), far.max(Lanes::splat(0.0)));
        (near * near, far * far)
    }

    /// Turns a direction of the shape's frame into the frame of the points.
    #[inline(always)]
    fn to_world<const W: usize>(&self, direction: [Lanes<W>; 3]) -> [Lanes<W>; 3] {
        direction
    }
}

pub struct ToPoint(pub Vec3);

impl Distance for ToPoint {
    const SOLID: bool = false;
    const TWO_PASSES: bool = false;

    #[inline(always)]
    fn away<const W: usize>(&self, p: [Lanes<W>; 3]) -> Away<W> {
        let direction = sub(p, splat(&self.0));
        let distance = dot(direction, direction).sqrt();
        Away { distance, direction, length: distance }
    }

    #[inline(always)]
    fn span<const W: usize>(&self, center: [Lanes<W>; 3], half: f64) -> (Lanes<W>, Lanes<W>) {
        let (near, far) = self.square_span(center, half);
        (near.sqrt(), far.sqrt())
    }

    #[inline(always)]
    fn square_span<const W: usize>(&self, center: [Lanes<W>; 3], half: f64) -> (Lanes<W>, Lanes<W>) {
        // Not by `map` of arrays, which may become calls of functions without the wide instructions.
        let ([x, y, z], half) = (sub(center, splat(&self.0)), Lanes::splat(half));
        let (x, y, z) = (x.abs(), y.abs(), z.abs());
        let nearer = |x: Lanes<W>| (x - half).max(Lanes::splat(0.0));
        let (near, far) = ([nearer(x), nearer(y), nearer(z)], [x + half, y + half, z + half]);
        (dot(near, near), dot(far, far))
    }
}

pub struct ToSegment {
    start: Vec3,
    edge: Vec3,
    /// `edge / edge²`: what an offset is multiplied with for its place along the edge, 0 to 1.
    dual: Vec3,
}

impl ToSegment {
    #[inline(always)]
    pub fn new(a: &Vec3, b: &Vec3) -> Self {
        let edge = b - a;
        Self { start: *a, edge, dual: edge * inverse_or_zero(edge.norm_squared()) }
    }
}

impl Distance for ToSegment {
    const SOLID: bool = false;
    const TWO_PASSES: bool = true;

    #[inline(always)]
    fn away<const W: usize>(&self, p: [Lanes<W>; 3]) -> Away<W> {
        let (offset, [x, y, z]) = (sub(p, splat(&self.start)), splat(&self.edge));
        let along = dot(offset, splat(&self.dual)).clamp(Lanes::splat(0.0), Lanes::splat(1.0));
        let direction = sub(offset, [x * along, y * along, z * along]);
        let distance = dot(direction, direction).sqrt();
        Away { distance, direction, length: distance }
    }
}

/// A triangle in its own frame: the first corner is the origin, the longest edge points along x, the third corner lies
/// in the upper half of the xy plane. In this frame the distance is planar, and even slivers keep their directions:
/// only the tilt about the longest edge, which a sliver hardly determines, is uncertain.
pub struct ToTriangle {
    frame: Frame,
    /// x of the second corner.
    base: f64,
    /// The other two edges: from the second corner to the third, and from the third to the first.
    sides: [PlanarEdge; 2],
}

/// An edge in the plane.
pub struct PlanarEdge {
    start: [f64; 2],
    edge: [f64; 2],
    /// `1 / edge²`.
    inverse_square: f64,
}

impl PlanarEdge {
    #[inline(always)]
    pub fn new(start: [f64; 2], end: [f64; 2]) -> Self {
        let edge = [end[0] - start[0], end[1] - start[1]];
        Self { start, edge, inverse_square: inverse_or_zero(edge[0] * edge[0] + edge[1] * edge[1]) }
    }

    /// Offset from the closest point, its square, and a number that is negative to the right of the edge.
    #[inline(always)]
    fn away<const W: usize>(&self, x: Lanes<W>, y: Lanes<W>) -> (Lanes<W>, Lanes<W>, Lanes<W>, Lanes<W>) {
        let s = Lanes::splat;
        let (x, y) = (x - s(self.start[0]), y - s(self.start[1]));
        let (ex, ey) = (s(self.edge[0]), s(self.edge[1]));
        let along = ((x * ex + y * ey) * s(self.inverse_square)).clamp(s(0.0), s(1.0));
        let side = ex * y - ey * x;
        let (x, y) = (x - ex * along, y - ey * along);
        (x, y, x * x + y * y, side)
    }
}

impl ToTriangle {
    #[inline(always)]
    pub fn new(a: &Vec3, b: &Vec3, c: &Vec3) -> Self {
        // The longest edge first: the frame inherits its accuracy.
        let (ab, bc, ca) = ((b - a).norm_squared(), (c - b).norm_squared(), (a - c).norm_squared());
        let (a, b, c) = if ab >= bc && ab >= ca {
            (a, b, c)
        } else if bc >= ca {
            (b, c, a)
        } else {
            (c, a, b)
        };
        let (ab, ac) = (b - a, c - a);
        let base = ab.norm();
        let x = if base > 0.0 { ab / base } else { Vec3::x() };
        // Once more takes away what cancellation leaves along x when the triangle is a sliver.
        let across = ac - x * ac.dot(&x);
        let across = across - x * across.dot(&x);
        let height = across.norm();
        // Far from the origin a small triangle can lose its height, even its base, to rounding; any frame then serves.
        let y = if height > 0.0 { across / height } else { tangents(&x).0 };
        let frame = Frame { origin: *a, axes: [x, y, x.cross(&y)] };
        let (second, third) = ([base, 0.0], [ac.dot(&x), height]);
        Self { frame, base, sides: [PlanarEdge::new(second, third), PlanarEdge::new(third, [0.0, 0.0])] }
    }
}

impl Distance for ToTriangle {
    const SOLID: bool = false;
    const TWO_PASSES: bool = true;

    #[inline(always)]
    fn away<const W: usize>(&self, p: [Lanes<W>; 3]) -> Away<W> {
        let zero = Lanes::splat(0.0);
        let [x, y, z] = self.frame.to_local(p);
        // The base first, which needs no projection; then whatever is closer.
        let (mut near_x, mut near_y) = (x - x.clamp(zero, Lanes::splat(self.base)), y);
        let mut square = near_x * near_x + y * y;
        let mut inside = y;
        for edge in &self.sides {
            let (edge_x, edge_y, edge_square, side) = edge.away(x, y);
            near_x = square.where_greater(edge_square, edge_x, near_x);
            near_y = square.where_greater(edge_square, edge_y, near_y);
            square = square.min(edge_square);
            inside = inside.min(side);
        }
        // Above the face nothing is left but the height.
        let near_x = inside.where_greater(zero, zero, near_x);
        let near_y = inside.where_greater(zero, zero, near_y);
        let direction = [near_x, near_y, z];
        let distance = dot(direction, direction).sqrt();
        Away { distance, direction, length: distance }
    }

    #[inline(always)]
    fn distance<const W: usize>(&self, p: [Lanes<W>; 3]) -> Lanes<W> {
        let zero = Lanes::splat(0.0);
        let [x, y, z] = self.frame.to_local(p);
        let near_x = x - x.clamp(zero, Lanes::splat(self.base));
        let (mut square, mut inside) = (near_x * near_x + y * y, y);
        for edge in &self.sides {
            let (_, _, edge_square, side) = edge.away(x, y);
            square = square.min(edge_square);
            inside = inside.min(side);
        }
        (inside.where_greater(zero, zero, square) + z * z).sqrt()
    }

    #[inline(always)]
    fn to_world<const W: usize>(&self, direction: [Lanes<W>; 3]) -> [Lanes<W>; 3] {
        self.frame.to_world(direction)
    }
}

pub struct ToBox {
    frame: Frame,
    half: Vec3,
}

impl ToBox {
    #[inline(always)]
    pub fn new(center: &Vec3, half: &Vec3, axes: &Mat3) -> Self {
        let axes = [axes.column(0).into(), axes.column(1).into(), axes.column(2).into()];
        Self { frame: Frame { origin: *center, axes }, half: *half }
    }
}

impl Distance for ToBox {
    const SOLID: bool = true;
    const TWO_PASSES: bool = true;

    #[inline(always)]
    fn away<const W: usize>(&self, p: [Lanes<W>; 3]) -> Away<W> {
        let (zero, one) = (Lanes::splat(0.0), Lanes::splat(1.0));
        let [x, y, z] = self.frame.to_local(p);
        let [hx, hy, hz] = splat(&self.half);
        let outside = [x - x.clamp(zero - hx, hx), y - y.clamp(zero - hy, hy), z - z.clamp(zero - hz, hz)];
        let square = dot(outside, outside);
        let length = square.where_greater(zero, square.sqrt(), one);

        // Inside, the face that is the least deep decides: a unit vector along x, y or z, the first of equals.
        let (ex, ey, ez) = (x.abs() - hx, y.abs() - hy, z.abs() - hz);
        let nearest = ex.max(ey).max(ez);
        let not_x = nearest.where_greater(ex, one, zero);
        let not_y = nearest.where_greater(ey, one, one - not_x);
        let inside = [
            x.where_less(zero, not_x - one, one - not_x),
            y.where_less(zero, not_y - one, one - not_y),
            z.where_less(zero, one - not_x - not_y, not_x + not_y - one),
        ];

        let pick = |i: usize| square.where_greater(zero, outside[i], inside[i]);
        let direction = [pick(0), pick(1), pick(2)];
        Away { distance: square.where_greater(zero, length, nearest), direction, length }
    }

    #[inline(always)]
    fn to_world<const W: usize>(&self, direction: [Lanes<W>; 3]) -> [Lanes<W>; 3] {
        self.frame.to_world(direction)
    }
}

pub struct ToPlane {
    pub point: Vec3,
    pub normal: Vec3,
}

impl Distance for ToPlane {
    const SOLID: bool = true;
    const TWO_PASSES: bool = false;

    #[inline(always)]
    fn away<const W: usize>(&self, p: [Lanes<W>; 3]) -> Away<W> {
        let direction = splat(&self.normal);
        Away { distance: dot(sub(p, splat(&self.point)), direction), direction, length: Lanes::splat(1.0) }
    }
}

/// Where a shape is: its origin, and its three axes.
pub struct Frame {
    origin: Vec3,
    axes: [Vec3; 3],
}

impl Frame {
    #[inline(always)]
    fn to_local<const W: usize>(&self, p: [Lanes<W>; 3]) -> [Lanes<W>; 3] {
        let offset = sub(p, splat(&self.origin));
        let [x, y, z] = &self.axes;
        [dot(splat(x), offset), dot(splat(y), offset), dot(splat(z), offset)]
    }

    #[inline(always)]
    fn to_world<const W: usize>(&self, direction: [Lanes<W>; 3]) -> [Lanes<W>; 3] {
        let [x, y, z] = &self.axes;
        let row = |i: usize| [Lanes::splat(x[i]), Lanes::splat(y[i]), Lanes::splat(z[i])];
        [dot(row(0), direction), dot(row(1), direction), dot(row(2), direction)]
    }
}

/// `1 / x`, and 0 for 0: an edge that rounding has shrunk to a point then acts as one.
#[inline(always)]
fn inverse_or_zero(x: f64) -> f64 {
    if x > 0.0 { 1.0 / x } else { 0.0 }
}
