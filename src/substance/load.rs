//! What presses on one particle: integrated now and then, a spring in between.

use super::contact::{self, Opposite, Press, Stiffness};
use super::forces::direction;
use super::locale::Locale;
use super::swarm::Swarm;
use crate::base::Motion;
use crate::contact::pair::Side;
use crate::contact::press::Material;
use crate::field::Placed;
use crate::math::Vec3;

/// Motion of a contact after which it is integrated again, over the thickness.
const STALE: f64 = 0.05;
/// Steepest that the field of several particles is, over that of one at its surface.
const STEEPEST: f64 = 4.0;

/// A coat that particles may meet.
#[derive(Debug, Default)]
pub struct Obstacle {
    /// Its skeletons that are near.
    pub side: Side,
    /// For each matter, what the two make of their surfaces; none where they do not touch.
    pub materials: Vec<Option<Material>>,
    /// For each skeleton, the lowest and the highest place of a particle that it may meet.
    bounds: Vec<(Vec3, Vec3)>,
}

impl Obstacle {
    /// Learns where its skeletons may meet particles whose fields reach this far.
    pub fn bound(&mut self, reach: f64) {
        let meets = |skeleton: &Placed| skeleton.shape.bounds(skeleton.profile.radius + reach);
        self.bounds.clear();
        self.bounds.extend(self.side.skeletons.iter().map(meets));
    }

    /// Skeletons whose fields may come within `reach` of a place, not more than it was bounded for.
    pub fn near(&self, p: &Vec3, reach: f64) -> impl Iterator<Item = u32> {
        (0_u32..).zip(self.side.skeletons.iter().zip(&self.bounds)).filter_map(
            move |(index, (skeleton, (low, high)))| {
                let is_within = (0..3).all(|axis| low[axis] <= p[axis] && p[axis] <= high[axis]);
                let is_near = is_within && skeleton.shape.closest(p).distance < skeleton.profile.radius + reach;
                is_near.then_some(index)
            },
        )
    }
}

/// Who presses on a particle.
#[derive(Clone, Debug)]
pub enum Other {
    /// An obstacle, by its number; the skeletons near the particle, from and to.
    Obstacle {
        /// The number.
        number: u32,
        /// Where its skeletons begin and end.
        skeletons: (u32, u32),
    },
    /// Another piece, by its label, and its nearest particle.
    Piece {
        /// The label.
        label: u32,
        /// The particle.
        nearest: u32,
    },
}

/// What may press on a particle, and does so as it did when it was last integrated.
#[derive(Clone, Debug)]
pub struct Load {
    /// On whom.
    pub particle: u32,
    /// By whom.
    pub other: Other,
    /// What was found when it was last integrated.
    pub press: Press,
    /// The particle from the anchor, then.
    from_anchor: Vec3,
    /// Motion from there after which it is integrated again \[m\].
    patience: f64,
    /// The anchor: in the frame of a link, by its slot (`u32::MAX` for none), or the mean of particles with these parts.
    pub link: u32,
    /// The anchor in the link's frame, from the centre of mass \[m\].
    pub arm: Vec3,
    /// See there.
    pub carriers: Vec<(u32, f64)>,
    /// The particle is in too deep: where it is to go.
    pub escape: Option<Vec3>,
    /// It was integrated just now.
    pub fresh: bool,
}

impl Load {
    /// A load that has never been integrated.
    pub fn new(particle: u32, other: Other) -> Self {
        Self {
            particle,
            other,
            press: Press::default(),
            from_anchor: Vec3::repeat(f64::NAN),
            patience: 0.0,
            link: u32::MAX,
            arm: Vec3::zeros(),
            carriers: Vec::new(),
            escape: None,
            fresh: false,
        }
    }

    /// In the order of particles, then of who presses.
    pub fn key(&self) -> (u32, u32, u32) {
        match self.other {
            Other::Obstacle { number, .. } => (self.particle, 0, number),
            Other::Piece { label, .. } => (self.particle, 1, label),
        }
    }

    /// Where it is held, in the swarm's frame.
    pub fn anchor(&self, swarm: &Swarm, motions: &[Motion]) -> Vec3 {
        match motions.get(self.link as usize) {
            Some(motion) => (motion.center - swarm.origin) + motion.rotation * self.arm,
            None => self.carriers.iter().map(|(j, part)| swarm.place[*j as usize] * *part).sum(),
        }
    }

    fn shift(&self, swarm: &Swarm, motions: &[Motion]) -> Vec3 {
        swarm.place[self.particle as usize] - self.anchor(swarm, motions) - self.from_anchor
    }

    /// Whether it has to be integrated again.
    pub fn is_stale(&self, swarm: &Swarm, motions: &[Motion]) -> bool {
        let way = self.shift(swarm, motions).norm_squared();
        // Not a number before the first time.
        way.is_nan() || way > self.patience * self.patience
    }

    /// The push now; its stiffness is bounded by what a sub-step can follow, `most` over the mass.
    pub fn now(&self, swarm: &Swarm, motions: &[Motion], most: f64) -> Vec3 {
        let Press { push, stiffness, .. } = &self.press;
        let size = push.norm();
        if size == 0.0 {
            return *push;
        }
        let n = push / size;
        let softer = (most * swarm.matter_of(self.particle as usize).mass / stiffness).min(1.0);
        n * ((size - stiffness * self.shift(swarm, motions).dot(&n)).max(0.0) * softer)
    }

    /// Integrates it; `near` has the skeletons of obstacles.
    pub fn integrate(
        &mut self,
        swarm: &Swarm,
        obstacles: &[Obstacle],
        near: &[u32],
        motions: &[Motion],
        locale: &mut Locale,
    ) {
        let i = self.particle as usize;
        let (center, matter, offset) = (swarm.place[i], swarm.matter_of(i), swarm.offset[i]);
        let profile = &matter.profile;
        let sizes = (profile.isovalue, profile.radius + offset, profile.thickness + offset);
        let patience = STALE * sizes.2;
        let (opposite, stiffness, axis, guess) = match &self.other {
            Other::Obstacle { number, skeletons } => {
                let side = &obstacles[*number as usize].side;
                let skeletons = &near[skeletons.0 as usize..skeletons.1 as usize];
                let distance = |index: &u32| {
                    let skeleton = &side.skeletons[*index as usize];
                    skeleton.shape.closest(&center).distance - skeleton.profile.thickness
                };
                let nearest = skeletons.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
                let Some(nearest) = nearest else { return };
                self.link = side.links[*nearest as usize];
                let closest = side.skeletons[*nearest as usize].shape.closest(&center);
                let gap = distance(nearest);
                if gap > sizes.1 + patience {
                    // Out of reach: not before it has come nearer.
                    self.press.push = Vec3::zeros();
                    self.rest(swarm, motions, center - closest.normal * gap, gap - sizes.1);
                    return;
                }
                let other = if side.rigid { f64::INFINITY } else { side.stiffness_scale };
                let opposite = Opposite::Coat(side, skeletons);
                let (excess, gradient) = opposite.excess(locale, &center);
                let axis = gradient.try_normalize(1e-300).unwrap_or(-closest.normal);
                if excess >= 0.0 {
                    // The pressure falls from here on.
                    let way = excess / gradient.norm().max(1e-300);
                    self.escape = Some(-axis * way.min(sizes.2));
                }
                (opposite, Stiffness { own: matter.stiffness_scale, other }, axis, gap)
            }
            Other::Piece { label, nearest } => {
                let other = swarm.matter_of(*nearest as usize);
                self.link = u32::MAX;
                locale.gather(swarm, i, Some(*label), &center, f64::INFINITY);
                // Towards those of the piece that are near, the nearest above all.
                let mut axis = Vec3::zeros();
                for j in swarm.near.of(i).iter().map(|j| *j as usize).filter(|j| swarm.label[*j] == *label) {
                    let way = swarm.place[j] - center;
                    let distance = way.norm();
                    let reach = (sizes.1 + other.profile.radius + swarm.offset[j]).max(1e-300);
                    if distance < reach && distance > 0.0 {
                        axis += way * ((1.0 - distance / reach).powi(4) / distance);
                    }
                }
                let straight = direction(&center, &swarm.place[*nearest as usize], [self.particle, *nearest]);
                let axis = axis.try_normalize(1e-12).unwrap_or(straight.0);
                let opposite = Opposite::Piece { isovalue: other.profile.isovalue };
                let stiffness = Stiffness { own: matter.stiffness_scale, other: other.stiffness_scale };
                (opposite, stiffness, axis, 0.5 * straight.1)
            }
        };
        if matches!(opposite, Opposite::Coat(..)) {
            locale.gather(swarm, i, None, &center, f64::INFINITY);
        }
        self.press = contact::press(locale, center, axis, guess, (sizes.0, sizes.1), stiffness, &opposite);
        self.carriers.clear();
        if self.link == u32::MAX {
            let carriers = &mut self.carriers;
            locale.others_at(&self.press.point, |j, value| carriers.push((j, value)));
            let sum: f64 = carriers.iter().map(|(_, value)| value).sum();
            if sum <= 0.0 {
                let Other::Piece { nearest, .. } = self.other else { return };
                *carriers = vec![(nearest, 1.0)];
            } else {
                carriers.iter_mut().for_each(|(_, value)| *value /= sum);
            }
        }
        let point = self.press.gap.map_or(center + axis * guess, |_| self.press.point);
        // What does not touch yet has at least so far to go, however steep the field is.
        let (pressure, _) = self.press.peak;
        let clearance = -pressure / (stiffness.joint() * STEEPEST * profile.stiffness);
        let patience = if self.press.push == Vec3::zeros() { patience.max(clearance) } else { patience };
        self.rest(swarm, motions, point, patience);
    }

    /// Notes where it was integrated.
    fn rest(&mut self, swarm: &Swarm, motions: &[Motion], point: Vec3, patience: f64) {
        if let Some(motion) = motions.get(self.link as usize) {
            self.arm = motion.rotation.inverse() * (point - (motion.center - swarm.origin));
            self.carriers.clear();
        }
        self.from_anchor = swarm.place[self.particle as usize] - self.anchor(swarm, motions);
        self.patience = patience;
    }
}
