//! The base structure: links, who moves them, and how.

pub mod link;

pub use link::Kind;
