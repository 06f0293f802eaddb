//! isocoat
pub mod error;
pub mod field;
pub mod math;
