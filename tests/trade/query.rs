//! Errors of force and torque of a single query, scheme by scheme, on poses from the scenes and on blended pairs.

use isocoat::field::Shape;
use isocoat::math::{Pose, Vec3};
use isocoat::world::{BodyId, Scheme, World, WorldDesc};

use super::clock::time_of;
use super::common::oracle::Oracle;
use super::common::{Coat, Random, total};
use super::sim::{Record, Scene, Settings, Sim};

/// What a scheme costs, and what its forces are worth.
#[derive(Clone, Copy, Debug)]
pub struct Cost {
    /// Root mean square of the force's error over the poses, each over its force.
    pub force: f64,
    /// The largest of them.
    pub worst: f64,
    /// Root mean square of the torque's error, over force times the radius of a ball.
    pub torque: f64,
    pub evaluations: f64,
    /// Processor time of a query, mean over the poses \[s\].
    pub time: f64,
}

/// Schemes and tolerances that are compared; of seeds only the count matters.
pub fn schemes() -> Vec<Settings> {
    let mut all = Vec::new();
    for tolerance in [1e-1, 3e-2, 1e-2, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5] {
        for scheme in [Scheme::Auto, Scheme::Polar, Scheme::Facets, Scheme::Adaptive] {
            all.push(Settings { scheme, tolerance, ..Settings::default() });
        }
    }
    for seeds in [64, 256, 1024, 4096, 16384] {
        all.push(Settings { scheme: Scheme::Seeds, seeds, ..Settings::default() });
    }
    all
}

/// Frames of a record in which something touches, few enough to be queried in many ways.
fn touching(scene: &Scene, record: &Record) -> Vec<usize> {
    let mut sim = scene.sim(&Settings::default());
    let compared = (scene.horizon / super::sim::FRAME) as usize;
    let touches = |frame: &usize| {
        sim.place(&record.frames[*frame]);
        let pairs = sim.pairs();
        pairs.into_iter().any(|pair| sim.wrench(pair, Scheme::Auto, 1e-2).0.norm() > 0.0)
    };
    let all: Vec<usize> = (1..=compared).filter(touches).collect();
    let wanted = if record.frames[0].len() > 2 { 2 } else { 8 };
    let step = all.len().div_ceil(wanted);
    all.into_iter().step_by(step.max(1)).collect()
}

/// Costs of all `schemes` over the contacts of a scene's reference.
pub fn costs(scene: &Scene, record: &Record, schemes: &[Settings]) -> Vec<Cost> {
    let frames = touching(scene, record);
    let mut truth = scene.sim(&Settings::default());
    // The contacts, with what they truly press. Grazing ones do nothing in the scene.
    let mut poses: Vec<(usize, [usize; 2], (Vec3, Vec3))> = Vec::new();
    for frame in frames {
        truth.place(&record.frames[frame]);
        let wrench = |pair| (frame, pair, truth.wrench(pair, Scheme::Auto, 1e-8));
        poses.extend(truth.pairs().into_iter().map(wrench));
    }
    let most = poses.iter().map(|(.., (force, _))| force.norm()).fold(0.0, f64::max);
    poses.retain(|(.., (force, _))| force.norm() > 0.01 * most);
    assert!(!poses.is_empty(), "nothing touches in {}", scene.name);
    let cost = |settings: &Settings| {
        let mut sim = scene.sim(settings);
        let each = poses.iter().map(|(frame, pair, truth)| {
            sim.place(&record.frames[*frame]);
            measure(&sim, *pair, settings, *truth)
        });
        mean(&each.collect::<Vec<_>>())
    };
    schemes.iter().map(cost).collect()
}

fn measure(sim: &Sim, pair: [usize; 2], settings: &Settings, truth: (Vec3, Vec3)) -> Cost {
    let query = || sim.collide(pair, settings.scheme, settings.tolerance);
    let (force, torque) = sim.wrench(pair, settings.scheme, settings.tolerance);
    let scale = truth.0.norm();
    let off = (force - truth.0).norm() / scale;
    Cost {
        force: off,
        worst: off,
        torque: (torque - truth.1).norm() / (scale * super::sim::RADIUS),
        evaluations: query().iter().map(|contact| f64::from(contact.evaluations)).sum(),
        time: time_of(query),
    }
}

fn mean(each: &[Cost]) -> Cost {
    let n = each.len() as f64;
    let sum = |value: fn(&Cost) -> f64| each.iter().map(value).sum::<f64>() / n;
    Cost {
        force: sum(|c| c.force * c.force).sqrt(),
        worst: each.iter().map(|c| c.worst).fold(0.0, f64::max),
        torque: sum(|c| c.torque * c.torque).sqrt(),
        evaluations: sum(|c| c.evaluations),
        time: sum(|c| c.time),
    }
}

/// Two blended coats in some poses, with the forces that brute force finds.
pub struct Blended {
    pub name: &'static str,
    coats: [Coat; 2],
    poses: Vec<([Pose; 2], Vec3)>,
    /// Largest difference of brute force with half the lines, over the force.
    pub doubt: f64,
}

fn points(at: &[[f64; 3]], thickness: f64) -> Coat {
    Coat::new(&at.iter().map(|p| Shape::Point(Vec3::from(*p))).collect::<Vec<_>>(), thickness)
}

/// Four balls blended.
fn clover() -> Coat {
    points(&[[0.1, 0.1, 0.0], [-0.1, 0.1, 0.0], [-0.1, -0.1, 0.0], [0.1, -0.1, 0.0]], 0.1)
}

/// Two steps of a stair, blended from boxes.
fn stair() -> Coat {
    let step = |x: f64, z: f64, half: Vec3| {
        let axes = isocoat::math::Mat3::identity();
        Shape::Box { center: Vec3::new(x, 0.0, z), half, axes }
    };
    let half = Vec3::new(0.25, 0.25, 0.08);
    Coat::new(&[step(0.0, 0.0, half), step(-0.25, 0.16, Vec3::new(0.25, 0.25, 0.08))], 0.04)
}

fn world_of(coats: &[Coat; 2], poses: &[Pose; 2], seeds: u32) -> (World, [BodyId; 2]) {
    let mut world = World::new(WorldDesc { seed_count: seeds, ..WorldDesc::default() }).unwrap();
    let bodies = [0, 1].map(|i| coats[i].add_fixed(&mut world, poses[i]).0);
    (world, bodies)
}

/// A pair at random poses: the second turned anyhow, come from `from(random)` until it touches, and pressed on.
fn blended(
    name: &'static str,
    coats: [Coat; 2],
    from: fn(&mut Random) -> (Vec3, Vec3),
    count: usize,
    lines: usize,
) -> Blended {
    let mut random = Random(11);
    let press = |_| {
        let (start, direction) = from(&mut random);
        let rotation = random.rotation();
        let at = |s: f64| [Pose::default(), Pose { position: start + direction * s, rotation }];
        let touch = |s: f64| {
            let (world, [a, b]) = world_of(&coats, &at(s), 64);
            !world.collide(a, b, Scheme::Auto, 1e-2).unwrap().is_empty()
        };
        let (mut apart, mut touching) = (0.0, 0.0);
        while !touch(touching) {
            apart = touching;
            touching += 0.01;
        }
        for _ in 0..30 {
            let middle = 0.5 * (apart + touching);
            *(if touch(middle) { &mut touching } else { &mut apart }) = middle;
        }
        at(touching + random.range(0.05, 0.3) * coats[0].thickness.min(coats[1].thickness))
    };
    let poses: Vec<[Pose; 2]> = (0..count).map(press).collect();
    let force =
        |poses: &[Pose; 2], lines| Oracle::new((&coats[0], poses[0]), (&coats[1], poses[1])).force_by(lines, 96);
    // It is slow, and nobody looks at the clock.
    let forces: Vec<(Vec3, Vec3)> = std::thread::scope(|scope| {
        let each = poses.iter().map(|at| scope.spawn(|| (force(at, lines), force(at, lines / 2))));
        each.collect::<Vec<_>>().into_iter().map(|thread| thread.join().unwrap()).collect()
    });
    let doubt = forces.iter().map(|(fine, coarse)| (fine - coarse).norm() / fine.norm()).fold(0.0, f64::max);
    let poses = poses.into_iter().zip(forces).map(|(at, (force, _))| (at, force)).collect();
    Blended { name, coats, poses, doubt }
}

/// The blended pairs, at `count` poses each, their forces by `lines` by `lines` lines along each axis.
pub fn blended_pairs(count: usize, lines: usize) -> Vec<Blended> {
    let dumbbell = points(&[[-0.12, 0.0, 0.0], [0.12, 0.0, 0.0]], 0.1);
    let round = |random: &mut Random| {
        let direction = random.direction();
        (-0.6 * direction + 0.05 * random.direction(), direction)
    };
    // On the lower tread, into the corner of tread and riser, over the edge.
    let on_stair = |random: &mut Random| {
        let goal = Vec3::new(random.range(-0.05, 0.25), random.range(-0.1, 0.1), 0.1);
        let direction = Vec3::new(random.range(-1.0, 0.0), 0.0, -1.0).normalize();
        (goal - 0.6 * direction, direction)
    };
    vec![
        blended("dumbbell-dumbbell", [dumbbell.clone().stiff(1e5), dumbbell.stiff(3e5)], round, count, lines),
        blended("clover-step", [stair().stiff(3e5), clover().stiff(1e5)], on_stair, count, lines),
    ]
}

impl Blended {
    pub fn count(&self) -> usize {
        self.poses.len()
    }

    pub fn cost(&self, settings: &Settings) -> Cost {
        let each = self.poses.iter().map(|(poses, truth)| {
            let (world, [a, b]) = world_of(&self.coats, poses, settings.seeds);
            let query = || world.collide(a, b, settings.scheme, settings.tolerance).unwrap();
            let contacts = query();
            let off = (total(&contacts) - truth).norm() / truth.norm();
            Cost {
                force: off,
                worst: off,
                torque: f64::NAN,
                evaluations: contacts.iter().map(|contact| f64::from(contact.evaluations)).sum(),
                time: time_of(query),
            }
        });
        mean(&each.collect::<Vec<_>>())
    }
}
