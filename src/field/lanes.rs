//! Bulk evaluation: the field of a body at many points, several points side by side.
//!
//! The lanes of a vector register are points, never skeletons: each lane does for its point what a loop over single
//! points would do, in the same order. So a result has the same bits at every register width, whatever its neighbours
//! in the array are. For the same reason nothing here is fused (`mul_add`) or estimated (reciprocal square roots).
//!
//! Three layers, from the bottom up:
//!
//! - `Lanes`: `W` numbers and their arithmetic, one small loop an operation, which the compiler turns into one
//!   instruction when `W` is the register's width;
//! - `Distance` and `Falloff`: shapes and profiles without branches, the constants of a skeleton worked out once for
//!   many points;
//! - `Query` and [`Dispatch`]: the loops, compiled once for each instruction set, and the choice among them.
//!
//! The scalar twin, and the reference in the tests, is [`blend::value_gradient`](super::blend::value_gradient): it
//! agrees to round-off, not in its bits, because divisions by a skeleton's constants are multiplications here.

use std::ops::{Add, Div, Mul, Sub};
use std::sync::atomic::{Ordering, compiler_fence};

use super::{Placed, Profile, Shape};
use crate::math::{Mat3, Vec3, tangents};

/// Field values and gradients of all skeletons together at many points: the sums over the skeletons, in their order.
///
/// - `points`: where, in the frame of the skeletons \[m\].
/// - `values`: receives the field values; `None` when they are not wanted.
/// - `gradients`: receives the gradients \[1/m\]; `None` when they are not wanted, which is faster. A thin skeleton
///   adds nothing to the gradient at its own points.
///
/// A coordinate that is not a number gives a value that is none, and disturbs no other point. Same input, same bits, on
/// every processor and for any grouping of the points into calls; but below about eight points a call, a loop over
/// [`blend::value_gradient`](super::blend::value_gradient) is faster. Allocates nothing.
///
/// Profiles are taken to be made for their shape (see [`Profile::new`]): the cap of a solid skeleton is ignored.
///
/// # Panics
///
/// When `values` or `gradients` is not as long as `points`.
pub fn evaluate(
    skeletons: &[Placed],
    points: &[[f64; 3]],
    values: Option<&mut [f64]>,
    gradients: Option<&mut [[f64; 3]]>,
) {
    Dispatch::best().evaluate(skeletons, points, values, gradients);
}

/// [`evaluate`] of some of the skeletons, by their positions, summed in this order.
///
/// # Panics
///
/// When `values` or `gradients` is not as long as `points`, or a position is none.
pub fn evaluate_some(
    skeletons: &[Placed],
    some: &[u32],
    points: &[[f64; 3]],
    values: Option<&mut [f64]>,
    gradients: Option<&mut [[f64; 3]]>,
) {
    Dispatch::best().run(Query { skeletons, some: Some(some), points, values, gradients });
}

/// Eight cubes with the frame's axes, and a smaller one in the middle of each.
#[derive(Clone, Copy, Debug)]
pub struct Cubes {
    /// Their middles \[m\].
    pub centers: [[f64; 3]; 8],
    /// Half the edge of all of them \[m\].
    pub half: f64,
    /// Half the edge of the smaller ones \[m\].
    pub inner: f64,
}

/// What fields can be in eight [`Cubes`].
#[derive(Clone, Debug, Default)]
pub struct Spans {
    /// At least that much is the sum of the fields in each cube.
    pub least: [f64; 8],
    /// At most that much.
    pub most: [f64; 8],
    /// At least that much is one of the fields, all over the cube.
    pub strongest: [f64; 8],
    /// For each skeleton, which cubes its field reaches: [`Spans::REACH`], [`Spans::INNER`] and [`Spans::ALL_OVER`] for
    /// the first cube, one bit to the left for the next, and so on.
    pub reach: Vec<u32>,
}

impl Spans {
    /// The field may reach the cube.
    pub const REACH: u32 = 1;
    /// The field may reach the smaller cube.
    pub const INNER: u32 = 1 << 8;
    /// The field reaches the smaller cube all over.
    pub const ALL_OVER: u32 = 1 << 16;
}

/// Bounds of the fields of some skeletons, by their positions, in eight cubes. Fields fall with distance, so bounds of
/// the distance are bounds of the field: exact ones for points, and for other shapes those that the distance's slope of
/// 1 gives. Rounding is not taken into account.
///
/// # Panics
///
/// When a position is none.
pub fn spans(skeletons: &[Placed], some: &[u32], cubes: &Cubes, out: &mut Spans) {
    out.reach.clear();
    let search = Search { skeletons, some, cubes, out };
    match Dispatch::best().0 {
        InstructionSet::Baseline => search.run::<BASELINE_WIDTH>(),
        #[cfg(target_arch = "x86_64")]
        // SAFETY: `best` makes this variant only when the processor has AVX2.
        InstructionSet::Avx2 => unsafe { spans_avx2(search) },
        #[cfg(target_arch = "x86_64")]
        // SAFETY: as above, with AVX-512F.
        InstructionSet::Avx512 => unsafe { spans_avx512(search) },
    }
}

/// An instruction set that this processor has: a value of this type is the proof that it does.
///
/// All give the same bits. To choose one is for tests and benchmarks; [`evaluate`] takes the widest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dispatch(InstructionSet);

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum InstructionSet {
    /// What the crate is compiled for.
    Baseline,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    #[cfg(target_arch = "x86_64")]
    Avx512,
}

impl Dispatch {
    /// The widest instruction set of this processor.
    pub fn best() -> Self {
        #[cfg(target_arch = "x86_64")]
        {
            if is_x86_feature_detected!("avx512f") {
                return Self(InstructionSet::Avx512);
            }
            if is_x86_feature_detected!("avx2") {
                return Self(InstructionSet::Avx2);
            }
        }
        Self(InstructionSet::Baseline)
    }

    /// Every instruction set of this processor, from the narrowest to [`Dispatch::best`].
    pub fn available() -> impl Iterator<Item = Self> {
        let baseline = std::iter::once(InstructionSet::Baseline);
        #[cfg(target_arch = "x86_64")]
        let wider = [
            is_x86_feature_detected!("avx2").then_some(InstructionSet::Avx2),
            is_x86_feature_detected!("avx512f").then_some(InstructionSet::Avx512),
        ];
        #[cfg(not(target_arch = "x86_64"))]
        let wider: [Option<InstructionSet>; 0] = [];
        baseline.chain(wider.into_iter().flatten()).map(Self)
    }

    /// "baseline", "avx2" or "avx512".
    pub fn name(self) -> &'static str {
        match self.0 {
            InstructionSet::Baseline => "baseline",
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx2 => "avx2",
            #[cfg(target_arch = "x86_64")]
            InstructionSet::Avx512 => "avx512",
        }
    }

    /// [`evaluate`] with this instruction set.
    ///
    /// # Panics
    ///
    /// When `values` or `gradients` is not as long as `points`.
    pub fn evaluate(
        self,
        skeletons: &[Placed],
        points: &[[f64; 3]],
        values: Option<&mut [f64]>,
        gradients: Option<&mut [[f64; 3]]>,
    ) {
        self.run(Query { skeletons, some: None, points, values, gradients });
    }

    fn run(self, query: Query) {
        match self.0 {
            InstructionSet::Baseline => query.run::<BASELINE_WIDTH>(),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: `best` and `available` alone make this variant, after they have seen that the processor has AVX2.
            InstructionSet::Avx2 => unsafe { run_avx2(query) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: as above, with AVX-512F.
            InstructionSet::Avx512 => unsafe { run_avx512(query) },
        }
    }
}

/// Two numbers a register: SSE2 and NEON.
const BASELINE_WIDTH: usize = 2;

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2(query: Query) {
    query.run::<4>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn run_avx512(query: Query) {
    query.run::<8>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn spans_avx2(search: Search) {
    search.run::<4>();
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f")]
fn spans_avx512(search: Search) {
    search.run::<8>();
}

/// The arguments of [`evaluate`] and [`evaluate_some`].
struct Query<'a> {
    skeletons: &'a [Placed],
    some: Option<&'a [u32]>,
    points: &'a [[f64; 3]],
    values: Option<&'a mut [f64]>,
    gradients: Option<&'a mut [[f64; 3]]>,
}

// Everything from here on is `inline(always)`: it must be compiled inside the function that enables the instructions.

impl Query<'_> {
    #[inline(always)]
    fn run<const W: usize>(self) {
        let Query { skeletons, some, points, mut values, mut gradients } = self;
        let count = some.map_or(skeletons.len(), <[u32]>::len);
        assert!(values.as_ref().is_none_or(|v| v.len() == points.len()), "values and points differ in length");
        assert!(gradients.as_ref().is_none_or(|g| g.len() == points.len()), "gradients and points differ in length");
        let mut blocks = [Block::<W>::EMPTY; CHUNK];
        for (index, points) in points.chunks(CHUNK * W).enumerate() {
            let range = index * CHUNK * W..index * CHUNK * W + points.len();
            let blocks = &mut blocks[..points.len().div_ceil(W)];
            for (block, points) in blocks.iter_mut().zip(points.chunks(W)) {
                block.load(points);
            }
            let mut falloff = Falloff::NONE;
            for index in 0..count {
                let skeleton = &skeletons[some.map_or(index, |some| some[index] as usize)];
                falloff.fit(&skeleton.profile, skeleton.shape.is_solid());
                if gradients.is_some() {
                    add::<W, true>(blocks, skeleton, &falloff);
                } else {
                    add::<W, false>(blocks, skeleton, &falloff);
                }
            }
            if let Some(values) = &mut values {
                for (block, values) in blocks.iter().zip(values[range.clone()].chunks_mut(W)) {
                    values.copy_from_slice(&block.value.0[..values.len()]);
                }
            }
            if let Some(gradients) = &mut gradients {
                for (block, gradients) in blocks.iter().zip(gradients[range].chunks_mut(W)) {
                    for (lane, gradient) in gradients.iter_mut().enumerate() {
                        *gradient = block.gradient.map(|g| g.0[lane]);
                    }
                }
            }
        }
    }
}

/// The arguments of [`spans`].
struct Search<'a> {
    skeletons: &'a [Placed],
    some: &'a [u32],
    cubes: &'a Cubes,
    out: &'a mut Spans,
}

impl Search<'_> {
    #[inline(always)]
    fn run<const W: usize>(self) {
        let Search { skeletons, some, cubes, out } = self;
        let mut blocks = [SpanBlock::<W>::EMPTY; 8];
        let blocks = &mut blocks[..8 / W];
        for (block, centers) in blocks.iter_mut().zip(cubes.centers.chunks_exact(W)) {
            for (lane, center) in centers.iter().enumerate() {
                block.center.iter_mut().zip(center).for_each(|(lanes, x)| lanes.0[lane] = *x);
            }
        }
        let mut falloff = Falloff::NONE;
        for index in some {
            let skeleton = &skeletons[*index as usize];
            falloff.fit(&skeleton.profile, skeleton.shape.is_solid());
            let reach = match &skeleton.shape {
                Shape::Point(a) => span_shape(blocks, &ToPoint(*a), &falloff, cubes),
                Shape::Segment(a, b) => span_shape(blocks, &ToSegment::new(a, b), &falloff, cubes),
                Shape::Triangle(a, b, c) => span_shape(blocks, &ToTriangle::new(a, b, c), &falloff, cubes),
                Shape::Box { center, half, axes } => {
                    span_shape(blocks, &ToBox::new(center, half, axes), &falloff, cubes)
                }
                Shape::Plane { point, normal } => {
                    span_shape(blocks, &ToPlane { point: *point, normal: *normal }, &falloff, cubes)
                }
            };
            out.reach.push(reach);
        }
        for (index, block) in blocks.iter().enumerate() {
            let lanes = index * W..(index + 1) * W;
            out.least[lanes.clone()].copy_from_slice(&block.least.0);
            out.most[lanes.clone()].copy_from_slice(&block.most.0);
            out.strongest[lanes].copy_from_slice(&block.strongest.0);
        }
    }
}

/// One register of cubes, and the bounds in them.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct SpanBlock<const W: usize> {
    center: [Lanes<W>; 3],
    least: Lanes<W>,
    most: Lanes<W>,
    strongest: Lanes<W>,
}

impl<const W: usize> SpanBlock<W> {
    const EMPTY: Self = {
        let zero = Lanes([0.0; W]);
        Self { center: [zero; 3], least: zero, most: zero, strongest: zero }
    };
}

/// Adds the bounds of one skeleton's field in each cube, and gives what it reaches, see [`Spans::reach`].
#[inline(always)]
fn span_shape<S: Distance, const W: usize>(
    blocks: &mut [SpanBlock<W>],
    shape: &S,
    falloff: &Falloff,
    cubes: &Cubes,
) -> u32 {
    let (zero, radius) = (Lanes::splat(0.0), Lanes::splat(falloff.radius));
    let square = radius * radius;
    let mut reach = 0;
    for (index, block) in blocks.iter_mut().enumerate() {
        let (near, far) = shape.span(block.center, cubes.half);
        let (near_inner, far_inner) = shape.square_span(block.center, cubes.inner);
        let least = falloff.value_slope(far, S::SOLID).0;
        block.least = block.least + least;
        block.strongest = block.strongest.max(least);
        block.most = block.most + falloff.value_slope(near, S::SOLID).0;
        // Bits as numbers, which add up exactly: comparisons stay in registers.
        let bits = |bit: u32| Lanes(std::array::from_fn(|lane| f64::from(bit << lane)));
        let sum = radius.where_greater(near, bits(Spans::REACH), zero)
            + square.where_greater(near_inner, bits(Spans::INNER), zero)
            + square.where_greater(far_inner, bits(Spans::ALL_OVER), zero);
        reach |= (sum.sum() as u32) << (index * W);
    }
    reach
}

/// Blocks that are worked on together: enough to spread the cost of a skeleton's constants, few enough to stay in the
/// first-level cache.
const CHUNK: usize = 16;

/// One register of points, and the sums at them; aligned so that no register straddles a cache line.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Block<const W: usize> {
    point: [Lanes<W>; 3],
    value: Lanes<W>,
    gradient: [Lanes<W>; 3],
    /// Carried from the first pass to the second, see [`Distance::TWO_PASSES`].
    away: Away<W>,
}

impl<const W: usize> Block<W> {
    const EMPTY: Self = {
        let zero = Lanes([0.0; W]);
        let away = Away { distance: zero, direction: [zero; 3], length: zero };
        Self { point: [zero; 3], value: zero, gradient: [zero; 3], away }
    };

    /// Takes up to `W` new points, pads them with the origin, and sets the sums to zero.
    #[inline(always)]
    fn load(&mut self, points: &[[f64; 3]]) {
        self.point = Self::EMPTY.point;
        self.value = Self::EMPTY.value;
        self.gradient = Self::EMPTY.gradient;
        for (lane, point) in points.iter().enumerate() {
            for (lanes, x) in self.point.iter_mut().zip(point) {
                lanes.0[lane] = *x;
            }
        }
    }
}

/// Adds the field of one skeleton at every point.
#[inline(always)]
fn add<const W: usize, const GRADIENT: bool>(blocks: &mut [Block<W>], skeleton: &Placed, falloff: &Falloff) {
    match &skeleton.shape {
        Shape::Point(a) => add_shape::<_, W, GRADIENT>(blocks, &ToPoint(*a), falloff),
        Shape::Segment(a, b) => add_shape::<_, W, GRADIENT>(blocks, &ToSegment::new(a, b), falloff),
        Shape::Triangle(a, b, c) => add_shape::<_, W, GRADIENT>(blocks, &ToTriangle::new(a, b, c), falloff),
        Shape::Box { center, half, axes } => {
            add_shape::<_, W, GRADIENT>(blocks, &ToBox::new(center, half, axes), falloff)
        }
        Shape::Plane { point, normal } => {
            add_shape::<_, W, GRADIENT>(blocks, &ToPlane { point: *point, normal: *normal }, falloff)
        }
    }
}

#[inline(always)]
fn add_shape<S: Distance, const W: usize, const GRADIENT: bool>(blocks: &mut [Block<W>], shape: &S, falloff: &Falloff) {
    // The fences cost nothing at run time. They keep the compiler from vectorising the loops over blocks on top of the
    // lanes, which would fill them with shuffles and halve the speed.
    if S::TWO_PASSES {
        for block in blocks.iter_mut() {
            compiler_fence(Ordering::SeqCst);
            block.away = shape.away(block.point);
        }
    }
    for block in blocks {
        compiler_fence(Ordering::SeqCst);
        let away = if S::TWO_PASSES { block.away } else { shape.away(block.point) };
        let (value, slope) = falloff.value_slope(away.distance, S::SOLID);
        block.value = block.value + value;
        if GRADIENT {
            let scale = slope * falloff.inverse_length(away.length);
            let [x, y, z] = shape.to_world(away.direction);
            let [gx, gy, gz] = block.gradient;
            block.gradient = [gx + x * scale, gy + y * scale, gz + z * scale];
        }
    }
}

/// The profile of a skeleton, ready for lanes: [`Profile::value_slope`] without branches and divisions.
///
/// With `u = clamp((R - d) / (R - t), 0, 1)` and the depth `x = max(t - d, 0)` the pieces of value and slope add up,
/// because the outer piece keeps its value and slope of the surface inside, and the inner one is zero outside:
/// `F = u² (a + b u) + x (k + bend x / 2)`, and likewise for the slope.
#[derive(Clone, Copy)]
struct Falloff {
    /// What it was made from: bodies of many skeletons often have one profile.
    profile: Profile,
    solid: bool,
    thickness: f64,
    radius: f64,
    /// `1 / (R - t)`.
    inverse_width: f64,
    /// The outer cubic: `u² (a + b u)`, and its slope `u (slope_a + slope_b u)`.
    a: f64,
    b: f64,
    slope_a: f64,
    slope_b: f64,
    /// Slope at the surface, and inside a solid core.
    stiffness: f64,
    core_stiffness: f64,
    /// What the slope gains per metre of depth, down to the skeleton.
    bend: f64,
    half_cap: f64,
    inverse_cap: f64,
}

impl Falloff {
    /// Of no profile.
    const NONE: Self = Self {
        profile: Profile { isovalue: 0.0, thickness: 0.0, stiffness: 0.0, stiffening: 0.0, radius: 0.0, cap: 0.0 },
        solid: false,
        thickness: 0.0,
        radius: 0.0,
        inverse_width: 0.0,
        a: 0.0,
        b: 0.0,
        slope_a: 0.0,
        slope_b: 0.0,
        stiffness: 0.0,
        core_stiffness: 0.0,
        bend: 0.0,
        half_cap: 0.0,
        inverse_cap: 0.0,
    };

    /// Becomes that of this profile.
    #[inline(always)]
    fn fit(&mut self, profile: &Profile, solid: bool) {
        if self.profile != *profile || self.solid != solid {
            *self = Self::new(profile, solid);
        }
    }

    #[inline(always)]
    fn new(profile: &Profile, solid: bool) -> Self {
        let &Profile { isovalue, thickness, stiffness, stiffening, radius, cap } = profile;
        let inverse_width = 1.0 / (radius - thickness);
        let kw = stiffness * (radius - thickness);
        let (a, b) = (3.0 * isovalue - kw, kw - 2.0 * isovalue);
        let cap = if solid { 0.0 } else { cap };
        Self {
            profile: *profile,
            solid,
            thickness,
            radius,
            inverse_width,
            a,
            b,
            slope_a: -2.0 * a * inverse_width,
            slope_b: -3.0 * b * inverse_width,
            stiffness,
            core_stiffness: stiffness * stiffening,
            bend: (stiffening - 1.0) * stiffness / thickness,
            half_cap: 0.5 * cap,
            inverse_cap: 1.0 / cap.max(TINY),
        }
    }

    /// `F(d)` and the slope `F'(d)`, for a shape that is solid or not, which is known when compiling; with the
    /// cap of a thin skeleton, the slope before the factor `min(d / cap, 1)`.
    #[inline(always)]
    fn value_slope<const W: usize>(&self, d: Lanes<W>, solid: bool) -> (Lanes<W>, Lanes<W>) {
        let s = Lanes::splat;
        let (zero, one) = (s(0.0), s(1.0));

        let u = ((s(self.radius) - d) * s(self.inverse_width)).clamp(zero, one);
        let outer = u * u * (s(self.a) + s(self.b) * u);
        let outer_slope = u * (s(self.slope_a) + s(self.slope_b) * u);

        let (depth, core) = if solid {
            // Below the surface of the core, at depth t, the field rises linearly.
            let depth = (s(self.thickness) - d).max(zero);
            let bent = depth.min(s(self.thickness));
            (bent, (depth - bent) * s(self.core_stiffness))
        } else {
            // The cap puts `(d²/cap + cap) / 2` in the place of d: below, with f = d/cap; beyond the cap, f = 1.
            let (half_cap, f) = (s(self.half_cap), (d * s(self.inverse_cap)).min(one));
            let capped = (d - half_cap * f) * f + half_cap;
            ((s(self.thickness) - capped).max(zero), zero)
        };
        let inner = depth * (s(self.stiffness) + s(0.5 * self.bend) * depth);
        let value = outer + inner;
        (if solid { value + core } else { value }, outer_slope - s(self.bend) * depth)
    }

    /// `min(1 / length, 1 / cap)`: what turns a slope before the cap's factor, and an offset of this length, into a
    /// gradient; finite on a thin skeleton itself, where the offset is zero.
    #[inline(always)]
    fn inverse_length<const W: usize>(&self, length: Lanes<W>) -> Lanes<W> {
        (Lanes::splat(1.0) / length).min(Lanes::splat(self.inverse_cap))
    }
}

/// Stands for a cap of no width \[m\]: its inverse is finite, and no length of importance is as short.
const TINY: f64 = 1e-150;

/// Half the diagonal of a cube over half its edge.
const SQRT_3: f64 = 1.732_050_807_568_877_3;

/// How far points are from a shape, and which way: the gradient of the distance is `direction / length`.
#[derive(Clone, Copy)]
struct Away<const W: usize> {
    distance: Lanes<W>,
    /// In the frame of the shape, see [`Distance::to_world`].
    direction: [Lanes<W>; 3],
    /// Length of `direction`, where it has one: the division is left to the caller, who can put it off.
    length: Lanes<W>,
}

/// A shape with its constants, ready for lanes: [`Shape::closest`] without branches.
trait Distance {
    /// [`Shape::is_solid`].
    const SOLID: bool;

    /// Whether all distances of a chunk are worked out before the profiles. One after the other, geometry and profile
    /// of these shapes are a chain of dependent operations too long for the processor to overlap with the next block's.
    const TWO_PASSES: bool;

    fn away<const W: usize>(&self, p: [Lanes<W>; 3]) -> Away<W>;

    /// Bounds of the distance in a cube with this middle and half this edge.
    #[inline(always)]
    fn span<const W: usize>(&self, center: [Lanes<W>; 3], half: f64) -> (Lanes<W>, Lanes<W>) {
        let (distance, radius) = (self.away(center).distance, Lanes::splat(half * SQRT_3));
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

struct ToPoint(Vec3);

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
        let (offset, half) = (sub(center, splat(&self.0)).map(Lanes::abs), Lanes::splat(half));
        let (near, far) = (offset.map(|x| (x - half).max(Lanes::splat(0.0))), offset.map(|x| x + half));
        (dot(near, near), dot(far, far))
    }
}

struct ToSegment {
    start: Vec3,
    edge: Vec3,
    /// `edge / edge²`: what an offset is multiplied with for its place along the edge, 0 to 1.
    dual: Vec3,
}

impl ToSegment {
    #[inline(always)]
    fn new(a: &Vec3, b: &Vec3) -> Self {
        let edge = b - a;
        Self { start: *a, edge, dual: edge * inverse_or_zero(edge.norm_squared()) }
    }
}

impl Distance for ToSegment {
    const SOLID: bool = false;
    const TWO_PASSES: bool = true;

    #[inline(always)]
    fn away<const W: usize>(&self, p: [Lanes<W>; 3]) -> Away<W> {
        let (offset, edge) = (sub(p, splat(&self.start)), splat(&self.edge));
        let along = dot(offset, splat(&self.dual)).clamp(Lanes::splat(0.0), Lanes::splat(1.0));
        let direction = sub(offset, edge.map(|x| x * along));
        let distance = dot(direction, direction).sqrt();
        Away { distance, direction, length: distance }
    }
}

/// A triangle in its own frame: the first corner is the origin, the longest edge points along x, the third corner lies
/// in the upper half of the xy plane. In this frame the distance is planar, and even slivers keep their directions:
/// only the tilt about the longest edge, which a sliver hardly determines, is uncertain.
struct ToTriangle {
    frame: Frame,
    /// x of the second corner.
    base: f64,
    /// The other two edges: from the second corner to the third, and from the third to the first.
    sides: [PlanarEdge; 2],
}

/// An edge in the plane.
struct PlanarEdge {
    start: [f64; 2],
    edge: [f64; 2],
    /// `1 / edge²`.
    inverse_square: f64,
}

impl PlanarEdge {
    #[inline(always)]
    fn new(start: [f64; 2], end: [f64; 2]) -> Self {
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
    fn new(a: &Vec3, b: &Vec3, c: &Vec3) -> Self {
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
    fn to_world<const W: usize>(&self, direction: [Lanes<W>; 3]) -> [Lanes<W>; 3] {
        self.frame.to_world(direction)
    }
}

struct ToBox {
    frame: Frame,
    half: Vec3,
}

impl ToBox {
    #[inline(always)]
    fn new(center: &Vec3, half: &Vec3, axes: &Mat3) -> Self {
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

struct ToPlane {
    point: Vec3,
    normal: Vec3,
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
struct Frame {
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

/// One number for each of `W` points.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lanes<const W: usize>(pub [f64; W]);

impl<const W: usize> Lanes<W> {
    #[inline(always)]
    pub fn splat(x: f64) -> Self {
        Self([x; W])
    }

    #[inline(always)]
    pub fn zip(self, other: Self, operation: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| operation(self.0[i], other.0[i])))
    }

    /// `yes` where `self > other`, else `no` (also where either is not a number).
    #[inline(always)]
    pub fn where_greater(self, other: Self, yes: Self, no: Self) -> Self {
        Self(std::array::from_fn(|i| if self.0[i] > other.0[i] { yes.0[i] } else { no.0[i] }))
    }

    #[inline(always)]
    pub fn where_less(self, other: Self, yes: Self, no: Self) -> Self {
        other.where_greater(self, yes, no)
    }

    // Unlike those of `f64`, these are one instruction each; where `self` is not a number, it stays so.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |x, y| if y > x { y } else { x })
    }

    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |x, y| if y < x { y } else { x })
    }

    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(self.0.map(f64::sqrt))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.map(f64::abs))
    }

    /// Of all lanes, halves first.
    #[inline(always)]
    pub fn sum(mut self) -> f64 {
        let mut width = W;
        while width > 1 {
            width /= 2;
            for lane in 0..width {
                self.0[lane] += self.0[lane + width];
            }
        }
        self.0[0]
    }
}

macro_rules! lane_operators {
    ($($operator:ident $method:ident),*) => {$(
        impl<const W: usize> $operator for Lanes<W> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                self.zip(other, f64::$method)
            }
        }
    )*};
}
lane_operators!(Add add, Sub sub, Mul mul, Div div);

#[inline(always)]
fn splat<const W: usize>(v: &Vec3) -> [Lanes<W>; 3] {
    [Lanes::splat(v.x), Lanes::splat(v.y), Lanes::splat(v.z)]
}

#[inline(always)]
fn sub<const W: usize>(a: [Lanes<W>; 3], b: [Lanes<W>; 3]) -> [Lanes<W>; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn dot<const W: usize>(a: [Lanes<W>; 3], b: [Lanes<W>; 3]) -> Lanes<W> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Graph, blend};
    use crate::math::rotation_from_vector;
    use proptest::prelude::*;

    /// Half the edge of the cube in which skeletons and points lie \[m\].
    const SIZE: f64 = 2.0;

    fn vectors(size: f64) -> impl Strategy<Value = Vec3> {
        (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    fn shapes() -> impl Strategy<Value = Shape> {
        let corners = (vectors(SIZE), vectors(SIZE), vectors(SIZE));
        prop_oneof![
            vectors(SIZE).prop_map(Shape::Point),
            (vectors(SIZE), vectors(SIZE)).prop_map(|(a, b)| Shape::segment(a, b)),
            // Where the closest point of a sliver lies is lost in rounding, here and in the scalar code.
            corners.prop_filter_map("a sliver", |(a, b, c)| {
                let longest = (b - a).norm_squared().max((c - a).norm_squared()).max((c - b).norm_squared());
                ((b - a).cross(&(c - a)).norm() > 0.05 * longest).then_some(Shape::Triangle(a, b, c))
            }),
            (vectors(SIZE), vectors(1.0), vectors(3.0)).prop_map(|(center, half, turn)| Shape::Box {
                center,
                half: half.map(|x| 0.1 + x.abs()),
                axes: *rotation_from_vector(&turn).to_rotation_matrix().matrix(),
            }),
            (vectors(SIZE), vectors(1.0)).prop_filter_map("no normal", |(p, n)| Shape::plane(p, n).ok()),
        ]
    }

    fn skeletons() -> impl Strategy<Value = Placed> {
        let stiffening = prop_oneof![Just(1.0), Just(0.0), 0.0..20.0f64];
        (shapes(), 0.1..10.0f64, 0.05..1.0f64, 0.05..3.0f64, stiffening, 0.2..4.0f64).prop_map(
            |(shape, c, t, q, stiffening, width)| {
                let radius = t * (1.0 + width);
                let profile = Profile::new(c, t, q * c / (radius - t), stiffening, radius, shape.is_solid()).unwrap();
                Placed { shape, profile }
            },
        )
    }

    /// Round-off in field value and gradient of one skeleton: that of a distance, times the slope, and times the
    /// largest curvature of the field.
    fn tolerance(placed: &Placed) -> (f64, f64) {
        let Profile { isovalue, thickness, radius, cap, .. } = placed.profile;
        let shortest = thickness.min(radius - thickness).min(if cap > 0.0 { cap } else { thickness });
        let unit = 1e-13 * placed.profile.lipschitz();
        (1e-13 * isovalue + unit * SIZE, unit * (1.0 + 0.1 * SIZE / shortest))
    }

    fn sums(dispatch: Dispatch, skeletons: &[Placed], points: &[[f64; 3]]) -> (Vec<f64>, Vec<[f64; 3]>) {
        let (mut values, mut gradients) = (vec![f64::NAN; points.len()], vec![[f64::NAN; 3]; points.len()]);
        dispatch.evaluate(skeletons, points, Some(&mut values), Some(&mut gradients));
        (values, gradients)
    }

    /// The bits of values and gradients, with lanes of any width.
    fn bits_at_width<const W: usize>(skeletons: &[Placed], points: &[[f64; 3]]) -> Vec<u64> {
        let (mut values, mut gradients) = (vec![f64::NAN; points.len()], vec![[f64::NAN; 3]; points.len()]);
        Query { skeletons, some: None, points, values: Some(&mut values), gradients: Some(&mut gradients) }.run::<W>();
        bits(&values, &gradients)
    }

    fn bits(values: &[f64], gradients: &[[f64; 3]]) -> Vec<u64> {
        values.iter().chain(gradients.as_flattened()).map(|x| x.to_bits()).collect()
    }

    proptest! {
        #[test]
        fn lanes_agree_with_the_scalar_field_to_round_off(
            skeletons in prop::collection::vec(skeletons(), 0..6),
            points in prop::collection::vec(vectors(1.5 * SIZE), 1..40),
        ) {
            let arrays: Vec<[f64; 3]> = points.iter().map(|&p| p.into()).collect();
            let (values, gradients) = sums(Dispatch::best(), &skeletons, &arrays);
            let (value_error, gradient_error) = skeletons
                .iter()
                .map(tolerance)
                .fold((0.0, 0.0), |sum, error| (sum.0 + error.0, sum.1 + error.1));
            for ((p, value), gradient) in points.iter().zip(values).zip(gradients) {
                let (expected, slope) = blend::value_gradient(&skeletons, &Graph::default(), p);
                prop_assert!((value - expected).abs() <= value_error, "{value} {expected}");
                prop_assert!((Vec3::from(gradient) - slope).norm() <= gradient_error, "{gradient:?} {slope}");
            }
        }

        #[test]
        fn lanes_agree_with_the_scalar_field_on_and_near_a_skeleton(
            placed in skeletons(), q in vectors(2.0 * SIZE), away in vectors(1.0), exponent in -17..0i32,
        ) {
            let on = placed.shape.closest_point(&q);
            let points = [on, on + away * 10.0_f64.powi(exponent)];
            let (values, gradients) = sums(Dispatch::best(), &[placed], &points.map(Into::into));
            let (value_error, gradient_error) = tolerance(&placed);
            for ((p, value), gradient) in points.iter().zip(values).zip(gradients) {
                let (expected, slope) = placed.value_gradient(p);
                prop_assert!((value - expected).abs() <= value_error, "{value} {expected}");
                // On a solid's edge rounding decides which way is out, and with it the whole gradient.
                let kink = placed.shape.is_solid() && exponent < -1;
                let error = (Vec3::from(gradient) - slope).norm();
                prop_assert!(kink || error <= gradient_error, "{gradient:?} {slope}");
                prop_assert!(Vec3::from(gradient).norm() <= placed.profile.lipschitz() * (1.0 + 1e-12));
            }
        }

        #[test]
        fn every_width_and_instruction_set_gives_the_same_bits(
            skeletons in prop::collection::vec(skeletons(), 0..6),
            points in prop::collection::vec(vectors(1.5 * SIZE), 0..300),
        ) {
            let points: Vec<[f64; 3]> = points.into_iter().map(Into::into).collect();
            let one = bits_at_width::<1>(&skeletons, &points);
            prop_assert_eq!(&one, &bits_at_width::<2>(&skeletons, &points));
            prop_assert_eq!(&one, &bits_at_width::<4>(&skeletons, &points));
            prop_assert_eq!(&one, &bits_at_width::<8>(&skeletons, &points));
            prop_assert_eq!(&one, &bits_at_width::<16>(&skeletons, &points));
            for dispatch in Dispatch::available() {
                let (values, gradients) = sums(dispatch, &skeletons, &points);
                prop_assert_eq!(&one, &bits(&values, &gradients), "{}", dispatch.name());
                // Nor does it matter what else is asked for, and with which other points.
                let (mut only_values, mut only_gradients) = (values.clone(), gradients.clone());
                only_values.fill(f64::NAN);
                only_gradients.fill([f64::NAN; 3]);
                dispatch.evaluate(&skeletons, &points, Some(&mut only_values), None);
                dispatch.evaluate(&skeletons, &points, None, Some(&mut only_gradients));
                prop_assert_eq!(&one, &bits(&only_values, &only_gradients), "{}", dispatch.name());
                if let Some((last, rest)) = points.split_last() {
                    let (value, gradient) = sums(dispatch, &skeletons, &[*last]);
                    prop_assert_eq!(bits(&value, &gradient), bits(&values[rest.len()..], &gradients[rest.len()..]));
                }
            }
        }
    }

    proptest! {
        #[test]
        fn some_skeletons_give_the_bits_of_a_list_of_them(
            skeletons in prop::collection::vec(skeletons(), 1..6),
            points in prop::collection::vec(vectors(1.5 * SIZE), 1..40),
        ) {
            let points: Vec<[f64; 3]> = points.into_iter().map(Into::into).collect();
            let some: Vec<u32> = (0..skeletons.len() as u32).rev().step_by(2).collect();
            let list: Vec<Placed> = some.iter().map(|index| skeletons[*index as usize]).collect();
            let (values, gradients) = sums(Dispatch::best(), &list, &points);
            let (mut others, mut slopes) = (values.clone(), gradients.clone());
            others.fill(f64::NAN);
            evaluate_some(&skeletons, &some, &points, Some(&mut others), Some(&mut slopes));
            prop_assert_eq!(bits(&values, &gradients), bits(&others, &slopes));
        }

        #[test]
        fn fields_keep_to_their_bounds_in_cubes(
            skeletons in prop::collection::vec(skeletons(), 1..6), center in vectors(SIZE), half in 0.01..1.0f64,
            places in prop::collection::vec(vectors(1.0), 10),
        ) {
            let all: Vec<u32> = (0..skeletons.len() as u32).collect();
            let centers = std::array::from_fn(|k| [center.x + 0.3 * k as f64, center.y, center.z]);
            let cubes = Cubes { centers, half, inner: 0.5 * half };
            let mut spans = Spans::default();
            super::spans(&skeletons, &all, &cubes, &mut spans);
            let slack = 1e-9 * skeletons.iter().map(|k| k.profile.peak() + SIZE * k.profile.lipschitz()).sum::<f64>();
            for (k, cube) in centers.iter().enumerate() {
                for place in &places {
                    let p = Vec3::from(*cube) + place * half;
                    let fields: Vec<f64> = skeletons.iter().map(|s| s.value(&p)).collect();
                    let (sum, largest) = (fields.iter().sum::<f64>(), fields.iter().fold(0.0, |x, y| f64::max(x, *y)));
                    prop_assert!(spans.least[k] <= sum + slack && sum <= spans.most[k] + slack);
                    prop_assert!(spans.strongest[k] <= largest + slack);
                    for (field, reach) in fields.iter().zip(&spans.reach) {
                        prop_assert!(*field <= slack || reach >> k & Spans::REACH != 0);
                    }
                    let inner = Vec3::from(centers[k]) + place * (0.5 * half);
                    for (skeleton, reach) in skeletons.iter().zip(&spans.reach) {
                        prop_assert!(skeleton.value(&inner) <= slack || reach >> k & Spans::INNER != 0);
                    }
                }
            }
        }
    }

    #[test]
    fn at_a_thin_skeleton_the_field_peaks_and_has_no_gradient() {
        let [a, b, c] = [Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
        for shape in [Shape::Point(a), Shape::Segment(a, b), Shape::Triangle(a, b, c)] {
            for solid in [false, true] {
                // The second profile has no cap, which nobody should give to a thin skeleton.
                let profile = Profile::new(1.0, 0.3, 0.0, 2.5, 0.7, solid).unwrap();
                for dispatch in Dispatch::available() {
                    let (values, gradients) = sums(dispatch, &[Placed { shape, profile }], &[a.into()]);
                    assert!((values[0] - profile.peak()).abs() < 1e-15 * profile.peak(), "{shape:?}");
                    assert_eq!(Vec3::from(gradients[0]), Vec3::zeros(), "{shape:?}");
                }
            }
        }
    }

    #[test]
    fn shapes_that_rounding_has_collapsed_act_as_what_is_left() {
        let (a, b) = (Vec3::new(1.0, 2.0, 3.0), Vec3::new(2.0, 2.0, 3.0));
        let profile = Profile::new(1.0, 0.3, 0.0, 2.5, 4.0, false).unwrap();
        let pairs = [
            (Shape::Segment(a, a), Shape::Point(a)),
            (Shape::Triangle(a, b, a), Shape::Segment(a, b)),
            (Shape::Triangle(a, b, (a + b) * 0.5), Shape::Segment(a, b)),
            (Shape::Triangle(a, a, a), Shape::Point(a)),
        ];
        for (collapsed, left) in pairs {
            let points = [[1.3, 2.2, 3.1], [0.0, 1.0, 2.5], a.into()];
            let (values, gradients) = sums(Dispatch::best(), &[Placed { shape: collapsed, profile }], &points);
            for ((p, value), gradient) in points.into_iter().zip(values).zip(gradients) {
                let expected = Placed { shape: left, profile }.value_gradient(&Vec3::from(p));
                assert!((value - expected.0).abs() < 1e-14, "{collapsed:?} {value} {expected:?}");
                assert!((Vec3::from(gradient) - expected.1).norm() < 1e-13, "{collapsed:?} {gradient:?} {expected:?}");
            }
        }
    }

    #[test]
    fn a_point_that_is_no_number_stays_so_and_alone() {
        let profile = Profile::new(1.0, 0.3, 0.0, 2.5, 0.7, false).unwrap();
        let skeletons = [Placed { shape: Shape::Segment(Vec3::zeros(), Vec3::x()), profile }];
        let good = [0.1, 0.2, 0.3];
        let (values, _) = sums(Dispatch::best(), &skeletons, &[good, [f64::NAN, 0.0, 0.0], good]);
        assert!(values[1].is_nan());
        assert!(values[0] > 0.0 && values[0] == values[2]);
    }

    #[test]
    #[should_panic(expected = "values and points differ in length")]
    fn too_short_an_output_is_refused() {
        evaluate(&[], &[[0.0; 3]; 2], Some(&mut [0.0]), None);
    }
}
