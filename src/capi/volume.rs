//! Volumes, and their control.

use super::guard::{isocoat_world, read, write};
use super::handle::{isocoat_body, isocoat_skeleton};
use super::pointer::Out;
use super::status::isocoat_status;

/// The volume of a body's solid now: that of the territories of its enabled skeletons, by their seeds. Also for bodies
/// without volume control. Contacts do not count.
///
/// - world: not NULL.
/// - body: the body.
/// - volume: receives the volume, in m^3; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (a plane has no bounds). Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_get_volume(
    world: *const isocoat_world,
    body: isocoat_body,
    volume: *mut f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(volume, "volume")?;
            out.put(inner.world.body_volume(body.into())?);
            Ok(())
        })
    }
}

/// The volume of a skeleton's territory now, by its seeds: the part of its body's solid where its field is the highest.
/// Also without volume control. 0 while the skeleton or its link is disabled. Contacts do not count.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - volume: receives the volume, in m^3; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (a plane has no bounds). Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_get_volume(
    world: *const isocoat_world,
    skeleton: isocoat_skeleton,
    volume: *mut f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(volume, "volume")?;
            out.put(inner.world.skeleton_volume(skeleton.into())?);
            Ok(())
        })
    }
}

/// The volume that volume control aims at for a skeleton: what its territory had in the first step with control, or
/// what the host has set. Before that step, what it has now. A change of its descriptor begins anew, unless only
/// user_data changes.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - target: receives the volume, in m^3; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (a plane; the volume_gain of its body is 0).
/// Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_get_target_volume(
    world: *const isocoat_world,
    skeleton: isocoat_skeleton,
    target: *mut f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(target, "target")?;
            out.put(inner.world.skeleton_target_volume(skeleton.into())?);
            Ok(())
        })
    }
}

/// Sets the volume that volume control aims at for a skeleton: a muscle that flexes. The surface moves by at most an
/// eighth of the skeleton's thickness in a step, and by at most half of it inwards and all of it outwards in all.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - target: the volume, in m^3, > 0 and at most 1e30.
///
/// Errors: INVALID_HANDLE, OUT_OF_RANGE, UNSUPPORTED (a plane; the volume_gain of its body is 0).
/// Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_set_target_volume(
    world: *mut isocoat_world,
    skeleton: isocoat_skeleton,
    target: f64,
) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.set_skeleton_target_volume(skeleton.into(), target)?)) }
}

/// How far volume control has moved a skeleton's surface outwards: its thickness and radius are larger by so much than
/// its descriptor says. 0 without volume control.
///
/// - world: not NULL.
/// - skeleton: the skeleton.
/// - offset: receives the distance, in m; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_get_offset(
    world: *const isocoat_world,
    skeleton: isocoat_skeleton,
    offset: *mut f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(offset, "offset")?;
            out.put(inner.world.skeleton_offset(skeleton.into())?);
            Ok(())
        })
    }
}
