/* SPDX-License-Identifier: MIT */
/* The last turn of a sonar as a picture; sonard-protocol(7) has its shape. */
#include <stdlib.h>

#include "methods.h"
#include "moment.h"
#include "say.h"

#define ROWS_PER_PART 32

/* The echoes of a row, nearest first, with what speaks against each. */
static void write_echoes(struct text *out, const struct image_row *row)
{
    text_name(out, "echoes");
    text_open(out, '[');
    for (int i = 0; i < row->n_echoes; i++) {
        text_open(out, '{');
        write_metres(out, "range_m", (double)row->echo_m[i]);
        text_name(out, "marks");
        text_open(out, '[');
        if (row->flags[i] & ECHO_BURST)
            text_word(out, "burst");
        if (row->flags[i] & ECHO_GHOST)
            text_word(out, "ghost");
        text_put(out, "]}");
    }
    text_close(out, ']');
}

static void write_samples(struct text *out, const struct image_row *row)
{
    static const char digits[] = "0123456789abcdef";
    char hex[2 * IMAGE_BINS + 1];
    const uint32_t n = row->n_bins < IMAGE_BINS ? row->n_bins : IMAGE_BINS;
    for (uint32_t i = 0; i < n; i++) {
        hex[2 * i] = digits[row->bin[i] >> 4];
        hex[2 * i + 1] = digits[row->bin[i] & 15];
    }
    hex[2 * n] = '\0';
    write_word(out, "samples", hex);
}

static void write_row(const struct daemon *d, int sensor, const struct image_row *row, struct text *out)
{
    static const char *const states[] = {[BEAM_ECHO] = "echo", [BEAM_SILENT] = "silent", [BEAM_BLIND] = "blind"};
    const bool echo = row->n_echoes > 0;
    double v[3], az, el;
    geo_direction((double)row->az_rad, 0, v);
    quat_rotate(d->mount[sensor].attitude, v, v);
    geo_angles(v, &az, &el);
    text_open(out, '{');
    write_degrees(out, "azimuth_deg", az);
    write_degrees(out, "width_deg", (double)row->width_rad);
    write_metres(out, "r0_m", (double)row->r0_m);
    write_metres(out, "r1_m", (double)row->r1_m);
    write_age(out, "age_s", (double)(loop_now(d->loop) - row->t_ns) * 1e-9);
    write_samples(out, row);
    write_known(out, "echo_m", echo, (double)row->echo_m[0], SAY_METRES);
    write_known(out, "near_m", echo, (double)row->near_m, SAY_METRES);
    write_echoes(out, row);
    write_metres(out, "blind_m", (double)row->blind_m);
    write_word(out, "state", states[row->state]);
    text_close(out, '}');
}

/* An image on its way, of one request. */
struct turn {
    int sensor;
    uint32_t next; /* row */
};

static struct turn *begin_image(struct daemon *d, json_t *params, struct text *out, struct rpc_error *error)
{
    static const char *const keys[] = {"sensor", NULL};
    const char *words[CONF_MAX_SONARS + 1] = {NULL};
    int sensor = 0;
    for (int i = 0; i < d->conf.n_sonars; i++)
        words[i] = d->conf.sonar[i].name;
    if (!rpc_only(params, keys, error) || !rpc_word(params, "sensor", words, &sensor, error))
        return NULL;
    struct turn *turn = malloc(sizeof *turn);
    if (!turn) {
        rpc_refuse(error, RPC_INTERNAL_ERROR, "no memory for an image");
        return NULL;
    }
    *turn = (struct turn){.sensor = sensor};
    text_open(out, '{');
    write_word(out, "sensor", d->conf.sonar[sensor].name);
    write_word(out, "frame", "body");
    write_real(out, "t_unix", moment_unix_s(d), 1e6);
    text_name(out, "rows");
    text_open(out, '[');
    return turn;
}

bool image_method(const struct rpc_call *call, json_t *params, struct text *out, struct rpc_error *error)
{
    struct daemon *d = call->daemon;
    struct turn *turn = call->work->state;
    if (!turn && !(turn = begin_image(d, params, out, error)))
        return false;
    *call->work = (struct rpc_work){.state = turn, .drop = free};
    for (const uint32_t end = turn->next + ROWS_PER_PART; turn->next < end; turn->next++) {
        struct image_row row;
        image_row(pipeline_image(d->pipeline, turn->sensor), turn->next, &row);
        if (row.t_ns)
            write_row(d, turn->sensor, &row, out);
    }
    if (turn->next < IMAGE_ROWS) {
        error->code = RPC_UNFINISHED;
        return false;
    }
    text_put(out, "]}");
    return true; /* the work is dropped with the request */
}
