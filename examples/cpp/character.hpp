// A character of fifteen links in one coat: what the examples that have one share. Its limbs are capsules; skeletons of
// joined links blend, all others collide.
#ifndef CHARACTER_HPP
#define CHARACTER_HPP

#include <array>
#include <string>
#include <utility>
#include <vector>

#include <isocoat/isocoat.hpp>

namespace character {

/// Hands and feet are heavier than a person's: a joint must not hang many times a body's mass on it.
/// A limb of the character as it stands, feet at z = 0, facing along y: from one end to the other, the thickness of its
/// coat, its mass, and the joint by which it hangs.
struct limb {
    const char *name;
    int parent;
    isocoat::vec3 from, to;
    double thickness;  // [m]
    double mass;       // [kg]
    /// Of the joint to the parent; a hinge turns about x, the others like a ball in its socket.
    isocoat::vec3 joint;
    bool hinge;
};

inline const std::vector<limb> &limbs() {
    static const std::vector<limb> all = [] {
        std::vector<limb> made = {
            {"pelvis", -1, {-0.07, 0, 0.98}, {0.07, 0, 0.98}, 0.11, 11, {0, 0, 0}, false},
            {"chest", 0, {-0.08, 0, 1.30}, {0.08, 0, 1.30}, 0.13, 16, {0, 0, 1.12}, false},
            {"head", 1, {0, 0, 1.64}, {0, 0.02, 1.68}, 0.10, 5, {0, 0, 1.52}, false},
        };
        for (const double side : {-1.0, 1.0}) {
            const auto at = [side](double x, double y, double z) { return isocoat::vec3{side * x, y, z}; };
            const int shoulder = int(made.size());
            made.push_back({"upper arm", 1, at(0.23, 0, 1.38), at(0.27, 0, 1.16), 0.055, 3.0, at(0.21, 0, 1.40), false});
            made.push_back({"forearm", shoulder, at(0.28, 0, 1.08), at(0.29, 0.02, 0.90), 0.048, 2.5, at(0.275, 0, 1.12), true});
            made.push_back({"hand", shoulder + 1, at(0.295, 0.03, 0.81), at(0.295, 0.04, 0.75), 0.045, 1.5, at(0.29, 0.02, 0.85), true});
            const int hip = int(made.size());
            made.push_back({"thigh", 0, at(0.11, 0, 0.84), at(0.12, 0, 0.56), 0.08, 7, at(0.10, 0, 0.92), false});
            made.push_back({"shin", hip, at(0.12, 0, 0.44), at(0.12, 0, 0.18), 0.058, 4.5, at(0.12, 0, 0.50), true});
            made.push_back({"foot", hip + 1, at(0.12, 0.0, 0.06), at(0.12, 0.14, 0.05), 0.055, 2.5, at(0.12, 0, 0.10), true});
        }
        return made;
    }();
    return all;
}

/// Middle of a limb.
inline isocoat::vec3 middle(const limb &part) {
    isocoat::vec3 out{};
    for (int k = 0; k < 3; ++k) {
        out[k] = 0.5 * (part.from[k] + part.to[k]);
    }
    return out;
}

/// The coat's material: flesh that a hand can press in.
inline isocoat_body_desc flesh() {
    isocoat_body_desc desc = isocoat_body_desc_default();
    desc.stiffness_scale = 2e5;
    desc.friction = 0.5;
    desc.static_friction = 0.6;
    desc.dissipation = 2.0;
    return desc;
}

/// Gives the link of a limb its coat: a skeleton along it, and the head a neck. The link's frame is at the limb's middle
/// and has the axes that the character stands in.
inline void dress(isocoat::link link, const limb &part) {
    const isocoat::vec3 center = middle(part);
    const auto add = [&](const isocoat::vec3 &from, const isocoat::vec3 &to, double thickness) {
        isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
        desc.shape = ISOCOAT_SHAPE_SEGMENT;
        for (int k = 0; k < 3; ++k) {
            desc.points[0][k] = from[k] - center[k];
            desc.points[1][k] = to[k] - center[k];
        }
        desc.thickness = thickness;
        desc.radius = 2.2 * thickness;
        link.create_skeleton(desc);
    };
    add(part.from, part.to, part.thickness);
    if (std::string(part.name) == "head") {
        add({0, 0, 1.44}, {0, 0, 1.56}, 0.05);
    }
}

/// Lets joined limbs blend, and all others collide.
inline void join(isocoat::body body, const std::vector<isocoat::link> &links) {
    std::vector<std::pair<isocoat::link, isocoat::link>> joints;
    for (std::size_t i = 0; i < links.size(); ++i) {
        if (limbs()[i].parent >= 0) {
            joints.emplace_back(links[i], links[std::size_t(limbs()[i].parent)]);
        }
    }
    body.blend_neighbours(joints);
}

}  // namespace character

#endif
