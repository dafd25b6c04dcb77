/* SPDX-License-Identifier: MIT */
#include "view_rows.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define SAME_DEG 0.02f /* rows whose azimuths differ by less are of one direction */
#define SAME_S   0.005 /* ages have milliseconds: times that differ by less are of one ping */

static double number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

static int digit(char c)
{
    return c >= '0' && c <= '9' ? c - '0' : c >= 'a' && c <= 'f' ? c - 'a' + 10 : -1;
}

static void read_bins(struct view_row *row, const char *hex)
{
    row->n_bins = 0;
    for (; hex && hex[0] && row->n_bins < VIEW_ROW_BINS; hex += 2) {
        const int high = digit(hex[0]), low = high >= 0 ? digit(hex[1]) : -1;
        if (low < 0)
            return;
        row->bin[row->n_bins++] = (uint8_t)(high << 4 | low);
    }
}

static void read_echoes(struct view_row *row, const json_t *echoes)
{
    row->n_echoes = 0;
    for (size_t i = 0; i < json_array_size(echoes) && row->n_echoes < VIEW_ROW_ECHOES; i++) {
        const json_t *echo = json_array_get(echoes, i), *marks = json_object_get(echo, "marks");
        uint8_t set = 0;
        for (size_t k = 0; k < json_array_size(marks); k++) {
            const char *mark = json_string_value(json_array_get(marks, k));
            set |= !mark ? 0 : strcmp(mark, "burst") == 0 ? 1 : strcmp(mark, "ghost") == 0 ? 2 : 4;
        }
        const double sure = number(echo, "confidence");

        row->echo_m[row->n_echoes] = (float)number(echo, "range_m");
        row->confidence[row->n_echoes] = sure > 0 ? (uint8_t)lround(fmin(sure, 1) * 100) : 0;
        row->marks[row->n_echoes++] = set;
    }
}

static bool read_row(struct view_row *row, const json_t *said, double now_unix)
{
    const char *state = json_string_value(json_object_get(said, "state"));
    *row = (struct view_row){
        .t_unix = now_unix - number(said, "age_s"),
        .az_deg = (float)number(said, "azimuth_deg"),
        .width_deg = (float)number(said, "width_deg"),
        .r0_m = (float)number(said, "r0_m"),
        .r1_m = (float)number(said, "r1_m"),
        .blind_m = (float)number(said, "blind_m"),
        .near_m = (float)number(said, "near_m"),
        .state = !state || strcmp(state, "blind") == 0 ? 2
                 : strcmp(state, "echo") == 0          ? 0
                                                       : 1,
    };
    if (!isfinite(row->t_unix) || !isfinite(row->az_deg) || !isfinite(row->width_deg) || !isfinite(row->r0_m) ||
        !isfinite(row->r1_m))
        return false;
    read_echoes(row, json_object_get(said, "echoes"));
    read_bins(row, json_string_value(json_object_get(said, "samples")));
    return true;
}

/* Where the row of that direction is or may be; NULL: there are too many. */
static struct view_row *place(struct view_rows *rows, float az_deg)
{
    for (size_t i = 0; i < VIEW_ROWS_MAX; i++) {
        struct view_row *row = &rows->row[i];
        if (!row->changed)
            return row; /* they fill up from the first */
        if (fabsf(row->az_deg - az_deg) < SAME_DEG)
            return row;
    }
    return NULL;
}

void view_rows_forget(struct view_rows *rows)
{
    for (size_t i = 0; i < VIEW_ROWS_MAX; i++)
        rows->row[i].changed = 0;
}

static int oldest_first(const void *a, const void *b)
{
    const json_t *const *x = a, *const *y = b;
    const double older = number(*x, "age_s"), newer = number(*y, "age_s");

    return (older < newer) - (older > newer);
}

/* The rows of an image come by azimuth. */
static size_t by_age(const json_t *said, const json_t *row[VIEW_ROWS_MAX])
{
    size_t n = json_array_size(said);
    n = n < VIEW_ROWS_MAX ? n : VIEW_ROWS_MAX;
    for (size_t i = 0; i < n; i++)
        row[i] = json_array_get(said, i);
    qsort(row, n, sizeof *row, oldest_first);
    return n;
}

void view_rows_take(struct view_rows *rows, const json_t *image)
{
    const json_t *said[VIEW_ROWS_MAX];
    const size_t n = by_age(json_object_get(image, "rows"), said);
    const char *sensor = json_string_value(json_object_get(image, "sensor"));
    struct view_row row;
    rows->t_unix = number(image, "t_unix");
    snprintf(rows->sensor, sizeof rows->sensor, "%s", sensor ? sensor : "");
    for (size_t i = 0; i < n; i++) {
        struct view_row *at;
        if (!read_row(&row, said[i], rows->t_unix) || !(at = place(rows, row.az_deg)))
            continue;
        if (at->changed && fabs(at->t_unix - row.t_unix) < SAME_S)
            continue;
        row.changed = ++rows->change;
        *at = row;
    }
}

/* ---- as bytes ---- */

static uint8_t *put_bits(uint8_t *at, uint64_t bits, int n)
{
    for (int i = 0; i < n; i++)
        at[i] = (uint8_t)(bits >> (8 * i));
    return at + n;
}

static uint8_t *put_double(uint8_t *at, double v)
{
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    return put_bits(at, bits, 8);
}

static uint8_t *put_float(uint8_t *at, float v)
{
    uint32_t bits;
    memcpy(&bits, &v, sizeof bits);
    return put_bits(at, bits, 4);
}

static uint8_t *put_row(uint8_t *at, const struct view_row *row)
{
    const float values[] = {row->az_deg, row->width_deg, row->r0_m, row->r1_m, row->blind_m, row->near_m};
    at = put_double(at, row->t_unix);
    for (size_t i = 0; i < sizeof values / sizeof *values; i++)
        at = put_float(at, values[i]);
    at = put_bits(at, row->state, 1);
    at = put_bits(at, row->n_echoes, 1);
    at = put_bits(at, row->n_bins, 2);
    for (int i = 0; i < row->n_echoes; i++)
        at = put_bits(put_bits(put_float(at, row->echo_m[i]), row->marks[i], 1), row->confidence[i], 1);
    memcpy(at, row->bin, row->n_bins);
    return at + row->n_bins;
}

static int by_change(const void *a, const void *b)
{
    const struct view_row *const *x = a, *const *y = b;

    return (*x)->changed < (*y)->changed ? -1 : 1;
}

size_t view_rows_part(const struct view_rows *rows, uint64_t *seen, uint8_t *out)
{
    const struct view_row *newer[VIEW_ROWS_MAX];
    const size_t name = strlen(rows->sensor);
    size_t n = 0;
    uint8_t *at = out;
    for (size_t i = 0; i < VIEW_ROWS_MAX && rows->row[i].changed; i++)
        if (rows->row[i].changed > *seen)
            newer[n++] = &rows->row[i];
    if (n == 0)
        return 0;
    qsort(newer, n, sizeof *newer, by_change);
    n = n < VIEW_ROWS_PART ? n : VIEW_ROWS_PART;
    at = put_bits(at, 1, 1);
    at = put_bits(at, name, 1);
    at = put_bits(at, n, 2);
    at = put_double(at, rows->t_unix);
    memcpy(at, rows->sensor, name);
    at += name;
    for (size_t i = 0; i < n; i++)
        at = put_row(at, newer[i]);
    *seen = newer[n - 1]->changed;
    return (size_t)(at - out);
}
