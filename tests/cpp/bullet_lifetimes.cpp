// Bodies, links, coupler and worlds may go in any order; what changes in between is noticed; errors are told, not
// thrown through Bullet.
#include <limits>

#include "bullet_scene.hpp"

namespace {

const material made_of{2e4, 0.3, 0.3};

template <class Call> bool refused(Call call) {
    try {
        call();
    } catch (const std::runtime_error &error) {
        std::printf("      refused: %s\n", error.what());
        return true;
    }
    return false;
}

double height(const btRigidBody *body) { return double(body->getCenterOfMassPosition().y()); }

void attaching() {
    scene world;
    btRigidBody *ball = world.add_ball(btVector3(0, 2, 0));
    const isocoat_link link = world.coupler->link_of(ball);
    btRigidBody *plain = world.add_body(1, btVector3(3, 2, 0), std::make_unique<btSphereShape>(btScalar(0.5)), true);
    expect(refused([&] { world.coupler->attach(ball, link); }), "a body attached twice");
    expect(refused([&] { world.coupler->attach(plain, link); }), "a link attached twice");
    expect(refused([&] { world.coupler->attach(nullptr, link); }), "no body");
    expect(refused([&] { world.coupler->attach(plain, isocoat_link{}); }), "no link");
    expect(refused([&] { world.coupler->link_of(plain); }), "the link of a body that has none");
    expect(world.coupler->detach(ball) && !world.coupler->detach(ball) && !world.coupler->is_attached(ball),
           "detaching works once");
    world.coupler->attach(plain, link);
    world.frames(10);
    expect(world.coupler->last_error().empty(), "the link serves another body");
}

void bodies_go() {
    scene world;
    world.add_floor(made_of);
    std::vector<btRigidBody *> balls;
    for (int i = 0; i < 6; ++i) {
        balls.push_back(world.add_ball(btVector3(btScalar(2 * i), btScalar(0.5), 0), made_of));
    }
    world.frames(60);
    // Deleted while attached, after it has left the dynamics world.
    const auto forget = [&](btRigidBody *body) {
        world.dynamics->removeRigidBody(body);
        for (auto &owned : world.bodies) {
            if (owned.get() == body) {
                std::swap(owned, world.bodies.back());
                world.bodies.pop_back();
                return;
            }
        }
    };
    const isocoat_link gone = world.coupler->link_of(balls[0]);
    forget(balls[0]);
    world.frames(5);
    bool enabled = true;
    must(isocoat_link_is_enabled(world.coats, gone, &enabled));
    expect(!enabled && world.coupler->last_error().empty(), "a deleted body's coat is disabled");
    expect(world.coupler->detach(balls[0]), "it can be detached afterwards");

    // Its link or its coat's body destroyed while attached: detached by itself.
    must(isocoat_link_destroy(world.coats, world.coupler->link_of(balls[1])));
    isocoat_body coat;
    must(isocoat_link_get_body(world.coats, world.coupler->link_of(balls[2]), &coat));
    must(isocoat_body_destroy(world.coats, coat));
    world.frames(30);
    expect(!world.coupler->is_attached(balls[1]) && !world.coupler->is_attached(balls[2]) &&
               height(balls[1]) < 0 && height(balls[2]) < 0 && height(balls[3]) > 0.4,
           "without coats two balls fall through: %.2f m, %.2f m; the others stay: %.2f m", height(balls[1]),
           height(balls[2]), height(balls[3]));
    expect(world.coupler->last_error().empty(), "no error: '%s'", world.coupler->last_error().c_str());

    // Out of the dynamics world and in again.
    world.dynamics->removeRigidBody(balls[4]);
    world.frames(30);
    const double kept = height(balls[4]);
    isocoat::bullet::add_coated_body(*world.dynamics, balls[4]);
    balls[4]->activate(true);
    world.frames(120);
    must(isocoat_link_is_enabled(world.coats, world.coupler->link_of(balls[4]), &enabled));
    expect(enabled && std::abs(height(balls[4]) - kept) < 0.02, "a body that comes back rests as before: %.4f, %.4f m",
           kept, height(balls[4]));

    // A body that has lost its numbers takes only its own coat along.
    std::string told;
    world.coupler->on_error([&](const std::string &text) { told = text; });
    balls[5]->activate(true);
    balls[5]->setLinearVelocity(btVector3(std::numeric_limits<btScalar>::quiet_NaN(), 0, 0));
    world.coupler->step(btScalar(1) / 60);
    expect(!told.empty() && told == world.coupler->last_error(), "told: %s", told.c_str());
    world.coupler->on_error(nullptr);
    balls[5]->setLinearVelocity(btVector3(0, 0, 0));
    world.coupler->clear_error();
    world.frames(60);
    expect(height(balls[3]) > 0.4 && height(balls[5]) > 0.4 && world.coupler->last_error().empty(),
           "and recovers: %.3f m, %.3f m", height(balls[3]), height(balls[5]));
}

void changes_are_noticed() {
    scene world;
    world.add_floor(made_of);
    btRigidBody *ball = world.add_ball(btVector3(0, btScalar(0.5), 0), made_of);
    ball->setActivationState(DISABLE_DEACTIVATION);
    world.frames(300);
    const double light = 0.5 - height(ball);
    btVector3 inertia;
    ball->getCollisionShape()->calculateLocalInertia(4, inertia);
    ball->setMassProps(4, inertia);
    ball->updateInertiaTensor();
    world.frames(300);
    isocoat_link_desc desc = isocoat_link_desc_default();
    must(isocoat_link_get_desc(world.coats, world.coupler->link_of(ball), &desc));
    const double heavy = 0.5 - height(ball);
    expect(std::abs(desc.mass - 4) < 1e-6 && std::abs(heavy / light - 2) < 0.1,
           "four times the mass: it sinks %.5f m instead of %.5f m", heavy, light);

    ball->setGravity(btVector3(0, btScalar(-2.5), 0));
    world.frames(900);
    expect(std::abs((0.5 - height(ball)) / light - 1) < 0.05, "a quarter of the gravity: %.5f m", 0.5 - height(ball));

    // Held fast, it becomes a place to stand on.
    world.dynamics->removeRigidBody(ball);
    ball->setMassProps(0, btVector3(0, 0, 0));
    isocoat::bullet::add_coated_body(*world.dynamics, ball);
    world.coupler->refresh(ball);
    must(isocoat_link_get_desc(world.coats, world.coupler->link_of(ball), &desc));
    expect(desc.kind == ISOCOAT_LINK_FIXED, "without mass, its link is fixed");
    btRigidBody *other = world.add_ball(btVector3(0, btScalar(1.45), 0), made_of);
    other->setAngularFactor(0);
    other->setLinearFactor(btVector3(0, 1, 0));
    world.frames(300);
    expect(height(other) > 1.3, "another ball rests on it: %.3f m", height(other));
}

void orders() {
    for (int order = 0; order < 4; ++order) {
        auto world = std::make_unique<scene>();
        world->add_floor();
        world->add_ball(btVector3(0, btScalar(0.6), 0));
        world->frames(30);
        if (order == 0) {  // the coupler first; Bullet lives on
            world->dynamics->removeAction(world->coupler.get());
            world->coupler.reset();
            world->frames(5);
        } else if (order == 1) {  // the dynamics world first
            for (const auto &body : world->bodies) {
                world->dynamics->removeRigidBody(body.get());
            }
            world->dynamics.reset();
        } else if (order == 2) {  // the bodies first
            for (const auto &body : world->bodies) {
                world->dynamics->removeRigidBody(body.get());
            }
            world->bodies.clear();
            world->frames(5);
        }
        world.reset();
    }
    expect(true, "worlds, bodies and coupler go in any order");
}

void called_by_the_host() {
    // From the host's own tick callback instead of as an action.
    scene world;
    world.dynamics->removeAction(world.coupler.get());
    world.dynamics->setInternalTickCallback(
        [](btDynamicsWorld *dynamics, btScalar dt) {
            static_cast<isocoat::bullet::coupler *>(dynamics->getWorldUserInfo())->step(dt);
        },
        world.coupler.get());
    world.add_floor(made_of);
    btRigidBody *ball = world.add_ball(btVector3(0, 1, 0), made_of);
    world.frames(300, 2);
    expect(std::abs(height(ball) - 0.48) < 0.03, "stepped by the host's callback: rests at %.4f m", height(ball));
    world.dynamics->setInternalTickCallback(nullptr);
}

}  // namespace

int main() {
    attaching();
    bodies_go();
    changes_are_noticed();
    orders();
    called_by_the_host();
    return summary("lifetimes");
}
