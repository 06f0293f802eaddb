//! What is known of points of a body's surface, such as the vertices of its mesh: whose they are, and what presses there.

use super::query::require_points;
use super::{BodyId, SkeletonId, World};
use crate::error::Result;
use crate::math::Vec3;
use crate::surface::nearby::Nearby;

/// Most skeletons that a point is said to be of.
pub const STRONGEST: usize = 4;

/// How far outside another's coat a point may be that lies on a contact surface, in its field over its isovalue: a rigid
/// body is touched on its surface itself, to which vertices are as close.
const TOUCH: f64 = 1e-3;

/// Whose points are.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Weights {
    /// For each point the skeletons whose fields are the strongest, the strongest first; null where there are fewer.
    pub skeletons: Vec<[SkeletonId; STRONGEST]>,
    /// Their weights, which add up to 1; 0 where there is none.
    pub weights: Vec<[f64; STRONGEST]>,
}

impl Weights {
    /// Takes everything out, and keeps the memory.
    pub fn clear(&mut self) {
        self.skeletons.clear();
        self.weights.clear();
    }
}

impl World {
    /// Whose points of the world are, such as the [vertices](crate::surface::mesh::Mesh::positions) of a body's mesh, in
    /// place of what is in `out`: of the body's enabled skeletons those whose fields are the strongest there, with their
    /// shares of what these make together, as far as a blend graph lets them count. Where no field reaches, the skeleton
    /// of the nearest surface. All null, with weights of 0, for a substance, and for a body without enabled skeletons.
    pub fn mesh_weights(&self, body: BodyId, points: &[[f64; 3]], out: &mut Weights) -> Result<()> {
        self.bodies.get(body)?;
        require_points(points)?;
        out.clear();
        let posed = self.posed_coat(body.index());
        let mut nearby = Nearby::new(&posed.coat);
        for point in points {
            let (mut skeletons, mut weights) = ([SkeletonId::default(); STRONGEST], [0.0; STRONGEST]);
            if !posed.skeletons.is_empty() {
                let shares = nearby.shares(&posed.localise(&Vec3::from(*point)));
                let strongest = &shares[..shares.len().min(STRONGEST)];
                let sum: f64 = strongest.iter().map(|(_, share)| share).sum();
                for ((part, share), (skeleton, weight)) in strongest.iter().zip(skeletons.iter_mut().zip(&mut weights))
                {
                    *skeleton = self.skeletons.id_of(posed.skeletons[*part as usize]);
                    *weight = share / sum;
                }
            }
            out.skeletons.push(skeletons);
            out.weights.push(weights);
        }
        Ok(())
    }

    /// Pressure of contacts \[Pa\] at points of the world that lie on a body's surface, such as the
    /// [vertices](crate::surface::mesh::Mesh::positions) of its mesh as contacts deform it, in place of what is in `out`:
    /// the elastic pressure of the body's own coat where another lies over the point, of a rigid body the highest of the
    /// others' there. 0 where nothing presses, between rigid bodies, and for a disabled body.
    ///
    /// It is that of the present poses, without friction and dissipation, with all enabled bodies whose masks agree; the
    /// pair filter is not asked. On the undeformed surface the body's own coat has no pressure yet.
    pub fn mesh_pressures(&self, body: BodyId, points: &[[f64; 3]], out: &mut Vec<f64>) -> Result<()> {
        self.bodies.get(body)?;
        require_points(points)?;
        out.clear();
        out.resize(points.len(), 0.0);
        let posed = self.posed_coat(body.index());
        let own = &self.bodies[body.index()];
        let mut nearby = Nearby::new(&posed.coat);
        for (other, coat) in self.neighbours(body.index(), &posed.coat) {
            let other = &self.bodies[other];
            let mut over = Nearby::new(&coat);
            for (point, pressure) in points.iter().zip(&mut *out) {
                let p = posed.localise(&Vec3::from(*point));
                let near = over.at(&p).0;
                let depth = near.excess(&p);
                if depth <= -TOUCH * near.isovalue {
                    continue;
                }
                let pressed = match (own.desc.rigid, other.desc.rigid) {
                    (true, true) => 0.0,
                    (true, false) => other.stiffness_scale * depth,
                    (false, _) => own.stiffness_scale * nearby.at(&p).0.excess(&p),
                };
                *pressure = pressure.max(pressed);
            }
        }
        Ok(())
    }
}
