//! A scene as it is stepped: what can be set in it, its bodies, a run and its errors.

use isocoat::base::Kind;
use isocoat::field::Shape;
use isocoat::math::{Mat3, Pose, Vec3};
use isocoat::world::{BodyDesc, BodyId, Contact, LinkDesc, LinkId, LinkState, Response, Scheme, World, WorldDesc};

use super::clock::cpu_seconds;
use super::common::Coat;

/// Time between two looks at a scene, whatever the steps in between \[s\].
pub const FRAME: f64 = 1.0 / 60.0;
pub const RADIUS: f64 = 0.1;
pub const MASS: f64 = 1.0;

/// A point of the grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    pub scheme: Scheme,
    pub tolerance: f64,
    pub seeds: u32,
    pub response: Response,
    /// World steps in a frame.
    pub steps: u32,
    pub phase: f64,
    pub most_substeps: u32,
    pub rounds: u32,
    pub round_tolerance: f64,
    pub splits: u32,
}

impl Default for Settings {
    fn default() -> Self {
        let desc = WorldDesc::default();
        Settings {
            scheme: desc.scheme,
            tolerance: desc.force_tolerance,
            seeds: desc.seed_count,
            response: desc.response,
            steps: 1,
            phase: desc.substep_phase,
            most_substeps: desc.max_substeps,
            rounds: desc.implicit_rounds,
            round_tolerance: desc.implicit_tolerance,
            splits: desc.implicit_splits,
        }
    }
}

impl Settings {
    fn world(&self, gravity: f64) -> World {
        World::new(WorldDesc {
            gravity: Vec3::new(0.0, 0.0, -gravity),
            scheme: self.scheme,
            force_tolerance: self.tolerance,
            seed_count: self.seeds,
            response: self.response,
            substep_phase: self.phase,
            max_substeps: self.most_substeps,
            implicit_rounds: self.rounds,
            implicit_tolerance: self.round_tolerance,
            implicit_splits: self.splits,
            ..WorldDesc::default()
        })
        .unwrap()
    }

    /// How the contact surface is integrated, in words.
    pub fn integration(&self) -> String {
        match self.scheme {
            Scheme::Seeds => format!("{} seeds", self.seeds),
            Scheme::Auto => format!("scheme automatic, tolerance {:.0e}", self.tolerance),
            scheme => format!("{}, tolerance {:.0e}", scheme_name(scheme), self.tolerance),
        }
    }

    /// How the forces act in time, in words.
    pub fn stepping(&self) -> String {
        let steps = if self.steps == 1 { String::new() } else { format!(", {} steps a frame", self.steps) };
        match self.response {
            Response::Explicit => format!("explicit{steps}"),
            Response::Substepped => format!("sub-steps, phase {}{steps}", self.phase),
            Response::Implicit => {
                format!("implicit, tolerance {}, {} rounds{steps}", self.round_tolerance, self.rounds)
            }
            Response::Auto => format!("response automatic{steps}"),
        }
    }
}

/// A scheme as the tables call it.
pub fn scheme_name(scheme: Scheme) -> &'static str {
    match scheme {
        Scheme::Auto => "automatic",
        Scheme::ClosedForm => "closed form",
        Scheme::Facets => "facets",
        Scheme::Polar => "polar",
        Scheme::Adaptive => "adaptive",
        Scheme::Seeds => "seeds",
    }
}

/// A link that the library moves.
struct Mover {
    link: LinkId,
    body: BodyId,
    mass: f64,
    inertia: Mat3,
}

/// A scene that can be stepped.
pub struct Sim {
    world: World,
    /// All bodies; what moves has its mover.
    bodies: Vec<BodyId>,
    movers: Vec<Mover>,
    gravity: f64,
}

impl Sim {
    pub fn new(settings: &Settings, gravity: f64) -> Self {
        Sim { world: settings.world(gravity), bodies: Vec::new(), movers: Vec::new(), gravity }
    }

    pub fn fix(&mut self, coat: &Coat, body: BodyDesc, at: Pose) {
        let fixed = LinkDesc { pose: at, ..LinkDesc::default() };
        self.bodies.push(coat.add(&mut self.world, body, fixed).0);
    }

    /// A half-space on the side of `point` that `normal` leaves.
    pub fn wall(&mut self, point: Vec3, normal: Vec3, body: &BodyDesc) {
        let coat = Coat::new(&[Shape::Plane { point: point - normal * RADIUS, normal }], RADIUS);
        self.fix(&coat, BodyDesc { rigid: true, ..body.clone() }, Pose::default());
    }

    pub fn add(&mut self, coat: &Coat, body: BodyDesc, inertia: Mat3, state: LinkState) {
        let LinkState { pose, twist } = state;
        let desc = LinkDesc { kind: Kind::Rigid, mass: MASS, inertia, pose, twist, ..LinkDesc::default() };
        let (body, link) = coat.add(&mut self.world, body, desc);
        self.bodies.push(body);
        self.movers.push(Mover { link, body, mass: MASS, inertia });
    }

    pub fn step(&mut self, dt: f64) -> isocoat::Result<()> {
        self.world.step(dt)
    }

    pub fn states(&self) -> Vec<LinkState> {
        self.movers.iter().map(|mover| self.world.link_state(mover.link).unwrap()).collect()
    }

    pub fn place(&mut self, states: &[LinkState]) {
        for (mover, state) in self.movers.iter().zip(states) {
            self.world.set_link_state(mover.link, state).unwrap();
        }
    }

    /// Pairs of bodies of which one moves, as places in `bodies`.
    pub fn pairs(&self) -> Vec<[usize; 2]> {
        let count = self.bodies.len();
        let all = (0..count).flat_map(|a| (a + 1..count).map(move |b| [a, b]));
        all.filter(|[a, b]| self.mover(*a).is_some() || self.mover(*b).is_some()).collect()
    }

    fn mover(&self, body: usize) -> Option<&Mover> {
        self.movers.iter().find(|mover| mover.body == self.bodies[body])
    }

    /// The contacts of a pair.
    pub fn collide(&self, pair: [usize; 2], scheme: Scheme, tolerance: f64) -> Vec<Contact> {
        self.world.collide(self.bodies[pair[0]], self.bodies[pair[1]], scheme, tolerance).unwrap()
    }

    /// Force and torque on the second body of a pair, the torque about its link's origin.
    pub fn wrench(&self, pair: [usize; 2], scheme: Scheme, tolerance: f64) -> (Vec3, Vec3) {
        let about = self.center(self.bodies[pair[1]]);
        let contacts = self.collide(pair, scheme, tolerance);
        let force = contacts.iter().map(|contact| contact.force).sum();
        let torque = |c: &Contact| (c.position - about).cross(&c.force) + c.torque;
        (force, contacts.iter().map(torque).sum())
    }

    fn center(&self, body: BodyId) -> Vec3 {
        let link = self.world.body_links(body).unwrap().next().unwrap();
        self.world.link_desc(link).unwrap().pose.position
    }

    /// Kinetic energy, that of height, and that in the coats.
    pub fn energy(&mut self) -> f64 {
        let states = self.states();
        let moving: f64 = self
            .movers
            .iter()
            .zip(&states)
            .map(|(mover, LinkState { pose, twist })| {
                let spin = pose.rotation.inverse() * twist.angular;
                let speed = twist.linear.norm_squared();
                0.5 * (mover.mass * speed + spin.dot(&(mover.inertia * spin)))
                    + mover.mass * self.gravity * pose.position.z
            })
            .sum();
        moving + self.pairs().into_iter().map(|pair| self.elastic_energy(pair)).sum::<f64>()
    }

    /// The work that two bodies give back when one is drawn off along the force between them.
    fn elastic_energy(&mut self, pair: [usize; 2]) -> f64 {
        const TOLERANCE: f64 = 1e-5;
        // Gauss-Legendre on [0, 1].
        const GAUSS: [(f64, f64); 4] = [
            (0.069_431_844_202_973_71, 0.173_927_422_568_726_93),
            (0.330_009_478_207_571_87, 0.326_072_577_431_273_07),
            (0.669_990_521_792_428_1, 0.326_072_577_431_273_07),
            (0.930_568_155_797_026_3, 0.173_927_422_568_726_93),
        ];
        let force = self.wrench(pair, Scheme::Auto, TOLERANCE).0;
        if force.norm() == 0.0 {
            return 0.0;
        }
        let (link, direction) = match (self.mover(pair[1]), self.mover(pair[0])) {
            (Some(second), _) => (second.link, force.normalize()),
            (None, first) => (first.unwrap().link, -force.normalize()),
        };
        let start = self.world.link_state(link).unwrap();
        let mut at = |s: f64| {
            let position = start.pose.position + direction * s;
            let state = LinkState { pose: Pose { position, ..start.pose }, ..start };
            self.world.set_link_state(link, &state).unwrap();
            self.wrench(pair, Scheme::Auto, TOLERANCE).0.dot(&force.normalize())
        };
        let (mut touching, mut apart) = (0.0, 4.0 * RADIUS);
        for _ in 0..40 {
            let middle = 0.5 * (touching + apart);
            *(if at(middle) > 0.0 { &mut touching } else { &mut apart }) = middle;
        }
        const PANELS: u32 = 3;
        let panel = touching / f64::from(PANELS);
        let work = (0..PANELS).flat_map(|i| GAUSS.map(|(x, w)| (f64::from(i) + x, w)));
        let work = work.map(|(x, w)| at(x * panel) * w * panel).sum();
        self.world.set_link_state(link, &start).unwrap();
        work
    }
}

/// A scene: how to build it, what is compared, and over which time.
pub struct Scene {
    pub name: &'static str,
    /// One word, for the data files.
    pub key: &'static str,
    pub build: fn(&Settings, &[LinkState]) -> Sim,
    /// Where its links are to start, if the scene does not say it itself.
    pub start: Vec<LinkState>,
    pub seconds: f64,
    /// Up to here paths are compared: later small differences have grown large by themselves \[s\].
    pub horizon: f64,
    /// Steps a frame and tolerance of its reference.
    pub reference: (u32, f64),
    /// The energy that the errors of energy are parts of \[J\].
    pub energy: f64,
    /// Heights at which the links rest, and the sink that errors are parts of \[m\].
    pub rest: Option<(Vec<f64>, f64)>,
}

/// What a run left behind.
pub struct Record {
    /// State of the links at the start and after each frame.
    pub frames: Vec<Vec<LinkState>>,
    /// Processor time a frame \[s\].
    pub time: f64,
}

/// Errors of a run; none where a scene has no such thing.
#[derive(Clone, Copy, Debug)]
pub struct Errors {
    /// Largest distance from the reference's path, over the radius.
    pub path: f64,
    /// Largest difference of energy to the reference's, over the scene's.
    pub energy: f64,
    /// Highest gain over the energy at the start, over the scene's.
    pub gain: f64,
    /// Distance from the height of rest at the end, over the sink.
    pub rest: Option<f64>,
}

impl Scene {
    pub fn sim(&self, settings: &Settings) -> Sim {
        (self.build)(settings, &self.start)
    }

    /// Steps the scene to its end; none if that takes more than `budget` of processor time a frame \[s\]. A short run
    /// is done some times over, for the median of its times.
    pub fn run(&self, settings: &Settings, budget: f64) -> Option<Record> {
        let mut record = self.run_once(settings, budget)?;
        if record.time * (record.frames.len() as f64) < 0.02 {
            let again = (0..4).filter_map(|_| self.run_once(settings, budget));
            let mut times: Vec<f64> = again.map(|run| run.time).chain([record.time]).collect();
            times.sort_by(f64::total_cmp);
            record.time = times[times.len() / 2];
        }
        Some(record)
    }

    fn run_once(&self, settings: &Settings, budget: f64) -> Option<Record> {
        let mut sim = self.sim(settings);
        let mut frames = vec![sim.states()];
        let count = (self.seconds / FRAME).round() as usize;
        let begin = cpu_seconds();
        for _ in 0..count {
            for _ in 0..settings.steps {
                // A run that leaves all numbers behind ends there.
                if sim.step(FRAME / f64::from(settings.steps)).is_err() {
                    break;
                }
            }
            frames.push(sim.states());
            // Soon enough it shows how long it would take.
            let done = frames.len() - 1;
            if done >= 5 && cpu_seconds() - begin > budget * done as f64 {
                return None;
            }
        }
        Some(Record { frames, time: (cpu_seconds() - begin) / count as f64 })
    }

    fn frames_compared(&self) -> usize {
        (self.horizon / FRAME).round() as usize
    }

    /// Energies of a record within the horizon, every fourth frame.
    pub fn energies(&self, record: &Record) -> Vec<f64> {
        let mut probe = self.sim(&Settings::default());
        let mut energy = |states: &Vec<LinkState>| {
            // What has flown off has no contact to ask for.
            if states.iter().any(|state| !(state.pose.position.norm() < 1e6 && state.twist.linear.norm() < 1e6)) {
                return f64::INFINITY;
            }
            probe.place(states);
            probe.energy()
        };
        record.frames[..=self.frames_compared()].iter().step_by(4).map(&mut energy).collect()
    }

    pub fn errors(&self, record: &Record, reference: &Record, reference_energies: &[f64]) -> Errors {
        let distance = |(x, y): (&LinkState, &LinkState)| {
            let turn = RADIUS * x.pose.rotation.angle_to(&y.pose.rotation);
            (x.pose.position - y.pose.position).norm_squared() + turn * turn
        };
        let apart = |(a, b): (&Vec<LinkState>, &Vec<LinkState>)| {
            (a.iter().zip(b).map(distance).sum::<f64>() / a.len() as f64).sqrt() / RADIUS
        };
        let compared = self.frames_compared();
        let most = |values: &mut dyn Iterator<Item = f64>| {
            values.fold(0.0, |most: f64, x| if x.is_nan() { f64::INFINITY } else { most.max(x) })
        };
        let energies = self.energies(record);
        let off = |(x, y): (&f64, &f64)| (x - y).abs() / self.energy;
        let rest = self.rest.as_ref().map(|(heights, sink)| {
            let last = record.frames.last().unwrap();
            let off = |(state, height): (&LinkState, &f64)| (state.pose.position.z - height).powi(2);
            let sum: f64 = last.iter().zip(heights).map(off).sum();
            (sum / heights.len() as f64).sqrt() / sink
        });
        Errors {
            path: most(&mut record.frames[..=compared].iter().zip(&reference.frames[..=compared]).map(apart)),
            energy: most(&mut energies.iter().zip(reference_energies).map(off)),
            gain: most(&mut energies.iter().map(|x| (x - energies[0]) / self.energy)),
            rest,
        }
    }
}
