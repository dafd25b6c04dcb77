/* SPDX-License-Identifier: MIT */
/*
 * otsu - maximises J = sum of s^2 / w over the classes (w pixels whose values sum to s), which differs from the
 * variance between classes by a constant only. Doubles find the partitions that can be the best one,
 * integers decide among them.
 */
#include "otsu.h"

#include "u128.h"

/* Doubles are wrong by some 1e-15 of J; what is not within this share of the best is not the best. */
#define SURELY_LESS (1.0 - 1e-9)

/* The populated values in order, with running sums: class [a, b) has pixels[b] - pixels[a] pixels. */
struct values {
    int n;
    uint8_t value[256];
    uint64_t pixels[257];
    uint64_t sum[257];   /* of the values */
    double centred[257]; /* of the values less the mean, so that J is of the size of the variance */
};

static void values_of(const uint64_t count[256], struct values *v)
{
    v->n = 0;
    v->pixels[0] = v->sum[0] = 0;
    for (unsigned i = 0; i < 256; i++) {
        if (count[i] == 0)
            continue;
        v->value[v->n] = (uint8_t)i;
        v->pixels[v->n + 1] = v->pixels[v->n] + count[i];
        v->sum[v->n + 1] = v->sum[v->n] + count[i] * i;
        v->n++;
    }
    const uint64_t total = v->pixels[v->n], mean = total ? (v->sum[v->n] + total / 2) / total : 0;
    for (int i = 0; i <= v->n; i++)
        v->centred[i] = (double)((int64_t)v->sum[i] - (int64_t)(v->pixels[i] * mean));
}

/* Share of J of the class [a, b). */
static inline double part(const struct values *v, int a, int b)
{
    const double s = v->centred[b] - v->centred[a];
    return s * s / (double)(v->pixels[b] - v->pixels[a]);
}

/* ---- exact comparison ---- */

/* J as whole + num / den with num < 3 den. */
struct exact {
    struct u128 whole, num, den;
};

static void add_part(struct exact *j, const struct values *v, int a, int b)
{
    const uint64_t s = v->sum[b] - v->sum[a], w = v->pixels[b] - v->pixels[a];
    struct u128 rest;
    j->whole = u128_sum(j->whole, u128_divide(u128_product(s, s), (struct u128){0, w}, &rest));
    j->num = u128_sum(u128_times(j->num, w), u128_times(j->den, rest.lo));
    j->den = u128_times(j->den, w);
}

static bool is_zero(struct u128 a)
{
    return a.hi == 0 && a.lo == 0;
}

static bool is_same(struct u128 a, struct u128 b)
{
    return a.hi == b.hi && a.lo == b.lo;
}

/* Sign of a / b - c / d, by the continued fractions of both: nothing overflows. b and d > 0. */
static int compare_fractions(struct u128 a, struct u128 b, struct u128 c, struct u128 d)
{
    for (int sign = 1;; sign = -sign) {
        struct u128 a_rest, c_rest;
        const struct u128 p = u128_divide(a, b, &a_rest), q = u128_divide(c, d, &c_rest);
        if (!is_same(p, q))
            return u128_less(q, p) ? sign : -sign;
        if (is_zero(a_rest) || is_zero(c_rest))
            return is_same(a_rest, c_rest) ? 0 : is_zero(a_rest) ? -sign : sign;
        a = b;
        b = a_rest;
        c = d;
        d = c_rest;
    }
}

/* J of the partition [0, i) [i, k) [k, n); i == k: of the two classes [0, k) [k, n). */
static struct exact exact_of(const struct values *v, int i, int k)
{
    struct exact j = {.den = {0, 1}};
    struct u128 rest;
    add_part(&j, v, 0, i);
    if (i < k)
        add_part(&j, v, i, k);
    add_part(&j, v, k, v->n);
    j.whole = u128_sum(j.whole, u128_divide(j.num, j.den, &rest));
    j.num = rest;
    return j;
}

static bool is_greater(const struct exact *a, const struct exact *b)
{
    if (!is_same(a->whole, b->whole))
        return u128_less(b->whole, a->whole);
    return compare_fractions(a->num, a->den, b->num, b->den) > 0;
}

/* ---- two classes ---- */

bool otsu_two(const uint64_t count[256], uint8_t *t)
{
    struct values v;
    double best = -1.0, j[256];
    int found = 0;
    values_of(count, &v);
    if (v.n < 2)
        return false;
    for (int k = 1; k < v.n; k++) {
        j[k] = part(&v, 0, k) + part(&v, k, v.n);
        best = j[k] > best ? j[k] : best;
    }
    struct exact most = {0};
    for (int k = 1; k < v.n; k++) {
        if (j[k] < best * SURELY_LESS)
            continue;
        const struct exact here = exact_of(&v, k, k);
        if (found == 0 || is_greater(&here, &most)) {
            most = here;
            found = k;
        }
    }
    *t = v.value[found - 1];
    return true;
}

/* ---- three classes ---- */

/*
 * For each end k of the middle class in [from, to) the best J over its begin i, which lies in [least, most]. The best
 * i never falls with k (the quadrangle inequality of within-class variances), so halving k halves the search for i.
 */
static void best_begins(const struct values *v, int from, int to, int least, int most, double j[256])
{
    if (from >= to)
        return;
    const int k = (from + to) / 2;
    int best = least;
    j[k] = -1.0;
    for (int i = least; i <= most && i < k; i++) {
        const double here = part(v, 0, i) + part(v, i, k);
        if (here > j[k]) {
            j[k] = here;
            best = i;
        }
    }
    j[k] += part(v, k, v->n);
    best_begins(v, from, k, least, best, j);
    best_begins(v, k + 1, to, best, most, j);
}

bool otsu_three(const uint64_t count[256], uint8_t t[2])
{
    struct values v;
    double best = -1.0, j[256];
    int begin = 0, end = 0;
    values_of(count, &v);
    if (v.n < 3)
        return false;
    best_begins(&v, 2, v.n, 1, v.n - 2, j);
    for (int k = 2; k < v.n; k++)
        best = j[k] > best ? j[k] : best;
    struct exact most = {0};
    for (int k = 2; k < v.n; k++) {
        if (j[k] < best * SURELY_LESS)
            continue;
        const double last = part(&v, k, v.n);
        for (int i = 1; i < k; i++) {
            if (part(&v, 0, i) + part(&v, i, k) + last < best * SURELY_LESS)
                continue;
            const struct exact here = exact_of(&v, i, k);
            if (end == 0 || is_greater(&here, &most) || (i < begin && !is_greater(&most, &here))) {
                most = here;
                begin = i;
                end = k;
            }
        }
    }
    t[0] = v.value[begin - 1];
    t[1] = v.value[end - 1];
    return true;
}
