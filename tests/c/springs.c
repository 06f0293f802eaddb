/* Springs: life, bulk creation, states, what is refused, and a mass that hangs. */
#include "check.h"

static isocoat_spring_desc between(isocoat_link a, isocoat_link b, double rest_length)
{
    isocoat_spring_desc desc = isocoat_spring_desc_default();
    desc.links[0] = a;
    desc.links[1] = b;
    desc.rest_length = rest_length;
    desc.stiffness = 1000.0;
    return desc;
}

static bool same_spring(isocoat_spring a, isocoat_spring b)
{
    return a.index == b.index && a.generation == b.generation && a.world == b.world;
}

static void the_defaults_are_those_of_the_manual(void)
{
    const isocoat_spring_desc desc = isocoat_spring_desc_default();
    CHECK(desc.struct_size == sizeof desc && desc.links[0].generation == 0 && desc.user_data == NULL);
    CHECK_NEAR(desc.rest_length + desc.stiffness + desc.damping + desc.points[1][2], 0.0, 0.0);
}

static void lives_and_lists(void)
{
    isocoat_world *world = new_world();
    const isocoat_body body = new_body(world);
    const isocoat_link a = new_link(world, body, ISOCOAT_LINK_FIXED, 0.0);
    const isocoat_link b = new_link(world, body, ISOCOAT_LINK_POINT_MASS, 1.5);
    const isocoat_link c = new_link(world, body, ISOCOAT_LINK_RIGID, 3.0);
    isocoat_spring_desc desc = between(a, b, 1.0), back = isocoat_spring_desc_default(), row[3];
    isocoat_spring spring, made[3], listed[4];
    isocoat_spring_state state;
    void *data = NULL;
    size_t count = 99;
    int i;

    desc.user_data = &count;
    OK(isocoat_spring_create(world, &desc, &spring));
    OK(isocoat_spring_get_state(world, spring, &state));
    CHECK_NEAR(state.length, 1.5, 1e-15);
    CHECK_NEAR(state.tension, 500.0, 1e-12);
    CHECK_NEAR(state.energy, 125.0, 1e-12);
    CHECK_NEAR(state.rate, 0.0, 0.0);
    OK(isocoat_spring_get_user_data(world, spring, &data));
    CHECK(data == &count);
    OK(isocoat_spring_get_desc(world, spring, &back));
    CHECK(same_link(back.links[1], b) && back.struct_size == sizeof back);
    CHECK_NEAR(back.stiffness, 1000.0, 0.0);
    back.stiffness = 500.0;
    OK(isocoat_spring_set_desc(world, spring, &back));
    OK(isocoat_spring_get_state(world, spring, &state));
    CHECK_NEAR(state.tension, 250.0, 1e-12);

    for (i = 0; i < 3; ++i) row[i] = between(b, c, 0.5 * i);
    row[2].points[1][0] = 0.1;
    OK(isocoat_spring_create_many(world, row, 3, made));
    OK(isocoat_spring_create_many(world, NULL, 0, NULL));
    OK(isocoat_body_get_springs(world, body, NULL, 0, &count));
    CHECK(count == 4);
    REFUSED(isocoat_body_get_springs(world, body, listed, 2, &count), ISOCOAT_ERROR_BUFFER_TOO_SMALL,
            "capacity is 2; 4 elements");
    OK(isocoat_body_get_springs(world, body, listed, 4, &count));
    CHECK(same_spring(listed[0], spring) && same_spring(listed[3], made[2]));
    OK(isocoat_spring_destroy(world, made[1]));
    REFUSED(isocoat_spring_destroy(world, made[1]), ISOCOAT_ERROR_INVALID_HANDLE, "spring: the handle is stale");
    OK(isocoat_link_destroy(world, c));
    OK(isocoat_body_get_springs(world, body, NULL, 0, &count));
    CHECK(count == 1);
    REFUSED(isocoat_spring_get_state(world, made[0], &state), ISOCOAT_ERROR_INVALID_HANDLE, "stale");
    isocoat_world_destroy(world);
}

static void what_cannot_be_is_refused(void)
{
    isocoat_world *world = new_world();
    const isocoat_body body = new_body(world);
    const isocoat_link a = new_link(world, body, ISOCOAT_LINK_FIXED, 0.0);
    const isocoat_link b = new_link(world, body, ISOCOAT_LINK_POINT_MASS, 1.0);
    const isocoat_link other = new_link(world, new_body(world), ISOCOAT_LINK_POINT_MASS, 1.0);
    const isocoat_spring_desc good = between(a, b, 1.0);
    isocoat_spring_desc desc, row[3];
    isocoat_spring spring = {7, 7, 7}, many[3];
    isocoat_spring_state state;
    void *data = NULL;
    size_t count = 99;

    desc = good, desc.rest_length = -1.0;
    REFUSED(isocoat_spring_create(world, &desc, &spring), ISOCOAT_ERROR_OUT_OF_RANGE,
            "rest_length is -1; must be from 0 to 1e9");
    desc = good, desc.stiffness = NAN;
    REFUSED(isocoat_spring_create(world, &desc, &spring), ISOCOAT_ERROR_OUT_OF_RANGE, "stiffness of a spring is NaN");
    desc = good, desc.links[1] = other;
    REFUSED(isocoat_spring_create(world, &desc, &spring), ISOCOAT_ERROR_UNSUPPORTED, "links of one body");
    desc = good, desc.links[1] = a;
    REFUSED(isocoat_spring_create(world, &desc, &spring), ISOCOAT_ERROR_UNSUPPORTED, "not one with itself");
    desc = good, desc.points[1][1] = 0.5;
    REFUSED(isocoat_spring_create(world, &desc, &spring), ISOCOAT_ERROR_OUT_OF_RANGE,
            "point of a spring on a point mass is (0, 0.5, 0)");
    desc = isocoat_spring_desc_default();
    REFUSED(isocoat_spring_create(world, &desc, &spring), ISOCOAT_ERROR_INVALID_HANDLE, "link: the handle is null");
    REFUSED(isocoat_spring_create(world, NULL, &spring), ISOCOAT_ERROR_INVALID_ARGUMENT, "desc is NULL");
    REFUSED(isocoat_spring_create(world, &good, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "spring is NULL");
    REFUSED(isocoat_spring_create(NULL, &good, &spring), ISOCOAT_ERROR_INVALID_ARGUMENT, "world is NULL");

    row[0] = good, row[1] = good, row[2] = good;
    row[2].damping = -3.0;
    REFUSED(isocoat_spring_create_many(world, row, 3, many), ISOCOAT_ERROR_OUT_OF_RANGE,
            "descs[2]: damping of a spring is -3");
    row[1].struct_size -= 4;
    REFUSED(isocoat_spring_create_many(world, row, 3, many), ISOCOAT_ERROR_INVALID_ARGUMENT, "descs[1]");
    REFUSED(isocoat_spring_create_many(world, NULL, 3, many), ISOCOAT_ERROR_INVALID_ARGUMENT, "descs is NULL");
    OK(isocoat_body_get_springs(world, body, NULL, 0, &count));
    CHECK(count == 0 && spring.index == 7);

    OK(isocoat_spring_create(world, &good, &spring));
    REFUSED(isocoat_spring_set_desc(world, spring, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "desc is NULL");
    REFUSED(isocoat_spring_get_desc(world, spring, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "desc is NULL");
    REFUSED(isocoat_spring_get_state(world, spring, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "state is NULL");
    REFUSED(isocoat_spring_get_user_data(world, spring, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "user_data is NULL");
    memset(&spring, 0, sizeof spring);
    desc = good;
    REFUSED(isocoat_spring_get_desc(world, spring, &desc), ISOCOAT_ERROR_INVALID_HANDLE, "spring: the handle is null");
    REFUSED(isocoat_spring_set_desc(world, spring, &good), ISOCOAT_ERROR_INVALID_HANDLE, "null");
    REFUSED(isocoat_spring_get_state(world, spring, &state), ISOCOAT_ERROR_INVALID_HANDLE, "null");
    REFUSED(isocoat_spring_get_user_data(world, spring, &data), ISOCOAT_ERROR_INVALID_HANDLE, "null");
    REFUSED(isocoat_spring_destroy(world, spring), ISOCOAT_ERROR_INVALID_HANDLE, "null");
    isocoat_world_destroy(world);
}

static void a_mass_hangs_by_its_weight(void)
{
    isocoat_world_desc settings = isocoat_world_desc_default();
    isocoat_world *world;
    isocoat_body body;
    isocoat_link nail, mass;
    isocoat_spring spring;
    isocoat_spring_desc desc;
    isocoat_spring_state state;
    isocoat_wrench wrench;
    int step;

    settings.gravity[2] = -9.81;
    OK(isocoat_world_create(&settings, &world));
    body = new_body(world);
    nail = new_link(world, body, ISOCOAT_LINK_FIXED, 0.0);
    mass = new_link(world, body, ISOCOAT_LINK_POINT_MASS, -1.0);
    desc = between(nail, mass, 1.0);
    desc.stiffness = 1e6;
    desc.damping = 1e3;
    OK(isocoat_spring_create(world, &desc, &spring));
    for (step = 0; step < 300; ++step) OK(isocoat_world_step(world, 1.0 / 60.0));
    OK(isocoat_spring_get_state(world, spring, &state));
    CHECK_NEAR(state.length - 1.0, 9.81e-6, 1e-12);
    CHECK_NEAR(state.tension, 9.81, 1e-6);
    OK(isocoat_link_get_wrench(world, nail, &wrench));
    CHECK_NEAR(wrench.force[2], -9.81, 1e-6);
    isocoat_world_destroy(world);
}

int main(void)
{
    the_defaults_are_those_of_the_manual();
    lives_and_lists();
    what_cannot_be_is_refused();
    a_mass_hangs_by_its_weight();
    return verdict("springs");
}
