//! What several benchmarks need.

/// Numbers between -1 and 1, the same in every run (a Weyl sequence).
pub fn numbers() -> impl FnMut() -> f64 {
    let mut state = 0.5_f64;
    move || {
        state = (state + 0.618_033_988_749_894_9).fract();
        2.0 * state - 1.0
    }
}
