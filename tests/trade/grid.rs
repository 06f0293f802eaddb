//! The grid: every way to integrate with every way to step, in every scene; and one knob at a time.

use isocoat::world::{Response, Scheme};

use super::sim::{Errors, Record, Scene, Settings};

/// A scene run with some settings.
#[derive(Clone, Debug)]
pub struct Run {
    pub scene: usize,
    pub settings: Settings,
    /// Time a frame \[s\] and errors; none if it took longer than the budget.
    pub result: Option<(f64, Errors)>,
}

impl Run {
    /// Time a frame and an error of it, as they are for a run that took too long: endless.
    pub fn point(&self, error: impl Fn(&Errors) -> Option<f64>) -> (f64, f64) {
        match &self.result {
            Some((time, errors)) => (*time, error(errors).unwrap_or(f64::INFINITY)),
            None => (f64::INFINITY, f64::INFINITY),
        }
    }
}

/// A scene with what its runs are compared with.
pub struct Compared {
    pub scene: Scene,
    pub reference: Record,
    /// How far the reference is from one of steps twice as long, over the radius.
    pub doubt: f64,
    energies: Vec<f64>,
}

impl Compared {
    pub fn new(scene: Scene) -> Self {
        let (reference, doubt) = scene.reference();
        let energies = scene.energies(&reference);
        Compared { scene, reference, doubt, energies }
    }

    pub fn run(&self, index: usize, settings: Settings, budget: f64) -> Run {
        let result = self.scene.run(&settings, budget).map(|record| {
            let errors = self.scene.errors(&record, &self.reference, &self.energies);
            (record.time, errors)
        });
        Run { scene: index, settings, result }
    }
}

/// All settings of the grid.
pub fn settings() -> Vec<Settings> {
    let usual = Settings::default();
    let mut integrations = Vec::new();
    for (scheme, tolerances) in [
        (Scheme::Auto, &[5e-2, 5e-3, 5e-4][..]),
        (Scheme::Polar, &[1e-1, 1e-2, 1e-4]),
        (Scheme::Adaptive, &[1e-1, 1e-2]),
    ] {
        integrations.extend(tolerances.iter().map(|tolerance| Settings { scheme, tolerance: *tolerance, ..usual }));
    }
    integrations.extend([64, 256, 1024].map(|seeds| Settings { scheme: Scheme::Seeds, seeds, ..usual }));
    integrations.iter().flat_map(|integration| steppings(*integration)).collect()
}

/// All ways to step with one way to integrate.
fn steppings(usual: Settings) -> Vec<Settings> {
    let mut all = vec![usual];
    all.extend([1, 2, 4, 8, 16, 32, 64].map(|steps| Settings { response: Response::Explicit, steps, ..usual }));
    let response = Response::Substepped;
    all.extend([1.0, 0.4, 0.2, 0.1, 0.05].map(|phase| Settings { response, phase, ..usual }));
    for steps in [1, 4, 16] {
        for (rounds, round_tolerance) in [(2, 0.5), (8, 0.05), (8, 0.005)] {
            all.push(Settings { response: Response::Implicit, steps, rounds, round_tolerance, ..usual });
        }
    }
    all
}

/// The knobs one at a time, the others at their defaults: name, scenes by key, values in words with their settings.
#[expect(clippy::type_complexity, reason = "a table")]
pub fn knobs() -> Vec<(&'static str, Vec<&'static str>, Vec<(String, Settings)>)> {
    let usual = Settings::default();
    let implicit = Settings { response: Response::Implicit, ..usual };
    let substepped = Settings { response: Response::Substepped, ..usual };
    fn values<T: Copy + std::fmt::Display>(values: &[T], set: impl Fn(T) -> Settings) -> Vec<(String, Settings)> {
        values.iter().map(|value| (value.to_string(), set(*value))).collect()
    }
    let responses = [Response::Auto, Response::Explicit, Response::Implicit, Response::Substepped];
    vec![
        (
            "response",
            vec!["two-balls", "ten-in-a-box", "dumbbells", "cube", "rolling-ball"],
            responses.map(|response| (format!("{response:?}").to_lowercase(), Settings { response, ..usual })).to_vec(),
        ),
        (
            "force_tolerance",
            vec!["dumbbells", "cube"],
            values(&[0.2, 0.05, 0.005, 0.0005, 0.00005], |tolerance| Settings { tolerance, ..usual }),
        ),
        (
            "substep_phase",
            vec!["two-balls", "dumbbells", "cube"],
            values(&[1.0, 0.4, 0.2, 0.1, 0.05], |phase| Settings { phase, ..substepped }),
        ),
        (
            "max_substeps",
            vec!["two-balls", "cube"],
            values(&[4, 16, 64, 4096], |most_substeps| Settings { most_substeps, ..usual }),
        ),
        (
            "steps a frame (the host's dt), implicit",
            vec!["two-balls", "ten-in-a-box", "rolling-ball"],
            values(&[1, 2, 4, 16], |steps| Settings { steps, ..implicit }),
        ),
        (
            "implicit_tolerance",
            vec!["ten-in-a-box", "cube"],
            values(&[0.5, 0.05, 0.005, 0.0005], |round_tolerance| Settings { round_tolerance, ..implicit }),
        ),
        (
            "implicit_rounds",
            vec!["ten-in-a-box", "cube"],
            values(&[1, 2, 4, 8, 32], |rounds| Settings { rounds, ..implicit }),
        ),
        ("implicit_splits", vec!["ten-in-a-box", "cube"], values(&[0, 4], |splits| Settings { splits, ..implicit })),
    ]
}
