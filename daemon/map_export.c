/* SPDX-License-Identifier: MIT */
/* map_export - the surface of a map, as PLY and as a point cloud; see map_export.h. map_octomap.c has the tree. */
#include "map_export.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define POINT_BYTES 37 /* double x, y, z; float nx, ny, nz; uchar tag */

struct points {
    uint8_t *bytes; /* `head` bytes left free, then the points */
    size_t n, room;
    bool no_memory;
};

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

/* A frontier_take. */
static void add(void *context, const struct frontier_point *point)
{
    static const struct {
        int axis;
        double sign;
    } of[] = {{1, 1}, {0, 1}, {2, -1}}; /* east, north, up of north, east, down */
    struct points *p = context;
    if (p->n + POINT_BYTES > p->room && !p->no_memory) {
        uint8_t *more = realloc(p->bytes, 2 * p->room);
        p->no_memory = !more;
        p->bytes = more ? more : p->bytes;
        p->room *= more ? 2 : 1;
    }
    if (p->no_memory)
        return;
    uint8_t *at = p->bytes + p->n;
    for (int a = 0; a < 3; a++) {
        put_double(at + 8 * a, of[a].sign * point->position_m[of[a].axis]);
        put_float(at + 24 + 4 * a, of[a].sign * (double)point->normal[of[a].axis]);
    }
    at[36] = point->tag == FRONTIER_ECHO;
    p->n += POINT_BYTES;
}

/* The points behind `head` free bytes. */
static bool surface(struct frontier *f, size_t head, struct points *p, char *err, size_t err_size)
{
    *p = (struct points){.bytes = malloc(head + 4096), .n = head, .room = head + 4096};
    p->no_memory = !p->bytes;
    frontier_all(f, add, p);
    if (!p->no_memory)
        return true;
    free(p->bytes);
    snprintf(err, err_size, "out of memory");
    return false;
}

#define HEAD_ROOM 512

uint8_t *map_export_ply(struct frontier *f, size_t *size, char *err, size_t err_size)
{
    struct points p;
    char head[HEAD_ROOM];
    if (!surface(f, HEAD_ROOM, &p, err, err_size))
        return NULL;
    const size_t n = (size_t)snprintf(
        head, sizeof head,
        "ply\nformat binary_little_endian 1.0\ncomment x east, y north, z up; tag 1: heard there, 0: the end of "
        "what was looked at\nelement vertex %zu\nproperty double x\nproperty double y\nproperty double z\n"
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

uint8_t *map_export_points(struct frontier *f, uint64_t t_unix_ns, size_t *size, char *err, size_t err_size)
{
    struct points p;
    char head[2 * HEAD_ROOM];
    if (!surface(f, 0, &p, err, err_size))
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
