/* SPDX-License-Identifier: MIT */
/*
 * grid - one spherical grid and all that belongs to it: its name, its limits, its counters for other threads, the
 * clusters made of it. Every ping goes into each of the pipeline's grids. Knows neither configuration nor sockets.
 */
#ifndef SONARD_GRID_H
#define SONARD_GRID_H

#include <stdbool.h>
#include <stddef.h>

#include "../grid/answer/answer.h"
#include "../grid/sphere/clusters.h"
#include "../grid/sphere/sphere.h"

#define GRID_NAME_MAX 32

struct grid_setting {
    char name[GRID_NAME_MAX];
    struct sphere_conf sphere;
    struct answer_conf limits;
};

struct grid {
    struct grid_setting setting;
    uint64_t number; /* no other of the pipeline's ever has it: it tells whether this one is still there */
    bool of_client;  /* made while the daemon runs, by a client who said its limits: no reload changes them */
    size_t bytes;    /* of its memory, the clusters' among it once they are made */
    void *memory;    /* of the sphere */
    size_t touched;  /* of that, while it is being made */
    struct sphere *sphere; /* of the maps' owner; of the loop while the pipeline is at rest; NULL: not made yet */
    struct seqlock lock;   /* of the counters */
    seqlock_word stats[sizeof(struct sphere_stats) / 8];
    struct clusters *clusters; /* made by the loop, and the owner's from then on; NULL until somebody asks */
};

/**
 * grid_begin - a grid with its memory, but no sphere; NULL with a sentence in err. grid_step touches a part of the
 * memory's pages, some tenths of a millisecond; true: that was the last, and the grid is made. grid_new does all at once.
 */
struct grid *grid_begin(const struct grid_setting *setting, char *err, size_t err_size);
bool grid_step(struct grid *g);
struct grid *grid_new(const struct grid_setting *setting, char *err, size_t err_size);

/** grid_free - no thread may know it any more. NULL is allowed. */
void grid_free(struct grid *g);

/** grid_enter - a ping, by the maps' owner. */
void grid_enter(struct grid *g, const struct echoes *e, const struct mount *mount);

/** grid_picture, grid_stats - for any thread. */
struct picture *grid_picture(struct grid *g);
void grid_stats(struct grid *g, struct sphere_stats *out);

/** grid_clusters_bytes - what the clusters will take in addition; 0: they are made. Loop thread. */
size_t grid_clusters_bytes(struct grid *g);

/** grid_clusters - made at the first call; NULL without memory. Loop thread. */
struct clusters *grid_clusters(struct grid *g);

#endif
