//! Blend graphs: who blends with whom, and which parts of a body collide.

use libc::size_t;

use super::guard::{isocoat_world, read, write};
use super::handle::{isocoat_body, isocoat_link, isocoat_skeleton};
use super::pointer::{Array, Out};
use super::status::isocoat_status;
use crate::world::LinkId;

/// Sets how much two skeletons of a body blend: 1 adds their fields, with 0 the larger counts. New bodies blend all
/// over. Skeletons of different links collide, as far as they don't blend, if isocoat_body_desc::self_contact is 1; but
/// not in the territory of a third that blends with both.
///
/// - world: not NULL.
/// - a, b: two skeletons of one body.
/// - weight: from 0 to 1.
/// - duration: time that the change takes, in s; 0 for at once.
///
/// Errors: INVALID_HANDLE, OUT_OF_RANGE, UNSUPPORTED (skeletons of two bodies; the same skeleton; a graph with more than
/// 4096 groups of skeletons that all blend). Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_set_blend(
    world: *mut isocoat_world,
    a: isocoat_skeleton,
    b: isocoat_skeleton,
    weight: f64,
    duration: f64,
) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.set_blend(a.into(), b.into(), weight, duration)?)) }
}

/// How much two skeletons of a body blend now.
///
/// - world: not NULL.
/// - a, b: two skeletons of one body.
/// - weight: receives the weight, from 0 to 1; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_get_blend(
    world: *const isocoat_world,
    a: isocoat_skeleton,
    b: isocoat_skeleton,
    weight: *mut f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(weight, "weight")?;
            out.put(inner.world.blend(a.into(), b.into())?);
            Ok(())
        })
    }
}

/// Lets exactly those skeletons of a body blend that are of the same link, or of two links that are joined; also those
/// created later. Weights set before are forgotten; not which pairs may not collide.
///
/// - world: not NULL.
/// - body: the body.
/// - joints: 2 handles a joint, links of the body; not NULL unless count is 0.
/// - count: number of joints.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE (more than 1024 skeletons), UNSUPPORTED (a link of another
/// body; a link joined to itself; a graph with more than 4096 groups of skeletons that all blend). Threads: changes the
/// world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_blend_neighbours(
    world: *mut isocoat_world,
    body: isocoat_body,
    joints: *const isocoat_link,
    count: size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let joints = Array::new(joints.cast::<[isocoat_link; 2]>(), count, "joints")?;
            let joints: Vec<(LinkId, LinkId)> = joints.iter().map(|[a, b]| (a.into(), b.into())).collect();
            Ok(inner.world.blend_neighbours(body.into(), &joints)?)
        })
    }
}

/// Lets all skeletons of a body blend, as in the beginning; also forgets which pairs may not collide.
///
/// - world: not NULL.
/// - body: the body.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_blend_all(world: *mut isocoat_world, body: isocoat_body) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.blend_all(body.into())?)) }
}

/// Says whether two skeletons of a body may collide where they don't blend; they may, unless told otherwise.
///
/// - world: not NULL.
/// - a, b: two skeletons of one body.
/// - enabled: whether they may collide.
///
/// Errors: INVALID_HANDLE, OUT_OF_RANGE (more than 1024 skeletons), UNSUPPORTED. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_set_pair_contact(
    world: *mut isocoat_world,
    a: isocoat_skeleton,
    b: isocoat_skeleton,
    enabled: bool,
) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.set_pair_contact(a.into(), b.into(), enabled)?)) }
}
