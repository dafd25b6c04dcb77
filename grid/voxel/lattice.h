/* SPDX-License-Identifier: MIT */
/*
 * lattice - the world's one grid of voxels: cell (i, j, k) covers i..i+1, j..j+1, k..k+1 voxels north, east and down of
 * NED's origin. Whole numbers carry the distance, so a map at 1e7 m is the map at 0 with other numbers. Knows no map.
 */
#ifndef SONARD_LATTICE_H
#define SONARD_LATTICE_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>

/* Whole numbers divided, rounded down. */
static inline int64_t floor_div(int64_t a, int64_t b)
{
    return a / b - (a % b < 0);
}

/* A place: the cell that holds it, and where in the cell it lies (in voxels from its lower corner). */
struct lattice_place {
    int64_t cell[3];
    double offset[3]; /* [0, 1] */
};

/* A box of cells. */
struct lattice_box {
    int64_t first[3];
    int32_t size[3]; /* cells; > 0 */
};

#define LATTICE_FARTHEST 1e15 /* voxels: beyond, a double no longer tells places within a cell apart */

/** lattice_place - the place of a position in metres. False when it is not finite, or farther than LATTICE_FARTHEST. */
static inline bool lattice_place(const double position_m[3], double voxel_m, struct lattice_place *out)
{
    for (int a = 0; a < 3; a++) {
        double p = position_m[a] / voxel_m, cell = floor(p);
        if (!(fabs(p) <= LATTICE_FARTHEST))
            return false;
        out->cell[a] = (int64_t)cell;
        out->offset[a] = p - cell;
    }
    return true;
}

static inline bool lattice_holds(const struct lattice_box *box, const int64_t cell[3])
{
    for (int a = 0; a < 3; a++)
        if ((uint64_t)cell[a] - (uint64_t)box->first[a] >= (uint64_t)box->size[a])
            return false;
    return true;
}

#endif
