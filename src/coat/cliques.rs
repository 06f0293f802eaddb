//! From who blends with whom to the cliques of skeletons whose fields add up ([`graph`]), and the groups that collide
//! ([`blocks`]) \[97, sections V-A.2 and V-A.3\].

use crate::error::{Error, Result};
use crate::field::Graph;

/// How much every two skeletons of a body blend, from 0 to 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Weights {
    count: usize,
    weights: Vec<f64>,
}

impl Weights {
    /// Of `count` skeletons; `weight` is asked once a pair, the smaller position first.
    pub fn new(count: usize, weight: impl Fn(usize, usize) -> f64) -> Self {
        let mut weights = vec![1.0; count * count];
        for i in 0..count {
            for j in i + 1..count {
                let weight = weight(i, j);
                (weights[i * count + j], weights[j * count + i]) = (weight, weight);
            }
        }
        Self { count, weights }
    }

    /// How much two skeletons blend.
    pub fn get(&self, i: usize, j: usize) -> f64 {
        self.weights[i * self.count + j]
    }
}

/// Most cliques that a graph may have, those of all its weights together: `n` skeletons can have `3^(n/3)`.
pub const MOST_CLIQUES: usize = 4096;
const TOO_MANY: Error = Error::Unsupported(
    "the blend graph has more than 4096 cliques: largest sets of skeletons of which every two blend",
);

/// The graph of the fields, with a band in units of the field. Refuses one of more than [`MOST_CLIQUES`] cliques.
pub fn graph(weights: &Weights, band: f64) -> Result<Graph> {
    let mut graph = Graph::new(band);
    let mut thresholds: Vec<f64> = weights.weights.iter().copied().filter(|weight| *weight > 0.0).collect();
    thresholds.sort_by(f64::total_cmp);
    thresholds.dedup();
    if !weights.weights.iter().any(|weight| *weight < 1.0) {
        return Ok(graph);
    }
    let (mut below, mut count) = (0.0, 0);
    for threshold in thresholds {
        let cliques = largest_cliques(weights, threshold)?;
        count += cliques.len();
        if count > MOST_CLIQUES {
            return Err(TOO_MANY);
        }
        let mut cliques_of = vec![Vec::new(); weights.count];
        for (index, clique) in cliques.iter().enumerate() {
            clique.iter().for_each(|skeleton| cliques_of[*skeleton as usize].push(index as u32));
        }
        graph.add_level(threshold - below, cliques.len() as u32, &cliques_of);
        below = threshold;
    }
    Ok(graph)
}

/// A set of skeletons.
#[derive(Clone, Debug, PartialEq)]
struct Set(Vec<u64>);

impl Set {
    fn empty(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }

    fn insert(&mut self, index: usize) {
        self.0[index / 64] |= 1 << (index % 64);
    }

    fn remove(&mut self, index: usize) {
        self.0[index / 64] &= !(1 << (index % 64));
    }

    fn contains(&self, index: usize) -> bool {
        self.0[index / 64] >> (index % 64) & 1 == 1
    }

    fn and(&self, other: &Self) -> Self {
        Self(self.0.iter().zip(&other.0).map(|(a, b)| a & b).collect())
    }

    fn len(&self) -> u32 {
        self.0.iter().map(|word| word.count_ones()).sum()
    }

    fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.0.len() * 64).filter(|index| self.contains(*index))
    }
}

/// The largest sets of skeletons of which every two blend by at least `threshold`, by Bron and Kerbosch's search with a
/// pivot.
fn largest_cliques(weights: &Weights, threshold: f64) -> Result<Vec<Vec<u32>>> {
    let count = weights.count;
    let mut neighbours = vec![Set::empty(count); count];
    for (i, set) in neighbours.iter_mut().enumerate() {
        (0..count).filter(|j| *j != i && weights.get(i, *j) >= threshold).for_each(|j| set.insert(j));
    }
    let mut all = Set::empty(count);
    (0..count).for_each(|index| all.insert(index));
    let mut found = Vec::new();
    extend(&neighbours, &mut Vec::new(), all, Set::empty(count), &mut found)?;
    Ok(found)
}

/// Extends a clique by members of `open`; those in `done` have been tried.
fn extend(
    neighbours: &[Set],
    clique: &mut Vec<u32>,
    mut open: Set,
    mut done: Set,
    found: &mut Vec<Vec<u32>>,
) -> Result<()> {
    let pivot = open.iter().chain(done.iter()).max_by_key(|index| open.and(&neighbours[*index]).len());
    let Some(pivot) = pivot else {
        if found.len() == MOST_CLIQUES {
            return Err(TOO_MANY);
        }
        let mut sorted = clique.clone();
        sorted.sort_unstable();
        found.push(sorted);
        return Ok(());
    };
    for index in open.iter().collect::<Vec<_>>() {
        if !neighbours[pivot].contains(index) {
            clique.push(index as u32);
            extend(neighbours, clique, open.and(&neighbours[index]), done.and(&neighbours[index]), found)?;
            clique.pop();
            open.remove(index);
            done.insert(index);
        }
    }
    Ok(())
}

/// Two groups of skeletons, none of one blending fully with any of the other: they collide.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Positions of the skeletons on each side, ascending; every two of a side blend fully.
    pub sides: [Vec<u32>; 2],
    /// Skeletons that blend with some of both sides, and by how much: in their territories the two don't collide.
    pub covers: Vec<(u32, f64)>,
    /// How much they collide: 1 less the weight by which they blend.
    pub share: f64,
}

/// Splits the pairs that collide into blocks, each pair in one. `collides` says which pairs may, besides not blending
/// fully.
pub fn blocks(weights: &Weights, collides: impl Fn(usize, usize) -> bool) -> Vec<Block> {
    let count = weights.count;
    let mut open = vec![false; count * count];
    for i in 0..count {
        for j in i + 1..count {
            let hit = weights.get(i, j) < 1.0 && collides(i, j);
            (open[i * count + j], open[j * count + i]) = (hit, hit);
        }
    }
    let mut found = Vec::new();
    for i in 0..count {
        for j in i + 1..count {
            if !open[i * count + j] {
                continue;
            }
            let weight = weights.get(i, j);
            let mut sides = [vec![i as u32], vec![j as u32]];
            for k in (0..count).filter(|k| *k != i && *k != j) {
                for side in 0..2 {
                    let blends = sides[side].iter().all(|other| weights.get(k, *other as usize) == 1.0);
                    let hits = sides[1 - side]
                        .iter()
                        .all(|other| open[k * count + *other as usize] && weights.get(k, *other as usize) == weight);
                    if blends && hits {
                        sides[side].push(k as u32);
                        break;
                    }
                }
            }
            for a in &sides[0] {
                for b in &sides[1] {
                    let (a, b) = (*a as usize, *b as usize);
                    (open[a * count + b], open[b * count + a]) = (false, false);
                }
            }
            sides.iter_mut().for_each(|side| side.sort_unstable());
            let most =
                |k: usize, side: &[u32]| side.iter().map(|other| weights.get(k, *other as usize)).fold(0.0, f64::max);
            let covers = (0..count).filter(|k| sides.iter().all(|side| !side.contains(&(*k as u32))));
            let covers = covers.map(|k| (k as u32, most(k, &sides[0]).min(most(k, &sides[1]))));
            let covers = covers.filter(|(_, weight)| *weight > 0.0).collect();
            found.push(Block { sides, covers, share: 1.0 - weight });
        }
    }
    found
}
