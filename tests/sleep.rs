//! Bodies at rest fall asleep, cost nothing, and wake exactly: when something comes into reach, or when the host changes
//! them or what they lean on.

mod common;

use std::time::Instant;

use common::{Coat, DT, G, ball_inertia, box_inertia};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Pose, Twist, Vec3};
use isocoat::world::{BodyDesc, BodyId, Contact, EventKind, LinkDesc, LinkId, LinkState, Response, World, WorldDesc};

const RADIUS: f64 = 0.1;

fn world(response: Response) -> World {
    let gravity = Vec3::new(0.0, 0.0, -G);
    World::new(WorldDesc { gravity, response, sleep_time: 0.5, ..WorldDesc::default() }).unwrap()
}

fn add_floor(world: &mut World) -> (BodyId, LinkId) {
    let floor = Coat::floor(0.1).hard();
    let pose = Pose::at(0.0, 0.0, -0.1);
    floor.add(world, BodyDesc { friction: 0.5, ..floor.body_desc() }, LinkDesc { pose, ..LinkDesc::default() })
}

fn add_ball(world: &mut World, friction: f64, at: Vec3) -> (BodyId, LinkId) {
    let link = LinkDesc {
        kind: Kind::Rigid,
        mass: 1.0,
        inertia: ball_inertia(1.0, RADIUS),
        pose: Pose::at(at.x, at.y, at.z),
        ..LinkDesc::default()
    };
    let coat = Coat::ball(RADIUS);
    coat.add(world, BodyDesc { friction, dissipation: 1.0, ..coat.body_desc() }, link)
}

/// Steps until all that can sleep do. Gives the number of steps.
fn fall_asleep(world: &mut World, sleepers: u32, most: usize) -> usize {
    for step in 0..most {
        if world.counters().asleep == sleepers {
            return step;
        }
        world.step(DT).unwrap();
    }
    panic!("{} of {sleepers} are asleep after {most} steps", world.counters().asleep);
}

/// A world with one ball asleep on a floor.
fn one_asleep() -> (World, (BodyId, LinkId), (BodyId, LinkId)) {
    let mut world = world(Response::Implicit);
    let floor = add_floor(&mut world);
    let ball = add_ball(&mut world, 0.5, Vec3::new(0.0, 0.0, RADIUS - 0.001));
    fall_asleep(&mut world, 1, 300);
    (world, floor, ball)
}

/// Nobody is awake but the floor then, and still the world says that they parted.
#[test]
fn the_contact_of_a_sleeper_that_is_destroyed_ends() {
    let (mut world, floor, ball) = one_asleep();
    world.destroy_body(ball.0).unwrap();
    world.step(DT).unwrap();
    let ends: Vec<_> = world.events().iter().filter(|event| event.kind == EventKind::End).collect();
    assert_eq!(ends.len(), 1);
    assert_eq!(ends[0].bodies, [floor.0, ball.0]);
    assert!(world.contacts().is_empty());
}

/// Balls in rows on a floor between walls, touching each other, and more of them on top.
fn pile(world: &mut World, side: usize) -> Vec<LinkId> {
    add_floor(world);
    let far = 0.199 * (side - 1) as f64 + RADIUS;
    for (point, normal) in [
        (Vec3::new(-RADIUS - 0.1, 0.0, 0.0), Vec3::x()),
        (Vec3::new(far + 0.1, 0.0, 0.0), -Vec3::x()),
        (Vec3::new(0.0, -RADIUS - 0.1, 0.0), Vec3::y()),
        (Vec3::new(0.0, far + 0.1, 0.0), -Vec3::y()),
    ] {
        let wall = Coat::new(&[Shape::Plane { point, normal }], 0.1).hard();
        wall.add(world, BodyDesc { friction: 0.5, ..wall.body_desc() }, LinkDesc::default());
    }
    let mut balls = Vec::new();
    for index in 0..side * side {
        let (x, y) = ((index % side) as f64 * 0.199, (index / side) as f64 * 0.199);
        balls.push(add_ball(world, 0.5, Vec3::new(x, y, RADIUS - 0.001)).1);
    }
    for index in 0..(side - 1) * (side - 1) {
        let (x, y) = ((index % (side - 1)) as f64 * 0.199 + 0.0995, (index / (side - 1)) as f64 * 0.199 + 0.0995);
        balls.push(add_ball(world, 0.5, Vec3::new(x, y, RADIUS + 0.14)).1);
    }
    balls
}

#[test]
fn a_pile_falls_asleep_and_then_costs_less_than_a_hundredth() {
    let mut world = world(Response::Auto);
    let balls = pile(&mut world, 8);
    let mut awake = Vec::new();
    while world.counters().asleep < balls.len() as u32 {
        let start = Instant::now();
        world.step(DT).unwrap();
        awake.push(start.elapsed().as_secs_f64());
        assert!(awake.len() < 600, "{} are asleep", world.counters().asleep);
    }
    let (contacts, wrenches) = (world.contacts().to_vec(), balls.iter().map(|ball| world.link_wrench(*ball).unwrap()));
    let wrenches: Vec<_> = wrenches.collect();
    assert!(contacts.len() >= balls.len());
    let mut asleep = Vec::new();
    for _ in 0..100 {
        let start = Instant::now();
        world.step(DT).unwrap();
        asleep.push(start.elapsed().as_secs_f64());
        let counters = world.counters();
        assert_eq!((counters.pairs, counters.islands, counters.evaluations), (0, 0, 0));
        assert_eq!(counters.by_scheme.patches, [0; 6]);
        assert!(world.events().is_empty());
    }
    // What was reported of them still is.
    assert_eq!(world.contacts(), contacts);
    let lifted: f64 = wrenches.iter().map(|wrench| wrench.force.z).sum();
    assert!((lifted / (G * balls.len() as f64) - 1.0).abs() < 1e-3, "{lifted}");
    for (ball, wrench) in balls.iter().zip(&wrenches) {
        assert_eq!(world.link_wrench(*ball).unwrap(), *wrench);
        assert_eq!(world.link_state(*ball).unwrap().twist, Twist::default());
    }
    let last = awake.len() - 20;
    let [awake, asleep] = [&mut awake[last..], &mut asleep[..]].map(|times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    });
    println!(
        "{} balls: {:.3} ms awake, {:.4} ms asleep: {:.2} %",
        balls.len(),
        1e3 * awake,
        1e3 * asleep,
        100.0 * asleep / awake
    );
    assert!(asleep < 0.01 * awake);
}

/// With and without sleep, a ball that rolls in meets the resting one in the same step, and no momentum is lost.
#[test]
fn a_touch_wakes_in_the_step_in_which_it_begins_and_loses_no_momentum() {
    for speed in [0.3, 2.0] {
        let mut worlds = [0.5, 0.0].map(|sleep_time| {
            let mut world = world(Response::Substepped);
            world.set_desc(WorldDesc { sleep_time, ..world.desc().clone() }).unwrap();
            add_floor(&mut world);
            let rest = add_ball(&mut world, 0.0, Vec3::new(0.0, 0.0, RADIUS - 0.0056)).1;
            for _ in 0..200 {
                world.step(DT).unwrap();
            }
            let mover = add_ball(&mut world, 0.0, Vec3::new(-1.0, 0.0, RADIUS - 0.0056)).1;
            let mut state = world.link_state(mover).unwrap();
            state.pose.position.z = world.link_state(rest).unwrap().pose.position.z;
            state.twist.linear.x = speed;
            world.set_link_state(mover, &state).unwrap();
            (world, rest, mover)
        });
        let [asleep, awake] = &worlds;
        assert_eq!([asleep.0.counters().asleep, awake.0.counters().asleep], [1, 0]);
        let mut touched = [None; 2];
        for step in 0..(1.5 / speed / DT) as usize {
            let before = worlds[0].0.counters().asleep;
            let reach = worlds[0].0.link_state(worlds[0].2).unwrap().pose.position.x + speed * DT + 2.0 * RADIUS;
            for ((world, rest, _), touched) in worlds.iter_mut().zip(&mut touched) {
                world.step(DT).unwrap();
                let rest = world.link_body(*rest).unwrap();
                let aside = |contact: &Contact| contact.bodies.contains(&rest) && contact.normal.x.abs() > 0.9;
                if touched.is_none() && world.contacts().iter().any(aside) {
                    *touched = Some(step);
                }
            }
            if before == 1 && worlds[0].0.counters().asleep == 0 {
                // It wakes when the bounds over the step meet (they are grown a little by gravity), not before.
                assert!((-0.01..speed * DT + 0.01).contains(&reach), "{reach}");
                assert!(touched[0].is_none_or(|touched| touched == step));
            }
        }
        println!("{speed} m/s: touch in step {touched:?}");
        assert!(touched[0].is_some() && touched[0] == touched[1]);
        let speeds = worlds
            .each_ref()
            .map(|(world, rest, mover)| [rest, mover].map(|link| world.link_state(*link).unwrap().twist.linear.x));
        for [rest, mover] in speeds {
            assert!((rest + mover - speed).abs() < 1e-9 * speed, "{rest} + {mover} of {speed}");
            assert!(rest > 0.5 * speed);
        }
        assert!((speeds[0][0] - speeds[1][0]).abs() < 1e-3 * speed, "{speeds:?}");
    }
}

type Change = (&'static str, fn(&mut World, (BodyId, LinkId), (BodyId, LinkId)));

#[test]
fn whatever_the_host_changes_wakes() {
    let changes: &[Change] = &[
        ("force", |world, _, ball| world.apply_force(ball.1, &Vec3::x(), None).unwrap()),
        ("torque", |world, _, ball| world.apply_torque(ball.1, &Vec3::x()).unwrap()),
        ("impulse", |world, _, ball| world.apply_impulse(ball.1, &Vec3::x(), None).unwrap()),
        ("angular impulse", |world, _, ball| world.apply_angular_impulse(ball.1, &Vec3::x()).unwrap()),
        ("acceleration", |world, _, ball| {
            world.set_external_acceleration(ball.1, &Vec3::x(), &Vec3::zeros()).unwrap();
        }),
        ("state", |world, _, ball| {
            let mut state = world.link_state(ball.1).unwrap();
            state.twist.linear.x = 1e-12;
            world.set_link_state(ball.1, &state).unwrap();
        }),
        ("teleport", |world, _, ball| {
            let state = world.link_state(ball.1).unwrap();
            world.teleport_link(ball.1, &state).unwrap();
        }),
        ("link", |world, _, ball| {
            let desc = LinkDesc { mass: 2.0, ..world.link_desc(ball.1).unwrap().clone() };
            world.set_link_desc(ball.1, desc).unwrap();
        }),
        ("body", |world, _, ball| {
            let desc = world.body_desc(ball.0).unwrap().clone();
            world.set_body_desc(ball.0, desc).unwrap();
        }),
        ("skeleton", |world, _, ball| {
            let skeleton = world.link_skeletons(ball.1).unwrap().next().unwrap();
            world.set_skeleton_enabled(skeleton, true).unwrap();
        }),
        ("gravity", |world, _, _| {
            let desc = WorldDesc { gravity: Vec3::zeros(), ..world.desc().clone() };
            world.set_desc(desc).unwrap();
        }),
        ("filter", |world, _, _| world.set_pair_filter(None)),
        ("its own", |world, _, ball| world.wake_body(ball.0).unwrap()),
        ("support's own", |world, floor, _| world.wake_body(floor.0).unwrap()),
        ("support's pose", |world, floor, _| {
            let state = LinkState { pose: Pose::at(0.0, 0.0, -10.0), twist: Twist::default() };
            world.set_link_state(floor.1, &state).unwrap();
        }),
        ("support's material", |world, floor, _| {
            let desc = BodyDesc { friction: 0.1, ..world.body_desc(floor.0).unwrap().clone() };
            world.set_body_desc(floor.0, desc).unwrap();
        }),
        ("support's absence", |world, floor, _| world.set_body_enabled(floor.0, false).unwrap()),
        ("support's end", |world, floor, _| world.destroy_body(floor.0).unwrap()),
    ];
    for (name, change) in changes {
        let (mut world, floor, ball) = one_asleep();
        assert!(!world.body_is_awake(ball.0).unwrap() && world.body_is_awake(floor.0).unwrap());
        change(&mut world, floor, ball);
        assert!(world.body_is_awake(ball.0).unwrap(), "{name}");
        world.step(DT).unwrap();
        assert_eq!(world.counters().asleep, 0, "{name}");
    }
    // What changes nothing does not.
    let (mut world, floor, ball) = one_asleep();
    for link in [floor.1, ball.1] {
        let state = world.link_state(link).unwrap();
        world.set_link_state(link, &state).unwrap();
    }
    world.apply_force(ball.1, &Vec3::zeros(), None).unwrap();
    world.set_desc(world.desc().clone()).unwrap();
    assert!(!world.body_is_awake(ball.0).unwrap());
}

#[test]
fn what_the_host_puts_beside_them_wakes_them_and_what_stood_there_does_not() {
    let (mut world, _, ball) = one_asleep();
    let post = Coat::ball(RADIUS);
    let (_, post) = post.add_fixed(&mut world, Pose::at(1.0, 0.0, RADIUS));
    for _ in 0..3 {
        world.step(DT).unwrap();
        assert_eq!(world.counters().asleep, 1);
    }
    let state = LinkState { pose: Pose::at(0.19, 0.0, RADIUS), twist: Twist::default() };
    world.set_link_state(post, &state).unwrap();
    world.step(DT).unwrap();
    assert!(world.body_is_awake(ball.0).unwrap());
    assert!(world.contacts().iter().any(|contact| contact.normal.x.abs() > 0.9));
}

#[test]
fn without_their_support_they_fall_freely_at_once() {
    let (mut world, floor, ball) = one_asleep();
    let start = world.link_state(ball.1).unwrap().pose.position.z;
    world.destroy_body(floor.0).unwrap();
    world.step(DT).unwrap();
    let state = world.link_state(ball.1).unwrap();
    assert!((state.twist.linear.z / (-G * DT) - 1.0).abs() < 1e-12);
    assert!(state.pose.position.z < start && world.contacts().is_empty());
    assert_eq!(world.events().len(), 1, "the contact has ended");
}

#[test]
fn one_that_may_not_sleep_keeps_its_neighbours_awake_and_nobody_sleeps_unasked() {
    for (sleep_time, may_sleep, expected) in [(0.5, true, 2), (0.5, false, 0), (0.0, true, 0)] {
        let mut world = world(Response::Implicit);
        world.set_desc(WorldDesc { sleep_time, ..world.desc().clone() }).unwrap();
        add_floor(&mut world);
        let (body, _) = add_ball(&mut world, 0.5, Vec3::new(0.0, 0.0, RADIUS - 0.001));
        // Close enough to count as neighbours, and not touching.
        add_ball(&mut world, 0.5, Vec3::new(0.201, 0.0, RADIUS - 0.001));
        let desc = BodyDesc { may_sleep, ..world.body_desc(body).unwrap().clone() };
        world.set_body_desc(body, desc).unwrap();
        for _ in 0..240 {
            world.step(DT).unwrap();
        }
        assert_eq!(world.counters().asleep, expected, "{sleep_time} s, may sleep: {may_sleep}");
    }
}

#[test]
fn on_what_the_host_moves_nobody_sleeps_until_it_stops() {
    let mut world = world(Response::Implicit);
    let half = Vec3::new(2.0, 2.0, 0.1);
    let twist = Twist { linear: Vec3::new(0.1, 0.0, 0.0), angular: Vec3::zeros() };
    let platform = Coat::cuboid(half - Vec3::repeat(0.05), 0.05).hard();
    let link = LinkDesc { kind: Kind::Host, twist, ..LinkDesc::default() };
    let (_, platform) = platform.add(&mut world, platform.body_desc(), link);
    let (ball, _) = add_ball(&mut world, 0.0, Vec3::new(0.0, 0.0, 0.1 + RADIUS - 0.001));
    for _ in 0..240 {
        world.step(DT).unwrap();
    }
    assert!(world.body_is_awake(ball).unwrap());
    world.set_link_state(platform, &LinkState::default()).unwrap();
    fall_asleep(&mut world, 1, 240);
    world.set_link_state(platform, &LinkState { twist, ..LinkState::default() }).unwrap();
    assert!(world.body_is_awake(ball).unwrap());
}

#[test]
fn a_snapshot_keeps_sleep_to_the_bit() {
    let mut first = world(Response::Auto);
    let mut links = pile(&mut first, 3);
    fall_asleep(&mut first, links.len() as u32, 600);
    let mut bytes = Vec::new();
    first.snapshot(&mut bytes);
    let mut second = World::new(WorldDesc::default()).unwrap();
    second.restore(&bytes).unwrap();
    assert_eq!(second.counters().asleep, links.len() as u32);
    // A ball falls on them.
    let coat = Coat::ball(RADIUS);
    let link = |height: f64| LinkDesc {
        kind: Kind::Rigid,
        mass: 1.0,
        inertia: ball_inertia(1.0, RADIUS),
        pose: Pose::at(0.21, 0.17, height),
        ..LinkDesc::default()
    };
    links.push(coat.add(&mut first, coat.body_desc(), link(1.0)).1);
    coat.add(&mut second, coat.body_desc(), link(1.0));
    let states = |world: &World| {
        let links = world.bodies().flat_map(|body| world.body_links(body).unwrap().collect::<Vec<_>>());
        links.map(|link| world.link_state(link).unwrap()).collect::<Vec<_>>()
    };
    let forces =
        |world: &World| world.contacts().iter().map(|contact| (contact.position, contact.force)).collect::<Vec<_>>();
    let mut woken = false;
    for _ in 0..120 {
        first.step(DT).unwrap();
        second.step(DT).unwrap();
        assert_eq!(states(&first), states(&second));
        assert_eq!(forces(&first), forces(&second));
        assert_eq!(first.counters(), second.counters());
        woken |= first.counters().asleep == 0;
    }
    assert!(woken);
    // One taken between a change and the step that follows.
    fall_asleep(&mut first, links.len() as u32, 900);
    let body = first.link_body(links[0]).unwrap();
    first.wake_body(body).unwrap();
    first.snapshot(&mut bytes);
    second.restore(&bytes).unwrap();
    for _ in 0..60 {
        first.step(DT).unwrap();
        second.step(DT).unwrap();
        assert_eq!(states(&first), states(&second));
        assert_eq!(forces(&first), forces(&second));
    }
}

#[test]
fn one_of_a_stack_that_is_pushed_wakes_all_of_it_and_nobody_else() {
    let mut world = world(Response::Implicit);
    add_floor(&mut world);
    let half = Vec3::repeat(0.1);
    let coat = Coat::cuboid(half - Vec3::repeat(0.05), 0.05);
    let mut add = |x: f64, layer: f64| {
        let pose = Pose::at(x, 0.0, 0.1 + 0.1995 * layer);
        let inertia = box_inertia(1.0, half);
        let link = LinkDesc { kind: Kind::Rigid, mass: 1.0, inertia, pose, ..LinkDesc::default() };
        coat.add(&mut world, BodyDesc { friction: 0.5, ..coat.body_desc() }, link)
    };
    let stack = [add(0.0, 0.0), add(0.0, 1.0)];
    let apart = add(1.0, 0.0);
    fall_asleep(&mut world, 3, 600);
    world.apply_impulse(stack[1].1, &Vec3::new(0.1, 0.0, 0.0), None).unwrap();
    world.step(DT).unwrap();
    let awake = |body: BodyId| world.body_is_awake(body).unwrap();
    assert!(awake(stack[0].0) && awake(stack[1].0) && !awake(apart.0));
    // Contacts of those who sleep come first.
    let contacts = world.contacts();
    assert!(contacts.len() >= 3 && contacts[0].bodies.contains(&apart.0));
}
