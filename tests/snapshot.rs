//! Snapshots: a restored world goes on with the same bits as one that never stopped, and what is damaged is refused
//! with its reason while the world stays as it was.

mod common;

use std::time::Instant;

use common::{Coat, ball_inertia, box_inertia};
use isocoat::base::Kind;
use isocoat::error::Error;
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Vec3, rotation_from_vector};
use isocoat::world::{
    BodyDesc, BodyId, LinkDesc, LinkId, LinkState, Response, Scheme, SkeletonDesc, StiffnessRule, VelocityConvention,
    World, WorldDesc,
};
use proptest::prelude::*;

const DT: f64 = 1.0 / 60.0;

fn taken(world: &World) -> Vec<u8> {
    let mut bytes = Vec::new();
    world.snapshot(&mut bytes);
    assert_eq!(bytes.len(), world.snapshot_size());
    bytes
}

fn settings(response: Response, scheme: Scheme) -> WorldDesc {
    WorldDesc { gravity: Vec3::new(0.0, 0.0, -9.81), response, scheme, force_tolerance: 5e-2, ..WorldDesc::default() }
}

/// The links of a world, found by listing them: so those of a world that was restored are found too.
struct Host {
    links: Vec<LinkId>,
}

impl Host {
    fn of(world: &World) -> Host {
        Host { links: world.bodies().flat_map(|body| world.body_links(body).unwrap()).collect() }
    }
}

/// Kicks links of the library, and integrates those of the host, by semi-implicit Euler.
fn tick(world: &mut World, host: &Host, index: usize) {
    for (number, link) in host.links.iter().enumerate() {
        let desc = world.link_desc(*link).unwrap().clone();
        if desc.kind == Kind::Rigid && (index + number).is_multiple_of(7) {
            world.apply_force(*link, &Vec3::new(0.5, 0.25, -1.0), Some(&desc.pose.position)).unwrap();
            world.apply_impulse(*link, &Vec3::new(0.01, 0.0, 0.02), None).unwrap();
        }
    }
    world.step(DT).unwrap();
    for link in &host.links {
        let desc = world.link_desc(*link).unwrap().clone();
        if desc.kind != Kind::Host {
            continue;
        }
        let LinkState { mut pose, mut twist } = world.link_state(*link).unwrap();
        if desc.mass > 0.0 {
            let impulse = world.link_impulse(*link).unwrap();
            twist.linear += impulse.force / desc.mass + world.desc().gravity * DT;
            twist.angular += desc.inertia.try_inverse().unwrap() * impulse.torque;
        }
        pose.position += twist.linear * DT;
        pose.rotation = rotation_from_vector(&(twist.angular * DT)) * pose.rotation;
        world.set_link_state(*link, &LinkState { pose, twist }).unwrap();
    }
}

/// Every bit that a host can read after a step, without the tags of handles.
fn bits(world: &World, host: &Host, out: &mut Vec<u64>) {
    let vector = |out: &mut Vec<u64>, v: &Vec3| out.extend(v.iter().map(|x| x.to_bits()));
    for link in &host.links {
        let Ok(state) = world.link_state(*link) else { continue };
        vector(out, &state.pose.position);
        out.extend(state.pose.rotation.coords.iter().map(|x| x.to_bits()));
        vector(out, &state.twist.linear);
        vector(out, &state.twist.angular);
        for wrench in [world.link_wrench(*link).unwrap(), world.link_impulse(*link).unwrap()] {
            vector(out, &wrench.force);
            vector(out, &wrench.torque);
        }
    }
    for contact in world.contacts() {
        let slots = contact.bodies.map(|body| body.raw).into_iter().chain(contact.links.map(|link| link.raw));
        let slots = slots.chain(contact.skeletons.map(|skeleton| skeleton.raw));
        out.extend(slots.map(|raw| u64::from(raw.index) << 16 | u64::from(raw.generation)));
        for v in [&contact.position, &contact.normal, &contact.force, &contact.torque] {
            vector(out, v);
        }
        let figures = [contact.area, contact.peak_pressure, contact.stiffness, contact.error_estimate];
        out.extend(figures.map(f64::to_bits));
        out.extend([u64::from(contact.evaluations), contact.scheme as u64, u64::from(contact.overloaded)]);
    }
    for event in world.events() {
        out.push(event.kind as u64);
        out.extend(event.bodies.map(|body| u64::from(body.raw.index) << 16 | u64::from(body.raw.generation)));
    }
    let counters = world.counters();
    out.extend([counters.pairs, counters.islands, counters.substeps, counters.patches].map(u64::from));
    out.push(counters.evaluations);
}

fn run(world: &mut World, host: &Host, ticks: std::ops::Range<usize>) -> Vec<u64> {
    let mut out = Vec::new();
    for index in ticks {
        tick(world, host, index);
        bits(world, host, &mut out);
    }
    out
}

fn rough(coat: &Coat) -> BodyDesc {
    BodyDesc {
        friction: 0.3,
        static_friction: 0.5,
        dissipation: 2.0,
        viscous_friction: 0.1,
        user_data: 7,
        ..coat.body_desc()
    }
}

fn rigid(mass: f64, inertia: Mat3, pose: Pose) -> LinkDesc {
    LinkDesc { kind: Kind::Rigid, mass, inertia, pose, ..LinkDesc::default() }
}

/// A floor that slopes: what lies on it hangs on its static friction.
fn floor(world: &mut World) {
    let floor = Coat::floor(0.1).hard();
    let tilt = rotation_from_vector(&Vec3::new(0.0, 0.05, 0.0));
    let pose = Pose { position: Vec3::new(0.0, 0.0, -0.1), rotation: tilt };
    floor.add(world, rough(&floor), LinkDesc { pose, ..LinkDesc::default() });
}

fn bouncing(response: Response) -> World {
    let mut world = World::new(settings(response, Scheme::Auto)).unwrap();
    floor(&mut world);
    let ball = Coat::ball(0.1);
    for i in 0..5 {
        let pose = Pose::at(0.17 * f64::from(i), 0.0, 0.13 + 0.05 * f64::from(i));
        ball.add(&mut world, rough(&ball), rigid(1.0, ball_inertia(1.0, 0.1), pose));
    }
    let point = LinkDesc { kind: Kind::PointMass, mass: 0.5, pose: Pose::at(0.05, 0.1, 0.6), ..LinkDesc::default() };
    ball.add(&mut world, ball.body_desc(), point);
    world
}

/// Rests on bristles, and has every kind of skeleton.
fn pile(scheme: Scheme) -> World {
    let mut world = World::new(settings(Response::Auto, scheme)).unwrap();
    floor(&mut world);
    let half = Vec3::new(0.15, 0.15, 0.1);
    let cuboid = Coat::cuboid(half - Vec3::repeat(0.05), 0.05);
    cuboid.add(&mut world, rough(&cuboid), rigid(1.0, box_inertia(1.0, half), Pose::at(0.0, 0.0, 0.099)));
    let capsule = Coat::new(&[Shape::Segment(Vec3::new(-0.15, 0.0, 0.0), Vec3::new(0.15, 0.0, 0.0))], 0.1);
    let swinging = StiffnessRule::Frequency { hertz: 20.0, damping_ratio: 0.5 };
    capsule.add(
        &mut world,
        BodyDesc { stiffness: swinging, ..rough(&capsule) },
        rigid(1.0, box_inertia(1.0, half), Pose::at(0.0, 0.5, 0.1)),
    );
    let corners = [Vec3::new(-0.2, -0.1, 0.0), Vec3::new(0.2, -0.1, 0.0), Vec3::new(0.0, 0.2, 0.0)];
    let plate = Coat::new(&[Shape::Triangle(corners[0], corners[1], corners[2])], 0.05);
    plate.add(&mut world, rough(&plate), rigid(1.0, box_inertia(1.0, half), Pose::at(0.6, 0.0, 0.06)));
    let ball = Coat::ball(0.1);
    let sinking = BodyDesc { stiffness: StiffnessRule::Sink { fraction: 0.1 }, ..rough(&ball) };
    ball.add(&mut world, sinking, rigid(1.0, ball_inertia(1.0, 0.1), Pose::at(0.0, 0.0, 0.295)));
    world
}

/// Links of a host, of both conventions, one with an effective inertia; a kinematic one; things that are switched off,
/// and slots that were used before.
fn hosted() -> World {
    let mut world = World::new(settings(Response::Substepped, Scheme::Auto)).unwrap();
    floor(&mut world);
    let ball = Coat::ball(0.1);
    let inertia = ball_inertia(1.0, 0.1);
    let host = |pose| LinkDesc { kind: Kind::Host, ..rigid(1.0, inertia, pose) };
    let (gone, _) = ball.add(&mut world, rough(&ball), host(Pose::at(5.0, 0.0, 0.0)));
    ball.add(&mut world, rough(&ball), host(Pose::at(0.0, 0.0, 0.15)));
    let synchronous = LinkDesc {
        velocity_convention: VelocityConvention::Synchronous,
        host_gyroscopic: true,
        user_data: 9,
        ..host(Pose::at(0.5, 0.0, 0.12))
    };
    ball.add(&mut world, rough(&ball), synchronous);
    let mut matrix = nalgebra::Matrix6::identity();
    matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&inertia.try_inverse().unwrap());
    let constrained = LinkDesc {
        constrained: true,
        inverse_effective_inertia: Some(Box::new(matrix)),
        ..host(Pose::at(1.0, 0.0, 0.2))
    };
    ball.add(&mut world, rough(&ball), constrained);
    world.destroy_body(gone).unwrap();
    let mut kinematic = LinkDesc { kind: Kind::Host, pose: Pose::at(0.25, 0.0, 0.3), ..LinkDesc::default() };
    kinematic.twist.linear.z = -0.1;
    ball.add(&mut world, rough(&ball), kinematic);
    let (off, _) = ball.add(&mut world, rough(&ball), rigid(1.0, inertia, Pose::at(0.0, 0.0, 0.2)));
    world.set_body_enabled(off, false).unwrap();
    let (_, link) = ball.add(&mut world, rough(&ball), rigid(1.0, inertia, Pose::at(0.5, 0.1, 0.3)));
    let desc =
        SkeletonDesc { shape: Shape::Point(Vec3::new(0.05, 0.0, 0.0)), seed_count: 99, ..SkeletonDesc::default() };
    let skeleton = world.create_skeleton(link, desc.clone()).unwrap();
    world.set_skeleton_enabled(skeleton, false).unwrap();
    world.create_skeleton(link, desc).unwrap();
    world
}

fn scenes() -> Vec<(&'static str, World)> {
    vec![
        ("bouncing", bouncing(Response::Substepped)),
        ("bouncing, explicit", bouncing(Response::Explicit)),
        ("bouncing, implicit", bouncing(Response::Implicit)),
        ("pile", pile(Scheme::Auto)),
        ("pile of seeds", pile(Scheme::Seeds)),
        ("pile of facets", pile(Scheme::Facets)),
        ("host", hosted()),
    ]
}

#[test]
fn a_restored_world_goes_on_bit_for_bit() {
    let scenes = std::iter::zip(scenes(), scenes());
    for ((name, mut world), (_, mut other)) in scenes {
        let host = Host::of(&world);
        // The other world has a past of its own, with the same slots and generations.
        let others = Host::of(&other);
        run(&mut other, &others, 0..3);
        let mut touched = false;
        for stop in [0, 1, 7, 25] {
            let start = taken(&world);
            run(&mut world, &host, 0..stop);
            // Pushes that wait for the next step are part of the state.
            for link in &host.links {
                let _ = world.apply_force(*link, &Vec3::new(0.0, 1.0, 0.5), None);
                let _ = world.apply_angular_impulse(*link, &Vec3::new(0.0, 0.0, 1e-3));
            }
            let bytes = taken(&world);
            let expected = run(&mut world, &host, stop..stop + 12);
            touched |= !world.contacts().is_empty();

            world.restore(&bytes).unwrap();
            assert!(world.contacts().is_empty() && world.events().is_empty());
            assert!(taken(&world) == bytes, "{name}: a snapshot of the restored world is the same");
            assert!(run(&mut world, &host, stop..stop + 12) == expected, "{name}: the same world after {stop} steps");

            for mut fresh in
                [World::new(WorldDesc::default()).unwrap(), std::mem::replace(&mut other, pile(Scheme::Polar))]
            {
                fresh.restore(&bytes).unwrap();
                let host = Host::of(&fresh);
                let found = run(&mut fresh, &host, stop..stop + 12);
                assert!(found == expected, "{name}: another world after {stop} steps");
            }
            world.restore(&start).unwrap();
        }
        assert!(touched, "{name}: nothing touched");
    }
}

#[test]
fn a_contact_that_lasts_over_a_restore_does_not_begin_again_and_ends() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let ball = Coat::ball(0.1);
    let (_, still) = ball.add_fixed(&mut world, Pose::default());
    let (body, link) =
        ball.add(&mut world, ball.body_desc(), rigid(1.0, ball_inertia(1.0, 0.1), Pose::at(0.0, 0.0, 0.19)));
    world.step(1e-3).unwrap();
    assert_eq!(world.events().len(), 1);
    let bytes = taken(&world);
    world.step(1e-3).unwrap();
    world.restore(&bytes).unwrap();
    world.step(1e-3).unwrap();
    assert!(world.events().is_empty(), "it has begun already");
    world.restore(&bytes).unwrap();
    world.destroy_body(body).unwrap();
    assert!(world.link_state(link).is_err() && world.link_state(still).is_ok());
    world.step(1e-3).unwrap();
    let ended = world.events()[0];
    assert_eq!((ended.kind, ended.bodies[1]), (isocoat::world::EventKind::End, body));

    // The body that ended lives on in the memory of the pair: a snapshot between the two steps keeps the event.
    world.restore(&bytes).unwrap();
    world.destroy_body(body).unwrap();
    let between = taken(&world);
    let mut other = World::new(WorldDesc::default()).unwrap();
    other.restore(&between).unwrap();
    other.step(1e-3).unwrap();
    assert_eq!(other.events().len(), 1);
    assert_eq!(other.events()[0].bodies[1].raw.generation, body.raw.generation);
}

#[test]
fn handles_come_back_and_never_mean_another_object() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let ball = Coat::ball(0.1);
    let (first, _) = ball.add_fixed(&mut world, Pose::default());
    let (second, link) = ball.add_fixed(&mut world, Pose::at(1.0, 0.0, 0.0));
    let bytes = taken(&world);
    world.destroy_body(second).unwrap();
    let undone: Vec<BodyId> = (0..3).map(|_| world.create_body(BodyDesc::default()).unwrap()).collect();
    world.restore(&bytes).unwrap();
    assert!(world.body_desc(first).is_ok() && world.body_desc(second).is_ok() && world.link_desc(link).is_ok());
    assert!(undone.iter().all(|body| world.body_desc(*body).is_err()));
    world.destroy_body(second).unwrap();
    let again: Vec<BodyId> = (0..3).map(|_| world.create_body(BodyDesc::default()).unwrap()).collect();
    assert!(undone.iter().all(|body| world.body_desc(*body).is_err() && !again.contains(body)));
    // The slots, on which the order of all sums depends, are those of the first time.
    assert!(std::iter::zip(&undone, &again).all(|(a, b)| a.raw.index == b.raw.index));

    // To another world the objects are new, and its own old handles void, though slots and generations agree.
    let mut other = World::new(WorldDesc::default()).unwrap();
    let (own, _) = Coat::ball(0.2).add_fixed(&mut other, Pose::default());
    assert_eq!((own.raw.index, own.raw.generation), (first.raw.index, first.raw.generation));
    let before = taken(&other);
    other.restore(&bytes).unwrap();
    assert!([own, first, second].iter().all(|body| other.body_desc(*body).is_err()));
    let bodies: Vec<BodyId> = other.bodies().collect();
    let names = |bodies: &[BodyId]| bodies.iter().map(|id| (id.raw.index, id.raw.generation)).collect::<Vec<_>>();
    assert_eq!(names(&bodies), names(&[first, second]));
    // From here on it is its own world, and its rollbacks keep its handles.
    let later = taken(&other);
    other.step(DT).unwrap();
    other.restore(&later).unwrap();
    assert!(bodies.iter().all(|body| other.body_desc(*body).is_ok()));
    // Its former self is another world by now.
    other.restore(&before).unwrap();
    assert!(other.body_desc(own).is_err() && bodies.iter().all(|body| other.body_desc(*body).is_err()));
    assert_eq!(other.bodies().count(), 1);
}

#[test]
fn callbacks_stay() {
    let mut world = bouncing(Response::Auto);
    let bytes = taken(&world);
    let calls = std::sync::Arc::new(std::sync::atomic::AtomicU32::new(0));
    let counted = calls.clone();
    world.set_pair_filter(Some(Box::new(move |_, _| {
        counted.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        true
    })));
    world.restore(&bytes).unwrap();
    for _ in 0..30 {
        world.step(DT).unwrap();
    }
    assert!(calls.load(std::sync::atomic::Ordering::Relaxed) > 0);
}

/// A small scene with a contact, a bristle and a mirror, its snapshot, and what it does next.
fn small() -> (World, Host, Vec<u8>, Vec<u64>) {
    let mut world = World::new(settings(Response::Auto, Scheme::Auto)).unwrap();
    let ball = Coat::ball(0.1);
    ball.add(&mut world, rough(&ball), LinkDesc::default());
    let desc = LinkDesc { kind: Kind::Host, ..rigid(1.0, ball_inertia(1.0, 0.1), Pose::at(0.02, 0.0, 0.19)) };
    ball.add(&mut world, rough(&ball), desc);
    let host = Host::of(&world);
    run(&mut world, &host, 0..3);
    let bytes = taken(&world);
    let expected = run(&mut world, &host, 3..6);
    world.restore(&bytes).unwrap();
    (world, host, bytes, expected)
}

/// A field more or less, and old snapshots would be misread: the change needs a new number of the format.
#[test]
fn the_format_has_a_new_number_when_it_changes() {
    let (_, _, bytes, _) = small();
    let format = u32::from_le_bytes(bytes[8..12].try_into().unwrap());
    assert_eq!((format, bytes.len()), (8, 2345), "the lists of src/world/snapshot.rs have changed: raise FORMAT there");
}

fn reason(world: &mut World, bytes: &[u8]) -> String {
    match world.restore(bytes) {
        Err(Error::Snapshot(reason)) => reason,
        other => panic!("must be refused as a snapshot: {other:?}"),
    }
}

#[test]
fn every_damaged_byte_and_every_cut_is_refused_and_changes_nothing() {
    let (mut world, host, bytes, expected) = small();
    for at in 0..bytes.len() {
        for flip in [1u8, 0x80, 0xff] {
            let mut damaged = bytes.clone();
            damaged[at] ^= flip;
            let reason = reason(&mut world, &damaged);
            let part = match at {
                0..8 => "begins with",
                8..12 => "format",
                24..32 => "length",
                _ => "checksum",
            };
            assert!(reason.contains(part), "byte {at}: {reason}");
        }
    }
    for length in 0..bytes.len() {
        assert!(reason(&mut world, &bytes[..length]).contains("length"));
    }
    let longer = [&bytes[..], &[0]].concat();
    assert!(reason(&mut world, &longer).contains("length"));
    assert!(taken(&world) == bytes, "the world is as it was");
    assert!(run(&mut world, &host, 3..6) == expected, "the world goes on as if nothing had been tried");
}

/// Makes the header and the checksum right again.
fn sealed(mut bytes: Vec<u8>) -> Vec<u8> {
    let (length, end) = (bytes.len() as u64, bytes.len() - 4);
    bytes[24..32].copy_from_slice(&length.to_le_bytes());
    let checksum = crc32fast::hash(&bytes[..end]);
    bytes[end..].copy_from_slice(&checksum.to_le_bytes());
    bytes
}

/// Where the bytes of a number stand; it must be there only once.
fn offset(bytes: &[u8], number: f64) -> usize {
    let places: Vec<usize> = (0..bytes.len() - 8).filter(|at| bytes[*at..*at + 8] == number.to_le_bytes()).collect();
    assert_eq!(places.len(), 1, "{number} stands at {places:?}");
    places[0]
}

#[test]
fn values_out_of_range_are_refused_though_the_checksum_is_right() {
    let mut world = World::new(WorldDesc { substep_phase: 0.1875, ..WorldDesc::default() }).unwrap();
    let ball = Coat { thickness: 0.125, radius: 0.375, ..Coat::ball(0.125) };
    let body = BodyDesc { friction: 0.21, ..BodyDesc::default() };
    let mut link = rigid(3.5, ball_inertia(3.5, 0.1), Pose::at(0.77, 0.0, 0.0));
    link.twist.angular.x = 0.55;
    link.gravity_scale = 0.875;
    let (body, link) = ball.add(&mut world, body, link);
    world.apply_force(link, &Vec3::new(0.33, 0.0, 0.0), None).unwrap();
    let bytes = taken(&world);
    let mut refused = |number: f64, instead: f64, expected: &str| {
        let mut changed = bytes.clone();
        let at = offset(&bytes, number);
        changed[at..at + 8].copy_from_slice(&instead.to_le_bytes());
        let reason = reason(&mut world, &sealed(changed));
        assert!(reason.contains(expected), "{number} -> {instead}: {reason}");
    };
    refused(0.1875, 2.0, "settings: substep_phase is 2; must be from 0.01 to 1");
    refused(0.21, -1.0, "body 0: friction is -1; must be from 0 to 1e6");
    refused(3.5, -3.0, "link 0: mass of a rigid link is -3; must be > 0");
    refused(0.77, f64::NAN, "link 0: position is (NaN, 0, 0); must be finite");
    refused(0.55, f64::INFINITY, "link 0: angular_velocity is (inf, 0, 0); must be finite");
    refused(0.875, f64::NAN, "link 0: gravity_scale is NaN");
    refused(0.33, f64::NAN, "link 0: applied force is (NaN, 0, 0); must be finite");
    refused(0.125, 0.0, "skeleton 0: thickness is 0; must be > 0");
    refused(0.375, 0.0625, "skeleton 0: radius is 0.0625; must be larger than thickness");
    assert!(taken(&world) == bytes && world.body_desc(body).is_ok());
}

#[test]
fn lists_that_contradict_each_other_are_refused_though_the_checksum_is_right() {
    let (mut world, _, bytes, _) = small();
    let mut reasons = std::collections::BTreeSet::new();
    for at in 40..bytes.len() - 4 {
        for value in [0, 1, 2, 3, 0x7f, 0xff] {
            let mut changed = bytes.clone();
            changed[at] = value;
            match world.restore(&sealed(changed)) {
                // Another state that a world can be in. The origin is another world's, from here on.
                Ok(()) => world.restore(&bytes).unwrap(),
                Err(Error::Snapshot(reason)) => {
                    reasons.insert(reason.chars().filter(|c| !c.is_ascii_digit()).collect::<String>());
                }
                Err(other) => panic!("byte {at}: {other}"),
            }
        }
    }
    for expected in ["lists link", "lists skeleton", "beyond the end", "kind before byte", "not in order", "generation"]
    {
        assert!(reasons.iter().any(|reason| reason.contains(expected)), "no case of \"{expected}\": {reasons:#?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(2000) })]

    #[test]
    fn garbage_is_refused(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        let mut world = World::new(WorldDesc::default()).unwrap();
        prop_assert!(world.restore(&bytes).is_err());
        if bytes.len() >= 44 {
            let mut dressed = b"isocoat\0\x01\0\0\0".to_vec();
            dressed.extend(&bytes[12..]);
            prop_assert!(world.restore(&sealed(dressed)).is_err());
        }
    }
}

/// Well-sealed nonsense: whatever is let in is a world that steps, and whose snapshot is let in again.
#[test]
fn what_is_let_in_is_a_world() {
    let (mut world, _, bytes, _) = small();
    let mut random = common::Random(11);
    let mut let_in = 0;
    for _ in 0..20_000 {
        let mut changed = bytes.clone();
        for _ in 0..1 + (random.unit() * 3.0) as usize {
            let at = 40 + (random.unit() * (bytes.len() - 44) as f64) as usize;
            changed[at] = (random.unit() * 256.0) as u8;
        }
        if world.restore(&sealed(changed)).is_ok() {
            let_in += 1;
            let again = taken(&world);
            world.restore(&again).unwrap();
            assert!(taken(&world) == again);
            if let_in % 200 == 0 {
                let calm = WorldDesc { max_substeps: 4, ..world.desc().clone() };
                world.set_desc(calm).unwrap();
                world.step(DT).unwrap();
            }
        }
    }
    println!("{let_in} of 20000 changed snapshots are worlds");
    assert!(let_in > 100);
}

#[test]
fn size_and_time_of_a_heap() {
    let mut world = World::new(settings(Response::Substepped, Scheme::Auto)).unwrap();
    floor(&mut world);
    let ball = Coat::ball(0.5);
    for index in 0..125 {
        let [i, j, k] = [index % 5, index / 5 % 5, index / 25].map(|i| f64::from(i) * 0.99);
        ball.add(&mut world, rough(&ball), rigid(1.0, ball_inertia(1.0, 0.5), Pose::at(i, j, 0.5 + k)));
    }
    for _ in 0..10 {
        world.step(DT).unwrap();
    }
    let mut bytes = taken(&world);
    let room = (bytes.capacity(), bytes.as_ptr());
    let best = |mut act: Box<dyn FnMut() + '_>| {
        let time = (0..200).map(|_| {
            let start = Instant::now();
            act();
            start.elapsed()
        });
        time.min().unwrap()
    };
    let size = best(Box::new(|| assert!(world.snapshot_size() > 0)));
    let take = best(Box::new(|| world.snapshot(&mut bytes)));
    assert_eq!(room, (bytes.capacity(), bytes.as_ptr()), "the room is used again");
    let back = best(Box::new(|| world.restore(&bytes).unwrap()));
    let step = best(Box::new(|| {
        world.restore(&bytes).unwrap();
        world.step(DT).unwrap();
    })) - back;
    println!(
        "125 balls, {} pairs: {} bytes; size {size:?}, snapshot {take:?}, restore {back:?}; a step {step:?}",
        world.counters().pairs,
        bytes.len()
    );
}
