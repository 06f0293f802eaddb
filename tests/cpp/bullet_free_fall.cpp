// Free fall and tumbling with a coupler equal those without one, bit for bit, as long as no coats touch; and what the
// helpers make of shapes.
#include <cstring>

#include "bullet_scene.hpp"

namespace {

bool same_bits(const btRigidBody &a, const btRigidBody &b) {
    return std::memcmp(&a.getWorldTransform(), &b.getWorldTransform(), sizeof(btTransform)) == 0 &&
           a.getLinearVelocity() == b.getLinearVelocity() && a.getAngularVelocity() == b.getAngularVelocity();
}

void fall(int ticks) {
    scene coated, plain;
    plain.dynamics->removeAction(plain.coupler.get());
    btRigidBody *bodies[2][2];
    scene *scenes[2] = {&coated, &plain};
    for (int i = 0; i < 2; ++i) {
        scenes[i]->add_floor();
        bodies[i][0] = scenes[i]->add_ball(btVector3(0, 40, 0));
        bodies[i][1] = scenes[i]->add_coated(
            2, btVector3(3, 41, 0),
            std::make_unique<btBoxShape>(btVector3(btScalar(0.5), btScalar(0.3), btScalar(0.7))), material());
        bodies[i][0]->setLinearVelocity(btVector3(1, 2, btScalar(0.3)));
        bodies[i][1]->setAngularVelocity(btVector3(1, btScalar(0.2), 3));
        bodies[i][1]->setDamping(btScalar(0.1), btScalar(0.2));
    }
    int different = 0;
    for (int i = 0; i < 120; ++i) {
        coated.frame(ticks);
        plain.frame(ticks);
        for (int j = 0; j < 2; ++j) {
            different += same_bits(*bodies[0][j], *bodies[1][j]) ? 0 : 1;
        }
    }
    expect(different == 0 && bodies[0][0]->getCenterOfMassPosition().y() < 30,
           "%d tick(s) a frame: %d of 240 states differ after a fall to %.3f m", ticks, different,
           double(bodies[0][0]->getCenterOfMassPosition().y()));
}

bool refused(const std::function<void()> &call) {
    try {
        call();
    } catch (const std::runtime_error &error) {
        std::printf("      refused: %s\n", error.what());
        return true;
    }
    return false;
}

void shapes() {
    using isocoat::bullet::skeletons_from;
    const btCapsuleShapeZ capsule(btScalar(0.2), btScalar(1));
    const isocoat_skeleton_desc segment = skeletons_from(capsule, 0.1)[0];
    expect(std::abs(segment.points[0][2] - 0.5) < 1e-6 && std::abs(segment.points[1][2] + 0.5) < 1e-6 &&
               std::abs(segment.thickness - 0.2) < 1e-6,
           "capsule along z: from %.3f to %.3f, thickness %.3f m", segment.points[0][2], segment.points[1][2],
           segment.thickness);

    btBoxShape box(btVector3(1, 2, 3));
    box.setMargin(btScalar(0.3));
    btCompoundShape compound;
    compound.addChildShape(btTransform(btQuaternion(btVector3(0, 0, 1), SIMD_HALF_PI), btVector3(5, 0, 0)), &box);
    const isocoat_skeleton_desc turned = skeletons_from(compound, 0.25)[0];
    expect(std::abs(turned.points[0][0] - 5) < 1e-6 && std::abs(turned.points[1][1] - 1.75) < 1e-6 &&
               std::abs(turned.points[2][2] - 0.5 * 3.14159265) < 1e-6,
           "box in a compound: half extents %.3f %.3f %.3f under a coat of 0.25 m, whatever the margin",
           turned.points[1][0], turned.points[1][1], turned.points[1][2]);
    const btSphereShape ball(btScalar(0.5));
    expect(std::abs(skeletons_from(ball, 0.1)[0].thickness - 0.5) < 1e-6, "ball: its coat is its radius");

    const btCylinderShape cylinder(btVector3(1, 1, 1));
    expect(refused([&] { skeletons_from(cylinder, 0.1); }), "a cylinder has no skeleton");
    expect(refused([&] { skeletons_from(box, 1.0); }), "a box that is all coat");
    expect(refused([] { isocoat::bullet::coupler nothing(nullptr, nullptr); }), "a coupler of nothing");
}

}  // namespace

int main() {
    for (const int ticks : {1, 2, 4}) {
        fall(ticks);
    }
    shapes();
    return summary("free fall");
}
