/* Sleep, counts by scheme, and times. */
#include "check.h"

static bool is_awake(isocoat_world *world, isocoat_body body)
{
    bool awake = false;
    OK(isocoat_body_is_awake(world, body, &awake));
    return awake;
}

/* A ball on another that is fixed; asleep. */
static isocoat_world *sleeping_world(ball *ground, ball *resting)
{
    isocoat_world_desc desc = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    int tick;
    CHECK(desc.sleep_time == 0.0 && desc.sleep_speed == 0.01 && desc.timed == 0);
    desc.gravity[2] = -9.8;
    desc.response = ISOCOAT_RESPONSE_IMPLICIT;
    desc.sleep_time = 0.5;
    desc.timed = 1;
    OK(isocoat_world_create(&desc, &world));
    *ground = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    *resting = new_ball(world, ISOCOAT_LINK_RIGID, 0.19);
    for (tick = 0; tick < 240 && is_awake(world, resting->body); ++tick) OK(isocoat_world_step(world, 1.0 / 60.0));
    return world;
}

static void one_at_rest_falls_asleep_and_wakes(void)
{
    ball ground, resting;
    isocoat_world *world = sleeping_world(&ground, &resting);
    isocoat_counters counters = isocoat_counters_default();
    isocoat_body_desc desc = isocoat_body_desc_default();
    const isocoat_contact *contacts = NULL;
    isocoat_wrench wrench;
    size_t count = 0;
    bool awake;

    CHECK(!is_awake(world, resting.body) && is_awake(world, ground.body));
    OK(isocoat_world_step(world, 1.0 / 60.0));
    OK(isocoat_world_get_counters(world, &counters));
    CHECK(counters.asleep == 1 && counters.pairs == 0 && counters.evaluations == 0 && counters.patches == 1);
    OK(isocoat_world_get_contacts(world, &contacts, &count));
    CHECK(count == 1);
    OK(isocoat_link_get_wrench(world, resting.link, &wrench));
    CHECK_NEAR(fabs(contacts[0].force[2]), 9.8, 1e-3);
    CHECK_NEAR(wrench.force[2], 9.8, 1e-3);

    OK(isocoat_body_wake(world, ground.body));
    CHECK(is_awake(world, resting.body));
    OK(isocoat_world_step(world, 1.0 / 60.0));
    OK(isocoat_world_get_counters(world, &counters));
    CHECK(counters.asleep == 0 && counters.pairs == 1);

    REFUSED(isocoat_body_is_awake(world, resting.body, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "awake is NULL");
    REFUSED(isocoat_body_is_awake(NULL, resting.body, &awake), ISOCOAT_ERROR_INVALID_ARGUMENT, "world is NULL");
    OK(isocoat_body_destroy(world, resting.body));
    REFUSED(isocoat_body_is_awake(world, resting.body, &awake), ISOCOAT_ERROR_INVALID_HANDLE, "");
    REFUSED(isocoat_body_wake(world, resting.body), ISOCOAT_ERROR_INVALID_HANDLE, "");

    CHECK(desc.may_sleep == 1);
    desc.may_sleep = 2;
    REFUSED(isocoat_body_set_desc(world, ground.body, &desc), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "may_sleep is 2; must be 0 or 1");
    desc.may_sleep = 0;
    OK(isocoat_body_set_desc(world, ground.body, &desc));
    OK(isocoat_body_get_desc(world, ground.body, &desc));
    CHECK(desc.may_sleep == 0);
    desc.reserved = 1;
    REFUSED(isocoat_body_set_desc(world, ground.body, &desc), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "reserved is 1; must be 0");
    isocoat_world_destroy(world);
}

static void settings_have_ranges(void)
{
    isocoat_world *world = new_world();
    isocoat_world_desc desc = isocoat_world_desc_default();
    desc.sleep_time = -1.0;
    REFUSED(isocoat_world_set_desc(world, &desc), ISOCOAT_ERROR_OUT_OF_RANGE, "sleep_time is -1; must be");
    desc.sleep_time = 0.25;
    desc.sleep_speed = 2e6;
    REFUSED(isocoat_world_set_desc(world, &desc), ISOCOAT_ERROR_OUT_OF_RANGE, "sleep_speed is 2000000; must be");
    desc.sleep_speed = 0.5;
    desc.timed = 7;
    REFUSED(isocoat_world_set_desc(world, &desc), ISOCOAT_ERROR_INVALID_ARGUMENT, "timed is 7; must be 0 or 1");
    desc.timed = 1;
    desc.reserved = 3;
    REFUSED(isocoat_world_set_desc(world, &desc), ISOCOAT_ERROR_INVALID_ARGUMENT, "reserved is 3; must be 0");
    desc.reserved = 0;
    OK(isocoat_world_set_desc(world, &desc));
    OK(isocoat_world_get_desc(world, &desc));
    CHECK(desc.sleep_time == 0.25 && desc.sleep_speed == 0.5 && desc.timed == 1);
    isocoat_world_destroy(world);
}

static void counts_and_times_of_a_step(void)
{
    ball ground, resting;
    isocoat_world *world = sleeping_world(&ground, &resting);
    isocoat_counters counters = isocoat_counters_default();
    isocoat_times times = isocoat_times_default();
    isocoat_world_desc desc = isocoat_world_desc_default();
    uint64_t sum = 0;
    size_t i;

    OK(isocoat_world_get_desc(world, &desc));
    desc.scheme = ISOCOAT_SCHEME_POLAR;
    OK(isocoat_world_set_desc(world, &desc));
    OK(isocoat_world_step(world, 1.0 / 60.0));
    OK(isocoat_world_get_counters(world, &counters));
    for (i = 0; i < 8; ++i) sum += counters.evaluations_by_scheme[i];
    CHECK(sum == counters.evaluations && sum > 0);
    CHECK(counters.evaluations_by_scheme[ISOCOAT_SCHEME_POLAR] > 0);
    CHECK(counters.patches_by_scheme[ISOCOAT_SCHEME_POLAR] == counters.implicit_rounds);
    CHECK(counters.patches_by_scheme[ISOCOAT_SCHEME_CLOSED_FORM] == 0);

    OK(isocoat_world_get_times(world, &times));
    CHECK(times.contact > 0.0 && times.solve > 0.0 && times.contact + times.solve <= times.respond);
    CHECK(times.begin + times.pairs + times.islands + times.respond + times.report <= times.step);
    desc.timed = 0;
    OK(isocoat_world_set_desc(world, &desc));
    OK(isocoat_world_step(world, 1.0 / 60.0));
    OK(isocoat_world_get_times(world, &times));
    CHECK(times.step == 0.0 && times.contact == 0.0);
    REFUSED(isocoat_world_get_times(world, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "times is NULL");
    times.struct_size = 8;
    REFUSED(isocoat_world_get_times(world, &times), ISOCOAT_ERROR_INVALID_ARGUMENT, "struct_size of isocoat_times is 8");
    REFUSED(isocoat_times_init(NULL, sizeof times), ISOCOAT_ERROR_INVALID_ARGUMENT, "times is NULL");
    isocoat_world_destroy(world);
}

int main(void)
{
    one_at_rest_falls_asleep_and_wakes();
    settings_have_ranges();
    counts_and_times_of_a_step();
    return verdict("sleep");
}
