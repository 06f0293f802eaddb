//! Meshes of bodies, between steps.

use super::query::{Followed, PosedCoat};
use super::{BodyId, Deformation, SkeletonId, World};
use crate::error::{Error, Result};
use crate::field::Shape;
use crate::math::Vec3;
use crate::surface::deformed::Deformed;
use crate::surface::mesh::coated::{Coated, Scratch};
use crate::surface::mesh::{self, Mesh};
use crate::surface::patches;

/// What mesh of a body is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshDesc {
    /// Edge of the cells that the mesh is made of \[m\]: about the length of its triangles. What is thinner than a cell
    /// may be missed.
    pub cell_size: f64,
    /// Which shape of the body.
    pub deformation: Deformation,
}

impl MeshDesc {
    /// Of the undeformed shape.
    pub fn new(cell_size: f64) -> Self {
        Self { cell_size, deformation: Deformation::None }
    }
}

/// How the territory of a skeleton is shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TerritoryStyle {
    /// A closed mesh with a vertex at each seed.
    #[default]
    Patches,
    /// A hexagon for each seed, in the tangent plane there: six vertices, in the order of the seeds.
    Scales,
}

/// Memory of [`World::mesh_into`] and [`World::territory_mesh_into`], for any bodies of any worlds.
#[derive(Default)]
pub struct MeshWorkspace {
    topology: Topology,
    posed: PosedCoat,
    scratch: Scratch,
    mesh: mesh::Workspace,
}

/// Which seeds the last patch joined, kept for the next call.
#[derive(Default)]
struct Topology {
    of: Option<(Shape, f64, usize)>,
    triangles: Vec<[u32; 3]>,
}

impl World {
    /// A watertight mesh of a body's surface, in the world: closed, each edge between two triangles, oriented outwards,
    /// with the vertices on the surface. Empty for a body without enabled skeletons. Also answers for a body that is
    /// disabled as a whole.
    pub fn mesh(&self, body: BodyId, desc: &MeshDesc) -> Result<Mesh> {
        let mut out = Mesh::default();
        self.mesh_into(body, desc, &mut MeshWorkspace::default(), &mut out)?;
        Ok(out)
    }

    /// [`World::mesh`] in place of what is in `out`. Once `workspace` and `out` are large enough, the mesh of an
    /// undeformed shape asks for no memory. After an error `out` is as it was.
    pub fn mesh_into(
        &self,
        body: BodyId,
        desc: &MeshDesc,
        workspace: &mut MeshWorkspace,
        out: &mut Mesh,
    ) -> Result<()> {
        self.bodies.get(body)?;
        let MeshWorkspace { posed, scratch, mesh, .. } = workspace;
        let (deformed, _) = self.shape_of(body.index(), desc.deformation, posed);
        let result = mesh_of(&deformed, desc.cell_size, scratch, mesh, out);
        posed.coat = deformed.coat;
        result
    }

    /// A mesh of a skeleton's territory from its [seeds](World::seeds), valid or not, in the world: for display, at no
    /// cost but the seeds'. The meshes of a body's skeletons together show its coat; at the borders of territories,
    /// patches leave gaps as wide as seeds are apart. Which vertices are joined depends only on shape, thickness and
    /// number of seeds of the skeleton. Empty for a plane, and while the skeleton or its link is disabled.
    pub fn territory_mesh(&self, skeleton: SkeletonId, style: TerritoryStyle) -> Result<Mesh> {
        let mut out = Mesh::default();
        self.territory_mesh_into(skeleton, style, &mut MeshWorkspace::default(), &mut out)?;
        Ok(out)
    }

    /// [`World::territory_mesh`] in place of what is in `out`. A workspace that saw the same skeleton last need not join
    /// the seeds again. After an error `out` is as it was.
    pub fn territory_mesh_into(
        &self,
        skeleton: SkeletonId,
        style: TerritoryStyle,
        workspace: &mut MeshWorkspace,
        out: &mut Mesh,
    ) -> Result<()> {
        let Followed { origin, rays, seeds } = self.follow(skeleton)?;
        out.clear();
        if seeds.is_empty() {
            return Ok(());
        }
        for (ray, seed) in rays.iter().zip(&seeds) {
            let corners = patches::scale(ray, seed).map(|corner| corner + origin);
            let place = [seed.position + origin];
            let vertices: &[Vec3] = if style == TerritoryStyle::Scales { &corners } else { &place };
            out.positions.extend(vertices.iter().map(|x| <[f64; 3]>::from(*x)));
            out.normals.extend(vertices.iter().map(|_| <[f64; 3]>::from(seed.normal)));
            out.valid.extend(vertices.iter().map(|_| seed.is_valid()));
        }
        match style {
            TerritoryStyle::Scales => patches::scale_triangles(seeds.len(), &mut out.triangles),
            TerritoryStyle::Patches => {
                let desc = &self.skeletons[skeleton.index()].desc;
                let key = Some((desc.shape, desc.thickness, seeds.len()));
                if workspace.topology.of != key {
                    workspace.topology.triangles = patches::patch(&desc.shape, desc.thickness, &rays);
                    workspace.topology.of = key;
                }
                out.triangles.extend_from_slice(&workspace.topology.triangles);
            }
        }
        Ok(())
    }
}

/// The mesh of a coat, in the world.
fn mesh_of(
    deformed: &Deformed,
    cell_size: f64,
    scratch: &mut Scratch,
    workspace: &mut mesh::Workspace,
    out: &mut Mesh,
) -> Result<()> {
    if !Coated::is_bounded(deformed) {
        return Err(Error::Unsupported("a body with an enabled plane has no bounds, and so no closed mesh"));
    }
    mesh::mesh(&mut Coated::new(deformed, scratch), cell_size, workspace, out)?;
    let origin = deformed.coat.origin;
    for position in &mut out.positions {
        *position = (Vec3::from(*position) + origin).into();
    }
    Ok(())
}
