/* Volumes and their control. */
#include "check.h"

/* A ball of 0.1 m that the host holds, with volume control. */
static ball controlled_ball(isocoat_world *world)
{
    ball made = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    isocoat_body_desc desc = isocoat_body_desc_default();
    CHECK(desc.volume_gain == 0.0);
    desc.volume_gain = 0.5;
    OK(isocoat_body_set_desc(world, made.body, &desc));
    OK(isocoat_body_get_desc(world, made.body, &desc));
    CHECK(desc.volume_gain == 0.5);
    return made;
}

static double volume_of_ball(double radius) { return 4.0 / 3.0 * PI * radius * radius * radius; }

static void a_ball_swells_to_its_target(void)
{
    isocoat_world *world = new_world();
    const ball it = controlled_ball(world);
    double volume = 0.0, target = 0.0, offset = -1.0;
    VEC(point, 0.0, 0.0, 1.0);
    isocoat_surface_point closest;
    bool found = false;
    int tick;

    OK(isocoat_skeleton_get_volume(world, it.skeleton, &volume));
    OK(isocoat_skeleton_get_target_volume(world, it.skeleton, &target));
    OK(isocoat_skeleton_get_offset(world, it.skeleton, &offset));
    CHECK_NEAR(volume, volume_of_ball(0.1), 1e-15);
    CHECK(target == volume && offset == 0.0);

    OK(isocoat_skeleton_set_target_volume(world, it.skeleton, volume_of_ball(0.12)));
    for (tick = 0; tick < 40; ++tick) OK(isocoat_world_step(world, 1.0 / 60.0));
    OK(isocoat_skeleton_get_offset(world, it.skeleton, &offset));
    OK(isocoat_skeleton_get_target_volume(world, it.skeleton, &target));
    OK(isocoat_body_get_volume(world, it.body, &volume));
    CHECK_NEAR(offset, 0.02, 1e-6);
    CHECK(target == volume_of_ball(0.12));
    CHECK_NEAR(volume, target, 1e-4 * target);
    OK(isocoat_body_closest_point(world, it.body, point, &closest, &found));
    CHECK_NEAR(closest.distance, 0.88, 1e-6);
    isocoat_world_destroy(world);
}

static void what_makes_no_sense_is_refused(void)
{
    isocoat_world *world = new_world();
    const ball it = controlled_ball(world), plain = new_ball(world, ISOCOAT_LINK_FIXED, 1.0);
    isocoat_skeleton_desc flat = isocoat_skeleton_desc_default();
    isocoat_body_desc desc = isocoat_body_desc_default();
    isocoat_skeleton plane;
    double value = -7.0;

    REFUSED(isocoat_skeleton_set_target_volume(world, it.skeleton, 0.0), ISOCOAT_ERROR_OUT_OF_RANGE,
            "target volume is 0; must be > 0 and at most 1e30");
    REFUSED(isocoat_skeleton_set_target_volume(world, plain.skeleton, 1.0), ISOCOAT_ERROR_UNSUPPORTED, "volume_gain");
    REFUSED(isocoat_skeleton_get_target_volume(world, plain.skeleton, &value), ISOCOAT_ERROR_UNSUPPORTED,
            "volume_gain");
    REFUSED(isocoat_skeleton_set_target_volume(NULL, it.skeleton, 1.0), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "world is NULL");
    REFUSED(isocoat_skeleton_get_volume(world, it.skeleton, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "volume is NULL");
    REFUSED(isocoat_skeleton_get_target_volume(world, it.skeleton, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "target is NULL");
    REFUSED(isocoat_skeleton_get_offset(world, it.skeleton, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "offset is NULL");
    REFUSED(isocoat_body_get_volume(world, it.body, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "volume is NULL");
    desc.volume_gain = 0.75;
    REFUSED(isocoat_body_set_desc(world, it.body, &desc), ISOCOAT_ERROR_OUT_OF_RANGE,
            "volume_gain is 0.75; must be from 0 (off) to 0.5");

    flat.shape = ISOCOAT_SHAPE_PLANE;
    flat.points[1][2] = 1.0;
    OK(isocoat_skeleton_create(world, plain.link, &flat, &plane));
    REFUSED(isocoat_skeleton_get_volume(world, plane, &value), ISOCOAT_ERROR_UNSUPPORTED, "no bounds");
    REFUSED(isocoat_body_get_volume(world, plain.body, &value), ISOCOAT_ERROR_UNSUPPORTED, "no bounds");

    OK(isocoat_skeleton_destroy(world, it.skeleton));
    REFUSED(isocoat_skeleton_get_offset(world, it.skeleton, &value), ISOCOAT_ERROR_INVALID_HANDLE, "stale");
    REFUSED(isocoat_skeleton_set_target_volume(world, it.skeleton, 1.0), ISOCOAT_ERROR_INVALID_HANDLE, "stale");
    CHECK(value == -7.0);
    OK(isocoat_body_get_volume(world, it.body, &value));
    CHECK(value == 0.0);
    isocoat_world_destroy(world);
}

int main(void)
{
    a_ball_swells_to_its_target();
    what_makes_no_sense_is_refused();
    return verdict("volume");
}
