//! The character of the examples (examples/cpp/character.hpp): fifteen links in one coat; skeletons of joined links blend.

use isocoat::World;
use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Pose, Quat, Twist, Vec3, rotation_from_vector};
use isocoat::world::{BodyDesc, BodyId, LinkDesc, LinkId, LinkState, SkeletonDesc};

/// A limb as the character stands: its parent, its ends, the thickness of its coat, the joint to the parent [m].
struct Limb {
    parent: Option<usize>,
    ends: [Vec3; 2],
    thickness: f64,
    joint: Vec3,
    /// How it is bent in the bent pose: about x, in radians.
    bend: f64,
}

fn limbs() -> Vec<Limb> {
    let limb = |parent, from: [f64; 3], to: [f64; 3], thickness, joint: [f64; 3], bend| Limb {
        parent,
        ends: [from.into(), to.into()],
        thickness,
        joint: joint.into(),
        bend,
    };
    let mut all = vec![
        limb(None, [-0.07, 0.0, 0.98], [0.07, 0.0, 0.98], 0.11, [0.0; 3], 0.0),
        limb(Some(0), [-0.08, 0.0, 1.30], [0.08, 0.0, 1.30], 0.13, [0.0, 0.0, 1.12], -0.3),
        limb(Some(1), [0.0, 0.0, 1.64], [0.0, 0.02, 1.68], 0.10, [0.0, 0.0, 1.52], -0.4),
    ];
    for side in [-1.0, 1.0] {
        let at = |x: f64, y: f64, z: f64| [side * x, y, z];
        let shoulder = all.len();
        all.push(limb(Some(1), at(0.23, 0.0, 1.38), at(0.27, 0.0, 1.16), 0.055, at(0.21, 0.0, 1.40), 0.5 * side));
        all.push(limb(Some(shoulder), at(0.28, 0.0, 1.08), at(0.29, 0.02, 0.90), 0.048, at(0.275, 0.0, 1.12), 1.3));
        all.push(limb(
            Some(shoulder + 1),
            at(0.295, 0.03, 0.81),
            at(0.295, 0.04, 0.75),
            0.045,
            at(0.29, 0.02, 0.85),
            0.4,
        ));
        let hip = all.len();
        all.push(limb(Some(0), at(0.11, 0.0, 0.84), at(0.12, 0.0, 0.56), 0.08, at(0.10, 0.0, 0.92), 0.6 * side + 0.6));
        all.push(limb(Some(hip), at(0.12, 0.0, 0.44), at(0.12, 0.0, 0.18), 0.058, at(0.12, 0.0, 0.50), -1.0));
        all.push(limb(Some(hip + 1), at(0.12, 0.0, 0.06), at(0.12, 0.14, 0.05), 0.055, at(0.12, 0.0, 0.10), 0.4));
    }
    all
}

/// A character in a world.
pub struct Character {
    pub body: BodyId,
    pub links: Vec<LinkId>,
}

impl Character {
    /// Standing, feet at z = 0, facing along y.
    pub fn new(world: &mut World) -> Self {
        let body = world.create_body(BodyDesc::default()).expect("a body");
        let links: Vec<LinkId> = limbs()
            .iter()
            .map(|limb| {
                let middle = (limb.ends[0] + limb.ends[1]) * 0.5;
                let pose = Pose { position: middle, rotation: Quat::identity() };
                let desc = LinkDesc { kind: Kind::Host, pose, ..LinkDesc::default() };
                let link = world.create_link(body, desc).expect("a link");
                let shape = Shape::segment(limb.ends[0] - middle, limb.ends[1] - middle);
                let (thickness, radius) = (limb.thickness, 2.2 * limb.thickness);
                let desc = SkeletonDesc { shape, thickness, radius, ..SkeletonDesc::default() };
                world.create_skeleton(link, desc).expect("a skeleton");
                link
            })
            .collect();
        let joints: Vec<(LinkId, LinkId)> =
            limbs().iter().zip(&links).filter_map(|(limb, link)| Some((*link, links[limb.parent?]))).collect();
        world.blend_neighbours(body, &joints).expect("a blend graph");
        Self { body, links }
    }

    /// Bends all joints: 0 is standing, 1 a long stride with raised arms.
    pub fn bend(&self, world: &mut World, amount: f64) {
        let mut placed: Vec<(Quat, Vec3)> = Vec::new();
        for (limb, link) in limbs().iter().zip(&self.links) {
            // From where a point of the standing limb is to where it goes: rotation, then shift.
            let (parent, shift) = limb.parent.map_or((Quat::identity(), Vec3::zeros()), |parent| placed[parent]);
            let turn = parent * rotation_from_vector(&(Vec3::x() * (limb.bend * amount)));
            let joint = parent * limb.joint + shift;
            let shift = joint - turn * limb.joint;
            placed.push((turn, shift));
            let middle = (limb.ends[0] + limb.ends[1]) * 0.5;
            let pose = Pose { position: turn * middle + shift, rotation: turn };
            world.set_link_state(*link, &LinkState { pose, twist: Twist::default() }).expect("a state");
        }
    }
}
