//! Substances: a step of 1/60 s of a lump that has come to lie, with volume control and contact, against the number of particles.
//!
//! `cargo bench --bench substance`; figures are milliseconds a step, the median of many, on one core.

use isocoat::World;
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::Vec3;
use isocoat::world::{BodyDesc, Fill, LinkDesc, SkeletonDesc, SubstanceDesc, WorldDesc};
use std::time::Instant;

fn main() {
    println!("{:>10} {:>10} {:>9} {:>9} {:>9}", "particles", "ms a step", "us each", "substeps", "contacts");
    for target in [100.0_f64, 1000.0, 10_000.0] {
        let spacing = 0.05;
        let particle_mass = 1000.0 * spacing * spacing * spacing / 2.0_f64.sqrt();
        let gravity = Vec3::new(0.0, 0.0, -9.81);
        let mut world = World::new(WorldDesc { gravity, ..WorldDesc::default() }).unwrap();
        let floor = world.create_body(BodyDesc { rigid: true, friction: 0.6, ..BodyDesc::default() }).unwrap();
        let link = world.create_link(floor, LinkDesc { kind: Kind::Fixed, ..LinkDesc::default() }).unwrap();
        let shape = Shape::Plane { point: Vec3::new(0.0, 0.0, -0.05), normal: Vec3::z() };
        world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.05, ..SkeletonDesc::default() }).unwrap();
        let body = world
            .create_body(BodyDesc { stiffness_scale: 2e4, friction: 0.6, dissipation: 2.0, ..BodyDesc::default() })
            .unwrap();
        // As the description says: cohesion, damping; the rest as it comes.
        let cohesion = 50.0 * particle_mass * 9.81 * spacing;
        world
            .make_substance(
                body,
                SubstanceDesc { spacing, particle_mass, cohesion, damping: 1.0, ..SubstanceDesc::default() },
            )
            .unwrap();
        let half = 0.5 * spacing * (target / 2.0_f64.sqrt()).cbrt() * 1.6;
        let low = Vec3::new(-half, -half, 0.0);
        let high = Vec3::new(half, half, 2.0 * half / 1.6_f64.powi(3));
        world.fill_substance(body, &Fill::Box { low, high: high + Vec3::repeat(spacing * 0.5) }).unwrap();
        let count = world.particles(body).unwrap().len();
        // The first second is the fall.
        let steps = if target > 5000.0 { 30 } else { 60 };
        (0..60).for_each(|_| world.step(1.0 / 60.0).unwrap());
        let mut times: Vec<f64> = (0..steps)
            .map(|_| {
                let start = Instant::now();
                world.step(1.0 / 60.0).unwrap();
                1e3 * start.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        let median = times[steps / 2];
        let contact: f64 = world.contacts().iter().map(|contact| contact.area).sum();
        println!(
            "{count:>10} {median:>10.2} {:>9.2} {:>9} {contact:>9.3}",
            1e3 * median / count as f64,
            world.counters().substeps
        );
    }
}
