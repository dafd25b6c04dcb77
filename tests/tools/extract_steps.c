/* SPDX-License-Identifier: MIT */
/*
 * extract_steps - what each step of the range extraction makes of recordings: the tables of docs/extract.md, and its
 * picture.
 *   extract_steps tables                    of the recordings that are there
 *   extract_steps picture FILE.csv > X.ppm  as the sonar sent it, after each step of the clean-up, with what was found;
 *                                           extract_picture.py makes docs/pictures/extract-steps.png of it
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/range/cleanup.h"
#include "grid/range/extract.h"
#include "grid/range/marks.h"

#define MAX_BINS  2000
#define MAX_PINGS 4000
#define DATA      "../shared/data/"

static const struct recording {
    const char *name, *path;
    enum amplitude_law law;
    double pulse_m, aperture_deg, ping_s;
    uint32_t turn; /* units of the head */
} recordings[] = {
    {"box", "tests/replay/box.csv", AMPLITUDE_SQRT, 0.012, 2.0, 0.06, 400},
    {"Micron in a tank", DATA "micron-tank-rosbag/static_sonar.csv", AMPLITUDE_LOG, 0.05, 3.0, 0.045, 6400},
    {"Micron on the quay", DATA "micron-quay-rosbag/2014-07-18-20-59-31.csv", AMPLITUDE_LOG, 0.05, 3.0, 0.045,
     6400},
    {"Tritech on the sea bed", DATA "tritech-seanet-rov-seabed/sonar.part1.csv", AMPLITUDE_LOG, 0.15, 3.0, 0.078,
     6400},
    {"Ping360, open water, 60 m", DATA "ping360-openwater-pingviewer/20240814-102337673.60m-pings1000-1500.csv",
     AMPLITUDE_SQRT, 0.24, 2.0, 0.2, 400},
};

#define RECORDINGS (sizeof recordings / sizeof recordings[0])

struct step {
    const char *name;
    struct cleanup_conf cleanup;
    enum extract_order order;
    bool learn_ring_down;
};

static const struct step steps[] = {
    {"as it is", {.clip = 4.0}, EXTRACT_SAFE, false},
    {"learnt ring-down", {.clip = 4.0}, EXTRACT_SAFE, true},
    {"classes", {.clip = 4.0, .classes = true}, EXTRACT_SAFE, false},
    {"median 3", {.median = 3, .clip = 4.0}, EXTRACT_SAFE, false},
    {"median 5", {.median = 5, .clip = 4.0}, EXTRACT_SAFE, false},
    {"median 3, classes", {.median = 3, .clip = 4.0, .classes = true}, EXTRACT_SAFE, false},
    {"median 5, classes", {.median = 5, .clip = 4.0, .classes = true}, EXTRACT_SAFE, false},
    {"median 3, otsu", {.median = 3, .otsu = true, .clip = 4.0}, EXTRACT_SAFE, false},
    {"median 3, otsu, clahe", {.median = 3, .otsu = true, .clahe = true, .clip = 4.0}, EXTRACT_SAFE, false},
    {"all, safe", {.median = 3, .otsu = true, .clahe = true, .clip = 4.0, .classes = true}, EXTRACT_SAFE, false},
    {"all, paper", {.median = 3, .otsu = true, .clahe = true, .clip = 4.0, .classes = true}, EXTRACT_PAPER, false},
};

#define STEPS (sizeof steps / sizeof steps[0])

/* One ping that came out of the steps. */
struct shot {
    double bearing_deg, range_m;
    uint32_t n;
    struct beam_echoes found;
    uint8_t counts[MAX_BINS]; /* cleaned, the lowest class taken away; as sent where nothing is cleaned */
};

static struct shot shots[MAX_PINGS];
static int n_shots;

static void fail(const char *what)
{
    fprintf(stderr, "extract_steps: %s\n", what);
    exit(1);
}

static void *memory_of(size_t size)
{
    void *mem = calloc(1, size);
    if (!mem)
        fail("out of memory");
    return mem;
}

struct chain {
    struct extract *extract;
    struct cleanup *cleanup; /* NULL: none */
    struct marks marks;
};

static struct chain *make_chain(const struct step *step, enum extract_no_echo no_echo)
{
    const struct mount mount = {0};
    struct chain *c = memory_of(sizeof *c);
    struct extract_conf conf;
    struct fault fault = {""};
    extract_defaults(&conf);
    conf.order = step->order;
    conf.learn_ring_down = step->learn_ring_down;
    conf.no_echo = no_echo;
    c->extract = extract_init(memory_of(extract_size(MAX_BINS)), &conf, MAX_BINS, &fault);
    if (c->extract && cleanup_wanted(&step->cleanup))
        c->cleanup = cleanup_init(memory_of(cleanup_size(&step->cleanup, MAX_BINS)), &step->cleanup, &mount,
                                  MAX_BINS, &fault);
    if (!c->extract || (cleanup_wanted(&step->cleanup) && !c->cleanup))
        fail(fault.text);
    marks_init(&c->marks, 1500.0);
    return c;
}

static void free_chain(struct chain *c)
{
    free(c->extract);
    free(c->cleanup);
    free(c);
}

static void take(struct chain *c, const struct ping *ping, const struct extract_aid *aid)
{
    if (n_shots == MAX_PINGS)
        return;
    struct shot *shot = &shots[n_shots++];
    struct echoes out = {.max_beams = 1, .beam = &shot->found};
    const uint8_t *sent = ping->samples;

    extract_run(c->extract, ping, aid, &out);
    marks_run(&c->marks, &out);
    shot->bearing_deg = geo_deg((double)ping->beam[0].az_rad);
    shot->n = ping->n_bins;
    shot->range_m = (double)ping->dr_m * ping->n_bins;
    for (uint32_t i = 0; i < shot->n; i++)
        shot->counts[i] = !aid || !aid->clean ? sent[i] : aid->clean[i] > aid->lowest ? aid->clean[i] : 0;
}

/* Next line `t,bearing,range_max,n,v...`; false at the end. */
static bool read_ping(FILE *file, const struct recording *r, uint32_t number, struct ping *ping)
{
    static char line[1 << 16];
    do {
        if (!fgets(line, sizeof line, file))
            return false;
    } while (line[0] == '#' || line[0] == 't');
    char *at = line;
    uint8_t *counts = ping->samples;
    strtod(at, &at);
    const double bearing_deg = strtod(at + 1, &at), range_m = strtod(at + 1, &at);
    const unsigned long n = strtoul(at + 1, &at, 10);
    for (unsigned long i = 0; i < n && i < MAX_BINS; i++)
        counts[i] = (uint8_t)strtoul(at + 1, &at, 10);
    ping->n_bins = n < MAX_BINS ? (uint32_t)n : MAX_BINS;
    ping->dr_m = (float)(range_m / (double)(n ? n : 1));
    ping->t_ns = 1 + (uint64_t)(number * r->ping_s * 1e9);
    ping->beam[0].az_rad = (float)geo_wrap(geo_rad(bearing_deg));
    ping->head_units = (uint32_t)(geo_wrap(geo_rad(bearing_deg)) / (2.0 * GEO_PI) * r->turn + 0.5) % r->turn;
    return true;
}

/* Fill shots[n_shots]; false when the recording is not there. */
static bool run(const struct recording *r, const struct step *step, enum extract_no_echo no_echo)
{
    static uint8_t counts[MAX_BINS];
    struct ping_beam axis = {.az_rad = 0.0f};
    struct ping ping = {.kind = PING_PROFILE,
                        .law = (uint8_t)r->law,
                        .sample_bytes = 1,
                        .n_beams = 1,
                        .db_per_count = r->law == AMPLITUDE_LOG ? 80.0f / 255.0f : 0.0f,
                        .pulse_m = (float)r->pulse_m,
                        .az_aperture_rad = (float)geo_rad(r->aperture_deg),
                        .head_turn = r->turn,
                        .pose = {.attitude = {1.0}, .has = POSE_ATTITUDE | POSE_POSITION}, /* taken to stand */
                        .max_beams = 1,
                        .max_samples = MAX_BINS,
                        .beam = &axis,
                        .samples = counts};
    FILE *file = fopen(r->path, "r");
    n_shots = 0;
    if (!file)
        return false;
    struct chain *c = make_chain(step, no_echo);
    for (uint32_t k = 0; read_ping(file, r, k, &ping); k++) {
        struct extract_aid aid = {.lowest = -1};
        const bool taken = c->cleanup && cleanup_put(c->cleanup, &ping, NULL, NULL, NULL);
        for (const struct ping *next; c->cleanup && (next = cleanup_next(c->cleanup, &aid));)
            take(c, next, &aid);
        if (!taken)
            take(c, &ping, NULL);
    }
    fclose(file);
    free_chain(c);
    return true;
}

/* ---- tables ---- */

static void print_steps(const struct recording *r)
{
    for (size_t k = 0; k < STEPS; k++) {
        int first = 0, all = 0, silent = 0, claiming = 0;
        if (!run(r, &steps[k], EXTRACT_MINIMUM))
            return;
        for (int i = 0; i < n_shots; i++) {
            const struct beam_echoes *b = &shots[i].found;
            first += b->n > 0;
            all += b->n;
            silent += b->state == BEAM_SILENT;
            claiming += b->state == BEAM_SILENT && b->free_to_m > b->blind_m;
        }
        printf("| %s | %s | %d | %d / %d | %d of %d |\n", r->name, steps[k].name, n_shots, first, all, claiming,
               silent);
    }
}

/* Is the first echo there when the head next looks along its bearing? -1: it does not look again. */
static int is_there_again(int at)
{
    const double range_m = (double)shots[at].found.echo[0].range_m;
    for (int i = at + 20; i < n_shots; i++) {
        if (fabs(geo_wrap_pi(geo_rad(shots[i].bearing_deg - shots[at].bearing_deg))) > geo_rad(0.95))
            continue;
        for (int k = 0; k < shots[i].found.n; k++)
            if (fabs((double)shots[i].found.echo[k].range_m - range_m) < 0.1 + 0.03 * range_m)
                return 1;
        return 0;
    }
    return -1;
}

static void print_marks(const struct recording *r)
{
    int looked[2] = {0}, again[2] = {0}, ghosts = 0;
    if (!run(r, &steps[0], EXTRACT_MINIMUM))
        return;
    for (int i = 0; i < n_shots; i++) {
        const struct beam_echoes *b = &shots[i].found;
        const int there = b->n ? is_there_again(i) : -1;
        for (int k = 0; k < b->n; k++)
            ghosts += (b->echo[k].flags & ECHO_GHOST) != 0;
        if (there < 0)
            continue;
        looked[b->echo[0].flags & ECHO_BURST]++;
        again[b->echo[0].flags & ECHO_BURST] += there;
    }
    printf("| %s | %d of %d | %d of %d | %d |\n", r->name, again[0], looked[0], again[1], looked[1], ghosts);
}

/* Water that is called free under each rule for silence, metres per ping: of pings with an echo, of silent ones. */
static void print_claims(const struct recording *r)
{
    printf("| %s |", r->name);
    for (int rule = EXTRACT_MINIMUM; rule <= EXTRACT_RANGE; rule++) {
        double free_m[BEAM_BLIND + 1] = {0.0};
        int n[BEAM_BLIND + 1] = {0};
        if (!run(r, &steps[0], (enum extract_no_echo)rule))
            break;
        for (int i = 0; i < n_shots; i++) {
            const struct beam_echoes *b = &shots[i].found;
            free_m[b->state] += fmax((double)b->free_to_m - (double)b->blind_m, 0.0);
            n[b->state]++;
        }
        printf(" %.2f, %.2f |", free_m[BEAM_ECHO] / fmax(n[BEAM_ECHO], 1),
               free_m[BEAM_SILENT] / fmax(n[BEAM_SILENT], 1));
    }
    printf("\n");
}

static int tables(void)
{
    printf("| recording | steps | pings | first echoes / all kept | silent beams that claim free water "
           "|\n|---|---|---|---|---|\n");
    for (size_t k = 0; k < RECORDINGS; k++)
        print_steps(&recordings[k]);
    printf("\nFirst echoes that are there again when the head next looks\n\n| recording | not marked | marked "
           "burst | "
           "echoes marked ghost |\n|---|---|---|---|\n");
    for (size_t k = 0; k < RECORDINGS; k++)
        print_marks(&recordings[k]);
    printf("\nFree water in metres per ping: with an echo, silent\n\n| recording | minimum | heard | range |\n"
           "|---|---|---|---|\n");
    for (size_t k = 0; k < RECORDINGS; k++)
        print_claims(&recordings[k]);
    return 0;
}

/* ---- picture ---- */

#define PANEL  230
#define ACROSS 4
#define DOWN   2

static uint8_t picture[PANEL * DOWN][PANEL * ACROSS][3];

/* The head of the box looked astern: in the picture, as in the others, forward is up. */
#define HEAD_ASTERN_DEG 180.0

static void dot(int panel, double bearing_deg, double share, const uint8_t *colour)
{
    const double a = geo_rad(bearing_deg - HEAD_ASTERN_DEG), radius = share * (PANEL / 2.0 - 3.0);
    const int x = (int)(PANEL / 2.0 + radius * sin(a)), y = (int)(PANEL / 2.0 - radius * cos(a));
    for (int v = 0; v < 2; v++)
        for (int u = 0; u < 2; u++)
            if (x + u < PANEL && y + v < PANEL)
                memcpy(picture[panel / ACROSS * PANEL + y + v][panel % ACROSS * PANEL + x + u], colour, 3);
}

/* The ping nearest in bearing, at most 2 degrees away; NULL: none. */
static const struct shot *shot_at(double bearing_deg)
{
    const struct shot *best = NULL;
    double least = geo_rad(2.0);
    for (int i = 0; i < n_shots; i++) {
        const double off = fabs(geo_wrap_pi(geo_rad(shots[i].bearing_deg - bearing_deg)));
        if (off < least) {
            least = off;
            best = &shots[i];
        }
    }
    return best;
}

static void paint(int panel, bool with_echoes)
{
    static const uint8_t orange[] = {255, 140, 60};
    for (int y = 0; y < PANEL; y++)
        for (int x = 0; x < PANEL; x++) {
            const double u = x + 0.5 - PANEL / 2.0, v = PANEL / 2.0 - y - 0.5;
            const double share = hypot(u, v) / (PANEL / 2.0 - 3.0);
            const struct shot *shot = share < 1.0 ? shot_at(geo_deg(atan2(u, v)) + HEAD_ASTERN_DEG) : NULL;
            const uint8_t grey = shot ? shot->counts[(uint32_t)(share * shot->n)] : share < 1.0 ? 40 : 255;
            memset(picture[panel / ACROSS * PANEL + y][panel % ACROSS * PANEL + x], grey, 3);
        }
    for (int i = 0; with_echoes && i < n_shots; i++)
        for (int k = 0; k < shots[i].found.n; k++)
            dot(panel, shots[i].bearing_deg, (double)shots[i].found.echo[k].range_m / shots[i].range_m, orange);
}

static int draw(const char *path)
{
    static const int panels[ACROSS * DOWN] = {0, 3, 4, 7, 8, 5, 0, 9};
    struct recording r = recordings[0];
    for (size_t k = 0; k < RECORDINGS; k++)
        if (strcmp(recordings[k].path, path) == 0)
            r = recordings[k];
    r.path = path;
    for (int panel = 0; panel < ACROSS * DOWN; panel++) {
        if (!run(&r, &steps[panels[panel]], EXTRACT_MINIMUM))
            fail("no such file");
        paint(panel, panel >= 6);
    }
    printf("P6\n# rim at %g m\n%d %d\n255\n", shots[0].range_m, PANEL * ACROSS, PANEL * DOWN);
    return fwrite(picture, sizeof picture, 1, stdout) == 1 ? 0 : 1;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "tables") == 0)
        return tables();
    if (argc == 3 && strcmp(argv[1], "picture") == 0)
        return draw(argv[2]);
    fprintf(stderr, "usage: extract_steps tables | picture FILE.csv\n");
    return 2;
}
