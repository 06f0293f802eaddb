// What the Bullet tests share: a dynamics world, an isocoat world, a coupler between them, and checks that count.
#ifndef ISOCOAT_TESTS_BULLET_SCENE_HPP
#define ISOCOAT_TESTS_BULLET_SCENE_HPP

#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <memory>
#include <vector>

#include "isocoat_bullet.hpp"

#ifdef BT_USE_DOUBLE_PRECISION
constexpr const char *precision = "double";
#else
constexpr const char *precision = "float";
#endif

inline int failures = 0;

/// Prints a figure, and counts it when it is wrong.
__attribute__((format(printf, 2, 3))) inline void expect(bool right, const char *format, ...) {
    std::printf("%s  ", right ? "ok  " : "FAIL");
    std::va_list arguments;
    va_start(arguments, format);
    std::vprintf(format, arguments);
    va_end(arguments);
    std::printf("\n");
    failures += right ? 0 : 1;
}

/// Ends a test program.
inline int summary(const char *name) {
    std::printf("%s (%s): %s\n", name, precision, failures == 0 ? "passed" : "FAILED");
    return failures == 0 ? 0 : 1;
}

inline void must(isocoat_status status) { isocoat::bullet::detail::check(status, "test"); }

/// Of every scene that says nothing else, downwards [m/s²].
constexpr double gravity = 10.0;

/// What a body's motion and height come to [J].
inline double energy_of(const btRigidBody &body) {
    const btVector3 turn = body.getAngularVelocity();
    const btVector3 spin = body.getInvInertiaTensorWorld().inverse() * turn;
    return 0.5 * double(body.getLinearVelocity().length2() * body.getMass() + spin.dot(turn)) +
           gravity * double(body.getMass() * body.getCenterOfMassPosition().y());
}

/// The sink of a ball of half a metre into a floor, both with a coat of half a metre, under a load: their equal
/// pressures meet on a paraboloid.
inline double sink_under(double stiffness, double load) {
    double low = 0, high = 0.5;
    for (int i = 0; i < 60; ++i) {
        const double sink = 0.5 * (low + high);
        (SIMD_PI * stiffness * (1 - sink) * sink * sink < load ? low : high) = sink;
    }
    return low;
}

/// What a coat is made of.
struct material {
    double stiffness_scale = 2e4;
    double friction = 0.0;
    double dissipation = 0.0;
    double static_friction = 0.0;
};

/// Worlds of rigid bodies.
struct rigid_bodies {
    using solver = btSequentialImpulseConstraintSolver;
    using world = btDiscreteDynamicsWorld;
    using coupler = isocoat::bullet::coupler;
};

template <class kind>
class scene_of {
public:
    explicit scene_of(double upwards = -gravity, isocoat_scheme scheme = ISOCOAT_SCHEME_AUTO)
        : dispatcher(&configuration),
          dynamics(std::make_unique<typename kind::world>(&dispatcher, &broadphase, &solver, &configuration)) {
        dynamics->setGravity(btVector3(0, btScalar(upwards), 0));
        isocoat_world_desc desc = isocoat_world_desc_default();
        desc.scheme = scheme;
        must(isocoat_world_create(&desc, &coats));
        coupler = std::make_unique<typename kind::coupler>(coats, dynamics.get());
        dynamics->addAction(coupler.get());
    }

    ~scene_of() {
        if (dynamics && coupler) {
            dynamics->removeAction(coupler.get());
        }
        for (const auto &body : bodies) {
            if (dynamics) {
                dynamics->removeRigidBody(body.get());
            }
        }
        must(isocoat_world_destroy(coats));
    }

    scene_of(const scene_of &) = delete;
    scene_of &operator=(const scene_of &) = delete;

    isocoat_link create_link(const isocoat_link_desc &link_desc, const material &made_of) {
        isocoat_body_desc desc = isocoat_body_desc_default();
        desc.stiffness_scale = made_of.stiffness_scale;
        desc.friction = made_of.friction;
        desc.dissipation = made_of.dissipation;
        desc.static_friction = made_of.static_friction;
        isocoat_body body;
        isocoat_link link;
        must(isocoat_body_create(coats, &desc, &body));
        must(isocoat_link_create(coats, body, &link_desc, &link));
        return link;
    }

    btRigidBody *add_body(btScalar mass, const btVector3 &position, std::unique_ptr<btCollisionShape> shape,
                          bool coated) {
        btVector3 inertia(0, 0, 0);
        if (mass > 0) {
            shape->calculateLocalInertia(mass, inertia);
        }
        btRigidBody::btRigidBodyConstructionInfo info(mass, nullptr, shape.get(), inertia);
        info.m_startWorldTransform.setOrigin(position);
        shapes.push_back(std::move(shape));
        bodies.push_back(std::make_unique<btRigidBody>(info));
        btRigidBody *body = bodies.back().get();
        if (coated) {
            isocoat::bullet::add_coated_body(*dynamics, body);
        } else {
            dynamics->addRigidBody(body);
        }
        return body;
    }

    /// A body whose coat has the surface of its shape.
    btRigidBody *add_coated(btScalar mass, const btVector3 &position, std::unique_ptr<btCollisionShape> shape,
                            const material &made_of, double coat = 0.1) {
        const std::vector<isocoat_skeleton_desc> skeletons = isocoat::bullet::skeletons_from(*shape, coat);
        btRigidBody *body = add_body(mass, position, std::move(shape), true);
        const isocoat_link link = create_link(isocoat::bullet::link_desc_from(*body), made_of);
        for (const isocoat_skeleton_desc &desc : skeletons) {
            isocoat_skeleton skeleton;
            must(isocoat_skeleton_create(coats, link, &desc, &skeleton));
        }
        coupler->attach(body, link);
        return body;
    }

    btRigidBody *add_ball(const btVector3 &position, const material &made_of = material(), btScalar mass = 1,
                          btScalar radius = btScalar(0.5)) {
        return add_coated(mass, position, std::make_unique<btSphereShape>(radius), made_of);
    }

    /// A coated floor with its surface at height 0.
    btRigidBody *add_floor(const material &made_of = material()) {
        return add_coated(0, btVector3(0, 0, 0), std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)),
                          made_of, 0.5);
    }

    /// One frame of 1/60 s in internal ticks of equal length.
    void frame(int ticks = 1) {
        const btScalar tick = btScalar(1) / btScalar(60 * ticks);
        count += dynamics->stepSimulation(tick * btScalar(ticks), ticks, tick);
    }

    void frames(int number, int ticks = 1) {
        for (int i = 0; i < number; ++i) {
            frame(ticks);
        }
    }

    bool touching() const {
        const isocoat_contact *contacts;
        size_t number;
        must(isocoat_world_get_contacts(coats, &contacts, &number));
        return number > 0;
    }

    btDefaultCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher;
    btDbvtBroadphase broadphase;
    typename kind::solver solver;
    std::unique_ptr<typename kind::world> dynamics;
    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::vector<std::unique_ptr<btRigidBody>> bodies;
    isocoat_world *coats = nullptr;
    std::unique_ptr<typename kind::coupler> coupler;
    /// Internal ticks so far.
    int count = 0;
};

using scene = scene_of<rigid_bodies>;

#endif
