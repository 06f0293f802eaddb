//! The implicit response: it rests where the forces balance, does not brake what rolls, never gains energy, and carries
//! what is stacked or held by a host.

mod common;

use std::f64::consts::PI;

use common::{Coat, DT, G, Host, ball_inertia, box_inertia};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Pose, Quat, Twist, Vec3};
use isocoat::world::{
    BodyDesc, LinkDesc, LinkId, LinkState, Response, StiffnessRule, VelocityConvention, World, WorldDesc,
};

const RADIUS: f64 = 0.1;

fn world(response: Response) -> World {
    let gravity = Vec3::new(0.0, 0.0, -G);
    World::new(WorldDesc { gravity, response, ..WorldDesc::default() }).unwrap()
}

/// Soft flesh whose pressure at the middle of a ball is `modulus`: `K k t` with the default profile's `k t = 2`.
fn flesh(modulus: f64) -> BodyDesc {
    BodyDesc { stiffness_scale: modulus / 2.0, ..BodyDesc::default() }
}

/// A hard floor whose surface is at z = 0.
fn add_floor(world: &mut World, body: &BodyDesc) {
    let pose = Pose::at(0.0, 0.0, -0.1);
    Coat::floor(0.1).add(world, BodyDesc { rigid: true, ..body.clone() }, LinkDesc { pose, ..LinkDesc::default() });
}

fn ball_link(mass: f64, at: Vec3) -> LinkDesc {
    let inertia = ball_inertia(mass, RADIUS);
    LinkDesc { kind: Kind::Rigid, mass, inertia, pose: Pose::at(at.x, at.y, at.z), ..LinkDesc::default() }
}

fn add_ball(world: &mut World, body: &BodyDesc, link: LinkDesc) -> LinkId {
    Coat::ball(RADIUS).add(world, body.clone(), link).1
}

/// Elastic energy of a ball pressed on a hard plane to a depth: the integral of [`force_at`].
fn energy_at(modulus: f64, depth: f64) -> f64 {
    let d = depth.max(0.0);
    PI * modulus / (3.0 * RADIUS) * (RADIUS * d.powi(3) - 0.5 * d.powi(4))
}

/// Force of a ball pressed on a hard plane to a depth, `π E (R - h)² (R + 2 h) / 3 R` at the height `h`.
fn force_at(modulus: f64, depth: f64) -> f64 {
    PI * modulus * depth * depth * (3.0 * RADIUS - 2.0 * depth) / (3.0 * RADIUS)
}

/// Depth at which a ball rests under a load.
fn sink_under(modulus: f64, load: f64) -> f64 {
    let (mut low, mut high) = (0.0, RADIUS);
    for _ in 0..200 {
        let depth = 0.5 * (low + high);
        if force_at(modulus, depth) < load { low = depth } else { high = depth }
    }
    0.5 * (low + high)
}

#[test]
fn a_ball_rests_at_the_exact_sink_at_any_modulus() {
    for modulus in [1e4, 1e5, 1e6, 1e7, 1e8, 1e9] {
        let mut world = world(Response::Implicit);
        add_floor(&mut world, &flesh(modulus));
        let ball = add_ball(&mut world, &flesh(modulus), ball_link(1.0, Vec3::new(0.0, 0.0, 0.11)));
        let mut rounds = 0;
        for _ in 0..240 {
            world.step(DT).unwrap();
            rounds += world.counters().implicit_rounds;
        }
        let state = world.link_state(ball).unwrap();
        let off = (RADIUS - state.pose.position.z) / sink_under(modulus, G) - 1.0;
        let speed = state.twist.linear.norm();
        println!("modulus {modulus:.0e}: sink off by {off:.1e}, {speed:.1e} m/s, {rounds} rounds in 240 steps");
        assert!(off.abs() < 1e-6 && speed < 1e-9);
    }
}

#[test]
fn a_ball_that_rolls_without_slip_is_not_braked() {
    for modulus in [1e4, 1e5, 1e6, 1e7, 1e9] {
        let mut world = world(Response::Implicit);
        let body = BodyDesc { friction: 0.5, ..flesh(modulus) };
        add_floor(&mut world, &body);
        let height = RADIUS - sink_under(modulus, G);
        let twist = Twist { linear: Vec3::new(1.0, 0.0, 0.0), angular: Vec3::new(0.0, 1.0 / height, 0.0) };
        let link = LinkDesc { twist, ..ball_link(1.0, Vec3::new(0.0, 0.0, height)) };
        let ball = add_ball(&mut world, &body, link);
        let mut rounds = 0;
        for _ in 0..120 {
            world.step(DT).unwrap();
            rounds += world.counters().implicit_rounds;
        }
        let speed = world.link_state(ball).unwrap().twist.linear.x;
        println!("modulus {modulus:.0e}: speed off by {:.1e} after 2 s, {rounds} rounds in 120 steps", speed - 1.0);
        assert!((speed - 1.0).abs() < 1e-6);
    }
}

#[test]
fn a_slab_of_a_ton_rests_on_four_balls_of_a_tenth_of_a_kilogram() {
    for modulus in [1e6, 1e7, 1e8, 1e9] {
        let mut world = world(Response::Implicit);
        let body = BodyDesc { friction: 0.5, ..flesh(modulus) };
        add_floor(&mut world, &body);
        for (x, y) in [(-0.4, -0.4), (-0.4, 0.4), (0.4, -0.4), (0.4, 0.4)] {
            add_ball(&mut world, &body, ball_link(0.1, Vec3::new(x, y, RADIUS)));
        }
        let half = Vec3::new(0.5, 0.5, 0.05);
        let (mass, inertia) = (1000.0, box_inertia(1000.0, half));
        let pose = Pose::at(0.0, 0.0, 0.25);
        let link = LinkDesc { kind: Kind::Rigid, mass, inertia, pose, ..LinkDesc::default() };
        let slab = Coat::cuboid(half - Vec3::repeat(0.02), 0.02);
        let slab = slab.add(&mut world, BodyDesc { rigid: true, ..body }, link).1;
        for _ in 0..240 {
            world.step(DT).unwrap();
        }
        let state = world.link_state(slab).unwrap();
        // The balls' own weight adds a little to the lower layer.
        let (upper, lower) = (sink_under(modulus, 250.0 * G), sink_under(modulus, 250.1 * G));
        let off = (0.25 - state.pose.position.z) / (upper + lower) - 1.0;
        let speed = state.twist.linear.norm();
        println!("modulus {modulus:.0e}: two layers off by {off:.1e}, {speed:.1e} m/s");
        assert!(off.abs() < 1e-3 && speed < 1e-3);
    }
}

#[test]
fn ten_balls_in_a_box_never_gain_energy_and_come_to_rest() {
    for (modulus, friction) in [(1e4, 0.0), (1e5, 0.0), (1e6, 0.0), (1e7, 0.0), (1e5, 0.5), (1e7, 0.5)] {
        let mut world = world(Response::Implicit);
        let body = BodyDesc { friction, ..flesh(modulus) };
        add_floor(&mut world, &body);
        let wall = 0.3;
        for normal in [Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y()] {
            let coat = Coat::new(&[Shape::Plane { point: normal * -(wall + 0.1), normal }], 0.1);
            coat.add(&mut world, BodyDesc { rigid: true, ..body.clone() }, LinkDesc::default());
        }
        let balls: Vec<LinkId> = (0..10)
            .map(f64::from)
            .map(|i| Vec3::new(0.05 * (i % 3.0) - 0.05, 0.06 * ((1.7 * i) % 2.0) - 0.06, 0.15 + 0.21 * i))
            .map(|at| add_ball(&mut world, &body, ball_link(1.0, at)))
            .collect();
        let energy = |world: &World| {
            let states: Vec<LinkState> = balls.iter().map(|ball| world.link_state(*ball).unwrap()).collect();
            let mut sum = 0.0;
            for (index, LinkState { pose, twist }) in states.iter().enumerate() {
                let p = pose.position;
                let spin = 0.5 * 0.4 * RADIUS * RADIUS * twist.angular.norm_squared();
                sum += 0.5 * twist.linear.norm_squared() + spin + G * p.z;
                let gaps = [p.z, wall + p.x, wall - p.x, wall + p.y, wall - p.y];
                sum += gaps.map(|gap| energy_at(modulus, RADIUS - gap)).iter().sum::<f64>();
                let apart = |other: &LinkState| (p - other.pose.position).norm();
                sum += states[..index].iter().map(|o| 2.0 * energy_at(modulus, RADIUS - 0.5 * apart(o))).sum::<f64>();
            }
            sum
        };
        let (mut last, mut gain, mut rounds, mut splits) = (energy(&world), 0.0f64, 0, 0);
        let start = std::time::Instant::now();
        let mut spent = std::time::Duration::ZERO;
        let first = last;
        for _ in 0..600 {
            let begin = start.elapsed();
            world.step(DT).unwrap();
            spent += start.elapsed() - begin;
            (rounds, splits) = (rounds + world.counters().implicit_rounds, splits + world.counters().implicit_splits);
            let now = energy(&world);
            gain = gain.max((now - last) / first);
            last = now;
        }
        let fastest = balls.iter().map(|ball| world.link_state(*ball).unwrap().twist.linear.norm()).fold(0.0, f64::max);
        println!(
            "modulus {modulus:.0e}, friction {friction}: {:.0} times real time, {rounds} rounds and {splits} splits in \
             600 steps, largest gain {gain:.1e} of the energy, {fastest:.1e} m/s at the end",
            10.0 / spent.as_secs_f64()
        );
        assert!(gain < 1e-6 && fastest < 0.05);
        let inside = |p: Vec3| p.z > 0.0 && p.x.abs() < wall && p.y.abs() < wall;
        assert!(balls.iter().all(|ball| inside(world.link_state(*ball).unwrap().pose.position)));
    }
}

#[test]
fn a_bounce_never_returns_more_than_it_took() {
    for modulus in [1e3, 1e5, 1e7, 1e9] {
        for speed in [0.1, 3.0, 50.0, 300.0] {
            let mut world = world(Response::Implicit);
            add_floor(&mut world, &flesh(modulus));
            let twist = Twist { linear: Vec3::new(0.0, 0.0, -speed), angular: Vec3::zeros() };
            let link = LinkDesc { twist, ..ball_link(1e-3, Vec3::new(0.0, 0.0, 0.5)) };
            let ball = add_ball(&mut world, &flesh(modulus), link);
            let height = |world: &World| {
                let LinkState { pose, twist } = world.link_state(ball).unwrap();
                pose.position.z + 0.5 * twist.linear.norm_squared() / G
            };
            let (first, mut most, mut lowest) = (height(&world), 0.0f64, f64::INFINITY);
            for _ in 0..300 {
                world.step(DT).unwrap();
                most = most.max(height(&world) / first);
                lowest = lowest.min(world.link_state(ball).unwrap().pose.position.z);
            }
            assert!(most < 1.001 && lowest > 0.0, "modulus {modulus:.0e}, {speed} m/s: {most}, lowest {lowest}");
        }
    }
}

#[test]
fn a_host_ball_rests_at_the_exact_sink_forced_or_flagged() {
    for convention in [VelocityConvention::Leapfrog, VelocityConvention::Synchronous] {
        for (response, constrained) in [(Response::Implicit, false), (Response::Auto, true)] {
            for modulus in [1e5, 1e9] {
                let mut world = world(response);
                add_floor(&mut world, &flesh(modulus));
                let link = LinkDesc {
                    kind: Kind::Host,
                    velocity_convention: convention,
                    constrained,
                    ..ball_link(1.0, Vec3::new(0.0, 0.0, 0.1))
                };
                let state = LinkState { pose: link.pose, twist: link.twist };
                let inertia = link.inertia.m11;
                let link = add_ball(&mut world, &flesh(modulus), link);
                let mut host = Host { link, mass: 1.0, inertia, convention, state };
                for _ in 0..240 {
                    host.tick(&mut world, Vec3::zeros());
                }
                let off = (RADIUS - host.state.pose.position.z) / sink_under(modulus, G) - 1.0;
                println!("{convention:?}, {response:?}, modulus {modulus:.0e}: sink off by {off:.1e}");
                assert!(world.counters().implicit_rounds > 0);
                assert!(off.abs() < 1e-6);
            }
        }
    }
}

/// A link of 1 kg whose host, held by joints that the library does not know, moves as `effective` kilograms.
fn held_host(response: Response, constrained: bool, effective: f64, modulus: f64) -> (f64, f64) {
    let mut world = world(response);
    add_floor(&mut world, &flesh(modulus));
    let convention = VelocityConvention::Leapfrog;
    let link = LinkDesc { kind: Kind::Host, constrained, ..ball_link(1.0, Vec3::new(0.0, 0.0, 0.15)) };
    let state = LinkState { pose: link.pose, twist: link.twist };
    let link = add_ball(&mut world, &flesh(modulus), link);
    let mut host = Host { link, mass: effective, inertia: 0.004 * effective, convention, state };
    let mut highest = 0.0f64;
    for tick in 0..900 {
        host.tick(&mut world, Vec3::zeros());
        if tick > 30 {
            highest = highest.max(host.state.pose.position.z);
        }
    }
    (highest, (RADIUS - host.state.pose.position.z) / sink_under(modulus, effective * G) - 1.0)
}

#[test]
fn a_held_host_rests_where_its_whole_load_does() {
    for effective in [1.0, 2.0, 4.0, 10.0] {
        for modulus in [1e5, 1e7] {
            let (highest, off) = held_host(Response::Auto, true, effective, modulus);
            println!(
                "flagged, {effective} times the mass, modulus {modulus:.0e}: {highest:.3} m, sink off by {off:.1e}"
            );
            // At ten times the mass the estimate is at its limit.
            let most = if effective < 10.0 { 1e-6 } else { 0.5 };
            assert!(highest < 0.16 && off.abs() < most);
        }
    }
}

#[test]
fn a_host_that_is_held_without_saying_so_is_found_out() {
    for effective in [2.0, 4.0, 10.0] {
        for modulus in [1e5, 1e7] {
            let (highest, off) = held_host(Response::Auto, false, effective, modulus);
            println!(
                "unsaid, {effective} times the mass, modulus {modulus:.0e}: {highest:.3} m, sink off by {off:.1e}"
            );
            let most = if effective < 10.0 { 1e-6 } else { 0.5 };
            assert!(highest < 0.16 && off.abs() < most);
        }
    }
}

#[test]
fn the_sink_a_user_asks_for_is_the_sink_that_comes_out() {
    for fraction in [0.01, 0.05, 0.2] {
        for mass in [0.01, 1.0, 500.0] {
            let mut world = world(Response::Implicit);
            let body = BodyDesc { stiffness: StiffnessRule::Sink { fraction }, ..BodyDesc::default() };
            add_floor(&mut world, &body);
            let ball = add_ball(&mut world, &body, ball_link(mass, Vec3::new(0.0, 0.0, RADIUS)));
            for _ in 0..240 {
                world.step(DT).unwrap();
            }
            let sink = (RADIUS - world.link_state(ball).unwrap().pose.position.z) / RADIUS;
            assert!((sink / fraction - 1.0).abs() < 1e-6, "{sink} of {fraction}");
        }
    }
}

#[test]
fn the_frequency_and_damping_a_user_asks_for_come_out() {
    for hertz in [2.0, 5.0, 20.0] {
        for damping_ratio in [0.0, 0.1] {
            let mut world = world(Response::Substepped);
            let stiffness = StiffnessRule::Frequency { hertz, damping_ratio };
            let body = BodyDesc { stiffness, ..BodyDesc::default() };
            add_floor(&mut world, &BodyDesc { rigid: true, ..BodyDesc::default() });
            let ball = add_ball(&mut world, &body, ball_link(3.0, Vec3::new(0.0, 0.0, RADIUS)));
            let id = world.link_body(ball).unwrap();
            let (scale, _) = world.body_stiffness(id).unwrap();
            let sink = sink_under(2.0 * scale, 3.0 * G);
            let mut desc = world.link_desc(ball).unwrap().clone();
            let shift = 0.01 * sink;
            desc.pose.position.z = RADIUS - sink + shift;
            world.set_link_desc(ball, desc).unwrap();
            // Upward passages through rest, and the largest swing in the last of them.
            let step = 1.0 / (hertz * 200.0);
            let (mut last, mut crossings, mut swing) = (shift, Vec::new(), 0.0f64);
            for index in 0..1500 {
                world.step(step).unwrap();
                let now = world.link_state(ball).unwrap().pose.position.z - (RADIUS - sink);
                if last < 0.0 && now >= 0.0 {
                    crossings.push((f64::from(index) - now / (now - last)) * step);
                    swing = 0.0;
                }
                swing = swing.max(now);
                last = now;
            }
            let count = crossings.len() - 1;
            let measured = count as f64 / (crossings[count] - crossings[0]);
            let undamped = measured / (1.0 - damping_ratio * damping_ratio).sqrt();
            println!("asked for {hertz} Hz and {damping_ratio}: {undamped:.3} Hz undamped");
            assert!((undamped / hertz - 1.0).abs() < 0.01);
            if damping_ratio > 0.0 {
                // From the start to the last crossing.
                let decay = (shift / swing).ln() / (2.0 * PI * hertz * (crossings[count] + 0.25 / hertz));
                println!("  damping ratio {decay:.4}");
                assert!((decay / damping_ratio - 1.0).abs() < 0.1);
            }
        }
    }
}

#[test]
fn a_tumbling_capsule_and_blended_coats_settle_without_a_gain() {
    for (name, shapes) in [
        ("capsule", vec![Shape::Segment(Vec3::new(-0.15, 0.0, 0.0), Vec3::new(0.15, 0.0, 0.0))]),
        ("dumbbell", vec![Shape::Point(Vec3::new(-0.09, 0.0, 0.0)), Shape::Point(Vec3::new(0.09, 0.0, 0.0))]),
    ] {
        let mut world = world(Response::Implicit);
        let body = BodyDesc { friction: 0.3, ..flesh(1e5) };
        add_floor(&mut world, &body);
        let coat = Coat::new(&shapes, RADIUS);
        let rotation = Quat::from_scaled_axis(Vec3::new(0.3, 0.7, 0.1));
        let inertia = box_inertia(1.0, Vec3::new(0.2, 0.07, 0.07));
        let pose = Pose { position: Vec3::new(0.0, 0.0, 0.6), rotation };
        let twist = Twist { linear: Vec3::new(1.0, 0.0, 0.0), angular: Vec3::new(3.0, 5.0, 1.0) };
        let link = LinkDesc { kind: Kind::Rigid, mass: 1.0, inertia, pose, twist, ..LinkDesc::default() };
        let link = coat.add(&mut world, body, link).1;
        // Without the elastic energy, which only lowers the rest.
        let energy = |world: &World| {
            let LinkState { pose, twist } = world.link_state(link).unwrap();
            let local = pose.rotation.inverse() * twist.angular;
            0.5 * twist.linear.norm_squared() + 0.5 * local.dot(&(inertia * local)) + G * pose.position.z
        };
        let first = energy(&world);
        let mut most = 0.0f64;
        for _ in 0..600 {
            world.step(DT).unwrap();
            most = most.max(energy(&world) / first);
        }
        let state = world.link_state(link).unwrap();
        println!("{name}: at most {most:.6} of its energy, {:.1e} m/s at the end", state.twist.linear.norm());
        assert!(most < 1.001 && state.pose.position.z > 0.05 && state.twist.linear.norm() < 1.2);
    }
}

/// Nothing moves and nothing pulls: what the forces leave that cancel each other is rounding, and not to be solved for.
#[test]
fn what_is_clamped_without_gravity_is_at_rest_at_once() {
    for (index, modulus) in [1e4, 1e6, 1e9].into_iter().enumerate() {
        for tilt in 0..8 {
            let mut world = World::new(WorldDesc { response: Response::Implicit, ..WorldDesc::default() }).unwrap();
            let turn = Quat::from_scaled_axis(Vec3::new(0.3, 0.2, 0.1) * f64::from(tilt));
            let depth = 0.03;
            for side in [-1.0, 1.0] {
                let plane = Coat::new(&[Shape::Plane { point: Vec3::zeros(), normal: Vec3::z() * -side }], 0.1);
                let pose = Pose { position: turn * Vec3::z() * (side * (RADIUS - depth + 0.1)), rotation: turn };
                plane.add(
                    &mut world,
                    BodyDesc { rigid: true, ..flesh(modulus) },
                    LinkDesc { pose, ..LinkDesc::default() },
                );
            }
            let mut link = ball_link(1.0, Vec3::zeros());
            link.pose.rotation = turn;
            let ball = add_ball(&mut world, &BodyDesc { friction: 0.3, ..flesh(modulus) }, link);
            for _ in 0..20 {
                world.step(DT).unwrap();
                let counters = world.counters();
                assert_eq!(counters.implicit_splits, 0, "modulus {modulus:.0e}, tilt {tilt}");
            }
            let forces: Vec<f64> = world.contacts().iter().map(|contact| contact.force.norm()).collect();
            let speed = world.link_state(ball).unwrap().twist.linear.norm();
            let exact = force_at(modulus, depth);
            if tilt == 0 {
                println!("{index}: {forces:.6?} N, exactly {exact:.6}; {speed:.1e} m/s");
            }
            assert!(forces.len() == 2 && forces.iter().all(|force| (force / exact - 1.0).abs() < 1e-2) && speed < 1e-9);
        }
    }
}

/// Who looks from a train sees the same: the accuracy is that of what changes, not of how fast all goes.
#[test]
fn a_crate_on_a_fast_truck_rests_as_on_one_that_stands() {
    let [standing, driving] = [0.0, 1000.0].map(|speed| {
        let mut world = world(Response::Implicit);
        let twist = Twist { linear: Vec3::x() * speed, angular: Vec3::zeros() };
        let half = Vec3::new(2.0, 1.0, 0.5);
        let truck = Coat::cuboid(half - Vec3::repeat(0.05), 0.05);
        let desc = BodyDesc { friction: 0.5, ..flesh(1e6) };
        let link = LinkDesc {
            kind: Kind::Rigid,
            mass: 1e4,
            inertia: box_inertia(1e4, half),
            pose: Pose::at(0.0, 0.0, -0.5),
            twist,
            gravity_scale: 0.0,
            ..LinkDesc::default()
        };
        truck.add(&mut world, desc.clone(), link);
        let mut link = ball_link(0.01, Vec3::new(0.0, 0.0, RADIUS - 1e-4));
        link.twist = twist;
        let part = add_ball(&mut world, &desc, link);
        let mut fastest = 0.0f64;
        for _ in 0..60 {
            world.step(DT).unwrap();
            let state = world.link_state(part).unwrap();
            fastest = fastest.max((state.twist.linear - twist.linear).norm());
        }
        println!("at {speed} m/s the part moves by {fastest:.6e} m/s at most");
        fastest
    });
    assert!(standing < 1e-2);
    assert!((driving - standing).abs() < 1e-5 * standing);
}

#[test]
fn an_oblique_blow_changes_the_angular_momentum_by_what_the_step_is_long() {
    // Forces go through both centres at the end of a step, so in it `L` changes by `h J x (v_b - v_a)`.
    for h in [DT, 0.25 * DT] {
        let mut world =
            World::new(WorldDesc { gravity: Vec3::zeros(), response: Response::Implicit, ..WorldDesc::default() })
                .unwrap();
        let [a, b] = [-0.7, 0.7].map(|x| {
            let mut link = ball_link(1.0, Vec3::new(x, 0.1 * x, 0.0));
            link.twist.linear = Vec3::new(-x, 0.0, 0.0);
            add_ball(&mut world, &flesh(1e5), link)
        });
        let (mut struck, mut off, mut scale, mut drift) = (0.0f64, 0.0f64, 0.0f64, 0.0f64);
        for _ in 0..(2.0 / h) as usize {
            let before = [a, b].map(|link| world.link_state(link).unwrap());
            world.step(h).unwrap();
            let after = [a, b].map(|link| world.link_state(link).unwrap());
            let momentum = |states: &[LinkState; 2]| -> Vec3 {
                states.iter().map(|state| state.pose.position.cross(&state.twist.linear)).sum()
            };
            let impulse = after[1].twist.linear - before[1].twist.linear;
            let closed = impulse.cross(&(after[1].twist.linear - after[0].twist.linear)) * h;
            off = off.max((momentum(&after) - momentum(&before) - closed).norm());
            drift = drift.max((after[0].twist.linear + after[1].twist.linear).norm());
            (struck, scale) = (struck + impulse.norm(), scale + closed.norm());
        }
        println!("h {h:.1e}: impulse {struck:.2} N s, change of L {scale:.1e}, off the closed form by {off:.1e}");
        assert!(struck > 0.3 && drift < 1e-12);
        // The forces are those of poses that agree with the end's to `implicit_tolerance`.
        assert!(off < 1e-2 * scale);
    }
}
