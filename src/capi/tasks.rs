//! Threads that the host lends for the time of a step.

use libc::c_void;

use super::guard::{self, inside, isocoat_world, outside, write};
use super::pointer::Context;
use super::status::{Refusal, isocoat_status};
use crate::team::{MOST_WORKERS, Tasks};

/// Work of a step, for a thread of the host: to be called once, with the pointer that came along. It returns when the
/// step has no more to do.
///
/// - task: as given to isocoat_enqueue_task_fn.
pub type isocoat_task_fn = Option<unsafe extern "C" fn(task: *mut c_void)>;

/// Hands a task to the host's threads; called in a step, on the thread that steps, up to worker_count - 1 times before
/// the work begins.
///
/// - context: as given to isocoat_world_set_tasks.
/// - run, task: what a thread of the host is to call, run(task), as soon as it can. A call on the thread that steps is
///   wasted: it returns at once.
///
/// Returns what isocoat_finish_task_fn needs to know it by; NULL refuses it, and the step does without. It must return
/// (no longjmp, no exception); calls on the world from here give ISOCOAT_ERROR_LOCKED.
pub type isocoat_enqueue_task_fn =
    Option<unsafe extern "C" fn(context: *mut c_void, run: isocoat_task_fn, task: *mut c_void) -> *mut c_void>;

/// Waits for a task; called in a step, on the thread that steps, once for each that was taken.
///
/// - context: as given to isocoat_world_set_tasks.
/// - handle: what isocoat_enqueue_task_fn returned for it.
///
/// It must return, when the task has returned or will never be run any more.
pub type isocoat_finish_task_fn = Option<unsafe extern "C" fn(context: *mut c_void, handle: *mut c_void)>;

struct Threads {
    workers: usize,
    enqueue: unsafe extern "C" fn(*mut c_void, isocoat_task_fn, *mut c_void) -> *mut c_void,
    finish: unsafe extern "C" fn(*mut c_void, *mut c_void),
    context: Context,
}

/// Tasks that the host has taken; waited for when dropped.
struct Taken<'a> {
    threads: &'a Threads,
    handles: [*mut c_void; MOST_WORKERS],
    count: usize,
}

impl Drop for Taken<'_> {
    fn drop(&mut self) {
        for handle in &self.handles[..self.count] {
            // SAFETY: the host's function takes its own context and its own handle.
            outside(|| unsafe { (self.threads.finish)(self.threads.context.pointer(), *handle) });
        }
    }
}

/// What a thread of the host runs.
unsafe extern "C" fn run(task: *mut c_void) {
    // SAFETY: `task` is the reference in `join`, which lives until the host has been waited for.
    let helper = unsafe { *task.cast::<&(dyn Fn() + Sync)>() };
    inside(helper);
}

impl Tasks for Threads {
    fn workers(&self) -> usize {
        self.workers
    }

    fn join(&mut self, helpers: usize, helper: &(dyn Fn() + Sync), main: &mut dyn FnMut()) {
        let task = (&raw const helper).cast_mut().cast();
        let mut taken = Taken { threads: self, handles: [std::ptr::null_mut(); MOST_WORKERS], count: 0 };
        for _ in 0..helpers {
            // SAFETY: the host's function takes its own context, and a task that lives until it has been waited for.
            let handle = outside(|| unsafe { (self.enqueue)(self.context.pointer(), Some(run), task) });
            if handle.is_null() {
                break;
            }
            taken.handles[taken.count] = handle;
            taken.count += 1;
        }
        main();
    }
}

/// Sets whose threads help with the steps of a world. Without, a step is the work of the thread that calls it; the
/// library starts no threads. Results are the same bits for any number of workers, and whatever the host's threads do.
///
/// - world: not NULL.
/// - worker_count: how many may work at once, the thread that steps included: from 1 to 64. Helpers keep their threads
///   busy for the whole step: not more than there are cores.
/// - enqueue, finish: the functions; both NULL for none.
/// - context: given to them, otherwise unused; may be NULL. It must outlive the world or the next set.
///
/// Errors: OUT_OF_RANGE, INVALID_ARGUMENT. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_set_tasks(
    world: *mut isocoat_world,
    worker_count: u32,
    enqueue: isocoat_enqueue_task_fn,
    finish: isocoat_finish_task_fn,
    context: *mut c_void,
) -> isocoat_status {
    let set = |inner: &mut guard::Inner| {
        let workers = worker_count as usize;
        crate::error::require("worker_count", workers as f64, "from 1 to 64", |x| {
            (1.0..=MOST_WORKERS as f64).contains(&x)
        })?;
        inner.world.set_tasks(match (enqueue, finish) {
            (Some(enqueue), Some(finish)) => {
                Some(Box::new(Threads { workers, enqueue, finish, context: Context(context) }))
            }
            (None, None) => None,
            (None, _) => return Err(Refusal::argument("enqueue is NULL, and finish is not")),
            (_, None) => return Err(Refusal::argument("finish is NULL, and enqueue is not")),
        });
        Ok(())
    };
    // SAFETY: NULL or a live world.
    unsafe { write(world, set) }
}
