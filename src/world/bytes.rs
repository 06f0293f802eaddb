//! State as bytes: little endian, numbers bit for bit, each type field by field in the order of its list.
//!
//! A list names every field of its type, or the build fails: nobody adds a field without deciding whether it lasts.

use nalgebra::{Quaternion, SMatrix};

use crate::error::{Error, Result};
use crate::math::Quat;

/// Receives bytes.
pub trait Sink {
    /// Appends some.
    fn put(&mut self, bytes: &[u8]);
}

/// Counts bytes.
#[derive(Default)]
pub struct Counter(pub usize);

impl Sink for Counter {
    fn put(&mut self, bytes: &[u8]) {
        self.0 += bytes.len();
    }
}

/// Fills a buffer, and counts what no longer fits.
pub struct Cursor<'a> {
    pub buffer: &'a mut [u8],
    pub at: usize,
}

impl Sink for Cursor<'_> {
    fn put(&mut self, bytes: &[u8]) {
        let end = self.at + bytes.len();
        if let Some(room) = self.buffer.get_mut(self.at..end) {
            room.copy_from_slice(bytes);
        }
        self.at = end;
    }
}

/// Takes bytes apart, and says where they make no sense.
pub struct Reader<'a> {
    bytes: &'a [u8],
    at: usize,
    field: &'static str,
}

impl<'a> Reader<'a> {
    /// Reads from offset `at` up to the end of `bytes`.
    pub fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at, field: "" }
    }

    /// Bytes that have not been read.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// How many of `count` values to make room for at once. A count that lies runs into the end of the bytes, not of
    /// the memory.
    pub fn room_for<T>(&self, count: u32) -> usize {
        (count as usize).min(self.left() / size_of::<T>().max(1))
    }

    /// Reads a value that messages call `field`.
    pub fn read<T: Lasting>(&mut self, field: &'static str) -> Result<T> {
        self.field = field;
        T::read(self)
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N]> {
        let Some((taken, _)) = self.bytes[self.at..].split_first_chunk() else {
            return Err(Error::Snapshot(format!("{} at byte {} goes beyond the end", self.field, self.at)));
        };
        self.at += N;
        Ok(*taken)
    }

    /// Refuses the value that was read last.
    pub fn refuse<T>(&self, value: impl std::fmt::Display, range: &str) -> Result<T> {
        Err(Error::Snapshot(format!("{} before byte {} is {value}; must be {range}", self.field, self.at)))
    }
}

/// What can be written and read again.
pub trait Lasting: Sized {
    /// Appends the value.
    fn write(&self, out: &mut impl Sink);
    /// Takes the next bytes for a value. Ranges are checked later, against the rest of the state.
    fn read(from: &mut Reader) -> Result<Self>;
}

macro_rules! numbers {
    ($($number:ty),*) => {$(
        impl Lasting for $number {
            fn write(&self, out: &mut impl Sink) {
                out.put(&self.to_le_bytes());
            }
            fn read(from: &mut Reader) -> Result<Self> {
                Ok(Self::from_le_bytes(from.take()?))
            }
        }
    )*};
}
numbers!(u8, u16, u32, u64, f64);

impl Lasting for bool {
    fn write(&self, out: &mut impl Sink) {
        u8::from(*self).write(out);
    }
    fn read(from: &mut Reader) -> Result<Self> {
        match u8::read(from)? {
            0 => Ok(false),
            1 => Ok(true),
            other => from.refuse(other, "0 or 1"),
        }
    }
}

impl Lasting for usize {
    fn write(&self, out: &mut impl Sink) {
        (*self as u64).write(out);
    }
    fn read(from: &mut Reader) -> Result<Self> {
        let value = u64::read(from)?;
        Self::try_from(value).or_else(|_| from.refuse(value, "a number of this machine's word size"))
    }
}

impl<const R: usize, const C: usize> Lasting for SMatrix<f64, R, C> {
    fn write(&self, out: &mut impl Sink) {
        self.iter().for_each(|x| x.write(out));
    }
    fn read(from: &mut Reader) -> Result<Self> {
        let mut matrix = Self::zeros();
        for x in matrix.iter_mut() {
            *x = f64::read(from)?;
        }
        Ok(matrix)
    }
}

impl Lasting for Quat {
    fn write(&self, out: &mut impl Sink) {
        self.coords.write(out);
    }
    fn read(from: &mut Reader) -> Result<Self> {
        Ok(Quat::new_unchecked(Quaternion { coords: Lasting::read(from)? }))
    }
}

impl<T: Lasting> Lasting for Box<T> {
    fn write(&self, out: &mut impl Sink) {
        (**self).write(out);
    }
    fn read(from: &mut Reader) -> Result<Self> {
        Ok(Box::new(T::read(from)?))
    }
}

impl<T: Lasting> Lasting for Option<T> {
    fn write(&self, out: &mut impl Sink) {
        self.is_some().write(out);
        if let Some(value) = self {
            value.write(out);
        }
    }
    fn read(from: &mut Reader) -> Result<Self> {
        Ok(if bool::read(from)? { Some(T::read(from)?) } else { None })
    }
}

impl<T: Lasting, const N: usize> Lasting for [T; N]
where
    [T; N]: Default,
{
    fn write(&self, out: &mut impl Sink) {
        self.iter().for_each(|value| value.write(out));
    }
    fn read(from: &mut Reader) -> Result<Self> {
        let mut array = Self::default();
        for value in &mut array {
            *value = T::read(from)?;
        }
        Ok(array)
    }
}

impl<T: Lasting> Lasting for Vec<T> {
    fn write(&self, out: &mut impl Sink) {
        write_list(self.len(), self.iter(), out);
    }
    fn read(from: &mut Reader) -> Result<Self> {
        let count = u32::read(from)?;
        let mut list = Vec::with_capacity(from.room_for::<T>(count));
        for _ in 0..count {
            list.push(T::read(from)?);
        }
        Ok(list)
    }
}

/// Writes what is read as a `Vec`.
pub fn write_list<'a, T: Lasting + 'a>(count: usize, list: impl Iterator<Item = &'a T>, out: &mut impl Sink) {
    // Slots are counted in 32 bits, so nothing here is longer.
    (count as u32).write(out);
    list.for_each(|value| value.write(out));
}

/// Structs, by lists of all their fields; those after a `;` do not last, and begin with the value given here.
macro_rules! structs {
    ($($name:ident { $($field:ident),* $(,)? $(; $($new:ident: $value:expr),*)? })*) => {$(
        impl Lasting for $name {
            fn write(&self, out: &mut impl Sink) {
                let $name { $($field,)* $($($new: _,)*)? } = self;
                $($field.write(out);)*
            }
            fn read(from: &mut Reader) -> Result<Self> {
                Ok($name { $($field: from.read(stringify!($field))?,)* $($($new: $value,)*)? })
            }
        }
    )*};
}

/// Enums without fields, by lists of all their variants with their numbers.
macro_rules! enums {
    ($($name:ident { $($variant:ident = $number:literal),* $(,)? } $range:literal)*) => {$(
        impl Lasting for $name {
            fn write(&self, out: &mut impl Sink) {
                let number: u8 = match self {
                    $($name::$variant => $number,)*
                };
                number.write(out);
            }
            fn read(from: &mut Reader) -> Result<Self> {
                match u8::read(from)? {
                    $($number => Ok($name::$variant),)*
                    other => from.refuse(other, $range),
                }
            }
        }
    )*};
}

pub(super) use {enums, structs};
