// A character falls on its side down three stairs, as in Fig. 14 of the paper: fifteen rigid bodies of Bullet's on
// cone-twist joints and hinges, one coat that blends at the joints and collides with itself everywhere else.
//
//     bullet_character [folder for pictures]
//
// Exits with 0 when it has touched itself on the way and lies on the stairs at the end. It does not lie quite still: its
// joints are Bullet's, solved apart from the contacts, and each limb's load through them is an estimate.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include <isocoat/isocoat.hpp>
#include <isocoat_bullet.hpp>

#include "../common/picture.h"
#include "character.hpp"
#include "character_bullet.hpp"

int main(int argc, char **argv) {
    try {
        character::fall scene;
        const picture_view view = {{3.2, -5.2, 2.9}, {0.6, 0.0, 0.6}, {0, 0, 1}, 4.2};
        int most = 0, pictures = 0;
        double seconds = 0.0, unrest = 0.0;
        for (int frame = 0; frame < 600; ++frame) {
            const auto begin = std::chrono::steady_clock::now();
            scene.advance();
            seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
            const int now = scene.self_contacts();
            most = std::max(most, now);
            if (frame >= 540) {
                unrest = std::max(unrest, scene.fastest());
            }
            if (argc > 1 && frame % 12 == 0 && frame < 240) {
                const std::string path = std::string(argv[1]) + "/character_" + std::to_string(100 + pictures++) + ".ppm";
                if (picture_write(scene.coats.get(), &view, ~std::uint64_t(0), 480, 360, path.c_str()) != 0) {
                    throw std::runtime_error("cannot write " + path);
                }
            }
            if (frame % 60 == 59) {
                std::printf("%5.1f s   head at %5.2f m   fastest %7.4f m/s   contacts with itself %2d   in all %2d\n",
                            scene.time(), scene.height(2), scene.fastest(), now, scene.contacts());
                std::fflush(stdout);
            }
        }
        std::printf("%d contacts with itself at most; in the last second no limb faster than %.3f m/s; %.1f ms a frame\n", most, unrest,
                    1e3 * seconds / 600);
        return most > 0 && unrest < 0.5 && scene.height(2) < 0.5 && scene.lowest() > 0.0 ? 0 : 1;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
