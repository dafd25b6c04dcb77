/* SPDX-License-Identifier: MIT */
#include "cells_file.h"

#include <math.h>
#include <string.h>
#include <stdlib.h>
#include <unistd.h>

#include "drivers/capture/point_cloud.h"

/* What follows the position; the sensor's name comes last. */
static const char *const columns[] = {
    "position_sd_m", "azimuth_deg",      "elevation_deg",   "from_m", "to_m",   "near_m", "confidence",
    "blocks",        "first_echo_age_s", "last_echo_age_s", "echoes", "misses", "turn",   "locked"};

void cells_csv_head(FILE *out, bool ned)
{
    fprintf(out, ned ? "t_unix,north_m,east_m,down_m" : "t_unix,forward_m,right_m,down_m");
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++)
        fprintf(out, ",%s", columns[i]);
    fprintf(out, ",sensor\n");
}

/* An age that is null stays empty. */
static void write_value(FILE *out, const json_t *v)
{
    if (json_is_integer(v))
        fprintf(out, "%lld", (long long)json_integer_value(v));
    else if (json_is_real(v))
        fprintf(out, "%.10g", json_real_value(v));
    else if (json_is_boolean(v))
        fprintf(out, "%d", json_is_true(v));
    else if (json_is_string(v))
        fputs(json_string_value(v), out);
}

void cells_csv_row(FILE *out, const json_t *cell, double t_unix)
{
    const json_t *place = json_object_get(cell, "position_m");
    fprintf(out, "%.3f", t_unix);
    for (size_t a = 0; a < 3; a++) {
        fputc(',', out);
        write_value(out, json_array_get(place, a));
    }
    for (size_t i = 0; i < sizeof columns / sizeof *columns; i++) {
        fputc(',', out);
        write_value(out, json_object_get(cell, columns[i]));
    }
    fputc(',', out);
    write_value(out, json_object_get(cell, "sensor"));
    fputc('\n', out);
}

static const struct point_field fields[] = {{"x", POINT_FLOAT64},
                                            {"y", POINT_FLOAT64},
                                            {"z", POINT_FLOAT64},
                                            {"position_sd", POINT_FLOAT32},
                                            {"near", POINT_FLOAT32},
                                            {"confidence", POINT_FLOAT32},
                                            {"last_echo_age", POINT_FLOAT32},
                                            {"echoes", POINT_UINT16},
                                            {"blocks", POINT_UINT8},
                                            {"locked", POINT_UINT8},
                                            {NULL, POINT_UINT8}};

static double number(const json_t *cell, const char *name)
{
    return json_number_value(json_object_get(cell, name));
}

static uint8_t *put_cell(uint8_t *at, const json_t *cell, bool ned)
{
    const json_t *place = json_object_get(cell, "position_m");
    double v[3];
    for (size_t a = 0; a < 3; a++)
        v[a] = json_number_value(json_array_get(place, a));
    at = point_put_double(at, ned ? v[1] : v[0]);
    at = point_put_double(at, ned ? v[0] : -v[1]);
    at = point_put_double(at, -v[2]);
    at = point_put_float(at, number(cell, "position_sd_m"));
    at = point_put_float(at, number(cell, "near_m"));
    at = point_put_float(at, number(cell, "confidence"));
    at = point_put_float(at, number(cell, "last_echo_age_s"));
    at = point_put(at, (uint64_t)json_integer_value(json_object_get(cell, "echoes")), 2);
    at = point_put(at, json_is_true(json_object_get(cell, "blocks")), 1);
    return point_put(at, json_is_true(json_object_get(cell, "locked")), 1);
}

/* A double has no nanoseconds of our time: the fraction is taken apart from it. */
static uint64_t to_ns(double t_unix)
{
    const double second = floor(t_unix);
    return (uint64_t)second * 1000000000u + (uint64_t)((t_unix - second) * 1e9);
}

bool cells_capture(const json_t *cells, bool ned, double t_unix, int fd, struct fault *fault)
{
    const size_t bytes = json_array_size(cells) * point_bytes(fields);
    uint8_t *points = malloc(bytes + 1), *at = points;
    const json_t *cell;
    size_t i;
    if (!points) {
        close(fd);
        return fault_set(fault, "out of memory");
    }
    json_array_foreach(cells, i, cell) at = put_cell(at, cell, ned);
    const struct point_cloud cloud = {.t_unix_ns = to_ns(t_unix),
                                      .frame_id = ned ? "map" : "vehicle",
                                      .fields = fields,
                                      .points = points,
                                      .bytes = bytes};
    const bool ok = point_cloud_capture(&cloud, "/grid/cells", "sonarctl " SONARD_VERSION, fd, fault);
    free(points);
    return ok;
}
