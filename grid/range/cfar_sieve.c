/* SPDX-License-Identifier: MIT */
/*
 * cfar_sieve - loops over blocks of a fixed number of cells, written so that gcc and clang make vectors of them, each
 * compiled for the baseline and for wider vectors and chosen at run time. Comparisons are signs of differences, since
 * both compilers vectorise those everywhere. Knows no edges of profiles and no excluded cells.
 */
#include "cfar_sieve.h"

#include <string.h>

#include "variants.h"

#define BLOCK CFAR_SIEVE_BLOCK

/*
 * What rounding may take from a comparison: a sum of windows goes through at most 36 roundings of 2^-24, five for each
 * digit of the number of cells in base 4. Nothing is ever subtracted from it, so this is a share of the sum however
 * loud its neighbours are. The thresholds are lowered by more than that.
 */
#define SLACK (1.0 - 0x1p-17)

/* Cells that are too few for a block are looked at one by one. */
INLINE uint32_t blocks_of(uint32_t n)
{
    return n < BLOCK ? 0 : (n + BLOCK - 1) / BLOCK;
}

/* Where a block of n cells begins: the last one overlaps the one before it. */
INLINE uint32_t block_begin(uint32_t block, uint32_t n)
{
    return block * BLOCK < n - BLOCK ? block * BLOCK : n - BLOCK;
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

INLINE void powers_block(const uint64_t *restrict x, float *restrict power)
{
#pragma GCC unroll 8
    for (int j = 0; j < BLOCK; j++)
        power[j] = (float)to_double(x[j]);
}

INLINE void cfar_sieve_powers_body(const uint64_t *x, uint32_t n, float *power)
{
    for (uint32_t b = 0; b < blocks_of(n); b++)
        powers_block(x + block_begin(b, n), power + block_begin(b, n));
    for (uint32_t i = 0; n < BLOCK && i < n; i++)
        power[i] = (float)to_double(x[i]);
}

VARIANTS(, void, cfar_sieve_powers, (const uint64_t *x, uint32_t n, float *power), (x, n, power))

/* How a window is made of shorter ones: 2 to 4 parts of `cells` cells side by side and 0 to 3 single cells behind. */
struct joint {
    uint32_t parts, cells, rest;
};

INLINE float join_at(struct joint to, const float *part, const float *power)
{
    const uint32_t c = to.cells;
    const float *behind = power + to.parts * c;
    float sum = part[0] + part[c];
    if (to.parts == 3)
        sum += part[2 * c];
    if (to.parts == 4)
        sum += part[2 * c] + part[3 * c];
    for (uint32_t k = 0; k < to.rest; k++)
        sum += behind[k];
    return sum;
}

INLINE void join_block(struct joint to, const float *restrict part, const float *restrict power,
                       float *restrict sum)
{
#pragma GCC unroll 8
    for (int j = 0; j < BLOCK; j++)
        sum[j] = join_at(to, part + j, power + j);
}

/* n windows. Parts and rest are constants in every call. */
INLINE void join_some(struct joint to, const float *part, const float *power, uint32_t n, float *sum)
{
    for (uint32_t b = 0; b < blocks_of(n); b++) {
        const uint32_t i = block_begin(b, n);
        join_block(to, part + i, power + i, sum + i);
    }
    for (uint32_t i = 0; n < BLOCK && i < n; i++)
        sum[i] = join_at(to, part + i, power + i);
}

INLINE void join(struct joint to, const float *part, const float *power, uint32_t n, float *sum)
{
    if (to.parts == 2)
        join_some((struct joint){2, to.cells, 0}, part, power, n, sum);
    else if (to.parts == 3)
        join_some((struct joint){3, to.cells, 0}, part, power, n, sum);
    else if (to.rest == 0)
        join_some((struct joint){4, to.cells, 0}, part, power, n, sum);
    else if (to.rest == 1)
        join_some((struct joint){4, to.cells, 1}, part, power, n, sum);
    else if (to.rest == 2)
        join_some((struct joint){4, to.cells, 2}, part, power, n, sum);
    else
        join_some((struct joint){4, to.cells, 3}, part, power, n, sum);
}

/* The number of cells in base 4: as many cells as its highest digit says, then four such windows and the next digit. */
INLINE const float *cfar_sieve_sums_body(const float *power, uint32_t n, uint32_t cells, float *room)
{
    int digit = (31 - __builtin_clz(cells)) / 2;
    const float *part = power;
    float *sum = room;
    for (struct joint to = {cells >> 2 * digit, 1, 0}; digit >= 0; to.parts = 4) {
        if (to.parts > 1) {
            join(to, part, power, n - to.parts * to.cells - to.rest + 1, sum);
            part = sum;
            sum = sum == room ? room + n : room;
        }
        to.cells = cells >> 2 * digit--;
        to.rest = digit < 0 ? 0 : cells >> 2 * digit & 3;
    }
    return part;
}

VARIANTS(, const float *, cfar_sieve_sums, (const float *power, uint32_t n, uint32_t cells, float *room),
         (power, n, cells, room))

struct threshold {
    float factor; /* times the sum of the reference cells, ... */
    float least;  /* ... or this, where it is more */
};

/* Top bit set where the cell may be detected. */
INLINE uint32_t average_test(enum cfar_detector detector, struct threshold at, float x, float lead, float lag)
{
    const float sum = detector == CFAR_CA ? lead + lag : (lead < lag) == (detector == CFAR_SOCA) ? lead : lag;
    const float threshold = sum * at.factor;
    return bits_of((threshold > at.least ? threshold : at.least) - x);
}

INLINE void average_block(enum cfar_detector detector, struct threshold at, const float *restrict x,
                          const float *restrict lead, const float *restrict lag, uint8_t *restrict mark)
{
#pragma GCC unroll 8
    for (int j = 0; j < BLOCK; j++)
        mark[j] = (uint8_t)(average_test(detector, at, x[j], lead[j], lag[j]) >> 31);
}

INLINE void average_stretch(enum cfar_detector detector, const struct cfar_stretch *s, struct threshold at,
                            const float *x, const float *sum, uint8_t *mark)
{
    const uint32_t n = s->end - s->begin;
    const float *lead = sum + (int64_t)s->begin + s->lead, *lag = sum + (int64_t)s->begin + s->lag;
    x += s->begin;
    mark += s->begin;
    for (uint32_t b = 0; b < blocks_of(n); b++) {
        const uint32_t i = block_begin(b, n);
        average_block(detector, at, x + i, lead + i, lag + i, mark + i);
    }
    for (uint32_t i = 0; n < BLOCK && i < n; i++)
        mark[i] = (uint8_t)(average_test(detector, at, x[i], lead[i], lag[i]) >> 31);
}

/* The detector is a constant in every call. */
INLINE void cfar_sieve_average_body(enum cfar_detector detector, const struct cfar_stretch *s, const float *x,
                                    const float *sum, uint8_t *mark)
{
    const struct threshold at = {
        .factor = (float)(s->alpha * SLACK / (detector == CFAR_CA ? 2 * s->cells : s->cells)),
        .least = (float)(s->least * SLACK),
    };
    if (detector == CFAR_CA)
        average_stretch(CFAR_CA, s, at, x, sum, mark);
    else if (detector == CFAR_GOCA)
        average_stretch(CFAR_GOCA, s, at, x, sum, mark);
    else
        average_stretch(CFAR_SOCA, s, at, x, sum, mark);
}

VARIANTS(, void, cfar_sieve_average,
         (enum cfar_detector detector, const struct cfar_stretch *stretch, const float *power, const float *sum,
          uint8_t *mark),
         (detector, stretch, power, sum, mark))

#define LAST_CODE 253 /* far above the codes of sums: 2^52 has 209 */

/* Exponent and two bits of the mantissa, from 1 for the power 1 on; 0 for everything below. */
INLINE uint8_t code_of(float x)
{
    const uint32_t one = 127 << 2, code = bits_of(x) >> 21;
    return (uint8_t)(code < one ? 0 : code - one > LAST_CODE ? LAST_CODE : code - one + 1);
}

INLINE void codes_block(const float *restrict x, uint8_t *restrict code)
{
    for (int j = 0; j < BLOCK; j++)
        code[j] = code_of(x[j]);
}

INLINE void cfar_sieve_codes_body(const float *x, uint32_t n, uint8_t *code)
{
    for (uint32_t b = 0; b < blocks_of(n); b++)
        codes_block(x + block_begin(b, n), code + block_begin(b, n));
    for (uint32_t i = 0; n < BLOCK && i < n; i++)
        code[i] = code_of(x[i]);
}

VARIANTS(, void, cfar_sieve_codes, (const float *power, uint32_t n, uint8_t *code), (power, n, code))

/* limit: cells of a code below it may be below x / alpha; 0 where x is not above the least. */
INLINE void limits_block(float inverse, float least, const float *restrict x, uint8_t *restrict limit)
{
    for (int j = 0; j < BLOCK; j++) {
        limit[j] = (uint8_t)((code_of(x[j] * inverse) + 1) & -(bits_of(least - x[j]) >> 31));
    }
}

/* Every machine has vectors of this width, and none compares wider bytes without taking them apart by hand. */
typedef uint8_t bytes __attribute__((vector_size(16)));

/*
 * For every cell of a block: how many of the cells at `places` <= 255 places of the window, one behind the
 * other, are not below the limit.
 */
INLINE void misses_at(const uint8_t *code, uint32_t places, const uint8_t *limit, uint8_t *miss)
{
    const uint32_t half = sizeof(bytes);
    bytes here, near_limit, far_limit, near = {0}, far = {0};
    memcpy(&near_limit, limit, half);
    memcpy(&far_limit, limit + half, half);
    for (uint32_t d = 0; d < places; d++) {
        memcpy(&here, code + d, half);
        near -= (bytes)(here >= near_limit); /* true is -1 */
        memcpy(&here, code + d + half, half);
        far -= (bytes)(here >= far_limit);
    }
    memcpy(miss, &near, half);
    memcpy(miss + half, &far, half);
}

/* False: none of the cells is allowed so many. */
INLINE bool add_misses(const uint8_t *restrict miss, uint16_t allowed, uint16_t *restrict total)
{
    uint16_t any = 0;
    for (int j = 0; j < BLOCK; j++) {
        total[j] = (uint16_t)(total[j] + miss[j]);
        any |= total[j] <= allowed;
    }
    return any;
}

#define PLACES 32 /* of the window between two looks at whether any cell of the block is still in the running */

/*
 * One window of the cells of a block; left off where none of them can be detected any more. Not looked at behind the
 * last place: guessing wrong what comes of it costs more than the other window does.
 */
INLINE void window_misses(const uint8_t *code, uint32_t cells, const uint8_t *limit, uint16_t allowed,
                          uint16_t *total)
{
    uint8_t miss[BLOCK];
    uint32_t left = cells;
    for (; left > PLACES; left -= PLACES, code += PLACES) {
        misses_at(code, PLACES, limit, miss);
        if (!add_misses(miss, allowed, total))
            return;
    }
    misses_at(code, left, limit, miss);
    add_misses(miss, allowed, total);
}

INLINE void marks_block(const uint16_t *restrict total, uint16_t allowed, uint8_t *restrict mark)
{
    for (int j = 0; j < BLOCK; j++)
        mark[j] = total[j] <= allowed;
}

INLINE void cfar_sieve_rank_body(const struct cfar_stretch *s, uint32_t rank, const float *x, const uint8_t *code,
                                 uint8_t *mark)
{
    const float inverse = (float)(1.0 / (s->alpha * SLACK)), floor = (float)(s->least * SLACK);
    const bool both = s->lead != s->lag;
    const uint32_t cells = s->cells;
    const uint16_t allowed = (uint16_t)((both ? 2 * cells : cells) - rank);
    const uint32_t n = s->end - s->begin;
    if (n < BLOCK)
        memset(mark + s->begin, 1, n);
    for (uint32_t b = 0; b < blocks_of(n); b++) {
        const uint32_t i = s->begin + block_begin(b, n);
        uint16_t total[BLOCK] = {0};
        uint8_t limit[BLOCK];
        limits_block(inverse, floor, x + i, limit);
        window_misses(code + ((int64_t)i + s->lead), cells, limit, allowed, total);
        if (both)
            window_misses(code + ((int64_t)i + s->lag), cells, limit, allowed, total);
        marks_block(total, allowed, mark + i);
    }
}

VARIANTS(, void, cfar_sieve_rank,
         (const struct cfar_stretch *stretch, uint32_t rank, const float *power, const uint8_t *code,
          uint8_t *mark),
         (stretch, rank, power, code, mark))
