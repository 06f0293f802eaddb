// A body that the host moves by setWorldTransform in the middle of a contact behaves as a new one at the new place.
#include "bullet_scene.hpp"

namespace {

struct place {
    const char *name;
    btVector3 position;
    btVector3 velocity;
    bool announced;
};

double track(scene &world, const btRigidBody &ball, std::vector<double> &heights, int ticks) {
    for (int i = 0; i < 120; ++i) {
        world.frame(ticks);
        heights.push_back(double(ball.getCenterOfMassPosition().y()));
    }
    return heights.back();
}

void teleport(const place &to, int ticks, double stiffness_scale) {
    const material made_of{stiffness_scale, 0.3, 0.0};
    scene moved;
    moved.add_floor(made_of);
    btRigidBody *ball = moved.add_ball(btVector3(0, btScalar(0.9), 0), made_of);
    ball->setLinearVelocity(btVector3(1, 0, 0));
    for (int i = 0; i < 200 && !moved.touching(); ++i) {
        moved.frame(ticks);
    }
    expect(moved.touching(), "in contact at height %.3f m", double(ball->getCenterOfMassPosition().y()));
    ball->setWorldTransform(btTransform(btQuaternion::getIdentity(), to.position));
    ball->setInterpolationWorldTransform(ball->getWorldTransform());
    ball->setLinearVelocity(to.velocity);
    ball->setAngularVelocity(btVector3(0, 0, 0));
    if (to.announced) {
        moved.coupler->teleport(ball);
    }

    scene fresh;
    fresh.add_floor(made_of);
    btRigidBody *other = fresh.add_ball(to.position, made_of);
    other->setLinearVelocity(to.velocity);

    std::vector<double> a, b;
    track(moved, *ball, a, ticks);
    track(fresh, *other, b, ticks);
    double worst = 0;
    for (size_t i = 0; i < a.size(); ++i) {
        worst = std::max(worst, std::abs(a[i] - b[i]));
    }
    // An announced jump within one contact keeps the contact's number of sub-steps.
    expect(worst < (to.announced ? 1e-3 : 1e-9),
           "%s, %.0e Pa, %d tick(s): differs by %.2e m from a new ball over 2 s", to.name, stiffness_scale, ticks,
           worst);
}

}  // namespace

int main() {
    const place places[] = {
        {"into the air", btVector3(3, 2, 1), btVector3(0, 0, 0), false},
        {"into another contact", btVector3(-8, btScalar(0.46), 0), btVector3(1, -1, 0), false},
        {"a little, announced", btVector3(btScalar(0.5), btScalar(0.47), 0), btVector3(0, 0, 0), true},
    };
    for (const place &to : places) {
        for (const int ticks : {1, 4}) {
            teleport(to, ticks, 2e4);
            teleport(to, ticks, 2e6);
        }
    }
    return summary("teleport");
}
