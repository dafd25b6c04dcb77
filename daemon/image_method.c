/* SPDX-License-Identifier: MIT */
/* The last turn of a sonar as a picture; sonard-protocol(7) has its shape. */
#include "methods.h"
#include "moment.h"
#include "say.h"

/* The echoes of a row, nearest first, with what speaks against each. */
static json_t *echoes_json(const struct image_row *row)
{
    json_t *echoes = json_array();
    for (int i = 0; i < row->n_echoes; i++) {
        json_t *marks = json_array();
        if (row->flags[i] & ECHO_BURST)
            json_array_append_new(marks, json_string("burst"));
        if (row->flags[i] & ECHO_GHOST)
            json_array_append_new(marks, json_string("ghost"));
        json_array_append_new(echoes,
                              json_pack("{s:o, s:o}", "range_m", say_metres(row->echo_m[i]), "marks", marks));
    }
    return echoes;
}

static json_t *row_json(const struct daemon *d, int sensor, const struct image_row *row)
{
    static const char *const states[] = {[BEAM_ECHO] = "echo", [BEAM_SILENT] = "silent", [BEAM_BLIND] = "blind"};
    static const char digits[] = "0123456789abcdef";
    char hex[2 * IMAGE_BINS + 1];
    uint32_t n = row->n_bins < IMAGE_BINS ? row->n_bins : IMAGE_BINS;
    for (uint32_t i = 0; i < n; i++) {
        hex[2 * i] = digits[row->bin[i] >> 4];
        hex[2 * i + 1] = digits[row->bin[i] & 15];
    }
    hex[2 * n] = '\0';
    double v[3], az, el;
    geo_direction(row->az_rad, 0, v);
    quat_rotate(d->mount[sensor].attitude, v, v);
    geo_angles(v, &az, &el);
    bool echo = row->n_echoes > 0;
    return json_pack("{s:o, s:o, s:o, s:o, s:o, s:s, s:o, s:o, s:o, s:o, s:s}", "azimuth_deg", say_degrees(az),
                     "width_deg", say_degrees(row->width_rad), "r0_m", say_metres(row->r0_m), "r1_m",
                     say_metres(row->r1_m), "age_s", say_age((double)(loop_now(d->loop) - row->t_ns) * 1e-9),
                     "samples", hex, "echo_m", echo ? say_metres(row->echo_m[0]) : json_null(), "near_m",
                     echo ? say_metres(row->near_m) : json_null(), "echoes", echoes_json(row), "blind_m",
                     say_metres(row->blind_m), "state", states[row->state]);
}

json_t *image_method(const struct rpc_call *call, json_t *params, struct rpc_error *error)
{
    static const char *const keys[] = {"sensor", NULL};
    struct daemon *d = call->daemon;
    const char *words[CONF_MAX_SONARS + 1] = {NULL};
    int sensor = 0;
    for (int i = 0; i < d->conf.n_sonars; i++)
        words[i] = d->conf.sonar[i].name;
    if (!rpc_only(params, keys, error) || !rpc_word(params, "sensor", words, &sensor, error))
        return NULL;
    json_t *rows = json_array();
    for (uint32_t i = 0; i < IMAGE_ROWS; i++) {
        struct image_row row;
        image_row(pipeline_image(d->pipeline, sensor), i, &row);
        if (row.t_ns)
            json_array_append_new(rows, row_json(d, sensor, &row));
    }
    return json_pack("{s:s, s:s, s:o, s:o}", "sensor", d->conf.sonar[sensor].name, "frame", "body", "t_unix",
                     say_real(moment_unix_s(d), 1e6), "rows", rows);
}
