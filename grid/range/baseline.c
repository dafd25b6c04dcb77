/* SPDX-License-Identifier: MIT */
#include "baseline.h"

#include <math.h>

#include "variants.h"

#define BEAMS_OF_PING 16
#define FIRST_STEPS   64          /* counts by which the second beam may move a median; the k-th by 1/k of that */
#define MEAN          1.442695041 /* of exponential power, over its median: 1 / ln 2 */

size_t baseline_bytes(uint32_t max_bins)
{
    return profile_blocks(max_bins) * sizeof(double) +
           ((size_t)max_bins * (sizeof(double) + sizeof(int32_t)) + 7) / 8 * 8;
}

void baseline_init(struct baseline *b, void *memory, uint32_t max_bins)
{
    b->level = memory;
    b->calm = b->level + max_bins;
    b->median = (int32_t *)(b->calm + profile_blocks(max_bins));
    baseline_clear(b);
}

void baseline_clear(struct baseline *b)
{
    b->beams = 0;
    b->due = BASELINE_LEAST;
}

INLINE int32_t toward(int32_t median, int32_t value, int32_t step)
{
    int32_t off = value - median;
    off = off < step ? off : step;
    return median + (off > -step ? off : -step);
}

/* Counts of a sample are 256 units of the median. */
INLINE void move_block(int32_t *restrict median, const uint8_t *restrict samples, int32_t step)
{
#pragma GCC unroll 8
    for (int j = 0; j < PROFILE_BLOCK; j++)
        median[j] = toward(median[j], samples[j] << 8, step);
}

INLINE void move8_body(int32_t *restrict median, const uint8_t *restrict samples, uint32_t n, int32_t step)
{
    uint32_t i = 0;
    for (; i + PROFILE_BLOCK <= n; i += PROFILE_BLOCK)
        move_block(median + i, samples + i, step);
    for (; i < n; i++)
        median[i] = toward(median[i], samples[i] << 8, step);
}

VARIANTS(static, void, move8,
         (int32_t *restrict median, const uint8_t *restrict samples, uint32_t n, int32_t step),
         (median, samples, n, step))

static void learn_beam(struct baseline *b, const struct ping *ping, uint32_t beam)
{
    const uint32_t n = ping->n_bins;
    const uint8_t *samples = (const uint8_t *)ping->samples + (size_t)beam * n * ping->sample_bytes;
    const int32_t count = ping->sample_bytes == 1 ? 256 : 65536; /* of 255 */
    const int32_t first = FIRST_STEPS * count / (int32_t)(b->beams < 256 ? b->beams + 1 : 257);
    /* the first beam sets the medians, wherever they were */
    const int32_t step = b->beams == 0 ? INT32_MAX / 2 : first > count / 4 ? first : count / 4;

    if (ping->sample_bytes == 1)
        move8(b->median, samples, n, step);
    else
        for (uint32_t i = 0; i < n; i++)
            b->median[i] = toward(b->median[i], ((const uint16_t *)(const void *)samples)[i] << 8, step);
    b->beams += b->beams < UINT32_MAX / 2;
}

/* Of the medians; each is needed twice. */
static void powers(const struct baseline *b, const struct amplitude *law, uint32_t n, double *power)
{
    for (uint32_t i = 0; i < n; i++)
        power[i] = (double)(int64_t)amplitude_of(law, (uint32_t)(b->median[i] + 255) >> 8);
}

static void refresh_levels(struct baseline *b, const struct profile_axis *axis, const double *power)
{
    const uint32_t n = axis->n, half = axis->half;
    double sum = 0.0;
    for (uint32_t i = 0; i < half && i < n; i++)
        sum += power[i];
    for (uint32_t begin = 0; begin < n; begin += PROFILE_BLOCK) {
        double calm = INFINITY;
        for (uint32_t i = begin; i < n && i < begin + PROFILE_BLOCK; i++) {
            sum += i + half < n ? power[i + half] : 0.0;
            sum -= i > half ? power[i - half - 1] : 0.0;
            b->level[i] = MEAN * sum;
            calm = b->level[i] < calm ? b->level[i] : calm;
        }
        b->calm[begin / PROFILE_BLOCK] = calm;
    }
}

void baseline_learn(struct baseline *b, const struct ping *ping, const struct profile_axis *axis,
                    const struct amplitude *law, double *room)
{
    const uint32_t beams = ping->n_beams < BEAMS_OF_PING ? ping->n_beams : BEAMS_OF_PING;
    for (uint32_t k = 0; k < beams; k++)
        learn_beam(b, ping, (k * ping->n_beams / beams + ping->seq) % ping->n_beams);
    if (b->beams < b->due)
        return;
    powers(b, law, axis->n, room);
    refresh_levels(b, axis, room);
    b->due = b->beams + BASELINE_LEAST;
}
