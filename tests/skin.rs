//! Skins: a host's vertices on a moving, pressed and swelling coat. Figures:
//! `cargo test --release --test skin -- --nocapture`.

mod common;

use common::Random;
use common::character::Character;
use isocoat::World;
use isocoat::base::Kind;
use isocoat::error::Error;
use isocoat::field::Shape;
use isocoat::math::{Pose, Twist, Vec3, rotation_from_vector};
use isocoat::surface::mesh::Mesh;
use isocoat::world::mesh::MeshDesc;
use isocoat::world::{
    BodyDesc, BodyId, Deformation, LinkDesc, LinkId, LinkState, SkeletonDesc, SkinId, SubstanceDesc, WorldDesc,
};

const T: f64 = 0.1;

fn world() -> World {
    World::new(WorldDesc { gravity: Vec3::zeros(), ..WorldDesc::default() }).unwrap()
}

fn add(world: &mut World, desc: BodyDesc, links: &[Vec<Shape>]) -> (BodyId, Vec<LinkId>) {
    let body = world.create_body(desc).unwrap();
    let mut made = Vec::new();
    for shapes in links {
        let link = world.create_link(body, LinkDesc { kind: Kind::Host, ..LinkDesc::default() }).unwrap();
        for shape in shapes {
            world
                .create_skeleton(link, SkeletonDesc { shape: *shape, thickness: T, ..SkeletonDesc::default() })
                .unwrap();
        }
        made.push(link);
    }
    (body, made)
}

fn place(world: &mut World, link: LinkId, pose: Pose) {
    world.set_link_state(link, &LinkState { pose, twist: Twist::default() }).unwrap();
}

/// Turns a link by an angle about an axis through a point.
fn turned(point: Vec3, turn: Vec3) -> Pose {
    let rotation = rotation_from_vector(&turn);
    Pose { position: point - rotation * point, rotation }
}

/// A limb of two capsules along x that meet at the origin.
fn limb(world: &mut World, desc: BodyDesc) -> (BodyId, Vec<LinkId>) {
    let at = |x: f64| Vec3::new(x, 0.0, 0.0);
    add(world, desc, &[vec![Shape::segment(at(-0.6), at(0.0))], vec![Shape::segment(at(0.0), at(0.6))]])
}

/// The body's own watertight mesh as its skin.
fn dress(world: &mut World, body: BodyId, cell: f64) -> (Mesh, SkinId) {
    let mesh = world.mesh(body, &MeshDesc::new(cell)).unwrap();
    let skin = world.create_skin(body, &mesh.positions, Some(&mesh.normals)).unwrap();
    (mesh, skin)
}

fn deform(world: &World, skin: SkinId, deformation: Deformation) -> (Vec<Vec3>, Vec<Vec3>) {
    let count = world.skin_vertex_count(skin).unwrap();
    let (mut positions, mut normals) = (vec![Vec3::repeat(f64::NAN); count], vec![Vec3::zeros(); count]);
    world
        .deform_skin(skin, deformation, |vertex, position, normal| {
            assert!(positions[vertex].x.is_nan(), "vertex {vertex} twice");
            (positions[vertex], normals[vertex]) = (position, normal);
        })
        .unwrap();
    assert!(positions.iter().all(|p| p.iter().all(|x| x.is_finite())));
    assert!(normals.iter().all(|n| (n.norm() - 1.0).abs() < 1e-9));
    (positions, normals)
}

fn fields(world: &World, body: BodyId, points: &[Vec3], deformation: Deformation) -> Vec<(f64, Vec3)> {
    let points: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
    let (mut values, mut gradients) = (vec![0.0; points.len()], vec![[0.0; 3]; points.len()]);
    world.evaluate_field_deformed(body, &points, Some(&mut values), Some(&mut gradients), deformation).unwrap();
    values.into_iter().zip(gradients.into_iter().map(Vec3::from)).collect()
}

fn vectors(list: &[[f64; 3]]) -> Vec<Vec3> {
    list.iter().map(|p| Vec3::from(*p)).collect()
}

#[test]
fn a_body_that_moves_rigidly_carries_its_skin_rigidly() {
    let mut random = Random(1);
    for far in [0.0, 1e3] {
        let mut world = world();
        let character = Character::new(&mut world);
        let (mesh, skin) = dress(&mut world, character.body, 0.03);
        let (still, _) = deform(&world, skin, Deformation::None);
        let off = |now: &[Vec3], before: &dyn Fn(usize) -> Vec3| {
            now.iter().enumerate().map(|(k, p)| (p - before(k)).norm()).fold(0.0, f64::max)
        };
        assert!(off(&still, &|k| Vec3::from(mesh.positions[k])) < 1e-12);
        let motion = Pose { position: random.direction() * far + random.direction(), rotation: random.rotation() };
        for link in &character.links {
            let pose = world.link_state(*link).unwrap().pose;
            let position = motion.transform_point(&pose.position);
            place(&mut world, *link, Pose { position, rotation: motion.rotation * pose.rotation });
        }
        let (moved, normals) = deform(&world, skin, Deformation::Bulges);
        let at = off(&moved, &|k| motion.transform_point(&Vec3::from(mesh.positions[k])));
        let turned = off(&normals, &|k| motion.rotation * Vec3::from(mesh.normals[k]));
        println!("{} vertices, {far} m away: {at:.1e} m, normals {turned:.1e}", mesh.positions.len());
        assert!(at < 1e-9 && turned < 1e-6);
    }
}

#[test]
fn vertices_of_a_bent_joint_keep_their_level() {
    for degrees in [30.0_f64, 60.0, 90.0, 110.0] {
        let mut world = world();
        let (body, links) = limb(&mut world, BodyDesc::default());
        // On the surface, and on levels above and below it.
        let mesh = world.mesh(body, &MeshDesc::new(0.02)).unwrap();
        let shift = |k: usize| [0.0, -0.02, 0.03][k % 3];
        let points: Vec<Vec3> = (0..mesh.positions.len())
            .map(|k| Vec3::from(mesh.positions[k]) + Vec3::from(mesh.normals[k]) * shift(k))
            .collect();
        let list: Vec<[f64; 3]> = points.iter().map(|p| (*p).into()).collect();
        let skin = world.create_skin(body, &list, None).unwrap();
        let before = fields(&world, body, &points, Deformation::None);
        place(&mut world, links[1], turned(Vec3::zeros(), Vec3::z() * degrees.to_radians()));
        let (now, normals) = deform(&world, skin, Deformation::None);
        let after = fields(&world, body, &now, Deformation::None);
        let mut worst = 0.0_f64;
        for ((before, after), normal) in before.iter().zip(&after).zip(&normals) {
            worst = worst.max((after.0 - before.0).abs() / after.1.norm());
            assert!((normal + after.1.normalize()).norm() < 3e-3);
        }
        println!("{degrees} degrees: {worst:.1e} m off the level, of {} vertices", now.len());
        assert!(worst < 1e-3 * T);
    }
}

#[test]
fn a_bent_character_keeps_its_levels_where_no_parts_collide() {
    let mut world = world();
    let character = Character::new(&mut world);
    let (mesh, skin) = dress(&mut world, character.body, 0.02);
    let before = fields(&world, character.body, &vectors(&mesh.positions), Deformation::None);
    character.bend(&mut world, 1.0);
    let (now, _) = deform(&world, skin, Deformation::None);
    let after = fields(&world, character.body, &now, Deformation::None);
    let errors = before.iter().zip(&after).map(|(before, after)| (after.0 - before.0).abs() / after.1.norm());
    let off = errors.clone().filter(|error| *error > 1e-3 * 0.045).count();
    println!("{off} of {} vertices off their level", now.len());
    assert!(off * 50 < now.len());
}

#[test]
fn a_twisted_limb_is_not_pinched() {
    let mut world = world();
    let (body, links) = limb(&mut world, BodyDesc::default());
    let (mesh, skin) = dress(&mut world, body, 0.02);
    place(&mut world, links[1], turned(Vec3::zeros(), Vec3::x() * 2.5));
    let (now, _) = deform(&world, skin, Deformation::None);
    for (p, before) in now.iter().zip(vectors(&mesh.positions)) {
        let radius = |p: &Vec3| p.y.hypot(p.z);
        assert!((radius(p) - radius(&before)).abs() < 1e-3 * T && (p.x - before.x).abs() < 1e-3 * T);
    }
}

/// A floor whose surface is at this height.
fn floor(world: &mut World, height: f64, rigid: bool) {
    let body = world.create_body(BodyDesc { rigid, ..BodyDesc::default() }).unwrap();
    let pose = Pose::at(0.0, 0.0, height - T);
    let link = world.create_link(body, LinkDesc { pose, ..LinkDesc::default() }).unwrap();
    let shape = Shape::Plane { point: Vec3::zeros(), normal: Vec3::z() };
    world.create_skeleton(link, SkeletonDesc { shape, thickness: T, ..SkeletonDesc::default() }).unwrap();
}

#[test]
fn no_vertex_goes_through_a_floor_that_the_body_is_pressed_into() {
    let desc = BodyDesc { bulge_width: 0.5, bulge_height: 1.0, ..BodyDesc::default() };
    for (degrees, depth, deformation) in [
        (0.0_f64, 0.3, Deformation::Contact),
        (0.0, 0.3, Deformation::Bulges),
        (70.0, 0.5, Deformation::Contact),
        (70.0, 0.5, Deformation::Bulges),
        (0.0, 0.9, Deformation::Contact),
    ] {
        let mut world = world();
        let (body, links) = limb(&mut world, desc.clone());
        let (mesh, skin) = dress(&mut world, body, 0.02);
        // Bent within the plane of the floor, and turned out of it a little.
        let turn = Vec3::new(0.0, 0.1, degrees.to_radians());
        place(&mut world, links[1], turned(Vec3::zeros(), turn));
        let lowest = deform(&world, skin, Deformation::None).0.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        let height = lowest + depth * T;
        floor(&mut world, height, true);
        let (now, normals) = deform(&world, skin, deformation);
        let through = now.iter().map(|p| height - p.z).fold(f64::NEG_INFINITY, f64::max);
        let flat: Vec<usize> = (0..now.len()).filter(|k| (now[*k].z - height).abs() < 1e-2 * T).collect();
        println!("{degrees} degrees, {depth} T deep, {deformation:?}: {through:.1e} m through, {} flat", flat.len());
        assert!(through < 1e-2 * T);
        assert!(flat.len() > mesh.positions.len() / 100);
        // Well inside the contact the skin is as flat as the floor.
        let facing = flat.iter().filter(|k| normals[**k].z < -0.999).count();
        assert!(facing * 2 > flat.len(), "{facing} of {}", flat.len());
        // And elsewhere it is the deformed surface.
        for (k, (value, gradient)) in fields(&world, body, &now, deformation).iter().enumerate() {
            let off = (value - 1.0).abs() / gradient.norm();
            assert!(off < 1e-3 * T || flat.contains(&k), "{off} at {}", now[k]);
        }
    }
}

#[test]
fn a_mesh_over_the_coat_or_under_it_does_not_go_through_a_rigid_floor_either() {
    for deformation in [Deformation::Contact, Deformation::Bulges] {
        let mut world = world();
        let (body, links) = limb(&mut world, BodyDesc { bulge_width: 0.5, bulge_height: 1.0, ..BodyDesc::default() });
        let mesh = world.mesh(body, &MeshDesc::new(0.02)).unwrap();
        let shift = |k: usize| [0.04, 0.02, -0.02][k % 3];
        let points: Vec<[f64; 3]> = (0..mesh.positions.len())
            .map(|k| (Vec3::from(mesh.positions[k]) + Vec3::from(mesh.normals[k]) * shift(k)).into())
            .collect();
        let skin = world.create_skin(body, &points, None).unwrap();
        place(&mut world, links[1], turned(Vec3::zeros(), Vec3::z() * 0.8));
        let lowest = deform(&world, skin, Deformation::None).0.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        let height = lowest + 0.8 * T;
        floor(&mut world, height, true);
        let (now, _) = deform(&world, skin, deformation);
        let through = now.iter().map(|p| height - p.z).fold(f64::NEG_INFINITY, f64::max);
        println!("{deformation:?}: {through:.1e} m through");
        assert!(through < 1e-2 * T);
    }
}

#[test]
fn several_threads_deform_one_skin_and_get_the_same() {
    let mut world = world();
    let character = Character::new(&mut world);
    let (_, skin) = dress(&mut world, character.body, 0.03);
    character.bend(&mut world, 0.8);
    let alone = deform(&world, skin, Deformation::None);
    std::thread::scope(|scope| {
        let threads = [0, 1, 2].map(|_| scope.spawn(|| deform(&world, skin, Deformation::None)));
        for thread in threads {
            assert!(thread.join().unwrap() == alone);
        }
    });
}

#[test]
fn the_skins_of_two_bodies_that_press_on_each_other_do_not_cross() {
    let mut world = world();
    let (first, _) = add(&mut world, BodyDesc::default(), &[vec![Shape::Point(Vec3::zeros())]]);
    let at = Vec3::new(0.3, 0.0, 0.0);
    let (second, links) = add(&mut world, BodyDesc::default(), &[vec![Shape::Point(at)]]);
    let skins = [first, second].map(|body| dress(&mut world, body, 0.02).1);
    place(&mut world, links[0], Pose::at(-0.15, 0.0, 0.0));
    let [(a, _), (b, _)] = skins.map(|skin| deform(&world, skin, Deformation::Contact));
    let middle = 0.075;
    let reach = a.iter().map(|p| p.x).fold(f64::NEG_INFINITY, f64::max);
    let begin = b.iter().map(|p| p.x).fold(f64::INFINITY, f64::min);
    println!("{reach} {begin}");
    assert!((reach - middle).abs() < 1e-3 * T && (begin - middle).abs() < 1e-3 * T);
}

#[test]
fn parts_that_do_not_blend_stop_at_each_other() {
    let mut world = world();
    let along = |y: f64| Shape::segment(Vec3::new(-0.3, y, 0.0), Vec3::new(0.3, y, 0.0));
    let (body, links) = add(&mut world, BodyDesc::default(), &[vec![along(0.0)], vec![along(0.5)]]);
    world.blend_neighbours(body, &[]).unwrap();
    let (mesh, skin) = dress(&mut world, body, 0.02);
    place(&mut world, links[1], Pose::at(0.0, -0.35, 0.0));
    let (now, _) = deform(&world, skin, Deformation::None);
    // Axes 0.15 apart: the border is half way.
    let (mut crossed, mut met) = (0.0_f64, 0);
    for (p, before) in now.iter().zip(vectors(&mesh.positions)) {
        let beyond = if before.y < 0.25 { p.y - 0.075 } else { 0.075 - p.y };
        crossed = crossed.max(beyond);
        met += usize::from(beyond.abs() < 0.01 * T);
    }
    println!("{crossed:.1e} m beyond the border, {met} at it");
    assert!(crossed < 1e-2 * T && met > 50);
}

#[test]
fn a_skin_swells_with_its_coat() {
    let mut world = world();
    let (body, _) = limb(&mut world, BodyDesc { volume_gain: 0.5, ..BodyDesc::default() });
    let (mesh, skin) = dress(&mut world, body, 0.02);
    let skeletons: Vec<_> =
        world.body_links(body).unwrap().flat_map(|link| world.link_skeletons(link).unwrap()).collect();
    world.step(1.0 / 60.0).unwrap();
    for skeleton in &skeletons {
        let volume = world.skeleton_volume(*skeleton).unwrap();
        world.set_skeleton_target_volume(*skeleton, 1.4 * volume).unwrap();
    }
    (0..60).for_each(|_| world.step(1.0 / 60.0).unwrap());
    let offset = world.skeleton_offset(skeletons[0]).unwrap();
    let (now, _) = deform(&world, skin, Deformation::None);
    let mean = now
        .iter()
        .zip(vectors(&mesh.positions))
        .zip(vectors(&mesh.normals))
        .map(|((now, before), normal)| (now - before).dot(&normal))
        .sum::<f64>()
        / now.len() as f64;
    println!("offset {offset}, skin {mean}");
    assert!(offset > 0.1 * T && (mean - offset).abs() < 0.05 * offset);
    for (value, gradient) in fields(&world, body, &now, Deformation::None) {
        assert!((value - 1.0).abs() / gradient.norm() < 1e-3 * T);
    }
}

#[test]
fn vertices_beyond_all_fields_follow_the_nearest_link_and_weights_are_shares_of_the_field() {
    let mut world = world();
    let (body, links) = limb(&mut world, BodyDesc::default());
    let points = [[0.5, 0.0, 1.0], [-0.5, 1.0, 0.0], [0.3, 0.1, 0.0], [0.0, 0.1, 0.0]];
    let skin = world.create_skin(body, &points, None).unwrap();
    let weights = |vertex: usize| world.skin_weights(skin, vertex).unwrap().collect::<Vec<_>>();
    assert_eq!(weights(0), [(links[1], 1.0)]);
    assert_eq!(weights(1), [(links[0], 1.0)]);
    assert_eq!(weights(2), [(links[1], 1.0)]);
    let shared = weights(3);
    assert!(shared.len() == 2 && shared.iter().all(|(_, weight)| (weight - 0.5).abs() < 1e-12));
    let pose = turned(Vec3::new(0.0, 0.2, 0.0), Vec3::new(0.3, -0.4, 1.0));
    place(&mut world, links[1], pose);
    let (now, _) = deform(&world, skin, Deformation::Bulges);
    assert!((now[0] - pose.transform_point(&points[0].into())).norm() < 1e-12);
    assert!((now[1] - Vec3::from(points[1])).norm() < 1e-12);
}

#[test]
fn the_same_poses_give_the_same_bits_whatever_came_between() {
    let mut world = world();
    let character = Character::new(&mut world);
    let (_, skin) = dress(&mut world, character.body, 0.03);
    floor(&mut world, 0.03, true);
    character.bend(&mut world, 0.6);
    let first = deform(&world, skin, Deformation::Contact);
    character.bend(&mut world, 1.0);
    deform(&world, skin, Deformation::Bulges);
    character.bend(&mut world, 0.6);
    assert!(first == deform(&world, skin, Deformation::Contact));
}

#[test]
fn what_cannot_be_bound_or_followed_says_why() {
    let mut world = world();
    let (body, links) = limb(&mut world, BodyDesc::default());
    let text = |result: Result<SkinId, Error>| result.unwrap_err().to_string();
    let nan = world.create_skin(body, &[[0.0; 3], [0.0, f64::NAN, 0.0]], None);
    assert!(text(nan).contains("vertex is (0, NaN, 0) (number 1); must be finite"));
    let flat = world.create_skin(body, &[[0.0; 3]], Some(&[[0.0; 3]]));
    assert!(text(flat).contains("normal is (0, 0, 0) (number 0)"));
    assert!(text(world.create_skin(body, &[[0.0; 3]], Some(&[]))).contains("as many as vertices"));
    let bare = world.create_body(BodyDesc::default()).unwrap();
    assert!(text(world.create_skin(bare, &[[0.0; 3]], None)).contains("enabled skeletons"));
    let dough = world.create_body(BodyDesc::default()).unwrap();
    world.make_substance(dough, SubstanceDesc { spacing: 0.1, ..SubstanceDesc::default() }).unwrap();
    assert!(text(world.create_skin(dough, &[[0.0; 3]], None)).contains("substance"));

    let skin = world.create_skin(body, &[[0.0, 0.1, 0.0]], None).unwrap();
    let refused =
        |world: &World| world.deform_skin(skin, Deformation::None, |_, _, _| panic!("told")).unwrap_err().to_string();
    assert!(world.skin_weights(skin, 1).err().unwrap().to_string().contains("vertex is 1"));
    let mut snapshot = Vec::new();
    world.snapshot(&mut snapshot);
    let skeleton = world.link_skeletons(links[1]).unwrap().next().unwrap();
    world.set_skeleton_enabled(skeleton, false).unwrap();
    assert!(refused(&world).contains("not those that the skin was bound to"));
    world.set_skeleton_enabled(skeleton, true).unwrap();
    assert!(world.deform_skin(skin, Deformation::None, |_, _, _| ()).is_ok());
    world.destroy_link(links[1]).unwrap();
    assert!(refused(&world).contains("not those that the skin was bound to"));
    world.destroy_body(body).unwrap();
    assert!(refused(&world).contains("body of the skin"));
    // Brought back, it is followed again.
    world.restore(&snapshot).unwrap();
    assert!(world.deform_skin(skin, Deformation::None, |_, _, _| ()).is_ok());
    world.destroy_skin(skin).unwrap();
    assert!(refused(&world).contains("skin: the handle is stale"));
    let skin = world.create_skin(body, &[[0.0, 0.1, 0.0]], None).unwrap();
    let mut other = World::new(WorldDesc::default()).unwrap();
    other.restore(&snapshot).unwrap();
    assert!(other.deform_skin(skin, Deformation::None, |_, _, _| ()).is_err());
}
