//! A world made ready for many rays: what is inside, how hard a contact presses, what a body hides.

mod common;

use common::{Coat, Random};
use isocoat::math::{Pose, Vec3};
use isocoat::world::query::RayHit;
use isocoat::world::rays::{Ray, RayGoal};
use isocoat::world::sight::Sight;
use isocoat::world::{BodyId, Deformation, Scheme, World, WorldDesc};

fn two_balls() -> World {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let ball = Coat::ball(0.1);
    ball.add_fixed(&mut world, Pose::at(-0.08, 0.0, 0.0));
    ball.add_fixed(&mut world, Pose::at(0.08, 0.0, 0.0));
    world
}

fn first(sight: &mut Sight, origin: &Vec3, direction: &Vec3, max_distance: f64) -> Option<RayHit> {
    sight.cast_ray(&Ray { origin: *origin, direction: *direction, max_distance }, RayGoal::Closest).unwrap()
}

#[test]
fn pressure_along_a_contact_is_what_the_contact_says() {
    let world = two_balls();
    let bodies: Vec<_> = world.bodies().collect();
    let contact = world.collide(bodies[0], bodies[1], Scheme::Auto, 1e-6).unwrap().remove(0);
    let sight = world.sight(u64::MAX, Deformation::Contact);
    // The flat face of the first ball, seen from where the second was.
    let mut face = sight.without(bodies[1]);
    let hit = first(&mut face, &Vec3::new(1.0, 0.0, 0.0), &-Vec3::x(), 2.0).unwrap();
    assert!((hit.position - Vec3::zeros()).norm() < 1e-9 && (hit.normal - Vec3::x()).norm() < 1e-6);
    assert!((face.pressure(&hit) / contact.peak_pressure - 1.0).abs() < 1e-6);
    // Away from it there is none, but for rounding.
    let hit = first(&mut face, &Vec3::new(-1.0, 0.0, 0.0), &Vec3::x(), 2.0).unwrap();
    assert!(face.pressure(&hit) < 1e-9 * contact.peak_pressure);
    // The sum over the disc is the force: rays in rings of equal area.
    let radius = (0.1_f64.powi(2) - 0.08_f64.powi(2)).sqrt();
    let count = 4000;
    let ring = |k: i32| {
        let (r, turn) = (radius * ((f64::from(k) + 0.5) / f64::from(count)).sqrt(), 2.4 * f64::from(k));
        let from = Vec3::new(1.0, r * turn.cos(), r * turn.sin());
        let hit = first(&mut face, &from, &-Vec3::x(), 2.0).unwrap();
        face.pressure(&hit)
    };
    let force = (0..count).map(ring).sum::<f64>() / f64::from(count) * std::f64::consts::PI * radius * radius;
    assert!((force / contact.force.norm() - 1.0).abs() < 1e-3, "{force} {}", contact.force.norm());
}

#[test]
fn a_point_is_inside_where_the_field_says_so() {
    let world = two_balls();
    let bodies: Vec<_> = world.bodies().collect();
    let mut random = Random(5);
    for deformation in [Deformation::None, Deformation::Contact] {
        let sight = world.sight(u64::MAX, deformation);
        for _ in 0..500 {
            let p = Vec3::from_fn(|_, _| random.range(-0.2, 0.2));
            let inside = sight.inside(&p).unwrap();
            let holds = |body: &BodyId| {
                let mut value = [0.0];
                world.evaluate_field_deformed(*body, &[p.into()], Some(&mut value), None, deformation).unwrap();
                value[0] >= world.body_desc(*body).unwrap().isovalue
            };
            assert_eq!(inside.map(|inside| inside.body), bodies.iter().copied().find(holds), "{p}");
            // A ray from there, of any length, hits at once.
            let hit = world.cast_ray_deformed(&p, &Vec3::y(), 0.0, u64::MAX, deformation).unwrap();
            assert_eq!(inside.map(|inside| inside.body), hit.map(|hit| hit.body), "{p}");
            if let Some(inside) = inside.filter(|_| deformation == Deformation::None) {
                // Of a linear profile the field is the depth.
                let center = world.link_state(world.body_links(inside.body).unwrap().next().unwrap()).unwrap();
                let depth = 0.1 - (p - center.pose.position).norm();
                assert!((inside.depth - depth).abs() < 1e-9 || depth > 0.09, "{} {depth}", inside.depth);
                let scale = world.body_stiffness(inside.body).unwrap().0;
                assert!((inside.pressure / (scale * 20.0 * depth) - 1.0).abs() < 1e-9 || depth > 0.09);
            }
        }
        assert!(sight.inside(&Vec3::repeat(f64::NAN)).is_err());
        let mut none = sight.without(bodies[0]).without(bodies[1]);
        assert!(first(&mut none, &Vec3::x(), &-Vec3::x(), 9.0).is_none());
    }
}
