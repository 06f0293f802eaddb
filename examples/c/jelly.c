/*
 * A cube of jelly falls on its corner: 64 point masses, each with a coat, held together by springs along edges and
 * across faces and cells. With a folder as argument it leaves pictures there, with --record FILE a recording. Exits 0
 * when there is never more energy than at the start, when the cube lies still in the end with the ground carrying its
 * weight, and when no edge is off by 5 % then.
 */
#include <isocoat/isocoat.h>

#include "../common/check.h"
#include "../common/picture.h"
#include "../common/record.h"

#include <stdio.h>

#define SIDE 4
#define MASSES (SIDE * SIDE * SIDE)
/* More than the 144 edges, 216 diagonals of faces and 108 of cells. */
#define MOST_SPRINGS 512
static const double GRAVITY = 9.81, STEP = 1.0 / 60.0, SECONDS = 3.0, SPACING = 0.1, MASS = 0.02;

typedef struct jelly {
    isocoat_body body;
    isocoat_link masses[MASSES];
    isocoat_spring springs[MOST_SPRINGS];
    double lengths[MOST_SPRINGS];
    size_t spring_count;
} jelly;

static int add_ground(isocoat_world *world)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    body_desc.kind = ISOCOAT_BODY_RIGID;
    body_desc.friction = 0.4;
    body_desc.static_friction = 0.5;
    isocoat_body body;
    CHECK(isocoat_body_create(world, &body_desc, &body));
    const isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_link link;
    CHECK(isocoat_link_create(world, body, &link_desc, &link));
    /* A plane's surface lies above it by the thickness of its coat. */
    isocoat_skeleton_desc shape = isocoat_skeleton_desc_default();
    shape.shape = ISOCOAT_SHAPE_PLANE;
    shape.points[0][2] = -shape.thickness;
    shape.points[1][2] = 1.0;
    isocoat_skeleton skeleton;
    CHECK(isocoat_skeleton_create(world, link, &shape, &skeleton));
    return 0;
}

static int add_jelly(isocoat_world *world, jelly *cube)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    body_desc.stiffness_scale = 5e4;
    body_desc.friction = 0.4;
    body_desc.static_friction = 0.5;
    body_desc.dissipation = 1.0;
    CHECK(isocoat_body_create(world, &body_desc, &cube->body));

    /* The axes of a cube that stands on its corner, near enough to one in balance that it has to topple. */
    double x[3] = {0.72, 0.41, 0.56}, y[3] = {-0.70, 0.42, 0.58}, z[3], places[MASSES][3];
    picture_normalise(x);
    picture_cross(x, y, z);
    picture_normalise(z);
    picture_cross(z, x, y);
    for (int index = 0; index < MASSES; ++index) {
        const int column = index % SIDE, row = index / SIDE % SIDE, layer = index / SIDE / SIDE;
        isocoat_link_desc link_desc = isocoat_link_desc_default();
        link_desc.kind = ISOCOAT_LINK_POINT_MASS;
        link_desc.mass = MASS;
        for (int k = 0; k < 3; ++k) {
            places[index][k] = SPACING * (column * x[k] + row * y[k] + layer * z[k]) + (k == 2 ? 0.3 : 0.0);
            link_desc.pose.position[k] = places[index][k];
        }
        CHECK(isocoat_link_create(world, cube->body, &link_desc, &cube->masses[index]));
        /* It reaches as far as the next mass, so that it blends with its neighbours into one skin. */
        isocoat_skeleton_desc shape = isocoat_skeleton_desc_default();
        shape.thickness = 0.5 * SPACING;
        shape.radius = SPACING;
        isocoat_skeleton skeleton;
        CHECK(isocoat_skeleton_create(world, cube->masses[index], &shape, &skeleton));
    }

    isocoat_spring_desc descs[MOST_SPRINGS];
    cube->spring_count = 0;
    for (int i = 0; i < MASSES; ++i) {
        for (int j = 0; j < i; ++j) {
            double line[3];
            for (int k = 0; k < 3; ++k) line[k] = places[i][k] - places[j][k];
            const double length = sqrt(picture_dot(line, line));
            /* Up to the diagonal of a cell, 1.73 spacings; the next is along two edges. */
            if (length < 1.8 * SPACING) {
                isocoat_spring_desc *desc = &descs[cube->spring_count];
                *desc = isocoat_spring_desc_default();
                desc->links[0] = cube->masses[j];
                desc->links[1] = cube->masses[i];
                desc->rest_length = length;
                desc->stiffness = 300.0;
                desc->damping = 0.5;
                cube->lengths[cube->spring_count++] = length;
            }
        }
    }
    CHECK(isocoat_spring_create_many(world, descs, cube->spring_count, cube->springs));
    return 0;
}

/* What the table shows. */
typedef struct figures {
    double energy, height, fastest, strain, carried;
} figures;

static int measure(const isocoat_world *world, const jelly *cube, figures *now)
{
    const figures none = {0.0, 0.0, 0.0, 0.0, 0.0};
    *now = none;
    for (int index = 0; index < MASSES; ++index) {
        isocoat_link_state state;
        isocoat_wrench wrench;
        CHECK(isocoat_link_get_state(world, cube->masses[index], &state));
        CHECK(isocoat_link_get_wrench(world, cube->masses[index], &wrench));
        const double square = picture_dot(state.linear_velocity, state.linear_velocity);
        now->energy += MASS * (0.5 * square + GRAVITY * state.pose.position[2]);
        now->height += state.pose.position[2] / MASSES;
        now->fastest = fmax(now->fastest, sqrt(square));
        /* What springs pull on one mass they pull on another: what remains is the ground's. */
        now->carried += wrench.force[2] / (MASSES * MASS * GRAVITY);
    }
    for (size_t index = 0; index < cube->spring_count; ++index) {
        isocoat_spring_state state;
        CHECK(isocoat_spring_get_state(world, cube->springs[index], &state));
        now->energy += state.energy;
        if (cube->lengths[index] < 1.1 * SPACING) {
            now->strain = fmax(now->strain, fabs(state.length / cube->lengths[index] - 1.0));
        }
    }
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
    jelly cube;
    figures now;
    if (add_ground(world) || add_jelly(world, &cube) || measure(world, &cube, &now)) return 1;
    const double start = now.energy;
    double highest = start, most = 0.0;
    printf("%d masses, %d springs\n", MASSES, (int)cube.spring_count);
    printf("time [s]  energy [J]  height [m]  fastest [m/s]  carried/weight  edges off by [%%]\n");
    for (int tick = 0;; ++tick) {
        if (tick % 20 == 0) {
            printf("%8.2f %11.4f %11.4f %14.4f %15.4f %17.2f\n", tick * STEP, now.energy, now.height, now.fastest,
                   now.carried, 100.0 * now.strain);
        }
        if (count > 1 && tick % 5 == 0 && tick < 100) {
            const picture_view view = {{1.4, -2.0, 1.5}, {0.05, 0.1, 0.3}, {0.0, 0.0, 1.0}, 1.2};
            char path[512];
            snprintf(path, sizeof path, "%s/jelly%02d.ppm", arguments[1], tick / 5);
            if (picture_write(world, &view, UINT64_MAX, 320, 320, path)) return 1;
        }
        if (record_frame(&film, world, tick * STEP)) return 1;
        if (tick == (int)lround(SECONDS / STEP)) break;
        CHECK(isocoat_world_step(world, STEP));
        if (measure(world, &cube, &now)) return 1;
        highest = fmax(highest, now.energy);
        most = fmax(most, now.strain);
    }
    printf("energy %.4f J at first, never above %.4f J; edges off by up to %.1f %% on the way, %.1f %% at rest\n",
           start, highest, 100.0 * most, 100.0 * now.strain);
    if (record_end(&film)) return 1;
    isocoat_world_destroy(world);
    return highest <= start * (1.0 + 1e-9) && now.fastest < 1e-3 && fabs(now.carried - 1.0) < 1e-2 && now.strain < 0.05
               ? 0
               : 1;
}
