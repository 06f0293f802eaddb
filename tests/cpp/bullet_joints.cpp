// What stands on one coat through joints sinks as its whole load says, whatever the joints are, and stays where it is;
// a figure lies still on its coats.
#include <functional>

#include "bullet_scene.hpp"

namespace {

constexpr double stiffness = 1e5;

using seat = std::function<std::unique_ptr<btTypedConstraint>(btRigidBody &, btRigidBody &, const btTransform &,
                                                              const btTransform &)>;

template <class six_dof>
std::unique_ptr<btTypedConstraint> locked(std::unique_ptr<six_dof> joint) {
    for (int axis = 0; axis < 6; ++axis) {
        joint->setLimit(axis, 0, 0);
    }
    return joint;
}

/// A ball of 1 kg at the end of an arm, which holds a load a metre above it by some joint; `aside` it leans over.
void arm(const char *name, int ticks, btScalar heavy, btScalar aside, const seat &make) {
    const material made_of{stiffness, 0.0, 0.5};
    scene world;
    world.add_floor(made_of);
    const btVector3 start(0, btScalar(0.5), 0), middle(0, 1, 0);
    btRigidBody *ball = world.add_ball(start, made_of);
    btRigidBody *load = world.add_body(heavy, start + btVector3(aside, 1, 0),
                                       std::make_unique<btSphereShape>(btScalar(0.4)), false);
    // Two metres to the side.
    btHingeConstraint hinge(*ball, btVector3(-2, 0, 0), btVector3(0, 0, 1));
    const auto frame = [&](const btRigidBody &body) {
        return body.getWorldTransform().inverse() * btTransform(btQuaternion::getIdentity(), middle);
    };
    const std::unique_ptr<btTypedConstraint> joint = make(*ball, *load, frame(*ball), frame(*load));
    world.dynamics->addConstraint(&hinge);
    world.dynamics->addConstraint(joint.get(), true);
    world.dynamics->getSolverInfo().m_numIterations = 200;
    ball->setActivationState(DISABLE_DEACTIVATION);
    load->setActivationState(DISABLE_DEACTIVATION);
    world.frames(900, ticks);
    const double sink = 0.5 - double(ball->getCenterOfMassPosition().y());
    double moved = 0;
    const btVector3 rest = load->getCenterOfMassPosition();
    for (int i = 0; i < 120; ++i) {
        world.frame(ticks);
        moved = std::max(moved, double((load->getCenterOfMassPosition() - rest).length()));
    }
    world.dynamics->removeConstraint(joint.get());
    world.dynamics->removeConstraint(&hinge);
    const double out = 2 + double(load->getCenterOfMassPosition().x());
    const double lever = 2 + double(ball->getCenterOfMassPosition().x());
    const double wanted = sink_under(stiffness, gravity * (1 + double(heavy) * out / lever));
    expect(std::abs(sink / wanted - 1) < 2e-3 && moved < 1e-5,
           "%.0f kg by a %s, %d tick(s): sink %.6f m, wanted %.6f m: %.5f; in 2 s the load moves by %.1e m",
           double(heavy), name, ticks, sink, wanted, sink / wanted, moved);
}

void arms(int ticks) {
    for (const btScalar heavy : {5, 50}) {
        arm("fixed joint", ticks, heavy, 0, [](auto &a, auto &b, const auto &in_a, const auto &in_b) {
            return std::make_unique<btFixedConstraint>(a, b, in_a, in_b);
        });
        arm("joint of six degrees", ticks, heavy, 0, [](auto &a, auto &b, const auto &in_a, const auto &in_b) {
            return locked(std::make_unique<btGeneric6DofConstraint>(a, b, in_a, in_b, true));
        });
        arm("slider", ticks, heavy, 0, [](auto &a, auto &b, const auto &in_a, const auto &in_b) {
            auto slider = std::make_unique<btSliderConstraint>(a, b, in_a, in_b, true);
            slider->setLowerLinLimit(0);
            slider->setUpperLinLimit(0);
            slider->setLowerAngLimit(0);
            slider->setUpperAngLimit(0);
            return slider;
        });
        // It leans on a limit that gives a little.
        const btScalar aside = btScalar(0.3);
        arm("hinge at its limit", ticks, heavy, aside, [](auto &a, auto &b, const auto &in_a, const auto &in_b) {
            auto hinge = std::make_unique<btHingeConstraint>(a, b, in_a, in_b);
            hinge->setLimit(btScalar(-0.05), btScalar(0.05), btScalar(0.9), btScalar(0.3), 0);
            hinge->setParam(BT_CONSTRAINT_STOP_CFM, btScalar(0.1));
            return hinge;
        });
    }
}

/// A trunk with two limbs on hinges and a head on a cone-twist joint, flat on the floor.
void figure(int ticks) {
    const material made_of{2e5, 0.5, 2.0, 0.6};
    scene world;
    world.add_floor(made_of);
    const auto add = [&](btScalar mass, btScalar x, btScalar z, btScalar radius, btScalar length) {
        btRigidBody *body = world.add_coated(mass, btVector3(x, radius, z),
                                             std::make_unique<btCapsuleShapeX>(radius, length), made_of);
        body->setActivationState(DISABLE_DEACTIVATION);
        body->setDamping(btScalar(0.05), btScalar(0.3));
        return body;
    };
    btRigidBody *trunk = add(20, 0, 0, btScalar(0.12), btScalar(0.5));
    const std::vector<btRigidBody *> others = {add(3, btScalar(0.6), btScalar(0.15), btScalar(0.06), btScalar(0.3)),
                                               add(3, btScalar(0.6), btScalar(-0.15), btScalar(0.06), btScalar(0.3)),
                                               add(5, btScalar(-0.55), 0, btScalar(0.1), btScalar(0.05))};
    std::vector<std::unique_ptr<btTypedConstraint>> joints;
    const auto frame = [](const btRigidBody &body, const btVector3 &at) {
        return body.getWorldTransform().inverse() * btTransform(btQuaternion::getIdentity(), at);
    };
    for (std::size_t i = 0; i < others.size(); ++i) {
        btRigidBody &other = *others[i];
        const btVector3 at(btScalar(i < 2 ? 0.4 : -0.45), btScalar(0.1), other.getCenterOfMassPosition().z());
        if (i < 2) {
            joints.push_back(std::make_unique<btHingeConstraint>(*trunk, other, frame(*trunk, at), frame(other, at)));
        } else {
            joints.push_back(
                std::make_unique<btConeTwistConstraint>(*trunk, other, frame(*trunk, at), frame(other, at)));
        }
        world.dynamics->addConstraint(joints.back().get(), true);
    }
    world.frames(600, ticks);
    const auto places = [&] {
        std::vector<btVector3> all;
        for (const auto &body : world.bodies) {
            all.push_back(body->getCenterOfMassPosition());
        }
        return all;
    };
    const auto farthest = [](const std::vector<btVector3> &from, const std::vector<btVector3> &to) {
        double most = 0;
        for (std::size_t k = 0; k < from.size(); ++k) {
            most = std::max(most, double((to[k] - from[k]).length()));
        }
        return most;
    };
    const std::vector<btVector3> rest = places();
    double drift = 0, speed = 0;
    for (int i = 0; i < 600; ++i) {
        const std::vector<btVector3> before = places();
        world.frame(ticks);
        drift = std::max(drift, farthest(rest, places()));
        speed = std::max(speed, 60 * farthest(before, places()));
    }
    for (const auto &joint : joints) {
        world.dynamics->removeConstraint(joint.get());
    }
    expect(drift < 1e-3 && speed < 1e-3,
           "a figure at rest, %d tick(s): in 10 s it moves by %.1e m, at most at %.1e m/s", ticks, drift, speed);
}

}  // namespace

/// A ball on an arm rests on the floor and is hit: it does not fly off with more than it got.
void blow(int ticks, double speed) {
    const material made_of{1e6, 0.5, 0.1};
    scene world;
    world.add_floor(made_of);
    btRigidBody *ball = world.add_ball(btVector3(0, btScalar(0.495), 0), made_of);
    ball->setActivationState(DISABLE_DEACTIVATION);
    btHingeConstraint hinge(*ball, btVector3(-2, 0, 0), btVector3(0, 0, 1));
    world.dynamics->addConstraint(&hinge);
    world.frames(120, ticks);
    const double rest = double(ball->getCenterOfMassPosition().y());
    ball->applyCentralImpulse(btVector3(0, btScalar(-speed), 0));
    double top = 0;
    for (int i = 0; i < 90; ++i) {
        world.frame(ticks);
        top = std::max(top, double(ball->getCenterOfMassPosition().y()) - rest);
    }
    const double given = 0.5 * speed * speed / gravity;
    expect(top < given, "a ball on an arm, hit down at %.0f m/s, %d tick(s), rises by %.3f m, of %.3f at most", speed, ticks,
           top, given);
    world.dynamics->removeConstraint(&hinge);
}

/// Bodies that may not turn, or have no inertia, hang on joints as others do.
void upright(bool factor) {
    scene world;
    world.add_floor();
    btRigidBody *post = world.add_ball(btVector3(0, btScalar(0.495), 0));
    if (factor) {
        post->setAngularFactor(0);
    } else {
        post->setMassProps(1, btVector3(0, 0, 0));
    }
    post->setActivationState(DISABLE_DEACTIVATION);
    world.coupler->refresh(post);
    btRigidBody *load = world.add_body(4, btVector3(0, 2, 0), std::make_unique<btSphereShape>(btScalar(0.2)), true);
    load->setActivationState(DISABLE_DEACTIVATION);
    const btVector3 at(0, btScalar(0.495), 0);
    const btTransform in_post(btQuaternion::getIdentity(), at - post->getCenterOfMassPosition());
    const btTransform in_load(btQuaternion::getIdentity(), at - load->getCenterOfMassPosition());
    btFixedConstraint joint(*post, *load, in_post, in_load);
    world.dynamics->addConstraint(&joint, true);
    world.frames(240);
    const double height = double(load->getCenterOfMassPosition().y());
    expect(world.coupler->last_error().empty() && height > 1.9 && post->getLinearVelocity().length() < 1,
           "a load on a post %s stands at %.3f m; %s", factor ? "that may not turn" : "without inertia", height,
           world.coupler->last_error().c_str());
    world.dynamics->removeConstraint(&joint);
}

int main() {
    for (const int ticks : {1, 4}) {
        arms(ticks);
        figure(ticks);
        blow(ticks, 1);
        blow(ticks, 5);
    }
    upright(true);
    upright(false);
    return summary("joints");
}
