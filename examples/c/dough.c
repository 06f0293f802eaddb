/*
 * Two lumps of clay on a table are pressed together by two plates that the host drives, held for a while, and pulled
 * apart again by their ends. Where the pressure between them is above the threshold of the clay, they fuse little by
 * little and are one lump; with a threshold that is never met they only lean on each other. Both are shown. With a
 * folder as argument it leaves pictures there, with --record FILE a recording. Exits 0 when the first is one piece in
 * the end and the second two.
 */
#include <isocoat/isocoat.h>

#include "../common/check.h"
#include "../common/picture.h"
#include "../common/record.h"

#include <stdio.h>
#include <stdlib.h>

static const double GRAVITY = 9.81, STEP = 1.0 / 60.0, SPACING = 0.05;
/* Half the size of a lump, and where their middles are at first. */
static const double HALF[3] = {0.12, 0.1, 0.1}, MIDDLE = 0.16;
/* When the plates stop, when they let go, and when the pull ends, in s; where they begin, and how fast they are. */
static const double CLOSED = 1.0, RELEASED = 2.0, END = 4.0, START = 0.36, SPEED = 0.16;
/* Force on each end over the weight of a lump. */
static const double PULL = 1.0;

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
    body_desc.dissipation = 2.0;
    CHECK(isocoat_body_create(world, &body_desc, clay));
    isocoat_substance_desc desc = isocoat_substance_desc_default();
    desc.spacing = SPACING;
    /* Of the density of water; stiff enough for a lump some hundred particles high. */
    desc.particle_mass = 1000.0 * SPACING * SPACING * SPACING / sqrt(2.0);
    desc.cohesion = 100.0 * desc.particle_mass * GRAVITY * SPACING;
    desc.damping = 1.0;
    desc.fusion_threshold = fusion_threshold;
    CHECK(isocoat_body_make_substance(world, *clay, &desc));
    for (int side = 0; side < 2; ++side) {
        double low[3], high[3];
        for (int axis = 0; axis < 3; ++axis) {
            const double middle = axis == 0 ? (side ? MIDDLE : -MIDDLE) : axis == 2 ? HALF[2] + 0.005 : 0.0;
            low[axis] = middle - HALF[axis];
            high[axis] = middle + HALF[axis];
        }
        CHECK(isocoat_substance_fill_box(world, *clay, low, high, side ? count : half));
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

/* Pulls at the outer half of each lump as a hand would, that gives way when the lump comes along. */
static int pull(isocoat_world *world, isocoat_body clay, const isocoat_particle *names, const double *places,
                const double *speeds, size_t half, size_t count)
{
    isocoat_substance_desc desc = isocoat_substance_desc_default();
    CHECK(isocoat_substance_get_desc(world, clay, &desc));
    for (int side = 0; side < 2; ++side) {
        const size_t first = side ? half : 0, end = side ? count : half;
        const double way = side ? 1.0 : -1.0, number = (double)(end - first);
        double middle = 0.0, speed = 0.0, outer = 0.0;
        for (size_t i = first; i < end; ++i) {
            middle += places[3 * i] / number;
            speed += way * speeds[3 * i] / number;
        }
        for (size_t i = first; i < end; ++i) outer += way * (places[3 * i] - middle) > 0.0;
        const double whole = PULL * number * desc.particle_mass * GRAVITY * fmax(1.0 - speed / SPEED, 0.0);
        const double force[3] = {way * whole / outer, 0.0, 0.0};
        for (size_t i = first; i < end; ++i) {
            if (way * (places[3 * i] - middle) > 0.0) {
                CHECK(isocoat_substance_add_forces(world, clay, &names[i], force, 1));
            }
        }
    }
    return 0;
}

/* What the table shows. */
typedef struct figures {
    size_t fusing, pieces;
    double volume, pressed;
} figures;

static int measure(const isocoat_world *world, isocoat_body clay, isocoat_link plate, figures *now)
{
    const isocoat_change *changes;
    const isocoat_particle *changed;
    size_t count;
    CHECK(isocoat_world_get_substance_changes(world, &changes, &count, &changed));
    for (size_t i = 0; i < count; ++i) now->fusing += changes[i].kind == ISOCOAT_CHANGE_FUSED;
    isocoat_piece pieces[16];
    CHECK(isocoat_substance_get_pieces(world, clay, pieces, 16, &now->pieces));
    now->volume = 0.0;
    for (size_t i = 0; i < now->pieces; ++i) now->volume += pieces[i].volume;
    isocoat_wrench wrench;
    CHECK(isocoat_link_get_wrench(world, plate, &wrench));
    now->pressed = wrench.force[0];
    return 0;
}

/* Gives the number of pieces in the end. */
static int run(const char *name, double fusion_threshold, const char *folder, const char *record, size_t *pieces)
{
    recording film;
    if (record_begin(&film, record)) return 1;
    isocoat_world_desc world_desc = isocoat_world_desc_default();
    world_desc.gravity[2] = -GRAVITY;
    isocoat_world *world = NULL;
    CHECK(isocoat_world_create(&world_desc, &world));
    isocoat_link plates[2];
    isocoat_body clay;
    size_t half = 0, count = 0;
    if (add_solids(world, plates) || add_clay(world, fusion_threshold, &clay, &half, &count)) return 1;
    isocoat_particle *names = malloc(count * sizeof *names);
    double *places = malloc(3 * count * sizeof *places), *speeds = malloc(3 * count * sizeof *speeds);
    const isocoat_buffer positions = {places, 0, ISOCOAT_FORMAT_F64}, velocities = {speeds, 0, ISOCOAT_FORMAT_F64};
    if (!names || !places || !speeds) return 1;

    printf("%s: two lumps of %d and %d particles, threshold %g Pa\n", name, (int)half, (int)(count - half),
           fusion_threshold);
    printf("time [s]  on a plate [N]  volume [l]  pairs that fused  pieces\n");
    figures now = {0, 0, 0.0, 0.0};
    for (int tick = 0;; ++tick) {
        const double time = tick * STEP;
        if (tick > 0 && measure(world, clay, plates[1], &now)) return 1;
        if (tick % 15 == 1) {
            printf("%8.2f %15.2f %11.3f %17d %7d\n", time, now.pressed, 1e3 * now.volume, (int)now.fusing,
                   (int)now.pieces);
        }
        if (folder && tick % 30 == 0) {
            const picture_view view = {{0.5, -1.6, 0.9}, {0.0, 0.0, 0.14}, {0.0, 0.0, 1.0}, 1.05};
            char path[512];
            snprintf(path, sizeof path, "%s/%s%02d.ppm", folder, name, tick / 30);
            if (picture_write(world, &view, UINT64_MAX, 320, 200, path)) return 1;
        }
        if (record_frame(&film, world, time)) return 1;
        if (tick == (int)lround(END / STEP)) break;
        if (move_plates(world, plates, time)) return 1;
        if (time >= RELEASED) {
            CHECK(isocoat_substance_get_particles(world, clay, names, positions, velocities, NULL, NULL, NULL, count,
                                                  &count));
            if (pull(world, clay, names, places, speeds, half, count)) return 1;
        }
        CHECK(isocoat_world_step(world, STEP));
    }
    *pieces = now.pieces;
    if (record_end(&film)) return 1;
    free(speeds);
    free(places);
    free(names);
    isocoat_world_destroy(world);
    return 0;
}

int main(int count, char **arguments)
{
    const char *record = record_argument(&count, arguments), *folder = count > 1 ? arguments[1] : NULL;
    size_t fused = 0, apart = 0;
    if (run("fused", 300.0, folder, record, &fused) || run("apart", INFINITY, folder, NULL, &apart)) return 1;
    printf("%d piece(s) with a threshold that is met, %d without\n", (int)fused, (int)apart);
    return fused == 1 && apart == 2 ? 0 : 1;
}
