//! Boxes in a tree: which of them a ray meets, or a ball.

use crate::coat::Coat;
use crate::math::Vec3;

/// Most boxes of a leaf.
const LEAF: usize = 4;
/// Boxes are grown by this part of their size, so that rounding loses none.
const SLACK: f64 = 1e-9;
/// Nodes that may wait for their turn: enough for 2^47 boxes, as each level halves them.
const DEPTH: usize = 48;

/// Axis-aligned boxes, halved at the middle of the longest side again and again; those without bounds aside.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    nodes: Vec<Node>,
    /// The boxes with their numbers, each leaf's in a row.
    items: Vec<Item>,
    unbounded: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Item {
    low: Vec3,
    high: Vec3,
    number: u32,
}

/// A node; of an inner one the first child comes next.
#[derive(Clone, Copy, Debug)]
struct Node {
    low: Vec3,
    high: Vec3,
    /// Of a leaf, its first item; of an inner node, its second child.
    at: u32,
    /// Items of a leaf; 0 for an inner node.
    count: u32,
}

impl Tree {
    /// Sorts the bounds of the fields of a coat's skeletons.
    pub fn build_of(&mut self, coat: &Coat) {
        self.build(coat.skeletons.iter().map(|skeleton| skeleton.shape.bounds(skeleton.profile.radius)));
    }

    /// Sorts boxes, (low, high) each, in place of what was there; empty ones (low above high) are left out.
    pub fn build(&mut self, boxes: impl Iterator<Item = (Vec3, Vec3)>) {
        self.nodes.clear();
        self.items.clear();
        self.unbounded.clear();
        for (number, (low, high)) in boxes.enumerate() {
            let number = number as u32;
            if low > high {
                continue;
            }
            let size = (high - low).norm() + low.norm().max(high.norm());
            if size.is_finite() {
                let slack = Vec3::repeat(SLACK * size);
                self.items.push(Item { low: low - slack, high: high + slack, number });
            } else {
                self.unbounded.push(number);
            }
        }
        if !self.items.is_empty() {
            self.split(0, self.items.len());
        }
    }

    fn split(&mut self, first: usize, end: usize) {
        let items = &mut self.items[first..end];
        let start = (items[0].low, items[0].high);
        let (low, high) = items.iter().fold(start, |(low, high), item| (low.inf(&item.low), high.sup(&item.high)));
        let node = self.nodes.len();
        self.nodes.push(Node { low, high, at: first as u32, count: items.len() as u32 });
        if items.len() <= LEAF {
            return;
        }
        let axis = (high - low).imax();
        let middle = items.len() / 2;
        let key = |item: &Item| item.low[axis] + item.high[axis];
        items.select_nth_unstable_by(middle, |a, b| key(a).total_cmp(&key(b)).then(a.number.cmp(&b.number)));
        self.split(first, first + middle);
        self.nodes[node] = Node { low, high, at: self.nodes.len() as u32, count: 0 };
        self.split(first + middle, end);
    }

    /// Tells the numbers of all boxes that a ray meets, with the length of the ray up to each. `direction` has unit
    /// length, `length` may be infinite.
    #[inline]
    pub fn meet(&self, origin: &Vec3, direction: &Vec3, length: f64, mut tell: impl FnMut(u32, f64)) {
        self.unbounded.iter().for_each(|number| tell(*number, 0.0));
        let inverse = direction.map(|x| 1.0 / x);
        let enter = |low: &Vec3, high: &Vec3| {
            let (mut near, mut far) = (0.0_f64, length);
            for axis in 0..3 {
                let a = (low[axis] - origin[axis]) * inverse[axis];
                let b = (high[axis] - origin[axis]) * inverse[axis];
                // Plain comparisons: one instruction each. Where a or b is no number, the ray runs along a side.
                let (first, last) = if a < b { (a, b) } else { (b, a) };
                near = if first > near { first } else { near };
                far = if last < far { last } else { far };
            }
            (near <= far).then_some(near)
        };
        self.walk(
            |low, high| enter(low, high).is_some(),
            |item| {
                if let Some(near) = enter(&item.low, &item.high) {
                    tell(item.number, near);
                }
            },
        );
    }

    /// Tells the numbers of all boxes that a ball meets.
    pub fn near(&self, center: &Vec3, radius: f64, mut tell: impl FnMut(u32)) {
        self.unbounded.iter().for_each(|number| tell(*number));
        let meets = |low: &Vec3, high: &Vec3| {
            let offset = center.sup(low).inf(high) - center;
            offset.norm_squared() <= radius * radius
        };
        self.walk(meets, |item| {
            if meets(&item.low, &item.high) {
                tell(item.number);
            }
        });
    }

    /// The item that is nearest to a point, with its distance, if one is not farther than `limit`. `distance` gives an
    /// item's own, which is at least that of its box. Items without bounds are left out.
    pub fn nearest(&self, p: &Vec3, limit: f64, mut distance: impl FnMut(u32) -> f64) -> Option<(u32, f64)> {
        let away = |low: &Vec3, high: &Vec3| (p.sup(low).inf(high) - p).norm();
        let mut best = None;
        let mut closest = limit;
        let mut later = [(0_usize, 0.0); DEPTH];
        let root = self.nodes.first()?;
        later[0] = (0, away(&root.low, &root.high));
        let mut waiting = 1;
        while waiting > 0 {
            waiting -= 1;
            let (at, bound) = later[waiting];
            if bound > closest {
                continue;
            }
            let node = &self.nodes[at];
            if node.count > 0 {
                for item in &self.items[node.at as usize..][..node.count as usize] {
                    if away(&item.low, &item.high) <= closest {
                        let own = distance(item.number);
                        // Of equals the first one, so that nothing depends on how the boxes are sorted.
                        if own < closest || own == closest && best.is_none_or(|number| item.number < number) {
                            (best, closest) = (Some(item.number), own);
                        }
                    }
                }
                continue;
            }
            let child = |at: usize| (at, away(&self.nodes[at].low, &self.nodes[at].high));
            let (first, second) = (child(at + 1), child(node.at as usize));
            let (near, far) = if first.1 <= second.1 { (first, second) } else { (second, first) };
            later[waiting] = far;
            later[waiting + 1] = near;
            waiting += 2;
        }
        best.map(|number| (number, closest))
    }

    /// Goes through the items of all leaves that `enter` does not shut out.
    #[inline]
    fn walk(&self, enter: impl Fn(&Vec3, &Vec3) -> bool, mut each: impl FnMut(&Item)) {
        let mut later = [0_u32; DEPTH];
        let mut depth = 0;
        let mut at = 0;
        while let Some(node) = self.nodes.get(at) {
            if enter(&node.low, &node.high) {
                if node.count == 0 {
                    later[depth] = node.at;
                    depth += 1;
                    at += 1;
                    continue;
                }
                self.items[node.at as usize..][..node.count as usize].iter().for_each(&mut each);
            }
            if depth == 0 {
                return;
            }
            depth -= 1;
            at = later[depth] as usize;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector(size: f64) -> impl Strategy<Value = Vec3> {
        [-size..size, -size..size, -size..size].prop_map(Vec3::from)
    }

    proptest! {
        #[test]
        fn all_boxes_that_a_ray_or_a_ball_meets_are_told_once(
            boxes in prop::collection::vec((vector(3.0), vector(1.0)), 0..60),
            origin in vector(5.0), direction in vector(1.0), length in 0.0..12.0f64,
        ) {
            prop_assume!(direction.norm() > 1e-3);
            let direction = direction.normalize();
            let bounds: Vec<_> = boxes.iter().map(|(middle, half)| (middle - half.abs(), middle + half.abs())).collect();
            let mut tree = Tree::default();
            tree.build(bounds.iter().copied());
            let (mut met, mut near) = (Vec::new(), Vec::new());
            tree.meet(&origin, &direction, length, |number, at| met.push((number, at)));
            tree.near(&origin, length, |number| near.push(number));
            for (number, (low, high)) in bounds.iter().enumerate() {
                let inside = |s: f64| {
                    let p = origin + direction * s;
                    (0..3).all(|k| p[k] >= low[k] && p[k] <= high[k])
                };
                let told: Vec<_> = met.iter().filter(|told| told.0 == number as u32).collect();
                let first = (0..=2000).map(|k| length * f64::from(k) / 2000.0).find(|s| inside(*s));
                prop_assert!(told.len() <= 1 && (first.is_none() || told.len() == 1));
                if let (Some(first), [(_, at)]) = (first, &told[..]) {
                    prop_assert!(*at <= first + 1e-6 && *at >= first - length / 2000.0 - 1e-6);
                }
                let away = (origin.sup(low).inf(high) - origin).norm();
                let count = near.iter().filter(|told| **told == number as u32).count();
                prop_assert!(count <= 1 && (count == 1) == (away <= length) || (away - length).abs() < 1e-6);
            }
            let away = |number: usize| (origin.sup(&bounds[number].0).inf(&bounds[number].1) - origin).norm();
            let expected = (0..bounds.len()).map(|number| (number as u32, away(number)));
            let expected = expected.filter(|(_, away)| *away <= length).min_by(|a, b| a.1.total_cmp(&b.1));
            prop_assert_eq!(tree.nearest(&origin, length, |number| away(number as usize)), expected);
        }
    }
}
