/* SPDX-License-Identifier: MIT */
/*
 * voxveil - what of a map's echoes goes into its veil (veil.h): those of a submap that is forgotten, and those of a ping that
 * the current submap has no place or no memory for. Knows submaps; only voxmap.c calls it.
 */
#ifndef SONARD_VOXVEIL_H
#define SONARD_VOXVEIL_H

#include "voxmap.h"

#define VOXVEIL_HALF_DIAGONAL 0.8660254037844386 /* of a cube of side 1 */

/** voxveil_most - the most echoes of a column from level k to `end`, or `most` if that is more; and for each level where
 * something was heard the mark of its slice (part_slice). */
uint32_t voxveil_most(const struct tiles *t, const uint8_t *echoes, uint32_t k, uint32_t end, uint32_t most,
                      uint32_t *marks);

/** voxveil_keep - what a submap heard, as it has aged, wherever it lies by now. */
void voxveil_keep(struct voxmap *m, const struct voxmap_part *part);

/**
 * voxveil_echo - what the current submap could not keep of an echo from near_m to far_m of a beam: the shell is cast again
 * in cubes, wider by half of a cube's diagonal so that every cube which it touches has its centre in it. starved: memory
 * was full for some of it.
 */
void voxveil_echo(struct voxmap *m, const struct lattice_place *apex, const double attitude[4],
                  const struct beam_echoes *heard, double near_m, double far_m,
                  bool starved);

#endif
