/* SPDX-License-Identifier: MIT */
/*
 * nmea_unused - why sentences that come in give no pose: what came since the last one that did, by reason, and the
 * sentence that says so. Pure: counts in, words out.
 */
#ifndef SONARD_NMEA_UNUSED_H
#define SONARD_NMEA_UNUSED_H

#include "config/conf.h"
#include "core/fault.h"
#include "drivers/nmea/nmea0183.h"

/* Counters that only grow. */
struct nmea_came {
    struct nmea_counts counts;
    uint64_t no_variation; /* magnetic headings, and nobody knows the variation */
    uint64_t excluded;     /* values that `use` leaves out */
};

/**
 * nmea_unused_text - "40 sentences, none used: 40 without checksum (set checksum = optional)", of what came between
 * two counts; empty: nothing that was refused. other: name of the last sentence of another kind, may be empty.
 */
void nmea_unused_text(const struct nmea_came *before, const struct nmea_came *now, enum conf_nmea_use use,
                      const char *other, struct fault *text);

#endif
