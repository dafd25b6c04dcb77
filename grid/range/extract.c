/* SPDX-License-Identifier: MIT */
/*
 * extract - the stages of one beam: counts to power, sum over the pulse length (the resolution cell), end of the
 * ring-down, CFAR, groups of detected cells, free water. Knows no earlier ping and no map.
 */
#include "extract.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "amplitude.h"
#include "cfar.h"

/* A group this share (3 dB) below the contrast of an echo is none, but ends what is called free. */
#define DOUBTFUL 0.5

#define MIN_WINDOW_CELLS 8  /* independent cells on each side: fewer make the threshold a lottery */
#define MAX_FACTORS      64 /* more independent cells than this change the threshold by less than 0.1 dB */
#define SETTLE_BINS      3

/* Sizes in bins that follow from the ping's bin and pulse length. */
struct geometry {
    uint32_t n;      /* bins of a beam */
    double r0, dr;   /* metres */
    uint32_t half;   /* a resolution cell is the bin and so many on either side of it */
    uint32_t window; /* on each side */
    uint32_t guard;
    uint32_t settle;        /* over which the end of the ring-down is judged: the guard, at least SETTLE_BINS */
    double resolution_bins; /* bins per independent cell, >= 1 */
};

struct extract {
    struct extract_conf conf;
    uint32_t max_bins;
    double contrast; /* min_contrast_db as a ratio */
    /* [i]: threshold over reference, times 65536, for i + 1 independent cells on both sides, or on one */
    uint64_t both_q16[MAX_FACTORS], one_q16[MAX_FACTORS];

    struct amplitude amplitude; /* of the last ping */
    double amplitude_db;        /* per count, as it was prepared */

    uint64_t *cell; /* power summed over the resolution cell around each bin */
    uint64_t *work;
    uint8_t *mask;
};

/* The beam in work. Indices of cells are bins from the head. */
struct beam {
    const struct geometry *geometry;
    const void *samples;
    const uint8_t *blind, *clean; /* struct extract_aid's, of this beam; or NULL */
    int lowest;
    uint32_t first; /* cell behind the ring-down */
    struct cfar cfar;
    struct cfar_profile profile; /* the cells from `first` on */
};

void extract_defaults(struct extract_conf *conf)
{
    *conf = (struct extract_conf){
        .detector = CFAR_SOCA,
        .false_alarm = 1e-4,
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
    size_t cell, work, mask, end;
};

static struct layout layout_for(uint32_t max_bins)
{
    struct layout l;

    l.cell = (sizeof(struct extract) + _Alignof(max_align_t) - 1) / _Alignof(max_align_t) * _Alignof(max_align_t);
    l.work = l.cell + max_bins * sizeof(uint64_t);
    l.mask = l.work + cfar_work_size(max_bins);
    l.end = l.mask + max_bins;
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
    solve_factors(e);
    return e;
}

/* ---- a ping's geometry and amplitude ---- */

static uint32_t bins_for(double metres, double dr)
{
    return (uint32_t)fmin(ceil(metres / dr - 1e-6), PING_MAX_BINS);
}

/* False when the ping's range axis makes no sense. */
static bool geometry_of(const struct extract *e, const struct ping *p, struct geometry *g)
{
    const double dr = (double)p->dr_m, pulse = (double)p->pulse_m, r0 = (double)p->r0_m;

    if (p->n_bins == 0 || p->n_bins > e->max_bins || !(dr >= 1e-6 && dr <= 100.0) ||
        !(pulse >= 0.0 && pulse <= 1e3) || !(r0 >= 0.0 && r0 <= 1e5))
        return false;
    *g = (struct geometry){.n = p->n_bins, .r0 = r0, .dr = dr};
    g->resolution_bins = fmin(fmax(pulse / dr, 1.0), PING_MAX_BINS);
    g->half = (uint32_t)(g->resolution_bins / 2.0);

    const uint32_t pulse_bins = bins_for(pulse, dr);
    g->guard = bins_for(e->conf.guard_m, dr);
    if (g->guard < pulse_bins)
        g->guard = pulse_bins;
    g->settle = g->guard > SETTLE_BINS ? g->guard : SETTLE_BINS;
    const double least = ceil(MIN_WINDOW_CELLS * g->resolution_bins);
    g->window = (uint32_t)fmin(fmax(bins_for(e->conf.window_m, dr), least), PING_MAX_BINS);
    return true;
}

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
    return true;
}

static uint32_t count_at(const struct extract *e, const void *samples, uint32_t i)
{
    return e->amplitude.sample_bytes == 1 ? ((const uint8_t *)samples)[i] : ((const uint16_t *)samples)[i];
}

static bool saturated(const struct extract *e, const void *samples, uint32_t i)
{
    return count_at(e, samples, i) == e->amplitude.max_count;
}

/* ---- one beam ---- */

/* Sum of power over the resolution cell around every bin, cut at the ends of the beam; divided by 2^shift. */
static void sum_cells(const uint64_t *power, uint32_t n, uint32_t half, unsigned shift, uint64_t *cell)
{
    uint64_t sum = 0;

    for (uint32_t i = 0; i < n && i < half; i++)
        sum += power[i];
    for (uint32_t i = 0; i < n; i++) {
        if (i + half < n)
            sum += power[i + half];
        if (i > half)
            sum -= power[i - half - 1];
        cell[i] = sum >> shift;
    }
}

/*
 * Downhill from a cell: to the first guard length that is not louder than the next one, or not louder than the floor;
 * and on to the quietest cell of the two, since the next one may have been lifted by a wall.
 */
static uint32_t level_settles(const struct geometry *g, const uint64_t *cell, uint32_t from, uint64_t floor_power)
{
    const uint32_t length = g->settle;
    uint64_t here = 0, next = 0;

    if (g->n < 2 * length || from > g->n - 2 * length)
        return from;
    for (uint32_t k = 0; k < length; k++) {
        here += cell[from + k];
        next += cell[from + length + k];
    }
    uint32_t at = from;
    for (; at + 2 * length < g->n && next < here && here > floor_power * length; at++) {
        here += cell[at + length] - cell[at];
        next += cell[at + 2 * length] - cell[at + length];
    }
    uint32_t quietest = at;
    for (uint32_t i = at + 1; i < at + 2 * length; i++)
        if (cell[i] < cell[quietest])
            quietest = i;
    return quietest;
}

/*
 * The first cell behind the ring-down. Configured: there, or later if the receiver is still saturated. Otherwise from
 * the loudest cell near the head (the first bins may be zero) over the saturated ones to where the level stops
 * falling; it is looked at over a guard length, since speckle has holes. A wall in the falling level is not found;
 * but the blind stretch ends behind it, and so its place is not called free.
 */
static uint32_t ring_down_end(const struct extract *e, const struct geometry *g, const void *samples,
                              uint64_t floor_power)
{
    uint32_t at = 0;

    if (e->conf.ring_down_m >= 0.0) {
        at = bins_for(fmax(e->conf.ring_down_m - g->r0, 0.0), g->dr);
        while (at < g->n && saturated(e, samples, at))
            at++;
        return at + g->half;
    }
    for (uint32_t i = 1; i < g->n && i < 3 * g->settle; i++)
        if (e->cell[i] > e->cell[at])
            at = i;
    while (at < g->n && saturated(e, samples, at))
        at++;
    return level_settles(g, e->cell, at, floor_power);
}

/* Run the detector over the cells from `first` on; false when they are too few to judge. */
static bool detect(struct extract *e, struct beam *beam, uint64_t floor_power)
{
    const struct geometry *g = beam->geometry;
    const uint32_t n = g->n - beam->first;

    if (n < 2 * g->guard + 3)
        return false;
    const uint32_t room = (n - 1) / 2 - g->guard; /* so that every cell has one complete side */
    const uint32_t window = g->window < room ? g->window : room;
    const double independent = fmin(fmax(window / g->resolution_bins, 1.0), MAX_FACTORS);
    const uint32_t factor = (uint32_t)independent - 1;
    beam->cfar = (struct cfar){
        .detector = e->conf.detector,
        .edge = CFAR_FULL,
        .n_side = window,
        .guard = g->guard,
        .rank = (uint32_t)ceil(e->conf.rank * 2.0 * window),
        .alpha_q16 = e->both_q16[factor],
        .alpha_one_q16 = e->one_q16[factor],
        .reference_min = floor_power,
    };
    beam->profile = (struct cfar_profile){.x = e->cell + beam->first, .n = n, .work = e->work};
    cfar_run(&beam->cfar, &beam->profile, e->mask + beam->first);
    return true;
}

/* Is the cell part of an echo? Nothing can exceed a threshold above full scale, so a saturated bin always is. */
static bool stands_out(const struct extract *e, const struct beam *beam, uint32_t i)
{
    if (beam->blind && beam->blind[i])
        return false;
    if (beam->clean && beam->clean[i] <= beam->lowest)
        return false;
    return e->mask[i] || saturated(e, beam->samples, i);
}

/* The group of detected cells that begins at `begin`: gaps of at most the guard belong to it. Returns its last. */
static uint32_t group_end(const struct extract *e, const struct beam *beam, uint32_t begin)
{
    const struct geometry *g = beam->geometry;
    uint32_t last = begin;

    for (uint32_t i = begin + 1; i < g->n && i - last <= g->guard + 1; i++)
        if (stands_out(e, beam, i))
            last = i;
    return last;
}

/* Position of the peak in bins (centre of bin 0: 0.5): middle of a flat top, else the top of a parabola. */
static double peak_position(const uint64_t *cell, uint32_t n, uint32_t peak)
{
    uint32_t last = peak;

    while (last + 1 < n && cell[last + 1] == cell[peak])
        last++;
    if (last > peak || peak == 0 || last + 1 == n)
        return ((double)peak + last + 1.0) / 2.0;
    const double left = (double)cell[peak - 1], mid = (double)cell[peak], right = (double)cell[peak + 1];
    const double bend = left - 2.0 * mid + right;
    return peak + 0.5 + (bend < 0.0 ? fmax(-0.5, fmin(0.5, 0.5 * (left - right) / bend)) : 0.0);
}

/* Bins around the peak in which the level is at least half of the peak's. */
static double half_power_width(const uint64_t *cell, uint32_t n, uint32_t peak)
{
    uint32_t begin = peak, end = peak + 1;

    while (begin > 0 && cell[begin - 1] >= cell[peak] / 2)
        begin--;
    while (end < n && cell[end] >= cell[peak] / 2)
        end++;
    return end - begin;
}

/* Fill *echo from the group begin .. last; returns its contrast, a ratio of powers. */
static double echo_of(const struct extract *e, const struct beam *beam, uint32_t begin, uint32_t last,
                      struct echo *echo)
{
    const struct geometry *g = beam->geometry;
    uint32_t peak = begin;
    double contrast = 0.0, strength = 1.0;

    for (uint32_t i = begin; i <= last; i++) {
        const struct cfar_reference ref = cfar_reference_at(&beam->cfar, &beam->profile, i - beam->first);
        const double ratio = (double)e->cell[i] * ref.cells / fmax((double)ref.sum, 1.0);
        const uint64_t alpha_q16 = ref.one_sided ? beam->cfar.alpha_one_q16 : beam->cfar.alpha_q16;
        contrast = fmax(contrast, saturated(e, beam->samples, i) ? e->contrast : ratio);
        strength = fmax(strength, ratio * 65536.0 / (double)alpha_q16);
        if (e->cell[i] > e->cell[peak])
            peak = i;
    }
    const double first_m = g->r0 + beam->first * g->dr;
    *echo = (struct echo){
        .range_m = (float)fmax(g->r0 + peak_position(e->cell, g->n, peak) * g->dr, first_m),
        .near_m = (float)(g->r0 + begin * g->dr),
        .sd_m = (float)(half_power_width(e->cell, g->n, peak) * g->dr / sqrt(12.0)),
        .strength = (float)strength,
        .confidence = (float)(strength / (1.0 + strength)),
    };
    return contrast;
}

/* End of the stretch behind the ring-down in which no window is without any sound. */
static uint32_t heard_until(const struct extract *e, const struct beam *beam)
{
    const struct geometry *g = beam->geometry;
    uint32_t end = beam->first;

    for (uint32_t i = beam->first; i < g->n && i - end < g->window; i++)
        if (count_at(e, beam->samples, i) > 0)
            end = i + 1;
    return end;
}

static double free_without_echo(const struct extract *e, const struct beam *beam)
{
    const struct geometry *g = beam->geometry;

    switch (e->conf.no_echo) {
    case EXTRACT_HEARD:
        return g->r0 + heard_until(e, beam) * g->dr;
    case EXTRACT_RANGE:
        return g->r0 + g->n * g->dr;
    case EXTRACT_MINIMUM:
        break;
    }
    return fmin(e->conf.minimum_range_m, g->r0 + heard_until(e, beam) * g->dr);
}

/* Every bin from `first` on at full scale, or every bin of the beam at zero: the receiver said nothing. */
static bool is_dumb(const struct extract *e, const struct beam *beam)
{
    const uint32_t n = beam->geometry->n;
    uint32_t loud = beam->first, silent = 0;

    while (loud < n && saturated(e, beam->samples, loud))
        loud++;
    while (silent < n && count_at(e, beam->samples, silent) == 0)
        silent++;
    return loud == n || silent == n;
}

static void extract_profile(struct extract *e, const struct geometry *g, const struct ping *ping, uint16_t b,
                            const struct extract_aid *aid, struct beam_echoes *out)
{
    const size_t at = (size_t)b * g->n;
    const void *samples = (const uint8_t *)ping->samples + at * ping->sample_bytes;
    struct beam beam = {.geometry = g, .samples = samples};
    if (aid) {
        beam.blind = aid->blind ? aid->blind + at : NULL;
        beam.clean = aid->clean ? aid->clean + at : NULL;
        beam.lowest = aid->lowest;
    }
    float doubt_m = INFINITY;
    const uint64_t bins = 2 * (uint64_t)g->half + 1;
    unsigned shift = 0; /* needed for 16-bit samples and long pulses only */

    while (bins * amplitude_of(&e->amplitude, e->amplitude.max_count) >> shift > CFAR_MAX_POWER)
        shift++;
    const uint64_t floor_power = bins * amplitude_of(&e->amplitude, e->conf.floor_counts) >> shift;
    amplitude_convert(&e->amplitude, samples, g->n, e->work);
    sum_cells(e->work, g->n, g->half, shift, e->cell);
    beam.first = ring_down_end(e, g, samples, floor_power);
    if (beam.first >= g->n || is_dumb(e, &beam) || !detect(e, &beam, floor_power))
        return;

    out->blind_m = (float)(g->r0 + beam.first * g->dr);
    out->state = BEAM_SILENT;
    for (uint32_t i = beam.first; i < g->n && out->n < ECHOES_PER_BEAM; i++) {
        if (!stands_out(e, &beam, i))
            continue;
        const uint32_t last = group_end(e, &beam, i);
        const double contrast = echo_of(e, &beam, i, last, &out->echo[out->n]);
        if (contrast >= e->contrast)
            out->n++;
        else if (contrast >= e->contrast * DOUBTFUL && out->n == 0)
            doubt_m = fminf(doubt_m, out->echo[0].near_m);
        i = last;
    }
    if (out->n > 0) {
        out->state = BEAM_ECHO;
        out->free_to_m = out->echo[0].near_m;
    } else {
        out->free_to_m = (float)free_without_echo(e, &beam);
    }
    out->free_to_m = fminf(out->free_to_m, doubt_m);
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

/* The device has picked the ranges itself, listening from begin_m on: n of them in one beam. */
static void extract_ranges(const struct extract *e, double begin_m, const struct ping_beam *beam, uint16_t n,
                           struct beam_echoes *out)
{
    out->state = BEAM_SILENT;
    const double known_m = fmax(e->conf.ring_down_m, begin_m > 0.0 && begin_m < 1e5 ? begin_m : 0.0);
    out->blind_m = (float)(known_m > 0.0 ? known_m : RANGES_BLIND_M);
    if (!is_range(beam->range_m)) {
        out->free_to_m = (float)e->conf.minimum_range_m;
        return;
    }
    out->state = BEAM_ECHO;
    for (; out->n < n && out->n < ECHOES_PER_BEAM; out->n++, beam++) {
        const float sd = beam->range_sd_m >= 0.0f && beam->range_sd_m < 1e5f ? beam->range_sd_m : 0.0f;
        const float confidence = beam->confidence >= 0.0f ? fminf(beam->confidence, 1.0f) : 0.0f;
        out->echo[out->n] = (struct echo){
            .range_m = beam->range_m,
            .near_m = fmaxf(beam->range_m - sd, 0.0f),
            .sd_m = sd,
            .strength = 1.0f,
            .confidence = confidence,
        };
    }
    out->free_to_m = out->echo[0].near_m;
}

/* ---- one ping ---- */

void extract_run(struct extract *extract, const struct ping *ping, const struct extract_aid *aid,
                 struct echoes *out)
{
    struct geometry g;
    const bool ready = ping->kind == PING_RANGES;
    const bool profile = !ready && geometry_of(extract, ping, &g) && amplitude_for(extract, ping);
    const double end_m = (double)ping->r0_m + (double)ping->n_bins * (double)ping->dr_m;

    out->t_ns = ping->t_ns;
    out->t_in_ns = ping->t_in_ns;
    out->seq = ping->seq;
    out->sensor = ping->sensor;
    out->n_beams = 0;
    out->range_max_m = end_m > 0.0 && end_m < 1e6 ? (float)end_m : 0.0f;
    out->az_aperture_rad = ping->az_aperture_rad;
    out->el_aperture_rad = ping->el_aperture_rad;
    out->pose = ping->pose;

    for (uint16_t b = 0, n = 1; b < ping->n_beams && out->n_beams < out->max_beams; b = (uint16_t)(b + n)) {
        struct beam_echoes *beam = &out->beam[out->n_beams++];
        *beam = (struct beam_echoes){
            .az_rad = ping->beam[b].az_rad, .el_rad = ping->beam[b].el_rad, .state = BEAM_BLIND};
        if (ping->flags & PING_UNHEARD)
            continue;
        if (ready)
            extract_ranges(extract, (double)ping->r0_m, &ping->beam[b], n = echoes_of_beam(ping, b), beam);
        else if (profile)
            extract_profile(extract, &g, ping, b, aid, beam);
    }
}
