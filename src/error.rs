//! One error enum for the whole library. A call that returns an error has changed nothing.

/// What went wrong. The text names the value and the range that would have been accepted.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A handle is null, from another world, or its object was destroyed.
    #[error("{noun}: {reason}")]
    InvalidHandle {
        /// Which noun the handle stands for: "body", "link", …
        noun: &'static str,
        /// Null, foreign or stale.
        reason: &'static str,
    },
    /// A parameter is outside its range.
    #[error("{what} is {value}; must be {range}")]
    OutOfRange {
        /// The parameter, as the descriptor spells it.
        what: &'static str,
        /// The value that was given.
        value: String,
        /// The values that are accepted.
        range: &'static str,
    },
    /// The call makes no sense for this object, such as an impulse on a fixed link.
    #[error("{0}")]
    Unsupported(&'static str),
    /// A limit of the library is reached, such as the number of live handles.
    #[error("{0}")]
    Capacity(&'static str),
    /// Bytes are not a snapshot that this library can restore: damaged, cut short, or of another format.
    #[error("the snapshot is refused: {0}")]
    Snapshot(String),
    /// Bytes are not a recording that this library can play: damaged, cut short, or of another format.
    #[error("the recording is refused: {0}")]
    Recording(String),
    /// The stream of a recording took no more.
    #[error("the recording's stream failed {0}")]
    Stream(String),
}

/// Shorthand used throughout the library.
pub type Result<T> = std::result::Result<T, Error>;

/// Builds [`Error::OutOfRange`].
pub(crate) fn out_of_range(what: &'static str, value: impl std::fmt::Display, range: &'static str) -> Error {
    Error::OutOfRange { what, value: value.to_string(), range }
}

/// A number that takes few characters, however large or small it is: hosts have short buffers.
struct Short(f64);

impl std::fmt::Display for Short {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self(value) = self;
        let is_plain = *value == 0.0 || !value.is_finite() || (1e-5..1e16).contains(&value.abs());
        if is_plain { write!(f, "{value}") } else { write!(f, "{value:e}") }
    }
}

/// Accepts a finite number for which `ok` holds.
pub(crate) fn require(what: &'static str, value: f64, range: &'static str, ok: impl Fn(f64) -> bool) -> Result<()> {
    if value.is_finite() && ok(value) { Ok(()) } else { Err(out_of_range(what, Short(value), range)) }
}

/// Accepts a vector of finite numbers whose powers are finite too.
pub(crate) fn require_finite(what: &'static str, v: &crate::math::Vec3) -> Result<()> {
    if v.iter().all(|x| x.abs() <= 1e60) {
        Ok(())
    } else {
        let [x, y, z] = [v.x, v.y, v.z].map(Short);
        Err(out_of_range(what, format_args!("({x}, {y}, {z})"), "finite, at most 1e60"))
    }
}
