/* SPDX-License-Identifier: MIT */
/*
 * median - by exchanges of the smaller and the greater. First the bins of every column are sorted, once for all the
 * windows they are in; then the columns of each window. Loops have a fixed length and no branch in them, so that
 * compilers make vectors of them.
 */
#include "median.h"

#include <string.h>

#define BLOCK 32                    /* bins per turn of the inner loops */
#define EDGE  (MEDIAN_MAX_SIZE / 2) /* bins before the first and after the last */

static uint32_t padded(uint32_t n)
{
    return (n + 2 * EDGE + 2 * BLOCK - 1) / BLOCK * BLOCK;
}

size_t median_work_size(uint32_t n)
{
    return (size_t)MEDIAN_MAX_SIZE * padded(n);
}

/* ---- rows with edges ---- */

static uint32_t clamp(int64_t i, uint32_t n)
{
    return i < 0 ? 0 : i >= (int64_t)n ? n - 1 : (uint32_t)i;
}

/* to[EDGE + i] = bin i of the row, shifted; to[0] and beyond are its edges. */
static void lay_row(const struct median_row *row, uint32_t n, uint8_t *to)
{
    const int64_t first = -(int64_t)row->shift - EDGE; /* bin that comes to to[0] */
    const uint32_t length = n + 2 * EDGE;
    const uint32_t before = first < 0 ? (uint32_t)(-first < length ? -first : length) : 0;
    const int64_t rest = (int64_t)n - (first > 0 ? first : 0);
    const uint32_t inside = rest <= 0 ? 0 : (uint32_t)(rest < length - before ? rest : length - before);
    memset(to, row->bin[0], before);
    if (inside)
        memcpy(to + before, row->bin + clamp(first, n), inside);
    memset(to + before + inside, row->bin[n - 1], length - before - inside);
}

/*
 * A missing row becomes a pattern of zeros and 255s that repeats every k bins, so that every window holds the same
 * number of either; with `zeros` of them in the missing rows together the middle of all k * k is the lower median of
 * what is there. nth: it is the nth of the missing rows.
 */
static void lay_pattern(unsigned k, unsigned nth, unsigned zeros, uint32_t length, uint8_t *to)
{
    for (uint32_t i = 0; i < length; i++)
        to[i] = nth * k + i % k < zeros ? 0 : UINT8_MAX;
}

static void lay_rows(unsigned k, const struct median_row *row, uint32_t n, uint8_t *const to[])
{
    unsigned there = 0, missing = 0;
    for (unsigned r = 0; r < k; r++)
        there += row[r].bin != NULL;
    const unsigned zeros = (k * k - 1) / 2 - (k * there - 1) / 2;
    for (unsigned r = 0; r < k; r++) {
        if (row[r].bin)
            lay_row(&row[r], n, to[r]);
        else
            lay_pattern(k, missing++, zeros, n + 2 * EDGE, to[r]);
    }
}

/* ---- exchanges ---- */

static inline uint8_t lesser(uint8_t a, uint8_t b)
{
    return a < b ? a : b;
}

static inline uint8_t greater(uint8_t a, uint8_t b)
{
    return a > b ? a : b;
}

static inline void order(uint8_t *v, unsigned i, unsigned j)
{
    const uint8_t a = v[i], b = v[j];
    v[i] = lesser(a, b);
    v[j] = greater(a, b);
}

static inline uint8_t middle(uint8_t a, uint8_t b, uint8_t c)
{
    return greater(lesser(a, b), lesser(greater(a, b), c));
}

static inline void sort_five(uint8_t *v)
{
    order(v, 0, 1);
    order(v, 3, 4);
    order(v, 2, 4);
    order(v, 2, 3);
    order(v, 1, 4);
    order(v, 0, 3);
    order(v, 0, 2);
    order(v, 1, 3);
    order(v, 1, 2);
}

/* ---- 3 x 3 ---- */

static void sort_columns_3(uint8_t *restrict a, uint8_t *restrict b, uint8_t *restrict c)
{
    for (int i = 0; i < BLOCK; i++) {
        const uint8_t x = lesser(a[i], b[i]), y = greater(a[i], b[i]), z = c[i];
        a[i] = lesser(x, z);
        b[i] = greater(x, lesser(y, z));
        c[i] = greater(y, z);
    }
}

/* The middle of nine is the middle of: the greatest of the least, the middle of the middles,
 * the least of the greatest. */
static void windows_3(const uint8_t *restrict a, const uint8_t *restrict b, const uint8_t *restrict c,
                      uint8_t *restrict out)
{
    for (int i = 0; i < BLOCK; i++) {
        const uint8_t low = greater(greater(a[i], a[i + 1]), a[i + 2]);
        const uint8_t mid = middle(b[i], b[i + 1], b[i + 2]);
        const uint8_t high = lesser(lesser(c[i], c[i + 1]), c[i + 2]);
        out[i] = middle(low, mid, high);
    }
}

/* ---- 5 x 5 ---- */

static void sort_columns_5(uint8_t *restrict a, uint8_t *restrict b, uint8_t *restrict c, uint8_t *restrict d,
                           uint8_t *restrict e)
{
    for (int i = 0; i < BLOCK; i++) {
        uint8_t v[5] = {a[i], b[i], c[i], d[i], e[i]};
        sort_five(v);
        a[i] = v[0];
        b[i] = v[1];
        c[i] = v[2];
        d[i] = v[3];
        e[i] = v[4];
    }
}

/* Least of v[from .. from + n) to its front and greatest to its end, 3 <= n <= 8. No loop: compilers leave one in when
 * they make vectors of the windows, which is then fifty times slower. */
static inline void part_ends(uint8_t *v, unsigned from, unsigned n)
{
    const unsigned last = from + n - 1;
    order(v, from, last);
    if (n > 2) {
        order(v, from, from + 1);
        order(v, from + 1, last);
    }
    if (n > 3) {
        order(v, from, from + 2);
        order(v, from + 2, last);
    }
    if (n > 4) {
        order(v, from, from + 3);
        order(v, from + 3, last);
    }
    if (n > 5) {
        order(v, from, from + 4);
        order(v, from + 4, last);
    }
    if (n > 6) {
        order(v, from, from + 5);
        order(v, from + 5, last);
    }
    if (n > 7) {
        order(v, from, from + 6);
        order(v, from + 6, last);
    }
}

/* Middle of 13: of any 8 neither the least nor the greatest can be it; these go and another one comes. */
static inline uint8_t middle_of_13(uint8_t *v)
{
    part_ends(v, 0, 8);
    v[7] = v[8];
    part_ends(v, 1, 7);
    v[7] = v[9];
    part_ends(v, 2, 6);
    v[7] = v[10];
    part_ends(v, 3, 5);
    v[7] = v[11];
    part_ends(v, 4, 4);
    v[7] = v[12];
    return middle(v[5], v[6], v[7]);
}

/*
 * With columns and rows of the window sorted, the element in row i and column j (from 1) has i * j - 1 others not
 * above it and (6 - i) * (6 - j) - 1 not below: 6 elements are too low for the middle, 6 too high, 13 remain.
 */
static void windows_5(const uint8_t *restrict a, const uint8_t *restrict b, const uint8_t *restrict c,
                      const uint8_t *restrict d, const uint8_t *restrict e, uint8_t *restrict out)
{
    for (int i = 0; i < BLOCK; i++) {
        uint8_t p[5] = {a[i], a[i + 1], a[i + 2], a[i + 3], a[i + 4]};
        uint8_t q[5] = {b[i], b[i + 1], b[i + 2], b[i + 3], b[i + 4]};
        uint8_t r[5] = {c[i], c[i + 1], c[i + 2], c[i + 3], c[i + 4]};
        uint8_t s[5] = {d[i], d[i + 1], d[i + 2], d[i + 3], d[i + 4]};
        uint8_t t[5] = {e[i], e[i + 1], e[i + 2], e[i + 3], e[i + 4]};
        sort_five(p);
        sort_five(q);
        sort_five(r);
        sort_five(s);
        sort_five(t);
        uint8_t v[13] = {p[3], p[4], q[2], q[3], q[4], r[1], r[2], r[3], s[0], s[1], s[2], t[0], t[1]};
        out[i] = middle_of_13(v);
    }
}

void median_filter(unsigned k, const struct median_row *row, uint32_t n, void *work, uint8_t *out)
{
    const uint32_t length = padded(n);
    uint8_t *r[MEDIAN_MAX_SIZE], last[BLOCK];
    for (unsigned i = 0; i < MEDIAN_MAX_SIZE; i++)
        r[i] = (uint8_t *)work + (size_t)i * length;
    lay_rows(k, row, n, r);
    for (uint32_t i = 0; i < length; i += BLOCK) {
        if (k == 3)
            sort_columns_3(r[0] + i, r[1] + i, r[2] + i);
        else
            sort_columns_5(r[0] + i, r[1] + i, r[2] + i, r[3] + i, r[4] + i);
    }
    for (uint32_t i = 0; i < n; i += BLOCK) {
        uint8_t *to = n - i < BLOCK ? last : out + i;
        if (k == 3) /* its windows begin one bin later */
            windows_3(r[0] + i + 1, r[1] + i + 1, r[2] + i + 1, to);
        else
            windows_5(r[0] + i, r[1] + i, r[2] + i, r[3] + i, r[4] + i, to);
        if (to == last)
            memcpy(out + i, last, n - i);
    }
}
