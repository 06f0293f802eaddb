// A pile of soft balls in a pit, by Bullet's soft bodies with cluster collisions and by isocoat, step by step in turn.
//
//     bullet_clusters
//
// Prints a line for each kind of pile: balls, clusters of each Bullet ball, median processor time of a step [ms] by
// Bullet, by isocoat with the polar patch and by isocoat as it is set by default, each while the balls land and when
// they lie; last, what Bullet's balls keep of their volume, and what isocoat's may at most have lost.
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <algorithm>
#include <cstdio>
#include <ctime>
#include <exception>
#include <memory>
#include <vector>

#include <isocoat/isocoat.hpp>

namespace {

constexpr double radius = 0.5;
constexpr double mass = 1.0;
constexpr double friction = 0.3;
constexpr double gravity = 9.81;
constexpr double frame = 1.0 / 60.0;
constexpr int nodes = 128;
constexpr int landing = 120; // steps until the balls lie
constexpr int lying = 240;   // steps after those

/// Where the balls start: on a grid, a little off each other's top.
struct grid {
    int side;

    int count() const { return side * side * side; }
    double half_width() const { return (radius + 0.01) * side; }

    isocoat::vec3 place(int index) const {
        const int level = index / side / side;
        const double shift = level % 2 == 0 ? 0.004 : -0.004;
        const auto along = [this](int i) { return (i - 0.5 * (side - 1)) * (2.0 * radius + 0.01); };
        return {along(index % side) + shift, along(index / side % side) + shift, radius + 0.02 + 1.02 * level};
    }
};

/// Processor time of this process [s]: other programs on the machine lengthen it little.
double clock_now() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

btVector3 vector(const isocoat::vec3 &v) { return {btScalar(v[0]), btScalar(v[1]), btScalar(v[2])}; }

class bullet_pile {
public:
    bullet_pile(const grid &places, int clusters) {
        const btVector3 down(0, 0, btScalar(-gravity));
        world.setGravity(down);
        world.getWorldInfo().m_gravity = down;
        world.getWorldInfo().m_sparsesdf.Initialize();
        const double width = places.half_width() + 1.0;
        add_box({0.0, 0.0, -1.0}, {width, width, 1.0});
        for (const double side : {-1.0, 1.0}) {
            add_box({side * width, 0.0, 5.0}, {1.0, width, 6.0});
            add_box({0.0, side * width, 5.0}, {width, 1.0, 6.0});
        }
        for (int i = 0; i < places.count(); ++i) {
            add_ball(places.place(i), clusters);
        }
        start_volume = volume();
    }

    ~bullet_pile() {
        for (const auto &ball : balls) {
            world.removeSoftBody(ball.get());
        }
        for (const auto &wall : walls) {
            world.removeRigidBody(wall.get());
        }
    }

    bullet_pile(const bullet_pile &) = delete;
    bullet_pile &operator=(const bullet_pile &) = delete;

    void step() { world.stepSimulation(btScalar(frame), 0); }

    double kept_volume() const { return volume() / start_volume; }

private:
    void add_box(const isocoat::vec3 &at, const isocoat::vec3 &half) {
        shapes.push_back(std::make_unique<btBoxShape>(vector(half)));
        shapes.back()->setMargin(btScalar(0.01));
        btRigidBody::btRigidBodyConstructionInfo info(0, nullptr, shapes.back().get());
        info.m_startWorldTransform.setIdentity();
        info.m_startWorldTransform.setOrigin(vector(at));
        info.m_friction = btScalar(friction);
        walls.push_back(std::make_unique<btRigidBody>(info));
        world.addRigidBody(walls.back().get());
    }

    void add_ball(const isocoat::vec3 &at, int clusters) {
        const btVector3 size = vector({radius, radius, radius});
        balls.emplace_back(btSoftBodyHelpers::CreateEllipsoid(world.getWorldInfo(), vector(at), size, nodes));
        btSoftBody &ball = *balls.back();
        ball.setTotalMass(btScalar(mass), true);
        ball.getCollisionShape()->setMargin(btScalar(0.02));
        ball.m_materials[0]->m_kLST = btScalar(0.5);
        ball.m_cfg.kDF = btScalar(friction);
        ball.m_cfg.kDP = btScalar(0.01);
        ball.m_cfg.kVC = 20;
        ball.m_cfg.collisions = btSoftBody::fCollision::CL_SS | btSoftBody::fCollision::CL_RS;
        ball.setPose(true, false);
        ball.generateBendingConstraints(2);
        ball.generateClusters(clusters);
        ball.setActivationState(DISABLE_DEACTIVATION);
        world.addSoftBody(&ball);
    }

    double volume() const {
        double sum = 0.0;
        for (const auto &ball : balls) {
            for (int i = 0; i < ball->m_faces.size(); ++i) {
                const auto &corner = ball->m_faces[i].m_n;
                sum += double(corner[0]->m_x.dot(corner[1]->m_x.cross(corner[2]->m_x)));
            }
        }
        return sum;
    }

    btSoftBodyRigidBodyCollisionConfiguration configuration;
    btCollisionDispatcher dispatcher{&configuration};
    btDbvtBroadphase broadphase;
    btSequentialImpulseConstraintSolver solver;
    btSoftRigidDynamicsWorld world{&dispatcher, &broadphase, &solver, &configuration};
    std::vector<std::unique_ptr<btCollisionShape>> shapes;
    std::vector<std::unique_ptr<btRigidBody>> walls;
    std::vector<std::unique_ptr<btSoftBody>> balls;
    double start_volume = 0.0;
};

class coat_pile {
public:
    coat_pile(const grid &places, isocoat_scheme scheme) : world(settings(scheme)) {
        isocoat_body_desc material = isocoat_body_desc_default();
        material.friction = friction;
        material.dissipation = 0.5;
        isocoat_body_desc hard = material;
        hard.kind = ISOCOAT_BODY_RIGID;
        const double half = places.half_width();
        add_wall(hard, {0, 0, 1}, 0.0);
        for (const double side : {-1.0, 1.0}) {
            add_wall(hard, {side, 0, 0}, -half);
            add_wall(hard, {0, side, 0}, -half);
        }
        for (int i = 0; i < places.count(); ++i) {
            isocoat_link_desc frame_of = isocoat_link_desc_default();
            frame_of.kind = ISOCOAT_LINK_RIGID;
            frame_of.mass = mass;
            const isocoat::vec3 at = places.place(i);
            std::copy(at.begin(), at.end(), frame_of.pose.position);
            for (const int axis : {0, 4, 8}) {
                frame_of.inertia[axis] = 0.4 * mass * radius * radius;
            }
            isocoat_skeleton_desc point = isocoat_skeleton_desc_default();
            point.thickness = radius;
            world.create_body(material).create_link(frame_of).create_skeleton(point);
        }
    }

    void step() { world.step(frame); }

    /// What of a ball's volume lies in its overlaps, at most: caps of spheres as deep as the deepest contact.
    double overlapped() const {
        double most = 0.0;
        for (const isocoat::contact &contact : world.contacts()) {
            // The default coat's pressure grows by 2/t of its stiffness scale.
            const double depth = contact.peak_pressure * radius / (2.0 * isocoat_body_desc_default().stiffness_scale);
            most = std::max(most, depth);
        }
        return most / radius;
    }

private:
    static isocoat_world_desc settings(isocoat_scheme scheme) {
        isocoat_world_desc desc = isocoat_world_desc_default();
        desc.gravity[2] = -gravity;
        desc.scheme = scheme;
        desc.force_tolerance = 5e-2;
        return desc;
    }

    void add_wall(const isocoat_body_desc &hard, const isocoat::vec3 &normal, double offset) {
        isocoat_skeleton_desc plane = isocoat_skeleton_desc_default();
        plane.shape = ISOCOAT_SHAPE_PLANE;
        for (int i = 0; i < 3; ++i) {
            // The coat ends where the pit begins.
            plane.points[0][i] = normal[std::size_t(i)] * (offset - plane.thickness);
            plane.points[1][i] = normal[std::size_t(i)];
        }
        world.create_body(hard).create_link(isocoat_link_desc_default()).create_skeleton(plane);
    }

    isocoat::world world;
};

double median(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    return 1e3 * values[values.size() / 2];
}

void compare(int side, int clusters) {
    const grid places{side};
    bullet_pile bullet(places, clusters);
    coat_pile polar(places, ISOCOAT_SCHEME_POLAR);
    coat_pile usual(places, ISOCOAT_SCHEME_AUTO);
    std::vector<double> times[3][2];
    for (int i = 0; i < landing + lying; ++i) {
        const auto timed = [&](int who, auto &pile) {
            const double begin = clock_now();
            pile.step();
            times[who][i < landing ? 0 : 1].push_back(clock_now() - begin);
        };
        timed(0, bullet);
        timed(1, polar);
        timed(2, usual);
    }
    std::printf("%d,%d", places.count(), clusters);
    for (const auto &of_one : times) {
        std::printf(",%.4f,%.4f", median(of_one[0]), median(of_one[1]));
    }
    std::printf(",%.3f,%.4f\n", bullet.kept_volume(), usual.overlapped());
    std::fflush(stdout);
}

} // namespace

int main() {
    try {
        std::printf("balls,clusters,bullet_landing,bullet_lying,polar_landing,polar_lying,default_landing,default_lying,"
                    "bullet_volume,isocoat_deepest\n");
        for (const int side : {2, 3}) {
            for (const int clusters : {1, 4, 16}) {
                compare(side, clusters);
            }
        }
    } catch (const std::exception &problem) {
        std::fprintf(stderr, "bullet_clusters: %s\n", problem.what());
        return 1;
    }
    return 0;
}
