//! Meshes of bodies, between steps.

use super::query::PosedCoat;
use super::{BodyId, Deformation, World};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::surface::deformed::Deformed;
use crate::surface::mesh::coated::{Coated, Scratch};
use crate::surface::mesh::{self, Mesh};

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

/// Memory of [`World::mesh_into`], for any bodies of any worlds.
#[derive(Default)]
pub struct MeshWorkspace {
    posed: PosedCoat,
    scratch: Scratch,
    mesh: mesh::Workspace,
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
        let MeshWorkspace { posed, scratch, mesh } = workspace;
        let deformed = match desc.deformation {
            Deformation::None => {
                let body = &self.bodies[body.index()];
                let pose_of = |link: &u32| self.links[*link as usize].desc.pose;
                posed.coat.origin = body.links.first().map_or(Vec3::zeros(), |link| pose_of(link).position);
                self.fill_coat(body, body.links.iter().map(pose_of), posed);
                Deformed { coat: std::mem::take(&mut posed.coat), obstacles: Vec::new() }
            }
            deformation => self.deformed_coat(body.index(), deformation).0,
        };
        let result = mesh_of(&deformed, desc.cell_size, scratch, mesh, out);
        posed.coat = deformed.coat;
        result
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
