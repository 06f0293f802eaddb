//! What is pressed so deep into something softer that the contact surface is wrapped round it, and boxes that reach
//! into each other's cores: against Archimedes and against brute force.

mod common;

use common::oracle::Oracle;
use common::{Coat, Random, collide, total};
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3, rotation_from_vector};
use isocoat::world::{Contact, Scheme};

/// Thickness of the floor's coat, and so the height of its surface \[m\].
const FLOOR: f64 = 0.5;

fn floor() -> Coat {
    Coat::floor(FLOOR)
}

/// Signed distance to the core of a capsule, a triangle or a box in its own frame.
fn distance(shape: &Shape, p: &Vec3) -> f64 {
    match shape {
        Shape::Box { half, .. } => {
            let q = p.abs() - half;
            q.sup(&Vec3::zeros()).norm() + q.max().min(0.0)
        }
        Shape::Segment(a, b) => {
            let ab = b - a;
            (p - a - ab * ((p - a).dot(&ab) / ab.norm_squared()).clamp(0.0, 1.0)).norm()
        }
        Shape::Triangle(a, b, c) => {
            let normal = (b - a).cross(&(c - a)).normalize();
            let sides = [(a, b), (b, c), (c, a)];
            if sides.iter().all(|(a, b)| (*b - *a).cross(&(p - *a)).dot(&normal) >= 0.0) {
                return (p - a).dot(&normal).abs();
            }
            sides.iter().map(|(a, b)| distance(&Shape::Segment(**a, **b), p)).fold(f64::INFINITY, f64::min)
        }
        other => unreachable!("{other:?}"),
    }
}

/// Volume of a hard convex coat below the floor's surface, and its centroid, by vertical lines.
fn submerged(coat: &Coat, pose: &Pose) -> (f64, Vec3) {
    const LINES: usize = 500;
    let shape = &coat.shapes[0];
    let (low, high) = shape.transformed(pose).bounds(coat.thickness);
    let cell = (high - low) / LINES as f64;
    let inverse = pose.rotation.conjugate();
    let outside = |p: &Vec3| distance(shape, &(inverse * (p - pose.position))) - coat.thickness;
    let (mut volume, mut moment) = (0.0, Vec3::zeros());
    for i in 0..LINES {
        for j in 0..LINES {
            let at = |z: f64| Vec3::new(low.x + (i as f64 + 0.5) * cell.x, low.y + (j as f64 + 0.5) * cell.y, z);
            // No step longer than the distance goes through the surface of what is convex.
            let first = |mut z: f64, direction: f64| {
                for _ in 0..200 {
                    let gap = outside(&at(z));
                    if gap < 1e-7 || z < low.z - cell.z || z > high.z + cell.z {
                        break;
                    }
                    z += direction * gap;
                }
                z
            };
            let bottom = first(low.z, 1.0);
            let top = first(high.z, -1.0).min(FLOOR);
            if top > bottom {
                let piece = (top - bottom) * cell.x * cell.y;
                volume += piece;
                moment += at(0.5 * (top + bottom)) * piece;
            }
        }
    }
    (volume, moment / volume)
}

/// Force and torque about a place of all contacts on b.
fn about(contacts: &[Contact], place: &Vec3) -> (Vec3, Vec3) {
    let torque = contacts.iter().map(|contact| contact.torque + (contact.position - place).cross(&contact.force)).sum();
    (total(contacts), torque)
}

/// The pressure of a floor grows with the depth as it does in water, so it lifts with the weight of what is displaced, in
/// its centroid.
#[test]
fn a_hard_coat_deep_in_a_soft_floor_floats_as_archimedes_says() {
    let mut random = Random(1);
    let floor = floor();
    // Pressure a metre of depth: the slope of the default profile times the stiffness.
    let weight = floor.stiffness_scale * 2.0 / (floor.radius - floor.thickness);
    let capsule = || Shape::Segment(Vec3::new(-0.1, 0.02, 0.0), Vec3::new(0.1, -0.02, 0.03));
    let bodies = [
        ("thin box", Coat::cuboid(Vec3::new(0.15, 0.1, 0.08), 0.002).hard()),
        ("thick box", Coat::cuboid(Vec3::new(0.1, 0.08, 0.06), 0.03).hard()),
        ("capsule", Coat::new(&[capsule()], 0.04).hard()),
    ];
    for (name, coat) in bodies {
        let (mut worst, mut worst_torque, mut most) = (0.0f64, 0.0f64, 0);
        for _ in 0..12 {
            let rotation = rotation_from_vector(&(random.direction() * random.range(0.0, 3.0)));
            let pose = Pose { position: Vec3::zeros(), rotation };
            let (low, high) = coat.shapes[0].transformed(&pose).bounds(coat.thickness);
            // From a third of the height on to under the surface.
            let depth = random.range(0.3, 1.1) * (high.z - low.z);
            let pose = Pose { position: Vec3::new(0.3, -0.2, FLOOR - depth - low.z), rotation };
            let contacts = collide((&floor, Pose::default()), (&coat, pose), Scheme::Auto, 5e-3);
            // Wholly under, it is an overload as well, whose push-out has no force of its own here.
            assert!(contacts.len() == 1 || contacts.len() == 2 && contacts[1].overloaded, "{name}: {contacts:?}");
            let (volume, centroid) = submerged(&coat, &pose);
            let (force, torque) = about(&contacts, &centroid);
            let lift = weight * volume;
            worst = worst.max((force - Vec3::z() * lift).norm() / lift);
            worst_torque = worst_torque.max(torque.norm() / (lift * (high - low).norm()));
            most = most.max(contacts[0].evaluations);
        }
        println!(
            "{name}: force {worst:.1e}, torque {worst_torque:.1e} of force times size, at most {most} evaluations"
        );
        assert!(worst < 5e-3 && worst_torque < 5e-3, "{name}: force {worst:.2e}, torque {worst_torque:.2e}");
        assert!(most < 3000, "{name}: {most} evaluations");
    }
}

/// Thin coats whose boxes reach into each other: seen from one plane, half of such a contact may be out of sight.
#[test]
fn boxes_that_reach_into_each_other_agree_with_brute_force() {
    let mut random = Random(7);
    let coat = Coat::cuboid(Vec3::new(0.12, 0.1, 0.09), 0.005);
    let other = coat.clone().stiff(2e5);
    let (mut worst, mut seen) = (0.0f64, 0);
    while seen < 6 {
        let [p, q] = [0, 1].map(|_| rotation_from_vector(&(random.direction() * random.range(0.0, 3.0))));
        let at = random.direction() * random.range(0.18, 0.22);
        let (a, b) = (Pose { position: Vec3::zeros(), rotation: p }, Pose { position: at, rotation: q });
        let contacts = collide((&coat, a), (&other, b), Scheme::Auto, 5e-3);
        // Those that meet past both coats.
        let pressed = |contact: &Contact| contact.peak_pressure > coat.stiffness_scale * 2.0;
        if contacts.is_empty() || !contacts.iter().any(pressed) {
            continue;
        }
        let truth = Oracle::new((&coat, a), (&other, b)).force(80);
        let error = (total(&contacts) - truth).norm() / truth.norm();
        println!("{:.1e} with {} evaluations, {:?}", error, contacts[0].evaluations, contacts[0].scheme);
        worst = worst.max(error);
        seen += 1;
    }
    assert!(worst < 0.02, "{worst:.3}");
}

/// A thin box that leans with an edge on another's face: along the border the pressure is linear, and what lies outside,
/// where profiles are curved, must not bend it.
#[test]
fn an_edge_on_a_face_meets_the_tolerance() {
    let mut random = Random(3);
    let coat = Coat::cuboid(Vec3::new(0.128, 0.128, 0.128), 0.002);
    let (mut over, mut count) = (0, 0);
    for _ in 0..60 {
        let lean = Vec3::new(random.range(0.1, 0.7), random.range(-0.02, 0.02), random.range(-1.0, 1.0));
        let rotation =
            rotation_from_vector(&Vec3::new(lean.x, lean.y, 0.0)) * rotation_from_vector(&(Vec3::z() * lean.z));
        let (low, _) = coat.shapes[0].transformed(&Pose { position: Vec3::zeros(), rotation }).bounds(0.0);
        let overlap = coat.thickness * random.range(0.1, 1.5);
        let position = Vec3::new(random.range(-0.1, 0.1), random.range(-0.1, 0.1), 0.128 + 0.004 - low.z - overlap);
        let pose = Pose { position, rotation };
        let run = |tolerance: f64| collide((&coat, Pose::default()), (&coat, pose), Scheme::Adaptive, tolerance);
        let (rough, fine) = (run(5e-3), run(1e-4));
        if rough.is_empty() {
            continue;
        }
        let error = (total(&rough) - total(&fine)).norm() / total(&fine).norm();
        count += 1;
        over += usize::from(error > 5e-3);
    }
    println!("{over} of {count} over the tolerance");
    assert!(count > 15 && over * 20 <= count, "{over} of {count}");
}

/// A force on b, its estimated error and what it took, and the same with the two swapped.
fn both_ways(a: (&Coat, Pose), b: (&Coat, Pose), scheme: Scheme, tolerance: f64) -> [(Vec3, f64, u32); 2] {
    let read = |contacts: &[Contact], sign: f64| {
        let estimate = contacts.iter().map(|contact| contact.error_estimate).fold(0.0, f64::max);
        (total(contacts) * sign, estimate, contacts.iter().map(|contact| contact.evaluations).sum())
    };
    [read(&collide(a, b, scheme, tolerance), 1.0), read(&collide(b, a, scheme, tolerance), -1.0)]
}

/// What is small and soft lies on an edge or a corner of something large as it does on that of something of its own size.
#[test]
fn a_contact_does_not_depend_on_how_far_the_bodies_go_on() {
    let small = Coat::cuboid(Vec3::repeat(0.1), 0.05);
    let rotation = rotation_from_vector(&Vec3::new(0.3, 0.4, 0.2));
    for (place, up) in [("edge", Vec3::new(1.0, 0.0, 1.0)), ("corner", Vec3::new(1.0, 1.0, 1.0))] {
        let base = |size: f64| {
            let y = if place == "edge" { 0.217 } else { 1.0 };
            let pose = Pose { position: Vec3::new(-size, -y * size, -0.5 * size), ..Pose::default() };
            (Coat::cuboid(Vec3::new(size, size, 0.5 * size), 0.01).hard(), pose)
        };
        // Up to where they touch, and 20 mm back.
        let at = |away: f64| Pose { position: up.normalize() * away, rotation };
        let (coat, pose) = base(1.0);
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            if collide((&coat, pose), (&small, at(middle)), Scheme::Auto, 0.05).is_empty() {
                high = middle;
            } else {
                low = middle;
            }
        }
        let pose_small = at(low - 0.02);
        let truth = Oracle::new((&coat, pose), (&small, pose_small)).force(160);
        for size in [1.0, 10.0, 1e2, 1e3, 1e4] {
            let (coat, pose) = base(size);
            for (force, estimate, evaluations) in both_ways((&coat, pose), (&small, pose_small), Scheme::Auto, 5e-3) {
                let error = (force - truth).norm() / truth.norm();
                println!("{place} of {size} m: {error:.1e}, estimated {estimate:.1e}, {evaluations} evaluations");
                assert!(error < 5e-3 && estimate < 5e-3, "{place} of {size} m: {error:.2e}, {estimate:.2e}");
                assert!(evaluations < 1500, "{place} of {size} m: {evaluations} evaluations");
            }
        }
    }
}

/// Equal boxes deep in each other, of which neither pressure is the steeper: what is over the tolerance says so, and no
/// order of the two is better.
#[test]
fn equal_boxes_deep_in_each_other_agree_with_brute_force() {
    let coat = Coat::cuboid(Vec3::new(0.12, 0.1, 0.09), 0.005);
    let rotation = rotation_from_vector(&Vec3::new(0.6, 0.5, 0.2));
    for ratio in [1.0, 1.3, 1.8] {
        let other = coat.clone().stiff(ratio * 1e5);
        for step in [0, 3, 6, 9] {
            let pose = Pose { position: Vec3::new(0.26 - 0.008 * f64::from(step), 0.03, 0.02), rotation };
            let truth = Oracle::new((&coat, Pose::default()), (&other, pose)).force(80);
            for (force, estimate, evaluations) in
                both_ways((&coat, Pose::default()), (&other, pose), Scheme::Auto, 5e-3)
            {
                let error = (force - truth).norm() / truth.norm();
                println!("{ratio}, {step}: {error:.1e}, estimated {estimate:.1e}, {evaluations} evaluations");
                // Half a percent is brute force's own.
                assert!(error < 0.02 && error < estimate + 5e-3, "{ratio}, {step}: {error:.2e}, {estimate:.2e}");
            }
        }
    }
}

/// A capsule that lies in the soft edge of a box is wrapped across where it is narrow along.
#[test]
fn a_capsule_in_a_soft_edge_agrees_with_brute_force() {
    let soft = Coat::cuboid(Vec3::new(0.2, 0.2, 0.1), 0.1);
    let capsule = Coat::new(&[Shape::Segment(-Vec3::x() * 0.1, Vec3::x() * 0.1)], 0.02);
    let rotation = rotation_from_vector(&Vec3::new(0.1, 0.25, 0.9));
    for step in 1..11 {
        let pose = Pose { position: Vec3::new(0.36 - 0.004 * f64::from(step), 0.05, 0.15), rotation };
        let truth = -Oracle::new((&capsule, pose), (&soft, Pose::default())).force(80);
        for (force, estimate, evaluations) in
            both_ways((&soft, Pose::default()), (&capsule, pose), Scheme::Adaptive, 5e-3)
        {
            let error = (force - truth).norm() / truth.norm();
            println!("{step}: {error:.1e}, estimated {estimate:.1e}, {evaluations} evaluations");
            assert!(error < 5e-3 && estimate < 5e-3, "{step}: {error:.2e}, {estimate:.2e}");
        }
    }
}

/// A thin sheet sunk into something soft, which goes on behind it: what presses on its two sides nearly cancels.
#[test]
fn a_triangle_deep_in_a_soft_floor_floats_as_archimedes_says() {
    let mut random = Random(11);
    let weight = floor().stiffness_scale * 2.0 / FLOOR;
    for thickness in [0.03] {
        let (mut worst, mut most) = (0.0f64, 0);
        for _ in 0..10 {
            let corners = [0, 1, 2].map(|_| random.direction() * 0.1);
            let coat = Coat::new(&[Shape::Triangle(corners[0], corners[1], corners[2])], thickness).hard();
            let (low, high) = coat.shapes[0].bounds(thickness);
            let depth = random.range(0.3, 1.1) * (high.z - low.z);
            let pose = Pose { position: Vec3::new(0.3, -0.2, FLOOR - depth - low.z), ..Pose::default() };
            let contacts = collide((&floor(), Pose::default()), (&coat, pose), Scheme::Auto, 5e-3);
            let (volume, _) = submerged(&coat, &pose);
            let lift = weight * volume;
            let error = (total(&contacts) - Vec3::z() * lift).norm() / lift;
            worst = worst.max(error);
            most = most.max(contacts[0].evaluations);
        }
        println!("triangle {thickness}: force {worst:.1e}, at most {most} evaluations");
        assert!(worst < 5e-3, "{thickness}: {worst:.2e}");
        assert!(most < 3000, "{thickness}: {most} evaluations");
    }
}
