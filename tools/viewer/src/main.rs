//! `isocoat-view`: pictures and files from a recording. `isocoat-view --help` lists what it does.

mod export;
mod film;
mod glb;
mod render;
mod view;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use indicatif::{ProgressBar, ProgressStyle};
use isocoat::World;
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::surface::mesh::Mesh;
use isocoat::world::mesh::{MeshDesc, TerritoryStyle};
use isocoat::world::{BodyId, Deformation, LinkId, Playback};
use lexopt::prelude::*;

use crate::view::{Cut, Paint, View};

const HELP: &str = "\
Usage: isocoat-view COMMAND RECORDING [OUTPUT] [OPTIONS]

  info RECORDING             what is in it
  still RECORDING out.png    a picture of one frame
  film RECORDING out.png     an animated picture (APNG)
  frames RECORDING folder    a picture of each frame
  mesh RECORDING out.obj     the meshes of one frame: .obj, .ply or .glb
  animate RECORDING out.glb  links as they move, substances frame by frame

Frames:
  --frame N             the frame of still and mesh [the last]
  --from N --to N       first and last frame of the others [all]
  --step N              every N-th frame [1]
  --speed X             how fast a film runs [1]
Pictures:
  --eye X,Y,Z --target X,Y,Z   where the camera is and looks [1.5,-2.5,1.5 and 0,0,0]
  --width W             of what is seen at the target, in m [2]
  --size WxH            pixels [480x360]
  --cut X,Y,Z,D         leave out where (X,Y,Z) . p > D, and show the section
  --hide N              leave out the body of this index; more than once for more
  --paint KIND          bodies, skeletons, or pressure=P: contacts up to P Pa [bodies]
Meshes:
  --cell S              edge of the cells, in m [a 64th of the width]
All:
  --shape KIND          none, contact or bulges [bulges]
";

type Outcome<T> = Result<T, Box<dyn Error>>;

struct Options {
    frame: Option<u32>,
    from: u32,
    to: Option<u32>,
    step: u32,
    speed: f64,
    cell: Option<f64>,
    view: View,
}

fn numbers<const N: usize>(text: &str) -> Outcome<[f64; N]> {
    let list = text.split([',', 'x']).map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    list.try_into().map_err(|_| format!("{text}: must be {N} numbers").into())
}

fn parse() -> Outcome<Option<(Vec<String>, Options)>> {
    let mut options =
        Options { frame: None, from: 0, to: None, step: 1, speed: 1.0, cell: None, view: View::default() };
    let (mut words, mut parser) = (Vec::new(), lexopt::Parser::from_env());
    while let Some(argument) = parser.next()? {
        let long = match argument {
            Value(word) => {
                words.push(word.string()?);
                continue;
            }
            Long("help") | Short('h') => return Ok(None),
            Long(name) => name.to_owned(),
            Short(_) => return Err(argument.unexpected().into()),
        };
        let value = parser.value()?.string()?;
        let view = &mut options.view;
        match long.as_str() {
            "frame" => options.frame = Some(value.parse()?),
            "from" => options.from = value.parse()?,
            "to" => options.to = Some(value.parse()?),
            "step" => options.step = value.parse::<u32>()?.max(1),
            "speed" => options.speed = value.parse()?,
            "cell" => options.cell = Some(value.parse()?),
            "eye" => view.eye = numbers::<3>(&value)?.into(),
            "target" => view.target = numbers::<3>(&value)?.into(),
            "width" => view.width = value.parse()?,
            "size" => view.size = numbers::<2>(&value)?.map(|x| x as u32),
            "cut" => {
                let [x, y, z, distance] = numbers(&value)?;
                let length = Vec3::new(x, y, z).norm();
                view.cut = Some(Cut { normal: Vec3::new(x, y, z) / length, distance: distance / length });
            }
            "hide" => view.hidden.push(value.parse()?),
            "paint" => {
                view.paint = match value.split_once('=') {
                    Some(("pressure", most)) => Paint::Pressure(most.parse()?),
                    None if value == "bodies" => Paint::Bodies,
                    None if value == "skeletons" => Paint::Skeletons,
                    _ => return Err(format!("--paint {value}: must be bodies, skeletons or pressure=P").into()),
                }
            }
            "shape" => {
                view.deformation = match value.as_str() {
                    "none" => Deformation::None,
                    "contact" => Deformation::Contact,
                    "bulges" => Deformation::Bulges,
                    _ => return Err(format!("--shape {value}: must be none, contact or bulges").into()),
                }
            }
            _ => return Err(format!("--{long}: unknown; --help lists what there is").into()),
        }
    }
    Ok(Some((words, options)))
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Outcome<()> {
    let Some((words, options)) = parse()? else {
        print!("{HELP}");
        return Ok(());
    };
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let (command, recording, output) = match words[..] {
        [command, recording] if command == "info" => (command, recording, PathBuf::new()),
        [command, recording, output] if command != "info" => (command, recording, PathBuf::from(output)),
        _ => return Err(HELP.into()),
    };
    let bytes = std::fs::read(recording).map_err(|error| format!("{recording}: {error}"))?;
    let mut playback = Playback::open(bytes).map_err(|error| format!("{recording}: {error}"))?;
    let count = playback.frames();
    let last = count.checked_sub(1).ok_or("the recording has no frames")?;
    let list: Vec<u32> = (options.from..=options.to.unwrap_or(last).min(last)).step_by(options.step as usize).collect();
    let one = options.frame.unwrap_or(last);
    match command {
        "info" => info(&mut playback)?,
        "still" => film::still(&render::render(playback.seek(one)?, &options.view)?, &output)?,
        "film" => {
            let mut pictures = Vec::new();
            each("frames", &list, |frame| {
                pictures.push(render::render(playback.seek(frame)?, &options.view)?);
                Ok(())
            })?;
            let span = playback.time(*list.last().unwrap_or(&0))? - playback.time(*list.first().unwrap_or(&0))?;
            let delay = 1e3 * span / options.speed / (list.len().max(2) - 1) as f64;
            film::film(&pictures, delay.clamp(10.0, 1e4) as u16, &output)?;
        }
        "frames" => {
            std::fs::create_dir_all(&output)?;
            each("frames", &list, |frame| {
                let picture = render::render(playback.seek(frame)?, &options.view)?;
                Ok(film::still(&picture, &output.join(format!("{frame:05}.png")))?)
            })?;
        }
        "mesh" => mesh(playback.seek(one)?, &options, &output)?,
        "animate" => animate(&mut playback, &list, &options, &output)?,
        other => return Err(format!("{other}: unknown command\n{HELP}").into()),
    }
    Ok(())
}

/// Does something for each frame, and shows how far it is.
fn each(what: &str, list: &[u32], mut work: impl FnMut(u32) -> Outcome<()>) -> Outcome<()> {
    let style = ProgressStyle::with_template("{msg} {bar:40} {pos}/{len} {eta}")?;
    let bar = ProgressBar::new(list.len() as u64).with_style(style).with_message(what.to_owned());
    for frame in list {
        work(*frame)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(())
}

fn info(playback: &mut Playback) -> Outcome<()> {
    let last = playback.frames() - 1;
    println!("{} frames, from {} s to {} s; in the last:", last + 1, playback.time(0)?, playback.time(last)?);
    let world = playback.seek(last)?;
    for body in world.bodies() {
        let particles = world.particles(body).map_or(0, <[_]>::len);
        let links = world.body_links(body)?.count();
        let kind = if world.body_desc(body)?.rigid { "rigid" } else { "deformable" };
        println!("  {}: {kind}, {links} links, {particles} particles", name(body));
    }
    Ok(())
}

fn name(body: BodyId) -> String {
    format!("body{}.{}", body.raw.index, body.raw.generation)
}

fn has_plane(world: &World, link: LinkId) -> bool {
    let is_plane = |skeleton| matches!(world.skeleton_desc(skeleton).map(|desc| desc.shape), Ok(Shape::Plane { .. }));
    world.link_skeletons(link).is_ok_and(|mut skeletons| skeletons.any(is_plane))
}

/// Bodies with bounds, and so with meshes.
fn bounded(world: &World) -> Vec<BodyId> {
    let open = |body: &BodyId| world.body_links(*body).is_ok_and(|mut links| links.any(|link| has_plane(world, link)));
    world.bodies().filter(|body| !open(body)).collect()
}

fn cell(options: &Options) -> f64 {
    options.cell.unwrap_or(options.view.width / 64.0)
}

fn mesh(world: &World, options: &Options, output: &Path) -> Outcome<()> {
    let desc = MeshDesc { cell_size: cell(options), deformation: options.view.deformation };
    let meshes = bounded(world).into_iter().map(|body| Ok((name(body), world.mesh(body, &desc)?)));
    let meshes = meshes.collect::<Outcome<Vec<_>>>()?;
    match output.extension().and_then(|extension| extension.to_str()) {
        Some("obj") => export::obj(&meshes, output)?,
        Some("ply") => export::ply(&meshes, output)?,
        Some("glb") => {
            let mut glb = glb::Glb::new();
            for (colour, (name, mesh)) in meshes.iter().enumerate() {
                if let Some(mesh) = glb.mesh(mesh, &Pose::default(), colour) {
                    glb.node(name, mesh, &Pose::default());
                }
            }
            glb.write(output)?;
        }
        _ => return Err(format!("{}: must end in .obj, .ply or .glb", output.display()).into()),
    }
    Ok(())
}

/// A link's part of its body's coat, in the world.
fn link_mesh(world: &World, body: BodyId, link: LinkId, cell_size: f64) -> Outcome<Mesh> {
    if world.body_links(body)?.count() == 1 {
        return Ok(world.mesh(body, &MeshDesc::new(cell_size))?);
    }
    let mut whole = Mesh::default();
    for skeleton in world.link_skeletons(link)? {
        let part = world.territory_mesh(skeleton, TerritoryStyle::Patches)?;
        let first = whole.positions.len() as u32;
        whole.positions.extend(part.positions);
        whole.normals.extend(part.normals);
        whole.triangles.extend(part.triangles.iter().map(|triangle| triangle.map(|corner| corner + first)));
    }
    Ok(whole)
}

/// A link that moves through the frames, and the node that shows it.
struct Track {
    link: LinkId,
    node: usize,
    times: Vec<f64>,
    poses: Vec<Pose>,
}

fn animate(playback: &mut Playback, list: &[u32], options: &Options, output: &Path) -> Outcome<()> {
    let (mut glb, mut tracks) = (glb::Glb::new(), Vec::<Track>::new());
    let times = list.iter().map(|frame| playback.time(*frame)).collect::<Result<Vec<_>, _>>()?;
    let desc = MeshDesc { cell_size: cell(options), deformation: options.view.deformation };
    let mut index = 0;
    each("frames", list, |frame| {
        let (time, next) = (times[index], times.get(index + 1).copied());
        index += 1;
        let world = playback.seek(frame)?;
        for (colour, body) in bounded(world).into_iter().enumerate() {
            if world.particles(body).is_ok() {
                // What flows has another mesh in each frame.
                if let Some(mesh) = glb.mesh(&world.mesh(body, &desc)?, &Pose::default(), colour) {
                    let node = glb.node(&format!("{} at {time} s", name(body)), mesh, &Pose::default());
                    glb.show_between(node, time, next, times[0]);
                }
                continue;
            }
            for link in world.body_links(body)? {
                let pose = world.link_state(link)?.pose;
                let at = match tracks.iter().position(|track| track.link == link) {
                    Some(at) => at,
                    None => {
                        let mesh = link_mesh(world, body, link, desc.cell_size)?;
                        let Some(mesh) = glb.mesh(&mesh, &pose, colour) else { continue };
                        let node = glb.node(&format!("{} link{}", name(body), link.raw.index), mesh, &pose);
                        tracks.push(Track { link, node, times: Vec::new(), poses: Vec::new() });
                        tracks.len() - 1
                    }
                };
                tracks[at].times.push(time);
                tracks[at].poses.push(pose);
            }
        }
        Ok(())
    })?;
    for Track { node, times, poses, .. } in &tracks {
        if poses.windows(2).any(|pair| pair[0] != pair[1]) {
            glb.follow(*node, times, poses);
        }
    }
    Ok(glb.write(output)?)
}
