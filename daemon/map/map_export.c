/* SPDX-License-Identifier: MIT */
/* map_export - the surface of a map, as PLY and as a point cloud; see map_export.h. map_octomap.c has the tree. */
#include "map_export.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "drivers/capture/point_cloud.h"

#define POINT_BYTES  37 /* double x, y, z; float nx, ny, nz; uchar tag */
#define COLOUR_BYTES 3  /* of PLY: uchar red, green, blue behind each point */

struct points {
    uint8_t *bytes;
    size_t n, room;
    bool no_memory;
};

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
        point_put_double(at + 8 * a, of[a].sign * point->position_m[of[a].axis]);
        point_put_float(at + 24 + 4 * a, of[a].sign * (double)point->normal[of[a].axis]);
    }
    at[36] = point->tag == FRONTIER_ECHO;
    p->n += POINT_BYTES;
}

static bool surface(struct frontier *f, struct points *p, struct fault *fault)
{
    *p = (struct points){.bytes = malloc(4096), .room = 4096};
    p->no_memory = !p->bytes;
    frontier_all(f, add, p);
    if (!p->no_memory)
        return true;
    free(p->bytes);
    return fault_set(fault, "out of memory");
}

#define HEAD_ROOM 640

static double height_of(const uint8_t *point)
{
    uint64_t bits = 0;
    double z;
    for (int i = 7; i >= 0; i--)
        bits = bits << 8 | point[16 + i];
    memcpy(&z, &bits, sizeof z);
    return z;
}

/* From yellow, the shallowest, over green and blue to violet, the deepest: share 0 to 1. */
static void put_colour(uint8_t *at, double share)
{
    static const double ramp[][3] = {{253, 231, 37}, {94, 201, 98}, {33, 145, 140}, {59, 82, 139}, {68, 1, 84}};
    const double place = fmin(fmax(share, 0), 1) * 4;
    const int i = place < 3 ? (int)place : 3;
    for (int c = 0; c < 3; c++)
        at[c] = (uint8_t)lround(ramp[i][c] + (place - i) * (ramp[i + 1][c] - ramp[i][c]));
}

/* The points with their colours behind the head; least_m and most_m: heights of the deepest and the shallowest. */
static uint8_t *coloured(const struct points *p, const char *head, size_t head_bytes, double least_m,
                         double most_m)
{
    const size_t n = p->n / POINT_BYTES, stride = POINT_BYTES + COLOUR_BYTES;
    uint8_t *out = malloc(head_bytes + n * stride);
    if (!out)
        return NULL;
    memcpy(out, head, head_bytes);
    for (size_t i = 0; i < n; i++) {
        const uint8_t *point = p->bytes + i * POINT_BYTES;
        uint8_t *at = out + head_bytes + i * stride;
        memcpy(at, point, POINT_BYTES);
        put_colour(at + POINT_BYTES, most_m > least_m ? (most_m - height_of(point)) / (most_m - least_m) : 0);
    }
    return out;
}

uint8_t *map_export_ply(struct frontier *f, size_t *size, struct fault *fault)
{
    struct points p;
    char head[HEAD_ROOM];
    double least_m = INFINITY, most_m = -INFINITY;
    if (!surface(f, &p, fault))
        return NULL;
    for (size_t at = 0; at < p.n; at += POINT_BYTES) {
        least_m = fmin(least_m, height_of(p.bytes + at));
        most_m = fmax(most_m, height_of(p.bytes + at));
    }
    const size_t n = p.n / POINT_BYTES;
    const size_t head_bytes = (size_t)snprintf(
        head, sizeof head,
        "ply\nformat binary_little_endian 1.0\ncomment x east, y north, z up; tag 1: echo there, 0: end of the "
        "observed water\ncomment colour by depth: yellow %.2f m, violet %.2f m\nelement vertex %zu\n"
        "property double x\nproperty double y\nproperty double z\n"
        "property float nx\nproperty float ny\nproperty float nz\nproperty uchar tag\n"
        "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
        n ? -most_m : 0.0, n ? -least_m : 0.0, n);
    uint8_t *out = coloured(&p, head, head_bytes, least_m, most_m);
    *size = head_bytes + n * (POINT_BYTES + COLOUR_BYTES);
    free(p.bytes);
    if (!out)
        fault_set(fault, "out of memory");
    return out;
}

/* ---- the point cloud ---- */

static const struct point_field fields[] = {{"x", POINT_FLOAT64},  {"y", POINT_FLOAT64},  {"z", POINT_FLOAT64},
                                            {"nx", POINT_FLOAT32}, {"ny", POINT_FLOAT32}, {"nz", POINT_FLOAT32},
                                            {"tag", POINT_UINT8},  {NULL, POINT_UINT8}};

bool map_export_points(struct frontier *f, uint64_t t_unix_ns, const char *library, int fd, struct fault *fault)
{
    struct points p;
    if (!surface(f, &p, fault)) {
        close(fd);
        return false;
    }
    const struct point_cloud cloud = {
        .t_unix_ns = t_unix_ns, .frame_id = "map", .fields = fields, .points = p.bytes, .bytes = p.n};
    const bool ok = point_cloud_capture(&cloud, "/map/surface", library, fd, fault);
    free(p.bytes);
    return ok;
}
