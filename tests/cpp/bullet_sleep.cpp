// Sleep: bodies at rest on coats fall asleep and stay so; whatever a coat asks of them anew wakes them, and no impulse
// is lost then.
#include "bullet_scene.hpp"

namespace {

const material lossy{5e4, 0.5, 0.5};

int sleeping(const std::vector<btRigidBody *> &bodies) {
    int count = 0;
    for (const btRigidBody *body : bodies) {
        count += body->isActive() ? 0 : 1;
    }
    return count;
}

/// Runs until all sleep; gives the number of frames, and whether they fell asleep in the same one.
int until_asleep(scene &world, const std::vector<btRigidBody *> &bodies, int ticks, bool &together) {
    int first = 0;
    for (int i = 1; i <= 1800; ++i) {
        world.frame(ticks);
        const int count = sleeping(bodies);
        first = count > 0 ? (first == 0 ? i : first) : 0;
        if (count == int(bodies.size())) {
            together = first == i;
            return i;
        }
    }
    together = false;
    return 1800;
}

std::unique_ptr<btCollisionShape> box() { return std::make_unique<btBoxShape>(btVector3(1, 1, 1) * btScalar(0.5)); }

std::vector<btRigidBody *> stack(scene &world) {
    world.add_floor(lossy);
    std::vector<btRigidBody *> bodies;
    for (int i = 0; i < 3; ++i) {
        bodies.push_back(world.add_coated(1, btVector3(0, btScalar(0.5 + i), 0), box(), lossy));
    }
    return bodies;
}

void stays_asleep(int ticks) {
    scene world(-gravity, ISOCOAT_SCHEME_SEEDS);
    const std::vector<btRigidBody *> bodies = stack(world);
    bool together = false;
    const int frames = until_asleep(world, bodies, ticks, together);
    expect(frames < 600 && together, "%d tick(s): a stack of three sleeps after %d frames, all at once: %s", ticks,
           frames, together ? "yes" : "no");
    const btVector3 before = bodies[2]->getCenterOfMassPosition();
    int woken = 0;
    for (int i = 0; i < 600; ++i) {
        world.frame(ticks);
        woken += 3 - sleeping(bodies);
    }
    expect(woken == 0 && bodies[2]->getCenterOfMassPosition() == before && world.touching(),
           "  and ten seconds later it still does (awake for %d frames), pressed at %.5f m", woken, double(before.y()));

    world.dynamics->removeRigidBody(bodies[0]);
    world.frames(30, ticks);
    const double fallen = double(before.y() - bodies[2]->getCenterOfMassPosition().y());
    expect(sleeping(bodies) < 3 && fallen > 0.5, "  without its lowest box the rest falls: %.3f m in half a second",
           fallen);
    world.dynamics->addRigidBody(bodies[0]);
}

void notices_what_isocoat_loses(int ticks) {
    // With everything asleep, the host takes the floor's coat away.
    scene world;
    btRigidBody *floor = world.add_floor(lossy);
    btRigidBody *ball = world.add_ball(btVector3(0, btScalar(0.5), 0), lossy);
    bool together;
    until_asleep(world, {ball}, ticks, together);
    world.frames(100, ticks);
    const btScalar before = ball->getCenterOfMassPosition().y();
    must(isocoat_link_set_enabled(world.coats, world.coupler->link_of(floor), false));
    world.frames(100, ticks);
    const double fallen = double(before - ball->getCenterOfMassPosition().y());
    expect(fallen > 1, "%d tick(s): a floor whose coat is disabled lets a sleeping ball fall: %.2f m", ticks, fallen);
}

void woken_by_a_landing(int ticks) {
    scene world;
    world.add_floor(lossy);
    btRigidBody *low = world.add_ball(btVector3(0, btScalar(0.5), 0), lossy);
    bool together;
    until_asleep(world, {low}, ticks, together);
    expect(!low->isActive(), "%d tick(s): a ball on the floor sleeps", ticks);
    btRigidBody *far = world.add_ball(btVector3(3, 1, 0), lossy);
    world.frames(60, ticks);
    expect(!low->isActive() && far->isActive(), "  also while another lands beside it");
    btRigidBody *high = world.add_ball(btVector3(btScalar(0.2), 2, 0), lossy);
    int frames = 0;
    while (!low->isActive() && frames < 120) {
        world.frame(ticks);
        ++frames;
    }
    expect(low->isActive(), "  one that lands on it wakes it when %.3f m apart",
           double((high->getCenterOfMassPosition() - low->getCenterOfMassPosition()).length()));
    world.frames(60, ticks);
    expect(low->getCenterOfMassPosition().x() < btScalar(-0.05), "  and pushes it away: %.3f m",
           double(low->getCenterOfMassPosition().x()));
}

void keeps_the_impulse(int ticks, double stiffness_scale) {
    // Without gravity or losses, ball against ball: the sleeping one flies on with the other's velocity.
    scene world(0);
    const material elastic{stiffness_scale, 0.0, 0.0};
    btRigidBody *sleeper = world.add_ball(btVector3(0, 0, 0), elastic);
    sleeper->setActivationState(ISLAND_SLEEPING);
    world.frames(5, ticks);
    btRigidBody *striker = world.add_ball(btVector3(-2, 0, 0), elastic);
    striker->setLinearVelocity(btVector3(2, 0, 0));
    world.frames(120, ticks);
    const double momentum = double(sleeper->getLinearVelocity().x() + striker->getLinearVelocity().x());
    const double passed_on = double(sleeper->getLinearVelocity().x());
    expect(std::abs(momentum - 2) < 0.02 && std::abs(passed_on - 2) < 0.06,
           "%.0e Pa, %d tick(s): struck at 2 m/s, the sleeper leaves at %.4f m/s, momentum %.4f of 2", stiffness_scale,
           ticks, passed_on, momentum);
}

void lifted_by_a_platform(int ticks) {
    // A kinematic platform under a sleeping ball starts to rise.
    scene world;
    btRigidBody *platform = world.add_body(0, btVector3(0, btScalar(-0.5), 0), box(), true);
    platform->setCollisionFlags(platform->getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
    platform->setActivationState(DISABLE_DEACTIVATION);
    world.dynamics->removeRigidBody(platform);
    isocoat::bullet::add_coated_body(*world.dynamics, platform);
    const isocoat_link link = world.create_link(isocoat::bullet::link_desc_from(*platform), lossy);
    for (const isocoat_skeleton_desc &desc :
         isocoat::bullet::skeletons_from(*platform->getCollisionShape(), 0.1)) {
        isocoat_skeleton skeleton;
        must(isocoat_skeleton_create(world.coats, link, &desc, &skeleton));
    }
    world.coupler->attach(platform, link);
    btRigidBody *ball = world.add_ball(btVector3(0, btScalar(0.5), 0), lossy);
    bool together;
    until_asleep(world, {ball}, ticks, together);
    const double gap = double(ball->getCenterOfMassPosition().y() - platform->getCenterOfMassPosition().y());
    expect(!ball->isActive(), "%d tick(s): a ball sleeps on a platform, %.5f m over its centre", ticks, gap);

    const double speed = 0.5;
    double low = 1e9, high = 0;
    for (int i = 0; i < 240; ++i) {
        btTransform pose = platform->getWorldTransform();
        pose.getOrigin().setY(pose.getOrigin().y() + btScalar(speed / 60));
        platform->setWorldTransform(pose);
        world.frame(ticks);
        const double now = double(ball->getCenterOfMassPosition().y() - platform->getCenterOfMassPosition().y());
        if (i >= 180) {
            low = std::min(low, now);
            high = std::max(high, now);
        }
    }
    expect(ball->isActive() && std::abs(low - gap) < 1e-3 && std::abs(high - gap) < 1e-3,
           "  the platform rises at %.1f m/s, the ball with it: %.5f to %.5f m over its centre", speed, low, high);
    ball->setSleepingThresholds(1, 1);
    world.frames(300, ticks);
    expect(!ball->isActive(), "  and sleeps again when the platform stands");
}

}  // namespace

int main() {
    for (const int ticks : {1, 2, 4}) {
        stays_asleep(ticks);
        notices_what_isocoat_loses(ticks);
        woken_by_a_landing(ticks);
        lifted_by_a_platform(ticks);
        for (const double stiffness_scale : {1e4, 1e6, 1e8}) {
            keeps_the_impulse(ticks, stiffness_scale);
        }
    }
    return summary("sleep");
}
