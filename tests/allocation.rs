//! A world at work does not ask for memory: once its buffers have grown to what a scene needs, steps reuse them.

mod common;

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use common::character::Character;
use common::pool::Pool;
use common::{Coat, ball_inertia, box_inertia};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::surface::mesh::Mesh;
use isocoat::world::mesh::{MeshDesc, MeshWorkspace};
use isocoat::world::rays::{Ray, RaysDesc};
use isocoat::world::{
    BodyDesc, Deformation, LinkDesc, LinkId, LinkState, Response, Scheme, SkeletonDesc, SpringDesc, World, WorldDesc,
};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
    static TRACED: Cell<bool> = const { Cell::new(false) };
}

/// The system's allocator, which counts what each thread asks for.
struct Counting;

fn count() {
    let count = ALLOCATIONS.get() + 1;
    // A failure says where: the first allocation of a counted stretch leaves its backtrace.
    if TRACED.replace(false) {
        eprintln!("{}", std::backtrace::Backtrace::force_capture());
    }
    // The backtrace's own do not count.
    ALLOCATIONS.set(count);
}

// SAFETY: all requests go to the system's allocator unchanged.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn realloc(&self, block: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        count();
        // SAFETY: the caller's promises are passed on.
        unsafe { System.realloc(block, layout, size) }
    }

    unsafe fn dealloc(&self, block: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(block, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Balls laid on a floor; unless `round`, also capsules, and a box with a ball on top.
fn resting_scene(scheme: Scheme, round: bool) -> World {
    let gravity = Vec3::new(0.0, 0.0, -9.81);
    let mut world = World::new(WorldDesc { gravity, scheme, force_tolerance: 5e-2, ..WorldDesc::default() }).unwrap();
    let rough = |coat: &Coat| BodyDesc {
        friction: 0.3,
        static_friction: 0.3,
        dissipation: 20.0,
        viscous_friction: 0.1,
        ..coat.body_desc()
    };
    let floor = Coat::floor(0.1).hard();
    floor.add(&mut world, rough(&floor), LinkDesc { pose: Pose::at(0.0, 0.0, -0.1), ..LinkDesc::default() });
    let ball = Coat::ball(0.1);
    let capsule = Coat::new(&[Shape::Segment(Vec3::new(-0.15, 0.0, 0.0), Vec3::new(0.15, 0.0, 0.0))], 0.1);
    let half = Vec3::new(0.15, 0.15, 0.1);
    let cuboid = Coat::cuboid(half - Vec3::repeat(0.05), 0.05);
    let mut lay = |coat: &Coat, x: f64, y: f64, z: f64, inertia| {
        let desc = LinkDesc { kind: Kind::Rigid, mass: 1.0, inertia, pose: Pose::at(x, y, z), ..LinkDesc::default() };
        coat.add(&mut world, rough(coat), desc);
    };
    for i in 0..4 {
        lay(&ball, 0.195 * f64::from(i), 0.0, 0.098, ball_inertia(1.0, 0.1));
    }
    if round {
        return world;
    }
    for i in 0..3 {
        lay(&capsule, 0.0, 0.5 + 0.198 * f64::from(i), 0.099, ball_inertia(1.0, 0.15));
    }
    lay(&cuboid, 1.0, 1.0, 0.0995, box_inertia(1.0, half));
    lay(&ball, 1.0, 1.0, 0.298, ball_inertia(1.0, 0.1));
    world
}

/// Allocations in a second of a scene that has been at work for a second.
fn allocations(mut world: World, patches: u32) -> u64 {
    for _ in 0..60 {
        world.step(1.0 / 60.0).unwrap();
    }
    allocations_of_a_second(&mut world, patches)
}

fn allocations_of_a_second(world: &mut World, patches: u32) -> u64 {
    let before = ALLOCATIONS.get();
    TRACED.set(true);
    for _ in 0..60 {
        world.step(1.0 / 60.0).unwrap();
    }
    TRACED.set(false);
    let count = ALLOCATIONS.get() - before;
    assert!(world.counters().patches >= patches, "{:?}", world.counters());
    count
}

#[test]
fn a_step_of_resting_balls_allocates_nothing() {
    assert_eq!(allocations(resting_scene(Scheme::Auto, true), 4), 0);
}

#[test]
fn a_step_of_a_mixed_resting_scene_allocates_nothing() {
    let counts = [Scheme::Auto, Scheme::Polar, Scheme::Adaptive, Scheme::Facets].map(|scheme| {
        let count = allocations(resting_scene(scheme, false), 9);
        println!("{scheme:?}: {count} allocations in 60 steps");
        count
    });
    assert_eq!(counts, [0; 4]);
}

#[test]
fn a_step_of_masses_on_springs_allocates_nothing() {
    for response in [Response::Implicit, Response::Substepped] {
        let mut world = resting_scene(Scheme::Auto, true);
        world.set_desc(WorldDesc { response, ..world.desc().clone() }).unwrap();
        let body = world.create_body(BodyDesc::default()).unwrap();
        let links: Vec<LinkId> = (0..10)
            .map(|index| {
                let kind = if index == 0 { Kind::Fixed } else { Kind::PointMass };
                let pose = Pose::at(0.1 * f64::from(index), 5.0, 0.0);
                world.create_link(body, LinkDesc { kind, mass: 0.1, pose, ..LinkDesc::default() }).unwrap()
            })
            .collect();
        let springs: Vec<_> = links
            .windows(2)
            .map(|pair| SpringDesc {
                links: [pair[0], pair[1]],
                rest_length: 0.1,
                stiffness: 1e3,
                damping: 1.0,
                ..SpringDesc::default()
            })
            .collect();
        world.create_springs(&springs).unwrap();
        assert_eq!(allocations(world, 4), 0, "{response:?}");
    }
}

/// Also where threads of the host help, as far as the thread that steps is concerned. Which island it gets is chance, so
/// that its buffers have grown to the largest after some seconds only: one of them must be without.
#[test]
fn steps_with_helpers_allocate_nothing() {
    let mut helped = resting_scene(Scheme::Auto, false);
    helped.set_tasks(Some(Box::new(Pool::new(2))));
    let counts: Vec<u64> = (0..20).map(|_| allocations_of_a_second(&mut helped, 9)).collect();
    assert!(counts.contains(&0), "{counts:?}");
}

#[test]
fn steps_of_sleepers_allocate_nothing() {
    let mut asleep = resting_scene(Scheme::Auto, true);
    let desc = WorldDesc { sleep_time: 0.1, sleep_speed: 1.0, ..asleep.desc().clone() };
    asleep.set_desc(desc).unwrap();
    assert_eq!(allocations(asleep, 4), 0);
}

/// Two links that draw near each other, with volume control: every step measures and moves offsets.
#[test]
fn steps_with_volume_control_allocate_nothing() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let body = world.create_body(BodyDesc { volume_gain: 0.5, ..BodyDesc::default() }).unwrap();
    let links = [0, 1].map(|_| {
        let link = world.create_link(body, LinkDesc { kind: Kind::Host, ..LinkDesc::default() }).unwrap();
        for x in [0.0, 0.1] {
            let shape = Shape::Point(Vec3::new(x, 0.0, 0.0));
            world.create_skeleton(link, SkeletonDesc { shape, ..SkeletonDesc::default() }).unwrap();
        }
        link
    });
    let skeleton = world.link_skeletons(links[0]).unwrap().next().unwrap();
    let mut go = |steps: std::ops::Range<u32>| {
        let (before, offset) = (ALLOCATIONS.get(), world.skeleton_offset(skeleton).unwrap());
        for step in steps {
            let pose = Pose::at(0.0, 0.0, 0.3 - 0.002 * f64::from(step));
            world.set_link_state(links[1], &LinkState { pose, ..LinkState::default() }).unwrap();
            world.step(1.0 / 60.0).unwrap();
        }
        (ALLOCATIONS.get() - before, world.skeleton_offset(skeleton).unwrap() != offset)
    };
    go(0..60);
    assert_eq!(go(60..120), (0, true));
}

#[test]
fn a_snapshot_into_a_buffer_with_room_allocates_nothing() {
    let mut world = resting_scene(Scheme::Auto, true);
    for _ in 0..10 {
        world.step(1.0 / 60.0).unwrap();
    }
    let mut bytes = Vec::with_capacity(world.snapshot_size());
    let before = ALLOCATIONS.get();
    world.snapshot(&mut bytes);
    world.snapshot_into(&mut bytes).unwrap();
    assert_eq!(ALLOCATIONS.get() - before, 0);
}

#[test]
fn a_mesh_made_again_allocates_nothing() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let body = world.create_body(BodyDesc::default()).unwrap();
    let link = world.create_link(body, LinkDesc::default()).unwrap();
    for k in 0..5 {
        let shape =
            Shape::segment(Vec3::new(0.1 * f64::from(k), 0.0, 0.0), Vec3::new(0.0, 0.1, 0.1 * f64::from(k + 1)));
        world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.1, ..SkeletonDesc::default() }).unwrap();
    }
    let (mut workspace, mut mesh) = (MeshWorkspace::default(), Mesh::default());
    let mut make = |world: &World, cell: f64| {
        world.mesh_into(body, &MeshDesc::new(cell), &mut workspace, &mut mesh).unwrap();
    };
    make(&world, 0.01);
    let before = ALLOCATIONS.get();
    make(&world, 0.01);
    make(&world, 0.02);
    assert_eq!(ALLOCATIONS.get() - before, 0);
}

#[test]
fn a_skin_deformed_again_allocates_nothing_and_no_ray_does() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let character = Character::new(&mut world);
    let mesh = world.mesh(character.body, &MeshDesc::new(0.05)).unwrap();
    let skin = world.create_skin(character.body, &mesh.positions, Some(&mesh.normals)).unwrap();
    let frame = |world: &World| world.deform_skin(skin, Deformation::None, |_, _, _| ()).unwrap();
    for amount in [1.0, 0.5, 0.0] {
        character.bend(&mut world, amount);
        frame(&world);
    }
    for amount in [0.0, 0.5, 1.0] {
        character.bend(&mut world, amount);
        let before = ALLOCATIONS.get();
        TRACED.set(true);
        frame(&world);
        TRACED.set(false);
        assert_eq!(ALLOCATIONS.get() - before, 0);
    }

    let cast = |count: usize| {
        let rays = (0..count).map(|k| Ray {
            origin: Vec3::new(0.0, 3.0, 0.1 + (k % 50) as f64 * 0.03),
            direction: Vec3::new(((k / 50 % 10) as f64 - 5.0) * 0.02, -1.0, 0.0),
            max_distance: f64::INFINITY,
        });
        let before = ALLOCATIONS.get();
        let mut hits = 0;
        world.cast_rays(rays, &RaysDesc::default(), |_, hit| hits += usize::from(hit.is_some())).unwrap();
        assert!(hits * 4 > count);
        ALLOCATIONS.get() - before
    };
    cast(500);
    let (few, many) = (cast(500), cast(5000));
    assert!(many <= few + 8, "{few} allocations for 500 rays, {many} for 5000");
}
