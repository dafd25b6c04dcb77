/* SPDX-License-Identifier: MIT */
#include "sight.h"

#include <math.h>
#include <string.h>

#define TRIES 8

bool sight_reads(struct sight_reading *r)
{
    struct picture_frame frame;
    if (r->tries && picture_still(r->picture, r->number))
        return false;
    const uint64_t number = picture_now(r->picture);
    picture_get_frame(r->picture, &frame);
    if (r->tries >= TRIES && frame.axes_rad == r->axes_rad)
        return false;
    r->number = number;
    r->axes_rad = frame.axes_rad;
    r->tries++;
    return true;
}

/* ---- one look ---- */

/* The words of one side's entry. Most directions have no obstacle, so most are never read. */
struct words {
    const snapshot_word *at;
};

static uint64_t word_at(const struct words *w, size_t byte)
{
    return atomic_load_explicit(&w->at[byte / 8], memory_order_acquire);
}

/* As exp takes long and the obstacles of one ping fade alike. */
static double faded(const struct picture *p, const struct picture_obstacle *o, const struct sight_observer *by)
{
    struct sight_fade *fade = by->fade;
    if (!fade)
        return picture_logodds(p, o, by->now->now_ns);
    if (fade->t_ref_ns != o->t_ref_ns || !fade->known) {
        const struct picture_obstacle one = {.t_ref_ns = o->t_ref_ns, .logodds = 1};
        *fade = (struct sight_fade){
            .t_ref_ns = o->t_ref_ns, .share = picture_logodds(p, &one, by->now->now_ns), .known = true};
    }
    return (double)o->logodds * fade->share;
}

/* Up to the first obstacle that counts. Returns where the nearest of them begins, INFINITY: there is none. */
static double look_for_obstacles(const struct picture *p, const struct words *w, const struct sight_observer *by,
                                 struct picture_entry *e, struct sight *v)
{
    double edge_m = INFINITY;
    for (unsigned i = 0; i < PICTURE_OBSTACLES && !v->obstacle; i++) {
        float odds[2]; /* and near edge */
        const uint64_t both = word_at(w, PICTURE_ODDS(i));
        memcpy(odds, &both, sizeof odds);
        if (odds[0] <= 0)
            break;
        edge_m = (double)odds[1] < edge_m ? (double)odds[1] : edge_m;
        if (odds[0] <= p->blocked_logodds) /* it does not grow */
            continue;
        struct picture_obstacle *o = &e->obstacle[i];
        snapshot_load(o, w->at + (PICTURE_ODDS(i) - offsetof(struct picture_obstacle, logodds)) / 8,
                      sizeof *o / 8);
        v->logodds = faded(p, o, by);
        if (v->logodds > p->blocked_logodds) {
            v->obstacle = o;
            v->near_m = sight_more(0, o->near_m - by->place->moved_m);
        }
    }
    return edge_m;
}

static void look_at_words(const struct picture *p, const struct words *w, const struct sight_observer *by,
                          struct picture_entry *e, struct sight *v)
{
    *v = (struct sight){.hint_m = INFINITY};
    const double edge_m = look_for_obstacles(p, w, by, e, v);
    const double hint_m = (double)sight_half(word_at(w, offsetof(struct picture_entry, hint_m)), 0);
    v->hint_m = sight_more(0, (hint_m > 0 ? sight_less(hint_m, edge_m) : edge_m) - by->place->moved_m);
}

void sight_look(struct picture *p, uint32_t direction, const struct sight_observer *by, struct picture_entry *e,
                struct sight *v)
{
    bool whole = false;
    for (int i = 0; i < SNAPSHOT_TRIES && !whole; i++) {
        const uint64_t number = picture_now(p);
        const struct words w = {p->side[number & 1].word + (size_t)direction * PICTURE_WORDS};
        look_at_words(p, &w, by, e, v);
        whole = picture_still(p, number);
    }
    if (!whole)
        *v = (struct sight){.hint_m = 0}; /* nobody knows what stands there */
}

/* A bound that is infinite or no number bounds nothing, and no comparison further on would see it. */
static bool is_bounded(const struct picture_frame *frame, const struct pose *pose)
{
    double sum = pose->drift_m[0] + pose->drift_m[1];
    if (frame->ned)
        sum += geo_length(pose->position_m) + pose->uncertain_m + pose->uncertain_rad + pose->heading_radps;
    return isfinite(sum);
}

bool sight_possible(const struct picture_frame *frame, const struct answer_now *now, bool ned,
                    enum answer_reason *reason)
{
    *reason = ANSWER_HEARD;
    if (!frame->pings)
        *reason = ANSWER_NO_DATA;
    else if ((frame->ned && !now->pose_fresh) || !is_bounded(frame, &now->pose))
        *reason = ANSWER_POSE_LOST;
    else if (ned && !frame->ned)
        *reason = ANSWER_NO_FRAME;
    return *reason == ANSWER_HEARD;
}

void sight_locate(const struct picture_frame *frame, const struct answer_conf *conf, const struct answer_now *now,
                  struct sight_place *place)
{
    double way2 = 0;
    /* in the time between two pings; more than that since the last one */
    const double drift_m = hypot(fmax(now->pose.drift_m[0] - frame->drift_m[0], 0),
                                 fmax(now->pose.drift_m[1] - frame->drift_m[1], 0));
    *place = (struct sight_place){.uncertain_m = drift_m, .moved_m = drift_m};
    if (!frame->ned)
        return;
    for (int i = 0; i < 3; i++) {
        place->offset_m[i] = now->pose.position_m[i] - frame->centre_m[i];
        way2 += place->offset_m[i] * place->offset_m[i];
    }
    sight_to_grid(frame, now, true, place->offset_m);
    place->adrift_rad = fmin(now->pose.heading_radps * conf->clear_for_s, GEO_PI);
    place->adrift_cos = cos(place->adrift_rad);
    place->adrift_sin = sin(place->adrift_rad);
    place->turned_rad = now->pose.uncertain_rad;
    place->uncertain_m += now->pose.uncertain_m + POSE_WAY_ERROR * fmax(now->pose.path_m - frame->path_m, 0);
    place->uncertain_m +=
        place->adrift_rad * sqrt(way2); /* the way since the centre was set, in a wrong direction */
    place->moved_m = sqrt(way2) + place->uncertain_m;
}

void sight_swing(const struct sight_place *place, const double to[3], double v[3])
{
    const double x = v[0], y = v[1], along = x * to[0] + y * to[1], across = x * to[1] - y * to[0];
    const double level = sqrt(x * x + y * y), to_level = sqrt(to[0] * to[0] + to[1] * to[1]);
    const double c = place->adrift_cos, s = across < 0 ? -place->adrift_sin : place->adrift_sin;
    const bool abreast = to_level > 0 && along >= c * level * to_level;
    v[0] = abreast ? to[0] / to_level * level : c * x - s * y;
    v[1] = abreast ? to[1] / to_level * level : s * x + c * y;
}

double sight_aside_rad(const struct sight_place *place, double range_m)
{
    return place->moved_m > 0 ? asin(place->moved_m / fmax(range_m, SIGHT_BESIDE * place->moved_m)) : 0;
}

double sight_cell_reach(const struct rings *rings, uint32_t ring)
{
    const double el = rings->top_rad - (ring + 0.5) * rings->height_rad, half = rings_width(rings, ring) / 2;
    double least = 1;
    for (int end = -1; end <= 1; end += 2) {
        const double corner = el + end * rings->height_rad / 2;
        least = fmin(least, sin(el) * sin(corner) + cos(el) * cos(corner) * cos(half));
    }
    return acos(fmax(-1, least));
}

double sight_tilt(const double attitude[4])
{
    double down[3] = {0, 0, 1};
    quat_rotate(attitude, down, down);
    return acos(fmax(-1, fmin(1, down[2])));
}

bool sight_attitude(const struct picture_frame *frame, const struct answer_now *now, bool ned, double q[4])
{
    static const double none[4] = {1, 0, 0, 0};
    if (!frame->ned || (ned && frame->axes_rad == 0))
        return false;
    memcpy(q, ned ? none : now->pose.attitude, sizeof none);
    if (frame->axes_rad != 0) {
        const double back[4] = {cos(frame->axes_rad / 2), 0, 0, -sin(frame->axes_rad / 2)};
        quat_multiply(back, q, q);
    }
    return true;
}

void sight_to_grid(const struct picture_frame *frame, const struct answer_now *now, bool ned, double v[3])
{
    double q[4];
    if (sight_attitude(frame, now, ned, q))
        quat_rotate(q, v, v);
}

void sight_from_grid(const struct picture_frame *frame, const struct answer_now *now, bool ned, double v[3])
{
    double q[4];
    if (sight_attitude(frame, now, ned, q))
        quat_rotate_inverse(q, v, v);
}

bool sight_keeps(const struct rings *rings, double lo_rad, double hi_rad)
{
    double bottom = rings->top_rad - rings->n_rings * rings->height_rad, slack = 1e-9;
    bool up = hi_rad <= rings->top_rad + slack || rings->top_rad >= GEO_PI / 2;
    return up && (lo_rad >= bottom - slack || bottom <= -GEO_PI / 2 + slack);
}
