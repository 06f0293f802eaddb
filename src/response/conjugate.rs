//! Conjugate gradients on a symmetric positive definite system of blocks: for islands whose factor would be wide.
//!
//! Each link's own block is the preconditioner, which takes masses, lengths and stiffnesses of any ratio out of the
//! count; what remains goes with the longest way through the island.

use nalgebra::{Cholesky, Const, Matrix6, Vector6};

use super::envelope::BLOCK;

/// The system.
#[derive(Debug, Default)]
pub struct Blocks {
    diagonal: Vec<Matrix6<f64>>,
    /// Row, column below the diagonal, block.
    couplings: Vec<(u32, u32, Matrix6<f64>)>,
    factors: Vec<Cholesky<f64, Const<6>>>,
    buffers: [Vec<Vector6<f64>>; 4],
}

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
    pub fn solve(&mut self, x: &mut [f64], tolerance: f64, most: usize) -> bool {
        let Self { diagonal, couplings, factors, buffers } = self;
        factors.clear();
        for block in diagonal.iter() {
            let Some(factor) = block.cholesky() else { return false };
            factors.push(factor);
        }
        let [residual, eased, direction, image] = buffers;
        for buffer in [&mut *residual, &mut *eased, &mut *direction, &mut *image] {
            buffer.clear();
            buffer.resize(diagonal.len(), Vector6::zeros());
        }
        for (residual, x) in residual.iter_mut().zip(x.chunks_exact_mut(BLOCK)) {
            *residual = Vector6::from_column_slice(x);
            x.fill(0.0);
        }
        let ease = |residual: &[Vector6<f64>], eased: &mut [Vector6<f64>]| -> f64 {
            let mut sum = 0.0;
            for ((residual, eased), factor) in residual.iter().zip(eased).zip(factors.iter()) {
                *eased = *residual;
                factor.solve_mut(eased);
                sum += residual.dot(eased);
            }
            sum
        };
        let mut size = ease(residual, eased);
        let enough = tolerance * tolerance * size;
        direction.copy_from_slice(eased);
        for _ in 0..most {
            if size <= enough {
                break;
            }
            for ((image, direction), block) in image.iter_mut().zip(direction.iter()).zip(diagonal.iter()) {
                *image = block * direction;
            }
            for (i, j, block) in couplings.iter() {
                let (i, j) = (*i as usize, *j as usize);
                image[i] += block * direction[j];
                image[j] += block.tr_mul(&direction[i]);
            }
            let bend: f64 = direction.iter().zip(image.iter()).map(|(d, i)| d.dot(i)).sum();
            if bend <= 0.0 {
                break;
            }
            let part = size / bend;
            for (x, direction) in x.chunks_exact_mut(BLOCK).zip(direction.iter()) {
                for (x, direction) in x.iter_mut().zip(direction.iter()) {
                    *x += part * direction;
                }
            }
            for (residual, image) in residual.iter_mut().zip(image.iter()) {
                *residual -= image * part;
            }
            let next = ease(residual, eased);
            let turn = next / size;
            size = next;
            for (direction, eased) in direction.iter_mut().zip(eased.iter()) {
                *direction = eased + *direction * turn;
            }
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
        assert!(blocks.solve(&mut iterated, 1e-12, 1000));
        let off = direct.iter().zip(&iterated).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-9 * direct.iter().fold(0.0, |m: f64, x| m.max(x.abs())), "{off}");
    }
}
