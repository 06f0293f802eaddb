//! Soft coats for rigid things.
//!
//! The layers, each importing only from those above it in this list:
//!
//! - [`math`], [`error`]: vectors, poses, one error enum;
//! - [`field`]: what skeletons emit;
//! - [`base`]: the links that carry them;
//! - [`response`]: how forces move links;
//! - [`world`]: the nouns, the step, the queries.

pub mod base;
pub mod coat;
pub mod contact;
pub mod error;
pub mod field;
pub mod handle;
pub mod math;
pub mod response;
pub mod world;

pub use error::{Error, Result};
pub use world::World;
