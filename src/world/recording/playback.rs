//! Playing a recording: any frame of it, as a world that can be asked everything.

use super::file::{self, Chunk, Kind};
use super::pack::{Moment, unpack};
use crate::error::{Error, Result, out_of_range};
use crate::world::{World, WorldDesc};

/// A recording, and the world that shows one of its frames.
///
/// That world can be asked everything that needs no step: rays, fields, closest points, meshes, pieces; and as nobody
/// can change it, it is always the frame. It is at rest, without springs, contacts or events; a [snapshot] of it gives a
/// world to step on from there. Handles stay valid from frame to frame as long as their objects are there; their index
/// and generation are those in the world that was recorded. Before the first [`Playback::seek`] it is empty.
///
/// [snapshot]: World::snapshot
pub struct Playback {
    reel: Reel,
    world: World,
}

impl Playback {
    /// Opens a recording, and checks all of it. What is damaged, cut short or of another format is refused, with what
    /// is wrong and where.
    pub fn open(bytes: Vec<u8>) -> Result<Self> {
        Ok(Self { reel: Reel::open(bytes)?, world: World::new(WorldDesc::default())? })
    }

    /// Number of frames.
    pub fn frames(&self) -> u32 {
        self.reel.frames()
    }

    /// When a frame was taken \[s\].
    pub fn time(&self, frame: u32) -> Result<f64> {
        self.reel.time(frame)
    }

    /// Shows a frame. The next one is the cheapest; any other costs at most a key interval of frames.
    pub fn seek(&mut self, frame: u32) -> Result<&World> {
        self.reel.seek(&mut self.world, frame)?;
        Ok(&self.world)
    }

    /// The frame that is shown; none before the first [`Playback::seek`].
    pub fn frame(&self) -> Option<u32> {
        self.reel.shown
    }

    /// The world as it was at that frame.
    pub fn world(&self) -> &World {
        &self.world
    }
}

/// Where a frame is.
#[derive(Clone, Copy, Debug)]
struct Place {
    chunk: usize,
    /// The frame to begin with.
    key: u32,
    /// The chunk of its structure.
    structure: usize,
}

/// The frames of a recording, without the world that shows one.
pub(crate) struct Reel {
    bytes: Vec<u8>,
    chunks: Vec<Chunk>,
    frames: Vec<Place>,
    shown: Option<u32>,
    /// The chunk of the structure that is shown.
    structure: Option<usize>,
    /// The frame that was read last, and its numbers with those of the frame before, as far as these count.
    read: Option<u32>,
    past: [Moment; 2],
    known: usize,
    /// Buffer.
    now: Moment,
}

impl Reel {
    pub fn open(bytes: Vec<u8>) -> Result<Self> {
        let chunks = file::open(&bytes)?;
        let mut frames = Vec::new();
        let (mut structure, mut key) = (0, 0);
        for (index, chunk) in chunks.iter().enumerate() {
            match chunk.kind {
                Kind::Structure => structure = index,
                Kind::Key => key = frames.len() as u32,
                _ => {}
            }
            if chunk.kind != Kind::Structure {
                frames.push(Place { chunk: index, key, structure });
            }
        }
        let (past, now) = Default::default();
        Ok(Self { bytes, chunks, frames, shown: None, structure: None, read: None, past, known: 0, now })
    }

    pub fn frames(&self) -> u32 {
        self.frames.len() as u32
    }

    fn place(&self, frame: u32) -> Result<Place> {
        let refused = || out_of_range("frame", frame, "below the number of frames");
        self.frames.get(frame as usize).copied().ok_or_else(refused)
    }

    /// Time and numbers of a frame, as they are written.
    fn content(&self, place: Place) -> (f64, &[u8]) {
        match self.chunks[place.chunk].content(&self.bytes).split_first_chunk() {
            Some((time, numbers)) => (f64::from_le_bytes(*time), numbers),
            // Looked at when it was opened.
            None => (0.0, &[]),
        }
    }

    pub fn time(&self, frame: u32) -> Result<f64> {
        Ok(self.content(self.place(frame)?).0)
    }

    /// Makes `world`, which no one else changes, show a frame; after an error it is as it was.
    pub fn seek(&mut self, world: &mut World, frame: u32) -> Result<()> {
        let place = self.place(frame)?;
        if self.shown == Some(frame) {
            return Ok(());
        }
        let at = self.chunks[place.chunk].at;
        let refused = |why: &dyn std::fmt::Display| Error::Recording(format!("frame {frame} at byte {at}: {why}"));
        let fresh = if self.structure == Some(place.structure) {
            None
        } else {
            let fresh = World::of_structure(self.chunks[place.structure].content(&self.bytes));
            Some(fresh.map_err(|error| refused(&error))?)
        };
        self.read_up_to(frame, place, fresh.as_ref().unwrap_or(world)).map_err(|why| refused(&why))?;
        match fresh {
            Some(mut fresh) => {
                fresh.show_moment(&self.past[0]).map_err(|error| refused(&error))?;
                world.take_over(fresh);
                self.structure = Some(place.structure);
            }
            None => world.show_moment(&self.past[0]).map_err(|error| refused(&error))?,
        }
        self.shown = Some(frame);
        Ok(())
    }

    /// Reads frames up to this one, from the last that was read or from one by itself.
    fn read_up_to(&mut self, frame: u32, place: Place, world: &World) -> std::result::Result<(), String> {
        let goes_on = self.read.filter(|read| (place.key..=frame).contains(read));
        let next = goes_on.map_or(place.key, |read| read + 1);
        if goes_on.is_none() {
            self.known = 0;
        }
        // Until all is read, nothing that was read counts.
        self.read = None;
        for number in next..=frame {
            let mut now = std::mem::take(&mut self.now);
            // Of the lengths that the structure gives.
            world.take_moment(&mut now);
            let past = [&self.past[0], &self.past[1]];
            let unpacked = unpack(self.content(self.frames[number as usize]).1, &past[..self.known], &mut now);
            self.now = now;
            unpacked.ok_or_else(|| format!("the numbers of frame {number} are none of its structure"))?;
            self.past.swap(0, 1);
            std::mem::swap(&mut self.past[0], &mut self.now);
            self.known = (self.known + 1).min(2);
        }
        self.read = Some(frame);
        Ok(())
    }
}
