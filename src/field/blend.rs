//! Blending: how the fields of a body's skeletons become one field.
//!
//! Today every skeleton of a body blends with every other: the field is their sum \[97, eq. (1)\]. This module is the
//! only place that knows, so a graph of who blends with whom belongs here.

use super::skeleton::Placed;
use crate::math::{Mat3, Vec3};

/// Field value and gradient of all skeletons together.
#[inline]
pub fn value_gradient(skeletons: &[Placed], p: &Vec3) -> (f64, Vec3) {
    let mut sum = (0.0, Vec3::zeros());
    for skeleton in skeletons {
        let (value, gradient) = skeleton.value_gradient(p);
        sum.0 += value;
        sum.1 += gradient;
    }
    sum
}

/// Field value, gradient and Hessian of all skeletons together.
pub fn value_gradient_hessian(skeletons: &[Placed], p: &Vec3) -> (f64, Vec3, Mat3) {
    let mut sum = (0.0, Vec3::zeros(), Mat3::zeros());
    for skeleton in skeletons {
        let (value, gradient, hessian) = skeleton.value_gradient_hessian(p);
        sum.0 += value;
        sum.1 += gradient;
        sum.2 += hessian;
    }
    sum
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

/// How far from a skeleton the body's surface can lie when `count` skeletons of the body may add up: somewhere on the
/// surface one of them must still carry its share of the isovalue.
pub fn reach(skeleton: &super::Profile, count: usize) -> f64 {
    skeleton.distance_of_level(skeleton.isovalue / count.max(1) as f64)
}
