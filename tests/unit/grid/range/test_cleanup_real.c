/* SPDX-License-Identifier: MIT */
/*
 * test_cleanup_real - what each stage of the image clean-up buys on recordings of real sonars: docs/cleanup.md quotes
 * the lines that begin with #. The box ships with the tests; the others are looked for in ../shared/data.
 * SONARD_PICTURES=DIR writes the images before and after each chain there (PGM, rows are pings).
 */
#include "tests/lib/test.h"

#include "core/fault.h"
#include "grid/range/cleanup.h"

#define MAX_BINS  1300
#define MAX_PINGS 600

struct wall {
    double distance_m, normal_deg, half_width_deg;
};

struct scene {
    const char *name, *path;
    enum amplitude_law law;
    double db_per_count, pulse_m;
    uint32_t turn;      /* head units */
    double tolerance_m; /* of a wall's range */
    double far_m;       /* nothing is beyond; 0: not known */
    struct wall wall[3];
};

#define DATA "../shared/data/"

static const struct scene scenes[] = {
    {"box",
     "tests/replay/box.csv",
     AMPLITUDE_SQRT,
     0,
     0.012,
     400,
     0.05,
     0,
     {{0.261, 94.8, 75}, {0.294, 273.9, 72}, {1.460, 184.7, 10}}},
    {"tank",
     DATA "micron-tank-rosbag/static_sonar.csv",
     AMPLITUDE_LOG,
     80.0 / 255.0,
     0.05,
     6400,
     0.2,
     0,
     {{2.21, 264, 36}, {3.98, 175, 14}}},
    {"open water",
     DATA "ping360-openwater-pingviewer/20240814-102337673.60m-pings1000-1500.csv",
     AMPLITUDE_SQRT,
     0,
     0.24,
     400,
     0,
     30,
     {{0, 0, 0}}},
    {"sea bed",
     DATA "tritech-seanet-rov-seabed/sonar.part1.csv",
     AMPLITUDE_LOG,
     80.0 / 255.0,
     0.15,
     6400,
     0,
     41,
     {{0, 0, 0}}},
};

static const struct chain {
    const char *name;
    struct cleanup_conf conf;
    enum extract_order order;
} chains[] = {
    {"nothing", {.clip = 2}, EXTRACT_SAFE},
    {"otsu", {.otsu = true, .clip = 2}, EXTRACT_SAFE},
    {"3x3 otsu", {.median = 3, .otsu = true, .clip = 2}, EXTRACT_SAFE},
    {"classes", {.classes = true, .clip = 2}, EXTRACT_SAFE},
    {"3x3 classes", {.median = 3, .classes = true, .clip = 2}, EXTRACT_SAFE},
    {"5x5 classes", {.median = 5, .classes = true, .clip = 2}, EXTRACT_SAFE},
    {"3x3 clahe classes", {.median = 3, .clahe = true, .classes = true, .clip = 2}, EXTRACT_SAFE},
    {"all, 3x3", {.median = 3, .otsu = true, .clahe = true, .classes = true, .clip = 2}, EXTRACT_SAFE},
    {"paper: 3x3", {.median = 3, .clip = 2}, EXTRACT_PAPER},
    {"paper: all, 3x3",
     {.median = 3, .otsu = true, .clahe = true, .classes = true, .survivors = true, .clip = 2},
     EXTRACT_PAPER},
};
enum { SCENES = sizeof scenes / sizeof scenes[0], CHAINS = sizeof chains / sizeof chains[0] };

struct score {
    int pings, first, echoes, far_first;
    int beams[3], found[3], behind;
};

static double turned(double a_deg, double b_deg)
{
    return geo_deg(geo_wrap_pi(geo_rad(a_deg - b_deg)));
}

static void judge(const struct scene *s, double bearing_deg, const struct beam_echoes *found, struct score *score)
{
    score->pings++;
    score->first += found->n > 0;
    score->echoes += found->n;
    score->far_first += found->n > 0 && s->far_m > 0 && (double)found->echo[0].range_m > s->far_m;
    double nearest_m = INFINITY;
    int nearest = -1;
    for (int w = 0; w < 3 && s->wall[w].distance_m > 0; w++) {
        const double off_deg = turned(bearing_deg, s->wall[w].normal_deg);
        const double range_m = s->wall[w].distance_m / cos(geo_rad(off_deg));
        if (fabs(off_deg) <= s->wall[w].half_width_deg && range_m < nearest_m) {
            nearest_m = range_m;
            nearest = w;
        }
    }
    if (nearest < 0)
        return;
    bool hit = false;
    for (int k = 0; k < found->n; k++)
        hit |= fabs((double)found->echo[k].range_m - nearest_m) < s->tolerance_m;
    score->beams[nearest]++;
    score->found[nearest] += hit;
    score->behind += (double)found->free_to_m > nearest_m + s->tolerance_m;
}

/* ---- pictures ---- */

static FILE *picture(const char *scene, const char *chain, const char *what, uint32_t width)
{
    const char *folder = getenv("SONARD_PICTURES");
    char path[256];
    if (!folder)
        return NULL;
    snprintf(path, sizeof path, "%s/%s-%s-%s.pgm", folder, scene, chain, what);
    FILE *file = fopen(path, "wb");
    if (file)
        fprintf(file, "P5\n%u %u\n255\n", width, MAX_PINGS);
    return file;
}

static void picture_end(FILE *file, uint32_t width, int rows)
{
    for (long left = file ? (long)width * (MAX_PINGS - rows) : 0; left > 0; left--)
        fputc(0, file);
    if (file)
        fclose(file);
}

/* ---- a recording through one chain ---- */

static char line[1 << 16];
static uint8_t sample[MAX_BINS];

/* Next ping of a file `t,bearing,range_max,n,v...`. */
static bool read_ping(FILE *file, const struct scene *s, struct ping *ping, double *bearing_deg)
{
    do {
        if (!fgets(line, sizeof line, file))
            return false;
    } while (line[0] == '#');
    char *at = line;
    const double t_s = strtod(at, &at);
    *bearing_deg = strtod(at + 1, &at);
    const double range_m = strtod(at + 1, &at);
    ping->n_bins = (uint32_t)strtoul(at + 1, &at, 10);
    ping->dr_m = (float)(range_m / ping->n_bins);
    ping->n_bins = ping->n_bins < MAX_BINS ? ping->n_bins : MAX_BINS;
    for (uint32_t i = 0; i < ping->n_bins; i++)
        sample[i] = (uint8_t)strtoul(at + 1, &at, 10);
    ping->t_ns = (uint64_t)(fmod(t_s, 1e6) * 1e9);
    ping->head_turn = s->turn;
    ping->head_units = (uint32_t)(fmod(*bearing_deg + 360.0, 360.0) / 360.0 * s->turn + 0.5) % s->turn;
    ping->seq++;
    return true;
}

static _Alignas(64) unsigned char room[2][1 << 19];
static struct ping_beam axis;

static struct extract *extract_in(unsigned char *memory, enum extract_order order)
{
    struct extract_conf conf;
    struct fault fault = {""};
    extract_defaults(&conf);
    conf.order = order;
    struct extract *extract = extract_init(memory, &conf, MAX_BINS, &fault);
    CHECK(extract && extract_size(MAX_BINS) <= sizeof room[0]);
    return extract;
}

static struct ping ping_of(const struct scene *s)
{
    return (struct ping){.law = (uint8_t)s->law,
                         .sample_bytes = 1,
                         .n_beams = 1,
                         .db_per_count = (float)s->db_per_count,
                         .pulse_m = (float)s->pulse_m,
                         .pose = pose_identity,
                         .beam = &axis,
                         .samples = sample};
}

static struct score run(const struct scene *s, const struct chain *chain, FILE *file)
{
    static double bearing[MAX_PINGS + 3];
    struct score score = {0};
    struct fault fault = {""};
    struct extract *extract = extract_in(room[0], chain->order);
    void *memory = malloc(cleanup_size(&chain->conf, MAX_BINS));
    struct cleanup *c = cleanup_init(memory, &chain->conf, &mount_identity, MAX_BINS, &fault);
    struct beam_echoes found;
    struct ping ping = ping_of(s);
    CHECK(c != NULL);

    FILE *raw = NULL, *clean = NULL;
    uint32_t width = 0;
    while (ping.seq < MAX_PINGS && read_ping(file, s, &ping, &bearing[ping.seq])) {
        if (width == 0) {
            width = ping.n_bins;
            raw = picture(s->name, chain->name, "raw", width);
            clean = picture(s->name, chain->name, "clean", width);
        }
        struct extract_aid aid;
        cleanup_put(c, &ping, NULL, NULL, NULL);
        for (const struct ping *out; (out = cleanup_next(c, &aid));) {
            struct echoes e = {.max_beams = 1, .beam = &found};
            extract_run(extract, out, cleanup_wanted(&chain->conf) ? &aid : NULL, &e);
            judge(s, bearing[out->seq - 1], &found, &score);
            if (raw && clean && out->n_bins == width) {
                fwrite(out->samples, 1, width, raw);
                fwrite(aid.clean, 1, width, clean);
            }
        }
    }
    picture_end(raw, width, score.pings);
    picture_end(clean, width, score.pings);
    free(memory);
    return score;
}

static void run_scene(const struct scene *s)
{
    FILE *file = fopen(s->path, "r");
    if (!file) {
        printf("skip recording_%s: no %s\n", s->name, s->path);
        return;
    }
    for (int k = 0; k < CHAINS; k++) {
        rewind(file);
        const struct score r = run(s, &chains[k], file);
        printf("# %-10s %-18s pings %d, with an echo %d, echoes %d, first beyond %g m: %d, walls", s->name,
               chains[k].name, r.pings, r.first, r.echoes, s->far_m, r.far_first);
        for (int w = 0; w < 3 && s->wall[w].distance_m > 0; w++)
            printf(" %d/%d", r.found[w], r.beams[w]);
        printf(", free behind one %d\n", r.behind);
        if (chains[k].order == EXTRACT_SAFE)
            CHECK_INT(r.behind, 0);
    }
    fclose(file);
}

TEST(safe_chains_call_no_water_behind_a_wall_free)
{
    for (int i = 0; i < SCENES; i++)
        run_scene(&scenes[i]);
}

/* The first ping of a head is an image of its own: every ping of a recording as such a one, all stages on. */
static void run_alone(const struct scene *s)
{
    static const struct cleanup_conf all = {.median = 3, .otsu = true, .clahe = true, .classes = true, .clip = 2};
    FILE *file = fopen(s->path, "r");
    void *memory = malloc(cleanup_size(&all, MAX_BINS));
    struct extract *plain = extract_in(room[0], EXTRACT_SAFE), *cleaned = extract_in(room[1], EXTRACT_SAFE);
    struct ping ping = ping_of(s);
    double bearing_deg;
    struct fault fault = {""};
    int with = 0, lost = 0, freed = 0;
    while (file && ping.seq < MAX_PINGS && read_ping(file, s, &ping, &bearing_deg)) {
        struct cleanup *c = cleanup_init(memory, &all, &mount_identity, MAX_BINS, &fault);
        struct beam_echoes found[2];
        struct echoes e[2] = {{.max_beams = 1, .beam = &found[0]}, {.max_beams = 1, .beam = &found[1]}};
        struct ping unheard = ping;
        struct extract_aid aid;
        unheard.flags = PING_UNHEARD;
        cleanup_put(c, &ping, NULL, NULL, NULL);
        cleanup_put(c, &unheard, NULL, NULL, NULL); /* what waits comes out */
        extract_run(plain, &ping, NULL, &e[0]);
        extract_run(cleaned, cleanup_next(c, &aid), &aid, &e[1]);
        with += found[0].n > 0;
        lost += found[0].n > 0 && found[1].n == 0;
        freed += found[1].free_to_m > found[0].free_to_m;
    }
    if (file)
        printf(
            "# %s, every ping as the first of a head: of %d pings with an echo %d lose all, %d free more water\n",
            s->name, with, lost, freed);
    else
        printf("skip alone_%s: no %s\n", s->name, s->path);
    CHECK_INT(freed, 0);
    free(memory);
    if (file)
        fclose(file);
}

TEST(a_ping_cleaned_alone_frees_no_more_water)
{
    for (int i = 0; i < SCENES; i++)
        run_alone(&scenes[i]);
}

int main(void)
{
    RUN(a_ping_cleaned_alone_frees_no_more_water);
    RUN(safe_chains_call_no_water_behind_a_wall_free);
    return test_end();
}
