//! Fields: what a skeleton emits, and how a body's skeletons add up.
//!
//! A skeleton's field is `F(d)`, a [`Profile`] of the distance `d` to a [`Shape`]; a body's field is the sum over its
//! skeletons \[97, eq. (1)-(2)\]. The solid is where the field is at least the isovalue.

pub mod blend;
pub mod graph;
pub mod lanes;
pub mod profile;
pub mod separation;
pub mod skeleton;

pub use graph::Graph;
pub use profile::{Outer, Profile};
pub use skeleton::{Placed, Shape};
