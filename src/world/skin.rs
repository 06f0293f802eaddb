//! Skins: lives, and where their vertices are.

use std::sync::{Mutex, PoisonError};

use super::query::PosedCoat;
use super::{BodyId, Deformation, LinkId, SkeletonId, World};
use crate::error::{Error, Result, out_of_range};
use crate::handle::{Id, Noun};
use crate::math::{Pose, Vec3};
use crate::surface::prepared::Prepared;
use crate::surface::skin::{self, Motion};

/// Handle of a skin.
pub type SkinId = Id<Skin>;

/// A skin as the world keeps it: a host's mesh bound to a body. It is no part of what a step or a snapshot sees.
pub struct Skin {
    body: BodyId,
    /// The skeletons that were enabled when it was bound.
    skeletons: Vec<SkeletonId>,
    /// The links that carried them, and where these were, in the frame of the binding.
    links: Vec<LinkId>,
    poses: Vec<Pose>,
    bound: skin::Skin,
    memory: Mutex<Memory>,
}

/// What is used again from one time to the next.
#[derive(Default)]
struct Memory {
    posed: PosedCoat,
    coat: Prepared,
    motions: Vec<Motion>,
    workspace: skin::Workspace,
}

impl Noun for Skin {
    const NAME: &'static str = "skin";
}

/// Skins.
impl World {
    /// Binds a host's mesh to a body at the present poses, undeformed: each vertex remembers the field there, and the
    /// links whose skeletons make it.
    ///
    /// - `vertices`: where, in the world \[m\]. Where no field of the body reaches, a vertex will follow the link of the
    ///   nearest surface.
    /// - `normals`: the mesh's own normals, of any length but 0, as many as vertices; or none, for those of the field.
    ///
    /// The skin lives until it is destroyed, or the world; what it is bound to may go before it. Snapshots leave it out;
    /// it outlives a restored one of this world, and is gone after one of another world.
    pub fn create_skin(&mut self, body: BodyId, vertices: &[[f64; 3]], normals: Option<&[[f64; 3]]>) -> Result<SkinId> {
        if self.bodies.get(body)?.substance.is_some() {
            return Err(Error::Unsupported("a skin needs links, which a substance does not have"));
        }
        if normals.is_some_and(|normals| normals.len() != vertices.len()) {
            return Err(Error::Unsupported("normals must be as many as vertices"));
        }
        if vertices.len() > u32::MAX as usize {
            return Err(Error::Capacity("a skin holds at most 2^32 - 1 vertices"));
        }
        let posed = self.posed_coat(body.index());
        if posed.skeletons.is_empty() {
            return Err(Error::Unsupported("a skin needs a body with enabled skeletons"));
        }
        let mut local = Vec::with_capacity(vertices.len());
        for (index, p) in vertices.iter().enumerate() {
            if !p.iter().all(|x| x.abs() <= 1e60) {
                return Err(out_of_range("vertex", element(index, p), "finite, at most 1e60"));
            }
            local.push(posed.localise(&Vec3::from(*p)));
        }
        let unit = |(index, normal): (usize, &[f64; 3])| {
            let unit = Vec3::from(*normal).try_normalize(1e-100).filter(|unit| unit.iter().all(|x| x.is_finite()));
            unit.ok_or_else(|| out_of_range("normal", element(index, normal), "finite, and longer than 0"))
        };
        let normals: Option<Vec<Vec3>> =
            normals.map(|normals| normals.iter().enumerate().map(unit).collect::<Result<_>>()).transpose()?;
        let (mut links, mut poses, mut link_of) = (Vec::new(), Vec::new(), Vec::new());
        for (skeleton, pose) in posed.skeletons.iter().zip(&posed.poses) {
            let link = self.links.id_of(self.skeletons[*skeleton].link as usize);
            // Skeletons of one link follow each other.
            if links.last() != Some(&link) {
                links.push(link);
                poses.push(*pose);
            }
            link_of.push(links.len() as u32 - 1);
        }
        let bound = skin::Skin::bind(&posed.coat, &link_of, &local, normals.as_deref());
        let skeletons = posed.skeletons.iter().map(|skeleton| self.skeletons.id_of(*skeleton)).collect();
        self.skins.insert(Skin { body, skeletons, links, poses, bound, memory: Mutex::default() })
    }

    /// Destroys a skin.
    pub fn destroy_skin(&mut self, id: SkinId) -> Result<()> {
        self.skins.remove(id).map(|_| ())
    }

    /// The body that a skin was bound to; it may have been destroyed since.
    pub fn skin_body(&self, id: SkinId) -> Result<BodyId> {
        Ok(self.skins.get(id)?.body)
    }

    /// Number of vertices of a skin.
    pub fn skin_vertex_count(&self, id: SkinId) -> Result<usize> {
        Ok(self.skins.get(id)?.bound.len())
    }

    /// The links that a vertex of a skin follows, with their weights, the heaviest first; these add up to 1.
    pub fn skin_weights(&self, id: SkinId, vertex: usize) -> Result<impl Iterator<Item = (LinkId, f64)> + '_> {
        let Skin { bound, links, .. } = self.skins.get(id)?;
        if vertex >= bound.len() {
            return Err(out_of_range("vertex", vertex, "less than the number of vertices of the skin"));
        }
        Ok(bound.weights(vertex).iter().map(|(link, weight)| (links[*link as usize], *weight)))
    }

    /// Where the vertices of a skin are now: each goes with its links, and from there to where the field of the body's
    /// shape, as `deformation` says, has the value that it had at the binding. A rigid motion of the whole body moves
    /// the mesh rigidly. `tell` gets the number of each vertex, its position \[m\] and its outward unit normal, once,
    /// in no particular order, and is not called at all if there is an error.
    ///
    /// Calls for one skin wait for each other. Once it was called, an undeformed shape asks for no memory.
    pub fn deform_skin(
        &self,
        id: SkinId,
        deformation: Deformation,
        mut tell: impl FnMut(usize, Vec3, Vec3),
    ) -> Result<()> {
        let skin = self.skins.get(id)?;
        if self.bodies.get(skin.body).is_err() {
            return Err(Error::InvalidHandle { noun: "body of the skin", reason: "it was destroyed" });
        }
        // What a panic has left behind is overwritten.
        let mut memory = skin.memory.lock().unwrap_or_else(PoisonError::into_inner);
        let Memory { posed, coat, motions, workspace } = &mut *memory;
        posed.coat = coat.take().coat;
        let (deformed, skeletons) = self.shape_of(skin.body.index(), deformation, posed);
        let same = |(bound, now): (&SkeletonId, &usize)| self.skeletons.id_of(*now) == *bound;
        if skeletons.len() != skin.skeletons.len() || !skin.skeletons.iter().zip(skeletons).all(same) {
            return Err(Error::Unsupported(
                "the enabled skeletons of the body are not those that the skin was bound to: bind it again",
            ));
        }
        let origin = deformed.coat.origin;
        motions.clear();
        for (link, before) in skin.links.iter().zip(&skin.poses) {
            let now = self.links.get(*link)?.desc.pose;
            motions.push(Motion::between(before, &deformed.coat.localise(&now)));
        }
        coat.prepare(deformed);
        skin.bound.deform(motions, coat, workspace, |vertex, position, normal| {
            tell(vertex, position + origin, normal);
        });
        Ok(())
    }
}

fn element(index: usize, v: &[f64; 3]) -> String {
    format!("({}, {}, {}) (number {index})", v[0], v[1], v[2])
}
