//! Substances: what they are like. Their particles are in `particle`, what these come to in `piece`.

use std::mem::offset_of;

use libc::size_t;

use super::descriptor::{self, Descriptor, OutStruct};
use super::guard::{free, isocoat_world, read, write};
use super::handle::isocoat_body;
use super::status::isocoat_status;
use crate::world::SubstanceDesc;

/// What a substance is like: clay, dough, mud. Its particles attract and repel each other, and each carries a point of
/// the coat; isovalue, stiffness, friction, dissipation, category and mask are those of its body. Particles of one part
/// blend; parts that come apart collide, and fuse where they are pressed together hard enough. Begin with
/// isocoat_substance_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_substance_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// Seeds of a particle, which measure volumes and find pieces, from 4 to 4096. Default 64.
    pub seed_count: u32,
    /// Distance of two particles at rest, in m, from 1e-9 to 1e6. Default 0.1.
    pub spacing: f64,
    /// Mass of one particle, in kg, > 0 and at most 1e30: density * spacing^3 / sqrt(2) for a lump that was filled.
    /// Default 1.
    pub particle_mass: f64,
    /// Strength of attraction and repulsion, in J, from 0 to 1e30: at rest, a pair has a stiffness of
    /// 4 * cohesion / spacing^2. Advice: n * particle_mass * g * spacing bears a lump n particles high. Default 1.
    pub cohesion: f64,
    /// Friction between particles that grows with the square of their speed, in kg/m, from 0 to 1e30. Default 0.
    pub viscosity: f64,
    /// Damping of a pair at rest over the critical one, from 0 to 100. Default 0.2.
    pub damping: f64,
    /// Pressure between two parts above which they fuse, in Pa, at least 0: 0 is at the first touch, infinity never.
    /// Default infinity.
    pub fusion_threshold: f64,
    /// How long it takes for two particles to blend, or to stop it, in s, > 0 and at most 1e9. Default 0.5.
    pub blend_time: f64,
    /// Part of a volume error that is taken back in a step, from 0 to 0.5; 0 switches volume control off. Default 0.5.
    pub volume_gain: f64,
    /// Distance of the surface from an isolated particle, in m, from 0.4 to 2 spacings; 0 stands for half a spacing.
    /// Default 0.
    pub thickness: f64,
    /// Distance at which the field of a particle ends, in m, more than the thickness and at most 3 spacings; 0 stands
    /// for 1.25 spacings. Default 0.
    pub radius: f64,
}

// SAFETY: `repr(C)`, the size first, numbers only.
unsafe impl Descriptor for isocoat_substance_desc {
    const NAME: &'static str = "isocoat_substance_desc";
    const FIRST_SIZE: usize = offset_of!(Self, radius) + size_of::<f64>();

    fn defaults() -> Self {
        Self::from(&SubstanceDesc::default())
    }
}

impl From<&SubstanceDesc> for isocoat_substance_desc {
    fn from(desc: &SubstanceDesc) -> Self {
        Self {
            struct_size: 0,
            seed_count: desc.seed_count,
            spacing: desc.spacing,
            particle_mass: desc.particle_mass,
            cohesion: desc.cohesion,
            viscosity: desc.viscosity,
            damping: desc.damping,
            fusion_threshold: desc.fusion_threshold,
            blend_time: desc.blend_time,
            volume_gain: desc.volume_gain,
            thickness: desc.thickness,
            radius: desc.radius,
        }
    }
}

impl From<isocoat_substance_desc> for SubstanceDesc {
    fn from(desc: isocoat_substance_desc) -> Self {
        Self {
            spacing: desc.spacing,
            particle_mass: desc.particle_mass,
            cohesion: desc.cohesion,
            viscosity: desc.viscosity,
            damping: desc.damping,
            fusion_threshold: desc.fusion_threshold,
            blend_time: desc.blend_time,
            volume_gain: desc.volume_gain,
            thickness: desc.thickness,
            radius: desc.radius,
            seed_count: desc.seed_count,
        }
    }
}

/// Fills a descriptor with its defaults; isocoat_substance_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_substance_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_desc_init(
    desc: *mut isocoat_substance_desc,
    size: size_t,
) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Makes a body a substance, for good: from now on it has particles in place of links. The calls below refuse every
/// other body.
///
/// - world: not NULL.
/// - body: a deformable body without links.
/// - desc: what it is like; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (a rigid body, one with links, or one that is a
/// substance). Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_make_substance(
    world: *mut isocoat_world,
    body: isocoat_body,
    desc: *const isocoat_substance_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let desc = descriptor::read(desc, "desc")?.into();
            Ok(inner.world.make_substance(body.into(), desc)?)
        })
    }
}

/// The descriptor of a substance.
///
/// - world: not NULL.
/// - body: a substance.
/// - desc: receives it; not NULL, with struct_size set.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (no substance). Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_get_desc(
    world: *const isocoat_world,
    body: isocoat_body,
    desc: *mut isocoat_substance_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = OutStruct::new(desc, "desc")?;
            out.put(&inner.world.substance_desc(body.into())?.into());
            Ok(())
        })
    }
}

/// Changes what a substance is like, from the next step on. Particles stay where they are.
///
/// - world: not NULL.
/// - body: a substance.
/// - desc: the new descriptor, whole; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (no substance). Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_substance_set_desc(
    world: *mut isocoat_world,
    body: isocoat_body,
    desc: *const isocoat_substance_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let desc = descriptor::read(desc, "desc")?.into();
            Ok(inner.world.set_substance_desc(body.into(), desc)?)
        })
    }
}
