//! Boxes flat and leaning on planes, over sizes, roundings, depths, turns and tolerances: against the exact force where
//! there is one, and against the facets, which `facets.rs` holds against fine grids.

mod common;

use common::{Coat, Random, collide, total};
use isocoat::math::{Pose, Vec3, rotation_from_vector};
use isocoat::world::Scheme;
use std::f64::consts::PI;

/// Force of a cube's coat on a hard plane that its face is parallel to: with `h = t - depth` the distance of the face
/// from the plane, the pressure is `K k (t - √(h² + x²))` at the distance x beyond the face's edge; that, times the face,
/// along its edges, and round its corners.
fn exact(half: f64, thickness: f64, depth: f64) -> f64 {
    let (t, h) = (thickness, thickness - depth);
    let width = (t * t - h * h).sqrt();
    let strip = 0.5 * (width * t - h * h * (width / h).asinh());
    let corners = 2.0 * PI * (t * width * width / 2.0 - (t.powi(3) - h.powi(3)) / 3.0);
    1e5 * 2.0 / t * (depth * 4.0 * half * half + 8.0 * half * strip + corners)
}

#[test]
fn a_flat_box_meets_the_tolerance_and_its_own_estimate() {
    let mut random = Random(41);
    let mut failures = Vec::new();
    for tolerance in [5e-3, 1e-4] {
        let (mut worst, mut evaluations, mut count) = (0.0f64, 0.0, 0.0);
        for half in [0.1, 0.25, 1.0] {
            for thickness in [0.02, 0.05] {
                for part in [0.002, 0.01, 0.05, 0.2] {
                    for yaw in [0.0, 0.2, random.range(0.0, PI)] {
                        let depth = part * thickness;
                        let (floor, cube) =
                            (Coat::floor(thickness).hard(), Coat::cuboid(Vec3::repeat(half), thickness));
                        let position = Vec3::z() * (2.0 * thickness - depth + half);
                        let pose = Pose { position, rotation: rotation_from_vector(&(Vec3::z() * yaw)) };
                        let contacts = collide((&floor, Pose::default()), (&cube, pose), Scheme::Adaptive, tolerance);
                        let force = total(&contacts);
                        let error = force.z / exact(half, thickness, depth) - 1.0;
                        let estimate = contacts[0].error_estimate;
                        worst = worst.max(error.abs());
                        evaluations += f64::from(contacts[0].evaluations);
                        count += 1.0;
                        // Where the cells ran out the estimate says so.
                        if error.abs() > estimate || error.abs() > 2.0 * tolerance || contacts.len() > 1 {
                            failures.push(format!(
                                "half {half} thickness {thickness} depth {depth} yaw {yaw:.2} tolerance \
                                 {tolerance:.0e}: off by {error:.1e}, estimate {estimate:.1e}"
                            ));
                        }
                    }
                }
            }
        }
        println!("{tolerance:.0e}: worst {worst:.1e}, {:.0} evaluations", evaluations / count);
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

#[test]
fn a_face_pressed_flat_carries_no_less_than_its_area_times_its_pressure() {
    let (half, thickness) = (0.25, 0.02);
    let (floor, cube) = (Coat::floor(thickness).hard(), Coat::cuboid(Vec3::repeat(half), thickness));
    for step in 0..11 {
        let depth = 2e-4 + 2e-5 * f64::from(step);
        for tolerance in [5e-3, 1e-4, 1e-7] {
            let pose = Pose::at(0.0, 0.0, 2.0 * thickness - depth + half);
            let force = total(&collide((&floor, Pose::default()), (&cube, pose), Scheme::Adaptive, tolerance)).z;
            let (face, all) = (1e7 * depth * 4.0 * half * half, exact(half, thickness, depth));
            assert!(force >= face * (1.0 - tolerance), "depth {depth} tolerance {tolerance:.0e}: {force} of {face}");
            assert!((force / all - 1.0).abs() < tolerance.max(1e-5), "depth {depth}: {force} of {all}");
        }
    }
}

#[test]
fn leaning_boxes_meet_the_tolerance_by_every_scheme() {
    for scheme in [Scheme::Polar, Scheme::Adaptive] {
        for tolerance in [5e-2, 5e-3] {
            let mut random = Random(3);
            let (mut worst, mut bounded, mut evaluations, mut count) = (0.0f64, 0.0, 0.0, 0.0);
            for (half, thickness) in [(0.1, 0.02), (0.1, 0.05), (0.25, 0.02), (0.25, 0.05)] {
                for part in [0.01, 0.05, 0.2, 0.4] {
                    for lean in [0.0, 0.0, 0.01, 0.01, 0.05] {
                        let turn = Vec3::from_fn(|i, _| random.range(-1.0, 1.0) * if i < 2 { lean } else { 3.0 });
                        let rotation = rotation_from_vector(&turn);
                        let position = Vec3::z() * (thickness * (2.0 - part) + half);
                        let cube = Coat::cuboid(Vec3::repeat(half), thickness);
                        for floor in [Coat::floor(thickness).hard(), Coat::floor(thickness)] {
                            let collide = |scheme, tolerance| {
                                let (floor, cube) = ((&floor, Pose::default()), (&cube, Pose { position, rotation }));
                                collide(floor, cube, scheme, tolerance)
                            };
                            let exact = total(&collide(Scheme::Facets, 1e-5));
                            let contacts = collide(scheme, tolerance);
                            let error = (total(&contacts) - exact).norm() / exact.norm();
                            let estimate = contacts.iter().map(|contact| contact.error_estimate).fold(0.0, f64::max);
                            worst = worst.max(error);
                            bounded += f64::from(u8::from(error <= estimate + 1e-5));
                            evaluations += contacts.iter().map(|contact| f64::from(contact.evaluations)).sum::<f64>();
                            count += 1.0;
                        }
                    }
                }
            }
            let (share, mean) = (100.0 * bounded / count, evaluations / count);
            println!("{scheme:?} {tolerance:.0e}: worst {worst:.1e}, {share:.1} % bounded, {mean:.0} evaluations");
            assert!(worst <= tolerance, "{scheme:?} {tolerance:.0e}: off by {worst:.1e}");
            assert!(share >= 95.0, "{scheme:?} {tolerance:.0e}: {share:.1} % bounded");
        }
    }
}
