//! Many rays in one call.

use std::mem::offset_of;
use std::ptr;

use libc::size_t;

use super::buffer::{Elements, ISOCOAT_FORMAT_F64, Source, isocoat_buffer, isocoat_const_buffer};
use super::descriptor::{self, Descriptor};
use super::guard::{free, isocoat_world, read};
use super::handle::{isocoat_body, isocoat_link, isocoat_skeleton};
use super::pointer::Row;
use super::query::{ISOCOAT_DEFORMATION_NONE, deformation_from_c, isocoat_deformation};
use super::status::{Checked, Refusal, isocoat_status};
use super::world::unknown;
use crate::world::rays::{Ray, RayGoal, RaysDesc};

/// Which hit of a ray is wanted: an ISOCOAT_RAY_ value.
pub type isocoat_ray_goal = u32;
/// The first along the ray.
pub const ISOCOAT_RAY_CLOSEST: isocoat_ray_goal = 0;
/// That of any body, which is cheaper where many are in the way: enough to see whether something is.
pub const ISOCOAT_RAY_ANY: isocoat_ray_goal = 1;

/// What many rays have in common. Begin with isocoat_rays_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_rays_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// Which shapes they meet, an ISOCOAT_DEFORMATION_ value. Default ISOCOAT_DEFORMATION_NONE.
    pub deformation: isocoat_deformation,
    /// Which hits are wanted, an ISOCOAT_RAY_ value. Default ISOCOAT_RAY_CLOSEST.
    pub goal: isocoat_ray_goal,
    /// Must be 0.
    pub reserved: u32,
    /// Bodies whose category has a bit of it are looked at. Default all.
    pub mask: u64,
    /// Length of all rays in m, at least 0; may be infinite. Default infinite.
    pub max_distance: f64,
}

// SAFETY: `repr(C)`, the size first, integers and a number.
unsafe impl Descriptor for isocoat_rays_desc {
    const NAME: &'static str = "isocoat_rays_desc";
    const FIRST_SIZE: usize = offset_of!(Self, max_distance) + size_of::<f64>();

    fn defaults() -> Self {
        Self {
            struct_size: 0,
            deformation: ISOCOAT_DEFORMATION_NONE,
            goal: ISOCOAT_RAY_CLOSEST,
            reserved: 0,
            mask: u64::MAX,
            max_distance: f64::INFINITY,
        }
    }
}

/// Where the hits of many rays go: one element a ray. Of a ray that meets nothing, the distance is infinite, position
/// and normal are 0, and the handles are null. Begin with isocoat_ray_hits_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_ray_hits {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// Must be 0.
    pub reserved: u32,
    /// Receives a number a ray: its length up to the hit, in m. Default: skipped, as its data is NULL.
    pub distances: isocoat_buffer,
    /// Receives 3 numbers a ray, in m. Default: skipped, as its data is NULL.
    pub positions: isocoat_buffer,
    /// Receives 3 numbers a ray: the outward unit normal of the coat. Default: skipped, as its data is NULL.
    pub normals: isocoat_buffer,
    /// Receives the body of each hit. Default NULL: not wanted.
    pub bodies: *mut isocoat_body,
    /// Receives the link that carries the skeleton; null on a substance. Default NULL: not wanted.
    pub links: *mut isocoat_link,
    /// Receives the skeleton in whose territory the hit lies; null on a substance. Default NULL: not wanted.
    pub skeletons: *mut isocoat_skeleton,
}

// SAFETY: `repr(C)`, the size first; of pointers, integers and numbers every bit pattern is a value.
unsafe impl Descriptor for isocoat_ray_hits {
    const NAME: &'static str = "isocoat_ray_hits";
    const FIRST_SIZE: usize = offset_of!(Self, skeletons) + size_of::<*mut isocoat_skeleton>();

    fn defaults() -> Self {
        let none = isocoat_buffer { data: ptr::null_mut(), stride: 0, format: ISOCOAT_FORMAT_F64 };
        Self {
            struct_size: 0,
            reserved: 0,
            distances: none,
            positions: none,
            normals: none,
            bodies: ptr::null_mut(),
            links: ptr::null_mut(),
            skeletons: ptr::null_mut(),
        }
    }
}

/// Fills a descriptor with its defaults; isocoat_rays_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_rays_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_rays_desc_init(desc: *mut isocoat_rays_desc, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Fills a struct with its defaults; isocoat_ray_hits_default() calls it.
///
/// - hits: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_ray_hits) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_ray_hits_init(hits: *mut isocoat_ray_hits, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(hits, size, "hits") })
}

/// What each of many rays meets, as isocoat_world_cast_ray_deformed() finds it. The coats are made ready once for all
/// rays of a call, and each ray then looks only at the skeletons near it: a picture of 512 x 512 rays in one call is
/// many times faster than in single ones. Memory is asked for once a call, none for each ray.
///
/// - world: not NULL.
/// - desc: what the rays have in common; not NULL.
/// - origins: 3 numbers a ray, in m, finite; its data not NULL unless count is 0.
/// - directions: 3 numbers a ray, of any length but 0, finite; its data not NULL unless count is 0.
/// - max_distances: a number a ray, in m, at least 0, may be infinite; if its data is NULL, the desc's holds for all.
/// - count: number of rays.
/// - hits: where the results go; not NULL. They must not overlap what is read.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE, with the number of the ray; nothing is written then. Threads: reads the
/// world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_cast_rays(
    world: *const isocoat_world,
    desc: *const isocoat_rays_desc,
    origins: isocoat_const_buffer,
    directions: isocoat_const_buffer,
    max_distances: isocoat_const_buffer,
    count: size_t,
    hits: *const isocoat_ray_hits,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let desc = descriptor::read(desc, "desc")?;
            let shared = desc_from_c(&desc)?;
            let origins = Source::<3>::required(origins, count, "origins")?;
            let directions = Source::<3>::required(directions, count, "directions")?;
            let max_distances = Source::<1>::new(max_distances, count, "max_distances")?;
            let hits = descriptor::read(hits, "hits")?;
            must_be_zero("hits.reserved", hits.reserved)?;
            let distances = Elements::<1>::new(hits.distances, "hits.distances")?;
            let positions = Elements::<3>::new(hits.positions, "hits.positions")?;
            let normals = Elements::<3>::new(hits.normals, "hits.normals")?;
            let bodies = Row::new(hits.bodies);
            let links = Row::new(hits.links);
            let skeletons = Row::new(hits.skeletons);
            let rays = origins.iter().zip(directions.iter()).enumerate().map(|(index, (origin, direction))| Ray {
                origin: origin.into(),
                direction: direction.into(),
                max_distance: if max_distances.is_given() { max_distances.get(index)[0] } else { desc.max_distance },
            });
            let cast = inner.world.cast_rays(rays, &shared, |index, hit| {
                distances.put(index, [hit.map_or(f64::INFINITY, |hit| hit.distance)]);
                positions.put(index, hit.map_or([0.0; 3], |hit| hit.position.into()));
                normals.put(index, hit.map_or([0.0; 3], |hit| hit.normal.into()));
                bodies.put(index, hit.map_or(Default::default(), |hit| hit.body.into()));
                links.put(index, hit.map_or(Default::default(), |hit| hit.link.into()));
                skeletons.put(index, hit.map_or(Default::default(), |hit| hit.skeleton.into()));
            });
            cast.map_err(|(index, error)| Refusal::from(error).at("rays", index))
        })
    }
}

fn desc_from_c(desc: &isocoat_rays_desc) -> Checked<RaysDesc> {
    must_be_zero("desc.reserved", desc.reserved)?;
    let goal = match desc.goal {
        ISOCOAT_RAY_CLOSEST => RayGoal::Closest,
        ISOCOAT_RAY_ANY => RayGoal::Any,
        other => return Err(unknown("goal", other, "ISOCOAT_RAY_", 1)),
    };
    Ok(RaysDesc { goal, deformation: deformation_from_c(desc.deformation)?, mask: desc.mask })
}

fn must_be_zero(name: &str, value: u32) -> Checked<()> {
    if value == 0 { Ok(()) } else { Err(Refusal::argument(format!("{name} is {value}; must be 0"))) }
}
