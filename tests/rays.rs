//! Many rays in one call, against single rays and against the field itself.

mod common;

use common::{Coat, Random};
use isocoat::World;
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Vec3};
use isocoat::world::query::RayHit;
use isocoat::world::rays::{Ray, RayGoal, RaysDesc};
use isocoat::world::{BodyDesc, BodyId, Deformation, LinkDesc, WorldDesc};

const DEFORMATIONS: [Deformation; 3] = [Deformation::None, Deformation::Contact, Deformation::Bulges];
const T: f64 = 0.1;

fn world() -> World {
    World::new(WorldDesc::default()).unwrap()
}

fn add(world: &mut World, desc: BodyDesc, shapes: &[Shape], pose: Pose) -> BodyId {
    Coat::new(shapes, T).add(world, desc, LinkDesc { pose, ..LinkDesc::default() }).0
}

fn place(random: &mut Random, size: f64) -> Vec3 {
    Vec3::from_fn(|_, _| random.range(-size, size))
}

fn some_shape(random: &mut Random) -> Shape {
    match (random.unit() * 4.0) as u32 {
        0 => Shape::Point(place(random, 0.4)),
        1 => Shape::segment(place(random, 0.4), place(random, 0.4)),
        2 => Shape::triangle(place(random, 0.4), place(random, 0.4), place(random, 0.4)),
        _ => Shape::Box {
            center: place(random, 0.4),
            half: place(random, 0.2).map(|x| x.abs() + 0.02),
            axes: *random.rotation().to_rotation_matrix().matrix(),
        },
    }
}

/// Bodies that overlap a little, one of them with parts that don't blend, and a floor.
fn scene(random: &mut Random) -> World {
    let mut world = world();
    let desc = BodyDesc { bulge_width: 0.6, bulge_height: 1.0, ..BodyDesc::default() };
    for k in 0..4 {
        let shapes: Vec<Shape> = (0..1 + (random.unit() * 5.0) as usize).map(|_| some_shape(random)).collect();
        let pose = Pose { position: place(random, 0.7), rotation: random.rotation() };
        let body = add(&mut world, desc.clone(), &shapes, pose);
        if k == 0 {
            let link = world.body_links(body).unwrap().next().unwrap();
            let skeletons: Vec<_> = world.link_skeletons(link).unwrap().collect();
            for (i, a) in skeletons.iter().enumerate() {
                skeletons[..i].iter().for_each(|b| world.set_blend(*a, *b, 0.0, 0.0).unwrap());
            }
        }
    }
    let plane = Shape::Plane { point: Vec3::zeros(), normal: Vec3::z() };
    add(&mut world, BodyDesc { rigid: true, ..desc }, &[plane], Pose::at(0.0, 0.0, -0.9));
    world
}

fn cast(world: &World, rays: &[Ray], desc: &RaysDesc) -> Vec<Option<RayHit>> {
    let mut hits = Vec::new();
    world
        .cast_rays(rays.iter().copied(), desc, |index, hit| {
            assert_eq!(index, hits.len());
            hits.push(hit);
        })
        .unwrap();
    hits
}

fn some_rays(random: &mut Random, count: usize) -> Vec<Ray> {
    let ray = |random: &mut Random| Ray {
        origin: place(random, 2.5),
        direction: random.direction() * random.range(0.1, 5.0),
        max_distance: if random.unit() < 0.5 { f64::INFINITY } else { random.range(0.0, 4.0) },
    };
    // Most towards the middle.
    (0..count)
        .map(|k| {
            let ray = ray(random);
            if k % 4 == 0 { ray } else { Ray { direction: place(random, 0.8) - ray.origin, ..ray } }
        })
        .collect()
}

#[test]
fn many_rays_meet_what_each_alone_meets() {
    let mut random = Random(3);
    let (mut hits, mut total) = (0, 0);
    for _ in 0..12 {
        let world = scene(&mut random);
        let rays = some_rays(&mut random, 150);
        for deformation in DEFORMATIONS {
            let desc = RaysDesc { deformation, ..RaysDesc::default() };
            for (ray, hit) in rays.iter().zip(cast(&world, &rays, &desc)) {
                let alone = world
                    .cast_ray_deformed(&ray.origin, &ray.direction, ray.max_distance, u64::MAX, deformation)
                    .unwrap();
                total += 1;
                assert_eq!(hit, alone, "to the bit: {ray:?} {deformation:?}");
                hits += u32::from(hit.is_some());
            }
        }
    }
    println!("{hits} hits of {total} rays");
    assert!(hits * 2 > total);
}

#[test]
fn any_hit_is_found_where_there_is_one_and_lies_on_a_surface() {
    let mut random = Random(4);
    for _ in 0..10 {
        let world = scene(&mut random);
        let rays = some_rays(&mut random, 200);
        let closest = cast(&world, &rays, &RaysDesc::default());
        let any = cast(&world, &rays, &RaysDesc { goal: RayGoal::Any, ..RaysDesc::default() });
        for ((ray, closest), any) in rays.iter().zip(closest).zip(any) {
            assert_eq!(closest.is_some(), any.is_some(), "{ray:?}");
            let Some(any) = any else { continue };
            assert!(any.distance <= ray.max_distance && any.distance >= closest.unwrap().distance - 1e-9);
            let mut value = [0.0];
            world.evaluate_field(any.body, &[any.position.into()], Some(&mut value), None).unwrap();
            assert!((value[0] - 1.0).abs() < 1e-6 || any.distance == 0.0 && value[0] >= 1.0);
        }
    }
}

#[test]
fn a_picture_of_a_blob_lies_on_its_surface_to_a_millionth_of_the_thickness() {
    let mut random = Random(5);
    for far in [0.0, 1e6] {
        let mut world = world();
        let points: Vec<Shape> = (0..100).map(|_| Shape::Point(place(&mut random, 0.5))).collect();
        let body = add(&mut world, BodyDesc::default(), &points, Pose::at(far, 0.0, 0.0));
        let eye = Vec3::new(far, -2.0, 0.0);
        let through = |k: usize| Vec3::new((k % 64) as f64 / 42.0 - 0.75, 1.3, (k / 64) as f64 / 42.0 - 0.75);
        let rays: Vec<Ray> =
            (0..64 * 64).map(|k| Ray { origin: eye, direction: through(k), max_distance: f64::INFINITY }).collect();
        let hits: Vec<RayHit> = cast(&world, &rays, &RaysDesc::default()).into_iter().flatten().collect();
        let positions: Vec<[f64; 3]> = hits.iter().map(|hit| hit.position.into()).collect();
        let (mut values, mut gradients) = (vec![0.0; hits.len()], vec![[0.0; 3]; hits.len()]);
        world.evaluate_field(body, &positions, Some(&mut values), Some(&mut gradients)).unwrap();
        let mut worst = 0.0_f64;
        for ((hit, value), gradient) in hits.iter().zip(&values).zip(&gradients) {
            let slope = Vec3::from(*gradient);
            worst = worst.max((value - 1.0).abs() / slope.norm());
            assert!((hit.normal + slope.normalize()).norm() < 1e-6);
        }
        println!("{} hits, {worst:.1e} m off the surface at {far} m", hits.len());
        assert!(hits.len() > 1000 && worst < 1e-6 * T);
    }
}

#[test]
fn a_ray_that_makes_no_sense_is_named_before_anything_is_told() {
    let mut world = world();
    add(&mut world, BodyDesc::default(), &[Shape::Point(Vec3::zeros())], Pose::default());
    let good = Ray { origin: Vec3::new(0.0, 0.0, 1.0), direction: -Vec3::z(), max_distance: f64::INFINITY };
    let bad = [
        (Ray { direction: Vec3::zeros(), ..good }, "> 0"),
        (Ray { origin: Vec3::new(0.0, f64::NAN, 0.0), ..good }, "NaN"),
        (Ray { max_distance: -1.0, ..good }, "max_distance is -1; must be at least 0"),
    ];
    for (ray, text) in bad {
        let (index, error) =
            world.cast_rays([good, good, ray].into_iter(), &RaysDesc::default(), |_, _| panic!("told")).unwrap_err();
        assert_eq!(index, 2);
        assert!(error.to_string().contains(text), "{error}");
    }
    assert!(cast(&world, &[], &RaysDesc::default()).is_empty());
    assert!(cast(&world, &[good], &RaysDesc { mask: 2, ..RaysDesc::default() })[0].is_none());
    let cube = Shape::Box { center: Vec3::zeros(), half: Vec3::repeat(0.1), axes: Mat3::identity() };
    add(&mut world, BodyDesc::default(), &[cube], Pose::at(0.0, 0.0, 0.5));
    let hit = cast(&world, &[good], &RaysDesc::default())[0].unwrap();
    assert!((hit.distance - 0.3).abs() < 1e-12 && (hit.normal - Vec3::z()).norm() < 1e-12);
}
