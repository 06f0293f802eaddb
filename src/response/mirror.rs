//! The persistent mirror of a host-driven body.
//!
//! A host applies one impulse a tick, which cannot follow a stiff contact. So the library keeps a mirror of the body
//! that goes through the contact in small steps, and returns the impulse that puts the host at the mirror's end
//! position. The mirror's velocity is kept while the contact lasts and for one more tick, which hands both position and
//! velocity over exactly (docs/model.md, "Mirror").
//!
//! The host stays in charge: whatever deviates from what the last impulse commanded is the host's own push and is
//! added to the mirror; a jump is a teleport and makes it forget.

use nalgebra::Vector6;

use super::VelocityConvention;
use crate::base::{Inertia, Motion};
use crate::math::{Mat3, Quat, Twist, Vec3, Wrench, rotate_tensor, rotation_to_vector};

/// Turn of more than this between where a host body should be and where it is counts as a teleport \[rad\].
const TELEPORT_ANGLE: f64 = 0.5;

/// What is kept of a mirror between ticks.
#[derive(Clone, Copy, Debug, Default)]
pub struct Mirror {
    pub(crate) active: bool,
    /// Velocities at the end of the last tick.
    pub(crate) twist: Twist,
    /// Where the host should be now, and how fast, in its own convention.
    pub(crate) expected_center: Vec3,
    pub(crate) expected_rotation: Quat,
    pub(crate) expected_twist: Twist,
    /// Size of the change of velocity that the last impulse was to bring \[m/s\].
    pub(crate) commanded: f64,
    /// What the next impulse owes from when the mirror was last in use, as a change of velocity.
    pub(crate) owed: Twist,
    /// What joints and contacts of the host's own seem to do to it, as an acceleration; while it is held.
    pub(crate) estimate: Twist,
    /// Where the last impulse should have brought a held host's velocities; they are known.
    pub(crate) bypassed: Option<Twist>,
    /// Steps for which the host counts as held by something that the library does not know.
    pub(crate) doubt: u8,
}

/// Part of the commanded change of velocity by which a free host may be off.
const OFF: f64 = 0.25;

/// Part of the jump that counts as a teleport by which a free host may be off in a step: it rounds, or wakes up.
const NOTHING: f64 = 2e-3;

/// Part of what a held host was off that goes into the estimate of its other accelerations. Stable while the host's
/// effective mass is at most ten times the link's (docs/model.md, "Held hosts").
const LEARN: f64 = 0.1;

/// Steps of doubt after a host was off.
const DOUBT: u8 = 10;

/// What of the host matters to its mirror.
#[derive(Clone, Copy, Debug, Default)]
pub struct Host {
    /// Velocities as the host has them.
    pub twist: Twist,
    /// Which moment they belong to.
    pub convention: VelocityConvention,
    /// The host applies the gyroscopic torque itself.
    pub gyroscopic: bool,
    /// Jump that counts as a teleport \[m\].
    pub teleport: f64,
}

impl Mirror {
    /// Sets the velocities of a motion that stands where the host is. True when the host was moved elsewhere.
    pub fn enter(&mut self, host: &Host, motion: &mut Motion, dt: f64) -> bool {
        let jumped = (motion.center - self.expected_center).norm() > host.teleport
            || rotation_to_vector(&(motion.rotation * self.expected_rotation.inverse())).norm() > TELEPORT_ANGLE;
        let teleported = self.active && jumped;
        self.active &= !jumped;
        self.doubt = self.doubt.saturating_sub(1);
        motion.twist = if self.active {
            let off = Twist {
                linear: host.twist.linear - self.expected_twist.linear,
                angular: host.twist.angular - self.expected_twist.angular,
            };
            if off.linear.norm() > OFF * self.commanded + NOTHING * host.teleport / dt {
                self.doubt = DOUBT;
            }
            Twist { linear: self.twist.linear + off.linear, angular: self.twist.angular + off.angular }
        } else {
            // A leapfrog host's velocities are half a tick old.
            let age = match host.convention {
                VelocityConvention::Leapfrog => 0.5 * dt,
                VelocityConvention::Synchronous => 0.0,
            };
            Twist {
                linear: host.twist.linear + motion.acceleration * age,
                angular: host.twist.angular + motion.angular_acceleration * age,
            }
        };
        teleported
    }

    /// Takes the motion at the end of the tick, which began at `center`, `rotation`, and gives the impulse for the
    /// host. None is needed, and none given, without contact.
    pub fn leave(&mut self, host: &Host, motion: &Motion, center: &Vec3, rotation: &Quat, dt: f64) -> Wrench {
        if !motion.touched && !self.active {
            // What was expected after the last contact says nothing of a later one.
            self.bypassed = None;
            return Wrench::default();
        }
        let mean = Twist {
            linear: (motion.center - center) / dt,
            angular: rotation_to_vector(&(motion.rotation * rotation.inverse())) / dt,
        };
        // What the host adds by itself before it moves, and what it then shows as its velocity.
        let (before, after) = match host.convention {
            VelocityConvention::Leapfrog => (dt, 0.0),
            VelocityConvention::Synchronous => (0.5 * dt, 0.5 * dt),
        };
        let mut change = Twist {
            linear: mean.linear - host.twist.linear - motion.acceleration * before,
            angular: mean.angular - host.twist.angular - motion.angular_acceleration * before,
        };
        if host.gyroscopic
            && let Inertia::Solid { local, inverse_local, .. } = &motion.inertia
        {
            change.angular -= gyroscopic_change(rotation, local, inverse_local, &host.twist.angular, dt);
        }
        *self = Mirror {
            commanded: change.linear.norm(),
            doubt: self.doubt,
            active: motion.touched,
            twist: motion.twist,
            expected_center: motion.center,
            expected_rotation: motion.rotation,
            expected_twist: Twist {
                linear: mean.linear + motion.acceleration * after,
                angular: mean.angular + motion.angular_acceleration * after,
            },
            ..Mirror::default()
        };
        impulse_for(&motion.inertia, rotation, &change)
    }
}

/// Without the mirror: responses that end where the host's own velocities lead.
impl Mirror {
    /// Forgets what seems to hold the host, when it is told otherwise how the host answers pushes: an estimate is worth
    /// nothing with another inertia.
    pub fn forget_hold(&mut self) {
        self.estimate = Twist::default();
        self.bypassed = None;
        self.doubt = 0;
    }

    /// Whether the host did not do what an impulse was to bring: it is held, or pushed hard.
    pub fn is_doubtful(&self) -> bool {
        self.doubt > 0
    }

    /// Whether the library's own velocities stand in for the host's.
    pub fn is_active(&self) -> bool {
        self.active
    }

    /// What the host did by itself in the last tick, of this length, as an acceleration; none where that is not known.
    pub fn own_doing(&self, host: &Host, dt: f64) -> Twist {
        let known = self.bypassed.or(self.active.then_some(self.expected_twist));
        known.map_or_else(Twist::default, |expected| Twist {
            linear: (host.twist.linear - expected.linear) / dt + self.estimate.linear,
            angular: (host.twist.angular - expected.angular) / dt + self.estimate.angular,
        })
    }

    /// Goes on from the host's own velocities.
    pub fn let_go(&mut self) {
        self.active = false;
    }

    /// Sets the velocities of a motion that [`enter`](Self::enter) has prepared to those from which the host itself
    /// starts. Of a mirror in use the velocities are taken over; the host is told the difference. Of a `held` host, what
    /// holds it is estimated from how far it was off.
    pub fn bypass(&mut self, host: &Host, motion: &mut Motion, held: bool, dt: f64) {
        if let Some(expected) = self.bypassed.take().filter(|_| held) {
            self.estimate.linear += (host.twist.linear - expected.linear) * (LEARN / dt);
            self.estimate.angular += (host.twist.angular - expected.angular) * (LEARN / dt);
        }
        if !held {
            self.estimate = Twist::default();
        }
        if self.estimate.linear.norm() * dt > OFF * self.commanded {
            self.doubt = DOUBT;
        }
        // A synchronous host moves on with half of the acceleration only.
        let ahead = match host.convention {
            VelocityConvention::Leapfrog => 0.0,
            VelocityConvention::Synchronous => 0.5 * dt,
        };
        let start = Twist {
            linear: host.twist.linear - motion.acceleration * ahead,
            angular: host.twist.angular - motion.angular_acceleration * ahead,
        };
        // What substances did in this tick comes on top, and is handed over with all other contacts.
        let pushed = motion.answer(&motion.contact_impulse);
        let start = Twist { linear: start.linear + pushed.linear, angular: start.angular + pushed.angular };
        self.owed = Twist::default();
        if self.active {
            self.owed =
                Twist { linear: motion.twist.linear - start.linear, angular: motion.twist.angular - start.angular };
        } else {
            motion.twist = start;
        }
        self.active = false;
        motion.acceleration += self.estimate.linear;
        motion.angular_acceleration += self.estimate.angular;
    }

    /// Takes a bypassed motion at the end of the tick, and gives the impulse for the host.
    pub fn hand_over(&mut self, host: &Host, motion: &Motion, rotation: &Quat, dt: f64) -> Wrench {
        let rest = match host.convention {
            VelocityConvention::Leapfrog => 0.0,
            VelocityConvention::Synchronous => 0.5 * dt,
        };
        self.bypassed = Some(Twist {
            linear: motion.twist.linear + motion.acceleration * rest,
            angular: motion.twist.angular + motion.angular_acceleration * rest,
        });
        self.commanded = motion.answer(&motion.contact_impulse).linear.norm();
        let mut impulse = impulse_for(&motion.inertia, rotation, &self.owed);
        impulse.add_scaled(&motion.contact_impulse, 1.0);
        impulse
    }
}

/// Change of angular velocity by the gyroscopic torque over a tick, `-I⁻¹ (ω × I ω) dt`, at the start of the tick.
fn gyroscopic_change(rotation: &Quat, local: &Mat3, inverse_local: &Mat3, angular: &Vec3, dt: f64) -> Vec3 {
    let momentum = rotate_tensor(rotation, local) * angular;
    rotate_tensor(rotation, inverse_local) * momentum.cross(angular) * dt
}

/// The impulse that changes the velocities of a body of this inertia at this rotation.
fn impulse_for(inertia: &Inertia, rotation: &Quat, change: &Twist) -> Wrench {
    match inertia {
        Inertia::Immovable => Wrench::default(),
        Inertia::Point { inverse_mass } => Wrench { force: change.linear / *inverse_mass, torque: Vec3::zeros() },
        Inertia::Solid { inverse_mass, local, .. } => {
            Wrench { force: change.linear / *inverse_mass, torque: rotate_tensor(rotation, local) * change.angular }
        }
        Inertia::Effective(matrix) => {
            let (v, w) = (&change.linear, &change.angular);
            let impulse = matrix
                .cholesky()
                .map_or_else(Vector6::zeros, |factor| factor.solve(&Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z)));
            Wrench { force: impulse.fixed_rows::<3>(0).into_owned(), torque: impulse.fixed_rows::<3>(3).into_owned() }
        }
    }
}
