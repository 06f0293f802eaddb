/*
 * A picture of a world's coats, for looking at: one ray a pixel, a lamp, a portable pixmap. C99 and C++.
 */
#ifndef PICTURE_H
#define PICTURE_H

#include <isocoat/isocoat.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>

/* Where the camera is, what it looks at, and which way is up; the width of what is seen at the target, in m. */
typedef struct picture_view {
    double eye[3], target[3], up[3], width;
} picture_view;

static void picture_cross(const double a[3], const double b[3], double out[3])
{
    for (int k = 0; k < 3; ++k) {
        const int i = (k + 1) % 3, j = (k + 2) % 3;
        out[k] = a[i] * b[j] - a[j] * b[i];
    }
}

static double picture_dot(const double a[3], const double b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void picture_normalise(double v[3])
{
    const double length = sqrt(picture_dot(v, v));
    for (int k = 0; k < 3; ++k) {
        v[k] /= length;
    }
}

/* A colour for each skeleton, so that limbs are told apart. */
static void picture_colour(uint32_t key, double out[3])
{
    for (int k = 0; k < 3; ++k) {
        key = key * 747796405u + 2891336453u;
        const uint32_t word = ((key >> ((key >> 28) + 4)) ^ key) * 277803737u;
        out[k] = 0.45 + 0.5 * (double)((word >> 22) ^ word) / 4294967295.0;
    }
}

/* Writes a picture of the bodies with a bit of the mask in their category; 0 when all went well. */
static inline int picture_write(const isocoat_world *world, const picture_view *view, uint64_t mask, int width, int height,
                         const char *path)
{
    FILE *file = fopen(path, "wb");
    if (!file) {
        return 1;
    }
    fprintf(file, "P6\n%d %d\n255\n", width, height);
    double forward[3], right[3], up[3], lamp[3] = {0.3, -0.5, 0.8};
    for (int k = 0; k < 3; ++k) {
        forward[k] = view->target[k] - view->eye[k];
    }
    const double distance = sqrt(picture_dot(forward, forward));
    picture_normalise(forward);
    picture_normalise(lamp);
    picture_cross(forward, view->up, right);
    picture_normalise(right);
    picture_cross(right, forward, up);
    int failed = 0;
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x) {
            const double scale = view->width / width;
            const double across = (x + 0.5 - 0.5 * width) * scale, above = (0.5 * height - y - 0.5) * scale;
            double direction[3];
            for (int k = 0; k < 3; ++k) {
                direction[k] = forward[k] * distance + right[k] * across + up[k] * above;
            }
            isocoat_ray_hit hit, between;
            bool found = false, shaded = false;
            double colour[3] = {0.93, 0.95, 0.98};
            failed |= isocoat_world_cast_ray(world, view->eye, direction, INFINITY, mask, &hit, &found) != ISOCOAT_OK;
            if (found) {
                double start[3];
                for (int k = 0; k < 3; ++k) {
                    start[k] = hit.position[k] + 1e-3 * hit.normal[k];
                }
                failed |= isocoat_world_cast_ray(world, start, lamp, INFINITY, mask, &between, &shaded) != ISOCOAT_OK;
                const double light = picture_dot(hit.normal, lamp);
                const double shade = 0.35 + (shaded || light < 0.0 ? 0.0 : 0.6 * light);
                /* What has no skeletons has a colour as a body. */
                picture_colour(hit.skeleton.generation ? hit.skeleton.index : hit.body.index + 100u, colour);
                for (int k = 0; k < 3; ++k) {
                    colour[k] *= shade;
                }
            }
            for (int k = 0; k < 3; ++k) {
                fputc((int)(255.0 * fmin(colour[k], 1.0)), file);
            }
        }
    }
    failed |= fclose(file) != 0;
    return failed;
}

#endif
