//! Particles at rest spacing that fill a shape.

use crate::math::Vec3;

/// Centres of densely packed balls at distance `spacing`: layers of triangles, each in the hollows of the last (a
/// face-centred cubic lattice), as far as `inside` says within the box from `low` to `high`.
pub fn packed(spacing: f64, low: &Vec3, high: &Vec3, inside: impl Fn(&Vec3) -> bool) -> Vec<Vec3> {
    let (row, layer) = (spacing * 3.0_f64.sqrt() / 2.0, spacing * (2.0_f64 / 3.0).sqrt());
    let size = high - low;
    // In the middle of what does not come out even.
    let even = |length: f64, step: f64| 0.5 * (length - (length / step).floor() * step);
    let start = low + Vec3::new(even(size.x, spacing), even(size.y, row), even(size.z, layer));
    let count = |length: f64, step: f64| (length / step) as i64 + 2;
    let mut points = Vec::new();
    for k in 0..count(size.z, layer) {
        for j in -1..count(size.y, row) {
            for i in -1..count(size.x, spacing) {
                let shift = (k % 3) as f64;
                let x = i as f64 + 0.5 * ((j + k % 3) as f64 - 2.0 * ((j + k % 3) as f64 / 2.0).floor());
                let y = j as f64 + shift / 3.0;
                let p = start + Vec3::new(x * spacing, y * row, k as f64 * layer);
                let within = (0..3).all(|axis| p[axis] >= low[axis] && p[axis] <= high[axis]);
                if within && inside(&p) {
                    points.push(p);
                }
            }
        }
    }
    points
}

/// Whether a closed triangle mesh contains a point: how often the mesh goes round it \[Jacobson et al. 2013\].
pub fn winds_round(vertices: &[[f64; 3]], triangles: &[[u32; 3]], p: &Vec3) -> bool {
    let mut turns = 0.0;
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| Vec3::from(vertices[corner as usize]) - p);
        let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
        let above = a.dot(&b.cross(&c));
        let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
        turns += 2.0 * libm::atan2(above, below);
    }
    turns.abs() > std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_particle_of_a_packing_has_twelve_neighbours_at_the_spacing() {
        let points = packed(0.1, &Vec3::repeat(-0.6), &Vec3::repeat(0.6), |_| true);
        let density = points.len() as f64 * 0.1_f64.powi(3) / 2.0_f64.sqrt() / 1.2_f64.powi(3);
        assert!((density - 1.0).abs() < 0.15, "{density}");
        for p in points.iter().filter(|p| p.amax() < 0.4) {
            let near = points.iter().map(|q| (q - p).norm()).filter(|d| *d > 0.0 && *d < 0.12);
            let near: Vec<f64> = near.collect();
            assert_eq!(near.len(), 12);
            assert!(near.iter().all(|d| (d - 0.1).abs() < 1e-12));
        }
    }

    #[test]
    fn a_tetrahedron_contains_its_middle_and_not_its_outside() {
        let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let triangles = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
        assert!(winds_round(&vertices, &triangles, &Vec3::repeat(0.2)));
        assert!(!winds_round(&vertices, &triangles, &Vec3::repeat(0.4)));
        assert!(!winds_round(&vertices, &triangles, &Vec3::repeat(-0.1)));
    }
}
