/* SPDX-License-Identifier: MIT */
#include "show.h"

#include <math.h>
#include <string.h>
#include <time.h>

#define CELL 128 /* bytes of one formatted value */

enum colour { PLAIN, RED, GREEN, YELLOW };

struct page {
    FILE *out;
    bool colour;
};

/* ---- values ---- */

static double number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);

    return json_is_number(value) ? json_number_value(value) : NAN;
}

static long long count(const json_t *object, const char *key)
{
    return (long long)json_integer_value(json_object_get(object, key));
}

/* Control characters (C0, DEL and the C1 of UTF-8) would be commands to a terminal. */
static const char *text(char cell[CELL], const json_t *object, const char *key)
{
    const char *s = json_string_value(json_object_get(object, key));
    size_t n = 0;

    for (; s && s[n] && n < CELL - 1; n++) {
        const unsigned char c = (unsigned char)s[n], before = n ? (unsigned char)s[n - 1] : 0;

        cell[n] = c < 0x20 || c == 0x7f || (before == 0xc2 && c < 0xa0) ? '?' : s[n];
    }
    cell[n] = '\0';
    return n > 0 ? cell : "-";
}

static const char *metres(char cell[CELL], double m)
{
    if (isnan(m))
        return "-";
    snprintf(cell, CELL, "%.2f m", m);
    return cell;
}

static const char *duration(char cell[CELL], double s)
{
    if (isnan(s))
        return "-";
    if (s < 9.95)
        snprintf(cell, CELL, "%.1f s", s);
    else if (s < 120)
        snprintf(cell, CELL, "%.0f s", s);
    else if (s < 7200)
        snprintf(cell, CELL, "%.0f min", s / 60);
    else if (s < 172800)
        snprintf(cell, CELL, "%.0f h", s / 3600);
    else
        snprintf(cell, CELL, "%.0f days", s / 86400);
    return cell;
}

static const char *utc(char cell[CELL], double t_unix)
{
    const time_t t = t_unix >= 0 && t_unix < 1e11 ? (time_t)t_unix : 0;
    struct tm tm;

    if (t == 0 || !gmtime_r(&t, &tm))
        return "-";
    strftime(cell, CELL, "%Y-%m-%d %H:%M:%S UTC", &tm);
    return cell;
}

/* ---- lines ---- */

static void print_word(const struct page *page, enum colour colour, int width, const char *word)
{
    static const char *const codes[] = {
        [PLAIN] = "", [RED] = "\033[31m", [GREEN] = "\033[32m", [YELLOW] = "\033[33m"};
    const bool coloured = page->colour && colour != PLAIN;

    fprintf(page->out, "%s%-*s%s", coloured ? codes[colour] : "", width, word, coloured ? "\033[0m" : "");
}

static enum colour state_colour(const char *state)
{
    return strcmp(state, "blocked") == 0 ? RED : strcmp(state, "clear") == 0 ? GREEN : YELLOW;
}

static void show_blocked(const struct page *page, const json_t *result)
{
    char a[CELL], b[CELL];
    const char *state = text(a, result, "state");

    print_word(page, state_colour(state), 0, state);
    if (json_is_number(json_object_get(result, "range_m"))) {
        fprintf(page->out, ": nearest obstacle at %s", metres(a, number(result, "range_m")));
        fprintf(page->out, " (sd %s, confidence %.2f)", metres(a, number(result, "range_sd_m")),
                number(result, "confidence"));
    }
    fputs("\n  free     ", page->out);
    if (number(result, "free_to_m") <= number(result, "blind_to_m"))
        fputs("none known\n", page->out);
    else
        fprintf(page->out, "%s to %s\n", metres(a, number(result, "blind_to_m")),
                metres(b, number(result, "free_to_m")));
    fprintf(page->out, "  age      %s\n", duration(a, number(result, "age_s")));
    fprintf(page->out, "  because  %s\n", text(a, result, "reason"));
}

static void show_sectors(const struct page *page, const json_t *result)
{
    static const char *const states[] = {"blocked", "clear", "unknown"};
    const json_t *list = json_object_get(result, "sectors");
    size_t total[3] = {0};
    char a[CELL], b[CELL], c[CELL];

    fprintf(page->out, "%s, azimuth clockwise from %s", utc(a, number(result, "t_unix")),
            strcmp(text(b, result, "frame"), "ned") == 0 ? "north" : "forward");
    if (json_is_null(json_object_get(result, "pose_age_s")))
        fputs(", no pose\n", page->out);
    else
        fprintf(page->out, ", pose %s old\n", duration(a, number(result, "pose_age_s")));
    fprintf(page->out, "%9s  %-8s %9s %10s %8s\n", "azimuth", "state", "range", "free to", "age");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *sector = json_array_get(list, i);
        const char *state = text(a, sector, "state");

        fprintf(page->out, "%7.1f° %*s", number(sector, "azimuth_deg"), 1, "");
        print_word(page, state_colour(state), 8, state);
        for (int k = 0; k < 3; k++)
            total[k] += strcmp(state, states[k]) == 0;
        fprintf(page->out, " %9s %10s %8s\n", metres(a, number(sector, "range_m")),
                number(sector, "free_to_m") > 0 ? metres(b, number(sector, "free_to_m")) : "-",
                duration(c, number(sector, "age_s")));
    }
    fprintf(page->out, "%zu blocked, %zu clear, %zu unknown%s\n", total[0], total[1], total[2],
            total[0] + total[1] == 0
                ? ": nothing is known of the water; `sonarctl status` says what sonar and pose do"
                : "");
}

static void show_clusters(const struct page *page, const json_t *result)
{
    const json_t *list = json_object_get(result, "clusters");
    const size_t n = json_array_size(list);
    char a[CELL], b[CELL], c[CELL], d[CELL];

    fprintf(page->out, "azimuth clockwise from %s\n",
            strcmp(text(a, result, "frame"), "ned") == 0 ? "north" : "forward");
    if (strcmp(text(a, result, "pose"), "old") == 0)
        fprintf(page->out, "the pose is old: this is how it was seen from the last one\n");
    fprintf(page->out, "%7s %10s %8s %9s %9s %7s %6s %9s %8s\n", "label", "from", "width", "near", "far", "cells",
            "sure", "last echo", "stable");
    for (size_t i = 0; i < n; i++) {
        const json_t *k = json_array_get(list, i);

        fprintf(page->out, "%7.0f %9.1f° %7.1f° %9s %9s %7.0f %5.0f%% %9s %8s%s\n", number(k, "label"),
                number(k, "from_deg"), number(k, "width_deg"), metres(a, number(k, "near_m")),
                metres(b, number(k, "far_m")), number(k, "cells"), 100 * number(k, "confidence"),
                duration(c, number(k, "last_echo_age_s")), duration(d, number(k, "label_age_s")),
                json_is_integer(json_object_get(k, "ghost_of")) ? "  a ghost?" : "");
    }
    fprintf(page->out, "%zu of %.0f, nearest first\n", n, number(result, "all"));
    list = json_object_get(result, "gone");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *g = json_array_get(list, i);

        fprintf(page->out, "%.0f is gone, %s ago, from %.1f°, %s: %s\n", number(g, "label"),
                duration(a, number(g, "age_s")), number(g, "azimuth_deg"), metres(b, number(g, "range_m")),
                text(c, g, "why"));
    }
    list = json_object_get(result, "walls");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *w = json_array_get(list, i);

        fprintf(page->out, "wall at %.1f°, %s, %s long\n", number(w, "normal_deg"),
                metres(a, number(w, "distance_m")), metres(b, number(w, "to_m") - number(w, "from_m")));
    }
}

static void show_next_look(const struct page *page, const json_t *result)
{
    const json_t *list = json_object_get(result, "directions");
    char a[CELL], b[CELL];

    fprintf(page->out, "azimuth clockwise from %s\n",
            strcmp(text(a, result, "frame"), "ned") == 0 ? "north" : "forward");
    fprintf(page->out, "%9s %10s %6s %9s  %s\n", "azimuth", "elevation", "score", "looked at", "why");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *l = json_array_get(list, i);

        fprintf(page->out, "%8.1f° %9.1f° %6.2f %9s  %s\n", number(l, "azimuth_deg"), number(l, "elevation_deg"),
                number(l, "score"), duration(a, number(l, "age_s")), text(b, l, "why"));
    }
}

/* The faults a sensor has counted, if any. */
static void show_faults(const struct page *page, const json_t *sensor)
{
    static const struct {
        const char *key, *label;
    } faults[] = {{"garbage_bytes", "bytes of garbage"},
                  {"bad_checksum", "bad checksums"},
                  {"bad_frame", "bad frames"},
                  {"lost_frames", "lost frames"},
                  {"nacks", "refused requests"},
                  {"timeouts", "timeouts"},
                  {"restarts", "restarts"},
                  {"reconnects", "reconnects"},
                  {"port_lost", "lost in the port"},
                  {"port_refused", "not taken by the far end"},
                  {"tap_lost_bytes", "bytes the tap's reader left"},
                  {"tap_refused_bytes", "bytes written to the tap"},
                  {"dropped", "pings dropped"}};
    const char *separator = "             ";
    char a[CELL];

    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
        if (count(sensor, faults[i].key) == 0)
            continue;
        fprintf(page->out, "%s%lld %s", separator, count(sensor, faults[i].key), faults[i].label);
        separator = ", ";
    }
    if (separator[0] == ',')
        fputc('\n', page->out);
    if (json_object_get(sensor, "port_error"))
        fprintf(page->out, "             %s\n", text(a, sensor, "port_error"));
}

/* A CAN bus that is not well, or was not. */
static void show_bus(const struct page *page, const json_t *bus)
{
    char a[CELL];
    const char *state = text(a, bus, "state");

    if (!json_is_object(bus) || (strcmp(state, "up") == 0 && count(bus, "error_frames") == 0))
        return;
    fprintf(page->out, "             CAN bus ");
    print_word(page, strcmp(state, "up") == 0 ? GREEN : RED, 0, state);
    fprintf(page->out, ", %lld error frames, %lld times off; errors sending %lld, receiving %lld\n",
            count(bus, "error_frames"), count(bus, "bus_offs"), count(bus, "tx_errors"), count(bus, "rx_errors"));
}

static void show_sensor(const struct page *page, const json_t *sensor)
{
    char a[CELL], b[CELL], c[CELL];
    const char *state = text(a, sensor, "state");

    fprintf(page->out, "  %-10s ", text(b, sensor, "name"));
    print_word(page, strcmp(state, "running") == 0 ? GREEN : RED, 0, state);
    fprintf(page->out, ", %s at %s\n", text(a, sensor, "device"), text(b, sensor, "port"));
    if (number(sensor, "range_m") > 0)
        fprintf(page->out, "             %s, range %s\n", text(a, sensor, "what"),
                metres(b, number(sensor, "range_m")));
    if (count(sensor, "pings") == 0)
        fputs("             no ping yet\n", page->out);
    else
        fprintf(page->out, "             %lld pings, the last %s ago\n", count(sensor, "pings"),
                duration(c, number(sensor, "last_ping_age_s")));
    show_faults(page, sensor);
    show_bus(page, json_object_get(sensor, "bus"));
}

static void show_pose(const struct page *page, const json_t *pose)
{
    const json_t *has = json_object_get(pose, "has");
    char a[CELL];

    fprintf(page->out, "pose       ");
    for (size_t i = 0; i < json_array_size(has); i++)
        fprintf(page->out, "%s%.20s", i ? ", " : "", json_string_value(json_array_get(has, i)));
    if (json_array_size(has) == 0)
        fprintf(page->out, "none given");
    else
        fprintf(page->out, "; %s old", duration(a, number(pose, "age_s")));
    fprintf(page->out, "; %lld taken, %lld refused\n", count(pose, "count"), count(pose, "refused"));
}

/* Depth, NMEA 0183 and leak probe, where there are any. */
static void show_instruments(const struct page *page, const json_t *result)
{
    const json_t *leak = json_object_get(result, "leak");
    const struct {
        const char *name, *good;
    } sources[] = {{"depth", "running"}, {"nmea", "open"}};
    char a[CELL], b[CELL];

    for (size_t i = 0; i < sizeof sources / sizeof *sources; i++) {
        const json_t *source = json_object_get(result, sources[i].name);
        if (!json_is_object(source))
            continue;
        const char *state = text(a, source, "state");
        fprintf(page->out, "%-11s", sources[i].name);
        print_word(page, strcmp(state, sources[i].good) == 0 ? GREEN : RED, 0, state);
        if (json_is_null(json_object_get(source, "age_s")))
            fprintf(page->out, ", nothing heard yet\n");
        else
            fprintf(page->out, ", the last value %s ago\n", duration(b, number(source, "age_s")));
        if (json_string_length(json_object_get(source, "error")) > 0)
            fprintf(page->out, "           %s\n", text(b, source, "error"));
    }
    if (!json_is_object(leak))
        return;
    const char *state = text(a, leak, "state");
    fprintf(page->out, "leak       ");
    print_word(page, strcmp(state, "dry") == 0 ? GREEN : RED, 0, state);
    fprintf(page->out, ", %lld alarms\n", count(leak, "alarms"));
    if (json_string_length(json_object_get(leak, "error")) > 0)
        fprintf(page->out, "           %s\n", text(b, leak, "error"));
}

static void show_record(const struct page *page, const json_t *record)
{
    char a[CELL];

    if (!json_is_object(record)) {
        fprintf(page->out, "recording  off\n");
        return;
    }
    fprintf(page->out, "recording  ");
    if (json_is_true(json_object_get(record, "recording")))
        fprintf(page->out, "to %s", text(a, record, "path"));
    else
        print_word(page, RED, 0, "stopped");
    fprintf(page->out, ", %lld messages, %lld lost\n", count(record, "messages"), count(record, "lost_messages"));
    if (count(record, "errors") > 0)
        fprintf(page->out, "           %lld errors, the last: %s\n", count(record, "errors"),
                text(a, record, "error"));
}

static void show_status(const struct page *page, const json_t *result)
{
    const json_t *sensors = json_object_get(result, "sensors"), *pipeline = json_object_get(result, "pipeline");
    const json_t *latency = json_object_get(pipeline, "latency_us"), *grid = json_object_get(result, "grid");
    const json_t *server = json_object_get(result, "server");
    char a[CELL], b[CELL];
    const char *data = text(a, result, "data");

    print_word(page, PLAIN, 11, "data");
    print_word(page, strcmp(data, "ok") == 0 ? GREEN : RED, 0, data);
    fprintf(page->out, "%s\n",
            strcmp(data, "ok") == 0 ? "" : ": every answer rests on what was heard before, if anything");
    fprintf(page->out, "sonard     %s, %s", text(a, result, "version"), text(b, result, "mode"));
    fprintf(page->out, ", up %s\n", duration(a, number(result, "uptime_s")));
    fprintf(page->out, "config     %s\n", text(a, result, "config"));
    fprintf(page->out, "sensors\n");
    for (size_t i = 0; i < json_array_size(sensors); i++)
        show_sensor(page, json_array_get(sensors, i));
    show_pose(page, json_object_get(result, "pose"));
    show_instruments(page, result);
    fprintf(page->out,
            "pipeline   %lld threads, %lld pings dropped; latency %.0f us median, %.0f us 99 %%, %.0f us most\n",
            count(pipeline, "threads"), count(pipeline, "dropped"), number(latency, "p50"), number(latency, "p99"),
            number(latency, "max"));
    fprintf(page->out, "grid       %lld of %lld directions pinged, %lld cells, %lld lost\n", count(grid, "pinged"),
            count(grid, "directions"), count(grid, "cells"), count(grid, "cells_lost"));
    fprintf(page->out, "clients    %lld now, %lld refused, %lld cut off; %lld requests, %lld errors\n",
            count(server, "clients_now"), count(server, "clients_refused"), count(server, "clients_cut"),
            count(server, "requests"), count(server, "errors"));
    show_record(page, json_object_get(result, "record"));
}

static void show_version(const struct page *page, const json_t *result)
{
    char a[CELL];

    fprintf(page->out, "sonard %s\n", text(a, result, "version"));
}

static void show_taken(const struct page *page, const json_t *result)
{
    (void)result;
    fprintf(page->out, "pose taken\n");
}

static void show_dropped(const struct page *page, const json_t *result)
{
    (void)result;
    fprintf(page->out, "dropped\n");
}

static void show_grid_line(const struct page *page, const json_t *g)
{
    char a[CELL], b[CELL], c[CELL], d[CELL];

    fprintf(page->out, "%-16s %9s %7.2f° %9s %8s %8.0f %6.1f MiB\n", text(a, g, "name"),
            metres(b, number(g, "range_m")), number(g, "angular_step_deg"), metres(c, number(g, "layer_m")),
            text(d, g, "sensor_model"), number(g, "cells"), number(g, "bytes") / 1048576);
}

static void show_grids(const struct page *page, const json_t *result)
{
    const json_t *list = json_object_get(result, "grids");

    fprintf(page->out, "%-16s %9s %8s %9s %8s %8s %10s\n", "grid", "range", "step", "layer", "model", "cells",
            "memory");
    for (size_t i = 0; i < json_array_size(list); i++)
        show_grid_line(page, json_array_get(list, i));
    fprintf(page->out, "%.1f of %.0f MiB\n", number(result, "bytes") / 1048576,
            number(result, "memory") / 1048576);
}

void show_result(FILE *out, const char *method, const json_t *result, bool colour)
{
    static const struct {
        const char *method;
        void (*show)(const struct page *page, const json_t *result);
    } forms[] = {{"blocked", show_blocked},     {"sectors", show_sectors}, {"clusters", show_clusters},
                 {"next_look", show_next_look}, {"status", show_status},   {"version", show_version},
                 {"pose", show_taken},          {"grid_list", show_grids}, {"grid_create", show_grid_line},
                 {"grid_drop", show_dropped}};
    const struct page page = {.out = out, .colour = colour};

    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
        if (strcmp(method, forms[i].method) == 0 && json_is_object(result)) {
            forms[i].show(&page, result);
            return;
        }
    }
    json_dumpf(result, out, JSON_INDENT(2) | JSON_ENCODE_ANY | JSON_REAL_PRECISION(13));
    fputc('\n', out);
}
