//! Questions between steps: fields, contacts of a pair, rays, overlaps, closest points, seeds.

use libc::size_t;

use super::buffer::{Elements, isocoat_buffer};
use super::guard::{isocoat_world, read};
use super::handle::{isocoat_body, isocoat_link, isocoat_skeleton};
use super::pointer::{Count, List, Out, disjoint, read_vector, slice, slice_mut};
use super::report::isocoat_contact;
use super::status::{Checked, isocoat_status};
use super::world::{isocoat_scheme, scheme_from_c, unknown};
use crate::world::Deformation;
use crate::world::query::{RayHit, SurfacePoint};

/// Where a ray meets a coat.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct isocoat_ray_hit {
    /// The body.
    pub body: isocoat_body,
    /// The link that carries the skeleton; null on a substance.
    pub link: isocoat_link,
    /// The skeleton in whose territory the point lies; null on a substance.
    pub skeleton: isocoat_skeleton,
    /// Length of the ray up to the point, in m; 0 for a ray that starts inside.
    pub distance: f64,
    /// The point, in m.
    pub position: [f64; 3],
    /// Outward unit normal of the coat.
    pub normal: [f64; 3],
}

impl From<RayHit> for isocoat_ray_hit {
    fn from(hit: RayHit) -> Self {
        Self {
            body: hit.body.into(),
            link: hit.link.into(),
            skeleton: hit.skeleton.into(),
            distance: hit.distance,
            position: hit.position.into(),
            normal: hit.normal.into(),
        }
    }
}

/// A point of a coat's surface.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct isocoat_surface_point {
    /// The point, in m.
    pub position: [f64; 3],
    /// Outward unit normal of the coat.
    pub normal: [f64; 3],
    /// Distance of the point that was asked about, in m; negative inside the coat.
    pub distance: f64,
    /// The link that carries the skeleton; null on a substance.
    pub link: isocoat_link,
    /// The skeleton in whose territory the point lies; null on a substance.
    pub skeleton: isocoat_skeleton,
}

impl From<SurfacePoint> for isocoat_surface_point {
    fn from(point: SurfacePoint) -> Self {
        Self {
            position: point.position.into(),
            normal: point.normal.into(),
            distance: point.distance,
            link: point.link.into(),
            skeleton: point.skeleton.into(),
        }
    }
}

/// Which shape of a body a query sees: an ISOCOAT_DEFORMATION_ value. Contacts are those at the present poses, with all
/// enabled bodies whose masks agree; the pair filter is not asked. A rigid body keeps its shape.
pub type isocoat_deformation = u32;
/// The coat as if it touched nothing.
pub const ISOCOAT_DEFORMATION_NONE: isocoat_deformation = 0;
/// Flattened along its contact surfaces with other bodies.
pub const ISOCOAT_DEFORMATION_CONTACT: isocoat_deformation = 1;
/// Flattened, and bulging round its contacts as isocoat_body_desc::bulge_width says.
pub const ISOCOAT_DEFORMATION_BULGES: isocoat_deformation = 2;

pub(super) fn deformation_from_c(deformation: isocoat_deformation) -> Checked<Deformation> {
    match deformation {
        ISOCOAT_DEFORMATION_NONE => Ok(Deformation::None),
        ISOCOAT_DEFORMATION_CONTACT => Ok(Deformation::Contact),
        ISOCOAT_DEFORMATION_BULGES => Ok(Deformation::Bulges),
        other => Err(unknown("deformation", other, "ISOCOAT_DEFORMATION_", 2)),
    }
}

/// The field of a body at points of the world: f = sum of F(distance) over its skeletons. The surface is where f equals
/// the body's isovalue; inside, f is larger.
///
/// - world: not NULL.
/// - body: the body.
/// - points: 3 * count doubles, in m, finite; not NULL unless count is 0.
/// - count: number of points.
/// - values: receives count doubles; NULL if not wanted. Must not overlap points or gradients.
/// - gradients: receives 3 * count doubles, the gradients in the world's axes, in 1/m; NULL if not wanted. Must not
///   overlap points.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_evaluate_field(
    world: *const isocoat_world,
    body: isocoat_body,
    points: *const f64,
    count: size_t,
    values: *mut f64,
    gradients: *mut f64,
) -> isocoat_status {
    // SAFETY: as the caller's lines say.
    unsafe {
        isocoat_body_evaluate_field_deformed(world, body, ISOCOAT_DEFORMATION_NONE, points, count, values, gradients)
    }
}

/// isocoat_body_evaluate_field() of a body's shape in contact: f with what contacts add to it. Its surface is where f
/// equals the body's isovalue; away from contacts f is the same to the bit.
///
/// - world: not NULL.
/// - body: the body.
/// - deformation: which shape, an ISOCOAT_DEFORMATION_ value.
/// - points: 3 * count doubles, in m, finite; not NULL unless count is 0.
/// - count: number of points.
/// - values: receives count doubles; NULL if not wanted. Must not overlap points or gradients.
/// - gradients: receives 3 * count doubles, the gradients in the world's axes, in 1/m; NULL if not wanted. Must not
///   overlap points.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_evaluate_field_deformed(
    world: *const isocoat_world,
    body: isocoat_body,
    deformation: isocoat_deformation,
    points: *const f64,
    count: size_t,
    values: *mut f64,
    gradients: *mut f64,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say; overlap is refused before the slices are used.
    unsafe {
        read(world, |inner| {
            let triples = count.saturating_mul(3);
            disjoint([("points", points, triples), ("values", values, count), ("gradients", gradients, triples)])?;
            let points = slice(points.cast::<[f64; 3]>(), count, "points")?;
            let values = slice_mut(values, count, "values")?;
            let gradients = slice_mut(gradients.cast::<[f64; 3]>(), count, "gradients")?;
            let deformation = deformation_from_c(deformation)?;
            Ok(inner.world.evaluate_field_deformed(body.into(), points, values, gradients, deformation)?)
        })
    }
}

/// The contacts that two bodies would have at their present poses, or, for one body twice, those of its parts that don't
/// blend. Changes nothing, and asks neither categories nor the pair filter.
///
/// - world: not NULL.
/// - body_a, body_b: two bodies, or one twice.
/// - scheme: how to integrate, an ISOCOAT_SCHEME_ value.
/// - tolerance: relative error accepted in the force, from 1e-9 to 0.5.
/// - contacts: receives the contacts; NULL with capacity 0 asks for the count only.
/// - capacity: contacts that fit.
/// - count: receives the number of contacts, also when contacts is too small; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED, BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_collide(
    world: *const isocoat_world,
    body_a: isocoat_body,
    body_b: isocoat_body,
    scheme: isocoat_scheme,
    tolerance: f64,
    contacts: *mut isocoat_contact,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = List::new(contacts, capacity, "contacts", count)?;
            let found = inner.world.collide(body_a.into(), body_b.into(), scheme_from_c(scheme)?, tolerance)?;
            out.put(found.len(), found.iter().map(isocoat_contact::from))
        })
    }
}

/// The first coat that a ray meets, among enabled bodies. On a substance, link and skeleton of the hit are null.
///
/// - world: not NULL.
/// - origin: 3 doubles, in m, finite; not NULL. A ray that starts inside a coat meets it at distance 0.
/// - direction: 3 doubles, of any length but 0, finite; not NULL.
/// - max_distance: length of the ray, in m, at least 0; may be infinite.
/// - mask: bodies whose category has a bit of it are looked at.
/// - hit: receives where it meets, if it does; not NULL.
/// - found: receives whether it meets a coat; not NULL.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[origin;3], [direction;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_cast_ray(
    world: *const isocoat_world,
    origin: *const f64,
    direction: *const f64,
    max_distance: f64,
    mask: u64,
    hit: *mut isocoat_ray_hit,
    found: *mut bool,
) -> isocoat_status {
    // SAFETY: as the caller's lines say.
    unsafe {
        isocoat_world_cast_ray_deformed(
            world,
            origin,
            direction,
            max_distance,
            mask,
            ISOCOAT_DEFORMATION_NONE,
            hit,
            found,
        )
    }
}

/// isocoat_world_cast_ray() against the bodies' shapes in contact. Where the field of another body reaches, a chord
/// shorter than 1/1024 of a radius of influence may be missed. On a substance, link and skeleton of the hit are null.
///
/// - world: not NULL.
/// - origin: 3 doubles, in m, finite; not NULL. A ray that starts inside a coat meets it at distance 0.
/// - direction: 3 doubles, of any length but 0, finite; not NULL.
/// - max_distance: length of the ray, in m, at least 0; may be infinite.
/// - mask: bodies whose category has a bit of it are looked at.
/// - deformation: which shapes, an ISOCOAT_DEFORMATION_ value.
/// - hit: receives where it meets, if it does; not NULL.
/// - found: receives whether it meets a coat; not NULL.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[origin;3], [direction;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_cast_ray_deformed(
    world: *const isocoat_world,
    origin: *const f64,
    direction: *const f64,
    max_distance: f64,
    mask: u64,
    deformation: isocoat_deformation,
    hit: *mut isocoat_ray_hit,
    found: *mut bool,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let (origin, direction) = (read_vector(origin, "origin")?, read_vector(direction, "direction")?);
            let (hit, found) = (Out::new(hit, "hit")?, Out::new(found, "found")?);
            let deformation = deformation_from_c(deformation)?;
            let first = inner.world.cast_ray_deformed(&origin, &direction, max_distance, mask, deformation)?;
            found.put(first.is_some());
            if let Some(first) = first {
                hit.put(first.into());
            }
            Ok(())
        })
    }
}

/// The enabled bodies whose coat comes within a distance of a point, in the order of their handles.
///
/// - world: not NULL.
/// - center: 3 doubles, in m, finite; not NULL.
/// - radius: the distance, in m, at least 0; 0 finds the coats that contain the point.
/// - mask: bodies whose category has a bit of it are looked at.
/// - bodies: receives the handles; NULL with capacity 0 asks for the count only.
/// - capacity: handles that fit.
/// - count: receives the number of bodies, also when bodies is too small; not NULL.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE, BUFFER_TOO_SMALL. Threads: reads the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[center;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_overlap_sphere(
    world: *const isocoat_world,
    center: *const f64,
    radius: f64,
    mask: u64,
    bodies: *mut isocoat_body,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let center = read_vector(center, "center")?;
            let out = List::new(bodies, capacity, "bodies", count)?;
            let found = inner.world.overlap_sphere(&center, radius, mask)?;
            out.put(found.len(), found.iter().map(|body| isocoat_body::from(*body)))
        })
    }
}

/// The point of a body's surface that is closest to a point of the world. On a substance, link and
/// skeleton are null.
///
/// - world: not NULL.
/// - body: the body; it may be disabled.
/// - point: 3 doubles, in m, finite; not NULL. It may be inside.
/// - closest: receives the closest point, if there is one; not NULL.
/// - found: receives whether there is one: not for a body without enabled skeletons or particles; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[point;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_closest_point(
    world: *const isocoat_world,
    body: isocoat_body,
    point: *const f64,
    closest: *mut isocoat_surface_point,
    found: *mut bool,
) -> isocoat_status {
    // SAFETY: as the caller's lines say.
    unsafe { isocoat_body_closest_point_deformed(world, body, point, ISOCOAT_DEFORMATION_NONE, closest, found) }
}

/// isocoat_body_closest_point() of a body's shape in contact. On a substance, link and skeleton are null.
///
/// - world: not NULL.
/// - body: the body; a disabled one is not deformed.
/// - point: 3 doubles, in m, finite; not NULL. It may be inside.
/// - deformation: which shape, an ISOCOAT_DEFORMATION_ value.
/// - closest: receives the closest point, if there is one; not NULL.
/// - found: receives whether there is one: not for a body without enabled skeletons or particles; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
///
/// <!--
/// cbindgen:ptrs-as-arrays=[[point;3]]
/// -->
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_closest_point_deformed(
    world: *const isocoat_world,
    body: isocoat_body,
    point: *const f64,
    deformation: isocoat_deformation,
    closest: *mut isocoat_surface_point,
    found: *mut bool,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let point = read_vector(point, "point")?;
            let (closest, found) = (Out::new(closest, "closest")?, Out::new(found, "found")?);
            let point = inner.world.closest_point_deformed(body.into(), &point, deformation_from_c(deformation)?)?;
            found.put(point.is_some());
            if let Some(point) = point {
                closest.put(point.into());
            }
            Ok(())
        })
    }
}

/// The seeds of a skeleton, always in the same order: samples sent out from it until they meet the surface, or the
/// territory of another skeleton.
///
/// - world: not NULL.
/// - skeleton: the skeleton; a plane has none, nor has a disabled skeleton or link.
/// - positions: receives 3 numbers a seed, in m; skipped if its data is NULL.
/// - normals: receives 3 numbers a seed, the outward unit normal of the field; skipped if its data is NULL.
/// - valid: receives 1 for a seed on the surface, 0 for one that met another territory; NULL if not wanted.
/// - capacity: seeds that fit into each of the three. With all three NULL only the count is asked.
/// - count: receives the number of seeds, also when they do not fit; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_get_seeds(
    world: *const isocoat_world,
    skeleton: isocoat_skeleton,
    positions: isocoat_buffer,
    normals: isocoat_buffer,
    valid: *mut u8,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say; the count is checked before anything else is written.
    unsafe {
        read(world, |inner| {
            let positions = Elements::<3>::new(positions, "positions")?;
            let normals = Elements::<3>::new(normals, "normals")?;
            let count = Count::new(count, "count")?;
            let seeds = inner.world.seeds(skeleton.into())?;
            let wanted = positions.is_wanted() || normals.is_wanted() || !valid.is_null();
            count.put(seeds.len(), capacity, wanted)?;
            for (index, seed) in seeds.iter().enumerate() {
                positions.put(index, seed.position.into());
                normals.put(index, seed.normal.into());
                if !valid.is_null() {
                    valid.add(index).write(seed.valid.into());
                }
            }
            Ok(())
        })
    }
}
