//! Soft substances: clay, dough, mud. A body whose base is a system of particles \[95; 97, section V-B\].
//!
//! Particles attract and repel each other and carry a coat of one point skeleton each. What touches, presses on the coat,
//! and the pressure goes to the particles by their share of the field. A substance may fall to pieces: each piece has a
//! coat of its own, pieces collide, and where they are pressed together hard enough they fuse.
//!
//! | file | what |
//! | --- | --- |
//! | [`neighbours`] | who is near whom, in O(n) |
//! | [`forces`] | attraction, repulsion, friction between particles |
//! | [`pairs`] | pairs that attract or repel: forces and friction of all of them |
//! | [`locale`] | the field round one particle: its own piece, others, bonds between them |
//! | [`volume`] | what each particle has of the coat; which particles hang together; volume control |
//! | [`pieces`] | splitting, fusing, bonds that come and go |
//! | [`contact`] | pressure on the coat of a particle: from other bodies, from other pieces |
//! | [`load`] | who presses on a particle: integrated now and then, a spring in between |
//! | [`swarm`] | all particles of a world side by side |
//! | [`system`] | one step of all substances of a world, in sub-steps |

pub mod contact;
pub mod fill;
pub mod forces;
pub mod load;
pub mod locale;
pub mod neighbours;
pub mod pairs;
pub mod pieces;
pub mod swarm;
pub mod system;
pub mod volume;

use crate::error::{Result, require, require_finite};
use crate::field::Profile;
use crate::math::Vec3;

/// Thickness of a particle's coat over the spacing, when the descriptor leaves it open: flat faces of packed particles are
/// then smooth to 3 % of the spacing.
const THICKNESS: f64 = 0.5;
/// Radius of influence over the spacing, likewise.
const RADIUS: f64 = 1.25;

/// What a substance is like.
#[derive(Clone, Debug, PartialEq)]
pub struct SubstanceDesc {
    /// Distance of two particles at rest, `r_0`, from 1e-9 to 1e6 \[m\].
    pub spacing: f64,
    /// Mass of one particle, > 0 and at most 1e30 \[kg\].
    pub particle_mass: f64,
    /// Strength of attraction and repulsion, `γ`, from 0 to 1e30 \[J\]: at rest, a pair has stiffness `4 γ / r_0²`.
    pub cohesion: f64,
    /// Friction between particles that grows with the square of their speed, from 0 to 1e30 \[kg/m\]: \[97, eq. (27)\].
    pub viscosity: f64,
    /// Damping of a pair at rest over the critical one, from 0 to 100.
    pub damping: f64,
    /// Pressure between two pieces above which they fuse, at least 0 \[Pa\]: 0 is at once, infinity never.
    pub fusion_threshold: f64,
    /// How long it takes for two particles to blend, or to stop it, > 0 \[s\].
    pub blend_time: f64,
    /// Part of a volume error that is taken back in a step, from 0 to 0.5; 0 switches volume control off.
    pub volume_gain: f64,
    /// Distance of the surface from an isolated particle \[m\]; 0 stands for half the spacing.
    pub thickness: f64,
    /// Distance at which the field of a particle ends \[m\]; 0 stands for 1.25 times the spacing.
    pub radius: f64,
    /// Seeds of a particle, from 4 to 4096.
    pub seed_count: u32,
}

impl Default for SubstanceDesc {
    fn default() -> Self {
        Self {
            spacing: 0.1,
            particle_mass: 1.0,
            cohesion: 1.0,
            viscosity: 0.0,
            damping: 0.2,
            fusion_threshold: f64::INFINITY,
            blend_time: 0.5,
            volume_gain: 0.5,
            thickness: 0.0,
            radius: 0.0,
            seed_count: 64,
        }
    }
}

impl SubstanceDesc {
    /// Checks the ranges.
    pub(crate) fn validate(&self) -> Result<()> {
        require("spacing", self.spacing, "from 1e-9 to 1e6", |x| (1e-9..=1e6).contains(&x))?;
        require("particle_mass", self.particle_mass, "> 0 and at most 1e30", |x| x > 0.0 && x <= 1e30)?;
        require("cohesion", self.cohesion, "from 0 to 1e30", |x| (0.0..=1e30).contains(&x))?;
        require("viscosity", self.viscosity, "from 0 to 1e30", |x| (0.0..=1e30).contains(&x))?;
        require("damping", self.damping, "from 0 to 100", |x| (0.0..=100.0).contains(&x))?;
        if self.fusion_threshold.is_nan() || self.fusion_threshold < 0.0 {
            let range = "at least 0 (infinity is fine)";
            return Err(crate::error::out_of_range("fusion_threshold", self.fusion_threshold, range));
        }
        require("blend_time", self.blend_time, "> 0 and at most 1e9", |x| x > 0.0 && x <= 1e9)?;
        require("volume_gain", self.volume_gain, "from 0 to 0.5", |x| (0.0..=0.5).contains(&x))?;
        require("seed_count", self.seed_count.into(), "from 4 to 4096", |x| (4.0..=4096.0).contains(&x))?;
        let spacing = self.spacing;
        // Beyond, particles at rest would not hang together, or each would see hundreds of others.
        require("thickness", self.thickness, "0, or from 0.4 to 2 times the spacing", |x| {
            x == 0.0 || (0.4..=2.0).contains(&(x / spacing))
        })?;
        require("radius", self.radius, "0, or at most 3 times the spacing", |x| (0.0..=3.0 * spacing).contains(&x))?;
        self.profile(1.0).map(|_| ())
    }

    /// The field of a particle without an offset.
    pub(crate) fn profile(&self, isovalue: f64) -> Result<Profile> {
        let or = |given: f64, usual: f64| if given == 0.0 { usual * self.spacing } else { given };
        Profile::new(isovalue, or(self.thickness, THICKNESS), 0.0, 1.0, or(self.radius, RADIUS), false)
    }
}

/// Which particle: it stays the same for the particle's life, whoever else comes and goes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ParticleId {
    /// Its number: never 0.
    pub name: u32,
}

/// One particle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Particle {
    /// Its name.
    pub id: ParticleId,
    /// Where it is, in the world \[m\].
    pub position: Vec3,
    /// How fast it is \[m/s\].
    pub velocity: Vec3,
    /// What the host pulls at it with in the next step \[N\].
    pub force: Vec3,
    /// How far volume control has moved its surface outwards \[m\].
    pub offset: f64,
    /// The volume that volume control aims at \[m³\]; none before its first look.
    pub target: Option<f64>,
    /// What it had at the last look \[m³\].
    pub volume: f64,
    /// Which part of the substance it blends with: those of the same label.
    pub label: u32,
    /// Which piece of the solid it was in at the last look: pieces of the substance that hang together.
    pub piece: u32,
}

/// Two particles of different labels that blend a little.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bond {
    /// The particles by their places, the smaller first.
    pub pair: [u32; 2],
    /// How far they are on the way to blending, from 0 to 1.
    pub progress: f64,
    /// They are to blend, or to stop it.
    pub holds: bool,
}

impl Bond {
    /// How much they blend, from 0 to 1. Where a neck breaks, the surface is flat in the field: it moves evenly when this
    /// falls slowly at first (docs/model.md, "Separation and fusion").
    pub fn weight(&self) -> f64 {
        let left = 1.0 - self.progress;
        1.0 - left * left * left.sqrt()
    }
}

/// What happened to a substance in a step.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// These particles came off, and are a part of their own.
    Split(Vec<ParticleId>),
    /// These two began to blend.
    Fused([ParticleId; 2]),
}

/// A body's particles.
#[derive(Clone, Debug)]
pub struct Substance {
    /// What it is like.
    pub desc: SubstanceDesc,
    /// In the order of their coming, but for gaps, which the last one fills.
    pub particles: Vec<Particle>,
    /// In ascending order.
    pub bonds: Vec<Bond>,
    /// The next label, higher than any before.
    pub next_label: u32,
    /// For each name's slot, its generation and place.
    pub(crate) slots: Vec<ParticleSlot>,
    /// Slots to use again.
    pub(crate) free: Vec<u32>,
    /// What happened in the last step.
    pub(crate) changes: Vec<Change>,
}

/// Where the particle of a name is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct ParticleSlot {
    pub generation: u32,
    /// Its place; none when it is gone.
    pub place: Option<u32>,
}

/// Bits of a particle's name for its slot; the rest is the generation.
const SLOT_BITS: u32 = 20;
/// Most particles of a substance.
pub const MOST_PARTICLES: usize = 1 << SLOT_BITS;

impl Substance {
    /// Nothing of it yet.
    pub fn new(desc: SubstanceDesc) -> Self {
        Self {
            desc,
            particles: Vec::new(),
            bonds: Vec::new(),
            next_label: 0,
            slots: Vec::new(),
            free: Vec::new(),
            changes: Vec::new(),
        }
    }

    /// Whether all is as it must be for a step: what was read from outside.
    pub(crate) fn check(&self) -> Result<()> {
        self.desc.validate()?;
        let refuse = |why: &'static str| Err(crate::error::Error::Unsupported(why));
        for (place, particle) in self.particles.iter().enumerate() {
            require_finite("position of a particle", &particle.position)?;
            require_finite("velocity of a particle", &particle.velocity)?;
            require_finite("force on a particle", &particle.force)?;
            let most = 10.0 * self.desc.spacing;
            require("offset of a particle", particle.offset, "at most 10 spacings", |x| x.abs() <= most)?;
            require("volume of a particle", particle.volume, "at least 0", |x| x >= 0.0)?;
            require("target volume", particle.target.unwrap_or(0.0), "at least 0", |x| x >= 0.0)?;
            if particle.label >= self.next_label || self.place_of(particle.id) != Some(place) {
                return refuse("a particle with the label or the name of another");
            }
        }
        let used = self.slots.iter().filter(|slot| slot.place.is_some()).count();
        let free = self.free.iter().filter(|slot| self.slots.get(**slot as usize).is_some_and(|s| s.place.is_none()));
        if used != self.particles.len() || free.count() != self.free.len() || self.slots.len() > MOST_PARTICLES {
            return refuse("names of particles that are not there");
        }
        let count = self.particles.len() as u32;
        let is_sound =
            |bond: &Bond| bond.pair[0] < bond.pair[1] && bond.pair[1] < count && (0.0..=1.0).contains(&bond.progress);
        if !self.bonds.is_sorted_by(|a, b| a.pair < b.pair) || !self.bonds.iter().all(is_sound) {
            return refuse("bonds out of order");
        }
        Ok(())
    }

    /// The place of a particle; none when it is gone, or never was.
    pub fn place_of(&self, id: ParticleId) -> Option<usize> {
        let slot = self.slots.get((id.name & (MOST_PARTICLES as u32 - 1)) as usize)?;
        slot.place.filter(|_| slot.generation == id.name >> SLOT_BITS).map(|place| place as usize)
    }

    /// How many more particles it can have.
    pub(crate) fn room(&self) -> usize {
        MOST_PARTICLES - self.slots.len() + self.free.len()
    }

    /// Adds a particle with this label, in this piece.
    pub(crate) fn add(&mut self, position: Vec3, velocity: Vec3, label: u32, piece: u32) -> ParticleId {
        let place = Some(self.particles.len() as u32);
        let slot = match self.free.pop() {
            Some(slot) => {
                self.slots[slot as usize].place = place;
                slot
            }
            None => {
                // Generation 0 is never given, so that no name is 0.
                self.slots.push(ParticleSlot { generation: 1, place });
                self.slots.len() as u32 - 1
            }
        };
        let id = ParticleId { name: self.slots[slot as usize].generation << SLOT_BITS | slot };
        self.particles.push(Particle {
            id,
            position,
            velocity,
            force: Vec3::zeros(),
            offset: 0.0,
            target: None,
            volume: 0.0,
            label,
            piece,
        });
        id
    }

    /// Removes the particle at a place; the last one takes it.
    pub(crate) fn remove(&mut self, place: usize) {
        let last = self.particles.len() as u32 - 1;
        let gone = self.particles.swap_remove(place);
        let slot = gone.id.name & (MOST_PARTICLES as u32 - 1);
        let generation = &mut self.slots[slot as usize].generation;
        *generation += 1;
        // No name is ever given twice: a slot without names left retires.
        let has_names = *generation < 1 << (32 - SLOT_BITS);
        self.slots[slot as usize].place = None;
        if has_names {
            self.free.push(slot);
        }
        if let Some(moved) = self.particles.get(place) {
            self.slots[(moved.id.name & (MOST_PARTICLES as u32 - 1)) as usize].place = Some(place as u32);
        }
        let place = place as u32;
        self.bonds.retain(|bond| !bond.pair.contains(&place));
        for bond in self.bonds.iter_mut().filter(|bond| bond.pair.contains(&last)) {
            bond.pair = bond.pair.map(|end| if end == last { place } else { end });
            bond.pair.sort_unstable();
        }
        self.bonds.sort_unstable_by_key(|bond| bond.pair);
    }
}
