//! Descriptors: everything a host says about a world, a body, a link and a skeleton, with defaults and ranges.

use super::{Body, Link, Skeleton, Spring};
use crate::base::Kind;
pub use crate::contact::Scheme;
use crate::error::{Result, out_of_range, require, require_finite};
use crate::field::{Profile, Shape};
use crate::math::{Mat3, Pose, Quat, Twist, Vec3};
pub use crate::response::{Response, VelocityConvention};

/// Handle of a body.
pub type BodyId = crate::handle::Id<Body>;
/// Handle of a link.
pub type LinkId = crate::handle::Id<Link>;
/// Handle of a skeleton.
pub type SkeletonId = crate::handle::Id<Skeleton>;
/// Handle of a spring.
pub type SpringId = crate::handle::Id<Spring>;

/// Settings of a world.
#[derive(Clone, Debug, PartialEq)]
pub struct WorldDesc {
    /// Acceleration of gravity \[m/s²\].
    pub gravity: Vec3,
    /// How forces act in time.
    pub response: Response,
    /// How contact surfaces are integrated.
    pub scheme: Scheme,
    /// Relative error accepted in a contact force, from 1e-9 to 0.5.
    pub force_tolerance: f64,
    /// Seeds of a skeleton that does not say its own number, from 4 to 65536.
    pub seed_count: u32,
    /// Upper bound of the sub-steps in one step, from 1 to 65536.
    pub max_substeps: u32,
    /// Largest product of contact frequency and sub-step \[rad\], from 0.01 to 1.
    pub substep_phase: f64,
    /// Implicit response: most evaluations of a contact surface before the step is split, from 1 to 64.
    pub implicit_rounds: u32,
    /// Implicit response: how often a step that does not converge may be split in two, from 0 to 10.
    pub implicit_splits: u32,
    /// Implicit response: motion of a contact between two rounds, over its depth, that ends them, from 1e-9 to 1.
    pub implicit_tolerance: f64,
    /// Time for which an island must be at rest before it falls asleep \[s\]: at least 0; 0 is never.
    pub sleep_time: f64,
    /// Speed up to which a body counts as at rest, in thicknesses of its thinnest coat a second, from 0 to 1e6.
    pub sleep_speed: f64,
    /// Whether steps read the clock for [`World::times`](super::World::times).
    pub timed: bool,
}

impl Default for WorldDesc {
    fn default() -> Self {
        Self {
            gravity: Vec3::zeros(),
            response: Response::Auto,
            scheme: Scheme::Auto,
            force_tolerance: 5e-3,
            seed_count: 64,
            max_substeps: 4096,
            substep_phase: 0.2,
            implicit_rounds: 8,
            implicit_splits: 4,
            implicit_tolerance: 0.05,
            sleep_time: 0.0,
            sleep_speed: 0.01,
            timed: false,
        }
    }
}

impl WorldDesc {
    pub(crate) fn validate(&self) -> Result<()> {
        require_finite("gravity", &self.gravity)?;
        require("force_tolerance", self.force_tolerance, "from 1e-9 to 0.5", |x| (1e-9..=0.5).contains(&x))?;
        validate_seed_count(self.seed_count)?;
        require("max_substeps", self.max_substeps.into(), "from 1 to 65536", |x| (1.0..=65536.0).contains(&x))?;
        require("substep_phase", self.substep_phase, "from 0.01 to 1", |x| (0.01..=1.0).contains(&x))?;
        require("implicit_rounds", self.implicit_rounds.into(), "from 1 to 64", |x| (1.0..=64.0).contains(&x))?;
        require("implicit_splits", self.implicit_splits.into(), "from 0 to 10", |x| (0.0..=10.0).contains(&x))?;
        require("implicit_tolerance", self.implicit_tolerance, "from 1e-9 to 1", |x| (1e-9..=1.0).contains(&x))?;
        require("sleep_time", self.sleep_time, "finite and at least 0", |x| x >= 0.0)?;
        require("sleep_speed", self.sleep_speed, "from 0 to 1e6", |x| (0.0..=1e6).contains(&x))
    }
}

fn validate_seed_count(count: u32) -> Result<()> {
    require("seed_count", count.into(), "from 4 to 65536", |x| (4.0..=65536.0).contains(&x))
}

/// How a user says how stiff a body is. Of the last two, the stiffness scale follows from the body's mass, its
/// skeletons and the world's gravity, for rest on a hard floor on all its skeletons (docs/model.md, "Units"); without
/// mass or skeletons, `stiffness_scale` holds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum StiffnessRule {
    /// `stiffness_scale` holds.
    #[default]
    Scale,
    /// By how far it sinks into itself under its own weight.
    Sink {
        /// Sink over the thickness, > 0 and at most 0.5.
        fraction: f64,
    },
    /// By how fast it swings on its contact.
    Frequency {
        /// Frequency of small swings about rest, > 0 \[Hz\].
        hertz: f64,
        /// Damping over the critical one, from 0 to 10: replaces `dissipation`.
        damping_ratio: f64,
    },
}

/// One deformable or rigid object.
#[derive(Clone, Debug, PartialEq)]
pub struct BodyDesc {
    /// A rigid body keeps its shape; a contact's flesh is then all the other body's.
    pub rigid: bool,
    /// How contact forces act on it in time; [`Response::Auto`] leaves it to the world. What one body forces holds
    /// for all that it touches.
    pub response: Response,
    /// Field value on the surface, `c` > 0.
    pub isovalue: f64,
    /// Pressure a unit of field, `K` > 0 \[Pa\].
    pub stiffness_scale: f64,
    /// Another way to say how stiff it is, by which `K` is worked out.
    pub stiffness: StiffnessRule,
    /// Coefficient of Coulomb friction, from 0 to 1e6; a pair uses the geometric mean.
    pub friction: f64,
    /// Coefficient of static friction: 0, or from `friction` to 1e6; a pair uses the geometric mean.
    pub static_friction: f64,
    /// Viscous friction `λ`, from 0 to 1e6 \[√(N s/m³)\]; a pair uses the product \[97, eq. (20)\].
    pub viscous_friction: f64,
    /// Hunt-Crossley dissipation, from 0 to 1e6 \[s/m\]; a pair uses the mean weighted by the other's stiffness.
    pub dissipation: f64,
    /// What this body is, as bits.
    pub category: u64,
    /// Which categories it touches, as bits. Two bodies touch when each one's mask has a bit of the other's category.
    pub mask: u64,
    /// Width of the band in which the fields of groups that don't blend go over into each other, over the isovalue, from 0
    /// to 0.5: 0 leaves a crease. Only for bodies with a blend graph.
    pub blend_band: f64,
    /// Parts that don't blend collide, if they are of different links.
    pub self_contact: bool,
    /// It may fall asleep, where [`WorldDesc::sleep_time`] lets bodies sleep.
    pub may_sleep: bool,
    /// Volume control: share of each skeleton's error in volume that a step takes back, from 0 (off) to 0.5, which is
    /// the best for most. See [`World::set_skeleton_target_volume`](super::World::set_skeleton_target_volume).
    pub volume_gain: f64,
    /// How far round its contacts its coat bulges, from 0 (not at all) to 1, over the isovalue: until the obstacle's
    /// field has fallen by so much. For queries with [`Deformation::Bulges`](super::Deformation); forces know no bulges.
    pub bulge_width: f64,
    /// Height of those bulges over the most that the contact compresses the coat, at least 0.
    pub bulge_height: f64,
    /// The host's own value.
    pub user_data: usize,
}

impl Default for BodyDesc {
    fn default() -> Self {
        Self {
            rigid: false,
            response: Response::Auto,
            isovalue: 1.0,
            stiffness_scale: 1e5,
            stiffness: StiffnessRule::Scale,
            friction: 0.0,
            static_friction: 0.0,
            viscous_friction: 0.0,
            dissipation: 0.0,
            category: 1,
            mask: u64::MAX,
            blend_band: 0.05,
            self_contact: true,
            may_sleep: true,
            volume_gain: 0.0,
            bulge_width: 0.0,
            bulge_height: 1.0,
            user_data: 0,
        }
    }
}

impl BodyDesc {
    pub(crate) fn validate(&self) -> Result<()> {
        let coefficient = |what, value| require(what, value, "from 0 to 1e6", |x| (0.0..=1e6).contains(&x));
        require("isovalue", self.isovalue, "> 0 and at most 1e9", |x| x > 1e-9 && x <= 1e9)?;
        require("stiffness_scale", self.stiffness_scale, "> 0 and at most 1e18", |x| x > 0.0 && x <= 1e18)?;
        match self.stiffness {
            StiffnessRule::Scale => {}
            StiffnessRule::Sink { fraction } => {
                require("static_sink", fraction, "> 0 and at most 0.5", |x| x > 0.0 && x <= 0.5)?;
            }
            StiffnessRule::Frequency { hertz, damping_ratio } => {
                require("contact_frequency", hertz, "> 0 and at most 1e6", |x| x > 0.0 && x <= 1e6)?;
                require("damping_ratio", damping_ratio, "from 0 to 10", |x| (0.0..=10.0).contains(&x))?;
            }
        }
        coefficient("friction", self.friction)?;
        coefficient("viscous_friction", self.viscous_friction)?;
        require("blend_band", self.blend_band, "from 0 to 0.5", |x| (0.0..=0.5).contains(&x))?;
        coefficient("dissipation", self.dissipation)?;
        require("volume_gain", self.volume_gain, "from 0 (off) to 0.5", |x| (0.0..=0.5).contains(&x))?;
        require("bulge_width", self.bulge_width, "from 0 to 1", |x| (0.0..=1.0).contains(&x))?;
        require("bulge_height", self.bulge_height, "from 0 to 1e6", |x| (0.0..=1e6).contains(&x))?;
        require("static_friction", self.static_friction, "0 (off), or from friction to 1e6", |x| {
            x == 0.0 || x > 0.0 && (self.friction..=1e6).contains(&x)
        })
    }
}

/// One moving frame of a body's base structure.
#[derive(Clone, Debug, PartialEq)]
pub struct LinkDesc {
    /// Who moves it.
    pub kind: Kind,
    /// The link's frame in the world.
    pub pose: Pose,
    /// Velocity of the centre of mass, and angular velocity, in the world.
    pub twist: Twist,
    /// Mass \[kg\]: > 0 for point masses and rigid solids; 0 makes a host-driven link kinematic; ignored for fixed ones.
    pub mass: f64,
    /// Centre of mass in the link's frame \[m\].
    pub local_center: Vec3,
    /// Inertia tensor about the centre of mass, in the axes of the link's frame \[kg m²\].
    pub inertia: Mat3,
    /// Factor on the world's gravity.
    pub gravity_scale: f64,
    /// Acceleration besides gravity and contact, in the world \[m/s²\].
    pub external_acceleration: Vec3,
    /// Angular acceleration besides contact and gyroscopic terms, in the world \[rad/s²\].
    pub external_angular_acceleration: Vec3,
    /// Host-driven links: which moment the host's velocities belong to.
    pub velocity_convention: VelocityConvention,
    /// Host-driven links: the host itself applies the gyroscopic torque.
    pub host_gyroscopic: bool,
    /// Host-driven links: joints or host contacts act on it in this tick, so that it does not move as its own mass
    /// would. The automatic response is implicit then.
    pub constrained: bool,
    /// Host-driven links: the 6×6 matrix from wrench at the centre of mass (force, torque) to acceleration (linear,
    /// angular), in the world, where joints change it.
    pub inverse_effective_inertia: Option<Box<nalgebra::Matrix6<f64>>>,
    /// The host's own value.
    pub user_data: usize,
}

impl Default for LinkDesc {
    fn default() -> Self {
        Self {
            kind: Kind::Fixed,
            pose: Pose::default(),
            twist: Twist::default(),
            mass: 0.0,
            local_center: Vec3::zeros(),
            inertia: Mat3::zeros(),
            gravity_scale: 1.0,
            external_acceleration: Vec3::zeros(),
            external_angular_acceleration: Vec3::zeros(),
            velocity_convention: VelocityConvention::Leapfrog,
            host_gyroscopic: false,
            constrained: false,
            inverse_effective_inertia: None,
            user_data: 0,
        }
    }
}

pub(crate) fn validate_pose(pose: &Pose) -> Result<()> {
    require_finite("position", &pose.position)?;
    let q: &Quat = &pose.rotation;
    let norm = q.as_ref().norm();
    require("norm of the rotation quaternion", norm, "1 within 1e-3", |x| (x - 1.0).abs() <= 1e-3)
}

pub(crate) fn validate_twist(twist: &Twist) -> Result<()> {
    require_finite("linear_velocity", &twist.linear)?;
    require_finite("angular_velocity", &twist.angular)
}

impl LinkDesc {
    pub(crate) fn validate(&self) -> Result<()> {
        validate_pose(&self.pose)?;
        validate_twist(&self.twist)?;
        require_finite("local_center_of_mass", &self.local_center)?;
        require("gravity_scale", self.gravity_scale, "finite", |_| true)?;
        require_finite("external_acceleration", &self.external_acceleration)?;
        require_finite("external_angular_acceleration", &self.external_angular_acceleration)?;
        match self.kind {
            Kind::Fixed => return Ok(()),
            Kind::Host => {
                require("mass of a host-driven link", self.mass, "0 (kinematic) or > 0, from 1e-60 to 1e60", |x| {
                    x == 0.0 || sane(x)
                })?
            }
            Kind::PointMass => {
                require("mass of a point mass", self.mass, MASS, sane)?;
                return require_at_origin(&self.local_center);
            }
            Kind::Rigid => require("mass of a rigid link", self.mass, MASS, sane)?,
        }
        if self.mass > 0.0 {
            validate_inertia(&self.inertia)?;
        }
        if let Some(matrix) = &self.inverse_effective_inertia {
            let symmetric = (**matrix - matrix.transpose()).abs().max() <= 1e-6 * matrix.abs().max();
            if !matrix.iter().all(|x| x.is_finite()) || !symmetric || matrix.cholesky().is_none() {
                return Err(out_of_range(
                    "inverse_effective_inertia",
                    "not a symmetric positive definite matrix",
                    "symmetric and positive definite",
                ));
            }
        }
        Ok(())
    }
}

/// Range of masses and moments: their powers are numbers too.
const MASS: &str = "> 0, from 1e-60 to 1e60";

fn sane(x: f64) -> bool {
    (1e-60..=1e60).contains(&x)
}

fn require_at_origin(center: &Vec3) -> Result<()> {
    if *center == Vec3::zeros() {
        return Ok(());
    }
    Err(out_of_range(
        "local_center_of_mass of a point mass",
        format_args!("({}, {}, {})", center.x, center.y, center.z),
        "the origin of its frame",
    ))
}

fn validate_inertia(inertia: &Mat3) -> Result<()> {
    let range = "symmetric and positive definite, no principal moment above the sum of the other two";
    let refuse = |why: String| Err(out_of_range("inertia", why, range));
    if !inertia.iter().all(|x| x.is_finite()) {
        return refuse("not finite".into());
    }
    if (inertia - inertia.transpose()).abs().max() > 1e-9 * inertia.abs().max() {
        return refuse("not symmetric".into());
    }
    let mut moments = inertia.symmetric_eigenvalues();
    moments.as_mut_slice().sort_by(f64::total_cmp);
    if !sane(moments[0]) || !sane(moments[2]) || moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-6) {
        return refuse(format!("of principal moments {}, {}, {}", moments[0], moments[1], moments[2]));
    }
    Ok(())
}

/// A primitive fixed in a link's frame, and the field it emits.
#[derive(Clone, Debug, PartialEq)]
pub struct SkeletonDesc {
    /// The primitive, in the link's frame.
    pub shape: Shape,
    /// Distance of the surface from an isolated skeleton \[m\].
    pub thickness: f64,
    /// Slope of the field at the surface \[1/m\]; 0 stands for `2 isovalue / (radius - thickness)`.
    pub stiffness: f64,
    /// Slope at the skeleton over the slope at the surface, at least 0; 1 is linear.
    pub stiffening: f64,
    /// Distance at which the field ends \[m\]; 0 stands for twice the thickness.
    pub radius: f64,
    /// Number of seeds; 0 stands for the world's.
    pub seed_count: u32,
    /// The host's own value.
    pub user_data: usize,
}

impl Default for SkeletonDesc {
    fn default() -> Self {
        Self {
            shape: Shape::Point(Vec3::zeros()),
            thickness: 0.1,
            stiffness: 0.0,
            stiffening: 1.0,
            radius: 0.0,
            seed_count: 0,
            user_data: 0,
        }
    }
}

impl SkeletonDesc {
    /// Checks the descriptor and gives the profile for a body of this isovalue.
    pub(crate) fn profile(&self, isovalue: f64) -> Result<Profile> {
        self.validate_shape()?;
        if self.seed_count != 0 {
            validate_seed_count(self.seed_count)?;
        }
        let solid = self.shape.is_solid();
        Profile::new(isovalue, self.thickness, self.stiffness, self.stiffening, self.radius, solid)
    }

    fn validate_shape(&self) -> Result<()> {
        let (low, high) = match &self.shape {
            Shape::Plane { point, .. } => (*point, *point),
            other => other.bounds(0.0),
        };
        require_finite("points of the skeleton", &low)?;
        require_finite("points of the skeleton", &high)?;
        if let Shape::Box { half, .. } = &self.shape {
            require("half extent of a box", half.min(), "> 0", |x| x > 0.0)?;
        }
        Ok(())
    }
}

/// A damped spring between points of two links of one body. A fixed or host-driven link is an anchor.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SpringDesc {
    /// The links that it joins.
    pub links: [LinkId; 2],
    /// Where its ends are, each in the frame of its link \[m\]; on a point mass, at the origin.
    pub points: [Vec3; 2],
    /// Length without force, from 0 to 1e9 \[m\].
    pub rest_length: f64,
    /// Force a metre of stretch, from 0 to 1e18 \[N/m\].
    pub stiffness: f64,
    /// Force along it a metre a second of lengthening, from 0 to 1e18 \[N s/m\].
    pub damping: f64,
    /// The host's own value.
    pub user_data: usize,
}

impl SpringDesc {
    pub(crate) fn validate(&self) -> Result<()> {
        for point in &self.points {
            require_finite("point of a spring", point)?;
        }
        require("rest_length", self.rest_length, "from 0 to 1e9", |x| (0.0..=1e9).contains(&x))?;
        require("stiffness of a spring", self.stiffness, "from 0 to 1e18", |x| (0.0..=1e18).contains(&x))?;
        require("damping of a spring", self.damping, "from 0 to 1e18", |x| (0.0..=1e18).contains(&x))
    }
}
