//! Many rays in one call.

use super::query::RayHit;
use super::{Deformation, World};
use crate::error::{Error, Result, out_of_range, require, require_finite};
use crate::math::Vec3;
use crate::surface::SurfaceHit;
use crate::surface::prepared::Prepared;
use crate::surface::tree::Tree;

/// A ray in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it begins \[m\].
    pub origin: Vec3,
    /// Where it goes; of any length but 0.
    pub direction: Vec3,
    /// Where it ends \[m\]: at least 0, may be infinite.
    pub max_distance: f64,
}

impl Ray {
    /// What is wrong with the ray, if anything is.
    pub(super) fn check(&self) -> Result<()> {
        require_finite("ray origin", &self.origin)?;
        require_finite("ray direction", &self.direction)?;
        require("length of the ray direction", self.direction.amax(), "> 0", |x| x > 0.0)?;
        if self.max_distance.is_nan() || self.max_distance < 0.0 {
            return Err(out_of_range("max_distance", self.max_distance, "at least 0 (infinity is fine)"));
        }
        Ok(())
    }

    /// The direction with unit length, of a ray that makes sense.
    pub(super) fn unit_direction(&self) -> Vec3 {
        let square = self.direction.norm_squared();
        if square > 1e-200 {
            return self.direction / square.sqrt();
        }
        // Scaled first, so that no square vanishes.
        (self.direction / self.direction.amax()).normalize()
    }
}

/// Which hit of a ray is wanted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RayGoal {
    /// The first along the ray.
    #[default]
    Closest,
    /// That of any body, which is cheaper: the first along the ray of the first body that is found.
    Any,
}

/// What many rays have in common.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RaysDesc {
    /// Which hits are wanted.
    pub goal: RayGoal,
    /// Which shapes they meet.
    pub deformation: Deformation,
    /// Bodies whose category shares a bit with it are looked at.
    pub mask: u64,
}

impl Default for RaysDesc {
    fn default() -> Self {
        Self { goal: RayGoal::Closest, deformation: Deformation::None, mask: u64::MAX }
    }
}

/// A body that rays may meet.
struct Aim {
    body: usize,
    target: Prepared,
    skeletons: Vec<usize>,
}

impl World {
    /// What each of many rays meets, as [`World::cast_ray_deformed`] finds it: `tell` gets the number of each ray in
    /// turn, and its hit. The coats are placed, and sorted into trees, once for all rays, so that a ray looks only at the
    /// skeletons near it; memory is asked for once, too.
    ///
    /// # Errors
    ///
    /// When a ray makes no sense: with its number, and before `tell` is called at all.
    pub fn cast_rays(
        &self,
        rays: impl Iterator<Item = Ray> + Clone,
        desc: &RaysDesc,
        mut tell: impl FnMut(usize, Option<RayHit>),
    ) -> std::result::Result<(), (usize, Error)> {
        for (index, ray) in rays.clone().enumerate() {
            ray.check().map_err(|error| (index, error))?;
        }
        let mut aims: Vec<Aim> = self.bodies_of(desc.mask).map(|body| self.aim(body, desc.deformation)).collect();
        let mut tree = Tree::default();
        tree.build(aims.iter().map(|aim| {
            let coat = &aim.target.deformed().coat;
            let (low, high) = coat.bounds();
            (low + coat.origin, high + coat.origin)
        }));
        let mut near: Vec<(f64, u32)> = Vec::new();
        for (index, ray) in rays.enumerate() {
            let direction = ray.unit_direction();
            near.clear();
            tree.meet(&ray.origin, &direction, ray.max_distance, |aim, at| near.push((at, aim)));
            near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            let mut first: Option<(u32, SurfaceHit)> = None;
            for (at, aim) in &near {
                let length = first.map_or(ray.max_distance, |(_, hit)| hit.distance);
                if *at > length {
                    break;
                }
                let target = &mut aims[*aim as usize].target;
                let local = ray.origin - target.deformed().coat.origin;
                let Some(hit) = target.cast(&local, &direction, length) else { continue };
                // Of coats at the same distance, the first body wins.
                if first.is_none_or(|(other, _)| hit.distance < length || *aim < other) {
                    first = Some((*aim, hit));
                }
                if desc.goal == RayGoal::Any {
                    break;
                }
            }
            let hit_of = |(aim, hit): (u32, SurfaceHit)| {
                let Aim { body, target, skeletons } = &aims[aim as usize];
                self.ray_hit(*body, &target.deformed().coat.origin, skeletons, hit)
            };
            tell(index, first.map(hit_of));
        }
        Ok(())
    }

    fn aim(&self, body: usize, deformation: Deformation) -> Aim {
        let (deformed, skeletons) = self.deformed_coat(body, deformation);
        let mut target = Prepared::default();
        target.prepare(deformed);
        Aim { body, target, skeletons }
    }
}
