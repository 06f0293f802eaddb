// One coat over bodies on joints: parts that don't blend carry each other's load, and those that do let each other be.
#include <algorithm>
#include <cmath>

#include "bullet_scene.hpp"

namespace {

constexpr double thickness = 0.2;
constexpr double load = 500.0;

/// A link of the coat for a body, with a point skeleton at its middle.
isocoat_link add_part(scene_of<rigid_bodies> &world, isocoat_body coat, btRigidBody *body) {
    const isocoat_link_desc link_desc = isocoat::bullet::link_desc_from(*body);
    isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
    desc.thickness = thickness;
    isocoat_link link;
    isocoat_skeleton skeleton;
    must(isocoat_link_create(world.coats, coat, &link_desc, &link));
    must(isocoat_skeleton_create(world.coats, link, &desc, &skeleton));
    world.coupler->attach(body, link);
    return link;
}

/// The force between two equal balls of linear pressure, E at their centres, each pressed in by a part of its radius.
double force_of(double stiffness_scale, double indentation) {
    const double pressure = 2.0 * stiffness_scale, h = 1.0 - indentation;
    return 2.0 * SIMD_PI * pressure * thickness * thickness * ((1.0 - h * h) / 2.0 - (1.0 - h * h * h) / 3.0);
}

/// A hand on an arm, on a hinge a metre to the side, is pressed to the torso.
void hand_on_torso(bool blend) {
    scene_of<rigid_bodies> world(0.0);
    isocoat_body_desc desc = isocoat_body_desc_default();
    desc.stiffness_scale = load / force_of(1.0, 0.2);
    desc.dissipation = 1.0;
    isocoat_body coat;
    must(isocoat_body_create(world.coats, &desc, &coat));
    const auto sphere = [] { return std::make_unique<btSphereShape>(btScalar(thickness)); };
    btRigidBody *torso = world.add_body(0, btVector3(0, 0, 0), sphere(), true);
    btRigidBody *hand = world.add_body(3, btVector3(0, btScalar(0.41), 0), sphere(), true);
    hand->setActivationState(DISABLE_DEACTIVATION);
    const isocoat_link torso_link = add_part(world, coat, torso), hand_link = add_part(world, coat, hand);
    if (!blend) {
        must(isocoat_body_blend_neighbours(world.coats, coat, nullptr, 0));
    }
    btHingeConstraint hinge(*hand, btVector3(-1, btScalar(-0.05), 0), btVector3(0, 0, 1));
    world.dynamics->addConstraint(&hinge);
    double least = 1.0, most = 0.0;
    for (int tick = 0; tick < 300; ++tick) {
        hand->applyCentralForce(btVector3(0, btScalar(-load), 0));
        world.dynamics->stepSimulation(btScalar(1.0 / 60), 1, btScalar(1.0 / 60));
        if (blend && tick == 10) {
            break;
        }
        if (tick >= 240) {
            const double half = 0.5 * double(hand->getCenterOfMassPosition().length());
            least = std::min(least, 1.0 - half / thickness);
            most = std::max(most, 1.0 - half / thickness);
        }
    }
    isocoat_wrench on_hand, on_torso;
    must(isocoat_link_get_wrench(world.coats, hand_link, &on_hand));
    must(isocoat_link_get_wrench(world.coats, torso_link, &on_torso));
    if (blend) {
        expect(on_hand.force[1] == 0.0, "parts that blend don't collide");
    } else {
        expect(least > 0.18 && most < 0.22, "pressed by %.0f N: in by %.4f to %.4f of the thickness; exact 0.2", load,
               least, most);
        const double sum = std::abs(on_hand.force[1] + on_torso.force[1]);
        expect(sum <= 1e-12 * load, "what one part gives the other gets: off by %.1e N of %.1f", sum, on_hand.force[1]);
    }
    world.dynamics->removeConstraint(&hinge);
}

}  // namespace

int main() {
    hand_on_torso(false);
    hand_on_torso(true);
    return summary("self");
}
