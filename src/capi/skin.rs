//! Skins: meshes of the host that a body's coat carries.

use libc::size_t;

use super::buffer::{Elements, Source, isocoat_buffer, isocoat_const_buffer};
use super::guard::{isocoat_world, read, write};
use super::handle::{isocoat_body, isocoat_link, isocoat_skin};
use super::mesh::fits;
use super::pointer::{Count, Out, Row};
use super::query::{deformation_from_c, isocoat_deformation};
use super::status::isocoat_status;

/// Binds a mesh of the host to a body, at the present poses and undeformed; only its vertices matter. Each remembers the
/// field of the body there, and the links whose skeletons make it; where no field reaches, it will follow the link of
/// the nearest surface. The skin lives until it is destroyed, or the world; a snapshot leaves it out: it outlives the
/// restoring of one of this world, and is gone after one of another world.
///
/// - world: not NULL.
/// - body: the body; it needs enabled skeletons, and may be disabled. Not a substance.
/// - vertices: 3 numbers a vertex, in m, finite; its data not NULL unless count is 0.
/// - normals: 3 numbers a vertex, the mesh's own normals, of any length but 0: they will turn as the coat does. If its
///   data is NULL, the skin has the coat's normals.
/// - count: number of vertices.
/// - skin: receives the handle; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED, CAPACITY. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skin_create(
    world: *mut isocoat_world,
    body: isocoat_body,
    vertices: isocoat_const_buffer,
    normals: isocoat_const_buffer,
    count: size_t,
    skin: *mut isocoat_skin,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        write(world, |inner| {
            let vertices = Source::<3>::required(vertices, count, "vertices")?;
            let normals = Source::<3>::new(normals, count, "normals")?;
            let out = Out::new(skin, "skin")?;
            let vertices: Vec<[f64; 3]> = vertices.iter().collect();
            let normals: Option<Vec<[f64; 3]>> = normals.is_given().then(|| normals.iter().collect());
            out.put(inner.world.create_skin(body.into(), &vertices, normals.as_deref())?.into());
            Ok(())
        })
    }
}

/// Destroys a skin.
///
/// - world: not NULL.
/// - skin: the skin.
///
/// Errors: INVALID_HANDLE. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skin_destroy(world: *mut isocoat_world, skin: isocoat_skin) -> isocoat_status {
    // SAFETY: NULL or live.
    unsafe { write(world, |inner| Ok(inner.world.destroy_skin(skin.into())?)) }
}

/// The body that a skin was bound to; it may have been destroyed since.
///
/// - world: not NULL.
/// - skin: the skin.
/// - body: receives the handle; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skin_get_body(
    world: *const isocoat_world,
    skin: isocoat_skin,
    body: *mut isocoat_body,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(body, "body")?;
            out.put(inner.world.skin_body(skin.into())?.into());
            Ok(())
        })
    }
}

/// Number of vertices of a skin.
///
/// - world: not NULL.
/// - skin: the skin.
/// - count: receives the number; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skin_get_vertex_count(
    world: *const isocoat_world,
    skin: isocoat_skin,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = Out::new(count, "count")?;
            out.put(inner.world.skin_vertex_count(skin.into())?);
            Ok(())
        })
    }
}

/// The links that a vertex of a skin follows, the heaviest first: the weight of a link is its skeletons' share of the
/// field where the vertex was bound. For hosts that let the GPU move what is far from the eye.
///
/// - world: not NULL.
/// - skin: the skin.
/// - vertex: number of the vertex.
/// - links: receives the handles; NULL if not wanted.
/// - weights: receives the weights, which add up to 1; NULL if not wanted.
/// - capacity: links that fit into each of the two. With both NULL only the count is asked.
/// - count: receives the number of links, also when they do not fit; not NULL.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skin_get_weights(
    world: *const isocoat_world,
    skin: isocoat_skin,
    vertex: size_t,
    links: *mut isocoat_link,
    weights: *mut f64,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say; the count is checked before anything else is written.
    unsafe {
        read(world, |inner| {
            let (links, weights) = (Row::new(links), Row::new(weights));
            let count = Count::new(count, "count")?;
            let found: Vec<_> = inner.world.skin_weights(skin.into(), vertex)?.collect();
            count.put(found.len(), capacity, links.is_wanted() || weights.is_wanted())?;
            for (index, (link, weight)) in found.into_iter().enumerate() {
                links.put(index, link.into());
                weights.put(index, weight);
            }
            Ok(())
        })
    }
}

/// Where the vertices of a skin are now: each goes with its links, and from there along the gradient to where the field
/// of the body has the value that it had at the binding. So the skin dents where the coat is pressed, bulges round it,
/// swells with it and does not pinch at joints. When the whole body has moved rigidly, so has the mesh. Depends on the
/// present poses alone, not on earlier calls. Asks for no memory once it was called, for an undeformed shape.
///
/// - world: not NULL.
/// - skin: the skin. The body must have the enabled skeletons that it was bound to; what they are like may change.
/// - deformation: which shape, an ISOCOAT_DEFORMATION_ value.
/// - positions: receives 3 numbers a vertex, in m; skipped if its data is NULL.
/// - normals: receives 3 numbers a vertex, unit vectors; skipped if its data is NULL.
/// - vertex_capacity: vertices that fit into each of the two.
///
/// Errors: INVALID_HANDLE (also when the body was destroyed), INVALID_ARGUMENT, UNSUPPORTED when skeletons of the body
/// have gone or come, BUFFER_TOO_SMALL; nothing is written then. Threads: reads the world; calls for one skin wait for
/// each other.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skin_deform(
    world: *const isocoat_world,
    skin: isocoat_skin,
    deformation: isocoat_deformation,
    positions: isocoat_buffer,
    normals: isocoat_buffer,
    vertex_capacity: size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say; nothing is written before all is known to fit.
    unsafe {
        read(world, |inner| {
            let positions = Elements::<3>::new(positions, "positions")?;
            let normals = Elements::<3>::new(normals, "normals")?;
            let deformation = deformation_from_c(deformation)?;
            let count = inner.world.skin_vertex_count(skin.into())?;
            let wanted = positions.is_wanted() || normals.is_wanted();
            fits("vertex_capacity", vertex_capacity, if wanted { count } else { 0 })?;
            inner.world.deform_skin(skin.into(), deformation, |vertex, position, normal| {
                positions.put(vertex, position.into());
                normals.put(vertex, normal.into());
            })?;
            Ok(())
        })
    }
}
