//! Snapshots: a world's state in the host's memory, and back.

use libc::size_t;

use super::guard::{isocoat_world, read, write};
use super::pointer::{Bytes, slice};
use super::status::isocoat_status;

/// Takes a snapshot of a world: everything that lasts between steps, forces and impulses that wait for the next step
/// included, but for the log, the pair filter, contacts and events. Restored and stepped on, it gives the same bits as
/// never having stopped. It asks for no memory.
///
/// - world: not NULL.
/// - buffer: receives the snapshot, little endian on every machine; NULL with capacity 0 asks for the size only. Other
///   calls may change the size.
/// - capacity: bytes in buffer.
/// - size: receives the bytes of the snapshot, also when buffer is too small; not NULL.
///
/// Pointers in user_data are kept as numbers. Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_snapshot(
    world: *const isocoat_world,
    buffer: *mut u8,
    capacity: size_t,
    size: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Bytes::new(buffer, capacity, "buffer", size, "size")?;
            if let Some(room) = out.claim(inner.world.snapshot_size())? {
                inner.world.snapshot_into(room)?;
            }
            Ok(())
        })
    }
}

/// Puts a world back to what a snapshot says. Log, pair filter and tasks stay; until the next step there are no events,
/// no figures, and no contacts but those of bodies asleep.
///
/// - world: not NULL.
/// - buffer: the snapshot; not NULL.
/// - size: its bytes, neither more nor fewer.
///
/// Handles: in the world that took the snapshot, those taken before it are valid again, and those of what was created
/// after it are stale for ever. In any other world, of another process too, the snapshot's objects take the place of
/// all there was, and every handle given out so far is invalid; isocoat_world_get_bodies, isocoat_body_get_links,
/// isocoat_body_get_springs and isocoat_link_get_skeletons give the new ones. Their index and generation are those in
/// the world that took it.
///
/// Errors: SNAPSHOT for what is damaged, cut short, of another format, or of a state that no world can be in, such as
/// one with a number that is none; the world is then as it was. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_restore(
    world: *mut isocoat_world,
    buffer: *const u8,
    size: size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            inner.world.restore(slice(buffer, size, "buffer")?)?;
            inner.views.refresh(&inner.world);
            Ok(())
        })
    }
}
