//! A watertight mesh of a solid: sparse marching cubes with vertices on the true surface and normals of the true field.
//!
//! How data flows, for any [`Solid`]:
//!
//! 1. a lattice of samples over the bounds of the parts; four by four by four of them make a *brick*, two by two by two
//!    bricks an *octet* (`lattice`);
//! 2. parts are sorted into the octets that they reach, so that the rest does not depend on how many there are;
//! 3. for each octet, bounds of the excess say which bricks are wholly inside or outside; the others become
//!    [`bricks`]: their parts, their samples, and one bit a sample;
//! 4. each edge of the lattice whose ends differ has a vertex, in the brick of its lower end: the root of the excess on
//!    the edge, from the same parts, many at once (`root`);
//! 5. each cell is looked up by the bits of its corners in a [`table`] that makes closed, oriented manifolds of any.
//!
//! The mesh is closed and manifold by construction: a sample has one bit, whoever looks, and what lies between the bits
//! is the table's. Vertices stay on their edges, so that the mesh does not fold over. The lattice is fixed to the frame
//! of the solid, off its round numbers: faces that lie there would have corners in them.

mod bricks;
pub mod coated;
mod lattice;
mod root;
pub mod table;

use crate::error::{Error, Result, out_of_range};
pub use crate::field::lanes::{Cubes, Spans};
use crate::math::Vec3;
use bricks::Bricks;
use lattice::{Lattice, Sorted};
use root::{Crossing, Roots, Sizes};
use table::{EDGES, TABLE};

/// What can be meshed: a field made of parts that reach a finite way, and its solid, where the excess is not negative.
pub trait Solid {
    /// How many parts there are.
    fn parts(&self) -> usize;

    /// Axis-aligned bounds of all that a part does to the field, as (low, high): finite. Where no part reaches, the
    /// excess is negative.
    fn bounds(&self, part: usize) -> (Vec3, Vec3);

    /// The smallest length that matters to the shape \[m\], such as a thickness: roots are found to a part of it.
    fn scale(&self) -> f64;

    /// Whether the slope of the field may jump, or nearly so: roots then take more looks.
    fn has_kinks(&self) -> bool;

    /// Whether each cube lies wholly inside or outside, `None` where that is not sure; which of these parts reach which
    /// cube goes into `spans`. Only some of the parts that reach the cubes may be given: then only what is inside
    /// counts, and must be so whatever the others are.
    fn look(&mut self, parts: &[u32], cubes: &Cubes, spans: &mut Spans) -> [Option<bool>; 8];

    /// The excess at points, and its gradients \[1/m\], where no parts but these reach.
    fn evaluate(&mut self, parts: &[u32], points: &[[f64; 3]], excess: &mut [f64], gradients: Option<&mut [[f64; 3]]>);
}

/// An indexed mesh of triangles. A watertight one is closed: each edge is between two triangles that run it both ways.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The vertices, on the surface \[m\].
    pub positions: Vec<[f64; 3]>,
    /// Outward unit normals of the surface there.
    pub normals: Vec<[f64; 3]>,
    /// Three vertices each, counterclockwise from outside.
    pub triangles: Vec<[u32; 3]>,
    /// Of meshes of territories: which vertices lie on the coat's surface. Empty for watertight ones, of which all do.
    pub valid: Vec<bool>,
}

impl Mesh {
    /// Takes everything out, and keeps the memory.
    pub fn clear(&mut self) {
        self.positions.clear();
        self.normals.clear();
        self.triangles.clear();
        self.valid.clear();
    }
}

/// Bounds of a host's mesh of triangles, as (low, high).
///
/// # Errors
///
/// When a coordinate is not finite, a corner of a triangle is no vertex, or there are no triangles.
pub fn bounds(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> Result<(Vec3, Vec3)> {
    for (index, p) in vertices.iter().enumerate() {
        if !p.iter().all(|x| x.abs() <= 1e60) {
            let value = format_args!("({}, {}, {}) (number {index})", p[0], p[1], p[2]);
            return Err(out_of_range("vertex of the mesh", value, "finite, at most 1e60"));
        }
    }
    let most = triangles.iter().flatten().copied().max().ok_or(Error::Unsupported("the mesh has no triangles"))?;
    if most as usize >= vertices.len() {
        return Err(out_of_range("corner of a triangle of the mesh", most, "below the number of vertices"));
    }
    let empty = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let corners = triangles.iter().flatten().map(|corner| Vec3::from(vertices[*corner as usize]));
    Ok(corners.fold(empty, |(low, high), p| (low.inf(&p), high.sup(&p))))
}

/// Memory of [`mesh`], to be used again: once it is large enough, a mesh asks for none.
#[derive(Debug, Default)]
pub struct Workspace {
    sorted: Sorted,
    bricks: Bricks,
    crossings: Vec<Crossing>,
    roots: Roots,
    /// For each brick, the vertices of the edges that begin at its samples, where these have any.
    vertices: Vec<[[u32; 3]; bricks::SAMPLES]>,
}

/// Puts the mesh of a solid's surface into `out`, in place of what was there, with cells of this edge \[m\].
///
/// What is thinner than a cell may be missed. Same input, same bits.
///
/// # Errors
///
/// When the cell is not larger than 0, or so small that the mesh would not fit in memory; `out` is as it was then.
pub fn mesh(solid: &mut impl Solid, cell: f64, workspace: &mut Workspace, out: &mut Mesh) -> Result<()> {
    let Some(lattice) = Lattice::over(solid, cell)? else {
        out.clear();
        return Ok(());
    };
    workspace.sorted.sort(solid, &lattice)?;
    workspace.bricks.fill(solid, &lattice, &workspace.sorted)?;
    out.clear();
    workspace.place_vertices(solid, &lattice, out);
    workspace.join_triangles(out);
    Ok(())
}

impl Workspace {
    /// A vertex for each edge whose ends differ, on the surface.
    fn place_vertices(&mut self, solid: &mut impl Solid, lattice: &Lattice, out: &mut Mesh) {
        let count = self.bricks.len();
        let sizes = Sizes { cell: lattice.cell, scale: solid.scale(), kinks: solid.has_kinks() };
        if self.vertices.len() < count {
            self.vertices.resize(count, [[0; 3]; bricks::SAMPLES]);
        }
        for brick in 0..count {
            let (near, corner) = (self.bricks.near(brick), self.bricks.corner(brick));
            self.crossings.clear();
            let first = out.positions.len();
            self.bricks.for_each_crossing(&near, |sample, axis| {
                self.vertices[brick][bricks::index(sample)][axis] = (first + self.crossings.len()) as u32;
                let mut end = sample;
                end[axis] += 1;
                let ends = [self.bricks.value(&near, sample), self.bricks.value(&near, end)];
                let base = lattice.position(corner, sample);
                self.crossings.push(Crossing::new(base, axis, ends));
            });
            if !self.crossings.is_empty() {
                let parts = self.bricks.parts(brick);
                self.roots.find(solid, parts, &sizes, &mut self.crossings);
                out.positions.extend(self.crossings.iter().map(|crossing| crossing.position(lattice.cell)));
                out.normals.extend(self.crossings.iter().map(|crossing| crossing.normal));
            }
        }
    }

    /// The triangles of each cell whose corners differ.
    fn join_triangles(&self, out: &mut Mesh) {
        let table = &*TABLE;
        for brick in 0..self.bricks.len() {
            let near = self.bricks.near(brick);
            self.bricks.for_each_mixed_cell(&near, |cell, case| {
                let [x, y, z] = cell;
                let corner = |k: usize| near.find([x + (k & 1), y + (k >> 1 & 1), z + (k >> 2)]);
                let corners: [(usize, usize); 8] = std::array::from_fn(corner);
                let vertex = |edge: u8| {
                    let (corner, axis) = EDGES[usize::from(edge)];
                    let (brick, index) = corners[corner];
                    self.vertices[brick][index][axis]
                };
                let triangles = table.triangles(case).iter();
                out.triangles.extend(triangles.map(|[a, b, c]| [vertex(*a), vertex(*b), vertex(*c)]));
            });
        }
    }
}
