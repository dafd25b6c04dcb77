/* SPDX-License-Identifier: MIT */
/*
 * conf_idle - keys that are set and do nothing, because another key or the sonars do not let them: all from one table.
 */
#include <fnmatch.h>
#include <stdio.h>
#include <string.h>

#include "conf.h"
#include "conf_table.h"
#include "conf_value.h"

#define CHOICES 3

enum how {
    BY_VALUE,  /* the key has one of the values */
    BY_USE,    /* the device has a use for the key */
    BY_NO_USE, /* it has none */
};

/* What lets a key do something. */
struct choice {
    const char *section, *key; /* of the same [sonar NAME] or [grid NAME]; of other sections in any */
    const char
        *values; /* BY_VALUE: as fnmatch(3) has it, with | between; NULL: anything but its word for nothing */
    enum how how;
    const char *words; /* of a device: what it is */
};

/* A row of the table: one of the choices must hold, or the key does nothing. All rows of a key count. */
struct need {
    const char *section, *key; /* NULL: all of the section but the key that it needs */
    struct choice any[CHOICES];
};

#define SET(s, k)                                                                                                 \
    {                                                                                                             \
        .section = (s), .key = (k)                                                                                \
    }
#define IS(s, k, v)                                                                                               \
    {                                                                                                             \
        .section = (s), .key = (k), .values = (v)                                                                 \
    }
#define DEVICE(h, k, w)                                                                                           \
    {                                                                                                             \
        .section = "sonar", .key = (k), .how = (h), .words = (w)                                                  \
    }
#define PROFILES  DEVICE(BY_USE, "amplitude", "a sonar that sends intensities")
#define RANGES    DEVICE(BY_NO_USE, "amplitude", "a sonar that reports ready ranges")
#define TEMPLATES DEVICE(BY_USE, "background", "a sonar that can have a template")

static const struct need needs[] = {
    {"sonar", "circle", {IS("sonar", "scan", "active"), SET("vehicle", "current")}},
    {"sonar", "decibels_per_count", {IS("sonar", "amplitude", "log")}},
    {"sonar", "power_active", {SET("sonar", "power")}},
    {"sonar", "power_cycle_after", {SET("sonar", "power")}},
    {"sonar", "power_at_stop", {SET("sonar", "power")}},
    {"sonar", "trigger_edge", {SET("sonar", "trigger")}},
    {"water", "density", {SET("depth", "source")}},
    {"water", "density", {IS("depth", "unit", "Pa|kPa|mbar|dbar|bar")}},
    {"extract", "detector", {PROFILES}},
    {"extract", "order", {PROFILES}},
    {"extract", "false_alarm", {PROFILES}},
    {"extract", "window", {PROFILES}},
    {"extract", "guard", {PROFILES}},
    {"extract", "rank", {PROFILES}},
    {"extract", "rank", {IS("extract", "detector", "os")}},
    {"extract", "floor", {PROFILES}},
    {"extract", "min_contrast", {PROFILES}},
    {"extract", "learn_ring_down", {PROFILES}},
    {"extract", "learn_ring_down", {IS("sonar", "ring_down", "auto")}},
    {"extract", "median", {PROFILES}},
    {"extract", "otsu", {PROFILES}},
    {"extract", "clahe", {PROFILES}},
    {"extract", "clahe_clip", {IS("extract", "clahe", "on")}},
    {"extract", "classes", {PROFILES}},
    {"extract", "no_echo", {PROFILES}},
    {"extract", "target", {PROFILES}},
    {"extract", "bottom", {PROFILES}},
    {"extract", "minimum_range", {IS("extract", "no_echo", "minimum"), RANGES}},
    {"background", NULL, {TEMPLATES}},
    {"grid", "range_error", {IS("grid", "sensor_model", "gauss|midpoint")}},
    {"grid", "mask_reach", {IS("grid", "sensor_model", "gauss|midpoint")}},
    {"map", NULL, {SET("map", "voxel")}},
    {"map", "echo_weight", {IS("map", "echoes", "on")}},
    {"map", "origin", {SET("map", "directory")}},
    {"vehicle", "slow", {IS("vehicle", "unknown", "slow")}},
    {"depth", NULL, {SET("depth", "source")}},
    {"depth", "parity", {IS("depth", "source", "modbus-rtu:*")}},
    {"depth", "resync", {IS("depth", "source", "modbus-rtu:*")}},
    {"depth", "word_order", {IS("depth", "type", "int32|float32")}},
    {"depth", "surface_pressure", {IS("depth", "unit", "Pa|kPa|mbar|dbar|bar")}},
    {"nmea", NULL, {SET("nmea", "port")}},
    {"nmea", "variation", {IS("nmea", "use", "heading|both")}},
    {"gpio", "chip", {SET("gpio", "leak"), SET("sonar", "power"), SET("sonar", "trigger")}},
    {"gpio", "leak_active", {SET("gpio", "leak")}},
    {"gpio", "leak_bias", {SET("gpio", "leak")}},
    {"pipeline", "queue", {IS("pipeline", "threads", "1|2")}},
    {"realtime", "processor_count", {SET("realtime", "processor")}},
    {"record", "file_size", {SET("record", "directory")}},
    {"record", "files", {SET("record", "directory")}},
    {"record", "start", {SET("record", "directory")}},
};

#define N_NEEDS (sizeof needs / sizeof *needs)

/* How many sections of that name there are. */
static int sections_of(const struct conf *conf, const char *section)
{
    return strcmp(section, "sonar") == 0  ? conf->n_sonars
           : strcmp(section, "grid") == 0 ? 1 + conf->n_more_grids
                                          : 1;
}

static void value_of(const struct conf *conf, const struct conf_key *key, int which, char text[CONF_VALUE_MAX])
{
    conf_value_write(key, (const char *)conf + conf_base(key, which), text, CONF_VALUE_MAX);
}

/* Is the text one of the patterns? */
static bool is_among(const char *text, const char *patterns)
{
    char one[CONF_VALUE_MAX];
    for (size_t n; *patterns; patterns += n + (patterns[n] == '|')) {
        n = strcspn(patterns, "|");
        snprintf(one, sizeof one, "%.*s", (int)n, patterns);
        if (fnmatch(one, text, 0) == 0)
            return true;
    }
    return false;
}

/* What is judged: a configuration, and who knows the devices. */
struct judged {
    const struct conf *conf;
    const struct conf_checks *checks;
};

static bool holds_in(const struct judged *j, const struct choice *c, int which)
{
    char text[CONF_VALUE_MAX];
    const struct conf_key *key = conf_key_find(c->section, c->key);
    if (c->how != BY_VALUE)
        return j->checks->uses(j->conf->sonar[which].device, c->key) == (c->how == BY_USE);
    value_of(j->conf, key, which, text);
    return c->values ? is_among(text, c->values) : strcmp(text, key->instead) != 0;
}

/* `which` of its kind has the key that asks. */
static bool is_met(const struct judged *j, const struct need *need, int which)
{
    for (int k = 0; k < CHOICES && need->any[k].key; k++) {
        const struct choice *c = &need->any[k];
        const bool same = strcmp(c->section, need->section) == 0;
        const int end = same ? which + 1 : sections_of(j->conf, c->section);
        for (int i = same ? which : 0; i < end; i++)
            if (holds_in(j, c, i))
                return true;
    }
    return false;
}

static bool concerns(const struct need *need, const struct conf_key *key)
{
    if (strcmp(need->section, key->section) != 0)
        return false;
    if (need->key)
        return strcmp(need->key, key->name) == 0;
    return strcmp(need->any[0].section, key->section) != 0 || strcmp(need->any[0].key, key->name) != 0;
}

/* "amplitude = log", or what holds instead of a key. */
static void choice_text(const struct choice *c, const char *section, char *text, size_t size)
{
    const bool own = strcmp(c->section, section) == 0;
    if (c->how != BY_VALUE) {
        snprintf(text, size, "%s", c->words);
        return;
    }
    size_t used = own ? (size_t)snprintf(text, size, "%s", c->key)
                      : (size_t)snprintf(text, size, "[%s] %s", c->section, c->key);
    for (const char *at = c->values; at && *at && used < size;
         at += strcspn(at, "|") + (at[strcspn(at, "|")] == '|'))
        used += (size_t)snprintf(text + used, size - used, "%s%.*s", at == c->values ? " = " : " or ",
                                 (int)strcspn(at, "|"), at);
}

/* The whole sentence. */
static void sentence(const struct conf *conf, const struct conf_key *key, int which, const struct need *need,
                     char text[FAULT_TEXT_MAX])
{
    const char *name = conf_key_is_sonar(key) ? conf->sonar[which].name
                       : which                ? conf->more_grid[which - 1].name
                                              : "";
    char value[CONF_VALUE_MAX], one[3 * CONF_NAME_MAX];
    value_of(conf, key, which, value);
    size_t used = (size_t)snprintf(text, FAULT_TEXT_MAX, "[%s%s%s] %s = %.100s has no effect without ",
                                   key->section, *name ? " " : "", name, key->name, value);
    for (int i = 0; i < CHOICES && need->any[i].key && used < FAULT_TEXT_MAX; i++) {
        choice_text(&need->any[i], key->section, one, sizeof one);
        used += (size_t)snprintf(text + used, FAULT_TEXT_MAX - used, "%s%s", i ? " or " : "", one);
    }
}

/* Is it another value than the default, and in a grid with a name than that of [grid], which it repeats? */
static bool is_set(const struct conf *conf, const struct conf *defaults, const struct conf_key *key, int which)
{
    char value[CONF_VALUE_MAX], standard[CONF_VALUE_MAX];
    const bool repeats = !conf_key_is_sonar(key) && which > 0;
    value_of(conf, key, which, value);
    value_of(repeats ? conf : defaults, key, 0, standard);
    return strcmp(value, standard) != 0;
}

/* The first row of the key that is not met; NULL: it does something. */
static const struct need *unmet(const struct judged *j, const struct conf_key *key, int which)
{
    for (size_t i = 0; i < N_NEEDS; i++)
        if (concerns(&needs[i], key) && !is_met(j, &needs[i], which))
            return &needs[i];
    return NULL;
}

void conf_idle(const struct conf *conf, const struct conf_checks *checks, conf_fault_fn tell, void *ctx)
{
    const struct judged j = {conf, checks};
    struct conf defaults;
    char text[FAULT_TEXT_MAX];
    conf_defaults(&defaults);
    const locale_t outside = conf_locale_enter();
    for (const struct conf_key *key = conf_keys; key->name; key++)
        for (int i = 0; i < sections_of(conf, key->section); i++) {
            const struct need *need = unmet(&j, key, i);
            if (!need || !is_set(conf, &defaults, key, i))
                continue;
            sentence(conf, key, i, need, text);
            tell(ctx, text);
        }
    conf_locale_leave(outside);
}
