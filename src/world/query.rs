//! Questions between steps: fields, rays, overlaps, closest points, seeds.

use super::rays::Ray;
use super::{Body, BodyId, Deformation, LinkId, SkeletonId, World};
use crate::coat::{Coat, seeds, territory};
use crate::error::{Error, Result, out_of_range, require, require_finite};
use crate::math::{Pose, Vec3};
use crate::surface::deformed::Deformed;
use crate::surface::prepared::Prepared;
use crate::surface::{SurfaceHit, closest, ray};

/// Accepts points of the world.
pub(super) fn require_points(points: &[[f64; 3]]) -> Result<()> {
    match points.iter().find(|p| !p.iter().all(|x| x.is_finite())) {
        Some([x, y, z]) => Err(out_of_range("point", format_args!("({x}, {y}, {z})"), "finite")),
        None => Ok(()),
    }
}

/// Where a ray meets a coat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The body.
    pub body: BodyId,
    /// The link that carries the skeleton.
    pub link: LinkId,
    /// The skeleton in whose territory the point lies.
    pub skeleton: SkeletonId,
    /// Length of the ray up to the point \[m\]; 0 for a ray that starts inside.
    pub distance: f64,
    /// The point, in the world \[m\].
    pub position: Vec3,
    /// Outward unit normal of the coat, in the world.
    pub normal: Vec3,
}

/// A point of a coat's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The point, in the world \[m\].
    pub position: Vec3,
    /// Outward unit normal of the coat, in the world.
    pub normal: Vec3,
    /// Signed distance of the point that was asked about: negative inside the solid \[m\].
    pub distance: f64,
    /// The link that carries the skeleton.
    pub link: LinkId,
    /// The skeleton in whose territory the point lies.
    pub skeleton: SkeletonId,
}

/// One sample of a skeleton's share of its coat's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seed {
    /// Where the seed ended, in the world \[m\].
    pub position: Vec3,
    /// Outward unit normal of the field there, in the world.
    pub normal: Vec3,
    /// It ended on the coat's surface; otherwise on the border of another skeleton's territory, inside the solid.
    pub valid: bool,
}

/// A body's coat as it is now; the arena indices of the skeletons in it, and their links' poses in its frame.
#[derive(Default)]
pub(super) struct PosedCoat {
    pub(super) coat: Coat,
    pub(super) skeletons: Vec<usize>,
    pub(super) poses: Vec<Pose>,
}

impl PosedCoat {
    pub(super) fn localise(&self, p: &Vec3) -> Vec3 {
        p - self.coat.origin
    }

    pub(super) fn globalise(&self, p: &Vec3) -> Vec3 {
        p + self.coat.origin
    }
}

impl World {
    /// The enabled skeletons of a body at the present poses, in a frame at its first link.
    pub(super) fn posed_coat(&self, body: usize) -> PosedCoat {
        let Body { links, substance, .. } = &self.bodies[body];
        let link = links.first().map(|link| self.links[*link as usize].desc.pose.position);
        let particle = substance.as_ref().and_then(|substance| Some(substance.particles.first()?.position));
        self.posed_coat_in(body, link.or(particle).unwrap_or_else(Vec3::zeros))
    }

    /// The same in a frame at `origin`.
    pub(super) fn posed_coat_in(&self, body: usize, origin: Vec3) -> PosedCoat {
        let body = &self.bodies[body];
        let poses = || body.links.iter().map(|index| self.links[*index as usize].desc.pose);
        let mut posed = PosedCoat::default();
        posed.coat.origin = origin;
        self.fill_coat(body, poses(), &mut posed);
        posed
    }

    /// Fills a coat, whose origin stays, with the enabled skeletons of a body, its links at these poses.
    pub(super) fn fill_coat(&self, body: &Body, poses: impl Iterator<Item = Pose>, posed: &mut PosedCoat) {
        let PosedCoat { coat, skeletons, poses: places } = posed;
        coat.isovalue = body.desc.isovalue;
        coat.skeletons.clear();
        skeletons.clear();
        places.clear();
        for (link, pose) in body.links.iter().map(|index| &self.links[*index as usize]).zip(poses) {
            for &index in link.skeletons.iter().filter(|_| link.enabled) {
                let skeleton = &self.skeletons[index as usize];
                if skeleton.enabled {
                    coat.add(&skeleton.desc.shape, skeleton.profile, &pose);
                    skeletons.push(index as usize);
                    places.push(coat.localise(&pose));
                }
            }
        }
        if let Some(substance) = &body.substance {
            return self.fill_particles(body, substance, coat);
        }
        match &body.blending {
            Some(blending) => coat.graph.clone_from(&blending.graph),
            None => coat.graph.clear(),
        }
    }

    /// Bodies that take part and have a bit of the mask in their category, in the order of their ids.
    pub(super) fn bodies_of(&self, mask: u64) -> impl Iterator<Item = usize> + '_ {
        self.bodies.indices().filter(move |index| {
            let body = &self.bodies[*index];
            body.enabled && body.desc.category & mask != 0
        })
    }

    /// What a part of a coat belongs to; a particle to neither.
    pub(super) fn skeleton_and_link(&self, skeletons: &[usize], part: usize) -> (SkeletonId, LinkId) {
        let Some(&index) = skeletons.get(part) else { return Default::default() };
        (self.skeletons.id_of(index), self.links.id_of(self.skeletons[index].link as usize))
    }

    /// The field of a body at points of the world: values into `values`, gradients \[1/m\] into `gradients`, each as
    /// long as `points` if given.
    ///
    /// The value is the sum over the skeletons \[97, eq. (1)\], or what a blend graph makes of them: the surface is where it equals the body's isovalue, the
    /// solid where it is larger. Zero for a body without enabled skeletons.
    pub fn evaluate_field(
        &self,
        body: BodyId,
        points: &[[f64; 3]],
        values: Option<&mut [f64]>,
        gradients: Option<&mut [[f64; 3]]>,
    ) -> Result<()> {
        self.evaluate_field_deformed(body, points, values, gradients, Deformation::None)
    }

    /// [`World::evaluate_field`] of a body's shape as `deformation` says. Away from contacts the same to the bit.
    pub fn evaluate_field_deformed(
        &self,
        body: BodyId,
        points: &[[f64; 3]],
        values: Option<&mut [f64]>,
        gradients: Option<&mut [[f64; 3]]>,
        deformation: Deformation,
    ) -> Result<()> {
        self.bodies.get(body)?;
        let lengths = [values.as_ref().map(|out| out.len()), gradients.as_ref().map(|out| out.len())];
        if lengths.iter().flatten().any(|length| *length != points.len()) {
            return Err(Error::Unsupported("values and gradients must be as long as points"));
        }
        require_points(points)?;
        let (Deformed { coat, obstacles }, _) = self.deformed_coat(body.index(), deformation);
        let local: Vec<[f64; 3]> = points.iter().map(|p| (Vec3::from(*p) - coat.origin).into()).collect();
        if obstacles.is_empty() {
            coat.evaluate(&local, values, gradients);
            return Ok(());
        }
        // The terms need both.
        let (mut own_values, mut own_gradients) = (Vec::new(), Vec::new());
        let values = values.unwrap_or_else(|| {
            own_values.resize(points.len(), 0.0);
            &mut own_values
        });
        let gradients = gradients.unwrap_or_else(|| {
            own_gradients.resize(points.len(), [0.0; 3]);
            &mut own_gradients
        });
        coat.evaluate(&local, Some(&mut *values), Some(&mut *gradients));
        let deformed = Deformed { coat, obstacles };
        for ((p, value), gradient) in local.iter().zip(values).zip(gradients) {
            let slope = Vec3::from(*gradient);
            let term = deformed.term(&Vec3::from(*p), &(*value - deformed.coat.isovalue, slope));
            *value += term.0;
            *gradient = (slope + term.1).into();
        }
        Ok(())
    }

    /// The first coat that a ray meets, among enabled bodies whose category shares a bit with `mask`.
    ///
    /// `direction` needs no unit length; `max_distance` \[m\] is at least 0 and may be infinite. A ray that starts
    /// inside a coat meets it at distance 0. Of coats at the same distance, the first body in the order of ids wins.
    pub fn cast_ray(&self, origin: &Vec3, direction: &Vec3, max_distance: f64, mask: u64) -> Result<Option<RayHit>> {
        self.cast_ray_deformed(origin, direction, max_distance, mask, Deformation::None)
    }

    /// [`World::cast_ray`] against the shapes of bodies as `deformation` says.
    pub fn cast_ray_deformed(
        &self,
        origin: &Vec3,
        direction: &Vec3,
        max_distance: f64,
        mask: u64,
        deformation: Deformation,
    ) -> Result<Option<RayHit>> {
        let ray = Ray { origin: *origin, direction: *direction, max_distance };
        ray.check()?;
        let direction = ray.unit_direction();
        let mut first: Option<RayHit> = None;
        for body in self.bodies_of(mask) {
            let posed = self.posed_coat(body);
            let local = posed.localise(origin);
            let hit = if deformation == Deformation::None {
                ray::cast(&posed.coat, &local, &direction, max_distance)
            } else if ray::enters(&posed.coat, &local, &direction, max_distance) {
                let mut target = Prepared::default();
                target.prepare(self.deformed_coat(body, deformation).0);
                target.cast(&local, &direction, max_distance)
            } else {
                None
            };
            let Some(hit) = hit else { continue };
            if first.is_none_or(|first| hit.distance < first.distance) {
                first = Some(self.ray_hit(body, &posed.coat.origin, &posed.skeletons, hit));
            }
        }
        Ok(first)
    }

    /// A hit of a body, whose coat is in a frame at `origin`, as the world has it.
    pub(super) fn ray_hit(&self, body: usize, origin: &Vec3, skeletons: &[usize], hit: SurfaceHit) -> RayHit {
        let (skeleton, link) = self.skeleton_and_link(skeletons, hit.skeleton);
        RayHit {
            body: self.bodies.id_of(body),
            link,
            skeleton,
            distance: hit.distance,
            position: hit.position + origin,
            normal: hit.normal,
        }
    }

    /// Bodies whose coat comes within `radius` \[m\] of a point (with radius 0: that contain it), among enabled bodies
    /// whose category shares a bit with `mask`; in the order of their ids.
    pub fn overlap_sphere(&self, center: &Vec3, radius: f64, mask: u64) -> Result<Vec<BodyId>> {
        require_finite("center", center)?;
        require("radius", radius, "at least 0", |x| x >= 0.0)?;
        let touches = |body: &usize| {
            let PosedCoat { coat, .. } = self.posed_coat(*body);
            let p = center - coat.origin;
            let in_reach = |k: &crate::field::Placed| k.shape.closest(&p).distance <= radius + k.profile.radius;
            coat.skeletons.iter().any(in_reach)
                && (coat.excess(&p) >= 0.0 || closest::closest(&coat, &p).is_some_and(|hit| hit.distance <= radius))
        };
        Ok(self.bodies_of(mask).filter(touches).map(|body| self.bodies.id_of(body)).collect())
    }

    /// The point of a body's surface closest to a point of the world, which may be inside; `None` for a body without
    /// enabled skeletons. Also answers for a body that is disabled as a whole.
    pub fn closest_point(&self, body: BodyId, point: &Vec3) -> Result<Option<SurfacePoint>> {
        self.closest_point_deformed(body, point, Deformation::None)
    }

    /// [`World::closest_point`] of a body's shape as `deformation` says.
    pub fn closest_point_deformed(
        &self,
        body: BodyId,
        point: &Vec3,
        deformation: Deformation,
    ) -> Result<Option<SurfacePoint>> {
        self.bodies.get(body)?;
        require_finite("point", point)?;
        let (deformed, skeletons) = self.deformed_coat(body.index(), deformation);
        let origin = deformed.coat.origin;
        Ok(deformed.closest(&(point - origin)).map(|SurfaceHit { distance, position, normal, skeleton }| {
            let (skeleton, link) = self.skeleton_and_link(&skeletons, skeleton);
            SurfacePoint { position: position + origin, normal, distance, link, skeleton }
        }))
    }

    /// The seeds of a skeleton, always in the same order: see [`coat::seeds`](crate::coat::seeds). At least as many as
    /// the skeleton's (or else the world's) seed count; none for a plane, which has no bounds to spread them over, and
    /// none while the skeleton or its link is disabled.
    pub fn seeds(&self, skeleton: SkeletonId) -> Result<Vec<Seed>> {
        let Followed { origin, seeds, .. } = self.follow(skeleton)?;
        let globalise = |seed: &territory::Seed| Seed {
            position: seed.position + origin,
            normal: seed.normal,
            valid: seed.is_valid(),
        };
        Ok(seeds.iter().map(globalise).collect())
    }

    /// The rays of a skeleton, in the frame of its link, and where they end, in a frame at `origin`; none for a plane, or
    /// while it is disabled.
    pub(super) fn follow(&self, skeleton: SkeletonId) -> Result<Followed> {
        let link = self.skeletons.get(skeleton)?.link as usize;
        let posed = self.posed_coat(self.links[link].body as usize);
        let mut followed = Followed { origin: posed.coat.origin, ..Followed::default() };
        let Some(index) = posed.skeletons.iter().position(|k| *k == skeleton.index()) else {
            return Ok(followed);
        };
        let desc = &self.skeletons[skeleton.index()].desc;
        let count = if desc.seed_count == 0 { self.desc.seed_count } else { desc.seed_count };
        seeds::rays(&desc.shape, desc.thickness, count as usize, &mut followed.rays);
        let pose = posed.poses[index];
        let rays: Vec<seeds::Ray> = followed.rays.iter().map(|ray| ray.transformed(&pose)).collect();
        territory::seeds(&posed.coat, index, &rays, &mut followed.seeds);
        Ok(followed)
    }
}

/// The rays of a skeleton, followed to their ends.
#[derive(Default)]
pub(super) struct Followed {
    pub(super) origin: Vec3,
    pub(super) rays: Vec<seeds::Ray>,
    pub(super) seeds: Vec<territory::Seed>,
}
