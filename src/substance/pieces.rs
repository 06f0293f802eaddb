//! Pieces: which particles hang together, and who blends with whom.
//!
//! Particles of one label blend. When the seeds show that those of a label no longer hang together in one solid, the
//! smaller parts get labels of their own, and what still blends across is a bond that fades: no surface moves at once
//! \[97, section V-B.2\] (docs/model.md, "Separation and fusion"). Where two parts are pressed together harder than the
//! substance's threshold, bonds grow between those who have a field there. When all who could blend do, the two labels
//! become one. Memory is that of the particles, and of bonds along the seams.

use std::collections::{BTreeMap, BTreeSet};

use super::{Bond, Change, ParticleId, Substance};

/// Farthest that a bond goes in a step: the surface then moves by less than a hundredth of the thickness.
const FASTEST: f64 = 0.015;

/// Sets that grow together.
#[derive(Clone, Debug, Default)]
pub struct Sets {
    parents: Vec<u32>,
}

impl Sets {
    /// Each of `count` on its own.
    pub fn reset(&mut self, count: usize) {
        self.parents.clear();
        self.parents.extend(0..count as u32);
    }

    /// The lowest of the set of `index`.
    pub fn find(&mut self, mut index: u32) -> u32 {
        while self.parents[index as usize] != index {
            let above = self.parents[self.parents[index as usize] as usize];
            self.parents[index as usize] = above;
            index = above;
        }
        index
    }

    /// Makes two sets one.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.find(a), self.find(b));
        self.parents[a.max(b) as usize] = a.min(b);
    }
}

/// What a step found out about a substance; particles by their places.
#[derive(Debug, Default)]
pub struct Findings {
    /// Pairs that hang together.
    pub joined: Vec<[u32; 2]>,
    /// Pairs whose fields meet under more than the threshold.
    pub pressed: Vec<[u32; 2]>,
}

impl Substance {
    fn bond_at(&self, pair: [u32; 2]) -> Result<usize, usize> {
        self.bonds.binary_search_by_key(&pair, |bond| bond.pair)
    }

    /// Adds bonds that are not there yet; each counts once.
    fn add_bonds(&mut self, fresh: Vec<Bond>) {
        if fresh.is_empty() {
            return;
        }
        self.bonds.extend(fresh);
        self.bonds.sort_unstable_by_key(|bond| bond.pair);
        self.bonds.dedup_by_key(|bond| bond.pair);
    }

    fn label_of(&self, place: u32) -> u32 {
        self.particles[place as usize].label
    }

    fn name_of(&self, place: u32) -> ParticleId {
        self.particles[place as usize].id
    }

    /// Moves bonds and labels on by a step of `dt`. `reaching` lists for a particle all whose fields reach where its own
    /// does.
    pub fn settle(&mut self, findings: &Findings, dt: f64, reaching: impl Fn(u32) -> Vec<u32>) {
        self.changes.clear();
        self.move_bonds(dt);
        self.fuse(&findings.pressed);
        self.fill_seams(&reaching);
        self.split(&findings.joined, &reaching);
        self.let_go(&findings.joined);
        self.merge(&reaching);
    }

    fn move_bonds(&mut self, dt: f64) {
        let way = (dt / self.desc.blend_time).min(FASTEST);
        for bond in &mut self.bonds {
            bond.progress = (bond.progress + if bond.holds { way } else { -way }).clamp(0.0, 1.0);
        }
        self.bonds.retain(|bond| bond.holds || bond.progress > 0.0);
    }

    fn fuse(&mut self, pressed: &[[u32; 2]]) {
        let mut fresh = Vec::new();
        for pair in pressed {
            if self.label_of(pair[0]) == self.label_of(pair[1]) {
                continue;
            }
            match self.bond_at(*pair) {
                Ok(at) if self.bonds[at].holds => continue,
                Ok(at) => self.bonds[at].holds = true,
                Err(_) => fresh.push(Bond { pair: *pair, progress: 0.0, holds: true }),
            }
            self.changes.push(Change::Fused(pair.map(|end| self.name_of(end))));
        }
        self.add_bonds(fresh);
    }

    /// Two between which nothing is pressed, but which both blend fully with others of the other label, are within what has
    /// become one: they blend too.
    fn fill_seams(&mut self, reaching: &impl Fn(u32) -> Vec<u32>) {
        let blended: BTreeSet<(u32, u32)> = self
            .bonds
            .iter()
            .filter(|bond| bond.holds && bond.progress >= 1.0)
            .flat_map(|bond| [(bond.pair[0], bond.pair[1]), (bond.pair[1], bond.pair[0])])
            .map(|(own, other)| (own, self.label_of(other)))
            .collect();
        let mut ends: Vec<u32> = blended.iter().map(|(own, _)| *own).collect();
        ends.dedup();
        let mut fresh = Vec::new();
        for own in &ends {
            for other in reaching(*own).into_iter().filter(|other| other > own) {
                let to = self.label_of(other);
                let within = to != self.label_of(*own)
                    && blended.contains(&(*own, to))
                    && blended.contains(&(other, self.label_of(*own)));
                if within && self.bond_at([*own, other]).is_err() {
                    fresh.push(Bond { pair: [*own, other], progress: 0.0, holds: true });
                }
            }
        }
        self.add_bonds(fresh);
    }

    /// Parts of a label that hang together no more: all but the largest get labels of their own.
    fn split(&mut self, joined: &[[u32; 2]], reaching: &impl Fn(u32) -> Vec<u32>) {
        let count = self.particles.len();
        let mut alike = Sets::default();
        alike.reset(count);
        let mut across = Vec::new();
        for [a, b] in joined {
            if self.label_of(*a) == self.label_of(*b) {
                alike.join(*a, *b);
            } else {
                across.push([*a, *b]);
            }
        }
        let mut pieces = alike.clone();
        across.into_iter().for_each(|[a, b]| pieces.join(a, b));
        let mut sizes = vec![0_u32; count];
        for place in 0..count as u32 {
            self.particles[place as usize].piece = pieces.find(place);
            sizes[alike.find(place) as usize] += 1;
        }
        // For each label, the part that keeps it.
        let mut keeps: BTreeMap<u32, u32> = BTreeMap::new();
        let mut parts = 0;
        for place in (0..count as u32).filter(|place| sizes[*place as usize] > 0) {
            parts += 1;
            let keeper = keeps.entry(self.label_of(place)).or_insert(place);
            if sizes[place as usize] > sizes[*keeper as usize] {
                *keeper = place;
            }
        }
        if parts == keeps.len() {
            return;
        }
        let old: Vec<u32> = self.particles.iter().map(|particle| particle.label).collect();
        let mut fresh: BTreeMap<u32, (u32, Vec<ParticleId>)> = BTreeMap::new();
        for place in 0..count as u32 {
            let part = alike.find(place);
            if keeps[&old[place as usize]] == part {
                continue;
            }
            let next = &mut self.next_label;
            let (label, members) = fresh.entry(part).or_insert_with(|| {
                *next += 1;
                (*next - 1, Vec::new())
            });
            self.particles[place as usize].label = *label;
            members.push(self.particles[place as usize].id);
        }
        self.share_out_volume(&old);
        // What blended goes on blending for a while.
        let mut bonds = Vec::new();
        for place in 0..count as u32 {
            if self.label_of(place) == old[place as usize] {
                continue;
            }
            for other in reaching(place) {
                let pair = [place.min(other), place.max(other)];
                if old[other as usize] == old[place as usize]
                    && self.label_of(other) != self.label_of(place)
                    && self.bond_at(pair).is_err()
                {
                    bonds.push(Bond { pair, progress: 1.0, holds: false });
                }
            }
        }
        self.add_bonds(bonds);
        self.changes.extend(fresh.into_values().map(|(_, members)| Change::Split(members)));
    }

    /// Each part of what has come apart aims at the volume that it came off with, all of them at that of the whole.
    fn share_out_volume(&mut self, old: &[u32]) {
        let mut sums: BTreeMap<u32, (f64, f64)> = BTreeMap::new();
        let split = self.particles.iter().zip(old).filter(|(particle, old)| particle.label != **old);
        sums.extend(split.map(|(_, old)| (*old, (0.0, 0.0))));
        for (particle, old) in self.particles.iter().zip(old) {
            if let Some((target, volume)) = sums.get_mut(old) {
                *target += particle.target.unwrap_or(particle.volume);
                *volume += particle.volume;
            }
        }
        for (particle, old) in self.particles.iter_mut().zip(old) {
            if let Some((target, volume)) = sums.get(old).filter(|(_, volume)| *volume > 0.0) {
                particle.target = Some(particle.volume * target / volume);
            }
        }
    }

    /// Bonds of two labels that hang together nowhere fade.
    fn let_go(&mut self, joined: &[[u32; 2]]) {
        if self.bonds.is_empty() {
            return;
        }
        let labels = |pair: &[u32; 2]| {
            let [a, b] = pair.map(|end| self.label_of(end));
            [a.min(b), a.max(b)]
        };
        let held: BTreeSet<[u32; 2]> = joined.iter().map(labels).collect();
        // Those that have just begun have had no time to join.
        let lost = |bond: &Bond| bond.holds && bond.progress >= 1.0 && !held.contains(&labels(&bond.pair));
        let lost: Vec<usize> = (0..self.bonds.len()).filter(|at| lost(&self.bonds[*at])).collect();
        lost.into_iter().for_each(|at| self.bonds[at].holds = false);
    }

    /// Labels between which every pair that could blend does so fully become one.
    fn merge(&mut self, reaching: &impl Fn(u32) -> Vec<u32>) {
        let full = |bond: &Bond| bond.holds && bond.progress >= 1.0;
        let mut ready: BTreeMap<[u32; 2], bool> = BTreeMap::new();
        for bond in &self.bonds {
            let [a, b] = bond.pair.map(|end| self.label_of(end));
            *ready.entry([a.min(b), a.max(b)]).or_insert(true) &= full(bond);
        }
        if !ready.values().any(|ready| *ready) {
            return;
        }
        for place in 0..self.particles.len() as u32 {
            let own = self.label_of(place);
            for other in reaching(place).into_iter().filter(|other| *other > place) {
                let label = self.label_of(other);
                if let Some(ready) = ready.get_mut(&[own.min(label), own.max(label)]) {
                    *ready &= self.bond_at([place, other]).is_ok_and(|at| full(&self.bonds[at]));
                }
            }
        }
        // One pair at a time: what blends with a third is found again in the next step.
        let Some((labels, _)) = ready.iter().find(|(_, ready)| **ready) else { return };
        for particle in self.particles.iter_mut().filter(|particle| particle.label == labels[1]) {
            particle.label = labels[0];
        }
        let particles = &self.particles;
        self.bonds.retain(|bond| {
            let [a, b] = bond.pair.map(|end| particles[end as usize].label);
            a != b
        });
    }
}
