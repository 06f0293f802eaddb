//! Who is near whom, in O(n): a grid of cells as wide as the reach, kept as particles sorted by cell.

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
    /// Their places, in the same order.
    places: Vec<Vec3>,
    /// Those near one particle.
    found: Vec<u32>,
}

/// The cell of a point, row by row along `x`.
fn key(cell: [i64; 3]) -> u64 {
    (cell[2] as u64) << 42 | (cell[1] as u64) << 21 | cell[0] as u64
}

impl Neighbours {
    /// Finds all pairs up to `reach` apart.
    pub fn find(&mut self, points: &[Vec3], reach: f64) {
        let Self { ranges, lists, cells, places, found } = self;
        let low = points.iter().fold(Vec3::repeat(f64::INFINITY), |low, p| low.inf(p));
        let cell_of = |p: &Vec3| {
            let at = (p - low) / reach;
            [at.x, at.y, at.z].map(|x| (x as i64).clamp(0, CELLS - 1))
        };
        cells.clear();
        cells.extend(points.iter().enumerate().map(|(index, p)| (key(cell_of(p)), index as u32)));
        cells.sort_unstable();
        places.clear();
        places.extend(cells.iter().map(|(_, index)| points[*index as usize]));
        ranges.clear();
        ranges.resize(points.len(), (0, 0));
        lists.clear();
        // The particles of a cell share their nine rows of cells.
        let mut rows = [(0, 0); 9];
        let mut first = 0;
        while first < cells.len() {
            let cell = cells[first].0;
            let last = first + cells[first..].partition_point(|(key, _)| *key == cell);
            let [x, y, z] = cell_of(&points[cells[first].1 as usize]);
            for (row, range) in rows.iter_mut().enumerate() {
                let (y, z) = (y + row as i64 % 3 - 1, z + row as i64 / 3 - 1);
                *range = if (0..CELLS).contains(&y) && (0..CELLS).contains(&z) {
                    let from = key([(x - 1).max(0), y, z]);
                    let to = key([(x + 1).min(CELLS - 1), y, z]);
                    let begin = cells.partition_point(|(key, _)| *key < from);
                    (begin, begin + cells[begin..].partition_point(|(key, _)| *key <= to))
                } else {
                    (0, 0)
                };
            }
            // One more: where somebody is written who may not count.
            found.resize(rows.iter().map(|(from, to)| to - from).sum::<usize>() + 1, 0);
            for (_, index) in &cells[first..last] {
                let (p, begin) = (points[*index as usize], lists.len() as u32);
                let mut count = 0;
                for (from, to) in rows {
                    for ((_, other), place) in cells[from..to].iter().zip(&places[from..to]) {
                        // No branch that nobody can foresee.
                        found[count] = *other;
                        count += usize::from((place - p).norm_squared() <= reach * reach && other != index);
                    }
                }
                lists.extend_from_slice(&found[..count]);
                ranges[*index as usize] = (begin, lists.len() as u32);
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
