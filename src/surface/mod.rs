//! The surface of a coat as others see it: [`ray`] finds where a ray meets it, [`closest`] where it is nearest,
//! [`deformed`] does both for a coat that others press on, [`mesh`] and [`patches`] show it, [`nearby`] says whose a point is, [`skin`] hangs a host's mesh
//! on it, and [`fit`] finds a coat whose surface comes close to a mesh.

pub mod closest;
pub mod deformed;
pub mod fit;
pub mod mesh;
pub mod nearby;
pub mod patches;
pub mod prepared;
pub mod ray;
pub mod skin;
pub mod tree;

use crate::math::Vec3;

/// A point of a coat's surface, in the frame of the coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// For rays: length of the ray up to here. For closest points: signed distance, negative inside \[m\].
    pub distance: f64,
    /// Where \[m\].
    pub position: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// Index of the skeleton in whose territory it lies.
    pub skeleton: usize,
}
