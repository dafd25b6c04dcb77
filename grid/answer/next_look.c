/* SPDX-License-Identifier: MIT */
#include "next_look.h"

#include <math.h>

#include "grid/geometry.h"

#define AHEAD_GAIN   2.0  /* straight ahead counts so many times more than abeam */
#define AT_REST_MPS  0.02 /* slower is no direction */
#define APPROACH_MPS 0.1  /* that counts as much as never having looked; so do ... */
#define GROWTH_PS    10.0 /* ... so many directions more per second */
#define FEATURE_GAIN 2.0  /* a feature counts as not looked at for so many times as long */
#define EDGE_DEG     3.0  /* a direction is at a cluster's edge within this azimuth, ... */
#define VANISHED_DEG 5.0  /* ... and at a vanished one within this angle */
#define EDGE_M       0.5  /* neighbouring slices whose obstacles are so far apart in range, ... */
#define EDGE_SHARE   0.2  /* ... and this share of the nearer one's range, have an edge between them */
#define JUDGE_WORK   40   /* what a direction costs beside its clusters */
#define MOVED_M      1.0  /* farther than this, and the centre's step, is not stationary */

static double at_most_1(double x)
{
    return x < 0 ? 0 : x > 1 ? 1 : x;
}

/* How long ago a ping looked in that direction. */
static void judge_age(const struct picture_entry *e, uint64_t now_ns, double stale_s, struct next_look *l)
{
    const uint64_t t_ns = e->t_look_ns;
    l->why = t_ns ? LOOK_STALE : LOOK_NEVER;
    l->age_s = !t_ns ? -1 : now_ns > t_ns ? (double)(now_ns - t_ns) * 1e-9 : 0;
    l->score = t_ns ? at_most_1(l->age_s / stale_s) : 1;
}

static void judge_clusters(const struct next_look_ranking *r, struct next_look *l)
{
    for (uint32_t i = 0; i < r->n_here; i++) {
        const struct cluster *k = r->here[i];
        const double approach = at_most_1(k->approach_mps / APPROACH_MPS);
        const double growth = at_most_1(k->growth_directions_ps / GROWTH_PS);
        if (approach <= l->score && growth <= l->score)
            continue;
        if (geo_wrap(l->az_rad - k->from_rad) > k->width_rad || l->el_rad < k->low_rad || l->el_rad > k->high_rad)
            continue;
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

static double as_feature(double age_score)
{
    return at_most_1(FEATURE_GAIN * age_score);
}

/* Between two azimuths in [0, 4 pi). */
static double between_rad(double a_rad, double b_rad)
{
    double d = fabs(a_rad - b_rad);
    if (d >= GEO_TURN)
        d -= GEO_TURN;
    return d > GEO_PI ? GEO_TURN - d : d;
}

static bool at_edge(const struct cluster *k, double az_rad)
{
    return fmin(between_rad(az_rad, k->from_rad), between_rad(az_rad, k->from_rad + k->width_rad)) <=
           geo_rad(EDGE_DEG);
}

/* Its place is as of then: the vehicle moves on, and soon nobody knows in which direction it was. */
static bool is_recent(const struct cluster_gone *gone, uint64_t now_ns, double stale_s)
{
    return now_ns < gone->t_gone_ns || (double)(now_ns - gone->t_gone_ns) * 1e-9 <= stale_s;
}

/* axis: in NED or the body's axes, as places are. */
static bool at_place(const double axis[3], const double place_m[3])
{
    const double range_m = sqrt(geo_dot(place_m, place_m));
    return range_m > 0 && geo_dot(axis, place_m) >= cos(geo_rad(VANISHED_DEG)) * range_m;
}

/* age_score: of the direction, before clusters were judged. */
static void judge_features(const struct next_look_ranking *r, double age_score, struct next_look *l)
{
    const struct next_look_conf *conf = &r->conf;
    const double score = as_feature(age_score);
    enum next_look_why why = l->why;
    double axis[3];
    if (score <= l->score)
        return;
    geo_direction(l->az_rad, l->el_rad, axis);
    for (uint32_t i = 0; i < r->n_here && why != LOOK_EDGE; i++)
        if (l->el_rad >= r->here[i]->low_rad && l->el_rad <= r->here[i]->high_rad &&
            at_edge(r->here[i], l->az_rad))
            why = LOOK_EDGE;
    for (uint32_t i = 0; i < conf->n_gone && why != LOOK_VANISHED; i++)
        if (is_recent(&conf->gone[i], r->now_ns, conf->stale_s) && at_place(axis, conf->gone[i].place_m))
            why = LOOK_VANISHED;
    if (why == LOOK_EDGE || why == LOOK_VANISHED) {
        l->score = score;
        l->why = why;
    }
}

static double ahead(const double axis[3], const double velocity_mps[3])
{
    const double speed = sqrt(geo_dot(velocity_mps, velocity_mps));
    return speed > AT_REST_MPS ? at_most_1(geo_dot(axis, velocity_mps) / speed) : 0;
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

/* ---- a ranking ---- */

void next_look_begin(struct next_look_ranking *r, uint64_t now_ns, const struct next_look_conf *conf,
                     struct next_look_score *score, uint32_t room)
{
    r->conf = *conf;
    r->now_ns = now_ns;
    r->score = score;
    r->room = room;
    r->n = 0;
    r->started = r->judged = false;
}

/* Those of which a direction of the ring may be a part. */
static void enter_ring(struct next_look_ranking *r, const struct picture *picture, uint32_t ring)
{
    const struct rings *rings = picture->rings;
    const double top = rings->top_rad - ring * rings->height_rad, bottom = top - rings->height_rad;
    r->ring = ring;
    r->n_here = 0;
    for (uint32_t i = 0; i < r->conf.n_clusters; i++)
        if (r->conf.clusters[i].low_rad <= top && r->conf.clusters[i].high_rad >= bottom)
            r->here[r->n_here++] = &r->conf.clusters[i];
    r->work += r->conf.n_clusters;
}

static void judge(struct next_look_ranking *r, struct picture *picture, const double velocity_mps[3], uint32_t d)
{
    struct next_look l = {.score = 0};
    struct picture_entry e;
    r->score[d] = (struct next_look_score){.score = 0};
    place_look(picture, r->axes_rad, d, &l);
    if (l.el_rad < r->conf.low_rad || l.el_rad > r->conf.high_rad)
        return;
    picture_get(picture, d, &e);
    judge_age(&e, r->now_ns, r->conf.stale_s, &l);
    const double age_score = l.score;
    judge_clusters(r, &l);
    judge_features(r, age_score, &l);
    l.score *= 1 + AHEAD_GAIN * ahead(picture->axis[d], velocity_mps);
    r->score[d] = (struct next_look_score){.score = l.score, .age_s = (float)l.age_s, .why = l.why};
}

/* Some directions. Axes that have turned since the first make the azimuths of all others: then it begins anew. */
static void judge_some(struct next_look_ranking *r, struct picture *picture)
{
    const double axes_rad = axes_of(picture);
    double velocity_mps[3];
    if (!r->started || axes_rad != r->axes_rad) {
        r->started = true;
        r->axes_rad = axes_rad;
        r->next = 0;
    }
    velocity_in_grid(&r->conf, axes_rad, velocity_mps);
    for (; r->next < picture->n && r->work < NEXT_LOOK_STEP; r->next++) {
        const uint32_t ring = rings_ring(picture->rings, r->next);
        if (r->next == 0 || ring != r->ring)
            enter_ring(r, picture, ring);
        judge(r, picture, velocity_mps, r->next);
        r->work += JUDGE_WORK + r->n_here + r->conf.n_gone;
    }
    r->judged = r->next == picture->n;
}

/* Some directions of a round, in which the best of what is apart from those chosen before is found; of equals the one
 * in the middle of the band. */
static void choose_some(struct next_look_ranking *r, const struct picture *picture)
{
    const struct rings *rings = picture->rings;
    const double near = cos(r->conf.apart_rad), middle = (r->conf.low_rad + r->conf.high_rad) / 2;
    const double *from = r->n > 0 ? picture->axis[r->chosen] : NULL;
    for (; r->next < picture->n && r->work < NEXT_LOOK_STEP; r->next++) {
        struct next_look_score *s = &r->score[r->next];
        r->work++;
        while (r->next >= rings->start[r->ring + 1])
            r->ring++;
        if (s->score > 0 && from && geo_dot(picture->axis[r->next], from) >= near)
            s->score = 0;
        if (s->score <= 0 || s->score < r->best_score)
            continue;
        const double off = fabs(rings->top_rad - (r->ring + 0.5) * rings->height_rad - middle);
        if (s->score > r->best_score || off < r->best_off) {
            r->best = r->next;
            r->best_score = s->score;
            r->best_off = off;
        }
    }
}

static void begin_round(struct next_look_ranking *r)
{
    r->next = r->ring = 0;
    r->best_score = 0;
}

static void take_best(struct next_look_ranking *r, const struct picture *picture)
{
    struct next_look_score *s = &r->score[r->best];
    struct next_look *l = &r->look[r->n++];
    *l = (struct next_look){.score = s->score, .age_s = (double)s->age_s, .why = s->why};
    place_look(picture, r->axes_rad, r->best, l);
    s->score = 0;
    r->chosen = r->best;
}

bool next_look_step(struct next_look_ranking *r, struct picture *picture)
{
    r->work = 0;
    if (!r->judged) {
        judge_some(r, picture);
        if (r->judged)
            begin_round(r);
        return true;
    }
    choose_some(r, picture);
    if (r->next < picture->n)
        return true;
    if (r->best_score <= 0)
        return false;
    take_best(r, picture);
    begin_round(r);
    return r->n < r->room;
}

/* ---- sectors ---- */

#define SLICES NEXT_LOOK_SLICES

/* Of the directions of one slice. */
struct slice {
    double sum, feature_sum; /* of scores, and of what they would be with a feature */
    double nearest_m;        /* INFINITY: no obstacle */
    uint32_t n;
    bool looked_at;
};

static double nearest_obstacle(const struct picture *picture, const struct picture_entry *e, uint64_t now_ns)
{
    for (int k = 0; k < PICTURE_OBSTACLES; k++)
        if (picture_logodds(picture, &e->obstacle[k], now_ns) > (double)picture->blocked_logodds)
            return (double)e->obstacle[k].range_m;
    return INFINITY;
}

static void take_slices(struct picture *picture, uint64_t now_ns, const struct next_look_conf *conf,
                        struct slice slice[SLICES])
{
    const double axes_rad = axes_of(picture);
    double velocity_mps[3];
    velocity_in_grid(conf, axes_rad, velocity_mps);
    for (int k = 0; k < SLICES; k++)
        slice[k] = (struct slice){.nearest_m = INFINITY};
    for (uint32_t d = 0; d < picture->n; d++) {
        struct next_look l = {.score = 0};
        struct picture_entry e;
        place_look(picture, axes_rad, d, &l);
        if (l.el_rad < conf->low_rad || l.el_rad > conf->high_rad)
            continue;
        picture_get(picture, d, &e);
        judge_age(&e, now_ns, conf->stale_s, &l);
        struct slice *s = &slice[(int)(geo_wrap(l.az_rad) / GEO_TURN * SLICES) % SLICES];
        const double gain = 1 + AHEAD_GAIN * ahead(picture->axis[d], velocity_mps);
        s->sum += l.score * gain;
        s->feature_sum += as_feature(l.score) * gain;
        s->nearest_m = fmin(s->nearest_m, nearest_obstacle(picture, &e, now_ns));
        s->looked_at = s->looked_at || l.age_s >= 0;
        s->n++;
    }
}

/* Is there something in both slices, but not the same; or in one of them only? */
static bool edge_between(const struct slice *a, const struct slice *b)
{
    const double near_m = fmin(a->nearest_m, b->nearest_m), far_m = fmax(a->nearest_m, b->nearest_m);
    return a->n > 0 && b->n > 0 && near_m < INFINITY && far_m - near_m > EDGE_M + EDGE_SHARE * near_m;
}

/* What is there now, and whether it is where it was. */
static void follow_slices(struct next_look_features *f, const struct slice slice[SLICES], double step_m,
                          uint64_t now_ns)
{
    for (int k = 0; k < SLICES; k++) {
        const double was_m = f->range_m[k], is_m = slice[k].nearest_m;
        const bool same = (was_m == INFINITY && is_m == INFINITY) || fabs(was_m - is_m) <= MOVED_M + step_m;
        if (f->known[k] && !same)
            f->t_changed_ns[k] = now_ns;
        f->range_m[k] = f->known[k] && same && is_m < INFINITY ? was_m : is_m;
        f->known[k] = f->known[k] || slice[k].looked_at;
    }
}

static bool is_feature(const struct next_look_features *f, const struct slice slice[SLICES], int k,
                       uint64_t now_ns, double stale_s)
{
    const uint64_t t_ns = f->t_changed_ns[k];
    return edge_between(&slice[k], &slice[(k + 1) % SLICES]) ||
           edge_between(&slice[k], &slice[(k + SLICES - 1) % SLICES]) ||
           (t_ns && (double)(now_ns - t_ns) * 1e-9 < stale_s);
}

bool next_look_sector(struct picture *picture, uint64_t now_ns, const struct next_look_conf *conf,
                      struct next_look_features *features, double width_rad, double *az_rad)
{
    struct slice slice[SLICES];
    struct picture_frame frame;
    double score[SLICES], best = 0;
    const int wide = (int)lround(width_rad / GEO_TURN * SLICES);
    take_slices(picture, now_ns, conf, slice);
    picture_get_frame(picture, &frame);
    if (features)
        follow_slices(features, slice, frame.recentre_m, now_ns);
    for (int k = 0; k < SLICES; k++)
        score[k] = features && is_feature(features, slice, k, now_ns, conf->stale_s) ? slice[k].feature_sum
                                                                                     : slice[k].sum;
    for (int first = 0; first < SLICES; first++) {
        double sum = 0;
        uint32_t count = 0;
        for (int k = 0; k < wide; k++) {
            sum += score[(first + k) % SLICES];
            count += slice[(first + k) % SLICES].n;
        }
        if (count && sum / count > best) {
            best = sum / count;
            *az_rad = geo_wrap((first + wide / 2.0) * GEO_TURN / SLICES);
        }
    }
    return best > 0;
}

const char *next_look_word(enum next_look_why why)
{
    static const char *const words[] = {[LOOK_NEVER] = "never observed",
                                        [LOOK_STALE] = "not observed for long",
                                        [LOOK_APPROACHING] = "obstacle approaching",
                                        [LOOK_GROWING] = "obstacle growing",
                                        [LOOK_EDGE] = "edge of an obstacle",
                                        [LOOK_VANISHED] = "obstacle vanished"};
    return words[why];
}
