/* SPDX-License-Identifier: MIT */
/* map_export - the surface of a map, as PLY and as a point cloud; see map_export.h. map_octomap.c has the tree. */
#include "map_export.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define POINT_BYTES 37 /* double x, y, z; float nx, ny, nz; uchar tag */

struct points {
    uint8_t *bytes; /* `head` bytes left free, then the points */
    size_t n, room;
    bool no_memory;
};

static bool is_free(const struct map_scene *s, const int64_t cell[3])
{
    return lattice_holds(&s->box, cell) && s->at(s->ctx, cell) == VOXEL_FREE;
}

/* Little-endian, whatever the machine. */
static void put(uint8_t *at, uint64_t bits, int n)
{
    for (int i = 0; i < n; i++)
        at[i] = (uint8_t)(bits >> (8 * i));
}

static void put_double(uint8_t *at, double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    put(at, bits, 8);
}

static void put_float(uint8_t *at, double v)
{
    const float f = (float)v;
    uint32_t bits;
    memcpy(&bits, &f, sizeof bits);
    put(at, bits, 4);
}

static void add(struct points *p, const struct map_scene *s, const int64_t cell[3], const int inward[3],
                bool heard)
{
    static const int from[3] = {1, 0, 2}; /* east, north, up of north, east, down */
    if (p->n + POINT_BYTES > p->room) {
        uint8_t *more = realloc(p->bytes, 2 * p->room);
        p->no_memory = !more;
        if (!more)
            return;
        p->bytes = more;
        p->room *= 2;
    }
    uint8_t *at = p->bytes + p->n;
    const double length = sqrt((double)(inward[0] * inward[0] + inward[1] * inward[1] + inward[2] * inward[2]));
    for (int a = 0; a < 3; a++) {
        const double sign = a == 2 ? -1 : 1;
        put_double(at + 8 * a, sign * ((double)cell[from[a]] + 0.5) * s->voxel_m);
        put_float(at + 24 + 4 * a, length > 0 ? sign * inward[from[a]] / length : 0);
    }
    at[36] = heard;
    p->n += POINT_BYTES;
}

/* A free cell: is it on the surface? */
static void look_at(struct points *p, const struct map_scene *s, const int64_t cell[3])
{
    int inward[3] = {0};
    bool surface = false, heard = false;
    for (int n = 0; n < 27; n++) {
        const int d[3] = {n / 9 - 1, n / 3 % 3 - 1, n % 3 - 1};
        const int64_t beside[3] = {cell[0] + d[0], cell[1] + d[1], cell[2] + d[2]};
        const enum voxel_state state = lattice_holds(&s->box, beside) ? s->at(s->ctx, beside) : VOXEL_UNKNOWN;
        if (state == VOXEL_FREE)
            continue;
        surface = true;
        heard |= state == VOXEL_OCCUPIED;
        for (int a = 0; a < 3; a++)
            inward[a] -= d[a];
    }
    if (surface)
        add(p, s, cell, inward, heard);
}

static void look_through(struct points *p, const struct map_scene *s, const struct lattice_box *part)
{
    for (int32_t i = 0; i < part->size[0]; i++)
        for (int32_t j = 0; j < part->size[1]; j++)
            for (int32_t k = 0; k < part->size[2] && !p->no_memory; k++) {
                const int64_t cell[3] = {part->first[0] + i, part->first[1] + j, part->first[2] + k};
                if (is_free(s, cell))
                    look_at(p, s, cell);
            }
}

/* The points behind `head` free bytes. */
static bool surface(const struct map_scene *s, size_t head, struct points *p, char *err, size_t err_size)
{
    const int32_t step = TILE_SIDE;
    *p = (struct points){.bytes = malloc(head + 4096), .n = head, .room = head + 4096};
    p->no_memory = !p->bytes;
    for (int32_t i = 0; i < s->box.size[0]; i += step)
        for (int32_t j = 0; j < s->box.size[1]; j += step) {
            const int32_t left[2] = {s->box.size[0] - i, s->box.size[1] - j};
            const struct lattice_box part = {
                {s->box.first[0] + i, s->box.first[1] + j, s->box.first[2]},
                {left[0] < step ? left[0] : step, left[1] < step ? left[1] : step, s->box.size[2]}};
            if (!p->no_memory && s->any(s->ctx, &part))
                look_through(p, s, &part);
        }
    if (!p->no_memory)
        return true;
    free(p->bytes);
    snprintf(err, err_size, "out of memory");
    return false;
}

#define HEAD_ROOM 512

uint8_t *map_export_ply(const struct map_scene *scene, size_t *size, char *err, size_t err_size)
{
    struct points p;
    char head[HEAD_ROOM];
    if (!surface(scene, HEAD_ROOM, &p, err, err_size))
        return NULL;
    const size_t n = (size_t)snprintf(
        head, sizeof head,
        "ply\nformat binary_little_endian 1.0\ncomment x east, y north, z up; tag 1: heard there, 0: the end of "
        "what "
        "was looked at\nelement vertex %zu\nproperty double x\nproperty double y\nproperty double z\n"
        "property float nx\nproperty float ny\nproperty float nz\nproperty uchar tag\nend_header\n",
        (p.n - HEAD_ROOM) / POINT_BYTES);
    memcpy(p.bytes, head, n);
    memmove(p.bytes + n, p.bytes + HEAD_ROOM, p.n - HEAD_ROOM);
    *size = p.n - HEAD_ROOM + n;
    return p.bytes;
}

/* ---- the point cloud ---- */

const char map_export_points_schema[] =
    "{\"title\":\"foxglove.PointCloud\",\"description\":\"A collection of N-dimensional "
    "points\",\"type\":\"object\","
    "\"properties\":{"
    "\"timestamp\":{\"type\":\"object\",\"title\":\"time\",\"properties\":{\"sec\":{\"type\":\"integer\","
    "\"minimum\":0},"
    "\"nsec\":{\"type\":\"integer\",\"minimum\":0,\"maximum\":999999999}}},"
    "\"frame_id\":{\"type\":\"string\"},"
    "\"pose\":{\"title\":\"foxglove.Pose\",\"type\":\"object\",\"properties\":{"
    "\"position\":{\"title\":\"foxglove.Vector3\",\"type\":\"object\",\"properties\":{\"x\":{\"type\":\"number\"},"
    "\"y\":{\"type\":\"number\"},\"z\":{\"type\":\"number\"}}},"
    "\"orientation\":{\"title\":\"foxglove.Quaternion\",\"type\":\"object\",\"properties\":{\"x\":{\"type\":"
    "\"number\"},"
    "\"y\":{\"type\":\"number\"},\"z\":{\"type\":\"number\"},\"w\":{\"type\":\"number\"}}}}},"
    "\"point_stride\":{\"type\":\"integer\",\"minimum\":0},"
    "\"fields\":{\"type\":\"array\",\"items\":{\"title\":\"foxglove.PackedElementField\",\"type\":\"object\","
    "\"properties\":{\"name\":{\"type\":\"string\"},\"offset\":{\"type\":\"integer\",\"minimum\":0},"
    "\"type\":{\"title\":\"foxglove.NumericType\",\"oneOf\":[{\"title\":\"UNKNOWN\",\"const\":0},"
    "{\"title\":\"UINT8\",\"const\":1},{\"title\":\"INT8\",\"const\":2},{\"title\":\"UINT16\",\"const\":3},"
    "{\"title\":\"INT16\",\"const\":4},{\"title\":\"UINT32\",\"const\":5},{\"title\":\"INT32\",\"const\":6},"
    "{\"title\":\"FLOAT32\",\"const\":7},{\"title\":\"FLOAT64\",\"const\":8}]}}}},"
    "\"data\":{\"type\":\"string\",\"contentEncoding\":\"base64\"}}}";

/* Returns the bytes written: four for each three, rounded up. */
static size_t base64(uint8_t *out, const uint8_t *in, size_t n)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    size_t written = 0;
    for (size_t i = 0; i < n; i += 3) {
        const uint32_t left = n - i < 3 ? (uint32_t)(n - i) : 3;
        uint32_t group = (uint32_t)in[i] << 16;
        group |= left > 1 ? (uint32_t)in[i + 1] << 8 : 0;
        group |= left > 2 ? in[i + 2] : 0;
        for (uint32_t d = 0; d < 4; d++)
            out[written++] = d <= left ? (uint8_t)digits[group >> (18 - 6 * d) & 63] : '=';
    }
    return written;
}

uint8_t *map_export_points(const struct map_scene *scene, uint64_t t_unix_ns, size_t *size, char *err,
                           size_t err_size)
{
    struct points p;
    char head[2 * HEAD_ROOM];
    if (!surface(scene, 0, &p, err, err_size))
        return NULL;
    const size_t n = (size_t)snprintf(
        head, sizeof head,
        "{\"timestamp\":{\"sec\":%llu,\"nsec\":%llu},\"frame_id\":\"map\",\"pose\":{\"position\":{\"x\":0,\"y\":0,"
        "\"z\":0},"
        "\"orientation\":{\"x\":0,\"y\":0,\"z\":0,\"w\":1}},\"point_stride\":%d,\"fields\":["
        "{\"name\":\"x\",\"offset\":0,\"type\":8},{\"name\":\"y\",\"offset\":8,\"type\":8},"
        "{\"name\":\"z\",\"offset\":16,\"type\":8},{\"name\":\"nx\",\"offset\":24,\"type\":7},"
        "{\"name\":\"ny\",\"offset\":28,\"type\":7},{\"name\":\"nz\",\"offset\":32,\"type\":7},"
        "{\"name\":\"tag\",\"offset\":36,\"type\":1}],\"data\":\"",
        (unsigned long long)(t_unix_ns / 1000000000u), (unsigned long long)(t_unix_ns % 1000000000u), POINT_BYTES);
    uint8_t *json = malloc(n + (p.n + 2) / 3 * 4 + 2);
    if (json) {
        memcpy(json, head, n);
        *size = n + base64(json + n, p.bytes, p.n);
        memcpy(json + *size, "\"}", 2);
        *size += 2;
    } else {
        snprintf(err, err_size, "out of memory");
    }
    free(p.bytes);
    return json;
}
