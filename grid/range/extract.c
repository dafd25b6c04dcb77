/* SPDX-License-Identifier: MIT */
/*
 * extract - the order of the stages: profile (counts to power of resolution cells), end of the ring-down, CFAR,
 * reflections, free water; and what is usual for this sensor. Knows no map.
 */
#include "extract.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "amplitude.h"
#include "cfar.h"
#include "law_check.h"
#include "reflection.h"
#include "ring_down.h"
#include "setting.h"

/* A group this share (1.5 dB) below the contrast of an echo is none, but ends what is called free. */
#define DOUBTFUL 0.7

#define MAX_FACTORS 64 /* more independent cells than this change the threshold by less than 0.1 dB */

/* The floor of a ping is so many times (15 dB) the usual one: what is heard usually may drown in it. */
#define RAISED 32

/* A cell where it usually is quiet is this share (3 dB) of an echo's level: nearly one. */
#define NEARLY 0.5

/* The loudest cell of the ring-down is so many times (5 dB) the usual one: something near answers with the head. */
#define RINGS 3

/* Of a ping's quietest beam, of its beam with the earliest end of the ring-down (a cell), of that with the quietest
 * one (power of the loudest cell), and of that where it is loud for the shortest time (a cell). */
struct of_ping {
    uint64_t floor, ring_down, ring_power, ring_loud;
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

    uint64_t *cell; /* power summed over the resolution cell around each bin */
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
        .no_echo = EXTRACT_MINIMUM,
        .minimum_range_m = 0.75,
        .ring_down_m = -1.0,
        .law = EXTRACT_LAW_OF_PING,
    };
}

/* ---- start ---- */

static bool in_range(double value, double lo, double hi, const char *key, char *err, size_t err_size)
{
    if (value >= lo && value <= hi)
        return true;
    snprintf(err, err_size, "extract: %s is %g, allowed is %g to %g", key, value, lo, hi);
    return false;
}

static bool conf_ok(const struct extract_conf *c, char *err, size_t err_size)
{
    return in_range(c->detector, CFAR_CA, CFAR_OS, "detector", err, err_size) &&
           in_range(c->order, EXTRACT_SAFE, EXTRACT_PAPER, "order", err, err_size) &&
           in_range(c->false_alarm, 1e-12, 0.1, "false_alarm", err, err_size) &&
           in_range(c->window_m, 1e-3, 100.0, "window", err, err_size) &&
           in_range(c->guard_m, 0.0, 10.0, "guard", err, err_size) &&
           in_range(c->rank, 1e-3, 1.0, "rank", err, err_size) &&
           in_range(c->floor_counts, 0.0, 65535.0, "floor", err, err_size) &&
           in_range(c->min_contrast_db, 0.0, 100.0, "min_contrast", err, err_size) &&
           in_range(c->no_echo, EXTRACT_MINIMUM, EXTRACT_RANGE, "no_echo", err, err_size) &&
           in_range(c->minimum_range_m, 0.0, 1000.0, "minimum_range", err, err_size) &&
           in_range(c->ring_down_m, -1e9, 100.0, "ring_down", err, err_size) &&
           in_range(c->law, EXTRACT_LAW_OF_PING, AMPLITUDE_LOG, "amplitude", err, err_size) &&
           (c->law != AMPLITUDE_LOG ||
            in_range(c->db_per_count, 1e-6, AMPLITUDE_MAX_DB / 255.0, "decibels_per_count", err, err_size));
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
    size_t cell, work, mask, blind, end;
};

static struct layout layout_for(uint32_t max_bins)
{
    struct layout l;

    l.cell = (sizeof(struct extract) + _Alignof(max_align_t) - 1) / _Alignof(max_align_t) * _Alignof(max_align_t);
    l.work = l.cell + max_bins * sizeof(uint64_t);
    l.mask = l.work + cfar_work_size(max_bins);
    l.blind = l.mask + max_bins;
    l.end = l.blind + max_bins;
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

struct extract *extract_init(void *mem, const struct extract_conf *conf, uint32_t max_bins, char *err,
                             size_t err_size)
{
    if (!conf_ok(conf, err, err_size))
        return NULL;

    const struct layout l = layout_for(limit_bins(max_bins));
    struct extract *e = mem;
    uint8_t *base = mem;
    memset(mem, 0, l.end);
    e->conf = *conf;
    e->max_bins = limit_bins(max_bins);
    e->contrast = pow(10.0, conf->min_contrast_db / 10.0);
    e->cell = (void *)(base + l.cell);
    e->work = (void *)(base + l.work);
    e->mask = base + l.mask;
    e->blind = base + l.blind;
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
    e->now = settings_for(&e->settings, &axis);
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

static uint32_t least(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

/* The first cell that is masked, or whose reference windows are: what it holds is not known. n: there is none. */
static uint32_t judged_until(const struct profile *p, const struct detection *d)
{
    uint32_t i = p->first;

    if (!p->blind)
        return p->axis->n;
    while (i < p->axis->n && !p->blind[i] && cfar_reference_at(&d->cfar, &d->cells, i - p->first).cells > 0)
        i++;
    return i;
}

/* No cell is louder than the threshold over the floor, which is the least that there is, and none is saturated. */
static bool is_quiet(const struct profile *p, const struct cfar *cfar)
{
    const uint64_t alpha_q16 = cfar->alpha_q16 < cfar->alpha_one_q16 ? cfar->alpha_q16 : cfar->alpha_one_q16;
    const unsigned __int128 threshold = (unsigned __int128)alpha_q16 * p->floor_power >> 16;
    const uint64_t full = p->full_power - 1;

    return !profile_any_above(p, p->first, threshold < full ? (uint64_t)threshold : full);
}

/* The reflections of the profile become echoes; what is nearly one ends the free water. *first: the nearest echo. */
static void enter_reflections(const struct extract *e, const struct profile *p, const struct detection *d,
                              struct beam_echoes *out, struct reflection *first)
{
    struct reflection r;

    for (uint32_t i = p->first; out->n < ECHOES_PER_BEAM && reflection_next(p, d, i, &r); i = r.last + 1) {
        if (r.contrast >= e->contrast * DOUBTFUL && out->n == 0)
            reflection_reach_back(p, d, &r);
        if (r.contrast >= e->contrast && !r.lowest_only) {
            if (out->n == 0)
                *first = r;
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
 * Something near rings with the head, and may hide all that is behind: where it usually is quiet, a cell is nearly as loud
 * as an echo over the floor; or the ring-down itself is louder than the head, or as loud for longer.
 */
static bool is_near_shadow(const struct extract *e, const struct profile *p, struct late_ring late, double loud,
                           struct of_ping *of_ping)
{
    const uint64_t ring = ring_power(p);
    const uint32_t loud_until = ring_loud_until(p, ring);
    uint64_t usual;

    of_ping->ring_power = ring < of_ping->ring_power ? ring : of_ping->ring_power;
    of_ping->ring_loud = loud_until < of_ping->ring_loud ? loud_until : of_ping->ring_loud;
    if (usual_get(&e->now->ring_power, &usual) && ring / RINGS > usual)
        return true;
    if (usual_get(&e->now->ring_loud, &usual) && loud_until > usual + p->axis->guard)
        return true;
    for (uint32_t i = late.begin; i < late.end; i++)
        if ((double)p->cell[i] > loud)
            return true;
    return false;
}

/* Sound passed up to the echo; but what is as loud would not have been found in all of the water before it. */
static void claim_before_echo(const struct profile *p, const struct reflection *first, double detectable,
                              const struct silence *silence, struct beam_echoes *out)
{
    const double quiet = detectable * detectable * (double)silence->floor;

    out->blind_m = (float)profile_m(p, silence_hidden(p, first->near, first->power, detectable));
    out->free_to_m = fminf(out->free_to_m, out->echo[0].near_m);
    out->heard_from_m = (float)profile_m(p, silence_hidden(p, first->near, quiet, detectable));
    out->heard_to_m = out->echo[0].near_m;
}

/* A wall may be hidden where the water drowns it, or where the beam is masked, and hide what is behind. */
static void claim_silence(const struct extract *e, const struct profile *p, uint32_t judged,
                          const struct silence *silence, struct beam_echoes *out)
{
    const double free_m =
        silence_free_m(p, least(judged, silence->drowned), e->conf.no_echo, e->conf.minimum_range_m);

    out->free_to_m = fminf(out->free_to_m, (float)free_m);
    out->heard_from_m = (float)profile_m(p, silence->quiet);
    out->heard_to_m = (float)profile_m(p, judged);
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
        .clean = aid && aid->clean ? aid->clean + at : NULL,
        .lowest = aid ? aid->lowest : -1,
        .cell = e->cell,
    };
    struct detection d = {.mask = e->mask};

    profile_sum(&p, &e->amplitude, p.samples, e->conf.floor_counts, e->work);
    const struct late_ring late = end_ring_down(e, &p, of_ping);
    if (p.first < p.axis->n)
        pass_mask_of_ring(&p);
    if (p.first >= p.axis->n || silence_is_dumb(&p) || !detector_for(e, &p, &d.cfar))
        return;

    law_check_add(&e->law_check, &p);
    const double detectable = fmax(e->contrast, (double)d.cfar.alpha_q16 / 65536.0);
    const struct silence silence = silence_levels(&p, detectable);
    const bool near_shadow = is_near_shadow(e, &p, late, NEARLY * detectable * (double)silence.floor, of_ping);
    const struct calm calm = silence_calm(&p);
    of_ping->floor = silence.floor < of_ping->floor ? silence.floor : of_ping->floor;
    const bool on_clean = e->conf.order == EXTRACT_PAPER && p.clean && ping->sample_bytes == 1;
    if (on_clean)
        profile_sum(&p, &e->amplitude, p.clean, e->conf.floor_counts, e->work);
    out->blind_m = (float)profile_m(&p, p.first);
    out->free_to_m = INFINITY;
    struct reflection first = {.last = 0};
    if (p.blind || on_clean || !is_quiet(&p, &d.cfar)) {
        d.cells = (struct cfar_profile){.x = e->cell + p.first,
                                        .excluded = p.blind ? p.blind + p.first : NULL,
                                        .n = p.axis->n - p.first,
                                        .work = e->work};
        cfar_run(&d.cfar, &d.cells, e->mask + p.first);
        detection_add_saturated(&p, &d);
        enter_reflections(e, &p, &d, out, &first);
    }
    out->state = out->n > 0 ? BEAM_ECHO : BEAM_SILENT;
    if (near_shadow) {
        out->free_to_m = 0.0f;
        return;
    }
    if (calm.risen < p.axis->n && (out->n == 0 || calm.risen <= first.near))
        out->free_to_m = fminf(out->free_to_m, (float)profile_m(&p, calm.until));
    if (out->n > 0)
        claim_before_echo(&p, &first, detectable, &silence, out);
    else
        claim_silence(e, &p, judged_until(&p, &d), &silence, out);
}

static bool is_range(float range_m)
{
    return range_m > 0.0f && range_m < 1e5f;
}

/* How many entries from b on are the echoes of one beam: the same direction again, farther away. */
static uint16_t echoes_of_beam(const struct ping *ping, uint16_t b)
{
    const struct ping_beam *first = &ping->beam[b];
    uint16_t n = 1;

    while (is_range(first[n - 1].range_m) && b + n < ping->n_beams && first[n].az_rad == first->az_rad &&
           first[n].el_rad == first->el_rad && is_range(first[n].range_m) &&
           first[n].range_m > first[n - 1].range_m)
        n++;
    return n;
}

/* A sonar that picks its ranges does not say how near it hears, unless the device or ring_down knows. */
#define RANGES_BLIND_M 0.3

/* A reflector somewhere within a pulse, each place as likely, lies at most so many standard deviations before its middle. */
#define RANGES_NEARER_SDS 1.7320508f

/* The device has picked the ranges itself, listening from begin_m on: n of them in one beam. */
static void extract_ranges(const struct extract *e, double begin_m, float range_max_m,
                           const struct ping_beam *beam, uint16_t n, struct beam_echoes *out)
{
    if (!is_range(beam->range_m) && beam->range_m != 0.0f)
        return;
    out->state = BEAM_SILENT;
    const double known_m = fmax(e->conf.ring_down_m, begin_m > 0.0 && begin_m < 1e5 ? begin_m : 0.0);
    out->blind_m = (float)(known_m > 0.0 ? known_m : RANGES_BLIND_M);
    if (!is_range(beam->range_m)) {
        out->free_to_m = (float)e->conf.minimum_range_m;
        out->heard_from_m = out->blind_m;
        out->heard_to_m = range_max_m;
        return;
    }
    out->state = BEAM_ECHO;
    for (; out->n < n && out->n < ECHOES_PER_BEAM; out->n++, beam++) {
        const float sd = beam->range_sd_m >= 0.0f && beam->range_sd_m < 1e5f ? beam->range_sd_m : 0.0f;
        const float confidence = beam->confidence >= 0.0f ? fminf(beam->confidence, 1.0f) : 0.0f;
        out->echo[out->n] = (struct echo){
            .range_m = beam->range_m,
            .near_m = fmaxf(beam->range_m - RANGES_NEARER_SDS * sd, 0.0f),
            .sd_m = sd,
            .strength = 1.0f,
            .confidence = confidence,
        };
    }
    out->free_to_m = out->echo[0].near_m;
    out->heard_from_m = out->blind_m;
    out->heard_to_m = out->echo[0].range_m;
}

/* ---- one ping ---- */

/* What the ping adds to what is usual; where its floor is raised, nothing that it did not hear is free. */
static void judge_floor(struct extract *e, const struct of_ping *of_ping, struct echoes *out)
{
    uint64_t usual;

    if (of_ping->ring_down != UINT64_MAX)
        usual_add(&e->now->ring_down, of_ping->ring_down);
    if (of_ping->ring_power != UINT64_MAX)
        usual_add(&e->now->ring_power, of_ping->ring_power);
    if (of_ping->ring_loud != UINT64_MAX)
        usual_add(&e->now->ring_loud, of_ping->ring_loud);
    if (of_ping->floor == UINT64_MAX)
        return;
    if (usual_get(&e->now->floor, &usual) && of_ping->floor / RAISED > usual)
        for (uint16_t b = 0; b < out->n_beams; b++)
            out->beam[b].free_to_m = out->beam[b].heard_to_m = 0.0f;
    usual_add(&e->now->floor, of_ping->floor);
}

void extract_run(struct extract *extract, const struct ping *ping, const struct extract_aid *aid,
                 struct echoes *out)
{
    const bool ready = ping->kind == PING_RANGES;
    const bool profile = !ready && amplitude_for(extract, ping) && axis_for(extract, ping);
    const double end_m = (double)ping->r0_m + (double)ping->n_bins * (double)ping->dr_m;

    out->t_ns = ping->t_ns;
    out->t_in_ns = ping->t_in_ns;
    out->seq = ping->seq;
    out->flags = ping->flags;
    out->sensor = ping->sensor;
    out->n_beams = 0;
    out->range_max_m = end_m > 0.0 && end_m < 1e6 ? (float)end_m : 0.0f;
    out->bin0_m = ready ? 0 : ping->r0_m;
    out->bin_m = ready ? 0 : ping->dr_m;
    out->az_aperture_rad = ping->az_aperture_rad;
    out->el_aperture_rad = ping->el_aperture_rad;
    out->pose = ping->pose;

    struct of_ping of_ping = {UINT64_MAX, UINT64_MAX, UINT64_MAX, UINT64_MAX};
    for (uint16_t b = 0, n = 1; b < ping->n_beams && out->n_beams < out->max_beams; b = (uint16_t)(b + n)) {
        struct beam_echoes *beam = &out->beam[out->n_beams++];
        *beam = (struct beam_echoes){
            .az_rad = ping->beam[b].az_rad, .el_rad = ping->beam[b].el_rad, .state = BEAM_BLIND};
        if (ping->flags & PING_UNHEARD)
            continue;
        if (ready)
            extract_ranges(extract, (double)ping->r0_m, out->range_max_m, &ping->beam[b],
                           n = echoes_of_beam(ping, b), beam);
        else if (profile)
            extract_profile(extract, ping, b, aid, &of_ping, beam);
    }
    judge_floor(extract, &of_ping, out);
}

enum law_doubt extract_law_doubt(const struct extract *extract)
{
    return law_check_doubt(&extract->law_check, extract->amplitude.law);
}
