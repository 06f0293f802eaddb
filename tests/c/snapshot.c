/* Snapshots: taken into the host's buffer, put back, refused when damaged; what becomes of handles. */
#include "check.h"

#include <stdint.h>

#define TICKS 40

/* A ball that the host moves and one that the library moves, both above a ball that stands still. */
typedef struct scene {
    isocoat_world *world;
    ball ground, hosted, falling;
} scene;

static scene new_scene(void)
{
    isocoat_world_desc desc = isocoat_world_desc_default();
    isocoat_body_desc rough = isocoat_body_desc_default();
    scene made;
    desc.gravity[2] = -9.8;
    rough.friction = 0.3;
    rough.static_friction = 0.4;
    OK(isocoat_world_create(&desc, &made.world));
    made.ground = new_ball(made.world, ISOCOAT_LINK_FIXED, 0.0);
    made.hosted = new_ball(made.world, ISOCOAT_LINK_HOST, 0.25);
    made.falling = new_ball(made.world, ISOCOAT_LINK_RIGID, 0.44);
    OK(isocoat_body_set_desc(made.world, made.ground.body, &rough));
    OK(isocoat_body_set_desc(made.world, made.hosted.body, &rough));
    return made;
}

/* What a tick leaves: both states, wrench and impulse, the number of contacts and of events. */
typedef struct record {
    isocoat_link_state states[2];
    isocoat_wrench wrench, impulse;
    size_t contacts, events;
} record;

static void run(isocoat_world *world, isocoat_link hosted, isocoat_link falling, record *records)
{
    const double dt = 1.0 / 60.0;
    const isocoat_contact *contacts;
    const isocoat_event *events;
    int tick;
    for (tick = 0; tick < TICKS; ++tick) {
        record *now = &records[tick];
        isocoat_link_state state;
        int i;
        memset(now, 0, sizeof *now);
        OK(isocoat_world_step(world, dt));
        OK(isocoat_link_get_impulse(world, hosted, &now->impulse));
        OK(isocoat_link_get_state(world, hosted, &state));
        state.linear_velocity[2] -= 9.8 * dt;
        for (i = 0; i < 3; ++i) {
            state.linear_velocity[i] += now->impulse.force[i];
            state.pose.position[i] += state.linear_velocity[i] * dt;
        }
        OK(isocoat_link_set_state(world, hosted, &state));
        OK(isocoat_link_get_state(world, hosted, &now->states[0]));
        OK(isocoat_link_get_state(world, falling, &now->states[1]));
        OK(isocoat_link_get_wrench(world, falling, &now->wrench));
        OK(isocoat_world_get_contacts(world, &contacts, &now->contacts));
        OK(isocoat_world_get_events(world, &events, &now->events));
    }
}

static uint8_t *taken(isocoat_world *world, size_t *size)
{
    uint8_t *buffer;
    OK(isocoat_world_snapshot(world, NULL, 0, size));
    buffer = (uint8_t *)malloc(*size);
    OK(isocoat_world_snapshot(world, buffer, *size, size));
    return buffer;
}

static void a_restored_world_goes_on_bit_for_bit(void)
{
    static record first[TICKS], second[TICKS];
    scene one = new_scene();
    VEC(push, 0.1, 0.2, 0.3);
    size_t size = 0, count = 99;
    uint8_t *bytes;
    const isocoat_contact *contacts;
    const isocoat_event *events;
    isocoat_counters counters = isocoat_counters_default();
    isocoat_world *other = new_world();
    const ball own = new_ball(other, ISOCOAT_LINK_FIXED, 3.0);
    isocoat_body bodies[3];
    isocoat_link hosted, falling;
    isocoat_world_desc desc = isocoat_world_desc_default();
    bool enabled;

    run(one.world, one.hosted.link, one.falling.link, first);
    OK(isocoat_link_apply_impulse(one.world, one.falling.link, push, NULL));
    bytes = taken(one.world, &size);
    run(one.world, one.hosted.link, one.falling.link, first);
    CHECK(first[0].contacts + first[TICKS - 1].contacts > 0);

    OK(isocoat_world_restore(one.world, bytes, size));
    OK(isocoat_world_get_contacts(one.world, &contacts, &count));
    CHECK(count == 0);
    OK(isocoat_world_get_events(one.world, &events, &count));
    CHECK(count == 0);
    OK(isocoat_world_get_counters(one.world, &counters));
    CHECK(counters.bodies == 3 && counters.patches == 0 && counters.pairs == 0);
    run(one.world, one.hosted.link, one.falling.link, second);
    CHECK(memcmp(first, second, sizeof first) == 0);

    /* In another world: its own ball is gone, the handles of both are void, the new ones are listed. */
    OK(isocoat_world_restore(other, bytes, size));
    REFUSED(isocoat_body_is_enabled(other, own.body, &enabled), ISOCOAT_ERROR_INVALID_HANDLE, "another world");
    REFUSED(isocoat_body_is_enabled(other, one.ground.body, &enabled), ISOCOAT_ERROR_INVALID_HANDLE, "another world");
    OK(isocoat_world_get_bodies(other, NULL, 0, &count));
    CHECK(count == 3);
    count = 0;
    REFUSED(isocoat_world_get_bodies(other, bodies, 2, &count), ISOCOAT_ERROR_BUFFER_TOO_SMALL, "capacity is 2");
    REFUSED(isocoat_world_get_bodies(other, NULL, 3, &count), ISOCOAT_ERROR_INVALID_ARGUMENT, "bodies is NULL");
    REFUSED(isocoat_world_get_bodies(other, bodies, 3, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "count is NULL");
    CHECK(count == 3);
    OK(isocoat_world_get_bodies(other, bodies, 3, &count));
    CHECK(bodies[1].index == one.hosted.body.index && bodies[1].generation == one.hosted.body.generation);
    OK(isocoat_body_get_links(other, bodies[1], &hosted, 1, &count));
    OK(isocoat_body_get_links(other, bodies[2], &falling, 1, &count));
    OK(isocoat_world_get_desc(other, &desc));
    CHECK(desc.gravity[2] == -9.8);
    run(other, hosted, falling, second);
    CHECK(memcmp(first, second, sizeof first) == 0);

    free(bytes);
    isocoat_world_destroy(other);
    isocoat_world_destroy(one.world);
}

static void buffers(void)
{
    scene one = new_scene();
    size_t size = 0, same = 0, i;
    uint8_t *room;
    OK(isocoat_world_snapshot(one.world, NULL, 0, &size));
    CHECK(size > 100);
    room = (uint8_t *)malloc(size + 8);
    memset(room, 0xa5, size + 8);
    REFUSED(isocoat_world_snapshot(one.world, room, size - 1, &same), ISOCOAT_ERROR_BUFFER_TOO_SMALL, "capacity is");
    CHECK(same == size);
    for (i = 0; i < size + 8; ++i) CHECK(room[i] == 0xa5);
    REFUSED(isocoat_world_snapshot(one.world, NULL, size, &same), ISOCOAT_ERROR_INVALID_ARGUMENT, "buffer is NULL");
    REFUSED(isocoat_world_snapshot(one.world, room, size, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "size is NULL");
    REFUSED(isocoat_world_snapshot(NULL, room, size, &same), ISOCOAT_ERROR_INVALID_ARGUMENT, "world is NULL");
    /* A larger buffer is fine, at any address, and what lies behind the snapshot stays. */
    OK(isocoat_world_snapshot(one.world, room + 1, size + 7, &same));
    CHECK(same == size);
    CHECK(room[0] == 0xa5);
    for (i = size + 1; i < size + 8; ++i) CHECK(room[i] == 0xa5);
    REFUSED(isocoat_world_restore(one.world, room + 1, size + 7), ISOCOAT_ERROR_SNAPSHOT, "length");
    REFUSED(isocoat_world_restore(one.world, NULL, size), ISOCOAT_ERROR_INVALID_ARGUMENT, "buffer is NULL");
    REFUSED(isocoat_world_restore(NULL, room + 1, size), ISOCOAT_ERROR_INVALID_ARGUMENT, "world is NULL");
    REFUSED(isocoat_world_restore(one.world, NULL, 0), ISOCOAT_ERROR_SNAPSHOT, "its length is 0 bytes");
    OK(isocoat_world_restore(one.world, room + 1, size));
    free(room);
    isocoat_world_destroy(one.world);
}

static void damage_is_refused_and_changes_nothing(void)
{
    static record first[TICKS], second[TICKS];
    scene one = new_scene();
    size_t size = 0, again = 0, at;
    uint8_t *bytes, *after, *cut;
    run(one.world, one.hosted.link, one.falling.link, first);
    bytes = taken(one.world, &size);
    for (at = 0; at < size; ++at) {
        const uint8_t kept = bytes[at];
        bytes[at] = (uint8_t)(kept ^ 0x10);
        CHECK(isocoat_world_restore(one.world, bytes, size) == ISOCOAT_ERROR_SNAPSHOT);
        bytes[at] = kept;
    }
    REFUSED(isocoat_world_restore(one.world, bytes + 1, size - 1), ISOCOAT_ERROR_SNAPSHOT, "begins with");
    /* In memory of exactly that size, so that reading on is seen. */
    for (at = 0; at < size; at += at < 64 ? 1 : 97) {
        cut = (uint8_t *)malloc(at + 1);
        memcpy(cut + 1, bytes, at);
        CHECK(isocoat_world_restore(one.world, cut + 1, at) == ISOCOAT_ERROR_SNAPSHOT);
        free(cut);
    }
    after = taken(one.world, &again);
    CHECK(size == again && memcmp(bytes, after, size) == 0);
    free(after);
    run(one.world, one.hosted.link, one.falling.link, first);
    OK(isocoat_world_restore(one.world, bytes, size));
    run(one.world, one.hosted.link, one.falling.link, second);
    CHECK(memcmp(first, second, sizeof first) == 0);
    free(bytes);
    isocoat_world_destroy(one.world);
}

static void handles_come_back_and_never_mean_another(void)
{
    isocoat_world *world = new_world();
    const ball kept = new_ball(world, ISOCOAT_LINK_RIGID, 0.0);
    size_t size = 0;
    uint8_t *bytes = taken(world, &size);
    isocoat_body undone, again;
    bool enabled;
    OK(isocoat_body_destroy(world, kept.body));
    undone = new_body(world);
    OK(isocoat_world_restore(world, bytes, size));
    OK(isocoat_body_is_enabled(world, kept.body, &enabled));
    OK(isocoat_skeleton_is_enabled(world, kept.skeleton, &enabled));
    REFUSED(isocoat_body_is_enabled(world, undone, &enabled), ISOCOAT_ERROR_INVALID_HANDLE, "stale");
    OK(isocoat_body_destroy(world, kept.body));
    again = new_body(world);
    CHECK(again.index == undone.index && !same_body(again, undone));
    REFUSED(isocoat_body_is_enabled(world, undone, &enabled), ISOCOAT_ERROR_INVALID_HANDLE, "stale");
    free(bytes);
    isocoat_world_destroy(world);
}

int main(void)
{
    a_restored_world_goes_on_bit_for_bit();
    buffers();
    damage_is_refused_and_changes_nothing();
    handles_come_back_and_never_mean_another();
    return verdict("snapshot");
}
