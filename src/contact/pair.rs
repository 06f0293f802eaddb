//! Two coats in one local frame: what every scheme asks about a point.
//!
//! With `α = f_a - c_a`, `β = f_b - c_b` and pressures `K_a α`, `K_b β`, the contact surface is where
//!
//! - the difference `Φ = w_a α - w_b β` is zero, `w_a = K_a / (K_a + K_b)`, `w_b = 1 - w_a` (rigid b: 0 and 1), and
//! - the sum `σ = α + β` is positive, which ends at the border of the contact.
//!
//! Parts of one body that don't blend meet in the same way, but for a neighbour that both blend with: within its
//! territory there is no contact of the two, so from `α` and `β` is taken what it rises above the isovalue, a [`Cover`].
//!
//! On that surface the pressure is `p = K σ` with `1/K = 1/K_a + 1/K_b`: one formula for every ratio of stiffness and
//! for rigid bodies, without the cancellation of `K_a α` (docs/model.md, "Contact surface").

use crate::base::Motion;
use crate::coat::seeds::Ray;
use crate::field::{Graph, Placed, Shape, blend};
use crate::math::{Mat3, Pose, Quat, Vec3};
use std::sync::Arc;

/// Ratio of stiffness beyond which the stiffer of two deformable bodies counts as rigid.
pub const RIGID_RATIO: f64 = 1e6;

/// One body of a pair, in the pair's frame.
#[derive(Debug, Default)]
pub struct Side {
    /// The skeletons that can matter for this pair, as placed by [`Pair::place`].
    pub skeletons: Vec<Placed>,
    /// How their fields go together.
    pub graph: Graph,
    /// For each skeleton, its position among the body's.
    pub positions: Vec<u32>,
    /// Their shapes in their links' frames.
    pub locals: Vec<Shape>,
    /// For each skeleton, its slot in the world.
    pub ids: Vec<u32>,
    /// For each skeleton, its link's slot in the world.
    pub links: Vec<u32>,
    /// For each skeleton, how far from it the surface may lie.
    pub reach: Vec<f64>,
    /// For each skeleton, its link's pose in the pair's frame.
    pub poses: Vec<Pose>,
    /// For each skeleton, its rays in its link's frame; none for a plane.
    pub rays: Vec<Arc<[Ray]>>,
    /// Field value on the surface.
    pub isovalue: f64,
    /// Pressure a unit of field \[Pa\].
    pub stiffness_scale: f64,
    /// The body keeps its shape.
    pub rigid: bool,
    /// Of many skeletons, where each has a field, as placed last; of a few nothing, since to ask would cost what it
    /// saves.
    pub balls: Vec<Ball>,
}

/// Skeletons of a side of which all are evaluated everywhere.
const FEW: usize = 3;

/// A ball outside which a skeleton has no field.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    center: Vec3,
    /// Of its radius \[m²\].
    square: f64,
}

impl Ball {
    fn around(skeleton: &Placed) -> Self {
        // Somewhat larger: rounding must cost no field.
        let radius = 1.000_001 * (skeleton.shape.half_extent() + skeleton.profile.radius);
        Self { center: skeleton.shape.middle(), square: radius * radius }
    }
}

impl Side {
    /// Forgets the skeletons, keeps the memory; and the rays, which will mostly be the same again.
    pub fn clear(&mut self) {
        self.skeletons.clear();
        self.graph.clear();
        self.positions.clear();
        self.locals.clear();
        self.ids.clear();
        self.links.clear();
        self.reach.clear();
        self.poses.clear();
        self.balls.clear();
    }

    /// `f - c` and its gradient.
    #[inline]
    pub fn excess(&self, p: &Vec3) -> (f64, Vec3) {
        let (value, gradient) = blend::value_gradient_of(&self.graph, self.near(p), p);
        (value - self.isovalue, gradient)
    }

    fn excess_hessian(&self, p: &Vec3) -> (f64, Vec3, Mat3) {
        let (value, gradient, hessian) = blend::value_gradient_hessian_of(&self.graph, self.near(p), p);
        (value - self.isovalue, gradient, hessian)
    }

    /// Tells `part` which skeletons make the field at a point, and how much of it each.
    pub fn parts(&self, p: &Vec3, part: impl FnMut(usize, f64)) {
        blend::parts(&self.graph, self.near(p), p, part);
    }

    /// The skeletons that may have a field at a point, with their positions: of few, all.
    #[inline]
    fn near(&self, p: &Vec3) -> impl Iterator<Item = (usize, &Placed)> {
        let p = *p;
        let reaches = move |ball: &Ball| (p - ball.center).norm_squared() <= ball.square;
        self.skeletons.iter().enumerate().filter(move |(index, _)| self.balls.get(*index).is_none_or(reaches))
    }

    fn find_balls(&mut self) {
        self.balls.clear();
        if self.skeletons.len() > FEW {
            self.balls.extend(self.skeletons.iter().map(Ball::around));
        }
    }

    /// Puts the skeletons where their links are, in a frame at `origin` with the world's axes.
    pub fn place(&mut self, motions: &[Motion], origin: &Vec3) {
        self.place_by(|link| local_pose(&motions[link as usize], origin));
    }

    fn place_by(&mut self, pose_of: impl Fn(u32) -> Pose) {
        for (index, link) in self.links.iter().enumerate() {
            let pose = pose_of(*link);
            self.poses[index] = pose;
            self.skeletons[index].shape = self.locals[index].transformed(&pose);
        }
        self.find_balls();
    }

    /// The only link of the side, when there is only one.
    pub fn only_link(&self) -> Option<u32> {
        let first = *self.links.first()?;
        self.links.iter().all(|link| *link == first).then_some(first)
    }

    /// A bound from above of `f - c` over the parallelepiped about `center` with these half sides: the distance to a
    /// convex core stays above its tangents, and fields fall with it.
    pub fn most(&self, center: &Vec3, legs: &[Vec3; 3]) -> f64 {
        const PLACES: [(f64, f64); 5] = [(0.0, 0.0), (1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)];
        let highest = |skeleton: &Placed| {
            let mut least = f64::NEG_INFINITY;
            for (x, y) in PLACES {
                let closest = skeleton.shape.closest(&(center + legs[0] * x + legs[1] * y));
                let rise = legs.map(|leg| closest.normal.dot(&leg));
                let fall = rise.iter().map(|rise| rise.abs()).sum::<f64>();
                least = least.max(closest.distance - rise[0] * x - rise[1] * y - fall);
                // Most skeletons are out of reach, as the first place shows.
                if least >= skeleton.profile.radius {
                    return 0.0;
                }
            }
            let solid = matches!(skeleton.shape, Shape::Box { .. } | Shape::Plane { .. });
            skeleton.profile.value_slope(if solid { least } else { least.max(0.0) }).0
        };
        // The field rises with each skeleton's, however they blend.
        let fields = self.skeletons.iter().enumerate().map(|(index, skeleton)| (index, highest(skeleton)));
        blend::together(&self.graph, fields) - self.isovalue
    }

    /// Pressure a metre of depth at the surface of a skeleton \[Pa/m\]; infinite for a rigid body.
    pub fn slope(&self, skeleton: usize) -> f64 {
        if self.rigid { f64::INFINITY } else { self.stiffness_scale * self.skeletons[skeleton].profile.stiffness }
    }
}

/// The pose of a link in a frame at `origin` with the world's axes.
fn local_pose(motion: &Motion, origin: &Vec3) -> Pose {
    pose_about(origin, &motion.center, motion.rotation, &motion.local_center)
}

/// The pose of a link in a frame about `origin`, from where its centre of mass is.
pub fn pose_about(origin: &Vec3, center: &Vec3, rotation: Quat, local_center: &Vec3) -> Pose {
    // The difference of the centres is exact where the sum of pose and origin would not be.
    Pose { position: (center - origin) - rotation * local_center, rotation }
}

/// A skeleton that blends with both sides of a pair, which are parts of one body.
#[derive(Clone, Copy, Debug)]
pub struct Cover {
    /// The skeleton, as placed by [`Pair::place`].
    pub skeleton: Placed,
    /// Its shape in its link's frame.
    pub local: Shape,
    /// Its link's slot in the world.
    pub link: u32,
    /// How much it blends with the one that it blends with less.
    pub weight: f64,
}

/// Two bodies, or two parts of one, of which at least one is deformable.
#[derive(Debug, Default)]
pub struct Pair {
    /// The first body.
    pub a: Side,
    /// The second body.
    pub b: Side,
    /// What lies between two parts of one body.
    pub covers: Vec<Cover>,
    wa: f64,
    wb: f64,
    /// Pressure a unit of `σ` \[Pa\].
    pub scale: f64,
    /// Origin of the pair's frame in the world, so that nothing is lost far from the world's own.
    pub origin: Vec3,
}

/// Both fields at a point.
#[derive(Clone, Copy, Debug, Default)]
pub struct Sample {
    /// `Φ`: positive on a's side of the contact surface.
    pub difference: f64,
    /// Its gradient.
    pub difference_gradient: Vec3,
    /// `σ`: positive where the coats overlap, on the surface.
    pub sum: f64,
    /// Its gradient.
    pub sum_gradient: Vec3,
    /// Gradient of `α`.
    pub gradient_a: Vec3,
    /// Gradient of `β`.
    pub gradient_b: Vec3,
}

impl Sample {
    /// The unit normal from a to b, `-∇Φ/|∇Φ|`; `None` where the gradient vanishes.
    pub fn normal(&self) -> Option<Vec3> {
        let length = self.difference_gradient.norm();
        (length > 1e-300).then(|| self.difference_gradient / -length)
    }

    /// Whether `σ` is above `least` on the surface next to the point, to first order.
    pub fn is_pressed(&self, least: f64) -> bool {
        let square = self.difference_gradient.norm_squared();
        square > 0.0 && self.sum - self.difference * self.sum_gradient.dot(&self.difference_gradient) / square > least
    }
}

impl Pair {
    /// Sets the weights from the two sides. Call after filling them.
    pub fn prepare(&mut self) {
        let (ka, kb) = (self.a.stiffness_scale, self.b.stiffness_scale);
        // Beyond this ratio the surface is the stiffer body's to the last digits that matter.
        if !self.a.rigid && !self.b.rigid {
            self.a.rigid = ka > RIGID_RATIO * kb;
            self.b.rigid = kb > RIGID_RATIO * ka;
        }
        (self.wa, self.wb, self.scale) = match (self.a.rigid, self.b.rigid) {
            (false, true) => (0.0, 1.0, ka),
            (true, false) => (1.0, 0.0, kb),
            _ => (ka / (ka + kb), kb / (ka + kb), ka * kb / (ka + kb)),
        };
    }

    /// Whether only one skeleton a side, and nothing between them, makes the contact: the distance of two convex shapes
    /// has one minimum, and so has their contact one deepest point.
    pub fn is_simple(&self) -> bool {
        self.a.skeletons.len() == 1 && self.b.skeletons.len() == 1 && self.covers.is_empty()
    }

    /// Each side's share of the stiffness, `w_a` and `w_b`: that of a rigid side is 1.
    pub fn shares(&self) -> [f64; 2] {
        [self.wa, self.wb]
    }

    /// Puts all skeletons where their links are; the frame's origin goes to the centre of mass of link `lead`.
    pub fn place(&mut self, motions: &[Motion], lead: u32) {
        self.place_about(motions, &motions[lead as usize].center);
    }

    /// The same with the frame's origin anywhere.
    pub fn place_about(&mut self, motions: &[Motion], origin: &Vec3) {
        self.place_by(origin, |link| local_pose(&motions[link as usize], origin));
    }

    /// Puts all skeletons where links have these poses in a frame about `origin`.
    pub fn place_by(&mut self, origin: &Vec3, pose_of: impl Fn(u32) -> Pose) {
        self.origin = *origin;
        self.a.place_by(&pose_of);
        self.b.place_by(&pose_of);
        for cover in &mut self.covers {
            let pose = pose_of(cover.link);
            cover.skeleton.shape = cover.local.transformed(&pose);
        }
    }

    /// The cover that is the highest at a point, if it rises above the isovalue.
    fn highest_cover(&self, p: &Vec3) -> Option<&Cover> {
        let heights = self.covers.iter().map(|cover| (cover.weight * cover.skeleton.value(p), cover));
        let risen = heights.filter(|(height, _)| *height > self.a.isovalue);
        risen.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, cover)| cover)
    }

    /// Whether a point lies in the territory of one that blends with both sides, so that these don't touch there,
    /// however close they are.
    pub fn is_covered(&self, p: &Vec3) -> bool {
        self.highest_cover(p).is_some() && self.sample(p).sum <= 0.0
    }

    fn combine(&self, (alpha, ga): (f64, Vec3), (beta, gb): (f64, Vec3)) -> Sample {
        Sample {
            difference: self.wa * alpha - self.wb * beta,
            difference_gradient: ga * self.wa - gb * self.wb,
            sum: alpha + beta,
            sum_gradient: ga + gb,
            gradient_a: ga,
            gradient_b: gb,
        }
    }

    /// Evaluates both fields at a point.
    #[inline]
    pub fn sample(&self, p: &Vec3) -> Sample {
        let (mut a, mut b) = (self.a.excess(p), self.b.excess(p));
        if let Some(cover) = self.highest_cover(p) {
            let (value, gradient) = cover.skeleton.value_gradient(p);
            let (over, slope) = (cover.weight * value - self.a.isovalue, gradient * cover.weight);
            (a, b) = ((a.0 - over, a.1 - slope), (b.0 - over, b.1 - slope));
        }
        self.combine(a, b)
    }

    /// Evaluates both fields, and the Hessian of `σ` along the surface: that of the Lagrangian `σ + λ Φ` with the
    /// multiplier that makes its gradient tangential.
    pub fn sample_hessian(&self, p: &Vec3) -> (Sample, Mat3) {
        let (mut alpha, mut ga, mut ha) = self.a.excess_hessian(p);
        let (mut beta, mut gb, mut hb) = self.b.excess_hessian(p);
        if let Some(cover) = self.highest_cover(p) {
            let (value, gradient, hessian) = cover.skeleton.value_gradient_hessian(p);
            let (over, slope, bend) =
                (cover.weight * value - self.a.isovalue, gradient * cover.weight, hessian * cover.weight);
            (alpha, ga, ha) = (alpha - over, ga - slope, ha - bend);
            (beta, gb, hb) = (beta - over, gb - slope, hb - bend);
        }
        let sample = self.combine((alpha, ga), (beta, gb));
        let square = sample.difference_gradient.norm_squared();
        if square < 1e-300 {
            return (sample, ha + hb);
        }
        let lambda = -sample.sum_gradient.dot(&sample.difference_gradient) / square;
        (sample, ha * (1.0 + lambda * self.wa) + hb * (1.0 - lambda * self.wb))
    }

    /// A bound of `σ` from above on the contact surface within the parallelepiped about `center` with these half sides.
    pub fn most(&self, center: &Vec3, legs: &[Vec3; 3]) -> f64 {
        // What a cover takes from both at least: the distance to a convex core is the largest at a corner.
        let corner = |k: u32| {
            let sign = |axis: u32| if k >> axis & 1 == 0 { 1.0 } else { -1.0 };
            center + legs[0] * sign(0) + legs[1] * sign(1) + legs[2] * sign(2)
        };
        let taken = self.covers.iter().map(|cover| {
            let least = (0..8).map(|k| cover.skeleton.value(&corner(k))).fold(f64::INFINITY, f64::min);
            cover.weight * least - self.a.isovalue
        });
        let taken = taken.fold(0.0, f64::max);
        // On the surface `w_a α = w_b β`, so `σ` is `α / w_b` and `β / w_a`.
        let share = |side: &Side, weight: f64| {
            if weight > 0.0 { (side.most(center, legs) - taken) / weight } else { f64::INFINITY }
        };
        let first = share(&self.a, self.wb);
        if first <= 0.0 { first } else { first.min(share(&self.b, self.wa)) }
    }

    /// The part of `-∇Φ` that the partner of a ray's body brings: `w_b ∇β` for a's rays, `w_a ∇α` for b's.
    pub fn others_part(&self, sample: &Sample, from_a: bool) -> Vec3 {
        if from_a { sample.gradient_b * self.wb } else { sample.gradient_a * self.wa }
    }

    /// Stiffness an area of the contact surface along its normal, `g_a g_b / (g_a + g_b)` with `g = K |∇f·n|`
    /// \[Pa/m\].
    pub fn normal_stiffness(&self, sample: &Sample, normal: &Vec3) -> f64 {
        let ga = self.a.stiffness_scale * sample.gradient_a.dot(normal).abs();
        let gb = self.b.stiffness_scale * sample.gradient_b.dot(normal).abs();
        match (self.a.rigid, self.b.rigid) {
            (false, true) => ga,
            (true, false) => gb,
            _ if ga + gb > 0.0 => ga * gb / (ga + gb),
            _ => 0.0,
        }
    }
}
