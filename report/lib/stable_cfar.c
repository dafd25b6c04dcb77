/* SPDX-License-Identifier: MIT */
/* stable_cfar - cases C: detectors at the ends of their numbers. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/range/cfar.h"
#include "grid/range/u128.h"
#include "grid/range/extract.h"
#include "tests/sound/sound.h"
#include "stable.h"

#define CELLS 2048
#define SIDE  8
#define GUARD 2

static uint64_t work[3 * (CELLS + 1)];
static uint64_t x[CELLS];
static uint8_t mask[CELLS];

static struct cfar plain(int detector, double alpha)
{
    const uint64_t q16 = (uint64_t)(alpha * 65536);
    return (struct cfar){.detector = (enum cfar_detector)detector,
                         .n_side = SIDE,
                         .guard = GUARD,
                         .rank = 12,
                         .alpha_q16 = q16,
                         .alpha_one_q16 = q16};
}

static unsigned run(const struct cfar *cfar, uint32_t n)
{
    unsigned hits = 0;
    cfar_run(cfar, &(struct cfar_profile){.x = x, .n = n, .work = work}, mask);
    for (uint32_t i = 0; i < n; i++)
        hits += mask[i];
    return hits;
}

/* As a first version has it: x >= alpha * mean of what there is. */
static unsigned naive_hits(double alpha, uint32_t n)
{
    unsigned hits = 0;
    for (int64_t i = 0; i < (int64_t)n; i++) {
        double sum = 0, cells = 0;
        for (int64_t k = i - GUARD - SIDE; k <= i + GUARD + SIDE; k++)
            if (k >= 0 && k < (int64_t)n && llabs(k - i) > GUARD) {
                sum += (double)x[k];
                cells++;
            }
        hits += (double)x[i] >= alpha * sum / cells;
    }
    return hits;
}

static void fill(uint64_t value, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++)
        x[i] = value;
}

static void zeros(bool quick, struct stable_found *f)
{
    (void)quick;
    fill(0, 100);
    f->naive = naive_hits(3, 100);
    f->ours = 0;
    for (int d = CFAR_CA; d <= CFAR_OS; d++) {
        const struct cfar cfar = plain(d, 3);
        f->ours += run(&cfar, 100);
    }
}

/* Ends of free water and echoes that a saturated beam claims, through the whole extraction. */
static double claims_of_saturated(void)
{
    struct extract_conf conf;
    struct ping_beam axis = {0};
    struct beam_echoes found;
    uint8_t counts[500];
    struct fault fault;
    memset(counts, 255, sizeof counts);
    extract_defaults(&conf);
    void *memory = stable_memory(extract_size(500));
    struct extract *extract = extract_init(memory, &conf, 500, &fault);
    const struct ping ping = {.kind = PING_PROFILE,
                              .sample_bytes = 1,
                              .n_beams = 1,
                              .n_bins = 500,
                              .dr_m = 0.02f,
                              .pulse_m = 0.04f,
                              .beam = &axis,
                              .samples = counts};
    struct echoes out = {.max_beams = 1, .beam = &found};
    extract_run(extract, &ping, NULL, &out);
    free(memory);
    return (found.state == BEAM_SILENT) + (found.free_to_m > found.blind_m);
}

static void saturated(bool quick, struct stable_found *f)
{
    (void)quick;
    fill(65025, 100);
    f->naive = naive_hits(1, 100);
    f->ours = claims_of_saturated();
    for (int d = CFAR_CA; d <= CFAR_OS; d++) {
        const struct cfar cfar = plain(d, 1);
        f->ours += run(&cfar, 100);
    }
}

static void single_count(bool quick, struct stable_found *f)
{
    (void)quick;
    struct cfar cfar = plain(CFAR_SOCA, 3);
    fill(0, 100);
    x[50] = 1;
    f->naive = naive_hits(3, 100);
    f->ours = run(&cfar, 100) != 1;
    cfar.x_min = 2;
    f->ours += run(&cfar, 100);
}

/* The mask rule as it is written down, for CA. */
static bool by_hand(const struct cfar *c, int64_t n, int64_t i)
{
    uint64_t sum = 0; /* of cells that fill to CFAR_MAX_SUM at most */
    uint64_t cells = 0;
    for (int64_t k = 0; k < n; k++)
        if (llabs(k - i) > c->guard && llabs(k - i) <= (int64_t)c->guard + c->n_side) {
            sum += x[k];
            cells++;
        }
    return cells && u128_less(u128_product(c->alpha_q16, sum), u128_product(x[i], cells * 65536));
}

/* Cells that differ from the rule, and bytes written beyond the mask. */
static double off_by_hand(const struct cfar *cfar, uint32_t n)
{
    double off = 0;
    memset(mask, 0xff, sizeof mask);
    cfar_run(cfar, &(struct cfar_profile){.x = x, .n = n, .work = work}, mask);
    for (uint32_t i = 0; i < n; i++)
        off += mask[i] != by_hand(cfar, n, i);
    for (uint32_t i = n; i < CELLS; i++)
        off += mask[i] != 0xff;
    return off;
}

static void short_beams(uint32_t side, struct stable_found *f)
{
    static const uint32_t length[] = {0, 1, 2, 2 * GUARD + 1, 2 * GUARD + 2, 2 * (SIDE + GUARD) + 1, 300};
    struct cfar cfar = plain(CFAR_CA, 3);
    cfar.n_side = side;
    f->naive = f->ours = 0;
    for (size_t k = 0; k < sizeof length / sizeof length[0]; k++) {
        const int64_t n = length[k];
        for (int64_t i = 0; i < n; i++) {
            x[i] = (uint64_t)(i * 37 % 50 + (i % 41 == 20) * 1000);
            for (int64_t d = GUARD + 1; d <= GUARD + (int64_t)side; d++)
                f->naive += (double)((i - d < 0) + (i + d >= n)); /* reads outside of a loop without ends */
        }
        f->ours += off_by_hand(&cfar, length[k]);
    }
}

static void lengths(bool quick, struct stable_found *f)
{
    (void)quick;
    short_beams(SIDE, f);
}

static void long_windows(bool quick, struct stable_found *f)
{
    (void)quick;
    short_beams(500, f);
}

/* One cell on each side: closed forms of alpha. */
static long double one_cell_alpha(int detector, long double pfa)
{
    switch (detector) {
    case CFAR_CA:
        return 2 * expm1l(-logl(pfa) / 2);
    case CFAR_GOCA:
        return (sqrtl(1 + 8 / pfa) - 3) / 2;
    case CFAR_SOCA:
        return 2 * (1 / pfa - 1);
    default: /* the smaller one of two */
        return 2 * (1 / pfa - 1);
    }
}

/* In units in the last place of the alpha, 1e-300 included; naive: GOCA's textbook difference, in the same. */
static void tiny_rates(bool quick, struct stable_found *f)
{
    static const double rate[] = {0.5, 1e-3, 1e-6, 1e-12, 1e-30, 1e-100, 1e-300};
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t k = 0; k < sizeof rate / sizeof rate[0]; k++)
        for (int d = CFAR_CA; d <= CFAR_OS; d++) {
            const long double want = one_cell_alpha(d, rate[k]);
            const double a = (double)want, p = 2 / (1 + a) - 2 / (2 + a);
            double alpha = NAN;
            if (!cfar_alpha((enum cfar_detector)d, 1, 1, 1, rate[k], &alpha))
                alpha = NAN;
            f->ours = stable_worse(f->ours, (double)(fabsl(alpha / want - 1) / 0x1p-52L));
            if (d == CFAR_GOCA)
                f->naive = stable_worse(f->naive, fabs(p / rate[k] - 1) / 0x1p-52);
        }
}

static void wrong_arguments(bool quick, struct stable_found *f)
{
    static const struct {
        uint32_t n, k;
        double pfa;
    } row[] = {{8, 12, 0}, {8, 12, 1}, {8, 12, -1}, {8, 12, NAN}, {0, 0, 0.1}, {8, 0, 0.1}, {8, 17, 0.1}};

    (void)quick;
    f->ours = 0;
    f->derived = true;
    f->naive = sizeof row / sizeof row[0]; /* a formula is never without a result */
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        double alpha;
        f->ours += cfar_alpha(CFAR_OS, row[i].n, row[i].n, row[i].k, row[i].pfa, &alpha);
    }
}

/* A running sum in single precision, as a filter on a small processor has it. */
static double wrong_float_sums(uint32_t n)
{
    double wrong = 0;
    float sum = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint64_t want = 0;
        sum += (float)x[i];
        if (i >= SIDE)
            sum -= (float)x[i - SIDE];
        for (uint32_t k = i + 1 > SIDE ? i + 1 - SIDE : 0; k <= i; k++)
            want += x[k];
        wrong += sum != (float)want;
    }
    return wrong;
}

static void after_a_loud_cell(bool quick, struct stable_found *f)
{
    const uint32_t n = 1000;
    const struct cfar cfar = plain(CFAR_CA, 3);
    (void)quick;
    for (uint32_t i = 0; i < n; i++)
        x[i] = i == 20 ? 100000000 : i % 2 + 1;
    f->naive = wrong_float_sums(n);
    f->ours = off_by_hand(&cfar, n);
    const struct cfar_profile p = {.x = x, .n = n, .work = work};
    cfar_run(&cfar, &p, mask);
    for (uint32_t i = 40; i < n - SIDE - GUARD; i++)
        f->ours += cfar_reference_at(&cfar, &p, i).sum != 3 * SIDE;
}

static void random_cells(bool quick, struct stable_found *f)
{
    struct dice dice = dice_of(9, 0);
    const struct cfar cfar = plain(CFAR_CA, 3);
    f->naive = f->ours = 0;
    for (unsigned cells = 0; cells < (quick ? 50000u : 1000000u); cells += 1000) {
        for (unsigned i = 0; i < 1000; i++)
            x[i] = amplitude_from_db(80 * dice_uniform(&dice));
        f->naive += wrong_float_sums(1000);
        f->ours += off_by_hand(&cfar, 1000);
    }
}

static void constants(bool quick, struct stable_found *f)
{
    (void)quick;
    f->naive = f->ours = 0;
    for (uint64_t c = 1; c < 256; c++)
        for (int d = CFAR_CA; d <= CFAR_OS; d++) {
            const struct cfar above = plain(d, 1), below = plain(d, 0.99);
            fill(c, 100);
            f->naive += d == CFAR_CA ? naive_hits(1, 100) : 0;
            f->ours += run(&above, 100) + (100 - run(&below, 100));
        }
}

/* Speckle in decibels over a mean that rises, behind the ring-down of a receiver that hears, taken as proportional to
 * pressure: is that told? */
static void wrong_law(bool quick, struct stable_found *f)
{
    struct extract_conf conf;
    struct ping_beam axis = {0};
    struct beam_echoes found;
    struct dice dice = dice_of(11, 0);
    uint8_t counts[400];
    struct fault fault;
    (void)quick;
    extract_defaults(&conf);
    void *memory = stable_memory(extract_size(400));
    struct extract *extract = extract_init(memory, &conf, 400, &fault);
    for (int k = 0; k < 400; k++) {
        for (int i = 0; i < 400; i++) {
            const double power = sound_texture(&dice, 4), mean = 10 + 90.0 * k / 400;
            counts[i] = i < 16 ? 255 : sound_byte(sound_count(AMPLITUDE_LOG, power, mean, SOUND_MICRON_DB) + 0.5);
        }
        const struct ping ping = {.kind = PING_PROFILE,
                                  .law = AMPLITUDE_LINEAR,
                                  .sample_bytes = 1,
                                  .n_beams = 1,
                                  .n_bins = 400,
                                  .dr_m = 0.0125f,
                                  .pulse_m = 0.0125f,
                                  .beam = &axis,
                                  .samples = counts};
        struct echoes out = {.max_beams = 1, .beam = &found};
        extract_run(extract, &ping, NULL, &out);
    }
    f->derived = true;
    f->naive = 1; /* a detector alone is silent: it finds nothing and says nothing */
    f->ours = extract_law_doubt(extract) == LAW_FITS;
    free(memory);
}

static void integer_limit(bool quick, struct stable_found *f)
{
    const struct cfar cfar = plain(CFAR_CA, 16777216.0); /* alpha_q16 is 2^40, a sum 2^45 */
    (void)quick;
    fill((uint64_t)1 << 41, 40);
    x[20] = (uint64_t)1 << 50;
    f->naive = f->ours = 0;
    for (uint32_t i = 0; i < 40; i++) {
        const uint64_t sum = (uint64_t)1 << 45;
        f->naive += x[i] * 65536 * 16 > cfar.alpha_q16 * sum; /* both wrap */
    }
    f->ours = run(&cfar, 40);
    fill((uint64_t)1 << 18, 40);
    x[20] = ((uint64_t)1 << 42) + 1; /* one more than the threshold */
    f->ours += run(&cfar, 40) != 1;
}

const struct stable_case stable_cfar[] = {
    {"C1", "a beam of zeros, every detector", "cells detected", "x >= alpha * mean", 0, zeros},
    {"C2", "a saturated beam, every detector and the whole extraction", "cells detected, water claimed",
     "x >= alpha * mean", 0, saturated},
    {"C3", "one count over zeros, with a floor of 2", "wrong decisions", "no floor", 0, single_count},
    {"C4", "beams of 0, 1, 2 ... cells, shorter than a window", "cells wrong, bytes outside",
     "reads that loop beyond the ends", 0, lengths},
    {"C5", "windows longer than the beam", "cells wrong, bytes outside", "reads that loop beyond the ends", 0,
     long_windows},
    {"C6", "false-alarm rates down to 1e-300", "error of the factor in ulp",
     "GOCA's probability as a difference, in double", 450, tiny_rates},
    {"C7", "rates 0, 1, -1, NaN; no cells; impossible ranks", "arguments accepted",
     "the formula is just evaluated", 0, wrong_arguments},
    {"C8", "a cell of 1e8 before ones", "windows wrong after it", "running sum in float", 0, after_a_loud_cell},
    {"C9", "1e6 random cells over eight decades", "cells unlike the rule as written", "running sum in float", 0,
     random_cells},
    {"C10", "constant beams of every level, factor 1 and 0.99", "wrong cells", "x >= alpha * mean", 0, constants},
    {"C11", "decibels taken for pressure", "beams not doubted", "a detector alone", 0, wrong_law},
    {"C12", "alpha 2^24 over sums of 2^45", "wrong decisions", "64-bit products", 0, integer_limit},
    {0},
};
