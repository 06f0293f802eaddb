//! Pieces of substances, and how they change.

use libc::size_t;

use super::guard::{isocoat_world, read};
use super::handle::isocoat_body;
use super::particle::isocoat_particle;
use super::pointer::{List, Out};
use super::status::isocoat_status;
use crate::error::out_of_range;
use crate::world::{BodyId, Change, Piece};

/// Some of a substance that hangs together in one solid.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct isocoat_piece {
    /// Mass, in kg.
    pub mass: f64,
    /// Volume of its solid at the last step, in m^3.
    pub volume: f64,
    /// Centre of mass, in m.
    pub center: [f64; 3],
    /// Momentum, in N s.
    pub momentum: [f64; 3],
    /// Angular momentum about the centre of mass, in N m s.
    pub angular_momentum: [f64; 3],
    /// How many particles it has.
    pub particle_count: u32,
    /// 0.
    pub reserved: u32,
}

impl From<&Piece> for isocoat_piece {
    fn from(piece: &Piece) -> Self {
        Self {
            mass: piece.mass,
            volume: piece.volume,
            center: piece.center.into(),
            momentum: piece.momentum.into(),
            angular_momentum: piece.angular_momentum.into(),
            // A substance has at most 2^20.
            particle_count: piece.particles.len() as u32,
            reserved: 0,
        }
    }
}

/// The pieces of a substance: what hung together at the last step, at the places and velocities that its particles have
/// now. What has come since counts with the first of them.
///
/// - world: not NULL.
/// - body: a substance.
/// - pieces: receives the pieces; NULL with capacity 0 asks for the count only.
/// - capacity: pieces that fit.
/// - count: receives the number of pieces, also when pieces is too small; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (no substance), BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_get_pieces(
    world: *const isocoat_world,
    body: isocoat_body,
    pieces: *mut isocoat_piece,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = List::new(pieces, capacity, "pieces", count)?;
            let found = inner.world.pieces(body.into())?;
            out.put(found.len(), found.iter().map(isocoat_piece::from))
        })
    }
}

/// The particles of one piece. For those of all pieces at once, ask isocoat_substance_get_particles for pieces.
///
/// - world: not NULL.
/// - body: a substance.
/// - piece: index of the piece in the list of isocoat_substance_get_pieces.
/// - particles: receives the names; NULL with capacity 0 asks for the count only.
/// - capacity: names that fit.
/// - count: receives the number of particles, also when particles is too small; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (no substance), BUFFER_TOO_SMALL. Threads: reads
/// the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_get_piece_particles(
    world: *const isocoat_world,
    body: isocoat_body,
    piece: size_t,
    particles: *mut isocoat_particle,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = List::new(particles, capacity, "particles", count)?;
            let pieces = inner.world.pieces(body.into())?;
            let gone = || out_of_range("piece", piece, "below the number of pieces");
            let names = &pieces.get(piece).ok_or_else(gone)?.particles;
            out.put(names.len(), names.iter().map(|particle| particle.name))
        })
    }
}

/// What happened to a part of a substance: an ISOCOAT_CHANGE_ value. More may come.
pub type isocoat_change_kind = u32;
/// These particles came off, and are a part of their own.
pub const ISOCOAT_CHANGE_SPLIT: isocoat_change_kind = 0;
/// These two particles, of two parts, began to blend. Between two parts that fuse there are many of them.
pub const ISOCOAT_CHANGE_FUSED: isocoat_change_kind = 1;

/// A change of a substance in the last step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct isocoat_change {
    /// What happened.
    pub kind: isocoat_change_kind,
    /// 0.
    pub reserved: u32,
    /// The substance; it may have been destroyed since.
    pub body: isocoat_body,
    /// Its particles are so many of the row that comes with the changes; some may have been removed since.
    pub particle_count: size_t,
    /// Where in that row the first of them is.
    pub first_particle: size_t,
}

/// Changes of a step, in rows for the host.
#[derive(Default)]
pub(super) struct Changes {
    changes: Vec<isocoat_change>,
    particles: Vec<isocoat_particle>,
}

impl Changes {
    pub fn clear(&mut self) {
        self.changes.clear();
        self.particles.clear();
    }

    pub fn push(&mut self, body: BodyId, change: &Change) {
        let (kind, names) = match change {
            Change::Split(names) => (ISOCOAT_CHANGE_SPLIT, &names[..]),
            Change::Fused(names) => (ISOCOAT_CHANGE_FUSED, &names[..]),
        };
        self.changes.push(isocoat_change {
            kind,
            reserved: 0,
            body: body.into(),
            particle_count: names.len(),
            first_particle: self.particles.len(),
        });
        self.particles.extend(names.iter().map(|particle| particle.name));
    }
}

/// What came off and what began to fuse in the last step, in all substances.
///
/// - world: not NULL.
/// - changes: receives a pointer to the changes (not to be freed); not NULL.
/// - count: receives their number; not NULL.
/// - particles: receives a pointer to the names of their particles, those of the first change first (not to be freed);
///   not NULL.
///
/// Errors: INVALID_ARGUMENT. Threads: reads the world. Lifetime: until the next step, restore or destroy
/// of the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_substance_changes(
    world: *const isocoat_world,
    changes: *mut *const isocoat_change,
    count: *mut size_t,
    particles: *mut *const isocoat_particle,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let (first, length) = (Out::new(changes, "changes")?, Out::new(count, "count")?);
            let names = Out::new(particles, "particles")?;
            let Changes { changes, particles } = inner.views.changes();
            first.put(changes.as_ptr());
            length.put(changes.len());
            names.put(particles.as_ptr());
            Ok(())
        })
    }
}
