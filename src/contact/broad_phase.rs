//! Broad phase: which bodies' bounds meet.
//!
//! What is near does not change much from step to step: the pairs of somewhat larger bounds are kept for as long as these
//! hold the bodies, and of them those are taken whose bounds do meet.

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

    /// Whether who does not meet this one cannot meet the other, whatever rounding does.
    fn holds(&self, other: &Bounds) -> bool {
        self.body == other.body
            && (0..3).all(|axis| self.low[axis] <= other.low[axis] && other.high[axis] <= self.high[axis])
            && ((self.middle - other.middle).norm() + other.radius) * (1.0 + 1e-12) <= self.radius
    }

    fn grown(&self) -> Self {
        let size = (self.high - self.low).norm();
        let margin = if size.is_finite() { GROWTH * size } else { 0.0 };
        let by = Vec3::repeat(margin);
        Self { low: self.low - by, high: self.high + by, radius: self.radius + margin, ..*self }
    }
}

/// How much larger bounds are made, over their size: more holds for longer, and lets more through that does not meet.
const GROWTH: f64 = 0.01;

/// The pairs that were near, and what that was found for.
#[derive(Debug, Default)]
pub struct BroadPhase {
    grown: Vec<Bounds>,
    sorted: Vec<Bounds>,
    /// By the places of the bodies in the list.
    near: Vec<[u32; 2]>,
}

impl BroadPhase {
    /// Writes the pairs of bodies whose bounds meet, in ascending order. The bounds are in the order of their bodies.
    pub fn find(&mut self, bounds: &[Bounds], out: &mut Vec<[u32; 2]>) {
        let Self { grown, sorted, near } = self;
        if grown.len() != bounds.len() || !grown.iter().zip(bounds).all(|(grown, now)| grown.holds(now)) {
            grown.clear();
            grown.extend(bounds.iter().map(Bounds::grown));
            sorted.clear();
            sorted.extend(grown.iter().enumerate().map(|(place, grown)| Bounds { body: place as u32, ..*grown }));
            pairs(sorted, near);
        }
        let bounds_of = |pair: &[u32; 2]| pair.map(|place| &bounds[place as usize]);
        let met = near.iter().map(bounds_of).filter(|[a, b]| a.meets(b));
        out.clear();
        out.extend(met.map(|pair| pair.map(|bounds| bounds.body)));
    }
}

/// Writes the pairs of bodies whose bounds meet, each with its smaller slot first, in ascending order. Reorders the
/// bounds.
fn pairs(bounds: &mut [Bounds], out: &mut Vec<[u32; 2]>) {
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
            let (mut broad, mut found) = (BroadPhase::default(), Vec::new());
            // Somewhat on: some of them leave the larger bounds in some of the steps.
            for _ in 0..6 {
                let mut expected = Vec::new();
                for i in 0..bounds.len() {
                    for j in i + 1..bounds.len() {
                        if bounds[i].meets(&bounds[j]) {
                            expected.push([i as u32, j as u32]);
                        }
                    }
                }
                broad.find(&bounds, &mut found);
                prop_assert_eq!(&found, &expected);
                for (index, bounds) in bounds.iter_mut().enumerate() {
                    let by = Vec3::new(0.004, -0.002, 0.006) * (index % 3) as f64;
                    (bounds.low, bounds.high, bounds.middle) = (bounds.low + by, bounds.high + by, bounds.middle + by);
                }
            }
        }
    }
}
