//! Contacts with flat faces and straight edges: errors, their estimates, and cost, over random poses.

mod common;

use std::sync::Arc;

use common::{Coat, Random};
use isocoat::contact::pair::{Pair, Side};
use isocoat::contact::surface::{Settings, Surface, integrate};
use isocoat::field::{Placed, Profile, Shape};
use isocoat::math::{Pose, Vec3, rotation_from_vector};
use isocoat::world::Scheme;

/// A coat in place, its profile stiffening by `stiffening`.
fn side(coat: &Coat, pose: &Pose, stiffening: f64) -> Side {
    let mut side = Side { isovalue: 1.0, stiffness_scale: coat.stiffness_scale, rigid: coat.rigid, ..Side::default() };
    for shape in &coat.shapes {
        let stiffness = 2.0 / (coat.radius - coat.thickness);
        let profile = Profile::new(1.0, coat.thickness, stiffness, stiffening, coat.radius, shape.is_solid()).unwrap();
        side.skeletons.push(Placed { shape: shape.transformed(pose), profile });
        side.locals.push(*shape);
        side.reach.push(coat.thickness * 1.5);
        side.rays.push(Arc::from([]));
        side.poses.push(*pose);
        side.ids.push(0);
        side.links.push(0);
    }
    side
}

struct Scene {
    name: &'static str,
    a: Coat,
    b: Coat,
    stiffening: f64,
    place: fn(&mut Random) -> (Pose, Pose),
}

/// Two coats in place.
fn pair_of(a: (&Coat, &Pose), b: (&Coat, &Pose), stiffening: f64) -> Pair {
    let mut pair = Pair::default();
    pair.a = side(a.0, a.1, stiffening);
    pair.b = side(b.0, b.1, stiffening);
    pair.prepare();
    pair
}

/// What a query comes to.
struct Outcome {
    force: Vec3,
    estimate: f64,
    evaluations: f64,
    nodes: f64,
    /// All patches were integrated by facets.
    facets: bool,
}

fn run(pair: &Pair, tolerance: f64) -> Outcome {
    let mut surface = Surface::default();
    integrate(pair, &Settings { scheme: Scheme::Auto, tolerance }, &mut surface);
    Outcome {
        force: surface.nodes.iter().map(|node| node.force).sum(),
        estimate: surface.patches.iter().map(|patch| patch.error_estimate).fold(0.0, f64::max),
        evaluations: f64::from(surface.evaluations),
        nodes: surface.nodes.len() as f64,
        facets: surface.patches.iter().all(|patch| patch.scheme == Scheme::Facets),
    }
}

fn turned(random: &mut Random, lean: f64, spin: f64) -> isocoat::math::Quat {
    let flat = rotation_from_vector(&Vec3::new(0.0, 0.0, random.range(-spin, spin)));
    // From a hair to the full lean.
    let lean = lean * libm::pow(10.0, random.range(-3.0, 0.0));
    let angle = random.range(-std::f64::consts::PI, std::f64::consts::PI);
    rotation_from_vector(&Vec3::new(lean * libm::cos(angle), lean * libm::sin(angle), 0.0)) * flat
}

fn segment() -> Coat {
    Coat::new(&[Shape::Segment(Vec3::new(-0.3, 0.0, 0.0), Vec3::new(0.3, 0.0, 0.0))], 0.1)
}

fn cuboid() -> Coat {
    Coat::cuboid(Vec3::new(0.2, 0.15, 0.1), 0.05)
}

fn triangle() -> Coat {
    Coat::new(&[Shape::Triangle(Vec3::new(-0.3, -0.2, 0.0), Vec3::new(0.3, -0.2, 0.0), Vec3::new(0.0, 0.4, 0.0))], 0.1)
}

/// On the floor, its deepest point a random depth below.
fn on_floor(random: &mut Random, lean: f64, coat: &Coat, tip: Vec3) -> (Pose, Pose) {
    let rotation = turned(random, lean, 3.0) * rotation_from_vector(&tip);
    let points: Vec<Vec3> = match coat.shapes[0] {
        Shape::Box { half, .. } => {
            (0..8).map(|k| Vec3::from_fn(|i, _| if k >> i & 1 == 1 { half[i] } else { -half[i] })).collect()
        }
        Shape::Segment(a, b) => vec![a, b],
        Shape::Triangle(a, b, c) => vec![a, b, c],
        _ => vec![Vec3::zeros()],
    };
    let lowest = points.iter().map(|p| (rotation * p).z).fold(f64::INFINITY, f64::min);
    let overlap = coat.thickness * random.range(0.02, 0.3);
    let position = Vec3::new(random.range(-1.0, 1.0), 0.0, 0.1 + coat.thickness - lowest - overlap);
    (Pose::default(), Pose { position, rotation })
}

fn scenes() -> Vec<Scene> {
    let floor = || Coat::floor(0.1);
    let scene = |name, a, b, place| Scene { name, a, b, stiffening: 1.0, place };
    let box_flat: fn(&mut Random) -> (Pose, Pose) = |random| on_floor(random, 1e-3, &cuboid(), Vec3::zeros());
    let box_leaning: fn(&mut Random) -> (Pose, Pose) = |random| on_floor(random, 0.2, &cuboid(), Vec3::zeros());
    let stacked: fn(&mut Random) -> (Pose, Pose) = |random| {
        let rotation = turned(random, 0.02, 1.5);
        let z = 0.3 - random.range(0.005, 0.02);
        (Pose::default(), Pose { position: Vec3::new(random.range(-0.2, 0.2), random.range(-0.2, 0.2), z), rotation })
    };
    let mut scenes = vec![
        scene("box flat on plane", floor(), cuboid().stiff(3e5), box_flat),
        scene("box leaning on plane", floor(), cuboid(), box_leaning),
        scene("box on hard plane", floor().hard(), cuboid(), box_leaning),
        scene("hard box on plane", floor(), cuboid().hard(), box_leaning),
        scene("box edge on plane", floor(), cuboid(), |random| {
            on_floor(random, 0.1, &cuboid(), Vec3::new(0.8, 0.0, 0.0))
        }),
        scene("segment on plane", floor(), segment(), |random| on_floor(random, 0.2, &segment(), Vec3::zeros())),
        scene("triangle on plane", floor(), triangle(), |random| on_floor(random, 0.2, &triangle(), Vec3::zeros())),
        scene("box on box, square", cuboid(), cuboid().stiff(2e5), |random| {
            let z = 0.3 - random.range(0.005, 0.02);
            let rotation = turned(random, 0.02, 1e-3);
            (
                Pose::default(),
                Pose { position: Vec3::new(random.range(-0.2, 0.2), random.range(-0.2, 0.2), z), rotation },
            )
        }),
        scene("box on box, turned", cuboid(), cuboid().stiff(2e5), stacked),
        scene("segment on box", cuboid(), segment(), |random| {
            let rotation = turned(random, 0.05, 3.0);
            let z = 0.25 - random.range(0.005, 0.03);
            (
                Pose::default(),
                Pose { position: Vec3::new(random.range(-0.2, 0.2), random.range(-0.1, 0.1), z), rotation },
            )
        }),
        scene("segments side by side", segment(), segment().stiff(3e5), |random| {
            let rotation = turned(random, 0.05, 0.2);
            let z = 0.2 - random.range(0.005, 0.03);
            (
                Pose::default(),
                Pose { position: Vec3::new(random.range(-0.4, 0.4), random.range(-0.05, 0.05), z), rotation },
            )
        }),
        scene("box edge on box", cuboid(), cuboid().stiff(2e5), |random| {
            let rotation = turned(random, 0.05, 3.0) * rotation_from_vector(&Vec3::new(0.8, 0.0, 0.0));
            let lowest = 0.15 * libm::sin(0.8) + 0.1 * libm::cos(0.8);
            let z = 0.2 + lowest - random.range(0.01, 0.02);
            (
                Pose::default(),
                Pose { position: Vec3::new(random.range(-0.1, 0.1), random.range(-0.1, 0.1), z), rotation },
            )
        }),
    ];
    scenes.push(Scene {
        name: "stiffening box on plane",
        stiffening: 3.0,
        ..scene("", floor(), cuboid(), box_leaning)
    });
    scenes.push(Scene { name: "stiffening boxes", stiffening: 2.0, ..scene("", cuboid(), cuboid(), stacked) });
    scenes
}

/// Worst and mean figures of a scene at a tolerance.
#[derive(Default)]
struct Figures {
    errors: Vec<f64>,
    bounded: f64,
    evaluations: Vec<f64>,
    nodes: Vec<f64>,
    facets: f64,
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn most(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}

#[test]
fn faces_and_edges_meet_the_tolerance_in_few_evaluations() {
    println!(
        "pair, tolerance: mean and worst error; share bounded by the estimate; mean and most evaluations; mean and \
         most nodes; share by facets"
    );
    let mut failures = Vec::new();
    let (mut bounded, mut total) = (0.0, 0.0);
    for scene in scenes() {
        let plane = scene.name.contains("plane");
        let mut random = Random(23);
        // What errors are measured against: the finest that facets reach.
        let cases: Vec<(Pair, Outcome)> = (0..40)
            .filter_map(|_| {
                let poses = (scene.place)(&mut random);
                let pair = pair_of((&scene.a, &poses.0), (&scene.b, &poses.1), scene.stiffening);
                let finest = if plane { [1e-6, 1e-5] } else { [5e-5, 2e-4] };
                let fine = finest.into_iter().map(|t| run(&pair, t)).find(|fine| fine.facets)?;
                (fine.force.norm() > 0.0).then_some((pair, fine))
            })
            .collect();
        if cases.len() < 20 {
            failures.push(format!("{}: {} of 40 poses by facets", scene.name, cases.len()));
        }
        for tolerance in [5e-3, 5e-4] {
            let mut figures = Figures::default();
            for (pair, fine) in &cases {
                let got = run(pair, tolerance);
                let error = (got.force - fine.force).norm() / fine.force.norm();
                figures.errors.push(error);
                figures.bounded += f64::from(error <= got.estimate + fine.estimate);
                figures.evaluations.push(got.evaluations);
                figures.nodes.push(got.nodes);
                figures.facets += f64::from(got.facets);
            }
            let count = cases.len() as f64;
            println!(
                "{}, {tolerance:.0e}: {:.1e} {:.1e}; {:.0}%; {:.0} {:.0}; {:.0} {:.0}; {:.0}%",
                scene.name,
                mean(&figures.errors),
                most(&figures.errors),
                100.0 * figures.bounded / count,
                mean(&figures.evaluations),
                most(&figures.evaluations),
                mean(&figures.nodes),
                most(&figures.nodes),
                100.0 * figures.facets / count
            );
            bounded += figures.bounded;
            total += count;
            let (evaluations, nodes) = if tolerance > 1e-3 { (150.0, 100.0) } else { (400.0, 150.0) };
            let dear = mean(&figures.evaluations) > evaluations || most(&figures.nodes) > nodes;
            if most(&figures.errors) > tolerance || plane && dear {
                failures.push(format!("{} at {tolerance:.0e}", scene.name));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
    assert!(bounded >= 0.95 * total, "the estimate bounds {bounded} of {total}");
}

/// Force of a coat on a hard floor at a height, `∫ p dA` over a fine grid.
fn on_hard_floor(coat: &Coat, pose: &Pose, height: f64) -> f64 {
    let shape = coat.shapes[0].transformed(pose);
    let (low, high) = shape.bounds(coat.thickness);
    let n = 2000;
    let (dx, dy) = ((high.x - low.x) / n as f64, (high.y - low.y) / n as f64);
    let slope = 2.0 / (coat.radius - coat.thickness) * coat.stiffness_scale;
    let mut sum = 0.0;
    for i in 0..n {
        for j in 0..n {
            let p = Vec3::new(low.x + (i as f64 + 0.5) * dx, low.y + (j as f64 + 0.5) * dy, height);
            sum += (coat.thickness - shape.closest(&p).distance).max(0.0);
        }
    }
    sum * slope * dx * dy
}

#[test]
fn faces_on_a_hard_floor_agree_with_a_fine_grid() {
    let mut failures = Vec::new();
    for (name, coat, lean) in [("box", cuboid(), 0.2), ("segment", segment(), 0.2), ("triangle", triangle(), 0.1)] {
        let mut random = Random(5);
        for _ in 0..6 {
            let poses = on_floor(&mut random, lean, &coat, Vec3::zeros());
            let exact = on_hard_floor(&coat, &poses.1, 0.1);
            let pair = pair_of((&Coat::floor(0.1).hard(), &poses.0), (&coat, &poses.1), 1.0);
            for tolerance in [5e-2, 5e-3, 5e-4, 5e-5] {
                let got = run(&pair, tolerance);
                let error = (got.force.z / exact - 1.0).abs();
                let (estimate, evaluations) = (got.estimate, got.evaluations);
                println!("{name} {tolerance:.0e}: {error:.1e} (estimate {estimate:.1e}) {evaluations} evaluations");
                // The grid itself is good to 1e-6.
                if error > tolerance + 1e-6 || !got.facets {
                    failures.push(format!("{name} {tolerance:.0e}: {error:.1e}"));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn a_face_on_the_floor_does_not_notice_a_hair_of_tilt() {
    for size in [1e-4, 1.0, 1e4] {
        let box_of = |half: Vec3, thickness: f64| Coat::cuboid(half * size, thickness * size);
        let (floor, cuboid) = (Coat::floor(0.1 * size), box_of(Vec3::new(0.2, 0.15, 0.1), 0.05));
        let force = |tilt: f64, offset: f64| {
            let rotation = rotation_from_vector(&(Vec3::new(1.0, 0.7, 0.0) * tilt));
            let position = Vec3::new(0.0, 0.0, (0.245 + offset) * size);
            let pair = pair_of((&floor, &Pose::default()), (&cuboid, &Pose { position, rotation }), 1.0);
            let got = run(&pair, 5e-3);
            assert!(got.facets, "{size} {tilt}");
            got.force.z / (size * size)
        };
        let flat = force(0.0, 0.0);
        for exponent in -14..=-5 {
            let tilted = force(libm::pow(10.0, f64::from(exponent)), 0.0);
            assert!((tilted / flat - 1.0).abs() < 1e-7, "{size}: 1e{exponent}: {tilted} {flat}");
        }
        // A sweep: a pose further, the force is never off what its neighbours say by the tolerance.
        for (tilt, offset) in [(1e-3, 0.0), (0.0, 1e-4)] {
            let sweep: Vec<f64> = (0..40).map(|k| force(tilt * f64::from(k), -offset * f64::from(k))).collect();
            for at in sweep.windows(3) {
                let bend = at[0] - 2.0 * at[1] + at[2];
                assert!(bend.abs() < 5e-3 * at[1], "{size}: {at:?}");
            }
        }
    }
}

/// A bent limb comes closest to the floor at the far ends of its bones, and touches it at the joint too, where they
/// blend: bristles tell the two patches of one bone apart.
#[test]
fn two_patches_of_the_same_skeletons_have_names_of_their_own() {
    let bone = |x: f64| Shape::Segment(Vec3::zeros(), Vec3::new(x, 0.0, -0.028));
    let limb = Coat::new(&[bone(-0.4), bone(0.4)], 0.1);
    let pair = pair_of((&limb, &Pose::at(0.0, 0.0, 0.227)), (&Coat::floor(0.1), &Pose::default()), 1.0);
    let mut surface = Surface::default();
    integrate(&pair, &Settings { scheme: Scheme::Auto, tolerance: 5e-2 }, &mut surface);
    let mut names: Vec<_> = surface.patches.iter().map(|patch| (patch.skeletons, patch.ordinal)).collect();
    println!("{names:?}");
    assert_eq!(names.len(), 3, "both ends and the joint");
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), 3);
}
