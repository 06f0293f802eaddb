//! Which links carry the nodes of a patch, and what part each: nodes that are carried nearly alike are put together, so
//! that a patch on a body of many links is a few groups of points and not a group for each point.

use crate::contact::pair::Pair;
use crate::contact::patch::Node;
use crate::contact::press::Carriers;

/// Steps a unit in which parts are compared.
const STEPS: f64 = 8.0;

/// A link, and its part in what happens at a point: positive on b, negative on a.
pub type Part = (u32, f64);

/// The nodes of a patch, by who carries them.
#[derive(Debug, Default)]
pub struct Sharing {
    carriers: Carriers,
    /// Of each node that was asked for, one after the other.
    parts: Vec<Part>,
    /// The parts in the first node of each kind.
    firsts: Vec<(usize, usize)>,
    /// Nodes with a load.
    places: Vec<Place>,
    /// Of each kind, one after the other.
    means: Vec<Part>,
}

/// A node with a load.
#[derive(Clone, Copy, Debug)]
struct Place {
    kind: usize,
    node: usize,
    load: f64,
    parts: (usize, usize),
}

impl Sharing {
    /// Finds who carries the nodes of a patch.
    pub fn find(&mut self, pair: &Pair, nodes: &[Node]) {
        self.parts.clear();
        self.firsts.clear();
        self.places.clear();
        let single = pair.a.only_link().is_some() && pair.b.only_link().is_some();
        for (node, Node { position, force, .. }) in nodes.iter().enumerate() {
            let load = force.norm();
            if load <= 0.0 {
                continue;
            }
            let (kind, parts) = match self.firsts.first() {
                Some(first) if single => (0, *first),
                _ => self.kind_at(pair, position),
            };
            self.places.push(Place { kind, node, load, parts });
        }
        self.places.sort_by_key(|place| place.kind);
    }

    fn kind_at(&mut self, pair: &Pair, position: &crate::math::Vec3) -> (usize, (usize, usize)) {
        let first = self.parts.len();
        self.carriers.find(pair, position);
        self.parts.extend(self.carriers.a.iter().map(|share| (share.link, -share.weight)));
        self.parts.extend(self.carriers.b.iter().map(|share| (share.link, share.weight)));
        let parts = (first, self.parts.len());
        let of = |(first, end): (usize, usize)| &self.parts[first..end];
        let kind = self.firsts.iter().position(|kind| alike(of(*kind), of(parts))).unwrap_or(self.firsts.len());
        if kind == self.firsts.len() {
            self.firsts.push(parts);
        }
        (kind, parts)
    }

    /// Tells `add` the nodes of each kind, and the mean parts of the links that carry them: each link bears the same load
    /// by these as node by node.
    pub fn each_kind<'a>(
        &mut self,
        nodes: &'a [Node],
        mut add: impl FnMut(&mut dyn Iterator<Item = &'a Node>, &[Part]),
    ) {
        let Self { parts, places, means, .. } = self;
        for places in places.chunk_by(|a, b| a.kind == b.kind) {
            means.clear();
            let total: f64 = places.iter().map(|place| place.load).sum();
            for place in places {
                for (link, part) in &parts[place.parts.0..place.parts.1] {
                    let share = part * place.load / total;
                    match means.iter_mut().find(|(other, mean)| other == link && mean.signum() == part.signum()) {
                        Some((_, mean)) => *mean += share,
                        None => means.push((*link, share)),
                    }
                }
            }
            add(&mut places.iter().map(|place| &nodes[place.node]), means);
        }
    }
}

/// Whether the same links have nearly the same parts.
fn alike(some: &[Part], others: &[Part]) -> bool {
    let rounded = |part: f64| (part * STEPS).round();
    let of = |parts: &[Part], (link, part): &Part| {
        let same = parts.iter().find(|(other, others)| other == link && others.signum() == part.signum());
        same.map_or(0.0, |(_, part)| rounded(*part))
    };
    let within = |some: &[Part], others: &[Part]| some.iter().all(|part| rounded(part.1) == of(others, part));
    within(some, others) && within(others, some)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_alike_to_a_sixteenth() {
        let node = [(3, -1.0), (1, 0.5), (2, 0.5)];
        assert!(alike(&node, &[(3, -1.0), (2, 0.53), (1, 0.47)]), "in any order");
        assert!(alike(&node, &[(3, -1.0), (1, 0.49), (2, 0.47), (4, 0.04)]), "but for what hardly counts");
        assert!(!alike(&node, &[(3, -1.0), (1, 0.6), (2, 0.4)]));
        assert!(!alike(&node, &[(3, -1.0), (1, 1.0)]) && !alike(&[(3, -1.0), (1, 1.0)], &node));
        assert!(!alike(&[(1, -1.0), (2, 1.0)], &[(1, 1.0), (2, -1.0)]), "sides count");
    }
}
