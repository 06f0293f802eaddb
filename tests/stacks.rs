//! What is stacked stands for as long as it should, and no longer: a pyramid of a hundred boxes, columns on either side
//! of their buckling load, a stiff cube that lies flat.

mod common;

use std::time::Instant;

use common::{Coat, DT, G, box_inertia};
use isocoat::base::Kind;
use isocoat::math::{Pose, Quat, Vec3};
use isocoat::world::{BodyDesc, LinkDesc, LinkId, Response, World, WorldDesc};
use nalgebra::DMatrix;

const HALF: f64 = 0.1;

fn world(response: Response, sleep_time: f64) -> World {
    let gravity = Vec3::new(0.0, 0.0, -G);
    World::new(WorldDesc { gravity, response, sleep_time, ..WorldDesc::default() }).unwrap()
}

/// What does not slip.
fn rough(coat: &Coat) -> BodyDesc {
    BodyDesc { friction: 0.5, static_friction: 0.6, ..coat.body_desc() }
}

fn add_floor(world: &mut World) {
    let floor = Coat::floor(0.1).hard();
    let pose = Pose::at(0.0, 0.0, -0.1);
    floor.add(world, rough(&floor), LinkDesc { pose, ..LinkDesc::default() });
}

fn add_cube(world: &mut World, coat: &Coat, pose: Pose) -> LinkId {
    let inertia = box_inertia(1.0, Vec3::repeat(HALF));
    coat.add(world, rough(coat), LinkDesc { kind: Kind::Rigid, mass: 1.0, inertia, pose, ..LinkDesc::default() }).1
}

fn cube(thickness: f64, stiffness_scale: f64) -> Coat {
    Coat::cuboid(Vec3::repeat(HALF - thickness), thickness).stiff(stiffness_scale)
}

/// A hundred cubes in eight rows, of sixteen below and nine on top, each on two others. In the order of the rows.
fn pyramid(sleep_time: f64) -> (World, Vec<LinkId>) {
    let mut world = world(Response::Auto, sleep_time);
    add_floor(&mut world);
    let coat = cube(0.02, 1e5);
    let mut cubes = Vec::new();
    for row in 0..8 {
        for column in 0..16 - row {
            let x = (f64::from(column) + 0.5 * f64::from(row)) * 2.1 * HALF;
            cubes.push(add_cube(&mut world, &coat, Pose::at(x, 0.0, HALF * (1.0 + 2.0 * f64::from(row)))));
        }
    }
    assert_eq!(cubes.len(), 100);
    (world, cubes)
}

fn positions(world: &World, links: &[LinkId]) -> Vec<Vec3> {
    links.iter().map(|link| world.link_state(*link).unwrap().pose.position).collect()
}

/// How far any has moved \[m\].
fn farthest(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
}

fn fastest(world: &World, links: &[LinkId]) -> f64 {
    links.iter().map(|link| world.link_state(*link).unwrap().twist.linear.norm()).fold(0.0, f64::max)
}

fn median(times: &mut [f64]) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Steps for some seconds. Gives how long each step took \[s\].
fn run(world: &mut World, seconds: f64) -> Vec<f64> {
    let time = |_| {
        let start = Instant::now();
        world.step(DT).unwrap();
        start.elapsed().as_secs_f64()
    };
    (0..(seconds / DT).round() as usize).map(time).collect()
}

#[test]
fn a_pyramid_of_100_boxes_falls_asleep_and_then_costs_less_than_a_hundredth() {
    let (mut world, cubes) = pyramid(0.5);
    let mut awake = Vec::new();
    while world.counters().asleep < 100 {
        awake.extend(run(&mut world, DT));
        assert!(awake.len() < 240, "not asleep after 4 s: {:.1e} m/s", fastest(&world, &cubes));
    }
    let (steps, at) = (awake.len(), positions(&world, &cubes));
    let (awake, asleep) = (median(&mut awake[steps - 20..]), median(&mut run(&mut world, 2.0)));
    println!(
        "asleep after {:.2} s; {:.2} ms awake, {:.4} ms asleep: {:.2} %",
        steps as f64 * DT,
        1e3 * awake,
        1e3 * asleep,
        100.0 * asleep / awake
    );
    assert!(asleep < 0.01 * awake);
    assert_eq!(positions(&world, &cubes), at);
}

#[test]
fn a_pyramid_of_100_boxes_stands_awake_for_a_minute() {
    let (mut world, cubes) = pyramid(0.0);
    run(&mut world, 1.0);
    let at = positions(&world, &cubes);
    let mut times = run(&mut world, 60.0);
    let drift = farthest(&at, &positions(&world, &cubes));
    println!(
        "in a minute the pyramid drifts by {drift:.1e} m, {:.1e} m/s at the end; {:.2} ms a step",
        fastest(&world, &cubes),
        1e3 * median(&mut times)
    );
    assert!(drift < 1e-7);
}

/// Cubes of which a column is made: thin coats, so that a face is nearly as wide as its cube.
const THIN: f64 = 0.002;

/// The sink of one cube under its own weight, over its height, beyond which a column of `count` buckles, for faces of a
/// `width` over that of the cubes, and a layer under the lowest that is `footing` times as stiff as the others.
///
/// A layer of stiffness `k` resists a turn by `c = k w² / 12` for a face of width `w`. With tilts `θ` the energy is
/// `½ Σ c_i (θ_i - θ_(i-1))² - ½ m g a Σ (n - i + ½) θ_i²`, and the column stands while that has a lowest point.
fn buckling_sink(count: usize, width: f64, footing: f64) -> f64 {
    let mut turns = DMatrix::<f64>::zeros(count, count);
    for index in 0..count {
        turns[(index, index)] += if index == 0 { footing } else { 1.0 };
        if index > 0 {
            turns[(index - 1, index - 1)] += 1.0;
            turns[(index, index - 1)] -= 1.0;
            turns[(index - 1, index)] -= 1.0;
        }
    }
    // In units of c and of the weights, whose roots go to both sides.
    let weight = |index: usize| (count as f64 - index as f64 - 0.5).sqrt();
    let scaled = DMatrix::from_fn(count, count, |i, j| turns[(i, j)] / (weight(i) * weight(j)));
    // It buckles where m g a / c is the lowest; the sink is m g / k.
    scaled.symmetric_eigenvalues().min() * width * width / 12.0
}

/// Whether a column that leans a little still stands after some seconds.
fn column_stands(count: usize, sink: f64, seconds: f64) -> bool {
    let mut world = world(Response::Implicit, 0.0);
    add_floor(&mut world);
    // Two coats in a row give way by half of K k A each; K k = 2 K / t with the default profile.
    let face = (2.0 * (HALF - THIN)).powi(2);
    let layer = G / (sink * 2.0 * HALF);
    let coat = cube(THIN, layer * THIN / face);
    let mut height = 0.0;
    let cubes: Vec<LinkId> = (0..count)
        .map(|index| {
            let load = G * (count - index) as f64;
            height += if index == 0 { HALF - load / (2.0 * layer) } else { 2.0 * HALF - load / layer };
            // Each of them leans a little, the way in which it would buckle.
            let lean = 1e-6 * index as f64 / count as f64;
            let rotation = Quat::from_scaled_axis(Vec3::new(0.0, lean, 0.0));
            add_cube(&mut world, &coat, Pose { position: Vec3::new(0.0, 0.0, height), rotation })
        })
        .collect();
    for _ in 0..(seconds / DT) as usize {
        world.step(DT).unwrap();
        let now = positions(&world, &cubes)[count - 1];
        if now.x.hypot(now.y) > HALF {
            println!("{count} cubes, sink {sink:.2e}: fallen");
            return false;
        }
    }
    let now = positions(&world, &cubes)[count - 1];
    let (off, speed) = (now.x.hypot(now.y), fastest(&world, &cubes));
    println!("{count} cubes, sink {sink:.2e}: stands, its top off by {off:.1e} m, {speed:.1e} m/s");
    true
}

#[test]
fn a_column_buckles_where_it_should() {
    // Layers all alike: 5.6e-4 of a cube's height for ten, 6.4e-7 for a hundred.
    for (count, expected) in [(10, 5.6e-4), (100, 6.4e-7)] {
        let limit = buckling_sink(count, 1.0, 1.0);
        assert!((limit / expected - 1.0).abs() < 0.02, "{limit:e}");
    }
    for count in [10, 16] {
        // On the hard floor only one coat gives way.
        let limit = buckling_sink(count, (HALF - THIN) / HALF, 2.0);
        println!("{count} cubes buckle at a sink of {limit:.2e}");
        assert!(column_stands(count, 0.85 * limit, 20.0));
        assert!(!column_stands(count, 1.15 * limit, 20.0));
    }
}

#[test]
fn a_cube_of_a_billion_pascals_lies_flat_for_a_minute() {
    let mut world = world(Response::Implicit, 0.0);
    add_floor(&mut world);
    // K k t with the default profile is twice K.
    let cube = add_cube(&mut world, &cube(0.02, 0.5e9), Pose::at(0.0, 0.0, HALF));
    run(&mut world, 1.0);
    let at = positions(&world, &[cube]);
    let (mut speed, mut turning) = (0.0f64, 0.0f64);
    for _ in 0..3600 {
        world.step(DT).unwrap();
        let twist = world.link_state(cube).unwrap().twist;
        (speed, turning) = (speed.max(twist.linear.norm()), turning.max(twist.angular.norm()));
    }
    let drift = farthest(&at, &positions(&world, &[cube]));
    println!("at most {speed:.1e} m/s and {turning:.1e} rad/s, drift {drift:.1e} m");
    assert!(speed < 1e-4 && turning * HALF < 1e-4 && drift < 1e-6);
}
