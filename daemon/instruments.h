/* SPDX-License-Identifier: MIT */
/*
 * instruments - what is on the vehicle beside the sonars: depth over Modbus, NMEA 0183. Makes and ends those that the
 * configuration names, and tells their state. A replay has none: their poses come from the capture.
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

/** instruments_status - sets "depth" and "nmea" in the answer to `status`: objects, null where there is none. */
void instruments_status(const struct daemon *d, json_t *status);

#endif
