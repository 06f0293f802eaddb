//! Where skeletons begin: inscribed balls that touch the surface, as few and as large as cover it.
//!
//! From each of many points of the surface the largest ball is grown inwards that holds no other \[Ma et al. 2012,
//! doi:10.1007/s00371-012-0681-8\]: its centre is on the medial axis. A ball covers the points that are not farther than a
//! margin from it. Of all balls those are taken, greedily, that cover most of what is not covered yet; and the margin is
//! the smallest with which so many balls cover all.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use super::refine::Fitted;
use super::target::{Sample, Target};
use crate::math::{Mat3, Vec3};
use crate::surface::tree::Tree;

/// Difference below which two balls are alike.
const ALIKE: f64 = 1e-4;

/// How much the distance from where other balls were grown counts, beside a gap.
const SPREAD: f64 = 0.05;

/// Halvings of the margin.
const HALVINGS: u32 = 8;

/// Half the length of the shortest segment, over its thickness.
const SHORTEST: f64 = 0.01;

/// An inscribed ball.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// Its centre.
    pub center: Vec3,
    /// Its radius.
    pub radius: f64,
    /// The bone of the point that it was grown from.
    pub bone: u32,
}

/// The largest ball that touches the surface at a point from inside.
fn inscribed(target: &Target, sample: &Sample) -> Ball {
    let mut radius = 0.5;
    let mut center = sample.point - sample.normal * radius;
    for _ in 0..40 {
        let foot = target.foot(&center);
        if foot.distance.abs() >= radius * (1.0 - 1e-4) {
            break;
        }
        let across = sample.point - foot.point;
        let depth = across.dot(&sample.normal);
        if depth <= 0.0 {
            break;
        }
        let smaller = across.norm_squared() / (2.0 * depth);
        if smaller >= radius {
            break;
        }
        radius = smaller;
        center = sample.point - sample.normal * radius;
    }
    Ball { center, radius, bone: sample.bone }
}

/// The points that balls cover within a margin. Not kept: of a mesh that is nearly round each ball covers nearly all.
struct Covering<'a> {
    samples: &'a [Sample],
    tree: Tree,
    balls: &'a [Ball],
}

impl Covering<'_> {
    fn visit(&self, ball: usize, margin: f64, mut see: impl FnMut(usize)) {
        let ball = &self.balls[ball];
        let reach = ball.radius + margin;
        self.tree.near(&ball.center, reach, |number| {
            let sample = &self.samples[number as usize];
            if sample.bone == ball.bone && (sample.point - ball.center).norm() <= reach {
                see(number as usize);
            }
        });
    }

    /// Of these balls, some that cover all points; `None` if more than `most` were needed.
    fn cover(&self, margin: f64, among: &[usize], most: usize) -> Option<Vec<usize>> {
        let mut covered = vec![false; self.samples.len()];
        let mut left = covered.len();
        // What a ball covers that is not covered yet only shrinks: who leads with its present number is the best.
        let mut heap: BinaryHeap<(usize, Reverse<usize>)> = among.iter().map(|ball| (left, Reverse(*ball))).collect();
        let mut taken = Vec::new();
        while left > 0 {
            let (count, Reverse(ball)) = heap.pop()?;
            let mut now = 0;
            self.visit(ball, margin, |point| now += usize::from(!covered[point]));
            if now < count {
                heap.push((now, Reverse(ball)));
                continue;
            }
            if taken.len() == most {
                return None;
            }
            taken.push(ball);
            left -= now;
            self.visit(ball, margin, |point| covered[point] = true);
        }
        Some(taken)
    }
}

/// One of each number of balls that are alike, by their places: the first.
fn distinct(balls: &[Ball]) -> Vec<usize> {
    let key = |ball: &Ball| {
        let [x, y, z] = [ball.center.x, ball.center.y, ball.center.z].map(|x| (x / ALIKE).round() as i64);
        (x, y, z, (ball.radius / ALIKE).round() as i64, ball.bone)
    };
    let mut seen = BTreeSet::new();
    (0..balls.len()).filter(|ball| seen.insert(key(&balls[*ball]))).collect()
}

/// So many balls that cover the surface within the smallest margin, each what is of its bone. At least as many as there
/// are bones at the points.
pub fn balls(target: &Target, samples: &[Sample], count: usize) -> Vec<Ball> {
    let all: Vec<Ball> = samples.iter().map(|sample| inscribed(target, sample)).collect();
    let mut tree = Tree::default();
    tree.build(samples.iter().map(|sample| (sample.point, sample.point)));
    let (covering, among) = (Covering { samples, tree, balls: &all }, distinct(&all));
    let covers = |margin: f64| covering.cover(margin, &among, count);
    // Within the diagonal, one ball covers all of its bone.
    let (mut low, mut high) = (0.0, (0.25 * (target.area / count as f64).sqrt()).min(1.0));
    let mut taken = covers(high);
    while taken.is_none() && high < 1.0 {
        (low, high) = (high, (2.0 * high).min(1.0));
        taken = covers(high);
    }
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        match covers(middle) {
            Some(fewer) => (taken, high) = (Some(fewer), middle),
            None => low = middle,
        }
    }
    let taken = taken.unwrap_or_default();
    let mut chosen: Vec<Ball> = taken.iter().map(|ball| all[*ball]).collect();
    // What is left goes where the surface is farthest from all so far, and from where they were grown.
    let away = |ball: &Ball, sample: &Sample| ((sample.point - ball.center).norm() - ball.radius).max(0.0);
    let apart = |from: usize, sample: &Sample| (sample.point - samples[from].point).norm();
    let least = |of: &dyn Fn(usize) -> f64| taken.iter().map(|ball| of(*ball)).fold(f64::INFINITY, f64::min);
    let gap = |sample: &Sample| (least(&|ball| away(&all[ball], sample)), least(&|ball| apart(ball, sample)));
    let mut gaps: Vec<(f64, f64)> = samples.iter().map(gap).collect();
    while chosen.len() < count {
        let score = |at: usize| gaps[at].0 + SPREAD * gaps[at].1;
        let farthest = (0..gaps.len()).max_by(|a, b| score(*a).total_cmp(&score(*b)).then(b.cmp(a)));
        let at = farthest.expect("there are points");
        let mut ball = all[at];
        // Two in one place could never be told apart: a smaller one that touches at the same point.
        let is_like = |other: &Ball| (other.center - ball.center).norm() < 0.1 * ball.radius;
        if chosen.iter().any(is_like) {
            ball.radius *= 0.5;
            ball.center = samples[at].point - samples[at].normal * ball.radius;
        }
        for (gap, sample) in gaps.iter_mut().zip(samples) {
            *gap = (gap.0.min(away(&ball, sample)), gap.1.min(apart(at, sample)));
        }
        chosen.push(ball);
    }
    chosen
}

/// A ball as a point skeleton.
pub fn point(ball: &Ball, thinnest: f64) -> Fitted {
    Fitted { ends: [ball.center; 2], thickness: ball.radius.max(thinnest), bone: ball.bone }
}

/// Makes segments of points, each along the part of the surface that is nearest to it.
pub fn stretch(target: &Target, samples: &[Sample], skeletons: &mut [Fitted]) {
    let mut parts = vec![Vec::new(); skeletons.len()];
    for sample in samples {
        let away = |of: &Fitted| (sample.point - of.ends[0]).norm() - of.thickness;
        let own = skeletons.iter().enumerate().filter(|(_, skeleton)| skeleton.bone == sample.bone);
        let nearest = own.min_by(|a, b| away(a.1).total_cmp(&away(b.1)));
        let (nearest, skeleton) = nearest.expect("every bone has a skeleton");
        parts[nearest].push(sample.point - skeleton.ends[0]);
    }
    for (skeleton, part) in skeletons.iter_mut().zip(&parts) {
        let spread: Mat3 = part.iter().map(|offset| offset * offset.transpose()).sum();
        let eigen = spread.symmetric_eigen();
        let axis = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
        for (end, sign) in skeleton.ends.iter_mut().zip([-1.0, 1.0]) {
            // As far as its round end reaches what it is to cover, and no farther out than half its thickness from the
            // surface. Of some length, as a segment without any would have no direction to grow in.
            let reach = part.iter().map(|offset| offset.dot(&axis) * sign).fold(0.0, f64::max);
            let mut length = (reach - skeleton.thickness).max(SHORTEST * skeleton.thickness);
            let at = |length: f64| *end + axis * (sign * length);
            while length > SHORTEST * skeleton.thickness
                && target.foot(&at(length)).distance > -0.5 * skeleton.thickness
            {
                length = (0.8 * length).max(SHORTEST * skeleton.thickness);
            }
            *end = at(length);
        }
    }
}
