//! What several tests share: scenes in few words, and an oracle that integrates contact forces in its own way.
#![allow(dead_code)]

pub mod character;
pub mod oracle;
pub mod pool;

use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Pose, Quat, Twist, Vec3, advance_rotation};
use isocoat::world::{
    BodyDesc, BodyId, LinkDesc, LinkId, LinkState, SkeletonDesc, VelocityConvention, World, WorldDesc,
};
use isocoat::world::{Contact, Scheme};

/// A repeatable stream of random numbers (SplitMix64).
pub struct Random(pub u64);

impl Random {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = Vec3::from_fn(|_, _| self.range(-1.0, 1.0));
            if v.norm() > 0.1 && v.norm() < 1.0 {
                return v.normalize();
            }
        }
    }

    pub fn rotation(&mut self) -> Quat {
        let angle = self.range(0.0, std::f64::consts::PI);
        Quat::from_scaled_axis(self.direction() * angle)
    }
}

/// A coat in its own frame: primitives with their thickness and radius, and the stiffness of the body.
#[derive(Clone, Debug)]
pub struct Coat {
    pub shapes: Vec<Shape>,
    pub thickness: f64,
    pub radius: f64,
    pub stiffness_scale: f64,
    pub rigid: bool,
}

impl Coat {
    pub fn new(shapes: &[Shape], thickness: f64) -> Self {
        Coat { shapes: shapes.to_vec(), thickness, radius: 2.0 * thickness, stiffness_scale: 1e5, rigid: false }
    }

    pub fn ball(thickness: f64) -> Self {
        Coat::new(&[Shape::Point(Vec3::zeros())], thickness)
    }

    pub fn floor(thickness: f64) -> Self {
        Coat::new(&[Shape::Plane { point: Vec3::zeros(), normal: Vec3::z() }], thickness)
    }

    pub fn cuboid(half: Vec3, thickness: f64) -> Self {
        let axes = isocoat::math::Mat3::identity();
        Coat::new(&[Shape::Box { center: Vec3::zeros(), half, axes }], thickness)
    }

    pub fn stiff(mut self, stiffness_scale: f64) -> Self {
        self.stiffness_scale = stiffness_scale;
        self
    }

    pub fn hard(mut self) -> Self {
        self.rigid = true;
        self
    }

    pub fn body_desc(&self) -> BodyDesc {
        BodyDesc { rigid: self.rigid, stiffness_scale: self.stiffness_scale, ..BodyDesc::default() }
    }

    /// Adds the coat to a world on a link of any kind.
    pub fn add(&self, world: &mut World, body: BodyDesc, link: LinkDesc) -> (BodyId, LinkId) {
        let body = world.create_body(body).unwrap();
        let link = world.create_link(body, link).unwrap();
        for shape in &self.shapes {
            let skeleton = SkeletonDesc {
                shape: *shape,
                thickness: self.thickness,
                radius: self.radius,
                ..SkeletonDesc::default()
            };
            world.create_skeleton(link, skeleton).unwrap();
        }
        (body, link)
    }

    pub fn add_fixed(&self, world: &mut World, pose: Pose) -> (BodyId, LinkId) {
        self.add(world, self.body_desc(), LinkDesc { kind: Kind::Fixed, pose, ..LinkDesc::default() })
    }
}

/// The contacts of two coats at two poses.
pub fn collide(a: (&Coat, Pose), b: (&Coat, Pose), scheme: Scheme, tolerance: f64) -> Vec<Contact> {
    collide_seeded(a, b, scheme, tolerance, 1024)
}

pub fn collide_seeded(
    a: (&Coat, Pose),
    b: (&Coat, Pose),
    scheme: Scheme,
    tolerance: f64,
    seed_count: u32,
) -> Vec<Contact> {
    let mut world = World::new(WorldDesc { seed_count, ..WorldDesc::default() }).unwrap();
    let (a, _) = a.0.add_fixed(&mut world, a.1);
    let (b, _) = b.0.add_fixed(&mut world, b.1);
    world.collide(a, b, scheme, tolerance).unwrap()
}

/// The force on b of all contacts.
pub fn total(contacts: &[Contact]) -> Vec3 {
    contacts.iter().map(|contact| contact.force).sum()
}

/// Inertia of a solid ball.
pub fn ball_inertia(mass: f64, radius: f64) -> isocoat::math::Mat3 {
    isocoat::math::Mat3::identity() * (0.4 * mass * radius * radius)
}

/// Inertia of a solid box.
pub fn box_inertia(mass: f64, half: Vec3) -> isocoat::math::Mat3 {
    let s = half.component_mul(&half) * (mass / 3.0);
    isocoat::math::Mat3::from_diagonal(&Vec3::new(s.y + s.z, s.z + s.x, s.x + s.y))
}

/// Gravity of the scenes \[m/s²\].
pub const G: f64 = 9.81;
/// Step of the scenes \[s\].
pub const DT: f64 = 1.0 / 60.0;

/// A host that integrates one body by semi-implicit Euler, as Bullet does, or in step.
pub struct Host {
    pub link: LinkId,
    pub mass: f64,
    pub inertia: f64,
    pub convention: VelocityConvention,
    pub state: LinkState,
}

impl Host {
    pub fn tick(&mut self, world: &mut World, force: Vec3) {
        world.set_link_state(self.link, &self.state).unwrap();
        world.step(DT).unwrap();
        let impulse = world.link_impulse(self.link).unwrap();
        let acceleration = Vec3::new(0.0, 0.0, -G) + force / self.mass;
        let Twist { linear, angular } = &mut self.state.twist;
        *linear += impulse.force / self.mass;
        *angular += impulse.torque / self.inertia;
        match self.convention {
            VelocityConvention::Leapfrog => {
                *linear += acceleration * DT;
                self.state.pose.position += *linear * DT;
            }
            VelocityConvention::Synchronous => {
                self.state.pose.position += *linear * DT + acceleration * (0.5 * DT * DT);
                *linear += acceleration * DT;
            }
        }
        self.state.pose.rotation = advance_rotation(&self.state.pose.rotation, angular, DT);
    }
}
