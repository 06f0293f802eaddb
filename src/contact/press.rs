//! Pressing: what a contact surface does to the links in a sub-step. Elastic pressure, its dissipation, and the papers'
//! viscous friction act node by node; dry friction follows in [`friction`](super::friction), patch by patch.

use super::pair::{Pair, Side};
use super::patch::{self, Node, Sums};
use crate::base::Motion;
use crate::field::Placed;
use crate::math::{Vec3, Wrench};

/// How the surfaces of two bodies rub and damp.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Material {
    /// Coulomb friction.
    pub friction: f64,
    /// Static friction; 0 is off.
    pub static_friction: f64,
    /// Product of the two viscous frictions \[N s/m³\].
    pub viscous: f64,
    /// Hunt-Crossley dissipation \[s/m\].
    pub dissipation: f64,
}

/// A link's part in what happens at a point of its body's coat.
#[derive(Clone, Copy, Debug)]
pub struct Share {
    /// Slot of the link.
    pub link: u32,
    /// Its part: they add up to one.
    pub weight: f64,
}

/// The links that carry a point of a contact, on both sides.
#[derive(Clone, Debug, Default)]
pub struct Carriers {
    /// Those of a.
    pub a: Vec<Share>,
    /// Those of b.
    pub b: Vec<Share>,
}

/// Arm of a point of the pair's frame from a link's centre of mass.
#[inline]
fn arm(motion: &Motion, origin: &Vec3, position: &Vec3) -> Vec3 {
    position - (motion.center - origin)
}

/// Splits a point of a side over its links by their fields there.
fn share(side: &Side, position: &Vec3, out: &mut Vec<Share>) {
    out.clear();
    if let Some(link) = side.only_link() {
        out.push(Share { link, weight: 1.0 });
        return;
    }
    let mut total = 0.0;
    // Whose field has no part in the body's there, has none in the load, and must not be tied to it.
    side.parts(position, |index, weight| {
        let link = side.links[index];
        total += weight;
        match out.iter_mut().find(|share| share.link == link) {
            Some(share) => share.weight += weight,
            None => out.push(Share { link, weight }),
        }
    });
    if total > 0.0 {
        for share in out.iter_mut() {
            share.weight /= total;
        }
        return;
    }
    // Where no field reaches, as in the middle of a gap, the closest skeleton's link carries what is there.
    let distance = |skeleton: &Placed| skeleton.shape.closest(position).distance;
    let closest = side.skeletons.iter().zip(&side.links).min_by(|a, b| distance(a.0).total_cmp(&distance(b.0)));
    out.clear();
    out.extend(closest.map(|(_, link)| Share { link: *link, weight: 1.0 }));
}

impl Carriers {
    /// Finds who carries a point.
    pub fn find(&mut self, pair: &Pair, position: &Vec3) {
        share(&pair.a, position, &mut self.a);
        share(&pair.b, position, &mut self.b);
    }

    /// Those of both: of a with negative weights, so that they make a relative velocity.
    pub fn both(&self) -> impl Iterator<Item = Share> + '_ {
        let opposed = |share: &Share| Share { weight: -share.weight, ..*share };
        self.a.iter().map(opposed).chain(self.b.iter().copied())
    }

    /// Velocity of b's flesh relative to a's at a point.
    pub fn slip(&self, motions: &[Motion], origin: &Vec3, position: &Vec3) -> Vec3 {
        let velocity = |shares: &[Share]| {
            let at = |share: &Share| {
                let motion = &motions[share.link as usize];
                motion.twist.at(&arm(motion, origin, position)) * share.weight
            };
            shares.iter().map(at).sum::<Vec3>()
        };
        velocity(&self.b) - velocity(&self.a)
    }

    /// Angular velocity of b relative to a.
    pub fn spin(&self, motions: &[Motion]) -> Vec3 {
        let angular = |shares: &[Share]| {
            shares.iter().map(|share| motions[share.link as usize].twist.angular * share.weight).sum::<Vec3>()
        };
        angular(&self.b) - angular(&self.a)
    }

    /// Change of [`slip`](Self::slip) by a unit impulse on b and its opposite on a, as a matrix \[1/kg\].
    pub fn mobility(&self, motions: &[Motion], origin: &Vec3, position: &Vec3) -> crate::math::Mat3 {
        self.a.iter().chain(&self.b).fold(crate::math::Mat3::zeros(), |sum, share| {
            let motion = &motions[share.link as usize];
            sum + motion.mobility_matrix(&arm(motion, origin, position)) * (share.weight * share.weight)
        })
    }

    /// Change of [`spin`](Self::spin) about `axis` by a unit angular impulse about it \[1/(kg m²)\].
    pub fn spin_mobility(&self, motions: &[Motion], axis: &Vec3) -> f64 {
        let answer = |share: &Share| {
            let impulse = Wrench { force: Vec3::zeros(), torque: *axis };
            motions[share.link as usize].answer(&impulse).angular.dot(axis) * share.weight * share.weight
        };
        self.a.iter().chain(&self.b).map(answer).sum()
    }

    /// Gives b an impulse at a point, and a its opposite there.
    pub fn push(&self, motions: &mut [Motion], origin: &Vec3, position: &Vec3, impulse: &Wrench) {
        for (shares, sign) in [(&self.a, -1.0), (&self.b, 1.0)] {
            for share in shares {
                let motion = &mut motions[share.link as usize];
                let arm = arm(motion, origin, position);
                let mut part = Wrench::default();
                part.add_scaled(impulse, sign * share.weight);
                part.torque += arm.cross(&part.force);
                motion.push(&part);
            }
        }
    }
}

/// A patch as dry friction sees it.
#[derive(Clone, Copy, Debug)]
pub struct Grip {
    /// Which candidate pair.
    pub candidate: usize,
    /// What names the patch, [`Patch::key`](super::patch::Patch::key).
    pub key: [u32; 3],
    /// Centre of pressure, in the pair's frame.
    pub position: Vec3,
    /// Mean normal, from a to b.
    pub normal: Vec3,
    /// Normal force \[N\].
    pub load: f64,
    /// Mean distance of the pressure from its centre: lever of the torsional friction \[m\].
    pub radius: f64,
}

/// Presses one patch for `h` seconds. Gives what it came to on b, dissipation included; nothing for an empty patch.
/// `forces` is working memory.
pub fn press(
    pair: &Pair,
    nodes: &[Node],
    material: &Material,
    h: f64,
    motions: &mut [Motion],
    carriers: &mut Carriers,
    forces: &mut Vec<Vec3>,
) -> Option<Sums> {
    let mut sums = patch::sum(nodes);
    let size = sums.force.norm();
    if size <= 0.0 {
        return None;
    }
    let origin = pair.origin;
    let (center, elastic) = (sums.center, sums.force);
    let single = pair.a.only_link().is_some() && pair.b.only_link().is_some();
    carriers.find(pair, &center);
    if single && material.dissipation == 0.0 && material.viscous == 0.0 {
        let impulse = Wrench { force: sums.force * h, torque: sums.torque * h };
        carriers.push(motions, &origin, &center, &impulse);
        return Some(sums);
    }
    // All nodes see the velocities from before the sub-step's pressure.
    let damping = Damping::new(material, &sums, &(elastic / size), h, pair, motions, carriers);
    forces.clear();
    for node in nodes {
        if !single {
            carriers.find(pair, &node.position);
        }
        forces.push(damping.damped(node, &carriers.slip(motions, &origin, &node.position)));
    }
    (sums.force, sums.torque) = (Vec3::zeros(), Vec3::zeros());
    for (node, force) in nodes.iter().zip(forces.iter()) {
        sums.force += force;
        sums.torque += (node.position - center).cross(force);
        if !single {
            carriers.find(pair, &node.position);
            carriers.push(motions, &origin, &node.position, &Wrench { force: force * h, torque: Vec3::zeros() });
        }
    }
    if single {
        carriers.push(motions, &origin, &center, &Wrench { force: sums.force * h, torque: sums.torque * h });
    } else {
        carriers.find(pair, &center);
    }
    Some(sums)
}

/// Dissipation of a patch in one sub-step, with the factors that make it stable at any rate.
struct Damping {
    dissipation: f64,
    /// What backward Euler takes off the pressure.
    relief: f64,
    viscous: f64,
}

impl Damping {
    fn new(
        material: &Material,
        elastic: &Sums,
        normal: &Vec3,
        h: f64,
        pair: &Pair,
        motions: &[Motion],
        carriers: &Carriers,
    ) -> Self {
        let mobility = carriers.mobility(motions, &pair.origin, &elastic.center);
        let along = normal.dot(&(mobility * normal));
        // Backward Euler for the rate: 1 - d v' with v' = v + W h F (1 - d v') is (1 - d v) / (1 + W h F d).
        let relief = 1.0 / (1.0 + along * h * elastic.force.norm() * material.dissipation);
        let viscous = material.viscous / (1.0 + mobility.trace() * h * material.viscous * elastic.area);
        Self { dissipation: material.dissipation, relief, viscous }
    }

    /// Force on b at a node where b moves with `slip` relative to a: Hunt-Crossley's `p (1 - d v_n)`, never
    /// adhesive, and viscous traction, whose normal part may take away the pressure but not pull.
    fn damped(&self, node: &Node, slip: &Vec3) -> Vec3 {
        let size = node.force.norm();
        if size <= 0.0 {
            return Vec3::zeros();
        }
        let normal = node.force / size;
        let parting = slip.dot(&normal);
        let pressing = size * self.relief * (1.0 - self.dissipation * parting).max(0.0);
        let drag = slip * (-self.viscous * node.area);
        let drag_normal = drag.dot(&normal);
        drag - normal * drag_normal + normal * (pressing + drag_normal).max(0.0)
    }
}

/// Mean distance of a patch's pressure from its centre \[m\].
pub fn friction_radius(nodes: &[Node], sums: &Sums) -> f64 {
    if let [_] = nodes {
        // A round patch whose pressure falls off as 1 - s²: ∫ s (1 - s²) s ds / ∫ (1 - s²) s ds = 8/15.
        return 8.0 / 15.0 * (sums.area / std::f64::consts::PI).sqrt();
    }
    let (mut moment, mut load) = (0.0, 0.0);
    for node in nodes {
        let force = node.force.norm();
        moment += force * (node.position - sums.center).norm();
        load += force;
    }
    moment / load
}
