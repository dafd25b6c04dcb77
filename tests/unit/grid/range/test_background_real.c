/* SPDX-License-Identifier: MIT */
/*
 * test_background_real - a template learnt where it should not be: from recordings of sonars among walls that stand
 * still, as if the vehicle stood there (--standing), with [background] as shipped. What is masked then, of which walls,
 * and is water behind them called free? docs/background.md quotes the lines that begin with #.
 */
#include "tests/lib/shots.h"

#include "grid/range/background_keep.h"
#include "grid/range/background_learn.h"

#define QUAY       DATA "micron-quay-rosbag/2014-07-18-20-59-31.csv"
#define OPEN_WATER DATA "ping360-openwater-pingviewer/20240814-102337673.60m-pings1000-1500.csv"
#define SEABED     DATA "tritech-seanet-rov-seabed/sonar.part1.csv"
#define BOX        "tests/replay/box.csv"

#define MASK   64
#define PINGS  15
#define OFF_M  0.15 /* of a wall's range: the vehicle floats */
#define BEHIND 0.2

struct scene {
    const char *name, *path;
    struct head head;
    double aperture_deg;
    uint32_t turn, rounds; /* units of the head; times that the recording is heard */
    struct {
        struct wall wall;
        double half_width_deg;
    } side[3];
};

static const struct scene scenes[] = {
    {"box",
     BOX,
     {AMPLITUDE_SQRT, 0, 0.012},
     2,
     400,
     15,
     {{{"side A", 0.261, 94.8}, 75}, {{"side B", 0.294, 273.9}, 72}, {{"end", 1.460, 184.7}, 10}}},
    {"tank",
     TANK,
     {AMPLITUDE_LOG, 80.0 / 255.0, 0.05},
     3,
     6400,
     5,
     {{{"N", 0.19, 354}, 45}, {{"W", 2.21, 264}, 36}, {{"S", 3.98, 175}, 14}}},
    {"quay", QUAY, {AMPLITUDE_LOG, 80.0 / 255.0, 0.05}, 3, 6400, 1, {{{NULL, 0, 0}, 0}}},
    {"sea bed", SEABED, {AMPLITUDE_LOG, 80.0 / 255.0, 0.15}, 3, 6400, 5, {{{NULL, 0, 0}, 0}}},
    {"open water", OPEN_WATER, {AMPLITUDE_SQRT, 0, 0.24}, 2, 400, 5, {{{NULL, 0, 0}, 0}}},
};

/* As shipped, mask apart. */
static const struct background_rule rule = {.neighbour_m = 0.15,
                                            .min_points = 6,
                                            .min_level = 80,
                                            .extent_m = 1,
                                            .reach_m = 3,
                                            .share = 0.25,
                                            .ring_m = 0.5};

static struct shot shot;
static struct ping_beam axis;

static struct ping ping_of(const struct scene *s)
{
    const double az_rad = geo_wrap(geo_rad(shot.bearing_deg));
    axis = (struct ping_beam){.az_rad = (float)az_rad};
    return (struct ping){.kind = PING_PROFILE,
                         .law = (uint8_t)s->head.law,
                         .sample_bytes = 1,
                         .n_beams = 1,
                         .n_bins = shot.n,
                         .db_per_count = (float)s->head.db_per_count,
                         .dr_m = (float)(shot.range_m / shot.n),
                         .pulse_m = (float)s->head.pulse_m,
                         .az_aperture_rad = (float)geo_rad(s->aperture_deg),
                         .head_units = (uint32_t)(az_rad / GEO_TURN * s->turn + 0.5) % s->turn,
                         .head_turn = s->turn,
                         .pose = pose_identity,
                         .beam = &axis,
                         .samples = shot.sample};
}

/* The recording over and over, as one that never ends would be heard. */
static struct background_learn *learn(const struct scene *s)
{
    const struct background_learn_conf conf = {.pings = PINGS, .standing = true};
    struct background_learn *l = NULL;
    for (uint32_t round = 0; round < s->rounds; round++) {
        FILE *file = recording(s->path);
        while (shot_read(file, &shot)) {
            const struct ping p = ping_of(s);
            struct background_shape shape;
            if (!l && background_shape_of(&p, &shape))
                l = background_learn_init(malloc(background_learn_size(&shape, PINGS)), &shape, &conf,
                                          &mount_identity);
            background_learn_take(l, &p);
        }
        fclose(file);
    }
    return l;
}

static struct background *template_of(const struct scene *s)
{
    struct background_learn *l = learn(s);
    const struct background_shape *shape = background_learn_shape(l);
    struct background *b = background_init(malloc(background_size(shape)), shape, MASK);
    void *work = malloc(background_keep_size(shape));
    struct background_progress progress;
    struct background_kept kept;
    background_learn_progress(l, &progress);
    background_learn_finish(l, 3, b);
    background_keep(b, &rule, work, &kept);
    free(work);
    free(l);
    uint32_t beyond = 0, rows = 0;
    for (uint32_t row = 0; row < b->shape.rows; row++) {
        rows += b->learnt[row] > 0;
        for (uint32_t i = (uint32_t)(rule.ring_m / (double)b->shape.dr_m) + 1; i < b->shape.bins; i++)
            beyond += b->level[(size_t)row * b->shape.bins + i] > MASK;
    }
    printf("# %s: %u rows, loud %u cells, masked %u, of those beyond the ring of 0.5 m %u (%u of %u clusters)\n",
           s->name, rows, kept.removed + kept.blind, kept.blind, beyond, kept.kept, kept.clusters);
    return b;
}

/* Is any of the cells within OFF_M of a range masked? */
static bool masked_near(const uint8_t *blind, double range_m)
{
    for (uint32_t i = 0; i < shot.n; i++)
        if (blind[i] && fabs((i + 0.5) * shot.range_m / shot.n - range_m) < OFF_M)
            return true;
    return false;
}

static void learn_and_look(const struct scene *s)
{
    static uint8_t blind[MAX_BINS], level[MAX_BINS];
    struct background *b = template_of(s);
    struct extract_conf conf;
    int beams[3] = {0}, masked[3] = {0}, behind[3] = {0};
    FILE *file = recording(s->path);
    extract_defaults(&conf);
    conf.no_echo = EXTRACT_RANGE; /* the boldest */
    set_up(&conf);
    while (shot_read(file, &shot)) {
        struct ping p = ping_of(s);
        struct echoes out = {.max_beams = 1, .beam = &shot.found};
        bool any = false;
        memset(blind, 0, sizeof blind);
        background_view(b, &p, &(struct background_view){level, blind}, &any);
        extract_run(extract, &p, &(struct extract_aid){.blind = any ? blind : NULL, .lowest = -1}, &out);
        for (int w = 0; w < 3 && s->side[w].wall.name; w++) {
            const double off_deg = turned(shot.bearing_deg, s->side[w].wall.normal_deg);
            const double at_m = s->side[w].wall.distance_m / cos(geo_rad(off_deg));
            if (fabs(off_deg) > s->side[w].half_width_deg)
                continue;
            beams[w]++;
            masked[w] += masked_near(blind, at_m);
            behind[w] += shot.found.free_to_m > shot.found.blind_m && (double)shot.found.free_to_m > at_m + BEHIND;
        }
    }
    fclose(file);
    free(b);
    for (int w = 0; w < 3 && s->side[w].wall.name; w++) {
        const bool in_ring = s->side[w].wall.distance_m < rule.ring_m;
        printf("# %s, wall %s at %.2f m: masked in %d of %d beams, free behind it in %d\n", s->name,
               s->side[w].wall.name, s->side[w].wall.distance_m, masked[w], beams[w], behind[w]);
        CHECK(in_ring || masked[w] == 0);
        CHECK(behind[w] * 50 <= (in_ring ? beams[w] : 0)); /* see micron_tank_wall_beside_the_head */
    }
}

TEST(box)
{
    learn_and_look(&scenes[0]);
}

TEST(tank)
{
    learn_and_look(&scenes[1]);
}

TEST(quay)
{
    learn_and_look(&scenes[2]);
}

TEST(sea_bed)
{
    learn_and_look(&scenes[3]);
}

TEST(open_water)
{
    learn_and_look(&scenes[4]);
}

int main(void)
{
    RUN(box);
    RUN_WITH(TANK, tank);
    RUN_WITH(QUAY, quay);
    RUN_WITH(SEABED, sea_bed);
    RUN_WITH(OPEN_WATER, open_water);
    return test_end();
}
