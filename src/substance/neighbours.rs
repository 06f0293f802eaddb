//! Who is near whom, in O(n): a grid of cells as wide as the reach, kept as particles sorted by cell.

use crate::field::lanes::{Dispatch, Kernel};
use crate::math::Vec3;

/// Cells along an axis: what lies farther out shares the last one.
const CELLS: i64 = 1 << 21;

/// For each particle, the others within a reach.
#[derive(Debug, Default)]
pub struct Neighbours {
    /// For each particle, where its list begins and ends: lists lie in the order of cells.
    ranges: Vec<(u32, u32)>,
    lists: Vec<u32>,
    /// Cell and particle, in order.
    cells: Vec<(u64, u32)>,
    /// Those in the cells round one.
    around: Around,
    /// Those near one particle.
    found: Vec<u32>,
}

/// Particles in the cells round one, which all of this cell look at.
#[derive(Debug, Default)]
struct Around {
    numbers: Vec<u32>,
    /// Their places, by axis.
    places: [Vec<f64>; 3],
    /// Squares of their distances from one of them.
    squares: Vec<f64>,
}

impl Around {
    fn clear(&mut self) {
        self.numbers.clear();
        self.places.iter_mut().for_each(Vec::clear);
    }

    fn add(&mut self, number: u32, place: &Vec3) {
        self.numbers.push(number);
        self.places.iter_mut().zip(place.iter()).for_each(|(column, x)| column.push(*x));
    }

    /// Finds all squares of distances from `p`, with the widest registers of this processor; the same bits with any.
    fn look_from(&mut self, p: &Vec3) {
        self.squares.resize(self.numbers.len(), 0.0);
        Dispatch::best().run(Squares { p, places: &self.places, squares: &mut self.squares });
    }
}

/// The arguments of [`Around::look_from`].
struct Squares<'a> {
    p: &'a Vec3,
    places: &'a [Vec<f64>; 3],
    squares: &'a mut [f64],
}

impl Kernel for Squares<'_> {
    type Output = ();

    /// A plain loop over columns: the compiler makes vectors of it.
    #[inline(always)]
    fn run<const W: usize>(self) {
        let count = self.squares.len();
        let [x, y, z] = self.places;
        let (x, y, z) = (&x[..count], &y[..count], &z[..count]);
        for at in 0..count {
            let way = [x[at] - self.p.x, y[at] - self.p.y, z[at] - self.p.z];
            self.squares[at] = way[0] * way[0] + way[1] * way[1] + way[2] * way[2];
        }
    }
}

/// The cell of a point, row by row along `x`.
fn key(cell: [i64; 3]) -> u64 {
    (cell[2] as u64) << 42 | (cell[1] as u64) << 21 | cell[0] as u64
}

impl Neighbours {
    /// Finds all pairs up to `reach` apart.
    pub fn find(&mut self, points: &[Vec3], reach: f64) {
        let Self { ranges, lists, cells, around, found } = self;
        let low = points.iter().fold(Vec3::repeat(f64::INFINITY), |low, p| low.inf(p));
        let cell_of = |p: &Vec3| {
            let at = (p - low) / reach;
            [at.x, at.y, at.z].map(|x| (x as i64).clamp(0, CELLS - 1))
        };
        cells.clear();
        cells.extend(points.iter().enumerate().map(|(index, p)| (key(cell_of(p)), index as u32)));
        cells.sort_unstable();
        ranges.clear();
        ranges.resize(points.len(), (0, 0));
        lists.clear();
        let mut first = 0;
        while first < cells.len() {
            let cell = cells[first].0;
            let last = first + cells[first..].partition_point(|(key, _)| *key == cell);
            let [x, y, z] = cell_of(&points[cells[first].1 as usize]);
            around.clear();
            // Where the cell's own begin among those around it.
            let mut own = 0;
            for row in 0..9 {
                let (y, z) = (y + row % 3 - 1, z + row / 3 - 1);
                if !(0..CELLS).contains(&y) || !(0..CELLS).contains(&z) {
                    continue;
                }
                let from = key([(x - 1).max(0), y, z]);
                let to = key([(x + 1).min(CELLS - 1), y, z]);
                let begin = cells.partition_point(|(key, _)| *key < from);
                let end = begin + cells[begin..].partition_point(|(key, _)| *key <= to);
                if (begin..end).contains(&first) {
                    own = around.numbers.len() + first - begin;
                }
                cells[begin..end].iter().for_each(|(_, index)| around.add(*index, &points[*index as usize]));
            }
            found.resize(around.numbers.len() + 1, 0);
            for (at, (_, index)) in cells[first..last].iter().enumerate() {
                around.look_from(&points[*index as usize]);
                // Nobody is near itself.
                around.squares[own + at] = f64::INFINITY;
                let mut count = 0;
                for (other, square) in around.numbers.iter().zip(&around.squares) {
                    // No branch that nobody can foresee: who may not count is written too, and then over.
                    found[count] = *other;
                    count += usize::from(*square <= reach * reach);
                }
                ranges[*index as usize] = (lists.len() as u32, (lists.len() + count) as u32);
                lists.extend_from_slice(&found[..count]);
            }
            first = last;
        }
    }

    /// The others near a particle.
    pub fn of(&self, index: usize) -> &[u32] {
        let (begin, end) = self.ranges[index];
        &self.lists[begin as usize..end as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_what_all_pairs_would() {
        let mut seed = 1_u64;
        let mut next = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let mut points: Vec<Vec3> = (0..400).map(|_| Vec3::new(next(), next(), next() * 0.3)).collect();
        points.push(Vec3::new(1e9, -1e9, 3.0));
        points.push(points[7]);
        let mut near = Neighbours::default();
        near.find(&points, 0.17);
        for (i, p) in points.iter().enumerate() {
            let mut found = near.of(i).to_vec();
            found.sort_unstable();
            let is_near = |j: &u32| *j as usize != i && (points[*j as usize] - p).norm() <= 0.17;
            let expected: Vec<u32> = (0..points.len() as u32).filter(is_near).collect();
            assert_eq!(found, expected);
        }
    }
}
