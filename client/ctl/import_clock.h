/* SPDX-License-Identifier: MIT */
/*
 * import_clock - the times of day in recordings of other programs. Pure.
 */
#ifndef SONARD_IMPORT_CLOCK_H
#define SONARD_IMPORT_CLOCK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/** import_clock - "hh:mm:ss.zzz" as n code points, digits of any script; false when it is no time of day. */
bool import_clock(const uint32_t *text, size_t n, uint64_t *t_ns);

#endif
