/* SPDX-License-Identifier: MIT */
/*
 * cfar - sliding reference windows over a power profile. Averages come from prefix sums, order statistics from a
 * counting and selecting; both are exact. Floating point has no place here: after one cell of 1e8 a running float
 * sum reads a following stretch of ones as zero. Knows no metres, no amplitude law, no pings.
 */
#include "cfar.h"

#include <math.h>
#include <string.h>

#include "cfar_sieve.h"
#include "u128.h"

struct span {
    uint32_t begin, end; /* cells begin .. end - 1 */
};

/* The sides of one cell as the edge policy leaves them; an unused side is empty. */
struct sides {
    struct span lead, lag;
};

static uint32_t span_cells(struct span s)
{
    return s.end - s.begin;
}

static struct sides sides_of(const struct cfar *cfar, uint32_t n, uint32_t i)
{
    const uint32_t side = cfar->n_side, guard = cfar->guard;
    struct sides s = {{0, 0}, {n, n}};
    if (i > guard)
        s.lead = (struct span){i - guard > side ? i - guard - side : 0, i - guard};
    if (n - i > (uint64_t)guard + 1) {
        const uint32_t begin = i + guard + 1;
        s.lag = (struct span){begin, n - begin > side ? begin + side : n};
    }
    const bool lead_cut = span_cells(s.lead) < side, lag_cut = span_cells(s.lag) < side;
    if (lead_cut && cfar->edge != CFAR_SHRINK)
        s.lead.begin = s.lead.end;
    if (lag_cut && cfar->edge != CFAR_SHRINK)
        s.lag.end = s.lag.begin;
    if ((lead_cut || lag_cut) && cfar->edge == CFAR_BOTH) {
        s.lead.begin = s.lead.end;
        s.lag.end = s.lag.begin;
    }
    return s;
}

/*
 * Working memory. Sums and numbers are those of the cells from held->begin to i - 1 that are not excluded; only those
 * near marked cells are needed, and made.
 */
struct work {
    struct span *held; /* in which sum and cells are right, for i = held->begin .. held->end */
    uint64_t *sum;     /* [n + 1]; OS: room for the cells of a window */
    uint32_t *cells;   /* [n + 1]; not filled where nothing is excluded */
    float *power;      /* [n] for the sieve: the cells, 0 where excluded ... */
    float *room;       /* ... room for sums of windows, in the place of sum ... */
    uint8_t *code;     /* ... OS: codes of the cells, in the same place */
};

size_t cfar_work_size(uint32_t n)
{
    return sizeof(struct span) + ((size_t)n + 1) * (sizeof(uint64_t) + sizeof(uint32_t) + sizeof(float));
}

static struct work work_of(const struct cfar_profile *p)
{
    struct work w = {.held = p->work};
    w.sum = (void *)(w.held + 1);
    w.cells = (void *)(w.sum + p->n + 1);
    w.power = (void *)(w.cells + p->n + 1);
    w.room = (void *)w.sum;
    w.code = (void *)w.sum;
    return w;
}

static void hold_none_from(const struct work *w, uint32_t begin)
{
    *w->held = (struct span){begin, begin};
    w->sum[begin] = 0;
    w->cells[begin] = 0;
}

/* Make sums and numbers right in a span of cells. Spans that follow each other upward cost what is new of them. */
static void hold(const struct cfar_profile *p, struct span s)
{
    const struct work w = work_of(p);
    if (s.begin < w.held->begin || s.begin > w.held->end)
        hold_none_from(&w, s.begin);
    uint64_t sum = w.sum[w.held->end];
    uint32_t cells = w.cells[w.held->end], i = w.held->end;
    if (!p->excluded) {
        for (; i < s.end; i++)
            w.sum[i + 1] = sum += p->x[i];
    } else {
        for (; i < s.end; i++) {
            w.sum[i + 1] = sum += p->excluded[i] ? 0 : p->x[i];
            w.cells[i + 1] = cells += !p->excluded[i];
        }
    }
    w.held->end = i;
}

static struct cfar_reference average_of(const struct cfar *cfar, const struct cfar_profile *p, struct sides s)
{
    const struct work prefix = work_of(p);
    hold(p, (struct span){s.lead.begin, s.lag.end});
    const uint64_t lead_sum = prefix.sum[s.lead.end] - prefix.sum[s.lead.begin];
    const uint64_t lag_sum = prefix.sum[s.lag.end] - prefix.sum[s.lag.begin];
    const uint32_t *cells = prefix.cells;
    const uint32_t lead_cells = p->excluded ? cells[s.lead.end] - cells[s.lead.begin] : span_cells(s.lead);
    const uint32_t lag_cells = p->excluded ? cells[s.lag.end] - cells[s.lag.begin] : span_cells(s.lag);
    const bool one_sided = lead_cells == 0 || lag_cells == 0;

    if (cfar->detector == CFAR_CA || one_sided)
        return (struct cfar_reference){lead_sum + lag_sum, lead_cells + lag_cells, one_sided};
    const struct u128 lead = u128_product(lead_sum, lag_cells), lag = u128_product(lag_sum, lead_cells);
    if (cfar->detector == CFAR_SOCA ? !u128_less(lag, lead) : !u128_less(lead, lag))
        return (struct cfar_reference){lead_sum, lead_cells, false};
    return (struct cfar_reference){lag_sum, lag_cells, false};
}

/* OS: which of n cells in order of size, 1 .. n. */
static uint32_t rank_among(const struct cfar *cfar, uint32_t n)
{
    const uint64_t whole = 2 * (uint64_t)cfar->n_side;
    const uint64_t k = ((uint64_t)cfar->rank * n + whole - 1) / whole;
    return k < 1 ? 1 : k > n ? n : (uint32_t)k;
}

/* The span's cells behind those already gathered; returns how many there are now. */
static uint32_t gather_cells(const struct cfar_profile *p, struct span s, uint64_t *cell, uint32_t n)
{
    for (uint32_t i = s.begin; i < s.end; i++)
        if (!p->excluded || !p->excluded[i])
            cell[n++] = p->x[i];
    return n;
}

/* The cell that would have index k if the n cells were in order of size; moves them. Hoare's selection. */
static uint64_t select_cell(uint64_t *cell, uint32_t n, uint32_t k)
{
    uint32_t lo = 0, hi = n - 1;
    while (lo < hi) {
        const uint64_t pivot = cell[lo + (hi - lo) / 2];
        uint32_t i = lo, j = hi;
        for (;;) {
            while (cell[i] < pivot)
                i++;
            while (cell[j] > pivot)
                j--;
            if (i >= j)
                break;
            const uint64_t swapped = cell[i];
            cell[i++] = cell[j];
            cell[j--] = swapped;
        }
        if (k <= j)
            hi = j;
        else
            lo = j + 1;
    }
    return cell[k];
}

static struct cfar_reference rank_of(const struct cfar *cfar, const struct cfar_profile *p, struct sides s)
{
    uint64_t *cell = p->work;
    const uint32_t n_lead = gather_cells(p, s.lead, cell, 0), n = gather_cells(p, s.lag, cell, n_lead);
    if (n == 0)
        return (struct cfar_reference){0};
    return (struct cfar_reference){select_cell(cell, n, rank_among(cfar, n) - 1), 1, n_lead == 0 || n_lead == n};
}

struct cfar_reference cfar_reference_at(const struct cfar *cfar, const struct cfar_profile *profile, uint32_t i)
{
    const struct sides s = sides_of(cfar, profile->n, i);
    struct cfar_reference ref =
        cfar->detector == CFAR_OS ? rank_of(cfar, profile, s) : average_of(cfar, profile, s);
    const uint64_t least = ref.cells * cfar->reference_min;

    if (ref.sum < least)
        ref.sum = least;
    return ref;
}

static uint32_t cells_left(const struct cfar_profile *p, struct span s)
{
    uint32_t n = span_cells(s);
    for (uint32_t i = s.begin; p->excluded && i < s.end; i++)
        n -= p->excluded[i] != 0;
    return n;
}

/* How many of the span's cells are below a power. */
static uint32_t count_below(const struct cfar_profile *p, struct span s, uint64_t power)
{
    uint32_t n = 0;
    for (uint32_t i = s.begin; i < s.end; i++)
        n += p->x[i] < power;
    for (uint32_t i = s.begin; p->excluded && i < s.end; i++)
        n -= p->excluded[i] && p->x[i] < power;
    return n;
}

/* The least power of which alpha_q16 / 65536 times is not below x. */
static uint64_t power_not_below(uint64_t x, uint64_t alpha_q16)
{
    if (alpha_q16 == 0)
        return UINT64_MAX;
    if (x < (uint64_t)1 << 47) /* a long division costs as much as the rest */
        return (x << 16) / alpha_q16 + ((x << 16) % alpha_q16 != 0);
    struct u128 rest;
    const struct u128 least = u128_divide(u128_sum(u128_product(x, 65536), (struct u128){0, alpha_q16 - 1}),
                                          (struct u128){0, alpha_q16}, &rest);
    return least.hi == 0 ? least.lo : UINT64_MAX;
}

/* A cell exceeds alpha times the k-th smallest one where at least k cells are below the cell / alpha. */
static bool detects_by_rank(const struct cfar *cfar, const struct cfar_profile *p, uint32_t i)
{
    const struct sides s = sides_of(cfar, p->n, i);
    const uint32_t n_lead = cells_left(p, s.lead), n = n_lead + cells_left(p, s.lag);
    const uint64_t alpha = n_lead == 0 || n_lead == n ? cfar->alpha_one_q16 : cfar->alpha_q16;
    if (n == 0 || !u128_less(u128_product(alpha, cfar->reference_min), u128_product(p->x[i], 65536)))
        return false;
    const uint64_t limit = power_not_below(p->x[i], alpha);
    return count_below(p, s.lead, limit) + count_below(p, s.lag, limit) >= rank_among(cfar, n);
}

static bool detects(const struct cfar *cfar, const struct cfar_profile *p, uint32_t i)
{
    if (p->x[i] < cfar->x_min || (p->excluded && p->excluded[i]))
        return false;
    if (cfar->detector == CFAR_OS)
        return detects_by_rank(cfar, p, i);
    const struct cfar_reference ref = cfar_reference_at(cfar, p, i);
    const uint64_t alpha = ref.one_sided ? cfar->alpha_one_q16 : cfar->alpha_q16;
    return ref.cells > 0 &&
           u128_less(u128_product(alpha, ref.sum), u128_product(p->x[i], (uint64_t)ref.cells << 16));
}

/* Returns the sums of windows; NULL for OS. */
static const float *prepare_sieve(const struct cfar *cfar, const struct cfar_profile *p)
{
    const struct work w = work_of(p);
    cfar_sieve_powers(p->x, p->n, w.power);
    for (uint32_t i = 0; p->excluded && i < p->n; i++)
        w.power[i] = p->excluded[i] ? 0.0f : w.power[i];
    if (cfar->detector == CFAR_OS)
        cfar_sieve_codes(w.power, p->n, w.code);
    else if (p->n >= cfar->n_side)
        return cfar_sieve_sums(w.power, p->n, cfar->n_side, w.room);
    return NULL;
}

enum windows { LEAD = 1, LAG = 2, BOTH = LEAD | LAG };

/*
 * Mark what may be detected among these cells, all of which have these windows complete. An excluded cell stands in its
 * windows as a silent one: that lowers the threshold, and so does the smaller of the two factors.
 */
static void sieve(const struct cfar *cfar, const struct cfar_profile *p, struct span cells, enum windows windows,
                  const float *sum, uint8_t *mask)
{
    const struct work w = work_of(p);
    const bool both = windows == BOTH;
    const bool smaller = cfar->alpha_q16 < cfar->alpha_one_q16;
    const uint64_t alpha_q16 = (p->excluded ? smaller : both) ? cfar->alpha_q16 : cfar->alpha_one_q16;
    if (cells.begin >= cells.end)
        return;
    if (alpha_q16 == 0) {
        memset(mask + cells.begin, 1, cells.end - cells.begin);
        return;
    }
    const double alpha = (double)alpha_q16 / 65536.0;
    const double least =
        fmax(alpha * (double)cfar->reference_min, cfar->x_min > 0 ? (double)cfar->x_min - 1.0 : 0.0);
    const int32_t before = -(int32_t)(cfar->guard + cfar->n_side), behind = (int32_t)cfar->guard + 1;
    const struct cfar_stretch stretch = {.begin = cells.begin,
                                         .end = cells.end,
                                         .lead = windows & LEAD ? before : behind,
                                         .lag = windows & LAG ? behind : before,
                                         .cells = cfar->n_side,
                                         .alpha = alpha,
                                         .least = least};
    if (cfar->detector == CFAR_OS)
        cfar_sieve_rank(&stretch, rank_among(cfar, both ? 2 * cfar->n_side : cfar->n_side), w.power, w.code, mask);
    else
        cfar_sieve_average(cfar->detector, &stretch, w.power, sum, mask);
}

/* Mark every cell that may be detected, from one edge of the profile to the other. */
static void sieve_all(const struct cfar *cfar, const struct cfar_profile *p, uint8_t *mask)
{
    const float *sum = prepare_sieve(cfar, p);
    const uint64_t reach = (uint64_t)cfar->guard + cfar->n_side;
    const uint32_t n = p->n, head = reach < n ? (uint32_t)reach : n, tail = n - head;
    const uint32_t block = head < CFAR_SIEVE_BLOCK ? CFAR_SIEVE_BLOCK : head;
    const uint32_t edge = block < tail ? block : tail; /* whole blocks at the ends; the middle writes over them */
    memset(mask, 0, n);
    if (cfar->edge == CFAR_SHRINK) {
        memset(mask, 1, head);
        memset(mask + tail, 1, head);
    } else if (cfar->edge == CFAR_FULL) {
        sieve(cfar, p, (struct span){0, edge}, LAG, sum, mask);
        sieve(cfar, p, (struct span){n - edge, n}, LEAD, sum, mask);
    }
    sieve(cfar, p, (struct span){head, tail}, BOTH, sum, mask);
}

void cfar_run(const struct cfar *cfar, const struct cfar_profile *profile, uint8_t *mask)
{
    const uint32_t n = profile->n;
    if (n == 0)
        return;
    const struct work work = work_of(profile);
    sieve_all(cfar, profile, mask);
    hold_none_from(&work, 0);
    for (uint8_t *at = memchr(mask, 1, n); at; at = memchr(at, 1, (size_t)(mask + n - at))) {
        *at = detects(cfar, profile, (uint32_t)(at - mask));
        at++;
    }
}
