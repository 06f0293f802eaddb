//! Springs between links of a body: frequencies, conservation laws, statics, and a block of jelly.
//!
//! Figures: `cargo test --release --test springs -- --nocapture`.

mod common;

use std::f64::consts::PI;

use common::{Coat, DT, G, Host, Random, ball_inertia, box_inertia};
use isocoat::base::Kind;
use isocoat::math::{Mat3, Pose, Quat, Twist, Vec3};
use isocoat::world::{
    BodyDesc, BodyId, LinkDesc, LinkId, LinkState, Response, SkeletonDesc, SpringDesc, SpringId, VelocityConvention,
    World, WorldDesc,
};

fn world(response: Response, gravity: f64) -> World {
    let gravity = Vec3::new(0.0, 0.0, -gravity);
    World::new(WorldDesc { gravity, response, ..WorldDesc::default() }).unwrap()
}

fn point_mass(mass: f64, at: Vec3, velocity: Vec3) -> LinkDesc {
    LinkDesc {
        kind: Kind::PointMass,
        mass,
        pose: Pose::at(at.x, at.y, at.z),
        twist: Twist { linear: velocity, angular: Vec3::zeros() },
        ..LinkDesc::default()
    }
}

fn fixed(at: Vec3) -> LinkDesc {
    LinkDesc { pose: Pose::at(at.x, at.y, at.z), ..LinkDesc::default() }
}

/// A spring between the origins of two links.
fn spring(a: LinkId, b: LinkId, rest_length: f64, stiffness: f64, damping: f64) -> SpringDesc {
    SpringDesc { links: [a, b], rest_length, stiffness, damping, ..SpringDesc::default() }
}

fn position(world: &World, link: LinkId) -> Vec3 {
    world.link_state(link).unwrap().pose.position
}

fn velocity(world: &World, link: LinkId) -> Vec3 {
    world.link_state(link).unwrap().twist.linear
}

/// Kinetic, spring and gravitational energy of a body.
fn energy(world: &World, body: BodyId) -> f64 {
    let mut sum = 0.0;
    for link in world.body_links(body).unwrap() {
        let (desc, LinkState { pose, twist }) = (world.link_desc(link).unwrap(), world.link_state(link).unwrap());
        if !matches!(desc.kind, Kind::PointMass | Kind::Rigid) {
            continue;
        }
        let center = pose.transform_point(&desc.local_center);
        let local = pose.rotation.inverse() * twist.angular;
        sum += 0.5 * desc.mass * twist.linear.norm_squared() - desc.mass * world.desc().gravity.dot(&center);
        sum += 0.5 * local.dot(&(desc.inertia * local));
    }
    sum + world.body_springs(body).unwrap().map(|id| world.spring_state(id).unwrap().energy).sum::<f64>()
}

/// Momentum, and angular momentum about the origin, of a body.
fn momenta(world: &World, body: BodyId) -> (Vec3, Vec3) {
    let (mut linear, mut angular) = (Vec3::zeros(), Vec3::zeros());
    for link in world.body_links(body).unwrap() {
        let (desc, LinkState { pose, twist }) = (world.link_desc(link).unwrap(), world.link_state(link).unwrap());
        let momentum = twist.linear * desc.mass;
        linear += momentum;
        angular += pose.transform_point(&desc.local_center).cross(&momentum);
        if desc.kind == Kind::Rigid {
            angular += pose.rotation * (desc.inertia * (pose.rotation.inverse() * twist.angular));
        }
    }
    (linear, angular)
}

/// Two masses on a spring of 1 m that is stretched by a tenth.
fn two_masses(response: Response, masses: [f64; 2], stiffness: f64, damping: f64) -> (World, BodyId, SpringId) {
    let mut world = world(response, 0.0);
    let body = world.create_body(BodyDesc::default()).unwrap();
    let a = world.create_link(body, point_mass(masses[0], Vec3::zeros(), Vec3::zeros())).unwrap();
    let b = world.create_link(body, point_mass(masses[1], Vec3::new(1.1, 0.0, 0.0), Vec3::zeros())).unwrap();
    let id = world.create_spring(spring(a, b, 1.0, stiffness, damping)).unwrap();
    (world, body, id)
}

/// Rate and decay of a spring's stretch over some steps: the turn of `(s, (v + decay s) / rate)`, and how it shrinks.
fn swing(world: &mut World, id: SpringId, rate: f64, decay: f64, steps: usize) -> (f64, f64) {
    let read = |world: &World| {
        let state = world.spring_state(id).unwrap();
        let stretch = state.length - world.spring_desc(id).unwrap().rest_length;
        (stretch, -(state.rate + decay * stretch) / rate)
    };
    let (mut last, mut turned) = (read(world), 0.0);
    let first = last;
    for _ in 0..steps {
        world.step(DT).unwrap();
        let now = read(world);
        turned += (last.0 * now.1 - last.1 * now.0).atan2(last.0 * now.0 + last.1 * now.1);
        last = now;
    }
    let time = steps as f64 * DT;
    (turned / time, (first.0.hypot(first.1) / last.0.hypot(last.1)).ln() / time)
}

#[test]
fn two_masses_swing_at_the_root_of_stiffness_over_reduced_mass() {
    for (stiffness, damping_ratio) in [(27.0, 0.0), (27.0, 0.1), (2700.0, 0.0), (2700.0, 0.1), (2700.0, 0.5)] {
        let masses = [1.0, 3.0];
        let reduced = masses[0] * masses[1] / (masses[0] + masses[1]);
        let free = f64::sqrt(stiffness / reduced);
        let damping = 2.0 * damping_ratio * free * reduced;
        let (rate, decay) = (free * f64::sqrt(1.0 - damping_ratio * damping_ratio), damping_ratio * free);
        let (mut world, _, id) = two_masses(Response::Substepped, masses, stiffness, damping);
        world.set_desc(WorldDesc { substep_phase: 0.1, ..world.desc().clone() }).unwrap();
        let steps = (6.0 * 2.0 * PI / free / DT) as usize;
        let (measured, decayed) = swing(&mut world, id, rate, decay, steps);
        let (off, off_decay) = (measured / rate - 1.0, decayed / free - damping_ratio);
        let substeps = world.counters().substeps;
        println!(
            "{stiffness} N/m, ratio {damping_ratio}, {substeps} sub-steps: rate off by {off:.1e}, ratio by {off_decay:.1e}"
        );
        assert!(off.abs() < 1e-3 && off_decay.abs() < 1e-3 * damping_ratio.max(0.1), "{off} {off_decay}");
    }
}

/// Point masses and off-centre solids in a heap of springs, spinning, stretched, drifting.
fn cluster(response: Response, stiffness: f64, damping: f64) -> (World, BodyId) {
    let mut world = world(response, 0.0);
    let body = world.create_body(BodyDesc::default()).unwrap();
    let mut random = Random(11);
    let spin = Vec3::new(0.3, -0.5, 2.0);
    let mut links = Vec::new();
    for index in 0..9 {
        let at = Vec3::from_fn(|_, _| random.range(-0.5, 0.5));
        let mut desc = point_mass(random.range(0.5, 2.0), at, spin.cross(&at) + Vec3::new(0.2, 0.1, -0.3));
        if index % 3 == 0 {
            desc.kind = Kind::Rigid;
            desc.inertia = box_inertia(desc.mass, Vec3::new(0.2, 0.15, 0.1));
            desc.local_center = Vec3::new(0.05, 0.0, -0.02);
            desc.pose.rotation = random.rotation();
            desc.twist.angular = random.direction() * 2.0;
        }
        links.push(world.create_link(body, desc).unwrap());
    }
    let mut springs = Vec::new();
    for a in 0..links.len() {
        for b in 0..a {
            if (a + b) % 3 == 2 {
                continue;
            }
            let end = |link: usize, random: &mut Random| match link % 3 {
                0 => Vec3::from_fn(|_, _| random.range(-0.15, 0.15)),
                _ => Vec3::zeros(),
            };
            let points = [end(a, &mut random), end(b, &mut random)];
            let length = (position(&world, links[a]) - position(&world, links[b])).norm();
            let rest_length = if a == b + 1 { 0.0 } else { length * random.range(0.7, 1.2) };
            springs.push(SpringDesc { points, ..spring(links[a], links[b], rest_length, stiffness, damping) });
        }
    }
    world.create_springs(&springs).unwrap();
    (world, body)
}

#[test]
fn a_spinning_vibrating_cluster_keeps_its_momenta() {
    for (damping, steps) in [(0.0, 600), (3.0, 600)] {
        let (mut world, body) = cluster(Response::Substepped, 200.0, damping);
        let (before, start) = (momenta(&world, body), energy(&world, body));
        let mut highest = start;
        for _ in 0..steps {
            world.step(DT).unwrap();
            highest = highest.max(energy(&world, body));
        }
        let (after, end) = (momenta(&world, body), energy(&world, body));
        let off = [(after.0 - before.0).norm() / before.0.norm(), (after.1 - before.1).norm() / before.1.norm()];
        println!(
            "sub-stepped, damping {damping}: momenta off by {:.1e} and {:.1e}; energy {start:.4} J, at most {highest:.4}, \
             at the end {end:.4}",
            off[0], off[1]
        );
        assert!(off.iter().all(|off| *off < 1e-10), "{off:?}");
        if damping == 0.0 {
            // Symplectic: it wavers by the square of the phase, and goes nowhere.
            assert!((highest / start - 1.0).abs() < 0.04 && (end / start - 1.0).abs() < 0.04);
        } else {
            assert!(highest <= start * (1.0 + 1e-3) && end < 0.9 * start);
        }
    }
}

/// A bar on a spring without length at its end.
fn pendulum(response: Response, stiffness: f64, angle: f64, length: f64, gravity: f64) -> (World, LinkId, SpringId) {
    let mut world = world(response, gravity);
    let body = world.create_body(BodyDesc::default()).unwrap();
    let nail = world.create_link(body, fixed(Vec3::zeros())).unwrap();
    let end = Vec3::new(0.0, 0.0, length);
    let rotation = Quat::from_scaled_axis(Vec3::new(0.0, angle, 0.0));
    // Hung so that the spring has its stretch already.
    let stretch = Vec3::new(0.0, 0.0, -gravity / stiffness);
    let bar = LinkDesc {
        kind: Kind::Rigid,
        mass: 1.0,
        inertia: box_inertia(1.0, Vec3::new(0.1, 0.2, length)),
        pose: Pose { position: stretch - rotation * end, rotation },
        ..LinkDesc::default()
    };
    let bar = world.create_link(body, bar).unwrap();
    let points = [Vec3::zeros(), end];
    let id = world.create_spring(SpringDesc { points, ..spring(nail, bar, 0.0, stiffness, 0.0) }).unwrap();
    (world, bar, id)
}

#[test]
fn a_bar_on_a_spring_at_its_end_swings_as_a_pendulum() {
    let (stiffness, length, angle) = (1e5, 0.5, 0.02);
    let (mut world, bar, _) = pendulum(Response::Substepped, stiffness, angle, length, G);
    let inertia = world.link_desc(bar).unwrap().inertia[(1, 1)];
    // Length of the stretched spring included; the amplitude adds 1/16 of its square.
    let lever = length;
    let period = 2.0 * PI * f64::sqrt((inertia + lever * lever) / (G * lever)) * (1.0 + angle * angle / 16.0);
    let tilt = |world: &World| (world.link_state(bar).unwrap().pose.rotation * Vec3::z()).x;
    let (mut crossings, mut last) = (Vec::new(), tilt(&world));
    for step in 0..(5.2 * period / DT) as usize {
        world.step(DT).unwrap();
        let now = tilt(&world);
        if last > 0.0 && now <= 0.0 {
            crossings.push((step as f64 + last / (last - now)) * DT);
        }
        last = now;
    }
    let measured = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    println!("pendulum: {measured:.5} s for {period:.5} s, off by {:.1e}", measured / period - 1.0);
    assert!((measured / period - 1.0).abs() < 1e-3);
}

/// A host with its own integrator hangs on a spring: it is told the spring's impulses, and swings as it would.
#[test]
fn a_host_driven_link_swings_on_its_spring() {
    for convention in [VelocityConvention::Leapfrog, VelocityConvention::Synchronous] {
        let mut world = world(Response::Substepped, G);
        let body = world.create_body(BodyDesc::default()).unwrap();
        let nail = world.create_link(body, fixed(Vec3::zeros())).unwrap();
        let (stiffness, mass) = (2000.0, 2.0);
        let at = Vec3::new(0.0, 0.0, -1.05);
        let desc = LinkDesc {
            kind: Kind::Host,
            mass,
            inertia: ball_inertia(mass, 0.1),
            velocity_convention: convention,
            ..fixed(at)
        };
        let link = world.create_link(body, desc).unwrap();
        world.create_spring(spring(nail, link, 1.0, stiffness, 0.0)).unwrap();
        let state = LinkState { pose: Pose::at(at.x, at.y, at.z), ..LinkState::default() };
        let mut host = Host { link, mass, inertia: 0.4 * mass * 0.01, convention, state };
        let (rest, rate) = (-1.0 - mass * G / stiffness, f64::sqrt(stiffness / mass));
        let mut off = 0.0f64;
        let amplitude = at.z - rest;
        for step in 1..=60 {
            host.tick(&mut world, Vec3::zeros());
            let expected = rest + amplitude * f64::cos(rate * step as f64 * DT);
            off = off.max((host.state.pose.position.z - expected).abs() / amplitude.abs());
        }
        println!("{convention:?} host on a spring: off by at most {off:.1e} of its amplitude in a second");
        assert!(off < 0.06, "{off}");
    }
}

#[test]
fn what_cannot_be_is_refused_with_value_and_range() {
    let (mut world, body, id) = two_masses(Response::Auto, [1.0, 1.0], 10.0, 0.0);
    let good = world.spring_desc(id).unwrap().clone();
    let [a, b] = good.links;
    let other = world.create_body(BodyDesc::default()).unwrap();
    let elsewhere = world.create_link(other, fixed(Vec3::zeros())).unwrap();
    let cases = [
        (SpringDesc { rest_length: -1.0, ..good.clone() }, "rest_length is -1; must be from 0 to 1e9"),
        (SpringDesc { stiffness: f64::NAN, ..good.clone() }, "stiffness of a spring is NaN; must be from 0 to 1e18"),
        (SpringDesc { damping: 1e19, ..good.clone() }, "must be from 0 to 1e18"),
        (SpringDesc { links: [a, a], ..good.clone() }, "not one with itself"),
        (SpringDesc { links: [a, elsewhere], ..good.clone() }, "links of one body"),
        (SpringDesc { links: [a, LinkId::default()], ..good.clone() }, "link: the handle is null"),
        (SpringDesc { points: [Vec3::x(), Vec3::zeros()], ..good.clone() }, "must be the origin of its frame"),
        (SpringDesc { points: [Vec3::x() * f64::INFINITY, Vec3::zeros()], ..good.clone() }, "must be finite"),
    ];
    for (bad, why) in cases {
        let before = world.body_springs(body).unwrap().count();
        let said = [
            world.create_spring(bad.clone()).unwrap_err().to_string(),
            world.create_springs(&[good.clone(), bad.clone()]).unwrap_err().to_string(),
            world.set_spring_desc(id, bad).unwrap_err().to_string(),
        ];
        assert!(said.iter().all(|said| said.contains(why)), "{said:?}; must contain {why}");
        assert_eq!(world.body_springs(body).unwrap().count(), before);
        assert_eq!(*world.spring_desc(id).unwrap(), good);
    }
    let moved = SpringDesc { links: [elsewhere, world.create_link(other, fixed(Vec3::x())).unwrap()], ..good.clone() };
    assert!(world.set_spring_desc(id, moved).unwrap_err().to_string().contains("stays with its body"));
    // A solid with a spring off its centre becomes no point mass.
    let solid = LinkDesc { kind: Kind::Rigid, inertia: Mat3::identity(), ..world.link_desc(b).unwrap().clone() };
    world.set_link_desc(b, solid.clone()).unwrap();
    world.create_spring(SpringDesc { points: [Vec3::zeros(), Vec3::y()], ..good }).unwrap();
    let point = LinkDesc { kind: Kind::PointMass, ..solid };
    assert!(world.set_link_desc(b, point).unwrap_err().to_string().contains("(0, 1, 0)"));
}

#[test]
fn a_spring_goes_with_its_links() {
    let (mut world, body, id) = two_masses(Response::Auto, [1.0, 1.0], 10.0, 0.0);
    let [a, b] = world.spring_desc(id).unwrap().links;
    let c = world.create_link(body, fixed(Vec3::y())).unwrap();
    let made = world.create_springs(&[spring(a, c, 1.0, 1.0, 0.0), spring(b, c, 1.0, 1.0, 0.0)]).unwrap();
    assert_eq!(world.body_springs(body).unwrap().collect::<Vec<_>>(), [id, made[0], made[1]]);
    world.destroy_link(a).unwrap();
    assert_eq!(world.body_springs(body).unwrap().collect::<Vec<_>>(), [made[1]]);
    assert!(world.spring_state(id).unwrap_err().to_string().contains("spring: the handle is stale"));
    world.step(DT).unwrap();
    world.destroy_spring(made[1]).unwrap();
    assert!(world.destroy_spring(made[1]).is_err());
    let last = world.create_spring(spring(b, c, 1.0, 1.0, 0.0)).unwrap();
    world.destroy_body(body).unwrap();
    assert!(world.spring_desc(last).is_err());
    world.step(DT).unwrap();
}

#[test]
fn the_springs_of_a_link_that_takes_no_part_do_not_pull() {
    let (mut world, _, id) = two_masses(Response::Auto, [1.0, 1.0], 10.0, 0.0);
    let [a, b] = world.spring_desc(id).unwrap().links;
    world.set_link_enabled(a, false).unwrap();
    world.step(DT).unwrap();
    assert_eq!(velocity(&world, b), Vec3::zeros());
    world.set_link_enabled(a, true).unwrap();
    world.step(DT).unwrap();
    assert!(velocity(&world, b).x < 0.0);
}
