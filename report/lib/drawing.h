/* SPDX-License-Identifier: MIT */
/*
 * drawing - a scene of lines and arcs from a file, for the ray tracer of report_paper. One word and its numbers a line,
 * # begins a comment:
 *
 *     opening DEG         of the beam, at half power, both ways; [0.1, 30]
 *     range M             heard up to; (0, 1e5]
 *     layer M             thickness of the nearest layers; (0, 1e3]
 *     range_error SHARE   deviation of a range; [0, 0.1]
 *     places N            scanned from, along the path; [1, 1000]
 *     tilts N             elevations of each scan, an opening apart downward; [1, 20]
 *     path X Y X Y        from, to; 0 0 0 0 without
 *     swing M             of the path, in depth; [0, 1e4]
 *     yaw DEG             the vessel turns so far in the middle of a scan, unnoticed; [-180, 180]
 *     line X Y X Y
 *     arc X Y RADIUS FROM TO    degrees from x to y, 0 <= FROM < TO <= 360
 */
#ifndef SONARD_REPORT_DRAWING_H
#define SONARD_REPORT_DRAWING_H

#include <stdbool.h>

#include "core/fault.h"

#define DRAWING_EDGES 64

enum drawing_kind { DRAWING_LINE, DRAWING_ARC };

/* A line from a to b; or an arc around a with the radius b[0], from b[1] to b[2] in degrees counted from x to y. */
struct drawing_edge {
    enum drawing_kind kind;
    double a[2], b[3];
};

struct drawing {
    double opening_deg, range_m, layer_m, range_error, places, tilts;
    double path[4], swing_m, yaw_deg;
    struct drawing_edge edge[DRAWING_EDGES];
    unsigned edges;
};

/** drawing_read - the scene of a file; false with a sentence that names the line in fault. */
bool drawing_read(const char *path, struct drawing *out, struct fault *fault);

/** drawing_ray - from p along the angle (radians from x to y) to the nearest edge; INFINITY: none. */
double drawing_ray(const struct drawing *d, const double p[2], double angle);

/** drawing_length - of an edge. drawing_point - the point at a share t of it. */
double drawing_length(const struct drawing_edge *e);
void drawing_point(const struct drawing_edge *e, double t, double out[2]);

#endif
