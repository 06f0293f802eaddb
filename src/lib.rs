//! Soft coats for rigid things.
//!
//! Each body is a base structure of links with an implicit coat: skeleton primitives emit fields whose isosurface is
//! the skin. Coats meet in contact surfaces of equal pressure, and their compression gives the forces.
//!
//! The layers, each importing only from those above it in this list:
//!
//! - [`math`], [`error`], [`handle`], [`team`], [`clock`]: vectors and poses, one error enum, ids of objects, work side
//!   by side;
//! - [`field`]: what skeletons emit, and how it adds up;
//! - [`base`]: the links that carry skeletons, and the springs between them;
//! - [`coat`]: the implicit layer of one body: seeds and territories;
//! - [`contact`]: where two coats meet, with what pressure, friction and dissipation;
//! - [`response`]: how the forces move links, and what the host is told;
//! - [`substance`]: bodies of particles that fall to pieces and fuse;
//! - [`surface`]: rays and closest points on a coat;
//! - [`world`]: the nouns, the step, the queries;
//! - [`capi`]: the same for C.

pub mod base;
pub mod capi;
pub mod clock;
pub mod coat;
pub mod contact;
pub mod error;
pub mod field;
pub mod handle;
pub mod math;
pub mod response;
pub mod substance;
pub mod surface;
pub mod team;
pub mod world;

pub use error::{Error, Result};
pub use team::Tasks;
pub use world::World;
