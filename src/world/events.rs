//! What a step reports: contacts, events, counters, messages.

use super::desc::{BodyId, LinkId, Scheme, SkeletonId};
use crate::math::Vec3;

/// One connected piece of contact surface between two coats.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Contact {
    /// The two bodies, a and b.
    pub bodies: [BodyId; 2],
    /// The links whose fields are the highest at the deepest point.
    pub links: [LinkId; 2],
    /// The skeletons whose territories hold the deepest point.
    pub skeletons: [SkeletonId; 2],
    /// Centre of pressure, in the world \[m\].
    pub position: Vec3,
    /// Mean normal, from a to b.
    pub normal: Vec3,
    /// Force on b; a has the opposite \[N\].
    pub force: Vec3,
    /// Torque on b about `position`; a has the opposite \[N m\].
    pub torque: Vec3,
    /// Area of the surface \[m²\].
    pub area: f64,
    /// Highest pressure \[Pa\].
    pub peak_pressure: f64,
    /// Normal stiffness: the integral of `g_a g_b / (g_a + g_b)` over the surface \[N/m\].
    pub stiffness: f64,
    /// Estimated relative error of the elastic force.
    pub error_estimate: f64,
    /// How often the two fields were evaluated.
    pub evaluations: u32,
    /// The scheme that integrated it.
    pub scheme: Scheme,
    /// The load is past the most that this contact can carry.
    pub overloaded: bool,
}

/// What happened to a pair of bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// The coats began to touch.
    Begin,
    /// The coats stopped touching.
    End,
    /// The contact went past the most it can carry: the push-out took over.
    Overload,
}

/// A change between two bodies in the last step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event {
    /// What happened.
    pub kind: EventKind,
    /// The two bodies; one may have been destroyed since.
    pub bodies: [BodyId; 2],
}

/// Figures of the last step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Live bodies.
    pub bodies: u32,
    /// Live links.
    pub links: u32,
    /// Live skeletons.
    pub skeletons: u32,
    /// Pairs of bodies whose bounds met.
    pub pairs: u32,
    /// Groups of bodies that were stepped together.
    pub islands: u32,
    /// Sub-steps of the island that took the most, of those not solved implicitly.
    pub substeps: u32,
    /// Rounds of the implicitly solved island that took the most, with those of all parts of a split step.
    pub implicit_rounds: u32,
    /// Splits of the implicitly solved island that took the most.
    pub implicit_splits: u32,
    /// Patches at the end of the step.
    pub patches: u32,
    /// Evaluations of a pair of fields.
    pub evaluations: u64,
}

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Worth knowing.
    Info,
    /// The scene cannot do what it seems to be meant to.
    Warning,
}
