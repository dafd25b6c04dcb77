/* SPDX-License-Identifier: MIT */
#include "nearest.h"

#include <math.h>
#include <string.h>

#include "sight.h"

/* The picture, seen from one place at one moment. */
struct scene {
    struct picture *picture;
    const struct answer_conf *conf;
    const struct answer_now *now;
    const struct nearest_query *query;
    struct picture_frame frame;
    struct sight_place place;
    struct sight_fade fade;
    bool turned;        /* the axes asked about are not the grid's ... */
    double attitude[4]; /* ... but this, in them */
    double turn[3][3];  /* the same: each of them in the grid's */
};

/* A direction in the axes asked about. */
static void axis_of(const struct scene *s, uint32_t d, double v[3])
{
    memcpy(v, s->picture->axis[d], sizeof s->picture->axis[d]);
    if (s->turned)
        quat_rotate_inverse(s->attitude, v, v);
}

/* The elevations asked about, in sines, and the azimuths: from their middle to either side. */
struct window {
    double lo, hi;
    double middle_rad, half_rad;
    double middle[2], half[2]; /* their cosine and sine */
    double aside;              /* sine of how far beside them a direction still counts */
};

/* Of the axes asked about against the world's. */
static double tilt_rad(const struct scene *s)
{
    return s->frame.ned && !s->query->ned ? sight_tilt(s->now->pose.attitude) : 0;
}

/* How far those axes may lie beside where they are taken to be, but about the vertical. */
static double uncertain_rad(const struct scene *s)
{
    return (s->query->ned ? 0 : s->place.turned_rad) + s->place.adrift_rad * sin(tilt_rad(s));
}

/* Where things so far away are in the window, or may be from where the vehicle may be. What is on the edge is in it. */
static struct window window_at(const struct scene *s, double range_m)
{
    const struct nearest_query *q = s->query;
    const double aside = sight_aside_rad(&s->place, range_m) + uncertain_rad(s);
    const double lo = fmax(q->lo_rad - aside, -GEO_PI / 2), hi = fmin(q->hi_rad + aside, GEO_PI / 2);
    const double width = q->width_rad > 0 ? q->width_rad : GEO_TURN, half = width / 2 + s->place.adrift_rad;
    return (struct window){.lo = sin(lo) - 1e-12,
                           .hi = sin(hi) + 1e-12,
                           .middle_rad = q->from_rad + width / 2,
                           .middle = {cos(q->from_rad + width / 2), sin(q->from_rad + width / 2)},
                           .half_rad = half,
                           .half = {cos(half), sin(half)},
                           .aside = sin(fmin(aside + s->picture->rings->step_rad, GEO_PI / 2))};
}

static bool is_whole(const struct window *w)
{
    return w->lo <= -1 && w->hi >= 1 && w->half_rad >= GEO_PI;
}

#define SURE 1e-9 /* more than the sines and cosines here are ever wrong */

/* Is it well within the azimuths, or so far from them that it does not count? 0: neither is sure. */
static inline int rough_in_azimuth(const struct window *w, double x, double y)
{
    const double level = sqrt(x * x + y * y);
    const double along = x * w->middle[0] + y * w->middle[1];
    if (along > level * w->half[0] + SURE)
        return 1;
    const double across = fabs(x * w->middle[1] - y * w->middle[0]);
    const double off =
        along * w->half[0] + across * w->half[1] > 0 ? across * w->half[0] - along * w->half[1] : level;
    return along < level * w->half[0] - SURE && off > w->aside + SURE ? -1 : 0;
}

/* The azimuths end in half planes; what is more than a right angle from one is nearest to it at the vertical. */
static bool in_azimuth(const struct window *w, const double v[3])
{
    const double off = fabs(geo_wrap_pi(atan2(v[1], v[0]) - w->middle_rad)) - w->half_rad;
    return off <= 0 || hypot(v[0], v[1]) * sin(fmin(off, GEO_PI / 2)) <= w->aside;
}

/* in_window of the axis turned by the matrix, whose last digits differ. 0: that could decide. */
static inline int rough_in_window(const struct scene *s, const struct window *w, const double axis[3])
{
    const double up = -geo_dot(s->turn[2], axis);
    if (up < w->lo - SURE || up > w->hi + SURE)
        return -1;
    if (up < w->lo + SURE || up > w->hi - SURE)
        return 0;
    if (w->half_rad >= GEO_PI)
        return 1;
    return rough_in_azimuth(w, geo_dot(s->turn[0], axis), geo_dot(s->turn[1], axis));
}

static bool exactly_in_window(const struct scene *s, const struct window *w, uint32_t d)
{
    double v[3];
    axis_of(s, d, v);
    return -v[2] >= w->lo && -v[2] <= w->hi && (w->half_rad >= GEO_PI || in_azimuth(w, v));
}

static inline bool in_window(const struct scene *s, const struct window *w, uint32_t d)
{
    const int rough = rough_in_window(s, w, s->picture->axis[d]);
    return rough ? rough > 0 : exactly_in_window(s, w, d);
}

static double reach_of(const struct scene *s)
{
    return s->query->reach_m > 0 ? s->query->reach_m : INFINITY;
}

/* Reports the obstacle of direction d if it is nearer than *best_m. */
static void compare(struct scene *s, uint32_t d, double *best_m, struct nearest *out)
{
    struct picture_entry e;
    struct sight sight;
    double v[3];
    if (picture_edge_m(s->picture, d) - s->place.moved_m >= *best_m) /* nothing there is nearer */
        return;
    const struct sight_observer by = {s->conf, s->now, &s->place, s->query->near_m, *best_m, &s->fade};
    sight_look_told(s->picture, d, &by, &e, &sight);
    if (!sight.obstacle || sight.near_m >= *best_m || sight.near_m > reach_of(s))
        return;
    const struct window window = window_at(s, sight.near_m + s->place.moved_m);
    if (!is_whole(&window) && !in_window(s, &window, d))
        return;
    *best_m = sight.near_m;
    out->state = ANSWER_BLOCKED;
    axis_of(s, d, v);
    geo_angles(v, &out->az_rad, &out->el_rad);
    out->range_m = fmax(sight.near_m, sight.obstacle->range_m - s->place.moved_m);
    out->range_sd_m = sight.obstacle->sd_m;
    out->confidence = 1 / (1 + exp(-sight.logodds));
    out->age_s = sight_seconds(s->now->now_ns, sight.obstacle->t_echo_ns);
}

/* Its near edge, INFINITY without one. */
static double find_nearest(struct scene *s, struct nearest *out)
{
    double best_m = INFINITY;
    for (uint32_t block = 0; block * 64 < s->picture->n; block++)
        for (uint64_t left = picture_block(s->picture, block).obstacle; left; left &= left - 1) {
            const uint32_t d = block * 64 + (uint32_t)__builtin_ctzll(left);
            if (d < s->picture->n)
                compare(s, d, &best_m, out);
        }
    return best_m;
}

/* Directions of the window while they are counted. */
struct weight {
    uint32_t asked, unknown, blank;
    double oldest_s; /* ping of their water */
};

static inline void weigh_direction(struct scene *s, uint32_t d, const struct sight_observer *by, struct weight *w,
                                   struct nearest *out)
{
    const double to_m = by->to_m;
    struct picture_entry e;
    struct sight sight;
    if (!sight_glance(s->picture, d, by, &sight))
        sight_look_told(s->picture, d, by, &e, &sight);
    const enum answer_reason why = sight.reason != ANSWER_HEARD  ? sight.reason
                                   : to_m <= sight.blind_m       ? ANSWER_BLIND
                                   : sight.clear_m < to_m - 1e-9 ? sight_beyond(&sight)
                                                                 : ANSWER_HEARD;
    w->unknown += why != ANSWER_HEARD;
    out->reason = why > out->reason ? why : out->reason;
    w->oldest_s = sight_more(w->oldest_s, sight.age_s);
}

static uint32_t bits_in(uint64_t w)
{
    uint32_t n = 0;
    for (; w; w &= w - 1)
        n++;
    return n;
}

/* Of directions 64 k to 64 k + 63 those that are in the window, a bit each. */
static uint64_t block_in_window(const struct scene *s, const struct window *window, uint32_t k)
{
    const uint32_t left = s->picture->n - 64 * k, n = left < 64 ? left : 64;
    uint64_t in = 0;
    if (is_whole(window))
        return UINT64_MAX >> (64 - n);
    for (uint32_t i = 0; i < n; i++)
        in |= (uint64_t)in_window(s, window, 64 * k + i) << i;
    return in;
}

/* How much of the water nearer than that is not known; the gravest reason is reported. */
static void weigh(struct scene *s, double to_m, struct nearest *out)
{
    const struct window window = window_at(s, to_m);
    const struct sight_observer by = {s->conf, s->now, &s->place, s->query->near_m, to_m, &s->fade};
    struct weight w = {.oldest_s = -1};
    for (uint32_t k = 0; k * 64 < s->picture->n; k++) {
        const uint64_t in = block_in_window(s, &window, k), told = in & picture_block(s->picture, k).told;
        w.asked += bits_in(in);
        w.blank += bits_in(in & ~told);
        for (uint64_t left = told; left; left &= left - 1)
            weigh_direction(s, 64 * k + (uint32_t)__builtin_ctzll(left), &by, &w, out);
    }
    if (w.blank && out->reason < ANSWER_NEVER)
        out->reason = ANSWER_NEVER;
    out->unknown_share = w.asked ? (double)(w.unknown + w.blank) / w.asked : 1;
    if (!w.asked)
        out->reason = ANSWER_OUTSIDE;
    if (out->state != ANSWER_BLOCKED)
        out->age_s = w.oldest_s;
}

static void look_once(struct scene *s, struct nearest *out)
{
    *out = (struct nearest){.state = ANSWER_UNKNOWN, .age_s = -1, .unknown_share = 1};
    picture_get_frame(s->picture, &s->frame);
    if (!sight_possible(&s->frame, s->now, s->query->ned, &out->reason))
        return;
    sight_locate(s->picture, &s->frame, s->conf, s->now, &s->place);
    s->turned = sight_attitude(&s->frame, s->now, s->query->ned, s->attitude);
    for (int i = 0; i < 3; i++) {
        double *axis = s->turn[i];
        memset(axis, 0, sizeof s->turn[i]);
        axis[i] = 1;
        if (s->turned)
            quat_rotate(s->attitude, axis, axis);
    }
    const double near_m = find_nearest(s, out);
    const double tilt = tilt_rad(s) + uncertain_rad(s);
    weigh(s, isfinite(near_m) ? near_m : s->query->reach_m > 0 ? s->query->reach_m : s->frame.range_max_m, out);
    if (!sight_keeps(s->picture->rings, s->query->lo_rad - tilt, s->query->hi_rad + tilt) &&
        out->reason < ANSWER_OUTSIDE)
        out->reason = ANSWER_OUTSIDE;
    if (out->state != ANSWER_BLOCKED && out->reason == ANSWER_HEARD)
        out->state = ANSWER_CLEAR;
}

void nearest_look(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                  const struct nearest_query *query, struct nearest *out)
{
    struct scene s = {.picture = p, .conf = conf, .now = now, .query = query};
    struct sight_reading r = {.picture = p};
    while (sight_reads(&r))
        look_once(&s, out);
}
