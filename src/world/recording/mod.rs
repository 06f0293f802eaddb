//! Recordings: the shape of a world frame by frame, in few bytes \[97, section III-D.3\].
//!
//! A frame has what the surfaces follow from: poses of links, offsets of skeletons, weights of blends; of particles
//! their places, offsets, volumes, labels and bonds. So a frame that is played has the same surfaces to the bit,
//! contacts and bulges included, which follow from where the bodies are. What a surface does not show is left out:
//! velocities, forces, springs, what contacts remember, who sleeps.
//!
//! | bytes | |
//! | --- | --- |
//! | 28 | header: `isoreel` and a zero; format; version of the library that wrote it; CRC-32 of these |
//! | … | chunks: kind (1), length of the content (4), content, CRC-32 of the chunk's number and all of it (4) |
//! | … | the index, a chunk too: kind and length of each chunk before it |
//! | 16 | end: where the index begins; `isoend` and two zeros |
//!
//! | kind | content |
//! | --- | --- |
//! | 0 | a structure: settings, bodies, links, skeletons with their slots, as in a [snapshot](super::snapshot) |
//! | 1 | a frame by itself: time (8), then its numbers as [`pack`](mod@pack) has them |
//! | 2 | a frame by what differs from the last two |
//! | 3 | the index |
//!
//! A structure holds for all frames up to the next; it is written whenever what a world is made of has changed.

mod file;
mod moment;
mod pack;
mod playback;
mod structure;

use super::World;
use super::bytes::Sink;
use crate::error::{Error, Result, require};
use file::Kind;
use pack::{Moment, pack};
pub use playback::Playback;
pub(crate) use playback::Reel;

/// How to record.
#[derive(Clone, Debug, PartialEq)]
pub struct RecorderDesc {
    /// Every how many frames one is written by itself, from 1 to 65536: to go to any frame, at most so many are read.
    pub key_interval: u32,
}

impl Default for RecorderDesc {
    fn default() -> Self {
        Self { key_interval: 60 }
    }
}

/// Takes the bytes of a recording, in order; says why it cannot.
pub type Stream = Box<dyn FnMut(&[u8]) -> std::result::Result<(), String> + Send>;

enum Output {
    Memory(Vec<u8>),
    Stream(Stream),
}

/// Records a world: one frame a call, into memory or to a stream.
pub struct Recorder {
    desc: RecorderDesc,
    output: Output,
    /// Bytes that have been written.
    written: u64,
    chunks: Vec<(Kind, u32)>,
    frames: u32,
    time: f64,
    structure: Vec<u8>,
    /// The last frame and the one before, and how many of them the next may count on.
    past: [Moment; 2],
    known: usize,
    /// Frames since the last one by itself.
    since_key: u32,
    /// Nothing can follow: it has its end, or the stream failed.
    closed: Option<&'static str>,
    /// Buffers.
    now: Moment,
    fresh: Vec<u8>,
    chunk: Vec<u8>,
}

impl Sink for Vec<u8> {
    fn put(&mut self, bytes: &[u8]) {
        self.extend_from_slice(bytes);
    }
}

impl Recorder {
    /// Records into memory, which grows with each frame.
    pub fn new(desc: RecorderDesc) -> Result<Self> {
        Self::with(desc, Output::Memory(Vec::new()))
    }

    /// Records to a stream: every frame is handed over as soon as it is taken. [`Recorder::finish`] must end it.
    pub fn to_stream(desc: RecorderDesc, stream: Stream) -> Result<Self> {
        Self::with(desc, Output::Stream(stream))
    }

    fn with(desc: RecorderDesc, output: Output) -> Result<Self> {
        require("key_interval", desc.key_interval.into(), "from 1 to 65536", |x| (1.0..=65536.0).contains(&x))?;
        Ok(Self {
            desc,
            output,
            written: 0,
            chunks: Vec::new(),
            frames: 0,
            time: f64::NEG_INFINITY,
            structure: Vec::new(),
            past: Default::default(),
            known: 0,
            since_key: 0,
            closed: None,
            now: Moment::default(),
            fresh: Vec::new(),
            chunk: Vec::new(),
        })
    }

    /// Number of frames so far.
    pub fn frames(&self) -> u32 {
        self.frames
    }

    /// Bytes so far, without the index.
    pub fn size(&self) -> u64 {
        self.written
    }

    /// Takes a frame of a world as it is now, at `time` \[s\], not before that of the last frame. All frames of a
    /// recording are of one world. After a stream has failed every call is refused.
    pub fn capture(&mut self, world: &World, time: f64) -> Result<()> {
        self.check_open()?;
        require("time of a frame", time, "finite and not before the last frame", |time| time >= self.time)?;
        let frames = self.frames.checked_add(1).ok_or(Error::Capacity("a recording has at most 2^32 - 1 frames"))?;
        self.chunk.clear();
        if self.written == 0 {
            self.chunk.extend_from_slice(&file::header());
        }
        let mut added = [None; 2];
        self.fresh.clear();
        world.write_structure(&mut self.fresh);
        let changed = self.frames == 0 || self.fresh != self.structure;
        if changed {
            let fresh = &self.fresh;
            let length = file::put_chunk(Kind::Structure, self.chunks.len(), &mut self.chunk, |out| out.put(fresh))?;
            added[0] = Some((Kind::Structure, length));
        }
        world.take_moment(&mut self.now);
        let by_itself = changed || self.since_key >= self.desc.key_interval;
        let known = if by_itself { 0 } else { self.known };
        let kind = if by_itself { Kind::Key } else { Kind::Change };
        let (now, past) = (&self.now, [&self.past[0], &self.past[1]]);
        let number = self.chunks.len() + usize::from(changed);
        let length = file::put_chunk(kind, number, &mut self.chunk, |out| {
            out.extend_from_slice(&time.to_le_bytes());
            pack(now, &past[..known], out);
        })?;
        added[1] = Some((kind, length));
        self.hand_over()?;
        self.chunks.extend(added.into_iter().flatten());
        std::mem::swap(&mut self.structure, &mut self.fresh);
        self.past.swap(0, 1);
        std::mem::swap(&mut self.past[0], &mut self.now);
        self.known = (known + 1).min(2);
        self.since_key = if by_itself { 1 } else { self.since_key + 1 };
        (self.frames, self.time) = (frames, time);
        Ok(())
    }

    /// The recording so far, whole; refused for one that goes to a stream. It may go on afterwards.
    pub fn bytes(&self) -> Result<Vec<u8>> {
        let (begin, end) = self.parts()?;
        Ok([begin, &end].concat())
    }

    /// The same as what there is, and what makes it whole.
    pub(crate) fn parts(&self) -> Result<(&[u8], Vec<u8>)> {
        let Output::Memory(bytes) = &self.output else {
            return Err(Error::Unsupported("the recording has gone to its stream"));
        };
        let mut end = Vec::new();
        self.put_end(&mut end)?;
        Ok((bytes, end))
    }

    /// Ends a recording that goes to a stream: hands over the index. Nothing can follow. Without it, a recording is
    /// refused as cut short.
    pub fn finish(&mut self) -> Result<()> {
        self.check_open()?;
        if matches!(self.output, Output::Memory(_)) {
            return Err(Error::Unsupported("a recording in memory has no stream to finish: take its bytes"));
        }
        let mut chunk = std::mem::take(&mut self.chunk);
        chunk.clear();
        let put = self.put_end(&mut chunk);
        self.chunk = chunk;
        put?;
        self.hand_over()?;
        self.closed = Some("the recording is finished");
        Ok(())
    }

    fn check_open(&self) -> Result<()> {
        self.closed.map_or(Ok(()), |why| Err(Error::Unsupported(why)))
    }

    fn put_end(&self, out: &mut Vec<u8>) -> Result<()> {
        if self.written == 0 {
            out.extend_from_slice(&file::header());
        }
        let at = self.written.max(file::HEADER as u64);
        file::put_end(&self.chunks, at, out)
    }

    fn hand_over(&mut self) -> Result<()> {
        match &mut self.output {
            Output::Memory(bytes) => bytes.extend_from_slice(&self.chunk),
            Output::Stream(stream) => {
                if let Err(why) = stream(&self.chunk) {
                    self.closed = Some("the recording's stream has failed: nothing can follow");
                    return Err(Error::Stream(format!("at byte {}: {why}", self.written)));
                }
            }
        }
        self.written += self.chunk.len() as u64;
        Ok(())
    }
}
