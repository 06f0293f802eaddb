/* Every range: what lies outside is refused with the value and the range, and nothing has changed. */
#include "check.h"

#include <stdint.h>

static const isocoat_status range = ISOCOAT_ERROR_OUT_OF_RANGE;
static const isocoat_status argument = ISOCOAT_ERROR_INVALID_ARGUMENT;
static const isocoat_status unsupported = ISOCOAT_ERROR_UNSUPPORTED;

/* Sets a field of a fresh copy of a good descriptor, and expects the refusal by create and by set. */
#define WORLD(field, value, status, text)                                                          \
    do {                                                                                           \
        isocoat_world_desc bad_ = good, after_ = isocoat_world_desc_default();                     \
        isocoat_world *none_ = NULL;                                                               \
        bad_.field = value;                                                                        \
        REFUSED(isocoat_world_create(&bad_, &none_), status, text);                                \
        REFUSED(isocoat_world_set_desc(world, &bad_), status, text);                               \
        OK(isocoat_world_get_desc(world, &after_));                                                \
        CHECK(none_ == NULL && after_.seed_count == good.seed_count);                              \
    } while (0)

static void worlds(void)
{
    const isocoat_world_desc good = isocoat_world_desc_default();
    isocoat_world *world = new_world();

    WORLD(response, 4, argument, "response is 4; must be one of ISOCOAT_RESPONSE_*, 0 to 3");
    WORLD(scheme, 6, argument, "scheme is 6; must be one of ISOCOAT_SCHEME_*, 0 to 5");
    WORLD(seed_count, 3, range, "seed_count is 3; must be from 4 to 65536");
    WORLD(seed_count, 65537, range, "seed_count is 65537");
    WORLD(max_substeps, 0, range, "max_substeps is 0; must be from 1 to 65536");
    WORLD(max_substeps, 65537, range, "max_substeps is 65537");
    WORLD(gravity[1], NAN, range, "gravity is (0, NaN, 0); must be finite");
    WORLD(gravity[2], INFINITY, range, "gravity is (0, 0, inf)");
    WORLD(force_tolerance, 0.0, range, "force_tolerance is 0; must be from 1e-9 to 0.5");
    WORLD(force_tolerance, 0.6, range, "force_tolerance is 0.6");
    WORLD(force_tolerance, NAN, range, "force_tolerance is NaN");
    WORLD(substep_phase, 0.001, range, "substep_phase is 0.001; must be from 0.01 to 1");
    WORLD(substep_phase, 1.5, range, "substep_phase is 1.5");
    WORLD(implicit_tolerance, 0, range, "implicit_tolerance is 0; must be from 1e-9 to 1");
    WORLD(implicit_rounds, 0, range, "implicit_rounds is 0; must be from 1 to 64");
    WORLD(implicit_splits, 11, range, "implicit_splits is 11; must be from 0 to 10");

    REFUSED(isocoat_world_step(world, 0.0), range, "dt is 0; must be > 0 and at most 10 s");
    REFUSED(isocoat_world_step(world, -0.01), range, "dt is -0.01");
    REFUSED(isocoat_world_step(world, 11.0), range, "dt is 11");
    REFUSED(isocoat_world_step(world, NAN), range, "dt is NaN");
    isocoat_world_destroy(world);
}

#define BODY(field, value, status, text)                               \
    do {                                                               \
        isocoat_body_desc bad_ = good, after_ = isocoat_body_desc_default(); \
        isocoat_body none_ = {7, 7, 7};                                \
        bad_.friction = 0.25;                                          \
        bad_.field = value;                                            \
        REFUSED(isocoat_body_create(world, &bad_, &none_), status, text); \
        REFUSED(isocoat_body_set_desc(world, b.body, &bad_), status, text); \
        OK(isocoat_body_get_desc(world, b.body, &after_));             \
        CHECK(none_.index == 7);                                       \
        CHECK_NEAR(after_.friction, 0.0, 0.0);                         \
    } while (0)

static void bodies(void)
{
    const isocoat_body_desc good = isocoat_body_desc_default();
    isocoat_body_desc desc = good;
    isocoat_world *world = new_world();
    const ball b = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);

    BODY(kind, 2, argument, "kind is 2; must be one of ISOCOAT_BODY_*, 0 to 1");
    BODY(isovalue, 0.0, range, "isovalue is 0; must be > ");
    BODY(isovalue, -1.0, range, "isovalue is -1");
    BODY(isovalue, 1e10, range, "isovalue is 10000000000");
    BODY(isovalue, NAN, range, "isovalue is NaN");
    BODY(stiffness_scale, 0.0, range, "stiffness_scale is 0; must be > 0");
    BODY(stiffness_scale, 1e19, range, "stiffness_scale is 1");
    BODY(stiffness_scale, INFINITY, range, "stiffness_scale is inf");
    BODY(friction, -0.5, range, "friction is -0.5; must be from 0 to 1e6");
    BODY(friction, 1e300, range, "friction is 1e300; must be from 0 to 1e6");
    BODY(viscous_friction, 1e20, range, "viscous_friction is 1e20; must be from 0 to 1e6");
    BODY(dissipation, 1e155, range, "dissipation is 1e155; must be from 0 to 1e6");
    BODY(friction, NAN, range, "friction is NaN");
    BODY(viscous_friction, -1.0, range, "viscous_friction is -1");
    BODY(dissipation, INFINITY, range, "dissipation is inf");
    BODY(static_friction, -1.0, range, "static_friction is -1");
    BODY(static_friction, 0.125, range, "static_friction is 0.125; must be 0 (off), or from friction to 1e6");
    /* The skeleton's stiffness of 10 over its width of 0.2 m asks for an isovalue of at least 2/3. */
    desc.isovalue = 0.5;
    REFUSED(isocoat_body_set_desc(world, b.body, &desc), range, "stiffness is 10; must be > 0 and at most 3 isovalue");
    OK(isocoat_body_get_desc(world, b.body, &desc));
    CHECK_NEAR(desc.isovalue, 1.0, 0.0);
    isocoat_world_destroy(world);
}

#define LINK(make_kind, field, value, status, text)                    \
    do {                                                               \
        isocoat_link_desc bad_ = good, after_ = isocoat_link_desc_default(); \
        isocoat_link none_ = {7, 7, 7};                                \
        bad_.kind = make_kind;                                         \
        bad_.gravity_scale = 0.25;                                     \
        bad_.field = value;                                            \
        REFUSED(isocoat_link_create(world, b.body, &bad_, &none_), status, text); \
        REFUSED(isocoat_link_set_desc(world, b.link, &bad_), status, text); \
        OK(isocoat_link_get_desc(world, b.link, &after_));             \
        CHECK(none_.index == 7 && after_.kind == ISOCOAT_LINK_RIGID);  \
        CHECK_NEAR(after_.gravity_scale, 1.0, 0.0);                    \
    } while (0)

static void links(void)
{
    isocoat_world *world = new_world();
    const ball b = new_ball(world, ISOCOAT_LINK_RIGID, 0.0);
    isocoat_link_desc good = isocoat_link_desc_default();
    good.mass = 1.0;
    OK(isocoat_inertia_of_sphere(1.0, 0.1, good.inertia));

    LINK(4, mass, 1.0, argument, "kind is 4; must be one of ISOCOAT_LINK_*, 0 to 3");
    LINK(ISOCOAT_LINK_FIXED, pose.position[0], NAN, range, "position is (NaN, 0, 0); must be finite");
    LINK(ISOCOAT_LINK_FIXED, pose.orientation[0], 1.0, range, "norm of the rotation quaternion is 1.41");
    LINK(ISOCOAT_LINK_FIXED, pose.orientation[3], 0.0, range, "norm of the rotation quaternion is 0; must be 1 within");
    LINK(ISOCOAT_LINK_FIXED, pose.orientation[3], 1.002, range, "norm of the rotation quaternion is 1.002");
    LINK(ISOCOAT_LINK_FIXED, pose.orientation[1], NAN, range, "norm of the rotation quaternion is NaN");
    LINK(ISOCOAT_LINK_FIXED, linear_velocity[2], INFINITY, range, "linear_velocity is (0, 0, inf)");
    LINK(ISOCOAT_LINK_FIXED, angular_velocity[2], NAN, range, "angular_velocity is (0, 0, NaN)");
    LINK(ISOCOAT_LINK_FIXED, local_center_of_mass[0], NAN, range, "local_center_of_mass is (NaN, 0, 0)");
    LINK(ISOCOAT_LINK_FIXED, gravity_scale, NAN, range, "gravity_scale is NaN");
    LINK(ISOCOAT_LINK_FIXED, external_acceleration[0], NAN, range, "external_acceleration is (NaN, 0, 0)");
    LINK(ISOCOAT_LINK_FIXED, external_angular_acceleration[0], NAN, range, "external_angular_acceleration is (NaN");
    LINK(ISOCOAT_LINK_HOST, mass, -1.0, range, "mass of a host-driven link is -1; must be 0 (kinematic) or > 0");
    LINK(ISOCOAT_LINK_HOST, mass, INFINITY, range, "mass of a host-driven link is inf");
    LINK(ISOCOAT_LINK_POINT_MASS, mass, 0.0, range, "mass of a point mass is 0; must be > 0");
    LINK(ISOCOAT_LINK_POINT_MASS, local_center_of_mass[1], 0.5, range,
         "local_center_of_mass of a point mass is (0, 0.5, 0)");
    LINK(ISOCOAT_LINK_RIGID, mass, 0.0, range, "mass of a rigid link is 0; must be > 0");
    LINK(ISOCOAT_LINK_RIGID, mass, 1e-320, range, "mass of a rigid link is");
    LINK(ISOCOAT_LINK_RIGID, angular_velocity[1], 1e300, range, "angular_velocity is (0, 1");
    LINK(ISOCOAT_LINK_RIGID, inertia[0], NAN, range, "inertia is not finite");
    LINK(ISOCOAT_LINK_RIGID, inertia[1], 0.001, range,
         "inertia is not symmetric; must be symmetric and positive definite");
    LINK(ISOCOAT_LINK_RIGID, inertia[4], -1.0, range, "inertia is of principal moments");
    LINK(ISOCOAT_LINK_RIGID, inertia[8], 1.0, range, "inertia is of principal moments");
    LINK(ISOCOAT_LINK_HOST, inertia[8], 0.0, range, "inertia is of principal moments");
    LINK(ISOCOAT_LINK_HOST, velocity_convention, 2, argument,
         "velocity_convention is 2; must be one of ISOCOAT_VELOCITY_*");
    LINK(ISOCOAT_LINK_HOST, flags, 8, argument, "flags is 0x8; must be a sum of ISOCOAT_LINK_ flags, at most 0x7");
    LINK(ISOCOAT_LINK_HOST, flags, ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA, range,
         "inverse_effective_inertia is not a");
    isocoat_world_destroy(world);
}

#define SKELETON(make_shape, field, value, status, text)               \
    do {                                                               \
        isocoat_skeleton_desc bad_ = good, after_ = isocoat_skeleton_desc_default(); \
        isocoat_skeleton none_ = {7, 7, 7};                            \
        bad_.shape = make_shape;                                       \
        bad_.seed_count = 5;                                           \
        bad_.field = value;                                            \
        REFUSED(isocoat_skeleton_create(world, b.link, &bad_, &none_), status, text); \
        REFUSED(isocoat_skeleton_set_desc(world, b.skeleton, &bad_), status, text); \
        OK(isocoat_skeleton_get_desc(world, b.skeleton, &after_));     \
        CHECK(none_.index == 7 && after_.seed_count == 0 && after_.shape == ISOCOAT_SHAPE_POINT); \
    } while (0)

static void skeletons(void)
{
    const uint32_t point = ISOCOAT_SHAPE_POINT, box = ISOCOAT_SHAPE_BOX;
    isocoat_world *world = new_world();
    const ball b = new_ball(world, ISOCOAT_LINK_RIGID, 0.0);
    isocoat_skeleton_desc good = isocoat_skeleton_desc_default();
    good.points[1][0] = good.points[1][1] = good.points[1][2] = 0.5;
    good.radius = 0.3;

    SKELETON(5, thickness, 0.1, argument, "shape is 5; must be one of ISOCOAT_SHAPE_*, 0 to 4");
    SKELETON(point, points[0][1], NAN, range, "points[0] is (0, NaN, 0); must be finite");
    SKELETON(ISOCOAT_SHAPE_SEGMENT, points[1][0], INFINITY, range, "points[1] is (inf, 0.5, 0.5); must be finite");
    SKELETON(ISOCOAT_SHAPE_SEGMENT, points[0][0], NAN, range, "points[0] is (NaN, 0, 0)");
    SKELETON(ISOCOAT_SHAPE_TRIANGLE, points[2][0], NAN, range, "points[2] is (NaN, 0, 0)");
    SKELETON(box, points[1][2], 0.0, range, "half extent of a box is 0; must be > 0");
    SKELETON(box, points[1][2], -0.5, range, "half extent of a box is -0.5");
    SKELETON(box, points[1][2], NAN, range, "points[1] is (0.5, 0.5, NaN)");
    SKELETON(box, points[2][0], NAN, range, "points[2] is (NaN, 0, 0)");
    SKELETON(box, points[2][0], 1e300, range, "points of the skeleton is (");
    SKELETON(point, thickness, 0.0, range, "thickness is 0; must be > 0");
    SKELETON(point, thickness, NAN, range, "thickness is NaN");
    SKELETON(point, radius, 0.1, range, "radius is 0.1; must be larger than thickness");
    SKELETON(point, radius, -1.0, range, "radius is -1");
    SKELETON(point, radius, INFINITY, range, "radius is inf");
    SKELETON(point, stiffness, 15.5, range,
             "stiffness is 15.5; must be > 0 and at most 3 isovalue / (radius - thickness)");
    SKELETON(point, stiffness, -1.0, range, "stiffness is -1");
    SKELETON(point, stiffening, -0.5, range, "stiffening is -0.5; must be from 0 to");
    SKELETON(point, stiffening, NAN, range, "stiffening is NaN");
    SKELETON(point, seed_count, 3, range, "seed_count is 3; must be from 4 to 65536");
    SKELETON(ISOCOAT_SHAPE_PLANE, thickness, 0.1, unsupported, "a plane is for fixed links");
    good.points[1][0] = good.points[1][1] = 0.0;
    SKELETON(ISOCOAT_SHAPE_PLANE, points[1][2], 0.0, range, "normal");
    SKELETON(ISOCOAT_SHAPE_PLANE, points[1][2], NAN, range, "points[1] is (0, 0, NaN)");
    isocoat_world_destroy(world);
}

static void unused_points_are_ignored(void)
{
    isocoat_world *world = new_world();
    const isocoat_body body = new_body(world);
    const isocoat_link link = new_link(world, body, ISOCOAT_LINK_FIXED, 0.0);
    isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
    isocoat_skeleton skeleton;
    desc.points[1][0] = desc.points[2][2] = NAN;
    OK(isocoat_skeleton_create(world, link, &desc, &skeleton));
    desc.shape = ISOCOAT_SHAPE_SEGMENT;
    desc.points[1][0] = 1.0;
    OK(isocoat_skeleton_create(world, link, &desc, &skeleton));
    desc.shape = ISOCOAT_SHAPE_PLANE;
    OK(isocoat_skeleton_create(world, link, &desc, &skeleton));
    isocoat_world_destroy(world);
}

static void pushes_and_states(void)
{
    isocoat_world *world = new_world();
    const ball rigid = new_ball(world, ISOCOAT_LINK_RIGID, 0.0);
    const ball driven = new_ball(world, ISOCOAT_LINK_HOST, 9.0);
    const ball fixed = new_ball(world, ISOCOAT_LINK_FIXED, 18.0);
    isocoat_link_state state, after;
    VEC(good, 1, 2, 3);
    VEC(bad, 0, NAN, 0);

    REFUSED(isocoat_link_apply_force(world, rigid.link, bad, NULL), range, "force is (0, NaN, 0); must be finite");
    REFUSED(isocoat_link_apply_force(world, rigid.link, good, bad), range, "point is (0, NaN, 0)");
    REFUSED(isocoat_link_apply_torque(world, rigid.link, bad), range, "torque is (0, NaN, 0)");
    REFUSED(isocoat_link_apply_impulse(world, rigid.link, bad, good), range, "impulse is (0, NaN, 0)");
    REFUSED(isocoat_link_apply_impulse(world, rigid.link, good, bad), range, "point is (0, NaN, 0)");
    REFUSED(isocoat_link_apply_angular_impulse(world, rigid.link, bad), range, "angular impulse is (0, NaN, 0)");
    REFUSED(isocoat_link_set_external_acceleration(world, rigid.link, bad, good), range, "external_acceleration is (0");
    REFUSED(isocoat_link_set_external_acceleration(world, rigid.link, good, bad), range, "external_angular_acc");
    REFUSED(isocoat_link_apply_force(world, driven.link, good, NULL), unsupported, "the host pushes its own bodies");
    REFUSED(isocoat_link_apply_torque(world, fixed.link, good), unsupported, "links that the library integrates");
    REFUSED(isocoat_link_apply_impulse(world, driven.link, good, NULL), unsupported, "forces and impulses");
    REFUSED(isocoat_link_apply_angular_impulse(world, fixed.link, good), unsupported, "forces and impulses");

    OK(isocoat_link_get_state(world, driven.link, &state));
    state.pose.position[0] = 1.0;
    state.pose.orientation[3] = 0.9;
    REFUSED(isocoat_link_set_state(world, driven.link, &state), range, "norm of the rotation quaternion is 0.9");
    REFUSED(isocoat_link_teleport(world, driven.link, &state), range, "norm of the rotation quaternion is 0.9");
    state.pose.orientation[3] = 1.0;
    state.angular_velocity[1] = NAN;
    REFUSED(isocoat_link_set_state(world, driven.link, &state), range, "angular_velocity is (0, NaN, 0)");
    REFUSED(isocoat_link_teleport(world, driven.link, &state), range, "angular_velocity is (0, NaN, 0)");
    OK(isocoat_link_get_state(world, driven.link, &after));
    CHECK_NEAR(after.pose.position[0], 0.0, 0.0);
    isocoat_world_destroy(world);
}

static void inertia_tensors(void)
{
    double inertia[9] = {7, 7, 7, 7, 7, 7, 7, 7, 7};
    VEC(half, 1, 2, 3);
    VEC(flat, 1, 0, 3);
    REFUSED(isocoat_inertia_of_sphere(0.0, 1.0, inertia), range, "mass is 0; must be > 0");
    REFUSED(isocoat_inertia_of_sphere(1.0, NAN, inertia), range, "radius is NaN");
    REFUSED(isocoat_inertia_of_sphere(1.0, 1.0, NULL), argument, "inertia is NULL");
    REFUSED(isocoat_inertia_of_box(-1.0, half, inertia), range, "mass is -1");
    REFUSED(isocoat_inertia_of_box(1.0, flat, inertia), range, "half_extents[1] is 0; must be > 0");
    REFUSED(isocoat_inertia_of_box(1.0, NULL, inertia), argument, "half_extents is NULL");
    REFUSED(isocoat_inertia_of_box(1.0, half, NULL), argument, "inertia is NULL");
    REFUSED(isocoat_inertia_of_capsule(1.0, 0.0, 1.0, inertia), range, "radius is 0");
    REFUSED(isocoat_inertia_of_capsule(1.0, 1.0, -1.0, inertia), range,
            "half_length is -1; must be finite and at least 0");
    REFUSED(isocoat_inertia_of_capsule(1.0, 1.0, 1.0, NULL), argument, "inertia is NULL");
    CHECK_NEAR(inertia[0], 7.0, 0.0);
    OK(isocoat_inertia_of_box(3.0, half, inertia));
    CHECK_NEAR(inertia[0], 13.0, 1e-12);
    CHECK_NEAR(inertia[4], 10.0, 1e-12);
    CHECK_NEAR(inertia[8], 5.0, 1e-12);
    CHECK_NEAR(inertia[1], 0.0, 0.0);
}

static void refused_calls_have_no_effect_on_what_follows(void)
{
    isocoat_world *world = new_world();
    isocoat_counters counters = isocoat_counters_default();
    isocoat_body_desc desc = isocoat_body_desc_default();
    isocoat_body body;
    desc.isovalue = -1.0;
    REFUSED(isocoat_body_create(world, &desc, &body), range, "isovalue");
    OK(isocoat_world_get_counters(world, &counters));
    CHECK(counters.bodies == 0);
    OK(isocoat_world_step(world, 0.01));
    isocoat_world_destroy(world);
}

int main(void)
{
    worlds();
    bodies();
    links();
    skeletons();
    unused_points_are_ignored();
    pushes_and_states();
    inertia_tensors();
    refused_calls_have_no_effect_on_what_follows();
    return verdict("ranges");
}
