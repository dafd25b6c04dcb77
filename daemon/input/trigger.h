/* SPDX-License-Identifier: MIT */
/*
 * trigger - the line on which an edge marks every transmission of one sonar. A ping takes the time of the newest edge
 * that leaves room for its listening time before its last byte came in; an edge serves one ping. Without such an edge
 * the ping keeps the time that the device worked out.
 */
#ifndef SONARD_TRIGGER_H
#define SONARD_TRIGGER_H

#include "config/conf.h"
#include "grid/ping.h"
#include "pin.h"

#define TRIGGER_EDGES 32 /* that may wait for their pings */

/* Longest way from the end of listening to the last byte: a long frame at a low baud rate. */
#define TRIGGER_PATIENCE_NS 1500000000u

struct trigger {
    struct pin pin; /* not started in a replay */
    char purpose[CONF_NAME_MAX + 16];
    bool falling;
    double sound_speed_mps;
    uint64_t edge_ns[TRIGGER_EDGES]; /* oldest first */
    int n;
    uint64_t edges, used, not_used;                                   /* not_used: pings without an edge */
    void (*taken)(void *ctx, struct trigger *trigger, uint64_t t_ns); /* an edge came, live: to be recorded */
    void *ctx;
};

/** trigger_init - nothing is opened. */
void trigger_init(struct trigger *trigger, const struct conf_sonar *conf, double sound_speed_mps);

/** trigger_start - open the line. */
void trigger_start(struct trigger *trigger, const struct pin_chip *chip, const char *line,
                   void (*taken)(void *ctx, struct trigger *trigger, uint64_t t_ns), void *ctx);

/** trigger_edge - there was an edge at t_ns. */
void trigger_edge(struct trigger *trigger, uint64_t t_ns);

/** trigger_time - when the ping was transmitted: by its edge, or ping->t_ns. */
uint64_t trigger_time(struct trigger *trigger, const struct ping *ping);

void trigger_stop(struct trigger *trigger);

#endif
