//! Coats from meshes. Figures: `cargo test --release --test fit -- --nocapture`; those of a bunny: `make fit`.

mod common;

use std::time::Instant;

use common::Random;
use isocoat::World;
use isocoat::base::Kind;
use isocoat::coat::Coat;
use isocoat::error::Error;
use isocoat::field::{Placed, Profile, Shape};
use isocoat::math::{Pose, Vec3, rotation_from_vector};
use isocoat::substance::fill;
use isocoat::surface::fit::{Target, measure};
use isocoat::world::fit::{Bones, Fit, FitDesc, Primitive, fit};
use isocoat::world::mesh::MeshDesc;
use isocoat::world::{BodyDesc, BodyId, LinkDesc, LinkId, SkeletonDesc, WorldDesc};

/// A closed mesh of triangles, counterclockwise from outside.
#[derive(Clone, Debug, PartialEq)]
struct Closed {
    vertices: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Closed {
    fn fit(&self, primitive: Primitive, count: u32) -> Fit {
        fit(&self.vertices, &self.triangles, None, &FitDesc { primitive, count, width: 0.0 }).unwrap()
    }

    /// Why it is refused.
    fn refused(&self) -> String {
        match fit(&self.vertices, &self.triangles, None, &FitDesc::default()).unwrap_err() {
            error @ (Error::OutOfRange { .. } | Error::Unsupported(_)) => error.to_string(),
            other => panic!("{other:?}"),
        }
    }

    fn corners(&self) -> impl Iterator<Item = [Vec3; 3]> + '_ {
        self.triangles.iter().map(|triangle| triangle.map(|corner| Vec3::from(self.vertices[corner as usize])))
    }

    fn moved(&self, scale: f64, turn: Vec3, shift: Vec3) -> Self {
        let rotation = rotation_from_vector(&turn);
        let vertices = self.vertices.iter().map(|p| (rotation * Vec3::from(*p) * scale + shift).into()).collect();
        Self { vertices, triangles: self.triangles.clone() }
    }
}

/// What the library makes of a coat of one skeleton.
fn mesh_of(shape: Shape, thickness: f64, cell: f64) -> Closed {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let (body, link) = body(&mut world, Pose::default());
    world.create_skeleton(link, SkeletonDesc { shape, thickness, ..SkeletonDesc::default() }).unwrap();
    let mesh = world.mesh(body, &MeshDesc::new(cell)).unwrap();
    Closed { vertices: mesh.positions, triangles: mesh.triangles }
}

fn body(world: &mut World, pose: Pose) -> (BodyId, LinkId) {
    let body = world.create_body(BodyDesc::default()).unwrap();
    let link = world.create_link(body, LinkDesc { kind: Kind::Host, pose, ..LinkDesc::default() }).unwrap();
    (body, link)
}

/// A torus round z.
fn torus(large: f64, small: f64, around: u32, across: u32) -> Closed {
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    let at = |i: u32, j: u32| (i % around) * across + j % across;
    for i in 0..around {
        for j in 0..across {
            let (u, v) = (f64::from(i) / f64::from(around), f64::from(j) / f64::from(across));
            let ((su, cu), (sv, cv)) = ((std::f64::consts::TAU * u).sin_cos(), (std::f64::consts::TAU * v).sin_cos());
            vertices.push([(large + small * cv) * cu, (large + small * cv) * su, small * sv]);
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    Closed { vertices, triangles }
}

/// A polygon in x and z, counterclockwise seen from -y, extruded along y; `caps` are triangles of its corners.
fn extruded(outline: &[[f64; 2]], caps: &[[u32; 3]], depth: f64) -> Closed {
    let count = outline.len() as u32;
    let side = |y: f64| outline.iter().map(move |[x, z]| [*x, y, *z]);
    let mut triangles: Vec<[u32; 3]> = caps.to_vec();
    triangles.extend(caps.iter().map(|[a, b, c]| [a + count, c + count, b + count]));
    for k in 0..count {
        let next = (k + 1) % count;
        triangles.extend([[k, k + count, next], [next, k + count, next + count]]);
    }
    Closed { vertices: side(0.0).chain(side(depth)).collect(), triangles }
}

fn cuboid(x: f64, y: f64, z: f64) -> Closed {
    extruded(&[[0.0, 0.0], [x, 0.0], [x, z], [0.0, z]], &[[0, 1, 2], [0, 2, 3]], y)
}

/// Two beams that meet at a right angle: along x below, and along z at its beginning.
fn corner() -> Closed {
    let outline = [[0.0, 0.0], [0.5, 0.0], [2.0, 0.0], [2.0, 0.5], [0.5, 0.5], [0.5, 2.0], [0.0, 2.0], [0.0, 0.5]];
    let caps = [[0, 1, 7], [1, 4, 7], [1, 2, 3], [1, 3, 4], [7, 4, 5], [7, 5, 6]];
    extruded(&outline, &caps, 0.5)
}

fn center(desc: &SkeletonDesc) -> Vec3 {
    desc.shape.middle()
}

#[test]
fn more_points_than_a_ball_needs_share_it() {
    let ball = mesh_of(Shape::Point(Vec3::zeros()), 1.0, 0.06);
    let fit = ball.fit(Primitive::Point, 64);
    let places: Vec<Vec3> = fit.skeletons.iter().map(center).collect();
    let pairs = || (0..64).flat_map(|i| (0..i).map(move |j| (i, j)));
    let least = pairs().map(|(i, j)| (places[i] - places[j]).norm()).fold(f64::INFINITY, f64::min);
    println!(
        "64 points: {:.2e} off on average, {:.2e} at most, {least:.2e} m apart at least",
        fit.mean_distance, fit.max_distance
    );
    assert!(fit.mean_distance < 5e-3 * fit.diagonal && fit.max_distance < 3e-2 * fit.diagonal);
    assert!(least > 1e-3, "those in one place would make the coat stiffer");
}

#[test]
fn a_width_is_never_more_than_the_diagonal() {
    // Shells in each other have much more surface than their bounds.
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for shell in 0..60 {
        let size = 1.0 - 1e-3 * f64::from(shell);
        let cube = cuboid(size, size, size).moved(1.0, Vec3::zeros(), Vec3::repeat(-0.5 * size));
        let first = vertices.len() as u32;
        vertices.extend(cube.vertices);
        triangles.extend(cube.triangles.iter().map(|corners| corners.map(|corner| corner + first)));
    }
    let fit = Closed { vertices, triangles }.fit(Primitive::Point, 1);
    assert!(fit.skeletons[0].radius - fit.skeletons[0].thickness <= fit.diagonal * (1.0 + 1e-12));
}

#[test]
fn one_point_finds_a_ball() {
    for (at, radius) in [(Vec3::zeros(), 1.0), (Vec3::new(3.0, -2.0, 5.0), 0.02)] {
        // The edges of the mesh lie a little within the ball.
        let cell = radius / 12.0;
        let found = mesh_of(Shape::Point(at), radius, cell).fit(Primitive::Point, 1);
        let [skeleton] = &found.skeletons[..] else { panic!("{found:?}") };
        let (away, off) = ((center(skeleton) - at).norm() / radius, skeleton.thickness / radius - 1.0);
        println!("centre off by {away:.1e} radii, radius by {off:.1e}; {:.1e}", found.mean_distance / radius);
        assert!(away < 1e-3 && off.abs() < 2e-3 && found.bones == [0]);
        assert!(found.mean_distance < 2e-3 * radius && found.max_distance < 5e-3 * radius);
    }
}

#[test]
fn one_segment_finds_a_capsule() {
    let (a, b, radius) = (Vec3::new(0.1, 0.2, 0.3), Vec3::new(0.9, -0.2, 1.1), 0.25);
    let found = mesh_of(Shape::segment(a, b), radius, 0.02).fit(Primitive::Segment, 1);
    let [SkeletonDesc { shape: Shape::Segment(p, q), thickness, .. }] = found.skeletons[..] else {
        panic!("{found:?}")
    };
    let off = ((p - a).norm().max((q - b).norm())).min((p - b).norm().max((q - a).norm()));
    println!("ends off by {off:.1e}, radius by {:.1e}", thickness - radius);
    assert!(off < 5e-3 && (thickness - radius).abs() < 2e-3);
    assert!(found.max_distance < 5e-3);
}

/// Mean and largest distance from points spread over one mesh to another, by looking at all triangles.
fn brute_force(random: &mut Random, from: &Closed, to: &Closed) -> (f64, f64) {
    let area = |[a, b, c]: [Vec3; 3]| 0.5 * (b - a).cross(&(c - a)).norm();
    let all: f64 = from.corners().map(area).sum();
    let others: Vec<Shape> = to.corners().map(|[a, b, c]| Shape::triangle(a, b, c)).collect();
    let (mut sum, mut count, mut most, mut owed) = (0.0, 0.0, 0.0_f64, 0.0);
    for corners in from.corners() {
        owed += 800.0 * area(corners) / all;
        while owed > 0.0 {
            owed -= 1.0;
            let (u, v) = (random.unit(), random.unit());
            let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
            let p = corners[0] + (corners[1] - corners[0]) * u + (corners[2] - corners[0]) * v;
            let away = others.iter().map(|other| other.closest(&p).distance).fold(f64::INFINITY, f64::min);
            (sum, count, most) = (sum + away, count + 1.0, most.max(away));
        }
    }
    (sum / count, most)
}

#[test]
fn the_distance_told_is_that_of_brute_force() {
    let mut random = Random(3);
    for (name, mesh, count) in [
        ("torus", torus(1.0, 0.3, 30, 12), 40),
        ("box", cuboid(1.0, 0.7, 0.4), 60),
        ("corner", corner().moved(0.1, Vec3::new(0.3, 0.1, -0.7), Vec3::new(5.0, 6.0, 7.0)), 50),
    ] {
        for primitive in [Primitive::Point, Primitive::Segment] {
            let found = mesh.fit(primitive, count);
            let mut world = World::new(WorldDesc::default()).unwrap();
            let (body, link) = body(&mut world, Pose::default());
            world.create_fitted(&found, &[link], &Pose::default()).unwrap();
            let coat = world.mesh(body, &MeshDesc::new(found.diagonal / 100.0)).unwrap();
            let coat = Closed { vertices: coat.positions, triangles: coat.triangles };
            let there = brute_force(&mut random, &mesh, &coat);
            let back = brute_force(&mut random, &coat, &mesh);
            let (mean, most) = (0.5 * (there.0 + back.0), there.1.max(back.1));
            let relative = |x: f64| 100.0 * x / found.diagonal;
            println!(
                "{name}, {count} {primitive:?}: mean {:.3} % (told {:.3}), largest {:.2} % (told {:.2})",
                relative(mean),
                relative(found.mean_distance),
                relative(most),
                relative(found.max_distance)
            );
            assert!((mean / found.mean_distance - 1.0).abs() < 0.1);
            // Chance hardly meets the farthest point.
            assert!(most < 1.02 * found.max_distance && most > 0.4 * found.max_distance);
            assert!(relative(mean) < 0.6);
        }
    }
}

#[test]
fn more_skeletons_come_closer() {
    for primitive in [Primitive::Point, Primitive::Segment] {
        for (name, mesh) in [("torus", torus(1.0, 0.3, 60, 24)), ("box", cuboid(1.0, 0.7, 0.4))] {
            let means = [5, 20, 80].map(|count| {
                let found = mesh.fit(primitive, count);
                assert!(found.skeletons.len() == count as usize && found.bones == vec![0; count as usize]);
                100.0 * found.mean_distance / found.diagonal
            });
            println!("{name}, {primitive:?}: mean {means:.3?} % of the diagonal");
            assert!(means.windows(2).all(|pair| pair[1] < 1.1 * pair[0]) && means[2] < 0.3 * means[0]);
        }
    }
}

fn width(found: &Fit) -> f64 {
    found.skeletons[0].radius - found.skeletons[0].thickness
}

/// The slope of the summed field on its surface over `2 c / width`: of a twentieth of the surface less, of half, of a
/// twentieth more than these.
fn slopes(found: &Fit, cell: f64) -> [f64; 3] {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let (body, link) = body(&mut world, Pose::default());
    world.create_fitted(found, &[link], &Pose::default()).unwrap();
    let skin = world.mesh(body, &MeshDesc::new(cell)).unwrap();
    let mut slopes = vec![[0.0; 3]; skin.positions.len()];
    world.evaluate_field(body, &skin.positions, None, Some(&mut slopes)).unwrap();
    let mut slopes: Vec<f64> = slopes.iter().map(|slope| 0.5 * width(found) * Vec3::from(*slope).norm()).collect();
    slopes.sort_by(f64::total_cmp);
    [0.05, 0.5, 0.95].map(|part| slopes[(part * slopes.len() as f64) as usize])
}

#[test]
fn the_coat_is_as_soft_everywhere() {
    let mesh = corner();
    let found = mesh.fit(Primitive::Point, 100);
    let width = width(&found);
    let [low, middle, high] = slopes(&found, 0.03);
    println!("slope over 2 c / width: {low:.2} {middle:.2} {high:.2}");
    assert!(low > 0.5 && high < 2.0);
    for skeleton in &found.skeletons {
        let ratio = skeleton.radius / skeleton.thickness;
        assert!(ratio > 1.0 && ratio < 4.0 + 1e-9 && (skeleton.radius - skeleton.thickness - width).abs() < 1e-12);
    }
}

#[test]
fn a_width_that_is_asked_for_is_kept() {
    let mesh = cuboid(1.0, 0.7, 0.4);
    let desc = FitDesc { count: 30, width: 0.1, ..FitDesc::default() };
    let found = fit(&mesh.vertices, &mesh.triangles, None, &desc).unwrap();
    assert!(found.skeletons.iter().all(|desc| (desc.radius - desc.thickness - 0.1).abs() < 1e-12));
    for width in [-1.0, 1e-9, 1e3, f64::NAN] {
        let error = fit(&mesh.vertices, &mesh.triangles, None, &FitDesc { width, ..desc }).unwrap_err().to_string();
        assert!(error.contains("width over the diagonal") && error.contains("from 1e-3 to 1"), "{error}");
    }
}

#[test]
fn the_same_mesh_gives_the_same_bits_at_every_power_of_two() {
    let mesh = torus(1.0, 0.3, 40, 16);
    let found = mesh.fit(Primitive::Point, 30);
    assert_eq!(mesh.fit(Primitive::Point, 30), found);
    for scale in [1.0 / 1024.0, 1024.0] {
        let other = mesh.moved(scale, Vec3::zeros(), Vec3::zeros()).fit(Primitive::Point, 30);
        assert_eq!(other.mean_distance, scale * found.mean_distance);
        for (own, other) in found.skeletons.iter().zip(&other.skeletons) {
            assert!(other.thickness == scale * own.thickness && center(other) == center(own) * scale);
        }
    }
    for (scale, turn) in [(1e-3, 0.0), (1e3, 0.0), (1e-3, 1.0), (7.0, 2.0)] {
        let moved = mesh.moved(scale, Vec3::new(turn, 0.3 * turn, -turn), Vec3::new(3.0, 4.0, -1.0) * scale);
        let other = moved.fit(Primitive::Point, 30);
        let ratio = other.mean_distance / (scale * found.mean_distance);
        println!("{scale} times as large, turned by {turn}: mean distance {ratio:.3} times as large");
        assert!((0.7..1.4).contains(&ratio));
    }
}

#[test]
fn vertices_split_along_seams_are_one() {
    let mesh = cuboid(1.0, 0.7, 0.4);
    let corners: Vec<[f64; 3]> = mesh.corners().flatten().map(Into::into).collect();
    let triangles = (0..corners.len() as u32 / 3).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    let split = Closed { vertices: corners, triangles };
    assert_eq!(split.fit(Primitive::Point, 12).mean_distance, mesh.fit(Primitive::Point, 12).mean_distance);
}

#[test]
fn each_bone_gets_skeletons_in_its_own_part() {
    let mesh = corner();
    // Bone 4 has the beam along x, bone 7 the one along z; where they meet, both have their part.
    let share = |[x, _, z]: &[f64; 3]| {
        if x > z {
            [0.8, 0.2]
        } else if z > x {
            [0.1, 0.9]
        } else {
            [0.5, 0.5]
        }
    };
    let weights: Vec<f64> = mesh.vertices.iter().flat_map(share).collect();
    let numbers: Vec<u32> = mesh.vertices.iter().flat_map(|_| [4, 7]).collect();
    let bones = Bones { per_vertex: 2, bones: &numbers, weights: &weights };
    let alone = mesh.fit(Primitive::Point, 60);
    for primitive in [Primitive::Point, Primitive::Segment] {
        let desc = FitDesc { primitive, count: 60, width: 0.0 };
        let found = fit(&mesh.vertices, &mesh.triangles, Some(&bones), &desc).unwrap();
        let of = |bone: u32| found.bones.iter().filter(|other| **other == bone).count();
        println!(
            "{primitive:?}: {} and {}, mean {:.2e} ({:.2e})",
            of(4),
            of(7),
            found.mean_distance,
            alone.mean_distance
        );
        assert!(of(4) + of(7) == 60 && of(4) > 20 && of(7) > 20);
        assert!(found.mean_distance < 2.0 * alone.mean_distance);
        for (desc, bone) in found.skeletons.iter().zip(&found.bones) {
            let ends = match desc.shape {
                Shape::Segment(a, b) => [a, b],
                _ => [center(desc); 2],
            };
            for end in ends {
                // Inside, and on its side of the diagonal, where neither has more weight than the other.
                assert!(fill::winds_round(
                    &mesh.vertices,
                    &mesh.triangles,
                    &(end + (Vec3::new(0.25, 0.25, 0.25) - end) * 1e-6)
                ));
                let side = if *bone == 4 { end.x - end.z } else { end.z - end.x };
                assert!(side > -0.2, "bone {bone} at {end}");
            }
        }
        // On links that stand elsewhere, the coat is where the mesh is in the world.
        let mut world = World::new(WorldDesc::default()).unwrap();
        let frame =
            Pose { position: Vec3::new(1.0, 2.0, 3.0), rotation: rotation_from_vector(&Vec3::new(0.4, 1.0, 0.2)) };
        let (body, first) = body(&mut world, Pose::at(0.0, 5.0, 0.0));
        let second = world.create_link(body, LinkDesc { pose: frame, ..LinkDesc::default() }).unwrap();
        let mut links = vec![first; 8];
        links[7] = second;
        assert_eq!(
            world.create_fitted(&found, &links[..7], &frame).unwrap_err().to_string().split(';').next().unwrap(),
            "bone of a skeleton is 7"
        );
        assert_eq!(world.link_skeletons(first).unwrap().count(), 0);
        world.create_fitted(&found, &links, &frame).unwrap();
        assert_eq!(world.link_skeletons(second).unwrap().count(), of(7));
        let target = Target::new(&mesh.vertices, &mesh.triangles, None).unwrap();
        for p in target.corners().map(|p| target.origin + p * target.diagonal).step_by(3) {
            let hit = world.closest_point(body, &frame.transform_point(&p)).unwrap().unwrap();
            assert!(hit.distance.abs() <= found.max_distance * (1.0 + 1e-6), "{} {}", hit.distance, found.max_distance);
        }
    }
    let few = FitDesc { count: 1, ..FitDesc::default() };
    let error = fit(&mesh.vertices, &mesh.triangles, Some(&bones), &few).unwrap_err().to_string();
    assert_eq!(error, "count is 1 for 2 bones; must be at least the number of bones that have a part of the surface");
    let refused = |per_vertex: usize, bones: &[u32], weights: &[f64]| {
        let bones = Bones { per_vertex, bones, weights };
        fit(&mesh.vertices, &mesh.triangles, Some(&bones), &FitDesc::default()).unwrap_err().to_string()
    };
    assert!(refused(2, &numbers[1..], &weights).contains("number of bones is 31 with 32 weights for 16 vertices"));
    assert!(refused(0, &[], &[]).contains("bones per vertex is 0; must be at least 1"));
    let mut bad = weights.clone();
    bad[5] = -0.25;
    assert!(refused(2, &numbers, &bad).contains("weight of a bone is -0.25 (vertex 2); must be from 0"));
    bad[4..6].fill(0.0);
    assert!(refused(2, &numbers, &bad).contains("weight of a bone is 0 (vertex 2); must be > 0"));
}

#[test]
fn meshes_that_enclose_nothing_are_refused_with_their_fault() {
    let mesh = torus(1.0, 0.3, 12, 8);
    let with = |change: &dyn Fn(&mut Closed)| {
        let mut mesh = mesh.clone();
        change(&mut mesh);
        mesh.refused()
    };
    let says = |text: String, parts: &[&str]| assert!(parts.iter().all(|part| text.contains(part)), "{text}");
    says(with(&|mesh| mesh.vertices[3][1] = f64::NAN), &["vertex of the mesh is", "NaN", "(number 3)", "finite"]);
    says(with(&|mesh| mesh.vertices[3][1] = f64::INFINITY), &["vertex of the mesh is", "inf", "(number 3)"]);
    says(with(&|mesh| mesh.triangles[5][2] = 96), &["corner of a triangle of the mesh is 96", "number of vertices"]);
    says(with(&|mesh| mesh.triangles.clear()), &["no triangles"]);
    says(with(&|mesh| mesh.triangles.truncate(3)), &["number of triangles with an area is 3", "at least 4"]);
    // Open.
    says(with(&|mesh| mesh.triangles.truncate(191)), &["an edge of the mesh is run 0 times", "1 times back", "closed"]);
    // One triangle turned round.
    says(with(&|mesh| mesh.triangles[7].swap(0, 1)), &["an edge of the mesh is run", "all turn one way"]);
    // A fin on an edge.
    says(with(&|mesh| mesh.triangles.push([0, 9, 50])), &["an edge of the mesh is run", "run once each way"]);
    // Inside out, and flat.
    says(with(&|mesh| mesh.triangles.iter_mut().for_each(|t| t.swap(0, 1))), &["volume of the mesh is -", "> 0"]);
    says(with(&|mesh| mesh.vertices.iter_mut().for_each(|p| p[2] *= 1e-9)), &["volume of the mesh", "at least"]);
    says(with(&|mesh| mesh.vertices.fill([1.0; 3])), &["diagonal of the mesh is 0", "from 1e-9"]);
    for count in [0, 4097] {
        let desc = FitDesc { count, ..FitDesc::default() };
        says(
            fit(&mesh.vertices, &mesh.triangles, None, &desc).unwrap_err().to_string(),
            &["count is", "from 1 to 4096"],
        );
    }
}

/// The coat of a lattice of equal balls that fills a mesh, as many as asked for, with the thickness that comes closest.
fn lattice(mesh: &Closed, count: usize) -> (usize, measure::Distance) {
    let target = Target::new(&mesh.vertices, &mesh.triangles, None).unwrap();
    let vertices: Vec<[f64; 3]> =
        mesh.vertices.iter().map(|p| ((Vec3::from(*p) - target.origin) / target.diagonal).into()).collect();
    let inside = |p: &Vec3| fill::winds_round(&vertices, &mesh.triangles, p);
    let half = Vec3::repeat(0.5);
    let (mut small, mut large) = (0.02, 0.2);
    for _ in 0..20 {
        let middle = 0.5 * (small + large);
        let many = fill::packed(middle, &-half, &half, inside).len() > count;
        (small, large) = if many { (middle, large) } else { (small, middle) };
    }
    let balls = fill::packed(large, &-half, &half, inside);
    let of = |thickness: f64| {
        let mut coat = Coat::new(Vec3::zeros(), 1.0);
        let profile = Profile::new(1.0, thickness, 0.0, 1.0, 0.0, false).unwrap();
        coat.skeletons.extend(balls.iter().map(|ball| Placed { shape: Shape::Point(*ball), profile }));
        measure::distance(&target, coat, large).unwrap()
    };
    let each = (4..=14).map(|k| of(0.05 * f64::from(k) * large));
    (balls.len(), each.min_by(|a, b| a.mean.total_cmp(&b.mean)).unwrap())
}

/// The numbers after a word in each line of an OBJ.
fn lines<T: std::str::FromStr>(text: &str, word: &str) -> Vec<[T; 3]> {
    let of = text.lines().filter_map(|line| line.strip_prefix(word)?.strip_prefix(' '));
    let number = |text: &str| text.split('/').next().and_then(|number| number.parse().ok());
    of.map(|line| line.split_whitespace().filter_map(number).collect::<Vec<T>>().try_into().ok().expect(line)).collect()
}

#[test]
#[ignore = "needs a mesh: make fit"]
fn figures_of_a_mesh() {
    let path = std::env::var("ISOCOAT_FIT_MESH").expect("ISOCOAT_FIT_MESH names an OBJ of triangles");
    let text = std::fs::read_to_string(&path).expect("readable");
    let triangles = lines::<u32>(&text, "f").into_iter().map(|corners| corners.map(|corner| corner - 1)).collect();
    let mesh = Closed { vertices: lines(&text, "v"), triangles };
    println!("{path}: {} vertices, {} triangles", mesh.vertices.len(), mesh.triangles.len());
    println!("distances from either surface to the other, over the diagonal; one thread\n");
    let row = |name: &str, mean: f64, most: f64, seconds: f64| {
        println!("{name:34} mean {:.3} %   maximum {:.2} %   {seconds:.1} s", 100.0 * mean, 100.0 * most);
    };
    let start = Instant::now();
    let (count, equal) = lattice(&mesh, 200);
    row(&format!("a lattice of {count} equal balls"), equal.mean, equal.maximum, start.elapsed().as_secs_f64());
    for (primitive, name) in [(Primitive::Point, "points"), (Primitive::Segment, "segments")] {
        for count in [50, 100, 200, 400] {
            let start = Instant::now();
            let found = mesh.fit(primitive, count);
            let seconds = start.elapsed().as_secs_f64();
            let (mean, most) = (found.mean_distance / found.diagonal, found.max_distance / found.diagonal);
            row(&format!("{count} fitted {name}"), mean, most, seconds);
            if count == 200 {
                let [low, middle, high] = slopes(&found, found.diagonal / 128.0);
                println!("    slope over 2 c / width: {low:.2} {middle:.2} {high:.2}");
                assert!(mean < 0.5e-2 && most < 3e-2 && seconds < 30.0);
                assert!(mean < 0.5 * equal.mean && most < 0.5 * equal.maximum);
            }
        }
    }
    // The width that goes with the number is 0.3 of this one.
    let area: f64 = mesh.corners().map(|[a, b, c]| 0.5 * (b - a).cross(&(c - a)).norm()).sum();
    for relative in [0.2, 0.3, 0.45, 0.7] {
        let width = relative * (area / 200.0).sqrt();
        let desc = FitDesc { primitive: Primitive::Point, count: 200, width };
        let start = Instant::now();
        let found = fit(&mesh.vertices, &mesh.triangles, None, &desc).unwrap();
        let (mean, most) = (found.mean_distance / found.diagonal, found.max_distance / found.diagonal);
        row(&format!("200 fitted points, width {relative}"), mean, most, start.elapsed().as_secs_f64());
    }
}
