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

/// Who works at a step: the thread that steps, and perhaps a crew.
pub struct Team<'a> {
    crew: Option<&'a Crew>,
}

/// The thread that steps and those who help it.
///
/// Handing a job over takes as long as two cores take to tell each other two things. So every worker has a share of the
/// blocks, in the same place each time, and counts them on a line of memory of its own; only who is through with its
/// share looks at those of others, and does what they have not begun.
struct Crew {
    workers: usize,
    main: usize,
    /// Helpers that came.
    arrived: AtomicUsize,
    /// A job is being done; what is asked for meanwhile, its asker does alone.
    busy: AtomicBool,
    job: Line<Job>,
    /// Of each worker's share: number of the job in the upper half, blocks begun and blocks done in the quarters of the
    /// lower. One with the number of another job has begun nothing.
    shares: [Line<AtomicU64>; MOST_WORKERS],
    panic: Mutex<Option<Box<dyn Any + Send>>>,
}

/// A job, together, so that who looks for work gets it at once.
#[derive(Default)]
struct Job {
    /// Number of the job in the upper half, how many blocks it has in the lower; or [`OVER`].
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

/// In place of a job, when the step is over.
const OVER: u64 = u64::MAX;

/// What tells threads apart that live at the same time. The standard library's own id asks for memory, which a thread of
/// the host may never give back.
fn this_thread() -> usize {
    thread_local! {
        static MARK: Cell<u8> = const { Cell::new(0) };
    }
    MARK.with(|mark| std::ptr::from_ref(mark).addr())
}

type Caller = unsafe fn(*const (), Range<usize>);

impl Crew {
    fn new(workers: usize) -> Self {
        Self {
            workers,
            main: this_thread(),
            arrived: AtomicUsize::new(0),
            busy: AtomicBool::new(false),
            job: Line::default(),
            shares: [const { Line(AtomicU64::new(0)) }; MOST_WORKERS],
            panic: Mutex::new(None),
        }
    }

    /// What a helper does, until the work of the step is done.
    fn help(&self) {
        // A host may run a task at once where it is handed over: there it would wait for itself.
        if this_thread() == self.main {
            return;
        }
        let own = 1 + self.arrived.fetch_add(1, Ordering::Relaxed);
        if own >= self.workers {
            return;
        }
        let (mut last, mut idle) = (0, 0);
        loop {
            let open = self.job.0.open.load(Ordering::Acquire);
            if open == OVER {
                return;
            }
            if open != last {
                self.take_blocks(own, open);
                (last, idle) = (open, 0);
            } else if idle < PATIENCE {
                idle += 1;
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }

    /// Does a job, together with who comes.
    fn work_at<F: Fn(Range<usize>) + Sync>(&self, count: usize, block: usize, blocks: usize, work: &F) {
        unsafe fn call<F: Fn(Range<usize>)>(work: *const (), range: Range<usize>) {
            // SAFETY: `work` is the closure of this type that `work_at` has published; see `take_block`.
            unsafe { (*work.cast::<F>())(range) }
        }
        let job = &self.job.0;
        job.closure.store(std::ptr::from_ref(work).cast_mut().cast(), Ordering::Relaxed);
        job.caller.store(call::<F> as Caller as *mut (), Ordering::Relaxed);
        job.count.store(count, Ordering::Relaxed);
        job.block.store(block, Ordering::Relaxed);
        let number = ((job.open.load(Ordering::Relaxed) >> 32) as u32).wrapping_add(1);
        let open = u64::from(number) << 32 | blocks as u64;
        job.open.store(open, Ordering::Release);
        self.take_blocks(0, open);
        for (share, line) in self.shares[..self.workers].iter().enumerate() {
            let size = self.share_of(share, blocks).len() as u64;
            let done = u64::from(number) << 32 | size << 16 | size;
            let mut waited = 0;
            while size > 0 && line.0.load(Ordering::Acquire) != done {
                waited += 1;
                if waited < PATIENCE { std::hint::spin_loop() } else { std::thread::yield_now() }
            }
        }
    }

    /// The blocks that are a worker's to begin with.
    fn share_of(&self, worker: usize, blocks: usize) -> Range<usize> {
        worker * blocks / self.workers..(worker + 1) * blocks / self.workers
    }

    /// Does what nobody has begun of a job: first of the worker's own share, then of the others'.
    fn take_blocks(&self, own: usize, open: u64) {
        for share in (own..self.workers).chain(0..own) {
            while self.take_block(share, open) {}
        }
    }

    /// Does one block of a share. False when all are begun, or the job is no longer the one that is open.
    fn take_block(&self, share: usize, open: u64) -> bool {
        let (number, blocks) = ((open >> 32) as u32, open as u32 as usize);
        let range = self.share_of(share, blocks);
        let line = &self.shares[share].0;
        let mut word = line.load(Ordering::Relaxed);
        let index = loop {
            let ahead = ((word >> 32) as u32).wrapping_sub(number) as i32;
            let (begun, done) = if ahead == 0 { (word >> 16 & 0xffff, word & 0xffff) } else { (0, 0) };
            if ahead > 0 || begun as usize == range.len() {
                return false;
            }
            let next = u64::from(number) << 32 | (begun + 1) << 16 | done;
            match line.compare_exchange_weak(word, next, Ordering::Acquire, Ordering::Relaxed) {
                Ok(_) => break range.start + begun as usize,
                Err(now) => word = now,
            }
        };
        // The job is still open: before another one is, each share that has blocks bears this one's number, all begun
        // and all done, and this block is not done yet. So what is read here belongs to it.
        let job = &self.job.0;
        let (closure, caller) = (job.closure.load(Ordering::Relaxed), job.caller.load(Ordering::Relaxed));
        let (count, block) = (job.count.load(Ordering::Relaxed), job.block.load(Ordering::Relaxed));
        let first = index * block;
        // SAFETY: `caller` is a `Caller`: only `work_at` stores there, before the job is opened.
        let caller = unsafe { std::mem::transmute::<*mut (), Caller>(caller) };
        // SAFETY: `work_at` does not return before this block is done, so that the closure is still there. It is `Sync`,
        // so that it may be called from here.
        let result = catch_unwind(AssertUnwindSafe(|| unsafe { caller(closure, first..count.min(first + block)) }));
        if let Err(panic) = result {
            *self.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some(panic);
        }
        line.fetch_add(1, Ordering::Release);
        true
    }
}

impl Team<'_> {
    /// The thread that steps, alone.
    pub fn alone() -> Self {
        Self { crew: None }
    }

    /// Does `work` with a team of the host's threads.
    pub fn with(tasks: Option<&mut (dyn Tasks + 'static)>, work: impl FnOnce(&Team)) {
        let workers = tasks.as_ref().map_or(1, |tasks| tasks.workers().clamp(1, MOST_WORKERS));
        let Some(tasks) = tasks.filter(|_| workers > 1) else { return work(&Team::alone()) };
        let crew = Crew::new(workers);
        let mut work = Some(work);
        let mut main = || {
            // Helpers go home even if the work panics.
            let _stop = Stop(&crew);
            if let Some(work) = work.take() {
                work(&Team { crew: Some(&crew) });
            }
        };
        tasks.join(workers - 1, &|| crew.help(), &mut main);
        // Nothing is left to do, unless the host did not call it.
        main();
    }

    /// Workers at most.
    pub fn workers(&self) -> usize {
        self.crew.map_or(1, |crew| crew.workers)
    }

    /// A size of blocks for `count` places of equal work, of at least `least`.
    pub fn share(&self, count: usize, least: usize) -> usize {
        count.div_ceil(2 * self.workers()).max(least)
    }

    /// Calls `work` with ranges that make up `0..count`, of `block` places but for the last.
    pub fn each(&self, count: usize, block: usize, work: impl Fn(Range<usize>) + Sync) {
        let block = block.max(count.div_ceil(MOST_BLOCKS));
        let blocks = count.div_ceil(block);
        let free = |crew: &&Crew| blocks > 1 && !crew.busy.swap(true, Ordering::Relaxed);
        let Some(crew) = self.crew.filter(free) else {
            if count > 0 {
                work(0..count);
            }
            return;
        };
        crew.work_at(count, block, blocks, &work);
        crew.busy.store(false, Ordering::Relaxed);
        let panic = crew.panic.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take();
        if let Some(panic) = panic {
            resume_unwind(panic);
        }
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

    /// Calls `work` for each `size` items in a row, with the number of the row and its result. Each worker
    /// has as many rows in one go as there are for it: where this is a matter of microseconds, what it had in its cache
    /// counts for more than who is done first.
    pub fn each_row<T: Send, R: Send>(
        &self,
        items: &mut [T],
        size: usize,
        results: &mut [R],
        work: impl Fn(usize, &mut [T], &mut R) + Sync,
    ) {
        let count = items.len();
        assert_eq!(results.len(), count.div_ceil(size), "a result for each row");
        let all = Shared(items.as_mut_ptr());
        let block = count.div_ceil(size).div_ceil(self.workers()).max(1);
        self.each_mut(results, block, |row, result| {
            let (first, end) = (row * size, count.min((row + 1) * size));
            // SAFETY: within the slice, which is borrowed until `each_mut` is done; rows do not overlap, and each goes
            // with one result, so that nobody else has these items.
            let items = unsafe { std::slice::from_raw_parts_mut(all.at(first), end - first) };
            work(row, items, result);
        });
    }

    /// Calls `work` with the number of each piece, and the piece: the first goes up to the first of `ends`, which are in
    /// order, the next from there to the second.
    pub fn each_piece<T: Send>(&self, items: &mut [T], ends: &[usize], work: impl Fn(usize, &mut [T]) + Sync) {
        assert!(ends.is_sorted() && ends.last().is_none_or(|end| *end <= items.len()), "pieces in order, of the items");
        let all = Shared(items.as_mut_ptr());
        self.each(ends.len(), ends.len().div_ceil(self.workers()).max(1), |range| {
            for piece in range {
                let (first, end) = (if piece == 0 { 0 } else { ends[piece - 1] }, ends[piece]);
                // SAFETY: within the slice, which is borrowed until `each` is done; pieces do not overlap, and ranges
                // neither, so that nobody else has these items.
                work(piece, unsafe { std::slice::from_raw_parts_mut(all.at(first), end - first) });
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
struct Stop<'a>(&'a Crew);

impl Drop for Stop<'_> {
    fn drop(&mut self) {
        self.0.job.0.open.store(OVER, Ordering::Release);
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
                    }
                }
            });
        }
    }

    #[test]
    fn pieces_are_worked_at_whole() {
        for workers in [1, 2, 5] {
            Team::with(Some(&mut Threads(workers)), |team| {
                let mut items = [9u32; 12];
                team.each_piece(&mut items, &[0, 3, 3, 4, 10], |piece, items| items.fill(piece as u32));
                assert_eq!(items, [1, 1, 1, 3, 4, 4, 4, 4, 4, 4, 9, 9]);
            });
        }
    }

    #[test]
    fn rows_are_worked_at_whole_and_give_their_results_in_order() {
        for workers in [1, 2, 5] {
            Team::with(Some(&mut Threads(workers)), |team| {
                let (mut items, mut sums) = ([1u32; 50], [0u32; 8]);
                team.each_row(&mut items, 7, &mut sums, |row, items, sum| {
                    items.iter_mut().for_each(|item| *item += row as u32);
                    *sum = items.iter().sum();
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
}
