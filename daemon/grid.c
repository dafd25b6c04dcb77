/* SPDX-License-Identifier: MIT */
#include "grid.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define STEP_BYTES (256 * 1024)

_Static_assert(sizeof(struct sphere_stats) % 8 == 0, "statistics are whole words");

static size_t lines(size_t n)
{
    return (n + 63) / 64 * 64;
}

static void publish_stats(struct grid *g)
{
    struct sphere_stats s;
    sphere_stats(g->sphere, &s);
    seqlock_begin(&g->lock);
    seqlock_store(g->stats, &s, sizeof s / 8);
    seqlock_end(&g->lock);
}

struct grid *grid_begin(const struct grid_setting *setting, char *err, size_t err_size)
{
    const size_t bytes = sphere_bytes(&setting->sphere, err, err_size);
    if (!bytes)
        return NULL;
    struct grid *g = calloc(1, sizeof *g);
    void *memory = aligned_alloc(64, lines(bytes));
    if (!g || !memory) {
        snprintf(err, err_size, "no memory for a grid of %zu MiB", bytes >> 20);
        free(g);
        free(memory);
        return NULL;
    }
    g->setting = *setting;
    g->bytes = bytes;
    g->memory = memory;
    return g;
}

bool grid_step(struct grid *g)
{
    const size_t left = g->bytes - g->touched, n = left < STEP_BYTES ? left : STEP_BYTES;
    memset((char *)g->memory + g->touched, 0, n);
    g->touched += n;
    if (n < left)
        return false;
    g->sphere = sphere_init(g->memory, &g->setting.sphere);
    publish_stats(g);
    return true;
}

struct grid *grid_new(const struct grid_setting *setting, char *err, size_t err_size)
{
    struct grid *g = grid_begin(setting, err, err_size);
    while (g && !grid_step(g))
        ;
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

struct picture *grid_picture(struct grid *g)
{
    return sphere_picture(g->sphere);
}

void grid_stats(struct grid *g, struct sphere_stats *out)
{
    seqlock_load(&g->lock, out, g->stats, sizeof *out / 8);
}

size_t grid_clusters_bytes(struct grid *g)
{
    return g->clusters ? 0 : lines(clusters_bytes(grid_picture(g)->rings, g->setting.sphere.max_cells));
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
    g->bytes += bytes;
    return g->clusters;
}
