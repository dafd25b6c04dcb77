/* SPDX-License-Identifier: MIT */
/*
 * asked - what the daemon answers about directions (`blocked`, `sectors`), from a picture and the records of free water
 * of the same pings, in one go.
 */
#ifndef SONARD_REPORT_ASKED_H
#define SONARD_REPORT_ASKED_H

#include "daemon/pipeline/pipeline.h"
#include "grid/answer/obstacles.h"
#include "grid/water/store.h"

/* Who asks, and when. */
struct asking {
    struct picture *picture;
    struct answer_conf limits;
    struct answer_now now;
    double near_m; /* nearer water is the vehicle's own: near in [vehicle] */
};

/** asked_near_m - of the shipped vehicle. */
double asked_near_m(void);

/** asked_store - a new one for a single sensor that sends a beam a ping, to be given to free(); ends the program with a
 * sentence where there is no memory. */
struct store *asked_store(void);

/** asked_of_store - near_m of the query is that of who asks. parts: room for those of the query. */
void asked_of_store(const struct asking *asking, const struct store *store, const struct obstacles_query *query,
                    struct answer *parts);

/** asked_of_pipeline - the same of the pipeline's records. */
void asked_of_pipeline(struct pipeline *pipeline, const struct asking *asking, const struct obstacles_query *query,
                       struct answer *parts);

#endif
