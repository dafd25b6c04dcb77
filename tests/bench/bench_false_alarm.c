/* SPDX-License-Identifier: MIT */
/*
 * bench_false_alarm [CELLS] - false alarms counted against the rate that was asked for, 1e-2 to 1e-6, for every
 * detector and amplitude law, with Wilson's 95 % limits. 1e7 cells by default; 1e8 make the last column count for
 * something and take half a minute. tests/unit/test_cfar_rates checks 1e-2 to 1e-4.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "tests/lib/clutter.h"

#include "grid/range/cfar.h"

#define BEAM  8192
#define SIDE  16
#define RANK  24
#define RATES 5

static uint64_t x[BEAM], work[3 * (BEAM + 1)];
static uint8_t mask[BEAM];

static double detections(const struct cfar *cfar)
{
    double hits = 0;
    cfar_run(cfar, &(struct cfar_profile){.x = x, .n = BEAM, .work = work}, mask);
    for (int i = 0; i < BEAM; i++)
        hits += mask[i];
    return hits;
}

int main(int argc, char **argv)
{
    static const char *const name[] = {"ca", "goca", "soca", "os"};
    static const double asked[RATES] = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6};
    const double beams = ceil((argc > 1 ? strtod(argv[1], NULL) : 1e7) / BEAM);
    const double cells = beams * (BEAM - 2 * SIDE);
    uint64_t seed = 1;
    printf("%.3g cells each: counted rate over the asked one (95 %% limits)\n%-26s", cells, "asked");
    for (int k = 0; k < RATES; k++)
        printf("%26.0e", asked[k]);
    for (int law = 0; law < CLUTTER_LAWS; law++) {
        struct amplitude table;
        struct cfar cfar[4][RATES];
        double hits[4][RATES] = {{0}};
        if (!amplitude_init(&table, clutter[law].law, clutter[law].sample_bytes, clutter[law].db_per_count))
            return 1;
        for (int d = CFAR_CA; d <= CFAR_OS; d++)
            for (int k = 0; k < RATES; k++) {
                double alpha = 0;
                cfar_alpha((enum cfar_detector)d, SIDE, SIDE, RANK, asked[k], &alpha);
                cfar[d][k] = (struct cfar){.detector = (enum cfar_detector)d,
                                           .edge = CFAR_BOTH,
                                           .n_side = SIDE,
                                           .rank = RANK,
                                           .alpha_q16 = (uint64_t)(alpha * 65536.0 + 0.5)};
            }
        for (double b = 0; b < beams; b++) {
            clutter_fill(&clutter[law], &table, &seed, BEAM, x);
            for (int d = CFAR_CA; d <= CFAR_OS; d++)
                for (int k = 0; k < RATES; k++)
                    hits[d][k] += detections(&cfar[d][k]);
        }
        for (int d = CFAR_CA; d <= CFAR_OS; d++) {
            printf("\n%-20s %-5s", clutter[law].name, name[d]);
            for (int k = 0; k < RATES; k++) {
                double lo, hi;
                wilson(hits[d][k], cells, 1.96, &lo, &hi);
                printf("%12.3f (%5.3f..%5.3f)", hits[d][k] / cells / asked[k], lo / asked[k], hi / asked[k]);
            }
        }
    }
    printf("\n");
    return 0;
}
