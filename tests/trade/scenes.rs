//! The five scenes, and what each is compared with.

use isocoat::field::Shape;
use isocoat::math::{Pose, Twist, Vec3, rotation_from_vector};
use isocoat::world::{BodyDesc, LinkState, Response, Scheme};

use super::common::{Coat, G, Random, ball_inertia, box_inertia};
use super::sim::{FRAME, MASS, RADIUS, Record, Scene, Settings, Sim};

/// `K k t`, the pressure at the middle of a ball: with the default profile `k t = 2`.
fn flesh(modulus: f64) -> BodyDesc {
    BodyDesc { stiffness_scale: 0.5 * modulus, ..BodyDesc::default() }
}

fn at(position: Vec3, linear: Vec3, angular: Vec3) -> LinkState {
    LinkState { pose: Pose { position, ..Pose::default() }, twist: Twist { linear, angular } }
}

/// A ball falls on a fixed one and bounces.
fn two_balls(settings: &Settings, _: &[LinkState]) -> Sim {
    let mut sim = Sim::new(settings, G);
    sim.fix(&Coat::ball(0.3), flesh(1e6), Pose::at(0.0, 0.0, -0.3));
    let start = at(Vec3::new(0.0, 0.0, RADIUS + 0.2), Vec3::zeros(), Vec3::new(3.0, 0.0, 0.0));
    sim.add(&Coat::ball(RADIUS), flesh(1e6), ball_inertia(MASS, RADIUS), start);
    sim
}

const BALLS: usize = 10;
const BALL_MODULUS: f64 = 1e6;

/// Ten balls in a box, shaken where they lie.
fn ten_in_a_box(settings: &Settings, start: &[LinkState]) -> Sim {
    let mut sim = Sim::new(settings, G);
    let body = BodyDesc { dissipation: 5.0, ..flesh(BALL_MODULUS) };
    sim.wall(Vec3::zeros(), Vec3::z(), &body);
    for normal in [Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y()] {
        sim.wall(normal * -0.25, normal, &body);
    }
    for state in start {
        sim.add(&Coat::ball(RADIUS), body.clone(), ball_inertia(MASS, RADIUS), *state);
    }
    sim
}

/// Two dumbbells, each two balls blended, tumble into each other, free of gravity, and part.
fn dumbbells(settings: &Settings, _: &[LinkState]) -> Sim {
    let mut sim = Sim::new(settings, 0.0);
    let coat = Coat::new(&[Shape::Point(Vec3::new(-0.12, 0.0, 0.0)), Shape::Point(Vec3::new(0.12, 0.0, 0.0))], RADIUS);
    let inertia = box_inertia(MASS, Vec3::new(0.22, 0.1, 0.1));
    for side in [-1.0, 1.0] {
        let position = Vec3::new(0.03 * side, 0.02, 0.3 * side);
        let turn = rotation_from_vector(&Vec3::new(0.2, 0.4 * side, 0.5 + 0.7 * side));
        let twist = Twist { linear: Vec3::new(0.0, 0.0, -side), angular: Vec3::new(1.5, 2.0 * side, 1.0) };
        sim.add(&coat, flesh(1e6), inertia, LinkState { pose: Pose { position, rotation: turn }, twist });
    }
    sim
}

const CUBE_HALF: f64 = 0.1;
const CUBE_COAT: f64 = 0.02;

/// A cube falls on a hard floor, a little tilted.
fn cube(settings: &Settings, _: &[LinkState]) -> Sim {
    let mut sim = Sim::new(settings, G);
    let body = BodyDesc { dissipation: 10.0, friction: 0.5, ..flesh(1e5) };
    sim.wall(Vec3::zeros(), Vec3::z(), &body);
    let pose = Pose {
        position: Vec3::new(0.0, 0.0, CUBE_HALF + 0.01),
        rotation: rotation_from_vector(&Vec3::new(0.04, 0.03, 0.0)),
    };
    let coat = Coat::cuboid(Vec3::repeat(CUBE_HALF - CUBE_COAT), CUBE_COAT);
    let state = LinkState { pose, twist: Twist::default() };
    sim.add(&coat, body, box_inertia(MASS, Vec3::repeat(CUBE_HALF)), state);
    sim
}

/// A ball slides on a hard floor until it rolls.
fn rolling_ball(settings: &Settings, _: &[LinkState]) -> Sim {
    let mut sim = Sim::new(settings, G);
    let body = BodyDesc { friction: ROLLING_FRICTION, ..flesh(1e6) };
    sim.wall(Vec3::zeros(), Vec3::z(), &body);
    let height = RADIUS - ball_sink(1e6);
    let start = at(Vec3::new(0.0, 0.0, height), Vec3::new(1.0, 0.0, 0.0), Vec3::zeros());
    sim.add(&Coat::ball(RADIUS), body, ball_inertia(MASS, RADIUS), start);
    sim
}

const ROLLING_FRICTION: f64 = 0.3;

/// The root of a growing function between two places.
fn root(f: impl Fn(f64) -> f64, mut low: f64, mut high: f64) -> f64 {
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        *(if f(middle) < 0.0 { &mut low } else { &mut high }) = middle;
    }
    0.5 * (low + high)
}

/// How far a ball of this modulus sinks on a hard floor: `π E δ² (1 - 2δ/3t) = m g`.
fn ball_sink(modulus: f64) -> f64 {
    let force = |s: f64| std::f64::consts::PI * modulus * s * s * (1.0 - 2.0 * s / (3.0 * RADIUS));
    root(|s| force(s) - MASS * G, 0.0, 0.5 * RADIUS)
}

/// The height at which the cube lies flat, by its force at heights.
fn cube_rest() -> f64 {
    let sim = std::cell::RefCell::new(cube(&Settings::default(), &[]));
    let lack = |height: f64| {
        let mut sim = sim.borrow_mut();
        sim.place(&[at(Vec3::new(0.0, 0.0, height), Vec3::zeros(), Vec3::zeros())]);
        MASS * G - sim.wrench([0, 1], Scheme::Auto, 1e-8).0.z
    };
    root(lack, CUBE_HALF - 0.5 * CUBE_COAT, CUBE_HALF)
}

/// The path of the rolling ball in closed form: friction slows it and spins it up until it rolls, then nothing does.
fn rolling_path(seconds: f64) -> Record {
    let height = RADIUS - ball_sink(1e6);
    let inertia = 0.4 * RADIUS * RADIUS;
    let slowing = ROLLING_FRICTION * G;
    let spin_up = slowing * height / inertia;
    let rolls = 1.0 / (slowing + spin_up * height);
    let state = |frame: usize| {
        let t = FRAME * frame as f64;
        let (slid, rolled) = (t.min(rolls), (t - rolls).max(0.0));
        let (speed, spin) = (1.0 - slowing * slid, spin_up * slid);
        let x = slid - 0.5 * slowing * slid * slid + speed * rolled;
        let turned = Vec3::new(0.0, 0.5 * spin_up * slid * slid + spin * rolled, 0.0);
        let mut state = at(Vec3::new(x, 0.0, height), Vec3::new(speed, 0.0, 0.0), Vec3::new(0.0, spin, 0.0));
        state.pose.rotation = rotation_from_vector(&turned);
        vec![state]
    };
    Record { frames: (0..=(seconds / FRAME).round() as usize).map(state).collect(), time: 0.0 }
}

/// Where ten balls dropped into the box come to rest.
fn settled() -> Vec<LinkState> {
    let place = |i: usize| {
        let f = i as f64;
        Vec3::new(0.13 * ((f % 2.0) - 0.5), 0.12 * (((0.5 * f).floor() % 2.0) - 0.5), 0.12 + 0.1 * f)
            + Vec3::new(0.01 * (1.7 * f).sin(), 0.01 * (2.3 * f).cos(), 0.0)
    };
    let start: Vec<_> = (0..BALLS).map(|i| at(place(i), Vec3::zeros(), Vec3::zeros())).collect();
    let settings = Settings { response: Response::Implicit, round_tolerance: 1e-6, rounds: 32, ..Settings::default() };
    let mut sim = ten_in_a_box(&settings, &start);
    for _ in 0..3600 {
        sim.step(FRAME).unwrap();
    }
    sim.states()
}

/// The scene of the two balls.
pub fn bouncing() -> Scene {
    Scene {
        name: "two balls",
        key: "two-balls",
        build: two_balls,
        start: Vec::new(),
        seconds: 1.2,
        horizon: 1.2,
        reference: (4096, 1e-6),
        energy: MASS * G * 0.2,
        rest: None,
    }
}

/// The five scenes.
pub fn all() -> Vec<Scene> {
    let kick = 0.3;
    let rest = settled();
    let mut random = Random(3);
    let shaken = rest.iter().map(|state| at(state.pose.position, random.direction() * kick, Vec3::zeros())).collect();
    let height = |state: &LinkState| state.pose.position.z;
    let cube_at = cube_rest();
    let sink = ball_sink(BALL_MODULUS);
    vec![
        bouncing(),
        Scene {
            name: "ten balls in a box",
            key: "ten-in-a-box",
            build: ten_in_a_box,
            start: shaken,
            seconds: 2.0,
            horizon: 0.5,
            reference: (512, 1e-6),
            energy: 0.5 * MASS * kick * kick * BALLS as f64,
            rest: Some((rest.iter().map(height).collect(), sink)),
        },
        Scene {
            name: "dumbbells tumbling",
            key: "dumbbells",
            build: dumbbells,
            start: Vec::new(),
            seconds: 0.6,
            horizon: 0.6,
            reference: (512, 1e-5),
            energy: MASS,
            rest: None,
        },
        Scene {
            name: "cube on a floor",
            key: "cube",
            build: cube,
            start: Vec::new(),
            seconds: 1.5,
            horizon: 0.5,
            reference: (2048, 1e-6),
            energy: MASS * G * 0.02,
            rest: Some((vec![cube_at], CUBE_HALF - cube_at)),
        },
        Scene {
            name: "a rolling ball",
            key: "rolling-ball",
            build: rolling_ball,
            start: Vec::new(),
            seconds: 2.0,
            horizon: 2.0,
            reference: (1, 1e-6),
            energy: 0.5 * MASS,
            rest: Some((vec![RADIUS - sink], sink)),
        },
    ]
}

/// Energy of a ball pressed into a hard floor, over that of the same ball touching it, less the height it lost.
#[test]
fn the_energy_of_a_pressed_ball_is_the_integral_of_its_force() {
    let mut sim = rolling_ball(&Settings { scheme: Scheme::Polar, ..Settings::default() }, &[]);
    let mut energy = |depth: f64| {
        sim.place(&[at(Vec3::new(0.0, 0.0, RADIUS - depth), Vec3::zeros(), Vec3::zeros())]);
        sim.energy() + MASS * G * depth
    };
    let apart = energy(0.0);
    for depth in [0.001f64, 0.01, 0.03] {
        // ∫ π E δ² (1 - 2δ/3R) dδ
        let exact = std::f64::consts::PI * 1e6 * (depth.powi(3) / 3.0 - depth.powi(4) / (6.0 * RADIUS));
        let got = energy(depth) - apart;
        assert!((got / exact - 1.0).abs() < 1e-4, "{depth} m: {got} J, exactly {exact} J");
    }
}

impl Scene {
    /// Settings whose errors of time and of integration are far below what is measured.
    fn converged(&self, coarser: u32) -> Settings {
        // The world's own steps are as short as the sub-steps are to be: the phase could not ask for so many.
        let (steps, tolerance) = self.reference;
        Settings {
            tolerance,
            response: Response::Substepped,
            phase: 1.0,
            steps: steps / coarser,
            ..Settings::default()
        }
    }

    /// What runs are compared with, and how far it is from one of twice the sub-steps' length.
    pub fn reference(&self) -> (Record, f64) {
        if self.key == "rolling-ball" {
            return (rolling_path(self.seconds), 0.0);
        }
        let fine = self.run(&self.converged(1), f64::INFINITY).unwrap();
        let coarse = self.run(&self.converged(2), f64::INFINITY).unwrap();
        let energies = self.energies(&fine);
        let apart = self.errors(&coarse, &fine, &energies).path;
        (fine, apart)
    }
}
