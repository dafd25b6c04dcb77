/* SPDX-License-Identifier: MIT */
#include "grid.h"

#include <math.h>
#include <stdlib.h>

#include "core/memory.h"

static size_t lines(size_t n)
{
    return (n + 63) / 64 * 64;
}

static void publish_stats(struct grid *g)
{
    struct sphere_stats s;
    sphere_stats(g->sphere, &s);
    snapshot_publish(&g->stats, &s);
}

struct grid *grid_new(const struct grid_setting *setting, struct fault *fault)
{
    const size_t bytes = sphere_bytes(&setting->sphere, fault);
    if (!bytes)
        return NULL;
    struct grid *g = calloc(1, sizeof *g);
    void *memory = memory_touched(bytes);
    if (!g || !memory) {
        fault_set(fault, "no memory for a grid of %zu MiB", bytes >> 20);
        free(g);
        free(memory);
        return NULL;
    }
    g->setting = *setting;
    g->bytes = bytes;
    g->memory = memory;
    g->sphere = sphere_init(memory, &setting->sphere);
    publish_stats(g);
    return g;
}

void grid_free(struct grid *g)
{
    if (!g)
        return;
    free(g->clusters);
    free(g->memory);
    free(g);
}

void grid_enter(struct grid *g, const struct echoes *e, const struct mount *mount)
{
    sphere_enter(g->sphere, e, mount);
    publish_stats(g);
}

void grid_follow(struct grid *g, const struct pose *pose)
{
    sphere_follow(g->sphere, pose);
    publish_stats(g);
}

struct picture *grid_picture(struct grid *g)
{
    return sphere_picture(g->sphere);
}

struct answer_conf grid_limits(const struct grid *g)
{
    struct answer_conf limits = g->setting.limits;
    struct picture_frame frame;
    picture_get_frame(sphere_picture(g->sphere), &frame);
    const double forget_s = sphere_forget_s(&g->setting.sphere, frame.turn_s);
    limits.clear_for_s =
        limits.clear_for_s > 0 ? fmin(limits.clear_for_s, forget_s) : answer_clear_for_s(frame.turn_s, forget_s);
    return limits;
}

void grid_stats(struct grid *g, struct sphere_stats *out)
{
    snapshot_read(&g->stats, out);
}

size_t grid_looks_bytes(const struct rings *rings, uint32_t max_cells)
{
    return lines(clusters_bytes(rings, max_cells)) + lines(rings->n * sizeof(struct next_look_score));
}

size_t grid_clusters_bytes(struct grid *g)
{
    return g->clusters ? 0 : grid_looks_bytes(grid_picture(g)->rings, g->setting.sphere.max_cells);
}

struct clusters *grid_clusters(struct grid *g)
{
    const struct picture *picture = grid_picture(g);
    const size_t bytes = grid_clusters_bytes(g);
    void *memory = bytes ? aligned_alloc(64, bytes) : NULL;
    if (!memory)
        return g->clusters;
    g->clusters =
        clusters_init(memory, picture->rings, g->setting.sphere.max_cells, (double)picture->blocked_logodds);
    g->look_score =
        (struct next_look_score *)(void *)((char *)memory +
                                           lines(clusters_bytes(picture->rings, g->setting.sphere.max_cells)));
    g->bytes += bytes;
    return g->clusters;
}
