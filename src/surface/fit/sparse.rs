//! Least squares with few numbers in each row: the damped normal equations by conjugate gradients, without making them.

/// Least that a number of the diagonal counts, over the mean of all: for unknowns of which the rows hardly speak.
const LEAST: f64 = 0.1;

/// Rows of a matrix of blocks, and their right sides. A row's blocks are of one width, a column of blocks each.
#[derive(Debug, Default)]
pub struct Rows {
    width: usize,
    /// Where the blocks of each row begin, and the last one's end.
    starts: Vec<u32>,
    columns: Vec<u32>,
    entries: Vec<f64>,
    right: Vec<f64>,
}

impl Rows {
    /// No rows, with blocks of this width.
    pub fn clear(&mut self, width: usize) {
        self.width = width;
        self.starts.clear();
        self.starts.push(0);
        self.columns.clear();
        self.entries.clear();
        self.right.clear();
    }

    /// Adds a block, as wide as all, to the row that is being made.
    pub fn block(&mut self, column: usize, entries: &[f64]) {
        debug_assert_eq!(entries.len(), self.width);
        self.columns.push(column as u32);
        self.entries.extend_from_slice(entries);
    }

    /// Ends the row that is being made: what it times the solution is to be, and its weight.
    pub fn end_row(&mut self, right: f64, weight: f64) {
        let scale = weight.sqrt();
        let first = *self.starts.last().expect("there is always one") as usize;
        self.entries[first * self.width..].iter_mut().for_each(|entry| *entry *= scale);
        self.right.push(right * scale);
        self.starts.push(self.columns.len() as u32);
    }

    /// Each row: its columns and entries.
    fn rows(&self) -> impl Iterator<Item = (&[u32], &[f64])> {
        self.starts.windows(2).map(|ends| {
            let [first, end] = [ends[0] as usize, ends[1] as usize];
            (&self.columns[first..end], &self.entries[first * self.width..end * self.width])
        })
    }

    /// The matrix times a vector.
    fn times(&self, x: &[f64], out: &mut [f64]) {
        for ((columns, entries), out) in self.rows().zip(out) {
            let mut sum = 0.0;
            for (column, entries) in columns.iter().zip(entries.chunks_exact(self.width)) {
                let x = &x[*column as usize * self.width..][..self.width];
                sum += entries.iter().zip(x).map(|(a, b)| a * b).sum::<f64>();
            }
            *out = sum;
        }
    }

    /// Adds the transposed matrix times a vector.
    fn add_transposed(&self, y: &[f64], out: &mut [f64]) {
        for ((columns, entries), y) in self.rows().zip(y) {
            for (column, entries) in columns.iter().zip(entries.chunks_exact(self.width)) {
                let out = &mut out[*column as usize * self.width..][..self.width];
                out.iter_mut().zip(entries).for_each(|(out, a)| *out += a * y);
            }
        }
    }

    /// The solution in `x` of the least squares of the rows and of `damping` times the diagonal \[Marquardt 1963\], by at
    /// most so many steps of conjugate gradients.
    pub fn solve(&self, damping: f64, most: usize, tolerance: f64, x: &mut Vec<f64>, columns: usize) {
        let size = columns * self.width;
        let mut diagonal = vec![0.0; size];
        for (columns, entries) in self.rows() {
            for (column, entries) in columns.iter().zip(entries.chunks_exact(self.width)) {
                let diagonal = &mut diagonal[*column as usize * self.width..][..self.width];
                diagonal.iter_mut().zip(entries).for_each(|(sum, a)| *sum += a * a);
            }
        }
        let least = LEAST * diagonal.iter().sum::<f64>() / size as f64;
        diagonal.iter_mut().for_each(|entry| *entry = entry.max(least));
        x.clear();
        x.resize(size, 0.0);
        let mut residual = vec![0.0; size];
        self.add_transposed(&self.right, &mut residual);
        let ease = |residual: &[f64]| -> Vec<f64> {
            residual.iter().zip(&diagonal).map(|(r, d)| r / (d * (1.0 + damping))).collect()
        };
        let mut eased = ease(&residual);
        let mut direction = eased.clone();
        let (mut images, mut image) = (vec![0.0; self.right.len()], vec![0.0; size]);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let mut measure = dot(&residual, &eased);
        let first = measure;
        for _ in 0..most {
            if measure <= tolerance * tolerance * first {
                break;
            }
            self.times(&direction, &mut images);
            image.iter_mut().zip(&direction).zip(&diagonal).for_each(|((image, x), d)| *image = damping * d * x);
            self.add_transposed(&images, &mut image);
            let part = measure / dot(&direction, &image);
            x.iter_mut().zip(&direction).for_each(|(x, direction)| *x += part * direction);
            residual.iter_mut().zip(&image).for_each(|(r, image)| *r -= part * image);
            eased = ease(&residual);
            let next = dot(&residual, &eased);
            let turn = next / measure;
            measure = next;
            direction.iter_mut().zip(&eased).for_each(|(direction, eased)| *direction = eased + turn * *direction);
        }
    }
}
