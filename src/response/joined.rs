//! The inertia of articulations as blocks of the system: the inverse of what their hosts say of them, over those links
//! that have unknowns. Who has none is not pushed, and what the others do to each other stays as it is.

use nalgebra::Matrix6;

use super::envelope::{BLOCK, Envelope};
use crate::base::Articulation;

/// The blocks of all articulations of an island.
#[derive(Debug, Default)]
pub struct Joined {
    /// Row by row.
    entries: Vec<Entry>,
    /// Where the entries of each row begin.
    starts: Vec<u32>,
    members: Vec<Joint>,
    matrix: Envelope,
    inverse: Vec<f64>,
}

/// A block of inertia.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// Where it stands.
    pub row: u32,
    /// The other link; the row itself for what joints add to its own block.
    pub other: u32,
    /// The block.
    pub block: Matrix6<f64>,
}

/// A link of an articulation that has unknowns: its place in the list, and its row.
#[derive(Clone, Copy, Debug)]
struct Joint {
    place: usize,
    row: u32,
}

impl Joined {
    /// Works out the blocks, for links in the order of the system.
    pub fn set<'a>(&mut self, order: &[u32], articulations: impl Iterator<Item = &'a Articulation>) {
        self.entries.clear();
        for articulation in articulations {
            self.members.clear();
            for (place, link) in articulation.links.iter().enumerate() {
                if let Some(row) = order.iter().position(|other| other == link) {
                    self.members.push(Joint { place, row: row as u32 });
                }
            }
            // A single link's matrix is its own block.
            if self.members.len() > 1 {
                self.add(articulation);
            }
        }
        self.entries.sort_unstable_by_key(|entry| (entry.row, entry.other));
        self.starts.clear();
        if self.entries.is_empty() {
            return;
        }
        for row in 0..=order.len() as u32 {
            self.starts.push(self.entries.partition_point(|entry| entry.row < row) as u32);
        }
    }

    fn add(&mut self, articulation: &Articulation) {
        let Self { entries, members, matrix, inverse, .. } = self;
        let count = members.len();
        matrix.fill(count, |i, j| articulation.block(members[i].place, members[j].place));
        // Positive definite it is, as its whole was; what rounding makes of it must not stop the step.
        if !matrix.factor() {
            return;
        }
        let first = entries.len();
        for row in members.iter() {
            entries.extend(members.iter().map(|other| Entry {
                row: row.row,
                other: other.row,
                block: Matrix6::zeros(),
            }));
        }
        let entries = &mut entries[first..];
        matrix.invert(inverse);
        for (i, row) in inverse.chunks_exact(count * BLOCK).enumerate() {
            for (j, part) in row.chunks_exact(BLOCK).enumerate() {
                let block = &mut entries[i / BLOCK * count + j].block;
                block.row_mut(i % BLOCK).iter_mut().zip(part).for_each(|(to, from)| *to = *from);
            }
        }
        for (i, member) in members.iter().enumerate() {
            let own = articulation.block(member.place, member.place).cholesky();
            entries[i * count + i].block -= own.map_or_else(Matrix6::zeros, |factor| factor.inverse());
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// All blocks, and those of a row as a range of them.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Where the blocks of a row are.
    pub fn range_of(&self, row: usize) -> std::ops::Range<usize> {
        if self.entries.is_empty() { 0..0 } else { self.starts[row] as usize..self.starts[row + 1] as usize }
    }
}
