/* SPDX-License-Identifier: MIT */
/*
 * extract - the order of the stages: profile (counts to power of resolution cells), end of the ring-down, CFAR,
 * reflections, free water; and what is usual for this sensor. Knows no map.
 */
#include "extract.h"

#include <math.h>
#include <string.h>

#include "amplitude.h"
#include "cfar.h"
#include "choice.h"
#include "hearing.h"
#include "law_check.h"
#include "order.h"
#include "own_ring.h"
#include "reflection.h"
#include "ring_down.h"
#include "setting.h"
#include "survivors.h"
#include "u128.h"

/* A group this share (1.5 dB) below the contrast of an echo is none, but ends what is called free. */
#define DOUBTFUL 0.7

#define MAX_FACTORS 64 /* more independent cells than this change the threshold by less than 0.1 dB */

/* A cell where it usually is quiet is this share (3 dB) of an echo's level: nearly one. */
#define NEARLY 0.5

/* The loudest cell of the ring-down is so many times (5 dB) the usual one: something near answers with the head. */
#define RINGS 3

/* Of a ping's beam with the earliest end of the ring-down (a cell), of that with the quietest one (power of the loudest
 * cell), and of that where it is loud for the shortest time (a cell). */
struct of_ping {
    uint64_t ring_down, ring_power, ring_loud;
    uint64_t choice_ring; /* as of the setting */
    double echo_power;    /* of the loudest first echo; 0: none */
    bool strong;          /* one is as loud as a target that must be detected */
    float choice_to_m;    /* the least that the profile of a choice shows to be free; INFINITY: none was judged */
};

struct extract {
    struct extract_conf conf;
    uint32_t max_bins;
    double contrast; /* min_contrast_db as a ratio */
    /* [i]: threshold over reference, times 65536, for i + 1 independent cells on both sides, or on one */
    uint64_t both_q16[MAX_FACTORS], one_q16[MAX_FACTORS];

    struct amplitude amplitude; /* of the last ping */
    double amplitude_db;        /* per count, as it was prepared */
    struct settings settings;   /* under this law */
    struct setting *now;        /* of the last ping; NULL: none yet */
    struct law_check law_check; /* under this law */
    enum hearing_doubt doubt;   /* what the ping lacks: unless it hears, it frees no water */
    struct hearing_alarm alarm;
    struct hearing_prints prints;
    struct {
        double power, full; /* of a resolution cell: the target's, and at full scale; 0: no beam was judged yet */
        uint64_t bins;      /* of the cell */
        bool shown;         /* follows from the sonar's echoes */
        bool noisy;         /* no range is usually quieter than the bottom that is looked for */
    } reference;            /* of the last ping */
    float choice_to_m;      /* of the last ping with a choice that was judged; 0: none yet */

    uint64_t *cell; /* power summed over the resolution cell around each bin */
    uint64_t *bits; /* of the cells in each block */
    uint64_t *work;
    uint8_t *mask;
    uint8_t *blind; /* cells that hold a masked bin */
};

void extract_defaults(struct extract_conf *conf)
{
    *conf = (struct extract_conf){
        .detector = CFAR_SOCA,
        .false_alarm = 1e-3,
        .window_m = 0.4,
        .guard_m = 0.1,
        .rank = 0.75,
        .floor_counts = 8,
        .min_contrast_db = 14.0,
        .no_echo = EXTRACT_HEARD,
        .target_db = 0.0,
        .bottom_db = 15.0,
        .minimum_range_m = 0.75,
        .ring_down_m = -1.0,
        .law = EXTRACT_LAW_OF_PING,
    };
}

/* ---- start ---- */

static bool in_range(double value, double lo, double hi, const char *key, struct fault *fault)
{
    if (value >= lo && value <= hi)
        return true;
    return fault_set(fault, "extract: %s is %g, allowed is %g to %g", key, value, lo, hi);
}

static bool conf_ok(const struct extract_conf *c, struct fault *fault)
{
    return in_range(c->detector, CFAR_CA, CFAR_OS, "detector", fault) &&
           in_range(c->order, EXTRACT_SAFE, EXTRACT_PAPER, "order", fault) &&
           in_range(c->false_alarm, 1e-12, 0.1, "false_alarm", fault) &&
           in_range(c->window_m, 1e-3, 100.0, "window", fault) &&
           in_range(c->guard_m, 0.0, 10.0, "guard", fault) && in_range(c->rank, 1e-3, 1.0, "rank", fault) &&
           in_range(c->floor_counts, 0.0, 65535.0, "floor", fault) &&
           in_range(c->min_contrast_db, 0.0, 100.0, "min_contrast", fault) &&
           in_range(c->no_echo, EXTRACT_MINIMUM, EXTRACT_RANGE, "no_echo", fault) &&
           in_range(c->target_db, 0.0, 60.0, "target", fault) &&
           in_range(c->bottom_db, -1.0, 60.0, "bottom", fault) &&
           in_range(c->minimum_range_m, 0.0, 1000.0, "minimum_range", fault) &&
           in_range(c->ring_down_m, -1e9, 100.0, "ring_down", fault) &&
           in_range(c->law, EXTRACT_LAW_OF_PING, AMPLITUDE_LOG, "amplitude", fault) &&
           (c->law != AMPLITUDE_LOG ||
            in_range(c->db_per_count, 1e-6, AMPLITUDE_MAX_DB / 255.0, "decibels_per_count", fault));
}

static uint64_t to_q16(double alpha)
{
    return (uint64_t)fmin(floor(alpha * 65536.0 + 0.5), 0x1p62);
}

static void solve_factors(struct extract *e)
{
    const struct extract_conf *c = &e->conf;
    for (uint32_t n = 1; n <= MAX_FACTORS; n++) {
        const uint32_t k_both = (uint32_t)ceil(c->rank * 2.0 * n), k_one = (uint32_t)ceil(c->rank * n);
        double both = 1.0, one = 1.0;
        cfar_alpha(c->detector, n, n, k_both, c->false_alarm, &both);
        cfar_alpha(c->detector, n, 0, k_one, c->false_alarm, &one);
        e->both_q16[n - 1] = to_q16(both);
        e->one_q16[n - 1] = to_q16(one);
    }
}

/* Where the arrays lie behind the struct. */
struct layout {
    size_t cell, bits, work, mask, blind, settings, end;
};

static struct layout layout_for(uint32_t max_bins)
{
    struct layout l;
    l.cell = (sizeof(struct extract) + _Alignof(max_align_t) - 1) / _Alignof(max_align_t) * _Alignof(max_align_t);
    l.bits = l.cell + max_bins * sizeof(uint64_t);
    l.work = l.bits + profile_blocks(max_bins) * sizeof(uint64_t);
    l.mask = l.work + cfar_work_size(max_bins);
    l.blind = l.mask + max_bins;
    l.settings = (l.blind + max_bins + 7) / 8 * 8;
    l.end = l.settings + settings_bytes(max_bins);
    return l;
}

static uint32_t limit_bins(uint32_t max_bins)
{
    return max_bins < PING_MAX_BINS ? max_bins : PING_MAX_BINS;
}

size_t extract_size(uint32_t max_bins)
{
    return layout_for(limit_bins(max_bins)).end;
}

struct extract *extract_init(void *mem, const struct extract_conf *conf, uint32_t max_bins, struct fault *fault)
{
    if (!conf_ok(conf, fault))
        return NULL;

    const struct layout l = layout_for(limit_bins(max_bins));
    struct extract *e = mem;
    uint8_t *base = mem;
    memset(mem, 0, l.end);
    e->conf = *conf;
    e->max_bins = limit_bins(max_bins);
    e->contrast = pow(10.0, conf->min_contrast_db / 10.0);
    e->cell = (void *)(base + l.cell);
    e->bits = (void *)(base + l.bits);
    e->work = (void *)(base + l.work);
    e->mask = base + l.mask;
    e->blind = base + l.blind;
    settings_init(&e->settings, base + l.settings, e->max_bins);
    solve_factors(e);
    return e;
}

/* ---- one beam ---- */

/* Tables are made anew only when the device changes its ways. False when they make no sense. */
static bool amplitude_for(struct extract *e, const struct ping *p)
{
    const bool override = e->conf.law != EXTRACT_LAW_OF_PING;
    const enum amplitude_law law = override ? (enum amplitude_law)e->conf.law : (enum amplitude_law)p->law;
    const double db = override ? e->conf.db_per_count : (double)p->db_per_count;
    if (e->amplitude.sample_bytes == p->sample_bytes && e->amplitude.law == law &&
        (law != AMPLITUDE_LOG || e->amplitude_db == db))
        return true;
    if (!amplitude_init(&e->amplitude, law, p->sample_bytes, db))
        return false;
    e->amplitude_db = db;
    law_check_clear(&e->law_check);
    settings_clear(&e->settings);
    return true;
}

/* False when the ping's range axis makes no sense. What is usual on another axis is not on this one. */
static bool axis_for(struct extract *e, const struct ping *p)
{
    struct profile_axis axis;
    if (!profile_axis_of(&axis, p, e->conf.window_m, e->conf.guard_m, e->max_bins))
        return false;
    e->now = settings_for(&e->settings, &axis, p->gain);
    return true;
}

/* The detector for the n cells behind the ring-down; false when they are too few to judge. */
static bool detector_for(const struct extract *e, const struct profile *p, struct cfar *cfar)
{
    const struct profile_axis *a = p->axis;
    const uint32_t n = a->n - p->first;
    if (n < 2 * a->guard + 3)
        return false;
    const uint32_t room = (n - 1) / 2 - a->guard; /* so that every cell has one complete side */
    const uint32_t window = a->window < room ? a->window : room;
    const double independent = fmin(fmax(window / a->resolution_bins, 1.0), MAX_FACTORS);
    const uint32_t factor = (uint32_t)independent - 1;
    *cfar = (struct cfar){
        .detector = e->conf.detector,
        .edge = CFAR_FULL,
        .n_side = window,
        .guard = a->guard,
        .rank = (uint32_t)ceil(e->conf.rank * 2.0 * window),
        .alpha_q16 = e->both_q16[factor],
        .alpha_one_q16 = e->one_q16[factor],
        .reference_min = p->floor_power,
    };
    return true;
}

/* No cell is louder than the threshold over the floor, which is the least that there is, and none is saturated. */
static bool is_quiet(const struct profile *p, const struct cfar *cfar)
{
    const uint64_t alpha_q16 = cfar->alpha_q16 < cfar->alpha_one_q16 ? cfar->alpha_q16 : cfar->alpha_one_q16;
    const struct u128 product = u128_product(alpha_q16, p->floor_power);
    const uint64_t threshold = product.hi >> 16 ? UINT64_MAX : product.hi << 48 | product.lo >> 16;
    const uint64_t full = p->full_power - 1;
    const uint32_t n = p->axis->n;
    return profile_next_above(p, p->first, n, threshold < full ? threshold : full) == n;
}

/* What the reflections of a profile show beside echoes. */
struct shown {
    struct reflection first; /* of the nearest echo */
    double power;            /* of the nearest reflection, whatever the clean-up says of it; 0: none */
};

/* The reflections of the profile become echoes; what is nearly one ends the free water. */
static void enter_reflections(const struct extract *e, const struct profile *p, const struct detection *d,
                              struct beam_echoes *out, struct shown *shown)
{
    const double unit = (double)(UINT64_C(1) << p->shift);
    struct reflection r;
    for (uint32_t i = p->first; out->n < ECHOES_PER_BEAM && reflection_next(p, d, i, &r); i = r.last + 1) {
        if (r.contrast >= e->contrast * DOUBTFUL && out->n == 0)
            reflection_reach_back(p, d, &r);
        if (r.contrast >= e->contrast && shown->power <= 0.0)
            shown->power = r.power;
        if (r.contrast >= e->contrast && !r.lowest_only) {
            if (out->n == 0)
                shown->first = r;
            r.echo.flags = r.power * unit < d->loud ? ECHO_FAINT : 0;
            r.echo.level = isfinite(r.contrast) ? (float)(r.power * unit / d->wall) : INFINITY;
            out->echo[out->n++] = r.echo;
        } else if (r.contrast >= e->contrast * DOUBTFUL && out->n == 0)
            out->free_to_m = fminf(out->free_to_m, r.echo.near_m);
    }
}

/* A resolution cell that holds a masked bin says nothing of its own. */
static const uint8_t *blind_cells(struct extract *e, const uint8_t *masked)
{
    const uint32_t n = e->now->axis.n, half = e->now->axis.half;
    uint32_t until = 0; /* cells before it hold the last masked bin */
    for (uint32_t i = 0; i < n + half; i++) {
        if (i < n && masked[i])
            until = i + 2 * half + 1;
        if (i >= half)
            e->blind[i - half] = i < until;
    }
    return e->blind;
}

/* A mask over the ring-down may reach a little farther than it is found to: up to a guard length counts as such. */
static void pass_mask_of_ring(struct profile *p)
{
    uint32_t end = p->first;
    while (end < p->axis->n && profile_blind(p, end))
        end++;
    if (end - p->first <= p->axis->guard)
        p->first = end;
}

/* Cells from the usual end of the ring-down to the end of this beam's; none where it ends as usual. */
struct late_ring {
    uint32_t begin, end;
};

/* Set p->first. */
static struct late_ring end_ring_down(const struct extract *e, struct profile *p, struct of_ping *of_ping)
{
    uint64_t usual;
    if (e->conf.ring_down_m >= 0.0) {
        p->first = ring_down_at(p, e->conf.ring_down_m);
        return (struct late_ring){0, 0};
    }
    const uint32_t found = ring_down_found(p);
    of_ping->ring_down = found < of_ping->ring_down ? found : of_ping->ring_down;
    p->first = found;
    if (!usual_get(&e->now->ring_down, &usual) || found <= usual + p->axis->guard)
        return (struct late_ring){0, 0};
    if (e->conf.learn_ring_down) {
        const uint32_t learnt = ring_down_at(p, profile_m(p, (double)usual));
        p->first = learnt < found ? learnt : found;
    }
    return (struct late_ring){(uint32_t)usual, found};
}

/* The loudest cell of the ring-down, masked or not: a template that was learnt beside a wall holds the wall. */
static uint64_t ring_power(const struct profile *p)
{
    uint64_t loudest = 0;
    for (uint32_t i = 0; i < p->first; i++)
        if (p->cell[i] > loudest)
            loudest = p->cell[i];
    return loudest;
}

/* The cell behind the last one of the ring-down that is within 3 dB of its loudest. */
static uint32_t ring_loud_until(const struct profile *p, uint64_t loudest)
{
    uint32_t until = p->first;
    while (until > 0 && p->cell[until - 1] < loudest / 2)
        until--;
    return until;
}

/*
 * Something near rings with the head, and may hide all that is behind: where it usually is quiet, a cell is nearly as
 * loud as an echo over the baseline; or the ring-down itself is louder than the head, or as loud for longer. What the
 * vehicle's own echoes explain is nothing new, and masked.
 */
static bool is_near_shadow(const struct extract *e, const struct profile *p, const struct baseline *b,
                           struct late_ring late, struct of_ping *of_ping)
{
    const uint64_t ring = ring_power(p);
    const uint32_t loud_until = ring_loud_until(p, ring);
    const uint64_t own = own_ring_power(p);
    const uint32_t own_until = own_ring_loud_until(p, own);
    uint64_t usual;
    of_ping->ring_power = ring < of_ping->ring_power ? ring : of_ping->ring_power;
    of_ping->ring_loud = loud_until < of_ping->ring_loud ? loud_until : of_ping->ring_loud;
    if (usual_get(&e->now->ring_power, &usual) && ring / RINGS > (usual > own ? usual : own))
        return true;
    if (usual_get(&e->now->ring_loud, &usual) &&
        loud_until > (usual > own_until ? usual : own_until) + p->axis->guard)
        return true;
    for (uint32_t i = late.begin; b && i < late.end; i++)
        if ((double)p->cell[i] >= NEARLY * e->contrast * own_ring_usual(p, b, i))
            return true;
    return false;
}

/* Powers of a resolution cell that obstacles exceed. */
struct levels {
    double prior;  /* a wall where no sonar is set up to show less */
    double wall;   /* the same, or a wall as this sonar has shown them where that is more */
    double target; /* the target */
    double bottom; /* a bottom, on average over a window; INFINITY: none is looked for */
};

/* How far the water is free off the axis, of cells begin .. where it is on it. */
static void find_free_aside(const struct extract *e, const struct profile *p, const struct baseline *b,
                            uint32_t begin, double detectable, struct beam_echoes *out)
{
    const double end = fmax(0.0, floor(((double)out->free_to_m - p->axis->r0) / p->axis->dr));
    const struct free_water on_axis = {begin, end < p->axis->n ? (uint32_t)end : p->axis->n};
    const struct free_water_aside aside = free_water_aside(p, b, on_axis, detectable, e->contrast);
    out->off_axis = true;
    out->side_to_m = fminf(out->free_to_m, (float)profile_m(p, aside.side_end));
    out->edge_from_m = (float)profile_m(p, aside.edge.begin);
    out->edge_to_m = fminf(out->free_to_m, (float)profile_m(p, aside.edge.end));
    out->surface_from_m = (float)profile_m(p, aside.surface.begin);
    out->surface_to_m = fminf(out->free_to_m, (float)profile_m(p, aside.surface.end));
}

/* How far the beam shows free water. Needs the raw cells. */
static void find_free_interval(const struct extract *e, const struct profile *p, const struct baseline *b,
                               const struct levels *levels, const struct reflection *first,
                               struct beam_echoes *out)
{
    const bool bold = e->conf.no_echo == EXTRACT_RANGE, deaf = bold && out->n == 0;
    uint32_t begin = p->first;
    if (b && e->conf.ring_down_m < 0.0)
        begin = free_water_begin(p, b, levels->target);
    const bool rings = b && free_water_rings_on(p, b, begin);
    if (((!b || e->doubt == HEARING_NOT_LEARNT) && !bold) || rings) {
        out->free_to_m = 0.0f;
        out->hides = rings ? BEAM_HIDES_RING : BEAM_HIDES_NOTHING;
        return;
    }
    if (begin < p->first && profile_blind(p, begin)) /* a mask over the ring-down */
        begin = p->first;
    if (begin < p->axis->deaf)
        begin = p->axis->deaf;
    if (begin >= p->axis->n) {
        out->free_to_m = 0.0f;
        return;
    }
    struct free_water w =
        free_water_find(p, b, begin, deaf ? INFINITY : levels->target, e->contrast, out->n ? first->near : 0);
    if (!deaf && isfinite(levels->bottom))
        w = free_water_before_surface(p, w, levels->bottom);
    out->heard_from_m = out->blind_m = (float)profile_m(p, w.begin);
    out->free_to_m = fminf(out->free_to_m, (float)profile_m(p, w.end));
    if (e->conf.no_echo == EXTRACT_MINIMUM && out->n == 0)
        out->free_to_m = fminf(out->free_to_m, (float)e->conf.minimum_range_m);
    if (out->n > 0) {
        out->free_to_m = fminf(out->free_to_m, out->echo[0].near_m);
        out->blind_m = fminf(out->blind_m, out->echo[0].near_m);
    }
    if (w.end < p->axis->n && profile_blind(p, w.end) && out->free_to_m >= (float)profile_m(p, w.end))
        out->hides = BEAM_HIDES_MASK;
    else if (w.begin > 0 && profile_blind(p, w.begin - 1))
        out->hides = BEAM_HIDES_BEFORE;
    out->heard_to_m = out->free_to_m;
    find_free_aside(e, p, b, w.begin, levels->target, out);
}

/* The echoes of the beam; out->free_to_m ends at what is doubtful. survivors: those of the class step, or NULL. */
static void detect(struct extract *e, struct profile *p, struct detection *d, struct survivors *survivors,
                   struct beam_echoes *out, struct shown *shown)
{
    d->cells = (struct cfar_profile){.x = e->cell + p->first,
                                     .excluded = p->blind ? p->blind + p->first : NULL,
                                     .n = p->axis->n - p->first,
                                     .work = e->work};
    cfar_run(&d->cfar, &d->cells, e->mask + p->first);
    if (survivors) {
        memset(e->mask, 0, p->first);
        p->lowest = survivors_lowest(survivors, p->clean, e->mask);
    }
    const uint32_t doubtful = detection_add_edges(p, d, e->contrast * DOUBTFUL);
    if (doubtful < p->axis->n)
        out->free_to_m = (float)profile_m(p, doubtful);
    detection_add_loud(p, d, e->contrast);
    detection_add_saturated(p, d);
    enter_reflections(e, p, d, out, shown);
}

/*
 * What a weak wall exceeds where this sonar's first echoes usually have a power: 9 dB less, since walls answer louder
 * where they are square to the beam, and 6 dB less for speckle.
 */
#define BELOW_ECHOES 0.03

/* Kept as the reference of this ping. full: power at full scale. */
static struct levels levels_of(struct extract *e, const struct ping *ping, double full)
{
    const struct extract_conf *c = &e->conf;
    const double prior = full * free_water_detectable(e->amplitude.law, (double)ping->gain_db, 0.0);
    uint64_t usual;
    const double shown = usual_get(&e->now->echo_power, &usual) ? BELOW_ECHOES * (double)usual : 0.0;
    const double wall = fmax(prior, shown);
    const struct levels levels = {
        .prior = prior,
        .wall = wall,
        .target = c->target_db > 0.0
                      ? full * free_water_detectable(e->amplitude.law, (double)ping->gain_db, c->target_db)
                      : wall,
        .bottom = c->bottom_db < 0.0 ? INFINITY : wall * free_water_bottom_over_wall(c->bottom_db)};
    e->reference.power = levels.target;
    e->reference.full = full;
    e->reference.bins = 2 * (uint64_t)e->now->axis.half + 1;
    e->reference.shown = levels.target > prior;
    return levels;
}

/* What the noise explains everywhere may still be mud that begins at the head: it is told, and frees nothing. */
static bool is_noisy(const struct baseline *b, const struct profile *p, double bottom)
{
    const uint32_t half = p->axis->half;
    uint32_t i = p->axis->n > half ? p->axis->n - half : 0; /* cells nearer to the ends have fewer bins */
    while (i > half && b->level[i - 1] >= bottom)
        i--;
    return p->axis->n > 2 * half && i <= half;
}

bool extract_reference(const struct extract *e, struct extract_reference *out)
{
    *out = (struct extract_reference){0};
    if (e->reference.full <= 0.0)
        return false;
    out->level_db = 10.0 * log10(e->reference.power / e->reference.full);
    out->shown = e->reference.shown;
    out->noisy = e->reference.noisy;
    for (uint64_t step = (e->amplitude.max_count + 1) / 2; step > 0; step /= 2) /* no law falls with the count */
        if ((double)(amplitude_of(&e->amplitude, (uint32_t)(out->counts + step - 1)) * e->reference.bins) <
            e->reference.power)
            out->counts += step;
    return true;
}

/* The ping lacks something, and not only pings before it to compare it with. */
static bool doubted(const struct extract *e)
{
    return e->doubt > HEARING_NOT_LEARNT;
}

static void extract_profile(struct extract *e, const struct ping *ping, uint16_t b, const struct extract_aid *aid,
                            struct of_ping *of_ping, struct beam_echoes *out)
{
    const size_t at = (size_t)b * ping->n_bins;
    struct profile p = {
        .axis = &e->now->axis,
        .amplitude = &e->amplitude,
        .samples = (const uint8_t *)ping->samples + at * ping->sample_bytes,
        .blind = aid && aid->blind ? blind_cells(e, aid->blind + at) : NULL,
        .own = aid && aid->own && ping->sample_bytes == 1 ? aid->own + at : NULL,
        .clean = aid && aid->clean ? aid->clean + at : NULL,
        .lowest = aid ? aid->lowest : -1,
        .cell = e->cell,
        .bits = e->bits,
    };
    const struct baseline *usual = baseline_known(&e->now->baseline) ? &e->now->baseline : NULL;
    out->hides = doubted(e) ? BEAM_HIDES_DEAF : BEAM_HIDES_NOTHING;
    profile_sum(&p, &e->amplitude, p.samples, e->conf.floor_counts, e->work);
    const double full = (double)amplitude_of(&e->amplitude, e->amplitude.max_count) * (2.0 * p.axis->half + 1.0);
    const struct levels levels = levels_of(e, ping, full);
    e->reference.noisy = usual && e->conf.no_echo != EXTRACT_RANGE && is_noisy(usual, &p, levels.bottom);
    struct detection d = {.mask = e->mask,
                          .baseline = usual,
                          .loud = levels.target,
                          .wall = levels.prior,
                          .one_q16 = e->one_q16,
                          .factors = MAX_FACTORS};
    const struct late_ring late = end_ring_down(e, &p, of_ping);
    const uint32_t hidden = usual && e->conf.ring_down_m < 0.0 ? free_water_begin(&p, usual, levels.wall) : 0;
    p.first = hidden > p.first ? hidden : p.first; /* no echo is looked for where the baseline hides a wall */
    if (p.first < p.axis->n)
        pass_mask_of_ring(&p);
    if (p.first >= p.axis->n || free_water_is_dumb(&p) || !detector_for(e, &p, &d.cfar))
        return;

    const bool stuck = !hearing_varies(&e->amplitude, p.samples, p.first, p.axis->n);
    if (stuck)
        out->hides = BEAM_HIDES_DEAF;
    if (!doubted(e) && !stuck)
        law_check_add(&e->law_check, &p);
    const bool near_shadow = is_near_shadow(e, &p, usual, late, of_ping);
    const bool on_clean = e->conf.order == EXTRACT_PAPER && p.clean && ping->sample_bytes == 1;
    if (on_clean)
        profile_sum(&p, &e->amplitude, p.clean, e->conf.floor_counts, e->work);
    out->blind_m = (float)profile_m(&p, p.first);
    out->free_to_m = INFINITY;
    struct shown shown = {.power = 0.0};
    if (p.blind || on_clean || !is_quiet(&p, &d.cfar))
        detect(e, &p, &d, on_clean ? aid->survivors : NULL, out, &shown);
    out->state = out->n > 0 ? BEAM_ECHO : BEAM_SILENT;
    of_ping->echo_power = fmax(of_ping->echo_power, shown.power * (double)(UINT64_C(1) << p.shift));
    of_ping->strong |= out->n > 0 && !(out->echo[0].flags & ECHO_FAINT);
    if (on_clean)
        profile_sum(&p, &e->amplitude, p.samples, e->conf.floor_counts, e->work);
    if (doubted(e) || stuck) {
        beam_frees_nothing(out);
    } else if (near_shadow) {
        out->free_to_m = 0.0f;
        out->hides = BEAM_HIDES_RING;
    } else {
        find_free_interval(e, &p, usual, &levels, &shown.first, out);
    }
}

/*
 * A sonar that picks its ranges does not say how near it hears, unless ring_down does. Where its scan begins is known
 * of some, but not that the transducer has stopped ringing by then.
 */
#define RANGES_BLIND_M 0.3

/* A reflector somewhere within a pulse, each place as likely,
 * lies at most so many standard deviations before its middle. */
#define RANGES_NEARER_SDS 1.7320508f

/* near_m: where it begins at the latest. */
static struct echo echo_at(float range_m, float near_m, const struct ping_beam *beam)
{
    const float sd = beam->range_sd_m >= 0.0f && beam->range_sd_m < 1e5f ? beam->range_sd_m : 0.0f;
    return (struct echo){
        .range_m = range_m,
        .near_m = fmaxf(fminf(near_m, range_m - RANGES_NEARER_SDS * sd), 0.0f),
        .sd_m = sd,
        .strength = 1.0f,
        .confidence = beam->confidence >= 0.0f ? fminf(beam->confidence, 1.0f) : 0.0f,
    };
}

/* The device has picked the ranges itself: n of them in one beam, of which those count that are ranges. */
static void extract_ranges(const struct extract *e, const struct ping *ping, float range_max_m,
                           const struct order_entry *of_beam, uint16_t n, struct beam_echoes *out)
{
    const double begin_m = fmax((double)ping->r0_m, (double)ping->deaf_m);
    const bool any = order_is_range(of_beam->beam);
    if (!any && of_beam->beam->range_m != 0.0f)
        return;
    out->state = BEAM_SILENT;
    const double ring_m = e->conf.ring_down_m >= 0.0 ? e->conf.ring_down_m : RANGES_BLIND_M;
    out->blind_m = (float)(begin_m > ring_m && begin_m < 1e5 ? begin_m : ring_m);
    if (!any) {
        out->free_to_m = fminf((float)e->conf.minimum_range_m, range_max_m);
        out->heard_from_m = out->blind_m;
        out->heard_to_m = range_max_m;
        return;
    }
    out->state = BEAM_ECHO;
    for (uint16_t i = 0; i < n && out->n < ECHOES_PER_BEAM && order_is_range(of_beam[i].beam); i++) {
        const struct ping_beam *beam = of_beam[i].beam;
        if (out->n == 0 || beam->range_m > out->echo[out->n - 1].range_m)
            out->echo[out->n++] = echo_at(beam->range_m, INFINITY, beam);
    }
    if (ping->deaf_m > 0.0f && choice_may_be_double(out->echo[0].near_m, out->blind_m))
        return;
    out->free_to_m = out->echo[0].near_m;
    out->heard_from_m = out->blind_m;
    out->heard_to_m = out->echo[0].range_m;
}

/*
 * The water before the echoes that are entered. One that the device has not chosen may be noise: what it is worth shows
 * when the ping before has it in the same place, to a pulse and two bins.
 */
static float before_echo_m(const struct extract *e, const struct ping *ping, const struct choice *c, bool chosen,
                           const struct beam_echoes *out)
{
    const float minimum_m = (float)e->conf.minimum_range_m;
    const bool again = fabsf((float)c->to_m - e->choice_to_m) <= ping->pulse_m + 2.0f * ping->dr_m;
    if (out->n == 0)
        return minimum_m;
    return chosen || again ? out->echo[0].near_m : fminf(out->echo[0].near_m, minimum_m);
}

/* What this profile and the one before it show to be free, up to most_m: noise looks like an echo now and then, but
 * hardly twice in a row. */
static void free_by_choice(const struct extract *e, const struct choice *c, float most_m, struct beam_echoes *out)
{
    out->blind_m = (float)c->from_m;
    out->hides = c->rings ? BEAM_HIDES_RING : BEAM_HIDES_NOTHING;
    out->free_to_m = fminf(fminf((float)c->to_m, e->choice_to_m), most_m);
    if (out->free_to_m > out->blind_m) {
        out->heard_from_m = out->blind_m;
        out->heard_to_m = out->free_to_m;
    }
}

/* The device has picked a range in a profile. An echo that it reports is kept, whatever the profile shows. One that it
 * has not chosen weighs nothing: it does not block, but what was free behind it is so no more. */
static void extract_choice(const struct extract *e, const struct ping *ping, uint16_t b, struct of_ping *of_ping,
                           struct beam_echoes *out)
{
    const struct ping_beam *beam = &ping->beam[b];
    const bool chosen = order_is_range(beam);
    struct choice_ring ring = {.promised_m = e->conf.ring_down_m};
    struct choice c;
    if (!chosen && beam->range_m != 0.0f)
        return;
    ring.learnt = usual_get(&e->now->choice_ring, &ring.usual);
    choice_judge(ping, b, (double)beam->range_m, &ring, &c);
    of_ping->choice_to_m = fminf((float)c.to_m, of_ping->choice_to_m);
    of_ping->choice_ring = c.loud_until < of_ping->choice_ring ? c.loud_until : of_ping->choice_ring;
    if (c.echo_m > 0.0) {
        struct echo *echo = &out->echo[out->n++];
        *echo = echo_at((float)c.echo_m, (float)c.echo_near_m, beam);
        echo->flags = c.weaker ? ECHO_FAINT : 0;
        echo->confidence = chosen ? echo->confidence : 0.0f;
    }
    if (chosen) {
        const bool begins_before = c.echo_m <= 0.0 && c.to_m > 0.0;
        out->echo[out->n++] = echo_at(beam->range_m, begins_before ? (float)c.to_m : INFINITY, beam);
    }
    out->state = out->n > 0 ? BEAM_ECHO : BEAM_SILENT;
    free_by_choice(e, &c, before_echo_m(e, ping, &c, chosen, out), out);
}

/* ---- one ping ---- */

/* What the ping adds to what is usual. */
static void learn_ring(struct setting *now, const struct of_ping *of_ping)
{
    if (of_ping->ring_down != UINT64_MAX)
        usual_add(&now->ring_down, of_ping->ring_down);
    if (of_ping->ring_power != UINT64_MAX)
        usual_add(&now->ring_power, of_ping->ring_power);
    if (of_ping->ring_loud != UINT64_MAX)
        usual_add(&now->ring_loud, of_ping->ring_loud);
    if (of_ping->choice_ring != UINT64_MAX)
        usual_add(&now->choice_ring, of_ping->choice_ring);
    if (of_ping->echo_power > 0.0)
        usual_add(&now->echo_power, (uint64_t)of_ping->echo_power);
}

/* Does the ping show that its receiver hears? One that does not teaches nothing. */
static struct hearing_levels listen(struct extract *e, const struct ping *ping)
{
    struct hearing_levels levels = hearing_levels_of(&e->now->axis, &e->amplitude, ping->samples, ping->n_beams,
                                                     (double)ping->deaf_m, e->conf.floor_counts);
    levels.repeats = hearing_repeats(&e->prints, levels.print);
    e->doubt = hearing_take(&e->now->hearing, &levels);
    hearing_alarm_take(&e->alarm, e->doubt);
    if (!doubted(e))
        baseline_learn(&e->now->baseline, ping, &e->now->axis, &e->amplitude, (double *)e->work);
    return levels;
}

static void learn(struct extract *e, const struct of_ping *of_ping, const struct hearing_levels *levels)
{
    if (!doubted(e))
        learn_ring(e->now, of_ping);
    else if (of_ping->strong)
        hearing_prove(&e->now->hearing, levels);
}

static struct beam_echoes *add_beam(struct echoes *out, const struct ping_beam *axis)
{
    struct beam_echoes *beam = &out->beam[out->n_beams++];
    *beam = (struct beam_echoes){.az_rad = axis->az_rad, .el_rad = axis->el_rad, .state = BEAM_BLIND};
    return beam;
}

/* The entries come in any order; who has neighbours in the list has them in the water only once they are in order. */
static void extract_ready(const struct extract *e, const struct ping *ping, struct echoes *out)
{
    struct order order;
    order_ranges(ping, &order);
    for (uint16_t i = 0, n; i < order.n && out->n_beams < out->max_beams; i = (uint16_t)(i + n)) {
        struct beam_echoes *beam = add_beam(out, order.entry[i].beam);
        n = order_of_beam(&order, i);
        if (!(ping->flags & PING_UNHEARD))
            extract_ranges(e, ping, out->range_max_m, &order.entry[i], n, beam);
    }
}

void extract_run(struct extract *extract, const struct ping *ping, const struct extract_aid *aid,
                 struct echoes *out)
{
    const bool ready = ping->kind == PING_RANGES;
    const bool choice = ping->kind == PING_CHOICE && (ping->sample_bytes == 1 || ping->sample_bytes == 2) &&
                        axis_for(extract, ping);
    const bool profile = ping->kind == PING_PROFILE && amplitude_for(extract, ping) && axis_for(extract, ping);
    const double end_m = (double)ping->r0_m + (double)ping->n_bins * (double)ping->dr_m;
    out->t_ns = ping->t_ns;
    out->t_in_ns = ping->t_in_ns;
    out->seq = ping->seq;
    out->flags = ping->flags;
    out->turns = ping->head_turn > 0;
    out->sensor = ping->sensor;
    out->n_beams = 0;
    out->range_max_m = end_m > 0.0 && end_m < 1e6 ? (float)end_m : 0.0f;
    out->bin0_m = ready ? 0 : ping->r0_m;
    out->bin_m = ready ? 0 : ping->dr_m;
    out->az_aperture_rad = ping->az_aperture_rad;
    out->el_aperture_rad = ping->el_aperture_rad;
    out->pose = ping->pose;

    const bool heard = profile && !(ping->flags & PING_UNHEARD) && ping->n_beams > 0;
    struct of_ping of_ping = {UINT64_MAX, UINT64_MAX, UINT64_MAX, UINT64_MAX, 0.0, false, INFINITY};
    struct hearing_levels levels;
    if (heard)
        levels = listen(extract, ping);
    if (ready)
        extract_ready(extract, ping, out);
    for (uint16_t b = 0; !ready && b < ping->n_beams && out->n_beams < out->max_beams; b++) {
        struct beam_echoes *beam = add_beam(out, &ping->beam[b]);
        if (ping->flags & PING_UNHEARD)
            continue;
        if (choice)
            extract_choice(extract, ping, b, &of_ping, beam);
        else if (profile)
            extract_profile(extract, ping, b, aid, &of_ping, beam);
    }
    if (heard)
        learn(extract, &of_ping, &levels);
    else
        learn_ring(extract->now, &of_ping);
    if (of_ping.choice_to_m < INFINITY)
        extract->choice_to_m = of_ping.choice_to_m;
}

enum hearing_doubt extract_hearing_doubt(const struct extract *extract)
{
    return extract->alarm.doubt;
}

enum law_doubt extract_law_doubt(const struct extract *extract)
{
    return law_check_doubt(&extract->law_check, extract->amplitude.law);
}
