//! Volumes, against Steiner's formula and brute force, and their control: what coats gain and lose where they blend and
//! part is taken back, at every size and step, and a muscle flexes to the volume it is told.

mod common;

use std::f64::consts::PI;

use common::pool::Pool;
use common::{Coat, DT, G, ball_inertia, oracle};
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Twist, Vec3, rotation_from_vector};
use isocoat::world::{
    BodyDesc, BodyId, LinkDesc, LinkId, LinkState, Scheme, SkeletonDesc, SkeletonId, World, WorldDesc,
};

/// A body whose links the host moves, each with some shapes.
struct Limb {
    world: World,
    body: BodyId,
    links: Vec<LinkId>,
    skeletons: Vec<SkeletonId>,
}

impl Limb {
    fn new(gain: f64, thickness: f64, radius: f64, links: &[Vec<Shape>]) -> Self {
        let mut world = World::new(WorldDesc::default()).unwrap();
        let body = world.create_body(BodyDesc { volume_gain: gain, ..BodyDesc::default() }).unwrap();
        let mut limb = Limb { world, body, links: Vec::new(), skeletons: Vec::new() };
        for shapes in links {
            let desc = LinkDesc { kind: Kind::Host, ..LinkDesc::default() };
            let link = limb.world.create_link(body, desc).unwrap();
            limb.links.push(link);
            for shape in shapes {
                let desc = SkeletonDesc { shape: *shape, thickness, radius, ..SkeletonDesc::default() };
                limb.skeletons.push(limb.world.create_skeleton(link, desc).unwrap());
            }
        }
        limb
    }

    fn place(&mut self, link: usize, pose: Pose) {
        self.world.set_link_state(self.links[link], &LinkState { pose, twist: Twist::default() }).unwrap();
    }

    fn total(&self) -> f64 {
        self.world.body_volume(self.body).unwrap()
    }

    fn volumes(&self) -> Vec<f64> {
        self.skeletons.iter().map(|id| self.world.skeleton_volume(*id).unwrap()).collect()
    }

    fn offsets(&self) -> Vec<f64> {
        self.skeletons.iter().map(|id| self.world.skeleton_offset(*id).unwrap()).collect()
    }

    /// Volumes of the territories by brute force, as the coat is now.
    fn counted(&self, n: usize) -> Vec<f64> {
        let placed = |id: &SkeletonId| {
            let profile = self.world.skeleton_profile(*id).unwrap();
            let pose = self.world.link_state(self.world.skeleton_link(*id).unwrap()).unwrap().pose;
            (self.world.skeleton_desc(*id).unwrap().shape.transformed(&pose), profile.thickness, profile.radius)
        };
        oracle::territories(&self.skeletons.iter().map(placed).collect::<Vec<_>>(), n)
    }
}

fn point(x: f64, y: f64) -> Shape {
    Shape::Point(Vec3::new(x, y, 0.0))
}

fn blob() -> Vec<Shape> {
    vec![point(0.0, 0.0), point(0.8, 0.0), point(0.0, 0.8), point(0.8, 0.8)]
}

#[test]
fn isolated_coats_have_the_volume_of_steiners_formula() {
    let (a, b, c) = (Vec3::new(0.1, 0.2, -0.3), Vec3::new(0.7, 0.1, 0.2), Vec3::new(-0.2, 0.9, 0.4));
    let axes = *rotation_from_vector(&Vec3::new(0.3, -1.0, 0.7)).to_rotation_matrix().matrix();
    let half = Vec3::new(0.3, 0.2, 0.5);
    let perimeter = (b - a).norm() + (c - b).norm() + (a - c).norm();
    let edges = 8.0 * (half.x * half.y + half.y * half.z + half.z * half.x);
    for (shape, [core, area, mean]) in [
        (Shape::Point(a), [0.0; 3]),
        (Shape::segment(a, b), [0.0, 0.0, PI * (b - a).norm()]),
        (Shape::triangle(a, b, c), [0.0, (b - a).cross(&(c - a)).norm(), 0.5 * PI * perimeter]),
        (Shape::Box { center: a, half, axes }, [8.0 * half.product(), edges, 2.0 * PI * half.sum()]),
    ] {
        let t = 0.25;
        let mut limb = Limb::new(0.0, t, 0.0, &[vec![shape]]);
        limb.place(0, Pose { position: Vec3::new(3.0, 1.0, -2.0), rotation: rotation_from_vector(&c) });
        let exact = core + area * t + mean * t * t + 4.0 / 3.0 * PI * t.powi(3);
        assert!((limb.total() / exact - 1.0).abs() < 1e-12, "{shape:?}");
        assert_eq!(limb.total(), limb.volumes()[0]);
    }
}

#[test]
fn volumes_of_blends_agree_with_brute_force() {
    let cuboid = Shape::Box { center: Vec3::zeros(), half: Vec3::new(0.4, 0.2, 0.3), axes: Mat3::identity() };
    let segment = Shape::segment(Vec3::new(-0.5, 0.3, 0.0), Vec3::new(0.6, 0.2, 0.3));
    let triangle = Shape::triangle(Vec3::zeros(), Vec3::new(1.0, 0.0, 0.0), Vec3::new(0.0, 1.0, 0.2));
    for (name, shapes) in [
        ("two points", vec![point(0.0, 0.0), point(0.8, 0.0)]),
        ("four points", blob()),
        ("box and point", vec![cuboid, point(0.9, 0.0)]),
        ("segment and point", vec![segment, point(0.0, -0.4)]),
        ("triangle and segment", vec![triangle, Shape::segment(Vec3::new(0.0, 0.0, 0.9), Vec3::new(1.0, 0.5, 0.8))]),
    ] {
        let mut limb = Limb::new(0.0, 0.5, 1.0, &[shapes]);
        let counted = limb.counted(120);
        for (seed_count, most, most_of_one) in [(64, 0.02, 0.05), (1024, 0.004, 0.01)] {
            limb.world.set_desc(WorldDesc { seed_count, ..WorldDesc::default() }).unwrap();
            let total = limb.total() / counted.iter().sum::<f64>() - 1.0;
            let errors =
                limb.volumes().iter().zip(&counted).map(|(ours, exact)| ours / exact - 1.0).collect::<Vec<_>>();
            let worst = errors.iter().fold(0.0, |worst: f64, error| worst.max(error.abs()));
            println!(
                "{name}, {seed_count} seeds: total {:+.2} %, worst territory {:.2} %",
                100.0 * total,
                100.0 * worst
            );
            assert!(total.abs() < most && worst < most_of_one, "{errors:?}");
        }
    }
}

#[test]
fn total_volume_is_kept_while_balls_and_blobs_merge() {
    for (name, radius, shapes) in
        [("balls", 1.0, vec![point(0.0, 0.0)]), ("blobs", 1.0, blob()), ("wide blobs", 1.5, blob())]
    {
        for gain in [0.0, 0.5] {
            let mut limb = Limb::new(gain, 0.5, radius, &[shapes.clone(), shapes.clone()]);
            let (mut worst, mut counted_worst, mut start, mut counted_start) = (0.0f64, 0.0f64, 0.0, 0.0);
            for step in 0..=60 {
                limb.place(1, Pose::at(0.0, 0.0, 3.0 - 2.2 * f64::from(step) / 60.0));
                if step == 0 {
                    start = limb.total();
                    counted_start = limb.counted(80).iter().sum::<f64>();
                }
                limb.world.step(DT).unwrap();
                worst = worst.max((limb.total() / start - 1.0).abs());
                if step % 6 == 0 {
                    let counted: f64 = limb.counted(80).iter().sum();
                    counted_worst = counted_worst.max((counted / counted_start - 1.0).abs());
                }
            }
            println!(
                "{name}, gain {gain}: largest error of the total volume {:.2} % by seeds, {:.2} % counted",
                100.0 * worst,
                100.0 * counted_worst
            );
            assert!(if gain == 0.0 { worst > 0.05 } else { worst < 0.03 && counted_worst < 0.03 });
        }
    }
}

/// A muscle of five points that blend, between two segments of bone; the thickness is 0.04 of the size.
fn arm_of_size(size: f64, spacing: f64) -> Limb {
    let (t, spacing) = (0.04 * size, spacing * size);
    let bone = |from: f64, to: f64| Shape::segment(Vec3::new(from, 0.0, 0.0), Vec3::new(to, 0.0, 0.0));
    let mut shapes: Vec<Shape> = (0..5).map(|k| point(spacing * f64::from(k), 0.0)).collect();
    shapes.extend([bone(-0.3 * size, -spacing), bone(5.0 * spacing, 5.0 * spacing + 0.25 * size)]);
    let mut limb = Limb::new(0.5, t, 2.0 * t, &[shapes]);
    limb.world.step(DT).unwrap();
    limb
}

fn arm(spacing: f64) -> Limb {
    arm_of_size(1.0, spacing)
}

/// Steps on, and gives the volumes over the targets after each step.
fn history(limb: &mut Limb, steps: usize) -> Vec<Vec<f64>> {
    let mut out = Vec::new();
    for _ in 0..steps {
        limb.world.step(DT).unwrap();
        let over = |id: &SkeletonId| {
            limb.world.skeleton_volume(*id).unwrap() / limb.world.skeleton_target_volume(*id).unwrap()
        };
        out.push(limb.skeletons.iter().map(over).collect());
    }
    out
}

#[test]
fn a_muscle_flexes_to_twice_its_volume_and_back_without_swinging() {
    // Spacings from half a thickness, where the points have little surface of their own, and take longer.
    for spacing in [0.02, 0.03, 0.04, 0.05] {
        let mut limb = arm(spacing);
        let rest = limb.volumes();
        for factor in [2.0, 1.0] {
            for (id, volume) in limb.skeletons[..5].iter().zip(&rest) {
                limb.world.set_skeleton_target_volume(*id, factor * volume).unwrap();
            }
            let history = history(&mut limb, 60);
            let muscle = |ratios: &Vec<f64>| {
                let targets = limb.skeletons[..5].iter().map(|id| limb.world.skeleton_target_volume(*id).unwrap());
                let (now, all) =
                    ratios[..5].iter().zip(targets).fold((0.0, 0.0), |(v, all), (r, t)| (v + r * t, all + t));
                now / all - 1.0
            };
            let errors: Vec<f64> = history.iter().map(muscle).collect();
            let reached = errors.iter().position(|error| error.abs() < 0.02).unwrap();
            let overshoot =
                errors.iter().fold(0.0, |most: f64, error| most.max(if factor > 1.0 { *error } else { -error }));
            let worst = |ratios: &[f64]| ratios.iter().fold(0.0, |most: f64, ratio| most.max((ratio - 1.0).abs()));
            let (part, bones) = (worst(&history[29][..5]), worst(&history[29][5..]));
            let bones_on_the_way = history.iter().map(|ratios| worst(&ratios[5..])).fold(0.0, f64::max);
            println!(
                "spacing {:.2} thicknesses, to {factor}: within 2 % after {:.3} s, overshoot {:.2} %, after 0.5 s: worst \
                 part {:.2} %, bones {:.2} % (on the way {:.2} %)",
                spacing / 0.04,
                (reached + 1) as f64 * DT,
                100.0 * overshoot,
                100.0 * part,
                100.0 * bones,
                100.0 * bones_on_the_way
            );
            let dense = spacing < 0.03;
            assert!(reached < if dense { 45 } else { 30 } && overshoot < 0.01 && bones < 0.03, "{errors:?}");
            assert!(part < if dense { 0.1 } else { 0.02 });
            // Each step is nearer than the one before, until both are at rest.
            assert!(errors.windows(2).all(|pair| pair[1].abs() < pair[0].abs() + 1e-3), "{errors:?}");
        }
        let back = limb.volumes().iter().zip(&rest).fold(0.0, |most: f64, (v, rest)| most.max((v / rest - 1.0).abs()));
        assert!(back < if spacing < 0.03 { 1e-2 } else { 1e-3 }, "{back}");
    }
}

/// Whether the target doubles at once, or over half a second.
#[test]
fn neighbours_of_a_flexing_part_keep_their_volume() {
    for ramp in [1, 30] {
        let mut limb = arm(0.04);
        let rest = limb.volumes();
        let (mut on_the_way, mut own) = (0.0f64, 0.0);
        for step in 1..=30 + ramp {
            let factor = 1.0 + f64::from(step.min(ramp)) / f64::from(ramp);
            limb.world.set_skeleton_target_volume(limb.skeletons[2], factor * rest[2]).unwrap();
            limb.world.step(DT).unwrap();
            let ratio = |k: usize| limb.volumes()[k] / rest[k] - 1.0;
            on_the_way = [0, 1, 3, 4, 5, 6].into_iter().map(|k| ratio(k).abs()).fold(on_the_way, f64::max);
            own = ratio(2) - 1.0;
        }
        let neighbours =
            [0, 1, 3, 4].map(|k| (limb.volumes()[k] / rest[k] - 1.0).abs()).into_iter().fold(0.0, f64::max);
        println!(
            "doubled over {ramp} steps: neighbours off by at most {:.2} %, at the end {:.3} %; the part {:+.3} %",
            100.0 * on_the_way,
            100.0 * neighbours,
            100.0 * own
        );
        assert!(own.abs() < 0.02 && neighbours < 0.03 && on_the_way < 0.03);
    }
}

/// What comes of doubling the targets of some parts at once, and taking them back at once after half a second.
#[derive(Debug, Default)]
struct Flexed {
    /// The largest error of anybody else in any step.
    beside: f64,
    /// Of the parts: their largest errors after half a second, how far they went beyond, the steps until within 2 %.
    late: f64,
    beyond: f64,
    took: usize,
}

fn flexed(seeds: u32, size: f64, spacing: f64, dt: f64, parts: &[usize]) -> Flexed {
    let mut limb = arm_of_size(size, spacing);
    limb.world.set_desc(WorldDesc { seed_count: seeds, ..WorldDesc::default() }).unwrap();
    let rest = limb.volumes();
    for (skeleton, volume) in limb.skeletons.clone().into_iter().zip(&rest) {
        limb.world.set_skeleton_target_volume(skeleton, *volume).unwrap();
    }
    let steps = (0.5 / dt + 1e-9) as usize;
    let mut out = Flexed::default();
    for factor in [2.0, 1.0] {
        for part in parts {
            limb.world.set_skeleton_target_volume(limb.skeletons[*part], factor * rest[*part]).unwrap();
        }
        for step in 1..=steps {
            limb.world.step(dt).unwrap();
            for (k, volume) in limb.volumes().iter().enumerate() {
                if !parts.contains(&k) {
                    out.beside = out.beside.max((volume / rest[k] - 1.0).abs());
                    continue;
                }
                let error = volume / (factor * rest[k]) - 1.0;
                out.beyond = out.beyond.max(if factor > 1.0 { error } else { -error });
                out.took = if error.abs() < 0.02 { out.took } else { out.took.max(step + 1) };
                out.late = if step == steps { out.late.max(error.abs()) } else { out.late };
            }
        }
    }
    out
}

#[test]
fn who_flexes_at_once_is_there_in_half_a_second_and_leaves_its_neighbours_alone() {
    // So near each other, 64 seeds see less of a border than it moves.
    let spacings = [(512, 0.02), (64, 0.03), (64, 0.04), (64, 0.05)];
    let spacings = spacings.map(|(seeds, spacing)| (seeds, 1.0, spacing, 1.0 / 15.0));
    let sizes = [1e-3, 1.0, 1e3]
        .into_iter()
        .flat_map(|size| [1.0 / 240.0, 1.0 / 60.0, 1.0 / 15.0].map(|dt| (64, size, 0.04, dt)));
    for (seeds, size, spacing, dt) in spacings.into_iter().chain(sizes) {
        for (name, parts) in [("one part", &[2][..]), ("two parts", &[1, 2]), ("all parts", &[0, 1, 2, 3, 4])] {
            let flexed = flexed(seeds, size, spacing, dt, parts);
            println!(
                "size {size}, {:.2} thicknesses apart, {seeds} seeds, steps of {:.1} ms, {name}: within 2 % after {:.3} s; \
                 neighbours off by {:.2} % on the way, overshoot {:.2} %, error after 0.5 s {:.3} %",
                spacing / 0.04,
                1e3 * dt,
                flexed.took as f64 * dt,
                100.0 * flexed.beside,
                100.0 * flexed.beyond,
                100.0 * flexed.late
            );
            // Where 64 rays see the border as it is; nearer and farther it is rougher.
            let most = if (0.03..=0.04).contains(&spacing) { 0.03 } else { 0.04 };
            assert!(flexed.beside < most && flexed.late < 0.02 && flexed.beyond < 0.02, "{flexed:?}");
        }
    }
}

/// Whatever shapes lie near each other, and however much or little of each is on the surface: control comes to rest.
#[test]
fn control_of_heaps_comes_to_rest() {
    let mut state = 1u64;
    let mut random = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 33) as f64 / f64::from(1u32 << 31)
    };
    for spread in [0.3, 0.6, 1.0, 1.5] {
        let mut worst = (0usize, 0.0f64, 0);
        for _ in 0..6 {
            let shapes: Vec<Vec<Shape>> = (0..10)
                .map(|k| {
                    let mut at = |width: f64| Vec3::new(random() - 0.5, random() - 0.5, random() - 0.5) * width;
                    let (a, b, c) = (at(3.0 * spread), at(1.0), at(1.0));
                    vec![match k % 4 {
                        0 => Shape::segment(a, a + b),
                        1 => Shape::triangle(a, a + b, a + c),
                        2 => Shape::Box { center: a, half: b.abs() * 0.4 + Vec3::repeat(0.05), axes: Mat3::identity() },
                        _ => Shape::Point(a),
                    }]
                })
                .collect();
            let mut limb = Limb::new(0.5, 0.5, 1.0, &shapes);
            limb.world.step(DT).unwrap();
            for id in limb.skeletons.clone() {
                let volume = limb.world.skeleton_volume(id).unwrap();
                if volume > 0.0 {
                    limb.world.set_skeleton_target_volume(id, volume * (0.7 + 0.8 * random())).unwrap();
                }
            }
            let mut last = limb.offsets();
            let mut still = 0;
            for step in 1..=300 {
                limb.world.step(DT).unwrap();
                let next = limb.offsets();
                let moved = next.iter().zip(&last).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                if moved > 1e-3 * 0.5 {
                    still = step;
                }
                worst.1 = if step == 300 { worst.1.max(moved) } else { worst.1 };
                last = next;
            }
            worst.0 = worst.0.max(still);
        }
        println!("heaps {spread}: last step with a move above a thousandth {}, then {:.1e}", worst.0, worst.1);
        assert!(worst.1 < 1e-6);
    }
}

/// The law has no length and no time in it: the steps are the same ones at every size, and however long they are.
#[test]
fn control_converges_at_every_size_and_step() {
    let mut first: Option<Vec<f64>> = None;
    for size in [1e-3, 1e-2, 0.1, 1.0, 10.0, 1e3] {
        for dt in [1.0 / 240.0, 1.0 / 60.0, 1.0 / 30.0, 1.0 / 15.0] {
            let points = |shift: f64| vec![Shape::Point(Vec3::new(shift * size, 0.0, 0.0))];
            let mut limb = Limb::new(0.5, 0.5 * size, size, &[points(0.0), points(2.0)]);
            limb.world.step(dt).unwrap();
            let start = limb.total();
            limb.place(1, Pose::at(-1.4 * size, 0.0, 0.0));
            let mut errors = Vec::new();
            for _ in 0..40 {
                limb.world.step(dt).unwrap();
                errors.push(limb.total() / start - 1.0);
            }
            assert!(errors.windows(2).all(|pair| pair[1].abs() <= pair[0].abs() + 1e-9), "{size} {dt}: {errors:?}");
            assert!(errors[39].abs() < 1e-4);
            let first = first.get_or_insert_with(|| {
                println!(
                    "error of the total after steps 1, 2, 5, 10, 20: {:.1e}, {:.1e}, {:.1e}, {:.1e}, {:.1e}",
                    errors[0], errors[1], errors[4], errors[9], errors[19]
                );
                errors.clone()
            });
            assert!(first.iter().zip(&errors).all(|(a, b)| (a - b).abs() < 1e-4), "{size} {dt}");
        }
    }
}

#[test]
fn a_buried_skeleton_waits_and_recovers_when_it_comes_out() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let body = world.create_body(BodyDesc { volume_gain: 0.5, ..BodyDesc::default() }).unwrap();
    let mut add = |thickness: f64| {
        let link = world.create_link(body, LinkDesc { kind: Kind::Host, ..LinkDesc::default() }).unwrap();
        // The same slope, so that the large one is the higher all over the small one.
        let desc = SkeletonDesc { thickness, radius: 1.0 - 0.5 + thickness, ..SkeletonDesc::default() };
        (link, world.create_skeleton(link, desc).unwrap())
    };
    let ((_, large), (moving, small)) = (add(0.5), add(0.15));
    let at = |world: &mut World, x: f64| {
        world.set_link_state(moving, &LinkState { pose: Pose::at(x, 0.0, 0.0), twist: Twist::default() }).unwrap();
        world.step(DT).unwrap();
    };
    at(&mut world, 2.0);
    let targets = [large, small].map(|id| world.skeleton_target_volume(id).unwrap());
    let (mut frozen, mut waited) = (None, 0);
    for step in 0..180 {
        let x = match step {
            0..60 => 2.0 - 2.0 * f64::from(step) / 60.0,
            60..120 => 0.0,
            _ => 2.0 * f64::from(step - 119) / 60.0,
        };
        at(&mut world, x);
        let offset = world.skeleton_offset(small).unwrap();
        assert!((-0.075..=0.15).contains(&offset), "{offset}");
        let buried = world.seeds(small).unwrap().iter().all(|seed| !seed.valid);
        if (61..120).contains(&step) {
            assert!(buried && world.skeleton_volume(small).unwrap() == 0.0);
            assert!(frozen.is_none_or(|frozen: f64| frozen == offset));
            (frozen, waited) = (Some(offset), waited + 1);
        }
    }
    let mut late = 0;
    let errors = |world: &World| {
        [(large, targets[0]), (small, targets[1])].map(|(id, target)| world.skeleton_volume(id).unwrap() / target - 1.0)
    };
    while errors(&world).iter().any(|error| error.abs() > 0.01) {
        at(&mut world, 2.0);
        late += 1;
        assert!(late < 30, "{:?}", errors(&world));
    }
    println!(
        "buried for {waited} steps at an offset of {:.3} thicknesses; within 1 % {late} steps after its way out",
        frozen.unwrap() / 0.15
    );
}

#[test]
fn contacts_and_queries_see_the_swollen_coat() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let floor = Coat::floor(0.1).hard();
    let (floor, _) = floor.add_fixed(&mut world, Pose::at(0.0, 0.0, -0.1));
    let ball = Coat::ball(0.1);
    let desc = BodyDesc { volume_gain: 0.5, ..ball.body_desc() };
    let (ball, link) = ball.add(&mut world, desc, LinkDesc { pose: Pose::at(0.0, 0.0, 0.11), ..LinkDesc::default() });
    let skeleton = world.link_skeletons(link).unwrap().next().unwrap();
    world.step(DT).unwrap();
    assert!(world.collide(ball, floor, Scheme::Auto, 1e-6).unwrap().is_empty());
    // To a ball of 0.12 m: 0.01 m deep in the floor.
    let t = 0.12;
    world.set_skeleton_target_volume(skeleton, 4.0 / 3.0 * PI * f64::powi(t, 3)).unwrap();
    for _ in 0..40 {
        world.step(DT).unwrap();
    }
    assert!((world.skeleton_offset(skeleton).unwrap() - 0.02).abs() < 1e-6);
    let hit = world.cast_ray(&Vec3::new(0.0, 0.0, 1.0), &-Vec3::z(), 2.0, u64::MAX).unwrap().unwrap();
    assert!((hit.position.z - 0.23).abs() < 1e-6);
    assert!((world.closest_point(ball, &Vec3::new(1.0, 0.0, 0.11)).unwrap().unwrap().distance - 0.88).abs() < 1e-6);
    let (force, sink) = (world.collide(ball, floor, Scheme::Auto, 1e-6).unwrap()[0].force.norm(), 0.01);
    let exact = PI * 1e5 * 20.0 * sink * sink * (t - 2.0 * sink / 3.0);
    assert!((force / exact - 1.0).abs() < 1e-3, "{force} {exact}");
    // Off again, it is what its descriptor says.
    world.set_body_desc(ball, BodyDesc { volume_gain: 0.0, ..world.body_desc(ball).unwrap().clone() }).unwrap();
    assert_eq!(world.skeleton_profile(skeleton).unwrap().thickness, 0.1);
    assert_eq!(world.skeleton_offset(skeleton).unwrap(), 0.0);
    assert!(world.collide(ball, floor, Scheme::Auto, 1e-6).unwrap().is_empty());
}

#[test]
fn what_makes_no_sense_is_refused_with_value_and_range() {
    let mut limb = Limb::new(0.5, 0.1, 0.0, &[vec![point(0.0, 0.0)]]);
    let skeleton = limb.skeletons[0];
    for (target, said) in [(0.0, "target volume is 0"), (-1.0, "is -1"), (f64::NAN, "NaN"), (1e31, "at most 1e30")] {
        let error = limb.world.set_skeleton_target_volume(skeleton, target).unwrap_err().to_string();
        assert!(error.contains(said) && error.contains("> 0 and at most 1e30"), "{error}");
    }
    for gain in [-0.1, 0.6, f64::NAN] {
        let error = limb.world.create_body(BodyDesc { volume_gain: gain, ..BodyDesc::default() }).unwrap_err();
        assert!(error.to_string().contains("volume_gain is") && error.to_string().contains("0.5"), "{error}");
    }
    let mut plain = Limb::new(0.0, 0.1, 0.0, &[vec![point(0.0, 0.0)]]);
    for result in [
        plain.world.set_skeleton_target_volume(plain.skeletons[0], 1.0),
        plain.world.skeleton_target_volume(plain.skeletons[0]).map(drop),
    ] {
        assert!(result.unwrap_err().to_string().contains("volume_gain"));
    }
    let (body, link) = Coat::floor(0.1).add_fixed(&mut plain.world, Pose::default());
    let plane = plain.world.link_skeletons(link).unwrap().next().unwrap();
    assert!(plain.world.body_volume(body).is_err() && plain.world.skeleton_volume(plane).is_err());
    // A new thickness begins anew; the host's own value does not.
    let desc = limb.world.skeleton_desc(skeleton).unwrap().clone();
    limb.world.set_skeleton_target_volume(skeleton, 0.005).unwrap();
    limb.world.set_skeleton_desc(skeleton, SkeletonDesc { user_data: 9, ..desc.clone() }).unwrap();
    assert_eq!(limb.world.skeleton_target_volume(skeleton).unwrap(), 0.005);
    limb.world.set_skeleton_desc(skeleton, SkeletonDesc { thickness: 0.2, ..desc }).unwrap();
    let ball = 4.0 / 3.0 * PI * f64::powi(0.2, 3);
    assert!((limb.world.skeleton_target_volume(skeleton).unwrap() / ball - 1.0).abs() < 1e-12);
}

/// Balls of two points that the library moves, on a floor, one of them flexing.
fn pile(tasks: bool) -> (World, Vec<SkeletonId>) {
    let settings =
        WorldDesc { gravity: Vec3::new(0.0, 0.0, -G), sleep_time: 0.2, sleep_speed: 1.0, ..WorldDesc::default() };
    let mut world = World::new(settings).unwrap();
    if tasks {
        world.set_tasks(Some(Box::new(Pool::new(3))));
    }
    let floor = Coat::floor(0.1).hard();
    floor.add_fixed(&mut world, Pose::at(0.0, 0.0, -0.1));
    let dumbbell = Coat::new(&[Shape::Point(Vec3::new(-0.06, 0.0, 0.0)), Shape::Point(Vec3::new(0.06, 0.0, 0.0))], 0.1);
    let mut skeletons = Vec::new();
    for index in 0..4 {
        let desc = BodyDesc { volume_gain: 0.5, dissipation: 5.0, friction: 0.3, ..dumbbell.body_desc() };
        let link = LinkDesc {
            kind: Kind::Rigid,
            mass: 1.0,
            inertia: ball_inertia(1.0, 0.15),
            pose: Pose::at(0.35 * f64::from(index), 0.0, 0.1),
            ..LinkDesc::default()
        };
        let (_, link) = dumbbell.add(&mut world, desc, link);
        skeletons.extend(world.link_skeletons(link).unwrap());
    }
    (world, skeletons)
}

fn flex(world: &mut World, skeletons: &[SkeletonId], step: usize) {
    if step.is_multiple_of(20) {
        let factor = if step.is_multiple_of(40) { 1.5 } else { 0.8 };
        let target = factor * 4.0 / 3.0 * PI * f64::powi(0.1, 3);
        world.set_skeleton_target_volume(skeletons[(step / 20) % skeletons.len()], target).unwrap();
    }
    world.step(DT).unwrap();
}

fn bits(world: &World, skeletons: &[SkeletonId]) -> Vec<u64> {
    let mut out = Vec::new();
    for id in skeletons {
        let pose = world.link_state(world.skeleton_link(*id).unwrap()).unwrap().pose;
        out.extend([world.skeleton_offset(*id).unwrap(), world.skeleton_volume(*id).unwrap()].map(f64::to_bits));
        out.extend(pose.position.iter().chain(pose.rotation.coords.iter()).map(|x| x.to_bits()));
    }
    out
}

#[test]
fn a_world_with_volume_control_goes_on_from_a_snapshot_with_the_same_bits() {
    let (mut world, skeletons) = pile(false);
    (0..47).for_each(|step| flex(&mut world, &skeletons, step));
    let mut taken = Vec::new();
    world.snapshot(&mut taken);
    let run = |world: &mut World| {
        let go = |step| {
            flex(world, &skeletons, step);
            bits(world, &skeletons)
        };
        (47..150).map(go).collect::<Vec<_>>()
    };
    let first = run(&mut world);
    world.restore(&taken).unwrap();
    assert!(run(&mut world) == first);
}

#[test]
fn volume_control_has_the_same_bits_with_any_number_of_workers() {
    let ((mut alone, ours), (mut helped, theirs)) = (pile(false), pile(true));
    for step in 0..100 {
        flex(&mut alone, &ours, step);
        flex(&mut helped, &theirs, step);
        assert_eq!(bits(&alone, &ours), bits(&helped, &theirs), "step {step}");
    }
}

/// How a body moves as a whole does not matter to its volumes.
#[test]
fn a_body_in_flight_has_the_offsets_of_one_at_rest() {
    let shapes = |shift: f64| vec![point(shift, 0.0), point(shift + 0.3, 0.2)];
    let offsets = [false, true].map(|flying| {
        let mut limb = Limb::new(0.5, 0.5, 1.0, &[shapes(0.0), shapes(0.7)]);
        for step in 0..40 {
            let turn = rotation_from_vector(&Vec3::new(0.1, 0.2, -0.05).scale(f64::from(step)));
            let whole = Pose { position: Vec3::new(1.0, 7.0, 2.0).scale(f64::from(step)), rotation: turn };
            let whole = if flying { whole } else { Pose::default() };
            let apart = Vec3::new(-0.01, 0.0, 0.0).scale(f64::from(step.min(20)));
            limb.place(0, whole);
            limb.place(1, Pose { position: whole.transform_point(&apart), ..whole });
            limb.world.step(DT).unwrap();
        }
        limb.offsets()
    });
    assert!(offsets[0].iter().zip(&offsets[1]).all(|(a, b)| (a - b).abs() < 1e-6 * 0.5), "{offsets:?}");
    assert!(offsets[0].iter().any(|offset| offset.abs() > 1e-3));
}

#[test]
fn who_flexes_stays_awake_and_wakes_who_leans_on_it() {
    let settings =
        WorldDesc { gravity: Vec3::new(0.0, 0.0, -G), sleep_time: 0.1, sleep_speed: 1.0, ..WorldDesc::default() };
    let mut world = World::new(settings).unwrap();
    let muscle = Coat::ball(0.1);
    let desc = BodyDesc { volume_gain: 0.1, ..muscle.body_desc() };
    let (_, below) = muscle.add(&mut world, desc.clone(), LinkDesc::default());
    let skeleton = world.link_skeletons(below).unwrap().next().unwrap();
    let link = LinkDesc {
        kind: Kind::Rigid,
        mass: 1.0,
        inertia: ball_inertia(1.0, 0.1),
        pose: Pose::at(0.0, 0.0, 0.199),
        ..LinkDesc::default()
    };
    let (leaning, above) = muscle.add(&mut world, BodyDesc { dissipation: 20.0, ..desc }, link);
    let own = world.link_skeletons(above).unwrap().next().unwrap();
    let settle = |world: &mut World| {
        for _ in 0..200 {
            world.step(DT).unwrap();
        }
        assert!(!world.body_is_awake(leaning).unwrap());
    };
    settle(&mut world);
    // The sleeper itself: it stays awake while its volume converges, slow as it is.
    world.set_skeleton_target_volume(own, 0.8 * world.skeleton_volume(own).unwrap()).unwrap();
    assert!(world.body_is_awake(leaning).unwrap());
    let mut last = f64::NAN;
    while world.skeleton_offset(own).unwrap() != last {
        last = world.skeleton_offset(own).unwrap();
        world.step(DT).unwrap();
        assert!(world.body_is_awake(leaning).unwrap());
    }
    assert!((world.skeleton_volume(own).unwrap() / world.skeleton_target_volume(own).unwrap() - 1.0).abs() < 1e-4);
    settle(&mut world);
    // What it leans on, which never sleeps.
    let before = world.link_state(above).unwrap().pose.position.z;
    world.set_skeleton_target_volume(skeleton, 1.5 * world.skeleton_volume(skeleton).unwrap()).unwrap();
    assert!(world.body_is_awake(leaning).unwrap());
    settle(&mut world);
    let lifted = world.link_state(above).unwrap().pose.position.z - before;
    assert!((lifted / world.skeleton_offset(skeleton).unwrap() - 1.0).abs() < 0.05, "{lifted}");
}

#[test]
fn a_body_without_control_has_the_coat_that_its_descriptor_says() {
    let mut limb = Limb::new(0.0, 0.5, 1.0, &[blob(), blob()]);
    for step in 0..30 {
        limb.place(1, Pose::at(0.0, 0.0, 1.5 - 0.05 * f64::from(step)));
        limb.world.step(DT).unwrap();
    }
    assert!(limb.offsets().iter().all(|offset| offset.to_bits() == 0));
    let profile = limb.world.skeleton_profile(limb.skeletons[0]).unwrap();
    assert_eq!((profile.thickness, profile.radius), (0.5, 1.0));
}
