//! docs/trade.md and what lies beside it: tables, data and figures of one run.

use std::fmt::Write as _;
use std::path::PathBuf;

use isocoat::world::{Response, Scheme};

use super::bounce::Bounce;
use super::grid::{Compared, Run};
use super::pareto::{front, quickest};
use super::plot::{self, Axis, Curve, Panel};
use super::query::{Blended, Cost};
use super::sim::{Errors, Settings, scheme_name};

/// All that one run measured.
pub struct Measured {
    pub scenes: Vec<Compared>,
    pub runs: Vec<Run>,
    /// One knob at a time: name, and runs with the knob's value.
    pub knobs: Vec<(&'static str, Vec<(String, Run)>)>,
    /// The ways to integrate, and their costs scene by scene.
    pub schemes: Vec<Settings>,
    pub costs: Vec<Vec<Cost>>,
    /// The blended pairs, with their costs.
    pub blended: Vec<(Blended, Vec<Cost>)>,
    pub bounces: Vec<(Response, Vec<Bounce>)>,
    /// Processor time a frame beyond which a run was given up \[s\].
    pub budget: f64,
}

fn docs() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("docs")
}

/// Two digits.
fn digits(x: f64) -> String {
    if x == 0.0 || !x.is_finite() {
        return if x == 0.0 { "0".into() } else { "-".into() };
    }
    let places = (1 - x.abs().log10().floor() as i32).max(0) as usize;
    format!("{x:.places$}")
}

/// A part of one; what is very small or very large by its power of ten.
pub fn part(x: f64) -> String {
    match x {
        x if x.is_nan() || x > 1e3 => "lost".into(),
        0.0 => "0".into(),
        x if x < 1e-5 => format!("{x:.0e}"),
        x => format!("{}%", digits(100.0 * x)),
    }
}

fn microseconds(time: f64) -> String {
    format!("{} µs", digits(1e6 * time))
}

fn milliseconds(time: f64) -> String {
    if time.is_finite() { digits(1e3 * time) } else { "-".into() }
}

/// Columns of the two data files.
pub const MOTION: &str = "scene,scheme,force_tolerance,seed_count,response,steps_per_frame,substep_phase,\
                          implicit_rounds,implicit_tolerance,ms_per_frame,path_error,energy_error,energy_gain,\
                          rest_error,on_path_front";
pub const FORCE: &str = "scene,scheme,tolerance,seed_count,evaluations,us_per_query,force_error,force_error_worst,\
                         torque_error";

fn number(x: f64) -> String {
    if x.is_finite() { format!("{x:.4e}") } else { String::new() }
}

/// A row of the grid; figures of a run that was given up, and what a scene does not have, are empty.
pub fn motion_row(scene: &str, run: &Run, on_front: bool) -> String {
    let s = &run.settings;
    let settings = format!(
        "{scene},{},{},{},{:?},{},{},{},{}",
        scheme_name(s.scheme),
        s.tolerance,
        s.seeds,
        s.response,
        s.steps,
        s.phase,
        s.rounds,
        s.round_tolerance
    );
    let figures = match &run.result {
        None => ",,,,".to_owned(),
        Some((time, e)) => {
            let rest = e.rest.map(number).unwrap_or_default();
            [number(1e3 * time), number(e.path), number(e.energy), number(e.gain), rest].join(",")
        }
    };
    format!("{settings},{figures},{}", u8::from(on_front))
}

pub fn force_row(scene: &str, settings: &Settings, cost: &Cost) -> String {
    let figures = [cost.evaluations, 1e6 * cost.time, cost.force, cost.worst, cost.torque].map(number).join(",");
    let Settings { scheme, tolerance, seeds, .. } = settings;
    format!("{scene},{},{tolerance},{seeds},{figures}", scheme_name(*scheme))
}

/// Writes everything.
pub fn write(measured: &Measured) {
    std::fs::create_dir_all(docs().join("trade")).unwrap();
    let write = |name: &str, text: String| std::fs::write(docs().join(name), text).unwrap();
    write("trade/motion.csv", measured.motion_csv());
    write("trade/force.csv", measured.force_csv());
    write("trade/bounce.csv", measured.bounce_csv());
    measured.force_figure();
    measured.motion_figure();
    measured.rest_figure();
    measured.bounce_figure();
    write("trade.md", measured.page());
}

/// The usual curve: what is worth choosing of some points, but for what is off by more than tenfold.
fn frontier(name: &str, color: plotters::style::RGBColor, mut points: Vec<(f64, f64)>) -> Option<Curve> {
    points.retain(|(_, error)| *error <= 10.0);
    let points: Vec<_> = front(&points).into_iter().map(|i| points[i]).collect();
    (!points.is_empty()).then(|| Curve { name: name.into(), color, points })
}

type Error = fn(&Errors) -> Option<f64>;

fn path(errors: &Errors) -> Option<f64> {
    Some(errors.path)
}

fn energy(errors: &Errors) -> Option<f64> {
    Some(errors.energy)
}

fn rest(errors: &Errors) -> Option<f64> {
    errors.rest
}

impl Measured {
    fn name(&self, scene: usize) -> &'static str {
        self.scenes[scene].scene.name
    }

    fn place_of(&self, key: &str) -> usize {
        self.scenes.iter().position(|compared| compared.scene.key == key).unwrap()
    }

    fn of_scene(&self, scene: usize) -> Vec<&Run> {
        self.runs.iter().filter(|run| run.scene == scene).collect()
    }

    fn motion_csv(&self) -> String {
        let mut text = format!("{MOTION}\n");
        for scene in 0..self.scenes.len() {
            let runs = self.of_scene(scene);
            let best = front(&runs.iter().map(|run| run.point(path)).collect::<Vec<_>>());
            for (i, run) in runs.iter().enumerate() {
                let row = motion_row(self.scenes[scene].scene.key, run, best.contains(&i));
                let _ = writeln!(text, "{row}");
            }
        }
        text
    }

    fn force_csv(&self) -> String {
        let mut text = format!("{FORCE}\n");
        let scenes = self.scenes.iter().map(|compared| compared.scene.key).zip(&self.costs);
        for (key, costs) in scenes.chain(self.blended.iter().map(|(pair, costs)| (pair.name, costs))) {
            for (settings, cost) in self.schemes.iter().zip(costs) {
                let _ = writeln!(text, "{}", force_row(key, settings, cost));
            }
        }
        text
    }

    fn bounce_csv(&self) -> String {
        let mut text = "response,modulus,steps_per_contact,energy_kept,least,most\n".to_owned();
        for (response, bounces) in &self.bounces {
            for b in bounces {
                let figures = [b.modulus, b.steps, b.kept, b.least, b.most].map(number).join(",");
                let _ = writeln!(text, "{response:?},{figures}");
            }
        }
        text
    }

    fn force_figure(&self) {
        let (polar, facets) = (("polar", Scheme::Polar, plot::BLUE), ("facets", Scheme::Facets, plot::PURPLE));
        let (adaptive, seeds) = (("adaptive", Scheme::Adaptive, plot::GREEN), ("seeds", Scheme::Seeds, plot::ORANGE));
        let panels = [
            ("Ball on ball", "two-balls", vec![polar, adaptive, seeds]),
            ("Dumbbell on dumbbell", "dumbbells", vec![polar, adaptive, seeds]),
            ("Cube on floor", "cube", vec![facets, polar, adaptive, seeds]),
        ];
        let panels = panels.map(|(title, key, kinds)| {
            let costs = &self.costs[self.place_of(key)];
            let curve = |(name, scheme, color)| {
                let of_kind = self.schemes.iter().zip(costs).filter(|(settings, _)| settings.scheme == scheme);
                frontier(name, color, of_kind.map(|(_, cost)| (cost.time, cost.force)).collect())
            };
            Panel { title: title.into(), curves: kinds.into_iter().filter_map(curve).collect() }
        });
        let x = Axis { decades: (-6, -1), name: "time of a query", tick: plot::seconds };
        let y = Axis { decades: (-7, 0), name: "error of the force", tick: plot::percent };
        plot::figure(&docs().join("trade/force.svg"), 3, x, y, &panels, &[]);
    }

    /// A panel of a scene: for each response, what is worth choosing; and where the defaults are.
    fn panel(&self, title: &str, scene: usize, error: Error) -> Panel {
        let runs = self.of_scene(scene);
        let responses = [
            ("explicit", Response::Explicit, plot::ORANGE),
            ("sub-steps", Response::Substepped, plot::BLUE),
            ("implicit", Response::Implicit, plot::GREEN),
        ];
        let curve = |(name, response, color)| {
            let of_kind = runs.iter().filter(|run| run.settings.response == response);
            frontier(name, color, of_kind.map(|run| run.point(error)).collect())
        };
        let mut curves: Vec<Curve> = responses.into_iter().filter_map(curve).collect();
        let usual = runs.iter().find(|run| run.settings == Settings::default()).unwrap();
        curves.push(Curve { name: "defaults".into(), color: plot::BLACK, points: vec![usual.point(error)] });
        Panel { title: title.into(), curves }
    }

    fn motion_figure(&self) {
        let titles =
            ["Two balls bouncing", "Ten balls in a box", "Dumbbells colliding", "Cube landing", "Ball rolling"];
        let panels: Vec<Panel> =
            titles.into_iter().enumerate().map(|(scene, title)| self.panel(title, scene, path)).collect();
        let x = Axis { decades: (-6, -2), name: "time of a frame (1/60 s)", tick: plot::seconds };
        let y = Axis { decades: (-6, 1), name: "error of the path", tick: plot::percent };
        let note = [
            "Lower is more exact, left is quicker.",
            "Each dot: settings that no others",
            "of that response beat in both.",
        ];
        plot::figure(&docs().join("trade/motion.svg"), 3, x, y, &panels, &note);
    }

    fn rest_figure(&self) {
        let of = |title, key, error| self.panel(title, self.place_of(key), error);
        let x = Axis { decades: (-6, -2), name: "time of a frame (1/60 s)", tick: plot::seconds };
        let y = Axis { decades: (-6, 1), name: "error of energy", tick: plot::percent };
        let panels = [of("Two balls bouncing", "two-balls", energy), of("Dumbbells colliding", "dumbbells", energy)];
        plot::figure(&docs().join("trade/energy.svg"), 2, x, y, &panels, &[]);
        let y = Axis { decades: (-6, 1), name: "distance from rest", tick: plot::percent };
        let panels = [of("Ten balls in a box", "ten-in-a-box", rest), of("Cube on a floor", "cube", rest)];
        plot::figure(&docs().join("trade/rest.svg"), 2, x, y, &panels, &[]);
    }

    fn bounce_figure(&self) {
        let curve = |name: &str, response, color| {
            let (_, bounces) = self.bounces.iter().find(|(kind, _)| *kind == response).unwrap();
            let points = bounces.iter().map(|b| (b.steps, (1.0 - b.kept).abs())).collect();
            Curve { name: name.into(), color, points }
        };
        let curves = vec![
            curve("implicit: lost", Response::Implicit, plot::GREEN),
            curve("sub-steps: off by", Response::Substepped, plot::BLUE),
        ];
        let count = |power: i32| format!("{}", 10f64.powi(power));
        let x = Axis { decades: (-1, 3), name: "steps in the contact's duration", tick: count };
        let y = Axis { decades: (-6, 0), name: "energy", tick: plot::percent };
        plot::figure(&docs().join("trade/bounce.svg"), 1, x, y, &[Panel { title: "One bounce".into(), curves }], &[]);
    }

    fn page(&self) -> String {
        let mut text = String::from(
            "# The trade: exactness against time\n\n\
             Written by `make trade`. One thread; times are processor time, which drifts by tens of per cent from day to \
             day: compare within a page. A frame is 1/60 s of a scene, however many steps are taken in it.\n",
        );
        self.choices(&mut text);
        self.forces(&mut text);
        self.motion(&mut text);
        self.bounce_table(&mut text);
        self.knob_tables(&mut text);
        self.method(&mut text);
        text
    }

    /// If you need X, choose Y: of the settings that do in all scenes, the one of the least time.
    fn choices(&self, text: &mut String) {
        let needs: [(&str, Error, f64); 8] = [
            ("nothing to explode: no gain beyond 10%", |e| Some(e.gain), 0.1),
            ("never a gain of energy", |e| Some(e.gain), 1e-5),
            ("rest within 1% of the sink", rest, 0.01),
            ("a path within 10% of a radius", path, 0.1),
            ("a path within 1%", path, 0.01),
            ("a path within 0.1%", path, 0.001),
            ("energy of what bounces within 1%", |e| e.rest.is_none().then_some(e.energy), 0.01),
            ("energy of what bounces within 0.1%", |e| e.rest.is_none().then_some(e.energy), 0.001),
        ];
        let _ = write!(text, "\n## If you need this, choose that\n\n| if you need | choose |");
        for compared in &self.scenes {
            let _ = write!(text, " {} |", compared.scene.name);
        }
        let _ = write!(text, "\n| --- | --- |{}\n", " --- |".repeat(self.scenes.len()));
        let settings: Vec<Settings> = self.of_scene(0).iter().map(|run| run.settings).collect();
        for (need, error, limit) in needs {
            // What meets the need wherever it can be asked, and the mean of its times there.
            let point = |i: usize| {
                let runs = (0..self.scenes.len()).map(|scene| self.of_scene(scene)[i]);
                let asked = runs.filter(|run| run.result.as_ref().is_none_or(|(_, errors)| error(errors).is_some()));
                let points: Vec<_> = asked.map(|run| run.point(error)).collect();
                let mean = points.iter().map(|(time, _)| time.ln()).sum::<f64>() / points.len() as f64;
                (mean.exp(), points.iter().map(|(_, error)| *error).fold(0.0, f64::max))
            };
            let points: Vec<_> = (0..settings.len()).map(point).collect();
            let Some(best) = quickest(&points, limit) else {
                let _ = writeln!(text, "| {need} | nothing in this grid |{}", " |".repeat(self.scenes.len()));
                continue;
            };
            let chosen = &settings[best];
            let _ = write!(text, "| {need} | {}; {} |", chosen.stepping(), chosen.integration());
            for scene in 0..self.scenes.len() {
                let run = self.of_scene(scene)[best];
                let asked = run.result.as_ref().is_some_and(|(_, errors)| error(errors).is_some());
                let cell = if asked { milliseconds(run.point(error).0) } else { String::new() };
                let _ = write!(text, " {cell} |");
            }
            text.push('\n');
        }
        text.push_str(
            "\nFigures are ms a frame. The choice is the quickest of the grid that meets the need in every scene where \
             the need can be asked (rest: three of them; bounces: two).\n",
        );
    }

    /// The coarsest of a scheme that keeps to an error, with its time.
    fn coarsest(&self, costs: &[Cost], scheme: Scheme, limit: f64) -> String {
        let mut of_kind = self.schemes.iter().zip(costs).filter(|(settings, _)| settings.scheme == scheme);
        of_kind.find(|(_, cost)| cost.worst <= limit).map_or("-".into(), |(settings, cost)| {
            let set = match scheme {
                Scheme::Seeds => settings.seeds.to_string(),
                _ => format!("{:.0e}", settings.tolerance),
            };
            format!("{} ({set})", microseconds(cost.time))
        })
    }

    fn forces(&self, text: &mut String) {
        text.push_str(
            "\n## One force\n\n![Error of the force against the time of a query](trade/force.svg)\n\n\
             Each dot is a tolerance, or a number of seeds, that no other of its scheme beats. Time of a query \
             whose worst error stays below 1%, 0.1% and 0.01% on all poses, with the tolerance or the seeds that it takes:\n\n\
             | contacts of | error | automatic | polar | adaptive | seeds |\n| --- | --- | --- | --- | --- | --- |\n",
        );
        for (scene, costs) in self.costs.iter().enumerate() {
            for (words, limit) in [("1%", 1e-2), ("0.1%", 1e-3), ("0.01%", 1e-4)] {
                let times = [Scheme::Auto, Scheme::Polar, Scheme::Adaptive, Scheme::Seeds]
                    .map(|scheme| self.coarsest(costs, scheme, limit));
                let _ = writeln!(text, "| {} | {words} | {} |", self.name(scene), times.join(" | "));
            }
        }
        text.push_str(
            "\nBalls on balls and on floors have a closed form: *automatic* is exact there at any tolerance. A cube has \
             faces: *automatic* takes facets. The torque goes with the force:\n\n\
             | polar, contacts of | force at 3e-3 | torque at 3e-3 | force at 1e-4 | torque at 1e-4 |\n\
             | --- | --- | --- | --- | --- |\n",
        );
        for (scene, costs) in self.costs.iter().enumerate() {
            let at = |tolerance: f64| {
                let wanted = |s: &&Settings| s.scheme == Scheme::Polar && s.tolerance == tolerance;
                let place = self.schemes.iter().position(|s| wanted(&s)).unwrap();
                format!("{} | {}", part(costs[place].force), part(costs[place].torque))
            };
            let _ = writeln!(text, "| {} | {} | {} |", self.name(scene), at(3e-3), at(1e-4));
        }
        text.push_str(
            "\n### Blended pairs against brute force\n\n\
             Pressed together by 5 to 30% of the thinner coat, at random poses; the reference integrates the volume of \
             overlap line by line (`tests/common/oracle.rs`). Bar: 1% below 100 µs.\n\n\
             | pair | poses | brute force, doubt | quickest within 1% | root mean square | worst | time | bar |\n\
             | --- | --- | --- | --- | --- | --- | --- | --- |\n",
        );
        for (pair, costs) in &self.blended {
            // Facets are for single skeletons.
            let general = |i: usize| self.schemes[i].scheme != Scheme::Facets;
            let point = |(i, cost): (usize, &Cost)| (cost.time, if general(i) { cost.force } else { f64::INFINITY });
            let points: Vec<_> = costs.iter().enumerate().map(point).collect();
            let _ = match quickest(&points, 0.01) {
                None => {
                    writeln!(text, "| {} | {} | {} | none | | | | missed |", pair.name, pair.count(), part(pair.doubt))
                }
                Some(i) => writeln!(
                    text,
                    "| {} | {} | {} | {} | {} | {} | {} | {} |",
                    pair.name,
                    pair.count(),
                    part(pair.doubt),
                    self.schemes[i].integration(),
                    part(costs[i].force),
                    part(costs[i].worst),
                    microseconds(costs[i].time),
                    if costs[i].time < 1e-4 { "met" } else { "missed" }
                ),
            };
        }
        text.push_str(
            "\nIn one pose of clover-step the four schemes agree with each other far better than with brute force, whatever \
             the tolerance (force.csv): some of the error there is the reference's.\n",
        );
    }

    fn motion(&self, text: &mut String) {
        text.push_str(
            "\n## Paths\n\n![Error of the path against the time of a frame](trade/motion.svg)\n\n\
             Each dot is a point of the grid that no other of its response beats, whatever its scheme. Left is quicker, \
             low is more exact.\n\n\
             ## Energy and rest\n\n![Error of energy against the time of a frame](trade/energy.svg)\n\n\
             ![Distance from rest against the time of a frame](trade/rest.svg)\n\n\
             What is below the frame is drawn on its edge: the implicit response rests to ten digits.\n",
        );
    }

    fn bounce_table(&self, text: &mut String) {
        text.push_str(
            "\n## One undamped bounce\n\n![Energy lost in a bounce](trade/bounce.svg)\n\n\
             A ball on a hard floor. The steps within the contact's duration decide, not the stiffness: moduli of 1e4 and \
             1e7 Pa lie on one curve. 16 moments of touch within a step each.\n\n\
             | response | steps in the contact | energy kept | least | most |\n| --- | --- | --- | --- | --- |\n",
        );
        for (response, bounces) in &self.bounces {
            let shown = |b: &&Bounce| [0.18, 1.0, 10.0, 100.0].iter().any(|steps| (b.steps / steps - 1.0).abs() < 0.1);
            for b in bounces.iter().filter(shown) {
                let steps = digits(b.steps);
                let kept = [b.kept, b.least, b.most].map(|x| format!("{:.3}%", 100.0 * x)).join(" | ");
                let _ = writeln!(text, "| {response:?}, {:.0e} Pa | {steps} | {kept} |", b.modulus);
            }
        }
        let most = |response| {
            let of = self.bounces.iter().filter(|(kind, _)| *kind == response).flat_map(|(_, bounces)| bounces);
            of.map(|b| b.most).fold(0.0, f64::max)
        };
        let _ = writeln!(
            text,
            "\nBar: the implicit response never gains. The most that any of its bounces kept is {:.3}%: {}.",
            100.0 * most(Response::Implicit),
            if most(Response::Implicit) <= 1.0 { "met" } else { "missed" },
        );
    }

    fn knob_tables(&self, text: &mut String) {
        text.push_str(
            "\n## One knob at a time\n\nThe others at their defaults. Errors of path, energy and rest as below; `gain` is \
             the most energy above the start's.\n",
        );
        for (name, runs) in &self.knobs {
            let _ = write!(
                text,
                "\n### {name}\n\n| scene | value | path | energy | gain | rest | ms a frame |\n\
                 | --- | --- | --- | --- | --- | --- | --- |\n"
            );
            for (value, run) in runs {
                let scene = self.name(run.scene);
                let _ = match &run.result {
                    None => writeln!(text, "| {scene} | {value} | given up | | | | |"),
                    Some((time, e)) => writeln!(
                        text,
                        "| {scene} | {value} | {} | {} | {} | {} | {} |",
                        part(e.path),
                        part(e.energy),
                        part(e.gain),
                        e.rest.map(part).unwrap_or_default(),
                        milliseconds(*time)
                    ),
                };
            }
        }
        text.push_str("\n### scheme and seed_count\n\n| contacts of | scheme | force | worst | torque | a query |\n| --- | --- | --- | --- | --- | --- |\n");
        for key in ["two-balls", "dumbbells", "cube"] {
            let scene = self.place_of(key);
            for (settings, cost) in self.schemes.iter().zip(&self.costs[scene]) {
                if settings.scheme != Scheme::Seeds && settings.tolerance != 3e-3 {
                    continue;
                }
                let _ = writeln!(
                    text,
                    "| {} | {} | {} | {} | {} | {} |",
                    self.name(scene),
                    settings.integration(),
                    part(cost.force),
                    part(cost.worst),
                    part(cost.torque),
                    microseconds(cost.time)
                );
            }
        }
    }

    fn method(&self, text: &mut String) {
        text.push_str(
            "\n## What was measured\n\n\
             - **Two balls**: 0.1 m, 1 kg, 1e6 Pa in the middle, dropped 0.2 m on a fixed one of 0.3 m; undamped.\n\
             - **Ten balls in a box**: the same balls, lying in a heap, shaken by 0.3 m/s each; damped, without friction, \
             so that there is one rest.\n\
             - **Dumbbells tumbling**: two balls each, blended, thrown at each other free of gravity; undamped.\n\
             - **Cube on a floor**: 0.2 m, 1 kg, with a coat of 0.02 m of 1e5 Pa, dropped 1 cm with a tilt of 3°; damped, \
             friction 0.5.\n\
             - **A rolling ball**: slides at 1 m/s under friction 0.3 until it rolls.\n\n\
             *Path*: the largest distance from the reference's path, turns counted at the surface, over the radius. \
             *Energy*: kinetic, of height and of the coats, its largest difference to the reference's, over what the scene \
             turns over. *Rest*: distance from the height of rest at the end, over the sink. *Force*: root mean square over \
             the poses; *torque* over force times radius. References: sub-steps far shorter at a tolerance of 1e-5 or \
             below, the rolling ball in closed form; rest from the static forces; forces at a tolerance of 1e-8.\n\n\
             | scene | compared up to | reference, against one of twice the steps |\n| --- | --- | --- |\n",
        );
        for compared in &self.scenes {
            let doubt = if compared.doubt == 0.0 { "closed form".into() } else { part(compared.doubt) };
            let _ = writeln!(text, "| {} | {} s | {doubt} |", compared.scene.name, compared.scene.horizon);
        }
        let given_up = self.runs.iter().filter(|run| run.result.is_none()).count();
        let _ = writeln!(
            text,
            "\n{} runs; {given_up} of them were given up because a frame took longer than {} ms on average. All of them: \
             [motion.csv](trade/motion.csv), [force.csv](trade/force.csv), [bounce.csv](trade/bounce.csv).",
            self.runs.len(),
            milliseconds(self.budget)
        );
    }
}
