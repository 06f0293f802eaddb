//! Conjugate gradients on a symmetric positive definite system of blocks: for islands whose factor would be wide.
//!
//! Each link's own block is the preconditioner, which takes masses, lengths and stiffnesses of any ratio out of the
//! count; what remains goes with the longest way through the island.

use nalgebra::{Matrix6, Vector6};

use super::envelope::BLOCK;
use crate::team::Team;

/// The system.
#[derive(Debug, Default)]
pub struct Blocks {
    diagonal: Vec<Matrix6<f64>>,
    /// Row, column below the diagonal, block.
    couplings: Vec<(u32, u32, Matrix6<f64>)>,
    inverses: Vec<Matrix6<f64>>,
    rows: Vec<Row>,
    direction: Vec<Vector6<f64>>,
    /// The couplings row by row, with those above the diagonal, and where each row's begin.
    entries: Vec<Entry>,
    starts: Vec<u32>,
}

/// What the iteration keeps of a row of blocks.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    x: Vector6<f64>,
    residual: Vector6<f64>,
    eased: Vector6<f64>,
    image: Vector6<f64>,
    /// The row's part of a product.
    part: f64,
}

/// A coupling as one of its two rows sees it.
#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    coupling: u32,
    other: u32,
    /// The row is the one of the transposed block.
    transposed: bool,
}

/// Rows that a worker takes in one go.
const ROWS: usize = 16;

impl Blocks {
    /// All zero, for `count` blocks.
    pub fn reset(&mut self, count: usize) {
        self.diagonal.clear();
        self.diagonal.resize(count, Matrix6::zeros());
        self.couplings.clear();
    }

    /// Adds a block at block row `i` and block column `j`, at most `i`.
    pub fn add(&mut self, i: usize, j: usize, block: &Matrix6<f64>) {
        if i == j {
            self.diagonal[i] += block;
        } else {
            self.couplings.push((i as u32, j as u32, *block));
        }
    }

    /// Solves in place, to `tolerance` of the right side in the preconditioner's measure. False when a diagonal block
    /// is not positive definite.
    pub fn solve(&mut self, x: &mut [f64], tolerance: f64, most: usize, team: &Team) -> bool {
        self.inverses.clear();
        for block in &self.diagonal {
            let Some(factor) = block.cholesky() else { return false };
            self.inverses.push(factor.inverse());
        }
        self.list_entries();
        let Self { diagonal, couplings, inverses, rows, direction, entries, starts } = self;
        rows.clear();
        rows.extend(x.chunks_exact(BLOCK).zip(inverses.iter()).map(|(x, inverse)| {
            let residual = Vector6::from_column_slice(x);
            let eased = inverse * residual;
            Row { residual, eased, part: residual.dot(&eased), ..Row::default() }
        }));
        direction.clear();
        direction.extend(rows.iter().map(|row| row.eased));
        let sum = |rows: &[Row]| -> f64 { rows.iter().map(|row| row.part).sum() };
        let mut size = sum(rows);
        let enough = tolerance * tolerance * size;
        for _ in 0..most {
            if size <= enough {
                break;
            }
            team.each_mut(rows, ROWS, |index, row| {
                let mut image = diagonal[index] * direction[index];
                for entry in &entries[starts[index] as usize..starts[index + 1] as usize] {
                    let (block, other) = (&couplings[entry.coupling as usize].2, &direction[entry.other as usize]);
                    image += if entry.transposed { block.tr_mul(other) } else { block * other };
                }
                (row.image, row.part) = (image, direction[index].dot(&image));
            });
            let bend = sum(rows);
            if bend <= 0.0 {
                break;
            }
            let part = size / bend;
            team.each_mut(rows, ROWS, |index, row| {
                row.x += direction[index] * part;
                row.residual -= row.image * part;
                row.eased = inverses[index] * row.residual;
                row.part = row.residual.dot(&row.eased);
            });
            let next = sum(rows);
            let turn = next / size;
            size = next;
            for (direction, row) in direction.iter_mut().zip(rows.iter()) {
                *direction = row.eased + *direction * turn;
            }
        }
        for (x, row) in x.chunks_exact_mut(BLOCK).zip(rows.iter()) {
            x.copy_from_slice(row.x.as_slice());
        }
        true
    }

    /// Lists the couplings of each row, in the order in which they were added.
    fn list_entries(&mut self) {
        let Self { diagonal, couplings, entries, starts, .. } = self;
        starts.clear();
        starts.resize(diagonal.len() + 2, 0);
        for (i, j, _) in couplings.iter() {
            starts[*i as usize + 2] += 1;
            starts[*j as usize + 2] += 1;
        }
        for row in 2..starts.len() {
            starts[row] += starts[row - 1];
        }
        entries.clear();
        entries.resize(2 * couplings.len(), Entry::default());
        // Filling moves each row's start, kept one place up meanwhile, to the next one's.
        let mut list = |row: u32, entry: Entry| {
            let place = &mut starts[row as usize + 1];
            entries[*place as usize] = entry;
            *place += 1;
        };
        for (coupling, (i, j, _)) in couplings.iter().enumerate() {
            let coupling = coupling as u32;
            list(*i, Entry { coupling, other: *j, transposed: false });
            list(*j, Entry { coupling, other: *i, transposed: true });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::envelope::Envelope;

    #[test]
    fn agrees_with_the_factor_on_a_chain_of_uneven_links() {
        let count = 20;
        let first: Vec<u32> = (0..count as u32).map(|i| i.saturating_sub(1)).collect();
        let (mut envelope, mut blocks) = (Envelope::default(), Blocks::default());
        envelope.reset(&first);
        blocks.reset(count);
        let mut add = |i: usize, j: usize, block: &Matrix6<f64>| {
            envelope.add(i, j, block);
            blocks.add(i, j, block);
        };
        for i in 0..count {
            let mass = if i % 2 == 0 { 1.0 } else { 1e4 };
            add(i, i, &(Matrix6::identity() * mass));
            if i > 0 {
                let spring = Matrix6::from_diagonal(&Vector6::new(1e3, 10.0, 10.0, 1.0, 1.0, 1.0));
                add(i, i, &spring);
                add(i - 1, i - 1, &spring);
                add(i, i - 1, &-spring);
            }
        }
        let right: Vec<f64> = (0..count * BLOCK).map(|i| ((i * 7) % 11) as f64 - 5.0).collect();
        let (mut direct, mut iterated) = (right.clone(), right);
        assert!(envelope.factor());
        envelope.solve(&mut direct);
        assert!(blocks.solve(&mut iterated, 1e-12, 1000, &Team::alone()));
        let off = direct.iter().zip(&iterated).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9 * direct.iter().fold(0.0, |m: f64, x| m.max(x.abs())), "{off}");
    }
}
