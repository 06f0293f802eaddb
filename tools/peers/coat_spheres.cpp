// Balls by isocoat, on demand: reads a line, answers with a line of figures, until the input ends.
//
//     query SCHEME TOLERANCE RADIUS MODULUS X Y Z    ->  force [N], median processor time of a query [s], evaluations
//         two equal balls, the second's centre at x, y, z
//     scene SCHEME TOLERANCE RADIUS MODULUS MASS FRICTION DT SECONDS COUNT (X Y Z)...
//                                                    ->  processor time [s], mean height at the end [m]
//         balls dropped into a hard box, 6 radii wide, by steps of dt
//
// SCHEME is an ISOCOAT_SCHEME_ value; MODULUS the pressure in the middle of a ball.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <iostream>
#include <sstream>
#include <string>
#include <vector>

#include <isocoat/isocoat.hpp>

namespace {

double clock_now() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// The default profile's pressure in the middle of a ball is twice the stiffness scale.
isocoat_body_desc flesh(double modulus) {
    isocoat_body_desc body = isocoat_body_desc_default();
    body.stiffness_scale = 0.5 * modulus;
    return body;
}

isocoat::body add_ball(isocoat::world &world, const isocoat_body_desc &material, const isocoat_link_desc &link,
                       double radius) {
    isocoat_skeleton_desc point = isocoat_skeleton_desc_default();
    point.thickness = radius;
    isocoat::body ball = world.create_body(material);
    ball.create_link(link).create_skeleton(point);
    return ball;
}

void query(std::istream &words) {
    isocoat_scheme scheme = 0;
    double tolerance = 0.0, radius = 0.0, modulus = 0.0;
    isocoat_link_desc first = isocoat_link_desc_default(), second = first;
    words >> scheme >> tolerance >> radius >> modulus;
    for (double &x : second.pose.position) {
        words >> x;
    }
    isocoat::world world;
    const isocoat::body a = add_ball(world, flesh(modulus), first, radius);
    const isocoat::body b = add_ball(world, flesh(modulus), second, radius);
    std::array<isocoat_contact, 8> contacts{};
    std::size_t count = 0;
    const auto collide = [&] {
        isocoat::check(isocoat_world_collide(world.get(), a.raw(), b.raw(), scheme, tolerance, contacts.data(),
                                             contacts.size(), &count));
    };
    std::vector<double> times;
    for (int series = 0; series < 9; ++series) {
        constexpr int calls = 40;
        const double begin = clock_now();
        for (int i = 0; i < calls; ++i) {
            collide();
        }
        times.push_back((clock_now() - begin) / calls);
    }
    std::sort(times.begin(), times.end());
    double force = 0.0, evaluations = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
        const double *f = contacts[i].force;
        force += std::sqrt(f[0] * f[0] + f[1] * f[1] + f[2] * f[2]);
        evaluations += contacts[i].evaluations;
    }
    std::printf("%.17g %.9g %g\n", force, times[times.size() / 2], evaluations);
}

void scene(std::istream &words) {
    isocoat_world_desc settings = isocoat_world_desc_default();
    double radius = 0.0, modulus = 0.0, mass = 0.0, friction = 0.0, dt = 0.0, seconds = 0.0;
    int count = 0;
    words >> settings.scheme >> settings.force_tolerance >> radius >> modulus >> mass >> friction >> dt >> seconds >>
        count;
    settings.gravity[2] = -9.81;
    isocoat::world world(settings);
    isocoat_body_desc soft = flesh(modulus);
    soft.friction = friction;
    isocoat_body_desc hard = soft;
    hard.kind = ISOCOAT_BODY_RIGID;
    const double wall = 3.0 * radius;
    const auto add_wall = [&](const isocoat::vec3 &normal, double offset) {
        isocoat_skeleton_desc plane = isocoat_skeleton_desc_default();
        plane.shape = ISOCOAT_SHAPE_PLANE;
        for (std::size_t i = 0; i < 3; ++i) {
            // The coat ends where the box begins.
            plane.points[0][i] = normal[i] * (offset - plane.thickness);
            plane.points[1][i] = normal[i];
        }
        world.create_body(hard).create_link(isocoat_link_desc_default()).create_skeleton(plane);
    };
    add_wall({0, 0, 1}, 0.0);
    for (const double side : {-1.0, 1.0}) {
        add_wall({side, 0, 0}, -wall);
        add_wall({0, side, 0}, -wall);
    }
    std::vector<isocoat::link> links;
    for (int i = 0; i < count; ++i) {
        isocoat_link_desc link = isocoat_link_desc_default();
        link.kind = ISOCOAT_LINK_RIGID;
        link.mass = mass;
        isocoat::check(isocoat_inertia_of_sphere(mass, radius, link.inertia));
        for (double &x : link.pose.position) {
            words >> x;
        }
        links.push_back(add_ball(world, soft, link, radius).links().front());
    }
    const double begin = clock_now();
    for (int i = 0; i < int(std::lround(seconds / dt)); ++i) {
        world.step(dt);
    }
    const double took = clock_now() - begin;
    double height = 0.0;
    for (const isocoat::link &link : links) {
        height += link.state().pose.position[2] / count;
    }
    std::printf("%.6g %.9g\n", took, height);
}

} // namespace

int main() {
    try {
        for (std::string line; std::getline(std::cin, line);) {
            std::istringstream words(line);
            std::string what;
            words >> what;
            if (what == "query") {
                query(words);
            } else if (what == "scene") {
                scene(words);
            } else {
                std::fprintf(stderr, "coat_spheres: \"%s\" is neither query nor scene\n", what.c_str());
                return 1;
            }
            std::fflush(stdout);
        }
    } catch (const std::exception &problem) {
        std::fprintf(stderr, "coat_spheres: %s\n", problem.what());
        return 1;
    }
    return 0;
}
