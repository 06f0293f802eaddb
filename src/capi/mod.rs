//! The C API: what `include/isocoat/isocoat.h` is generated from.
//!
//! Mechanism and nouns are apart. Mechanism: [`status`] (codes, messages), [`version`], [`guard`] (panics, locks),
//! [`mod@pointer`] and [`descriptor`] (memory of the host), [`handle`], [`buffer`]. Nouns: [`world`], [`body`],
//! [`link`], [`articulation`], [`skeleton`], [`blend`], [`spring`], [`substance`], [`particle`], [`piece`], [`math`], and
//! what is done with them: [`motion`], [`bulk`], [`report`], [`snapshot`], [`recording`], [`query`], [`rays`], [`mesh`],
//! [`skin`], [`fit`], [`draw`], [`tasks`], [`volume`].
//!
//! Nothing here computes: every function checks the host's pointers, translates, calls the public Rust API, and
//! translates back. The comments are the manual that goes into the header.

// The names and the promises are those of C. What a pointer must be stands in the line of its parameter.
#![allow(non_camel_case_types, clippy::missing_safety_doc)]

pub mod articulation;
pub mod blend;
pub mod body;
pub mod buffer;
pub mod bulk;
pub mod descriptor;
pub mod draw;
pub mod fit;
pub mod guard;
pub mod handle;
pub mod link;
pub mod math;
pub mod mesh;
pub mod motion;
pub mod particle;
pub mod piece;
pub mod pointer;
pub mod query;
pub mod rays;
pub mod recording;
pub mod report;
pub mod skeleton;
pub mod skin;
pub mod snapshot;
pub mod spring;
pub mod status;
pub mod substance;
pub mod tasks;
pub mod version;
pub mod volume;
pub mod world;
