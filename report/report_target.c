/* SPDX-License-Identifier: MIT */
/*
 * report_target - what free water is free of: the keys `target` and `bottom` over the strengths that they may have,
 * each by itself. Free water that is said against free water that is false: behind bottoms and walls of a made-up sea,
 * in drawn waters, and on recordings, where only what is said is known. And what the rules for silence claim behind
 * walls and mud as faint as may be, beside a fixed threshold.
 *
 *   report_target seas [quick]           CSV by beam: both heads, eight seeds
 *   report_target classes [quick]        CSV by method, kind of target, how faint it is, and seed: eight seeds
 *   report_target waters [FIRST [LAST]]  CSV by beam: of seeds FIRST to LAST (1 to 8; quick: 1)
 *   report_target recordings             CSV: metres per ping
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/wiring.h"
#include "lib/drawn_sound.h"
#include "lib/knob.h"
#include "lib/recordings.h"
#include "lib/rivals.h"
#include "lib/shipped.h"
#include "lib/verdict.h"
#include "tests/sound/sea.h"

#define SEEDS   8
#define WORLDS  36
#define PAST_M  0.25 /* free water so far behind a surface would be driven into */
#define PING_NS UINT64_C(50000000)
#define DATA    "../shared/data/"

/* `target` without the rule for bottoms, which would hide what it does. */
#define TARGET(db)                                                                                                \
    {                                                                                                             \
        .name = "target", .section = "extract", .value = #db " dB", .more = "[extract]\nbottom = off\n",          \
        .number = (db)                                                                                            \
    }
#define BOTTOM(db)                                                                                                \
    {                                                                                                             \
        .name = "bottom", .section = "extract", .value = #db " dB", .number = (db)                                \
    }

static const struct knob settings[] = {
    TARGET(0),  TARGET(6),  TARGET(12), TARGET(15), TARGET(20), TARGET(25),
    TARGET(30), BOTTOM(12), BOTTOM(15), BOTTOM(20), BOTTOM(25), BOTTOM(30),
};
#define SETTINGS (sizeof settings / sizeof settings[0])

static void print_setting(const struct knob *s)
{
    knob_print(s);
    printf(",%g", s->number);
}

/* ---- the made-up sea ---- */

/* As the scene of that name, with another surface. */
static const struct {
    const char *name, *as, *shapes;
    double fainter_db;
} variants[] = {
    {"soft bottom", "soft bottom", NULL, 0},   {"6 dB softer", "soft bottom", NULL, 6},
    {"12 dB softer", "soft bottom", NULL, 12}, {"level bottom", "soft bottom", "slope 1.5 0 -90", 0},
    {"weak wall", "weak wall", NULL, 0},
};
#define VARIANTS (sizeof variants / sizeof variants[0])

static struct sea_scene scene_like(const char *name)
{
    const struct sea_scene *as = sea_scenes;
    while (strcmp(as->name, name) != 0)
        as++;
    return *as;
}

static struct sea_scene scene_of(size_t v)
{
    struct sea_scene scene = scene_like(variants[v].as);
    scene.name = variants[v].name;
    scene.shapes = variants[v].shapes ? variants[v].shapes : scene.shapes;
    scene.surface_db -= variants[v].fainter_db;
    return scene;
}

struct tally {
    unsigned surfaces, past;
    double past_max_m, water_m, said_m;
};

static void add_beam(struct tally *t, const struct sea_ping *sea, const struct beam_echoes *found)
{
    const double free_m = found->free_to_m > found->blind_m ? (double)found->free_to_m : 0.0;
    const double end_m = fmin(sea->met.nearest_m, (double)sea->ping.dr_m * sea->ping.n_bins);
    t->water_m += end_m;
    t->said_m += fmax(0.0, fmin(free_m, end_m) - (double)found->blind_m);
    if (!isfinite(sea->met.nearest_m))
        return;
    t->surfaces++;
    t->past += free_m > sea->met.nearest_m + PAST_M;
    t->past_max_m = fmax(t->past_max_m, free_m - sea->met.nearest_m);
}

/* Another scan comes first, so that what is usual is known. */
#define FIRST_SCAN 500

/* By all settings at once: to make a beam takes longer than to judge it. */
static void listen_to(const struct sea_scene *scene, struct shipped **shipped, unsigned seeds, struct tally *t)
{
    static struct sea_ping sea;
    for (unsigned n = 0; n < seeds * SOUND_HEADS * 2 * SEA_BEAMS; n++) {
        const unsigned beam = n % (2 * SEA_BEAMS), head = n / (2 * SEA_BEAMS) % SOUND_HEADS,
                       seed = 1 + n / (2 * SEA_BEAMS * SOUND_HEADS);
        sea_listen(scene, (enum sound_head)head, beam < SEA_BEAMS ? FIRST_SCAN : seed, beam % SEA_BEAMS, &sea);
        sea.ping.t_ns = beam * PING_NS;
        for (size_t i = 0; i < SETTINGS; i++) {
            struct beam_echoes found;
            struct echoes echoes = {.max_beams = 1, .beam = &found};
            if (beam == 0)
                shipped_begin(shipped[i]);
            shipped_run(shipped[i], &sea.ping, &echoes);
            if (beam >= SEA_BEAMS)
                add_beam(&t[i], &sea, &found);
        }
    }
}

static struct shipped *shipped_of(const struct knob *knob, uint32_t max_bins)
{
    struct extract_conf extract;
    struct conf conf;
    knob_conf(knob, &conf);
    wiring_extract(&conf, 0, &extract);
    struct shipped *shipped = shipped_make_as(&extract, max_bins);
    shipped_begin(shipped);
    return shipped;
}

static void make_all(struct shipped **shipped, uint32_t max_bins)
{
    for (size_t i = 0; i < SETTINGS; i++)
        shipped[i] = shipped_of(&settings[i], max_bins);
}

static void free_all(struct shipped **shipped)
{
    for (size_t i = 0; i < SETTINGS; i++)
        shipped_free(shipped[i]);
}

static double past_percent(const struct tally *t)
{
    return 100.0 * t->past / fmax(t->surfaces, 1);
}

static void seas(unsigned seeds)
{
    static struct tally one[VARIANTS][SETTINGS], all[SETTINGS];
    struct shipped *shipped[SETTINGS];
    make_all(shipped, SEA_MAX_BINS);
    for (size_t v = 0; v < VARIANTS; v++) {
        const struct sea_scene scene = scene_of(v);
        listen_to(&scene, shipped, seeds, one[v]);
    }
    for (unsigned k = 0; k < sea_scenes_n; k++)
        listen_to(&sea_scenes[k], shipped, seeds, all);
    free_all(shipped);
    printf(KNOB_COLUMNS ",below_wall_db,soft_bottom,past_max_m,softer_6db,softer_12db,level_bottom,weak_wall,all,"
                        "said");
    for (size_t i = 0; i < SETTINGS; i++) {
        printf("\n");
        print_setting(&settings[i]);
        printf(",%.3g,%.3g", past_percent(&one[0][i]), one[0][i].past_max_m);
        for (size_t v = 1; v < VARIANTS; v++)
            printf(",%.3g", past_percent(&one[v][i]));
        printf(",%.3g,%.3g", past_percent(&all[i]), 100.0 * all[i].said_m / all[i].water_m);
    }
    printf("\n");
}

/* ---- classes of targets ---- */

#define STEP_DB  3
#define STEPS    11
#define COUNTS   60.0 /* of the fixed threshold, and from where it looks: what a user writes in five minutes */
#define COUNTS_M 0.9

enum method { HEARD, MINIMUM, THRESHOLD_FAR, THRESHOLD_NEAR, METHODS };

static const struct knob methods[METHODS] = {
    [HEARD] = {.name = "method", .label = "heard, as shipped"},
    [MINIMUM] = {.name = "method", .label = "minimum", .more = "[extract]\nno_echo = minimum\n"},
    [THRESHOLD_FAR] = {.name = "method",
                       .label = "fixed threshold",
                       .beside = "first sample over 60 counts, else free to the range"},
    [THRESHOLD_NEAR] = {.name = "method",
                        .label = "fixed threshold, silence unknown",
                        .beside = "first sample over 60 counts, else free to minimum_range"},
};

static const struct {
    const char *name, *as;
} classes[] = {{"wall", "wall far"}, {"mud", "soft bottom"}};
#define CLASSES (sizeof classes / sizeof classes[0])

static void judge_beam(enum method m, struct shipped **shipped, const struct sea_ping *sea, struct tally *t)
{
    struct beam_echoes found;
    struct echoes echoes = {.max_beams = 1, .beam = &found};
    if (m == HEARD || m == MINIMUM) {
        shipped_run(shipped[m], &sea->ping, &echoes);
    } else {
        rivals_threshold(&sea->ping, 0, COUNTS, COUNTS_M, &found);
        if (m == THRESHOLD_NEAR && found.n == 0)
            found.free_to_m = (float)COUNTS_M;
    }
    if (t)
        add_beam(t, sea, &found);
}

/* A scan by each head; another one comes first, so that what is usual is known. */
static void listen_to_class(const struct sea_scene *scene, struct shipped **shipped, unsigned seed,
                            struct tally t[METHODS])
{
    static struct sea_ping sea;
    for (unsigned n = 0; n < SOUND_HEADS * 2 * SEA_BEAMS; n++) {
        const unsigned beam = n % (2 * SEA_BEAMS), head = n / (2 * SEA_BEAMS);
        sea_listen(scene, (enum sound_head)head, beam < SEA_BEAMS ? FIRST_SCAN : seed, beam % SEA_BEAMS, &sea);
        sea.ping.t_ns = beam * PING_NS;
        for (int m = HEARD; m <= MINIMUM && beam == 0; m++)
            shipped_begin(shipped[m]);
        for (int m = 0; m < METHODS; m++)
            judge_beam((enum method)m, shipped, &sea, beam >= SEA_BEAMS ? &t[m] : NULL);
    }
}

static void print_class(enum method m, const char *class, double below_db, unsigned seed, const struct tally *t)
{
    knob_print(&methods[m]);
    printf(",%s,%g,%u,%u,%u,%.6g,%.4g,%.6g\n", class, below_db, seed, t->surfaces, t->past,
           t->past / fmax(t->surfaces, 1), t->past_max_m, t->said_m / t->water_m);
}

static void run_classes(unsigned seeds, unsigned steps)
{
    struct shipped *shipped[METHODS] = {NULL};
    knob_check(methods, METHODS);
    for (int m = HEARD; m <= MINIMUM; m++)
        shipped[m] = shipped_of(&methods[m], SEA_MAX_BINS);
    printf(KNOB_COLUMNS ",target,below_wall_db,seed,beams,past,past_share,past_max_m,said_share\n");
    for (size_t c = 0; c < CLASSES; c++)
        for (unsigned step = 0; step < STEPS; step += STEPS / steps)
            for (unsigned seed = 1; seed <= seeds; seed++) {
                const double below_db = step * STEP_DB;
                struct tally t[METHODS] = {0};
                struct sea_scene scene = scene_like(classes[c].as);
                scene.surface_db -= below_db;
                listen_to_class(&scene, shipped, seed, t);
                for (int m = 0; m < METHODS; m++)
                    print_class((enum method)m, classes[c].name, below_db, seed, &t[m]);
            }
    for (int m = HEARD; m <= MINIMUM; m++)
        shipped_free(shipped[m]);
}

/* ---- drawn waters ---- */

static void judge_world(struct shipped **shipped, uint64_t seed, unsigned number, struct verdict *verdict)
{
    static struct drawn_sound sound;
    static struct beam_echoes found[DRAWN_MAX_BEAMS];
    static struct verdict_sectors sectors[SETTINGS];
    memset(sectors, 0, sizeof sectors);
    for (size_t i = 0; i < SETTINGS; i++)
        shipped_begin(shipped[i]);
    drawn_sound_begin(&sound, seed, number);
    while (drawn_sound_next(&sound))
        for (size_t i = 0; i < SETTINGS; i++) {
            struct echoes echoes = {.max_beams = sound.ping.n_beams, .beam = found};
            shipped_run(shipped[i], &sound.ping, &echoes);
            for (unsigned b = 0; b < sound.ping.n_beams; b++)
                verdict_beam(&verdict[i], &sectors[i], &sound, b, &found[b]);
        }
}

static const char *const shown[] = {"free",     "free_moving", "past",   "past_pile",
                                    "past_net", "past_plane",  "nothing"};
#define SHOWN (sizeof shown / sizeof shown[0])

static void waters(uint64_t first, uint64_t last)
{
    static struct verdict verdict[SETTINGS];
    struct shipped *shipped[SETTINGS];
    make_all(shipped, DRAWN_MAX_BINS);
    for (uint64_t seed = first; seed <= last; seed++)
        for (unsigned n = 0; n < WORLDS; n++)
            judge_world(shipped, seed, n, verdict);
    printf(KNOB_COLUMNS ",below_wall_db");
    for (size_t m = 0; m < SHOWN; m++)
        printf(",%s", shown[m]);
    for (size_t i = 0; i < SETTINGS; i++) {
        printf("\n");
        print_setting(&settings[i]);
        for (size_t m = 0; m < SHOWN; m++)
            for (unsigned k = 0; k < verdict_measures_n; k++)
                if (strcmp(verdict_measures[k].key, shown[m]) == 0)
                    printf(",%.3g", verdict_measures[k].scale *
                                        verdict_measures[k].of(&verdict[i], verdict_measures[k].what));
    }
    printf("\n");
    free_all(shipped);
}

/* ---- recordings ---- */

/* What is said of a recording, by setting. */
struct heard {
    struct shipped *shipped[SETTINGS];
    double said_m[SETTINGS];
    unsigned pings;
};

static void hear(void *ctx, const struct ping *ping, double bearing_deg)
{
    struct heard *h = ctx;
    (void)bearing_deg;
    h->pings++;
    for (size_t i = 0; i < SETTINGS; i++) {
        struct beam_echoes found;
        struct echoes echoes = {.max_beams = 1, .beam = &found};
        shipped_run(h->shipped[i], ping, &echoes);
        h->said_m[i] += fmax(0.0, (double)(found.free_to_m - found.blind_m));
    }
}

static void recordings(void)
{
    static const struct {
        const char *name, *path;
        const struct recordings_head *head; /* NULL: a log of Ping-Viewer */
    } of[] = {
        {"box", "tests/replay/box.csv", &recordings_ping360_2m},
        {"tank", DATA "micron-tank-rosbag/static_sonar.csv", &recordings_micron},
        {"quay", DATA "micron-quay-rosbag/2014-07-18-20-59-31.csv", &recordings_micron},
        {"sea_bed", DATA "tritech-seanet-rov-seabed/sonar.part1.csv", &recordings_tritech_50m},
        {"ping360_60m", DATA "ping360-openwater-pingviewer/20240814-102337673.bin", NULL},
    };
    enum { N = sizeof of / sizeof of[0] };
    static struct heard h[N];
    bool here[N];

    printf(KNOB_COLUMNS ",below_wall_db");
    for (size_t k = 0; k < N; k++) {
        make_all(h[k].shipped, RECORDINGS_MAX_BINS);
        here[k] = of[k].head ? recordings_text(of[k].path, of[k].head, hear, &h[k])
                             : recordings_ping_viewer(of[k].path, hear, &h[k]);
        free_all(h[k].shipped);
        printf(",%s", of[k].name);
    }
    for (size_t i = 0; i < SETTINGS; i++) {
        printf("\n");
        print_setting(&settings[i]);
        for (size_t k = 0; k < N; k++)
            if (here[k])
                printf(",%.3g", h[k].said_m[i] / h[k].pings);
            else
                printf(",not here");
    }
    printf("\n");
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0, given = argc > 2 && argv[2][0] <= '9';
    const uint64_t first = given ? strtoull(argv[2], NULL, 10) : 1, usual = given ? first : quick ? 1 : SEEDS;
    knob_check(settings, SETTINGS);
    if (strcmp(what, "seas") == 0)
        seas(quick ? 1 : SEEDS);
    else if (strcmp(what, "waters") == 0)
        waters(first, given && argc > 3 ? strtoull(argv[3], NULL, 10) : usual);
    else if (strcmp(what, "classes") == 0)
        run_classes(quick ? 1 : SEEDS, quick ? 3 : STEPS);
    else if (strcmp(what, "recordings") == 0)
        recordings();
    else {
        fprintf(stderr, "usage: report_target seas|classes|waters|recordings [FIRST [LAST] | quick]\n");
        return 2;
    }
    return 0;
}
