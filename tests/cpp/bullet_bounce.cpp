// A coated ball dropped from 1 m onto a coated floor, without losses: ten bounces at 60 Hz keep the apex within 3%.
#include "bullet_scene.hpp"

namespace {

void bounce(int ticks, double stiffness_scale) {
    scene world;
    const material made_of{stiffness_scale, 0.0, 0.0};
    world.add_floor(made_of);
    btRigidBody *ball = world.add_ball(btVector3(0, btScalar(1.5), 0), made_of);
    ball->setActivationState(DISABLE_DEACTIVATION);
    // The highest point between two frames is found from the energy in flight.
    int bounces = 0;
    double lowest = 1e9, highest = 0, deepest = 0;
    bool below = false;
    double energy = 10.0;
    for (int i = 0; i < 6000 && bounces < 10; ++i) {
        world.frame(ticks);
        const double y = double(ball->getCenterOfMassPosition().y()) - 0.5;
        deepest = std::min(deepest, y);
        if (world.touching() || y < 0.02) {
            below = true;
        } else if (below && y > 0.3) {
            below = false;
            ++bounces;
            // Leapfrog velocity: half a tick behind the position.
            const double v = double(ball->getLinearVelocity().y()) - 10.0 * 0.5 / (60.0 * ticks);
            energy = 0.5 * v * v + 10.0 * y;
            lowest = std::min(lowest, energy / 10.0);
            highest = std::max(highest, energy / 10.0);
        }
    }
    expect(bounces == 10 && lowest > 0.97 && highest < 1.03,
           "%.0e Pa, %d tick(s): apexes of %d bounces from %.4f to %.4f m, indentation %.4f m", stiffness_scale, ticks,
           bounces, lowest, highest, -deepest);
}

}  // namespace

int main() {
    for (const double stiffness_scale : {5e3, 2e4, 2e5, 2e6, 2e7}) {
        bounce(1, stiffness_scale);
    }
    bounce(2, 2e5);
    bounce(4, 2e5);
    return summary("bounce");
}
