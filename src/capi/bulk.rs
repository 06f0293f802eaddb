//! Bulk calls: what hosts do for all their links in every tick.

use libc::size_t;

use super::buffer::{Elements, isocoat_buffer};
use super::guard::{isocoat_world, read, write};
use super::handle::isocoat_link;
use super::motion::isocoat_link_state;
use super::pointer::Array;
use super::status::{Checked, Refusal, isocoat_status};
use crate::error::Error;
use crate::math::Wrench;
use crate::world::{LinkId, LinkState, World};

/// Sets the states of many links, as isocoat_link_set_state does: all of them, or none if one is refused.
///
/// - world: not NULL.
/// - links: count handles; not NULL unless count is 0. Of a link that is named twice, the last state holds.
/// - states: count states; not NULL unless count is 0.
/// - count: number of links.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE; the message says which element. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_set_link_states(
    world: *mut isocoat_world,
    links: *const isocoat_link,
    states: *const isocoat_link_state,
    count: size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let (links, states) = (Array::new(links, count, "links")?, Array::new(states, count, "states")?);
            for (index, (link, state)) in links.iter().zip(states.iter()).enumerate() {
                let state = LinkState::from(state);
                inner.world.link_state(link.into()).map_err(|error| Refusal::from(error).at("links", index))?;
                state.validate().map_err(|error| Refusal::from(error).at("states", index))?;
            }
            for (link, state) in links.iter().zip(states.iter()) {
                inner.world.set_link_state(link.into(), &state.into())?;
            }
            Ok(())
        })
    }
}

/// Reads something of every link: all handles are checked before the first element is written.
fn for_each_link(
    links: Array<isocoat_link>,
    world: &World,
    mut each: impl FnMut(usize, LinkId) -> Result<(), Error>,
) -> Checked<()> {
    for (index, link) in links.iter().enumerate() {
        world.link_state(link.into()).map_err(|error| Refusal::from(error).at("links", index))?;
    }
    for (index, link) in links.iter().enumerate() {
        each(index, link.into())?;
    }
    Ok(())
}

/// Positions and orientations of many links.
///
/// - world: not NULL.
/// - links: count handles; not NULL unless count is 0.
/// - count: number of links.
/// - positions: receives 3 numbers a link, in m; skipped if its data is NULL.
/// - orientations: receives 4 numbers a link, a quaternion x, y, z, w; skipped if its data is NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT; nothing is written then. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_link_states(
    world: *const isocoat_world,
    links: *const isocoat_link,
    count: size_t,
    positions: isocoat_buffer,
    orientations: isocoat_buffer,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let links = Array::new(links, count, "links")?;
            let positions = Elements::<3>::new(positions, "positions")?;
            let orientations = Elements::<4>::new(orientations, "orientations")?;
            for_each_link(links, &inner.world, |index, link| {
                let pose = inner.world.link_state(link)?.pose;
                positions.put(index, pose.position.into());
                orientations.put(index, pose.rotation.coords.into());
                Ok(())
            })
        })
    }
}

/// What the two bulk calls about contact share.
///
/// # Safety
/// The pointers are NULL or as the lines of those calls say.
unsafe fn get_wrenches(
    world: *const isocoat_world,
    links: *const isocoat_link,
    count: size_t,
    linear: isocoat_buffer,
    angular: isocoat_buffer,
    get: fn(&World, LinkId) -> Result<Wrench, Error>,
) -> isocoat_status {
    // SAFETY: the caller's promise.
    unsafe {
        read(world, |inner| {
            let links = Array::new(links, count, "links")?;
            let linear = Elements::<3>::new(linear, "linear")?;
            let angular = Elements::<3>::new(angular, "angular")?;
            for_each_link(links, &inner.world, |index, link| {
                let wrench = get(&inner.world, link)?;
                linear.put(index, wrench.force.into());
                angular.put(index, wrench.torque.into());
                Ok(())
            })
        })
    }
}

/// Mean forces and torques of contacts and springs on many links over the last step, as isocoat_link_get_wrench gives
/// them.
///
/// - world: not NULL.
/// - links: count handles; not NULL unless count is 0.
/// - count: number of links.
/// - linear: receives 3 numbers a link, the force in N; skipped if its data is NULL.
/// - angular: receives 3 numbers a link, the torque about the centre of mass in N m; skipped if its data is NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT; nothing is written then. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_link_wrenches(
    world: *const isocoat_world,
    links: *const isocoat_link,
    count: size_t,
    linear: isocoat_buffer,
    angular: isocoat_buffer,
) -> isocoat_status {
    // SAFETY: as the lines of the parameters say.
    unsafe { get_wrenches(world, links, count, linear, angular, World::link_wrench) }
}

/// The impulses that the host is to apply to many host-driven links, as isocoat_link_get_impulse gives them.
///
/// - world: not NULL.
/// - links: count handles; not NULL unless count is 0.
/// - count: number of links.
/// - linear: receives 3 numbers a link, the impulse in N s; skipped if its data is NULL.
/// - angular: receives 3 numbers a link, the angular impulse in N m s; skipped if its data is NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT; nothing is written then. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_link_impulses(
    world: *const isocoat_world,
    links: *const isocoat_link,
    count: size_t,
    linear: isocoat_buffer,
    angular: isocoat_buffer,
) -> isocoat_status {
    // SAFETY: as the lines of the parameters say.
    unsafe { get_wrenches(world, links, count, linear, angular, World::link_impulse) }
}
