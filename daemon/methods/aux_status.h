/* SPDX-License-Identifier: MIT */
/* aux_status - what `status` says of the auxiliary sensors; sonard-protocol(7) has its shape. */
#ifndef SONARD_AUX_STATUS_H
#define SONARD_AUX_STATUS_H

#include "daemon/methods/environment.h"
#include "daemon/rpc/json_out.h"

/**
 * aux_status_write - the members "depth", "nmea" and "leak": objects, null where there is none; and "gpio": lists of
 * the sonars' power switches and triggers.
 */
void aux_status_write(struct json_out *out, const struct methods_env *d);

#endif
