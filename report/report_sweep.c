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

/* A row for each value of a key. */
#define MAX_VALUES 4
#define SHIPPED    ""
#define LOG        "amplitude = log\ndecibels_per_count = 0.3 dB\n"
#define CLEANUP    "[extract]\nmedian = 3\notsu = on\nclahe = on\nclasses = on\n"
#define PAPER      "[extract]\norder = paper\n"
#define CLAHE      "[extract]\norder = paper\nclahe = on\n"
#define OS         "[extract]\ndetector = os\n"
#define MINIMUM    "[extract]\nno_echo = minimum\n"
#define GAUSS      "[grid]\nsensor_model = gauss\n"
#define CLEAR_3S   "[grid]\nclear_for = 3 s\n"
#define MAP        "[map]\nvoxel = 0.2 m\n"

static const struct swept {
    const char *section, *key;
    const char *more;              /* as in struct knob */
    bool learn;                    /* with a template of the vehicle */
    bool listed;                   /* no other chapter turns it */
    const char *value[MAX_VALUES]; /* as a file has it; the first may be SHIPPED */
} swept[] = {
    {"sonar", "ring_down", NULL, false, false, {SHIPPED, "0.5 m", "1.5 m"}},
    {"sonar", "amplitude", NULL, false, false, {SHIPPED, "linear", "power", "sqrt"}},
    {"sonar", "decibels_per_count", LOG, false, false, {"0.2 dB", "0.3137 dB", "0.45 dB"}},
    {"sonar", "aperture", NULL, false, false, {SHIPPED, "1 12 deg", "4 40 deg"}},
    {"sonar", "mount", NULL, false, false, {SHIPPED, "0.3 0 0 m", "0 0 0.3 m"}},
    {"sonar", "rotation", NULL, false, false, {SHIPPED, "0 0 3 deg", "0 0 90 deg"}},
    {"sonar", "mirror", NULL, false, false, {SHIPPED, "yes"}},
    {"water", "sound_speed", NULL, false, false, {SHIPPED, "1450 m/s", "1550 m/s"}},
    {"extract", "detector", NULL, false, false, {SHIPPED, "ca", "goca", "os"}},
    {"extract", "order", CLEANUP, false, false, {SHIPPED, "paper"}},
    {"extract", "false_alarm", NULL, false, false, {SHIPPED, "1e-2", "1e-5", "1e-8"}},
    {"extract", "window", NULL, false, false, {SHIPPED, "0.2 m", "0.8 m", "3.2 m"}},
    {"extract", "guard", NULL, false, false, {SHIPPED, "0 m", "0.05 m", "0.3 m"}},
    {"extract", "rank", OS, false, true, {SHIPPED, "0.25", "0.5", "1"}},
    {"extract", "floor", NULL, false, false, {SHIPPED, "1", "30"}},
    {"extract", "min_contrast", NULL, false, false, {SHIPPED, "8 dB", "11 dB", "20 dB"}},
    {"extract", "learn_ring_down", NULL, false, true, {SHIPPED, "on"}},
    {"extract", "median", PAPER, false, false, {SHIPPED, "3", "5"}},
    {"extract", "otsu", PAPER, false, false, {SHIPPED, "on"}},
    {"extract", "clahe", PAPER, false, true, {SHIPPED, "on"}},
    {"extract", "clahe_clip", CLAHE, false, true, {SHIPPED, "1", "4", "100"}},
    {"extract", "classes", PAPER, false, false, {SHIPPED, "on"}},
    {"extract", "marks", NULL, false, false, {SHIPPED, "off"}},
    {"extract", "no_echo", NULL, false, true, {SHIPPED, "minimum", "range"}},
    {"extract", "target", NULL, false, false, {SHIPPED, "pile", "net", "line"}},
    {"extract", "bottom", NULL, false, false, {SHIPPED, "off", "12 dB", "20 dB"}},
    {"extract", "minimum_range", MINIMUM, false, true, {SHIPPED, "0.1 m", "3 m", "10 m"}},
    {"background", "mask", NULL, true, true, {SHIPPED, "16", "160", "250"}},
    {"background", "neighbour", NULL, true, true, {SHIPPED, "0.05 m", "0.5 m"}},
    {"background", "min_points", NULL, true, true, {SHIPPED, "2", "30"}},
    {"background", "min_level", NULL, true, true, {SHIPPED, "20", "240"}},
    {"background", "extent", NULL, true, true, {SHIPPED, "0.1 m", "5 m"}},
    {"background", "reach", NULL, true, true, {SHIPPED, "0.5 m", "12 m"}},
    {"background", "share", NULL, true, true, {SHIPPED, "0.01", "1"}},
    {"background", "ring", NULL, true, true, {SHIPPED, "0 m", "1 m"}},
    {"background", "open_water", NULL, true, true, {SHIPPED, "yes"}},
    {"grid", "range", NULL, false, false, {SHIPPED, "6 m", "20 m"}},
    {"grid", "angular_step", NULL, false, false, {SHIPPED, "1 deg", "4 deg", "10 deg"}},
    {"grid", "layer", NULL, false, false, {SHIPPED, "0.01 m", "0.2 m"}},
    {"grid", "growth", NULL, false, false, {SHIPPED, "1", "1.1", "1.3"}},
    {"grid", "elevation", NULL, false, false, {SHIPPED, "level"}},
    {"grid", "axes", NULL, false, true, {SHIPPED, "course"}},
    {"grid", "sensor_model", NULL, false, false, {SHIPPED, "gauss", "midpoint"}},
    {"grid", "update", NULL, false, false, {SHIPPED, "max"}},
    {"grid", "range_error", GAUSS, false, true, {SHIPPED, "0", "0.01", "0.05"}},
    {"grid", "mask_reach", GAUSS, false, true, {SHIPPED, "1.2", "3", "4"}},
    {"grid", "relaxation", NULL, false, false, {SHIPPED, "0.5", "1"}},
    {"grid", "max_cells", NULL, false, false, {SHIPPED, "1024", "8192"}},
    {"grid", "blocked_above", NULL, false, true, {SHIPPED, "0.51", "0.75", "0.95"}},
    {"grid", "clear_for", NULL, false, false, {SHIPPED, "3 s", "10 s", "120 s"}},
    {"grid", "forget", CLEAR_3S, false, true, {SHIPPED, "5 s", "30 s", "1000 s"}},
    {"grid", "move_limit", NULL, false, true, {SHIPPED, "0.1 m", "0.5 m", "2 m"}},
    {"map", "voxel", NULL, false, false, {"0.2 m", "0.1 m", "0.4 m"}},
    {"map", "memory", MAP, false, false, {SHIPPED, "8 MiB", "256 MiB"}},
    {"map", "extent", MAP, false, false, {SHIPPED, "10 m", "60 m"}},
    {"map", "height", MAP, false, false, {SHIPPED, "4 m", "30 m"}},
    {"map", "threshold", MAP, false, false, {SHIPPED, "0", "2", "8"}},
    {"map", "echoes", MAP, false, false, {SHIPPED, "off"}},
    {"map", "echo_weight", MAP, false, false, {SHIPPED, "0", "1", "8"}},
    {"map", "tolerance", MAP, false, false, {SHIPPED, "0.05 m", "0.2 m"}},
    {"map", "opening", MAP, false, false, {SHIPPED, "0.1", "1"}},
    {"map", "weight_levels", MAP, false, false, {SHIPPED, "4", "8"}},
    {"map", "beam", MAP, false, false, {SHIPPED, "pyramid"}},
    {"map", "body", MAP, false, false, {SHIPPED, "0.25 m", "0.5 m"}},
    {"map", "submap_distance", MAP, false, false, {SHIPPED, "1 m", "50 m"}},
    {"map", "submap_time", MAP, false, true, {SHIPPED, "5 s", "20 s"}},
    {"map", "forget", MAP, false, true, {SHIPPED, "5 s", "20 s"}},
    {"pose", "max_age", NULL, false, false, {SHIPPED, "0.05 s", "10 s"}},
    {"pose", "heading_drift", NULL, false, false, {SHIPPED, "0 deg/s", "0.1 deg/s", "1 deg/s"}},
    {"pose", "delay", NULL, false, false, {SHIPPED, "0.1 0.05 s", "0.5 0.5 s"}},
    {"vehicle", "radius", NULL, false, false, {SHIPPED, "0.1 m", "1 m"}},
    {"vehicle", "height", NULL, false, false, {SHIPPED, "0.1 m", "2 m"}},
    {"vehicle", "margin", NULL, false, false, {SHIPPED, "0 m", "1 m"}},
    {"vehicle", "near", NULL, false, false, {SHIPPED, "1 m", "4 m"}},
    {"vehicle", "max_speed", NULL, false, false, {SHIPPED, "0.2 m/s", "2 m/s"}},
    {"vehicle", "max_turn", NULL, false, false, {SHIPPED, "20 deg/s", "180 deg/s"}},
    {"vehicle", "braking", NULL, false, false, {SHIPPED, "0.05 m/s2", "1 m/s2"}},
    {"vehicle", "latency", NULL, false, false, {SHIPPED, "0 s", "2 s"}},
    {"vehicle", "unknown", NULL, false, false, {SHIPPED, "stop", "ignore"}},
    {"vehicle", "slow", NULL, false, false, {SHIPPED, "0 m/s", "0.3 m/s"}},
};
#define SWEPT (sizeof swept / sizeof swept[0])

static struct row {
    struct knob knob;
    const struct swept *of;
} rows[SWEPT * MAX_VALUES];
static size_t n_rows;

static void make_rows(void)
{
    for (const struct swept *s = swept; s < swept + SWEPT; s++)
        for (unsigned v = 0; v < MAX_VALUES && s->value[v]; v++)
            rows[n_rows++] = (struct row){.knob = {.name = s->key,
                                                   .section = s->section,
                                                   .value = *s->value[v] ? s->value[v] : NULL,
                                                   .more = s->more},
                                          .of = s};
}

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
    for (size_t i = 0; i < SWEPT; i++)
        if (strcmp(swept[i].section, key->section) == 0 && strcmp(swept[i].key, key->name) == 0)
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
    static struct knob knob[SWEPT * MAX_VALUES];
    for (size_t i = 0; i < n_rows; i++)
        knob[i] = rows[i].knob;
    knob_check(knob, n_rows);
}

static bool is_run(const struct row *row, const char *size)
{
    const bool all = strcmp(size, "long") == 0, few = strcmp(size, "quick") == 0;
    return all || (row->of->listed && (!few || strcmp(row->knob.section, "extract") == 0));
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
        for (size_t i = 0; i < n_rows; i++) {
            struct way_tally t = {0};
            struct conf conf;
            if (!is_run(&rows[i], size))
                continue;
            knob_conf(&rows[i].knob, &conf);
            way_run(&way, &conf, rows[i].of->learn, &t);
            print_tally(&rows[i], seed, &t);
        }
    }
}

static void count(const char *size)
{
    static struct way way;
    way_record(&way, 1, COUNT_PINGS);
    printf(KNOB_COLUMNS ",section,bins\n");
    for (size_t i = 0; i < n_rows; i++) {
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
    make_rows();
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
