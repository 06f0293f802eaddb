/* Meshes of bodies and territories. */
#include "check.h"

static isocoat_mesh *new_mesh(void)
{
    isocoat_mesh *mesh = NULL;
    OK(isocoat_mesh_create(&mesh));
    return mesh;
}

/* Six times the volume that triangles enclose. */
static double six_volumes(const isocoat_mesh_view *view)
{
    double sum = 0.0;
    size_t t;
    for (t = 0; t < view->triangle_count; ++t) {
        const double *a = view->positions + 3 * view->triangles[3 * t];
        const double *b = view->positions + 3 * view->triangles[3 * t + 1];
        const double *c = view->positions + 3 * view->triangles[3 * t + 2];
        sum += a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
               a[2] * (b[0] * c[1] - b[1] * c[0]);
    }
    return sum;
}

static void a_ball_has_a_closed_mesh(void)
{
    isocoat_world *world = new_world();
    const ball it = new_ball(world, ISOCOAT_LINK_FIXED, 0.5);
    isocoat_mesh *mesh = new_mesh();
    isocoat_mesh_desc desc = isocoat_mesh_desc_default();
    isocoat_mesh_view view;
    size_t v;

    OK(isocoat_mesh_get_view(mesh, &view));
    CHECK(view.vertex_count == 0 && view.triangle_count == 0);
    CHECK(desc.cell_size == 0.0 && desc.deformation == ISOCOAT_DEFORMATION_NONE);
    desc.cell_size = 0.1 / 8.0;
    OK(isocoat_body_make_mesh(world, it.body, &desc, mesh));
    OK(isocoat_mesh_get_view(mesh, &view));
    /* Euler: a sphere. */
    CHECK(view.triangle_count == 2 * view.vertex_count - 4);
    CHECK(view.valid == NULL);
    CHECK_NEAR(six_volumes(&view), 8.0 * PI * 1e-3, 0.01 * 8.0 * PI * 1e-3);
    for (v = 0; v < view.vertex_count; ++v) {
        const double *p = view.positions + 3 * v, *n = view.normals + 3 * v;
        CHECK_NEAR(sqrt(p[0] * p[0] + p[1] * p[1] + (p[2] - 0.5) * (p[2] - 0.5)), 0.1, 1e-4);
        CHECK_NEAR(p[0] * n[0] + p[1] * n[1] + (p[2] - 0.5) * n[2], 0.1, 1e-4);
    }
    OK(isocoat_mesh_destroy(mesh));
    isocoat_world_destroy(world);
}

static void a_mesh_is_copied_in_either_precision(void)
{
    isocoat_world *world = new_world();
    const ball it = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    isocoat_mesh *mesh = new_mesh();
    isocoat_mesh_desc desc = isocoat_mesh_desc_default();
    isocoat_mesh_view view;
    struct {
        float position[3], normal[3];
    } *vertices;
    uint32_t *triangles;
    isocoat_buffer positions, normals, none;
    size_t v;

    desc.cell_size = 0.05;
    OK(isocoat_body_make_mesh(world, it.body, &desc, mesh));
    OK(isocoat_mesh_get_view(mesh, &view));
    vertices = malloc(view.vertex_count * sizeof *vertices);
    triangles = malloc(view.triangle_count * 3 * sizeof *triangles);
    if (!vertices || !triangles) exit(1);
    positions.data = vertices[0].position;
    positions.stride = sizeof *vertices;
    positions.format = ISOCOAT_FORMAT_F32;
    normals = positions;
    normals.data = vertices[0].normal;
    none = positions;
    none.data = NULL;
    triangles[0] = 77;
    vertices[0].position[0] = -7.0f;
    REFUSED(isocoat_mesh_copy(mesh, positions, normals, view.vertex_count - 1, triangles, view.triangle_count),
            ISOCOAT_ERROR_BUFFER_TOO_SMALL, "vertex_capacity is");
    REFUSED(isocoat_mesh_copy(mesh, positions, normals, view.vertex_count, triangles, 1),
            ISOCOAT_ERROR_BUFFER_TOO_SMALL, "triangle_capacity is 1; must be at least");
    CHECK(triangles[0] == 77 && vertices[0].position[0] == -7.0f);
    OK(isocoat_mesh_copy(mesh, positions, normals, view.vertex_count, triangles, view.triangle_count));
    CHECK(memcmp(triangles, view.triangles, view.triangle_count * 3 * sizeof *triangles) == 0);
    for (v = 0; v < view.vertex_count; ++v) {
        CHECK(vertices[v].position[1] == (float)view.positions[3 * v + 1]);
        CHECK(vertices[v].normal[2] == (float)view.normals[3 * v + 2]);
    }
    triangles[0] = 77;
    OK(isocoat_mesh_copy(mesh, none, none, 0, triangles, view.triangle_count));
    CHECK(triangles[0] == view.triangles[0]);
    OK(isocoat_mesh_copy(mesh, none, none, 0, NULL, 0));
    free(vertices);
    free(triangles);
    OK(isocoat_mesh_destroy(mesh));
    isocoat_world_destroy(world);
}

static void territories_have_meshes_of_their_seeds(void)
{
    isocoat_world *world = new_world();
    const ball it = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    isocoat_mesh *mesh = new_mesh();
    isocoat_mesh_view view;
    isocoat_buffer none = {NULL, 0, ISOCOAT_FORMAT_F64};
    size_t seeds = 0;

    OK(isocoat_skeleton_get_seeds(world, it.skeleton, none, none, NULL, 0, &seeds));
    OK(isocoat_skeleton_make_mesh(world, it.skeleton, ISOCOAT_TERRITORY_PATCHES, mesh));
    OK(isocoat_mesh_get_view(mesh, &view));
    CHECK(view.vertex_count == seeds && view.triangle_count == 2 * seeds - 4);
    CHECK(view.valid && view.valid[0]);
    CHECK(six_volumes(&view) > 0.85 * 8.0 * PI * 1e-3 && six_volumes(&view) < 8.0 * PI * 1e-3);
    OK(isocoat_skeleton_make_mesh(world, it.skeleton, ISOCOAT_TERRITORY_SCALES, mesh));
    OK(isocoat_mesh_get_view(mesh, &view));
    CHECK(view.vertex_count == 6 * seeds && view.triangle_count == 4 * seeds);
    OK(isocoat_mesh_destroy(mesh));
    isocoat_world_destroy(world);
}

static void vertices_know_whose_they_are_and_what_presses(void)
{
    isocoat_world *world = new_world();
    const ball it = new_ball(world, ISOCOAT_LINK_FIXED, 0.0), other = new_ball(world, ISOCOAT_LINK_FIXED, 0.15);
    isocoat_mesh_desc desc = isocoat_mesh_desc_default();
    isocoat_skeleton_desc second = isocoat_skeleton_desc_default();
    isocoat_mesh *mesh = new_mesh();
    isocoat_mesh_view view;
    const isocoat_skeleton *skeletons = &it.skeleton;
    const double *weights = &desc.cell_size, *pressures = weights;
    isocoat_skeleton made;
    size_t v, pressed = 0;

    OK(isocoat_skeleton_get_desc(world, it.skeleton, &second));
    second.points[0][0] = 0.12;
    OK(isocoat_skeleton_create(world, it.link, &second, &made));
    desc.cell_size = 0.0125;
    desc.deformation = ISOCOAT_DEFORMATION_CONTACT;
    OK(isocoat_body_make_mesh(world, it.body, &desc, mesh));
    OK(isocoat_mesh_get_weights(mesh, &skeletons, &weights));
    OK(isocoat_mesh_get_pressures(mesh, &pressures));
    CHECK(skeletons == NULL && weights == NULL && pressures == NULL);

    desc.attributes = ISOCOAT_MESH_WEIGHTS | ISOCOAT_MESH_PRESSURES;
    OK(isocoat_body_make_mesh(world, it.body, &desc, mesh));
    OK(isocoat_mesh_get_view(mesh, &view));
    OK(isocoat_mesh_get_weights(mesh, &skeletons, &weights));
    OK(isocoat_mesh_get_pressures(mesh, &pressures));
    for (v = 0; v < view.vertex_count; ++v) {
        const double x = view.positions[3 * v];
        CHECK_NEAR(weights[4 * v] + weights[4 * v + 1], 1.0, 1e-14);
        CHECK(weights[4 * v + 2] == 0.0 && skeletons[4 * v + 2].generation == 0);
        if (fabs(x - 0.06) > 1e-3) CHECK(same_skeleton(skeletons[4 * v], x < 0.06 ? it.skeleton : made));
        CHECK(pressures[v] >= 0.0);
        pressed += pressures[v] > 0.0;
    }
    CHECK(pressed > 20 && pressed < view.vertex_count / 2);

    /* A host that was compiled before there were attributes. */
    desc.struct_size = offsetof(isocoat_mesh_desc, attributes);
    OK(isocoat_body_make_mesh(world, it.body, &desc, mesh));
    OK(isocoat_mesh_get_pressures(mesh, &pressures));
    CHECK(pressures == NULL);
    desc.struct_size = sizeof desc;

    desc.attributes = ISOCOAT_MESH_PRESSURES;
    OK(isocoat_body_make_mesh(world, other.body, &desc, mesh));
    OK(isocoat_mesh_get_weights(mesh, &skeletons, &weights));
    OK(isocoat_mesh_get_pressures(mesh, &pressures));
    CHECK(weights == NULL && pressures != NULL);
    desc.attributes = 4;
    REFUSED(isocoat_body_make_mesh(world, it.body, &desc, mesh), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "attributes is 0x4; must be a sum of ISOCOAT_MESH_ flags, at most 0x3");
    desc.attributes = 0, desc.reserved = 1;
    REFUSED(isocoat_body_make_mesh(world, it.body, &desc, mesh), ISOCOAT_ERROR_INVALID_ARGUMENT, "reserved is 1");
    REFUSED(isocoat_mesh_get_weights(mesh, NULL, &weights), ISOCOAT_ERROR_INVALID_ARGUMENT, "skeletons is NULL");
    REFUSED(isocoat_mesh_get_weights(mesh, &skeletons, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "weights is NULL");
    REFUSED(isocoat_mesh_get_pressures(NULL, &pressures), ISOCOAT_ERROR_INVALID_ARGUMENT, "mesh is NULL");
    OK(isocoat_skeleton_make_mesh(world, it.skeleton, ISOCOAT_TERRITORY_PATCHES, mesh));
    OK(isocoat_mesh_get_pressures(mesh, &pressures));
    CHECK(pressures == NULL);
    OK(isocoat_mesh_destroy(mesh));
    isocoat_world_destroy(world);
}

static void what_makes_no_sense_is_refused(void)
{
    isocoat_world *world = new_world();
    const ball it = new_ball(world, ISOCOAT_LINK_FIXED, 0.0), floor = new_ball(world, ISOCOAT_LINK_FIXED, 1.0);
    isocoat_skeleton_desc plane = isocoat_skeleton_desc_default();
    isocoat_mesh_desc desc = isocoat_mesh_desc_default();
    isocoat_mesh *mesh = new_mesh();
    isocoat_mesh_view before, after;
    isocoat_skeleton made;

    desc.cell_size = 0.05;
    OK(isocoat_body_make_mesh(world, it.body, &desc, mesh));
    OK(isocoat_mesh_get_view(mesh, &before));
    REFUSED(isocoat_body_make_mesh(world, it.body, NULL, mesh), ISOCOAT_ERROR_INVALID_ARGUMENT, "desc is NULL");
    REFUSED(isocoat_body_make_mesh(world, it.body, &desc, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "mesh is NULL");
    desc.cell_size = 0.0;
    REFUSED(isocoat_body_make_mesh(world, it.body, &desc, mesh), ISOCOAT_ERROR_OUT_OF_RANGE,
            "cell_size is 0; must be > 0 and at most 1e9");
    desc.cell_size = NAN;
    REFUSED(isocoat_body_make_mesh(world, it.body, &desc, mesh), ISOCOAT_ERROR_OUT_OF_RANGE, "cell_size is NaN");
    desc.cell_size = 1e-5;
    REFUSED(isocoat_body_make_mesh(world, it.body, &desc, mesh), ISOCOAT_ERROR_OUT_OF_RANGE,
            "cell_size is 0.00001 for a coat of 0.6000 x 0.6000 x 0.6000 m; must be so large");
    desc.cell_size = 0.05;
    desc.deformation = 3;
    REFUSED(isocoat_body_make_mesh(world, it.body, &desc, mesh), ISOCOAT_ERROR_INVALID_ARGUMENT, "deformation is 3");
    desc.deformation = ISOCOAT_DEFORMATION_BULGES;
    plane.shape = ISOCOAT_SHAPE_PLANE;
    plane.thickness = 0.1;
    plane.points[1][2] = 1.0;
    OK(isocoat_skeleton_create(world, floor.link, &plane, &made));
    REFUSED(isocoat_body_make_mesh(world, floor.body, &desc, mesh), ISOCOAT_ERROR_UNSUPPORTED, "plane");
    REFUSED(isocoat_skeleton_make_mesh(world, it.skeleton, 2, mesh), ISOCOAT_ERROR_INVALID_ARGUMENT, "style is 2");
    REFUSED(isocoat_mesh_get_view(NULL, &after), ISOCOAT_ERROR_INVALID_ARGUMENT, "mesh is NULL");
    REFUSED(isocoat_mesh_create(NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "mesh is NULL");

    OK(isocoat_mesh_get_view(mesh, &after));
    CHECK(after.vertex_count == before.vertex_count && after.positions == before.positions);
    OK(isocoat_skeleton_make_mesh(world, made, ISOCOAT_TERRITORY_PATCHES, mesh));
    OK(isocoat_mesh_get_view(mesh, &after));
    CHECK(after.vertex_count == 0 && after.triangle_count == 0);
    OK(isocoat_body_set_enabled(world, it.body, false));
    OK(isocoat_body_make_mesh(world, it.body, &desc, mesh));
    OK(isocoat_mesh_get_view(mesh, &after));
    CHECK(after.vertex_count == before.vertex_count);
    OK(isocoat_mesh_destroy(mesh));
    OK(isocoat_mesh_destroy(NULL));
    isocoat_world_destroy(world);
}

int main(void)
{
    a_ball_has_a_closed_mesh();
    a_mesh_is_copied_in_either_precision();
    territories_have_meshes_of_their_seeds();
    vertices_know_whose_they_are_and_what_presses();
    what_makes_no_sense_is_refused();
    return verdict("mesh");
}
