//! Articulations: links that joints of the host hold together answer pushes as one, however many of them touch.

mod common;

use common::{Coat, DT, G, ball_inertia, box_inertia};
use isocoat::base::Kind;
use isocoat::error::Error;
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Quat, Twist, Vec3, Wrench, advance_rotation, rotate_tensor};
use isocoat::world::{Articulation, BodyDesc, LinkDesc, LinkId, LinkState, Response, World, WorldDesc};
use nalgebra::{DMatrix, Matrix6};

const RADIUS: f64 = 0.1;
const MASS: f64 = 4.0;
/// Mass of what carries each ball, as far as the library knows.
const PART: f64 = 0.05;

/// A solid that its host moves, on four balls that are one link, or a link each.
struct Table {
    world: World,
    links: Vec<LinkId>,
    /// Where the links are in the solid.
    places: Vec<Vec3>,
    state: LinkState,
    inertia: Mat3,
}

/// How the library is told about the balls.
#[derive(Clone, Copy, PartialEq)]
enum Parts {
    One,
    Articulated,
    Constrained,
}

impl Table {
    fn new(parts: Parts) -> Self {
        let desc = WorldDesc { gravity: Vec3::new(0.0, 0.0, -G), response: Response::Implicit, ..WorldDesc::default() };
        let mut world = World::new(desc).unwrap();
        let material = |coat: &Coat| BodyDesc { stiffness_scale: 1e6, friction: 0.4, ..coat.body_desc() };
        let floor = Coat::floor(0.1);
        floor.add(&mut world, material(&floor), LinkDesc { pose: Pose::at(0.0, 0.0, -0.1), ..LinkDesc::default() });
        let corners = [(0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)].map(|(x, y)| Vec3::new(x, y, 0.0));
        let host = |mass, inertia| LinkDesc { kind: Kind::Host, mass, inertia, ..LinkDesc::default() };
        let inertia = box_inertia(MASS, Vec3::new(0.4, 0.3, 0.1));
        let (links, places) = if parts == Parts::One {
            let coat = Coat::new(&corners.map(Shape::Point), RADIUS);
            (vec![coat.add(&mut world, material(&coat), host(MASS, inertia)).1], vec![Vec3::zeros()])
        } else {
            let ball = Coat::ball(RADIUS);
            let part = LinkDesc { constrained: true, ..host(PART, ball_inertia(PART, RADIUS)) };
            let links = corners.iter().map(|_| ball.add(&mut world, material(&ball), part.clone()).1).collect();
            (links, corners.to_vec())
        };
        let state = LinkState {
            pose: Pose { position: Vec3::new(0.0, 0.0, 0.3), rotation: Quat::from_euler_angles(0.15, 0.1, 0.0) },
            twist: Twist { linear: Vec3::new(0.5, 0.0, 0.0), angular: Vec3::zeros() },
        };
        Table { world, links, places, state, inertia }
    }

    fn arms(&self) -> Vec<Vec3> {
        self.places.iter().map(|place| self.state.pose.rotation * place).collect()
    }

    fn inverse_inertia(&self) -> Mat3 {
        rotate_tensor(&self.state.pose.rotation, &self.inertia.try_inverse().unwrap())
    }

    /// `J H⁻¹ Jᵀ` of the four balls, and a little of their own.
    fn matrix(&self) -> Vec<f64> {
        let arms = self.arms();
        let mut inverse = Matrix6::zeros();
        inverse.fixed_view_mut::<3, 3>(0, 0).copy_from(&(Mat3::identity() / MASS));
        inverse.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.inverse_inertia());
        let jacobian = |arm: &Vec3| {
            let mut jacobian = Matrix6::identity();
            jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-arm.cross_matrix());
            jacobian
        };
        let size = 6 * arms.len();
        let mut all = DMatrix::from_diagonal_element(size, size, 1e-6 / PART);
        for (i, a) in arms.iter().enumerate() {
            for (j, b) in arms.iter().enumerate() {
                let mut block = all.fixed_view_mut::<6, 6>(6 * i, 6 * j);
                block += jacobian(a) * inverse * jacobian(b).transpose();
            }
        }
        all.as_slice().to_vec()
    }

    fn tell(&mut self, articulated: bool) {
        let arms = self.arms();
        let Twist { linear, angular } = self.state.twist;
        for (link, arm) in self.links.iter().zip(&arms) {
            let pose = Pose { position: self.state.pose.position + arm, rotation: self.state.pose.rotation };
            let twist = Twist { linear: linear + angular.cross(arm), angular };
            self.world.set_link_state(*link, &LinkState { pose, twist }).unwrap();
        }
        if articulated {
            let articulation = Articulation { links: &self.links, inverse_inertia: &self.matrix() };
            self.world.set_articulations(&[articulation]).unwrap();
        }
    }

    fn tick(&mut self, articulated: bool) {
        self.tell(articulated);
        self.world.step(DT).unwrap();
        let mut impulse = Wrench::default();
        for (link, arm) in self.links.iter().zip(self.arms()) {
            let own = self.world.link_impulse(*link).unwrap();
            impulse.force += own.force;
            impulse.torque += own.torque + arm.cross(&own.force);
        }
        let inverse_inertia = self.inverse_inertia();
        let LinkState { pose, twist } = &mut self.state;
        twist.linear += impulse.force / MASS + Vec3::new(0.0, 0.0, -G * DT);
        twist.angular += inverse_inertia * impulse.torque;
        pose.position += twist.linear * DT;
        pose.rotation = advance_rotation(&pose.rotation, &twist.angular, DT);
    }

    /// The way of the solid over two seconds, in radii from the other's at most, and at the end.
    fn apart(parts: Parts) -> (f64, f64) {
        let (mut whole, mut other) = (Table::new(Parts::One), Table::new(parts));
        let (mut most, mut last) = (0.0f64, 0.0);
        for _ in 0..120 {
            whole.tick(false);
            other.tick(parts == Parts::Articulated);
            last = (whole.state.pose.position - other.state.pose.position).norm() / RADIUS;
            most = most.max(last);
        }
        (most, last)
    }
}

/// It lands on one corner, rocks from one to the other, slides and comes to rest on all four, as one solid does. Without
/// the articulation each ball, of a twentieth of the mass that it carries, learns what holds it as it goes.
#[test]
fn links_of_one_solid_do_what_the_solid_does() {
    let ((most, last), (estimated, _)) = (Table::apart(Parts::Articulated), Table::apart(Parts::Constrained));
    println!(
        "a solid on four links: {most:.1e} radii from the way of one link, {last:.1e} at the end; by estimate {estimated:.1e}"
    );
    assert!(most < 0.02 && last < 0.02, "{most} {last}");
    assert!(estimated > 10.0 * most, "the articulation is worth nothing: {estimated} {most}");
}

#[test]
fn what_makes_no_sense_is_refused_and_changes_nothing() {
    let mut table = Table::new(Parts::Articulated);
    for _ in 0..40 {
        table.tick(true);
    }
    let before = {
        let mut bytes = Vec::new();
        table.world.snapshot(&mut bytes);
        bytes
    };
    let (links, good) = (table.links.clone(), table.matrix());
    let fixed = table.world.bodies().next().unwrap();
    let fixed = table.world.body_links(fixed).unwrap().next().unwrap();
    let with = |at: usize, value: f64| {
        let mut matrix = good.clone();
        matrix[at] = value;
        matrix
    };
    let mut refused = |links: &[LinkId], inverse_inertia: &[f64], part: &str| {
        let error = table.world.set_articulations(&[Articulation { links, inverse_inertia }]).unwrap_err();
        assert!(error.to_string().contains(part), "{error}");
    };
    refused(&[], &[], "from 1 to 256");
    refused(&links, &good[1..], "575 numbers; must be (6n)²");
    refused(&links, &with(0, f64::NAN), "finite, symmetric and positive definite");
    refused(&links, &with(1, 5.0), "and 5 across the diagonal");
    refused(&links, &with(25, -1.0), "positive definite");
    refused(&[links[0], links[0], links[2], links[3]], &good, "named once");
    refused(&[links[0], fixed, links[2], links[3]], &good, "host-driven");
    let twice = [Articulation { links: &links, inverse_inertia: &good }; 2];
    assert!(matches!(table.world.set_articulations(&twice), Err(Error::Unsupported(_))));
    let mut after = Vec::new();
    table.world.snapshot(&mut after);
    assert!(before == after);
}

/// The links go on by themselves when one of them is destroyed, changes its kind, or nobody says anything any more.
#[test]
fn an_articulation_ends() {
    for end in 0..3 {
        let mut table = Table::new(Parts::Articulated);
        for _ in 0..40 {
            table.tick(true);
        }
        match end {
            0 => {
                table.world.destroy_link(table.links[3]).unwrap();
                table.links.pop();
                table.places.pop();
            }
            1 => {
                let desc = table.world.link_desc(table.links[3]).unwrap().clone();
                table.world.set_link_desc(table.links[3], LinkDesc { kind: Kind::Rigid, ..desc }).unwrap();
                table.links.pop();
                table.places.pop();
            }
            _ => table.world.set_articulations(&[]).unwrap(),
        }
        let (mut one, mut other) = (Vec::new(), Vec::new());
        table.world.snapshot(&mut one);
        table.world.set_articulations(&[]).unwrap();
        table.world.snapshot(&mut other);
        assert!(one == other, "end {end}");
        for _ in 0..10 {
            table.tick(false);
        }
    }
}

/// What is said holds in the world that takes the snapshot up.
#[test]
fn a_snapshot_keeps_articulations() {
    let mut table = Table::new(Parts::Articulated);
    for _ in 0..30 {
        table.tick(true);
    }
    table.tell(true);
    let mut bytes = Vec::new();
    table.world.snapshot(&mut bytes);
    let mut other = World::new(WorldDesc::default()).unwrap();
    other.restore(&bytes).unwrap();
    let impulses = |world: &mut World| -> Vec<Wrench> {
        world.step(DT).unwrap();
        let bodies: Vec<_> = world.bodies().collect();
        let links = bodies.iter().flat_map(|body| world.body_links(*body).unwrap().collect::<Vec<_>>());
        links.filter_map(|link| world.link_impulse(link).ok()).collect()
    };
    let expected = impulses(&mut table.world);
    assert!(expected.iter().any(|wrench| *wrench != Wrench::default()));
    assert!(impulses(&mut other) == expected);
}
