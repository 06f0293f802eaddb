// The character under Bullet: bodies, joints, stairs.
#ifndef CHARACTER_BULLET_HPP
#define CHARACTER_BULLET_HPP

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <vector>

#include <isocoat/isocoat.hpp>
#include <isocoat_bullet.hpp>

#include "character.hpp"

namespace character {

inline btVector3 bullet(const isocoat::vec3 &v) { return btVector3(btScalar(v[0]), btScalar(v[1]), btScalar(v[2])); }

/// A dynamics world with three stairs, and the character above the topmost, about to fall on its side.
class fall {
public:
    /// The push at its shoulders [N s] decides how it comes to lie.
    explicit fall(double push, double tick = 1.0 / 60.0)
        : coats(settings()), tick_(tick), coupler_(coats.get(), &dynamics_) {
        dynamics_.setGravity(btVector3(0, 0, btScalar(-9.81)));
        dynamics_.addAction(&coupler_);
        build_stairs();
        build_character();
        body(1).applyCentralImpulse(btVector3(btScalar(push), 0, 0));
    }

    ~fall() {
        for (const auto &joint : joints_) {
            dynamics_.removeConstraint(joint.get());
        }
        for (const auto &body : bodies_) {
            dynamics_.removeRigidBody(body.get());
        }
        dynamics_.removeAction(&coupler_);
    }

    fall(const fall &) = delete;
    fall &operator=(const fall &) = delete;

    void advance() {
        before_.clear();
        for (std::size_t i = 0; i < links_.size(); ++i) {
            before_.push_back(body(i).getCenterOfMassPosition());
        }
        dynamics_.stepSimulation(btScalar(tick_), 1, btScalar(tick_));
        if (!coupler_.last_error().empty()) {
            throw std::runtime_error(coupler_.last_error());
        }
        time_ += tick_;
    }

    double time() const { return time_; }
    std::size_t size() const { return links_.size(); }
    double height(std::size_t limb) const { return double(body(limb).getCenterOfMassPosition().z()); }
    btVector3 position(std::size_t limb) const { return body(limb).getCenterOfMassPosition(); }

    /// Speed of the fastest limb over the last tick [m/s].
    double fastest() const {
        double speed = 0.0;
        for (std::size_t i = 0; i < before_.size(); ++i) {
            speed = std::max(speed, double((position(i) - before_[i]).length()) / tick_);
        }
        return speed;
    }

    /// Height of the lowest limb's centre [m].
    double lowest() const {
        double least = height(0);
        for (std::size_t i = 1; i < links_.size(); ++i) {
            least = std::min(least, height(i));
        }
        return least;
    }

    int contacts() const { return int(coats.contacts().size()); }
    /// Contacts of the character with itself.
    int self_contacts() const {
        const auto contacts = coats.contacts();
        return int(std::count_if(contacts.begin(), contacts.end(), [](const isocoat::contact &contact) {
            return contact.body_a.index == contact.body_b.index;
        }));
    }

    isocoat::world coats;

private:
    static isocoat_world_desc settings() {
        isocoat_world_desc desc = isocoat_world_desc_default();
        desc.force_tolerance = 5e-2;
        desc.timed = 1;
        return desc;
    }

    btRigidBody &body(std::size_t limb) const { return *bodies_[first_limb_ + limb]; }

    btRigidBody &add(double mass, std::unique_ptr<btCollisionShape> shape, const btVector3 &at) {
        btVector3 inertia(0, 0, 0);
        if (mass > 0) {
            shape->calculateLocalInertia(btScalar(mass), inertia);
        }
        btRigidBody::btRigidBodyConstructionInfo info(btScalar(mass), nullptr, shape.get(), inertia);
        info.m_startWorldTransform = btTransform(btQuaternion::getIdentity(), at);
        bodies_.push_back(std::make_unique<btRigidBody>(info));
        shapes_.push_back(std::move(shape));
        isocoat::bullet::add_coated_body(dynamics_, bodies_.back().get());
        return *bodies_.back();
    }

    void build_stairs() {
        constexpr double coat = 0.05;
        isocoat_body_desc desc = flesh();
        desc.kind = ISOCOAT_BODY_RIGID;
        // A body each: the skeletons of one would blend.
        const auto add_part = [&](std::unique_ptr<btCollisionShape> shape, const btVector3 &at) {
            const std::vector<isocoat_skeleton_desc> skeletons = isocoat::bullet::skeletons_from(*shape, coat);
            btRigidBody &body = add(0.0, std::move(shape), at);
            isocoat::link link = coats.create_body(desc).create_link(isocoat::bullet::link_desc_from(body));
            for (const isocoat_skeleton_desc &skeleton : skeletons) {
                link.create_skeleton(skeleton);
            }
            coupler_.attach(&body, link.raw());
        };
        add_part(std::make_unique<btStaticPlaneShape>(btVector3(0, 0, 1), btScalar(0)), btVector3(0, 0, 0));
        for (int step = 0; step < 3; ++step) {
            const double top = 0.2 * (3 - step);
            add_part(std::make_unique<btBoxShape>(btVector3(btScalar(0.25), 1, btScalar(0.5 * top))),
                     btVector3(btScalar(0.5 * step), 0, btScalar(0.5 * top)));
        }
        first_limb_ = bodies_.size();
    }

    void build_character() {
        isocoat::body skin = coats.create_body(flesh());
        for (const limb &part : limbs()) {
            const btVector3 along = bullet(part.to) - bullet(part.from);
            const btVector3 center = place(bullet(middle(part)));
            // The capsule is there for the moments of inertia: no shape of the character's ever collides.
            btRigidBody &body = add(part.mass, std::make_unique<btCapsuleShapeZ>(btScalar(part.thickness), along.length()), center);
            isocoat::link link = skin.create_link(isocoat::bullet::link_desc_from(body));
            dress(link, part);
            coupler_.attach(&body, link.raw());
            body.setDamping(btScalar(0.05), btScalar(0.3));
            links_.push_back(link);
        }
        join(skin, links_);
        for (std::size_t i = 0; i < limbs().size(); ++i) {
            const limb &part = limbs()[i];
            if (part.parent >= 0) {
                add_joint(part, body(i), body(std::size_t(part.parent)));
            }
        }
    }

    /// On the topmost stair.
    static btVector3 place(const btVector3 &standing) { return standing + btVector3(btScalar(-0.05), 0, btScalar(0.6)); }

    void add_joint(const limb &part, btRigidBody &child, btRigidBody &parent) {
        const btVector3 at = place(bullet(part.joint));
        // The twist goes along the limb, the hinge about x.
        const btVector3 along = (bullet(part.to) - bullet(part.from)).normalized();
        const auto frame = [&](const btRigidBody &body, const btQuaternion &turn) {
            return body.getWorldTransform().inverse() * btTransform(turn, at);
        };
        std::unique_ptr<btTypedConstraint> joint;
        if (part.hinge) {
            // Bullet's hinges turn about z of their frames.
            const btQuaternion turn = shortestArcQuat(btVector3(0, 0, 1), btVector3(1, 0, 0));
            auto hinge = std::make_unique<btHingeConstraint>(parent, child, frame(parent, turn), frame(child, turn));
            // No bounce, and a stop that gives a little: at a hard one nothing rests in Bullet, with coats or without.
            hinge->setLimit(btScalar(-1.2), btScalar(0.1), btScalar(0.9), btScalar(0.3), 0);
            hinge->setParam(BT_CONSTRAINT_STOP_CFM, btScalar(0.3));
            joint = std::move(hinge);
        } else {
            // Cone-twist joints twist about x of theirs.
            const btQuaternion turn = shortestArcQuat(btVector3(1, 0, 0), along);
            auto cone = std::make_unique<btConeTwistConstraint>(parent, child, frame(parent, turn), frame(child, turn));
            cone->setLimit(btScalar(0.9), btScalar(0.9), btScalar(0.3));
            cone->setParam(BT_CONSTRAINT_CFM, btScalar(0.3), 3);
            joint = std::move(cone);
        }
        dynamics_.addConstraint(joint.get(), true);
        joints_.push_back(std::move(joint));
    }

    double tick_;
    double time_ = 0.0;
    btDefaultCollisionConfiguration configuration_;
    btCollisionDispatcher dispatcher_{&configuration_};
    btDbvtBroadphase broadphase_;
    btSequentialImpulseConstraintSolver solver_;
    btDiscreteDynamicsWorld dynamics_{&dispatcher_, &broadphase_, &solver_, &configuration_};
    isocoat::bullet::coupler coupler_;
    std::vector<std::unique_ptr<btCollisionShape>> shapes_;
    std::vector<std::unique_ptr<btRigidBody>> bodies_;
    std::vector<std::unique_ptr<btTypedConstraint>> joints_;
    std::vector<isocoat::link> links_;
    std::vector<btVector3> before_;
    std::size_t first_limb_ = 0;
};

}  // namespace character

#endif
