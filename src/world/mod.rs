//! The world: owns every body, link, skeleton and spring; one [`World::step`] advances it.
//!
//! This file holds the nouns and their life; [`step`] is the pipeline, [`query`] what can be asked in between.

pub use crate::handle as arena;
pub(crate) mod articulations;
pub mod attributes;
mod blend;
mod bytes;
mod candidates;
mod check;
mod deformed;
pub mod desc;
pub mod draw;
pub mod events;
pub mod fit;
mod gather;
mod islands;
pub mod mesh;
mod motion;
pub mod query;
pub mod rays;
pub mod recording;
mod report;
mod respond;
pub mod sight;
pub mod skin;
mod sleep;
mod snapshot;
mod springs;
mod step;
mod substance;
mod units;
mod volume;

use crate::handle::{Arena, Noun, WorldTag};
pub use articulations::Articulation;
pub use deformed::Deformation;
pub use desc::{
    BodyDesc, BodyId, LinkDesc, LinkId, Response, Scheme, SkeletonDesc, SkeletonId, SpringDesc, SpringId,
    StiffnessRule, VelocityConvention, WorldDesc,
};
pub use events::{Contact, Counters, Event, EventKind, LogLevel, Tally, Times};
pub use motion::LinkState;
pub use recording::{Playback, Recorder, RecorderDesc};
pub use skin::SkinId;
pub use springs::{Spring, SpringState};
pub use substance::{Change, Fill, Particle, ParticleId, Piece, SubstanceDesc};

use crate::base::{self, Kind};
use crate::error::{Error, Result};
use crate::field::Profile;
use crate::math::{Pose, Quat, Wrench};
use crate::response::mirror::Mirror;
use crate::team::{Alone, Tasks};

/// A body as the world keeps it.
pub struct Body {
    pub(crate) desc: BodyDesc,
    pub(crate) links: Vec<u32>,
    pub(crate) springs: Vec<u32>,
    pub(crate) enabled: bool,
    /// What its descriptor comes to \[Pa\].
    pub(crate) stiffness_scale: f64,
    /// What its descriptor comes to \[s/m\].
    pub(crate) dissipation: f64,
    /// Steps for which it counts as part of a stack.
    pub(crate) stacked: u8,
    /// What has been said about its units since its last change.
    pub(crate) units: units::Said,
    /// Who blends with whom, unless all do.
    blending: Option<Box<blend::Blending>>,
    sleep: sleep::Sleep,
    /// Only of a substance.
    pub(crate) substance: Option<Box<crate::substance::Substance>>,
    /// Only with volume control.
    volume: Option<Box<volume::Control>>,
}

/// A link as the world keeps it.
pub struct Link {
    pub(crate) desc: LinkDesc,
    pub(crate) body: u32,
    pub(crate) skeletons: Vec<u32>,
    pub(crate) enabled: bool,
    /// Forces of the host for the next step, about the centre of mass.
    pub(crate) applied_force: Wrench,
    /// Impulses of the host for the next step, about the centre of mass.
    pub(crate) applied_impulse: Wrench,
    /// Impulse of contacts and springs over the last step, about the centre of mass.
    pub(crate) contact_impulse: Wrench,
    /// What the host is to apply to a host-driven link after the last step, about the centre of mass.
    pub(crate) host_impulse: Wrench,
    /// Of that, the impulse of substances.
    pub(crate) substance_impulse: Wrench,
    /// Length of the last step.
    pub(crate) last_dt: f64,
    pub(crate) mirror: Mirror,
    /// It is in an articulation.
    pub(crate) articulated: bool,
}

impl Link {
    /// Whether joints of its host hold it.
    pub(crate) fn is_held(&self) -> bool {
        let said = self.desc.constrained || self.articulated;
        self.desc.kind == Kind::Host && (said || self.mirror.is_doubtful())
    }

    /// One that nothing has happened to yet.
    pub(crate) fn new(desc: LinkDesc, body: u32) -> Self {
        Link {
            desc,
            body,
            skeletons: Vec::new(),
            enabled: true,
            applied_force: Wrench::default(),
            applied_impulse: Wrench::default(),
            contact_impulse: Wrench::default(),
            host_impulse: Wrench::default(),
            substance_impulse: Wrench::default(),
            last_dt: 0.0,
            mirror: Mirror::default(),
            articulated: false,
        }
    }
}

/// A skeleton as the world keeps it.
pub struct Skeleton {
    pub(crate) desc: SkeletonDesc,
    pub(crate) profile: Profile,
    pub(crate) link: u32,
    pub(crate) enabled: bool,
    /// How far volume control has moved its surface outwards \[m\]; `profile` has it in it.
    pub(crate) offset: f64,
    /// The volume that volume control aims at \[m³\]; none before its first look.
    pub(crate) target: Option<f64>,
    /// How far from it the body's surface may lie.
    pub(crate) reach: f64,
    /// Its rays, and the count they were made for; made at the first use.
    pub(crate) rays: std::sync::OnceLock<(u32, std::sync::Arc<[crate::coat::seeds::Ray]>)>,
}

impl Noun for Body {
    const NAME: &'static str = "body";
}
impl Noun for Link {
    const NAME: &'static str = "link";
}
impl Noun for Skeleton {
    const NAME: &'static str = "skeleton";
}

/// Receives the library's messages; the text is valid during the call.
pub type Log = Box<dyn FnMut(LogLevel, &str) + Send>;
/// Says whether two bodies may touch; called once a step for each pair whose bounds meet.
pub type PairFilter = Box<dyn FnMut(BodyId, BodyId) -> bool + Send>;

/// Everything; see the [module](self). Worlds are independent of each other.
pub struct World {
    desc: WorldDesc,
    /// Which handles are this world's, told apart in all processes: see [`World::restore`].
    origin: u64,
    own_tag: WorldTag,
    bodies: Arena<Body>,
    links: Arena<Link>,
    skeletons: Arena<Skeleton>,
    springs: Arena<Spring>,
    /// No part of snapshots.
    skins: Arena<skin::Skin>,
    articulations: Vec<base::Articulation>,
    log: Alone<Option<Log>>,
    pair_filter: Alone<Option<PairFilter>>,
    tasks: Alone<Option<Box<dyn Tasks>>>,
    /// A body has volume control, or has had it: without any, steps need not look.
    controls_volumes: bool,
    stepping: step::Stepping,
}

/// Lives, descriptors.
impl World {
    /// Creates an empty world.
    pub fn new(desc: WorldDesc) -> Result<Self> {
        desc.validate()?;
        let own_tag = WorldTag::take()?;
        let tag = own_tag.number();
        Ok(Self {
            own_tag,
            desc,
            origin: snapshot::new_origin(),
            bodies: Arena::new(tag),
            links: Arena::new(tag),
            skeletons: Arena::new(tag),
            springs: Arena::new(tag),
            skins: Arena::new(tag),
            articulations: Vec::new(),
            log: Alone::default(),
            pair_filter: Alone::default(),
            tasks: Alone::default(),
            controls_volumes: false,
            stepping: step::Stepping::default(),
        })
    }

    /// The settings.
    pub fn desc(&self) -> &WorldDesc {
        &self.desc
    }

    /// Changes the settings, from the next step on.
    pub fn set_desc(&mut self, desc: WorldDesc) -> Result<()> {
        desc.validate()?;
        // What is worked out about bodies depends on these two.
        let changes = desc.gravity != self.desc.gravity || desc.seed_count != self.desc.seed_count;
        if desc != self.desc {
            self.rouse_all();
        }
        if desc.seed_count != self.desc.seed_count {
            for skeleton in 0..self.skeletons.capacity() {
                if let Some(skeleton) = self.skeletons.at_mut(skeleton) {
                    skeleton.rays = Default::default();
                }
            }
        }
        self.desc = desc;
        if changes {
            for index in 0..self.bodies.capacity() {
                if self.bodies.is_live(index) {
                    self.refresh(index);
                }
            }
        }
        Ok(())
    }

    /// Sets who receives messages.
    pub fn set_log(&mut self, log: Option<Log>) {
        *self.log.get_mut() = log;
    }

    /// Sets who decides about pairs, after categories and masks.
    pub fn set_pair_filter(&mut self, filter: Option<PairFilter>) {
        *self.pair_filter.get_mut() = filter;
        self.rouse_all();
    }

    /// Sets whose threads help with the steps; without, a step is the work of the thread that calls it. Results are the
    /// same bits for any number of workers.
    pub fn set_tasks(&mut self, tasks: Option<Box<dyn Tasks>>) {
        *self.tasks.get_mut() = tasks;
    }

    /// All bodies, in the order of their slots.
    pub fn bodies(&self) -> impl Iterator<Item = BodyId> + '_ {
        self.bodies.indices().map(|index| self.bodies.id_of(index))
    }

    /// Creates a body without links.
    pub fn create_body(&mut self, desc: BodyDesc) -> Result<BodyId> {
        desc.validate()?;
        let (stiffness_scale, dissipation) = (desc.stiffness_scale, desc.dissipation);
        self.controls_volumes |= desc.volume_gain > 0.0;
        self.bodies.insert(Body {
            desc,
            links: Vec::new(),
            springs: Vec::new(),
            enabled: true,
            stiffness_scale,
            dissipation,
            stacked: 0,
            units: units::Said::default(),
            blending: None,
            sleep: sleep::Sleep::default(),
            substance: None,
            volume: None,
        })
    }

    /// Destroys a body with its links, skeletons and springs.
    pub fn destroy_body(&mut self, id: BodyId) -> Result<()> {
        self.bodies.get(id)?;
        self.rouse(id.raw.index);
        let body = self.bodies.remove(id)?;
        for spring in body.springs {
            self.springs.remove(self.springs.id_of(spring as usize))?;
        }
        for link in body.links {
            self.drop_link(link as usize)?;
        }
        Ok(())
    }

    /// The descriptor of a body.
    pub fn body_desc(&self, id: BodyId) -> Result<&BodyDesc> {
        Ok(&self.bodies.get(id)?.desc)
    }

    /// Stiffness scale \[Pa\] and dissipation \[s/m\] of a body, as its [`StiffnessRule`] gives them.
    pub fn body_stiffness(&self, id: BodyId) -> Result<(f64, f64)> {
        let body = self.bodies.get(id)?;
        Ok((body.stiffness_scale, body.dissipation))
    }

    /// Changes a body. A new isovalue must suit the profiles of all its skeletons.
    pub fn set_body_desc(&mut self, id: BodyId, desc: BodyDesc) -> Result<()> {
        desc.validate()?;
        let body = self.bodies.get(id)?;
        if desc.rigid && body.substance.is_some() {
            return Err(Error::Unsupported("a substance cannot be rigid"));
        }
        let skeletons = || body.links.iter().flat_map(|link| &self.links[*link as usize].skeletons);
        if desc.isovalue != body.desc.isovalue {
            for skeleton in skeletons() {
                self.skeletons[*skeleton as usize].desc.profile(desc.isovalue)?;
            }
            for skeleton in skeletons().copied().collect::<Vec<_>>() {
                let skeleton = &mut self.skeletons[skeleton as usize];
                skeleton.profile = skeleton.desc.profile(desc.isovalue)?.inflated(skeleton.offset);
                skeleton.rays = Default::default();
            }
        }
        self.controls_volumes |= desc.volume_gain > 0.0;
        let body = self.bodies.get_mut(id)?;
        let switched = (desc.volume_gain > 0.0) != (body.desc.volume_gain > 0.0);
        body.desc = desc;
        if switched {
            self.reset_volumes(id.index());
        }
        self.refresh(id.index());
        Ok(())
    }

    /// Takes a body out of the simulation, or puts it back.
    pub fn set_body_enabled(&mut self, id: BodyId, enabled: bool) -> Result<()> {
        self.bodies.get(id)?;
        self.rouse(id.raw.index);
        let body = self.bodies.get_mut(id)?;
        body.enabled = enabled;
        for link in &body.links {
            self.links[*link as usize].mirror = Mirror::default();
        }
        Ok(())
    }

    /// Whether a body takes part.
    pub fn body_is_enabled(&self, id: BodyId) -> Result<bool> {
        Ok(self.bodies.get(id)?.enabled)
    }

    /// The links of a body, in the order of their creation.
    pub fn body_links(&self, id: BodyId) -> Result<impl Iterator<Item = LinkId> + '_> {
        Ok(self.bodies.get(id)?.links.iter().map(|index| self.links.id_of(*index as usize)))
    }

    /// Creates a link of a body.
    pub fn create_link(&mut self, body: BodyId, mut desc: LinkDesc) -> Result<LinkId> {
        desc.validate()?;
        if self.bodies.get(body)?.substance.is_some() {
            return Err(Error::Unsupported("a substance has particles in place of links"));
        }
        desc.pose.rotation.renormalize();
        let id = self.links.insert(Link::new(desc, body.raw.index))?;
        self.bodies.get_mut(body)?.links.push(id.raw.index);
        self.refresh(body.index());
        Ok(id)
    }

    /// Destroys a link with its skeletons and springs.
    pub fn destroy_link(&mut self, id: LinkId) -> Result<()> {
        let body = self.links.get(id)?.body as usize;
        self.drop_springs_of(id)?;
        self.bodies[body].links.retain(|index| *index != id.raw.index);
        if let Some(blending) = &mut self.bodies[body].blending {
            blending.forget_link(id.raw.index);
            self.links[id.index()].skeletons.iter().for_each(|skeleton| blending.forget_skeleton(*skeleton));
        }
        self.drop_link(id.index())?;
        self.refresh(body);
        Ok(())
    }

    fn drop_link(&mut self, index: usize) -> Result<()> {
        self.end_articulation_of(index as u32);
        let link = self.links.remove(self.links.id_of(index))?;
        for skeleton in link.skeletons {
            self.skeletons.remove(self.skeletons.id_of(skeleton as usize))?;
        }
        Ok(())
    }

    /// The descriptor of a link, with its present pose and twist.
    pub fn link_desc(&self, id: LinkId) -> Result<&LinkDesc> {
        Ok(&self.links.get(id)?.desc)
    }

    /// Changes a link, its pose and twist included.
    pub fn set_link_desc(&mut self, id: LinkId, mut desc: LinkDesc) -> Result<()> {
        desc.validate()?;
        desc.pose.rotation.renormalize();
        for skeleton in &self.links.get(id)?.skeletons {
            check_plane(&self.skeletons[*skeleton as usize].desc, desc.kind)?;
        }
        self.check_ends(id, &desc)?;
        let link = self.links.get_mut(id)?;
        let (old, new) = (link.desc.kind, desc.kind);
        if old != new {
            link.mirror = Mirror::default();
            (link.applied_force, link.applied_impulse) = (Wrench::default(), Wrench::default());
        }
        if desc.inverse_effective_inertia.is_some() != link.desc.inverse_effective_inertia.is_some() {
            link.mirror.forget_hold();
        }
        link.desc = desc;
        let body = link.body as usize;
        if old != new || link.desc.mass == 0.0 {
            self.end_articulation_of(id.raw.index);
        }
        self.refresh(body);
        Ok(())
    }

    /// Takes a link with its skeletons and springs out of the simulation, or puts them back.
    pub fn set_link_enabled(&mut self, id: LinkId, enabled: bool) -> Result<()> {
        let link = self.links.get_mut(id)?;
        link.enabled = enabled;
        link.mirror = Mirror::default();
        let body = link.body as usize;
        self.refresh(body);
        Ok(())
    }

    /// Whether a link takes part.
    pub fn link_is_enabled(&self, id: LinkId) -> Result<bool> {
        Ok(self.links.get(id)?.enabled)
    }

    /// The body of a link.
    pub fn link_body(&self, id: LinkId) -> Result<BodyId> {
        Ok(self.bodies.id_of(self.links.get(id)?.body as usize))
    }

    /// The skeletons of a link, in the order of their creation.
    pub fn link_skeletons(&self, id: LinkId) -> Result<impl Iterator<Item = SkeletonId> + '_> {
        Ok(self.links.get(id)?.skeletons.iter().map(|index| self.skeletons.id_of(*index as usize)))
    }

    /// Brings what is derived from a body's parts up to date after a change of any of them.
    fn refresh(&mut self, slot: usize) {
        self.rouse(slot as u32);
        self.unsettle(slot);
        self.bodies[slot].units = units::Said::default();
        self.measure(slot);
    }

    /// Works out what follows from the descriptors of a body and its parts.
    fn measure(&mut self, slot: usize) {
        self.compile_blending(slot);
        self.measure_reach(slot);
        let derived = units::derive(self, &self.bodies[slot]);
        let body = &mut self.bodies[slot];
        (body.stiffness_scale, body.dissipation) = derived;
    }

    /// How far the surface of a body may lie from its skeletons.
    fn measure_reach(&mut self, slot: usize) {
        let body = &self.bodies[slot];
        let count = self.skeletons_of(body).count();
        let blending = body.blending.as_ref().filter(|blending| !blending.graph.is_complete());
        let rise = blending.map_or(0.0, |blending| blending.graph.rise());
        let mut position = 0;
        for link in body.links.iter().map(|link| &self.links[*link as usize]).filter(|link| link.enabled) {
            for index in &link.skeletons {
                let skeleton = &mut self.skeletons[*index as usize];
                if skeleton.enabled {
                    let together = blending.map_or(count, |blending| blending.together[position]);
                    skeleton.reach = crate::field::blend::reach(&skeleton.profile, together, rise);
                    position += 1;
                }
            }
        }
    }

    /// Creates a skeleton of a link. A plane needs a link of kind fixed.
    pub fn create_skeleton(&mut self, link: LinkId, desc: SkeletonDesc) -> Result<SkeletonId> {
        let profile = self.check_skeleton(link, &desc)?;
        let (id, body) = self.add_skeleton(link, desc, profile)?;
        self.refresh(body);
        Ok(id)
    }

    /// Creates many skeletons, each of the link beside it: all of them, or none if one is refused. Their shapes are in the
    /// frames of their links; or, all of them, in one frame of the world, from which they are brought to their links as
    /// these are now.
    pub fn create_skeletons(
        &mut self,
        skeletons: &[(LinkId, SkeletonDesc)],
        frame: Option<&Pose>,
    ) -> Result<Vec<SkeletonId>> {
        frame.map_or(Ok(()), desc::validate_pose)?;
        let placed = skeletons.iter().map(|(link, desc)| Ok((*link, self.place_skeleton(*link, desc, frame)?)));
        let placed = placed.collect::<Result<Vec<_>>>()?;
        let (mut made, mut bodies) = (Vec::with_capacity(skeletons.len()), Vec::new());
        for (link, (desc, profile)) in placed {
            match self.add_skeleton(link, desc, profile) {
                Ok((id, body)) => {
                    made.push(id);
                    bodies.push(body);
                }
                Err(error) => {
                    made.into_iter().try_for_each(|id| self.destroy_skeleton(id))?;
                    return Err(error);
                }
            }
        }
        bodies.sort_unstable();
        bodies.dedup();
        bodies.into_iter().for_each(|body| self.refresh(body));
        Ok(made)
    }

    /// A skeleton of [`World::create_skeletons`] in the frame of its link, checked; the frame of all is valid.
    pub(crate) fn place_skeleton(
        &self,
        link: LinkId,
        desc: &SkeletonDesc,
        frame: Option<&Pose>,
    ) -> Result<(SkeletonDesc, Profile)> {
        let mut desc = desc.clone();
        if let Some(frame) = frame {
            let pose = self.links.get(link)?.desc.pose;
            let rotation = Quat::new_normalize(frame.rotation.into_inner());
            // One motion: in the frame of the link itself, what is given stays as it is.
            let motion = Pose {
                position: pose.inverse_transform_point(&frame.position),
                rotation: pose.rotation.inverse() * rotation,
            };
            desc.shape = desc.shape.transformed(&motion);
        }
        let profile = self.check_skeleton(link, &desc)?;
        Ok((desc, profile))
    }

    /// Adds a checked skeleton, and says to which body.
    fn add_skeleton(&mut self, link: LinkId, desc: SkeletonDesc, profile: Profile) -> Result<(SkeletonId, usize)> {
        let id = self.skeletons.insert(Skeleton {
            desc,
            profile,
            link: link.raw.index,
            enabled: true,
            offset: 0.0,
            target: None,
            reach: profile.thickness,
            rays: Default::default(),
        })?;
        let link = self.links.get_mut(link)?;
        link.skeletons.push(id.raw.index);
        Ok((id, link.body as usize))
    }

    fn check_skeleton(&self, link: LinkId, desc: &SkeletonDesc) -> Result<Profile> {
        let link = self.links.get(link)?;
        let profile = desc.profile(self.bodies[link.body as usize].desc.isovalue)?;
        check_plane(desc, link.desc.kind)?;
        Ok(profile)
    }

    /// Destroys a skeleton.
    pub fn destroy_skeleton(&mut self, id: SkeletonId) -> Result<()> {
        let skeleton = self.skeletons.remove(id)?;
        let link = &mut self.links[skeleton.link as usize];
        link.skeletons.retain(|index| *index != id.raw.index);
        let body = link.body as usize;
        if let Some(blending) = &mut self.bodies[body].blending {
            blending.forget_skeleton(id.raw.index);
        }
        self.refresh(body);
        Ok(())
    }

    /// The descriptor of a skeleton.
    pub fn skeleton_desc(&self, id: SkeletonId) -> Result<&SkeletonDesc> {
        Ok(&self.skeletons.get(id)?.desc)
    }

    /// The field profile of a skeleton, with the stiffness and radius that stand for zeros in its descriptor, as volume
    /// control has moved it.
    pub fn skeleton_profile(&self, id: SkeletonId) -> Result<&Profile> {
        Ok(&self.skeletons.get(id)?.profile)
    }

    /// Changes a skeleton.
    pub fn set_skeleton_desc(&mut self, id: SkeletonId, desc: SkeletonDesc) -> Result<()> {
        let link = self.links.id_of(self.skeletons.get(id)?.link as usize);
        let profile = self.check_skeleton(link, &desc)?;
        let skeleton = self.skeletons.get_mut(id)?;
        if desc != (SkeletonDesc { user_data: desc.user_data, ..skeleton.desc.clone() }) {
            (skeleton.offset, skeleton.target) = (0.0, None);
        }
        skeleton.profile = profile.inflated(skeleton.offset);
        (skeleton.desc, skeleton.rays) = (desc, Default::default());
        let body = self.links.get(link)?.body as usize;
        self.refresh(body);
        Ok(())
    }

    /// Takes a skeleton out of the simulation, or puts it back.
    pub fn set_skeleton_enabled(&mut self, id: SkeletonId, enabled: bool) -> Result<()> {
        let skeleton = self.skeletons.get_mut(id)?;
        skeleton.enabled = enabled;
        let link = skeleton.link as usize;
        self.refresh(self.links[link].body as usize);
        Ok(())
    }

    /// Whether a skeleton takes part.
    pub fn skeleton_is_enabled(&self, id: SkeletonId) -> Result<bool> {
        Ok(self.skeletons.get(id)?.enabled)
    }

    /// The link of a skeleton.
    pub fn skeleton_link(&self, id: SkeletonId) -> Result<LinkId> {
        Ok(self.links.id_of(self.skeletons.get(id)?.link as usize))
    }
}

fn check_plane(desc: &SkeletonDesc, kind: Kind) -> Result<()> {
    if matches!(desc.shape, crate::field::Shape::Plane { .. }) && kind != Kind::Fixed {
        return Err(Error::Unsupported("a plane is for fixed links: it has no bounds to move"));
    }
    Ok(())
}

/// What the last step reported.
impl World {
    /// The contacts of the last step; of a sub-stepped one, as they were in its last sub-step; of bodies asleep, as they
    /// were when these fell asleep. The last come first.
    pub fn contacts(&self) -> &[Contact] {
        self.stepping.contacts()
    }

    /// How many contacts at the front are of bodies asleep, and a number that changes whenever these do.
    pub(crate) fn resting_contacts(&self) -> (usize, u64) {
        self.stepping.resting_contacts()
    }

    /// What began, ended or overloaded in the last step.
    pub fn events(&self) -> &[Event] {
        self.stepping.events()
    }

    /// Figures of the last step.
    pub fn counters(&self) -> Counters {
        Counters {
            bodies: self.bodies.len() as u32,
            links: self.links.len() as u32,
            skeletons: self.skeletons.len() as u32,
            asleep: self.bodies.indices().filter(|body| self.bodies[*body].is_asleep()).count() as u32,
            ..self.stepping.counters()
        }
    }

    /// Where the time of the last step went, if [`WorldDesc::timed`] asks for it.
    pub fn times(&self) -> Times {
        self.stepping.times()
    }
}
