/* SPDX-License-Identifier: MIT */
#include "show.h"

#include <math.h>
#include <string.h>

#include "page.h"
#include "show_answers.h"

/* In hundredths no more is free than there is. */
static double rounded_in(double m, double (*round_in)(double))
{
    return round_in(m * 100 + (round_in == floor ? 1e-6 : -1e-6)) / 100;
}

static void show_blocked(const struct page *page, const json_t *result)
{
    char a[PAGE_CELL], b[PAGE_CELL];
    const char *state = page_text(a, result, "state");
    page_word(page, page_state_colour(state), 0, state);
    if (json_is_number(json_object_get(result, "range_m"))) {
        fprintf(page->out, ": nearest obstacle at %s", page_metres(a, page_number(result, "range_m")));
        fprintf(page->out, " (sd %s, confidence %.2f)", page_metres(a, page_number(result, "range_sd_m")),
                page_number(result, "confidence"));
    }
    fputs("\n  free     ", page->out);
    if (page_number(result, "free_to_m") <= page_number(result, "blind_to_m"))
        fputs("none known\n", page->out);
    else
        fprintf(page->out, "%s to %s\n", page_metres(a, rounded_in(page_number(result, "blind_to_m"), ceil)),
                page_metres(b, rounded_in(page_number(result, "free_to_m"), floor)));
    fprintf(page->out, "  age      %s\n", page_duration(a, page_number(result, "age_s")));
    fprintf(page->out, "  because  %s\n", page_text(a, result, "reason"));
    page_target(page, result);
}

#define MANY 8 /* blocked sectors that may surprise somebody */

static void show_sectors(const struct page *page, const json_t *result)
{
    static const char *const states[] = {"blocked", "clear", "unknown"};
    const json_t *list = json_object_get(result, "sectors");
    size_t total[3] = {0};
    char a[PAGE_CELL], b[PAGE_CELL], c[PAGE_CELL], d[PAGE_CELL];
    const bool north = strcmp(page_text(b, result, "frame"), "ned") == 0;
    const bool no_pose = json_is_null(json_object_get(result, "pose_age_s"));
    fprintf(page->out, "%s, azimuth clockwise from %s", page_utc(a, page_number(result, "t_unix")),
            north ? "north" : "forward");
    if (json_is_number(json_object_get(result, "distance_m")))
        fprintf(page->out, ", judged to %s", page_metres(a, rounded_in(page_number(result, "distance_m"), floor)));
    if (no_pose)
        fputs(", no pose\n", page->out);
    else
        fprintf(page->out, ", pose %s old\n", page_duration(a, page_number(result, "pose_age_s")));
    fprintf(page->out, "%9s  %-8s %9s %9s %8s %8s\n", "azimuth", "state", "range", "free from", "to", "age");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *sector = json_array_get(list, i);
        const char *state = page_text(a, sector, "state");
        fprintf(page->out, "%7.1f° %*s", page_number(sector, "azimuth_deg"), 1, "");
        page_word(page, page_state_colour(state), 8, state);
        for (int k = 0; k < 3; k++)
            total[k] += strcmp(state, states[k]) == 0;
        const bool free = page_number(sector, "free_to_m") > page_number(sector, "blind_to_m");

        fprintf(page->out, " %9s %9s %8s %8s\n", page_metres(a, page_number(sector, "range_m")),
                free ? page_metres(b, page_number(sector, "blind_to_m")) : "-",
                free ? page_metres(c, page_number(sector, "free_to_m")) : "-",
                page_duration(d, page_number(sector, "age_s")));
    }
    const char *why =
        json_is_string(json_object_get(result, "why_none_clear")) ? page_text(a, result, "why_none_clear") : "";

    fprintf(page->out, "%zu blocked, %zu clear, %zu unknown%s%s\n", total[0], total[1], total[2], *why ? ": " : "",
            why);
    page_target(page, result);
    if (total[0] >= MANY && 4 * total[0] >= 3 * (total[0] + total[1] + total[2]))
        fprintf(page->out,
                "Blocked all around, though the water looks free? See docs/everything-is-blocked.md.\n");
}

static void show_clusters(const struct page *page, const json_t *result)
{
    const json_t *list = json_object_get(result, "clusters");
    const size_t n = json_array_size(list);
    char a[PAGE_CELL], b[PAGE_CELL], c[PAGE_CELL], d[PAGE_CELL];
    fprintf(page->out, "azimuth clockwise from %s\n",
            strcmp(page_text(a, result, "frame"), "ned") == 0 ? "north" : "forward");
    if (strcmp(page_text(a, result, "pose"), "old") == 0)
        fprintf(page->out, "the pose is old: positions are relative to the last one\n");
    fprintf(page->out, "%7s %10s %8s %9s %9s %7s %6s %9s %8s\n", "label", "from", "width", "near", "far", "cells",
            "sure", "last echo", "stable");
    for (size_t i = 0; i < n; i++) {
        const json_t *k = json_array_get(list, i);
        fprintf(page->out, "%7.0f %9.1f° %7.1f° %9s %9s %7.0f %5.0f%% %9s %8s%s\n", page_number(k, "label"),
                page_number(k, "from_deg"), page_number(k, "width_deg"), page_metres(a, page_number(k, "near_m")),
                page_metres(b, page_number(k, "far_m")), page_number(k, "cells"),
                100 * page_number(k, "confidence"), page_duration(c, page_number(k, "last_echo_age_s")),
                page_duration(d, page_number(k, "label_age_s")),
                json_is_integer(json_object_get(k, "ghost_of")) ? "  a ghost?" : "");
        if (page_number(k, "locked") > 0)
            fprintf(page->out, "%7s %lld cell%s locked\n", "", page_count(k, "locked"),
                    page_plural(page_count(k, "locked")));
    }
    fprintf(page->out, "%zu of %.0f, nearest first\n", n, page_number(result, "all"));
    list = json_object_get(result, "gone");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *g = json_array_get(list, i);
        fprintf(page->out, "%.0f is gone, %s ago, from %.1f°, %s: %s\n", page_number(g, "label"),
                page_duration(a, page_number(g, "age_s")), page_number(g, "azimuth_deg"),
                page_metres(b, page_number(g, "range_m")), page_text(c, g, "why"));
    }
    list = json_object_get(result, "walls");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *w = json_array_get(list, i);
        fprintf(page->out, "wall at %.1f°, %s, %s long\n", page_number(w, "normal_deg"),
                page_metres(a, page_number(w, "distance_m")),
                page_metres(b, page_number(w, "to_m") - page_number(w, "from_m")));
    }
    list = json_object_get(result, "arcs");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *arc = json_array_get(list, i), *centre = json_object_get(arc, "centre_m");
        fprintf(page->out, "arc of radius %s around %.2f, %.2f m\n", page_metres(a, page_number(arc, "radius_m")),
                json_number_value(json_array_get(centre, 0)), json_number_value(json_array_get(centre, 1)));
    }
    list = json_object_get(result, "regions");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *r = json_array_get(list, i);
        fprintf(page->out, "constant depth from %.1f°, %.1f° wide, at %s\n", page_number(r, "from_deg"),
                page_number(r, "width_deg"), page_metres(a, page_number(r, "least_m")));
    }
}

static void show_next_look(const struct page *page, const json_t *result)
{
    const json_t *list = json_object_get(result, "directions");
    char a[PAGE_CELL], b[PAGE_CELL];
    fprintf(page->out, "azimuth clockwise from %s\n",
            strcmp(page_text(a, result, "frame"), "ned") == 0 ? "north" : "forward");
    fprintf(page->out, "%9s %10s %6s %9s  %s\n", "azimuth", "elevation", "score", "observed", "why");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *l = json_array_get(list, i);
        fprintf(page->out, "%8.1f° %9.1f° %6.2f %9s  %s\n", page_number(l, "azimuth_deg"),
                page_number(l, "elevation_deg"), page_number(l, "score"),
                page_duration(a, page_number(l, "age_s")), page_text(b, l, "why"));
    }
}

/* The faults a sensor has counted, if any. */
static void show_faults(const struct page *page, const json_t *sensor)
{
    static const struct {
        const char *key, *one, *many;
    } faults[] = {{"garbage_bytes", "byte of garbage", "bytes of garbage"},
                  {"cut_bytes", "byte of a cut message", "bytes of cut messages"},
                  {"bad_checksum", "bad checksum", "bad checksums"},
                  {"bad_frame", "bad frame", "bad frames"},
                  {"lost_frames", "lost frame", "lost frames"},
                  {"nacks", "refused request", "refused requests"},
                  {"timeouts", "timeout", "timeouts"},
                  {"restarts", "restart", "restarts"},
                  {"taken_over", "takeover by another program", "takeovers by another program"},
                  {"reconnects", "reconnect", "reconnects"},
                  {"port_lost", "lost in the port", "lost in the port"},
                  {"port_refused",
                   "datagram refused: nothing listens there (is the bridge running, on this port?)",
                   "datagrams refused: nothing listens there (is the bridge running, on this port?)"},
                  {"port_strangers", "message of another sender", "messages of other senders"},
                  {"tap_lost_bytes", "byte not read from the tap", "bytes not read from the tap"},
                  {"tap_refused_bytes", "byte written to the tap", "bytes written to the tap"},
                  {"dropped", "ping dropped", "pings dropped"}};
    const char *separator = "             ";
    char a[PAGE_CELL];

    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
        const long long n = page_count(sensor, faults[i].key);
        if (n == 0)
            continue;
        fprintf(page->out, "%s%lld %s", separator, n, n == 1 ? faults[i].one : faults[i].many);
        separator = ", ";
    }
    if (separator[0] == ',')
        fputc('\n', page->out);
    if (json_object_get(sensor, "port_error"))
        fprintf(page->out, "             %s\n", page_text(a, sensor, "port_error"));
}

/* A CAN bus that is not well, or was not. */
static void show_bus(const struct page *page, const json_t *bus)
{
    char a[PAGE_CELL];
    const char *state = page_text(a, bus, "state");
    const long long errors = page_count(bus, "error_frames"), offs = page_count(bus, "bus_offs");
    if (!json_is_object(bus) || (strcmp(state, "up") == 0 && errors == 0))
        return;
    fprintf(page->out, "             CAN bus ");
    page_word(page, strcmp(state, "up") == 0 ? PAGE_GREEN : PAGE_RED, 0, state);
    fprintf(page->out, ", %lld error frame%s, %lld time%s off; errors sending %lld, receiving %lld\n", errors,
            page_plural(errors), offs, page_plural(offs), page_count(bus, "tx_errors"),
            page_count(bus, "rx_errors"));
}

/* Which obstacles its free water speaks of, and what is known of the vehicle's own echoes. */
static void show_evidence(const struct page *page, const json_t *sensor)
{
    const json_t *detects = json_object_get(sensor, "detects");
    const long long own = page_count(sensor, "own_bearings");
    char a[PAGE_CELL], b[PAGE_CELL];
    if (json_is_object(detects)) {
        const bool prior = strcmp(page_text(b, detects, "from"), "prior") == 0;
        const char *target = page_text(a, detects, "target");
        fprintf(page->out, "             detection threshold %.1f dB (%lld counts) for %s %s, %s\n",
                page_number(detects, "level_db"), page_count(detects, "counts"),
                strstr(target, "below") ? "an obstacle" : "a", target,
                prior ? "the default of all sonars" : "measured on this sonar");
        if (json_is_number(json_object_get(detects, "bottom_db")))
            fprintf(page->out, "             detects a bottom down to %.4g dB below a wall, none that is softer\n",
                    page_number(detects, "bottom_db"));
        if (json_is_true(json_object_get(detects, "noisy")))
            fputs("             its noise is as loud as that bottom, so nothing is free: lower the gain, or set\n"
                  "             bottom; see docs/everything-is-blocked.md\n",
                  page->out);
    }
    if (own > 0)
        fprintf(page->out, "             an echo of the vehicle itself at %lld of 400 bearings\n", own);
}

static void show_sensor(const struct page *page, const json_t *sensor)
{
    char a[PAGE_CELL], b[PAGE_CELL], c[PAGE_CELL];
    const char *state = page_text(a, sensor, "state");
    const long long pings = page_count(sensor, "pings");
    fprintf(page->out, "  %-10s ", page_text(b, sensor, "name"));
    page_word(page, strcmp(state, "running") == 0 ? PAGE_GREEN : PAGE_RED, 0, state);
    fprintf(page->out, ", %s at %s\n", page_text(a, sensor, "device"), page_text(b, sensor, "port"));
    if (page_number(sensor, "range_m") > 0) {
        const char *what = page_text(a, sensor, "what"); /* a replay may know none */
        const bool known = strcmp(what, "-") != 0;
        fprintf(page->out, "             %s%srange %s\n", known ? what : "", known ? ", " : "",
                page_metres(b, page_number(sensor, "range_m")));
    }
    if (pings == 0)
        fputs("             no ping yet\n", page->out);
    else
        fprintf(page->out, "             %lld ping%s, the last %s ago\n", pings, page_plural(pings),
                page_duration(c, page_number(sensor, "last_ping_age_s")));
    show_faults(page, sensor);
    if (json_is_string(json_object_get(sensor, "other_settings"))) {
        fputs("             ", page->out);
        page_word(page, PAGE_RED, 0, "settings that were not sent");
        fprintf(page->out, ": %.300s\n", json_string_value(json_object_get(sensor, "other_settings")));
    }
    if (json_is_true(json_object_get(sensor, "contested"))) {
        fputs("             ", page->out);
        page_word(page, PAGE_RED, 0, "answers get lost");
        fputs(": another program seems to speak to it, too, or the line is poor\n", page->out);
    }
    show_evidence(page, sensor);
    show_bus(page, json_object_get(sensor, "bus"));
}

/* How old the parts may be that were ever given. */
static void show_max_age(const struct page *page, const json_t *max_age_s)
{
    static const char *const parts[] = {"attitude", "position", "depth", "velocity", "altitude"};
    const char *between = "             stale after ";
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        if (isnan(page_number(max_age_s, parts[i])))
            continue;
        fprintf(page->out, "%s%g s (%s)", between, page_number(max_age_s, parts[i]), parts[i]);
        between = ", ";
    }
    if (between[0] == ',')
        fputc('\n', page->out);
}

static void show_pose(const struct page *page, const json_t *pose)
{
    const json_t *has = json_object_get(pose, "has");
    const bool drifts = json_string_length(json_object_get(pose, "drift")) > 0;
    char a[PAGE_CELL];
    fprintf(page->out, "pose       ");
    for (size_t i = 0; i < json_array_size(has); i++)
        fprintf(page->out, "%s%.20s", i ? ", " : "", json_string_value(json_array_get(has, i)));
    if (json_array_size(has) == 0 && drifts)
        fputs("none given", page->out);
    else if (json_array_size(has) == 0)
        fputs(
            "no pose received: the vehicle is assumed to stand still, unless max_speed or station_keeping is set",
            page->out);
    else
        fprintf(page->out, "; %s old", page_duration(a, page_number(pose, "age_s")));
    fprintf(page->out, "; %lld accepted, %lld refused\n", page_count(pose, "count"), page_count(pose, "refused"));
    if (!isnan(page_number(pose, "altitude_m")))
        fprintf(page->out, "             %.2f m above the bottom, below which nothing is free\n",
                page_number(pose, "altitude_m"));
    show_max_age(page, json_object_get(pose, "max_age_s"));
    if (json_string_length(json_object_get(pose, "missing")) > 0)
        fprintf(page->out, "             %s; keep sending it, or stop using poses: `sonarctl pose --withdraw`\n",
                page_text(a, pose, "missing"));
    if (drifts)
        fprintf(page->out, "             %s\n", page_text(a, pose, "drift"));
    if (json_string_length(json_object_get(pose, "doubt")) > 0)
        fprintf(page->out, "             %s\n", page_text(a, pose, "doubt"));
}

/* Depth, NMEA 0183 and leak probe, where there are any. */
static void show_instruments(const struct page *page, const json_t *result)
{
    const json_t *leak = json_object_get(result, "leak");
    const struct {
        const char *name, *good;
    } sources[] = {{"depth", "running"}, {"nmea", "open"}};
    char a[PAGE_CELL], b[PAGE_CELL];

    for (size_t i = 0; i < sizeof sources / sizeof *sources; i++) {
        const json_t *source = json_object_get(result, sources[i].name);
        if (!json_is_object(source))
            continue;
        const char *state = page_text(a, source, "state");
        fprintf(page->out, "%-11s", sources[i].name);
        page_word(page, strcmp(state, sources[i].good) == 0 ? PAGE_GREEN : PAGE_RED, 0, state);
        if (json_is_null(json_object_get(source, "age_s")))
            fprintf(page->out, ", no value %s yet\n",
                    page_count(source, "samples") + page_count(source, "bytes_in") > 0 ? "used" : "received");
        else
            fprintf(page->out, ", the last value %s ago\n", page_duration(b, page_number(source, "age_s")));
        if (json_string_length(json_object_get(source, "error")) > 0)
            fprintf(page->out, "           %s\n", page_text(b, source, "error"));
        if (json_string_length(json_object_get(source, "unused")) > 0)
            fprintf(page->out, "           %s\n", page_text(b, source, "unused"));
        if (json_string_length(json_object_get(source, "oddities")) > 0)
            fprintf(page->out, "           skipped: %s\n", page_text(b, source, "oddities"));
    }
    if (!json_is_object(leak))
        return;
    const char *state = page_text(a, leak, "state");
    fprintf(page->out, "leak       ");
    page_word(page, strcmp(state, "dry") == 0 ? PAGE_GREEN : PAGE_RED, 0, state);
    const long long alarms = page_count(leak, "alarms");
    fprintf(page->out, ", %lld alarm%s\n", alarms, page_plural(alarms));
    if (json_string_length(json_object_get(leak, "error")) > 0)
        fprintf(page->out, "           %s\n", page_text(b, leak, "error"));
}

static void show_record(const struct page *page, const json_t *record)
{
    char a[PAGE_CELL];
    const long long messages = page_count(record, "recording_messages"), errors = page_count(record, "errors");
    if (!json_is_object(record)) {
        fprintf(page->out, "recording  off\n");
        return;
    }
    fprintf(page->out, "recording  ");
    if (json_is_true(json_object_get(record, "recording")))
        fprintf(page->out, "to %s", page_text(a, record, "path"));
    else if (json_is_true(json_object_get(record, "paused")))
        fprintf(page->out, "waits for sonarctl record start");
    else if (errors == 0)
        fprintf(page->out, "begins");
    else
        page_word(page, PAGE_RED, 0, "stopped");
    fprintf(page->out, ", %lld message%s, %lld lost\n", messages, page_plural(messages),
            page_count(record, "lost_messages"));
    if (errors > 0)
        fprintf(page->out, "           %lld error%s, the last: %s\n", errors, page_plural(errors),
                page_text(a, record, "error"));
}

/* A line for each, behind a label that takes so many columns. */
static void show_texts(const struct page *page, int columns, const char *label, const json_t *texts)
{
    char cell[PAGE_CELL];
    for (size_t i = 0; i < json_array_size(texts); i++) {
        json_t *named = json_pack("{s:O}", "text", json_array_get(texts, i));
        fprintf(page->out, "%-*s %s\n", columns, label, page_text(cell, named, "text"));
        json_decref(named);
    }
}

static void show_status(const struct page *page, const json_t *result)
{
    const json_t *sensors = json_object_get(result, "sensors"), *pipeline = json_object_get(result, "pipeline");
    const json_t *latency = json_object_get(pipeline, "latency_us"), *grid = json_object_get(result, "grid");
    const json_t *server = json_object_get(result, "server");
    const long long threads = page_count(pipeline, "threads"), dropped = page_count(pipeline, "dropped");
    const long long cells = page_count(grid, "cells"), requests = page_count(server, "requests"),
                    errors = page_count(server, "errors");
    char a[PAGE_CELL], b[PAGE_CELL];
    const char *data = page_text(a, result, "data");
    page_word(page, PAGE_PLAIN, 11, "data");
    page_word(page, strcmp(data, "ok") == 0 ? PAGE_GREEN : PAGE_RED, 0, data);
    fputc('\n', page->out);
    fprintf(page->out, "sonard     %s, %s", page_text(a, result, "version"), page_text(b, result, "mode"));
    fprintf(page->out, ", up %s\n", page_duration(a, page_number(result, "uptime_s")));
    fprintf(page->out, "config     %s\n", page_text(a, result, "config"));
    show_texts(page, 10, "misfit", json_object_get(result, "misfits"));
    fprintf(page->out, "sensors\n");
    for (size_t i = 0; i < json_array_size(sensors); i++)
        show_sensor(page, json_array_get(sensors, i));
    show_pose(page, json_object_get(result, "pose"));
    show_instruments(page, result);
    fprintf(page->out, "pipeline   %lld thread%s, %lld ping%s dropped", threads, page_plural(threads), dropped,
            page_plural(dropped));
    if (json_is_object(latency))
        fprintf(page->out, "; latency %.0f us median, %.0f us 99 %%, %.0f us max", page_number(latency, "p50"),
                page_number(latency, "p99"), page_number(latency, "max"));
    fputc('\n', page->out);
    fprintf(page->out, "grid       %lld of %lld directions pinged, %lld cell%s, %lld lost\n",
            page_count(grid, "pinged"), page_count(grid, "directions"), cells, page_plural(cells),
            page_count(grid, "cells_lost"));
    fprintf(page->out, "clients    %lld now, %lld refused, %lld cut off; %lld request%s, %lld error%s\n",
            page_count(server, "clients_now"), page_count(server, "clients_refused"),
            page_count(server, "clients_cut"), requests, page_plural(requests), errors, page_plural(errors));
    show_record(page, json_object_get(result, "record"));
}

static void show_version(const struct page *page, const json_t *result)
{
    char a[PAGE_CELL];
    fprintf(page->out, "sonard %s\n", page_text(a, result, "version"));
}

static void show_taken(const struct page *page, const json_t *result)
{
    if (!json_is_true(json_object_get(result, "taken"))) {
        fprintf(page->out, "pose not used: sonard was held up, and does not know when it was; send it again\n");
        return;
    }
    fprintf(page->out, "pose accepted; keep sending it (--rate 5), or take it back (--withdraw): "
                       "answers become unknown when it is older than max_age\n");
}

static void show_withdrawn(const struct page *page, const json_t *result)
{
    fprintf(page->out, "%s\n",
            json_is_true(json_object_get(result, "withdrawn"))
                ? "pose withdrawn; directions are the vehicle's, and answers start again with the next pings"
                : "no pose to withdraw");
}

static void show_locked(const struct page *page, const json_t *result)
{
    const long long cells = page_count(result, "cells");
    char a[PAGE_CELL];
    fprintf(page->out, "%lld cell%s %s, frame %s\n", cells, page_plural(cells),
            json_is_true(json_object_get(result, "locked")) ? "locked" : "unlocked",
            page_text(a, result, "frame"));
}

static void show_reload(const struct page *page, const json_t *result)
{
    const json_t *applied = json_object_get(result, "applied"),
                 *restart = json_object_get(result, "needs_restart");
    if (json_array_size(applied) + json_array_size(restart) == 0)
        fprintf(page->out, "nothing has changed\n");
    show_texts(page, 14, "in force", applied);
    show_texts(page, 14, "needs restart", restart);
}

static void show_grid_heading(const struct page *page)
{
    fprintf(page->out, "%-16s %9s %8s %9s %8s %8s %10s\n", "grid", "range", "step", "layer", "model", "cells",
            "memory");
}

static void show_grid_line(const struct page *page, const json_t *g)
{
    char a[PAGE_CELL], b[PAGE_CELL], c[PAGE_CELL], d[PAGE_CELL];
    fprintf(page->out, "%-16s %9s %7.2f° %9s %8s %8.0f %6.1f MiB\n", page_text(a, g, "name"),
            page_metres(b, page_number(g, "range_m")), page_number(g, "angular_step_deg"),
            page_metres(c, page_number(g, "layer_m")), page_text(d, g, "sensor_model"), page_number(g, "cells"),
            page_number(g, "bytes") / 1048576);
}

static void show_grids(const struct page *page, const json_t *result)
{
    const json_t *list = json_object_get(result, "grids");
    show_grid_heading(page);
    for (size_t i = 0; i < json_array_size(list); i++)
        show_grid_line(page, json_array_get(list, i));
    fprintf(page->out, "%.1f of %.0f MiB\n", page_number(result, "bytes") / 1048576,
            page_number(result, "memory") / 1048576);
}

void show_result(FILE *out, const char *method, const json_t *result, bool colour)
{
    static const struct {
        const char *method;
        void (*show)(const struct page *page, const json_t *result);
    } forms[] = {{"blocked", show_blocked},
                 {"sectors", show_sectors},
                 {"clusters", show_clusters},
                 {"next_look", show_next_look},
                 {"status", show_status},
                 {"version", show_version},
                 {"pose", show_taken},
                 {"pose_withdraw", show_withdrawn},
                 {"grid_list", show_grids},
                 {"grid_lock", show_locked},
                 {"nearest", show_nearest},
                 {"limit", show_limit},
                 {"time_to_collision", show_collision},
                 {"sensors", show_sensors},
                 {"plan", show_plan},
                 {"record_start", show_record},
                 {"record_stop", show_record},
                 {"reload", show_reload},
                 {"explain", show_explain}};
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
