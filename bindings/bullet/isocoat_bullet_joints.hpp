// isocoat for Bullet: how rigid bodies that constraints join answer pushes. isocoat_bullet.hpp brings it, and says how
// all of it is used.
//
// SPDX-License-Identifier: MIT OR Apache-2.0
//
// The rows of all enabled constraints of an island, J u = r - C l with impulses l between bounds, are those that
// Bullet's solver is about to get: the constraints are asked for them at the poses in which the tick begins. With the
// inverse masses W, and S = J W J^T + C over the rows that are at work, a push on the bodies changes their velocities
// by A = W - W J^T S^-1 J W, of which isocoat gets the 6x6 block of each body. Bullet's solver comes near that solution
// in as many iterations as its host gives it. Bodies of one island that touch at once move each other, which no matrix
// of one of them says: such islands are left out, and what holds their bodies is estimated.
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

/// Dynamic bodies on constraints, island by island.
class joints {
public:
    /// What moves a body in the coming tick, apart from constraints.
    struct member {
        const btRigidBody *body = nullptr;
        /// As an acceleration.
        vector6 external{};
        /// The last impulse of its contacts: it tells which limits are at work.
        vector6 pushed{};
        /// Contacts act on it.
        bool touching = false;
        /// What comes out, unless several bodies of the island touch: whether the island could be solved; how the body
        /// answers pushes; its acceleration without any.
        bool solved = false;
        matrix6 mobility{};
        vector6 acceleration{};

        std::size_t island = 0;
        /// Velocity at the end of the tick without constraints.
        vector6 free{};
        matrix6 lone{};
    };

    /// Finds the bodies that enabled constraints join.
    void find(btDiscreteDynamicsWorld &dynamics) {
        members_.clear();
        of_body_.clear();
        constraints_.clear();
        for (int i = 0; i < dynamics.getNumConstraints(); ++i) {
            btTypedConstraint *constraint = dynamics.getConstraint(i);
            if (constraint->isEnabled()) {
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

    /// Works out how all of them answer pushes.
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
        for (std::size_t first = 0, last = 0; first < constraints_.size(); first = last) {
            const std::size_t island = island_of(constraints_[first]);
            rows_.clear();
            for (; last < constraints_.size() && island_of(constraints_[last]) == island; ++last) {
                add_rows(constraints_[last], dynamics.getSolverInfo(), dt);
            }
            if (!rows_.empty() && rows_.size() <= most_rows && touched_in(island) < 2) {
                solve_island(island, dt);
            }
        }
    }

private:
    static constexpr std::size_t nobody = std::size_t(-1);

    /// The matrix of an island is full: beyond this many rows it costs more than it is worth.
    static constexpr std::size_t most_rows = 300;

    /// Softness of every row, as a part of what it would be by itself: rows that say the same twice leave it solvable.
    static constexpr double little = 1e-7;

    struct joint {
        btTypedConstraint *constraint;
        std::size_t a, b;
    };

    struct row {
        std::size_t ends[2];
        vector6 jacobian[2];
        double target, softness, lower, upper;
        /// It holds; otherwise its impulse is at a bound.
        bool holds;
        double impulse;
    };

    std::size_t enter(const btRigidBody &body) {
        if (body.isStaticOrKinematicObject() || !(body.getInvMass() > 0)) {
            return nobody;
        }
        const auto at = of_body_.emplace(&body, members_.size());
        if (at.second) {
            member fresh;
            fresh.body = &body;
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

    std::ptrdiff_t touched_in(std::size_t island) const {
        return std::count_if(members_.begin(), members_.end(),
                             [&](const member &one) { return one.island == island && one.touching; });
    }

    /// The rows of a constraint, asked for as Bullet's solver does.
    void add_rows(const joint &of, const btContactSolverInfo &solver, btScalar dt) {
        btTypedConstraint::btConstraintInfo1 size;
        of.constraint->getInfo1(&size);
        const int count = size.m_numConstraintRows;
        if (count <= 0) {
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
        const btScalar breaking = of.constraint->getBreakingImpulseThreshold();
        for (int i = 0; i < count; ++i) {
            const btScalar *from = first + skip * i;
            row made{};
            made.ends[0] = of.a;
            made.ends[1] = of.b;
            double own = 0.0;
            for (std::size_t end = 0; end < 2; ++end) {
                if (made.ends[end] == nobody) {
                    continue;
                }
                for (std::size_t k = 0; k < 3; ++k) {
                    made.jacobian[end][k] = double(from[8 * end + k]);
                    made.jacobian[end][3 + k] = double(from[8 * end + 4 + k]);
                }
                own += dot(made.jacobian[end], product(members_[made.ends[end]].lone, made.jacobian[end]));
            }
            if (!(own > 0.0)) {
                continue;
            }
            made.target = double(from[16]);
            made.softness = own * (double(from[17]) + little);
            made.lower = double(std::max(from[18], -breaking));
            made.upper = double(std::min(from[19], breaking));
            rows_.push_back(made);
        }
    }

    /// What the row's velocity is at these velocities of the bodies.
    double velocity_of(const row &of, const std::vector<vector6> &velocities) const {
        double sum = 0.0;
        for (std::size_t end = 0; end < 2; ++end) {
            if (of.ends[end] != nobody) {
                sum += dot(of.jacobian[end], velocities[of.ends[end]]);
            }
        }
        return sum;
    }

    void solve_island(std::size_t island, btScalar dt) {
        for (row &one : rows_) {
            one.holds = true;
            one.impulse = 0.0;
        }
        // Which rows are at their bounds, under the load that contacts had in the last tick. Few change their minds.
        velocities_.resize(members_.size());
        bool settled = false;
        for (int turn = 0; turn < 8 && !settled; ++turn) {
            set_velocities(island, true);
            if (!factorize()) {
                return;
            }
            solve_rows();
            settled = true;
            for (row &one : rows_) {
                if (one.holds && (one.impulse < one.lower || one.impulse > one.upper)) {
                    one.holds = false;
                    one.impulse = std::min(std::max(one.impulse, one.lower), one.upper);
                    settled = false;
                }
            }
        }
        if (!factorize()) {
            return;
        }
        set_velocities(island, false);
        solve_rows();
        for (member &one : members_) {
            if (one.island == island) {
                answer(one, std::size_t(&one - members_.data()), dt);
            }
        }
    }

    /// The velocities of the island's bodies without the rows that hold.
    void set_velocities(std::size_t island, bool loaded) {
        for (std::size_t i = 0; i < members_.size(); ++i) {
            const member &one = members_[i];
            if (one.island == island) {
                velocities_[i] = one.free;
                if (loaded) {
                    add(velocities_[i], product(one.lone, one.pushed));
                }
            }
        }
        for (const row &one : rows_) {
            for (std::size_t end = 0; end < 2 && !one.holds; ++end) {
                if (one.ends[end] != nobody) {
                    vector6 push = one.jacobian[end];
                    for (double &x : push) {
                        x *= one.impulse;
                    }
                    add(velocities_[one.ends[end]], product(members_[one.ends[end]].lone, push));
                }
            }
        }
    }

    static void add(vector6 &to, const vector6 &what) {
        for (std::size_t i = 0; i < 6; ++i) {
            to[i] += what[i];
        }
    }

    /// Cholesky's factor of S over the rows that hold.
    bool factorize() {
        holding_.clear();
        for (std::size_t i = 0; i < rows_.size(); ++i) {
            if (rows_[i].holds) {
                holding_.push_back(i);
            }
        }
        const std::size_t size = holding_.size();
        factor_.assign(size * size, 0.0);
        for (std::size_t i = 0; i < size; ++i) {
            const row &at = rows_[holding_[i]];
            vector6 moved[2];
            for (std::size_t end = 0; end < 2; ++end) {
                if (at.ends[end] != nobody) {
                    moved[end] = product(members_[at.ends[end]].lone, at.jacobian[end]);
                }
            }
            for (std::size_t j = 0; j <= i; ++j) {
                const row &other = rows_[holding_[j]];
                double sum = i == j ? at.softness : 0.0;
                for (std::size_t end = 0; end < 4; ++end) {
                    if (at.ends[end / 2] != nobody && at.ends[end / 2] == other.ends[end % 2]) {
                        sum += dot(moved[end / 2], other.jacobian[end % 2]);
                    }
                }
                factor_[size * i + j] = sum;
            }
        }
        for (std::size_t i = 0; i < size; ++i) {
            double *row_i = &factor_[size * i];
            for (std::size_t j = 0; j <= i; ++j) {
                const double *row_j = &factor_[size * j];
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
    void forward(std::vector<double> &side) const {
        const std::size_t size = holding_.size();
        for (std::size_t i = 0; i < size; ++i) {
            for (std::size_t k = 0; k < i; ++k) {
                side[i] -= factor_[size * i + k] * side[k];
            }
            side[i] /= factor_[size * i + i];
        }
    }

    /// The impulses of the rows that hold.
    void solve_rows() {
        const std::size_t size = holding_.size();
        side_.resize(size);
        for (std::size_t i = 0; i < size; ++i) {
            const row &one = rows_[holding_[i]];
            side_[i] = one.target - velocity_of(one, velocities_);
        }
        forward(side_);
        for (std::size_t i = size; i-- > 0;) {
            for (std::size_t k = i + 1; k < size; ++k) {
                side_[i] -= factor_[size * k + i] * side_[k];
            }
            side_[i] /= factor_[size * i + i];
            rows_[holding_[i]].impulse = side_[i];
        }
    }

    void answer(member &one, std::size_t position, btScalar dt) {
        const std::size_t size = holding_.size();
        vector6 push{};
        std::array<std::vector<double>, 6> columns;
        for (std::vector<double> &column : columns) {
            column.assign(size, 0.0);
        }
        for (const row &at : rows_) {
            for (std::size_t end = 0; end < 2; ++end) {
                for (std::size_t k = 0; at.ends[end] == position && k < 6; ++k) {
                    push[k] += at.jacobian[end][k] * at.impulse;
                }
            }
        }
        for (std::size_t i = 0; i < size; ++i) {
            const row &at = rows_[holding_[i]];
            for (std::size_t end = 0; end < 2; ++end) {
                if (at.ends[end] == position) {
                    const vector6 moved = product(one.lone, at.jacobian[end]);
                    for (std::size_t k = 0; k < 6; ++k) {
                        columns[k][i] += moved[k];
                    }
                }
            }
        }
        // Joints that leave no freedom make the matrix singular: a millionth of the lone body's is added.
        one.mobility = one.lone;
        for (std::size_t i = 0; i < 6; ++i) {
            one.mobility[7 * i] *= 1.0 + 1e-6;
        }
        for (std::size_t k = 0; k < 6; ++k) {
            forward(columns[k]);
        }
        for (std::size_t i = 0; i < 6; ++i) {
            for (std::size_t j = 0; j < 6; ++j) {
                for (std::size_t k = 0; k < size; ++k) {
                    one.mobility[6 * i + j] -= columns[i][k] * columns[j][k];
                }
            }
        }
        const vector6 change = product(one.lone, push);
        for (std::size_t k = 0; k < 6; ++k) {
            one.acceleration[k] = one.external[k] + change[k] / double(dt);
        }
        one.solved = true;
    }

    std::vector<member> members_;
    std::unordered_map<const btRigidBody *, std::size_t> of_body_;
    std::vector<joint> constraints_;
    /// Of the island at hand.
    std::vector<row> rows_;
    std::vector<std::size_t> holding_;
    std::vector<vector6> velocities_;
    std::vector<double> factor_;
    std::vector<double> side_;
    btAlignedObjectArray<btScalar> table_;
};

}  // namespace detail
}  // namespace bullet
}  // namespace isocoat

#endif
