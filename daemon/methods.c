/* SPDX-License-Identifier: MIT */
/* The table of JSON-RPC methods; each is in the module that its name begins with. sonard-protocol(7) documents them. */
#include "methods.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "cell_methods.h"
#include "cluster_methods.h"
#include "daemon.h"
#include "grid_methods.h"
#include "submap_methods.h"
#include "where_methods.h"

const struct rpc_method daemon_methods[] = {
    {"blocked", direction_method_blocked, RPC_ASKS, NULL},
    {"explain", explain_method, RPC_ASKS, NULL},
    {"sectors", NULL, RPC_ASKS, direction_method_sectors},
    {"nearest", direction_method_nearest, RPC_ASKS, NULL},
    {"time_to_collision", motion_method_collision, RPC_ASKS, NULL},
    {"limit", motion_method_limit, RPC_ASKS, NULL},
    {"pose", pose_method, RPC_CHANGES, NULL},
    {"status", status_method, RPC_ASKS, NULL},
    {"sensors", status_method_sensors, RPC_ASKS, NULL},
    {"stats", stats_method, RPC_ASKS, NULL},
    {"plan", plan_method, RPC_ASKS, NULL},
    {"version", status_method_version, RPC_ASKS, NULL},
    {"image", NULL, RPC_ASKS, image_method},
    {"clusters", NULL, RPC_ASKS, cluster_method_list},
    {"next_look", cluster_method_next_look, RPC_ASKS, NULL},
    {"grid_lock", cell_method_lock, RPC_CHANGES, NULL},
    {"grid_list", grid_method_list, RPC_ASKS, NULL},
    {"grid_create", grid_method_create, RPC_CHANGES, NULL},
    {"grid_drop", grid_method_drop, RPC_CHANGES, NULL},
    {"background", template_method_show, RPC_ASKS, NULL},
    {"background_learn", template_method_learn, RPC_CHANGES, NULL},
    {"background_stop", template_method_stop, RPC_CHANGES, NULL},
    {"background_save", template_method_save, RPC_CHANGES, NULL},
    {"background_load", template_method_load, RPC_CHANGES, NULL},
    {"background_forget", template_method_forget, RPC_CHANGES, NULL},
    {"point", where_method_point, RPC_ASKS, NULL},
    {"box", where_method_box, RPC_ASKS, NULL},
    {"path", where_method_path, RPC_ASKS, NULL},
    {"map", places_method_map, RPC_ASKS, NULL},
    {"map_slice", NULL, RPC_ASKS, places_method_slice},
    {"map_new", places_method_new, RPC_CHANGES, NULL},
    {"map_forget", places_method_forget, RPC_CHANGES, NULL},
    {"map_submaps", submap_method_list, RPC_ASKS, NULL},
    {"map_move", submap_method_move, RPC_CHANGES, NULL},
    {"surface", NULL, RPC_ASKS, submap_method_surface},
    {"map_save", places_method_save, RPC_CHANGES, NULL},
    {"map_load", places_method_load, RPC_CHANGES, NULL},
    {"map_export", places_method_export, RPC_CHANGES, NULL},
    {"reload", reload_method, RPC_CHANGES, NULL},
    {.name = NULL},
};

/* The sectors that these parameters ask for (taken over; NULL: those about the horizon), in a line of their own. */
static void write_line(struct daemon *d, const char *event, const char *sensor, json_t *params)
{
    struct rpc_work work = {0};
    const struct rpc_call call = {.daemon = d, .now_ns = loop_now(d->loop), .work = &work};
    struct rpc_error error;
    struct text out = {0};
    text_put(&out, "{\"event\":");
    text_word(&out, event);
    text_name(&out, "sensor");
    text_word(&out, sensor);
    text_name(&out, "turn");
    text_integer(&out, (int64_t)d->turns);
    if (params) {
        text_name(&out, "asked");
        text_json(&out, params);
    }
    text_name(&out, "sectors");
    if (rpc_answer(daemon_methods, &call, "sectors", params, &out, &error)) {
        text_bytes(&out, "}\n", 2);
        fwrite(out.bytes, 1, out.n, d->answers);
    }
    free(out.bytes);
    json_decref(params);
}

#define BAND_DEG 10.0 /* one of them about the horizon; those at the poles have half of it */

static void write_bands(struct daemon *d, const char *event, const char *sensor, const char *grid)
{
    for (double lo = -90 - BAND_DEG / 2; lo < 90; lo += BAND_DEG)
        write_line(d, event, sensor,
                   json_pack("{s:s, s:[f, f]}", "grid", grid, "elevation_deg", fmax(lo, -90), fmin(lo + BAND_DEG, 90)));
}

void daemon_write_answers(struct daemon *d, const char *event, const char *sensor)
{
    struct grid *grid;
    if (!d->options->bands)
        write_line(d, event, sensor, NULL);
    for (int i = 0; d->options->bands && (grid = pipeline_grid(d->pipeline, i)); i++)
        write_bands(d, event, sensor, grid->setting.name);
}
