/*
 * A picture of meshes, for looking at: triangles into a depth buffer, a lamp, edges drawn darker, a portable pixmap.
 * C99 and C++.
 */
#ifndef RASTER_H
#define RASTER_H

#include "picture.h"

#include <stdlib.h>

typedef struct raster {
    picture_view view;
    double forward[3], right[3], up[3], distance;
    int width, height;
    float *depth;
    unsigned char *pixels;
} raster;

/* An empty picture; 0 when all went well. Ends with raster_write. */
static int raster_begin(raster *it, const picture_view *view, int width, int height)
{
    it->view = *view;
    it->width = width;
    it->height = height;
    for (int k = 0; k < 3; ++k) {
        it->forward[k] = view->target[k] - view->eye[k];
    }
    it->distance = sqrt(picture_dot(it->forward, it->forward));
    picture_normalise(it->forward);
    picture_cross(it->forward, view->up, it->right);
    picture_normalise(it->right);
    picture_cross(it->right, it->forward, it->up);
    const size_t count = (size_t)width * (size_t)height;
    it->depth = (float *)malloc(count * sizeof *it->depth);
    it->pixels = (unsigned char *)malloc(3 * count);
    if (!it->depth || !it->pixels) {
        return 1;
    }
    for (size_t pixel = 0; pixel < count; ++pixel) {
        it->depth[pixel] = INFINITY;
        it->pixels[3 * pixel] = it->pixels[3 * pixel + 1] = 242;
        it->pixels[3 * pixel + 2] = 250;
    }
    return 0;
}

/* Where a point is in the picture: x and y in pixels, and its distance along the view. */
static void raster_project(const raster *it, const double *p, double out[3])
{
    double offset[3];
    for (int k = 0; k < 3; ++k) {
        offset[k] = p[k] - it->view.eye[k];
    }
    const double depth = picture_dot(offset, it->forward), scale = it->width / it->view.width * it->distance / depth;
    out[0] = 0.5 * it->width + picture_dot(offset, it->right) * scale;
    out[1] = 0.5 * it->height - picture_dot(offset, it->up) * scale;
    out[2] = depth;
}

static double raster_side(const double *a, const double *b, double x, double y)
{
    return (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0]);
}

static void raster_triangle(raster *it, const isocoat_mesh_view *mesh, const uint32_t *corners, const double colour[3],
                            int edges)
{
    double at[3][3], lamp[3] = {0.3, -0.5, 0.8};
    picture_normalise(lamp);
    for (int k = 0; k < 3; ++k) {
        raster_project(it, mesh->positions + 3 * corners[k], at[k]);
    }
    const double area = raster_side(at[0], at[1], at[2][0], at[2][1]);
    /* Seen from behind, or edge on. */
    if (!(area < 0.0)) {
        return;
    }
    const int low_x = (int)fmax(0.0, floor(fmin(fmin(at[0][0], at[1][0]), at[2][0])));
    const int low_y = (int)fmax(0.0, floor(fmin(fmin(at[0][1], at[1][1]), at[2][1])));
    const int high_x = (int)fmin(it->width - 1.0, ceil(fmax(fmax(at[0][0], at[1][0]), at[2][0])));
    const int high_y = (int)fmin(it->height - 1.0, ceil(fmax(fmax(at[0][1], at[1][1]), at[2][1])));
    for (int y = low_y; y <= high_y; ++y) {
        for (int x = low_x; x <= high_x; ++x) {
            double part[3], depth = 0.0, normal[3] = {0.0, 0.0, 0.0}, nearest = INFINITY;
            for (int k = 0; k < 3; ++k) {
                const double *a = at[(k + 1) % 3], *b = at[(k + 2) % 3];
                const double side = raster_side(a, b, x + 0.5, y + 0.5);
                part[k] = side / area;
                nearest = fmin(nearest, -side / hypot(b[0] - a[0], b[1] - a[1]));
                depth += part[k] * at[k][2];
                for (int j = 0; j < 3; ++j) {
                    normal[j] += part[k] * mesh->normals[3 * corners[k] + (uint32_t)j];
                }
            }
            const size_t pixel = (size_t)y * (size_t)it->width + (size_t)x;
            if (part[0] < 0.0 || part[1] < 0.0 || part[2] < 0.0 || depth >= it->depth[pixel]) {
                continue;
            }
            it->depth[pixel] = (float)depth;
            picture_normalise(normal);
            double shade = 0.35 + 0.6 * fmax(picture_dot(normal, lamp), 0.0);
            shade *= edges && nearest < 0.7 ? 0.6 : 1.0;
            for (int k = 0; k < 3; ++k) {
                it->pixels[3 * pixel + (size_t)k] = (unsigned char)(255.0 * fmin(colour[k] * shade, 1.0));
            }
        }
    }
}

/* Adds a mesh in a colour of its own. */
static void raster_mesh(raster *it, const isocoat_mesh_view *mesh, uint32_t key, int edges)
{
    double colour[3];
    picture_colour(key, colour);
    for (size_t t = 0; t < mesh->triangle_count; ++t) {
        raster_triangle(it, mesh, mesh->triangles + 3 * t, colour, edges);
    }
}

/* Writes the picture and gives its memory back; 0 when all went well. */
static int raster_write(raster *it, const char *path)
{
    FILE *file = fopen(path, "wb");
    const size_t count = 3 * (size_t)it->width * (size_t)it->height;
    int failed = !file;
    if (file) {
        fprintf(file, "P6\n%d %d\n255\n", it->width, it->height);
        failed |= fwrite(it->pixels, 1, count, file) != count;
        failed |= fclose(file) != 0;
    }
    free(it->depth);
    free(it->pixels);
    return failed;
}

#endif
