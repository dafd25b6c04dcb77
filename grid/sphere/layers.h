/* SPDX-License-Identifier: MIT */
/*
 * layers - the radial division of the spherical grid: thin layers of the sonar's resolution near the vehicle, then
 * layers that grow geometrically (Auran and Silven, 3.3). The table of edges is the truth; formulas only guess.
 */
#ifndef SONARD_LAYERS_H
#define SONARD_LAYERS_H

#include <stdbool.h>
#include <stdint.h>

#define LAYERS_MAX 0x7fffu /* as struct cell has 15 bits */

struct layers_conf {
    double r_min_m;   /* >= 0: near edge of layer 0 */
    double r_max_m;   /* > r_min_m: layers are added until this is covered */
    double dr_m;      /* > 0: thickness of the first n_const layers */
    uint32_t n_const; /* how many of them */
    double growth;    /* >= 1: each further layer is so many times thicker */
};

struct layers {
    struct layers_conf conf;
    uint32_t n;
    double log_growth;  /* 0: all layers are of the same thickness */
    const double *edge; /* [n + 1], strictly increasing; layer i is edge[i] <= r < edge[i + 1] */
};

/** layers_edge - edge i of the endless series: r_min + n_const*dr + dr*g*expm1(j*log1p(g-1))/(g-1). */
double layers_edge(const struct layers_conf *conf, uint32_t i);

/** layers_count - layers needed to cover r_max; 0 when conf is out of range or more than LAYERS_MAX are needed. */
uint32_t layers_count(const struct layers_conf *conf);

/** layers_init - fill edge[layers_count() + 1]. */
void layers_init(struct layers *layers, const struct layers_conf *conf, double *edge);

enum { LAYERS_BELOW = -1, LAYERS_BEYOND = -2 };

/** layers_index - the largest i with edge[i] <= r_m; LAYERS_BELOW, LAYERS_BEYOND (also for NaN) outside. O(1). */
int32_t layers_index(const struct layers *layers, double r_m);

/** layers_from - the same, walking from layer i of the table: in no time where the range is in it, or beside it. */
static inline int32_t layers_from(const struct layers *layers, double r_m, int32_t i)
{
    const double *edge = layers->edge;
    if (r_m < edge[0])
        return LAYERS_BELOW;
    if (!(r_m < edge[layers->n]))
        return LAYERS_BEYOND;
    while (r_m < edge[i])
        i--;
    while (r_m >= edge[i + 1])
        i++;
    return i;
}

#endif
