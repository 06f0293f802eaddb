//! Buffers of the host for bulk calls: strided, of either precision.

use libc::{c_void, size_t};

use super::status::{Checked, Refusal};
use super::world::unknown;

/// Number type of a buffer: an ISOCOAT_FORMAT_ value.
pub type isocoat_format = u32;
/// Numbers are double.
pub const ISOCOAT_FORMAT_F64: isocoat_format = 0;
/// Numbers are float, rounded to nearest.
pub const ISOCOAT_FORMAT_F32: isocoat_format = 1;

/// Where a bulk call writes: elements of 3 or 4 numbers in the host's own memory, such as a field of its own structs.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_buffer {
    /// First number of the first element; NULL when this result is not wanted.
    pub data: *mut c_void,
    /// Bytes from one element to the next: at least the size of an element, or 0 for elements without gaps.
    pub stride: size_t,
    /// Number type.
    pub format: isocoat_format,
}

/// Where a bulk call reads: elements of 3 numbers, or one, in the host's own memory.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_const_buffer {
    /// First number of the first element; NULL when there are none.
    pub data: *const c_void,
    /// Bytes from one element to the next: at least the size of an element, or 0 for elements without gaps.
    pub stride: size_t,
    /// Number type.
    pub format: isocoat_format,
}

/// A checked buffer for elements of `N` numbers.
#[derive(Clone, Copy)]
pub(super) struct Elements<const N: usize> {
    data: *mut u8,
    stride: usize,
    single: bool,
}

impl<const N: usize> Elements<N> {
    /// # Safety
    /// `buffer.data` is NULL, or the elements that will be put can be written there until the call returns.
    pub unsafe fn new(buffer: isocoat_buffer, name: &str) -> Checked<Self> {
        let (stride, single) = layout::<N>(buffer.stride, buffer.format, name)?;
        Ok(Self { data: buffer.data.cast(), stride, single })
    }

    pub fn is_wanted(&self) -> bool {
        !self.data.is_null()
    }

    /// Writes element `index`, unless the buffer is not wanted.
    pub fn put(&self, index: usize, element: [f64; N]) {
        if self.data.is_null() {
            return;
        }
        // SAFETY: `new` was promised room for the element.
        unsafe {
            let at = self.data.add(index * self.stride);
            if self.single {
                at.cast::<[f32; N]>().write_unaligned(element.map(|number| number as f32));
            } else {
                at.cast::<[f64; N]>().write_unaligned(element);
            }
        }
    }
}

/// Bytes from one element of `N` numbers to the next, and whether the numbers are float.
fn layout<const N: usize>(stride: usize, format: isocoat_format, name: &str) -> Checked<(usize, bool)> {
    let single = match format {
        ISOCOAT_FORMAT_F64 => false,
        ISOCOAT_FORMAT_F32 => true,
        other => return Err(unknown(&format!("{name}.format"), other, "ISOCOAT_FORMAT_", 1)),
    };
    let element = N * if single { size_of::<f32>() } else { size_of::<f64>() };
    let stride = if stride == 0 { element } else { stride };
    if stride < element {
        let message = format!("{name}.stride is {stride}; must be 0 (no gaps) or at least {element}");
        return Err(Refusal::argument(message));
    }
    Ok((stride, single))
}

/// A checked buffer to read elements of `N` numbers from.
#[derive(Clone, Copy)]
pub(super) struct Source<const N: usize> {
    data: *const u8,
    stride: usize,
    single: bool,
    pub count: usize,
}

impl<const N: usize> Source<N> {
    /// # Safety
    /// `buffer.data` is NULL, or `count` elements can be read there until the call returns.
    pub unsafe fn new(buffer: isocoat_const_buffer, count: usize, name: &str) -> Checked<Self> {
        let (stride, single) = layout::<N>(buffer.stride, buffer.format, name)?;
        if count.checked_mul(stride).is_none_or(|bytes| bytes > isize::MAX as usize) {
            return Err(Refusal::argument(format!("the count of {name} is {count}: no memory is that large")));
        }
        Ok(Self { data: buffer.data.cast(), stride, single, count })
    }

    /// The same, which must not be NULL unless there are no elements.
    ///
    /// # Safety
    /// As for [`Source::new`].
    pub unsafe fn required(buffer: isocoat_const_buffer, count: usize, name: &str) -> Checked<Self> {
        // SAFETY: the caller's promise.
        let source = unsafe { Self::new(buffer, count, name) }?;
        if count > 0 && !source.is_given() {
            return Err(Refusal::argument(format!("{name}.data is NULL")));
        }
        Ok(source)
    }

    pub fn is_given(&self) -> bool {
        !self.data.is_null()
    }

    /// Element `index`, of a buffer that is given.
    pub fn get(&self, index: usize) -> [f64; N] {
        assert!(index < self.count && self.is_given(), "an element that is not there");
        // SAFETY: `new` was promised that the element can be read.
        unsafe {
            let at = self.data.add(index * self.stride);
            if self.single {
                at.cast::<[f32; N]>().read_unaligned().map(f64::from)
            } else {
                at.cast::<[f64; N]>().read_unaligned()
            }
        }
    }

    pub fn iter(self) -> impl Iterator<Item = [f64; N]> + Clone {
        (0..self.count).map(move |index| self.get(index))
    }
}
