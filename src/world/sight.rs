//! The coats of a world made ready for many rays, as a picture takes them.

use super::query::{RayHit, first_hit};
use super::rays::Ray;
use super::{BodyId, Deformation, World};
use crate::error::{Result, require_finite};
use crate::math::Vec3;
use crate::surface::deformed::Deformed;
use crate::surface::ray;

/// A world as rays see it: the same answers as [`World::cast_ray_deformed`], to the bit, but what is worked out about
/// bodies and their contacts is worked out once. Rays may be cast on many threads at once.
pub struct Sight<'a> {
    world: &'a World,
    deformation: Deformation,
    coats: Vec<Seen>,
}

struct Seen {
    body: usize,
    deformed: Deformed,
    skeletons: Vec<usize>,
}

/// A point in a solid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inside {
    /// The body.
    pub body: BodyId,
    /// How far it is to the deformed surface, as the field says: exact near it \[m\].
    pub depth: f64,
    /// Elastic pressure of the undeformed coat there \[Pa\]: between two bodies, that of their contact.
    pub pressure: f64,
}

impl World {
    /// Makes the enabled bodies whose category shares a bit with `mask` ready for rays, in the shapes that `deformation`
    /// says.
    pub fn sight(&self, mask: u64, deformation: Deformation) -> Sight<'_> {
        let seen = |body: usize| {
            let (deformed, skeletons) = self.deformed_coat(body, deformation);
            Seen { body, deformed, skeletons }
        };
        Sight { world: self, deformation, coats: self.bodies_of(mask).map(seen).collect() }
    }
}

impl Sight<'_> {
    /// The same without a body: what it presses on stays as it is, and what it hid can be seen.
    pub fn without(mut self, body: BodyId) -> Self {
        self.coats.retain(|seen| self.world.bodies.id_of(seen.body) != body);
        self
    }

    /// The first coat that a ray meets, as [`World::cast_ray_deformed`] gives it.
    pub fn cast_ray(&self, origin: &Vec3, direction: &Vec3, max_distance: f64) -> Result<Option<RayHit>> {
        let ray = Ray { origin: *origin, direction: *direction, max_distance };
        first_hit(&ray, self.coats.iter(), |seen: &Seen, direction, length| {
            let frame = &seen.deformed.coat.origin;
            let local = origin - frame;
            let hit = if self.deformation == Deformation::None {
                ray::cast(&seen.deformed.coat, &local, direction, length)
            } else if ray::enters(&seen.deformed.coat, &local, direction, length) {
                seen.deformed.cast(&local, direction, length)
            } else {
                None
            };
            Some(self.world.ray_hit(seen.body, frame, &seen.skeletons, hit?))
        })
    }

    /// The solid that a point of the world is in, the first in the order of ids; `None` where there is none.
    pub fn inside(&self, point: &Vec3) -> Result<Option<Inside>> {
        require_finite("point", point)?;
        Ok(self.coats.iter().find_map(|seen| {
            let local = point - seen.deformed.coat.origin;
            let (excess, gradient) = seen.deformed.excess_gradient(&local);
            (excess >= 0.0).then(|| Inside {
                body: self.world.bodies.id_of(seen.body),
                depth: excess / gradient.norm().max(f64::MIN_POSITIVE),
                pressure: self.pressure_of(seen, &local),
            })
        }))
    }

    /// Pressure of a contact at a point of a body's surface \[Pa\]: 0 where nothing presses on it, and on rigid bodies,
    /// whose own pressure nobody knows.
    pub fn pressure(&self, hit: &RayHit) -> f64 {
        let seen = self.coats.iter().find(|seen| seen.body == hit.body.index());
        seen.map_or(0.0, |seen| self.pressure_of(seen, &(hit.position - seen.deformed.coat.origin)))
    }

    fn pressure_of(&self, seen: &Seen, local: &Vec3) -> f64 {
        let body = &self.world.bodies[seen.body];
        if body.desc.rigid { 0.0 } else { body.stiffness_scale * seen.deformed.coat.excess(local).max(0.0) }
    }
}
