/*
 * Recordings through the C API: frames come back as they were, nobody changes what is played, and what is damaged is
 * refused.
 */
#include "check.h"

#include <stdlib.h>
#include <string.h>

#define FRAMES 12
#define RAYS 8

typedef struct scene {
    isocoat_world *world;
    isocoat_body ball, clay;
} scene;

static scene new_scene(void)
{
    scene it;
    isocoat_world_desc world_desc = isocoat_world_desc_default();
    isocoat_body_desc body_desc = isocoat_body_desc_default();
    isocoat_link_desc link_desc = isocoat_link_desc_default();
    isocoat_skeleton_desc shape = isocoat_skeleton_desc_default();
    isocoat_substance_desc substance = isocoat_substance_desc_default();
    isocoat_link link;
    isocoat_skeleton skeleton;
    const double low[3] = {-0.15, -0.1, 0.3}, high[3] = {0.15, 0.1, 0.5};
    size_t count;
    world_desc.gravity[2] = -9.81;
    OK(isocoat_world_create(&world_desc, &it.world));
    body_desc.bulge_width = 0.4;
    body_desc.bulge_height = 0.5;
    OK(isocoat_body_create(it.world, &body_desc, &it.ball));
    link_desc.kind = ISOCOAT_LINK_RIGID;
    link_desc.mass = 5.0;
    OK(isocoat_inertia_of_sphere(5.0, 0.1, link_desc.inertia));
    OK(isocoat_link_create(it.world, it.ball, &link_desc, &link));
    OK(isocoat_skeleton_create(it.world, link, &shape, &skeleton));
    OK(isocoat_body_create(it.world, &body_desc, &it.clay));
    substance.particle_mass = 0.7;
    substance.cohesion = 20.0;
    OK(isocoat_body_make_substance(it.world, it.clay, &substance));
    OK(isocoat_substance_fill_box(it.world, it.clay, low, high, &count));
    return it;
}

/* What some rays see; the handles without their worlds' tags. */
static void look(const isocoat_world *world, double seen[RAYS][8])
{
    int ray;
    memset(seen, 0, RAYS * sizeof seen[0]);
    for (ray = 0; ray < RAYS; ++ray) {
        const double origin[3] = {-1.0, 0.02 * ray, 0.6}, direction[3] = {1.0, 0.0, -0.3 - 0.05 * ray};
        isocoat_ray_hit hit;
        bool found;
        OK(isocoat_world_cast_ray_deformed(world, origin, direction, 10.0, UINT64_MAX, ISOCOAT_DEFORMATION_BULGES,
                                           &hit, &found));
        if (found) {
            memcpy(seen[ray], hit.position, sizeof hit.position);
            memcpy(seen[ray] + 3, hit.normal, sizeof hit.normal);
            seen[ray][6] = (double)hit.body.index;
            seen[ray][7] = (double)hit.skeleton.index;
        }
    }
}

typedef struct stream {
    uint8_t *bytes;
    size_t size, most;
} stream;

static bool append(void *context, const uint8_t *bytes, size_t size)
{
    stream *it = (stream *)context;
    if (it->size + size > it->most) return false;
    memcpy(it->bytes + it->size, bytes, size);
    it->size += size;
    return true;
}

static uint8_t *taken(const isocoat_recorder *recorder, size_t *size)
{
    uint8_t *bytes;
    OK(isocoat_recorder_get_bytes(recorder, NULL, 0, size));
    bytes = (uint8_t *)malloc(*size);
    REFUSED(isocoat_recorder_get_bytes(recorder, bytes, *size - 1, size), ISOCOAT_ERROR_BUFFER_TOO_SMALL, "capacity");
    OK(isocoat_recorder_get_bytes(recorder, bytes, *size, size));
    return bytes;
}

static void frames_come_back_in_any_order(void)
{
    static double seen[FRAMES][RAYS][8], again[RAYS][8];
    scene it = new_scene();
    isocoat_recorder_desc desc = isocoat_recorder_desc_default();
    isocoat_recorder *memory, *streamed;
    isocoat_playback *playback;
    const isocoat_world *shown;
    isocoat_world *other;
    stream file;
    uint8_t *bytes, *snapshot;
    size_t size, count, needed;
    uint64_t written;
    uint32_t frames, frame;
    double time;
    isocoat_body bodies[3];
    isocoat_link link;
    isocoat_piece pieces[2];
    file.most = 1u << 20;
    file.size = 0;
    file.bytes = (uint8_t *)malloc(file.most);
    desc.key_interval = 5;
    OK(isocoat_recorder_create(&desc, &memory));
    desc.write = append;
    desc.context = &file;
    OK(isocoat_recorder_create(&desc, &streamed));
    for (frame = 0; frame < FRAMES; ++frame) {
        if (frame == 7) {
            isocoat_body_desc body_desc = isocoat_body_desc_default();
            OK(isocoat_body_create(it.world, &body_desc, &bodies[0]));
        }
        OK(isocoat_world_step(it.world, 1.0 / 60.0));
        OK(isocoat_recorder_capture(memory, it.world, frame / 60.0));
        OK(isocoat_recorder_capture(streamed, it.world, frame / 60.0));
        look(it.world, seen[frame]);
    }
    OK(isocoat_recorder_get_size(memory, &frames, &written));
    CHECK(frames == FRAMES);
    bytes = taken(memory, &size);
    CHECK(written < size);
    REFUSED(isocoat_recorder_finish(memory), ISOCOAT_ERROR_UNSUPPORTED, "in memory");
    OK(isocoat_recorder_finish(streamed));
    REFUSED(isocoat_recorder_get_bytes(streamed, NULL, 0, &needed), ISOCOAT_ERROR_UNSUPPORTED, "stream");
    REFUSED(isocoat_recorder_capture(streamed, it.world, 9.0), ISOCOAT_ERROR_UNSUPPORTED, "finished");
    REFUSED(isocoat_recorder_capture(memory, it.world, 0.0), ISOCOAT_ERROR_OUT_OF_RANGE, "time");
    CHECK(file.size == size && memcmp(file.bytes, bytes, size) == 0);

    OK(isocoat_playback_create(bytes, size, &playback));
    OK(isocoat_playback_get_world(playback, &shown));
    OK(isocoat_playback_get_frame_count(playback, &frames));
    CHECK(frames == FRAMES);
    OK(isocoat_world_get_bodies(shown, bodies, 3, &count));
    CHECK(count == 0);
    for (frame = 0; frame < 2 * FRAMES; ++frame) {
        const uint32_t at = 5 * frame % FRAMES;
        OK(isocoat_playback_seek(playback, at));
        OK(isocoat_playback_get_time(playback, at, &time));
        CHECK(time == at / 60.0);
        look(shown, again);
        CHECK(memcmp(again, seen[at], sizeof again) == 0);
        OK(isocoat_world_get_bodies(shown, bodies, 3, &count));
        CHECK(count == (at < 7 ? 2u : 3u) && bodies[0].index == it.ball.index);
        OK(isocoat_substance_get_pieces(shown, bodies[1], pieces, 2, &count));
        CHECK(count == 1 && pieces[0].volume > 0.0);
    }
    REFUSED(isocoat_playback_seek(playback, FRAMES), ISOCOAT_ERROR_OUT_OF_RANGE, "frame is 12");
    REFUSED(isocoat_playback_get_time(playback, FRAMES, &time), ISOCOAT_ERROR_OUT_OF_RANGE, "frame is 12");

    /* A host that casts the const away changes nothing. */
    REFUSED(isocoat_world_step((isocoat_world *)shown, 0.1), ISOCOAT_ERROR_UNSUPPORTED, "recording");
    REFUSED(isocoat_body_destroy((isocoat_world *)shown, bodies[0]), ISOCOAT_ERROR_UNSUPPORTED, "recording");
    REFUSED(isocoat_world_destroy((isocoat_world *)shown), ISOCOAT_ERROR_UNSUPPORTED, "recording");
    /* A snapshot of a frame steps on. */
    OK(isocoat_world_snapshot(shown, NULL, 0, &needed));
    snapshot = (uint8_t *)malloc(needed);
    OK(isocoat_world_snapshot(shown, snapshot, needed, &needed));
    REFUSED(isocoat_world_restore((isocoat_world *)shown, snapshot, needed), ISOCOAT_ERROR_UNSUPPORTED, "recording");
    other = new_scene().world;
    OK(isocoat_world_restore(other, snapshot, needed));
    look(shown, seen[0]);
    look(other, again);
    CHECK(memcmp(again, seen[0], sizeof again) == 0);
    OK(isocoat_world_step(other, 1.0 / 60.0));
    OK(isocoat_world_get_bodies(other, bodies, 3, &count));
    OK(isocoat_body_get_links(other, bodies[0], &link, 1, &count));
    CHECK(count == 1);

    OK(isocoat_playback_destroy(playback));
    OK(isocoat_recorder_destroy(memory));
    OK(isocoat_recorder_destroy(streamed));
    isocoat_world_destroy(other);
    isocoat_world_destroy(it.world);
    free(snapshot);
    free(bytes);
    free(file.bytes);
}

typedef struct reader {
    const isocoat_world *world;
    isocoat_playback *playback;
} reader;

static void seek_within(void *context, const double *position, double size, uint32_t color)
{
    reader *it = (reader *)context;
    (void)position, (void)size, (void)color;
    REFUSED(isocoat_playback_seek(it->playback, 0), ISOCOAT_ERROR_LOCKED, "being read");
    REFUSED(isocoat_playback_destroy(it->playback), ISOCOAT_ERROR_LOCKED, "being read");
}

static void what_makes_no_sense_is_refused(void)
{
    scene it = new_scene();
    isocoat_recorder_desc desc = isocoat_recorder_desc_default();
    isocoat_recorder *recorder = NULL;
    isocoat_playback *playback = NULL;
    isocoat_debug_draw draw = isocoat_debug_draw_default();
    reader within;
    stream full = {NULL, 0, 0};
    size_t size, at;
    uint32_t frames;
    uint64_t written;
    uint8_t *bytes, *cut;
    CHECK(desc.key_interval == 60 && desc.write == NULL);
    REFUSED(isocoat_recorder_create(NULL, &recorder), ISOCOAT_ERROR_INVALID_ARGUMENT, "desc is NULL");
    REFUSED(isocoat_recorder_create(&desc, NULL), ISOCOAT_ERROR_INVALID_ARGUMENT, "recorder is NULL");
    desc.key_interval = 0;
    REFUSED(isocoat_recorder_create(&desc, &recorder), ISOCOAT_ERROR_OUT_OF_RANGE, "key_interval is 0");
    desc.key_interval = 60;
    desc.struct_size = 4;
    REFUSED(isocoat_recorder_create(&desc, &recorder), ISOCOAT_ERROR_INVALID_ARGUMENT, "struct_size");
    desc = isocoat_recorder_desc_default();
    OK(isocoat_recorder_create(&desc, &recorder));
    REFUSED(isocoat_recorder_capture(NULL, it.world, 0.0), ISOCOAT_ERROR_INVALID_ARGUMENT, "recorder is NULL");
    REFUSED(isocoat_recorder_capture(recorder, NULL, 0.0), ISOCOAT_ERROR_INVALID_ARGUMENT, "world is NULL");
    REFUSED(isocoat_recorder_capture(recorder, it.world, (double)NAN), ISOCOAT_ERROR_OUT_OF_RANGE, "time");
    REFUSED(isocoat_recorder_get_size(recorder, NULL, &written), ISOCOAT_ERROR_INVALID_ARGUMENT, "frame_count");
    REFUSED(isocoat_playback_create(NULL, 9, &playback), ISOCOAT_ERROR_INVALID_ARGUMENT, "bytes is NULL");
    REFUSED(isocoat_playback_create((const uint8_t *)"isoreel", 8, &playback), ISOCOAT_ERROR_RECORDING, "cut short");
    REFUSED(isocoat_playback_seek(NULL, 0), ISOCOAT_ERROR_INVALID_ARGUMENT, "playback is NULL");
    REFUSED(isocoat_playback_get_frame_count(NULL, &frames), ISOCOAT_ERROR_INVALID_ARGUMENT, "playback is NULL");
    OK(isocoat_playback_destroy(NULL));
    OK(isocoat_recorder_destroy(NULL));

    OK(isocoat_recorder_capture(recorder, it.world, 0.0));
    OK(isocoat_recorder_capture(recorder, it.world, 1.0));
    bytes = taken(recorder, &size);
    for (at = 0; at < size; at += at < 64 ? 1 : 61) {
        bytes[at] = (uint8_t)(bytes[at] ^ 0x10);
        CHECK(isocoat_playback_create(bytes, size, &playback) == ISOCOAT_ERROR_RECORDING);
        bytes[at] = (uint8_t)(bytes[at] ^ 0x10);
        /* In memory of exactly that size, so that reading on is seen. */
        cut = (uint8_t *)malloc(at + 1);
        memcpy(cut, bytes, at);
        CHECK(isocoat_playback_create(cut, at, &playback) == ISOCOAT_ERROR_RECORDING);
        free(cut);
    }
    CHECK(playback == NULL);
    OK(isocoat_playback_create(bytes, size, &playback));
    OK(isocoat_playback_seek(playback, 1));
    within.playback = playback;
    OK(isocoat_playback_get_world(playback, &within.world));
    draw.flags = ISOCOAT_DRAW_SKELETONS;
    draw.draw_point = seek_within;
    draw.context = &within;
    OK(isocoat_world_debug_draw(within.world, &draw));
    OK(isocoat_playback_seek(playback, 0));
    OK(isocoat_playback_destroy(playback));
    OK(isocoat_recorder_destroy(recorder));

    /* A full disk. */
    desc.write = append;
    desc.context = &full;
    OK(isocoat_recorder_create(&desc, &recorder));
    REFUSED(isocoat_recorder_capture(recorder, it.world, 0.0), ISOCOAT_ERROR_STREAM, "at byte 0");
    REFUSED(isocoat_recorder_capture(recorder, it.world, 0.0), ISOCOAT_ERROR_UNSUPPORTED, "failed");
    OK(isocoat_recorder_destroy(recorder));
    free(bytes);
    isocoat_world_destroy(it.world);
}

int main(void)
{
    frames_come_back_in_any_order();
    what_makes_no_sense_is_refused();
    return verdict("recording");
}
