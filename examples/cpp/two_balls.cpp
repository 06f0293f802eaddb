// The appendix of [97] with the C++ wrapper: the scene of examples/c/two_balls.c and examples/rust/two_balls_plot.rs.
// Prints one apex a line, and exits with 0 when the ball keeps returning to the height it was dropped from.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include <isocoat/isocoat.hpp>

namespace {

isocoat::link add_ball(isocoat::world &world, isocoat_link_kind kind, double mass, double height, double thickness,
                       double radius) {
    isocoat_body_desc body = isocoat_body_desc_default();
    body.stiffness_scale = 1.78e6;

    isocoat_link_desc link_desc = isocoat_link_desc_default();
    link_desc.kind = kind;
    link_desc.mass = mass;
    link_desc.pose.position[2] = height;

    isocoat_skeleton_desc skeleton = isocoat_skeleton_desc_default();
    skeleton.shape = ISOCOAT_SHAPE_POINT;
    skeleton.thickness = thickness;
    skeleton.stiffness = 1.0;
    skeleton.radius = radius;

    isocoat::link link = world.create_body(body).create_link(link_desc);
    link.create_skeleton(skeleton);
    return link;
}

}  // namespace

int main() {
    try {
        isocoat_world_desc settings = isocoat_world_desc_default();
        settings.gravity[2] = -9.8;
        isocoat::world world(settings);
        add_ball(world, ISOCOAT_LINK_FIXED, 0.0, 0.0, 0.3, 1.0);
        const isocoat::link ball = add_ball(world, ISOCOAT_LINK_POINT_MASS, 2.96, 1.0, 0.1, 0.4);

        double before = 0.0, worst = 0.0, peak_force = 0.0;
        int bounces = 0;
        for (int tick = 0; tick < 600; ++tick) {
            world.step(1.0 / 60.0);
            peak_force = std::max(peak_force, ball.wrench().force[2]);
            const isocoat::link_state state = ball.state();
            const double speed = state.linear_velocity[2];
            if (before > 0.0 && speed <= 0.0) {
                const double apex = state.pose.position[2] + speed * speed / (2.0 * 9.8);
                worst = std::max(worst, std::abs(apex - 1.0));
                std::printf("apex %d at %.4f m\n", ++bounces, apex);
            }
            before = speed;
        }
        std::printf("%d bounces, worst apex error %.4f m, peak mean force %.1f N\n", bounces, worst, peak_force);
        return bounces >= 12 && worst < 0.01 && peak_force > 680.0 && peak_force < 750.0 ? 0 : 1;
    } catch (const isocoat::error &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
