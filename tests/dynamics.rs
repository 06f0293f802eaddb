//! Motion against textbook results: pushes, bounces, inclines, impacts, rest.

mod common;

use common::{Coat, DT, G, Host, ball_inertia, box_inertia};
use isocoat::base::Kind;
use isocoat::math::{Pose, Twist, Vec3, rotation_from_vector};
use isocoat::world::{
    BodyDesc, EventKind, LinkDesc, LinkId, LinkState, Response, Scheme, VelocityConvention, World, WorldDesc,
};

fn world() -> World {
    World::new(WorldDesc { gravity: Vec3::new(0.0, 0.0, -G), ..WorldDesc::default() }).unwrap()
}

/// A floor whose surface is at z = 0.
fn add_floor(world: &mut World, body: BodyDesc) {
    let floor = Coat::floor(0.1);
    let pose = Pose::at(0.0, 0.0, -0.1);
    floor.add(world, body, LinkDesc { kind: Kind::Fixed, pose, ..LinkDesc::default() });
}

fn ball_link(kind: Kind, mass: f64, radius: f64, height: f64) -> LinkDesc {
    let inertia = ball_inertia(mass, radius);
    LinkDesc { kind, mass, inertia, pose: Pose::at(0.0, 0.0, height), ..LinkDesc::default() }
}

/// A ball of 1 kg and 0.1 m under a host, at rest on a frictionless floor.
fn resting_host(convention: VelocityConvention) -> (World, Host) {
    let mut world = world();
    add_floor(&mut world, BodyDesc { rigid: true, ..BodyDesc::default() });
    let ball = Coat::ball(0.1);
    let body = BodyDesc { dissipation: 0.5, ..ball.body_desc() };
    let desc = LinkDesc { velocity_convention: convention, ..ball_link(Kind::Host, 1.0, 0.1, 0.0976) };
    let state = LinkState { pose: desc.pose, twist: desc.twist };
    let inertia = desc.inertia.m11;
    let (_, link) = ball.add(&mut world, body, desc);
    let mut host = Host { link, mass: 1.0, inertia, convention, state };
    for _ in 0..120 {
        host.tick(&mut world, Vec3::zeros());
    }
    (world, host)
}

#[test]
fn a_pushed_resting_host_ball_gains_force_times_time_over_mass() {
    for convention in [VelocityConvention::Leapfrog, VelocityConvention::Synchronous] {
        let (mut world, mut host) = resting_host(convention);
        assert!(host.state.twist.linear.norm() < 0.01 + G * DT, "not at rest: {:?}", host.state);
        for _ in 0..60 {
            host.tick(&mut world, Vec3::new(1.0, 0.0, 0.0));
        }
        // The push of the last tick acts in the next.
        let gained = host.state.twist.linear.x;
        println!("{convention:?}: pushed by 1 N for 1 s: {gained:.4} m/s, moved {:.4} m", host.state.pose.position.x);
        assert!((gained - 1.0).abs() < 0.02);
        assert!((host.state.pose.position.x - 0.5).abs() < 0.02);
    }
}

#[test]
fn a_kicked_resting_host_ball_gains_the_impulse_over_its_mass() {
    for convention in [VelocityConvention::Leapfrog, VelocityConvention::Synchronous] {
        let (mut world, mut host) = resting_host(convention);
        host.state.twist.linear.x += 0.7;
        for _ in 0..10 {
            host.tick(&mut world, Vec3::zeros());
        }
        println!("{convention:?}: kicked by 0.7 N s: {:.4} m/s", host.state.twist.linear.x);
        assert!((host.state.twist.linear.x - 0.7).abs() < 0.014);
        assert!((host.state.pose.position.z - 0.0977).abs() < 2e-3, "{:?}", host.state);
    }
}

#[test]
fn a_teleported_host_ball_behaves_as_a_new_one() {
    let (mut world, mut host) = resting_host(VelocityConvention::Leapfrog);
    let start = LinkState { pose: Pose::at(3.0, 0.0, 0.5), twist: Twist::default() };
    host.state = start;
    let (mut fresh_world, mut fresh) = resting_host(VelocityConvention::Leapfrog);
    fresh.state = start;
    fresh_world.teleport_link(fresh.link, &start).unwrap();
    for tick in 0..90 {
        host.tick(&mut world, Vec3::zeros());
        fresh.tick(&mut fresh_world, Vec3::zeros());
        assert_eq!(host.state, fresh.state, "tick {tick}");
    }
}

#[test]
fn an_undamped_host_ball_bounces_to_its_height_ten_times() {
    for convention in [VelocityConvention::Leapfrog, VelocityConvention::Synchronous] {
        for stiffness in [1e5, 1e7] {
            let mut world = world();
            add_floor(&mut world, BodyDesc { rigid: true, ..BodyDesc::default() });
            let ball = Coat::ball(0.1).stiff(stiffness);
            let mut desc = ball_link(Kind::Host, 1.0, 0.1, 1.1);
            desc.velocity_convention = convention;
            let state = LinkState { pose: desc.pose, twist: desc.twist };
            let mut host = Host { link: LinkId::default(), mass: 1.0, inertia: 1.0, convention, state };
            if convention == VelocityConvention::Leapfrog {
                // Half a tick old.
                host.state.twist.linear.z = 0.5 * G * DT;
            }
            host.link = ball.add(&mut world, ball.body_desc(), desc).1;
            let (mut apexes, mut last) = (Vec::new(), host.state);
            for _ in 0..900 {
                host.tick(&mut world, Vec3::zeros());
                if last.twist.linear.z > 0.0 && host.state.twist.linear.z <= 0.0 && host.state.pose.position.z > 0.5 {
                    // Vertex of the parabola through the last positions.
                    let speed = match convention {
                        VelocityConvention::Leapfrog => last.twist.linear.z - 0.5 * G * DT,
                        VelocityConvention::Synchronous => last.twist.linear.z,
                    };
                    apexes.push(last.pose.position.z + speed * speed.abs() / (2.0 * G));
                }
                last = host.state;
            }
            println!("{convention:?} K {stiffness:.0e}: apexes {apexes:.4?}");
            assert!(apexes.len() >= 10 && apexes.iter().all(|apex| (apex - 1.1).abs() < 0.03));
        }
    }
}

fn block_on_incline(friction: f64, seconds: f64) -> (f64, f64) {
    let angle = 20f64.to_radians();
    let tilt = rotation_from_vector(&Vec3::new(0.0, angle, 0.0));
    let gravity = Vec3::new(0.0, 0.0, -G);
    let mut world = World::new(WorldDesc { gravity, force_tolerance: 5e-2, ..WorldDesc::default() }).unwrap();
    let floor = Coat::floor(0.05);
    let rubbing = |coat: &Coat| BodyDesc { friction, static_friction: friction, dissipation: 2.0, ..coat.body_desc() };
    let place = |height: f64| Pose { position: tilt * Vec3::new(0.0, 0.0, height), rotation: tilt };
    let fixed = LinkDesc { kind: Kind::Fixed, pose: place(-0.05), ..LinkDesc::default() };
    floor.clone().hard().add(&mut world, BodyDesc { rigid: true, ..rubbing(&floor) }, fixed);
    let half = Vec3::new(0.1, 0.1, 0.05);
    let block = Coat::cuboid(half - Vec3::repeat(0.02), 0.02).stiff(1e5);
    let desc = LinkDesc {
        kind: Kind::Rigid,
        mass: 1.0,
        inertia: box_inertia(1.0, half),
        // At the depth where the face carries the weight's normal part.
        pose: place(0.05 - 9.2 / (0.16 * 0.16 * 1e5 * 100.0)),
        ..LinkDesc::default()
    };
    let start = desc.pose.position;
    let (_, link) = block.add(&mut world, rubbing(&block), desc);
    let down = tilt * Vec3::x();
    let mut speed = 0.0;
    for _ in 0..(seconds / DT).round() as usize {
        world.step(DT).unwrap();
        speed = world.link_state(link).unwrap().twist.linear.dot(&down);
    }
    ((world.link_state(link).unwrap().pose.position - start).dot(&down), speed)
}

#[test]
fn a_block_sticks_on_an_incline_below_the_friction_angle() {
    let (moved, _) = block_on_incline(0.5, 60.0);
    println!("mu 0.5 on 20 degrees: moved {:.2e} m in 60 s", moved);
    assert!(moved.abs() < 1e-4);
}

#[test]
fn a_block_slides_down_an_incline_as_coulomb_says() {
    let (_, early) = block_on_incline(0.3, 0.5);
    let (_, late) = block_on_incline(0.3, 1.5);
    let angle = 20f64.to_radians();
    let exact = G * (angle.sin() - 0.3 * angle.cos());
    println!("mu 0.3 on 20 degrees: {:.4} m/s2, textbook {exact:.4}", late - early);
    assert!(((late - early) / exact - 1.0).abs() < 0.02);
}

/// A ball of 0.1 m at 50 m/s onto a plate of 0.05 m; gives its lowest height, and whether an overload was reported.
fn impact(barrier_over_energy: f64) -> (f64, bool, f64) {
    let mut world = World::new(WorldDesc::default()).unwrap();
    // Fixed and hard, 0.05 m thick in all.
    let plate = Coat::cuboid(Vec3::new(0.99, 0.99, 0.015), 0.01).hard();
    let (_, _) = plate.add_fixed(&mut world, Pose::default());
    let (mass, speed, t) = (1.0, 50.0, 0.1);
    // A linear ball pressed flat stores π K k t⁴ / 6: the integral of F = π K k δ² (t - 2δ/3) over the depth.
    let energy = 0.5 * mass * speed * speed;
    let k = 2.0 / t;
    let stiffness = barrier_over_energy * energy / (std::f64::consts::PI * k * t.powi(4) / 6.0);
    let ball = Coat::ball(t).stiff(stiffness);
    let mut desc = ball_link(Kind::Rigid, mass, t, 0.6);
    desc.twist.linear.z = -speed;
    let (_, link) = ball.add(&mut world, ball.body_desc(), desc);
    let (mut lowest, mut overload) = (f64::INFINITY, false);
    for _ in 0..60 {
        world.step(DT).unwrap();
        lowest = lowest.min(world.link_state(link).unwrap().pose.position.z);
        overload |= world.events().iter().any(|event| event.kind == EventKind::Overload);
    }
    (lowest, overload, world.link_state(link).unwrap().twist.linear.z)
}

#[test]
fn a_fast_ball_does_not_tunnel_and_weak_barriers_push_it_out() {
    let (lowest, overload, speed) = impact(2.0);
    println!("barrier 2: lowest {lowest:.4} m, overload {overload}, leaves at {speed:.2} m/s");
    assert!(lowest > 0.0 && !overload && (speed - 50.0).abs() < 1.0);
    let (lowest, overload, speed) = impact(0.3);
    println!("barrier 0.3: lowest {lowest:.4} m, overload {overload}, leaves at {speed:.2} m/s");
    assert!(lowest > 0.0 && overload && speed > 0.0 && speed < 50.0);
}

#[test]
fn a_ball_rolling_on_a_frictionless_plane_never_starts_to_spin() {
    for scheme in [Scheme::Auto, Scheme::Facets, Scheme::Polar, Scheme::Adaptive, Scheme::Seeds] {
        let gravity = Vec3::new(0.0, 0.0, -G);
        let mut world = World::new(WorldDesc { gravity, scheme, ..WorldDesc::default() }).unwrap();
        add_floor(&mut world, BodyDesc::default());
        let ball = Coat::ball(0.1);
        let mut desc = ball_link(Kind::Rigid, 1.0, 0.1, 0.096);
        desc.pose.rotation = rotation_from_vector(&Vec3::new(0.3, -0.8, 0.5));
        let (_, link) = ball.add(&mut world, ball.body_desc(), desc);
        let (mut spin, ticks) = (0.0f64, if scheme == Scheme::Adaptive { 120 } else { 1200 });
        for _ in 0..ticks {
            world.step(DT).unwrap();
            spin = spin.max(world.link_state(link).unwrap().twist.angular.norm());
        }
        println!("{scheme:?}: spin after {:.0} s: {spin:.1e} rad/s", f64::from(ticks) * DT);
        assert!(scheme == Scheme::Seeds || spin < 1e-9);
    }
}

#[test]
fn explicit_wrench_of_a_host_link_is_the_force_at_the_pose_it_was_given() {
    let mut world = World::new(WorldDesc { response: Response::Explicit, ..WorldDesc::default() }).unwrap();
    add_floor(&mut world, BodyDesc { rigid: true, ..BodyDesc::default() });
    let ball = Coat::ball(0.1);
    let (_, link) = ball.add(&mut world, ball.body_desc(), ball_link(Kind::Host, 1.0, 0.1, 0.09));
    world.step(DT).unwrap();
    let (slope, depth) = (20.0 * 1e5, 0.01);
    let exact = std::f64::consts::PI * slope * depth * depth * (0.1 - 2.0 * depth / 3.0);
    let wrench = world.link_wrench(link).unwrap();
    assert!((wrench.force.z / exact - 1.0).abs() < 1e-12, "{} {exact}", wrench.force.z);
    let impulse = world.link_impulse(link).unwrap();
    assert!((impulse.force.z / (exact * DT) - 1.0).abs() < 1e-12);
}

#[test]
fn a_ball_thrown_to_and_fro_within_single_steps_keeps_its_energy() {
    // It crosses the gap of 0.03 m several times a step, and meets now one wall, now the other, now both.
    for speed in [3.0, 8.0, 15.0, 25.0] {
        let mut world = World::new(WorldDesc::default()).unwrap();
        add_floor(&mut world, BodyDesc { rigid: true, ..BodyDesc::default() });
        let ceiling = Coat::cuboid(Vec3::new(0.48, 0.48, 0.03), 0.02).hard();
        ceiling.add_fixed(&mut world, Pose::at(0.0, 0.0, 0.28));
        let ball = Coat::ball(0.1).stiff(5e5);
        let twist = Twist { linear: Vec3::new(0.0, 0.0, speed), angular: Vec3::zeros() };
        let desc = LinkDesc { twist, ..ball_link(Kind::Rigid, 0.1, 0.1, 0.1) };
        let (_, link) = ball.add(&mut world, ball.body_desc(), desc);
        let mut fastest = 0.0f64;
        for step in 0..240 {
            world.step(1.0 / 120.0).unwrap();
            let LinkState { pose, twist } = world.link_state(link).unwrap();
            assert!((0.05..0.18).contains(&pose.position.z), "{speed} m/s: at {} m", pose.position.z);
            assert!(twist.linear.norm() < 1.03 * speed, "{speed} m/s: {:.3} m/s in step {step}", twist.linear.norm());
            fastest = if step < 180 { 0.0 } else { fastest.max(twist.linear.norm()) };
        }
        println!("{speed} m/s: at most {fastest:.3} m/s at the end of the last 60 steps");
        assert!(fastest > 0.97 * speed);
    }
}
