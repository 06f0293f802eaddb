//! Memory of the host: NULL checks that name the parameter, and access that asks nothing of alignment.

use libc::c_void;

use super::status::{Checked, ISOCOAT_ERROR_BUFFER_TOO_SMALL, Refusal};
use crate::math::Vec3;

fn not_null<T>(pointer: *const T, name: &str) -> Checked<()> {
    if pointer.is_null() { Err(Refusal::argument(format!("{name} is NULL"))) } else { Ok(()) }
}

/// Reads one value.
///
/// # Safety
/// `pointer` is NULL or points to a `T` of the host, for which every bit pattern is a value.
pub(super) unsafe fn read<T: Copy>(pointer: *const T, name: &str) -> Checked<T> {
    not_null(pointer, name)?;
    // SAFETY: not NULL, so readable.
    Ok(unsafe { pointer.read_unaligned() })
}

/// Reads three doubles.
///
/// # Safety
/// `pointer` is NULL or points to three doubles.
pub(super) unsafe fn read_vector(pointer: *const f64, name: &str) -> Checked<Vec3> {
    // SAFETY: the caller's promise.
    Ok(Vec3::from(unsafe { read(pointer.cast::<[f64; 3]>(), name) }?))
}

/// Where one result goes; checked before the work, written after.
pub(super) struct Out<T>(*mut T);

impl<T> Out<T> {
    /// # Safety
    /// `pointer` is NULL or writable until the call returns.
    pub unsafe fn new(pointer: *mut T, name: &str) -> Checked<Self> {
        not_null(pointer, name)?;
        Ok(Self(pointer))
    }

    pub fn put(self, value: T) {
        // SAFETY: not NULL, so writable, as promised to `new`.
        unsafe { self.0.write_unaligned(value) }
    }
}

/// An array that the host gives.
#[derive(Clone, Copy)]
pub(super) struct Array<T> {
    first: *const T,
    pub count: usize,
}

impl<T: Copy> Array<T> {
    /// # Safety
    /// `first` is NULL, or `count` elements can be read from there until the call returns, and every bit pattern is a
    /// value of `T`.
    pub unsafe fn new(first: *const T, count: usize, name: &str) -> Checked<Self> {
        if count > 0 {
            not_null(first, name)?;
        }
        check_count::<T>(count, name)?;
        Ok(Self { first, count })
    }

    pub fn iter(self) -> impl Iterator<Item = T> {
        // SAFETY: `index` is below the count that was promised to `new`.
        (0..self.count).map(move |index| unsafe { self.first.add(index).read_unaligned() })
    }
}

/// An array that is used in place, so that it must be aligned.
///
/// # Safety
/// `first` is NULL, or `count` elements can be read from there until the call returns, nobody changes them, and every
/// bit pattern is a value of `T`.
pub(super) unsafe fn slice<'a, T>(first: *const T, count: usize, name: &str) -> Checked<&'a [T]> {
    Ok(match in_place(first, count, name)? {
        // SAFETY: checked for NULL, size and alignment; the rest is the caller's promise.
        true => unsafe { std::slice::from_raw_parts(first, count) },
        false => &[],
    })
}

/// An array that is written in place, so that it must be aligned; `None` if it is NULL.
///
/// # Safety
/// `first` is NULL, or `count` elements can be written there until the call returns, nobody else uses them, and every
/// bit pattern is a value of `T`.
pub(super) unsafe fn slice_mut<'a, T>(first: *mut T, count: usize, name: &str) -> Checked<Option<&'a mut [T]>> {
    if first.is_null() {
        return Ok(None);
    }
    Ok(Some(match in_place(first, count, name)? {
        // SAFETY: checked for NULL, size and alignment; the rest is the caller's promise.
        true => unsafe { std::slice::from_raw_parts_mut(first, count) },
        false => &mut [],
    }))
}

/// Whether there is anything at `first`.
fn in_place<T>(first: *const T, count: usize, name: &str) -> Checked<bool> {
    if count == 0 {
        return Ok(false);
    }
    not_null(first, name)?;
    check_count::<T>(count, name)?;
    if first.is_aligned() {
        return Ok(true);
    }
    Err(Refusal::argument(format!("{name} is not aligned to {} bytes", align_of::<T>())))
}

/// Refuses arrays that share memory.
pub(super) fn disjoint(arrays: [(&str, *const f64, usize); 3]) -> Checked<()> {
    let end = |(_, first, count): &(&str, *const f64, usize)| first.wrapping_add(*count);
    for (index, a) in arrays.iter().enumerate() {
        for b in &arrays[index + 1..] {
            if !a.1.is_null() && !b.1.is_null() && a.1 < end(b) && b.1 < end(a) {
                return Err(Refusal::argument(format!("{} and {} overlap", a.0, b.0)));
            }
        }
    }
    Ok(())
}

fn check_count<T>(count: usize, name: &str) -> Checked<()> {
    if count.checked_mul(size_of::<T>()).is_some_and(|bytes| bytes <= isize::MAX as usize) {
        return Ok(());
    }
    Err(Refusal::argument(format!("the count of {name} is {count}: no memory is that large")))
}

/// A row of results, which the host may not want.
pub(super) struct Row<T>(*mut T);

impl<T> Row<T> {
    /// # Safety
    /// `first` is NULL, or the elements that will be put can be written there until the call returns.
    pub unsafe fn new(first: *mut T) -> Self {
        Self(first)
    }

    pub fn is_wanted(&self) -> bool {
        !self.0.is_null()
    }

    /// Writes element `index`, unless the row is not wanted.
    pub fn put(&self, index: usize, element: T) {
        if self.is_wanted() {
            // SAFETY: `new` was promised room for the element.
            unsafe { self.0.add(index).write_unaligned(element) }
        }
    }
}

/// A buffer for a number of results that the host may ask for first.
pub(super) struct List<T> {
    first: *mut T,
    capacity: usize,
    count: Count,
}

impl<T> List<T> {
    /// # Safety
    /// `first` is NULL or `capacity` elements can be written there, `count` is NULL or writable, until the call
    /// returns.
    pub unsafe fn new(first: *mut T, capacity: usize, name: &str, count: *mut usize) -> Checked<Self> {
        if capacity > 0 {
            not_null(first, name)?;
        }
        // SAFETY: the caller's promise.
        let count = unsafe { Count::new(count, "count") }?;
        Ok(Self { first, capacity, count })
    }

    /// Writes the count, and the elements if they are wanted and fit.
    pub fn put(self, needed: usize, elements: impl Iterator<Item = T>) -> Checked<()> {
        self.count.put(needed, self.capacity, !self.first.is_null())?;
        if !self.first.is_null() {
            for (index, element) in elements.take(needed).enumerate() {
                // SAFETY: `index < needed <= capacity`, as promised to `new`.
                unsafe { self.first.add(index).write_unaligned(element) }
            }
        }
        Ok(())
    }
}

/// A buffer of bytes that are made in place, and whose size the host may ask for first.
pub(super) struct Bytes {
    first: *mut u8,
    capacity: usize,
    size: Count,
}

impl Bytes {
    /// # Safety
    /// `first` is NULL or `capacity` bytes can be written there, `size` is NULL or writable, until the call returns.
    pub unsafe fn new(first: *mut u8, capacity: usize, name: &str, size: *mut usize, size_name: &str) -> Checked<Self> {
        if capacity > 0 {
            not_null(first, name)?;
        }
        check_count::<u8>(capacity, name)?;
        // SAFETY: the caller's promise.
        let size = unsafe { Count::new(size, size_name) }?;
        Ok(Self { first, capacity, size })
    }

    /// Writes the size, and gives the bytes to be filled, if they are wanted and fit.
    pub fn claim<'a>(self, needed: usize) -> Checked<Option<&'a mut [u8]>> {
        self.size.put(needed, self.capacity, !self.first.is_null())?;
        // SAFETY: `needed <= capacity` bytes can be written at `first`, as promised to `new`.
        Ok((!self.first.is_null()).then(|| unsafe { std::slice::from_raw_parts_mut(self.first, needed) }))
    }
}

/// Where a count goes. It is written also when the buffers are too small, so that the host can make them larger.
pub(super) struct Count(*mut usize);

impl Count {
    /// # Safety
    /// `pointer` is NULL or writable until the call returns.
    pub unsafe fn new(pointer: *mut usize, name: &str) -> Checked<Self> {
        not_null(pointer, name)?;
        Ok(Self(pointer))
    }

    /// Writes the count; refuses if the elements are wanted and do not fit.
    pub fn put(self, needed: usize, capacity: usize, wanted: bool) -> Checked<()> {
        // SAFETY: not NULL, so writable, as promised to `new`.
        unsafe { self.0.write_unaligned(needed) };
        if wanted && needed > capacity {
            let message = format!("capacity is {capacity}; {needed} elements are to be written");
            return Err(Refusal::new(ISOCOAT_ERROR_BUFFER_TOO_SMALL, message));
        }
        Ok(())
    }
}

/// A pointer of the host that goes back to the host only.
#[derive(Clone, Copy)]
pub(super) struct Context(pub *mut c_void);

// SAFETY: never dereferenced here; the host is told on which threads its callbacks run.
unsafe impl Send for Context {}

impl Context {
    /// A method, so that closures capture the whole and stay `Send`.
    pub fn pointer(self) -> *mut c_void {
        self.0
    }
}
