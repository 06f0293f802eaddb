//! Which links carry the nodes of a patch, and what part each: nodes that are carried nearly alike are put together, so
//! that a patch on a body of many links is a few groups of points and not a group for each point.

use crate::contact::pair::Pair;
use crate::contact::patch::Node;
use crate::contact::press::{Carriers, Share};
use crate::math::Vec3;

/// Steps a unit in which shares are compared.
const STEPS: f64 = 32.0;

/// The nodes of a patch, by who carries them.
#[derive(Debug, Default)]
pub struct Sharing {
    carriers: Carriers,
    /// One link carries all on either side.
    single: bool,
    /// Of each node that was asked for, one after the other; weights are positive on b, negative on a.
    shares: Vec<Share>,
    /// The shares of the first node of each kind.
    firsts: Vec<(usize, usize)>,
    /// Nodes with a load, unless it is all one.
    places: Vec<Place>,
    /// Of one kind.
    means: Vec<Share>,
}

/// A node with a load.
#[derive(Clone, Copy, Debug)]
struct Place {
    kind: usize,
    node: usize,
    load: f64,
    shares: (usize, usize),
}

impl Sharing {
    /// Finds who carries the nodes of a patch.
    pub fn find(&mut self, pair: &Pair, nodes: &[Node]) {
        self.shares.clear();
        self.firsts.clear();
        self.places.clear();
        self.single = pair.a.only_link().is_some() && pair.b.only_link().is_some();
        for (node, Node { position, force, .. }) in loaded(nodes) {
            let (kind, shares) = self.kind_at(pair, position);
            if self.single {
                return;
            }
            self.places.push(Place { kind, node, load: force.norm(), shares });
        }
        self.places.sort_unstable_by_key(|place| (place.kind, place.node));
    }

    /// The kind of a node, and its shares.
    fn kind_at(&mut self, pair: &Pair, position: &Vec3) -> (usize, (usize, usize)) {
        let Self { carriers, shares, firsts, .. } = self;
        let first = shares.len();
        carriers.find(pair, position);
        shares.extend(carriers.both());
        let of = |(first, end): (usize, usize)| &shares[first..end];
        let range = (first, shares.len());
        // The last ones first: who is next to another is mostly carried like it.
        let kind = firsts.iter().rposition(|kind| alike(of(*kind), of(range))).unwrap_or(firsts.len());
        if kind == firsts.len() {
            firsts.push(range);
        }
        (kind, range)
    }

    /// Tells `add` the nodes of each kind, and the mean shares of the links that carry them: each link bears the same load
    /// by these as node by node.
    pub fn each_kind<'a>(
        &mut self,
        nodes: &'a [Node],
        mut add: impl FnMut(&mut dyn Iterator<Item = &'a Node>, &[Share]),
    ) {
        let Self { single, shares, places, means, .. } = self;
        if *single {
            return add(&mut loaded(nodes).map(|(_, node)| node), shares);
        }
        for places in places.chunk_by(|a, b| a.kind == b.kind) {
            means.clear();
            let total: f64 = places.iter().map(|place| place.load).sum();
            for place in places {
                for share in &shares[place.shares.0..place.shares.1] {
                    let weight = share.weight * place.load / total;
                    match means.iter_mut().find(|mean| are_one(mean, share)) {
                        Some(mean) => mean.weight += weight,
                        None => means.push(Share { weight, ..*share }),
                    }
                }
            }
            add(&mut places.iter().map(|place| &nodes[place.node]), means);
        }
    }
}

/// The nodes that bear something, with their positions.
fn loaded(nodes: &[Node]) -> impl Iterator<Item = (usize, &Node)> {
    nodes.iter().enumerate().filter(|(_, node)| node.force != Vec3::zeros())
}

/// Whether both are of one link, and of one side.
fn are_one(a: &Share, b: &Share) -> bool {
    a.link == b.link && a.weight.signum() == b.weight.signum()
}

/// Whether the same links have nearly the same shares.
fn alike(some: &[Share], others: &[Share]) -> bool {
    // Both are of one side, and so of one sign.
    let rounded = |share: &Share| (share.weight.abs() * STEPS + 0.5) as u32;
    let within = |some: &[Share], others: &[Share]| {
        some.iter().all(|share| rounded(share) == others.iter().find(|other| are_one(other, share)).map_or(0, rounded))
    };
    within(some, others) && within(others, some)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shares(list: &[(u32, f64)]) -> Vec<Share> {
        list.iter().map(|(link, weight)| Share { link: *link, weight: *weight }).collect()
    }

    #[test]
    fn shares_are_alike_to_a_sixtyfourth() {
        let node = shares(&[(3, -1.0), (1, 0.5), (2, 0.5)]);
        let is_like = |list: &[(u32, f64)]| alike(&node, &shares(list)) && alike(&shares(list), &node);
        assert!(is_like(&[(3, -1.0), (2, 0.51), (1, 0.49)]), "in any order");
        assert!(is_like(&[(3, -1.0), (1, 0.495), (2, 0.49), (4, 0.015)]), "but for what hardly counts");
        assert!(!is_like(&[(3, -1.0), (1, 0.53), (2, 0.47)]));
        assert!(!is_like(&[(3, -1.0), (1, 1.0)]));
        assert!(!is_like(&[(3, 1.0), (1, 0.5), (2, 0.5)]), "sides count");
    }
}
