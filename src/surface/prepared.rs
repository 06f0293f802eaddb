//! A coat made ready for many questions: each looks only at the skeletons near it, the coat's own and those of what
//! presses on it.

use super::SurfaceHit;
use super::deformed::{Deformed, Obstacle};
use super::ray::Caster;
use super::tree::Tree;
use crate::coat::Coat;
use crate::math::Vec3;

/// A coat and what presses on it, with their skeletons in trees.
#[derive(Clone, Debug, Default)]
pub struct Prepared {
    deformed: Deformed,
    thinnest: f64,
    caster: Caster,
    /// For each obstacle.
    pressing: Vec<Tree>,
    near: Vec<u32>,
    /// What of the coats is near.
    small: Deformed,
}

impl Prepared {
    /// Makes another coat ready, in the memory of the last.
    pub fn prepare(&mut self, deformed: Deformed) {
        self.caster.prepare(&deformed.coat);
        self.pressing.resize_with(deformed.obstacles.len(), Tree::default);
        for (tree, obstacle) in self.pressing.iter_mut().zip(&deformed.obstacles) {
            tree.build_of(&obstacle.coat);
        }
        self.small.obstacles.clear();
        let empty = |obstacle: &Obstacle| Obstacle { coat: Coat::default(), ..*obstacle };
        self.small.obstacles.extend(deformed.obstacles.iter().map(empty));
        let thicknesses = deformed.coat.skeletons.iter().map(|skeleton| skeleton.profile.thickness);
        self.thinnest = thicknesses.fold(f64::INFINITY, f64::min);
        self.deformed = deformed;
    }

    /// What was made ready.
    pub fn deformed(&self) -> &Deformed {
        &self.deformed
    }

    /// The smallest thickness of the coat's skeletons \[m\]; infinite without any.
    pub fn thinnest(&self) -> f64 {
        self.thinnest
    }

    /// Gives it back, with its memory.
    pub fn take(&mut self) -> Deformed {
        std::mem::take(&mut self.deformed)
    }

    /// [`Deformed::cast`].
    pub fn cast(&mut self, origin: &Vec3, direction: &Vec3, length: f64) -> Option<SurfaceHit> {
        let meet = |tree: &Tree, near: &mut Vec<u32>| {
            tree.meet(origin, direction, length, |skeleton, _| near.push(skeleton));
        };
        if !self.gather(false, meet) {
            return self.caster.cast(&self.deformed.coat, origin, direction, length);
        }
        self.gather(true, meet);
        let hit = self.small.cast(origin, direction, length)?;
        Some(SurfaceHit { skeleton: self.near[hit.skeleton] as usize, ..hit })
    }

    /// The coat with what presses on it, as far as their fields reach a ball: there, it is the same.
    pub fn around(&mut self, center: &Vec3, radius: f64) -> &Deformed {
        let meet = |tree: &Tree, near: &mut Vec<u32>| tree.near(center, radius, |skeleton| near.push(skeleton));
        self.gather(false, meet);
        self.gather(true, meet);
        &self.small
    }

    /// Puts what `meet` finds of the coat itself, or else of all obstacles, into `small`: whether it is anything.
    fn gather(&mut self, own: bool, meet: impl Fn(&Tree, &mut Vec<u32>)) -> bool {
        let Self { deformed, caster, pressing, near, small, .. } = self;
        let mut put = |tree: &Tree, from: &Coat, to: &mut Coat| {
            near.clear();
            meet(tree, near);
            near.sort_unstable();
            from.subset_into(near, to);
            !near.is_empty()
        };
        if own {
            return put(caster.tree(), &deformed.coat, &mut small.coat);
        }
        let mut any = false;
        for ((tree, from), to) in pressing.iter().zip(&deformed.obstacles).zip(&mut small.obstacles) {
            any |= put(tree, &from.coat, &mut to.coat);
        }
        any
    }
}
