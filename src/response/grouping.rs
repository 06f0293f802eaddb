//! From contact surfaces to groups: what each candidate brings into the system of an
//! [implicit step](super::implicit), as points that press and rub on the links that carry them.

use super::bundle::Bundle;
use super::group::{Grip, Group, Member, Point, Source, relative};
use crate::base::{Inertia, Motion};
use crate::contact::candidate::Candidate;
use crate::contact::deepest::{self, Approach};
use crate::contact::overload::is_overloaded;
use crate::contact::pair::Pair;
use crate::contact::patch::{self, Node, Patch, Sums};
use crate::contact::press::{Material, Share, friction_radius};
use crate::contact::stiffness::reachable;
use crate::math::{Twist, Vec3};

/// Slip velocity up to which friction grows, in thicknesses of the thinner coat a second.
pub const CREEP: f64 = 0.01;

/// Part of a bristle's bend that is taken back in one step.
pub const RECOVERY: f64 = 0.2;

/// Speed at which the push-out moves bodies apart, in thicknesses of the thinner coat a second.
const PUSH_OUT: f64 = 2.0;

/// Stiffness of a wall, over what would take up a mass within a step.
const WALL: f64 = 1e3;

/// Cosine between directions from which on two places of a pair face the same way.
const FACING: f64 = 0.9;

/// A candidate whose groups are put together.
pub struct Grouping<'a> {
    /// Where they are put.
    pub bundle: &'a mut Bundle,
    /// The links where the step begins.
    pub motions: &'a [Motion],
    /// The links where the round begins.
    pub trial: &'a [Motion],
    /// The candidate.
    pub candidate: &'a Candidate,
    /// Its position.
    pub index: u32,
    /// Length of the step \[s\].
    pub h: f64,
    /// Beyond this distance nothing can come together in this round \[m\].
    pub reach: f64,
    /// The surface is frozen where it is.
    pub last_resort: bool,
}

impl Grouping<'_> {
    /// Adds the groups of the candidate's contact surface, and of what is not in touch yet.
    pub fn add_all(&mut self) {
        let Candidate { pair, surface, material, .. } = self.candidate;
        let h = self.h;
        for (number, patch) in surface.patches.iter().enumerate() {
            let nodes = &surface.nodes[patch.nodes.0..patch.nodes.1];
            let sums = patch::sum(nodes);
            if sums.force != Vec3::zeros() {
                // Parts that must come apart are held by nothing: the flanks of one deep in another could lock them.
                let material = if patch.overloaded { Material::default() } else { *material };
                let grip = self.grip(patch, &material, &sums, nodes);
                self.add_patch(number, nodes, &sums, &material, &grip);
            }
        }
        // What must come apart, from where the step began.
        for (number, (i, j, approach)) in surface.overloads.iter().enumerate() {
            let corners = corners(pair, *i, *j, approach).filter(|corner| is_overloaded(pair, *i, *j, corner));
            for approach in std::iter::once(*approach).chain(corners) {
                self.bundle.carriers.find(pair, &approach.meeting);
                let come = self.closing(&approach) * h;
                let room = -PUSH_OUT * thinner(pair, *i, *j) * h - come;
                self.add_wall(Source::Overload(number as u32), [*i, *j], &approach, room);
            }
        }
        if !surface.overloads.is_empty() {
            return;
        }
        for (i, j) in combinations(pair) {
            let approach = deepest::approach(pair, i, j);
            if pair.is_covered(&approach.meeting) {
                continue;
            }
            let reach = self.reach;
            let gap_of = |approach: &Approach| approach.distance - thicknesses(pair, i, j);
            let gap = gap_of(&approach);
            if self.last_resort {
                // Nothing comes deeper than a coat bears, whatever its speed.
                let near = corners(pair, i, j, &approach).filter(|corner| gap_of(corner) <= reach);
                for wall in std::iter::once(approach).chain(near) {
                    let room = (gap_of(&wall) + 0.5 * thinner(pair, i, j)).max(0.0);
                    self.add_wall(Source::Gap, [i, j], &wall, room);
                }
            } else if surface.patches.is_empty() && gap <= reach {
                // A gap that may close, so that the next round starts from a shallow touch; one without depth has no
                // patch yet.
                self.add_gap([i, j], &approach, gap.max(0.0));
            }
        }
    }

    /// Adds the groups of a patch.
    fn add_patch(&mut self, number: usize, nodes: &[Node], sums: &Sums, material: &Material, grip: &Grip) {
        let Self { bundle, motions, trial, candidate, index, h, .. } = self;
        let pair = &candidate.pair;
        let Bundle { groups, points, members, sharing, .. } = &mut **bundle;
        sharing.find(pair, nodes);
        sharing.each_kind(nodes, |nodes, shares| {
            let (first_point, first_member) = (points.count(), members.len());
            let center = points.extend(nodes);
            members.extend(shares.iter().map(|share| Member {
                arm: center - (candidate.center_looked_at(share.link, trial) - pair.origin),
                ..member(trial, pair, &center, *share)
            }));
            let own = &members[first_member..];
            let base =
                (!candidate.fresh).then(|| relative(own, |link| candidate.velocity_looked_at(link, motions, *h)));
            groups.push(Group {
                candidate: *index,
                source: Source::Patch(number as u32),
                center,
                points: (first_point, points.count()),
                members: (first_member, members.len()),
                material: *material,
                grip: Grip { slip: grip.slip + grip.spin.cross(&(center - sums.center)), ..*grip },
                looked: base.is_some(),
                base: base.unwrap_or_default(),
            });
        });
    }

    /// Dry friction of a patch.
    fn grip(&self, patch: &Patch, material: &Material, sums: &Sums, nodes: &[Node]) -> Grip {
        let Candidate { pair, memory, .. } = self.candidate;
        if material.friction <= 0.0 && material.static_friction <= 0.0 {
            return Grip::default();
        }
        let [i, j] = patch.skeletons;
        let thickness = thinner(pair, i, j);
        let key = patch.key(pair);
        let mut grip = Grip {
            coefficient: material.friction,
            creep: CREEP * thickness,
            radius: if nodes.len() == 1 { friction_radius(nodes, sums) } else { 0.0 },
            ..Grip::default()
        };
        if material.static_friction > 0.0 {
            let bristle = memory.bristles.iter().find(|bristle| bristle.key == key);
            if bristle.is_none_or(|bristle| !bristle.sliding) {
                grip.coefficient = material.static_friction;
            }
            if let Some(bristle) = bristle {
                grip.slip = bristle.slip * (-RECOVERY / self.h);
                grip.spin = sums.force.normalize() * (bristle.turn * (-RECOVERY / self.h));
            }
        }
        grip
    }

    /// A gap that pushes once the velocities close it, as softly as a shallow contact would.
    fn add_gap(&mut self, [i, j]: [usize; 2], approach: &Approach, gap: f64) {
        let pair = &self.candidate.pair;
        let stiffness = reachable(pair, i, j, 0.1 * thinner(pair, i, j)).stiffness;
        self.add_lone(Source::Gap, approach, -stiffness * gap, stiffness);
    }

    /// A wall beyond which two skeletons come no closer than `room` metres from where they are; negative room parts them.
    fn add_wall(&mut self, source: Source, [i, j]: [usize; 2], approach: &Approach, room: f64) {
        let pair = &self.candidate.pair;
        self.bundle.carriers.find(pair, &approach.meeting);
        let mobility = self.bundle.carriers.mobility(self.trial, &pair.origin, &approach.meeting);
        let along = approach.direction.dot(&(mobility * approach.direction));
        if along > 0.0 {
            let stiffness = (WALL / (along * self.h * self.h)).max(reachable(pair, i, j, f64::INFINITY).stiffness);
            self.add_lone(source, approach, -stiffness * room, stiffness);
        }
    }

    /// How fast b comes towards a where two skeletons are closest, at the trial's velocities.
    fn closing(&self, approach: &Approach) -> f64 {
        let origin = &self.candidate.pair.origin;
        -self.bundle.carriers.slip(self.trial, origin, &approach.meeting).dot(&approach.direction)
    }

    fn add_lone(&mut self, source: Source, approach: &Approach, load: f64, stiffness: f64) {
        let Bundle { groups, points, members, carriers, .. } = &mut *self.bundle;
        let (pair, center) = (&self.candidate.pair, approach.meeting);
        let (first_point, first_member) = (points.count(), members.len());
        points.push(&Point { arm: Vec3::zeros(), normal: approach.direction, load, stiffness, area: 0.0 });
        carriers.find(pair, &center);
        members.extend(carriers.both().map(|share| member(self.trial, pair, &center, share)));
        groups.push(Group {
            candidate: self.index,
            source,
            center,
            points: (first_point, points.count()),
            members: (first_member, members.len()),
            material: Material::default(),
            grip: Grip::default(),
            looked: false,
            base: Twist::default(),
        });
    }
}

/// What a link that carries a point of a pair is to a group.
fn member(trial: &[Motion], pair: &Pair, center: &Vec3, Share { link, weight }: Share) -> Member {
    let motion = &trial[link as usize];
    let turns = !matches!(motion.inertia, Inertia::Point { .. });
    Member { link, weight, arm: center - (motion.center - pair.origin), turns }
}

/// All pairs of skeletons of a pair.
pub fn combinations(pair: &Pair) -> impl Iterator<Item = (usize, usize)> + use<> {
    let (a, b) = (pair.a.skeletons.len(), pair.b.skeletons.len());
    (0..a).flat_map(move |i| (0..b).map(move |j| (i, j)))
}

/// The corners of two skeletons that face each other as these do where they come closest: walls that hold a face, which
/// one alone would let tip over.
fn corners(pair: &Pair, i: usize, j: usize, approach: &Approach) -> impl Iterator<Item = Approach> {
    let direction = approach.direction;
    deepest::approaches_of_corners(pair, i, j)
        .filter(move |corner| corner.direction.dot(&direction) > FACING && !pair.is_covered(&corner.meeting))
}

/// Thickness of the thinner of two coats.
pub fn thinner(pair: &Pair, i: usize, j: usize) -> f64 {
    pair.a.skeletons[i].profile.thickness.min(pair.b.skeletons[j].profile.thickness)
}

/// How far apart two skeletons are whose coats just touch.
pub fn thicknesses(pair: &Pair, i: usize, j: usize) -> f64 {
    pair.a.skeletons[i].profile.thickness + pair.b.skeletons[j].profile.thickness
}
