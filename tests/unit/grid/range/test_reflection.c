/* SPDX-License-Identifier: MIT */
/* test_reflection - where the peak of a reflection lies, finer than a bin, through the whole extraction. */
#include "core/fault.h"
#include "grid/range/extract.h"
#include "tests/lib/test.h"

#define BINS 400
#define DR_M 0.02

static _Alignas(16) unsigned char memory[1 << 19];
static uint16_t counts[BINS];

/* The range of a thing whose level falls off alike on both sides of at_m; NaN: no echo. */
static double found_at(double at_m, double width_m)
{
    struct extract_conf conf;
    struct fault fault;
    struct beam_echoes beam;
    struct ping_beam axis = {.az_rad = 0.0f};
    extract_defaults(&conf);
    conf.ring_down_m = 0.2;
    struct extract *extract = extract_init(memory, &conf, BINS, &fault);
    CHECK(extract && extract_size(BINS) <= sizeof memory);
    for (int i = 0; i < BINS; i++) {
        const double off = ((i + 0.5) * DR_M - at_m) / width_m;
        counts[i] = (uint16_t)(100 + 40000 * exp(-off * off / 2));
    }
    const struct ping ping = {.kind = PING_PROFILE,
                              .law = AMPLITUDE_LINEAR,
                              .sample_bytes = 2,
                              .n_beams = 1,
                              .n_bins = BINS,
                              .dr_m = (float)DR_M,
                              .pulse_m = 0.02f,
                              .beam = &axis,
                              .samples = counts};
    struct echoes out = {.max_beams = 1, .beam = &beam};
    extract_run(extract, &ping, NULL, &out);
    return beam.n == 1 ? (double)beam.echo[0].range_m : (double)NAN;
}

TEST(a_peak_is_placed_within_a_tenth_of_a_bin)
{
    double worst = 0;
    for (int k = 0; k < 41; k++) {
        const double at_m = 4 + k * DR_M / 20, off = fabs(found_at(at_m, 0.03) - at_m);
        CHECK(off < 0.1 * DR_M);
        worst = fmax(worst, off);
    }
    printf("# at most %.3f bins off\n", worst / DR_M);
}

/* A flat top is placed in its middle. */
TEST(a_flat_top_is_placed_in_its_middle)
{
    CHECK_NEAR(found_at(4.01, 0.03), 4.01, 0, 0.1 * DR_M);
    CHECK_NEAR(found_at(4.0, 0.03), 4.0, 0, 0.1 * DR_M); /* two bins alike */
}

int main(void)
{
    RUN(a_peak_is_placed_within_a_tenth_of_a_bin);
    RUN(a_flat_top_is_placed_in_its_middle);
    return test_end();
}
