//! Conjugate gradients on a symmetric positive definite system of blocks: for islands whose factor would be wide.
//!
//! Each link's own block is the preconditioner, which takes masses, lengths and stiffnesses of any ratio out of the
//! count; what remains goes with the longest way through the island. Written after Chronopoulos and Gear (1989): both sums
//! of an iteration are made at once, so that workers wait for each other twice in it, and not three times.

use nalgebra::{Matrix6, Vector6};

use super::envelope::BLOCK;
use crate::team::Team;

/// The system: each row of blocks has the one on the diagonal, and its couplings on both sides of it.
#[derive(Debug, Default)]
pub struct Blocks {
    /// Where each row's couplings begin, and where the last one's end.
    starts: Vec<u32>,
    /// The other row of each coupling.
    others: Vec<u32>,
    entries: Vec<Matrix6<f64>>,
    rows: Vec<Row>,
    /// What is left of each row, preconditioned: the rows' own, for all to read.
    eased: Vec<Vector6<f64>>,
    /// Two sums over some rows each.
    sums: Vec<[f64; 2]>,
}

/// What the iteration keeps of a row of blocks.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    inverse: Matrix6<f64>,
    x: Vector6<f64>,
    residual: Vector6<f64>,
    eased: Vector6<f64>,
    direction: Vector6<f64>,
    /// The matrix times what is left, and times the direction.
    image: Vector6<f64>,
    direction_image: Vector6<f64>,
}

/// Rows whose part of a sum is made by one worker: always as many, so that sums do not depend on who makes them.
const ROWS: usize = 16;

impl Blocks {
    /// No rows.
    pub fn clear(&mut self) {
        self.starts.clear();
        self.starts.push(0);
        self.others.clear();
    }

    /// Couples the row that is being made with another.
    pub fn couple(&mut self, other: u32) {
        self.others.push(other);
    }

    /// Ends the row that is being made.
    pub fn end_row(&mut self) {
        self.starts.push(self.others.len() as u32);
    }

    /// The blocks of all couplings, in the order in which they were made.
    pub fn entries(&mut self) -> &mut [Matrix6<f64>] {
        self.entries.resize(self.others.len(), Matrix6::zeros());
        &mut self.entries
    }

    /// Solves in place, to `tolerance` of the right side in the preconditioner's measure. Unless it is `fresh`, the
    /// diagonal is that of the last call. False when a block of it is not positive definite.
    pub fn solve(
        &mut self,
        diagonal: &[Matrix6<f64>],
        fresh: bool,
        x: &mut [f64],
        tolerance: f64,
        most: usize,
        team: &Team,
    ) -> bool {
        let Self { starts, others, entries, rows, eased, sums } = self;
        let count = diagonal.len();
        rows.resize(count, Row::default());
        eased.resize(count, Vector6::zeros());
        sums.resize(count.div_ceil(ROWS), [0.0; 2]);
        let right = &*x;
        team.each_row(rows, 1, eased, |index, row| {
            let residual = Vector6::from_column_slice(&right[index * BLOCK..][..BLOCK]);
            let inverse = if fresh {
                let factor = diagonal[index].cholesky();
                factor.map_or_else(|| Matrix6::from_element(f64::NAN), |factor| factor.inverse())
            } else {
                row[0].inverse
            };
            let eased = inverse * residual;
            row[0] = Row { inverse, residual, eased, ..Row::default() };
            eased
        });
        let (mut first_size, mut last_size, mut part) = (0.0, f64::INFINITY, f64::INFINITY);
        for iteration in 0..=most {
            team.each_row(rows, ROWS, sums, |first, rows| {
                let mut sums = [0.0; 2];
                for (index, row) in rows.iter_mut().enumerate() {
                    let index = first * ROWS + index;
                    row.image = diagonal[index] * eased[index];
                    let range = starts[index] as usize..starts[index + 1] as usize;
                    for (entry, other) in entries[range.clone()].iter().zip(&others[range]) {
                        row.image += entry * eased[*other as usize];
                    }
                    sums[0] += row.residual.dot(&eased[index]);
                    sums[1] += row.image.dot(&eased[index]);
                }
                sums
            });
            let size = sums.iter().map(|sums| sums[0]).sum::<f64>();
            if size.is_nan() {
                return false;
            }
            if iteration == 0 {
                first_size = size;
            }
            let turn = size / last_size;
            let bend = sums.iter().map(|sums| sums[1]).sum::<f64>() - turn * size / part;
            if size <= tolerance * tolerance * first_size || bend <= 0.0 || iteration == most {
                break;
            }
            part = size / bend;
            last_size = size;
            team.each_row(rows, 1, eased, |_, row| {
                let row = &mut row[0];
                row.direction = row.eased + row.direction * turn;
                row.direction_image = row.image + row.direction_image * turn;
                row.x += row.direction * part;
                row.residual -= row.direction_image * part;
                row.eased = row.inverse * row.residual;
                row.eased
            });
        }
        for (x, row) in x.chunks_exact_mut(BLOCK).zip(rows.iter()) {
            x.copy_from_slice(row.x.as_slice());
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::envelope::Envelope;

    #[test]
    fn agrees_with_the_factor_on_a_chain_of_uneven_links() {
        let count = 20usize;
        let first: Vec<u32> = (0..count as u32).map(|i| i.saturating_sub(1)).collect();
        let (mut envelope, mut blocks) = (Envelope::default(), Blocks::default());
        envelope.reset(&first);
        let spring = Matrix6::from_diagonal(&Vector6::new(1e3, 10.0, 10.0, 1.0, 1.0, 1.0));
        let mut diagonal = Vec::new();
        blocks.clear();
        for i in 0..count {
            let mass = if i % 2 == 0 { 1.0 } else { 1e4 };
            let mut block = Matrix6::identity() * mass;
            for j in [i.wrapping_sub(1), i + 1].into_iter().filter(|j| *j < count) {
                block += spring;
                blocks.couple(j as u32);
                if j < i {
                    envelope.add(i, j, &-spring);
                }
            }
            blocks.end_row();
            envelope.add(i, i, &block);
            diagonal.push(block);
        }
        blocks.entries().fill(-spring);
        let right: Vec<f64> = (0..count * BLOCK).map(|i| ((i * 7) % 11) as f64 - 5.0).collect();
        let (mut direct, mut iterated) = (right.clone(), right);
        assert!(envelope.factor());
        envelope.solve(&mut direct);
        assert!(blocks.solve(&diagonal, true, &mut iterated, 1e-12, 1000, &Team::alone()));
        let off = direct.iter().zip(&iterated).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9 * direct.iter().fold(0.0, |m: f64, x| m.max(x.abs())), "{off}");
    }
}
