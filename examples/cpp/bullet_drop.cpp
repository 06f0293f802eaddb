// Bullet with coats: 9 balls, 9 capsules and 9 boxes drop into a pit and come to rest. Floor, walls and bodies touch
// through their coats only; Bullet moves the bodies.
//
//     bullet_drop [heights.csv]
//
// Exits with 0 when everything lies still in the pit and no coat was ever pressed through.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <limits>
#include <memory>
#include <vector>

#include <isocoat/isocoat.hpp>
#include <isocoat_bullet.hpp>

namespace {

constexpr double frame = 1.0 / 60.0;
constexpr int frames = 600;
constexpr double half_width = 0.9;    // of the pit [m]
constexpr double gravity = 9.81;      // [m/s^2]
constexpr double box_coat = 0.08;     // thickness on boxes [m]
constexpr double wall_coat = 0.5;     // thickness on floor and walls [m]
constexpr double still = 0.01;        // what counts as rest [m/s]

btScalar scalar(double x) { return btScalar(x); }

/// Faces on faces are the dearest contacts: a pile needs their forces to some per cent, not to the default's half.
isocoat_world_desc settings() {
    isocoat_world_desc desc = isocoat_world_desc_default();
    desc.force_tolerance = 5e-2;
    return desc;
}

/// Bullet's side, in the order that its parts need.
struct physics {
    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btDiscreteDynamicsWorld dynamics{&dispatcher, &broadphase, &solver, &configuration};
};

/// A rigid body of Bullet's, and what is watched of it.
struct coated {
    std::unique_ptr<btCollisionShape> shape;
    std::unique_ptr<btRigidBody> body;
    btVector3 before;
    double speed = 0.0;
};

class pit {
public:
    pit() : coupler(coats.get(), &bullet.dynamics) {
        bullet.dynamics.setGravity(btVector3(0, scalar(-gravity), 0));
        bullet.dynamics.addAction(&coupler);
        add_wall(btVector3(0, 1, 0), 0.0);
        for (const double side : {-1.0, 1.0}) {
            add_wall(btVector3(scalar(-side), 0, 0), -half_width);
            add_wall(btVector3(0, 0, scalar(-side)), -half_width);
        }
        for (int i = 0; i < 27; ++i) {
            add_body(i);
        }
    }

    ~pit() {
        bullet.dynamics.removeAction(&coupler);
        for (auto *all : {&walls, &bodies}) {
            for (const coated &one : *all) {
                bullet.dynamics.removeRigidBody(one.body.get());
            }
        }
    }

    pit(const pit &) = delete;
    pit &operator=(const pit &) = delete;

    /// Advances by a frame; gives the time it took [s].
    double advance() {
        const auto begin = std::chrono::steady_clock::now();
        bullet.dynamics.stepSimulation(scalar(frame), 1, scalar(frame));
        const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
        for (coated &one : bodies) {
            const btVector3 now = one.body->getCenterOfMassPosition();
            one.speed = double((now - one.before).length()) / frame;
            one.before = now;
        }
        return took.count();
    }

    /// Speed of the fastest body over the last frame [m/s].
    double fastest() const {
        double speed = 0.0;
        for (const coated &one : bodies) {
            speed = std::max(speed, one.speed);
        }
        return speed;
    }

    /// How deep touching coats overlap, at most, as Bullet sees their shapes: as a part of what the two are thick.
    double deepest() {
        struct callback : btCollisionWorld::ContactResultCallback {
            btScalar depth = 0;
            btScalar addSingleResult(btManifoldPoint &point, const btCollisionObjectWrapper *, int, int,
                                     const btCollisionObjectWrapper *, int, int) override {
                depth = std::max(depth, -point.getDistance());
                return 0;
            }
        };
        double deepest = 0.0;
        for (const isocoat::contact &contact : coats.contacts()) {
            callback found;
            bullet.dynamics.contactPairTest(body_of(contact.link_a), body_of(contact.link_b), found);
            const double coat = thickness_of(contact.skeleton_a) + thickness_of(contact.skeleton_b);
            deepest = std::max(deepest, double(found.depth) / coat);
        }
        return deepest;
    }

    /// Energy of motion and height [J].
    double energy() const {
        double sum = 0.0;
        for (const coated &one : bodies) {
            const btRigidBody &body = *one.body;
            const btVector3 spin = body.getWorldTransform().getBasis().transpose() * body.getAngularVelocity();
            const double turning = body.isActive() ? double((spin * spin).dot(body.getLocalInertia())) : 0.0;
            sum += 0.5 * (double(body.getMass()) * one.speed * one.speed + turning) +
                   double(body.getMass()) * gravity * double(body.getCenterOfMassPosition().y());
        }
        return sum;
    }

    bool all_inside() const {
        return std::all_of(bodies.begin(), bodies.end(), [](const coated &one) {
            const btVector3 at = one.body->getCenterOfMassPosition();
            return std::abs(double(at.x())) < half_width && std::abs(double(at.z())) < half_width && at.y() > 0;
        });
    }

    int asleep() const {
        return int(std::count_if(bodies.begin(), bodies.end(),
                                 [](const coated &one) { return !one.body->isActive(); }));
    }

    physics bullet;
    isocoat::world coats{settings()};
    isocoat::bullet::coupler coupler;
    std::vector<coated> walls;
    std::vector<coated> bodies;

private:
    btRigidBody *body_of(isocoat_link link) {
        return static_cast<btRigidBody *>(isocoat::link(coats.get(), link).user_data());
    }

    double thickness_of(isocoat_skeleton skeleton) {
        return isocoat::skeleton(coats.get(), skeleton).desc().thickness;
    }

    void add_wall(const btVector3 &inward, double offset) {
        auto shape = std::make_unique<btStaticPlaneShape>(inward, scalar(offset));
        add(walls, std::move(shape), 0.0, btTransform::getIdentity(), wall_coat);
    }

    /// Three layers of nine, each with all three shapes, none quite upright.
    void add_body(int i) {
        std::unique_ptr<btCollisionShape> shape;
        switch (i % 3) {
        case 0: shape = std::make_unique<btSphereShape>(scalar(0.22)); break;
        case 1: shape = std::make_unique<btCapsuleShape>(scalar(0.15), scalar(0.3)); break;
        default: shape = std::make_unique<btBoxShape>(btVector3(1, 1, 1) * scalar(0.2)); break;
        }
        const int layer = i / 9;
        const btVector3 position(scalar(0.55 * (i % 9 / 3 - 1)), scalar(0.5 + 0.6 * layer),
                                 scalar(0.55 * ((i + layer) % 3 - 1)));
        const btQuaternion rotation(scalar(0.3 + 0.7 * i), scalar(0.2 * i), scalar(0.5 - 0.1 * i));
        add(bodies, std::move(shape), 1.0, btTransform(rotation, position), box_coat);
    }

    void add(std::vector<coated> &list, std::unique_ptr<btCollisionShape> shape, double mass,
             const btTransform &pose, double coat) {
        btVector3 inertia(0, 0, 0);
        if (mass > 0.0) {
            shape->calculateLocalInertia(scalar(mass), inertia);
        }
        btRigidBody::btRigidBodyConstructionInfo info(scalar(mass), nullptr, shape.get(), inertia);
        info.m_startWorldTransform = pose;
        // Above what a body at rest shows between ticks, g dt.
        info.m_linearSleepingThreshold = scalar(0.25);
        auto body = std::make_unique<btRigidBody>(info);
        isocoat::bullet::add_coated_body(bullet.dynamics, body.get());

        isocoat_body_desc body_desc = isocoat_body_desc_default();
        body_desc.stiffness_scale = 4e4;
        body_desc.friction = 0.4;
        body_desc.dissipation = 0.5;
        isocoat_link_desc link_desc = isocoat::bullet::link_desc_from(*body);
        link_desc.user_data = body.get();
        isocoat::link link = coats.create_body(body_desc).create_link(link_desc);
        for (const isocoat_skeleton_desc &desc : isocoat::bullet::skeletons_from(*shape, coat)) {
            link.create_skeleton(desc);
        }
        coupler.attach(body.get(), link.raw());
        list.push_back(coated{std::move(shape), std::move(body), pose.getOrigin()});
    }
};

int run(const char *csv_path) {
    pit scene;
    std::ofstream csv;
    if (csv_path) {
        csv.open(csv_path);
        csv << "time";
        for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
            csv << ",body" << i;
        }
        csv << "\n";
    }

    const double energy_before = scene.energy();
    double total = 0.0, slowest = 0.0, top_speed = 0.0, depth = 0.0, last_second = 0.0, last_depth = 0.0;
    std::printf("  time   fastest  energy  contacts  sub-steps  tick\n");
    for (int i = 1; i <= frames; ++i) {
        const double took = scene.advance();
        total += took;
        slowest = std::max(slowest, took);
        top_speed = std::max(top_speed, scene.fastest());
        last_depth = scene.deepest();
        depth = std::max(depth, last_depth);
        if (i > frames - 60) {
            last_second = std::max(last_second, scene.fastest());
        }
        if (i % 60 == 0) {
            const isocoat::counters counters = scene.coats.counters();
            std::printf("%4.0f s %5.3f m/s %5.1f J  %8u  %9u  %.2f ms\n", i * frame, scene.fastest(), scene.energy(),
                        counters.patches, counters.substeps, 1e3 * took);
        }
        if (csv) {
            csv << i * frame;
            for (const coated &one : scene.bodies) {
                csv << ',' << one.body->getCenterOfMassPosition().y();
            }
            csv << "\n";
        }
    }

    const bool at_rest = last_second < still;
    const bool intact = depth < 0.75 && scene.coupler.last_error().empty();
    const bool lost_energy = scene.energy() < energy_before;
    std::printf("27 bodies, %d frames of 1/60 s: %.2f ms a tick, the slowest %.2f ms\n", frames, 1e3 * total / frames,
                1e3 * slowest);
    std::printf("top speed %.2f m/s; in the last second at most %.4f m/s, %d asleep: %s\n", top_speed, last_second,
                scene.asleep(), at_rest ? "at rest" : "NOT AT REST");
    std::printf("coats overlap by up to %.0f%% of their thickness, %.0f%% at the end: %s\n", 1e2 * depth,
                1e2 * last_depth, intact ? "intact" : "PRESSED THROUGH");
    std::printf("energy from %.1f J to %.1f J; %s the pit\n", energy_before, scene.energy(),
                scene.all_inside() ? "all inside" : "NOT ALL INSIDE");
    if (!scene.coupler.last_error().empty()) {
        std::printf("%s\n", scene.coupler.last_error().c_str());
    }
    return at_rest && intact && lost_energy && scene.all_inside() ? 0 : 1;
}

}  // namespace

int main(int argc, char **argv) {
    try {
        return run(argc > 1 ? argv[1] : nullptr);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
