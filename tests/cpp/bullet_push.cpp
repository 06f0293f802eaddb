// A coated ball that rests on a coated floor without friction gains F t / m from a lasting force of the host and J / m
// from its impulses, whatever the number of internal ticks in a frame; and it keeps its height meanwhile.
#include "bullet_scene.hpp"

namespace {

constexpr double mass = 2.0;

struct resting {
    scene world;
    btRigidBody *ball;
    int ticks;
    double height;

    explicit resting(int ticks_a_frame, const material &made_of) : ticks(ticks_a_frame) {
        world.add_floor(made_of);
        ball = world.add_ball(btVector3(0, btScalar(0.49), 0), made_of, btScalar(mass));
        ball->setActivationState(DISABLE_DEACTIVATION);
        world.frames(300, ticks);
        height = double(ball->getCenterOfMassPosition().y());
        ball->setLinearVelocity(ball->getLinearVelocity() * btVector3(0, 1, 0));
    }

    double drift() const { return std::abs(double(ball->getCenterOfMassPosition().y()) - height); }
};

void push(int ticks, const material &made_of, const char *what) {
    resting at(ticks, made_of);
    const double force = 3.0;
    const double x = double(at.ball->getCenterOfMassPosition().x());
    for (int i = 0; i < 60; ++i) {
        at.ball->applyCentralForce(btVector3(btScalar(force), 0, 0));
        at.world.frame(ticks);
    }
    const double way = (double(at.ball->getCenterOfMassPosition().x()) - x) * 2 * mass / force;
    at.world.frame(ticks);
    const double gain = double(at.ball->getLinearVelocity().x()) * mass / force;
    expect(std::abs(gain - 1) < 0.02 && std::abs(way - 1) < 0.02,
           "%s, %d tick(s): force for 1 s: velocity / (F t/m) = %.5f, way / (F t^2/2m) = %.5f, height off %.2e m", what,
           ticks, gain, way, at.drift());
}

void kick(int ticks, const material &made_of, const char *what) {
    resting at(ticks, made_of);
    const double impulse = 1.5;
    at.ball->applyCentralImpulse(btVector3(btScalar(impulse), 0, 0));
    at.world.frames(30, ticks);
    const double gain = double(at.ball->getLinearVelocity().x()) * mass / impulse;
    expect(std::abs(gain - 1) < 0.02, "%s, %d tick(s): impulse: velocity / (J/m) = %.5f, height off %.2e m", what,
           ticks, gain, at.drift());
}

void press(int ticks, const material &made_of, const char *what) {
    // Half its weight more, straight down: the sink grows, and nothing else happens.
    resting at(ticks, made_of);
    double low = at.height, high = 0, last = 0;
    for (int i = 0; i < 600; ++i) {
        at.ball->applyCentralForce(btVector3(0, btScalar(-0.5 * 10 * mass), 0));
        at.world.frame(ticks);
        if (i >= 480) {
            const double y = double(at.ball->getCenterOfMassPosition().y());
            low = std::min(low, y);
            high = std::max(high, y);
            last = y;
        }
    }
    // Linear coats of equal stiffness, sphere on plane: the sink goes about with the square root of the load.
    const double deeper = (0.5 - last) / (0.5 - at.height);
    expect(std::abs(deeper - std::sqrt(1.5)) < 0.04 && high - low < 0.01 * (0.5 - last),
           "%s, %d tick(s): 1.5 times the weight: sink %.4f times as deep, moves by %.2e m", what, ticks, deeper,
           high - low);
}

}  // namespace

int main() {
    const material soft{2e4, 0.0, 0.3};
    const material hard{2e6, 0.0, 0.3};
    for (const int ticks : {1, 2, 4}) {
        push(ticks, soft, "soft");
        push(ticks, hard, "hard");
        kick(ticks, soft, "soft");
        kick(ticks, hard, "hard");
        press(ticks, soft, "soft");
        press(ticks, hard, "hard");
    }
    return summary("push");
}
