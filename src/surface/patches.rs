//! Meshes of territories for display, of fixed topology \[97, III-D.2, Fig. 8\]: a vertex or a small polygon for each
//! seed of a skeleton, valid or not.
//!
//! *Patches* join the seeds of a skeleton to a closed mesh that goes wherever its seeds go. Which are joined depends on
//! the rays alone: it is their hull on the offset surface of the isolated shape. That surface is convex, but has flat
//! and straight parts, where the hull would lose points; so each point is first moved towards the middle, to where
//! `g² + η |v|²/L² = 1`, `g` the gauge of the surface, 1 at the points, and `L` their largest distance from the middle:
//! a strictly convex surface, on which all points are corners of the hull, and neighbours stay neighbours.
//!
//! *Scales* are hexagons that lie in the tangent planes of the surface, each as large as what its ray stands for, and
//! some more, so that they overlap. Nothing of either costs more than the seeds once the topology is known.

use crate::coat::seeds::Ray;
use crate::coat::territory::Seed;
use crate::field::Shape;
use crate::math::{Vec3, tangents};

/// How far the hull's surface is from the offset surface towards a ball: `η`.
const ROUNDNESS: f64 = 0.2;
/// Offset at least, over the extent of the shape: the sides of flat shapes are kept apart.
const FATTEST: f64 = 0.25;
/// Points are shaken by this fraction of their distance from the middle, so that no four lie on a circle.
const SHAKE: f64 = 1e-9;

/// Corners of a scale.
pub const CORNERS: usize = 6;
/// How much wider a scale is than what its ray stands for.
const OVERLAP: f64 = 1.5;

/// The triangles that join the rays of a bounded shape, counterclockwise from outside; a closed manifold with all rays,
/// of which there are at least four. `rays` are in the frame of the shape.
pub fn patch(shape: &Shape, thickness: f64, rays: &[Ray]) -> Vec<[u32; 3]> {
    let middle = shape.middle();
    let extent = rays.iter().map(|ray| (ray.foot - middle).norm()).fold(0.0, f64::max);
    let offset = thickness.max(FATTEST * extent);
    let places: Vec<Vec3> = rays.iter().map(|ray| ray.at(offset) - middle).collect();
    let largest = places.iter().map(Vec3::norm).fold(0.0, f64::max);
    let on_hull = places.iter().enumerate().map(|(index, v)| {
        let gauge = (1.0 + ROUNDNESS * v.norm_squared() / (largest * largest)).sqrt();
        let shaken = 1.0 + SHAKE * (index as f64 * 0.618_033_988_749_894_9).fract();
        v * (shaken / (gauge * largest))
    });
    Hull::of(&on_hull.collect::<Vec<_>>())
}

/// The corners of the scale of a seed, counterclockwise from outside.
pub fn scale(ray: &Ray, seed: &Seed) -> [Vec3; CORNERS] {
    // A regular hexagon with corners at a distance of 1 has an area of 3/2 √3.
    let area = ray.weight * ray.jacobian(seed.distance);
    let radius = OVERLAP * (area / (1.5 * 3.0_f64.sqrt())).sqrt();
    let (e1, e2) = tangents(&seed.normal);
    let turn = |k: usize| libm::sincos(k as f64 * std::f64::consts::TAU / CORNERS as f64);
    std::array::from_fn(|k| {
        let (sine, cosine) = turn(k);
        seed.position + (e1 * cosine + e2 * sine) * radius
    })
}

/// The triangles of the scales of this many seeds.
pub fn scale_triangles(count: usize, out: &mut Vec<[u32; 3]>) {
    for seed in 0..count {
        let corner = |k: usize| (seed * CORNERS + k) as u32;
        out.extend((1..CORNERS - 1).map(|k| [corner(0), corner(k), corner(k + 1)]));
    }
}

/// The hull of points on a strictly convex surface, grown point by point.
struct Hull<'a> {
    points: &'a [Vec3],
    faces: Vec<Face>,
    /// For each point, the new face that begins with it.
    first: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Face {
    corners: [u32; 3],
    /// The faces at the sides: from the first corner to the second, and so on.
    near: [u32; 3],
    alive: bool,
}

impl<'a> Hull<'a> {
    fn of(points: &'a [Vec3]) -> Vec<[u32; 3]> {
        let mut order = scattered(points.len());
        let mut hull = Hull { points, faces: Vec::new(), first: vec![0; points.len()] };
        hull.begin(&mut order);
        order[4..].iter().for_each(|point| hull.add(*point));
        hull.faces.iter().filter(|face| face.alive).map(|face| face.corners).collect()
    }

    /// How far a point is above a face.
    fn height(&self, corners: &[u32; 3], point: u32) -> f64 {
        let [a, b, c] = corners.map(|corner| self.points[corner as usize]);
        (b - a).cross(&(c - a)).dot(&(self.points[point as usize] - a))
    }

    /// A tetrahedron of the first four points, the fourth chosen to be the farthest from the plane of the others.
    fn begin(&mut self, order: &mut [u32]) {
        let base = [order[0], order[1], order[2]];
        let height = |point: &u32| self.height(&base, *point);
        let farthest = (3..order.len()).max_by(|i, j| height(&order[*i]).abs().total_cmp(&height(&order[*j]).abs()));
        order.swap(3, farthest.unwrap_or(3));
        let [a, b, c] = if height(&order[3]) > 0.0 { [base[0], base[2], base[1]] } else { base };
        let d = order[3];
        let face = |corners, near| Face { corners, near, alive: true };
        self.faces.push(face([a, b, c], [1, 2, 3]));
        self.faces.push(face([b, a, d], [0, 3, 2]));
        self.faces.push(face([c, b, d], [0, 1, 3]));
        self.faces.push(face([a, c, d], [0, 2, 1]));
    }

    /// Joins a point to the border of the faces that it sees.
    fn add(&mut self, point: u32) {
        let start = self.below(point);
        let mut seen = vec![start];
        let mut border = Vec::new();
        self.faces[start].alive = false;
        let mut at = 0;
        while at < seen.len() {
            let Face { corners, near, .. } = self.faces[seen[at]];
            for side in 0..3 {
                let other = near[side] as usize;
                if !self.faces[other].alive {
                    continue;
                }
                if self.height(&self.faces[other].corners, point) > 0.0 {
                    self.faces[other].alive = false;
                    seen.push(other);
                } else {
                    border.push((corners[side], corners[(side + 1) % 3], other));
                }
            }
            at += 1;
        }
        self.close(point, &border);
    }

    fn close(&mut self, point: u32, border: &[(u32, u32, usize)]) {
        let begin = self.faces.len();
        for (index, (a, b, other)) in border.iter().enumerate() {
            let new = (begin + index) as u32;
            self.first[*a as usize] = new;
            let side = (0..3).find(|side| self.faces[*other].corners[*side] == *b);
            let side = side.expect("neighbours share a side");
            self.faces[*other].near[side] = new;
            self.faces.push(Face { corners: [*a, *b, point], near: [*other as u32, 0, 0], alive: true });
        }
        for index in begin..self.faces.len() {
            let next = self.first[self.faces[index].corners[1] as usize];
            self.faces[index].near[1] = next;
            self.faces[next as usize].near[2] = index as u32;
        }
    }

    /// The face that a ray from the middle to a point goes through: a walk from the newest face, across sides that have
    /// the point on their other side.
    fn below(&self, point: u32) -> usize {
        let p = &self.points[point as usize];
        let mut at = self.faces.len() - 1;
        for _ in 0..self.faces.len() {
            let face = &self.faces[at];
            let beyond = |side: &usize| {
                let [a, b] = [*side, (side + 1) % 3].map(|k| self.points[face.corners[k] as usize]);
                a.cross(&b).dot(p) < 0.0
            };
            match (0..3).find(beyond) {
                Some(side) => at = face.near[side] as usize,
                None => break,
            }
        }
        if self.height(&self.faces[at].corners, point) > 0.0 {
            return at;
        }
        // The middle is not in the hull yet: the face that it is highest above.
        let alive = (0..self.faces.len()).filter(|face| self.faces[*face].alive);
        let height = |face: usize| self.height(&self.faces[face].corners, point);
        alive.max_by(|a, b| height(*a).total_cmp(&height(*b))).unwrap_or(at)
    }
}

/// The numbers below `count` in an order without neighbours, so that a hull is near its size early.
fn scattered(count: usize) -> Vec<u32> {
    let common = |mut a: usize, mut b: usize| {
        while b > 0 {
            (a, b) = (b, a % b);
        }
        a
    };
    let near = (count as f64 * 0.381_966) as usize;
    let stride = (near.max(1)..).find(|stride| common(*stride, count) == 1).unwrap_or(1);
    (0..count).map(|index| (index * stride % count) as u32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coat::seeds::rays;
    use crate::field::skeleton::tests::bounded_shapes;
    use proptest::prelude::*;
    use std::collections::HashSet;

    proptest! {
        #[test]
        fn patches_are_closed_with_a_corner_at_each_ray(
            shape in bounded_shapes(0.01), thickness in 0.01..2.0f64, count in 4usize..400,
        ) {
            let mut all = Vec::new();
            rays(&shape, thickness, count, &mut all);
            let triangles = patch(&shape, thickness, &all);
            // Euler: a sphere.
            prop_assert_eq!(triangles.len(), 2 * all.len() - 4);
            let sides: HashSet<(u32, u32)> =
                triangles.iter().flat_map(|t| (0..3).map(|k| (t[k], t[(k + 1) % 3]))).collect();
            prop_assert_eq!(sides.len(), 3 * triangles.len());
            prop_assert!(sides.iter().all(|(a, b)| sides.contains(&(*b, *a))));
            let corners: HashSet<u32> = triangles.iter().flatten().copied().collect();
            prop_assert_eq!(corners.len(), all.len());
            // Outwards, and nearly all of the offset coat.
            let at = |corner: u32| all[corner as usize].at(thickness);
            let volume: f64 = triangles.iter().map(|t| {
                let [a, b, c] = t.map(|corner| at(corner) - shape.middle());
                a.dot(&b.cross(&c)) / 6.0
            }).sum();
            prop_assert!(volume > 0.0);
        }
    }

    #[test]
    fn patches_of_many_seeds_have_the_volume_of_the_coat() {
        let cube =
            Shape::Box { center: Vec3::zeros(), half: Vec3::new(1.0, 0.6, 0.3), axes: crate::math::Mat3::identity() };
        let segment = Shape::Segment(Vec3::zeros(), Vec3::new(0.0, 0.0, 2.0));
        for shape in [Shape::Point(Vec3::zeros()), segment, cube] {
            let mut all = Vec::new();
            rays(&shape, 0.3, 4000, &mut all);
            let volume: f64 = patch(&shape, 0.3, &all)
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|corner| all[corner as usize].at(0.3) - shape.middle());
                    a.dot(&b.cross(&c)) / 6.0
                })
                .sum();
            let exact = all.iter().map(|ray| ray.volume(0.3)).sum::<f64>() + crate::coat::seeds::core_volume(&shape);
            assert!((volume / exact - 1.0).abs() < 0.01, "{shape:?} {volume} {exact}");
        }
    }
}
