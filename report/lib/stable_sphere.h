/* SPDX-License-Identifier: MIT */
/* stable_sphere - a spherical grid of its own and single beams for it, for the cases of the catalogue. */
#ifndef SONARD_REPORT_STABLE_SPHERE_H
#define SONARD_REPORT_STABLE_SPHERE_H

#include "grid/sphere/sphere.h"
#include "grid/sphere/view.h"
#include "grid/water/store.h"

#define STABLE_SECOND UINT64_C(1000000000)

struct stable_sphere {
    struct sphere *sphere; /* of the heap: free it */
    struct store *store;   /* of the same pings; NULL: none is kept */
    struct pose pose;      /* that pings are sent with */
    uint64_t t_ns;         /* ... and when */
    uint32_t seq;
};

/* About as shipped, a single row. */
extern const struct sphere_conf stable_sphere_usual;

struct stable_sphere stable_sphere(const struct sphere_conf *conf);

/** stable_ping - a beam of 2 x 25 degrees, az_deg off the bow; an echo at range_m, or (0) silence and free water up to
 * free_m. */
void stable_ping(struct stable_sphere *s, double az_deg, double range_m, double free_m);

/** stable_direction - of an azimuth, level. stable_cell - the nearest cell there; zero: none. */
uint32_t stable_direction(struct stable_sphere *s, double az_deg);
struct sphere_cell stable_cell(struct stable_sphere *s, double az_deg);

#endif
