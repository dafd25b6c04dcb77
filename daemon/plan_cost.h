/* SPDX-License-Identifier: MIT */
/*
 * plan_cost - what each stage of a plan costs, or would: instructions and bytes. Bytes are what is taken at the start,
 * exactly. Instructions are a model: a table of what callgrind counted on recorded pings, times what the configuration
 * says of beams, bins and directions. Deterministic, so that configurations can be compared on any machine.
 */
#ifndef SONARD_PLAN_COST_H
#define SONARD_PLAN_COST_H

#include "plan.h"

/* What the measured machine took for an instruction (x86-64, gcc -O2; a Raspberry Pi 4 takes about three times as long). */
#define PLAN_NS_PER_INSTRUCTION 0.25

/* What is priced: the largest ping that a sonar can send, over all of its range, with one echo in every beam, all around
 * before it, at a place to which a grid's centre has to follow: PLAN_MOTION is that, the other stages are those of a vehicle
 * that stands still. */
struct plan_ping {
    double beams, bins;    /* bins: 1 where the sonar sends ready ranges */
    double az_rad, el_rad; /* opening of a beam at half power */
};

/* Beams of a fan lie side by side over so much at most. */
#define PLAN_FAN_RAD (GEO_TURN / 3)

/* Where that echo is, as a share of the range. */
#define PLAN_ECHO_AT 0.9

/** plan_ping - that of a sonar. */
struct plan_ping plan_ping(const struct conf_sonar *sonar);

/* Of a stage that is out: what it would cost. -1: nothing tells. */
struct plan_cost {
    double instructions; /* for the largest ping that comes by: of its sonar, or of all of them */
    double bytes;
};

/** plan_price - cost[k] is that of plan->stage[k]; *all: of those that are in. */
void plan_price(const struct plan *plan, const struct conf *conf, struct plan_cost cost[PLAN_STAGES_MAX],
                struct plan_cost *all);

#endif
