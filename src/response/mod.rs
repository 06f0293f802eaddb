//! Response: how contacts and springs move links.

pub mod bundle;
pub mod conjugate;
pub mod coupled;
pub mod envelope;
pub mod explicit;
pub mod group;
pub mod grouping;
pub mod implicit;
pub mod joined;
pub mod mirror;
pub mod sharing;
pub mod springs;
pub mod substep;
pub mod substepped;

/// How contact forces act on the links in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Response {
    /// The library chooses for each island: [`Response::Implicit`] for what is constrained, held by its host, stacked,
    /// or on stiff springs, [`Response::Substepped`] for the rest.
    #[default]
    Auto,
    /// One force evaluation a step, at the pose of its beginning; overloads are left to [`Response::Implicit`].
    Explicit,
    /// Velocities and forces that agree at the end of the step: stable at any stiffness, and never bouncing.
    Implicit,
    /// Many small steps inside each step; host-driven links through a persistent mirror. Overloads, and what asks for
    /// more than the world's `max_substeps`, are left to [`Response::Implicit`].
    Substepped,
}

/// In which moment of a tick a host's velocities live.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum VelocityConvention {
    /// Semi-implicit Euler, as Bullet: `v += a dt`, then `x += v dt`. Velocities lag half a tick behind positions.
    #[default]
    Leapfrog,
    /// Velocities belong to the same moment as the positions: `x += v dt + a dt²/2`, then `v += a dt`.
    Synchronous,
}
