//! Links: life, descriptors, skeletons.

use std::mem::offset_of;

use libc::{c_void, size_t};

use super::descriptor::{self, Descriptor, OutStruct};
use super::guard::{free, isocoat_world, read, write};
use super::handle::{isocoat_body, isocoat_link, isocoat_skeleton};
use super::math::isocoat_pose;
use super::pointer::{List, Out};
use super::status::{Checked, Refusal, isocoat_status};
use super::world::unknown;
use crate::base::Kind;
use crate::math::{Mat3, Twist};
use crate::world::{LinkDesc, VelocityConvention};

/// Who moves a link: an ISOCOAT_LINK_ value.
pub type isocoat_link_kind = u32;
/// Nobody: it stays where it is put. Mass and inertia are ignored.
pub const ISOCOAT_LINK_FIXED: isocoat_link_kind = 0;
/// The host sets pose and velocity every tick. With a mass, it is given impulses to apply; without, it is kinematic.
pub const ISOCOAT_LINK_HOST: isocoat_link_kind = 1;
/// The library: a mass that moves but does not turn.
pub const ISOCOAT_LINK_POINT_MASS: isocoat_link_kind = 2;
/// The library: a rigid solid with an inertia tensor.
pub const ISOCOAT_LINK_RIGID: isocoat_link_kind = 3;

/// In which moment of a tick a host's velocities live: an ISOCOAT_VELOCITY_ value.
pub type isocoat_velocity_convention = u32;
/// Semi-implicit Euler, as Bullet: v += a dt, then x += v dt. Velocities lag half a tick behind positions.
pub const ISOCOAT_VELOCITY_LEAPFROG: isocoat_velocity_convention = 0;
/// Velocities belong to the same moment as the positions: x += v dt + a dt^2/2, then v += a dt.
pub const ISOCOAT_VELOCITY_SYNCHRONOUS: isocoat_velocity_convention = 1;

/// Properties of a host-driven link: ISOCOAT_LINK_ flags, added up.
pub type isocoat_link_flags = u32;
/// The host itself applies the gyroscopic torque.
pub const ISOCOAT_LINK_HOST_GYROSCOPIC: isocoat_link_flags = 1;
/// Joints or contacts of the host act on the link in this tick, so that it does not move as its own mass would. The
/// automatic response is implicit then, as it is for links of an articulation; without one and without
/// inverse_effective_inertia, what holds it is estimated.
pub const ISOCOAT_LINK_CONSTRAINED: isocoat_link_flags = 2;
/// The field inverse_effective_inertia is given.
pub const ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA: isocoat_link_flags = 4;

const ALL_FLAGS: isocoat_link_flags =
    ISOCOAT_LINK_HOST_GYROSCOPIC | ISOCOAT_LINK_CONSTRAINED | ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA;

/// One moving frame of a body. Begin with isocoat_link_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_link_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// Who moves it. Default ISOCOAT_LINK_FIXED.
    pub kind: isocoat_link_kind,
    /// The link's frame in the world. Default the world's frame.
    pub pose: isocoat_pose,
    /// Velocity of the centre of mass in the world, in m/s, finite. Default 0.
    pub linear_velocity: [f64; 3],
    /// Angular velocity in the world, in rad/s, finite. Default 0.
    pub angular_velocity: [f64; 3],
    /// Mass, in kg: > 0 for point masses and rigid solids, at least 0 for host-driven links (0 is kinematic); ignored
    /// for fixed ones. Default 0.
    pub mass: f64,
    /// Centre of mass in the link's frame, in m, finite; 0 for a point mass. Default 0.
    pub local_center_of_mass: [f64; 3],
    /// Inertia tensor about the centre of mass in the axes of the link's frame, row by row, in kg m^2: symmetric,
    /// positive definite, no principal moment above the sum of the other two. For rigid solids and for host-driven
    /// links with a mass; ignored otherwise. Default 0. See isocoat_inertia_of_sphere and its like.
    pub inertia: [f64; 9],
    /// Factor on the world's gravity, finite. Default 1.
    pub gravity_scale: f64,
    /// Acceleration besides gravity and contact, in the world, in m/s^2, finite. Default 0.
    pub external_acceleration: [f64; 3],
    /// Angular acceleration besides contact and gyroscopic terms, in the world, in rad/s^2, finite. Default 0.
    pub external_angular_acceleration: [f64; 3],
    /// Host-driven links: which moment the host's velocities belong to. Default ISOCOAT_VELOCITY_LEAPFROG.
    pub velocity_convention: isocoat_velocity_convention,
    /// Host-driven links: ISOCOAT_LINK_ flags, added up. Default 0.
    pub flags: isocoat_link_flags,
    /// Host-driven links that joints hold: the 6x6 matrix from wrench at the centre of mass (force, torque) to
    /// acceleration (linear, angular), in the world, row by row; symmetric and positive definite. Read only with
    /// ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA in flags. Where several links of the same joints touch, see
    /// isocoat_world_set_articulations. Default 0.
    pub inverse_effective_inertia: [f64; 36],
    /// The host's own; given back, otherwise unused. Default NULL.
    pub user_data: *mut c_void,
}

// SAFETY: `repr(C)`, the size first, numbers and a pointer that is never followed.
unsafe impl Descriptor for isocoat_link_desc {
    const NAME: &'static str = "isocoat_link_desc";
    const FIRST_SIZE: usize = offset_of!(Self, user_data) + size_of::<*mut c_void>();

    fn defaults() -> Self {
        Self::from(&LinkDesc::default())
    }
}

impl From<&LinkDesc> for isocoat_link_desc {
    fn from(desc: &LinkDesc) -> Self {
        let mut inverse_effective_inertia = [0.0; 36];
        let mut flags = 0;
        if desc.host_gyroscopic {
            flags |= ISOCOAT_LINK_HOST_GYROSCOPIC;
        }
        if desc.constrained {
            flags |= ISOCOAT_LINK_CONSTRAINED;
        }
        if let Some(matrix) = &desc.inverse_effective_inertia {
            flags |= ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA;
            inverse_effective_inertia.copy_from_slice(matrix.transpose().as_slice());
        }
        let mut inertia = [0.0; 9];
        inertia.copy_from_slice(desc.inertia.transpose().as_slice());
        Self {
            struct_size: 0,
            kind: match desc.kind {
                Kind::Fixed => ISOCOAT_LINK_FIXED,
                Kind::Host => ISOCOAT_LINK_HOST,
                Kind::PointMass => ISOCOAT_LINK_POINT_MASS,
                Kind::Rigid => ISOCOAT_LINK_RIGID,
            },
            pose: (&desc.pose).into(),
            linear_velocity: desc.twist.linear.into(),
            angular_velocity: desc.twist.angular.into(),
            mass: desc.mass,
            local_center_of_mass: desc.local_center.into(),
            inertia,
            gravity_scale: desc.gravity_scale,
            external_acceleration: desc.external_acceleration.into(),
            external_angular_acceleration: desc.external_angular_acceleration.into(),
            velocity_convention: match desc.velocity_convention {
                VelocityConvention::Leapfrog => ISOCOAT_VELOCITY_LEAPFROG,
                VelocityConvention::Synchronous => ISOCOAT_VELOCITY_SYNCHRONOUS,
            },
            flags,
            inverse_effective_inertia,
            user_data: desc.user_data as *mut c_void,
        }
    }
}

impl isocoat_link_desc {
    fn to_rust(self) -> Checked<LinkDesc> {
        if self.flags & !ALL_FLAGS != 0 {
            let message =
                format!("flags is {:#x}; must be a sum of ISOCOAT_LINK_ flags, at most {ALL_FLAGS:#x}", self.flags);
            return Err(Refusal::argument(message));
        }
        let has = |flag| self.flags & flag != 0;
        Ok(LinkDesc {
            kind: match self.kind {
                ISOCOAT_LINK_FIXED => Kind::Fixed,
                ISOCOAT_LINK_HOST => Kind::Host,
                ISOCOAT_LINK_POINT_MASS => Kind::PointMass,
                ISOCOAT_LINK_RIGID => Kind::Rigid,
                other => return Err(unknown("kind", other, "ISOCOAT_LINK_", 3)),
            },
            pose: (&self.pose).into(),
            twist: Twist { linear: self.linear_velocity.into(), angular: self.angular_velocity.into() },
            mass: self.mass,
            local_center: self.local_center_of_mass.into(),
            inertia: Mat3::from_row_slice(&self.inertia),
            gravity_scale: self.gravity_scale,
            external_acceleration: self.external_acceleration.into(),
            external_angular_acceleration: self.external_angular_acceleration.into(),
            velocity_convention: match self.velocity_convention {
                ISOCOAT_VELOCITY_LEAPFROG => VelocityConvention::Leapfrog,
                ISOCOAT_VELOCITY_SYNCHRONOUS => VelocityConvention::Synchronous,
                other => return Err(unknown("velocity_convention", other, "ISOCOAT_VELOCITY_", 1)),
            },
            host_gyroscopic: has(ISOCOAT_LINK_HOST_GYROSCOPIC),
            constrained: has(ISOCOAT_LINK_CONSTRAINED),
            inverse_effective_inertia: has(ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA)
                .then(|| Box::new(nalgebra::Matrix6::from_row_slice(&self.inverse_effective_inertia))),
            user_data: self.user_data as usize,
        })
    }
}

/// Fills a descriptor with its defaults; isocoat_link_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_link_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_desc_init(desc: *mut isocoat_link_desc, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Creates a link of a body, without skeletons.
///
/// - world: not NULL.
/// - body: the body it belongs to.
/// - desc: the link; not NULL.
/// - link: receives the handle; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, CAPACITY. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_create(
    world: *mut isocoat_world,
    body: isocoat_body,
    desc: *const isocoat_link_desc,
    link: *mut isocoat_link,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let (desc, out) = (descriptor::read(desc, "desc")?, Out::new(link, "link")?);
            out.put(inner.world.create_link(body.into(), desc.to_rust()?)?.into());
            Ok(())
        })
    }
}

/// Destroys a link with its skeletons and springs.
///
/// - world: not NULL.
/// - link: the link; its handle and those of its skeletons and springs are stale afterwards.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_destroy(world: *mut isocoat_world, link: isocoat_link) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.destroy_link(link.into())?)) }
}

/// The descriptor of a link, with its present pose and velocities.
///
/// - world: not NULL.
/// - link: the link.
/// - desc: receives it; not NULL, with struct_size set.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_get_desc(
    world: *const isocoat_world,
    link: isocoat_link,
    desc: *mut isocoat_link_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = OutStruct::new(desc, "desc")?;
            out.put(&inner.world.link_desc(link.into())?.into());
            Ok(())
        })
    }
}

/// Changes a link, its pose and velocities included.
///
/// - world: not NULL.
/// - link: the link.
/// - desc: the new descriptor, whole; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_set_desc(
    world: *mut isocoat_world,
    link: isocoat_link,
    desc: *const isocoat_link_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let desc = descriptor::read(desc, "desc")?.to_rust()?;
            Ok(inner.world.set_link_desc(link.into(), desc)?)
        })
    }
}

/// Takes a link with its skeletons and springs out of the simulation, or puts them back. New links are enabled.
///
/// - world: not NULL.
/// - link: the link.
/// - enabled: whether it takes part.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_set_enabled(
    world: *mut isocoat_world,
    link: isocoat_link,
    enabled: bool,
) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.set_link_enabled(link.into(), enabled)?)) }
}

/// Whether a link takes part in the simulation. The links of a disabled body keep their own answer.
///
/// - world: not NULL.
/// - link: the link.
/// - enabled: receives the answer; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_is_enabled(
    world: *const isocoat_world,
    link: isocoat_link,
    enabled: *mut bool,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(enabled, "enabled")?;
            out.put(inner.world.link_is_enabled(link.into())?);
            Ok(())
        })
    }
}

/// The host's own pointer of a link.
///
/// - world: not NULL.
/// - link: the link.
/// - user_data: receives the pointer; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_get_user_data(
    world: *const isocoat_world,
    link: isocoat_link,
    user_data: *mut *mut c_void,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(user_data, "user_data")?;
            out.put(inner.world.link_desc(link.into())?.user_data as *mut c_void);
            Ok(())
        })
    }
}

/// The body of a link.
///
/// - world: not NULL.
/// - link: the link.
/// - body: receives the handle; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_get_body(
    world: *const isocoat_world,
    link: isocoat_link,
    body: *mut isocoat_body,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(body, "body")?;
            out.put(inner.world.link_body(link.into())?.into());
            Ok(())
        })
    }
}

/// The skeletons of a link, in the order of their creation.
///
/// - world: not NULL.
/// - link: the link.
/// - skeletons: receives the handles; NULL with capacity 0 asks for the count only.
/// - capacity: handles that skeletons can hold.
/// - count: receives the number of skeletons, also when skeletons is too small; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_get_skeletons(
    world: *const isocoat_world,
    link: isocoat_link,
    skeletons: *mut isocoat_skeleton,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = List::new(skeletons, capacity, "skeletons", count)?;
            let skeletons = || inner.world.link_skeletons(link.into());
            out.put(skeletons()?.count(), skeletons()?.map(isocoat_skeleton::from))
        })
    }
}
