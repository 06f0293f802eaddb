//! Coats from meshes: skeletons fitted to a closed mesh, and created on the links of its bones.

use super::{LinkId, SkeletonDesc, SkeletonId, World};
use crate::error::{Result, out_of_range};
use crate::field::Shape;
use crate::math::{Pose, Vec3};
use crate::surface::fit::refine::Fitted;
use crate::surface::fit::{self, Settings, Target};
pub use crate::surface::fit::{Bones, Primitive};

/// What coat is fitted to a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FitDesc {
    /// What skeletons it is made of.
    pub primitive: Primitive,
    /// How many, from 1 to 4096.
    pub count: u32,
    /// Radius less thickness of every skeleton \[m\]: how far its field goes beyond its surface. The slope of the summed
    /// field at the surface is about `2 isovalue / width`, so that this is how soft the coat is. 0 stands for 0.3 times the
    /// side of a square with a skeleton's share of the mesh's area, which comes closest; else from 1e-3 to 1 of the
    /// diagonal of the mesh. No thickness is less than a third of it.
    pub width: f64,
}

impl Default for FitDesc {
    fn default() -> Self {
        Self { primitive: Primitive::Point, count: 64, width: 0.0 }
    }
}

/// A coat fitted to a mesh, and how close it comes.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// The skeletons, in the frame of the mesh; with thickness and radius, and defaults for the rest.
    pub skeletons: Vec<SkeletonDesc>,
    /// The bone of each; 0 for all if none were given.
    pub bones: Vec<u32>,
    /// Mean distance of the two surfaces \[m\]: the mean over the area of the mesh and that over the area of the coat's
    /// surface, where all skeletons blend, in equal parts.
    pub mean_distance: f64,
    /// Largest distance of a point of either surface from the other \[m\].
    pub max_distance: f64,
    /// Diagonal of the bounds of the mesh \[m\].
    pub diagonal: f64,
}

/// Fits a coat to a closed mesh of triangles: skeletons whose isosurface comes close to it. A function of its input alone:
/// the same gives the same bits. It takes seconds: time grows with `count`.
///
/// - `vertices`: where \[m\]. Several at one place count as one, so that a mesh may be split along seams.
/// - `triangles`: three vertices each, counterclockwise from outside. Each edge lies between two triangles.
/// - `bones`: whose the vertices are. A skeleton then belongs to the bone with the most weight where it lies, and each bone
///   that has more than 1/2000 of the surface gets as many as it needs to be as close as the others.
///
/// # Errors
///
/// Coordinates that are not finite; a mesh that is open, inside out, without volume, or has an edge between more than two
/// triangles; a count or a width out of range, or fewer skeletons than bones; bones that are not as many as vertices ask
/// for, or weights below 0 or all 0.
///
/// ```
/// use isocoat::world::fit::{FitDesc, fit};
/// let (p, q) = ([0.0, 0.0, 0.0], [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]);
/// let tetrahedron = fit(&[p, q[0], q[1], q[2]], &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], None, &FitDesc::default())?;
/// assert!(tetrahedron.mean_distance < 0.01 * tetrahedron.diagonal);
/// # Ok::<(), isocoat::Error>(())
/// ```
pub fn fit(vertices: &[[f64; 3]], triangles: &[[u32; 3]], bones: Option<&Bones>, desc: &FitDesc) -> Result<Fit> {
    let target = Target::new(vertices, triangles, bones)?;
    let settings = Settings::new(&target, desc.primitive, desc.count, desc.width)?;
    let (fitted, distance) = fit::fit(&target, &settings)?;
    let place = |p: &Vec3| target.origin + p * target.diagonal;
    let skeleton = |fitted: &Fitted| SkeletonDesc {
        shape: match desc.primitive {
            Primitive::Point => Shape::Point(place(&fitted.ends[0])),
            Primitive::Segment => Shape::segment(place(&fitted.ends[0]), place(&fitted.ends[1])),
        },
        thickness: fitted.thickness * target.diagonal,
        radius: (fitted.thickness + settings.width) * target.diagonal,
        ..SkeletonDesc::default()
    };
    Ok(Fit {
        skeletons: fitted.iter().map(skeleton).collect(),
        bones: fitted.iter().map(|fitted| fitted.bone).collect(),
        mean_distance: distance.mean * target.diagonal,
        max_distance: distance.maximum * target.diagonal,
        diagonal: target.diagonal,
    })
}

/// Coats from meshes.
impl World {
    /// Creates the skeletons of a fit, each on the link of its bone: all of them, or none if one is refused.
    ///
    /// - `links`: for each bone.
    /// - `frame`: the mesh's frame in the world while the links are where they are: of a mesh in the frame of a link, that
    ///   link's pose; of a mesh in the world, the default.
    pub fn create_fitted(&mut self, fit: &Fit, links: &[LinkId], frame: &Pose) -> Result<Vec<SkeletonId>> {
        let place = |(desc, bone): (&SkeletonDesc, &u32)| match links.get(*bone as usize) {
            Some(link) => Ok((*link, desc.clone())),
            None => Err(out_of_range("bone of a skeleton", bone, "less than the number of links")),
        };
        let skeletons = fit.skeletons.iter().zip(&fit.bones).map(place).collect::<Result<Vec<_>>>()?;
        self.create_skeletons(&skeletons, Some(frame))
    }
}
