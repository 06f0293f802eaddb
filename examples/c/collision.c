/*
 * Two soft balls collide: the lower one is held, the upper one falls on it. Where they meet, both are flat and bulge
 * round the contact. With a folder as argument it leaves pictures there, with --record FILE a recording. Exits 0 when
 * the ball sinks in by a quarter of its radius, and rises again to where it fell from, within 1 %.
 */
#include <isocoat/isocoat.h>

#include "../common/check.h"
#include "../common/picture.h"
#include "../common/record.h"

#include <stdio.h>

static const double GRAVITY = 9.81, STEP = 1.0 / 240.0, MASS = 2.0;
static const double LOWER = 0.1, UPPER = 0.08, HEIGHT = 0.32;

static int add_ball(isocoat_world *world, isocoat_link_kind kind, double radius, double height, isocoat_link *link)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    body_desc.stiffness_scale = 1.5e5;
    body_desc.friction = 0.0;
    body_desc.bulge_width = 0.8;
    body_desc.bulge_height = 0.7;
    isocoat_body body;
    CHECK(isocoat_body_create(world, &body_desc, &body));
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    link_desc.kind = kind;
    link_desc.mass = MASS;
    link_desc.pose.position[2] = height;
    CHECK(isocoat_link_create(world, body, &link_desc, link));
    isocoat_skeleton_desc shape = isocoat_skeleton_desc_default();
    shape.thickness = radius;
    shape.radius = 2.0 * radius;
    isocoat_skeleton skeleton;
    CHECK(isocoat_skeleton_create(world, *link, &shape, &skeleton));
    return 0;
}

int main(int count, char **arguments)
{
    recording film;
    if (record_begin(&film, record_argument(&count, arguments))) return 1;
    isocoat_world_desc world_desc = isocoat_world_desc_default();
    world_desc.gravity[2] = -GRAVITY;
    isocoat_world *world = NULL;
    CHECK(isocoat_world_create(&world_desc, &world));
    isocoat_link held, falling;
    if (add_ball(world, ISOCOAT_LINK_FIXED, LOWER, 0.0, &held)) return 1;
    if (add_ball(world, ISOCOAT_LINK_POINT_MASS, UPPER, HEIGHT, &falling)) return 1;

    double lowest = HEIGHT, highest = 0.0, before = 0.0;
    printf("time [s]  height [m]  sinks in [mm]  area [cm^2]  force [N]  peak pressure [kPa]\n");
    for (int tick = 0; tick <= 140; ++tick) {
        isocoat_link_state state;
        CHECK(isocoat_link_get_state(world, falling, &state));
        const double height = state.pose.position[2], speed = state.linear_velocity[2];
        lowest = fmin(lowest, height);
        if (before > 0.0 && speed <= 0.0 && lowest < LOWER + UPPER) highest = fmax(highest, height);
        before = speed;
        const isocoat_contact *contacts;
        size_t found;
        CHECK(isocoat_world_get_contacts(world, &contacts, &found));
        if (tick % 5 == 0) {
            printf("%8.3f %11.4f %14.1f %12.1f %10.1f %20.2f\n", tick * STEP, height,
                   1e3 * fmax(LOWER + UPPER - height, 0.0), found ? 1e4 * contacts[0].area : 0.0,
                   found ? fabs(contacts[0].force[2]) : 0.0, found ? 1e-3 * contacts[0].peak_pressure : 0.0);
        }
        if (count > 1 && tick % 10 == 0) {
            const picture_view view = {{0.3, -1.2, 0.4}, {0.0, 0.0, 0.12}, {0.0, 0.0, 1.0}, 0.6};
            char path[512];
            snprintf(path, sizeof path, "%s/collision%02d.ppm", arguments[1], tick / 10);
            if (picture_write(world, &view, UINT64_MAX, 320, 320, path)) return 1;
        }
        if (record_frame(&film, world, tick * STEP)) return 1;
        CHECK(isocoat_world_step(world, STEP));
    }
    printf("sank in by %.1f mm, rose again to %.4f m of %.2f m\n", 1e3 * (LOWER + UPPER - lowest), highest, HEIGHT);
    if (record_end(&film)) return 1;
    isocoat_world_destroy(world);
    return LOWER + UPPER - lowest > 0.25 * UPPER && fabs(highest / HEIGHT - 1.0) < 1e-2 ? 0 : 1;
}
