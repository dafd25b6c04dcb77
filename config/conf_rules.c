/* SPDX-License-Identifier: MIT */
/*
 * conf_rules - values that are good each and do not go together. A rule is reported at the later of the two lines, and
 * not at all where one of the two values was refused already.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "conf_source.h"
#include "conf_value.h"
#include "core/fault.h"

struct place {
    const char *section, *key;
    int sonar; /* or grid; 0 outside [sonar NAME] and [grid NAME] */
};

struct rules {
    const struct conf *conf;
    const struct conf_source *source;
    struct conf_faults *faults;
};

static const struct conf_origin *origin(const struct rules *r, struct place at)
{
    return &r->source->origin[at.sonar][conf_key_find(at.section, at.key) - conf_keys];
}

/* The line of a fault there, whose file the faults now are in. */
static unsigned line_of(const struct rules *r, struct place at)
{
    const struct conf_origin *from = origin(r, at);
    conf_fault_in(r->faults, from->file, r->source->file[from->file].name);
    return from->line;
}

/* "[sonar front] range = 20 m" */
static void describe_key(const struct rules *r, struct place at, char *text, size_t size)
{
    const struct conf_key *key = conf_key_find(at.section, at.key);
    const char *name = conf_key_is_sonar(key) ? r->conf->sonar[at.sonar].name
                       : at.sonar             ? r->conf->more_grid[at.sonar - 1].name
                                              : "";
    char value[CONF_VALUE_MAX];
    conf_value_write(key, (const char *)r->conf + conf_base(key, at.sonar), value, sizeof value);
    snprintf(text, size, "[%s%s%s] %s = %s", at.section, *name ? " " : "", name, at.key, value);
}

static void rule(const struct rules *r, struct place a, struct place b, bool holds, const char *want)
{
    if (holds || origin(r, a)->bad || origin(r, b)->bad)
        return;
    const struct conf_origin *of_a = origin(r, a), *of_b = origin(r, b);
    bool b_is_later = of_b->file > of_a->file || (of_b->file == of_a->file && of_b->line > of_a->line);
    struct place later = b_is_later ? b : a, other = b_is_later ? a : b;
    char here[2 * CONF_VALUE_MAX], there[2 * CONF_VALUE_MAX];
    describe_key(r, later, here, sizeof here);
    describe_key(r, other, there, sizeof there);
    conf_fault_add(r->faults, line_of(r, later), "%s: does not go with %s; expected %s", here, there, want);
}

/* Clockwise way from start to end; outside (0, 2 pi] it is no sector. */
static double sector_extent(const double sector_rad[2])
{
    double extent = sector_rad[1] - sector_rad[0];
    if (extent < 0)
        extent += 2 * M_PI;
    return extent;
}

static void check_sonar(const struct rules *r, int i)
{
    const double slack = 1e-9; /* of angles that are equal but for rounding */
    const struct conf_sonar *s = &r->conf->sonar[i];
    struct place sector = {"sonar", "sector", i}, step = {"sonar", "step", i}, range = {"sonar", "range", i};
    double extent = sector_extent(s->sector_rad);
    if (!(extent > slack && extent < 2 * M_PI + slack)) {
        char here[2 * CONF_VALUE_MAX];
        describe_key(r, sector, here, sizeof here);
        conf_fault_add(
            r->faults, line_of(r, sector),
            "%s: %s; expected start and end at most one turn apart, clockwise, 0 360 deg for the full circle",
            here, fabs(extent) > slack ? "more than one turn" : "starts where it ends");
    } else {
        rule(r, sector, step, s->step_rad < extent - slack, "a step smaller than the sector");
    }
    rule(r, range, (struct place){"sonar", "ring_down", i}, s->ring_down_m < s->range_m,
         "ring_down smaller than range");
    rule(r, (struct place){"sonar", "amplitude", i}, (struct place){"sonar", "decibels_per_count", i},
         s->amplitude != CONF_AMPLITUDE_LOG || s->db_per_count > 0, "decibels_per_count for amplitude = log");
    rule(r, range, (struct place){"extract", "minimum_range", 0}, r->conf->extract.minimum_range_m <= s->range_m,
         "minimum_range not beyond range");
}

/* Beyond the range of every sonar none will ever show what stands there. */
static void check_near(const struct rules *r)
{
    const struct conf *conf = r->conf;
    int farthest = 0;
    for (int i = 1; i < conf->n_sonars; i++)
        if (conf->sonar[i].range_m > conf->sonar[farthest].range_m)
            farthest = i;
    rule(r, (struct place){"vehicle", "near", 0}, (struct place){"sonar", "range", farthest},
         conf->n_sonars == 0 || conf->vehicle.near_m <= conf->sonar[farthest].range_m,
         "near not beyond the range of every sonar");
}

/* Length of "serial:DEVICE" in a port; 0: no serial line. */
static size_t serial_line(const char *port)
{
    static const char kind[] = "serial:";
    return strncmp(port, kind, sizeof kind - 1) ? 0 : sizeof kind - 1 + strcspn(port + sizeof kind - 1, ":");
}

static bool same_line(const char *a, const char *b)
{
    size_t n = serial_line(a);
    return n && n == serial_line(b) && strncmp(a, b, n) == 0;
}

/* A serial line belongs to one device; the first of the others is reported. */
static void check_lines(const struct rules *r)
{
    static const char want[] = "another serial port: each device needs its own";
    const struct conf *conf = r->conf;
    for (int i = 0; i < conf->n_sonars; i++) {
        struct place here = {"sonar", "port", i};
        int k = 0;
        while (k < i && !same_line(conf->sonar[i].port, conf->sonar[k].port))
            k++;
        rule(r, here, (struct place){"sonar", "port", k}, k == i, want);
        rule(r, here, (struct place){"nmea", "port", 0}, !same_line(conf->sonar[i].port, conf->nmea.port), want);
    }
}

/* Every key of the sonar was understood, and those that must be there are. */
static bool is_whole(const struct rules *r, int i)
{
    for (const struct conf_key *key = conf_keys; key->name; key++) {
        const struct conf_origin *from = &r->source->origin[i][key - conf_keys];
        if (conf_key_is_sonar(key) && (from->bad || (!key->standard && from->line == 0)))
            return false;
    }
    return true;
}

/* Where the key stands with which the sentence begins; where its default is in force, where the device is named. */
static struct place place_of(const struct rules *r, int i, const char *sentence)
{
    static const char *const sections[] = {"sonar", "water"};
    char name[CONF_NAME_MAX];
    snprintf(name, sizeof name, "%.*s", (int)strcspn(sentence, " :"), sentence);
    for (size_t k = 0; k < sizeof sections / sizeof sections[0]; k++) {
        struct place at = {sections[k], name, k == 0 ? i : 0};
        const struct conf_key *key = conf_key_find(at.section, at.key);
        if (key && origin(r, at)->line > 0)
            return (struct place){key->section, key->name, at.sonar};
    }
    return (struct place){"sonar", "device", i};
}

/* What the device itself has to say. */
static void check_device(const struct rules *r, const struct conf_checks *checks, int i)
{
    const struct conf_sonar *s = &r->conf->sonar[i];
    struct fault fault;
    if (!is_whole(r, i) || checks->sonar(s, &r->conf->water, &fault))
        return;
    conf_fault_add(r->faults, line_of(r, place_of(r, i, fault.text)), "[sonar %s] %s", s->name, fault.text);
}

/* What only the start can judge, reported at the line of the key that the sentence begins with. */
static void check_whole(const struct rules *r, const struct conf_checks *checks)
{
    char section[16], name[CONF_NAME_MAX];
    unsigned line = 0;
    struct fault fault;
    if (checks->whole(r->conf, &fault))
        return;
    if (sscanf(fault.text, "[%15[a-z]] %31[a-z_]", section, name) == 2 && conf_key_find(section, name))
        line = line_of(r, (struct place){section, name, 0});
    conf_fault_add(r->faults, line, "%s", fault.text);
}

/* On processors of their own every real-time thread has one:
 * no two wait for each other while a third program cannot. */
static void check_processors(const struct rules *r)
{
    const struct conf_realtime *rt = &r->conf->realtime;
    const int threads = 1 + r->conf->pipeline.threads;
    char want[80];
    snprintf(want, sizeof want, "processor_count = %d: one for the loop and one for each thread", threads);
    rule(r, (struct place){"realtime", "processor_count", 0}, (struct place){"pipeline", "threads", 0},
         rt->priority == 0 || rt->processor < 0 || rt->processor_count >= threads, want);
}

void conf_rules_check(const struct conf *conf, const struct conf_source *source, const struct conf_checks *checks,
                      struct conf_faults *faults)
{
    struct rules r = {conf, source, faults};
    for (int i = 0; i < conf->n_sonars; i++)
        check_sonar(&r, i);
    for (int i = 0; checks && checks->sonar && i < conf->n_sonars; i++)
        check_device(&r, checks, i);
    check_near(&r);
    check_lines(&r);
    check_processors(&r);
    rule(&r, (struct place){"extract", "guard", 0}, (struct place){"extract", "window", 0},
         conf->extract.guard_m < conf->extract.window_m, "guard smaller than window");
    bool has_file = false;
    for (int i = 0; i < conf->n_sonars; i++)
        has_file |= conf->sonar[i].background[0] != '\0';
    rule(&r, (struct place){"background", "save_every", 0}, (struct place){"sonar", "background", 0},
         !(conf->background.save_every_s > 0) || has_file, "a file to save a sonar's template in");
    const struct conf_extract *e = &conf->extract;
    const bool judged = e->otsu == CONF_ON || e->classes == CONF_ON || e->order == CONF_ORDER_PAPER;
    rule(&r, (struct place){"extract", "median", 0}, (struct place){"extract", "order", 0},
         e->median == CONF_MEDIAN_OFF || judged,
         "otsu or classes on, or order = paper: it has no effect otherwise");
    rule(&r, (struct place){"extract", "clahe", 0}, (struct place){"extract", "order", 0},
         e->clahe == CONF_OFF || judged, "otsu or classes on, or order = paper: it has no effect otherwise");
    for (int i = 0; i <= conf->n_more_grids; i++) {
        const struct conf_grid *grid = i ? &conf->more_grid[i - 1] : &conf->grid;
        const struct place forget = {"grid", "forget", i}, clear_for = {"grid", "clear_for", i};
        const bool told =
            i && grid->forget_s == conf->grid.forget_s && grid->clear_for_s == conf->grid.clear_for_s;
        rule(&r, forget, clear_for, told || grid->forget_s <= 0 || grid->forget_s >= grid->clear_for_s,
             "forget not shorter than clear_for");
    }
    const struct place directory = {"map", "directory", 0};
    rule(&r, (struct place){"map", "save_every", 0}, directory,
         !(conf->map.save_every_s > 0) || conf->map.directory[0], "a directory to save the map in");
    rule(&r, (struct place){"map", "load", 0}, directory, !conf->map.load[0] || conf->map.directory[0],
         "a directory to load the map from");
    rule(&r, (struct place){"depth", "turnaround", 0}, (struct place){"depth", "timeout", 0},
         conf->depth.turnaround_s >= conf->depth.timeout_s, "turnaround not shorter than timeout");
    rule(&r, (struct place){"nmea", "use", 0}, (struct place){"depth", "source", 0},
         !conf->nmea.port[0] || conf->nmea.use == CONF_NMEA_HEADING || conf->nmea.use == CONF_NMEA_ALTITUDE ||
             !conf->depth.source[0],
         "depth from one of them");
    if (checks && checks->whole && faults->n == 0)
        check_whole(&r, checks);
}
