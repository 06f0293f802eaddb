// Bodies that Bullet's constraints and contacts hold: what presses a coat through a joint sinks as its whole load says,
// pendulums come to rest against a wall without a gain of energy, and stacks of coated and plain boxes stay up.
#include "bullet_scene.hpp"

namespace {

/// What the coupler does about held bodies, undone.
enum class told { as_it_is, never, not_even_guessed };

/// A coupler whose flags do not reach isocoat.
struct silent_coupler : isocoat::bullet::coupler {
    using isocoat::bullet::coupler::coupler;
    std::vector<isocoat_link> unsaid;
    void before_step(btScalar) override {
        for (const isocoat_link link : unsaid) {
            must(isocoat_link_set_constrained(coats(), link, 0));
        }
    }
};

struct silently : rigid_bodies {
    using coupler = silent_coupler;
};

/// A ball at the end of an arm on a hinge, with a load on it, on a coated floor.
void arm(int ticks, double stiffness, btScalar heavy, told how) {
    const material made_of{stiffness, 0.0, 0.5};
    scene_of<silently> world;
    world.add_floor(made_of);
    const btVector3 start(0, btScalar(0.5), 0);
    btRigidBody *ball = world.add_ball(start, made_of, 1);
    btRigidBody *load = world.add_body(heavy, start + btVector3(0, 1, 0),
                                       std::make_unique<btSphereShape>(btScalar(0.4)), false);
    // Axis along z, two metres to the side.
    btHingeConstraint hinge(*ball, btVector3(-2, 0, 0), btVector3(0, 0, 1));
    btTransform above = btTransform::getIdentity(), below = btTransform::getIdentity();
    above.setOrigin(btVector3(0, btScalar(0.5), 0));
    below.setOrigin(btVector3(0, btScalar(-0.5), 0));
    btFixedConstraint seat(*ball, *load, above, below);
    world.dynamics->addConstraint(&hinge);
    world.dynamics->addConstraint(&seat, true);
    world.dynamics->getSolverInfo().m_numIterations = 200;
    ball->setActivationState(DISABLE_DEACTIVATION);
    load->setActivationState(DISABLE_DEACTIVATION);
    const isocoat_link link = world.coupler->link_of(ball);
    if (how != told::as_it_is) {
        world.coupler->unsaid.push_back(link);
    }
    if (how == told::not_even_guessed) {
        isocoat_body body;
        isocoat_body_desc desc = isocoat_body_desc_default();
        must(isocoat_link_get_body(world.coats, link, &body));
        must(isocoat_body_get_desc(world.coats, body, &desc));
        desc.response = ISOCOAT_RESPONSE_SUBSTEPPED;
        must(isocoat_body_set_desc(world.coats, body, &desc));
    }
    double low = 1, high = -1, carried = 0;
    for (int i = 0; i < 900; ++i) {
        world.frame(ticks);
        if (i >= 840) {
            low = std::min(low, 0.5 - double(ball->getCenterOfMassPosition().y()));
            high = std::max(high, 0.5 - double(ball->getCenterOfMassPosition().y()));
            isocoat_wrench wrench;
            must(isocoat_link_get_wrench(world.coats, link, &wrench));
            carried += wrench.force[1] / 60;
        }
    }
    world.dynamics->removeConstraint(&seat);
    world.dynamics->removeConstraint(&hinge);
    // The load leans out a little with the arm.
    const double out = double(load->getCenterOfMassPosition().x() - ball->getCenterOfMassPosition().x());
    const double weight = gravity * (1 + double(heavy) * (1 + out / 2));
    const double wanted = sink_under(stiffness, weight);
    const bool right = std::abs(high / wanted - 1) < 0.02 && high - low < 0.01 * wanted;
    expect(right || how != told::as_it_is,
           "arm%s, %.0f kg, %.0e Pa, %d tick(s): sink %.6f m, wanted %.6f m: %.4f; moves by %.1e m, carries %.4f",
           how == told::as_it_is ? "" : how == told::never ? ", no flag" : ", no flag, sub-steps forced", double(heavy),
           stiffness, ticks, high, wanted, high / wanted, high - low, carried / weight);
}

/// Links on joints swing against a wall, and come to rest against it.
void pendulum(int ticks, double stiffness, bool hinges, int number) {
    const material made_of{stiffness, 0.2, 0.3};
    scene world;
    world.add_coated(0, btVector3(0, 0, 0),
                     std::make_unique<btStaticPlaneShape>(btVector3(1, 0, 0), btScalar(-0.35)), made_of, 0.5);
    std::vector<btRigidBody *> links;
    std::vector<std::unique_ptr<btTypedConstraint>> joints;
    const btScalar half = btScalar(0.5);
    // Out to the side, in one line.
    const btVector3 along(std::sin(btScalar(1.2)), -std::cos(btScalar(1.2)), 0);
    for (int i = 0; i < number; ++i) {
        btRigidBody *link = world.add_coated(1, along * (half + btScalar(i)),
                                             std::make_unique<btCapsuleShape>(btScalar(0.4), btScalar(0.1)), made_of);
        btTransform pose(btQuaternion(btVector3(0, 0, 1), btScalar(1.2)), along * (half + btScalar(i)));
        link->setWorldTransform(pose);
        link->setDamping(btScalar(0.2), btScalar(0.2));
        const btVector3 upper(0, half, 0), lower(0, -half, 0), axis(0, 0, 1);
        if (i == 0) {
            joints.push_back(hinges ? std::unique_ptr<btTypedConstraint>(new btHingeConstraint(*link, upper, axis))
                                    : std::unique_ptr<btTypedConstraint>(new btPoint2PointConstraint(*link, upper)));
        } else {
            btRigidBody *parent = links.back();
            joints.push_back(
                hinges
                    ? std::unique_ptr<btTypedConstraint>(new btHingeConstraint(*parent, *link, lower, upper, axis, axis))
                    : std::unique_ptr<btTypedConstraint>(new btPoint2PointConstraint(*parent, *link, lower, upper)));
        }
        world.dynamics->addConstraint(joints.back().get(), true);
        link->setActivationState(DISABLE_DEACTIVATION);
        links.push_back(link);
    }
    world.dynamics->getSolverInfo().m_numIterations = 100;
    double lowest = 0;
    for (int i = 0; i < number; ++i) {
        lowest -= gravity * (0.5 + i);
    }
    const auto energy = [&] {
        double sum = 0;
        for (const btRigidBody *link : links) {
            sum += energy_of(*link);
        }
        return sum - lowest;
    };
    const double first = energy();
    // Highest energy of each second.
    std::vector<double> seconds;
    btVector3 tip(0, 0, 0);
    double still = 0;
    bool hit = false;
    for (int i = 0; i < 3600; ++i) {
        world.frame(ticks);
        hit = hit || world.touching();
        const btVector3 at = links.back()->getCenterOfMassPosition();
        if (i % 60 == 0) {
            seconds.push_back(0);
            tip = at;
            still = 0;
        }
        seconds.back() = std::max(seconds.back(), energy());
        still = std::max(still, double((at - tip).length()));
    }
    for (const auto &joint : joints) {
        world.dynamics->removeConstraint(joint.get());
    }
    double growth = seconds[0] - first;
    for (std::size_t i = 1; i < seconds.size(); ++i) {
        growth = std::max(growth, seconds[i] - seconds[i - 1]);
    }
    expect(hit && growth < 0.01 * first && seconds.back() < 0.05 * first && still < 1e-3,
           "%d links on %s at a wall, %.0e Pa, %d tick(s): %.3f J over the lowest, grows by %.3f J a second at most, at "
           "last %.3f J; the tip moves by %.1e m", number, hinges ? "hinges" : "points", stiffness, ticks, first, growth,
           seconds.back(), still);
}

/// Coated boxes on each other by their coats, and on plain boxes by their shapes.
void stack(int ticks, double stiffness, bool coats, bool sleep) {
    const material made_of{stiffness, 0.6, 0.5};
    scene world;
    world.add_body(0, btVector3(0, 0, 0), std::make_unique<btStaticPlaneShape>(btVector3(0, 1, 0), btScalar(0)), false);
    std::vector<btRigidBody *> boxes;
    const bool coated[6] = {true, true, false, true, true, false};
    for (int i = 0; i < 6; ++i) {
        auto shape = std::make_unique<btBoxShape>(btVector3(btScalar(0.5), btScalar(0.5), btScalar(0.5)));
        const btVector3 at(btScalar(0.01 * (i % 2)), btScalar(0.5 + i), 0);
        boxes.push_back(coats && coated[i] ? world.add_coated(1, at, std::move(shape), made_of)
                                           : world.add_body(1, at, std::move(shape), false));
        boxes.back()->setFriction(btScalar(0.6));
        // Between ticks a box shows what the coat above it puts on it in a tick, before Bullet's contact takes it.
        boxes.back()->setSleepingThresholds(btScalar(2), btScalar(1));
        if (!sleep) {
            boxes.back()->setActivationState(DISABLE_DEACTIVATION);
        }
    }
    world.frames(300, ticks);
    std::vector<btVector3> settled;
    for (const btRigidBody *box : boxes) {
        settled.push_back(box->getCenterOfMassPosition());
    }
    double moved = 0, lean = 0;
    for (int i = 0; i < 600; ++i) {
        world.frame(ticks);
        for (std::size_t k = 0; k < boxes.size(); ++k) {
            moved = std::max(moved, double((boxes[k]->getCenterOfMassPosition() - settled[k]).length()));
            lean = std::max(lean, 1 - double(boxes[k]->getWorldTransform().getBasis()[1][1]));
        }
    }
    const double top = double(boxes.back()->getCenterOfMassPosition().y());
    // Bullet's own stack wanders too while it may not sleep, at one tick a frame by centimetres.
    const double most = sleep ? 1e-3 : ticks == 1 ? 0.3 : 0.01;
    expect((moved < most && lean < 1e-3 && top > 5.4) || !coats,
           "6 %s boxes, %.0e Pa, %d tick(s), %s: the top is at %.4f m; in 10 s they move by %.1e m at most",
           coats ? "coated and plain" : "plain", stiffness, ticks, sleep ? "may sleep" : "kept awake", top, moved);
}

}  // namespace

int main() {
    for (const int ticks : {1, 4}) {
        for (const double stiffness : {1e4, 1e5, 1e6}) {
            arm(ticks, stiffness, 5, told::as_it_is);
            if (ticks == 1) {
                arm(ticks, stiffness, 5, told::never);
                arm(ticks, stiffness, 5, told::not_even_guessed);
            }
        }
        // Far more than the ball's own mass: with its joints it moves like 8.5 to 150 kg.
        for (const btScalar heavy : {6, 20, 100}) {
            arm(ticks, 1e5, heavy, told::as_it_is);
        }
        for (const double stiffness : {1e4, 1e6}) {
            pendulum(ticks, stiffness, true, 1);
            pendulum(ticks, stiffness, true, 3);
            pendulum(ticks, stiffness, false, 3);
        }
        stack(ticks, 0, false, false);
        for (const double stiffness : {1e5, 1e6}) {
            stack(ticks, stiffness, true, false);
            stack(ticks, stiffness, true, true);
        }
    }
    return summary("held");
}
