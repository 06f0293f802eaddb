//! Patches: the pieces of contact surface that the schemes produce, as weighted points, and what they sum up to.

use super::Scheme;
use super::pair::Pair;
use crate::math::Vec3;

/// A weighted point of a contact surface, in the pair's frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Node {
    /// Where.
    pub position: Vec3,
    /// Elastic force on b: pressure times vector area \[N\].
    pub force: Vec3,
    /// Area \[m²\].
    pub area: f64,
    /// Normal stiffness, `g_a g_b / (g_a + g_b)` times the area \[N/m\].
    pub stiffness: f64,
}

impl Node {
    /// The same place with `weight` times what it carries.
    pub fn scaled(&self, weight: f64) -> Node {
        let Node { position, force, area, stiffness } = *self;
        Node { position, force: force * weight, area: area * weight, stiffness: stiffness * weight }
    }
}

/// One connected piece of contact surface.
#[derive(Clone, Copy, Debug)]
pub struct Patch {
    /// The skeletons whose territories hold the deepest point, as positions in the pair's sides.
    pub skeletons: [usize; 2],
    /// How many patches of the same skeletons were found before it.
    pub ordinal: u32,
    /// The deepest point, in the pair's frame.
    pub deepest: Vec3,
    /// The normal there, from a to b.
    pub normal: Vec3,
    /// Pressure there \[Pa\].
    pub peak_pressure: f64,
    /// How fast `σ` changes across the surface there: `σ` over it is about half the depth of the overlap \[1/m\].
    pub slope: f64,
    /// First and last-plus-one of its nodes.
    pub nodes: (usize, usize),
    /// Estimated relative error of the force.
    pub error_estimate: f64,
    /// Evaluations of the two fields.
    pub evaluations: u32,
    /// Who integrated it.
    pub scheme: Scheme,
    /// Past the most that the contact can carry; see [`overload`](super::overload).
    pub overloaded: bool,
}

impl Patch {
    /// The depth that motions of the contact are small or large against: half of the overlap or more \[m\].
    pub fn depth(&self, pair: &Pair) -> f64 {
        self.peak_pressure / pair.scale / self.slope
    }

    /// What names the patch from step to step: the slots of its skeletons, and which of theirs it is.
    pub fn key(&self, pair: &Pair) -> [u32; 3] {
        let [i, j] = self.skeletons;
        [pair.a.ids[i], pair.b.ids[j], self.ordinal]
    }
}

/// Sums over nodes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sums {
    /// Force on b \[N\].
    pub force: Vec3,
    /// Centre of pressure, in the pair's frame.
    pub center: Vec3,
    /// Torque on b about the centre \[N m\].
    pub torque: Vec3,
    /// Area \[m²\].
    pub area: f64,
    /// Normal stiffness \[N/m\].
    pub stiffness: f64,
}

/// Sums the nodes of one patch.
pub fn sum(nodes: &[Node]) -> Sums {
    let mut sums = Sums::default();
    let mut load = 0.0;
    for node in nodes {
        let magnitude = node.force.norm();
        sums.force += node.force;
        sums.center += node.position * magnitude;
        load += magnitude;
        sums.area += node.area;
        sums.stiffness += node.stiffness;
    }
    if load > 0.0 {
        sums.center /= load;
    }
    for node in nodes {
        sums.torque += (node.position - sums.center).cross(&node.force);
    }
    sums
}
