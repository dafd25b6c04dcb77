/* SPDX-License-Identifier: MIT */
/* track - a drive seen from above, as SVG: where it went, what held it, and what stood there. */
#ifndef SONARD_PILOT_TRACK_H
#define SONARD_PILOT_TRACK_H

#include "run.h"

/** track_write - false: the file cannot be written. */
bool track_write(const char *path, const struct pilot_case *c, const struct pilot_result *result,
                 const struct pilot_track *track);

#endif
