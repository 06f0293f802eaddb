//! The bytes of a recording: a header, chunks with a checksum each, an index, an end. See the [module](super).

use crate::error::{Error, Result};

/// What chunks hold. Another number is refused: no recording is ever half understood.
const FORMAT: u32 = 1;
const MAGIC: [u8; 8] = *b"isoreel\0";
const END: [u8; 8] = *b"isoend\0\0";
const FORMAT_AT: usize = 8;
const VERSION_AT: usize = 12;
const CHECK_AT: usize = 24;
pub const HEADER: usize = 28;
const TRAILER: usize = 16;
/// Bytes of a chunk before its content, and after.
const HEAD: usize = 5;
const CHECKSUM: usize = 4;
/// Bytes of the index for each chunk.
const ENTRY: usize = 5;

/// What a chunk holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The structure of all frames up to the next.
    Structure = 0,
    /// A frame by itself.
    Key = 1,
    /// A frame by what differs from those before.
    Change = 2,
    Index = 3,
}

impl Kind {
    fn from_number(number: u8) -> Option<Self> {
        [Kind::Structure, Kind::Key, Kind::Change, Kind::Index].into_iter().find(|kind| *kind as u8 == number)
    }
}

/// A chunk: what it holds, and where.
#[derive(Clone, Copy, Debug)]
pub struct Chunk {
    pub kind: Kind,
    /// Where its head begins.
    pub at: usize,
    /// Bytes of its content.
    pub length: u32,
}

impl Chunk {
    pub fn content<'a>(&self, bytes: &'a [u8]) -> &'a [u8] {
        &bytes[self.at + HEAD..][..self.length as usize]
    }

    fn end(&self) -> usize {
        self.at + HEAD + self.length as usize + CHECKSUM
    }
}

/// The beginning of every recording.
pub fn header() -> [u8; HEADER] {
    let mut header = [0; HEADER];
    header[..FORMAT_AT].copy_from_slice(&MAGIC);
    header[FORMAT_AT..VERSION_AT].copy_from_slice(&FORMAT.to_le_bytes());
    let version = env!("CARGO_PKG_VERSION").bytes();
    header[VERSION_AT..CHECK_AT].iter_mut().zip(version).for_each(|(byte, letter)| *byte = letter);
    let checksum = crc32fast::hash(&header[..CHECK_AT]);
    header[CHECK_AT..].copy_from_slice(&checksum.to_le_bytes());
    header
}

/// Appends a chunk, the first being number 0. Its content is what `write` appends.
pub fn put_chunk(kind: Kind, number: usize, out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) -> Result<u32> {
    let at = out.len();
    out.push(kind as u8);
    out.extend_from_slice(&[0; 4]);
    write(out);
    let length = u32::try_from(out.len() - at - HEAD)
        .map_err(|_| Error::Capacity("a frame of a recording takes at most 4 GiB"))?;
    out[at + 1..at + HEAD].copy_from_slice(&length.to_le_bytes());
    let checksum = checksum(number, &out[at..]);
    out.extend_from_slice(&checksum.to_le_bytes());
    Ok(length)
}

/// Appends the index of these chunks, which begins at byte `at`, and the end.
pub fn put_end(chunks: &[(Kind, u32)], at: u64, out: &mut Vec<u8>) -> Result<()> {
    put_chunk(Kind::Index, chunks.len(), out, |out| {
        for (kind, length) in chunks {
            out.push(*kind as u8);
            out.extend_from_slice(&length.to_le_bytes());
        }
    })?;
    out.extend_from_slice(&at.to_le_bytes());
    out.extend_from_slice(&END);
    Ok(())
}

/// Of a chunk's head and content, and of its number: no chunk can take the place of another.
fn checksum(number: usize, bytes: &[u8]) -> u32 {
    let mut hasher = crc32fast::Hasher::new();
    hasher.update(&(number as u64).to_le_bytes());
    hasher.update(bytes);
    hasher.finalize()
}

fn refuse<T>(why: String) -> Result<T> {
    Err(Error::Recording(why))
}

fn number_at<const N: usize>(bytes: &[u8], at: usize) -> Option<[u8; N]> {
    bytes.get(at..)?.first_chunk().copied()
}

/// The chunk whose head is at a byte, if it is whole and undamaged.
fn chunk_at(bytes: &[u8], at: usize, number: usize) -> std::result::Result<Chunk, String> {
    let Some([kind, length @ ..]) = number_at::<HEAD>(bytes, at) else { return Err("it goes beyond the end".into()) };
    let length = u32::from_le_bytes(length);
    let end = (at + HEAD).checked_add(length as usize);
    let stated = end.and_then(|end| Some((end, u32::from_le_bytes(number_at(bytes, end)?))));
    let Some((end, stated)) = stated else {
        return Err(format!("its length is {length} bytes, which goes beyond the end"));
    };
    let checksum = checksum(number, &bytes[at..end]);
    if checksum != stated {
        return Err(format!("its checksum is {checksum:08x}; must be {stated:08x}, as its end says"));
    }
    let kind = Kind::from_number(kind).ok_or_else(|| format!("its kind is {kind}; must be from 0 to 3"))?;
    Ok(Chunk { kind, at, length })
}

/// Checks a recording as a whole, and gives its chunks.
pub fn open(bytes: &[u8]) -> Result<Vec<Chunk>> {
    let length = bytes.len();
    if !bytes.starts_with(&MAGIC[..MAGIC.len().min(length)]) || length == 0 {
        return refuse(format!("it begins with {:02x?}; must be {MAGIC:02x?}", &bytes[..length.min(MAGIC.len())]));
    }
    let Some(header) = bytes.get(..HEADER) else {
        return refuse(format!("it is cut short in its header, at byte {length}"));
    };
    let [format, stated] =
        [FORMAT_AT, CHECK_AT].map(|at| u32::from_le_bytes(number_at(header, at).unwrap_or_default()));
    let checksum = crc32fast::hash(&header[..CHECK_AT]);
    if checksum != stated {
        return refuse(format!(
            "the checksum of its header is {checksum:08x}; must be {stated:08x}, as byte {CHECK_AT} says"
        ));
    }
    if format != FORMAT {
        let version = String::from_utf8_lossy(&header[VERSION_AT..CHECK_AT]);
        let version = version.trim_end_matches('\0');
        return refuse(format!("its format is {format}, written by version {version}; must be {FORMAT}"));
    }
    let Some(trailer) = length.checked_sub(TRAILER).filter(|at| *at >= HEADER && bytes[at + 8..] == END) else {
        return Err(cut_short(bytes));
    };
    let index_at = u64::from_le_bytes(number_at(bytes, trailer).unwrap_or_default());
    let mut chunks = Vec::new();
    let mut at = HEADER;
    let (mut frames, mut found) = (0, false);
    while at < trailer && !found {
        let what = if at as u64 == index_at { "the index".into() } else { name(bytes[at], frames) };
        let chunk = match chunk_at(&bytes[..trailer], at, chunks.len()) {
            Ok(chunk) => chunk,
            Err(why) => return refuse(format!("{what} at byte {at}: {why}")),
        };
        let is_frame = matches!(chunk.kind, Kind::Key | Kind::Change);
        let last = chunks.last().map(|chunk: &Chunk| chunk.kind);
        let needs = match (chunk.kind, last) {
            (Kind::Change, None | Some(Kind::Structure)) => Some("needs a frame before it"),
            (Kind::Key, None) => Some("needs a structure before it"),
            _ if is_frame && chunk.length < 8 => Some("is too short for its time"),
            _ => None,
        };
        if let Some(needs) = needs {
            return refuse(format!("{what} at byte {at}: {needs}"));
        }
        found = chunk.kind == Kind::Index;
        frames += usize::from(is_frame);
        at = chunk.end();
        chunks.push(chunk);
    }
    let Some(index) = chunks.pop().filter(|_| found) else {
        return refuse(format!("the index is missing before byte {trailer}"));
    };
    if index.at as u64 != index_at || at != trailer {
        return refuse(format!(
            "the index is from byte {} to {at}; must be from {index_at} to {trailer}, as the end says",
            index.at
        ));
    }
    let entries = index.content(bytes).chunks(ENTRY);
    let same =
        |(chunk, entry): (&Chunk, &[u8])| entry[0] == chunk.kind as u8 && entry[1..] == chunk.length.to_le_bytes();
    if index.length as usize != ENTRY * chunks.len() || !chunks.iter().zip(entries).all(same) {
        return refuse(format!("the index at byte {} lists other frames than there are", index.at));
    }
    Ok(chunks)
}

fn name(kind: u8, frames: usize) -> String {
    match Kind::from_number(kind) {
        Some(Kind::Structure) => format!("the structure before frame {frames}"),
        _ => format!("frame {frames}"),
    }
}

/// Says how far a recording without an end is whole.
fn cut_short(bytes: &[u8]) -> Error {
    let (mut at, mut number, mut frames) = (HEADER, 0, 0);
    while let Ok(chunk) = chunk_at(bytes, at, number) {
        frames += usize::from(matches!(chunk.kind, Kind::Key | Kind::Change));
        (at, number) = (chunk.end(), number + 1);
    }
    Error::Recording(format!(
        "its end is missing: it was cut short, altered or never finished; {frames} frames are whole, up to byte {at} of {}",
        bytes.len()
    ))
}
