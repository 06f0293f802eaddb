//! Kinds of links.

/// Who moves a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Kind {
    /// Nobody: it stays where it is put.
    #[default]
    Fixed,
    /// The host sets pose and velocity every tick. With a mass, it receives impulses; without, it is kinematic.
    Host,
    /// The library: a mass that moves but does not turn.
    PointMass,
    /// The library: a rigid solid with an inertia tensor.
    Rigid,
}
