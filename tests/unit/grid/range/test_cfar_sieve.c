/* SPDX-License-Identifier: MIT */
/*
 * test_cfar_sieve - every width of vectors marks the same cells, and never one too few. The module is included and
 * not linked, so that the variants which this CPU would not choose can be called, too.
 */
#include "tests/lib/test.h"

#include "grid/range/cfar_sieve.c"

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
        return (struct cfar_stretch){0, n - reach, behind, behind, side, alpha, 0};
    case 1:
        return (struct cfar_stretch){reach, n, before, before, side, alpha, 0};
    default:
        return (struct cfar_stretch){reach, n - reach, before, behind, side, alpha, 0};
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

typedef void powers_fn(const uint64_t *, uint32_t, float *);
typedef const float *sums_fn(const float *, uint32_t, uint32_t, float *);
typedef void average_fn(enum cfar_detector, const struct cfar_stretch *, const float *, const float *, uint8_t *);
typedef void codes_fn(const float *, uint32_t, uint8_t *);
typedef void rank_fn(const struct cfar_stretch *, uint32_t, const float *, const uint8_t *, uint8_t *);

static void powers_plain(const uint64_t *cell, uint32_t n, float *power)
{
    cfar_sieve_powers_body(cell, n, power);
}

static const float *sums_plain(const float *power, uint32_t n, uint32_t cells, float *room)
{
    return cfar_sieve_sums_body(power, n, cells, room);
}

static void average_plain(enum cfar_detector kind, const struct cfar_stretch *s, const float *power,
                          const float *sum, uint8_t *mark)
{
    cfar_sieve_average_body(kind, s, power, sum, mark);
}

static void codes_plain(const float *power, uint32_t n, uint8_t *code)
{
    cfar_sieve_codes_body(power, n, code);
}

static void rank_plain(const struct cfar_stretch *s, uint32_t rank, const float *power, const uint8_t *code,
                       uint8_t *mark)
{
    cfar_sieve_rank_body(s, rank, power, code, mark);
}

struct variant {
    const char *name;
    powers_fn *powers;
    sums_fn *sums;
    average_fn *average;
    codes_fn *codes;
    rank_fn *rank;
};

#define VARIANT(name, suffix)                                                                                     \
    {                                                                                                             \
        name, cfar_sieve_powers##suffix, cfar_sieve_sums##suffix, cfar_sieve_average##suffix,                     \
            cfar_sieve_codes##suffix, cfar_sieve_rank##suffix                                                     \
    }

/* Those this CPU can run, the baseline first. */
static int variants(struct variant out[3])
{
    int n = 0;
    out[n++] = (struct variant){"baseline", powers_plain, sums_plain, average_plain, codes_plain, rank_plain};
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx2"))
        out[n++] = (struct variant)VARIANT("avx2", _avx2);
    if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&
        __builtin_cpu_supports("avx512vl"))
        out[n++] = (struct variant)VARIANT("avx512", _avx512);
#endif
    return n;
}

/* The sum of windows of every length, however loud a cell is before or behind: at most so far off as is allowed for. */
TEST(sums_of_windows_are_right_to_a_share_of_themselves)
{
    struct variant v[3];
    const int n_variants = variants(v);
    uint64_t seed = test_seed();
    double worst = 0.0;
    for (uint32_t cells = 1; cells <= 900; cells += cells < 100 ? 1 : 50) {
        const uint32_t n = cells + (uint32_t)(test_random(&seed) % 100);
        static float power[3][MAX_CELLS], room[3][2 * MAX_CELLS];
        random_profile(&seed, n);
        const float *first = NULL;
        for (int k = 0; k < n_variants; k++) {
            v[k].powers(x, n, power[k]);
            const float *sum = v[k].sums(power[k], n, cells, room[k]);
            first = first ? first : sum;
            CHECK(memcmp(sum, first, (n - cells + 1) * sizeof *sum) == 0);
        }
        for (uint32_t i = 0; i + cells <= n; i++) {
            const double want = (double)(prefix[i + cells] - prefix[i]);
            if (want > 0.0)
                worst = fmax(worst, fabs((double)first[i] / want - 1.0));
            else
                CHECK(first[i] == 0.0f);
        }
    }
    CHECK(worst < (1.0 - SLACK) / 2.0);
    printf("# worst relative error of a sum of windows %.1e, allowed for is %.1e\n", worst, 1.0 - SLACK);
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
        struct cfar_stretch s = random_stretch(&seed, n, side);
        s.least = test_random(&seed) % 2 ? 0.0 : (double)x[0];
        uint8_t mark[3][MAX_CELLS] = {{0}};
        for (int k = 0; k < n_variants; k++) {
            float power[MAX_CELLS], room[2 * MAX_CELLS];
            uint8_t code[MAX_CELLS];
            v[k].powers(x, n, power);
            v[k].codes(power, n, code);
            if (kind == CFAR_OS)
                v[k].rank(&s, rank, power, code, mark[k]);
            else
                v[k].average(kind, &s, power, v[k].sums(power, n, side, room), mark[k]);
            different += memcmp(mark[k], mark[0], n) != 0;
        }
        for (uint32_t i = s.begin; i < s.end; i++) {
            const bool want = (double)x[i] > s.least && (kind == CFAR_OS ? rank_detects(&s, side, rank, i)
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
    RUN(sums_of_windows_are_right_to_a_share_of_themselves);
    RUN(variants_mark_the_same_cells_and_never_too_few);
    return test_end();
}
