/* Coats from meshes: fitted, created on their links, and refused. */
#include "check.h"

enum { COUNT = 8, TRIANGLES = 12 };
static const isocoat_const_buffer none = {NULL, 0, ISOCOAT_FORMAT_F64};

/* A cuboid of 1 x 0.5 x 0.5 m with a corner at the origin; its vertices between other numbers, in single precision. */
typedef struct vertex {
    float colour, position[3];
} vertex;

static vertex mesh[COUNT];
static uint32_t triangles[3 * TRIANGLES];

static isocoat_const_buffer make_mesh(void)
{
    static const uint32_t sides[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};
    isocoat_const_buffer buffer;
    int k, at;
    for (k = 0; k < COUNT; ++k) {
        mesh[k].position[0] = k & 1 ? 1.0f : 0.0f;
        mesh[k].position[1] = k & 2 ? 0.5f : 0.0f;
        mesh[k].position[2] = k & 4 ? 0.5f : 0.0f;
    }
    for (k = 0; k < 6; ++k) {
        for (at = 0; at < 3; ++at) {
            triangles[6 * k + at] = sides[k][at];
            triangles[6 * k + 3 + at] = sides[k][(at + 2) % 4];
        }
    }
    buffer.data = mesh[0].position;
    buffer.stride = sizeof(vertex);
    buffer.format = ISOCOAT_FORMAT_F32;
    return buffer;
}

static isocoat_status fit(const isocoat_fit_desc *desc, isocoat_skeleton_desc *skeletons, size_t capacity,
                          isocoat_fit_distance *distance)
{
    return isocoat_fit_mesh(desc, make_mesh(), COUNT, triangles, TRIANGLES, NULL, none, 0, skeletons, NULL, capacity,
                            distance);
}

static void a_fit_becomes_a_coat(void)
{
    isocoat_world *world = new_world();
    const isocoat_body body = new_body(world);
    const isocoat_link link = new_link(world, body, ISOCOAT_LINK_HOST, 2.0);
    isocoat_fit_desc desc = isocoat_fit_desc_default();
    isocoat_skeleton_desc made[20];
    isocoat_skeleton skeletons[20], listed[20];
    isocoat_fit_distance distance;
    isocoat_pose frame;
    isocoat_link_state state;
    VEC(inside, 0.5, 0.25, 2.25);
    VEC(outside, 0.5, 0.25, 1.9);
    size_t count = 0;
    double values[2];

    CHECK(desc.shape == ISOCOAT_SHAPE_POINT && desc.count == 64 && desc.width == 0.0);
    desc.count = 20;
    made[0] = isocoat_skeleton_desc_default();
    OK(fit(&desc, made, 20, &distance));
    CHECK_NEAR(distance.diagonal, sqrt(1.5), 1e-6);
    CHECK(distance.mean > 0.0 && distance.mean < 0.02 * distance.diagonal && distance.maximum > distance.mean);
    CHECK(made[19].struct_size == sizeof made[0] && made[19].shape == ISOCOAT_SHAPE_POINT);
    CHECK_NEAR(made[19].radius - made[19].thickness, made[0].radius - made[0].thickness, 1e-12);

    /* Without a frame they are in that of the link, 2 m up. */
    OK(isocoat_skeleton_create_many(world, &link, 1, made, NULL, 20, NULL, skeletons));
    OK(isocoat_link_get_skeletons(world, link, listed, 20, &count));
    CHECK(count == 20 && same_skeleton(listed[7], skeletons[7]));
    OK(isocoat_body_evaluate_field(world, body, inside, 1, &values[0], NULL));
    OK(isocoat_body_evaluate_field(world, body, outside, 1, &values[1], NULL));
    CHECK(values[0] > 1.0 && values[1] < 1.0);

    /* Given in the world, at their link's own pose: the same place. */
    OK(isocoat_link_get_state(world, link, &state));
    frame = state.pose;
    OK(isocoat_skeleton_create_many(world, &link, 1, made, NULL, 1, &frame, skeletons));
    OK(isocoat_skeleton_get_desc(world, skeletons[0], &made[1]));
    CHECK_NEAR(made[1].points[0][2], made[0].points[0][2], 1e-12);
    isocoat_world_destroy(world);
}

static void bones_have_their_own(void)
{
    isocoat_world *world = new_world();
    const isocoat_body body = new_body(world);
    isocoat_link links[2];
    isocoat_fit_desc desc = isocoat_fit_desc_default();
    isocoat_skeleton_desc made[12];
    uint32_t bones[COUNT], of[12];
    double ones[COUNT];
    isocoat_const_buffer weights = none;
    const isocoat_const_buffer vertices = make_mesh();
    size_t count[2] = {0, 0};
    int k;

    for (k = 0; k < COUNT; ++k) {
        bones[k] = mesh[k].position[0] > 0.5f;
        ones[k] = 1.0;
    }
    weights.data = ones;
    desc.count = 12;
    desc.shape = ISOCOAT_SHAPE_SEGMENT;
    made[0] = isocoat_skeleton_desc_default();
    OK(isocoat_fit_mesh(&desc, vertices, COUNT, triangles, TRIANGLES, bones, weights, 1, made, of, 12, NULL));
    for (k = 0; k < 12; ++k) CHECK(of[k] < 2 && (made[k].points[0][0] > 0.5 - 0.1) >= (of[k] == 1));
    for (k = 0; k < 2; ++k) links[k] = new_link(world, body, ISOCOAT_LINK_HOST, 0.0);
    OK(isocoat_skeleton_create_many(world, links, 2, made, of, 12, NULL, NULL));
    for (k = 0; k < 2; ++k) OK(isocoat_link_get_skeletons(world, links[k], NULL, 0, &count[k]));
    CHECK(count[0] + count[1] == 12 && count[0] > 3 && count[1] > 3);
    REFUSED(isocoat_skeleton_create_many(world, links, 1, made, of, 12, NULL, NULL), ISOCOAT_ERROR_OUT_OF_RANGE,
            "must be less than link_count, 1");

    ones[3] = -1.0;
    REFUSED(isocoat_fit_mesh(&desc, vertices, COUNT, triangles, TRIANGLES, bones, weights, 1, made, of, 12, NULL),
            ISOCOAT_ERROR_OUT_OF_RANGE, "weight of a bone is -1 (vertex 3)");
    REFUSED(isocoat_fit_mesh(&desc, vertices, COUNT, triangles, TRIANGLES, bones, none, 1, made, of, 12, NULL),
            ISOCOAT_ERROR_INVALID_ARGUMENT, "weights.data is NULL");
    REFUSED(isocoat_fit_mesh(&desc, vertices, COUNT, triangles, TRIANGLES, bones, weights, 0, made, of, 12, NULL),
            ISOCOAT_ERROR_OUT_OF_RANGE, "bones per vertex is 0; must be at least 1");
    isocoat_world_destroy(world);
}

static void of_many_the_refused_one_is_named_and_none_is_made(void)
{
    isocoat_world *world = new_world();
    const isocoat_link host = new_link(world, new_body(world), ISOCOAT_LINK_HOST, 0.0);
    const isocoat_link links[2] = {host, {0, 0, 0}};
    isocoat_skeleton_desc row[20];
    isocoat_skeleton made[20] = {{9, 9, 9}};
    uint32_t of[20] = {0};
    isocoat_pose frame = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}};
    size_t count = 1;
    int k;

    for (k = 0; k < 20; ++k) row[k] = isocoat_skeleton_desc_default(), row[k].thickness = 0.1;
    row[17].thickness = -1.0;
    REFUSED(isocoat_skeleton_create_many(world, links, 2, row, of, 20, NULL, made), ISOCOAT_ERROR_OUT_OF_RANGE,
            "descs[17]: thickness is -1; must be");
    REFUSED(isocoat_skeleton_create_many(world, links, 2, row, of, 20, &frame, made), ISOCOAT_ERROR_OUT_OF_RANGE,
            "descs[17]: thickness is -1; must be");
    row[17].thickness = 0.1, row[3].shape = ISOCOAT_SHAPE_PLANE, row[3].points[1][2] = 1.0;
    REFUSED(isocoat_skeleton_create_many(world, links, 2, row, of, 20, NULL, made), ISOCOAT_ERROR_UNSUPPORTED,
            "descs[3]: ");
    row[3] = row[0], row[5].shape = 99;
    REFUSED(isocoat_skeleton_create_many(world, links, 2, row, of, 20, NULL, made), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "descs[5]: shape is 99");
    row[5] = row[0], of[11] = 1;
    REFUSED(isocoat_skeleton_create_many(world, links, 2, row, of, 20, NULL, made), ISOCOAT_ERROR_INVALID_HANDLE,
            "descs[11]: link: the handle is null");
    of[11] = 0, frame.orientation[3] = 2.0;
    REFUSED(isocoat_skeleton_create_many(world, links, 2, row, of, 20, &frame, made), ISOCOAT_ERROR_OUT_OF_RANGE,
            "norm of the rotation quaternion is 2");
    OK(isocoat_link_get_skeletons(world, host, NULL, 0, &count));
    CHECK(count == 0 && made[0].index == 9);
    OK(isocoat_skeleton_create_many(world, links, 2, row, of, 20, NULL, made));
    isocoat_world_destroy(world);
}

static void what_cannot_be_is_refused(void)
{
    isocoat_fit_desc desc = isocoat_fit_desc_default();
    isocoat_skeleton_desc made[64];
    const isocoat_const_buffer vertices = make_mesh();

    made[0] = isocoat_skeleton_desc_default();
    made[0].thickness = -7.0;
    REFUSED(fit(NULL, made, 64, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "desc is NULL");
    REFUSED(fit(&desc, NULL, 64, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "skeletons is NULL");
    REFUSED(fit(&desc, made, 63, NULL), ISOCOAT_ERROR_BUFFER_TOO_SMALL, "capacity is 63; must be at least 64");
    REFUSED(isocoat_fit_mesh(&desc, none, COUNT, triangles, TRIANGLES, NULL, none, 0, made, NULL, 64, NULL),
            ISOCOAT_ERROR_INVALID_ARGUMENT, "vertices.data is NULL");
    REFUSED(isocoat_fit_mesh(&desc, vertices, COUNT, triangles, TRIANGLES - 1, NULL, none, 0, made, NULL, 64, NULL),
            ISOCOAT_ERROR_OUT_OF_RANGE, "an edge of the mesh is run");
    REFUSED(isocoat_fit_mesh(&desc, vertices, COUNT, triangles, 0, NULL, none, 0, made, NULL, 64, NULL),
            ISOCOAT_ERROR_UNSUPPORTED, "no triangles");
    desc.count = 0;
    REFUSED(fit(&desc, made, 64, NULL), ISOCOAT_ERROR_OUT_OF_RANGE, "count is 0; must be from 1 to 4096");
    desc.count = 4;
    desc.shape = ISOCOAT_SHAPE_BOX;
    REFUSED(fit(&desc, made, 64, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "shape is 3");
    desc.shape = ISOCOAT_SHAPE_POINT;
    desc.width = -1.0;
    REFUSED(fit(&desc, made, 64, NULL), ISOCOAT_ERROR_OUT_OF_RANGE, "width over the diagonal of the mesh is -");
    made[0].struct_size = 0;
    REFUSED(fit(&desc, made, 64, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "struct_size of isocoat_skeleton_desc is 0");
    CHECK(made[0].thickness == -7.0);
}

int main(void)
{
    a_fit_becomes_a_coat();
    bones_have_their_own();
    of_many_the_refused_one_is_named_and_none_is_made();
    what_cannot_be_is_refused();
    return verdict("fit");
}
