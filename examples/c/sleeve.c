/*
 * A host's own mesh on an arm: a tube of rings, bound once while the arm is straight. Then the elbow bends, and the arm
 * is pressed on a floor; the tube bends without a pinch, is flat on the floor and bulges round it. With a folder as
 * argument it leaves pictures there. Exits 0 when no vertex goes through the floor, some lie on it, and the tube takes
 * the deformed field's surface along.
 */
#include <isocoat/isocoat.h>

#include "../common/check.h"
#include "../common/raster.h"

#include <stdio.h>

enum { RINGS = 60, SIDES = 40, COUNT = RINGS * SIDES, TRIANGLES = 2 * (RINGS - 1) * SIDES + 2 * (SIDES - 2) };
#define TURN 6.283185307179586
/* The bones end this far from the elbow, where their fields add up to what each has alone at the same radius. */
static const double LENGTH = 0.35, THICKNESS = 0.1, GAP = 0.08, PRESSED = 0.035;

typedef struct tube {
    double positions[3 * COUNT], normals[3 * COUNT];
    uint32_t triangles[3 * TRIANGLES];
} tube;

/* Rings round the x axis, with round ends. */
static void make_tube(tube *it)
{
    uint32_t *corner = it->triangles;
    for (uint32_t ring = 0; ring < RINGS; ++ring) {
        /* Along the outline of the capsule: a quarter of a circle, a line, a quarter of a circle. */
        const double arc = 0.25 * TURN * THICKNESS, whole = 2.0 * LENGTH + 2.0 * arc;
        const double s = whole * (ring + 0.5) / RINGS - 0.5 * whole;
        const double angle = fmax(fabs(s) - LENGTH, 0.0) / THICKNESS;
        for (uint32_t side = 0; side < SIDES; ++side) {
            const double turn = TURN * side / SIDES;
            double *p = it->positions + 3 * (ring * SIDES + side), *n = it->normals + 3 * (ring * SIDES + side);
            n[0] = s < 0.0 ? -sin(angle) : sin(angle);
            n[1] = cos(angle) * cos(turn);
            n[2] = cos(angle) * sin(turn);
            p[0] = fmax(-LENGTH, fmin(LENGTH, s)) + THICKNESS * n[0];
            p[1] = THICKNESS * n[1];
            p[2] = THICKNESS * n[2];
            if (ring + 1 < RINGS) {
                const uint32_t a = ring * SIDES + side, b = ring * SIDES + (side + 1) % SIDES;
                const uint32_t quad[6] = {a, b, a + SIDES, a + SIDES, b, b + SIDES};
                for (int k = 0; k < 6; ++k) *corner++ = quad[k];
            }
        }
    }
    for (uint32_t side = 1; side + 1 < SIDES; ++side) {
        const uint32_t last = (RINGS - 1) * SIDES, caps[6] = {0, side + 1, side, last, last + side, last + side + 1};
        for (int k = 0; k < 6; ++k) *corner++ = caps[k];
    }
}

/* Two bones in one coat; the elbow is the origin. */
static int make_arm(isocoat_world *world, isocoat_body *body, isocoat_link links[2])
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    body_desc.bulge_width = 0.6;
    body_desc.bulge_height = 1.0;
    CHECK(isocoat_body_create(world, &body_desc, body));
    for (int k = 0; k < 2; ++k) {
        isocoat_link_desc link_desc = isocoat_link_desc_default();
        isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
        isocoat_skeleton made;
        link_desc.kind = ISOCOAT_LINK_HOST;
        CHECK(isocoat_link_create(world, *body, &link_desc, &links[k]));
        desc.shape = ISOCOAT_SHAPE_SEGMENT;
        desc.points[0][0] = k == 0 ? -GAP : GAP;
        desc.points[1][0] = k == 0 ? -LENGTH : LENGTH;
        desc.thickness = THICKNESS;
        CHECK(isocoat_skeleton_create(world, links[k], &desc, &made));
    }
    return 0;
}

/* A rigid half-space whose surface is at this height. */
static int make_floor(isocoat_world *world, double height)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
    isocoat_body body;
    isocoat_link link;
    isocoat_skeleton made;
    body_desc.kind = ISOCOAT_BODY_RIGID;
    link_desc.pose.position[2] = height - desc.thickness;
    desc.shape = ISOCOAT_SHAPE_PLANE;
    desc.points[1][2] = 1.0;
    CHECK(isocoat_body_create(world, &body_desc, &body));
    CHECK(isocoat_link_create(world, body, &link_desc, &link));
    CHECK(isocoat_skeleton_create(world, link, &desc, &made));
    return 0;
}

static int deform(const isocoat_world *world, isocoat_skin skin, tube *out)
{
    const isocoat_buffer positions = {out->positions, 0, ISOCOAT_FORMAT_F64};
    const isocoat_buffer normals = {out->normals, 0, ISOCOAT_FORMAT_F64};
    CHECK(isocoat_skin_deform(world, skin, ISOCOAT_DEFORMATION_BULGES, positions, normals, COUNT));
    return 0;
}

/* From the side, or from below the floor. */
static int write_picture(const tube *it, int below, const char *folder)
{
    static const picture_view views[2] = {{{0.3, -1.5, 0.35}, {0.0, 0.1, -0.02}, {0.0, 0.0, 1.0}, 1.1},
                                          {{0.1, -0.5, -1.3}, {0.0, 0.1, -0.02}, {0.0, 0.0, 1.0}, 1.1}};
    const isocoat_mesh_view mesh = {it->positions, it->normals, it->triangles, NULL, COUNT, TRIANGLES};
    raster picture;
    char path[512];
    if (raster_begin(&picture, &views[below], 800, 560)) return 1;
    raster_mesh(&picture, &mesh, 3, 1);
    snprintf(path, sizeof path, "%s/%s.ppm", folder, below ? "sleeve_below" : "sleeve");
    return raster_write(&picture, path);
}

int main(int count, char **arguments)
{
    static tube mesh;
    const isocoat_world_desc desc = isocoat_world_desc_default();
    const double height = PRESSED - THICKNESS, angle = 1.2;
    isocoat_world *world = NULL;
    isocoat_body body;
    isocoat_link links[2];
    isocoat_skin skin;
    isocoat_link_state state;
    double lowest = INFINITY;
    int flat = 0;
    make_tube(&mesh);
    CHECK(isocoat_world_create(&desc, &world));
    if (make_arm(world, &body, links)) return 1;
    const isocoat_const_buffer positions = {mesh.positions, 0, ISOCOAT_FORMAT_F64};
    const isocoat_const_buffer normals = {mesh.normals, 0, ISOCOAT_FORMAT_F64};
    CHECK(isocoat_skin_create(world, body, positions, normals, COUNT, &skin));

    /* The forearm turns about z, the upper arm lies still; both are pressed on the floor. */
    CHECK(isocoat_link_get_state(world, links[1], &state));
    state.pose.orientation[2] = sin(0.5 * angle);
    state.pose.orientation[3] = cos(0.5 * angle);
    CHECK(isocoat_link_set_state(world, links[1], &state));
    if (make_floor(world, height) || deform(world, skin, &mesh)) return 1;
    for (int v = 0; v < COUNT; ++v) {
        const double z = mesh.positions[3 * v + 2];
        lowest = fmin(lowest, z);
        flat += fabs(z - height) < 1e-3 * THICKNESS;
    }
    printf("lowest vertex %.2e m above the floor, %d of %d vertices on it\n", lowest - height, flat, COUNT);
    if (count > 1 && (write_picture(&mesh, 0, arguments[1]) || write_picture(&mesh, 1, arguments[1]))) return 1;
    isocoat_world_destroy(world);
    return lowest < height - 1e-2 * THICKNESS || flat < COUNT / 20;
}
