//! Contacts pressed far into one another, and contacts on the kinks of a blend: what overlaps is pushed apart.

mod common;

use common::{Coat, Random, box_inertia, collide, total};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Quat, Twist, Vec3};
use isocoat::world::{BodyDesc, EventKind, LinkDesc, LinkId, LinkState, Response, Scheme, World, WorldDesc};

const THICKNESS: f64 = 0.05;

fn shapes() -> [Shape; 4] {
    [
        Shape::Point(Vec3::zeros()),
        Shape::Segment(Vec3::new(-0.1, 0.0, 0.0), Vec3::new(0.1, 0.003, 0.0)),
        Shape::Triangle(Vec3::new(-0.1, -0.1, 0.0), Vec3::new(0.1, -0.1, 0.0), Vec3::new(0.0, 0.1, 0.0)),
        Shape::Box { center: Vec3::zeros(), half: Vec3::repeat(0.1), axes: Mat3::identity() },
    ]
}

/// Whether one's middle, or one of many points about it, lies within both coats.
fn surely_overlap(a: &Shape, b: &Shape) -> bool {
    (0..=20).any(|i| {
        let p = a.middle() + (b.middle() - a.middle()) * (f64::from(i) / 20.0);
        a.closest(&p).distance < 0.98 * THICKNESS && b.closest(&p).distance < 0.98 * THICKNESS
    })
}

#[test]
fn what_overlaps_has_a_force_or_an_overload() {
    let mut random = Random(23);
    let mut failures = Vec::new();
    let mut count = 0;
    for shape_a in shapes() {
        for shape_b in shapes() {
            for turn in 0..6 {
                let rotation = if turn == 0 { isocoat::math::Quat::identity() } else { random.rotation() };
                for step in 0..=32 {
                    let position = Vec3::new(0.013, 0.017, 0.01 * f64::from(step));
                    let pose = Pose { position, rotation };
                    if !surely_overlap(&shape_a, &shape_b.transformed(&pose)) {
                        continue;
                    }
                    let mut world =
                        World::new(WorldDesc { response: Response::Explicit, ..WorldDesc::default() }).unwrap();
                    let coats = [shape_a, shape_b].map(|shape| Coat::new(&[shape], THICKNESS));
                    let link = LinkDesc { kind: Kind::Host, ..LinkDesc::default() };
                    coats[0].add(&mut world, coats[0].body_desc(), link.clone());
                    let (_, link) = coats[1].add(&mut world, coats[1].body_desc(), LinkDesc { pose, ..link });
                    world.step(1e-9).unwrap();
                    count += 1;
                    let pressed = world.link_wrench(link).unwrap().force.norm() > 0.0;
                    let overload = world.events().iter().any(|event| event.kind == EventKind::Overload);
                    if !pressed && !overload {
                        failures.push(format!("{shape_a:?} {shape_b:?} {pose:?}"));
                    }
                }
            }
        }
    }
    println!("{count} overlaps, {} without force or overload", failures.len());
    assert!(failures.is_empty(), "{:#?}", &failures[..failures.len().min(10)]);
}

#[test]
fn boxes_that_meet_past_their_cores_neither_pass_each_other_nor_gain_energy() {
    let (mass, tilt) = (8.0, isocoat::math::rotation_from_vector(&Vec3::new(0.43, 0.65, 0.22)));
    for rotation in [isocoat::math::Quat::identity(), tilt] {
        for (mass, speed) in
            [(mass, 4.0), (mass, 12.0), (mass, 16.0), (mass, 20.0), (80.0, 8.0), (80.0, 12.0), (80.0, 16.0)]
        {
            let mut world = World::new(WorldDesc::default()).unwrap();
            let coat = Coat::cuboid(Vec3::repeat(0.1), THICKNESS);
            coat.add_fixed(&mut world, Pose::default());
            let desc = LinkDesc {
                kind: Kind::Rigid,
                mass,
                inertia: box_inertia(mass, Vec3::repeat(0.1)),
                pose: Pose { position: Vec3::new(0.013, 0.0, 0.4), rotation },
                twist: Twist { linear: Vec3::new(0.0, 0.0, -speed), angular: Vec3::zeros() },
                ..LinkDesc::default()
            };
            let (_, link) = coat.add(&mut world, coat.body_desc(), desc);
            let (mut most, mut overloads) = (0.0f64, 0);
            for _ in 0..60 {
                world.step(1.0 / 240.0).unwrap();
                let state = world.link_state(link).unwrap();
                most = most.max(0.5 * mass * state.twist.linear.norm_squared());
                overloads += world.events().iter().filter(|event| event.kind == EventKind::Overload).count();
            }
            let state = world.link_state(link).unwrap();
            let before = 0.5 * mass * speed * speed;
            println!("{mass} kg at {speed} m/s: {before:.0} J, at most {most:.0} J, {overloads} overloads, {state:?}");
            assert!(state.pose.position.z > 0.2, "passed through");
            assert!(most <= 1.01 * before, "gained energy");
        }
    }
}

#[test]
fn boxes_one_in_another_come_apart_whatever_rubs_between_them() {
    // A thin coat and a thick one, of the same outer size, from where neither knows the way out, and from aside.
    for (half, thickness) in [(0.17, 0.03), (0.1, 0.1)] {
        for (friction, static_friction, dissipation) in [(0.6, 0.0, 1.0), (0.6, 0.0, 0.0), (2.0, 3.0, 100.0)] {
            for aside in [0.0, 1e-9, 1e-3, 0.05] {
                for response in [Response::Auto, Response::Substepped, Response::Implicit] {
                    let mut world =
                        World::new(WorldDesc { response, gravity: Vec3::zeros(), ..WorldDesc::default() }).unwrap();
                    let coat = Coat::cuboid(Vec3::repeat(half), thickness);
                    let material = BodyDesc { friction, static_friction, dissipation, ..coat.body_desc() };
                    let links = [0.0, aside].map(|x| {
                        let inertia = box_inertia(2.0, Vec3::repeat(0.2));
                        let pose = Pose::at(x, 0.0, 0.0);
                        let desc = LinkDesc { kind: Kind::Rigid, mass: 2.0, inertia, pose, ..LinkDesc::default() };
                        coat.add(&mut world, material.clone(), desc).1
                    });
                    // The push-out takes them past each other's middle at two thicknesses a second.
                    let steps = (60.0 * (0.4 / (2.0 * thickness))) as usize;
                    for _ in 0..steps {
                        world.step(1.0 / 60.0).unwrap();
                    }
                    let [a, b] = links.map(|link| world.link_state(link).unwrap().pose.position);
                    let distance = (b - a).norm();
                    let what = format!("{thickness} {friction} {dissipation} {aside:e} {response:?}: {distance:.3} m");
                    assert!(distance > 0.3, "{what}");
                }
            }
        }
    }
}

#[test]
fn a_load_past_what_it_carries_is_held_up_by_a_soft_plane_and_says_so() {
    for rotation in [Quat::identity(), isocoat::math::rotation_from_vector(&Vec3::new(0.43, 0.65, 0.22))] {
        let gravity = Vec3::z() * -9.81;
        let mut world =
            World::new(WorldDesc { gravity, response: Response::Implicit, ..WorldDesc::default() }).unwrap();
        Coat::floor(0.1).add_fixed(&mut world, Pose::default());
        let (half, thickness, mass) = (0.1, 0.03, 1e4);
        let coat = Coat::cuboid(Vec3::repeat(half), thickness);
        let desc = LinkDesc {
            kind: Kind::Rigid,
            mass,
            inertia: box_inertia(mass, Vec3::repeat(half + thickness)),
            pose: Pose { position: Vec3::new(0.0, 0.0, 0.35), rotation },
            ..LinkDesc::default()
        };
        let (_, link) = coat.add(&mut world, coat.body_desc(), desc);
        let (mut touching, mut lowest, mut overloaded) = (false, f64::INFINITY, 0);
        for _ in 0..600 {
            world.step(1.0 / 60.0).unwrap();
            for event in world.events() {
                match event.kind {
                    EventKind::Begin => touching = true,
                    EventKind::End => touching = false,
                    EventKind::Overload => {}
                }
            }
            assert_eq!(touching, !world.contacts().is_empty(), "a contact is listed as long as bodies touch");
            overloaded += usize::from(world.contacts().iter().any(|contact| contact.overloaded));
            let force: Vec3 = world.contacts().iter().map(|contact| contact.force).sum();
            let wrench = world.link_wrench(link).unwrap().force;
            // The last part of a split step says the force then, not the mean.
            if world.counters().implicit_splits == 0 && world.contacts().iter().any(|contact| contact.overloaded) {
                assert!((wrench - force).norm() <= 1e-6 * (1.0 + force.norm()), "{wrench:?} {force:?}");
            }
            lowest = lowest.min(world.link_state(link).unwrap().pose.position.z);
        }
        println!("lowest {lowest:.3} m, overloaded in {overloaded} of 600 steps");
        assert!(overloaded > 100);
        // Wholly below the plane's surface, and by what it falls in a step.
        assert!(lowest > 0.1 - 3f64.sqrt() * (half + thickness) - 0.06, "it sank to {lowest}");
    }
}

/// A body of two skeletons that blend.
fn blended(random: &mut Random) -> Coat {
    let mut one = |offset: f64| {
        let at = |x: f64, y: f64| Vec3::new(x + offset, y, 0.0);
        match (4.0 * random.unit()) as usize {
            0 => Shape::Point(at(0.0, 0.0)),
            1 => Shape::Segment(at(-0.1, 0.0), at(0.1, 0.0)),
            2 => Shape::Triangle(at(-0.1, 0.0), at(0.1, 0.0), at(0.0, 0.1)),
            _ => Shape::Box { center: at(0.0, 0.0), half: Vec3::repeat(0.06), axes: Mat3::identity() },
        }
    };
    let shapes = [one(0.0), one(0.12)];
    Coat::new(&shapes, 0.1)
}

#[test]
fn coming_closer_a_contact_between_blends_does_not_flicker() {
    let mut random = Random(31);
    let mut failures = Vec::new();
    for case in 0..60 {
        let (a, b) = (blended(&mut random), blended(&mut random));
        let (turn_a, turn_b) = (random.rotation(), random.rotation());
        let shift = Vec3::new(random.range(-0.1, 0.1), random.range(-0.1, 0.1), 0.0);
        let place = |height: f64| {
            let pose_b = Pose { position: shift + Vec3::z() * height, rotation: turn_b };
            total(&collide((&a, Pose { rotation: turn_a, ..Pose::default() }), (&b, pose_b), Scheme::Auto, 5e-2))
        };
        // From the first touch down by less than one coat: no core is reached.
        let touch = (0..100).map(|i| 0.6 - 0.005 * f64::from(i)).find(|height| place(*height).norm() > 0.0).unwrap();
        for step in 0..36 {
            let height = touch - 0.0025 * f64::from(step);
            if place(height).norm() == 0.0 {
                failures.push(format!("case {case}: no force {:.4} below the first touch", touch - height));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

fn energy(world: &World, links: &[(LinkId, f64)]) -> f64 {
    let of = |(link, mass): &(LinkId, f64)| {
        let LinkState { twist, .. } = world.link_state(*link).unwrap();
        // Inertia of a hundredth of the mass, about every axis.
        0.5 * mass * (twist.linear.norm_squared() + 0.01 * twist.angular.norm_squared())
    };
    links.iter().map(of).sum()
}

#[test]
fn elastic_impacts_of_blends_keep_their_energy() {
    let mut worst = 0.0f64;
    let mut failures = Vec::new();
    for case in 0..150 {
        let mut random = Random(case);
        let mut world = World::new(WorldDesc::default()).unwrap();
        let speed = random.range(0.8, 1.6);
        let links: Vec<(LinkId, f64)> = [1.0, -1.0]
            .into_iter()
            .map(|side| {
                let (coat, mass) = (blended(&mut random), random.range(1.0, 4.0));
                let desc = LinkDesc {
                    kind: Kind::Rigid,
                    mass,
                    inertia: Mat3::identity() * (0.01 * mass),
                    pose: Pose {
                        position: Vec3::new(random.range(-0.1, 0.1), 0.0, -0.3 * side),
                        rotation: random.rotation(),
                    },
                    twist: Twist {
                        linear: Vec3::new(0.0, 0.0, speed * side),
                        angular: Vec3::from_fn(|_, _| random.range(-2.0, 2.0)),
                    },
                    ..LinkDesc::default()
                };
                (coat.add(&mut world, coat.body_desc(), desc).1, mass)
            })
            .collect();
        let before = energy(&world, &links);
        let mut overloaded = false;
        for _ in 0..60 {
            world.step(1.0 / 60.0).unwrap();
            overloaded |= world.events().iter().any(|event| event.kind == EventKind::Overload);
        }
        if overloaded || !world.contacts().is_empty() {
            // The push-out is inelastic; a contact holds back energy.
            continue;
        }
        let change = energy(&world, &links) / before - 1.0;
        worst = worst.max(change.abs());
        if change.abs() > 0.02 {
            failures.push(format!("case {case}: {:.2} %", 100.0 * change));
        }
    }
    println!("elastic impacts of blends: energy off by {:.2} % at most", 100.0 * worst);
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn seeds_of_a_triangle_at_the_face_of_a_box_push_no_more_than_pressure_times_area() {
    let [_, _, triangle, cuboid] = shapes().map(|shape| Coat::new(&[shape], THICKNESS));
    // The highest pressure of either coat at its skeleton, on twice the area of both.
    let most = 1e5 * 2.0 * (0.02 + 0.02) * 10.0;
    for gap in [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2] {
        let pose = Pose::at(0.0, 0.0, 0.1 + gap);
        let contacts = collide((&triangle, Pose::default()), (&cuboid, pose), Scheme::Seeds, 5e-3);
        let force = total(&contacts);
        let estimate = contacts.iter().map(|contact| contact.error_estimate).fold(0.0, f64::max);
        println!("gap {gap:.0e}: {:.0} N, estimate {estimate:.2}", force.z);
        assert!(force.norm() <= most, "gap {gap:.0e}: {force:?}");
        // Near the face the two gradients cancel to round-off, and the overload alone may act.
        assert!(force.z >= 0.0, "gap {gap:.0e}: pulls with {force:?}");
        assert!(force.z > 0.0 || gap <= 1e-6, "gap {gap:.0e}: no force");
        if gap <= 1e-6 {
            assert!(contacts.is_empty() || estimate == 1.0, "gap {gap:.0e}: says {estimate}");
        }
    }
}

#[test]
fn a_ball_pressed_onto_a_hard_capsule_past_its_middle_still_feels_it() {
    let ball = Coat::ball(0.1);
    let capsule = Coat::new(&[Shape::Segment(Vec3::new(-0.2, 0.0, 0.0), Vec3::new(0.2, 0.0, 0.0))], 0.1).hard();
    for height in [0.095, 0.08, 0.06] {
        let force = |scheme, tolerance| {
            let pose = Pose::at(0.013, 0.0, height);
            let contacts = collide((&capsule, Pose::default()), (&ball, pose), scheme, tolerance);
            let estimate = contacts.iter().map(|contact| contact.error_estimate).fold(0.0, f64::max);
            println!("{scheme:?} {tolerance:.0e} at {height}: {:?}, estimate {estimate:.2}", total(&contacts).z);
            (total(&contacts).z, estimate)
        };
        let (polar, _) = force(Scheme::Polar, 5e-3);
        assert!(polar > 0.0);
        for (scheme, tolerance) in [(Scheme::Auto, 5e-3), (Scheme::Auto, 1e-6), (Scheme::Adaptive, 5e-3)] {
            let (pressed, estimate) = force(scheme, tolerance);
            assert!(pressed > 0.0, "{scheme:?} {tolerance:.0e} at {height}: no force");
            assert!((pressed - polar).abs() <= estimate * polar.max(pressed) + 0.02 * polar);
        }
    }
}

#[test]
fn blends_pressed_deep_into_each_other_agree_with_brute_force() {
    let points = [Shape::Point(Vec3::x() * -0.12), Shape::Point(Vec3::x() * 0.12)];
    let (a, b) = (Coat::new(&points, 0.1), Coat::new(&points, 0.1).stiff(3e5));
    let turn = |x, y, z, w| Quat::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
    // Where the surface leans over, and where two deepest points lie in one patch.
    for (position, rotation) in [
        (Vec3::new(0.0526, -0.0170, -0.1360), turn(0.4147, -0.8775, 0.1943, 0.1419)),
        (Vec3::new(0.0502, -0.1263, 0.0076), turn(0.0057, -0.5929, 0.0360, 0.8044)),
    ] {
        let (a, b) = ((&a, Pose::default()), (&b, Pose { position, rotation }));
        let exact = common::oracle::Oracle::new(a, b).force(80);
        let contacts = collide(a, b, Scheme::Auto, 5e-3);
        let error = (total(&contacts) - exact).norm() / exact.norm();
        println!("{:.1} N, off by {error:.1e}, by {:?}", exact.norm(), contacts[0].scheme);
        assert!(error < 5e-3);
    }
}
