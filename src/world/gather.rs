//! Gathering: from the nouns of the world to the motions and candidate pairs that the step works on.

use std::borrow::Cow;
use std::sync::Arc;

use super::step::Stepping;
use super::{Body, BodyId, Link, Skeleton, World};
use crate::base::{Inertia, Kind, Motion};
use crate::coat::seeds::Ray;
use crate::contact::broad_phase::Bounds;
use crate::contact::candidate::Candidate;
use crate::contact::pair::{Cover, Side};
use crate::contact::press::Material;
use crate::field::{Placed, Shape};
use crate::math::{Pose, Twist, Vec3};
use crate::response::Response;

impl World {
    /// The motion of a link as the host or the last step left it.
    pub(super) fn motion_of(&self, link: &Link) -> Motion {
        let desc = &link.desc;
        let movable = link.enabled && self.bodies[link.body as usize].enabled;
        let inertia = match desc.kind {
            _ if !movable => Inertia::Immovable,
            Kind::Fixed => Inertia::Immovable,
            Kind::PointMass => Inertia::Point { inverse_mass: 1.0 / desc.mass },
            Kind::Host if desc.mass == 0.0 => Inertia::Immovable,
            Kind::Host | Kind::Rigid => match &desc.inverse_effective_inertia {
                Some(matrix) if desc.kind == Kind::Host => Inertia::Effective(**matrix),
                _ => Inertia::solid(desc.mass, desc.inertia, &desc.pose.rotation),
            },
        };
        let mut motion = Motion {
            center: desc.pose.transform_point(&desc.local_center),
            rotation: desc.pose.rotation,
            local_center: desc.local_center,
            twist: if desc.kind == Kind::Fixed || !movable { Twist::default() } else { desc.twist },
            inertia,
            ..Motion::default()
        };
        if motion.is_movable() {
            motion.acceleration = self.desc.gravity * desc.gravity_scale + desc.external_acceleration;
            motion.angular_acceleration = desc.external_angular_acceleration;
        }
        motion
    }

    /// The motions of all links, by their slots.
    pub(super) fn motions(&self) -> Vec<Motion> {
        let motion =
            |index| if self.links.is_live(index) { self.motion_of(&self.links[index]) } else { Motion::default() };
        (0..self.links.capacity()).map(motion).collect()
    }

    /// The enabled skeletons of a body, with the slots of their links and their own.
    pub(super) fn skeletons_of<'a>(&'a self, body: &'a Body) -> impl Iterator<Item = Part<'a>> + 'a {
        let enabled_links = body.links.iter().filter(|link| self.links[**link as usize].enabled);
        enabled_links.flat_map(move |link| {
            self.links[*link as usize].skeletons.iter().filter_map(move |index| {
                let skeleton = &self.skeletons[*index as usize];
                skeleton.enabled.then_some((*link, *index, skeleton))
            })
        })
    }

    /// How fast the links of those that may bounce in sub-steps can be in directions they do not move in yet: as they come,
    /// and by what their contacts hold, over the mass of the body. What joints hold does not fly where it is thrown.
    pub(super) fn foresee_bounces(&self, state: &mut Stepping) {
        let bounces = |body: &Body| match body.desc.response {
            Response::Auto => matches!(self.desc.response, Response::Auto | Response::Substepped),
            own => own == Response::Substepped,
        };
        for candidate in state.candidates.iter().filter(|candidate| candidate.memory.held > 0.0) {
            let [a, b] = candidate.memory.ids.map(|id| self.bodies.get(BodyId::from_raw(id)).ok());
            for body in [a, b.filter(|_| candidate.bodies[0] != candidate.bodies[1])].into_iter().flatten() {
                let moving = || body.links.iter().filter(|link| state.motions[**link as usize].is_movable());
                let mass: f64 = moving().map(|link| 1.0 / state.motions[*link as usize].inverse_mass()).sum();
                for link in body.links.iter().filter(|_| mass > 0.0) {
                    state.motions[*link as usize].recoil += 2.0 * candidate.memory.held / mass;
                }
            }
        }
        for body in self.bodies.indices().map(|slot| &self.bodies[slot]).filter(|body| !body.is_asleep()) {
            for link in &body.links {
                let motion = &mut state.motions[*link as usize];
                let foreseen = motion.is_movable() && bounces(body) && !self.links[*link as usize].is_held();
                let speed2 = motion.twist.linear.norm_squared() + motion.recoil;
                motion.recoil = if foreseen { speed2.sqrt() } else { 0.0 };
            }
        }
    }

    /// Bounds of a body over a step of `dt`. `None` when it has no coat.
    pub(super) fn bounds_of(&self, index: usize, motions: &[Motion], dt: f64) -> Option<Bounds> {
        let mut skeletons = self.skeletons_of(&self.bodies[index]);
        let (link, _, Skeleton { desc, reach, .. }) = skeletons.next()?;
        let motion = &motions[link as usize];
        let (mut low, mut high) = swept(&desc.shape, *reach, motion, dt);
        let (mut middle, mut radius) = swept_ball(&desc.shape, *reach, motion, dt);
        for (link, _, skeleton) in skeletons {
            let (l, h) = swept(&skeleton.desc.shape, skeleton.reach, &motions[link as usize], dt);
            (low, high) = (l.inf(&low), h.sup(&high));
            (middle, radius) = (Vec3::zeros(), f64::INFINITY);
        }
        Some(Bounds { low, high, middle, radius, body: index as u32 })
    }

    /// Fills a candidate with what of its bodies can matter within both their bounds. False when nothing can.
    pub(super) fn fill(&self, candidate: &mut Candidate, motions: &[Motion], bounds: [&Bounds; 2], dt: f64) -> bool {
        let [a, b] = candidate.bodies.map(|body| &self.bodies[body as usize]);
        if a.desc.rigid && b.desc.rigid {
            return false;
        }
        let region = (bounds[0].low.sup(&bounds[1].low), bounds[0].high.inf(&bounds[1].high));
        self.fill_side(&mut candidate.pair.a, a, motions, &region, dt);
        self.fill_side(&mut candidate.pair.b, b, motions, &region, dt);
        if candidate.pair.a.locals.is_empty() || candidate.pair.b.locals.is_empty() {
            return false;
        }
        candidate.pair.covers.clear();
        candidate.pair.prepare();
        candidate.material = material(a, b);
        // The smaller body's link leads: its coordinates near the contact are the smallest. Of those alike always the
        // same one, so that their surface may stand.
        let size = |bounds: &Bounds| (bounds.high - bounds.low).norm();
        let smaller = if size(bounds[0]) <= 1.01 * size(bounds[1]) { &candidate.pair.a } else { &candidate.pair.b };
        candidate.lead = smaller.links[0];
        true
    }

    pub(super) fn fill_side(&self, side: &mut Side, body: &Body, motions: &[Motion], region: &(Vec3, Vec3), dt: f64) {
        side.begin(body);
        let mut parts = self.skeletons_of(body).enumerate().peekable();
        while let Some((position, part)) = parts.next() {
            // The only one is what the body's bounds are of.
            let only = position == 0 && parts.peek().is_none() && !matches!(part.2.desc.shape, Shape::Plane { .. });
            if only || self.is_within(&part, motions, region, dt) {
                side.add(&part, position, self.desc.seed_count);
            }
        }
        side.end();
        if let Some(blending) = &body.blending {
            blending.graph.restrict(&side.positions, &mut side.graph);
        }
    }

    /// Whether the field of a skeleton may reach a region during a step.
    fn is_within(&self, part: &Part, motions: &[Motion], region: &(Vec3, Vec3), dt: f64) -> bool {
        let (link, _, skeleton) = part;
        let (shape, motion, radius) = (&skeleton.desc.shape, &motions[*link as usize], skeleton.profile.radius);
        let (low, high) = swept(shape, radius, motion, dt);
        let apart = (0..3).any(|axis| low[axis] > region.1[axis] || region.0[axis] > high[axis]);
        !apart && !is_above(shape, &motion.pose(), radius, region)
    }

    /// Fills a candidate with two parts of one body that collide. False when they are not close enough.
    pub(super) fn fill_block(&self, candidate: &mut Candidate, motions: &[Motion], dt: f64) -> bool {
        let body = &self.bodies[candidate.bodies[0] as usize];
        let Some(blending) = &body.blending else { return false };
        let block = &blending.blocks[candidate.block as usize];
        let part = |position: u32| -> Part {
            let slot = blending.order[position as usize];
            let skeleton = &self.skeletons[slot as usize];
            (skeleton.link, slot, skeleton)
        };
        // Where the surfaces of both may lie.
        let mut region = (Vec3::repeat(f64::NEG_INFINITY), Vec3::repeat(f64::INFINITY));
        for side in &block.sides {
            let mut bounds = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
            for position in side {
                let (link, _, skeleton) = part(*position);
                let (low, high) = swept(&skeleton.desc.shape, skeleton.reach, &motions[link as usize], dt);
                bounds = (bounds.0.inf(&low), bounds.1.sup(&high));
            }
            region = (region.0.sup(&bounds.0), region.1.inf(&bounds.1));
        }
        let pair = &mut candidate.pair;
        pair.covers.clear();
        for (side, positions) in [&mut pair.a, &mut pair.b].into_iter().zip(&block.sides) {
            side.begin(body);
            side.stiffness_scale *= block.share;
            for position in positions {
                let part = part(*position);
                if self.is_within(&part, motions, &region, dt) {
                    side.add(&part, *position as usize, self.desc.seed_count);
                }
            }
            side.end();
        }
        if (0..3).any(|axis| region.0[axis] > region.1[axis])
            || pair.a.skeletons.is_empty()
            || pair.b.skeletons.is_empty()
        {
            return false;
        }
        for (position, weight) in &block.covers {
            let part = part(*position);
            if self.is_within(&part, motions, &region, dt) {
                let (link, _, Skeleton { desc, profile, .. }) = part;
                let skeleton = Placed { shape: desc.shape, profile: *profile };
                pair.covers.push(Cover { skeleton, local: desc.shape, link, weight: *weight });
            }
        }
        pair.prepare();
        candidate.material = material(body, body);
        candidate.lead = pair.a.links[0];
        true
    }

    /// The thinnest coat of a link's skeletons.
    pub(super) fn thinnest(&self, link: &Link) -> f64 {
        let thickness = |index: &u32| self.skeletons[*index as usize].profile.thickness;
        link.skeletons.iter().map(thickness).fold(f64::INFINITY, f64::min)
    }
}

/// A skeleton with the slots of its link and its own.
type Part<'a> = (u32, u32, &'a Skeleton);

impl Side {
    /// Begins to fill a side with a body's skeletons.
    fn begin(&mut self, body: &Body) {
        self.clear();
        self.isovalue = body.desc.isovalue;
        self.stiffness_scale = body.stiffness_scale;
        self.rigid = body.desc.rigid;
    }

    /// Adds a skeleton, by its position among the enabled ones of the body.
    fn add(&mut self, (link, index, skeleton): &Part, position: usize, seed_count: u32) {
        let shape = skeleton.desc.shape;
        self.skeletons.push(Placed { shape, profile: skeleton.profile });
        self.positions.push(position as u32);
        self.locals.push(shape);
        self.poses.push(Pose::default());
        self.links.push(*link);
        self.ids.push(*index);
        self.reach.push(skeleton.reach);
        let rays = skeleton.rays(seed_count);
        match self.rays.get_mut(self.skeletons.len() - 1) {
            // Nobody counts references while nothing changes: workers would wait for each other.
            Some(old) if Arc::ptr_eq(old, &rays) => {}
            Some(old) => *old = rays.into_owned(),
            None => self.rays.push(rays.into_owned()),
        }
    }

    /// Drops what is left of the last filling.
    fn end(&mut self) {
        self.rays.truncate(self.skeletons.len());
    }
}

impl Skeleton {
    /// The skeleton's rays in its link's frame, made at the first use. None for a plane: its lattice depends on what
    /// lies on it. They are those of the coat without an offset, so that they stay the same while it swells.
    pub(super) fn rays(&self, default_count: u32) -> Cow<'_, Arc<[Ray]>> {
        let count = if self.desc.seed_count == 0 { default_count } else { self.desc.seed_count };
        let make = || {
            let mut rays = Vec::new();
            if !matches!(self.desc.shape, Shape::Plane { .. }) {
                crate::coat::seeds::rays(&self.desc.shape, self.desc.thickness, count as usize, &mut rays);
            }
            (count, rays.into())
        };
        let (made_for, rays) = self.rays.get_or_init(make);
        if *made_for == count { Cow::Borrowed(rays) } else { Cow::Owned(make().1) }
    }
}

/// Bounds of a shape grown by `margin`, over a step of `dt` in which its link moves.
fn swept(shape: &Shape, margin: f64, motion: &Motion, dt: f64) -> (Vec3, Vec3) {
    let pose = motion.pose();
    let (low, high) = shape.transformed(&pose).bounds(margin);
    // Translation goes one way; turning, acceleration and bounces may go any.
    let path = motion.twist.linear * dt;
    let size = (high - low).norm() + (pose.position - motion.center).norm();
    let turned = if size.is_finite() { (motion.twist.angular.norm() * dt).min(2.0) * size } else { 0.0 };
    let any = Vec3::repeat(0.5 * motion.acceleration.norm() * dt * dt + turned);
    let bounce = Vec3::repeat(motion.recoil * dt);
    (low + path.inf(&-bounce) - any, high + path.sup(&bounce) + any)
}

/// How far contacts may carry a body beyond its free path in a step, over its margin: without, contacts that begin within
/// the step were found too late, and gained 6e-6 of the energy of ten hard balls.
const ROOM: f64 = 0.1;

/// Middle and radius of a ball around the same; a plane's has no end.
fn swept_ball(shape: &Shape, margin: f64, motion: &Motion, dt: f64) -> (Vec3, f64) {
    let middle = motion.pose().transform_point(&shape.middle());
    let path = motion.twist.linear * dt;
    let turned = (motion.twist.angular.norm() * dt).min(2.0) * (middle - motion.center).norm();
    let any = 0.5 * motion.acceleration.norm() * dt * dt + turned;
    // Bounces are at least as fast as what comes, where they are foreseen.
    let bounce = motion.recoil * dt;
    let (middle, reach) = if bounce > 0.0 { (middle, bounce) } else { (middle + path * 0.5, 0.5 * path.norm()) };
    (middle, shape.half_extent() + (1.0 + ROOM) * margin + any + reach)
}

/// Whether all of a region is farther than `reach` above a plane, which has no bounds that would tell.
fn is_above(shape: &Shape, pose: &Pose, reach: f64, region: &(Vec3, Vec3)) -> bool {
    let Shape::Plane { point, normal } = shape else { return false };
    let (point, normal) = (pose.transform_point(point), pose.rotation * normal);
    let (middle, half) = ((region.0 + region.1) * 0.5, (region.1 - region.0) * 0.5);
    // Two planes meet in a region without bounds, which is not above anything.
    (middle - point).dot(&normal) - half.dot(&normal.abs()) > reach
}

/// What two bodies make of their surfaces (the rules are those of [`BodyDesc`](super::BodyDesc)).
pub(super) fn material(a: &Body, b: &Body) -> Material {
    let (scales, dissipations) = ([a.stiffness_scale, b.stiffness_scale], [a.dissipation, b.dissipation]);
    let (a, b) = (&a.desc, &b.desc);
    let mean = |x: f64, y: f64| (x * y).sqrt();
    // The softer a body, the more of the flesh that moves is its own: d = (K_b d_a + K_a d_b) / (K_a + K_b).
    let dissipation = match (a.rigid, b.rigid) {
        (false, true) => dissipations[0],
        (true, false) => dissipations[1],
        _ => {
            let [ka, kb] = scales;
            (kb * dissipations[0] + ka * dissipations[1]) / (ka + kb)
        }
    };
    Material {
        friction: mean(a.friction, b.friction),
        static_friction: mean(a.static_friction, b.static_friction),
        viscous: a.viscous_friction * b.viscous_friction,
        dissipation,
    }
}
