/* The C++ wrapper: owners, exceptions, ranges, callbacks that throw. */
#include <isocoat/isocoat.hpp>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <stdexcept>
#include <thread>
#include <type_traits>

static int failures = 0;

#define CHECK(condition)                                                                 \
    do {                                                                                 \
        if (!(condition)) {                                                              \
            std::fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
            ++failures;                                                                  \
        }                                                                                \
    } while (0)

static_assert(!std::is_copy_constructible_v<isocoat::world> && std::is_nothrow_move_constructible_v<isocoat::world>);
static_assert(std::is_trivially_copyable_v<isocoat::body> && std::is_nothrow_default_constructible_v<isocoat::link>);

static isocoat::link add_ball(isocoat::world &world, isocoat_link_kind kind, double height)
{
    isocoat_link_desc desc = isocoat_link_desc_default();
    desc.kind = kind;
    desc.mass = 1.0;
    desc.pose.position[2] = height;
    isocoat::link link = world.create_body().create_link(desc);
    isocoat_skeleton_desc skeleton = isocoat_skeleton_desc_default();
    skeleton.stiffness = 10.0;
    skeleton.radius = 0.3;
    link.create_skeleton(skeleton);
    return link;
}

static isocoat::world falling_world()
{
    isocoat_world_desc desc = isocoat_world_desc_default();
    desc.gravity[2] = -9.8;
    isocoat::world world(desc);
    add_ball(world, ISOCOAT_LINK_FIXED, 0.0);
    add_ball(world, ISOCOAT_LINK_POINT_MASS, 0.195);
    return world;
}

static void nouns()
{
    isocoat::world world;
    isocoat::body body = world.create_body();
    CHECK(body && !isocoat::body() && body == body && body != world.create_body());
    isocoat::link link = body.create_link(isocoat_link_desc_default());
    isocoat::skeleton skeleton = link.create_skeleton(isocoat_skeleton_desc_default());
    CHECK(skeleton.parent() == link && link.parent() == body);
    CHECK(body.links().size() == 1 && body.links()[0] == link);
    CHECK(link.skeletons().size() == 1 && link.skeletons()[0] == skeleton);
    CHECK(world.counters().bodies == 2 && world.counters().skeletons == 1);

    isocoat_body_desc desc = body.desc();
    desc.friction = 0.5;
    desc.user_data = &world;
    body.set_desc(desc);
    CHECK(body.desc().friction == 0.5 && body.user_data() == &world && link.user_data() == nullptr);
    body.set_enabled(false);
    link.set_enabled(false);
    skeleton.set_enabled(false);
    CHECK(!body.is_enabled() && !link.is_enabled() && !skeleton.is_enabled());
    CHECK(skeleton.desc().shape == ISOCOAT_SHAPE_POINT && skeleton.user_data() == nullptr);
    skeleton.set_desc(skeleton.desc());
    link.set_desc(link.desc());
    world.set_desc(world.desc());

    skeleton.destroy();
    link.destroy();
    body.destroy();
    try {
        body.is_enabled();
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_INVALID_HANDLE && std::strstr(error.what(), "stale") != nullptr);
        CHECK(error.what()[std::strlen(error.what()) - 1] != '\0');
    }
}

static void springs()
{
    isocoat::world world;
    isocoat::body body = world.create_body();
    isocoat_link_desc link = isocoat_link_desc_default();
    isocoat_spring_desc desc = isocoat_spring_desc_default();
    desc.links[0] = body.create_link(link).raw();
    link.kind = ISOCOAT_LINK_POINT_MASS;
    link.mass = 1.0;
    link.pose.position[0] = 3.0;
    desc.links[1] = body.create_link(link).raw();
    desc.stiffness = 10.0;
    desc.rest_length = 1.0;
    isocoat::spring spring = world.create_spring(desc);
    CHECK(spring.state().tension == 20.0 && spring.user_data() == nullptr && body.springs().size() == 1);
    desc.stiffness = 20.0;
    spring.set_desc(desc);
    CHECK(spring.desc().stiffness == 20.0 && spring.state().tension == 40.0);
    const std::vector<isocoat_spring_desc> row(4, desc);
    const std::vector<isocoat::spring> made = world.create_springs(row);
    CHECK(made.size() == 4 && body.springs().size() == 5 && body.springs()[4] == made[3]);
    CHECK(world.create_springs({}).empty());
    spring.destroy();
    CHECK(body.springs().size() == 4);
}

static void worlds_move()
{
    isocoat::world first = falling_world();
    isocoat_world *raw = first.get();
    int calls = 0;
    first.set_pair_filter([&calls](isocoat_body, isocoat_body) {
        ++calls;
        return true;
    });
    isocoat::world second = std::move(first);
    CHECK(first.get() == nullptr && second.get() == raw);
    second.step(0.01);
    CHECK(calls > 0);
    second = falling_world();
    CHECK(second.counters().bodies == 2);
}

static void steps_and_views()
{
    isocoat::world world = falling_world();
    CHECK(world.contacts().empty());
    world.step(0.01);
    CHECK(world.contacts().size() == 1 && world.events().size() == 1);
    for (const isocoat::contact &contact : world.contacts()) CHECK(std::fabs(contact.normal[2]) > 0.99);
    CHECK(world.events()[0].kind == ISOCOAT_EVENT_BEGIN);
}

static void what_a_callback_throws_comes_out_of_the_step()
{
    isocoat::world world = falling_world();
    world.set_pair_filter([](isocoat_body, isocoat_body) -> bool { throw std::runtime_error("from the filter"); });
    for (int i = 0; i < 2; ++i) {
        try {
            world.step(0.01);
            CHECK(false);
        } catch (const isocoat::error &) {
            CHECK(false);
        } catch (const std::runtime_error &error) {
            CHECK(std::strcmp(error.what(), "from the filter") == 0);
        }
    }
    isocoat_status inside = ISOCOAT_OK;
    world.set_pair_filter([&](isocoat_body, isocoat_body) {
        try {
            world.step(0.01);
        } catch (const isocoat::error &error) {
            inside = error.status();
        }
        return true;
    });
    world.step(0.01);
    CHECK(inside == ISOCOAT_ERROR_LOCKED);
    world.set_pair_filter({});
    world.step(0.01);

    bool heard = false;
    isocoat_body_desc soft = isocoat_body_desc_default();
    soft.stiffness_scale = 1e-3;
    isocoat::world other;
    isocoat_world_desc desc = other.desc();
    desc.gravity[2] = -9.8;
    other.set_desc(desc);
    isocoat::link link = add_ball(other, ISOCOAT_LINK_POINT_MASS, 5.0);
    link.parent().set_desc(soft);
    other.set_log([&](isocoat_log_level level, const char *text) {
        heard = level == ISOCOAT_LOG_WARNING && std::strlen(text) > 0;
    });
    other.step(0.01);
    CHECK(heard);
}

static void motion()
{
    isocoat::world world;
    isocoat::link link = add_ball(world, ISOCOAT_LINK_POINT_MASS, 0.0);
    link.apply_impulse({1, 0, 0});
    link.apply_force({0, 0, 100});
    link.apply_force({0, 0, -100}, {0, 0, 0});
    link.apply_impulse({0, 1, 0}, {0, 0, 0});
    world.step(0.01);
    CHECK(std::fabs(link.state().linear_velocity[0] - 1.0) < 1e-12);
    CHECK(std::fabs(link.state().linear_velocity[1] - 1.0) < 1e-12);
    CHECK(link.wrench().force[0] == 0.0 && link.impulse().force[0] == 0.0);
    link.set_external_acceleration({0, 0, 1}, {0, 0, 0});
    isocoat::link_state state = link.state();
    state.pose.position[0] = 5.0;
    link.set_state(state);
    link.teleport(state);
    CHECK(link.state().pose.position[0] == 5.0);

    std::vector<isocoat_link> links{link.raw()};
    std::vector<isocoat::link_state> states{state};
    states[0].pose.position[1] = 6.0;
    world.set_link_states(links, states);
    std::array<float, 3> position{};
    isocoat::vec3 force{};
    world.get_link_states(links, isocoat::buffer(position.data()), {});
    world.get_link_wrenches(links, isocoat::buffer(force.data()), {});
    world.get_link_impulses(links, {}, isocoat::buffer(force.data()));
    CHECK(position[0] == 5.0f && position[1] == 6.0f && force[2] == 0.0);
    world.set_articulations({}, {}, {});
    try {
        world.set_articulations(links, {}, {});
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_INVALID_ARGUMENT);
    }
    states.clear();
    try {
        world.set_link_states(links, states);
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_INVALID_ARGUMENT);
    }
    CHECK(isocoat::inertia_of_sphere(1.0, 0.1)[0] > 0.0 && isocoat::inertia_of_box(1.0, {1, 1, 1})[4] > 0.0);
    CHECK(isocoat::inertia_of_capsule(1.0, 0.1, 0.2)[8] > 0.0);
}

static void snapshots()
{
    isocoat::world world = falling_world();
    const isocoat::body ball = world.bodies()[1];
    world.step(0.01);
    const std::vector<std::uint8_t> taken = world.snapshot();
    world.step(0.01);
    const isocoat::link_state expected = ball.links()[0].state();
    world.restore(taken);
    CHECK(world.contacts().empty() && world.bodies()[1] == ball);
    world.step(0.01);
    const isocoat::link_state found = ball.links()[0].state();
    CHECK(std::memcmp(&found, &expected, sizeof found) == 0);

    isocoat::world other;
    other.restore(taken);
    other.step(0.01);
    const isocoat::link_state there = other.bodies()[1].links()[0].state();
    CHECK(std::memcmp(&there, &expected, sizeof there) == 0);

    std::vector<std::uint8_t> damaged = taken;
    damaged[100] ^= 1;
    try {
        world.restore(damaged);
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_SNAPSHOT && std::strstr(error.what(), "checksum") != nullptr);
    }
}

/* A ball that falls on another, with three threads' help and without. */
static void threads_help()
{
    isocoat::world alone = falling_world(), helped = falling_world();
    int started = 0;
    helped.set_tasks(
        3,
        [&started](isocoat_task_fn run, void *task) -> void * {
            ++started;
            return new std::thread(run, task);
        },
        [](void *handle) {
            std::thread *thread = static_cast<std::thread *>(handle);
            thread->join();
            delete thread;
        });
    for (int tick = 0; tick < 20; ++tick) {
        alone.step(0.01);
        helped.step(0.01);
    }
    CHECK(started == 40);
    const isocoat::link_state a = alone.bodies()[1].links()[0].state(), b = helped.bodies()[1].links()[0].state();
    CHECK(std::memcmp(&a, &b, sizeof a) == 0);

    helped.set_tasks(2, [](isocoat_task_fn, void *) -> void * { throw std::runtime_error("from the host"); },
                     [](void *) {});
    try {
        helped.step(0.01);
        CHECK(false);
    } catch (const std::runtime_error &error) {
        CHECK(std::strcmp(error.what(), "from the host") == 0);
    }
    helped.set_tasks(1, {}, {});
    helped.step(0.01);
    CHECK(helped.bodies()[1].is_awake() && helped.times().step == 0.0);
    helped.bodies()[1].wake();
}

/* Three particles in a row, of which the last is put elsewhere. */
static void substances()
{
    isocoat::world world;
    isocoat::body body = world.create_body();
    isocoat_substance_desc desc = isocoat_substance_desc_default();
    isocoat::substance clay = body.make_substance(desc);
    CHECK(clay == body && isocoat::substance(world.bodies()[0]) == clay);
    const std::vector<isocoat::vec3> row = {{0, 0, 0}, {0.1, 0, 0}, {0.2, 0, 0}};
    const std::vector<isocoat::particle> names = clay.add(row);
    CHECK(names.size() == 3 && clay.particle_count() == 3 && clay.add({}).empty());
    CHECK(world.substance_changes().changes.empty());
    world.step(0.01);
    CHECK(clay.pieces().size() == 1 && clay.pieces()[0].particle_count == 3 && clay.pieces()[0].volume > 0.0);

    clay.set_particles({&names[2], 1}, std::vector<isocoat::vec3>{{1, 0, 0}});
    clay.set_particles({&names[2], 1}, {}, std::vector<isocoat::vec3>{{0, 1, 0}});
    clay.add_forces({&names[2], 1}, std::vector<isocoat::vec3>{{0, 0, 100}});
    world.step(0.01);
    const isocoat::change_list changes = world.substance_changes();
    CHECK(changes.changes.size() == 1 && changes.changes[0].kind == ISOCOAT_CHANGE_SPLIT);
    CHECK(changes.of(changes.changes[0]).size() == 1 && changes.of(changes.changes[0])[0] == names[2]);
    CHECK(clay.pieces().size() == 2 && clay.piece_particles(1) == std::vector<isocoat::particle>{names[2]});
    const isocoat::particle_list all = clay.particles();
    CHECK(all.particles == names && all.pieces[2] == 1 && all.labels[2] != all.labels[0] && all.volumes[2] > 0.0);
    CHECK(std::fabs(all.velocities[2][2] - 1.0) < 1e-12 && std::fabs(all.positions[2][1] - 0.01) < 1e-12);

    clay.remove({&names[2], 1});
    try {
        clay.set_particles({&names[2], 1}, {}, std::vector<isocoat::vec3>{{0, 1, 0}});
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_INVALID_HANDLE && std::strstr(error.what(), "particles[0]") != nullptr);
    }
    try {
        clay.set_particles(names, row, {&row[0], 2});
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_INVALID_ARGUMENT);
    }
    CHECK(clay.fill_box({5, 5, 5}, {6, 6, 6}) + clay.fill_ball({9, 9, 9}, 0.5) == clay.particle_count() - 2);
    const std::vector<isocoat::vec3> corners = {{0, 0, 9}, {1, 0, 9}, {0, 1, 9}, {0, 0, 10}};
    const std::vector<std::array<std::uint32_t, 3>> triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    CHECK(clay.fill_mesh(corners, triangles) > 100);
    desc = clay.substance_desc();
    desc.fusion_threshold = 10.0;
    clay.set_substance_desc(desc);
    CHECK(clay.substance_desc().fusion_threshold == 10.0);
}

static void queries()
{
    const isocoat::world world = falling_world();
    const std::vector<isocoat::body> bodies = world.overlap_sphere({0, 0, 0.1}, 0.05);
    CHECK(bodies.size() == 2);
    CHECK(world.collide(bodies[0], bodies[1]).size() == 1);
    const std::optional<isocoat::ray_hit> hit = world.cast_ray({0, 0, 5}, {0, 0, -1}, 10.0);
    CHECK(hit && std::fabs(hit->position[2] - 0.295) < 1e-9);
    CHECK(!world.cast_ray({0, 0, 5}, {0, 0, 1}, 10.0));
    CHECK(std::fabs(bodies[0].closest_point({0, 0, -1})->distance - 0.9) < 1e-9);
    CHECK(std::fabs(bodies[0].closest_point({0, 0, -1}, ISOCOAT_DEFORMATION_BULGES)->distance - 0.9) < 1e-9);
    CHECK(bodies[0].field({0, 0, -1}, ISOCOAT_DEFORMATION_CONTACT) == bodies[0].field({0, 0, -1}));
    CHECK(std::fabs(bodies[0].field({0.1, 0, 0}) - 1.0) < 1e-12);
    const std::vector<isocoat::vec3> points{{0.1, 0, 0}, {0, 0.05, 0}};
    std::vector<double> values(2);
    std::vector<isocoat::vec3> gradients(2);
    bodies[0].evaluate_field(points, values, gradients);
    bodies[0].evaluate_field(points, values);
    CHECK(std::fabs(values[1] - 1.5) < 1e-12 && std::fabs(gradients[1][1] + 10.0) < 1e-9);
    const isocoat::seed_list seeds = bodies[0].links()[0].skeletons()[0].seeds();
    CHECK(seeds.positions.size() >= 64 && seeds.normals.size() == seeds.positions.size() && seeds.valid[0] == 1);

    const isocoat::skeleton point = bodies[0].links()[0].skeletons()[0];
    isocoat::mesh mesh;
    bodies[0].make_mesh(mesh, 0.02);
    CHECK(mesh.triangles().size() == 2 * mesh.positions().size() - 4);
    CHECK(mesh.normals().size() == mesh.view().vertex_count);
    bodies[0].make_mesh(mesh, 0.02, ISOCOAT_DEFORMATION_CONTACT);
    CHECK(mesh.view().vertex_count > 0 && mesh.view().valid == nullptr);
    CHECK(mesh.weights().empty() && mesh.strongest().empty() && mesh.pressures().empty());
    bodies[0].make_mesh(mesh, 0.02, ISOCOAT_DEFORMATION_CONTACT, ISOCOAT_MESH_WEIGHTS | ISOCOAT_MESH_PRESSURES);
    CHECK(mesh.weights().size() == mesh.view().vertex_count && mesh.weights().front()[0] > 0.25);
    CHECK(mesh.strongest().size() == mesh.weights().size() && mesh.strongest().front()[0].generation != 0);
    CHECK(mesh.pressures().size() == mesh.weights().size() && mesh.pressures().front() >= 0.0);
    point.make_mesh(mesh);
    CHECK(mesh.positions() == seeds.positions);

    const std::vector<isocoat::vec3> origins = {{0, 0, 5}, {0, 0, 5}}, directions = {{0, 0, -1}, {0, 0, 1}};
    const std::vector<isocoat::ray_hit> hits = world.cast_rays(origins, directions);
    CHECK(std::fabs(hits[0].distance - hit->distance) < 1e-12 && hits[0].skeleton.index == hit->skeleton.index);
    CHECK(std::isinf(hits[1].distance) && hits[1].body.generation == 0);
    isocoat::skin skin = isocoat::body(bodies[0]).create_skin(mesh.positions(), mesh.normals());
    CHECK(skin.parent() == bodies[0] && skin.vertex_count() == mesh.positions().size());
    CHECK(skin.weights(0).size() == 1 && skin.weights(0)[0].second == 1.0);
    CHECK(skin.positions().size() == skin.vertex_count());
    std::vector<std::array<float, 6>> vertices(skin.vertex_count());
    skin.deform(isocoat::buffer(vertices[0].data(), sizeof vertices[0]),
                isocoat::buffer(vertices[0].data() + 3, sizeof vertices[0]), vertices.size());
    CHECK(vertices[1][0] == float(skin.positions()[1][0]));
    skin.destroy();
    try {
        skin.positions();
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_INVALID_HANDLE);
    }
    CHECK(point.volume() == bodies[0].volume() && point.volume() > 0.0 && point.offset() == 0.0);
    try {
        isocoat::skeleton(point).set_target_volume(point.target_volume());
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_UNSUPPORTED);
    }

    int drawn = 0;
    world.debug_draw(
        ISOCOAT_DRAW_SKELETONS | ISOCOAT_DRAW_BOUNDS, [&](const double *, const double *, std::uint32_t) { ++drawn; },
        [&](const double *, double, std::uint32_t) { ++drawn; });
    CHECK(drawn >= 26);
    try {
        world.debug_draw(ISOCOAT_DRAW_SEEDS, {}, [](const double *, double, std::uint32_t) { throw 42; });
        CHECK(false);
    } catch (int thrown) {
        CHECK(thrown == 42);
    }
}

static void fits()
{
    isocoat::world world;
    isocoat::body body = world.create_body();
    isocoat::link link = body.create_link(isocoat_link_desc_default());
    const std::vector<isocoat::vec3> corners = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    const std::vector<std::array<std::uint32_t, 3>> triangles = {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}};
    isocoat_fit_desc desc = isocoat_fit_desc_default();
    desc.count = 8;
    const isocoat::fitted_coat coat = isocoat::fit_mesh(desc, corners, triangles);
    CHECK(coat.skeletons.size() == 8 && coat.bones[7] == 0 && coat.distance.mean < 0.05);
    CHECK(link.create_skeletons(coat.skeletons).size() == 8);
    const std::vector<isocoat::link> links = {link};
    CHECK(body.create_fitted(coat, links, link.state().pose).size() == 8 && link.skeletons().size() == 16);
    try {
        desc.count = 0;
        isocoat::fit_mesh(desc, corners, triangles);
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_OUT_OF_RANGE);
    }
}

static void recordings()
{
    isocoat::world world;
    isocoat::body ball = world.create_body();
    ball.create_link(isocoat_link_desc_default()).create_skeleton(isocoat_skeleton_desc_default());
    isocoat::recorder memory;
    std::vector<std::uint8_t> file;
    isocoat::recorder stream([&](isocoat::span<const std::uint8_t> bytes) {
        file.insert(file.end(), bytes.begin(), bytes.end());
        return true;
    });
    for (int frame = 0; frame < 3; ++frame) {
        memory.capture(world, 0.5 * frame);
        stream.capture(world, 0.5 * frame);
        if (frame == 1) world.create_body();
    }
    stream.finish();
    CHECK(memory.frame_count() == 3 && memory.byte_count() < memory.bytes().size() && memory.bytes() == file);
    isocoat::playback playback(file);
    CHECK(playback.frame_count() == 3 && playback.time(2) == 1.0 && playback.world().bodies().empty());
    CHECK(playback.seek(2).bodies().size() == 2 && playback.seek(0).bodies().size() == 1);
    isocoat::playback moved = std::move(playback);
    CHECK(moved.world().cast_ray({0, 0, 5}, {0, 0, -1}, 10.0)->distance == world.cast_ray({0, 0, 5}, {0, 0, -1}, 10.0)->distance);
    CHECK(moved.world().snapshot().size() > 0);
    try {
        moved.world().bodies()[0].destroy();
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_UNSUPPORTED);
    }
    file[file.size() / 2] ^= 1;
    try {
        isocoat::playback damaged(file);
        CHECK(false);
    } catch (const isocoat::error &error) {
        CHECK(error.status() == ISOCOAT_ERROR_RECORDING);
    }
    isocoat::recorder thrower([](isocoat::span<const std::uint8_t>) -> bool { throw 42; });
    try {
        thrower.capture(world, 0.0);
        CHECK(false);
    } catch (int thrown) {
        CHECK(thrown == 42);
    }
}

int main()
{
    isocoat::check_abi();
    nouns();
    springs();
    worlds_move();
    steps_and_views();
    what_a_callback_throws_comes_out_of_the_step();
    motion();
    snapshots();
    fits();
    recordings();
    threads_help();
    substances();
    queries();
    if (failures == 0) std::puts("wrapper: all checks hold");
    return failures == 0 ? 0 : 1;
}
