//! Speed of the field: value and gradient of one kind of skeleton at many points.
//!
//! An item is one point against one skeleton. `scalar` is a loop over single points; `lanes` is the bulk evaluation,
//! once for each instruction set of this processor.

mod common;

use common::numbers;
use divan::{Bencher, black_box, counter::ItemsCount};
use isocoat::field::lanes::Dispatch;
use isocoat::field::{Graph, Placed, Profile, Shape, blend};
use isocoat::math::{Vec3, rotation_from_vector};

fn main() {
    divan::main();
}

const POINTS: usize = 1024;
const SKELETONS: usize = 64;
const SHAPES: [&str; 5] = ["point", "segment", "triangle", "box", "plane"];

/// Skeletons of one kind and points among them: some inside, some in the falloff, some out of reach.
fn scene(shape: &str) -> (Vec<Placed>, Vec<[f64; 3]>) {
    let mut number = numbers();
    let mut vector = || Vec3::new(number(), number(), number());
    let skeletons = (0..SKELETONS).map(|_| {
        let shape = match shape {
            "point" => Shape::Point(vector()),
            "segment" => Shape::segment(vector(), vector()),
            "triangle" => Shape::triangle(vector(), vector(), vector()),
            "box" => Shape::Box {
                center: vector(),
                half: vector().map(|x| 0.1 + 0.3 * x.abs()),
                axes: *rotation_from_vector(&vector()).to_rotation_matrix().matrix(),
            },
            _ => Shape::plane(vector(), vector()).expect("a normal"),
        };
        let profile = Profile::new(1.0, 0.3, 0.0, 2.0, 1.0, shape.is_solid()).expect("a profile");
        Placed { shape, profile }
    });
    let skeletons = skeletons.collect();
    (skeletons, (0..POINTS).map(|_| vector().into()).collect())
}

fn items() -> ItemsCount {
    ItemsCount::new(POINTS * SKELETONS)
}

#[divan::bench(args = SHAPES)]
fn scalar(bencher: Bencher, shape: &str) {
    let (skeletons, points) = scene(shape);
    let (mut values, mut gradients) = (vec![0.0; POINTS], vec![[0.0; 3]; POINTS]);
    bencher.counter(items()).bench_local(|| {
        let outputs = values.iter_mut().zip(&mut gradients);
        for (point, (value, gradient)) in black_box(&points).iter().zip(outputs) {
            let sum = blend::value_gradient(&skeletons, &Graph::default(), &Vec3::from(*point));
            (*value, *gradient) = (sum.0, sum.1.into());
        }
        black_box((&mut values, &mut gradients));
    });
}

/// One row of the table.
struct Case {
    dispatch: Dispatch,
    shape: &'static str,
}

impl std::fmt::Display for Case {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{} {}", self.dispatch.name(), self.shape)
    }
}

fn cases() -> impl Iterator<Item = Case> {
    Dispatch::available().flat_map(|dispatch| SHAPES.map(|shape| Case { dispatch, shape }))
}

#[divan::bench(args = cases())]
fn lanes(bencher: Bencher, case: &Case) {
    let (skeletons, points) = scene(case.shape);
    let (mut values, mut gradients) = (vec![0.0; POINTS], vec![[0.0; 3]; POINTS]);
    bencher.counter(items()).bench_local(|| {
        case.dispatch.evaluate(&skeletons, black_box(&points), Some(&mut values), Some(&mut gradients));
        black_box((&mut values, &mut gradients));
    });
}
