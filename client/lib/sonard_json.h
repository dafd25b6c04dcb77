/* SPDX-License-Identifier: MIT */
/*
 * sonard_json - libsonard for callers within this tree, who have their JSON as jansson's values: read once, and not
 * made text between. A message's `json` is NULL here; its result is a new reference in *result, NULL: refused.
 */
#ifndef SONARD_JSON_H
#define SONARD_JSON_H

#include <jansson.h>

#include "sonard.h"

/** sonard_json_call - as sonard_call: params (an object, or NULL) are borrowed, the result is a new reference. */
json_t *sonard_json_call(struct sonard_client *client, const char *method, json_t *params,
                         struct sonard_error *error);

/** sonard_json_send - as sonard_send. */
int64_t sonard_json_send(struct sonard_client *client, const char *method, json_t *params,
                         struct sonard_error *error);

/** sonard_json_take - as sonard_take. */
bool sonard_json_take(struct sonard_client *client, double timeout_s, struct sonard_message *out, json_t **result,
                      struct sonard_error *error);

/** sonard_json_next - as sonard_next. */
bool sonard_json_next(struct sonard_client *client, double timeout_s, struct sonard_message *out, json_t **result,
                      struct sonard_error *error);

#endif
