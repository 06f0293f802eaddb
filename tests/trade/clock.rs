//! Processor time, which other programs on the machine do not lengthen much.

/// Processor time of this process so far \[s\].
pub fn cpu_seconds() -> f64 {
    let mut time = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: writes one timespec.
    let status = unsafe { libc::clock_gettime(libc::CLOCK_PROCESS_CPUTIME_ID, &mut time) };
    assert_eq!(status, 0, "no clock of processor time");
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Processor time of one call \[s\]: the median of some series, each as long as the clock needs.
pub fn time_of<T>(mut call: impl FnMut() -> T) -> f64 {
    const SERIES: usize = 7;
    let mut time = |calls: usize| {
        let begin = cpu_seconds();
        for _ in 0..calls {
            std::hint::black_box(call());
        }
        (cpu_seconds() - begin) / calls as f64
    };
    let once = time(1);
    let calls = (2e-4 / once).clamp(1.0, 200.0) as usize;
    let mut series: Vec<f64> = (0..SERIES).map(|_| time(calls)).collect();
    series.sort_by(f64::total_cmp);
    series[SERIES / 2]
}
