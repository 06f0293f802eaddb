mod common;
use common::*;
use isocoat::base::Kind;
use isocoat::math::*;
use isocoat::world::*;
#[test]
fn slab() {
    let gravity = Vec3::new(0.0, 0.0, -9.81);
    let modulus: f64 = 1e7;
    let mut world = World::new(WorldDesc { gravity, response: if std::env::var("SUB").is_ok() {Response::Substepped} else {Response::Implicit}, ..WorldDesc::default() }).unwrap();
    let body = BodyDesc { stiffness_scale: modulus / 2.0, ..BodyDesc::default() };
    Coat::floor(0.1).hard().add(&mut world, BodyDesc { rigid: true, ..body.clone() }, LinkDesc { pose: Pose::at(0.0, 0.0, -0.1), ..LinkDesc::default() });
    for (x, y) in [(-0.4, -0.4), (-0.4, 0.4), (0.4, -0.4), (0.4, 0.4)] {
        Coat::ball(0.1).add(&mut world, body.clone(), LinkDesc { kind: Kind::Rigid, mass: 0.1, inertia: ball_inertia(0.1, 0.1), pose: Pose::at(x, y, 0.1), ..LinkDesc::default() });
    }
    let half = Vec3::new(0.5, 0.5, 0.05);
    let coat = Coat::cuboid(half - Vec3::repeat(0.02), 0.02).hard();
    let slab = coat.add(&mut world, BodyDesc { rigid: true, ..body.clone() }, LinkDesc { kind: Kind::Rigid, mass: 1000.0, inertia: box_inertia(1000.0, half), pose: Pose::at(0.0, 0.0, 0.25), ..LinkDesc::default() }).1;
    for i in 0..12 {
        world.step(1.0 / 60.0).unwrap();
        let s = world.link_state(slab).unwrap();
        println!("{i} z {:.6} v {:.4} w {:.2e} {:?}", s.pose.position.z, s.twist.linear.z, s.twist.angular.norm(), world.counters());
        for c in world.contacts() { println!("   {:?} f {:.3e} n {:.2?} over {} {:?} pos {:.3?}", c.bodies.map(|b| b), c.force.norm(), c.normal.as_slice(), c.overloaded, c.scheme, c.position.as_slice()); }
        for e in world.events() { println!("   {:?}", e.kind); }
    }
}
