// isocoat for Bullet: how rigid bodies that constraints join answer pushes. isocoat_bullet.hpp brings it, and says how
// all of it is used.
//
// SPDX-License-Identifier: MIT OR Apache-2.0
//
// The rows of all enabled constraints of an island, J u = r - C l with impulses l, are those that Bullet's solver is
// about to get: the constraints are asked for them at the poses in which the tick begins. With the inverse masses W,
// and S = J W J^T + C, pushes on the bodies change their velocities by A = W - W J^T S^-1 J W. isocoat gets A of those
// bodies that touch as an articulation.
//
// What contacts push is passed on to the whole island by the same rows, so that its bodies' velocities still keep to
// them. Bullet's solver alone would stop short of that: a light body between heavy ones takes more iterations than any
// host gives, and would fly off with a push that was meant for all of them.
//
// Rows with bounds or that give way are left to Bullet: limits, motors, brakes. Which of them are at work, and how
// hard, is seen only when its solver has run, and a limit that seems to hold for a tick too long throws the body off.
// Left to it are also constraints that may break or are asked for their impulses, which must show all that they carry.
// What these do to a body is estimated.
#ifndef ISOCOAT_BULLET_JOINTS_HPP
#define ISOCOAT_BULLET_JOINTS_HPP

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <unordered_map>
#include <vector>

#include <btBulletDynamicsCommon.h>

#include "isocoat_bullet_bodies.hpp"

namespace isocoat {
namespace bullet {
namespace detail {

using vector6 = std::array<double, 6>;
using matrix6 = std::array<double, 36>;

inline double dot(const vector6 &a, const vector6 &b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < 6; ++i) {
        sum += a[i] * b[i];
    }
    return sum;
}

inline vector6 product(const matrix6 &m, const vector6 &v) {
    vector6 out{};
    for (std::size_t i = 0; i < 6; ++i) {
        for (std::size_t j = 0; j < 6; ++j) {
            out[i] += m[6 * i + j] * v[j];
        }
    }
    return out;
}

inline vector6 six(const motion &of) {
    return {double(of.linear.x()),  double(of.linear.y()),  double(of.linear.z()),
            double(of.angular.x()), double(of.angular.y()), double(of.angular.z())};
}

/// From wrench to acceleration of a body by itself.
inline matrix6 lone_mobility(const btRigidBody &body) {
    matrix6 out{};
    const std::array<double, 9> turning =
        response::of(body).inverse_inertia_at(body.getWorldTransform().getBasis());
    for (std::size_t i = 0; i < 3; ++i) {
        out[7 * i] = double(body.getInvMass()) * double(body.getLinearFactor()[int(i)]);
        for (std::size_t j = 0; j < 3; ++j) {
            out[6 * (3 + i) + 3 + j] = turning[3 * i + j];
        }
    }
    return out;
}

/// What of a body's mobility joints leave it at least, on the diagonal: of the mass and inertia that it has or would
/// have.
inline vector6 least_mobility(const btRigidBody &body, double part) {
    const btVector3 &turning = body.getInvInertiaDiagLocal();
    const double linear = part * double(body.getInvMass());
    const double most = double(std::max(turning.x(), std::max(turning.y(), turning.z())));
    const double angular = most > 0.0 ? part * most : linear;
    return {linear, linear, linear, angular, angular, angular};
}

/// What a body on joints is going to do without pushes: what the rows say, and what has been missing in them. Bullet
/// solves joints in a few iterations, and limits or contacts of its own may hold the body as well. What was off for one
/// tick only was a push of the host's.
class forecast {
public:
    /// The last tick says nothing of the next.
    void forget() { follows_ = 0; }

    /// The velocities with which the body comes out of a tick.
    void arrive(const vector6 &velocity, btScalar dt) {
        before_ = was_;
        for (std::size_t i = 0; i < 6; ++i) {
            was_[i] = (velocity[i] - left_[i]) / double(dt);
        }
    }

    /// Its acceleration in the next tick; `known` if the last one was foreseen as well.
    const vector6 &of(const vector6 &rows, bool known) {
        for (std::size_t i = 0; i < 6; ++i) {
            const double off = was_[i] - (known ? acceleration_[i] : rows[i]);
            const double before = known ? off_[i] : before_[i] - rows[i];
            const bool lasts = follows_ > 1 && off * before > 0.0;
            const double lasting = lasts ? std::copysign(std::min(std::abs(off), std::abs(before)), off) : 0.0;
            missing_[i] = known ? missing_[i] + learned * lasting : lasting;
            off_[i] = off;
            acceleration_[i] = rows[i] + missing_[i];
        }
        return acceleration_;
    }

    /// The velocities with which it goes into the next tick.
    void leave(const vector6 &velocity) {
        left_ = velocity;
        ++follows_;
    }

private:
    /// Part of what was missing that goes into the estimate of it: stable while a body answers a push at least that
    /// part as readily as isocoat is told.
    static constexpr double learned = 0.3;

    vector6 left_{};
    /// For how many ticks it is known with what it left.
    unsigned follows_ = 0;
    /// What it did by itself in the last tick, and in the one before that.
    vector6 was_{}, before_{};
    vector6 acceleration_{}, missing_{}, off_{};
};

/// Dynamic bodies on constraints, island by island.
class joints {
public:
    /// What moves a body in the coming tick, apart from constraints.
    struct member {
        btRigidBody *body = nullptr;
        /// As an acceleration.
        vector6 external{};
        /// Contacts act on it.
        bool touching = false;
        /// Their impulse in this tick.
        vector6 impulse{};
        /// What comes out for those that touch, if their island could be solved: its acceleration without any push.
        bool solved = false;
        vector6 acceleration{};

        std::size_t island = 0;
        /// Velocity at the end of the tick without constraints.
        vector6 free{};
        matrix6 lone{};
    };

    /// Bodies that constraints join and that touch, and how pushes on any of them move all.
    struct articulation {
        std::vector<std::size_t> members;
        /// Row by row, six rows and columns a member.
        std::vector<double> inverse_inertia;
    };

    /// Finds the bodies that enabled constraints join.
    void find(btDiscreteDynamicsWorld &dynamics) {
        members_.clear();
        of_body_.clear();
        constraints_.clear();
        for (int i = 0; i < dynamics.getNumConstraints(); ++i) {
            btTypedConstraint *constraint = dynamics.getConstraint(i);
            if (constraint->isEnabled() && takes_part(constraint->getRigidBodyA()) &&
                takes_part(constraint->getRigidBodyB())) {
                const std::size_t a = enter(constraint->getRigidBodyA()), b = enter(constraint->getRigidBodyB());
                if (a != nobody && b != nobody) {
                    const std::size_t low = std::min(root(a), root(b)), high = std::max(root(a), root(b));
                    members_[high].island = low;
                }
                if (a != nobody || b != nobody) {
                    constraints_.push_back({constraint, a, b});
                }
            }
        }
        for (std::size_t i = 0; i < members_.size(); ++i) {
            members_[i].island = root(i);
        }
    }

    std::vector<member> &members() { return members_; }

    member *of(const btRigidBody *body) {
        const auto found = of_body_.find(body);
        return found == of_body_.end() ? nullptr : &members_[found->second];
    }

    const std::vector<articulation> &articulations() const { return articulations_; }

    /// Works out how those that touch answer pushes.
    void solve(btDiscreteDynamicsWorld &dynamics, btScalar dt) {
        for (member &one : members_) {
            one.lone = lone_mobility(*one.body);
            const vector6 now = six(motion{one.body->getLinearVelocity(), one.body->getAngularVelocity()});
            for (std::size_t i = 0; i < 6; ++i) {
                one.free[i] = now[i] + one.external[i] * double(dt);
            }
        }
        const auto before = [&](const joint &one, const joint &other) { return island_of(one) < island_of(other); };
        std::stable_sort(constraints_.begin(), constraints_.end(), before);
        islands_.clear();
        articulations_.clear();
        for (std::size_t i = 0; i < constraints_.size(); ++i) {
            if (i == 0 || island_of(constraints_[i]) != islands_.back().name) {
                islands_.emplace_back();
                islands_.back().name = island_of(constraints_[i]);
                islands_.back().first = i;
            }
            islands_.back().last = i + 1;
        }
        for (island &of : islands_) {
            const auto touches = [&](const member &one) { return one.island == of.name && one.touching; };
            if (std::none_of(members_.begin(), members_.end(), touches) || !prepare(of, dynamics, dt)) {
                continue;
            }
            articulation made;
            for (std::size_t i = 0; i < members_.size(); ++i) {
                const auto reaches = [&](const row &one) { return one.ends[0] == i || one.ends[1] == i; };
                if (touches(members_[i]) && std::any_of(of.rows.begin(), of.rows.end(), reaches)) {
                    made.members.push_back(i);
                }
            }
            if (!made.members.empty() && made.members.size() <= most_members) {
                answer(of, made, dt);
                articulations_.push_back(std::move(made));
            }
        }
    }

    /// Passes the impulses of this tick's contacts on to the islands of their bodies.
    void pass_on(btDiscreteDynamicsWorld &dynamics, btScalar dt) {
        for (island &of : islands_) {
            const auto is_pushed = [&](const member &one) {
                return one.island == of.name &&
                       std::any_of(one.impulse.begin(), one.impulse.end(), [](double x) { return x != 0.0; });
            };
            // Of an island that is just being woken, others get no impulse in this tick.
            const auto sleeps = [&](const member &one) { return one.island == of.name && !one.body->isActive(); };
            if (std::none_of(members_.begin(), members_.end(), is_pushed) ||
                std::any_of(members_.begin(), members_.end(), sleeps) ||
                !(of.ready || (!of.asked && prepare(of, dynamics, dt)))) {
                continue;
            }
            solve_rows(of, [&](const row &one) {
                return -sum_over(one, [&](const member &end) { return product(end.lone, end.impulse); });
            });
            for (std::size_t i = 0; i < members_.size(); ++i) {
                if (members_[i].island == of.name) {
                    move(*members_[i].body, product(members_[i].lone, held_by(of, i)));
                }
            }
        }
    }

private:
    static constexpr std::size_t nobody = std::size_t(-1);

    /// The matrix of an island is full: beyond this many rows it costs more than it is worth.
    static constexpr std::size_t most_rows = 300;

    /// Bodies that may touch at once in an island: the matrix of an articulation is full as well.
    static constexpr std::size_t most_members = 64;

    /// Softness of a row, over what it would be by itself, from which on it is left to Bullet: its solver would give in
    /// to what is passed on once more.
    static constexpr double soft = 1e-3;

    /// Softness of every row, as a part of what it would be by itself: rows that say the same twice leave it solvable.
    static constexpr double little = 1e-7;

    /// Part of a body's own inverse inertia that its joints leave it in every direction: otherwise none is left in
    /// some.
    static constexpr double left_over = 1e-6;

    struct joint {
        btTypedConstraint *constraint;
        std::size_t a, b;
    };

    struct row {
        std::size_t ends[2];
        vector6 jacobian[2];
        double target, softness, impulse;
    };

    /// Bodies that constraints join, with the rows of these.
    struct island {
        std::size_t name = 0;
        /// Its constraints.
        std::size_t first = 0, last = 0;
        std::vector<row> rows;
        /// Cholesky's factor of S, row by row.
        std::vector<double> factor;
        bool asked = false, ready = false;
    };

    /// Others may have been deleted from the dynamics world, or stand still by decree; what a constraint does between
    /// them is left to Bullet.
    static bool takes_part(const btRigidBody &body) {
        return body.isStaticOrKinematicObject() ||
               (body.isInWorld() && body.getActivationState() != DISABLE_SIMULATION);
    }

    std::size_t enter(btRigidBody &body) {
        if (body.isStaticOrKinematicObject() || !(body.getInvMass() > 0)) {
            return nobody;
        }
        const auto at = of_body_.emplace(&body, members_.size());
        if (at.second) {
            member fresh;
            fresh.body = &body;
            fresh.external = six(acceleration_of(body));
            fresh.island = members_.size();
            members_.push_back(fresh);
        }
        return at.first->second;
    }

    std::size_t root(std::size_t position) const {
        while (members_[position].island != position) {
            position = members_[position].island;
        }
        return position;
    }

    std::size_t island_of(const joint &one) const { return members_[one.a != nobody ? one.a : one.b].island; }

    /// Asks an island's constraints for their rows, and factorizes S; false where there are none, or too many.
    bool prepare(island &of, btDiscreteDynamicsWorld &dynamics, btScalar dt) {
        of.asked = true;
        of.rows.clear();
        for (std::size_t i = of.first; i < of.last; ++i) {
            add_rows(of.rows, constraints_[i], dynamics.getSolverInfo(), dt);
        }
        of.ready = !of.rows.empty() && of.rows.size() <= most_rows && factorize(of);
        return of.ready;
    }

    /// The rows of a constraint, asked for as Bullet's solver does.
    void add_rows(std::vector<row> &rows, const joint &of, const btContactSolverInfo &solver, btScalar dt) {
        btTypedConstraint::btConstraintInfo1 size;
        of.constraint->getInfo1(&size);
        const int count = size.m_numConstraintRows;
        const bool shows = of.constraint->needsFeedback() ||
                           of.constraint->getBreakingImpulseThreshold() < btScalar(SIMD_INFINITY);
        if (count <= 0 || shows) {
            return;
        }
        // A row in the table: two linear and two angular axes, each with room for a vector of Bullet's; four numbers.
        constexpr int skip = 20;
        table_.resize(0);
        table_.resize(skip * count, btScalar(0));
        btScalar *first = &table_[0];
        btTypedConstraint::btConstraintInfo2 info;
        info.fps = btScalar(1) / dt;
        info.erp = solver.m_erp;
        info.m_J1linearAxis = first;
        info.m_J1angularAxis = first + 4;
        info.m_J2linearAxis = first + 8;
        info.m_J2angularAxis = first + 12;
        info.rowskip = skip;
        info.m_constraintError = first + 16;
        info.cfm = first + 17;
        info.m_lowerLimit = first + 18;
        info.m_upperLimit = first + 19;
        info.m_numIterations = solver.m_numIterations;
        info.m_damping = solver.m_damping;
        for (int i = 0; i < count; ++i) {
            info.cfm[skip * i] = solver.m_globalCfm;
            info.m_lowerLimit[skip * i] = -SIMD_INFINITY;
            info.m_upperLimit[skip * i] = SIMD_INFINITY;
        }
        of.constraint->getInfo2(&info);
        for (int i = 0; i < count; ++i) {
            const btScalar *from = first + skip * i;
            row made{};
            made.ends[0] = of.a;
            made.ends[1] = of.b;
            made.target = double(from[16]);
            double own = 0.0;
            for (std::size_t end = 0; end < 2; ++end) {
                for (std::size_t k = 0; k < 3; ++k) {
                    made.jacobian[end][k] = double(from[8 * end + k]);
                    made.jacobian[end][3 + k] = double(from[8 * end + 4 + k]);
                }
                if (made.ends[end] == nobody) {
                    const btTypedConstraint &constraint = *of.constraint;
                    const btRigidBody &body = end == 0 ? constraint.getRigidBodyA() : constraint.getRigidBodyB();
                    if (body.isKinematicObject()) {
                        const motion now{body.getLinearVelocity(), body.getAngularVelocity()};
                        made.target -= dot(made.jacobian[end], six(now));
                    }
                    continue;
                }
                own += dot(made.jacobian[end], product(members_[made.ends[end]].lone, made.jacobian[end]));
            }
            const bool bounded = from[18] > -SIMD_INFINITY || from[19] < SIMD_INFINITY;
            if (bounded || double(from[17]) > soft || !(own > 0.0)) {
                continue;
            }
            made.softness = own * (double(from[17]) + little);
            rows.push_back(made);
        }
    }

    /// What a row sees of something that each body has.
    template <class of_member>
    double sum_over(const row &of, of_member get) const {
        double sum = 0.0;
        for (std::size_t end = 0; end < 2; ++end) {
            if (of.ends[end] != nobody) {
                sum += dot(of.jacobian[end], get(members_[of.ends[end]]));
            }
        }
        return sum;
    }

    bool factorize(island &of) const {
        const std::size_t size = of.rows.size();
        of.factor.assign(size * size, 0.0);
        for (std::size_t i = 0; i < size; ++i) {
            const row &at = of.rows[i];
            vector6 moved[2];
            for (std::size_t end = 0; end < 2; ++end) {
                if (at.ends[end] != nobody) {
                    moved[end] = product(members_[at.ends[end]].lone, at.jacobian[end]);
                }
            }
            for (std::size_t j = 0; j <= i; ++j) {
                const row &other = of.rows[j];
                double sum = i == j ? at.softness : 0.0;
                for (std::size_t end = 0; end < 4; ++end) {
                    if (at.ends[end / 2] != nobody && at.ends[end / 2] == other.ends[end % 2]) {
                        sum += dot(moved[end / 2], other.jacobian[end % 2]);
                    }
                }
                of.factor[size * i + j] = sum;
            }
        }
        for (std::size_t i = 0; i < size; ++i) {
            double *row_i = &of.factor[size * i];
            for (std::size_t j = 0; j <= i; ++j) {
                const double *row_j = &of.factor[size * j];
                double sum = row_i[j];
                for (std::size_t k = 0; k < j; ++k) {
                    sum -= row_i[k] * row_j[k];
                }
                if (i != j) {
                    row_i[j] = sum / row_j[j];
                } else if (sum > 0.0 && std::isfinite(sum)) {
                    row_i[i] = std::sqrt(sum);
                } else {
                    return false;
                }
            }
        }
        return true;
    }

    /// Takes a right hand side to the factor's inverse times it.
    static void forward(const island &of, std::vector<double> &side) {
        const std::size_t size = of.rows.size();
        for (std::size_t i = 0; i < size; ++i) {
            for (std::size_t k = 0; k < i; ++k) {
                side[i] -= of.factor[size * i + k] * side[k];
            }
            side[i] /= of.factor[size * i + i];
        }
    }

    /// The impulses of the rows that change their velocities by what `wanted` says of each.
    template <class of_row>
    void solve_rows(island &of, of_row wanted) {
        const std::size_t size = of.rows.size();
        side_.resize(size);
        for (std::size_t i = 0; i < size; ++i) {
            side_[i] = wanted(of.rows[i]);
        }
        forward(of, side_);
        for (std::size_t i = size; i-- > 0;) {
            for (std::size_t k = i + 1; k < size; ++k) {
                side_[i] -= of.factor[size * k + i] * side_[k];
            }
            side_[i] /= of.factor[size * i + i];
            of.rows[i].impulse = side_[i];
        }
    }

    /// What the rows do to a body: a wrench times the tick.
    static vector6 held_by(const island &of, std::size_t position) {
        vector6 push{};
        for (const row &at : of.rows) {
            for (std::size_t end = 0; end < 2; ++end) {
                for (std::size_t k = 0; at.ends[end] == position && k < 6; ++k) {
                    push[k] += at.jacobian[end][k] * at.impulse;
                }
            }
        }
        return push;
    }

    /// How the bodies of an articulation answer pushes, and what they do without any.
    void answer(island &of, articulation &to, btScalar dt) {
        solve_rows(of, [&](const row &one) {
            return one.target - sum_over(one, [](const member &end) { return end.free; });
        });
        const std::size_t size = of.rows.size(), width = 6 * to.members.size();
        columns_.resize(width);
        to.inverse_inertia.assign(width * width, 0.0);
        for (std::size_t i = 0; i < to.members.size(); ++i) {
            member &one = members_[to.members[i]];
            const vector6 least = least_mobility(*one.body, left_over);
            for (std::size_t k = 0; k < 6; ++k) {
                columns_[6 * i + k].assign(size, 0.0);
                for (std::size_t l = 0; l < 6; ++l) {
                    to.inverse_inertia[(6 * i + k) * width + 6 * i + l] = one.lone[6 * k + l];
                }
                to.inverse_inertia[(6 * i + k) * width + 6 * i + k] += least[k];
            }
            for (std::size_t j = 0; j < size; ++j) {
                const row &at = of.rows[j];
                for (std::size_t end = 0; end < 2; ++end) {
                    if (at.ends[end] == to.members[i]) {
                        const vector6 moved = product(one.lone, at.jacobian[end]);
                        for (std::size_t k = 0; k < 6; ++k) {
                            columns_[6 * i + k][j] += moved[k];
                        }
                    }
                }
            }
            const vector6 change = product(one.lone, held_by(of, to.members[i]));
            for (std::size_t k = 0; k < 6; ++k) {
                one.acceleration[k] = one.external[k] + change[k] / double(dt);
            }
            one.solved = true;
        }
        for (std::vector<double> &column : columns_) {
            forward(of, column);
        }
        for (std::size_t i = 0; i < width; ++i) {
            for (std::size_t j = 0; j <= i; ++j) {
                double sum = 0.0;
                for (std::size_t k = 0; k < size; ++k) {
                    sum += columns_[i][k] * columns_[j][k];
                }
                to.inverse_inertia[i * width + j] -= sum;
                if (i != j) {
                    to.inverse_inertia[j * width + i] -= sum;
                }
            }
        }
    }

    static void move(btRigidBody &body, const vector6 &by) {
        body.setLinearVelocity(body.getLinearVelocity() + vector_from(by.data()));
        body.setAngularVelocity(body.getAngularVelocity() + vector_from(by.data() + 3));
    }

    std::vector<member> members_;
    std::unordered_map<const btRigidBody *, std::size_t> of_body_;
    std::vector<joint> constraints_;
    std::vector<island> islands_;
    std::vector<articulation> articulations_;
    std::vector<std::vector<double>> columns_;
    std::vector<double> side_;
    btAlignedObjectArray<btScalar> table_;
};

}  // namespace detail
}  // namespace bullet
}  // namespace isocoat

#endif
