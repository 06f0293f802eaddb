//! Queries against closed forms where there are any, and against brute force where fields blend.

use isocoat::World;
use isocoat::coat::{Coat, seeds, territory};
use isocoat::field::{Profile, Shape};
use isocoat::math::{Mat3, Pose, Vec3, rotation_from_vector};
use isocoat::world::draw::{DebugDraw, DrawFlags};
use isocoat::world::{BodyDesc, BodyId, LinkDesc, SkeletonDesc, SkeletonId, WorldDesc};
use proptest::prelude::*;
use std::f64::consts::{FRAC_PI_2, PI};

const EVERY: u64 = u64::MAX;

fn vectors(size: f64) -> impl Strategy<Value = Vec3> {
    (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vec3::new(x, y, z))
}

fn directions() -> impl Strategy<Value = Vec3> {
    vectors(1.0).prop_filter_map("too short", |v| v.try_normalize(0.1))
}

fn poses(size: f64) -> impl Strategy<Value = Pose> {
    (vectors(size), vectors(3.0)).prop_map(|(position, w)| Pose { position, rotation: rotation_from_vector(&w) })
}

fn bounded_shapes() -> impl Strategy<Value = Shape> {
    prop_oneof![
        vectors(1.0).prop_map(Shape::Point),
        (vectors(1.0), vectors(1.0)).prop_map(|(a, b)| Shape::segment(a, b)),
        (vectors(1.0), vectors(1.0), vectors(1.0)).prop_map(|(a, b, c)| Shape::triangle(a, b, c)),
        (vectors(1.0), vectors(1.0), vectors(2.0)).prop_map(|(center, h, r)| Shape::Box {
            center,
            half: h.map(|x| 0.05 + x.abs()),
            axes: *rotation_from_vector(&r).to_rotation_matrix().matrix(),
        }),
    ]
}

fn all_shapes() -> impl Strategy<Value = Shape> {
    prop_oneof![
        4 => bounded_shapes(),
        1 => (vectors(1.0), directions()).prop_map(|(p, n)| Shape::plane(p, n).unwrap()),
    ]
}

/// Two to four skeletons, near enough to blend.
fn blends() -> impl Strategy<Value = Vec<SkeletonDesc>> {
    let skeleton = (bounded_shapes(), 0.05..0.6f64, 1.3..3.0f64).prop_map(|(shape, thickness, reach)| SkeletonDesc {
        shape,
        thickness,
        radius: reach * thickness,
        ..SkeletonDesc::default()
    });
    proptest::collection::vec(skeleton, 2..5)
}

/// A body with one fixed link.
fn body(world: &mut World, pose: Pose, skeletons: &[SkeletonDesc]) -> (BodyId, Vec<SkeletonId>) {
    let body = world.create_body(BodyDesc::default()).unwrap();
    let link = world.create_link(body, LinkDesc { pose, ..LinkDesc::default() }).unwrap();
    let ids = skeletons.iter().map(|desc| world.create_skeleton(link, desc.clone()).unwrap()).collect();
    (body, ids)
}

fn blend_of(skeletons: &[SkeletonDesc], pose: Pose) -> (World, BodyId, Vec<SkeletonId>) {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let (body, ids) = body(&mut world, pose, skeletons);
    (world, body, ids)
}

fn single(shape: Shape, thickness: f64, pose: Pose) -> (World, BodyId, SkeletonId) {
    let (world, body, ids) = blend_of(&[SkeletonDesc { shape, thickness, ..SkeletonDesc::default() }], pose);
    (world, body, ids[0])
}

fn field(world: &World, body: BodyId, points: &[Vec3]) -> Vec<f64> {
    let points: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
    let mut values = vec![0.0; points.len()];
    world.evaluate_field(body, &points, Some(&mut values), None).unwrap();
    values
}

fn sphere_distance(center: &Vec3, radius: f64, origin: &Vec3, u: &Vec3) -> Option<f64> {
    let m = origin - center;
    if m.norm() <= radius {
        return Some(0.0);
    }
    let b = m.dot(u);
    // The discriminant by the distance of the line, which does not cancel.
    let gap2 = (m - u * b).norm_squared();
    (b < 0.0 && gap2 <= radius * radius).then(|| -b - (radius * radius - gap2).sqrt())
}

fn capsule_distance(a: &Vec3, b: &Vec3, radius: f64, origin: &Vec3, u: &Vec3) -> Option<f64> {
    let axis = (b - a).normalize();
    let (m, length) = (origin - a, (b - a).norm());
    let (m2, u2) = (m - axis * m.dot(&axis), u - axis * u.dot(&axis));
    if m2.norm() <= radius && (0.0..=length).contains(&m.dot(&axis)) {
        return Some(0.0);
    }
    let middle = -m2.dot(&u2) / u2.norm_squared();
    let gap2 = (m2 + u2 * middle).norm_squared();
    let tube = (gap2 <= radius * radius)
        .then(|| middle - ((radius * radius - gap2) / u2.norm_squared()).sqrt())
        .filter(|s| *s >= 0.0 && (0.0..=length).contains(&(m + u * *s).dot(&axis)));
    let balls = [a, b].map(|end| sphere_distance(end, radius, origin, u));
    [tube, balls[0], balls[1]].into_iter().flatten().min_by(f64::total_cmp)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn rays_meet_spheres_where_geometry_says(
        pose in poses(3.0), local in vectors(1.0), t in 0.001..1.0f64, origin in vectors(5.0), aim in directions(),
        miss in 0.0..2.0f64, far in 0.0..1.0f64,
    ) {
        let (world, body, skeleton) = single(Shape::Point(local), t, pose);
        let center = pose.transform_point(&local);
        let origin = origin * (1.0 + 1e3 * far.powi(8));
        let u = (center + aim * (miss * t) - origin).normalize();
        let hit = world.cast_ray(&origin, &(u * 3.0), f64::INFINITY, EVERY).unwrap();
        match (hit, sphere_distance(&center, t, &origin, &u)) {
            (Some(hit), Some(distance)) => {
                let (scale, grazing) = (origin.norm() + 1.0, hit.normal.dot(&u).abs().max(1e-7));
                prop_assert!((hit.distance - distance).abs() < 1e-14 * scale / grazing);
                prop_assert_eq!((hit.body, hit.skeleton), (body, skeleton));
                if distance > 0.0 {
                    prop_assert!((hit.normal - (hit.position - center) / t).norm() < 1e-13 * scale / t);
                }
            }
            (None, None) => {}
            other => prop_assert!(false, "{other:?}"),
        }
    }

    #[test]
    fn rays_meet_capsules_where_geometry_says(
        pose in poses(3.0), a in vectors(1.0), b in vectors(1.0), t in 0.01..0.8f64, origin in vectors(4.0),
        aim in vectors(1.2),
    ) {
        prop_assume!((b - a).norm() > 0.05);
        let (world, ..) = single(Shape::Segment(a, b), t, pose);
        let (a, b) = (pose.transform_point(&a), pose.transform_point(&b));
        let u = (pose.transform_point(&aim) - origin).normalize();
        let hit = world.cast_ray(&origin, &u, 1e3, EVERY).unwrap();
        match (hit, capsule_distance(&a, &b, t, &origin, &u)) {
            (Some(hit), Some(distance)) => prop_assert!((hit.distance - distance).abs() < 1e-8),
            (None, None) => {}
            other => prop_assert!(false, "{other:?}"),
        }
    }

    /// The solid of a single skeleton is its offset: `distance <= thickness`.
    #[test]
    fn rays_meet_rounded_shapes_first_where_their_distance_is_the_thickness(
        pose in poses(2.0), shape in all_shapes(), t in 0.001..0.8f64, origin in vectors(4.0), aim in vectors(1.2),
        reach in 0.0..8.0f64,
    ) {
        let (world, ..) = single(shape, t, pose);
        let shape = shape.transformed(&pose);
        let u = (pose.transform_point(&aim) - origin).normalize();
        let depth = |s: f64| shape.closest(&(origin + u * s)).distance - t;
        let hit = world.cast_ray(&origin, &(u * 7.0), reach, EVERY).unwrap();
        let end = hit.map_or(reach, |hit| hit.distance);
        for k in 0..500 {
            prop_assert!(depth(end * f64::from(k) / 500.0) > -1e-12 || end == 0.0);
        }
        if let Some(hit) = hit {
            prop_assert!(hit.distance <= reach);
            prop_assert!(depth(hit.distance).abs() < 1e-12 || hit.distance == 0.0 && depth(0.0) <= 1e-12);
            prop_assert!(hit.distance == 0.0 || hit.normal.dot(&u) < 1e-6);
        }
    }

    #[test]
    fn rays_meet_blends_where_a_fine_march_does(
        skeletons in blends(), pose in poses(1.0), origin in vectors(3.0), aim in vectors(1.0),
    ) {
        let (world, body, _) = blend_of(&skeletons, pose);
        let u = (pose.transform_point(&aim) - origin).normalize();
        let (step, count) = (1e-3, 8000);
        let samples: Vec<Vec3> = (0..count).map(|k| origin + u * (f64::from(k) * step)).collect();
        let solid: Vec<bool> = field(&world, body, &samples).iter().map(|f| *f >= 1.0).collect();
        let cast = |length: f64| world.cast_ray(&origin, &u, length, EVERY).unwrap();
        if let Some(hit) = cast(step * f64::from(count - 1)) {
            let value = field(&world, body, &[hit.position])[0];
            prop_assert!((value - 1.0).abs() < 1e-10 || hit.distance == 0.0 && value >= 1.0);
            // Nothing solid comes before, for the march and for a ray that ends just short of it.
            let first = solid.iter().position(|inside| *inside).map_or(f64::INFINITY, |k| k as f64 * step);
            prop_assert!(hit.distance <= first + 1e-12, "{} {first}", hit.distance);
            prop_assert!(hit.distance < 1e-6 || cast(hit.distance - 1e-7).is_none());
        } else {
            // A chord of two samples is longer than what may be missed.
            prop_assert!(solid.windows(2).all(|pair| pair != [true, true]));
        }
    }

    #[test]
    fn closest_points_of_single_skeletons_are_exact(
        pose in poses(2.0), shape in all_shapes(), t in 0.001..1.0f64, p in vectors(4.0), q in vectors(1.0),
    ) {
        let (world, body, skeleton) = single(shape, t, pose);
        let shape = shape.transformed(&pose);
        // Anywhere, on the skeleton itself, and just off it.
        let on = shape.closest_point(&p);
        for point in [p, on, on + q * 1e-9, on + q * (0.5 * t)] {
            let depth = shape.closest(&point).distance - t;
            let found = world.closest_point(body, &point).unwrap().unwrap();
            let tolerance = 1e-9 * t + 1e-13;
            prop_assert_eq!(found.skeleton, skeleton);
            prop_assert!((found.distance - depth).abs() < tolerance, "{} {depth}", found.distance);
            prop_assert!((shape.closest(&found.position).distance - t).abs() < 1e-13);
            prop_assert!(((found.position - point).norm() - depth.abs()).abs() < tolerance);
            prop_assert!((found.normal - shape.closest(&found.position).normal).norm() < 1e-9);
        }
    }

    #[test]
    fn valid_seeds_lie_on_the_surface_in_their_own_territory(
        skeletons in blends(), pose in poses(5.0), count in 4u32..200,
    ) {
        let skeletons: Vec<_> = skeletons.into_iter().map(|k| SkeletonDesc { seed_count: count, ..k }).collect();
        let (world, _, ids) = blend_of(&skeletons, pose);
        let field_of = |k: &SkeletonDesc, p: &Vec3| {
            let profile = Profile::new(1.0, k.thickness, 0.0, 1.0, k.radius, k.shape.is_solid()).unwrap();
            profile.value_slope(k.shape.transformed(&pose).closest(p).distance).0
        };
        for (own, id) in ids.iter().enumerate() {
            let seeds = world.seeds(*id).unwrap();
            prop_assert!(seeds.len() >= count as usize);
            for seed in seeds {
                let fields: Vec<f64> = skeletons.iter().map(|k| field_of(k, &seed.position)).collect();
                let rival = (0..fields.len()).filter(|k| *k != own).map(|k| fields[k]).fold(0.0, f64::max);
                let sum: f64 = fields.iter().sum();
                if seed.valid {
                    prop_assert!((sum - 1.0).abs() < 1e-10 && fields[own] >= rival - 1e-9, "{} {} {}", sum - 1.0, fields[own], rival);
                } else {
                    // On the border or behind it from the start, inside the solid.
                    prop_assert!(sum >= 1.0 - 1e-9 && fields[own] <= rival + 1e-9, "{own} {fields:?} {sum}");
                }
                prop_assert!((seed.normal.norm() - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn gradients_are_derivatives_of_values(skeletons in blends(), pose in poses(5.0), p in vectors(1.5)) {
        let (world, body, _) = blend_of(&skeletons, pose);
        let p = pose.transform_point(&p);
        let mut gradients = [[0.0; 3]];
        world.evaluate_field(body, &[p.into()], None, Some(&mut gradients)).unwrap();
        let h = 1e-6;
        for (k, slope) in gradients[0].iter().enumerate() {
            let step = Vec3::from_fn(|i, _| if i == k { h } else { 0.0 });
            let f = field(&world, body, &[p + step, p - step, p]);
            let (right, left) = ((f[0] - f[2]) / h, (f[2] - f[1]) / h);
            // One-sided slopes differ where a signed distance has a kink.
            prop_assume!((right - left).abs() < 1e-2);
            prop_assert!((slope - 0.5 * (right + left)).abs() < 1e-2);
        }
    }

    #[test]
    fn overlap_means_that_the_closest_point_is_within_the_radius(
        skeletons in blends(), poses in proptest::collection::vec(poses(2.0), 1..5), center in vectors(3.0),
        radius in 0.0..2.0f64,
    ) {
        let mut world = World::new(WorldDesc::default()).unwrap();
        let bodies: Vec<BodyId> = poses.iter().map(|pose| body(&mut world, *pose, &skeletons).0).collect();
        let distance = |body: &BodyId| world.closest_point(*body, &center).unwrap().unwrap().distance;
        for radius in [radius, 0.0] {
            let expected: Vec<BodyId> = bodies.iter().filter(|body| distance(body) <= radius).copied().collect();
            prop_assert_eq!(world.overlap_sphere(&center, radius, EVERY).unwrap(), expected);
        }
        prop_assert!(world.overlap_sphere(&center, radius, 2).unwrap().is_empty());
    }
}

proptest! {
    // Each case samples the surface densely.
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn closest_points_of_blends_beat_every_sample_of_the_surface(
        skeletons in blends(), pose in poses(1.0), p in vectors(2.5), inside in 0.0..1.2f64,
    ) {
        let skeletons: Vec<_> = skeletons.into_iter().map(|k| SkeletonDesc { seed_count: 2048, ..k }).collect();
        let (world, body, ids) = blend_of(&skeletons, pose);
        // Half of the points in or near the solid.
        let middle = pose.transform_point(&skeletons[0].shape.middle());
        let p = if inside < 0.6 { middle + (p - middle) * (0.2 * inside) } else { p };
        let surface = ids.iter().flat_map(|id| world.seeds(*id).unwrap()).filter(|seed| seed.valid);
        let brute = surface.map(|seed| (seed.position - p).norm()).fold(f64::INFINITY, f64::min);
        let found = world.closest_point(body, &p).unwrap().unwrap();
        let value = field(&world, body, &[found.position])[0];
        prop_assert!((value - 1.0).abs() < 1e-10);
        prop_assert_eq!(found.distance <= 0.0, field(&world, body, &[p])[0] >= 1.0);
        prop_assert!(((found.position - p).norm() - found.distance.abs()).abs() < 1e-12);
        prop_assert!(found.distance.abs() <= brute + 1e-9, "{} {brute}", found.distance);
        // Stationary: the offset is along the normal.
        let off = (p - found.position).cross(&found.normal).norm();
        prop_assert!(off < 1e-6, "{off}");
    }
}

/// The seeds' share of the volume, and how many are valid.
fn seeded_volume(coat: &Coat, thickness: f64, count: usize) -> (f64, usize) {
    let (mut volume, mut valid) = (0.0, 0);
    for (own, placed) in coat.skeletons.iter().enumerate() {
        let (mut rays, mut ends) = (Vec::new(), Vec::new());
        seeds::rays(&placed.shape, thickness, count, &mut rays);
        territory::seeds(coat, own, &rays, &mut ends);
        volume += rays.iter().zip(&ends).map(|(ray, seed)| ray.volume(seed.distance)).sum::<f64>();
        // Just inside the surface, a valid seed is still at home.
        let inside = |seed: &territory::Seed| seed.position - seed.normal * 1e-6;
        let at_home = |seed: &&territory::Seed| territory::owns(&coat.skeletons, coat.isovalue, own, &inside(seed));
        let strays = ends.iter().filter(|seed| seed.is_valid() && !at_home(seed)).count();
        assert!(strays * 1000 < ends.len(), "{strays}");
        valid += ends.iter().filter(|seed| seed.is_valid()).count();
    }
    (volume, valid)
}

/// The solid of two blended points is one of revolution: its volume comes from a quadrature of its outline.
#[test]
fn territories_of_a_dumbbell_fill_its_volume_once() {
    let (half, thickness, radius) = (0.45, 0.5, 1.2);
    let profile = Profile::new(1.0, thickness, 0.0, 1.0, radius, false).unwrap();
    let mut coat = Coat::new(Vec3::zeros(), 1.0);
    for x in [-half, half] {
        coat.add(&Shape::Point(Vec3::new(x, 0.0, 0.0)), profile, &Pose::default());
    }
    let count = 20_000;
    let (volume, valid) = seeded_volume(&coat, thickness, count);
    let outline2 = |x: f64| {
        let excess = |rho: f64| coat.excess(&Vec3::new(x, rho, 0.0));
        let (mut low, mut high) = (0.0, radius);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            if excess(middle) >= 0.0 { low = middle } else { high = middle }
        }
        low * low
    };
    let (end, steps) = (half + radius, 20_000);
    let width = 2.0 * end / f64::from(steps);
    let exact: f64 = (0..steps).map(|k| PI * outline2(-end + (f64::from(k) + 0.5) * width) * width).sum();
    assert!((volume / exact - 1.0).abs() < 1e-3, "{volume} {exact}");
    assert!(valid > count && valid < 2 * count, "{valid}");
}

/// The border between the two points is their plane of symmetry.
#[test]
fn blocked_seeds_of_a_dumbbell_lie_on_its_plane_of_symmetry() {
    let skeletons = [-0.45, 0.45].map(|x| SkeletonDesc {
        shape: Shape::Point(Vec3::new(x, 0.0, 0.0)),
        thickness: 0.5,
        radius: 1.2,
        seed_count: 1000,
        ..SkeletonDesc::default()
    });
    let (world, _, ids) = blend_of(&skeletons, Pose::default());
    for (id, side) in ids.iter().zip([-1.0, 1.0]) {
        let seeds = world.seeds(*id).unwrap();
        let blocked = seeds.iter().filter(|seed| !seed.valid);
        assert!(blocked.clone().count() > 100);
        assert!(blocked.clone().all(|seed| seed.position.x.abs() < 1e-9));
        assert!(seeds.iter().filter(|seed| seed.valid).all(|seed| side * seed.position.x > -1e-9));
    }
}

/// Skeletons that share corners and edges tie in whole regions; each piece of the solid still has one owner.
#[test]
fn territories_of_chains_and_meshes_fill_their_volume_once() {
    let at = |x: f64, y: f64, z: f64| Vec3::new(x, y, z);
    let joints = [at(0.1, 0.2, 0.3), at(1.1, 0.25, 0.3), at(1.6, 1.07, 0.35), at(1.4, 1.3, 1.2)];
    let chain: Vec<Shape> = joints.windows(2).map(|ends| Shape::Segment(ends[0], ends[1])).collect();
    let tent = vec![
        Shape::Triangle(at(0.0, 0.0, 0.0), at(1.0, 0.0, 0.0), at(0.0, 1.0, 0.3)),
        Shape::Triangle(at(1.0, 0.0, 0.0), at(1.1, 1.0, 0.0), at(0.0, 1.0, 0.3)),
    ];
    let pose = Pose { position: at(0.3, 7.0, -2.0), rotation: rotation_from_vector(&at(1.0, 0.4, 0.2)) };
    for shapes in [chain, tent] {
        let profile = Profile::new(1.0, 0.2, 0.0, 1.0, 0.4, false).unwrap();
        let mut coat = Coat::new(pose.position, 1.0);
        for shape in &shapes {
            coat.add(shape, profile, &pose);
        }
        let (volume, _) = seeded_volume(&coat, 0.2, 20_000);
        // Volume by counting cells.
        let ((low, high), cells) = (coat.bounds(), 120u32);
        let size = (high - low) / f64::from(cells);
        let center = |i: u32| {
            let cell = [i % cells, i / cells % cells, i / cells / cells].map(|k| f64::from(k) + 0.5);
            low + size.component_mul(&Vec3::from(cell))
        };
        let inside = (0..cells.pow(3)).filter(|i| coat.excess(&center(*i)) >= 0.0).count();
        let exact = inside as f64 * size.product();
        assert!((volume / exact - 1.0).abs() < 4e-3, "{volume} {exact}");
    }
}

#[test]
fn grazing_rays_are_told_apart_to_a_billionth() {
    let t = 0.3;
    let cube = Shape::Box { center: Vec3::zeros(), half: Vec3::repeat(0.5), axes: Mat3::identity() };
    let segment = Shape::Segment(Vec3::new(-1.0, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0));
    for (shape, height) in [(Shape::Point(Vec3::zeros()), t), (segment, t), (cube, 0.5 + t)] {
        let (world, ..) = single(shape, t, Pose::default());
        for direction in [Vec3::x(), Vec3::y(), Vec3::new(1.0, 1.0, 0.0)] {
            let graze = |z: f64| {
                let origin = Vec3::new(0.0, 0.0, z) - direction * 5.0;
                world.cast_ray(&origin, &direction, 100.0, EVERY).unwrap()
            };
            assert!(graze(height * (1.0 - 1e-9)).is_some(), "{shape:?}");
            assert!(graze(height * (1.0 + 1e-9)).is_none(), "{shape:?}");
        }
    }
}

#[test]
fn rays_along_planes_and_from_ten_thousand_kilometres_keep_their_digits() {
    let plane = Shape::plane(Vec3::zeros(), Vec3::z()).unwrap();
    let (world, ..) = single(plane, 0.1, Pose::default());
    let cast = |origin: Vec3, direction: Vec3| world.cast_ray(&origin, &direction, f64::INFINITY, EVERY).unwrap();
    assert!(cast(Vec3::new(0.0, 0.0, 0.1 + 1e-12), Vec3::x()).is_none());
    assert!(cast(Vec3::new(0.0, 0.0, 5.0), Vec3::z()).is_none());
    assert_eq!(cast(Vec3::new(0.0, 0.0, 0.09), Vec3::x()).unwrap().distance, 0.0);
    let hit = cast(Vec3::new(0.0, 0.0, 1e7), -Vec3::z()).unwrap();
    assert!((hit.distance - (1e7 - 0.1)).abs() < 4e-9 && (hit.position.z - 0.1).abs() < 1e-15);
    // Downhill by one in a hundred million.
    let hit = cast(Vec3::new(0.0, 0.0, 0.2), Vec3::new(1.0, 0.0, -1e-8)).unwrap();
    assert!((hit.distance / 1e7 - 1.0).abs() < 1e-8);

    let (world, ..) = single(Shape::Point(Vec3::zeros()), 0.001, Pose::at(1e7, 0.0, 0.0));
    let cast = |y: f64| world.cast_ray(&Vec3::new(0.0, y, 0.0), &Vec3::x(), 2e7, EVERY).unwrap();
    assert!((cast(0.0).unwrap().distance - (1e7 - 0.001)).abs() < 4e-9);
    assert!(cast(0.000_999).is_some() && cast(0.001_001).is_none());
}

/// Everything is computed near the body, so nothing is lost far from the origin but the rounding of world positions.
#[test]
fn answers_do_not_depend_on_how_far_the_body_is() {
    let skeletons = [-0.375, 0.375].map(|x| SkeletonDesc {
        shape: Shape::Point(Vec3::new(x, 0.25, 0.0)),
        thickness: 0.4,
        radius: 1.0,
        ..SkeletonDesc::default()
    });
    // All positions are multiples of 1/8, which survive the offset exactly.
    let answers = |at: Vec3| {
        let (world, body, ids) = blend_of(&skeletons, Pose { position: at, ..Pose::default() });
        let (origin, down) = (at + Vec3::new(0.125, 4.0, 3.0), Vec3::new(0.0, -4.0, -3.0));
        let hit = world.cast_ray(&origin, &down, 100.0, EVERY).unwrap().unwrap();
        let closest = world.closest_point(body, &(at + Vec3::new(0.125, 1.5, 0.5))).unwrap().unwrap();
        let seeds: Vec<Vec3> = world.seeds(ids[0]).unwrap().iter().map(|seed| seed.normal).collect();
        (hit.distance, hit.normal, closest.distance, closest.normal, seeds)
    };
    assert_eq!(answers(Vec3::zeros()), answers(Vec3::new(1e7, -2e7, 3e7)));
}

#[test]
fn the_first_body_on_a_ray_is_found_whatever_the_order() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let ball = [SkeletonDesc { thickness: 0.5, ..SkeletonDesc::default() }];
    let bodies = [6.0, 2.0, 4.0].map(|x| body(&mut world, Pose::at(x, 0.0, 0.0), &ball).0);
    let cast = |world: &World, mask| world.cast_ray(&Vec3::zeros(), &Vec3::x(), 100.0, mask).unwrap();
    let hit = cast(&world, EVERY).unwrap();
    assert_eq!((hit.body, hit.distance), (bodies[1], 1.5));
    assert!((hit.normal + Vec3::x()).norm() < 1e-12);
    world.set_body_enabled(bodies[1], false).unwrap();
    assert_eq!(cast(&world, EVERY).unwrap().body, bodies[2]);
    world.set_body_desc(bodies[2], BodyDesc { category: 4, ..BodyDesc::default() }).unwrap();
    assert_eq!(cast(&world, 1).unwrap().body, bodies[0]);
    assert_eq!(cast(&world, 4).unwrap().body, bodies[2]);
    assert!(cast(&world, 2).is_none());
    assert!(world.cast_ray(&Vec3::zeros(), &Vec3::x(), 3.0, EVERY).unwrap().is_none());
}

#[test]
fn a_body_without_skeletons_has_no_surface() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let empty = world.create_body(BodyDesc::default()).unwrap();
    assert_eq!(world.closest_point(empty, &Vec3::zeros()).unwrap(), None);
    assert_eq!(field(&world, empty, &[Vec3::zeros()]), [0.0]);
    let (full, ids) = body(&mut world, Pose::default(), &[SkeletonDesc::default()]);
    world.set_skeleton_enabled(ids[0], false).unwrap();
    assert_eq!(world.closest_point(full, &Vec3::zeros()).unwrap(), None);
    assert!(world.seeds(ids[0]).unwrap().is_empty());
    assert!(world.overlap_sphere(&Vec3::zeros(), 10.0, EVERY).unwrap().is_empty());
    assert!(world.cast_ray(&Vec3::zeros(), &Vec3::x(), 1.0, EVERY).unwrap().is_none());
}

#[test]
fn bad_questions_are_refused_with_value_and_range() {
    let (mut world, body, skeleton) = single(Shape::Point(Vec3::zeros()), 0.1, Pose::default());
    let nan = Vec3::new(0.0, f64::NAN, 0.0);
    assert!(world.cast_ray(&nan, &Vec3::x(), 1.0, EVERY).is_err());
    assert!(world.cast_ray(&Vec3::zeros(), &Vec3::zeros(), 1.0, EVERY).unwrap_err().to_string().contains("> 0"));
    assert!(world.cast_ray(&Vec3::zeros(), &Vec3::x(), -1.0, EVERY).unwrap_err().to_string().contains("-1"));
    assert!(world.overlap_sphere(&Vec3::zeros(), f64::NAN, EVERY).is_err());
    assert!(world.closest_point(body, &nan).is_err());
    assert!(world.evaluate_field(body, &[[0.0; 3]], Some(&mut []), None).is_err());
    assert!(world.evaluate_field(body, &[nan.into()], Some(&mut [0.0]), None).is_err());
    world.destroy_body(body).unwrap();
    assert!(world.evaluate_field(body, &[], None, None).is_err());
    assert!(world.closest_point(body, &Vec3::zeros()).is_err() && world.seeds(skeleton).is_err());
}

/// A link's seeds are fixed in its frame: they move and turn with it.
#[test]
fn seeds_follow_their_link() {
    let (mut world, body, skeleton) = single(Shape::Point(Vec3::new(1.0, 0.0, 0.0)), 0.2, Pose::default());
    let before = world.seeds(skeleton).unwrap();
    assert_eq!(before.len(), 64);
    let link = world.body_links(body).unwrap().next().unwrap();
    let turn = rotation_from_vector(&Vec3::new(0.0, 0.0, FRAC_PI_2));
    let pose = Pose { position: Vec3::new(3.0, 4.0, 5.0), rotation: turn };
    let desc = LinkDesc { pose, ..world.link_desc(link).unwrap().clone() };
    world.set_link_desc(link, desc).unwrap();
    for (old, new) in before.iter().zip(world.seeds(skeleton).unwrap()) {
        assert!(new.valid && (new.position - pose.transform_point(&old.position)).norm() < 1e-13);
        assert!((new.normal - turn * old.normal).norm() < 1e-12);
    }
}

#[derive(Default)]
struct Canvas {
    lines: Vec<(Vec3, Vec3)>,
    points: Vec<Vec3>,
}

impl DebugDraw for Canvas {
    fn line(&mut self, a: &Vec3, b: &Vec3, _color: u32) {
        self.lines.push((*a, *b));
    }
    fn point(&mut self, p: &Vec3, size: f64, _color: u32) {
        assert!(size > 0.0);
        self.points.push(*p);
    }
}

#[test]
fn drawings_show_skeletons_seeds_and_bounds() {
    let cuboid = Shape::Box { center: Vec3::zeros(), half: Vec3::new(1.0, 2.0, 3.0), axes: Mat3::identity() };
    let (mut world, body, skeleton) = single(cuboid, 0.5, Pose::at(10.0, 0.0, 0.0));
    let draw = |world: &World, flags| {
        let mut canvas = Canvas::default();
        world.debug_draw(flags, &mut canvas);
        canvas
    };
    let wire = draw(&world, DrawFlags::SKELETONS);
    assert_eq!((wire.lines.len(), wire.points.len()), (12, 0));
    for (a, b) in &wire.lines {
        for end in [a, b] {
            assert_eq!((end - Vec3::x() * 10.0).abs(), Vec3::new(1.0, 2.0, 3.0));
        }
        assert_eq!((a - b).abs().iter().filter(|x| **x > 0.0).count(), 1);
    }
    let seeds = world.seeds(skeleton).unwrap();
    let positions: Vec<Vec3> = seeds.iter().map(|seed| seed.position).collect();
    assert_eq!(draw(&world, DrawFlags::SEEDS).points, positions);
    let bounds = draw(&world, DrawFlags::BOUNDS);
    assert_eq!(bounds.lines.len(), 12);
    let highest = bounds.lines.iter().fold(Vec3::zeros(), |high, (a, b)| high.sup(a).sup(b));
    // The field of the default radius, twice the thickness, ends one metre from the core.
    assert!((highest - Vec3::new(12.0, 3.0, 4.0)).norm() < 1e-12);
    let all = draw(&world, DrawFlags::SKELETONS | DrawFlags::SEEDS | DrawFlags::CONTACTS | DrawFlags::BOUNDS);
    assert_eq!(all.lines.len(), 24 + seeds.len());
    world.set_body_enabled(body, false).unwrap();
    assert!(draw(&world, DrawFlags(15)).lines.is_empty());
}
