/* SPDX-License-Identifier: MIT */
/*
 * instruments - what is on the vehicle beside the sonars: depth over Modbus, NMEA 0183, and the lines of GPIO chips.
 * Makes and ends those that the configuration names, and tells their state. A replay opens none: the poses and the
 * edges of triggers come from the capture.
 */
#ifndef SONARD_INSTRUMENTS_H
#define SONARD_INSTRUMENTS_H

#include <jansson.h>

#include "daemon.h"

/** instruments_make - into *d, once its loop, poses and record are there. False with a sentence in err. */
bool instruments_make(struct daemon *d, char *err, size_t err_size);

/** instruments_start - open and ask. False with a sentence in err. */
bool instruments_start(struct daemon *d, char *err, size_t err_size);

/** instruments_end - also after instruments_make has failed. */
void instruments_end(struct daemon *d);

/** instruments_feed - a replay's message that is none of a sonar and no pose; false: not for an instrument. */
bool instruments_feed(struct daemon *d, const char *topic, const void *data, size_t size);

/**
 * instruments_status - sets "depth", "nmea" and "leak" in the answer to `status`: objects, null where there is none;
 * and "gpio": lists of the sonars' power switches and triggers.
 */
void instruments_status(const struct daemon *d, json_t *status);

#endif
