//! How far two surfaces are from each other.

use super::target::{Soup, Target};
use crate::coat::Coat;
use crate::error::Result;
use crate::math::Vec3;
use crate::surface::deformed::Deformed;
use crate::surface::mesh::coated::{Coated, Scratch};
use crate::surface::mesh::{self, Mesh};

/// Points of the mesh from which its distance is measured.
const POINTS: usize = 20_000;
/// Largest edge of the cells of the coat's mesh.
const CELL: f64 = 1.0 / 256.0;
/// The finest cells: finer ones would be too many.
const FINEST: f64 = 1.0 / 700.0;

/// Distance of two surfaces, measured from either to the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distance {
    /// Mean over the area of both.
    pub mean: f64,
    /// The largest of all.
    pub maximum: f64,
}

/// Meshes of coats in the frame of a target.
#[derive(Default)]
pub struct Mesher {
    scratch: Scratch,
    workspace: mesh::Workspace,
    /// The last one.
    pub mesh: Mesh,
}

impl Mesher {
    /// Meshes a coat, and gives it back.
    pub fn make(&mut self, coat: Coat, cell: f64) -> Result<Coat> {
        let deformed = Deformed { coat, ..Deformed::default() };
        mesh::mesh(&mut Coated::new(&deformed, &mut self.scratch), cell, &mut self.workspace, &mut self.mesh)?;
        Ok(deformed.coat)
    }

    /// Where the corners of a triangle are.
    pub fn corners(&self, triangle: &[u32; 3]) -> [Vec3; 3] {
        triangle.map(|corner| Vec3::from(self.mesh.positions[corner as usize]))
    }

    /// A third of the area of the triangles at each vertex.
    pub fn areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.mesh.positions.len()];
        for triangle in &self.mesh.triangles {
            let [a, b, c] = self.corners(triangle);
            let third = (b - a).cross(&(c - a)).norm() / 6.0;
            triangle.iter().for_each(|corner| areas[*corner as usize] += third);
        }
        areas
    }
}

/// Distance of a target and a coat in its frame, which has nothing thinner than `finest`: infinite if it has no surface.
pub fn distance(target: &Target, coat: Coat, finest: f64) -> Result<Distance> {
    let mut mesher = Mesher::default();
    mesher.make(coat, finest.clamp(FINEST, CELL))?;
    let soup = Soup::new(mesher.mesh.triangles.iter().map(|triangle| mesher.corners(triangle)));
    let to_coat = |p: &Vec3| soup.nearest(p).map_or(f64::INFINITY, |(_, distance)| distance);
    let samples = target.samples(POINTS);
    let (mut sum, mut maximum) = (0.0, 0.0_f64);
    for sample in &samples {
        let distance = to_coat(&sample.point);
        sum += distance;
        maximum = maximum.max(distance);
    }
    let there = sum / samples.len() as f64;
    maximum = target.corners().map(|corner| to_coat(&corner)).fold(maximum, f64::max);
    let (mut sum, mut area) = (0.0, 0.0);
    for (position, own) in mesher.mesh.positions.iter().zip(mesher.areas()) {
        let distance = target.foot(&Vec3::from(*position)).distance.abs();
        sum += own * distance;
        area += own;
        maximum = maximum.max(distance);
    }
    let back = if area > 0.0 { sum / area } else { f64::INFINITY };
    Ok(Distance { mean: 0.5 * (there + back), maximum })
}
