//! Contact surfaces that stand from one step to the next, while nothing that makes them changes and nobody moves.
//!
//! An implicit round takes each surface as linear in the motion about the pose of its evaluation. That pose may be the
//! last step's as well: what has moved by a thousandth of the depth since changes the force by a millionth beyond what
//! the stiffness says, and what has moved along by a thousandth of the width turns it by less than that. So contacts at
//! rest cost no evaluations, and those that bear little may move more.

use std::f64::consts::PI;

use super::pair::{Pair, Side, pose_about};
use super::patch::Node;
use super::surface::{self, Settings, Surface};
use crate::base::Motion;
use crate::field::{Placed, Profile, Shape};
use crate::math::{Quat, Twist, Vec3, rotation_to_vector};

/// Motion since the evaluation, across over the depth of a contact and along over its width, up to which its surface
/// stands.
const STILL: f64 = 5e-4;

/// How much farther that goes, at most, for a contact that bears little of the weight on it.
const MOST_EASE: f64 = 50.0;

/// Where the links of a pair were when its surface was evaluated, and of what: from that the surface can be made again,
/// bit for bit.
#[derive(Clone, Debug, Default)]
pub struct Standing {
    /// What tells whether a surface would be of the same coats, evaluated in the same way.
    pub likeness: u64,
    /// The links, the leading one first; none when no surface stands.
    pub places: Vec<Place>,
}

/// A link where it was.
#[derive(Clone, Copy, Debug, Default)]
pub struct Place {
    /// Slot of the link.
    pub link: u32,
    /// Its centre of mass \[m\].
    pub center: Vec3,
    /// Its rotation.
    pub rotation: Quat,
}

impl Standing {
    /// No surface stands.
    pub fn forget(&mut self) {
        self.places.clear();
    }

    /// Sets where the links of a pair are now.
    pub fn set(&mut self, pair: &Pair, lead: u32, likeness: u64, motions: &[Motion]) {
        self.likeness = likeness;
        self.places.clear();
        let covers = pair.covers.iter().map(|cover| &cover.link);
        for link in std::iter::once(&lead).chain(&pair.a.links).chain(&pair.b.links).chain(covers) {
            if self.of(*link).is_none() {
                let Motion { center, rotation, .. } = motions[*link as usize];
                self.places.push(Place { link: *link, center, rotation });
            }
        }
    }

    fn of(&self, link: u32) -> Option<&Place> {
        self.places.iter().find(|place| place.link == link)
    }

    /// Whether a surface of the pair still stands where the links are.
    pub fn stands(&self, pair: &Pair, surface: &Surface, motions: &[Motion]) -> bool {
        // What turns may bring other skeletons together, as far from the patch as the smaller side goes.
        let room = if pair.is_simple() { 0.0 } else { surface::extent(&pair.a).min(surface::extent(&pair.b)) };
        let weight = self.weight(motions);
        surface.is_sound()
            && surface.patches.iter().all(|patch| {
                let nodes = &surface.nodes[patch.nodes.0..patch.nodes.1];
                let load: f64 = nodes.iter().map(|node| node.force.norm()).sum();
                // What is left out is the load times the square of the motion over the depth.
                let ease = (weight / load).sqrt().clamp(1.0, MOST_EASE);
                let depth = patch.depth(pair);
                let square = |node: &Node| (patch.deepest - node.position).norm_squared();
                let area: f64 = nodes.iter().map(|node| node.area).sum();
                let size = nodes.iter().map(square).fold((depth * depth).max(area / PI), f64::max).sqrt();
                // Half the width of a long one.
                let width = area / (PI * size);
                self.places.iter().all(|place| {
                    let motion = &motions[place.link as usize];
                    let (moved, turned) = self.moved(place, pair, motion, &patch.deepest);
                    let across = moved.dot(&patch.normal);
                    let along = moved - patch.normal * across;
                    across.abs() + turned.norm() * size.max(room) <= STILL * depth * ease
                        && along.norm() <= STILL * width.max(depth * ease)
                })
            })
    }

    /// The least weight of the links, as their accelerations without contacts say; zero where nothing pulls.
    fn weight(&self, motions: &[Motion]) -> f64 {
        let movable =
            self.places.iter().map(|place| &motions[place.link as usize]).filter(|motion| motion.is_movable());
        let weight =
            movable.map(|motion| motion.acceleration.norm() / motion.inverse_mass()).fold(f64::INFINITY, f64::min);
        if weight.is_finite() { weight } else { 0.0 }
    }

    /// How far the coat of a link has moved at a place about the leading link's centre, and turned.
    fn moved(&self, place: &Place, pair: &Pair, motion: &Motion, at: &Vec3) -> (Vec3, Vec3) {
        let moved = motion.center - place.center;
        if is_round(pair, place.link, motion) {
            return (moved, Vec3::zeros());
        }
        let turned = rotation_to_vector(&(motion.rotation * place.rotation.inverse()));
        (moved + turned.cross(&(self.places[0].center + at - place.center)), turned)
    }

    /// Puts the skeletons of a pair where their links were.
    pub fn put_back(&self, pair: &mut Pair, motions: &[Motion]) {
        let origin = self.places[0].center;
        pair.place_by(&origin, |link| {
            let Motion { center, rotation, local_center, .. } = motions[link as usize];
            let (center, rotation) = self.of(link).map_or((center, rotation), |place| (place.center, place.rotation));
            pose_about(&origin, &center, rotation, &local_center)
        });
    }

    /// The centre of mass of a link, from which its arms to the surface go; of a round one, where it was.
    ///
    /// A ball takes its contact along as it rolls. If the force stayed where it was, it would lag behind the ball that it
    /// bears, and make it roll faster and faster.
    pub fn center(&self, pair: &Pair, link: u32, motion: &Motion) -> Vec3 {
        self.of(link).filter(|_| is_round(pair, link, motion)).map_or(motion.center, |place| place.center)
    }

    /// The velocity that would take the coat of a link in `h` seconds from where it is to where it was.
    pub fn velocity(&self, pair: &Pair, link: u32, motion: &Motion, h: f64) -> Twist {
        let Some(place) = self.of(link) else { return motion.twist };
        let linear = (place.center - motion.center) / h;
        let turn = || rotation_to_vector(&(place.rotation * motion.rotation.inverse())) / h;
        Twist { linear, angular: if is_round(pair, link, motion) { motion.twist.angular } else { turn() } }
    }
}

/// Whether turns of a link leave its coat as it is: all that the pair has of it are points at its centre of mass.
fn is_round(pair: &Pair, link: u32, motion: &Motion) -> bool {
    let round = |side: &Side| {
        let shapes = side.links.iter().zip(&side.locals).filter(|(of, _)| **of == link);
        shapes.map(|(_, shape)| shape).all(|shape| matches!(shape, Shape::Point(at) if *at == motion.local_center))
    };
    round(&pair.a) && round(&pair.b) && pair.covers.iter().all(|cover| cover.link != link)
}

/// What the surface of a pair depends on besides the places of its links, as one number.
pub fn likeness(pair: &Pair, lead: u32, settings: &Settings, motions: &[Motion]) -> u64 {
    let mut mark = Mark(settings.scheme as u64);
    mark.add_number(settings.tolerance);
    mark.add(u64::from(lead));
    for side in [&pair.a, &pair.b] {
        mark.add_side(side);
        for link in &side.links {
            mark.add_numbers(&motions[*link as usize].local_center);
        }
    }
    for cover in &pair.covers {
        mark.add_skeleton(&Placed { shape: cover.local, ..cover.skeleton });
        mark.add(u64::from(cover.link));
        mark.add_number(cover.weight);
        mark.add_numbers(&motions[cover.link as usize].local_center);
    }
    mark.0
}

/// Takes up numbers, bit for bit.
struct Mark(u64);

impl Mark {
    fn add(&mut self, bits: u64) {
        // Each multiplication is by an odd number, so that nothing gets lost; the shift brings high bits down.
        let mixed = (self.0 ^ bits).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        self.0 = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }

    fn add_number(&mut self, number: f64) {
        self.add(number.to_bits());
    }

    fn add_numbers<'a>(&mut self, numbers: impl IntoIterator<Item = &'a f64>) {
        numbers.into_iter().for_each(|number| self.add_number(*number));
    }

    fn add_side(&mut self, side: &Side) {
        self.add(u64::from(side.rigid));
        self.add_numbers(&[side.isovalue, side.stiffness_scale]);
        self.add_numbers(&side.reach);
        for (index, skeleton) in side.skeletons.iter().enumerate() {
            self.add_skeleton(&Placed { shape: side.locals[index], profile: skeleton.profile });
            self.add(u64::from(side.ids[index]) << 32 | u64::from(side.links[index]));
            self.add((side.rays[index].len() as u64) << 32 | u64::from(side.positions[index]));
        }
        side.graph.each_number(|bits| self.add(bits));
    }

    fn add_skeleton(&mut self, Placed { shape, profile }: &Placed) {
        let kind = match shape {
            Shape::Point(a) => (0, self.add_numbers(a)),
            Shape::Segment(a, b) => (1, self.add_numbers(a.iter().chain(b))),
            Shape::Triangle(a, b, c) => (2, self.add_numbers(a.iter().chain(b).chain(c))),
            Shape::Box { center, half, axes } => (3, self.add_numbers(center.iter().chain(half).chain(axes))),
            Shape::Plane { point, normal } => (4, self.add_numbers(point.iter().chain(normal))),
        };
        self.add(kind.0);
        let Profile { isovalue, thickness, stiffness, stiffening, radius, cap } = profile;
        self.add_numbers([isovalue, thickness, stiffness, stiffening, radius, cap]);
    }
}
