/*
 * isocoat 0.1.0: soft implicit coats for rigid bodies.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 * Generated from the comments in src/capi; do not edit. This file is the manual of the C API, for C99, C++11 and later.
 *
 * A world owns bodies; a body owns links, the moving frames that the host or the library drives; a link carries
 * skeletons, primitives whose fields add up to the body's coat. A substance is a body of particles instead. The surface
 * of a coat is where the field has the body's isovalue. Where two coats meet, contact forces arise. One step advances a
 * world:
 *
 *     host's poses -> isocoat_world_set_link_states -> isocoat_world_step -> isocoat_world_get_link_impulses -> host
 *
 * Rules that hold for every function
 *
 * Units     SI; angles in rad. Frames are right-handed, quaternions x, y, z, w. Vectors are in the world's axes unless
 *           a name says local, and the points of a skeleton are in its link's frame.
 * Status    Every call that can fail returns an isocoat_status. A call that fails has changed nothing and written no
 *           output (but the count that a too small buffer needs). isocoat_last_error tells what was wrong, with the
 *           value and the range. Not repeated below: INVALID_ARGUMENT for a NULL that is not allowed, LOCKED and
 *           POISONED for every call on a world.
 * Handles   Small structs by value. All zero is null. A null, stale or foreign handle is an error, never a crash.
 * Structs   Those that begin with struct_size may grow at their end: begin with their _default() and set the rest, so
 *           that hosts and libraries of different versions fit together.
 * Threads   "Reads the world": may run at the same time as other calls that read the same world. "Changes the world":
 *           must be the only call on that world. A call that comes at the wrong time, also from a callback, returns
 *           ISOCOAT_ERROR_LOCKED. Different worlds are independent. The library starts no threads and prints nothing.
 * Buffers   Where a list is copied out: NULL with capacity 0 asks for the count; a buffer that is too small gives
 *           ISOCOAT_ERROR_BUFFER_TOO_SMALL. Memory of the library is never handed over: views live as long as their
 *           function says.
 */

#ifndef ISOCOAT_H
#define ISOCOAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Version of this header; isocoat_version() gives that of the library. */
#define ISOCOAT_VERSION_MAJOR 0
#define ISOCOAT_VERSION_MINOR 1
#define ISOCOAT_VERSION_PATCH 0
#define ISOCOAT_VERSION_STRING "0.1.0"
/* The three in one number, as isocoat_version() gives them. */
#define ISOCOAT_VERSION \
    ((uint32_t)ISOCOAT_VERSION_MAJOR << 22 | (uint32_t)ISOCOAT_VERSION_MINOR << 12 | (uint32_t)ISOCOAT_VERSION_PATCH)

/* Warns where a status is dropped. */
#ifndef ISOCOAT_MUST_USE
#if defined(__GNUC__) || defined(__clang__)
#define ISOCOAT_MUST_USE __attribute__((warn_unused_result))
#elif defined(_MSC_VER)
#include <sal.h>
#define ISOCOAT_MUST_USE _Check_return_
#else
#define ISOCOAT_MUST_USE
#endif
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* ---- Status ------------------------------------------------------------------------------------------------------ */

/** What a call came to: ISOCOAT_OK, or an ISOCOAT_ERROR_ code. Codes are never renumbered; new ones may come. */
typedef uint32_t isocoat_status;

/** Done. */
#define ISOCOAT_OK 0u
/**
 * A pointer is NULL that must not be, a struct_size or an enum value is unknown, a count or a stride makes no sense.
 */
#define ISOCOAT_ERROR_INVALID_ARGUMENT 1u
/** A handle is null, belongs to another world, or its object was destroyed. */
#define ISOCOAT_ERROR_INVALID_HANDLE 2u
/** A number is outside its range, or is not a number. */
#define ISOCOAT_ERROR_OUT_OF_RANGE 3u
/** The call makes no sense for this object, or this version of the library cannot do it. */
#define ISOCOAT_ERROR_UNSUPPORTED 4u
/** A limit of the library is reached. */
#define ISOCOAT_ERROR_CAPACITY 5u
/** The buffer is too small: the call has written the count it needs, and nothing else. */
#define ISOCOAT_ERROR_BUFFER_TOO_SMALL 6u
/**
 * The world is being stepped or changed, or it is being read and the call would change it. Calls from the callbacks
 * of a step get this code too.
 */
#define ISOCOAT_ERROR_LOCKED 7u
/** An internal error has left the world in an unknown state: it can only be destroyed. */
#define ISOCOAT_ERROR_POISONED 8u
/** The bytes are not a snapshot that this library can restore: damaged, cut short, or of another format. */
#define ISOCOAT_ERROR_SNAPSHOT 9u
/** The bytes are not a recording that this library can play: damaged, cut short, or of another format. */
#define ISOCOAT_ERROR_RECORDING 10u
/** The stream of a recording took no more. */
#define ISOCOAT_ERROR_STREAM 11u

/**
 * The message of the last call on this thread that did not return ISOCOAT_OK: what was wrong, with the value and the
 * range. Calls that succeed leave it as it is.
 *
 * - buffer: receives the message with a terminating zero, cut to fit; may be NULL when capacity is 0.
 * - capacity: bytes in buffer.
 *
 * Returns the length of the whole message in bytes, without the terminating zero; 0 when no call has failed yet.
 * Threads: any.
 */
size_t isocoat_last_error(char *buffer, size_t capacity);

/**
 * The name of a status, such as "ISOCOAT_ERROR_LOCKED"; "unknown status" for a number that is none.
 *
 * Lifetime: static. Threads: any.
 */
const char *isocoat_status_name(isocoat_status status);

/* ---- Version ----------------------------------------------------------------------------------------------------- */

/**
 * The version of the library that runs, as ISOCOAT_VERSION packs it: major << 22 | minor << 12 | patch.
 *
 * Threads: any.
 */
uint32_t isocoat_version(void);

/**
 * The version of the library that runs, such as "0.1.0".
 *
 * Lifetime: static. Threads: any.
 */
const char *isocoat_version_string(void);

/**
 * What isocoat_check_abi calls: compares a host's version and struct sizes with the library's.
 *
 * - version: ISOCOAT_VERSION of the header that the host was compiled with.
 * - sizes: sizeof of the structs, in the header's order; not NULL unless count is 0.
 * - count: number of sizes; a count other than this library's own compares what both know.
 *
 * Errors: UNSUPPORTED when they do not fit together; INVALID_ARGUMENT. Threads: any.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_check_abi_of(uint32_t version, const uint32_t *sizes, size_t count);

/* ---- Handles ----------------------------------------------------------------------------------------------------- */

/**
 * Handle of a body: one deformable or rigid object. All zero is null. A handle whose body was destroyed, or of
 * another world, gives ISOCOAT_ERROR_INVALID_HANDLE; it never means another body. Only a restore makes it valid again,
 * by bringing its body back.
 */
typedef struct isocoat_body {
    /** Slot of the body in its world. */
    uint32_t index;
    /** How often the slot was used; 0 only in the null handle. */
    uint16_t generation;
    /** Tag of the world; 0 only in the null handle. */
    uint16_t world;
} isocoat_body;

/** Handle of a link: one moving frame of a body. The rules of isocoat_body hold. */
typedef struct isocoat_link {
    /** Slot of the link in its world. */
    uint32_t index;
    /** How often the slot was used; 0 only in the null handle. */
    uint16_t generation;
    /** Tag of the world; 0 only in the null handle. */
    uint16_t world;
} isocoat_link;

/** Handle of a skeleton: a primitive, fixed in a link's frame, that emits a field. The rules of isocoat_body hold. */
typedef struct isocoat_skeleton {
    /** Slot of the skeleton in its world. */
    uint32_t index;
    /** How often the slot was used; 0 only in the null handle. */
    uint16_t generation;
    /** Tag of the world; 0 only in the null handle. */
    uint16_t world;
} isocoat_skeleton;

/** Handle of a spring between two links of a body. The rules of isocoat_body hold. */
typedef struct isocoat_spring {
    /** Slot of the spring in its world. */
    uint32_t index;
    /** How often the slot was used; 0 only in the null handle. */
    uint16_t generation;
    /** Tag of the world; 0 only in the null handle. */
    uint16_t world;
} isocoat_spring;

/**
 * Handle of a skin: a mesh of the host that a body's coat carries. The rules of isocoat_body hold; but a restore brings
 * no skin back.
 */
typedef struct isocoat_skin {
    /** Slot of the skin in its world. */
    uint32_t index;
    /** How often the slot was used; 0 only in the null handle. */
    uint16_t generation;
    /** Tag of the world; 0 only in the null handle. */
    uint16_t world;
} isocoat_skin;

/* ---- Poses, wrenches, inertia ------------------------------------------------------------------------------------ */

/** Position and orientation of a frame in the world. */
typedef struct isocoat_pose {
    /** Origin of the frame, in m. Default 0. */
    double position[3];
    /**
     * Rotation from the frame to the world: a quaternion x, y, z, w with a norm of 1 within 1e-3; it is normalised.
     * Default 0, 0, 0, 1.
     */
    double orientation[4];
} isocoat_pose;

/** A force and a torque, in the world's axes; or an impulse and an angular impulse. */
typedef struct isocoat_wrench {
    /** Force, in N; as an impulse, in N s. */
    double force[3];
    /** Torque about the centre of mass, in N m; as an impulse, in N m s. */
    double torque[3];
} isocoat_wrench;

/**
 * Inertia tensor of a solid ball about its centre: 2/5 m r^2 about every axis.
 *
 * - mass: in kg, > 0.
 * - radius: in m, > 0.
 * - inertia: receives 9 doubles, row by row, in kg m^2; not NULL.
 *
 * Errors: OUT_OF_RANGE, INVALID_ARGUMENT. Threads: any.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_inertia_of_sphere(double mass, double radius, double inertia[9]);

/**
 * Inertia tensor of a solid box about its centre, in its own axes: m/3 (b^2 + c^2) about the axis of half extent a.
 *
 * - mass: in kg, > 0.
 * - half_extents: 3 doubles, in m, each > 0; not NULL.
 * - inertia: receives 9 doubles, row by row, in kg m^2; not NULL.
 *
 * Errors: OUT_OF_RANGE, INVALID_ARGUMENT. Threads: any.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_inertia_of_box(double mass, const double half_extents[3], double inertia[9]);

/**
 * Inertia tensor of a solid capsule along z about its centre: a cylinder between two half balls, of one density.
 *
 * - mass: in kg, > 0.
 * - radius: in m, > 0.
 * - half_length: from the centre to the centre of a half ball, in m, at least 0 (0 is a ball).
 * - inertia: receives 9 doubles, row by row, in kg m^2; not NULL.
 *
 * Errors: OUT_OF_RANGE, INVALID_ARGUMENT. Threads: any.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_inertia_of_capsule(double mass,
                                          double radius,
                                          double half_length,
                                          double inertia[9]);

/* ---- World ------------------------------------------------------------------------------------------------------- */

/** A world: it owns every body, link and skeleton; one step advances it. Worlds are independent of each other. */
typedef struct isocoat_world isocoat_world;

/** How contact forces act on the links in time: an ISOCOAT_RESPONSE_ value. */
typedef uint32_t isocoat_response;

/**
 * The library chooses for each group of bodies in contact: ISOCOAT_RESPONSE_IMPLICIT for what is constrained, held by
 * its host, stacked, or on stiff springs, ISOCOAT_RESPONSE_SUBSTEPPED for the rest.
 */
#define ISOCOAT_RESPONSE_AUTO 0u
/** One evaluation of the forces a step, at its beginning: for small steps only. Overloads are stepped implicitly. */
#define ISOCOAT_RESPONSE_EXPLICIT 1u
/**
 * Velocities and forces of all links in contact that agree at the end of the step: stable at any stiffness and mass,
 * exact at rest; contacts do not bounce. Momentum is kept; angular momentum changes by dt times the cross product of
 * the speed at which two bodies leave each other and their impulse, which matters for oblique blows in free flight.
 */
#define ISOCOAT_RESPONSE_IMPLICIT 2u
/**
 * Many small steps inside each step; host-driven links through a mirror that lasts from step to step. What is pressed
 * past the most that its coats carry, or asks for more than max_substeps, is stepped implicitly all the same.
 */
#define ISOCOAT_RESPONSE_SUBSTEPPED 3u

/** How a contact surface is integrated: an ISOCOAT_SCHEME_ value. */
typedef uint32_t isocoat_scheme;

/** The cheapest that meets the tolerance. */
#define ISOCOAT_SCHEME_AUTO 0u
/** Closed form; pairs without one as ISOCOAT_SCHEME_AUTO. */
#define ISOCOAT_SCHEME_CLOSED_FORM 1u
/** A polar Gauss patch round the deepest point. */
#define ISOCOAT_SCHEME_POLAR 2u
/** Subdivision that adapts to the border of the contact. */
#define ISOCOAT_SCHEME_ADAPTIVE 3u
/** Seeds on the surfaces, as in the papers. */
#define ISOCOAT_SCHEME_SEEDS 4u
/** Flat faces and straight edges, with their rounded surroundings; pairs without them as ISOCOAT_SCHEME_AUTO. */
#define ISOCOAT_SCHEME_FACETS 5u

/** Settings of a world. Begin with isocoat_world_desc_default(). */
typedef struct isocoat_world_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /**
     * How contact forces act in time. Default ISOCOAT_RESPONSE_AUTO.
     * Advice (all of it measured in docs/trade.md): what need not bounce, implicit: a cube that lands on a floor takes
     * a thirtieth of the time of sub-steps, never gains energy, and its path is off by 7% of half its side, not 0.6%.
     */
    isocoat_response response;
    /**
     * How contact surfaces are integrated. Default ISOCOAT_SCHEME_AUTO.
     * Advice: leave it. A force within 1% takes 2 us between balls (polar 6, adaptive 250, seeds 450) and 22 us under a
     * cube (polar 360, adaptive 840).
     */
    isocoat_scheme scheme;
    /**
     * Seeds of a skeleton that does not say its own number: from 4 to 65536. Default 64.
     * Advice: it matters for ISOCOAT_SCHEME_SEEDS, and where a surface wraps round. Two balls' force is off by 36% with
     * 256, 3% with 1024, 0.3% with 4096; the time goes with the number.
     */
    uint32_t seed_count;
    /**
     * Upper bound of the sub-steps in one step: from 1 to 65536. Default 4096.
     * Advice: a bound for the worst case, not for speed. Where more are wanted, the step is implicit; the log says
     * so if sub-steps were forced: with 16 instead of 64 two balls at 60 Hz no longer bounce.
     */
    uint32_t max_substeps;
    /** Acceleration of gravity, in m/s^2, finite. Default 0. */
    double gravity[3];
    /**
     * Relative error accepted in a contact force: from 1e-9 to 0.5. Default 5e-3.
     * Advice: 5e-2 saves a quarter of the time of blended coats or faces, and takes the path of two dumbbells from 0.2%
     * off to 2%; 5e-4 takes twice the time, to 0.04%. Between balls it changes nothing: their closed form is exact.
     */
    double force_tolerance;
    /**
     * Largest product of contact frequency and sub-step, in rad: from 0.01 to 1. Default 0.2.
     * Advice: half of it takes up to twice the time for about a third of the error: the path of a ball that bounces is
     * off by 5% of the radius at 0.4, 0.9% at 0.2, 0.3% at 0.1; 1 still does for a cube that lands, at 2%.
     */
    double substep_phase;
    /**
     * Implicit response: motion of a contact between two rounds, over its depth, that ends them: from 1e-9 to 1.
     * Default 0.05.
     * Advice: leave it. From 0.5 to 5e-4 ten balls in a box take 15% more time, and their path and rest stay the same.
     */
    double implicit_tolerance;
    /**
     * Implicit response: most evaluations of a contact surface before the step is split: from 1 to 64. Default 8.
     * Advice: 4 or more. With 2, steps are split instead and ten balls in a box take half as long again; with 1, ten
     * times as long or more.
     */
    uint32_t implicit_rounds;
    /**
     * Implicit response: how often a step that does not converge may be split in two: from 0 to 10. Default 4.
     * Advice: leave it. It costs nothing where steps converge, as in all five scenes of docs/trade.md.
     */
    uint32_t implicit_splits;
    /**
     * Time for which a group of bodies must be at rest before it falls asleep, in s: at least 0; 0 is never. Default 0.
     */
    double sleep_time;
    /**
     * Speed up to which a body counts as at rest, in thicknesses of its thinnest coat a second: from 0 to 1e6.
     * Default 0.01.
     */
    double sleep_speed;
    /** 1 for steps that read the clock for isocoat_world_get_times(), else 0. Default 0. */
    uint32_t timed;
    /** 0. */
    uint32_t reserved;
} isocoat_world_desc;

/** How much a message matters: an ISOCOAT_LOG_ value. More may come. */
typedef uint32_t isocoat_log_level;

/** Worth knowing. */
#define ISOCOAT_LOG_INFO 0u
/** The scene cannot do what it seems to be meant to. */
#define ISOCOAT_LOG_WARNING 1u

/**
 * Receives the messages of a world, on the thread of the call that has something to say.
 *
 * - context: as given to isocoat_world_set_log.
 * - level: an ISOCOAT_LOG_ value.
 * - message: UTF-8; valid during the call.
 *
 * It must return (no longjmp, no exception); calls on the world from here give ISOCOAT_ERROR_LOCKED.
 */
typedef void (*isocoat_log_fn)(void *context, isocoat_log_level level, const char *message);

/**
 * Says whether two bodies may touch; called in a step for each pair whose bounds meet, after categories and masks.
 *
 * - context: as given to isocoat_world_set_pair_filter.
 * - body_a, body_b: the pair.
 *
 * It must return (no longjmp, no exception), the same answer for the same pair within a step; calls on the world from
 * here give ISOCOAT_ERROR_LOCKED.
 */
typedef bool (*isocoat_pair_filter_fn)(void *context, isocoat_body body_a, isocoat_body body_b);

/**
 * Fills a descriptor with its defaults; isocoat_world_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_world_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_world_desc_init(isocoat_world_desc *desc, size_t size);

/**
 * Creates an empty world.
 *
 * - desc: settings; not NULL.
 * - world: receives the world; not NULL. Destroy it with isocoat_world_destroy.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: any.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_world_create(const isocoat_world_desc *desc, isocoat_world **world);

/**
 * Destroys a world with all it owns. Its handles, views and the pointer itself are void afterwards.
 *
 * - world: NULL does nothing.
 *
 * Errors: LOCKED while the world is used, its own callbacks included; it then lives on. Poisoned worlds are destroyed
 * too. Threads: changes the world.
 */
isocoat_status isocoat_world_destroy(isocoat_world *world);

/**
 * Advances a world: contacts, forces, and the motion of the links that the library integrates. Voids the views of the
 * step before. Advice: sub-steps choose their own length; the implicit response's errors go with dt: a rolling ball's
 * path is off by 6% of its radius at 1/60 s, by 1.6% at 1/240 s (docs/trade.md).
 *
 * - world: not NULL.
 * - dt: length of the step, in s, > 0 and at most 10.
 *
 * Errors: OUT_OF_RANGE. Threads: changes the world; the log callback and the pair filter are called from here.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_world_step(isocoat_world *world, double dt);

/**
 * The settings of a world.
 *
 * - world: not NULL.
 * - desc: receives them; not NULL, with struct_size set.
 *
 * Errors: INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_world_get_desc(const isocoat_world *world, isocoat_world_desc *desc);

/**
 * Changes the settings of a world, from the next step on.
 *
 * - world: not NULL.
 * - desc: the new settings; not NULL.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_world_set_desc(isocoat_world *world, const isocoat_world_desc *desc);

/**
 * The bodies of a world, in the order of their slots.
 *
 * - world: not NULL.
 * - bodies: receives the handles; NULL with capacity 0 asks for the count only.
 * - capacity: handles that bodies can hold.
 * - count: receives the number of bodies, also when bodies is too small; not NULL.
 *
 * Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_get_bodies(const isocoat_world *world,
                                        isocoat_body *bodies,
                                        size_t capacity,
                                        size_t *count);

/**
 * Sets who receives the messages of a world. Without one they are dropped; nothing is ever printed.
 *
 * - world: not NULL.
 * - log: the function; NULL for none.
 * - context: given to it, otherwise unused; may be NULL. It must outlive the world or the next set.
 *
 * Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_world_set_log(isocoat_world *world, isocoat_log_fn log, void *context);

/**
 * Sets who decides about pairs of bodies.
 *
 * - world: not NULL.
 * - filter: the function; NULL lets every pair touch that categories and masks allow.
 * - context: given to it, otherwise unused; may be NULL. It must outlive the world or the next set.
 *
 * Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_set_pair_filter(isocoat_world *world,
                                             isocoat_pair_filter_fn filter,
                                             void *context);

/* ---- Bodies ------------------------------------------------------------------------------------------------------ */

/** What a body is made of: an ISOCOAT_BODY_ value. */
typedef uint32_t isocoat_body_kind;

/** Its coat gives way under load. */
#define ISOCOAT_BODY_DEFORMABLE 0u
/** Its coat keeps its shape; in a contact all the flesh that gives way is the other body's. */
#define ISOCOAT_BODY_RIGID 1u

/**
 * How a body's stiffness is said: an ISOCOAT_STIFFNESS_ value. With the last two, the pressure a unit of field follows
 * from the body's mass, its skeletons and the world's gravity (or 9.80665 m/s^2 where there is none), for rest on a
 * hard floor on all its skeletons; isocoat_body_get_stiffness() gives what comes out. Without mass or skeletons,
 * stiffness_scale holds.
 */
typedef uint32_t isocoat_stiffness_rule;

/** By stiffness_scale. */
#define ISOCOAT_STIFFNESS_SCALE 0u
/** By static_sink. */
#define ISOCOAT_STIFFNESS_SINK 1u
/** By contact_frequency and damping_ratio. */
#define ISOCOAT_STIFFNESS_FREQUENCY 2u

/** One object: what its coat is made of. Begin with isocoat_body_desc_default(). */
typedef struct isocoat_body_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** What it is made of. Default ISOCOAT_BODY_DEFORMABLE. */
    isocoat_body_kind kind;
    /** Field value on the surface, > 1e-9 and at most 1e9. Default 1. */
    double isovalue;
    /** Pressure a unit of field, in Pa, > 0 and at most 1e18. Default 1e5. */
    double stiffness_scale;
    /** Coefficient of Coulomb friction, from 0 to 1e6; a pair takes the geometric mean. Default 0. */
    double friction;
    /** Coefficient of static friction: 0 (off), or from friction to 1e6; a pair takes the geometric mean. Default 0. */
    double static_friction;
    /** Viscous friction, in sqrt(N s/m^3), from 0 to 1e6; a pair takes the product. Default 0. */
    double viscous_friction;
    /**
     * Hunt-Crossley dissipation, in s/m, from 0 to 1e6; a pair takes the mean weighted by the other's stiffness.
     * Default 0.
     */
    double dissipation;
    /** What this body is, as bits. Default 1. */
    uint64_t category;
    /**
     * Which categories it touches, as bits; two bodies touch when each one's mask has a bit of the other's category.
     * Default all.
     */
    uint64_t mask;
    /** The host's own; given back, otherwise unused. Default NULL. */
    void *user_data;
    /**
     * How contact forces act on it in time: ISOCOAT_RESPONSE_AUTO leaves it to the world; what one body forces
     * holds for all that it touches. Default ISOCOAT_RESPONSE_AUTO.
     */
    isocoat_response response;
    /** How its stiffness is said. Default ISOCOAT_STIFFNESS_SCALE. */
    isocoat_stiffness_rule stiffness_rule;
    /**
     * With ISOCOAT_STIFFNESS_SINK: sink under its own weight over the thickness, > 0 and at most 0.5. Default 0.05.
     * A box is taken to lie on its flat face: where its coat is thick, the rounded rim bears too, and it sinks less.
     */
    double static_sink;
    /**
     * With ISOCOAT_STIFFNESS_FREQUENCY: frequency of small swings on its contact, in Hz, > 0 and at most 1e6.
     * Default 10.
     */
    double contact_frequency;
    /**
     * With ISOCOAT_STIFFNESS_FREQUENCY: damping over the critical one, from 0 to 10; replaces dissipation. Default 0.
     */
    double damping_ratio;
    /** 1 if it may fall asleep where the world lets bodies sleep, else 0. Default 1. */
    uint32_t may_sleep;
    /** 0. */
    uint32_t reserved;
    /**
     * Width of the band in which the fields of groups that don't blend go over into each other, over the isovalue, from
     * 0 to 0.5; 0 leaves a crease. Only for bodies with a blend graph. Default 0.05.
     */
    double blend_band;
    /** 1 if its parts that don't blend collide, when they are of different links, else 0. Default 1. */
    uint32_t self_contact;
    /** 0. */
    uint32_t reserved_2;
    /**
     * Volume control: share of each skeleton's error in volume that a step takes back, from 0 (off) to 0.5, which is
     * the best for most. See isocoat_skeleton_set_target_volume(). Default 0.
     */
    double volume_gain;
    /**
     * How far round its contacts its coat bulges, from 0 (not at all) to 1, over the isovalue: until the field of what
     * it touches has fallen by so much. Seen by queries with ISOCOAT_DEFORMATION_BULGES; forces know no bulges.
     * Default 0.
     */
    double bulge_width;
    /** Height of those bulges over the most that the contact compresses the coat, from 0 to 1e6. Default 1. */
    double bulge_height;
} isocoat_body_desc;

/**
 * Fills a descriptor with its defaults; isocoat_body_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_body_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_body_desc_init(isocoat_body_desc *desc, size_t size);

/**
 * Creates a body without links.
 *
 * - world: not NULL.
 * - desc: what it is made of; not NULL.
 * - body: receives the handle; not NULL.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE, CAPACITY. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_create(isocoat_world *world,
                                   const isocoat_body_desc *desc,
                                   isocoat_body *body);

/**
 * Destroys a body with its links, skeletons and springs.
 *
 * - world: not NULL.
 * - body: the body; its handle and those of its links, skeletons and springs are stale afterwards.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_body_destroy(isocoat_world *world, isocoat_body body);

/**
 * The stiffness of a body as its descriptor gives it, whichever rule it follows.
 *
 * - world: not NULL.
 * - body: the body.
 * - stiffness_scale: receives the pressure a unit of field, in Pa; not NULL.
 * - dissipation: receives the Hunt-Crossley dissipation, in s/m; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_get_stiffness(const isocoat_world *world,
                                          isocoat_body body,
                                          double *stiffness_scale,
                                          double *dissipation);

/**
 * The descriptor of a body.
 *
 * - world: not NULL.
 * - body: the body.
 * - desc: receives it; not NULL, with struct_size set.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_get_desc(const isocoat_world *world,
                                     isocoat_body body,
                                     isocoat_body_desc *desc);

/**
 * Changes a body, from the next step on. A new isovalue must suit the profiles of all its skeletons.
 *
 * - world: not NULL.
 * - body: the body.
 * - desc: the new descriptor, whole; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_set_desc(isocoat_world *world,
                                     isocoat_body body,
                                     const isocoat_body_desc *desc);

/**
 * Takes a body out of the simulation, or puts it back. New bodies are enabled.
 *
 * - world: not NULL.
 * - body: the body.
 * - enabled: whether it takes part.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_body_set_enabled(isocoat_world *world, isocoat_body body, bool enabled);

/**
 * Whether a body takes part in the simulation.
 *
 * - world: not NULL.
 * - body: the body.
 * - enabled: receives the answer; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_body_is_enabled(const isocoat_world *world, isocoat_body body, bool *enabled);

/**
 * Whether a body is awake; those that cannot move always are. See isocoat_world_desc::sleep_time.
 *
 * - world: not NULL.
 * - body: the body.
 * - awake: receives the answer; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_body_is_awake(const isocoat_world *world, isocoat_body body, bool *awake);

/**
 * Wakes a body with all that sleep with it; of one that cannot move, those that lean on it. Touch, and whatever the
 * host changes about a body, wake it by themselves.
 *
 * - world: not NULL.
 * - body: the body.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_body_wake(isocoat_world *world, isocoat_body body);

/**
 * The host's own pointer of a body.
 *
 * - world: not NULL.
 * - body: the body.
 * - user_data: receives the pointer; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_get_user_data(const isocoat_world *world,
                                          isocoat_body body,
                                          void **user_data);

/**
 * The links of a body, in the order of their creation.
 *
 * - world: not NULL.
 * - body: the body.
 * - links: receives the handles; NULL with capacity 0 asks for the count only.
 * - capacity: handles that links can hold.
 * - count: receives the number of links, also when links is too small; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_get_links(const isocoat_world *world,
                                      isocoat_body body,
                                      isocoat_link *links,
                                      size_t capacity,
                                      size_t *count);

/* ---- Links ------------------------------------------------------------------------------------------------------- */

/** Who moves a link: an ISOCOAT_LINK_ value. */
typedef uint32_t isocoat_link_kind;

/** Nobody: it stays where it is put. Mass and inertia are ignored. */
#define ISOCOAT_LINK_FIXED 0u
/** The host sets pose and velocity every tick. With a mass, it is given impulses to apply; without, it is kinematic. */
#define ISOCOAT_LINK_HOST 1u
/** The library: a mass that moves but does not turn. */
#define ISOCOAT_LINK_POINT_MASS 2u
/** The library: a rigid solid with an inertia tensor. */
#define ISOCOAT_LINK_RIGID 3u

/** In which moment of a tick a host's velocities live: an ISOCOAT_VELOCITY_ value. */
typedef uint32_t isocoat_velocity_convention;

/** Semi-implicit Euler, as Bullet: v += a dt, then x += v dt. Velocities lag half a tick behind positions. */
#define ISOCOAT_VELOCITY_LEAPFROG 0u
/** Velocities belong to the same moment as the positions: x += v dt + a dt^2/2, then v += a dt. */
#define ISOCOAT_VELOCITY_SYNCHRONOUS 1u

/** Properties of a host-driven link: ISOCOAT_LINK_ flags, added up. */
typedef uint32_t isocoat_link_flags;

/** The host itself applies the gyroscopic torque. */
#define ISOCOAT_LINK_HOST_GYROSCOPIC 1u
/**
 * Joints or contacts of the host act on the link in this tick, so that it does not move as its own mass would. The
 * automatic response is implicit then, as it is for links of an articulation; without one and without
 * inverse_effective_inertia, what holds it is estimated.
 */
#define ISOCOAT_LINK_CONSTRAINED 2u
/** The field inverse_effective_inertia is given. */
#define ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA 4u

/** One moving frame of a body. Begin with isocoat_link_desc_default(). */
typedef struct isocoat_link_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** Who moves it. Default ISOCOAT_LINK_FIXED. */
    isocoat_link_kind kind;
    /** The link's frame in the world. Default the world's frame. */
    isocoat_pose pose;
    /** Velocity of the centre of mass in the world, in m/s, finite. Default 0. */
    double linear_velocity[3];
    /** Angular velocity in the world, in rad/s, finite. Default 0. */
    double angular_velocity[3];
    /**
     * Mass, in kg: > 0 for point masses and rigid solids, at least 0 for host-driven links (0 is kinematic); ignored
     * for fixed ones. Default 0.
     */
    double mass;
    /** Centre of mass in the link's frame, in m, finite; 0 for a point mass. Default 0. */
    double local_center_of_mass[3];
    /**
     * Inertia tensor about the centre of mass in the axes of the link's frame, row by row, in kg m^2: symmetric,
     * positive definite, no principal moment above the sum of the other two. For rigid solids and for host-driven
     * links with a mass; ignored otherwise. Default 0. See isocoat_inertia_of_sphere and its like.
     */
    double inertia[9];
    /** Factor on the world's gravity, finite. Default 1. */
    double gravity_scale;
    /** Acceleration besides gravity and contact, in the world, in m/s^2, finite. Default 0. */
    double external_acceleration[3];
    /** Angular acceleration besides contact and gyroscopic terms, in the world, in rad/s^2, finite. Default 0. */
    double external_angular_acceleration[3];
    /** Host-driven links: which moment the host's velocities belong to. Default ISOCOAT_VELOCITY_LEAPFROG. */
    isocoat_velocity_convention velocity_convention;
    /** Host-driven links: ISOCOAT_LINK_ flags, added up. Default 0. */
    isocoat_link_flags flags;
    /**
     * Host-driven links that joints hold: the 6x6 matrix from wrench at the centre of mass (force, torque) to
     * acceleration (linear, angular), in the world, row by row; symmetric and positive definite. Read only with
     * ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA in flags. Where several links of the same joints touch, see
     * isocoat_world_set_articulations. Default 0.
     */
    double inverse_effective_inertia[36];
    /** The host's own; given back, otherwise unused. Default NULL. */
    void *user_data;
} isocoat_link_desc;

/**
 * Fills a descriptor with its defaults; isocoat_link_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_link_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_link_desc_init(isocoat_link_desc *desc, size_t size);

/**
 * Creates a link of a body, without skeletons.
 *
 * - world: not NULL.
 * - body: the body it belongs to.
 * - desc: the link; not NULL.
 * - link: receives the handle; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, CAPACITY. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_create(isocoat_world *world,
                                   isocoat_body body,
                                   const isocoat_link_desc *desc,
                                   isocoat_link *link);

/**
 * Destroys a link with its skeletons and springs.
 *
 * - world: not NULL.
 * - link: the link; its handle and those of its skeletons and springs are stale afterwards.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_link_destroy(isocoat_world *world, isocoat_link link);

/**
 * The descriptor of a link, with its present pose and velocities.
 *
 * - world: not NULL.
 * - link: the link.
 * - desc: receives it; not NULL, with struct_size set.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_get_desc(const isocoat_world *world,
                                     isocoat_link link,
                                     isocoat_link_desc *desc);

/**
 * Changes a link, its pose and velocities included.
 *
 * - world: not NULL.
 * - link: the link.
 * - desc: the new descriptor, whole; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_set_desc(isocoat_world *world,
                                     isocoat_link link,
                                     const isocoat_link_desc *desc);

/**
 * Takes a link with its skeletons and springs out of the simulation, or puts them back. New links are enabled.
 *
 * - world: not NULL.
 * - link: the link.
 * - enabled: whether it takes part.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_link_set_enabled(isocoat_world *world, isocoat_link link, bool enabled);

/**
 * Whether a link takes part in the simulation. The links of a disabled body keep their own answer.
 *
 * - world: not NULL.
 * - link: the link.
 * - enabled: receives the answer; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_link_is_enabled(const isocoat_world *world, isocoat_link link, bool *enabled);

/**
 * The host's own pointer of a link.
 *
 * - world: not NULL.
 * - link: the link.
 * - user_data: receives the pointer; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_get_user_data(const isocoat_world *world,
                                          isocoat_link link,
                                          void **user_data);

/**
 * The body of a link.
 *
 * - world: not NULL.
 * - link: the link.
 * - body: receives the handle; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_get_body(const isocoat_world *world,
                                     isocoat_link link,
                                     isocoat_body *body);

/**
 * The skeletons of a link, in the order of their creation.
 *
 * - world: not NULL.
 * - link: the link.
 * - skeletons: receives the handles; NULL with capacity 0 asks for the count only.
 * - capacity: handles that skeletons can hold.
 * - count: receives the number of skeletons, also when skeletons is too small; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_get_skeletons(const isocoat_world *world,
                                          isocoat_link link,
                                          isocoat_skeleton *skeletons,
                                          size_t capacity,
                                          size_t *count);

/* ---- Skeletons --------------------------------------------------------------------------------------------------- */

/**
 * Which primitive a skeleton is: an ISOCOAT_SHAPE_ value. It says what the three points of the descriptor are, all in
 * the link's frame, in m.
 */
typedef uint32_t isocoat_shape;

/** A point: `points[0]`. */
#define ISOCOAT_SHAPE_POINT 0u
/** A segment from `points[0]` to `points[1]`; a point if they are one. */
#define ISOCOAT_SHAPE_SEGMENT 1u
/** A triangle of `points[0]`, `points[1]`, `points[2]`; a segment or a point if it has no area. */
#define ISOCOAT_SHAPE_TRIANGLE 2u
/**
 * A solid box: `points[0]` is its centre, `points[1]` its half extents, each > 0, `points[2]` the rotation of its axes
 * as a vector (axis times angle, in rad).
 */
#define ISOCOAT_SHAPE_BOX 3u
/**
 * A half-space: `points[0]` is a point of its boundary, `points[1]` the outward normal, of any length but 0. For fixed
 * links only.
 */
#define ISOCOAT_SHAPE_PLANE 4u

/** A primitive fixed in a link's frame, and the field it emits. Begin with isocoat_skeleton_desc_default(). */
typedef struct isocoat_skeleton_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** Which primitive. Default ISOCOAT_SHAPE_POINT. */
    isocoat_shape shape;
    /** What shape says, finite; points that the shape has no use for are ignored. Default 0. */
    double points[3][3];
    /** Distance of the surface from an isolated skeleton, in m, > 0 and at most 1e9. Default 0.1. */
    double thickness;
    /**
     * Slope of the field at the surface, in 1/m: > 0 and at most 3 isovalue / (radius - thickness); 0 stands for
     * 2 isovalue / (radius - thickness). Default 0.
     */
    double stiffness;
    /** Slope of the field at the skeleton over that at the surface: from 0 to 1e6; 1 is linear. Default 1. */
    double stiffening;
    /**
     * Distance at which the field ends, in m, larger than thickness and at most 1e9; 0 stands for twice the
     * thickness. Default 0.
     */
    double radius;
    /** Number of seeds: from 4 to 65536; 0 stands for the world's. Default 0. */
    uint32_t seed_count;
    /** The host's own; given back, otherwise unused. Default NULL. */
    void *user_data;
} isocoat_skeleton_desc;

/**
 * Fills a descriptor with its defaults; isocoat_skeleton_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_skeleton_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_skeleton_desc_init(isocoat_skeleton_desc *desc, size_t size);

/**
 * Creates a skeleton of a link.
 *
 * - world: not NULL.
 * - link: the link that carries it.
 * - desc: the skeleton; not NULL.
 * - skeleton: receives the handle; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (a plane on a link that is not fixed), CAPACITY.
 * Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_create(isocoat_world *world,
                                       isocoat_link link,
                                       const isocoat_skeleton_desc *desc,
                                       isocoat_skeleton *skeleton);

/**
 * Creates many skeletons, such as those of isocoat_fit_mesh(): all of them, or none if one is refused.
 *
 * - world: not NULL.
 * - links: link_count links; not NULL.
 * - link_count: number of links, at least 1.
 * - descs: count skeletons in a row, all of the struct_size of the first; not NULL unless count is 0.
 * - link_of: for each skeleton, which of the links carries it; NULL if the first one carries all.
 * - count: number of skeletons.
 * - frame: the frame of the descriptors in the world, from which the skeletons are brought to their links as these are
 *   now: the pose of the link for what is given in its frame, the identity for what is given in the world. NULL if each
 *   is in the frame of its own link.
 * - skeletons: receives count handles; NULL when they are not wanted.
 *
 * Errors: as isocoat_skeleton_create, and the message says which element; OUT_OF_RANGE for a link_of too large or a
 * frame that is none. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_create_many(isocoat_world *world,
                                            const isocoat_link *links,
                                            size_t link_count,
                                            const isocoat_skeleton_desc *descs,
                                            const uint32_t *link_of,
                                            size_t count,
                                            const isocoat_pose *frame,
                                            isocoat_skeleton *skeletons);

/**
 * Destroys a skeleton.
 *
 * - world: not NULL.
 * - skeleton: the skeleton; its handle is stale afterwards.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_skeleton_destroy(isocoat_world *world, isocoat_skeleton skeleton);

/**
 * The descriptor of a skeleton. A segment or triangle without extent comes back as the shape that it is, a plane with
 * a unit normal, a box with a rotation of at most pi.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - desc: receives it; not NULL, with struct_size set.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_get_desc(const isocoat_world *world,
                                         isocoat_skeleton skeleton,
                                         isocoat_skeleton_desc *desc);

/**
 * Changes a skeleton, from the next step or query on.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - desc: the new descriptor, whole; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_set_desc(isocoat_world *world,
                                         isocoat_skeleton skeleton,
                                         const isocoat_skeleton_desc *desc);

/**
 * Takes a skeleton out of the simulation, or puts it back. New skeletons are enabled.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - enabled: whether it takes part.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_set_enabled(isocoat_world *world,
                                            isocoat_skeleton skeleton,
                                            bool enabled);

/**
 * Whether a skeleton takes part in the simulation. The skeletons of a disabled link keep their own answer.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - enabled: receives the answer; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_is_enabled(const isocoat_world *world,
                                           isocoat_skeleton skeleton,
                                           bool *enabled);

/**
 * The host's own pointer of a skeleton.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - user_data: receives the pointer; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_get_user_data(const isocoat_world *world,
                                              isocoat_skeleton skeleton,
                                              void **user_data);

/**
 * The link of a skeleton.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - link: receives the handle; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_get_link(const isocoat_world *world,
                                         isocoat_skeleton skeleton,
                                         isocoat_link *link);

/* ---- Blend graphs ------------------------------------------------------------------------------------------------ */

/**
 * Sets how much two skeletons of a body blend: 1 adds their fields, with 0 the larger counts. New bodies blend all
 * over. Skeletons of different links collide, as far as they don't blend, if isocoat_body_desc::self_contact is 1; but
 * not in the territory of a third that blends with both.
 *
 * - world: not NULL.
 * - a, b: two skeletons of one body.
 * - weight: from 0 to 1.
 * - duration: time that the change takes, in s; 0 for at once.
 *
 * Errors: INVALID_HANDLE, OUT_OF_RANGE, UNSUPPORTED (skeletons of two bodies; the same skeleton; a graph with more than
 * 4096 groups of skeletons that all blend). Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_set_blend(isocoat_world *world,
                                          isocoat_skeleton a,
                                          isocoat_skeleton b,
                                          double weight,
                                          double duration);

/**
 * How much two skeletons of a body blend now.
 *
 * - world: not NULL.
 * - a, b: two skeletons of one body.
 * - weight: receives the weight, from 0 to 1; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_get_blend(const isocoat_world *world,
                                          isocoat_skeleton a,
                                          isocoat_skeleton b,
                                          double *weight);

/**
 * Lets exactly those skeletons of a body blend that are of the same link, or of two links that are joined; also those
 * created later. Weights set before are forgotten; not which pairs may not collide.
 *
 * - world: not NULL.
 * - body: the body.
 * - joints: 2 handles a joint, links of the body; not NULL unless count is 0.
 * - count: number of joints.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE (more than 1024 skeletons), UNSUPPORTED (a link of another
 * body; a link joined to itself; a graph with more than 4096 groups of skeletons that all blend). Threads: changes the
 * world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_blend_neighbours(isocoat_world *world,
                                             isocoat_body body,
                                             const isocoat_link *joints,
                                             size_t count);

/**
 * Lets all skeletons of a body blend, as in the beginning; also forgets which pairs may not collide.
 *
 * - world: not NULL.
 * - body: the body.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_body_blend_all(isocoat_world *world, isocoat_body body);

/**
 * Says whether two skeletons of a body may collide where they don't blend; they may, unless told otherwise.
 *
 * - world: not NULL.
 * - a, b: two skeletons of one body.
 * - enabled: whether they may collide.
 *
 * Errors: INVALID_HANDLE, OUT_OF_RANGE (more than 1024 skeletons), UNSUPPORTED. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_set_pair_contact(isocoat_world *world,
                                                 isocoat_skeleton a,
                                                 isocoat_skeleton b,
                                                 bool enabled);

/* ---- Springs ----------------------------------------------------------------------------------------------------- */

/**
 * A damped spring between points of two links of one body; a fixed or host-driven link is an anchor. It pulls with
 * stiffness * (length - rest_length) + damping * (rate of lengthening) on both ends, along the line through them. Begin
 * with isocoat_spring_desc_default().
 */
typedef struct isocoat_spring_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** 0. */
    uint32_t reserved;
    /** The links that it joins: two of one body. Default null. */
    isocoat_link links[2];
    /** Where its ends are, each in the frame of its link, in m, finite; 0 on a point mass. Default 0. */
    double points[2][3];
    /** Length without force, in m, from 0 to 1e9; 0 is a spring that pulls its ends together. Default 0. */
    double rest_length;
    /** Force a metre of stretch, in N/m, from 0 to 1e18. Default 0. */
    double stiffness;
    /** Force a metre a second of lengthening, in N s/m, from 0 to 1e18. Default 0. */
    double damping;
    /** The host's own; given back, otherwise unused. Default NULL. */
    void *user_data;
} isocoat_spring_desc;

/** What a spring does at the present poses and velocities of its links. */
typedef struct isocoat_spring_state {
    /** Distance of its ends, in m. */
    double length;
    /** How fast that grows, in m/s. */
    double rate;
    /** Pull on its ends, damping included; negative when it pushes them apart; in N. */
    double tension;
    /** Elastic energy, in J. */
    double energy;
} isocoat_spring_state;

/**
 * Fills a descriptor with its defaults; isocoat_spring_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_spring_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_spring_desc_init(isocoat_spring_desc *desc, size_t size);

/**
 * Creates a spring. A body is solved implicitly, unless another response is asked for, when one of its springs is stiff
 * for the step: stiffness * dt^2 * (1 / mass_a + 1 / mass_b) > 0.09.
 *
 * - world: not NULL.
 * - desc: the spring; not NULL.
 * - spring: receives the handle; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (links of two bodies, or one link twice),
 * CAPACITY. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_spring_create(isocoat_world *world,
                                     const isocoat_spring_desc *desc,
                                     isocoat_spring *spring);

/**
 * Creates many springs: all of them, or none if one is refused.
 *
 * - world: not NULL.
 * - descs: count springs in a row, all of the struct_size of the first; not NULL unless count is 0.
 * - count: number of springs.
 * - springs: receives count handles; NULL when they are not wanted.
 *
 * Errors: as isocoat_spring_create; the message says which element. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_spring_create_many(isocoat_world *world,
                                          const isocoat_spring_desc *descs,
                                          size_t count,
                                          isocoat_spring *springs);

/**
 * Destroys a spring. One whose link is destroyed goes with it.
 *
 * - world: not NULL.
 * - spring: the spring.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_spring_destroy(isocoat_world *world, isocoat_spring spring);

/**
 * The descriptor of a spring.
 *
 * - world: not NULL.
 * - spring: the spring.
 * - desc: receives it; not NULL, with struct_size set.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_spring_get_desc(const isocoat_world *world,
                                       isocoat_spring spring,
                                       isocoat_spring_desc *desc);

/**
 * Changes a spring, from the next step on. Its links may change within its body.
 *
 * - world: not NULL.
 * - spring: the spring.
 * - desc: the new descriptor, whole; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_spring_set_desc(isocoat_world *world,
                                       isocoat_spring spring,
                                       const isocoat_spring_desc *desc);

/**
 * Length, tension and energy of a spring at the present poses and velocities of its links.
 *
 * - world: not NULL.
 * - spring: the spring.
 * - state: receives them; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_spring_get_state(const isocoat_world *world,
                                        isocoat_spring spring,
                                        isocoat_spring_state *state);

/**
 * The host's own pointer of a spring.
 *
 * - world: not NULL.
 * - spring: the spring.
 * - user_data: receives the pointer; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_spring_get_user_data(const isocoat_world *world,
                                            isocoat_spring spring,
                                            void **user_data);

/**
 * The springs of a body, in the order of their creation.
 *
 * - world: not NULL.
 * - body: the body.
 * - springs: receives the handles; NULL with capacity 0 asks for the count only.
 * - capacity: handles that springs can hold.
 * - count: receives the number of springs, also when springs is too small; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_get_springs(const isocoat_world *world,
                                        isocoat_body body,
                                        isocoat_spring *springs,
                                        size_t capacity,
                                        size_t *count);

/* ---- Motion of one link ------------------------------------------------------------------------------------------ */

/** Position, orientation and velocities of a link. */
typedef struct isocoat_link_state {
    /** The link's frame in the world. */
    isocoat_pose pose;
    /** Velocity of the centre of mass in the world, in m/s, finite. */
    double linear_velocity[3];
    /** Angular velocity in the world, in rad/s, finite. */
    double angular_velocity[3];
} isocoat_link_state;

/**
 * The state of a link.
 *
 * - world: not NULL.
 * - link: the link.
 * - state: receives it; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_get_state(const isocoat_world *world,
                                      isocoat_link link,
                                      isocoat_link_state *state);

/**
 * Sets the state of a link: every tick for a host-driven one, before the step. What differs from what the last
 * impulse commanded counts as the host's own push; a jump of more than half the thinnest coat counts as a teleport.
 *
 * - world: not NULL.
 * - link: the link.
 * - state: the state; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: changes the world.
 * For many links at once see isocoat_world_set_link_states.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_set_state(isocoat_world *world,
                                      isocoat_link link,
                                      const isocoat_link_state *state);

/**
 * Sets the state of a link and forgets its contact history: after a respawn or a restored game.
 *
 * - world: not NULL.
 * - link: the link.
 * - state: the state; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_teleport(isocoat_world *world,
                                     isocoat_link link,
                                     const isocoat_link_state *state);

/**
 * Mean force and torque of contacts and springs on a link over the last step, about its centre of mass; 0 before the
 * first step. Over a body without anchors those of its springs add up to nothing.
 *
 * - world: not NULL.
 * - link: the link, of any kind.
 * - wrench: receives it, in N and N m; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_get_wrench(const isocoat_world *world,
                                       isocoat_link link,
                                       isocoat_wrench *wrench);

/**
 * The impulse and angular impulse that the host is to apply at the centre of mass of a host-driven link, before it
 * advances it by the length of the last step. The host's own tick is then: set states, step, apply impulses, advance.
 *
 * - world: not NULL.
 * - link: the link; 0 for kinematic links and those that the library integrates.
 * - impulse: receives it, in N s and N m s; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 * For many links at once see isocoat_world_get_link_impulses.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_get_impulse(const isocoat_world *world,
                                        isocoat_link link,
                                        isocoat_wrench *impulse);

/**
 * Adds a force for the coming step only.
 *
 * - world: not NULL.
 * - link: a link that the library integrates (ISOCOAT_LINK_POINT_MASS, ISOCOAT_LINK_RIGID).
 * - force: 3 doubles, in N, in the world, finite; not NULL.
 * - point: 3 doubles, where it acts in the world, in m, finite; NULL for the centre of mass.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED for other links: the host pushes its own bodies
 * itself. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_apply_force(isocoat_world *world,
                                        isocoat_link link,
                                        const double force[3],
                                        const double point[3]);

/**
 * Adds a torque for the coming step only.
 *
 * - world: not NULL.
 * - link: a link that the library integrates.
 * - torque: 3 doubles, in N m, in the world, finite; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_apply_torque(isocoat_world *world,
                                         isocoat_link link,
                                         const double torque[3]);

/**
 * Adds an impulse at the start of the coming step.
 *
 * - world: not NULL.
 * - link: a link that the library integrates.
 * - impulse: 3 doubles, in N s, in the world, finite; not NULL.
 * - point: 3 doubles, where it acts in the world, in m, finite; NULL for the centre of mass.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_apply_impulse(isocoat_world *world,
                                          isocoat_link link,
                                          const double impulse[3],
                                          const double point[3]);

/**
 * Adds an angular impulse at the start of the coming step.
 *
 * - world: not NULL.
 * - link: a link that the library integrates.
 * - impulse: 3 doubles, in N m s, in the world, finite; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_apply_angular_impulse(isocoat_world *world,
                                                  isocoat_link link,
                                                  const double impulse[3]);

/**
 * Says whether joints or contacts of its host's own act on a host-driven link in this tick: the flag
 * ISOCOAT_LINK_CONSTRAINED, cheap enough for every tick. Does nothing to links of other kinds.
 *
 * - world: not NULL.
 * - link: the link.
 * - constrained: 0 for no, anything else for yes.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_set_constrained(isocoat_world *world,
                                            isocoat_link link,
                                            uint32_t constrained);

/**
 * Sets the accelerations of a link besides gravity and contact, until they are set again: for a host-driven link, what
 * the host adds by itself in a tick besides gravity_scale times the world's gravity.
 *
 * - world: not NULL.
 * - link: the link.
 * - linear: 3 doubles, in m/s^2, in the world, finite; not NULL.
 * - angular: 3 doubles, in rad/s^2, in the world, finite; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_link_set_external_acceleration(isocoat_world *world,
                                                      isocoat_link link,
                                                      const double linear[3],
                                                      const double angular[3]);

/* ---- Bulk calls -------------------------------------------------------------------------------------------------- */

/** Number type of a buffer: an ISOCOAT_FORMAT_ value. */
typedef uint32_t isocoat_format;

/** Numbers are double. */
#define ISOCOAT_FORMAT_F64 0u
/** Numbers are float, rounded to nearest. */
#define ISOCOAT_FORMAT_F32 1u

/**
 * Where a bulk call writes: elements of 3 or 4 numbers in the host's own memory, such as a field of its own structs.
 */
typedef struct isocoat_buffer {
    /** First number of the first element; NULL when this result is not wanted. */
    void *data;
    /** Bytes from one element to the next: at least the size of an element, or 0 for elements without gaps. */
    size_t stride;
    /** Number type. */
    isocoat_format format;
} isocoat_buffer;

/** Where a bulk call reads: elements of 3 numbers, or one, in the host's own memory. */
typedef struct isocoat_const_buffer {
    /** First number of the first element; NULL when there are none. */
    const void *data;
    /** Bytes from one element to the next: at least the size of an element, or 0 for elements without gaps. */
    size_t stride;
    /** Number type. */
    isocoat_format format;
} isocoat_const_buffer;

/**
 * Sets the states of many links, as isocoat_link_set_state does: all of them, or none if one is refused.
 *
 * - world: not NULL.
 * - links: count handles; not NULL unless count is 0. Of a link that is named twice, the last state holds.
 * - states: count states; not NULL unless count is 0.
 * - count: number of links.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE; the message says which element. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_set_link_states(isocoat_world *world,
                                             const isocoat_link *links,
                                             const isocoat_link_state *states,
                                             size_t count);

/**
 * Positions and orientations of many links.
 *
 * - world: not NULL.
 * - links: count handles; not NULL unless count is 0.
 * - count: number of links.
 * - positions: receives 3 numbers a link, in m; skipped if its data is NULL.
 * - orientations: receives 4 numbers a link, a quaternion x, y, z, w; skipped if its data is NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT; nothing is written then. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_get_link_states(const isocoat_world *world,
                                             const isocoat_link *links,
                                             size_t count,
                                             isocoat_buffer positions,
                                             isocoat_buffer orientations);

/**
 * Mean forces and torques of contacts and springs on many links over the last step, as isocoat_link_get_wrench gives
 * them.
 *
 * - world: not NULL.
 * - links: count handles; not NULL unless count is 0.
 * - count: number of links.
 * - linear: receives 3 numbers a link, the force in N; skipped if its data is NULL.
 * - angular: receives 3 numbers a link, the torque about the centre of mass in N m; skipped if its data is NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT; nothing is written then. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_get_link_wrenches(const isocoat_world *world,
                                               const isocoat_link *links,
                                               size_t count,
                                               isocoat_buffer linear,
                                               isocoat_buffer angular);

/**
 * The impulses that the host is to apply to many host-driven links, as isocoat_link_get_impulse gives them.
 *
 * - world: not NULL.
 * - links: count handles; not NULL unless count is 0.
 * - count: number of links.
 * - linear: receives 3 numbers a link, the impulse in N s; skipped if its data is NULL.
 * - angular: receives 3 numbers a link, the angular impulse in N m s; skipped if its data is NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT; nothing is written then. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_get_link_impulses(const isocoat_world *world,
                                               const isocoat_link *links,
                                               size_t count,
                                               isocoat_buffer linear,
                                               isocoat_buffer angular);

/* ---- Articulations ----------------------------------------------------------------------------------------------- */

/**
 * Says which host-driven links move each other through the host's joints, and how, in place of all that was said
 * before. The implicit response then solves the contacts of these links together: links on joints may touch
 * anything, several at once, without an estimate of what holds them. Other responses take each link by itself, with
 * its own mass or inverse_effective_inertia.
 *
 * Give it before a step wherever links on joints touch; only those that touch need be named. What the joints do by
 * themselves belongs in isocoat_link_set_external_acceleration. After the step the host passes each impulse on
 * through its joints: bodies must move as the matrix says.
 *
 * It holds until it is said again, or until a link is destroyed, changes its kind or loses its mass, which ends its
 * articulation. Snapshots keep it.
 *
 * - world: not NULL.
 * - links: all links, articulation after articulation: host-driven, with a mass, each once; not NULL unless count
 *   is 0.
 * - link_counts: number of links of each articulation, from 1 to 256; not NULL unless count is 0.
 * - inverse_inertias: the matrices, one after the other: 6n rows of 6n numbers for n links, from impulses on all
 *   links, about their centres of mass, to the changes of their velocities, in the world; for each link first the
 *   linear part, then the angular one. Symmetric and positive definite; with joint inertia H and Jacobians J of the
 *   links it is J H^-1 J^T, plus a millionth of the bodies' own inverse inertia where that is singular. Not NULL
 *   unless count is 0; aligned as double.
 * - count: number of articulations; 0 ends all.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (a link that is not host-driven, has no mass,
 * or is named twice); nothing is changed then. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_set_articulations(isocoat_world *world,
                                               const isocoat_link *links,
                                               const size_t *link_counts,
                                               const double *inverse_inertias,
                                               size_t count);

/* ---- Threads of the host ----------------------------------------------------------------------------------------- */

/**
 * Work of a step, for a thread of the host: to be called once, with the pointer that came along. It returns when the
 * step has no more to do.
 *
 * - task: as given to isocoat_enqueue_task_fn.
 */
typedef void (*isocoat_task_fn)(void *task);

/**
 * Hands a task to the host's threads; called in a step, on the thread that steps, up to worker_count - 1 times before
 * the work begins.
 *
 * - context: as given to isocoat_world_set_tasks.
 * - run, task: what a thread of the host is to call, run(task), as soon as it can. A call on the thread that steps is
 *   wasted: it returns at once.
 *
 * Returns what isocoat_finish_task_fn needs to know it by; NULL refuses it, and the step does without. It must return
 * (no longjmp, no exception); calls on the world from here give ISOCOAT_ERROR_LOCKED.
 */
typedef void *(*isocoat_enqueue_task_fn)(void *context, isocoat_task_fn run, void *task);

/**
 * Waits for a task; called in a step, on the thread that steps, once for each that was taken.
 *
 * - context: as given to isocoat_world_set_tasks.
 * - handle: what isocoat_enqueue_task_fn returned for it.
 *
 * It must return, when the task has returned or will never be run any more.
 */
typedef void (*isocoat_finish_task_fn)(void *context, void *handle);

/**
 * Sets whose threads help with the steps of a world. Without, a step is the work of the thread that calls it; the
 * library starts no threads. Results are the same bits for any number of workers, and whatever the host's threads do.
 *
 * - world: not NULL.
 * - worker_count: how many may work at once, the thread that steps included: from 1 to 64. Helpers keep their threads
 *   busy for the whole step: not more than there are cores.
 * - enqueue, finish: the functions; both NULL for none.
 * - context: given to them, otherwise unused; may be NULL. It must outlive the world or the next set.
 *
 * Errors: OUT_OF_RANGE, INVALID_ARGUMENT. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_set_tasks(isocoat_world *world,
                                       uint32_t worker_count,
                                       isocoat_enqueue_task_fn enqueue,
                                       isocoat_finish_task_fn finish,
                                       void *context);

/* ---- What a step reports ----------------------------------------------------------------------------------------- */

/**
 * Where the time of the last step went, in s; zero unless isocoat_world_desc::timed asked for it. Begin with
 * isocoat_times_default().
 */
typedef struct isocoat_times {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** 0. */
    uint32_t reserved;
    /** The whole step. */
    double step;
    /** Taking over states, forces and impulses. */
    double begin;
    /** Broad phase: pairs whose bounds meet, with the filter; what of their coats can matter. */
    double pairs;
    /** Groups of bodies that are stepped together. */
    double islands;
    /** Forces and motion. */
    double respond;
    /** Of that, contact surfaces; added up over workers where groups are stepped side by side. */
    double contact;
    /** Of that, what follows from the surfaces: systems, velocities, friction; added up likewise. */
    double solve;
    /** Handing back poses and impulses, contacts and events; falling asleep. */
    double report;
    /** Particles of substances, and the volumes of their coats. */
    double substances;
} isocoat_times;

/** Figures of the last step. Begin with isocoat_counters_default(). */
typedef struct isocoat_counters {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** Live bodies. */
    uint32_t bodies;
    /** Live links. */
    uint32_t links;
    /** Live skeletons. */
    uint32_t skeletons;
    /** Pairs of bodies whose bounds met. */
    uint32_t pairs;
    /** Groups of bodies that were stepped together. */
    uint32_t islands;
    /** Sub-steps of the group that took the most, of those that were not solved implicitly. */
    uint32_t substeps;
    /** Pieces of contact surface at the end of the step, and push-outs: as many as there are contacts. */
    uint32_t patches;
    /** Evaluations of a pair of fields. Contacts at rest need none: their surfaces stand from the last step. */
    uint64_t evaluations;
    /** Rounds of the implicitly solved group that took the most, with those of all parts of a split step. */
    uint32_t implicit_rounds;
    /** Splits of the implicitly solved group that took the most. */
    uint32_t implicit_splits;
    /**
     * Evaluations of a pair of fields by each scheme, at its ISOCOAT_SCHEME_ value; at ISOCOAT_SCHEME_AUTO those of
     * searches that found no patch. The rest is 0.
     */
    uint64_t evaluations_by_scheme[8];
    /** Pieces of contact surface that each scheme integrated, in all rounds and sub-steps; likewise. */
    uint64_t patches_by_scheme[8];
    /** Bodies asleep. */
    uint32_t asleep;
    /** 0. */
    uint32_t reserved;
} isocoat_counters;

/** One connected piece of contact surface between two coats. */
typedef struct isocoat_contact {
    /** The first body. */
    isocoat_body body_a;
    /** The second body. */
    isocoat_body body_b;
    /** The link of the first body whose field is the highest at the deepest point; null where that is a substance. */
    isocoat_link link_a;
    /** The same of the second. */
    isocoat_link link_b;
    /**
     * The skeleton of the first body whose territory holds the deepest point; null on both sides where one of them is
     * a substance.
     */
    isocoat_skeleton skeleton_a;
    /** The same of the second. */
    isocoat_skeleton skeleton_b;
    /** Centre of pressure, in m. */
    double position[3];
    /** Mean normal, from a to b. */
    double normal[3];
    /** Force on b of pressure and dissipation, in N; a has the opposite. Friction is in the wrenches of links only. */
    double force[3];
    /** Torque on b about position, in N m; a has the opposite. */
    double torque[3];
    /** Area of the surface, in m^2. */
    double area;
    /** Highest pressure, in Pa. */
    double peak_pressure;
    /** Normal stiffness, in N/m: the integral of g_a g_b / (g_a + g_b) over the surface. */
    double stiffness;
    /** Estimated relative error of the elastic force. */
    double error_estimate;
    /** How often the two fields were evaluated. */
    uint32_t evaluations;
    /** The scheme that integrated it. */
    isocoat_scheme scheme;
    /**
     * 1 if the load is past the most that this contact can carry, else 0. The push-out that parts the two then is a
     * contact of its own, with an area, a peak_pressure and a stiffness of 0 and an error_estimate of 1.
     */
    uint32_t overloaded;
    /** 0. */
    uint32_t reserved;
} isocoat_contact;

/** What happened to a pair of bodies: an ISOCOAT_EVENT_ value. More may come. */
typedef uint32_t isocoat_event_kind;

/**
 * The coats began to touch. Of a body with itself, whose events name it twice, there is one for each pair of groups of
 * its parts: count them.
 */
#define ISOCOAT_EVENT_BEGIN 0u
/** The coats stopped touching. */
#define ISOCOAT_EVENT_END 1u
/** The contact went past the most it can carry. */
#define ISOCOAT_EVENT_OVERLOAD 2u

/** A change between two bodies in the last step. */
typedef struct isocoat_event {
    /** What happened. */
    isocoat_event_kind kind;
    /** 0. */
    uint32_t reserved;
    /** The first body; it may have been destroyed since. */
    isocoat_body body_a;
    /** The second body; it may have been destroyed since. */
    isocoat_body body_b;
} isocoat_event;

/**
 * Fills times with zeros and their size; isocoat_times_default() calls it.
 *
 * - times: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_times) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_times_init(isocoat_times *times, size_t size);

/**
 * Where the time of the last step went.
 *
 * - world: not NULL.
 * - times: receives it; not NULL, with struct_size set.
 *
 * Errors: INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_world_get_times(const isocoat_world *world, isocoat_times *times);

/**
 * Fills counters with zeros and their size; isocoat_counters_default() calls it.
 *
 * - counters: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_counters) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_counters_init(isocoat_counters *counters, size_t size);

/**
 * The contacts of the last step; of a sub-stepped one, as they were in its last sub-step; of bodies asleep, as they
 * were when these fell asleep. The last come first.
 *
 * - world: not NULL.
 * - contacts: receives a pointer to them (not to be freed); not NULL.
 * - count: receives their number; not NULL.
 *
 * Errors: INVALID_ARGUMENT. Threads: reads the world. Lifetime: until the next step, restore or destroy
 * of the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_get_contacts(const isocoat_world *world,
                                          const isocoat_contact **contacts,
                                          size_t *count);

/**
 * What began, ended or was overloaded in the last step.
 *
 * - world: not NULL.
 * - events: receives a pointer to them (not to be freed); not NULL.
 * - count: receives their number; not NULL.
 *
 * Errors: INVALID_ARGUMENT. Threads: reads the world. Lifetime: until the next step, restore or destroy
 * of the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_get_events(const isocoat_world *world,
                                        const isocoat_event **events,
                                        size_t *count);

/**
 * Figures of the last step, and how many objects live now.
 *
 * - world: not NULL.
 * - counters: receives them; not NULL, with struct_size set.
 *
 * Errors: INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_get_counters(const isocoat_world *world,
                                          isocoat_counters *counters);

/* ---- Snapshots --------------------------------------------------------------------------------------------------- */

/**
 * Takes a snapshot of a world: everything that lasts between steps, forces and impulses that wait for the next step
 * included, but for the log, the pair filter, contacts and events. Restored and stepped on, it gives the same bits as
 * never having stopped. It asks for no memory.
 *
 * - world: not NULL.
 * - buffer: receives the snapshot, little endian on every machine; NULL with capacity 0 asks for the size only. Other
 *   calls may change the size.
 * - capacity: bytes in buffer.
 * - size: receives the bytes of the snapshot, also when buffer is too small; not NULL.
 *
 * Pointers in user_data are kept as numbers. Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_snapshot(const isocoat_world *world,
                                      uint8_t *buffer,
                                      size_t capacity,
                                      size_t *size);

/**
 * Puts a world back to what a snapshot says. Log, pair filter and tasks stay; until the next step there are no events,
 * no figures, and no contacts but those of bodies asleep.
 *
 * - world: not NULL.
 * - buffer: the snapshot; not NULL.
 * - size: its bytes, neither more nor fewer.
 *
 * Handles: in the world that took the snapshot, those taken before it are valid again, and those of what was created
 * after it are stale for ever. In any other world, of another process too, the snapshot's objects take the place of
 * all there was, and every handle given out so far is invalid; isocoat_world_get_bodies, isocoat_body_get_links,
 * isocoat_body_get_springs and isocoat_link_get_skeletons give the new ones. Their index and generation are those in
 * the world that took it.
 *
 * Errors: SNAPSHOT for what is damaged, cut short, of another format, or of a state that no world can be in, such as
 * one with a number that is none; the world is then as it was. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_world_restore(isocoat_world *world, const uint8_t *buffer, size_t size);

/* ---- Recordings -------------------------------------------------------------------------------------------------- */

/** A recording to be played, and the world that shows one of its frames. */
typedef struct isocoat_playback isocoat_playback;

/** A recording under way. It belongs to no world, and outlives them. */
typedef struct isocoat_recorder isocoat_recorder;

/**
 * Takes the next bytes of a recording, as a file would.
 *
 * - context: as in isocoat_recorder_desc.
 * - bytes: the bytes; valid during the call.
 * - size: how many.
 *
 * Returns whether it took them all; after it has not, the recording can only be destroyed. It must return (no longjmp,
 * no exception). It may read the world, but not change it.
 */
typedef bool (*isocoat_write_fn)(void *context, const uint8_t *bytes, size_t size);

/** How to record. Begin with isocoat_recorder_desc_default(). */
typedef struct isocoat_recorder_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /**
     * Every how many frames one is written by itself, from 1 to 65536: to go to any frame, at most so many are read.
     * Default 60.
     */
    uint32_t key_interval;
    /** Given to write, otherwise unused. Default NULL. */
    void *context;
    /** Takes the bytes as they come; NULL keeps them in memory, for isocoat_recorder_get_bytes. Default NULL. */
    isocoat_write_fn write;
} isocoat_recorder_desc;

/**
 * Fills a descriptor with its defaults; isocoat_recorder_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_recorder_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_recorder_desc_init(isocoat_recorder_desc *desc, size_t size);

/**
 * Begins a recording.
 *
 * - desc: how to record; not NULL.
 * - recorder: receives it; not NULL. Destroy it with isocoat_recorder_destroy.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE. Threads: any.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_recorder_create(const isocoat_recorder_desc *desc,
                                       isocoat_recorder **recorder);

/**
 * Destroys a recorder. A recording to a stream that has not been finished is refused later as cut short.
 *
 * - recorder: NULL does nothing.
 *
 * Errors: LOCKED while another call uses it; it then lives on. Threads: the recorder by this thread alone.
 */
isocoat_status isocoat_recorder_destroy(isocoat_recorder *recorder);

/**
 * Takes a frame of a world as it is now: call it after each step, or as often as frames are wanted. A frame has what
 * the surfaces of all bodies follow from, in contact and with bulges too; not velocities, forces, springs, contacts or
 * what is at rest.
 *
 * - recorder: not NULL.
 * - world: not NULL; the same for all frames.
 * - time: when this is, in s, finite and not before the last frame.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (it is finished, or its stream has failed), STREAM, CAPACITY,
 * LOCKED; but for STREAM the recording is as it was. Threads: reads the world; the recorder by this thread alone.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_recorder_capture(isocoat_recorder *recorder,
                                        const isocoat_world *world,
                                        double time);

/**
 * How much has been recorded.
 *
 * - recorder: not NULL.
 * - frame_count: receives the number of frames; not NULL.
 * - size: receives the bytes so far, without the index; not NULL.
 *
 * Errors: INVALID_ARGUMENT, LOCKED. Threads: the recorder by this thread alone.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_recorder_get_size(const isocoat_recorder *recorder,
                                         uint32_t *frame_count,
                                         uint64_t *size);

/**
 * Ends a recording that goes to a stream: hands over the index, without which it is refused as cut short. Nothing can
 * follow.
 *
 * - recorder: not NULL.
 *
 * Errors: INVALID_ARGUMENT, UNSUPPORTED (in memory, finished, or its stream has failed), STREAM, LOCKED. Threads: the
 * recorder by this thread alone.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_recorder_finish(isocoat_recorder *recorder);

/**
 * The recording in memory so far, whole: a file of these bytes can be played. It may go on afterwards.
 *
 * - recorder: not NULL.
 * - buffer: receives the bytes, little endian on every machine; NULL with capacity 0 asks for the size only.
 * - capacity: bytes in buffer.
 * - size: receives the bytes of the recording, also when buffer is too small; not NULL.
 *
 * Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL, UNSUPPORTED (it goes to a stream), LOCKED. Threads: the recorder by this
 * thread alone.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_recorder_get_bytes(const isocoat_recorder *recorder,
                                          uint8_t *buffer,
                                          size_t capacity,
                                          size_t *size);

/**
 * Opens a recording and checks all of it.
 *
 * - bytes: the recording, which is copied; not NULL.
 * - size: its bytes, neither more nor fewer.
 * - playback: receives it; not NULL. Destroy it with isocoat_playback_destroy.
 *
 * Errors: INVALID_ARGUMENT, CAPACITY; RECORDING for what is damaged, cut short or of another format: the message says
 * what is wrong and where. Threads: any.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_playback_create(const uint8_t *bytes,
                                       size_t size,
                                       isocoat_playback **playback);

/**
 * Destroys a playback with its world.
 *
 * - playback: NULL does nothing.
 *
 * Errors: LOCKED while its world is used; it then lives on. Threads: the playback by this thread alone.
 */
isocoat_status isocoat_playback_destroy(isocoat_playback *playback);

/**
 * Number of frames of a recording.
 *
 * - playback: not NULL.
 * - frame_count: receives it; not NULL.
 *
 * Errors: INVALID_ARGUMENT, LOCKED. Threads: reads the playback's world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_playback_get_frame_count(const isocoat_playback *playback,
                                                uint32_t *frame_count);

/**
 * When a frame was taken.
 *
 * - playback: not NULL.
 * - frame: the frame, below the number of frames.
 * - time: receives the time that it was captured with, in s; not NULL.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE, LOCKED. Threads: reads the playback's world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_playback_get_time(const isocoat_playback *playback,
                                         uint32_t frame,
                                         double *time);

/**
 * Shows a frame in the playback's world. The next frame is the cheapest; any other costs at most key_interval frames.
 *
 * - playback: not NULL.
 * - frame: the frame, below the number of frames.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE, RECORDING, LOCKED while the world is used; the world then shows what it did.
 * Threads: changes the playback's world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_playback_seek(isocoat_playback *playback, uint32_t frame);

/**
 * The world that shows a frame of a recording, to be asked everything that needs no step: rays, fields, closest points,
 * meshes, pieces. It is at rest, without springs, contacts or events, and nobody can change it: calls that would give
 * UNSUPPORTED. A snapshot of it, restored in a world of the host's own, steps on from there. Before the first
 * isocoat_playback_seek it is empty.
 *
 * - playback: not NULL.
 * - world: receives it; not NULL. It belongs to the playback, and lives as long.
 *
 * Handles stay valid from frame to frame while their objects are there; isocoat_world_get_bodies and the like give
 * them. Their index and generation are those in the world that was recorded.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_playback_get_world(const isocoat_playback *playback,
                                          const isocoat_world **world);

/* ---- Queries ----------------------------------------------------------------------------------------------------- */

/**
 * Which shape of a body a query sees: an ISOCOAT_DEFORMATION_ value. Contacts are those at the present poses, with all
 * enabled bodies whose masks agree; the pair filter is not asked. A rigid body keeps its shape.
 */
typedef uint32_t isocoat_deformation;

/** The coat as if it touched nothing. */
#define ISOCOAT_DEFORMATION_NONE 0u
/** Flattened along its contact surfaces with other bodies. */
#define ISOCOAT_DEFORMATION_CONTACT 1u
/** Flattened, and bulging round its contacts as isocoat_body_desc::bulge_width says. */
#define ISOCOAT_DEFORMATION_BULGES 2u

/** Where a ray meets a coat. */
typedef struct isocoat_ray_hit {
    /** The body. */
    isocoat_body body;
    /** The link that carries the skeleton; null on a substance. */
    isocoat_link link;
    /** The skeleton in whose territory the point lies; null on a substance. */
    isocoat_skeleton skeleton;
    /** Length of the ray up to the point, in m; 0 for a ray that starts inside. */
    double distance;
    /** The point, in m. */
    double position[3];
    /** Outward unit normal of the coat. */
    double normal[3];
} isocoat_ray_hit;

/** A point of a coat's surface. */
typedef struct isocoat_surface_point {
    /** The point, in m. */
    double position[3];
    /** Outward unit normal of the coat. */
    double normal[3];
    /** Distance of the point that was asked about, in m; negative inside the coat. */
    double distance;
    /** The link that carries the skeleton; null on a substance. */
    isocoat_link link;
    /** The skeleton in whose territory the point lies; null on a substance. */
    isocoat_skeleton skeleton;
} isocoat_surface_point;

/**
 * The field of a body at points of the world: f = sum of F(distance) over its skeletons. The surface is where f equals
 * the body's isovalue; inside, f is larger.
 *
 * - world: not NULL.
 * - body: the body.
 * - points: 3 * count doubles, in m, finite; not NULL unless count is 0.
 * - count: number of points.
 * - values: receives count doubles; NULL if not wanted. Must not overlap points or gradients.
 * - gradients: receives 3 * count doubles, the gradients in the world's axes, in 1/m; NULL if not wanted. Must not
 *   overlap points.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_evaluate_field(const isocoat_world *world,
                                           isocoat_body body,
                                           const double *points,
                                           size_t count,
                                           double *values,
                                           double *gradients);

/**
 * isocoat_body_evaluate_field() of a body's shape in contact: f with what contacts add to it. Its surface is where f
 * equals the body's isovalue; away from contacts f is the same to the bit.
 *
 * - world: not NULL.
 * - body: the body.
 * - deformation: which shape, an ISOCOAT_DEFORMATION_ value.
 * - points: 3 * count doubles, in m, finite; not NULL unless count is 0.
 * - count: number of points.
 * - values: receives count doubles; NULL if not wanted. Must not overlap points or gradients.
 * - gradients: receives 3 * count doubles, the gradients in the world's axes, in 1/m; NULL if not wanted. Must not
 *   overlap points.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_evaluate_field_deformed(const isocoat_world *world,
                                                    isocoat_body body,
                                                    isocoat_deformation deformation,
                                                    const double *points,
                                                    size_t count,
                                                    double *values,
                                                    double *gradients);

/**
 * The contacts that two bodies would have at their present poses, or, for one body twice, those of its parts that don't
 * blend. Changes nothing, and asks neither categories nor the pair filter.
 *
 * - world: not NULL.
 * - body_a, body_b: two bodies, or one twice.
 * - scheme: how to integrate, an ISOCOAT_SCHEME_ value.
 * - tolerance: relative error accepted in the force, from 1e-9 to 0.5.
 * - contacts: receives the contacts; NULL with capacity 0 asks for the count only.
 * - capacity: contacts that fit.
 * - count: receives the number of contacts, also when contacts is too small; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED, BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_collide(const isocoat_world *world,
                                     isocoat_body body_a,
                                     isocoat_body body_b,
                                     isocoat_scheme scheme,
                                     double tolerance,
                                     isocoat_contact *contacts,
                                     size_t capacity,
                                     size_t *count);

/**
 * The first coat that a ray meets, among enabled bodies. On a substance, link and skeleton of the hit are null.
 *
 * - world: not NULL.
 * - origin: 3 doubles, in m, finite; not NULL. A ray that starts inside a coat meets it at distance 0.
 * - direction: 3 doubles, of any length but 0, finite; not NULL.
 * - max_distance: length of the ray, in m, at least 0; may be infinite.
 * - mask: bodies whose category has a bit of it are looked at.
 * - hit: receives where it meets, if it does; not NULL.
 * - found: receives whether it meets a coat; not NULL.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_cast_ray(const isocoat_world *world,
                                      const double origin[3],
                                      const double direction[3],
                                      double max_distance,
                                      uint64_t mask,
                                      isocoat_ray_hit *hit,
                                      bool *found);

/**
 * isocoat_world_cast_ray() against the bodies' shapes in contact. Where the field of another body reaches, a chord
 * shorter than 1/1024 of a radius of influence may be missed. On a substance, link and skeleton of the hit are null.
 *
 * - world: not NULL.
 * - origin: 3 doubles, in m, finite; not NULL. A ray that starts inside a coat meets it at distance 0.
 * - direction: 3 doubles, of any length but 0, finite; not NULL.
 * - max_distance: length of the ray, in m, at least 0; may be infinite.
 * - mask: bodies whose category has a bit of it are looked at.
 * - deformation: which shapes, an ISOCOAT_DEFORMATION_ value.
 * - hit: receives where it meets, if it does; not NULL.
 * - found: receives whether it meets a coat; not NULL.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_cast_ray_deformed(const isocoat_world *world,
                                               const double origin[3],
                                               const double direction[3],
                                               double max_distance,
                                               uint64_t mask,
                                               isocoat_deformation deformation,
                                               isocoat_ray_hit *hit,
                                               bool *found);

/**
 * The enabled bodies whose coat comes within a distance of a point, in the order of their handles.
 *
 * - world: not NULL.
 * - center: 3 doubles, in m, finite; not NULL.
 * - radius: the distance, in m, at least 0; 0 finds the coats that contain the point.
 * - mask: bodies whose category has a bit of it are looked at.
 * - bodies: receives the handles; NULL with capacity 0 asks for the count only.
 * - capacity: handles that fit.
 * - count: receives the number of bodies, also when bodies is too small; not NULL.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE, BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_overlap_sphere(const isocoat_world *world,
                                            const double center[3],
                                            double radius,
                                            uint64_t mask,
                                            isocoat_body *bodies,
                                            size_t capacity,
                                            size_t *count);

/**
 * The point of a body's surface that is closest to a point of the world. On a substance, link and
 * skeleton are null.
 *
 * - world: not NULL.
 * - body: the body; it may be disabled.
 * - point: 3 doubles, in m, finite; not NULL. It may be inside.
 * - closest: receives the closest point, if there is one; not NULL.
 * - found: receives whether there is one: not for a body without enabled skeletons or particles; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_closest_point(const isocoat_world *world,
                                          isocoat_body body,
                                          const double point[3],
                                          isocoat_surface_point *closest,
                                          bool *found);

/**
 * isocoat_body_closest_point() of a body's shape in contact. On a substance, link and skeleton are null.
 *
 * - world: not NULL.
 * - body: the body; a disabled one is not deformed.
 * - point: 3 doubles, in m, finite; not NULL. It may be inside.
 * - deformation: which shape, an ISOCOAT_DEFORMATION_ value.
 * - closest: receives the closest point, if there is one; not NULL.
 * - found: receives whether there is one: not for a body without enabled skeletons or particles; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_closest_point_deformed(const isocoat_world *world,
                                                   isocoat_body body,
                                                   const double point[3],
                                                   isocoat_deformation deformation,
                                                   isocoat_surface_point *closest,
                                                   bool *found);

/**
 * The seeds of a skeleton, always in the same order: samples sent out from it until they meet the surface, or the
 * territory of another skeleton.
 *
 * - world: not NULL.
 * - skeleton: the skeleton; a plane has none, nor has a disabled skeleton or link.
 * - positions: receives 3 numbers a seed, in m; skipped if its data is NULL.
 * - normals: receives 3 numbers a seed, the outward unit normal of the field; skipped if its data is NULL.
 * - valid: receives 1 for a seed on the surface, 0 for one that met another territory; NULL if not wanted.
 * - capacity: seeds that fit into each of the three. With all three NULL only the count is asked.
 * - count: receives the number of seeds, also when they do not fit; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_get_seeds(const isocoat_world *world,
                                          isocoat_skeleton skeleton,
                                          isocoat_buffer positions,
                                          isocoat_buffer normals,
                                          uint8_t *valid,
                                          size_t capacity,
                                          size_t *count);

/** Which hit of a ray is wanted: an ISOCOAT_RAY_ value. */
typedef uint32_t isocoat_ray_goal;

/** The first along the ray. */
#define ISOCOAT_RAY_CLOSEST 0u
/** That of any body, which is cheaper where many are in the way: enough to see whether something is. */
#define ISOCOAT_RAY_ANY 1u

/** What many rays have in common. Begin with isocoat_rays_desc_default(). */
typedef struct isocoat_rays_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** Which shapes they meet, an ISOCOAT_DEFORMATION_ value. Default ISOCOAT_DEFORMATION_NONE. */
    isocoat_deformation deformation;
    /** Which hits are wanted, an ISOCOAT_RAY_ value. Default ISOCOAT_RAY_CLOSEST. */
    isocoat_ray_goal goal;
    /** Must be 0. */
    uint32_t reserved;
    /** Bodies whose category has a bit of it are looked at. Default all. */
    uint64_t mask;
    /** Length of all rays in m, at least 0; may be infinite. Default infinite. */
    double max_distance;
} isocoat_rays_desc;

/**
 * Where the hits of many rays go: one element a ray. Of a ray that meets nothing, the distance is infinite, position
 * and normal are 0, and the handles are null. Begin with isocoat_ray_hits_default().
 */
typedef struct isocoat_ray_hits {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** Must be 0. */
    uint32_t reserved;
    /** Receives a number a ray: its length up to the hit, in m. Default: skipped, as its data is NULL. */
    isocoat_buffer distances;
    /** Receives 3 numbers a ray, in m. Default: skipped, as its data is NULL. */
    isocoat_buffer positions;
    /** Receives 3 numbers a ray: the outward unit normal of the coat. Default: skipped, as its data is NULL. */
    isocoat_buffer normals;
    /** Receives the body of each hit. Default NULL: not wanted. */
    isocoat_body *bodies;
    /** Receives the link that carries the skeleton; null on a substance. Default NULL: not wanted. */
    isocoat_link *links;
    /** Receives the skeleton in whose territory the hit lies; null on a substance. Default NULL: not wanted. */
    isocoat_skeleton *skeletons;
} isocoat_ray_hits;

/**
 * Fills a descriptor with its defaults; isocoat_rays_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_rays_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_rays_desc_init(isocoat_rays_desc *desc, size_t size);

/**
 * Fills a struct with its defaults; isocoat_ray_hits_default() calls it.
 *
 * - hits: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_ray_hits) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_ray_hits_init(isocoat_ray_hits *hits, size_t size);

/**
 * What each of many rays meets, as isocoat_world_cast_ray_deformed() finds it. The coats are made ready once for all
 * rays of a call, and each ray then looks only at the skeletons near it: a picture of 512 x 512 rays in one call is
 * many times faster than in single ones. Memory is asked for once a call, none for each ray.
 *
 * - world: not NULL.
 * - desc: what the rays have in common; not NULL.
 * - origins: 3 numbers a ray, in m, finite; its data not NULL unless count is 0.
 * - directions: 3 numbers a ray, of any length but 0, finite; its data not NULL unless count is 0.
 * - max_distances: a number a ray, in m, at least 0, may be infinite; if its data is NULL, the desc's holds for all.
 * - count: number of rays.
 * - hits: where the results go; not NULL. They must not overlap what is read.
 *
 * Errors: INVALID_ARGUMENT, OUT_OF_RANGE, with the number of the ray; nothing is written then. Threads: reads the
 * world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_cast_rays(const isocoat_world *world,
                                       const isocoat_rays_desc *desc,
                                       isocoat_const_buffer origins,
                                       isocoat_const_buffer directions,
                                       isocoat_const_buffer max_distances,
                                       size_t count,
                                       const isocoat_ray_hits *hits);

/* ---- Meshes ------------------------------------------------------------------------------------------------------ */

/**
 * A mesh of triangles, with the memory that making one takes: made again and again it soon asks for no more. It
 * belongs to no world, and outlives them.
 */
typedef struct isocoat_mesh isocoat_mesh;

/** What a mesh knows of its vertices besides: ISOCOAT_MESH_ flags, added up. */
typedef uint32_t isocoat_mesh_attributes;

/** Whose they are: see isocoat_mesh_get_weights(). */
#define ISOCOAT_MESH_WEIGHTS 1u
/** What presses there: see isocoat_mesh_get_pressures(). */
#define ISOCOAT_MESH_PRESSURES 2u

/** What mesh of a body is wanted. Begin with isocoat_mesh_desc_default(). */
typedef struct isocoat_mesh_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** Which shape of the body, an ISOCOAT_DEFORMATION_ value. Default ISOCOAT_DEFORMATION_NONE. */
    isocoat_deformation deformation;
    /**
     * Edge of the cells that the mesh is made of, in m: about the length of its triangles, > 0. What is thinner than
     * a cell may be missed. Of a ball, a quarter of the thickness gives the volume within 3.2 %, an eighth within 1 %.
     * Default 0, which must be replaced.
     */
    double cell_size;
    /** What it is to know of its vertices besides: ISOCOAT_MESH_ flags, added up. Default 0, nothing. */
    isocoat_mesh_attributes attributes;
    /** Must be 0. */
    uint32_t reserved;
} isocoat_mesh_desc;

/** How the territory of a skeleton is shown: an ISOCOAT_TERRITORY_ value. */
typedef uint32_t isocoat_territory_style;

/** A closed mesh with a vertex at each seed. */
#define ISOCOAT_TERRITORY_PATCHES 0u
/** A hexagon for each seed, in the tangent plane there: six vertices, in the order of the seeds. */
#define ISOCOAT_TERRITORY_SCALES 1u

/** A look at a mesh: arrays that belong to it. */
typedef struct isocoat_mesh_view {
    /** 3 doubles a vertex: where it is in the world, in m. */
    const double *positions;
    /** 3 doubles a vertex: the outward unit normal of the surface. */
    const double *normals;
    /** 3 vertices a triangle, counterclockwise from outside. */
    const uint32_t *triangles;
    /**
     * A byte a vertex: 1 if it lies on the coat's surface, 0 if at another territory; NULL for a watertight mesh,
     * where all do.
     */
    const bool *valid;
    /** Number of vertices. */
    size_t vertex_count;
    /** Number of triangles. */
    size_t triangle_count;
} isocoat_mesh_view;

/**
 * Fills a descriptor with its defaults; isocoat_mesh_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_mesh_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_mesh_desc_init(isocoat_mesh_desc *desc, size_t size);

/**
 * Creates an empty mesh.
 *
 * - mesh: receives the mesh; not NULL. Destroy it with isocoat_mesh_destroy.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_mesh_create(isocoat_mesh **mesh);

/**
 * Destroys a mesh. Its views and the pointer itself are void afterwards.
 *
 * - mesh: NULL does nothing.
 *
 * Errors: LOCKED while another call uses it; it then lives on. Threads: the mesh by this thread alone.
 */
isocoat_status isocoat_mesh_destroy(isocoat_mesh *mesh);

/**
 * Makes a watertight mesh of a body's surface, in place of what the mesh was: closed, each edge between two triangles,
 * oriented outwards, with the vertices on the surface; the same input gives the same bits. It is empty for a body
 * without enabled skeletons, and asks for no memory once the mesh has held one as large (of an undeformed body, without
 * attributes).
 *
 * - world: not NULL.
 * - body: the body; it may be disabled. None of its enabled skeletons may be a plane.
 * - desc: cell size, shape and attributes; not NULL.
 * - mesh: receives the mesh; not NULL. After an error it is as it was. Its views are void.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED, CAPACITY for too small a cell size, LOCKED.
 * Threads: reads the world; the mesh by this thread alone.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_make_mesh(const isocoat_world *world,
                                      isocoat_body body,
                                      const isocoat_mesh_desc *desc,
                                      isocoat_mesh *mesh);

/**
 * Makes a mesh of a skeleton's territory from its seeds, valid or not, in place of what the mesh was: for display, at
 * no cost but the seeds'. The meshes of a body's skeletons together show its coat. Which vertices are joined depends
 * only on shape, thickness and number of seeds of the skeleton, so that a host may upload the triangles once.
 *
 * - world: not NULL.
 * - skeleton: the skeleton; the mesh of a plane is empty, and that of a disabled skeleton or link.
 * - style: an ISOCOAT_TERRITORY_ value.
 * - mesh: receives the mesh; not NULL. After an error it is as it was. Its views are void.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, LOCKED. Threads: reads the world; the mesh by this thread alone.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_make_mesh(const isocoat_world *world,
                                          isocoat_skeleton skeleton,
                                          isocoat_territory_style style,
                                          isocoat_mesh *mesh);

/**
 * A look at a mesh, without copying it.
 *
 * - mesh: not NULL.
 * - view: receives pointers into the mesh (not to be freed), which stay valid until it is made again or destroyed; not
 *   NULL.
 *
 * Errors: INVALID_ARGUMENT, LOCKED. Threads: the mesh by this thread alone.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_mesh_get_view(const isocoat_mesh *mesh, isocoat_mesh_view *view);

/**
 * Whose the vertices of a mesh are, without copying it: for each the four skeletons whose fields are the strongest
 * there, with their shares of what these make together, as far as a blend graph lets them count. For textures,
 * materials and bones: the weights of a link are those of its skeletons.
 *
 * - mesh: not NULL. It must have been made by isocoat_body_make_mesh() with ISOCOAT_MESH_WEIGHTS, or it has none.
 * - skeletons: receives a pointer to 4 handles a vertex, the strongest first; null handles where there are fewer, and
 *   on a substance. NULL if the mesh has none. Not NULL itself.
 * - weights: receives a pointer to 4 doubles a vertex, which add up to 1; 0 for null handles. NULL if the mesh has
 *   none. Not NULL itself.
 *
 * Both point into the mesh (not to be freed), and stay valid until it is made again or destroyed.
 *
 * Errors: INVALID_ARGUMENT, LOCKED. Threads: the mesh by this thread alone.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_mesh_get_weights(const isocoat_mesh *mesh,
                                        const isocoat_skeleton **skeletons,
                                        const double **weights);

/**
 * What presses on the vertices of a mesh, without copying it: the elastic pressure of contacts, without friction and
 * dissipation. It is that of the body's own coat, and of a rigid body that of the coat that presses on it; 0 where
 * nothing presses. Of a deformable body it makes sense in the shapes ISOCOAT_DEFORMATION_CONTACT and _BULGES: its
 * undeformed surface has no pressure yet.
 *
 * - mesh: not NULL. It must have been made by isocoat_body_make_mesh() with ISOCOAT_MESH_PRESSURES, or it has none.
 * - pressures: receives a pointer to a double a vertex, in Pa, at least 0; it points into the mesh (not to be freed),
 *   and stays valid until that is made again or destroyed. NULL if the mesh has none. Not NULL itself.
 *
 * Errors: INVALID_ARGUMENT, LOCKED. Threads: the mesh by this thread alone.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_mesh_get_pressures(const isocoat_mesh *mesh, const double **pressures);

/**
 * Copies a mesh into the host's own memory, strided and in either precision; isocoat_mesh_get_view() says how large it
 * is.
 *
 * - mesh: not NULL.
 * - positions: receives 3 numbers a vertex, in m; skipped if its data is NULL.
 * - normals: receives 3 numbers a vertex; skipped if its data is NULL.
 * - vertex_capacity: vertices that fit into each of the two.
 * - triangles: receives 3 vertices a triangle; NULL if not wanted.
 * - triangle_capacity: triangles that fit.
 *
 * Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL, LOCKED; nothing is written then. Threads: the mesh by this thread alone.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_mesh_copy(const isocoat_mesh *mesh,
                                 isocoat_buffer positions,
                                 isocoat_buffer normals,
                                 size_t vertex_capacity,
                                 uint32_t *triangles,
                                 size_t triangle_capacity);

/* ---- Skins ------------------------------------------------------------------------------------------------------- */

/**
 * Binds a mesh of the host to a body, at the present poses and undeformed; only its vertices matter. Each remembers the
 * field of the body there, and the links whose skeletons make it; where no field reaches, it will follow the link of
 * the nearest surface. The skin lives until it is destroyed, or the world; a snapshot leaves it out: it outlives the
 * restoring of one of this world, and is gone after one of another world.
 *
 * - world: not NULL.
 * - body: the body; it needs enabled skeletons, and may be disabled. Not a substance.
 * - vertices: 3 numbers a vertex, in m, finite; its data not NULL unless count is 0.
 * - normals: 3 numbers a vertex, the mesh's own normals, of any length but 0: they will turn as the coat does. If its
 *   data is NULL, the skin has the coat's normals.
 * - count: number of vertices.
 * - skin: receives the handle; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED, CAPACITY. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skin_create(isocoat_world *world,
                                   isocoat_body body,
                                   isocoat_const_buffer vertices,
                                   isocoat_const_buffer normals,
                                   size_t count,
                                   isocoat_skin *skin);

/**
 * Destroys a skin.
 *
 * - world: not NULL.
 * - skin: the skin.
 *
 * Errors: INVALID_HANDLE. Threads: changes the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_skin_destroy(isocoat_world *world, isocoat_skin skin);

/**
 * The body that a skin was bound to; it may have been destroyed since.
 *
 * - world: not NULL.
 * - skin: the skin.
 * - body: receives the handle; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skin_get_body(const isocoat_world *world,
                                     isocoat_skin skin,
                                     isocoat_body *body);

/**
 * Number of vertices of a skin.
 *
 * - world: not NULL.
 * - skin: the skin.
 * - count: receives the number; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skin_get_vertex_count(const isocoat_world *world,
                                             isocoat_skin skin,
                                             size_t *count);

/**
 * The links that a vertex of a skin follows, the heaviest first: the weight of a link is its skeletons' share of the
 * field where the vertex was bound. For hosts that let the GPU move what is far from the eye.
 *
 * - world: not NULL.
 * - skin: the skin.
 * - vertex: number of the vertex.
 * - links: receives the handles; NULL if not wanted.
 * - weights: receives the weights, which add up to 1; NULL if not wanted.
 * - capacity: links that fit into each of the two. With both NULL only the count is asked.
 * - count: receives the number of links, also when they do not fit; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skin_get_weights(const isocoat_world *world,
                                        isocoat_skin skin,
                                        size_t vertex,
                                        isocoat_link *links,
                                        double *weights,
                                        size_t capacity,
                                        size_t *count);

/**
 * Where the vertices of a skin are now: each goes with its links, and from there along the gradient to where the field
 * of the body has the value that it had at the binding. So the skin dents where the coat is pressed, bulges round it,
 * swells with it and does not pinch at joints. When the whole body has moved rigidly, so has the mesh. Depends on the
 * present poses alone, not on earlier calls. Asks for no memory once it was called, for an undeformed shape.
 *
 * - world: not NULL.
 * - skin: the skin. The body must have the enabled skeletons that it was bound to; what they are like may change.
 * - deformation: which shape, an ISOCOAT_DEFORMATION_ value.
 * - positions: receives 3 numbers a vertex, in m; skipped if its data is NULL.
 * - normals: receives 3 numbers a vertex, unit vectors; skipped if its data is NULL.
 * - vertex_capacity: vertices that fit into each of the two.
 *
 * Errors: INVALID_HANDLE (also when the body was destroyed), INVALID_ARGUMENT, UNSUPPORTED when skeletons of the body
 * have gone or come, BUFFER_TOO_SMALL; nothing is written then. Threads: reads the world; calls for one skin wait for
 * each other.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skin_deform(const isocoat_world *world,
                                   isocoat_skin skin,
                                   isocoat_deformation deformation,
                                   isocoat_buffer positions,
                                   isocoat_buffer normals,
                                   size_t vertex_capacity);

/* ---- Coats from meshes ------------------------------------------------------------------------------------------- */

/** What coat is fitted to a mesh. Begin with isocoat_fit_desc_default(). */
typedef struct isocoat_fit_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** What skeletons: ISOCOAT_SHAPE_POINT, the default, or ISOCOAT_SHAPE_SEGMENT. */
    isocoat_shape shape;
    /**
     * How many, from 1 to 4096. 200 points come within 0.17 % of the diagonal of a bunny on average, and within 1.3 %
     * at most; 400 within 0.11 % and 1.2 %. Default 64.
     */
    uint32_t count;
    /** 0. */
    uint32_t reserved;
    /**
     * Radius less thickness of every skeleton, in m: how far its field goes beyond its surface. The slope of the summed
     * field at the surface is about 2 isovalue / width, so that this is how soft the coat is. 0, the default, stands
     * for 0.3 times the side of a square with a skeleton's share of the mesh's area, which comes closest; else from
     * 1e-3 to 1 of the diagonal of the mesh. No thickness is less than a third of it.
     */
    double width;
} isocoat_fit_desc;

/** How close a fitted coat comes to its mesh. */
typedef struct isocoat_fit_distance {
    /**
     * Mean distance of the two surfaces, in m: the mean over the area of the mesh and that over the area of the coat's
     * surface, where all skeletons blend, in equal parts.
     */
    double mean;
    /** Largest distance of a point of either surface from the other, in m. */
    double maximum;
    /** Diagonal of the bounds of the mesh, in m. */
    double diagonal;
} isocoat_fit_distance;

/**
 * Fills a descriptor with its defaults; isocoat_fit_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_fit_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_fit_desc_init(isocoat_fit_desc *desc, size_t size);

/**
 * Fits a coat to a closed mesh of triangles: skeletons whose isosurface comes close to it. It needs no world;
 * isocoat_skeleton_create_many() takes what it gives. A function of its input alone: the same gives the same bits. It
 * takes seconds, and more the more skeletons: 200 points of a mesh of a thousand triangles about 4.
 *
 * - desc: which skeletons, and how many; not NULL.
 * - vertices: 3 numbers a vertex, in m, finite; its data not NULL. Vertices at one place count as one, so that a mesh
 *   may be split along seams.
 * - vertex_count: number of vertices.
 * - triangles: 3 * triangle_count indices of vertices, counterclockwise from outside; not NULL. Each edge lies between
 *   two triangles.
 * - triangle_count: number of triangles, at least 4.
 * - bones: numbers of the bones that move each vertex, bones_per_vertex of each in a row; NULL if there is one bone
 *   alone. A skeleton then belongs to the bone with the most weight where it lies, and each bone that has a part of the
 *   surface gets as many as it needs to be as close as the others: one at least if that is more than 1/2000 of it.
 * - weights: 1 number for each of these, at least 0, not all of a vertex 0; its data not NULL unless bones is.
 * - bones_per_vertex: at least 1 unless bones is NULL.
 * - skeletons: receives desc->count descriptors in the frame of the mesh: shape, thickness, radius, and defaults. Not
 *   NULL; the first must have its struct_size set, and says how far they are apart.
 * - skeleton_bones: receives the bone of each, 0 without bones; NULL if not wanted. Not the array of bones.
 * - capacity: skeletons that fit into each of the two.
 * - distance: receives how close the surface comes; NULL if not wanted.
 *
 * Errors: INVALID_ARGUMENT, BUFFER_TOO_SMALL, UNSUPPORTED without triangles, OUT_OF_RANGE: coordinates that are not
 * finite, an index too large; a mesh that is open, inside out, without volume, or has an edge between more than two
 * triangles; a count or width out of range, or fewer skeletons than bones; a weight that is none. Threads: any.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_fit_mesh(const isocoat_fit_desc *desc,
                                isocoat_const_buffer vertices,
                                size_t vertex_count,
                                const uint32_t *triangles,
                                size_t triangle_count,
                                const uint32_t *bones,
                                isocoat_const_buffer weights,
                                size_t bones_per_vertex,
                                isocoat_skeleton_desc *skeletons,
                                uint32_t *skeleton_bones,
                                size_t capacity,
                                isocoat_fit_distance *distance);

/* ---- Volumes ----------------------------------------------------------------------------------------------------- */

/**
 * The volume of a body's solid now: that of the territories of its enabled skeletons, by their seeds. Also for bodies
 * without volume control. Contacts do not count.
 *
 * - world: not NULL.
 * - body: the body.
 * - volume: receives the volume, in m^3; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (a plane has no bounds). Threads: reads the world.
 */
ISOCOAT_MUST_USE isocoat_status isocoat_body_get_volume(const isocoat_world *world, isocoat_body body, double *volume);

/**
 * The volume of a skeleton's territory now, by its seeds: the part of its body's solid where its field is the highest.
 * Also without volume control. 0 while the skeleton or its link is disabled. Contacts do not count.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - volume: receives the volume, in m^3; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (a plane has no bounds). Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_get_volume(const isocoat_world *world,
                                           isocoat_skeleton skeleton,
                                           double *volume);

/**
 * The volume that volume control aims at for a skeleton: what its territory had in the first step with control, or
 * what the host has set. Before that step, what it has now. A change of its descriptor begins anew, unless only
 * user_data changes.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - target: receives the volume, in m^3; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (a plane; the volume_gain of its body is 0).
 * Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_get_target_volume(const isocoat_world *world,
                                                  isocoat_skeleton skeleton,
                                                  double *target);

/**
 * Sets the volume that volume control aims at for a skeleton: a muscle that flexes. The surface moves by at most an
 * eighth of the skeleton's thickness in a step, and by at most half of it inwards and all of it outwards in all.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - target: the volume, in m^3, > 0 and at most 1e30.
 *
 * Errors: INVALID_HANDLE, OUT_OF_RANGE, UNSUPPORTED (a plane; the volume_gain of its body is 0).
 * Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_set_target_volume(isocoat_world *world,
                                                  isocoat_skeleton skeleton,
                                                  double target);

/**
 * How far volume control has moved a skeleton's surface outwards: its thickness and radius are larger by so much than
 * its descriptor says. 0 without volume control.
 *
 * - world: not NULL.
 * - skeleton: the skeleton.
 * - offset: receives the distance, in m; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_skeleton_get_offset(const isocoat_world *world,
                                           isocoat_skeleton skeleton,
                                           double *offset);

/* ---- Substances -------------------------------------------------------------------------------------------------- */

/**
 * What a substance is like: clay, dough, mud. Its particles attract and repel each other, and each carries a point of
 * the coat; isovalue, stiffness, friction, dissipation, category and mask are those of its body. Particles of one part
 * blend; parts that come apart collide, and fuse where they are pressed together hard enough. Begin with
 * isocoat_substance_desc_default().
 */
typedef struct isocoat_substance_desc {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** Seeds of a particle, which measure volumes and find pieces, from 4 to 4096. Default 64. */
    uint32_t seed_count;
    /** Distance of two particles at rest, in m, from 1e-9 to 1e6. Default 0.1. */
    double spacing;
    /**
     * Mass of one particle, in kg, > 0 and at most 1e30: density * spacing^3 / sqrt(2) for a lump that was filled.
     * Default 1.
     */
    double particle_mass;
    /**
     * Strength of attraction and repulsion, in J, from 0 to 1e30: at rest, a pair has a stiffness of
     * 4 * cohesion / spacing^2. Advice: n * particle_mass * g * spacing bears a lump n particles high. Default 1.
     */
    double cohesion;
    /** Friction between particles that grows with the square of their speed, in kg/m, from 0 to 1e30. Default 0. */
    double viscosity;
    /** Damping of a pair at rest over the critical one, from 0 to 100. Default 0.2. */
    double damping;
    /**
     * Pressure between two parts above which they fuse, in Pa, at least 0: 0 is at the first touch, infinity never.
     * Default infinity.
     */
    double fusion_threshold;
    /** How long it takes for two particles to blend, or to stop it, in s, > 0 and at most 1e9. Default 0.5. */
    double blend_time;
    /**
     * Part of a volume error that is taken back in a step, from 0 to 0.5; 0 switches volume control off. Default 0.5.
     */
    double volume_gain;
    /**
     * Distance of the surface from an isolated particle, in m, from 0.4 to 2 spacings; 0 stands for half a spacing.
     * Default 0.
     */
    double thickness;
    /**
     * Distance at which the field of a particle ends, in m, more than the thickness and at most 3 spacings; 0 stands
     * for 1.25 spacings. Default 0.
     */
    double radius;
} isocoat_substance_desc;

/**
 * Fills a descriptor with its defaults; isocoat_substance_desc_default() calls it.
 *
 * - desc: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_substance_desc) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_substance_desc_init(isocoat_substance_desc *desc, size_t size);

/**
 * Makes a body a substance, for good: from now on it has particles in place of links. The calls below refuse every
 * other body.
 *
 * - world: not NULL.
 * - body: a deformable body without links.
 * - desc: what it is like; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (a rigid body, one with links, or one that is a
 * substance). Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_body_make_substance(isocoat_world *world,
                                           isocoat_body body,
                                           const isocoat_substance_desc *desc);

/**
 * The descriptor of a substance.
 *
 * - world: not NULL.
 * - body: a substance.
 * - desc: receives it; not NULL, with struct_size set.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (no substance). Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_get_desc(const isocoat_world *world,
                                          isocoat_body body,
                                          isocoat_substance_desc *desc);

/**
 * Changes what a substance is like, from the next step on. Particles stay where they are.
 *
 * - world: not NULL.
 * - body: a substance.
 * - desc: the new descriptor, whole; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (no substance). Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_set_desc(isocoat_world *world,
                                          isocoat_body body,
                                          const isocoat_substance_desc *desc);

/**
 * Name of a particle in its substance; 0 is none. It stays the same for the particle's life, whoever else comes and
 * goes. The name of one that was removed gives ISOCOAT_ERROR_INVALID_HANDLE; it may come again only after 4095 others
 * have had its slot. In another body it means nothing.
 */
typedef uint32_t isocoat_particle;

/**
 * Adds particles to a substance: all of them, or none if one is refused. Those of one call are a part of their own:
 * they blend with each other, and with nobody else until they fuse.
 *
 * - world: not NULL.
 * - body: a substance.
 * - positions: 3 * count doubles, in m, finite; not NULL unless count is 0.
 * - velocities: 3 * count doubles, in m/s, finite; NULL for particles at rest.
 * - count: number of particles.
 * - particles: receives count names, in the same order; NULL when they are not wanted.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE (the message says which element), UNSUPPORTED (no substance),
 * CAPACITY (more than 1048576 particles). Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_add_particles(isocoat_world *world,
                                               isocoat_body body,
                                               const double *positions,
                                               const double *velocities,
                                               size_t count,
                                               isocoat_particle *particles);

/**
 * Fills a box with particles at rest, packed as densely as balls, and half a spacing within its surface. They are
 * added as isocoat_substance_add_particles does; isocoat_substance_get_particles lists them last.
 *
 * - world: not NULL.
 * - body: a substance.
 * - low: 3 doubles, the lowest corner, in m, finite; not NULL.
 * - high: 3 doubles, the highest corner, in m, finite, none less than that of low; not NULL.
 * - count: receives the number of new particles; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (no substance), CAPACITY (more than 1048576
 * particles). Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_fill_box(isocoat_world *world,
                                          isocoat_body body,
                                          const double low[3],
                                          const double high[3],
                                          size_t *count);

/**
 * isocoat_substance_fill_box() of a ball.
 *
 * - world: not NULL.
 * - body: a substance.
 * - center: 3 doubles, in m, finite; not NULL.
 * - radius: in m, > 0.
 * - count: receives the number of new particles; not NULL.
 *
 * Errors: as isocoat_substance_fill_box. Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_fill_ball(isocoat_world *world,
                                           isocoat_body body,
                                           const double center[3],
                                           double radius,
                                           size_t *count);

/**
 * isocoat_substance_fill_box() of what a triangle mesh encloses: of the points of the packing, those that it goes
 * round, which may lie right under its surface. Time grows with points times triangles.
 *
 * - world: not NULL.
 * - body: a substance.
 * - vertices: 3 * vertex_count doubles, in m, finite; not NULL.
 * - vertex_count: number of vertices.
 * - triangles: 3 * triangle_count indices of vertices, all round the same way; not NULL.
 * - triangle_count: number of triangles, at least 1.
 * - count: receives the number of new particles; not NULL.
 *
 * Errors: as isocoat_substance_fill_box; OUT_OF_RANGE for an index too large, UNSUPPORTED without triangles. Threads:
 * changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_fill_mesh(isocoat_world *world,
                                           isocoat_body body,
                                           const double *vertices,
                                           size_t vertex_count,
                                           const uint32_t *triangles,
                                           size_t triangle_count,
                                           size_t *count);

/**
 * Removes particles: all of them, or none if one is refused. The coat that is left keeps the volume that it has then.
 *
 * - world: not NULL.
 * - body: a substance.
 * - particles: count names of its particles, none twice; not NULL unless count is 0.
 * - count: number of particles.
 *
 * Errors: INVALID_HANDLE (the message says which element), INVALID_ARGUMENT, UNSUPPORTED (no substance; a particle
 * twice). Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_remove_particles(isocoat_world *world,
                                                  isocoat_body body,
                                                  const isocoat_particle *particles,
                                                  size_t count);

/**
 * How many particles a substance has.
 *
 * - world: not NULL.
 * - body: a substance.
 * - count: receives the number; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (no substance). Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_get_particle_count(const isocoat_world *world,
                                                    isocoat_body body,
                                                    size_t *count);

/**
 * All particles of a substance, in an order that changes only when some are removed.
 *
 * - world: not NULL.
 * - body: a substance.
 * - particles: receives a name a particle; NULL if not wanted.
 * - positions: receives 3 numbers a particle, in m; skipped if its data is NULL.
 * - velocities: receives 3 numbers a particle, in m/s; skipped if its data is NULL.
 * - volumes: receives the volume of the coat that is a particle's, in m^3, at the last step; 0 for one that has come
 *   since; NULL if not wanted.
 * - pieces: receives the index of a particle's piece in the list of isocoat_substance_get_pieces; NULL if not wanted.
 * - labels: receives the label of a particle's part: those of one label blend. A part that comes off gets a new label;
 *   where two parts have wholly fused, one takes the other's. NULL if not wanted.
 * - capacity: particles that fit into each of the six. With all of them NULL only the count is asked.
 * - count: receives the number of particles, also when they do not fit; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (no substance), BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_get_particles(const isocoat_world *world,
                                               isocoat_body body,
                                               isocoat_particle *particles,
                                               isocoat_buffer positions,
                                               isocoat_buffer velocities,
                                               double *volumes,
                                               uint32_t *pieces,
                                               uint32_t *labels,
                                               size_t capacity,
                                               size_t *count);

/**
 * Puts particles elsewhere, gives them other velocities, or both: all of them, or none if one is refused. What is
 * moved does not push what it passes.
 *
 * - world: not NULL.
 * - body: a substance.
 * - particles: count names of its particles; not NULL unless count is 0. Of one that is named twice, the last state
 *   holds.
 * - positions: 3 * count doubles, in m, finite; NULL to leave them.
 * - velocities: 3 * count doubles, in m/s, finite; NULL to leave them.
 * - count: number of particles.
 *
 * Errors: INVALID_HANDLE, OUT_OF_RANGE (the message says which element), INVALID_ARGUMENT, UNSUPPORTED (no substance).
 * Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_set_particles(isocoat_world *world,
                                               isocoat_body body,
                                               const isocoat_particle *particles,
                                               const double *positions,
                                               const double *velocities,
                                               size_t count);

/**
 * Pulls at particles throughout the next step; forces of several calls add up. All of them are taken, or none if one
 * is refused.
 *
 * - world: not NULL.
 * - body: a substance.
 * - particles: count names of its particles; not NULL unless count is 0.
 * - forces: 3 * count doubles, in N, finite; not NULL unless count is 0.
 * - count: number of particles.
 *
 * Errors: INVALID_HANDLE, OUT_OF_RANGE (the message says which element), INVALID_ARGUMENT, UNSUPPORTED (no substance).
 * Threads: changes the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_add_forces(isocoat_world *world,
                                            isocoat_body body,
                                            const isocoat_particle *particles,
                                            const double *forces,
                                            size_t count);

/** Some of a substance that hangs together in one solid. */
typedef struct isocoat_piece {
    /** Mass, in kg. */
    double mass;
    /** Volume of its solid at the last step, in m^3. */
    double volume;
    /** Centre of mass, in m. */
    double center[3];
    /** Momentum, in N s. */
    double momentum[3];
    /** Angular momentum about the centre of mass, in N m s. */
    double angular_momentum[3];
    /** How many particles it has. */
    uint32_t particle_count;
    /** 0. */
    uint32_t reserved;
} isocoat_piece;

/** What happened to a part of a substance: an ISOCOAT_CHANGE_ value. More may come. */
typedef uint32_t isocoat_change_kind;

/** These particles came off, and are a part of their own. */
#define ISOCOAT_CHANGE_SPLIT 0u
/** These two particles, of two parts, began to blend. Between two parts that fuse there are many of them. */
#define ISOCOAT_CHANGE_FUSED 1u

/** A change of a substance in the last step. */
typedef struct isocoat_change {
    /** What happened. */
    isocoat_change_kind kind;
    /** 0. */
    uint32_t reserved;
    /** The substance; it may have been destroyed since. */
    isocoat_body body;
    /** Its particles are so many of the row that comes with the changes; some may have been removed since. */
    size_t particle_count;
    /** Where in that row the first of them is. */
    size_t first_particle;
} isocoat_change;

/**
 * The pieces of a substance: what hung together at the last step, at the places and velocities that its particles have
 * now. What has come since counts with the first of them.
 *
 * - world: not NULL.
 * - body: a substance.
 * - pieces: receives the pieces; NULL with capacity 0 asks for the count only.
 * - capacity: pieces that fit.
 * - count: receives the number of pieces, also when pieces is too small; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, UNSUPPORTED (no substance), BUFFER_TOO_SMALL. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_get_pieces(const isocoat_world *world,
                                            isocoat_body body,
                                            isocoat_piece *pieces,
                                            size_t capacity,
                                            size_t *count);

/**
 * The particles of one piece. For those of all pieces at once, ask isocoat_substance_get_particles for pieces.
 *
 * - world: not NULL.
 * - body: a substance.
 * - piece: index of the piece in the list of isocoat_substance_get_pieces.
 * - particles: receives the names; NULL with capacity 0 asks for the count only.
 * - capacity: names that fit.
 * - count: receives the number of particles, also when particles is too small; not NULL.
 *
 * Errors: INVALID_HANDLE, INVALID_ARGUMENT, OUT_OF_RANGE, UNSUPPORTED (no substance), BUFFER_TOO_SMALL. Threads: reads
 * the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_substance_get_piece_particles(const isocoat_world *world,
                                                     isocoat_body body,
                                                     size_t piece,
                                                     isocoat_particle *particles,
                                                     size_t capacity,
                                                     size_t *count);

/**
 * What came off and what began to fuse in the last step, in all substances.
 *
 * - world: not NULL.
 * - changes: receives a pointer to the changes (not to be freed); not NULL.
 * - count: receives their number; not NULL.
 * - particles: receives a pointer to the names of their particles, those of the first change first (not to be freed);
 *   not NULL.
 *
 * Errors: INVALID_ARGUMENT. Threads: reads the world. Lifetime: until the next step, restore or destroy
 * of the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_get_substance_changes(const isocoat_world *world,
                                                   const isocoat_change **changes,
                                                   size_t *count,
                                                   const isocoat_particle **particles);

/* ---- Debug drawing ----------------------------------------------------------------------------------------------- */

/** What to draw: ISOCOAT_DRAW_ flags, added up. */
typedef uint32_t isocoat_draw_flags;

/** Skeletons as points and wires. */
#define ISOCOAT_DRAW_SKELETONS 1u
/** Seeds as points with normals. */
#define ISOCOAT_DRAW_SEEDS 2u
/** The contacts of the last step: their forces, and discs of their areas. */
#define ISOCOAT_DRAW_CONTACTS 4u
/** The box that bounds the field of each body. */
#define ISOCOAT_DRAW_BOUNDS 8u

/**
 * Draws a line.
 *
 * - context: as in isocoat_debug_draw.
 * - a, b: 3 doubles each, its ends in the world, in m; valid during the call.
 * - color: 0xRRGGBBAA.
 *
 * It must return (no longjmp, no exception). It may read the world, but not change it.
 */
typedef void (*isocoat_draw_line_fn)(void *context, const double *a, const double *b, uint32_t color);

/**
 * Draws a point.
 *
 * - context: as in isocoat_debug_draw.
 * - position: 3 doubles, in the world, in m; valid during the call.
 * - size: the diameter it should have in the scene, in m.
 * - color: 0xRRGGBBAA.
 *
 * It must return (no longjmp, no exception). It may read the world, but not change it.
 */
typedef void (*isocoat_draw_point_fn)(void *context, const double *position, double size, uint32_t color);

/** What to draw and how. Begin with isocoat_debug_draw_default(). */
typedef struct isocoat_debug_draw {
    /** Size of this struct in bytes, as the host knows it. */
    uint32_t struct_size;
    /** ISOCOAT_DRAW_ flags, added up. Default 0, which draws nothing. */
    isocoat_draw_flags flags;
    /** Given to the functions, otherwise unused. Default NULL. */
    void *context;
    /** Draws a line; NULL leaves lines out. Default NULL. */
    isocoat_draw_line_fn draw_line;
    /** Draws a point; NULL leaves points out. Default NULL. */
    isocoat_draw_point_fn draw_point;
} isocoat_debug_draw;

/**
 * Fills a description of what to draw with its defaults; isocoat_debug_draw_default() calls it.
 *
 * - draw: receives at most size bytes, its struct_size among them; not NULL.
 * - size: sizeof(isocoat_debug_draw) as the host was compiled.
 *
 * Errors: INVALID_ARGUMENT. Threads: any.
 */
isocoat_status isocoat_debug_draw_init(isocoat_debug_draw *draw, size_t size);

/**
 * Draws what a world sees: its enabled bodies at their present poses.
 *
 * - world: not NULL.
 * - draw: what and how; not NULL. Its functions are called before this returns, on this thread.
 *
 * Errors: INVALID_ARGUMENT. Threads: reads the world.
 */
ISOCOAT_MUST_USE
isocoat_status isocoat_world_debug_draw(const isocoat_world *world,
                                        const isocoat_debug_draw *draw);

#ifdef __cplusplus
}
#endif

/* Descriptors with every field at its default, and the size that this header knows. */

static inline isocoat_world_desc isocoat_world_desc_default(void)
{
    isocoat_world_desc desc;
    isocoat_world_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_body_desc isocoat_body_desc_default(void)
{
    isocoat_body_desc desc;
    isocoat_body_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_link_desc isocoat_link_desc_default(void)
{
    isocoat_link_desc desc;
    isocoat_link_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_skeleton_desc isocoat_skeleton_desc_default(void)
{
    isocoat_skeleton_desc desc;
    isocoat_skeleton_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_spring_desc isocoat_spring_desc_default(void)
{
    isocoat_spring_desc desc;
    isocoat_spring_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_substance_desc isocoat_substance_desc_default(void)
{
    isocoat_substance_desc desc;
    isocoat_substance_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_counters isocoat_counters_default(void)
{
    isocoat_counters counters;
    isocoat_counters_init(&counters, sizeof counters);
    return counters;
}

static inline isocoat_times isocoat_times_default(void)
{
    isocoat_times times;
    isocoat_times_init(&times, sizeof times);
    return times;
}

static inline isocoat_mesh_desc isocoat_mesh_desc_default(void)
{
    isocoat_mesh_desc desc;
    isocoat_mesh_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_recorder_desc isocoat_recorder_desc_default(void)
{
    isocoat_recorder_desc desc;
    isocoat_recorder_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_rays_desc isocoat_rays_desc_default(void)
{
    isocoat_rays_desc desc;
    isocoat_rays_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_ray_hits isocoat_ray_hits_default(void)
{
    isocoat_ray_hits hits;
    isocoat_ray_hits_init(&hits, sizeof hits);
    return hits;
}

static inline isocoat_fit_desc isocoat_fit_desc_default(void)
{
    isocoat_fit_desc desc;
    isocoat_fit_desc_init(&desc, sizeof desc);
    return desc;
}

static inline isocoat_debug_draw isocoat_debug_draw_default(void)
{
    isocoat_debug_draw draw;
    isocoat_debug_draw_init(&draw, sizeof draw);
    return draw;
}

/*
 * Compares what this header says with the library that runs: version, and the size of every struct. Call it once at
 * the start. Errors: UNSUPPORTED when they do not fit together; isocoat_last_error tells why.
 */
ISOCOAT_MUST_USE static inline isocoat_status isocoat_check_abi(void)
{
    const uint32_t sizes[] = {
        (uint32_t)sizeof(isocoat_body),
        (uint32_t)sizeof(isocoat_pose),
        (uint32_t)sizeof(isocoat_wrench),
        (uint32_t)sizeof(isocoat_link_state),
        (uint32_t)sizeof(isocoat_buffer),
        (uint32_t)sizeof(isocoat_contact),
        (uint32_t)sizeof(isocoat_event),
        (uint32_t)sizeof(isocoat_counters),
        (uint32_t)sizeof(isocoat_world_desc),
        (uint32_t)sizeof(isocoat_body_desc),
        (uint32_t)sizeof(isocoat_link_desc),
        (uint32_t)sizeof(isocoat_skeleton_desc),
        (uint32_t)sizeof(isocoat_ray_hit),
        (uint32_t)sizeof(isocoat_surface_point),
        (uint32_t)sizeof(isocoat_debug_draw),
        (uint32_t)sizeof(isocoat_times),
        (uint32_t)sizeof(isocoat_spring_desc),
        (uint32_t)sizeof(isocoat_spring_state),
        (uint32_t)sizeof(isocoat_substance_desc),
        (uint32_t)sizeof(isocoat_piece),
        (uint32_t)sizeof(isocoat_change),
        (uint32_t)sizeof(isocoat_mesh_desc),
        (uint32_t)sizeof(isocoat_mesh_view),
        (uint32_t)sizeof(isocoat_recorder_desc),
        (uint32_t)sizeof(isocoat_const_buffer),
        (uint32_t)sizeof(isocoat_rays_desc),
        (uint32_t)sizeof(isocoat_ray_hits),
        (uint32_t)sizeof(isocoat_fit_desc),
        (uint32_t)sizeof(isocoat_fit_distance),
    };
    return isocoat_check_abi_of(ISOCOAT_VERSION, sizes, sizeof sizes / sizeof sizes[0]);
}

#endif /* ISOCOAT_H */
