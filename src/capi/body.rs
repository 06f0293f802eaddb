//! Bodies: life, descriptors, links.

use std::mem::offset_of;

use libc::{c_void, size_t};

use super::descriptor::{self, Descriptor, OutStruct};
use super::guard::{free, isocoat_world, read, write};
use super::handle::{isocoat_body, isocoat_link};
use super::pointer::{List, Out};
use super::status::{Checked, isocoat_status};
use super::world::{check_reserved, flag, isocoat_response, response_from_c, response_to_c, unknown};
use crate::world::{BodyDesc, StiffnessRule};

/// What a body is made of: an ISOCOAT_BODY_ value.
pub type isocoat_body_kind = u32;
/// Its coat gives way under load.
pub const ISOCOAT_BODY_DEFORMABLE: isocoat_body_kind = 0;
/// Its coat keeps its shape; in a contact all the flesh that gives way is the other body's.
pub const ISOCOAT_BODY_RIGID: isocoat_body_kind = 1;

/// How a body's stiffness is said: an ISOCOAT_STIFFNESS_ value. With the last two, the pressure a unit of field follows
/// from the body's mass, its skeletons and the world's gravity (or 9.80665 m/s^2 where there is none), for rest on a
/// hard floor on all its skeletons; isocoat_body_get_stiffness() gives what comes out. Without mass or skeletons,
/// stiffness_scale holds.
pub type isocoat_stiffness_rule = u32;
/// By stiffness_scale.
pub const ISOCOAT_STIFFNESS_SCALE: isocoat_stiffness_rule = 0;
/// By static_sink.
pub const ISOCOAT_STIFFNESS_SINK: isocoat_stiffness_rule = 1;
/// By contact_frequency and damping_ratio.
pub const ISOCOAT_STIFFNESS_FREQUENCY: isocoat_stiffness_rule = 2;

/// One object: what its coat is made of. Begin with isocoat_body_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_body_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// What it is made of. Default ISOCOAT_BODY_DEFORMABLE.
    pub kind: isocoat_body_kind,
    /// Field value on the surface, > 1e-9 and at most 1e9. Default 1.
    pub isovalue: f64,
    /// Pressure a unit of field, in Pa, > 0 and at most 1e18. Default 1e5.
    pub stiffness_scale: f64,
    /// Coefficient of Coulomb friction, from 0 to 1e6; a pair takes the geometric mean. Default 0.
    pub friction: f64,
    /// Coefficient of static friction: 0 (off), or from friction to 1e6; a pair takes the geometric mean. Default 0.
    pub static_friction: f64,
    /// Viscous friction, in sqrt(N s/m^3), from 0 to 1e6; a pair takes the product. Default 0.
    pub viscous_friction: f64,
    /// Hunt-Crossley dissipation, in s/m, from 0 to 1e6; a pair takes the mean weighted by the other's stiffness.
    /// Default 0.
    pub dissipation: f64,
    /// What this body is, as bits. Default 1.
    pub category: u64,
    /// Which categories it touches, as bits; two bodies touch when each one's mask has a bit of the other's category.
    /// Default all.
    pub mask: u64,
    /// The host's own; given back, otherwise unused. Default NULL.
    pub user_data: *mut c_void,
    /// How contact forces act on it in time: ISOCOAT_RESPONSE_AUTO leaves it to the world; what one body forces
    /// holds for all that it touches. Default ISOCOAT_RESPONSE_AUTO.
    pub response: isocoat_response,
    /// How its stiffness is said. Default ISOCOAT_STIFFNESS_SCALE.
    pub stiffness_rule: isocoat_stiffness_rule,
    /// With ISOCOAT_STIFFNESS_SINK: sink under its own weight over the thickness, > 0 and at most 0.5. Default 0.05.
    /// A box is taken to lie on its flat face: where its coat is thick, the rounded rim bears too, and it sinks less.
    pub static_sink: f64,
    /// With ISOCOAT_STIFFNESS_FREQUENCY: frequency of small swings on its contact, in Hz, > 0 and at most 1e6.
    /// Default 10.
    pub contact_frequency: f64,
    /// With ISOCOAT_STIFFNESS_FREQUENCY: damping over the critical one, from 0 to 10; replaces dissipation. Default 0.
    pub damping_ratio: f64,
    /// 1 if it may fall asleep where the world lets bodies sleep, else 0. Default 1.
    pub may_sleep: u32,
    /// 0.
    pub reserved: u32,
    /// Width of the band in which the fields of groups that don't blend go over into each other, over the isovalue, from
    /// 0 to 0.5; 0 leaves a crease. Only for bodies with a blend graph. Default 0.05.
    pub blend_band: f64,
    /// 1 if its parts that don't blend collide, when they are of different links, else 0. Default 1.
    pub self_contact: u32,
    /// 0.
    pub reserved_2: u32,
    /// Volume control: share of each skeleton's error in volume that a step takes back, from 0 (off) to 0.5, which is
    /// the best for most. See isocoat_skeleton_set_target_volume(). Default 0.
    pub volume_gain: f64,
    /// How far round its contacts its coat bulges, from 0 (not at all) to 1, over the isovalue: until the field of what
    /// it touches has fallen by so much. Seen by queries with ISOCOAT_DEFORMATION_BULGES; forces know no bulges.
    /// Default 0.
    pub bulge_width: f64,
    /// Height of those bulges over the most that the contact compresses the coat, from 0 to 1e6. Default 1.
    pub bulge_height: f64,
}

// SAFETY: `repr(C)`, the size first, numbers and a pointer that is never followed.
unsafe impl Descriptor for isocoat_body_desc {
    const NAME: &'static str = "isocoat_body_desc";
    const FIRST_SIZE: usize = offset_of!(Self, user_data) + size_of::<*mut c_void>();

    fn defaults() -> Self {
        Self::from(&BodyDesc::default())
    }
}

impl From<&BodyDesc> for isocoat_body_desc {
    fn from(desc: &BodyDesc) -> Self {
        let (mut static_sink, mut contact_frequency, mut damping_ratio) = (0.05, 10.0, 0.0);
        let stiffness_rule = match desc.stiffness {
            StiffnessRule::Scale => ISOCOAT_STIFFNESS_SCALE,
            StiffnessRule::Sink { fraction } => {
                static_sink = fraction;
                ISOCOAT_STIFFNESS_SINK
            }
            StiffnessRule::Frequency { hertz, damping_ratio: ratio } => {
                (contact_frequency, damping_ratio) = (hertz, ratio);
                ISOCOAT_STIFFNESS_FREQUENCY
            }
        };
        Self {
            struct_size: 0,
            kind: if desc.rigid { ISOCOAT_BODY_RIGID } else { ISOCOAT_BODY_DEFORMABLE },
            isovalue: desc.isovalue,
            stiffness_scale: desc.stiffness_scale,
            friction: desc.friction,
            static_friction: desc.static_friction,
            viscous_friction: desc.viscous_friction,
            dissipation: desc.dissipation,
            category: desc.category,
            mask: desc.mask,
            user_data: desc.user_data as *mut c_void,
            response: response_to_c(desc.response),
            stiffness_rule,
            static_sink,
            contact_frequency,
            damping_ratio,
            may_sleep: desc.may_sleep.into(),
            reserved: 0,
            blend_band: desc.blend_band,
            self_contact: desc.self_contact.into(),
            reserved_2: 0,
            volume_gain: desc.volume_gain,
            bulge_width: desc.bulge_width,
            bulge_height: desc.bulge_height,
        }
    }
}

impl isocoat_body_desc {
    fn to_rust(self) -> Checked<BodyDesc> {
        check_reserved(self.reserved)?;
        check_reserved(self.reserved_2)?;
        Ok(BodyDesc {
            rigid: match self.kind {
                ISOCOAT_BODY_DEFORMABLE => false,
                ISOCOAT_BODY_RIGID => true,
                other => return Err(unknown("kind", other, "ISOCOAT_BODY_", 1)),
            },
            isovalue: self.isovalue,
            stiffness_scale: self.stiffness_scale,
            stiffness: match self.stiffness_rule {
                ISOCOAT_STIFFNESS_SCALE => StiffnessRule::Scale,
                ISOCOAT_STIFFNESS_SINK => StiffnessRule::Sink { fraction: self.static_sink },
                ISOCOAT_STIFFNESS_FREQUENCY => {
                    StiffnessRule::Frequency { hertz: self.contact_frequency, damping_ratio: self.damping_ratio }
                }
                other => return Err(unknown("stiffness_rule", other, "ISOCOAT_STIFFNESS_", 2)),
            },
            friction: self.friction,
            static_friction: self.static_friction,
            viscous_friction: self.viscous_friction,
            dissipation: self.dissipation,
            category: self.category,
            mask: self.mask,
            user_data: self.user_data as usize,
            response: response_from_c(self.response)?,
            blend_band: self.blend_band,
            self_contact: flag("self_contact", self.self_contact)?,
            may_sleep: flag("may_sleep", self.may_sleep)?,
            volume_gain: self.volume_gain,
            bulge_width: self.bulge_width,
            bulge_height: self.bulge_height,
        })
    }
}

/// Fills a descriptor with its defaults; isocoat_body_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_body_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_desc_init(desc: *mut isocoat_body_desc, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Creates a body without links.
///
/// - world: not NULL.
/// - desc: what it is made of; not NULL.
/// - body: receives the handle; not NULL.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE, CAPACITY. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_create(
    world: *mut isocoat_world,
    desc: *const isocoat_body_desc,
    body: *mut isocoat_body,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let (desc, out) = (descriptor::read(desc, "desc")?, Out::new(body, "body")?);
            out.put(inner.world.create_body(desc.to_rust()?)?.into());
            Ok(())
        })
    }
}

/// Destroys a body with its links, skeletons and springs.
///
/// - world: not NULL.
/// - body: the body; its handle and those of its links, skeletons and springs are stale afterwards.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_destroy(world: *mut isocoat_world, body: isocoat_body) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.destroy_body(body.into())?)) }
}

/// The stiffness of a body as its descriptor gives it, whichever rule it follows.
///
/// - world: not NULL.
/// - body: the body.
/// - stiffness_scale: receives the pressure a unit of field, in Pa; not NULL.
/// - dissipation: receives the Hunt-Crossley dissipation, in s/m; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_get_stiffness(
    world: *const isocoat_world,
    body: isocoat_body,
    stiffness_scale: *mut f64,
    dissipation: *mut f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let scale_out = Out::new(stiffness_scale, "stiffness_scale")?;
            let dissipation_out = Out::new(dissipation, "dissipation")?;
            let (scale, damping) = inner.world.body_stiffness(body.into())?;
            scale_out.put(scale);
            dissipation_out.put(damping);
            Ok(())
        })
    }
}

/// The descriptor of a body.
///
/// - world: not NULL.
/// - body: the body.
/// - desc: receives it; not NULL, with struct_size set.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_get_desc(
    world: *const isocoat_world,
    body: isocoat_body,
    desc: *mut isocoat_body_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = OutStruct::new(desc, "desc")?;
            out.put(&inner.world.body_desc(body.into())?.into());
            Ok(())
        })
    }
}

/// Changes a body, from the next step on. A new isovalue must suit the profiles of all its skeletons.
///
/// - world: not NULL.
/// - body: the body.
/// - desc: the new descriptor, whole; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_set_desc(
    world: *mut isocoat_world,
    body: isocoat_body,
    desc: *const isocoat_body_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let desc = descriptor::read(desc, "desc")?.to_rust()?;
            Ok(inner.world.set_body_desc(body.into(), desc)?)
        })
    }
}

/// Takes a body out of the simulation, or puts it back. New bodies are enabled.
///
/// - world: not NULL.
/// - body: the body.
/// - enabled: whether it takes part.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_set_enabled(
    world: *mut isocoat_world,
    body: isocoat_body,
    enabled: bool,
) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.set_body_enabled(body.into(), enabled)?)) }
}

/// Whether a body takes part in the simulation.
///
/// - world: not NULL.
/// - body: the body.
/// - enabled: receives the answer; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_is_enabled(
    world: *const isocoat_world,
    body: isocoat_body,
    enabled: *mut bool,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(enabled, "enabled")?;
            out.put(inner.world.body_is_enabled(body.into())?);
            Ok(())
        })
    }
}

/// Whether a body is awake; those that cannot move always are. See isocoat_world_desc::sleep_time.
///
/// - world: not NULL.
/// - body: the body.
/// - awake: receives the answer; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_is_awake(
    world: *const isocoat_world,
    body: isocoat_body,
    awake: *mut bool,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(awake, "awake")?;
            out.put(inner.world.body_is_awake(body.into())?);
            Ok(())
        })
    }
}

/// Wakes a body with all that sleep with it; of one that cannot move, those that lean on it. Touch, and whatever the
/// host changes about a body, wake it by themselves.
///
/// - world: not NULL.
/// - body: the body.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_wake(world: *mut isocoat_world, body: isocoat_body) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.wake_body(body.into())?)) }
}

/// The host's own pointer of a body.
///
/// - world: not NULL.
/// - body: the body.
/// - user_data: receives the pointer; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_get_user_data(
    world: *const isocoat_world,
    body: isocoat_body,
    user_data: *mut *mut c_void,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(user_data, "user_data")?;
            out.put(inner.world.body_desc(body.into())?.user_data as *mut c_void);
            Ok(())
        })
    }
}

/// The links of a body, in the order of their creation.
///
/// - world: not NULL.
/// - body: the body.
/// - links: receives the handles; NULL with capacity 0 asks for the count only.
/// - capacity: handles that links can hold.
/// - count: receives the number of links, also when links is too small; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_get_links(
    world: *const isocoat_world,
    body: isocoat_body,
    links: *mut isocoat_link,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = List::new(links, capacity, "links", count)?;
            let links = || inner.world.body_links(body.into());
            out.put(links()?.count(), links()?.map(isocoat_link::from))
        })
    }
}
