//! Broad phase: which bodies' bounds meet.

use crate::math::Vec3;

/// Bounds of a body over a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Lowest coordinates; negative infinity for a half-space.
    pub low: Vec3,
    /// Highest coordinates.
    pub high: Vec3,
    /// Middle of a ball that bounds it too: of round bodies that lie askew to each other, boxes meet where they don't.
    pub middle: Vec3,
    /// Radius of that ball; infinite where a box is closer.
    pub radius: f64,
    /// Slot of the body.
    pub body: u32,
}

impl Bounds {
    fn meets(&self, other: &Bounds) -> bool {
        (0..3).all(|axis| self.low[axis] <= other.high[axis] && other.low[axis] <= self.high[axis])
            && (self.middle - other.middle).norm() <= self.radius + other.radius
    }
}

/// Writes the pairs of bodies whose bounds meet, each with its smaller slot first, in ascending order. Reorders the
/// bounds.
pub fn pairs(bounds: &mut [Bounds], out: &mut Vec<[u32; 2]>) {
    out.clear();
    let axis = widest_axis(bounds);
    bounds.sort_unstable_by(|a, b| a.low[axis].total_cmp(&b.low[axis]).then(a.body.cmp(&b.body)));
    for (index, first) in bounds.iter().enumerate() {
        for second in &bounds[index + 1..] {
            if second.low[axis] > first.high[axis] {
                break;
            }
            if first.meets(second) {
                out.push([first.body.min(second.body), first.body.max(second.body)]);
            }
        }
    }
    // One number compares faster than two.
    out.sort_unstable_by_key(|[a, b]| u64::from(*a) << 32 | u64::from(*b));
}

/// The axis along which the bounded bodies are spread most.
fn widest_axis(bounds: &[Bounds]) -> usize {
    let (mut count, mut sum, mut square) = (0.0, Vec3::zeros(), Vec3::zeros());
    for b in bounds.iter().filter(|b| b.low.x.is_finite() && b.high.x.is_finite()) {
        let middle = (b.low + b.high) * 0.5;
        count += 1.0;
        sum += middle;
        square += middle.component_mul(&middle);
    }
    if count == 0.0 {
        return 0;
    }
    let mean = sum / count;
    (square / count - mean.component_mul(&mean)).imax()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn finds_the_pairs_that_brute_force_finds(boxes in prop::collection::vec(
            (prop::array::uniform3(-5.0..5.0f64), prop::array::uniform3(0.0..2.0f64), 0..20u8), 0..40))
        {
            let mut bounds: Vec<_> = boxes.iter().enumerate().map(|(body, (low, size, plane))| {
                let (low, size) = (Vec3::from(*low), Vec3::from(*size));
                let infinite = Vec3::repeat(f64::INFINITY);
                let (middle, body) = (low + size * 0.5, body as u32);
                match plane {
                    0 => Bounds { low: -infinite, high: infinite, middle, radius: f64::INFINITY, body },
                    1..10 => Bounds { low, high: low + size, middle, radius: f64::INFINITY, body },
                    _ => Bounds { low, high: low + size, middle, radius: 0.5 * size.max(), body },
                }
            }).collect();
            let mut expected = Vec::new();
            for i in 0..bounds.len() {
                for j in i + 1..bounds.len() {
                    if bounds[i].meets(&bounds[j]) {
                        expected.push([i as u32, j as u32]);
                    }
                }
            }
            let mut found = Vec::new();
            pairs(&mut bounds, &mut found);
            prop_assert_eq!(found, expected);
        }
    }
}
