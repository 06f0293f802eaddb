//! A root of a continuous function, from a bracket.

/// The point of `[low, high]` where `f` changes sign, given `f(low) = at_low >= 0 > at_high = f(high)`.
///
/// Illinois steps (regula falsi that halves the value of an end it keeps), with a bisection whenever three of them have
/// not halved the bracket; of the last bracket, the end with the smaller `|f|`. The result depends on the bracket and
/// nothing else. Converges to the last bits of `low` and `high`; rounding that makes `at_low` negative gives `low`.
pub fn bracketed(low: f64, high: f64, at_low: f64, at_high: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let (mut low, mut high, mut f_low, mut f_high) = (low, high, at_low, at_high);
    if f_low <= 0.0 {
        return low;
    }
    // The values that the secant sees: an end that stays is halved.
    let (mut seen_low, mut seen_high) = (f_low, f_high);
    let (mut width, mut patience) = (high - low, 3);
    for _ in 0..200 {
        let secant = low + (high - low) * (seen_low / (seen_low - seen_high));
        let bisect = patience == 0;
        let x = if bisect || !(secant > low && secant < high) { 0.5 * (low + high) } else { secant };
        if x <= low || x >= high || high - low <= 2.0 * f64::EPSILON * low.abs().max(high.abs()) {
            break;
        }
        let value = f(x);
        if value == 0.0 {
            return x;
        }
        if value > 0.0 {
            (low, f_low, seen_low) = (x, value, value);
            seen_high *= 0.5;
        } else {
            (high, f_high, seen_high) = (x, value, value);
            seen_low *= 0.5;
        }
        if high - low <= 0.5 * width {
            (width, patience) = (high - low, 3);
        } else {
            patience = if bisect { 3 } else { patience - 1 };
        }
    }
    if f_low.abs() <= f_high.abs() { low } else { high }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn roots_of_awkward_functions_are_found(root in -5.0..5.0f64, left in 0.01..9.0f64, right in 0.01..9.0f64) {
            let functions: [fn(f64) -> f64; 4] = [
                |x| -x,
                |x| -x * x * x,
                |x| -libm::atan(1e6 * x),
                |x| if x < 0.0 { 1.0 - 1e-3 * x } else { -1e-6 - x },
            ];
            for (k, f) in functions.iter().enumerate() {
                let mut calls = 0;
                let g = |x: f64| f(x - root);
                let (low, high) = (root - left, root + right);
                let found = bracketed(low, high, g(low), g(high), |x| {
                    calls += 1;
                    g(x)
                });
                prop_assert!((found - root).abs() < 1e-14 * 15.0 + if k == 1 { 1e-6 } else { 0.0 }, "{k} {found}");
                prop_assert!(calls <= 200);
            }
        }
    }
}
