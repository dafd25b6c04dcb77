/* SPDX-License-Identifier: MIT */
/*
 * peer - another map of the same water: OctoMap, where its library is installed
 * (peer_octomap.cc), else none (peer_none.c).
 */
#ifndef SONARD_REPORT_PEER_H
#define SONARD_REPORT_PEER_H

#include <stdbool.h>
#include <stddef.h>

struct peer;

enum peer_state { PEER_UNKNOWN, PEER_FREE, PEER_OCCUPIED };

/** peer_make - empty, of cubes of voxel_m; NULL: there is no such library here. */
struct peer *peer_make(double voxel_m);
void peer_free(struct peer *p);

/** peer_enter - rays from a place (m) to n others, free all along up to most_m at most; what ends nearer than that ends
 * at something occupied. At most once a voxel for all rays together. */
void peer_enter(struct peer *p, const double from[3], const float (*to)[3], size_t n, double most_m);

/** peer_bytes - what its nodes take. */
size_t peer_bytes(const struct peer *p);

/** peer_at - of the voxel that holds a place. */
enum peer_state peer_at(const struct peer *p, const double at[3]);

#endif
