// A character falls on its side down three stairs, as in Fig. 14 of the paper: fifteen rigid bodies of Bullet's on
// cone-twist joints and hinges, one coat that blends at the joints and collides with itself everywhere else.
//
//     bullet_character [folder for pictures | --push NUMBER] [--record FILE]
//
// Exits with 0 when it has touched itself on the way and lies on the stairs at the end. Whether it lies quite still depends
// on how it comes to lie, and that on the push, 40 N s by default. The limits of its joints are Bullet's, solved apart from
// the contacts, and what they bear is an estimate: so limbs that friction holds just so slip now and then. Of the pushes
// from 30 to 45 all but three (30, 35, 38) leave it within 1 mm and below 1 mm/s in the last 20 s, and those within 3 mm and
// 4 mm/s.
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
#include "../common/record.h"
#include "character.hpp"
#include "character_bullet.hpp"

/// How long it takes all in all, and when it counts as settled [frames of 1/60 s].
constexpr int frames = 1800, settled = 600;

int main(int argc, char **argv) {
    try {
        recording film;
        if (record_begin(&film, record_argument(&argc, argv))) throw std::runtime_error("cannot record");
        const bool chosen = argc > 2 && std::string(argv[1]) == "--push";
        character::fall scene(chosen ? std::stod(argv[2]) : 40.0);
        isocoat_times spent{};
        const picture_view view = {{3.2, -5.2, 2.9}, {0.6, 0.0, 0.6}, {0, 0, 1}, 4.2};
        int most = 0, pictures = 0;
        double seconds = 0.0, unrest = 0.0, drift = 0.0;
        std::vector<btVector3> rest;
        for (int frame = 0; frame < frames; ++frame) {
            const auto begin = std::chrono::steady_clock::now();
            scene.advance();
            seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
            if (frame < settled && record_frame(&film, scene.coats.get(), scene.time())) {
                throw std::runtime_error("cannot record");
            }
            const isocoat_times times = scene.coats.times();
            if (frame >= settled) {
                spent.step += times.step;
                spent.contact += times.contact;
                spent.solve += times.solve;
            }
            const int now = scene.self_contacts();
            most = std::max(most, now);
            for (std::size_t limb = 0; frame == settled && limb < scene.size(); ++limb) {
                rest.push_back(scene.position(limb));
            }
            for (std::size_t limb = 0; limb < rest.size(); ++limb) {
                drift = std::max(drift, double((scene.position(limb) - rest[limb]).length()));
                unrest = std::max(unrest, scene.fastest());
            }
            if (argc > 1 && !chosen && frame % 12 == 0 && frame < 240) {
                const std::string path = std::string(argv[1]) + "/character_" + std::to_string(100 + pictures++) + ".ppm";
                if (picture_write(scene.coats.get(), &view, ~std::uint64_t(0), 480, 360, path.c_str()) != 0) {
                    throw std::runtime_error("cannot write " + path);
                }
            }
            if (frame % 60 == 59 && (frame < settled || frame % 600 == 599)) {
                std::printf("%5.1f s   head at %5.2f m   fastest %7.4f m/s   contacts with itself %2d   in all %2d\n",
                            scene.time(), scene.height(2), scene.fastest(), now, scene.contacts());
                std::fflush(stdout);
            }
        }
        if (record_end(&film)) throw std::runtime_error("cannot record");
        std::printf("%d contacts with itself at most; in the last %d s no limb faster than %.1f mm/s, none farther than "
                    "%.2f mm from where it was; %.1f ms a frame\n",
                    most, (frames - settled) / 60, 1e3 * unrest, 1e3 * drift, 1e3 * seconds / frames);
        const double rested = 1e3 / (frames - settled);
        std::printf("at rest, a step of isocoat's takes %.2f ms: %.2f of them for contact surfaces, %.2f to solve\n",
                    rested * spent.step, rested * spent.contact, rested * spent.solve);
        return most > 0 && unrest < 0.005 && drift < 0.005 && scene.height(2) < 0.5 && scene.lowest() > 0.0 ? 0 : 1;
    } catch (const std::exception &error) {
        std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
