//! Articulations: how links on joints of the host move each other.

use libc::size_t;

use super::guard::{isocoat_world, write};
use super::handle::isocoat_link;
use super::pointer::{self, Array};
use super::status::{Refusal, isocoat_status};
use crate::world::articulations::check_count;
use crate::world::{Articulation, LinkId};

/// Says which host-driven links move each other through the host's joints, and how, in place of all that was said
/// before. The implicit response then solves the contacts of these links together: links on joints may touch
/// anything, several at once, without an estimate of what holds them. Other responses take each link by itself, with
/// its own mass or inverse_effective_inertia.
///
/// Give it before a step wherever links on joints touch; only those that touch need be named. What the joints do by
/// themselves belongs in isocoat_link_set_external_acceleration. After the step the host passes each impulse on
/// through its joints: bodies must move as the matrix says.
///
/// It holds until it is said again, or until a link is destroyed, changes its kind or loses its mass, which ends its
/// articulation. Snapshots keep it.
///
/// - world: not NULL.
/// - links: all links, articulation after articulation: host-driven, with a mass, each once; not NULL unless count
///   is 0.
/// - link_counts: number of links of each articulation, from 1 to 256; not NULL unless count is 0.
/// - inverse_inertias: the matrices, one after the other: 6n rows of 6n numbers for n links, from impulses on all
///   links, about their centres of mass, to the changes of their velocities, in the world; for each link first the
///   linear part, then the angular one. Symmetric and positive definite; with joint inertia H and Jacobians J of the
///   links it is J H^-1 J^T, plus a millionth of the bodies' own inverse inertia where that is singular. Not NULL
///   unless count is 0; aligned as double.
/// - count: number of articulations; 0 ends all.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (a link that is not host-driven, has no mass,
/// or is named twice); nothing is changed then. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_set_articulations(
    world: *mut isocoat_world,
    links: *const isocoat_link,
    link_counts: *const size_t,
    inverse_inertias: *const f64,
    count: size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let counts: Vec<usize> = Array::new(link_counts, count, "link_counts")?.iter().collect();
            for (index, count) in counts.iter().enumerate() {
                check_count(*count).map_err(|error| Refusal::from(error).at("articulations", index))?;
            }
            let sum = |(links, numbers), count: &usize| (links + count, numbers + 36 * count * count);
            let (all_links, all_numbers) = counts.iter().fold((0, 0), sum);
            let links: Vec<LinkId> = Array::new(links, all_links, "links")?.iter().map(Into::into).collect();
            let numbers = pointer::slice(inverse_inertias, all_numbers, "inverse_inertias")?;
            let (mut links, mut numbers) = (&links[..], numbers);
            let mut articulations = Vec::with_capacity(counts.len());
            for count in counts {
                let (own_links, other_links) = links.split_at(count);
                let (own_numbers, other_numbers) = numbers.split_at(36 * count * count);
                articulations.push(Articulation { links: own_links, inverse_inertia: own_numbers });
                (links, numbers) = (other_links, other_numbers);
            }
            let done = inner.world.try_set_articulations(&articulations);
            done.map_err(|(index, error)| Refusal::from(error).at("articulations", index))
        })
    }
}
