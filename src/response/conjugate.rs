//! Conjugate gradients on a symmetric positive definite system of blocks: for islands whose factor would be wide.
//!
//! Each link's own block is the preconditioner, which takes masses, lengths and stiffnesses of any ratio out of the
//! count; what remains goes with the longest way through the island. Written after Chronopoulos and Gear (1989): both sums
//! of an iteration are made at once, so that workers wait for each other twice in it, and not three times.

use nalgebra::Matrix6;

use super::envelope::BLOCK;
use crate::field::lanes::{Dispatch, Kernel};
use crate::team::Team;

/// The system: each row of blocks has the one on the diagonal, and its couplings on both sides of it.
#[derive(Debug, Default)]
pub struct Blocks {
    /// Where each row's couplings begin, and where the last one's end.
    starts: Vec<u32>,
    /// The other row of each coupling.
    others: Vec<u32>,
    entries: Vec<Block>,
    rows: Vec<Row>,
    /// What is left of each row, preconditioned: the rows' own, for all to read.
    eased: Vec<Column>,
    /// Two sums over some rows each.
    sums: Vec<[f64; 2]>,
}

/// Six numbers, and two zeros that fill the register.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(64))]
struct Column([f64; 8]);

impl Column {
    fn of(x: &[f64]) -> Self {
        let mut column = Self::default();
        column.0[..BLOCK].copy_from_slice(x);
        column
    }

    #[inline(always)]
    fn dot(&self, other: &Self) -> f64 {
        let products: [f64; 8] = std::array::from_fn(|lane| self.0[lane] * other.0[lane]);
        let halves: [f64; 4] = std::array::from_fn(|lane| products[lane] + products[lane + 4]);
        (halves[0] + halves[2]) + (halves[1] + halves[3])
    }

    #[inline(always)]
    fn add_scaled(&mut self, other: &Self, factor: f64) {
        for (x, other) in self.0.iter_mut().zip(&other.0) {
            *x += other * factor;
        }
    }
}

/// A block of the matrix, by columns.
#[derive(Clone, Copy, Debug, Default)]
pub struct Block([Column; BLOCK]);

impl Block {
    /// The same numbers.
    pub fn of(matrix: &Matrix6<f64>) -> Self {
        Self(std::array::from_fn(|column| Column::of(matrix.column(column).as_slice())))
    }

    /// The inverse of a symmetric positive definite matrix, by its Cholesky factor; `None` when it is not one.
    fn inverse_of(matrix: &Matrix6<f64>) -> Option<Self> {
        // The factor's inverse, below the diagonal, row by row.
        let mut factor = [[0.0; BLOCK]; BLOCK];
        let mut inverse = [[0.0; BLOCK]; BLOCK];
        for i in 0..BLOCK {
            for j in 0..i {
                let sum: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                factor[i][j] = (matrix[(i, j)] - sum) * inverse[j][j];
            }
            let pivot = matrix[(i, i)] - factor[i][..i].iter().map(|x| x * x).sum::<f64>();
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            inverse[i][i] = 1.0 / pivot.sqrt();
            for j in 0..i {
                let sum: f64 = (j..i).map(|k| factor[i][k] * inverse[k][j]).sum();
                inverse[i][j] = -sum * inverse[i][i];
            }
        }
        let mut block = Self::default();
        for i in 0..BLOCK {
            for j in 0..=i {
                let entry: f64 = (i..BLOCK).map(|k| inverse[k][i] * inverse[k][j]).sum();
                block.0[j].0[i] = entry;
                block.0[i].0[j] = entry;
            }
        }
        Some(block)
    }

    /// Adds the product with `x`, in two strands that do not wait for each other.
    #[inline(always)]
    fn add_product(&self, x: &Column, strands: &mut [Column; 2]) {
        for (columns, x) in self.0.chunks_exact(2).zip(x.0.chunks_exact(2)) {
            strands[0].add_scaled(&columns[0], x[0]);
            strands[1].add_scaled(&columns[1], x[1]);
        }
    }

    #[inline(always)]
    fn product(&self, x: &Column) -> Column {
        let mut strands = [Column::default(); 2];
        self.add_product(x, &mut strands);
        joined(strands)
    }
}

#[inline(always)]
fn joined([mut sum, other]: [Column; 2]) -> Column {
    sum.add_scaled(&other, 1.0);
    sum
}

/// What the iteration keeps of a row of blocks.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    diagonal: Block,
    inverse: Block,
    x: Column,
    residual: Column,
    /// What is left, preconditioned.
    eased: Column,
    direction: Column,
    /// The matrix times what is left, and times the direction.
    image: Column,
    direction_image: Column,
}

/// Rows whose part of a sum is made by one worker: always as many, so that sums do not depend on who makes them.
const ROWS: usize = 16;

/// Blocks from which on two workers are quicker than one, who waits for nobody twice in each iteration.
const WORTH_SHARING: usize = 3000;

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
    pub fn entries(&mut self) -> &mut [Block] {
        self.entries.resize(self.others.len(), Block::default());
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
        let (alone, few) = (Team::alone(), entries.len() + count < WORTH_SHARING);
        let team = if few { &alone } else { team };
        rows.resize(count, Row::default());
        eased.resize(count, Column::default());
        sums.resize(count.div_ceil(ROWS), [0.0; 2]);
        let right = &*x;
        team.each_row(rows, 1, eased, |index, row| {
            let row = &mut row[0];
            if fresh {
                let none = || Block::of(&Matrix6::from_element(f64::NAN));
                row.inverse = Block::inverse_of(&diagonal[index]).unwrap_or_else(none);
                row.diagonal = Block::of(&diagonal[index]);
            }
            let residual = Column::of(&right[index * BLOCK..][..BLOCK]);
            let eased = row.inverse.product(&residual);
            *row = Row { diagonal: row.diagonal, inverse: row.inverse, residual, eased, ..Row::default() };
            eased
        });
        let (mut first_size, mut last_size, mut part) = (0.0, f64::INFINITY, f64::INFINITY);
        for iteration in 0..=most {
            team.each_row(rows, ROWS, sums, |first, rows| {
                Dispatch::best().run(Images { first: first * ROWS, rows, starts, others, entries, eased })
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
            team.each_row(rows, 1, eased, |_, row| Dispatch::best().run(Advance { row: &mut row[0], turn, part }));
        }
        for (x, row) in x.chunks_exact_mut(BLOCK).zip(rows.iter()) {
            x.copy_from_slice(&row.x.0[..BLOCK]);
        }
        true
    }
}

/// The matrix times what is left of some rows, and two sums: of what is left, and of its image, times what is left
/// preconditioned.
struct Images<'a> {
    first: usize,
    rows: &'a mut [Row],
    starts: &'a [u32],
    others: &'a [u32],
    entries: &'a [Block],
    eased: &'a [Column],
}

impl Kernel for Images<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<const W: usize>(self) -> [f64; 2] {
        let Self { first, rows, starts, others, entries, eased } = self;
        let mut sums = [0.0; 2];
        for (index, row) in rows.iter_mut().enumerate() {
            let index = first + index;
            let mut strands = [Column::default(); 2];
            row.diagonal.add_product(&eased[index], &mut strands);
            let range = starts[index] as usize..starts[index + 1] as usize;
            for (entry, other) in entries[range.clone()].iter().zip(&others[range]) {
                entry.add_product(&eased[*other as usize], &mut strands);
            }
            row.image = joined(strands);
            sums[0] += row.residual.dot(&eased[index]);
            sums[1] += row.image.dot(&eased[index]);
        }
        sums
    }
}

/// A step of a row along the new direction; gives what is left then, preconditioned.
struct Advance<'a> {
    row: &'a mut Row,
    turn: f64,
    part: f64,
}

impl Kernel for Advance<'_> {
    type Output = Column;

    #[inline(always)]
    fn run<const W: usize>(self) -> Column {
        let Self { row, turn, part } = self;
        for lane in 0..row.x.0.len() {
            row.direction.0[lane] = row.eased.0[lane] + row.direction.0[lane] * turn;
            row.direction_image.0[lane] = row.image.0[lane] + row.direction_image.0[lane] * turn;
            row.x.0[lane] += row.direction.0[lane] * part;
            row.residual.0[lane] -= row.direction_image.0[lane] * part;
        }
        row.eased = row.inverse.product(&row.residual);
        row.eased
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::envelope::Envelope;
    use nalgebra::Vector6;

    #[test]
    fn a_block_times_its_inverse_is_one() {
        for (scale, seed) in [(1.0, 1.0), (1e-6, 2.0), (1e9, 3.0)] {
            let root = Matrix6::from_fn(|i, j| ((i * 5 + j * 3) as f64 * seed).sin());
            let matrix = (root * root.transpose() + Matrix6::identity()) * scale;
            let inverse = Block::inverse_of(&matrix).unwrap();
            for column in 0..BLOCK {
                let mut unit = Vector6::zeros();
                unit[column] = 1.0;
                let product = inverse.product(&Column::of((matrix * unit).as_slice()));
                assert!((Vector6::from_column_slice(&product.0[..BLOCK]) - unit).norm() < 1e-12);
            }
        }
        assert!(Block::inverse_of(&-Matrix6::identity()).is_none());
        assert!(Block::inverse_of(&Matrix6::from_element(f64::NAN)).is_none());
    }

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
        blocks.entries().fill(Block::of(&-spring));
        let right: Vec<f64> = (0..count * BLOCK).map(|i| ((i * 7) % 11) as f64 - 5.0).collect();
        let (mut direct, mut iterated) = (right.clone(), right);
        assert!(envelope.factor());
        envelope.solve(&mut direct);
        assert!(blocks.solve(&diagonal, true, &mut iterated, 1e-12, 1000, &Team::alone()));
        let off = direct.iter().zip(&iterated).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9 * direct.iter().fold(0.0, |m: f64, x| m.max(x.abs())), "{off}");
    }
}
