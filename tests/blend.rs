//! Blend graphs: the field of skeletons of which not all blend, and the contact of those that don't.

mod common;

use common::{Coat, DT, G, Random, ball_inertia, total};
use isocoat::base::Kind;
use isocoat::coat::cliques::{self, Weights};
use isocoat::field::{Graph, Placed, Profile, Shape, blend};
use isocoat::math::{Pose, Twist, Vec3};
use isocoat::world::{
    BodyDesc, BodyId, Contact, LinkDesc, LinkId, LinkState, Response, Scheme, SkeletonDesc, SkeletonId, World,
    WorldDesc,
};
use proptest::prelude::*;

const T: f64 = 0.5;
const BAND: f64 = 0.05;

fn ball(center: Vec3) -> Placed {
    Placed { shape: Shape::Point(center), profile: Profile::new(1.0, T, 0.0, 1.0, 3.0 * T, false).unwrap() }
}

fn graph_of(count: usize, band: f64, weight: impl Fn(usize, usize) -> f64) -> Graph {
    cliques::graph(&Weights::new(count, weight), band).unwrap()
}

/// A and B blend, and B and C, but not A and C.
fn elbow() -> (Vec<Placed>, Graph) {
    let centers = [Vec3::new(-0.45, 0.35, 0.0), Vec3::new(0.0, -0.35, 0.0), Vec3::new(0.45, 0.35, 0.0)];
    let graph = graph_of(3, BAND, |i, j| f64::from(u8::from((i, j) != (0, 2))));
    (centers.map(ball).to_vec(), graph)
}

/// Random skeletons of all kinds within a unit of the origin.
fn some_skeletons(random: &mut Random, count: usize) -> Vec<Placed> {
    let place = |random: &mut Random| Vec3::from_fn(|_, _| random.range(-0.8, 0.8));
    (0..count)
        .map(|_| {
            let shape = match (random.unit() * 3.0) as u32 {
                0 => Shape::Point(place(random)),
                1 => Shape::segment(place(random), place(random)),
                _ => Shape::triangle(place(random), place(random), place(random)),
            };
            let (t, stiffening) = (random.range(0.2, 0.5), random.range(0.5, 2.0));
            Placed { shape, profile: Profile::new(1.0, t, 0.0, stiffening, t * random.range(1.5, 3.0), false).unwrap() }
        })
        .collect()
}

/// Random weights, some 0, some 1, some between.
fn some_graph(random: &mut Random, count: usize, band: f64) -> (Weights, Graph) {
    let draws: Vec<f64> = (0..count * count).map(|_| random.range(-0.7, 1.7).clamp(0.0, 1.0)).collect();
    let weights = Weights::new(count, |i, j| (draws[i * count + j] * 4.0).round() / 4.0);
    let graph = cliques::graph(&weights, band).unwrap();
    (weights, graph)
}

/// The maximum over all sets of skeletons of which every two blend, level by level: by brute force.
fn plain_maximum(weights: &Weights, fields: &[f64]) -> f64 {
    let levels = [0.25, 0.5, 0.75, 1.0];
    let of_level = |level: f64| {
        (1u32..1 << fields.len())
            .filter(|set| {
                let has = |i: usize| set >> i & 1 == 1;
                (0..fields.len()).all(|i| (0..i).all(|j| !has(i) || !has(j) || weights.get(i, j) >= level))
            })
            .map(|set| (0..fields.len()).filter(|i| set >> i & 1 == 1).map(|i| fields[i]).sum::<f64>())
            .fold(0.0, f64::max)
    };
    levels.iter().map(|level| 0.25 * of_level(*level)).sum()
}

#[test]
fn the_field_is_the_maximum_over_groups_that_blend_but_for_a_narrow_band() {
    let mut random = Random(5);
    let (mut inside, mut most) = (0, 0.0f64);
    for _ in 0..400 {
        let count = 2 + (random.unit() * 6.0) as usize;
        let skeletons = some_skeletons(&mut random, count);
        let (weights, graph) = some_graph(&mut random, count, BAND);
        for _ in 0..20 {
            let p = Vec3::from_fn(|_, _| random.range(-1.2, 1.2));
            let fields: Vec<f64> = skeletons.iter().map(|k| k.value(&p)).collect();
            let (value, plain) = (blend::value(&skeletons, &graph, &p), plain_maximum(&weights, &fields));
            let sum: f64 = fields.iter().sum();
            assert!(value >= plain - 1e-12 && value <= plain + 0.5 * BAND, "{value} {plain}");
            assert!(value <= sum + graph.rise(), "{value} {sum}");
            inside += i32::from(value > plain + 1e-12);
            most = most.max(value - plain);
        }
    }
    println!("in the band at {inside} of 8000 places; raised by {most:.4} at most, of a band of {BAND}");
    assert!(inside > 100);
}

#[test]
fn gradients_are_those_of_the_value_and_continuous() {
    let mut random = Random(6);
    let (mut worst, mut bent) = (0.0f64, 0.0f64);
    for _ in 0..300 {
        let count = 2 + (random.unit() * 6.0) as usize;
        let skeletons = some_skeletons(&mut random, count);
        let (_, graph) = some_graph(&mut random, count, BAND);
        for _ in 0..20 {
            let p = Vec3::from_fn(|_, _| random.range(-1.2, 1.2));
            let (_, gradient) = blend::value_gradient(&skeletons, &graph, &p);
            let (value, same, _) = blend::value_gradient_hessian(&skeletons, &graph, &p);
            assert_eq!(gradient, same);
            assert_eq!(value, blend::value(&skeletons, &graph, &p));
            let h = 1e-6;
            for axis in 0..3 {
                let at = |s: f64| blend::value(&skeletons, &graph, &(p + Vec3::ith(axis, s * h)));
                let slope = (at(1.0) - at(-1.0)) / (2.0 * h);
                worst = worst.max((slope - gradient[axis]).abs());
                let beside = blend::value_gradient(&skeletons, &graph, &(p + Vec3::ith(axis, h))).1;
                bent = bent.max((beside - gradient).norm() / h);
            }
        }
    }
    println!("gradients off by {worst:.1e} from differences; they change by {bent:.0} a metre at most");
    // The gradient turns within the band, which is as wide as the band over the slopes: some 1e3 a metre.
    assert!(worst < 1e-3, "{worst}");
    assert!(bent < 1e5, "{bent}");
}

#[test]
fn where_only_one_group_reaches_the_field_is_its_sum_to_the_bit() {
    let (skeletons, graph) = elbow();
    let mut random = Random(7);
    let mut count = 0;
    for _ in 0..10_000 {
        let p = Vec3::from_fn(|_, _| random.range(-2.0, 2.0));
        let fields: Vec<f64> = skeletons.iter().map(|k| k.value(&p)).collect();
        if fields[0] * fields[2] == 0.0 {
            count += 1;
            assert_eq!(blend::value(&skeletons, &graph, &p), fields.iter().sum::<f64>());
        }
    }
    assert!(count > 1000);
}

#[test]
fn a_graph_in_which_all_blend_is_none() {
    assert!(graph_of(7, BAND, |_, _| 1.0).is_complete());
    let (_, graph) = elbow();
    let mut part = Graph::default();
    graph.restrict(&[0, 1], &mut part);
    assert!(part.is_complete());
    graph.restrict(&[0, 2], &mut part);
    assert!(!part.is_complete());
}

#[test]
fn the_graph_of_those_in_reach_gives_the_same_field_to_the_bit() {
    let mut random = Random(8);
    for _ in 0..200 {
        let count = 3 + (random.unit() * 6.0) as usize;
        let skeletons = some_skeletons(&mut random, count);
        let (_, graph) = some_graph(&mut random, count, BAND);
        let p = Vec3::from_fn(|_, _| random.range(-1.2, 1.2));
        let reach: Vec<u32> = (0..count as u32).filter(|i| skeletons[*i as usize].value(&p) > 0.0).collect();
        let mut part = Graph::default();
        graph.restrict(&reach, &mut part);
        let near: Vec<Placed> = reach.iter().map(|i| skeletons[*i as usize]).collect();
        let (a, b) = (blend::value(&skeletons, &graph, &p), blend::value(&near, &part, &p));
        assert!((a - b).abs() <= 4e-16 * a.abs(), "{a} {b}");
    }
}

/// Where the surface of the elbow crosses the plane x = 0, at the inner side.
fn crease(skeletons: &[Placed], graph: &Graph) -> Vec3 {
    let (mut low, mut high) = (0.35, 2.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        let inside = blend::value(skeletons, graph, &Vec3::new(0.0, middle, 0.0)) >= 1.0;
        if inside { low = middle } else { high = middle }
    }
    Vec3::new(0.0, low, 0.0)
}

#[test]
fn the_crease_between_arms_that_dont_blend_is_rounded_and_the_surface_hardly_moved() {
    let (skeletons, smooth) = elbow();
    let sharp = graph_of(3, 0.0, |i, j| f64::from(u8::from((i, j) != (0, 2))));
    let angle = |graph: &Graph| {
        let at = crease(&skeletons, graph);
        // Far narrower than any band is wide.
        let normal = |x: f64| blend::value_gradient(&skeletons, graph, &(at + Vec3::new(x, 0.0, 0.0))).1.normalize();
        normal(-3e-4).dot(&normal(3e-4)).clamp(-1.0, 1.0).acos().to_degrees()
    };
    let moved = (crease(&skeletons, &smooth) - crease(&skeletons, &sharp)).norm() / T;
    println!(
        "crease {:.1} degrees with no band, {:.2} with {BAND}; surface moved by {:.2} % of the thickness",
        angle(&sharp),
        angle(&smooth),
        100.0 * moved
    );
    assert!(angle(&sharp) > 30.0);
    assert!(angle(&smooth) < 2.0);
    assert!(moved < 0.015);
}

#[test]
fn weights_change_the_field_without_a_pop() {
    let mut random = Random(9);
    let mut worst = 0.0f64;
    for _ in 0..200 {
        let skeletons = some_skeletons(&mut random, 4);
        let p = Vec3::from_fn(|_, _| random.range(-0.8, 0.8));
        let draws: Vec<f64> = (0..16).map(|_| (random.unit() * 4.0).round() / 4.0).collect();
        let at = |weight: f64| {
            let graph = graph_of(4, BAND, |i, j| if (i, j) == (0, 1) { weight } else { draws[i * 4 + j] });
            blend::value(&skeletons, &graph, &p)
        };
        let (steps, mut last) = (200, at(0.0));
        for step in 1..=steps {
            let next = at(f64::from(step) / f64::from(steps));
            worst = worst.max((next - last).abs() * f64::from(steps));
            assert!(next >= last - 0.51 * BAND / f64::from(steps), "more blending is never less field");
            last = next;
        }
    }
    println!("the field changes by {worst:.2} a unit of weight at most");
    // No faster than the fields themselves are high.
    assert!(worst < 4.0);
}

proptest! {
    #[test]
    fn groups_and_blocks_say_of_every_pair_once_what_its_weight_says(
        count in 2usize..9, draws in prop::collection::vec(0u32..4, 64),
    ) {
        let weight = |i: usize, j: usize| [0.0, 0.0, 0.5, 1.0][draws[i * 8 + j] as usize];
        let weights = Weights::new(count, weight);
        let mut seen = vec![0; count * count];
        for block in cliques::blocks(&weights, |_, _| true) {
            for side in &block.sides {
                for (n, i) in side.iter().enumerate() {
                    for j in &side[..n] {
                        prop_assert_eq!(weights.get(*i as usize, *j as usize), 1.0);
                    }
                }
            }
            for i in &block.sides[0] {
                for j in &block.sides[1] {
                    let (i, j) = (*i as usize, *j as usize);
                    seen[i.min(j) * count + i.max(j)] += 1;
                    prop_assert_eq!(1.0 - weights.get(i, j), block.share);
                }
            }
            for (k, _) in &block.covers {
                prop_assert!(block.sides.iter().all(|side| side.iter().any(|i| weights.get(*i as usize, *k as usize) > 0.0)));
            }
        }
        for i in 0..count {
            for j in i + 1..count {
                prop_assert_eq!(seen[i * count + j], u32::from(weights.get(i, j) < 1.0));
            }
        }
    }
}

#[test]
fn a_graph_with_too_many_groups_is_refused_and_nothing_changes() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let body = world.create_body(BodyDesc::default()).unwrap();
    let mut skeletons = Vec::new();
    for _ in 0..27 {
        let link = world.create_link(body, LinkDesc::default()).unwrap();
        skeletons.push(world.create_skeleton(link, SkeletonDesc::default()).unwrap());
    }
    // Nine trios in each of which nobody blends: 3^9 groups.
    let mut refused = None;
    for trio in skeletons.chunks(3) {
        for (a, b) in [(0, 1), (1, 2), (0, 2)] {
            if let Err(error) = world.set_blend(trio[a], trio[b], 0.0, 0.0) {
                assert_eq!(world.blend(trio[a], trio[b]).unwrap(), 1.0);
                refused = Some(error.to_string());
            }
        }
    }
    assert!(refused.unwrap().contains("4096"));
}

// ---- contact of a body with itself ----------------------------------------------------------------------------------

/// A body of balls, one a link, at these centres, of which none blend but those said.
fn limbs(
    world: &mut World,
    centers: &[Vec3],
    kind: Kind,
    joints: &[(usize, usize)],
) -> (BodyId, Vec<LinkId>, Vec<SkeletonId>) {
    let body = world.create_body(BodyDesc { stiffness_scale: 1e5, ..BodyDesc::default() }).unwrap();
    let (mut links, mut skeletons) = (Vec::new(), Vec::new());
    for center in centers {
        let link = LinkDesc {
            kind,
            mass: 1.0,
            inertia: ball_inertia(1.0, T),
            pose: Pose::at(center.x, center.y, center.z),
            ..LinkDesc::default()
        };
        links.push(world.create_link(body, link).unwrap());
        let skeleton = SkeletonDesc { thickness: T, radius: 2.0 * T, ..SkeletonDesc::default() };
        skeletons.push(world.create_skeleton(*links.last().unwrap(), skeleton).unwrap());
    }
    let joints: Vec<(LinkId, LinkId)> = joints.iter().map(|(a, b)| (links[*a], links[*b])).collect();
    world.blend_neighbours(body, &joints).unwrap();
    (body, links, skeletons)
}

fn touch(world: &World, body: BodyId) -> Vec<Contact> {
    world.collide(body, body, Scheme::Auto, 1e-4).unwrap()
}

#[test]
fn limbs_that_dont_blend_press_on_each_other_as_two_bodies_do() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let centers = [Vec3::zeros(), Vec3::new(0.9, 0.1, 0.0)];
    let (body, ..) = limbs(&mut world, &centers, Kind::Rigid, &[]);
    let own = touch(&world, body);
    let coat = Coat::ball(T);
    let at = |c: &Vec3| Pose::at(c.x, c.y, c.z);
    let two = common::collide((&coat, at(&centers[0])), (&coat, at(&centers[1])), Scheme::Auto, 1e-4);
    assert!(total(&own).norm() > 1.0);
    assert!((total(&own) - total(&two)).norm() < 1e-12 * total(&two).norm());
}

#[test]
fn limbs_that_share_a_neighbour_dont_push_each_other_apart_at_rest() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    // So close that the first and the third overlap, within the second.
    let chain: Vec<Vec3> = (0..6).map(|i| Vec3::new(0.4 * f64::from(i), 0.0, 0.0)).collect();
    let joints: Vec<(usize, usize)> = (1..6).map(|i| (i - 1, i)).collect();
    let (body, ..) = limbs(&mut world, &chain, Kind::Rigid, &joints);
    assert!(touch(&world, body).is_empty(), "{:?}", touch(&world, body));
}

#[test]
fn nothing_brakes_limbs_within_the_territory_of_their_neighbour() {
    for response in [Response::Implicit, Response::Substepped, Response::Auto] {
        let ends = [false, true].map(|self_contact| {
            let mut world = World::new(WorldDesc { response, ..WorldDesc::default() }).unwrap();
            let chain = [Vec3::zeros(), Vec3::new(0.4, 0.0, 0.0), Vec3::new(0.8, 0.0, 0.0)];
            let (body, links, _) = limbs(&mut world, &chain, Kind::Rigid, &[(0, 1), (1, 2)]);
            let desc = BodyDesc { self_contact, ..world.body_desc(body).unwrap().clone() };
            world.set_body_desc(body, desc).unwrap();
            for (link, speed) in [(links[0], 0.3), (links[2], -0.3)] {
                let pose = world.link_state(link).unwrap().pose;
                let twist = Twist { linear: Vec3::new(speed, 0.0, 0.0), angular: Vec3::zeros() };
                world.set_link_state(link, &LinkState { pose, twist }).unwrap();
            }
            for _ in 0..30 {
                world.step(DT).unwrap();
            }
            [links[0], links[2]].map(|link| world.link_state(link).unwrap().pose.position)
        });
        for (free, coated) in ends[0].iter().zip(&ends[1]) {
            assert!((free - coated).norm() < 1e-12, "{response:?}: {free} {coated}");
        }
    }
}

#[test]
fn who_leans_on_a_body_wakes_while_its_weights_are_on_their_way() {
    let gravity = Vec3::new(0.0, 0.0, -G);
    let mut world = World::new(WorldDesc { gravity, sleep_time: 0.2, ..WorldDesc::default() }).unwrap();
    let (_, _, skeletons) = limbs(&mut world, &[Vec3::new(-0.3, 0.0, 0.0), Vec3::new(0.3, 0.0, 0.0)], Kind::Fixed, &[]);
    let ball = LinkDesc { kind: Kind::PointMass, mass: 1.0, pose: Pose::at(0.0, 0.0, 0.94), ..LinkDesc::default() };
    let body = BodyDesc { response: Response::Implicit, dissipation: 1.0, ..Coat::ball(T).body_desc() };
    let (top, _) = Coat::ball(T).add(&mut world, body, ball);
    for _ in 0..600 {
        world.step(DT).unwrap();
    }
    assert!(!world.body_is_awake(top).unwrap());
    world.set_blend(skeletons[0], skeletons[1], 1.0, 2.0).unwrap();
    for _ in 0..110 {
        world.step(DT).unwrap();
        assert!(world.body_is_awake(top).unwrap());
    }
}

#[test]
fn parts_that_can_never_move_dont_collide() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let body = world.create_body(BodyDesc::default()).unwrap();
    for normal in [Vec3::x(), Vec3::y()] {
        let link = world.create_link(body, LinkDesc::default()).unwrap();
        let shape = Shape::plane(Vec3::zeros(), normal).unwrap();
        world.create_skeleton(link, SkeletonDesc { shape, ..SkeletonDesc::default() }).unwrap();
    }
    world.blend_neighbours(body, &[]).unwrap();
    world.step(DT).unwrap();
    assert!(world.contacts().is_empty() && world.events().is_empty());
    let mut kept = Vec::new();
    world.snapshot(&mut kept);
    world.restore(&kept).unwrap();
}

#[test]
fn a_weight_on_its_way_to_too_many_groups_is_refused_at_once() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let body = world.create_body(BodyDesc::default()).unwrap();
    let mut skeletons = Vec::new();
    for _ in 0..27 {
        let link = world.create_link(body, LinkDesc::default()).unwrap();
        skeletons.push(world.create_skeleton(link, SkeletonDesc::default()).unwrap());
    }
    let pairs = skeletons.chunks(3).flat_map(|trio| [(trio[0], trio[1]), (trio[1], trio[2]), (trio[0], trio[2])]);
    let refused = pairs.filter(|(a, b)| world.set_blend(*a, *b, 0.0, 1.0).is_err()).count();
    assert!(refused > 0);
}

#[test]
fn a_limb_that_folds_over_its_joint_meets_a_force_that_grows_from_nothing() {
    let fold = |angle: f64| {
        let mut world = World::new(WorldDesc::default()).unwrap();
        let arm = 0.9;
        let centers =
            [Vec3::new(-arm, 0.0, 0.0), Vec3::zeros(), Vec3::new(-arm * libm::cos(angle), arm * libm::sin(angle), 0.0)];
        let (body, ..) = limbs(&mut world, &centers, Kind::Rigid, &[(0, 1), (1, 2)]);
        total(&touch(&world, body)).norm()
    };
    // The balls of the ends touch where their centres are 1 apart.
    let first = 2.0 * (0.5 / 0.9f64).asin();
    assert_eq!(fold(first + 0.01), 0.0);
    let forces: Vec<f64> = (0..40).map(|i| fold(first - 0.01 * f64::from(i))).collect();
    println!(
        "folded by 0, 0.1, 0.2, 0.3 more: {:.3} {:.3} {:.3} {:.3} N",
        forces[0], forces[10], forces[20], forces[30]
    );
    for pair in forces.windows(2) {
        assert!(pair[1] >= pair[0], "{forces:?}");
        assert!(pair[1] - pair[0] < 0.1 * forces[39], "{forces:?}");
    }
    assert!(forces[39] > 100.0);
}

#[test]
fn a_pair_that_is_switched_off_does_not_collide_nor_a_body_that_is() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let (body, _, skeletons) = limbs(&mut world, &[Vec3::zeros(), Vec3::new(0.8, 0.0, 0.0)], Kind::Rigid, &[]);
    assert_eq!(touch(&world, body).len(), 1);
    world.set_pair_contact(skeletons[0], skeletons[1], false).unwrap();
    assert_eq!(touch(&world, body).len(), 0);
    world.set_pair_contact(skeletons[1], skeletons[0], true).unwrap();
    assert_eq!(touch(&world, body).len(), 1);
    let off = BodyDesc { self_contact: false, ..world.body_desc(body).unwrap().clone() };
    world.set_body_desc(body, off).unwrap();
    assert_eq!(touch(&world, body).len(), 0);
}

#[test]
fn a_weight_between_shares_the_force() {
    let mut world = World::new(WorldDesc::default()).unwrap();
    let (body, _, skeletons) = limbs(&mut world, &[Vec3::zeros(), Vec3::new(0.8, 0.0, 0.0)], Kind::Rigid, &[]);
    let whole = total(&touch(&world, body)).norm();
    for weight in [0.25, 0.5, 0.99] {
        world.set_blend(skeletons[0], skeletons[1], weight, 0.0).unwrap();
        let part = total(&touch(&world, body)).norm();
        assert!((part - (1.0 - weight) * whole).abs() < 1e-9 * whole, "{weight} {part} {whole}");
    }
    world.set_blend(skeletons[0], skeletons[1], 1.0, 0.0).unwrap();
    assert!(touch(&world, body).is_empty());
}

#[test]
fn weights_arrive_in_their_time_and_wake_who_sleeps() {
    let mut world = World::new(WorldDesc { sleep_time: 0.1, ..WorldDesc::default() }).unwrap();
    let (body, _, skeletons) = limbs(&mut world, &[Vec3::zeros(), Vec3::new(2.0, 0.0, 0.0)], Kind::Rigid, &[]);
    for _ in 0..20 {
        world.step(DT).unwrap();
    }
    assert!(!world.body_is_awake(body).unwrap());
    world.set_blend(skeletons[0], skeletons[1], 1.0, 0.5).unwrap();
    assert!(world.body_is_awake(body).unwrap());
    assert_eq!(world.blend(skeletons[0], skeletons[1]).unwrap(), 0.0);
    for step in 1..=30 {
        world.step(DT).unwrap();
        let expected = (f64::from(step) * DT / 0.5).min(1.0);
        assert!((world.blend(skeletons[0], skeletons[1]).unwrap() - expected).abs() < 1e-12);
    }
    assert_eq!(world.blend(skeletons[0], skeletons[1]).unwrap(), 1.0);
}

#[test]
fn limbs_that_bounce_off_each_other_keep_momentum_and_energy() {
    for response in [Response::Substepped, Response::Implicit] {
        let mut world = World::new(WorldDesc { response, ..WorldDesc::default() }).unwrap();
        let centers = [Vec3::zeros(), Vec3::new(1.4, 0.1, 0.0), Vec3::new(-1.3, 0.0, 0.2)];
        let (_, links, _) = limbs(&mut world, &centers, Kind::Rigid, &[]);
        let set = |world: &mut World, link: LinkId, linear: Vec3| {
            let pose = world.link_state(link).unwrap().pose;
            let twist = Twist { linear, angular: Vec3::zeros() };
            world.set_link_state(link, &LinkState { pose, twist }).unwrap();
        };
        set(&mut world, links[1], Vec3::new(-2.0, 0.0, 0.0));
        set(&mut world, links[2], Vec3::new(1.0, 0.0, 0.0));
        let sums = |world: &World| {
            let states: Vec<LinkState> = links.iter().map(|link| world.link_state(*link).unwrap()).collect();
            let momentum: Vec3 = states.iter().map(|s| s.twist.linear).sum();
            let energy: f64 = states.iter().map(|s| 0.5 * s.twist.linear.norm_squared()).sum();
            (momentum, energy)
        };
        let (before, mut touched) = (sums(&world), 0);
        for _ in 0..120 {
            world.step(DT).unwrap();
            touched += world.contacts().len();
        }
        let after = sums(&world);
        println!(
            "{response:?}: energy {:.4} J of {:.4}, momentum off by {:.1e}",
            after.1,
            before.1,
            (after.0 - before.0).norm()
        );
        assert!(touched > 0 && world.contacts().is_empty());
        assert!((after.0 - before.0).norm() < 1e-12);
        match response {
            Response::Substepped => assert!((after.1 - before.1).abs() < 0.01 * before.1),
            _ => assert!(after.1 <= before.1 * 1.000_001),
        }
    }
}

#[test]
fn rolling_back_a_body_that_touches_itself_gives_the_same_bits() {
    let build = || {
        let mut world = World::new(WorldDesc { gravity: Vec3::new(0.0, 0.0, -G), ..WorldDesc::default() }).unwrap();
        let floor = Coat::floor(0.1).hard();
        floor.add_fixed(&mut world, Pose::at(0.0, 0.0, -0.1));
        let centers =
            [Vec3::new(0.0, 0.0, 0.6), Vec3::new(0.3, 0.1, 1.4), Vec3::new(-0.2, 0.1, 2.3), Vec3::new(0.1, 0.0, 3.1)];
        let (body, _, skeletons) = limbs(&mut world, &centers, Kind::Rigid, &[(0, 1)]);
        world.set_blend(skeletons[2], skeletons[3], 1.0, 2.0).unwrap();
        (world, body)
    };
    let (mut world, body) = build();
    for _ in 0..30 {
        world.step(DT).unwrap();
    }
    let mut kept = Vec::new();
    world.snapshot(&mut kept);
    let run = |world: &mut World| {
        let mut bits = Vec::new();
        for _ in 0..60 {
            world.step(DT).unwrap();
            for link in world.body_links(body).unwrap() {
                let state = world.link_state(link).unwrap();
                bits.extend(state.pose.position.iter().chain(state.twist.linear.iter()).map(|x| x.to_bits()));
            }
        }
        bits
    };
    let first = run(&mut world);
    world.restore(&kept).unwrap();
    assert_eq!(first, run(&mut world));
}

#[test]
fn rays_and_closest_points_lie_on_the_surface_of_grouped_fields() {
    let mut random = Random(11);
    let (mut hits, mut worst) = (0, 0.0f64);
    for _ in 0..40 {
        let mut world = World::new(WorldDesc::default()).unwrap();
        let centers: Vec<Vec3> = (0..6).map(|_| Vec3::from_fn(|_, _| random.range(-0.8, 0.8))).collect();
        let (body, ..) = limbs(&mut world, &centers, Kind::Rigid, &[(0, 1), (1, 2), (3, 4)]);
        let field = |p: &Vec3| {
            let mut value = [0.0];
            world.evaluate_field(body, &[(*p).into()], Some(&mut value), None).unwrap();
            value[0]
        };
        for _ in 0..20 {
            let origin = random.direction() * 4.0;
            let target = Vec3::from_fn(|_, _| random.range(-1.0, 1.0));
            let direction = (target - origin).normalize();
            let hit = world.cast_ray(&origin, &direction, f64::INFINITY, u64::MAX).unwrap();
            // Marched in short steps.
            let first = (0..16_000).map(|i| f64::from(i) * 5e-4).find(|s| field(&(origin + direction * *s)) >= 1.0);
            match (&hit, first) {
                (Some(hit), Some(s)) => {
                    hits += 1;
                    worst = worst.max((field(&hit.position) - 1.0).abs());
                    assert!(hit.distance <= s + 1e-9 && hit.distance >= s - 6e-4, "{} {s}", hit.distance);
                    let near = world.closest_point(body, &origin).unwrap().unwrap();
                    assert!(near.distance <= hit.distance + 1e-9);
                    assert!((field(&near.position) - 1.0).abs() < 1e-9);
                }
                (None, None) => {}
                other => panic!("{other:?}"),
            }
        }
    }
    println!("{hits} rays hit, the field there is off by {worst:.1e}");
    assert!(hits > 300 && worst < 1e-9);
}
