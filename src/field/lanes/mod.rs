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
//! - `Query` and [`Dispatch`]: the loops as a `Kernel`, compiled once for each instruction set, and the choice among them.
//!
//! The scalar twin, and the reference in the tests, is [`blend::value_gradient`](super::blend::value_gradient): it
//! agrees to round-off, not in its bits, because divisions by a skeleton's constants are multiplications here.

use std::mem::MaybeUninit;
use std::sync::atomic::{Ordering, compiler_fence};

mod dispatch;
mod distance;
mod falloff;
mod spans;
mod vector;

use super::{Placed, Shape};
pub use dispatch::Dispatch;
pub(crate) use dispatch::Kernel;
use distance::{Away, Distance, ToBox, ToPlane, ToPoint, ToSegment, ToTriangle};
use falloff::Falloff;
pub use spans::{Cubes, Spans, spans};
pub(crate) use vector::Lanes;

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
/// Profiles are taken to be made for their shape (see [`Profile::new`](crate::field::Profile::new)): the cap of a solid skeleton is ignored.
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

/// The arguments of [`evaluate`] and [`evaluate_some`].
struct Query<'a> {
    skeletons: &'a [Placed],
    some: Option<&'a [u32]>,
    points: &'a [[f64; 3]],
    values: Option<&'a mut [f64]>,
    gradients: Option<&'a mut [[f64; 3]]>,
}

// Everything from here on is `inline(always)`: it must be compiled inside the function that enables the instructions.

impl Kernel for Query<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const W: usize>(self) {
        let Query { skeletons, some, points, mut values, mut gradients } = self;
        let count = some.map_or(skeletons.len(), <[u32]>::len);
        assert!(values.as_ref().is_none_or(|v| v.len() == points.len()), "values and points differ in length");
        assert!(gradients.as_ref().is_none_or(|g| g.len() == points.len()), "gradients and points differ in length");
        // Only what is used is written: to clear it all would cost as much as the fields of some skeletons.
        let mut room = [const { MaybeUninit::<Block<W>>::uninit() }; CHUNK];
        for (index, points) in points.chunks(CHUNK * W).enumerate() {
            let range = index * CHUNK * W..index * CHUNK * W + points.len();
            let room = &mut room[..points.len().div_ceil(W)];
            for (place, points) in room.iter_mut().zip(points.chunks(W)) {
                place.write(Block::new(points));
            }
            // SAFETY: each was written just now: there are as many as there are registers of points.
            let blocks = unsafe { std::slice::from_raw_parts_mut(room.as_mut_ptr().cast::<Block<W>>(), room.len()) };
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
    /// Up to `W` points, padded with the origin, and no sums yet.
    #[inline(always)]
    fn new(points: &[[f64; 3]]) -> Self {
        let zero = Lanes([0.0; W]);
        let away = Away { distance: zero, direction: [zero; 3], length: zero };
        let mut block = Self { point: [zero; 3], value: zero, gradient: [zero; 3], away };
        for (lane, point) in points.iter().enumerate() {
            for (lanes, x) in block.point.iter_mut().zip(point) {
                lanes.0[lane] = *x;
            }
        }
        block
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
            if GRADIENT {
                block.away = shape.away(block.point);
            } else {
                block.away.distance = shape.distance(block.point);
            }
        }
    }
    for block in blocks {
        compiler_fence(Ordering::SeqCst);
        if !GRADIENT {
            let distance = if S::TWO_PASSES { block.away.distance } else { shape.distance(block.point) };
            block.value = block.value + falloff.value_slope(distance, S::SOLID).0;
        } else {
            let away = if S::TWO_PASSES { block.away } else { shape.away(block.point) };
            let (value, slope) = falloff.value_slope(away.distance, S::SOLID);
            block.value = block.value + value;
            let scale = slope * falloff.inverse_length(away.length);
            let [x, y, z] = shape.to_world(away.direction);
            let [gx, gy, gz] = block.gradient;
            block.gradient = [gx + x * scale, gy + y * scale, gz + z * scale];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::skeleton::tests::vectors;
    use crate::field::{Graph, Profile, blend};
    use crate::math::{Vec3, rotation_from_vector};
    use proptest::prelude::*;

    /// Half the edge of the cube in which skeletons and points lie \[m\].
    const SIZE: f64 = 2.0;

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
