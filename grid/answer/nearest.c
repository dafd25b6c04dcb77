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
    bool turned;        /* the axes asked about are not the grid's ... */
    double attitude[4]; /* ... but this, in them */
};

/* A direction in the axes asked about. */
static void axis_of(const struct scene *s, uint32_t d, double v[3])
{
    memcpy(v, s->picture->axis[d], sizeof s->picture->axis[d]);
    if (s->turned)
        quat_rotate_inverse(s->attitude, v, v);
}

/* The band of elevations asked about, in sines. */
struct band {
    double lo, hi;
};

/* Where things so far away are in the band, or may be from where the vehicle may be. An angle on the edge is in it. */
static struct band band_at(const struct scene *s, double range_m)
{
    const double aside = sight_aside_rad(&s->place, range_m) + (s->query->ned ? 0 : s->place.turned_rad);
    const double lo = fmax(s->query->lo_rad - aside, -GEO_PI / 2), hi = fmin(s->query->hi_rad + aside, GEO_PI / 2);
    return (struct band){sin(lo) - 1e-12, sin(hi) + 1e-12};
}

static bool in_band(const struct scene *s, const struct band *band, uint32_t d)
{
    double v[3];
    if (band->lo <= -1 && band->hi >= 1)
        return true;
    axis_of(s, d, v);
    return -v[2] >= band->lo && -v[2] <= band->hi;
}

static void see(const struct scene *s, uint32_t d, struct picture_entry *e, struct sight *sight)
{
    sight_look(s->picture, d, s->conf, s->now, &s->place, e, sight);
}

static double reach_of(const struct scene *s)
{
    return s->query->reach_m > 0 ? s->query->reach_m : INFINITY;
}

/* Its near edge, INFINITY without one. */
static double find(const struct scene *s, struct nearest *out)
{
    double best_m = INFINITY, v[3];
    for (uint32_t d = 0; d < s->picture->n; d++) {
        struct picture_entry e;
        struct sight sight;
        if (picture_edge_m(s->picture, d) - s->place.moved_m >= best_m) /* nothing there is nearer */
            continue;
        see(s, d, &e, &sight);
        if (!sight.obstacle || sight.near_m >= best_m || sight.near_m > reach_of(s))
            continue;
        const struct band band = band_at(s, sight.near_m + s->place.moved_m);
        if (!in_band(s, &band, d))
            continue;
        best_m = sight.near_m;
        out->state = ANSWER_BLOCKED;
        axis_of(s, d, v);
        geo_angles(v, &out->az_rad, &out->el_rad);
        out->range_m = fmax(sight.near_m, sight.obstacle->range_m - s->place.moved_m);
        out->range_sd_m = sight.obstacle->sd_m;
        out->confidence = 1 / (1 + exp(-sight.logodds));
        out->age_s = sight_seconds(s->now->now_ns, sight.obstacle->t_echo_ns);
    }
    return best_m;
}

/* How much of the water nearer than that is not known; the gravest reason is told. */
static void weigh(const struct scene *s, double to_m, struct nearest *out)
{
    uint32_t asked = 0, unknown = 0, blank = 0;
    const struct band band = band_at(s, to_m);
    double oldest_s = -1;
    for (uint32_t d = 0; d < s->picture->n; d++) {
        struct picture_entry e;
        struct sight sight;
        if (!in_band(s, &band, d))
            continue;
        asked++;
        if (picture_blank(s->picture, d)) {
            blank++;
            continue;
        }
        see(s, d, &e, &sight);
        const enum answer_reason why = sight.reason != ANSWER_HEARD  ? sight.reason
                                       : to_m <= sight.blind_m       ? ANSWER_BLIND
                                       : sight.clear_m < to_m - 1e-9 ? ANSWER_BEYOND
                                                                     : ANSWER_HEARD;
        unknown += why != ANSWER_HEARD;
        out->reason = why > out->reason ? why : out->reason;
        oldest_s = fmax(oldest_s, sight.age_s);
    }
    if (blank && out->reason < ANSWER_NEVER)
        out->reason = ANSWER_NEVER;
    out->unknown_share = asked ? (double)(unknown + blank) / asked : 1;
    if (!asked)
        out->reason = ANSWER_OUTSIDE;
    if (out->state != ANSWER_BLOCKED)
        out->age_s = oldest_s;
}

static void look_once(struct scene *s, struct nearest *out)
{
    *out = (struct nearest){.state = ANSWER_UNKNOWN, .age_s = -1, .unknown_share = 1};
    picture_get_frame(s->picture, &s->frame);
    if (!sight_possible(&s->frame, s->now, s->query->ned, &out->reason))
        return;
    sight_locate(&s->frame, s->now, &s->place);
    s->turned = sight_attitude(&s->frame, s->now, s->query->ned, s->attitude);
    const double near_m = find(s, out);
    const double tilt =
        s->frame.ned && !s->query->ned ? sight_tilt(s->now->pose.attitude) + s->place.turned_rad : 0;
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
