//! Motion of single links: states, forces, and what contact did to them.

use super::guard::{isocoat_world, read, write};
use super::handle::isocoat_link;
use super::math::{isocoat_pose, isocoat_wrench};
use super::pointer::{self, Out, read_vector};
use super::status::isocoat_status;
use crate::math::Twist;
use crate::world::LinkState;

/// Position, orientation and velocities of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct isocoat_link_state {
    /// The link's frame in the world.
    pub pose: isocoat_pose,
    /// Velocity of the centre of mass in the world, in m/s, finite.
    pub linear_velocity: [f64; 3],
    /// Angular velocity in the world, in rad/s, finite.
    pub angular_velocity: [f64; 3],
}

impl From<LinkState> for isocoat_link_state {
    fn from(state: LinkState) -> Self {
        Self {
            pose: (&state.pose).into(),
            linear_velocity: state.twist.linear.into(),
            angular_velocity: state.twist.angular.into(),
        }
    }
}

impl From<isocoat_link_state> for LinkState {
    fn from(state: isocoat_link_state) -> Self {
        let twist = Twist { linear: state.linear_velocity.into(), angular: state.angular_velocity.into() };
        Self { pose: (&state.pose).into(), twist }
    }
}

/// The state of a link.
///
/// - world: not NULL.
/// - link: the link.
/// - state: receives it; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_get_state(
    world: *const isocoat_world,
    link: isocoat_link,
    state: *mut isocoat_link_state,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(state, "state")?;
            out.put(inner.world.link_state(link.into())?.into());
            Ok(())
        })
    }
}

/// Sets the state of a link: every tick for a host-driven one, before the step. What differs from what the last
/// impulse commanded counts as the host's own push; a jump of more than half the thinnest coat counts as a teleport.
///
/// - world: not NULL.
/// - link: the link.
/// - state: the state; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: changes the world.
/// For many links at once see isocoat_world_set_link_states.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_set_state(
    world: *mut isocoat_world,
    link: isocoat_link,
    state: *const isocoat_link_state,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let state = pointer::read(state, "state")?.into();
            Ok(inner.world.set_link_state(link.into(), &state)?)
        })
    }
}

/// Sets the state of a link and forgets its contact history: after a respawn or a restored game.
///
/// - world: not NULL.
/// - link: the link.
/// - state: the state; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_teleport(
    world: *mut isocoat_world,
    link: isocoat_link,
    state: *const isocoat_link_state,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let state = pointer::read(state, "state")?.into();
            Ok(inner.world.teleport_link(link.into(), &state)?)
        })
    }
}

/// Mean force and torque of contacts and springs on a link over the last step, about its centre of mass; 0 before the
/// first step. Over a body without anchors those of its springs add up to nothing.
///
/// - world: not NULL.
/// - link: the link, of any kind.
/// - wrench: receives it, in N and N m; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_get_wrench(
    world: *const isocoat_world,
    link: isocoat_link,
    wrench: *mut isocoat_wrench,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(wrench, "wrench")?;
            out.put(inner.world.link_wrench(link.into())?.into());
            Ok(())
        })
    }
}

/// The impulse and angular impulse that the host is to apply at the centre of mass of a host-driven link, before it
/// advances it by the length of the last step. The host's own tick is then: set states, step, apply impulses, advance.
///
/// - world: not NULL.
/// - link: the link; 0 for kinematic links and those that the library integrates.
/// - impulse: receives it, in N s and N m s; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
/// For many links at once see isocoat_world_get_link_impulses.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_get_impulse(
    world: *const isocoat_world,
    link: isocoat_link,
    impulse: *mut isocoat_wrench,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(impulse, "impulse")?;
            out.put(inner.world.link_impulse(link.into())?.into());
            Ok(())
        })
    }
}

/// Adds a force for the coming step only.
///
/// - world: not NULL.
/// - link: a link that the library integrates (ISOCOAT_LINK_POINT_MASS, ISOCOAT_LINK_RIGID).
/// - force: 3 doubles, in N, in the world, finite; not NULL.
/// - point: 3 doubles, where it acts in the world, in m, finite; NULL for the centre of mass.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED for other links: the host pushes its own bodies
/// itself. Threads: changes the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[force;3], [point;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_apply_force(
    world: *mut isocoat_world,
    link: isocoat_link,
    force: *const f64,
    point: *const f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let force = read_vector(force, "force")?;
            let point = if point.is_null() { None } else { Some(read_vector(point, "point")?) };
            Ok(inner.world.apply_force(link.into(), &force, point.as_ref())?)
        })
    }
}

/// Adds a torque for the coming step only.
///
/// - world: not NULL.
/// - link: a link that the library integrates.
/// - torque: 3 doubles, in N m, in the world, finite; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[torque;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_apply_torque(
    world: *mut isocoat_world,
    link: isocoat_link,
    torque: *const f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe { write(world, |inner| Ok(inner.world.apply_torque(link.into(), &read_vector(torque, "torque")?)?)) }
}

/// Adds an impulse at the start of the coming step.
///
/// - world: not NULL.
/// - link: a link that the library integrates.
/// - impulse: 3 doubles, in N s, in the world, finite; not NULL.
/// - point: 3 doubles, where it acts in the world, in m, finite; NULL for the centre of mass.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[impulse;3], [point;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_apply_impulse(
    world: *mut isocoat_world,
    link: isocoat_link,
    impulse: *const f64,
    point: *const f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let impulse = read_vector(impulse, "impulse")?;
            let point = if point.is_null() { None } else { Some(read_vector(point, "point")?) };
            Ok(inner.world.apply_impulse(link.into(), &impulse, point.as_ref())?)
        })
    }
}

/// Adds an angular impulse at the start of the coming step.
///
/// - world: not NULL.
/// - link: a link that the library integrates.
/// - impulse: 3 doubles, in N m s, in the world, finite; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[impulse;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_apply_angular_impulse(
    world: *mut isocoat_world,
    link: isocoat_link,
    impulse: *const f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| Ok(inner.world.apply_angular_impulse(link.into(), &read_vector(impulse, "impulse")?)?))
    }
}

/// Says whether joints or contacts of its host's own act on a host-driven link in this tick: the flag
/// ISOCOAT_LINK_CONSTRAINED, cheap enough for every tick. Does nothing to links of other kinds.
///
/// - world: not NULL.
/// - link: the link.
/// - constrained: 0 for no, anything else for yes.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_set_constrained(
    world: *mut isocoat_world,
    link: isocoat_link,
    constrained: u32,
) -> isocoat_status {
    // SAFETY: NULL or a live world.
    unsafe { write(world, |inner| Ok(inner.world.set_constrained(link.into(), constrained != 0)?)) }
}

/// Sets the accelerations of a link besides gravity and contact, until they are set again: for a host-driven link, what
/// the host adds by itself in a tick besides gravity_scale times the world's gravity.
///
/// - world: not NULL.
/// - link: the link.
/// - linear: 3 doubles, in m/s^2, in the world, finite; not NULL.
/// - angular: 3 doubles, in rad/s^2, in the world, finite; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: changes the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[linear;3], [angular;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_link_set_external_acceleration(
    world: *mut isocoat_world,
    link: isocoat_link,
    linear: *const f64,
    angular: *const f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let (linear, angular) = (read_vector(linear, "linear")?, read_vector(angular, "angular")?);
            Ok(inner.world.set_external_acceleration(link.into(), &linear, &angular)?)
        })
    }
}
