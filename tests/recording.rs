//! Recordings: what is played has the live surfaces to the bit, in any order of frames; what is damaged is refused, with
//! what is wrong and where; and a frame takes few bytes.

mod common;

use std::sync::{Arc, Mutex};
use std::time::Instant;

use common::{Coat, Random, ball_inertia};
use isocoat::base::Kind;
use isocoat::error::Error;
use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::world::mesh::MeshDesc;
use isocoat::world::rays::{Ray, RayGoal};
use isocoat::world::{
    BodyDesc, BodyId, Deformation, Fill, LinkDesc, Playback, Recorder, RecorderDesc, SkeletonDesc, SubstanceDesc,
    World, WorldDesc,
};
use proptest::prelude::*;

const DT: f64 = 1.0 / 60.0;
const G: f64 = 9.81;

fn world() -> World {
    World::new(WorldDesc { gravity: Vec3::new(0.0, 0.0, -G), ..WorldDesc::default() }).unwrap()
}

fn recorder(key_interval: u32) -> Recorder {
    Recorder::new(RecorderDesc { key_interval }).unwrap()
}

/// Bits of what rays, closest points and meshes see of a world, with all its deformations; the tags of handles are each
/// world's own.
fn sight(world: &World, cell_size: f64) -> Vec<u64> {
    let mut out = Vec::new();
    let vector = |out: &mut Vec<u64>, v: &Vec3| out.extend(v.iter().map(|x| x.to_bits()));
    let slot = |out: &mut Vec<u64>, raw: isocoat::handle::RawId| {
        out.push(u64::from(raw.index) << 16 | u64::from(raw.generation));
    };
    let mut random = Random(7);
    for deformation in [Deformation::None, Deformation::Contact, Deformation::Bulges] {
        let mut ready = world.sight(u64::MAX, deformation);
        for _ in 0..24 {
            let from = random.direction() * 3.0;
            let to = Vec3::from_fn(|_, _| random.range(-0.3, 0.3));
            let hit = world.cast_ray_deformed(&from, &(to - from), f64::INFINITY, u64::MAX, deformation).unwrap();
            let ray = Ray { origin: from, direction: to - from, max_distance: f64::INFINITY };
            assert_eq!(ready.cast_ray(&ray, RayGoal::Closest).unwrap(), hit);
            out.push(u64::from(hit.is_some()));
            if let Some(hit) = hit {
                slot(&mut out, hit.body.raw);
                slot(&mut out, hit.skeleton.raw);
                vector(&mut out, &hit.position);
                vector(&mut out, &hit.normal);
            }
        }
        for body in world.bodies() {
            let p = Vec3::from_fn(|_, _| random.range(-0.5, 0.5));
            if let Some(point) = world.closest_point_deformed(body, &p, deformation).unwrap() {
                vector(&mut out, &point.position);
                slot(&mut out, point.link.raw);
            }
            // A plane has none.
            if let Ok(mesh) = world.mesh(body, &MeshDesc { cell_size, deformation }) {
                out.extend(mesh.positions.iter().chain(&mesh.normals).flatten().map(|x| x.to_bits()));
                out.extend(mesh.triangles.iter().flatten().map(|corner| u64::from(*corner)));
            }
        }
    }
    for body in world.bodies() {
        for piece in world.pieces(body).unwrap_or_default() {
            out.extend([piece.volume.to_bits(), piece.mass.to_bits(), piece.particles.len() as u64]);
        }
        out.extend(world.body_volume(body).map(f64::to_bits));
    }
    out
}

/// Records a world at each tick, and plays it in order, backwards and at random.
fn plays_as_it_was(name: &str, mut world: World, ticks: u32, cell_size: f64, mut tick: impl FnMut(&mut World, u32)) {
    let mut recorder = recorder(7);
    let mut seen = Vec::new();
    for index in 0..ticks {
        recorder.capture(&world, f64::from(index) * DT).unwrap();
        seen.push(sight(&world, cell_size));
        tick(&mut world, index);
        world.step(DT).unwrap();
    }
    assert!(seen.windows(2).any(|pair| pair[0] != pair[1]), "{name}: nothing moves");
    let bytes = recorder.bytes().unwrap();
    println!("{name}: {} bytes for {ticks} frames", bytes.len());
    let mut playback = Playback::open(bytes).unwrap();
    assert_eq!(playback.frames(), ticks);
    let mut random = Random(3);
    let at_random: Vec<u32> = (0..ticks / 3).map(|_| (random.unit() * f64::from(ticks)) as u32).collect();
    for frame in (0..ticks).chain((0..ticks).rev().step_by(3)).chain(at_random) {
        assert_eq!(playback.time(frame).unwrap(), f64::from(frame) * DT);
        let shown = playback.seek(frame).unwrap();
        assert!(sight(shown, cell_size) == seen[frame as usize], "{name}: frame {frame} is not what was there");
        assert_eq!(playback.frame(), Some(frame));
    }
}

fn ground(world: &mut World) -> BodyId {
    let floor = Coat::floor(0.05).hard();
    let desc = BodyDesc { friction: 0.6, static_friction: 0.8, ..floor.body_desc() };
    floor.add(world, desc, LinkDesc { pose: Pose::at(0.0, 0.0, -0.05), ..LinkDesc::default() }).0
}

fn rigid(mass: f64, radius: f64, pose: Pose) -> LinkDesc {
    LinkDesc { kind: Kind::Rigid, mass, inertia: ball_inertia(mass, radius), pose, ..LinkDesc::default() }
}

/// Soft balls with bulges that fall on each other.
fn pile() -> World {
    let mut world = world();
    ground(&mut world);
    let ball = Coat::ball(0.1).stiff(2e3);
    let desc = BodyDesc { bulge_width: 0.5, bulge_height: 1.0, friction: 0.4, ..ball.body_desc() };
    for (x, z) in [(0.0, 0.11), (0.05, 0.31), (-0.12, 0.45)] {
        ball.add(&mut world, desc.clone(), rigid(0.5, 0.1, Pose::at(x, 0.02 * z, z)));
    }
    world
}

/// A body of three links that blend one by one, and keeps its volume.
fn arm() -> (World, Vec<isocoat::world::SkeletonId>) {
    let mut world = world();
    ground(&mut world);
    let body = world.create_body(BodyDesc { volume_gain: 0.4, stiffness_scale: 1e4, ..BodyDesc::default() }).unwrap();
    let skeletons = (0..3).map(|k| {
        let link = world.create_link(body, rigid(0.5, 0.1, Pose::at(0.16 * f64::from(k), 0.0, 0.12))).unwrap();
        let end = Vec3::new(0.06, 0.0, 0.0);
        let shape = Shape::Segment(-end, end);
        world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.08, ..SkeletonDesc::default() }).unwrap()
    });
    let skeletons = skeletons.collect();
    let links: Vec<_> = world.body_links(body).unwrap().collect();
    world.blend_neighbours(body, &[(links[0], links[1]), (links[1], links[2])]).unwrap();
    (world, skeletons)
}

/// A loaf over a wedge \[95, Fig. 6\], of about `228 (0.05 / spacing)³` particles.
fn loaf(spacing: f64, height: f64) -> (World, BodyId) {
    let mut world = world();
    ground(&mut world);
    let wedge = world
        .create_body(BodyDesc { rigid: true, friction: 0.1, static_friction: 0.1, ..BodyDesc::default() })
        .unwrap();
    let link = world.create_link(wedge, LinkDesc::default()).unwrap();
    for (x, z) in [(-0.5, -0.3), (0.5, -0.3)] {
        let shape = Shape::Triangle(Vec3::new(0.0, -1.0, 0.6), Vec3::new(0.0, 1.0, 0.6), Vec3::new(x, 0.0, z));
        world.create_skeleton(link, SkeletonDesc { shape, thickness: 0.02, ..SkeletonDesc::default() }).unwrap();
    }
    let body = world
        .create_body(BodyDesc {
            stiffness_scale: 2e4,
            friction: 0.6,
            static_friction: 0.8,
            bulge_width: 0.3,
            bulge_height: 0.5,
            ..BodyDesc::default()
        })
        .unwrap();
    let particle_mass = 1000.0 * spacing.powi(3) / 2.0_f64.sqrt();
    let desc = SubstanceDesc {
        spacing,
        particle_mass,
        cohesion: 4.0 * particle_mass * G * spacing,
        damping: 1.0,
        ..SubstanceDesc::default()
    };
    world.make_substance(body, desc).unwrap();
    let (low, high) = (Vec3::new(-0.25, -0.15, height), Vec3::new(0.25, 0.15, height + 0.2));
    world.fill_substance(body, &Fill::Box { low, high }).unwrap();
    (world, body)
}

#[test]
fn frames_of_solids_in_contact_are_seen_as_they_were_bit_for_bit() {
    plays_as_it_was("pile", pile(), 40, 0.05, |_, _| {});
}

#[test]
fn frames_of_blends_and_volumes_under_way_are_seen_as_they_were_bit_for_bit() {
    let (world, skeletons) = arm();
    plays_as_it_was("arm", world, 36, 0.06, |world, tick| match tick {
        4 => world.set_blend(skeletons[0], skeletons[1], 0.0, 0.3).unwrap(),
        12 => world.set_skeleton_target_volume(skeletons[2], 0.006).unwrap(),
        20 => world.set_blend(skeletons[0], skeletons[2], 0.5, 0.2).unwrap(),
        _ => {}
    });
}

#[test]
fn frames_of_a_loaf_that_splits_on_a_wedge_are_seen_as_they_were_bit_for_bit() {
    let (world, body) = loaf(0.07, 0.6);
    let mut bonds = false;
    plays_as_it_was("loaf", world, 50, 0.12, |world, _| bonds |= !world.substance_changes(body).unwrap().is_empty());
    assert!(bonds, "it never split");
}

#[test]
fn frames_between_changes_of_structure_are_seen_as_they_were_bit_for_bit() {
    let mut made = Vec::new();
    plays_as_it_was("changes", pile(), 34, 0.06, move |world, tick| {
        let bodies: Vec<BodyId> = world.bodies().collect();
        let ball = Coat::ball(0.07).stiff(2e3);
        match tick {
            3 => made.push(ball.add(world, ball.body_desc(), rigid(0.2, 0.07, Pose::at(0.2, 0.1, 0.4))).0),
            8 => world.destroy_body(bodies[2]).unwrap(),
            // In the slot of the one that went.
            11 => made.push(ball.add(world, ball.body_desc(), rigid(0.2, 0.07, Pose::at(-0.2, 0.1, 0.3))).0),
            14 => world.set_body_enabled(made[0], false).unwrap(),
            17 => {
                world.set_body_enabled(made[0], true).unwrap();
                let desc = BodyDesc { isovalue: 0.8, bulge_width: 0.9, ..world.body_desc(made[1]).unwrap().clone() };
                world.set_body_desc(made[1], desc).unwrap();
            }
            20 => {
                let clay = world.create_body(BodyDesc { stiffness_scale: 2e3, ..BodyDesc::default() }).unwrap();
                world.make_substance(clay, SubstanceDesc { particle_mass: 0.1, ..SubstanceDesc::default() }).unwrap();
                world.add_particles(clay, &[[0.3, 0.3, 0.1], [0.4, 0.3, 0.1], [0.35, 0.38, 0.1]], None).unwrap();
                made.push(clay);
            }
            24 => {
                let first = world.particles(made[2]).unwrap()[0].id;
                world.remove_particles(made[2], &[first]).unwrap();
                world.add_particles(made[2], &[[0.3, 0.3, 0.3]], None).unwrap();
            }
            _ => {}
        }
    });
}

#[test]
fn handles_mean_the_recorded_objects_in_every_frame() {
    let mut world = pile();
    let mut recorder = recorder(4);
    recorder.capture(&world, 0.0).unwrap();
    let late = world.create_body(BodyDesc { user_data: 77, ..BodyDesc::default() }).unwrap();
    recorder.capture(&world, 0.0).unwrap();
    let mut playback = Playback::open(recorder.bytes().unwrap()).unwrap();
    assert_eq!(playback.world().bodies().count(), 0);
    let early: Vec<BodyId> = playback.seek(0).unwrap().bodies().collect();
    let shown = playback.seek(1).unwrap();
    assert!(early.iter().all(|body| shown.body_desc(*body).is_ok()));
    let played = shown.bodies().last().unwrap();
    assert_eq!((played.raw.index, played.raw.generation), (late.raw.index, late.raw.generation));
    assert_ne!(played.raw.world, late.raw.world);
    assert_eq!(shown.body_desc(played).unwrap().user_data, 77);
    assert!(playback.seek(0).unwrap().body_desc(played).is_err());
    assert!(playback.world().body_desc(late).is_err());
}

#[test]
fn a_snapshot_of_a_frame_steps_on_from_rest() {
    let (mut world, _) = loaf(0.1, 0.62);
    let mut recorder = recorder(60);
    for tick in 0..20 {
        world.step(DT).unwrap();
        recorder.capture(&world, f64::from(tick)).unwrap();
    }
    let mut playback = Playback::open(recorder.bytes().unwrap()).unwrap();
    let mut snapshot = Vec::new();
    let shown = playback.seek(19).unwrap();
    shown.snapshot(&mut snapshot);
    let mut other = World::new(WorldDesc::default()).unwrap();
    other.restore(&snapshot).unwrap();
    assert!(sight(&other, 0.15) == sight(shown, 0.15));
    let body = other.bodies().last().unwrap();
    assert!(other.particles(body).unwrap().iter().all(|particle| particle.velocity == Vec3::zeros()));
    other.add_particles(body, &[[0.0, 0.0, 2.0]], None).unwrap();
    (0..20).for_each(|_| other.step(DT).unwrap());
}

#[test]
fn a_stream_gets_what_memory_has() {
    let mut world = pile();
    let streamed = Arc::new(Mutex::new(Vec::new()));
    let into = streamed.clone();
    let take = move |bytes: &[u8]| {
        into.lock().unwrap().extend_from_slice(bytes);
        Ok(())
    };
    let mut stream = Recorder::to_stream(RecorderDesc::default(), Box::new(take)).unwrap();
    let mut memory = recorder(60);
    for tick in 0..10 {
        world.step(DT).unwrap();
        let time = f64::from(tick) * DT;
        stream.capture(&world, time).unwrap();
        memory.capture(&world, time).unwrap();
        assert_eq!(streamed.lock().unwrap().len() as u64, stream.size());
        // What memory has is a recording at any time.
        assert_eq!(Playback::open(memory.bytes().unwrap()).unwrap().frames(), memory.frames());
    }
    let message = Playback::open(streamed.lock().unwrap().clone()).err().unwrap().to_string();
    assert!(message.contains("never finished") && message.contains("10 frames are whole"), "{message}");
    stream.finish().unwrap();
    assert!(*streamed.lock().unwrap() == memory.bytes().unwrap());
    assert!(stream.capture(&world, 1.0).is_err() && stream.finish().is_err() && stream.bytes().is_err());
    assert!(memory.finish().is_err());
    // Times do not go back.
    let message = memory.capture(&world, 0.0).unwrap_err().to_string();
    assert!(message.contains("time of a frame is 0"), "{message}");
    assert_eq!(memory.frames(), 10);
    // Nothing recorded is a recording too.
    let mut empty = Playback::open(recorder(60).bytes().unwrap()).unwrap();
    assert_eq!(empty.frames(), 0);
    assert!(empty.seek(0).is_err());
}

#[test]
fn a_stream_that_fails_says_where_and_takes_no_more() {
    let world = pile();
    let mut calls = 0;
    let take = move |_: &[u8]| {
        calls += 1;
        if calls < 3 { Ok(()) } else { Err("the disk is full".to_owned()) }
    };
    let mut recorder = Recorder::to_stream(RecorderDesc::default(), Box::new(take)).unwrap();
    recorder.capture(&world, 0.0).unwrap();
    recorder.capture(&world, 1.0).unwrap();
    let at = recorder.size();
    let error = recorder.capture(&world, 2.0).unwrap_err();
    assert!(matches!(error, Error::Stream(_)));
    assert_eq!(error.to_string(), format!("the recording's stream failed at byte {at}: the disk is full"));
    assert!(recorder.capture(&world, 3.0).is_err() && recorder.frames() == 2);
    assert!(Recorder::new(RecorderDesc { key_interval: 0 }).is_err());
}

/// A small recording with everything in it: two structures, frames by themselves and others, bonds.
fn small() -> Vec<u8> {
    let mut world = world();
    let body = world.create_body(BodyDesc::default()).unwrap();
    world
        .make_substance(body, SubstanceDesc { fusion_threshold: 0.0, blend_time: 1.0, ..SubstanceDesc::default() })
        .unwrap();
    world.add_particles(body, &[[0.0; 3]], Some(&[[1.0, 0.0, 0.0]])).unwrap();
    world.add_particles(body, &[[0.09, 0.0, 0.0]], None).unwrap();
    let mut recorder = recorder(3);
    for tick in 0..6 {
        world.step(DT).unwrap();
        recorder.capture(&world, f64::from(tick) * DT).unwrap();
    }
    Coat::ball(0.1).add_fixed(&mut world, Pose::at(1.0, 0.0, 0.0));
    recorder.capture(&world, 1.0).unwrap();
    recorder.bytes().unwrap()
}

fn refusal(bytes: Vec<u8>) -> String {
    match Playback::open(bytes) {
        Err(Error::Recording(why)) => why,
        Err(other) => panic!("refused as {other}"),
        Ok(_) => panic!("it was taken"),
    }
}

#[test]
fn what_is_cut_short_is_refused_at_every_length_with_where() {
    let whole = small();
    println!("{} bytes", whole.len());
    for length in 0..whole.len() {
        let why = refusal(whole[..length].to_vec());
        assert!(why.contains("byte") || length == 0, "{length}: {why}");
    }
    let mut longer = whole.clone();
    longer.push(0);
    assert!(refusal(longer).contains("end is missing"));
}

#[test]
fn a_frame_that_is_altered_is_named() {
    let whole = small();
    let mut altered = whole.clone();
    let at = whole.len() / 2;
    altered[at] ^= 1;
    let why = refusal(altered);
    assert!(why.contains("checksum is") && why.contains(" at byte "), "{why}");
    let mut other = whole.clone();
    other[8] = 9;
    let checksum = crc32fast::hash(&other[..24]);
    other[24..28].copy_from_slice(&checksum.to_le_bytes());
    assert!(refusal(other).contains("its format is 9, written by version"));
}

/// The chunks of a recording as the format says: where each begins, its kind and where its content is.
fn chunks(bytes: &[u8]) -> Vec<(usize, u8, std::ops::Range<usize>)> {
    let (mut at, mut list) = (28, Vec::new());
    while at < bytes.len() - 16 {
        let length = u32::from_le_bytes(bytes[at + 1..at + 5].try_into().unwrap()) as usize;
        list.push((at, bytes[at], at + 5..at + 5 + length));
        at += length + 9;
    }
    list
}

/// Writes a checksum that fits what was altered.
fn seal(bytes: &mut [u8], number: usize) {
    let (at, _, content) = chunks(bytes)[number].clone();
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&(number as u64).to_le_bytes());
    hasher.update(&bytes[at..content.end]);
    let checksum = hasher.finalize();
    bytes[content.end..content.end + 4].copy_from_slice(&checksum.to_le_bytes());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn any_altered_byte_is_refused(at in any::<prop::sample::Index>(), by in 1..=255_u8) {
        static SMALL: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();
        let mut bytes = SMALL.get_or_init(small).clone();
        let at = at.index(bytes.len());
        bytes[at] ^= by;
        let why = refusal(bytes);
        prop_assert!(why.contains("must be") || why.contains("byte"), "{}", why);
    }

    #[test]
    fn a_frame_forged_with_its_checksum_is_shown_or_refused_and_changes_nothing(
        number in 1..7_usize, at in any::<prop::sample::Index>(), byte in any::<u8>()
    ) {
        static SMALL: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();
        let whole = SMALL.get_or_init(small);
        let mut bytes = whole.clone();
        let content = chunks(&bytes)[number].2.clone();
        bytes[content.start + at.index(content.len())] = byte;
        seal(&mut bytes, number);
        let mut playback = Playback::open(bytes).unwrap();
        let frame = number as u32 - 1;
        let before = if frame == 0 { Vec::new() } else {
            playback.seek(frame - 1).map(|world| sight(world, 0.1)).unwrap_or_default()
        };
        match playback.seek(frame) {
            Ok(world) => { sight(world, 0.5); }
            Err(error) => {
                let why = error.to_string();
                prop_assert!(why.contains(&format!("frame {frame} at byte")), "{}", why);
                if frame > 0 {
                    prop_assert_eq!(playback.frame(), Some(frame - 1));
                    prop_assert!(sight(playback.world(), 0.1) == before);
                }
            }
        }
    }

    #[test]
    fn any_bytes_are_refused_without_a_panic(mut bytes in prop::collection::vec(any::<u8>(), 0..200), header in any::<bool>()) {
        if header {
            static SMALL: std::sync::OnceLock<Vec<u8>> = std::sync::OnceLock::new();
            bytes.splice(0..0, SMALL.get_or_init(small)[..28].iter().copied());
        }
        refusal(bytes);
    }
}

/// Records a loaf of about a thousand particles that falls on a wedge. Gives bytes a particle and frame: in all, and of
/// the frames alone.
fn record_loaf(frames: u32) -> (f64, f64) {
    let (mut world, body) = loaf(0.03, 0.62);
    let count = world.particles(body).unwrap().len();
    let mut recorder = Recorder::new(RecorderDesc::default()).unwrap();
    let (mut spent, mut splits) = (0.0, 0);
    for tick in 0..frames {
        world.step(DT).unwrap();
        splits += world.substance_changes(body).unwrap().len();
        let start = Instant::now();
        recorder.capture(&world, f64::from(tick) * DT).unwrap();
        spent += start.elapsed().as_secs_f64();
    }
    let bytes = recorder.bytes().unwrap();
    let per = |bytes: usize| bytes as f64 / f64::from(frames) / count as f64;
    let each = per(bytes.len());
    let alone =
        per(chunks(&bytes).iter().filter(|(_, kind, _)| matches!(kind, 1 | 2)).map(|(_, _, at)| at.len() + 9).sum());
    let start = Instant::now();
    let mut playback = Playback::open(bytes).unwrap();
    let opened = start.elapsed().as_secs_f64();
    let start = Instant::now();
    for frame in 0..frames {
        playback.seek(frame).unwrap();
    }
    let played = start.elapsed().as_secs_f64();
    let (mut random, mut worst) = (Random(1), 0.0_f64);
    for _ in 0..50 {
        let start = Instant::now();
        playback.seek((random.unit() * f64::from(frames)) as u32).unwrap();
        worst = worst.max(start.elapsed().as_secs_f64());
    }
    println!(
        "{count} particles, {frames} frames, {splits} changes: {each:.2} bytes a particle and frame, {alone:.2} \
         without the structure; {:.3} ms to record a \
         frame, {:.1} ms to open all, {:.3} ms for the next frame, at most {:.2} ms for any",
        1e3 * spent / f64::from(frames),
        1e3 * opened,
        1e3 * played / f64::from(frames),
        1e3 * worst
    );
    let last = playback.seek(frames - 1).unwrap();
    let shown = last.particles(last.bodies().last().unwrap()).unwrap();
    let live = world.particles(body).unwrap();
    let same = |(a, b): (&isocoat::world::Particle, &isocoat::world::Particle)| {
        (a.id, a.position, a.offset, a.volume, a.label, a.piece)
            == (b.id, b.position, b.offset, b.volume, b.label, b.piece)
    };
    assert!(live.len() == shown.len() && live.iter().zip(shown).all(same));
    (each, alone)
}

#[test]
fn frames_of_a_loaf_take_at_most_33_bytes_a_particle() {
    let (_, alone) = record_loaf(60);
    assert!(alone <= 33.0, "{alone}");
}

#[test]
#[ignore = "takes minutes; `make recording` runs it"]
fn ten_seconds_of_a_loaf_take_at_most_33_bytes_a_particle_and_frame() {
    let (each, _) = record_loaf(600);
    assert!(each <= 33.0, "{each}");
}
