// isocoat for Bullet: coats on btRigidBody objects. Header-only, C++17, float and double builds of Bullet.
//
// SPDX-License-Identifier: MIT OR Apache-2.0
//
// A coupler is an action of the dynamics world. At the end of every internal tick it gives isocoat the poses and
// velocities of the attached bodies, steps the isocoat world by the tick, and puts the contact impulses on the bodies,
// so that they act in the next tick:
//
//     isocoat_world *coats = ...;                                        // gravity may stay 0, see below
//     isocoat::bullet::coupler coupler(coats, &dynamics);
//     isocoat_link_desc link_desc = isocoat::bullet::link_desc_from(*body);
//     ... isocoat_link_create(coats, coat_body, &link_desc, &link); isocoat_skeleton_create(coats, link, ...);
//     coupler.attach(body, link);
//     dynamics.addAction(&coupler);                                      // and removeAction before it goes
//     dynamics.stepSimulation(frame, max_sub_steps, tick);               // as always
//
// What to know:
//
// Frames     A body's frame in Bullet has its centre of mass at the origin. The link of an attached body has the same
//            frame, and skeletons are given in it.
// Forces     Gravity is Bullet's: an attached link gets none from its isocoat world. Forces and impulses of the host,
//            damping, joints and Bullet's own contacts all act. The coupler expects of the coming tick the forces that
//            it sees on the body; what then differs counts as a push and is taken up one tick later, none is lost.
// Velocity   Between ticks a body's velocity holds the impulse that is going to meet the next tick's gravity: a body
//            that rests on coats shows g dt upwards (0.16 m/s at 60 Hz). So sleeping thresholds must be above that;
//            Bullet's own, 0.8 m/s, is. A body on a plain floor that coats press from above shows their load: raise
//            its thresholds if that is more than five times its weight at 60 Hz.
// Sub-steps  Each internal tick has its own isocoat step. Use fixed ticks: a tick length that changes costs accuracy
//            while bodies touch.
// Core       A coat does not replace the body's shape. Filter the shapes against those of coat partners
//            (add_coated_body or ignore_core), let them collide with the plain world, and see enable_ccd.
// Held       Every tick the coupler sees which bodies are held: by enabled constraints, and by contacts of their shapes.
//            isocoat solves what these touch implicitly: it rests soundly, and bounces less than free bodies do.
// Joints     While bodies that constraints join touch, the coupler works out from the constraints' rows how all of
//            them answer pushes, so that they may carry any load; it asks each constraint once more a tick for its
//            rows. What contacts push is passed on to all of them at once: bodies without a coat get velocities too.
//            So a joint's applied impulse is without what contacts ask of it. Constraints with joint feedback or a
//            breaking threshold keep all of theirs: they are left to Bullet alone, as are limits and motors. What
//            these and contacts of Bullet's own do to a body is estimated: stable while they make it at most three
//            times as heavy, where its coat is.
// Limits     Bullet's joint limits are no places to rest at. By default a hinge bounces off them, and a limit has a row
//            only while it is passed: a link that leans on one moves by 0.1 m/s for ever, without any coat. Let limits
//            give a little: hinge.setLimit(low, high, 0.9, 0.3, 0), hinge.setParam(BT_CONSTRAINT_STOP_CFM, 0.3),
//            cone_twist.setParam(BT_CONSTRAINT_CFM, 0.3, 3).
// Sleep      Bodies that touch through their coats fall asleep together. A sleeping body keeps its coat: it is pressed
//            and presses back, but stays where it is. It wakes when what the coat asks of it changes: a new push, or
//            support that goes away. A pile at rest stays asleep. While everything sleeps, the isocoat world is
//            stepped in one tick of 64 only: what changes in it alone is noticed then.
// Static     A static body's link is fixed, and follows when the host moves the body. A kinematic body's link moves
//            with the velocity that Bullet works out from its motion state.
// Absent     A body that is not in the dynamics world has its link disabled until it is back. The coupler touches
//            bodies only while they are in the dynamics world, so bodies, links, coupler and worlds may be deleted in
//            any order, if deleted bodies have left the dynamics world and the coupler is no action when it, or the
//            isocoat world, is deleted.
// Errors     What sets up throws std::runtime_error. Nothing is thrown through Bullet: see last_error.
#ifndef ISOCOAT_BULLET_HPP
#define ISOCOAT_BULLET_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <exception>
#include <functional>
#include <stdexcept>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include <isocoat/isocoat.h>

#include "isocoat_bullet_bodies.hpp"
#include "isocoat_bullet_joints.hpp"

namespace isocoat {
namespace bullet {

/// Couples the bodies of one dynamics world to the links of one isocoat world; see the top of this file.
class coupler : public btActionInterface {
public:
    /// Neither world is owned. Not yet an action: call dynamics->addAction(this), or step() from a tick callback.
    ///
    /// Throws std::runtime_error when a world is missing, or the isocoat library does not fit its header.
    coupler(isocoat_world *world, btDiscreteDynamicsWorld *dynamics) : world_(world), dynamics_(dynamics) {
        if (detail::bullet_library_must_have_the_precision_of_the_compiled_code::reference() == nullptr ||
            world == nullptr || dynamics == nullptr) {
            throw std::runtime_error("isocoat: a coupler needs an isocoat world and a dynamics world");
        }
        detail::check(isocoat_check_abi(), "library and header differ");
    }

    coupler(const coupler &) = delete;
    coupler &operator=(const coupler &) = delete;

    /// Ties a link to a body: the link gets the body's kind, mass, inertia and pose, and follows it from now on.
    ///
    /// - body: not NULL, not attached yet; it need not be in the dynamics world yet.
    /// - link: with its skeletons, or without; not attached yet.
    void attach(btRigidBody *body, isocoat_link link) {
        if (body == nullptr || is_attached(body)) {
            throw std::runtime_error(body ? "isocoat: the body is attached already" : "isocoat: the body is NULL");
        }
        if (has_link(link)) {
            throw std::runtime_error("isocoat: the link is attached to another body");
        }
        attachment fresh;
        fresh.body = body;
        fresh.link = link;
        describe(fresh);
        of_body_[body] = entries_.size();
        of_link_[link.index] = entries_.size();
        entries_.push_back(fresh);
    }

    /// Unties a body; false when it was not attached. The link stays as it is: destroy or disable it, or attach it
    /// elsewhere. The body may be gone already.
    bool detach(const btRigidBody *body) {
        const auto found = of_body_.find(body);
        if (found == of_body_.end()) {
            return false;
        }
        entries_.erase(entries_.begin() + std::ptrdiff_t(found->second));
        index();
        return true;
    }

    bool is_attached(const btRigidBody *body) const { return of_body_.count(body) != 0; }

    /// The link of a body. Throws std::runtime_error when it is not attached.
    isocoat_link link_of(const btRigidBody *body) const { return entries_[find(body)].link; }

    /// Takes over a new mass, inertia, factor, flag or kind at once. Every tick looks for such changes as well.
    void refresh(const btRigidBody *body) { describe(entries_[find(body)]); }

    /// Forgets the contact history of a body that the host puts elsewhere. Jumps of more than half its thinnest coat,
    /// or half a radian, are found without it.
    void teleport(const btRigidBody *body) { entries_[find(body)].jumped = true; }

    /// One tick, at its end. Bullet calls it when the coupler is an action.
    void updateAction(btCollisionWorld *, btScalar dt) override { step(dt); }

    /// The same for hosts that call it from their own internal tick callback instead.
    void step(btScalar dt) noexcept {
        try {
            tick(dt);
        } catch (const std::exception &error) {
            for (attachment &entry : entries_) {
                entry.forecast.forget();
            }
            report(error.what());
        }
    }

    /// Draws the contacts of the last step: a line along the normal, in proportion to the square root of the area.
    void debugDraw(btIDebugDraw *drawer) override {
        const isocoat_contact *contacts = nullptr;
        std::size_t count = 0;
        if (drawer == nullptr || isocoat_world_get_contacts(world_, &contacts, &count) != ISOCOAT_OK) {
            return;
        }
        for (std::size_t i = 0; i < count; ++i) {
            const btVector3 position = detail::vector_from(contacts[i].position);
            const btVector3 normal = detail::vector_from(contacts[i].normal);
            const btScalar half = btScalar(0.5 * std::sqrt(contacts[i].area));
            drawer->drawLine(position - normal * half, position + normal * half, btVector3(1, btScalar(0.6), 0));
        }
    }

    /// What went wrong last in a tick; empty if nothing did. A failed step leaves the bodies to Bullet alone.
    const std::string &last_error() const { return error_; }
    void clear_error() { error_.clear(); }

    /// Sets who is told about errors in ticks, as they happen. It must not change the coupler.
    void on_error(std::function<void(const std::string &)> callback) { on_error_ = std::move(callback); }

protected:
    /// For couplers that tie links to more than rigid bodies: what they tell isocoat before a step, and what they take
    /// from it afterwards.
    virtual void before_step(btScalar) {}
    virtual void after_step(btScalar) {}
    virtual bool has_link(isocoat_link link) const { return position_of(link) < entries_.size(); }

    isocoat_world *coats() const { return world_; }

    /// Says before a step how links that joints hold together answer pushes, as isocoat_world_set_articulations has it.
    void add_articulation(const std::vector<isocoat_link> &links, const std::vector<double> &inverse_inertia) {
        articulated_.insert(articulated_.end(), links.begin(), links.end());
        link_counts_.push_back(links.size());
        inverse_inertias_.insert(inverse_inertias_.end(), inverse_inertia.begin(), inverse_inertia.end());
    }

    static bool same(isocoat_link a, isocoat_link b) {
        return a.index == b.index && a.generation == b.generation && a.world == b.world;
    }

    void report(const std::string &text) noexcept {
        try {
            error_ = text;
            if (on_error_) {
                on_error_(error_);
            }
        } catch (...) {
            // An exception must not pass through Bullet; the text is kept.
        }
    }

private:
    struct attachment {
        btRigidBody *body = nullptr;
        isocoat_link link{};
        detail::response response;
        /// Rotation at which the link was described.
        btMatrix3x3 basis = btMatrix3x3::getIdentity();
        /// In the dynamics world, with a sound state; the link is enabled.
        bool present = true;
        /// The contact history is to be forgotten.
        bool jumped = true;
        /// Ticks for which it counts as held still, and whether isocoat was told so.
        int held = 0;
        bool constrained = false;
        bool asleep = false;
        /// Ticks that it has slept.
        unsigned slept = 0;
        /// Velocities as isocoat was told.
        detail::motion told;
        /// Accelerations as isocoat was told.
        detail::motion expected;
        /// isocoat was told how the body answers pushes with its joints.
        bool jointed = false;
        detail::forecast forecast;
        /// For how many ticks it counts as touching still.
        int touching = 0;
        /// Sleeping bodies: what gravity and contacts usually add to the velocities in a tick; what came beyond.
        detail::motion usual;
        detail::motion owed;
        /// Kinematic bodies: where it glides to, from where, and since when.
        btTransform pose = btTransform::getIdentity();
        btTransform start = btTransform::getIdentity();
        btScalar gliding = 0;
        /// Coat island: position of another member, and whether one of them cannot sleep yet.
        std::size_t root = 0;
        bool busy = false;
    };

    /// A contact that rattles comes and goes from tick to tick: a body counts as held for some ticks more.
    static constexpr int held_ticks = 6;

    std::size_t find(const btRigidBody *body) const {
        const auto found = of_body_.find(body);
        if (found == of_body_.end()) {
            throw std::runtime_error("isocoat: the body is not attached");
        }
        return found->second;
    }

    void index() {
        of_body_.clear();
        of_link_.clear();
        for (std::size_t i = 0; i < entries_.size(); ++i) {
            of_body_[entries_[i].body] = i;
            of_link_[entries_[i].link.index] = i;
        }
    }

    /// Gives the link what the body is.
    void describe(attachment &entry) {
        isocoat_link_desc desc = isocoat_link_desc_default();
        detail::check(isocoat_link_get_desc(world_, entry.link, &desc), "attach");
        const isocoat_link_desc body = link_desc_from(*entry.body);
        desc.pose = body.pose;
        std::copy(body.linear_velocity, body.linear_velocity + 3, desc.linear_velocity);
        std::copy(body.angular_velocity, body.angular_velocity + 3, desc.angular_velocity);
        const detail::response response = detail::response::of(*entry.body);
        response.describe(entry.body->getWorldTransform().getBasis(), entry.constrained, desc);
        detail::check(isocoat_link_set_desc(world_, entry.link, &desc), "attach");
        entry.response = response;
        entry.basis = entry.body->getWorldTransform().getBasis();
        entry.expected.linear = detail::vector_from(desc.external_acceleration);
        entry.expected.angular = detail::vector_from(desc.external_angular_acceleration);
    }

    void tick(btScalar dt) {
        if (!(dt > 0)) {
            return;
        }
        find_present();
        notice_held();
        gather(dt);
        if (!push_states()) {
            drop_stale_links();
            if (!push_states()) {
                throw std::runtime_error("isocoat: states refused: " + detail::last_error());
            }
        }
        if (rests()) {
            return;
        }
        tell_joints(dt);
        before_step(dt);
        tell_articulations();
        detail::check(isocoat_world_step(world_, double(dt)), "step");
        apply(dt);
        after_step(dt);
        settle(dt);
    }

    /// Which bodies are in the dynamics world. Others may have been deleted and are not looked at.
    void find_present() {
        found_.assign(entries_.size(), 0);
        const btCollisionObjectArray &objects = dynamics_->getCollisionObjectArray();
        for (int i = 0; i < objects.size(); ++i) {
            const auto found = of_body_.find(objects[i]);
            if (found != of_body_.end()) {
                found_[found->second] = 1;
            }
        }
    }

    /// Which bodies constraints or contacts of Bullet's own hold in this tick.
    void notice_held() {
        for (attachment &entry : entries_) {
            entry.held = std::max(entry.held - 1, 0);
        }
        // All constraints of the world: a body lists those only that switch off collisions between their bodies.
        for (int i = 0; i < dynamics_->getNumConstraints(); ++i) {
            btTypedConstraint &constraint = *dynamics_->getConstraint(i);
            if (constraint.isEnabled()) {
                hold(&constraint.getRigidBodyA());
                hold(&constraint.getRigidBodyB());
            }
        }
        btDispatcher &dispatcher = *dynamics_->getDispatcher();
        for (int i = 0; i < dispatcher.getNumManifolds(); ++i) {
            const btPersistentManifold &manifold = *dispatcher.getManifoldByIndexInternal(i);
            if (presses(manifold)) {
                hold(manifold.getBody0());
                hold(manifold.getBody1());
            }
        }
    }

    /// Pairs whose coats touch have no manifold, because their shapes do not collide.
    static bool presses(const btPersistentManifold &manifold) {
        if (!manifold.getBody0()->hasContactResponse() || !manifold.getBody1()->hasContactResponse()) {
            return false;
        }
        for (int i = 0; i < manifold.getNumContacts(); ++i) {
            const btManifoldPoint &point = manifold.getContactPoint(i);
            if (point.getDistance() <= 0 || point.getAppliedImpulse() > 0) {
                return true;
            }
        }
        return false;
    }

    void hold(const btCollisionObject *object) {
        const auto found = of_body_.find(object);
        if (found != of_body_.end()) {
            entries_[found->second].held = held_ticks;
        }
    }

    /// Collects the states of all links that may have moved.
    void gather(btScalar dt) {
        links_.clear();
        states_.clear();
        movers_.clear();
        for (std::size_t i = 0; i < entries_.size(); ++i) {
            attachment &entry = entries_[i];
            isocoat_link_state state{};
            const bool present = found_[i] != 0 && state_of(entry, dt, state);
            if (present != entry.present) {
                if (isocoat_link_set_enabled(world_, entry.link, present) == ISOCOAT_OK) {
                    entry.present = present;
                    entry.jumped = true;
                }
            }
            if (!present) {
                continue;
            }
            if (entry.jumped || entry.asleep) {
                // A link that is gone shows in push_states.
                (void)(isocoat_link_teleport(world_, entry.link, &state) == ISOCOAT_OK);
                entry.touching = entry.jumped ? 0 : entry.touching;
                entry.forecast.forget();
                entry.jumped = false;
            }
            links_.push_back(entry.link);
            states_.push_back(state);
            movers_.push_back(i);
        }
    }

    /// The state of a body's link at the end of this tick, and what the link is told apart from it; false when the body
    /// has no sound state.
    bool state_of(attachment &entry, btScalar dt, isocoat_link_state &state) {
        const btRigidBody &body = *entry.body;
        const detail::response now = detail::response::of(body);
        // The matrix of a body that is held in some direction turns with it.
        const bool turned = now.is_dynamic() && !now.is_free() && !(body.getWorldTransform().getBasis() == entry.basis);
        const bool constrained = entry.held > 0 && now.is_dynamic();
        const bool changed = constrained != entry.constrained;
        entry.constrained = constrained;
        if (turned || !(now == entry.response) || (changed && !now.is_free())) {
            describe_again(entry, now);
        } else if (changed) {
            // A link that is gone shows in push_states.
            (void)(isocoat_link_set_constrained(world_, entry.link, constrained) == ISOCOAT_OK);
        }
        btTransform pose = body.getWorldTransform();
        entry.told = detail::motion{body.getLinearVelocity(), body.getAngularVelocity()};
        const bool slept = entry.asleep;
        entry.asleep = now.is_dynamic() && !body.isActive();
        entry.slept = entry.asleep ? entry.slept + 1 : 0;
        if (now.fixed) {
            entry.told = detail::motion();
        } else if (now.kinematic) {
            glide(entry, dt, pose);
        } else {
            expect(entry, slept);
            if (entry.asleep) {
                // At rest in the middle of the tick: isocoat adds half a tick's gravity to a leapfrog velocity.
                const btScalar ahead = entry.jointed ? btScalar(0) : btScalar(-0.5) * dt;
                entry.told = detail::motion{entry.expected.linear * ahead, btVector3(0, 0, 0)};
            }
        }
        state.pose = detail::pose_from(pose);
        detail::copy(entry.told.linear, state.linear_velocity);
        detail::copy(entry.told.angular, state.angular_velocity);
        if (!detail::is_finite(state)) {
            report("isocoat: a body's pose or velocity is not finite; its coat is disabled");
            return false;
        }
        return true;
    }

    void describe_again(attachment &entry, const detail::response &now) {
        isocoat_link_desc desc = isocoat_link_desc_default();
        if (isocoat_link_get_desc(world_, entry.link, &desc) != ISOCOAT_OK) {
            return;
        }
        now.describe(entry.body->getWorldTransform().getBasis(), entry.constrained, desc);
        if (isocoat_link_set_desc(world_, entry.link, &desc) == ISOCOAT_OK) {
            entry.response = now;
            entry.basis = entry.body->getWorldTransform().getBasis();
        } else {
            report("isocoat: a body's new mass or inertia is refused: " + detail::last_error());
        }
    }

    /// Tells the link what its body will add by itself in the next tick: what acts on it now. That is exact within a
    /// frame of several ticks, and for lasting forces; the first and the last tick of a force are taken up afterwards.
    void expect(attachment &entry, bool slept) {
        const btRigidBody &body = *entry.body;
        const bool no_force = body.getTotalForce().isZero();
        detail::motion expected;
        if (entry.asleep || (slept && no_force)) {
            // Gravity is not among the forces of a sleeping body.
            expected.linear = body.getGravity() * body.getLinearFactor();
        } else {
            expected = detail::acceleration_of(body);
        }
        if (expected.linear == entry.expected.linear && expected.angular == entry.expected.angular) {
            return;
        }
        if (entry.jointed || tell_acceleration(entry, detail::six(expected))) {
            entry.expected = expected;
        }
    }

    bool tell_acceleration(const attachment &entry, const detail::vector6 &acceleration) {
        return isocoat_link_set_external_acceleration(world_, entry.link, acceleration.data(),
                                                      acceleration.data() + 3) == ISOCOAT_OK;
    }

    /// Tells isocoat how bodies on joints that touch answer pushes, and what the joints let them do by themselves. What
    /// bodies that sleep do was told before.
    void tell_joints(btScalar dt) {
        articulated_.clear();
        link_counts_.clear();
        inverse_inertias_.clear();
        joints_.find(*dynamics_);
        for (const std::size_t i : movers_) {
            const attachment &entry = entries_[i];
            if (detail::joints::member *one = joints_.of(entry.body)) {
                one->external = detail::six(entry.expected);
                one->touching = entry.touching > 0;
            }
        }
        joints_.solve(*dynamics_, dt);
        for (const std::size_t i : movers_) {
            attachment &entry = entries_[i];
            const detail::joints::member *one = joints_.of(entry.body);
            entry.forecast.arrive(detail::six(entry.told), dt);
            const bool jointed = one != nullptr && one->solved;
            if (jointed && !entry.asleep) {
                (void)tell_acceleration(entry, entry.forecast.of(one->acceleration, entry.jointed));
            } else if (!jointed && entry.jointed) {
                (void)tell_acceleration(entry, detail::six(entry.expected));
            }
            entry.jointed = jointed;
        }
        for (const detail::joints::articulation &one : joints_.articulations()) {
            std::vector<isocoat_link> links;
            for (const std::size_t member : one.members) {
                links.push_back(entries_[find(joints_.members()[member].body)].link);
            }
            add_articulation(links, one.inverse_inertia);
        }
    }

    void tell_articulations() {
        if (isocoat_world_set_articulations(world_, articulated_.data(), link_counts_.data(), inverse_inertias_.data(),
                                            link_counts_.size()) != ISOCOAT_OK) {
            report("isocoat: how bodies on joints answer pushes is refused: " + detail::last_error());
            // What was said in the last tick is no longer so.
            (void)(isocoat_world_set_articulations(world_, nullptr, nullptr, nullptr, 0) == ISOCOAT_OK);
        }
    }

    /// Bullet puts a kinematic body at the pose of the frame's end in the frame's first tick, with the velocity that
    /// takes it there over the frame. Its coat follows tick by tick.
    static void glide(attachment &entry, btScalar dt, btTransform &pose) {
        const btRigidBody &body = *entry.body;
        if (!body.isActive()) {
            entry.told = detail::motion();
        }
        if (entry.jumped) {
            entry.start = entry.pose = pose;
            entry.told = detail::motion();
            return;
        }
        if (!(pose == entry.pose)) {
            entry.start = entry.pose;
            entry.pose = pose;
            entry.gliding = 0;
        }
        entry.gliding += dt;
        btVector3 turn, way;
        btTransformUtil::calculateVelocity(entry.start, pose, btScalar(1), way, turn);
        const btScalar speed2 = entry.told.linear.length2() + entry.told.angular.length2();
        const btScalar passed2 = speed2 * entry.gliding * entry.gliding;
        if (passed2 < btScalar(0.998) * (way.length2() + turn.length2()) && speed2 > 0) {
            btTransformUtil::integrateTransform(entry.start, entry.told.linear, entry.told.angular, entry.gliding,
                                                pose);
        }
    }

    bool push_states() {
        const isocoat_status status =
            isocoat_world_set_link_states(world_, links_.data(), states_.data(), links_.size());
        if (status != ISOCOAT_OK && status != ISOCOAT_ERROR_INVALID_HANDLE) {
            throw std::runtime_error("isocoat: states refused: " + detail::last_error());
        }
        return status == ISOCOAT_OK;
    }

    /// Links that were destroyed are detached, and left out of this tick.
    void drop_stale_links() {
        std::vector<attachment> live;
        std::vector<std::size_t> now(entries_.size(), entries_.size());
        for (std::size_t i = 0; i < entries_.size(); ++i) {
            isocoat_link_state state;
            if (isocoat_link_get_state(world_, entries_[i].link, &state) != ISOCOAT_ERROR_INVALID_HANDLE) {
                now[i] = live.size();
                live.push_back(entries_[i]);
            }
        }
        std::size_t kept = 0;
        for (std::size_t i = 0; i < movers_.size(); ++i) {
            if (now[movers_[i]] < entries_.size()) {
                links_[kept] = links_[i];
                states_[kept] = states_[i];
                movers_[kept] = now[movers_[i]];
                ++kept;
            }
        }
        links_.resize(kept);
        states_.resize(kept);
        movers_.resize(kept);
        entries_ = std::move(live);
        index();
    }

    /// Whether the step can be left out because it would repeat the last one: the isocoat world holds nothing but
    /// attached links, all of them asleep or standing where they stood. One tick in 64 is stepped nevertheless, to
    /// notice what the host changes in the isocoat world.
    bool rests() {
        isocoat_counters counters = isocoat_counters_default();
        bool at_rest = isocoat_world_get_counters(world_, &counters) == ISOCOAT_OK &&
                       counters.links == entries_.size() && links_.size() == rested_.size();
        for (std::size_t i = 0; at_rest && i < movers_.size(); ++i) {
            const attachment &entry = entries_[movers_[i]];
            at_rest = (entry.slept > 1 || !entry.response.is_dynamic()) && same(links_[i], rested_[i].first) &&
                      std::memcmp(&states_[i], &rested_[i].second, sizeof(isocoat_link_state)) == 0;
        }
        resting_ = at_rest ? resting_ + 1 : 0;
        if (!at_rest) {
            rested_.clear();
            for (std::size_t i = 0; i < links_.size(); ++i) {
                rested_.emplace_back(links_[i], states_[i]);
            }
        }
        return resting_ % 64 != 0;
    }

    void apply(btScalar dt) {
        impulses_.resize(6 * links_.size());
        const isocoat_buffer linear{impulses_.data(), 6 * sizeof(double), ISOCOAT_FORMAT_F64};
        const isocoat_buffer angular{impulses_.data() + 3, 6 * sizeof(double), ISOCOAT_FORMAT_F64};
        if (links_.empty()) {
            return;
        }
        detail::check(isocoat_world_get_link_impulses(world_, links_.data(), links_.size(), linear, angular),
                      "impulses");
        for (std::size_t i = 0; i < movers_.size(); ++i) {
            attachment &entry = entries_[movers_[i]];
            if (!entry.response.is_dynamic()) {
                continue;
            }
            const double *numbers = impulses_.data() + 6 * i;
            const detail::motion impulse{detail::vector_from(numbers), detail::vector_from(numbers + 3)};
            if (!entry.asleep) {
                const bool touches = std::any_of(numbers, numbers + 6, [](double x) { return x != 0.0; });
                entry.touching = touches ? held_ticks : std::max(entry.touching - 1, 0);
            }
            if (!entry.asleep || stirs(entry, dt)) {
                push(entry, impulse);
                if (detail::joints::member *one = joints_.of(entry.body)) {
                    one->impulse = detail::six(impulse);
                }
            }
        }
        joints_.pass_on(*dynamics_, dt);
        for (const std::size_t i : movers_) {
            const btRigidBody &body = *entries_[i].body;
            const detail::motion now{body.getLinearVelocity(), body.getAngularVelocity()};
            entries_[i].forecast.leave(detail::six(now));
        }
    }

    /// Whether a sleeping body is to wake, and if so, wakes it. While nothing around it moves, contacts push a sleeping
    /// body alike in every tick. What they push beyond that adds up, and fades within some ten ticks if it stays small;
    /// beyond a hundredth of the body's sleeping threshold the body wakes, with all of it.
    bool stirs(attachment &entry, btScalar dt) const {
        btRigidBody &body = *entry.body;
        isocoat_wrench wrench;
        if (isocoat_link_get_wrench(world_, entry.link, &wrench) != ISOCOAT_OK) {
            return false;
        }
        const detail::motion push = entry.response.answer(
            body.getWorldTransform().getBasis(),
            detail::motion{detail::vector_from(wrench.force) * dt, detail::vector_from(wrench.torque) * dt});
        const detail::motion urge{push.linear + entry.expected.linear * dt, push.angular + entry.expected.angular * dt};
        btScalar part = btScalar(0.01);
        if (entry.slept == 1) {
            entry.usual = detail::motion();
            entry.owed = detail::motion();
            part = 1;
        }
        const detail::motion owed{entry.owed.linear + urge.linear - entry.usual.linear,
                                  entry.owed.angular + urge.angular - entry.usual.angular};
        if (owed.linear.length() <= part * body.getLinearSleepingThreshold() &&
            owed.angular.length() <= part * body.getAngularSleepingThreshold()) {
            if (entry.slept == 1) {
                entry.usual = urge;
            } else {
                entry.owed = detail::motion{owed.linear * btScalar(0.9), owed.angular * btScalar(0.9)};
            }
            return false;
        }
        body.activate(true);
        if (!body.isActive()) {
            return false;  // the host has disabled its simulation
        }
        // As if it had been awake when the frame began.
        if (body.getTotalForce().isZero()) {
            body.applyGravity();
        }
        body.setLinearVelocity(entry.told.linear + entry.owed.linear);
        body.setAngularVelocity(entry.told.angular + entry.owed.angular);
        return true;
    }

    /// Puts an impulse on a body. Bodies without one stay as they are, bit by bit.
    static void push(const attachment &entry, const detail::motion &impulse) {
        btRigidBody &body = *entry.body;
        if (!impulse.linear.isZero()) {
            body.applyCentralImpulse(impulse.linear);
        }
        if (impulse.angular.isZero()) {
            return;
        }
        if (entry.response.is_free()) {
            body.applyTorqueImpulse(impulse.angular);
        } else {
            const detail::motion change = entry.response.answer(body.getWorldTransform().getBasis(), impulse);
            body.setAngularVelocity(body.getAngularVelocity() + change.angular);
        }
    }

    /// Bodies that touch through their coats fall asleep together or not at all: those that could sleep already wait
    /// for the others.
    void settle(btScalar dt) {
        if (gDisableDeactivation || !(gDeactivationTime > 0)) {
            return;
        }
        const isocoat_contact *contacts = nullptr;
        std::size_t count = 0;
        detail::check(isocoat_world_get_contacts(world_, &contacts, &count), "contacts");
        for (std::size_t i = 0; i < entries_.size(); ++i) {
            entries_[i].root = i;
            entries_[i].busy = false;
        }
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t a = position_of(contacts[i].link_a);
            const std::size_t b = position_of(contacts[i].link_b);
            if (is_mover(a) && is_mover(b)) {
                const std::size_t low = std::min(root_of(a), root_of(b));
                const std::size_t high = std::max(root_of(a), root_of(b));
                entries_[high].root = low;
            } else if (is_mover(a)) {
                entries_[a].busy |= moves(contacts[i].link_b);
            } else if (is_mover(b)) {
                entries_[b].busy |= moves(contacts[i].link_a);
            }
        }
        const btScalar ready = gDeactivationTime - btScalar(1.5) * dt;
        for (const std::size_t i : movers_) {
            const attachment &entry = entries_[i];
            const int state = is_mover(i) ? entry.body->getActivationState() : ISLAND_SLEEPING;
            const bool drowsy =
                state == ISLAND_SLEEPING || state == WANTS_DEACTIVATION || state == DISABLE_SIMULATION ||
                (state == ACTIVE_TAG && entry.body->getDeactivationTime() > ready);
            if (entry.busy || !drowsy) {
                entries_[root_of(i)].busy = true;
            }
        }
        for (const std::size_t i : movers_) {
            const btRigidBody &body = *entries_[i].body;
            const int state = body.getActivationState();
            if (!is_mover(i) || !entries_[root_of(i)].busy || (state != ACTIVE_TAG && state != WANTS_DEACTIVATION)) {
                continue;
            }
            body.setActivationState(ACTIVE_TAG);
            entries_[i].body->setDeactivationTime(
                std::min(body.getDeactivationTime(), gDeactivationTime - btScalar(2) * dt));
        }
    }

    std::size_t position_of(isocoat_link link) const {
        const auto found = of_link_.find(link.index);
        return found != of_link_.end() && same(entries_[found->second].link, link) ? found->second : entries_.size();
    }

    bool is_mover(std::size_t position) const {
        return position < entries_.size() && entries_[position].present && entries_[position].response.is_dynamic();
    }

    std::size_t root_of(std::size_t position) const {
        while (entries_[position].root != position) {
            position = entries_[position].root;
        }
        return position;
    }

    /// Whether a link that no dynamic body moves is moving.
    bool moves(isocoat_link link) const {
        isocoat_link_state state;
        if (isocoat_link_get_state(world_, link, &state) != ISOCOAT_OK) {
            return false;
        }
        return detail::vector_from(state.linear_velocity).length2() +
                   detail::vector_from(state.angular_velocity).length2() >
               btScalar(1e-6);
    }

    isocoat_world *world_;
    btDiscreteDynamicsWorld *dynamics_;
    /// In the order of their attachment.
    std::vector<attachment> entries_;
    std::unordered_map<const btCollisionObject *, std::size_t> of_body_;
    std::unordered_map<std::uint32_t, std::size_t> of_link_;
    std::vector<char> found_;
    /// What goes to isocoat and comes back in a tick, and the positions of its entries.
    std::vector<isocoat_link> links_;
    std::vector<isocoat_link_state> states_;
    std::vector<std::size_t> movers_;
    std::vector<double> impulses_;
    detail::joints joints_;
    /// All articulations, one after the other.
    std::vector<isocoat_link> articulated_;
    std::vector<std::size_t> link_counts_;
    std::vector<double> inverse_inertias_;
    /// Links and states of the last tick, and for how many ticks they have been so.
    std::vector<std::pair<isocoat_link, isocoat_link_state>> rested_;
    unsigned resting_ = 0;
    std::string error_;
    std::function<void(const std::string &)> on_error_;
};

}  // namespace bullet
}  // namespace isocoat

#endif
