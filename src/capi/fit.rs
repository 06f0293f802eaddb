//! Coats from meshes: skeletons fitted to a closed mesh of the host.

use std::mem::offset_of;

use libc::size_t;

use super::buffer::{Source, isocoat_const_buffer};
use super::descriptor::{self, Descriptor, OutRow};
use super::guard::free;
use super::mesh::fits;
use super::pointer::{Out, slice, slice_mut};
use super::skeleton::{ISOCOAT_SHAPE_POINT, ISOCOAT_SHAPE_SEGMENT, isocoat_shape, isocoat_skeleton_desc};
use super::status::{Checked, Refusal, isocoat_status};
use super::world::check_reserved;
use crate::surface::fit::check_count;
use crate::world::fit::{Bones, FitDesc, Primitive, fit};

/// What coat is fitted to a mesh. Begin with isocoat_fit_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_fit_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// What skeletons: ISOCOAT_SHAPE_POINT, the default, or ISOCOAT_SHAPE_SEGMENT.
    pub shape: isocoat_shape,
    /// How many, from 1 to 4096. 200 points come within 0.17 % of the diagonal of a bunny on average, and within 1.3 %
    /// at most; 400 within 0.11 % and 1.2 %. Default 64.
    pub count: u32,
    /// 0.
    pub reserved: u32,
    /// Radius less thickness of every skeleton, in m: how far its field goes beyond its surface. The slope of the summed
    /// field at the surface is about 2 isovalue / width, so that this is how soft the coat is. 0, the default, stands
    /// for 0.3 times the side of a square with a skeleton's share of the mesh's area, which comes closest; else from
    /// 1e-3 to 1 of the diagonal of the mesh. No thickness is less than a third of it.
    pub width: f64,
}

// SAFETY: `repr(C)`, the size first, integers and a number.
unsafe impl Descriptor for isocoat_fit_desc {
    const NAME: &'static str = "isocoat_fit_desc";
    const FIRST_SIZE: usize = offset_of!(Self, width) + size_of::<f64>();

    fn defaults() -> Self {
        let desc = FitDesc::default();
        Self { struct_size: 0, shape: ISOCOAT_SHAPE_POINT, count: desc.count, reserved: 0, width: desc.width }
    }
}

impl isocoat_fit_desc {
    fn to_rust(self) -> Checked<FitDesc> {
        check_reserved(self.reserved)?;
        let primitive = match self.shape {
            ISOCOAT_SHAPE_POINT => Primitive::Point,
            ISOCOAT_SHAPE_SEGMENT => Primitive::Segment,
            other => {
                let range = "must be ISOCOAT_SHAPE_POINT (0) or ISOCOAT_SHAPE_SEGMENT (1)";
                return Err(Refusal::argument(format!("shape is {other}; {range}")));
            }
        };
        Ok(FitDesc { primitive, count: self.count, width: self.width })
    }
}

/// How close a fitted coat comes to its mesh.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_fit_distance {
    /// Mean distance of the two surfaces, in m: the mean over the area of the mesh and that over the area of the coat's
    /// surface, where all skeletons blend, in equal parts.
    pub mean: f64,
    /// Largest distance of a point of either surface from the other, in m.
    pub maximum: f64,
    /// Diagonal of the bounds of the mesh, in m.
    pub diagonal: f64,
}

/// Fills a descriptor with its defaults; isocoat_fit_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_fit_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_fit_desc_init(desc: *mut isocoat_fit_desc, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Fits a coat to a closed mesh of triangles: skeletons whose isosurface comes close to it. It needs no world;
/// isocoat_skeleton_create_many() takes what it gives. A function of its input alone: the same gives the same bits. It
/// takes seconds, and more the more skeletons: 200 points of a mesh of a thousand triangles about 4.
///
/// - desc: which skeletons, and how many; not NULL.
/// - vertices: 3 numbers a vertex, in m, finite; its data not NULL. Vertices at one place count as one, so that a mesh
///   may be split along seams.
/// - vertex_count: number of vertices.
/// - triangles: 3 * triangle_count indices of vertices, counterclockwise from outside; not NULL. Each edge lies between
///   two triangles.
/// - triangle_count: number of triangles, at least 4.
/// - bones: numbers of the bones that move each vertex, bones_per_vertex of each in a row; NULL if there is one bone
///   alone. A skeleton then belongs to the bone with the most weight where it lies, and each bone that has a part of the
///   surface gets as many as it needs to be as close as the others: one at least if that is more than 1/2000 of it.
/// - weights: 1 number for each of these, at least 0, not all of a vertex 0; its data not NULL unless bones is.
/// - bones_per_vertex: at least 1 unless bones is NULL.
/// - skeletons: receives desc->count descriptors in the frame of the mesh: shape, thickness, radius, and defaults. Not
///   NULL; the first must have its struct_size set, and says how far they are apart.
/// - skeleton_bones: receives the bone of each, 0 without bones; NULL if not wanted. Not the array of bones.
/// - capacity: skeletons that fit into each of the two.
/// - distance: receives how close the surface comes; NULL if not wanted.
///
/// Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL, UNSUPPORTED without triangles, OUT_OF_RANGE: coordinates that are not
/// finite, an index too large; a mesh that is open, inside out, without volume, or has an edge between more than two
/// triangles; a count or width out of range, or fewer skeletons than bones; a weight that is none. Threads: any.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_fit_mesh(
    desc: *const isocoat_fit_desc,
    vertices: isocoat_const_buffer,
    vertex_count: size_t,
    triangles: *const u32,
    triangle_count: size_t,
    bones: *const u32,
    weights: isocoat_const_buffer,
    bones_per_vertex: size_t,
    skeletons: *mut isocoat_skeleton_desc,
    skeleton_bones: *mut u32,
    capacity: size_t,
    distance: *mut isocoat_fit_distance,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say; nothing is written before the fit is made.
        unsafe {
            let desc = descriptor::read(desc, "desc")?.to_rust()?;
            let vertices = Source::<3>::required(vertices, vertex_count, "vertices")?;
            let triangles: &[[u32; 3]] = slice(triangles.cast(), triangle_count, "triangles")?;
            let is_skinned = !bones.is_null();
            let influences = if is_skinned { vertex_count.saturating_mul(bones_per_vertex) } else { 0 };
            let bones = slice(bones, influences, "bones")?;
            let weights = Source::<1>::required(weights, influences, "weights")?;
            let out = OutRow::new(skeletons, capacity, "skeletons")?;
            let out_bones = slice_mut(skeleton_bones, capacity, "skeleton_bones")?;
            let distance = if distance.is_null() { None } else { Some(Out::new(distance, "distance")?) };
            fits("capacity", capacity, check_count(desc.count)?)?;

            let vertices: Vec<[f64; 3]> = vertices.iter().collect();
            let weights: Vec<f64> = weights.iter().map(|[weight]| weight).collect();
            let bones = Bones { per_vertex: bones_per_vertex, bones, weights: &weights };
            let found = fit(&vertices, triangles, is_skinned.then_some(&bones), &desc)?;
            for (index, skeleton) in found.skeletons.iter().enumerate() {
                out.put(index, &skeleton.into());
            }
            if let Some(out_bones) = out_bones {
                out_bones[..found.bones.len()].copy_from_slice(&found.bones);
            }
            if let Some(out) = distance {
                let (mean, maximum) = (found.mean_distance, found.max_distance);
                out.put(isocoat_fit_distance { mean, maximum, diagonal: found.diagonal });
            }
            Ok(())
        }
    })
}
