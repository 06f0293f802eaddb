//! Motion of links between steps: states, forces and impulses of the host, what contacts did.

use super::{Link, LinkId, World, desc};
use crate::base::Kind;
use crate::error::{Error, Result, require_finite};
use crate::math::{Pose, Twist, Vec3, Wrench};
use crate::response::mirror::Mirror;

/// Position, orientation and velocity of a link.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LinkState {
    /// The link's frame in the world.
    pub pose: Pose,
    /// Velocity of its centre of mass, and its angular velocity, in the world.
    pub twist: Twist,
}

impl LinkState {
    /// Checks that all figures are finite and the rotation is one.
    pub fn validate(&self) -> Result<()> {
        desc::validate_pose(&self.pose)?;
        desc::validate_twist(&self.twist)
    }
}

impl World {
    /// Pose and twist of a link.
    pub fn link_state(&self, id: LinkId) -> Result<LinkState> {
        let desc = &self.links.get(id)?.desc;
        Ok(LinkState { pose: desc.pose, twist: desc.twist })
    }

    /// Sets pose and twist of a link: every tick for a host-driven one. What differs from what the last impulse
    /// commanded counts as the host's own push; a jump of more than half the thinnest coat counts as a teleport.
    pub fn set_link_state(&mut self, id: LinkId, state: &LinkState) -> Result<()> {
        state.validate()?;
        let link = self.links.get_mut(id)?;
        let before = LinkState { pose: link.desc.pose, twist: link.desc.twist };
        link.desc.pose = state.pose;
        link.desc.pose.rotation.renormalize();
        link.desc.twist = state.twist;
        let (body, movable) = (link.body, link.desc.kind != Kind::Fixed && link.desc.mass > 0.0);
        // Nobody sleeps leaning on what moves by itself.
        let leant_on = !movable || self.bodies[body as usize].is_asleep();
        if leant_on && before != (LinkState { pose: self.links[id.index()].desc.pose, ..*state }) {
            self.rouse(body);
        }
        Ok(())
    }

    /// Sets pose and twist of a link and forgets its contact history.
    pub fn teleport_link(&mut self, id: LinkId, state: &LinkState) -> Result<()> {
        self.set_link_state(id, state)?;
        let link = self.links.get_mut(id)?;
        link.mirror = Mirror::default();
        let body = link.body;
        self.rouse(body);
        self.stepping.forget_contacts_of(body);
        Ok(())
    }

    /// Says whether joints or contacts of its host's own act on a host-driven link in this tick.
    pub fn set_constrained(&mut self, id: LinkId, constrained: bool) -> Result<()> {
        self.links.get_mut(id)?.desc.constrained = constrained;
        Ok(())
    }

    /// Sets the accelerations of a link besides gravity and contact \[m/s², rad/s²\]: for hosts that say every tick what
    /// they will do.
    pub fn set_external_acceleration(&mut self, id: LinkId, linear: &Vec3, angular: &Vec3) -> Result<()> {
        require_finite("external_acceleration", linear)?;
        require_finite("external_angular_acceleration", angular)?;
        let Link { desc, body, .. } = self.links.get_mut(id)?;
        let (before, body) = ((desc.external_acceleration, desc.external_angular_acceleration), *body);
        (desc.external_acceleration, desc.external_angular_acceleration) = (*linear, *angular);
        if before != (*linear, *angular) {
            self.rouse(body);
        }
        Ok(())
    }

    /// Adds a force for the coming step, at a point of the world, or at the centre of mass.
    pub fn apply_force(&mut self, id: LinkId, force: &Vec3, point: Option<&Vec3>) -> Result<()> {
        let arm = self.check_push(id, "force", force, point)?;
        let link = self.links.get_mut(id)?;
        add_push("force", &mut link.applied_force, &Wrench { force: *force, torque: arm.cross(force) })
    }

    /// Adds a torque for the coming step.
    pub fn apply_torque(&mut self, id: LinkId, torque: &Vec3) -> Result<()> {
        self.check_push(id, "torque", torque, None)?;
        let link = self.links.get_mut(id)?;
        add_push("torque", &mut link.applied_force, &Wrench { force: Vec3::zeros(), torque: *torque })
    }

    /// Adds an impulse at the start of the coming step, at a point of the world, or at the centre of mass.
    pub fn apply_impulse(&mut self, id: LinkId, impulse: &Vec3, point: Option<&Vec3>) -> Result<()> {
        let arm = self.check_push(id, "impulse", impulse, point)?;
        let link = self.links.get_mut(id)?;
        add_push("impulse", &mut link.applied_impulse, &Wrench { force: *impulse, torque: arm.cross(impulse) })
    }

    /// Adds an angular impulse at the start of the coming step.
    pub fn apply_angular_impulse(&mut self, id: LinkId, impulse: &Vec3) -> Result<()> {
        self.check_push(id, "angular impulse", impulse, None)?;
        let link = self.links.get_mut(id)?;
        add_push("angular impulse", &mut link.applied_impulse, &Wrench { force: Vec3::zeros(), torque: *impulse })
    }

    /// Checks a push, wakes whom it is for, and gives its lever arm from the centre of mass.
    fn check_push(&mut self, id: LinkId, what: &'static str, push: &Vec3, point: Option<&Vec3>) -> Result<Vec3> {
        require_finite(what, push)?;
        let desc = &self.links.get(id)?.desc;
        if !matches!(desc.kind, Kind::PointMass | Kind::Rigid) {
            return Err(Error::Unsupported(
                "forces and impulses go on links that the library integrates: the host pushes its own bodies itself",
            ));
        }
        let arm = match point {
            Some(point) => {
                require_finite("point", point)?;
                point - desc.pose.transform_point(&desc.local_center)
            }
            None => Vec3::zeros(),
        };
        if *push != Vec3::zeros() {
            let body = self.links.get(id)?.body;
            self.rouse(body);
        }
        Ok(arm)
    }

    /// Mean force and torque of contacts and springs on a link over the last step, about its centre of mass.
    pub fn link_wrench(&self, id: LinkId) -> Result<Wrench> {
        let link = self.links.get(id)?;
        let mut wrench = Wrench::default();
        if link.last_dt > 0.0 {
            wrench.add_scaled(&link.contact_impulse, 1.0 / link.last_dt);
        }
        Ok(wrench)
    }

    /// The impulse and angular impulse that the host is to apply at the centre of mass of a host-driven link before it
    /// advances by the length of the last step.
    pub fn link_impulse(&self, id: LinkId) -> Result<Wrench> {
        Ok(self.links.get(id)?.host_impulse)
    }
}

/// Adds to what is to act in the coming step, as long as the sum is a number.
fn add_push(what: &'static str, sum: &mut Wrench, push: &Wrench) -> Result<()> {
    let mut total = *sum;
    total.add_scaled(push, 1.0);
    require_finite(what, &total.force)?;
    require_finite(what, &total.torque)?;
    *sum = total;
    Ok(())
}
