//! All particles of all substances of a world, side by side, as a step works on them.

use super::neighbours::Neighbours;
use super::volume::Rays;
use crate::contact::press::Material;
use crate::field::Profile;
use crate::math::Vec3;

/// How much farther than needed neighbours are looked for, over the radius: they are found again after half as much.
pub const SKIN: f64 = 0.2;
/// Most particles of which each has the same part of the field somewhere on the surface.
pub const CROWD: f64 = 8.0;

/// What the particles of one substance have in common.
#[derive(Debug)]
pub struct Matter {
    /// Slot of the body.
    pub body: u32,
    /// Distance at rest \[m\].
    pub spacing: f64,
    /// Of one particle \[kg\].
    pub mass: f64,
    /// `γ` \[J\].
    pub cohesion: f64,
    /// `μ` \[kg/m\].
    pub viscosity: f64,
    /// Damping of a pair at rest over the critical one.
    pub damping: f64,
    /// Pressure of fusion \[Pa\].
    pub fusion_threshold: f64,
    /// The field without an offset.
    pub profile: Profile,
    /// One over the width of the field's outer piece \[1/m\].
    pub inverse_width: f64,
    /// Where two particles of the same field make a solid together: its half way, without offsets \[m\].
    pub half: f64,
    /// No surface is farther from a particle, without offsets: there [`CROWD`] would have to add up \[m\].
    pub farthest: f64,
    /// Pressure a unit of field \[Pa\].
    pub stiffness_scale: f64,
    /// Between its pieces.
    pub material: Material,
    /// Seeds.
    pub rays: Rays,
}

/// All particles of all substances, as columns; in a frame with the world's axes near them.
#[derive(Debug, Default)]
pub struct Swarm {
    /// Origin of the frame in the world \[m\].
    pub origin: Vec3,
    /// Places \[m\].
    pub place: Vec<Vec3>,
    /// Velocities \[m/s\].
    pub velocity: Vec<Vec3>,
    /// Accelerations from outside \[m/s²\].
    pub pull: Vec<Vec3>,
    /// Offsets \[m\].
    pub offset: Vec<f64>,
    /// Labels, different for every substance.
    pub label: Vec<u32>,
    /// Which matter.
    pub kind: Vec<u16>,
    /// Something pressed on it in the last sub-step.
    pub is_pressed: Vec<bool>,
    /// Who is near.
    pub near: Neighbours,
    /// The substances.
    pub matters: Vec<Matter>,
    /// Largest radius of influence, offsets in it \[m\].
    pub widest: f64,
    /// Bonds of each particle: where its own begin, and the others with weights.
    pub bond_starts: Vec<u32>,
    /// See there.
    pub bond_lists: Vec<(u32, f64)>,
}

impl Swarm {
    /// What a particle is made of.
    pub fn matter_of(&self, index: usize) -> &Matter {
        &self.matters[self.kind[index] as usize]
    }

    /// Those of other labels that a particle blends with, and how much.
    pub fn bonds_of(&self, index: usize) -> &[(u32, f64)] {
        if self.bond_lists.is_empty() {
            return &[];
        }
        &self.bond_lists[self.bond_starts[index] as usize..self.bond_starts[index + 1] as usize]
    }

    /// Whether a particle has any bond.
    pub fn is_bonded(&self, index: usize) -> bool {
        !self.bonds_of(index).is_empty()
    }

    /// How far two particles of different labels blend.
    pub fn bond(&self, a: usize, b: usize) -> f64 {
        self.bonds_of(a).iter().find(|(other, _)| *other as usize == b).map_or(0.0, |(_, weight)| *weight)
    }

    /// Sets the bonds, from pairs with weights.
    pub fn set_bonds(&mut self, pairs: &[([u32; 2], f64)]) {
        self.bond_starts.clear();
        self.bond_lists.clear();
        if pairs.is_empty() {
            return;
        }
        let mut sided: Vec<(u32, u32, f64)> =
            pairs.iter().flat_map(|([a, b], w)| [(*a, *b, *w), (*b, *a, *w)]).collect();
        sided.sort_unstable_by_key(|(a, b, _)| (*a, *b));
        self.bond_starts.resize(self.place.len() + 1, 0);
        for (a, ..) in &sided {
            self.bond_starts[*a as usize + 1] += 1;
        }
        for index in 1..self.bond_starts.len() {
            self.bond_starts[index] += self.bond_starts[index - 1];
        }
        self.bond_lists.extend(sided.into_iter().map(|(_, b, w)| (b, w)));
    }

    /// Whether somebody has moved by more than `way` since then, but for what all have.
    pub fn has_strayed(&self, since: &[Vec3], way: f64) -> bool {
        let moves = || self.place.iter().zip(since).map(|(now, then)| now - then);
        let mean = moves().sum::<Vec3>() / self.place.len().max(1) as f64;
        moves().any(|moved| (moved - mean).norm_squared() > way * way)
    }

    /// Whether somebody has moved by more than `way` since then.
    pub fn has_moved(&self, since: &[Vec3], way: f64) -> bool {
        self.place.iter().zip(since).any(|(now, then)| (now - then).norm_squared() > way * way)
    }

    /// Finds who is near whom: all whose fields reach where the surface near a particle can be, and a little farther.
    pub fn find_neighbours(&mut self) {
        let offset = self.offset.iter().copied().fold(0.0, f64::max);
        let radius = self.matters.iter().map(|matter| matter.profile.radius).fold(0.0, f64::max);
        self.widest = radius + offset;
        let farthest = self.matters.iter().map(|matter| matter.farthest).fold(0.0, f64::max);
        let reach = self.widest + offset + farthest;
        self.near.find(&self.place, reach + SKIN * radius);
    }
}
