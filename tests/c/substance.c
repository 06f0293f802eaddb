/* Substances: lumps that fall, rest, fuse and come apart; what their calls refuse. */
#include "check.h"

#include <stddef.h>

static const double GRAVITY = 9.81, SPACING = 0.05;
static const isocoat_status argument = ISOCOAT_ERROR_INVALID_ARGUMENT, range = ISOCOAT_ERROR_OUT_OF_RANGE;
static const isocoat_status handle = ISOCOAT_ERROR_INVALID_HANDLE, unsupported = ISOCOAT_ERROR_UNSUPPORTED;

static isocoat_buffer none(void)
{
    const isocoat_buffer buffer = {NULL, 0, ISOCOAT_FORMAT_F64};
    return buffer;
}

static isocoat_buffer into(double *data)
{
    isocoat_buffer buffer = none();
    buffer.data = data;
    return buffer;
}

/* Clay of a density like water's: a pair's stiffness carries a lump some hundred particles high. */
static isocoat_substance_desc clay(void)
{
    isocoat_substance_desc desc = isocoat_substance_desc_default();
    desc.spacing = SPACING;
    desc.particle_mass = 1000.0 * SPACING * SPACING * SPACING / sqrt(2.0);
    desc.cohesion = 200.0 * desc.particle_mass * GRAVITY * SPACING;
    desc.damping = 1.0;
    return desc;
}

static isocoat_body new_substance(isocoat_world *world, const isocoat_substance_desc *desc)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_body body;
    body_desc.stiffness_scale = 2e4;
    body_desc.friction = 0.6;
    body_desc.static_friction = 0.8;
    body_desc.dissipation = 2.0;
    OK(isocoat_body_create(world, &body_desc, &body));
    OK(isocoat_body_make_substance(world, body, desc));
    return body;
}

static isocoat_world *heavy_world(void)
{
    isocoat_world_desc desc = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    desc.gravity[2] = -GRAVITY;
    OK(isocoat_world_create(&desc, &world));
    return world;
}

/* Its surface is the plane z = 0. */
static isocoat_body new_ground(isocoat_world *world)
{
    const isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_skeleton_desc shape = isocoat_skeleton_desc_default();
    isocoat_body body;
    isocoat_link link;
    isocoat_skeleton skeleton;
    body_desc.kind = ISOCOAT_BODY_RIGID;
    body_desc.friction = 0.6;
    body_desc.static_friction = 0.8;
    OK(isocoat_body_create(world, &body_desc, &body));
    OK(isocoat_link_create(world, body, &link_desc, &link));
    shape.shape = ISOCOAT_SHAPE_PLANE;
    shape.points[0][2] = -shape.thickness;
    shape.points[1][2] = 1.0;
    OK(isocoat_skeleton_create(world, link, &shape, &skeleton));
    return body;
}

static size_t count_of(const isocoat_world *world, isocoat_body body)
{
    size_t count = 99;
    OK(isocoat_substance_get_particle_count(world, body, &count));
    return count;
}

static size_t pieces_of(const isocoat_world *world, isocoat_body body)
{
    size_t count = 99;
    OK(isocoat_substance_get_pieces(world, body, NULL, 0, &count));
    return count;
}

static void descriptors_come_back_and_are_checked(void)
{
    isocoat_world *world = new_world();
    isocoat_substance_desc desc = clay(), got = isocoat_substance_desc_default();
    const isocoat_body rigid = new_ground(world), linked = new_ball(world, ISOCOAT_LINK_FIXED, 0.0).body;
    const isocoat_body plain = new_body(world);
    const isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_link link = {0, 0, 0};
    isocoat_body body, null_body = {0, 0, 0};

    CHECK(got.struct_size == sizeof got && got.seed_count == 64 && got.spacing == 0.1 && got.particle_mass == 1.0);
    CHECK(got.cohesion == 1.0 && got.viscosity == 0.0 && got.damping == 0.2 && isinf(got.fusion_threshold));
    CHECK(got.blend_time == 0.5 && got.volume_gain == 0.5 && got.thickness == 0.0 && got.radius == 0.0);
    REFUSED(isocoat_substance_desc_init(NULL, sizeof desc), argument, "desc is NULL");
    REFUSED(isocoat_substance_desc_init(&got, 16), argument, "struct_size of isocoat_substance_desc is 16");

    desc.seed_count = 32;
    desc.viscosity = 3.0;
    desc.damping = 0.4;
    desc.fusion_threshold = 100.0;
    desc.blend_time = 0.25;
    desc.volume_gain = 0.125;
    desc.thickness = 0.6 * SPACING;
    desc.radius = 1.5 * SPACING;
    body = new_substance(world, &desc);
    OK(isocoat_substance_get_desc(world, body, &got));
    CHECK(got.struct_size == sizeof got && got.seed_count == 32 && got.spacing == SPACING);
    CHECK(got.particle_mass == desc.particle_mass && got.cohesion == desc.cohesion && got.viscosity == 3.0);
    CHECK(got.damping == 0.4 && got.fusion_threshold == 100.0 && got.blend_time == 0.25 && got.volume_gain == 0.125);
    CHECK(got.thickness == 0.6 * SPACING && got.radius == 1.5 * SPACING);

    REFUSED(isocoat_body_make_substance(world, body, &desc), unsupported, "once");
    REFUSED(isocoat_body_make_substance(world, rigid, &desc), unsupported, "rigid");
    REFUSED(isocoat_body_make_substance(world, linked, &desc), unsupported, "without links");
    REFUSED(isocoat_body_make_substance(world, null_body, &desc), handle, "body: the handle is null");
    REFUSED(isocoat_body_make_substance(world, plain, NULL), argument, "desc is NULL");
    REFUSED(isocoat_substance_get_desc(world, body, NULL), argument, "desc is NULL");
    REFUSED(isocoat_substance_get_desc(world, plain, &got), unsupported, "not a substance");
    REFUSED(isocoat_substance_set_desc(world, plain, &desc), unsupported, "not a substance");
    REFUSED(isocoat_link_create(world, body, &link_desc, &link), unsupported, "particles in place of links");
    body_desc.kind = ISOCOAT_BODY_RIGID;
    REFUSED(isocoat_body_set_desc(world, body, &body_desc), unsupported, "rigid");

#define WRONG(field, value, text)                                                   \
    do {                                                                            \
        isocoat_substance_desc wrong = desc;                                        \
        wrong.field = value;                                                        \
        REFUSED(isocoat_substance_set_desc(world, body, &wrong), range, text);      \
        REFUSED(isocoat_body_make_substance(world, plain, &wrong), range, text);    \
    } while (0)
    WRONG(spacing, 0.0, "spacing is 0; must be from 1e-9 to 1e6");
    WRONG(particle_mass, 0.0, "particle_mass is 0; must be > 0");
    WRONG(cohesion, -1.0, "cohesion is -1; must be from 0");
    WRONG(viscosity, NAN, "viscosity is NaN");
    WRONG(damping, 101.0, "damping is 101; must be from 0 to 100");
    WRONG(fusion_threshold, -1.0, "fusion_threshold is -1; must be at least 0");
    WRONG(fusion_threshold, NAN, "fusion_threshold is NaN");
    WRONG(blend_time, 0.0, "blend_time is 0; must be > 0");
    WRONG(volume_gain, 0.6, "volume_gain is 0.6; must be from 0 to 0.5");
    WRONG(thickness, 0.1 * SPACING, "thickness is");
    WRONG(radius, 4.0 * SPACING, "radius is");
    WRONG(seed_count, 3, "seed_count is 3; must be from 4 to 4096");
#undef WRONG
    OK(isocoat_substance_get_desc(world, body, &got));
    CHECK(got.spacing == SPACING && got.seed_count == 32);
    desc.fusion_threshold = INFINITY;
    OK(isocoat_substance_set_desc(world, body, &desc));
    OK(isocoat_substance_get_desc(world, body, &got));
    CHECK(isinf(got.fusion_threshold));
    isocoat_world_destroy(world);
}

static void particles_come_and_go_by_name(void)
{
    const double positions[4][3] = {{0.0, 0.0, 0.0}, {0.05, 0.0, 0.0}, {0.0, 0.05, 0.0}, {1.0, 0.0, 0.0}};
    const double velocities[4][3] = {{1.0, 2.0, 3.0}, {0.0, 0.0, 0.0}, {4.0, 5.0, 6.0}, {0.0, 0.0, -1.0}};
    const isocoat_substance_desc desc = clay();
    isocoat_world *world = new_world();
    const isocoat_body body = new_substance(world, &desc);
    isocoat_particle names[4] = {0, 0, 0, 0}, more = 0, got[5];
    struct {
        float place[3];
        int own;
    } mixed[5];
    double places[5][3], speeds[5][3], volumes[5];
    uint32_t pieces[5], labels[5];
    isocoat_buffer strided = none();
    size_t count = 99;
    int i;

    OK(isocoat_substance_get_particles(world, body, NULL, none(), none(), NULL, NULL, NULL, 0, &count));
    CHECK(count == 0 && pieces_of(world, body) == 0);
    OK(isocoat_substance_add_particles(world, body, NULL, NULL, 0, NULL));
    OK(isocoat_substance_add_particles(world, body, positions[0], velocities[0], 4, names));
    OK(isocoat_substance_add_particles(world, body, positions[3], NULL, 1, NULL));
    CHECK(names[0] != 0 && names[0] != names[1] && names[1] != names[2] && names[2] != names[3]);
    CHECK(count_of(world, body) == 5);
    OK(isocoat_substance_get_particles(world, body, got, into(places[0]), into(speeds[0]), volumes, pieces, labels, 5,
                                       &count));
    CHECK(count == 5 && memcmp(got, names, sizeof names) == 0 && memcmp(places, positions, sizeof positions) == 0);
    CHECK(memcmp(speeds, velocities, sizeof velocities) == 0 && speeds[4][0] == 0.0 && speeds[4][2] == 0.0);
    CHECK(labels[0] == labels[3] && labels[4] != labels[0] && volumes[0] == 0.0);

    /* Into a field of the host's own structs, in the other precision. */
    memset(mixed, 0, sizeof mixed);
    for (i = 0; i < 5; ++i) mixed[i].own = i;
    strided.data = mixed[0].place;
    strided.stride = sizeof mixed[0];
    strided.format = ISOCOAT_FORMAT_F32;
    OK(isocoat_substance_get_particles(world, body, NULL, strided, none(), NULL, NULL, NULL, 5, &count));
    CHECK(mixed[1].place[0] == 0.05f && mixed[2].place[1] == 0.05f && mixed[4].own == 4);

    /* The last one takes the place of who goes; names stay. A new one in the same slot has a name of its own. */
    OK(isocoat_substance_remove_particles(world, body, &names[1], 1));
    CHECK(count_of(world, body) == 4);
    REFUSED(isocoat_substance_remove_particles(world, body, &names[1], 1), handle,
            "particles[0]: particle: it was removed, or never was");
    OK(isocoat_substance_add_particles(world, body, positions[1], NULL, 1, &more));
    CHECK(more != names[1] && more != 0);
    REFUSED(isocoat_substance_set_particles(world, body, names, positions[0], NULL, 4), handle, "particles[1]");

    {
        const double there[3] = {7.0, 8.0, 9.0}, fast[3] = {0.5, 0.0, 0.0};
        OK(isocoat_substance_set_particles(world, body, &names[2], there, NULL, 1));
        OK(isocoat_substance_set_particles(world, body, &names[3], NULL, fast, 1));
        OK(isocoat_substance_set_particles(world, body, &names[3], NULL, NULL, 1));
        OK(isocoat_substance_get_particles(world, body, got, into(places[0]), into(speeds[0]), NULL, NULL, NULL, 5,
                                           &count));
        CHECK(count == 5);
        for (i = 0; i < 5; ++i) {
            if (got[i] == names[2]) CHECK(places[i][1] == 8.0 && speeds[i][2] == 6.0);
            if (got[i] == names[3]) CHECK(places[i][0] == 1.0 && speeds[i][0] == 0.5);
        }
    }
    isocoat_world_destroy(world);
}

static void what_makes_no_sense_is_refused_and_changes_nothing(void)
{
    VEC(low, 0.0, 0.0, 0.0);
    VEC(high, 0.2, 0.2, 0.2);
    VEC(wild, 0.0, NAN, 0.0);
    VEC(force, 0.0, 0.0, 1.0);
    const double vertices[4][3] = {{0, 0, 0}, {0.4, 0, 0}, {0, 0.4, 0}, {0, 0, 0.4}};
    const uint32_t triangles[4][3] = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, outside[3] = {0, 1, 4};
    const double two[2][3] = {{0.0, 0.0, 0.0}, {INFINITY, 0.0, 0.0}};
    const isocoat_substance_desc desc = clay();
    isocoat_world *world = new_world(), *other = new_world();
    const isocoat_body body = new_substance(world, &desc), plain = new_body(world), null_body = {0, 0, 0};
    const isocoat_body foreign = new_substance(other, &desc);
    isocoat_particle names[2] = {0, 0}, twice[2], row[8];
    isocoat_piece pieces[2];
    const isocoat_change *changes = NULL;
    const isocoat_particle *changed = NULL;
    double before[2][3], after[2][3];
    size_t count = 99, fill = 99;

    OK(isocoat_substance_add_particles(world, body, vertices[0], NULL, 2, names));
    twice[0] = twice[1] = names[0];
    OK(isocoat_substance_get_particles(world, body, NULL, into(before[0]), none(), NULL, NULL, NULL, 2, &count));

    REFUSED(isocoat_substance_add_particles(world, body, NULL, NULL, 1, NULL), argument, "positions is NULL");
    REFUSED(isocoat_substance_add_particles(world, body, two[0], NULL, 2, row), range, "positions[1]: position");
    REFUSED(isocoat_substance_add_particles(world, body, vertices[0], two[0], 2, row), range, "velocities[1]: vel");
    REFUSED(isocoat_substance_add_particles(world, body, vertices[0], NULL, (size_t)-1 / 8, row), argument,
            "no memory is that large");
    REFUSED(isocoat_substance_add_particles(world, plain, low, NULL, 1, NULL), unsupported, "not a substance");
    REFUSED(isocoat_substance_add_particles(world, null_body, low, NULL, 1, NULL), handle, "null");
    REFUSED(isocoat_substance_add_particles(world, foreign, low, NULL, 1, NULL), handle, "another world");
    REFUSED(isocoat_substance_add_particles(NULL, body, low, NULL, 1, NULL), argument, "world is NULL");

    REFUSED(isocoat_substance_fill_box(world, body, NULL, high, &fill), argument, "low is NULL");
    REFUSED(isocoat_substance_fill_box(world, body, low, NULL, &fill), argument, "high is NULL");
    REFUSED(isocoat_substance_fill_box(world, body, low, high, NULL), argument, "count is NULL");
    REFUSED(isocoat_substance_fill_box(world, body, wild, high, &fill), range, "corner of a shape to fill");
    REFUSED(isocoat_substance_fill_box(world, body, high, low, &fill), range, "size of a box to fill is -0.2");
    REFUSED(isocoat_substance_fill_box(world, plain, low, high, &fill), unsupported, "not a substance");
    REFUSED(isocoat_substance_fill_ball(world, body, low, 0.0, &fill), range, "radius of a ball to fill is 0");
    REFUSED(isocoat_substance_fill_ball(world, body, low, 1e4, &fill), ISOCOAT_ERROR_CAPACITY, "1048576");
    REFUSED(isocoat_substance_fill_ball(world, body, NULL, 1.0, &fill), argument, "center is NULL");
    REFUSED(isocoat_substance_fill_mesh(world, body, vertices[0], 4, outside, 1, &fill), range, "is 4; must be below");
    REFUSED(isocoat_substance_fill_mesh(world, body, vertices[0], 4, NULL, 0, &fill), unsupported, "no triangles");
    REFUSED(isocoat_substance_fill_mesh(world, body, NULL, 4, triangles[0], 4, &fill), argument, "vertices is NULL");
    REFUSED(isocoat_substance_fill_mesh(world, body, vertices[0], 4, NULL, 4, &fill), argument, "triangles is NULL");
    CHECK(fill == 99 && count_of(world, body) == 2);

    REFUSED(isocoat_substance_remove_particles(world, body, twice, 2), unsupported, "twice");
    REFUSED(isocoat_substance_remove_particles(world, body, NULL, 1), argument, "particles is NULL");
    REFUSED(isocoat_substance_remove_particles(world, foreign, names, 1), handle, "another world");
    REFUSED(isocoat_substance_remove_particles(world, plain, names, 1), unsupported, "not a substance");
    REFUSED(isocoat_substance_set_particles(world, body, names, two[0], NULL, 2), range, "positions[1]");
    REFUSED(isocoat_substance_set_particles(world, body, names, vertices[1], two[0], 2), range, "velocities[1]");
    REFUSED(isocoat_substance_set_particles(world, body, NULL, low, NULL, 1), argument, "particles is NULL");
    REFUSED(isocoat_substance_add_forces(world, body, names, NULL, 2), argument, "forces is NULL");
    REFUSED(isocoat_substance_add_forces(world, body, names, wild, 1), range, "forces[0]");
    REFUSED(isocoat_substance_add_forces(world, plain, names, force, 1), unsupported, "not a substance");
    names[1] += 1;
    REFUSED(isocoat_substance_add_forces(world, body, names, vertices[0], 2), handle, "particles[1]: particle");
    names[1] -= 1;
    twice[1] = 0;
    REFUSED(isocoat_substance_remove_particles(world, body, twice, 2), handle, "particles[1]: particle");
    CHECK(count_of(world, body) == 2);
    OK(isocoat_substance_get_particles(world, body, NULL, into(after[0]), none(), NULL, NULL, NULL, 2, &count));
    CHECK(memcmp(before, after, sizeof before) == 0);
    count = 99;

    REFUSED(isocoat_substance_get_particle_count(world, plain, &count), unsupported, "not a substance");
    REFUSED(isocoat_substance_get_particle_count(world, body, NULL), argument, "count is NULL");
    CHECK(count == 99);
    row[1] = 77;
    REFUSED(isocoat_substance_get_particles(world, body, row, none(), none(), NULL, NULL, NULL, 1, &count),
            ISOCOAT_ERROR_BUFFER_TOO_SMALL, "capacity is 1; 2 elements");
    CHECK(count == 2 && row[1] == 77);
    REFUSED(isocoat_substance_get_particles(world, body, row, none(), none(), NULL, NULL, NULL, 8, NULL), argument,
            "count is NULL");
    REFUSED(isocoat_substance_get_pieces(world, body, NULL, 1, &count), argument, "pieces is NULL");
    REFUSED(isocoat_substance_get_pieces(world, plain, pieces, 2, &count), unsupported, "not a substance");
    REFUSED(isocoat_substance_get_piece_particles(world, body, 5, row, 8, &count), range, "piece is 5; must be below");
    REFUSED(isocoat_world_get_substance_changes(world, NULL, &count, &changed), argument, "changes is NULL");
    REFUSED(isocoat_world_get_substance_changes(world, &changes, NULL, &changed), argument, "count is NULL");
    REFUSED(isocoat_world_get_substance_changes(world, &changes, &count, NULL), argument, "particles is NULL");

    OK(isocoat_substance_fill_mesh(other, foreign, vertices[0], 4, triangles[0], 4, &fill));
    /* A sixth of the box round it, but for what is lost or gained at its faces. */
    CHECK(fill == count_of(other, foreign) && fill > 60 && fill < 180);
    isocoat_world_destroy(other);
    isocoat_world_destroy(world);
}

/* Forces on two particles that are too far from each other to feel each other. */
static void a_force_moves_its_particle(void)
{
    const double apart[2][3] = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}};
    const double dt = 1.0 / 60.0;
    const isocoat_substance_desc desc = clay();
    isocoat_world *world = new_world();
    const isocoat_body body = new_substance(world, &desc);
    isocoat_particle names[2];
    isocoat_piece pieces[2];
    isocoat_particle mine = 0;
    double force[3] = {0.0, 3.0, 0.0}, speeds[2][3];
    size_t count = 0;
    OK(isocoat_substance_add_particles(world, body, apart[0], NULL, 2, names));
    OK(isocoat_substance_add_forces(world, body, &names[1], force, 1));
    OK(isocoat_substance_add_forces(world, body, &names[1], force, 1));
    OK(isocoat_world_step(world, dt));
    OK(isocoat_world_step(world, dt));
    OK(isocoat_substance_get_particles(world, body, NULL, none(), into(speeds[0]), NULL, NULL, NULL, 2, &count));
    CHECK_NEAR(speeds[1][1], 6.0 / desc.particle_mass * dt, 1e-12);
    CHECK_NEAR(fabs(speeds[0][0]) + fabs(speeds[0][1]) + fabs(speeds[1][0]), 0.0, 1e-12);
    OK(isocoat_substance_get_pieces(world, body, pieces, 2, &count));
    CHECK(count == 2 && pieces[0].particle_count == 1 && pieces[1].particle_count == 1);
    CHECK_NEAR(pieces[1].mass, desc.particle_mass, 0.0);
    CHECK_NEAR(pieces[1].momentum[1], 6.0 * dt, 1e-12);
    CHECK_NEAR(pieces[1].center[0], 1.0, 1e-12);
    /* A ball with a coat of half a spacing. */
    CHECK_NEAR(pieces[0].volume / (4.0 / 3.0 * PI * pow(0.5 * SPACING, 3.0)), 1.0, 0.01);
    OK(isocoat_substance_get_piece_particles(world, body, 1, &mine, 1, &count));
    CHECK(count == 1 && mine == names[1]);
    isocoat_world_destroy(world);
}

static void a_lump_falls_on_a_plane_and_keeps_its_volume_and_its_weight(void)
{
    VEC(low, -0.15, -0.12, 0.05);
    VEC(high, 0.15, 0.12, 0.22);
    VEC(above, 0.0, 0.0, 2.0);
    VEC(down, 0.0, 0.0, -1.0);
    const double dt = 1.0 / 60.0;
    isocoat_substance_desc desc = clay();
    isocoat_world *world = heavy_world();
    isocoat_body body;
    const isocoat_contact *contacts;
    isocoat_particle *names;
    double (*speeds)[3], *volumes;
    double first = 0.0, worst = 0.0, carried = 0.0, fastest = 0.0;
    const int steps = 150, averaged = 30;
    isocoat_piece piece;
    isocoat_ray_hit hit;
    isocoat_surface_point closest;
    bool found = false;
    size_t count = 0, n, i;
    int step;

    /* Gently, so that the surface does not tremble by millimetres a second. */
    desc.volume_gain = 0.1;
    body = new_substance(world, &desc);
    new_ground(world);
    OK(isocoat_substance_fill_box(world, body, low, high, &n));
    CHECK(n > 50 && count_of(world, body) == n);
    names = malloc(n * sizeof *names);
    speeds = malloc(n * sizeof *speeds);
    volumes = malloc(n * sizeof *volumes);
    for (step = 0; step < steps; ++step) {
        double volume = 0.0;
        OK(isocoat_world_step(world, dt));
        OK(isocoat_substance_get_particles(world, body, names, none(), into(speeds[0]), volumes, NULL, NULL, n,
                                           &count));
        for (i = 0; i < count; ++i) volume += volumes[i];
        if (step == 0) first = volume;
        worst = fmax(worst, fabs(volume / first - 1.0));
        if (step >= steps - averaged) {
            OK(isocoat_world_get_contacts(world, &contacts, &count));
            for (i = 0; i < count; ++i) {
                CHECK(contacts[i].skeleton_a.generation == 0 && contacts[i].link_a.generation == 0);
                CHECK(same_body(contacts[i].body_a, body) && contacts[i].link_b.generation != 0);
                carried -= contacts[i].force[2] / averaged;
            }
        }
    }
    for (i = 0; i < n; ++i) fastest = fmax(fastest, sqrt(speeds[i][0] * speeds[i][0] + speeds[i][1] * speeds[i][1] +
                                                         speeds[i][2] * speeds[i][2]));
    CHECK(first > 0.0);
    CHECK_NEAR(worst, 0.0, 0.03);
    CHECK_NEAR(fastest, 0.0, 1e-2);
    CHECK_NEAR(carried / ((double)n * desc.particle_mass * GRAVITY), 1.0, 0.01);
    OK(isocoat_substance_get_pieces(world, body, &piece, 1, &count));
    CHECK(count == 1 && piece.particle_count == n && piece.reserved == 0);
    CHECK_NEAR(piece.volume / first, 1.0, 0.03);
    CHECK_NEAR(piece.mass / ((double)n * desc.particle_mass), 1.0, 1e-12);
    CHECK(piece.center[2] > 0.05 && piece.center[2] < 0.12);
    OK(isocoat_substance_get_piece_particles(world, body, 0, names, n, &count));
    CHECK(count == n);

    /* What is seen of it has neither link nor skeleton. */
    OK(isocoat_world_cast_ray(world, above, down, 10.0, UINT64_MAX, &hit, &found));
    CHECK(found && same_body(hit.body, body) && hit.link.generation == 0 && hit.skeleton.generation == 0);
    OK(isocoat_body_closest_point(world, body, above, &closest, &found));
    CHECK(found && closest.link.generation == 0 && closest.skeleton.generation == 0);
    CHECK_NEAR(closest.distance, hit.distance, 0.03);
    free(volumes);
    free(speeds);
    free(names);
    isocoat_world_destroy(world);
}

/* Two lumps move towards each other without gravity. Gives the pieces in the end, and how many pairs began to fuse. */
static size_t meet(double fusion_threshold, size_t *fused)
{
    VEC(left, -0.14, 0.0, 0.0);
    VEC(right, 0.14, 0.0, 0.0);
    isocoat_substance_desc desc = clay();
    isocoat_world *world = new_world();
    isocoat_body body;
    isocoat_particle *names;
    double (*speeds)[3];
    uint32_t *labels;
    size_t n, half, count, i, pieces;
    int step;

    desc.fusion_threshold = fusion_threshold;
    desc.blend_time = 0.2;
    body = new_substance(world, &desc);
    OK(isocoat_substance_fill_ball(world, body, left, 0.12, &half));
    OK(isocoat_substance_fill_ball(world, body, right, 0.12, &n));
    n += half;
    names = malloc(n * sizeof *names);
    speeds = calloc(n, sizeof *speeds);
    labels = malloc(n * sizeof *labels);
    OK(isocoat_substance_get_particles(world, body, names, none(), none(), NULL, NULL, labels, n, &count));
    CHECK(labels[0] != labels[n - 1]);
    for (i = 0; i < n; ++i) speeds[i][0] = i < half ? 0.25 : -0.25;
    OK(isocoat_substance_set_particles(world, body, names, NULL, speeds[0], n));
    *fused = 0;
    for (step = 0; step < 60; ++step) {
        const isocoat_change *changes = NULL;
        const isocoat_particle *changed = NULL;
        OK(isocoat_world_step(world, 1.0 / 60.0));
        OK(isocoat_world_get_substance_changes(world, &changes, &count, &changed));
        for (i = 0; i < count; ++i) {
            CHECK(same_body(changes[i].body, body));
            if (changes[i].kind == ISOCOAT_CHANGE_FUSED) {
                /* One of each lump: their names were given in a row. */
                const isocoat_particle *pair = changed + changes[i].first_particle;
                CHECK(changes[i].particle_count == 2 && pair[0] != pair[1]);
                CHECK((pair[0] < names[half]) != (pair[1] < names[half]));
                ++*fused;
            }
        }
        if (step == 0) CHECK(pieces_of(world, body) == 2);
    }
    pieces = pieces_of(world, body);
    free(labels);
    free(speeds);
    free(names);
    isocoat_world_destroy(world);
    return pieces;
}

static void lumps_fuse_as_the_threshold_says(void)
{
    size_t fused;
    CHECK(meet(0.0, &fused) == 1);
    CHECK(fused > 0);
    CHECK(meet(INFINITY, &fused) == 2);
    CHECK(fused == 0);
}

/* Half of a row of particles is put elsewhere: it comes off, with an event that names it. */
static void what_is_torn_off_is_told(void)
{
    const isocoat_substance_desc desc = clay();
    isocoat_world *world = new_world();
    const isocoat_body body = new_substance(world, &desc);
    double row[8][3];
    isocoat_particle names[8], listed[8];
    uint32_t pieces[8], labels[8];
    const isocoat_change *changes = NULL;
    const isocoat_particle *changed = NULL;
    size_t count = 0;
    int i;
    memset(row, 0, sizeof row);
    for (i = 0; i < 8; ++i) row[i][0] = i * SPACING;
    OK(isocoat_substance_add_particles(world, body, row[0], NULL, 8, names));
    OK(isocoat_world_step(world, 1.0 / 60.0));
    CHECK(pieces_of(world, body) == 1);
    OK(isocoat_world_get_substance_changes(world, &changes, &count, &changed));
    CHECK(count == 0);
    for (i = 5; i < 8; ++i) row[i][0] += 1.0;
    OK(isocoat_substance_set_particles(world, body, &names[5], row[5], NULL, 3));
    OK(isocoat_world_step(world, 1.0 / 60.0));
    OK(isocoat_world_get_substance_changes(world, &changes, &count, &changed));
    CHECK(count == 1 && changes[0].kind == ISOCOAT_CHANGE_SPLIT && same_body(changes[0].body, body));
    CHECK(changes[0].reserved == 0 && changes[0].particle_count == 3);
    CHECK(memcmp(changed + changes[0].first_particle, &names[5], 3 * sizeof names[0]) == 0);
    OK(isocoat_substance_get_particles(world, body, NULL, none(), none(), NULL, pieces, labels, 8, &count));
    for (i = 0; i < 8; ++i) {
        CHECK(pieces[i] == (i < 5 ? 0u : 1u) && (labels[i] == labels[0]) == (i < 5));
    }
    OK(isocoat_substance_get_piece_particles(world, body, 1, listed, 8, &count));
    CHECK(count == 3 && memcmp(listed, &names[5], 3 * sizeof names[0]) == 0);
    isocoat_world_destroy(world);
}

/* The time of substances came at the end of its struct: a host that does not know it keeps what it has there. */
static void times_tell_of_substances_who_asks_for_them(void)
{
    VEC(center, 0.0, 0.0, 0.0);
    isocoat_world_desc world_desc = isocoat_world_desc_default();
    const isocoat_substance_desc desc = clay();
    isocoat_world *world = NULL;
    isocoat_times times = isocoat_times_default();
    isocoat_body body;
    size_t count = 0;
    world_desc.timed = 1;
    OK(isocoat_world_create(&world_desc, &world));
    body = new_substance(world, &desc);
    OK(isocoat_substance_fill_ball(world, body, center, 0.15, &count));
    OK(isocoat_world_step(world, 1.0 / 60.0));
    OK(isocoat_world_get_times(world, &times));
    CHECK(times.substances > 0.0 && times.substances <= times.step);
    times.struct_size = offsetof(isocoat_times, substances);
    times.substances = -7.0;
    times.step = 0.0;
    OK(isocoat_world_get_times(world, &times));
    CHECK(times.step > 0.0 && times.substances == -7.0 && times.struct_size == offsetof(isocoat_times, substances));
    isocoat_world_destroy(world);
}

int main(void)
{
    descriptors_come_back_and_are_checked();
    particles_come_and_go_by_name();
    what_makes_no_sense_is_refused_and_changes_nothing();
    a_force_moves_its_particle();
    a_lump_falls_on_a_plane_and_keeps_its_volume_and_its_weight();
    lumps_fuse_as_the_threshold_says();
    what_is_torn_off_is_told();
    times_tell_of_substances_who_asks_for_them();
    return verdict("substance");
}
