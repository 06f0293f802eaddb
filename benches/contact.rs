//! Cost of a contact query by pair of shapes, tolerance and scheme.
//!
//! Before the measurements proper a table gives the evaluations of a query, which no clock disturbs, and checks the
//! bar: two balls by the polar patch at 5e-3 take at most 200 evaluations and 20 µs. A query is `World::collide` on
//! two fixed bodies: it includes the gathering of the pair.

use std::time::Instant;

use divan::{Bencher, black_box};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Vec3, rotation_from_vector};
use isocoat::world::{BodyDesc, BodyId, LinkDesc, Scheme, SkeletonDesc, World, WorldDesc};

fn main() {
    table();
    divan::main();
}

const PAIRS: [&str; 8] = [
    "ball-ball",
    "ball-plane",
    "segment-segment",
    "segment-plane",
    "box-plane",
    "box-box",
    "box-ball",
    "dumbbell-dumbbell",
];
const TOLERANCES: [f64; 3] = [5e-2, 5e-3, 5e-4];
const SCHEMES: [Scheme; 2] = [Scheme::Polar, Scheme::Auto];

/// One row of the table.
#[derive(Clone, Copy)]
struct Case {
    pair: &'static str,
    tolerance: f64,
    scheme: Scheme,
}

impl std::fmt::Display for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} {:.0e} {:?}", self.pair, self.tolerance, self.scheme)
    }
}

fn cases() -> impl Iterator<Item = Case> {
    let with = |pair, tolerance| SCHEMES.map(|scheme| Case { pair, tolerance, scheme });
    PAIRS.into_iter().flat_map(move |pair| TOLERANCES.into_iter().flat_map(move |tolerance| with(pair, tolerance)))
}

/// Primitives and thickness of a body.
fn coat(name: &str) -> (Vec<Shape>, f64) {
    match name {
        "ball" => (vec![Shape::Point(Vec3::zeros())], 0.1),
        "plane" => (vec![Shape::Plane { point: Vec3::zeros(), normal: Vec3::z() }], 0.1),
        "segment" => (vec![Shape::Segment(Vec3::new(-0.3, 0.0, 0.0), Vec3::new(0.3, 0.0, 0.0))], 0.1),
        "box" => {
            let half = Vec3::new(0.2, 0.15, 0.1);
            (vec![Shape::Box { center: Vec3::zeros(), half, axes: Mat3::identity() }], 0.05)
        }
        _ => (vec![Shape::Point(Vec3::new(-0.12, 0.0, 0.0)), Shape::Point(Vec3::new(0.12, 0.0, 0.0))], 0.1),
    }
}

/// The two bodies of a pair, pressed together by a tenth of their thickness or so.
fn scene(pair: &str) -> (World, BodyId, BodyId) {
    let mut world = World::new(WorldDesc::default()).expect("a world");
    // The second body lies on the first, turned.
    let (height, turn) = match pair {
        "ball-ball" => (0.18, Vec3::new(0.3, -0.2, 0.5)),
        "ball-plane" => (-0.19, Vec3::zeros()),
        "segment-segment" => (0.18, Vec3::new(0.05, 0.03, 0.8)),
        "segment-plane" => (-0.19, Vec3::new(0.0, 0.01, 0.4)),
        "box-box" => (0.29, Vec3::new(0.005, -0.01, 0.4)),
        "box-plane" => (-0.245, Vec3::new(0.01, -0.015, 0.4)),
        "box-ball" => (0.235, Vec3::new(0.3, -0.2, 0.5)),
        _ => (0.17, Vec3::new(0.0, 0.0, 0.7)),
    };
    let mut add = |name: &str, pose: Pose, stiffness_scale: f64| {
        let body = world.create_body(BodyDesc { stiffness_scale, ..BodyDesc::default() }).expect("a body");
        let link = LinkDesc { kind: Kind::Fixed, pose, ..LinkDesc::default() };
        let link = world.create_link(body, link).expect("a link");
        let (shapes, thickness) = coat(name);
        for shape in shapes {
            world.create_skeleton(link, SkeletonDesc { shape, thickness, ..SkeletonDesc::default() }).expect("a coat");
        }
        body
    };
    let (first, second) = pair.split_once('-').expect("two names");
    let a = add(first, Pose::default(), 1e5);
    let position = Vec3::new(0.03, 0.02, height);
    let b = add(second, Pose { position, rotation: rotation_from_vector(&turn) }, 3e5);
    (world, a, b)
}

fn table() {
    println!("pair, tolerance, scheme: evaluations a query, µs a query, who integrated it");
    for case in cases() {
        let (world, a, b) = scene(case.pair);
        let query = || world.collide(a, b, case.scheme, case.tolerance).expect("a query");
        let contacts = query();
        let evaluations: u32 = contacts.iter().map(|contact| contact.evaluations).sum();
        let used = contacts.first().map(|contact| contact.scheme);
        // The best of some short runs: what the query itself takes.
        let run = |_| {
            let start = Instant::now();
            for _ in 0..50 {
                black_box(query());
            }
            start.elapsed().as_secs_f64() * 1e6 / 50.0
        };
        let time = (0..10).map(run).fold(f64::INFINITY, f64::min);
        println!("  {case}: {evaluations} {time:.1} {used:?}, {} patches", contacts.len());
        if case.pair == "ball-ball" && case.scheme == Scheme::Polar && case.tolerance == 5e-3 {
            let verdict = if evaluations <= 200 && time <= 20.0 { "met" } else { "MISSED" };
            println!("  bar of 200 evaluations and 20 µs: {verdict}");
        }
    }
}

#[divan::bench(args = cases(), sample_count = 50)]
fn query(bencher: Bencher, case: &Case) {
    let (world, a, b) = scene(case.pair);
    bencher.counter(1u32).bench_local(|| black_box(&world).collide(a, b, case.scheme, case.tolerance));
}
