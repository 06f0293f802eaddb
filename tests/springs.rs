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
fn cluster(response: Response, stiffness: f64, damping: f64, strain: f64) -> (World, BodyId) {
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
            let rest_length =
                if strain > 0.1 && a == b + 1 { 0.0 } else { length * (1.0 + strain * random.range(-1.0, 1.0)) };
            springs.push(SpringDesc { points, ..spring(links[a], links[b], rest_length, stiffness, damping) });
        }
    }
    world.create_springs(&springs).unwrap();
    (world, body)
}

#[test]
fn a_spinning_vibrating_cluster_keeps_its_momenta() {
    for (damping, steps) in [(0.0, 600), (3.0, 600)] {
        let (mut world, body) = cluster(Response::Substepped, 200.0, damping, 0.3);
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
        world.set_desc(WorldDesc { substep_phase: 0.05, ..world.desc().clone() }).unwrap();
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
        // A leapfrog host's velocity is half a tick old, and has grown by its gravity since.
        let speed = if convention == VelocityConvention::Leapfrog { -0.5 * G * DT } else { 0.0 };
        for step in 1..=60 {
            host.tick(&mut world, Vec3::zeros());
            let phase = rate * step as f64 * DT;
            let expected = rest + amplitude * phase.cos() + speed / rate * phase.sin();
            off = off.max((host.state.pose.position.z - expected).abs() / amplitude.abs());
        }
        println!("{convention:?} host on a spring: off by at most {off:.1e} of its amplitude in a second");
        assert!(off < 0.01, "{off}");
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

#[test]
fn an_implicit_spring_never_gains_energy_at_any_stiffness() {
    for exponent in -3..=8 {
        let masses = [1.0, 3.0];
        let stiffness = 0.75 * 10f64.powi(exponent) / (DT * DT);
        let (mut world, body, id) = two_masses(Response::Implicit, masses, stiffness, 0.0);
        let [a, b] = world.spring_desc(id).unwrap().links;
        for (link, speed) in [(a, -3.0), (b, 1.0)] {
            let mut state = world.link_state(link).unwrap();
            state.twist.linear = Vec3::new(0.2, speed, 0.0);
            world.set_link_state(link, &state).unwrap();
        }
        let (start, momentum) = (energy(&world, body), momenta(&world, body).0);
        let (mut last, mut gain, mut splits) = (start, 0.0f64, 0);
        for _ in 0..300 {
            world.step(DT).unwrap();
            let now = energy(&world, body);
            gain = gain.max((now - last) / start);
            last = now;
            splits += world.counters().implicit_splits;
        }
        let off = (momenta(&world, body).0 - momentum).norm() / momentum.norm();
        println!(
            "k h²/m = 1e{exponent}: energy {start:.3e} J to {last:.3e}, greatest gain in a step {gain:.1e} of it, momentum \
             off by {off:.1e}, {splits} splits"
        );
        assert!(gain < 1e-9 && off < 1e-12 && splits == 0);
    }
}

/// Backward Euler takes `w² h²` of the angular momentum a step: what spins freely for long is for sub-steps.
#[test]
fn an_implicit_pair_spins_down_as_backward_euler_does() {
    let (spin, stiffness) = (2.0, 1e6);
    let (mut world, body, id) = two_masses(Response::Implicit, [1.0, 1.0], stiffness, 0.0);
    let links = world.spring_desc(id).unwrap().links;
    for (link, side) in links.into_iter().zip([-0.5, 0.5]) {
        let twist = Twist { linear: Vec3::new(0.0, spin * side, 0.0), angular: Vec3::zeros() };
        world.set_link_state(link, &LinkState { pose: Pose::at(side, 0.0, 0.0), twist }).unwrap();
    }
    let mut worst = 0.0f64;
    let mut before = momenta(&world, body).1.z;
    for step in 0..120 {
        world.step(DT).unwrap();
        let after = momenta(&world, body).1.z;
        // At a length that stays 1 the rate is the angular momentum over the inertia of 0.5.
        let expected = 1.0 / (1.0 + (after / 0.5 * DT).powi(2));
        worst = if step > 2 { worst.max((after / before - expected).abs()) } else { worst };
        before = after;
    }
    println!(
        "a pair at {spin} rad/s: after two seconds at {:.4} rad/s, the law a step off by {worst:.1e}",
        before / 0.5
    );
    assert!(worst < 1e-5);
}

#[test]
fn an_implicit_cluster_keeps_its_momentum() {
    for stiffness in [2e2, 2e4, 2e6] {
        let (mut world, body) = cluster(Response::Implicit, stiffness, 0.0, 0.02);
        let (before, start) = (momenta(&world, body), energy(&world, body));
        let mut highest = start;
        let mut rounds = 0;
        for _ in 0..120 {
            world.step(DT).unwrap();
            highest = highest.max(energy(&world, body));
            rounds = rounds.max(world.counters().implicit_rounds);
        }
        let after = momenta(&world, body);
        let off = [(after.0 - before.0).norm() / before.0.norm(), (after.1 - before.1).norm() / before.1.norm()];
        println!(
            "implicit, {stiffness:.0e} N/m: momenta off by {:.1e} and {:.1e} after two seconds; energy {start:.2} J, at most \
             {highest:.2}; at most {rounds} rounds",
            off[0], off[1]
        );
        assert!(off[0] < 1e-12 && off[1] < 0.5 && highest <= start * (1.0 + 1e-9), "{off:?}");
    }
}

#[test]
fn a_mass_hangs_at_its_weight_over_the_stiffness() {
    for rest_length in [0.0, 1.0] {
        for exponent in [2, 4, 6, 9, 12] {
            let (mass, stiffness) = (2.0, 10f64.powi(exponent));
            let mut world = world(Response::Auto, G);
            let body = world.create_body(BodyDesc::default()).unwrap();
            let nail = world.create_link(body, fixed(Vec3::zeros())).unwrap();
            let at = Vec3::new(0.0, 0.0, -rest_length);
            let link = world.create_link(body, point_mass(mass, at, Vec3::zeros())).unwrap();
            let damping = 2.0 * f64::sqrt(stiffness * mass);
            let id = world.create_spring(spring(nail, link, rest_length, stiffness, damping)).unwrap();
            for _ in 0..1200 {
                world.step(DT).unwrap();
            }
            let (state, stretch) = (world.spring_state(id).unwrap(), mass * G / stiffness);
            let off = (state.length - rest_length - stretch).abs();
            println!(
                "{rest_length} m at {stiffness:.0e} N/m: stretch {stretch:.3e} m, off by {off:.1e}; {} sub-steps, {} rounds",
                world.counters().substeps,
                world.counters().implicit_rounds
            );
            assert!(off <= 1e-9 * stretch + 1e-15 * (1.0 + rest_length), "{off:e}");
            let wrench = world.link_wrench(nail).unwrap();
            assert!((wrench.force.z + mass * G).abs() < 1e-3 * mass * G, "{wrench:?}");
        }
    }
}

/// A bar on two springs carries on each what its lever says.
#[test]
fn a_bar_hangs_on_two_springs_by_the_law_of_the_lever() {
    let mut world = world(Response::Auto, G);
    let body = world.create_body(BodyDesc::default()).unwrap();
    let (mass, stiffness, arms) = (3.0, 5e4, [-0.4, 0.1]);
    let inertia = box_inertia(mass, Vec3::new(0.5, 0.05, 0.05));
    // Its frame is not at its centre of mass.
    let center = Vec3::new(0.2, 0.0, 0.05);
    let bar = LinkDesc { kind: Kind::Rigid, mass, inertia, local_center: center, ..fixed(Vec3::new(0.0, 0.0, -1.0)) };
    let bar = world.create_link(body, bar).unwrap();
    let springs = arms.map(|arm| {
        let top = Vec3::new(center.x + arm, 0.0, 0.0);
        let nail = world.create_link(body, fixed(top)).unwrap();
        let points = [Vec3::zeros(), Vec3::new(center.x + arm, 0.0, 0.0)];
        world.create_spring(SpringDesc { points, ..spring(nail, bar, 1.0, stiffness, 300.0) }).unwrap()
    });
    for _ in 0..6000 {
        world.step(DT).unwrap();
    }
    // It tilts a little by the springs' stretches, which moves its centre of mass sideways below them.
    let pose = world.link_state(bar).unwrap().pose;
    let heart = pose.transform_point(&center).x;
    let ends = arms.map(|arm| pose.transform_point(&Vec3::new(center.x + arm, 0.0, 0.0)).x);
    let weight = mass * G;
    let loads = [weight * (ends[1] - heart) / (ends[1] - ends[0]), weight * (heart - ends[0]) / (ends[1] - ends[0])];
    for (id, load) in springs.into_iter().zip(loads) {
        let state = world.spring_state(id).unwrap();
        println!("lever: {:.6} N for {load:.6} N", state.tension);
        assert!((state.tension / load - 1.0).abs() < 1e-4);
    }
    assert!(velocity(&world, bar).norm() < 1e-4);
}

/// Masses in a row, each on a spring from the one before, the first from a nail.
fn chain(world: &mut World, count: usize, mass: f64, length: f64, direction: Vec3, stiffness: f64) -> BodyId {
    let body = world.create_body(BodyDesc::default()).unwrap();
    let mut last = world.create_link(body, fixed(Vec3::zeros())).unwrap();
    let mut springs = Vec::new();
    for index in 1..=count {
        let at = direction * (length * index as f64);
        let next = world.create_link(body, point_mass(mass, at, Vec3::zeros())).unwrap();
        springs.push(spring(last, next, length, stiffness, 0.0));
        last = next;
    }
    world.create_springs(&springs).unwrap();
    body
}

#[test]
fn a_chain_of_20_masses_sags_as_it_must_up_to_1e9_newton_a_metre() {
    let (count, mass, length) = (20, 0.05, 0.1);
    for stiffness in [1e3, 1e5, 1e7, 1e9] {
        let mut world = world(Response::Auto, G);
        let swinging = chain(&mut world, count, mass, length, Vec3::x(), stiffness);
        let hanging = chain(&mut world, count, mass, length, -Vec3::z(), stiffness);
        let start = energy(&world, swinging);
        let (mut highest, mut rounds, mut splits) = (start, 0, 0);
        for _ in 0..2400 {
            world.step(DT).unwrap();
            highest = highest.max(energy(&world, swinging));
            let counters = world.counters();
            (rounds, splits) = (rounds.max(counters.implicit_rounds), splits + counters.implicit_splits);
        }
        let last = |body| world.body_links(body).unwrap().last().unwrap();
        // The spring above mass i carries all from i on.
        let sag = mass * G / stiffness * (count * (count + 1)) as f64 / 2.0;
        let off = -position(&world, last(hanging)).z - count as f64 * length - sag;
        // From level to below the nail: the scale of what it loses.
        let fall = mass * G * length * (count * (count + 1)) as f64 / 2.0;
        let low = -position(&world, last(swinging)).z / (count as f64 * length + sag);
        println!(
            "chain at {stiffness:.0e} N/m: sag {sag:.3e} m, off by {off:.1e} m; swung from level, energy at most {:.1e} of the \
             fall above the start, its end at {low:.4} of the depth at rest; {rounds} rounds, {splits} splits",
            (highest - start) / fall
        );
        assert!(off.abs() <= 1e-6 * sag + 1e-14, "{off:e}");
        assert!(highest - start <= 1e-9 * fall && low > 0.9);
    }
}

#[test]
fn a_sprung_body_that_nothing_holds_falls_on_the_exact_parabola() {
    for response in [Response::Implicit, Response::Substepped] {
        let (mut world, body, id) = two_masses(response, [1.0, 3.0], 3e4, 0.0);
        world.set_desc(WorldDesc { gravity: Vec3::new(0.0, 0.0, -G), ..world.desc().clone() }).unwrap();
        let links = world.spring_desc(id).unwrap().links;
        let center = |world: &World| (position(world, links[0]) + position(world, links[1]) * 3.0) / 4.0;
        let before = center(&world);
        for _ in 0..120 {
            world.step(DT).unwrap();
        }
        let expected = before + Vec3::new(0.0, 0.0, -0.5 * G * 4.0);
        assert!((center(&world) - expected).norm() < 1e-12, "{response:?}");
        assert!((momenta(&world, body).0.z / 4.0 + G * 2.0).abs() < 1e-11);
    }
}

#[test]
fn stiff_springs_are_solved_implicitly_and_soft_ones_are_not() {
    for (phase, stiff) in [(0.29, false), (0.31, true)] {
        // For two masses of 1 kg the square of the rate is twice the stiffness.
        let (mut world, ..) = two_masses(Response::Auto, [1.0, 1.0], 0.5 * (phase / DT) * (phase / DT), 0.0);
        world.step(DT).unwrap();
        let counters = world.counters();
        assert_eq!((counters.implicit_rounds > 0, counters.substeps > 0), (stiff, !stiff));
    }
}

#[test]
fn ends_in_one_point_are_no_trouble() {
    for response in [Response::Explicit, Response::Substepped, Response::Implicit] {
        for rest_length in [0.0, 0.5] {
            let mut world = world(response, 0.0);
            let body = world.create_body(BodyDesc::default()).unwrap();
            let links = [0, 1].map(|_| world.create_link(body, point_mass(1.0, Vec3::x(), Vec3::zeros())).unwrap());
            let id = world.create_spring(spring(links[0], links[1], rest_length, 100.0, 1.0)).unwrap();
            world.step(DT).unwrap();
            // No direction, no force.
            assert!(links.iter().all(|link| position(&world, *link) == Vec3::x()), "{response:?}");
            assert_eq!(world.spring_state(id).unwrap().tension, -100.0 * rest_length);
            let mut state = world.link_state(links[0]).unwrap();
            state.twist.linear = Vec3::new(0.0, 0.1, 0.0);
            world.set_link_state(links[0], &state).unwrap();
            for _ in 0..600 {
                world.step(DT).unwrap();
            }
            let state = world.spring_state(id).unwrap();
            assert!((state.length - rest_length).abs() < 1e-2, "{response:?} {rest_length}: {state:?}");
            assert!((momenta(&world, body).0 - Vec3::new(0.0, 0.1, 0.0)).norm() < 1e-12);
        }
    }
}

/// A link that the host drags takes its mass along.
#[test]
fn a_mass_hangs_from_an_anchor_that_moves() {
    for (response, stiffness) in [(Response::Substepped, 400.0), (Response::Implicit, 1e6)] {
        let mut world = world(response, G);
        let body = world.create_body(BodyDesc::default()).unwrap();
        let speed = Vec3::new(0.0, 0.0, 0.5);
        let anchor = LinkDesc {
            kind: Kind::Host,
            twist: Twist { linear: speed, angular: Vec3::zeros() },
            ..fixed(Vec3::zeros())
        };
        let anchor = world.create_link(body, anchor).unwrap();
        let mass = world.create_link(body, point_mass(1.0, Vec3::new(0.0, 0.0, -1.0), speed)).unwrap();
        let id = world.create_spring(spring(anchor, mass, 1.0, stiffness, f64::sqrt(stiffness))).unwrap();
        for _ in 0..600 {
            world.step(DT).unwrap();
            let mut state = world.link_state(anchor).unwrap();
            state.pose.position += speed * DT;
            world.set_link_state(anchor, &state).unwrap();
        }
        let state = world.spring_state(id).unwrap();
        assert!((velocity(&world, mass) - speed).norm() < 1e-9);
        assert!((state.length - 1.0 - G / stiffness).abs() < 1e-6 * G / stiffness + 1e-13, "{state:?}");
        assert!((world.link_wrench(anchor).unwrap().force.z + G).abs() < 1e-6);
    }
}

/// A block of point masses on a lattice, with springs to all neighbours, edges, faces and bodies across.
struct Jelly {
    side: usize,
    spacing: f64,
    mass: f64,
    stiffness: f64,
    damping: f64,
    thickness: f64,
    coat_stiffness: f64,
}

const JELLY: Jelly =
    Jelly { side: 3, spacing: 0.1, mass: 0.05, stiffness: 2000.0, damping: 2.0, thickness: 0.025, coat_stiffness: 1e5 };

impl Jelly {
    fn places(&self) -> Vec<Vec3> {
        let middle = 0.5 * (self.side as f64 - 1.0);
        let along = |i: usize| (i as f64 - middle) * self.spacing;
        let side = self.side;
        (0..side.pow(3)).map(|i| Vec3::new(along(i % side), along(i / side % side), along(i / side / side))).collect()
    }

    fn edges(&self, places: &[Vec3]) -> Vec<(usize, usize, f64)> {
        let pairs = (0..places.len()).flat_map(|a| (0..a).map(move |b| (a, b)));
        let long = pairs.map(|(a, b)| (a, b, (places[a] - places[b]).norm()));
        long.filter(|(.., length)| *length < 1.8 * self.spacing).collect()
    }

    fn add(&self, world: &mut World, pose: &Pose) -> BodyId {
        let desc =
            BodyDesc { stiffness_scale: self.coat_stiffness, dissipation: 1.0, friction: 0.3, ..BodyDesc::default() };
        let body = world.create_body(desc).unwrap();
        let places = self.places();
        let links: Vec<LinkId> = places
            .iter()
            .map(|place| {
                let link = point_mass(self.mass, pose.transform_point(place), Vec3::zeros());
                let link = world.create_link(body, link).unwrap();
                // Its neighbours are out of reach: each point is a ball of its own.
                let desc =
                    SkeletonDesc { thickness: self.thickness, radius: 0.5 * self.spacing, ..SkeletonDesc::default() };
                world.create_skeleton(link, desc).unwrap();
                link
            })
            .collect();
        let edges = self.edges(&places);
        let springs: Vec<_> = edges
            .iter()
            .map(|(a, b, length)| spring(links[*a], links[*b], *length, self.stiffness, self.damping))
            .collect();
        world.create_springs(&springs).unwrap();
        body
    }

    /// Height of the centre of mass at rest on a face: the springs, the weights, and a ball in a hard floor at each of the
    /// lowest masses, `π K k δ² (t - 2δ/3)`, let come to rest in many small steps.
    fn rest_height(&self) -> f64 {
        let mut at = self.places();
        let edges = self.edges(&at);
        let lowest = at[0].z;
        at.iter_mut().for_each(|place| place.z += self.thickness - lowest);
        let mut velocities = vec![Vec3::zeros(); at.len()];
        let slope = 2.0 / (0.5 * self.spacing - self.thickness);
        let h = 2e-4;
        for _ in 0..40_000 {
            let mut forces = vec![Vec3::new(0.0, 0.0, -self.mass * G); at.len()];
            for (a, b, length) in &edges {
                let line = at[*b] - at[*a];
                let pull = line * (self.stiffness * (1.0 - length / line.norm()));
                forces[*a] += pull;
                forces[*b] -= pull;
            }
            for ((place, force), velocity) in at.iter_mut().zip(&mut forces).zip(&mut velocities) {
                let sink = (self.thickness - place.z).max(0.0);
                let carried = PI * self.coat_stiffness * slope * sink * sink * (self.thickness - 2.0 / 3.0 * sink);
                force.z += carried;
                *velocity = (*velocity + *force * (h / self.mass)) * 0.998;
                *place += *velocity * h;
            }
        }
        at.iter().map(|place| place.z).sum::<f64>() / at.len() as f64
    }
}

fn add_floor(world: &mut World) {
    let floor = Coat::floor(0.1).hard();
    let pose = Pose::at(0.0, 0.0, -0.1);
    floor.add(world, BodyDesc { friction: 0.3, ..floor.body_desc() }, LinkDesc { pose, ..LinkDesc::default() });
}

#[test]
fn a_jelly_dropped_on_its_corner_comes_to_rest_on_a_face() {
    let mut world = world(Response::Auto, G);
    add_floor(&mut world);
    let corner = Vec3::repeat(-1.0);
    let down = Quat::rotation_between(&corner, &-Vec3::z()).unwrap();
    let rotation = Quat::from_scaled_axis(Vec3::new(0.15, 0.1, 0.0)) * down;
    let body = JELLY.add(&mut world, &Pose { position: Vec3::new(0.0, 0.0, 0.3), rotation });
    let links: Vec<_> = world.body_links(body).unwrap().collect();
    let start = energy(&world, body);
    let (mut highest, mut rounds, mut splits) = (start, 0, 0);
    for _ in 0..600 {
        world.step(DT).unwrap();
        highest = highest.max(energy(&world, body));
        let counters = world.counters();
        (rounds, splits) = (rounds.max(counters.implicit_rounds), splits + counters.implicit_splits);
        assert!(links.iter().all(|link| isocoat::math::is_finite(&position(&world, *link))));
    }
    let fastest = links.iter().map(|link| velocity(&world, *link).norm()).fold(0.0, f64::max);
    let height = links.iter().map(|link| position(&world, *link).z).sum::<f64>() / links.len() as f64;
    let expected = JELLY.rest_height();
    println!(
        "jelly of {} masses and {} springs: energy {start:.4} J, at most {highest:.4}; after ten seconds at most {fastest:.1e} \
         m/s, its centre at {height:.6} m for {expected:.6} m; {rounds} rounds, {splits} splits, {} patches",
        links.len(),
        world.body_springs(body).unwrap().count(),
        world.counters().patches
    );
    assert!(highest <= start * (1.0 + 1e-9) && fastest < 1e-3);
    assert!((height - expected).abs() < 2e-5);
    let carried: f64 = links.iter().map(|link| world.link_wrench(*link).unwrap().force.z).sum();
    assert!((carried / (JELLY.mass * G * links.len() as f64) - 1.0).abs() < 1e-3);
}

#[test]
fn a_jelly_at_rest_falls_asleep_and_wakes_when_a_spring_changes() {
    let mut world = world(Response::Auto, G);
    world.set_desc(WorldDesc { sleep_time: 0.5, ..world.desc().clone() }).unwrap();
    add_floor(&mut world);
    let small = Jelly { side: 2, ..JELLY };
    let body = small.add(&mut world, &Pose::at(0.0, 0.0, 0.08));
    let mut steps = 0;
    while world.body_is_awake(body).unwrap() {
        world.step(DT).unwrap();
        steps += 1;
        assert!(steps < 1200);
    }
    let links: Vec<_> = world.body_links(body).unwrap().collect();
    let before: Vec<_> = links.iter().map(|link| position(&world, *link)).collect();
    for _ in 0..10 {
        world.step(DT).unwrap();
    }
    assert!(links.iter().zip(&before).all(|(link, before)| position(&world, *link) == *before));
    let first = world.body_springs(body).unwrap().next().unwrap();
    world
        .set_spring_desc(first, SpringDesc { rest_length: 0.12, ..world.spring_desc(first).unwrap().clone() })
        .unwrap();
    assert!(world.body_is_awake(body).unwrap());
    world.step(DT).unwrap();
    assert!(links.iter().zip(&before).any(|(link, before)| position(&world, *link) != *before));
    println!("a jelly of 8 masses falls asleep after {steps} steps");
}

/// Every bit of a body's state.
fn bits(world: &World, body: BodyId) -> Vec<u64> {
    let links = world.body_links(body).unwrap();
    let numbers = links.flat_map(|link| {
        let LinkState { pose, twist } = world.link_state(link).unwrap();
        let wrench = world.link_wrench(link).unwrap();
        let vectors = [pose.position, twist.linear, twist.angular, wrench.force, wrench.torque];
        vectors
            .into_iter()
            .flat_map(|v| [v.x, v.y, v.z])
            .chain(pose.rotation.coords.iter().copied().collect::<Vec<_>>())
    });
    let springs = world.body_springs(body).unwrap();
    let lengths = springs.map(|id| world.spring_state(id).unwrap().length);
    numbers.chain(lengths).map(f64::to_bits).collect()
}

#[test]
fn a_rollback_gives_the_same_bits_and_the_springs_back() {
    for (response, stiffness) in [(Response::Substepped, 2e2), (Response::Implicit, 2e5), (Response::Explicit, 2e2)] {
        let (mut world, body) = cluster(response, stiffness, 1.0, 0.02);
        for _ in 0..10 {
            world.step(DT).unwrap();
        }
        let mut bytes = Vec::new();
        world.snapshot(&mut bytes);
        let run = |world: &mut World, body: BodyId| {
            (0..20).for_each(|_| world.step(DT).unwrap());
            bits(world, body)
        };
        let first = run(&mut world, body);
        let springs: Vec<_> = world.body_springs(body).unwrap().collect();
        world.destroy_spring(springs[0]).unwrap();
        let replaced = SpringDesc { user_data: 9, ..world.spring_desc(springs[1]).unwrap().clone() };
        let undone = world.create_spring(replaced).unwrap();
        run(&mut world, body);
        world.restore(&bytes).unwrap();
        assert_eq!(world.body_springs(body).unwrap().collect::<Vec<_>>(), springs);
        assert!(world.spring_desc(undone).is_err());
        assert_eq!(run(&mut world, body), first);
        // In another world the springs join its own links.
        let mut other = World::new(WorldDesc::default()).unwrap();
        other.restore(&bytes).unwrap();
        let there = other.bodies().next().unwrap();
        let id = other.body_springs(there).unwrap().next().unwrap();
        let links: Vec<_> = other.body_links(there).unwrap().collect();
        assert!(other.spring_desc(id).unwrap().links.iter().all(|link| links.contains(link)));
        assert_eq!(run(&mut other, there), first);
    }
}
