//! Skeletons: life, shapes, descriptors.

use std::mem::offset_of;

use libc::{c_void, size_t};

use super::descriptor::{self, Descriptor, OutStruct};
use super::guard::{free, isocoat_world, read, write};
use super::handle::{isocoat_link, isocoat_skeleton};
use super::math::isocoat_pose;
use super::pointer::{self, Out, slice, slice_mut};
use super::status::{Checked, ISOCOAT_ERROR_OUT_OF_RANGE, Refusal, isocoat_status};
use super::world::unknown;
use crate::field::Shape;
use crate::math::{Pose, Quat, Vec3, rotation_from_vector, rotation_to_vector};
use crate::world::SkeletonDesc;
use crate::world::desc::validate_pose;

/// Which primitive a skeleton is: an ISOCOAT_SHAPE_ value. It says what the three points of the descriptor are, all in
/// the link's frame, in m.
pub type isocoat_shape = u32;
/// A point: `points[0]`.
pub const ISOCOAT_SHAPE_POINT: isocoat_shape = 0;
/// A segment from `points[0]` to `points[1]`; a point if they are one.
pub const ISOCOAT_SHAPE_SEGMENT: isocoat_shape = 1;
/// A triangle of `points[0]`, `points[1]`, `points[2]`; a segment or a point if it has no area.
pub const ISOCOAT_SHAPE_TRIANGLE: isocoat_shape = 2;
/// A solid box: `points[0]` is its centre, `points[1]` its half extents, each > 0, `points[2]` the rotation of its axes
/// as a vector (axis times angle, in rad).
pub const ISOCOAT_SHAPE_BOX: isocoat_shape = 3;
/// A half-space: `points[0]` is a point of its boundary, `points[1]` the outward normal, of any length but 0. For fixed
/// links only.
pub const ISOCOAT_SHAPE_PLANE: isocoat_shape = 4;

/// A primitive fixed in a link's frame, and the field it emits. Begin with isocoat_skeleton_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_skeleton_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// Which primitive. Default ISOCOAT_SHAPE_POINT.
    pub shape: isocoat_shape,
    /// What shape says, finite; points that the shape has no use for are ignored. Default 0.
    pub points: [[f64; 3]; 3],
    /// Distance of the surface from an isolated skeleton, in m, > 0 and at most 1e9. Default 0.1.
    pub thickness: f64,
    /// Slope of the field at the surface, in 1/m: > 0 and at most 3 isovalue / (radius - thickness); 0 stands for
    /// 2 isovalue / (radius - thickness). Default 0.
    pub stiffness: f64,
    /// Slope of the field at the skeleton over that at the surface: from 0 to 1e6; 1 is linear. Default 1.
    pub stiffening: f64,
    /// Distance at which the field ends, in m, larger than thickness and at most 1e9; 0 stands for twice the
    /// thickness. Default 0.
    pub radius: f64,
    /// Number of seeds: from 4 to 65536; 0 stands for the world's. Default 0.
    pub seed_count: u32,
    /// The host's own; given back, otherwise unused. Default NULL.
    pub user_data: *mut c_void,
}

// SAFETY: `repr(C)`, the size first, numbers and a pointer that is never followed.
unsafe impl Descriptor for isocoat_skeleton_desc {
    const NAME: &'static str = "isocoat_skeleton_desc";
    const FIRST_SIZE: usize = offset_of!(Self, user_data) + size_of::<*mut c_void>();

    fn defaults() -> Self {
        Self::from(&SkeletonDesc::default())
    }
}

impl From<&SkeletonDesc> for isocoat_skeleton_desc {
    fn from(desc: &SkeletonDesc) -> Self {
        let (shape, points) = match &desc.shape {
            Shape::Point(a) => (ISOCOAT_SHAPE_POINT, [*a, Vec3::zeros(), Vec3::zeros()]),
            Shape::Segment(a, b) => (ISOCOAT_SHAPE_SEGMENT, [*a, *b, Vec3::zeros()]),
            Shape::Triangle(a, b, c) => (ISOCOAT_SHAPE_TRIANGLE, [*a, *b, *c]),
            Shape::Box { center, half, axes } => {
                let rotation = nalgebra::Rotation3::from_matrix_unchecked(*axes);
                let turn = rotation_to_vector(&Quat::from_rotation_matrix(&rotation));
                (ISOCOAT_SHAPE_BOX, [*center, *half, turn])
            }
            Shape::Plane { point, normal } => (ISOCOAT_SHAPE_PLANE, [*point, *normal, Vec3::zeros()]),
        };
        Self {
            struct_size: 0,
            shape,
            points: points.map(Into::into),
            thickness: desc.thickness,
            stiffness: desc.stiffness,
            stiffening: desc.stiffening,
            radius: desc.radius,
            seed_count: desc.seed_count,
            user_data: desc.user_data as *mut c_void,
        }
    }
}

impl isocoat_skeleton_desc {
    fn to_rust(self) -> Checked<SkeletonDesc> {
        // Before the shape decides what it degenerates to.
        let used = match self.shape {
            ISOCOAT_SHAPE_POINT => 1,
            ISOCOAT_SHAPE_SEGMENT | ISOCOAT_SHAPE_PLANE => 2,
            _ => 3,
        };
        for (index, [x, y, z]) in self.points[..used].iter().enumerate() {
            if ![x, y, z].iter().all(|x| x.is_finite()) {
                let message = format!("points[{index}] is ({x}, {y}, {z}); must be finite");
                return Err(Refusal::new(ISOCOAT_ERROR_OUT_OF_RANGE, message));
            }
        }
        let [a, b, c] = self.points.map(Vec3::from);
        let shape = match self.shape {
            ISOCOAT_SHAPE_POINT => Shape::Point(a),
            ISOCOAT_SHAPE_SEGMENT => Shape::segment(a, b),
            ISOCOAT_SHAPE_TRIANGLE => Shape::triangle(a, b, c),
            ISOCOAT_SHAPE_BOX => {
                Shape::Box { center: a, half: b, axes: rotation_from_vector(&c).to_rotation_matrix().into_inner() }
            }
            ISOCOAT_SHAPE_PLANE => Shape::plane(a, b)?,
            other => return Err(unknown("shape", other, "ISOCOAT_SHAPE_", 4)),
        };
        Ok(SkeletonDesc {
            shape,
            thickness: self.thickness,
            stiffness: self.stiffness,
            stiffening: self.stiffening,
            radius: self.radius,
            seed_count: self.seed_count,
            user_data: self.user_data as usize,
        })
    }
}

/// Fills a descriptor with its defaults; isocoat_skeleton_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_skeleton_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_desc_init(desc: *mut isocoat_skeleton_desc, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Creates a skeleton of a link.
///
/// - world: not NULL.
/// - link: the link that carries it.
/// - desc: the skeleton; not NULL.
/// - skeleton: receives the handle; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (a plane on a link that is not fixed), CAPACITY.
/// Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_create(
    world: *mut isocoat_world,
    link: isocoat_link,
    desc: *const isocoat_skeleton_desc,
    skeleton: *mut isocoat_skeleton,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let (desc, out) = (descriptor::read(desc, "desc")?, Out::new(skeleton, "skeleton")?);
            out.put(inner.world.create_skeleton(link.into(), desc.to_rust()?)?.into());
            Ok(())
        })
    }
}

/// Creates many skeletons, such as those of isocoat_fit_mesh(): all of them, or none if one is refused.
///
/// - world: not NULL.
/// - links: link_count links; not NULL.
/// - link_count: number of links, at least 1.
/// - descs: count skeletons in a row, all of the struct_size of the first; not NULL unless count is 0.
/// - link_of: for each skeleton, which of the links carries it; NULL if the first one carries all.
/// - count: number of skeletons.
/// - frame: the frame of the descriptors in the world, from which the skeletons are brought to their links as these are
///   now: the pose of the link for what is given in its frame, the identity for what is given in the world. NULL if each
///   is in the frame of its own link.
/// - skeletons: receives count handles; NULL when they are not wanted.
///
/// Errors: as isocoat_skeleton_create, and the message says which element; OUT_OF_RANGE for a link_of too large or a
/// frame that is none. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_create_many(
    world: *mut isocoat_world,
    links: *const isocoat_link,
    link_count: size_t,
    descs: *const isocoat_skeleton_desc,
    link_of: *const u32,
    count: size_t,
    frame: *const isocoat_pose,
    skeletons: *mut isocoat_skeleton,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let links = slice(links, link_count, "links")?;
            let descs = descriptor::read_row(descs, count, "descs")?;
            let link_of = slice(link_of, if link_of.is_null() { 0 } else { count }, "link_of")?;
            let out = slice_mut(skeletons, count, "skeletons")?;
            let frame = if frame.is_null() { None } else { Some(Pose::from(&pointer::read(frame, "frame")?)) };
            let mut wanted = Vec::with_capacity(count);
            for (index, desc) in descs.into_iter().enumerate() {
                let number = link_of.get(index).copied().unwrap_or(0);
                let Some(link) = links.get(number as usize) else {
                    let message = format!("link_of[{index}] is {number}; must be less than link_count, {link_count}");
                    return Err(Refusal::new(ISOCOAT_ERROR_OUT_OF_RANGE, message));
                };
                wanted.push(((*link).into(), desc.to_rust().map_err(|refusal| refusal.at("descs", index))?));
            }
            frame.as_ref().map_or(Ok(()), validate_pose)?;
            for (index, (link, desc)) in wanted.iter().enumerate() {
                let placed = inner.world.place_skeleton(*link, desc, frame.as_ref());
                placed.map_err(|error| Refusal::from(error).at("descs", index))?;
            }
            let made = inner.world.create_skeletons(&wanted, frame.as_ref())?;
            for (out, made) in out.into_iter().flatten().zip(made) {
                *out = made.into();
            }
            Ok(())
        })
    }
}

/// Destroys a skeleton.
///
/// - world: not NULL.
/// - skeleton: the skeleton; its handle is stale afterwards.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_destroy(
    world: *mut isocoat_world,
    skeleton: isocoat_skeleton,
) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.destroy_skeleton(skeleton.into())?)) }
}

/// The descriptor of a skeleton. A segment or triangle without extent comes back as the shape that it is, a plane with
/// a unit normal, a box with a rotation of at most pi.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - desc: receives it; not NULL, with struct_size set.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_get_desc(
    world: *const isocoat_world,
    skeleton: isocoat_skeleton,
    desc: *mut isocoat_skeleton_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = OutStruct::new(desc, "desc")?;
            out.put(&inner.world.skeleton_desc(skeleton.into())?.into());
            Ok(())
        })
    }
}

/// Changes a skeleton, from the next step or query on.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - desc: the new descriptor, whole; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_set_desc(
    world: *mut isocoat_world,
    skeleton: isocoat_skeleton,
    desc: *const isocoat_skeleton_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let desc = descriptor::read(desc, "desc")?.to_rust()?;
            Ok(inner.world.set_skeleton_desc(skeleton.into(), desc)?)
        })
    }
}

/// Takes a skeleton out of the simulation, or puts it back. New skeletons are enabled.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - enabled: whether it takes part.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_set_enabled(
    world: *mut isocoat_world,
    skeleton: isocoat_skeleton,
    enabled: bool,
) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.set_skeleton_enabled(skeleton.into(), enabled)?)) }
}

/// Whether a skeleton takes part in the simulation. The skeletons of a disabled link keep their own answer.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - enabled: receives the answer; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_is_enabled(
    world: *const isocoat_world,
    skeleton: isocoat_skeleton,
    enabled: *mut bool,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(enabled, "enabled")?;
            out.put(inner.world.skeleton_is_enabled(skeleton.into())?);
            Ok(())
        })
    }
}

/// The host's own pointer of a skeleton.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - user_data: receives the pointer; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_get_user_data(
    world: *const isocoat_world,
    skeleton: isocoat_skeleton,
    user_data: *mut *mut c_void,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(user_data, "user_data")?;
            out.put(inner.world.skeleton_desc(skeleton.into())?.user_data as *mut c_void);
            Ok(())
        })
    }
}

/// The link of a skeleton.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - link: receives the handle; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_get_link(
    world: *const isocoat_world,
    skeleton: isocoat_skeleton,
    link: *mut isocoat_link,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(link, "link")?;
            out.put(inner.world.skeleton_link(skeleton.into())?.into());
            Ok(())
        })
    }
}
