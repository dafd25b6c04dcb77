/* SPDX-License-Identifier: MIT */
/* The last turn of a sonar as a picture; sonard-protocol(7) has its shape. */
#include <stdlib.h>

#include "methods.h"
#include "query_context.h"
#include "json_units.h"

#define ROWS_PER_PART 32

/* The echoes of a row, nearest first, with what speaks against each. */
static void write_echoes(struct json_out *out, const struct image_row *row)
{
    json_out_name(out, "echoes");
    json_out_open(out, '[');
    for (int i = 0; i < row->n_echoes; i++) {
        json_out_open(out, '{');
        json_member_metres(out, "range_m", (double)row->echo_m[i]);
        json_member_real(out, "confidence", (double)row->confidence[i], 1e3);
        json_out_name(out, "marks");
        json_out_open(out, '[');
        if (row->flags[i] & ECHO_BURST)
            json_out_word(out, "burst");
        if (row->flags[i] & ECHO_GHOST)
            json_out_word(out, "ghost");
        if (row->flags[i] & ECHO_FAINT)
            json_out_word(out, "faint");
        if (row->flags[i] & ECHO_ALONE)
            json_out_word(out, "alone");
        if (row->flags[i] & ECHO_OWN)
            json_out_word(out, "own");
        if (row->flags[i] & ECHO_OTHER)
            json_out_word(out, "other");
        json_out_put(out, "]}");
    }
    json_out_close(out, ']');
}

static void write_samples(struct json_out *out, const struct image_row *row)
{
    static const char digits[] = "0123456789abcdef";
    char hex[2 * IMAGE_BINS + 1];
    const uint32_t n = row->n_bins < IMAGE_BINS ? row->n_bins : IMAGE_BINS;
    for (uint32_t i = 0; i < n; i++) {
        hex[2 * i] = digits[row->bin[i] >> 4];
        hex[2 * i + 1] = digits[row->bin[i] & 15];
    }
    hex[2 * n] = '\0';
    json_member_word(out, "samples", hex);
}

static void write_row(const struct methods_env *d, int sensor, const struct image_row *row, struct json_out *out)
{
    static const char *const states[] = {[BEAM_ECHO] = "echo", [BEAM_SILENT] = "silent", [BEAM_BLIND] = "blind"};
    const bool echo = row->n_echoes > 0;
    double v[3], az, el;
    geo_direction((double)row->az_rad, 0, v);
    quat_rotate(d->mount[sensor].attitude, v, v);
    geo_angles(v, &az, &el);
    json_out_open(out, '{');
    json_member_degrees(out, "azimuth_deg", az);
    json_member_degrees(out, "width_deg", (double)row->width_rad);
    json_member_metres(out, "r0_m", (double)row->r0_m);
    json_member_metres(out, "r1_m", (double)row->r1_m);
    json_member_age(out, "age_s", (double)(loop_now(d->loop) - row->t_ns) * 1e-9);
    write_samples(out, row);
    json_member_known(out, "echo_m", echo, (double)row->echo_m[0], PER_METRES);
    json_member_known(out, "near_m", echo, (double)row->near_m, PER_METRES);
    write_echoes(out, row);
    json_member_metres(out, "blind_m", (double)row->blind_m);
    json_member_word(out, "state", states[row->state]);
    json_out_close(out, '}');
}

/* An image on its way, of one request. */
struct turn {
    int sensor;
    uint32_t next;      /* row */
    uint64_t oldest_ns; /* rows before are left out */
};

static struct turn *begin_image(struct methods_env *d, json_t *params, struct json_out *out,
                                struct rpc_error *error)
{
    int sensor;
    if (!sensor_asked(d, params, &sensor, error))
        return NULL;
    struct turn *turn = malloc(sizeof *turn);
    if (!turn) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for an image");
        return NULL;
    }
    *turn = (struct turn){.sensor = sensor};
    if (json_object_get(params, "newer_s")) {
        const double newer_ns = params_number(params, "newer_s") * 1e9, now_ns = (double)loop_now(d->loop);
        turn->oldest_ns = newer_ns < now_ns ? (uint64_t)(now_ns - newer_ns) : 0;
    }
    json_out_open(out, '{');
    json_member_word(out, "sensor", d->conf.sonar[sensor].name);
    json_member_word(out, "frame", "body");
    json_member_real(out, "t_unix", query_unix_s(d), 1e6);
    json_out_name(out, "rows");
    json_out_open(out, '[');
    return turn;
}

/* Some rows. */
static bool write_rows(const struct rpc_call *call, struct json_out *out, struct rpc_error *error)
{
    struct methods_env *d = call->daemon;
    struct turn *turn = call->work->state;
    (void)error;
    for (const uint32_t end = turn->next + ROWS_PER_PART; turn->next < end; turn->next++) {
        struct image_row row;
        image_row(pipeline_image(d->pipeline, turn->sensor), turn->next, &row);
        if (row.t_ns && row.t_ns >= turn->oldest_ns)
            write_row(d, turn->sensor, &row, out);
    }
    if (turn->next < IMAGE_ROWS)
        return rpc_continue(call, write_rows);
    json_out_put(out, "]}");
    return true; /* the work is dropped with the request */
}

bool method_image(const struct rpc_call *call, json_t *params, struct json_out *out, struct rpc_error *error)
{
    struct turn *turn = begin_image(call->daemon, params, out, error);
    if (!turn)
        return false;
    rpc_work_keep(call->work, turn, free);
    return write_rows(call, out, error);
}
