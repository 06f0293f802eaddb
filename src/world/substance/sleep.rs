//! Sleep of substances: at rest they are left out of the steps, until something near them moves or is new.
//!
//! A substance sleeps on what does not move; what moves freely near it keeps it awake. Those that are near each other fall
//! asleep together, as a group of [`sleep`]. With what they lie on they are kept among the pairs that
//! are asleep, so that whoever changes or takes away the one wakes the other.

use crate::contact::broad_phase::Bounds;
use crate::contact::candidate::Memory;
use crate::math::Vec3;
use crate::substance::Substance;
use crate::substance::pieces::Sets;
use crate::world::step::Stepping;
use crate::world::{World, sleep};

/// Lowest and highest corner.
type Region = (Vec3, Vec3);

fn region(bounds: &Bounds) -> Region {
    (bounds.low, bounds.high)
}

fn meet(a: &Region, b: &Region) -> bool {
    (0..3).all(|axis| a.0[axis] <= b.1[axis] && b.0[axis] <= a.1[axis])
}

impl World {
    /// Who sleeps near a substance that is awake does not.
    pub(in crate::world) fn wake_near_substances(&mut self, state: &Stepping, dt: f64) {
        if self.desc.sleep_time <= 0.0 {
            return;
        }
        let awake = self.awake_regions(dt);
        for bounds in &state.bounds {
            let is_near = || awake.iter().any(|other| meet(&region(bounds), other));
            if sleep::is_asleep(&self.bodies, bounds.body) && is_near() {
                sleep::rouse(&mut self.bodies, &state.resting, bounds.body);
            }
        }
    }

    /// Wakes substances near which somebody moves, is new, or has been changed.
    pub(in crate::world) fn wake_substances(&mut self, state: &Stepping, dt: f64) {
        let is_sleeper = |slot: &usize| self.bodies[*slot].substance.is_some() && self.bodies[*slot].is_asleep();
        if !self.bodies.indices().any(|slot| is_sleeper(&slot)) {
            return;
        }
        let awake = self.awake_regions(dt);
        let touched = |slot: &usize| {
            let body = &self.bodies[*slot];
            let Some(substance) = body.substance.as_deref() else { return false };
            let region = self.region_of(body, substance, dt);
            awake.iter().any(|other| meet(&region, other)) || !self.is_calm(&region, state)
        };
        let touched: Vec<usize> = self.bodies.indices().filter(is_sleeper).filter(touched).collect();
        for slot in touched {
            sleep::rouse(&mut self.bodies, &state.resting, slot as u32);
        }
    }

    /// Where the fields of substances that are awake may reach in a step.
    fn awake_regions(&self, dt: f64) -> Vec<Region> {
        self.substances().map(|(_, body, substance)| self.region_of(body, substance, dt)).collect()
    }

    /// Lets substances fall asleep that have been at rest for long enough. Whether any did.
    pub(in crate::world) fn let_substances_sleep(&mut self, state: &mut Stepping, dt: f64) -> bool {
        let is_tired = |slot: u32| self.bodies[slot as usize].sleep.quiet >= self.desc.sleep_time;
        if !self.substances().any(|(slot, ..)| is_tired(slot)) {
            return false;
        }
        let regions: Vec<(u32, Region)> =
            self.substances().map(|(slot, body, substance)| (slot, self.region_of(body, substance, dt))).collect();
        let mut groups = Sets::default();
        groups.reset(regions.len());
        for (at, (_, region)) in regions.iter().enumerate() {
            let near = (0..at).filter(|other| meet(region, &regions[*other].1));
            near.for_each(|other| groups.join(at as u32, other as u32));
        }
        let (mut rests, mut fell) = (vec![true; regions.len()], false);
        for (at, (slot, region)) in regions.iter().enumerate() {
            rests[groups.find(at as u32) as usize] &= is_tired(*slot) && self.is_calm(region, state);
        }
        for (at, (slot, own)) in regions.iter().enumerate() {
            let first = groups.find(at as u32) as usize;
            if !rests[first] {
                continue;
            }
            fell = true;
            let body = &mut self.bodies[*slot as usize];
            body.sleep.group = regions[first].0 + 1;
            let particles = body.substance.iter_mut().flat_map(|substance| &mut substance.particles);
            particles.for_each(|particle| particle.velocity = Vec3::zeros());
            for bounds in state.bounds.iter().filter(|bounds| meet(own, &region(bounds))) {
                let pair = [(*slot).min(bounds.body), (*slot).max(bounds.body)];
                let ids = pair.map(|body| self.bodies.id_of(body as usize).raw);
                state.resting.push(Memory { ids, ..Memory::default() });
            }
        }
        fell
    }

    /// Whether nobody in a region moves, is new, or has been changed.
    fn is_calm(&self, own: &Region, state: &Stepping) -> bool {
        let mut near = state.bounds.iter().filter(|bounds| meet(own, &region(bounds)));
        near.all(|bounds| self.is_still(bounds.body, state))
    }
}

impl Substance {
    /// Whether nothing of it is faster than `most` \[m/s\], and nothing of it parts or fuses.
    pub(in crate::world) fn is_slow(&self, most: f64) -> bool {
        self.changes.is_empty()
            && self.bonds.iter().all(|bond| bond.holds && bond.progress >= 1.0)
            && self.particles.iter().all(|particle| particle.velocity.norm_squared() <= most * most)
    }
}
