//! Who blends with whom in a body, and which of its parts collide.

use super::step::Stepping;
use super::{Body, BodyId, LinkId, LogLevel, SkeletonId, World, sleep};
use crate::coat::cliques::{self, Block, Weights};
use crate::error::{Error, Result, require};
use crate::field::Graph;

/// Most skeletons of a body with a blend graph.
const MOST_SKELETONS: usize = 1024;

/// A body's blend graph. Bodies without one blend all over, and pay nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Blending {
    /// Whether skeletons blend by their links only: those of one link, and of links that are joined.
    pub by_links: bool,
    /// Pairs of links that are joined, by their slots.
    pub joints: Vec<[u32; 2]>,
    /// Pairs of skeletons of which the host has said something, by their slots, the smaller first; in order.
    pub pairs: Vec<Pairing>,
    /// What this comes to for the enabled skeletons, by their positions among these.
    pub graph: Graph,
    /// How many skeletons are in the largest clique of each; empty when all blend.
    pub together: Vec<usize>,
    /// The slots of the enabled skeletons.
    pub order: Vec<u32>,
    pub blocks: Vec<Block>,
}

/// What the host has said of two skeletons.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Pairing {
    pub skeletons: [u32; 2],
    /// How much they blend now; `None` where the rule holds.
    pub weight: Option<f64>,
    /// What the weight goes to.
    pub target: f64,
    /// How fast \[1/s\].
    pub rate: f64,
    /// They never collide.
    pub apart: bool,
}

impl Blending {
    fn find(&self, skeletons: [u32; 2]) -> std::result::Result<usize, usize> {
        self.pairs.binary_search_by_key(&skeletons, |pair| pair.skeletons)
    }

    fn pair_mut(&mut self, skeletons: [u32; 2]) -> &mut Pairing {
        let at = self.find(skeletons).unwrap_or_else(|at| {
            let fresh = Pairing { skeletons, weight: None, target: 0.0, rate: 0.0, apart: false };
            self.pairs.insert(at, fresh);
            at
        });
        &mut self.pairs[at]
    }

    fn rule(&self, links: [u32; 2]) -> f64 {
        let joined = |joint: &[u32; 2]| *joint == links || *joint == [links[1], links[0]];
        f64::from(u8::from(!self.by_links || links[0] == links[1] || self.joints.iter().any(joined)))
    }

    /// What has been said of a skeleton is no longer true of the next in its slot.
    pub fn forget_skeleton(&mut self, slot: u32) {
        self.pairs.retain(|pair| !pair.skeletons.contains(&slot));
    }

    pub fn forget_link(&mut self, slot: u32) {
        self.joints.retain(|joint| !joint.contains(&slot));
    }

    fn is_ramping(&self) -> bool {
        self.pairs.iter().any(|pair| pair.rate > 0.0)
    }

    /// Whether nothing differs from a body without a graph.
    fn is_idle(&self) -> bool {
        !self.by_links && self.pairs.is_empty()
    }
}

/// Blend graphs.
impl World {
    /// Sets how much two skeletons of a body blend, from 0 to 1, at once or over `duration` seconds. Those that don't blend
    /// fully collide, as far as they don't, if they are of different links and [`BodyDesc::self_contact`] is on.
    ///
    /// [`BodyDesc::self_contact`]: super::BodyDesc::self_contact
    pub fn set_blend(&mut self, a: SkeletonId, b: SkeletonId, weight: f64, duration: f64) -> Result<()> {
        require("weight", weight, "from 0 to 1", |x| (0.0..=1.0).contains(&x))?;
        require("duration", duration, "finite and at least 0 s", |x| x >= 0.0)?;
        let now = self.blend(a, b)?;
        let rate = (weight - now).abs() / duration;
        let ramps = duration > 0.0 && rate > 0.0 && rate.is_finite();
        self.change_blending(self.body_of_pair(a, b)?, |blending| {
            let pair = blending.pair_mut(ordered(a, b));
            (pair.target, pair.rate, pair.weight) =
                if ramps { (weight, rate, Some(now)) } else { (weight, 0.0, Some(weight)) };
        })
    }

    /// How much two skeletons of a body blend now.
    pub fn blend(&self, a: SkeletonId, b: SkeletonId) -> Result<f64> {
        let body = self.body_of_pair(a, b)?;
        let links = [a, b].map(|skeleton| self.skeletons[skeleton.index()].link);
        let Some(blending) = &self.bodies[body].blending else { return Ok(1.0) };
        Ok(weight_in(blending, ordered(a, b), links))
    }

    /// Lets exactly those skeletons of a body blend that are of the same link, or of two links that are joined: forgets
    /// what has been said of its pairs before, and holds for skeletons created later.
    pub fn blend_neighbours(&mut self, body: BodyId, joints: &[(LinkId, LinkId)]) -> Result<()> {
        self.bodies.get(body)?;
        for joint in joints {
            for link in [joint.0, joint.1] {
                if self.links.get(link)?.body != body.raw.index {
                    return Err(Error::Unsupported("a joint with a link of another body"));
                }
            }
            if joint.0 == joint.1 {
                return Err(Error::Unsupported("a joint of a link with itself"));
            }
        }
        let joints = joints.iter().map(|joint| [joint.0.raw.index, joint.1.raw.index]).collect();
        self.change_blending(body.index(), |blending| {
            blending.by_links = true;
            blending.joints = joints;
            // Who never collides, still does not.
            blending.pairs.retain(|pair| pair.apart);
            blending.pairs.iter_mut().for_each(|pair| (pair.weight, pair.rate) = (None, 0.0));
        })
    }

    /// Lets all skeletons of a body blend, as in the beginning, and forgets what has been said of its pairs.
    pub fn blend_all(&mut self, body: BodyId) -> Result<()> {
        self.bodies.get_mut(body)?.blending = None;
        self.refresh(body.index());
        Ok(())
    }

    /// Says whether two skeletons of a body may collide where they don't blend; they may, unless told otherwise.
    pub fn set_pair_contact(&mut self, a: SkeletonId, b: SkeletonId, enabled: bool) -> Result<()> {
        self.change_blending(self.body_of_pair(a, b)?, |blending| blending.pair_mut(ordered(a, b)).apart = !enabled)
    }

    fn body_of_pair(&self, a: SkeletonId, b: SkeletonId) -> Result<usize> {
        let body_of = |id| Ok(self.links[self.skeletons.get(id)?.link as usize].body);
        let (body, other) = (body_of(a)?, body_of(b)?);
        if a == b {
            return Err(Error::Unsupported("a skeleton blends with itself, always"));
        }
        if body != other {
            return Err(Error::Unsupported("skeletons of two bodies don't blend"));
        }
        Ok(body as usize)
    }

    /// Changes a body's graph, or nothing when it cannot be, or when what it is on its way to cannot be.
    fn change_blending(&mut self, body: usize, change: impl FnOnce(&mut Blending)) -> Result<()> {
        let mut changed = self.bodies[body].blending.as_deref().cloned().unwrap_or_default();
        change(&mut changed);
        self.compile(body, &mut changed)?;
        if changed.is_ramping() {
            let mut goal = changed.clone();
            goal.pairs.iter_mut().filter(|pair| pair.rate > 0.0).for_each(|pair| pair.weight = Some(pair.target));
            self.compile(body, &mut goal)?;
        }
        self.bodies[body].blending = Some(Box::new(changed)).filter(|blending| !blending.is_idle());
        self.rouse(body as u32);
        self.unsettle(body);
        self.measure_reach(body);
        Ok(())
    }

    /// Works out what a body's graph comes to.
    fn compile(&self, body: usize, blending: &mut Blending) -> Result<()> {
        let body = &self.bodies[body];
        let skeletons: Vec<(u32, u32)> = self.skeletons_of(body).map(|(link, slot, _)| (link, slot)).collect();
        require("number of skeletons in a body with a blend graph", skeletons.len() as f64, "at most 1024", |x| {
            x <= MOST_SKELETONS as f64
        })?;
        let pair = |i: usize, j: usize| {
            let (a, b) = (skeletons[i], skeletons[j]);
            ([a.1.min(b.1), a.1.max(b.1)], [a.0, b.0])
        };
        let weights = Weights::new(skeletons.len(), |i, j| {
            let (slots, links) = pair(i, j);
            weight_in(blending, slots, links)
        });
        let graph = cliques::graph(&weights, body.desc.blend_band * body.desc.isovalue)?;
        let collide = body.desc.self_contact && !body.desc.rigid;
        let blocks = cliques::blocks(&weights, |i, j| {
            let (slots, links) = pair(i, j);
            let apart = || blending.find(slots).is_ok_and(|at| blending.pairs[at].apart);
            collide && links[0] != links[1] && !apart()
        });
        blending.together = graph.largest_cliques();
        (blending.graph, blending.blocks) = (graph, blocks);
        blending.order = skeletons.iter().map(|(_, slot)| *slot).collect();
        Ok(())
    }

    /// Brings a body's graph up to date after a change of its parts.
    pub(super) fn compile_blending(&mut self, slot: usize) {
        let Some(mut blending) = self.bodies[slot].blending.take() else { return };
        if let Err(error) = self.compile(slot, &mut blending) {
            (blending.graph, blending.together, blending.order, blending.blocks) = Default::default();
            if let Some(log) = self.log.get_mut() {
                let id = self.bodies.id_of(slot);
                log(LogLevel::Warning, &format!("body {id:?}: all its skeletons blend until it is changed: {error}"));
            }
        }
        self.bodies[slot].blending = Some(blending);
    }

    /// Moves the weights that are on their way.
    pub(super) fn ramp_blends(&mut self, state: &Stepping, dt: f64) {
        for slot in 0..self.bodies.capacity() {
            let Some(Body { blending: Some(blending), .. }) = self.bodies.at_mut(slot) else { continue };
            if !blending.is_ramping() {
                continue;
            }
            for pair in &mut blending.pairs {
                if let Some(weight) = pair.weight.as_mut().filter(|_| pair.rate > 0.0) {
                    let left = pair.target - *weight;
                    // Rounding must not make it a step late.
                    let arrives = left.abs() <= pair.rate * dt * (1.0 + 1e-9);
                    *weight = if arrives { pair.target } else { *weight + pair.rate * dt * left.signum() };
                    pair.rate = if arrives { 0.0 } else { pair.rate };
                }
            }
            // Who leans on it, too.
            sleep::rouse(&mut self.bodies, &state.resting, slot as u32);
            self.unsettle(slot);
            self.compile_blending(slot);
            self.measure_reach(slot);
        }
    }
}

fn weight_in(blending: &Blending, skeletons: [u32; 2], links: [u32; 2]) -> f64 {
    let said = blending.find(skeletons).ok().and_then(|at| blending.pairs[at].weight);
    said.unwrap_or_else(|| blending.rule(links))
}

fn ordered(a: SkeletonId, b: SkeletonId) -> [u32; 2] {
    let (a, b) = (a.raw.index, b.raw.index);
    [a.min(b), a.max(b)]
}
