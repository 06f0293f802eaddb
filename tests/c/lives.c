/* Lives of worlds, bodies, links and skeletons: handles, parents, lists, and what a bad handle or pointer gives. */
#include "check.h"

static void everything_is_destroyed_with_its_owner(void)
{
    isocoat_world *world = new_world();
    isocoat_counters counters = isocoat_counters_default();
    const ball first = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    const ball second = new_ball(world, ISOCOAT_LINK_POINT_MASS, 5.0);
    const isocoat_link extra = new_link(world, first.body, ISOCOAT_LINK_FIXED, 1.0);
    const isocoat_skeleton on_extra = new_point(world, extra);
    bool enabled = false;

    OK(isocoat_world_get_counters(world, &counters));
    CHECK(counters.bodies == 2 && counters.links == 3 && counters.skeletons == 3);
    CHECK(counters.struct_size == sizeof counters);

    OK(isocoat_link_destroy(world, extra));
    REFUSED(isocoat_skeleton_is_enabled(world, on_extra, &enabled), ISOCOAT_ERROR_INVALID_HANDLE, "stale");
    OK(isocoat_skeleton_is_enabled(world, first.skeleton, &enabled));

    OK(isocoat_body_destroy(world, first.body));
    REFUSED(isocoat_body_is_enabled(world, first.body, &enabled), ISOCOAT_ERROR_INVALID_HANDLE, "body: ");
    REFUSED(isocoat_link_is_enabled(world, first.link, &enabled), ISOCOAT_ERROR_INVALID_HANDLE, "link: ");
    REFUSED(isocoat_skeleton_is_enabled(world, first.skeleton, &enabled), ISOCOAT_ERROR_INVALID_HANDLE, "skeleton: ");
    OK(isocoat_skeleton_destroy(world, second.skeleton));
    REFUSED(isocoat_skeleton_destroy(world, second.skeleton), ISOCOAT_ERROR_INVALID_HANDLE, "stale");

    OK(isocoat_world_get_counters(world, &counters));
    CHECK(counters.bodies == 1 && counters.links == 1 && counters.skeletons == 0);
    CHECK(isocoat_world_destroy(world) == ISOCOAT_OK);
    CHECK(isocoat_world_destroy(NULL) == ISOCOAT_OK);
}

static void a_slot_is_used_again_but_its_old_handle_is_not(void)
{
    isocoat_world *world = new_world();
    const isocoat_body old = new_body(world);
    bool enabled;
    isocoat_body fresh;
    OK(isocoat_body_destroy(world, old));
    fresh = new_body(world);
    CHECK(fresh.index == old.index && fresh.generation != old.generation);
    OK(isocoat_body_is_enabled(world, fresh, &enabled));
    REFUSED(isocoat_body_is_enabled(world, old, &enabled), ISOCOAT_ERROR_INVALID_HANDLE, "stale");
    isocoat_world_destroy(world);
}

static void parents_and_lists(void)
{
    isocoat_world *world = new_world();
    const isocoat_body body = new_body(world);
    isocoat_link made[3], links[3], parent;
    isocoat_skeleton kept[2], skeletons[2];
    isocoat_body owner;
    size_t count = 99;
    int i;

    OK(isocoat_body_get_links(world, body, NULL, 0, &count));
    CHECK(count == 0);
    for (i = 0; i < 3; ++i) made[i] = new_link(world, body, ISOCOAT_LINK_FIXED, i);
    for (i = 0; i < 2; ++i) kept[i] = new_point(world, made[1]);

    OK(isocoat_body_get_links(world, body, NULL, 0, &count));
    CHECK(count == 3);
    memset(links, 0, sizeof links);
    count = 99;
    REFUSED(isocoat_body_get_links(world, body, links, 2, &count), ISOCOAT_ERROR_BUFFER_TOO_SMALL,
            "capacity is 2; 3 elements");
    CHECK(count == 3 && links[0].generation == 0);
    OK(isocoat_body_get_links(world, body, links, 3, &count));
    for (i = 0; i < 3; ++i) CHECK(same_link(links[i], made[i]));
    REFUSED(isocoat_body_get_links(world, body, NULL, 3, &count), ISOCOAT_ERROR_INVALID_ARGUMENT, "links is NULL");
    REFUSED(isocoat_body_get_links(world, body, links, 3, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "count is NULL");

    OK(isocoat_link_get_skeletons(world, made[0], NULL, 0, &count));
    CHECK(count == 0);
    REFUSED(isocoat_link_get_skeletons(world, made[1], skeletons, 1, &count), ISOCOAT_ERROR_BUFFER_TOO_SMALL,
            "capacity is 1; 2 elements");
    OK(isocoat_link_get_skeletons(world, made[1], skeletons, 2, &count));
    CHECK(count == 2 && same_skeleton(skeletons[0], kept[0]) && same_skeleton(skeletons[1], kept[1]));
    REFUSED(isocoat_link_get_skeletons(world, made[1], NULL, 1, &count), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "skeletons is NULL");

    OK(isocoat_link_get_body(world, made[2], &owner));
    CHECK(same_body(owner, body));
    OK(isocoat_skeleton_get_link(world, kept[1], &parent));
    CHECK(same_link(parent, made[1]));
    isocoat_world_destroy(world);
}

static void switches(void)
{
    isocoat_world *world = new_world();
    const ball b = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    bool enabled = false;
    OK(isocoat_body_is_enabled(world, b.body, &enabled));
    CHECK(enabled);
    OK(isocoat_body_set_enabled(world, b.body, false));
    OK(isocoat_body_is_enabled(world, b.body, &enabled));
    CHECK(!enabled);
    OK(isocoat_link_is_enabled(world, b.link, &enabled));
    CHECK(enabled);
    OK(isocoat_link_set_enabled(world, b.link, false));
    OK(isocoat_link_is_enabled(world, b.link, &enabled));
    CHECK(!enabled);
    OK(isocoat_skeleton_is_enabled(world, b.skeleton, &enabled));
    CHECK(enabled);
    OK(isocoat_skeleton_set_enabled(world, b.skeleton, false));
    OK(isocoat_skeleton_is_enabled(world, b.skeleton, &enabled));
    CHECK(!enabled);
    OK(isocoat_body_set_enabled(world, b.body, true));
    OK(isocoat_body_is_enabled(world, b.body, &enabled));
    CHECK(enabled);
    isocoat_world_destroy(world);
}

static void user_data_comes_back(void)
{
    isocoat_world *world = new_world();
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_skeleton_desc skeleton_desc = isocoat_skeleton_desc_default();
    isocoat_body body;
    isocoat_link link;
    isocoat_skeleton skeleton;
    int a, b, c;
    void *data = NULL;
    body_desc.user_data = &a;
    link_desc.user_data = &b;
    skeleton_desc.user_data = &c;
    OK(isocoat_body_create(world, &body_desc, &body));
    OK(isocoat_link_create(world, body, &link_desc, &link));
    OK(isocoat_skeleton_create(world, link, &skeleton_desc, &skeleton));
    OK(isocoat_body_get_user_data(world, body, &data));
    CHECK(data == &a);
    OK(isocoat_link_get_user_data(world, link, &data));
    CHECK(data == &b);
    OK(isocoat_skeleton_get_user_data(world, skeleton, &data));
    CHECK(data == &c);
    REFUSED(isocoat_body_get_user_data(world, body, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "user_data is NULL");
    REFUSED(isocoat_link_get_user_data(world, link, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "user_data is NULL");
    REFUSED(isocoat_skeleton_get_user_data(world, skeleton, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "user_data is NULL");
    isocoat_world_destroy(world);
}

/* Every call that takes a handle of the noun, on a handle that is bad for the reason given. */
static void bad_body(isocoat_world *world, isocoat_body body, const char *why)
{
    const isocoat_status bad = ISOCOAT_ERROR_INVALID_HANDLE;
    isocoat_body_desc desc = isocoat_body_desc_default();
    const isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_link link = {7, 7, 7};
    isocoat_surface_point closest;
    bool flag = true;
    void *data = &flag;
    size_t count = 99;
    VEC(point, 0, 0, 0);
    double value = 5.0;
    isocoat_contact contact;
    const isocoat_body good = new_body(world);

    REFUSED(isocoat_body_destroy(world, body), bad, why);
    REFUSED(isocoat_body_get_desc(world, body, &desc), bad, why);
    REFUSED(isocoat_body_set_desc(world, body, &desc), bad, why);
    REFUSED(isocoat_body_set_enabled(world, body, false), bad, why);
    REFUSED(isocoat_body_is_enabled(world, body, &flag), bad, why);
    REFUSED(isocoat_body_get_user_data(world, body, &data), bad, why);
    REFUSED(isocoat_body_get_links(world, body, NULL, 0, &count), bad, why);
    REFUSED(isocoat_link_create(world, body, &link_desc, &link), bad, why);
    REFUSED(isocoat_body_evaluate_field(world, body, point, 1, &value, NULL), bad, why);
    REFUSED(isocoat_body_closest_point(world, body, point, &closest, &flag), bad, why);
    REFUSED(isocoat_world_collide(world, body, good, ISOCOAT_SCHEME_AUTO, 1e-3, &contact, 1, &count), bad, why);
    REFUSED(isocoat_world_collide(world, good, body, ISOCOAT_SCHEME_AUTO, 1e-3, &contact, 1, &count), bad, why);
    /* Outputs are written on success only. */
    CHECK(link.index == 7 && flag && data == &flag && count == 99);
    CHECK_NEAR(value, 5.0, 0.0);
    OK(isocoat_body_destroy(world, good));
}

static void bad_link(isocoat_world *world, isocoat_link link, const char *why)
{
    const isocoat_status bad = ISOCOAT_ERROR_INVALID_HANDLE;
    const isocoat_buffer none = {NULL, 0, ISOCOAT_FORMAT_F64};
    isocoat_link_desc desc = isocoat_link_desc_default();
    const isocoat_skeleton_desc skeleton_desc = isocoat_skeleton_desc_default();
    isocoat_skeleton skeleton = {7, 7, 7};
    isocoat_body body = {7, 7, 7};
    isocoat_link_state state;
    isocoat_wrench wrench;
    bool flag = true;
    void *data = &flag;
    size_t count = 99;
    VEC(v, 1, 2, 3);
    memset(&state, 0, sizeof state);
    state.pose.orientation[3] = 1.0;
    memset(&wrench, 0, sizeof wrench);

    REFUSED(isocoat_link_destroy(world, link), bad, why);
    REFUSED(isocoat_link_get_desc(world, link, &desc), bad, why);
    REFUSED(isocoat_link_set_desc(world, link, &desc), bad, why);
    REFUSED(isocoat_link_set_enabled(world, link, false), bad, why);
    REFUSED(isocoat_link_is_enabled(world, link, &flag), bad, why);
    REFUSED(isocoat_link_get_user_data(world, link, &data), bad, why);
    REFUSED(isocoat_link_get_body(world, link, &body), bad, why);
    REFUSED(isocoat_link_get_skeletons(world, link, NULL, 0, &count), bad, why);
    REFUSED(isocoat_skeleton_create(world, link, &skeleton_desc, &skeleton), bad, why);
    REFUSED(isocoat_link_get_state(world, link, &state), bad, why);
    REFUSED(isocoat_link_set_state(world, link, &state), bad, why);
    REFUSED(isocoat_link_teleport(world, link, &state), bad, why);
    REFUSED(isocoat_link_get_wrench(world, link, &wrench), bad, why);
    REFUSED(isocoat_link_get_impulse(world, link, &wrench), bad, why);
    REFUSED(isocoat_link_apply_force(world, link, v, NULL), bad, why);
    REFUSED(isocoat_link_apply_torque(world, link, v), bad, why);
    REFUSED(isocoat_link_apply_impulse(world, link, v, v), bad, why);
    REFUSED(isocoat_link_apply_angular_impulse(world, link, v), bad, why);
    REFUSED(isocoat_link_set_external_acceleration(world, link, v, v), bad, why);
    REFUSED(isocoat_link_set_constrained(world, link, 1), bad, why);
    REFUSED(isocoat_world_set_link_states(world, &link, &state, 1), bad, "links[0]: link: ");
    REFUSED(isocoat_world_get_link_states(world, &link, 1, none, none), bad, why);
    REFUSED(isocoat_world_get_link_wrenches(world, &link, 1, none, none), bad, why);
    REFUSED(isocoat_world_get_link_impulses(world, &link, 1, none, none), bad, why);
    CHECK(skeleton.index == 7 && body.index == 7 && flag && data == &flag && count == 99);
}

static void bad_skeleton(isocoat_world *world, isocoat_skeleton skeleton, const char *why)
{
    const isocoat_status bad = ISOCOAT_ERROR_INVALID_HANDLE;
    const isocoat_buffer none = {NULL, 0, ISOCOAT_FORMAT_F64};
    isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
    isocoat_link link = {7, 7, 7};
    bool flag = true;
    void *data = &flag;
    size_t count = 99;

    REFUSED(isocoat_skeleton_destroy(world, skeleton), bad, why);
    REFUSED(isocoat_skeleton_get_desc(world, skeleton, &desc), bad, why);
    REFUSED(isocoat_skeleton_set_desc(world, skeleton, &desc), bad, why);
    REFUSED(isocoat_skeleton_set_enabled(world, skeleton, false), bad, why);
    REFUSED(isocoat_skeleton_is_enabled(world, skeleton, &flag), bad, why);
    REFUSED(isocoat_skeleton_get_user_data(world, skeleton, &data), bad, why);
    REFUSED(isocoat_skeleton_get_link(world, skeleton, &link), bad, why);
    REFUSED(isocoat_skeleton_get_seeds(world, skeleton, none, none, NULL, 0, &count), bad, why);
    CHECK(link.index == 7 && flag && data == &flag && count == 99);
}

static void bad_handles_are_refused_everywhere(void)
{
    isocoat_world *world = new_world(), *other = new_world();
    const ball foreign = new_ball(other, ISOCOAT_LINK_RIGID, 0.0);
    const ball stale = new_ball(world, ISOCOAT_LINK_RIGID, 0.0);
    const isocoat_body null_body = {0, 0, 0};
    const isocoat_link null_link = {0, 0, 0};
    const isocoat_skeleton null_skeleton = {0, 0, 0};
    ball made_up = stale;
    made_up.body.index = made_up.link.index = made_up.skeleton.index = 4000000000u;
    OK(isocoat_body_destroy(world, stale.body));

    bad_body(world, null_body, "null");
    bad_body(world, stale.body, "stale");
    bad_body(world, foreign.body, "another world");
    bad_body(world, made_up.body, "never given out");
    bad_link(world, null_link, "null");
    bad_link(world, stale.link, "stale");
    bad_link(world, foreign.link, "another world");
    bad_link(world, made_up.link, "never given out");
    bad_skeleton(world, null_skeleton, "null");
    bad_skeleton(world, stale.skeleton, "stale");
    bad_skeleton(world, foreign.skeleton, "another world");
    bad_skeleton(world, made_up.skeleton, "never given out");
    isocoat_world_destroy(world);
    isocoat_world_destroy(other);
}

static void a_null_pointer_is_refused_by_name(void)
{
    const isocoat_status bad = ISOCOAT_ERROR_INVALID_ARGUMENT;
    isocoat_world *world = new_world();
    const ball b = new_ball(world, ISOCOAT_LINK_RIGID, 0.0);
    const isocoat_world_desc world_desc = isocoat_world_desc_default();
    const isocoat_body_desc body_desc = isocoat_body_desc_default();
    const isocoat_link_desc link_desc = isocoat_link_desc_default();
    const isocoat_skeleton_desc skeleton_desc = isocoat_skeleton_desc_default();
    isocoat_body body;
    isocoat_link link;
    isocoat_skeleton skeleton;
    bool flag;
    VEC(v, 0, 0, 1);

    REFUSED(isocoat_world_create(NULL, &world), bad, "desc is NULL");
    REFUSED(isocoat_world_create(&world_desc, NULL), bad, "world is NULL");
    REFUSED(isocoat_world_step(NULL, 0.01), bad, "world is NULL");
    REFUSED(isocoat_world_get_desc(NULL, NULL), bad, "world is NULL");
    REFUSED(isocoat_world_get_desc(world, NULL), bad, "desc is NULL");
    REFUSED(isocoat_world_set_desc(world, NULL), bad, "desc is NULL");
    REFUSED(isocoat_world_set_log(NULL, NULL, NULL), bad, "world is NULL");
    REFUSED(isocoat_world_set_pair_filter(NULL, NULL, NULL), bad, "world is NULL");
    REFUSED(isocoat_world_get_counters(world, NULL), bad, "counters is NULL");
    REFUSED(isocoat_body_create(NULL, &body_desc, &body), bad, "world is NULL");
    REFUSED(isocoat_body_create(world, NULL, &body), bad, "desc is NULL");
    REFUSED(isocoat_body_create(world, &body_desc, NULL), bad, "body is NULL");
    REFUSED(isocoat_body_get_desc(world, b.body, NULL), bad, "desc is NULL");
    REFUSED(isocoat_body_set_desc(world, b.body, NULL), bad, "desc is NULL");
    REFUSED(isocoat_body_is_enabled(world, b.body, NULL), bad, "enabled is NULL");
    REFUSED(isocoat_body_is_enabled(NULL, b.body, &flag), bad, "world is NULL");
    REFUSED(isocoat_link_create(world, b.body, NULL, &link), bad, "desc is NULL");
    REFUSED(isocoat_link_create(world, b.body, &link_desc, NULL), bad, "link is NULL");
    REFUSED(isocoat_link_get_desc(world, b.link, NULL), bad, "desc is NULL");
    REFUSED(isocoat_link_set_desc(world, b.link, NULL), bad, "desc is NULL");
    REFUSED(isocoat_link_is_enabled(world, b.link, NULL), bad, "enabled is NULL");
    REFUSED(isocoat_link_get_body(world, b.link, NULL), bad, "body is NULL");
    REFUSED(isocoat_link_get_state(world, b.link, NULL), bad, "state is NULL");
    REFUSED(isocoat_link_set_state(world, b.link, NULL), bad, "state is NULL");
    REFUSED(isocoat_link_teleport(world, b.link, NULL), bad, "state is NULL");
    REFUSED(isocoat_link_get_wrench(world, b.link, NULL), bad, "wrench is NULL");
    REFUSED(isocoat_link_get_impulse(world, b.link, NULL), bad, "impulse is NULL");
    REFUSED(isocoat_link_apply_force(world, b.link, NULL, v), bad, "force is NULL");
    REFUSED(isocoat_link_apply_torque(world, b.link, NULL), bad, "torque is NULL");
    REFUSED(isocoat_link_apply_impulse(world, b.link, NULL, NULL), bad, "impulse is NULL");
    REFUSED(isocoat_link_apply_angular_impulse(world, b.link, NULL), bad, "impulse is NULL");
    REFUSED(isocoat_link_set_external_acceleration(world, b.link, NULL, v), bad, "linear is NULL");
    REFUSED(isocoat_link_set_external_acceleration(world, b.link, v, NULL), bad, "angular is NULL");
    REFUSED(isocoat_skeleton_create(world, b.link, NULL, &skeleton), bad, "desc is NULL");
    REFUSED(isocoat_skeleton_create(world, b.link, &skeleton_desc, NULL), bad, "skeleton is NULL");
    REFUSED(isocoat_skeleton_get_desc(world, b.skeleton, NULL), bad, "desc is NULL");
    REFUSED(isocoat_skeleton_set_desc(world, b.skeleton, NULL), bad, "desc is NULL");
    REFUSED(isocoat_skeleton_is_enabled(world, b.skeleton, NULL), bad, "enabled is NULL");
    REFUSED(isocoat_skeleton_get_link(world, b.skeleton, NULL), bad, "link is NULL");
    isocoat_world_destroy(world);
}

int main(void)
{
    everything_is_destroyed_with_its_owner();
    a_slot_is_used_again_but_its_old_handle_is_not();
    parents_and_lists();
    switches();
    user_data_comes_back();
    bad_handles_are_refused_everywhere();
    a_null_pointer_is_refused_by_name();
    return verdict("lives");
}
