/* SPDX-License-Identifier: MIT */
/*
 * voxresidual - what of a map's echoes goes into its residual (residual.h): those of a submap that is forgotten, and
 * those of a ping that the current submap has no place or no memory for. Knows submaps; only voxmap.c calls it.
 */
#ifndef SONARD_VOXRESIDUAL_H
#define SONARD_VOXRESIDUAL_H

#include "voxmap.h"

#define VOXRESIDUAL_HALF_DIAGONAL 0.8660254037844386 /* of a cube of side 1 */

/** voxresidual_keep - the echoes of a submap, as they have aged, wherever it lies by now. */
void voxresidual_keep(struct voxmap *m, const struct voxmap_part *part);

/**
 * voxresidual_echo - what the current submap could not keep of an echo, whose shell it was cast as: that is
 * cast again in cubes, wider by half of a cube's diagonal so that every cube which it touches has its centre in it.
 * starved: memory was full for some of it.
 */
void voxresidual_echo(struct voxmap *m, const struct cast_look *shell, bool starved);

#endif
