//! A host's threads, which last from step to step.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex};
use std::time::{Duration, Instant};

use isocoat::Tasks;

/// A helper with its lifetime taken off; it is waited for.
struct Helper(*const (dyn Fn() + Sync));
// SAFETY: it points to what is `Sync`, and lives until all who call it are done.
unsafe impl Send for Helper {}

#[derive(Default)]
struct State {
    waiting: Vec<Helper>,
    at_work: usize,
    closed: bool,
}

#[derive(Default)]
struct Shared {
    state: Mutex<State>,
    changed: Condvar,
    /// How often help was called for.
    calls: AtomicUsize,
}

/// How long a thread looks out for work before it sleeps, as those of engines do: to be woken takes as long as the step
/// of a small scene.
const PATIENCE: Duration = Duration::from_micros(200);

impl Shared {
    fn work(&self) {
        let mut state = self.state.lock().unwrap();
        while !state.closed {
            if let Some(helper) = state.waiting.pop() {
                state.at_work += 1;
                drop(state);
                // SAFETY: `join` waits for it before what it points to ends.
                unsafe { (*helper.0)() };
                state = self.state.lock().unwrap();
                state.at_work -= 1;
                self.changed.notify_all();
                continue;
            }
            let calls = self.calls.load(Ordering::Relaxed);
            drop(state);
            let idle = Instant::now();
            while self.calls.load(Ordering::Relaxed) == calls && idle.elapsed() < PATIENCE {
                std::hint::spin_loop();
            }
            state = self.state.lock().unwrap();
            if state.waiting.is_empty() && !state.closed && self.calls.load(Ordering::Relaxed) == calls {
                state = self.changed.wait(state).unwrap();
            }
        }
    }
}

/// Threads that wait for work.
pub struct Pool {
    workers: usize,
    shared: Arc<Shared>,
    threads: Vec<std::thread::JoinHandle<()>>,
}

impl Pool {
    /// For `workers`, the thread that steps included.
    pub fn new(workers: usize) -> Self {
        let shared: Arc<Shared> = Arc::default();
        let thread = |_| {
            let shared = Arc::clone(&shared);
            std::thread::spawn(move || shared.work())
        };
        Self { workers, threads: (1..workers).map(thread).collect(), shared }
    }
}

impl Tasks for Pool {
    fn workers(&self) -> usize {
        self.workers
    }

    fn join(&mut self, helpers: usize, helper: &(dyn Fn() + Sync), main: &mut dyn FnMut()) {
        let Shared { state, changed, calls } = &*self.shared;
        // SAFETY: only the lifetime changes, and nobody has the pointer any more when this function ends.
        let helper: *const (dyn Fn() + Sync) = unsafe { std::mem::transmute(std::ptr::from_ref(helper)) };
        let mut called = state.lock().unwrap();
        called.waiting.extend((0..helpers).map(|_| Helper(helper)));
        calls.fetch_add(1, Ordering::Relaxed);
        drop(called);
        changed.notify_all();
        let result = catch_unwind(AssertUnwindSafe(main));
        let mut state = state.lock().unwrap();
        state.waiting.clear();
        while state.at_work > 0 {
            state = changed.wait(state).unwrap();
        }
        drop(state);
        if let Err(panic) = result {
            resume_unwind(panic);
        }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.shared.state.lock().unwrap().closed = true;
        self.shared.calls.fetch_add(1, Ordering::Relaxed);
        self.shared.changed.notify_all();
        for thread in self.threads.drain(..) {
            thread.join().unwrap();
        }
    }
}
