//! Status codes, and the message behind the last one.

use std::cell::RefCell;

use libc::{c_char, size_t};

use crate::error::Error;

/// What a call came to: ISOCOAT_OK, or an ISOCOAT_ERROR_ code. Codes are never renumbered; new ones may come.
pub type isocoat_status = u32;

/// Done.
pub const ISOCOAT_OK: isocoat_status = 0;
/// A pointer is NULL that must not be, a struct_size or an enum value is unknown, a count or a stride makes no sense.
pub const ISOCOAT_ERROR_INVALID_ARGUMENT: isocoat_status = 1;
/// A handle is null, belongs to another world, or its object was destroyed.
pub const ISOCOAT_ERROR_INVALID_HANDLE: isocoat_status = 2;
/// A number is outside its range, or is not a number.
pub const ISOCOAT_ERROR_OUT_OF_RANGE: isocoat_status = 3;
/// The call makes no sense for this object, or this version of the library cannot do it.
pub const ISOCOAT_ERROR_UNSUPPORTED: isocoat_status = 4;
/// A limit of the library is reached.
pub const ISOCOAT_ERROR_CAPACITY: isocoat_status = 5;
/// The buffer is too small: the call has written the count it needs, and nothing else.
pub const ISOCOAT_ERROR_BUFFER_TOO_SMALL: isocoat_status = 6;
/// The world is being stepped or changed, or it is being read and the call would change it. Calls from the callbacks
/// of a step get this code too.
pub const ISOCOAT_ERROR_LOCKED: isocoat_status = 7;
/// An internal error has left the world in an unknown state: it can only be destroyed.
pub const ISOCOAT_ERROR_POISONED: isocoat_status = 8;
/// The bytes are not a snapshot that this library can restore: damaged, cut short, or of another format.
pub const ISOCOAT_ERROR_SNAPSHOT: isocoat_status = 9;
/// The bytes are not a recording that this library can play: damaged, cut short, or of another format.
pub const ISOCOAT_ERROR_RECORDING: isocoat_status = 10;
/// The stream of a recording took no more.
pub const ISOCOAT_ERROR_STREAM: isocoat_status = 11;

/// A refused call: its code and its message.
#[derive(Debug)]
pub(super) struct Refusal {
    pub status: isocoat_status,
    pub message: String,
}

/// What every call is inside the boundary.
pub(super) type Checked<T> = Result<T, Refusal>;

impl Refusal {
    pub fn new(status: isocoat_status, message: impl Into<String>) -> Self {
        Self { status, message: message.into() }
    }

    pub fn argument(message: impl Into<String>) -> Self {
        Self::new(ISOCOAT_ERROR_INVALID_ARGUMENT, message)
    }

    /// Says which element of an array was refused.
    pub fn at(mut self, array: &str, index: usize) -> Self {
        self.message = format!("{array}[{index}]: {}", self.message);
        self
    }
}

impl From<Error> for Refusal {
    fn from(error: Error) -> Self {
        let status = match &error {
            Error::InvalidHandle { .. } => ISOCOAT_ERROR_INVALID_HANDLE,
            Error::OutOfRange { .. } => ISOCOAT_ERROR_OUT_OF_RANGE,
            Error::Unsupported(_) => ISOCOAT_ERROR_UNSUPPORTED,
            Error::Capacity(_) => ISOCOAT_ERROR_CAPACITY,
            Error::Snapshot(_) => ISOCOAT_ERROR_SNAPSHOT,
            Error::Recording(_) => ISOCOAT_ERROR_RECORDING,
            Error::Stream(_) => ISOCOAT_ERROR_STREAM,
        };
        Self::new(status, error.to_string())
    }
}

thread_local! {
    static LAST_ERROR: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Keeps the message and gives the code.
pub(super) fn report(refusal: Refusal) -> isocoat_status {
    // A thread that is ending has no message any more; its code still tells.
    let _ = LAST_ERROR.try_with(|last| *last.borrow_mut() = refusal.message);
    refusal.status
}

/// The message of the last call on this thread that did not return ISOCOAT_OK: what was wrong, with the value and the
/// range. Calls that succeed leave it as it is.
///
/// - buffer: receives the message with a terminating zero, cut to fit; may be NULL when capacity is 0.
/// - capacity: bytes in buffer.
///
/// Returns the length of the whole message in bytes, without the terminating zero; 0 when no call has failed yet.
/// Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_last_error(buffer: *mut c_char, capacity: size_t) -> size_t {
    let copy = |last: &RefCell<String>| {
        let message = last.borrow();
        if !buffer.is_null() && capacity > 0 {
            let mut cut = message.len().min(capacity - 1);
            while !message.is_char_boundary(cut) {
                cut -= 1;
            }
            // SAFETY: the caller gives `capacity` bytes at `buffer`, and `cut < capacity`.
            unsafe {
                std::ptr::copy_nonoverlapping(message.as_ptr(), buffer.cast(), cut);
                *buffer.add(cut) = 0;
            }
        }
        message.len()
    };
    LAST_ERROR.try_with(copy).unwrap_or(0)
}

/// The name of a status, such as "ISOCOAT_ERROR_LOCKED"; "unknown status" for a number that is none.
///
/// Lifetime: static. Threads: any.
#[unsafe(no_mangle)]
pub extern "C" fn isocoat_status_name(status: isocoat_status) -> *const c_char {
    let name = match status {
        ISOCOAT_OK => c"ISOCOAT_OK",
        ISOCOAT_ERROR_INVALID_ARGUMENT => c"ISOCOAT_ERROR_INVALID_ARGUMENT",
        ISOCOAT_ERROR_INVALID_HANDLE => c"ISOCOAT_ERROR_INVALID_HANDLE",
        ISOCOAT_ERROR_OUT_OF_RANGE => c"ISOCOAT_ERROR_OUT_OF_RANGE",
        ISOCOAT_ERROR_UNSUPPORTED => c"ISOCOAT_ERROR_UNSUPPORTED",
        ISOCOAT_ERROR_CAPACITY => c"ISOCOAT_ERROR_CAPACITY",
        ISOCOAT_ERROR_BUFFER_TOO_SMALL => c"ISOCOAT_ERROR_BUFFER_TOO_SMALL",
        ISOCOAT_ERROR_LOCKED => c"ISOCOAT_ERROR_LOCKED",
        ISOCOAT_ERROR_POISONED => c"ISOCOAT_ERROR_POISONED",
        ISOCOAT_ERROR_SNAPSHOT => c"ISOCOAT_ERROR_SNAPSHOT",
        ISOCOAT_ERROR_RECORDING => c"ISOCOAT_ERROR_RECORDING",
        ISOCOAT_ERROR_STREAM => c"ISOCOAT_ERROR_STREAM",
        _ => c"unknown status",
    };
    name.as_ptr()
}
