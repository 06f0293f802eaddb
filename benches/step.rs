//! Time of a step of a heap of resting balls in a pit: 0.5 m, 1 kg, 1/60 s, with friction and dissipation.
//!
//! The balls settle before the clock starts, a thousand of them on a loose grid only. The printed line tells what the
//! steps then had to do.

use divan::{Bencher, black_box};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Vec3};
use isocoat::world::{BodyDesc, LinkDesc, SkeletonDesc, World, WorldDesc};

fn main() {
    divan::main();
}

const RADIUS: f64 = 0.5;
const DT: f64 = 1.0 / 60.0;

/// Settled balls in a pit of hard planes that is as wide as their grid.
fn pit(count: usize) -> World {
    let coarse = WorldDesc {
        gravity: Vec3::new(0.0, 0.0, -9.81),
        force_tolerance: 5e-2,
        max_substeps: 64,
        ..WorldDesc::default()
    };
    let mut world = World::new(coarse.clone()).expect("a world");
    let side = (count as f64).cbrt().round() as usize;
    let rough = BodyDesc { friction: 0.3, dissipation: 0.5, ..BodyDesc::default() };
    let width = 0.5 * (2.0 * RADIUS + 0.02) * side as f64;
    for (normal, distance) in
        [(Vec3::z(), 0.0), (Vec3::x(), width), (-Vec3::x(), width), (Vec3::y(), width), (-Vec3::y(), width)]
    {
        let body = world.create_body(BodyDesc { rigid: true, ..rough.clone() }).expect("a wall");
        let link = world.create_link(body, LinkDesc::default()).expect("a link");
        // The coat of the wall ends where the pit begins.
        let shape = Shape::plane(-normal * (distance + 0.1), normal).expect("a plane");
        world.create_skeleton(link, SkeletonDesc { shape, ..SkeletonDesc::default() }).expect("a coat");
    }
    for index in 0..count {
        let [i, j, k] = [index % side, index / side % side, index / side / side];
        let along = |i: usize| (i as f64 - 0.5 * (side as f64 - 1.0)) * (2.0 * RADIUS + 0.01);
        // Each layer is shifted a little, so that it does not stand on the one below.
        let shift = 0.004 * if k.is_multiple_of(2) { 1.0 } else { -1.0 };
        let height = RADIUS + 2.0 * RADIUS * k as f64 - 1e-3 * (k as f64 + 1.0);
        let body = world.create_body(rough.clone()).expect("a ball");
        let link = LinkDesc {
            kind: Kind::Rigid,
            mass: 1.0,
            inertia: Mat3::identity() * (0.4 * RADIUS * RADIUS),
            pose: Pose::at(along(i) + shift, along(j) + shift, height),
            ..LinkDesc::default()
        };
        let link = world.create_link(body, link).expect("a link");
        let skeleton = SkeletonDesc { thickness: RADIUS, ..SkeletonDesc::default() };
        world.create_skeleton(link, skeleton).expect("a coat");
    }
    let settling = if count > 500 { 60 } else { 300 };
    for _ in 0..settling {
        world.step(DT).expect("a step");
    }
    world.set_desc(WorldDesc { force_tolerance: 5e-3, max_substeps: 4096, ..coarse }).expect("settings");
    world.step(DT).expect("a step");
    let counters = world.counters();
    println!(
        "{count} balls: {} patches, {} islands, {} sub-steps, {} rounds, {} evaluations a step",
        counters.patches, counters.islands, counters.substeps, counters.implicit_rounds, counters.evaluations
    );
    world
}

#[divan::bench(args = [8, 27, 125, 1000], sample_count = 60, sample_size = 1, max_time = 10)]
fn resting_balls(bencher: Bencher, count: usize) {
    let mut world = pit(count);
    bencher.bench_local(|| black_box(&mut world).step(DT));
}
