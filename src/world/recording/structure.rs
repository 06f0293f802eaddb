//! The structure of a world: what it is made of, without what changes from frame to frame. It is written as a snapshot
//! of the world would be, with everything that moves at rest at the origin: the same bytes, the same structure.

use crate::error::{Error, Result};
use crate::handle::{Arena, Noun};
use crate::math::{Pose, Twist, Vec3};
use crate::substance::{Particle, Substance};
use crate::world::blend::{Blending, Pairing};
use crate::world::bytes::{Lasting, Reader, Sink};
use crate::world::sleep::Sleep;
use crate::world::snapshot::{read_parts, write_arena};
use crate::world::{Body, Link, LinkDesc, Skeleton, Spring, World, units::Said};

/// What of an object is structure.
trait Structural: Noun + Lasting {
    fn structure(&self) -> Self;
}

impl Structural for Body {
    fn structure(&self) -> Self {
        let Body { desc, links, enabled, blending, substance, .. } = self;
        Body {
            desc: desc.clone(),
            links: links.clone(),
            springs: Vec::new(),
            enabled: *enabled,
            stiffness_scale: 0.0,
            dissipation: 0.0,
            stacked: 0,
            units: Said::default(),
            blending: blending.as_ref().map(|blending| Box::new(blending_structure(blending))),
            sleep: Sleep::default(),
            substance: substance.as_ref().map(|substance| Box::new(substance_structure(substance))),
            volume: None,
        }
    }
}

fn blending_structure(blending: &Blending) -> Blending {
    let pair = |pair: &Pairing| Pairing { weight: pair.weight.map(|_| 0.0), target: 0.0, rate: 0.0, ..*pair };
    Blending {
        by_links: blending.by_links,
        joints: blending.joints.clone(),
        pairs: blending.pairs.iter().map(pair).collect(),
        ..Blending::default()
    }
}

fn substance_structure(substance: &Substance) -> Substance {
    let particle = |particle: &Particle| Particle {
        id: particle.id,
        position: Vec3::zeros(),
        velocity: Vec3::zeros(),
        force: Vec3::zeros(),
        offset: 0.0,
        target: None,
        volume: 0.0,
        label: 0,
        piece: 0,
    };
    Substance {
        desc: substance.desc.clone(),
        particles: substance.particles.iter().map(particle).collect(),
        bonds: Vec::new(),
        next_label: 1,
        slots: substance.slots.clone(),
        free: substance.free.clone(),
        changes: Vec::new(),
    }
}

impl Structural for Link {
    fn structure(&self) -> Self {
        let desc = LinkDesc {
            pose: Pose::default(),
            twist: Twist::default(),
            external_acceleration: Vec3::zeros(),
            external_angular_acceleration: Vec3::zeros(),
            constrained: false,
            inverse_effective_inertia: None,
            ..self.desc.clone()
        };
        Link { skeletons: self.skeletons.clone(), enabled: self.enabled, ..Link::new(desc, self.body) }
    }
}

impl Structural for Skeleton {
    fn structure(&self) -> Self {
        Skeleton {
            desc: self.desc.clone(),
            profile: self.profile,
            link: self.link,
            enabled: self.enabled,
            offset: 0.0,
            target: None,
            reach: 0.0,
            rays: Default::default(),
        }
    }
}

fn write_structures<T: Structural>(arena: &Arena<T>, out: &mut impl Sink) {
    write_arena(arena, out, |object, out| object.structure().write(out));
}

impl World {
    /// Appends the structure.
    pub(super) fn write_structure(&self, out: &mut impl Sink) {
        self.desc.write(out);
        write_structures(&self.bodies, out);
        write_structures(&self.links, out);
        write_structures(&self.skeletons, out);
        write_arena(&Arena::<Spring>::new(0), out, Spring::write);
    }

    /// A world of this structure, everything in it at the origin.
    pub(super) fn of_structure(structure: &[u8]) -> Result<World> {
        let mut from = Reader::new(structure, 0);
        let mut world = read_parts(&mut from)?;
        if from.left() > 0 {
            return Err(Error::Snapshot(format!("{} bytes are left over", from.left())));
        }
        world.check_owners()?;
        world.check_state()?;
        world.derive()?;
        Ok(world)
    }
}
