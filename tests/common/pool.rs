//! A host's threads, which last from step to step.

use std::sync::{Arc, Condvar, Mutex};

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

/// Threads that wait for work.
pub struct Pool {
    workers: usize,
    shared: Arc<(Mutex<State>, Condvar)>,
    threads: Vec<std::thread::JoinHandle<()>>,
}

impl Pool {
    /// For `workers`, the thread that steps included.
    pub fn new(workers: usize) -> Self {
        let shared: Arc<(Mutex<State>, Condvar)> = Arc::default();
        let thread = |_| {
            let shared = Arc::clone(&shared);
            std::thread::spawn(move || {
                let (state, changed) = &*shared;
                let mut state = state.lock().unwrap();
                while !state.closed {
                    let Some(helper) = state.waiting.pop() else {
                        state = changed.wait(state).unwrap();
                        continue;
                    };
                    state.at_work += 1;
                    drop(state);
                    // SAFETY: `join` waits for it before what it points to ends.
                    unsafe { (*helper.0)() };
                    state = shared.0.lock().unwrap();
                    state.at_work -= 1;
                    changed.notify_all();
                }
            })
        };
        Self { workers, threads: (1..workers).map(thread).collect(), shared }
    }
}

impl Tasks for Pool {
    fn workers(&self) -> usize {
        self.workers
    }

    fn join(&mut self, helpers: usize, helper: &(dyn Fn() + Sync), main: &mut dyn FnMut()) {
        let (state, changed) = &*self.shared;
        // SAFETY: only the lifetime changes, and nobody has the pointer any more when this function ends.
        let helper: *const (dyn Fn() + Sync) = unsafe { std::mem::transmute(std::ptr::from_ref(helper)) };
        state.lock().unwrap().waiting.extend((0..helpers).map(|_| Helper(helper)));
        changed.notify_all();
        let result = std::panic::catch_unwind(std::panic::AssertUnwindSafe(main));
        let mut state = state.lock().unwrap();
        state.waiting.clear();
        while state.at_work > 0 {
            state = changed.wait(state).unwrap();
        }
        drop(state);
        if let Err(panic) = result {
            std::panic::resume_unwind(panic);
        }
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        self.shared.0.lock().unwrap().closed = true;
        self.shared.1.notify_all();
        for thread in self.threads.drain(..) {
            thread.join().unwrap();
        }
    }
}
