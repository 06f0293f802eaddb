//! Skins: vertices of a host's own mesh that follow a coat (docs/model.md, "Skins").
//!
//! [`bind`](Skin::bind) remembers for each vertex the field there, and whose it is. Then, whenever the links have moved:
//!
//! 1. each vertex goes with its links (`follow`): the blend of their motions, as dual quaternions;
//! 2. from there it goes along the gradient to where the field of the moved coat has the remembered value, and out of
//!    what presses on the coat (`settle`): implicit skinning, Vaillant et al. 2013, doi:10.1145/2461912.2461960.
//!
//! Vertices are sorted into blocks of neighbours, so that each block looks only at the skeletons near it. Nothing is
//! remembered from one time to the next: the same poses give the same bits.

mod follow;
mod settle;

pub use follow::Motion;

use super::nearby::Nearby;
use super::prepared::Prepared;
use crate::coat::Coat;
use crate::field::blend;
use crate::math::Vec3;
use follow::Blend;
use settle::{Settler, Vertex};

/// Vertices of a block: neighbours.
const BLOCK: usize = 64;
/// A vertex where the field was less than this part of the isovalue follows its links, and no more: there the field
/// hardly says where the vertex is.
const FAINT: f64 = 1e-3;

/// Vertices bound to a coat; in the order in which they are worked on.
#[derive(Debug, Default)]
pub struct Skin {
    vertices: Vec<Bound>,
    /// The links of each vertex with their weights, which add up to 1; the heaviest first.
    weights: Vec<(u32, f64)>,
    has_normals: bool,
}

/// A vertex as it was bound.
#[derive(Clone, Copy, Debug)]
struct Bound {
    /// Its number in the host's mesh.
    number: u32,
    position: Vec3,
    /// The host's normal there, if it has given any; otherwise as `outward`.
    normal: Vec3,
    /// Unit vector down the field.
    outward: Vec3,
    /// The field; none where it is faint.
    level: Option<f64>,
    /// Where its links are in the list of all, and how many.
    first: u32,
    count: u32,
}

/// Memory of [`Skin::deform`], to be used again.
#[derive(Debug, Default)]
pub struct Workspace {
    settler: Settler,
    blends: Vec<Blend>,
    vertices: Vec<Vertex>,
}

impl Skin {
    /// Binds vertices to a coat with at least one skeleton.
    ///
    /// - `links`: for each skeleton, the number of its link.
    /// - `vertices`: where, in the frame of the coat \[m\].
    /// - `normals`: unit vectors, as many; or none.
    ///
    /// The weight of a link is its skeletons' share of the field, as far as the blend graph lets them count; where no
    /// field reaches, the link of the nearest surface has all of it.
    pub fn bind(coat: &Coat, links: &[u32], vertices: &[Vec3], normals: Option<&[Vec3]>) -> Self {
        let mut skin = Self { has_normals: normals.is_some(), ..Self::default() };
        let mut nearby = Nearby::new(coat);
        for (number, position) in vertices.iter().enumerate() {
            let (small, near) = nearby.at(position);
            let first = skin.weights.len();
            let mut sum = 0.0;
            blend::parts(&small.graph, small.skeletons.iter().enumerate(), position, |index, part| {
                let link = links[near[index] as usize];
                sum += part;
                match skin.weights[first..].iter_mut().find(|(other, _)| *other == link) {
                    Some((_, weight)) => *weight += part,
                    None => skin.weights.push((link, part)),
                }
            });
            let (excess, gradient) = small.excess_gradient(position);
            let mut outward = (-gradient).try_normalize(0.0);
            if sum > 0.0 {
                skin.weights[first..].iter_mut().for_each(|(_, weight)| *weight /= sum);
                skin.weights[first..].sort_by(|a, b| b.1.total_cmp(&a.1));
            } else {
                let nearest = nearby.nearest(position).expect("the coat has skeletons");
                skin.weights.push((links[nearest], 1.0));
                outward = Some(coat.skeletons[nearest].shape.closest(position).normal);
            }
            let outward = outward.unwrap_or(Vec3::z());
            let value = excess + coat.isovalue;
            skin.vertices.push(Bound {
                number: number as u32,
                position: *position,
                normal: normals.map_or(outward, |normals| normals[number]),
                outward,
                level: (value >= FAINT * coat.isovalue).then_some(value),
                first: first as u32,
                count: (skin.weights.len() - first) as u32,
            });
        }
        skin.sort();
        skin
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.vertices.len()
    }

    /// Whether it has no vertices.
    pub fn is_empty(&self) -> bool {
        self.vertices.is_empty()
    }

    /// The links of a vertex, by its number in the host's mesh, with their weights.
    pub fn weights(&self, vertex: usize) -> &[(u32, f64)] {
        let bound = self.vertices.iter().find(|bound| bound.number as usize == vertex);
        bound.map_or(&[], |bound| self.weights_of(bound))
    }

    fn weights_of(&self, bound: &Bound) -> &[(u32, f64)] {
        &self.weights[bound.first as usize..][..bound.count as usize]
    }

    /// Puts vertices of one link, and then those near each other, in a row.
    fn sort(&mut self) {
        let Some(start) = self.vertices.first().map(|bound| bound.position) else { return };
        let bounds = (start, start);
        let grow = |(low, high): (Vec3, Vec3), bound: &Bound| (low.inf(&bound.position), high.sup(&bound.position));
        let (low, high) = self.vertices.iter().fold(bounds, grow);
        let scale = 1023.0 / (high - low).amax().max(f64::MIN_POSITIVE);
        let weights = &self.weights;
        self.vertices.sort_by_cached_key(|bound| {
            let place = ((bound.position - low) * scale).map(|x| x as u64);
            let code = (0..10).fold(0, |code, bit| {
                let [x, y, z] = [place.x >> bit & 1, place.y >> bit & 1, place.z >> bit & 1];
                code | (x | y << 1 | z << 2) << (3 * bit)
            });
            (weights[bound.first as usize].0, code, bound.number)
        });
    }

    /// Where the vertices are when the links have moved.
    ///
    /// - `motions`: of each link, from where it was at the binding to now, from the frame of then to the frame of now.
    /// - `coat`: the coat as it is now, and what presses on it, in the frame of now.
    /// - `tell`: gets each vertex' number, position \[m\] and unit normal, once, in any order.
    pub fn deform(
        &self,
        motions: &[Motion],
        coat: &mut Prepared,
        workspace: &mut Workspace,
        mut tell: impl FnMut(usize, Vec3, Vec3),
    ) {
        let Workspace { settler, blends, vertices } = workspace;
        for block in self.vertices.chunks(BLOCK) {
            blends.clear();
            vertices.clear();
            for bound in block {
                let blend = Blend::of(motions, self.weights_of(bound));
                vertices.push(Vertex::new(blend.point(&bound.position), bound.level));
                blends.push(blend);
            }
            settler.settle(coat, vertices);
            for ((bound, blend), vertex) in block.iter().zip(&*blends).zip(&*vertices) {
                let normal = match vertex.outward() {
                    Some(outward) if self.has_normals => {
                        turn(&blend.direction(&bound.outward), &outward, &blend.direction(&bound.normal))
                    }
                    Some(outward) => outward,
                    None => blend.direction(&bound.normal),
                };
                tell(bound.number as usize, vertex.position, normal);
            }
        }
    }
}

/// Turns a vector by the smallest rotation that takes the unit vector `from` to the unit vector `to`.
fn turn(from: &Vec3, to: &Vec3, vector: &Vec3) -> Vec3 {
    let (axis, cosine) = (from.cross(to), from.dot(to));
    if cosine < -0.999 {
        // Any axis would do: what is left of the direction along the surface says nothing.
        return *to;
    }
    vector * cosine + axis.cross(vector) + axis * (axis.dot(vector) / (1.0 + cosine))
}
