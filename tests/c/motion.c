/* States, pushes, and the bulk calls that a host makes in every tick. */
#include "check.h"

static void a_free_link_falls_and_is_pushed(void)
{
    isocoat_world_desc desc = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    isocoat_link_state state;
    isocoat_body body;
    isocoat_link link;
    VEC(force, 0, 3, 0);
    VEC(impulse, 2, 0, 0);
    VEC(spin, 0, 0, 0.004);
    VEC(arm, 0, 0.5, 100);
    VEC(none, 0, 0, 0);
    VEC(up, 0, 0, 20);
    const double dt = 1.0 / 64.0;

    desc.gravity[2] = -10.0;
    OK(isocoat_world_create(&desc, &world));
    body = new_body(world);
    link = new_link(world, body, ISOCOAT_LINK_RIGID, 100.0);

    /* One step: an impulse of 2 N s on 1 kg, a force of 3 N, gravity. */
    OK(isocoat_link_apply_impulse(world, link, impulse, NULL));
    OK(isocoat_link_apply_force(world, link, force, NULL));
    OK(isocoat_world_step(world, dt));
    OK(isocoat_link_get_state(world, link, &state));
    CHECK_NEAR(state.linear_velocity[0], 2.0, 1e-12);
    CHECK_NEAR(state.linear_velocity[1], 3.0 * dt, 1e-12);
    CHECK_NEAR(state.linear_velocity[2], -10.0 * dt, 1e-12);
    CHECK_NEAR(state.pose.position[0], 2.0 * dt, 1e-3);

    /* Forces and impulses last one step; an external acceleration lasts. */
    OK(isocoat_link_set_external_acceleration(world, link, up, none));
    OK(isocoat_link_set_constrained(world, link, 1));
    OK(isocoat_link_set_constrained(world, link, 0));
    OK(isocoat_world_step(world, dt));
    OK(isocoat_world_step(world, dt));
    OK(isocoat_link_get_state(world, link, &state));
    CHECK_NEAR(state.linear_velocity[0], 2.0, 1e-12);
    CHECK_NEAR(state.linear_velocity[1], 3.0 * dt, 1e-12);
    CHECK_NEAR(state.linear_velocity[2], 10.0 * dt, 1e-12);

    /* The inertia of the ball of 0.1 m is 0.004 kg m^2: an angular impulse of as much gives 1 rad/s. */
    OK(isocoat_link_apply_angular_impulse(world, link, spin));
    OK(isocoat_world_step(world, dt));
    OK(isocoat_link_get_state(world, link, &state));
    CHECK_NEAR(state.angular_velocity[2], 1.0, 1e-9);
    OK(isocoat_link_apply_torque(world, link, spin));
    OK(isocoat_world_step(world, dt));
    OK(isocoat_link_get_state(world, link, &state));
    CHECK_NEAR(state.angular_velocity[2], 1.0 + dt, 1e-9);

    /* Off the centre, a push also turns. */
    memset(&state, 0, sizeof state);
    state.pose.position[2] = 100.0;
    state.pose.orientation[3] = 1.0;
    OK(isocoat_link_teleport(world, link, &state));
    OK(isocoat_link_apply_impulse(world, link, impulse, arm));
    OK(isocoat_world_step(world, dt));
    OK(isocoat_link_get_state(world, link, &state));
    CHECK_NEAR(state.angular_velocity[2], -0.5 * 2.0 / 0.004, 1e-6);
    isocoat_world_destroy(world);
}

static void a_state_is_normalised(void)
{
    isocoat_world *world = new_world();
    const ball b = new_ball(world, ISOCOAT_LINK_HOST, 0.0);
    isocoat_link_state in, out;
    memset(&in, 0, sizeof in);
    in.pose.position[0] = 0.25;
    in.pose.orientation[0] = 0.6 * 1.0005;
    in.pose.orientation[3] = 0.8 * 1.0005;
    in.linear_velocity[1] = 0.5;
    in.angular_velocity[2] = 0.75;
    OK(isocoat_link_set_state(world, b.link, &in));
    OK(isocoat_link_get_state(world, b.link, &out));
    CHECK_NEAR(out.pose.position[0], 0.25, 0.0);
    CHECK_NEAR(out.pose.orientation[0], 0.6, 1e-15);
    CHECK_NEAR(out.pose.orientation[3], 0.8, 1e-15);
    CHECK_NEAR(out.linear_velocity[1], 0.5, 0.0);
    CHECK_NEAR(out.angular_velocity[2], 0.75, 0.0);
    isocoat_world_destroy(world);
}

/* A host's own struct, as bulk calls see it. */
typedef struct host_object {
    int id;
    float position[3];
    float orientation[4];
    double force[3];
    int tail;
} host_object;

#define N 4

static void bulk_calls_agree_with_single_ones(void)
{
    isocoat_world *world = new_world();
    const ball ground = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    isocoat_link links[N];
    isocoat_link_state states[N], state;
    isocoat_wrench wrench;
    host_object objects[N];
    double packed[N][3], torques[N][3];
    const isocoat_buffer skip = {NULL, 0, ISOCOAT_FORMAT_F64};
    isocoat_buffer positions, orientations, forces, into_packed, into_torques;
    int i, j, touching = 0;
    (void)ground;

    memset(states, 0, sizeof states);
    memset(objects, 0x55, sizeof objects);
    for (i = 0; i < N; ++i) {
        links[i] = new_ball(world, ISOCOAT_LINK_HOST, 50.0 * i).link;
        states[i].pose.position[0] = 0.1 * i;
        states[i].pose.position[2] = 0.19 + i;
        states[i].pose.orientation[2] = 0.6;
        states[i].pose.orientation[3] = 0.8;
        states[i].linear_velocity[2] = -0.5 * i;
        objects[i].id = objects[i].tail = i;
    }
    OK(isocoat_world_set_link_states(world, links, states, N));
    for (i = 0; i < N; ++i) {
        OK(isocoat_link_get_state(world, links[i], &state));
        CHECK_NEAR(state.pose.position[2], states[i].pose.position[2], 0.0);
        CHECK_NEAR(state.linear_velocity[2], states[i].linear_velocity[2], 0.0);
    }
    OK(isocoat_world_step(world, 1.0 / 60.0));

    positions.data = objects[0].position;
    positions.stride = sizeof objects[0];
    positions.format = ISOCOAT_FORMAT_F32;
    orientations = positions;
    orientations.data = objects[0].orientation;
    OK(isocoat_world_get_link_states(world, links, N, positions, orientations));
    forces.data = objects[0].force;
    forces.stride = sizeof objects[0];
    forces.format = ISOCOAT_FORMAT_F64;
    OK(isocoat_world_get_link_wrenches(world, links, N, forces, skip));
    into_packed.data = packed;
    into_packed.stride = 0;
    into_packed.format = ISOCOAT_FORMAT_F64;
    into_torques = into_packed;
    into_torques.data = torques;
    OK(isocoat_world_get_link_impulses(world, links, N, into_packed, into_torques));

    for (i = 0; i < N; ++i) {
        OK(isocoat_link_get_state(world, links[i], &state));
        for (j = 0; j < 3; ++j) CHECK(objects[i].position[j] == (float)state.pose.position[j]);
        for (j = 0; j < 4; ++j) CHECK(objects[i].orientation[j] == (float)state.pose.orientation[j]);
        OK(isocoat_link_get_wrench(world, links[i], &wrench));
        CHECK(memcmp(objects[i].force, wrench.force, sizeof wrench.force) == 0);
        touching += wrench.force[2] > 0.0;
        OK(isocoat_link_get_impulse(world, links[i], &wrench));
        CHECK(memcmp(packed[i], wrench.force, sizeof wrench.force) == 0);
        CHECK(memcmp(torques[i], wrench.torque, sizeof wrench.torque) == 0);
        CHECK(objects[i].id == i && objects[i].tail == i);
    }
    CHECK(touching == 1);
    CHECK(packed[0][2] > 0.0);

    /* Torques alone, and the wrenches of a fixed link. */
    memset(torques, 0x55, sizeof torques);
    OK(isocoat_world_get_link_wrenches(world, &ground.link, 1, into_packed, into_torques));
    CHECK(packed[0][2] < 0.0);
    OK(isocoat_world_get_link_impulses(world, &ground.link, 1, skip, into_torques));
    CHECK_NEAR(torques[0][0], 0.0, 0.0);

    /* Nothing to do is done. */
    OK(isocoat_world_set_link_states(world, NULL, NULL, 0));
    OK(isocoat_world_get_link_states(world, NULL, 0, positions, orientations));
    isocoat_world_destroy(world);
}

static void a_bulk_call_is_done_whole_or_not_at_all(void)
{
    isocoat_world *world = new_world();
    isocoat_link links[3];
    isocoat_link_state states[3], state;
    isocoat_buffer buffer;
    double numbers[9];
    const isocoat_buffer skip = {NULL, 0, ISOCOAT_FORMAT_F64};
    int i;
    memset(states, 0, sizeof states);
    for (i = 0; i < 3; ++i) {
        links[i] = new_ball(world, ISOCOAT_LINK_HOST, 5.0 * i).link;
        states[i].pose.position[0] = 7.0;
        states[i].pose.orientation[3] = 1.0;
        numbers[3 * i] = 42.0;
    }
    buffer.data = numbers;
    buffer.stride = 0;
    buffer.format = ISOCOAT_FORMAT_F64;

    states[2].pose.orientation[3] = 0.5;
    REFUSED(isocoat_world_set_link_states(world, links, states, 3), ISOCOAT_ERROR_OUT_OF_RANGE,
            "states[2]: norm of the rotation quaternion is 0.5");
    states[2].pose.orientation[3] = 1.0;
    states[1].linear_velocity[0] = INFINITY;
    REFUSED(isocoat_world_set_link_states(world, links, states, 3), ISOCOAT_ERROR_OUT_OF_RANGE,
            "states[1]: linear_velocity is (inf, 0, 0)");
    states[1].linear_velocity[0] = 0.0;
    OK(isocoat_link_destroy(world, links[2]));
    REFUSED(isocoat_world_set_link_states(world, links, states, 3), ISOCOAT_ERROR_INVALID_HANDLE,
            "links[2]: link: the handle is stale");
    for (i = 0; i < 2; ++i) {
        OK(isocoat_link_get_state(world, links[i], &state));
        CHECK_NEAR(state.pose.position[0], 0.0, 0.0);
    }
    REFUSED(isocoat_world_get_link_states(world, links, 3, buffer, skip), ISOCOAT_ERROR_INVALID_HANDLE, "links[2]");
    REFUSED(isocoat_world_get_link_wrenches(world, links, 3, buffer, skip), ISOCOAT_ERROR_INVALID_HANDLE, "links[2]");
    REFUSED(isocoat_world_get_link_impulses(world, links, 3, skip, buffer), ISOCOAT_ERROR_INVALID_HANDLE, "links[2]");
    CHECK_NEAR(numbers[0], 42.0, 0.0);

    REFUSED(isocoat_world_set_link_states(world, NULL, states, 1), ISOCOAT_ERROR_INVALID_ARGUMENT, "links is NULL");
    REFUSED(isocoat_world_set_link_states(world, links, NULL, 1), ISOCOAT_ERROR_INVALID_ARGUMENT, "states is NULL");
    REFUSED(isocoat_world_get_link_states(world, NULL, 1, skip, skip), ISOCOAT_ERROR_INVALID_ARGUMENT, "links is NULL");
    REFUSED(isocoat_world_set_link_states(world, links, states, SIZE_MAX), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "no memory is that large");
    buffer.stride = 16;
    REFUSED(isocoat_world_get_link_states(world, links, 1, buffer, skip), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "positions.stride is 16; must be 0 (no gaps) or at least 24");
    REFUSED(isocoat_world_get_link_states(world, links, 1, skip, buffer), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "orientations.stride is 16; must be 0 (no gaps) or at least 32");
    buffer.format = ISOCOAT_FORMAT_F32;
    OK(isocoat_world_get_link_wrenches(world, links, 1, buffer, buffer));
    buffer.format = 2;
    REFUSED(isocoat_world_get_link_wrenches(world, links, 1, buffer, skip), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "linear.format is 2; must be one of ISOCOAT_FORMAT_*, 0 to 1");
    REFUSED(isocoat_world_get_link_impulses(world, links, 1, skip, buffer), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "angular.format is 2");
    isocoat_world_destroy(world);
}

/* A ball of the host, pushed out of a fixed one by the impulses alone: what it gains is what the ground gives. */
static void a_host_is_driven_by_impulses(void)
{
    isocoat_world *world = new_world();
    const ball ground = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    const ball driven = new_ball(world, ISOCOAT_LINK_HOST, 0.19);
    isocoat_link_state state;
    isocoat_wrench impulse, on_ground;
    const double dt = 1.0 / 60.0;
    double given = 0.0;
    int i;
    OK(isocoat_link_get_state(world, driven.link, &state));
    for (i = 0; i < 120; ++i) {
        OK(isocoat_world_set_link_states(world, &driven.link, &state, 1));
        OK(isocoat_world_step(world, dt));
        OK(isocoat_link_get_impulse(world, driven.link, &impulse));
        OK(isocoat_link_get_wrench(world, ground.link, &on_ground));
        given -= on_ground.force[2] * dt;
        state.linear_velocity[2] += impulse.force[2];
        state.pose.position[2] += state.linear_velocity[2] * dt;
    }
    CHECK(state.linear_velocity[2] > 0.1 && state.pose.position[2] > 0.2);
    CHECK_NEAR(state.linear_velocity[2], given, 1e-3 * given);
    isocoat_world_destroy(world);
}

/* The speed of a ball that is pushed out of a fixed one: alone with two kilograms, or with one and another ball of one
 * kilogram that a rod ties to it. */
static double pushed_out(int tied)
{
    isocoat_world_desc settings = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    isocoat_link links[2];
    isocoat_link_state states[2];
    isocoat_link_desc desc = isocoat_link_desc_default();
    isocoat_wrench impulse;
    double matrix[144] = {0};
    const size_t counts[1] = {2};
    const double dt = 1.0 / 60.0, inertia = tied ? 0.004 : 0.008;
    int i, k;
    settings.response = ISOCOAT_RESPONSE_IMPLICIT;
    OK(isocoat_world_create(&settings, &world));
    (void)new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    links[0] = new_ball(world, ISOCOAT_LINK_HOST, 0.19).link;
    links[1] = new_ball(world, ISOCOAT_LINK_HOST, 5.0).link;
    if (!tied) {
        OK(isocoat_link_get_desc(world, links[0], &desc));
        desc.mass = 2.0;
        for (k = 0; k < 3; ++k) desc.inertia[4 * k] = inertia;
        OK(isocoat_link_set_desc(world, links[0], &desc));
    } else {
        for (k = 0; k < 12; ++k) matrix[13 * k] = k % 6 < 3 ? 0.5 * (1.0 + 1e-6) : 1.0 / inertia;
        for (k = 0; k < 3; ++k) matrix[12 * k + 6 + k] = matrix[12 * (6 + k) + k] = 0.5;
        OK(isocoat_world_set_articulations(world, links, counts, matrix, 1));
    }
    for (k = 0; k < 2; ++k) OK(isocoat_link_get_state(world, links[k], &states[k]));
    for (i = 0; i < 60; ++i) {
        OK(isocoat_world_set_link_states(world, links, states, 2));
        OK(isocoat_world_step(world, dt));
        OK(isocoat_link_get_impulse(world, links[0], &impulse));
        for (k = 0; k < 2; ++k) {
            states[k].linear_velocity[2] += 0.5 * impulse.force[2];
            states[k].pose.position[2] += states[k].linear_velocity[2] * dt;
        }
    }
    isocoat_world_destroy(world);
    return states[0].linear_velocity[2];
}

static void an_articulation_is_pushed_as_one(void)
{
    const double alone = pushed_out(0);
    CHECK(alone > 0.05);
    CHECK_NEAR(pushed_out(1), alone, 1e-4 * alone);
}

static void articulations_are_set_all_or_none(void)
{
    isocoat_world *world = new_world();
    isocoat_link links[3];
    size_t counts[2] = {1, 1};
    double matrices[72] = {0};
    const isocoat_status bad = ISOCOAT_ERROR_INVALID_ARGUMENT;
    int i;
    for (i = 0; i < 2; ++i) links[i] = new_ball(world, ISOCOAT_LINK_HOST, 5.0 * i).link;
    links[2] = new_ball(world, ISOCOAT_LINK_FIXED, 10.0).link;
    for (i = 0; i < 12; ++i) matrices[36 * (i / 6) + 7 * (i % 6)] = 1.0;
    OK(isocoat_world_set_articulations(world, links, counts, matrices, 2));
    OK(isocoat_world_set_articulations(world, links, counts, matrices, 1));
    OK(isocoat_world_set_articulations(world, NULL, NULL, NULL, 0));

    REFUSED(isocoat_world_set_articulations(NULL, links, counts, matrices, 2), bad, "world is NULL");
    REFUSED(isocoat_world_set_articulations(world, NULL, counts, matrices, 2), bad, "links is NULL");
    REFUSED(isocoat_world_set_articulations(world, links, NULL, matrices, 2), bad, "link_counts is NULL");
    REFUSED(isocoat_world_set_articulations(world, links, counts, NULL, 2), bad, "inverse_inertias is NULL");
    matrices[36] = -1.0;
    REFUSED(isocoat_world_set_articulations(world, links, counts, matrices, 2), ISOCOAT_ERROR_OUT_OF_RANGE,
            "articulations[1]: inverse_inertia is not positive definite");
    matrices[36] = 1.0;
    links[1] = links[0];
    REFUSED(isocoat_world_set_articulations(world, links, counts, matrices, 2), ISOCOAT_ERROR_UNSUPPORTED,
            "articulations[1]: a link may be named once");
    links[1] = links[2];
    REFUSED(isocoat_world_set_articulations(world, links, counts, matrices, 2), ISOCOAT_ERROR_UNSUPPORTED,
            "articulations[1]: a link of an articulation must be host-driven");
    counts[1] = 0;
    REFUSED(isocoat_world_set_articulations(world, links, counts, matrices, 2), ISOCOAT_ERROR_OUT_OF_RANGE,
            "articulations[1]: number of links is 0; must be from 1 to 256");
    counts[1] = SIZE_MAX;
    REFUSED(isocoat_world_set_articulations(world, links, counts, matrices, 2), ISOCOAT_ERROR_OUT_OF_RANGE,
            "articulations[1]: number of links is ");
    isocoat_world_destroy(world);
}

int main(void)
{
    a_free_link_falls_and_is_pushed();
    a_state_is_normalised();
    bulk_calls_agree_with_single_ones();
    a_bulk_call_is_done_whole_or_not_at_all();
    a_host_is_driven_by_impulses();
    an_articulation_is_pushed_as_one();
    articulations_are_set_all_or_none();
    return verdict("motion");
}
