//! A coat from a mesh: skeletons whose isosurface comes close to a closed mesh of triangles (docs/model.md, "Coats from
//! meshes").
//!
//! 1. [`target`] makes the mesh ready: bounds, sides, points spread over it, bones;
//! 2. [`place`] finds inscribed balls that cover its surface, and stretches them where segments are wanted;
//! 3. [`refine`] moves them, and changes their thicknesses, until the surface of all fields together comes no closer;
//! 4. [`measure`] says how far the two surfaces are from each other in the end.
//!
//! All fields fall off over one width, radius less thickness, whatever the thickness. So the summed field has about the
//! same slope all over the surface, and the coat's stiffness does not depend on which skeleton is under it.
//!
//! No random number, no clock, no other thread: the same input gives the same bits.

pub mod measure;
pub mod place;
pub mod refine;
mod sparse;
pub mod target;

use crate::error::{Result, out_of_range, require};
use measure::Distance;
use refine::Fitted;
pub use target::{Bones, Target};

/// Most skeletons of a fit.
pub const MOST: usize = 4096;

/// The width over the side of a square that holds a skeleton's share of the surface (`make fit` has others beside it).
const WIDTH: f64 = 0.3;
/// Smallest thickness over the width: the radius is at most four times the thickness.
const THINNEST: f64 = 1.0 / 3.0;
/// Points of the mesh for each skeleton, and how many there are at least and at most.
const POINTS: usize = 20;
const FEWEST_POINTS: usize = 2000;
const MOST_POINTS: usize = 40_000;

/// What skeletons a fit is made of.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Primitive {
    /// Points.
    #[default]
    Point,
    /// Segments.
    Segment,
}

/// What is fitted, in the frame of the target.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// What skeletons.
    pub primitive: Primitive,
    /// How many.
    pub count: usize,
    /// Radius less thickness of all of them.
    pub width: f64,
}

/// Whether a fit may have so many skeletons.
pub fn check_count(count: u32) -> Result<usize> {
    let count = count as usize;
    if (1..=MOST).contains(&count) { Ok(count) } else { Err(out_of_range("count", count, "from 1 to 4096")) }
}

impl Settings {
    /// Checks what is wanted of a target: `width` in metres, or 0 for one that goes with the number of skeletons.
    pub fn new(target: &Target, primitive: Primitive, count: u32, width: f64) -> Result<Self> {
        let count = check_count(count)?;
        let own = (WIDTH * (target.area / count as f64).sqrt()).min(1.0);
        let relative = width / target.diagonal;
        require("width over the diagonal of the mesh", relative, "0, or from 1e-3 to 1", |x| {
            x == 0.0 || (1e-3..=1.0).contains(&x)
        })?;
        Ok(Self { primitive, count, width: if width == 0.0 { own } else { relative } })
    }

    /// The smallest thickness of a skeleton.
    fn thinnest(&self) -> f64 {
        THINNEST * self.width
    }
}

/// Fits skeletons to a target; also says how far the two surfaces are from each other. Both are in the target's frame.
///
/// # Errors
///
/// When there are fewer skeletons than bones that have a part of the surface.
pub fn fit(target: &Target, settings: &Settings) -> Result<(Vec<Fitted>, Distance)> {
    let samples = target.samples((POINTS * settings.count).clamp(FEWEST_POINTS, MOST_POINTS));
    let mut bones: Vec<u32> = samples.iter().map(|sample| sample.bone).collect();
    bones.sort_unstable();
    bones.dedup();
    if bones.len() > settings.count {
        let value = format_args!("{} for {} bones", settings.count, bones.len());
        return Err(out_of_range("count", value, "at least the number of bones that have a part of the surface"));
    }
    let balls = place::balls(target, &samples, settings.count);
    let mut skeletons: Vec<Fitted> = balls.iter().map(|ball| place::point(ball, settings.thinnest())).collect();
    if settings.primitive == Primitive::Segment {
        place::stretch(target, &samples, &mut skeletons);
    }
    refine::refine(target, &samples, settings, &mut skeletons)?;
    let distance = measure::distance(target, refine::coat(&skeletons, settings.width), 0.5 * settings.width)?;
    Ok((skeletons, distance))
}
