//! Blending: how the fields of a body's skeletons become one field.
//!
//! Without a graph, every skeleton of a body blends with every other: the field is their sum \[97, eq. (1)\]. With one,
//! [`Graph`] says how fields go together; this module is the only place that asks.

use std::cell::RefCell;

use super::graph::{Active, Graph, Order, Workspace};
use super::lanes;
use super::skeleton::Placed;
use crate::math::{Mat3, Vec3};

/// Working memory of a thread that evaluates grouped fields.
#[derive(Default)]
struct Scratch {
    active: Vec<Active>,
    gradients: Vec<Vec3>,
    hessians: Vec<Mat3>,
    work: Workspace,
    /// At each point of a chunk, the skeletons that have a field there, and their gradients.
    lists: Vec<(Vec<Active>, Vec<[f64; 3]>)>,
}

thread_local! {
    static SCRATCH: RefCell<Scratch> = RefCell::default();
}

/// Tells `part` which of some skeletons, given with their positions, make the field at a point, and how much of it each:
/// `f_i ∂f/∂f_i`. The others' fields are zero there.
pub fn parts<'a>(
    graph: &Graph,
    some: impl Iterator<Item = (usize, &'a Placed)>,
    p: &Vec3,
    mut part: impl FnMut(usize, f64),
) {
    let fields = some.map(|(index, skeleton)| (index, skeleton.value(p)));
    let mut fields = fields.filter(|(_, value)| *value != 0.0);
    if graph.is_complete() {
        return fields.for_each(|(index, value)| part(index, value));
    }
    SCRATCH.with_borrow_mut(|Scratch { active, work, .. }| {
        active.clear();
        active.extend(&mut fields);
        graph.combine(active, Order::Slopes, work);
        for ((index, value), slope) in active.iter().zip(&work.slopes) {
            if *slope > 0.0 {
                part(*index, value * slope);
            }
        }
    });
}

/// Field value of all skeletons together.
pub fn value(skeletons: &[Placed], graph: &Graph, p: &Vec3) -> f64 {
    let each = skeletons.iter().enumerate().map(|(index, skeleton)| (index, skeleton.value(p)));
    together(graph, each)
}

/// What the fields of some skeletons come to, given by their positions and values: the others' are zero.
pub fn together(graph: &Graph, fields: impl Iterator<Item = (usize, f64)>) -> f64 {
    if graph.is_complete() {
        return fields.map(|(_, value)| value).sum();
    }
    SCRATCH.with_borrow_mut(|Scratch { active, work, .. }| {
        active.clear();
        active.extend(fields.filter(|(_, value)| *value != 0.0));
        graph.combine(active, Order::Value, work)
    })
}

/// Field value and gradient of all skeletons together.
#[inline]
pub fn value_gradient(skeletons: &[Placed], graph: &Graph, p: &Vec3) -> (f64, Vec3) {
    value_gradient_of(graph, skeletons.iter().enumerate(), p)
}

/// The same of some skeletons, given with their positions: the others' fields are zero at the point.
#[inline]
pub fn value_gradient_of<'a>(graph: &Graph, some: impl Iterator<Item = (usize, &'a Placed)>, p: &Vec3) -> (f64, Vec3) {
    if !graph.is_complete() {
        return grouped_gradient(some, graph, p);
    }
    let mut sum = (0.0, Vec3::zeros());
    for (_, skeleton) in some {
        let (value, gradient) = skeleton.value_gradient(p);
        sum.0 += value;
        sum.1 += gradient;
    }
    sum
}

#[inline(never)]
fn grouped_gradient<'a>(some: impl Iterator<Item = (usize, &'a Placed)>, graph: &Graph, p: &Vec3) -> (f64, Vec3) {
    SCRATCH.with_borrow_mut(|Scratch { active, gradients, work, .. }| {
        active.clear();
        gradients.clear();
        for (index, skeleton) in some {
            let (value, gradient) = skeleton.value_gradient(p);
            if value != 0.0 {
                active.push((index, value));
                gradients.push(gradient);
            }
        }
        let value = graph.combine(active, Order::Slopes, work);
        (value, gradients.iter().zip(&work.slopes).map(|(gradient, slope)| gradient * *slope).sum())
    })
}

/// Points of [`evaluate`] that are worked on together.
const CHUNK: usize = 64;

/// Field values and gradients of all skeletons together at many points, as [`lanes::evaluate`] gives them where all add
/// up: same input, same bits, for any grouping of the points into calls.
///
/// # Panics
///
/// When `values` or `gradients` is not as long as `points`.
pub fn evaluate(
    skeletons: &[Placed],
    graph: &Graph,
    points: &[[f64; 3]],
    mut values: Option<&mut [f64]>,
    mut gradients: Option<&mut [[f64; 3]]>,
) {
    if graph.is_complete() {
        return lanes::evaluate(skeletons, points, values, gradients);
    }
    let order = if gradients.is_some() { Order::Slopes } else { Order::Value };
    let (mut fields, mut slopes) = ([0.0; CHUNK], [[0.0; 3]; CHUNK]);
    SCRATCH.with_borrow_mut(|Scratch { work, lists, .. }| {
        lists.resize_with(CHUNK, Default::default);
        for (index, chunk) in points.chunks(CHUNK).enumerate() {
            lists.iter_mut().for_each(|(active, slopes)| (active.clear(), slopes.clear()).1);
            let (fields, slopes) = (&mut fields[..chunk.len()], &mut slopes[..chunk.len()]);
            for (index, skeleton) in skeletons.iter().enumerate() {
                let wanted = (order == Order::Slopes).then_some(&mut *slopes);
                lanes::evaluate(std::slice::from_ref(skeleton), chunk, Some(fields), wanted);
                for ((field, slope), list) in fields.iter().zip(&*slopes).zip(&mut *lists) {
                    if *field != 0.0 {
                        list.0.push((index, *field));
                        list.1.push(*slope);
                    }
                }
            }
            for (point, (active, slopes)) in (index * CHUNK..).zip(&lists[..chunk.len()]) {
                let value = graph.combine(active, order, work);
                if let Some(values) = &mut values {
                    values[point] = value;
                }
                if let Some(gradients) = &mut gradients {
                    let each = slopes.iter().zip(&work.slopes).map(|(slope, by)| Vec3::from(*slope) * *by);
                    gradients[point] = each.sum::<Vec3>().into();
                }
            }
        }
    });
}

/// Field value, gradient and Hessian of all skeletons together.
pub fn value_gradient_hessian(skeletons: &[Placed], graph: &Graph, p: &Vec3) -> (f64, Vec3, Mat3) {
    value_gradient_hessian_of(graph, skeletons.iter().enumerate(), p)
}

/// The same of some skeletons, given with their positions: the others' fields are zero at the point.
pub fn value_gradient_hessian_of<'a>(
    graph: &Graph,
    some: impl Iterator<Item = (usize, &'a Placed)>,
    p: &Vec3,
) -> (f64, Vec3, Mat3) {
    if !graph.is_complete() {
        return grouped_hessian(some, graph, p);
    }
    let mut sum = (0.0, Vec3::zeros(), Mat3::zeros());
    for (_, skeleton) in some {
        let (value, gradient, hessian) = skeleton.value_gradient_hessian(p);
        sum.0 += value;
        sum.1 += gradient;
        sum.2 += hessian;
    }
    sum
}

fn grouped_hessian<'a>(some: impl Iterator<Item = (usize, &'a Placed)>, graph: &Graph, p: &Vec3) -> (f64, Vec3, Mat3) {
    SCRATCH.with_borrow_mut(|Scratch { active, gradients, hessians, work, .. }| {
        active.clear();
        gradients.clear();
        hessians.clear();
        for (index, skeleton) in some {
            let (value, gradient, hessian) = skeleton.value_gradient_hessian(p);
            if value != 0.0 {
                active.push((index, value));
                gradients.push(gradient);
                hessians.push(hessian);
            }
        }
        let mut sum = (graph.combine(active, Order::Bends, work), Vec3::zeros(), Mat3::zeros());
        for ((gradient, hessian), slope) in gradients.iter().zip(&*hessians).zip(&work.slopes) {
            sum.1 += gradient * *slope;
            sum.2 += hessian * *slope;
        }
        for (at, bend) in work.bends.iter().enumerate().filter(|(_, bend)| **bend != 0.0) {
            let (i, j) = (at / active.len(), at % active.len());
            sum.2 += gradients[i] * gradients[j].transpose() * *bend;
        }
        sum
    })
}

/// The skeleton whose field is the highest at a point: its territory contains the point \[97, eq. (21)\].
pub fn territory(skeletons: &[Placed], p: &Vec3) -> usize {
    let mut best = (0, f64::NEG_INFINITY);
    for (index, skeleton) in skeletons.iter().enumerate() {
        let value = skeleton.value(p);
        if value > best.1 {
            best = (index, value);
        }
    }
    best.0
}

/// How far from a skeleton the body's surface can lie when `count` skeletons of the body may add up, and their field be
/// above the sum by `rise`: somewhere on the surface one of them must still carry its share of the isovalue.
pub fn reach(skeleton: &super::Profile, count: usize, rise: f64) -> f64 {
    skeleton.distance_of_level((skeleton.isovalue - rise) / count.max(1) as f64)
}
