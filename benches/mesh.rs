//! Speed of watertight meshes, one thread. An item is a triangle, with its share of vertices and normals.

mod common;

use common::numbers;
use divan::{Bencher, counter::ItemsCount};
use isocoat::coat::Coat;
use isocoat::field::{Placed, Profile, Shape};
use isocoat::math::{Mat3, Vec3};
use isocoat::surface::deformed::Deformed;
use isocoat::surface::mesh::coated::{Coated, Scratch};
use isocoat::surface::mesh::{Mesh, Workspace, mesh};

fn main() {
    divan::main();
}

/// A coat whose surface is at `thickness`, and its fields end at twice that.
fn coat(shapes: impl Iterator<Item = Shape>, thickness: f64) -> Deformed {
    let placed = |shape: Shape| {
        let profile = Profile::new(1.0, thickness, 0.0, 1.0, 0.0, shape.is_solid()).expect("a profile");
        Placed { shape, profile }
    };
    let coat = Coat { skeletons: shapes.map(placed).collect(), ..Coat::new(Vec3::zeros(), 1.0) };
    Deformed { coat, obstacles: Vec::new() }
}

fn run(bencher: Bencher, coat: &Deformed, cell: f64) {
    let (mut scratch, mut workspace, mut out) = (Scratch::default(), Workspace::default(), Mesh::default());
    mesh(&mut Coated::new(coat, &mut scratch), cell, &mut workspace, &mut out).expect("a mesh");
    bencher
        .counter(ItemsCount::new(out.triangles.len()))
        .bench_local(|| mesh(&mut Coated::new(coat, &mut scratch), cell, &mut workspace, &mut out));
}

/// A blob of 100 shapes in a cube of two metres that overlap; the cells are a 128th of what their fields reach.
#[divan::bench(args = ["point", "segment", "triangle", "box"])]
fn blob(bencher: Bencher, shape: &str) {
    let mut number = numbers();
    let mut vector = || Vec3::new(number(), number(), number());
    let shapes = (0..100).map(|_| match shape {
        "point" => Shape::Point(vector()),
        "segment" => {
            let a = vector();
            Shape::segment(a, a + vector() * 0.3)
        }
        "triangle" => {
            let a = vector();
            Shape::triangle(a, a + vector() * 0.3, a + vector() * 0.3)
        }
        _ => Shape::Box { center: vector(), half: vector().map(|x| 0.05 + 0.1 * x.abs()), axes: Mat3::identity() },
    });
    run(bencher, &coat(shapes, 0.2), 2.8 / 128.0);
}

/// Points a spacing apart, shaken, with fields that reach two; cells of a quarter.
#[divan::bench(args = [1_000, 10_000, 80_000])]
fn dough(bencher: Bencher, count: usize) {
    let mut number = numbers();
    let side = (count as f64).cbrt().ceil() as usize;
    let place = |k: usize| Vec3::new((k % side) as f64, (k / side % side) as f64, (k / (side * side)) as f64);
    let points = (0..count).map(|k| Shape::Point(place(k) + Vec3::new(number(), number(), number()) * 0.2));
    run(bencher, &coat(points, 1.0), 0.25);
}
