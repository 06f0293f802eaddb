//! Bounds of fields in cubes, eight cubes at once.

use super::distance::{Distance, ToBox, ToPlane, ToPoint, ToSegment, ToTriangle};
use super::falloff::Falloff;
use super::vector::Lanes;
use super::{Dispatch, Kernel};
use crate::field::{Placed, Shape};

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
    Dispatch::best().run(Search { skeletons, some, cubes, out });
}

/// The arguments of [`spans`].
struct Search<'a> {
    skeletons: &'a [Placed],
    some: &'a [u32],
    cubes: &'a Cubes,
    out: &'a mut Spans,
}

impl Kernel for Search<'_> {
    type Output = ();

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
    let radius = Lanes::splat(falloff.radius);
    let square = radius * radius;
    let mut reach = 0;
    for (index, block) in blocks.iter_mut().enumerate() {
        let (near, far) = shape.span(block.center, cubes.half);
        let (near_inner, far_inner) = shape.square_span(block.center, cubes.inner);
        let least = falloff.value_slope(far, S::SOLID).0;
        block.least = block.least + least;
        block.strongest = block.strongest.max(least);
        block.most = block.most + falloff.value_slope(near, S::SOLID).0;
        let bits = (Spans::REACH * near.bits_where_less(radius))
            | (Spans::INNER * near_inner.bits_where_less(square))
            | (Spans::ALL_OVER * far_inner.bits_where_less(square));
        reach |= bits << (index * W);
    }
    reach
}
