/* SPDX-License-Identifier: MIT */
/*
 * clusters - what the grid's cells form together: each connected component with a cell above the threshold of an
 * obstacle, measured. Made from the cells only when somebody asks; nothing is kept up in between but labels, so that
 * a cluster is known again the next time. Pure; all memory comes from the caller.
 *
 * Hysteresis: a cell belongs to a cluster from half the log-odds of an obstacle on; only one that is an obstacle
 * (a seed) makes its component a cluster.
 *
 * Of a grid with conf.cluster_relaxation, clusters are made of its cells after one step of that much (relax.h), as far
 * as max_cells has room: pieces with a gap of a cell between them become one. Places and ranges are those of cells
 * with echoes; cells, seeds and widths count the raised ones, too.
 */
#ifndef SONARD_CLUSTERS_H
#define SONARD_CLUSTERS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "components.h"
#include "sphere.h"
#include "vanish.h"

#define CLUSTERS_MAX 256 /* that are listed: the nearest */

/* Angles and places are NED (or the body's), from the grid's centre. */
struct cluster {
    uint32_t label;           /* the same as long as the cluster lives */
    uint32_t cells;           /* with some evidence */
    uint32_t seeds;           /* of these with enough to be an obstacle */
    uint32_t echoes;          /* that were entered into its cells, an echo over a beam's width into several */
    uint32_t appeared;        /* cells of its that had their first echo in the present turn, ... */
    uint32_t updated;         /* ... that had another one, ... */
    uint32_t missed;          /* ... and that beams passed without an echo */
    uint32_t locked;          /* cells that are */
    uint64_t t_label_ns;      /* since when it has its label: what it is has not changed since */
    uint64_t t_first_ns;      /* of its first echo */
    uint64_t t_echo_ns;       /* of its last */
    double from_rad;          /* azimuth at which it begins, clockwise */
    double width_rad;         /* and how wide it is: the turn without its largest gap */
    double low_rad, high_rad; /* elevations that its cells span */
    double near_m, far_m;     /* its near edge; its farthest echo */
    double nearest_m[3];      /* place of the echo with the nearest edge */
    double centre_m[3];       /* mean place of its cells' echoes */
    double logodds;           /* of its surest cell */
    /* Of its near edge since a look at least a second ago, if it was there then; what joined it counts, too. */
    double approach_mps;
    /* Directions that had been looked at, with nothing of any cluster in them then, and are in it now. */
    double growth_directions_ps;
};

#define CLUSTERS_GONE_MAX 32

/* One that was there at a look and not at the next, places as of then. */
struct cluster_gone {
    uint32_t label, cells;
    enum vanish_why why;
    uint64_t t_gone_ns, t_echo_ns; /* when it was missed; its last echo */
    double place_m[3];             /* where its nearest echo stood, from the grid's centre when it was missed */
};

struct clusters;

/** clusters_bytes - memory for a grid of these rings and up to max_cells cells. */
size_t clusters_bytes(const struct rings *rings, uint32_t max_cells);

/** clusters_init - none yet; rings are those of the grid, kept by reference. */
struct clusters *clusters_init(void *memory, const struct rings *rings, uint32_t max_cells,
                               double blocked_logodds);

/**
 * clusters_begin - a look at the clusters of the grid as of now_ns, in steps between which pings may come. A look that
 * was not over is forgotten. Looks of less than a second after one another do not count for approach and growth.
 */
void clusters_begin(struct clusters *c, uint64_t now_ns);

/**
 * clusters_step - a step of it: some CLUSTERS_STEP cells, of one that fell apart all. True: there is more. When the
 * grid moves again and again meanwhile, the last step puts all its cells at once. Cost of all: all cells of the grid,
 * and their neighbours.
 */
bool clusters_step(struct clusters *c, const struct sphere *s);

#define CLUSTERS_STEP 4096

/**
 * clusters_list - what the last whole look found: list[0..n-1], nearest first, with n <= CLUSTERS_MAX returned and *all
 * set to how many there are. It holds until the next look begins.
 */
uint32_t clusters_list(const struct clusters *c, const struct cluster **list, uint32_t *all);

/** clusters_look - a whole look at once, and its list. */
static inline uint32_t clusters_look(struct clusters *c, const struct sphere *s, uint64_t now_ns,
                                     const struct cluster **list, uint32_t *all)
{
    clusters_begin(c, now_ns);
    while (clusters_step(c, s))
        ;
    return clusters_list(c, list, all);
}

/**
 * clusters_gone - the k-th of those that vanished between two looks at least a second apart, the newest first; NULL:
 * there are fewer, or more than CLUSTERS_GONE_MAX vanished since. Those that joined others are not among them.
 */
const struct cluster_gone *clusters_gone(const struct clusters *c, uint32_t k);

#endif
