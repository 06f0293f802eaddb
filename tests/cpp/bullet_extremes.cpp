// A pendulum of coated links that swings against a wall, and a ball that spins on a floor, under Bullet: one parameter
// at a time, far beyond what is usual, under each response; with the argument "table" as Markdown for docs/extremes.md.
#include <algorithm>
#include <cstring>
#include <string>

#include "bullet_scene.hpp"

namespace {

bool as_table = false;

struct response_kind {
    const char *name;
    isocoat_response response;
};

constexpr response_kind responses[] = {{"Implicit", ISOCOAT_RESPONSE_IMPLICIT},
                                       {"Auto", ISOCOAT_RESPONSE_AUTO},
                                       {"Substepped", ISOCOAT_RESPONSE_SUBSTEPPED}};

struct knobs {
    double modulus = 1e6;
    double tick = 1.0 / 60;
    /// Mass of the lowest link over that of the others.
    double mass_ratio = 1;
    double spin = 0;
};

struct outcome {
    bool finite = true;
    /// Rise of the highest energy from one second to the next at most, as a part of the first.
    double gain = 0;
    /// Contacts that began in the second in which it was greatest.
    int bounces = 0;
    /// Deepest centre beyond the surface that should hold it [m].
    double escaped = 0;
    /// Speed at the end [m/s].
    double speed = 0;
};

void respond(scene &world, const btRigidBody *body, isocoat_response response) {
    isocoat_body coat;
    isocoat_body_desc desc = isocoat_body_desc_default();
    must(isocoat_link_get_body(world.coats, world.coupler->link_of(body), &coat));
    must(isocoat_body_get_desc(world.coats, coat, &desc));
    desc.response = response;
    must(isocoat_body_set_desc(world.coats, coat, &desc));
}

/// Contacts that began in the last step.
int begun(const scene &world) {
    const isocoat_event *events = nullptr;
    size_t count = 0;
    must(isocoat_world_get_events(world.coats, &events, &count));
    return int(std::count_if(events, events + count, [](const isocoat_event &event) {
        return event.kind == ISOCOAT_EVENT_BEGIN;
    }));
}

/// Steps, and watches energy above `lowest` and what `beyond` says of a body.
template <class beyond_fn>
outcome watch(scene &world, const std::vector<btRigidBody *> &moving, double tick, double seconds, double lowest,
              beyond_fn beyond) {
    outcome result;
    double first = 0;
    for (const btRigidBody *body : moving) {
        first += energy_of(*body);
    }
    double before = first, highest = lowest, second = 1;
    int bounces = 0;
    for (int i = 0; i * tick < seconds; ++i) {
        world.dynamics->stepSimulation(btScalar(tick), 1, btScalar(tick));
        double energy = 0;
        result.speed = 0;
        for (const btRigidBody *body : moving) {
            energy += energy_of(*body);
            result.speed = std::max(result.speed, double(body->getLinearVelocity().length()));
            result.escaped = std::max(result.escaped, beyond(*body));
        }
        result.finite = result.finite && std::isfinite(energy);
        bounces += begun(world);
        highest = std::max(highest, energy);
        const double gain = (highest - before) / (first - lowest);
        if (gain > result.gain) {
            result.gain = gain;
            result.bounces = bounces;
        }
        if ((i + 1) * tick >= second) {
            bounces = 0;
            before = highest;
            highest = lowest;
            second += 1;
        }
    }
    return result;
}

/// Three links on hinges, let go from the side, fall against a wall.
outcome pendulum(const knobs &set, isocoat_response response) {
    const material made_of{set.modulus, 0.2, 0.3};
    scene world;
    constexpr double wall = -0.35;
    btRigidBody *plane = world.add_coated(
        0, btVector3(0, 0, 0), std::make_unique<btStaticPlaneShape>(btVector3(1, 0, 0), btScalar(wall)), made_of, 0.5);
    respond(world, plane, response);
    std::vector<btRigidBody *> links;
    std::vector<std::unique_ptr<btTypedConstraint>> joints;
    const btVector3 along(std::sin(btScalar(1.2)), -std::cos(btScalar(1.2)), 0);
    const btVector3 upper(0, btScalar(0.5), 0), axis(0, 0, 1);
    double lowest = 0;
    for (int i = 0; i < 3; ++i) {
        const double mass = i == 2 ? set.mass_ratio : 1.0;
        btRigidBody *link = world.add_coated(btScalar(mass), along * (btScalar(0.5) + btScalar(i)),
                                             std::make_unique<btCapsuleShape>(btScalar(0.4), btScalar(0.1)), made_of);
        link->setWorldTransform(
            btTransform(btQuaternion(axis, btScalar(1.2)), along * (btScalar(0.5) + btScalar(i))));
        link->setDamping(btScalar(0.2), btScalar(0.2));
        link->setActivationState(DISABLE_DEACTIVATION);
        joints.push_back(i == 0 ? std::make_unique<btHingeConstraint>(*link, upper, axis)
                                : std::make_unique<btHingeConstraint>(*links.back(), *link, -upper, upper, axis, axis));
        world.dynamics->addConstraint(joints.back().get(), true);
        respond(world, link, response);
        links.push_back(link);
        lowest -= gravity * mass * (0.5 + i);
    }
    world.dynamics->getSolverInfo().m_numIterations = 200;
    const outcome result = watch(world, links, set.tick, 10, lowest, [&](const btRigidBody &body) {
        return wall - double(body.getCenterOfMassPosition().x());
    });
    for (const auto &joint : joints) {
        world.dynamics->removeConstraint(joint.get());
    }
    return result;
}

/// A ball let fall on a floor while it spins about a slanted axis.
outcome spinning_ball(const knobs &set, isocoat_response response) {
    const material made_of{set.modulus, 0.5, 0.1};
    scene world;
    respond(world, world.add_floor(made_of), response);
    btRigidBody *ball = world.add_ball(btVector3(0, 1, 0), made_of);
    respond(world, ball, response);
    ball->setAngularVelocity(btVector3(btScalar(0.6 * set.spin), btScalar(0.8 * set.spin), 0));
    ball->setActivationState(DISABLE_DEACTIVATION);
    return watch(world, {ball}, set.tick, 5, 0, [](const btRigidBody &body) {
        return -double(body.getCenterOfMassPosition().y());
    });
}

void row(const char *scene_name, const char *parameter, double value, const response_kind &kind,
         const outcome &result) {
    // The drift of the host's own joints counts too.
    const bool implicit = kind.response == ISOCOAT_RESPONSE_IMPLICIT;
    const int bounces = std::max(result.bounces, 1);
    const bool sound = result.finite && result.escaped <= 0;
    const bool passes = sound && result.gain <= (implicit ? 1e-3 : 1e-2 * std::min(bounces, 3));
    if (as_table) {
        std::printf("| %s | %s | %.2g | %s | %s | %.1e | %s | %.1e | %s |\n", scene_name, parameter, value, kind.name,
                    result.finite ? "true" : "false", result.gain, result.escaped > 0 ? "true" : "false", result.speed,
                    passes ? "" : "**fails**");
        return;
    }
    expect(passes, "%s, %s %.2g, %s: gain %.1e in a second with %d bounces, %.1e m/s at the end",
           scene_name, parameter, value, kind.name, result.gain, result.bounces, result.speed);
}

template <class scene_fn>
void sweep(const char *scene_name, scene_fn run, const char *parameter, double knobs::*knob,
           const std::vector<double> &values) {
    for (const double value : values) {
        for (const response_kind &kind : responses) {
            knobs set;
            set.*knob = value;
            row(scene_name, parameter, value, kind, run(set, kind.response));
        }
    }
}

}  // namespace

int main(int count, char **arguments) {
    as_table = count > 1 && std::strcmp(arguments[1], "table") == 0;
    if (as_table) {
        std::printf("\n### Under Bullet (%s precision)\n\n"
                    "A pendulum of three links on hinges at a wall, 10 s, and a spinning ball that falls on a floor, "
                    "5 s. "
                    "`gain` is the rise of the highest energy from one second to the next, and may be 0.1 %% under the "
                    "implicit response, 1 %% a bounce under others, at most 3 %%. "
                    "Bullet turns no body by more than a quarter turn a tick.\n\n"
                    "| scene | parameter | value | response | finite | gain | escaped | m/s at the end | |\n"
                    "| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
                    precision);
    }
    sweep("pendulum", pendulum, "contact modulus [Pa]", &knobs::modulus, {1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9});
    sweep("pendulum", pendulum, "tick [s]", &knobs::tick, {1.0 / 15, 1.0 / 30, 1.0 / 60, 1.0 / 240, 1.0 / 1000});
    sweep("pendulum", pendulum, "mass of the last link [kg]", &knobs::mass_ratio, {1e-3, 1e-2, 0.1, 1, 10, 100});
    sweep("spinning ball", spinning_ball, "spin [rad/s]", &knobs::spin, {1, 10, 94, 1000});
    if (as_table) {
        return 0;
    }
    return summary("extremes");
}
