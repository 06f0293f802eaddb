/* A host that C and C++ share: a ball falls on a ball on the ground, and what comes back is checked. */
#ifndef HOST_H
#define HOST_H

#include <isocoat/isocoat.h>
#include <stdio.h>
#include <string.h>

static int fail(const char *what) {
    char message[256] = "";
    isocoat_last_error(message, sizeof message);
    fprintf(stderr, "%s failed: %s\n", what, message);
    return 1;
}

/* The first argument, if any, is the version that the build system found. */
static int run_host(int argc, char **argv) {
    const char *version = isocoat_version_string();
    if (argc > 1 && strcmp(version, argv[1]) != 0) {
        fprintf(stderr, "the library is %s, the package said %s\n", version, argv[1]);
        return 1;
    }
    if (isocoat_check_abi() != ISOCOAT_OK) return fail("isocoat_check_abi");

    isocoat_world *world = NULL;
    isocoat_world_desc world_desc = isocoat_world_desc_default();
    world_desc.gravity[2] = -9.81;
    if (isocoat_world_create(&world_desc, &world) != ISOCOAT_OK) return fail("isocoat_world_create");

    isocoat_link links[2];
    for (int i = 0; i < 2; i++) {
        isocoat_body body;
        isocoat_body_desc body_desc = isocoat_body_desc_default();
        if (isocoat_body_create(world, &body_desc, &body) != ISOCOAT_OK) return fail("isocoat_body_create");
        isocoat_link_desc link_desc = isocoat_link_desc_default();
        link_desc.kind = i == 0 ? ISOCOAT_LINK_FIXED : ISOCOAT_LINK_POINT_MASS;
        link_desc.mass = 1.0;
        link_desc.pose.position[2] = i == 0 ? 0.0 : 0.25;
        if (isocoat_link_create(world, body, &link_desc, &links[i]) != ISOCOAT_OK) return fail("isocoat_link_create");
        isocoat_skeleton skeleton;
        isocoat_skeleton_desc skeleton_desc = isocoat_skeleton_desc_default();
        if (isocoat_skeleton_create(world, links[i], &skeleton_desc, &skeleton) != ISOCOAT_OK) {
            return fail("isocoat_skeleton_create");
        }
    }

    double peak = 0.0;
    isocoat_link_state state;
    for (int step = 0; step < 60; step++) {
        if (isocoat_world_step(world, 1.0 / 240.0) != ISOCOAT_OK) return fail("isocoat_world_step");
        isocoat_wrench wrench;
        if (isocoat_link_get_wrench(world, links[1], &wrench) != ISOCOAT_OK) return fail("isocoat_link_get_wrench");
        if (wrench.force[2] > peak) peak = wrench.force[2];
    }
    if (isocoat_link_get_state(world, links[1], &state) != ISOCOAT_OK) return fail("isocoat_link_get_state");
    isocoat_world_destroy(world);

    printf("isocoat %s: highest force %.1f N, height %.3f m\n", version, peak, state.pose.position[2]);
    return peak > 9.81 && state.pose.position[2] > 0.1 ? 0 : 1;
}

#endif
