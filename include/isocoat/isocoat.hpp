/*
 * isocoat for C++17: the C API (isocoat.h, where units, ranges and rules stand) with owners, exceptions and ranges.
 *
 * SPDX-License-Identifier: MIT OR Apache-2.0
 *
 *     isocoat::world world;
 *     isocoat::body ball = world.create_body();
 *     isocoat::link link = ball.create_link(link_desc);
 *     link.create_skeleton(skeleton_desc);
 *     world.step(1.0 / 60.0);
 *     for (const isocoat::contact &contact : world.contacts()) { ... }
 *
 * A world owns; body, link, skeleton, spring and skin are values that name something in it, as the C handles do: copying one copies
 * no body, and dropping one destroys nothing. A call that fails throws isocoat::error and has changed nothing.
 */
#ifndef ISOCOAT_HPP
#define ISOCOAT_HPP

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <isocoat/isocoat.h>

namespace isocoat {

using vec3 = std::array<double, 3>;
using mat3 = std::array<double, 9>; /* row by row */

using pose = isocoat_pose;
using wrench = isocoat_wrench;
using link_state = isocoat_link_state;
using spring_state = isocoat_spring_state;
using contact = isocoat_contact;
using event = isocoat_event;
using counters = isocoat_counters;
using times = isocoat_times;
using ray_hit = isocoat_ray_hit;
using surface_point = isocoat_surface_point;
using particle = isocoat_particle; /* a name in its substance */
using piece = isocoat_piece;
using change = isocoat_change;
using mesh_view = isocoat_mesh_view;
using fit_distance = isocoat_fit_distance;

/* The status of a call that failed; what() says what was wrong, with the value and the range. */
class error : public std::runtime_error {
public:
    error(isocoat_status status, const std::string &message) : std::runtime_error(message), status_(status) {}

    isocoat_status status() const noexcept { return status_; }

private:
    isocoat_status status_;
};

/* Throws the last error of this thread unless the status is ISOCOAT_OK. */
inline void check(isocoat_status status)
{
    if (status == ISOCOAT_OK) return;
    std::string message(isocoat_last_error(nullptr, 0), '\0');
    isocoat_last_error(message.data(), message.size() + 1);
    throw error(status, message);
}

/* Throws when the library that runs does not fit the headers. Call it once at the start. */
inline void check_abi() { check(isocoat_check_abi()); }

/* Some elements in a row, not owned; what std::span is from C++20 on. */
template <class T>
class span {
public:
    constexpr span() noexcept = default;
    constexpr span(T *data, std::size_t size) noexcept : data_(data), size_(size) {}
    /* From anything with data() and size(), such as a std::vector or a std::array. */
    template <class C, class = std::enable_if_t<std::is_convertible_v<decltype(std::declval<C &>().data()), T *>>>
    constexpr span(C &&container) noexcept : data_(container.data()), size_(container.size())
    {
    }

    constexpr T *data() const noexcept { return data_; }
    constexpr std::size_t size() const noexcept { return size_; }
    constexpr bool empty() const noexcept { return size_ == 0; }
    constexpr T *begin() const noexcept { return data_; }
    constexpr T *end() const noexcept { return data_ + size_; }
    constexpr T &operator[](std::size_t index) const { return data_[index]; }

private:
    T *data_ = nullptr;
    std::size_t size_ = 0;
};

/* Where a bulk call writes; stride is in bytes, 0 for elements without gaps. A default isocoat_buffer is skipped. */
inline isocoat_buffer buffer(double *data, std::size_t stride = 0) { return {data, stride, ISOCOAT_FORMAT_F64}; }
inline isocoat_buffer buffer(float *data, std::size_t stride = 0) { return {data, stride, ISOCOAT_FORMAT_F32}; }

/* Where a bulk call reads, likewise. */
inline isocoat_const_buffer source(const double *data, std::size_t stride = 0)
{
    return {data, stride, ISOCOAT_FORMAT_F64};
}
inline isocoat_const_buffer source(const float *data, std::size_t stride = 0)
{
    return {data, stride, ISOCOAT_FORMAT_F32};
}

namespace detail {

/* Reads one thing: function(arguments..., &value) as in the C API. */
template <class T, class Function, class... Arguments>
T read(T value, Function function, Arguments... arguments)
{
    check(function(arguments..., &value));
    return value;
}

/* Reads a list whose length only the library knows: get(first, capacity, count) as in the C API. */
template <class T, class Get>
std::vector<T> list(Get get)
{
    std::size_t count = 0;
    check(get(nullptr, std::size_t{0}, &count));
    std::vector<T> items(count);
    if (count > 0) check(get(items.data(), items.size(), &count));
    items.resize(count);
    return items;
}

/* Names the raw handles of a list in their world. */
template <class Named, class Raw>
std::vector<Named> name(isocoat_world *world, const std::vector<Raw> &raw)
{
    std::vector<Named> named;
    named.reserve(raw.size());
    for (const Raw &handle : raw) named.emplace_back(world, handle);
    return named;
}

/* What the nouns share: a world and a handle. */
template <class Raw>
class noun {
public:
    noun() = default;
    noun(isocoat_world *world, Raw raw) noexcept : world_(world), raw_(raw) {}

    /* The handle of the C API. */
    Raw raw() const noexcept { return raw_; }
    explicit operator bool() const noexcept { return raw_.generation != 0; }
    friend bool operator==(const noun &a, const noun &b) noexcept
    {
        return a.world_ == b.world_ && a.raw_.index == b.raw_.index && a.raw_.generation == b.raw_.generation;
    }
    friend bool operator!=(const noun &a, const noun &b) noexcept { return !(a == b); }

protected:
    isocoat_world *world_ = nullptr;
    Raw raw_ = {};
};

} // namespace detail

/* The seeds of a skeleton: one element each in the three. */
struct seed_list {
    std::vector<vec3> positions;
    std::vector<vec3> normals;
    std::vector<std::uint8_t> valid; /* 1 on the surface, 0 where another territory was met */
};

/* The particles of a substance: one element each in the six. */
struct particle_list {
    std::vector<particle> particles;
    std::vector<vec3> positions;
    std::vector<vec3> velocities;
    std::vector<double> volumes;
    std::vector<std::uint32_t> pieces; /* places in substance::pieces() */
    std::vector<std::uint32_t> labels; /* those of one label blend */
};

/* What came off and what began to fuse in a step: a view until the next step or restore. */
struct change_list {
    span<const change> changes;
    const particle *particles = nullptr;

    span<const particle> of(const change &one) const noexcept
    {
        return {particles + one.first_particle, one.particle_count};
    }
};

/* A coat fitted to a mesh: one element each in the two, in the frame of the mesh, and how close it comes. */
struct fitted_coat {
    std::vector<isocoat_skeleton_desc> skeletons;
    std::vector<std::uint32_t> bones;
    fit_distance distance;
};

/* Fits a coat to a closed mesh. Bones and weights: as many of each vertex, in a row; none for one bone alone. */
inline fitted_coat fit_mesh(const isocoat_fit_desc &desc, span<const vec3> vertices,
                            span<const std::array<std::uint32_t, 3>> triangles, span<const std::uint32_t> bones = {},
                            span<const double> weights = {})
{
    const std::size_t influences = bones.empty() || vertices.empty() ? 0 : bones.size() / vertices.size();
    if (weights.size() != bones.size() || influences * vertices.size() != bones.size())
        throw std::invalid_argument("bones and weights must be as many, and as many of each vertex");
    fitted_coat coat;
    /* More than there may be are refused below. */
    const std::size_t capacity = std::min<std::size_t>(desc.count, 4096);
    coat.skeletons.assign(capacity, isocoat_skeleton_desc_default());
    coat.bones.resize(capacity);
    /* There is always a place to point at, so that a count of 0 is refused as what it is. */
    isocoat_skeleton_desc none = isocoat_skeleton_desc_default();
    check(isocoat_fit_mesh(&desc, source(vertices.empty() ? nullptr : vertices.data()->data()), vertices.size(),
                           triangles.empty() ? nullptr : triangles.data()->data(), triangles.size(),
                           bones.empty() ? nullptr : bones.data(), source(weights.data()), influences,
                           coat.skeletons.empty() ? &none : coat.skeletons.data(), coat.bones.data(), capacity,
                           &coat.distance));
    return coat;
}

class link;

/* A mesh of triangles, with the memory that making one takes: used again, it soon asks for no more. Movable, not
 * copyable; it belongs to no world. */
class mesh {
public:
    mesh()
    {
        isocoat_mesh *created = nullptr;
        check(isocoat_mesh_create(&created));
        mesh_.reset(created);
    }

    /* The mesh of the C API; it still belongs to this. */
    isocoat_mesh *get() const noexcept { return mesh_.get(); }

    /* Pointers into it, until it is made again, moved to or destroyed. */
    mesh_view view() const
    {
        mesh_view look{};
        check(isocoat_mesh_get_view(mesh_.get(), &look));
        return look;
    }
    std::vector<vec3> positions() const
    {
        std::vector<vec3> list(view().vertex_count);
        if (!list.empty()) check(isocoat_mesh_copy(get(), buffer_of(list), {}, list.size(), nullptr, 0));
        return list;
    }
    std::vector<vec3> normals() const
    {
        std::vector<vec3> list(view().vertex_count);
        if (!list.empty()) check(isocoat_mesh_copy(get(), {}, buffer_of(list), list.size(), nullptr, 0));
        return list;
    }
    std::vector<std::array<std::uint32_t, 3>> triangles() const
    {
        std::vector<std::array<std::uint32_t, 3>> list(view().triangle_count);
        if (!list.empty()) check(isocoat_mesh_copy(get(), {}, {}, 0, list.front().data(), list.size()));
        return list;
    }
    /* Of each vertex the four skeletons whose fields are the strongest, null where there are fewer, and their weights;
     * of a mesh made with ISOCOAT_MESH_WEIGHTS, else none. */
    std::vector<std::array<isocoat_skeleton, 4>> strongest() const
    {
        return fours(view().vertex_count, weights_view().first);
    }
    std::vector<std::array<double, 4>> weights() const { return fours(view().vertex_count, weights_view().second); }
    /* The pressure of contacts on each vertex, in Pa; of a mesh made with ISOCOAT_MESH_PRESSURES, else none. */
    std::vector<double> pressures() const
    {
        const double *first = nullptr;
        check(isocoat_mesh_get_pressures(get(), &first));
        return first ? std::vector<double>(first, first + view().vertex_count) : std::vector<double>();
    }

private:
    std::pair<const isocoat_skeleton *, const double *> weights_view() const
    {
        std::pair<const isocoat_skeleton *, const double *> look{};
        check(isocoat_mesh_get_weights(get(), &look.first, &look.second));
        return look;
    }
    template <class T> static std::vector<std::array<T, 4>> fours(std::size_t count, const T *first)
    {
        std::vector<std::array<T, 4>> list(first ? count : 0);
        for (std::size_t at = 0; at < list.size(); ++at) std::copy_n(first + 4 * at, 4, list[at].begin());
        return list;
    }

    struct destroyer {
        void operator()(isocoat_mesh *raw) const noexcept { isocoat_mesh_destroy(raw); }
    };

    static isocoat_buffer buffer_of(std::vector<vec3> &list) { return {list.data(), 0, ISOCOAT_FORMAT_F64}; }

    std::unique_ptr<isocoat_mesh, destroyer> mesh_;
};

/* A primitive fixed in a link's frame, and the field it emits. */
class skeleton : public detail::noun<isocoat_skeleton> {
public:
    using noun::noun;

    void destroy() { check(isocoat_skeleton_destroy(world_, raw_)); }
    isocoat_skeleton_desc desc() const
    {
        return detail::read(isocoat_skeleton_desc_default(), isocoat_skeleton_get_desc, world_, raw_);
    }
    void set_desc(const isocoat_skeleton_desc &desc) { check(isocoat_skeleton_set_desc(world_, raw_, &desc)); }
    bool is_enabled() const { return detail::read(false, isocoat_skeleton_is_enabled, world_, raw_); }
    void set_enabled(bool enabled) { check(isocoat_skeleton_set_enabled(world_, raw_, enabled)); }
    void *user_data() const { return detail::read<void *>(nullptr, isocoat_skeleton_get_user_data, world_, raw_); }
    /* The link that carries it. */
    link parent() const;
    /* How much it blends with another skeleton of its body. */
    double blend(const skeleton &other) const
    {
        return detail::read(0.0, isocoat_skeleton_get_blend, world_, raw_, other.raw_);
    }
    void set_blend(const skeleton &other, double weight, double duration = 0.0)
    {
        check(isocoat_skeleton_set_blend(world_, raw_, other.raw_, weight, duration));
    }
    /* Whether it may collide with another skeleton of its body. */
    void set_pair_contact(const skeleton &other, bool enabled)
    {
        check(isocoat_skeleton_set_pair_contact(world_, raw_, other.raw_, enabled));
    }
    /* Volume of its territory, what volume control aims at, and how far it has moved the surface outwards. */
    double volume() const { return detail::read(0.0, isocoat_skeleton_get_volume, world_, raw_); }
    double target_volume() const { return detail::read(0.0, isocoat_skeleton_get_target_volume, world_, raw_); }
    void set_target_volume(double target) { check(isocoat_skeleton_set_target_volume(world_, raw_, target)); }
    double offset() const { return detail::read(0.0, isocoat_skeleton_get_offset, world_, raw_); }
    /* A mesh of its territory from its seeds, in place of what the mesh was. */
    void make_mesh(mesh &out, isocoat_territory_style style = ISOCOAT_TERRITORY_PATCHES) const
    {
        check(isocoat_skeleton_make_mesh(world_, raw_, style, out.get()));
    }
    seed_list seeds() const
    {
        std::size_t count = 0;
        check(isocoat_skeleton_get_seeds(world_, raw_, {}, {}, nullptr, 0, &count));
        seed_list list{std::vector<vec3>(count), std::vector<vec3>(count), std::vector<std::uint8_t>(count)};
        if (count > 0) {
            check(isocoat_skeleton_get_seeds(world_, raw_, buffer(list.positions.front().data()),
                                             buffer(list.normals.front().data()), list.valid.data(), count, &count));
        }
        return list;
    }
};

class body;

/* One moving frame of a body. */
class link : public detail::noun<isocoat_link> {
public:
    using noun::noun;

    void destroy() { check(isocoat_link_destroy(world_, raw_)); }
    isocoat_link_desc desc() const
    {
        return detail::read(isocoat_link_desc_default(), isocoat_link_get_desc, world_, raw_);
    }
    void set_desc(const isocoat_link_desc &desc) { check(isocoat_link_set_desc(world_, raw_, &desc)); }
    bool is_enabled() const { return detail::read(false, isocoat_link_is_enabled, world_, raw_); }
    void set_enabled(bool enabled) { check(isocoat_link_set_enabled(world_, raw_, enabled)); }
    void *user_data() const { return detail::read<void *>(nullptr, isocoat_link_get_user_data, world_, raw_); }
    /* The body it belongs to. */
    body parent() const;
    skeleton create_skeleton(const isocoat_skeleton_desc &desc)
    {
        return {world_, detail::read(isocoat_skeleton{}, isocoat_skeleton_create, world_, raw_, &desc)};
    }
    /* All of them, or none if one is refused; in the frame of the link. */
    std::vector<skeleton> create_skeletons(span<const isocoat_skeleton_desc> descs)
    {
        std::vector<isocoat_skeleton> made(descs.size());
        check(isocoat_skeleton_create_many(world_, &raw_, 1, descs.data(), nullptr, descs.size(), nullptr,
                                           made.data()));
        return detail::name<skeleton>(world_, made);
    }
    std::vector<skeleton> skeletons() const
    {
        return detail::name<skeleton>(world_, detail::list<isocoat_skeleton>([this](auto... list) {
            return isocoat_link_get_skeletons(world_, raw_, list...);
        }));
    }

    link_state state() const { return detail::read(link_state{}, isocoat_link_get_state, world_, raw_); }
    void set_state(const link_state &state) { check(isocoat_link_set_state(world_, raw_, &state)); }
    void teleport(const link_state &state) { check(isocoat_link_teleport(world_, raw_, &state)); }
    /* Mean contact force and torque over the last step. */
    isocoat::wrench wrench() const { return detail::read(isocoat::wrench{}, isocoat_link_get_wrench, world_, raw_); }
    /* What the host is to apply to a host-driven link before it advances it. */
    isocoat::wrench impulse() const
    {
        return detail::read(isocoat::wrench{}, isocoat_link_get_impulse, world_, raw_);
    }
    /* At the centre of mass, or at a point of the world. */
    void apply_force(const vec3 &force) { check(isocoat_link_apply_force(world_, raw_, force.data(), nullptr)); }
    void apply_force(const vec3 &force, const vec3 &point)
    {
        check(isocoat_link_apply_force(world_, raw_, force.data(), point.data()));
    }
    void apply_torque(const vec3 &torque) { check(isocoat_link_apply_torque(world_, raw_, torque.data())); }
    void apply_impulse(const vec3 &impulse)
    {
        check(isocoat_link_apply_impulse(world_, raw_, impulse.data(), nullptr));
    }
    void apply_impulse(const vec3 &impulse, const vec3 &point)
    {
        check(isocoat_link_apply_impulse(world_, raw_, impulse.data(), point.data()));
    }
    void apply_angular_impulse(const vec3 &impulse)
    {
        check(isocoat_link_apply_angular_impulse(world_, raw_, impulse.data()));
    }
    void set_constrained(bool constrained) {
        check(isocoat_link_set_constrained(world_, raw_, constrained ? 1 : 0));
    }
    void set_external_acceleration(const vec3 &linear, const vec3 &angular)
    {
        check(isocoat_link_set_external_acceleration(world_, raw_, linear.data(), angular.data()));
    }
};

/* A damped spring between two links of one body. */
class spring : public detail::noun<isocoat_spring> {
public:
    using noun::noun;

    void destroy() { check(isocoat_spring_destroy(world_, raw_)); }
    isocoat_spring_desc desc() const
    {
        return detail::read(isocoat_spring_desc_default(), isocoat_spring_get_desc, world_, raw_);
    }
    void set_desc(const isocoat_spring_desc &desc) { check(isocoat_spring_set_desc(world_, raw_, &desc)); }
    void *user_data() const { return detail::read<void *>(nullptr, isocoat_spring_get_user_data, world_, raw_); }
    /* Length, tension and energy at the present poses and velocities of its links. */
    spring_state state() const { return detail::read(spring_state{}, isocoat_spring_get_state, world_, raw_); }
};

/* A mesh of the host that a body's coat carries; made by body::create_skin. */
class skin : public detail::noun<isocoat_skin> {
public:
    using noun::noun;

    void destroy() { check(isocoat_skin_destroy(world_, raw_)); }
    /* The body that it was bound to. */
    body parent() const;
    std::size_t vertex_count() const
    {
        return detail::read(std::size_t{0}, isocoat_skin_get_vertex_count, world_, raw_);
    }
    /* The links that a vertex follows with their weights, the heaviest first. */
    std::vector<std::pair<link, double>> weights(std::size_t vertex) const
    {
        std::size_t count = 0;
        check(isocoat_skin_get_weights(world_, raw_, vertex, nullptr, nullptr, 0, &count));
        std::vector<isocoat_link> links(count);
        std::vector<double> weights(count);
        check(isocoat_skin_get_weights(world_, raw_, vertex, links.data(), weights.data(), count, &count));
        std::vector<std::pair<link, double>> pairs;
        for (std::size_t k = 0; k < count; ++k) pairs.emplace_back(link(world_, links[k]), weights[k]);
        return pairs;
    }
    /* Where the vertices are now, into the host's own, of which there are vertex_count. */
    void deform(isocoat_buffer positions, isocoat_buffer normals, std::size_t vertex_count,
                isocoat_deformation deformation = ISOCOAT_DEFORMATION_NONE) const
    {
        check(isocoat_skin_deform(world_, raw_, deformation, positions, normals, vertex_count));
    }
    std::vector<vec3> positions(isocoat_deformation deformation = ISOCOAT_DEFORMATION_NONE) const
    {
        std::vector<vec3> list(vertex_count());
        if (!list.empty()) deform(buffer(list.front().data()), {}, list.size(), deformation);
        return list;
    }
};

class substance;

/* One deformable or rigid object: a base of links, or of particles, and a coat. */
class body : public detail::noun<isocoat_body> {
public:
    using noun::noun;

    void destroy() { check(isocoat_body_destroy(world_, raw_)); }
    isocoat_body_desc desc() const
    {
        return detail::read(isocoat_body_desc_default(), isocoat_body_get_desc, world_, raw_);
    }
    void set_desc(const isocoat_body_desc &desc) { check(isocoat_body_set_desc(world_, raw_, &desc)); }
    bool is_enabled() const { return detail::read(false, isocoat_body_is_enabled, world_, raw_); }
    void set_enabled(bool enabled) { check(isocoat_body_set_enabled(world_, raw_, enabled)); }
    bool is_awake() const { return detail::read(false, isocoat_body_is_awake, world_, raw_); }
    void wake() { check(isocoat_body_wake(world_, raw_)); }
    void *user_data() const { return detail::read<void *>(nullptr, isocoat_body_get_user_data, world_, raw_); }
    /* Volume of its solid, also without volume control. */
    double volume() const { return detail::read(0.0, isocoat_body_get_volume, world_, raw_); }
    link create_link(const isocoat_link_desc &desc)
    {
        return {world_, detail::read(isocoat_link{}, isocoat_link_create, world_, raw_, &desc)};
    }
    std::vector<link> links() const
    {
        return detail::name<link>(world_, detail::list<isocoat_link>([this](auto... list) {
            return isocoat_body_get_links(world_, raw_, list...);
        }));
    }
    std::vector<spring> springs() const
    {
        return detail::name<spring>(world_, detail::list<isocoat_spring>([this](auto... list) {
            return isocoat_body_get_springs(world_, raw_, list...);
        }));
    }

    /* Gives it particles in place of links, for good. */
    substance make_substance(const isocoat_substance_desc &desc = isocoat_substance_desc_default());

    /* Lets exactly those skeletons blend that are of the same link, or of two links that are joined. */
    void blend_neighbours(span<const std::pair<link, link>> joints)
    {
        std::vector<isocoat_link> raw;
        for (const auto &joint : joints) {
            raw.push_back(joint.first.raw());
            raw.push_back(joint.second.raw());
        }
        check(isocoat_body_blend_neighbours(world_, raw_, raw.data(), joints.size()));
    }
    void blend_all() { check(isocoat_body_blend_all(world_, raw_)); }

    /* The field at many points; values and gradients are as long as points, or empty when not wanted. */
    void evaluate_field(span<const vec3> points, span<double> values, span<vec3> gradients = {},
                        isocoat_deformation deformation = ISOCOAT_DEFORMATION_NONE) const
    {
        if ((!values.empty() && values.size() != points.size()) ||
            (!gradients.empty() && gradients.size() != points.size()))
            throw error(ISOCOAT_ERROR_INVALID_ARGUMENT, "values and gradients must be as long as points, or empty");
        check(isocoat_body_evaluate_field_deformed(
            world_, raw_, deformation, points.empty() ? nullptr : points.data()->data(), points.size(), values.data(),
            gradients.empty() ? nullptr : gradients.data()->data()));
    }
    /* The field at one point. */
    double field(const vec3 &point, isocoat_deformation deformation = ISOCOAT_DEFORMATION_NONE) const
    {
        double value = 0.0;
        check(isocoat_body_evaluate_field_deformed(world_, raw_, deformation, point.data(), 1, &value, nullptr));
        return value;
    }
    /* The closest point of the surface; none for a body without enabled skeletons. */
    std::optional<surface_point> closest_point(const vec3 &point,
                                               isocoat_deformation deformation = ISOCOAT_DEFORMATION_NONE) const
    {
        surface_point closest{};
        bool found = false;
        check(isocoat_body_closest_point_deformed(world_, raw_, point.data(), deformation, &closest, &found));
        return found ? std::optional<surface_point>(closest) : std::nullopt;
    }
    /* A watertight mesh of its surface with cells of this edge, in place of what the mesh was; attributes:
     * ISOCOAT_MESH_ flags, added up. */
    void make_mesh(mesh &out, double cell_size, isocoat_deformation deformation = ISOCOAT_DEFORMATION_NONE,
                   isocoat_mesh_attributes attributes = 0) const
    {
        isocoat_mesh_desc desc = isocoat_mesh_desc_default();
        desc.cell_size = cell_size;
        desc.deformation = deformation;
        desc.attributes = attributes;
        check(isocoat_body_make_mesh(world_, raw_, &desc, out.get()));
    }
    /* The skeletons of a fitted coat, each on the link of its bone; frame: the mesh's in the world, with the links where
       they are now. */
    std::vector<skeleton> create_fitted(const fitted_coat &coat, span<const link> links, const isocoat::pose &frame)
    {
        std::vector<isocoat_link> raw;
        for (const link &each : links) raw.push_back(each.raw());
        std::vector<isocoat_skeleton> made(coat.skeletons.size());
        check(isocoat_skeleton_create_many(world_, raw.data(), raw.size(), coat.skeletons.data(), coat.bones.data(),
                                           made.size(), &frame, made.data()));
        return detail::name<skeleton>(world_, made);
    }
    /* Binds a mesh of the host to it, at the present poses; without normals it has the coat's. */
    skin create_skin(isocoat_const_buffer vertices, isocoat_const_buffer normals, std::size_t count)
    {
        return {world_, detail::read(isocoat_skin{}, isocoat_skin_create, world_, raw_, vertices, normals, count)};
    }
    skin create_skin(span<const vec3> vertices, span<const vec3> normals = {})
    {
        if (!normals.empty() && normals.size() != vertices.size())
            throw error(ISOCOAT_ERROR_INVALID_ARGUMENT, "normals must be as many as vertices, or none");
        return create_skin(source(vertices.empty() ? nullptr : vertices.data()->data()),
                           source(normals.empty() ? nullptr : normals.data()->data()), vertices.size());
    }
};

/* A body that is a substance: clay, dough, mud. Made by body::make_substance; of any other body its calls throw. */
class substance : public body {
public:
    using body::body;
    explicit substance(const body &made) noexcept : body(made) {}

    isocoat_substance_desc substance_desc() const
    {
        return detail::read(isocoat_substance_desc_default(), isocoat_substance_get_desc, world_, raw_);
    }
    void set_substance_desc(const isocoat_substance_desc &desc)
    {
        check(isocoat_substance_set_desc(world_, raw_, &desc));
    }

    /* Adds particles that blend with each other: all, or none if one is refused. Without velocities they rest. */
    std::vector<particle> add(span<const vec3> positions, span<const vec3> velocities = {})
    {
        same_length(positions.size(), velocities, "velocities must be as long as positions, or empty");
        std::vector<particle> made(positions.size());
        check(isocoat_substance_add_particles(world_, raw_, numbers(positions), numbers(velocities), positions.size(),
                                              made.data()));
        return made;
    }
    /* Fill a shape with particles at rest, and say how many it took. */
    std::size_t fill_box(const vec3 &low, const vec3 &high)
    {
        return detail::read(std::size_t{0}, isocoat_substance_fill_box, world_, raw_, low.data(), high.data());
    }
    std::size_t fill_ball(const vec3 &center, double radius)
    {
        return detail::read(std::size_t{0}, isocoat_substance_fill_ball, world_, raw_, center.data(), radius);
    }
    std::size_t fill_mesh(span<const vec3> vertices, span<const std::array<std::uint32_t, 3>> triangles)
    {
        return detail::read(std::size_t{0}, isocoat_substance_fill_mesh, world_, raw_, numbers(vertices),
                            vertices.size(), triangles.empty() ? nullptr : triangles.data()->data(), triangles.size());
    }
    void remove(span<const particle> particles)
    {
        check(isocoat_substance_remove_particles(world_, raw_, particles.data(), particles.size()));
    }

    std::size_t particle_count() const
    {
        return detail::read(std::size_t{0}, isocoat_substance_get_particle_count, world_, raw_);
    }
    /* All that can be said of its particles. */
    particle_list particles() const
    {
        const std::size_t count = particle_count();
        particle_list list;
        list.particles.resize(count);
        list.positions.resize(count);
        list.velocities.resize(count);
        list.volumes.resize(count);
        list.pieces.resize(count);
        list.labels.resize(count);
        if (count > 0) {
            get_particles(list.particles.data(), buffer(list.positions.front().data()),
                          buffer(list.velocities.front().data()), list.volumes.data(), list.pieces.data(),
                          list.labels.data(), count);
        }
        return list;
    }
    /* Into the host's own memory, with room for `capacity` particles in each that is wanted. */
    std::size_t get_particles(particle *particles, isocoat_buffer positions, isocoat_buffer velocities, double *volumes,
                              std::uint32_t *pieces, std::uint32_t *labels, std::size_t capacity) const
    {
        std::size_t count = 0;
        check(isocoat_substance_get_particles(world_, raw_, particles, positions, velocities, volumes, pieces, labels,
                                              capacity, &count));
        return count;
    }
    /* Positions, velocities, or both; what is empty stays as it is. */
    void set_particles(span<const particle> particles, span<const vec3> positions, span<const vec3> velocities = {})
    {
        same_length(particles.size(), positions, "positions must be as long as particles, or empty");
        same_length(particles.size(), velocities, "velocities must be as long as particles, or empty");
        check(isocoat_substance_set_particles(world_, raw_, particles.data(), numbers(positions), numbers(velocities),
                                              particles.size()));
    }
    /* Pulls at particles throughout the next step. */
    void add_forces(span<const particle> particles, span<const vec3> forces)
    {
        if (particles.size() != forces.size())
            throw error(ISOCOAT_ERROR_INVALID_ARGUMENT, "forces must be as long as particles");
        check(isocoat_substance_add_forces(world_, raw_, particles.data(), numbers(forces), particles.size()));
    }

    /* What hung together at the last step, and the particles of one of these. */
    std::vector<piece> pieces() const
    {
        return detail::list<piece>([this](auto... list) {
            return isocoat_substance_get_pieces(world_, raw_, list...);
        });
    }
    std::vector<particle> piece_particles(std::size_t index) const
    {
        return detail::list<particle>([this, index](auto... list) {
            return isocoat_substance_get_piece_particles(world_, raw_, index, list...);
        });
    }

private:
    static const double *numbers(span<const vec3> elements)
    {
        return elements.empty() ? nullptr : elements.data()->data();
    }
    static void same_length(std::size_t size, span<const vec3> elements, const char *message)
    {
        if (!elements.empty() && elements.size() != size) throw error(ISOCOAT_ERROR_INVALID_ARGUMENT, message);
    }
};

inline substance body::make_substance(const isocoat_substance_desc &desc)
{
    check(isocoat_body_make_substance(world_, raw_, &desc));
    return substance(*this);
}

inline link skeleton::parent() const
{
    return {world_, detail::read(isocoat_link{}, isocoat_skeleton_get_link, world_, raw_)};
}

inline body skin::parent() const
{
    return {world_, detail::read(isocoat_body{}, isocoat_skin_get_body, world_, raw_)};
}

inline body link::parent() const
{
    return {world_, detail::read(isocoat_body{}, isocoat_link_get_body, world_, raw_)};
}

/* Owns everything. Movable, not copyable; bodies, links, skeletons and springs stay valid when their
 * world is moved. */
class world {
public:
    using log_function = std::function<void(isocoat_log_level, const char *)>;
    using pair_filter = std::function<bool(isocoat_body, isocoat_body)>;
    using enqueue_function = std::function<void *(isocoat_task_fn run, void *task)>;
    using finish_function = std::function<void(void *handle)>;
    using line_function = std::function<void(const double *a, const double *b, std::uint32_t color)>;
    using point_function = std::function<void(const double *position, double size, std::uint32_t color)>;

    explicit world(const isocoat_world_desc &desc = isocoat_world_desc_default())
    {
        isocoat_world *created = nullptr;
        check(isocoat_world_create(&desc, &created));
        world_.reset(created);
    }

    /* The world of the C API; it still belongs to this. */
    isocoat_world *get() const noexcept { return world_.get(); }

    isocoat_world_desc desc() const
    {
        return detail::read(isocoat_world_desc_default(), isocoat_world_get_desc, get());
    }
    void set_desc(const isocoat_world_desc &desc) { check(isocoat_world_set_desc(get(), &desc)); }

    body create_body(const isocoat_body_desc &desc = isocoat_body_desc_default())
    {
        return {get(), detail::read(isocoat_body{}, isocoat_body_create, get(), &desc)};
    }

    /* A spring between two links of one body, which the descriptor names. */
    spring create_spring(const isocoat_spring_desc &desc)
    {
        return {get(), detail::read(isocoat_spring{}, isocoat_spring_create, get(), &desc)};
    }
    /* Many of them: all, or none if one is refused. */
    std::vector<spring> create_springs(span<const isocoat_spring_desc> descs)
    {
        std::vector<isocoat_spring> made(descs.size());
        check(isocoat_spring_create_many(get(), descs.data(), descs.size(), made.data()));
        return detail::name<spring>(get(), made);
    }

    /* All bodies, in the order of their slots. */
    std::vector<body> bodies() const
    {
        return detail::name<body>(get(), detail::list<isocoat_body>([this](auto... list) {
            return isocoat_world_get_bodies(get(), list...);
        }));
    }

    /* Takes a snapshot into a buffer, whose room is used again; the functions set above are no part of it. */
    void snapshot(std::vector<std::uint8_t> &buffer) const
    {
        std::size_t size = 0;
        check(isocoat_world_snapshot(get(), nullptr, 0, &size));
        buffer.resize(size);
        check(isocoat_world_snapshot(get(), buffer.data(), buffer.size(), &size));
    }
    std::vector<std::uint8_t> snapshot() const
    {
        std::vector<std::uint8_t> buffer;
        snapshot(buffer);
        return buffer;
    }
    /* Goes back to a snapshot. In any world but the one that took it, all handles given out so far become invalid. */
    void restore(span<const std::uint8_t> buffer)
    {
        check(isocoat_world_restore(get(), buffer.data(), buffer.size()));
    }

    /* Advances by dt seconds. What a callback throws comes out of here, after the step has ended. */
    void step(double dt)
    {
        const isocoat_status status = isocoat_world_step(get(), dt);
        if (callbacks_) callbacks_->rethrow();
        check(status);
    }

    /* Contacts and events of the last step: views until the next step or restore. */
    span<const contact> contacts() const
    {
        const contact *first = nullptr;
        std::size_t count = 0;
        check(isocoat_world_get_contacts(get(), &first, &count));
        return {first, count};
    }
    span<const event> events() const
    {
        const event *first = nullptr;
        std::size_t count = 0;
        check(isocoat_world_get_events(get(), &first, &count));
        return {first, count};
    }
    /* What came off and what began to fuse in the last step, in all substances: likewise. */
    change_list substance_changes() const
    {
        const change *first = nullptr;
        std::size_t count = 0;
        change_list list;
        check(isocoat_world_get_substance_changes(get(), &first, &count, &list.particles));
        list.changes = {first, count};
        return list;
    }
    isocoat::counters counters() const
    {
        return detail::read(isocoat_counters_default(), isocoat_world_get_counters, get());
    }
    isocoat::times times() const { return detail::read(isocoat_times_default(), isocoat_world_get_times, get()); }

    /* An empty function takes the callback away. Calls on this world from a callback throw ISOCOAT_ERROR_LOCKED. */
    void set_log(log_function log)
    {
        callbacks &all = keep_callbacks();
        check(isocoat_world_set_log(get(), log ? &callbacks::call_log : nullptr, &all));
        all.log = std::move(log);
    }
    void set_pair_filter(pair_filter filter)
    {
        callbacks &all = keep_callbacks();
        check(isocoat_world_set_pair_filter(get(), filter ? &callbacks::call_filter : nullptr, &all));
        all.filter = std::move(filter);
    }

    /* Threads that help with the steps: enqueue hands run(task) to one of them and returns what finish waits by, or
     * nullptr. What enqueue throws counts as a refusal; finish must not throw before it has waited. */
    void set_tasks(std::uint32_t worker_count, enqueue_function enqueue, finish_function finish)
    {
        callbacks &all = keep_callbacks();
        check(isocoat_world_set_tasks(get(), worker_count, enqueue ? &callbacks::call_enqueue : nullptr,
                                      finish ? &callbacks::call_finish : nullptr, &all));
        all.enqueue = std::move(enqueue);
        all.finish = std::move(finish);
    }

    /* Bulk calls; links are raw handles, as link::raw() gives them. */
    void set_link_states(span<const isocoat_link> links, span<const link_state> states)
    {
        if (links.size() != states.size())
            throw error(ISOCOAT_ERROR_INVALID_ARGUMENT, "links and states must be of one length");
        check(isocoat_world_set_link_states(get(), links.data(), states.data(), links.size()));
    }
    void get_link_states(span<const isocoat_link> links, isocoat_buffer positions, isocoat_buffer orientations) const
    {
        check(isocoat_world_get_link_states(get(), links.data(), links.size(), positions, orientations));
    }
    void get_link_wrenches(span<const isocoat_link> links, isocoat_buffer forces, isocoat_buffer torques) const
    {
        check(isocoat_world_get_link_wrenches(get(), links.data(), links.size(), forces, torques));
    }
    void get_link_impulses(span<const isocoat_link> links, isocoat_buffer linear, isocoat_buffer angular) const
    {
        check(isocoat_world_get_link_impulses(get(), links.data(), links.size(), linear, angular));
    }
    /* How links on the host's joints move each other, articulation after articulation. */
    void set_articulations(span<const isocoat_link> links, span<const std::size_t> link_counts,
                           span<const double> inverse_inertias)
    {
        std::size_t all = 0, numbers = 0;
        for (const std::size_t count : link_counts) {
            all += count;
            numbers += 36 * count * count;
        }
        if (links.size() != all || inverse_inertias.size() != numbers)
            throw error(ISOCOAT_ERROR_INVALID_ARGUMENT, "links and inverse_inertias must be as long as link_counts say");
        check(isocoat_world_set_articulations(get(), links.data(), link_counts.data(), inverse_inertias.data(),
                                              link_counts.size()));
    }

    /* The contacts that two bodies would have at their present poses. */
    std::vector<contact> collide(const body &a, const body &b, isocoat_scheme scheme = ISOCOAT_SCHEME_AUTO,
                                 double tolerance = 5e-3) const
    {
        return detail::list<contact>([&](auto... list) {
            return isocoat_world_collide(get(), a.raw(), b.raw(), scheme, tolerance, list...);
        });
    }
    std::optional<ray_hit> cast_ray(const vec3 &origin, const vec3 &direction, double max_distance,
                                    std::uint64_t mask = UINT64_MAX,
                                    isocoat_deformation deformation = ISOCOAT_DEFORMATION_NONE) const
    {
        ray_hit hit{};
        bool found = false;
        check(isocoat_world_cast_ray_deformed(get(), origin.data(), direction.data(), max_distance, mask, deformation,
                                              &hit, &found));
        return found ? std::optional<ray_hit>(hit) : std::nullopt;
    }
    /* What many rays meet; the coats are made ready once for all of them. */
    void cast_rays(const isocoat_rays_desc &desc, isocoat_const_buffer origins, isocoat_const_buffer directions,
                   std::size_t count, const isocoat_ray_hits &hits, isocoat_const_buffer max_distances = {}) const
    {
        check(isocoat_world_cast_rays(get(), &desc, origins, directions, max_distances, count, &hits));
    }
    /* The same in a list; a ray that meets nothing has an infinite distance. */
    std::vector<ray_hit> cast_rays(span<const vec3> origins, span<const vec3> directions,
                                   const isocoat_rays_desc &desc = isocoat_rays_desc_default()) const
    {
        if (directions.size() != origins.size())
            throw error(ISOCOAT_ERROR_INVALID_ARGUMENT, "directions must be as many as origins");
        std::vector<ray_hit> list(origins.size());
        if (list.empty()) return list;
        std::vector<isocoat_body> bodies(list.size());
        std::vector<isocoat_link> links(list.size());
        std::vector<isocoat_skeleton> skeletons(list.size());
        isocoat_ray_hits hits = isocoat_ray_hits_default();
        hits.distances = buffer(&list.front().distance, sizeof(ray_hit));
        hits.positions = buffer(list.front().position, sizeof(ray_hit));
        hits.normals = buffer(list.front().normal, sizeof(ray_hit));
        hits.bodies = bodies.data();
        hits.links = links.data();
        hits.skeletons = skeletons.data();
        cast_rays(desc, source(origins.data()->data()), source(directions.data()->data()), list.size(), hits);
        for (std::size_t k = 0; k < list.size(); ++k) {
            list[k].body = bodies[k];
            list[k].link = links[k];
            list[k].skeleton = skeletons[k];
        }
        return list;
    }
    std::vector<body> overlap_sphere(const vec3 &center, double radius, std::uint64_t mask = UINT64_MAX) const
    {
        return detail::name<body>(get(), detail::list<isocoat_body>([&](auto... list) {
            return isocoat_world_overlap_sphere(get(), center.data(), radius, mask, list...);
        }));
    }

    /* Draws into two functions, either of which may be empty. What they throw comes out of here. */
    void debug_draw(isocoat_draw_flags flags, const line_function &line, const point_function &point) const
    {
        drawing sink{line, point, nullptr};
        isocoat_debug_draw draw = isocoat_debug_draw_default();
        draw.flags = flags;
        draw.context = &sink;
        if (line) draw.draw_line = &drawing::call_line;
        if (point) draw.draw_point = &drawing::call_point;
        const isocoat_status status = isocoat_world_debug_draw(get(), &draw);
        if (sink.thrown) std::rethrow_exception(sink.thrown);
        check(status);
    }

private:
    /* Keeps the host's functions at one address, and what they throw out of the library's way. */
    struct callbacks {
        log_function log;
        pair_filter filter;
        enqueue_function enqueue;
        finish_function finish;
        std::exception_ptr thrown;

        static void call_log(void *context, isocoat_log_level level, const char *message)
        {
            callbacks &self = *static_cast<callbacks *>(context);
            try {
                self.log(level, message);
            } catch (...) {
                self.thrown = std::current_exception();
            }
        }
        static bool call_filter(void *context, isocoat_body a, isocoat_body b)
        {
            callbacks &self = *static_cast<callbacks *>(context);
            try {
                return self.filter(a, b);
            } catch (...) {
                self.thrown = std::current_exception();
                return false;
            }
        }
        static void *call_enqueue(void *context, isocoat_task_fn run, void *task)
        {
            callbacks &self = *static_cast<callbacks *>(context);
            try {
                return self.enqueue(run, task);
            } catch (...) {
                self.thrown = std::current_exception();
                return nullptr;
            }
        }
        static void call_finish(void *context, void *handle)
        {
            callbacks &self = *static_cast<callbacks *>(context);
            try {
                self.finish(handle);
            } catch (...) {
                self.thrown = std::current_exception();
            }
        }
        void rethrow()
        {
            if (thrown) std::rethrow_exception(std::exchange(thrown, nullptr));
        }
    };

    struct drawing {
        const line_function &line;
        const point_function &point;
        std::exception_ptr thrown;

        static void call_line(void *context, const double *a, const double *b, std::uint32_t color)
        {
            drawing &self = *static_cast<drawing *>(context);
            try {
                if (!self.thrown) self.line(a, b, color);
            } catch (...) {
                self.thrown = std::current_exception();
            }
        }
        static void call_point(void *context, const double *position, double size, std::uint32_t color)
        {
            drawing &self = *static_cast<drawing *>(context);
            try {
                if (!self.thrown) self.point(position, size, color);
            } catch (...) {
                self.thrown = std::current_exception();
            }
        }
    };

    struct destroyer {
        bool owns;
        destroyer() noexcept : owns(true) {}
        explicit destroyer(bool owner) noexcept : owns(owner) {}
        void operator()(isocoat_world *world) const noexcept
        {
            if (owns) isocoat_world_destroy(world);
        }
    };

    /* A look at a world that a playback owns. */
    friend class playback;
    explicit world(const isocoat_world *shown) : world_(const_cast<isocoat_world *>(shown), destroyer{false}) {}

    callbacks &keep_callbacks()
    {
        if (!callbacks_) callbacks_ = std::make_unique<callbacks>();
        return *callbacks_;
    }

    /* After the callbacks, so that it goes before them. */
    std::unique_ptr<callbacks> callbacks_;
    std::unique_ptr<isocoat_world, destroyer> world_;
};

/* A recording under way. */
class recorder {
public:
    /* Takes the next bytes of a recording; false, or throwing, ends it. */
    using write_function = std::function<bool(span<const std::uint8_t> bytes)>;

    /* In memory. A descriptor's own function is the host's business; prefer the other one. */
    explicit recorder(const isocoat_recorder_desc &desc = isocoat_recorder_desc_default()) { create(desc); }
    /* To a function. */
    explicit recorder(write_function write, isocoat_recorder_desc desc = isocoat_recorder_desc_default())
        : stream_(std::make_unique<stream>())
    {
        stream_->write = std::move(write);
        desc.context = stream_.get();
        desc.write = &stream::call;
        create(desc);
    }

    isocoat_recorder *get() const noexcept { return recorder_.get(); }

    /* Takes a frame at a time in s. What the function throws comes out of here, and of finish. */
    void capture(const world &recorded, double time)
    {
        conclude(isocoat_recorder_capture(get(), recorded.get(), time));
    }
    std::uint32_t frame_count() const { return size().first; }
    std::uint64_t byte_count() const { return size().second; }
    /* Ends a recording to a function. */
    void finish() { conclude(isocoat_recorder_finish(get())); }
    /* The recording in memory so far, whole. */
    std::vector<std::uint8_t> bytes() const
    {
        std::size_t size = 0;
        check(isocoat_recorder_get_bytes(get(), nullptr, 0, &size));
        std::vector<std::uint8_t> bytes(size);
        check(isocoat_recorder_get_bytes(get(), bytes.data(), bytes.size(), &size));
        return bytes;
    }

private:
    struct stream {
        write_function write;
        std::exception_ptr thrown;

        static bool call(void *context, const std::uint8_t *bytes, std::size_t size)
        {
            stream &self = *static_cast<stream *>(context);
            try {
                return self.write({bytes, size});
            } catch (...) {
                self.thrown = std::current_exception();
                return false;
            }
        }
    };
    struct destroyer {
        void operator()(isocoat_recorder *raw) const noexcept { isocoat_recorder_destroy(raw); }
    };

    void create(const isocoat_recorder_desc &desc)
    {
        isocoat_recorder *created = nullptr;
        check(isocoat_recorder_create(&desc, &created));
        recorder_.reset(created);
    }
    void conclude(isocoat_status status)
    {
        if (stream_ && stream_->thrown) std::rethrow_exception(std::exchange(stream_->thrown, nullptr));
        check(status);
    }
    std::pair<std::uint32_t, std::uint64_t> size() const
    {
        std::pair<std::uint32_t, std::uint64_t> size;
        check(isocoat_recorder_get_size(get(), &size.first, &size.second));
        return size;
    }

    /* After the function, so that it goes before it. */
    std::unique_ptr<stream> stream_;
    std::unique_ptr<isocoat_recorder, destroyer> recorder_;
};

/* A recording, and the world that shows one of its frames. */
class playback {
public:
    explicit playback(span<const std::uint8_t> bytes)
    {
        isocoat_playback *created = nullptr;
        check(isocoat_playback_create(bytes.data(), bytes.size(), &created));
        playback_.reset(created);
        const isocoat_world *shown = nullptr;
        check(isocoat_playback_get_world(created, &shown));
        world_.reset(new isocoat::world(shown));
    }

    isocoat_playback *get() const noexcept { return playback_.get(); }

    std::uint32_t frame_count() const
    {
        return detail::read(std::uint32_t{0}, isocoat_playback_get_frame_count, get());
    }
    /* When a frame was taken, in s. */
    double time(std::uint32_t frame) const { return detail::read(0.0, isocoat_playback_get_time, get(), frame); }
    /* Shows a frame. */
    const isocoat::world &seek(std::uint32_t frame)
    {
        check(isocoat_playback_seek(get(), frame));
        return world();
    }
    /* What shows it: it answers every question, refuses every change, and lives as long as the playback. */
    const isocoat::world &world() const noexcept { return *world_; }

private:
    struct destroyer {
        void operator()(isocoat_playback *raw) const noexcept { isocoat_playback_destroy(raw); }
    };

    std::unique_ptr<isocoat_playback, destroyer> playback_;
    std::unique_ptr<isocoat::world> world_;
};

/* Inertia tensors of solids about their centres; see the C functions. */
inline mat3 inertia_of_sphere(double mass, double radius)
{
    mat3 inertia;
    check(isocoat_inertia_of_sphere(mass, radius, inertia.data()));
    return inertia;
}
inline mat3 inertia_of_box(double mass, const vec3 &half_extents)
{
    mat3 inertia;
    check(isocoat_inertia_of_box(mass, half_extents.data(), inertia.data()));
    return inertia;
}
inline mat3 inertia_of_capsule(double mass, double radius, double half_length)
{
    mat3 inertia;
    check(isocoat_inertia_of_capsule(mass, radius, half_length, inertia.data()));
    return inertia;
}

} // namespace isocoat

#endif /* ISOCOAT_HPP */
