//! The one guard of the boundary: it locks the world, catches panics, and turns results into status codes.
//!
//! About panics. The default hook of Rust prints to the host's standard error before a panic is caught, and there is no
//! way to stop it but another hook. So the first guarded call sets one, in the copy of the Rust runtime that this
//! library carries: it is silent on a thread that is inside a guarded call, keeps the text for the message, and hands
//! everything else, the host's own callbacks included, to the hook it found.

use std::any::Any;
use std::cell::UnsafeCell;
use std::cell::{Cell, RefCell};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Once;
use std::sync::atomic::{AtomicU32, Ordering};

use super::report::Views;
use super::status::{
    Checked, ISOCOAT_ERROR_LOCKED, ISOCOAT_ERROR_POISONED, ISOCOAT_ERROR_UNSUPPORTED, ISOCOAT_OK, Refusal,
    isocoat_status, report,
};
use crate::world::World;

/// A world: it owns every body, link and skeleton; one step advances it. Worlds are independent of each other.
pub struct isocoat_world {
    /// Number of readers, and the three flags.
    state: AtomicU32,
    inner: UnsafeCell<Inner>,
}

/// What the lock of a world protects.
pub(super) struct Inner {
    pub world: World,
    pub views: Views,
}

const WRITING: u32 = 1 << 31;
const POISONED: u32 = 1 << 30;
/// It shows a frame of a recording: only the playback that it belongs to changes it.
const SHOWN: u32 = 1 << 29;
const READERS: u32 = SHOWN - 1;

impl isocoat_world {
    pub(super) fn new(world: World) -> Self {
        Self { state: AtomicU32::new(0), inner: UnsafeCell::new(Inner { world, views: Views::default() }) }
    }

    /// A world that shows frames of a recording.
    pub(super) fn new_shown(world: World) -> Self {
        Self { state: AtomicU32::new(SHOWN), ..Self::new(world) }
    }

    /// Moves to the state that `next` says, unless the world is poisoned, or `next` finds it taken.
    fn enter(&self, next: impl Fn(u32) -> Option<u32>) -> Checked<()> {
        let next = |state| if state & POISONED == 0 { next(state) } else { None };
        match self.state.fetch_update(Ordering::Acquire, Ordering::Relaxed, next) {
            Ok(_) => Ok(()),
            Err(state) => Err(refusal(state)),
        }
    }
}

fn refusal(state: u32) -> Refusal {
    if state & POISONED != 0 {
        Refusal::new(ISOCOAT_ERROR_POISONED, "an earlier internal error has left the world unusable: destroy it")
    } else if state & WRITING != 0 {
        Refusal::new(
            ISOCOAT_ERROR_LOCKED,
            "the world is being stepped or changed: no other call until that returns, not even from its callbacks",
        )
    } else if state & SHOWN != 0 {
        let message =
            "the world shows a frame of a recording: it cannot be changed, but a snapshot of it can be restored";
        Refusal::new(ISOCOAT_ERROR_UNSUPPORTED, message)
    } else {
        Refusal::new(ISOCOAT_ERROR_LOCKED, "the world is being read: it cannot be changed until that returns")
    }
}

/// Guards a call that has no world.
pub(super) fn free(call: impl FnOnce() -> Checked<()>) -> isocoat_status {
    match catch(call) {
        Ok(result) => conclude(result),
        Err(text) => report(Refusal::new(ISOCOAT_ERROR_POISONED, format!("internal error: {text}"))),
    }
}

/// Guards a call that reads a world; several may run at once.
///
/// # Safety
/// `world` is NULL or a live world.
pub(super) unsafe fn read(world: *const isocoat_world, call: impl FnOnce(&Inner) -> Checked<()>) -> isocoat_status {
    // SAFETY: NULL or live, as the caller promises.
    let Some(world) = (unsafe { world.as_ref() }) else { return report(null_world()) };
    let more = |state| if state & WRITING == 0 && state & READERS != READERS { Some(state + 1) } else { None };
    if let Err(refusal) = world.enter(more) {
        return report(refusal);
    }
    // SAFETY: counted as a reader, so that nobody writes before the count goes down again.
    let inner = unsafe { &*world.inner.get() };
    let result = catch(|| call(inner));
    if result.is_err() {
        world.state.fetch_or(POISONED, Ordering::Relaxed);
    }
    world.state.fetch_sub(1, Ordering::Release);
    conclude_or_poison(result)
}

/// Guards a call that changes a world: it must be alone.
///
/// # Safety
/// `world` is NULL or a live world.
pub(super) unsafe fn write(world: *mut isocoat_world, call: impl FnOnce(&mut Inner) -> Checked<()>) -> isocoat_status {
    // SAFETY: NULL or live, as the caller promises.
    let Some(world) = (unsafe { world.as_ref() }) else { return report(null_world()) };
    let taken = world.enter(|state| if state == 0 { Some(WRITING) } else { None });
    alone(world, taken, 0, call)
}

/// Guards a call by which a playback changes the world that it shows: it must be alone.
pub(super) fn show(world: &isocoat_world, call: impl FnOnce(&mut Inner) -> Checked<()>) -> isocoat_status {
    alone(world, take_shown(world), SHOWN, call)
}

/// Runs a call alone in a world that has been taken, and lets go of it.
fn alone(
    world: &isocoat_world,
    taken: Checked<()>,
    after: u32,
    call: impl FnOnce(&mut Inner) -> Checked<()>,
) -> isocoat_status {
    if let Err(refusal) = taken {
        return report(refusal);
    }
    // SAFETY: the flag was taken with no reader present, so that this is the only reference until it is given back.
    let inner = unsafe { &mut *world.inner.get() };
    let result = catch(|| call(inner));
    world.state.store(if result.is_err() { POISONED | after } else { after }, Ordering::Release);
    conclude_or_poison(result)
}

fn take_shown(world: &isocoat_world) -> Checked<()> {
    let idle = |state| if state == SHOWN { Some(SHOWN | WRITING) } else { None };
    world.enter(idle).map_err(|refused| match refused.status {
        // To its playback it is a world like any other.
        ISOCOAT_ERROR_UNSUPPORTED => refusal(0),
        _ => refused,
    })
}

/// Lets `close` destroy what a world is part of that shows a recording, when nobody uses it.
///
/// # Safety
/// `world` is live.
pub(super) unsafe fn close_shown(world: *const isocoat_world, close: impl FnOnce()) -> isocoat_status {
    // SAFETY: live, as the caller promises; not used any more after `close` has begun.
    let state = unsafe { &(*world).state };
    let idle = |state| if state & (WRITING | READERS) == 0 { Some(WRITING) } else { None };
    if let Err(state) = state.fetch_update(Ordering::Acquire, Ordering::Relaxed, idle) {
        return report(refusal(state & (WRITING | READERS)));
    }
    // A poisoned world may fail to come apart; what is left of it then leaks.
    let _ = catch(close);
    ISOCOAT_OK
}

/// Destroys a world that nobody uses, poisoned or not.
///
/// # Safety
/// `world` is NULL or a live world, made by `Box::into_raw`; unless the call is refused it is gone afterwards.
pub(super) unsafe fn destroy(world: *mut isocoat_world) -> isocoat_status {
    if world.is_null() {
        return ISOCOAT_OK;
    }
    let idle = |state| if state & !POISONED == 0 { Some(WRITING) } else { None };
    // SAFETY: not NULL, so live.
    if let Err(state) = unsafe { &(*world).state }.fetch_update(Ordering::Acquire, Ordering::Relaxed, idle) {
        return report(refusal(state & !POISONED));
    }
    // SAFETY: live, made by `Box::into_raw`, and nobody is inside.
    let world = unsafe { Box::from_raw(world) };
    // A poisoned world may fail to come apart; what is left of it then leaks.
    let _ = catch(|| drop(world));
    ISOCOAT_OK
}

fn null_world() -> Refusal {
    Refusal::argument("world is NULL")
}

fn conclude(result: Checked<()>) -> isocoat_status {
    match result {
        Ok(()) => ISOCOAT_OK,
        Err(refusal) => report(refusal),
    }
}

fn conclude_or_poison(result: Result<Checked<()>, String>) -> isocoat_status {
    match result {
        Ok(result) => conclude(result),
        Err(text) => {
            let message = format!("internal error: {text}; the world is unusable from now on: destroy it");
            report(Refusal::new(ISOCOAT_ERROR_POISONED, message))
        }
    }
}

thread_local! {
    /// This thread is inside a guarded call, and not in a callback of the host.
    static GUARDED: Cell<bool> = const { Cell::new(false) };
    /// What the hook has seen.
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Sets the flag until dropped.
struct Guarded {
    before: bool,
}

impl Guarded {
    fn set(value: bool) -> Self {
        Self { before: GUARDED.try_with(|guarded| guarded.replace(value)).unwrap_or(false) }
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        let _ = GUARDED.try_with(|guarded| guarded.set(self.before));
    }
}

/// Runs library code; a panic comes back as its text.
fn catch<T>(call: impl FnOnce() -> T) -> Result<T, String> {
    set_hook();
    let _guarded = Guarded::set(true);
    // Unwind safety: a world that was being used is poisoned, and never looked into again.
    catch_unwind(AssertUnwindSafe(call)).map_err(|payload| {
        let seen = PANIC.try_with(|seen| std::mem::take(&mut *seen.borrow_mut())).unwrap_or_default();
        if seen.is_empty() { payload_text(&*payload).to_owned() } else { seen }
    })
}

/// Runs work of the library on a thread that the host lends: its panics are kept for the step, and not printed.
pub(super) fn inside<T>(work: impl FnOnce() -> T) -> T {
    let _inside = Guarded::set(true);
    work()
}

/// Runs a callback of the host: its own panics, if it is Rust too, are none of the library's business.
pub(super) fn outside<T>(callback: impl FnOnce() -> T) -> T {
    let _outside = Guarded::set(false);
    callback()
}

fn payload_text(payload: &(dyn Any + Send)) -> &str {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("panic")
}

fn set_hook() {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let next = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |info| {
            if !GUARDED.try_with(Cell::get).unwrap_or(false) {
                return next(info);
            }
            let text = payload_text(info.payload());
            let text = info.location().map_or_else(|| text.to_owned(), |at| format!("{text} ({at})"));
            let _ = PANIC.try_with(|seen| *seen.borrow_mut() = text);
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::WorldDesc;

    fn world() -> *mut isocoat_world {
        Box::into_raw(Box::new(isocoat_world::new(World::new(WorldDesc::default()).unwrap())))
    }

    fn message() -> String {
        let mut buffer = [0u8; 512];
        // SAFETY: the buffer is as long as it says.
        let length = unsafe { crate::capi::status::isocoat_last_error(buffer.as_mut_ptr().cast(), buffer.len()) };
        String::from_utf8(buffer[..length].to_vec()).unwrap()
    }

    #[test]
    fn a_panic_poisons_the_world_and_leaves_only_destroy() {
        let world = world();
        // SAFETY: the world lives until `destroy`.
        unsafe {
            assert_eq!(write(world, |_| panic!("the reason {}", 7)), ISOCOAT_ERROR_POISONED);
            assert!(message().contains("the reason 7 (src/capi/guard.rs:"), "{}", message());
            assert_eq!(write(world, |_| Ok(())), ISOCOAT_ERROR_POISONED);
            assert_eq!(read(world, |_| Ok(())), ISOCOAT_ERROR_POISONED);
            assert_eq!(destroy(world), ISOCOAT_OK);
        }
    }

    #[test]
    fn a_panic_in_a_reader_poisons_but_lets_the_others_finish() {
        let world = world();
        // SAFETY: the world lives until `destroy`.
        unsafe {
            let status = read(world, |_| {
                assert_eq!(read(world, |_| panic!("inner")), ISOCOAT_ERROR_POISONED);
                assert_eq!(destroy(world), ISOCOAT_ERROR_LOCKED);
                Ok(())
            });
            assert_eq!(status, ISOCOAT_OK);
            assert_eq!(read(world, |_| Ok(())), ISOCOAT_ERROR_POISONED);
            assert_eq!(destroy(world), ISOCOAT_OK);
        }
    }

    #[test]
    fn readers_share_and_writers_are_alone() {
        let world = world();
        // SAFETY: the world lives until `destroy`.
        unsafe {
            let status = read(world, |_| {
                assert_eq!(read(world, |_| Ok(())), ISOCOAT_OK);
                assert_eq!(write(world, |_| Ok(())), ISOCOAT_ERROR_LOCKED);
                assert!(message().contains("being read"));
                Ok(())
            });
            assert_eq!(status, ISOCOAT_OK);
            let status = write(world, |_| {
                assert_eq!(read(world, |_| Ok(())), ISOCOAT_ERROR_LOCKED);
                assert_eq!(write(world, |_| Ok(())), ISOCOAT_ERROR_LOCKED);
                assert_eq!(destroy(world), ISOCOAT_ERROR_LOCKED);
                Ok(())
            });
            assert_eq!(status, ISOCOAT_OK);
            assert_eq!(write(world, |_| Ok(())), ISOCOAT_OK);
            assert_eq!(destroy(world), ISOCOAT_OK);
            assert_eq!(destroy(std::ptr::null_mut()), ISOCOAT_OK);
        }
    }

    #[test]
    fn concurrent_readers_and_writers_never_meet() {
        struct Shared(*mut isocoat_world);
        // SAFETY: the lock under test is what makes sharing sound.
        unsafe impl Sync for Shared {}
        let shared = Shared(world());
        let (inside, done) = (AtomicU32::new(0), AtomicU32::new(0));
        std::thread::scope(|scope| {
            for thread in 0..4 {
                let (shared, inside, done) = (&shared, &inside, &done);
                scope.spawn(move || {
                    for _ in 0..2000 {
                        // SAFETY: the world lives until all threads have ended.
                        let status = unsafe {
                            if thread == 0 {
                                write(shared.0, |_| {
                                    assert_eq!(inside.load(Ordering::SeqCst), 0);
                                    Ok(())
                                })
                            } else {
                                read(shared.0, |_| {
                                    inside.fetch_add(1, Ordering::SeqCst);
                                    std::hint::spin_loop();
                                    inside.fetch_sub(1, Ordering::SeqCst);
                                    Ok(())
                                })
                            }
                        };
                        assert!(status == ISOCOAT_OK || status == ISOCOAT_ERROR_LOCKED);
                        done.fetch_add(u32::from(status == ISOCOAT_OK), Ordering::Relaxed);
                    }
                });
            }
        });
        assert!(done.load(Ordering::Relaxed) > 0);
        // SAFETY: the threads have ended.
        assert_eq!(unsafe { destroy(shared.0) }, ISOCOAT_OK);
    }
}
