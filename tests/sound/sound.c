/* SPDX-License-Identifier: MIT */
/* sound - see sound.h. */
#include "sound.h"

const struct sound_head_kind sound_heads[SOUND_HEADS] = {
    [SOUND_PING360] = {"ping360", 2.0, 25.0, AMPLITUDE_SQRT},
    [SOUND_MICRON] = {"micron", 3.0, 35.0, AMPLITUDE_LOG},
};

/* Place i of n from -1 to 1, both ends among them. */
static double across(int i, int n)
{
    return n > 1 ? 2.0 * i / (n - 1) - 1.0 : 0.0;
}

void sound_fan(enum sound_spread spread, double reach, int n_az, int n_el, struct dice *dice,
               struct sound_ray *ray)
{
    double sum = 0.0;
    for (int n = 0; n < n_az * n_el; n++) {
        const int i = n / n_el, k = n % n_el;
        struct sound_ray *r = &ray[n];
        if (spread == SOUND_EVEN) {
            r->az = across(i, n_az);
            r->el = across(k, n_el);
        } else if (spread == SOUND_STAGGERED) {
            r->az = (2.0 * i + 1.0) / n_az - 1.0;
            r->el = 2.0 * (k + (i * 3 % n_az + 0.5) / n_az) / n_el - 1.0;
        } else {
            r->az = (i + dice_uniform(dice)) / n_az * 2.0 - 1.0;
            r->el = (k + dice_uniform(dice)) / n_el * 2.0 - 1.0;
        }
        r->az *= reach;
        r->el *= reach;
        sum += r->weight = sound_pattern(r->az, r->el);
    }
    for (int n = 0; n < n_az * n_el; n++)
        ray[n].weight /= sum;
}

void sound_pulse(double complex *field, uint32_t n, uint32_t pulse)
{
    for (uint32_t i = n; i-- > 0;)
        for (uint32_t k = 1; k < pulse && k <= i; k++)
            field[i] += field[i - k];
}

double sound_texture(struct dice *dice, int looks)
{
    double sum = 0.0;
    for (int k = 0; k < looks; k++)
        sum -= log(dice_uniform(dice));
    return sum / looks;
}

double sound_count(enum amplitude_law law, double power, double one, double db_per_count)
{
    switch (law) {
    case AMPLITUDE_LINEAR:
        return one * sqrt(power);
    case AMPLITUDE_SQRT:
        return one * sqrt(sqrt(power));
    case AMPLITUDE_LOG:
        return one + 10.0 * log10(power + 1e-30) / db_per_count;
    case AMPLITUDE_POWER:
        break;
    }
    return one * power;
}
