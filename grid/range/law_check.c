/* SPDX-License-Identifier: MIT */
/*
 * law_check - keeps, for each octave of level, how often windows scattered by how much, and fits a line through the
 * medians: echoes in some of the windows do not move a median. Nothing here decides about echoes.
 */
#include "law_check.h"

#include <math.h>
#include <string.h>

#define LEAST_COUNT      8
#define ENOUGH           24   /* windows of a level before its median counts */
#define FORGET           4096 /* windows of a level: half of each step is forgotten, so that a change shows */
#define APART            2    /* octaves between the lowest and the highest level, at least */
#define COMPRESSED       0.45 /* slope; decibels have 0, recordings of them up to 0.4 */
#define PROPORTIONAL     0.65 /* pressure and power have 1, recordings of pressure from 0.7 on */
#define STEPS_PER_OCTAVE 8
#define LEAST_SCATTER    0.25

void law_check_clear(struct law_check *check)
{
    memset(check, 0, sizeof *check);
}

/* Octave of a mean count above LEAST_COUNT; LAW_CHECK_LEVELS and more: too loud, -1: too quiet. */
static int level_of(double mean)
{
    return mean < LEAST_COUNT ? -1 : (int)floor(log2(mean / LEAST_COUNT));
}

static int step_of(double scatter)
{
    const double step = STEPS_PER_OCTAVE * log2(fmax(scatter, LEAST_SCATTER) / LEAST_SCATTER);
    return (int)fmin(step, LAW_CHECK_STEPS - 1);
}

static void keep(struct law_check *check, int level, int step)
{
    if (check->n[level] == FORGET) {
        check->n[level] = 0;
        for (int i = 0; i < LAW_CHECK_STEPS; i++)
            check->n[level] = (uint16_t)(check->n[level] + (check->scatter[level][i] /= 2));
    }
    check->n[level]++;
    check->scatter[level][step]++;
}

void law_check_add(struct law_check *check, const struct profile *p)
{
    const struct profile_axis *a = p->axis;
    const uint32_t apart = (uint32_t)ceil(a->resolution_bins), behind = a->n > p->first ? a->n - p->first : 0;
    if (p->amplitude->sample_bytes != 1 || behind < a->window || a->window <= 2 * apart)
        return;
    const uint32_t begin = p->first + check->windows++ % (behind / a->window) * a->window;
    const uint8_t *v = (const uint8_t *)p->samples + begin;
    uint32_t sum = 0, difference = 0, useless = 0;
    for (uint32_t i = 0; i < a->window; i++) {
        sum += v[i];
        useless += v[i] == 0 || v[i] == 0xff || profile_blind(p, begin + i);
    }
    for (uint32_t i = apart; i < a->window; i++)
        difference += v[i] > v[i - apart] ? v[i] - v[i - apart] : v[i - apart] - v[i];
    const int level = level_of((double)sum / a->window);
    if (useless * 20 <= a->window && level >= 0 && level < LAW_CHECK_LEVELS)
        keep(check, level, step_of((double)difference / (a->window - apart)));
}

/* log2 of the median scatter of a level, but for a constant. */
static double median_of(const struct law_check *check, int level)
{
    uint32_t n = 0;
    int step = 0;
    while ((n += check->scatter[level][step]) * 2 < check->n[level])
        step++;
    return (double)step / STEPS_PER_OCTAVE;
}

double law_check_slope(const struct law_check *check)
{
    double n = 0.0, x = 0.0, y = 0.0, xx = 0.0, xy = 0.0;
    int lowest = LAW_CHECK_LEVELS, highest = -1;
    for (int level = 0; level < LAW_CHECK_LEVELS; level++) {
        if (check->n[level] < ENOUGH)
            continue;
        const double scatter = median_of(check, level);
        lowest = level < lowest ? level : lowest;
        highest = level;
        n += 1.0;
        x += level;
        y += scatter;
        xx += level * level;
        xy += level * scatter;
    }
    return highest - lowest < APART ? NAN : (n * xy - x * y) / (n * xx - x * x);
}

enum law_doubt law_check_doubt(const struct law_check *check, enum amplitude_law law)
{
    const double slope = law_check_slope(check);
    if ((law == AMPLITUDE_LINEAR || law == AMPLITUDE_POWER) && slope < COMPRESSED)
        return LAW_LOOKS_COMPRESSED;
    if (law == AMPLITUDE_LOG && slope > PROPORTIONAL)
        return LAW_LOOKS_LINEAR;
    return LAW_FITS;
}

const char *law_doubt_text(enum law_doubt doubt)
{
    switch (doubt) {
    case LAW_LOOKS_COMPRESSED:
        return "counts look like decibels or a root, taken as linear or as power: their scatter does not "
               "grow with their level";
    case LAW_LOOKS_LINEAR:
        return "counts look linear, taken as decibels: their scatter grows with their level";
    case LAW_FITS:
        break;
    }
    return NULL;
}
