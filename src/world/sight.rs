//! The coats of a world made ready for many rays, as a picture takes them.

use super::query::RayHit;
use super::rays::{Ray, RayGoal};
use super::{BodyId, Deformation, World};
use crate::error::{Result, require_finite};
use crate::math::Vec3;
use crate::surface::SurfaceHit;
use crate::surface::prepared::Prepared;
use crate::surface::tree::Tree;

/// A world as rays see it: the same answers as [`World::cast_ray_deformed`], to the bit, but what is worked out about
/// bodies and their contacts is worked out once, and a ray looks only at the skeletons near it. Each thread takes a clone.
#[derive(Clone)]
pub struct Sight<'a> {
    world: &'a World,
    aims: Vec<Aim>,
    /// Of the aims, by their numbers.
    tree: Tree,
    /// Aims that a ray may meet, and from where on.
    near: Vec<(f64, u32)>,
}

/// A body that rays may meet.
#[derive(Clone)]
struct Aim {
    body: usize,
    target: Prepared,
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
        let aim = |body: usize| {
            let (deformed, skeletons) = self.deformed_coat(body, deformation);
            let mut target = Prepared::default();
            target.prepare(deformed);
            Aim { body, target, skeletons }
        };
        Sight::of(self, self.bodies_of(mask).map(aim).collect())
    }
}

impl<'a> Sight<'a> {
    fn of(world: &'a World, aims: Vec<Aim>) -> Self {
        let mut tree = Tree::default();
        tree.build(aims.iter().map(|aim| {
            let coat = &aim.target.deformed().coat;
            let (low, high) = coat.bounds();
            (low + coat.origin, high + coat.origin)
        }));
        Self { world, aims, tree, near: Vec::new() }
    }

    /// The same without a body: what it presses on stays as it is, and what it hid can be seen.
    pub fn without(mut self, body: BodyId) -> Self {
        self.aims.retain(|aim| self.world.bodies.id_of(aim.body) != body);
        Self::of(self.world, self.aims)
    }

    /// The coat that a ray meets, as [`World::cast_ray_deformed`] gives the closest.
    pub fn cast_ray(&mut self, ray: &Ray, goal: RayGoal) -> Result<Option<RayHit>> {
        ray.check()?;
        Ok(self.cast_checked(ray, goal))
    }

    /// [`Sight::cast_ray`] of a ray that makes sense.
    pub(super) fn cast_checked(&mut self, ray: &Ray, goal: RayGoal) -> Option<RayHit> {
        let Self { world, aims, tree, near } = self;
        let direction = ray.unit_direction();
        near.clear();
        tree.meet(&ray.origin, &direction, ray.max_distance, |aim, at| near.push((at, aim)));
        near.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let mut first: Option<(u32, SurfaceHit)> = None;
        for (at, number) in near {
            if first.is_some_and(|(_, hit)| *at > hit.distance) {
                break;
            }
            let target = &mut aims[*number as usize].target;
            let local = ray.origin - target.deformed().coat.origin;
            let Some(hit) = target.cast(&local, &direction, ray.max_distance) else { continue };
            // Of coats at the same distance, the first body wins.
            let is_first = |(other, best): (u32, SurfaceHit)| {
                hit.distance < best.distance || hit.distance == best.distance && *number < other
            };
            if first.is_none_or(is_first) {
                first = Some((*number, hit));
            }
            if goal == RayGoal::Any {
                break;
            }
        }
        first.map(|(number, hit)| {
            let Aim { body, target, skeletons } = &aims[number as usize];
            world.ray_hit(*body, &target.deformed().coat.origin, skeletons, hit)
        })
    }

    /// The solid that a point of the world is in, the first in the order of ids; `None` where there is none.
    pub fn inside(&self, point: &Vec3) -> Result<Option<Inside>> {
        require_finite("point", point)?;
        Ok(self.aims.iter().find_map(|aim| {
            let deformed = aim.target.deformed();
            let local = point - deformed.coat.origin;
            let (excess, gradient) = deformed.excess_gradient(&local);
            (excess >= 0.0).then(|| Inside {
                body: self.world.bodies.id_of(aim.body),
                depth: excess / gradient.norm().max(f64::MIN_POSITIVE),
                pressure: self.pressure_of(aim, &local),
            })
        }))
    }

    /// Pressure of a contact at a point of a body's surface \[Pa\]: 0 where nothing presses on it, and on rigid bodies,
    /// whose own pressure nobody knows.
    pub fn pressure(&self, hit: &RayHit) -> f64 {
        let aim = self.aims.iter().find(|aim| aim.body == hit.body.index());
        aim.map_or(0.0, |aim| self.pressure_of(aim, &(hit.position - aim.target.deformed().coat.origin)))
    }

    fn pressure_of(&self, aim: &Aim, local: &Vec3) -> f64 {
        let body = &self.world.bodies[aim.body];
        if body.desc.rigid { 0.0 } else { body.stiffness_scale * aim.target.deformed().coat.excess(local).max(0.0) }
    }
}
