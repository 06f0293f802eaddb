//! Bricks of samples: only those that may have surface in them are kept.

use super::lattice::{Lattice, Sorted};
use super::{Cubes, Solid, Spans};
use crate::error::{Error, Result};

/// Samples along an edge of a brick.
pub const EDGE: usize = 4;
/// Samples of a brick: a bit each in a word.
pub const SAMPLES: usize = EDGE * EDGE * EDGE;
/// Samples along an edge of an octet.
pub const OCTET: usize = 2 * EDGE;

/// Most bricks that may have surface in them: a kilobyte and a half each.
const MOST: usize = 1 << 19;

/// In the table of places: no brick, because all of it is outside, or inside.
const OUTSIDE: u32 = u32::MAX;
const INSIDE: u32 = u32::MAX - 1;

/// Half the edges of the cubes for which [`Solid::look`] is asked, in cells. What a brick answers for: its samples, the
/// edges that begin at them, and those that end there; all these meet no surface where the cube is clear of it.
const ASKED: f64 = 0.5 * EDGE as f64 + 0.5;
/// The same of its samples alone.
const OWN: f64 = 0.5 * EDGE as f64 - 0.5;

/// The index of a sample in its brick.
#[inline]
pub fn index([x, y, z]: [usize; 3]) -> usize {
    x % EDGE + EDGE * (y % EDGE + EDGE * (z % EDGE))
}

/// Appends the parts whose reach is as wanted. Every part is written, and the next one over it if it is not wanted:
/// there is nothing to guess for the processor.
fn select(out: &mut Vec<u32>, reach: &[u32], parts: &[u32], wanted: impl Fn(u32) -> bool) {
    let mut end = out.len();
    out.resize(end + parts.len(), 0);
    for (part, reach) in parts.iter().zip(reach) {
        out[end] = *part;
        end += usize::from(wanted(*reach));
    }
    out.truncate(end);
}

/// The bricks of a lattice.
#[derive(Debug, Default)]
pub struct Bricks {
    /// For each place of the lattice, its brick, or what else it is.
    table: Vec<u32>,
    /// Places along each axis.
    places: [usize; 3],
    bricks: Vec<Brick>,
    /// The excess at the samples.
    values: Vec<[f64; SAMPLES]>,
    /// The parts of the bricks.
    lists: Vec<u32>,
    spans: Spans,
    /// The same for the parts of a brick, and the parts that reach all over it.
    finer: Spans,
    all_over: Vec<u32>,
}

#[derive(Clone, Copy, Debug)]
struct Brick {
    /// Its place among the bricks of the lattice.
    place: [u32; 3],
    /// A bit for each sample that is inside.
    inside: u64,
    /// Its parts in the lists: first those that reach its samples, then those that reach its edges.
    parts: [u32; 3],
}

/// A brick and its seven neighbours upwards along the axes: `x + 2 y + 4 z`.
#[derive(Debug)]
pub struct Near {
    bricks: [u32; 8],
    inside: [u64; 8],
}

impl Near {
    /// The brick and the index there of a sample, counted from the corner of the middle one, up to [`EDGE`].
    #[inline]
    pub fn find(&self, [x, y, z]: [usize; 3]) -> (usize, usize) {
        let which = x / EDGE + 2 * (y / EDGE) + 4 * (z / EDGE);
        (self.bricks[which] as usize, index([x, y, z]))
    }

    /// The bits of five samples in a row.
    #[inline]
    fn row(&self, y: usize, z: usize) -> u32 {
        let (which, shift) = (2 * (y / EDGE) + 4 * (z / EDGE), index([0, y, z]));
        let four = |which: usize| (self.inside[which] >> shift) as u32 & 0xf;
        four(which) | (four(which + 1) & 1) << 4
    }

    /// The rows of the brick and one beyond, y first.
    #[inline]
    fn rows(&self) -> [[u32; EDGE + 1]; EDGE + 1] {
        std::array::from_fn(|z| std::array::from_fn(|y| self.row(y, z)))
    }
}

impl Bricks {
    /// Looks at every octet that a part reaches, and samples what may have surface in it.
    pub fn fill(&mut self, solid: &mut impl Solid, lattice: &Lattice, sorted: &Sorted) -> Result<()> {
        self.places = lattice.octets.map(|octets| 2 * octets);
        self.table.clear();
        self.table.resize(self.places.iter().product(), OUTSIDE);
        self.bricks.clear();
        self.lists.clear();
        for (octet, parts) in sorted.reached(lattice) {
            self.look(solid, lattice, octet, parts);
            if self.bricks.len() > MOST {
                return Err(Error::Capacity("cell_size is too small: more than 33 million samples near the surface"));
            }
        }
        Ok(())
    }

    fn look(&mut self, solid: &mut impl Solid, lattice: &Lattice, octet: [usize; 3], parts: &[u32]) {
        let place = |which: usize| [0, 1, 2].map(|k| (2 * octet[k] + (which >> k & 1)) as u32);
        let center = |which: usize| place(which).map(|at| f64::from(at) * EDGE as f64 + OWN);
        let centers = std::array::from_fn(|which| lattice.at(center(which)));
        let cubes = Cubes { centers, half: ASKED * lattice.cell, inner: OWN * lattice.cell };
        for (which, verdict) in solid.look(parts, &cubes, &mut self.spans).into_iter().enumerate() {
            let code = match verdict {
                Some(true) => INSIDE,
                Some(false) => continue,
                None if self.is_inside(solid, &cubes, which, parts) => INSIDE,
                None => self.add(solid, lattice, place(which), which, parts),
            };
            let index = self.table_index(place(which)).expect("an octet is within the table");
            self.table[index] = code;
        }
    }

    /// Whether a brick is wholly inside by a closer look at its eight parts, with the fields alone that reach all of
    /// its samples.
    fn is_inside(&mut self, solid: &mut impl Solid, cubes: &Cubes, which: usize, parts: &[u32]) -> bool {
        self.all_over.clear();
        select(&mut self.all_over, &self.spans.reach, parts, |reach| reach >> which & Spans::ALL_OVER != 0);
        let (middle, half) = (cubes.centers[which], 0.5 * cubes.half);
        let shift = |octant: usize, k: usize| if octant >> k & 1 == 1 { half } else { -half };
        let centers = std::array::from_fn(|octant| [0, 1, 2].map(|k| middle[k] + shift(octant, k)));
        let octants = Cubes { centers, half, inner: half };
        !self.all_over.is_empty()
            && solid.look(&self.all_over, &octants, &mut self.finer).iter().all(|verdict| *verdict == Some(true))
    }

    /// Samples a brick.
    fn add(&mut self, solid: &mut impl Solid, lattice: &Lattice, place: [u32; 3], which: usize, parts: &[u32]) -> u32 {
        let begin = self.lists.len();
        let reach = &self.spans.reach;
        select(&mut self.lists, reach, parts, |reach| reach >> which & Spans::INNER != 0);
        let own = self.lists.len();
        let both = Spans::REACH | Spans::INNER;
        select(&mut self.lists, reach, parts, |reach| reach >> which & both == Spans::REACH);

        let corner = place.map(|at| at * EDGE as u32);
        let sample = |index: usize| [index % EDGE, index / EDGE % EDGE, index / (EDGE * EDGE)];
        let points: [[f64; 3]; SAMPLES] = std::array::from_fn(|index| lattice.position(corner, sample(index)));
        let brick = self.bricks.len();
        if self.values.len() == brick {
            self.values.push([0.0; SAMPLES]);
        }
        solid.evaluate(&self.lists[begin..own], &points, &mut self.values[brick], None);
        let bits = self.values[brick].iter().enumerate();
        let inside = bits.fold(0, |word, (index, value)| word | u64::from(*value >= 0.0) << index);
        let parts = [begin, own, self.lists.len()].map(|at| at as u32);
        self.bricks.push(Brick { place, inside, parts });
        brick as u32
    }

    fn table_index(&self, place: [u32; 3]) -> Option<usize> {
        let [x, y, z] = place.map(|at| at as usize);
        let [nx, ny, nz] = self.places;
        (x < nx && y < ny && z < nz).then_some(x + nx * (y + ny * z))
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.bricks.len()
    }

    /// The first sample of a brick, counted in the lattice.
    pub fn corner(&self, brick: usize) -> [u32; 3] {
        self.bricks[brick].place.map(|at| at * EDGE as u32)
    }

    /// The parts that reach a brick and the edges that begin there.
    pub fn parts(&self, brick: usize) -> &[u32] {
        let [begin, _, end] = self.bricks[brick].parts;
        &self.lists[begin as usize..end as usize]
    }

    /// The excess at a sample of a brick or a neighbour.
    pub fn value(&self, near: &Near, sample: [usize; 3]) -> f64 {
        let (brick, index) = near.find(sample);
        self.values[brick][index]
    }

    /// A brick and its neighbours.
    pub fn near(&self, brick: usize) -> Near {
        let place = self.bricks[brick].place;
        let neighbour = |which: usize| [0, 1, 2].map(|k| place[k] + (which >> k & 1) as u32);
        let bricks =
            std::array::from_fn(|which| self.table_index(neighbour(which)).map_or(OUTSIDE, |index| self.table[index]));
        let inside = bricks.map(|code| match code {
            OUTSIDE => 0,
            INSIDE => u64::MAX,
            brick => self.bricks[brick as usize].inside,
        });
        Near { bricks, inside }
    }

    /// Calls with the lower end and the axis of each edge of the brick whose ends differ. Both ends are in bricks.
    pub fn for_each_crossing(&self, near: &Near, mut each: impl FnMut([usize; 3], usize)) {
        let rows = near.rows();
        for z in 0..EDGE {
            for y in 0..EDGE {
                let row = rows[z][y];
                let crossed = [row ^ row >> 1, row ^ rows[z][y + 1], row ^ rows[z + 1][y]];
                let mut any = (crossed[0] | crossed[1] | crossed[2]) & 0xf;
                while any != 0 {
                    let x = any.trailing_zeros() as usize;
                    any &= any - 1;
                    for (axis, crossed) in crossed.iter().enumerate() {
                        if crossed >> x & 1 == 1 {
                            each([x, y, z], axis);
                        }
                    }
                }
            }
        }
    }

    /// Calls with each cell of the brick whose corners differ, and its case in the table.
    pub fn for_each_mixed_cell(&self, near: &Near, mut each: impl FnMut([usize; 3], usize)) {
        let rows = near.rows();
        for z in 0..EDGE {
            for y in 0..EDGE {
                let four = [rows[z][y], rows[z][y + 1], rows[z + 1][y], rows[z + 1][y + 1]];
                let all = four.iter().fold(u32::MAX, |all, row| all & row & row >> 1);
                let some = four.iter().fold(0, |some, row| some | row | row >> 1);
                let mut mixed = some & !all & 0xf;
                while mixed != 0 {
                    let x = mixed.trailing_zeros() as usize;
                    mixed &= mixed - 1;
                    let case = (0..4).fold(0, |case, k| case | (four[k] >> x & 3) << (2 * k));
                    each([x, y, z], case as usize);
                }
            }
        }
    }
}
