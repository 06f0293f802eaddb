/* What a step reports and calls: contacts, events, counters, log, pair filter; and who is locked out meanwhile. */
#include "check.h"

static isocoat_world *falling_world(ball *ground, ball *falling)
{
    isocoat_world_desc desc = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    desc.gravity[2] = -9.8;
    OK(isocoat_world_create(&desc, &world));
    *ground = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    *falling = new_ball(world, ISOCOAT_LINK_POINT_MASS, 0.25);
    return world;
}

static void a_bounce_begins_and_ends(void)
{
    ball ground, falling;
    isocoat_world *world = falling_world(&ground, &falling);
    const isocoat_contact *contacts = NULL;
    const isocoat_event *events = NULL;
    isocoat_counters counters = isocoat_counters_default();
    size_t count = 99;
    int tick, began = 0, ended = 0, touched = 0;

    OK(isocoat_world_get_contacts(world, &contacts, &count));
    CHECK(count == 0);
    OK(isocoat_world_get_events(world, &events, &count));
    CHECK(count == 0);
    REFUSED(isocoat_world_get_contacts(world, NULL, &count), ISOCOAT_ERROR_INVALID_ARGUMENT, "contacts is NULL");
    REFUSED(isocoat_world_get_contacts(world, &contacts, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "count is NULL");
    REFUSED(isocoat_world_get_events(world, NULL, &count), ISOCOAT_ERROR_INVALID_ARGUMENT, "events is NULL");
    REFUSED(isocoat_world_get_events(world, &events, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "count is NULL");
    REFUSED(isocoat_world_get_contacts(NULL, &contacts, &count), ISOCOAT_ERROR_INVALID_ARGUMENT, "world is NULL");

    for (tick = 0; tick < 120 && ended == 0; ++tick) {
        size_t i;
        OK(isocoat_world_step(world, 1.0 / 120.0));
        OK(isocoat_world_get_events(world, &events, &count));
        for (i = 0; i < count; ++i) {
            CHECK((same_body(events[i].body_a, ground.body) && same_body(events[i].body_b, falling.body)) ||
                  (same_body(events[i].body_b, ground.body) && same_body(events[i].body_a, falling.body)));
            CHECK(events[i].reserved == 0);
            began += events[i].kind == ISOCOAT_EVENT_BEGIN;
            ended += events[i].kind == ISOCOAT_EVENT_END;
        }
        OK(isocoat_world_get_contacts(world, &contacts, &count));
        OK(isocoat_world_get_counters(world, &counters));
        CHECK(counters.patches == count);
        if (count > 0) {
            const isocoat_contact *c = &contacts[0];
            const double up = same_body(c->body_a, ground.body) ? 1.0 : -1.0;
            ++touched;
            CHECK(count == 1 && c->reserved == 0);
            CHECK_NEAR(c->normal[2], up, 1e-9);
            CHECK(up * c->force[2] > 0.0);
            CHECK(c->area > 0.0 && c->peak_pressure > 0.0 && c->stiffness > 0.0 && c->evaluations + 1 > 0);
            CHECK(same_link(up > 0 ? c->link_b : c->link_a, falling.link));
            CHECK(same_skeleton(up > 0 ? c->skeleton_a : c->skeleton_b, ground.skeleton));
            CHECK(c->position[2] > 0.0 && c->position[2] < 0.2);
            CHECK(counters.pairs == 1 && counters.islands >= 1 && counters.substeps >= 1);
        }
        /* A refused call leaves the views as they are. */
        REFUSED(isocoat_world_step(world, -1.0), ISOCOAT_ERROR_OUT_OF_RANGE, "dt");
        {
            const isocoat_contact *again = NULL;
            size_t same = 99;
            OK(isocoat_world_get_contacts(world, &again, &same));
            CHECK(again == contacts && same == count);
        }
    }
    CHECK(began == 1 && ended == 1 && touched >= 1);
    isocoat_world_destroy(world);
}

typedef struct filter_calls {
    isocoat_world *world;
    ball ground, falling;
    int calls;
    bool answer;
} filter_calls;

/* Calls everything there is from inside a step. */
static void everything_is_locked(filter_calls *all)
{
    const isocoat_status locked = ISOCOAT_ERROR_LOCKED;
    const char *const why = "being stepped or changed";
    isocoat_world *world = all->world;
    const isocoat_buffer skip = {NULL, 0, ISOCOAT_FORMAT_F64};
    isocoat_world_desc world_desc = isocoat_world_desc_default();
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_skeleton_desc skeleton_desc = isocoat_skeleton_desc_default();
    isocoat_counters counters = isocoat_counters_default();
    isocoat_times times = isocoat_times_default();
    isocoat_debug_draw draw = isocoat_debug_draw_default();
    const isocoat_contact *contacts;
    const isocoat_event *events;
    isocoat_contact contact;
    isocoat_link_state state;
    isocoat_wrench wrench;
    isocoat_ray_hit hit;
    isocoat_surface_point closest;
    ball b = all->falling;
    size_t count;
    bool flag;
    void *data;
    double value;
    VEC(v, 0, 0, 1);
    memset(&state, 0, sizeof state);
    state.pose.orientation[3] = 1.0;

    REFUSED(isocoat_world_destroy(world), locked, why);
    REFUSED(isocoat_world_step(world, 0.01), locked, why);
    REFUSED(isocoat_world_get_desc(world, &world_desc), locked, why);
    REFUSED(isocoat_world_set_desc(world, &world_desc), locked, why);
    REFUSED(isocoat_world_set_log(world, NULL, NULL), locked, why);
    REFUSED(isocoat_world_set_pair_filter(world, NULL, NULL), locked, why);
    REFUSED(isocoat_world_get_contacts(world, &contacts, &count), locked, why);
    REFUSED(isocoat_world_get_events(world, &events, &count), locked, why);
    REFUSED(isocoat_world_get_counters(world, &counters), locked, why);
    REFUSED(isocoat_world_get_times(world, &times), locked, why);
    REFUSED(isocoat_world_set_tasks(world, 1, NULL, NULL, NULL), locked, why);
    REFUSED(isocoat_world_get_bodies(world, &b.body, 1, &count), locked, why);
    REFUSED(isocoat_world_snapshot(world, NULL, 0, &count), locked, why);
    REFUSED(isocoat_world_restore(world, NULL, 0), locked, why);
    REFUSED(isocoat_world_set_link_states(world, &b.link, &state, 1), locked, why);
    REFUSED(isocoat_world_get_link_states(world, &b.link, 1, skip, skip), locked, why);
    REFUSED(isocoat_world_get_link_wrenches(world, &b.link, 1, skip, skip), locked, why);
    REFUSED(isocoat_world_get_link_impulses(world, &b.link, 1, skip, skip), locked, why);
    REFUSED(isocoat_world_collide(world, b.body, all->ground.body, 0, 1e-3, &contact, 1, &count), locked, why);
    REFUSED(isocoat_world_cast_ray(world, v, v, 1.0, 1, &hit, &flag), locked, why);
    REFUSED(isocoat_world_overlap_sphere(world, v, 1.0, 1, NULL, 0, &count), locked, why);
    REFUSED(isocoat_world_debug_draw(world, &draw), locked, why);
    REFUSED(isocoat_body_create(world, &body_desc, &b.body), locked, why);
    REFUSED(isocoat_body_destroy(world, b.body), locked, why);
    REFUSED(isocoat_body_get_desc(world, b.body, &body_desc), locked, why);
    REFUSED(isocoat_body_set_desc(world, b.body, &body_desc), locked, why);
    REFUSED(isocoat_body_set_enabled(world, b.body, true), locked, why);
    REFUSED(isocoat_body_is_enabled(world, b.body, &flag), locked, why);
    REFUSED(isocoat_body_is_awake(world, b.body, &flag), locked, why);
    REFUSED(isocoat_body_wake(world, b.body), locked, why);
    REFUSED(isocoat_body_get_user_data(world, b.body, &data), locked, why);
    REFUSED(isocoat_body_get_links(world, b.body, NULL, 0, &count), locked, why);
    REFUSED(isocoat_body_evaluate_field(world, b.body, v, 1, &value, NULL), locked, why);
    REFUSED(isocoat_body_closest_point(world, b.body, v, &closest, &flag), locked, why);
    REFUSED(isocoat_link_create(world, b.body, &link_desc, &b.link), locked, why);
    REFUSED(isocoat_link_destroy(world, b.link), locked, why);
    REFUSED(isocoat_link_get_desc(world, b.link, &link_desc), locked, why);
    REFUSED(isocoat_link_set_desc(world, b.link, &link_desc), locked, why);
    REFUSED(isocoat_link_set_enabled(world, b.link, true), locked, why);
    REFUSED(isocoat_link_is_enabled(world, b.link, &flag), locked, why);
    REFUSED(isocoat_link_get_user_data(world, b.link, &data), locked, why);
    REFUSED(isocoat_link_get_body(world, b.link, &b.body), locked, why);
    REFUSED(isocoat_link_get_skeletons(world, b.link, NULL, 0, &count), locked, why);
    REFUSED(isocoat_link_get_state(world, b.link, &state), locked, why);
    REFUSED(isocoat_link_set_state(world, b.link, &state), locked, why);
    REFUSED(isocoat_link_teleport(world, b.link, &state), locked, why);
    REFUSED(isocoat_link_get_wrench(world, b.link, &wrench), locked, why);
    REFUSED(isocoat_link_get_impulse(world, b.link, &wrench), locked, why);
    REFUSED(isocoat_link_apply_force(world, b.link, v, NULL), locked, why);
    REFUSED(isocoat_link_apply_torque(world, b.link, v), locked, why);
    REFUSED(isocoat_link_apply_impulse(world, b.link, v, NULL), locked, why);
    REFUSED(isocoat_link_apply_angular_impulse(world, b.link, v), locked, why);
    REFUSED(isocoat_link_set_external_acceleration(world, b.link, v, v), locked, why);
    REFUSED(isocoat_link_set_constrained(world, b.link, 1), locked, why);
    REFUSED(isocoat_skeleton_create(world, b.link, &skeleton_desc, &b.skeleton), locked, why);
    REFUSED(isocoat_skeleton_destroy(world, b.skeleton), locked, why);
    REFUSED(isocoat_skeleton_get_desc(world, b.skeleton, &skeleton_desc), locked, why);
    REFUSED(isocoat_skeleton_set_desc(world, b.skeleton, &skeleton_desc), locked, why);
    REFUSED(isocoat_skeleton_set_enabled(world, b.skeleton, true), locked, why);
    REFUSED(isocoat_skeleton_is_enabled(world, b.skeleton, &flag), locked, why);
    REFUSED(isocoat_skeleton_get_user_data(world, b.skeleton, &data), locked, why);
    REFUSED(isocoat_skeleton_get_link(world, b.skeleton, &b.link), locked, why);
    REFUSED(isocoat_skeleton_get_seeds(world, b.skeleton, skip, skip, NULL, 0, &count), locked, why);
}

static bool filter(void *context, isocoat_body a, isocoat_body b)
{
    filter_calls *all = (filter_calls *)context;
    isocoat_world *other;
    if (all->calls++ == 0) everything_is_locked(all);
    CHECK((same_body(a, all->ground.body) && same_body(b, all->falling.body)) ||
          (same_body(b, all->ground.body) && same_body(a, all->falling.body)));
    /* Other worlds have nothing to do with it. */
    other = new_world();
    OK(isocoat_world_step(other, 0.01));
    isocoat_world_destroy(other);
    return all->answer;
}

static double height_after(filter_calls *all, int ticks)
{
    isocoat_link_state state;
    int tick;
    for (tick = 0; tick < ticks; ++tick) OK(isocoat_world_step(all->world, 1.0 / 120.0));
    OK(isocoat_link_get_state(all->world, all->falling.link, &state));
    return state.pose.position[2];
}

static void a_pair_filter_decides_and_sees_the_world_locked(void)
{
    filter_calls all;
    memset(&all, 0, sizeof all);
    all.world = falling_world(&all.ground, &all.falling);
    OK(isocoat_world_set_pair_filter(all.world, filter, &all));
    /* Half a second of free fall from 0.25 m, through the ground. */
    CHECK_NEAR(height_after(&all, 60), 0.25 - 0.5 * 9.8 * 0.25, 0.05);
    CHECK(all.calls > 0);
    isocoat_world_destroy(all.world);

    memset(&all, 0, sizeof all);
    all.world = falling_world(&all.ground, &all.falling);
    all.answer = true;
    OK(isocoat_world_set_pair_filter(all.world, filter, &all));
    CHECK(height_after(&all, 60) > 0.1);
    CHECK(all.calls > 0);
    all.calls = 0;
    OK(isocoat_world_set_pair_filter(all.world, NULL, NULL));
    CHECK(height_after(&all, 60) > 0.1);
    CHECK(all.calls == 0);
    isocoat_world_destroy(all.world);
}

typedef struct log_calls {
    isocoat_world *world;
    int calls;
    isocoat_log_level level;
    char text[512];
} log_calls;

static void log_message(void *context, isocoat_log_level level, const char *text)
{
    log_calls *all = (log_calls *)context;
    REFUSED(isocoat_world_step(all->world, 0.01), ISOCOAT_ERROR_LOCKED, "not even from its callbacks");
    ++all->calls;
    all->level = level;
    strncpy(all->text, text, sizeof all->text - 1);
}

static void a_log_hears_of_a_scene_that_cannot_work(void)
{
    ball ground, falling;
    log_calls all;
    isocoat_body_desc soft = isocoat_body_desc_default();
    memset(&all, 0, sizeof all);
    all.world = falling_world(&ground, &falling);
    soft.stiffness_scale = 1e-3;
    OK(isocoat_body_set_desc(all.world, falling.body, &soft));
    OK(isocoat_world_set_log(all.world, log_message, &all));
    OK(isocoat_world_step(all.world, 0.01));
    CHECK(all.calls == 1 && all.level == ISOCOAT_LOG_WARNING);
    CHECK(strstr(all.text, "stiffness_scale") != NULL);
    OK(isocoat_world_set_log(all.world, NULL, NULL));
    OK(isocoat_body_set_desc(all.world, falling.body, &soft));
    OK(isocoat_world_step(all.world, 0.01));
    CHECK(all.calls == 1);
    isocoat_world_destroy(all.world);
}

static void masks_and_switches_part_bodies(void)
{
    filter_calls all;
    isocoat_body_desc desc = isocoat_body_desc_default();
    memset(&all, 0, sizeof all);
    all.world = falling_world(&all.ground, &all.falling);
    desc.category = 2;
    desc.mask = 2;
    OK(isocoat_body_set_desc(all.world, all.falling.body, &desc));
    CHECK_NEAR(height_after(&all, 60), 0.25 - 0.5 * 9.8 * 0.25, 0.05);
    isocoat_world_destroy(all.world);

    all.world = falling_world(&all.ground, &all.falling);
    OK(isocoat_body_set_enabled(all.world, all.ground.body, false));
    CHECK_NEAR(height_after(&all, 60), 0.25 - 0.5 * 9.8 * 0.25, 0.05);
    isocoat_world_destroy(all.world);
}

int main(void)
{
    a_bounce_begins_and_ends();
    a_pair_filter_decides_and_sees_the_world_locked();
    a_log_hears_of_a_scene_that_cannot_work();
    masks_and_switches_part_bodies();
    return verdict("steps");
}
