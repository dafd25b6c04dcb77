/* SPDX-License-Identifier: MIT */
/*
 * cfar_sieve - loops over blocks of a fixed number of cells, written so that gcc and clang make vectors of them, each
 * compiled for the baseline and for wider vectors and chosen at run time. Comparisons are signs of differences, since
 * both compilers vectorise those everywhere. Knows no edges of profiles and no excluded cells.
 */
#include "cfar_sieve.h"

#include <string.h>

#define BLOCK  32 /* cells that are looked at together */
#define INLINE static inline __attribute__((always_inline))

/*
 * What rounding may take from a comparison: each number goes through at most four roundings of 2^-24. The thresholds
 * are lowered by more than that.
 */
#define SLACK (1.0 - 0x1p-20)

/* VARIANTS(name, (parameters), (arguments)) makes `name` of name_body: one copy for each width of vectors. */
#if defined(__x86_64__)
#define AVX512 "avx512f,avx512bw,avx512dq,avx512vl"
#define VARIANTS(name, parameters, arguments)                                                                     \
    __attribute__((target(AVX512))) static void name##_avx512 parameters                                          \
    {                                                                                                             \
        name##_body arguments;                                                                                    \
    }                                                                                                             \
    __attribute__((target("avx2"))) static void name##_avx2 parameters                                            \
    {                                                                                                             \
        name##_body arguments;                                                                                    \
    }                                                                                                             \
    void name parameters                                                                                          \
    {                                                                                                             \
        if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512dq") &&                           \
            __builtin_cpu_supports("avx512vl"))                                                                   \
            name##_avx512 arguments;                                                                              \
        else if (__builtin_cpu_supports("avx2"))                                                                  \
            name##_avx2 arguments;                                                                                \
        else                                                                                                      \
            name##_body arguments;                                                                                \
    }
#else
#define VARIANTS(name, parameters, arguments)                                                                     \
    void name parameters                                                                                          \
    {                                                                                                             \
        name##_body arguments;                                                                                    \
    }
#endif

/* Begin of the block after the one at i: the last block of a stretch overlaps the one before it. */
INLINE uint32_t next_block(uint32_t i, uint32_t end)
{
    return i + BLOCK >= end ? end : i + 2 * BLOCK <= end ? i + BLOCK : end - BLOCK;
}

/* An integer below 2^52 as a double; the conversion instruction for vectors came with AVX-512 only. */
INLINE double to_double(uint64_t v)
{
    double d;

    v |= 0x4330000000000000; /* the bits of 2^52 + v */
    memcpy(&d, &v, sizeof d);
    return d - 0x1p52;
}

INLINE uint32_t bits_of(float f)
{
    uint32_t bits;

    memcpy(&bits, &f, sizeof bits);
    return bits;
}

INLINE void sums_block(const uint64_t *restrict lo, const uint64_t *restrict hi, float *restrict sum)
{
    for (int j = 0; j < BLOCK; j++)
        sum[j] = (float)to_double(hi[j] - lo[j]);
}

INLINE void cfar_sieve_sums_body(const uint64_t *prefix, uint32_t cells, uint32_t n, float *sum)
{
    uint32_t i = 0;

    for (; i + BLOCK <= n; i += BLOCK)
        sums_block(prefix + i, prefix + i + cells, sum + i);
    for (; i < n; i++)
        sum[i] = (float)to_double(prefix[i + cells] - prefix[i]);
}

VARIANTS(cfar_sieve_sums, (const uint64_t *prefix, uint32_t cells, uint32_t n, float *sum),
         (prefix, cells, n, sum))

/* Top bit set where the cell may be detected. */
INLINE uint32_t average_test(enum cfar_detector detector, float factor, float least, uint64_t power, float lead,
                             float lag)
{
    const float x = (float)to_double(power);
    uint32_t above;

    if (detector == CFAR_CA)
        above = bits_of((lead + lag) * factor - x);
    else if (detector == CFAR_GOCA)
        above = bits_of(lead * factor - x) & bits_of(lag * factor - x);
    else
        above = bits_of(lead * factor - x) | bits_of(lag * factor - x);
    return above & bits_of(least - x);
}

INLINE uint32_t average_block(enum cfar_detector detector, float factor, float least, const uint64_t *restrict x,
                              const float *restrict lead, const float *restrict lag)
{
    uint32_t any = 0;

    for (int j = 0; j < BLOCK; j++)
        any |= average_test(detector, factor, least, x[j], lead[j], lag[j]);
    return any >> 31;
}

INLINE void average_stretch(enum cfar_detector detector, const struct cfar_stretch *s, float factor, float least,
                            const uint64_t *x, const float *sum, uint8_t *mark)
{
    const uint32_t cells = s->end - s->begin < BLOCK ? s->end - s->begin : BLOCK;

    for (uint32_t i = s->begin; i < s->end; i = next_block(i, s->end)) {
        const uint64_t *cell = x + i;
        const float *lead = sum + ((int64_t)i + s->lead), *lag = sum + ((int64_t)i + s->lag);
        if (cells == BLOCK && !average_block(detector, factor, least, cell, lead, lag))
            continue;
        for (uint32_t j = 0; j < cells; j++)
            mark[i + j] = average_test(detector, factor, least, cell[j], lead[j], lag[j]) >> 31 & 1;
    }
}

/* The detector is a constant in every call. */
INLINE void cfar_sieve_average_body(enum cfar_detector detector, const struct cfar_stretch *s, uint32_t cells,
                                    double least, const uint64_t *x, const float *sum, uint8_t *mark)
{
    const float factor = (float)(s->alpha * SLACK / (detector == CFAR_CA ? 2 * cells : cells));
    const float floor = (float)(least * SLACK);

    if (detector == CFAR_CA)
        average_stretch(CFAR_CA, s, factor, floor, x, sum, mark);
    else if (detector == CFAR_GOCA)
        average_stretch(CFAR_GOCA, s, factor, floor, x, sum, mark);
    else
        average_stretch(CFAR_SOCA, s, factor, floor, x, sum, mark);
}

VARIANTS(cfar_sieve_average,
         (enum cfar_detector detector, const struct cfar_stretch *stretch, uint32_t cells, double least,
          const uint64_t *x, const float *sum, uint8_t *mark),
         (detector, stretch, cells, least, x, sum, mark))

#define LAST_CODE 253 /* far above the codes of sums: 2^52 has 209 */

/* Exponent and two bits of the mantissa, from 1 for the power 1 on; 0 for everything below. */
INLINE uint8_t code_of(float x)
{
    const uint32_t one = 127 << 2, code = bits_of(x) >> 21;

    return (uint8_t)(code < one ? 0 : code - one > LAST_CODE ? LAST_CODE : code - one + 1);
}

INLINE void codes_block(const uint64_t *restrict x, uint8_t *restrict code)
{
    for (int j = 0; j < BLOCK; j++)
        code[j] = code_of((float)to_double(x[j]));
}

INLINE void cfar_sieve_codes_body(const uint64_t *x, uint32_t n, uint8_t *code)
{
    uint32_t i = 0;

    for (; i + BLOCK <= n; i += BLOCK)
        codes_block(x + i, code + i);
    for (; i < n; i++)
        code[i] = code_of((float)to_double(x[i]));
}

VARIANTS(cfar_sieve_codes, (const uint64_t *x, uint32_t n, uint8_t *code), (x, n, code))

/* limit: cells of a code below it may be below x / alpha; 0 where x is not above the least. */
INLINE void limits_block(float inverse, float least, const uint64_t *restrict power, uint8_t *restrict limit)
{
    for (int j = 0; j < BLOCK; j++) {
        const float x = (float)to_double(power[j]);
        limit[j] = (uint8_t)((code_of(x * inverse) + 1) & -(bits_of(least - x) >> 31));
    }
}

/* miss[j] += the cell of one place in the windows, for every cell of the block, if it is not below the limit. */
INLINE void misses_at(const uint8_t *restrict code, const uint8_t *restrict limit, uint8_t *restrict miss)
{
    for (int j = 0; j < BLOCK; j++)
        miss[j] = (uint8_t)(miss[j] + (code[j] >= limit[j]));
}

#define PLACES 32 /* of the window between two looks at whether any cell of the block is still in the running */

INLINE uint32_t add_misses(const uint8_t *restrict miss, uint32_t allowed, uint32_t *restrict total)
{
    uint32_t any = 0;

    for (int j = 0; j < BLOCK; j++) {
        total[j] += miss[j];
        any |= total[j] - allowed - 1; /* top bit: not more than allowed */
    }
    return any >> 31;
}

/* One window of the cells of a block; false as soon as none of them can be detected any more. */
INLINE bool window_misses(const uint8_t *code, uint32_t cells, const uint8_t *limit, uint32_t allowed,
                          uint32_t *total)
{
    for (uint32_t d = 0; d < cells; d += PLACES) {
        const uint32_t end = d + PLACES < cells ? d + PLACES : cells;
        uint8_t miss[BLOCK] = {0};
        for (uint32_t k = d; k < end; k++)
            misses_at(code + k, limit, miss);
        if (!add_misses(miss, allowed, total))
            return false;
    }
    return true;
}

INLINE void cfar_sieve_rank_body(const struct cfar_stretch *s, uint32_t cells, uint32_t rank, double least,
                                 const uint64_t *x, const uint8_t *code, uint8_t *mark)
{
    const float inverse = (float)(1.0 / (s->alpha * SLACK)), floor = (float)(least * SLACK);
    const bool both = s->lead != s->lag;
    const uint32_t allowed = (both ? 2 * cells : cells) - rank;

    if (s->end - s->begin < BLOCK) {
        memset(mark + s->begin, 1, s->end - s->begin);
        return;
    }
    for (uint32_t i = s->begin; i < s->end; i = next_block(i, s->end)) {
        uint32_t total[BLOCK] = {0};
        uint8_t limit[BLOCK];
        limits_block(inverse, floor, x + i, limit);
        if (!window_misses(code + ((int64_t)i + s->lead), cells, limit, allowed, total) ||
            (both && !window_misses(code + ((int64_t)i + s->lag), cells, limit, allowed, total)))
            continue;
        for (int j = 0; j < BLOCK; j++)
            mark[i + (uint32_t)j] = total[j] <= allowed;
    }
}

VARIANTS(cfar_sieve_rank,
         (const struct cfar_stretch *stretch, uint32_t cells, uint32_t rank, double least, const uint64_t *x,
          const uint8_t *code, uint8_t *mark),
         (stretch, cells, rank, least, x, code, mark))
