// A character walks through a heap of loose, soft balls and pushes them aside. The host animates it: every limb is a
// kinematic link, whose pose and velocities the host sets in each tick, whatever happens; the balls are isocoat's own.
//
//     walk [folder for pictures] [--record FILE]
//
// Exits with 0 when enough balls were moved, none is in the ground or in a limb, and all lie still in the end.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdint>
#include <exception>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include <isocoat/isocoat.hpp>

#include "../common/picture.h"
#include "../common/record.h"
#include "character.hpp"

namespace {

using isocoat::vec3;
using quaternion = std::array<double, 4>;  // x, y, z, w

constexpr double pi = 3.14159265358979323846;
constexpr double tick = 1.0 / 60.0;
constexpr double walking = 6.5, all = 12.0;  // [s]

vec3 plus(const vec3 &a, const vec3 &b, double factor = 1.0) {
    return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

quaternion times(const quaternion &a, const quaternion &b) {
    quaternion out = {0, 0, 0, a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2]};
    for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t i = (k + 1) % 3, j = (k + 2) % 3;
        out[k] = a[3] * b[k] + a[k] * b[3] + a[i] * b[j] - a[j] * b[i];
    }
    return out;
}

quaternion back(const quaternion &q) { return {-q[0], -q[1], -q[2], q[3]}; }

quaternion about(int axis, double angle) {
    quaternion out = {0, 0, 0, std::cos(0.5 * angle)};
    out[std::size_t(axis)] = std::sin(0.5 * angle);
    return out;
}

vec3 turn(const quaternion &q, const vec3 &v) {
    const quaternion out = times(times(q, {v[0], v[1], v[2], 0}), back(q));
    return {out[0], out[1], out[2]};
}

/// Key frames of the right side over one cycle, from heel strike to heel strike, in degrees; positive swings what hangs
/// forward and toes up. The left side is half a cycle behind.
constexpr std::size_t keys = 8;
using track = std::array<double, keys>;
constexpr track hip = {28, 24, 11, -2, -12, 0, 22, 32};
constexpr track knee = {-4, -15, -11, -5, -14, -48, -62, -30};
constexpr track ankle = {-4, -9, 0, 7, 6, -10, 4, 4};
constexpr track shoulder = {-24, -19, -6, 9, 18, 13, 0, -16};
constexpr track elbow = {12, 15, 22, 30, 34, 30, 22, 15};

/// Through the key frames without corners: cubic, with the slopes that the neighbours give.
double sample(const track &angles, double cycles) {
    const double at = keys * (cycles - std::floor(cycles));
    const std::size_t i = std::size_t(at) % keys;
    const double u = at - std::floor(at);
    const double a = angles[(i + keys - 1) % keys], b = angles[i];
    const double c = angles[(i + 1) % keys], d = angles[(i + 2) % keys];
    const double degrees = b + 0.5 * u * (c - a + u * (2 * a - 5 * b + 4 * c - d + u * (3 * (b - c) + d - a)));
    return degrees * pi / 180.0;
}

/// Where a limb is: its middle, and how it is turned from where it stands in character::limbs().
struct placed {
    vec3 center;
    quaternion turned;
};

class walker {
public:
    walker(isocoat::world &world, double start) : world_(world), skin(world.create_body(character::flesh())) {
        root_[1] = start;
        now_ = next_ = pose();
        std::vector<isocoat::link> links;
        for (const character::limb &part : character::limbs()) {
            isocoat_link_desc desc = isocoat_link_desc_default();
            desc.kind = ISOCOAT_LINK_HOST;  // without a mass: kinematic
            const vec3 center = plus(character::middle(part), root_);
            std::copy(center.begin(), center.end(), desc.pose.position);
            links.push_back(skin.create_link(desc));
            character::dress(links.back(), part);
            links_.push_back(links.back().raw());
        }
        character::join(skin, links);
        advance(0.0);
    }

    /// The next tick: from where the limbs are to where they are to be a tick later.
    void advance(double time) {
        // It gets going, and comes to a halt, by strides that grow from and shrink to nothing.
        const double ramp = std::clamp(std::min(time - 0.5, walking - time), 0.0, 1.0);
        stride_ = ramp * ramp * (3.0 - 2.0 * ramp);
        cycles_ += ramp > 0.0 ? tick / 1.15 : 0.0;
        now_ = next_;
        next_ = pose();
        // The feet carry the body: the soles' lowest end stays where it is, on the ground. A soft minimum hands over
        // from one end to the next without a jolt.
        constexpr double soft = 0.003;
        double weights = 0.0, slip = 0.0, lowest = 1.0;
        const std::vector<vec3> before = soles(now_), after = soles(next_);
        for (const vec3 &sole : after) {
            lowest = std::min(lowest, sole[2]);
        }
        for (std::size_t i = 0; i < after.size(); ++i) {
            const double weight = std::exp((lowest - after[i][2]) / soft);
            weights += weight;
            slip += weight * (after[i][1] - before[i][1]);
        }
        const vec3 carried = {0.0, -slip / weights, soft * std::log(weights) - lowest};  // on z = 0, never below
        root_ = plus(root_, carried);
        for (placed &limb : next_) {
            limb.center = plus(limb.center, carried);
        }
    }

    /// Tells the library. A kinematic link goes through a step from the pose that it has with the velocities that it
    /// has; so these are the ones that lead to the next pose, as in v += a dt, x += v dt.
    void tell() {
        std::vector<isocoat::link_state> states(now_.size());
        for (std::size_t i = 0; i < now_.size(); ++i) {
            const vec3 way = plus(next_[i].center, now_[i].center, -1.0);
            const quaternion turned = times(next_[i].turned, back(now_[i].turned));
            const double half = std::sqrt(turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2]);
            const double rate = half > 0.0 ? 2.0 * std::atan2(half, turned[3]) / half / tick : 0.0;
            std::copy(now_[i].center.begin(), now_[i].center.end(), states[i].pose.position);
            std::copy(now_[i].turned.begin(), now_[i].turned.end(), states[i].pose.orientation);
            for (std::size_t k = 0; k < 3; ++k) {
                states[i].linear_velocity[k] = way[k] / tick;
                states[i].angular_velocity[k] = turned[k] * rate;
            }
        }
        world_.set_link_states(links_, states);
    }

    double at() const { return root_[1]; }

private:
    /// Forward kinematics, from the pelvis outwards: parents come before their children.
    std::vector<placed> pose() const {
        std::vector<placed> out;
        for (std::size_t i = 0; i < character::limbs().size(); ++i) {
            const character::limb &part = character::limbs()[i];
            if (part.parent < 0) {
                out.push_back({plus(character::middle(part), root_), {0, 0, 0, 1}});
                continue;
            }
            const placed &parent = out[std::size_t(part.parent)];
            const vec3 from = character::middle(character::limbs()[std::size_t(part.parent)]);
            const vec3 joint = plus(parent.center, turn(parent.turned, plus(part.joint, from, -1.0)));
            const quaternion turned = times(parent.turned, bend(part));
            out.push_back({plus(joint, turn(turned, plus(character::middle(part), part.joint, -1.0))), turned});
        }
        return out;
    }

    quaternion bend(const character::limb &part) const {
        static const std::map<std::string, track> tracks = {
            {"upper arm", shoulder}, {"forearm", elbow}, {"thigh", hip}, {"shin", knee}, {"foot", ankle}};
        const double side = part.from[0] < 0.0 ? -1.0 : 1.0;
        const auto angles = tracks.find(part.name);
        if (angles == tracks.end()) {
            return {0, 0, 0, 1};
        }
        const double swing = stride_ * sample(angles->second, cycles_ + (side < 0.0 ? 0.5 : 0.0));
        // Arms hang so close to the body that they brush it.
        const double inwards = angles->first == "upper arm" ? 0.12 * side * stride_ : 0.0;
        return times(about(1, inwards), about(0, swing));
    }

    /// Heel and ball of both feet, where the coat is lowest under them.
    static std::vector<vec3> soles(const std::vector<placed> &limbs) {
        std::vector<vec3> out;
        for (std::size_t i = 0; i < limbs.size(); ++i) {
            const character::limb &part = character::limbs()[i];
            for (const vec3 &end : {part.from, part.to}) {
                if (std::string(part.name) == "foot") {
                    const vec3 arm = turn(limbs[i].turned, plus(end, character::middle(part), -1.0));
                    out.push_back(plus(plus(limbs[i].center, arm), {0, 0, -part.thickness}));
                }
            }
        }
        return out;
    }

    isocoat::world &world_;
    std::vector<isocoat_link> links_;
    std::vector<placed> now_, next_;
    vec3 root_ = {0, 0, 0};
    double cycles_ = 0.0, stride_ = 0.0;

public:
    isocoat::body skin;
};

struct ball {
    isocoat::link link;
    double radius, mass;
    vec3 home;

    /// A coat that rolls loses nothing, and would never stop; the host adds what a carpet does.
    void brake() {
        const isocoat::link_state now = link.state();
        vec3 torque;
        for (std::size_t k = 0; k < 3; ++k) {
            torque[k] = -2.0 * mass * radius * radius * now.angular_velocity[k];
        }
        link.apply_torque(torque);
    }
};

void lay_ground(isocoat::world &world) {
    isocoat_body_desc desc = character::flesh();
    desc.kind = ISOCOAT_BODY_RIGID;
    isocoat_skeleton_desc half_space = isocoat_skeleton_desc_default();
    half_space.shape = ISOCOAT_SHAPE_PLANE;
    half_space.thickness = 0.05;
    half_space.points[0][2] = -half_space.thickness;
    half_space.points[1][2] = 1.0;
    world.create_body(desc).create_link(isocoat_link_desc_default()).create_skeleton(half_space);
}

/// A heap: two loose layers of balls of different sizes, which settle before the character arrives.
std::vector<ball> heap(isocoat::world &world) {
    std::vector<ball> balls;
    std::uint32_t noise = 12345;
    const auto random = [&noise] {
        noise = noise * 1664525u + 1013904223u;
        return double(noise >> 8) / double(1u << 24);
    };
    for (int i = 0; i < 26; ++i) {
        const bool above = i >= 18;
        const double radius = above ? 0.08 + 0.03 * random() : 0.08 + 0.07 * random();
        const int row = above ? (i - 18) / 2 : i / 3, column = above ? (i - 18) % 2 : i % 3;
        isocoat_body_desc soft = character::flesh();
        soft.stiffness_scale = 2e4;
        isocoat_link_desc desc = isocoat_link_desc_default();
        desc.kind = ISOCOAT_LINK_RIGID;
        desc.mass = 150.0 * 4.0 / 3.0 * pi * radius * radius * radius;
        isocoat::check(isocoat_inertia_of_sphere(desc.mass, radius, desc.inertia));
        desc.pose.position[0] = 0.29 * column - (above ? 0.15 : 0.29) + 0.03 * (random() - 0.5);
        desc.pose.position[1] = 0.29 * row + (above ? 0.45 : 0.0) + 0.03 * (random() - 0.5);
        desc.pose.position[2] = above ? 0.36 : radius;
        isocoat_skeleton_desc point = isocoat_skeleton_desc_default();
        point.thickness = radius;
        ball one = {world.create_body(soft).create_link(desc), radius, desc.mass, {}};
        one.link.create_skeleton(point);
        balls.push_back(one);
    }
    return balls;
}

int run(const char *folder, const char *record) {
    recording film;
    if (record_begin(&film, record)) throw std::runtime_error("cannot record");
    isocoat_world_desc settings = isocoat_world_desc_default();
    settings.gravity[2] = -9.81;
    settings.force_tolerance = 5e-2;
    isocoat::world world(settings);
    lay_ground(world);
    std::vector<ball> balls = heap(world);
    constexpr double start = -2.0;
    walker character(world, start);
    const picture_view view = {{5.2, -2.2, 2.4}, {0.0, 0.4, 0.7}, {0, 0, 1}, 5.6};

    int pictures = 0, moved = 0, touched_itself = 0;
    double total = 0.0, second = 0.0, slowest = 0.0, lowest = 1.0, inside = 0.0, deepest = 0.0, still_since = 0.0;
    bool finite = true;
    std::vector<vec3> centers(balls.size());
    std::vector<double> fields(balls.size());
    std::printf("  time  walked  moved  contacts  with itself  fastest ball    a frame\n");
    const int frames = int(std::lround(all / tick));
    for (int frame = 1; frame <= frames; ++frame) {
        const auto begin = std::chrono::steady_clock::now();
        character.tell();
        for (ball &one : balls) {
            one.brake();
        }
        world.step(tick);
        const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        total += took;
        second += took;
        slowest = std::max(slowest, took);
        const double time = frame * tick;
        // The step has moved the balls on and left the character to its host: look at both at the same moment.
        character.advance(time);
        character.tell();

        if (record_frame(&film, world.get(), time)) throw std::runtime_error("cannot record");

        moved = 0;
        double fastest = 0.0;
        lowest = 1.0;
        for (std::size_t i = 0; i < balls.size(); ++i) {
            const isocoat::link_state state = balls[i].link.state();
            std::copy_n(state.pose.position, 3, centers[i].begin());
            if (frame == 60) {
                balls[i].home = centers[i];
            }
            const vec3 way = plus(centers[i], balls[i].home, -1.0);
            moved += frame > 60 && std::hypot(way[0], way[1]) > 0.1;
            const double *v = state.linear_velocity;
            fastest = std::max(fastest, std::sqrt(picture_dot(v, v)));
            lowest = std::min(lowest, centers[i][2] / balls[i].radius);
            finite = finite && std::isfinite(picture_dot(centers[i].data(), centers[i].data()) + picture_dot(v, v));
        }
        // The field is 1 on the character's skin, and higher within.
        character.skin.evaluate_field(centers, fields);
        inside = *std::max_element(fields.begin(), fields.end());
        deepest = std::max(deepest, inside);
        still_since = fastest < 0.02 ? still_since : time;
        const auto contacts = world.contacts();
        const auto itself = std::count_if(contacts.begin(), contacts.end(), [](const isocoat::contact &contact) {
            return contact.body_a.index == contact.body_b.index;
        });
        touched_itself += itself > 0;
        if (frame % 60 == 0) {
            std::printf("%4.0f s  %4.2f m  %5d  %8zu  %11d  %8.3f m/s  %6.2f ms\n", time, character.at() - start, moved,
                        contacts.size(), int(itself), fastest, 1e3 * second / 60);
            std::fflush(stdout);
            second = 0.0;
        }
        if (folder && frame % 45 == 0 && time < walking + 0.5) {
            const std::string path = std::string(folder) + "/walk_" + std::to_string(100 + pictures++) + ".ppm";
            if (picture_write(world.get(), &view, ~std::uint64_t(0), 400, 300, path.c_str()) != 0) {
                throw std::runtime_error("cannot write " + path);
            }
        }
    }
    std::printf("%d of %zu balls moved, still since %.1f s; the lowest centre at %.2f of its radius\n"
                "the character's field was %.2f in a centre at most; it touched itself in %d frames\n"
                "%.2f ms a frame, the slowest %.1f ms\n",
                moved, balls.size(), still_since, lowest, deepest, touched_itself, 1e3 * total / frames, 1e3 * slowest);
    if (record_end(&film)) throw std::runtime_error("cannot record");
    const bool intact = finite && lowest > 0.8 && inside < 0.5;
    return intact && moved >= 15 && still_since < all - 1.0 && touched_itself > 0 ? 0 : 1;
}

}  // namespace

int main(int argc, char **argv) {
    try {
        const char *record = record_argument(&argc, argv);
        return run(argc > 1 ? argv[1] : nullptr, record);
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
