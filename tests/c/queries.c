/* Questions between steps, against closed forms of balls. */
#include "check.h"

#include <stdint.h>

static const isocoat_status argument = ISOCOAT_ERROR_INVALID_ARGUMENT;
static const isocoat_status range = ISOCOAT_ERROR_OUT_OF_RANGE;

static void the_field_of_a_point(void)
{
    isocoat_world *world = new_world();
    const ball b = new_ball(world, ISOCOAT_LINK_FIXED, 1.0);
    const isocoat_body empty = new_body(world);
    /* On the surface, halfway in, and outside. */
    double points[9] = {0.1, 0, 1, 0, 0.05, 1, 0, 0, 2};
    double values[3], gradients[9], bad[3] = {0, NAN, 0};
    char unaligned[64];
    isocoat_body body = b.body;

    OK(isocoat_body_evaluate_field(world, body, points, 3, values, gradients));
    CHECK_NEAR(values[0], 1.0, 1e-12);
    CHECK_NEAR(values[1], 1.5, 1e-12);
    CHECK_NEAR(values[2], 0.0, 0.0);
    CHECK_NEAR(gradients[0], -10.0, 1e-9);
    CHECK_NEAR(gradients[4], -10.0, 1e-9);
    CHECK_NEAR(gradients[8], 0.0, 0.0);
    values[0] = gradients[0] = 42.0;
    OK(isocoat_body_evaluate_field(world, body, points, 3, NULL, gradients));
    OK(isocoat_body_evaluate_field(world, body, points, 3, values, NULL));
    OK(isocoat_body_evaluate_field(world, body, points, 3, NULL, NULL));
    CHECK_NEAR(values[0], 1.0, 1e-12);
    CHECK_NEAR(gradients[0], -10.0, 1e-9);
    OK(isocoat_body_evaluate_field(world, body, NULL, 0, NULL, NULL));
    OK(isocoat_body_evaluate_field(world, empty, points, 1, values, NULL));
    CHECK_NEAR(values[0], 0.0, 0.0);

    REFUSED(isocoat_body_evaluate_field(world, body, NULL, 1, values, NULL), argument, "points is NULL");
    REFUSED(isocoat_body_evaluate_field(world, body, bad, 1, values, NULL), range, "(0, NaN, 0); must be finite");
    REFUSED(isocoat_body_evaluate_field(world, body, points, 3, points + 8, NULL), argument,
            "points and values overlap");
    REFUSED(isocoat_body_evaluate_field(world, body, points, 3, NULL, points), argument,
            "points and gradients overlap");
    REFUSED(isocoat_body_evaluate_field(world, body, points, 3, gradients + 2, gradients), argument,
            "values and gradients overlap");
    REFUSED(isocoat_body_evaluate_field(world, body, points, SIZE_MAX / 16, values, NULL), argument, "");
    REFUSED(isocoat_body_evaluate_field(world, body, (double *)(void *)(unaligned + ((uintptr_t)unaligned % 8 == 0)), 1,
                                        values, NULL), argument, "points is not aligned to 8 bytes");
    isocoat_world_destroy(world);
}

static void the_contact_of_two_balls(void)
{
    isocoat_world *world = new_world();
    const ball a = new_ball(world, ISOCOAT_LINK_FIXED, 0.0), b = new_ball(world, ISOCOAT_LINK_HOST, 0.18);
    const ball far = new_ball(world, ISOCOAT_LINK_HOST, 5.0);
    isocoat_contact contact, twin;
    size_t count = 99;
    /* Equal balls with the pressure p = E (1 - r/R), R = 0.1 m, E = K k R = 1e5 Pa, at the half distance h = 0.09 m. */
    const double radius = 0.1, modulus = 1e5, h = 0.09;
    const double force = PI * modulus / (3.0 * radius) * (radius - h) * (radius - h) * (radius + 2.0 * h);
    isocoat_scheme scheme;

    OK(isocoat_world_collide(world, a.body, b.body, ISOCOAT_SCHEME_AUTO, 1e-6, NULL, 0, &count));
    CHECK(count == 1);
    count = 99;
    memset(&contact, 0, sizeof contact);
    for (scheme = ISOCOAT_SCHEME_AUTO; scheme <= ISOCOAT_SCHEME_FACETS; ++scheme) {
        if (scheme == ISOCOAT_SCHEME_SEEDS) {
            continue;
        }
        OK(isocoat_world_collide(world, a.body, b.body, scheme, 1e-6, &contact, 1, &count));
        CHECK(count == 1 && same_body(contact.body_a, a.body) && same_body(contact.body_b, b.body));
        CHECK(same_link(contact.link_b, b.link) && same_skeleton(contact.skeleton_a, a.skeleton));
        CHECK_NEAR(contact.force[2], force, 1e-4 * force);
        CHECK_NEAR(contact.normal[2], 1.0, 1e-6);
        CHECK_NEAR(contact.position[2], 0.09, 1e-6);
        CHECK_NEAR(contact.area, PI * (radius * radius - h * h), 5e-2 * contact.area);
        CHECK_NEAR(contact.peak_pressure, modulus * (1.0 - h / radius), 1e-3 * modulus);
    }
    OK(isocoat_world_collide(world, b.body, a.body, ISOCOAT_SCHEME_AUTO, 1e-6, &twin, 1, &count));
    CHECK_NEAR(twin.force[2], -force, 1e-4 * force);
    OK(isocoat_world_collide(world, a.body, far.body, ISOCOAT_SCHEME_AUTO, 1e-6, &twin, 1, &count));
    CHECK(count == 0);
    /* All of a body blends, unless told otherwise. */
    count = 99;
    OK(isocoat_world_collide(world, a.body, a.body, 0, 1e-3, &twin, 1, &count));
    CHECK(count == 0);

    count = 99;
    REFUSED(isocoat_world_collide(world, a.body, b.body, 6, 1e-6, &contact, 1, &count), argument, "scheme is 6");
    REFUSED(isocoat_world_collide(world, a.body, b.body, 0, 0.0, &contact, 1, &count), range,
            "tolerance is 0; must be from 1e-9 to 0.5");
    REFUSED(isocoat_world_collide(world, a.body, b.body, 0, NAN, &contact, 1, &count), range, "tolerance is NaN");
    REFUSED(isocoat_world_collide(world, a.body, b.body, 0, 1e-3, NULL, 1, &count), argument, "contacts is NULL");
    REFUSED(isocoat_world_collide(world, a.body, b.body, 0, 1e-3, &contact, 1, NULL), argument, "count is NULL");
    CHECK(count == 99);
    REFUSED(isocoat_world_collide(world, a.body, b.body, 0, 1e-3, &contact, 0, &count), ISOCOAT_ERROR_BUFFER_TOO_SMALL,
            "capacity is 0; 1 elements");
    CHECK(count == 1);
    isocoat_world_destroy(world);
}

static void rays_spheres_and_closest_points(void)
{
    isocoat_world *world = new_world();
    const ball low = new_ball(world, ISOCOAT_LINK_FIXED, 0.0), high = new_ball(world, ISOCOAT_LINK_HOST, 1.0);
    const isocoat_body empty = new_body(world);
    isocoat_ray_hit hit;
    isocoat_surface_point closest;
    isocoat_body bodies[2];
    bool found = false;
    size_t count = 99;
    VEC(origin, 0, 0, 3);
    VEC(down, 0, 0, -5);
    VEC(up, 0, 0, 1);
    VEC(zero, 0, 0, 0);
    VEC(bad, 0, INFINITY, 0);
    VEC(aside, 0.5, 0, 1);
    VEC(inside, 0.06, 0, 1);
    VEC(between, 0, 0, 0.5);

    OK(isocoat_world_cast_ray(world, origin, down, INFINITY, UINT64_MAX, &hit, &found));
    CHECK(found && same_body(hit.body, high.body) && same_link(hit.link, high.link));
    CHECK(same_skeleton(hit.skeleton, high.skeleton));
    CHECK_NEAR(hit.distance, 1.9, 1e-9);
    CHECK_NEAR(hit.position[2], 1.1, 1e-9);
    CHECK_NEAR(hit.normal[2], 1.0, 1e-9);
    OK(isocoat_world_cast_ray(world, between, down, 0.3, UINT64_MAX, &hit, &found));
    CHECK(!found);
    CHECK_NEAR(hit.distance, 1.9, 1e-9);
    OK(isocoat_world_cast_ray(world, between, down, 0.5, UINT64_MAX, &hit, &found));
    CHECK(found && same_body(hit.body, low.body));
    OK(isocoat_world_cast_ray(world, between, down, 0.5, 2, &hit, &found));
    CHECK(!found);
    OK(isocoat_world_cast_ray(world, zero, up, 9.0, UINT64_MAX, &hit, &found));
    CHECK(found && same_body(hit.body, low.body));
    CHECK_NEAR(hit.distance, 0.0, 0.0);
    REFUSED(isocoat_world_cast_ray(world, bad, up, 9.0, 1, &hit, &found), range, "(0, inf, 0); must be finite");
    REFUSED(isocoat_world_cast_ray(world, zero, bad, 9.0, 1, &hit, &found), range, "(0, inf, 0)");
    REFUSED(isocoat_world_cast_ray(world, origin, zero, 9.0, 1, &hit, &found), range, "is 0; must be > 0");
    REFUSED(isocoat_world_cast_ray(world, origin, up, -1.0, 1, &hit, &found), range, "max_distance is -1");
    REFUSED(isocoat_world_cast_ray(world, origin, up, NAN, 1, &hit, &found), range, "max_distance is NaN");
    REFUSED(isocoat_world_cast_ray(world, NULL, up, 9.0, 1, &hit, &found), argument, "origin is NULL");
    REFUSED(isocoat_world_cast_ray(world, origin, NULL, 9.0, 1, &hit, &found), argument, "direction is NULL");
    REFUSED(isocoat_world_cast_ray(world, origin, up, 9.0, 1, NULL, &found), argument, "hit is NULL");
    REFUSED(isocoat_world_cast_ray(world, origin, up, 9.0, 1, &hit, NULL), argument, "found is NULL");

    OK(isocoat_world_overlap_sphere(world, between, 0.41, UINT64_MAX, NULL, 0, &count));
    CHECK(count == 2);
    OK(isocoat_world_overlap_sphere(world, between, 0.41, UINT64_MAX, bodies, 2, &count));
    CHECK(count == 2 && same_body(bodies[0], low.body) && same_body(bodies[1], high.body));
    OK(isocoat_world_overlap_sphere(world, between, 0.39, UINT64_MAX, bodies, 2, &count));
    CHECK(count == 0);
    OK(isocoat_world_overlap_sphere(world, inside, 0.0, UINT64_MAX, bodies, 2, &count));
    CHECK(count == 1 && same_body(bodies[0], high.body));
    REFUSED(isocoat_world_overlap_sphere(world, between, 0.41, UINT64_MAX, bodies, 1, &count),
            ISOCOAT_ERROR_BUFFER_TOO_SMALL, "capacity is 1; 2 elements");
    REFUSED(isocoat_world_overlap_sphere(world, bad, 0.41, 1, bodies, 1, &count), range, "center is (0, inf, 0)");
    REFUSED(isocoat_world_overlap_sphere(world, between, -1.0, 1, bodies, 1, &count), range, "radius is -1");
    REFUSED(isocoat_world_overlap_sphere(world, NULL, 1.0, 1, bodies, 1, &count), argument, "center is NULL");
    REFUSED(isocoat_world_overlap_sphere(world, between, 1.0, 1, NULL, 1, &count), argument, "bodies is NULL");
    REFUSED(isocoat_world_overlap_sphere(world, between, 1.0, 1, bodies, 1, NULL), argument, "count is NULL");

    OK(isocoat_body_closest_point(world, high.body, aside, &closest, &found));
    CHECK(found && same_link(closest.link, high.link) && same_skeleton(closest.skeleton, high.skeleton));
    CHECK_NEAR(closest.distance, 0.4, 1e-9);
    CHECK_NEAR(closest.position[0], 0.1, 1e-9);
    CHECK_NEAR(closest.normal[0], 1.0, 1e-9);
    OK(isocoat_body_closest_point(world, high.body, inside, &closest, &found));
    CHECK_NEAR(closest.distance, -0.04, 1e-9);
    OK(isocoat_body_closest_point(world, empty, inside, &closest, &found));
    CHECK(!found);
    CHECK_NEAR(closest.distance, -0.04, 1e-9);
    REFUSED(isocoat_body_closest_point(world, high.body, bad, &closest, &found), range, "point is (0, inf, 0)");
    REFUSED(isocoat_body_closest_point(world, high.body, NULL, &closest, &found), argument, "point is NULL");
    REFUSED(isocoat_body_closest_point(world, high.body, aside, NULL, &found), argument, "closest is NULL");
    REFUSED(isocoat_body_closest_point(world, high.body, aside, &closest, NULL), argument, "found is NULL");
    isocoat_world_destroy(world);
}

static void shapes_in_contact(void)
{
    isocoat_world *world = new_world();
    /* Equal balls of 0.1 m, 0.16 m apart: they meet in the plane between, in a circle of 0.06 m. */
    const ball low = new_ball(world, ISOCOAT_LINK_FIXED, 0.0), high = new_ball(world, ISOCOAT_LINK_HOST, 0.16);
    isocoat_body_desc desc = isocoat_body_desc_default();
    isocoat_ray_hit hit;
    isocoat_surface_point closest;
    isocoat_deformation deformation;
    bool found = false;
    double value = 0.0, plain = 0.0;
    VEC(above, 0.01, 0, 0.2);
    VEC(down, 0, 0, -1);
    VEC(middle, 0.03, 0, 0.08);
    VEC(beside, 0.061, 0, 0.0795);

    OK(isocoat_body_get_desc(world, low.body, &desc));
    CHECK_NEAR(desc.bulge_width, 0.0, 0.0);
    CHECK_NEAR(desc.bulge_height, 1.0, 0.0);
    desc.category = 2;
    desc.bulge_width = 1.0;
    OK(isocoat_body_set_desc(world, low.body, &desc));
    desc.bulge_width = 0.0;
    OK(isocoat_body_get_desc(world, low.body, &desc));
    CHECK_NEAR(desc.bulge_width, 1.0, 0.0);
    desc.bulge_width = 1.5;
    REFUSED(isocoat_body_set_desc(world, low.body, &desc), range, "bulge_width is 1.5; must be from 0 to 1");
    desc.bulge_width = 1.0;
    desc.bulge_height = -1.0;
    REFUSED(isocoat_body_set_desc(world, low.body, &desc), range, "bulge_height is -1");

    OK(isocoat_world_cast_ray_deformed(world, above, down, 1.0, 2, ISOCOAT_DEFORMATION_NONE, &hit, &found));
    CHECK(found && same_body(hit.body, low.body));
    CHECK_NEAR(hit.position[2], sqrt(0.01 - 0.0001), 1e-9);
    for (deformation = ISOCOAT_DEFORMATION_CONTACT; deformation <= ISOCOAT_DEFORMATION_BULGES; ++deformation) {
        OK(isocoat_world_cast_ray_deformed(world, above, down, 1.0, 2, deformation, &hit, &found));
        CHECK(found && same_body(hit.body, low.body) && same_skeleton(hit.skeleton, low.skeleton));
        CHECK_NEAR(hit.position[2], 0.08, 1e-9);
        CHECK_NEAR(hit.normal[2], 1.0, 1e-9);
        OK(isocoat_body_evaluate_field_deformed(world, low.body, deformation, middle, 1, &value, NULL));
        CHECK_NEAR(value, 1.0, 1e-9);
        OK(isocoat_body_closest_point_deformed(world, low.body, above, deformation, &closest, &found));
        CHECK(found && same_link(closest.link, low.link));
        CHECK_NEAR(closest.distance, 0.12, 1e-9);
        CHECK_NEAR(closest.position[0], 0.01, 1e-9);
    }
    OK(isocoat_body_evaluate_field(world, low.body, beside, 1, &plain, NULL));
    OK(isocoat_body_evaluate_field_deformed(world, low.body, ISOCOAT_DEFORMATION_CONTACT, beside, 1, &value, NULL));
    CHECK(plain < 1.0 && value < 1.0);
    OK(isocoat_body_evaluate_field_deformed(world, low.body, ISOCOAT_DEFORMATION_BULGES, beside, 1, &value, NULL));
    CHECK(value > 1.0);
    /* The other has no bulges. */
    OK(isocoat_body_evaluate_field_deformed(world, high.body, ISOCOAT_DEFORMATION_BULGES, beside, 1, &value, NULL));
    CHECK(value < 1.0);

    REFUSED(isocoat_body_evaluate_field_deformed(world, low.body, 3, beside, 1, &value, NULL), argument,
            "deformation is 3");
    REFUSED(isocoat_world_cast_ray_deformed(world, above, down, 1.0, 2, 3, &hit, &found), argument, "deformation is 3");
    REFUSED(isocoat_body_closest_point_deformed(world, low.body, above, 3, &closest, &found), argument,
            "deformation is 3");
    REFUSED(isocoat_world_cast_ray_deformed(world, NULL, down, 1.0, 2, 1, &hit, &found), argument, "origin is NULL");
    REFUSED(isocoat_body_closest_point_deformed(world, low.body, NULL, 1, &closest, &found), argument,
            "point is NULL");
    REFUSED(isocoat_body_evaluate_field_deformed(world, low.body, 1, NULL, 1, &value, NULL), argument,
            "points is NULL");
    isocoat_world_destroy(world);
}

#define MANY 4096

static void seeds_lie_on_the_surface(void)
{
    isocoat_world *world = new_world();
    const ball b = new_ball(world, ISOCOAT_LINK_FIXED, 2.0);
    static float positions[MANY][3];
    static double normals[MANY][4];
    static uint8_t valid[MANY];
    const isocoat_buffer skip = {NULL, 0, ISOCOAT_FORMAT_F64};
    isocoat_buffer into_positions, into_normals;
    size_t count = 0, again = 0, i;
    into_positions.data = positions;
    into_positions.stride = 0;
    into_positions.format = ISOCOAT_FORMAT_F32;
    into_normals.data = normals;
    into_normals.stride = sizeof normals[0];
    into_normals.format = ISOCOAT_FORMAT_F64;

    OK(isocoat_skeleton_get_seeds(world, b.skeleton, skip, skip, NULL, 0, &count));
    CHECK(count >= 64 && count <= MANY);
    OK(isocoat_skeleton_get_seeds(world, b.skeleton, into_positions, into_normals, valid, MANY, &again));
    CHECK(again == count);
    for (i = 0; i < count; ++i) {
        const double x = positions[i][0], y = positions[i][1], z = (double)positions[i][2] - 2.0;
        CHECK_NEAR(sqrt(x * x + y * y + z * z), 0.1, 1e-6);
        CHECK_NEAR(x * normals[i][0] + y * normals[i][1] + z * normals[i][2], 0.1, 1e-6);
        CHECK(valid[i] == 1);
    }
    valid[0] = 7;
    REFUSED(isocoat_skeleton_get_seeds(world, b.skeleton, skip, skip, valid, count - 1, &again),
            ISOCOAT_ERROR_BUFFER_TOO_SMALL, "capacity is");
    CHECK(again == count && valid[0] == 7);
    OK(isocoat_skeleton_get_seeds(world, b.skeleton, skip, skip, valid, count, &again));
    CHECK(valid[0] == 1);
    into_positions.stride = 4;
    REFUSED(isocoat_skeleton_get_seeds(world, b.skeleton, into_positions, skip, NULL, MANY, &again), argument,
            "positions.stride is 4; must be 0 (no gaps) or at least 12");
    into_normals.format = 9;
    REFUSED(isocoat_skeleton_get_seeds(world, b.skeleton, skip, into_normals, NULL, MANY, &again), argument,
            "normals.format is 9");
    REFUSED(isocoat_skeleton_get_seeds(world, b.skeleton, skip, skip, NULL, 0, NULL), argument, "count is NULL");
    isocoat_world_destroy(world);
}

typedef struct sketch {
    isocoat_world *world;
    int lines, points;
} sketch;

static void draw_line(void *context, const double a[3], const double b[3], uint32_t color)
{
    sketch *drawn = (sketch *)context;
    CHECK(isfinite(a[0] + a[1] + a[2] + b[0] + b[1] + b[2]) && (color & 0xffu) != 0);
    ++drawn->lines;
}

static void draw_point(void *context, const double position[3], double size, uint32_t color)
{
    sketch *drawn = (sketch *)context;
    isocoat_counters counters = isocoat_counters_default();
    CHECK(isfinite(position[0] + position[1] + position[2]) && size > 0.0 && (color & 0xffu) != 0);
    /* Reading is welcome here, changing is not. */
    OK(isocoat_world_get_counters(drawn->world, &counters));
    REFUSED(isocoat_world_step(drawn->world, 0.01), ISOCOAT_ERROR_LOCKED, "being read");
    ++drawn->points;
}

static void a_drawing_shows_what_was_asked_for(void)
{
    isocoat_world *world = new_world();
    isocoat_debug_draw draw = isocoat_debug_draw_default();
    sketch drawn;
    size_t seeds;
    const isocoat_buffer skip = {NULL, 0, ISOCOAT_FORMAT_F64};
    const ball b = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    memset(&drawn, 0, sizeof drawn);
    drawn.world = world;

    OK(isocoat_world_debug_draw(world, &draw));
    draw.context = &drawn;
    draw.draw_line = draw_line;
    draw.draw_point = draw_point;
    OK(isocoat_world_debug_draw(world, &draw));
    CHECK(drawn.lines == 0 && drawn.points == 0);
    draw.flags = ISOCOAT_DRAW_SKELETONS;
    OK(isocoat_world_debug_draw(world, &draw));
    CHECK(drawn.points == 1);
    drawn.lines = drawn.points = 0;
    draw.flags = ISOCOAT_DRAW_SEEDS | ISOCOAT_DRAW_BOUNDS;
    OK(isocoat_world_debug_draw(world, &draw));
    OK(isocoat_skeleton_get_seeds(world, b.skeleton, skip, skip, NULL, 0, &seeds));
    CHECK((size_t)drawn.points == seeds && drawn.lines >= 12);
    draw.draw_line = NULL;
    drawn.lines = 0;
    OK(isocoat_world_debug_draw(world, &draw));
    CHECK(drawn.lines == 0);
    draw.draw_point = NULL;
    OK(isocoat_world_debug_draw(world, &draw));
    draw.flags = 16;
    REFUSED(isocoat_world_debug_draw(world, &draw), argument, "flags is 0x10; must be a sum of ISOCOAT_DRAW_ flags");
    REFUSED(isocoat_world_debug_draw(world, NULL), argument, "draw is NULL");
    isocoat_world_destroy(world);
}

int main(void)
{
    the_field_of_a_point();
    the_contact_of_two_balls();
    rays_spheres_and_closest_points();
    shapes_in_contact();
    seeds_lie_on_the_surface();
    a_drawing_shows_what_was_asked_for();
    return verdict("queries");
}
