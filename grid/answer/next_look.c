/* SPDX-License-Identifier: MIT */
#include "next_look.h"

#include <math.h>

#include "../geometry.h"

#define AHEAD_GAIN   2.0  /* straight ahead counts so many times more than abeam */
#define AT_REST_MPS  0.02 /* slower is no direction */
#define APPROACH_MPS 0.1  /* that counts as much as never having looked; so do ... */
#define GROWTH_PS    10.0 /* ... so many directions more per second */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double at_most_1(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

/* What the water that way says: how long ago somebody looked. */
static void judge_age(const struct picture_entry *e, uint64_t now_ns, double stale_s, struct next_look *l)
{
    const uint64_t t_ns = e->claim[CLAIM_NOW].t_ping_ns;
    l->why = t_ns ? LOOK_STALE : LOOK_NEVER;
    l->age_s = !t_ns ? -1 : now_ns > t_ns ? (double)(now_ns - t_ns) * 1e-9 : 0;
    l->score = t_ns ? at_most_1(l->age_s / stale_s) : 1;
}

static void judge_clusters(const struct cluster *clusters, uint32_t n, struct next_look *l)
{
    for (uint32_t i = 0; i < n; i++) {
        const struct cluster *k = &clusters[i];
        if (geo_wrap(l->az_rad - k->from_rad) > k->width_rad || l->el_rad < k->low_rad || l->el_rad > k->high_rad)
            continue;
        const double approach = at_most_1(k->approach_mps / APPROACH_MPS);
        const double growth = at_most_1(k->growth_directions_ps / GROWTH_PS);
        if (approach > l->score) {
            l->score = approach;
            l->why = LOOK_APPROACHING;
        }
        if (growth > l->score) {
            l->score = growth;
            l->why = LOOK_GROWING;
        }
    }
}

static double ahead(const double axis[3], const double velocity_mps[3])
{
    const double speed = sqrt(dot(velocity_mps, velocity_mps));
    return speed > AT_REST_MPS ? at_most_1(dot(axis, velocity_mps) / speed) : 0;
}

static bool is_apart(const struct next_look *a, const struct next_look *b, double apart_rad)
{
    double u[3], v[3];
    geo_direction(a->az_rad, a->el_rad, u);
    geo_direction(b->az_rad, b->el_rad, v);
    return dot(u, v) < cos(apart_rad);
}

/* Azimuth, in NED or the body's axes, of the grid's azimuth 0. */
static double axes_of(struct picture *picture)
{
    struct picture_frame frame;
    picture_get_frame(picture, &frame);
    return frame.axes_rad;
}

static void velocity_in_grid(const struct next_look_conf *conf, double axes_rad, double v[3])
{
    const double north = conf->velocity_mps[0], east = conf->velocity_mps[1];
    v[0] = cos(axes_rad) * north + sin(axes_rad) * east;
    v[1] = cos(axes_rad) * east - sin(axes_rad) * north;
    v[2] = conf->velocity_mps[2];
}

/* The middle of direction d, in NED or the body's axes. */
static void place_look(const struct picture *picture, double axes_rad, uint32_t d, struct next_look *l)
{
    rings_centre(picture->rings, d, &l->az_rad, &l->el_rad);
    if (axes_rad != 0)
        l->az_rad = geo_wrap(l->az_rad + axes_rad);
}

/* The best direction that is apart from those found; of equals the one in the middle of the band. */
static bool best_of(struct picture *picture, uint64_t now_ns, const struct next_look_conf *conf,
                    const struct cluster *clusters, uint32_t n_clusters, const struct next_look *found, uint32_t n,
                    struct next_look *best)
{
    const double middle = (conf->low_rad + conf->high_rad) / 2, axes_rad = axes_of(picture);
    double velocity_mps[3];
    velocity_in_grid(conf, axes_rad, velocity_mps);
    best->score = 0;
    for (uint32_t d = 0; d < picture->n; d++) {
        struct next_look l = {.score = 0};
        struct picture_entry e;
        bool apart = true;
        place_look(picture, axes_rad, d, &l);
        if (l.el_rad < conf->low_rad || l.el_rad > conf->high_rad)
            continue;
        for (uint32_t i = 0; i < n && apart; i++)
            apart = is_apart(&l, &found[i], conf->apart_rad);
        if (!apart)
            continue;
        picture_get(picture, d, &e);
        judge_age(&e, now_ns, conf->stale_s, &l);
        judge_clusters(clusters, n_clusters, &l);
        l.score *= 1 + AHEAD_GAIN * ahead(picture->axis[d], velocity_mps);
        const double off = fabs(l.el_rad - middle), best_off = fabs(best->el_rad - middle);
        if (l.score > best->score || (l.score > 0 && l.score == best->score && off < best_off))
            *best = l;
    }
    return best->score > 0;
}

uint32_t next_look(struct picture *picture, uint64_t now_ns, const struct next_look_conf *conf,
                   const struct cluster *clusters, uint32_t n_clusters, struct next_look *out, uint32_t room)
{
    uint32_t n = 0;
    while (n < room && best_of(picture, now_ns, conf, clusters, n_clusters, out, n, &out[n]))
        n++;
    return n;
}

#define SLICES 72 /* of the circle, by which a sector is moved */

bool next_look_sector(struct picture *picture, uint64_t now_ns, const struct next_look_conf *conf,
                      double width_rad, double *az_rad)
{
    double sum[SLICES] = {0}, best = 0;
    int n[SLICES] = {0};
    const int wide = (int)lround(width_rad / GEO_TURN * SLICES);
    const double axes_rad = axes_of(picture);
    double velocity_mps[3];
    velocity_in_grid(conf, axes_rad, velocity_mps);
    for (uint32_t d = 0; d < picture->n; d++) {
        struct next_look l = {.score = 0};
        struct picture_entry e;
        place_look(picture, axes_rad, d, &l);
        if (l.el_rad < conf->low_rad || l.el_rad > conf->high_rad)
            continue;
        picture_get(picture, d, &e);
        judge_age(&e, now_ns, conf->stale_s, &l);
        const int slice = (int)(geo_wrap(l.az_rad) / GEO_TURN * SLICES) % SLICES;
        sum[slice] += l.score * (1 + AHEAD_GAIN * ahead(picture->axis[d], velocity_mps));
        n[slice]++;
    }
    for (int first = 0; first < SLICES; first++) {
        double score = 0;
        int count = 0;
        for (int k = 0; k < wide; k++) {
            score += sum[(first + k) % SLICES];
            count += n[(first + k) % SLICES];
        }
        if (count && score / count > best) {
            best = score / count;
            *az_rad = geo_wrap((first + wide / 2.0) * GEO_TURN / SLICES);
        }
    }
    return best > 0;
}

const char *next_look_word(enum next_look_why why)
{
    static const char *const words[] = {[LOOK_NEVER] = "never looked at",
                                        [LOOK_STALE] = "not looked at for long",
                                        [LOOK_APPROACHING] = "something comes nearer",
                                        [LOOK_GROWING] = "something grows"};
    return words[why];
}
