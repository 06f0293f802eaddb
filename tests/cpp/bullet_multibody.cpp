// Coats on the links of multibodies: what stands on them sinks as its load says, no impulse is lost, and what swings
// against a wall never gains energy.
#include <BulletDynamics/Featherstone/btMultiBodyConstraintSolver.h>
#include <BulletDynamics/Featherstone/btMultiBodyJointMotor.h>

#include "bullet_scene.hpp"
#include "isocoat_bullet_multibody.hpp"

namespace {

struct multibodies {
    using solver = btMultiBodyConstraintSolver;
    using world = btMultiBodyDynamicsWorld;
    using coupler = isocoat::bullet::multibody_coupler;
};

/// A multibody, its colliders and their shapes.
struct chain {
    scene_of<multibodies> &world;
    btMultiBody body;
    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::vector<std::unique_ptr<btMultiBodyLinkCollider>> colliders;

    chain(scene_of<multibodies> &in, int links, btScalar base_mass, const btVector3 &base, bool fixed)
        : world(in), body(links, base_mass, inertia_of(base_mass), fixed, true) {
        body.setBasePos(base);
        body.setLinearDamping(0);
        body.setAngularDamping(0);
        body.setHasSelfCollision(false);
    }

    ~chain() {
        for (const auto &collider : colliders) {
            world.dynamics->removeCollisionObject(collider.get());
        }
        world.dynamics->removeMultiBody(&body);
    }

    chain(const chain &) = delete;
    chain &operator=(const chain &) = delete;

    /// Of a ball with a radius of half a metre.
    static btVector3 inertia_of(btScalar mass) { return btVector3(1, 1, 1) * (mass * btScalar(0.1)); }

    void finish() {
        body.finalizeMultiDof();
        world.dynamics->addMultiBody(&body);
    }

    /// A ball on a link, with a coat of its radius.
    isocoat_link coat(int link, const material &made_of, btScalar radius = btScalar(0.5)) {
        shapes.push_back(std::make_unique<btSphereShape>(radius));
        colliders.push_back(std::make_unique<btMultiBodyLinkCollider>(&body, link));
        btMultiBodyLinkCollider *collider = colliders.back().get();
        collider->setCollisionShape(shapes.back().get());
        collider->setWorldTransform(isocoat::bullet::detail::pose_of(body, link));
        if (link < 0) {
            body.setBaseCollider(collider);
        } else {
            body.getLink(link).m_collider = collider;
        }
        isocoat::bullet::add_coated_link(*world.dynamics, collider);
        const isocoat_link coated = world.create_link(isocoat::bullet::link_desc_from(*collider), made_of);
        for (const isocoat_skeleton_desc &desc : isocoat::bullet::skeletons_from(*shapes.back(), 0.1)) {
            isocoat_skeleton skeleton;
            must(isocoat_skeleton_create(world.coats, coated, &desc, &skeleton));
        }
        world.coupler->attach(collider, coated);
        return coated;
    }

    double height(int link) const { return double(body.localPosToWorld(link, btVector3(0, 0, 0)).y()); }

    double energy() const {
        double sum = 0;
        std::vector<btVector3> turns(std::size_t(body.getNumLinks() + 1)), ways(turns.size());
        body.compTreeLinkVelocities(turns.data(), ways.data());
        for (int link = -1; link < body.getNumLinks(); ++link) {
            if (link < 0 && body.hasFixedBase()) {
                continue;
            }
            const double mass = double(isocoat::bullet::detail::mass_of(body, link));
            const btVector3 inertia = isocoat::bullet::detail::inertia_of(body, link);
            const btVector3 &turn = turns[std::size_t(link + 1)], &way = ways[std::size_t(link + 1)];
            sum += mass * (0.5 * double(way.length2()) + gravity * height(link)) +
                   0.5 * double((turn * inertia).dot(turn));
        }
        return sum;
    }
};

/// A ball at the end of an arm with a load above it, on a coated floor.
void arm(int ticks, double stiffness, double heavy, bool braked) {
    const material made_of{stiffness, 0.0, 0.5};
    scene_of<multibodies> world;
    world.add_floor(made_of);
    chain arm(world, 2, 0, btVector3(-2, btScalar(0.5), 0), true);
    arm.body.setupRevolute(0, 1, chain::inertia_of(1), -1, btQuaternion::getIdentity(), btVector3(0, 0, 1),
                           btVector3(0, 0, 0), btVector3(2, 0, 0));
    arm.body.setupFixed(1, btScalar(heavy), chain::inertia_of(btScalar(heavy)), 0, btQuaternion::getIdentity(),
                        btVector3(0, 1, 0), btVector3(0, 0, 0));
    arm.finish();
    // A brake in the joint, worth a quarter of the load: what Bullet solves as a constraint, no matrix says.
    btMultiBodyJointMotor brake(&arm.body, 0, 0, btScalar(0.25 * 2 * gravity * (1 + heavy) / (60 * ticks)));
    if (braked) {
        world.dynamics->addMultiBodyConstraint(&brake);
    }
    const isocoat_link tip = arm.coat(0, made_of);
    double low = 1, high = -1;
    for (int i = 0; i < 600; ++i) {
        world.frame(ticks);
        if (i >= 540) {
            low = std::min(low, 0.5 - arm.height(0));
            high = std::max(high, 0.5 - arm.height(0));
        }
    }
    isocoat_wrench wrench;
    must(isocoat_link_get_wrench(world.coats, tip, &wrench));
    if (braked) {
        world.dynamics->removeMultiBodyConstraint(&brake);
        const double load = SIMD_PI * stiffness * (1 - high) * high * high;
        const double part = load / (gravity * (1 + heavy));
        expect(std::abs(wrench.force[1] / load - 1) < 0.02 && high - low < 0.01 * high && part > 0.7 && part < 1.3,
               "arm with a brake, %.0e Pa, %d tick(s): sink %.6f m, that of %.3f of the load; moves by %.1e m, carries "
               "%.5f of what the sink says", stiffness, ticks, high, part, high - low, wrench.force[1] / load);
        return;
    }
    // The arm hangs down a little, so that its load leans out.
    const double angle = std::asin(high / 2);
    const double load = gravity * (1 + heavy * (1 + std::tan(angle) / 2));
    const double wanted = sink_under(stiffness, load);
    expect(std::abs(high / wanted - 1) < 0.001 && high - low < 1e-4 * wanted &&
               std::abs(wrench.force[1] / load - 1) < 0.001,
           "arm, %.0f kg, %.0e Pa, %d tick(s): sink %.6f m, wanted %.6f m: %.5f; moves by %.1e m, carries %.5f", heavy,
           stiffness, ticks, high, wanted, high / wanted, high - low, wrench.force[1] / load);
    expect(world.coupler->last_error().empty(), "no error: %s", world.coupler->last_error().c_str());
}

constexpr double heavy = 5.0;

/// A multibody that stands on two balls, with its load nearer to one of them.
void feet(int ticks, double stiffness) {
    const material made_of{stiffness, 0.3, 0.5};
    scene_of<multibodies> world;
    world.add_floor(made_of);
    // It cannot fall over: a rail holds its base in the plane.
    chain beam(world, 4, 1, btVector3(0, 1, 0), true);
    const btQuaternion none = btQuaternion::getIdentity();
    beam.body.setupPlanar(0, 1, chain::inertia_of(1), -1, none, btVector3(0, 0, 1), btVector3(0, 0, 0));
    beam.body.setupFixed(1, 1, chain::inertia_of(1), 0, none, btVector3(-1, btScalar(-0.5), 0), btVector3(0, 0, 0));
    beam.body.setupFixed(2, 1, chain::inertia_of(1), 0, none, btVector3(1, btScalar(-0.5), 0), btVector3(0, 0, 0));
    beam.body.setupFixed(3, btScalar(heavy), chain::inertia_of(btScalar(heavy)), 0, none,
                         btVector3(btScalar(0.5), btScalar(0.2), 0), btVector3(0, 0, 0));
    beam.finish();
    const isocoat_link left = beam.coat(1, made_of);
    const isocoat_link right = beam.coat(2, made_of);
    double low = 1, high = -1, most = -1e9;
    const double first = beam.energy();
    for (int i = 0; i < 1200; ++i) {
        world.frame(ticks);
        most = std::max(most, beam.energy());
        if (i >= 1140) {
            low = std::min(low, 0.5 - beam.height(2));
            high = std::max(high, 0.5 - beam.height(2));
        }
    }
    isocoat_wrench loads[2];
    must(isocoat_link_get_wrench(world.coats, left, &loads[0]));
    must(isocoat_link_get_wrench(world.coats, right, &loads[1]));
    const double all = (3 + heavy) * gravity;
    const double wanted = sink_under(stiffness, loads[1].force[1]);
    expect(std::abs((loads[0].force[1] + loads[1].force[1]) / all - 1) < 0.01 && std::abs(high / wanted - 1) < 0.02 &&
               high - low < 0.01 * wanted && most < first + 0.02 * all,
           "two feet, %.0e Pa, %d tick(s): carry %.4f and %.4f of the weight, the right one sinks %.6f m, wanted %.6f m: "
           "%.5f; moves by %.1e m", stiffness, ticks, loads[0].force[1] / all, loads[1].force[1] / all, high, wanted,
           high / wanted, high - low);
}

/// A ball hits the end of a free chain: what the one loses, the other gets.
void struck(int ticks) {
    const material made_of{2e4, 0.0, 0.0};
    scene_of<multibodies> world(0);
    chain rod(world, 1, 1, btVector3(0, 0, 0), false);
    rod.body.setupSpherical(0, 2, chain::inertia_of(2), -1, btQuaternion::getIdentity(), btVector3(1, 0, 0),
                            btVector3(1, 0, 0));
    rod.finish();
    rod.coat(0, made_of);
    btRigidBody *ball = world.add_ball(btVector3(btScalar(2.3), 2, 0), made_of, 1);
    ball->setLinearVelocity(btVector3(0, -5, 0));
    // Until the contact is over: Bullet by itself keeps the momentum of turning chains only nearly.
    bool hit = false;
    for (int i = 0; i < 60 && !(hit && !world.touching()); ++i) {
        world.frame(ticks);
        hit = hit || world.touching();
    }
    std::vector<btVector3> turns(2), ways(2);
    rod.body.compTreeLinkVelocities(turns.data(), ways.data());
    const btVector3 sum = rod.body.localDirToWorld(-1, ways[0]) + rod.body.localDirToWorld(0, ways[1]) * 2 +
                          ball->getLinearVelocity();
    const double energy = rod.energy() - gravity * (rod.height(-1) + 2 * rod.height(0)) +
                          0.5 * double(ball->getLinearVelocity().length2());
    const double off = double((sum - btVector3(0, -5, 0)).length());
    expect(off < 0.01 && ball->getLinearVelocity().y() > -4 && energy < 12.6,
           "a ball strikes a chain, %d tick(s): momentum of 5 N s is off by %.1e, the ball goes on at %.3f m/s, energy "
           "from 12.50 J to %.2f", ticks, off, double(ball->getLinearVelocity().y()), energy);
}

/// Three links swing against a wall, and come to rest against it.
void pendulum(int ticks, double stiffness, bool spherical) {
    const material made_of{stiffness, 0.2, 0.3};
    scene_of<multibodies> world;
    world.add_coated(0, btVector3(0, 0, 0),
                     std::make_unique<btStaticPlaneShape>(btVector3(1, 0, 0), btScalar(-0.35)), made_of, 0.5);
    chain links(world, 3, 0, btVector3(0, 0, 0), true);
    const btQuaternion none = btQuaternion::getIdentity();
    for (int i = 0; i < 3; ++i) {
        const btVector3 from = i == 0 ? btVector3(0, 0, 0) : btVector3(0, btScalar(-0.5), 0);
        const btVector3 to(0, btScalar(-0.5), 0);
        if (spherical) {
            links.body.setupSpherical(i, 1, chain::inertia_of(1) * btScalar(0.6), i - 1, none, from, to, true);
        } else {
            links.body.setupRevolute(i, 1, chain::inertia_of(1) * btScalar(0.6), i - 1, none, btVector3(0, 0, 1), from,
                                     to, true);
        }
    }
    links.finish();
    links.body.setLinearDamping(btScalar(0.5));
    // Out to the side; the second link a little bent.
    for (int i = 0; i < 3; ++i) {
        const btScalar angle = btScalar(i == 0 ? 1.2 : i == 1 ? 0.3 : 0);
        if (spherical) {
            const btQuaternion turned(btVector3(0, 0, 1), angle);
            const btScalar position[4] = {turned.x(), turned.y(), turned.z(), turned.w()};
            links.body.setJointPosMultiDof(i, position);
        } else {
            links.body.setJointPos(i, angle);
        }
        links.coat(i, made_of, btScalar(0.4));
    }
    const double lowest = -gravity * (0.5 + 1.5 + 2.5);
    const double first = links.energy() - lowest;
    // Highest energy of each second. Bullet's own explicit step gains some in a swing.
    std::vector<double> seconds;
    double tip = 0, still = 0;
    bool hit = false;
    for (int i = 0; i < 3600; ++i) {
        world.frame(ticks);
        hit = hit || world.touching();
        if (i % 60 == 0) {
            seconds.push_back(0);
            tip = double(links.body.localPosToWorld(2, btVector3(0, 0, 0)).x());
            still = 0;
        }
        seconds.back() = std::max(seconds.back(), links.energy() - lowest);
        still = std::max(still, std::abs(double(links.body.localPosToWorld(2, btVector3(0, 0, 0)).x()) - tip));
    }
    double growth = seconds[0] - first;
    for (std::size_t i = 1; i < seconds.size(); ++i) {
        growth = std::max(growth, seconds[i] - seconds[i - 1]);
    }
    expect(hit && growth < (ticks == 1 ? 0.03 : 0.01) * first && seconds.back() < 0.05 * first && still < 1e-3,
           "3 links on %s joints at a wall, %.0e Pa, %d tick(s): %.3f J over the lowest, grows by %.3f J a second at "
           "most, at last %.3f J; the tip moves by %.1e m", spherical ? "spherical" : "revolute", stiffness, ticks, first,
           growth, seconds.back(), still);
}

}  // namespace

int main() {
    for (const int ticks : {1, 4}) {
        for (const double stiffness : {1e4, 1e5, 1e6, 1e7}) {
            arm(ticks, stiffness, 5, false);
        }
        arm(ticks, 1e6, 100, false);
        for (const double stiffness : {1e4, 1e6}) {
            arm(ticks, stiffness, 5, true);
            feet(ticks, stiffness);
            pendulum(ticks, stiffness, false);
            pendulum(ticks, stiffness, true);
        }
        struck(ticks);
    }
    return summary("multibody");
}
