/* SPDX-License-Identifier: MIT */
/* sonard_json - libsonard for callers that have their JSON as jansson's values. Knows no method. */
#ifndef SONARD_JSON_H
#define SONARD_JSON_H

#include <jansson.h>

#include "sonard.h"

/** sonard_json_call - as sonard_call: params are borrowed, the result is a new reference. */
json_t *sonard_json_call(struct sonard_client *client, const char *method, const json_t *params,
                         struct sonard_error *error);

/** sonard_json_send - as sonard_send. */
int64_t sonard_json_send(struct sonard_client *client, const char *method, const json_t *params,
                         struct sonard_error *error);

/** sonard_json_of - the result in a message, a new reference; NULL when it was refused. */
json_t *sonard_json_of(const struct sonard_message *message);

#endif
