//! Meshes of bodies and of territories, in memory that is used again.

use std::cell::UnsafeCell;
use std::mem::offset_of;
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};

use libc::size_t;

use super::buffer::{Elements, isocoat_buffer};
use super::descriptor::{self, Descriptor};
use super::guard::{free, isocoat_world, read};
use super::handle::{isocoat_body, isocoat_skeleton};
use super::pointer::{Out, slice_mut};
use super::query::{ISOCOAT_DEFORMATION_NONE, deformation_from_c, isocoat_deformation};
use super::status::{Checked, ISOCOAT_ERROR_BUFFER_TOO_SMALL, ISOCOAT_ERROR_LOCKED, Refusal, isocoat_status};
use super::world::{check_reserved, unknown};
use crate::surface::mesh::Mesh;
use crate::world::attributes::{STRONGEST, Weights};
use crate::world::mesh::{MeshDesc, MeshWorkspace, TerritoryStyle};

/// A mesh of triangles, with the memory that making one takes: made again and again it soon asks for no more. It
/// belongs to no world, and outlives them.
pub struct isocoat_mesh {
    /// A call is using it.
    busy: AtomicBool,
    inner: UnsafeCell<Held>,
}

#[derive(Default)]
struct Held {
    mesh: Mesh,
    workspace: MeshWorkspace,
    weights: Weights,
    /// The skeletons of the weights, as C knows them.
    skeletons: Vec<[isocoat_skeleton; STRONGEST]>,
    pressures: Vec<f64>,
}

impl Held {
    /// Takes the attributes out, and keeps their memory.
    fn clear_attributes(&mut self) {
        self.weights.clear();
        self.skeletons.clear();
        self.pressures.clear();
    }
}

/// Lets go of a mesh, also when the call panics.
struct InUse<'a>(&'a AtomicBool);

impl Drop for InUse<'_> {
    fn drop(&mut self) {
        self.0.store(false, Ordering::Release);
    }
}

impl isocoat_mesh {
    /// # Safety
    /// `mesh` is NULL or a live mesh.
    unsafe fn with<T>(mesh: *const isocoat_mesh, call: impl FnOnce(&mut Held) -> Checked<T>) -> Checked<T> {
        // SAFETY: NULL or live, as the caller promises.
        let Some(mesh) = (unsafe { mesh.as_ref() }) else { return Err(Refusal::argument("mesh is NULL")) };
        if mesh.busy.swap(true, Ordering::Acquire) {
            return Err(Refusal::new(
                ISOCOAT_ERROR_LOCKED,
                "the mesh is used by another call: no other until it returns",
            ));
        }
        let _in_use = InUse(&mesh.busy);
        // SAFETY: the flag was not set, so that this is the only reference until it is cleared.
        call(unsafe { &mut *mesh.inner.get() })
    }
}

/// What a mesh knows of its vertices besides: ISOCOAT_MESH_ flags, added up.
pub type isocoat_mesh_attributes = u32;
/// Whose they are: see isocoat_mesh_get_weights().
pub const ISOCOAT_MESH_WEIGHTS: isocoat_mesh_attributes = 1;
/// What presses there: see isocoat_mesh_get_pressures().
pub const ISOCOAT_MESH_PRESSURES: isocoat_mesh_attributes = 2;

/// What mesh of a body is wanted. Begin with isocoat_mesh_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_mesh_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// Which shape of the body, an ISOCOAT_DEFORMATION_ value. Default ISOCOAT_DEFORMATION_NONE.
    pub deformation: isocoat_deformation,
    /// Edge of the cells that the mesh is made of, in m: about the length of its triangles, > 0. What is thinner than
    /// a cell may be missed. Of a ball, a quarter of the thickness gives the volume within 3.2 %, an eighth within 1 %.
    /// Default 0, which must be replaced.
    pub cell_size: f64,
    /// What it is to know of its vertices besides: ISOCOAT_MESH_ flags, added up. Default 0, nothing.
    pub attributes: isocoat_mesh_attributes,
    /// Must be 0.
    pub reserved: u32,
}

// SAFETY: `repr(C)`, the size first, integers and a number.
unsafe impl Descriptor for isocoat_mesh_desc {
    const NAME: &'static str = "isocoat_mesh_desc";
    const FIRST_SIZE: usize = offset_of!(Self, cell_size) + size_of::<f64>();

    fn defaults() -> Self {
        Self { struct_size: 0, deformation: ISOCOAT_DEFORMATION_NONE, cell_size: 0.0, attributes: 0, reserved: 0 }
    }
}

/// How the territory of a skeleton is shown: an ISOCOAT_TERRITORY_ value.
pub type isocoat_territory_style = u32;
/// A closed mesh with a vertex at each seed.
pub const ISOCOAT_TERRITORY_PATCHES: isocoat_territory_style = 0;
/// A hexagon for each seed, in the tangent plane there: six vertices, in the order of the seeds.
pub const ISOCOAT_TERRITORY_SCALES: isocoat_territory_style = 1;

/// A look at a mesh: arrays that belong to it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_mesh_view {
    /// 3 doubles a vertex: where it is in the world, in m.
    pub positions: *const f64,
    /// 3 doubles a vertex: the outward unit normal of the surface.
    pub normals: *const f64,
    /// 3 vertices a triangle, counterclockwise from outside.
    pub triangles: *const u32,
    /// A byte a vertex: 1 if it lies on the coat's surface, 0 if at another territory; NULL for a watertight mesh,
    /// where all do.
    pub valid: *const bool,
    /// Number of vertices.
    pub vertex_count: size_t,
    /// Number of triangles.
    pub triangle_count: size_t,
}

/// Fills a descriptor with its defaults; isocoat_mesh_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_mesh_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_mesh_desc_init(desc: *mut isocoat_mesh_desc, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Creates an empty mesh.
///
/// - mesh: receives the mesh; not NULL. Destroy it with isocoat_mesh_destroy.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_mesh_create(mesh: *mut *mut isocoat_mesh) -> isocoat_status {
    free(|| {
        // SAFETY: NULL or writable.
        let out = unsafe { Out::new(mesh, "mesh") }?;
        let mesh = isocoat_mesh { busy: AtomicBool::new(false), inner: UnsafeCell::default() };
        out.put(Box::into_raw(Box::new(mesh)));
        Ok(())
    })
}

/// Destroys a mesh. Its views and the pointer itself are void afterwards.
///
/// - mesh: NULL does nothing.
///
/// Errors: LOCKED while another call uses it; it then lives on. Threads: the mesh by this thread alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_mesh_destroy(mesh: *mut isocoat_mesh) -> isocoat_status {
    free(|| {
        if !mesh.is_null() {
            // SAFETY: live, made by `isocoat_mesh_create`, and not used: then nobody may come any more.
            unsafe {
                isocoat_mesh::with(mesh, |_| Ok(()))?;
                drop(Box::from_raw(mesh));
            }
        }
        Ok(())
    })
}

/// Makes a watertight mesh of a body's surface, in place of what the mesh was: closed, each edge between two triangles,
/// oriented outwards, with the vertices on the surface; the same input gives the same bits. It is empty for a body
/// without enabled skeletons, and asks for no memory once the mesh has held one as large (of an undeformed body, without
/// attributes).
///
/// - world: not NULL.
/// - body: the body; it may be disabled. None of its enabled skeletons may be a plane.
/// - desc: cell size, shape and attributes; not NULL.
/// - mesh: receives the mesh; not NULL. After an error it is as it was. Its views are void.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED, CAPACITY for too small a cell size, LOCKED.
/// Threads: reads the world; the mesh by this thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_body_make_mesh(
    world: *const isocoat_world,
    body: isocoat_body,
    desc: *const isocoat_mesh_desc,
    mesh: *mut isocoat_mesh,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let desc = descriptor::read(desc, "desc")?;
            let deformation = deformation_from_c(desc.deformation)?;
            let has = |attribute| desc.attributes & attribute != 0;
            let known = ISOCOAT_MESH_WEIGHTS | ISOCOAT_MESH_PRESSURES;
            if desc.attributes & !known != 0 {
                return Err(Refusal::argument(format!(
                    "attributes is {:#x}; must be a sum of ISOCOAT_MESH_ flags, at most {known:#x}",
                    desc.attributes
                )));
            }
            check_reserved(desc.reserved)?;
            isocoat_mesh::with(mesh, |held| {
                let (world, body) = (&inner.world, body.into());
                let wanted = MeshDesc { cell_size: desc.cell_size, deformation };
                world.mesh_into(body, &wanted, &mut held.workspace, &mut held.mesh)?;
                held.clear_attributes();
                let Held { mesh: Mesh { positions, .. }, weights, skeletons, pressures, .. } = held;
                if has(ISOCOAT_MESH_WEIGHTS) {
                    world.mesh_weights(body, positions, weights)?;
                    skeletons.extend(weights.skeletons.iter().map(|four| four.map(isocoat_skeleton::from)));
                }
                if has(ISOCOAT_MESH_PRESSURES) {
                    world.mesh_pressures(body, positions, pressures)?;
                }
                Ok(())
            })
        })
    }
}

/// Makes a mesh of a skeleton's territory from its seeds, valid or not, in place of what the mesh was: for display, at
/// no cost but the seeds'. The meshes of a body's skeletons together show its coat. Which vertices are joined depends
/// only on shape, thickness and number of seeds of the skeleton, so that a host may upload the triangles once.
///
/// - world: not NULL.
/// - skeleton: the skeleton; the mesh of a plane is empty, and that of a disabled skeleton or link.
/// - style: an ISOCOAT_TERRITORY_ value.
/// - mesh: receives the mesh; not NULL. After an error it is as it was. Its views are void.
///
/// Errors: INVALID_HANDLE, INVALID_ARGUMENT, LOCKED. Threads: reads the world; the mesh by this thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_skeleton_make_mesh(
    world: *const isocoat_world,
    skeleton: isocoat_skeleton,
    style: isocoat_territory_style,
    mesh: *mut isocoat_mesh,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let style = match style {
                ISOCOAT_TERRITORY_PATCHES => TerritoryStyle::Patches,
                ISOCOAT_TERRITORY_SCALES => TerritoryStyle::Scales,
                other => return Err(unknown("style", other, "ISOCOAT_TERRITORY_", 1)),
            };
            isocoat_mesh::with(mesh, |held| {
                let Held { mesh, workspace, .. } = &mut *held;
                inner.world.territory_mesh_into(skeleton.into(), style, workspace, mesh)?;
                held.clear_attributes();
                Ok(())
            })
        })
    }
}

/// A look at a mesh, without copying it.
///
/// - mesh: not NULL.
/// - view: receives pointers into the mesh (not to be freed), which stay valid until it is made again or destroyed; not
///   NULL.
///
/// Errors: INVALID_ARGUMENT, LOCKED. Threads: the mesh by this thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_mesh_get_view(
    mesh: *const isocoat_mesh,
    view: *mut isocoat_mesh_view,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say.
        unsafe {
            let out = Out::new(view, "view")?;
            isocoat_mesh::with(mesh, |Held { mesh, .. }| {
                out.put(isocoat_mesh_view {
                    positions: mesh.positions.as_ptr().cast(),
                    normals: mesh.normals.as_ptr().cast(),
                    triangles: mesh.triangles.as_ptr().cast(),
                    valid: first(&mesh.valid),
                    vertex_count: mesh.positions.len(),
                    triangle_count: mesh.triangles.len(),
                });
                Ok(())
            })
        }
    })
}

/// Whose the vertices of a mesh are, without copying it: for each the four skeletons whose fields are the strongest
/// there, with their shares of what these make together, as far as a blend graph lets them count. For textures,
/// materials and bones: the weights of a link are those of its skeletons.
///
/// - mesh: not NULL. It must have been made by isocoat_body_make_mesh() with ISOCOAT_MESH_WEIGHTS, or it has none.
/// - skeletons: receives a pointer to 4 handles a vertex, the strongest first; null handles where there are fewer, and
///   on a substance. NULL if the mesh has none. Not NULL itself.
/// - weights: receives a pointer to 4 doubles a vertex, which add up to 1; 0 for null handles. NULL if the mesh has
///   none. Not NULL itself.
///
/// Both point into the mesh (not to be freed), and stay valid until it is made again or destroyed.
///
/// Errors: INVALID_ARGUMENT, LOCKED. Threads: the mesh by this thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_mesh_get_weights(
    mesh: *const isocoat_mesh,
    skeletons: *mut *const isocoat_skeleton,
    weights: *mut *const f64,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say.
        unsafe {
            let (to_skeletons, to_weights) = (Out::new(skeletons, "skeletons")?, Out::new(weights, "weights")?);
            isocoat_mesh::with(mesh, |Held { weights, skeletons, .. }| {
                to_skeletons.put(first(skeletons.as_flattened()));
                to_weights.put(first(weights.weights.as_flattened()));
                Ok(())
            })
        }
    })
}

/// What presses on the vertices of a mesh, without copying it: the elastic pressure of contacts, without friction and
/// dissipation. It is that of the body's own coat, and of a rigid body that of the coat that presses on it; 0 where
/// nothing presses. Of a deformable body it makes sense in the shapes ISOCOAT_DEFORMATION_CONTACT and _BULGES: its
/// undeformed surface has no pressure yet.
///
/// - mesh: not NULL. It must have been made by isocoat_body_make_mesh() with ISOCOAT_MESH_PRESSURES, or it has none.
/// - pressures: receives a pointer to a double a vertex, in Pa, at least 0; it points into the mesh (not to be freed),
///   and stays valid until that is made again or destroyed. NULL if the mesh has none. Not NULL itself.
///
/// Errors: INVALID_ARGUMENT, LOCKED. Threads: the mesh by this thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_mesh_get_pressures(
    mesh: *const isocoat_mesh,
    pressures: *mut *const f64,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say.
        unsafe {
            let out = Out::new(pressures, "pressures")?;
            isocoat_mesh::with(mesh, |Held { pressures, .. }| {
                out.put(first(pressures));
                Ok(())
            })
        }
    })
}

/// Where a list begins; NULL for none.
fn first<T>(list: &[T]) -> *const T {
    if list.is_empty() { ptr::null() } else { list.as_ptr() }
}

/// Copies a mesh into the host's own memory, strided and in either precision; isocoat_mesh_get_view() says how large it
/// is.
///
/// - mesh: not NULL.
/// - positions: receives 3 numbers a vertex, in m; skipped if its data is NULL.
/// - normals: receives 3 numbers a vertex; skipped if its data is NULL.
/// - vertex_capacity: vertices that fit into each of the two.
/// - triangles: receives 3 vertices a triangle; NULL if not wanted.
/// - triangle_capacity: triangles that fit.
///
/// Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL, LOCKED; nothing is written then. Threads: the mesh by this thread alone.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_mesh_copy(
    mesh: *const isocoat_mesh,
    positions: isocoat_buffer,
    normals: isocoat_buffer,
    vertex_capacity: size_t,
    triangles: *mut u32,
    triangle_capacity: size_t,
) -> isocoat_status {
    free(|| {
        // SAFETY: the pointers are NULL or as their lines say; nothing is written before all is known to fit.
        unsafe {
            let positions = Elements::<3>::new(positions, "positions")?;
            let normals = Elements::<3>::new(normals, "normals")?;
            let triangles = slice_mut(triangles.cast::<[u32; 3]>(), triangle_capacity, "triangles")?;
            isocoat_mesh::with(mesh, |Held { mesh, .. }| {
                let wanted = positions.is_wanted() || normals.is_wanted();
                fits("vertex_capacity", vertex_capacity, if wanted { mesh.positions.len() } else { 0 })?;
                fits("triangle_capacity", triangle_capacity, triangles.as_ref().map_or(0, |_| mesh.triangles.len()))?;
                mesh.positions.iter().enumerate().for_each(|(index, position)| positions.put(index, *position));
                mesh.normals.iter().enumerate().for_each(|(index, normal)| normals.put(index, *normal));
                if let Some(triangles) = triangles {
                    triangles[..mesh.triangles.len()].copy_from_slice(&mesh.triangles);
                }
                Ok(())
            })
        }
    })
}

pub(super) fn fits(name: &str, capacity: usize, needed: usize) -> Checked<()> {
    if needed <= capacity {
        return Ok(());
    }
    let message = format!("{name} is {capacity}; must be at least {needed}");
    Err(Refusal::new(ISOCOAT_ERROR_BUFFER_TOO_SMALL, message))
}
