/* SPDX-License-Identifier: MIT */
#include "answers_file.h"

#include <math.h>
#include <stdlib.h>

#include "daemon/methods/environment.h"
#include "methods.h"

/* The sectors that these parameters ask for (taken over; NULL: those about the horizon), in a line of their own. */
static void write_line(struct answers_file *a, const char *event, const char *sensor, json_t *params)
{
    struct rpc_work work = {0};
    const struct rpc_call call = {.daemon = a->d, .now_ns = loop_now(a->d->loop), .work = &work};
    struct rpc_error error;
    struct json_out out = {0};
    json_out_put(&out, "{\"event\":");
    json_out_word(&out, event);
    json_out_name(&out, "sensor");
    json_out_word(&out, sensor);
    json_out_name(&out, "turn");
    json_out_integer(&out, (int64_t)a->turns);
    if (params) {
        json_out_name(&out, "asked");
        json_out_value(&out, params);
    }
    json_out_name(&out, "sectors");
    enum rpc_outcome outcome;
    do
        outcome = rpc_answer(daemon_methods, &call, "sectors", params, &out, &error);
    while (outcome == RPC_MORE); /* it waits for nothing */
    rpc_work_end(&work);
    if (outcome == RPC_ANSWERED) {
        json_out_bytes(&out, "}\n", 2);
        fwrite(out.bytes, 1, out.n, a->file);
    }
    free(out.bytes);
    json_decref(params);
}

#define BAND_DEG 10.0 /* one of them about the horizon; those at the poles have half of it */

static void write_bands(struct answers_file *a, const char *event, const char *sensor, const char *grid)
{
    for (double lo = -90 - BAND_DEG / 2; lo < 90; lo += BAND_DEG)
        write_line(
            a, event, sensor,
            json_pack("{s:s, s:[f, f]}", "grid", grid, "elevation_deg", fmax(lo, -90), fmin(lo + BAND_DEG, 90)));
}

void answers_file_write(struct answers_file *a, const char *event, const char *sensor)
{
    struct grid *grid;
    if (!a->bands)
        write_line(a, event, sensor, NULL);
    for (int i = 0; a->bands && (grid = pipeline_grid(a->d->pipeline, i)); i++)
        write_bands(a, event, sensor, grid->setting.name);
}
