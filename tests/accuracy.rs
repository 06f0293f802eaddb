//! Contact forces against closed forms and against brute force, for every scheme and tolerance.

mod common;

use common::oracle::Oracle;
use common::{Coat, Random, collide, collide_seeded, total};
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::world::Scheme;
use std::f64::consts::PI;

/// Force of two balls, or of a ball on a half-space, by fine quadrature of `π ρ²(p)` over the pressure: the formula of
/// [docs/model.md, "Closed form"], integrated without its shortcuts. `compliance` is `1/(K k)`, 0 for a rigid body.
fn round_force(ta: f64, ca: f64, tb: f64, cb: f64, plane: bool, d: f64) -> f64 {
    let peak = (ta + tb - d) / (ca + cb);
    let n = 2000;
    (0..n)
        .map(|i| {
            let p = (i as f64 + 0.5) / n as f64 * peak;
            let (ra, rb) = (ta - p * ca, tb - p * cb);
            let z = if plane { d - rb } else { (d * d + ra * ra - rb * rb) / (2.0 * d) };
            PI * (ra * ra - z * z) * peak / n as f64
        })
        .sum()
}

struct Round {
    name: &'static str,
    a: Coat,
    b: Coat,
    plane: bool,
}

fn rounds() -> Vec<Round> {
    let mut rounds = Vec::new();
    for (name, ratio) in [("K 1:1", 1.0), ("K 1:10", 10.0), ("K 1:100", 100.0)] {
        for size in [1.0, 2.0, 4.0] {
            let b = Coat::ball(0.1 * size).stiff(1e5 * ratio);
            rounds.push(Round { name, a: Coat::ball(0.1), b, plane: false });
        }
    }
    rounds.push(Round { name: "hard ball", a: Coat::ball(0.1), b: Coat::ball(0.2).hard(), plane: false });
    rounds.push(Round { name: "hard plane", a: Coat::ball(0.1), b: Coat::floor(0.1).hard(), plane: true });
    rounds.push(Round { name: "soft plane", a: Coat::ball(0.1), b: Coat::floor(0.1), plane: true });
    rounds
}

/// One scheme over all round pairs, indentations and poses: worst error, worst sideways force, share of poses whose
/// error the estimate bounds, evaluations.
fn sweep(scheme: Scheme, tolerance: f64) -> (f64, f64, f64, f64) {
    let mut random = Random(7);
    let (mut worst, mut sideways, mut bounded, mut count, mut evaluations) = (0.0f64, 0.0f64, 0, 0, 0.0);
    for round in rounds() {
        for indentation in [0.01, 0.05, 0.1, 0.2] {
            let mut worst_here = 0.0f64;
            for _ in 0..50 {
                // Total overlap: the indentation of the smaller ball, twice when both give way alike.
                let overlap = indentation * 0.1 * if round.b.rigid { 1.0 } else { 2.0 };
                let d = round.a.thickness + round.b.thickness - overlap;
                let base = Vec3::from_fn(|_, _| random.range(-5.0, 5.0));
                let pose_b = Pose { position: base, rotation: random.rotation() };
                let along = if round.plane { pose_b.rotation * Vec3::z() } else { random.direction() };
                let pose_a = Pose { position: base + along * d, rotation: random.rotation() };
                let contacts = collide((&round.a, pose_a), (&round.b, pose_b), scheme, tolerance);
                assert_eq!(contacts.len(), 1, "{} {indentation}", round.name);
                let slope = |coat: &Coat| 2.0 / (coat.radius - coat.thickness) * coat.stiffness_scale;
                let compliance = |coat: &Coat| if coat.rigid { 0.0 } else { 1.0 / slope(coat) };
                let (a, b) = (&round.a, &round.b);
                let exact = round_force(a.thickness, compliance(a), b.thickness, compliance(b), round.plane, d);
                let force = total(&contacts);
                // a is beyond b along `along`: it pushes b back.
                let error = (force + along * exact).norm() / exact;
                worst_here = worst_here.max(error);
                sideways = sideways.max((force - along * force.dot(&along)).norm() / exact);
                bounded += u32::from(error <= contacts[0].error_estimate + 1e-6);
                evaluations += f64::from(contacts[0].evaluations);
                count += 1;
            }
            if worst_here > tolerance {
                println!("    {} {indentation}: {worst_here:.1e}", round.name);
            }
            worst = worst.max(worst_here);
        }
    }
    (worst, sideways, f64::from(bounded) / f64::from(count), evaluations / f64::from(count))
}

#[test]
fn round_pairs_meet_the_tolerance_asked_for() {
    println!("scheme, tolerance: worst error, worst sideways force, share bounded by the estimate, evaluations");
    let mut failures = Vec::new();
    for scheme in [Scheme::Auto, Scheme::Facets, Scheme::Polar, Scheme::Adaptive] {
        for tolerance in [5e-2, 5e-3, 5e-4, 5e-5] {
            let (worst, sideways, bounded, evaluations) = sweep(scheme, tolerance);
            println!("{scheme:?} {tolerance:.0e}: {worst:.1e} {sideways:.1e} {:.1}% {evaluations:.0}", 100.0 * bounded);
            if worst > tolerance || bounded < 0.95 || sideways > 1e-4 {
                failures.push(format!("{scheme:?} {tolerance}"));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

struct Scene {
    name: &'static str,
    a: Coat,
    b: Coat,
    place: fn(&mut Random) -> (Pose, Pose),
    /// Samples on a line of the oracle's: a thin overlap needs more.
    steps: usize,
}

fn scenes() -> Vec<Scene> {
    let segment = Coat::new(&[Shape::Segment(Vec3::new(-0.3, 0.0, 0.0), Vec3::new(0.3, 0.0, 0.0))], 0.1);
    let triangle = Coat::new(
        &[Shape::Triangle(Vec3::new(-0.3, -0.2, 0.0), Vec3::new(0.3, -0.2, 0.0), Vec3::new(0.0, 0.4, 0.0))],
        0.1,
    );
    let dumbbell = Coat::new(&[Shape::Point(Vec3::new(-0.12, 0.0, 0.0)), Shape::Point(Vec3::new(0.12, 0.0, 0.0))], 0.1);
    let cuboid = Coat::cuboid(Vec3::new(0.2, 0.15, 0.1), 0.05);
    // Both bones come closest to a floor at their far ends, and bulge where they blend.
    let bones = |drop: f64| {
        let bone = |x: f64| Shape::Segment(Vec3::zeros(), Vec3::new(x, 0.0, -drop));
        Coat::new(&[bone(-0.4), bone(0.4)], 0.1)
    };
    vec![
        Scene {
            name: "bent limb-floor",
            a: Coat::floor(0.1),
            b: bones(0.02),
            place: |random| {
                let turn = Vec3::new(0.0, random.range(-0.02, 0.02), random.range(-3.0, 3.0));
                let rotation = isocoat::math::rotation_from_vector(&turn);
                (Pose::default(), Pose { position: Vec3::new(0.0, 0.0, 0.205), rotation })
            },
            steps: 72,
        },
        Scene {
            name: "limb round an edge",
            a: Coat::cuboid(Vec3::new(0.3, 0.3, 0.3), 0.02).hard(),
            b: bones(0.4),
            place: |random| {
                let turn = Vec3::new(random.range(-0.2, 0.2), std::f64::consts::FRAC_PI_4, random.range(-0.05, 0.05));
                let rotation = isocoat::math::rotation_from_vector(&turn);
                let at = Vec3::new(random.range(0.37, 0.39), 0.0, random.range(0.37, 0.39));
                (Pose::default(), Pose { position: at, rotation })
            },
            steps: 300,
        },
        Scene {
            name: "segment-segment",
            a: segment.clone(),
            b: segment.clone().stiff(3e5),
            place: |random| {
                let turn = Vec3::new(random.range(-0.1, 0.1), random.range(-0.1, 0.1), random.range(0.3, 1.5));
                let rotation = isocoat::math::rotation_from_vector(&turn);
                (Pose::at(0.0, 0.0, 0.0), Pose { position: Vec3::new(random.range(-0.1, 0.1), 0.0, 0.18), rotation })
            },
            steps: 72,
        },
        Scene {
            name: "triangle-ball",
            a: triangle,
            b: Coat::ball(0.1),
            place: |random| {
                // Over the face, past an edge, past a corner.
                let u = [random.unit(), random.unit(), random.unit()];
                let (x, y) = (u[0] / (u[0] + u[1] + u[2]), u[1] / (u[0] + u[1] + u[2]));
                let at = Vec3::new(-0.36 + 0.72 * x + 0.36 * y, -0.24 + 0.72 * y, 0.182);
                (Pose::default(), Pose { position: at, ..Pose::default() })
            },
            steps: 72,
        },
        Scene {
            name: "box-plane",
            a: Coat::floor(0.1),
            b: cuboid.clone(),
            place: |random| {
                let turn = Vec3::new(random.range(-0.02, 0.02), random.range(-0.02, 0.02), random.range(-3.0, 3.0));
                let rotation = isocoat::math::rotation_from_vector(&turn);
                (Pose::default(), Pose { position: Vec3::new(0.0, 0.0, 0.245), rotation })
            },
            steps: 72,
        },
        Scene {
            name: "box-ball",
            a: cuboid,
            b: Coat::ball(0.1),
            place: |random| {
                let at = Vec3::new(random.range(-0.25, 0.25), random.range(-0.2, 0.2), 0.235);
                (Pose::default(), Pose { position: at, ..Pose::default() })
            },
            steps: 72,
        },
        Scene {
            name: "dumbbell-dumbbell",
            a: dumbbell.clone(),
            b: dumbbell,
            place: |random| {
                let turn = Vec3::new(0.0, 0.0, random.range(0.0, 1.57));
                let rotation = isocoat::math::rotation_from_vector(&turn);
                let at = Vec3::new(random.range(-0.1, 0.1), random.range(-0.1, 0.1), 0.17);
                (Pose::default(), Pose { position: at, rotation })
            },
            steps: 72,
        },
    ]
}

#[test]
fn other_pairs_agree_with_brute_force() {
    let mut failures = Vec::new();
    for scene in scenes() {
        let mut random = Random(11);
        for _ in 0..4 {
            let (pose_a, pose_b) = (scene.place)(&mut random);
            let (a, b) = ((&scene.a, pose_a), (&scene.b, pose_b));
            let oracle = Oracle::new(a, b);
            let exact = oracle.force_by(60, scene.steps);
            let finer = oracle.force_by(90, scene.steps);
            assert!(finer.norm() > 0.0, "{}: no contact", scene.name);
            let doubt = (exact - finer).norm() / finer.norm();
            for scheme in [Scheme::Auto, Scheme::Facets, Scheme::Polar, Scheme::Adaptive, Scheme::Seeds] {
                for tolerance in [5e-2, 5e-3] {
                    let contacts = collide_seeded(a, b, scheme, tolerance, 16384);
                    let error = (total(&contacts) - finer).norm() / finer.norm();
                    let estimate = contacts.iter().map(|contact| contact.error_estimate).fold(0.0, f64::max);
                    let evaluations: u32 = contacts.iter().map(|contact| contact.evaluations).sum();
                    let used = contacts.first().map(|contact| contact.scheme);
                    println!(
                        "{} {scheme:?} {tolerance:.0e}: {error:.1e} (estimate {estimate:.1e}, oracle {doubt:.1e}) \
                         {evaluations} evaluations, {} patches, {used:?}",
                        scene.name,
                        contacts.len()
                    );
                    let allowed = match (scheme, scene.name) {
                        // Few rays go to so sharp an edge, and the estimate, from the others, does not know.
                        (Scheme::Seeds, "limb round an edge") => 2e-2,
                        (Scheme::Seeds, _) => estimate.max(tolerance),
                        _ => tolerance,
                    };
                    if error > allowed + doubt {
                        failures.push(format!("{} {scheme:?} {tolerance}: {error:.1e}", scene.name));
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
