//! Springs: their life, their state between steps, and how they come into one.

use super::{Body, BodyId, Link, LinkDesc, LinkId, SpringDesc, SpringId, World};
use crate::base::springs::{self, Law};
use crate::base::{Kind, Motion};
use crate::error::{Error, Result, out_of_range};
use crate::handle::Noun;
use crate::math::Vec3;

/// A spring as the world keeps it.
pub struct Spring {
    pub(crate) desc: SpringDesc,
}

impl Noun for Spring {
    const NAME: &'static str = "spring";
}

/// What a spring does at the present poses and velocities of its links.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpringState {
    /// Distance of its ends \[m\].
    pub length: f64,
    /// How fast that grows \[m/s\].
    pub rate: f64,
    /// Pull on its ends, damping included; negative when it pushes them apart \[N\].
    pub tension: f64,
    /// Elastic energy \[J\].
    pub energy: f64,
}

/// Springs.
impl World {
    /// Creates a spring between two links of one body.
    pub fn create_spring(&mut self, desc: SpringDesc) -> Result<SpringId> {
        let body = self.check_spring(&desc)?;
        let id = self.add_spring(body, desc)?;
        self.refresh(body.index());
        Ok(id)
    }

    /// Creates many springs: all of them, or none if one is refused.
    pub fn create_springs(&mut self, descs: &[SpringDesc]) -> Result<Vec<SpringId>> {
        let bodies = descs.iter().map(|desc| self.check_spring(desc)).collect::<Result<Vec<_>>>()?;
        let mut made = Vec::with_capacity(descs.len());
        for (desc, body) in descs.iter().zip(&bodies) {
            match self.add_spring(*body, desc.clone()) {
                Ok(id) => made.push(id),
                Err(error) => {
                    made.into_iter().try_for_each(|id| self.destroy_spring(id))?;
                    return Err(error);
                }
            }
        }
        let mut last = None;
        for body in bodies {
            if last.replace(body) != Some(body) {
                self.refresh(body.index());
            }
        }
        Ok(made)
    }

    fn add_spring(&mut self, body: BodyId, desc: SpringDesc) -> Result<SpringId> {
        let id = self.springs.insert(Spring { desc })?;
        self.bodies.get_mut(body)?.springs.push(id.raw.index);
        Ok(id)
    }

    /// Checks a descriptor against the links that it names, and gives their body.
    pub(crate) fn check_spring(&self, desc: &SpringDesc) -> Result<BodyId> {
        desc.validate()?;
        let [a, b] = [self.links.get(desc.links[0])?, self.links.get(desc.links[1])?];
        if a.body != b.body {
            return Err(Error::Unsupported("a spring joins links of one body"));
        }
        if desc.links[0] == desc.links[1] {
            return Err(Error::Unsupported("a spring joins two links, not one with itself"));
        }
        for (link, point) in [a, b].into_iter().zip(&desc.points) {
            check_end(link.desc.kind, point)?;
        }
        Ok(self.bodies.id_of(a.body as usize))
    }

    /// Checks the springs of a link for when it becomes another kind.
    pub(super) fn check_ends(&self, id: LinkId, desc: &LinkDesc) -> Result<()> {
        let body = &self.bodies[self.links.get(id)?.body as usize];
        for spring in &body.springs {
            let SpringDesc { links, points, .. } = &self.springs[*spring as usize].desc;
            for (_, point) in links.iter().zip(points).filter(|(link, _)| **link == id) {
                check_end(desc.kind, point)?;
            }
        }
        Ok(())
    }

    /// Destroys a spring.
    pub fn destroy_spring(&mut self, id: SpringId) -> Result<()> {
        let spring = self.springs.remove(id)?;
        let body = self.links.get(spring.desc.links[0])?.body as usize;
        self.bodies[body].springs.retain(|index| *index != id.raw.index);
        self.refresh(body);
        Ok(())
    }

    /// Takes the springs of a link off its body.
    pub(super) fn drop_springs_of(&mut self, link: LinkId) -> Result<()> {
        let body = self.links.get(link)?.body as usize;
        let springs = &mut self.springs;
        let holds = |index: &mut u32| springs[*index as usize].desc.links.contains(&link);
        let gone: Vec<u32> = self.bodies[body].springs.extract_if(.., holds).collect();
        gone.into_iter().try_for_each(|index| self.springs.remove(self.springs.id_of(index as usize)).map(drop))
    }

    /// The springs of a body, in the order of their creation.
    pub fn body_springs(&self, id: BodyId) -> Result<impl Iterator<Item = SpringId> + '_> {
        Ok(self.bodies.get(id)?.springs.iter().map(|index| self.springs.id_of(*index as usize)))
    }

    /// The descriptor of a spring.
    pub fn spring_desc(&self, id: SpringId) -> Result<&SpringDesc> {
        Ok(&self.springs.get(id)?.desc)
    }

    /// Changes a spring. It stays with its body.
    pub fn set_spring_desc(&mut self, id: SpringId, desc: SpringDesc) -> Result<()> {
        let before = self.links.get(self.springs.get(id)?.desc.links[0])?.body;
        let body = self.check_spring(&desc)?;
        if body.raw.index != before {
            return Err(Error::Unsupported("a spring stays with its body: destroy it, and create one of the other"));
        }
        self.springs.get_mut(id)?.desc = desc;
        self.refresh(body.index());
        Ok(())
    }

    /// Length, tension and energy of a spring at the present poses and velocities of its links.
    pub fn spring_state(&self, id: SpringId) -> Result<SpringState> {
        let desc = &self.springs.get(id)?.desc;
        let [a, b] = [self.links.get(desc.links[0])?, self.links.get(desc.links[1])?];
        let motions = [self.motion_of(a), self.motion_of(b)];
        let line = placed(desc, [0, 1], [a, b]).line(&motions);
        let (length, rate, law) = (line.length(), line.rate(), law_of(desc));
        let tension = law.tension(length - law.rest_length, rate);
        Ok(SpringState { length, rate, tension, energy: law.energy(length) })
    }

    /// The springs of a body that take part in a step: those between links that do.
    pub(super) fn gather_springs(&self, body: &Body, motions: &[Motion], out: &mut Vec<springs::Spring>) {
        for spring in &body.springs {
            let desc = &self.springs[*spring as usize].desc;
            let slots = desc.links.map(|link| link.raw.index);
            let links = slots.map(|slot| &self.links[slot as usize]);
            let moves = slots.iter().any(|slot| motions[*slot as usize].is_movable());
            if moves && links.iter().all(|link| link.enabled) {
                out.push(placed(desc, slots, links));
            }
        }
    }
}

fn law_of(desc: &SpringDesc) -> Law {
    Law { rest_length: desc.rest_length, stiffness: desc.stiffness, damping: desc.damping }
}

fn placed(desc: &SpringDesc, slots: [u32; 2], links: [&Link; 2]) -> springs::Spring {
    let end = |side: usize| desc.points[side] - links[side].desc.local_center;
    springs::Spring { links: slots, ends: [end(0), end(1)], law: law_of(desc) }
}

/// A point mass does not turn, so a spring off its centre would leave a torque that nothing takes.
fn check_end(kind: Kind, point: &Vec3) -> Result<()> {
    if kind != Kind::PointMass || *point == Vec3::zeros() {
        return Ok(());
    }
    Err(out_of_range(
        "point of a spring on a point mass",
        format_args!("({}, {}, {})", point.x, point.y, point.z),
        "the origin of its frame",
    ))
}
