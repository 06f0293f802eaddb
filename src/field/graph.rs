//! The blend graph as a field needs it: cliques of skeletons that all blend with each other, and the smooth maximum over
//! their sums.
//!
//! A body's skeletons add their fields within a clique, and the clique with the most counts \[97, section V-A.2\]:
//! `f = max_k S_k`, `S_k` the sum over clique `k`. Cliques are the largest sets of skeletons of which every two blend, so
//! for A-B and B-C, but not A-C, it is `f_B + max(f_A, f_C)`. (A sum over each skeleton's neighbours would not do: that
//! of B has all three.) A plain maximum has creases; this one is rounded within a band `κ`, for any number of cliques:
//!
//! `f = max over weights w >= 0, Σ w = 1 of Σ w_k S_k + κ/2 (1 - Σ w_k²)`
//!
//! For two cliques that is `max + κ/4 (1 - |S_1 - S_2|/κ)²`: C1, and the plain maximum where they differ by more than `κ`.
//! Cliques tie everywhere that only their common skeletons reach, and there nothing must be added: `κ` is
//! `κ_0 X / (X + 4 κ_0²)`, `X` the sum of `f_i f_j` over pairs that do not blend.
//!
//! Weights between 0 and 1 are a mean of graphs: for `b` in `(0, 1)`, the field is `∫ f_τ dτ` where the graph of `f_τ` has
//! the edges with `b >= τ`. So for two skeletons it is `max + b min`, and for any the field is continuous in every weight.

/// Which skeletons add their fields, by their positions in a list. The default is the complete graph: all add up.
#[derive(Debug, Default, PartialEq)]
pub struct Graph {
    /// Band `κ_0` of the smooth maximum, in units of the field.
    band: f64,
    levels: Vec<Level>,
    /// For each level, where the cliques of each skeleton begin in `cliques`, and the end.
    starts: Vec<u32>,
    /// For each skeleton of each level, its cliques in ascending order.
    cliques: Vec<u32>,
    /// For the particles of a substance, in place of all the above: those of one label add up.
    labels: Vec<u32>,
    /// Pairs of different labels that blend a little, in order, and how much.
    bonds: Vec<([u32; 2], f64)>,
}

/// Edges of at least a certain weight.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Level {
    /// Its part of the field.
    share: f64,
    /// How many cliques it has.
    count: u32,
}

/// A skeleton whose field is not zero at a point: its position, and its field there.
pub type Active = (usize, f64);

/// Working memory of evaluations, and what they gave.
#[derive(Debug, Default)]
pub struct Workspace {
    /// Derivatives of the field by those of the active skeletons.
    pub slopes: Vec<f64>,
    /// Second derivatives, row by row.
    pub bends: Vec<f64>,
    sums: Vec<f64>,
    /// Cliques within the band of the largest, with their sums over `κ`, then their weights.
    top: Vec<(u32, f64)>,
    /// For each active skeleton, the sum of the fields that it does not blend with; then what of the field's derivative
    /// the change of the band is.
    against: Vec<f64>,
    /// The band `κ`.
    band: f64,
}

/// What is asked of an evaluation besides the value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// Nothing.
    Value,
    /// The slopes.
    Slopes,
    /// Slopes and bends.
    Bends,
}

impl Clone for Graph {
    fn clone(&self) -> Self {
        let mut copy = Self::default();
        copy.clone_from(self);
        copy
    }

    /// Into the memory that is there.
    fn clone_from(&mut self, from: &Self) {
        self.band = from.band;
        self.levels.clone_from(&from.levels);
        self.starts.clone_from(&from.starts);
        self.cliques.clone_from(&from.cliques);
        self.labels.clone_from(&from.labels);
        self.bonds.clone_from(&from.bonds);
    }
}

impl Graph {
    /// No cliques yet, with this band; see [`Graph::add_level`].
    pub fn new(band: f64) -> Self {
        Self { band, ..Self::default() }
    }

    /// All that makes it, number by number.
    pub fn each_number(&self, mut number: impl FnMut(u64)) {
        let Self { band, levels, starts, cliques, labels, bonds } = self;
        // Without levels, it is of an earlier use.
        number(if levels.is_empty() { 0 } else { band.to_bits() });
        for Level { share, count } in levels {
            number(share.to_bits());
            number(u64::from(*count));
        }
        for list in [starts, cliques, labels] {
            number(list.len() as u64);
            list.iter().for_each(|entry| number(u64::from(*entry)));
        }
        for ([a, b], weight) in bonds {
            number(u64::from(*a) << 32 | u64::from(*b));
            number(weight.to_bits());
        }
    }

    /// Whether all skeletons add up.
    pub fn is_complete(&self) -> bool {
        self.levels.is_empty() && self.labels.is_empty()
    }

    /// Makes it the graph of a substance: those of one label blend, and two of different labels as far as their bond says;
    /// `bonds` in order, each pair in ascending order (docs/model.md, "Separation and fusion").
    pub fn set_pieces(&mut self, labels: impl Iterator<Item = u32>, bonds: impl Iterator<Item = ([u32; 2], f64)>) {
        self.clear();
        self.labels.extend(labels);
        self.bonds.extend(bonds);
        self.forget_one_piece();
    }

    /// One label, and all add up.
    fn forget_one_piece(&mut self) {
        if self.labels.iter().all(|label| *label == self.labels[0]) {
            self.labels.clear();
            self.bonds.clear();
        }
    }

    /// How far the field may be above the sum of all fields.
    pub fn rise(&self) -> f64 {
        if self.is_complete() { 0.0 } else { 0.5 * self.band }
    }

    /// Makes it the complete graph, and keeps the memory.
    pub fn clear(&mut self) {
        self.levels.clear();
        self.starts.clear();
        self.cliques.clear();
        self.labels.clear();
        self.bonds.clear();
    }

    /// Adds a graph with this share of the field; `cliques_of` lists for each skeleton its cliques, which are less than
    /// `count`, in ascending order.
    pub fn add_level(&mut self, share: f64, count: u32, cliques_of: &[Vec<u32>]) {
        self.levels.push(Level { share, count });
        for cliques in cliques_of {
            self.starts.push(self.cliques.len() as u32);
            self.cliques.extend(cliques);
        }
        self.starts.push(self.cliques.len() as u32);
    }

    /// Number of skeletons.
    fn len(&self) -> usize {
        if self.levels.is_empty() { 0 } else { self.starts.len() / self.levels.len() - 1 }
    }

    fn cliques_of(&self, level: usize, skeleton: usize) -> &[u32] {
        let at = level * (self.len() + 1) + skeleton;
        &self.cliques[self.starts[at] as usize..self.starts[at + 1] as usize]
    }

    /// Size of the largest clique that each skeleton is in, on any level.
    pub fn largest_cliques(&self) -> Vec<usize> {
        let mut largest = vec![1; self.len()];
        for (level, Level { count, .. }) in self.levels.iter().enumerate() {
            let mut sizes = vec![0; *count as usize];
            for skeleton in 0..self.len() {
                self.cliques_of(level, skeleton).iter().for_each(|clique| sizes[*clique as usize] += 1);
            }
            for (skeleton, largest) in largest.iter_mut().enumerate() {
                let sizes = self.cliques_of(level, skeleton).iter().map(|clique| sizes[*clique as usize]);
                *largest = sizes.fold(*largest, usize::max);
            }
        }
        largest
    }

    /// The graph of some of the skeletons, by their positions here in ascending order: where only these reach, the field is the same.
    pub fn restrict(&self, skeletons: &[u32], out: &mut Graph) {
        out.clear();
        if !self.labels.is_empty() {
            out.labels.extend(skeletons.iter().map(|skeleton| self.labels[*skeleton as usize]));
            let place = |end: u32| skeletons.binary_search(&end).ok().map(|place| place as u32);
            let bond = |(pair, weight): &([u32; 2], f64)| Some(([place(pair[0])?, place(pair[1])?], *weight));
            out.bonds.extend(self.bonds.iter().filter_map(bond));
            return out.forget_one_piece();
        }
        out.band = self.band;
        let mut apart = false;
        for (level, Level { share, count }) in self.levels.iter().enumerate() {
            out.levels.push(Level { share: *share, count: *count });
            for skeleton in skeletons {
                out.starts.push(out.cliques.len() as u32);
                out.cliques.extend(self.cliques_of(level, *skeleton as usize));
            }
            out.starts.push(out.cliques.len() as u32);
            apart |= !self.add_up(level, skeletons.iter().map(|skeleton| *skeleton as usize));
        }
        if !apart {
            out.clear();
        }
    }

    /// Whether one clique of a level has all of these skeletons: then their sum is the most.
    fn add_up(&self, level: usize, mut skeletons: impl Iterator<Item = usize> + Clone) -> bool {
        let Some(first) = skeletons.next() else { return true };
        let has = |skeleton: usize, clique: &u32| self.cliques_of(level, skeleton).binary_search(clique).is_ok();
        self.cliques_of(level, first).iter().any(|clique| skeletons.clone().all(|other| has(other, clique)))
    }

    /// Whether two skeletons blend on a level.
    fn blends(&self, level: usize, i: usize, j: usize) -> bool {
        let (mut a, mut b) = (self.cliques_of(level, i), self.cliques_of(level, j));
        while let ([x, rest_a @ ..], [y, rest_b @ ..]) = (a, b) {
            match x.cmp(y) {
                std::cmp::Ordering::Less => a = rest_a,
                std::cmp::Ordering::Greater => b = rest_b,
                std::cmp::Ordering::Equal => return true,
            }
        }
        false
    }

    /// The field of the active skeletons together, and its derivatives by their fields; the second ones without those
    /// that the band's own change has.
    pub fn combine(&self, active: &[Active], order: Order, work: &mut Workspace) -> f64 {
        work.slopes.clear();
        work.slopes.resize(active.len(), 0.0);
        work.bends.clear();
        work.bends.resize(if order == Order::Bends { active.len() * active.len() } else { 0 }, 0.0);
        if !self.labels.is_empty() {
            return self.combine_pieces(active, order, work);
        }
        let mut value = 0.0;
        for (level, Level { share, count }) in self.levels.iter().enumerate() {
            if self.add_up(level, active.iter().map(|(skeleton, _)| *skeleton)) {
                value += share * active.iter().map(|(_, value)| value).sum::<f64>();
                work.slopes.iter_mut().for_each(|slope| *slope += share);
                continue;
            }
            value += share * self.combine_level(level, *count as usize, active, work);
            if order == Order::Value {
                continue;
            }
            let Workspace { slopes, bends, top, against, band, .. } = work;
            let is_in =
                |place: usize, clique: u32| self.cliques_of(level, active[place].0).binary_search(&clique).is_ok();
            for (place, slope) in slopes.iter_mut().enumerate() {
                let weights = top.iter().filter(|(clique, _)| is_in(place, *clique)).map(|(_, weight)| weight);
                *slope += share * (weights.sum::<f64>() + against[place]);
            }
            if order == Order::Bends && top.len() > 1 {
                let count = |has: &dyn Fn(u32) -> bool| top.iter().filter(|(clique, _)| has(*clique)).count() as f64;
                for (at, bend) in bends.iter_mut().enumerate() {
                    let (i, j) = (at / active.len(), at % active.len());
                    let both = count(&|clique| is_in(i, clique) && is_in(j, clique));
                    let product = count(&|clique| is_in(i, clique)) * count(&|clique| is_in(j, clique));
                    *bend += share / *band * (both - product / top.len() as f64);
                }
            }
        }
        value
    }

    /// `f_A + Q / f_A`, where A has the most field and `Q` is the sum of `b_ij f_i f_j` over `i` in A and `j` elsewhere:
    /// `f_A + f_B` where all bonds are 1, the larger of the two where all are 0, and continuous in between.
    fn combine_pieces(&self, active: &[Active], order: Order, work: &mut Workspace) -> f64 {
        let Workspace { slopes, bends, top, against, .. } = work;
        top.clear();
        for (skeleton, value) in active {
            let label = self.labels[*skeleton];
            match top.iter_mut().find(|(other, _)| *other == label) {
                Some((_, sum)) => *sum += value,
                None => top.push((label, *value)),
            }
        }
        let most = top.iter().copied().reduce(|most, next| if next.1 > most.1 { next } else { most });
        let Some((label, sum)) = most else { return 0.0 };
        let is_own = |place: usize| self.labels[active[place].0] == label;
        // What each of A gets through its bonds, and each of the others.
        against.clear();
        against.resize(active.len(), 0.0);
        let mut product = 0.0;
        let each_bond = |tell: &mut dyn FnMut(usize, usize, f64)| {
            for i in (0..active.len()).filter(|i| !self.bonds.is_empty() && is_own(*i)) {
                for j in (0..active.len()).filter(|j| !is_own(*j)) {
                    let (a, b) = (active[i].0 as u32, active[j].0 as u32);
                    let bond = self.bonds.binary_search_by_key(&[a.min(b), a.max(b)], |(pair, _)| *pair);
                    if let Ok(at) = bond {
                        tell(i, j, self.bonds[at].1);
                    }
                }
            }
        };
        each_bond(&mut |i, j, weight| {
            against[i] += weight * active[j].1;
            against[j] += weight * active[i].1;
            product += weight * active[i].1 * active[j].1;
        });
        let value = sum + product / sum;
        if order == Order::Value {
            return value;
        }
        for (place, slope) in slopes.iter_mut().enumerate() {
            *slope = against[place] / sum + if is_own(place) { 1.0 - product / (sum * sum) } else { 0.0 };
        }
        if order == Order::Bends && product > 0.0 {
            let count = active.len();
            for (at, bend) in bends.iter_mut().enumerate() {
                let (i, j) = (at / count, at % count);
                let square = sum * sum;
                if is_own(i) {
                    *bend -= against[j] / square;
                }
                if is_own(j) {
                    *bend -= against[i] / square;
                }
                if is_own(i) && is_own(j) {
                    *bend += 2.0 * product / (square * sum);
                }
            }
            each_bond(&mut |i, j, weight| {
                bends[i * count + j] += weight / sum;
                bends[j * count + i] += weight / sum;
            });
        }
        value
    }

    /// The smooth maximum of one level. Leaves in `top` the weights of the cliques, and in `against` what the derivative
    /// by each active skeleton has from the band's own change.
    fn combine_level(&self, level: usize, count: usize, active: &[Active], work: &mut Workspace) -> f64 {
        let Workspace { sums, top, against, band, .. } = work;
        sums.clear();
        sums.resize(count, 0.0);
        against.clear();
        against.resize(active.len(), 0.0);
        for (skeleton, value) in active {
            for clique in self.cliques_of(level, *skeleton) {
                sums[*clique as usize] += value;
            }
        }
        let mut first = 0;
        for (clique, sum) in sums.iter().enumerate() {
            if *sum > sums[first] {
                first = clique;
            }
        }
        let most = sums.get(first).copied().unwrap_or(0.0);
        let near = |sum: &f64| *sum > most - self.band;
        top.clear();
        if sums.iter().filter(|sum| near(sum)).count() > 1 {
            let mut apart = 0.0;
            for (place, (i, value)) in active.iter().enumerate() {
                for (other, (j, other_value)) in active.iter().enumerate().skip(place + 1) {
                    if !self.blends(level, *i, *j) {
                        apart += value * other_value;
                        against[place] += other_value;
                        against[other] += value;
                    }
                }
            }
            let soft = 4.0 * self.band * self.band;
            *band = self.band * apart / (apart + soft);
            if *band > 1e-9 * self.band {
                let close = sums.iter().enumerate().filter(|(_, sum)| **sum > most - *band);
                top.extend(close.map(|(clique, sum)| (clique as u32, (sum - most) / *band)));
                let square = weigh(top);
                let spread = 0.5 * (1.0 - square);
                let by_apart = spread * self.band * soft / (apart + soft).powi(2);
                against.iter_mut().for_each(|against| *against *= by_apart);
                let mean: f64 = top.iter().map(|(clique, weight)| weight * sums[*clique as usize]).sum();
                return mean + *band * spread;
            }
            against.fill(0.0);
        }
        top.push((first as u32, 1.0));
        most
    }
}

/// From scores, the largest of which is 0, to the weights that maximise `Σ w z + (1 - Σ w²)/2`: the point of the simplex
/// next to them. Gives the sum of their squares.
fn weigh(top: &mut Vec<(u32, f64)>) -> f64 {
    top.sort_unstable_by(|a, b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
    let (mut sum, mut level) = (0.0, 0.0);
    for (place, (_, score)) in top.iter().enumerate() {
        let count = (place + 1) as f64;
        if 1.0 + count * score <= sum + score {
            break;
        }
        sum += score;
        level = (sum - 1.0) / count;
    }
    top.iter_mut().for_each(|(_, score)| *score = (*score - level).max(0.0));
    top.retain(|(_, weight)| *weight > 0.0);
    top.iter().map(|(_, weight)| weight * weight).sum()
}
