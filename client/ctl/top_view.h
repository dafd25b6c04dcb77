/* SPDX-License-Identifier: MIT */
/*
 * top_view - one frame of `sonarctl top` from results of the daemon: the sectors as a ring, and beside it what the
 * sonars, the pose and the pipeline do. Knows neither socket nor terminal. Nothing is drawn as clear that the daemon
 * has not just said.
 */
#ifndef SONARD_TOP_VIEW_H
#define SONARD_TOP_VIEW_H

#include <jansson.h>
#include <stdbool.h>

#include "canvas.h"

#define TOP_SENSORS_MAX 16

/* How often what counts up does; from two statuses. */
struct top_rates {
    double t_unix; /* of the newer; 0: none yet */
    double requests, requests_ps;
    struct {
        char name[32];
        double pings, pings_ps;
    } sensor[TOP_SENSORS_MAX];
    bool known; /* there were two */
};

struct top_frame {
    const json_t *sectors, *status, *stats; /* results; NULL: not known */
    const struct top_rates *rates;
    const char *fault; /* why nothing is known of the daemon; NULL: it speaks */
    double range_m;    /* of the ring's edge; 0: that of the sonar that listens farthest */
    bool help;         /* tell the keys */
};

/** top_rates_take - another status. The daemon's own clock is what counts: in a replay the capture's. */
void top_rates_take(struct top_rates *rates, const json_t *status);

/** top_view_draw - into a cleared canvas of any size. */
void top_view_draw(struct canvas *canvas, const struct top_frame *frame);

/** top_view_range - metres at the ring's edge. */
double top_view_range(const struct top_frame *frame);

#endif
