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
use isocoat::world::attributes::Weights;
use isocoat::world::mesh::MeshDesc;
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
  animate RECORDING out.glb  coats on their links as these move, substances frame by frame

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

impl Default for Options {
    fn default() -> Self {
        Self { frame: None, from: 0, to: None, step: 1, speed: 1.0, cell: None, view: View::default() }
    }
}

fn numbers<const N: usize>(text: &str) -> Outcome<[f64; N]> {
    let list = text.split([',', 'x']).map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    list.try_into().map_err(|_| format!("{text}: must be {N} numbers").into())
}

fn parse() -> Outcome<Option<(Vec<String>, Options)>> {
    let mut options = Options::default();
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

/// A link that moves through the frames, and the node that shows it.
struct Track {
    link: LinkId,
    node: usize,
    times: Vec<f64>,
    poses: Vec<Pose>,
}

/// Shows a body's coat as it is now, undeformed, on the links that carry it: one alone as a node, several as the joints of a
/// skin. Nothing for an empty mesh.
fn bind(glb: &mut glb::Glb, world: &World, body: BodyId, cell_size: f64, colour: usize) -> Outcome<Vec<Track>> {
    let mesh = world.mesh(body, &MeshDesc::new(cell_size))?;
    let links: Vec<LinkId> = world.body_links(body)?.collect();
    let poses = links.iter().map(|link| Ok(world.link_state(*link)?.pose)).collect::<Outcome<Vec<_>>>()?;
    let track = |(link, node)| Track { link, node, times: Vec::new(), poses: Vec::new() };
    if let ([link], [pose]) = (&links[..], &poses[..]) {
        let mesh = glb.mesh(&mesh, pose, colour);
        return Ok(mesh.into_iter().map(|mesh| track((*link, glb.node(&name(body), mesh, pose)))).collect());
    }
    let Some(shown) = glb.mesh(&mesh, &Pose::default(), colour) else { return Ok(Vec::new()) };
    let (joints, weights) = joint_weights(world, body, &mesh, &links)?;
    glb.hang(shown, &joints, &weights);
    let joint = |(link, pose): (&LinkId, &Pose)| glb.joint(&format!("{} link{}", name(body), link.raw.index), pose);
    let nodes: Vec<usize> = links.iter().zip(&poses).map(joint).collect();
    glb.skin(&name(body), shown, &nodes, &poses);
    Ok(links.into_iter().zip(nodes).map(track).collect())
}

/// Of each vertex up to four joints, and their weights.
type JointWeights = (Vec<[u16; 4]>, Vec<[f32; 4]>);

/// Up to four links of each vertex, by their numbers, with their weights: those of their skeletons together.
fn joint_weights(world: &World, body: BodyId, mesh: &Mesh, links: &[LinkId]) -> Outcome<JointWeights> {
    let mut of = Weights::default();
    world.mesh_weights(body, &mesh.positions, &mut of)?;
    let (mut joints, mut weights) = (Vec::new(), Vec::new());
    for (skeletons, parts) in of.skeletons.iter().zip(&of.weights) {
        let (mut numbers, mut sums, mut count) = ([0; 4], [0.0; 4], 0);
        for (skeleton, part) in skeletons.iter().zip(parts).filter(|(_, part)| **part > 0.0) {
            let link = world.skeleton_link(*skeleton)?;
            let number = links.iter().position(|other| *other == link).ok_or("a skeleton's link is not of its body")?;
            let number = u16::try_from(number).map_err(|_| "a skin has at most 65536 joints")?;
            let at = numbers[..count].iter().position(|other| *other == number).unwrap_or(count);
            count = count.max(at + 1);
            numbers[at] = number;
            sums[at] += *part as f32;
        }
        joints.push(numbers);
        weights.push(sums);
    }
    Ok((joints, weights))
}

fn animate(playback: &mut Playback, list: &[u32], options: &Options, output: &Path) -> Outcome<()> {
    let (mut glb, mut bound, mut tracks) = (glb::Glb::new(), Vec::<BodyId>::new(), Vec::<Track>::new());
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
            } else if !bound.contains(&body) {
                let made = bind(&mut glb, world, body, desc.cell_size, colour)?;
                bound.extend((!made.is_empty()).then_some(body));
                tracks.extend(made);
            }
        }
        for Track { link, times, poses, .. } in &mut tracks {
            if let Ok(state) = world.link_state(*link) {
                times.push(time);
                poses.push(state.pose);
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

#[cfg(test)]
mod tests {
    use super::*;
    use isocoat::world::{BodyDesc, LinkDesc, Recorder, RecorderDesc, SkeletonDesc, WorldDesc};
    use nalgebra::{Matrix4, Point3, Quaternion, Translation3, UnitQuaternion};

    const TIMES: [f64; 3] = [0.0, 0.5, 1.0];

    /// An arm of two links, of which the second turns by half a right angle a frame, and a ball that flies.
    fn arm_and_ball(frame: usize, world: &mut World, links: &[LinkId]) {
        let angle = std::f64::consts::FRAC_PI_4 * frame as f64;
        let mut state = world.link_state(links[1]).unwrap();
        state.pose.rotation = UnitQuaternion::from_axis_angle(&Vec3::y_axis(), angle);
        world.set_link_state(links[1], &state).unwrap();
        let mut state = world.link_state(links[2]).unwrap();
        state.pose.position = Vec3::new(0.0, 1.0, frame as f64);
        world.set_link_state(links[2], &state).unwrap();
    }

    fn recording() -> Playback {
        let mut world = World::new(WorldDesc::default()).unwrap();
        let (arm, ball) =
            (world.create_body(BodyDesc::default()).unwrap(), world.create_body(BodyDesc::default()).unwrap());
        let mut links = Vec::new();
        for (body, place, shape) in [
            (arm, Pose::default(), Shape::segment(Vec3::zeros(), Vec3::new(0.4, 0.0, 0.0))),
            (arm, Pose::at(0.4, 0.0, 0.0), Shape::segment(Vec3::zeros(), Vec3::new(0.4, 0.0, 0.0))),
            (ball, Pose::at(0.0, 1.0, 0.0), Shape::Point(Vec3::zeros())),
        ] {
            let link = world.create_link(body, LinkDesc { pose: place, ..LinkDesc::default() }).unwrap();
            world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.1, ..SkeletonDesc::default() }).unwrap();
            links.push(link);
        }
        let mut recorder = Recorder::new(RecorderDesc::default()).unwrap();
        for (frame, time) in TIMES.into_iter().enumerate() {
            arm_and_ball(frame, &mut world, &links);
            recorder.capture(&world, time).unwrap();
        }
        Playback::open(recorder.bytes().unwrap()).unwrap()
    }

    /// The file of a recording, read back: the document and its binary part.
    fn animated(name: &str) -> (gltf::Gltf, Vec<u8>) {
        // Tests run side by side in one process.
        let path = std::env::temp_dir().join(format!("isocoat-view-{}-{name}.glb", std::process::id()));
        let options = Options { cell: Some(0.03), ..Options::default() };
        animate(&mut recording(), &[0, 1, 2], &options, &path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        let mut read = gltf::Gltf::from_slice(&bytes).unwrap();
        let blob = read.blob.take().unwrap();
        (read, blob)
    }

    fn matrix(translation: [f32; 3], [x, y, z, w]: [f32; 4]) -> Matrix4<f32> {
        let turn = UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z));
        Translation3::from(translation).to_homogeneous() * turn.to_homogeneous()
    }

    /// Where a node is at a key frame: by its channels, or where it rests.
    fn place(read: &gltf::Gltf, blob: &[u8], node: &gltf::Node, key: usize) -> Matrix4<f32> {
        let (mut translation, mut rotation, _) = node.transform().decomposed();
        for channel in read.animations().flat_map(|animation| animation.channels().collect::<Vec<_>>()) {
            if channel.target().node().index() != node.index() {
                continue;
            }
            let reader = channel.reader(|_| Some(blob));
            assert_eq!(reader.read_inputs().unwrap().collect::<Vec<_>>(), TIMES.map(|time| time as f32));
            match reader.read_outputs().unwrap() {
                gltf::animation::util::ReadOutputs::Translations(mut list) => translation = list.nth(key).unwrap(),
                gltf::animation::util::ReadOutputs::Rotations(list) => rotation = list.into_f32().nth(key).unwrap(),
                _ => panic!("links have one size"),
            }
        }
        matrix(translation, rotation)
    }

    #[test]
    fn a_body_of_many_links_is_one_mesh_that_its_joints_carry() {
        let (read, blob) = animated("skin");
        let node = read.nodes().find(|node| node.skin().is_some()).unwrap();
        let skin = node.skin().unwrap();
        let joints: Vec<_> = skin.joints().collect();
        let inverse: Vec<_> = skin.reader(|_| Some(&blob)).read_inverse_bind_matrices().unwrap().collect();
        assert_eq!((joints.len(), inverse.len()), (2, 2));
        let primitive = node.mesh().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|_| Some(&blob));
        let positions: Vec<_> = reader.read_positions().unwrap().map(Point3::<f32>::from).collect();
        let numbers: Vec<_> = reader.read_joints(0).unwrap().into_u16().collect();
        let weights: Vec<_> = reader.read_weights(0).unwrap().into_f32().collect();
        assert_eq!((numbers.len(), weights.len()), (positions.len(), positions.len()));
        let (mut mixed, mut turned) = (0, 0);
        for key in 0..TIMES.len() {
            let carried: Vec<Matrix4<f32>> = joints
                .iter()
                .zip(&inverse)
                .map(|(joint, inverse)| place(&read, &blob, joint, key) * Matrix4::from(*inverse))
                .collect();
            for ((p, numbers), weights) in positions.iter().zip(&numbers).zip(&weights) {
                assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                let parts = numbers.iter().zip(weights);
                let blend: Matrix4<f32> = parts.map(|(joint, weight)| carried[usize::from(*joint)] * *weight).sum();
                let moved = blend.transform_point(p);
                // As bound at the first key; later the end of the arm has turned about the elbow, the shoulder not.
                let angle = std::f32::consts::FRAC_PI_4 * key as f32;
                let turn = UnitQuaternion::from_axis_angle(&nalgebra::Vector3::y_axis(), angle);
                let elbow = nalgebra::Vector3::new(0.4, 0.0, 0.0);
                let expected = match p.x {
                    _ if key == 0 => *p,
                    x if x < 0.1 => *p,
                    x if x > 0.7 => turn * (p - elbow) + elbow,
                    _ => {
                        mixed += usize::from(weights[1] > 0.1);
                        continue;
                    }
                };
                turned += usize::from(key > 0 && p.x > 0.7);
                assert!((moved - expected).norm() < 1e-5, "key {key}: {p} {moved} {expected}");
            }
        }
        assert!(mixed > 50 && turned > 50, "{mixed} {turned}");
    }

    #[test]
    fn a_body_of_one_link_moves_as_a_node() {
        let (read, blob) = animated("node");
        let node = read.nodes().find(|node| node.mesh().is_some() && node.skin().is_none()).unwrap();
        for key in 0..TIMES.len() {
            let expected = matrix([0.0, 1.0, key as f32], [0.0, 0.0, 0.0, 1.0]);
            assert!((place(&read, &blob, &node, key) - expected).norm() < 1e-6);
        }
        let primitive = node.mesh().unwrap().primitives().next().unwrap();
        let positions = primitive.reader(|_| Some(&blob)).read_positions().unwrap();
        assert!(positions.into_iter().all(|p| (Point3::<f32>::from(p).coords.norm() - 0.1).abs() < 1e-4));
    }
}
