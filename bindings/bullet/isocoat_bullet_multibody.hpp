// isocoat for Bullet: coats on the links of btMultiBody objects, beside those on btRigidBody objects.
//
// SPDX-License-Identifier: MIT OR Apache-2.0
//
// A multibody_coupler is a coupler (see isocoat_bullet.hpp) that also takes link colliders, the base's or a link's:
//
//     isocoat::bullet::multibody_coupler coupler(coats, &dynamics);        // a btMultiBodyDynamicsWorld
//     isocoat_link_desc link_desc = isocoat::bullet::link_desc_from(*collider);
//     ... isocoat_link_create(coats, coat_body, &link_desc, &link); isocoat_skeleton_create(coats, link, ...);
//     coupler.attach(collider, link);
//     dynamics.addAction(&coupler);
//
// What to know:
//
// Frames     The frame of a link is its collider's: its origin is the link's centre of mass.
// Joints     isocoat is told how the whole multibody answers pushes on those links that touch (an articulation), and
//            what gravity, forces, joint torques, damping and its own motion do to them in the coming tick. So a
//            multibody that stands on coats sinks by what its load makes it sink. Joints that take freedom away make
//            the matrix singular: a millionth of the lone links' freedom is added in all directions, a ten-thousandth
//            in single precision.
// Held       When the joints do not move as this predicts (limits, motors, constraints, contacts of Bullet's own), what
//            is missing is estimated from tick to tick.
// Impulses   Impulses of contact change the joint velocities at once. No force is used: forces last for a frame.
// Sleep      A multibody that is touched stays awake.
// Absent     A link whose multibody or collider is not in the dynamics world is disabled until both are back. Both may
//            be deleted when they have left it.
#ifndef ISOCOAT_BULLET_MULTIBODY_HPP
#define ISOCOAT_BULLET_MULTIBODY_HPP

#include <array>
#include <unordered_map>
#include <unordered_set>
#include <utility>
#include <vector>

#include <BulletDynamics/Featherstone/btMultiBody.h>
#include <BulletDynamics/Featherstone/btMultiBodyDynamicsWorld.h>
#include <BulletDynamics/Featherstone/btMultiBodyLinkCollider.h>

#include "isocoat_bullet.hpp"

namespace isocoat {
namespace bullet {

namespace detail {

inline btScalar mass_of(const btMultiBody &multibody, int link) {
    return link < 0 ? multibody.getBaseMass() : multibody.getLinkMass(link);
}

inline btVector3 inertia_of(const btMultiBody &multibody, int link) {
    return link < 0 ? multibody.getBaseInertia() : multibody.getLinkInertia(link);
}

inline btTransform pose_of(const btMultiBody &multibody, int link) {
    return btTransform(multibody.localFrameToWorld(link, btMatrix3x3::getIdentity()),
                       multibody.localPosToWorld(link, btVector3(0, 0, 0)));
}

/// How pushes on one link of a multibody and the motion of its joints belong together.
struct leverage {
    /// For each direction in the world, 3 linear and 3 angular: what the joints contribute to the link's velocity.
    std::array<std::vector<btScalar>, 6> rows;
    /// What a unit impulse along it changes in the joints' velocities.
    std::array<std::vector<btScalar>, 6> answers;

    /// The multibody's own tables have to be those of its present pose.
    void find(const btMultiBody &multibody, int link, btAlignedObjectArray<btScalar> &scalars,
              btAlignedObjectArray<btVector3> &vectors, btAlignedObjectArray<btMatrix3x3> &matrices) {
        const std::size_t size = std::size_t(6 + multibody.getNumDofs());
        const btVector3 center = multibody.localPosToWorld(link, btVector3(0, 0, 0));
        const bool fixed_base = multibody.isBaseStaticOrKinematic();
        for (int direction = 0; direction < 6; ++direction) {
            std::vector<btScalar> &row = rows[std::size_t(direction)];
            std::vector<btScalar> &answer = answers[std::size_t(direction)];
            row.assign(size, 0);
            answer.assign(size, 0);
            btVector3 linear(0, 0, 0), angular(0, 0, 0);
            (direction < 3 ? linear : angular)[direction % 3] = 1;
            multibody.fillConstraintJacobianMultiDof(link, center, angular, linear, row.data(), scalars, vectors,
                                                     matrices);
            multibody.calcAccelerationDeltasMultiDof(row.data(), answer.data(), scalars, vectors);
            if (fixed_base) {
                std::fill(answer.begin(), answer.begin() + 6, btScalar(0));
            }
        }
    }

    static double dot(const std::vector<btScalar> &row, const btScalar *joints) {
        double sum = 0.0;
        for (std::size_t i = 0; i < row.size(); ++i) {
            sum += double(row[i]) * double(joints[i]);
        }
        return sum;
    }

    /// Linear and angular part of what these rates of the joints are at the link.
    std::array<double, 6> at_link(const btScalar *joints) const {
        std::array<double, 6> out;
        for (std::size_t i = 0; i < 6; ++i) {
            out[i] = dot(rows[i], joints);
        }
        return out;
    }

    /// From wrench to acceleration of the link.
    std::array<double, 36> mobility() const {
        std::array<double, 36> out;
        for (std::size_t i = 0; i < 6; ++i) {
            for (std::size_t j = 0; j <= i; ++j) {
                out[6 * i + j] = out[6 * j + i] =
                    0.5 * (dot(rows[i], answers[j].data()) + dot(rows[j], answers[i].data()));
            }
        }
        return out;
    }
};

}  // namespace detail

/// A link descriptor for a link of a multibody: pose, mass, and that joints hold it. attach() sets the same on any
/// link; how the joints hold it is worked out in every tick.
inline isocoat_link_desc link_desc_from(const btMultiBodyLinkCollider &collider) {
    const btMultiBody &multibody = *collider.m_multiBody;
    const double mass = double(detail::mass_of(multibody, collider.m_link));
    isocoat_link_desc desc = isocoat_link_desc_default();
    desc.kind = ISOCOAT_LINK_HOST;
    desc.pose = detail::pose_from(detail::pose_of(multibody, collider.m_link));
    desc.mass = mass > 0.0 ? mass : 1.0;
    desc.inertia[0] = desc.inertia[4] = desc.inertia[8] = desc.mass;
    desc.gravity_scale = 0.0;
    desc.velocity_convention = ISOCOAT_VELOCITY_LEAPFROG;
    desc.flags = ISOCOAT_LINK_CONSTRAINED;
    return desc;
}

/// Adds a link collider to the dynamics world in the group of add_coated_body.
inline void add_coated_link(btMultiBodyDynamicsWorld &dynamics, btMultiBodyLinkCollider *collider) {
    dynamics.addCollisionObject(collider, coated_group, int(btBroadphaseProxy::AllFilter) & ~coated_group);
}

/// Couples rigid bodies and links of multibodies to the links of one isocoat world; see the top of this file.
class multibody_coupler : public coupler {
public:
    /// As coupler's.
    multibody_coupler(isocoat_world *world, btMultiBodyDynamicsWorld *dynamics)
        : coupler(world, dynamics), dynamics_(dynamics) {}

    using coupler::attach;
    using coupler::detach;
    using coupler::is_attached;
    using coupler::link_of;
    using coupler::teleport;

    /// Ties an isocoat link to a link of a multibody, or to its base.
    ///
    /// - collider: not NULL, set in its multibody, not attached yet; it need not be in the dynamics world yet.
    /// - link: with its skeletons, or without; not attached yet.
    void attach(btMultiBodyLinkCollider *collider, isocoat_link link) {
        if (collider == nullptr || collider->m_multiBody == nullptr) {
            throw std::runtime_error("isocoat: the collider is NULL, or has no multibody");
        }
        if (is_attached(collider) || has_link(link)) {
            throw std::runtime_error("isocoat: the collider or the link is attached already");
        }
        isocoat_link_desc desc = isocoat_link_desc_default();
        detail::check(isocoat_link_get_desc(coats(), link, &desc), "attach");
        const isocoat_link_desc like = link_desc_from(*collider);
        desc.kind = collider->m_link < 0 && collider->m_multiBody->hasFixedBase() ? ISOCOAT_LINK_FIXED : like.kind;
        desc.pose = like.pose;
        desc.mass = like.mass;
        std::copy(like.inertia, like.inertia + 9, desc.inertia);
        desc.gravity_scale = like.gravity_scale;
        desc.velocity_convention = like.velocity_convention;
        desc.flags = like.flags;
        detail::check(isocoat_link_set_desc(coats(), link, &desc), "attach");
        limb fresh;
        fresh.collider = collider;
        fresh.multibody = collider->m_multiBody;
        fresh.link = link;
        fresh.desc = desc;
        limbs_.push_back(std::move(fresh));
    }

    /// Unties a link collider; false when it was not attached. It may be gone already.
    bool detach(const btMultiBodyLinkCollider *collider) {
        const auto found = find(collider);
        if (found == limbs_.end()) {
            return false;
        }
        limbs_.erase(found);
        return true;
    }

    bool is_attached(const btMultiBodyLinkCollider *collider) const { return find(collider) != limbs_.end(); }

    /// The isocoat link of a link collider. Throws std::runtime_error when it is not attached.
    isocoat_link link_of(const btMultiBodyLinkCollider *collider) const {
        const auto found = find(collider);
        if (found == limbs_.end()) {
            throw std::runtime_error("isocoat: the collider is not attached");
        }
        return found->link;
    }

    /// Forgets the contact history of all links of a multibody that the host puts elsewhere.
    void teleport(const btMultiBody *multibody) {
        for (limb &one : limbs_) {
            one.jumped |= one.multibody == multibody;
        }
    }

protected:
    bool has_link(isocoat_link link) const override {
        return coupler::has_link(link) ||
               std::any_of(limbs_.begin(), limbs_.end(), [&](const limb &one) { return same(one.link, link); });
    }

    void before_step(btScalar dt) override {
        find_present();
        for (auto &pair : trees_) {
            predict(pair.second, dt);
        }
        limbs_.erase(std::remove_if(limbs_.begin(), limbs_.end(), [&](limb &one) { return !tell(one, dt); }),
                     limbs_.end());
        for (auto &pair : trees_) {
            join(*pair.second.multibody);
        }
    }

    void after_step(btScalar) override {
        for (auto &pair : trees_) {
            pair.second.change.assign(pair.second.acceleration.size(), 0);
        }
        for (limb &one : limbs_) {
            if (one.present && one.moves) {
                take(one);
            }
        }
        for (auto &pair : trees_) {
            tree &one = pair.second;
            if (std::any_of(one.change.begin(), one.change.end(), [](btScalar x) { return x != 0; })) {
                wake(*one.multibody);
                one.multibody->applyDeltaVeeMultiDof(one.change.data(), 1);
            }
            for (std::size_t i = 0; i < one.expected.size(); ++i) {
                one.expected[i] += one.change[i];
            }
        }
        for (limb &one : limbs_) {
            if (one.present && one.told) {
                const std::array<double, 6> change = one.leverage.at_link(trees_[one.multibody].change.data());
                for (std::size_t i = 0; i < 6; ++i) {
                    one.expected[i] += change[i];
                }
            }
        }
    }

private:
    /// A multibody with attached links, in the dynamics world.
    struct tree {
        btMultiBody *multibody = nullptr;
        /// What the joints will add to their velocities by themselves, a second, and what contacts add at once.
        std::vector<btScalar> acceleration;
        std::vector<btScalar> change;
        /// Velocities that the joints should have at the next tick.
        std::vector<btScalar> expected;
        /// Ticks for which it counts as held by something else still.
        int held = 0;
        bool seen = false;
    };

    /// An attached link of a multibody.
    struct limb {
        btMultiBodyLinkCollider *collider = nullptr;
        btMultiBody *multibody = nullptr;
        isocoat_link link{};
        /// As isocoat was told.
        isocoat_link_desc desc{};
        detail::leverage leverage;
        /// Velocity that the link should have at the next tick, and what was missing, as an acceleration.
        std::array<double, 6> expected{};
        std::array<double, 6> missing{};
        bool told = false;
        /// Ticks for which it counts as touching still.
        int touching = 0;
        bool present = true;
        bool jumped = true;
        /// Contacts can move it.
        bool moves = false;
        /// One over its own mass and inertia, or what stands for them.
        double lone_linear = 0.0, lone_angular = 0.0;
    };

    /// Ticks for which what comes and goes counts as there still.
    static constexpr int lasting_ticks = 6;

    /// Part of what was missing in a tick that goes into the estimate: stable while the link is at most ten times as
    /// heavy as its matrix says.
    static constexpr double learned = 0.1;

    /// Part of a link's own inverse inertia that its joints leave it in every direction: otherwise none is left in
    /// some.
    static constexpr double left_over = sizeof(btScalar) == sizeof(float) ? 1e-4 : 1e-6;

    /// Part of a change of the joints' velocities, and of the velocities, by which they may be off unheld.
    static constexpr double off_change = 0.01;
    static constexpr double off_velocity = 1e-4;

    std::vector<limb>::iterator find(const btMultiBodyLinkCollider *collider) {
        return std::find_if(limbs_.begin(), limbs_.end(), [&](const limb &one) { return one.collider == collider; });
    }
    std::vector<limb>::const_iterator find(const btMultiBodyLinkCollider *collider) const {
        return std::find_if(limbs_.begin(), limbs_.end(), [&](const limb &one) { return one.collider == collider; });
    }

    /// Which links are in the dynamics world with their multibodies; others may have been deleted.
    void find_present() {
        std::unordered_set<const void *> there;
        for (int i = 0; i < dynamics_->getNumMultibodies(); ++i) {
            there.insert(dynamics_->getMultiBody(i));
        }
        const btCollisionObjectArray &objects = dynamics_->getCollisionObjectArray();
        for (int i = 0; i < objects.size(); ++i) {
            there.insert(objects[i]);
        }
        for (auto &pair : trees_) {
            pair.second.seen = false;
        }
        for (limb &one : limbs_) {
            const bool present = there.count(one.multibody) != 0 && there.count(one.collider) != 0;
            if (present != one.present && isocoat_link_set_enabled(coats(), one.link, present) == ISOCOAT_OK) {
                one.present = present;
                one.jumped = true;
            }
            if (one.present) {
                tree &of = trees_[one.multibody];
                of.multibody = one.multibody;
                of.seen = true;
            }
        }
        for (auto at = trees_.begin(); at != trees_.end();) {
            at = at->second.seen ? std::next(at) : trees_.erase(at);
        }
    }

    /// What the joints will do in the next tick without contacts; and whether they did what they should in this one.
    void predict(tree &of, btScalar dt) {
        btMultiBody &multibody = *of.multibody;
        const std::size_t size = std::size_t(6 + multibody.getNumDofs());
        const btScalar *velocity = multibody.getVelocityVector();
        of.held = std::max(of.held - 1, 0);
        if (of.expected.size() == size) {
            double off = 0.0, change = 0.0, all = 0.0;
            for (std::size_t i = 0; i < size; ++i) {
                const double added = double(of.acceleration[i]) * double(dt) + double(of.change[i]);
                off += std::pow(double(velocity[i] - of.expected[i]), 2);
                change += added * added;
                all += std::pow(double(velocity[i]), 2);
            }
            if (std::sqrt(off) > off_change * std::sqrt(change) + off_velocity * std::sqrt(all)) {
                of.held = lasting_ticks;
            }
        }
        // Without time it changes no velocity, but brings the tables up to date that the answers to pushes come from.
        // What joint feedback has measured is the host's.
        std::vector<btMultiBodyJointFeedback *> feedback;
        for (int i = 0; i < multibody.getNumLinks(); ++i) {
            feedback.push_back(std::exchange(multibody.getLink(i).m_jointFeedback, nullptr));
        }
        multibody.computeAccelerationsArticulatedBodyAlgorithmMultiDof(0, scalars_, vectors_, matrices_, false, false,
                                                                       false);
        for (int i = 0; i < multibody.getNumLinks(); ++i) {
            multibody.getLink(i).m_jointFeedback = feedback[std::size_t(i)];
        }
        of.acceleration.assign(size, 0);
        of.change.assign(size, 0);
        of.expected.assign(velocity, velocity + size);
        const std::size_t first = multibody.isBaseStaticOrKinematic() ? 6 : 0;
        for (std::size_t i = first; i < size; ++i) {
            of.acceleration[i] = scalars_[multibody.getNumDofs() + int(i)];
            of.expected[i] += of.acceleration[i] * dt;
        }
    }

    /// Tells isocoat where a link is and what moves it; false when the isocoat link is gone.
    bool tell(limb &one, btScalar dt) {
        if (!one.present) {
            return true;
        }
        const btMultiBody &multibody = *one.multibody;
        tree &of = trees_[one.multibody];
        const std::size_t size = of.acceleration.size();
        const std::array<double, 6> before =
            one.told && one.leverage.rows[0].size() == size && !one.jumped
                ? one.leverage.at_link(multibody.getVelocityVector())
                : one.expected;
        one.leverage.find(multibody, one.collider->m_link, scalars_, vectors_, matrices_);
        const std::array<double, 6> velocity = one.leverage.at_link(multibody.getVelocityVector());
        std::array<double, 6> acceleration = one.leverage.at_link(of.acceleration.data());

        // Links of one multibody that touch at once move each other. Where isocoat does not solve them together, each
        // is safe by itself if it seems as many times as mobile as it is.
        const int others = int(std::count_if(limbs_.begin(), limbs_.end(), [&](const limb &other) {
            return &other != &one && other.multibody == one.multibody && other.touching > 0;
        }));
        if (of.held > 0 || others > 0) {
            for (std::size_t i = 0; i < 6; ++i) {
                one.missing[i] += (before[i] - one.expected[i]) * (learned / double(dt));
                acceleration[i] += one.missing[i];
            }
        } else {
            one.missing.fill(0.0);
        }

        isocoat_link_state state{};
        state.pose = detail::pose_from(detail::pose_of(multibody, one.collider->m_link));
        std::copy(velocity.begin(), velocity.begin() + 3, state.linear_velocity);
        std::copy(velocity.begin() + 3, velocity.end(), state.angular_velocity);
        if (!detail::is_finite(state)) {
            report("isocoat: a multibody's pose or velocity is not finite");
            one.touching = 0;
            return true;
        }
        describe(one, double(others + 1));
        const isocoat_status status =
            one.jumped ? isocoat_link_teleport(coats(), one.link, &state)
                       : isocoat_world_set_link_states(coats(), &one.link, &state, 1);
        if (status == ISOCOAT_ERROR_INVALID_HANDLE) {
            return false;
        }
        one.jumped = false;
        if (one.moves) {
            detail::check(isocoat_link_set_external_acceleration(coats(), one.link, acceleration.data(),
                                                                 acceleration.data() + 3),
                          "acceleration");
        }
        for (std::size_t i = 0; i < 6; ++i) {
            one.expected[i] = velocity[i] + acceleration[i] * double(dt);
        }
        one.told = true;
        return true;
    }

    /// Tells isocoat how the links of a multibody that touch move each other.
    void join(const btMultiBody &multibody) {
        std::vector<const limb *> touching;
        std::vector<isocoat_link> links;
        for (const limb &one : limbs_) {
            if (one.multibody == &multibody && one.present && one.moves && one.touching > 0) {
                touching.push_back(&one);
                links.push_back(one.link);
            }
        }
        if (touching.size() < 2) {
            return;
        }
        const std::size_t width = 6 * touching.size();
        std::vector<double> matrix(width * width);
        for (std::size_t i = 0; i < width; ++i) {
            for (std::size_t j = 0; j <= i; ++j) {
                const detail::leverage &a = touching[i / 6]->leverage, &b = touching[j / 6]->leverage;
                const double there = detail::leverage::dot(a.rows[i % 6], b.answers[j % 6].data());
                const double back = detail::leverage::dot(b.rows[j % 6], a.answers[i % 6].data());
                matrix[i * width + j] = matrix[j * width + i] = 0.5 * (there + back);
            }
            // It is singular, and rounding makes it worse than that.
            const limb &one = *touching[i / 6];
            matrix[i * width + i] += left_over * (i % 6 < 3 ? one.lone_linear : one.lone_angular);
        }
        add_articulation(links, matrix);
    }

    /// How a link answers pushes, `times` as readily as the multibody by itself would.
    void describe(limb &one, double times) {
        const btMultiBody &multibody = *one.multibody;
        const int link = one.collider->m_link;
        const double mass = double(detail::mass_of(multibody, link));
        const btVector3 inertia = detail::inertia_of(multibody, link);
        std::array<double, 36> matrix = one.leverage.mobility();
        const double linear = matrix[0] + matrix[7] + matrix[14];
        const double angular = matrix[21] + matrix[28] + matrix[35];
        const double turning = double(inertia.x() + inertia.y() + inertia.z());
        const double lone_linear = one.lone_linear = mass > 0.0 ? 1.0 / mass : linear;
        const double lone_angular = one.lone_angular = turning > 0.0 ? 3.0 / turning : angular;
        isocoat_link_desc desc = one.desc;
        one.moves = linear > 1e-9 * lone_linear || angular > 1e-9 * lone_angular;
        if (!one.moves) {
            const bool driven = multibody.isBaseKinematic() || one.collider->isKinematicObject();
            desc.kind = driven ? ISOCOAT_LINK_HOST : ISOCOAT_LINK_FIXED;
            desc.mass = 0.0;
            std::fill(desc.inertia, desc.inertia + 9, 0.0);
            desc.flags = 0;
        } else {
            desc.kind = ISOCOAT_LINK_HOST;
            desc.mass = mass > 0.0 ? mass : 1.0;
            std::fill(desc.inertia, desc.inertia + 9, 0.0);
            desc.inertia[0] = desc.inertia[4] = desc.inertia[8] = desc.mass;
            desc.flags = ISOCOAT_LINK_CONSTRAINED | ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA;
        }
        // Rounding can make the matrix of a long chain a little worse than singular.
        for (double little = 1e-6; little < 1e-2; little *= 10.0) {
            std::fill(desc.inverse_effective_inertia, desc.inverse_effective_inertia + 36, 0.0);
            for (std::size_t i = 0; one.moves && i < 36; ++i) {
                const bool diagonal = i % 7 == 0;
                const double extra = diagonal ? little * (i < 21 ? lone_linear : lone_angular) : 0.0;
                desc.inverse_effective_inertia[i] = times * matrix[i] + extra;
            }
            const auto &now = desc.inverse_effective_inertia;
            if (one.told && desc.kind == one.desc.kind && desc.flags == one.desc.flags && desc.mass == one.desc.mass &&
                std::equal(now, now + 36, one.desc.inverse_effective_inertia)) {
                return;
            }
            isocoat_link_desc whole = isocoat_link_desc_default();
            if (isocoat_link_get_desc(coats(), one.link, &whole) != ISOCOAT_OK) {
                return;  // shows when its state is set
            }
            whole.kind = desc.kind;
            whole.mass = desc.mass;
            whole.flags = desc.flags;
            std::copy(desc.inertia, desc.inertia + 9, whole.inertia);
            std::copy(now, now + 36, whole.inverse_effective_inertia);
            if (isocoat_link_set_desc(coats(), one.link, &whole) == ISOCOAT_OK) {
                one.desc = desc;
                return;
            }
        }
        report("isocoat: how a multibody answers pushes is refused: " + detail::last_error());
    }

    /// Takes what contacts put on a link.
    void take(limb &one) {
        isocoat_wrench impulse;
        if (isocoat_link_get_impulse(coats(), one.link, &impulse) != ISOCOAT_OK) {
            return;
        }
        double wrench[6];
        std::copy(impulse.force, impulse.force + 3, wrench);
        std::copy(impulse.torque, impulse.torque + 3, wrench + 3);
        one.touching = std::max(one.touching - 1, 0);
        if (std::all_of(wrench, wrench + 6, [](double x) { return x == 0.0; })) {
            return;
        }
        one.touching = lasting_ticks;
        tree &of = trees_[one.multibody];
        for (std::size_t i = 0; i < 6; ++i) {
            for (std::size_t joint = 0; joint < of.change.size(); ++joint) {
                of.change[joint] += btScalar(double(one.leverage.answers[i][joint]) * wrench[i]);
            }
        }
    }

    /// A touched multibody does not fall asleep.
    static void wake(btMultiBody &multibody) {
        multibody.wakeUp();
        for (int link = -1; link < multibody.getNumLinks(); ++link) {
            btMultiBodyLinkCollider *collider =
                link < 0 ? multibody.getBaseCollider() : multibody.getLinkCollider(link);
            if (collider != nullptr) {
                const int state = collider->getActivationState();
                if (state == ISLAND_SLEEPING || state == WANTS_DEACTIVATION) {
                    collider->activate(true);
                }
            }
        }
    }

    btMultiBodyDynamicsWorld *dynamics_;
    /// In the order of their attachment.
    std::vector<limb> limbs_;
    std::unordered_map<const btMultiBody *, tree> trees_;
    /// Room for Bullet to work in.
    btAlignedObjectArray<btScalar> scalars_;
    btAlignedObjectArray<btVector3> vectors_;
    btAlignedObjectArray<btMatrix3x3> matrices_;
};

}  // namespace bullet
}  // namespace isocoat

#endif
