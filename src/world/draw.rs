//! Debug drawing: lines and points that show what the library sees.

use super::World;
use crate::field::Shape;
use crate::math::{Vec3, tangents};

/// Receives lines and points, in the world \[m\]; colours are `0xRRGGBBAA`.
pub trait DebugDraw {
    /// A line from `a` to `b`.
    fn line(&mut self, a: &Vec3, b: &Vec3, color: u32);
    /// A point; `size` is the diameter it should have in the scene \[m\].
    fn point(&mut self, p: &Vec3, size: f64, color: u32);
}

/// What to draw, as bits that can be joined with `|`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DrawFlags(pub u32);

impl DrawFlags {
    /// Skeletons as points and wires; a plane as a grid round its point, with its normal.
    pub const SKELETONS: Self = Self(1);
    /// Seeds as points with normals: those on the surface, and those that end at another territory.
    pub const SEEDS: Self = Self(2);
    /// The contacts of the last step: an arrow for the force on the second body and the outline of a disc with the
    /// area of the patch. The longest arrow is four times the radius of the widest disc.
    pub const CONTACTS: Self = Self(4);
    /// The box that bounds the field of each body, unless it has a plane.
    pub const BOUNDS: Self = Self(8);

    /// Whether all bits of `other` are set.
    pub fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }
}

impl std::ops::BitOr for DrawFlags {
    type Output = Self;
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

const SKELETON: u32 = 0xe0e0_e0ff;
const SEED: u32 = 0x40c0_60ff;
const BLOCKED_SEED: u32 = 0x8080_80ff;
const FORCE: u32 = 0xff40_30ff;
const PATCH: u32 = 0xffc0_30ff;
const BOX: u32 = 0x4080_ffff;

/// Corners of the outline of a patch.
const DISC: usize = 24;
/// Lines on each side of the middle of a plane's grid.
const GRID: i32 = 5;

impl World {
    /// Draws the enabled bodies, as chosen by `flags`, into `sink`; unknown bits are ignored.
    pub fn debug_draw(&self, flags: DrawFlags, sink: &mut dyn DebugDraw) {
        for body in self.bodies.indices().filter(|body| self.bodies[*body].enabled) {
            let posed = self.posed_coat(body);
            if flags.contains(DrawFlags::SKELETONS) {
                for (placed, index) in posed.coat.skeletons.iter().zip(&posed.skeletons) {
                    let skeleton = &self.skeletons[*index];
                    let shape = skeleton.desc.shape.transformed(&self.links[skeleton.link as usize].desc.pose);
                    draw_shape(&shape, placed.profile.thickness, sink);
                }
            }
            if flags.contains(DrawFlags::SEEDS) {
                for index in &posed.skeletons {
                    self.draw_seeds(*index, sink);
                }
            }
            if flags.contains(DrawFlags::BOUNDS) {
                let (low, high) = posed.coat.bounds();
                let half = (high - low) * 0.5;
                if crate::math::is_finite(&half) && half.min() > 0.0 {
                    let axes = [Vec3::x() * half.x, Vec3::y() * half.y, Vec3::z() * half.z];
                    draw_box(&posed.globalise(&(low + half)), &axes, BOX, sink);
                }
            }
        }
        if flags.contains(DrawFlags::CONTACTS) {
            self.draw_contacts(sink);
        }
    }

    fn draw_seeds(&self, skeleton: usize, sink: &mut dyn DebugDraw) {
        let size = 0.05 * self.skeletons[skeleton].desc.thickness;
        for seed in self.seeds(self.skeletons.id_of(skeleton)).unwrap_or_default() {
            if seed.valid {
                sink.point(&seed.position, size, SEED);
                sink.line(&seed.position, &(seed.position + seed.normal * (4.0 * size)), SEED);
            } else {
                sink.point(&seed.position, size, BLOCKED_SEED);
            }
        }
    }

    fn draw_contacts(&self, sink: &mut dyn DebugDraw) {
        let radius = |area: f64| (area.max(0.0) / std::f64::consts::PI).sqrt();
        let widest = self.contacts().iter().map(|contact| radius(contact.area)).fold(0.0, f64::max);
        let strongest = self.contacts().iter().map(|contact| contact.force.norm()).fold(0.0, f64::max);
        for contact in self.contacts() {
            if strongest > 0.0 {
                let arrow = contact.force * (4.0 * widest / strongest);
                draw_arrow(&contact.position, &arrow, FORCE, sink);
            }
            let (e1, e2) = tangents(&contact.normal);
            let corner = |k: usize| {
                let (sine, cosine) = libm::sincos(k as f64 * std::f64::consts::TAU / DISC as f64);
                contact.position + (e1 * cosine + e2 * sine) * radius(contact.area)
            };
            for k in 0..DISC {
                sink.line(&corner(k), &corner((k + 1) % DISC), PATCH);
            }
        }
    }
}

fn draw_shape(shape: &Shape, thickness: f64, sink: &mut dyn DebugDraw) {
    match shape {
        Shape::Point(a) => sink.point(a, 0.2 * thickness, SKELETON),
        Shape::Segment(a, b) => sink.line(a, b, SKELETON),
        Shape::Triangle(a, b, c) => {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                sink.line(from, to, SKELETON);
            }
        }
        Shape::Box { center, half, axes } => {
            draw_box(center, &[0, 1, 2].map(|k| axes.column(k) * half[k]), SKELETON, sink);
        }
        Shape::Plane { point, normal } => {
            let (e1, e2) = tangents(normal);
            let reach = f64::from(GRID) * thickness;
            for k in -GRID..=GRID {
                let shift = f64::from(k) * thickness;
                for (along, across) in [(e1, e2), (e2, e1)] {
                    let middle = point + across * shift;
                    sink.line(&(middle - along * reach), &(middle + along * reach), SKELETON);
                }
            }
            draw_arrow(point, &(normal * (2.0 * thickness)), SKELETON, sink);
        }
    }
}

/// The twelve edges of a box with these half axes.
fn draw_box(center: &Vec3, axes: &[Vec3; 3], color: u32, sink: &mut dyn DebugDraw) {
    for k in 0..3 {
        let (along, i, j) = (axes[k], axes[(k + 1) % 3], axes[(k + 2) % 3]);
        for corner in [i + j, i - j, -i - j, -i + j] {
            sink.line(&(center + corner - along), &(center + corner + along), color);
        }
    }
}

fn draw_arrow(from: &Vec3, arrow: &Vec3, color: u32, sink: &mut dyn DebugDraw) {
    let Some(direction) = arrow.try_normalize(0.0) else { return };
    let tip = from + arrow;
    sink.line(from, &tip, color);
    let (e1, e2) = tangents(&direction);
    for side in [e1, -e1, e2, -e2] {
        sink.line(&tip, &(tip - arrow * 0.2 + side * (0.08 * arrow.norm())), color);
    }
}
