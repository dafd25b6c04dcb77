/* SPDX-License-Identifier: MIT */
/*
 * shots.h - beams of recordings in neutral text through the extractor, one by one, and walls fitted to what is loudest.
 * Recordings that may not be redistributed are looked for in ../shared/data.
 */
#ifndef SONARD_TEST_SHOTS_H
#define SONARD_TEST_SHOTS_H

#include "core/fault.h"
#include "grid/range/extract.h"
#include "test.h"

#define DATA     "../shared/data/"
#define TANK     DATA "micron-tank-rosbag/static_sonar.csv"
#define MAX_BINS 2000

static _Alignas(16) unsigned char extract_room[1 << 19];
static struct extract *extract;

/* One ping of a recording and what was found in it. */
struct shot {
    double bearing_deg, range_m;
    uint32_t n;
    uint8_t sample[MAX_BINS];
    struct beam_echoes found;
};

/* What the neutral files do not hold. */
struct head {
    enum amplitude_law law;
    double db_per_count, pulse_m;
};

static const struct head ping360 = {AMPLITUDE_SQRT, 0, 0.012};
static const struct head micron = {AMPLITUDE_LOG, 80.0 / 255.0, 0.05};

static inline void set_up(const struct extract_conf *conf)
{
    struct fault fault = {""};
    if (extract_size(MAX_BINS) > sizeof extract_room ||
        !(extract = extract_init(extract_room, conf, MAX_BINS, &fault))) {
        printf("extract_init: %s\n", fault.text);
        exit(1);
    }
}

static inline void run_shot(struct shot *shot, const struct head *head)
{
    struct ping_beam axis = {.az_rad = 0.0f};
    const struct ping ping = {
        .kind = PING_PROFILE,
        .law = (uint8_t)head->law,
        .sample_bytes = 1,
        .n_beams = 1,
        .n_bins = shot->n,
        .db_per_count = (float)head->db_per_count,
        .dr_m = (float)(shot->range_m / shot->n),
        .pulse_m = (float)head->pulse_m,
        .beam = &axis,
        .samples = shot->sample,
    };
    struct echoes out = {.max_beams = 1, .beam = &shot->found};
    extract_run(extract, &ping, NULL, &out);
}

/* Next ping of a file `t,bearing,range_max,n,v...`; false at its end. */
static inline bool shot_read(FILE *file, struct shot *shot)
{
    static char line[1 << 16];
    do {
        if (!fgets(line, sizeof line, file))
            return false;
    } while (line[0] == '#');
    char *at = line;
    strtod(at, &at);
    shot->bearing_deg = strtod(at + 1, &at);
    shot->range_m = strtod(at + 1, &at);
    const unsigned long n = strtoul(at + 1, &at, 10);
    shot->n = n < MAX_BINS ? (uint32_t)n : MAX_BINS;
    for (uint32_t i = 0; i < shot->n; i++)
        shot->sample[i] = (uint8_t)strtoul(at + 1, &at, 10);
    return true;
}

static inline FILE *recording(const char *path)
{
    FILE *file = fopen(path, "r");
    if (!file)
        exit(1); /* RUN_WITH has just seen it */
    return file;
}

struct wall {
    const char *name;
    double distance_m, normal_deg;
};

static inline double turned(double a_deg, double b_deg)
{
    return geo_deg(geo_wrap_pi(geo_rad(a_deg - b_deg)));
}

/* Range of the loudest bin within 0.6 m of range_m: where the sound says the wall is, without asking any detector. */
static inline double loudest_near(const struct shot *shot, double range_m)
{
    const double dr_m = shot->range_m / shot->n;
    uint32_t best = (uint32_t)((range_m - 0.6) / dr_m);
    for (uint32_t i = best; i < shot->n && i * dr_m < range_m + 0.6; i++)
        if (shot->sample[i] > shot->sample[best])
            best = i;
    return (best + 0.5) * dr_m;
}

/* One look at a wall: bearing and loudest bin of each beam, and the echoes. */
#define LOOK_BEAMS 48

struct look {
    int n;
    double bearing_deg[LOOK_BEAMS], loudest_m[LOOK_BEAMS];
    struct beam_echoes found[LOOK_BEAMS];
};

static inline int loudest_within(const struct look *look, const struct wall *wall, double limit_m, double *error_m)
{
    int n = 0;
    *error_m = 0.0;
    for (int i = 0; i < look->n; i++) {
        const double at_m = wall->distance_m / cos(geo_rad(look->bearing_deg[i] - wall->normal_deg));
        n += fabs(look->loudest_m[i] - at_m) < limit_m;
        *error_m += fmin(fabs(look->loudest_m[i] - at_m), limit_m);
    }
    return n;
}

/*
 * The straight wall near `about` that most loudest bins lie within 15 cm of, and among equals the nearest. The vehicle
 * floats and turns, so each look has its own.
 */
static inline struct wall fitted(const struct look *look, const struct wall *about)
{
    struct wall best = *about;
    double least_m = INFINITY;
    int most = -1;
    for (int d = -30; d <= 30; d++)
        for (int a = -20; a <= 20; a++) {
            const struct wall w = {about->name, about->distance_m + 0.005 * d, about->normal_deg + 0.25 * a};
            double error_m;
            const int n = loudest_within(look, &w, 0.15, &error_m);
            if (n < most || (n == most && error_m >= least_m))
                continue;
            most = n;
            least_m = error_m;
            best = w;
        }
    return best;
}

#endif
