//! Exactness against time, over everything that can be set, in five scenes.
//!
//! `make trade` runs the whole grid and writes docs/trade.md with its data and figures; the tests check what that page
//! counts on.

mod bounce;
mod clock;
#[path = "../common/mod.rs"]
mod common;
mod grid;
mod page;
mod pareto;
mod plot;
mod query;
mod scenes;
mod sim;

use isocoat::world::Response;

use common::Random;

use grid::Compared;
use page::Measured;
use sim::Settings;

/// What is worth choosing is better than all else in something; nothing else is.
#[test]
fn the_front_is_what_nothing_beats() {
    let mut random = Random(5);
    for _ in 0..100 {
        let mut points: Vec<(f64, f64)> = (0..40).map(|_| (random.unit(), random.unit().powi(4))).collect();
        points.extend([(0.0, f64::INFINITY), (f64::INFINITY, f64::INFINITY), points[3], (points[4].0, 1.0)]);
        let front = pareto::front(&points);
        let beats = |x: (f64, f64), y: (f64, f64)| x.0 <= y.0 && x.1 <= y.1 && x != y;
        for pair in front.windows(2) {
            let (x, y) = (points[pair[0]], points[pair[1]]);
            assert!(x.0 < y.0 && x.1 > y.1, "{x:?} before {y:?}");
        }
        for (i, point) in points.iter().enumerate() {
            let beaten = points.iter().any(|other| beats(*other, *point));
            let equal = front.iter().any(|j| points[*j] == *point);
            assert!(beaten || equal || !point.1.is_finite(), "{point:?} is nowhere");
            assert!(!(beaten && front.contains(&i)), "{point:?} is beaten");
        }
        let limit = 0.01;
        match pareto::quickest(&points, limit) {
            Some(i) => assert!(points.iter().all(|point| point.1 > limit || point.0 >= points[i].0)),
            None => assert!(points.iter().all(|point| point.1 > limit)),
        }
    }
}

#[test]
fn every_row_of_the_data_has_the_columns_of_its_head() {
    let columns = |line: &str| line.split(',').count();
    let errors = sim::Errors { path: 0.1, energy: f64::INFINITY, gain: 0.0, rest: None };
    for result in [None, Some((1e-3, errors)), Some((1e-3, sim::Errors { rest: Some(0.5), ..errors }))] {
        let run = grid::Run { scene: 0, settings: Settings::default(), result };
        assert_eq!(columns(&page::motion_row("scene", &run, true)), columns(page::MOTION));
    }
    let cost = query::Cost { force: 0.1, worst: 0.2, torque: f64::NAN, evaluations: 7.0, time: 1e-6 };
    assert_eq!(columns(&page::force_row("scene", &Settings::default(), &cost)), columns(page::FORCE));
}

#[test]
fn half_the_sub_step_has_a_quarter_of_the_error() {
    let scene = Compared::new(scenes::bouncing());
    let error = |steps| {
        // One sub-step a step.
        let settings = Settings { response: Response::Substepped, phase: 1.0, steps, ..Settings::default() };
        scene.run(0, settings, f64::INFINITY).result.unwrap().1.path
    };
    let errors = [64, 128, 256].map(error);
    let better: Vec<f64> = errors.windows(2).map(|pair| pair[0] / pair[1]).collect();
    assert!(better.iter().all(|times| (3.0..5.0).contains(times)), "{errors:?}");
}

/// Processor time a frame at which a run is given up \[s\].
const BUDGET: f64 = 4e-3;

#[test]
#[ignore = "takes minutes: make trade"]
fn the_whole_grid() {
    let begin = clock::cpu_seconds();
    let done = |what: &str| println!("{:6.1} s  {what}", clock::cpu_seconds() - begin);
    let schemes = query::schemes();
    let blended = query::blended_pairs(12, 192);
    let blended = blended.into_iter().map(|pair| {
        let costs = schemes.iter().map(|settings| pair.cost(settings)).collect();
        (pair, costs)
    });
    let blended = blended.collect();
    done("blended pairs against brute force");
    let bounces = [Response::Implicit, Response::Substepped]
        .into_iter()
        .flat_map(|response| [1e4, 1e7].map(|modulus| (response, bounce::bounces(response, modulus))));
    let bounces = bounces.collect();
    done("bounces");
    let compared: Vec<Compared> = scenes::all().into_iter().map(Compared::new).collect();
    done("references");
    let mut runs = Vec::new();
    let mut costs = Vec::new();
    for (index, scene) in compared.iter().enumerate() {
        costs.push(query::costs(&scene.scene, &scene.reference, &schemes));
        runs.extend(grid::settings().into_iter().map(|settings| scene.run(index, settings, BUDGET)));
        done(scene.scene.name);
    }
    let knob = |(name, keys, values): (&'static str, Vec<&str>, Vec<(String, Settings)>)| {
        let places = keys.into_iter().map(|key| compared.iter().position(|c| c.scene.key == key).unwrap());
        let runs =
            places.flat_map(|place| values.iter().map(move |(value, settings)| (value.clone(), (place, *settings))));
        let run = |(value, (place, settings)): (String, (usize, Settings))| {
            (value, compared[place].run(place, settings, BUDGET))
        };
        (name, runs.map(run).collect())
    };
    let knobs = grid::knobs().into_iter().map(knob).collect();
    done("one knob at a time");
    page::write(&Measured { scenes: compared, runs, knobs, schemes, costs, blended, bounces, budget: BUDGET });
    done("docs/trade.md");
}
