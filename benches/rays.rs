//! Speed of many rays in one call, one thread. An item is a ray.

mod common;

use common::numbers;
use divan::{Bencher, counter::ItemsCount};
use isocoat::World;
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::world::rays::{Ray, RaysDesc};
use isocoat::world::{BodyDesc, Deformation, LinkDesc, SkeletonDesc, WorldDesc};

fn main() {
    divan::main();
}

/// A blob of shapes in a cube of two metres that overlap, as in the bench of meshes.
fn blob(count: usize, shape: &str, thickness: f64) -> World {
    let mut world = World::new(WorldDesc::default()).expect("a world");
    let body = world.create_body(BodyDesc::default()).expect("a body");
    let link = world.create_link(body, LinkDesc::default()).expect("a link");
    let mut number = numbers();
    let mut vector = || Vec3::new(number(), number(), number());
    for _ in 0..count {
        let a = vector();
        let shape = if shape == "point" { Shape::Point(a) } else { Shape::segment(a, a + vector() * 0.3) };
        let desc = SkeletonDesc { shape, thickness, ..SkeletonDesc::default() };
        world.create_skeleton(link, desc).expect("a skeleton");
    }
    world
}

/// The picture that a camera takes of the blob: the bounds fill it.
fn picture(side: usize) -> impl Iterator<Item = Ray> + Clone {
    let eye = Vec3::new(0.0, -4.0, 0.0);
    (0..side * side).map(move |k| {
        let at = |x: usize| 1.4 * (2.0 * (x as f64 + 0.5) / side as f64 - 1.0);
        let through = Vec3::new(at(k % side), -1.4, at(k / side));
        Ray { origin: eye, direction: through - eye, max_distance: f64::INFINITY }
    })
}

fn run(bencher: Bencher, world: &World, desc: &RaysDesc) {
    let rays = picture(512);
    bencher.counter(ItemsCount::new(512_usize * 512)).bench_local(|| {
        let mut hits = 0;
        world.cast_rays(rays.clone(), desc, |_, hit| hits += usize::from(hit.is_some())).expect("hits");
        hits
    });
}

/// A blob of 100.
#[divan::bench(args = ["point", "segment"], sample_count = 10)]
fn blob_of_100(bencher: Bencher, shape: &str) {
    run(bencher, &blob(100, shape, 0.2), &RaysDesc::default());
}

/// Ten thousand small points.
#[divan::bench(sample_count = 10)]
fn blob_of_10000(bencher: Bencher) {
    run(bencher, &blob(10_000, "point", 0.04), &RaysDesc::default());
}

/// The blob of 100 points, pressed by a ball from the side of the camera.
#[divan::bench(sample_count = 10)]
fn pressed(bencher: Bencher) {
    let mut world = blob(100, "point", 0.2);
    let body = world.create_body(BodyDesc { rigid: true, ..BodyDesc::default() }).expect("a body");
    let desc = LinkDesc { pose: Pose::at(0.5, -1.2, 0.3), ..LinkDesc::default() };
    let link = world.create_link(body, desc).expect("a link");
    let desc = SkeletonDesc { thickness: 0.3, ..SkeletonDesc::default() };
    world.create_skeleton(link, desc).expect("a skeleton");
    run(bencher, &world, &RaysDesc { deformation: Deformation::Contact, ..RaysDesc::default() });
}
