/* SPDX-License-Identifier: MIT */
/* counters - what is counted of the sensors, the pipeline and the server, by name and with a sentence each. */
#ifndef SONARD_COUNTERS_H
#define SONARD_COUNTERS_H

#include <stdint.h>

#include "daemon/pipeline/pipeline.h"
#include "daemon/rpc/server.h"
#include "daemon/input/source.h"

#define COUNTERS_MAX 24

struct counter {
    const char *name, *help;
    uint64_t value;
};

/* Each fills out[COUNTERS_MAX] and returns how many there are: always the same, in the same order. */
unsigned counters_sensor(const struct source_stats *s, uint64_t dropped, struct counter *out);
unsigned counters_pipeline(const struct pipeline_stats *s, struct counter *out);
unsigned counters_server(const struct server_stats *s, struct counter *out);

#endif
