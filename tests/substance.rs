//! Soft substances: particles, their coat, separation, collision, fusion.

use isocoat::World;
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::world::{BodyDesc, BodyId, Change, Fill, LinkDesc, ParticleId, SkeletonDesc, SubstanceDesc, WorldDesc};

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
    SubstanceDesc { spacing, particle_mass, cohesion: 200.0 * particle_mass * G * spacing, ..SubstanceDesc::default() }
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

fn pose(z: f64) -> Pose {
    Pose::at(0.0, 0.0, z)
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
    let speed = world.particles(body).unwrap().iter().map(|p| p.velocity.norm()).fold(0.0, f64::max);
    assert!(speed < 1e-2, "{speed}");
}
