//! Conjugate gradients on a symmetric positive definite system of blocks: for islands whose factor would be wide.
//!
//! With the matrix scaled so that each link's own block is one, which takes masses, lengths and stiffnesses of any ratio
//! out of the count, it is `1 + L + Lᵀ + R`: what couples the links of a chunk, below and above the diagonal, and what
//! couples different chunks. The preconditioner is symmetric Gauss-Seidel within chunks, `(1 + L)(1 + L)ᵀ`: it passes a
//! push on through a whole chunk, and costs no product of its own, because (Eisenstat 1981)
//!
//! ```text
//! (1 + L)⁻¹ (1 + L + Lᵀ + R) (1 + L)⁻ᵀ r = t + (1 + L)⁻¹ (r - t + R t),    t = (1 + L)⁻ᵀ r
//! ```
//!
//! Both sums of an iteration are made at once (Chronopoulos and Gear 1989), so that workers, who have whole chunks, wait
//! for each other twice in it, and not three times.

use std::ops::Range;

use nalgebra::Matrix6;

use super::envelope::BLOCK;
use crate::field::lanes::{Dispatch, Kernel};
use crate::team::Team;

/// Rows that one worker has: always as many, so that the bits do not depend on who works.
const CHUNK: usize = 128;

/// Couplings that are scaled in one go.
const SCALED: usize = 32;

/// The system: each row of blocks has the one on the diagonal, and its couplings on both sides of it.
#[derive(Debug, Default)]
pub struct Blocks {
    /// The couplings of all rows, in the order in which they were made.
    entries: Vec<Block>,
    /// The other row of each.
    others: Vec<u32>,
    /// Where those of each row end.
    ends: Vec<u32>,
    /// Which row each of the matrix is.
    order: Vec<u32>,
    matrix: Matrix,
    rows: Vec<Row>,
    /// `t` of each row that another chunk reads.
    shared: Vec<[Column; CHUNK]>,
    sums: Vec<Sums>,
}

/// The scaled matrix without its diagonal, its rows in the order of solving; what couples rows of one chunk with its sign
/// turned.
#[derive(Debug, Default)]
struct Matrix {
    /// Where each class of each row's couplings ends.
    ends: Vec<[u32; 3]>,
    /// Row by row and class by class: which coupling, its row, the other one, and its block.
    sources: Vec<u32>,
    owners: Vec<u32>,
    others: Vec<u32>,
    entries: Vec<Block>,
}

/// Where the other row of a coupling is.
#[derive(Clone, Copy)]
enum Class {
    /// Earlier in the chunk.
    Lower,
    /// Later in the chunk.
    Upper,
    /// In another chunk.
    Far,
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
    fn sum(&self) -> f64 {
        let halves: [f64; 4] = std::array::from_fn(|lane| self.0[lane] + self.0[lane + 4]);
        (halves[0] + halves[2]) + (halves[1] + halves[3])
    }

    /// Adds the products of the numbers at the same places.
    #[inline(always)]
    fn add_product(&mut self, a: &Self, b: &Self) {
        for (sum, (a, b)) in self.0.iter_mut().zip(a.0.iter().zip(&b.0)) {
            *sum += a * b;
        }
    }

    #[inline(always)]
    fn add_scaled(&mut self, other: &Self, factor: f64) {
        for (x, other) in self.0.iter_mut().zip(&other.0) {
            *x += other * factor;
        }
    }

    #[inline(always)]
    fn plus(mut self, other: &Self, factor: f64) -> Self {
        self.add_scaled(other, factor);
        self
    }
}

/// The sums of a chunk, by themselves: workers who write to one line of memory wait for each other.
#[derive(Clone, Copy, Debug, Default)]
#[repr(align(128))]
struct Sums {
    /// Of the square of what is left.
    size: f64,
    /// Of what is left times its image.
    bend: f64,
}

/// A block of the matrix, by columns.
#[derive(Clone, Copy, Debug, Default)]
pub struct Block([Column; BLOCK]);

impl Block {
    /// The same numbers.
    pub fn of(matrix: &Matrix6<f64>) -> Self {
        Self(std::array::from_fn(|column| Column::of(matrix.column(column).as_slice())))
    }

    /// The inverse of the Cholesky factor of a symmetric positive definite matrix; `None` when it is not one.
    fn inverse_factor_of(matrix: &Matrix6<f64>) -> Option<Self> {
        let mut factor = [[0.0; BLOCK]; BLOCK];
        let mut inverse = Self::default();
        for i in 0..BLOCK {
            for j in 0..i {
                let sum: f64 = (0..j).map(|k| factor[i][k] * factor[j][k]).sum();
                factor[i][j] = (matrix[(i, j)] - sum) * inverse.0[j].0[j];
            }
            let pivot = matrix[(i, i)] - factor[i][..i].iter().map(|x| x * x).sum::<f64>();
            if pivot.is_nan() || pivot <= 0.0 {
                return None;
            }
            let own = 1.0 / pivot.sqrt();
            inverse.0[i].0[i] = own;
            for j in 0..i {
                let sum: f64 = (j..i).map(|k| factor[i][k] * inverse.0[j].0[k]).sum();
                inverse.0[j].0[i] = -sum * own;
            }
        }
        Some(inverse)
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

    /// The product of the transpose with `x`.
    #[inline(always)]
    fn transposed_product(&self, x: &Column) -> Column {
        let mut product = Column::default();
        for (sum, column) in product.0.iter_mut().zip(&self.0) {
            let mut products = Column::default();
            products.add_product(column, x);
            *sum = products.sum();
        }
        product
    }

    /// `left self rightᵀ` times a factor, where `right` has nothing above its diagonal.
    #[inline(always)]
    fn between(&self, left: &Self, right: &Self, factor: f64) -> Self {
        let mut sums = Self::default();
        for (middle, (column, weights)) in self.0.iter().zip(&right.0).enumerate() {
            let scaled = left.product(column);
            for (sum, weight) in sums.0.iter_mut().zip(&weights.0).skip(middle) {
                sum.add_scaled(&scaled, factor * weight);
            }
        }
        sums
    }
}

#[inline(always)]
fn joined([sum, other]: [Column; 2]) -> Column {
    sum.plus(&other, 1.0)
}

/// What the iteration keeps of a row of blocks.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    /// Inverse of its own block's Cholesky factor.
    scale: Block,
    /// The unknowns, scaled and times `(1 + L)ᵀ`; in the end the unknowns.
    y: Column,
    residual: Column,
    direction: Column,
    /// `t`.
    turned: Column,
    /// The image of what is left, less `t`; the image of the direction.
    image: Column,
    direction_image: Column,
}

/// Blocks from which on two workers are worth it, of whom each waits for the other twice in each iteration. For the 500 of a
/// hundred bodies they are quicker by a quarter at best, and whoever's core is taken away for a moment holds up both.
const WORTH_SHARING: usize = 2000;

impl Blocks {
    /// No rows.
    pub fn clear(&mut self) {
        self.others.clear();
        self.ends.clear();
    }

    /// Couples the row that is being made with another.
    pub fn couple(&mut self, other: u32) {
        self.others.push(other);
    }

    /// Ends the row that is being made.
    pub fn end_row(&mut self) {
        self.ends.push(self.others.len() as u32);
    }

    /// Arranges the rows in the `order` in which they are solved for; `places` has the place of each in it.
    pub fn arrange(&mut self, order: &[u32], places: &[u32]) {
        let Self { others, ends, matrix, .. } = self;
        self.order.clear();
        self.order.extend_from_slice(order);
        matrix.ends.clear();
        matrix.sources.clear();
        matrix.owners.clear();
        matrix.others.clear();
        for (place, row) in order.iter().enumerate() {
            let begin = if *row == 0 { 0 } else { ends[*row as usize - 1] };
            let sources = begin..ends[*row as usize];
            let chunk = place / CHUNK * CHUNK;
            let is_near = |other: usize| (chunk..chunk + CHUNK).contains(&other);
            let ends = [Class::Lower, Class::Upper, Class::Far].map(|class| {
                for source in sources.clone() {
                    let other = places[others[source as usize] as usize] as usize;
                    debug_assert!(other != place, "row {row} with itself");
                    let belongs = match class {
                        Class::Lower => is_near(other) && other < place,
                        Class::Upper => is_near(other) && other > place,
                        Class::Far => !is_near(other),
                    };
                    if belongs {
                        matrix.sources.push(source);
                        matrix.others.push(other as u32);
                    }
                }
                matrix.sources.len() as u32
            });
            matrix.owners.resize(matrix.sources.len(), place as u32);
            matrix.ends.push(ends);
        }
    }

    /// The blocks of all couplings, in the order in which they were made.
    pub fn entries(&mut self) -> &mut [Block] {
        self.entries.resize(self.others.len(), Block::default());
        &mut self.entries
    }

    /// Solves in place, to `tolerance` of the right side in the preconditioner's measure. Unless it is `fresh`, the
    /// matrix is that of the last call. False when a block of the diagonal is not positive definite.
    pub fn solve(
        &mut self,
        diagonal: &[Matrix6<f64>],
        fresh: bool,
        x: &mut [f64],
        tolerance: f64,
        most: usize,
        team: &Team,
    ) -> bool {
        let Self { entries, order, matrix, rows, shared, sums, .. } = self;
        let count = diagonal.len();
        let dispatch = Dispatch::best();
        rows.resize(count, Row::default());
        shared.resize(count.div_ceil(CHUNK), [Column::default(); CHUNK]);
        sums.resize(count.div_ceil(CHUNK), Sums::default());
        if fresh {
            team.each_mut(rows, team.share(count, 1), |index, row| {
                let none = || Block([Column([f64::NAN; 8]); BLOCK]);
                row.scale = Block::inverse_factor_of(&diagonal[order[index] as usize]).unwrap_or_else(none);
            });
            matrix.scale(entries, rows, team);
        }
        let (alone, few) = (Team::alone(), entries.len() + count < WORTH_SHARING);
        let team = if few { &alone } else { team };
        let matrix = &*matrix;
        let (right, order) = (&*x, &**order);
        team.each_row(rows, CHUNK, shared, |chunk, rows, shared| {
            dispatch.run(Begin { part: Part { matrix, first: chunk * CHUNK, rows }, order, right, shared });
        });
        let (mut first_size, mut last_size, mut length) = (0.0, f64::INFINITY, f64::INFINITY);
        for iteration in 0..=most {
            let all = shared.as_flattened();
            team.each_row(rows, CHUNK, sums, |chunk, rows, sums| {
                *sums = dispatch.run(Images { part: Part { matrix, first: chunk * CHUNK, rows }, shared: all });
            });
            let size = sums.iter().map(|sums| sums.size).sum::<f64>();
            if iteration == 0 {
                first_size = size;
            }
            let turn = size / last_size;
            let bend = sums.iter().map(|sums| sums.bend).sum::<f64>() - turn * size / length;
            // Not positive definite.
            if size.is_nan() || iteration == 0 && size > 0.0 && bend <= 0.0 {
                return false;
            }
            if size <= tolerance * tolerance * first_size || bend <= 0.0 || iteration == most {
                break;
            }
            length = size / bend;
            last_size = size;
            team.each_row(rows, CHUNK, shared, |chunk, rows, shared| {
                dispatch.run(Advance { part: Part { matrix, first: chunk * CHUNK, rows }, shared, turn, length });
            });
        }
        team.each_row(rows, CHUNK, shared, |chunk, rows, shared| {
            dispatch.run(End { part: Part { matrix, first: chunk * CHUNK, rows }, shared });
        });
        for (row, Row { y, .. }) in order.iter().zip(rows.iter()) {
            x[*row as usize * BLOCK..][..BLOCK].copy_from_slice(&y.0[..BLOCK]);
        }
        true
    }
}

impl Matrix {
    /// Takes over the couplings, scaled.
    fn scale(&mut self, entries: &[Block], rows: &[Row], team: &Team) {
        let Self { ends, sources, owners, others, entries: scaled } = self;
        scaled.resize(sources.len(), Block::default());
        let (dispatch, count) = (Dispatch::best(), scaled.len().div_ceil(SCALED));
        team.each_row(scaled, SCALED, &mut vec![(); count], |number, scaled, ()| {
            dispatch.run(Scale { scaled, first: number * SCALED, ends, sources, owners, others, entries, rows });
        });
    }

    /// The places of a row's couplings of one class.
    #[inline(always)]
    fn places(&self, row: usize, class: Class) -> Range<usize> {
        let begin = match (class, row) {
            (Class::Lower, 0) => 0,
            (Class::Lower, _) => self.ends[row - 1][2],
            _ => self.ends[row][class as usize - 1],
        };
        begin as usize..self.ends[row][class as usize] as usize
    }

    /// Adds a row's couplings of one class, times what `of` gives for the other row.
    #[inline(always)]
    fn add_products<'a>(&self, row: usize, class: Class, of: impl Fn(usize) -> &'a Column, strands: &mut [Column; 2]) {
        let places = self.places(row, class);
        for (entry, other) in self.entries[places.clone()].iter().zip(&self.others[places]) {
            entry.add_product(of(*other as usize), strands);
        }
    }
}

/// The rows of a chunk.
struct Part<'a> {
    matrix: &'a Matrix,
    first: usize,
    rows: &'a mut [Row],
}

impl Part<'_> {
    /// Replaces `t` by `(1 + L)⁻ᵀ` of what is given for each row. Writing where others read is slow: only what another
    /// chunk needs is shared.
    #[inline(always)]
    fn turn_back(self, of: impl Fn(&mut Row) -> Column, shared: &mut [Column]) {
        let Self { matrix, first, rows } = self;
        for place in (0..rows.len()).rev() {
            let mut strands = [of(&mut rows[place]), Column::default()];
            matrix.add_products(first + place, Class::Upper, |other| &rows[other - first].turned, &mut strands);
            rows[place].turned = joined(strands);
            if !matrix.places(first + place, Class::Far).is_empty() {
                shared[place] = rows[place].turned;
            }
        }
    }
}

/// Couplings from the `first` on, scaled.
struct Scale<'a> {
    scaled: &'a mut [Block],
    first: usize,
    ends: &'a [[u32; 3]],
    sources: &'a [u32],
    owners: &'a [u32],
    others: &'a [u32],
    entries: &'a [Block],
    rows: &'a [Row],
}

impl Kernel for Scale<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const W: usize>(self) {
        for (place, scaled) in (self.first..).zip(self.scaled) {
            let (row, other) = (self.owners[place] as usize, self.others[place] as usize);
            let is_near = place < self.ends[row][Class::Upper as usize] as usize;
            let entry = &self.entries[self.sources[place] as usize];
            *scaled = entry.between(&self.rows[row].scale, &self.rows[other].scale, if is_near { -1.0 } else { 1.0 });
        }
    }
}

/// What is left at the start, scaled and times `(1 + L)⁻¹`; and `t`.
struct Begin<'a> {
    part: Part<'a>,
    order: &'a [u32],
    right: &'a [f64],
    shared: &'a mut [Column],
}

impl Kernel for Begin<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const W: usize>(self) {
        let Self { part, order, right, shared } = self;
        let Part { matrix, first, .. } = part;
        for place in 0..part.rows.len() {
            let mut strands = [Column::default(); 2];
            let right = Column::of(&right[order[first + place] as usize * BLOCK..][..BLOCK]);
            part.rows[place].scale.add_product(&right, &mut strands);
            matrix.add_products(first + place, Class::Lower, |other| &part.rows[other - first].residual, &mut strands);
            let row = &mut part.rows[place];
            row.residual = joined(strands);
            (row.y, row.direction, row.direction_image) = Default::default();
        }
        part.turn_back(|row| row.residual, shared);
    }
}

/// The unknowns, unscaled.
struct End<'a> {
    part: Part<'a>,
    shared: &'a mut [Column],
}

impl Kernel for End<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const W: usize>(self) {
        let Self { part: Part { matrix, first, rows }, shared } = self;
        Part { matrix, first, rows: &mut *rows }.turn_back(|row| row.y, shared);
        for row in rows {
            row.y = row.scale.transposed_product(&row.turned);
        }
    }
}

/// The image of what is left, and the sums.
struct Images<'a> {
    part: Part<'a>,
    shared: &'a [Column],
}

impl Kernel for Images<'_> {
    type Output = Sums;

    #[inline(always)]
    fn run<const W: usize>(self) -> Sums {
        let Self { part: Part { matrix, first, rows }, shared } = self;
        let (mut size, mut bend) = (Column::default(), Column::default());
        for place in 0..rows.len() {
            let Row { residual, turned, .. } = rows[place];
            let mut strands = [residual.plus(&turned, -1.0), Column::default()];
            matrix.add_products(first + place, Class::Far, |other| &shared[other], &mut strands);
            matrix.add_products(first + place, Class::Lower, |other| &rows[other - first].image, &mut strands);
            let image = joined(strands);
            rows[place].image = image;
            size.add_product(&residual, &residual);
            bend.add_product(&residual, &image.plus(&turned, 1.0));
        }
        Sums { size: size.sum(), bend: bend.sum() }
    }
}

/// A step along the new direction, and `t` of what is left then.
struct Advance<'a> {
    part: Part<'a>,
    shared: &'a mut [Column],
    turn: f64,
    length: f64,
}

impl Kernel for Advance<'_> {
    type Output = ();

    #[inline(always)]
    fn run<const W: usize>(self) {
        let Self { part, shared, turn, length } = self;
        let step = |row: &mut Row| {
            row.direction = row.residual.plus(&row.direction, turn);
            row.direction_image = row.image.plus(&row.turned, 1.0).plus(&row.direction_image, turn);
            row.y.add_scaled(&row.direction, length);
            row.residual.add_scaled(&row.direction_image, -length);
            row.residual
        };
        part.turn_back(step, shared);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::response::envelope::Envelope;
    use nalgebra::Vector6;

    #[test]
    fn a_block_between_the_inverses_of_its_factor_is_one() {
        for (scale, seed) in [(1.0, 1.0), (1e-6, 2.0), (1e9, 3.0)] {
            let root = Matrix6::from_fn(|i, j| ((i * 5 + j * 3) as f64 * seed).sin());
            let matrix = (root * root.transpose() + Matrix6::identity()) * scale;
            let inverse = Block::inverse_factor_of(&matrix).unwrap();
            let scaled = Block::of(&matrix).between(&inverse, &inverse, 1.0);
            for column in 0..BLOCK {
                let mut unit = [0.0; BLOCK];
                unit[column] = 1.0;
                let off = scaled.0[column].plus(&Column::of(&unit), -1.0);
                assert!(off.0.iter().all(|off| off.abs() < 1e-12));
            }
        }
        assert!(Block::inverse_factor_of(&-Matrix6::identity()).is_none());
        assert!(Block::inverse_factor_of(&Matrix6::from_element(f64::NAN)).is_none());
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
        // From both ends to the middle.
        let order: Vec<u32> = (0..count as u32 / 2).flat_map(|i| [i, count as u32 - 1 - i]).collect();
        let mut places = vec![0; count];
        (0u32..).zip(&order).for_each(|(place, row)| places[*row as usize] = place);
        blocks.arrange(&order, &places);
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
