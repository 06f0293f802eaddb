//! Coats as their contacts deform them, and the bulges round contacts: against closed forms, differences and brute
//! force. Figures: `cargo test --release --test bulge -- --nocapture`; pictures go to the target folder.

mod common;

use common::{Coat, Random};
use isocoat::World;
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3, tangents};
use isocoat::world::{BodyDesc, BodyId, Deformation, LinkDesc, Scheme, SkeletonDesc, WorldDesc};

const T: f64 = 0.1;
const EVERY: u64 = u64::MAX;
const DEFORMED: [Deformation; 2] = [Deformation::Contact, Deformation::Bulges];

fn soft(stiffness_scale: f64, width: f64, height: f64) -> BodyDesc {
    BodyDesc { stiffness_scale, bulge_width: width, bulge_height: height, ..BodyDesc::default() }
}

fn hard() -> BodyDesc {
    BodyDesc { rigid: true, ..BodyDesc::default() }
}

fn add(world: &mut World, desc: BodyDesc, shapes: &[Shape], pose: Pose) -> BodyId {
    Coat::new(shapes, T).add(world, desc, LinkDesc { pose, ..LinkDesc::default() }).0
}

fn ball(world: &mut World, desc: BodyDesc, center: Vec3) -> BodyId {
    add(world, desc, &[Shape::Point(Vec3::zeros())], Pose { position: center, ..Pose::default() })
}

/// A half-space below z = 0.
fn floor(world: &mut World, desc: BodyDesc) -> BodyId {
    let plane = Shape::Plane { point: Vec3::new(0.0, 0.0, -T), normal: Vec3::z() };
    add(world, desc, &[plane], Pose::default())
}

/// `f - c` and its gradient.
fn excess(world: &World, body: BodyId, p: &Vec3, deformation: Deformation) -> (f64, Vec3) {
    let (mut value, mut gradient) = ([0.0], [[0.0; 3]]);
    let points = [(*p).into()];
    world.evaluate_field_deformed(body, &points, Some(&mut value), Some(&mut gradient), deformation).unwrap();
    (value[0] - world.body_desc(body).unwrap().isovalue, gradient[0].into())
}

/// `f - c` at many points: one call finds the contacts once.
fn excesses(world: &World, body: BodyId, points: &[Vec3], deformation: Deformation) -> Vec<f64> {
    let points: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
    let mut values = vec![0.0; points.len()];
    world.evaluate_field_deformed(body, &points, Some(&mut values), None, deformation).unwrap();
    let isovalue = world.body_desc(body).unwrap().isovalue;
    values.into_iter().map(|value| value - isovalue).collect()
}

/// Where a function changes sign between two points.
fn root(f: impl Fn(&Vec3) -> f64, mut a: Vec3, mut b: Vec3) -> Option<Vec3> {
    let sign = f(&a) >= 0.0;
    if (f(&b) >= 0.0) == sign {
        return None;
    }
    for _ in 0..60 {
        let middle = (a + b) * 0.5;
        if (f(&middle) >= 0.0) == sign { a = middle } else { b = middle }
    }
    Some((a + b) * 0.5)
}

/// Two touching bodies, and what the pair is called.
struct Scene {
    name: &'static str,
    world: World,
    bodies: [BodyId; 2],
}

/// Contacts of every kind in random poses.
fn scenes(count: usize, random: &mut Random) -> Vec<Scene> {
    let mut scenes = Vec::new();
    for index in 0..count {
        let mut world = World::new(WorldDesc::default()).unwrap();
        let stiffer = 10.0_f64.powf(random.range(0.1, 4.0));
        let mut material = |scale: f64| soft(scale, random.range(0.1, 1.0), random.range(0.2, 2.0));
        let (name, a, b) = match index % 4 {
            0 => ("equal K", material(1e5), material(1e5)),
            1 => ("on a stiffer one", material(1e5), material(1e5 * stiffer)),
            2 => ("on a softer one", material(1e5 * stiffer), material(1e5)),
            _ => ("on a rigid one", material(1e5), hard()),
        };
        let point = || Shape::Point(Vec3::zeros());
        let blend = |random: &mut Random| {
            let apart = random.direction() * random.range(0.8, 1.6) * T;
            vec![point(), Shape::Point(apart), Shape::segment(apart, apart + random.direction() * T)]
        };
        let shapes_a = if index / 4 % 2 == 0 { vec![point()] } else { blend(random) };
        let shapes_b = match index / 8 % 4 {
            0 => vec![point()],
            1 => blend(random),
            2 => vec![Shape::segment(-Vec3::x(), Vec3::x())],
            _ => vec![Shape::Box {
                center: Vec3::zeros(),
                half: Vec3::repeat(0.15),
                axes: nalgebra::Matrix3::identity(),
            }],
        };
        let pose_b = Pose { position: random.direction(), rotation: random.rotation() };
        let b = add(&mut world, b, &shapes_b, pose_b);
        let a = add(&mut world, a, &shapes_a, Pose { position: Vec3::zeros(), rotation: random.rotation() });
        // The first body comes in until its coat overlaps the other's by a part of its thickness.
        let link = world.body_links(a).unwrap().next().unwrap();
        let place = |world: &mut World, position: Vec3| {
            let mut state = world.link_state(link).unwrap();
            state.pose.position = position;
            world.set_link_state(link, &state).unwrap();
        };
        let (toward, depth) = (random.direction(), random.range(0.02, 0.4) * T);
        let (mut near, mut far) = (0.0, 3.0);
        for _ in 0..60 {
            let middle = 0.5 * (near + far);
            place(&mut world, pose_b.position + toward * middle);
            let touches = !world.collide(a, b, Scheme::Auto, 0.1).unwrap().is_empty();
            if touches { near = middle } else { far = middle }
        }
        place(&mut world, pose_b.position + toward * (near - depth));
        scenes.push(Scene { name, world, bodies: [a, b] });
    }
    scenes
}

/// Points of the border of a contact: both undeformed coats' surfaces.
fn border(scene: &Scene, random: &mut Random) -> Option<Vec3> {
    let Scene { world, bodies: [a, b], .. } = scene;
    let contacts = world.collide(*a, *b, Scheme::Auto, 1e-2).unwrap();
    let mut x = contacts.first()?.position + random.direction() * T;
    for _ in 0..60 {
        let (u, gu) = excess(world, *a, &x, Deformation::None);
        let (v, gv) = excess(world, *b, &x, Deformation::None);
        let (uu, uv, vv) = (gu.norm_squared(), gu.dot(&gv), gv.norm_squared());
        let determinant = uu * vv - uv * uv;
        if determinant < 1e-3 * uu * vv || uu * vv == 0.0 {
            return None;
        }
        let step = gu * ((vv * u - uv * v) / determinant) + gv * ((uu * v - uv * u) / determinant);
        x -= step * (0.3 * T / step.norm()).min(1.0);
        if step.norm() < 1e-15 {
            return Some(x);
        }
    }
    None
}

/// The angle by which the deformed surface of a bends at a point of the border, from chords on either side \[degrees\].
fn kink(scene: &Scene, x: &Vec3, deformation: Deformation) -> f64 {
    let Scene { world, bodies: [a, b], .. } = scene;
    let (_, ga) = excess(world, *a, x, Deformation::None);
    let (_, gb) = excess(world, *b, x, Deformation::None);
    let [ka, kb] = [a, b].map(|body| world.body_desc(*body).unwrap().stiffness_scale);
    let normal = if world.body_desc(*b).unwrap().rigid { gb } else { gb * kb - ga * ka }.normalize();
    let inwards = normal.cross(&ga.cross(&gb)).normalize();
    let inwards = inwards * inwards.dot(&(ga + gb)).signum();
    let h = 1e-7 * T;
    let side = |sign: f64| {
        let from = x + inwards * (sign * h);
        let field = |p: &Vec3| excess(world, *a, p, deformation).0;
        // Without a bulge the surface may turn away by more than a right angle.
        root(field, from + normal * (20.0 * h), from - normal * (20.0 * h)).map(|y| (y - x).normalize())
    };
    match (side(1.0), side(-1.0)) {
        (Some(inner), Some(outer)) => inner.dot(&-outer).clamp(-1.0, 1.0).acos().to_degrees(),
        _ => 180.0,
    }
}

#[test]
fn a_bulge_joins_its_contact_without_a_kink() {
    let random = &mut Random(1);
    let mut worst = std::collections::BTreeMap::<&str, (usize, f64, f64)>::new();
    for scene in scenes(320, random) {
        for _ in 0..12 {
            let Some(x) = border(&scene, random) else { continue };
            let found = worst.entry(scene.name).or_default();
            let with = kink(&scene, &x, Deformation::Bulges);
            assert!(with < 0.5, "{}: {with} degrees at {x:?}", scene.name);
            let without = kink(&scene, &x, Deformation::Contact);
            *found = (found.0 + 1, found.1.max(with), found.2.max(without));
        }
    }
    for (name, (count, with, without)) in worst {
        println!("{name}: {count} places, kink {with:.2e} degrees with bulges, {without:.1} without");
        assert!(count > 50, "{name}");
    }
}

/// The lowest excess of the undeformed coat on the deformed surface of a ball: how high its bulge is, in units of
/// field. Along a meridian round the axis that points to the other.
fn height(world: &World, body: BodyId, center: &Vec3, axis: &Vec3, depth: f64) -> f64 {
    let across = tangents(axis).0;
    let at = |angle: f64| {
        let u = axis * angle.cos() + across * angle.sin();
        let field = |p: &Vec3| excess(world, body, p, Deformation::Bulges).0;
        let x = root(field, center + u * (0.3 * T), center + u * (1.9 * T)).expect("star-shaped");
        -excess(world, body, &x, Deformation::None).0
    };
    let grid = 100;
    // The border is at an angle of about the root of the depth over the thickness.
    let step = (6.0 * depth.sqrt()).min(1.5) / f64::from(grid);
    let heights: Vec<f64> = (0..grid).map(|i| at(f64::from(i + 1) * step)).collect();
    let best = (0..grid).max_by(|a, b| heights[*a as usize].total_cmp(&heights[*b as usize])).unwrap();
    let (mut low, mut high) = (f64::from(best) * step, f64::from(best + 2) * step);
    for _ in 0..40 {
        let (a, b) = (low + (high - low) * 0.382, low + (high - low) * 0.618);
        if at(a) > at(b) { high = b } else { low = a }
    }
    at(0.5 * (low + high))
}

#[test]
fn a_bulge_grows_with_depth_from_nothing_at_first_touch_to_a_third_of_its_width() {
    // The slope of a default profile is 2 c / t: a ball that gives way by δ is compressed by 2 c δ / t.
    for (alpha, width) in [(1.0, 0.5), (0.5, 1.0), (2.0, 0.3)] {
        for (name, rigid) in [("two balls", false), ("ball on a rigid floor", true)] {
            let mut last = 0.0;
            for depth in [1e-9, 1e-6, 1e-4, 1e-3, 0.01, 0.02, 0.04, 0.08, 0.12, 0.16, 0.2, 0.3] {
                let mut world = World::new(WorldDesc::default()).unwrap();
                let (center, share, compressed) = if rigid {
                    floor(&mut world, hard());
                    (Vec3::z() * T * (1.0 - depth), 1.0, 2.0 * depth)
                } else {
                    ball(&mut world, soft(1e5, 0.0, 0.0), -Vec3::z() * T * (1.0 - 0.5 * depth));
                    (Vec3::z() * T * (1.0 - 0.5 * depth), 0.5, depth)
                };
                let body = ball(&mut world, soft(1e5, width, alpha), center);
                let measured = height(&world, body, &center, &-Vec3::z(), depth);
                let expected = (alpha * compressed).min(share * width / 3.0);
                println!("{name}, alpha {alpha}, width {width}, depth {depth:e} t: bulge {measured:.3e} c");
                assert!((measured - expected).abs() < 1e-6 * expected + 1e-12, "{measured} {expected}");
                assert!(measured >= last * (1.0 - 1e-6), "{measured} after {last}");
                last = measured;
            }
        }
    }
}

#[test]
fn deformed_solids_never_share_space() {
    let random = &mut Random(2);
    let (mut both, mut looked) = (f64::NEG_INFINITY, 0);
    for scene in scenes(96, random) {
        let Scene { world, bodies: [a, b], .. } = &scene;
        let Some(contact) = world.collide(*a, *b, Scheme::Auto, 0.1).unwrap().first().cloned() else { continue };
        for deformation in DEFORMED {
            let points: Vec<Vec3> =
                (0..4000).map(|_| contact.position + random.direction() * random.range(0.0, 1.5 * T)).collect();
            let [of_a, of_b] = [a, b].map(|body| excesses(world, *body, &points, deformation));
            for (p, least) in points.iter().zip(of_a.iter().zip(&of_b).map(|(x, y)| x.min(*y))) {
                both = both.max(least);
                looked += 1;
                assert!(least < 1e-12, "{} {deformation:?}: {least} at {p:?}", scene.name);
            }
        }
    }
    println!("{looked} points; the most that one is inside both is {both:.1e} c");
}

/// Several bodies round one, some of them touching it and each other, some close by only.
fn crowd(random: &mut Random) -> (World, Vec<BodyId>) {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let mut bodies = Vec::new();
    for index in 0..5 {
        let scale = 1e5 * 10.0_f64.powf(random.range(-1.0, 1.0));
        let desc = if index == 4 { hard() } else { soft(scale, random.range(0.2, 1.0), random.range(0.3, 2.0)) };
        let center = random.direction() * if index == 0 { 0.0 } else { random.range(1.5, 2.2) * T };
        bodies.push(ball(&mut world, desc, center));
    }
    (world, bodies)
}

#[test]
fn a_crowd_tiles_space_by_the_highest_pressure() {
    let random = &mut Random(3);
    let (mut both, mut gap) = (f64::NEG_INFINITY, 0.0_f64);
    for _ in 0..60 {
        let (world, bodies) = crowd(random);
        let points: Vec<Vec3> = (0..1500).map(|_| random.direction() * random.range(0.0, 2.5 * T)).collect();
        let all = |deformation| -> Vec<Vec<f64>> {
            bodies.iter().map(|body| excesses(&world, *body, &points, deformation)).collect()
        };
        let plain = all(Deformation::None);
        for deformation in DEFORMED {
            let deformed = all(deformation);
            for (index, p) in points.iter().enumerate() {
                let mut inside: Vec<f64> = deformed.iter().map(|values| values[index]).collect();
                inside.sort_by(f64::total_cmp);
                both = both.max(inside[3]);
                assert!(inside[3] < 1e-12, "{deformation:?}: {inside:?} at {p:?}");
                // What belonged to someone still does.
                if plain.iter().any(|values| values[index] > 0.0) {
                    gap = gap.max(-inside[4]);
                    assert!(inside[4] > -1e-12, "{deformation:?}: {inside:?} at {p:?}");
                }
            }
        }
    }
    println!("crowds: the most inside two {both:.1e} c, the widest gap {gap:.1e} c");
}

#[test]
fn the_deformed_surface_is_the_contact_surface() {
    let random = &mut Random(4);
    let (mut worst, mut count) = (0.0_f64, 0);
    for scene in scenes(160, random) {
        let Scene { world, bodies: [a, b], .. } = &scene;
        let [ka, kb] = [a, b].map(|body| world.body_desc(*body).unwrap().stiffness_scale);
        let rigid = world.body_desc(*b).unwrap().rigid;
        let undeformed = |body: &BodyId, p: &Vec3| excess(world, *body, p, Deformation::None).0;
        let difference =
            |p: &Vec3| if rigid { -undeformed(b, p) } else { ka * undeformed(a, p) - kb * undeformed(b, p) };
        let Some(contact) = world.collide(*a, *b, Scheme::Auto, 0.1).unwrap().first().cloned() else { continue };
        for _ in 0..40 {
            let p = contact.position + random.direction() * random.range(0.0, T);
            let Some(x) = root(difference, p, p + random.direction() * T) else { continue };
            if undeformed(a, &x) <= 0.0 || undeformed(b, &x) < -1e-12 {
                continue;
            }
            for deformation in DEFORMED {
                let (value, gradient) = excess(world, *a, &x, deformation);
                let off = value.abs() / gradient.norm();
                worst = worst.max(off / T);
                assert!(off < 1e-6 * T, "{} {deformation:?}: {off}", scene.name);
            }
            count += 1;
        }
    }
    println!("{count} points of equal pressure are within {worst:.1e} t of the deformed surface");
    assert!(count > 500);
}

#[test]
fn beyond_its_width_a_contact_changes_nothing_to_the_bit() {
    let random = &mut Random(5);
    let (mut changed, mut same) = (0, 0);
    for scene in scenes(96, random) {
        let Scene { world, bodies: [a, b], .. } = &scene;
        let width = world.body_desc(*a).unwrap().bulge_width;
        let position = world.link_state(world.body_links(*a).unwrap().next().unwrap()).unwrap().pose.position;
        for _ in 0..400 {
            let p = position + random.direction() * random.range(0.0, 3.0 * T);
            let [plain, bulged] = [Deformation::None, Deformation::Bulges].map(|d| excess(world, *a, &p, d));
            if excess(world, *b, &p, Deformation::None).0 <= -width {
                assert_eq!(plain, bulged, "{}", scene.name);
                same += 1;
            } else {
                changed += usize::from(plain != bulged);
            }
        }
    }
    println!("{same} points beyond the width are the same, {changed} within it are not");
    assert!(same > 1000 && changed > 1000);
}

#[test]
fn deformed_fields_are_continuous_and_their_gradients_are_their_derivatives() {
    let random = &mut Random(6);
    let h = 1e-7 * T;
    let (mut steepest, mut off, mut count) = (0.0_f64, 0, 0);
    for round in 0..120 {
        let (world, body) = if round % 2 == 0 {
            let scene = scenes(4, random).swap_remove(round / 2 % 4);
            (scene.world, scene.bodies[0])
        } else {
            let (world, bodies) = crowd(random);
            (world, bodies[0])
        };
        let position = world.link_state(world.body_links(body).unwrap().next().unwrap()).unwrap().pose.position;
        for deformation in DEFORMED {
            for _ in 0..200 {
                let (p, u) = (position + random.direction() * random.range(0.0, 2.2 * T), random.direction());
                let (at, gradient) = excess(&world, body, &p, deformation);
                let ahead = excess(&world, body, &(p + u * h), deformation).0;
                let rate = (ahead - at) / h;
                steepest = steepest.max(rate.abs() * T);
                // A step in the field would be a rate without bound.
                assert!(rate.abs() * T < 1e3, "{rate}");
                count += 1;
                off += usize::from((rate - gradient.dot(&u)).abs() * T > 1e-3);
            }
        }
    }
    println!("{count} places: rates up to {steepest:.1} c/t; {off} across a crease");
    // Creases are surfaces: hardly any step crosses one.
    assert!(off * 1000 < count);
}

#[test]
fn rays_end_on_the_deformed_surface_and_pass_none_before() {
    let random = &mut Random(7);
    let (mut worst, mut hits, mut misses) = (0.0_f64, 0, 0);
    for round in 0..60 {
        let (world, bodies) = crowd(random);
        let body = bodies[round % 4];
        let category = world.body_desc(body).unwrap().category;
        // Only one body is to be hit, all of them press on it.
        for other in &bodies {
            let desc = world.body_desc(*other).unwrap().clone();
            assert_eq!(desc.category, category);
        }
        let mut world = world;
        let desc = BodyDesc { category: 2 | category, ..world.body_desc(body).unwrap().clone() };
        world.set_body_desc(body, desc).unwrap();
        for deformation in DEFORMED {
            for _ in 0..40 {
                let target = random.direction() * random.range(0.0, 2.5 * T);
                let direction = random.direction();
                let origin = target - direction * random.range(0.0, 8.0 * T);
                let field = |s: f64| excess(&world, body, &(origin + direction * s), deformation).0;
                let hit = world.cast_ray_deformed(&origin, &direction, 10.0, 2, deformation).unwrap();
                let end = hit.map_or(1.0, |hit| hit.distance);
                // 2000 places before the end are outside; what may be missed is a chord of 1/1024 of the reach.
                let slack = 2.0 * T / 1024.0;
                let places: Vec<f64> = (0..2000).map(|i| end * f64::from(i) / 2000.0).collect();
                let points: Vec<Vec3> = places.iter().map(|s| origin + direction * *s).collect();
                for (s, value) in places.iter().zip(excesses(&world, body, &points, deformation)) {
                    if *s < end && value > 0.0 {
                        assert!(field(s - slack) < 0.0 && field(s + slack) < 0.0, "{deformation:?} {s} of {end}");
                    }
                }
                let Some(hit) = hit else {
                    misses += 1;
                    continue;
                };
                hits += 1;
                assert!((origin + direction * hit.distance - hit.position).norm() < 1e-12);
                if hit.distance > 0.0 {
                    let (value, gradient) = excess(&world, body, &hit.position, deformation);
                    worst = worst.max(value.abs() / gradient.norm() / T);
                    assert!(value.abs() < 1e-6 * T * gradient.norm(), "{deformation:?} {value}");
                    assert!((hit.normal + gradient.normalize()).norm() < 1e-9);
                }
            }
        }
    }
    println!("{hits} hits within {worst:.1e} t of the deformed surface, {misses} misses");
    assert!(hits > 500 && misses > 500);
}

#[test]
fn closest_points_lie_on_the_deformed_surface_and_no_other_is_closer() {
    let random = &mut Random(8);
    let (mut worst, mut excessive, mut changed, mut count) = (0.0_f64, 0.0_f64, 0, 0);
    for round in 0..60 {
        let (world, body) = if round % 2 == 0 {
            let scene = scenes(8, random).swap_remove(round / 2 % 8);
            (scene.world, scene.bodies[0])
        } else {
            let (world, bodies) = crowd(random);
            (world, bodies[0])
        };
        let position = world.link_state(world.body_links(body).unwrap().next().unwrap()).unwrap().pose.position;
        for deformation in DEFORMED {
            for _ in 0..6 {
                let p = position + random.direction() * random.range(0.0, 3.0 * T);
                let hit = world.closest_point_deformed(body, &p, deformation).unwrap().unwrap();
                let inside = excess(&world, body, &p, deformation).0 >= 0.0;
                assert_eq!(inside, hit.distance <= 0.0);
                assert!(((p - hit.position).norm() - hit.distance.abs()).abs() < 1e-12);
                let (value, gradient) = excess(&world, body, &hit.position, deformation);
                worst = worst.max(value.abs() / gradient.norm() / T);
                assert!(value.abs() < 1e-6 * T * gradient.norm(), "{deformation:?} {value}");
                // Nothing of the surface is nearer: points of a ball slightly smaller have one sign.
                let near: Vec<Vec3> = (0..4000)
                    .map(|_| p + random.direction() * (hit.distance.abs() * random.unit().cbrt() * 0.9999))
                    .collect();
                for (q, value) in near.iter().zip(excesses(&world, body, &near, deformation)) {
                    if (value >= 0.0) != inside {
                        excessive = excessive.max(1.0 - (q - p).norm() / hit.distance.abs());
                    }
                }
                changed += usize::from(world.closest_point(body, &p).unwrap().unwrap() != hit);
                count += 1;
            }
        }
    }
    println!(
        "{count} closest points within {worst:.1e} t, {changed} of them deformed; nearer ones by up to {excessive:.1e}"
    );
    assert!(excessive < 1e-3, "{excessive}");
    assert!(changed * 4 > count);
}

#[test]
fn bulges_change_no_force_and_no_undeformed_query() {
    let run = |width: f64| {
        let mut world = World::new(WorldDesc { gravity: -Vec3::z() * 9.81, ..WorldDesc::default() }).unwrap();
        floor(&mut world, hard());
        let body = world.create_body(soft(1e5, width, 1.0)).unwrap();
        let pose = Pose { position: Vec3::z() * 0.12, ..Pose::default() };
        let kind = isocoat::base::Kind::PointMass;
        let link = world.create_link(body, LinkDesc { kind, pose, mass: 1.0, ..LinkDesc::default() }).unwrap();
        world.create_skeleton(link, SkeletonDesc { thickness: T, ..SkeletonDesc::default() }).unwrap();
        for _ in 0..60 {
            world.step(1.0 / 60.0).unwrap();
        }
        let ray = world.cast_ray(&Vec3::new(0.01, 0.0, 1.0), &-Vec3::z(), 10.0, EVERY).unwrap().unwrap();
        (world.link_state(link).unwrap(), ray.distance, ray.position)
    };
    assert_eq!(run(0.0), run(1.0));
}

// Pictures.

struct Picture {
    size: [u32; 2],
    pixels: Vec<u8>,
}

impl Picture {
    /// A section of bodies in the plane y = 0: `metres` wide about a centre.
    fn section(world: &World, bodies: &[BodyId], center: [f64; 2], metres: f64, deformation: Deformation) -> Self {
        const COLORS: [[f64; 3]; 4] = [[0.86, 0.45, 0.35], [0.35, 0.55, 0.86], [0.45, 0.75, 0.45], [0.8, 0.7, 0.3]];
        let size = [900u32, 700];
        let pixel = metres / f64::from(size[0]);
        let at = |column: u32, row: u32| {
            let (x, z) = ((f64::from(column) - 450.0) * pixel, (f64::from(row) - 350.0) * pixel);
            [center[0] + x, 0.0, center[1] - z]
        };
        let points: Vec<[f64; 3]> = (0..size[1])
            .flat_map(|row| (0..size[0]).map(move |column| (column, row)))
            .map(|(column, row)| at(column, row))
            .collect();
        // Of each body: how far each point is outside, to first order.
        let distances = |body: &BodyId, deformation: Deformation| -> Vec<f64> {
            let (mut values, mut gradients) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
            world
                .evaluate_field_deformed(*body, &points, Some(&mut values), Some(&mut gradients), deformation)
                .unwrap();
            let distance = |(value, gradient): (&f64, &[f64; 3])| (1.0 - value) / Vec3::from(*gradient).norm();
            values.iter().zip(&gradients).map(distance).collect()
        };
        let shapes: Vec<_> =
            bodies.iter().map(|body| [distances(body, deformation), distances(body, Deformation::None)]).collect();
        let mut pixels = Vec::new();
        for index in 0..points.len() {
            let mut color = [1.0; 3];
            let inside = |shape: &[Vec<f64>; 2]| shape[0][index] <= -0.01 * pixel;
            if shapes.iter().filter(|shape| inside(shape)).count() > 1 {
                // In two solids at once.
                color = [1.0, 0.0, 1.0];
            } else {
                for (shape, fill) in shapes.iter().zip(COLORS) {
                    if inside(shape) {
                        color = fill.map(|x| if shape[0][index] > -2.0 * pixel { 0.6 * x } else { 0.4 + 0.6 * x });
                    }
                    let (column, row) = (index % size[0] as usize, index / size[0] as usize);
                    let dash = (column / 6 + row / 6).is_multiple_of(2);
                    if dash && shape[1][index].abs() < 0.6 * pixel {
                        color = [0.3; 3];
                    }
                }
            }
            pixels.extend(color.map(|x| (x * 255.0) as u8));
        }
        Self { size, pixels }
    }

    fn write(&self, name: &str) {
        let mut rows = Vec::new();
        for row in self.pixels.chunks(3 * self.size[0] as usize) {
            rows.push(0);
            rows.extend_from_slice(row);
        }
        // Stored blocks: no compressor needed.
        let mut stream = vec![0x78, 0x01];
        let blocks = rows.chunks(65535).count();
        for (index, block) in rows.chunks(65535).enumerate() {
            stream.push(u8::from(index + 1 == blocks));
            stream.extend((block.len() as u16).to_le_bytes());
            stream.extend((!(block.len() as u16)).to_le_bytes());
            stream.extend_from_slice(block);
        }
        let (mut a, mut b) = (1u32, 0u32);
        for byte in &rows {
            a = (a + u32::from(*byte)) % 65521;
            b = (b + a) % 65521;
        }
        stream.extend((b << 16 | a).to_be_bytes());
        let mut file = b"\x89PNG\r\n\x1a\n".to_vec();
        let mut header = Vec::new();
        header.extend(self.size[0].to_be_bytes());
        header.extend(self.size[1].to_be_bytes());
        header.extend([8, 2, 0, 0, 0]);
        for (kind, data) in [(b"IHDR", &header), (b"IDAT", &stream), (b"IEND", &Vec::new())] {
            file.extend((data.len() as u32).to_be_bytes());
            let tagged: Vec<u8> = kind.iter().chain(data).copied().collect();
            file.extend(&tagged);
            file.extend(crc32fast::hash(&tagged).to_be_bytes());
        }
        let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        std::fs::write(&path, file).unwrap();
        println!("{}", path.display());
    }
}

#[test]
fn sections_of_contacts_can_be_drawn() {
    for (deformation, suffix) in [(Deformation::Contact, "flat"), (Deformation::Bulges, "bulged")] {
        let mut world = World::new(WorldDesc::default()).unwrap();
        let below = ball(&mut world, soft(1e5, 1.0, 1.0), Vec3::z() * -0.08);
        let above = ball(&mut world, soft(1e5, 1.0, 1.0), Vec3::z() * 0.08);
        Picture::section(&world, &[below, above], [0.0, 0.0], 0.4, deformation).write(&format!("balls_{suffix}.png"));

        let mut world = World::new(WorldDesc::default()).unwrap();
        let ground = floor(&mut world, hard());
        let soft_one = ball(&mut world, soft(1e5, 1.0, 1.0), Vec3::z() * 0.075);
        Picture::section(&world, &[ground, soft_one], [0.0, 0.06], 0.4, deformation)
            .write(&format!("floor_{suffix}.png"));

        let mut world = World::new(WorldDesc::default()).unwrap();
        let ground = floor(&mut world, hard());
        let left = ball(&mut world, soft(1e5, 1.0, 1.0), Vec3::new(-0.085, 0.0, 0.08));
        let right = ball(&mut world, soft(2e5, 1.0, 1.0), Vec3::new(0.085, 0.0, 0.08));
        let top = ball(&mut world, soft(1e5, 1.0, 1.0), Vec3::new(0.0, 0.0, 0.22));
        Picture::section(&world, &[ground, left, right, top], [0.0, 0.12], 0.5, deformation)
            .write(&format!("pile_{suffix}.png"));
    }
}
