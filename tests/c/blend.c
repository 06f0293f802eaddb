/* Blend graphs, and the contact of a body with itself. */
#include "check.h"

/* A body of three balls in a row, one a link, that overlap. */
typedef struct limbs {
    isocoat_body body;
    isocoat_link links[3];
    isocoat_skeleton skeletons[3];
} limbs;

static limbs three_balls(isocoat_world *world)
{
    const isocoat_body_desc body_desc = isocoat_body_desc_default();
    const isocoat_skeleton_desc skeleton_desc = isocoat_skeleton_desc_default();
    limbs made;
    int i;
    CHECK(body_desc.blend_band == 0.05 && body_desc.self_contact == 1);
    OK(isocoat_body_create(world, &body_desc, &made.body));
    for (i = 0; i < 3; ++i) {
        isocoat_link_desc link_desc = isocoat_link_desc_default();
        link_desc.pose.position[0] = 0.15 * i;
        OK(isocoat_link_create(world, made.body, &link_desc, &made.links[i]));
        OK(isocoat_skeleton_create(world, made.links[i], &skeleton_desc, &made.skeletons[i]));
    }
    return made;
}

static double blend(isocoat_world *world, isocoat_skeleton a, isocoat_skeleton b)
{
    double weight = -1.0;
    OK(isocoat_skeleton_get_blend(world, a, b, &weight));
    return weight;
}

static size_t contacts(isocoat_world *world, isocoat_body body)
{
    isocoat_contact found[8];
    size_t count = 99;
    OK(isocoat_world_collide(world, body, body, ISOCOAT_SCHEME_AUTO, 1e-3, found, 8, &count));
    return count;
}

static void joints_say_who_blends_and_who_collides(void)
{
    isocoat_world *world = new_world();
    const limbs body = three_balls(world);
    const isocoat_skeleton *s = body.skeletons;
    const isocoat_link joints[4] = {body.links[0], body.links[1], body.links[1], body.links[2]};
    VEC(between, 0.075, 0.0, 0.0);
    double sum, apart;

    CHECK(blend(world, s[0], s[2]) == 1.0 && contacts(world, body.body) == 0);
    OK(isocoat_body_evaluate_field(world, body.body, between, 1, &sum, NULL));
    OK(isocoat_body_blend_neighbours(world, body.body, joints, 2));
    CHECK(blend(world, s[0], s[1]) == 1.0 && blend(world, s[1], s[2]) == 1.0 && blend(world, s[0], s[2]) == 0.0);
    OK(isocoat_body_blend_neighbours(world, body.body, NULL, 0));
    CHECK(blend(world, s[0], s[1]) == 0.0 && contacts(world, body.body) == 2);
    OK(isocoat_body_evaluate_field(world, body.body, between, 1, &apart, NULL));
    CHECK(apart < 0.6 * sum);
    OK(isocoat_skeleton_set_pair_contact(world, s[1], s[0], false));
    CHECK(contacts(world, body.body) == 1);
    OK(isocoat_body_blend_all(world, body.body));
    CHECK(blend(world, s[0], s[1]) == 1.0 && contacts(world, body.body) == 0);
    isocoat_world_destroy(world);
}

static void a_weight_takes_its_time(void)
{
    isocoat_world *world = new_world();
    const limbs body = three_balls(world);
    const isocoat_skeleton *s = body.skeletons;
    int tick;
    OK(isocoat_skeleton_set_blend(world, s[0], s[1], 0.0, 0.5));
    CHECK(blend(world, s[0], s[1]) == 1.0);
    for (tick = 0; tick < 15; ++tick) OK(isocoat_world_step(world, 1.0 / 60.0));
    CHECK_NEAR(blend(world, s[0], s[1]), 0.5, 1e-9);
    for (tick = 0; tick < 16; ++tick) OK(isocoat_world_step(world, 1.0 / 60.0));
    CHECK(blend(world, s[1], s[0]) == 0.0);
    isocoat_world_destroy(world);
}

static void what_makes_no_sense_is_refused_and_changes_nothing(void)
{
    const isocoat_status unsupported = ISOCOAT_ERROR_UNSUPPORTED, range = ISOCOAT_ERROR_OUT_OF_RANGE;
    isocoat_world *world = new_world();
    const limbs body = three_balls(world), other = three_balls(world);
    const isocoat_skeleton *s = body.skeletons;
    const isocoat_link foreign[2] = {body.links[0], other.links[0]}, itself[2] = {body.links[0], body.links[0]};
    isocoat_body_desc desc = isocoat_body_desc_default();
    double weight = 7.0;

    REFUSED(isocoat_skeleton_set_blend(world, s[0], s[1], 1.5, 0.0), range, "weight is 1.5; must be from 0 to 1");
    REFUSED(isocoat_skeleton_set_blend(world, s[0], s[1], NAN, 0.0), range, "weight is NaN");
    REFUSED(isocoat_skeleton_set_blend(world, s[0], s[1], 0.0, -1.0), range, "duration is -1");
    REFUSED(isocoat_skeleton_set_blend(world, s[0], s[0], 0.0, 0.0), unsupported, "itself");
    REFUSED(isocoat_skeleton_set_blend(world, s[0], other.skeletons[0], 0.0, 0.0), unsupported, "two bodies");
    REFUSED(isocoat_skeleton_get_blend(world, s[0], s[1], NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "weight is NULL");
    REFUSED(isocoat_skeleton_get_blend(world, s[0], s[0], &weight), unsupported, "itself");
    REFUSED(isocoat_body_blend_neighbours(world, body.body, foreign, 1), unsupported, "another body");
    REFUSED(isocoat_body_blend_neighbours(world, body.body, itself, 1), unsupported, "itself");
    REFUSED(isocoat_body_blend_neighbours(world, body.body, NULL, 1), ISOCOAT_ERROR_INVALID_ARGUMENT, "joints is NULL");
    CHECK(weight == 7.0 && blend(world, s[0], s[1]) == 1.0);
    OK(isocoat_skeleton_destroy(world, s[1]));
    REFUSED(isocoat_skeleton_set_blend(world, s[0], s[1], 0.0, 0.0), ISOCOAT_ERROR_INVALID_HANDLE, "");
    desc.blend_band = 0.6;
    REFUSED(isocoat_body_set_desc(world, body.body, &desc), range, "blend_band is 0.6; must be from 0 to 0.5");
    desc.blend_band = 0.1;
    desc.self_contact = 2;
    REFUSED(isocoat_body_set_desc(world, body.body, &desc), ISOCOAT_ERROR_INVALID_ARGUMENT, "self_contact is 2");
    isocoat_world_destroy(world);
}

int main(void)
{
    joints_say_who_blends_and_who_collides();
    a_weight_takes_its_time();
    what_makes_no_sense_is_refused_and_changes_nothing();
    return verdict("blend");
}
