/* SPDX-License-Identifier: MIT */
#include "answer.h"

#include <math.h>
#include <string.h>

#include "sight.h"

const char *answer_state_name(enum answer_state state)
{
    static const char *const names[] = {
        [ANSWER_CLEAR] = "clear", [ANSWER_BLOCKED] = "blocked", [ANSWER_UNKNOWN] = "unknown"};
    return names[state];
}

const char *answer_reason_text(enum answer_reason reason)
{
    static const char *const texts[] = {
        [ANSWER_HEARD] = "heard",
        [ANSWER_BEYOND] = "nothing seen, but not heard as far as asked",
        [ANSWER_BLIND] = "nearer than the sonar can hear",
        [ANSWER_MOVED] = "the vehicle has moved on since it looked there",
        [ANSWER_STALE] = "looked at too long ago",
        [ANSWER_SILENT] = "the sonar that looked there is lost",
        [ANSWER_NEVER] = "never looked at",
        [ANSWER_OUTSIDE] = "outside the directions that the grid keeps",
        [ANSWER_NO_FRAME] = "no attitude was given, so north is unknown",
        [ANSWER_POSE_LOST] = "the pose is too old",
        [ANSWER_NO_DATA] = "no data from the sonar",
    };
    return texts[reason];
}

/* An answer while directions are added to it. */
struct tally {
    struct answer a;
    double near_m;   /* of the obstacle reported in a */
    double oldest_s; /* ping of the directions looked at */
    bool looked;
    bool never; /* one of them was never pinged */
};

static void begin(struct tally *t)
{
    *t = (struct tally){.a = {.state = ANSWER_CLEAR, .free_to_m = INFINITY, .age_s = -1}, .oldest_s = -1};
}

static void add_obstacle(struct tally *t, const struct sight *v, const struct answer_now *now, double moved_m)
{
    if (t->a.state == ANSWER_BLOCKED && v->near_m >= t->near_m)
        return;
    t->near_m = v->near_m;
    t->a.state = ANSWER_BLOCKED;
    t->a.reason = ANSWER_HEARD;
    t->a.range_m = fmax(v->near_m, v->obstacle->range_m - moved_m);
    t->a.range_sd_m = v->obstacle->sd_m;
    t->a.confidence = 1 / (1 + exp(-v->logodds));
    t->a.age_s = sight_seconds(now->now_ns, v->obstacle->t_echo_ns);
}

/* Something stands against clear; the gravest is told. */
static void doubt(struct tally *t, enum answer_reason why)
{
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
           : v->clear_m < need_m     ? ANSWER_BEYOND
                                     : ANSWER_HEARD;
}

/*
 * Adds what a direction says about the stretch up to need_m. When a corridor leaves this direction through its side
 * inside the blind zone, or up to side_m where no echo was ever heard, the direction is not asked: that is the vehicle's
 * own place, and blind_to_m tells of it. Water that is known up to where the corridor leaves ends nothing.
 */
static void add_water(struct tally *t, const struct sight *v, double need_m, bool side, double side_m)
{
    const enum answer_reason why = against(v, need_m);
    if (side && (why == ANSWER_BLIND || (why != ANSWER_HEARD && need_m <= side_m && need_m < v->hint_m))) {
        t->a.blind_to_m = fmax(t->a.blind_to_m, need_m);
        return;
    }
    t->looked = true;
    t->a.blind_to_m = fmax(t->a.blind_to_m, v->blind_m);
    if (!side || why != ANSWER_HEARD)
        t->a.free_to_m = fmin(t->a.free_to_m, v->clear_m);
    t->oldest_s = fmax(t->oldest_s, v->age_s);
    if (why != ANSWER_HEARD)
        doubt(t, why);
}

static void finish(struct tally *t, const struct answer_conf *conf, struct answer *out)
{
    if (!t->looked && t->a.state == ANSWER_CLEAR) {
        t->a.state = ANSWER_UNKNOWN;
        t->a.reason = ANSWER_OUTSIDE;
    }
    if (!isfinite(t->a.free_to_m) || t->a.free_to_m <= t->a.blind_to_m)
        t->a.free_to_m = 0;
    if (t->a.state != ANSWER_BLOCKED)
        t->a.age_s = t->oldest_s;
    if (t->a.state == ANSWER_CLEAR)
        t->a.confidence = fmax(0, 1 - t->oldest_s / conf->clear_for_s);
    *out = t->a;
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

/* A question, turned into the grid's axes. */
struct aim {
    const struct answer_query *query;
    const struct sight_place *place;
    double axis[3];
    double cos_wall, sin_wall; /* of the angle between the axis and the question's wall */
    double ahead_m;            /* the vehicle's place off the centre, along the axis */
};

/* One direction against the question: how far along its rays that reaches, 0: not at all. */
struct share {
    double need_m;
    bool side;   /* it leaves a corridor through its side */
    bool beside; /* it is no direction of the cone */
};

/* An angle, or the place of a direction against the axis. */
struct bearing {
    double cos, sin;
};

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static struct bearing bearing_of(const struct aim *a, const double v[3])
{
    const double c = fmax(-1, fmin(1, dot(v, a->axis)));
    return (struct bearing){c, sqrt((1 - c) * (1 + c))};
}

/* How far the first lies beyond the second; 0 when it does not. */
static struct bearing beyond(const struct bearing *b, const struct bearing *edge)
{
    if (b->cos >= edge->cos)
        return (struct bearing){1, 0};
    return (struct bearing){b->cos * edge->cos + b->sin * edge->sin,
                            fmax(b->sin * edge->cos - b->cos * edge->sin, 0)};
}

/* How far the vehicle may be off the centre, across the wall of the question towards v. */
static double off_m(const struct aim *a, const double v[3], const struct bearing *b)
{
    if (b->sin < 1e-9)
        return a->place->moved_m;
    const double across_m = (dot(a->place->offset_m, v) - b->cos * a->ahead_m) / b->sin;
    return fmax(0, a->cos_wall * across_m - a->sin_wall * a->ahead_m) + a->place->slack_m;
}

/* edge: the angle from the axis up to which directions have a ray within the cone, or on a corridor's axis. */
static struct share share_of(const struct aim *a, const double v[3], const struct bearing *edge)
{
    const struct answer_query *q = a->query;
    const struct bearing b = bearing_of(a, v), outside = beyond(&b, edge);
    const double moved_m = a->place->moved_m, off = moved_m > 0 ? off_m(a, v, &b) : 0;
    if (!q->corridor) {
        if (outside.sin <= 0 && outside.cos > 0)
            return (struct share){.need_m = q->distance_m};
        return (struct share){.need_m = fmin(q->distance_m, off / (outside.cos > 0 ? outside.sin : 1)),
                              .beside = true};
    }
    if (outside.cos < 0)
        return (struct share){0};
    /* ranges are already shorter by moved_m, along the ray; along the line that may be more */
    const double end =
        outside.cos > 1e-12 ? (q->distance_m + moved_m * (1 - outside.cos)) / outside.cos : INFINITY;
    const double side = outside.sin > 0 ? (q->radius_m + off) / outside.sin : INFINITY;
    return (struct share){.need_m = fmin(end, side), .side = side < end && side < q->distance_m};
}

/* Would a look at a direction beside the cone change nothing? That is mostly so, and much cheaper to tell. */
static bool tells_nothing(const struct tally *t, struct picture *p, uint32_t d, const struct share *share,
                          double moved_m)
{
    return share->beside && share->need_m <= t->a.blind_to_m && picture_edge_m(p, d) - moved_m > share->need_m;
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
    double az, el;
    struct sight_place place;
    sight_locate(&frame, now, &place);
    const double wall_rad = q->corridor ? 0 : fmin(q->half_angle_rad, GEO_PI);
    struct aim aim = {.query = q, .place = &place, .cos_wall = cos(wall_rad), .sin_wall = sin(wall_rad)};
    geo_direction(q->az_rad, q->el_rad, aim.axis);
    sight_to_grid(&frame, now, q->ned, aim.axis);
    aim.ahead_m = dot(place.offset_m, aim.axis);
    geo_angles(aim.axis, &az, &el);
    if (rings_index(p->rings, az, el) == RINGS_NONE) {
        cannot(ANSWER_OUTSIDE, out);
        return;
    }
    struct tally tally;
    begin(&tally);
    const double turned = q->ned ? 0 : place.turned_rad;
    const double opening = q->corridor ? GEO_PI / 2 : wall_rad;
    const double beside = q->corridor ? 0 : sight_aside_rad(&place, 0);
    const double around = fmin(opening + beside + turned + p->rings->height_rad, GEO_PI);
    if (beside > 0)
        tally.a.blind_to_m = SIGHT_BESIDE * place.moved_m;
    struct rings_visit visit = rings_visit(p->rings, aim.axis, around);
    struct bearing edge = {0};
    for (uint32_t ring = RINGS_NONE; rings_next(&visit); ring = visit.ring) {
        if (visit.ring != ring) {
            const double edge_rad = fmin(wall_rad + sight_cell_reach(p->rings, visit.ring) + turned, GEO_PI);
            edge = (struct bearing){cos(edge_rad), sin(edge_rad)};
        }
        const struct share share = share_of(&aim, p->axis[visit.direction], &edge);
        if (share.need_m <= 0 || tells_nothing(&tally, p, visit.direction, &share, place.moved_m))
            continue;
        struct picture_entry e;
        struct sight view;
        sight_look(p, visit.direction, conf, now, &place, &e, &view);
        if (view.obstacle && view.near_m <= share.need_m)
            add_obstacle(&tally, &view, now, place.moved_m);
        if (share.beside)
            add_beside(&tally, &view, share.need_m);
        else
            add_water(&tally, &view, share.need_m, share.side, q->near_m - place.moved_m);
    }
    if (!sight_keeps(p->rings, el - opening - turned, el + opening + turned))
        doubt(&tally, ANSWER_OUTSIDE);
    if (tally.a.blind_to_m >= q->distance_m)
        doubt(&tally, ANSWER_BLIND);
    finish(&tally, conf, out);
}

#define ROUNDING_RAD 1e-6 /* of elevations that were turned */

/* Elevations as sines, and wider by ROUNDING: a direction's height against them needs no angle. */
struct heights {
    double lo, hi;
};

#define ROUNDING 1e-9

static struct heights heights_of(double lo_rad, double hi_rad)
{
    return (struct heights){.lo = sin(fmax(lo_rad, -GEO_PI / 2)) - ROUNDING,
                            .hi = sin(fmin(hi_rad, GEO_PI / 2)) + ROUNDING};
}

#define FAR 10.0 /* times what the vehicle has moved */

/* A question about all sectors of a band, while directions are added to them. */
struct sectors {
    struct picture *picture;
    const struct answer_conf *conf;
    const struct answer_now *now;
    struct sight_place place;
    double lo_rad, hi_rad; /* the band, of the body when `turned` */
    double need_m, width_rad;
    double slack_rad; /* the body's axes may be turned so far from what its attitude says */
    double
        water_rad; /* what is heard of a direction's water may be so far beside it; of an obstacle it may be more: */
    struct heights any, water; /* of the middles of cells that reach into the band with anything, and with water ... */
    struct heights far;        /* ... or an obstacle at least far_m away: most of them are */
    double far_m;
    double up[3];              /* of the axes asked about, in the grid's */
    bool turned;               /* asked in the body's axes, which are not the grid's ... */
    double attitude[4];        /* ... but this, in them */
    double axes_rad;           /* asked in NED: azimuth of the grid's azimuth 0 */
    size_t count;
    struct tally *tally; /* [count] */
    size_t hopeful;      /* of them no direction that was never pinged was added to */
};

/* Where a cell lies, and how far it reaches to its sides. */
struct patch {
    double az, el, half_az, half_el;
};

/* The sectors that a patch touches when seen from up to `aside` beside: [from, to], none when to < from. */
struct run {
    double from, to;
};

/* An exact common edge is no touch. */
static struct run touched(const struct sectors *s, const struct patch *p, double aside)
{
    const double half_el = p->half_el + aside, level = cos(p->el);
    const double more = aside <= 0 ? 0 : sin(aside) < level ? asin(sin(aside) / level) : GEO_PI;
    if (p->el + half_el <= s->lo_rad || p->el - half_el >= s->hi_rad)
        return (struct run){0, -1};
    const double half = fmin(p->half_az + more, GEO_PI);
    const double from = floor((p->az - half) / s->width_rad + 0.5 + 1e-9);
    const double to = ceil((p->az + half) / s->width_rad - 0.5 - 1e-9);
    return (struct run){from, fmin(to, from + (double)s->count - 1)};
}

static struct tally *tally_of(const struct sectors *s, double k)
{
    return &s->tally[(size_t)(k < 0 ? k + (double)s->count : k) % s->count];
}

/* Adds direction d to every sector that it may lie in, as seen from where the vehicle may be. */
static void add_to_sectors(struct sectors *s, uint32_t d, const struct patch *patch)
{
    struct picture_entry e;
    struct sight view;
    sight_look(s->picture, d, s->conf, s->now, &s->place, &e, &view);
    const struct run water = touched(s, patch, s->water_rad);
    for (double k = water.from; k <= water.to; k++)
        add_water(tally_of(s, k), &view, s->need_m, false, 0);
    if (!view.obstacle)
        return;
    const double aside = sight_aside_rad(&s->place, view.near_m + s->place.moved_m);
    const struct run blocked = touched(s, patch, s->slack_rad + aside);
    for (double k = blocked.from; k <= blocked.to; k++)
        add_obstacle(tally_of(s, k), &view, s->now, s->place.moved_m);
}

/* The same of a direction that was never pinged. One such tells a sector all that others could. */
static void add_blank(struct sectors *s, const struct patch *patch)
{
    const struct run water = touched(s, patch, s->water_rad);
    for (double k = water.from; k <= water.to; k++) {
        struct tally *t = tally_of(s, k);
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

/* patch: of the direction, in the grid's axes but for axes_rad. */
static void add_direction(struct sectors *s, uint32_t d, struct patch patch)
{
    const double *axis = s->picture->axis[d];
    const double height = axis[0] * s->up[0] + axis[1] * s->up[1] + axis[2] * s->up[2];
    if (!is_between(&s->any, height))
        return;
    if (!is_between(&s->far, height) && picture_edge_m(s->picture, d) >= s->far_m)
        return;
    const bool blank = picture_blank(s->picture, d);
    if (blank && (!s->hopeful || !is_between(&s->water, height)))
        return;
    if (s->turned) {
        double v[3];
        quat_rotate_inverse(s->attitude, axis, v);
        geo_angles(v, &patch.az, &patch.el);
    }
    if (blank)
        add_blank(s, &patch);
    else
        add_to_sectors(s, d, &patch);
}

static void add_ring(struct sectors *s, uint32_t ring)
{
    const struct rings *rings = s->picture->rings;
    const double width = rings_width(rings, ring);
    struct patch patch = {.el = rings->top_rad - (ring + 0.5) * rings->height_rad,
                          .half_az = width / 2,
                          .half_el = rings->height_rad / 2};
    for (uint32_t d = rings->start[ring]; d < rings->start[ring + 1]; d++) {
        patch.az = (d - rings->start[ring] + 0.5) * width + s->axes_rad;
        add_direction(s, d, patch);
    }
}

static void sectors_once(struct picture *p, const struct answer_conf *conf, const struct answer_now *now, bool ned,
                         double lo_rad, double hi_rad, double reach_m, size_t count, struct answer *sectors)
{
    struct picture_frame frame;
    enum answer_reason reason;
    struct tally tally[ANSWER_SECTORS_MAX];
    picture_get_frame(p, &frame);
    if (!sight_possible(&frame, now, ned, &reason)) {
        for (size_t k = 0; k < count; k++)
            cannot(reason, &sectors[k]);
        return;
    }
    struct sectors s = {.picture = p,
                        .conf = conf,
                        .now = now,
                        .lo_rad = lo_rad,
                        .hi_rad = hi_rad,
                        .need_m = reach_m > 0 ? reach_m : frame.range_max_m,
                        .width_rad = GEO_TURN / (double)count,
                        .axes_rad = ned ? frame.axes_rad : 0,
                        .count = count,
                        .tally = tally,
                        .hopeful = count,
                        .up = {0, 0, -1}};
    for (size_t k = 0; k < count; k++)
        begin(&tally[k]);
    sight_locate(&frame, now, &s.place);
    s.turned = !ned && sight_attitude(&frame, now, ned, s.attitude);
    if (s.turned)
        quat_rotate(s.attitude, s.up, s.up);
    s.slack_rad = s.turned ? s.place.turned_rad : 0;
    s.water_rad = s.slack_rad + sight_aside_rad(&s.place, s.need_m);
    /* the rings that reach into the band, however the body is tilted */
    const double half = p->rings->height_rad / 2, most = half + s.slack_rad + sight_aside_rad(&s.place, 0);
    const double tilt = s.turned ? sight_tilt(now->pose.attitude) : 0;
    s.any = heights_of(lo_rad - most, hi_rad + most);
    s.far_m = fmin(FAR * s.place.moved_m, s.need_m);
    const double far = half + s.slack_rad + sight_aside_rad(&s.place, s.far_m);
    s.far = heights_of(lo_rad - far, hi_rad + far);
    s.water = heights_of(lo_rad - half - s.water_rad, hi_rad + half + s.water_rad);
    for (uint32_t ring = 0; ring < p->rings->n_rings; ring++) {
        const double el = p->rings->top_rad - (ring + 0.5) * p->rings->height_rad;
        if (el + most + tilt > lo_rad - ROUNDING_RAD && el - most - tilt < hi_rad + ROUNDING_RAD)
            add_ring(&s, ring);
    }
    const bool kept = sight_keeps(p->rings, lo_rad - tilt - s.slack_rad, hi_rad + tilt + s.slack_rad);
    for (size_t k = 0; k < count; k++) {
        if (!kept)
            doubt(&tally[k], ANSWER_OUTSIDE);
        finish(&tally[k], conf, &sectors[k]);
    }
}

void answer_direction(struct picture *p, const struct answer_conf *conf, const struct answer_now *now,
                      const struct answer_query *query, struct answer *out)
{
    struct sight_reading r = {.picture = p};
    while (sight_reads(&r))
        direction_once(p, conf, now, query, out);
}

void answer_sectors(struct picture *p, const struct answer_conf *conf, const struct answer_now *now, bool ned,
                    double lo_rad, double hi_rad, double reach_m, size_t count, struct answer *sectors)
{
    struct sight_reading r = {.picture = p};
    while (sight_reads(&r))
        sectors_once(p, conf, now, ned, lo_rad, hi_rad, reach_m, count, sectors);
}
