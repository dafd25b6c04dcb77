/* SPDX-License-Identifier: MIT */
/*
 * report_false_alarm - the measured false-alarm rate against the asked one: every detector, over exponential clutter
 * as it comes in each amplitude law (independent cells), and of the whole stage over clutter that the pulse correlates.
 *
 *   report_false_alarm rates [quick]    CSV: clutter, detector, asked, cells, alarms, measured, low, high
 *
 * low and high: Wilson's 95 % limits. Alarms of one window are not quite independent, so the truth is outside them a
 * little more often than one time in twenty.
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "grid/range/cfar.h"
#include "grid/range/extract.h"
#include "tests/lib/clutter.h"

#define BEAM       8192 /* cells of one run of the detector */
#define SIDE       16
#define GUARD      2
#define RANK_SHARE 0.75
#define DB_COUNT   0.3137 /* of the log law */
#define TABLE      65536
#define TAIL       256  /* the topmost entries of the table are drawn exactly */
#define ALARMS     2000 /* enough to know a rate to 5 % */

#define SPECKLE_BINS  1000 /* of one beam through the whole stage, 1 cm each */
#define SPECKLE_PULSE 4

static const char *const detector_name[] = {"ca", "goca", "soca", "os"};
static const double asked[] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
#define ASKED (sizeof asked / sizeof asked[0])

/* What the clutter is sent as. */
#define CLUTTERS 5
static const struct clutter clutters[CLUTTERS] = {{"exact", AMPLITUDE_POWER, 1, 0.0, DB_COUNT}, /* no counts */
                                                  {"power", AMPLITUDE_POWER, 1, 12.0, DB_COUNT},
                                                  {"linear", AMPLITUDE_LINEAR, 1, 45.0, DB_COUNT},
                                                  {"sqrt", AMPLITUDE_SQRT, 1, 90.0, DB_COUNT},
                                                  {"log", AMPLITUDE_LOG, 1, 100.0, DB_COUNT}};

static uint64_t power[BEAM];
static _Alignas(64) unsigned char work[BEAM * 64];
static uint8_t mask[BEAM];

/* The power that the detector sees of a cell whose true power is p times the mean. */
static uint64_t seen_power(const struct clutter *c, const struct amplitude *a, double p)
{
    return c == clutters ? (uint64_t)(p * 65536.0) : amplitude_of(a, clutter_count(c, p));
}

/* Independent exponential cells: quantiles by table, the tail exactly, because the alarms live there. */
static void draw_cells(const struct clutter *c, const struct amplitude *a, const uint64_t *table,
                       struct dice *dice)
{
    for (uint32_t i = 0; i < BEAM; i++) {
        const uint32_t at = (uint32_t)(dice_bits(dice) >> 48);
        power[i] =
            at < TABLE - TAIL ? table[at] : seen_power(c, a, log((double)TABLE / TAIL) - log(dice_uniform(dice)));
    }
}

static uint64_t to_q16(double alpha)
{
    return (uint64_t)(alpha * 65536.0 + 0.5);
}

static struct cfar cfar_for(enum cfar_detector detector, double pfa)
{
    const uint32_t both = (uint32_t)ceil(RANK_SHARE * 2.0 * SIDE), one = (uint32_t)ceil(RANK_SHARE * SIDE);
    double alpha = 0.0, alpha_one = 0.0;
    if (!cfar_alpha(detector, SIDE, SIDE, both, pfa, &alpha) ||
        !cfar_alpha(detector, SIDE, 0, one, pfa, &alpha_one))
        abort();
    return (struct cfar){.detector = detector,
                         .edge = CFAR_BOTH,
                         .n_side = SIDE,
                         .guard = GUARD,
                         .rank = both,
                         .alpha_q16 = to_q16(alpha),
                         .alpha_one_q16 = to_q16(alpha_one)};
}

static void print_rate(const char *noise, enum cfar_detector detector, double pfa, double cells, double alarms)
{
    double low, high;
    wilson(alarms, cells, 1.96, &low, &high);
    printf("%s,%s,%.0e,%.0f,%.0f,%.4g,%.4g,%.4g\n", noise, detector_name[detector], pfa, cells, alarms,
           alarms / cells, fmax(low, 0.0), high);
}

static void independent_cells(const struct clutter *c, double max_cells)
{
    static uint64_t table[TABLE];
    struct amplitude amplitude;
    double cells[4][ASKED] = {{0.0}}, alarms[4][ASKED] = {{0.0}};
    struct dice dice = dice_of(1, (uint64_t)(c - clutters));
    struct cfar cfar[4][ASKED];
    if (!amplitude_init(&amplitude, c->law, 1, c->db_per_count) || cfar_work_size(BEAM) > sizeof work)
        abort();
    for (uint32_t i = 0; i < TABLE; i++)
        table[i] = seen_power(c, &amplitude, -log1p(-(i + 0.5) / TABLE));
    for (int d = CFAR_CA; d <= CFAR_OS; d++)
        for (size_t k = 0; k < ASKED; k++)
            cfar[d][k] = cfar_for((enum cfar_detector)d, asked[k]);
    for (double drawn = 0.0; drawn < max_cells; drawn += BEAM) {
        draw_cells(c, &amplitude, table, &dice);
        for (int d = CFAR_CA; d <= CFAR_OS; d++)
            for (size_t k = 0; k < ASKED; k++) {
                if (cells[d][k] * asked[k] >= ALARMS)
                    continue;
                const struct cfar_profile profile = {.x = power, .n = BEAM, .work = work};
                cfar_run(&cfar[d][k], &profile, mask);
                cells[d][k] += BEAM - 2 * (SIDE + GUARD);
                for (uint32_t i = 0; i < BEAM; i++)
                    alarms[d][k] += mask[i];
            }
    }
    for (int d = CFAR_CA; d <= CFAR_OS; d++)
        for (size_t k = 0; k < ASKED; k++)
            print_rate(c->name, (enum cfar_detector)d, asked[k], cells[d][k], alarms[d][k]);
}

/* Empty water through the whole stage: speckle correlated by the pulse, no contrast asked; echoes per pulse length. */
static void whole_stage(double max_bins)
{
    static _Alignas(max_align_t) unsigned char memory[4 * ASKED][1 << 19];
    static uint8_t samples[SPECKLE_BINS];
    struct extract *extract[4][ASKED];
    struct extract_conf conf;
    struct ping_beam axis = {.az_rad = 0.0f};
    const struct ping ping = {.kind = PING_PROFILE,
                              .law = AMPLITUDE_SQRT,
                              .sample_bytes = 1,
                              .n_beams = 1,
                              .n_bins = SPECKLE_BINS,
                              .dr_m = 0.01f,
                              .pulse_m = 0.01f * SPECKLE_PULSE,
                              .beam = &axis,
                              .samples = samples};
    double cells = 0.0, alarms[4][ASKED] = {{0.0}};
    struct dice dice = dice_of(2, 0);

    extract_defaults(&conf);
    conf.min_contrast_db = 0.0;
    conf.ring_down_m = 0.0;
    for (int d = CFAR_CA; d <= CFAR_OS; d++)
        for (size_t k = 0; k < ASKED; k++) {
            struct fault fault = {"too little memory"};
            conf.detector = (enum cfar_detector)d;
            conf.false_alarm = asked[k];
            extract[d][k] = extract_size(SPECKLE_BINS) <= sizeof memory[0]
                                ? extract_init(memory[(size_t)d * ASKED + k], &conf, SPECKLE_BINS, &fault)
                                : NULL;
            if (!extract[d][k]) {
                fprintf(stderr, "report_false_alarm: %s\n", fault.text);
                exit(1);
            }
        }
    for (double drawn = 0.0; drawn < max_bins; drawn += SPECKLE_BINS) {
        double complex field[SPECKLE_BINS + SPECKLE_PULSE];
        for (uint32_t i = 0; i < SPECKLE_BINS + SPECKLE_PULSE; i++)
            field[i] = dice_normal(&dice);
        sound_pulse(field, SPECKLE_BINS + SPECKLE_PULSE, SPECKLE_PULSE);
        for (uint32_t i = 0; i < SPECKLE_BINS; i++) {
            const double p = sound_intensity(field[i + SPECKLE_PULSE]) / SPECKLE_PULSE;
            samples[i] = sound_byte(sound_count(AMPLITUDE_SQRT, p, 90.0, 0.0) + 0.5);
        }
        cells += (double)SPECKLE_BINS / SPECKLE_PULSE;
        for (int d = CFAR_CA; d <= CFAR_OS; d++)
            for (size_t k = 0; k < ASKED; k++) {
                struct beam_echoes found;
                struct echoes out = {.max_beams = 1, .beam = &found};
                extract_run(extract[d][k], &ping, NULL, &out);
                alarms[d][k] += found.n;
            }
    }
    for (int d = CFAR_CA; d <= CFAR_OS; d++)
        for (size_t k = 0; k < ASKED; k++)
            print_rate("whole stage", (enum cfar_detector)d, asked[k], cells, alarms[d][k]);
}

int main(int argc, char **argv)
{
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    if (argc < 2 || strcmp(argv[1], "rates") != 0) {
        fprintf(stderr, "usage: report_false_alarm rates [quick]\n");
        return 2;
    }
    printf("clutter,detector,asked,cells,alarms,measured,low,high\n");
    for (int c = 0; c < CLUTTERS; c++)
        independent_cells(&clutters[c], quick ? 2e5 : 2e7);
    whole_stage(quick ? 2e5 : 4e6);
    return 0;
}
