//! A closed triangle mesh as something to be approached: where it is nearest, on which side of it a point lies, points
//! spread over it, and whose bone they are.

use crate::error::{Result, out_of_range, require};
use crate::field::Shape;
use crate::math::Vec3;
use crate::surface::mesh;
use crate::surface::tree::Tree;

/// Bones that move the vertices of a mesh, as many for each vertex.
#[derive(Clone, Copy, Debug)]
pub struct Bones<'a> {
    /// How many influences each vertex has, from 1.
    pub per_vertex: usize,
    /// Numbers of bones, `per_vertex` a vertex.
    pub bones: &'a [u32],
    /// Their weights, as many: at least 0, not all of a vertex 0. They need not add up to 1.
    pub weights: &'a [f64],
}

/// Triangles in a tree.
#[derive(Debug, Default)]
pub struct Soup {
    shapes: Vec<Shape>,
    tree: Tree,
}

impl Soup {
    /// Sorts triangles, by their corners.
    pub fn new(triangles: impl Iterator<Item = [Vec3; 3]>) -> Self {
        let shapes: Vec<Shape> = triangles.map(|[a, b, c]| Shape::triangle(a, b, c)).collect();
        let mut tree = Tree::default();
        tree.build(shapes.iter().map(|shape| shape.bounds(0.0)));
        Self { shapes, tree }
    }

    /// The triangle nearest to a point, and its distance; `None` if there are no triangles.
    pub fn nearest(&self, p: &Vec3) -> Option<(u32, f64)> {
        self.tree.nearest(p, f64::INFINITY, |number| self.shapes[number as usize].closest(p).distance)
    }
}

/// A closed mesh, in a frame in which its bounds have their middle at the origin and a diagonal of length 1.
#[derive(Debug)]
pub struct Target {
    /// Where the origin of the frame is \[m\].
    pub origin: Vec3,
    /// Diagonal of the bounds \[m\].
    pub diagonal: f64,
    /// Area of all triangles, in the frame.
    pub area: f64,
    faces: Vec<Face>,
    soup: Soup,
    /// The bones of each vertex with their weights.
    bones: Vec<Vec<(u32, f64)>>,
}

#[derive(Clone, Copy, Debug)]
struct Face {
    /// Its vertices, and where they are.
    vertices: [u32; 3],
    corners: [Vec3; 3],
    /// Outward unit normal.
    normal: Vec3,
    area: f64,
    /// Outward directions at the edges (from each corner to the next) and at the corners. By them the side of a point is
    /// told where an edge or a corner is nearest \[Bærentzen & Aanæs 2005, doi:10.1109/TVCG.2005.49\].
    edges: [Vec3; 3],
    tips: [Vec3; 3],
}

/// The place of a mesh that is nearest to a point.
#[derive(Clone, Copy, Debug)]
pub struct Foot {
    /// Where.
    pub point: Vec3,
    /// How far the point is from there: negative inside.
    pub distance: f64,
    /// Unit vector outwards there.
    pub outward: Vec3,
    /// Which bone has the most weight there.
    pub bone: u32,
}

/// A point of the surface.
#[derive(Clone, Copy, Debug)]
pub struct Sample {
    /// Where.
    pub point: Vec3,
    /// Outward unit normal.
    pub normal: Vec3,
    /// Which bone has the most weight there.
    pub bone: u32,
}

impl Target {
    /// Checks a mesh and makes it ready. Vertices at the same place are one, as meshes are often split along the seams of
    /// their textures; triangles with two corners at one place are passed over.
    ///
    /// # Errors
    ///
    /// Coordinates that are not finite, corners that are no vertex, a mesh that is not closed, not a manifold along its
    /// edges, inside out or without volume; bones that are not as many as they must be or have no weight.
    pub fn new(vertices: &[[f64; 3]], triangles: &[[u32; 3]], bones: Option<&Bones>) -> Result<Self> {
        let (low, high) = mesh::bounds(vertices, triangles)?;
        let diagonal = (high - low).norm();
        require("diagonal of the mesh", diagonal, "from 1e-9 to 1e9", |x| (1e-9..=1e9).contains(&x))?;
        let origin = 0.5 * (low + high);
        let bones = check_bones(vertices.len(), bones)?;

        let (first, welded) = weld(vertices, triangles);
        require("number of triangles with an area", welded.len() as f64, "at least 4: the mesh must be closed", |x| {
            x >= 4.0
        })?;
        let place = |vertex: u32| (Vec3::from(vertices[vertex as usize]) - origin) / diagonal;
        let mut faces: Vec<Face> = welded
            .iter()
            .map(|vertices| {
                let corners = vertices.map(place);
                let across = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
                let normal = across.try_normalize(1e-300).unwrap_or_default();
                let zero = [Vec3::zeros(); 3];
                Face { vertices: *vertices, corners, normal, area: 0.5 * across.norm(), edges: zero, tips: zero }
            })
            .collect();
        let neighbours = neighbours(&welded)?;
        let volume: f64 = faces.iter().map(|face| face.corners[0].dot(&face.normal) * face.area / 3.0).sum();
        if volume < 0.0 {
            let value = volume * diagonal.powi(3);
            return Err(out_of_range("volume of the mesh", value, "> 0: triangles run counterclockwise from outside"));
        }
        require("volume of the mesh over the cube of its diagonal", volume, "at least 1e-9", |x| x >= 1e-9)?;

        let normals: Vec<Vec3> = faces.iter().map(|face| face.normal).collect();
        let mut tips = vec![Vec3::zeros(); vertices.len()];
        for face in &mut faces {
            for (k, corner) in face.vertices.iter().enumerate() {
                // Corners may have come to the same place.
                let away = |other: usize| face.corners[(k + other) % 3] - face.corners[k];
                let to = |other: usize| away(other).try_normalize(0.0).unwrap_or_default();
                let angle = libm::acos(to(1).dot(&to(2)).clamp(-1.0, 1.0));
                tips[*corner as usize] += face.normal * angle;
            }
        }
        for (face, neighbours) in faces.iter_mut().zip(&neighbours) {
            face.tips = face.vertices.map(|vertex| tips[vertex as usize]);
            face.edges = neighbours.map(|other| face.normal + normals[other as usize]);
        }
        let soup = Soup::new(faces.iter().map(|face| face.corners));
        // The bones of vertices at one place are those of the first.
        let bones = first.iter().map(|first| bones.get(*first as usize).cloned().unwrap_or_default()).collect();
        let area = faces.iter().map(|face| face.area).sum();
        Ok(Self { origin, diagonal, area, faces, soup, bones })
    }

    /// The nearest place of the surface.
    pub fn foot(&self, p: &Vec3) -> Foot {
        let (number, distance) = self.soup.nearest(p).expect("a target has triangles");
        let face = &self.faces[number as usize];
        let point = self.soup.shapes[number as usize].closest_point(p);
        let shares = face.shares(&point);
        // What of the triangle it is: a corner has all of the shares, an edge all but one's.
        let outward = match shares.map(|share| share > 1e-9) {
            [true, false, false] => face.tips[0],
            [false, true, false] => face.tips[1],
            [false, false, true] => face.tips[2],
            [true, true, false] => face.edges[0],
            [false, true, true] => face.edges[1],
            [true, false, true] => face.edges[2],
            _ => face.normal,
        };
        // A triangle without area has no normal: those around it tell.
        let around = || face.edges.iter().sum::<Vec3>().try_normalize(1e-9).unwrap_or_default();
        let own = || if face.normal == Vec3::zeros() { around() } else { face.normal };
        let outward = outward.try_normalize(1e-9).unwrap_or_else(own);
        let distance = if (p - point).dot(&outward) < 0.0 { -distance } else { distance };
        Foot { point, distance, outward, bone: self.bone(face, shares) }
    }

    /// The bone with the most weight at a point of a face.
    fn bone(&self, face: &Face, shares: [f64; 3]) -> u32 {
        let mut sums: Vec<(u32, f64)> = Vec::new();
        for (vertex, share) in face.vertices.iter().zip(shares) {
            for (bone, weight) in &self.bones[*vertex as usize] {
                match sums.iter_mut().find(|(other, _)| other == bone) {
                    Some((_, sum)) => *sum += weight * share,
                    None => sums.push((*bone, weight * share)),
                }
            }
        }
        // Of equals the one with the lowest number.
        sums.into_iter().min_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0))).map_or(0, |(bone, _)| bone)
    }

    /// Points evenly spread over the surface: each has the same share of its area. The same number gives the same points.
    pub fn samples(&self, count: usize) -> Vec<Sample> {
        let mut samples = Vec::with_capacity(count);
        let (mut below, mut number) = (0.0, 0);
        for face in &self.faces {
            below += face.area;
            while number < count && (number as f64 + 0.5) * self.area < below * count as f64 {
                // Numbers of an irrational grid, folded into the triangle \[Roberts 2018\].
                let spread = |step: f64| (0.5 + step * number as f64).fract();
                let (u, v) = (spread(0.754_877_666_246_692_7), spread(0.569_840_290_998_053_2));
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let shares = [1.0 - u - v, u, v];
                let point = face.corners.iter().zip(shares).map(|(corner, share)| corner * share).sum();
                samples.push(Sample { point, normal: face.normal, bone: self.bone(face, shares) });
                number += 1;
            }
        }
        samples
    }

    /// The corners of all triangles, some of them several times.
    pub fn corners(&self) -> impl Iterator<Item = Vec3> + '_ {
        self.faces.iter().flat_map(|face| face.corners)
    }
}

impl Face {
    /// Shares of the corners in a point of the triangle.
    fn shares(&self, p: &Vec3) -> [f64; 3] {
        let [a, b, c] = self.corners;
        let across = |b: &Vec3, c: &Vec3| (b - p).cross(&(c - p)).dot(&self.normal);
        let parts = [across(&b, &c), across(&c, &a), across(&a, &b)].map(|part| part.max(0.0));
        let sum: f64 = parts.iter().sum();
        if sum > 0.0 { parts.map(|part| part / sum) } else { [1.0 / 3.0; 3] }
    }
}

/// The bones of each vertex; none without bones.
fn check_bones(vertices: usize, bones: Option<&Bones>) -> Result<Vec<Vec<(u32, f64)>>> {
    let Some(Bones { per_vertex, bones, weights }) = bones else { return Ok(Vec::new()) };
    require("bones per vertex", *per_vertex as f64, "at least 1", |x| x >= 1.0)?;
    let needed = per_vertex.saturating_mul(vertices);
    if bones.len() != needed || weights.len() != needed {
        let value = format_args!("{} with {} weights for {vertices} vertices", bones.len(), weights.len());
        return Err(out_of_range(
            "number of bones",
            value,
            "bones per vertex times the number of vertices, like weights",
        ));
    }
    let each = bones.chunks(*per_vertex).zip(weights.chunks(*per_vertex));
    each.enumerate()
        .map(|(vertex, (bones, weights))| {
            let refuse = |weight: f64, range| {
                out_of_range("weight of a bone", format_args!("{weight} (vertex {vertex})"), range)
            };
            if let Some(bad) = weights.iter().find(|weight| !(0.0..=1e60).contains(*weight)) {
                return Err(refuse(*bad, "from 0 to 1e60"));
            }
            let sum: f64 = weights.iter().sum();
            if sum <= 0.0 {
                return Err(refuse(sum, "> 0 for one of the vertex at least"));
            }
            let some = bones.iter().zip(weights).filter(|(_, weight)| **weight > 0.0);
            Ok(some.map(|(bone, weight)| (*bone, weight / sum)).collect())
        })
        .collect()
}

/// For each vertex the first one at the same place, and the triangles with these as corners, but for those with two alike.
fn weld(vertices: &[[f64; 3]], triangles: &[[u32; 3]]) -> (Vec<u32>, Vec<[u32; 3]>) {
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    // The sum makes one zero of both.
    let key = |vertex: u32| vertices[vertex as usize].map(|x| (x + 0.0).to_bits());
    order.sort_by_key(|vertex| (key(*vertex), *vertex));
    let mut first: Vec<u32> = (0..vertices.len() as u32).collect();
    for pair in order.windows(2) {
        if key(pair[0]) == key(pair[1]) {
            first[pair[1] as usize] = first[pair[0] as usize];
        }
    }
    let welded = triangles.iter().map(|triangle| triangle.map(|corner| first[corner as usize]));
    let welded = welded.filter(|[a, b, c]| a != b && b != c && c != a).collect();
    (first, welded)
}

/// For each edge of each triangle, from a corner to the next, the triangle beyond it.
fn neighbours(triangles: &[[u32; 3]]) -> Result<Vec<[u32; 3]>> {
    // Each edge by its lower and its upper vertex, whether it runs down, and whose it is.
    let mut edges = Vec::with_capacity(3 * triangles.len());
    for (number, triangle) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (from, to) = (triangle[k], triangle[(k + 1) % 3]);
            edges.push((from.min(to), from.max(to), from > to, number, k));
        }
    }
    edges.sort_unstable();
    let mut neighbours = vec![[0; 3]; triangles.len()];
    for group in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let [(_, _, false, one, at), (_, _, true, other, beside)] = group else {
            let (low, high, ..) = group[0];
            let forth = group.iter().filter(|edge| !edge.2).count();
            let back = group.len() - forth;
            let value = format_args!("run {forth} times from vertex {low} to {high} and {back} times back");
            return Err(out_of_range(
                "an edge of the mesh",
                value,
                "run once each way: closed, in triangles that all turn one way",
            ));
        };
        neighbours[*one][*at] = *other as u32;
        neighbours[*other][*beside] = *one as u32;
    }
    Ok(neighbours)
}
