/* SPDX-License-Identifier: MIT */
/*
 * device_key - the keys that a device declares, and a configuration held against them.
 */
#include "device.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "grid/geometry.h"

#define SOUND_SPEED_LEAST_MPS 1350.0
#define SOUND_SPEED_MOST_MPS  1650.0
#define SECTOR_END_MOST_RAD   (2.0 * GEO_TURN)
#define FULL_CIRCLE_RAD       1e-9 /* of ends that are equal but for rounding */

/* A number of struct device_conf that devices have ranges for. */
static const struct number {
    const char *key, *unit;
    double si;        /* one unit */
    size_t offset;    /* of a double, ... */
    bool whole;       /* ... or of an int */
    double automatic; /* stands for the device's own choice; NAN: nothing does */
} numbers[] = {
    {"range", " m", 1, offsetof(struct device_conf, range_m), false, NAN},
    {"gain", "", 1, offsetof(struct device_conf, gain), true, -1},
    {"step", " deg", GEO_PI / 180, offsetof(struct device_conf, step_rad), false, 0},
    {"frequency", " kHz", 1e3, offsetof(struct device_conf, frequency_hz), false, 0},
    {"node", "", 1, offsetof(struct device_conf, node), true, -1},
    {"sensor_id", "", 1, offsetof(struct device_conf, sensor_id), true, -1},
    {"min_confidence", "", 1, offsetof(struct device_conf, min_confidence), false, NAN},
};

const struct device_key *device_key_find(const struct device_ops *ops, const char *name)
{
    for (const struct device_key *key = ops->keys; key && key->name; key++)
        if (strcmp(key->name, name) == 0)
            return key;
    return NULL;
}

void device_key_text(const struct device_key *key, char *text, size_t size)
{
    const char *unit = "", *help = key->help;
    int n = snprintf(text, size, "%s", key->name);
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        if (strcmp(numbers[i].key, key->name) == 0)
            unit = numbers[i].unit;
    if (key->lo < key->hi)
        n += snprintf(text + n, size - (size_t)n, " %g to %g%s", key->lo, key->hi, unit);
    snprintf(text + n, size - (size_t)n, "%s%s%s", help ? " (" : "", help ? help : "", help ? ")" : "");
}

/* A key without an own range is as the configuration has checked it. */
static bool check_number(const struct device_ops *ops, const struct number *number, const struct device_conf *conf,
                         struct fault *fault)
{
    const struct device_key *key = device_key_find(ops, number->key);
    char takes[DEVICE_KEY_TEXT_MAX];
    const void *at = (const char *)conf + number->offset;
    const double si = number->whole ? *(const int *)at : *(const double *)at, value = si / number->si;
    if (!key || key->lo == key->hi || si == number->automatic || (value >= key->lo && value <= key->hi))
        return true;
    device_key_text(key, takes, sizeof takes);
    return fault_set(fault, "%s = %g%s: %s takes %s", key->name, value, number->unit, ops->name, takes);
}

bool device_conf_check(const struct device_ops *ops, const struct device_conf *conf, struct fault *fault)
{
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        if (!check_number(ops, &numbers[i], conf, fault))
            return false;
    if (!(conf->sound_speed_mps >= SOUND_SPEED_LEAST_MPS && conf->sound_speed_mps <= SOUND_SPEED_MOST_MPS))
        return fault_set(fault, "sound_speed = %g m/s: must be %g .. %g m/s", conf->sound_speed_mps,
                         SOUND_SPEED_LEAST_MPS, SOUND_SPEED_MOST_MPS);
    if (!(fabs(conf->sector_start_rad) <= SECTOR_END_MOST_RAD &&
          fabs(conf->sector_end_rad) <= SECTOR_END_MOST_RAD))
        return fault_set(fault, "sector = %g %g deg: must lie in -720 .. 720 deg", geo_deg(conf->sector_start_rad),
                         geo_deg(conf->sector_end_rad));
    if (conf->steered &&
        fabs(remainder(conf->sector_end_rad - conf->sector_start_rad, GEO_TURN)) > FULL_CIRCLE_RAD)
        return fault_set(fault, "scan = active needs the full circle, sector = 0 360 deg");
    return true;
}
