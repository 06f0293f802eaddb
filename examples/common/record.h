/*
 * Records a scene into a file, when its arguments ask for it: --record FILE. C99 and C++.
 */
#ifndef RECORD_H
#define RECORD_H

#include <isocoat/isocoat.h>

#include <stdio.h>
#include <string.h>

/* A recording into a file; without one, all calls do nothing. */
typedef struct recording {
    isocoat_recorder *recorder;
    FILE *file;
} recording;

/* Takes --record FILE out of the arguments; gives the file's name, or NULL. */
static inline const char *record_argument(int *count, char **arguments)
{
    for (int at = 1; at + 1 < *count; ++at) {
        if (strcmp(arguments[at], "--record") == 0) {
            const char *path = arguments[at + 1];
            for (int next = at; next + 2 < *count; ++next) arguments[next] = arguments[next + 2];
            *count -= 2;
            return path;
        }
    }
    return NULL;
}

static inline bool record_write(void *file, const uint8_t *bytes, size_t size)
{
    return fwrite(bytes, 1, size, (FILE *)file) == size;
}

/* 0 when all went well, as all that follow. */
static inline int record_begin(recording *it, const char *path)
{
    it->recorder = NULL;
    it->file = NULL;
    if (!path) return 0;
    it->file = fopen(path, "wb");
    if (!it->file) {
        fprintf(stderr, "cannot write %s\n", path);
        return 1;
    }
    isocoat_recorder_desc desc = isocoat_recorder_desc_default();
    desc.context = it->file;
    desc.write = record_write;
    return isocoat_recorder_create(&desc, &it->recorder) != ISOCOAT_OK;
}

static inline int record_frame(const recording *it, const isocoat_world *world, double time)
{
    return it->recorder && isocoat_recorder_capture(it->recorder, world, time) != ISOCOAT_OK;
}

/* Without it, the file has no index and cannot be played. */
static inline int record_end(recording *it)
{
    if (!it->recorder) return 0;
    int failed = isocoat_recorder_finish(it->recorder) != ISOCOAT_OK;
    failed |= fclose(it->file) != 0;
    isocoat_recorder_destroy(it->recorder);
    it->recorder = NULL;
    return failed;
}

#endif
