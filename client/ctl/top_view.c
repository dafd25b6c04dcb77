/* SPDX-License-Identifier: MIT */
#include "top_view.h"

#include <math.h>
#include <stdarg.h>
#include <string.h>
#include <time.h>

#include "top_ring.h"

#define RING_TOP     2
#define PANEL_MIN    30 /* columns beside the ring */
#define POSE_OLD_S   1.0
#define WARNINGS_MAX 5

/* Where the next line of the panel goes. */
struct panel {
    struct canvas *canvas;
    int column, row, warnings;
};

/* ---- values ---- */

static double number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

static const char *text(const json_t *object, const char *key)
{
    const char *s = json_string_value(json_object_get(object, key));
    return s ? s : "-";
}

/* An age or a range, short. */
static const char *short_number(char out[16], double v, const char *unit)
{
    if (isnan(v))
        return "-";
    snprintf(out, 16, v < 9.95 ? "%.1f %s" : "%.0f %s", v < 999999 ? v : 999999, unit);
    return out;
}

/* Half a number is a wrong one: what does not fit is left out by whole words. */
static void keep_whole_words(char *line, int width)
{
    if (width < 0 || strlen(line) <= (size_t)width)
        return;
    while (width > 0 && line[width] != ' ')
        width--;
    line[width] = '\0';
}

__attribute__((format(printf, 3, 4))) static void put(struct panel *panel, enum canvas_colour colour,
                                                      const char *fmt, ...)
{
    char line[512];
    va_list args;
    va_start(args, fmt);
    vsnprintf(line, sizeof line, fmt, args);
    va_end(args);
    keep_whole_words(line, panel->canvas->columns - panel->column);
    canvas_text(panel->canvas, panel->column, panel->row++, CANVAS_COLUMNS_MAX, colour, line);
}

/* ---- rates ---- */

static double rate(double newer, double older, double dt_s)
{
    return newer >= older && dt_s > 0 ? (newer - older) / dt_s : NAN; /* fewer: another daemon's count */
}

void top_rates_take(struct top_rates *rates, const json_t *status)
{
    const json_t *sensors = json_object_get(status, "sensors");
    const double t_unix = number(status, "t_unix"), dt_s = rates->t_unix > 0 ? t_unix - rates->t_unix : 0;
    const double requests = number(json_object_get(status, "server"), "requests");
    if (dt_s == 0 && rates->known) /* the clock stands: a replay at its end */
        return;
    for (size_t i = 0; i < json_array_size(sensors) && i < TOP_SENSORS_MAX; i++) {
        const json_t *sensor = json_array_get(sensors, i);
        const double pings = number(sensor, "pings");
        if (strncmp(rates->sensor[i].name, text(sensor, "name"), sizeof rates->sensor[i].name - 1) == 0)
            rates->sensor[i].pings_ps = rate(pings, rates->sensor[i].pings, dt_s);
        else
            rates->sensor[i].pings_ps = NAN;
        snprintf(rates->sensor[i].name, sizeof rates->sensor[i].name, "%s", text(sensor, "name"));
        rates->sensor[i].pings = pings;
    }
    rates->requests_ps = rate(requests, rates->requests, dt_s);
    rates->requests = requests;
    rates->known = rates->t_unix > 0;
    rates->t_unix = t_unix;
}

/* ---- warnings: what a person should do something about ---- */

__attribute__((format(printf, 2, 3))) static void warn(struct panel *panel, const char *fmt, ...)
{
    const int width = panel->canvas->columns - panel->column - 2; /* of a line; a warning has two */
    char line[256];
    va_list args;
    if (width <= 0 || panel->warnings++ >= WARNINGS_MAX)
        return;
    va_start(args, fmt);
    vsnprintf(line, sizeof line, fmt, args);
    va_end(args);
    put(panel, CANVAS_RED, "! %.*s", width, line);
    if ((int)strlen(line) > width)
        put(panel, CANVAS_RED, "  %s", line + width);
}

static void warn_of_sensors(struct panel *panel, const json_t *sensors)
{
    for (size_t i = 0; i < json_array_size(sensors); i++) {
        const json_t *sensor = json_array_get(sensors, i);
        if (strcmp(text(sensor, "state"), "running") != 0)
            warn(panel, "%.20s: %.40s", text(sensor, "name"), text(sensor, "state"));
        if (json_string_length(json_object_get(sensor, "port_error")) > 0)
            warn(panel, "%.20s: %.80s", text(sensor, "name"), text(sensor, "port_error"));
        if (json_is_string(json_object_get(sensor, "hearing_doubt")))
            warn(panel, "%.20s: %.100s", text(sensor, "name"), text(sensor, "hearing_doubt"));
        if (json_is_string(json_object_get(sensor, "amplitude_doubt")))
            warn(panel, "%.20s: %.80s", text(sensor, "name"), text(sensor, "amplitude_doubt"));
        if (json_is_string(json_object_get(sensor, "other_settings")))
            warn(panel, "%.20s: other settings: %.80s", text(sensor, "name"), text(sensor, "other_settings"));
        if (json_is_true(json_object_get(sensor, "contested")))
            warn(panel, "%.20s: answers get lost: another program, or a poor line?", text(sensor, "name"));
    }
}

static void draw_warnings(struct panel *panel, const json_t *status)
{
    const json_t *record = json_object_get(status, "record"), *leak = json_object_get(status, "leak");
    const double dropped = number(json_object_get(status, "pipeline"), "dropped");
    const double lost = number(json_object_get(status, "grid"), "cells_lost");
    const json_t *pose = json_object_get(status, "pose");
    const double pose_age_s = number(pose, "age_s");
    if (strcmp(text(leak, "state"), "wet") == 0)
        warn(panel, "LEAK: the probe is wet");
    warn_of_sensors(panel, json_object_get(status, "sensors"));
    if (pose_age_s > POSE_OLD_S)
        warn(panel, "the pose is %.0f s old", pose_age_s);
    if (json_string_length(json_object_get(pose, "drift")) > 0 &&
        strcmp(text(json_object_get(pose, "speed_bound"), "state"), "used") != 0)
        warn(panel, "no position: sonarctl status says what to set");
    if (dropped > 0)
        warn(panel, "%.0f pings dropped: too slow", dropped);
    if (lost > 0)
        warn(panel, "%.0f cells lost: max_cells", lost);
    if (number(record, "errors") > 0)
        warn(panel, "recording: %.80s", text(record, "error"));
    if (number(record, "lost_messages") > 0)
        warn(panel, "recording: %.0f messages lost", number(record, "lost_messages"));
    if (panel->warnings > WARNINGS_MAX)
        put(panel, CANVAS_RED, "! and %d more: sonarctl status", panel->warnings - WARNINGS_MAX);
    if (panel->warnings > 0)
        panel->row++;
}

/* ---- the panel ---- */

static void draw_sectors_sum(struct panel *panel, const json_t *sectors)
{
    const json_t *list = json_object_get(sectors, "sectors");
    int blocked = 0, clear = 0, unknown = 0;
    double nearest_m = INFINITY, azimuth_deg = 0;
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *sector = json_array_get(list, i);
        const char *state = text(sector, "state");
        const double range_m = number(sector, "range_m");
        blocked += strcmp(state, "blocked") == 0;
        clear += strcmp(state, "clear") == 0;
        unknown += strcmp(state, "blocked") != 0 && strcmp(state, "clear") != 0;
        if (range_m < nearest_m) {
            nearest_m = range_m;
            azimuth_deg = number(sector, "azimuth_deg");
        }
    }
    if (isfinite(nearest_m))
        put(panel, CANVAS_RED, "nearest  %.2f m at %.0f deg", nearest_m, azimuth_deg);
    else
        put(panel, CANVAS_PLAIN, "nearest  -");
    put(panel, CANVAS_PLAIN, "sectors  %d blocked  %d c  %d ?", blocked, clear, unknown);
}

static void draw_sensor(struct panel *panel, const json_t *sensor, double pings_ps)
{
    const bool good = strcmp(text(sensor, "state"), "running") == 0;
    const double faults = number(sensor, "bad_checksum"), timeouts = number(sensor, "timeouts");
    char a[16], b[16], c[16];
    put(panel, good ? CANVAS_GREEN : CANVAS_RED, "%.12s  %.20s  %.16s", text(sensor, "name"),
        text(sensor, "state"), text(sensor, "device"));
    put(panel, CANVAS_PLAIN, "  %s  %s  last %s", short_number(a, number(sensor, "range_m"), "m"),
        short_number(b, pings_ps, "pings/s"), short_number(c, number(sensor, "last_ping_age_s"), "s"));
    if (faults > 0 || timeouts > 0)
        put(panel, CANVAS_YELLOW, "  %.0f bad checksums, %.0f timeouts", fmax(faults, 0), fmax(timeouts, 0));
}

static void draw_pose(struct panel *panel, const json_t *pose)
{
    const json_t *has = json_object_get(pose, "has");
    const int width = panel->canvas->columns - panel->column;
    char a[16], line[64];
    int n = snprintf(line, sizeof line, "pose     %s",
                     json_array_size(has) ? short_number(a, number(pose, "age_s"), "s") : "none given");
    for (size_t i = 0; i < json_array_size(has); i++) {
        const char *part = json_string_value(json_array_get(has, i));
        if (n + 1 + (int)strnlen(part ? part : "?", 12) > width || n > 50) {
            put(panel, CANVAS_PLAIN, "%s", line);
            n = snprintf(line, sizeof line, "        ");
        }
        n += snprintf(line + n, sizeof line - (size_t)n, " %.12s", part ? part : "?");
    }
    put(panel, CANVAS_PLAIN, "%s", line);
    const json_t *heading = json_array_get(json_object_get(pose, "attitude_deg"), 2);
    if (heading)
        put(panel, CANVAS_PLAIN, "heading  %03.0f from north", fmod(round(json_number_value(heading)) + 360, 360));
    if (json_is_number(json_object_get(pose, "altitude_m")))
        put(panel, CANVAS_PLAIN, "altitude %s above the bottom", short_number(a, number(pose, "altitude_m"), "m"));
}

#define STAGE_COLUMNS 15
#define TIME_COLUMNS  8

static const struct latency {
    const char *title, *key;
} latencies[] = {{"max", "max_us"}, {"median", "p50_us"}, {"99 %", "p99_us"}}; /* the first is shown the longest */

static void draw_stage(struct panel *panel, const json_t *sample, int n)
{
    char line[STAGE_COLUMNS + 4 * TIME_COLUMNS];
    int used = snprintf(line, sizeof line, "%-*.*s", STAGE_COLUMNS, STAGE_COLUMNS,
                        text(json_object_get(sample, "labels"), "stage"));
    for (int i = 0; i < n; i++) {
        const double us = number(sample, latencies[i].key);
        char value[TIME_COLUMNS] = "> 10 s";
        if (!(us >= 1e7))
            snprintf(value, sizeof value, "%.0f", us);
        used += snprintf(line + used, sizeof line - (size_t)used, "%*s", TIME_COLUMNS, value);
    }
    put(panel, CANVAS_PLAIN, "%s", line);
}

/* Of the stages that took part: as many columns as fit. */
static void draw_latencies(struct panel *panel, const json_t *stats)
{
    const json_t *metrics = json_object_get(stats, "metrics");
    const int room = (panel->canvas->columns - panel->column - STAGE_COLUMNS) / TIME_COLUMNS;
    const int n = room < 1 ? 1 : room < 3 ? room : 3;
    for (size_t i = 0; i < json_array_size(metrics); i++) {
        const json_t *metric = json_array_get(metrics, i), *samples = json_object_get(metric, "samples");
        if (strcmp(text(metric, "name"), "sonard_latency_seconds") != 0)
            continue;
        put(panel, CANVAS_DIM, "%-*s%*s%*s%*s", STAGE_COLUMNS, "microseconds", TIME_COLUMNS, latencies[0].title,
            n > 1 ? TIME_COLUMNS : 0, n > 1 ? latencies[1].title : "", n > 2 ? TIME_COLUMNS : 0,
            n > 2 ? latencies[2].title : "");
        for (size_t k = 0; k < json_array_size(samples); k++) {
            const json_t *sample = json_array_get(samples, k);
            if (number(sample, "count") > 0)
                draw_stage(panel, sample, n);
        }
    }
}

static void draw_panel(struct panel *panel, const struct top_frame *frame)
{
    const json_t *status = frame->status, *sensors = json_object_get(status, "sensors");
    const json_t *server = json_object_get(status, "server"), *record = json_object_get(status, "record");
    char a[16];
    draw_warnings(panel, status);
    draw_sectors_sum(panel, frame->sectors);
    for (size_t i = 0; i < json_array_size(sensors) && i < TOP_SENSORS_MAX; i++)
        draw_sensor(panel, json_array_get(sensors, i),
                    frame->rates->known ? frame->rates->sensor[i].pings_ps : NAN);
    draw_pose(panel, json_object_get(status, "pose"));
    if (json_is_object(json_object_get(status, "depth")))
        put(panel, CANVAS_PLAIN, "depth    %s  %.20s",
            short_number(a, number(json_object_get(status, "depth"), "depth_m"), "m"),
            text(json_object_get(status, "depth"), "state"));
    put(panel, CANVAS_PLAIN, "clients  %.0f  %s", number(server, "clients_now"),
        short_number(a, frame->rates->known ? frame->rates->requests_ps : NAN, "requests/s"));
    if (json_is_object(record))
        put(panel, CANVAS_PLAIN, "record   %.0f messages", number(record, "messages"));
    draw_latencies(panel, frame->stats);
}

/* ---- the frame ---- */

double top_view_range(const struct top_frame *frame)
{
    const json_t *sensors = json_object_get(frame->status, "sensors");
    double range_m = frame->range_m;
    for (size_t i = 0; frame->range_m <= 0 && i < json_array_size(sensors); i++)
        range_m = fmax(range_m, number(json_array_get(sensors, i), "range_m"));
    return range_m;
}

static void draw_head(struct canvas *canvas, const struct top_frame *frame)
{
    const double t = number(frame->status, "t_unix");
    const time_t seconds = t >= 0 && t < 1e11 ? (time_t)t : 0;
    const char *data = text(frame->status, "data");
    char line[512], clock[32] = "";
    struct tm tm;
    int column;
    if (seconds > 0 && gmtime_r(&seconds, &tm))
        strftime(clock, sizeof clock, "%Y-%m-%d %H:%M:%S UTC", &tm);
    snprintf(line, sizeof line, "sonard %.20s  %.30s  %s", text(frame->status, "version"),
             text(frame->status, "mode"), clock);
    canvas_text(canvas, 0, 0, canvas->columns, CANVAS_PLAIN, frame->fault ? "sonard" : line);
    if (frame->fault) {
        canvas_text(canvas, 0, 1, canvas->columns, CANVAS_RED, frame->fault);
    } else if (strcmp(data, "ok") == 0) {
        column = canvas_text(canvas, 0, 1, 5, CANVAS_PLAIN, "data ");
        canvas_text(canvas, column, 1, canvas->columns, CANVAS_GREEN, data);
    } else {
        snprintf(line, sizeof line, "NO NEW DATA: %.400s", data);
        canvas_text(canvas, 0, 1, canvas->columns, CANVAS_RED, line);
    }
}

static void draw_foot(struct canvas *canvas, const struct top_frame *frame)
{
    const bool north = strcmp(text(frame->sectors, "frame"), "ned") == 0;
    const double range_m = top_view_range(frame);
    const int row = canvas->rows - 1;
    char line[160], a[16];
    int column;
    snprintf(line, sizeof line, "up is %s, edge %s  ", north ? "north" : "forward",
             short_number(a, range_m > 0 ? range_m : NAN, "m"));
    column = canvas_text(canvas, 0, row, canvas->columns, CANVAS_PLAIN, line);
    column = canvas_text(canvas, column, row, 18, CANVAS_RED, "0-9+ blocked at m ");
    column = canvas_text(canvas, column, row, 8, CANVAS_GREEN, "c clear ");
    column = canvas_text(canvas, column, row, 11, CANVAS_YELLOW, "? unknown  ");
    if (frame->help)
        canvas_text(canvas, column, row, canvas->columns, CANVAS_PLAIN, "q quit  + - range");
}

void top_view_draw(struct canvas *canvas, const struct top_frame *frame)
{
    const int high = canvas->rows - RING_TOP - 1, beside = (canvas->columns - PANEL_MIN) / 2;
    const int rows = high < beside ? high : beside;
    struct panel panel = {.canvas = canvas, .row = RING_TOP};
    draw_head(canvas, frame);
    if (rows >= 5) {
        top_ring_draw(canvas, frame->sectors, top_view_range(frame), 0, RING_TOP, rows);
        panel.column = 2 * rows + 1;
    }
    if (!frame->fault)
        draw_panel(&panel, frame);
    for (int column = 0; column < canvas->columns && canvas->rows > 0; column++) /* the panel may be too long */
        canvas->cell[canvas->rows - 1][column] = (struct canvas_cell){0};
    draw_foot(canvas, frame);
}
