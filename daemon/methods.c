/* SPDX-License-Identifier: MIT */
/* The table of JSON-RPC methods; each is in the module that its name begins with. sonard-protocol(7) documents them. */
#include "methods.h"

#include <stdlib.h>
#include <string.h>

#include "cluster_methods.h"
#include "daemon.h"

const struct rpc_method daemon_methods[] = {
    {"blocked", direction_method_blocked},
    {"sectors", direction_method_sectors},
    {"pose", pose_method},
    {"status", status_method},
    {"version", status_method_version},
    {"image", image_method},
    {"clusters", cluster_method_list},
    {"next_look", cluster_method_next_look},
    {"background", template_method_show},
    {"background_learn", template_method_learn},
    {"background_stop", template_method_stop},
    {"background_save", template_method_save},
    {"background_load", template_method_load},
    {"background_clear", template_method_clear},
    {"point", places_method_point},
    {"box", places_method_box},
    {"path", places_method_path},
    {"map", places_method_map},
    {"map_slice", places_method_slice},
    {"map_new", places_method_new},
    {"map_clear", places_method_clear},
    {"map_save", places_method_save},
    {"map_load", places_method_load},
    {"map_export", places_method_export},
    {NULL, NULL},
};

void daemon_write_answers(struct daemon *d, const char *event, const char *sensor)
{
    struct rpc_call call = {.daemon = d, .now_ns = loop_now(d->loop)};
    struct rpc_error error = {0};
    json_t *params = json_object();
    json_t *sectors = rpc_invoke(daemon_methods, &call, "sectors", params, &error);
    json_t *line = json_pack("{s:s, s:s, s:I, s:o}", "event", event, "sensor", sensor, "turn",
                             (json_int_t)d->turns, "sectors", sectors);
    char *text = json_dumps(line, JSON_COMPACT | JSON_REAL_PRECISION(15));
    if (text)
        fprintf(d->answers, "%s\n", text);
    free(text);
    json_decref(line);
    json_decref(params);
}
