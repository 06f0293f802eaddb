//! The base structure: links, who moves them, and how.

pub mod link;
pub mod motion;

pub use link::Kind;
pub use motion::{Inertia, Motion};
