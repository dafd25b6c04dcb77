/* SPDX-License-Identifier: MIT */
/*
 * cleanup - pings wait in a short queue until the rows that their median needs have come; then they go through the
 * stages in order of arrival.
 */
#include "cleanup.h"

#include <math.h>
#include <string.h>

#include "clahe_causal.h"
#include "median.h"
#include "otsu.h"
#include "polar.h"
#include "survivors.h"
#include "turn.h"

#define MAX_DELAY (MEDIAN_MAX_SIZE / 2)
#define ARRAYS    5 /* of max_bins in a slot */

/* A ping in the queue. */
struct slot {
    struct ping ping;
    struct ping_beam beam;
    uint32_t row;
    uint64_t image; /* of which image it is: their number in cleanup */
    bool has_blind, has_own;
    int lowest;
    uint8_t *sample;  /* [max_bins] as it came ... */
    uint8_t *reduced; /* ... less the background */
    uint8_t *blind, *own, *clean;
};

struct cleanup {
    struct cleanup_conf conf;
    struct mount mount;
    uint32_t max_bins;
    struct polar polar;
    struct slot slot[MAX_DELAY + 1];
    uint32_t first, waiting, ready; /* the queue: `ready` clean ones from `first` on, then those that wait */
    uint64_t passed, images;        /* pings that are no image; images started */
    int threshold, lowest;
    uint8_t *image; /* [rows][n_bins] less the background: what the median looks at; NULL without a median */
    void *work;
    struct turn smooth; /* what comes out of the median, for Otsu's threshold */
    struct clahe_causal clahe;
    struct turn contrast;       /* what comes out of CLAHE, for the classes, ... */
    struct survivors survivors; /* ... or what the detector leaves of that */
};

/* Of which counts are the classes? */
static bool of_all(const struct cleanup_conf *conf)
{
    return conf->classes && !conf->survivors;
}

static bool of_survivors(const struct cleanup_conf *conf)
{
    return conf->classes && conf->survivors;
}

bool cleanup_wanted(const struct cleanup_conf *conf)
{
    return conf->median || conf->otsu || conf->clahe || conf->classes;
}

unsigned cleanup_delay(const struct cleanup_conf *conf)
{
    return conf->median / 2;
}

/* ---- start ---- */

static size_t round_up(size_t n)
{
    return (n + _Alignof(max_align_t) - 1) / _Alignof(max_align_t) * _Alignof(max_align_t);
}

/* Bytes for one of the stages; in the order in which cleanup_init hands them out. */
struct layout {
    size_t slots, image, work, smooth, clahe, contrast, survivors, end;
};

static struct layout layout_for(const struct cleanup_conf *conf, uint32_t max_bins)
{
    const size_t turn = round_up(turn_size(POLAR_MAX_ROWS, max_bins, 1));
    struct layout l = {.slots = round_up(sizeof(struct cleanup))};
    l.image = l.slots + round_up(ARRAYS * (size_t)max_bins * (MAX_DELAY + 1));
    l.work = l.image + (conf->median ? round_up((size_t)POLAR_MAX_ROWS * max_bins) : 0);
    l.smooth = l.work + (conf->median ? round_up(median_work_size(max_bins)) : 0);
    l.clahe = l.smooth + (conf->otsu ? turn : 0);
    l.contrast = l.clahe + (conf->clahe ? round_up(clahe_causal_size(POLAR_MAX_ROWS, max_bins)) : 0);
    l.survivors = l.contrast + (of_all(conf) ? turn : 0);
    l.end = l.survivors + (of_survivors(conf) ? round_up(survivors_size(POLAR_MAX_ROWS, max_bins)) : 0);
    return l;
}

size_t cleanup_size(const struct cleanup_conf *conf, uint32_t max_bins)
{
    return layout_for(conf, max_bins).end;
}

struct cleanup *cleanup_init(void *mem, const struct cleanup_conf *conf, const struct mount *mount,
                             uint32_t max_bins, struct fault *fault)
{
    if ((conf->median != 0 && conf->median != 3 && conf->median != 5) ||
        !(conf->clip >= 1.0 && conf->clip <= 100.0)) {
        fault_set(fault, "cleanup: median is %u, allowed is 0, 3 or 5; clahe_clip is %g, allowed is 1 to 100",
                  conf->median, conf->clip);
        return NULL;
    }
    const struct layout l = layout_for(conf, max_bins);
    struct cleanup *c = mem;
    uint8_t *base = mem;
    memset(mem, 0, l.end);
    c->conf = *conf;
    c->mount = *mount;
    c->max_bins = max_bins;
    c->threshold = c->lowest = -1;
    polar_init(&c->polar);
    for (uint32_t i = 0; i <= MAX_DELAY; i++) {
        struct slot *s = &c->slot[i];
        s->sample = base + l.slots + ARRAYS * (size_t)max_bins * i;
        s->reduced = s->sample + max_bins;
        s->blind = s->reduced + max_bins;
        s->own = s->blind + max_bins;
        s->clean = s->own + max_bins;
    }
    c->image = base + l.image;
    c->work = base + l.work;
    if (conf->otsu)
        turn_init(&c->smooth, base + l.smooth, POLAR_MAX_ROWS, max_bins, 1);
    if (conf->clahe)
        clahe_causal_init(&c->clahe, base + l.clahe, POLAR_MAX_ROWS, max_bins,
                          (uint32_t)(conf->clip * 100.0 + 0.5));
    if (of_all(conf))
        turn_init(&c->contrast, base + l.contrast, POLAR_MAX_ROWS, max_bins, 1);
    if (of_survivors(conf))
        survivors_init(&c->survivors, base + l.survivors, POLAR_MAX_ROWS, max_bins);
    return c;
}

static void begin_image(struct cleanup *c)
{
    const uint32_t rows = c->polar.rows, bins = c->polar.n_bins;
    c->images++;
    if (c->conf.otsu)
        turn_begin(&c->smooth, rows, bins, 1, 1);
    if (c->conf.clahe)
        clahe_causal_begin(&c->clahe, rows, bins);
    if (of_all(&c->conf))
        turn_begin(&c->contrast, rows, bins, 1, 1);
    if (of_survivors(&c->conf))
        survivors_begin(&c->survivors, rows, bins);
}

/* ---- the stages ---- */

/* How far the body moved from pose a to pose b, in NED; false when nothing says so. */
static bool way_between(const struct pose *a, const struct pose *b, double dt_s, double way_m[3])
{
    if (a->has & b->has & POSE_POSITION) {
        for (int i = 0; i < 3; i++)
            way_m[i] = b->position_m[i] - a->position_m[i];
        return true;
    }
    for (int i = 0; i < 3; i++)
        way_m[i] = 0.5 * (a->velocity_mps[i] + b->velocity_mps[i]) * dt_s;
    return (a->has & b->has & POSE_VELOCITY) != 0;
}

/* By how many bins what was at a place in row r is nearer, or (negative) farther, when the ping of the slot is sent. */
static double approach_bins(const struct cleanup *c, const struct slot *s, const struct polar_row *r)
{
    const struct pose *now = &s->ping.pose;
    const double dt_s = (double)(int64_t)(s->ping.t_ns - r->t_ns) * 1e-9;
    double way_m[3], axis[3];
    if (!(now->has & POSE_ATTITUDE) || !way_between(&r->pose, now, dt_s, way_m))
        return 0.0;
    geo_direction((double)s->beam.az_rad, (double)s->beam.el_rad, axis);
    quat_rotate(c->mount.attitude, axis, axis);
    quat_rotate(now->attitude, axis, axis);
    return (way_m[0] * axis[0] + way_m[1] * axis[1] + way_m[2] * axis[2]) / (double)s->ping.dr_m;
}

static int32_t shift_of(const struct cleanup *c, const struct slot *s, const struct polar_row *r)
{
    const double bins = approach_bins(c, s, r), most = (double)s->ping.n_bins;
    return bins >= -most && bins <= most ? -(int32_t)floor(bins + 0.5) : 0;
}

static void smooth(const struct cleanup *c, const struct slot *s, uint8_t *out)
{
    const int reach = (int)c->conf.median / 2;
    struct median_row row[MEDIAN_MAX_SIZE] = {{0}};
    for (int k = -reach; k <= reach; k++) {
        const struct polar_row *r = k ? polar_neighbour(&c->polar, s->row, k) : NULL;
        if (r)
            row[k + reach] = (struct median_row){
                .bin = c->image + (size_t)polar_index(&c->polar, r) * c->polar.n_bins, .shift = shift_of(c, s, r)};
    }
    row[reach] = (struct median_row){.bin = s->reduced};
    median_filter(c->conf.median, row, s->ping.n_bins, c->work, out);
}

static void histogram_of(const struct turn *t, uint64_t count[256])
{
    uint64_t pixels;
    const uint32_t *of_turn = turn_histogram(t, 0, 0, &pixels);
    for (int v = 0; v < 256; v++)
        count[v] = of_turn[v];
}

static void cut_background(struct cleanup *c, uint32_t row, uint32_t n, uint8_t *bin)
{
    uint64_t count[256];
    uint8_t t;
    turn_put(&c->smooth, row, bin);
    histogram_of(&c->smooth, count);
    c->threshold = otsu_two(count, &t) ? t : -1;
    for (uint32_t i = 0; i < n; i++)
        bin[i] = bin[i] > c->threshold ? bin[i] : 0;
}

static int lowest_class(struct cleanup *c, uint32_t row, const uint8_t *bin)
{
    uint64_t count[256];
    uint8_t t[2];
    turn_put(&c->contrast, row, bin);
    histogram_of(&c->contrast, count);
    if (otsu_three(count, t))
        return t[0];
    return otsu_two(count, t) ? t[0] : -1;
}

/* The oldest ping that waits goes through the stages. */
static void clean_oldest(struct cleanup *c)
{
    struct slot *s = &c->slot[(c->first + c->ready) % (MAX_DELAY + 1)];
    const uint32_t n = s->ping.n_bins;
    if (c->conf.median)
        smooth(c, s, s->clean);
    else
        memcpy(s->clean, s->reduced, n);
    if (c->conf.otsu)
        cut_background(c, s->row, n, s->clean);
    if (c->conf.clahe)
        clahe_causal_row(&c->clahe, s->row, s->ping.flags & PING_NEW_TURN, s->clean, s->clean);
    s->lowest = c->conf.otsu && c->threshold >= 0 ? 0 : -1; /* what Otsu took away */
    if (of_all(&c->conf))
        s->lowest = c->lowest = lowest_class(c, s->row, s->clean);
    c->ready++;
    c->waiting--;
}

/* ---- pings in and out ---- */

static bool is_image(const struct cleanup *c, const struct ping *p)
{
    return p->kind == PING_PROFILE && p->sample_bytes == 1 && p->n_beams == 1 && p->n_bins > 0 &&
           p->n_bins <= c->max_bins && !(p->flags & PING_UNHEARD);
}

static void fill_slot(struct slot *s, const struct ping *ping, const uint8_t *background, const uint8_t *blind,
                      const uint8_t *own)
{
    const uint8_t *sample = ping->samples;
    const uint32_t n = ping->n_bins;
    s->ping = *ping;
    s->beam = ping->beam[0];
    s->ping.beam = &s->beam;
    s->ping.samples = s->sample;
    memcpy(s->sample, sample, n);
    for (uint32_t i = 0; i < n; i++) {
        const uint8_t less = background ? background[i] : 0;
        s->reduced[i] = (uint8_t)(sample[i] > less ? sample[i] - less : 0);
    }
    s->has_blind = blind != NULL;
    if (blind)
        memcpy(s->blind, blind, n);
    s->has_own = own != NULL;
    if (own)
        memcpy(s->own, own, n);
}

bool cleanup_put(struct cleanup *c, const struct ping *ping, const uint8_t *background, const uint8_t *blind,
                 const uint8_t *own)
{
    const bool image = is_image(c, ping), fits = image && polar_fits(&c->polar, ping);
    while (c->waiting > 0 && !fits)
        clean_oldest(c);
    if (!image) {
        c->passed++;
        return false;
    }
    struct slot *s = &c->slot[(c->first + c->ready + c->waiting) % (MAX_DELAY + 1)];
    fill_slot(s, ping, background, blind, own);
    s->row = polar_place(&c->polar, ping);
    if (!fits)
        begin_image(c);
    s->image = c->images;
    if (c->conf.median)
        memcpy(c->image + (size_t)s->row * ping->n_bins, s->reduced, ping->n_bins);
    c->waiting++;
    if (c->waiting > (ping->head_turn ? cleanup_delay(&c->conf) : 0))
        clean_oldest(c);
    return true;
}

const struct ping *cleanup_next(struct cleanup *c, struct extract_aid *aid)
{
    if (c->ready == 0)
        return NULL;
    struct slot *s = &c->slot[c->first];
    c->first = (c->first + 1) % (MAX_DELAY + 1);
    c->ready--;
    *aid = (struct extract_aid){.blind = s->has_blind ? s->blind : NULL,
                                .own = s->has_own ? s->own : NULL,
                                .clean = s->clean,
                                .lowest = s->lowest};
    if (of_survivors(&c->conf) && s->image == c->images) {
        c->survivors.row = s->row;
        aid->survivors = &c->survivors;
    }
    return &s->ping;
}

unsigned cleanup_held(const struct cleanup *c)
{
    return c->waiting;
}

void cleanup_state(const struct cleanup *c, struct cleanup_state *out)
{
    *out = (struct cleanup_state){.rows = c->polar.n_bins ? c->polar.rows : 0,
                                  .held = c->waiting,
                                  .restarts = c->polar.restarts,
                                  .passed = c->passed,
                                  .otsu = c->threshold,
                                  .lowest = of_survivors(&c->conf) ? c->survivors.lowest : c->lowest};
}
