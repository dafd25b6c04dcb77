/* SPDX-License-Identifier: MIT */
#include "nmea_unused.h"

#include <inttypes.h>
#include <stdio.h>
#include <string.h>

#define SINCE(field) (now->field - before->field)

void nmea_unused_text(const struct nmea_came *before, const struct nmea_came *now, enum conf_nmea_use use,
                      const char *other, struct fault *text)
{
    const uint64_t no_checksum = SINCE(counts.no_checksum);
    const struct {
        uint64_t n;
        const char *why;
    } reason[] = {
        {no_checksum, "without checksum (set checksum = optional)"},
        {SINCE(counts.bad_checksum) - no_checksum, "with a wrong checksum (check baud rate and wiring)"},
        {SINCE(excluded), use == CONF_NMEA_DEPTH      ? "with a heading (left out by use = depth)"
                          : use == CONF_NMEA_ALTITUDE ? "with a heading (left out by use = altitude)"
                                                      : "with a depth (left out by use = heading)"},
        {SINCE(no_variation), "with a magnetic heading (set variation)"},
        {SINCE(counts.not_available), "with empty fields or marked as not valid"},
        {SINCE(counts.bad_sentence), "with senseless values"},
        {SINCE(counts.other), "of other kinds"},
    };
    char list[sizeof text->text] = "";
    size_t at = 0;
    uint64_t all = 0;

    for (size_t i = 0; i < sizeof reason / sizeof *reason; i++) {
        if (reason[i].n == 0 || at >= sizeof list)
            continue;
        all += reason[i].n;
        at += (size_t)snprintf(list + at, sizeof list - at, "%s%" PRIu64 " %s", at ? ", " : "", reason[i].n,
                               reason[i].why);
    }
    if (SINCE(counts.other) > 0 && other[0] && at < sizeof list)
        snprintf(list + at, sizeof list - at, " (the last is %s)", other);
    text->text[0] = '\0';
    if (all > 0)
        fault_set(text, "%" PRIu64 " sentence%s, none used: %s", all, all == 1 ? "" : "s", list);
}
