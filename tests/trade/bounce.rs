//! What an undamped bounce gives back, by how finely the steps resolve the contact.

use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Pose, Twist, Vec3};
use isocoat::world::{BodyDesc, LinkDesc, Response, World, WorldDesc};

use super::common::{Coat, ball_inertia};

const RADIUS: f64 = 0.1;
const MASS: f64 = 0.01;
const SPEED: f64 = 1.0;

/// Bounces of one stiffness at one length of step, over many moments at which the contact may begin within a step.
#[derive(Clone, Copy, Debug)]
pub struct Bounce {
    pub modulus: f64,
    /// Steps in the duration of the contact.
    pub steps: f64,
    /// Energy after the bounce over that before: mean, least, most.
    pub kept: f64,
    pub least: f64,
    pub most: f64,
}

/// Duration of the contact of a ball with a hard floor: of `m δ̈ = -π E δ²`, which its force is but for `2δ/3t`.
fn duration(modulus: f64) -> f64 {
    let deepest = (1.5 * MASS * SPEED * SPEED / (std::f64::consts::PI * modulus)).cbrt();
    // 2 ∫₀¹ dx/√(1 - x³)
    2.804_364 * deepest / SPEED
}

/// A ball of this modulus bounces once on a hard floor, without gravity or damping; `phase` of a step after the start
/// it touches.
fn bounce(response: Response, modulus: f64, dt: f64, phase: f64) -> f64 {
    let mut world = World::new(WorldDesc { response, ..WorldDesc::default() }).unwrap();
    let body = BodyDesc { stiffness_scale: 0.5 * modulus, ..BodyDesc::default() };
    let floor = Coat::new(&[Shape::Plane { point: Vec3::new(0.0, 0.0, -RADIUS), normal: Vec3::z() }], RADIUS);
    floor.add(&mut world, BodyDesc { rigid: true, ..body.clone() }, LinkDesc::default());
    let twist = Twist { linear: Vec3::new(0.0, 0.0, -SPEED), angular: Vec3::zeros() };
    let pose = Pose::at(0.0, 0.0, RADIUS + SPEED * dt * (1.0 + phase));
    let inertia = ball_inertia(MASS, RADIUS);
    let link = LinkDesc { kind: Kind::Rigid, mass: MASS, inertia, pose, twist, ..LinkDesc::default() };
    let link = Coat::ball(RADIUS).add(&mut world, body, link).1;
    // Ten times as long as it takes: long steps bring it off slowly.
    for _ in 0..(10.0 * duration(modulus) / dt) as usize + 8 {
        world.step(dt).unwrap();
    }
    let speed = world.link_state(link).unwrap().twist.linear.z;
    (speed / SPEED).powi(2)
}

/// The bounces of one response, from contacts shorter than a step to those of a thousand.
pub fn bounces(response: Response, modulus: f64) -> Vec<Bounce> {
    const PHASES: usize = 16;
    let steps = (-3..=12).map(|i| 10f64.powf(0.25 * f64::from(i)) * 0.999);
    let one = |steps: f64| {
        let dt = duration(modulus) / steps;
        let kept = (0..PHASES).map(|i| bounce(response, modulus, dt, (i as f64 + 0.5) / PHASES as f64));
        let kept: Vec<f64> = kept.collect();
        Bounce {
            modulus,
            steps,
            kept: kept.iter().sum::<f64>() / PHASES as f64,
            least: kept.iter().copied().fold(f64::INFINITY, f64::min),
            most: kept.iter().copied().fold(0.0, f64::max),
        }
    };
    steps.map(one).collect()
}
