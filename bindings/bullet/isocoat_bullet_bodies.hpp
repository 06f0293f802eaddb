// isocoat for Bullet: what its rigid bodies and shapes are to isocoat. Descriptors of links and skeletons, and how a
// body answers pushes; isocoat_bullet.hpp brings it, and says how all of it is used.
//
// SPDX-License-Identifier: MIT OR Apache-2.0
#ifndef ISOCOAT_BULLET_BODIES_HPP
#define ISOCOAT_BULLET_BODIES_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include <isocoat/isocoat.h>

namespace isocoat {
namespace bullet {

/// Collision group of add_coated_body: the first bit that Bullet's own groups leave free.
constexpr int coated_group = 64;

namespace detail {

/// Linear and angular part.
struct motion {
    btVector3 linear{0, 0, 0};
    btVector3 angular{0, 0, 0};
};

/// What the forces on a body do to it by themselves.
inline motion acceleration_of(const btRigidBody &body) {
    return {body.getTotalForce() * body.getInvMass(), body.getInvInertiaTensorWorld() * body.getTotalTorque()};
}

inline std::string last_error() {
    std::string text(isocoat_last_error(nullptr, 0) + 1, '\0');
    text.resize(std::min(isocoat_last_error(text.data(), text.size()), text.size() - 1));
    return text;
}

inline void check(isocoat_status status, const char *what) {
    if (status != ISOCOAT_OK) {
        throw std::runtime_error(std::string("isocoat: ") + what + ": " + last_error());
    }
}

inline void copy(const btVector3 &from, double (&to)[3]) {
    to[0] = double(from.x());
    to[1] = double(from.y());
    to[2] = double(from.z());
}

inline btVector3 vector_from(const double *from) {
    return btVector3(btScalar(from[0]), btScalar(from[1]), btScalar(from[2]));
}

inline isocoat_pose pose_from(const btTransform &transform) {
    isocoat_pose pose;
    copy(transform.getOrigin(), pose.position);
    const btQuaternion rotation = transform.getRotation();
    const double q[4] = {double(rotation.x()), double(rotation.y()), double(rotation.z()), double(rotation.w())};
    const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int i = 0; i < 4; ++i) {
        pose.orientation[i] = q[i] / norm;
    }
    return pose;
}

inline bool is_finite(const isocoat_link_state &state) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
        sum += state.pose.position[i] + state.linear_velocity[i] + state.angular_velocity[i];
    }
    for (const double x : state.pose.orientation) {
        sum += x;
    }
    return std::isfinite(sum);
}

/// How a body answers impulses: changes of it need a new link descriptor.
struct response {
    bool fixed = true;
    bool kinematic = false;
    btScalar inverse_mass = 0;
    btVector3 inverse_inertia{0, 0, 0};
    btVector3 linear_factor{1, 1, 1};
    btVector3 angular_factor{1, 1, 1};
    bool gyroscopic = false;

    static response of(const btRigidBody &body) {
        constexpr int gyroscopic_flags = BT_ENABLE_GYROSCOPIC_FORCE_EXPLICIT |
                                         BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_WORLD |
                                         BT_ENABLE_GYROSCOPIC_FORCE_IMPLICIT_BODY;
        response out;
        out.kinematic = body.isKinematicObject();
        out.fixed = !out.kinematic && (body.isStaticObject() || body.getInvMass() == 0);
        out.inverse_mass = body.getInvMass();
        out.inverse_inertia = body.getInvInertiaDiagLocal();
        out.linear_factor = body.getLinearFactor();
        out.angular_factor = body.getAngularFactor();
        out.gyroscopic = (body.getFlags() & gyroscopic_flags) != 0;
        return out;
    }

    bool operator==(const response &other) const {
        return fixed == other.fixed && kinematic == other.kinematic && inverse_mass == other.inverse_mass &&
               inverse_inertia == other.inverse_inertia && linear_factor == other.linear_factor &&
               angular_factor == other.angular_factor && gyroscopic == other.gyroscopic;
    }

    bool is_dynamic() const { return !fixed && !kinematic; }

    /// It moves and turns freely, as a solid of its mass and inertia does.
    bool is_free() const {
        return linear_factor == btVector3(1, 1, 1) && angular_factor == btVector3(1, 1, 1) && has_inertia();
    }

    /// Its moments of inertia are those of a solid.
    bool has_inertia() const {
        const btVector3 &inverse = inverse_inertia;
        if (!(inverse.x() > 0 && inverse.y() > 0 && inverse.z() > 0)) {
            return false;
        }
        double moments[3] = {1.0 / double(inverse.x()), 1.0 / double(inverse.y()), 1.0 / double(inverse.z())};
        std::sort(moments, moments + 3);
        return moments[2] <= (moments[0] + moments[1]) * (1.0 + 5e-7);
    }

    /// From torque to angular acceleration, in the world. Made symmetric where angular factors are not 0 or 1.
    std::array<double, 9> inverse_inertia_at(const btMatrix3x3 &rotation) const {
        std::array<double, 9> out{};
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) {
                double sum = 0.0;
                for (int axis = 0; axis < 3; ++axis) {
                    sum += double(rotation[i][axis]) * double(inverse_inertia[axis]) * double(rotation[j][axis]);
                }
                out[std::size_t(3 * i + j)] =
                    sum * std::sqrt(std::max(0.0, double(angular_factor[i]) * double(angular_factor[j])));
            }
        }
        return out;
    }

    /// What is `held` by more than its factors is described without them: no matrix says the whole of it, and isocoat
    /// estimates what holds links that have none.
    void describe(const btMatrix3x3 &rotation, bool held, isocoat_link_desc &desc) const {
        desc.kind = fixed ? ISOCOAT_LINK_FIXED : ISOCOAT_LINK_HOST;
        desc.mass = is_dynamic() ? 1.0 / double(inverse_mass) : 0.0;
        std::fill(desc.local_center_of_mass, desc.local_center_of_mass + 3, 0.0);
        std::fill(desc.inertia, desc.inertia + 9, 0.0);
        desc.gravity_scale = 0.0;
        desc.velocity_convention = ISOCOAT_VELOCITY_LEAPFROG;
        desc.flags = (gyroscopic ? ISOCOAT_LINK_HOST_GYROSCOPIC : 0) | (held ? ISOCOAT_LINK_CONSTRAINED : 0);
        if (!is_dynamic()) {
            return;
        }
        if (is_free() || (held && has_inertia())) {
            for (int axis = 0; axis < 3; ++axis) {
                desc.inertia[4 * axis] = 1.0 / double(inverse_inertia[axis]);
            }
            return;
        }
        // Held in some direction: the matrix says it; a millionth of freedom keeps it positive definite.
        desc.inertia[0] = desc.inertia[4] = desc.inertia[8] = desc.mass;
        desc.flags |= ISOCOAT_LINK_HAS_INVERSE_EFFECTIVE_INERTIA;
        double(&matrix)[36] = desc.inverse_effective_inertia;
        std::fill(matrix, matrix + 36, 0.0);
        const std::array<double, 9> turning = inverse_inertia_at(rotation);
        const double little = 1e-6 * (turning[0] + turning[4] + turning[8] + 1e-3 / desc.mass);
        for (int i = 0; i < 3; ++i) {
            matrix[7 * i] = std::max(double(linear_factor[i]), 1e-6) / desc.mass;
            for (int j = 0; j < 3; ++j) {
                matrix[6 * (3 + i) + 3 + j] = turning[std::size_t(3 * i + j)] + (i == j ? little : 0.0);
            }
        }
    }

    /// Change of velocity of a body at this rotation by an impulse.
    motion answer(const btMatrix3x3 &rotation, const motion &impulse) const {
        const std::array<double, 9> turning = inverse_inertia_at(rotation);
        motion out;
        out.linear = impulse.linear * linear_factor * inverse_mass;
        for (int i = 0; i < 3; ++i) {
            double sum = 0.0;
            for (int j = 0; j < 3; ++j) {
                sum += turning[std::size_t(3 * i + j)] * double(impulse.angular[j]);
            }
            out.angular[i] = btScalar(sum);
        }
        return out;
    }
};

/// The name in a linker's message when the code was compiled for the other precision (BT_USE_DOUBLE_PRECISION) than
/// the Bullet library that it is linked with: the function exists in both, with other argument types.
struct bullet_library_must_have_the_precision_of_the_compiled_code {
    using function = void (btRigidBody::*)(btScalar, btScalar);
    static function reference() {
        static volatile function symbol = &btRigidBody::setDamping;
        return symbol;
    }
};

}  // namespace detail

/// A link descriptor for a body: kind, pose, velocities, mass and inertia. attach() sets the same on any link.
inline isocoat_link_desc link_desc_from(const btRigidBody &body) {
    isocoat_link_desc desc = isocoat_link_desc_default();
    desc.pose = detail::pose_from(body.getWorldTransform());
    detail::copy(body.getLinearVelocity(), desc.linear_velocity);
    detail::copy(body.getAngularVelocity(), desc.angular_velocity);
    detail::response::of(body).describe(body.getWorldTransform().getBasis(), false, desc);
    return desc;
}

/// Skeletons whose coats have the surface of a shape; thickness and points are set, the rest is default.
///
/// - shape: sphere (a point), capsule (a segment), box (a box smaller by the coat: edges become round), static plane,
///   and compounds of these. Bullet's margins are part of these shapes' sizes: the coat's surface is where Bullet shows
///   the shape, and for spheres and capsules the coat is as thick as the radius.
/// - coat: thickness on boxes and planes, in m, less than the smallest half extent.
/// - frame: pose of the shape in the body's frame.
///
/// Throws std::runtime_error for other shapes, and for boxes that are too small.
inline std::vector<isocoat_skeleton_desc> skeletons_from(const btCollisionShape &shape, double coat,
                                                         const btTransform &frame = btTransform::getIdentity()) {
    isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
    switch (shape.getShapeType()) {
    case SPHERE_SHAPE_PROXYTYPE:
        desc.shape = ISOCOAT_SHAPE_POINT;
        detail::copy(frame.getOrigin(), desc.points[0]);
        desc.thickness = double(static_cast<const btSphereShape &>(shape).getRadius());
        return {desc};
    case CAPSULE_SHAPE_PROXYTYPE: {
        const auto &capsule = static_cast<const btCapsuleShape &>(shape);
        btVector3 half(0, 0, 0);
        half[capsule.getUpAxis()] = capsule.getHalfHeight();
        desc.shape = ISOCOAT_SHAPE_SEGMENT;
        detail::copy(frame * half, desc.points[0]);
        detail::copy(frame * -half, desc.points[1]);
        desc.thickness = double(capsule.getRadius());
        return {desc};
    }
    case BOX_SHAPE_PROXYTYPE: {
        const btVector3 half = static_cast<const btBoxShape &>(shape).getHalfExtentsWithMargin();
        const btQuaternion rotation = frame.getRotation();
        desc.shape = ISOCOAT_SHAPE_BOX;
        detail::copy(frame.getOrigin(), desc.points[0]);
        for (int axis = 0; axis < 3; ++axis) {
            desc.points[1][axis] = double(half[axis]) - coat;
            if (desc.points[1][axis] <= 0.0) {
                throw std::runtime_error("isocoat: the coat is thicker than the box's smallest half extent");
            }
        }
        detail::copy(rotation.getAxis() * rotation.getAngle(), desc.points[2]);
        desc.thickness = coat;
        return {desc};
    }
    case STATIC_PLANE_PROXYTYPE: {
        const auto &plane = static_cast<const btStaticPlaneShape &>(shape);
        const btVector3 normal = plane.getPlaneNormal().normalized();
        desc.shape = ISOCOAT_SHAPE_PLANE;
        detail::copy(frame * (normal * (plane.getPlaneConstant() - btScalar(coat))), desc.points[0]);
        detail::copy(frame.getBasis() * normal, desc.points[1]);
        desc.thickness = coat;
        return {desc};
    }
    case COMPOUND_SHAPE_PROXYTYPE: {
        const auto &compound = static_cast<const btCompoundShape &>(shape);
        std::vector<isocoat_skeleton_desc> all;
        for (int i = 0; i < compound.getNumChildShapes(); ++i) {
            const std::vector<isocoat_skeleton_desc> part =
                skeletons_from(*compound.getChildShape(i), coat, frame * compound.getChildTransform(i));
            all.insert(all.end(), part.begin(), part.end());
        }
        return all;
    }
    default:
        throw std::runtime_error(std::string("isocoat: no skeletons for a shape of type ") + shape.getName());
    }
}

/// Adds a body to the dynamics world in a collision group of its own, whose members do not collide with each other by
/// their shapes; with everything else they do. For worlds in which all coats touch each other.
inline void add_coated_body(btDiscreteDynamicsWorld &dynamics, btRigidBody *body) {
    const bool plain_static = body->isStaticOrKinematicObject();
    const int no_need = plain_static ? int(btBroadphaseProxy::StaticFilter) : 0;
    dynamics.addRigidBody(body, coated_group, int(btBroadphaseProxy::AllFilter) & ~(coated_group | no_need));
}

/// Lets the shapes of two bodies pass through each other, or collide again: for pairs whose coats touch. Bullet keeps a
/// list of such bodies in each body: for many pairs, add_coated_body is faster. To be called while the two are apart.
inline void ignore_core(btRigidBody &a, btRigidBody &b, bool ignore = true) {
    a.setIgnoreCollisionCheck(&b, ignore);
    b.setIgnoreCollisionCheck(&a, ignore);
}

/// Switches on Bullet's continuous collision detection of a body's shape against the plain world. Coats need none:
/// isocoat sub-steps fast contacts itself.
///
/// - radius: of a sphere inside the shape, in m; the body is swept when it moves by more than that in a tick.
inline void enable_ccd(btRigidBody &body, btScalar radius) {
    body.setCcdMotionThreshold(radius);
    body.setCcdSweptSphereRadius(radius);
}

}  // namespace bullet
}  // namespace isocoat

#endif
