//! A symmetric positive definite system in envelope (skyline) storage: what couples the links of an island.
//!
//! Links are put in reverse Cuthill-McKee order, which keeps neighbours close, so the factor of a pile or a stack stays
//! narrow. The factor has the envelope of the matrix: nothing is searched, and nothing allocated once the buffers have
//! grown.

use nalgebra::Matrix6;

/// Unknowns of a link.
pub const BLOCK: usize = 6;

/// The system and its factor.
#[derive(Debug, Default)]
pub struct Envelope {
    /// First column of each row.
    first: Vec<u32>,
    /// Where each row's diagonal element lies in `values`.
    diagonal: Vec<usize>,
    /// The rows from their first column to the diagonal, one after the other.
    values: Vec<f64>,
}

impl Envelope {
    /// Products that a factor of this shape takes, nearly.
    pub fn cost(first: &[u32]) -> usize {
        let square = |(block, first): (usize, &u32)| BLOCK * (BLOCK * (block + 1 - *first as usize)).pow(2) / 2;
        first.iter().enumerate().map(square).sum()
    }

    /// Sets the shape, all zero: `first[i]` is the first block that couples with block `i`.
    pub fn reset(&mut self, first: &[u32]) {
        self.shape(first.iter().copied());
    }

    fn shape(&mut self, first: impl Iterator<Item = u32>) {
        self.first.clear();
        self.diagonal.clear();
        let mut length = 0;
        for (block, first) in first.enumerate() {
            for row in 0..BLOCK {
                let first = first as usize * BLOCK;
                length += block * BLOCK + row - first + 1;
                self.first.push(first as u32);
                self.diagonal.push(length - 1);
            }
        }
        self.clear(length);
    }

    fn clear(&mut self, length: usize) {
        self.values.clear();
        self.values.resize(length, 0.0);
    }

    /// All zero again, of the same shape.
    pub fn zero(&mut self) {
        let length = self.values.len();
        self.clear(length);
    }

    /// Adds a block at block row `i` and block column `j`, at most `i`; of a diagonal block the lower triangle.
    pub fn add(&mut self, i: usize, j: usize, block: &Matrix6<f64>) {
        for r in 0..BLOCK {
            let row = i * BLOCK + r;
            let start = self.diagonal[row] + j * BLOCK - row;
            let width = if i == j { r + 1 } else { BLOCK };
            for c in 0..width {
                self.values[start + c] += block[(r, c)];
            }
        }
    }

    /// Cholesky factor in place. False when the matrix is not positive definite.
    pub fn factor(&mut self) -> bool {
        for row in 0..self.first.len() {
            let first = self.first[row] as usize;
            let (done, rest) = self.values.split_at_mut(self.diagonal[row] + first - row);
            let this = &mut rest[..row - first + 1];
            for column in first..row {
                let other_first = self.first[column] as usize;
                let from = first.max(other_first);
                let other = &done[self.diagonal[column] + from - column..=self.diagonal[column]];
                let (pivot, other) = (other[column - from], &other[..column - from]);
                let sum = dot(&this[from - first..column - first], other);
                this[column - first] = (this[column - first] - sum) / pivot;
            }
            let (before, last) = this.split_at_mut(row - first);
            let pivot = last[0] - dot(before, before);
            if pivot <= 0.0 || !pivot.is_finite() {
                return false;
            }
            last[0] = pivot.sqrt();
        }
        true
    }

    /// Solves with the factor, in place.
    pub fn solve(&self, x: &mut [f64]) {
        for row in 0..self.first.len() {
            let first = self.first[row] as usize;
            let diagonal = self.diagonal[row];
            let values = &self.values[diagonal + first - row..diagonal];
            x[row] = (x[row] - dot(values, &x[first..row])) / self.values[diagonal];
        }
        for row in (0..self.first.len()).rev() {
            let first = self.first[row] as usize;
            let diagonal = self.diagonal[row];
            x[row] /= self.values[diagonal];
            let (before, at) = x.split_at_mut(row);
            for (value, x) in self.values[diagonal + first - row..diagonal].iter().zip(&mut before[first..]) {
                *x -= value * at[0];
            }
        }
    }
}

impl Envelope {
    /// Sets a matrix without gaps, by its blocks on and below the diagonal.
    pub fn fill(&mut self, count: usize, block: impl Fn(usize, usize) -> Matrix6<f64>) {
        self.shape(std::iter::repeat_n(0, count));
        for row in 0..count {
            for column in 0..=row {
                self.add(row, column, &block(row, column));
            }
        }
    }

    /// The inverse of the matrix, of a factor without gaps; row by row.
    pub fn invert(&self, inverse: &mut Vec<f64>) {
        let size = self.diagonal.len();
        inverse.clear();
        inverse.resize(size * size, 0.0);
        // The factor's inverse, each column in a row of its own, from its diagonal on.
        for (column, lower) in inverse.chunks_exact_mut(size).enumerate() {
            lower[column] = 1.0 / self.values[self.diagonal[column]];
            for row in column + 1..size {
                let diagonal = self.diagonal[row];
                let values = &self.values[diagonal + column - row..diagonal];
                lower[row] = -dot(values, &lower[column..row]) / self.values[diagonal];
            }
        }
        // The product of its transpose with itself: below the diagonal first, where nothing stands yet.
        for row in 1..size {
            let (above, this) = inverse.split_at_mut(row * size);
            let (below, own) = this[..size].split_at_mut(row);
            for (x, other) in below.iter_mut().zip(above.chunks_exact(size)) {
                *x = dot(&other[row..], own);
            }
        }
        for row in 0..size {
            let own = &inverse[row * size + row..(row + 1) * size];
            inverse[row * size + row] = dot(own, own);
            for column in row + 1..size {
                inverse[row * size + column] = inverse[column * size + row];
            }
        }
    }
}

/// In four strands, which the compiler can keep in one register; the same bits everywhere.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut strands = [0.0; 4];
    let (a4, b4) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a4.remainder().iter().zip(b4.remainder()).map(|(x, y)| x * y).sum();
    for (x, y) in a4.zip(b4) {
        for ((strand, x), y) in strands.iter_mut().zip(x).zip(y) {
            *strand += x * y;
        }
    }
    (strands[0] + strands[2]) + (strands[1] + strands[3]) + rest
}

/// Reverse Cuthill-McKee: writes the order in which the nodes of a graph get a narrow envelope.
pub fn narrow_order(count: usize, edges: &[(u32, u32)], order: &mut Vec<u32>, buffers: &mut OrderBuffers) {
    let OrderBuffers { starts, neighbours, seen } = buffers;
    starts.clear();
    starts.resize(count + 1, 0);
    for (a, b) in edges {
        starts[*a as usize + 1] += 1;
        starts[*b as usize + 1] += 1;
    }
    for index in 0..count {
        starts[index + 1] += starts[index];
    }
    neighbours.clear();
    neighbours.resize(2 * edges.len(), 0);
    // Filled backwards, which moves each start to its place again.
    let mut place = |from: u32, to: u32, starts: &mut [u32]| {
        starts[from as usize + 1] -= 1;
        neighbours[starts[from as usize + 1] as usize] = to;
    };
    for (a, b) in edges {
        place(*a, *b, starts);
        place(*b, *a, starts);
    }
    // Each start now is where its node's neighbours begin, one place up.
    let range = |node: u32, starts: &[u32]| {
        let begin = starts[node as usize + 1] as usize;
        let end = starts.get(node as usize + 2).map_or(2 * edges.len(), |end| *end as usize);
        begin..end
    };
    let degree = |node: u32| range(node, starts).len();
    seen.clear();
    seen.resize(count, false);
    order.clear();
    while order.len() < count {
        let left = (0..count as u32).filter(|node| !seen[*node as usize]);
        let Some(start) = left.min_by_key(|node| (degree(*node), *node)) else { break };
        seen[start as usize] = true;
        let mut next = order.len();
        order.push(start);
        while next < order.len() {
            let first_new = order.len();
            for to in &neighbours[range(order[next], starts)] {
                if !std::mem::replace(&mut seen[*to as usize], true) {
                    order.push(*to);
                }
            }
            order[first_new..].sort_unstable_by_key(|node| (degree(*node), *node));
            next += 1;
        }
    }
    order.reverse();
}

/// Working memory of [`narrow_order`].
#[derive(Debug, Default)]
pub struct OrderBuffers {
    starts: Vec<u32>,
    neighbours: Vec<u32>,
    seen: Vec<bool>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn solves_as_a_dense_factor_does(
            count in 1usize..7,
            couplings in prop::collection::vec((0usize..7, 0usize..7, -0.9..0.9f64), 0..9),
            right in prop::collection::vec(-1.0..1.0f64, 42),
        ) {
            let couplings: Vec<_> =
                couplings.iter().filter(|(i, j, _)| i > j && *i < count).copied().collect();
            let mut first: Vec<u32> = (0..count as u32).collect();
            for (i, j, _) in &couplings {
                first[*i] = first[*i].min(*j as u32);
            }
            let mut envelope = Envelope::default();
            envelope.reset(&first);
            let size = count * BLOCK;
            let mut dense = DMatrix::<f64>::identity(size, size) * 40.0;
            for i in 0..count {
                envelope.add(i, i, &(Matrix6::identity() * 40.0));
            }
            for (index, (i, j, x)) in couplings.iter().enumerate() {
                let block = Matrix6::from_fn(|r, c| x * (1.0 + (r * 5 + c * 3 + index) as f64 % 4.0));
                envelope.add(*i, *j, &block);
                let mut view = dense.view_mut((i * BLOCK, j * BLOCK), (BLOCK, BLOCK));
                view += block;
                let mut view = dense.view_mut((j * BLOCK, i * BLOCK), (BLOCK, BLOCK));
                view += block.transpose();
            }
            let definite = dense.clone().cholesky();
            prop_assert_eq!(envelope.factor(), definite.is_some());
            if let Some(factor) = definite {
                let mut x = right[..size].to_vec();
                envelope.solve(&mut x);
                let expected = factor.solve(&DVector::from_row_slice(&right[..size]));
                prop_assert!((DVector::from_vec(x) - expected).norm() < 1e-10);
            }
        }

        #[test]
        fn the_order_names_each_node_once(edges in prop::collection::vec((0u32..20, 0u32..20), 0..40)) {
            let edges: Vec<_> = edges.into_iter().filter(|(a, b)| a != b).collect();
            let mut order = Vec::new();
            narrow_order(20, &edges, &mut order, &mut OrderBuffers::default());
            let mut sorted = order.clone();
            sorted.sort_unstable();
            prop_assert_eq!(sorted, (0..20).collect::<Vec<u32>>());
        }
    }

    #[test]
    fn a_full_factor_gives_the_inverse() {
        let count = 3;
        let size = count * BLOCK;
        let root = DMatrix::from_fn(size, size, |row, column| ((row * 7 + column * 11) % 13) as f64 - 6.0);
        let dense = &root * root.transpose() + DMatrix::identity(size, size);
        let mut envelope = Envelope::default();
        envelope.fill(count, |row, column| dense.fixed_view::<BLOCK, BLOCK>(row * BLOCK, column * BLOCK).into_owned());
        assert!(envelope.factor());
        let mut inverse = Vec::new();
        envelope.invert(&mut inverse);
        let off = DMatrix::from_row_slice(size, size, &inverse) * dense - DMatrix::identity(size, size);
        assert!(off.abs().max() < 1e-9, "{:e}", off.abs().max());
    }

    #[test]
    fn a_shuffled_chain_is_put_in_a_row() {
        let name = |i: u32| i * 7 % 31;
        let edges: Vec<_> = (0..30).map(|i| (name(i), name(i + 1))).collect();
        let mut order = Vec::new();
        narrow_order(31, &edges, &mut order, &mut OrderBuffers::default());
        let place = |node: u32| order.iter().position(|other| *other == node).unwrap() as i64;
        assert!(edges.iter().all(|(a, b)| (place(*a) - place(*b)).abs() == 1));
    }
}
