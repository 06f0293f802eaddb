/*
 * A clover falls down a staircase: three leaves and a stem, four points in one soft coat on one rigid link. With a
 * folder as argument it leaves pictures there, with --record FILE a recording. Exits 0 when nothing ever presses
 * through half of the coat, when the clover lies still at the foot of the stairs in the end, and when no flight has
 * more energy than the flight before.
 */
#include <isocoat/isocoat.h>

#include "../common/check.h"
#include "../common/picture.h"
#include "../common/record.h"

#include <stdio.h>
#include <string.h>

#define PARTS 4
#define STAIRS 6
static const double GRAVITY = 9.81, STEP = 1.0 / 120.0, SECONDS = 10.0, MASS = 0.4;
static const double RISE = 0.16, DEPTH = 0.19, WIDTH = 0.8;
/* So that the check for what comes through can ask about the stairs alone. */
static const uint64_t CLOVER = 1, GROUND = 2;

/* Leaves and stem in the plane x z of the link, round its centre of mass: where, and how thick. */
static const double PLACES[PARTS][3] = {{0.0, 0.0, 0.06}, {-0.068, 0.0, -0.02}, {0.068, 0.0, -0.02}, {0.0, 0.0, -0.1}};
static const double THICKNESS[PARTS] = {0.06, 0.06, 0.06, 0.035};

/* A rigid body that never moves, of one skeleton. */
static int add_ground(isocoat_world *world, const isocoat_skeleton_desc *shape)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    body_desc.kind = ISOCOAT_BODY_RIGID;
    body_desc.friction = 0.4;
    body_desc.static_friction = 0.5;
    body_desc.category = GROUND;
    isocoat_body body;
    CHECK(isocoat_body_create(world, &body_desc, &body));
    const isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_link link;
    CHECK(isocoat_link_create(world, body, &link_desc, &link));
    isocoat_skeleton skeleton;
    CHECK(isocoat_skeleton_create(world, link, shape, &skeleton));
    return 0;
}

static int add_stairs(isocoat_world *world)
{
    isocoat_skeleton_desc shape = isocoat_skeleton_desc_default();
    shape.thickness = 0.02;
    shape.shape = ISOCOAT_SHAPE_PLANE;
    shape.points[0][2] = -shape.thickness;
    shape.points[1][2] = 1.0;
    if (add_ground(world, &shape)) return 1;
    for (int k = 0; k < STAIRS; ++k) {
        /* Each reaches back under the one above it, so that no groove is left between them, and is a little wider, so
           that no two faces lie in one plane. The skeleton is smaller than the stair by the thickness of its coat. */
        const double half[3] = {DEPTH, 0.5 * WIDTH + 0.02 * k, 0.5 * (STAIRS - k) * RISE};
        shape.shape = ISOCOAT_SHAPE_BOX;
        memset(shape.points, 0, sizeof shape.points);
        shape.points[0][0] = k * DEPTH;
        shape.points[0][2] = half[2];
        for (int axis = 0; axis < 3; ++axis) shape.points[1][axis] = half[axis] - shape.thickness;
        if (add_ground(world, &shape)) return 1;
    }
    return 0;
}

/* Gives its inertia tensor: that of a plate of its size. */
static int add_clover(isocoat_world *world, isocoat_link *link, double inertia[9])
{
    const double plate[3] = {0.12, 0.05, 0.12};
    CHECK(isocoat_inertia_of_box(MASS, plate, inertia));
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    body_desc.stiffness_scale = 8e4;
    body_desc.friction = 0.4;
    body_desc.static_friction = 0.5;
    body_desc.dissipation = 2.0;
    body_desc.category = CLOVER;
    isocoat_body body;
    CHECK(isocoat_body_create(world, &body_desc, &body));
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    link_desc.kind = ISOCOAT_LINK_RIGID;
    link_desc.mass = MASS;
    memcpy(link_desc.inertia, inertia, sizeof link_desc.inertia);
    link_desc.pose.position[2] = STAIRS * RISE + 0.35;
    link_desc.linear_velocity[0] = 0.9;
    link_desc.angular_velocity[0] = 0.5;
    link_desc.angular_velocity[1] = 6.0;
    CHECK(isocoat_link_create(world, body, &link_desc, link));
    for (int part = 0; part < PARTS; ++part) {
        isocoat_skeleton_desc shape = isocoat_skeleton_desc_default();
        memcpy(shape.points[0], PLACES[part], sizeof shape.points[0]);
        shape.thickness = THICKNESS[part];
        shape.radius = THICKNESS[part] + 0.05;
        isocoat_skeleton skeleton;
        CHECK(isocoat_skeleton_create(world, *link, &shape, &skeleton));
    }
    return 0;
}

/* v turned by the quaternion q, or turned back. */
static void turn(const double q[4], double way, const double v[3], double out[3])
{
    const double axis[3] = {way * q[0], way * q[1], way * q[2]};
    double once[3], twice[3];
    picture_cross(axis, v, once);
    picture_cross(axis, once, twice);
    for (int k = 0; k < 3; ++k) out[k] = v[k] + 2.0 * (q[3] * once[k] + twice[k]);
}

static double energy_of(const isocoat_link_state *state, const double inertia[9])
{
    double spin[3], twice = MASS * picture_dot(state->linear_velocity, state->linear_velocity);
    turn(state->pose.orientation, -1.0, state->angular_velocity, spin);
    for (int axis = 0; axis < 3; ++axis) twice += inertia[4 * axis] * spin[axis] * spin[axis];
    return 0.5 * twice + MASS * GRAVITY * state->pose.position[2];
}

/* At most, of any of its points: they are within 0.14 m of its centre of mass. */
static double speed_of(const isocoat_link_state *state)
{
    return sqrt(picture_dot(state->linear_velocity, state->linear_velocity)) +
           0.14 * sqrt(picture_dot(state->angular_velocity, state->angular_velocity));
}

int main(int count, char **arguments)
{
    recording film;
    if (record_begin(&film, record_argument(&count, arguments))) return 1;
    isocoat_world_desc world_desc = isocoat_world_desc_default();
    world_desc.gravity[2] = -GRAVITY;
    isocoat_world *world = NULL;
    CHECK(isocoat_world_create(&world_desc, &world));
    isocoat_link clover;
    double inertia[9];
    if (add_stairs(world) || add_clover(world, &clover, inertia)) return 1;

    isocoat_link_state state;
    CHECK(isocoat_link_get_state(world, clover, &state));
    double flight = energy_of(&state, inertia), gained = 0.0;
    const double start = flight;
    size_t through = 0;
    int flights = 0, touched = 0;
    printf("time [s]      x [m]      z [m]  speed [m/s]   energy [J]\n");
    for (int tick = 0; tick <= (int)lround(SECONDS / STEP); ++tick) {
        if (tick % 60 == 0) {
            printf("%8.2f %10.3f %10.3f %12.5f %12.4f\n", tick * STEP, state.pose.position[0], state.pose.position[2],
                   speed_of(&state), energy_of(&state, inertia));
        }
        if (count > 1 && tick % 10 == 0 && tick < 400) {
            /* The camera goes along. */
            const double *at = state.pose.position;
            const picture_view view = {{at[0] + 1.6, -2.0, at[2] + 1.2}, {at[0], 0.0, at[2]}, {0.0, 0.0, 1.0}, 1.3};
            char path[512];
            snprintf(path, sizeof path, "%s/clover%02d.ppm", arguments[1], tick / 10);
            if (picture_write(world, &view, UINT64_MAX, 480, 360, path)) return 1;
        }
        if (record_frame(&film, world, tick * STEP)) return 1;
        CHECK(isocoat_world_step(world, STEP));
        CHECK(isocoat_link_get_state(world, clover, &state));

        /* In flight the coat holds no elastic energy: all there is is kinetic and potential. */
        const isocoat_contact *contacts;
        size_t contact_count;
        CHECK(isocoat_world_get_contacts(world, &contacts, &contact_count));
        if (contact_count == 0) {
            const double now = energy_of(&state, inertia);
            gained = fmax(gained, now - flight);
            flight = fmin(flight, now);
            flights += touched || tick == 0;
        }
        touched = contact_count > 0;

        /* Nothing of the stairs comes nearer to a point than half of the coat over it. */
        for (int part = 0; part < PARTS; ++part) {
            double at[3];
            size_t found = 0;
            turn(state.pose.orientation, 1.0, PLACES[part], at);
            for (int axis = 0; axis < 3; ++axis) at[axis] += state.pose.position[axis];
            CHECK(isocoat_world_overlap_sphere(world, at, 0.5 * THICKNESS[part], GROUND, NULL, 0, &found));
            through += found;
        }
    }
    const double speed = speed_of(&state);
    printf("%d flights; energy %.4f J at first, %.4f J in the last of them, gained at most %.1e J\n"
           "half through the coat %d times; in the end no faster than %.1e m/s\n",
           flights, start, flight, gained, (int)through, speed);
    if (record_end(&film)) return 1;
    isocoat_world_destroy(world);
    return flights >= 3 && gained < 1e-6 * start && through == 0 && speed < 2e-3 &&
                   state.pose.position[0] > STAIRS * DEPTH
               ? 0
               : 1;
}
