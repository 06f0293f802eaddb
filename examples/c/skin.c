/*
 * Meshes of soft bodies that press on each other: a limb of three skeletons lies on a ball, and a finger pushes into
 * it. The watertight meshes, and those of the territories in both styles. With a folder as argument it leaves pictures
 * there, and the watertight meshes as skin.obj; with --record FILE, a recording of one frame. Exits 0 when every
 * watertight mesh is closed, by Euler's formula.
 */
#include <isocoat/isocoat.h>

#include "../common/check.h"
#include "../common/raster.h"
#include "../common/record.h"

#include <stdio.h>

enum { BODIES = 3 };
static const double THICKNESS = 0.1;

static int add_body(isocoat_world *world, isocoat_body *body, const double (*ends)[3], int count)
{
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
    isocoat_link link;
    isocoat_skeleton made;
    body_desc.bulge_width = 0.6;
    body_desc.bulge_height = 1.0;
    link_desc.kind = ISOCOAT_LINK_FIXED;
    CHECK(isocoat_body_create(world, &body_desc, body));
    CHECK(isocoat_link_create(world, *body, &link_desc, &link));
    desc.thickness = THICKNESS;
    desc.seed_count = 300;
    for (int k = 0; k < count; ++k) {
        desc.shape = ISOCOAT_SHAPE_SEGMENT;
        for (int j = 0; j < 3; ++j) {
            desc.points[0][j] = ends[k][j];
            desc.points[1][j] = ends[k + 1][j];
        }
        CHECK(isocoat_skeleton_create(world, link, &desc, &made));
    }
    return 0;
}

static int add_bodies(isocoat_world *world, isocoat_body bodies[BODIES])
{
    static const double limb[4][3] = {{-0.3, 0.0, 0.0}, {-0.05, 0.0, 0.06}, {0.15, 0.05, 0.0}, {0.35, -0.05, 0.1}};
    static const double below[2][3] = {{0.0, -0.02, -0.13}, {0.0, 0.02, -0.13}};
    static const double finger[2][3] = {{0.12, -0.15, 0.1}, {0.2, -0.4, 0.25}};
    return add_body(world, &bodies[0], limb, 3) || add_body(world, &bodies[1], below, 1) ||
           add_body(world, &bodies[2], finger, 1);
}

/* Adds the mesh of each skeleton of a body to a picture. */
static int add_territories(raster *picture, const isocoat_world *world, isocoat_body body,
                           isocoat_territory_style style, isocoat_mesh *mesh)
{
    isocoat_link links[1];
    isocoat_skeleton skeletons[8];
    isocoat_mesh_view view;
    size_t link_count, count;
    CHECK(isocoat_body_get_links(world, body, links, 1, &link_count));
    CHECK(isocoat_link_get_skeletons(world, links[0], skeletons, 8, &count));
    for (size_t k = 0; k < count; ++k) {
        CHECK(isocoat_skeleton_make_mesh(world, skeletons[k], style, mesh));
        CHECK(isocoat_mesh_get_view(mesh, &view));
        raster_mesh(picture, &view, skeletons[k].index, 1);
    }
    return 0;
}

static void write_obj(FILE *file, const isocoat_mesh_view *view, uint32_t *offset)
{
    for (size_t v = 0; v < view->vertex_count; ++v) {
        const double *p = view->positions + 3 * v, *n = view->normals + 3 * v;
        fprintf(file, "v %.6f %.6f %.6f\nvn %.5f %.5f %.5f\n", p[0], p[1], p[2], n[0], n[1], n[2]);
    }
    for (size_t t = 0; t < view->triangle_count; ++t) {
        const uint32_t *c = view->triangles + 3 * t;
        const uint32_t a = *offset + c[0], b = *offset + c[1], d = *offset + c[2];
        fprintf(file, "f %u//%u %u//%u %u//%u\n", a, a, b, b, d, d);
    }
    *offset += (uint32_t)view->vertex_count;
}

/* The watertight meshes of all bodies; to a picture and a file, unless these are NULL. */
static int skins(const isocoat_world *world, const isocoat_body *bodies, double cell, isocoat_mesh *mesh,
                 raster *picture, FILE *file)
{
    uint32_t offset = 1;
    for (uint32_t k = 0; k < BODIES; ++k) {
        isocoat_mesh_desc desc = isocoat_mesh_desc_default();
        isocoat_mesh_view view;
        desc.cell_size = cell;
        desc.deformation = ISOCOAT_DEFORMATION_BULGES;
        CHECK(isocoat_body_make_mesh(world, bodies[k], &desc, mesh));
        CHECK(isocoat_mesh_get_view(mesh, &view));
        printf("body %u: %u vertices, %u triangles\n", k, (unsigned)view.vertex_count, (unsigned)view.triangle_count);
        /* A closed surface without holes through it: V - E + F = 2, with E = 3/2 F. */
        if (view.triangle_count != 2 * view.vertex_count - 4) return 1;
        if (picture) raster_mesh(picture, &view, k, 1);
        if (file) write_obj(file, &view, &offset);
    }
    return 0;
}

int main(int count, char **arguments)
{
    static const picture_view view = {{-0.5, -1.4, 0.5}, {0.02, -0.05, -0.02}, {0.0, 0.0, 1.0}, 1.3};
    const isocoat_world_desc desc = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    isocoat_mesh *mesh = NULL;
    isocoat_body bodies[BODIES];
    recording film;
    if (record_begin(&film, record_argument(&count, arguments))) return 1;
    CHECK(isocoat_world_create(&desc, &world));
    CHECK(isocoat_mesh_create(&mesh));
    if (add_bodies(world, bodies)) return 1;
    if (record_frame(&film, world, 0.0) || record_end(&film)) return 1;
    if (count < 2) {
        if (skins(world, bodies, 0.2 * THICKNESS, mesh, NULL, NULL)) return 1;
    }
    for (int style = 0; count > 1 && style < 3; ++style) {
        static const char *const names[3] = {"skin", "patches", "scales"};
        char path[512];
        raster picture;
        if (raster_begin(&picture, &view, 800, 640)) return 1;
        if (style == 0) {
            snprintf(path, sizeof path, "%s/skin.obj", arguments[1]);
            FILE *file = fopen(path, "w");
            if (!file || skins(world, bodies, 0.2 * THICKNESS, mesh, &picture, file) || fclose(file)) return 1;
        }
        for (int k = 0; style > 0 && k < BODIES; ++k) {
            const isocoat_territory_style as = style == 1 ? ISOCOAT_TERRITORY_PATCHES : ISOCOAT_TERRITORY_SCALES;
            if (add_territories(&picture, world, bodies[k], as, mesh)) return 1;
        }
        snprintf(path, sizeof path, "%s/%s.ppm", arguments[1], names[style]);
        if (raster_write(&picture, path)) return 1;
    }
    isocoat_mesh_destroy(mesh);
    isocoat_world_destroy(world);
    return 0;
}
