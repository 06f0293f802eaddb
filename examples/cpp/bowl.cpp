// Dough runs into a bowl that Bullet moves: a rope of it falls beside the middle, tips the bowl, and comes to lie in it.
//
//     bowl [folder [size]] [--record FILE]
//
// With a folder it leaves pictures there; --record FILE records it. The size is a little more than the number of
// particles: 11500 makes ten thousand. Exits with 0 when the dough is in the bowl, has its volume, nothing has come through
// the bowl, and the bowl has rocked and not turned over.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include <isocoat/isocoat.hpp>
#include <isocoat_bullet.hpp>

#include "../common/picture.h"
#include "../common/record.h"

namespace {

constexpr double gravity = 9.81;  // [m/s^2]
constexpr double frame = 1.0 / 60.0;
constexpr double pi = 3.14159265358979323846;

/// Bullet's side, in the order that its parts need.
struct physics {
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration};
};

isocoat_world_desc settings() {
    isocoat_world_desc desc = isocoat_world_desc_default();
    desc.gravity[2] = -gravity;
    return desc;
}

class kitchen {
public:
    /// Sizes follow the dough, so that any number of particles fills the bowl alike.
    explicit kitchen(double count) : spacing(0.03), radius(spacing * std::cbrt(count) * 0.9) {
        bullet.dynamics.setGravity(btVector3(0, 0, btScalar(-gravity)));
        bullet.dynamics.addAction(&coupler);
        add_ground();
        add_bowl(count);
        add_dough(count);
    }

    ~kitchen() {
        bullet.dynamics.removeAction(&coupler);
        bullet.dynamics.removeRigidBody(bowl.get());
        bullet.dynamics.removeRigidBody(floor.get());
    }

    kitchen(const kitchen &) = delete;
    kitchen &operator=(const kitchen &) = delete;

    void advance() { bullet.dynamics.stepSimulation(btScalar(frame), 1, btScalar(frame)); }

    /// Angle of the bowl's axis to the vertical [degrees].
    double tilt() const {
        const btVector3 axis = bowl->getWorldTransform().getBasis().getColumn(2);
        return std::acos(std::fmin(double(axis.z()), 1.0)) * 180.0 / pi;
    }

    /// Part of the dough that is within the bowl's sphere.
    double inside() const {
        const btVector3 center = bowl->getWorldTransform() * btVector3(0, 0, btScalar(0.5 * radius));
        const auto particles = dough.particles();
        std::size_t count = 0;
        for (const auto &p : particles.positions) {
            const btVector3 way = btVector3(btScalar(p[0]), btScalar(p[1]), btScalar(p[2])) - center;
            count += double(way.length()) < 1.1 * radius;
        }
        return double(count) / double(particles.positions.size());
    }

    /// Particles that are under the bowl: those that have come through it.
    std::size_t escaped() const {
        const btTransform to_bowl = bowl->getWorldTransform().inverse();
        const auto particles = dough.particles();
        std::size_t count = 0;
        for (const auto &p : particles.positions) {
            const btVector3 place = to_bowl * btVector3(btScalar(p[0]), btScalar(p[1]), btScalar(p[2]));
            const btVector3 way = place - btVector3(0, 0, btScalar(0.5 * radius));
            count += double(way.z()) < -0.1 * radius && double(way.length()) > radius;
        }
        return count;
    }

    /// Momentum of dough and bowl together [N s].
    double momentum() const {
        btVector3 sum = bowl->getLinearVelocity() / bowl->getInvMass();
        for (const auto &piece : dough.pieces()) {
            sum += btVector3(btScalar(piece.momentum[0]), btScalar(piece.momentum[1]), btScalar(piece.momentum[2]));
        }
        return double(sum.length());
    }

    double volume() const {
        double sum = 0.0;
        for (const auto &piece : dough.pieces()) {
            sum += piece.volume;
        }
        return sum;
    }

    void picture(const std::string &path) const {
        const double r = radius;
        const picture_view view = {{2.0 * r, -3.6 * r, 3.0 * r}, {0.0, 0.0, 0.9 * r}, {0.0, 0.0, 1.0}, 3.8 * r};
        if (picture_write(coats.get(), &view, UINT64_MAX, 320, 320, path.c_str()) != 0) {
            throw std::runtime_error("cannot write " + path);
        }
    }

    const double spacing;
    const double radius;  // of the bowl [m]
    physics bullet;
    isocoat::world coats{settings()};
    isocoat::bullet::coupler coupler{coats.get(), &bullet.dynamics};
    btStaticPlaneShape plane{btVector3(0, 0, 1), 0};
    std::unique_ptr<btSphereShape> ball;
    btCompoundShape outside;
    std::unique_ptr<btRigidBody> floor, bowl;
    isocoat::substance dough;

private:
    /// Bullet's floor carries the bowl; the coat on it is there for dough that runs over.
    void add_ground() {
        floor = std::make_unique<btRigidBody>(btRigidBody::btRigidBodyConstructionInfo(0, nullptr, &plane));
        floor->setFriction(btScalar(0.8));
        bullet.dynamics.addRigidBody(floor.get());
        isocoat_body_desc body = isocoat_body_desc_default();
        body.kind = ISOCOAT_BODY_RIGID;
        body.friction = 0.8;
        isocoat_link_desc link = isocoat_link_desc_default();
        link.kind = ISOCOAT_LINK_FIXED;
        isocoat_skeleton_desc coat = isocoat_skeleton_desc_default();
        coat.shape = ISOCOAT_SHAPE_PLANE;
        coat.thickness = 0.05;
        coat.points[0][2] = -coat.thickness;
        coat.points[1][2] = 1.0;
        coats.create_body(body).create_link(link).create_skeleton(coat);
    }

    /// Half a ball, hollow: flat pieces for its coat, for Bullet the ball. Its centre of mass is half a radius below the middle.
    void add_bowl(double count) {
        const double coat = 0.6 * spacing * std::cbrt(count / 500.0), mass = 0.3 * count * particle_mass();
        const double inertia = 5.0 / 12.0 * mass * radius * radius;
        ball = std::make_unique<btSphereShape>(btScalar(radius + coat));
        outside.addChildShape(btTransform(btQuaternion::getIdentity(), btVector3(0, 0, btScalar(0.5 * radius))), ball.get());
        btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, &outside,
                                                      btVector3(1, 1, 1) * btScalar(inertia));
        info.m_startWorldTransform.setOrigin(btVector3(0, 0, btScalar(0.5 * radius + coat)));
        info.m_friction = btScalar(0.8);
        info.m_angularDamping = btScalar(0.2);
        bowl = std::make_unique<btRigidBody>(info);
        isocoat::bullet::add_coated_body(bullet.dynamics, bowl.get());
        isocoat_body_desc body = isocoat_body_desc_default();
        body.kind = ISOCOAT_BODY_RIGID;
        body.friction = 0.5;
        body.static_friction = 0.5;
        isocoat::link link = coats.create_body(body).create_link(isocoat::bullet::link_desc_from(*bowl));
        const double polar[] = {0.0, 0.6, 1.1, 1.55};
        const int segments = 12;
        const auto at = [&](int ring, int segment) -> isocoat::vec3 {
            const double theta = polar[ring], phi = 2.0 * pi * segment / segments;
            return {radius * std::sin(theta) * std::cos(phi), radius * std::sin(theta) * std::sin(phi),
                    radius * (0.5 - std::cos(theta))};
        };
        const auto add = [&](const isocoat::vec3 &a, const isocoat::vec3 &b, const isocoat::vec3 &c) {
            isocoat_skeleton_desc piece = isocoat_skeleton_desc_default();
            piece.shape = ISOCOAT_SHAPE_TRIANGLE;
            piece.thickness = coat;
            const isocoat::vec3 *corners[] = {&a, &b, &c};
            for (int corner = 0; corner < 3; ++corner) {
                std::copy(corners[corner]->begin(), corners[corner]->end(), piece.points[corner]);
            }
            link.create_skeleton(piece);
        };
        for (int ring = 0; ring < 3; ++ring) {
            for (int k = 0; k < segments; ++k) {
                add(at(ring, k), at(ring + 1, k), at(ring + 1, k + 1));
                if (ring > 0) {
                    add(at(ring, k), at(ring + 1, k + 1), at(ring, k + 1));
                }
            }
        }
        coupler.attach(bowl.get(), link.raw());
    }

    /// A rope above the bowl, beside its middle.
    void add_dough(double count) {
        isocoat_body_desc body = isocoat_body_desc_default();
        // What falls from higher and lies higher presses harder.
        body.stiffness_scale = 2e4 * std::cbrt(count / 500.0);
        body.friction = 0.5;
        body.static_friction = 0.5;
        body.dissipation = 2.0;
        isocoat_substance_desc desc = isocoat_substance_desc_default();
        desc.spacing = spacing;
        desc.particle_mass = particle_mass();
        desc.cohesion = 30.0 * desc.particle_mass * gravity * spacing;
        desc.damping = 1.0;
        desc.fusion_threshold = 0.0;
        dough = coats.create_body(body).make_substance(desc);
        const double half = 0.3 * radius, beside = 0.35 * radius, bottom = 1.1 * radius;
        const double height = count * spacing * spacing * spacing / std::sqrt(2.0) / (4.0 * half * half);
        dough.fill_box({beside - half, -half, bottom}, {beside + half, half, bottom + height});
    }

    /// Of the density of water.
    double particle_mass() const { return 1000.0 * spacing * spacing * spacing / std::sqrt(2.0); }
};

int run(double count, const char *folder, const char *record) {
    kitchen scene(count);
    recording film;
    if (record_begin(&film, record) || record_frame(&film, scene.coats.get(), 0.0)) {
        throw std::runtime_error("cannot record");
    }
    std::printf("%zu particles, a bowl of %.2f m\n", scene.dough.particle_count(), scene.radius);
    std::printf("time [s]  in the bowl  escaped  pieces  tilt [deg]  momentum [N s]  volume [l]  sub-steps  frame [ms]\n");
    const int frames = 120;
    double rest = 0.0, worst = 0.0, most = 0.0, slowest = 0.0, total = 0.0;
    for (int i = 1; i <= frames; ++i) {
        const auto begin = std::chrono::steady_clock::now();
        scene.advance();
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
        const double volume = scene.volume();
        rest = i == 1 ? volume : rest;
        worst = std::fmax(worst, std::fabs(volume / rest - 1.0));
        most = std::fmax(most, scene.tilt());
        slowest = std::fmax(slowest, took.count());
        total += took.count();
        if (record_frame(&film, scene.coats.get(), i * frame)) throw std::runtime_error("cannot record");
        if (i % 15 == 0) {
            std::printf("%8.2f %12.2f %8zu %7zu %11.1f %15.2f %11.2f %10u %11.1f\n", i * frame, scene.inside(),
                        scene.escaped(), scene.dough.pieces().size(), scene.tilt(), scene.momentum(), 1e3 * volume,
                        scene.coats.counters().substeps, 1e3 * took.count());
            std::fflush(stdout);
            if (folder) {
                char name[32];
                std::snprintf(name, sizeof name, "/bowl%02d.ppm", i / 15);
                scene.picture(folder + std::string(name));
            }
        }
    }
    if (record_end(&film)) throw std::runtime_error("cannot record");
    std::printf("%.0f ms a frame, the slowest %.0f ms; the bowl tipped by %.1f degrees at most, %.1f now; volume off by "
                "%.1f %% at most; %.1f %% in the bowl, %zu through it\n",
                1e3 * total / frames, 1e3 * slowest, most, scene.tilt(), 1e2 * worst, 1e2 * scene.inside(),
                scene.escaped());
    if (!scene.coupler.last_error().empty()) {
        std::printf("%s\n", scene.coupler.last_error().c_str());
    }
    const bool holds = scene.inside() > 0.98 && scene.escaped() == 0 && worst < 0.03 && most > 1.0 && most < 60.0;
    return holds && scene.coupler.last_error().empty() ? 0 : 1;
}

}  // namespace

int main(int argc, char **argv) {
    try {
        const char *record = record_argument(&argc, argv);
        return run(argc > 2 ? std::atof(argv[2]) : 500.0, argc > 1 ? argv[1] : nullptr, record);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
