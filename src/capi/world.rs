//! Worlds: life, settings, step, callbacks.

use std::mem::offset_of;

use libc::{c_char, c_void, size_t};

use super::descriptor::{self, Descriptor, OutStruct};
use super::guard::{self, free, isocoat_world, outside, read, write};
use super::handle::isocoat_body;
use super::pointer::{Context, List, Out};
use super::status::{Checked, Refusal, isocoat_status};
use crate::world::{BodyId, LogLevel, Response, Scheme, World, WorldDesc};

/// How contact forces act on the links in time: an ISOCOAT_RESPONSE_ value.
pub type isocoat_response = u32;
/// The library chooses for each group of bodies in contact: ISOCOAT_RESPONSE_IMPLICIT for what is constrained, held by
/// its host, stacked, or on stiff springs, ISOCOAT_RESPONSE_SUBSTEPPED for the rest.
pub const ISOCOAT_RESPONSE_AUTO: isocoat_response = 0;
/// One evaluation of the forces a step, at its beginning: for small steps only. Overloads are stepped implicitly.
pub const ISOCOAT_RESPONSE_EXPLICIT: isocoat_response = 1;
/// Velocities and forces of all links in contact that agree at the end of the step: stable at any stiffness and mass,
/// exact at rest; contacts do not bounce. Momentum is kept; angular momentum changes by dt times the cross product of
/// the speed at which two bodies leave each other and their impulse, which matters for oblique blows in free flight.
pub const ISOCOAT_RESPONSE_IMPLICIT: isocoat_response = 2;
/// Many small steps inside each step; host-driven links through a mirror that lasts from step to step. What is pressed
/// past the most that its coats carry, or asks for more than max_substeps, is stepped implicitly all the same.
pub const ISOCOAT_RESPONSE_SUBSTEPPED: isocoat_response = 3;

/// How a contact surface is integrated: an ISOCOAT_SCHEME_ value.
pub type isocoat_scheme = u32;
/// The cheapest that meets the tolerance.
pub const ISOCOAT_SCHEME_AUTO: isocoat_scheme = 0;
/// Closed form; pairs without one as ISOCOAT_SCHEME_AUTO.
pub const ISOCOAT_SCHEME_CLOSED_FORM: isocoat_scheme = 1;
/// A polar Gauss patch round the deepest point.
pub const ISOCOAT_SCHEME_POLAR: isocoat_scheme = 2;
/// Subdivision that adapts to the border of the contact.
pub const ISOCOAT_SCHEME_ADAPTIVE: isocoat_scheme = 3;
/// Seeds on the surfaces, as in the papers.
pub const ISOCOAT_SCHEME_SEEDS: isocoat_scheme = 4;
/// Flat faces and straight edges, with their rounded surroundings; pairs without them as ISOCOAT_SCHEME_AUTO.
pub const ISOCOAT_SCHEME_FACETS: isocoat_scheme = 5;

/// How much a message matters: an ISOCOAT_LOG_ value. More may come.
pub type isocoat_log_level = u32;
/// Worth knowing.
pub const ISOCOAT_LOG_INFO: isocoat_log_level = 0;
/// The scene cannot do what it seems to be meant to.
pub const ISOCOAT_LOG_WARNING: isocoat_log_level = 1;

/// Settings of a world. Begin with isocoat_world_desc_default().
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct isocoat_world_desc {
    /// Size of this struct in bytes, as the host knows it.
    pub struct_size: u32,
    /// How contact forces act in time. Default ISOCOAT_RESPONSE_AUTO.
    /// Advice (all of it measured in docs/trade.md): what need not bounce, implicit: a cube that lands on a floor takes
    /// a thirtieth of the time of sub-steps, never gains energy, and its path is off by 7% of half its side, not 0.6%.
    pub response: isocoat_response,
    /// How contact surfaces are integrated. Default ISOCOAT_SCHEME_AUTO.
    /// Advice: leave it. A force within 1% takes 2 us between balls (polar 6, adaptive 250, seeds 450) and 22 us under a
    /// cube (polar 360, adaptive 840).
    pub scheme: isocoat_scheme,
    /// Seeds of a skeleton that does not say its own number: from 4 to 65536. Default 64.
    /// Advice: it matters for ISOCOAT_SCHEME_SEEDS, and where a surface wraps round. Two balls' force is off by 36% with
    /// 256, 3% with 1024, 0.3% with 4096; the time goes with the number.
    pub seed_count: u32,
    /// Upper bound of the sub-steps in one step: from 1 to 65536. Default 4096.
    /// Advice: a bound for the worst case, not for speed. Where more are wanted, the step is implicit; the log says
    /// so if sub-steps were forced: with 16 instead of 64 two balls at 60 Hz no longer bounce.
    pub max_substeps: u32,
    /// Acceleration of gravity, in m/s^2, finite. Default 0.
    pub gravity: [f64; 3],
    /// Relative error accepted in a contact force: from 1e-9 to 0.5. Default 5e-3.
    /// Advice: 5e-2 saves a quarter of the time of blended coats or faces, and takes the path of two dumbbells from 0.2%
    /// off to 2%; 5e-4 takes twice the time, to 0.04%. Between balls it changes nothing: their closed form is exact.
    pub force_tolerance: f64,
    /// Largest product of contact frequency and sub-step, in rad: from 0.01 to 1. Default 0.2.
    /// Advice: half of it takes up to twice the time for about a third of the error: the path of a ball that bounces is
    /// off by 5% of the radius at 0.4, 0.9% at 0.2, 0.3% at 0.1; 1 still does for a cube that lands, at 2%.
    pub substep_phase: f64,
    /// Implicit response: motion of a contact between two rounds, over its depth, that ends them: from 1e-9 to 1.
    /// Default 0.05.
    /// Advice: leave it. From 0.5 to 5e-4 ten balls in a box take 15% more time, and their path and rest stay the same.
    pub implicit_tolerance: f64,
    /// Implicit response: most evaluations of a contact surface before the step is split: from 1 to 64. Default 8.
    /// Advice: 4 or more. With 2, steps are split instead and ten balls in a box take half as long again; with 1, ten
    /// times as long or more.
    pub implicit_rounds: u32,
    /// Implicit response: how often a step that does not converge may be split in two: from 0 to 10. Default 4.
    /// Advice: leave it. It costs nothing where steps converge, as in all five scenes of docs/trade.md.
    pub implicit_splits: u32,
    /// Time for which a group of bodies must be at rest before it falls asleep, in s: at least 0; 0 is never. Default 0.
    pub sleep_time: f64,
    /// Speed up to which a body counts as at rest, in thicknesses of its thinnest coat a second: from 0 to 1e6.
    /// Default 0.01.
    pub sleep_speed: f64,
    /// 1 for steps that read the clock for isocoat_world_get_times(), else 0. Default 0.
    pub timed: u32,
    /// 0.
    pub reserved: u32,
}

// SAFETY: `repr(C)`, the size first, integers and doubles only.
unsafe impl Descriptor for isocoat_world_desc {
    const NAME: &'static str = "isocoat_world_desc";
    const FIRST_SIZE: usize = offset_of!(Self, substep_phase) + size_of::<f64>();

    fn defaults() -> Self {
        Self::from(&WorldDesc::default())
    }
}

impl From<&WorldDesc> for isocoat_world_desc {
    fn from(desc: &WorldDesc) -> Self {
        Self {
            struct_size: 0,
            response: response_to_c(desc.response),
            scheme: scheme_to_c(desc.scheme),
            seed_count: desc.seed_count,
            max_substeps: desc.max_substeps,
            gravity: desc.gravity.into(),
            force_tolerance: desc.force_tolerance,
            substep_phase: desc.substep_phase,
            implicit_tolerance: desc.implicit_tolerance,
            implicit_rounds: desc.implicit_rounds,
            implicit_splits: desc.implicit_splits,
            sleep_time: desc.sleep_time,
            sleep_speed: desc.sleep_speed,
            timed: desc.timed.into(),
            reserved: 0,
        }
    }
}

impl isocoat_world_desc {
    fn to_rust(self) -> Checked<WorldDesc> {
        check_reserved(self.reserved)?;
        Ok(WorldDesc {
            gravity: self.gravity.into(),
            response: response_from_c(self.response)?,
            scheme: scheme_from_c(self.scheme)?,
            force_tolerance: self.force_tolerance,
            seed_count: self.seed_count,
            max_substeps: self.max_substeps,
            substep_phase: self.substep_phase,
            implicit_tolerance: self.implicit_tolerance,
            implicit_rounds: self.implicit_rounds,
            implicit_splits: self.implicit_splits,
            sleep_time: self.sleep_time,
            sleep_speed: self.sleep_speed,
            timed: flag("timed", self.timed)?,
        })
    }
}

pub(super) fn response_to_c(response: Response) -> isocoat_response {
    match response {
        Response::Auto => ISOCOAT_RESPONSE_AUTO,
        Response::Explicit => ISOCOAT_RESPONSE_EXPLICIT,
        Response::Implicit => ISOCOAT_RESPONSE_IMPLICIT,
        Response::Substepped => ISOCOAT_RESPONSE_SUBSTEPPED,
    }
}

pub(super) fn response_from_c(value: isocoat_response) -> Checked<Response> {
    Ok(match value {
        ISOCOAT_RESPONSE_AUTO => Response::Auto,
        ISOCOAT_RESPONSE_EXPLICIT => Response::Explicit,
        ISOCOAT_RESPONSE_IMPLICIT => Response::Implicit,
        ISOCOAT_RESPONSE_SUBSTEPPED => Response::Substepped,
        other => return Err(unknown("response", other, "ISOCOAT_RESPONSE_", 3)),
    })
}

/// A number that says yes or no.
pub(super) fn flag(name: &str, value: u32) -> Checked<bool> {
    match value {
        0 => Ok(false),
        1 => Ok(true),
        other => Err(Refusal::argument(format!("{name} is {other}; must be 0 or 1"))),
    }
}

/// Refuses what a later version may give a meaning.
pub(super) fn check_reserved(value: u32) -> Checked<()> {
    if value == 0 { Ok(()) } else { Err(Refusal::argument(format!("reserved is {value}; must be 0"))) }
}

/// Refuses a value of an enum.
pub(super) fn unknown(name: &str, value: u32, prefix: &str, last: u32) -> Refusal {
    Refusal::argument(format!("{name} is {value}; must be one of {prefix}*, 0 to {last}"))
}

pub(super) fn scheme_to_c(scheme: Scheme) -> isocoat_scheme {
    match scheme {
        Scheme::Auto => ISOCOAT_SCHEME_AUTO,
        Scheme::ClosedForm => ISOCOAT_SCHEME_CLOSED_FORM,
        Scheme::Polar => ISOCOAT_SCHEME_POLAR,
        Scheme::Adaptive => ISOCOAT_SCHEME_ADAPTIVE,
        Scheme::Seeds => ISOCOAT_SCHEME_SEEDS,
        Scheme::Facets => ISOCOAT_SCHEME_FACETS,
    }
}

pub(super) fn scheme_from_c(scheme: isocoat_scheme) -> Checked<Scheme> {
    Ok(match scheme {
        ISOCOAT_SCHEME_AUTO => Scheme::Auto,
        ISOCOAT_SCHEME_CLOSED_FORM => Scheme::ClosedForm,
        ISOCOAT_SCHEME_POLAR => Scheme::Polar,
        ISOCOAT_SCHEME_ADAPTIVE => Scheme::Adaptive,
        ISOCOAT_SCHEME_SEEDS => Scheme::Seeds,
        ISOCOAT_SCHEME_FACETS => Scheme::Facets,
        other => return Err(unknown("scheme", other, "ISOCOAT_SCHEME_", 5)),
    })
}

/// Fills a descriptor with its defaults; isocoat_world_desc_default() calls it.
///
/// - desc: receives at most size bytes, its struct_size among them; not NULL.
/// - size: sizeof(isocoat_world_desc) as the host was compiled.
///
/// Errors: INVALID_ARGUMENT. Threads: any.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_desc_init(desc: *mut isocoat_world_desc, size: size_t) -> isocoat_status {
    // SAFETY: the host gives `size` bytes.
    free(|| unsafe { descriptor::init(desc, size, "desc") })
}

/// Creates an empty world.
///
/// - desc: settings; not NULL.
/// - world: receives the world; not NULL. Destroy it with isocoat_world_destroy.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: any.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_create(
    desc: *const isocoat_world_desc,
    world: *mut *mut isocoat_world,
) -> isocoat_status {
    free(|| {
        // SAFETY: both are NULL or as their lines say.
        let (desc, out) = unsafe { (descriptor::read(desc, "desc")?, Out::new(world, "world")?) };
        let world = World::new(desc.to_rust()?)?;
        out.put(Box::into_raw(Box::new(isocoat_world::new(world))));
        Ok(())
    })
}

/// Destroys a world with all it owns. Its handles, views and the pointer itself are void afterwards.
///
/// - world: NULL does nothing.
///
/// Errors: LOCKED while the world is used, its own callbacks included; it then lives on. Poisoned worlds are destroyed
/// too. Threads: changes the world.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_destroy(world: *mut isocoat_world) -> isocoat_status {
    // SAFETY: NULL, or made by `isocoat_world_create` and not destroyed yet.
    unsafe { guard::destroy(world) }
}

/// Advances a world: contacts, forces, and the motion of the links that the library integrates. Voids the views of the
/// step before. Advice: sub-steps choose their own length; the implicit response's errors go with dt: a rolling ball's
/// path is off by 6% of its radius at 1/60 s, by 1.6% at 1/240 s (docs/trade.md).
///
/// - world: not NULL.
/// - dt: length of the step, in s, > 0 and at most 10.
///
/// Errors: OUT_OF_RANGE. Threads: changes the world; the log callback and the pair filter are called from here.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_step(world: *mut isocoat_world, dt: f64) -> isocoat_status {
    let step = |inner: &mut guard::Inner| {
        inner.world.step(dt)?;
        inner.views.refresh(&inner.world);
        Ok(())
    };
    // SAFETY: NULL or a live world.
    unsafe { write(world, step) }
}

/// The settings of a world.
///
/// - world: not NULL.
/// - desc: receives them; not NULL, with struct_size set.
///
/// Errors: INVALID_ARGUMENT. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_desc(
    world: *const isocoat_world,
    desc: *mut isocoat_world_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = OutStruct::new(desc, "desc")?;
            out.put(&inner.world.desc().into());
            Ok(())
        })
    }
}

/// Changes the settings of a world, from the next step on.
///
/// - world: not NULL.
/// - desc: the new settings; not NULL.
///
/// Errors: INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_set_desc(
    world: *mut isocoat_world,
    desc: *const isocoat_world_desc,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe { write(world, |inner| Ok(inner.world.set_desc(descriptor::read(desc, "desc")?.to_rust()?)?)) }
}

/// The bodies of a world, in the order of their slots.
///
/// - world: not NULL.
/// - bodies: receives the handles; NULL with capacity 0 asks for the count only.
/// - capacity: handles that bodies can hold.
/// - count: receives the number of bodies, also when bodies is too small; not NULL.
///
/// Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_get_bodies(
    world: *const isocoat_world,
    bodies: *mut isocoat_body,
    capacity: size_t,
    count: *mut size_t,
) -> isocoat_status {
    // SAFETY: the pointers are NULL or as their lines say.
    unsafe {
        read(world, |inner| {
            let out = List::new(bodies, capacity, "bodies", count)?;
            out.put(inner.world.counters().bodies as usize, inner.world.bodies().map(isocoat_body::from))
        })
    }
}

/// Receives the messages of a world, on the thread of the call that has something to say.
///
/// - context: as given to isocoat_world_set_log.
/// - level: an ISOCOAT_LOG_ value.
/// - message: UTF-8; valid during the call.
///
/// It must return (no longjmp, no exception); calls on the world from here give ISOCOAT_ERROR_LOCKED.
pub type isocoat_log_fn =
    Option<unsafe extern "C" fn(context: *mut c_void, level: isocoat_log_level, message: *const c_char)>;

/// Says whether two bodies may touch; called in a step for each pair whose bounds meet, after categories and masks.
///
/// - context: as given to isocoat_world_set_pair_filter.
/// - body_a, body_b: the pair.
///
/// It must return (no longjmp, no exception), the same answer for the same pair within a step; calls on the world from
/// here give ISOCOAT_ERROR_LOCKED.
pub type isocoat_pair_filter_fn =
    Option<unsafe extern "C" fn(context: *mut c_void, body_a: isocoat_body, body_b: isocoat_body) -> bool>;

/// Sets who receives the messages of a world. Without one they are dropped; nothing is ever printed.
///
/// - world: not NULL.
/// - log: the function; NULL for none.
/// - context: given to it, otherwise unused; may be NULL. It must outlive the world or the next set.
///
/// Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_set_log(
    world: *mut isocoat_world,
    log: isocoat_log_fn,
    context: *mut c_void,
) -> isocoat_status {
    let context = Context(context);
    let set = |inner: &mut guard::Inner| {
        let Some(log) = log else {
            inner.world.set_log(None);
            return Ok(());
        };
        let mut text = Vec::new();
        inner.world.set_log(Some(Box::new(move |level, message: &str| {
            let level = match level {
                LogLevel::Info => ISOCOAT_LOG_INFO,
                LogLevel::Warning => ISOCOAT_LOG_WARNING,
            };
            text.clear();
            text.extend(message.bytes().filter(|byte| *byte != 0));
            text.push(0);
            // SAFETY: the host's function takes its own context and a terminated string.
            outside(|| unsafe { log(context.pointer(), level, text.as_ptr().cast()) });
        })));
        Ok(())
    };
    // SAFETY: NULL or a live world.
    unsafe { write(world, set) }
}

/// Sets who decides about pairs of bodies.
///
/// - world: not NULL.
/// - filter: the function; NULL lets every pair touch that categories and masks allow.
/// - context: given to it, otherwise unused; may be NULL. It must outlive the world or the next set.
///
/// Threads: changes the world.
#[must_use]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn isocoat_world_set_pair_filter(
    world: *mut isocoat_world,
    filter: isocoat_pair_filter_fn,
    context: *mut c_void,
) -> isocoat_status {
    let context = Context(context);
    let set = |inner: &mut guard::Inner| {
        let Some(filter) = filter else {
            inner.world.set_pair_filter(None);
            return Ok(());
        };
        inner.world.set_pair_filter(Some(Box::new(move |a: BodyId, b: BodyId| {
            // SAFETY: the host's function takes its own context and two handles.
            outside(|| unsafe { filter(context.pointer(), a.into(), b.into()) })
        })));
        Ok(())
    };
    // SAFETY: NULL or a live world.
    unsafe { write(world, set) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::Kind;
    use crate::capi::body::{isocoat_body_create, isocoat_body_desc_init, isocoat_body_is_enabled};
    use crate::capi::report::isocoat_world_get_contacts;
    use crate::capi::status::{ISOCOAT_ERROR_POISONED, ISOCOAT_OK, isocoat_last_error};
    use crate::math::Pose;
    use crate::world::{BodyDesc, LinkDesc, SkeletonDesc};
    use std::ptr::null_mut;

    /// Two overlapping balls, and a pair filter that fails as only a fault of the library could.
    fn faulty_world() -> *mut isocoat_world {
        let mut world = World::new(WorldDesc::default()).unwrap();
        for (kind, height) in [(Kind::Fixed, 0.0), (Kind::PointMass, 0.15)] {
            let body = world.create_body(BodyDesc::default()).unwrap();
            let desc = LinkDesc { kind, mass: 1.0, pose: Pose::at(0.0, 0.0, height), ..LinkDesc::default() };
            let link = world.create_link(body, desc).unwrap();
            world.create_skeleton(link, SkeletonDesc::default()).unwrap();
        }
        world.set_pair_filter(Some(Box::new(|_, _| panic!("the filter fell over"))));
        Box::into_raw(Box::new(isocoat_world::new(world)))
    }

    fn poison() {
        let world = faulty_world();
        // SAFETY: the world lives until it is destroyed, and every other pointer is of this frame.
        unsafe {
            assert_eq!(isocoat_world_step(world, 0.01), ISOCOAT_ERROR_POISONED);
            let mut buffer = [0u8; 512];
            let length = isocoat_last_error(buffer.as_mut_ptr().cast(), buffer.len());
            let message = std::str::from_utf8(&buffer[..length]).unwrap();
            assert!(message.starts_with("internal error: the filter fell over (src/capi/world.rs:"), "{message}");
            assert!(message.ends_with("destroy it"), "{message}");

            let mut desc = std::mem::zeroed();
            assert_eq!(isocoat_body_desc_init(&mut desc, size_of_val(&desc)), ISOCOAT_OK);
            let (mut body, mut enabled) = (isocoat_body::default(), true);
            let (mut contacts, mut count) = (std::ptr::null(), 0);
            let poisoned = [
                isocoat_world_step(world, 0.01),
                isocoat_world_set_log(world, None, null_mut()),
                isocoat_world_get_contacts(world, &mut contacts, &mut count),
                isocoat_body_create(world, &desc, &mut body),
                isocoat_body_is_enabled(world, body, &mut enabled),
            ];
            assert_eq!(poisoned, [ISOCOAT_ERROR_POISONED; 5]);
            assert_eq!(isocoat_world_destroy(world), ISOCOAT_OK);
        }
    }

    /// Printing can only be seen from outside: the test runs itself again, in a process of its own.
    #[test]
    fn a_panic_poisons_its_world_and_only_those_of_the_host_are_printed() {
        const INSIDE: &str = "ISOCOAT_TEST_POISON";
        if std::env::var_os(INSIDE).is_some() {
            poison();
            assert!(std::panic::catch_unwind(|| panic!("the host fell over")).is_err());
            return;
        }
        let name = "capi::world::tests::a_panic_poisons_its_world_and_only_those_of_the_host_are_printed";
        let mut again = std::process::Command::new(std::env::current_exe().unwrap());
        let output = again.args(["--exact", name, "--nocapture"]).env(INSIDE, "1").output().unwrap();
        let (out, err) = (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
        assert!(output.status.success() && out.contains("1 passed"), "{out}{err}");
        assert!(err.contains("the host fell over") && !err.contains("the filter fell over"), "{err}");
    }
}
