//! Work of one step, side by side. The library has no threads of its own: the host lends them, through [`Tasks`].
//!
//! A [`Team`] lives for one step. The thread that steps cuts a job into blocks, and takes them one after the other;
//! whoever helps takes some away. Every block writes to its own places only, and what is summed up is summed up
//! afterwards in the order of the places: so nobody's speed, number or absence can change a bit.

use std::any::Any;
use std::cell::Cell;
use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicPtr, AtomicU64, AtomicUsize, Ordering};

/// Most workers of a world.
pub const MOST_WORKERS: usize = 64;

/// Threads of the host, for the time of a step. With the standard library:
///
/// ```
/// struct Threads(usize);
///
/// impl isocoat::Tasks for Threads {
///     fn workers(&self) -> usize {
///         self.0
///     }
///     fn join(&mut self, helpers: usize, helper: &(dyn Fn() + Sync), main: &mut dyn FnMut()) {
///         std::thread::scope(|scope| {
///             (0..helpers).for_each(|_| drop(scope.spawn(helper)));
///             main();
///         });
///     }
/// }
/// ```
pub trait Tasks: Send {
    /// How many may work at once, the thread that steps included: counts from 1 to [`MOST_WORKERS`], and is read once
    /// a step.
    fn workers(&self) -> usize;

    /// Calls `main` on this thread, and meanwhile `helper` up to `helpers` times, each time on another thread. Returns
    /// when all that were called have returned. A helper returns soon after `main` has; fewer of them, or late ones,
    /// cost time only.
    fn join(&mut self, helpers: usize, helper: &(dyn Fn() + Sync), main: &mut dyn FnMut());
}

/// Looks for work after which an idle helper lets other threads have its core.
const PATIENCE: u32 = 10_000;

/// Who works at a step.
pub struct Team {
    helpers: usize,
    main: usize,
    /// A job is being done; what is asked for meanwhile, its asker does alone.
    busy: AtomicBool,
    job: Line<Job>,
    /// Blocks of the job that are done.
    done: Line<AtomicUsize>,
    /// Read all the time by those who look for work, and written once.
    stopped: Line<AtomicBool>,
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

/// A job, together, so that who looks for work gets it at once.
#[derive(Default)]
struct Job {
    /// Number of the job in the upper half; the blocks that nobody has taken, from which one and up to which one, in
    /// the quarters of the lower.
    open: AtomicU64,
    /// A closure and who can call it, how many places it has, and how many of them make a block. Changed only while no
    /// block is open or at work.
    closure: AtomicPtr<()>,
    caller: AtomicPtr<()>,
    count: AtomicUsize,
    block: AtomicUsize,
}

/// What many threads write to lies by itself, so that they do not take each other's neighbours away.
#[derive(Default)]
#[repr(align(128))]
struct Line<T>(T);

/// Most blocks of a job.
const MOST_BLOCKS: usize = u16::MAX as usize;

/// What tells threads apart that live at the same time. The standard library's own id asks for memory, which a thread of
/// the host may never give back.
fn this_thread() -> usize {
    thread_local! {
        static MARK: Cell<u8> = const { Cell::new(0) };
    }
    MARK.with(|mark| std::ptr::from_ref(mark).addr())
}

type Caller = unsafe fn(*const (), Range<usize>);

impl Team {
    /// The thread that steps, alone.
    pub fn alone() -> Self {
        Self::new(0)
    }

    fn new(helpers: usize) -> Self {
        Self {
            helpers,
            main: this_thread(),
            busy: AtomicBool::new(false),
            job: Line::default(),
            done: Line::default(),
            stopped: Line::default(),
            panic: Mutex::new(None),
        }
    }

    /// Does `work` with a team of the host's threads.
    pub fn with(tasks: Option<&mut (dyn Tasks + 'static)>, work: impl FnOnce(&Team)) {
        let workers = tasks.as_ref().map_or(1, |tasks| tasks.workers().clamp(1, MOST_WORKERS));
        let team = Team::new(workers - 1);
        let mut work = Some(work);
        let mut main = || {
            // Helpers go home even if the work panics.
            let _stop = Stop(&team);
            if let Some(work) = work.take() {
                work(&team);
            }
        };
        match tasks {
            Some(tasks) if workers > 1 => tasks.join(workers - 1, &|| team.help(), &mut main),
            _ => {}
        }
        // Nothing is left to do, unless the host did not call it.
        main();
    }

    /// Workers at most.
    pub fn workers(&self) -> usize {
        self.helpers + 1
    }

    /// What a helper does, until the work of the step is done.
    fn help(&self) {
        // A host may run a task at once where it is handed over: there it would wait for itself.
        if this_thread() == self.main {
            return;
        }
        let mut idle = 0;
        while !self.stopped.0.load(Ordering::Acquire) {
            if self.take_block(true) {
                idle = 0;
            } else if idle < PATIENCE {
                idle += 1;
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }

    /// A size of blocks for `count` places of equal work, of at least `least`.
    pub fn share(&self, count: usize, least: usize) -> usize {
        count.div_ceil(2 * self.workers()).max(least)
    }

    /// Calls `work` with ranges that make up `0..count`, of `block` places but for the last.
    pub fn each(&self, count: usize, block: usize, work: impl Fn(Range<usize>) + Sync) {
        self.each_of(count, block, &work);
    }

    fn each_of<F: Fn(Range<usize>) + Sync>(&self, count: usize, block: usize, work: &F) {
        unsafe fn call<F: Fn(Range<usize>)>(work: *const (), range: Range<usize>) {
            // SAFETY: `work` is the closure of this type that `each_of` has published; see `take_block`.
            unsafe { (*work.cast::<F>())(range) }
        }
        let block = block.max(count.div_ceil(MOST_BLOCKS));
        let blocks = count.div_ceil(block);
        if blocks < 2 || self.helpers == 0 || self.busy.swap(true, Ordering::Relaxed) {
            if count > 0 {
                work(0..count);
            }
            return;
        }
        self.done.0.store(0, Ordering::Relaxed);
        let job = &self.job.0;
        job.closure.store(std::ptr::from_ref(work).cast_mut().cast(), Ordering::Relaxed);
        job.caller.store(call::<F> as Caller as *mut (), Ordering::Relaxed);
        job.count.store(count, Ordering::Relaxed);
        job.block.store(block, Ordering::Relaxed);
        let number = (job.open.load(Ordering::Relaxed) >> 32) + 1;
        job.open.store(number << 32 | blocks as u64, Ordering::Release);
        while self.take_block(false) {}
        let mut waited = 0;
        while self.done.0.load(Ordering::Acquire) < blocks {
            waited += 1;
            if waited < PATIENCE { std::hint::spin_loop() } else { std::thread::yield_now() }
        }
        self.busy.store(false, Ordering::Relaxed);
        let panic = self.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
    }

    /// Does one block, from one end or the other: who always takes the same end finds its own work of the last job in its
    /// cache. False when none is open.
    fn take_block(&self, last: bool) -> bool {
        let job = &self.job.0;
        let open = job.open.load(Ordering::Acquire);
        let (low, high) = ((open >> 16 & 0xffff) as usize, (open & 0xffff) as usize);
        if low == high {
            return false;
        }
        let (index, rest) = if last { (high - 1, open - 1) } else { (low, open + (1 << 16)) };
        let (closure, caller) = (job.closure.load(Ordering::Relaxed), job.caller.load(Ordering::Relaxed));
        let (count, block) = (job.count.load(Ordering::Relaxed), job.block.load(Ordering::Relaxed));
        if job.open.compare_exchange(open, rest, Ordering::Acquire, Ordering::Relaxed).is_err() {
            return true;
        }
        let first = index * block;
        // SAFETY: `caller` is a `Caller`: only `each_of` stores there, before the job is opened.
        let caller = unsafe { std::mem::transmute::<*mut (), Caller>(caller) };
        // SAFETY: the four belong to the job whose block was taken: `each_of` changes them only when all blocks of the
        // last job are done, and this one counts as done below. For the same reason the closure is still there. It is
        // `Sync`, so that it may be called from here.
        let result = catch_unwind(AssertUnwindSafe(|| unsafe { caller(closure, first..count.min(first + block)) }));
        if let Err(panic) = result {
            *self.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(panic);
        }
        self.done.0.fetch_add(1, Ordering::Release);
        true
    }

    /// Calls `work` for each item, with its position.
    pub fn each_mut<T: Send>(&self, items: &mut [T], block: usize, work: impl Fn(usize, &mut T) + Sync) {
        let all = Shared(items.as_mut_ptr());
        self.each(items.len(), block, |range| {
            for index in range {
                // SAFETY: within the slice, which is borrowed until `each` is done; ranges do not overlap, so that
                // nobody else has this item.
                work(index, unsafe { &mut *all.at(index) });
            }
        });
    }

    /// Calls `work` for each `size` items in a row, with the number of the row; what it gives goes to `results`.
    pub fn each_row<T: Send, R: Send>(
        &self,
        items: &mut [T],
        size: usize,
        results: &mut [R],
        work: impl Fn(usize, &mut [T]) -> R + Sync,
    ) {
        let count = items.len();
        assert_eq!(results.len(), count.div_ceil(size), "a result for each row");
        let all = Shared(items.as_mut_ptr());
        self.each_mut(results, self.share(count.div_ceil(size), 1), |row, result| {
            let (first, end) = (row * size, count.min((row + 1) * size));
            // SAFETY: within the slice, which is borrowed until `each_mut` is done; rows do not overlap, and each goes
            // with one result, so that nobody else has these items.
            let items = unsafe { std::slice::from_raw_parts_mut(all.at(first), end - first) };
            *result = work(row, items);
        });
    }

    /// Calls `work` for each item at one of `places`, which must be in ascending order, each once.
    pub fn each_at<T: Send>(&self, items: &mut [T], places: &[u32], block: usize, work: impl Fn(&mut T) + Sync) {
        assert!(places.is_sorted_by(|a, b| a < b), "each place once, in order");
        assert!(places.last().is_none_or(|last| (*last as usize) < items.len()), "places within the items");
        let all = Shared(items.as_mut_ptr());
        self.each(places.len(), block, |range| {
            for place in &places[range] {
                // SAFETY: within the slice, which is borrowed until `each` is done; no place comes twice, so that
                // nobody else has this item.
                work(unsafe { &mut *all.at(*place as usize) });
            }
        });
    }
}

/// What is used by one who has it for himself, so that others may share what it is part of.
#[derive(Default)]
pub struct Alone<T>(T);

// SAFETY: nothing can be done with a shared reference to it.
unsafe impl<T> Sync for Alone<T> {}

impl<T> Alone<T> {
    /// The thing.
    pub fn get_mut(&mut self) -> &mut T {
        &mut self.0
    }
}

/// Lets the helpers go when dropped.
struct Stop<'a>(&'a Team);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        self.0.stopped.0.store(true, Ordering::Release);
    }
}

/// The beginning of a slice whose items go to different threads.
struct Shared<T>(*mut T);

// SAFETY: used for items that are `Send`, each by one thread at a time.
unsafe impl<T: Send> Sync for Shared<T> {}

impl<T> Shared<T> {
    /// # Safety
    /// The index is within the slice.
    unsafe fn at(&self, index: usize) -> *mut T {
        // SAFETY: the caller's promise.
        unsafe { self.0.add(index) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Threads that live for one step.
    struct Threads(usize);

    impl Tasks for Threads {
        fn workers(&self) -> usize {
            self.0
        }
        fn join(&mut self, helpers: usize, helper: &(dyn Fn() + Sync), main: &mut dyn FnMut()) {
            std::thread::scope(|scope| {
                (0..helpers).for_each(|_| drop(scope.spawn(helper)));
                main();
            });
        }
    }

    #[test]
    fn every_place_is_worked_at_once_by_any_number_of_workers() {
        for workers in [1, 2, 3, 8] {
            Team::with(Some(&mut Threads(workers)), |team| {
                for count in [0, 1, 2, 5, 64, 1000] {
                    for block in [1, 3, 64] {
                        let mut items = vec![0u32; count];
                        team.each_mut(&mut items, block, |index, item| *item += index as u32);
                        assert!(items.iter().enumerate().all(|(index, item)| *item == index as u32));
                        let places: Vec<u32> = (0..count as u32).filter(|index| index % 3 == 1).collect();
                        team.each_at(&mut items, &places, block, |item| *item = u32::MAX);
                        assert_eq!(items.iter().filter(|item| **item == u32::MAX).count(), places.len());
                    }
                }
            });
        }
    }

    #[test]
    fn rows_are_worked_at_whole_and_give_their_results_in_order() {
        for workers in [1, 2, 5] {
            Team::with(Some(&mut Threads(workers)), |team| {
                let (mut items, mut sums) = ([1u32; 50], [0u32; 8]);
                team.each_row(&mut items, 7, &mut sums, |row, items| {
                    items.iter_mut().for_each(|item| *item += row as u32);
                    items.iter().sum()
                });
                assert_eq!(sums, std::array::from_fn(|row| (row as u32 + 1) * if row == 7 { 1 } else { 7 }));
            });
        }
    }

    #[test]
    fn what_is_asked_for_during_a_job_is_done_all_the_same() {
        Team::with(Some(&mut Threads(4)), |team| {
            let mut sums = [0usize; 40];
            team.each_mut(&mut sums, 1, |outer, sum| {
                let inner = AtomicUsize::new(0);
                team.each(outer, 1, |range| {
                    inner.fetch_add(range.len(), Ordering::Relaxed);
                });
                *sum = inner.into_inner();
            });
            assert!(sums.iter().enumerate().all(|(outer, sum)| *sum == outer));
        });
    }

    #[test]
    fn a_panic_of_a_helper_comes_out_of_the_step_when_all_are_done() {
        let result = catch_unwind(|| {
            Team::with(Some(&mut Threads(4)), |team| {
                team.each(100, 1, |range| assert!(range.start != 50, "the reason"));
            });
        });
        let text = result.unwrap_err();
        assert_eq!(text.downcast_ref::<&str>(), Some(&"the reason"));
    }

    /// A host that runs each task where it gets it, one that forgets the work, and one that calls it twice.
    #[test]
    fn hosts_that_do_as_they_like_cost_time_only() {
        struct Odd(u32);
        impl Tasks for Odd {
            fn workers(&self) -> usize {
                1000
            }
            fn join(&mut self, _helpers: usize, helper: &(dyn Fn() + Sync), main: &mut dyn FnMut()) {
                helper();
                for _ in 0..self.0 {
                    main();
                }
            }
        }
        for calls in 0..3 {
            let mut done = 0;
            Team::with(Some(&mut Odd(calls)), |team| {
                assert_eq!(team.workers(), MOST_WORKERS);
                let all = AtomicUsize::new(0);
                team.each(10, 1, |range| {
                    all.fetch_add(range.len(), Ordering::Relaxed);
                });
                done += all.into_inner();
            });
            assert_eq!(done, 10);
        }
    }

    #[test]
    #[should_panic(expected = "each place once")]
    fn places_that_come_twice_are_refused() {
        Team::alone().each_at(&mut [0; 4], &[1, 1], 1, |_| {});
    }
}
