//! What a scene pays for what it uses, counted: bytes a body, and instructions a body and step under callgrind.
//! `make count` prints the table.

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::process::Command;
use std::sync::atomic::{AtomicUsize, Ordering};

use common::{Coat, DT, G, ball_inertia};
use isocoat::base::Kind;
use isocoat::math::{Pose, Vec3};
use isocoat::world::{BodyDesc, LinkDesc, Response, World, WorldDesc};

static LIVE: AtomicUsize = AtomicUsize::new(0);

/// The system's allocator, which knows how much is in use.
struct Counting;

// SAFETY: all requests go to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LIVE.fetch_add(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

const BALLS: usize = 64;
const RADIUS: f64 = 0.1;

/// What is switched on, one at a time.
const FEATURES: [&str; 10] = [
    "nothing",
    "no rotation",
    "friction",
    "static friction",
    "dissipation",
    "viscous friction",
    "volume control",
    "may fall asleep",
    "asleep",
    "timed",
];

/// Balls at rest on a floor, far from each other.
fn scene(feature: &str, response: Response) -> World {
    let on = |name: &str| f64::from(u8::from(feature == name));
    // An hour is never over here.
    let sleep_time = 3600.0 * on("may fall asleep") + 0.05 * on("asleep");
    let gravity = Vec3::new(0.0, 0.0, -G);
    let timed = feature == "timed";
    let mut world =
        World::new(WorldDesc { gravity, response, sleep_time, timed, sleep_speed: 1.0, ..WorldDesc::default() })
            .unwrap();
    let body = BodyDesc {
        friction: 0.5 * (on("friction") + on("static friction")),
        static_friction: 0.6 * on("static friction"),
        dissipation: on("dissipation"),
        viscous_friction: on("viscous friction"),
        volume_gain: 0.5 * on("volume control"),
        ..BodyDesc::default()
    };
    let floor = LinkDesc { pose: Pose::at(0.0, 0.0, -0.1), ..LinkDesc::default() };
    Coat::floor(0.1).add(&mut world, BodyDesc { rigid: true, ..body.clone() }, floor);
    for index in 0..BALLS {
        let link = LinkDesc {
            kind: if feature == "no rotation" { Kind::PointMass } else { Kind::Rigid },
            mass: 1.0,
            inertia: ball_inertia(1.0, RADIUS),
            pose: Pose::at((index % 8) as f64, (index / 8) as f64, RADIUS - 0.004),
            ..LinkDesc::default()
        };
        Coat::ball(RADIUS).add(&mut world, body.clone(), link);
    }
    world
}

fn run(world: &mut World, steps: usize) {
    for _ in 0..steps {
        world.step(DT).unwrap();
    }
}

/// Bytes a body, with all buffers that its steps need.
fn bytes(feature: &str, response: Response) -> usize {
    let before = LIVE.load(Ordering::Relaxed);
    let mut world = scene(feature, response);
    run(&mut world, 30);
    let after = LIVE.load(Ordering::Relaxed);
    drop(world);
    (after - before) / BALLS
}

const RESPONSES: [(&str, Response); 2] = [("implicit", Response::Implicit), ("substepped", Response::Substepped)];

/// What callgrind looks at: in a process of its own.
const SCENE: &str = "ISOCOAT_COUNT_SCENE";

/// Instructions of a scene with so many steps; `None` without valgrind.
fn instructions(feature: &str, response: &str, steps: usize) -> Option<f64> {
    let name = "what_a_scene_does_not_use_it_does_not_pay_for";
    let mut valgrind = Command::new("valgrind");
    valgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]);
    valgrind.arg(std::env::current_exe().unwrap()).args(["--ignored", "--exact", name, "--test-threads=1"]);
    let output = valgrind.env(SCENE, format!("{feature}/{response}/{steps}")).output().ok()?;
    let text = String::from_utf8_lossy(&output.stderr);
    let count = text.lines().find_map(|line| line.split_once("Collected :")).map(|(_, count)| count.trim().parse());
    Some(count.expect("callgrind counts").expect("a number"))
}

#[test]
#[ignore = "needs valgrind: make count"]
fn what_a_scene_does_not_use_it_does_not_pay_for() {
    if let Ok(scene_name) = std::env::var(SCENE) {
        let parts: Vec<&str> = scene_name.split('/').collect();
        let response = RESPONSES.iter().find(|(name, _)| *name == parts[1]).unwrap().1;
        run(&mut scene(parts[0], response), parts[2].parse().unwrap());
        return;
    }
    for (name, response) in RESPONSES {
        println!("| {name} | bytes a body | instructions a body and step | |");
        println!("| --- | --- | --- | --- |");
        let mut plain = (0, 0.0);
        // The first scene of a process pays for what all share.
        bytes("nothing", response);
        for feature in FEATURES {
            let bytes = bytes(feature, response);
            let [few, many] = [20, 40].map(|steps| instructions(feature, name, steps).expect("valgrind runs"));
            let count = (many - few) / (20 * BALLS) as f64;
            if feature == "nothing" {
                plain = (bytes, count);
            }
            let more = 100.0 * (count / plain.1 - 1.0);
            println!("| {feature} | {bytes} | {count:.0} | {more:+.1} % |");
            match feature {
                "no rotation" => assert!(count < 1.02 * plain.1),
                // A coat that rests in itself is not measured again.
                "volume control" => assert!(count < 1.02 * plain.1 && bytes > plain.0),
                "may fall asleep" => assert!(count < 1.05 * plain.1 && bytes == plain.0),
                "asleep" => assert!(count < 0.1 * plain.1),
                "friction" | "viscous friction" => assert!(count > plain.1),
                "static friction" => assert!(count > plain.1 && bytes > plain.0),
                _ => {}
            }
        }
        println!();
    }
}

/// The memory of what sticks is made for what sticks only.
#[test]
fn bodies_without_static_friction_have_no_memory_for_it() {
    // The first scene of a process pays for what all share.
    bytes("nothing", Response::Implicit);
    let plain = bytes("nothing", Response::Implicit);
    assert!(bytes("static friction", Response::Implicit) > plain);
    assert_eq!(bytes("may fall asleep", Response::Implicit), plain);
}
