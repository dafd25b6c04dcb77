/* SPDX-License-Identifier: MIT */
/* hearable - see hearable.h. The sum of a constant and circular normal noise: S. O. Rice 1945, here as a mixture
 * of gamma distributions, which needs no Bessel function. */
#include "hearable.h"

#include "tests/sound/sound.h"

/* How the references answer: independent cells of equal power, of the first the coherent share. */
static const struct {
    int cells;
    double coherent;
} answer[DRAWN_CLASSES] = {
    [DRAWN_WALL] = {3, 0.15}, [DRAWN_PILE] = {1, 0.5}, [DRAWN_NET] = {3, 0.0}, [DRAWN_LINE] = {1, 0.5}};

double hearable_below(double coherent, double diffuse, double x)
{
    const double a = coherent / diffuse, b = x / diffuse;
    if (a > 300.0 || b > 600.0) /* near normal, or far out */
        return 0.5 * erfc((coherent + diffuse - x) / sqrt(2.0 * diffuse * (diffuse + 2.0 * coherent)));
    double poisson = exp(-a), term = exp(-b), gamma = 1.0 - term, sum = 0.0;
    for (int j = 0; j < 2000; j++) {
        sum += poisson * gamma;
        poisson *= a / (j + 1);
        term *= b / (j + 1);
        gamma -= term;
        if (j > a && poisson < 1e-12)
            break;
    }
    return fmin(fmax(sum, 0.0), 1.0);
}

/* P(power > x) of K-distributed speckle of mean 1: exponential power whose mean is gamma distributed. */
static double textured_above(int shape, double x)
{
    const double step = 0.01, end = 30.0;
    double sum = 0.0;
    for (double u = step / 2.0; u < end; u += step)
        sum += exp((shape - 1) * log(u) - u - lgamma(shape) - x * shape / u) * step;
    return sum;
}

static double textured_quantile(int shape)
{
    double low = 1.0, high = 200.0;
    for (int step = 0; step < 40; step++) {
        const double x = 0.5 * (low + high);
        *(textured_above(shape, x) > HEARABLE_FALSE ? &low : &high) = x;
    }
    return low;
}

struct hearable_margins hearable_margins_of(int texture)
{
    struct hearable_margins out = {.textured = texture > 0 ? textured_quantile(texture) : -log(HEARABLE_FALSE)};
    for (int c = 0; c < DRAWN_CLASSES; c++) {
        double low = 1e-4, high = 10.0;
        for (int step = 0; step < 60; step++) {
            const double x = sqrt(low * high);
            double missed = hearable_below(answer[c].coherent, 1.0 - answer[c].coherent, x);
            for (int k = 1; k < answer[c].cells; k++)
                missed *= -expm1(-x);
            *(missed > 1.0 - HEARABLE_P ? &high : &low) = x;
        }
        out.margin[c] = 1.0 / low;
    }
    return out;
}

struct hearable_background hearable_background_at(const struct insonify *in,
                                                  const struct hearable_margins *margins,
                                                  const struct insonified *beam, uint32_t i, double raised)
{
    const uint32_t p = in->world->pulse_bins, first = i + 1 > p ? i + 1 - p : 0;
    double even = p * ((double)beam->mean[CAUSE_RING][i] + (double)beam->mean[CAUSE_NOISE][i] * raised);
    double textured = p * (double)beam->mean[CAUSE_VOLUME][i];
    for (uint32_t k = first; k <= i; k++) {
        even += (double)beam->mean[CAUSE_OWN_PARTS][k];
        textured += (double)beam->mean[CAUSE_PLANE][k];
    }
    const double most = -log(HEARABLE_FALSE) * even + margins->textured * textured;
    return (struct hearable_background){even + textured,
                                        drawn_power_above(in->world, drawn_count(in->world, most))};
}

/* By which range target t is heard; *peak: the most that comes back from a cell of it. */
static double heard_by(const struct insonify *in, const struct hearable_margins *margins,
                       const struct insonified *beam, unsigned t, double raised, double *peak)
{
    const uint32_t p = in->world->pulse_bins;
    const struct insonify_glint *glint = &beam->glint[t];
    const uint32_t begin = glint->power > 0.0 && glint->bin < beam->first[t] ? glint->bin : beam->first[t];
    const uint32_t end = glint->power > 0.0 && glint->bin >= beam->end[t] ? glint->bin + 1 : beam->end[t];
    double missed = 1.0, by_m = INFINITY;
    *peak = 0.0;
    for (uint32_t i = begin; i < end; i += p) {
        double echo = 0.0;
        for (uint32_t k = i; k < i + p && k < end; k++)
            echo += (double)beam->target[t][k];
        const double coherent = glint->bin >= i && glint->bin < i + p ? glint->power : 0.0;
        const uint32_t at = i + p - 1 < in->world->bins ? i + p - 1 : in->world->bins - 1;
        const struct hearable_background back = hearable_background_at(in, margins, beam, at, raised);
        *peak = fmax(*peak, echo + coherent);
        if (isfinite(back.over) && echo + coherent > 0.1 * back.over)
            missed *= hearable_below(coherent, echo + back.mean, back.over);
        if (missed <= 1.0 - HEARABLE_P && !isfinite(by_m))
            by_m = (i + 0.5 * p) * in->bin_m;
    }
    return by_m;
}

/* By which range what the planes send from within half power is heard over all else. */
static double planes_heard_by(const struct insonify *in, const struct insonified *beam, double raised)
{
    const uint32_t p = in->world->pulse_bins;
    double missed = 1.0;
    if (!(beam->plane_m < in->world->range_m) || beam->plane_m > beam->solid_m)
        return INFINITY;
    for (uint32_t i = (uint32_t)(beam->plane_m / in->bin_m); i + p <= in->world->bins; i += p) {
        double echo = 0.0, back = 0.0;
        for (uint32_t k = i; k < i + p; k++) {
            echo += (double)beam->mean[CAUSE_PLANE][k];
            back += (double)beam->mean[CAUSE_RING][k] + (double)beam->mean[CAUSE_NOISE][k] * raised +
                    (double)beam->mean[CAUSE_VOLUME][k] + (double)beam->mean[CAUSE_OWN_PARTS][k];
        }
        const double over = drawn_power_above(in->world, drawn_count(in->world, -log(HEARABLE_FALSE) * back));
        if (isfinite(over) && echo > 0.1 * over)
            missed *= hearable_below(0.0, echo + back, over);
        if (missed <= 1.0 - HEARABLE_P)
            return (i + 0.5 * p) * in->bin_m;
    }
    return INFINITY;
}

void hearable_beam(const struct insonify *in, const struct hearable_margins *margins,
                   const struct insonified *beam, double raised, bool heard, struct hearable *out)
{
    const struct drawn_world *w = in->world;
    const double through = beam->shadowed ? sound_power(w->shadow_db) : 1.0;
    for (int k = 0; k < HEARABLE_CELLS; k++) {
        const double r_m = (k + 0.5) * w->range_m / HEARABLE_CELLS;
        const uint32_t i = (uint32_t)(r_m / in->bin_m);
        const uint32_t begin = (uint32_t)(k * w->range_m / HEARABLE_CELLS / in->bin_m);
        const double over = heard ? hearable_background_at(in, margins, beam, i, raised).over : INFINITY;
        const double over_begin = heard ? hearable_background_at(in, margins, beam, begin, raised).over : INFINITY;
        const double wall_db = drawn_wall_db(w, r_m), wall = in->wall[i] * through;
        out->over[k] = (float)fmax(over, over_begin);
        out->cell[k] = 0;
        for (int c = 0; c < DRAWN_CLASSES; c++) {
            const double level = wall * sound_power(drawn_reference_db(w, (enum drawn_class)c, r_m) - wall_db);
            if (level > margins->margin[c] * over)
                out->cell[k] |= (uint8_t)(1u << c);
        }
    }
    out->plane_m = planes_heard_by(in, beam, raised);
    for (int c = 0; c < DRAWN_CLASSES; c++)
        out->target_m[c] = INFINITY;
    for (unsigned t = 0; t < w->targets; t++) {
        double peak;
        out->by_m[t] = isfinite(beam->near_m[t]) ? heard_by(in, margins, beam, t, raised, &peak) : INFINITY;
        if (!isfinite(out->by_m[t]))
            continue;
        for (int c = 0; c < DRAWN_CLASSES; c++)
            if (peak >= sound_power(drawn_reference_db(w, (enum drawn_class)c, beam->near_m[t])) * through)
                out->target_m[c] = fmin(out->target_m[c], out->by_m[t]);
    }
}
