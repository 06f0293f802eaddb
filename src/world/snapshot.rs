//! Snapshots: everything of a world that lasts from step to step, as bytes. Stepping on from a restored snapshot gives
//! the same bits as never having stopped.
//!
//! | bytes | |
//! | --- | --- |
//! | 8 | `isocoat` and a zero |
//! | 4 | format, a number |
//! | 12 | version of the library that wrote it, as text filled up with zeros |
//! | 8 | length of the whole |
//! | 8 | origin: whose handles the objects have |
//! | … | settings; bodies, links, skeletons, springs with their slots; the memory of each pair of bodies near each other |
//! | 4 | CRC-32 of all before, which sees any damage of up to 32 bits in a row |
//!
//! What is written of each type stands in the lists below. A change of any list is a new [`FORMAT`].

use std::hash::{BuildHasher, RandomState};

use super::blend::{Blending, Pairing};
use super::bytes::{Counter, Cursor, Lasting, Reader, Sink, enums, structs, write_list};
use super::check::refused;
use super::sleep::Sleep;
use super::{
    Body, BodyDesc, Contact, Link, LinkDesc, LinkId, Skeleton, SkeletonDesc, SkeletonId, Spring, SpringDesc,
    StiffnessRule, World, WorldDesc, check_plane, step, units::Said,
};
use crate::base::{Articulation, Kind};
use crate::contact::Scheme;
use crate::contact::candidate::Memory;
use crate::contact::friction::Bristle;
use crate::contact::standing::{Place, Standing};
use crate::error::{Error, Result};
use crate::field::{Graph, Profile, Shape};
use crate::handle::{Arena, Id, Noun, RawId, Slot, WorldTag};
use crate::math::{Pose, Twist, Wrench};
use crate::response::mirror::Mirror;
use crate::response::{Response, VelocityConvention};
use crate::substance::{Bond, Particle, ParticleId, ParticleSlot, Substance, SubstanceDesc};
use crate::team::Alone;

/// What the lists below say. Another number is refused: no snapshot is ever half understood.
const FORMAT: u32 = 8;
const MAGIC: [u8; 8] = *b"isocoat\0";
/// Offsets of the parts of the header.
const FORMAT_AT: usize = 8;
const VERSION_AT: usize = 12;
const LENGTH_AT: usize = 24;
const CONTENT_AT: usize = 32;
const CHECKSUM: usize = 4;
const SHORTEST: usize = CONTENT_AT + 8 + CHECKSUM;

/// The version of this library, as the header has it.
const VERSION: [u8; LENGTH_AT - VERSION_AT] = {
    let (text, mut padded, mut index) = (env!("CARGO_PKG_VERSION").as_bytes(), [0; LENGTH_AT - VERSION_AT], 0);
    while index < text.len() && index < padded.len() {
        padded[index] = text[index];
        index += 1;
    }
    padded
};

structs! {
    WorldDesc {
        gravity, response, scheme, force_tolerance, seed_count, max_substeps, substep_phase, implicit_rounds,
        implicit_splits, implicit_tolerance, sleep_time, sleep_speed, timed,
    }
    BodyDesc {
        rigid, response, isovalue, stiffness_scale, stiffness, friction, static_friction, viscous_friction, dissipation,
        category, mask, blend_band, self_contact, may_sleep, volume_gain, bulge_width, bulge_height, user_data,
    }
    LinkDesc {
        kind, pose, twist, mass, local_center, inertia, gravity_scale, external_acceleration,
        external_angular_acceleration, velocity_convention, host_gyroscopic, constrained, inverse_effective_inertia,
        user_data,
    }
    SkeletonDesc { shape, thickness, stiffness, stiffening, radius, seed_count, user_data }
    SpringDesc { links, points, rest_length, stiffness, damping, user_data }
    // What the descriptor comes to follows from the parts.
    Body {
        desc, links, springs, enabled, stacked, units, blending, sleep, substance;
        stiffness_scale: 0.0, dissipation: 0.0, volume: None
    }
    Blending {
        by_links, joints, pairs;
        graph: Graph::default(), together: Vec::new(), order: Vec::new(), blocks: Vec::new()
    }
    Pairing { skeletons, weight, target, rate, apart }
    Link {
        desc, body, skeletons, enabled, applied_force, applied_impulse, contact_impulse, host_impulse, substance_impulse,
        last_dt, mirror;
        articulated: false
    }
    Articulation { links, inverse_inertia }
    Substance { desc, particles, bonds, next_label, slots, free; changes: Vec::new() }
    SubstanceDesc {
        spacing, particle_mass, cohesion, viscosity, damping, fusion_threshold, blend_time, volume_gain, thickness, radius,
        seed_count,
    }
    Particle { id, position, velocity, force, offset, target, volume, label, piece }
    ParticleId { name }
    ParticleSlot { generation, place }
    Bond { pair, progress, holds }
    // The profile and the reach follow from the descriptors; the rays are made at their first use.
    Skeleton { desc, link, enabled, offset, target; profile: NO_PROFILE, reach: 0.0, rays: Default::default() }
    Spring { desc }
    Said { sink, travel }
    Sleep { quiet, group }
    Mirror {
        active, twist, expected_center, expected_rotation, expected_twist, commanded, owed, estimate, bypassed, doubt,
    }
    Memory { ids, part, touching, touched, overloaded, was_overloaded, rate2, held, bristles, standing }
    Standing { likeness, places }
    Place { link, center, rotation }
    Bristle { key, slip, turn, sliding, seen }
    Contact {
        bodies, links, skeletons, position, normal, force, torque, area, peak_pressure, stiffness, error_estimate,
        evaluations, scheme, overloaded,
    }
    // The tag is that of the world that restores it.
    RawId { index, generation; world: 0 }
    Pose { position, rotation }
    Twist { linear, angular }
    Wrench { force, torque }
}

enums! {
    Kind { Fixed = 0, Host = 1, PointMass = 2, Rigid = 3 } "from 0 to 3"
    Response { Auto = 0, Explicit = 1, Implicit = 2, Substepped = 3 } "from 0 to 3"
    Scheme { Auto = 0, ClosedForm = 1, Polar = 2, Adaptive = 3, Seeds = 4, Facets = 5 } "from 0 to 5"
    VelocityConvention { Leapfrog = 0, Synchronous = 1 } "0 or 1"
}

/// Until [`World::derive`] gives the right one.
const NO_PROFILE: Profile =
    Profile { isovalue: 0.0, thickness: 0.0, stiffness: 0.0, stiffening: 0.0, radius: 0.0, cap: 0.0 };

impl<T: Noun> Lasting for Id<T> {
    fn write(&self, out: &mut impl Sink) {
        self.raw.write(out);
    }

    fn read(from: &mut Reader) -> Result<Self> {
        RawId::read(from).map(Self::from_raw)
    }
}

impl Lasting for StiffnessRule {
    fn write(&self, out: &mut impl Sink) {
        match self {
            StiffnessRule::Scale => 0u8.write(out),
            StiffnessRule::Sink { fraction } => {
                1u8.write(out);
                fraction.write(out);
            }
            StiffnessRule::Frequency { hertz, damping_ratio } => {
                2u8.write(out);
                hertz.write(out);
                damping_ratio.write(out);
            }
        }
    }

    fn read(from: &mut Reader) -> Result<Self> {
        Ok(match u8::read(from)? {
            0 => StiffnessRule::Scale,
            1 => StiffnessRule::Sink { fraction: from.read("fraction")? },
            2 => StiffnessRule::Frequency { hertz: from.read("hertz")?, damping_ratio: from.read("damping_ratio")? },
            other => return from.refuse(other, "from 0 to 2"),
        })
    }
}

impl Lasting for Shape {
    fn write(&self, out: &mut impl Sink) {
        match self {
            Shape::Point(a) => {
                0u8.write(out);
                a.write(out);
            }
            Shape::Segment(a, b) => {
                1u8.write(out);
                [*a, *b].write(out);
            }
            Shape::Triangle(a, b, c) => {
                2u8.write(out);
                [*a, *b, *c].write(out);
            }
            Shape::Box { center, half, axes } => {
                3u8.write(out);
                [*center, *half].write(out);
                axes.write(out);
            }
            Shape::Plane { point, normal } => {
                4u8.write(out);
                [*point, *normal].write(out);
            }
        }
    }

    fn read(from: &mut Reader) -> Result<Self> {
        Ok(match from.read::<u8>("shape")? {
            0 => Shape::Point(from.read("point")?),
            1 => Shape::Segment(from.read("end of a segment")?, from.read("end of a segment")?),
            2 => Shape::Triangle(
                from.read("corner of a triangle")?,
                from.read("corner of a triangle")?,
                from.read("corner of a triangle")?,
            ),
            3 => Shape::Box {
                center: from.read("centre of a box")?,
                half: from.read("half extents of a box")?,
                axes: from.read("axes of a box")?,
            },
            4 => Shape::Plane { point: from.read("point of a plane")?, normal: from.read("normal of a plane")? },
            other => return from.refuse(other, "from 0 to 4"),
        })
    }
}

/// Writes the objects of an arena, each as `write` does, with their slots.
pub(super) fn write_arena<T: Noun, S: Sink>(arena: &Arena<T>, out: &mut S, write: impl Fn(&T, &mut S)) {
    let (slots, free, given) = arena.parts();
    (slots.len() as u32).write(out);
    for (Slot { generation, value }, given) in slots.iter().zip(given) {
        given.write(out);
        generation.write(out);
        value.is_some().write(out);
        if let Some(value) = value {
            write(value, out);
        }
    }
    write_list(free.len(), free.iter(), out);
}

fn read_arena<T: Noun + Lasting>(from: &mut Reader) -> Result<Arena<T>> {
    let count: u32 = from.read("number of slots")?;
    let room = from.room_for::<Slot<T>>(count);
    let (mut slots, mut given) = (Vec::with_capacity(room), Vec::with_capacity(room));
    for _ in 0..count {
        given.push(from.read("last generation of a slot")?);
        let generation = from.read("generation of a slot")?;
        let value = if from.read("use of a slot")? { Some(T::read(from)?) } else { None };
        slots.push(Slot { generation, value });
    }
    let free = from.read("free slots")?;
    Arena::from_parts(0, slots, free, given).map_err(|error| refused(T::NAME, error))
}

/// A world of the settings and the objects that come next; nothing of it is checked.
pub(super) fn read_parts(from: &mut Reader) -> Result<World> {
    Ok(World {
        origin: new_origin(),
        // For a world of another origin; otherwise it goes back at once.
        own_tag: WorldTag::take()?,
        desc: from.read("settings")?,
        bodies: read_arena(from)?,
        links: read_arena(from)?,
        skeletons: read_arena(from)?,
        springs: read_arena(from)?,
        skins: Arena::new(0),
        articulations: Vec::new(),
        log: Alone::default(),
        pair_filter: Alone::default(),
        tasks: Alone::default(),
        controls_volumes: false,
        stepping: step::Stepping::default(),
    })
}

/// A number that no other world has, in no other process either.
pub(super) fn new_origin() -> u64 {
    // The keys of the standard library's hash tables are drawn from the system's randomness.
    RandomState::new().hash_one(())
}

/// Snapshots.
impl World {
    /// Bytes of a snapshot taken now.
    pub fn snapshot_size(&self) -> usize {
        let mut counter = Counter(CONTENT_AT + CHECKSUM);
        self.write(&mut counter);
        counter.0
    }

    /// Takes a snapshot: everything that lasts between steps, the host's pushes that wait for the next step included,
    /// but for the log and the pair filter. What was in `out` goes; no memory is asked for when it has the room.
    ///
    /// `user_data` is kept as a number. The bytes of two worlds in the same state differ in their origin.
    pub fn snapshot(&self, out: &mut Vec<u8>) {
        out.clear();
        out.resize(self.snapshot_size(), 0);
        // Of the right size, so that it is not refused.
        let _ = self.snapshot_into(out);
    }

    /// Takes a snapshot as [`World::snapshot`] does, into the beginning of a buffer. Gives its size; refuses a buffer
    /// that is too small, whose contents are then undefined.
    pub fn snapshot_into(&self, out: &mut [u8]) -> Result<usize> {
        let mut cursor = Cursor { buffer: out, at: CONTENT_AT };
        self.write(&mut cursor);
        let end = cursor.at;
        let size = end + CHECKSUM;
        let Some(out) = out.get_mut(..size) else {
            return Err(Error::Capacity("the buffer is too small for the snapshot"));
        };
        out[..FORMAT_AT].copy_from_slice(&MAGIC);
        out[FORMAT_AT..VERSION_AT].copy_from_slice(&FORMAT.to_le_bytes());
        out[VERSION_AT..LENGTH_AT].copy_from_slice(&VERSION);
        out[LENGTH_AT..CONTENT_AT].copy_from_slice(&(size as u64).to_le_bytes());
        let checksum = crc32fast::hash(&out[..end]);
        out[end..].copy_from_slice(&checksum.to_le_bytes());
        Ok(size)
    }

    fn write(&self, out: &mut impl Sink) {
        let Self {
            desc,
            origin,
            own_tag: _,
            bodies,
            links,
            skeletons,
            springs,
            skins: _,
            articulations,
            log: _,
            pair_filter: _,
            tasks: _,
            controls_volumes: _,
            stepping,
        } = self;
        origin.write(out);
        desc.write(out);
        write_arena(bodies, out, Body::write);
        write_arena(links, out, Link::write);
        write_arena(skeletons, out, Skeleton::write);
        write_arena(springs, out, Spring::write);
        articulations.write(out);
        let (candidates, resting, contacts) = stepping.lasting();
        write_list(candidates.len(), candidates.iter().map(|candidate| candidate.lasting()), out);
        write_list(resting.len(), resting.iter(), out);
        // Who has just been woken has none any more.
        let rests =
            |contact: &&Contact| contact.bodies.iter().any(|id| self.bodies.get(*id).is_ok_and(Body::is_asleep));
        write_list(contacts.iter().filter(rests).count(), contacts.iter().filter(rests), out);
    }

    /// Puts a world back to what a snapshot says; stepping on gives the same bits as never having stopped. A snapshot
    /// that is damaged, of another format, or of a state that no world can be in is refused, and the world is as it
    /// was. Log and pair filter stay; contacts, events and counters are empty until the next step.
    ///
    /// Handles. In the world that took the snapshot, those taken before it are valid again, and those of what was
    /// created after it are stale. They stay so: what is created from now on has handles that were never given out.
    ///
    /// In any other world, of another process too, the snapshot's objects take the place of all there was, which makes
    /// every handle given out so far foreign: the world takes a new tag. The new handles have the old slots and
    /// generations, and [`World::bodies`], [`World::body_links`] and [`World::link_skeletons`] list them.
    pub fn restore(&mut self, snapshot: &[u8]) -> Result<()> {
        let mut from = open(snapshot)?;
        let origin = from.read("origin")?;
        let mut fresh = World { origin, ..read_parts(&mut from)? };
        let articulations: Vec<Articulation> = from.read("articulations")?;
        let mut memories: Vec<Memory> = from.read("pairs of bodies")?;
        let mut resting: Vec<Memory> = from.read("pairs of bodies asleep")?;
        let mut contacts: Vec<Contact> = from.read("contacts of bodies asleep")?;
        if from.left() > 0 {
            return Err(Error::Snapshot(format!("{} bytes are left over", from.left())));
        }
        fresh.check_owners()?;
        fresh.check_state()?;
        fresh.derive()?;
        fresh.check_memories(&memories)?;
        fresh.check_sleep(&resting, &contacts)?;
        if articulations.iter().flat_map(|one| &one.links).any(|link| !fresh.links.is_live(*link as usize)) {
            return Err(Error::Snapshot("an articulation of links that are not there".into()));
        }
        fresh
            .check_articulations(&articulations)
            .map_err(|(index, error)| refused(format_args!("articulation {index}"), error))?;

        // From here on nothing fails.
        let tag = if fresh.origin == self.origin {
            fresh.bodies.go_on_from(&self.bodies);
            fresh.links.go_on_from(&self.links);
            fresh.skeletons.go_on_from(&self.skeletons);
            fresh.springs.go_on_from(&self.springs);
            self.own_tag.number()
        } else {
            // Of the same origin are only those snapshots that this world takes from now on.
            fresh.origin = new_origin();
            std::mem::swap(&mut self.own_tag, &mut fresh.own_tag);
            // No skin of the bodies that were here fits those that come.
            self.skins = Arena::new(self.own_tag.number());
            self.own_tag.number()
        };
        for id in memories.iter_mut().chain(&mut resting).flat_map(|memory| &mut memory.ids) {
            id.world = tag;
        }
        for Contact { bodies, links, skeletons, .. } in &mut contacts {
            bodies.iter_mut().for_each(|id| id.raw.world = tag);
            // A substance has neither links nor skeletons.
            links.iter_mut().filter(|id| **id != LinkId::default()).for_each(|id| id.raw.world = tag);
            skeletons.iter_mut().filter(|id| **id != SkeletonId::default()).for_each(|id| id.raw.world = tag);
        }
        self.origin = fresh.origin;
        self.take_over(fresh);
        for link in articulations.iter().flat_map(|one| &one.links) {
            self.links[*link as usize].articulated = true;
        }
        self.articulations = articulations;
        self.stepping.restart(memories, resting, contacts);
        Ok(())
    }

    /// Puts the objects of another world, which are sound, in the place of all there was. They are this world's now; log,
    /// pair filter and tasks stay.
    pub(super) fn take_over(&mut self, mut fresh: World) {
        let tag = self.own_tag.number();
        fresh.bodies.set_world(tag);
        fresh.links.set_world(tag);
        fresh.skeletons.set_world(tag);
        fresh.springs.set_world(tag);
        for index in 0..fresh.springs.capacity() {
            if let Some(spring) = fresh.springs.at_mut(index) {
                spring.desc.links.iter_mut().for_each(|id| id.raw.world = tag);
            }
        }
        fresh.take_rays_of(self);
        let World {
            desc,
            origin: _,
            own_tag: _,
            bodies,
            links,
            skeletons,
            springs,
            skins: _,
            articulations: _,
            log: _,
            pair_filter: _,
            tasks: _,
            controls_volumes: _,
            stepping: _,
        } = fresh;
        self.articulations = Vec::new();
        self.controls_volumes = bodies.indices().any(|body| bodies[body].desc.volume_gain > 0.0);
        self.desc = desc;
        (self.bodies, self.links, self.skeletons, self.springs) = (bodies, links, skeletons, springs);
    }

    /// Works out what follows from the descriptors.
    pub(super) fn derive(&mut self) -> Result<()> {
        for index in 0..self.skeletons.capacity() {
            let Some(skeleton) = self.skeletons.at_mut(index) else { continue };
            let link = &self.links[skeleton.link as usize];
            let isovalue = self.bodies[link.body as usize].desc.isovalue;
            let profile = skeleton.desc.profile(isovalue).and_then(|profile| {
                check_plane(&skeleton.desc, link.desc.kind)?;
                Ok(profile)
            });
            let profile = profile.map_err(|error| refused(format_args!("skeleton {index}"), error))?;
            skeleton.profile = profile.inflated(skeleton.offset);
            skeleton.reach = skeleton.profile.thickness;
        }
        for body in 0..self.bodies.capacity() {
            if self.bodies.is_live(body) {
                self.measure(body);
            }
        }
        Ok(())
    }

    /// Takes over the rays of skeletons that are the same: to roll back is not to make them again.
    fn take_rays_of(&mut self, other: &mut World) {
        if self.desc.seed_count != other.desc.seed_count {
            return;
        }
        for index in 0..self.skeletons.capacity() {
            if let (Some(ours), Some(theirs)) = (self.skeletons.at_mut(index), other.skeletons.at_mut(index))
                && same_bits(&ours.desc, &theirs.desc)
            {
                ours.rays = std::mem::take(&mut theirs.rays);
            }
        }
    }
}

/// Checks the header and the checksum; what is left to read is the content.
fn open(snapshot: &[u8]) -> Result<Reader<'_>> {
    let refuse = |why: String| Err(Error::Snapshot(why));
    let length = snapshot.len();
    if length < SHORTEST {
        return refuse(format!("its length is {length} bytes; must be at least {SHORTEST}"));
    }
    if snapshot[..FORMAT_AT] != MAGIC {
        return refuse(format!("it begins with {:02x?}; must be {MAGIC:02x?}", &snapshot[..FORMAT_AT]));
    }
    let mut header = Reader::new(snapshot, FORMAT_AT);
    let format: u32 = header.read("format")?;
    if format != FORMAT {
        let version = &snapshot[VERSION_AT..LENGTH_AT];
        let end = version.iter().position(|byte| *byte == 0).unwrap_or(version.len());
        let version = String::from_utf8_lossy(&version[..end]);
        return refuse(format!("its format is {format}, written by version {version}; must be {FORMAT}"));
    }
    let stated: u64 = Reader::new(snapshot, LENGTH_AT).read("length")?;
    if stated != length as u64 {
        return refuse(format!("its length is {length} bytes; must be {stated}, as its header says"));
    }
    let end = length - CHECKSUM;
    let stated: u32 = Reader::new(snapshot, end).read("checksum")?;
    let checksum = crc32fast::hash(&snapshot[..end]);
    if checksum != stated {
        return refuse(format!("its checksum is {checksum:08x}; must be {stated:08x}, as its end says"));
    }
    Ok(Reader::new(&snapshot[..end], CONTENT_AT))
}

/// Equal in every bit: zeros of different signs are not the same.
fn same_bits(a: &SkeletonDesc, b: &SkeletonDesc) -> bool {
    let bits = |desc: &SkeletonDesc| {
        let mut buffer = [0; 256];
        let mut cursor = Cursor { buffer: &mut buffer, at: 0 };
        desc.write(&mut cursor);
        (cursor.at, buffer)
    };
    bits(a) == bits(b)
}
