//! Pairs of particles that attract or repel: who they are, their forces, their friction.

use std::ops::Range;

use super::forces::{CUT, Law, braked, parting};
use super::swarm::{Matter, Swarm};
use crate::field::lanes::{Dispatch, Kernel, Lanes};
use crate::math::Vec3;

/// How much farther than the force reaches pairs are listed, over the spacing: they are listed again after half as much.
/// The next shell of a packing, at √3, is beyond.
const MARGIN: f64 = 0.1;
/// Brings the fading of friction with distance to 1 at rest.
const FADE: f64 = 1.0 / ((1.0 - 1.0 / CUT) * (1.0 - 1.0 / CUT));

/// Pairs are worked on eight at a time: the same bits whatever registers there are.
const WIDTH: usize = 8;
const ZERO: Lanes<WIDTH> = Lanes([0.0; WIDTH]);

/// Two particles that may attract or repel each other, and how far they blend.
#[derive(Clone, Copy, Debug)]
struct Pair {
    ends: [u32; 2],
    weight: f64,
}

/// Eight pairs of one kind of matter, as columns. What is left over in the last block is a particle with itself, of weight 0.
#[derive(Clone, Copy, Debug)]
struct Block {
    kind: u16,
    ends: [[u32; 2]; WIDTH],
    weight: Lanes<WIDTH>,
    /// From the first to the second when forces were last found.
    direction: [Lanes<WIDTH>; 3],
    /// Friction there over that of a pair at rest: it fades with the force, so that nobody is braked at the cut.
    fade: Lanes<WIDTH>,
}

/// What pairs of one substance have in common.
#[derive(Clone, Copy, Debug)]
struct Coupling {
    law: Law,
    /// Where the force ends \[m\], and one over that.
    cut: f64,
    inverse_cut: f64,
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
    blocks: Vec<Block>,
    /// Places when they were listed.
    listed_at: Vec<Vec3>,
    /// In the order of the particles, with how many of the first one's came before; and in the order of the latter.
    found: Vec<(u32, Pair)>,
    ranked: Vec<Pair>,
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
            inverse_cut: 1.0 / (CUT * matter.spacing),
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
        self.listed_at.clone_from(&swarm.place);
        self.blocks.clear();
        let mut first = 0;
        for kind in 0..swarm.matters.len() {
            // One kind after the other.
            let last = first + swarm.kind[first..].partition_point(|other| usize::from(*other) == kind);
            self.list_kind(swarm, first..last);
            first = last;
        }
    }

    /// Lists the pairs of these particles, all of one kind.
    fn list_kind(&mut self, swarm: &Swarm, particles: Range<usize>) {
        let Self { blocks, found, ranked, .. } = self;
        found.clear();
        let mut begins = vec![0; 1];
        let Some(kind) = swarm.kind.get(particles.start) else { return };
        for i in particles {
            let reach = (CUT + MARGIN) * swarm.matter_of(i).spacing;
            let mut rank = 0;
            for j in swarm.near.of(i) {
                let at = *j as usize;
                if at <= i
                    || (swarm.place[at] - swarm.place[i]).norm_squared() >= reach * reach
                    || swarm.kind[at] != *kind
                {
                    continue;
                }
                let weight = if swarm.label[at] == swarm.label[i] { 1.0 } else { swarm.bond(i, at) };
                if weight > 0.0 {
                    let pair = Pair { ends: [i as u32, *j], weight };
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
        ranked.clear();
        ranked.extend(found.iter().map(|(_, pair)| *pair));
        for (rank, pair) in found {
            let place = &mut begins[*rank as usize];
            ranked[*place] = *pair;
            *place += 1;
        }
        blocks.extend(ranked.chunks(WIDTH).map(|pairs| Block::new(*kind, pairs)));
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
        for block in &mut self.blocks {
            let coupling = &self.couplings[usize::from(block.kind)];
            let (push, rates) = block.push(swarm, coupling);
            rate2 = rates.0.into_iter().fold(rate2, f64::max);
            let [x, y, z] = &block.direction;
            for (lane, ends) in block.ends.iter().enumerate() {
                if block.fade.0[lane] > 0.0 {
                    let [a, b] = ends.map(|end| end as usize);
                    let push = Vec3::new(x.0[lane], y.0[lane], z.0[lane]) * push.0[lane];
                    force[a] -= push;
                    force[b] += push;
                    let approach = (swarm.velocity[a] - swarm.velocity[b]).norm_squared();
                    speed2 = speed2.max(approach * coupling.inverse_thickness * coupling.inverse_thickness);
                }
            }
        }
        (self.rate2, self.speed) = (rate2, speed2.sqrt());
    }

    /// Friction for `h` seconds, central, exact, a pair after the other, where they were when forces were last found.
    pub fn rub(&self, velocity: &mut [Vec3], h: f64) {
        for Block { kind, ends, direction: [x, y, z], fade, .. } in &self.blocks {
            let Coupling { inverse_mass, damping, viscosity, .. } = &self.couplings[usize::from(*kind)];
            for (lane, ends) in ends.iter().enumerate() {
                let fade = fade.0[lane];
                if fade <= 0.0 {
                    continue;
                }
                let [a, b] = ends.map(|end| end as usize);
                let direction = Vec3::new(x.0[lane], y.0[lane], z.0[lane]);
                let speed = (velocity[b] - velocity[a]).dot(&direction);
                let left = braked(speed, fade * damping, fade * viscosity, 2.0 * inverse_mass, h);
                let change = direction * (0.5 * (left - speed));
                velocity[a] -= change;
                velocity[b] += change;
            }
        }
    }
}

impl Block {
    /// Up to eight pairs.
    fn new(kind: u16, pairs: &[Pair]) -> Self {
        let nobody = [pairs[0].ends[0]; 2];
        let mut block = Self { kind, ends: [nobody; WIDTH], weight: ZERO, direction: [ZERO; 3], fade: ZERO };
        for (lane, Pair { ends, weight }) in pairs.iter().enumerate() {
            block.ends[lane] = *ends;
            block.weight.0[lane] = *weight;
        }
        block
    }

    /// Repulsion of each pair, and its stiffness over the mass; learns directions and friction.
    fn push(&mut self, swarm: &Swarm, coupling: &Coupling) -> (Lanes<WIDTH>, Lanes<WIDTH>) {
        let mut way = [ZERO; 3];
        for (lane, ends) in self.ends.iter().enumerate() {
            let [a, b] = ends.map(|end| &swarm.place[end as usize]);
            for axis in 0..3 {
                way[axis].0[lane] = b[axis] - a[axis];
            }
        }
        let found = Dispatch::best().run(Push { block: self, way: &way, coupling });
        for lane in 0..WIDTH {
            if way.iter().all(|column| column.0[lane] == 0.0) {
                let parting = parting(self.ends[lane]);
                self.direction.iter_mut().zip(parting.iter()).for_each(|(column, x)| column.0[lane] = *x);
            }
        }
        found
    }
}

/// The arguments of the loop in [`Block::push`].
struct Push<'a> {
    block: &'a mut Block,
    way: &'a [Lanes<WIDTH>; 3],
    coupling: &'a Coupling,
}

impl Kernel for Push<'_> {
    type Output = (Lanes<WIDTH>, Lanes<WIDTH>);

    /// One loop without branches becomes vector instructions.
    #[inline(always)]
    fn run<const W: usize>(self) -> Self::Output {
        let Self { block, way, coupling } = self;
        let Coupling { law, cut, inverse_cut, inverse_mass, .. } = *coupling;
        // Copies: the compiler knows that nothing else changes them.
        let (weights, [xs, ys, zs]) = (block.weight.0, way.map(|column| column.0));
        let (mut push, mut rate, mut fade) = ([0.0; WIDTH], [0.0; WIDTH], [0.0; WIDTH]);
        let mut direction = [[0.0; WIDTH]; 3];
        for lane in 0..WIDTH {
            let (x, y, z) = (xs[lane], ys[lane], zs[lane]);
            let square = x * x + y * y + z * z;
            let distance = square.sqrt();
            let inverse = 1.0 / distance;
            // Beyond the cut there is nothing.
            let weight = if square < cut * cut { weights[lane] } else { 0.0 };
            let (size, stiffness) = law.push(distance, inverse);
            let left = 1.0 - distance * inverse_cut;
            fade[lane] = weight * FADE * (left * left);
            push[lane] = weight * size;
            rate[lane] = weight * stiffness * inverse_mass;
            direction[0][lane] = x * inverse;
            direction[1][lane] = y * inverse;
            direction[2][lane] = z * inverse;
        }
        (block.fade, block.direction) = (Lanes(fade), direction.map(Lanes));
        (Lanes(push), Lanes(rate))
    }
}
