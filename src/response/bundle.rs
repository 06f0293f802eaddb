//! A bundle: what one worker puts together of the system of an [implicit step](super::implicit), and goes on to work out.
//!
//! Cores tell each other slowly what they wrote. So the groups of some candidates, or some springs, stay in the memory
//! where they were put together, and all that is asked of them is asked bundle by bundle.

use super::group::{Group, Member, Points, Push, Slope, Source, relative};
use super::sharing::Sharing;
use super::springs::Tie;
use crate::contact::patch::Sums;
use crate::contact::press::Carriers;
use crate::math::{Twist, Vec3, Wrench};

/// Groups of some candidates, or springs, with what they come to.
#[derive(Debug, Default)]
pub struct Bundle {
    /// The groups.
    pub groups: Vec<Group>,
    /// Points of all groups.
    pub points: Points,
    /// The springs.
    pub ties: Vec<Tie>,
    /// Members of all groups, then of all ties.
    pub members: Vec<Member>,
    /// The members whose links have unknowns, in the order of their parts.
    pub takers: Vec<Taker>,
    /// What each group, then each tie, comes to in the system.
    pub parts: Vec<Part>,
    /// Working memory.
    pub carriers: Carriers,
    /// Working memory.
    pub sharing: Sharing,
}

/// A member whose link has unknowns.
#[derive(Clone, Copy, Debug)]
pub struct Taker {
    /// The group, or the tie behind the groups.
    pub part: u32,
    /// The member.
    pub member: u32,
    /// The row of its link in the system.
    pub row: u32,
}

/// What a group or a tie comes to in the system.
#[derive(Clone, Copy, Debug, Default)]
pub struct Part {
    /// On b, about the group's centre.
    pub push: Push,
    /// Minus its derivative by the relative velocity.
    pub slope: Slope,
    /// The slope is more than nothing.
    pub resists: bool,
}

impl Bundle {
    /// Forgets groups and ties.
    pub fn clear(&mut self) {
        self.groups.clear();
        self.points.clear();
        self.ties.clear();
        self.members.clear();
        self.takers.clear();
        self.parts.clear();
    }

    /// First and last-plus-one member of each group, then of each tie.
    pub fn ranges(&self) -> impl Iterator<Item = (usize, usize)> {
        self.groups.iter().map(|group| group.members).chain(self.ties.iter().map(|tie| tie.members))
    }

    /// Some of the members.
    pub fn members_of(&self, (first, end): (usize, usize)) -> &[Member] {
        &self.members[first..end]
    }

    /// Lists the members whose links have unknowns, by the rows of links.
    pub fn find_takers(&mut self, row_of: impl Fn(u32) -> Option<u32>) {
        let mut takers = std::mem::take(&mut self.takers);
        for (part, (first, end)) in self.ranges().enumerate() {
            let member = |member: usize| (member as u32, row_of(self.members[member].link));
            for (member, row) in (first..end).map(member) {
                takers.extend(row.map(|row| Taker { part: part as u32, member, row }));
            }
        }
        self.takers = takers;
    }

    /// The same, part by part.
    pub fn takers_by_part(&self) -> impl Iterator<Item = &[Taker]> {
        self.takers.chunk_by(|a, b| a.part == b.part)
    }

    /// Sets the velocities at which the contact surfaces and the springs were evaluated in this round, for velocities
    /// `of` the links.
    pub fn set_base(&mut self, of: impl Fn(u32) -> Twist) {
        let Self { groups, ties, members, .. } = self;
        let relative_of = |(first, end): (usize, usize)| relative(&members[first..end], &of);
        for group in groups.iter_mut().filter(|group| !group.looked) {
            group.base = relative_of(group.members);
        }
        for tie in ties {
            tie.set_velocity(&relative_of(tie.members).linear);
        }
    }

    /// Works out all parts at velocities `of` the links, with their slopes if they are wanted.
    pub fn respond(&mut self, of: impl Fn(u32) -> Twist, h: f64, with_slope: bool) {
        let Self { groups, points, ties, members, parts, .. } = self;
        let relative_of = |(first, end): (usize, usize)| relative(&members[first..end], &of);
        parts.resize(groups.len() + ties.len(), Part::default());
        let (of_groups, of_ties) = parts.split_at_mut(groups.len());
        for (group, part) in groups.iter().zip(of_groups) {
            let slope = with_slope.then_some(&mut part.slope);
            part.push = group.respond(points, &relative_of(group.members), h, slope);
            part.resists = part.push.all != Wrench::default();
        }
        for (tie, part) in ties.iter().zip(of_ties) {
            let (force, ll) = tie.respond(&relative_of(tie.members).linear, h);
            part.push.all = Wrench { force, torque: Vec3::zeros() };
            (part.slope, part.resists) = (Slope { ll, ..Slope::default() }, true);
        }
    }

    /// Each group with what it comes to.
    pub fn pushes(&self) -> impl Iterator<Item = (&Group, &Push)> {
        self.groups.iter().zip(self.parts.iter().map(|part| &part.push))
    }

    /// Leaves the patches, but not the walls, a part of their stiffness.
    pub fn soften(&mut self, part: f64) {
        for group in self.groups.iter().filter(|group| matches!(group.source, Source::Patch(_))) {
            self.points.soften(group.points.0..group.points.1, part);
        }
    }

    /// Half the width of a group's patch.
    pub fn size(&self, group: &Group) -> f64 {
        (self.points.sums(group.points).0 / std::f64::consts::PI).sqrt()
    }

    /// What a patch comes to of which these are the groups, about its centre of pressure.
    pub fn sums_of(&self, groups: std::ops::Range<usize>) -> Sums {
        let pushes =
            || self.groups[groups.clone()].iter().zip(self.parts[groups.clone()].iter().map(|part| &part.push));
        let mut sums = Sums::default();
        let mut load = 0.0;
        for (group, push) in pushes() {
            let size = push.pressing.force.norm();
            sums.center += group.center * size;
            load += size;
            sums.force += push.pressing.force;
            let (area, stiffness) = self.points.sums(group.points);
            sums.area += area;
            sums.stiffness += stiffness;
        }
        if load > 0.0 {
            sums.center /= load;
        }
        for (group, push) in pushes() {
            sums.torque += push.pressing.torque + (group.center - sums.center).cross(&push.pressing.force);
        }
        sums
    }
}
