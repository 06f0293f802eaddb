//! Many rays in one call.

use super::query::RayHit;
use super::{Deformation, World};
use crate::error::{Error, Result, out_of_range, require, require_finite};
use crate::math::Vec3;

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
        let mut sight = self.sight(desc.mask, desc.deformation);
        rays.enumerate().for_each(|(index, ray)| tell(index, sight.cast_checked(&ray, desc.goal)));
        Ok(())
    }
}
