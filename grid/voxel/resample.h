/* SPDX-License-Identifier: MIT */
/*
 * resample - a submap whose base pose was corrected, read where the world's voxels are: a voxel of the world asks the
 * eight of the submap whose centres surround its own, and believes the least vacancy and the most echoes. Nearer than
 * 1e-9 of a voxel to a centre along an axis, the next one there has no say. Knows one submap, and no sum.
 */
#ifndef SONARD_RESAMPLE_H
#define SONARD_RESAMPLE_H

#include "voxmap.h"

/* From the world's cells to a submap's, counted from its box's first. */
struct resample {
    const struct submap *map;
    double axis[3][3]; /* the submap's axes in the world */
    double origin[3];  /* its base place, from the centre of the box's first cell */
    struct lattice_place to;
};

/* The least of the eight cells, each from -1 up to the last of the box,
 * and per axis whether the next one is asked too. */
struct resample_cell {
    int32_t least[3];
    bool pair[3];
};

void resample_of(struct resample *p, const struct voxmap_part *part);

/** resample_cell - for a cell of the world. False: none of the eight lies in the submap's box. */
bool resample_cell(const struct resample *p, const int64_t cell[3], struct resample_cell *out);

/** resample_meets - may a box of cells (size >= 1 each) hear anything:
 * is there a tile where it lies? Never a false no. */
bool resample_meets(const struct resample *p, const int64_t first[3], const int32_t size[3]);

/**
 * resample_column - the least vacancy and the most echoes for n cells of the world from `cell` downward, 0 where there
 * are none. The submap is here. Equal to resample_cell and the eight counts, bit for bit.
 */
void resample_column(const struct resample *p, const int64_t cell[3], int32_t n, uint8_t *vacancy,
                     uint8_t *echoes);

#endif
