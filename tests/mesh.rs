//! Meshes: closed manifolds on the true surface, whatever the scene. Figures:
//! `cargo test --release --test mesh -- --nocapture`.

mod common;

use std::collections::HashMap;

use common::Random;
use isocoat::World;
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::surface::mesh::Mesh;
use isocoat::world::attributes::Weights;
use isocoat::world::mesh::{MeshDesc, MeshWorkspace, TerritoryStyle};
use isocoat::world::{BodyDesc, BodyId, Deformation, LinkDesc, SkeletonDesc, SkeletonId, WorldDesc};

/// The least thickness of random bodies \[m\].
const THINNEST: f64 = 0.08;
const T: f64 = 0.1;
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
    let shapes: Vec<(Shape, f64)> = (0..count).map(|_| (some_shape(random), random.range(THINNEST, 0.15))).collect();
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
fn meshes_are_closed_manifolds_in_any_scene() {
    let mut random = Random(3);
    let mut workspace = MeshWorkspace::default();
    let mut mesh = Mesh::default();
    let (mut triangles, mut worst) = (0, [0.0_f64; 3]);
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
            let worst = &mut worst[deformation as usize];
            *worst = worst.max(farthest(&world, body, &mesh, deformation) / THINNEST);
        }
    }
    let [none, pressed, bulging] = worst;
    println!("{triangles} triangles in 600 meshes; vertices off the surface, of the least thickness, at most:");
    println!("{none:.1e} undeformed, {pressed:.1e} in contact, {bulging:.1e} with bulges");
    assert!(worst.iter().all(|off| *off < 1e-3), "{worst:?}");
}

/// Volume of a body by columns through its field: knows nothing of meshes but where to look.
fn quadrature(world: &World, body: BodyId, near: &Mesh, deformation: Deformation) -> f64 {
    const COLUMNS: usize = 180;
    let each = || near.positions.iter().map(|p| Vec3::from(*p));
    let low = each().fold(Vec3::repeat(f64::INFINITY), |low, p| low.inf(&p)) - Vec3::repeat(0.02 * T);
    let high = each().fold(Vec3::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p)) + Vec3::repeat(0.02 * T);
    let step = (high - low) / COLUMNS as f64;
    let isovalue = world.body_desc(body).unwrap().isovalue;
    let mut sum = 0.0;
    for x in 0..COLUMNS {
        let at = |i: usize| {
            let (y, z) = (i / (COLUMNS + 1), i % (COLUMNS + 1));
            (low + step.component_mul(&Vec3::new(x as f64 + 0.5, y as f64 + 0.5, z as f64))).into()
        };
        let points: Vec<[f64; 3]> = (0..COLUMNS * (COLUMNS + 1)).map(at).collect();
        let mut values = vec![0.0; points.len()];
        world.evaluate_field_deformed(body, &points, Some(&mut values), None, deformation).unwrap();
        for column in values.chunks(COLUMNS + 1) {
            sum += column.windows(2).map(|pair| share(pair[0] - isovalue, pair[1] - isovalue)).sum::<f64>();
        }
    }
    sum * step.product()
}

/// The part of a line that is inside, from the excess at its ends.
fn share(a: f64, b: f64) -> f64 {
    match (a >= 0.0, b >= 0.0) {
        (true, true) => 1.0,
        (false, false) => 0.0,
        _ => a.max(b) / (a - b).abs(),
    }
}

/// Bodies of all kinds, alone and in contact, with coats of one thickness.
fn named_scenes() -> Vec<(&'static str, World, BodyId, Deformation)> {
    let mut random = Random(8);
    let point = |x: f64, y: f64| Shape::Point(Vec3::new(x, y, 0.0));
    let soft = |width: f64| BodyDesc { bulge_width: width, bulge_height: 1.0, ..BodyDesc::default() };
    let alone = |shapes: &[Shape]| {
        let mut world = world();
        let shapes: Vec<(Shape, f64)> = shapes.iter().map(|shape| (*shape, T)).collect();
        let body = add(&mut world, BodyDesc::default(), &shapes, Pose::at(3.0, 1.0, 0.2));
        (world, body)
    };
    let mut scenes = Vec::new();
    let triangle = Shape::triangle(Vec3::zeros(), Vec3::new(0.3, 0.1, 0.0), Vec3::new(0.0, 0.3, 0.1));
    let segment = Shape::segment(Vec3::zeros(), Vec3::new(0.2, 0.2, 0.1));
    let turned = cuboid(Vec3::zeros(), Vec3::new(0.15, 0.1, 0.05), &mut random);
    let blend = [point(0.0, 0.0), point(0.16, 0.02), segment, point(0.0, 0.2)];
    let single: [(&str, &[Shape]); 5] = [
        ("point", &[point(0.0, 0.0)]),
        ("segment", &[segment]),
        ("triangle", &[triangle]),
        ("box", &[turned]),
        ("blend", &blend),
    ];
    for (name, shapes) in single {
        let (world, body) = alone(shapes);
        scenes.push((name, world, body, Deformation::None));
    }
    let (mut elbow, body) = alone(&[point(-0.09, 0.07), point(0.0, -0.07), point(0.09, 0.07)]);
    let skeletons: Vec<_> = elbow.body_links(body).unwrap().flat_map(|l| elbow.link_skeletons(l).unwrap()).collect();
    elbow.set_blend(skeletons[0], skeletons[2], 0.0, 0.0).unwrap();
    scenes.push(("blend graph", elbow, body, Deformation::None));
    for (name, other, deformation) in [
        ("ball on a ball", soft(0.0), Deformation::Contact),
        ("ball on a rigid ball", BodyDesc { rigid: true, ..BodyDesc::default() }, Deformation::Contact),
        ("bulging ball", soft(0.5), Deformation::Bulges),
    ] {
        let mut world = world();
        let body = add(&mut world, soft(0.5), &[(point(0.0, 0.0), T)], Pose::default());
        add(&mut world, other, &[(point(0.0, 0.0), T)], Pose::at(0.1, 0.1, 0.08));
        scenes.push((name, world, body, deformation));
    }
    scenes
}

#[test]
fn volumes_are_those_of_the_solids() {
    println!(
        "scene                | cells in a thickness: 4     8       16 | vertices off the surface, of the thickness"
    );
    for (name, world, body, deformation) in named_scenes() {
        let of = |parts: f64| world.mesh(body, &MeshDesc { cell_size: T / parts, deformation }).unwrap();
        let exact = quadrature(&world, body, &of(8.0), deformation);
        let errors = [4.0, 8.0, 16.0].map(|parts| volume(&of(parts)) / exact - 1.0);
        let off = farthest(&world, body, &of(8.0), deformation) / T;
        let [a, b, c] = errors.map(|error| 100.0 * error);
        println!("{name:20} | {a:.3} % {b:.3} % {c:.3} % | {off:.1e}");
        assert!(errors[1].abs() < 0.01 && errors[2].abs() < 0.0025, "{name}");
        assert!(off < 1e-3, "{name}");
    }
}

#[test]
fn vertices_are_where_the_closest_point_of_the_surface_is() {
    let mut random = Random(11);
    let mut worst = 0.0_f64;
    for _ in 0..40 {
        let mut world = world();
        let body = some_body(&mut world, &mut random, BodyDesc::default(), Pose::default());
        let mesh = world.mesh(body, &MeshDesc::new(THINNEST / random.range(2.0, 6.0))).unwrap();
        for position in mesh.positions.iter().step_by(mesh.positions.len() / 40 + 1) {
            let closest = world.closest_point(body, &Vec3::from(*position)).unwrap().unwrap();
            worst = worst.max(closest.distance.abs() / THINNEST);
        }
    }
    println!("vertices off the closest point by {worst:.1e} of the thickness at most");
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn bodies_in_contact_share_their_contact_surface_and_do_not_overlap() {
    let mut random = Random(5);
    let (mut shared, mut deepest, mut apart) = (0, 0.0_f64, 0.0_f64);
    for scene in 0..30 {
        let mut world = world();
        let desc = |scale: f64| BodyDesc { stiffness_scale: scale, ..BodyDesc::default() };
        let blob = |random: &mut Random| {
            let place = |random: &mut Random| Vec3::from_fn(|_, _| random.range(-0.06, 0.06));
            [(Shape::Point(place(random)), T), (Shape::segment(place(random), place(random)), T)]
        };
        let a = add(&mut world, desc(1e5), &blob(&mut random), Pose::default());
        let toward = random.direction() * random.range(0.25, 0.3);
        let scale = 10.0_f64.powf(random.range(4.0, 6.0));
        let b = add(&mut world, desc(scale), &blob(&mut random), Pose { position: toward, ..Pose::default() });
        let cell_size = T / 8.0;
        let deformation = Deformation::Contact;
        let mesh = world.mesh(a, &MeshDesc { cell_size, deformation }).unwrap();
        assert_watertight(&mesh, &format!("contact {scene}"));
        let count = mesh.positions.len();
        let (mut own, mut values, mut slopes) = (vec![0.0; count], vec![0.0; count], vec![[0.0; 3]; count]);
        world.evaluate_field(a, &mesh.positions, Some(&mut own), None).unwrap();
        let (v, g) = (Some(&mut values[..]), Some(&mut slopes[..]));
        world.evaluate_field_deformed(b, &mesh.positions, v, g, deformation).unwrap();
        let pressed = own.iter().map(|value| *value > 1.0 + 1e-2);
        for ((value, slope), pressed) in values.iter().zip(&slopes).zip(pressed) {
            let depth = (value - 1.0) / Vec3::from(*slope).norm().max(1e-300) / cell_size;
            deepest = deepest.max(depth);
            if pressed {
                shared += 1;
                apart = apart.max(depth.abs());
            }
        }
    }
    println!("{shared} vertices pressed: off the other's surface by {apart:.1e} cells, inside it by {deepest:.1e}");
    assert!(shared > 1000 && apart < 0.1 && deepest < 0.1, "{shared} {apart} {deepest}");
}

#[test]
fn the_same_body_has_the_same_bits_whatever_was_meshed_before() {
    let mut random = Random(7);
    let mut world = world();
    let body = some_body(&mut world, &mut random, BodyDesc::default(), Pose::default());
    let other = some_body(&mut world, &mut random, BodyDesc::default(), Pose::at(0.3, 0.2, 0.1));
    let desc = |deformation| MeshDesc { cell_size: 0.02, deformation };
    for deformation in DEFORMATIONS {
        let fresh = world.mesh(body, &desc(deformation)).unwrap();
        let (mut workspace, mut again) = (MeshWorkspace::default(), Mesh::default());
        world.mesh_into(other, &MeshDesc::new(0.013), &mut workspace, &mut again).unwrap();
        world.mesh_into(body, &desc(deformation), &mut workspace, &mut again).unwrap();
        assert_eq!(fresh, again);
    }
}

/// Checks what holds of weights whatever the blend is.
fn assert_weights(weights: &Weights, count: usize) {
    assert_eq!((weights.skeletons.len(), weights.weights.len()), (count, count));
    for (skeletons, weights) in weights.skeletons.iter().zip(&weights.weights) {
        assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-14, "{weights:?}");
        assert!(weights.windows(2).all(|pair| pair[0] >= pair[1]) && weights[3] >= 0.0, "{weights:?}");
        for (k, (skeleton, weight)) in skeletons.iter().zip(weights).enumerate() {
            assert_eq!(*skeleton == SkeletonId::default(), *weight == 0.0);
            assert!(*weight == 0.0 || !skeletons[..k].contains(skeleton), "{skeletons:?}");
        }
    }
}

#[test]
fn weights_of_vertices_are_the_shares_of_the_fields() {
    let mut random = Random(21);
    let (mut vertices, mut mixed, mut beyond) = (0, 0, 0);
    for scene in 0..12 {
        let mut world = world();
        let shapes: Vec<_> = (0..8).map(|_| (some_shape(&mut random), random.range(THINNEST, 0.15))).collect();
        let body = add(&mut world, BodyDesc::default(), &shapes, Pose::at(2.0, -1.0, 0.5));
        let link = world.body_links(body).unwrap().next().unwrap();
        let skeletons: Vec<_> = world.link_skeletons(link).unwrap().collect();
        let mesh = world.mesh(body, &MeshDesc::new(THINNEST / 3.0)).unwrap();
        let mut weights = Weights::default();
        world.mesh_weights(body, &mesh.positions, &mut weights).unwrap();
        assert_weights(&weights, mesh.positions.len());
        // The field of each skeleton is that of the body when the others are disabled.
        let mut fields = Vec::new();
        for one in &skeletons {
            skeletons.iter().for_each(|other| world.set_skeleton_enabled(*other, other == one).unwrap());
            let mut field = vec![0.0; mesh.positions.len()];
            world.evaluate_field(body, &mesh.positions, Some(&mut field), None).unwrap();
            fields.push(field);
        }
        for vertex in 0..mesh.positions.len() {
            let mut all: Vec<_> = fields.iter().map(|field| field[vertex]).zip(&skeletons).collect();
            all.sort_by(|a, b| b.0.total_cmp(&a.0));
            let strongest: f64 = all[..4].iter().map(|(field, _)| field).sum();
            for (k, (field, skeleton)) in all[..4].iter().enumerate() {
                let (id, weight) = (weights.skeletons[vertex][k], weights.weights[vertex][k]);
                assert!((weight - field / strongest).abs() < 1e-12, "scene {scene}, vertex {vertex}");
                // Of two that are equally strong either may come first.
                let alike = all.iter().any(|(other, of)| of != skeleton && (other - field).abs() < 1e-12);
                assert!(*field == 0.0 || alike || id == **skeleton, "scene {scene}, vertex {vertex}");
            }
            vertices += 1;
            mixed += usize::from(all[1].0 > 0.0);
            beyond += usize::from(all[4].0 > 0.0);
        }
    }
    println!("{vertices} vertices, {mixed} of more than one skeleton, {beyond} of more than four");
    assert!(vertices > 10_000 && mixed > 1000 && beyond > 100);
}

#[test]
fn skeletons_that_do_not_blend_have_their_vertices_alone() {
    let mut world = world();
    let point = |x: f64| (Shape::Point(Vec3::new(x, 0.0, 0.0)), T);
    let body = add(&mut world, BodyDesc::default(), &[point(0.0), point(0.12)], Pose::default());
    let link = world.body_links(body).unwrap().next().unwrap();
    let [a, b] = *world.link_skeletons(link).unwrap().collect::<Vec<_>>() else { panic!("two skeletons") };
    world.set_blend(a, b, 0.0, 0.0).unwrap();
    let mesh = world.mesh(body, &MeshDesc::new(T / 6.0)).unwrap();
    let mut weights = Weights::default();
    world.mesh_weights(body, &mesh.positions, &mut weights).unwrap();
    assert_weights(&weights, mesh.positions.len());
    for (position, skeletons) in mesh.positions.iter().zip(&weights.skeletons) {
        // Where both are equally strong each has half.
        if (position[0] - 0.06).abs() > 0.01 {
            assert_eq!(skeletons[..2], [if position[0] < 0.06 { a } else { b }, SkeletonId::default()]);
        }
    }
    let far = [[9.0, 0.0, 0.0]];
    world.mesh_weights(body, &far, &mut weights).unwrap();
    assert_eq!((weights.skeletons[0][0], weights.weights[0]), (b, [1.0, 0.0, 0.0, 0.0]));
    let error = world.mesh_weights(body, &[[f64::NAN; 3]], &mut weights).unwrap_err();
    assert!(error.to_string().contains("point is (NaN, NaN, NaN); must be finite"), "{error}");
    assert_eq!(weights.skeletons.len(), 1);
    let empty = world.create_body(BodyDesc::default()).unwrap();
    world.mesh_weights(empty, &far, &mut weights).unwrap();
    assert_eq!(weights.weights, [[0.0; 4]]);
}

/// A ball of radius [`T`] whose field rises by `SLOPE` a metre inside.
fn linear_ball(world: &mut World, desc: BodyDesc, x: f64) -> BodyId {
    let body = world.create_body(desc).unwrap();
    let link = world.create_link(body, LinkDesc { pose: Pose::at(x, 0.0, 0.0), ..LinkDesc::default() }).unwrap();
    let desc = SkeletonDesc { thickness: T, stiffness: SLOPE, stiffening: 1.0, ..SkeletonDesc::default() };
    world.create_skeleton(link, desc).unwrap();
    body
}

const SLOPE: f64 = 10.0;

/// The mesh of a body as contacts deform it, with pressures.
fn pressed(world: &World, body: BodyId) -> (Mesh, Vec<f64>) {
    let mesh = world.mesh(body, &MeshDesc { cell_size: T / 16.0, deformation: Deformation::Contact }).unwrap();
    let mut pressures = Vec::new();
    world.mesh_pressures(body, &mesh.positions, &mut pressures).unwrap();
    assert_eq!(pressures.len(), mesh.positions.len());
    (mesh, pressures)
}

/// The force along x that pressures at the vertices come to.
fn force_along_x(mesh: &Mesh, pressures: &[f64]) -> f64 {
    let each = mesh.triangles.iter().map(|t| {
        let mean = t.iter().map(|v| pressures[*v as usize]).sum::<f64>() / 3.0;
        -0.5 * area(mesh, t).x * mean
    });
    each.sum()
}

#[test]
fn pressures_of_two_balls_are_those_of_the_closed_form_on_the_disc_and_nothing_outside() {
    let (apart, stiffness) = (0.15, 2e4);
    let mut world = world();
    let soft = BodyDesc { stiffness_scale: stiffness, ..BodyDesc::default() };
    let a = linear_ball(&mut world, soft.clone(), 0.0);
    linear_ball(&mut world, soft, apart);
    let (mesh, pressures) = pressed(&world, a);
    let half = 0.5 * apart;
    let disc = (T * T - half * half).sqrt();
    let (mut on, mut worst) = (0, 0.0_f64);
    for ([x, y, z], pressure) in mesh.positions.iter().zip(&pressures) {
        let off_axis = y.hypot(*z);
        if off_axis > disc * (1.0 + 5e-3) || *x < 0.0 {
            assert_eq!(*pressure, 0.0, "{x} {off_axis}");
        } else if off_axis < disc {
            on += 1;
            worst = worst.max((pressure - stiffness * SLOPE * (T - half.hypot(off_axis))).abs());
        }
    }
    let most = stiffness * SLOPE * (T - half);
    let whole = std::f64::consts::TAU * stiffness * SLOPE * (T * disc * disc / 2.0 - (T.powi(3) - half.powi(3)) / 3.0);
    let force = force_along_x(&mesh, &pressures);
    println!(
        "{on} vertices on the disc, pressures off by {:.1e} of the highest, their force by {:.1e}",
        worst / most,
        force / whole + 1.0
    );
    assert!(on > 100 && worst < 1e-3 * most, "{on} {worst}");
    assert!((force / whole + 1.0).abs() < 0.02, "{force} {whole}");
}

#[test]
fn a_rigid_ball_has_the_pressure_of_what_presses_on_it() {
    let (apart, stiffness) = (0.17, 3e4);
    let mut world = world();
    let soft = linear_ball(&mut world, BodyDesc { stiffness_scale: stiffness, ..BodyDesc::default() }, 0.0);
    let rigid = linear_ball(&mut world, BodyDesc { rigid: true, ..BodyDesc::default() }, apart);
    let near = |x: f64, y: f64, z: f64| T - (x * x + y * y + z * z).sqrt();
    for body in [soft, rigid] {
        let (mesh, pressures) = pressed(&world, body);
        let mut on = 0;
        for ([x, y, z], pressure) in mesh.positions.iter().zip(&pressures) {
            // How deep it is in either ball: the contact surface is that of the rigid one.
            let (own, other) = (near(*x, *y, *z), near(x - apart, *y, *z));
            let expected = if own > 0.0 && other > -1e-4 * T { stiffness * SLOPE * own } else { 0.0 };
            assert!((pressure - expected).abs() < 1e-3 * stiffness * SLOPE * T, "{x} {y} {z}: {pressure} {expected}");
            on += usize::from(*pressure > 0.0);
        }
        assert!(on > 40, "{on}");
    }
    world.set_body_enabled(rigid, false).unwrap();
    let (_, alone) = pressed(&world, soft);
    assert!(alone.iter().all(|pressure| *pressure == 0.0));
}

#[test]
fn what_has_no_surface_or_no_bounds_says_so() {
    let mut world = world();
    let empty = world.create_body(BodyDesc::default()).unwrap();
    assert_eq!(world.mesh(empty, &MeshDesc::new(0.1)).unwrap(), Mesh::default());
    let ball = add(&mut world, BodyDesc::default(), &[(Shape::Point(Vec3::zeros()), T)], Pose::default());
    let mut mesh = world.mesh(ball, &MeshDesc::new(0.05)).unwrap();
    let before = mesh.clone();
    for (cell, text) in
        [(0.0, "cell_size is 0;"), (f64::NAN, "NaN"), (-1.0, "-1"), (1e-7, "0.0000001 for a coat of 0.4")]
    {
        let error = world.mesh_into(ball, &MeshDesc::new(cell), &mut MeshWorkspace::default(), &mut mesh).unwrap_err();
        assert!(error.to_string().contains(text), "{error}");
    }
    // Not too many bricks in the bounds, but too many with surface.
    let half = Vec3::repeat(0.5);
    let cube = Shape::Box { center: half, half, axes: isocoat::math::Mat3::identity() };
    let cube = add(&mut world, BodyDesc::default(), &[(cube, 0.01)], Pose::default());
    let error = world.mesh_into(cube, &MeshDesc::new(8.2e-4), &mut MeshWorkspace::default(), &mut mesh).unwrap_err();
    assert!(error.to_string().contains("too small"), "{error}");
    assert_eq!(mesh, before);
    let plane = Shape::Plane { point: Vec3::zeros(), normal: Vec3::z() };
    let floor = add(&mut world, BodyDesc::default(), &[(plane, T)], Pose::default());
    assert!(world.mesh(floor, &MeshDesc::new(0.1)).unwrap_err().to_string().contains("plane"));
    let huge = world.mesh(ball, &MeshDesc::new(1e8)).unwrap();
    assert_watertight(&huge, "cells much larger than the body");
}

#[test]
fn territories_are_their_seeds_joined_the_same_way_wherever_links_go() {
    let mut world = world();
    let shapes = [
        Shape::Point(Vec3::new(0.0, 0.1, 0.0)),
        Shape::segment(Vec3::zeros(), Vec3::new(0.2, 0.0, 0.0)),
        Shape::triangle(Vec3::zeros(), Vec3::new(0.0, 0.3, 0.0), Vec3::new(0.0, 0.1, 0.3)),
        Shape::Box { center: Vec3::zeros(), half: Vec3::new(0.1, 0.05, 0.02), axes: isocoat::math::Mat3::identity() },
    ];
    let body = world.create_body(BodyDesc::default()).unwrap();
    let mut skeletons = Vec::new();
    for (index, shape) in shapes.iter().enumerate() {
        let pose = Pose::at(0.15 * index as f64, 0.0, 0.0);
        let link = world.create_link(body, LinkDesc { pose, ..LinkDesc::default() }).unwrap();
        let desc = SkeletonDesc { shape: *shape, thickness: T, seed_count: 200, ..SkeletonDesc::default() };
        skeletons.push((link, world.create_skeleton(link, desc).unwrap()));
    }
    for (link, skeleton) in skeletons {
        let before = world.territory_mesh(skeleton, TerritoryStyle::Patches).unwrap();
        assert_watertight(&before, "patch");
        let seeds = world.seeds(skeleton).unwrap();
        assert!(before.positions.iter().zip(&seeds).all(|(p, seed)| Vec3::from(*p) == seed.position));
        assert!(before.valid.iter().zip(&seeds).all(|(valid, seed)| *valid == seed.valid));
        assert!(before.valid.contains(&false) && before.valid.contains(&true));
        let mut state = world.link_state(link).unwrap();
        state.pose.position.z += 0.05;
        world.set_link_state(link, &state).unwrap();
        let after = world.territory_mesh(skeleton, TerritoryStyle::Patches).unwrap();
        assert!(after.triangles == before.triangles && after.positions != before.positions);
        let scales = world.territory_mesh(skeleton, TerritoryStyle::Scales).unwrap();
        assert_eq!((scales.positions.len(), scales.triangles.len()), (6 * seeds.len(), 4 * seeds.len()));
        for t in &scales.triangles {
            assert!(area(&scales, t).dot(&Vec3::from(scales.normals[t[0] as usize])) >= 0.0);
        }
    }
}
