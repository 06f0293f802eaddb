//! What a step reports: contacts, events, counters.

use std::mem::offset_of;

use libc::size_t;

use super::descriptor::{self, Descriptor, OutStruct};
use super::guard::{free, isocoat_world, read};
use super::handle::{isocoat_body, isocoat_link, isocoat_skeleton};
use super::piece::Changes;
use super::pointer::Out;
use super::status::isocoat_status;
use super::world::{isocoat_scheme, scheme_to_c};
use crate::world::{Contact, Counters, Event, EventKind, Times, World};

/// One connected piece of contact surface between two coats.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C)]
pub struct isocoat_contact {
    /// The first body.
    pub body_a: isocoat_body,
    /// The second body.
    pub body_b: isocoat_body,
    /// The link of the first body whose field is the highest at the deepest point; null where that is a substance.
    pub link_a: isocoat_link,
    /// The same of the second.
    pub link_b: isocoat_link,
    /// The skeleton of the first body whose territory holds the deepest point; null on both sides where one of them is
    /// a substance.
    pub skeleton_a: isocoat_skeleton,
    /// The same of the second.
    pub skeleton_b: isocoat_skeleton,
    /// Centre of pressure, in m.
    pub position: [f64; 3],
    /// Mean normal, from a to b.
    pub normal: [f64; 3],
    /// Force on b of pressure and dissipation, in N; a has the opposite. Friction is in the wrenches of links only.
    pub force: [f64; 3],
    /// Torque on b about position, in N m; a has the opposite.
    pub torque: [f64; 3],
    /// Area of the surface, in m^2.
    pub area: f64,
    /// Highest pressure, in Pa.
    pub peak_pressure: f64,
    /// Normal stiffness, in N/m: the integral of g_a g_b / (g_a + g_b) over the surface.
    pub stiffness: f64,
    /// Estimated relative error of the elastic force.
    pub error_estimate: f64,
    /// How often the two fields were evaluated.
    pub evaluations: u32,
    /// The scheme that integrated it.
    pub scheme: isocoat_scheme,
    /// 1 if the load is past the most that this contact can carry, else 0. The push-out that parts the two then is a
    /// contact of its own, with an area, a peak_pressure and a stiffness of 0 and an error_estimate of 1.
    pub overloaded: u32,
    /// 0.
    pub reserved: u32,
}

impl From<&Contact> for isocoat_contact {
    fn from(contact: &Contact) -> Self {
        Self {
            body_a: contact.bodies[0].into(),
            body_b: contact.bodies[1].into(),
            link_a: contact.links[0].into(),
            link_b: contact.links[1].into(),
            skeleton_a: contact.skeletons[0].into(),
            skeleton_b: contact.skeletons[1].into(),
            position: contact.position.into(),
            normal: contact.normal.into(),
            force: contact.force.into(),
            torque: contact.torque.into(),
            area: contact.area,
            peak_pressure: contact.peak_pressure,
            stiffness: contact.stiffness,
            error_estimate: contact.error_estimate,
            evaluations: contact.evaluations,
            scheme: scheme_to_c(contact.scheme),
            overloaded: contact.overloaded.into(),
            reserved: 0,
        }
    }
}

/// What happened to a pair of bodies: an ISOCOAT_EVENT_ value. More may come.
pub type isocoat_event_kind = u32;
/// The coats began to touch. Of a body with itself, whose events name it twice, there is one for each pair of groups of
/// its parts: count them.
pub const ISOCOAT_EVENT_BEGIN: isocoat_event_kind = 0;
/// The coats stopped touching.
pub const ISOCOAT_EVENT_END: isocoat_event_kind = 1;
/// The contact went past the most it can carry.
pub const ISOCOAT_EVENT_OVERLOAD: isocoat_event_kind = 2;

/// A change between two bodies in the last step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct isocoat_event {
    /// What happened.
    pub kind: isocoat_event_kind,
    /// 0.
    pub reserved: u32,
    /// The first body; it may have been destroyed since.
    pub body_a: isocoat_body,
    /// The second body; it may have been destroyed since.
    pub body_b: isocoat_body,
}

impl From<&Event> for isocoat_event {
    fn from(event: &Event) -> Self {
        Self {
            kind: match event.kind {
                EventKind::Begin => ISOCOAT_EVENT_BEGIN,
                EventKind::End => ISOCOAT_EVENT_END,
                EventKind::Overload => ISOCOAT_EVENT_OVERLOAD,
            },
            reserved: 0,
            body_a: event.bodies[0].into(),
            body_b: event.bodies[1].into(),
        }
    }
}

/// What the views of a world point to; refreshed by a step, in memory that is kept.
#[derive(Default)]
pub(super) struct Views {
    contacts: Vec<isocoat_contact>,
    events: Vec<isocoat_event>,
    changes: Changes,
    /// The revision of the contacts at rest that are at the front.
    resting: u64,
}

impl Views {
    pub fn refresh(&mut self, world: &World) {
        // Contacts at rest stay where they are.
        let (resting, revision) = world.resting_contacts();
        let kept = if std::mem::replace(&mut self.resting, revision) == revision { resting } else { 0 };
        self.contacts.truncate(kept);
        self.contacts.extend(world.contacts()[kept..].iter().map(isocoat_contact::from));
        self.events.clear();
        self.events.extend(world.events().iter().map(isocoat_event::from));
        self.changes.clear();
        for body in world.bodies() {
            let changes = world.substance_changes(body).unwrap_or_default();
            changes.iter().for_each(|change| self.changes.push(body, change));
        }
    }

    pub fn changes(&self) -> &Changes {
        &self.changes
    }
}

/// Figures of the last step. Begin with isocoat_counters_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_counters {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// Live bodies.
    pub bodies: u32,
    /// Live links.
    pub links: u32,
    /// Live skeletons.
    pub skeletons: u32,
    /// Pairs of bodies whose bounds met.
    pub pairs: u32,
    /// Groups of bodies that were stepped together.
    pub islands: u32,
    /// Sub-steps of the group that took the most, of those that were not solved implicitly.
    pub substeps: u32,
    /// Pieces of contact surface at the end of the step, and push-outs: as many as there are contacts.
    pub patches: u32,
    /// Evaluations of a pair of fields. Contacts at rest need none: their surfaces stand from the last step.
    pub evaluations: u64,
    /// Rounds of the implicitly solved group that took the most, with those of all parts of a split step.
    pub implicit_rounds: u32,
    /// Splits of the implicitly solved group that took the most.
    pub implicit_splits: u32,
    /// Evaluations of a pair of fields by each scheme, at its ISOCOAT_SCHEME_ value; at ISOCOAT_SCHEME_AUTO those of
    /// searches that found no patch. The rest is 0.
    pub evaluations_by_scheme: [u64; 8],
    /// Pieces of contact surface that each scheme integrated, in all rounds and sub-steps; likewise.
    pub patches_by_scheme: [u64; 8],
    /// Bodies asleep.
    pub asleep: u32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: `repr(C)`, the size first, integers only.
unsafe impl Descriptor for isocoat_counters {
    const NAME: &'static str = "isocoat_counters";
    const FIRST_SIZE: usize = offset_of!(Self, evaluations) + size_of::<u64>();

    fn defaults() -> Self {
        Self::from(Counters::default())
    }
}

impl From<Counters> for isocoat_counters {
    fn from(counters: Counters) -> Self {
        Self {
            struct_size: 0,
            bodies: counters.bodies,
            links: counters.links,
            skeletons: counters.skeletons,
            pairs: counters.pairs,
            islands: counters.islands,
            substeps: counters.substeps,
            patches: counters.patches,
            evaluations: counters.evaluations,
            implicit_rounds: counters.implicit_rounds,
            implicit_splits: counters.implicit_splits,
            evaluations_by_scheme: by_scheme(&counters.by_scheme.evaluations),
            patches_by_scheme: by_scheme(&counters.by_scheme.patches),
            asleep: counters.asleep,
            reserved: 0,
        }
    }
}

fn by_scheme(counts: &[u64]) -> [u64; 8] {
    std::array::from_fn(|scheme| counts.get(scheme).copied().unwrap_or(0))
}

/// Where the time of the last step went, in s; zero unless isocoat_world_desc::timed asked for it. Begin with
/// isocoat_times_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_times {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// 0.
    pub reserved: u32,
    /// The whole step.
    pub step: f64,
    /// Taking over states, forces and impulses.
    pub begin: f64,
    /// Broad phase: pairs whose bounds meet, with the filter; what of their coats can matter.
    pub pairs: f64,
    /// Groups of bodies that are stepped together.
    pub islands: f64,
    /// Forces and motion.
    pub respond: f64,
    /// Of that, contact surfaces; added up over workers where groups are stepped side by side.
    pub contact: f64,
    /// Of that, what follows from the surfaces: systems, velocities, friction; added up likewise.
    pub solve: f64,
    /// Handing back poses and impulses, contacts and events; falling asleep.
    pub report: f64,
    /// Particles of substances, and the volumes of their coats.
    pub substances: f64,
}

// SAFETY: `repr(C)`, the size first, integers and doubles only.
unsafe impl Descriptor for isocoat_times {
    const NAME: &'static str = "isocoat_times";
    const FIRST_SIZE: usize = offset_of!(Self, report) + size_of::<f64>();

    fn defaults() -> Self {
        Self::from(Times::default())
    }
}

impl From<Times> for isocoat_times {
    fn from(times: Times) -> Self {
        let Times { step, begin, pairs, islands, substances, respond, contact, solve, report } = times;
        Self { struct_size: 0, reserved: 0, step, begin, pairs, islands, respond, contact, solve, report, substances }
    }
}

/// Fills times with zeros and their size; isocoat_times_default() calls it.
///
/// - times: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_times) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_times_init(times: *mut isocoat_times, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(times, size, "times") })
}

/// Where the time of the last step went.
///
/// - world: not NULL.
/// - times: receives it; not NULL, with struct_size set.
///
/// Errors: INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_times(
    world: *const isocoat_world,
    times: *mut isocoat_times,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = OutStruct::new(times, "times")?;
            out.put(&inner.world.times().into());
            Ok(())
        })
    }
}

/// Fills counters with zeros and their size; isocoat_counters_default() calls it.
///
/// - counters: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_counters) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_counters_init(counters: *mut isocoat_counters, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(counters, size, "counters") })
}

/// The contacts of the last step; of a sub-stepped one, as they were in its last sub-step; of bodies asleep, as they
/// were when these fell asleep. The last come first.
///
/// - world: not NULL.
/// - contacts: receives a pointer to them (not to be freed); not NULL.
/// - count: receives their number; not NULL.
///
/// Errors: INVALID_ARGUMENT. Threads: reads the world. Lifetime: until the next step, restore or destroy
/// of the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_contacts(
    world: *const isocoat_world,
    contacts: *mut *const isocoat_contact,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let (first, length) = (Out::new(contacts, "contacts")?, Out::new(count, "count")?);
            first.put(inner.views.contacts.as_ptr());
            length.put(inner.views.contacts.len());
            Ok(())
        })
    }
}

/// What began, ended or was overloaded in the last step.
///
/// - world: not NULL.
/// - events: receives a pointer to them (not to be freed); not NULL.
/// - count: receives their number; not NULL.
///
/// Errors: INVALID_ARGUMENT. Threads: reads the world. Lifetime: until the next step, restore or destroy
/// of the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_events(
    world: *const isocoat_world,
    events: *mut *const isocoat_event,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let (first, length) = (Out::new(events, "events")?, Out::new(count, "count")?);
            first.put(inner.views.events.as_ptr());
            length.put(inner.views.events.len());
            Ok(())
        })
    }
}

/// Figures of the last step, and how many objects live now.
///
/// - world: not NULL.
/// - counters: receives them; not NULL, with struct_size set.
///
/// Errors: INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_counters(
    world: *const isocoat_world,
    counters: *mut isocoat_counters,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = OutStruct::new(counters, "counters")?;
            out.put(&inner.world.counters().into());
            Ok(())
        })
    }
}
