//! Particles of substances: how they come and go, their states, forces on them.

use libc::size_t;

use super::buffer::{Elements, isocoat_buffer};
use super::guard::{isocoat_world, read, write};
use super::handle::isocoat_body;
use super::pointer::{Array, Count, Out, Row, read_vector, slice};
use super::status::{Checked, Refusal, isocoat_status};
use crate::error::Error;
use crate::world::{Fill, ParticleId, World};

/// Name of a particle in its substance; 0 is none. It stays the same for the particle's life, whoever else comes and
/// goes. The name of one that was removed gives ISOCOAT_ERROR_INVALID_HANDLE; it may come again only after 4095 others
/// have had its slot. In another body it means nothing.
pub type isocoat_particle = u32;

/// Triples of numbers; none where the host gives NULL.
///
/// # Safety
/// `first` is NULL or points to `3 * count` doubles that nobody changes until the call returns.
unsafe fn triples<'a>(first: *const f64, count: usize, name: &str) -> Checked<Option<&'a [[f64; 3]]>> {
    // SAFETY: the caller's promise.
    (!first.is_null()).then(|| unsafe { slice(first.cast(), count, name) }).transpose()
}

/// Names as the world knows them.
///
/// # Safety
/// `particles` is NULL or points to `count` of them.
unsafe fn names(particles: *const isocoat_particle, count: usize) -> Checked<Vec<ParticleId>> {
    // SAFETY: the caller's promise.
    let particles = unsafe { Array::new(particles, count, "particles") }?;
    Ok(particles.iter().map(|name| ParticleId { name }).collect())
}

/// A refusal that says which element it is about: the world only says what is wrong with it.
fn blame(
    world: &World,
    body: isocoat_body,
    error: Error,
    particles: &[ParticleId],
    numbers: &[(&str, Option<&[[f64; 3]]>)],
) -> Refusal {
    let found = match &error {
        Error::InvalidHandle { .. } if world.particles(body.into()).is_ok() => {
            let is_gone = |name: &ParticleId| world.particle(body.into(), *name).is_err();
            particles.iter().position(is_gone).map(|index| ("particles", index))
        }
        Error::OutOfRange { .. } => numbers.iter().find_map(|(array, numbers)| {
            let is_wild = |element: &[f64; 3]| element.iter().any(|number| !number.is_finite());
            Some((*array, (*numbers)?.iter().position(is_wild)?))
        }),
        _ => None,
    };
    match found {
        Some((array, index)) => Refusal::from(error).at(array, index),
        None => error.into(),
    }
}

/// Adds particles to a substance: all of them, or none if one is refused. Those of one call are a part of their own:
/// they blend with each other, and with nobody else until they fuse.
///
/// - world: not NULL.
/// - body: a substance.
/// - positions: 3 * count doubles, in m, finite; not NULL unless count is 0.
/// - velocities: 3 * count doubles, in m/s, finite; NULL for particles at rest.
/// - count: number of particles.
/// - particles: receives count names, in the same order; NULL when they are not wanted.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE (the message says which element), UNSUPPORTED (no substance),
/// CAPACITY (more than 1048576 particles). Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_add_particles(
    world: *mut isocoat_world,
    body: isocoat_body,
    positions: *const f64,
    velocities: *const f64,
    count: size_t,
    particles: *mut isocoat_particle,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let positions = slice(positions.cast::<[f64; 3]>(), count, "positions")?;
            let velocities = triples(velocities, count, "velocities")?;
            let out = Row::new(particles);
            let numbers = [("positions", Some(positions)), ("velocities", velocities)];
            let made = inner.world.add_particles(body.into(), positions, velocities);
            let made = made.map_err(|error| blame(&inner.world, body, error, &[], &numbers))?;
            made.iter().enumerate().for_each(|(index, particle)| out.put(index, particle.name));
            Ok(())
        })
    }
}

/// What the calls that fill a shape share.
///
/// # Safety
/// `world` and `count` are NULL or as the lines of those calls say.
unsafe fn fill<'a>(
    world: *mut isocoat_world,
    body: isocoat_body,
    shape: impl FnOnce() -> Checked<Fill<'a>>,
    count: *mut usize,
) -> isocoat_status {
    // SAFETY: the caller's promise.
    unsafe {
        write(world, |inner| {
            let (shape, count) = (shape()?, Out::new(count, "count")?);
            count.put(inner.world.fill_substance(body.into(), &shape)?.len());
            Ok(())
        })
    }
}

/// Fills a box with particles at rest, packed as densely as balls, and half a spacing within its surface. They are
/// added as isocoat_substance_add_particles does; isocoat_substance_get_particles lists them last.
///
/// - world: not NULL.
/// - body: a substance.
/// - low: 3 doubles, the lowest corner, in m, finite; not NULL.
/// - high: 3 doubles, the highest corner, in m, finite, none less than that of low; not NULL.
/// - count: receives the number of new particles; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (no substance), CAPACITY (more than 1048576
/// particles). Threads: changes the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[low;3], [high;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_fill_box(
    world: *mut isocoat_world,
    body: isocoat_body,
    low: *const f64,
    high: *const f64,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        let shape = || Ok(Fill::Box { low: read_vector(low, "low")?, high: read_vector(high, "high")? });
        fill(world, body, shape, count)
    }
}

/// isocoat_substance_fill_box() of a ball.
///
/// - world: not NULL.
/// - body: a substance.
/// - center: 3 doubles, in m, finite; not NULL.
/// - radius: in m, > 0.
/// - count: receives the number of new particles; not NULL.
///
/// Errors: as isocoat_substance_fill_box. Threads: changes the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[center;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_fill_ball(
    world: *mut isocoat_world,
    body: isocoat_body,
    center: *const f64,
    radius: f64,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe { fill(world, body, || Ok(Fill::Ball { center: read_vector(center, "center")?, radius }), count) }
}

/// isocoat_substance_fill_box() of what a triangle mesh encloses: of the points of the packing, those that it goes
/// round, which may lie right under its surface. Time grows with points times triangles.
///
/// - world: not NULL.
/// - body: a substance.
/// - vertices: 3 * vertex_count doubles, in m, finite; not NULL.
/// - vertex_count: number of vertices.
/// - triangles: 3 * triangle_count indices of vertices, all round the same way; not NULL.
/// - triangle_count: number of triangles, at least 1.
/// - count: receives the number of new particles; not NULL.
///
/// Errors: as isocoat_substance_fill_box; OUT_OF_RANGE for an index too large, UNSUPPORTED without triangles. Threads:
/// changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_fill_mesh(
    world: *mut isocoat_world,
    body: isocoat_body,
    vertices: *const f64,
    vertex_count: size_t,
    triangles: *const u32,
    triangle_count: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        let shape = || {
            let vertices = slice(vertices.cast(), vertex_count, "vertices")?;
            Ok(Fill::Mesh { vertices, triangles: slice(triangles.cast(), triangle_count, "triangles")? })
        };
        fill(world, body, shape, count)
    }
}

/// Removes particles: all of them, or none if one is refused. The coat that is left keeps the volume that it has then.
///
/// - world: not NULL.
/// - body: a substance.
/// - particles: count names of its particles, none twice; not NULL unless count is 0.
/// - count: number of particles.
///
/// Errors: INVALID_HANDLE (the message says which element), INVALID_ARGUMENT, UNSUPPORTED (no substance; a particle
/// twice). Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_remove_particles(
    world: *mut isocoat_world,
    body: isocoat_body,
    particles: *const isocoat_particle,
    count: size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let names = names(particles, count)?;
            let removed = inner.world.remove_particles(body.into(), &names);
            removed.map_err(|error| blame(&inner.world, body, error, &names, &[]))
        })
    }
}

/// How many particles a substance has.
///
/// - world: not NULL.
/// - body: a substance.
/// - count: receives the number; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (no substance). Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_get_particle_count(
    world: *const isocoat_world,
    body: isocoat_body,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(count, "count")?;
            out.put(inner.world.particles(body.into())?.len());
            Ok(())
        })
    }
}

/// All particles of a substance, in an order that changes only when some are removed.
///
/// - world: not NULL.
/// - body: a substance.
/// - particles: receives a name a particle; NULL if not wanted.
/// - positions: receives 3 numbers a particle, in m; skipped if its data is NULL.
/// - velocities: receives 3 numbers a particle, in m/s; skipped if its data is NULL.
/// - volumes: receives the volume of the coat that is a particle's, in m^3, at the last step; 0 for one that has come
///   since; NULL if not wanted.
/// - pieces: receives the index of a particle's piece in the list of isocoat_substance_get_pieces; NULL if not wanted.
/// - labels: receives the label of a particle's part: those of one label blend. A part that comes off gets a new label;
///   where two parts have wholly fused, one takes the other's. NULL if not wanted.
/// - capacity: particles that fit into each of the six. With all of them NULL only the count is asked.
/// - count: receives the number of particles, also when they do not fit; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (no substance), BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_get_particles(
    world: *const isocoat_world,
    body: isocoat_body,
    particles: *mut isocoat_particle,
    positions: isocoat_buffer,
    velocities: isocoat_buffer,
    volumes: *mut f64,
    pieces: *mut u32,
    labels: *mut u32,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say; the count is checked before anything else is written.
    unsafe {
        read(world, |inner| {
            let positions = Elements::<3>::new(positions, "positions")?;
            let velocities = Elements::<3>::new(velocities, "velocities")?;
            let (particles, volumes) = (Row::new(particles), Row::new(volumes));
            let (pieces, labels) = (Row::new(pieces), Row::new(labels));
            let count = Count::new(count, "count")?;
            let all = inner.world.particles(body.into())?;
            let numbers = positions.is_wanted() || velocities.is_wanted() || volumes.is_wanted();
            let wanted = numbers || particles.is_wanted() || pieces.is_wanted() || labels.is_wanted();
            count.put(all.len(), capacity, wanted)?;
            // Pieces are listed in the order of these numbers, which have gaps.
            let mut order = Vec::new();
            if pieces.is_wanted() {
                order.extend(all.iter().map(|particle| particle.piece));
                order.sort_unstable();
                order.dedup();
            }
            for (index, particle) in all.iter().enumerate() {
                particles.put(index, particle.id.name);
                positions.put(index, particle.position.into());
                velocities.put(index, particle.velocity.into());
                volumes.put(index, particle.volume);
                pieces.put(index, order.partition_point(|piece| *piece < particle.piece) as u32);
                labels.put(index, particle.label);
            }
            Ok(())
        })
    }
}

/// Puts particles elsewhere, gives them other velocities, or both: all of them, or none if one is refused. What is
/// moved does not push what it passes.
///
/// - world: not NULL.
/// - body: a substance.
/// - particles: count names of its particles; not NULL unless count is 0. Of one that is named twice, the last state
///   holds.
/// - positions: 3 * count doubles, in m, finite; NULL to leave them.
/// - velocities: 3 * count doubles, in m/s, finite; NULL to leave them.
/// - count: number of particles.
///
/// Errors: INVALID_HANDLE, OUT_OF_RANGE (the message says which element), INVALID_ARGUMENT, UNSUPPORTED (no substance).
/// Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_set_particles(
    world: *mut isocoat_world,
    body: isocoat_body,
    particles: *const isocoat_particle,
    positions: *const f64,
    velocities: *const f64,
    count: size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let names = names(particles, count)?;
            let positions = triples(positions, count, "positions")?;
            let velocities = triples(velocities, count, "velocities")?;
            let numbers = [("positions", positions), ("velocities", velocities)];
            let set = inner.world.set_particles(body.into(), &names, positions, velocities);
            set.map_err(|error| blame(&inner.world, body, error, &names, &numbers))
        })
    }
}

/// Pulls at particles throughout the next step; forces of several calls add up. All of them are taken, or none if one
/// is refused.
///
/// - world: not NULL.
/// - body: a substance.
/// - particles: count names of its particles; not NULL unless count is 0.
/// - forces: 3 * count doubles, in N, finite; not NULL unless count is 0.
/// - count: number of particles.
///
/// Errors: INVALID_HANDLE, OUT_OF_RANGE (the message says which element), INVALID_ARGUMENT, UNSUPPORTED (no substance).
/// Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_add_forces(
    world: *mut isocoat_world,
    body: isocoat_body,
    particles: *const isocoat_particle,
    forces: *const f64,
    count: size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let (names, forces) = (names(particles, count)?, slice(forces.cast::<[f64; 3]>(), count, "forces")?);
            let added = inner.world.add_particle_forces(body.into(), &names, forces);
            added.map_err(|error| blame(&inner.world, body, error, &names, &[("forces", Some(forces))]))
        })
    }
}
