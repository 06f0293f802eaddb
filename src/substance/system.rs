//! One step of all substances of a world: sub-steps of particles, and of what they touch.
//!
//! Velocity Verlet with forces of [`forces`](super::forces) and of [`contact`](super::contact); friction as exact impulses
//! after each sub-step. A contact is integrated when it has moved by a few percent of the thickness since it was last, and
//! is a spring in between. Links that can move go along in the sub-steps, held by what held them in the last step; what they
//! got is handed to the step's response, which then solves everything else.

use super::contact::Press;
use super::load::{Load, Obstacle, Other};
use super::locale::Locale;
use super::pairs::Pairs;
use super::swarm::{SKIN, Swarm};
use super::volume::Share;
use crate::base::Motion;
use crate::contact::press::Material;
use crate::field::skeleton::closest_points;
use crate::field::{Placed, Shape};
use crate::math::{Twist, Vec3, Wrench};
use crate::team::Team;

/// Farthest that anything may move in a sub-step, over the thickness.
const STRIDE: f64 = 0.25;
/// What holds a link may do this much more than in the last step: it has to follow a load that grows, or the link gives way
/// a little in each step and is put back, which drives swings of what lies on it.
const SLACK: f64 = 2.0;
/// Contacts or particles that a worker takes at a time.
const BLOCK: usize = 8;

/// Buffers of a step, and what it found.
#[derive(Debug, Default)]
pub struct System {
    /// The particles.
    pub swarm: Swarm,
    /// What they may touch.
    pub obstacles: Vec<Obstacle>,
    /// What each link got, about its centre of mass, by slot \[N s\].
    pub carried: Vec<Wrench>,
    /// Pairs of particles that meet under more than their threshold.
    pub pressed: Vec<[u32; 2]>,
    /// Sub-steps taken.
    pub substeps: u32,
    /// Stiffness was more than the sub-steps could follow, or a particle was pushed out of something.
    pub overloaded: bool,
    /// What each particle has of the coat, at the last look.
    pub shares: Vec<Share>,
    /// Links of obstacles, each once.
    pub links: Vec<HeldLink>,
    pairs: Pairs,
    loads: Vec<Load>,
    near_skeletons: Vec<u32>,
    built_at: Vec<Vec3>,
    force: Vec<Vec3>,
    softened: f64,
    /// The warning was given.
    pub told: bool,
    /// The forces are those of the present places.
    forced: bool,
}

/// A link that goes along in the sub-steps.
#[derive(Debug, Default)]
pub struct HeldLink {
    /// Its slot.
    pub slot: u32,
    /// What may hold it against what pulls at it and presses on it, as an acceleration: it undoes that, along itself.
    pub hold: Twist,
    /// Velocities when it was last held, and how much more it can be in this sub-step.
    held_at: Twist,
    left: [f64; 2],
}

impl HeldLink {
    /// From these velocities on it is held for `h` seconds.
    pub fn begin(&mut self, twist: Twist, h: f64) {
        self.held_at = twist;
        self.left = [&self.hold.linear, &self.hold.angular].map(|hold| SLACK * hold.norm() * h);
    }
}

thread_local! {
    static LOCALE: std::cell::RefCell<Locale> = std::cell::RefCell::default();
}

/// Runs `work` with the thread's own locale.
pub fn with_locale<T>(work: impl FnOnce(&mut Locale) -> T) -> T {
    LOCALE.with_borrow_mut(work)
}

impl System {
    /// Tells of each load by an obstacle the slots of the body and of the link, and what presses on the particle now.
    pub fn contacts(&self, motions: &[Motion], mut tell: impl FnMut(u32, u32, &Press)) {
        for load in &self.loads {
            if load.link == u32::MAX {
                continue;
            }
            let push = load.now(&self.swarm, motions, self.softened);
            if push != Vec3::zeros() {
                let press = Press { push, point: load.anchor(&self.swarm, motions), ..load.press };
                tell(self.swarm.matter_of(load.particle as usize).body, load.link, &press);
            }
        }
    }

    /// What may press on a particle.
    pub fn loads_of(&self, particle: usize) -> &[Load] {
        let first = self.loads.partition_point(|load| (load.particle as usize) < particle);
        let count = self.loads[first..].iter().take_while(|load| load.particle as usize == particle).count();
        &self.loads[first..first + count]
    }

    /// Whether a rigid body is between two particles, the first of which has these loads: a knife cuts, however thin it is.
    pub fn is_cut(&self, loads: &[Load], a: usize, b: usize) -> bool {
        let (start, end) = (&self.swarm.place[a], &self.swarm.place[b]);
        let line = Shape::Segment(*start, *end);
        loads.iter().any(|load| {
            let Other::Obstacle { number, skeletons } = &load.other else { return false };
            let side = &self.obstacles[*number as usize].side;
            let near = &self.near_skeletons[skeletons.0 as usize..skeletons.1 as usize];
            side.rigid
                && near.iter().any(|index| {
                    let Placed { shape, profile } = &side.skeletons[*index as usize];
                    // Distances from something convex are at least those from its tangent plane.
                    let closest = shape.closest(start);
                    if closest.distance + closest.normal.dot(&(end - start)).min(0.0) >= profile.thickness {
                        return false;
                    }
                    let (on_line, on_shape) = closest_points(&line, shape);
                    (on_line - on_shape).norm() < profile.thickness
                })
        })
    }

    /// Lists the links of obstacles, which nothing holds so far.
    pub fn gather_links(&mut self) {
        let slots = self.obstacles.iter().flat_map(|obstacle| &obstacle.side.links);
        self.links.clear();
        self.links.extend(slots.map(|slot| HeldLink { slot: *slot, ..HeldLink::default() }));
        self.links.sort_unstable_by_key(|link| link.slot);
        self.links.dedup_by_key(|link| link.slot);
    }

    /// Moves all particles, and the links of obstacles, by `dt`.
    pub fn advance(&mut self, motions: &mut [Motion], dt: f64, phase: f64, most: u32, team: &Team) {
        self.carried.clear();
        self.carried.resize(motions.len(), Wrench::default());
        self.pressed.clear();
        (self.substeps, self.overloaded, self.forced) = (0, false, false);
        let least = dt / f64::from(most);
        // Nothing of the last step counts, so that a snapshot needs none of it.
        self.loads.clear();
        self.overloaded |= self.pairs.couple(&self.swarm.matters, (2.0 * phase / least).powi(2));
        self.hold(motions);
        self.build(motions);
        self.refresh(motions, team);
        let mut left = dt;
        self.softened = (2.0 * phase / least).powi(2);
        while left > 0.0 {
            if !self.forced {
                self.forces(motions);
            }
            let wanted = self.stride(motions, phase).max(least);
            let h = left / (left / wanted * (1.0 - 1e-12)).ceil().max(1.0);
            self.substep(motions, h, team);
            self.substeps += 1;
            left = if left - h > 1e-9 * dt { left - h } else { 0.0 };
        }
        self.swarm.is_pressed.clear();
        self.swarm.is_pressed.resize(self.swarm.place.len(), false);
        for load in &self.loads {
            let is_pressed = &mut self.swarm.is_pressed;
            if load.press.push != Vec3::zeros() {
                is_pressed[load.particle as usize] = true;
                load.carriers.iter().for_each(|(carrier, _)| is_pressed[*carrier as usize] = true);
            }
        }
    }

    /// Neighbours, pairs that attract or repel, and what may come to press, over the motion that the skin allows.
    fn build(&mut self, motions: &[Motion]) {
        self.swarm.find_neighbours();
        self.built_at.clone_from(&self.swarm.place);
        self.pairs.list(&self.swarm);
        let mut old = std::mem::take(&mut self.loads);
        self.near_skeletons.clear();
        self.place_obstacles(motions);
        let widest = (1.0 + 2.0 * SKIN) * self.swarm.widest;
        self.obstacles.iter_mut().for_each(|obstacle| obstacle.bound(widest));
        let mut fresh = Vec::with_capacity(old.len());
        for i in 0..self.swarm.place.len() {
            self.list_obstacles(i, &mut fresh);
            self.list_pieces(i, &mut fresh);
        }
        // Both lists are in the order of particles, then of others.
        let mut at = 0;
        for load in &mut fresh {
            while at < old.len() && old[at].key() < load.key() {
                at += 1;
            }
            if at < old.len() && old[at].key() == load.key() {
                let other = load.other.clone();
                std::mem::swap(load, &mut old[at]);
                load.other = other;
            }
        }
        self.loads = fresh;
    }

    fn place_obstacles(&mut self, motions: &[Motion]) {
        let origin = self.swarm.origin;
        for obstacle in &mut self.obstacles {
            obstacle.side.place(motions, &origin);
        }
    }

    fn list_obstacles(&mut self, i: usize, out: &mut Vec<Load>) {
        let swarm = &self.swarm;
        let (p, matter) = (&swarm.place[i], swarm.matter_of(i));
        let reach = matter.profile.radius + swarm.offset[i] + 2.0 * SKIN * matter.profile.radius;
        for (number, obstacle) in self.obstacles.iter().enumerate() {
            if obstacle.materials[swarm.kind[i] as usize].is_none() {
                continue;
            }
            let from = self.near_skeletons.len() as u32;
            self.near_skeletons.extend(obstacle.near(p, reach));
            let to = self.near_skeletons.len() as u32;
            if to > from {
                let other = Other::Obstacle { number: number as u32, skeletons: (from, to) };
                out.push(Load::new(i as u32, other));
            }
        }
    }

    fn list_pieces(&self, i: usize, out: &mut Vec<Load>) {
        let swarm = &self.swarm;
        let (label, kind) = (swarm.label[i], swarm.kind[i] as usize);
        let first = out.len();
        for j in swarm.near.of(i) {
            let at = *j as usize;
            // One of the two has it: the lower label.
            if swarm.label[at] <= label {
                continue;
            }
            let distance = |at: usize| (swarm.place[at] - swarm.place[i]).norm_squared();
            let (own, other) = (swarm.matters[kind].profile, swarm.matter_of(at).profile);
            if distance(at) > (own.radius + other.radius + swarm.offset[i] + swarm.offset[at]).powi(2) {
                continue;
            }
            let found = out[first..].iter_mut().find_map(|load| match &mut load.other {
                Other::Piece { label, nearest } if *label == swarm.label[at] => Some(nearest),
                _ => None,
            });
            match found {
                Some(nearest) if distance(at) < distance(*nearest as usize) => *nearest = *j,
                Some(_) => {}
                None => out.push(Load::new(i as u32, Other::Piece { label: swarm.label[at], nearest: *j })),
            }
        }
        out[first..].sort_by_key(Load::key);
    }

    /// The longest sub-step that follows what is there.
    fn stride(&self, motions: &[Motion], phase: f64) -> f64 {
        let swarm = &self.swarm;
        let Pairs { rate2, mut speed, .. } = self.pairs;
        // 2 phase / rate of a pair is phase r_0 sqrt(m / γ) at rest.
        let mut contact2: f64 = 0.0;
        let mut sum: (u32, f64) = (u32::MAX, 0.0);
        for load in &self.loads {
            let i = load.particle as usize;
            let matter = swarm.matter_of(i);
            let mobility = 1.0 / matter.mass + motions.get(load.link as usize).map_or(0.0, Motion::inverse_mass);
            sum = if sum.0 == load.particle { sum } else { (load.particle, 0.0) };
            if load.press.stiffness > 0.0 {
                sum.1 += load.press.stiffness * mobility;
                contact2 = contact2.max(sum.1);
            }
            let closing = (swarm.velocity[i] - self.anchor_velocity(load, motions)).norm();
            speed = speed.max(closing / matter.profile.thickness);
        }
        let pair = 2.0 * phase / rate2.sqrt();
        let touch = 2.0 * phase / contact2.sqrt();
        let travel = STRIDE / speed;
        pair.min(touch).min(travel)
    }

    fn substep(&mut self, motions: &mut [Motion], h: f64, team: &Team) {
        for link in &mut self.links {
            link.begin(motions[link.slot as usize].twist, h);
        }
        self.kick(motions, 0.5 * h);
        self.hold(motions);
        for i in 0..self.swarm.place.len() {
            let velocity = self.swarm.velocity[i];
            self.swarm.place[i] += velocity * h;
        }
        for link in &self.links {
            motions[link.slot as usize].drift(h);
        }
        self.refresh(motions, team);
        self.forces(motions);
        self.kick(motions, 0.5 * h);
        self.pairs.rub(&mut self.swarm.velocity, h);
        self.rub_loads(motions, h);
        self.hold(motions);
    }

    /// Forces between particles, and of loads.
    fn forces(&mut self, motions: &[Motion]) {
        let Self { swarm, force, pairs, loads, .. } = self;
        force.clear();
        force.extend(swarm.pull.iter().enumerate().map(|(i, pull)| pull * swarm.matter_of(i).mass));
        pairs.push(swarm, force);
        for load in &*loads {
            let push = load.now(swarm, motions, self.softened);
            force[load.particle as usize] += push;
            for (carrier, part) in &load.carriers {
                force[*carrier as usize] -= push * *part;
            }
        }
        self.forced = true;
    }

    fn kick(&mut self, motions: &mut [Motion], h: f64) {
        for i in 0..self.swarm.place.len() {
            let change = self.force[i] * (h / self.swarm.matter_of(i).mass);
            self.swarm.velocity[i] += change;
        }
        for link in &self.links {
            motions[link.slot as usize].kick(h);
        }
        for index in 0..self.loads.len() {
            let load = &self.loads[index];
            if load.link != u32::MAX && load.press.push != Vec3::zeros() {
                let push = load.now(&self.swarm, motions, self.softened) * -h;
                self.push_link(index, &push, motions);
            }
        }
    }

    /// What holds links acts against all changes since the last time, as far as it can in this sub-step.
    fn hold(&mut self, motions: &mut [Motion]) {
        for HeldLink { slot, hold, held_at, left } in &mut self.links {
            let twist = &mut motions[*slot as usize].twist;
            let change = [twist.linear - held_at.linear, twist.angular - held_at.angular];
            let [linear, angular] = [0, 1].map(|part| {
                let direction = [&hold.linear, &hold.angular][part].try_normalize(0.0).unwrap_or_else(Vec3::zeros);
                let back = (-change[part].dot(&direction)).max(0.0).min(left[part]);
                left[part] -= back;
                direction * back
            });
            *twist = Twist { linear: twist.linear + linear, angular: twist.angular + angular };
            *held_at = *twist;
        }
    }

    /// Gives an impulse to the link of a load, where it presses.
    fn push_link(&mut self, load: usize, impulse: &Vec3, motions: &mut [Motion]) {
        let Load { link, arm, .. } = self.loads[load];
        let motion = &mut motions[link as usize];
        let mut wrench = Wrench::default();
        wrench.add_force_at(impulse, &(motion.rotation * arm));
        if motion.is_movable() {
            let change = motion.answer(&wrench);
            motion.twist.linear += change.linear;
            motion.twist.angular += change.angular;
        }
        self.carried[link as usize].add_scaled(&wrench, 1.0);
    }

    /// Friction and dissipation of loads, and the way out of where nobody may be.
    fn rub_loads(&mut self, motions: &mut [Motion], h: f64) {
        for index in 0..self.loads.len() {
            let load = &self.loads[index];
            let i = load.particle as usize;
            if let Some(way) = load.escape {
                (self.overloaded, self.forced) = (true, false);
                let n = way.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
                let velocity = self.anchor_velocity(load, motions);
                let into = (self.swarm.velocity[i] - velocity).dot(&n).min(0.0);
                let mass = self.swarm.matter_of(i).mass;
                self.swarm.place[i] += way;
                self.give(index, &(n * (-into * mass)), motions);
                continue;
            }
            let push = load.now(&self.swarm, motions, self.softened);
            let size = push.norm();
            if size <= 0.0 {
                continue;
            }
            let n = push / size;
            let relative = self.swarm.velocity[i] - self.anchor_velocity(load, motions);
            let away = relative.dot(&n);
            let reduced = self.reduced_mass(load, motions, &n);
            let material = self.material_of(load);
            // Dissipation makes the push p (1 - d v), which never pulls.
            let damped = -(material.dissipation * away * size).min(size);
            let most = away.abs() * reduced / h;
            let mut impulse = n * (damped.clamp(-most, most) * h);
            let slide = relative - n * away;
            let speed = slide.norm();
            if speed > 0.0 {
                let still = material.static_friction.max(material.friction);
                let grip =
                    if still * size * h >= speed * reduced { speed * reduced } else { material.friction * size * h };
                impulse -= slide
                    * ((grip + (material.viscous * load.press.area * speed * h).min(speed * reduced - grip)) / speed);
            }
            self.give(index, &impulse, motions);
        }
    }

    /// An impulse on the particle of a load, the opposite on what presses.
    fn give(&mut self, index: usize, impulse: &Vec3, motions: &mut [Motion]) {
        let load = &self.loads[index];
        let i = load.particle as usize;
        let mass = self.swarm.matter_of(i).mass;
        self.swarm.velocity[i] += impulse / mass;
        for (carrier, part) in &self.loads[index].carriers {
            let mass = self.swarm.matter_of(*carrier as usize).mass;
            self.swarm.velocity[*carrier as usize] -= impulse * (*part / mass);
        }
        if self.loads[index].link != u32::MAX {
            self.push_link(index, &-impulse, motions);
        }
    }

    fn reduced_mass(&self, load: &Load, motions: &[Motion], n: &Vec3) -> f64 {
        let mobility = match motions.get(load.link as usize) {
            Some(motion) => motion.mobility(&(motion.rotation * load.arm), n),
            None => {
                let parts = load.carriers.iter();
                parts.map(|(j, part)| part * part / self.swarm.matter_of(*j as usize).mass).sum()
            }
        };
        1.0 / (1.0 / self.swarm.matter_of(load.particle as usize).mass + mobility)
    }

    fn material_of(&self, load: &Load) -> Material {
        let kind = self.swarm.kind[load.particle as usize] as usize;
        match load.other {
            Other::Obstacle { number, .. } => {
                self.obstacles[number as usize].materials[kind].unwrap_or(self.swarm.matters[kind].material)
            }
            Other::Piece { .. } => self.swarm.matters[kind].material,
        }
    }

    fn anchor_velocity(&self, load: &Load, motions: &[Motion]) -> Vec3 {
        match motions.get(load.link as usize) {
            Some(motion) => motion.twist.at(&(motion.rotation * load.arm)),
            None => load.carriers.iter().map(|(j, part)| self.swarm.velocity[*j as usize] * *part).sum(),
        }
    }

    /// Integrates the loads that have moved, and finds neighbours again where these have.
    fn refresh(&mut self, motions: &[Motion], team: &Team) {
        let skin = 0.5 * SKIN * self.swarm.matters.iter().map(|m| m.profile.radius).fold(f64::INFINITY, f64::min);
        if self.swarm.has_strayed(&self.built_at, skin) || self.swarm.has_moved(&self.built_at, 2.0 * skin) {
            self.build(motions);
        }
        self.pairs.refresh(&self.swarm);
        self.place_obstacles(motions);
        let Self { swarm, obstacles, loads, near_skeletons, .. } = self;
        let (swarm, obstacles, near): (&Swarm, &[Obstacle], &[u32]) = (swarm, obstacles, near_skeletons);
        team.each_mut(loads, BLOCK, |_, load| {
            load.escape = None;
            load.fresh = load.is_stale(swarm, motions);
            if load.fresh {
                with_locale(|locale| load.integrate(swarm, obstacles, near, motions, locale));
            }
        });
        self.find_pressed();
    }

    /// Pairs of particles whose pieces meet under more than the substance's threshold.
    fn find_pressed(&mut self) {
        let Self { swarm, loads, pressed, .. } = self;
        for load in loads.iter().filter(|load| load.fresh) {
            let (i, (peak, place)) = (load.particle as usize, load.press.peak);
            let Other::Piece { label, nearest } = load.other else { continue };
            let same = swarm.kind[nearest as usize] == swarm.kind[i];
            if !same || peak <= swarm.matter_of(i).fusion_threshold || peak <= 0.0 {
                continue;
            }
            with_locale(|locale| {
                locale.gather(swarm, i, Some(label), &place, 0.0);
                let (mut own, mut others) = (Vec::new(), Vec::new());
                locale.owners_at(&place, |index, _| own.push(index));
                locale.others_at(&place, |index, _| others.push(index));
                for a in &own {
                    pressed.extend(others.iter().map(|b| [*a.min(b), *a.max(b)]));
                }
            });
        }
        pressed.sort_unstable();
        pressed.dedup();
    }
}
