/*
 * A mesh in, a coat out: a closed mesh of triangles becomes a body of points, which falls on a floor. The mesh is that of
 * a ring, or of the Wavefront file (.obj, triangles alone) that is the first argument. With a folder as another argument
 * it leaves pictures there; --record FILE records the fall. Exits 0 when the coat of the ring is within 0.5 % of the
 * diagonal from the mesh on average, and the floor holds it.
 */
#include <isocoat/isocoat.h>

#include "../common/check.h"
#include "../common/picture.h"
#include "../common/record.h"

enum { MOST_SKELETONS = 200, AROUND = 48, ACROSS = 24, FRAMES = 60, MOST = 100000 };
#define TURN 6.283185307179586

typedef struct mesh {
    double vertices[3 * MOST];
    uint32_t triangles[3 * MOST];
    size_t vertex_count, triangle_count;
} mesh;

static void make_ring(mesh *it)
{
    uint32_t *corner = it->triangles;
    for (uint32_t i = 0; i < AROUND; ++i) {
        for (uint32_t j = 0; j < ACROSS; ++j) {
            const double u = TURN * i / AROUND, v = TURN * j / ACROSS, radius = 0.35 + 0.12 * cos(v);
            const uint32_t a = i * ACROSS + j, b = i * ACROSS + (j + 1) % ACROSS, next = (i + 1) % AROUND * ACROSS;
            const uint32_t c = next + j, d = next + (j + 1) % ACROSS, quad[6] = {a, c, d, a, d, b};
            double *p = it->vertices + 3 * a;
            p[0] = radius * cos(u);
            p[1] = radius * sin(u);
            p[2] = 0.12 * sin(v);
            for (int k = 0; k < 6; ++k) *corner++ = quad[k];
        }
    }
    it->vertex_count = AROUND * ACROSS;
    it->triangle_count = 2 * AROUND * ACROSS;
}

/* The y axis of such files points up; the mesh is made 1 m large, with the middle of its bounds at the origin. */
static int read_mesh(mesh *it, const char *path)
{
    FILE *file = fopen(path, "r");
    char line[256];
    double low[3] = {INFINITY, INFINITY, INFINITY}, high[3] = {-INFINITY, -INFINITY, -INFINITY}, size = 0.0;
    while (file && fgets(line, sizeof line, file) && it->vertex_count < MOST && it->triangle_count < MOST) {
        double *p = it->vertices + 3 * it->vertex_count;
        uint32_t *t = it->triangles + 3 * it->triangle_count;
        if (sscanf(line, "v %lf %lf %lf", p, p + 2, p + 1) == 3) {
            p[1] = -p[1];
            for (int k = 0; k < 3; ++k) {
                low[k] = fmin(low[k], p[k]);
                high[k] = fmax(high[k], p[k]);
            }
            ++it->vertex_count;
        } else if (sscanf(line, "f %u%*[^ ] %u%*[^ ] %u", t, t + 1, t + 2) == 3 ||
                   sscanf(line, "f %u %u %u", t, t + 1, t + 2) == 3) {
            for (int k = 0; k < 3; ++k) --t[k];
            ++it->triangle_count;
        }
    }
    if (!file || fclose(file) != 0 || it->triangle_count == 0) {
        fprintf(stderr, "%s: no mesh of triangles\n", path);
        return 1;
    }
    for (int k = 0; k < 3; ++k) size = fmax(size, high[k] - low[k]);
    for (size_t at = 0; at < 3 * it->vertex_count; ++at) {
        it->vertices[at] = (it->vertices[at] - 0.5 * (low[at % 3] + high[at % 3])) / size;
    }
    return 0;
}

static int make_body(isocoat_world *world, const mesh *from, uint32_t count, isocoat_link *link, double *off)
{
    static isocoat_skeleton_desc skeletons[MOST_SKELETONS];
    const isocoat_const_buffer vertices = {from->vertices, 0, ISOCOAT_FORMAT_F64}, none = {NULL, 0, ISOCOAT_FORMAT_F64};
    isocoat_fit_desc fit = isocoat_fit_desc_default();
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_fit_distance distance;
    isocoat_body body;
    fit.count = count;
    skeletons[0] = isocoat_skeleton_desc_default();
    CHECK(isocoat_fit_mesh(&fit, vertices, from->vertex_count, from->triangles, from->triangle_count, NULL, none, 0,
                           skeletons, NULL, count, &distance));
    *off = distance.mean / distance.diagonal;
    printf("%u points: %.3f %% of the diagonal from the mesh on average, %.2f %% at most\n", count, 100.0 * *off,
           100.0 * distance.maximum / distance.diagonal);

    body_desc.friction = 0.6;
    body_desc.dissipation = 0.3;
    body_desc.stiffness_scale = 2e4;
    CHECK(isocoat_body_create(world, &body_desc, &body));
    link_desc.kind = ISOCOAT_LINK_RIGID;
    link_desc.mass = 20.0;
    CHECK(isocoat_inertia_of_sphere(link_desc.mass, 0.4, link_desc.inertia));
    link_desc.pose.position[2] = 0.6;
    /* A little on its side. */
    link_desc.pose.orientation[1] = sin(0.3);
    link_desc.pose.orientation[3] = cos(0.3);
    CHECK(isocoat_link_create(world, body, &link_desc, link));
    CHECK(isocoat_skeleton_create_many(world, link, 1, skeletons, NULL, count, NULL, NULL));
    return 0;
}

/* A half-space whose surface is at height 0. */
static int make_floor(isocoat_world *world)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
    isocoat_body body;
    isocoat_link link;
    isocoat_skeleton made;
    body_desc.kind = ISOCOAT_BODY_RIGID;
    body_desc.friction = 0.6;
    link_desc.pose.position[2] = -desc.thickness;
    desc.shape = ISOCOAT_SHAPE_PLANE;
    desc.points[1][2] = 1.0;
    CHECK(isocoat_body_create(world, &body_desc, &body));
    CHECK(isocoat_link_create(world, body, &link_desc, &link));
    CHECK(isocoat_skeleton_create(world, link, &desc, &made));
    return 0;
}

int main(int count, char **arguments)
{
    static mesh from;
    const char *record = record_argument(&count, arguments);
    const char *end = count > 1 ? strrchr(arguments[1], '.') : NULL;
    const int is_mesh = end && strcmp(end, ".obj") == 0;
    const char *folder = count > 1 + is_mesh ? arguments[1 + is_mesh] : NULL;
    isocoat_world_desc desc = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    isocoat_link link;
    isocoat_link_state state;
    recording film;
    double off = 1.0;
    /* The mesh of a file is there to be looked at: 200 points on a floor take long. */
    const int frames = is_mesh ? 6 : FRAMES;
    if (is_mesh) {
        if (read_mesh(&from, arguments[1])) return 1;
    } else {
        make_ring(&from);
    }
    desc.gravity[2] = -9.81;
    /* Cheap where many small skeletons blend: one sum over rays, whatever the shape of the contact, and no sub-steps. */
    desc.scheme = ISOCOAT_SCHEME_SEEDS;
    desc.response = ISOCOAT_RESPONSE_IMPLICIT;
    CHECK(isocoat_world_create(&desc, &world));
    if (make_floor(world) || make_body(world, &from, is_mesh ? MOST_SKELETONS : 40, &link, &off)) return 1;
    if (record_begin(&film, record)) return 1;
    for (int frame = 0; frame <= frames; ++frame) {
        if (folder && frame % 20 == 0) {
            const picture_view view = {{1.0, -2.2, 1.2}, {0.0, 0.0, 0.4}, {0.0, 0.0, 1.0}, 1.9};
            char path[512];
            snprintf(path, sizeof path, "%s/fit%03d.ppm", folder, frame);
            if (picture_write(world, &view, UINT64_MAX, 320, 280, path)) return 1;
        }
        if (record_frame(&film, world, frame / 60.0)) return 1;
        CHECK(isocoat_world_step(world, 1.0 / 60.0));
    }
    CHECK(isocoat_link_get_state(world, link, &state));
    printf("after %.1f s at height %.3f m, at %.3f m/s\n", frames / 60.0, state.pose.position[2], state.linear_velocity[2]);
    if (record_end(&film)) return 1;
    isocoat_world_destroy(world);
    return off < (is_mesh ? 1e-2 : 5e-3) && state.pose.position[2] > 0.08 && state.pose.position[2] < 0.6 ? 0 : 1;
}
