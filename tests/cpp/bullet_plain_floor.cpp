// Coated bodies whose shapes also stand on Bullet's own floor, and bodies that are held by factors, joints and damping:
// nothing blows up, and what is loaded comes to rest.
#include "bullet_scene.hpp"

namespace {

double kinetic(const btRigidBody &body) {
    const btVector3 spin = body.getInvInertiaTensorWorld().inverse() * body.getAngularVelocity();
    return 0.5 * double(body.getLinearVelocity().length2() * body.getMass() + spin.dot(body.getAngularVelocity()));
}

void load(const char *name, int ticks, double stiffness_scale, btScalar mass_above) {
    scene world;
    const material made_of{stiffness_scale, 0.5, 0.5};
    world.add_body(0, btVector3(0, 0, 0), std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), false);
    btRigidBody *low = world.add_ball(btVector3(0, btScalar(0.5), 0), made_of);
    low->setAngularFactor(btVector3(0, 0, 0));
    btRigidBody *high = world.add_ball(btVector3(0, btScalar(2), 0), made_of, mass_above);
    high->setAngularFactor(btVector3(0, 0, 0));
    for (btRigidBody *body : {low, high}) {
        body->setLinearFactor(btVector3(0, 1, 0));
        body->setActivationState(DISABLE_DEACTIVATION);
    }
    double most = 0, sunk = 0;
    for (int i = 0; i < 900; ++i) {
        world.frame(ticks);
        most = std::max(most, kinetic(*high) + double(mass_above * 10 * high->getCenterOfMassPosition().y()));
        if (i > 600) {
            sunk = std::max(sunk, 0.5 - double(low->getCenterOfMassPosition().y()));
        }
    }
    const double gap = double(high->getCenterOfMassPosition().y() - low->getCenterOfMassPosition().y());
    // The load's velocity between ticks holds the impulse against gravity.
    const double speed = std::abs(double(high->getLinearVelocity().y()) - 10.0 / (60.0 * ticks));
    expect(most < 20.5 * double(mass_above) && gap > 0.7 && gap < 1.0 && speed < 0.02 && sunk < 0.02,
           "%s, %.0e Pa, %d tick(s): %.1f kg on 1 kg rests at a gap of %.4f m, %.4f m/s; the lower one sinks %.4f m",
           name, stiffness_scale, ticks, double(mass_above), gap, speed, sunk);
}

void mixed_pile() {
    scene world;
    const material made_of{2e4, 0.4, 0.5};
    world.add_body(0, btVector3(0, 0, 0), std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), false);
    for (int side = 0; side < 4; ++side) {
        const btScalar x = btScalar(side == 0 ? 1.5 : side == 1 ? -1.5 : 0);
        const btScalar z = btScalar(side == 2 ? 1.5 : side == 3 ? -1.5 : 0);
        world.add_body(0, btVector3(x * 2, 2, z * 2), std::make_unique<btBoxShape>(btVector3(
                           btScalar(x == 0 ? 3 : 1.5), 3, btScalar(z == 0 ? 3 : 1.5))), false);
    }
    std::vector<btRigidBody *> balls;
    for (int i = 0; i < 12; ++i) {
        const btScalar x = btScalar(0.8 * (i % 2) - 0.4), z = btScalar(0.8 * (i / 2 % 2) - 0.4);
        balls.push_back(world.add_ball(btVector3(x, btScalar(0.6 + i / 4), z), made_of, 1, btScalar(0.4)));
        isocoat::bullet::enable_ccd(*balls.back(), btScalar(0.2));
    }
    double first = 0;
    for (const btRigidBody *ball : balls) {
        first += 10 * double(ball->getCenterOfMassPosition().y());
    }
    double most = 0, last = 0, fastest = 0;
    for (int i = 0; i < 1200; ++i) {
        world.frame(1);
        double energy = 0;
        fastest = 0;
        for (const btRigidBody *ball : balls) {
            energy += kinetic(*ball) + 10 * double(ball->getCenterOfMassPosition().y());
            fastest = std::max(fastest, double(ball->getLinearVelocity().length()));
        }
        most = std::max(most, energy);
        last = energy;
    }
    bool inside = true;
    for (const btRigidBody *ball : balls) {
        const btVector3 at = ball->getCenterOfMassPosition();
        const bool between = std::abs(at.x()) < btScalar(1.5) && std::abs(at.z()) < btScalar(1.5);
        inside = inside && between && at.y() > btScalar(0.3);
    }
    expect(inside && most < 1.01 * first && last < first && fastest < 0.4,
           "12 coated balls among plain walls: energy from %.2f J, never above %.2f, to %.2f; fastest %.3f m/s", first,
           most, last, fastest);
}

/// A body that may move in a plane only, thrown along it: it stays there, and nothing is lost on the way.
void planar(int ticks) {
    scene world;
    const material made_of{5e4, 0.0, 0.0};
    world.add_floor(made_of);
    btRigidBody *body = world.add_coated(
        1, btVector3(0, 1, 0), std::make_unique<btCapsuleShapeX>(btScalar(0.2), btScalar(0.8)), made_of);
    body->setLinearFactor(btVector3(1, 1, 0));
    body->setAngularFactor(btVector3(0, 0, 1));
    body->setLinearVelocity(btVector3(1, 0, 0));
    body->setAngularVelocity(btVector3(0, 0, 2));
    body->setActivationState(DISABLE_DEACTIVATION);
    const double before = kinetic(*body) + 10;
    double worst = 0;
    bool in_plane = true;
    int since_contact = 0;
    for (int i = 0; i < 300; ++i) {
        world.frame(ticks);
        in_plane = in_plane && body->getCenterOfMassPosition().z() == 0 && body->getAngularVelocity().x() == 0 &&
                   body->getAngularVelocity().y() == 0;
        since_contact = world.touching() ? 0 : since_contact + 1;
        if (since_contact > 2) {
            const btVector3 stored = body->getLinearVelocity();
            body->setLinearVelocity(stored - btVector3(0, btScalar(5.0 / (60 * ticks)), 0));
            worst = std::max(worst,
                             std::abs(kinetic(*body) + 10 * double(body->getCenterOfMassPosition().y()) - before));
            body->setLinearVelocity(stored);
        }
    }
    expect(in_plane && worst < 0.02 * before,
           "%d tick(s): a capsule held in a plane stays there; its energy of %.2f J is kept within %.3f J over 5 s",
           ticks, before, worst);
}

/// A pendulum of Bullet's swings against a coated ball.
void jointed() {
    scene world;
    const material made_of{2e4, 0.3, 0.3};
    btRigidBody *bob = world.add_ball(btVector3(2, 3, 0), made_of);
    btPoint2PointConstraint joint(*bob, btVector3(-2, 0, 0));
    world.dynamics->addConstraint(&joint);
    btRigidBody *ball = world.add_ball(btVector3(0, 1, 0), made_of);
    ball->setGravity(btVector3(0, 0, 0));
    double fastest = 0;
    for (int i = 0; i < 300; ++i) {
        world.frame(1);
        fastest = std::max(fastest, kinetic(*bob) + kinetic(*ball));
    }
    const double length = double((bob->getWorldTransform() * btVector3(-2, 0, 0) - btVector3(0, 3, 0)).length());
    const double speed = double(ball->getLinearVelocity().x());
    expect(length < 0.02 && fastest < 21 && speed < -1 && speed > -7,
           "a bob on a joint hits a ball: it leaves at %.3f m/s, energy at most %.2f of 20 J, the joint opens %.4f m",
           speed, fastest, length);
    world.dynamics->removeConstraint(&joint);
}

/// Heavy damping in the host is not taken for a load.
void damped() {
    scene world;
    const material made_of{2e5, 0.0, 0.3};
    world.add_floor(made_of);
    btRigidBody *free = world.add_ball(btVector3(0, btScalar(0.5), 0), made_of);
    btRigidBody *slow = world.add_ball(btVector3(3, btScalar(0.5), 0), made_of);
    slow->setDamping(btScalar(0.9), btScalar(0.9));
    free->setActivationState(DISABLE_DEACTIVATION);
    slow->setActivationState(DISABLE_DEACTIVATION);
    world.frames(600);
    double low = 1e9, high = 0;
    for (int i = 0; i < 60; ++i) {
        world.frame(1);
        low = std::min(low, double(slow->getCenterOfMassPosition().y()));
        high = std::max(high, double(slow->getCenterOfMassPosition().y()));
    }
    const double sink = 0.5 - double(free->getCenterOfMassPosition().y());
    expect(std::abs(0.5 - low - sink) < 0.05 * sink && high - low < 0.02 * sink,
           "damped by 0.9 a second, a ball sinks %.5f m, moving by %.1e m; without, %.5f m", 0.5 - low, high - low,
           sink);
}

/// A box that tumbles over coats: Bullet turns it with the gyroscopic torque or without.
void tumbling(int flags, const char *name) {
    scene world;
    const material made_of{5e4, 0.0, 0.0};
    world.add_floor(made_of);
    btRigidBody *body = world.add_coated(
        1, btVector3(0, 2, 0), std::make_unique<btCapsuleShapeX>(btScalar(0.2), btScalar(0.8)), made_of);
    body->setFlags(flags);
    body->setAngularVelocity(btVector3(4, 2, 6));
    body->setActivationState(DISABLE_DEACTIVATION);
    const double before = kinetic(*body) + 20;
    double most = 0;
    for (int i = 0; i < 600; ++i) {
        world.frame(2);
        if (!world.touching()) {
            most = std::max(most, kinetic(*body) + 10 * double(body->getCenterOfMassPosition().y()));
        }
    }
    expect(most < 1.1 * before, "a capsule tumbles, gyroscopic torque %s: %.2f J at first, at most %.2f over 10 s",
           name, before, most);
}

}  // namespace

int main() {
    for (const int ticks : {1, 4}) {
        load("on Bullet's floor", ticks, 1e4, 1);
        load("on Bullet's floor", ticks, 1e5, 1);
        load("on Bullet's floor", ticks, 1e4, 5);
    }
    planar(1);
    planar(4);
    mixed_pile();
    jointed();
    damped();
    tumbling(0, "off");
    tumbling(BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY, "implicit");
    return summary("plain floor");
}
