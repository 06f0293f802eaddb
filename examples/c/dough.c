/*
 * Two lumps of clay on a table are pressed together by two plates that the host drives, held for a while, and pulled
 * apart again by their ends. Where the pressure between them is above the threshold of the clay, they fuse little by
 * little and are one lump; with a threshold that is never met they only lean on each other. Both are shown. With a
 * folder as argument it leaves pictures there. Exits 0 when the first is one piece in the end and the second two.
 */
#include <isocoat/isocoat.h>

#include "../common/check.h"
#include "../common/picture.h"

#include <stdio.h>
#include <stdlib.h>

static const double GRAVITY = 9.81, STEP = 1.0 / 60.0, SPACING = 0.05, RADIUS = 0.13;
/* When the plates stop, when they let go, and when the pull ends, in s; how far they go, and how fast. */
static const double CLOSED = 1.0, RELEASED = 2.5, END = 4.0, START = 0.42, SPEED = 0.17;

/* A body of one box or plane that the host moves, if at all. */
static int add_solid(isocoat_world *world, isocoat_link_kind kind, const isocoat_skeleton_desc *shape, double x,
                     double friction, isocoat_link *link)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    body_desc.kind = ISOCOAT_BODY_RIGID;
    body_desc.friction = friction;
    body_desc.static_friction = friction;
    isocoat_body body;
    CHECK(isocoat_body_create(world, &body_desc, &body));
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    link_desc.kind = kind;
    link_desc.pose.position[0] = x;
    CHECK(isocoat_link_create(world, body, &link_desc, link));
    isocoat_skeleton skeleton;
    CHECK(isocoat_skeleton_create(world, *link, shape, &skeleton));
    return 0;
}

/* A table with its top at height 0, and a plate on either side. */
static int add_solids(isocoat_world *world, isocoat_link plates[2])
{
    isocoat_skeleton_desc shape = isocoat_skeleton_desc_default();
    shape.thickness = 0.02;
    shape.shape = ISOCOAT_SHAPE_PLANE;
    shape.points[0][2] = -shape.thickness;
    shape.points[1][2] = 1.0;
    isocoat_link table;
    if (add_solid(world, ISOCOAT_LINK_FIXED, &shape, 0.0, 0.1, &table)) return 1;
    isocoat_skeleton_desc plate = isocoat_skeleton_desc_default();
    plate.shape = ISOCOAT_SHAPE_BOX;
    plate.thickness = 0.02;
    plate.points[0][2] = 0.18;
    /* Half the size; with its coat it ends above the table. */
    plate.points[1][0] = 0.01;
    plate.points[1][1] = 0.18;
    plate.points[1][2] = 0.14;
    for (int side = 0; side < 2; ++side) {
        if (add_solid(world, ISOCOAT_LINK_HOST, &plate, side ? START : -START, 0.3, &plates[side])) return 1;
    }
    return 0;
}

static int add_clay(isocoat_world *world, double fusion_threshold, isocoat_body *clay, size_t *half, size_t *count)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    body_desc.stiffness_scale = 2e4;
    body_desc.friction = 0.3;
    body_desc.static_friction = 0.3;
    CHECK(isocoat_body_create(world, &body_desc, clay));
    isocoat_substance_desc desc = isocoat_substance_desc_default();
    desc.spacing = SPACING;
    /* Of the density of water; a pair is stiff enough for a lump two hundred particles high. */
    desc.particle_mass = 1000.0 * SPACING * SPACING * SPACING / sqrt(2.0);
    desc.cohesion = 200.0 * desc.particle_mass * GRAVITY * SPACING;
    desc.fusion_threshold = fusion_threshold;
    CHECK(isocoat_body_make_substance(world, *clay, &desc));
    for (int side = 0; side < 2; ++side) {
        const double center[3] = {side ? 0.18 : -0.18, 0.0, RADIUS + 0.005};
        CHECK(isocoat_substance_fill_ball(world, *clay, center, RADIUS, side ? count : half));
    }
    *count += *half;
    return 0;
}

/* Where the plates are, and how fast: they close, wait, and open. */
static int move_plates(isocoat_world *world, const isocoat_link plates[2], double time)
{
    const double closed = START - SPEED * CLOSED;
    double x = START - SPEED * time, speed = -SPEED;
    if (time >= CLOSED) {
        x = closed;
        speed = 0.0;
    }
    if (time >= RELEASED) {
        x = closed + SPEED * (time - RELEASED);
        speed = SPEED;
    }
    for (int side = 0; side < 2; ++side) {
        const double way = side ? 1.0 : -1.0;
        const isocoat_pose pose = {{way * x, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}};
        const isocoat_link_state state = {pose, {way * speed, 0.0, 0.0}, {0.0, 0.0, 0.0}};
        CHECK(isocoat_link_set_state(world, plates[side], &state));
    }
    return 0;
}

/* Pulls at the particles of both ends, as hands would; PULL is the force on each end over the weight of a lump. */
static const double PULL = 1.5;
static int pull(isocoat_world *world, isocoat_body clay, const isocoat_particle *names, const double *places,
                size_t half, size_t count)
{
    isocoat_substance_desc desc = isocoat_substance_desc_default();
    CHECK(isocoat_substance_get_desc(world, clay, &desc));
    for (int side = 0; side < 2; ++side) {
        const size_t first = side ? half : 0, end = side ? count : half;
        double middle = 0.0;
        size_t outer = 0;
        for (size_t i = first; i < end; ++i) middle += places[3 * i] / (double)(end - first);
        for (size_t i = first; i < end; ++i) outer += side ? places[3 * i] > middle : places[3 * i] < middle;
        const double weight = (double)(end - first) * desc.particle_mass * GRAVITY;
        const double force[3] = {(side ? PULL : -PULL) * weight / (double)outer, 0.0, 0.0};
        for (size_t i = first; i < end; ++i) {
            if (side ? places[3 * i] > middle : places[3 * i] < middle) {
                CHECK(isocoat_substance_add_forces(world, clay, &names[i], force, 1));
            }
        }
    }
    return 0;
}

/* What the table shows. */
typedef struct figures {
    size_t pieces, bonds, labels;
    double volume, pressed;
} figures;

static int measure(const isocoat_world *world, isocoat_body clay, const isocoat_link plates[2], const uint32_t *labels,
                   size_t count, figures *now)
{
    const isocoat_change *changes;
    const isocoat_particle *changed;
    size_t change_count;
    CHECK(isocoat_substance_get_pieces(world, clay, NULL, 0, &now->pieces));
    CHECK(isocoat_world_get_substance_changes(world, &changes, &change_count, &changed));
    for (size_t i = 0; i < change_count; ++i) now->bonds += changes[i].kind == ISOCOAT_CHANGE_FUSED;
    now->labels = 1;
    for (size_t i = 1; i < count; ++i) now->labels += labels[i] != labels[i - 1];
    CHECK(isocoat_body_get_volume(world, clay, &now->volume));
    isocoat_wrench wrench;
    CHECK(isocoat_link_get_wrench(world, plates[1], &wrench));
    now->pressed = wrench.force[0];
    return 0;
}

static int run(const char *name, double fusion_threshold, const char *folder, size_t *pieces)
{
    isocoat_world_desc world_desc = isocoat_world_desc_default();
    world_desc.gravity[2] = -GRAVITY;
    isocoat_world *world = NULL;
    CHECK(isocoat_world_create(&world_desc, &world));
    isocoat_link plates[2];
    isocoat_body clay;
    size_t half = 0, count = 0;
    if (add_solids(world, plates) || add_clay(world, fusion_threshold, &clay, &half, &count)) return 1;
    isocoat_particle *names = malloc(count * sizeof *names);
    double *places = malloc(3 * count * sizeof *places);
    uint32_t *labels = malloc(count * sizeof *labels);
    const isocoat_buffer positions = {places, 0, ISOCOAT_FORMAT_F64}, none = {NULL, 0, ISOCOAT_FORMAT_F64};
    if (!names || !places || !labels) return 1;

    printf("%s: two lumps of %d and %d particles, threshold %g Pa\n", name, (int)half, (int)(count - half),
           fusion_threshold);
    printf("time [s]  on a plate [N]  volume [l]  pairs that fused  pieces  labels\n");
    figures now = {0, 0, 0, 0.0, 0.0};
    for (int tick = 0;; ++tick) {
        const double time = tick * STEP;
        CHECK(isocoat_substance_get_particles(world, clay, names, positions, none, NULL, NULL, labels, count, &count));
        if (measure(world, clay, plates, labels, count, &now)) return 1;
        if (tick % 15 == 0) {
            printf("%8.2f %15.2f %11.3f %17d %7d %7d\n", time, now.pressed, 1e3 * now.volume, (int)now.bonds,
                   (int)now.pieces, (int)now.labels);
        }
        if (folder && tick % 20 == 0) {
            const picture_view view = {{0.5, -1.6, 0.9}, {0.0, 0.0, 0.08}, {0.0, 0.0, 1.0}, 1.1};
            char path[512];
            snprintf(path, sizeof path, "%s/%s%02d.ppm", folder, name, tick / 20);
            if (picture_write(world, &view, UINT64_MAX, 480, 320, path)) return 1;
        }
        if (tick == (int)lround(END / STEP)) break;
        if (move_plates(world, plates, time)) return 1;
        if (time >= RELEASED && pull(world, clay, names, places, half, count)) return 1;
        CHECK(isocoat_world_step(world, STEP));
    }
    *pieces = now.pieces;
    free(labels);
    free(places);
    free(names);
    isocoat_world_destroy(world);
    return 0;
}

int main(int count, char **arguments)
{
    const char *folder = count > 1 ? arguments[1] : NULL;
    size_t fused = 0, apart = 0;
    if (run("fused", 300.0, folder, &fused) || run("apart", INFINITY, folder, &apart)) return 1;
    printf("%d piece(s) with a threshold that is met, %d without\n", (int)fused, (int)apart);
    return fused == 1 && apart == 2 ? 0 : 1;
}
