//! The implicit response: rest where the forces balance, roll without brake, never gain, carry stacks.

mod common;

use common::{Coat, ball_inertia, box_inertia};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Pose, Twist, Vec3};
use isocoat::world::{BodyDesc, LinkDesc, LinkId, Response, World, WorldDesc};

const G: f64 = 9.81;

fn world() -> World {
    let gravity = Vec3::new(0.0, 0.0, -G);
    World::new(WorldDesc { gravity, response: Response::Implicit, ..WorldDesc::default() }).unwrap()
}

fn add_floor(world: &mut World, body: BodyDesc) {
    let floor = Coat::floor(0.1).hard();
    let desc = BodyDesc { rigid: true, ..body };
    floor.add(world, desc, LinkDesc { pose: Pose::at(0.0, 0.0, -0.1), ..LinkDesc::default() });
}

fn add_ball(world: &mut World, body: &BodyDesc, radius: f64, mass: f64, at: Vec3, twist: Twist) -> LinkId {
    let coat = Coat::ball(radius);
    let link = LinkDesc {
        kind: Kind::Rigid,
        mass,
        inertia: ball_inertia(mass, radius),
        pose: Pose::at(at.x, at.y, at.z),
        twist,
        ..LinkDesc::default()
    };
    coat.add(world, body.clone(), link).1
}

/// Depth at which a ball of modulus E = K k t (default profile: k t = 2) rests on a hard plane: F = pi E (R - h)^2 (R + 2h) / (3R).
fn exact_sink(modulus: f64, radius: f64, weight: f64) -> f64 {
    let force = |h: f64| {
        std::f64::consts::PI * modulus * (radius - h).powi(2) * (radius + 2.0 * h) / (3.0 * radius)
    };
    let (mut low, mut high) = (0.0, radius);
    for _ in 0..200 {
        let h = 0.5 * (low + high);
        if force(h) > weight { low = h } else { high = h }
    }
    radius - 0.5 * (low + high)
}

#[test]
fn a_ball_rests_at_the_exact_sink_at_any_modulus() {
    for modulus in [1e4, 1e5, 1e6, 1e7, 1e8, 1e9] {
        let mut world = world();
        let body = BodyDesc { stiffness_scale: modulus / 2.0, friction: 0.5, ..BodyDesc::default() };
        add_floor(&mut world, body.clone());
        let ball = add_ball(&mut world, &body, 0.1, 1.0, Vec3::new(0.0, 0.0, 0.11), Twist::default());
        let mut rounds = 0;
        for _ in 0..240 {
            world.step(1.0 / 60.0).unwrap();
            rounds += world.counters().substeps;
        }
        let state = world.link_state(ball).unwrap();
        let sink = 0.1 - state.pose.position.z;
        let exact = exact_sink(modulus, 0.1, G);
        println!("E {modulus:.0e}: sink {sink:.4e}, exact {exact:.4e}, off {:.2e}, v {:.1e}, rounds {rounds}", sink / exact - 1.0, state.twist.linear.norm());
    }
}

#[test]
fn a_rolling_ball_is_not_braked() {
    for modulus in [1e4, 1e5, 1e6, 1e7, 1e9] {
        let mut world = world();
        let body = BodyDesc { stiffness_scale: modulus / 2.0, friction: 0.5, ..BodyDesc::default() };
        add_floor(&mut world, body.clone());
        let sink = exact_sink(modulus, 0.1, G);
        let height = 0.1 - sink;
        let twist = Twist { linear: Vec3::new(1.0, 0.0, 0.0), angular: Vec3::new(0.0, 1.0 / height, 0.0) };
        let ball = add_ball(&mut world, &body, 0.1, 1.0, Vec3::new(0.0, 0.0, height), twist);
        let mut rounds = 0;
        for _ in 0..120 {
            world.step(1.0 / 60.0).unwrap();
            rounds += world.counters().substeps;
        }
        let speed = world.link_state(ball).unwrap().twist.linear.x;
        println!("E {modulus:.0e}: speed {speed}, rounds {rounds}, evals {:?}", world.counters());
    }
}

#[test]
fn a_heavy_slab_rests_on_four_light_balls() {
    for modulus in [1e6, 1e7, 1e8, 1e9] {
        let mut world = world();
        let body = BodyDesc { stiffness_scale: modulus / 2.0, friction: 0.5, ..BodyDesc::default() };
        add_floor(&mut world, body.clone());
        let mut balls = vec![];
        for (x, y) in [(-0.4, -0.4), (-0.4, 0.4), (0.4, -0.4), (0.4, 0.4)] {
            balls.push(add_ball(&mut world, &body, 0.1, 0.1, Vec3::new(x, y, 0.1), Twist::default()));
        }
        let half = Vec3::new(0.5, 0.5, 0.05);
        let coat = Coat::cuboid(half - Vec3::repeat(0.02), 0.02).hard();
        let link = LinkDesc { kind: Kind::Rigid, mass: 1000.0, inertia: box_inertia(1000.0, half), pose: Pose::at(0.0, 0.0, 0.25), ..LinkDesc::default() };
        let slab = coat.add(&mut world, BodyDesc { rigid: true, ..body.clone() }, link).1;
        let mut rounds = 0;
        let t = std::time::Instant::now();
        for _ in 0..240 {
            world.step(1.0 / 60.0).unwrap();
            rounds += world.counters().substeps;
        }
        let state = world.link_state(slab).unwrap();
        let exact = exact_sink(modulus, 0.1, 1000.0 * G / 4.0);
        println!("E {modulus:.0e}: slab sink {:.4e} two layers exact {:.4e}, v {:.1e}, rounds {rounds} contacts {} {:?}", 0.25 - state.pose.position.z, 2.0 * exact, state.twist.linear.norm(), world.contacts().len(), t.elapsed());
    }
}

#[test]
fn ten_balls_fall_into_a_box() {
    for modulus in [1e4, 1e5, 1e6, 1e7] {
        let mut world = world();
        let body = BodyDesc { stiffness_scale: modulus / 2.0, friction: 0.5, ..BodyDesc::default() };
        add_floor(&mut world, body.clone());
        for (normal, point) in [(Vec3::x(), Vec3::new(-0.4, 0.0, 0.0)), (-Vec3::x(), Vec3::new(0.4, 0.0, 0.0)), (Vec3::y(), Vec3::new(0.0, -0.4, 0.0)), (-Vec3::y(), Vec3::new(0.0, 0.4, 0.0))] {
            let wall = Coat { rigid: true, ..Coat::new(&[Shape::Plane { point, normal }], 0.1) };
            wall.add(&mut world, BodyDesc { rigid: true, ..body.clone() }, LinkDesc::default());
        }
        let mut balls = vec![];
        for i in 0..10 {
            let f = f64::from(i);
            balls.push(add_ball(&mut world, &body, 0.1, 1.0, Vec3::new(0.05 * (f % 3.0) - 0.05, 0.06 * ((f * 1.7) % 2.0) - 0.06, 0.15 + 0.21 * f), Twist::default()));
        }
        let t = std::time::Instant::now();
        let mut last = f64::INFINITY;
        let mut gain = 0.0f64;
        let (mut rounds, mut most) = (0, 0);
        for step in 0..600 {
            world.step(1.0 / 60.0).unwrap();
            rounds += world.counters().substeps;
            most = most.max(world.counters().substeps);
            let p: Vec<Vec3> = balls.iter().map(|b| world.link_state(*b).unwrap().pose.position).collect();
            let u = |depth: f64| { let d = depth.max(0.0); std::f64::consts::PI * modulus / 0.3 * (0.1 * d * d * d - 0.5 * d.powi(4)) };
            let mut elastic = 0.0;
            for (i, a) in p.iter().enumerate() {
                for d in [a.z, a.x + 0.4 - 0.1, 0.3 - a.x, a.y + 0.3, 0.3 - a.y].into_iter().zip([true, false, false, false, false]) { elastic += if d.1 { u(0.1 - d.0) } else { u(0.1 - d.0) }; }
                for b in &p[..i] { elastic += 2.0 * u(0.1 - 0.5 * (a - b).norm()); }
            }
            let e: f64 = elastic + balls.iter().map(|b| { let s = world.link_state(*b).unwrap(); 0.5 * s.twist.linear.norm_squared() + 0.5 * 0.004 * s.twist.angular.norm_squared() + G * s.pose.position.z }).sum::<f64>();
            if e - last > gain { gain = e - last; if gain > 1e-3 { println!("  step {step}: gain {gain:.3e} of {last:.3} rounds {}", world.counters().substeps); } }
            last = e;
        }
        let speed = balls.iter().map(|b| world.link_state(*b).unwrap().twist.linear.norm()).fold(0.0, f64::max);
        println!("E {modulus:.0e}: {:?} for 10 s, speed {speed:.1e}, energy {last:.4}, largest gain {gain:.2e}, rounds {rounds} most {most} {:?}", t.elapsed(), world.counters());
    }
}
