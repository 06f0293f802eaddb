//! The appendix of \[97\] with the lengths and stiffness that make it work.

use isocoat::base::Kind;
use isocoat::math::{Pose, Vec3};
use isocoat::world::{BodyDesc, LinkDesc, LinkId, Response, SkeletonDesc, World, WorldDesc};

fn add_ball(world: &mut World, kind: Kind, mass: f64, height: f64, thickness: f64, radius: f64) -> LinkId {
    let body = world.create_body(BodyDesc { stiffness_scale: 1.78e6, ..BodyDesc::default() }).unwrap();
    let link = LinkDesc { kind, mass, pose: Pose::at(0.0, 0.0, height), ..LinkDesc::default() };
    let link = world.create_link(body, link).unwrap();
    let skeleton = SkeletonDesc { thickness, stiffness: 1.0, radius, ..SkeletonDesc::default() };
    world.create_skeleton(link, skeleton).unwrap();
    link
}

#[test]
fn a_ball_keeps_returning_to_the_height_it_was_dropped_from() {
    let gravity = Vec3::new(0.0, 0.0, -9.8);
    let mut world = World::new(WorldDesc { gravity, response: Response::Substepped, ..WorldDesc::default() }).unwrap();
    add_ball(&mut world, Kind::Fixed, 0.0, 0.0, 0.3, 1.0);
    let ball = add_ball(&mut world, Kind::PointMass, 2.96, 1.0, 0.1, 0.4);
    let (mut before, mut worst, mut bounces, mut peak) = (0.0, 0.0f64, 0, 0.0f64);
    for _ in 0..600 {
        world.step(1.0 / 60.0).unwrap();
        let state = world.link_state(ball).unwrap();
        peak = peak.max(world.link_wrench(ball).unwrap().force.z);
        let speed = state.twist.linear.z;
        if before > 0.0 && speed <= 0.0 {
            let apex = state.pose.position.z + speed * speed / (2.0 * 9.8);
            worst = worst.max((apex - 1.0).abs());
            bounces += 1;
            println!("apex {apex}");
        }
        before = speed;
    }
    println!("{bounces} bounces, worst {worst}, peak {peak} substeps {}", world.counters().substeps);
    assert!(bounces >= 12 && worst < 0.01 && peak > 680.0 && peak < 750.0);
}
