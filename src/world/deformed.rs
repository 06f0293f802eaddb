//! What presses on a body: from nouns to the obstacles of its coat.

use super::query::PosedCoat;
use super::{Body, World};
use crate::base::Motion;
use crate::coat::Coat;
use crate::contact::candidate::Candidate;
use crate::contact::deepest;
use crate::field::Shape;
use crate::math::Vec3;
use crate::surface::deformed::{Attenuation, Deformed, Obstacle};

/// Which shape of a body a query sees.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Deformation {
    /// The coat as if it touched nothing.
    #[default]
    None,
    /// Flattened along its contact surfaces with other bodies, at the present poses.
    Contact,
    /// Flattened, and bulging round its contacts as [`BodyDesc::bulge_width`](super::BodyDesc::bulge_width) says.
    Bulges,
}

impl World {
    /// A body's coat with what presses on it, and the arena indices of its skeletons. Undeformed it takes the memory of
    /// `posed`, whose coat is to be put back, and asks for no more.
    pub(super) fn shape_of<'a>(
        &self,
        index: usize,
        deformation: Deformation,
        posed: &'a mut PosedCoat,
    ) -> (Deformed, &'a [usize]) {
        if deformation != Deformation::None {
            let (deformed, skeletons) = self.deformed_coat(index, deformation);
            posed.skeletons = skeletons;
            return (deformed, &posed.skeletons);
        }
        let body = &self.bodies[index];
        let pose_of = |link: &u32| self.links[*link as usize].desc.pose;
        posed.coat.origin = body.links.first().map_or(Vec3::zeros(), |link| pose_of(link).position);
        self.fill_coat(body, body.links.iter().map(pose_of), posed);
        (Deformed { coat: std::mem::take(&mut posed.coat), obstacles: Vec::new() }, &posed.skeletons)
    }

    /// A body's coat as its contacts at the present poses deform it, with the arena indices of its skeletons. Obstacles
    /// are the enabled bodies whose fields reach it and whose masks agree; the pair filter is not asked, as it may change.
    pub(super) fn deformed_coat(&self, index: usize, deformation: Deformation) -> (Deformed, Vec<usize>) {
        let PosedCoat { coat, skeletons, .. } = self.posed_coat(index);
        let mut deformed = Deformed { coat, obstacles: Vec::new() };
        if deformation == Deformation::None || self.bodies[index].desc.rigid {
            return (deformed, skeletons);
        }
        let neighbours = self.neighbours(index, &deformed.coat);
        let motions = if neighbours.is_empty() { Vec::new() } else { self.motions() };
        let obstacle = |(other, coat)| self.obstacle([index, other], coat, deformation, &motions);
        deformed.obstacles.extend(neighbours.into_iter().map(obstacle));
        (deformed, skeletons)
    }

    /// The bodies that may meet a body with this coat, with theirs in its frame: enabled ones whose fields reach it and
    /// whose masks agree; none if it is disabled itself.
    pub(super) fn neighbours(&self, index: usize, coat: &Coat) -> Vec<(usize, Coat)> {
        let body = &self.bodies[index];
        if !body.enabled || coat.skeletons.is_empty() {
            return Vec::new();
        }
        let meet = |other: &Body| {
            other.enabled && body.desc.mask & other.desc.category != 0 && other.desc.mask & body.desc.category != 0
        };
        let others = self.bodies.indices().filter(|other| *other != index && meet(&self.bodies[*other]));
        let posed = others.map(|other| (other, self.posed_coat_in(other, coat.origin).coat));
        posed.filter(|(_, other)| overlap(coat, other)).collect()
    }

    /// What the second body is to the first.
    fn obstacle(&self, bodies: [usize; 2], coat: Coat, deformation: Deformation, motions: &[Motion]) -> Obstacle {
        let [body, other] = bodies.map(|index| &self.bodies[index]);
        let mut candidate = Candidate::default();
        candidate.bodies = bodies.map(|index| index as u32);
        let bounds = bodies.map(|index| self.bounds_of(index, motions, 0.0));
        let mut greatest = 0.0;
        if let [Some(first), Some(second)] = &bounds
            && self.fill(&mut candidate, motions, [first, second], 0.0)
        {
            candidate.pair.place(motions, candidate.lead);
            greatest = deepest::greatest(&candidate.pair);
        } else {
            // Too far apart for a contact, but one may bulge towards the other.
            candidate.pair.a.stiffness_scale = body.stiffness_scale;
            candidate.pair.b.stiffness_scale = other.stiffness_scale;
            candidate.pair.b.rigid = other.desc.rigid;
            candidate.pair.prepare();
        }
        let share = candidate.pair.shares()[1];
        let isovalue = other.desc.isovalue;
        let width = body.desc.bulge_width * isovalue.min(body.desc.isovalue);
        if deformation == Deformation::Bulges && width > 0.0 {
            let bulge = Attenuation::new(body.desc.bulge_height * share * greatest, share * width);
            Obstacle { coat, share, reach: width, bulge }
        } else {
            Obstacle { coat, share, reach: isovalue, bulge: Attenuation::default() }
        }
    }
}

/// Whether the fields of two coats may overlap.
fn overlap(a: &Coat, b: &Coat) -> bool {
    let (bounds_a, bounds_b) = (a.bounds(), b.bounds());
    let (low, high) = (bounds_a.0.sup(&bounds_b.0), bounds_a.1.inf(&bounds_b.1));
    let (middle, half): (Vec3, Vec3) = ((low + high) * 0.5, (high - low) * 0.5);
    let within = |coat: &Coat| {
        coat.skeletons.iter().any(|k| {
            let (l, h) = k.shape.bounds(k.profile.radius);
            let apart = (0..3).any(|axis| l[axis] > high[axis] || low[axis] > h[axis]);
            // A plane has no bounds that would tell.
            let above = match k.shape {
                Shape::Plane { point, normal } => {
                    (middle - point).dot(&normal) - half.dot(&normal.abs()) > k.profile.radius
                }
                _ => false,
            };
            !apart && !above
        })
    };
    (0..3).all(|axis| low[axis] <= high[axis]) && within(a) && within(b)
}
