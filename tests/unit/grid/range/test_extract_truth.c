/* SPDX-License-Identifier: MIT */
/*
 * test_extract_truth - how good the extractor is on made-up water whose truth is known: range error, walls missed,
 * echoes of nothing, deviation and confidence against what they promise. docs/extract.md quotes the lines with a #.
 */
#include "tests/lib/test.h"

#include "core/fault.h"
#include "grid/range/extract.h"
#include "tests/sound/sound.h"

#define BINS    1000
#define DR_M    0.01
#define PULSE_M 0.05
#define BEAMS   2000

static _Alignas(16) unsigned char memory[1 << 19];
static struct extract *extract;

/*
 * One beam: the pulse is a rectangle, so noise and reverberation are complex Gaussian and correlated over it. A wall
 * is a glint of fixed strength and a rough part behind it; a burst is other sound, as long as it likes. Levels are
 * decibels over the receiver's noise.
 */
struct water {
    double wall_m, wall_db; /* wall_m = 0: none */
    double reverb_db;       /* at 1 m; falls with the third power of range */
    double burst_m, burst_length_m, burst_db;
};

static double complex gauss(uint64_t *seed)
{
    const double r = sqrt(-log(1.0 - test_uniform(seed))), phase = 2.0 * GEO_PI * test_uniform(seed);
    return r * (cos(phase) + I * sin(phase));
}

/* Mean power that scatters from a bin. */
static double scatter(const struct water *w, double r_m)
{
    double power = sound_power(w->reverb_db) / fmax(r_m * r_m * r_m, 0.05);
    power += r_m < 0.25 ? sound_power(70.0 - 250.0 * r_m) : 0.0; /* the ring-down */
    if (w->wall_m > 0.0 && r_m >= w->wall_m)
        power += sound_power(w->wall_db - 6.0) * exp(-(r_m - w->wall_m) / 0.03);
    if (r_m >= w->burst_m && r_m < w->burst_m + w->burst_length_m)
        power += sound_power(w->burst_db);
    return power;
}

/* Counts proportional to the square root of pressure, the noise at 12. */
static void render(const struct water *w, uint64_t *seed, uint8_t *counts)
{
    enum { PULSE = (int)(PULSE_M / DR_M + 0.5), PAD = PULSE };
    double complex source[BINS + 2 * PAD];
    for (int i = 0; i < BINS + 2 * PAD; i++) {
        const double r_m = (i - PAD + 0.5) * DR_M;
        source[i] = gauss(seed) * sqrt((1.0 + scatter(w, fmax(r_m, 0.0))) / PULSE);
    }
    const double complex glint = gauss(seed);
    const double complex wall = sqrt(sound_power(w->wall_db)) * glint / cabs(glint);
    sound_pulse(source, BINS + 2 * PAD, PULSE);
    for (int i = 0; i < BINS; i++) {
        double complex p = source[i + PAD + PULSE - 1 - PULSE / 2];
        if (w->wall_m > 0.0 && fabs((i + 0.5) * DR_M - w->wall_m) < PULSE_M / 2.0)
            p += wall;
        counts[i] = sound_byte(sound_count(AMPLITUDE_SQRT, sound_intensity(p), 12.0, 0.0) + 0.5);
    }
}

static void set_up(const struct extract_conf *conf)
{
    struct fault fault;
    extract = extract_init(memory, conf, BINS, &fault);
    if (!extract || extract_size(BINS) > sizeof memory) {
        printf("extract_init: %s\n", fault.text);
        exit(1);
    }
}

/* late_m: what the device's ranges are too long. */
static struct beam_echoes hear_late(const struct water *w, double late_m, uint64_t *seed)
{
    static uint8_t counts[BINS];
    struct ping_beam axis = {.az_rad = 0.0f};
    struct beam_echoes found;
    const struct ping ping = {.kind = PING_PROFILE,
                              .law = AMPLITUDE_SQRT,
                              .sample_bytes = 1,
                              .n_beams = 1,
                              .n_bins = BINS,
                              .r0_m = (float)late_m,
                              .dr_m = (float)DR_M,
                              .pulse_m = (float)PULSE_M,
                              .beam = &axis,
                              .samples = counts};
    struct echoes out = {.max_beams = 1, .beam = &found};
    render(w, seed, counts);
    extract_run(extract, &ping, NULL, &out);
    return found;
}

static struct beam_echoes hear(const struct water *w, uint64_t *seed)
{
    return hear_late(w, 0.0, seed);
}

static int by_size(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static struct water wall_scene(uint64_t *seed)
{
    return (struct water){.wall_m = 0.6 + 9.0 * test_uniform(seed),
                          .wall_db = 18.0 + 25.0 * test_uniform(seed),
                          .reverb_db = 20.0 * test_uniform(seed)};
}

static struct water empty_scene(uint64_t *seed)
{
    return (struct water){.reverb_db = 20.0 * test_uniform(seed)};
}

/* An echo is the wall's when it lies within two pulses of it. */
#define SAME_M (2.0 * PULSE_M)

#define SAME_WATER 100 /* beams of one sensor in one water */

struct score {
    int walls, found, missed, false_near, false_empty;
    int references, behind; /* walls as strong as the reference at least; with free water behind them */
    double median_m, p95_m, worst_m, sd_normal;
};

static struct score score_of(const struct extract_conf *conf, uint64_t seed)
{
    static double error[BEAMS];
    struct score s = {.walls = BEAMS};
    double square = 0.0;
    const double least = free_water_detectable(AMPLITUDE_SQRT, 0.0, 0.0);
    struct water none = {0};
    for (int k = 0; k < BEAMS; k++) {
        if (k % SAME_WATER == 0) {
            set_up(conf);
            none = empty_scene(&seed);
            for (int n = 0; n < BASELINE_LEAST; n++)
                hear(&none, &seed);
        }
        struct water w = wall_scene(&seed);
        w.reverb_db = none.reverb_db;
        const struct beam_echoes b = hear(&w, &seed);
        const double off_m = b.n ? (double)b.echo[0].range_m - w.wall_m : INFINITY;
        const bool reference = 12.0 * pow(sound_power(w.wall_db), 0.25) > 255.0 * pow(least, 0.25);
        s.references += reference;
        s.behind += reference && (double)b.free_to_m > w.wall_m;
        if (fabs(off_m) < SAME_M) {
            error[s.found++] = fabs(off_m);
            square += off_m * off_m / ((double)b.echo[0].sd_m * (double)b.echo[0].sd_m);
        } else if (off_m < 0.0) {
            s.false_near++;
        } else {
            s.missed++;
        }
        s.false_empty += hear(&none, &seed).n > 0;
    }
    qsort(error, (size_t)s.found, sizeof error[0], by_size);
    s.median_m = error[s.found / 2];
    s.p95_m = error[s.found * 95 / 100];
    s.worst_m = error[s.found - 1];
    s.sd_normal = sqrt(square / s.found);
    return s;
}

TEST(every_detector_against_the_truth)
{
    static const char *const name[] = {"ca", "goca", "soca", "os"};
    const uint64_t seed = test_seed();
    for (int d = CFAR_CA; d <= CFAR_OS; d++) {
        struct extract_conf conf;
        extract_defaults(&conf);
        conf.detector = (enum cfar_detector)d;
        const struct score s = score_of(&conf, seed);
        printf("# %-5s found %d of %d, missed %d, nearer %d, in empty water %d of %d, free behind %d of %d; error "
               "median "
               "%.1f mm, 95 %% %.1f, worst %.1f; error / sd %.2f\n",
               name[d], s.found, s.walls, s.missed, s.false_near, s.false_empty, BEAMS, s.behind, s.references,
               1e3 * s.median_m, 1e3 * s.p95_m, 1e3 * s.worst_m, s.sd_normal);
        CHECK(s.found >= 0.92 * s.walls && s.false_near <= 0.03 * s.walls && s.false_empty <= 0.03 * s.walls);
        CHECK(s.behind <= (d == CFAR_SOCA ? 1 : 4)); /* the default, and those that miss more */
        CHECK(s.median_m < DR_M && s.worst_m < PULSE_M);
        CHECK(s.sd_normal > 0.1 && s.sd_normal < 1.0);
    }
}

/*
 * The deviation covers what is not known of a device: whether it counts from the middle of its transmission or from its
 * beginning, half a pulse longer. Half of the beams are of either kind.
 */
TEST(errors_are_as_large_as_the_deviation_says)
{
    uint64_t seed = test_seed();
    int found = 0, within[3] = {0};
    struct extract_conf conf;
    extract_defaults(&conf);
    set_up(&conf);
    for (int k = 0; k < 2 * BEAMS; k++) {
        const struct water w = wall_scene(&seed);
        const struct beam_echoes b = hear_late(&w, k % 2 ? PULSE_M / 2.0 : 0.0, &seed);
        const double off_m = b.n ? fabs((double)b.echo[0].range_m - w.wall_m) : INFINITY;
        if (off_m >= SAME_M)
            continue;
        found++;
        for (int i = 0; i < 3; i++)
            within[i] += off_m < (i + 1) * (double)b.echo[0].sd_m;
    }
    const double share = (double)within[1] / found;
    printf("# deviation: of %d walls %.1f %% within 1 sd, %.1f %% within 2 sd, %.1f %% within 3 sd\n", found,
           100.0 * within[0] / found, 100.0 * share, 100.0 * within[2] / found);
    CHECK(share > 0.9 && share < 0.999);
}

/* Confidence is a rank and no probability: the share of real echoes rises with it. */
TEST(more_confidence_more_real_echoes)
{
    enum { STEPS = 10 };
    int echoes[STEPS] = {0}, real[STEPS] = {0};
    uint64_t seed = test_seed();
    struct extract_conf conf;
    extract_defaults(&conf);
    set_up(&conf);
    for (int k = 0; k < 6 * BEAMS; k++) {
        struct water w = k % 2 ? wall_scene(&seed) : empty_scene(&seed);
        w.wall_db -= 10.0;
        if (k % 6 == 0) { /* one ping in six has a burst, as in the recording from the sea bed */
            w.burst_m = 0.5 + 9.0 * test_uniform(&seed);
            w.burst_length_m = 0.1 + 2.0 * test_uniform(&seed);
            w.burst_db = 10.0 + 10.0 * test_uniform(&seed);
        }
        const struct beam_echoes b = hear(&w, &seed);
        for (int i = 0; i < b.n; i++) {
            const int step = (int)fmin((double)b.echo[i].confidence * STEPS, STEPS - 1);
            echoes[step]++;
            real[step] += w.wall_m > 0.0 && fabs((double)b.echo[i].range_m - w.wall_m) < SAME_M;
        }
    }
    double before = 0.0;
    for (int i = 0; i < STEPS; i++) {
        if (echoes[i] == 0)
            continue;
        const double share = (double)real[i] / echoes[i];
        printf("# confidence %.1f to %.1f: %d echoes, %.2f real\n", (double)i / STEPS, (i + 1.0) / STEPS,
               echoes[i], share);
        CHECK(share > before - 0.05);
        before = share;
    }
    CHECK(echoes[0] == 0 && echoes[4] == 0 && before > 0.9);
}

int main(void)
{
    RUN(every_detector_against_the_truth);
    RUN(errors_are_as_large_as_the_deviation_says);
    RUN(more_confidence_more_real_echoes);
    return test_end();
}
