/* SPDX-License-Identifier: MIT */
#include "show_answers.h"

#include <math.h>
#include <string.h>

#define TOLD_GONE_S 0.1 /* what the age of the picture takes from a time, below which it is not worth a line */

static const char *because(char cell[PAGE_CELL], const json_t *result)
{
    return page_text(cell, result, "reason");
}

static double at(const json_t *object, const char *key, size_t i)
{
    const json_t *value = json_array_get(json_object_get(object, key), i);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

static void head_line(const struct page *page, const char *state)
{
    page_word(page, page_state_colour(state), 0, state);
}

void show_nearest(const struct page *page, const json_t *result)
{
    char a[PAGE_CELL], b[PAGE_CELL];
    head_line(page, page_text(a, result, "state"));
    if (!isnan(page_number(result, "range_m")))
        fprintf(page->out, ": nearest obstacle at %s (sd %s), azimuth %.1f°, elevation %.1f°, confidence %.2f",
                page_metres(a, page_number(result, "range_m")), page_metres(b, page_number(result, "range_sd_m")),
                page_number(result, "azimuth_deg"), page_number(result, "elevation_deg"),
                page_number(result, "confidence"));
    fprintf(page->out, "\n  unknown  %.1f %% of the directions before it\n",
            100 * page_number(result, "unknown_share"));
    fprintf(page->out, "  age      %s\n", page_duration(a, page_number(result, "age_s")));
    fprintf(page->out, "  because  %s\n", because(a, result));
    page_target(page, result);
}

void show_limit(const struct page *page, const json_t *result)
{
    char a[PAGE_CELL], b[PAGE_CELL];
    const char *by = page_text(a, result, "limited_by");
    fprintf(page->out, "%.2f m/s of %.2f asked for, limited by ", page_number(result, "speed_mps"),
            page_number(result, "asked_mps"));
    page_word(page, strcmp(by, "nothing") == 0 ? PAGE_GREEN : page_state_colour(by), 0, by);
    fputc('\n', page->out);
    fprintf(page->out, "  velocity %.3f, %.3f, %.3f m/s\n", at(result, "velocity_mps", 0),
            at(result, "velocity_mps", 1), at(result, "velocity_mps", 2));
    fprintf(page->out, "  stops in %s", page_metres(b, page_number(result, "stop_m")));
    if (page_number(result, "uncertain_m") > 0)
        fprintf(page->out, ", uncertain by %s", page_metres(b, page_number(result, "uncertain_m")));
    fputc('\n', page->out);
    fprintf(page->out, "  obstacle %s%s\n", page_metres(b, page_number(result, "blocked_m")),
            page_number(result, "blocked_m") < 0 ? ", inside body and margin" : "");
    fprintf(page->out, "  free to  %s\n", page_metres(b, page_number(result, "free_m")));
    fprintf(page->out, "  age      %s\n", page_duration(b, page_number(result, "age_s")));
    fprintf(page->out, "  because  %s\n", because(b, result));
    if (*page_text(b, result, "remedy"))
        fprintf(page->out, "  remedy   %s\n", page_text(b, result, "remedy"));
    page_target(page, result);
}

void show_collision(const struct page *page, const json_t *result)
{
    char a[PAGE_CELL], b[PAGE_CELL];
    const double speed_mps = page_number(result, "speed_mps");
    const double gone_s = page_number(result, "distance_m") / speed_mps - page_number(result, "time_s");
    head_line(page, page_text(a, result, "state"));
    if (!isnan(page_number(result, "time_s")))
        fprintf(page->out, ": meets something in %s (sd %s), confidence %.2f",
                page_duration(a, page_number(result, "time_s")),
                page_duration(b, page_number(result, "time_sd_s")), page_number(result, "confidence"));
    fputc('\n', page->out);
    fprintf(page->out, "  distance %s\n", page_metres(a, page_number(result, "distance_m")));
    if (gone_s >= TOLD_GONE_S)
        fprintf(page->out, "  less     %s for movement since the scan: no fresh position\n",
                page_duration(a, gone_s));
    fprintf(page->out, "  unknown  after %s\n", page_duration(a, page_number(result, "unknown_after_s")));
    fprintf(page->out, "  looked   %s ahead at %.2f m/s\n", page_duration(a, page_number(result, "ahead_s")),
            speed_mps);
    fprintf(page->out, "  age      %s\n", page_duration(a, page_number(result, "age_s")));
    fprintf(page->out, "  because  %s\n", because(a, result));
    page_target(page, result);
}

void show_sensors(const struct page *page, const json_t *result)
{
    const json_t *list = json_object_get(result, "sensors");
    char a[PAGE_CELL], b[PAGE_CELL], c[PAGE_CELL];
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *s = json_array_get(list, i);
        const bool heard = json_is_true(json_object_get(s, "heard"));
        const long long pings = page_count(s, "pings");
        fprintf(page->out, "%s: ", page_text(a, s, "name"));
        page_word(page, heard ? PAGE_GREEN : PAGE_RED, 0, heard ? "online" : "offline");
        fprintf(page->out, ", %s\n", page_text(a, s, "state"));
        fprintf(page->out, "  is       %s: %s\n", page_text(a, s, "device"), page_text(b, s, "what"));
        fprintf(page->out, "  port     %s\n", page_text(a, s, "port"));
        fprintf(page->out, "  range    %s; %lld ping%s, the last %s ago\n",
                page_metres(a, page_number(s, "range_m")), pings, page_plural(pings),
                page_duration(b, page_number(s, "last_ping_age_s")));
        fprintf(page->out, "  mount    %.2f forward, %.2f right, %.2f down (m)\n", at(s, "mount_m", 0),
                at(s, "mount_m", 1), at(s, "mount_m", 2));
        if (json_is_string(json_object_get(s, "port_error")))
            fprintf(page->out, "  fault    %s\n", page_text(c, s, "port_error"));
    }
}

/* ---- explain ---- */

static void show_cells(const struct page *page, const json_t *cells)
{
    const json_t *list = json_object_get(cells, "nearest");
    char a[PAGE_CELL], b[PAGE_CELL], c[PAGE_CELL], d[PAGE_CELL], e[PAGE_CELL];
    if (json_array_size(list) == 0)
        return;
    fprintf(page->out, "\ncells of the grid that block there: %lld, the nearest:\n", page_count(cells, "all"));
    fprintf(page->out, "%9s %10s %9s %6s %7s %11s %10s %6s  %-13s  %s\n", "azimuth", "elevation", "near edge",
            "sure", "echoes", "first echo", "last echo", "misses", "this turn", "last ping");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *k = json_array_get(list, i);
        fprintf(page->out, "%8.1f° %9.1f° %9s %5.0f%% %7lld %11s %10s %6lld  %-13s  %s %lld%s\n",
                page_number(k, "azimuth_deg"), page_number(k, "elevation_deg"),
                page_metres(a, page_number(k, "near_m")), 100 * page_number(k, "confidence"),
                page_count(k, "echoes"), page_duration(b, page_number(k, "first_echo_age_s")),
                page_duration(c, page_number(k, "last_echo_age_s")), page_count(k, "misses"),
                page_text(d, k, "turn"), page_text(e, k, "sensor"), page_count(k, "last_ping"),
                json_is_true(json_object_get(k, "locked")) ? ", locked" : "");
    }
}

static void show_gone(const struct page *page, const json_t *gone)
{
    const json_t *list = json_object_get(gone, "newest");
    char a[PAGE_CELL], b[PAGE_CELL], c[PAGE_CELL];
    if (json_array_size(list) == 0)
        return;
    fprintf(page->out, "\ncells that are gone in this turn: %lld, the newest:\n", page_count(gone, "all"));
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *k = json_array_get(list, i);
        fprintf(page->out, "%8.1f° %9.1f° %9s, last echo %s ago, missed by %lld beam%s, the last %s %lld\n",
                page_number(k, "azimuth_deg"), page_number(k, "elevation_deg"),
                page_metres(a, page_number(k, "range_m")), page_duration(b, page_number(k, "last_echo_age_s")),
                page_count(k, "misses"), page_plural(page_count(k, "misses")), page_text(c, k, "sensor"),
                page_count(k, "last_ping"));
    }
}

/* What the records of pings say of the cone. */
static void show_water(const struct page *page, const json_t *water)
{
    const double from_m = page_number(water, "free_from_m"), to_m = page_number(water, "free_to_m");
    const long long records = page_count(water, "records");
    char a[PAGE_CELL], b[PAGE_CELL], c[PAGE_CELL];
    if (!json_is_object(water))
        return;
    if (to_m > from_m)
        fprintf(page->out, "\nfree from %s to %s by %lld records of pings, the oldest %s ago\n",
                page_metres(a, from_m), page_metres(b, to_m), records,
                page_duration(c, page_number(water, "oldest_age_s")));
    else
        fprintf(page->out, "\nby the records of pings nothing is known to be free from %s on\n",
                page_metres(a, from_m));
}

#define MOVED_LEAST_M    0.2
#define TURNED_LEAST_DEG 2.0

/* What widens the cone, where that is more than a trifle. */
static void show_uncertain(const struct page *page, const json_t *uncertain)
{
    const double moved_m = page_number(uncertain, "moved_m"), turned_deg = page_number(uncertain, "turned_deg");
    char a[PAGE_CELL];
    if (moved_m >= MOVED_LEAST_M || turned_deg >= TURNED_LEAST_DEG)
        fprintf(page->out, "uncertain pose: all counts nearer and wider by %s and %.0f°\n",
                page_metres(a, moved_m), turned_deg);
}

static void show_pings(const struct page *page, const json_t *pings)
{
    const json_t *list = json_object_get(pings, "newest");
    char a[PAGE_CELL], b[PAGE_CELL], c[PAGE_CELL], d[PAGE_CELL], e[PAGE_CELL];
    fprintf(page->out,
            "\nof the pings of the last %s, %lld had an echo there, %lld found free space, %lld nothing usable",
            page_duration(a, page_number(pings, "back_to_s")), page_count(pings, "echo"),
            page_count(pings, "free"), page_count(pings, "nothing"));
    if (page_count(pings, "own"))
        fprintf(page->out, ", %lld an echo of the vehicle itself", page_count(pings, "own"));
    fputc('\n', page->out);
    if (json_array_size(list) == 0)
        return;
    fprintf(page->out, "%-16s %8s %9s %9s %9s %8s %6s  %s\n", "sonar", "ping", "ago", "bearing", "echo at",
            "in bin", "sure", "free space");
    for (size_t i = 0; i < json_array_size(list); i++) {
        const json_t *p = json_array_get(list, i);
        const double bin = page_number(p, "bin"), sure = page_number(p, "confidence");
        char bins[16] = "-", sures[16] = "-";
        if (!isnan(bin))
            snprintf(bins, sizeof bins, "%.0f", bin);
        if (!isnan(sure))
            snprintf(sures, sizeof sures, "%.0f%%", 100 * sure);
        fprintf(page->out, "%-16s %8lld %9s %8.1f° %9s %8s %6s  %s to %s\n", page_text(a, p, "sensor"),
                page_count(p, "number"), page_duration(b, page_number(p, "age_s")), page_number(p, "bearing_deg"),
                page_metres(c, page_number(p, "range_m")), bins, sures,
                page_metres(d, page_number(p, "blind_to_m")), page_metres(e, page_number(p, "free_to_m")));
    }
}

void show_explain(const struct page *page, const json_t *result)
{
    const json_t *answer = json_object_get(result, "answer");
    char a[PAGE_CELL];
    head_line(page, page_text(a, answer, "state"));
    if (!isnan(page_number(answer, "range_m")))
        fprintf(page->out, " at %s", page_metres(a, page_number(answer, "range_m")));
    fprintf(page->out, ": %s\n", because(a, answer));
    show_uncertain(page, json_object_get(result, "uncertain"));
    show_cells(page, json_object_get(result, "cells"));
    show_gone(page, json_object_get(result, "gone"));
    show_water(page, json_object_get(result, "water"));
    show_pings(page, json_object_get(result, "pings"));
}

/* ---- plan ---- */

static const char *kib(char cell[PAGE_CELL], const json_t *object)
{
    const double v = page_number(object, "bytes");
    if (isnan(v))
        return "-";
    snprintf(cell, PAGE_CELL, "%.1f", v / 1024);
    return cell;
}

void show_plan(const struct page *page, const json_t *result)
{
    const json_t *stages = json_object_get(result, "stages");
    char name[PAGE_CELL], of[PAGE_CELL], proof[PAGE_CELL], why[PAGE_CELL], bytes[PAGE_CELL];
    fprintf(page->out, "%-11s %-12s %-4s %9s  %-9s  %s\n", "stage", "of", "plan", "KiB", "proof", "why");
    for (size_t i = 0; i < json_array_size(stages); i++) {
        const json_t *s = json_array_get(stages, i);
        const bool in = json_is_true(json_object_get(s, "in"));
        fprintf(page->out, "%-11s %-12s ", page_text(name, s, "name"), page_text(of, s, "of"));
        page_word(page, in ? PAGE_GREEN : PAGE_PLAIN, 4, in ? "in" : "out");
        fprintf(page->out, " %9s  %-9s  %s\n", kib(bytes, s), page_text(proof, s, "proof"),
                page_text(why, s, "why"));
    }
    fprintf(page->out, "%-29s %9s\n", "all that is in", kib(bytes, result));
}
