/* SPDX-License-Identifier: MIT */
/* rivals - see rivals.h. */
#include "rivals.h"

#include <math.h>
#include <stdbool.h>

#include "grid/range/cfar_factor.h"

#define TRAINING    20
#define GUARD       5
#define FALSE_ALARM 0.1
#define BLANK_M     0.9

static const uint8_t *samples_of(const struct ping *ping, unsigned beam)
{
    return (const uint8_t *)ping->samples + (size_t)beam * ping->n_bins;
}

static void found(const struct ping *ping, unsigned beam, double from_m, uint32_t bin, struct beam_echoes *out)
{
    const double dr_m = (double)ping->dr_m, end_m = bin * dr_m;
    const bool echo = bin < ping->n_bins;
    *out = (struct beam_echoes){.az_rad = ping->beam[beam].az_rad,
                                .blind_m = (float)from_m,
                                .free_to_m = (float)fmax(end_m, from_m),
                                .state = echo ? BEAM_ECHO : BEAM_SILENT,
                                .n = echo};
    if (echo)
        out->echo[0] = (struct echo){.range_m = (float)(end_m + 0.5 * dr_m), .near_m = (float)end_m};
}

void rivals_threshold(const struct ping *ping, unsigned beam, double counts, double from_m,
                      struct beam_echoes *out)
{
    const uint8_t *sample = samples_of(ping, beam);
    uint32_t i = (uint32_t)ceil(from_m / (double)ping->dr_m);
    while (i < ping->n_bins && sample[i] <= counts)
        i++;
    found(ping, beam, from_m, i < ping->n_bins ? i : ping->n_bins, out);
}

void rivals_soca(const struct ping *ping, unsigned beam, double counts, struct beam_echoes *out)
{
    static double factor;
    const uint8_t *sample = samples_of(ping, beam);
    const uint32_t blank = (uint32_t)ceil(BLANK_M / (double)ping->dr_m), reach = TRAINING + GUARD;
    uint32_t i = blank > reach ? blank : reach, before = 0, behind = 0;
    if (factor == 0.0)
        cfar_alpha(CFAR_SOCA, TRAINING, TRAINING, 0, FALSE_ALARM, &factor);
    for (uint32_t k = 0; k < TRAINING && i + reach < ping->n_bins; k++) {
        before += sample[i - reach + k];
        behind += sample[i + GUARD + 1 + k];
    }
    for (;; i++) {
        if (i + reach >= ping->n_bins) {
            i = ping->n_bins;
            break;
        }
        const double mean = (before < behind ? before : behind) / (double)TRAINING;
        if (sample[i] > factor * mean && sample[i] > counts)
            break;
        before += sample[i - GUARD] - (uint32_t)sample[i - reach];
        behind += sample[i + reach + 1 < ping->n_bins ? i + reach + 1 : i] - (uint32_t)sample[i + GUARD + 1];
    }
    found(ping, beam, BLANK_M, i, out);
}
