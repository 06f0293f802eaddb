//! Structs that may grow: they begin with their size, so that older and newer hosts and libraries understand each
//! other. Fields are only ever added at the end.

use std::mem::MaybeUninit;
use std::ptr;

use super::status::{Checked, Refusal};

/// The largest size taken for a struct: a larger one is a size that was never set.
const LARGEST: usize = 1 << 16;

/// A struct that begins with `struct_size`.
///
/// # Safety
/// `repr(C)`, the first field is the `u32` size, and every bit pattern is a value.
pub(super) unsafe trait Descriptor: Copy {
    /// How C calls it.
    const NAME: &'static str;
    /// Size in the first release that had it: the end of the last field of that release.
    const FIRST_SIZE: usize;
    /// Every field at its default; `struct_size` does not matter.
    fn defaults() -> Self;
}

fn check_size<T: Descriptor>(size: usize) -> Checked<()> {
    if (T::FIRST_SIZE..=LARGEST).contains(&size) {
        return Ok(());
    }
    Err(Refusal::argument(format!(
        "struct_size of {name} is {size}; must be at least {first} and at most {LARGEST} (begin with {name}_default())",
        name = T::NAME,
        first = T::FIRST_SIZE,
    )))
}

/// Reads the size of a struct of the host.
///
/// # Safety
/// `pointer` is NULL or points to a struct that begins with its size.
unsafe fn size_at<T: Descriptor>(pointer: *const T, name: &str) -> Checked<usize> {
    // SAFETY: the size comes first.
    let size = unsafe { super::pointer::read(pointer.cast::<u32>(), name) }? as usize;
    check_size::<T>(size)?;
    Ok(size)
}

/// Fills a struct with defaults: at most `size` bytes, and zeros beyond what this library knows.
///
/// # Safety
/// `pointer` is NULL or `size` bytes can be written there.
pub(super) unsafe fn init<T: Descriptor>(pointer: *mut T, size: usize, name: &str) -> Checked<()> {
    if pointer.is_null() {
        return Err(Refusal::argument(format!("{name} is NULL")));
    }
    check_size::<T>(size)?;
    // SAFETY: as the caller promises.
    unsafe { put(pointer, size, &T::defaults()) };
    Ok(())
}

/// Reads a struct: the fields that the host has, the defaults for those it lacks.
///
/// # Safety
/// `pointer` is NULL or points to a struct of the size that it says.
pub(super) unsafe fn read<T: Descriptor>(pointer: *const T, name: &str) -> Checked<T> {
    // SAFETY: the caller's promise.
    let size = unsafe { size_at(pointer, name) }?;
    for offset in size_of::<T>()..size {
        // SAFETY: within the size that the struct says.
        if unsafe { pointer.cast::<u8>().add(offset).read() } != 0 {
            return Err(Refusal::argument(format!(
                "byte {offset} of {} is not 0, but this library ({}) knows only the first {}: the host was compiled \
                 with a newer header and sets a field that this library lacks",
                T::NAME,
                env!("CARGO_PKG_VERSION"),
                size_of::<T>(),
            )));
        }
    }
    let mut value = MaybeUninit::new(T::defaults());
    // SAFETY: both are at least that long; every bit pattern is a value, and padding stays padding.
    Ok(unsafe {
        ptr::copy_nonoverlapping(pointer.cast::<u8>(), value.as_mut_ptr().cast::<u8>(), size.min(size_of::<T>()));
        value.assume_init()
    })
}

/// Reads a row of structs, each of the size that the first one says.
///
/// # Safety
/// `first` is NULL or points to `count` structs in a row, of the size that they say.
pub(super) unsafe fn read_row<T: Descriptor>(first: *const T, count: usize, name: &str) -> Checked<Vec<T>> {
    if count == 0 {
        return Ok(Vec::new());
    }
    // SAFETY: the caller's promise.
    let size = unsafe { size_at(first, name) }?;
    if count.checked_mul(size).is_none_or(|bytes| bytes > isize::MAX as usize) {
        return Err(Refusal::argument(format!("the count of {name} is {count}: no memory is that large")));
    }
    let mut row = Vec::with_capacity(count);
    for index in 0..count {
        let at = first.wrapping_byte_add(index * size);
        // SAFETY: within the row.
        let own = unsafe { size_at(at, name) }.map_err(|refusal| refusal.at(name, index))?;
        if own != size {
            return Err(Refusal::argument(format!(
                "{name}[{index}].struct_size is {own}; must be {size}, as the first's"
            )));
        }
        // SAFETY: likewise, and of its size.
        row.push(unsafe { read(at, name) }.map_err(|refusal| refusal.at(name, index))?);
    }
    Ok(row)
}

/// Where a struct goes: its size is checked before the work.
pub(super) struct OutStruct<T> {
    pointer: *mut T,
    size: usize,
}

impl<T: Descriptor> OutStruct<T> {
    /// # Safety
    /// `pointer` is NULL or points to a writable struct of the size that it says, until the call returns.
    pub unsafe fn new(pointer: *mut T, name: &str) -> Checked<Self> {
        // SAFETY: the caller's promise.
        let size = unsafe { size_at(pointer.cast_const(), name) }?;
        Ok(Self { pointer, size })
    }

    pub fn put(self, value: &T) {
        // SAFETY: `size` bytes are writable, as promised to `new`.
        unsafe { put(self.pointer, self.size, value) }
    }
}

/// Where a row of structs goes, each of the size that the first one says.
pub(super) struct OutRow<T> {
    first: *mut T,
    size: usize,
}

impl<T: Descriptor> OutRow<T> {
    /// # Safety
    /// `first` is NULL, or `count` structs of the size that the first one says can be written there until the call
    /// returns.
    pub unsafe fn new(first: *mut T, count: usize, name: &str) -> Checked<Self> {
        // SAFETY: the caller's promise.
        let size = unsafe { size_at(first.cast_const(), name) }?;
        if count.checked_mul(size).is_none_or(|bytes| bytes > isize::MAX as usize) {
            return Err(Refusal::argument(format!("the count of {name} is {count}: no memory is that large")));
        }
        Ok(Self { first, size })
    }

    /// Writes the struct at `index`, which is below the count.
    pub fn put(&self, index: usize, value: &T) {
        // SAFETY: within the row, as promised to `new`.
        unsafe { put(self.first.wrapping_byte_add(index * self.size), self.size, value) }
    }
}

/// # Safety
/// `size` bytes can be written at `pointer`, and at least the size field fits.
unsafe fn put<T: Descriptor>(pointer: *mut T, size: usize, value: &T) {
    let bytes = pointer.cast::<u8>();
    // SAFETY: the two parts are within `size` and within `T`.
    unsafe {
        ptr::write_bytes(bytes, 0, size);
        ptr::copy_nonoverlapping(ptr::from_ref(value).cast::<u8>(), bytes, size.min(size_of::<T>()));
        pointer.cast::<u32>().write_unaligned(size as u32);
    }
}
