//! Where samples are, and which parts reach which octet of bricks.

use super::Solid;
use super::bricks::{EDGE, OCTET};
use crate::error::{Error, Result, out_of_range, require};
use crate::math::Vec3;

/// Most bricks within the bounds of a mesh: their table takes 128 MB.
pub const MOST_PLACES: f64 = (1u64 << 25) as f64;
/// Most places of parts in lists of octets.
const MOST_ENTRIES: usize = 1 << 28;

/// Where the samples lie between the multiples of the cell: off the round numbers at which hosts put their faces.
const PHASE: [f64; 3] = [0.381_966, 0.414_214, 0.302_776];

/// A lattice of samples over the bounds of a solid.
#[derive(Debug)]
pub struct Lattice {
    origin: Vec3,
    /// Distance of samples \[m\].
    pub cell: f64,
    /// Octets along each axis.
    pub octets: [usize; 3],
}

impl Lattice {
    /// A lattice whose outer samples are outside; `None` for a solid without parts.
    pub fn over(solid: &impl Solid, cell: f64) -> Result<Option<Self>> {
        require("cell_size", cell, "> 0 and at most 1e9", |x| x > 0.0 && x <= 1e9)?;
        let each = (0..solid.parts()).map(|part| solid.bounds(part));
        let Some((low, high)) = each.reduce(|(l, h), (low, high)| (l.inf(&low), h.sup(&high))) else {
            return Ok(None);
        };
        let origin = Vec3::from_fn(|k, _| ((low[k] / cell).floor() - 2.0 + PHASE[k]) * cell);
        // One cell more, so that the last samples are outside.
        let octets = Vec3::from_fn(|k, _| ((high[k] + cell - origin[k]) / (cell * OCTET as f64)).floor() + 1.0);
        if octets.product() * 8.0 > MOST_PLACES || !octets.iter().all(|x| x.is_finite()) {
            let size = high - low;
            let value = format_args!("{cell} for a coat of {:.4} x {:.4} x {:.4} m", size.x, size.y, size.z);
            return Err(out_of_range("cell_size", value, "so large that its bounds hold at most 2^31 cells"));
        }
        Ok(Some(Self { origin, cell, octets: [0, 1, 2].map(|k| octets[k] as usize) }))
    }

    /// Where a sample is: `corner` counts samples to the first one of its brick.
    #[inline]
    pub fn position(&self, corner: [u32; 3], sample: [usize; 3]) -> [f64; 3] {
        let along = |k: usize| self.origin[k] + self.cell * f64::from(corner[k] + sample[k] as u32);
        [along(0), along(1), along(2)]
    }

    /// A place given in samples.
    pub fn at(&self, place: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.origin[k] + self.cell * place[k])
    }

    /// The octets that bounds reach, from the first up to the last along each axis. An octet answers for its own
    /// samples, the edges that begin there, and those that end there.
    fn reached(&self, (low, high): (Vec3, Vec3)) -> [[usize; 2]; 3] {
        [0, 1, 2].map(|k| {
            let place = |x: f64| (x - self.origin[k]) / (self.cell * OCTET as f64);
            let margin = 1.0 / OCTET as f64;
            let first = (place(low[k]) - 1.0 - 1e-9).ceil().max(0.0) as usize;
            let last = (place(high[k]) + margin + 1e-9).floor().max(0.0) as usize;
            [first, last.min(self.octets[k] - 1)]
        })
    }

    fn octet_index(&self, [x, y, z]: [usize; 3]) -> usize {
        x + self.octets[0] * (y + self.octets[1] * z)
    }
}

/// The parts that reach each octet, in ascending order.
#[derive(Debug, Default)]
pub struct Sorted {
    /// Where the list of each octet begins in `parts`, and the end.
    starts: Vec<u32>,
    parts: Vec<u32>,
}

impl Sorted {
    /// Sorts by counting: in proportion to the parts, and to the octets.
    pub fn sort(&mut self, solid: &impl Solid, lattice: &Lattice) -> Result<()> {
        let octets = lattice.octets.iter().product::<usize>();
        self.starts.clear();
        // One more at the front: what counts up here is where the next pass begins to write.
        self.starts.resize(octets + 2, 0);
        let mut entries = 0;
        for part in 0..solid.parts() {
            for_each_place(&lattice.reached(solid.bounds(part)), |octet| {
                self.starts[lattice.octet_index(octet) + 2] += 1;
                entries += 1;
            });
            if entries > MOST_ENTRIES {
                return Err(Error::Capacity("cell_size is too small for the mesh of so many skeletons"));
            }
        }
        for octet in 2..self.starts.len() {
            self.starts[octet] += self.starts[octet - 1];
        }
        self.parts.resize(entries, 0);
        for part in 0..solid.parts() {
            for_each_place(&lattice.reached(solid.bounds(part)), |octet| {
                let place = &mut self.starts[lattice.octet_index(octet) + 1];
                self.parts[*place as usize] = part as u32;
                *place += 1;
            });
        }
        Ok(())
    }

    /// Each octet that a part reaches, in the order z, y, x, with those parts.
    pub fn reached<'a>(&'a self, lattice: &'a Lattice) -> impl Iterator<Item = ([usize; 3], &'a [u32])> {
        let [nx, ny, _] = lattice.octets;
        let list = |octet: usize| &self.parts[self.starts[octet] as usize..self.starts[octet + 1] as usize];
        let octets = 0..self.starts.len() - 2;
        octets
            .filter(move |octet| !list(*octet).is_empty())
            .map(move |octet| ([octet % nx, octet / nx % ny, octet / (nx * ny)], list(octet)))
    }
}

fn for_each_place(ranges: &[[usize; 2]; 3], mut each: impl FnMut([usize; 3])) {
    let [x, y, z] = ranges.map(|[first, last]| first..last + 1);
    for z in z {
        for y in y.clone() {
            x.clone().for_each(|x| each([x, y, z]));
        }
    }
}

const _: () = assert!(OCTET == 2 * EDGE);
