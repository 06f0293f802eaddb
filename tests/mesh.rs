//! Meshes: closed manifolds on the true surface, whatever the scene. Figures:
//! `cargo test --release --test mesh -- --nocapture`.

mod common;

use std::collections::HashMap;

use common::Random;
use isocoat::World;
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::surface::mesh::Mesh;
use isocoat::world::mesh::{MeshDesc, MeshWorkspace};
use isocoat::world::{BodyDesc, BodyId, Deformation, LinkDesc, SkeletonDesc, WorldDesc};

const DEFORMATIONS: [Deformation; 3] = [Deformation::None, Deformation::Contact, Deformation::Bulges];

fn world() -> World {
    World::new(WorldDesc::default()).unwrap()
}

/// A body of one link with these shapes.
fn add(world: &mut World, desc: BodyDesc, shapes: &[(Shape, f64)], pose: Pose) -> BodyId {
    let body = world.create_body(desc).unwrap();
    let link = world.create_link(body, LinkDesc { pose, ..LinkDesc::default() }).unwrap();
    for (shape, thickness) in shapes {
        let desc = SkeletonDesc { shape: *shape, thickness: *thickness, ..SkeletonDesc::default() };
        world.create_skeleton(link, desc).unwrap();
    }
    body
}

fn cuboid(center: Vec3, half: Vec3, random: &mut Random) -> Shape {
    Shape::Box { center, half, axes: *random.rotation().to_rotation_matrix().matrix() }
}

/// A shape of any bounded kind near the origin.
fn some_shape(random: &mut Random) -> Shape {
    let place = |random: &mut Random| Vec3::from_fn(|_, _| random.range(-0.3, 0.3));
    match (random.unit() * 4.0) as u32 {
        0 => Shape::Point(place(random)),
        1 => Shape::segment(place(random), place(random)),
        2 => Shape::triangle(place(random), place(random), place(random)),
        _ => cuboid(place(random), Vec3::from_fn(|_, _| random.range(0.02, 0.2)), random),
    }
}

fn some_body(world: &mut World, random: &mut Random, desc: BodyDesc, pose: Pose) -> BodyId {
    let count = 1 + (random.unit() * 6.0) as usize;
    let shapes: Vec<(Shape, f64)> = (0..count).map(|_| (some_shape(random), random.range(0.08, 0.15))).collect();
    let body = add(world, desc, &shapes, pose);
    if random.unit() < 0.5 {
        let link = world.body_links(body).unwrap().next().unwrap();
        let skeletons: Vec<_> = world.link_skeletons(link).unwrap().collect();
        for (i, a) in skeletons.iter().enumerate() {
            for b in &skeletons[..i] {
                let weight = (random.range(-0.5, 1.5)).clamp(0.0, 1.0);
                world.set_blend(*a, *b, weight, 0.0).unwrap();
            }
        }
    }
    body
}

/// Twice the vector area of a triangle.
fn area(mesh: &Mesh, t: &[u32; 3]) -> Vec3 {
    let [a, b, c] = t.map(|v| Vec3::from(mesh.positions[v as usize]));
    (b - a).cross(&(c - a))
}

fn volume(mesh: &Mesh) -> f64 {
    // About a point of the mesh, so that places far from the origin cost no digits.
    let Some(middle) = mesh.positions.first().map(|p| Vec3::from(*p)) else { return 0.0 };
    let each = mesh.triangles.iter().map(|t| area(mesh, t).dot(&(Vec3::from(mesh.positions[t[0] as usize]) - middle)));
    each.sum::<f64>() / 6.0
}

/// Closed, edge-manifold, vertex-manifold, consistently oriented, outwards; all numbers finite; no vertex unused.
fn assert_watertight(mesh: &Mesh, what: &str) {
    assert_eq!(mesh.positions.len(), mesh.normals.len(), "{what}");
    let finite = |v: &[f64; 3]| v.iter().all(|x| x.is_finite());
    assert!(mesh.positions.iter().all(finite) && mesh.normals.iter().all(finite), "{what}: not finite");
    assert!(mesh.normals.iter().all(|n| (Vec3::from(*n).norm() - 1.0).abs() < 1e-12), "{what}: normals");
    // Of each directed side, its triangle's third vertex: each side occurs once, and its opposite once.
    let mut sides: HashMap<(u32, u32), u32> = HashMap::new();
    let mut fans: HashMap<u32, (u32, usize)> = HashMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let [a, b, c] = [t[k], t[(k + 1) % 3], t[(k + 2) % 3]];
            assert!(sides.insert((a, b), c).is_none(), "{what}: side {a} {b} of two triangles");
            fans.entry(a).or_insert((b, 0)).1 += 1;
        }
    }
    for (a, b) in sides.keys() {
        assert!(sides.contains_key(&(*b, *a)), "{what}: side {a} {b} is open");
    }
    assert_eq!(fans.len(), mesh.positions.len(), "{what}: vertices without triangles");
    for (vertex, (first, count)) in &fans {
        let (mut round, mut at) = (0, *first);
        loop {
            at = sides[&(*vertex, at)];
            round += 1;
            if at == *first || round > *count {
                break;
            }
        }
        assert_eq!(round, *count, "{what}: more than one fan at vertex {vertex}");
    }
    assert!(mesh.triangles.is_empty() || volume(mesh) > 0.0, "{what}: inside out");
}

/// How far vertices are from the surface, by the field: the largest `|f - c| / |∇f|`.
fn farthest(world: &World, body: BodyId, mesh: &Mesh, deformation: Deformation) -> f64 {
    let (mut values, mut slopes) = (vec![0.0; mesh.positions.len()], vec![[0.0; 3]; mesh.positions.len()]);
    let (v, g) = (Some(&mut values[..]), Some(&mut slopes[..]));
    world.evaluate_field_deformed(body, &mesh.positions, v, g, deformation).unwrap();
    let isovalue = world.body_desc(body).unwrap().isovalue;
    let off = values.iter().zip(&slopes).map(|(v, g)| (v - isovalue).abs() / Vec3::from(*g).norm().max(1e-300));
    off.fold(0.0, f64::max)
}

#[test]
fn a_ball_has_a_mesh() {
    let mut world = world();
    let body = add(&mut world, BodyDesc::default(), &[(Shape::Point(Vec3::zeros()), 0.1)], Pose::at(1.0, 2.0, 3.0));
    for parts in [1.0, 2.0, 4.0, 8.0, 16.0, 32.0] {
        let mesh = world.mesh(body, &MeshDesc::new(0.1 / parts)).unwrap();
        assert_watertight(&mesh, "ball");
        let exact = 4.0 / 3.0 * std::f64::consts::PI * 1e-3;
        println!("{parts} {} {:.5}", mesh.triangles.len(), volume(&mesh) / exact - 1.0);
    }
}

#[test]
fn meshes_are_closed_manifolds_in_any_scene() {
    let mut random = Random(3);
    let mut workspace = MeshWorkspace::default();
    let mut mesh = Mesh::default();
    let (mut triangles, mut worst) = (0, 0.0_f64);
    for scene in 0..200 {
        let mut world = world();
        let soft = |random: &mut Random| BodyDesc {
            rigid: random.unit() < 0.2,
            stiffness_scale: 10.0_f64.powf(random.range(4.0, 6.0)),
            bulge_width: random.range(0.0, 1.0),
            bulge_height: random.range(0.0, 2.0),
            ..BodyDesc::default()
        };
        let others = (random.unit() * 3.0) as usize;
        let desc = soft(&mut random);
        let body = some_body(&mut world, &mut random, desc, Pose::default());
        for _ in 0..others {
            let pose = Pose { position: random.direction() * random.range(0.2, 0.6), rotation: random.rotation() };
            let desc = soft(&mut random);
            some_body(&mut world, &mut random, desc, pose);
        }
        if random.unit() < 0.3 {
            let plane = Shape::Plane { point: Vec3::zeros(), normal: random.direction() };
            let pose = Pose { position: -random.direction() * 0.3, ..Pose::default() };
            let desc = soft(&mut random);
            add(&mut world, desc, &[(plane, 0.1)], pose);
        }
        let cell = 0.1 / random.range(0.7, 8.0);
        for deformation in DEFORMATIONS {
            world.mesh_into(body, &MeshDesc { cell_size: cell, deformation }, &mut workspace, &mut mesh).unwrap();
            assert_watertight(&mesh, &format!("scene {scene}, {deformation:?}, cell {cell}"));
            triangles += mesh.triangles.len();
            if deformation == Deformation::None {
                worst = worst.max(farthest(&world, body, &mesh, deformation));
            }
        }
    }
    println!("{triangles} triangles in 600 meshes; undeformed vertices within {:.1e} m", worst);
}
