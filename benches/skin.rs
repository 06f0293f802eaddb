//! Speed of skins, one thread. An item is a vertex.

#[path = "../tests/common/character.rs"]
mod character;

use character::Character;
use divan::{Bencher, counter::ItemsCount};
use isocoat::World;
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::world::mesh::MeshDesc;
use isocoat::world::{BodyDesc, Deformation, LinkDesc, SkeletonDesc, SkinId, WorldDesc};

fn main() {
    divan::main();
}

const VERTICES: usize = 30_000;

/// A character with a skin of 30,000 vertices on its surface.
fn dressed() -> (World, Character, SkinId) {
    let mut world = World::new(WorldDesc::default()).expect("a world");
    let character = Character::new(&mut world);
    let mesh = world.mesh(character.body, &MeshDesc::new(0.008)).expect("a mesh");
    assert!(mesh.positions.len() >= VERTICES, "{} vertices", mesh.positions.len());
    // Every so many, all over the body.
    let some = |list: &[[f64; 3]]| -> Vec<[f64; 3]> {
        (0..VERTICES).map(|k| list[k * mesh.positions.len() / VERTICES]).collect()
    };
    let (positions, normals) = (some(&mesh.positions), some(&mesh.normals));
    let skin = world.create_skin(character.body, &positions, Some(&normals)).expect("a skin");
    (world, character, skin)
}

/// A frame, as it stands (0) and bent.
#[divan::bench(args = [0.0, 0.5, 1.0], sample_count = 20)]
fn frame(bencher: Bencher, amount: f64) {
    let (mut world, character, skin) = dressed();
    character.bend(&mut world, amount);
    bencher.counter(ItemsCount::new(VERTICES)).bench_local(|| {
        let mut sum = 0.0;
        world
            .deform_skin(skin, Deformation::None, |_, position, normal| sum += position.x + normal.x)
            .expect("a frame");
        sum
    });
}

/// A frame with the feet in a floor.
#[divan::bench(sample_count = 20)]
fn pressed(bencher: Bencher) {
    let (mut world, _, skin) = dressed();
    let floor = world.create_body(BodyDesc { rigid: true, ..BodyDesc::default() }).expect("a body");
    let desc = LinkDesc { pose: Pose::at(0.0, 0.0, 0.02 - 0.1), ..LinkDesc::default() };
    let link = world.create_link(floor, desc).expect("a link");
    let shape = Shape::Plane { point: Vec3::zeros(), normal: Vec3::z() };
    world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.1, ..SkeletonDesc::default() }).expect("a skeleton");
    bencher.counter(ItemsCount::new(VERTICES)).bench_local(|| {
        let mut sum = 0.0;
        world.deform_skin(skin, Deformation::Bulges, |_, position, _| sum += position.x).expect("a frame");
        sum
    });
}

/// The binding.
#[divan::bench(sample_count = 5)]
fn bind(bencher: Bencher) {
    bencher.counter(ItemsCount::new(VERTICES)).bench_local(dressed);
}
