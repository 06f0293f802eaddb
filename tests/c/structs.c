/* Structs that say their size, in hosts older and newer than the library; version, ABI, messages. */
#include "check.h"

#include <stddef.h>

static const isocoat_status argument = ISOCOAT_ERROR_INVALID_ARGUMENT;

/* A descriptor as a newer header would have it. */
typedef struct newer_world_desc {
    isocoat_world_desc known;
    double unknown_field;
} newer_world_desc;

typedef struct newer_counters {
    isocoat_counters known;
    uint64_t unknown_field;
} newer_counters;

static void defaults_are_those_of_the_manual(void)
{
    const isocoat_world_desc world = isocoat_world_desc_default();
    const isocoat_body_desc body = isocoat_body_desc_default();
    const isocoat_link_desc link = isocoat_link_desc_default();
    const isocoat_skeleton_desc skeleton = isocoat_skeleton_desc_default();
    const isocoat_debug_draw draw = isocoat_debug_draw_default();

    CHECK(world.struct_size == sizeof world && world.response == ISOCOAT_RESPONSE_AUTO);
    CHECK(world.scheme == ISOCOAT_SCHEME_AUTO && world.seed_count == 64 && world.max_substeps == 4096);
    CHECK_NEAR(world.gravity[2], 0.0, 0.0);
    CHECK_NEAR(world.force_tolerance, 5e-3, 0.0);
    CHECK_NEAR(world.substep_phase, 0.2, 0.0);

    CHECK(body.struct_size == sizeof body && body.kind == ISOCOAT_BODY_DEFORMABLE);
    CHECK(body.category == 1 && body.mask == UINT64_MAX && body.user_data == NULL);
    CHECK_NEAR(body.isovalue, 1.0, 0.0);
    CHECK_NEAR(body.stiffness_scale, 1e5, 0.0);
    CHECK_NEAR(body.friction + body.static_friction + body.viscous_friction + body.dissipation, 0.0, 0.0);

    CHECK(link.struct_size == sizeof link && link.kind == ISOCOAT_LINK_FIXED && link.user_data == NULL);
    CHECK(link.velocity_convention == ISOCOAT_VELOCITY_LEAPFROG && link.flags == 0);
    CHECK_NEAR(link.pose.orientation[3], 1.0, 0.0);
    CHECK_NEAR(link.gravity_scale, 1.0, 0.0);
    CHECK_NEAR(link.mass, 0.0, 0.0);

    CHECK(skeleton.struct_size == sizeof skeleton && skeleton.shape == ISOCOAT_SHAPE_POINT);
    CHECK(skeleton.seed_count == 0 && skeleton.user_data == NULL);
    CHECK_NEAR(skeleton.thickness, 0.1, 0.0);
    CHECK_NEAR(skeleton.stiffness, 0.0, 0.0);
    CHECK_NEAR(skeleton.stiffening, 1.0, 0.0);
    CHECK_NEAR(skeleton.radius, 0.0, 0.0);

    CHECK(draw.struct_size == sizeof draw && draw.flags == 0 && draw.context == NULL);
    CHECK(draw.draw_line == NULL && draw.draw_point == NULL);
}

static void init_writes_no_more_than_the_host_has_room_for(void)
{
    newer_world_desc newer;
    isocoat_world_desc desc;
    unsigned char guard[sizeof(isocoat_world_desc) + 8];
    size_t i;

    REFUSED(isocoat_world_desc_init(NULL, sizeof desc), argument, "desc is NULL");
    REFUSED(isocoat_world_desc_init(&desc, 4), argument, "struct_size of isocoat_world_desc is 4; must be at least");
    REFUSED(isocoat_world_desc_init(&desc, (size_t)1 << 40), argument, "struct_size of isocoat_world_desc is 1099");
    REFUSED(isocoat_body_desc_init(NULL, sizeof(isocoat_body_desc)), argument, "desc is NULL");
    REFUSED(isocoat_link_desc_init(NULL, sizeof(isocoat_link_desc)), argument, "desc is NULL");
    REFUSED(isocoat_skeleton_desc_init(NULL, sizeof(isocoat_skeleton_desc)), argument, "desc is NULL");
    REFUSED(isocoat_counters_init(NULL, sizeof(isocoat_counters)), argument, "counters is NULL");
    REFUSED(isocoat_debug_draw_init(NULL, sizeof(isocoat_debug_draw)), argument, "draw is NULL");
    REFUSED(isocoat_link_desc_init(NULL, 8), argument, "desc is NULL");

    memset(guard, 0xAA, sizeof guard);
    OK(isocoat_world_desc_init((isocoat_world_desc *)(void *)guard, sizeof desc));
    for (i = sizeof desc; i < sizeof guard; ++i) CHECK(guard[i] == 0xAA);

    /* A host of a newer header gets zeros in the fields that this library lacks. */
    memset(&newer, 0xAA, sizeof newer);
    OK(isocoat_world_desc_init(&newer.known, sizeof newer));
    CHECK(newer.known.struct_size == sizeof newer);
    CHECK_NEAR(newer.unknown_field, 0.0, 0.0);
    CHECK_NEAR(newer.known.substep_phase, 0.2, 0.0);
}

static void a_newer_host_is_served_while_it_uses_nothing_new(void)
{
    isocoat_world *world = NULL;
    newer_world_desc newer;
    newer_counters counters;
    char text[64];

    OK(isocoat_world_desc_init(&newer.known, sizeof newer));
    newer.known.seed_count = 100;
    OK(isocoat_world_create(&newer.known, &world));
    memset(&newer.known.seed_count, 0, sizeof newer.known.seed_count);
    newer.unknown_field = 5.0;
    OK(isocoat_world_get_desc(world, &newer.known));
    CHECK(newer.known.seed_count == 100 && newer.known.struct_size == sizeof newer);
    CHECK_NEAR(newer.unknown_field, 0.0, 0.0);

    newer.unknown_field = 1.0;
    sprintf(text, "knows only the first %u", (unsigned)sizeof(isocoat_world_desc));
    REFUSED(isocoat_world_set_desc(world, &newer.known), argument, text);
    REFUSED(isocoat_world_set_desc(world, &newer.known), argument, "newer header");

    OK(isocoat_counters_init(&counters.known, sizeof counters));
    counters.unknown_field = 7;
    OK(isocoat_world_get_counters(world, &counters.known));
    CHECK(counters.unknown_field == 0 && counters.known.struct_size == sizeof counters);
    isocoat_world_destroy(world);
}

static void sizes_that_were_never_published_are_refused(void)
{
    isocoat_world *world = new_world();
    const ball b = new_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    isocoat_world_desc world_desc = isocoat_world_desc_default();
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_skeleton_desc skeleton_desc = isocoat_skeleton_desc_default();
    isocoat_counters counters = isocoat_counters_default();
    isocoat_debug_draw draw = isocoat_debug_draw_default();
    const char *const never_set = "struct_size of isocoat_world_desc is 0; must be at least";

    world_desc.struct_size = 0;
    REFUSED(isocoat_world_set_desc(world, &world_desc), argument, never_set);
    REFUSED(isocoat_world_get_desc(world, &world_desc), argument, never_set);
    CHECK(world_desc.struct_size == 0);
    world_desc.struct_size = 0xCDCDCDCDu;
    REFUSED(isocoat_world_set_desc(world, &world_desc), argument, "begin with isocoat_world_desc_default()");
    body_desc.struct_size = offsetof(isocoat_body_desc, user_data);
    REFUSED(isocoat_body_set_desc(world, b.body, &body_desc), argument, "struct_size of isocoat_body_desc");
    REFUSED(isocoat_body_get_desc(world, b.body, &body_desc), argument, "struct_size of isocoat_body_desc");
    link_desc.struct_size = 1;
    REFUSED(isocoat_link_set_desc(world, b.link, &link_desc), argument, "struct_size of isocoat_link_desc is 1");
    REFUSED(isocoat_link_get_desc(world, b.link, &link_desc), argument, "struct_size of isocoat_link_desc is 1");
    skeleton_desc.struct_size = 1;
    REFUSED(isocoat_skeleton_set_desc(world, b.skeleton, &skeleton_desc), argument, "isocoat_skeleton_desc is 1");
    REFUSED(isocoat_skeleton_get_desc(world, b.skeleton, &skeleton_desc), argument, "isocoat_skeleton_desc is 1");
    counters.struct_size = 8;
    REFUSED(isocoat_world_get_counters(world, &counters), argument, "struct_size of isocoat_counters is 8");
    draw.struct_size = 8;
    REFUSED(isocoat_world_debug_draw(world, &draw), argument, "struct_size of isocoat_debug_draw is 8");
    isocoat_world_destroy(world);
}

static void descriptors_come_back_as_they_were_given(void)
{
    isocoat_world *world = NULL;
    isocoat_world_desc world_in = isocoat_world_desc_default(), world_out = isocoat_world_desc_default();
    isocoat_body_desc body_in = isocoat_body_desc_default(), body_out = isocoat_body_desc_default();
    isocoat_link_desc link_in = isocoat_link_desc_default(), link_out = isocoat_link_desc_default();
    isocoat_body body;
    isocoat_link link;
    int i, j, marker;

    world_in.gravity[0] = 1.0;
    world_in.gravity[2] = -9.81;
    world_in.response = ISOCOAT_RESPONSE_EXPLICIT;
    world_in.scheme = ISOCOAT_SCHEME_SEEDS;
    world_in.seed_count = 200;
    world_in.max_substeps = 7;
    world_in.force_tolerance = 1e-4;
    world_in.substep_phase = 0.5;
    OK(isocoat_world_create(&world_in, &world));
    OK(isocoat_world_get_desc(world, &world_out));
    CHECK(world_out.response == world_in.response && world_out.scheme == world_in.scheme);
    CHECK(world_out.seed_count == 200 && world_out.max_substeps == 7);
    CHECK(memcmp(world_out.gravity, world_in.gravity, sizeof world_in.gravity) == 0);
    CHECK_NEAR(world_out.force_tolerance, 1e-4, 0.0);
    CHECK_NEAR(world_out.substep_phase, 0.5, 0.0);
    for (i = 0; i <= 4; ++i) {
        world_in.scheme = (isocoat_scheme)i;
        OK(isocoat_world_set_desc(world, &world_in));
        OK(isocoat_world_get_desc(world, &world_out));
        CHECK(world_out.scheme == (isocoat_scheme)i);
    }

    body_in.kind = ISOCOAT_BODY_RIGID;
    body_in.isovalue = 2.0;
    body_in.stiffness_scale = 3.0;
    body_in.friction = 0.25;
    body_in.static_friction = 0.5;
    body_in.viscous_friction = 0.125;
    body_in.dissipation = 0.75;
    body_in.category = 6;
    body_in.mask = 5;
    body_in.user_data = &marker;
    OK(isocoat_body_create(world, &body_in, &body));
    OK(isocoat_body_get_desc(world, body, &body_out));
    CHECK(memcmp(&body_in, &body_out, sizeof body_in) == 0);

    /* Nothing is symmetric here but what must be, so that a transposed matrix would show. */
    link_in.kind = ISOCOAT_LINK_HOST;
    link_in.pose.position[1] = 3.0;
    link_in.pose.orientation[0] = 0.6;
    link_in.pose.orientation[3] = 0.8;
    link_in.linear_velocity[2] = 4.0;
    link_in.angular_velocity[0] = 5.0;
    link_in.mass = 2.0;
    link_in.local_center_of_mass[2] = 0.1;
    OK(isocoat_inertia_of_sphere(2.0, 1.0, link_in.inertia));
    link_in.inertia[2] = link_in.inertia[6] = 0.01;
    link_in.gravity_scale = 0.5;
    link_in.external_acceleration[0] = 6.0;
    link_in.external_angular_acceleration[1] = 7.0;
    link_in.velocity_convention = ISOCOAT_VELOCITY_SYNCHRONOUS;
    link_in.flags =
        ISOCOAT_LINK_HOST_GYROSCOPIC | ISOCOAT_LINK_CONSTRAINED | ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA;
    for (i = 0; i < 6; ++i)
        for (j = 0; j < 6; ++j) link_in.inverse_effective_inertia[6 * i + j] = i == j ? 2.0 + i : 0.01 * (i + j);
    link_in.user_data = &marker;
    OK(isocoat_link_create(world, body, &link_in, &link));
    OK(isocoat_link_get_desc(world, link, &link_out));
    CHECK_NEAR(link_out.pose.orientation[0], 0.6, 1e-15);
    CHECK_NEAR(link_out.pose.orientation[3], 0.8, 1e-15);
    link_out.pose = link_in.pose;
    CHECK(memcmp(&link_in, &link_out, sizeof link_in) == 0);
    link_in.flags = 0;
    link_in.kind = ISOCOAT_LINK_RIGID;
    OK(isocoat_link_set_desc(world, link, &link_in));
    OK(isocoat_link_get_desc(world, link, &link_out));
    CHECK(link_out.flags == 0 && link_out.kind == ISOCOAT_LINK_RIGID);
    CHECK_NEAR(link_out.inverse_effective_inertia[0], 0.0, 0.0);
    isocoat_world_destroy(world);
}

static void shapes_come_back_as_what_they_are(void)
{
    isocoat_world *world = new_world();
    const isocoat_body body = new_body(world);
    const isocoat_link link = new_link(world, body, ISOCOAT_LINK_FIXED, 0.0);
    isocoat_skeleton_desc in = isocoat_skeleton_desc_default(), out = isocoat_skeleton_desc_default();
    isocoat_skeleton skeleton;
    static const double points[3][3] = {{0.1, 0.2, 0.3}, {0.4, 0.6, 0.5}, {0.9, -0.7, 0.8}};
    int i, j;
    memcpy(in.points, points, sizeof points);
    in.thickness = 0.2;
    in.stiffness = 3.0;
    in.stiffening = 4.0;
    in.radius = 0.5;
    in.seed_count = 12;
    OK(isocoat_skeleton_create(world, link, &in, &skeleton));
    OK(isocoat_skeleton_get_desc(world, skeleton, &out));
    CHECK(out.shape == ISOCOAT_SHAPE_POINT && out.seed_count == 12);
    CHECK_NEAR(out.points[0][2], 0.3, 0.0);
    CHECK_NEAR(out.thickness, 0.2, 0.0);
    CHECK_NEAR(out.stiffness, 3.0, 0.0);
    CHECK_NEAR(out.stiffening, 4.0, 0.0);
    CHECK_NEAR(out.radius, 0.5, 0.0);

    for (i = 1; i <= 3; ++i) {
        in.shape = (isocoat_shape)i;
        OK(isocoat_skeleton_set_desc(world, skeleton, &in));
        OK(isocoat_skeleton_get_desc(world, skeleton, &out));
        CHECK(out.shape == in.shape);
        for (j = 0; j < (i == 1 ? 6 : 9); ++j) CHECK_NEAR(out.points[j / 3][j % 3], points[j / 3][j % 3], 1e-14);
    }
    in.shape = ISOCOAT_SHAPE_PLANE;
    in.points[1][0] = in.points[1][1] = 0.0;
    in.points[1][2] = 8.0;
    OK(isocoat_skeleton_set_desc(world, skeleton, &in));
    OK(isocoat_skeleton_get_desc(world, skeleton, &out));
    CHECK(out.shape == ISOCOAT_SHAPE_PLANE);
    CHECK_NEAR(out.points[0][1], 0.2, 0.0);
    CHECK_NEAR(out.points[1][2], 1.0, 0.0);

    in.shape = ISOCOAT_SHAPE_SEGMENT;
    memcpy(in.points[1], in.points[0], sizeof in.points[0]);
    OK(isocoat_skeleton_set_desc(world, skeleton, &in));
    OK(isocoat_skeleton_get_desc(world, skeleton, &out));
    CHECK(out.shape == ISOCOAT_SHAPE_POINT);
    in.shape = ISOCOAT_SHAPE_TRIANGLE;
    OK(isocoat_skeleton_set_desc(world, skeleton, &in));
    OK(isocoat_skeleton_get_desc(world, skeleton, &out));
    CHECK(out.shape == ISOCOAT_SHAPE_SEGMENT);
    isocoat_world_destroy(world);
}

static void versions_and_abi(void)
{
    const uint32_t wrong[] = {12};
    const uint32_t version = isocoat_version();
    char text[64];
    OK(isocoat_check_abi());
    CHECK(version == ISOCOAT_VERSION);
    CHECK(strcmp(isocoat_version_string(), ISOCOAT_VERSION_STRING) == 0);
    sprintf(text, "%u.%u.%u", ISOCOAT_VERSION_MAJOR, ISOCOAT_VERSION_MINOR, ISOCOAT_VERSION_PATCH);
    CHECK(strcmp(isocoat_version_string(), text) == 0);
    OK(isocoat_check_abi_of(ISOCOAT_VERSION, NULL, 0));
    REFUSED(isocoat_check_abi_of(ISOCOAT_VERSION, NULL, 1), argument, "sizes is NULL");
    REFUSED(isocoat_check_abi_of(ISOCOAT_VERSION, wrong, 1), ISOCOAT_ERROR_UNSUPPORTED,
            "sizeof(isocoat_body) is 12 in the host; must be 8");
    REFUSED(isocoat_check_abi_of(ISOCOAT_VERSION + (1u << 22), NULL, 0), ISOCOAT_ERROR_UNSUPPORTED,
            "the host was compiled with isocoat");
}

static void messages_are_cut_to_fit(void)
{
    char whole[256], part[8];
    size_t length;
    REFUSED(isocoat_world_step(NULL, 0.1), argument, "world is NULL");
    length = isocoat_last_error(NULL, 0);
    CHECK(length == strlen("world is NULL"));
    CHECK(isocoat_last_error(whole, sizeof whole) == length && strlen(whole) == length);
    CHECK(isocoat_last_error(part, sizeof part) == length && strcmp(part, "world i") == 0);
    part[0] = 'x';
    CHECK(isocoat_last_error(part, 0) == length && part[0] == 'x');
    CHECK(isocoat_last_error(part, 1) == length && part[0] == '\0');
    /* A call that succeeds leaves the message as it is. */
    OK(isocoat_check_abi());
    CHECK(isocoat_last_error(NULL, 0) == length);
    CHECK(strcmp(isocoat_status_name(ISOCOAT_OK), "ISOCOAT_OK") == 0);
    CHECK(strcmp(isocoat_status_name(ISOCOAT_ERROR_POISONED), "ISOCOAT_ERROR_POISONED") == 0);
    CHECK(strcmp(isocoat_status_name(ISOCOAT_ERROR_SNAPSHOT), "ISOCOAT_ERROR_SNAPSHOT") == 0);
    CHECK(strcmp(isocoat_status_name(99), "unknown status") == 0);
}

int main(void)
{
    defaults_are_those_of_the_manual();
    init_writes_no_more_than_the_host_has_room_for();
    a_newer_host_is_served_while_it_uses_nothing_new();
    sizes_that_were_never_published_are_refused();
    descriptors_come_back_as_they_were_given();
    shapes_come_back_as_what_they_are();
    versions_and_abi();
    messages_are_cut_to_fit();
    return verdict("structs");
}
