//! What substances do in a step: gathered from their bodies, advanced, and put back with volumes, pieces and contacts.

use std::collections::{BTreeMap, BTreeSet};

use crate::base::{Kind, Motion};
use crate::coat::{Coat, seeds};
use crate::field::{Placed, Shape};
use crate::math::{Twist, Vec3, Wrench};
use crate::response::VelocityConvention;
use crate::substance::Substance;
use crate::substance::pieces::Findings;
use crate::substance::swarm::{CROWD, Matter, Swarm};
use crate::substance::system::System;
use crate::substance::volume::{Rays, Share, measure, next_offset};
use crate::team::Team;
use crate::world::gather::material;
use crate::world::step::Stepping;
use crate::world::{Body, Contact, LinkId, LogLevel, Scheme, SkeletonId, World};

/// Looks at the volumes in one step, when a piece is farther off than this: squeezed within a step, it swells in the same.
const LOOKS: usize = 6;
const TOO_FAR: f64 = 0.015;
/// Gain of volume control where something presses, over that of a free surface: of lumps of so many particles it is this
/// low, and of smaller ones higher. The larger a lump, the more slowly it swings, and coats that follow faster than it
/// swings drive it on.
const UNDER_PRESSURE: f64 = 0.1;
const LARGE: f64 = 10_000.0;
/// Part of the surface that is enough to make good what all lack.
const ENOUGH: f64 = 0.4;
/// Particles that a worker measures at a time.
const MEASURED: usize = 32;

/// Labels of particles, as the swarm counts them.
type Labels = BTreeSet<u32>;

impl World {
    /// Substances that take part, by the slots of their bodies.
    pub(super) fn substances(&self) -> impl Iterator<Item = (u32, &Body, &Substance)> {
        self.bodies.indices().filter_map(|slot| {
            let body = &self.bodies[slot];
            let substance = body.substance.as_deref().filter(|s| !s.particles.is_empty())?;
            (body.enabled && !body.is_asleep()).then_some((slot as u32, body, substance))
        })
    }

    /// Where the fields of a substance may reach in a step.
    pub(super) fn region_of(&self, body: &Body, substance: &Substance, dt: f64) -> (Vec3, Vec3) {
        let radius = substance.desc.profile(body.desc.isovalue).map_or(0.0, |profile| profile.radius);
        let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let fall = 0.5 * self.desc.gravity.norm() * dt * dt;
        for particle in &substance.particles {
            let margin = Vec3::repeat(1.2 * radius + particle.offset + fall) + particle.velocity.abs() * dt;
            (low, high) = (low.inf(&(particle.position - margin)), high.sup(&(particle.position + margin)));
        }
        (low, high)
    }

    /// Moves all substances, and gives what they press on the impulses of it.
    pub(in crate::world) fn step_substances(&mut self, state: &mut Stepping, dt: f64, team: &Team) {
        state.substance_contacts.clear();
        state.system.substeps = 0;
        for slot in 0..self.bodies.capacity() {
            if let Some(Body { substance: Some(substance), .. }) = self.bodies.at_mut(slot) {
                substance.changes.clear();
            }
        }
        self.wake_substances(state, dt);
        if self.substances().next().is_none() {
            state.system.carried.clear();
            return;
        }
        let mut system = std::mem::take(&mut state.system);
        self.gather_swarm(&mut system.swarm);
        self.gather_obstacles(&mut system, state, dt);
        let mut motions = state.motions.clone();
        system.gather_links();
        for link in &mut system.links {
            let motion = &motions[link.slot as usize];
            link.hold = self.what_held(link.slot, motion);
            // The velocity of a leapfrog host is half a step old, and it was taken on as if nothing held it.
            let age = if self.is_leapfrog(link.slot) { 0.5 * dt } else { 0.0 };
            let mut then = motion.twist;
            then.linear -= motion.acceleration * age;
            then.angular -= motion.angular_acceleration * age;
            link.begin(then, age);
        }
        system.advance(&mut motions, dt, self.desc.substep_phase, self.desc.max_substeps, team);
        for (link, wrench) in system.carried.iter().enumerate() {
            if *wrench != Wrench::default() {
                state.motions[link].push(wrench);
            }
        }
        self.list_contacts(&system, &motions, state);
        self.settle_substances(&mut system, dt, team);
        state.system = system;
    }

    /// What held a link in the last step against what the substances did to it, as an acceleration: other contacts,
    /// which the response knows only afterwards, and what its host did by itself.
    fn what_held(&self, link: u32, motion: &Motion) -> Twist {
        let link = &self.links[link as usize];
        if link.desc.kind == Kind::Fixed || link.last_dt <= 0.0 {
            return Twist::default();
        }
        let mut other = link.contact_impulse;
        other.add_scaled(&link.substance_impulse, -1.0);
        let mut hold = motion.answer(&other);
        hold.linear /= link.last_dt;
        hold.angular /= link.last_dt;
        if link.desc.kind == Kind::Host {
            let own = link.mirror.own_doing(&self.host(link), link.last_dt);
            hold.linear += own.linear;
            hold.angular += own.angular;
        }
        hold
    }

    /// Whether the velocity that a step takes on from a link's host is half a step old.
    fn is_leapfrog(&self, link: u32) -> bool {
        let link = &self.links[link as usize];
        let desc = &link.desc;
        desc.kind == Kind::Host && desc.velocity_convention == VelocityConvention::Leapfrog && !link.mirror.is_active()
    }

    fn gather_swarm(&self, swarm: &mut Swarm) {
        let columns = std::mem::take(swarm);
        *swarm = Swarm { near: columns.near, ..Swarm::default() };
        let mut bonds = Vec::new();
        let mut first_label = 0;
        for (slot, body, substance) in self.substances() {
            if swarm.matters.is_empty() {
                swarm.origin = substance.particles[0].position;
            }
            // Its descriptor was checked when it came.
            let Ok(profile) = substance.desc.profile(body.desc.isovalue) else { continue };
            let (kind, first) = (swarm.matters.len() as u16, swarm.place.len() as u32);
            let desc = &substance.desc;
            let mut rays = Vec::new();
            seeds::rays(&Shape::Point(Vec3::zeros()), profile.thickness, desc.seed_count as usize, &mut rays);
            swarm.matters.push(Matter {
                body: slot,
                spacing: desc.spacing,
                mass: desc.particle_mass,
                cohesion: desc.cohesion,
                viscosity: desc.viscosity,
                damping: desc.damping,
                fusion_threshold: desc.fusion_threshold,
                inverse_width: 1.0 / (profile.radius - profile.thickness),
                half: profile.distance_of_level(0.5 * profile.isovalue),
                farthest: profile.distance_of_level(profile.isovalue / CROWD),
                profile,
                stiffness_scale: body.stiffness_scale,
                material: material(body, body),
                rays: Rays::new(rays.iter().map(|ray| ray.direction)),
            });
            for particle in &substance.particles {
                swarm.place.push(particle.position - swarm.origin);
                swarm.velocity.push(particle.velocity);
                swarm.pull.push(self.desc.gravity + particle.force / desc.particle_mass);
                swarm.offset.push(particle.offset);
                swarm.label.push(first_label + particle.label);
                swarm.kind.push(kind);
            }
            bonds.extend(substance.bonds.iter().map(|bond| (bond.pair.map(|end| end + first), bond.weight())));
            first_label += substance.next_label;
        }
        swarm.set_bonds(&bonds);
    }

    fn gather_obstacles(&mut self, system: &mut System, state: &mut Stepping, dt: f64) {
        let mut filter = self.pair_filter.get_mut().take();
        let mut old = std::mem::take(&mut system.obstacles).into_iter();
        for bounds in &state.bounds {
            let (slot, body) = (bounds.body, &self.bodies[bounds.body as usize]);
            let mut region: Option<(Vec3, Vec3)> = None;
            let mut materials = vec![None; system.swarm.matters.len()];
            for (matter, found) in system.swarm.matters.iter().zip(&mut materials) {
                let own = &self.bodies[matter.body as usize];
                let Some(substance) = &own.substance else { continue };
                let (low, high) = self.region_of(own, substance, dt);
                let (low, high) = (low.sup(&bounds.low), high.inf(&bounds.high));
                let meets = (0..3).all(|axis| low[axis] <= high[axis]);
                let agree = own.desc.mask & body.desc.category != 0 && body.desc.mask & own.desc.category != 0;
                let mut allowed = || {
                    let pair = [matter.body.min(slot), matter.body.max(slot)];
                    let [a, b] = pair.map(|body| self.bodies.id_of(body as usize));
                    filter.as_mut().is_none_or(|filter| filter(a, b))
                };
                if meets && agree && allowed() {
                    *found = Some(material(own, body));
                    region = Some(region.map_or((low, high), |(l, h)| (l.inf(&low), h.sup(&high))));
                }
            }
            let Some(region) = region else { continue };
            let mut obstacle = old.next().unwrap_or_default();
            self.fill_side(&mut obstacle.side, body, &state.motions, &region, dt);
            if !obstacle.side.skeletons.is_empty() {
                obstacle.materials = materials;
                system.obstacles.push(obstacle);
            }
        }
        *self.pair_filter.get_mut() = filter;
    }

    /// A contact for each substance and each link that it presses on.
    fn list_contacts(&self, system: &System, motions: &[Motion], state: &mut Stepping) {
        let contacts: &mut Vec<Contact> = &mut state.substance_contacts;
        let origin = system.swarm.origin;
        let mut sums: BTreeMap<(u32, u32), usize> = BTreeMap::new();
        system.contacts(motions, |own, link, press| {
            let place = *sums.entry((own, link)).or_insert_with(|| {
                let other = self.links[link as usize].body;
                contacts.push(Contact {
                    bodies: [own, other].map(|body| self.bodies.id_of(body as usize)),
                    links: [LinkId::default(), self.links.id_of(link as usize)],
                    skeletons: [SkeletonId::default(); 2],
                    scheme: Scheme::Seeds,
                    ..Contact::default()
                });
                contacts.len() - 1
            });
            let contact = &mut contacts[place];
            let size = press.push.norm();
            contact.force -= press.push;
            // First sums, weighted by the size of the force.
            contact.position += press.point * size;
            contact.torque -= press.point.cross(&press.push);
            contact.area += press.area;
            contact.stiffness += press.stiffness;
            contact.peak_pressure = contact.peak_pressure.max(press.peak.0);
            contact.normal.x += size;
        });
        for contact in contacts {
            let total = contact.normal.x;
            contact.position /= total;
            contact.torque -= contact.position.cross(&contact.force);
            contact.position += origin;
            contact.normal = contact.force.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
        }
    }

    /// Moves the offsets of the particles of some labels, or of all. Which of these were too far off to leave it there.
    fn control_particles(&mut self, swarm: &mut Swarm, shares: &[Share], only: Option<&Labels>) -> Labels {
        let (mut first, mut off) = (0, Labels::new());
        for matter in &swarm.matters {
            let Some(substance) = self.bodies[matter.body as usize].substance.as_deref_mut() else { continue };
            let own = first..first + substance.particles.len();
            let labels = &swarm.label[own.clone()];
            let pressed = &swarm.is_pressed[own.clone()];
            let offsets = &mut swarm.offset[own.clone()];
            let thickness = matter.profile.thickness;
            off.extend(substance.control_volume(&shares[own.clone()], thickness, (labels, pressed), only, offsets));
            first = own.end;
        }
        off
    }

    /// Volumes, offsets, pieces, bonds; and all back to the bodies.
    fn settle_substances(&mut self, system: &mut System, dt: f64, team: &Team) {
        let mut shares = std::mem::take(&mut system.shares);
        shares.resize_with(system.swarm.place.len(), Share::default);
        // All labels are looked at, then those whose volumes are too far off.
        let mut off = Labels::new();
        for look in 0..LOOKS {
            let swarm = &mut system.swarm;
            team.each_mut(&mut shares, MEASURED, |index, share| {
                if look == 0 || off.contains(&swarm.label[index]) {
                    measure(swarm, index, share);
                }
            });
            off = self.control_particles(swarm, &shares, (look > 0).then_some(&off));
            if off.is_empty() {
                break;
            }
        }
        let swarm = &system.swarm;
        let mut first = 0;
        for (kind, matter) in swarm.matters.iter().enumerate() {
            let Some(substance) = self.bodies[matter.body as usize].substance.as_deref_mut() else { continue };
            let count = substance.particles.len();
            let own = first..first + count;
            for (particle, index) in substance.particles.iter_mut().zip(own.clone()) {
                particle.position = swarm.place[index] + swarm.origin;
                particle.velocity = swarm.velocity[index];
                particle.force = Vec3::zeros();
                particle.offset = swarm.offset[index];
                particle.volume = shares[index].volume;
            }
            let is_own = |index: &u32| own.contains(&(*index as usize));
            let local = |index: u32| index - first as u32;
            let mut findings = Findings::default();
            for index in own.clone() {
                let (joined, loads) = (shares[index].joined.iter(), system.loads_of(index));
                let joined = joined.filter(|other| is_own(other) && !system.is_cut(loads, index, **other as usize));
                findings.joined.extend(joined.map(|other| [local(index as u32), local(*other)]));
            }
            let pressed = system.pressed.iter().filter(|pair| pair.iter().all(is_own));
            findings.pressed.extend(pressed.map(|pair| pair.map(local)));
            let reaching = |place: u32| -> Vec<u32> {
                let index = first + place as usize;
                let reach = |other: usize| 2.0 * matter.profile.radius + swarm.offset[index] + swarm.offset[other];
                let near = swarm.near.of(index).iter().copied().filter(|other| {
                    let at = *other as usize;
                    swarm.kind[at] as usize == kind
                        && (swarm.place[at] - swarm.place[index]).norm_squared() < reach(at).powi(2)
                });
                near.map(local).collect()
            };
            substance.settle(&findings, dt, reaching);
            first += count;
        }
        system.shares = shares;
        if system.overloaded
            && !std::mem::replace(&mut system.told, true)
            && let Some(log) = self.log.get_mut()
        {
            log(LogLevel::Warning, "a substance is stiffer than max_substeps can follow, or was pushed out of a body");
        }
    }

    /// A substance as a coat: its particles as skeletons, in a frame at `origin`.
    pub(in crate::world) fn fill_particles(&self, body: &Body, substance: &Substance, coat: &mut Coat) {
        let Ok(profile) = substance.desc.profile(body.desc.isovalue) else { return };
        let origin = coat.origin;
        coat.skeletons.extend(substance.particles.iter().map(|particle| Placed {
            shape: Shape::Point(particle.position - origin),
            profile: profile.inflated(particle.offset),
        }));
        let labels = substance.particles.iter().map(|particle| particle.label);
        let bonds = substance.bonds.iter().map(|bond| (bond.pair, bond.weight()));
        coat.graph.set_pieces(labels, bonds);
    }
}

impl Substance {
    /// The next offsets of its particles, so that each piece keeps its volume: what buried particles lack, those on the
    /// surface make good: of some labels of the world, or of all. Gives those that were too far off. Where something
    /// presses the surface follows slowly, and the free one makes good what is missing meanwhile: the volume errs whenever
    /// a lump swings on what carries it, and coats that swell a little later than they are pressed drive that on.
    fn control_volume(
        &mut self,
        shares: &[Share],
        thickness: f64,
        (labels, pressed): (&[u32], &[bool]),
        only: Option<&Labels>,
        offsets: &mut [f64],
    ) -> Labels {
        let mut sums: BTreeMap<u32, Sums> = BTreeMap::new();
        let counts = |label: &u32| only.is_none_or(|only| only.contains(label));
        for (((particle, share), label), pressed) in self.particles.iter_mut().zip(shares).zip(labels).zip(pressed) {
            if !counts(label) {
                continue;
            }
            let target = *particle.target.get_or_insert(share.volume);
            let sums = sums.entry(*label).or_default();
            sums.count += 1;
            sums.target += target;
            sums.error += share.volume - target;
            let group = match pressed {
                _ if share.exposed <= 0.0 => &mut sums.buried,
                true => &mut sums.pressed,
                false => &mut sums.free,
            };
            *group = (group.0 + share.exposed, group.1 + target - share.volume);
        }
        let gain = self.desc.volume_gain;
        if gain == 0.0 {
            return Labels::new();
        }
        for (index, particle) in self.particles.iter().enumerate() {
            let (share, label) = (&shares[index], &labels[index]);
            let Some(sums) = sums.get(label) else { continue };
            let patience = sums.patience();
            let target = particle.target.unwrap_or(share.volume);
            let gain = gain * if pressed[index] { patience } else { 1.0 };
            offsets[index] = next_offset(offsets[index], gain, share, target, sums.missing(patience), thickness);
        }
        let is_off = |sums: &Sums| sums.error.abs() > TOO_FAR * sums.target;
        sums.into_iter().filter(|(_, sums)| is_off(sums)).map(|(label, _)| label).collect()
    }
}

/// Of the particles of one label: how many, volume that is wanted, how far they are off; and of those that are buried,
/// pressed, or free the surface, and what they lack.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: u32,
    target: f64,
    error: f64,
    buried: (f64, f64),
    pressed: (f64, f64),
    free: (f64, f64),
}

impl Sums {
    /// Gain where something presses over that of the free surface; where hardly any is free, all is alike.
    fn patience(&self) -> f64 {
        let part = self.free.0 / (self.free.0 + self.pressed.0).max(1e-300);
        let least = UNDER_PRESSURE * (LARGE / f64::from(self.count)).max(1.0);
        (1.0 - part / ENOUGH).max(least.min(1.0))
    }

    /// What the surface is to make good, as a length.
    fn missing(&self, patience: f64) -> f64 {
        let surface = self.free.0 + patience * self.pressed.0;
        let lack = self.buried.1 + (1.0 - patience) * self.pressed.1;
        if surface > 0.0 { lack / surface } else { 0.0 }
    }
}
