//! The base structure: links, who moves them and how, and the springs between them.

pub mod articulation;
pub mod link;
pub mod motion;
pub mod springs;

pub use articulation::Articulation;
pub use link::Kind;
pub use motion::{Inertia, Motion};
pub use springs::Spring;
