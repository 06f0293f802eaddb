//! The coat: the implicit layer of one body, in one frame.
//!
//! [`cliques`] turns who blends with whom into groups of skeletons that add up, and pairs of groups that collide.
//! [`seeds`] sends fixed rays from each skeleton; [`territory`] follows them to the coat's surface or to the border of
//! another skeleton's territory; [`volume`] measures what they enclose, and keeps it.

pub mod cliques;
pub mod root;
pub mod seeds;
pub mod territory;
pub mod volume;

use crate::field::{Graph, Placed, Profile, Shape, blend};
use crate::math::{Pose, Vec3};

/// The skeletons of one body, how they blend, and the isovalue of the surface: the solid is where the field is at least
/// the isovalue.
///
/// Everything is in a frame with the world's axes whose origin the caller chooses near the body, so that a body keeps
/// its digits however far it is from the origin of the world.
#[derive(Clone, Debug, Default)]
pub struct Coat {
    /// Where the frame's origin is in the world \[m\].
    pub origin: Vec3,
    /// Field value on the surface.
    pub isovalue: f64,
    /// The skeletons, in the frame.
    pub skeletons: Vec<Placed>,
    /// How their fields go together.
    pub graph: Graph,
}

impl Coat {
    /// A coat without skeletons.
    pub fn new(origin: Vec3, isovalue: f64) -> Self {
        Self { origin, isovalue, ..Self::default() }
    }

    /// Adds a skeleton of a link: `shape` in the link's frame, `pose` of the link in the world.
    pub fn add(&mut self, shape: &Shape, profile: Profile, pose: &Pose) {
        self.skeletons.push(Placed { shape: shape.transformed(&self.localise(pose)), profile });
    }

    /// A pose of the world in the coat's frame.
    pub fn localise(&self, pose: &Pose) -> Pose {
        Pose { position: pose.position - self.origin, rotation: pose.rotation }
    }

    /// The coat of some of the skeletons, by their positions.
    pub fn subset(&self, positions: &[u32]) -> Coat {
        let mut out = Coat::default();
        self.subset_into(positions, &mut out);
        out
    }

    /// [`Coat::subset`] in place of another coat, in its memory.
    pub fn subset_into(&self, positions: &[u32], out: &mut Coat) {
        (out.origin, out.isovalue) = (self.origin, self.isovalue);
        out.skeletons.clear();
        out.skeletons.extend(positions.iter().map(|position| self.skeletons[*position as usize]));
        if self.graph.is_complete() {
            out.graph.clear();
        } else {
            self.graph.restrict(positions, &mut out.graph);
        }
    }

    /// How far the field is above the isovalue at a point of the frame: not negative inside the solid.
    pub fn excess(&self, p: &Vec3) -> f64 {
        blend::value(&self.skeletons, &self.graph, p) - self.isovalue
    }

    /// The excess and the field's gradient at a point of the frame.
    pub fn excess_gradient(&self, p: &Vec3) -> (f64, Vec3) {
        let (value, gradient) = blend::value_gradient(&self.skeletons, &self.graph, p);
        (value - self.isovalue, gradient)
    }

    /// Field values and gradients at many points of the frame; see [`blend::evaluate`].
    ///
    /// # Panics
    ///
    /// When `values` or `gradients` is not as long as `points`.
    pub fn evaluate(&self, points: &[[f64; 3]], values: Option<&mut [f64]>, gradients: Option<&mut [[f64; 3]]>) {
        blend::evaluate(&self.skeletons, &self.graph, points, values, gradients);
    }

    /// Outward unit normal of the level surface through a point of the frame; `fallback` where the field is flat.
    pub fn normal(&self, p: &Vec3, fallback: &Vec3) -> Vec3 {
        (-blend::value_gradient(&self.skeletons, &self.graph, p).1).try_normalize(0.0).unwrap_or(*fallback)
    }

    /// Axis-aligned bounds of the field in the frame, as (low, high): outside it is zero. Infinite with a plane, empty
    /// (low above high) without skeletons.
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let empty = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        self.skeletons.iter().fold(empty, |(low, high), skeleton| {
            let (l, h) = skeleton.shape.bounds(skeleton.profile.radius);
            (low.inf(&l), high.sup(&h))
        })
    }
}
