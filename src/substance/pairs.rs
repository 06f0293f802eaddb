//! Pairs of particles that attract or repel: who they are, their forces, their friction.

use super::forces::{CUT, Law, braked, direction};
use super::swarm::{Matter, Swarm};
use crate::math::Vec3;

/// How much farther than the force reaches pairs are listed, over the spacing: they are listed again after half as much.
/// The next shell of a packing, at √3, is beyond.
const MARGIN: f64 = 0.1;
/// Brings the fading of friction with distance to 1 at rest.
const FADE: f64 = 1.0 / ((1.0 - 1.0 / CUT) * (1.0 - 1.0 / CUT));

/// Two particles that may attract or repel each other.
#[derive(Clone, Copy, Debug)]
struct Pair {
    ends: [u32; 2],
    /// How far they blend.
    weight: f64,
    /// From the first to the second, and how far they are apart, when forces were last found; infinite beyond the cut.
    direction: Vec3,
    distance: f64,
}

/// What pairs of one substance have in common.
#[derive(Clone, Copy, Debug)]
struct Coupling {
    law: Law,
    /// Where the force ends \[m\].
    cut: f64,
    inverse_mass: f64,
    inverse_thickness: f64,
    /// Friction at rest \[N s/m\], and the part that grows with speed \[kg/m\].
    damping: f64,
    viscosity: f64,
}

/// All pairs of a world.
#[derive(Debug, Default)]
pub struct Pairs {
    /// By kind of matter.
    couplings: Vec<Coupling>,
    pairs: Vec<Pair>,
    /// Places when they were listed.
    listed_at: Vec<Vec3>,
    /// In the order of the particles, with how many of the first one's came before.
    found: Vec<(u32, Pair)>,
    /// Stiffness of the stiffest over its mass \[1/s²\].
    pub rate2: f64,
    /// Highest speed of approach over the thickness \[1/s\].
    pub speed: f64,
}

impl Pairs {
    /// Learns the substances; stiffness over mass is bounded by `most` \[1/s²\]. Whether that was less than one has.
    pub fn couple(&mut self, matters: &[Matter], most: f64) -> bool {
        self.couplings.clear();
        self.couplings.extend(matters.iter().map(|matter| Coupling {
            law: Law::new(matter.spacing, matter.cohesion, matter.mass * most),
            cut: CUT * matter.spacing,
            inverse_mass: 1.0 / matter.mass,
            inverse_thickness: 1.0 / matter.profile.thickness,
            damping: matter.damping * 2.0 * (2.0 * matter.cohesion * matter.mass).sqrt() / matter.spacing,
            viscosity: matter.viscosity,
        }));
        self.couplings.iter().zip(matters).any(|(coupling, matter)| coupling.law.cohesion() < matter.cohesion)
    }

    /// Lists those that can come within reach of the force: first the first of every particle, then all second ones, and so
    /// on. Who follow each other in the list then do not wait for each other's results.
    pub fn list(&mut self, swarm: &Swarm) {
        let Self { pairs, found, listed_at, .. } = self;
        listed_at.clone_from(&swarm.place);
        found.clear();
        let mut begins = vec![0; 1];
        for i in 0..swarm.place.len() {
            let reach = (CUT + MARGIN) * swarm.matter_of(i).spacing;
            let mut rank = 0;
            for j in swarm.near.of(i) {
                let at = *j as usize;
                if at <= i
                    || (swarm.place[at] - swarm.place[i]).norm_squared() >= reach * reach
                    || swarm.kind[at] != swarm.kind[i]
                {
                    continue;
                }
                let weight = if swarm.label[at] == swarm.label[i] { 1.0 } else { swarm.bond(i, at) };
                if weight > 0.0 {
                    let pair = Pair { ends: [i as u32, *j], weight, direction: Vec3::zeros(), distance: f64::INFINITY };
                    found.push((rank, pair));
                    rank += 1;
                    begins.resize(begins.len().max(rank as usize + 1), 0);
                    begins[rank as usize] += 1;
                }
            }
        }
        for rank in 1..begins.len() {
            begins[rank] += begins[rank - 1];
        }
        pairs.clear();
        pairs.extend(found.iter().map(|(_, pair)| *pair));
        for (rank, pair) in found {
            let place = &mut begins[*rank as usize];
            pairs[*place] = *pair;
            *place += 1;
        }
    }

    /// Lists them again when somebody has moved too far, but for what all have.
    pub fn refresh(&mut self, swarm: &Swarm) {
        let spacing = swarm.matters.iter().map(|matter| matter.spacing).fold(f64::INFINITY, f64::min);
        if swarm.has_strayed(&self.listed_at, 0.5 * MARGIN * spacing) {
            self.list(swarm);
        }
    }

    /// Adds their forces.
    pub fn push(&mut self, swarm: &Swarm, force: &mut [Vec3]) {
        let (mut rate2, mut speed2) = (0.0_f64, 0.0_f64);
        for pair in &mut self.pairs {
            let [a, b] = pair.ends.map(|end| end as usize);
            let Coupling { law, cut, inverse_mass, inverse_thickness, .. } = &self.couplings[swarm.kind[a] as usize];
            if (swarm.place[b] - swarm.place[a]).norm_squared() >= cut * cut {
                pair.distance = f64::INFINITY;
                continue;
            }
            (pair.direction, pair.distance) = direction(&swarm.place[a], &swarm.place[b], pair.ends);
            let (size, stiffness) = law.push(pair.distance);
            let push = pair.direction * (pair.weight * size);
            force[a] -= push;
            force[b] += push;
            rate2 = rate2.max(pair.weight * stiffness * inverse_mass);
            let approach = (swarm.velocity[a] - swarm.velocity[b]).norm_squared();
            speed2 = speed2.max(approach * inverse_thickness * inverse_thickness);
        }
        (self.rate2, self.speed) = (rate2, speed2.sqrt());
    }

    /// Friction for `h` seconds, central, exact, a pair after the other, where they were when forces were last found.
    pub fn rub(&self, velocity: &mut [Vec3], kind: &[u16], h: f64) {
        for Pair { ends, weight, direction, distance } in &self.pairs {
            let [a, b] = ends.map(|end| end as usize);
            let Coupling { cut, inverse_mass, damping, viscosity, .. } = self.couplings[kind[a] as usize];
            if *distance >= cut || viscosity == 0.0 && damping == 0.0 {
                continue;
            }
            let speed = (velocity[b] - velocity[a]).dot(direction);
            // It fades with the force, so that nobody is braked at the cut.
            let fade = weight * FADE * (1.0 - distance / cut).powi(2);
            let left = braked(speed, fade * damping, fade * viscosity, 2.0 * inverse_mass, h);
            let change = direction * (0.5 * (left - speed));
            velocity[a] -= change;
            velocity[b] += change;
        }
    }
}
