//! Response: how contact forces move links.

pub mod mirror;
