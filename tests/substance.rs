//! Soft substances: particles, their coat, separation, collision, fusion.

use isocoat::World;
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::Vec3;
use isocoat::world::{
    BodyDesc, BodyId, Change, Fill, LinkDesc, LinkId, ParticleId, SkeletonDesc, SubstanceDesc, WorldDesc,
};

const G: f64 = 9.81;

fn world(gravity: f64) -> World {
    World::new(WorldDesc { gravity: Vec3::new(0.0, 0.0, -gravity), ..WorldDesc::default() }).unwrap()
}

fn ground(world: &mut World) -> BodyId {
    let body = world
        .create_body(BodyDesc { rigid: true, friction: 0.6, static_friction: 0.8, ..BodyDesc::default() })
        .unwrap();
    let link = world.create_link(body, LinkDesc { kind: Kind::Fixed, ..LinkDesc::default() }).unwrap();
    let shape = Shape::Plane { point: Vec3::new(0.0, 0.0, -0.05), normal: Vec3::z() };
    world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.05, ..SkeletonDesc::default() }).unwrap();
    body
}

/// Clay of a density like water's: a pair's stiffness carries a lump some hundred particles high.
fn clay(spacing: f64) -> SubstanceDesc {
    let particle_mass = 1000.0 * spacing.powi(3) / 2.0_f64.sqrt();
    SubstanceDesc {
        spacing,
        particle_mass,
        cohesion: 60.0 * particle_mass * G * spacing,
        damping: 1.0,
        ..SubstanceDesc::default()
    }
}

fn lump(world: &mut World, desc: SubstanceDesc, fill: &Fill) -> BodyId {
    let body_desc = BodyDesc { stiffness_scale: 2e4, friction: 0.6, static_friction: 0.8, ..BodyDesc::default() };
    let body = world.create_body(body_desc).unwrap();
    world.make_substance(body, desc).unwrap();
    world.fill_substance(body, fill).unwrap();
    body
}

fn ball(center: Vec3, radius: f64) -> Fill<'static> {
    Fill::Ball { center, radius }
}

fn momentum(world: &World, body: BodyId) -> (Vec3, Vec3) {
    let mass = world.substance_desc(body).unwrap().particle_mass;
    let particles = world.particles(body).unwrap();
    let linear = particles.iter().map(|p| p.velocity * mass).sum();
    (linear, particles.iter().map(|p| p.position.cross(&p.velocity) * mass).sum())
}

fn volume(world: &World, body: BodyId) -> f64 {
    world.particles(body).unwrap().iter().map(|p| p.volume).sum()
}

fn target(world: &World, body: BodyId) -> f64 {
    world.particles(body).unwrap().iter().map(|p| p.target.unwrap()).sum()
}

/// Points of a lump at rest spacing, turned and moved.
fn packed(count: usize, spacing: f64, turn: f64, center: Vec3) -> Vec<Vec3> {
    let mut world = world(0.0);
    let reach = spacing * (count as f64).cbrt() * 1.5;
    let body = lump(&mut world, clay(spacing), &ball(Vec3::zeros(), reach));
    let mut points: Vec<Vec3> = world.particles(body).unwrap().iter().map(|p| p.position).collect();
    let middle = Vec3::new(0.13, 0.21, 0.08) * spacing;
    points.sort_by(|a, b| (a - middle).norm().total_cmp(&(b - middle).norm()));
    points.truncate(count);
    let rotation = isocoat::math::rotation_from_vector(&(Vec3::new(0.3, -0.5, 0.8) * turn));
    points.into_iter().map(|p| center + rotation * p).collect()
}

fn arrays(points: &[Vec3]) -> Vec<[f64; 3]> {
    points.iter().map(|p| (*p).into()).collect()
}

/// An ordinary body of points with the coat of a substance.
fn body_of_points(world: &mut World, desc: &SubstanceDesc, points: &[Vec3]) -> BodyId {
    let body = world.create_body(BodyDesc { stiffness_scale: 2e4, ..BodyDesc::default() }).unwrap();
    let link = world.create_link(body, LinkDesc { kind: Kind::Fixed, ..LinkDesc::default() }).unwrap();
    for p in points {
        let shape = Shape::Point(*p);
        let (thickness, radius) = (0.5 * desc.spacing, 1.25 * desc.spacing);
        world.create_skeleton(link, SkeletonDesc { shape, thickness, radius, ..SkeletonDesc::default() }).unwrap();
    }
    body
}

/// The force on the particles of one label in the first instant.
fn force_on(world: &mut World, body: BodyId, ids: &[ParticleId]) -> Vec3 {
    let dt = 1e-9;
    world.step(dt).unwrap();
    let mass = world.substance_desc(body).unwrap().particle_mass;
    ids.iter().map(|id| world.particle(body, *id).unwrap().velocity * (mass / dt)).sum()
}

#[test]
fn pieces_press_on_each_other_as_two_bodies_of_the_same_points_would() {
    let spacing = 0.1;
    let desc = SubstanceDesc { cohesion: 0.0, damping: 0.0, ..clay(spacing) };
    println!("{:>6} {:>6} {:>12} {:>12} {:>9}", "count", "sink", "bodies N", "pieces N", "off");
    for (count, turn) in [(1, 0.0), (2, 0.4), (13, 0.0), (13, 1.1), (40, 0.7)] {
        let a = packed(count, spacing, turn, Vec3::zeros());
        let top = a.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        let own = a.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        for sink in [0.1, 0.3, 0.4] {
            let reach = if count == 1 { 0.5 } else { 0.62 };
            let shift = Vec3::new(0.0, 0.0, top - own + spacing * (2.0 * reach - sink));
            let b: Vec<Vec3> = a.iter().map(|p| p + shift).collect();
            let mut bodies = world(0.0);
            let pair = [body_of_points(&mut bodies, &desc, &a), body_of_points(&mut bodies, &desc, &b)];
            let contacts = bodies.collide(pair[0], pair[1], isocoat::world::Scheme::Adaptive, 1e-3).unwrap();
            let exact: Vec3 = contacts.iter().map(|contact| contact.force).sum();
            let mut pieces = world(0.0);
            let body = pieces.create_body(BodyDesc { stiffness_scale: 2e4, ..BodyDesc::default() }).unwrap();
            pieces.make_substance(body, desc.clone()).unwrap();
            pieces.add_particles(body, &arrays(&a), None).unwrap();
            let ids = pieces.add_particles(body, &arrays(&b), None).unwrap();
            let force = force_on(&mut pieces, body, &ids);
            let off = (force - exact).norm() / exact.norm().max(1e-9);
            println!("{count:>6} {sink:>6} {:>12.4} {:>12.4} {off:>9.4}", exact.z, force.z);
            // K r0² is 100 N: light contacts between particles are seen less well.
            assert!((force - exact).norm() < 0.02 * exact.norm() + 0.3);
        }
    }
}

#[test]
fn lumps_press_on_a_floor_as_bodies_of_the_same_points_would_up_to_their_middle() {
    let spacing = 0.1;
    let desc = SubstanceDesc { cohesion: 0.0, damping: 0.0, ..clay(spacing) };
    println!("{:>6} {:>6} {:>12} {:>12} {:>9}", "count", "sink", "body N", "lump N", "off");
    for (count, turn) in [(1, 0.0), (2, 0.4), (13, 0.0), (13, 1.1), (40, 0.7)] {
        let a = packed(count, spacing, turn, Vec3::zeros());
        let own = a.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        for sink in [0.1, 0.3, 0.4, 0.48] {
            let reach = if count == 1 { 0.5 } else { 0.62 };
            let mut floors = world(0.0);
            let floor = ground(&mut floors);
            let lifted: Vec<Vec3> = a.iter().map(|p| p + Vec3::new(0.0, 0.0, spacing * (reach - sink) - own)).collect();
            let soft = body_of_points(&mut floors, &desc, &lifted);
            let contacts = floors.collide(floor, soft, isocoat::world::Scheme::Adaptive, 1e-3).unwrap();
            let exact: Vec3 = contacts.iter().map(|contact| contact.force).sum();
            floors.destroy_body(soft).unwrap();
            let body = floors.create_body(BodyDesc { stiffness_scale: 2e4, ..BodyDesc::default() }).unwrap();
            floors.make_substance(body, desc.clone()).unwrap();
            let ids = floors.add_particles(body, &arrays(&lifted), None).unwrap();
            let force = force_on(&mut floors, body, &ids);
            let off = (force - exact).norm() / exact.norm().max(1e-9);
            println!("{count:>6} {sink:>6} {:>12.4} {:>12.4} {off:>9.4}", exact.z, force.z);
            assert!((force - exact).norm() < 0.04 * exact.norm() + 0.3);
        }
    }
}

#[test]
fn a_lump_falls_on_the_ground_and_comes_to_rest_with_its_volume() {
    let mut world = world(G);
    ground(&mut world);
    let body = lump(&mut world, clay(0.05), &ball(Vec3::new(0.0, 0.0, 0.4), 0.2));
    let count = world.particles(body).unwrap().len();
    let started = std::time::Instant::now();
    let mut worst: f64 = 0.0;
    for step in 0..180 {
        world.step(1.0 / 60.0).unwrap();
        let error = volume(&world, body) / target(&world, body) - 1.0;
        worst = worst.max(error.abs());
        if step % 15 == 14 {
            let pieces = world.pieces(body).unwrap();
            let contact: Vec3 = world.contacts().iter().map(|c| c.force).sum();
            println!(
                "{count} t {:.2}: z {:.4} v {:.1e} volume {:+.4} pieces {} substeps {} force/weight {:.4} ms {:.2}",
                (step + 1) as f64 / 60.0,
                pieces[0].center.z,
                pieces[0].momentum.norm() / pieces[0].mass,
                error,
                pieces.len(),
                world.counters().substeps,
                -contact.z / (G * count as f64 * world.substance_desc(body).unwrap().particle_mass),
                started.elapsed().as_secs_f64() * 1e3 / (step + 1) as f64
            );
        }
    }
    println!("worst volume {worst}");
    assert!(worst < 0.03);
    let particles = world.particles(body).unwrap();
    let mean = particles.iter().map(|p| p.velocity.norm()).sum::<f64>() / count as f64;
    let contact: f64 = world.contacts().iter().map(|c| c.force.z).sum();
    let weight = G * count as f64 * world.substance_desc(body).unwrap().particle_mass;
    println!("mean speed {mean:.1e} m/s, force over weight {:.4}", -contact / weight);
    assert!(mean < 0.02 && (contact / weight + 1.0).abs() < 0.02);
}

#[test]
fn a_lump_rests_on_a_light_tray_that_its_host_holds() {
    for constrained in [true, false] {
        let mut world = world(G);
        let soft = lump(&mut world, clay(0.1), &ball(Vec3::new(0.0, 0.0, 0.4), 0.3));
        let weight = G * clay(0.1).particle_mass * world.particles(soft).unwrap().len() as f64;
        let rigid = BodyDesc { rigid: true, friction: 0.6, static_friction: 0.8, ..BodyDesc::default() };
        let body = world.create_body(rigid).unwrap();
        let mass = 0.2 * weight / G;
        let inertia = isocoat::math::Mat3::identity() * (0.3 * mass);
        let tray = LinkDesc { kind: Kind::Host, mass, inertia, constrained, ..LinkDesc::default() };
        let link = world.create_link(body, tray.clone()).unwrap();
        let half = Vec3::new(0.8, 0.8, 0.05);
        let shape = Shape::Box { center: Vec3::zeros(), half, axes: isocoat::math::Mat3::identity() };
        world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.05, ..SkeletonDesc::default() }).unwrap();
        let (mut fastest, mut pushed) = (0.0_f64, 0.0);
        let (steps, last) = (300, 60);
        for step in 0..steps {
            world.set_link_desc(link, tray.clone()).unwrap();
            world.step(1.0 / 60.0).unwrap();
            if step >= steps - last {
                let speeds = world.particles(soft).unwrap().iter().map(|p| p.velocity.norm()).fold(0.0, f64::max);
                fastest = fastest.max(speeds);
                pushed -= world.link_impulse(link).unwrap().force.z * 60.0 / f64::from(last);
            }
        }
        // With this speed the lump would follow a tray that nothing held in a step.
        let fall = (G + weight / mass) / 60.0;
        println!("constrained: {constrained}, {fastest:.4} m/s of {fall:.4} m/s, {pushed:.1} N of {weight:.1} N");
        assert!(fastest < 0.3 * fall);
        assert!((pushed / weight - 1.0).abs() < 0.02);
    }
}

/// Potential energy of particles [J]: model.md, "Particles", written again.
fn potential(desc: &SubstanceDesc, points: &[Vec3]) -> f64 {
    // At rest at the spacing: r0 is a little less.
    let r0 = desc.spacing / 1.024_156_065_016_251;
    let cut = 1.6 * r0;
    let bare = |r: f64| desc.cohesion * ((r0 / r).powi(8) / 8.0 - (r0 / r).powi(4) / 4.0);
    let shift = desc.cohesion / cut * ((r0 / cut).powi(8) - (r0 / cut).powi(4));
    let mut energy = 0.0;
    for (i, a) in points.iter().enumerate() {
        for b in &points[..i] {
            let r = (a - b).norm();
            if r < cut {
                energy += bare(r) - bare(cut) - shift * (cut - r);
            }
        }
    }
    energy
}

fn kinetic(world: &World, body: BodyId) -> f64 {
    let mass = world.substance_desc(body).unwrap().particle_mass;
    world.particles(body).unwrap().iter().map(|p| 0.5 * mass * p.velocity.norm_squared()).sum()
}

fn places(world: &World, body: BodyId) -> Vec<Vec3> {
    world.particles(body).unwrap().iter().map(|p| p.position).collect()
}

/// A lump in space of `count` particles that turns by `spin`.
fn spinning(desc: &SubstanceDesc, count: usize, spin: Vec3) -> (World, BodyId) {
    let mut world = world(0.0);
    let body = world.create_body(BodyDesc::default()).unwrap();
    world.make_substance(body, desc.clone()).unwrap();
    let points = packed(count, desc.spacing, 0.3, Vec3::zeros());
    let velocities: Vec<Vec3> = points.iter().map(|p| spin.cross(p) + Vec3::new(0.1, 0.0, 0.2)).collect();
    world.add_particles(body, &arrays(&points), Some(&arrays(&velocities))).unwrap();
    (world, body)
}

#[test]
fn a_free_spinning_lump_keeps_its_momenta_and_never_gains_energy() {
    let desc = SubstanceDesc { viscosity: 0.5, ..clay(0.1) };
    let (mut world, body) = spinning(&desc, 13, Vec3::new(0.4, 1.0, -0.7));
    let step = 0.15 * desc.spacing * (desc.particle_mass / desc.cohesion).sqrt();
    let (p0, l0) = momentum(&world, body);
    let energy = |world: &World| kinetic(world, body) + potential(&desc, &places(world, body));
    let (mut least, first) = (energy(&world), energy(&world));
    let (mut worst, mut gained): ([f64; 2], f64) = ([0.0; 2], 0.0);
    for _ in 0..10_000 {
        world.step(step).unwrap();
        let (p, l) = momentum(&world, body);
        worst = [worst[0].max((p - p0).norm() / p0.norm()), worst[1].max((l - l0).norm() / l0.norm())];
        let now = energy(&world);
        gained = gained.max((now - least) / first.abs());
        least = least.min(now);
    }
    println!(
        "momentum {:.1e}, angular momentum {:.1e}, energy above its least so far {gained:.1e}",
        worst[0], worst[1]
    );
    assert!(worst[0] < 1e-10 && worst[1] < 1e-10);
    assert!(gained < 1e-9, "energy never grows");
}

#[test]
fn without_friction_energy_has_no_trend() {
    let desc = SubstanceDesc { damping: 0.0, volume_gain: 0.0, seed_count: 4, ..clay(0.1) };
    let (mut world, body) = spinning(&SubstanceDesc { damping: 1.0, ..desc.clone() }, 13, Vec3::zeros());
    world.set_desc(WorldDesc { substep_phase: 1.0, ..world.desc().clone() }).unwrap();
    let step = 0.2 * desc.spacing * (desc.particle_mass / desc.cohesion).sqrt();
    // A lump at rest in itself, that swings and turns a little.
    for _ in 0..1000 {
        world.step(step).unwrap();
    }
    let ids: Vec<ParticleId> = world.particles(body).unwrap().iter().map(|p| p.id).collect();
    let velocities: Vec<Vec3> = places(&world, body)
        .iter()
        .map(|p| Vec3::new(0.4, 1.0, -0.7).cross(p) + 0.5 * p.component_mul(&Vec3::new(1.0, -1.0, 0.3)))
        .collect();
    world.set_particles(body, &ids, None, Some(&arrays(&velocities))).unwrap();
    world.set_substance_desc(body, desc.clone()).unwrap();
    let binding = -potential(&desc, &places(&world, body));
    let mut means = [0.0; 10];
    for at in 0..10_000 {
        world.step(step).unwrap();
        assert_eq!(world.counters().substeps, 1);
        means[at / 1000] += (kinetic(&world, body) + potential(&desc, &places(&world, body))) / 1000.0;
    }
    let trend = means.map(|mean| (mean - means[0]) / binding);
    println!(
        "mean energy by thousands of steps, over the binding energy: {trend:?}, motion {:.1e}",
        kinetic(&world, body) / binding
    );
    assert!(trend.iter().all(|trend| trend.abs() < 1e-4), "{trend:?}");
}

#[test]
fn a_press_fuses_just_above_the_threshold_and_not_just_below() {
    // Two particles of their own: the pressure is highest on the line of centres, K (F(d/2) - c) there.
    let desc = SubstanceDesc { cohesion: 0.0, damping: 0.0, ..clay(0.1) };
    let mut seed = 7_u64;
    let mut next = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1_u64 << 53) as f64
    };
    for case in 0..50 {
        let axis = Vec3::new(next() - 0.5, next() - 0.5, next() - 0.5).normalize();
        let distance = 0.1 * (0.6 + 0.38 * next());
        // Slope of the field inside: 2 c / (R - t).
        let peak = 4e4 * 2.0 / 0.075 * (0.05 - 0.5 * distance);
        for (threshold, fuses) in [(peak / 1.1, true), (peak / 0.9, false)] {
            let mut world = world(0.0);
            let body = world.create_body(BodyDesc { stiffness_scale: 4e4, ..BodyDesc::default() }).unwrap();
            world.make_substance(body, SubstanceDesc { fusion_threshold: threshold, ..desc.clone() }).unwrap();
            let origin = Vec3::new(next(), next(), next()) * 10.0;
            world.add_particles(body, &[origin.into()], None).unwrap();
            world.add_particles(body, &[(origin + axis * distance).into()], None).unwrap();
            world.step(1e-9).unwrap();
            world.step(1e-9).unwrap();
            let began = world.substance_changes(body).unwrap().iter().any(|c| matches!(c, Change::Fused(_)));
            assert_eq!(began || bonds(&world, body), fuses, "case {case}: {peak} against {threshold}");
        }
    }
}

/// Whether anything has begun to blend: the field between two becomes higher than that of either.
fn bonds(world: &World, body: BodyId) -> bool {
    let particles = world.particles(body).unwrap();
    let middle: [f64; 3] = ((particles[0].position + particles[1].position) * 0.5).into();
    let mut value = [0.0];
    world.evaluate_field(body, &[middle], Some(&mut value), None).unwrap();
    let alone = 1.0 + 2.0 / 0.075 * (0.05 - 0.5 * (particles[0].position - particles[1].position).norm());
    value[0] > alone * (1.0 + 1e-12)
}

#[test]
fn what_is_pulled_apart_separates_without_a_jump_and_does_not_blend_again() {
    let desc = SubstanceDesc { cohesion: 0.0, damping: 0.0, volume_gain: 0.0, ..clay(0.1) };
    let mut world = world(0.0);
    let body = world.create_body(BodyDesc { stiffness_scale: 2e4, ..BodyDesc::default() }).unwrap();
    world.make_substance(body, desc.clone()).unwrap();
    let ids = world.add_particles(body, &[[0.0; 3], [0.1, 0.0, 0.0]], None).unwrap();
    world.set_particles(body, &ids, None, Some(&[[-0.05, 0.0, 0.0], [0.05, 0.0, 0.0]])).unwrap();
    let surface = |world: &World| {
        let x = places(world, body)[0];
        let hit = world.cast_ray(&((x + places(world, body)[1]) * 0.5), &-Vec3::x(), 1.0, u64::MAX).unwrap();
        hit.map_or(f64::NAN, |hit| hit.position.x - x.x)
    };
    let (mut split_at, mut last, mut worst, mut moved) = (None, f64::NAN, 0.0_f64, 0.0);
    let step = 1.0 / 60.0;
    for at in 0..180 {
        world.step(step).unwrap();
        for change in world.substance_changes(body).unwrap().to_vec() {
            if let Change::Split(members) = change {
                assert_eq!(members.len(), 1);
                split_at = Some(at);
                // From here on, nothing but the cut moves the surface.
                world.set_particles(body, &ids, None, Some(&[[0.0; 3]; 2])).unwrap();
            }
        }
        if split_at.is_some() {
            let now = surface(&world);
            let way = if last.is_nan() { 0.0 } else { (now - last).abs() / 0.05 };
            (moved, worst) = (moved + way, worst.max(way));
            last = now;
        }
    }
    assert!(moved > 0.02, "the cut moves the surface in all: {moved}");
    let split = split_at.expect("they separate");
    let distance = 0.1 + 0.1 * step * split as f64;
    println!(
        "in all {moved:.4}; split at distance {:.3} r0; surface moves at most {worst:.4} of the thickness a step",
        distance / 0.1
    );
    assert!(worst < 0.01);
    // Together again, gently: never one piece, and pressing as two bodies would.
    world.set_particles(body, &ids, None, Some(&[[0.0; 3]; 2])).unwrap();
    world.set_particles(body, &ids, Some(&[[0.0; 3], [0.09, 0.0, 0.0]]), None).unwrap();
    let force = force_on(&mut world, body, &ids[1..]);
    let mut bodies = World::new(WorldDesc::default()).unwrap();
    let pair = [[0.0; 3], [0.09, 0.0, 0.0]].map(|p| body_of_points(&mut bodies, &desc, &[p.into()]));
    let contacts = bodies.collide(pair[0], pair[1], isocoat::world::Scheme::Adaptive, 1e-3).unwrap();
    println!("together again: {:.4} N, two bodies {:.4} N", force.x, contacts[0].force.x);
    assert!((force.x / contacts[0].force.x - 1.0).abs() < 0.01);
    for _ in 0..60 {
        world.step(1e-4).unwrap();
        assert_eq!(world.pieces(body).unwrap().len(), 2);
    }
}

/// All that must be true of a substance whatever happens to it.
fn assert_sound(world: &World, body: BodyId, what: &str) {
    for particle in world.particles(body).unwrap() {
        let finite = particle.position.iter().chain(particle.velocity.iter()).all(|x| x.is_finite());
        assert!(finite && particle.volume.is_finite() && particle.offset.is_finite(), "{what}: {particle:?}");
    }
}

#[test]
fn any_size_and_stiffness_is_finite_and_too_much_of_it_is_reported() {
    for spacing in [1e-4, 1e-2, 1.0, 1e2] {
        for stiffer in [1.0, 100.0, 1e6] {
            let mut world = World::new(WorldDesc {
                gravity: Vec3::new(0.0, 0.0, -G * spacing / 0.05),
                max_substeps: 256,
                ..WorldDesc::default()
            })
            .unwrap();
            let mut plain = clay(spacing);
            plain.cohesion *= spacing / 0.05 * stiffer;
            let body_desc =
                BodyDesc { stiffness_scale: 2e4 * (spacing / 0.05).powi(2) * stiffer, ..BodyDesc::default() };
            let body = world.create_body(body_desc).unwrap();
            world.make_substance(body, plain).unwrap();
            world.fill_substance(body, &ball(Vec3::zeros(), 1.6 * spacing)).unwrap();
            let floor = world.create_body(BodyDesc { rigid: true, ..BodyDesc::default() }).unwrap();
            let link = world.create_link(floor, LinkDesc { kind: Kind::Fixed, ..LinkDesc::default() }).unwrap();
            let shape = Shape::Plane { point: Vec3::new(0.0, 0.0, -4.0 * spacing), normal: Vec3::z() };
            world.create_skeleton(link, SkeletonDesc { shape, thickness: spacing, ..SkeletonDesc::default() }).unwrap();
            let warned = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
            let saw = warned.clone();
            world.set_log(Some(Box::new(move |_, text| {
                saw.fetch_or(text.contains("max_substeps"), std::sync::atomic::Ordering::Relaxed);
            })));
            for _ in 0..60 {
                world.step(1.0 / 60.0).unwrap();
            }
            let what = format!("spacing {spacing}, {stiffer} times as stiff");
            assert_sound(&world, body, &what);
            let lowest = places(&world, body).iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
            let warned = warned.load(std::sync::atomic::Ordering::Relaxed);
            println!(
                "{what}: lowest {:.2} r0, warned {warned}, sub-steps {}",
                lowest / spacing,
                world.counters().substeps
            );
            assert!(lowest > -3.0 * spacing, "{what}: nobody falls through");
            assert_eq!(warned, stiffer == 1e6, "{what}");
        }
    }
}

#[test]
fn two_particles_at_one_point_part_and_rest() {
    let desc = clay(0.1);
    let mut world = world(0.0);
    let body = world.create_body(BodyDesc::default()).unwrap();
    world.make_substance(body, SubstanceDesc { viscosity: 10.0, ..desc.clone() }).unwrap();
    world.add_particles(body, &[[3.0, 2.0, 1.0]; 2], None).unwrap();
    for _ in 0..600 {
        world.step(1.0 / 60.0).unwrap();
        assert_sound(&world, body, "at one point");
    }
    let p = places(&world, body);
    // Either together at rest, or apart for good.
    let distance = (p[0] - p[1]).norm() / 0.1;
    println!("distance {distance}");
    assert!(distance > 0.95);
    assert!(((p[0] + p[1]) * 0.5 - Vec3::new(3.0, 2.0, 1.0)).norm() < 1e-9, "momentum");
}

#[test]
fn a_particle_at_a_thousand_metres_a_second_does_not_pass_through_a_plate() {
    let mut world = World::new(WorldDesc { max_substeps: 256, ..WorldDesc::default() }).unwrap();
    let plate = world.create_body(BodyDesc { rigid: true, ..BodyDesc::default() }).unwrap();
    let link = world.create_link(plate, LinkDesc { kind: Kind::Fixed, ..LinkDesc::default() }).unwrap();
    let shape =
        Shape::Box { center: Vec3::zeros(), half: Vec3::new(1.0, 1.0, 0.05), axes: isocoat::math::Mat3::identity() };
    world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.02, ..SkeletonDesc::default() }).unwrap();
    let body = lump(&mut world, clay(0.05), &ball(Vec3::new(0.0, 0.0, -0.5), 0.1));
    let fast = world.add_particles(body, &[[0.0, 0.0, 5.0]], Some(&[[0.0, 0.0, -1000.0]])).unwrap();
    for _ in 0..30 {
        world.step(1.0 / 60.0).unwrap();
        assert_sound(&world, body, "fast");
        let z = world.particle(body, fast[0]).unwrap().position.z;
        assert!(z > 0.0, "{z}");
    }
}

#[test]
fn names_stay_true_while_particles_come_and_go() {
    let mut world = world(0.0);
    let body = lump(&mut world, clay(0.05), &ball(Vec3::zeros(), 0.12));
    let ids: Vec<ParticleId> = world.particles(body).unwrap().iter().map(|p| p.id).collect();
    let before = world.particle(body, ids[7]).unwrap().position;
    world.remove_particles(body, &[ids[0], ids[3], *ids.last().unwrap()]).unwrap();
    assert_eq!(world.particle(body, ids[7]).unwrap().position, before);
    assert!(world.particle(body, ids[3]).unwrap_err().to_string().contains("particle"));
    let fresh = world.add_particles(body, &[[1.0, 0.0, 0.0]], None).unwrap();
    assert!(!ids.contains(&fresh[0]), "a name is never given again");
    assert!(world.remove_particles(body, &[fresh[0], fresh[0]]).is_err());
    assert!(world.particle(body, fresh[0]).is_ok(), "a refused call changes nothing");
    let error = world.add_particles(body, &[[f64::NAN; 3]], None).unwrap_err().to_string();
    assert!(error.contains("NaN"), "{error}");
    assert!(world.create_link(body, LinkDesc::default()).is_err());
    world.step(0.01).unwrap();
}

#[test]
fn a_restored_substance_goes_on_with_the_same_bits() {
    let mut world = world(G);
    ground(&mut world);
    let soft = SubstanceDesc { fusion_threshold: 100.0, ..clay(0.05) };
    let body = lump(&mut world, soft, &ball(Vec3::new(0.0, 0.0, 0.15), 0.1));
    world.fill_substance(body, &ball(Vec3::new(0.0, 0.02, 0.36), 0.1)).unwrap();
    for _ in 0..30 {
        world.step(1.0 / 60.0).unwrap();
    }
    let mut bytes = Vec::new();
    world.snapshot(&mut bytes);
    let mut other = World::new(WorldDesc::default()).unwrap();
    other.restore(&bytes).unwrap();
    let there = other.bodies().nth(1).unwrap();
    for _ in 0..20 {
        world.step(1.0 / 60.0).unwrap();
        other.step(1.0 / 60.0).unwrap();
        assert_eq!(world.particles(body).unwrap(), other.particles(there).unwrap());
    }
}

/// A world whose bodies may sleep, with a lump that lies on the ground and is asleep.
fn one_asleep() -> (World, BodyId, BodyId) {
    let mut world = world(G);
    world.set_desc(WorldDesc { sleep_time: 0.25, sleep_speed: 0.5, ..world.desc().clone() }).unwrap();
    let floor = ground(&mut world);
    let body = lump(&mut world, clay(0.05), &ball(Vec3::new(0.0, 0.0, 0.12), 0.12));
    let fell = (0..600).position(|_| {
        world.step(1.0 / 60.0).unwrap();
        !world.body_is_awake(body).unwrap()
    });
    println!("asleep after {:?} steps", fell);
    assert!(fell.is_some());
    (world, floor, body)
}

#[test]
fn a_substance_at_rest_falls_asleep_and_does_not_move_any_more() {
    let (mut world, _, body) = one_asleep();
    let (before, contacts) = (world.particles(body).unwrap().to_vec(), world.contacts().to_vec());
    assert!(momentum(&world, body).0 == Vec3::zeros() && !contacts.is_empty());
    let weight = G * before.len() as f64 * world.substance_desc(body).unwrap().particle_mass;
    assert!((contacts[0].force.z / weight + 1.0).abs() < 0.2, "{}", contacts[0].force.z / weight);
    let mut bytes = Vec::new();
    world.snapshot(&mut bytes);
    let mut other = World::new(WorldDesc::default()).unwrap();
    other.restore(&bytes).unwrap();
    for world in [&mut world, &mut other] {
        let there = world.bodies().nth(1).unwrap();
        for _ in 0..30 {
            world.step(1.0 / 60.0).unwrap();
            assert_eq!((world.counters().asleep, world.counters().substeps), (1, 0));
        }
        assert_eq!(world.particles(there).unwrap(), before);
        assert_eq!(world.contacts().len(), contacts.len());
        assert_eq!(world.contacts()[0].force, contacts[0].force);
    }
    // Both wake to the same bits.
    for world in [&mut world, &mut other] {
        let there = world.bodies().nth(1).unwrap();
        world.wake_body(there).unwrap();
        (0..5).for_each(|_| world.step(1.0 / 60.0).unwrap());
    }
    let there = other.bodies().nth(1).unwrap();
    assert_eq!(world.particles(body).unwrap(), other.particles(there).unwrap());
}

#[test]
fn whatever_touches_or_changes_a_substance_wakes_it() {
    type Touch = (&'static str, fn(&mut World, BodyId, BodyId));
    let touches: [Touch; 6] = [
        ("a force", |world, _, body| {
            let first = world.particles(body).unwrap()[0].id;
            world.add_particle_forces(body, &[first], &[[0.0, 0.0, 1.0]]).unwrap();
        }),
        ("a velocity", |world, _, body| {
            let first = world.particles(body).unwrap()[0].id;
            world.set_particles(body, &[first], None, Some(&[[0.0, 0.0, 1.0]])).unwrap();
        }),
        ("the ground changes", |world, floor, _| {
            let desc = world.body_desc(floor).unwrap().clone();
            world.set_body_desc(floor, BodyDesc { friction: 0.1, ..desc }).unwrap();
        }),
        ("the ground goes", |world, floor, _| world.destroy_body(floor).unwrap()),
        ("a new body beside it", |world, _, _| {
            tool(world, Vec3::new(0.0, 0.0, 0.3), Vec3::repeat(0.05), 0.02, 0.5);
        }),
        ("another substance", |world, _, _| {
            lump(world, clay(0.05), &ball(Vec3::new(0.0, 0.0, 0.32), 0.06));
        }),
    ];
    for (what, touch) in touches {
        let (mut world, floor, body) = one_asleep();
        touch(&mut world, floor, body);
        world.step(1.0 / 60.0).unwrap();
        assert!(world.body_is_awake(body).unwrap(), "{what}");
        if what == "the ground goes" {
            let fall = world.particles(body).unwrap().iter().map(|p| p.velocity.z).sum::<f64>();
            let count = world.particles(body).unwrap().len() as f64;
            assert!((fall / count + G / 60.0).abs() < 1e-9, "nothing carries it: {}", fall / count);
        }
    }
}

/// What comes from afar wakes it before the two touch, and is slowed down by it.
#[test]
fn a_ball_that_falls_on_a_substance_wakes_it_in_time() {
    let (mut world, floor, body) = one_asleep();
    assert!(world.body_is_awake(floor).unwrap());
    let ball = world.create_body(BodyDesc { rigid: true, ..BodyDesc::default() }).unwrap();
    let kind = Kind::Rigid;
    let pose = isocoat::math::Pose::at(0.0, 0.0, 1.2);
    let link =
        LinkDesc { kind, mass: 0.2, inertia: isocoat::math::Mat3::identity() * 3e-4, pose, ..LinkDesc::default() };
    let link = world.create_link(ball, link).unwrap();
    let shape = Shape::Point(Vec3::zeros());
    world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.06, ..SkeletonDesc::default() }).unwrap();
    let top = world.particles(body).unwrap().iter().map(|p| p.position.z).fold(0.0, f64::max);
    let (mut woke, mut slowed) = (None, false);
    for step in 0..60 {
        let before = world.link_state(link).unwrap();
        world.step(1.0 / 60.0).unwrap();
        let reach = before.pose.position.z + before.twist.linear.z / 60.0 - 0.06 - top;
        if woke.is_none() && world.body_is_awake(body).unwrap() {
            woke = Some(reach);
        }
        let lost = G * (step + 1) as f64 / 60.0 + world.link_state(link).unwrap().twist.linear.z;
        assert!(woke.is_some() || lost.abs() < 1e-9, "it falls freely until then");
        slowed |= lost > 1.0;
    }
    println!("woke when the ball came as near as {woke:?} m");
    assert!(woke.is_some_and(|gap| (0.0..0.3).contains(&gap)), "before they touch: {woke:?}");
    assert!(slowed, "the substance holds it");
}

/// Moves a host-driven link with this velocity for a step.
fn drive(world: &mut World, link: LinkId, velocity: Vec3) {
    let mut desc = world.link_desc(link).unwrap().clone();
    desc.pose.position += desc.twist.linear / 60.0;
    desc.twist.linear = velocity;
    world.set_link_desc(link, desc).unwrap();
}

/// Volume over the rest volume of the whole, and of the worst piece.
fn volume_errors(world: &World, body: BodyId) -> [f64; 2] {
    let particles = world.particles(body).unwrap();
    let mut pieces: std::collections::BTreeMap<u32, (f64, f64)> = std::collections::BTreeMap::new();
    for particle in particles {
        let sums = pieces.entry(particle.label).or_default();
        *sums = (sums.0 + particle.volume, sums.1 + particle.target.unwrap());
    }
    let total = pieces.values().fold((0.0, 0.0), |sum, piece| (sum.0 + piece.0, sum.1 + piece.1));
    let worst = pieces.values().map(|(volume, target)| (volume / target - 1.0).abs()).fold(0.0, f64::max);
    [total.0 / total.1 - 1.0, worst]
}

#[test]
fn a_loaf_falls_on_a_wedge_splits_and_its_halves_stay_apart() {
    split_a_loaf(0.05, 4.0);
}

/// The same of a thousand particles.
#[test]
#[ignore = "takes a minute: `make loaf`"]
fn a_loaf_of_a_thousand_falls_on_a_wedge_splits_and_its_halves_stay_apart() {
    split_a_loaf(0.03, 6.0);
}

fn split_a_loaf(spacing: f64, strength: f64) {
    let mut world = world(G);
    ground(&mut world);
    let wedge = world
        .create_body(BodyDesc { rigid: true, friction: 0.1, static_friction: 0.1, ..BodyDesc::default() })
        .unwrap();
    let link = world.create_link(wedge, LinkDesc { kind: Kind::Fixed, ..LinkDesc::default() }).unwrap();
    for (x, z) in [(-0.5, -0.3), (0.5, -0.3)] {
        let shape = Shape::Triangle(Vec3::new(0.0, -1.0, 0.6), Vec3::new(0.0, 1.0, 0.6), Vec3::new(x, 0.0, z));
        world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.02, ..SkeletonDesc::default() }).unwrap();
    }
    let soft = SubstanceDesc { cohesion: strength * clay(spacing).cohesion / 60.0, ..clay(spacing) };
    let fill = Fill::Box { low: Vec3::new(-0.25, -0.15, 0.75), high: Vec3::new(0.25, 0.15, 0.95) };
    let body = lump(&mut world, soft, &fill);
    let count = world.particles(body).unwrap().len();
    let mut worst = [0.0_f64; 2];
    let mut step_on = |world: &mut World| {
        world.step(1.0 / 60.0).unwrap();
        assert_sound(world, body, "loaf");
        let errors = volume_errors(world, body);
        worst = [worst[0].max(errors[0].abs()), worst[1].max(errors[1])];
    };
    let halves = |world: &World| -> Vec<Vec<ParticleId>> {
        let pieces = world.pieces(body).unwrap().into_iter().map(|piece| piece.particles);
        pieces.filter(|piece| piece.len() > count / 4).collect()
    };
    let mut split = None;
    for step in 0..150 {
        step_on(&mut world);
        if split.is_none() && halves(&world).len() == 2 {
            split = Some(step);
        }
    }
    assert!(split.is_some());
    let apart = halves(&world);
    // The wedge goes, and two boards push the halves together again.
    world.destroy_body(wedge).unwrap();
    let side = places(&world, body).iter().map(|p| p.x.abs()).fold(0.0, f64::max) + 0.15;
    let boards = [-1.0, 1.0].map(|sign| {
        let half = Vec3::new(0.03, 0.5, 0.2);
        tool(&mut world, Vec3::new(sign * side, 0.0, 0.25), half, 0.02, 0.2)
    });
    let mut pressed = 0;
    for _ in 0..200 {
        // How near the halves are, and whether they lie against each other along more than an edge.
        let [a, b] = [0, 1].map(|half| {
            let place = |id: &ParticleId| world.particle(body, *id).unwrap().position;
            apart[half].iter().map(place).collect::<Vec<_>>()
        });
        let touches = |p: &&Vec3| b.iter().any(|q| (q - **p).norm() < 1.2 * spacing);
        pressed = pressed.max(a.iter().filter(touches).count());
        let speed = if pressed < 20 { 0.4 } else { 0.0 };
        for (board, sign) in boards.into_iter().zip([-1.0, 1.0]) {
            drive(&mut world, board, Vec3::new(-sign * speed, 0.0, 0.0));
        }
        step_on(&mut world);
    }
    println!(
        "{count} particles, split at {split:?}; {pressed} press on the other half; volume off by {:.4} at most, pieces by {:.4}",
        worst[0], worst[1]
    );
    assert!(pressed >= 20, "they were pushed together");
    let label = |id: &ParticleId| world.particle(body, *id).unwrap().label;
    let [a, b] = [0, 1].map(|half| apart[half].iter().map(label).collect::<std::collections::BTreeSet<u32>>());
    assert!(a.is_disjoint(&b), "no longer one");
    assert!(worst[0] < 0.03 && worst[1] < 0.03);
}

/// A rigid body of one link that the host moves, with a box for a skeleton.
fn tool(world: &mut World, center: Vec3, half: Vec3, thickness: f64, friction: f64) -> LinkId {
    let body = world
        .create_body(BodyDesc { rigid: true, friction, static_friction: friction, ..BodyDesc::default() })
        .unwrap();
    let mut desc = LinkDesc { kind: Kind::Host, ..LinkDesc::default() };
    desc.pose.position = center;
    let link = world.create_link(body, desc).unwrap();
    let shape = Shape::Box { center: Vec3::zeros(), half, axes: isocoat::math::Mat3::identity() };
    world.create_skeleton(link, SkeletonDesc { shape, thickness, ..SkeletonDesc::default() }).unwrap();
    link
}

#[test]
fn nine_particles_are_grabbed_by_pliers_and_released() {
    // [95, Fig. 5]: threshold zero, so that what touches is one again at once.
    let mut world = world(G);
    ground(&mut world);
    let soft = SubstanceDesc { fusion_threshold: 0.0, ..clay(0.1) };
    let body = world
        .create_body(BodyDesc { stiffness_scale: 2e4, friction: 0.8, static_friction: 1.0, ..BodyDesc::default() })
        .unwrap();
    world.make_substance(body, soft).unwrap();
    let row = |j: i32, i: i32| [0.1 * f64::from(i), 0.1 * f64::from(j), 0.06];
    let places: Vec<[f64; 3]> = (-1..2).flat_map(|j| (-1..2).map(move |i| row(j, i))).collect();
    world.add_particles(body, &places, None).unwrap();
    let jaws = [-1.0, 1.0].map(|side| {
        let half = Vec3::new(0.02, 0.06, 0.05);
        tool(&mut world, Vec3::new(side * 0.3, 0.0, 0.09), half, 0.01, 1.0)
    });
    let (mut worst, mut highest): (f64, f64) = (0.0, 0.0);
    for step in 0..300 {
        let t = step as f64 / 60.0;
        for (jaw, side) in jaws.into_iter().zip([-1.0, 1.0]) {
            let closing = if t < 1.0 {
                -0.22 * side
            } else if (3.0..4.0).contains(&t) {
                0.22 * side
            } else {
                0.0
            };
            let lifting = if (1.0..2.0).contains(&t) { 0.25 } else { 0.0 };
            drive(&mut world, jaw, Vec3::new(closing, 0.0, lifting));
        }
        world.step(1.0 / 60.0).unwrap();
        assert_sound(&world, body, "pliers");
        worst = worst.max(volume_errors(&world, body)[0].abs());
        let center = places_mean(&world, body);
        if (2.5..3.0).contains(&t) {
            highest = f64::max(highest, center.z);
        }
        if step % 30 == 29 {
            let pieces: Vec<usize> = world.pieces(body).unwrap().iter().map(|piece| piece.particles.len()).collect();
            println!(
                "t {t:.1}: centre {:.3}, pieces {pieces:?}, volume {:+.4}",
                center.z,
                volume_errors(&world, body)[0]
            );
        }
    }
    println!("held at {highest:.3} m; volume off by {worst:.4} at most");
    assert!(highest > 0.2, "the pliers hold it: {highest}");
    assert!(places_mean(&world, body).z < 0.15, "and let it go");
    assert!(worst < 0.03);
}

fn places_mean(world: &World, body: BodyId) -> Vec3 {
    let places = places(world, body);
    places.iter().sum::<Vec3>() / places.len() as f64
}

/// A rigid hand, palm down: a box, four fingers and a thumb.
fn hand(world: &mut World, center: Vec3) -> LinkId {
    let link = tool(world, center, Vec3::new(0.05, 0.06, 0.012), 0.01, 0.3);
    let fingers = [-0.045, -0.015, 0.015, 0.045].map(|y| [Vec3::new(0.05, y, 0.0), Vec3::new(0.15, y, -0.015)]);
    let thumb = [Vec3::new(-0.02, -0.06, 0.0), Vec3::new(0.05, -0.11, -0.015)];
    for [from, to] in fingers.into_iter().chain([thumb]) {
        let shape = Shape::Segment(from, to);
        world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.012, ..SkeletonDesc::default() }).unwrap();
    }
    link
}

#[test]
fn three_substances_under_pin_knife_and_hand_never_mix() {
    let mut world = world(G);
    ground(&mut world);
    let bodies = [(-0.3, 1.0), (0.0, 0.5), (0.3, 2.0)].map(|(x, stiffer)| {
        let soft = clay(0.05);
        let cohesion = soft.cohesion * stiffer;
        let soft = SubstanceDesc { cohesion, fusion_threshold: 0.0, ..soft };
        lump(&mut world, soft, &ball(Vec3::new(x, 0.0, 0.14), 0.14))
    });
    let pin_body = world.create_body(BodyDesc { rigid: true, friction: 0.5, ..BodyDesc::default() }).unwrap();
    let mut desc = LinkDesc { kind: Kind::Host, ..LinkDesc::default() };
    desc.pose.position = Vec3::new(-0.7, 0.0, 0.22);
    let pin = world.create_link(pin_body, desc).unwrap();
    let shape = Shape::Segment(Vec3::new(0.0, -0.4, 0.0), Vec3::new(0.0, 0.4, 0.0));
    world.create_skeleton(pin, SkeletonDesc { shape, thickness: 0.08, ..SkeletonDesc::default() }).unwrap();
    let knife = tool(&mut world, Vec3::new(0.3, 0.0, 0.5), Vec3::new(0.002, 0.3, 0.15), 0.004, 0.05);
    let hand = hand(&mut world, Vec3::new(-0.2, -0.06, 0.45));
    let (mut worst, mut pressed) = ([0.0_f64; 3], 0.0_f64);
    for step in 0..240 {
        let t = step as f64 / 60.0;
        let rolling = if t < 2.0 { Vec3::new(0.35, 0.0, 0.0) } else { Vec3::new(0.0, 0.0, 0.3) };
        // Down to 2 mm above the ground.
        let cutting = if (2.0..3.3).contains(&t) { Vec3::new(0.0, 0.0, -0.344 / 1.3) } else { Vec3::zeros() };
        drive(&mut world, pin, rolling);
        drive(&mut world, knife, cutting);
        // Down to 8 cm above the ground, and up again.
        let pressing = if (2.0..3.3).contains(&t) { -0.37 / 1.3 } else { 0.0 } + if t >= 3.3 { 0.4 } else { 0.0 };
        drive(&mut world, hand, Vec3::new(0.0, 0.0, pressing));
        world.step(1.0 / 60.0).unwrap();
        let on_hand = world.contacts().iter().filter(|contact| contact.links.contains(&hand));
        let force = on_hand.map(|contact| contact.force.norm()).sum::<f64>();
        pressed = pressed.max(force);
        assert!(t < 3.9 || force == 0.0, "the hand comes off: {force} N");
        if step == 197 {
            let palm = world.link_state(hand).unwrap().pose.position;
            let under = |p: &&Vec3| (p.x - palm.x).abs() < 0.04 && (p.y - palm.y).abs() < 0.05;
            let highest = places(&world, bodies[0]).iter().filter(under).map(|p| p.z).fold(0.0, f64::max);
            println!("the palm is {:.3} m high, the highest particle under it {highest:.3} m", palm.z - 0.022);
            assert!(highest > 0.0 && highest < palm.z - 0.022, "the hand leaves its print");
        }
        for (body, worst) in bodies.into_iter().zip(&mut worst) {
            assert_sound(&world, body, "kitchen");
            *worst = worst.max(volume_errors(&world, body)[0].abs());
        }
    }
    for body in bodies {
        let places = places(&world, body);
        let low = places.iter().fold(Vec3::repeat(9.0), |low, p| low.inf(p));
        let high = places.iter().fold(Vec3::repeat(-9.0), |high, p| high.sup(p));
        let pieces: Vec<usize> = world.pieces(body).unwrap().iter().map(|piece| piece.particles.len()).collect();
        println!("from {low:.2?} to {high:.2?}, pieces {pieces:?}");
    }
    println!("volumes off by {worst:.4?} at most; the hand pressed with up to {pressed:.0} N");
    assert!(pressed > 1.0, "the hand presses");
    assert!(worst.iter().all(|worst| *worst < 0.03));
    assert!(world.pieces(bodies[2]).unwrap().len() > 1, "the knife cuts");
}

#[test]
fn lumps_that_are_pressed_together_fuse_without_a_jump_of_volume() {
    let (fused, pieces) = press_two_lumps(500.0);
    assert!(fused.is_some() && pieces == 1);
    let (fused, pieces) = press_two_lumps(f64::INFINITY);
    assert!(fused.is_none() && pieces == 2, "below the threshold they never fuse");
}

/// Presses two lumps together between plates. The step at which they began to fuse, and how many pieces there are in the end.
fn press_two_lumps(fusion_threshold: f64) -> (Option<u32>, usize) {
    let mut world = world(0.0);
    let body = world.create_body(BodyDesc { stiffness_scale: 2e4, ..BodyDesc::default() }).unwrap();
    world.make_substance(body, SubstanceDesc { fusion_threshold, ..clay(0.05) }).unwrap();
    for side in [-1.0, 1.0] {
        world.fill_substance(body, &ball(Vec3::new(side * 0.16, 0.0, 0.0), 0.14)).unwrap();
    }
    let plates =
        [-1.0, 1.0].map(|side| tool(&mut world, Vec3::new(side * 0.4, 0.0, 0.0), Vec3::new(0.05, 0.3, 0.3), 0.02, 0.3));
    let (mut last, mut jump, mut worst, mut fused) = (f64::NAN, 0.0_f64, 0.0_f64, None);
    for step in 0..180 {
        for (plate, side) in plates.into_iter().zip([-1.0, 1.0]) {
            drive(&mut world, plate, Vec3::new(if step < 60 { -0.12 * side } else { 0.0 }, 0.0, 0.0));
        }
        world.step(1.0 / 60.0).unwrap();
        let began = world.substance_changes(body).unwrap().iter().any(|change| matches!(change, Change::Fused(_)));
        if began && fused.is_none() {
            fused = Some(step);
        }
        let error = volume_errors(&world, body)[0];
        if fused.is_some() {
            jump = jump.max((error - last).abs());
        }
        (last, worst) = (error, worst.max(error.abs()));
    }
    let pieces = world.pieces(body).unwrap().len();
    println!("fuse at {fused:?}, {pieces} piece; volume off by {worst:.4} at most, {jump:.4} from a step to the next");
    assert!(jump < 0.03 && worst < 0.03);
    (fused, pieces)
}
