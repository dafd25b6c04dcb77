/* SPDX-License-Identifier: MIT */
/* The table of JSON-RPC methods; each is in the module that its name begins with. sonard-protocol(7) documents them. */
#include "methods.h"

#include <stdlib.h>
#include <string.h>

#include "cell_methods.h"
#include "cluster_methods.h"
#include "daemon.h"
#include "grid_methods.h"
#include "submap_methods.h"
#include "where_methods.h"

const struct rpc_method daemon_methods[] = {
    {"blocked", direction_method_blocked, RPC_ASKS},
    {"explain", explain_method, RPC_ASKS},
    {"sectors", direction_method_sectors, RPC_ASKS},
    {"nearest", direction_method_nearest, RPC_ASKS},
    {"time_to_collision", motion_method_collision, RPC_ASKS},
    {"limit", motion_method_limit, RPC_ASKS},
    {"pose", pose_method, RPC_CHANGES},
    {"status", status_method, RPC_ASKS},
    {"sensors", status_method_sensors, RPC_ASKS},
    {"stats", stats_method, RPC_ASKS},
    {"plan", plan_method, RPC_ASKS},
    {"version", status_method_version, RPC_ASKS},
    {"image", image_method, RPC_ASKS},
    {"clusters", cluster_method_list, RPC_ASKS},
    {"next_look", cluster_method_next_look, RPC_ASKS},
    {"grid_lock", cell_method_lock, RPC_CHANGES},
    {"grid_list", grid_method_list, RPC_ASKS},
    {"grid_create", grid_method_create, RPC_CHANGES},
    {"grid_drop", grid_method_drop, RPC_CHANGES},
    {"background", template_method_show, RPC_ASKS},
    {"background_learn", template_method_learn, RPC_CHANGES},
    {"background_stop", template_method_stop, RPC_CHANGES},
    {"background_save", template_method_save, RPC_CHANGES},
    {"background_load", template_method_load, RPC_CHANGES},
    {"background_forget", template_method_forget, RPC_CHANGES},
    {"point", where_method_point, RPC_ASKS},
    {"box", where_method_box, RPC_ASKS},
    {"path", where_method_path, RPC_ASKS},
    {"map", places_method_map, RPC_ASKS},
    {"map_slice", places_method_slice, RPC_ASKS},
    {"map_new", places_method_new, RPC_CHANGES},
    {"map_forget", places_method_forget, RPC_CHANGES},
    {"map_submaps", submap_method_list, RPC_ASKS},
    {"map_move", submap_method_move, RPC_CHANGES},
    {"surface", submap_method_surface, RPC_ASKS},
    {"map_save", places_method_save, RPC_CHANGES},
    {"map_load", places_method_load, RPC_CHANGES},
    {"map_export", places_method_export, RPC_CHANGES},
    {"reload", reload_method, RPC_CHANGES},
    {.name = NULL},
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
