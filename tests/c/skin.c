/* Skins, and many rays in one call. */
#include "check.h"

enum { RINGS = 9, SIDES = 12, COUNT = RINGS * SIDES };

typedef struct vertex {
    float position[3], normal[3];
} vertex;

static const isocoat_buffer nothing = {NULL, 0, ISOCOAT_FORMAT_F64};
static const isocoat_const_buffer none = {NULL, 0, ISOCOAT_FORMAT_F64};

/* Rings of a ball of radius 0.1 m round (0, 0, height), in single precision. */
static void make_mesh(vertex mesh[COUNT], double height)
{
    int k, ring, side;
    for (ring = 0; ring < RINGS; ++ring) {
        for (side = 0; side < SIDES; ++side) {
            vertex *it = mesh + ring * SIDES + side;
            const double polar = PI * (ring + 0.5) / RINGS, turn = 2.0 * PI * side / SIDES;
            it->normal[0] = (float)(sin(polar) * cos(turn));
            it->normal[1] = (float)(sin(polar) * sin(turn));
            it->normal[2] = (float)cos(polar);
            for (k = 0; k < 3; ++k) it->position[k] = 0.1f * it->normal[k];
            it->position[2] += (float)height;
        }
    }
}

static isocoat_const_buffer part(const float *first)
{
    isocoat_const_buffer buffer;
    buffer.data = first;
    buffer.stride = sizeof(vertex);
    buffer.format = ISOCOAT_FORMAT_F32;
    return buffer;
}

static isocoat_skin new_skin(isocoat_world *world, isocoat_body body, const vertex mesh[COUNT])
{
    isocoat_skin skin;
    OK(isocoat_skin_create(world, body, part(mesh[0].position), part(mesh[0].normal), COUNT, &skin));
    return skin;
}

static void a_skin_follows_its_link(void)
{
    isocoat_world *world = new_world();
    const ball it = new_ball(world, ISOCOAT_LINK_HOST, 0.5);
    isocoat_link_state state;
    isocoat_link links[2];
    isocoat_body body;
    vertex mesh[COUNT], out[COUNT];
    isocoat_buffer positions, normals;
    isocoat_skin skin;
    double weights[2];
    size_t count = 0, v;

    make_mesh(mesh, 0.5);
    skin = new_skin(world, it.body, mesh);
    OK(isocoat_skin_get_vertex_count(world, skin, &count));
    CHECK(count == COUNT);
    OK(isocoat_skin_get_body(world, skin, &body));
    CHECK(same_body(body, it.body));
    OK(isocoat_skin_get_weights(world, skin, 5, links, weights, 2, &count));
    CHECK(count == 1 && same_link(links[0], it.link) && weights[0] == 1.0);

    /* A quarter turn about z, and up. */
    OK(isocoat_link_get_state(world, it.link, &state));
    state.pose.position[2] = 2.5;
    state.pose.orientation[2] = state.pose.orientation[3] = sqrt(0.5);
    OK(isocoat_link_set_state(world, it.link, &state));
    positions.data = out[0].position;
    positions.stride = sizeof *out;
    positions.format = ISOCOAT_FORMAT_F32;
    normals = positions;
    normals.data = out[0].normal;
    OK(isocoat_skin_deform(world, skin, ISOCOAT_DEFORMATION_BULGES, positions, normals, COUNT));
    for (v = 0; v < COUNT; ++v) {
        CHECK_NEAR(out[v].position[0], -mesh[v].position[1], 1e-6);
        CHECK_NEAR(out[v].position[1], mesh[v].position[0], 1e-6);
        CHECK_NEAR(out[v].position[2], mesh[v].position[2] + 2.0, 1e-6);
        CHECK_NEAR(out[v].normal[0], -mesh[v].normal[1], 1e-6);
    }
    OK(isocoat_skin_destroy(world, skin));
    isocoat_world_destroy(world);
}

static void a_skin_is_flat_where_its_body_is_pressed(void)
{
    isocoat_world *world = new_world();
    const ball it = new_ball(world, ISOCOAT_LINK_FIXED, 0.0), wall = new_ball(world, ISOCOAT_LINK_FIXED, 0.15);
    vertex mesh[COUNT];
    double out[COUNT][3];
    isocoat_buffer positions = nothing;
    isocoat_skin skin;
    size_t v, flat = 0;

    make_mesh(mesh, 0.0);
    skin = new_skin(world, it.body, mesh);
    positions.data = out;
    OK(isocoat_skin_deform(world, skin, ISOCOAT_DEFORMATION_CONTACT, positions, nothing, COUNT));
    for (v = 0; v < COUNT; ++v) {
        /* Two equal balls meet half way. */
        CHECK(out[v][2] < 0.075 + 1e-3);
        flat += fabs(out[v][2] - 0.075) < 1e-4;
    }
    CHECK(flat >= 2 * SIDES);
    (void)wall;
    isocoat_world_destroy(world);
}

static void what_cannot_be_is_refused(void)
{
    isocoat_world *world = new_world();
    const ball it = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    vertex mesh[COUNT];
    isocoat_const_buffer bad;
    isocoat_buffer positions = nothing;
    isocoat_skin skin, gone;
    double out[COUNT][3];
    size_t count = 7;

    make_mesh(mesh, 0.0);
    memset(&gone, 0, sizeof gone);
    bad = part(mesh[0].position);
    REFUSED(isocoat_skin_create(world, it.body, none, none, 1, &skin), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "vertices.data is NULL");
    bad.stride = 4;
    REFUSED(isocoat_skin_create(world, it.body, bad, none, COUNT, &skin), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "vertices.stride is 4; must be 0 (no gaps) or at least 12");
    bad.stride = 0;
    bad.format = 2;
    REFUSED(isocoat_skin_create(world, it.body, bad, none, COUNT, &skin), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "vertices.format is 2");
    REFUSED(isocoat_skin_create(world, it.body, part(mesh[0].position), none, COUNT, NULL),
            ISOCOAT_ERROR_INVALID_ARGUMENT, "skin is NULL");
    mesh[3].position[1] = NAN;
    REFUSED(isocoat_skin_create(world, it.body, part(mesh[0].position), none, COUNT, &skin),
            ISOCOAT_ERROR_OUT_OF_RANGE, "(number 3); must be finite");
    make_mesh(mesh, 0.0);
    skin = new_skin(world, it.body, mesh);
    positions.data = out;
    out[0][0] = -7.0;
    REFUSED(isocoat_skin_deform(world, skin, 0, positions, nothing, COUNT - 1), ISOCOAT_ERROR_BUFFER_TOO_SMALL,
            "vertex_capacity is 107; must be at least 108");
    REFUSED(isocoat_skin_deform(world, skin, 3, positions, nothing, COUNT), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "deformation is 3");
    REFUSED(isocoat_skin_deform(world, gone, 0, positions, nothing, COUNT), ISOCOAT_ERROR_INVALID_HANDLE, "null");
    REFUSED(isocoat_skin_get_weights(world, skin, COUNT, NULL, NULL, 0, &count), ISOCOAT_ERROR_OUT_OF_RANGE,
            "vertex is 108");
    OK(isocoat_skeleton_set_enabled(world, it.skeleton, false));
    REFUSED(isocoat_skin_deform(world, skin, 0, positions, nothing, COUNT), ISOCOAT_ERROR_UNSUPPORTED,
            "not those that the skin was bound to");
    OK(isocoat_body_destroy(world, it.body));
    REFUSED(isocoat_skin_deform(world, skin, 0, positions, nothing, COUNT), ISOCOAT_ERROR_INVALID_HANDLE,
            "body of the skin");
    CHECK(out[0][0] == -7.0);
    OK(isocoat_skin_destroy(world, skin));
    REFUSED(isocoat_skin_destroy(world, skin), ISOCOAT_ERROR_INVALID_HANDLE, "stale");
    isocoat_world_destroy(world);
}

static void many_rays_go_into_the_hosts_structs(void)
{
    isocoat_world *world = new_world();
    const ball it = new_ball(world, ISOCOAT_LINK_FIXED, 0.5);
    isocoat_rays_desc desc = isocoat_rays_desc_default();
    isocoat_ray_hits hits = isocoat_ray_hits_default();
    struct {
        float origin[3];
        double direction[3], position[3], distance;
    } rays[3];
    isocoat_const_buffer origins, directions;
    isocoat_body bodies[3];
    isocoat_skeleton skeletons[3];
    double ends[3] = {1.0, 0.3, 1.0};
    isocoat_const_buffer lengths = none;
    int k;

    memset(rays, 0, sizeof rays);
    CHECK(desc.mask == UINT64_MAX && desc.goal == ISOCOAT_RAY_CLOSEST && hits.bodies == NULL);
    for (k = 0; k < 3; ++k) rays[k].direction[2] = k == 2 ? -1.0 : 2.0;
    origins.data = rays[0].origin;
    origins.stride = directions.stride = sizeof *rays;
    origins.format = ISOCOAT_FORMAT_F32;
    directions.data = rays[0].direction;
    directions.format = ISOCOAT_FORMAT_F64;
    lengths.data = ends;
    hits.distances.data = &rays[0].distance;
    hits.positions.data = rays[0].position;
    hits.distances.stride = hits.positions.stride = sizeof *rays;
    hits.bodies = bodies;
    hits.skeletons = skeletons;
    OK(isocoat_world_cast_rays(world, &desc, origins, directions, none, 3, &hits));
    CHECK_NEAR(rays[0].distance, 0.4, 1e-12);
    CHECK_NEAR(rays[1].position[2], 0.4, 1e-12);
    CHECK(isinf(rays[2].distance) && bodies[2].generation == 0 && rays[2].position[2] == 0.0);
    CHECK(same_body(bodies[0], it.body) && same_skeleton(skeletons[1], it.skeleton));
    OK(isocoat_world_cast_rays(world, &desc, origins, directions, lengths, 3, &hits));
    CHECK_NEAR(rays[0].distance, 0.4, 1e-12);
    CHECK(isinf(rays[1].distance));

    rays[1].distance = -7.0;
    rays[2].direction[2] = 0.0;
    REFUSED(isocoat_world_cast_rays(world, &desc, origins, directions, none, 3, &hits), ISOCOAT_ERROR_OUT_OF_RANGE,
            "rays[2]: length of the ray direction is 0");
    CHECK(rays[1].distance == -7.0);
    desc.goal = 2;
    REFUSED(isocoat_world_cast_rays(world, &desc, origins, directions, none, 3, &hits), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "goal is 2");
    desc.goal = ISOCOAT_RAY_ANY;
    REFUSED(isocoat_world_cast_rays(world, &desc, none, directions, none, 3, &hits), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "origins.data is NULL");
    REFUSED(isocoat_world_cast_rays(world, &desc, origins, directions, none, 3, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT,
            "hits is NULL");
    OK(isocoat_world_cast_rays(world, &desc, none, none, none, 0, &hits));
    OK(isocoat_world_cast_rays(world, &desc, origins, directions, none, 2, &hits));
    CHECK_NEAR(rays[1].distance, 0.4, 1e-12);
    isocoat_world_destroy(world);
}

int main(void)
{
    a_skin_follows_its_link();
    a_skin_is_flat_where_its_body_is_pressed();
    what_cannot_be_is_refused();
    many_rays_go_into_the_hosts_structs();
    return verdict("skin");
}
