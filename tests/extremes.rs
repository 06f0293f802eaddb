//! Stability at the extremes: one parameter of a scene at a time, far beyond what is usual, under each response.
//!
//! The short form is part of the tests; `make extremes` runs all rows and writes docs/extremes.md. A row passes when
//! all stays finite, nothing leaves its place, and no energy comes from nowhere: where an overload or a warning was
//! reported, up to a tenth may.

mod common;

use std::fmt::Write as _;
use std::time::Instant;

use common::{Coat, G, Random, ball_inertia, box_inertia};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Twist, Vec3};
use isocoat::world::{BodyDesc, EventKind, LinkDesc, LinkId, Response, World, WorldDesc};

/// What a row changes.
#[derive(Clone, Copy, Debug)]
struct Knobs {
    modulus: f64,
    mass_ratio: f64,
    dt: f64,
    stiffness_ratio: f64,
    length: f64,
    offset: f64,
    speed: f64,
    thickness_ratio: f64,
    gravity: f64,
    spin: f64,
    feet: usize,
}

const USUAL: Knobs = Knobs {
    modulus: 1e6,
    mass_ratio: 1.0,
    dt: 1.0 / 60.0,
    stiffness_ratio: 1.0,
    length: 1.0,
    offset: 0.0,
    speed: 0.0,
    thickness_ratio: 1.0,
    gravity: G,
    spin: 0.0,
    feet: 4,
};

/// A world, its moving links with their masses and inertia, and where they must stay: above the floor, within walls.
struct Scene {
    world: World,
    movers: Vec<(LinkId, f64, Mat3)>,
    origin: Vec3,
    wall: f64,
    size: f64,
}

impl Scene {
    fn new(knobs: &Knobs, response: Response, wall: f64, size: f64) -> Self {
        let gravity = Vec3::new(0.0, 0.0, -knobs.gravity);
        let desc = WorldDesc { gravity, response, force_tolerance: 5e-2, max_substeps: 1000, ..WorldDesc::default() };
        let world = World::new(desc).unwrap();
        let origin = Vec3::new(knobs.offset, -knobs.offset, knobs.offset);
        let mut scene = Scene { world, movers: Vec::new(), origin, wall, size };
        let normals = [Vec3::z(), Vec3::x(), -Vec3::x(), Vec3::y(), -Vec3::y()];
        for normal in normals.into_iter().take(if wall.is_finite() { 5 } else { 1 }) {
            let out = if normal == Vec3::z() { 0.0 } else { wall };
            let thickness = 0.1 * knobs.length;
            let point = origin - normal * (out + thickness);
            let coat = Coat::new(&[Shape::Plane { point, normal }], thickness).hard();
            coat.add(&mut scene.world, BodyDesc { friction: 0.5, ..coat.body_desc() }, LinkDesc::default());
        }
        scene
    }

    fn add(&mut self, coat: &Coat, body: BodyDesc, mass: f64, inertia: Mat3, at: Vec3, twist: Twist) {
        let position = self.origin + at;
        let pose = Pose { position, ..Pose::default() };
        let desc = LinkDesc { kind: Kind::Rigid, mass, inertia, pose, twist, ..LinkDesc::default() };
        let link = coat.add(&mut self.world, body, desc).1;
        self.movers.push((link, mass, inertia));
    }

    /// Kinetic energy and that of height; the elastic one comes from these.
    fn energy(&self, gravity: f64) -> f64 {
        let one = |(link, mass, inertia): &(LinkId, f64, Mat3)| {
            let state = self.world.link_state(*link).unwrap();
            let spin = state.pose.rotation.inverse() * state.twist.angular;
            let height = state.pose.position.z - self.origin.z;
            0.5 * mass * state.twist.linear.norm_squared() + 0.5 * spin.dot(&(inertia * spin)) + mass * gravity * height
        };
        self.movers.iter().map(one).sum()
    }
}

fn flesh(knobs: &Knobs, ratio: f64) -> BodyDesc {
    let stiffness_scale = 0.5 * knobs.modulus * knobs.length * ratio;
    BodyDesc { stiffness_scale, friction: 0.5, ..BodyDesc::default() }
}

/// Every other ball has the mass, stiffness and thickness that the ratios say.
fn balls(knobs: &Knobs, response: Response) -> Scene {
    let scale = knobs.length;
    let mut scene = Scene::new(knobs, response, 0.3 * scale, 0.1 * scale);
    let mut random = Random(7);
    for i in 0..10 {
        let odd = i % 2 == 1;
        let ratio = |value: f64| if odd { value } else { 1.0 };
        let radius = 0.1 * scale * ratio(knobs.thickness_ratio);
        let mass = scale.powi(3) * ratio(knobs.mass_ratio);
        let f = f64::from(i);
        let at = Vec3::new(0.05 * (f % 3.0) - 0.05, 0.06 * ((1.7 * f) % 2.0) - 0.06, 0.15 + 0.21 * f) * scale;
        let twist = Twist { linear: random.direction() * knobs.speed, angular: random.direction() * knobs.spin };
        let body = flesh(knobs, ratio(knobs.stiffness_ratio));
        scene.add(&Coat::ball(radius), body, mass, ball_inertia(mass, radius), at, twist);
    }
    scene
}

fn cube(knobs: &Knobs, response: Response) -> Scene {
    let scale = knobs.length;
    let mut scene = Scene::new(knobs, response, f64::INFINITY, 0.1 * scale);
    let half = 0.1 * scale;
    let thickness = 0.02 * scale * knobs.thickness_ratio;
    let coat = Coat::cuboid(Vec3::repeat(half - thickness), thickness);
    let (mass, half) = (scale.powi(3), Vec3::repeat(half));
    let twist = Twist { linear: Vec3::new(0.0, 0.0, -knobs.speed), angular: Vec3::new(0.0, 0.0, knobs.spin) };
    scene.add(&coat, flesh(knobs, 1.0), mass, box_inertia(mass, half), Vec3::new(0.0, 0.0, 0.1 * scale), twist);
    scene
}

fn slab(knobs: &Knobs, response: Response) -> Scene {
    let scale = knobs.length;
    let mut scene = Scene::new(knobs, response, f64::INFINITY, 0.1 * scale);
    let (radius, small) = (0.1 * scale, 0.1 * scale.powi(3));
    for (x, y) in [(-0.4, -0.4), (-0.4, 0.4), (0.4, -0.4), (0.4, 0.4)] {
        let at = Vec3::new(x, y, 0.1) * scale;
        scene.add(&Coat::ball(radius), flesh(knobs, 1.0), small, ball_inertia(small, radius), at, Twist::default());
    }
    let half = Vec3::new(0.5, 0.5, 0.05) * scale;
    let mass = small * 1e4 * knobs.mass_ratio;
    // Deformable: two rigid bodies, as the slab and the floor would be, are left to the host.
    let coat = Coat::cuboid(half - Vec3::repeat(0.02 * scale), 0.02 * scale);
    let body = flesh(knobs, 100.0);
    scene.add(&coat, body, mass, box_inertia(mass, half), Vec3::new(0.0, 0.0, 0.25) * scale, Twist::default());
    scene
}

fn pyramid(knobs: &Knobs, response: Response) -> Scene {
    let scale = knobs.length;
    let mut scene = Scene::new(knobs, response, f64::INFINITY, 0.1 * scale);
    let half = Vec3::repeat(0.1 * scale);
    let coat = Coat::cuboid(half - Vec3::repeat(0.02 * scale), 0.02 * scale);
    let mass = scale.powi(3);
    for level in 0..3 {
        for place in 0..3 - level {
            let x = (f64::from(place) - 0.5 * f64::from(2 - level)) * 0.24;
            let at = Vec3::new(x, 0.0, 0.1 + 0.2 * f64::from(level)) * scale;
            scene.add(&coat, flesh(knobs, 1.0), mass, box_inertia(mass, half), at, Twist::default());
        }
    }
    scene
}

/// A ball above a fixed one.
fn two_balls(knobs: &Knobs, response: Response) -> Scene {
    let scale = knobs.length;
    let mut scene = Scene::new(knobs, response, f64::INFINITY, 0.1 * scale);
    let fixed = Coat::ball(0.3 * scale).stiff(0.5 * knobs.modulus * scale);
    let at = scene.origin + Vec3::new(0.0, 0.0, 0.3 * scale);
    fixed.add_fixed(&mut scene.world, Pose { position: at, ..Pose::default() });
    let radius = 0.1 * scale * knobs.thickness_ratio;
    let mass = scale.powi(3) * knobs.mass_ratio;
    let twist = Twist { linear: Vec3::new(0.0, 0.0, -knobs.speed), angular: Vec3::new(knobs.spin, 0.0, 0.0) };
    let body = flesh(knobs, knobs.stiffness_ratio);
    let at = Vec3::new(0.0, 0.0, 1.0) * scale;
    scene.add(&Coat::ball(radius), body, mass, ball_inertia(mass, radius), at, twist);
    scene
}

/// A table of many feet in one body, none of which blend.
fn feet(knobs: &Knobs, response: Response) -> Scene {
    let scale = knobs.length;
    let mut scene = Scene::new(knobs, response, f64::INFINITY, 0.1 * scale);
    let side = (knobs.feet as f64).sqrt().ceil() as usize;
    let place = |i: usize| 0.25 * (i as f64 - 0.5 * (side as f64 - 1.0)) * scale;
    let shapes: Vec<Shape> =
        (0..knobs.feet).map(|i| Shape::Point(Vec3::new(place(i % side), place(i / side), 0.0))).collect();
    let half = Vec3::new(place(side).max(0.1 * scale), place(side).max(0.1 * scale), 0.1 * scale);
    let mass = scale.powi(3) * knobs.feet as f64;
    let coat = Coat { radius: 0.12 * scale, ..Coat::new(&shapes, 0.1 * scale) };
    scene.add(
        &coat,
        flesh(knobs, 1.0),
        mass,
        box_inertia(mass, half),
        Vec3::new(0.0, 0.0, 0.1) * scale,
        Twist::default(),
    );
    scene
}

type Build = fn(&Knobs, Response) -> Scene;

struct Outcome {
    finite: bool,
    gain: f64,
    deepest: f64,
    escaped: bool,
    overloads: usize,
    warned: bool,
    slowest: f64,
    step: f64,
}

impl Outcome {
    fn passes(&self, response: Response) -> bool {
        // The sub-steps keep energy to about a per cent a bounce, without trend.
        let most: f64 = if response == Response::Implicit { 1e-3 } else { 0.03 };
        let reported = self.overloads > 0 || self.warned;
        let most = if reported { most.max(0.1) } else { most };
        self.finite && self.gain <= most && !self.escaped
    }
}

fn run(build: Build, knobs: &Knobs, response: Response, seconds: f64) -> Outcome {
    let mut scene = build(knobs, response);
    let warned = std::sync::Arc::new(std::sync::atomic::AtomicBool::new(false));
    let flag = warned.clone();
    scene.world.set_log(Some(Box::new(move |_, _| flag.store(true, std::sync::atomic::Ordering::Relaxed))));
    let first = scene.energy(knobs.gravity);
    // Of a scene that does not move at all.
    let slight = 1e-9 * scene.movers.iter().map(|(_, mass, _)| mass * G * scene.size).sum::<f64>();
    let mut outcome = Outcome {
        finite: true,
        gain: 0.0,
        deepest: 0.0,
        escaped: false,
        overloads: 0,
        warned: false,
        slowest: 0.0,
        step: 0.0,
    };
    let steps = ((seconds / knobs.dt) as usize).min(600);
    let begin = Instant::now();
    for _ in 0..steps {
        scene.world.step(knobs.dt).unwrap();
        outcome.overloads += scene.world.events().iter().filter(|e| e.kind == EventKind::Overload).count();
        let energy = scene.energy(knobs.gravity);
        outcome.finite &= energy.is_finite();
        if !outcome.finite || begin.elapsed().as_secs_f64() > 5.0 {
            break;
        }
        outcome.gain = outcome.gain.max((energy - first) / (first.abs() + slight));
        for (link, _, _) in &scene.movers {
            let p = scene.world.link_state(*link).unwrap().pose.position - scene.origin;
            outcome.deepest = outcome.deepest.max(-p.z / scene.size);
            outcome.escaped |=
                p.z < -scene.size || p.x.abs() > scene.wall + scene.size || p.y.abs() > scene.wall + scene.size;
        }
    }
    outcome.step = begin.elapsed().as_secs_f64() / steps as f64;
    let speed = |link: &LinkId| scene.world.link_state(*link).unwrap().twist.linear.norm();
    outcome.slowest = scene.movers.iter().map(|(link, _, _)| speed(link)).fold(0.0, f64::max);
    outcome.warned = warned.load(std::sync::atomic::Ordering::Relaxed);
    outcome
}

type Set = fn(&mut Knobs, f64);

/// The sweeps: parameter, scenes, values; those of the short form come first.
#[expect(clippy::type_complexity, reason = "a table")]
fn sweeps() -> Vec<(&'static str, Set, Vec<(&'static str, Build)>, Vec<f64>, usize)> {
    let all: Vec<(&'static str, Build)> = vec![
        ("ten balls in a box", balls),
        ("cube on a floor", cube),
        ("a ton on four balls", slab),
        ("pyramid of six cubes", pyramid),
        ("two balls", two_balls),
    ];
    let pick = |names: &[&str]| -> Vec<(&'static str, Build)> {
        all.iter().filter(|(name, _)| names.iter().any(|wanted| name.contains(wanted))).copied().collect()
    };
    vec![
        ("contact modulus [Pa]", |k, x| k.modulus = x, all.clone(), vec![1e9, 1e4, 1e3, 1e5, 1e6, 1e7, 1e8], 2),
        (
            "mass ratio",
            |k, x| k.mass_ratio = x,
            pick(&["ten", "ton"]),
            vec![1e-3, 1e3, 1e-2, 0.1, 10.0, 1e2, 1e4, 1e6],
            2,
        ),
        ("dt [s]", |k, x| k.dt = x, all.clone(), vec![1.0 / 15.0, 1e-3, 1.0 / 30.0, 1.0 / 120.0, 1.0 / 240.0], 1),
        ("stiffness ratio", |k, x| k.stiffness_ratio = x, pick(&["ten", "two"]), vec![1e9, 1e6, 1e3, 10.0], 1),
        ("length scale", |k, x| (k.length, k.dt) = (x, k.dt * x.sqrt()), all.clone(), vec![1e-4, 1e4, 1e-2, 1e2], 2),
        ("distance from the origin [m]", |k, x| k.offset = x, all.clone(), vec![1e7, 1e5], 1),
        ("speed [m/s]", |k, x| k.speed = x, pick(&["ten", "cube on", "two"]), vec![300.0, 1.0, 10.0, 50.0, 100.0], 1),
        ("thickness ratio", |k, x| k.thickness_ratio = x, pick(&["ten", "cube on", "two"]), vec![1e-3, 1e-2, 0.1], 1),
        ("gravity [m/s^2]", |k, x| k.gravity = x, all.clone(), vec![0.0, 1e3], 2),
        ("spin [rad/s]", |k, x| k.spin = x, pick(&["ten", "cube on", "two"]), vec![1e3, 10.0, 100.0], 1),
        (
            "patches on a body",
            |k, x| k.feet = x as usize,
            vec![("a table of feet", feet as Build)],
            vec![64.0, 1.0, 4.0, 16.0],
            1,
        ),
    ]
}

fn table(short: bool) -> (String, Vec<String>) {
    let mut text = String::new();
    let mut failures = Vec::new();
    for (name, set, scenes, mut values, first) in sweeps() {
        if short {
            values.truncate(first);
        } else {
            values.sort_by(f64::total_cmp);
        }
        let _ = writeln!(text, "\n### {name}\n");
        let _ = writeln!(
            text,
            "| scene | value | response | finite | gain | overloads | escaped | m/s at the end | ms a step | |"
        );
        let _ = writeln!(text, "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |");
        for (scene, build) in scenes {
            for value in &values {
                for response in [Response::Implicit, Response::Auto, Response::Substepped] {
                    if short && response == Response::Substepped {
                        continue;
                    }
                    let mut knobs = USUAL;
                    set(&mut knobs, *value);
                    let seconds = if short { 1.0 } else { 5.0 } * knobs.length.sqrt();
                    let outcome = run(build, &knobs, response, seconds);
                    let verdict = if outcome.passes(response) { "" } else { "**fails**" };
                    let row = format!(
                        "| {scene} | {value:.0e} | {response:?} | {} | {:.1e} | {}{} | {} | {:.1e} | {:.2} | {verdict} |",
                        outcome.finite,
                        outcome.gain,
                        outcome.overloads,
                        if outcome.warned { ", warned" } else { "" },
                        outcome.escaped,
                        outcome.slowest,
                        1e3 * outcome.step,
                    );
                    println!("{row}");
                    if !verdict.is_empty() {
                        failures.push(format!("{name}: {row}"));
                    }
                    let _ = writeln!(text, "{row}");
                }
            }
        }
    }
    (text, failures)
}

#[test]
fn the_ends_of_the_sweeps_hold() {
    let (_, failures) = table(true);
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
#[ignore = "takes long: make extremes"]
fn all_rows() {
    let (text, failures) = table(false);
    let head = "# Extremes\n\nWritten by `make extremes`: one parameter at a time, 60 Hz, at most 600 steps and five seconds \
                of computing a row, unless the row says otherwise. `gain` is how far kinetic energy and that of height \
                ever rose above the first, as a part of it. A row passes when all is finite, nothing leaves its place, and \
                the gain is at most 0.1 % (implicit) or 3 % (others); at most 10 % where an overload or a warning was \
                reported.\n";
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/extremes.md");
    std::fs::write(path, format!("{head}\n{} rows fail.\n{text}", failures.len())).unwrap();
    println!("{} rows fail", failures.len());
}

#[test]
fn what_is_past_its_most_is_held_whatever_response_is_forced() {
    for response in [Response::Substepped, Response::Auto, Response::Implicit] {
        let knobs = Knobs { mass_ratio: 1e6, ..USUAL };
        let outcome = run(slab, &knobs, response, 3.0);
        println!(
            "{response:?}: {} overloads, deepest {:.3} of a ball, gain {:.1e}, {:.2} ms a step",
            outcome.overloads,
            outcome.deepest,
            outcome.gain,
            1e3 * outcome.step
        );
        assert!(outcome.finite && outcome.overloads > 0 && !outcome.escaped && outcome.gain <= 1e-3);
    }
}
