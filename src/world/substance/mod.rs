//! Substances: what can be asked of particles and said about them.
//!
//! [`substance`](crate::substance) has the physics. A substance is a body whose particles take the place of links; what
//! its descriptor says of isovalue, stiffness, friction, dissipation, categories and masks holds for its coat.

use std::collections::BTreeMap;

use super::World;
use super::desc::BodyId;
use crate::error::{Error, Result, out_of_range, require, require_finite};
use crate::math::Vec3;
pub use crate::substance::{Change, Particle, ParticleId, SubstanceDesc};
use crate::substance::{MOST_PARTICLES, Substance, fill};
use crate::surface::mesh;

mod sleep;
mod step;

/// Some of a substance that hangs together.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Its particles.
    pub particles: Vec<ParticleId>,
    /// Mass \[kg\].
    pub mass: f64,
    /// Volume of its solid at the last step \[m³\].
    pub volume: f64,
    /// Centre of mass \[m\].
    pub center: Vec3,
    /// Momentum \[N s\].
    pub momentum: Vec3,
    /// Angular momentum about the centre of mass \[N m s\].
    pub angular_momentum: Vec3,
}

/// A shape to fill with particles.
#[derive(Clone, Copy, Debug)]
pub enum Fill<'a> {
    /// A box with the world's axes, by two corners \[m\].
    Box {
        /// Lowest corner.
        low: Vec3,
        /// Highest corner.
        high: Vec3,
    },
    /// A ball \[m\].
    Ball {
        /// Its centre.
        center: Vec3,
        /// Its radius.
        radius: f64,
    },
    /// A closed triangle mesh.
    Mesh {
        /// Corners \[m\].
        vertices: &'a [[f64; 3]],
        /// Triangles, by their corners.
        triangles: &'a [[u32; 3]],
    },
}

/// Substances.
impl World {
    /// Makes a body a substance: its base is particles from now on. Refused for a rigid body and for one with links.
    pub fn make_substance(&mut self, body: BodyId, desc: SubstanceDesc) -> Result<()> {
        desc.validate()?;
        let body = self.bodies.get_mut(body)?;
        if body.desc.rigid {
            return Err(Error::Unsupported("a rigid body cannot be a substance"));
        }
        if !body.links.is_empty() || body.substance.is_some() {
            return Err(Error::Unsupported("only a body without links can become a substance, once"));
        }
        body.substance = Some(Box::new(Substance::new(desc)));
        Ok(())
    }

    /// What a substance is like.
    pub fn substance_desc(&self, body: BodyId) -> Result<&SubstanceDesc> {
        Ok(&self.substance(body)?.desc)
    }

    /// Changes what a substance is like, from the next step on.
    pub fn set_substance_desc(&mut self, body: BodyId, desc: SubstanceDesc) -> Result<()> {
        desc.validate()?;
        self.substance_mut(body)?.desc = desc;
        Ok(())
    }

    /// Adds particles at these places \[m\], with these velocities \[m/s\] or at rest. Those of one call blend with each
    /// other, and with nobody else until they fuse. Gives their names, in the same order.
    pub fn add_particles(
        &mut self,
        body: BodyId,
        positions: &[[f64; 3]],
        velocities: Option<&[[f64; 3]]>,
    ) -> Result<Vec<ParticleId>> {
        let substance = self.substance(body)?;
        check_states(positions, velocities, positions.len())?;
        if positions.len() > substance.room() {
            return Err(Error::Capacity("a substance has at most 1048576 particles"));
        }
        let substance = self.substance_mut(body)?;
        // Until a step finds out, those of one call hang together.
        let (label, piece) = (substance.next_label, substance.particles.len() as u32);
        substance.next_label += 1;
        // Volumes are those that the coat has with the new ones.
        substance.particles.iter_mut().for_each(|particle| particle.target = None);
        let add = |(at, position): (usize, &[f64; 3])| {
            let velocity = velocities.map_or(Vec3::zeros(), |velocities| Vec3::from(velocities[at]));
            substance.add(Vec3::from(*position), velocity, label, piece)
        };
        Ok(positions.iter().enumerate().map(add).collect())
    }

    /// Fills a shape with particles as far apart as they are at rest, half a spacing within its surface, and adds them as
    /// [`World::add_particles`] does.
    pub fn fill_substance(&mut self, body: BodyId, shape: &Fill) -> Result<Vec<ParticleId>> {
        let spacing = self.substance(body)?.desc.spacing;
        let inset = 0.5 * spacing;
        let (low, high) = match shape {
            Fill::Box { low, high } => (*low, *high),
            Fill::Ball { center, radius } => {
                require("radius of a ball to fill", *radius, "> 0", |x| x > 0.0)?;
                (center - Vec3::repeat(*radius), center + Vec3::repeat(*radius))
            }
            Fill::Mesh { vertices, triangles } => mesh::bounds(vertices, triangles)?,
        };
        require_finite("corner of a shape to fill", &low)?;
        require_finite("corner of a shape to fill", &high)?;
        let size = high - low;
        if size.min() < 0.0 {
            return Err(out_of_range("size of a box to fill", size.min(), "at least 0"));
        }
        // As many as the lattice has in the box, a layer at least.
        let count = size.map(|length| length / spacing + 1.0).product() * std::f64::consts::SQRT_2;
        if count > 4.0 * MOST_PARTICLES as f64 {
            return Err(Error::Capacity("a shape to fill would take more than 1048576 particles"));
        }
        let (low, high) = match shape {
            Fill::Mesh { .. } => (low, high),
            _ => (low + Vec3::repeat(inset), high - Vec3::repeat(inset)),
        };
        let points = fill::packed(spacing, &low, &high, |p| match shape {
            Fill::Box { .. } => true,
            Fill::Ball { center, radius } => (p - center).norm() <= radius - inset,
            Fill::Mesh { vertices, triangles } => fill::winds_round(vertices, triangles, p),
        });
        let points: Vec<[f64; 3]> = points.into_iter().map(Into::into).collect();
        self.add_particles(body, &points, None)
    }

    /// Removes particles.
    pub fn remove_particles(&mut self, body: BodyId, particles: &[ParticleId]) -> Result<()> {
        let mut places = self.places(body, particles)?;
        places.sort_unstable();
        if places.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(Error::Unsupported("a particle cannot be removed twice"));
        }
        let substance = self.substance_mut(body)?;
        // From the end: who fills a gap is not one of those to go.
        places.into_iter().rev().for_each(|place| substance.remove(place));
        substance.particles.iter_mut().for_each(|particle| particle.target = None);
        Ok(())
    }

    /// The particles of a substance. Their order changes only when some are removed.
    pub fn particles(&self, body: BodyId) -> Result<&[Particle]> {
        Ok(&self.substance(body)?.particles)
    }

    /// One particle.
    pub fn particle(&self, body: BodyId, particle: ParticleId) -> Result<&Particle> {
        let place = self.places(body, &[particle])?[0];
        Ok(&self.substance(body)?.particles[place])
    }

    /// Puts particles elsewhere, or gives them other velocities; what is not given stays.
    pub fn set_particles(
        &mut self,
        body: BodyId,
        particles: &[ParticleId],
        positions: Option<&[[f64; 3]]>,
        velocities: Option<&[[f64; 3]]>,
    ) -> Result<()> {
        let places = self.places(body, particles)?;
        check_states(positions.unwrap_or_default(), velocities, places.len())?;
        if positions.is_some_and(|positions| positions.len() != places.len()) {
            return Err(Error::Unsupported("positions must be as many as particles"));
        }
        let substance = self.substance_mut(body)?;
        for (at, place) in places.into_iter().enumerate() {
            let particle = &mut substance.particles[place];
            if let Some(positions) = positions {
                particle.position = positions[at].into();
            }
            if let Some(velocities) = velocities {
                particle.velocity = velocities[at].into();
            }
        }
        Ok(())
    }

    /// Pulls at particles in the next step \[N\]; forces add up.
    pub fn add_particle_forces(&mut self, body: BodyId, particles: &[ParticleId], forces: &[[f64; 3]]) -> Result<()> {
        let places = self.places(body, particles)?;
        check_states(forces, None, places.len())?;
        if forces.len() != places.len() {
            return Err(Error::Unsupported("forces must be as many as particles"));
        }
        let substance = self.substance_mut(body)?;
        for (place, force) in places.into_iter().zip(forces) {
            substance.particles[place].force += Vec3::from(*force);
        }
        Ok(())
    }

    /// The pieces of a substance: what hung together in one solid after the last step. In the order of their first
    /// particles.
    pub fn pieces(&self, body: BodyId) -> Result<Vec<Piece>> {
        let substance = self.substance(body)?;
        let mut pieces: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
        for (place, particle) in substance.particles.iter().enumerate() {
            pieces.entry(particle.piece).or_default().push(place);
        }
        let mass = substance.desc.particle_mass;
        let piece = |places: Vec<usize>| {
            let members = || places.iter().map(|place| &substance.particles[*place]);
            let count = places.len() as f64;
            let center = members().map(|particle| particle.position).sum::<Vec3>() / count;
            let momentum = members().map(|particle| particle.velocity * mass).sum();
            let turn = |particle: &Particle| (particle.position - center).cross(&particle.velocity) * mass;
            Piece {
                particles: members().map(|particle| particle.id).collect(),
                mass: mass * count,
                volume: members().map(|particle| particle.volume).sum(),
                center,
                momentum,
                angular_momentum: members().map(turn).sum(),
            }
        };
        Ok(pieces.into_values().map(piece).collect())
    }

    /// What came apart and what fused in the last step.
    pub fn substance_changes(&self, body: BodyId) -> Result<&[Change]> {
        Ok(&self.substance(body)?.changes)
    }

    fn substance(&self, body: BodyId) -> Result<&Substance> {
        self.bodies.get(body)?.substance.as_deref().ok_or(NO_SUBSTANCE)
    }

    /// Whoever changes a substance wakes it.
    fn substance_mut(&mut self, body: BodyId) -> Result<&mut Substance> {
        self.substance(body)?;
        self.rouse(body.raw.index);
        self.bodies.get_mut(body)?.substance.as_deref_mut().ok_or(NO_SUBSTANCE)
    }

    fn places(&self, body: BodyId, particles: &[ParticleId]) -> Result<Vec<usize>> {
        let substance = self.substance(body)?;
        let place = |id: &ParticleId| {
            let gone = Error::InvalidHandle { noun: "particle", reason: "it was removed, or never was" };
            substance.place_of(*id).ok_or(gone)
        };
        particles.iter().map(place).collect()
    }
}

const NO_SUBSTANCE: Error = Error::Unsupported("the body is not a substance");

fn check_states(positions: &[[f64; 3]], velocities: Option<&[[f64; 3]]>, count: usize) -> Result<()> {
    positions.iter().try_for_each(|p| require_finite("position or force of a particle", &Vec3::from(*p)))?;
    let Some(velocities) = velocities else { return Ok(()) };
    velocities.iter().try_for_each(|v| require_finite("velocity of a particle", &Vec3::from(*v)))?;
    if velocities.len() != count {
        return Err(Error::Unsupported("velocities must be as many as particles"));
    }
    Ok(())
}
