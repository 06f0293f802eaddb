//! Whether a world that was read from a [snapshot](super::snapshot) is one: everything that a step counts on, checked as
//! creation would, and against the rest.

use super::blend::{Blending, Pairing};
use super::sleep::Sleep;
use super::{Contact, Link, LinkId, Skeleton, SkeletonId, World, desc};
use crate::coat::volume::OFFSETS;
use crate::contact::candidate::Memory;
use crate::contact::friction::Bristle;
use crate::contact::standing::Place;
use crate::error::{Error, Result, require, require_finite};
use crate::handle::{Arena, Noun};
use crate::math::Pose;
use crate::response::mirror::Mirror;

impl World {
    /// Every link belongs to the one body that lists it, every skeleton to the one link, every spring to the body of its
    /// links.
    pub(super) fn check_owners(&self) -> Result<()> {
        let bodies = self.bodies.indices().map(|body| (body, &self.bodies[body].links));
        let links = self.links.indices().map(|link| (link, &self.links[link].skeletons));
        check_lists("body", bodies, &self.links, |_, link| link.body)?;
        check_lists("link", links, &self.skeletons, |_, skeleton| skeleton.link)?;
        let mut body_of = vec![0; self.springs.capacity()];
        for index in self.springs.indices() {
            let body = self.check_spring(&self.springs[index].desc);
            body_of[index] = body.map_err(|error| refused(format_args!("spring {index}"), error))?.raw.index;
        }
        let springs = self.bodies.indices().map(|body| (body, &self.bodies[body].springs));
        check_lists("body", springs, &self.springs, |index, _| body_of[index])
    }

    /// Descriptors as creation checks them, and the rest of what a step begins with.
    pub(super) fn check_state(&self) -> Result<()> {
        self.desc.validate().map_err(|error| refused("settings", error))?;
        for index in self.bodies.indices() {
            let body = &self.bodies[index];
            body.desc.validate().map_err(|error| refused(format_args!("body {index}"), error))?;
            if let Some(blending) = &body.blending {
                self.check_blending(index, blending)?;
            }
            if let Some(substance) = &body.substance {
                if body.desc.rigid || !body.links.is_empty() {
                    return Err(Error::Snapshot(format!("body {index}: a substance that is rigid or has links")));
                }
                substance.check().map_err(|error| refused(format_args!("substance of body {index}"), error))?;
            }
        }
        for index in self.links.indices() {
            check_link(&self.links[index]).map_err(|error| refused(format_args!("link {index}"), error))?;
        }
        for index in self.skeletons.indices() {
            let skeleton = &self.skeletons[index];
            let controlled = self.bodies[self.links[skeleton.link as usize].body as usize].desc.volume_gain > 0.0;
            check_skeleton(skeleton, controlled).map_err(|error| refused(format_args!("skeleton {index}"), error))?;
        }
        Ok(())
    }

    /// What a blend graph says is about parts of its body, and in order.
    fn check_blending(&self, body: usize, blending: &Blending) -> Result<()> {
        let refuse = |why: &str| Err(Error::Snapshot(format!("blend graph of body {body}: {why}")));
        let is_link = |link: u32| self.links.is_live(link as usize) && self.links[link as usize].body as usize == body;
        let is_skeleton = |skeleton: u32| {
            self.skeletons.is_live(skeleton as usize) && is_link(self.skeletons[skeleton as usize].link)
        };
        if blending.joints.iter().flatten().any(|link| !is_link(*link)) {
            return refuse("a joint of a link that is not the body's");
        }
        let mut last = None;
        for Pairing { skeletons, weight, target, rate, apart: _ } in &blending.pairs {
            if skeletons[0] >= skeletons[1] || last >= Some(*skeletons) {
                return refuse("pairs not in order");
            }
            last = Some(*skeletons);
            if skeletons.iter().any(|skeleton| !is_skeleton(*skeleton)) {
                return refuse("a pair of skeletons that are not the body's");
            }
            for weight in weight.iter().chain([target]) {
                require("weight", *weight, "from 0 to 1", |x| (0.0..=1.0).contains(&x))
                    .map_err(|error| refused(format_args!("blend graph of body {body}"), error))?;
            }
            if *rate > 0.0 && weight.is_none() {
                return refuse("a weight on its way from nowhere");
            }
            require("rate of a weight", *rate, "finite and at least 0", |x| x >= 0.0)
                .map_err(|error| refused(format_args!("blend graph of body {body}"), error))?;
        }
        Ok(())
    }

    /// What is remembered of pairs is about bodies that have been, and in order.
    pub(super) fn check_memories(&self, memories: &[Memory]) -> Result<()> {
        let (_, _, given) = self.bodies.parts();
        let mut last = None;
        for memory in memories {
            let Memory {
                ids,
                part,
                touching: _,
                touched: _,
                overloaded: _,
                was_overloaded: _,
                rate2,
                held,
                bristles,
                standing,
            } = memory;
            let pair = ids.map(|id| id.index);
            let refuse = |why: &str| Err(Error::Snapshot(format!("pair of bodies {} and {}: {why}", pair[0], pair[1])));
            if ids
                .iter()
                .any(|id| !given.get(id.index as usize).is_some_and(|given| (1..=*given).contains(&id.generation)))
            {
                return refuse("no such bodies have ever been");
            }
            let of_one = pair[0] == pair[1];
            if of_one && part.iter().any(|skeleton| *skeleton as usize >= self.skeletons.capacity()) {
                return refuse("parts of skeletons that have never been");
            }
            if pair[0] > pair[1] || of_one != (*part != [0; 2]) || last >= Some((pair, *part)) {
                return refuse("not in order");
            }
            last = Some((pair, *part));
            if rate2.is_nan() || *rate2 < 0.0 {
                return refuse("the rate is not a number of at least 0");
            }
            if held.is_nan() || *held < 0.0 {
                return refuse("the elastic energy is not a number of at least 0");
            }
            for Bristle { key, slip, turn, sliding: _, seen: _ } in bristles {
                if key[..2].iter().any(|skeleton| *skeleton as usize >= self.skeletons.capacity()) {
                    return refuse("a bristle between skeletons that have never been");
                }
                if !crate::math::is_finite(slip) || !turn.is_finite() {
                    return refuse("the bend of a bristle is not finite");
                }
            }
            for Place { link, center, rotation } in &standing.places {
                if *link as usize >= self.links.capacity() {
                    return refuse("a surface of links that have never been");
                }
                if !crate::math::is_finite(center) || (rotation.coords.norm() - 1.0).abs() > 1e-6 {
                    return refuse("the place of a link that it was evaluated at is none");
                }
            }
        }
        Ok(())
    }

    /// Who sleeps, with whom, and what is kept of their contacts.
    pub(super) fn check_sleep(&self, resting: &[Memory], contacts: &[Contact]) -> Result<()> {
        let refuse = |body: usize, why: &str| Err(Error::Snapshot(format!("body {body}: {why}")));
        for index in self.bodies.indices() {
            let Sleep { quiet, group } = self.bodies[index].sleep;
            require("time at rest", quiet, "finite and at least 0", |x| x >= 0.0)
                .map_err(|error| refused(format_args!("body {index}"), error))?;
            let first = group as usize;
            if group != 0 && !(first <= index + 1 && self.is_in_group(first - 1, group)) {
                return refuse(index, "sleeps in a group whose first body does not");
            }
        }
        self.check_memories(resting)?;
        for contact in contacts {
            // A substance has neither links nor skeletons.
            let live = contact.bodies.iter().all(|id| self.bodies.is_live(id.index()))
                && contact.links.iter().all(|id| *id == LinkId::default() || self.links.is_live(id.index()))
                && contact
                    .skeletons
                    .iter()
                    .all(|id| *id == SkeletonId::default() || self.skeletons.is_live(id.index()));
            if !live || !contact.bodies.iter().any(|id| self.bodies[id.index()].is_asleep()) {
                return refuse(contact.bodies[0].index(), "has a contact at rest, but nobody is asleep");
            }
        }
        Ok(())
    }

    fn is_in_group(&self, body: usize, group: u32) -> bool {
        self.bodies.is_live(body) && self.bodies[body].sleep.group == group
    }
}

pub(super) fn refused(what: impl std::fmt::Display, error: Error) -> Error {
    Error::Snapshot(format!("{what}: {error}"))
}

/// Each object of `owned` is listed once, and by the owner that it names.
fn check_lists<'a, T: Noun>(
    owner_noun: &str,
    lists: impl Iterator<Item = (usize, &'a Vec<u32>)>,
    owned: &Arena<T>,
    owner_of: impl Fn(usize, &T) -> u32,
) -> Result<()> {
    let mut is_listed = vec![false; owned.capacity()];
    for (owner, list) in lists {
        for index in list.iter().map(|index| *index as usize) {
            let ours = owned.is_live(index) && owner_of(index, &owned[index]) as usize == owner;
            if !ours || std::mem::replace(&mut is_listed[index], true) {
                let noun = T::NAME;
                return Err(Error::Snapshot(format!(
                    "{owner_noun} {owner} lists {noun} {index}; must be a {noun} of its own, each once"
                )));
            }
        }
    }
    match owned.indices().find(|index| !is_listed[*index]) {
        Some(index) => Err(Error::Snapshot(format!("{} {index} is listed by no {owner_noun}", T::NAME))),
        None => Ok(()),
    }
}

fn check_link(link: &Link) -> Result<()> {
    let Link {
        desc,
        body: _,
        skeletons: _,
        enabled: _,
        applied_force,
        applied_impulse,
        contact_impulse,
        host_impulse,
        substance_impulse,
        last_dt,
        mirror,
        articulated: _,
    } = link;
    desc.validate()?;
    for (what, wrench) in [
        ("applied force", applied_force),
        ("applied impulse", applied_impulse),
        ("contact impulse", contact_impulse),
        ("impulse for the host", host_impulse),
        ("impulse of substances", substance_impulse),
    ] {
        require_finite(what, &wrench.force)?;
        require_finite(what, &wrench.torque)?;
    }
    require("length of the last step", *last_dt, "from 0 to 10 s", |x| (0.0..=10.0).contains(&x))?;
    let Mirror {
        active: _,
        twist,
        expected_center,
        expected_rotation,
        expected_twist,
        commanded,
        owed,
        estimate,
        bypassed,
        doubt: _,
    } = mirror;
    for twist in [twist, expected_twist, owed, estimate].into_iter().chain(bypassed) {
        desc::validate_twist(twist)?;
    }
    require("commanded change of velocity", *commanded, "finite and at least 0", |x| x >= 0.0)?;
    desc::validate_pose(&Pose { position: *expected_center, rotation: *expected_rotation })
}

/// Only volume control has offsets and targets.
fn check_skeleton(skeleton: &Skeleton, controlled: bool) -> Result<()> {
    let Skeleton { desc, link: _, enabled: _, offset, target, profile: _, reach: _, rays: _ } = skeleton;
    let (low, high) = OFFSETS;
    require("offset", *offset, "from -0.5 to 1 thickness, and 0 without volume control", |x| {
        x == 0.0 || controlled && (low * desc.thickness..=high * desc.thickness).contains(&x)
    })?;
    target.map_or(Ok(()), |target| {
        require("target volume", target, "at least 0, and none without volume control", |x| controlled && x >= 0.0)
    })
}
