//! Springs: life, descriptors, states.

use std::mem::offset_of;

use libc::{c_void, size_t};

use super::descriptor::{self, Descriptor, OutStruct};
use super::guard::{free, isocoat_world, read, write};
use super::handle::{isocoat_body, isocoat_link, isocoat_spring};
use super::pointer::{self, List, Out};
use super::status::{Refusal, isocoat_status};
use crate::math::Vec3;
use crate::world::{SpringDesc, SpringState};

/// A damped spring between points of two links of one body; a fixed or host-driven link is an anchor. It pulls with
/// stiffness * (length - rest_length) + damping * (rate of lengthening) on both ends, along the line through them. Begin
/// with isocoat_spring_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_spring_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// The links that it joins: two of one body. Default null.
    pub links: [isocoat_link; 2],
    /// Where its ends are, each in the frame of its link, in m, finite; 0 on a point mass. Default 0.
    pub points: [[f64; 3]; 2],
    /// Length without force, in m, from 0 to 1e9; 0 is a spring that pulls its ends together. Default 0.
    pub rest_length: f64,
    /// Force a metre of stretch, in N/m, from 0 to 1e18. Default 0.
    pub stiffness: f64,
    /// Force a metre a second of lengthening, in N s/m, from 0 to 1e18. Default 0.
    pub damping: f64,
    /// The host's own; given back, otherwise unused. Default NULL.
    pub user_data: *mut c_void,
}

// SAFETY: `repr(C)`, the size first, numbers and a pointer that is never followed.
unsafe impl Descriptor for isocoat_spring_desc {
    const NAME: &'static str = "isocoat_spring_desc";
    const FIRST_SIZE: usize = offset_of!(Self, user_data) + size_of::<*mut c_void>();

    fn defaults() -> Self {
        Self::from(&SpringDesc::default())
    }
}

impl From<&SpringDesc> for isocoat_spring_desc {
    fn from(desc: &SpringDesc) -> Self {
        Self {
            struct_size: 0,
            reserved: 0,
            links: desc.links.map(Into::into),
            points: desc.points.map(Into::into),
            rest_length: desc.rest_length,
            stiffness: desc.stiffness,
            damping: desc.damping,
            user_data: desc.user_data as *mut c_void,
        }
    }
}

impl From<isocoat_spring_desc> for SpringDesc {
    fn from(desc: isocoat_spring_desc) -> Self {
        Self {
            links: desc.links.map(Into::into),
            points: desc.points.map(Vec3::from),
            rest_length: desc.rest_length,
            stiffness: desc.stiffness,
            damping: desc.damping,
            user_data: desc.user_data as usize,
        }
    }
}

/// What a spring does at the present poses and velocities of its links.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_spring_state {
    /// Distance of its ends, in m.
    pub length: f64,
    /// How fast that grows, in m/s.
    pub rate: f64,
    /// Pull on its ends, damping included; negative when it pushes them apart; in N.
    pub tension: f64,
    /// Elastic energy, in J.
    pub energy: f64,
}

impl From<SpringState> for isocoat_spring_state {
    fn from(SpringState { length, rate, tension, energy }: SpringState) -> Self {
        Self { length, rate, tension, energy }
    }
}

/// Fills a descriptor with its defaults; isocoat_spring_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_spring_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_spring_desc_init(desc: *mut isocoat_spring_desc, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Creates a spring. A body is solved implicitly, unless another response is asked for, when one of its springs is stiff
/// for the step: stiffness * dt^2 * (1 / mass_a + 1 / mass_b) > 0.09.
///
/// - world: not NULL.
/// - desc: the spring; not NULL.
/// - spring: receives the handle; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (links of two bodies, or one link twice),
/// CAPACITY. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_spring_create(
    world: *mut isocoat_world,
    desc: *const isocoat_spring_desc,
    spring: *mut isocoat_spring,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let (desc, out) = (descriptor::read(desc, "desc")?, Out::new(spring, "spring")?);
            out.put(inner.world.create_spring(desc.into())?.into());
            Ok(())
        })
    }
}

/// Creates many springs: all of them, or none if one is refused.
///
/// - world: not NULL.
/// - descs: count springs in a row, all of the struct_size of the first; not NULL unless count is 0.
/// - count: number of springs.
/// - springs: receives count handles; NULL when they are not wanted.
///
/// Errors: as isocoat_spring_create; the message says which element. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_spring_create_many(
    world: *mut isocoat_world,
    descs: *const isocoat_spring_desc,
    count: size_t,
    springs: *mut isocoat_spring,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let descs = descriptor::read_row(descs, count, "descs")?;
            let out = pointer::slice_mut(springs, count, "springs")?;
            let descs: Vec<_> = descs.into_iter().map(SpringDesc::from).collect();
            for (index, desc) in descs.iter().enumerate() {
                inner.world.check_spring(desc).map_err(|error| Refusal::from(error).at("descs", index))?;
            }
            let made = inner.world.create_springs(&descs)?;
            for (out, made) in out.into_iter().flatten().zip(made) {
                *out = made.into();
            }
            Ok(())
        })
    }
}

/// Destroys a spring. One whose link is destroyed goes with it.
///
/// - world: not NULL.
/// - spring: the spring.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_spring_destroy(world: *mut isocoat_world, spring: isocoat_spring) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.destroy_spring(spring.into())?)) }
}

/// The descriptor of a spring.
///
/// - world: not NULL.
/// - spring: the spring.
/// - desc: receives it; not NULL, with struct_size set.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_spring_get_desc(
    world: *const isocoat_world,
    spring: isocoat_spring,
    desc: *mut isocoat_spring_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = OutStruct::new(desc, "desc")?;
            out.put(&inner.world.spring_desc(spring.into())?.into());
            Ok(())
        })
    }
}

/// Changes a spring, from the next step on. Its links may change within its body.
///
/// - world: not NULL.
/// - spring: the spring.
/// - desc: the new descriptor, whole; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_spring_set_desc(
    world: *mut isocoat_world,
    spring: isocoat_spring,
    desc: *const isocoat_spring_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let desc = descriptor::read(desc, "desc")?.into();
            Ok(inner.world.set_spring_desc(spring.into(), desc)?)
        })
    }
}

/// Length, tension and energy of a spring at the present poses and velocities of its links.
///
/// - world: not NULL.
/// - spring: the spring.
/// - state: receives them; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_spring_get_state(
    world: *const isocoat_world,
    spring: isocoat_spring,
    state: *mut isocoat_spring_state,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(state, "state")?;
            out.put(inner.world.spring_state(spring.into())?.into());
            Ok(())
        })
    }
}

/// The host's own pointer of a spring.
///
/// - world: not NULL.
/// - spring: the spring.
/// - user_data: receives the pointer; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_spring_get_user_data(
    world: *const isocoat_world,
    spring: isocoat_spring,
    user_data: *mut *mut c_void,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(user_data, "user_data")?;
            out.put(inner.world.spring_desc(spring.into())?.user_data as *mut c_void);
            Ok(())
        })
    }
}

/// The springs of a body, in the order of their creation.
///
/// - world: not NULL.
/// - body: the body.
/// - springs: receives the handles; NULL with capacity 0 asks for the count only.
/// - capacity: handles that springs can hold.
/// - count: receives the number of springs, also when springs is too small; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_get_springs(
    world: *const isocoat_world,
    body: isocoat_body,
    springs: *mut isocoat_spring,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = List::new(springs, capacity, "springs", count)?;
            let springs = || inner.world.body_springs(body.into());
            out.put(springs()?.count(), springs()?.map(isocoat_spring::from))
        })
    }
}
