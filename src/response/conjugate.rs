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
    /// The couplings row by row, with those above the diagonal, and where each row's begin.
    sources: Vec<Source>,
    starts: Vec<u32>,
    entries: Vec<Matrix6<f64>>,
    rows: Vec<Row>,
    direction: Vec<Vector6<f64>>,
    /// Sums over some rows each.
    sums: Vec<f64>,
}

/// What the iteration keeps of a row of blocks.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    inverse: Matrix6<f64>,
    x: Vector6<f64>,
    residual: Vector6<f64>,
    eased: Vector6<f64>,
    image: Vector6<f64>,
}

/// A coupling as one of its two rows sees it.
#[derive(Clone, Copy, Debug, Default)]
struct Source {
    coupling: u32,
    other: u32,
    /// The row is the one of the transposed block.
    transposed: bool,
}

/// Rows whose part of a sum is made by one worker: always as many, so that sums do not depend on who makes them.
const ROWS: usize = 64;

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
        self.list_entries(team);
        let Self { diagonal, sources, starts, entries, rows, direction, sums, .. } = self;
        let count = diagonal.len();
        rows.resize(count, Row::default());
        direction.clear();
        direction.resize(count, Vector6::zeros());
        sums.resize(count.div_ceil(ROWS), 0.0);
        // Each worker has the same rows in all that follows.
        let block = ROWS * team.share(sums.len(), 1);
        let right = &*x;
        team.each_row(rows, ROWS, sums, |first, rows| {
            let mut sum = 0.0;
            for (index, row) in rows.iter_mut().enumerate() {
                let index = first * ROWS + index;
                let Some(factor) = diagonal[index].cholesky() else { return f64::NAN };
                let residual = Vector6::from_column_slice(&right[index * BLOCK..][..BLOCK]);
                let inverse = factor.inverse();
                let eased = inverse * residual;
                *row = Row { inverse, residual, eased, ..Row::default() };
                sum += residual.dot(&eased);
            }
            sum
        });
        let mut size = sums.iter().sum::<f64>();
        if size.is_nan() {
            return false;
        }
        let enough = tolerance * tolerance * size;
        let mut turn = 0.0;
        for _ in 0..most {
            if size <= enough {
                break;
            }
            team.each_mut(direction, block, |index, direction| *direction = rows[index].eased + *direction * turn);
            team.each_row(rows, ROWS, sums, |first, rows| {
                let mut sum = 0.0;
                for (index, row) in rows.iter_mut().enumerate() {
                    let index = first * ROWS + index;
                    row.image = diagonal[index] * direction[index];
                    let range = starts[index] as usize..starts[index + 1] as usize;
                    for (entry, source) in entries[range.clone()].iter().zip(&sources[range]) {
                        row.image += entry * direction[source.other as usize];
                    }
                    sum += direction[index].dot(&row.image);
                }
                sum
            });
            let bend = sums.iter().sum::<f64>();
            if bend <= 0.0 {
                break;
            }
            let part = size / bend;
            team.each_row(rows, ROWS, sums, |first, rows| {
                let mut sum = 0.0;
                for (index, row) in rows.iter_mut().enumerate() {
                    row.x += direction[first * ROWS + index] * part;
                    row.residual -= row.image * part;
                    row.eased = row.inverse * row.residual;
                    sum += row.residual.dot(&row.eased);
                }
                sum
            });
            let next = sums.iter().sum::<f64>();
            turn = next / size;
            size = next;
        }
        for (x, row) in x.chunks_exact_mut(BLOCK).zip(rows.iter()) {
            x.copy_from_slice(row.x.as_slice());
        }
        true
    }

    /// Lists the couplings of each row, in the order in which they were added.
    fn list_entries(&mut self, team: &Team) {
        let Self { diagonal, couplings, sources, starts, entries, .. } = self;
        starts.clear();
        starts.resize(diagonal.len() + 2, 0);
        for (i, j, _) in couplings.iter() {
            starts[*i as usize + 2] += 1;
            starts[*j as usize + 2] += 1;
        }
        for row in 2..starts.len() {
            starts[row] += starts[row - 1];
        }
        sources.clear();
        sources.resize(2 * couplings.len(), Source::default());
        // Filling moves each row's start, kept one place up meanwhile, to the next one's.
        let mut list = |row: u32, source: Source| {
            let place = &mut starts[row as usize + 1];
            sources[*place as usize] = source;
            *place += 1;
        };
        for (coupling, (i, j, _)) in couplings.iter().enumerate() {
            let coupling = coupling as u32;
            list(*i, Source { coupling, other: *j, transposed: false });
            list(*j, Source { coupling, other: *i, transposed: true });
        }
        entries.resize(sources.len(), Matrix6::zeros());
        team.each_mut(entries, team.share(sources.len(), 1), |index, entry| {
            let Source { coupling, transposed, .. } = sources[index];
            let block = &couplings[coupling as usize].2;
            *entry = if transposed { block.transpose() } else { *block };
        });
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
