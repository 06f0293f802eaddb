//! What a step reports: contacts, events, counters, messages.

use super::desc::{BodyId, LinkId, Scheme, SkeletonId};
pub use crate::contact::tally::Tally;
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
    /// Force on b of pressure and dissipation; a has the opposite \[N\]. Friction is in the wrenches of links only.
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
    /// The load is past the most that this contact can carry. The push-out that parts the two then is a contact of its
    /// own, with an area, a peak pressure and a stiffness of 0 and an error estimate of 1.
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

/// Figures of the last step. The same step always gives the same, whoever worked at it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Live bodies.
    pub bodies: u32,
    /// Live links.
    pub links: u32,
    /// Live skeletons.
    pub skeletons: u32,
    /// Bodies asleep.
    pub asleep: u32,
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
    /// Patches at the end of the step, and push-outs: as many as there are contacts.
    pub patches: u32,
    /// Evaluations of a pair of fields, by all schemes. Contacts at rest need none: their surfaces stand from the last
    /// step.
    pub evaluations: u64,
    /// What each scheme did, in all rounds and sub-steps.
    pub by_scheme: Tally,
}

/// Where the time of the last step went, as long as [`WorldDesc::timed`](super::WorldDesc::timed) asks for it; zero
/// otherwise \[s\].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Times {
    /// The whole step.
    pub step: f64,
    /// Taking over states, forces and impulses.
    pub begin: f64,
    /// Broad phase: pairs whose bounds meet, with the filter; what of their coats can matter.
    pub pairs: f64,
    /// Groups of bodies that are stepped together.
    pub islands: f64,
    /// Particles of substances, and the volumes of their coats.
    pub substances: f64,
    /// Forces and motion: the response of every island.
    pub respond: f64,
    /// Of that, contact surfaces; added up over workers where islands are stepped side by side.
    pub contact: f64,
    /// Of that, what follows from the surfaces: systems, velocities, friction; added up likewise.
    pub solve: f64,
    /// Handing back poses and impulses, contacts and events; falling asleep.
    pub report: f64,
}

/// How much a message matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Worth knowing.
    Info,
    /// The scene cannot do what it seems to be meant to.
    Warning,
}
