/* SPDX-License-Identifier: MIT */
/*
 * plot - a polar picture of the echoes that the sonar received and of what the daemon concluded, as SVG: forward up,
 * clockwise. Works on results of the methods `image` and `sectors`; knows no socket.
 */
#ifndef SONARD_PLOT_H
#define SONARD_PLOT_H

#include <jansson.h>
#include <stdbool.h>
#include <stdio.h>

struct plot_conf {
    const char *title;         /* above the picture; NULL: "sonar NAME" from the image */
    double range_m;            /* at the rim of the disc; 0: the longest of the image, or of the sectors */
    const double *heading_deg; /* of the vehicle, clockwise from north; NULL: unknown, and north is not marked */
};

/**
 * plot_svg - write the picture to `out`. sectors in the body frame; either may be NULL (not drawn); members that are
 * missing or of the wrong kind are left out, numbers beyond any sonar are ignored. False when writing fails (errno).
 */
bool plot_svg(FILE *out, json_t *image, json_t *sectors, const struct plot_conf *conf);

#endif
