//! Recordings: the shape of a world frame by frame, and any frame back as a world to be asked.

use std::cell::UnsafeCell;
use std::mem::offset_of;
use std::sync::atomic::{AtomicBool, Ordering};

use libc::{c_void, size_t};

use super::descriptor::{self, Descriptor};
use super::guard::{self, free, isocoat_world, outside, read};
use super::pointer::{Bytes, Context, Out, slice};
use super::status::{Checked, ISOCOAT_ERROR_LOCKED, Refusal, isocoat_status};
use crate::world::recording::{Recorder, RecorderDesc, Reel};
use crate::world::{World, WorldDesc};

/// Takes the next bytes of a recording, as a file would.
///
/// - context: as in isocoat_recorder_desc.
/// - bytes: the bytes; valid during the call.
/// - size: how many.
///
/// Returns whether it took them all; after it has not, the recording can only be destroyed. It must return (no longjmp,
/// no exception). It may read the world, but not change it.
pub type isocoat_write_fn = Option<unsafe extern "C" fn(context: *mut c_void, bytes: *const u8, size: size_t) -> bool>;

/// How to record. Begin with isocoat_recorder_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_recorder_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// Every how many frames one is written by itself, from 1 to 65536: to go to any frame, at most so many are read.
    /// Default 60.
    pub key_interval: u32,
    /// Given to write, otherwise unused. Default NULL.
    pub context: *mut c_void,
    /// Takes the bytes as they come; NULL keeps them in memory, for isocoat_recorder_get_bytes. Default NULL.
    pub write: isocoat_write_fn,
}

// SAFETY: `repr(C)`, the size first, an integer, a pointer that is never followed, and a function of the host: what is
// not NULL there is a function, as its line says.
unsafe impl Descriptor for isocoat_recorder_desc {
    const NAME: &'static str = "isocoat_recorder_desc";
    const FIRST_SIZE: usize = offset_of!(Self, write) + size_of::<isocoat_write_fn>();

    fn defaults() -> Self {
        let RecorderDesc { key_interval } = RecorderDesc::default();
        Self { struct_size: 0, key_interval, context: std::ptr::null_mut(), write: None }
    }
}

/// A recording under way. It belongs to no world, and outlives them.
pub struct isocoat_recorder {
    /// A call is using it.
    busy: AtomicBool,
    recorder: UnsafeCell<Recorder>,
}

/// Lets go of a recorder, also when the call panics.
struct InUse<'a>(&'a AtomicBool);

impl Drop for InUse<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

impl isocoat_recorder {
    /// # Safety
    /// `recorder` is NULL or a live recorder.
    unsafe fn with<T>(recorder: *const isocoat_recorder, call: impl FnOnce(&mut Recorder) -> Checked<T>) -> Checked<T> {
        // SAFETY: NULL or live, as the caller promises.
        let Some(recorder) = (unsafe { recorder.as_ref() }) else { return Err(Refusal::argument("recorder is NULL")) };
        if recorder.busy.swap(true, Ordering::Acquire) {
            let message = "the recorder is used by another call: no other until it returns";
            return Err(Refusal::new(ISOCOAT_ERROR_LOCKED, message));
        }
        let _in_use = InUse(&recorder.busy);
        // SAFETY: the flag was not set, so that this is the only reference until it is cleared.
        call(unsafe { &mut *recorder.recorder.get() })
    }
}

/// Fills a descriptor with its defaults; isocoat_recorder_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_recorder_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_recorder_desc_init(desc: *mut isocoat_recorder_desc, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Begins a recording.
///
/// - desc: how to record; not NULL.
/// - recorder: receives it; not NULL. Destroy it with isocoat_recorder_destroy.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE. Threads: any.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_recorder_create(
    desc: *const isocoat_recorder_desc,
    recorder: *mut *mut isocoat_recorder,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say.
        let (desc, out) = unsafe { (descriptor::read(desc, "desc")?, Out::new(recorder, "recorder")?) };
        let own = RecorderDesc { key_interval: desc.key_interval };
        let recorder = match desc.write {
            None => Recorder::new(own),
            Some(write) => {
                let context = Context(desc.context);
                let stream = move |bytes: &[u8]| {
                    // SAFETY: the host's function takes its own context and that many bytes.
                    match outside(|| unsafe { write(context.pointer(), bytes.as_ptr(), bytes.len()) }) {
                        true => Ok(()),
                        false => Err(format!("write did not take {} bytes", bytes.len())),
                    }
                };
                Recorder::to_stream(own, Box::new(stream))
            }
        }?;
        let recorder = isocoat_recorder { busy: AtomicBool::new(false), recorder: UnsafeCell::new(recorder) };
        out.put(Box::into_raw(Box::new(recorder)));
        Ok(())
    })
}

/// Destroys a recorder. A recording to a stream that has not been finished is refused later as cut short.
///
/// - recorder: NULL does nothing.
///
/// Errors: LOCKED while another call uses it; it then lives on. Threads: the recorder by this thread alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_recorder_destroy(recorder: *mut isocoat_recorder) -> isocoat_status {
    free(|| {
        if !recorder.is_null() {
            // SAFETY: live, made by `isocoat_recorder_create`, and not used: then nobody may come any more.
            unsafe {
                isocoat_recorder::with(recorder, |_| Ok(()))?;
                drop(Box::from_raw(recorder));
            }
        }
        Ok(())
    })
}

/// Takes a frame of a world as it is now: call it after each step, or as often as frames are wanted. A frame has what
/// the surfaces of all bodies follow from, in contact and with bulges too; not velocities, forces, springs, contacts or
/// what is at rest.
///
/// - recorder: not NULL.
/// - world: not NULL; the same for all frames.
/// - time: when this is, in s, finite and not before the last frame.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (it is finished, or its stream has failed), STREAM, CAPACITY,
/// LOCKED; but for STREAM the recording is as it was. Threads: reads the world; the recorder by this thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_recorder_capture(
    recorder: *mut isocoat_recorder,
    world: *const isocoat_world,
    time: f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| isocoat_recorder::with(recorder, |recorder| Ok(recorder.capture(&inner.world, time)?)))
    }
}

/// How much has been recorded.
///
/// - recorder: not NULL.
/// - frame_count: receives the number of frames; not NULL.
/// - size: receives the bytes so far, without the index; not NULL.
///
/// Errors: INVALID_ARGUMENT, LOCKED. Threads: the recorder by this thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_recorder_get_size(
    recorder: *const isocoat_recorder,
    frame_count: *mut u32,
    size: *mut u64,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say.
        unsafe {
            let (frames, bytes) = (Out::new(frame_count, "frame_count")?, Out::new(size, "size")?);
            isocoat_recorder::with(recorder, |recorder| {
                frames.put(recorder.frames());
                bytes.put(recorder.size());
                Ok(())
            })
        }
    })
}

/// Ends a recording that goes to a stream: hands over the index, without which it is refused as cut short. Nothing can
/// follow.
///
/// - recorder: not NULL.
///
/// Errors: INVALID_ARGUMENT, UNSUPPORTED (in memory, finished, or its stream has failed), STREAM, LOCKED. Threads: the
/// recorder by this thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_recorder_finish(recorder: *mut isocoat_recorder) -> isocoat_status {
    // SAFETY: NULL or live, as its line says.
    free(|| unsafe { isocoat_recorder::with(recorder, |recorder| Ok(recorder.finish()?)) })
}

/// The recording in memory so far, whole: a file of these bytes can be played. It may go on afterwards.
///
/// - recorder: not NULL.
/// - buffer: receives the bytes, little endian on every machine; NULL with capacity 0 asks for the size only.
/// - capacity: bytes in buffer.
/// - size: receives the bytes of the recording, also when buffer is too small; not NULL.
///
/// Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL, UNSUPPORTED (it goes to a stream), LOCKED. Threads: the recorder by this
/// thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_recorder_get_bytes(
    recorder: *const isocoat_recorder,
    buffer: *mut u8,
    capacity: size_t,
    size: *mut size_t,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say.
        unsafe {
            let out = Bytes::new(buffer, capacity, "buffer", size, "size")?;
            isocoat_recorder::with(recorder, |recorder| {
                let (begin, end) = recorder.parts()?;
                if let Some(room) = out.claim(begin.len() + end.len())? {
                    room[..begin.len()].copy_from_slice(begin);
                    room[begin.len()..].copy_from_slice(&end);
                }
                Ok(())
            })
        }
    })
}

/// A recording to be played, and the world that shows one of its frames.
pub struct isocoat_playback {
    /// Its lock is that of the reel too.
    world: isocoat_world,
    reel: UnsafeCell<Reel>,
}

impl isocoat_playback {
    /// Reads what is never changed of a recording.
    ///
    /// # Safety
    /// `playback` is NULL or a live playback.
    unsafe fn look(playback: *const isocoat_playback, call: impl FnOnce(&Reel) -> Checked<()>) -> isocoat_status {
        // SAFETY: NULL or live, as the caller promises; who reads the world keeps those out who would change the reel.
        unsafe {
            match playback.as_ref() {
                Some(playback) => read(&playback.world, |_| call(&*playback.reel.get())),
                None => free(|| Err(null_playback())),
            }
        }
    }
}

fn null_playback() -> Refusal {
    Refusal::argument("playback is NULL")
}

/// Opens a recording and checks all of it.
///
/// - bytes: the recording, which is copied; not NULL.
/// - size: its bytes, neither more nor fewer.
/// - playback: receives it; not NULL. Destroy it with isocoat_playback_destroy.
///
/// Errors: INVALID_ARGUMENT, CAPACITY; RECORDING for what is damaged, cut short or of another format: the message says
/// what is wrong and where. Threads: any.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_playback_create(
    bytes: *const u8,
    size: size_t,
    playback: *mut *mut isocoat_playback,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say.
        let (bytes, out) = unsafe { (slice(bytes, size, "bytes")?, Out::new(playback, "playback")?) };
        let reel = UnsafeCell::new(Reel::open(bytes.to_vec())?);
        let world = isocoat_world::new_shown(World::new(WorldDesc::default())?);
        out.put(Box::into_raw(Box::new(isocoat_playback { world, reel })));
        Ok(())
    })
}

/// Destroys a playback with its world.
///
/// - playback: NULL does nothing.
///
/// Errors: LOCKED while its world is used; it then lives on. Threads: the playback by this thread alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_playback_destroy(playback: *mut isocoat_playback) -> isocoat_status {
    if playback.is_null() {
        return super::status::ISOCOAT_OK;
    }
    // SAFETY: live, made by `isocoat_playback_create`; gone only when nobody is inside, and then nobody may come.
    unsafe { guard::close_shown(&raw const (*playback).world, || drop(Box::from_raw(playback))) }
}

/// Number of frames of a recording.
///
/// - playback: not NULL.
/// - frame_count: receives it; not NULL.
///
/// Errors: INVALID_ARGUMENT, LOCKED. Threads: reads the playback's world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_playback_get_frame_count(
    playback: *const isocoat_playback,
    frame_count: *mut u32,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        isocoat_playback::look(playback, |reel| {
            Out::new(frame_count, "frame_count")?.put(reel.frames());
            Ok(())
        })
    }
}

/// When a frame was taken.
///
/// - playback: not NULL.
/// - frame: the frame, below the number of frames.
/// - time: receives the time that it was captured with, in s; not NULL.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE, LOCKED. Threads: reads the playback's world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_playback_get_time(
    playback: *const isocoat_playback,
    frame: u32,
    time: *mut f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        isocoat_playback::look(playback, |reel| {
            let out = Out::new(time, "time")?;
            out.put(reel.time(frame)?);
            Ok(())
        })
    }
}

/// Shows a frame in the playback's world. The next frame is the cheapest; any other costs at most key_interval frames.
///
/// - playback: not NULL.
/// - frame: the frame, below the number of frames.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE, RECORDING, LOCKED while the world is used; the world then shows what it did.
/// Threads: changes the playback's world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_playback_seek(playback: *mut isocoat_playback, frame: u32) -> isocoat_status {
    // SAFETY: NULL or live, as its line says.
    let Some(playback) = (unsafe { playback.as_ref() }) else { return free(|| Err(null_playback())) };
    guard::show(&playback.world, |inner| {
        // SAFETY: nobody else is inside the world, whose lock is that of the reel too.
        let reel = unsafe { &mut *playback.reel.get() };
        reel.seek(&mut inner.world, frame)?;
        inner.views.refresh(&inner.world);
        Ok(())
    })
}

/// The world that shows a frame of a recording, to be asked everything that needs no step: rays, fields, closest points,
/// meshes, pieces. It is at rest, without springs, contacts or events, and nobody can change it: calls that would give
/// UNSUPPORTED. A snapshot of it, restored in a world of the host's own, steps on from there. Before the first
/// isocoat_playback_seek it is empty.
///
/// - playback: not NULL.
/// - world: receives it; not NULL. It belongs to the playback, and lives as long.
///
/// Handles stay valid from frame to frame while their objects are there; isocoat_world_get_bodies and the like give
/// them. Their index and generation are those in the world that was recorded.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_playback_get_world(
    playback: *const isocoat_playback,
    world: *mut *const isocoat_world,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say.
        unsafe {
            let out = Out::new(world, "world")?;
            let playback = playback.as_ref().ok_or_else(null_playback)?;
            out.put(&raw const playback.world);
            Ok(())
        }
    })
}
