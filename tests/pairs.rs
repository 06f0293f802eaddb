//! Every pair of shapes, blends included, in random poses: each scheme against a fine subdivision, which `accuracy.rs`
//! holds against brute force.

mod common;

use common::{Coat, Random, collide, total};
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Quat, Vec3, rotation_from_vector};
use isocoat::world::{Contact, Scheme};

fn cuboid(half: [f64; 3], x: f64) -> Shape {
    Shape::Box { center: Vec3::new(x, 0.0, 0.0), half: Vec3::from(half), axes: Mat3::identity() }
}

fn coats() -> Vec<(&'static str, Coat)> {
    let corners = [Vec3::new(-0.3, -0.2, 0.0), Vec3::new(0.3, -0.2, 0.0), Vec3::new(0.0, 0.4, 0.0)];
    let leaf = |angle: f64| Shape::Point(Vec3::new(0.12 * angle.cos(), 0.12 * angle.sin(), 0.0));
    vec![
        ("floor", Coat::floor(0.1)),
        ("ball", Coat::ball(0.1)),
        ("segment", Coat::new(&[Shape::Segment(Vec3::x() * -0.3, Vec3::x() * 0.3)], 0.1)),
        ("triangle", Coat::new(&[Shape::Triangle(corners[0], corners[1], corners[2])], 0.1)),
        ("box", Coat::cuboid(Vec3::new(0.2, 0.15, 0.1), 0.05)),
        ("dumbbell", Coat::new(&[Shape::Point(Vec3::x() * -0.12), Shape::Point(Vec3::x() * 0.12)], 0.1)),
        ("step", Coat::new(&[cuboid([0.1, 0.1, 0.1], -0.1), cuboid([0.1, 0.15, 0.05], 0.15)], 0.05)),
        ("clover", Coat::new(&[0.0, 0.5, 1.0, 1.5].map(|turns| leaf(turns * std::f64::consts::PI)), 0.08)),
    ]
}

/// What one scheme came to over all pairs.
struct Tally {
    scheme: Scheme,
    tolerance: f64,
    count: u32,
    within: u32,
    bounded: u32,
    evaluations: u32,
    worst: (f64, String),
}

fn estimate(contacts: &[Contact]) -> f64 {
    contacts.iter().map(|contact| contact.error_estimate).fold(0.0, f64::max)
}

#[test]
fn all_pairs_in_random_poses_meet_the_tolerance() {
    let runs = [
        (Scheme::Auto, 5e-2),
        (Scheme::Auto, 5e-3),
        (Scheme::Polar, 5e-3),
        (Scheme::Adaptive, 5e-2),
        (Scheme::Adaptive, 5e-3),
    ];
    let mut tallies = runs.map(|(scheme, tolerance)| Tally {
        scheme,
        tolerance,
        count: 0,
        within: 0,
        bounded: 0,
        evaluations: 0,
        worst: (0.0, String::new()),
    });
    let mut random = Random(15);
    let coats = coats();
    for (first, (name_a, a)) in coats.iter().enumerate() {
        for (name_b, b) in coats[first..].iter().filter(|(name, _)| *name != "floor") {
            for round in 0..10 {
                let on_floor = *name_a == "floor";
                // On a floor every other body lies nearly flat.
                let rotation = if on_floor && round % 2 == 0 {
                    rotation_from_vector(&Vec3::from_fn(|i, _| {
                        random.range(-1.0, 1.0) * if i < 2 { 0.02 } else { 3.0 }
                    }))
                } else {
                    random.rotation()
                };
                let rotation_a = if on_floor { Quat::identity() } else { random.rotation() };
                let direction = if on_floor { Vec3::z() } else { random.direction() };
                let collide = |distance: f64, scheme, tolerance| {
                    let pose_a = Pose { rotation: rotation_a, ..Pose::default() };
                    collide((a, pose_a), (b, Pose { position: direction * distance, rotation }), scheme, tolerance)
                };
                let (mut touching, mut apart) = (0.05, 2.0);
                while apart - touching > 1e-6 {
                    let middle = 0.5 * (touching + apart);
                    if collide(middle, Scheme::Auto, 5e-2).is_empty() { apart = middle } else { touching = middle }
                }
                let distance = touching - random.range(0.001, 0.03);
                let fine = collide(distance, Scheme::Adaptive, 1e-4);
                if estimate(&fine) > 1e-3 {
                    continue;
                }
                let exact = total(&fine);
                for tally in &mut tallies {
                    let contacts = collide(distance, tally.scheme, tally.tolerance);
                    let error = (total(&contacts) - exact).norm() / exact.norm();
                    tally.count += 1;
                    tally.within += u32::from(error <= tally.tolerance);
                    tally.bounded += u32::from(error <= estimate(&contacts) + 2e-4);
                    tally.evaluations += contacts.iter().map(|contact| contact.evaluations).sum::<u32>();
                    if error > tally.worst.0 {
                        tally.worst = (error, format!("{name_a} and {name_b}"));
                    }
                }
            }
        }
    }
    for Tally { scheme, tolerance, count, within, bounded, evaluations, worst } in &tallies {
        let share = |part: &u32| 100.0 * f64::from(*part) / f64::from(*count);
        println!(
            "{scheme:?} {tolerance:.0e}: {:.1} % within, {:.1} % bounded by the estimate, worst {:.1e} ({}), {} \
             evaluations, {count} poses",
            share(within),
            share(bounded),
            worst.0,
            worst.1,
            evaluations / count
        );
        assert!(*count > 300, "{scheme:?}: {count} poses");
        assert!(share(within) >= 99.0 && share(bounded) >= 95.0, "{scheme:?} {tolerance:.0e}");
    }
}
