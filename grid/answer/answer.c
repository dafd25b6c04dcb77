/* SPDX-License-Identifier: MIT */
#include "answer.h"

#include <float.h>
#include <math.h>
#include <string.h>

#include "overlap.h"
#include "scope.h"
#include "sight.h"

double answer_drifted_m(const struct answer_now *now, double age_s)
{
    const double last_s = ANSWER_DRIFTED_S;
    if (!now->drift_varies)
        return now->pose.drift_mps * age_s;
    if (!(age_s <= last_s))
        return now->drifted_m[ANSWER_DRIFTED_S - 1] + now->pose.drift_mps * (age_s - last_s);
    return now->drifted_m[(int)fmax(ceil(age_s) - 1, 0)];
}

const char *answer_state_name(enum answer_state state)
{
    static const char *const names[] = {
        [ANSWER_CLEAR] = "clear", [ANSWER_BLOCKED] = "blocked", [ANSWER_UNKNOWN] = "unknown"};
    return names[state];
}

const char *answer_reason_text(enum answer_reason reason)
{
    static const char *const texts[] = {
        [ANSWER_HEARD] = "observed",
        [ANSWER_BEYOND] = "no obstacle detected",
        [ANSWER_BOTTOM] = "the bottom may begin there, by the altitude",
        [ANSWER_BLIND] = "inside the blind zone of the sonar",
        [ANSWER_MOVED] = "data outdated: the vehicle has moved since this direction was scanned",
        [ANSWER_STALE] = "last scan of this direction is too old",
        [ANSWER_SILENT] = "the sonar that covers this direction is offline",
        [ANSWER_NEVER] = "never observed",
        [ANSWER_OUTSIDE] = "outside the grid's coverage",
        [ANSWER_NO_FRAME] = "no attitude received, so north is unknown",
        [ANSWER_POSE_LOST] = "the pose is too old",
        [ANSWER_NO_DATA] = "no data from the sonar",
    };
    return texts[reason];
}

/* An answer while directions are added to it. */
struct tally {
    struct answer a;
    double oldest_s;            /* ping of the directions looked at */
    double logodds;             /* blocked: of the obstacle */
    enum answer_reason against; /* the gravest that stands against clear, beside an obstacle */
    bool looked;
    bool never; /* one of them was never pinged */
};

static void begin_tally(struct tally *t)
{
    *t = (struct tally){.a = {.state = ANSWER_CLEAR, .free_to_m = INFINITY, .age_s = -1}, .oldest_s = -1};
}

static void add_obstacle(struct tally *t, const struct sight *v, const struct answer_now *now, double moved_m)
{
    if (t->a.state == ANSWER_BLOCKED && v->near_m >= t->a.near_m)
        return;
    t->a.near_m = v->near_m;
    t->a.state = ANSWER_BLOCKED;
    t->a.reason = ANSWER_HEARD;
    t->a.range_m = sight_more(v->near_m, v->obstacle->range_m - moved_m);
    t->a.range_sd_m = v->obstacle->sd_m;
    t->logodds = v->logodds;
    t->a.age_s = sight_seconds(now->now_ns, v->obstacle->t_echo_ns);
}

/* Reasons against clear; the gravest is reported. */
static void doubt_answer(struct tally *t, enum answer_reason why)
{
    t->against = why > t->against ? why : t->against;
    if (t->a.state == ANSWER_BLOCKED)
        return;
    t->a.state = ANSWER_UNKNOWN;
    t->a.reason = why > t->a.reason ? why : t->a.reason;
}

/* What stands against a direction's water up to need_m. */
static enum answer_reason against(const struct sight *v, double need_m)
{
    return v->reason != ANSWER_HEARD ? v->reason
           : need_m <= v->blind_m    ? ANSWER_BLIND
           : v->clear_m < need_m     ? sight_beyond(v)
                                     : ANSWER_HEARD;
}

/*
 * Adds what a direction says about the stretch up to need_m. When a corridor leaves this direction through its side
 * inside the blind zone, or up to side_m where no echo was ever received, the direction is not asked: that is the
 * vehicle's own place, and blind_to_m tells of it. Water that is known up to where the corridor leaves ends nothing.
 */
static void add_water(struct tally *t, const struct sight *v, double need_m, bool side, double side_m)
{
    const enum answer_reason why = against(v, need_m);
    if (side && (why == ANSWER_BLIND || (why != ANSWER_HEARD && need_m <= side_m && need_m < v->hint_m))) {
        t->a.blind_to_m = sight_more(t->a.blind_to_m, need_m);
        return;
    }
    t->looked = true;
    t->a.blind_to_m = sight_more(t->a.blind_to_m, v->blind_m);
    if (!side || why != ANSWER_HEARD)
        t->a.free_to_m = sight_less(t->a.free_to_m, v->clear_m);
    t->oldest_s = sight_more(t->oldest_s, v->age_s);
    if (why != ANSWER_HEARD)
        doubt_answer(t, why);
}

static void finish_tally(struct tally *t, const struct answer_conf *conf, struct answer *out)
{
    if (!t->looked && t->a.state == ANSWER_CLEAR) {
        t->a.state = ANSWER_UNKNOWN;
        t->a.reason = ANSWER_OUTSIDE;
    }
    if (!isfinite(t->a.free_to_m) || t->a.free_to_m <= t->a.blind_to_m)
        t->a.free_to_m = 0;
    if (t->a.state != ANSWER_BLOCKED)
        t->a.age_s = t->oldest_s;
    if (t->a.state == ANSWER_BLOCKED)
        t->a.confidence = 1 / (1 + exp(-t->logodds));
    if (t->a.state == ANSWER_CLEAR)
        t->a.confidence = fmax(0, 1 - t->oldest_s / conf->clear_for_s);
    *out = t->a;
}

/* An obstacle beyond what is asked about does not block where the water is known to be free so far. Its range stays. */
static void pass_over(struct tally *t, double need_m)
{
    if (t->a.state == ANSWER_BLOCKED && t->looked && t->against == ANSWER_HEARD && t->a.near_m > need_m)
        t->a.state = ANSWER_CLEAR;
}

static void cannot(enum answer_reason reason, struct answer *out)
{
    *out = (struct answer){.state = ANSWER_UNKNOWN, .reason = reason, .age_s = -1};
}

/*
 * A direction beside a cone, into which the cone reaches up to need_m only because the vehicle is not at the grid's
 * centre. Where its water is not known, nothing is known of the cone so far; beyond, the cone is in its own directions.
 */
static void add_beside(struct tally *t, const struct sight *v, double need_m)
{
    const bool heard = v->reason == ANSWER_HEARD && v->clear_m >= need_m;
    t->a.blind_to_m = fmax(t->a.blind_to_m, heard ? fmin(need_m, v->blind_m) : need_m);
}

/* Would a look at a direction beside the cone change nothing? That is mostly so, and much cheaper to tell. */
static bool tells_nothing(const struct tally *t, struct picture *p, uint32_t d, const struct scope_share *share,
                          double moved_m)
{
    return share->beside && share->need_m <= t->a.blind_to_m && picture_edge_m(p, d) - moved_m > share->need_m;
}

/* What a tally, or each of many, has at least. A direction that adds nothing to that adds nothing to any: most are soon
 * such. */
struct least {
    double near_m; /* blocked nearer than this; INFINITY: one is not */
    double free_to_m, blind_to_m, oldest_s;
    enum answer_reason against;
};

static const struct least least_of_none = {.near_m = INFINITY, .free_to_m = INFINITY, .oldest_s = -1};

static inline bool adds_water(const struct least *least, const struct sight *v, double need_m)
{
    return v->clear_m < least->free_to_m || v->blind_m > least->blind_to_m || v->age_s > least->oldest_s ||
           against(v, need_m) > least->against;
}

/* Would a look at a direction change nothing of the answer, as far as its obstacle and the age and beginning of its
 * water go? */
static inline bool adds_little(const struct tally *t, const struct sight *v, double need_m)
{
    return t->looked && v->blind_m <= t->a.blind_to_m && v->age_s <= t->oldest_s &&
           (v->near_m > need_m || (t->a.state == ANSWER_BLOCKED && v->near_m >= t->a.near_m));
}

/*
 * And nothing else? Water that is known up to a corridor's side ends nothing, and what begins too late for that
 * (add_water) is as blind as blind_to_m already says. Where a weak echo may stand up to side_m only a look tells.
 */
static bool adds_nothing(const struct tally *t, const struct sight *v, const struct scope_share *share,
                         double side_m)
{
    if (share->beside || !adds_little(t, v, share->need_m))
        return false;
    const enum answer_reason why = against(v, share->need_m);
    if (share->side && (why == ANSWER_HEARD || why == ANSWER_BLIND))
        return true;
    if (share->side && share->need_m <= side_m && share->need_m > t->a.blind_to_m)
        return false;
    return v->clear_m >= t->a.free_to_m && why <= t->against;
}

/* The same of a direction of a corridor, however far that reaches into it: as its share takes longest. Where it does
 * not leave by the side it is asked up to distance_m, at least. */
static bool never_adds(const struct tally *t, const struct sight *v, double distance_m, double side_m)
{
    return adds_little(t, v, DBL_MAX) && v->clear_m >= t->a.free_to_m && v->clear_m >= side_m &&
           v->blind_m < distance_m && against(v, DBL_MAX) <= t->against;
}

static void direction_once(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                           const struct answer_query *q, struct answer *out)
{
    struct picture_frame frame;
    enum answer_reason reason;
    picture_get_frame(p, &frame);
    if (!sight_possible(&frame, now, q->ned, &reason)) {
        cannot(reason, out);
        return;
    }
    struct sight_place place;
    struct scope scope;
    sight_locate(p, &frame, conf, now, &place);
    if (!scope_begin(&scope, p->rings, &(struct scope_view){&frame, now, &place}, q)) {
        cannot(ANSWER_OUTSIDE, out);
        return;
    }
    struct tally tally;
    begin_tally(&tally);
    tally.a.blind_to_m = scope.beside_m;
    struct sight_fade fade = {.known = false};
    struct sight_observer by = {conf, now, &place, q->near_m, 0, &fade};
    const double side_m = q->near_m - place.moved_m;
    struct rings_visit visit = rings_visit(p->rings, scope.axis, scope.around_rad);
    while (rings_next(&visit)) {
        struct picture_entry e;
        struct sight view;
        const bool glanced = sight_glance(p, visit.direction, &by, &view);
        if (q->corridor && glanced && never_adds(&tally, &view, q->distance_m, side_m))
            continue;
        const struct scope_share share = scope_share(&scope, p->axis[visit.direction], visit.ring);
        if (share.need_m <= 0 || tells_nothing(&tally, p, visit.direction, &share, place.moved_m) ||
            (glanced && adds_nothing(&tally, &view, &share, side_m)))
            continue;
        by.to_m = share.need_m;
        sight_look(p, visit.direction, &by, &e, &view);
        if (view.obstacle && view.near_m <= share.need_m)
            add_obstacle(&tally, &view, now, place.moved_m);
        if (share.beside)
            add_beside(&tally, &view, share.need_m);
        else
            add_water(&tally, &view, share.need_m, share.side, side_m);
    }
    if (!sight_keeps(p->rings, scope.lo_rad, scope.hi_rad))
        doubt_answer(&tally, ANSWER_OUTSIDE);
    if (tally.a.blind_to_m >= q->distance_m)
        doubt_answer(&tally, ANSWER_BLIND);
    finish_tally(&tally, conf, out);
}

#define ROUNDING_RAD 1e-6 /* of elevations that were turned */

/* Elevations as sines, and wider by ROUNDING: a direction's height against them needs no angle. */
struct heights {
    double lo, hi;
    double lo_rad, hi_rad;
};

#define ROUNDING 1e-9

static struct heights heights_of(double lo_rad, double hi_rad)
{
    return (struct heights){.lo = sin(fmax(lo_rad, -GEO_PI / 2)) - ROUNDING,
                            .hi = sin(fmin(hi_rad, GEO_PI / 2)) + ROUNDING,
                            .lo_rad = lo_rad,
                            .hi_rad = hi_rad};
}

#define FAR 10.0 /* times what the vehicle has moved */

#define LOOKS_PER_SECTOR 4 /* after so many looks for each sector it is found anew */

/* A question about all sectors of a band, while directions are added to them. */
struct sectors {
    struct picture *picture;
    const struct answer_conf *conf;
    const struct answer_now *now;
    struct sight_place place;
    struct sight_fade fade;
    struct sight_observer by;
    struct overlap_band band; /* of the body when `turned` */
    double near_m, need_m;
    double uncertain_rad; /* uncertainty of the attitude, when the angles are the body's */
    /* how far beside a direction its observed water may lie; an obstacle may lie farther */
    double water_rad;
    struct heights any,
        water;          /* of the middles of cells that reach into the band with anything, and with water ... */
    struct heights far; /* ... or an obstacle at least far_m away: most of them are */
    double far_m;
    double up[3];        /* of the axes asked about, in the grid's */
    bool turned;         /* asked in the body's axes, which are not the grid's ... */
    double attitude[4];  /* ... but this, in them */
    double tilt_rad;     /* of those against these */
    double axes_rad;     /* asked in NED: azimuth of the grid's azimuth 0 */
    struct tally *tally; /* [count] */
    struct least least;
    size_t looks;   /* since that was found */
    size_t hopeful; /* of them no direction that was never pinged was added to */
};

/* The tally of the k-th sector of a run. */
static struct tally *tally_of(const struct sectors *s, const struct overlap_run *run, size_t k)
{
    const size_t at = run->at + k;
    return &s->tally[at < s->band.count ? at : at - s->band.count];
}

static struct least least_of(const struct tally *tally, size_t n)
{
    struct least all = {.near_m = 0, .blind_to_m = INFINITY, .oldest_s = INFINITY, .against = ANSWER_NO_DATA};
    for (size_t k = 0; k < n; k++) {
        const struct tally *t = &tally[k];
        all.near_m = sight_more(all.near_m, t->a.state == ANSWER_BLOCKED ? t->a.near_m : INFINITY);
        all.free_to_m = sight_more(all.free_to_m, t->a.free_to_m);
        all.blind_to_m = sight_less(all.blind_to_m, t->a.blind_to_m);
        all.oldest_s = sight_less(all.oldest_s, t->oldest_s);
        all.against = t->against < all.against ? t->against : all.against;
    }
    return all;
}

/* The direction's middle, turned into the axes asked about. */
static void place_cell(const struct sectors *s, uint32_t d, struct overlap_cell *cell)
{
    double v[3];
    if (!s->turned)
        return;
    quat_rotate_inverse(s->attitude, s->picture->axis[d], v);
    overlap_middle(cell, v);
}

/* Adds direction d to every sector that it may lie in, as seen from where the vehicle may be. */
static void add_to_sectors(struct sectors *s, uint32_t d, struct overlap_cell *cell)
{
    struct picture_entry e;
    struct sight view;
    if (sight_glance(s->picture, d, &s->by, &view) && view.near_m >= s->least.near_m &&
        !adds_water(&s->least, &view, s->need_m))
        return;
    sight_look_told(s->picture, d, &s->by, &e, &view);
    const bool water_counts = adds_water(&s->least, &view, s->need_m);
    const bool blocks = view.obstacle && view.near_m < s->least.near_m;
    if (!water_counts && !blocks)
        return;
    place_cell(s, d, cell);
    const struct overlap_run water =
        water_counts ? overlap_run(&s->band, cell, s->water_rad) : (struct overlap_run){0, 0};
    for (size_t k = 0; k < water.n; k++)
        add_water(tally_of(s, &water, k), &view, s->need_m, false, 0);
    if (blocks) {
        const double aside = sight_aside_rad(&s->place, view.near_m + s->place.moved_m);
        const struct overlap_run blocked = overlap_run(&s->band, cell, s->uncertain_rad + aside);
        for (size_t k = 0; k < blocked.n; k++)
            add_obstacle(tally_of(s, &blocked, k), &view, s->now, s->place.moved_m);
    }
    if (++s->looks < LOOKS_PER_SECTOR * s->band.count)
        return;
    s->looks = 0;
    s->least = least_of(s->tally, s->band.count);
}

/* The same of a direction that was never pinged. One such tells a sector all that others could. */
static void add_blank(struct sectors *s, uint32_t d, struct overlap_cell *cell)
{
    place_cell(s, d, cell);
    const struct overlap_run water = overlap_run(&s->band, cell, s->water_rad);
    for (size_t k = 0; k < water.n; k++) {
        struct tally *t = tally_of(s, &water, k);
        if (t->never)
            continue;
        add_water(t, &sight_never, s->need_m, false, 0);
        t->never = true;
        s->hopeful--;
    }
}

static bool is_between(const struct heights *h, double height)
{
    return height >= h->lo && height <= h->hi;
}

/* blank: it says nothing. cell: of the direction, in the grid's axes but for axes_rad. */
static void add_direction(struct sectors *s, uint32_t d, bool blank, struct overlap_cell *cell)
{
    const double *axis = s->picture->axis[d];
    const double height = axis[0] * s->up[0] + axis[1] * s->up[1] + axis[2] * s->up[2];
    if (!is_between(&s->any, height))
        return;
    if (!is_between(&s->far, height) && picture_edge_m(s->picture, d) >= s->far_m)
        return;
    if (blank && (!s->hopeful || !is_between(&s->water, height)))
        return;
    if (blank)
        add_blank(s, d, cell);
    else
        add_to_sectors(s, d, cell);
}

/* May a cell of the ring be between these heights, however the ring is tilted? */
static bool may_be_between(const struct sectors *s, uint32_t ring, const struct heights *h)
{
    const struct rings *rings = s->picture->rings;
    const double el = rings->top_rad - (ring + 0.5) * rings->height_rad, tilt = s->tilt_rad + ROUNDING_RAD;
    return el + tilt >= h->lo_rad && el - tilt <= h->hi_rad;
}

/* Of 64 directions those that may add anything. */
static uint64_t worth_a_look(const struct sectors *s, const struct picture_block *b, bool far, bool water)
{
    return b->obstacle | (far ? b->told : 0) | (water && s->hopeful ? ~b->told : 0);
}

static void add_ring(struct sectors *s, uint32_t ring)
{
    const struct rings *rings = s->picture->rings;
    const uint32_t start = rings->start[ring], end = rings->start[ring + 1];
    const double width = rings_width(rings, ring);
    const bool far = may_be_between(s, ring, &s->far), water = may_be_between(s, ring, &s->water);
    for (uint32_t d = start; d < end; d = (d / 64 + 1) * 64) {
        const struct picture_block b = picture_block(s->picture, d / 64);
        uint64_t left = worth_a_look(s, &b, far, water) >> d % 64 << d % 64;
        for (uint32_t at = d / 64 * 64; left; left &= left - 1) {
            const uint32_t here = at + (uint32_t)__builtin_ctzll(left);
            if (here >= end)
                break;
            struct overlap_cell cell = {.az_rad = (here - start + 0.5) * width + s->axes_rad,
                                        .el_rad = rings->top_rad - (ring + 0.5) * rings->height_rad,
                                        .level = rings->cos_el[ring],
                                        .half_az_rad = width / 2 + s->place.adrift_rad,
                                        .half_el_rad = rings->height_rad / 2,
                                        .exact = true};
            add_direction(s, here, !(b.told >> here % 64 & 1), &cell);
        }
    }
}

static void sectors_once(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                         const struct answer_band *band, struct answer *sectors)
{
    struct picture_frame frame;
    enum answer_reason reason;
    struct tally tally[ANSWER_SECTORS_MAX];
    picture_get_frame(p, &frame);
    if (!sight_possible(&frame, now, band->ned, &reason)) {
        for (size_t k = 0; k < band->count; k++)
            cannot(reason, &sectors[k]);
        return;
    }
    struct sectors s = {.picture = p,
                        .conf = conf,
                        .now = now,
                        .band = {.lo_rad = band->lo_rad, .hi_rad = band->hi_rad, .count = band->count},
                        .near_m = band->near_m,
                        .need_m = band->reach_m > 0 ? band->reach_m : frame.range_max_m,
                        .axes_rad = band->ned ? frame.axes_rad : 0,
                        .tally = tally,
                        .least = least_of_none,
                        .hopeful = band->count,
                        .up = {0, 0, -1}};
    for (size_t k = 0; k < band->count; k++)
        begin_tally(&tally[k]);
    sight_locate(p, &frame, conf, now, &s.place);
    s.by = (struct sight_observer){conf, now, &s.place, s.near_m, s.need_m, &s.fade};
    s.turned = !band->ned && sight_attitude(&frame, now, band->ned, s.attitude);
    if (s.turned)
        quat_rotate(s.attitude, s.up, s.up);
    s.tilt_rad = s.turned ? sight_tilt(now->pose.attitude) : 0;
    s.uncertain_rad = (s.turned ? s.place.turned_rad : 0) + s.place.adrift_rad * sin(s.tilt_rad);
    s.water_rad = s.uncertain_rad + sight_aside_rad(&s.place, s.need_m);
    /* the rings that reach into the band, however the body is tilted */
    const double half = p->rings->height_rad / 2, most = half + s.uncertain_rad + sight_aside_rad(&s.place, 0);
    s.any = heights_of(band->lo_rad - most, band->hi_rad + most);
    s.far_m = fmin(FAR * s.place.moved_m, s.need_m);
    const double far = half + s.uncertain_rad + sight_aside_rad(&s.place, s.far_m);
    s.far = heights_of(band->lo_rad - far, band->hi_rad + far);
    s.water = heights_of(band->lo_rad - half - s.water_rad, band->hi_rad + half + s.water_rad);
    for (uint32_t ring = 0; ring < p->rings->n_rings; ring++) {
        const double el = p->rings->top_rad - (ring + 0.5) * p->rings->height_rad;
        if (el + most + s.tilt_rad > band->lo_rad - ROUNDING_RAD &&
            el - most - s.tilt_rad < band->hi_rad + ROUNDING_RAD)
            add_ring(&s, ring);
    }
    const bool kept = sight_keeps(p->rings, band->lo_rad - s.tilt_rad - s.uncertain_rad,
                                  band->hi_rad + s.tilt_rad + s.uncertain_rad);
    for (size_t k = 0; k < band->count; k++) {
        if (!kept)
            doubt_answer(&tally[k], ANSWER_OUTSIDE);
        if (tally[k].a.blind_to_m >= s.need_m)
            doubt_answer(&tally[k], ANSWER_BLIND);
        pass_over(&tally[k], s.need_m);
        finish_tally(&tally[k], conf, &sectors[k]);
    }
}

void answer_direction(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                      const struct answer_query *query, struct answer *out)
{
    struct sight_reading r = {.picture = p};
    while (sight_reads(&r))
        direction_once(p, conf, now, query, out);
}

void answer_sectors(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                    const struct answer_band *band, struct answer *sectors)
{
    struct sight_reading r = {.picture = p};
    while (sight_reads(&r))
        sectors_once(p, conf, now, band, sectors);
}
