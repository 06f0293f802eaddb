/*
 * What the C tests share: checks that say where they fail, and small scenes. Each test program is one file that
 * includes this; it exits 0 when every check holds.
 */
#ifndef CHECK_H
#define CHECK_H

#include <isocoat/isocoat.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static int failures = 0;

#define PI 3.14159265358979323846

/* An array of three in places where C and C++ both take one. */
#define VEC(name, x, y, z) const double name[3] = {x, y, z}

#define CHECK(condition)                                                           \
    do {                                                                           \
        if (!(condition)) {                                                        \
            fprintf(stderr, "%s:%d: not so: %s\n", __FILE__, __LINE__, #condition); \
            ++failures;                                                            \
        }                                                                          \
    } while (0)

#define CHECK_NEAR(value, expected, tolerance)                                                          \
    do {                                                                                                \
        const double value_ = (value), expected_ = (expected);                                          \
        if (!(fabs(value_ - expected_) <= (tolerance))) {                                               \
            fprintf(stderr, "%s:%d: %s is %.17g; must be %.17g within %g\n", __FILE__, __LINE__, #value, \
                    value_, expected_, (double)(tolerance));                                            \
            ++failures;                                                                                 \
        }                                                                                               \
    } while (0)

/* A call that must succeed; the program ends if it does not, since the rest would make no sense. */
#define OK(call) expect_ok(call, #call, __FILE__, __LINE__)

/* A call that must be refused with this status and a message that contains this text. */
#define REFUSED(call, status, text) expect_refused(call, status, text, #call, __FILE__, __LINE__)

static inline const char *message(void)
{
    static char buffer[1024];
    isocoat_last_error(buffer, sizeof buffer);
    return buffer;
}

static inline void expect_ok(isocoat_status got, const char *call, const char *file, int line)
{
    if (got == ISOCOAT_OK) return;
    fprintf(stderr, "%s:%d: %s gives %s: %s\n", file, line, call, isocoat_status_name(got), message());
    exit(1);
}

static inline void expect_refused(isocoat_status got, isocoat_status status, const char *text, const char *call,
                                  const char *file, int line)
{
    if (got != status) {
        fprintf(stderr, "%s:%d: %s gives %s; must be %s\n", file, line, call, isocoat_status_name(got),
                isocoat_status_name(status));
        ++failures;
    } else if (strstr(message(), text) == NULL) {
        fprintf(stderr, "%s:%d: %s says \"%s\"; must contain \"%s\"\n", file, line, call, message(), text);
        ++failures;
    }
}

/* The end of main. */
static inline int verdict(const char *program)
{
    if (failures == 0) printf("%s: all checks hold\n", program);
    return failures == 0 ? 0 : 1;
}

/* A world without gravity. */
static inline isocoat_world *new_world(void)
{
    const isocoat_world_desc desc = isocoat_world_desc_default();
    isocoat_world *world = NULL;
    OK(isocoat_world_create(&desc, &world));
    return world;
}

static inline isocoat_body new_body(isocoat_world *world)
{
    const isocoat_body_desc desc = isocoat_body_desc_default();
    isocoat_body body;
    OK(isocoat_body_create(world, &desc, &body));
    return body;
}

/* A link of 1 kg at a height; rigid and host-driven ones with the inertia of a ball of 0.1 m. */
static inline isocoat_link new_link(isocoat_world *world, isocoat_body body, isocoat_link_kind kind, double height)
{
    isocoat_link_desc desc = isocoat_link_desc_default();
    isocoat_link link;
    desc.kind = kind;
    desc.mass = 1.0;
    desc.pose.position[2] = height;
    OK(isocoat_inertia_of_sphere(1.0, 0.1, desc.inertia));
    OK(isocoat_link_create(world, body, &desc, &link));
    return link;
}

/* A point with a linear profile: f(d) = 1 + (0.1 - d) / 0.1 inside, a coat of radius 0.1 m. */
static inline isocoat_skeleton new_point(isocoat_world *world, isocoat_link link)
{
    isocoat_skeleton_desc desc = isocoat_skeleton_desc_default();
    isocoat_skeleton skeleton;
    desc.thickness = 0.1;
    desc.stiffness = 10.0;
    desc.radius = 0.3;
    OK(isocoat_skeleton_create(world, link, &desc, &skeleton));
    return skeleton;
}

typedef struct ball {
    isocoat_body body;
    isocoat_link link;
    isocoat_skeleton skeleton;
} ball;

static inline ball new_ball(isocoat_world *world, isocoat_link_kind kind, double height)
{
    ball made;
    made.body = new_body(world);
    made.link = new_link(world, made.body, kind, height);
    made.skeleton = new_point(world, made.link);
    return made;
}

static inline bool same_body(isocoat_body a, isocoat_body b)
{
    return a.index == b.index && a.generation == b.generation && a.world == b.world;
}

static inline bool same_link(isocoat_link a, isocoat_link b)
{
    return a.index == b.index && a.generation == b.generation && a.world == b.world;
}

static inline bool same_skeleton(isocoat_skeleton a, isocoat_skeleton b)
{
    return a.index == b.index && a.generation == b.generation && a.world == b.world;
}

#endif
