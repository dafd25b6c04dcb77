/* SPDX-License-Identifier: MIT */
#include "sonard_json.h"

#include <stdlib.h>

static json_t *load(const char *json)
{
    return json ? json_loads(json, JSON_DECODE_ANY, NULL) : NULL;
}

json_t *sonard_json_call(struct sonard_client *client, const char *method, const json_t *params,
                         struct sonard_error *error)
{
    char *text = params ? json_dumps(params, JSON_COMPACT | JSON_ENCODE_ANY) : NULL;
    json_t *result = load(sonard_call(client, method, text, error));

    free(text);
    return result;
}

int64_t sonard_json_send(struct sonard_client *client, const char *method, const json_t *params,
                         struct sonard_error *error)
{
    char *text = params ? json_dumps(params, JSON_COMPACT | JSON_ENCODE_ANY) : NULL;
    const int64_t id = sonard_send(client, method, text, error);

    free(text);
    return id;
}

json_t *sonard_json_of(const struct sonard_message *message)
{
    return load(message->json);
}
