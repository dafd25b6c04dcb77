/* SPDX-License-Identifier: MIT */
/*
 * cfar_factor - false-alarm probability of CA, GOCA, SOCA and OS, and Newton's method for its inverse. Everything is
 * held as ln P, so that probabilities far below the smallest double are as good as any. Knows no samples.
 */
#include "cfar_factor.h"

#include <math.h>

/* ln P at one alpha, and its derivative there. */
struct law {
    double ln_p;
    double slope;
};

/*
 * Regularised incomplete beta function I(x; a, b) of integer a, b >= 1 with y = 1 - x given, as a sum of positive
 * terms: its logarithm, and *ratio = dI/dx / I. The sum is rescaled on the way: binomials of large windows exceed
 * any double.
 */
static double ln_beta(double x, double y, uint32_t a, uint32_t b, double *ratio)
{
    const double big = 0x1p800;
    double term = 1.0, sum = 1.0, scale = 0.0;
    for (uint32_t j = 0; j + 1 < b; j++) {
        term *= ((double)a + j) / (j + 1.0) * y;
        sum += term;
        if (sum > big) {
            term /= big;
            sum /= big;
            scale += 800.0;
        }
    }
    *ratio = ((double)a + b - 1.0) * (term / sum) / x;
    const double ln_x = y < 0.5 ? log1p(-y) : log(x);
    return a * ln_x + log(sum) + scale * 0.69314718055994530942;
}

static struct law law_ca(double m, double alpha)
{
    return (struct law){.ln_p = -m * log1p(alpha / m), .slope = -m / (m + alpha)};
}

static struct law law_os(uint32_t m, uint32_t k, double alpha)
{
    struct law law = {0};
    for (uint32_t i = 0; i < k; i++) {
        const double left = (double)(m - i);
        law.ln_p -= log1p(alpha / left);
        law.slope -= 1.0 / (left + alpha);
    }
    return law;
}

/*
 * One branch of GOCA or SOCA: the probability that the side of n cells is the chosen one and the cell under test
 * exceeds it; m cells on the other side.
 */
static struct law law_branch(bool smaller, uint32_t n, uint32_t m, double alpha)
{
    const double d = (double)n + m + alpha;
    const double x = (n + alpha) / d, y = m / d;
    double ratio;
    const double ln_i = smaller ? ln_beta(x, y, n, m, &ratio) : ln_beta(y, x, m, n, &ratio);
    const struct law alone = law_ca(n, alpha);
    const double dx = (smaller ? m : -(double)m) / (d * d);
    return (struct law){.ln_p = alone.ln_p + ln_i, .slope = alone.slope + ratio * dx};
}

static struct law law_two_sided(bool smaller, uint32_t n1, uint32_t n2, double alpha)
{
    const struct law a = law_branch(smaller, n1, n2, alpha);
    const struct law b = law_branch(smaller, n2, n1, alpha);
    const double top = fmax(a.ln_p, b.ln_p);
    const double pa = exp(a.ln_p - top), pb = exp(b.ln_p - top);
    return (struct law){.ln_p = top + log(pa + pb), .slope = (pa * a.slope + pb * b.slope) / (pa + pb)};
}

static bool sizes_ok(enum cfar_detector detector, uint32_t n_lead, uint32_t n_lag, uint32_t k)
{
    if (n_lead > CFAR_MAX_CELLS || n_lag > CFAR_MAX_CELLS || n_lead + n_lag == 0)
        return false;
    switch (detector) {
    case CFAR_CA:
    case CFAR_GOCA:
    case CFAR_SOCA:
        return true;
    case CFAR_OS:
        return k >= 1 && k <= n_lead + n_lag;
    }
    return false;
}

static struct law law_of(enum cfar_detector detector, uint32_t n_lead, uint32_t n_lag, uint32_t k, double alpha)
{
    if (detector == CFAR_OS)
        return law_os(n_lead + n_lag, k, alpha);
    if (detector == CFAR_CA || n_lead == 0 || n_lag == 0)
        return law_ca((double)n_lead + n_lag, alpha);
    return law_two_sided(detector == CFAR_SOCA, n_lead, n_lag, alpha);
}

bool cfar_ln_pfa(enum cfar_detector detector, uint32_t n_lead, uint32_t n_lag, uint32_t k, double alpha,
                 double *ln_pfa)
{
    if (!sizes_ok(detector, n_lead, n_lag, k) || !(alpha >= 0.0 && alpha <= 1e300))
        return false;
    *ln_pfa = law_of(detector, n_lead, n_lag, k, alpha).ln_p;
    return true;
}

bool cfar_alpha(enum cfar_detector detector, uint32_t n_lead, uint32_t n_lag, uint32_t k, double pfa,
                double *alpha)
{
    if (!sizes_ok(detector, n_lead, n_lag, k) || !(pfa > 0.0 && pfa < 1.0))
        return false;

    /* ln P is convex and falls from 0, so Newton's method from 0 climbs to the root and never passes it. */
    const double want = log(pfa);
    double at = 0.0;
    for (int i = 0; i < 200; i++) {
        const struct law law = law_of(detector, n_lead, n_lag, k, at);
        const double step = (want - law.ln_p) / law.slope;
        at += step;
        if (!(fabs(step) > 1e-13 * at))
            break;
    }
    *alpha = fmax(at, 0.0);
    return true;
}
