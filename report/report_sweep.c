/* SPDX-License-Identifier: MIT */
/*
 * report_sweep - every number and choice of the configuration, one by one: what it does to what is said of the water
 * along a recorded way (lib/way.h), and what it costs. A key that is neither a row nor named with the reason why it is
 * none ends the program, as do two rows of a key that run the same.
 *
 *   report_sweep errors [quick | long]   CSV: KNOB_COLUMNS, section, seed, and what way_tally counts
 *   report_sweep count [quick | long]    CSV: KNOB_COLUMNS, bins (pings), for callgrind to count way_enter
 *
 * Eight seeds of the keys that no other chapter turns; long: 16 seeds of all keys; quick: one, and few of them.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "config/conf_table.h"
#include "report/lib/cost.h"
#include "report/lib/knob.h"
#include "report/lib/way.h"

#define SEEDS       8
#define LONG_SEEDS  16
#define COUNT_PINGS 16

static const struct row {
    struct knob knob;
    bool learn;  /* with a template of the vehicle */
    bool listed; /* no other chapter turns it */
} rows[] = {
#define LEARN true
#define ROW(s, k, v, m, t)                                                                                        \
    {                                                                                                             \
        {.name = (k), .section = (s), .value = (v), .more = (m)}, (t), false                                      \
    }
#define LISTED(s, k, v, m, t)                                                                                     \
    {                                                                                                             \
        {.name = (k), .section = (s), .value = (v), .more = (m)}, (t), true                                       \
    }
#define LOG      "amplitude = log\ndecibels_per_count = 0.3 dB\n"
#define CLEANUP  "[extract]\nmedian = 3\notsu = on\nclahe = on\nclasses = on\n"
#define PAPER    "[extract]\norder = paper\n"
#define CLAHE    "[extract]\norder = paper\nclahe = on\n"
#define OS       "[extract]\ndetector = os\n"
#define MINIMUM  "[extract]\nno_echo = minimum\n"
#define GAUSS    "[grid]\nsensor_model = gauss\n"
#define CLEAR_3S "[grid]\nclear_for = 3 s\n"
#define MAP      "[map]\nvoxel = 0.2 m\n"
    ROW("sonar", "ring_down", NULL, NULL, 0),
    ROW("sonar", "ring_down", "0.5 m", NULL, 0),
    ROW("sonar", "ring_down", "1.5 m", NULL, 0),
    ROW("sonar", "amplitude", NULL, NULL, 0),
    ROW("sonar", "amplitude", "linear", NULL, 0),
    ROW("sonar", "amplitude", "power", NULL, 0),
    ROW("sonar", "amplitude", "sqrt", NULL, 0),
    ROW("sonar", "decibels_per_count", "0.2 dB", LOG, 0),
    ROW("sonar", "decibels_per_count", "0.3137 dB", LOG, 0),
    ROW("sonar", "decibels_per_count", "0.45 dB", LOG, 0),
    ROW("sonar", "aperture", NULL, NULL, 0),
    ROW("sonar", "aperture", "1 12 deg", NULL, 0),
    ROW("sonar", "aperture", "4 40 deg", NULL, 0),
    ROW("sonar", "mount", NULL, NULL, 0),
    ROW("sonar", "mount", "0.3 0 0 m", NULL, 0),
    ROW("sonar", "mount", "0 0 0.3 m", NULL, 0),
    ROW("sonar", "rotation", NULL, NULL, 0),
    ROW("sonar", "rotation", "0 0 3 deg", NULL, 0),
    ROW("sonar", "rotation", "0 0 90 deg", NULL, 0),
    ROW("sonar", "mirror", NULL, NULL, 0),
    ROW("sonar", "mirror", "yes", NULL, 0),
    ROW("water", "sound_speed", NULL, NULL, 0),
    ROW("water", "sound_speed", "1450 m/s", NULL, 0),
    ROW("water", "sound_speed", "1550 m/s", NULL, 0),
    ROW("extract", "detector", NULL, NULL, 0),
    ROW("extract", "detector", "ca", NULL, 0),
    ROW("extract", "detector", "goca", NULL, 0),
    ROW("extract", "detector", "os", NULL, 0),
    ROW("extract", "order", NULL, CLEANUP, 0),
    ROW("extract", "order", "paper", CLEANUP, 0),
    ROW("extract", "false_alarm", NULL, NULL, 0),
    ROW("extract", "false_alarm", "1e-2", NULL, 0),
    ROW("extract", "false_alarm", "1e-5", NULL, 0),
    ROW("extract", "false_alarm", "1e-8", NULL, 0),
    ROW("extract", "window", NULL, NULL, 0),
    ROW("extract", "window", "0.2 m", NULL, 0),
    ROW("extract", "window", "0.8 m", NULL, 0),
    ROW("extract", "window", "3.2 m", NULL, 0),
    ROW("extract", "guard", NULL, NULL, 0),
    ROW("extract", "guard", "0 m", NULL, 0),
    ROW("extract", "guard", "0.05 m", NULL, 0),
    ROW("extract", "guard", "0.3 m", NULL, 0),
    LISTED("extract", "rank", NULL, OS, 0),
    LISTED("extract", "rank", "0.25", OS, 0),
    LISTED("extract", "rank", "0.5", OS, 0),
    LISTED("extract", "rank", "1", OS, 0),
    ROW("extract", "floor", NULL, NULL, 0),
    ROW("extract", "floor", "1", NULL, 0),
    ROW("extract", "floor", "30", NULL, 0),
    ROW("extract", "min_contrast", NULL, NULL, 0),
    ROW("extract", "min_contrast", "8 dB", NULL, 0),
    ROW("extract", "min_contrast", "11 dB", NULL, 0),
    ROW("extract", "min_contrast", "20 dB", NULL, 0),
    LISTED("extract", "learn_ring_down", NULL, NULL, 0),
    LISTED("extract", "learn_ring_down", "on", NULL, 0),
    ROW("extract", "median", NULL, PAPER, 0),
    ROW("extract", "median", "3", PAPER, 0),
    ROW("extract", "median", "5", PAPER, 0),
    ROW("extract", "otsu", NULL, PAPER, 0),
    ROW("extract", "otsu", "on", PAPER, 0),
    LISTED("extract", "clahe", NULL, PAPER, 0),
    LISTED("extract", "clahe", "on", PAPER, 0),
    LISTED("extract", "clahe_clip", NULL, CLAHE, 0),
    LISTED("extract", "clahe_clip", "1", CLAHE, 0),
    LISTED("extract", "clahe_clip", "4", CLAHE, 0),
    LISTED("extract", "clahe_clip", "100", CLAHE, 0),
    ROW("extract", "classes", NULL, PAPER, 0),
    ROW("extract", "classes", "on", PAPER, 0),
    ROW("extract", "marks", NULL, NULL, 0),
    ROW("extract", "marks", "off", NULL, 0),
    LISTED("extract", "no_echo", NULL, NULL, 0),
    LISTED("extract", "no_echo", "minimum", NULL, 0),
    LISTED("extract", "no_echo", "range", NULL, 0),
    ROW("extract", "target", NULL, NULL, 0),
    ROW("extract", "target", "pile", NULL, 0),
    ROW("extract", "target", "net", NULL, 0),
    ROW("extract", "target", "line", NULL, 0),
    ROW("extract", "bottom", NULL, NULL, 0),
    ROW("extract", "bottom", "off", NULL, 0),
    ROW("extract", "bottom", "12 dB", NULL, 0),
    ROW("extract", "bottom", "20 dB", NULL, 0),
    LISTED("extract", "minimum_range", NULL, MINIMUM, 0),
    LISTED("extract", "minimum_range", "0.1 m", MINIMUM, 0),
    LISTED("extract", "minimum_range", "3 m", MINIMUM, 0),
    LISTED("extract", "minimum_range", "10 m", MINIMUM, 0),
    LISTED("background", "mask", NULL, NULL, LEARN),
    LISTED("background", "mask", "16", NULL, LEARN),
    LISTED("background", "mask", "160", NULL, LEARN),
    LISTED("background", "mask", "250", NULL, LEARN),
    LISTED("background", "neighbour", NULL, NULL, LEARN),
    LISTED("background", "neighbour", "0.05 m", NULL, LEARN),
    LISTED("background", "neighbour", "0.5 m", NULL, LEARN),
    LISTED("background", "min_points", NULL, NULL, LEARN),
    LISTED("background", "min_points", "2", NULL, LEARN),
    LISTED("background", "min_points", "30", NULL, LEARN),
    LISTED("background", "min_level", NULL, NULL, LEARN),
    LISTED("background", "min_level", "20", NULL, LEARN),
    LISTED("background", "min_level", "240", NULL, LEARN),
    LISTED("background", "extent", NULL, NULL, LEARN),
    LISTED("background", "extent", "0.1 m", NULL, LEARN),
    LISTED("background", "extent", "5 m", NULL, LEARN),
    LISTED("background", "reach", NULL, NULL, LEARN),
    LISTED("background", "reach", "0.5 m", NULL, LEARN),
    LISTED("background", "reach", "12 m", NULL, LEARN),
    LISTED("background", "share", NULL, NULL, LEARN),
    LISTED("background", "share", "0.01", NULL, LEARN),
    LISTED("background", "share", "1", NULL, LEARN),
    LISTED("background", "ring", NULL, NULL, LEARN),
    LISTED("background", "ring", "0 m", NULL, LEARN),
    LISTED("background", "ring", "1 m", NULL, LEARN),
    LISTED("background", "open_water", NULL, NULL, LEARN),
    LISTED("background", "open_water", "yes", NULL, LEARN),
    ROW("grid", "range", NULL, NULL, 0),
    ROW("grid", "range", "6 m", NULL, 0),
    ROW("grid", "range", "20 m", NULL, 0),
    ROW("grid", "angular_step", NULL, NULL, 0),
    ROW("grid", "angular_step", "1 deg", NULL, 0),
    ROW("grid", "angular_step", "4 deg", NULL, 0),
    ROW("grid", "angular_step", "10 deg", NULL, 0),
    ROW("grid", "layer", NULL, NULL, 0),
    ROW("grid", "layer", "0.01 m", NULL, 0),
    ROW("grid", "layer", "0.2 m", NULL, 0),
    ROW("grid", "growth", NULL, NULL, 0),
    ROW("grid", "growth", "1", NULL, 0),
    ROW("grid", "growth", "1.1", NULL, 0),
    ROW("grid", "growth", "1.3", NULL, 0),
    ROW("grid", "elevation", NULL, NULL, 0),
    ROW("grid", "elevation", "level", NULL, 0),
    LISTED("grid", "axes", NULL, NULL, 0),
    LISTED("grid", "axes", "course", NULL, 0),
    ROW("grid", "sensor_model", NULL, NULL, 0),
    ROW("grid", "sensor_model", "gauss", NULL, 0),
    ROW("grid", "sensor_model", "midpoint", NULL, 0),
    ROW("grid", "update", NULL, NULL, 0),
    ROW("grid", "update", "max", NULL, 0),
    LISTED("grid", "range_error", NULL, GAUSS, 0),
    LISTED("grid", "range_error", "0", GAUSS, 0),
    LISTED("grid", "range_error", "0.01", GAUSS, 0),
    LISTED("grid", "range_error", "0.05", GAUSS, 0),
    LISTED("grid", "mask_reach", NULL, GAUSS, 0),
    LISTED("grid", "mask_reach", "1.2", GAUSS, 0),
    LISTED("grid", "mask_reach", "3", GAUSS, 0),
    LISTED("grid", "mask_reach", "4", GAUSS, 0),
    ROW("grid", "relaxation", NULL, NULL, 0),
    ROW("grid", "relaxation", "0.5", NULL, 0),
    ROW("grid", "relaxation", "1", NULL, 0),
    ROW("grid", "max_cells", NULL, NULL, 0),
    ROW("grid", "max_cells", "1024", NULL, 0),
    ROW("grid", "max_cells", "8192", NULL, 0),
    LISTED("grid", "blocked_above", NULL, NULL, 0),
    LISTED("grid", "blocked_above", "0.51", NULL, 0),
    LISTED("grid", "blocked_above", "0.75", NULL, 0),
    LISTED("grid", "blocked_above", "0.95", NULL, 0),
    ROW("grid", "clear_for", NULL, NULL, 0),
    ROW("grid", "clear_for", "3 s", NULL, 0),
    ROW("grid", "clear_for", "10 s", NULL, 0),
    ROW("grid", "clear_for", "120 s", NULL, 0),
    LISTED("grid", "forget", NULL, CLEAR_3S, 0),
    LISTED("grid", "forget", "5 s", CLEAR_3S, 0),
    LISTED("grid", "forget", "30 s", CLEAR_3S, 0),
    LISTED("grid", "forget", "1000 s", CLEAR_3S, 0),
    LISTED("grid", "move_limit", NULL, NULL, 0),
    LISTED("grid", "move_limit", "0.1 m", NULL, 0),
    LISTED("grid", "move_limit", "0.5 m", NULL, 0),
    LISTED("grid", "move_limit", "2 m", NULL, 0),
    ROW("map", "voxel", "0.2 m", NULL, 0),
    ROW("map", "voxel", "0.1 m", NULL, 0),
    ROW("map", "voxel", "0.4 m", NULL, 0),
    ROW("map", "memory", NULL, MAP, 0),
    ROW("map", "memory", "8 MiB", MAP, 0),
    ROW("map", "memory", "256 MiB", MAP, 0),
    ROW("map", "extent", NULL, MAP, 0),
    ROW("map", "extent", "10 m", MAP, 0),
    ROW("map", "extent", "60 m", MAP, 0),
    ROW("map", "height", NULL, MAP, 0),
    ROW("map", "height", "4 m", MAP, 0),
    ROW("map", "height", "30 m", MAP, 0),
    ROW("map", "threshold", NULL, MAP, 0),
    ROW("map", "threshold", "0", MAP, 0),
    ROW("map", "threshold", "2", MAP, 0),
    ROW("map", "threshold", "8", MAP, 0),
    ROW("map", "echoes", NULL, MAP, 0),
    ROW("map", "echoes", "off", MAP, 0),
    ROW("map", "echo_weight", NULL, MAP, 0),
    ROW("map", "echo_weight", "0", MAP, 0),
    ROW("map", "echo_weight", "1", MAP, 0),
    ROW("map", "echo_weight", "8", MAP, 0),
    ROW("map", "tolerance", NULL, MAP, 0),
    ROW("map", "tolerance", "0.05 m", MAP, 0),
    ROW("map", "tolerance", "0.2 m", MAP, 0),
    ROW("map", "opening", NULL, MAP, 0),
    ROW("map", "opening", "0.1", MAP, 0),
    ROW("map", "opening", "1", MAP, 0),
    ROW("map", "weight_levels", NULL, MAP, 0),
    ROW("map", "weight_levels", "4", MAP, 0),
    ROW("map", "weight_levels", "8", MAP, 0),
    ROW("map", "beam", NULL, MAP, 0),
    ROW("map", "beam", "pyramid", MAP, 0),
    ROW("map", "body", NULL, MAP, 0),
    ROW("map", "body", "0.25 m", MAP, 0),
    ROW("map", "body", "0.5 m", MAP, 0),
    ROW("map", "submap_distance", NULL, MAP, 0),
    ROW("map", "submap_distance", "1 m", MAP, 0),
    ROW("map", "submap_distance", "50 m", MAP, 0),
    LISTED("map", "submap_time", NULL, MAP, 0),
    LISTED("map", "submap_time", "5 s", MAP, 0),
    LISTED("map", "submap_time", "20 s", MAP, 0),
    LISTED("map", "forget", NULL, MAP, 0),
    LISTED("map", "forget", "5 s", MAP, 0),
    LISTED("map", "forget", "20 s", MAP, 0),
    ROW("pose", "max_age", NULL, NULL, 0),
    ROW("pose", "max_age", "0.05 s", NULL, 0),
    ROW("pose", "max_age", "10 s", NULL, 0),
    ROW("pose", "heading_drift", NULL, NULL, 0),
    ROW("pose", "heading_drift", "0 deg/s", NULL, 0),
    ROW("pose", "heading_drift", "0.1 deg/s", NULL, 0),
    ROW("pose", "heading_drift", "1 deg/s", NULL, 0),
    ROW("pose", "delay", NULL, NULL, 0),
    ROW("pose", "delay", "0.1 0.05 s", NULL, 0),
    ROW("pose", "delay", "0.5 0.5 s", NULL, 0),
    ROW("vehicle", "radius", NULL, NULL, 0),
    ROW("vehicle", "radius", "0.1 m", NULL, 0),
    ROW("vehicle", "radius", "1 m", NULL, 0),
    ROW("vehicle", "height", NULL, NULL, 0),
    ROW("vehicle", "height", "0.1 m", NULL, 0),
    ROW("vehicle", "height", "2 m", NULL, 0),
    ROW("vehicle", "margin", NULL, NULL, 0),
    ROW("vehicle", "margin", "0 m", NULL, 0),
    ROW("vehicle", "margin", "1 m", NULL, 0),
    ROW("vehicle", "near", NULL, NULL, 0),
    ROW("vehicle", "near", "1 m", NULL, 0),
    ROW("vehicle", "near", "4 m", NULL, 0),
    ROW("vehicle", "max_speed", NULL, NULL, 0),
    ROW("vehicle", "max_speed", "0.2 m/s", NULL, 0),
    ROW("vehicle", "max_speed", "2 m/s", NULL, 0),
    ROW("vehicle", "max_turn", NULL, NULL, 0),
    ROW("vehicle", "max_turn", "20 deg/s", NULL, 0),
    ROW("vehicle", "max_turn", "180 deg/s", NULL, 0),
    ROW("vehicle", "braking", NULL, NULL, 0),
    ROW("vehicle", "braking", "0.05 m/s2", NULL, 0),
    ROW("vehicle", "braking", "1 m/s2", NULL, 0),
    ROW("vehicle", "latency", NULL, NULL, 0),
    ROW("vehicle", "latency", "0 s", NULL, 0),
    ROW("vehicle", "latency", "2 s", NULL, 0),
    ROW("vehicle", "unknown", NULL, NULL, 0),
    ROW("vehicle", "unknown", "stop", NULL, 0),
    ROW("vehicle", "unknown", "ignore", NULL, 0),
    ROW("vehicle", "slow", NULL, NULL, 0),
    ROW("vehicle", "slow", "0 m/s", NULL, 0),
    ROW("vehicle", "slow", "0.3 m/s", NULL, 0),
};
#define ROWS (sizeof rows / sizeof rows[0])

/* Numbers and choices that are no rows. */
static const struct {
    const char *section, *key; /* NULL: all of the section */
    const char *why;
} left_out[] = {
    {"sonar", "range", "another ping, not another answer to it: the sonar's"},
    {"sonar", "gain", "the sonar's"},
    {"sonar", "sector", "which pings there are: report_active_sensing"},
    {"sonar", "step", "which pings there are: report_active_sensing"},
    {"sonar", "mode", "the link to the sonar: live tests"},
    {"sonar", "scan", "which pings there are: report_active_sensing"},
    {"sonar", "circle", "which pings there are: report_active_sensing"},
    {"sonar", "frequency", "the sonar's"},
    {"sonar", "node", "an address"},
    {"sonar", "sensor_id", "an address"},
    {"sonar", "min_confidence", "of sonars that report ranges; no such sonar here"},
    {"sonar", "delay", "of sonars that report ranges; no such sonar here"},
    {"sonar", "power_active", "a line's level"},
    {"sonar", "power_cycle_after", "the sonar's power"},
    {"sonar", "power_at_stop", "the sonar's power"},
    {"sonar", "trigger_edge", "a line's level"},
    {"water", "density", "pressure to depth, in proportion"},
    {"background", "save_every", "files"},
    {"grid", "cluster_relaxation", "clusters alone: figure 8 of the first paper"},
    {"grids", NULL, "a limit of memory: what it refuses is said"},
    {"map", "save_every", "files"},
    {"vehicle", "current", "of vehicles without velocity: report_stock"},
    {"vehicle", "station_keeping", "of vehicles without velocity: report_stock"},
    {"answers", NULL, "the question's own distance, where it gives none"},
    {"depth", NULL, "another sensor"},
    {"nmea", NULL, "another sensor"},
    {"gpio", NULL, "lines"},
    {"server", NULL, "clients"},
    {"pipeline", NULL, "threads and queues change no answer: the whole chain's chapter"},
    {"realtime", NULL, "the computer"},
    {"record", NULL, "files"},
    {"log", NULL, "what is written"},
};

static bool is_swept(const struct conf_key *key)
{
    for (size_t i = 0; i < ROWS; i++)
        if (strcmp(rows[i].knob.section, key->section) == 0 && strcmp(rows[i].knob.name, key->name) == 0)
            return true;
    return false;
}

static bool is_left_out(const struct conf_key *key)
{
    for (size_t i = 0; i < sizeof left_out / sizeof left_out[0]; i++)
        if (strcmp(left_out[i].section, key->section) == 0 &&
            (!left_out[i].key || strcmp(left_out[i].key, key->name) == 0))
            return true;
    return false;
}

/* Every number and choice is in one of the two tables, and in one only. */
static void check_keys(void)
{
    for (const struct conf_key *key = conf_keys; key->name; key++) {
        const bool counts = key->kind == CONF_QUANTITY || key->kind == CONF_INTEGER || key->kind == CONF_WORD;
        if (counts && is_swept(key) == is_left_out(key)) {
            fprintf(stderr, "report_sweep: [%s] %s: %s\n", key->section, key->name,
                    is_swept(key) ? "it has rows and a reason to have none"
                                  : "no row turns it, and no reason says why");
            exit(1);
        }
    }
}

static void check_rows(void)
{
    static struct knob knob[ROWS];

    for (size_t i = 0; i < ROWS; i++)
        knob[i] = rows[i].knob;
    knob_check(knob, ROWS);
}

static bool is_run(const struct row *row, const char *size)
{
    const bool all = strcmp(size, "long") == 0, few = strcmp(size, "quick") == 0;
    return all || (row->listed && (!few || strcmp(row->knob.section, "extract") == 0));
}

static void print_tally(const struct row *row, unsigned seed, const struct way_tally *t)
{
    knob_print(&row->knob);
    printf(",%s,%u,%u,%u,%.6g,%u,%.6g,%.6g,%.6g,%u,%.6g,%.4g,%u,%.6g,%.6g,%.3g\n", row->knob.section, seed,
           t->in_way, t->past, t->past / (double)t->in_way, t->open, t->false_block / (double)t->open,
           t->unknown / (double)t->open, 1 - t->said_m / t->free_m, t->asked_limits,
           t->too_fast / (double)t->asked_limits, t->limit_mps / t->asked_limits, t->map_solid,
           t->map_false / (double)(t->map_solid ? t->map_solid : 1),
           t->map_said / (double)(t->map_open ? t->map_open : 1), t->ns * 1e-3 / t->pings);
}

static void errors(const char *size)
{
    static struct way way;
    const unsigned seeds = strcmp(size, "long") == 0 ? LONG_SEEDS : strcmp(size, "quick") == 0 ? 1 : SEEDS;

    printf(KNOB_COLUMNS
           ",section,seed,in_way,past,past_share,open,false_block_share,unknown_share,unsaid_share,limits,"
           "too_fast_share,limit_mps,map_solid,map_false_share,map_said_share,us_per_ping\n");
    for (unsigned seed = 1; seed <= seeds; seed++) {
        way_record(&way, seed, WAY_PINGS);
        for (size_t i = 0; i < ROWS; i++) {
            struct way_tally t = {0};
            struct conf conf;
            if (!is_run(&rows[i], size))
                continue;
            knob_conf(&rows[i].knob, &conf);
            way_run(&way, &conf, rows[i].learn, &t);
            print_tally(&rows[i], seed, &t);
        }
    }
}

static void count(const char *size)
{
    static struct way way;

    way_record(&way, 1, COUNT_PINGS);
    printf(KNOB_COLUMNS ",section,bins\n");
    for (size_t i = 0; i < ROWS; i++) {
        struct way_tally t = {0};
        struct conf conf;
        if (!is_run(&rows[i], size))
            continue;
        knob_conf(&rows[i].knob, &conf);
        way_run(&way, &conf, false, &t);
        knob_print(&rows[i].knob);
        printf(",%s,%u\n", rows[i].knob.section, t.pings);
        cost_mark();
    }
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "", *size = argc > 2 ? argv[2] : "";

    check_keys();
    check_rows();
    if (strcmp(what, "errors") == 0)
        errors(size);
    else if (strcmp(what, "count") == 0)
        count(size);
    else if (strcmp(what, "check") != 0) {
        fprintf(stderr, "usage: report_sweep errors|count|check [quick | long]\n");
        return 2;
    }
    return 0;
}
