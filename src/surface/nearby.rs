//! What of a coat is near a point, and whose the point is.

use super::tree::Tree;
use crate::coat::Coat;
use crate::field::{Placed, blend};
use crate::math::Vec3;

/// A coat with its skeletons in a tree, so that a point looks only at those near it.
pub struct Nearby<'a> {
    coat: &'a Coat,
    tree: Tree,
    near: Vec<u32>,
    small: Coat,
    shares: Vec<(u32, f64)>,
}

impl<'a> Nearby<'a> {
    /// Sorts the skeletons of a coat.
    pub fn new(coat: &'a Coat) -> Self {
        let mut tree = Tree::default();
        tree.build_of(coat);
        Self { coat, tree, near: Vec::new(), small: Coat::default(), shares: Vec::new() }
    }

    /// The skeletons whose fields may reach a point, as a coat that is the same there, and their positions in the
    /// whole one.
    pub fn at(&mut self, p: &Vec3) -> (&Coat, &[u32]) {
        let Self { coat, tree, near, small, .. } = self;
        near.clear();
        tree.near(p, 0.0, |skeleton| near.push(skeleton));
        near.sort_unstable();
        coat.subset_into(near, small);
        (small, near)
    }

    /// The skeletons that make the field at a point, by their positions, the strongest first, with their shares of it as
    /// far as the blend graph lets them count; these add up to 1. Where no field reaches, the nearest one has all of it.
    pub fn shares(&mut self, p: &Vec3) -> &[(u32, f64)] {
        let mut shares = std::mem::take(&mut self.shares);
        shares.clear();
        let (small, near) = self.at(p);
        blend::parts(&small.graph, small.skeletons.iter().enumerate(), p, |index, part| {
            shares.push((near[index], part))
        });
        let sum: f64 = shares.iter().map(|(_, part)| part).sum();
        if sum > 0.0 {
            shares.iter_mut().for_each(|(_, share)| *share /= sum);
            shares.sort_by(|a, b| b.1.total_cmp(&a.1));
        } else {
            shares.clear();
            shares.extend(self.nearest(p).map(|skeleton| (skeleton as u32, 1.0)));
        }
        self.shares = shares;
        &self.shares
    }

    /// The skeleton whose isolated surface is nearest; none of a coat without any.
    pub fn nearest(&self, p: &Vec3) -> Option<usize> {
        let depth = |skeleton: &Placed| skeleton.shape.closest(p).distance - skeleton.profile.thickness;
        let depths = self.coat.skeletons.iter().map(depth).enumerate();
        depths.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
    }
}
