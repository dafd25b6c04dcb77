/* SPDX-License-Identifier: MIT */
/*
 * cfar - sliding reference windows over a power profile. Averages come from prefix sums, order statistics from a
 * sorted copy of the window; both are exact. Floating point has no place here: after one cell of 1e8 a running float
 * sum reads a following stretch of ones as zero. Knows no metres, no amplitude law, no pings.
 */
#include "cfar.h"

#include <string.h>

typedef unsigned __int128 u128;

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

/* Lift the reference to its least and decide. */
static bool detects(const struct cfar *cfar, uint64_t x, struct cfar_reference *ref)
{
    const uint64_t least = ref->cells * cfar->reference_min;
    const uint64_t alpha = ref->one_sided ? cfar->alpha_one_q16 : cfar->alpha_q16;

    if (ref->sum < least)
        ref->sum = least;
    return ref->cells > 0 && x >= cfar->x_min && ((u128)x << 16) * ref->cells > (u128)alpha * ref->sum;
}

static struct cfar_reference choose_side(enum cfar_detector detector, uint64_t lead_sum, uint32_t lead_cells,
                                         uint64_t lag_sum, uint32_t lag_cells)
{
    const bool one_sided = lead_cells == 0 || lag_cells == 0;

    if (detector == CFAR_CA || one_sided)
        return (struct cfar_reference){lead_sum + lag_sum, lead_cells + lag_cells, one_sided};
    const u128 lead = (u128)lead_sum * lag_cells, lag = (u128)lag_sum * lead_cells;
    if (detector == CFAR_SOCA ? lead <= lag : lead >= lag)
        return (struct cfar_reference){lead_sum, lead_cells, false};
    return (struct cfar_reference){lag_sum, lag_cells, false};
}

/*
 * Cells begin .. end - 1, all with both sides complete: most of any beam, and so the loop that counts. The
 * detector is a constant in every call.
 */
static inline void run_inner(const struct cfar cfar, enum cfar_detector detector, const uint64_t *x,
                             uint32_t begin, uint32_t end, const uint64_t *prefix, uint8_t *mask,
                             struct cfar_reference *ref)
{
    const uint32_t near = cfar.guard, far = cfar.guard + cfar.n_side;

    for (uint32_t i = begin; i < end; i++) {
        const uint64_t lead = prefix[i - near] - prefix[i - far];
        const uint64_t lag = prefix[i + far + 1] - prefix[i + near + 1];
        if (detector == CFAR_CA)
            ref[i] = (struct cfar_reference){lead + lag, 2 * cfar.n_side, false};
        else if (detector == CFAR_SOCA)
            ref[i] = (struct cfar_reference){lead <= lag ? lead : lag, cfar.n_side, false};
        else
            ref[i] = (struct cfar_reference){lead >= lag ? lead : lag, cfar.n_side, false};
        mask[i] = detects(&cfar, x[i], &ref[i]);
    }
}

static void run_average(const struct cfar *cfar, const uint64_t *x, uint32_t n, uint64_t *prefix, uint8_t *mask,
                        struct cfar_reference *ref)
{
    const uint64_t reach = (uint64_t)cfar->guard + cfar->n_side;
    const uint32_t begin = n > 2 * reach ? (uint32_t)reach : n, end = n > 2 * reach ? (uint32_t)(n - reach) : n;

    prefix[0] = 0;
    for (uint32_t i = 0; i < n; i++)
        prefix[i + 1] = prefix[i] + x[i];

    if (cfar->detector == CFAR_CA)
        run_inner(*cfar, CFAR_CA, x, begin, end, prefix, mask, ref);
    else if (cfar->detector == CFAR_SOCA)
        run_inner(*cfar, CFAR_SOCA, x, begin, end, prefix, mask, ref);
    else
        run_inner(*cfar, CFAR_GOCA, x, begin, end, prefix, mask, ref);

    for (uint32_t i = 0; i < n; i = i + 1 == begin ? end : i + 1) {
        const struct sides s = sides_of(cfar, n, i);
        ref[i] = choose_side(cfar->detector, prefix[s.lead.end] - prefix[s.lead.begin], span_cells(s.lead),
                             prefix[s.lag.end] - prefix[s.lag.begin], span_cells(s.lag));
        mask[i] = detects(cfar, x[i], &ref[i]);
    }
}

/* The cells of both windows in order of size. */
struct sorted {
    uint64_t *cell;
    uint32_t n;
};

/* Index of the first cell that is not smaller than value. */
static uint32_t sorted_find(const struct sorted *s, uint64_t value)
{
    uint32_t lo = 0, hi = s->n;

    while (lo < hi) {
        const uint32_t mid = lo + (hi - lo) / 2;
        if (s->cell[mid] < value)
            lo = mid + 1;
        else
            hi = mid;
    }
    return lo;
}

static void sorted_insert(struct sorted *s, uint64_t value)
{
    const uint32_t at = sorted_find(s, value);

    memmove(s->cell + at + 1, s->cell + at, (s->n - at) * sizeof *s->cell);
    s->cell[at] = value;
    s->n++;
}

static void sorted_remove(struct sorted *s, uint64_t value)
{
    const uint32_t at = sorted_find(s, value);

    s->n--;
    memmove(s->cell + at, s->cell + at + 1, (s->n - at) * sizeof *s->cell);
}

static uint32_t lesser(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

static uint32_t greater(uint32_t a, uint32_t b)
{
    return a > b ? a : b;
}

/* Bring the window's cells from the span it had to the span it has now. */
static void sorted_move(struct sorted *s, const uint64_t *x, struct span was, struct span is)
{
    for (uint32_t i = was.begin; i < lesser(was.end, is.begin); i++)
        sorted_remove(s, x[i]);
    for (uint32_t i = greater(was.begin, is.end); i < was.end; i++)
        sorted_remove(s, x[i]);
    for (uint32_t i = is.begin; i < lesser(is.end, was.begin); i++)
        sorted_insert(s, x[i]);
    for (uint32_t i = greater(is.begin, was.end); i < is.end; i++)
        sorted_insert(s, x[i]);
}

static void run_rank(const struct cfar *cfar, const uint64_t *x, uint32_t n, uint64_t *work, uint8_t *mask,
                     struct cfar_reference *ref)
{
    struct sorted sorted = {.cell = work};
    struct sides was = {{0, 0}, {0, 0}};

    for (uint32_t i = 0; i < n; i++) {
        const struct sides is = sides_of(cfar, n, i);
        sorted_move(&sorted, x, was.lead, is.lead);
        sorted_move(&sorted, x, was.lag, is.lag);
        was = is;

        ref[i] = (struct cfar_reference){0};
        if (sorted.n > 0) {
            const uint64_t whole = 2 * (uint64_t)cfar->n_side;
            uint64_t k = ((uint64_t)cfar->rank * sorted.n + whole - 1) / whole;
            k = k < 1 ? 1 : k > sorted.n ? sorted.n : k;
            ref[i].sum = sorted.cell[k - 1];
            ref[i].cells = 1;
            ref[i].one_sided = span_cells(is.lead) == 0 || span_cells(is.lag) == 0;
        }
        mask[i] = detects(cfar, x[i], &ref[i]);
    }
}

size_t cfar_work_size(uint32_t n)
{
    return ((size_t)n + 1) * sizeof(uint64_t);
}

void cfar_run(const struct cfar *cfar, const uint64_t *x, uint32_t n, void *work, uint8_t *mask,
              struct cfar_reference *ref)
{
    if (cfar->detector == CFAR_OS)
        run_rank(cfar, x, n, work, mask, ref);
    else
        run_average(cfar, x, n, work, mask, ref);
}
