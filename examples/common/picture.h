/*
 * A picture of a world's coats, for looking at: a ray a pixel, all in one call, a lamp, a portable pixmap. C99 and C++.
 */
#ifndef PICTURE_H
#define PICTURE_H

#include <isocoat/isocoat.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>

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

typedef struct picture_ray {
    double origin[3], direction[3], length, position[3], normal[3], distance;
    isocoat_body body;
    isocoat_skeleton skeleton;
} picture_ray;

/* What all rays of a picture meet; a distance is infinite where it is nothing. 0 when all went well. */
static inline int picture_cast(const isocoat_world *world, uint64_t mask, isocoat_ray_goal goal, picture_ray *rays,
                               size_t count)
{
    const isocoat_const_buffer origins = {rays->origin, sizeof *rays, ISOCOAT_FORMAT_F64};
    const isocoat_const_buffer directions = {rays->direction, sizeof *rays, ISOCOAT_FORMAT_F64};
    const isocoat_const_buffer lengths = {&rays->length, sizeof *rays, ISOCOAT_FORMAT_F64};
    const isocoat_buffer positions = {rays->position, sizeof *rays, ISOCOAT_FORMAT_F64};
    const isocoat_buffer normals = {rays->normal, sizeof *rays, ISOCOAT_FORMAT_F64};
    const isocoat_buffer distances = {&rays->distance, sizeof *rays, ISOCOAT_FORMAT_F64};
    isocoat_rays_desc desc = isocoat_rays_desc_default();
    isocoat_ray_hits hits = isocoat_ray_hits_default();
    isocoat_body *bodies = (isocoat_body *)malloc(count * sizeof *bodies);
    isocoat_skeleton *skeletons = (isocoat_skeleton *)malloc(count * sizeof *skeletons);
    int failed = !bodies || !skeletons;
    desc.goal = goal;
    desc.mask = mask;
    hits.positions = positions;
    hits.normals = normals;
    hits.distances = distances;
    hits.bodies = bodies;
    hits.skeletons = skeletons;
    failed = failed || isocoat_world_cast_rays(world, &desc, origins, directions, lengths, count, &hits) != ISOCOAT_OK;
    for (size_t k = 0; !failed && k < count; ++k) {
        rays[k].body = bodies[k];
        rays[k].skeleton = skeletons[k];
    }
    free(bodies);
    free(skeletons);
    return failed;
}

/* The rays of a camera, a pixel each, row by row from the top. */
static inline void picture_aim(const picture_view *view, int width, int height, picture_ray *rays)
{
    double forward[3], right[3], up[3];
    for (int k = 0; k < 3; ++k) {
        forward[k] = view->target[k] - view->eye[k];
    }
    const double distance = sqrt(picture_dot(forward, forward)), scale = view->width / width;
    picture_normalise(forward);
    picture_cross(forward, view->up, right);
    picture_normalise(right);
    picture_cross(right, forward, up);
    for (int y = 0; y < height; ++y) {
        for (int x = 0; x < width; ++x, ++rays) {
            const double across = (x + 0.5 - 0.5 * width) * scale, above = (0.5 * height - y - 0.5) * scale;
            for (int k = 0; k < 3; ++k) {
                rays->origin[k] = view->eye[k];
                rays->direction[k] = forward[k] * distance + right[k] * across + up[k] * above;
            }
            rays->length = INFINITY;
        }
    }
}

/* Writes a picture of the bodies with a bit of the mask in their category; 0 when all went well. */
static inline int picture_write(const isocoat_world *world, const picture_view *view, uint64_t mask, int width, int height,
                                const char *path)
{
    const size_t count = (size_t)width * (size_t)height;
    double lamp[3] = {0.3, -0.5, 0.8};
    FILE *file = fopen(path, "wb");
    /* From the eye, and from what it sees to the lamp. */
    picture_ray *seen = (picture_ray *)malloc(count * sizeof *seen);
    picture_ray *lit = (picture_ray *)malloc(count * sizeof *lit);
    int failed = !file || !seen || !lit;
    picture_normalise(lamp);
    if (!failed) {
        picture_aim(view, width, height, seen);
        failed |= picture_cast(world, mask, ISOCOAT_RAY_CLOSEST, seen, count);
    }
    for (size_t pixel = 0; !failed && pixel < count; ++pixel) {
        for (int k = 0; k < 3; ++k) {
            lit[pixel].origin[k] = seen[pixel].position[k] + 1e-3 * seen[pixel].normal[k];
            lit[pixel].direction[k] = lamp[k];
        }
        lit[pixel].length = seen[pixel].body.generation ? INFINITY : 0.0;
    }
    if (!failed) {
        failed |= picture_cast(world, mask, ISOCOAT_RAY_ANY, lit, count);
        failed |= fprintf(file, "P6\n%d %d\n255\n", width, height) < 0;
    }
    for (size_t pixel = 0; !failed && pixel < count; ++pixel) {
        const picture_ray *hit = seen + pixel;
        double colour[3] = {0.93, 0.95, 0.98};
        if (hit->body.generation) {
            const double light = picture_dot(hit->normal, lamp);
            const double shade = 0.35 + (lit[pixel].body.generation || light < 0.0 ? 0.0 : 0.6 * light);
            /* What has no skeletons has a colour as a body. */
            picture_colour(hit->skeleton.generation ? hit->skeleton.index : hit->body.index + 100u, colour);
            for (int k = 0; k < 3; ++k) {
                colour[k] *= shade;
            }
        }
        for (int k = 0; k < 3; ++k) {
            fputc((int)(255.0 * fmin(colour[k], 1.0)), file);
        }
    }
    free(seen);
    free(lit);
    failed |= file && fclose(file) != 0;
    return failed;
}

#endif
