/*
 * An arm flexes: bones of the upper arm and of the forearm and a biceps of points, all in one coat that keeps the
 * volume of each of its parts. The target volume of the biceps doubles while the elbow bends, and returns. With a
 * folder as argument it leaves pictures there, with --record FILE a recording. Exits 0 when half a second after its
 * target came to rest the biceps has it, within 2 %, both times, and when in the end its neighbours have the volume
 * that they began with, within 3 %.
 */
#include <isocoat/isocoat.h>

#include "../common/check.h"
#include "../common/picture.h"
#include "../common/record.h"

#include <stdio.h>

#define BICEPS 4
#define PARTS (BICEPS + 3)
static const double STEP = 1.0 / 60.0;
/* The target doubles from 0.2 s to 0.6 s, and returns from 1.2 s to 1.6 s; the elbow bends by so much on the way. */
static const double FLEX_AT = 0.2, RELAX_AT = 1.2, RAMP = 0.4, HOLD = 0.5, BEND = 0.6;
static const double UPPER_ARM = 0.30;

/* How far the arm is flexed, from 0 to 1. */
static double flexion(double time)
{
    const double up = fmin(fmax((time - FLEX_AT) / RAMP, 0.0), 1.0);
    const double down = fmin(fmax((time - RELAX_AT) / RAMP, 0.0), 1.0);
    return up - down;
}

/* The forearm's frame has its origin in the elbow, and turns about y. */
static void bend(double angle, isocoat_pose *pose)
{
    pose->position[0] = UPPER_ARM;
    pose->orientation[1] = -sin(0.5 * angle);
    pose->orientation[3] = cos(0.5 * angle);
}

/* A segment from x = from to x = to at height z in a link's frame; a point when both are one. */
static int add_part(isocoat_world *world, isocoat_link link, double from, double to, double z, double thickness,
                    isocoat_skeleton *part)
{
    isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
    desc.shape = ISOCOAT_SHAPE_SEGMENT;
    desc.points[0][0] = from;
    desc.points[1][0] = to;
    desc.points[0][2] = desc.points[1][2] = z;
    desc.thickness = thickness;
    desc.radius = 2.0 * thickness;
    /* Volumes are measured by seeds: more of them see more of where the parts meet. */
    desc.seed_count = 128;
    CHECK(isocoat_skeleton_create(world, link, &desc, part));
    return 0;
}

/* Volumes of the biceps, the upper arm, the forearm and the hand. */
static int measure(const isocoat_world *world, const isocoat_skeleton parts[PARTS], double volumes[4])
{
    volumes[0] = 0.0;
    for (int part = 0; part < PARTS; ++part) {
        double volume;
        CHECK(isocoat_skeleton_get_volume(world, parts[part], &volume));
        if (part < BICEPS) {
            volumes[0] += volume;
        } else {
            volumes[part - BICEPS + 1] = volume;
        }
    }
    return 0;
}

int main(int count, char **arguments)
{
    recording film;
    if (record_begin(&film, record_argument(&count, arguments))) return 1;
    const isocoat_world_desc world_desc = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    CHECK(isocoat_world_create(&world_desc, &world));
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    body_desc.volume_gain = 0.5;
    isocoat_body arm;
    CHECK(isocoat_body_create(world, &body_desc, &arm));

    /* Without a mass they go where the host says, whatever happens. */
    isocoat_link upper_arm, forearm;
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    link_desc.kind = ISOCOAT_LINK_HOST;
    CHECK(isocoat_link_create(world, arm, &link_desc, &upper_arm));
    const double angle_at_rest = 0.4;
    isocoat_link_state state = {link_desc.pose, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    bend(angle_at_rest, &state.pose);
    link_desc.pose = state.pose;
    CHECK(isocoat_link_create(world, arm, &link_desc, &forearm));

    isocoat_skeleton parts[PARTS];
    for (int k = 0; k < BICEPS; ++k) {
        const double x = 0.09 + 0.04 * k;
        if (add_part(world, upper_arm, x, x, 0.045, 0.035, &parts[k])) return 1;
    }
    if (add_part(world, upper_arm, 0.0, UPPER_ARM - 0.03, 0.0, 0.045, &parts[BICEPS])) return 1;
    if (add_part(world, forearm, 0.03, 0.22, 0.0, 0.038, &parts[BICEPS + 1])) return 1;
    if (add_part(world, forearm, 0.28, 0.30, 0.0, 0.042, &parts[BICEPS + 2])) return 1;

    /* The first step takes the volumes at rest; what they are multiplied by is the muscle's strain. */
    CHECK(isocoat_world_step(world, STEP));
    double targets[BICEPS], rest[4], now[4];
    for (int k = 0; k < BICEPS; ++k) {
        CHECK(isocoat_skeleton_get_target_volume(world, parts[k], &targets[k]));
    }
    if (measure(world, parts, rest)) return 1;

    printf("volumes over those at rest\ntime [s]  bend [deg]   target   biceps  upper arm  forearm    hand\n");
    const int flexed = (int)lround((FLEX_AT + RAMP + HOLD) / STEP);
    const int relaxed = (int)lround((RELAX_AT + RAMP + HOLD) / STEP);
    double error = 0.0, neighbours = 0.0;
    for (int tick = 0; tick <= relaxed; ++tick) {
        const double time = tick * STEP, flex = flexion(time);
        for (int k = 0; k < BICEPS; ++k) {
            CHECK(isocoat_skeleton_set_target_volume(world, parts[k], (1.0 + flex) * targets[k]));
        }
        bend(angle_at_rest + BEND * flex, &state.pose);
        state.angular_velocity[1] = -BEND * (flexion(time + STEP) - flex) / STEP;
        CHECK(isocoat_link_set_state(world, forearm, &state));
        CHECK(isocoat_world_step(world, STEP));
        if (record_frame(&film, world, time)) return 1;

        if (measure(world, parts, now)) return 1;
        for (int k = 0; k < 4; ++k) {
            now[k] /= rest[k];
        }
        if (tick % 6 == 0) {
            printf("%8.2f %11.1f %8.3f %8.3f %10.3f %8.3f %7.3f\n", time,
                   (angle_at_rest + BEND * flex) * 57.29578, 1.0 + flex, now[0], now[1], now[2], now[3]);
        }
        if (tick == flexed || tick == relaxed) {
            error = fmax(error, fabs(now[0] / (1.0 + flex) - 1.0));
        }
        if (count > 1 && tick % 6 == 0) {
            const picture_view view = {{0.2, -1.6, 0.45}, {0.27, 0.0, 0.1}, {0.0, 0.0, 1.0}, 0.75};
            char path[512];
            snprintf(path, sizeof path, "%s/muscle%02d.ppm", arguments[1], tick / 6);
            if (picture_write(world, &view, UINT64_MAX, 480, 320, path)) return 1;
        }
    }
    for (int k = 1; k < 4; ++k) {
        neighbours = fmax(neighbours, fabs(now[k] - 1.0));
    }
    printf("%.1f s after its target came to rest the biceps is off by at most %.3f %%; in the end its neighbours by "
           "%.3f %%\n", HOLD, 100.0 * error, 100.0 * neighbours);
    if (record_end(&film)) return 1;
    isocoat_world_destroy(world);
    return error < 0.02 && neighbours < 0.03 ? 0 : 1;
}
