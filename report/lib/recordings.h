/* SPDX-License-Identifier: MIT */
/*
 * recordings - recordings of real sonars as the pings that a device would have made of them: the neutral text of
 * ../shared/data, and Ping-Viewer's logs. What cannot be shipped is looked for there and need not exist. Knows no
 * detector.
 */
#ifndef SONARD_REPORT_RECORDINGS_H
#define SONARD_REPORT_RECORDINGS_H

#include <stdbool.h>

#include "grid/ping.h"

#define RECORDINGS_MAX_BINS 1200

/* What the neutral text does not say of a head. */
struct recordings_head {
    enum amplitude_law law;
    double db_per_count, pulse_m, aperture_deg, ping_s;
    uint32_t turn;
};

extern const struct recordings_head recordings_ping360_2m, recordings_ping360_60m, recordings_micron,
    recordings_tritech_50m, recordings_tritech_10m;

/* One ping; bearing_deg as the file says, clockwise. */
typedef void recordings_use(void *ctx, const struct ping *ping, double bearing_deg);

/** recordings_text - every ping of `t,bearing,range_max,n,v...`; false: the file is not there. */
bool recordings_text(const char *path, const struct recordings_head *head, recordings_use *use, void *ctx);

/** recordings_ping_viewer - every device_data of a log with at least 200 samples; false: no such log. */
bool recordings_ping_viewer(const char *path, recordings_use *use, void *ctx);

#endif
