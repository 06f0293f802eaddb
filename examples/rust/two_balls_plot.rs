//! Two balls, one fixed, one dropped on it, as in `examples/c/two_balls.c`: height and contact force against time, as an
//! SVG. The steps are shorter than those of the C example, to show the shape of each blow.
//!
//! `cargo run --release --example two_balls_plot -- out/two_balls.svg`

use std::error::Error;
use std::path::{Path, PathBuf};

use isocoat::base::link::Kind;
use isocoat::math::{Pose, Vec3};
use isocoat::world::{BodyDesc, LinkDesc, LinkId, SkeletonDesc, World, WorldDesc};
use plotters::coord::Shift;
use plotters::prelude::*;

/// Where the centre of the falling ball starts, above that of the fixed one \[m\].
const START: f64 = 1.0;
/// Length of a step, and of the whole scene \[s\].
const DT: f64 = 1.0 / 960.0;
const DURATION: f64 = 4.0;

/// The falling ball at one moment.
struct Sample {
    time: f64,
    height: f64,
    force: f64,
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = PathBuf::from(std::env::args_os().nth(1).unwrap_or_else(|| "two_balls.svg".into()));
    let samples = simulate()?;
    let highest = |part: &[Sample], value: fn(&Sample) -> f64| part.iter().map(value).fold(0.0, f64::max);
    let touch = samples.iter().position(|sample| sample.force > 0.0).ok_or("the balls never touched")?;
    draw(&samples, &path)?;
    let size = std::fs::metadata(&path)?.len();
    if size == 0 {
        return Err(format!("{} is empty", path.display()).into());
    }
    println!("dropped from {START} m, first touch after {:.3} s", samples[touch].time);
    println!(
        "highest force {:.1} N; later it rises to {:.4} m again",
        highest(&samples, |sample| sample.force),
        highest(&samples[touch..], |sample| sample.height)
    );
    println!("{}: {} samples, {size} bytes", path.display(), samples.len());
    Ok(())
}

fn simulate() -> isocoat::Result<Vec<Sample>> {
    let mut world = World::new(WorldDesc { gravity: Vec3::new(0.0, 0.0, -9.8), ..Default::default() })?;
    add_ball(&mut world, LinkDesc::default(), 0.3, 1.0)?;
    let falling = LinkDesc { kind: Kind::PointMass, pose: Pose::at(0.0, 0.0, START), mass: 2.96, ..Default::default() };
    let falling = add_ball(&mut world, falling, 0.1, 0.4)?;
    let steps = (DURATION / DT).round() as u32;
    let mut samples = Vec::new();
    for step in 1..=steps {
        world.step(DT)?;
        samples.push(Sample {
            time: f64::from(step) * DT,
            height: world.link_state(falling)?.pose.position.z,
            force: world.link_wrench(falling)?.force.z,
        });
    }
    Ok(samples)
}

/// A body of one link that carries one point: a ball.
fn add_ball(world: &mut World, link: LinkDesc, thickness: f64, radius: f64) -> isocoat::Result<LinkId> {
    let body = world.create_body(BodyDesc { isovalue: 1.0, stiffness_scale: 1.78e6, ..Default::default() })?;
    let link = world.create_link(body, link)?;
    world.create_skeleton(link, SkeletonDesc { thickness, stiffness: 1.0, radius, ..Default::default() })?;
    Ok(link)
}

fn draw(samples: &[Sample], path: &Path) -> Result<(), Box<dyn Error>> {
    let root = SVGBackend::new(path, (900, 640)).into_drawing_area();
    root.fill(&WHITE)?;
    let panels = root.split_evenly((2, 1));
    panel(&panels[0], "height of the falling ball [m]", &BLUE, samples, |sample| sample.height)?;
    panel(&panels[1], "contact force on it [N]", &RED, samples, |sample| sample.force)?;
    root.present()?;
    Ok(())
}

fn panel(
    area: &DrawingArea<SVGBackend, Shift>,
    label: &str,
    color: &RGBColor,
    samples: &[Sample],
    value: impl Fn(&Sample) -> f64,
) -> Result<(), Box<dyn Error>> {
    let highest = samples.iter().map(&value).fold(0.0, f64::max);
    let mut chart = ChartBuilder::on(area)
        .margin(12)
        .x_label_area_size(40)
        .y_label_area_size(70)
        .build_cartesian_2d(0.0..DURATION, 0.0..highest.max(1e-6) * 1.05)?;
    chart.configure_mesh().x_desc("time [s]").y_desc(label).light_line_style(TRANSPARENT).draw()?;
    chart.draw_series(LineSeries::new(samples.iter().map(|s| (s.time, value(s))), color.stroke_width(2)))?;
    Ok(())
}
