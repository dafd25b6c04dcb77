/* SPDX-License-Identifier: MIT */
/*
 * cdr - messages as ROS 2 has them on the wire and in bags, and the text that describes them. Sources: the Common Data
 * Representation (XCDR1, plain, little-endian) of the OMG's DDS-XTypes 1.3, 7.4; the MCAP format registry, "ros2msg".
 */
#ifndef SONARD_CDR_H
#define SONARD_CDR_H

#include <jansson.h>

#include "bytes.h"
#include "message.h"

/** cdr_schema - the fields of the type, and then those of each type that it is made of. */
void cdr_schema(const struct message_type *type, struct bytes *out);

/** cdr_message - a message of the type; members that are missing, or of another kind, are 0 or empty. */
void cdr_message(const struct message_type *type, const json_t *message, struct bytes *out);

#endif
