/* SPDX-License-Identifier: MIT */
/*
 * test_cfar_sieve - every width of vectors marks the same cells, and never one too few. The module is included and
 * not linked, so that the variants which this CPU would not choose can be called, too.
 */
#include "../lib/test.h"

#include "../../grid/range/cfar_sieve.c"

#define MAX_CELLS 1000

static uint64_t x[MAX_CELLS], prefix[MAX_CELLS + 1];

/* Decades of levels, zeros, ties, and the largest power that is allowed. */
static void random_profile(uint64_t *seed, uint32_t n)
{
    const uint64_t kind = test_random(seed) % 4;

    for (uint32_t i = 0; i < n; i++) {
        const double u = test_uniform(seed);
        x[i] = kind == 0   ? (uint64_t)(-1000.0 * log(1.0 - u))
               : kind == 1 ? test_random(seed) % 3
               : kind == 2 ? (uint64_t)exp2(40.0 * u)
                           : ((uint64_t)1 << 52) / n - test_random(seed) % 2;
        prefix[i + 1] = prefix[i] + x[i];
    }
}

static struct cfar_stretch random_stretch(uint64_t *seed, uint32_t n, uint32_t side)
{
    const uint32_t guard = (uint32_t)(test_random(seed) % 5), reach = guard + side;
    const int32_t before = -(int32_t)reach, behind = (int32_t)guard + 1;
    const double alpha = 0.5 + 12.0 * test_uniform(seed);

    switch (test_random(seed) % 3) {
    case 0:
        return (struct cfar_stretch){0, n - reach, behind, behind, alpha};
    case 1:
        return (struct cfar_stretch){reach, n, before, before, alpha};
    default:
        return (struct cfar_stretch){reach, n - reach, before, behind, alpha};
    }
}

static long double window_sum(uint32_t i, int32_t at, uint32_t side)
{
    return (long double)(prefix[(int64_t)i + at + side] - prefix[(int64_t)i + at]);
}

static bool average_detects(enum cfar_detector kind, const struct cfar_stretch *s, uint32_t side, uint32_t i)
{
    const long double lead = window_sum(i, s->lead, side), lag = window_sum(i, s->lag, side);
    const long double sum = kind == CFAR_CA     ? (lead + lag) / 2
                            : kind == CFAR_GOCA ? (lead > lag ? lead : lag)
                                                : (lead < lag ? lead : lag);

    return (long double)x[i] * side > (long double)s->alpha * sum;
}

static bool rank_detects(const struct cfar_stretch *s, uint32_t side, uint32_t rank, uint32_t i)
{
    uint32_t below = 0;

    for (uint32_t d = 0; d < side; d++) {
        below += (long double)x[(int64_t)i + s->lead + d] * (long double)s->alpha < (long double)x[i];
        if (s->lag != s->lead)
            below += (long double)x[(int64_t)i + s->lag + d] * (long double)s->alpha < (long double)x[i];
    }
    return below >= rank;
}

typedef void average_fn(enum cfar_detector, const struct cfar_stretch *, uint32_t, double, const uint64_t *,
                        const float *, uint8_t *);
typedef void rank_fn(const struct cfar_stretch *, uint32_t, uint32_t, double, const uint64_t *, const uint8_t *,
                     uint8_t *);
typedef void sums_fn(const uint64_t *, uint32_t, uint32_t, float *);
typedef void codes_fn(const uint64_t *, uint32_t, uint8_t *);

static void sums_plain(const uint64_t *p, uint32_t cells, uint32_t n, float *sum)
{
    cfar_sieve_sums_body(p, cells, n, sum);
}

static void average_plain(enum cfar_detector kind, const struct cfar_stretch *s, uint32_t cells, double least,
                          const uint64_t *power, const float *sum, uint8_t *mark)
{
    cfar_sieve_average_body(kind, s, cells, least, power, sum, mark);
}

static void codes_plain(const uint64_t *power, uint32_t n, uint8_t *code)
{
    cfar_sieve_codes_body(power, n, code);
}

static void rank_plain(const struct cfar_stretch *s, uint32_t cells, uint32_t rank, double least,
                       const uint64_t *power, const uint8_t *code, uint8_t *mark)
{
    cfar_sieve_rank_body(s, cells, rank, least, power, code, mark);
}

struct variant {
    const char *name;
    sums_fn *sums;
    average_fn *average;
    codes_fn *codes;
    rank_fn *rank;
};

/* Those this CPU can run, the baseline first. */
static int variants(struct variant out[3])
{
    int n = 0;

    out[n++] = (struct variant){"baseline", sums_plain, average_plain, codes_plain, rank_plain};
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        out[n++] = (struct variant){"avx2", cfar_sieve_sums_avx2, cfar_sieve_average_avx2, cfar_sieve_codes_avx2,
                                    cfar_sieve_rank_avx2};
    if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        out[n++] = (struct variant){"avx512", cfar_sieve_sums_avx512, cfar_sieve_average_avx512,
                                    cfar_sieve_codes_avx512, cfar_sieve_rank_avx512};
#endif
    return n;
}

TEST(variants_mark_the_same_cells_and_never_too_few)
{
    struct variant v[3];
    const int n_variants = variants(v);
    uint64_t seed = test_seed();
    long cells = 0, marked = 0, wanted = 0, missed = 0, different = 0;

    while (cells < 2000000) {
        const uint32_t side = 1 + (uint32_t)(test_random(&seed) % (test_random(&seed) % 4 ? 20 : 300));
        const uint32_t n = 2 * side + 10 + (uint32_t)(test_random(&seed) % 300);
        const uint32_t rank = 1 + (uint32_t)(test_random(&seed) % side);
        const enum cfar_detector kind = (enum cfar_detector)(test_random(&seed) % 4);
        random_profile(&seed, n);
        const struct cfar_stretch s = random_stretch(&seed, n, side);
        const double least = test_random(&seed) % 2 ? 0.0 : (double)x[0];
        uint8_t mark[3][MAX_CELLS] = {{0}};
        for (int k = 0; k < n_variants; k++) {
            float sum[MAX_CELLS];
            uint8_t code[MAX_CELLS];
            v[k].sums(prefix, side, n - side + 1, sum);
            v[k].codes(x, n, code);
            if (kind == CFAR_OS)
                v[k].rank(&s, side, rank, least, x, code, mark[k]);
            else
                v[k].average(kind, &s, side, least, x, sum, mark[k]);
            different += memcmp(mark[k], mark[0], n) != 0;
        }
        for (uint32_t i = s.begin; i < s.end; i++) {
            const bool want = (double)x[i] > least && (kind == CFAR_OS ? rank_detects(&s, side, rank, i)
                                                                       : average_detects(kind, &s, side, i));
            missed += want && !mark[0][i];
            wanted += want;
            marked += mark[0][i];
        }
        cells += s.end - s.begin;
    }
    CHECK_INT(different, 0);
    CHECK_INT(missed, 0);
    CHECK(wanted > cells / 50 && marked < cells * 3 / 4);
    printf("# %d variants, %ld cells, %ld marked, %ld of them rightly\n", n_variants, cells, marked, wanted);
}

int main(void)
{
    RUN(variants_mark_the_same_cells_and_never_too_few);
    return test_end();
}
