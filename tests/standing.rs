//! Contact surfaces of bodies at rest stand from step to step: they cost no evaluations, press as they would if they were
//! evaluated anew, and are, as soon as anything that makes them changes.

mod common;

use common::{Coat, DT, G, ball_inertia, box_inertia, total};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Pose, Twist, Vec3};
use isocoat::world::{BodyDesc, BodyId, LinkDesc, LinkId, LinkState, Response, Scheme, SkeletonId, World, WorldDesc};

/// A body of two limbs that blend, on a floor, with four feet on top; at rest.
struct Scene {
    world: World,
    floor: BodyId,
    limbs: BodyId,
    feet: BodyId,
    links: Vec<LinkId>,
}

const MASS: f64 = 1.0;

fn scene() -> Scene {
    let gravity = Vec3::new(0.0, 0.0, -G);
    let mut world =
        World::new(WorldDesc { gravity, response: Response::Implicit, force_tolerance: 5e-2, ..WorldDesc::default() })
            .unwrap();
    let rough = |coat: &Coat| BodyDesc { friction: 0.5, static_friction: 0.6, dissipation: 2.0, ..coat.body_desc() };
    let floor = Coat::floor(0.1);
    let (floor, _) =
        floor.add(&mut world, rough(&floor), LinkDesc { pose: Pose::at(0.0, 0.0, -0.1), ..LinkDesc::default() });
    let solid = |at: Vec3| LinkDesc {
        kind: Kind::Rigid,
        mass: MASS,
        inertia: box_inertia(MASS, Vec3::new(0.3, 0.1, 0.1)),
        pose: Pose::at(at.x, at.y, at.z),
        ..LinkDesc::default()
    };
    // Broad enough not to roll.
    let bone = |y: f64| Shape::Segment(Vec3::new(-0.2, y, 0.0), Vec3::new(0.2, y + 0.02, 0.0));
    let limb = Coat::new(&[bone(-0.06), bone(0.06)], 0.1);
    let (limbs, first) = limb.add(&mut world, rough(&limb), solid(Vec3::new(0.0, -0.13, 0.098)));
    let second = world.create_link(limbs, solid(Vec3::new(0.0, 0.13, 0.098))).unwrap();
    for skeleton in world.link_skeletons(first).unwrap().collect::<Vec<_>>() {
        let desc = world.skeleton_desc(skeleton).unwrap().clone();
        world.create_skeleton(second, desc).unwrap();
    }
    let points = [(-0.08, -0.13, 0.0), (0.08, -0.13, 0.0), (-0.08, 0.13, 0.0), (0.08, 0.13, 0.0)];
    let feet = Coat::new(&points.map(|(x, y, z)| Shape::Point(Vec3::new(x, y, z))), 0.1);
    let (feet, third) = feet.add(&mut world, rough(&feet), solid(Vec3::new(0.0, 0.0, 0.29)));
    let mut scene = Scene { world, floor, limbs, feet, links: vec![first, second, third] };
    scene.rest();
    scene
}

impl Scene {
    /// Steps until the surfaces have stood for a while.
    fn rest(&mut self) {
        let mut stood = 0;
        for _ in 0..2000 {
            stood = if self.evaluations() == 0 { stood + 1 } else { 0 };
            if stood == 60 {
                return;
            }
        }
        panic!("no surface stands: {} evaluations", self.world.counters().evaluations);
    }

    /// Evaluations of one more step.
    fn evaluations(&mut self) -> u64 {
        self.world.step(DT).unwrap();
        self.world.counters().evaluations
    }

    fn skeleton(&self, link: usize) -> SkeletonId {
        self.world.link_skeletons(self.links[link]).unwrap().next().unwrap()
    }

    fn bits(&self) -> Vec<u64> {
        let mut bits = Vec::new();
        for link in &self.links {
            let LinkState { pose, twist } = self.world.link_state(*link).unwrap();
            let vectors = [pose.position, twist.linear, twist.angular];
            bits.extend(vectors.iter().flat_map(|v| v.iter()).chain(pose.rotation.coords.iter()).map(|x| x.to_bits()));
        }
        bits.extend(self.world.contacts().iter().flat_map(|contact| contact.force.data.0[0].map(f64::to_bits)));
        bits
    }
}

#[test]
fn they_press_as_they_would_anew() {
    let mut scene = scene();
    assert_eq!(scene.evaluations(), 0);
    let contacts = scene.world.contacts().to_vec();
    let on_floor: Vec<_> = contacts.iter().filter(|contact| contact.bodies[0] == scene.floor).cloned().collect();
    assert!(on_floor.len() >= 2 && contacts.len() > on_floor.len(), "{} contacts", contacts.len());
    // They carry all three.
    let lifted = total(&on_floor).z / (3.0 * MASS * G);
    assert!((lifted.abs() - 1.0).abs() < 1e-6, "{lifted}");
    for (a, b) in [(scene.floor, scene.limbs), (scene.limbs, scene.feet)] {
        let stand: Vec<_> = contacts.iter().filter(|contact| contact.bodies == [a, b]).cloned().collect();
        let tolerance = scene.world.desc().force_tolerance;
        let anew = scene.world.collide(a, b, Scheme::Auto, tolerance).unwrap();
        assert_eq!(stand.len(), anew.len());
        for (stand, anew) in stand.iter().zip(&anew) {
            let off = |a: &Vec3, b: &Vec3| (a - b).norm();
            // The elastic force: along the pressure's normals.
            let force = off(&stand.force, &anew.force) / anew.force.norm();
            println!("force off by {force:.1e}, place by {:.1e} m", off(&stand.position, &anew.position));
            assert!(force < 1e-5 && off(&stand.position, &anew.position) < 1e-5);
        }
    }
}

#[test]
fn whatever_makes_them_has_them_evaluated_anew() {
    type Change = fn(&mut Scene);
    let changes: [(&str, Change); 9] = [
        ("thickness of a skeleton", |scene| {
            let skeleton = scene.skeleton(0);
            let mut desc = scene.world.skeleton_desc(skeleton).unwrap().clone();
            desc.thickness *= 1.0 + 1e-9;
            scene.world.set_skeleton_desc(skeleton, desc).unwrap();
        }),
        ("place of a skeleton", |scene| {
            let skeleton = scene.skeleton(2);
            let mut desc = scene.world.skeleton_desc(skeleton).unwrap().clone();
            desc.shape = Shape::Point(Vec3::new(-0.08, -0.13, 1e-12));
            scene.world.set_skeleton_desc(skeleton, desc).unwrap();
        }),
        ("stiffness of a body", |scene| {
            let mut desc = scene.world.body_desc(scene.limbs).unwrap().clone();
            desc.stiffness_scale *= 1.0 + 1e-12;
            scene.world.set_body_desc(scene.limbs, desc).unwrap();
        }),
        ("a body that is rigid now", |scene| {
            let desc = BodyDesc { rigid: true, ..scene.world.body_desc(scene.floor).unwrap().clone() };
            scene.world.set_body_desc(scene.floor, desc).unwrap();
        }),
        ("a blend that is off", |scene| {
            let (a, b) = (scene.skeleton(0), scene.skeleton(1));
            scene.world.set_blend(a, b, 0.5, 0.0).unwrap();
        }),
        ("tolerance", |scene| {
            let desc = WorldDesc { force_tolerance: 4e-2, ..scene.world.desc().clone() };
            scene.world.set_desc(desc).unwrap();
        }),
        ("scheme", |scene| {
            let desc = WorldDesc { scheme: Scheme::Adaptive, ..scene.world.desc().clone() };
            scene.world.set_desc(desc).unwrap();
        }),
        ("a link put elsewhere", |scene| {
            let mut state = scene.world.link_state(scene.links[1]).unwrap();
            state.pose.position.x += 1e-3;
            scene.world.set_link_state(scene.links[1], &state).unwrap();
        }),
        ("a push", |scene| {
            scene.world.apply_impulse(scene.links[2], &Vec3::new(0.0, 0.0, -0.1), None).unwrap();
        }),
    ];
    let mut scene = scene();
    let mut bytes = Vec::new();
    scene.world.snapshot(&mut bytes);
    for (name, change) in changes {
        scene.world.restore(&bytes).unwrap();
        assert_eq!(scene.evaluations(), 0, "{name}");
        change(&mut scene);
        assert!(scene.evaluations() > 0, "{name}");
    }
}

#[test]
fn what_does_not_make_them_leaves_them() {
    let mut scene = scene();
    for body in [scene.floor, scene.limbs, scene.feet] {
        let desc = BodyDesc { friction: 0.6, user_data: 7, ..scene.world.body_desc(body).unwrap().clone() };
        scene.world.set_body_desc(body, desc).unwrap();
    }
    assert_eq!(scene.evaluations(), 0);
}

#[test]
fn a_restored_world_goes_on_with_the_same_bits() {
    let mut scene = scene();
    let mut bytes = Vec::new();
    scene.world.snapshot(&mut bytes);
    let go_on = |scene: &mut Scene| {
        let mut bits = Vec::new();
        for step in 0..60 {
            if step == 20 {
                scene.world.apply_impulse(scene.links[2], &Vec3::new(0.05, 0.0, -0.05), None).unwrap();
            }
            scene.world.step(DT).unwrap();
            bits.push(scene.bits());
        }
        bits
    };
    let expected = go_on(&mut scene);
    // Into the same world, whose surfaces are others by now, and into one that never had any.
    scene.world.restore(&bytes).unwrap();
    assert!(go_on(&mut scene) == expected);
    scene.world = World::new(WorldDesc::default()).unwrap();
    scene.world.restore(&bytes).unwrap();
    let bodies: Vec<BodyId> = scene.world.bodies().collect();
    scene.links = bodies[1..].iter().flat_map(|body| scene.world.body_links(*body).unwrap()).collect();
    assert!(go_on(&mut scene) == expected);
}

#[test]
fn those_who_slept_go_on_with_the_same_bits() {
    let mut scene = scene();
    let desc = WorldDesc { sleep_time: 0.2, ..scene.world.desc().clone() };
    scene.world.set_desc(desc).unwrap();
    for _ in 0..60 {
        scene.world.step(DT).unwrap();
    }
    assert_eq!(scene.world.counters().asleep, 2);
    let mut bytes = Vec::new();
    scene.world.snapshot(&mut bytes);
    let wake = |scene: &mut Scene| {
        scene.world.apply_impulse(scene.links[2], &Vec3::new(0.01, 0.0, 0.0), None).unwrap();
        (0..30).map(|_| (scene.world.step(DT).unwrap(), scene.bits()).1).collect::<Vec<_>>()
    };
    let expected = wake(&mut scene);
    scene.world.restore(&bytes).unwrap();
    assert!(wake(&mut scene) == expected);
}

#[test]
fn that_of_a_ball_stands_while_it_spins_in_its_place() {
    let gravity = Vec3::new(0.0, 0.0, -G);
    let desc = WorldDesc { gravity, response: Response::Implicit, scheme: Scheme::Polar, ..WorldDesc::default() };
    let mut world = World::new(desc).unwrap();
    let floor = Coat::floor(0.1).hard();
    floor.add(&mut world, floor.body_desc(), LinkDesc { pose: Pose::at(0.0, 0.0, -0.1), ..LinkDesc::default() });
    let ball = Coat::ball(0.1);
    let spin = Vec3::new(3.0, -5.0, 7.0);
    let twist = Twist { linear: Vec3::zeros(), angular: spin };
    let (kind, inertia, pose) = (Kind::Rigid, ball_inertia(MASS, 0.1), Pose::at(0.0, 0.0, 0.098));
    let desc = LinkDesc { kind, mass: MASS, inertia, pose, twist, ..LinkDesc::default() };
    let (_, link) = ball.add(&mut world, ball.body_desc(), desc);
    for _ in 0..600 {
        world.step(DT).unwrap();
    }
    let mut evaluations = 0;
    for _ in 0..60 {
        world.step(DT).unwrap();
        evaluations += world.counters().evaluations;
    }
    let load = total(world.contacts()).z.abs() / (MASS * G);
    let LinkState { twist, .. } = world.link_state(link).unwrap();
    println!("{evaluations} evaluations in a second, load off by {:.1e}, spin {:?}", load - 1.0, twist.angular);
    assert_eq!(evaluations, 0);
    assert!((load - 1.0).abs() < 1e-6 && (twist.angular - spin).norm() < 1e-9 && twist.linear.norm() < 1e-6);
}

#[test]
fn a_ball_at_rest_on_a_flat_face_does_not_begin_to_roll() {
    for (friction, static_friction) in [(0.5, 0.6), (0.5, 0.0)] {
        let gravity = Vec3::new(0.0, 0.0, -G);
        let mut world =
            World::new(WorldDesc { gravity, response: Response::Implicit, ..WorldDesc::default() }).unwrap();
        let rough = |coat: &Coat| BodyDesc { friction, static_friction, dissipation: 0.5, ..coat.body_desc() };
        let floor = Coat::cuboid(Vec3::new(3.0, 3.0, 0.4), 0.1);
        floor.add(&mut world, rough(&floor), LinkDesc { pose: Pose::at(0.0, 0.0, -0.5), ..LinkDesc::default() });
        let radius = 0.1;
        let link = LinkDesc {
            kind: Kind::Rigid,
            mass: 2.0,
            inertia: ball_inertia(2.0, radius),
            pose: Pose::at(0.0, 0.0, radius - 0.01),
            ..LinkDesc::default()
        };
        let coat = Coat::ball(radius);
        let (_, ball) = coat.add(&mut world, rough(&coat), link);
        // Rounding of 1e-17 m/s grew to a tenth of a millimetre a second within these.
        for _ in 0..1200 {
            world.step(DT).unwrap();
        }
        let LinkState { pose, twist } = world.link_state(ball).unwrap();
        let (off, speed) = (pose.position.xy().norm(), twist.linear.norm());
        println!("friction {friction}, static {static_friction}: {off:.1e} m off, {speed:.1e} m/s");
        assert!(off < 1e-9 && speed < 1e-9);
    }
}
