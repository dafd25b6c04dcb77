/* SPDX-License-Identifier: MIT */
/*
 * test_answer_plain - what answers pass over without a look changes none of them: sectors, cones and corridors against
 * a plain walk through all directions, and every answer against itself on a picture in which no direction is blank, on
 * random pictures.
 */
#include "tests/lib/picture_rig.h"

#include "grid/answer/cell_edge.h"
#include "grid/answer/sight.h"

#define PICTURES  100
#define QUESTIONS 8

static uint64_t seed;

static double uniform(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&seed);
}

static bool one_in(double n)
{
    return test_uniform(&seed) * n < 1;
}

/* What was heard of one direction: well and lately, or anyhow. */
static struct picture_entry heard(bool well, double echoes)
{
    struct picture_entry e = {0};
    for (int k = 0; k < FREE_INTERVALS; k++)
        if (k == 0 || one_in(3))
            e.free[k] = (struct free_interval){.t_ping_ns = NOW - (uint64_t)(uniform(0, well ? 20 : 32) * 1e9),
                                               .path_m = well ? 0 : uniform(-0.2, 0),
                                               .from_m = (float)uniform(0, 0.8),
                                               .to_m = (float)uniform(well ? 22 : 0.5, 25)};
    for (int n = 0; n < PICTURE_OBSTACLES && test_uniform(&seed) < echoes; n++)
        e.obstacle[n] = (struct picture_obstacle){.t_ref_ns = NOW - (uint64_t)(uniform(0, 60) * 1e9),
                                                  .t_echo_ns = NOW - (uint64_t)(uniform(0, 20) * 1e9),
                                                  .logodds = (float)uniform(-0.2, 4),
                                                  .near_m = (float)uniform(0.2, one_in(3) ? 2 : 20),
                                                  .range_m = 20,
                                                  .sd_m = 0.1f};
    return e;
}

/* Part of the sphere was looked at, in one piece or here and there; the vehicle is anywhere near and anyhow turned. */
static void start(void)
{
    const double share = uniform(0, 1.2), echoes = pow(10, uniform(-3, -0.5)), from = uniform(0, GEO_TURN);
    const bool level = one_in(5), scattered = one_in(2), well = one_in(2);
    start_with(level ? rings_level(&rings, geo_rad(4), geo_rad(15)) : rings_full(&rings, geo_rad(uniform(3, 8))),
               !one_in(4));
    picture_begin(&picture);
    for (uint32_t d = 0; d < rings.n; d++) {
        const double az = geo_wrap(atan2(axis[d][1], axis[d][0]) - from);
        const struct picture_entry e = heard(well, echoes);
        if (scattered ? test_uniform(&seed) < share : az < share * GEO_TURN)
            picture_set(&picture, d, &e);
    }
    picture_end(&picture);
}

static void move(void)
{
    now.pose = pose_identity;
    quat_from_rpy(uniform(-0.3, 0.3), uniform(-0.3, 0.3), uniform(0, GEO_TURN), now.pose.attitude);
    now.pose.position_m[0] = one_in(3) ? 0 : uniform(-0.15, 0.15);
    now.pose.uncertain_m = one_in(2) ? 0 : uniform(0, 0.2);
    now.pose.uncertain_rad = one_in(2) ? 0 : uniform(0, 0.1);
    now.pose.heading_radps = one_in(2) ? 0 : uniform(0, 0.3) / limits.clear_for_s;
    now.pose.altitude_m = uniform(0, 10);
    now.pose.has |= one_in(2) ? POSE_ALTITUDE : 0u;
}

/* Evidence against an obstacle says nothing, but the direction is not blank any more. */
static void leave_nothing_blank(void)
{
    picture_begin(&picture);
    for (uint32_t d = 0; d < rings.n; d++) {
        struct picture_entry e;
        picture_get(&picture, d, &e);
        if (!picture_blank(&picture, d))
            continue;
        e.obstacle[0].logodds = -1;
        picture_set(&picture, d, &e);
    }
    picture_end(&picture);
}

struct ring_query {
    bool ned;
    double lo_rad, hi_rad, reach_m;
    size_t count;
};

static struct ring_query any_ring(void)
{
    const double lo = one_in(3) ? -5 : uniform(-90, 80), hi = one_in(8) ? 90 : uniform(fmax(lo + 1, 5), 90);
    return (struct ring_query){.ned = one_in(2),
                               .lo_rad = geo_rad(lo),
                               .hi_rad = geo_rad(hi),
                               .reach_m = one_in(2) ? 0 : uniform(1, 22),
                               .count = one_in(2) ? 72 : 1 + test_random(&seed) % 200};
}

static void ask_ring(const struct ring_query *q, struct answer *out)
{
    answer_sectors(
        &picture, &limits, &now,
        &(struct answer_band){
            .ned = q->ned, .lo_rad = q->lo_rad, .hi_rad = q->hi_rad, .reach_m = q->reach_m, .count = q->count},
        out);
}

/* Does a cell, seen from up to aside_rad beside, share more than an edge with sector k of the band? */
static bool touches(const struct ring_query *q, size_t k, const double v[3], double half_az, double aside_rad)
{
    double az, el, width = GEO_TURN / (double)q->count, half_el = rings.height_rad / 2 + aside_rad;
    geo_angles(v, &az, &el);
    const double share = sin(aside_rad) / cos(el), more = aside_rad <= 0 ? 0 : share < 1 ? asin(share) : GEO_PI;
    const double apart = fabs(geo_wrap_pi(az - (double)k * width));
    return el + half_el > q->lo_rad && el - half_el < q->hi_rad && apart < half_az + more + width / 2 - 1e-9;
}

/* State, range and free water of a sector as they are after a look at each direction. */
static struct answer plain(const struct ring_query *q, size_t k)
{
    struct answer a = {.state = ANSWER_CLEAR, .free_to_m = INFINITY, .range_m = INFINITY};
    struct picture_frame frame;
    struct sight_place place;
    double attitude[4];
    bool blocked = false, unknown = false;
    picture_get_frame(&picture, &frame);
    sight_locate(&picture, &frame, &limits, &now, &place);
    const bool turned = !q->ned && sight_attitude(&frame, &now, false, attitude);
    const double tilt = turned ? sight_tilt(now.pose.attitude) : 0, swings = place.adrift_rad;
    const double slack = (turned ? place.turned_rad : 0) + swings * sin(tilt);
    const double need_m = q->reach_m > 0 ? q->reach_m : frame.range_max_m;
    for (uint32_t d = 0; d < rings.n; d++) {
        const double half_az = rings_width(&rings, rings_ring(&rings, d)) / 2 + swings;
        double v[3] = {axis[d][0], axis[d][1], axis[d][2]};
        struct picture_entry e;
        struct sight s;
        if (turned)
            quat_rotate_inverse(attitude, v, v);
        sight_look(&picture, d, &(struct sight_observer){&limits, &now, &place, 0, need_m, NULL}, &e, &s);
        if (touches(q, k, v, half_az, slack + sight_aside_rad(&place, need_m))) {
            a.free_to_m = fmin(a.free_to_m, s.clear_m);
            a.blind_to_m = fmax(a.blind_to_m, s.blind_m);
            unknown |= s.reason != ANSWER_HEARD || s.blind_m >= need_m || s.clear_m < need_m;
        }
        if (s.obstacle && touches(q, k, v, half_az, slack + sight_aside_rad(&place, s.near_m + place.moved_m))) {
            blocked = true;
            a.range_m = fmin(a.range_m, s.near_m);
        }
    }
    unknown |= blocked && !sight_keeps(&rings, q->lo_rad - tilt - slack, q->hi_rad + tilt + slack);
    a.state = blocked && (unknown || a.range_m <= need_m) ? ANSWER_BLOCKED
              : unknown                                   ? ANSWER_UNKNOWN
                                                          : ANSWER_CLEAR;
    if (!isfinite(a.free_to_m) || a.free_to_m <= a.blind_to_m)
        a.free_to_m = 0;
    return a;
}

TEST(a_plain_walk_finds_the_same_sectors)
{
    static struct answer fast[ANSWER_SECTORS_MAX];
    unsigned states[3] = {0}, differ = 0;
    seed = test_seed();
    for (int i = 0; i < PICTURES; i++) {
        start();
        move();
        const struct ring_query q = any_ring();
        ask_ring(&q, fast);
        if (fast[0].reason == ANSWER_NO_FRAME)
            continue;
        for (int j = 0; j < QUESTIONS; j++) {
            const size_t k = test_random(&seed) % q.count;
            const struct answer slow = plain(&q, k), *a = &fast[k];
            const bool outside = a->reason == ANSWER_OUTSIDE; /* that is not the directions' to tell */
            states[a->state]++;
            differ += (!outside && a->state != slow.state) ||
                      (a->state == ANSWER_BLOCKED) != (slow.state == ANSWER_BLOCKED) ||
                      a->free_to_m != slow.free_to_m;
        }
    }
    printf("# clear %u, blocked %u, unknown %u; %u differ\n", states[0], states[1], states[2], differ);
    CHECK(states[ANSWER_CLEAR] > 20 && states[ANSWER_BLOCKED] > 50 && states[ANSWER_UNKNOWN] > 50);
    CHECK_INT(differ, 0);
}

/* How far along a direction's rays a question reaches, and how that bears on it. */
struct reach {
    double need_m;
    bool beside, side;
};

/*
 * How far the vehicle may be off the grid's centre across the wall of a question, never negative: towards a ray within
 * cell_rad of v, which is angle from the line; wall: from the line, too.
 */
static double towards(const struct sight_place *place, const double line[3], const double v[3], double angle,
                      double cell_rad, double wall)
{
    const double *o = place->offset_m;
    double ahead = 0, out[3], off[3], along = 0, across = 0;
    for (int i = 0; i < 3; i++)
        ahead += o[i] * line[i];
    for (int i = 0; i < 3; i++) {
        out[i] = (v[i] - cos(angle) * line[i]) / sin(angle);
        off[i] = o[i] - ahead * line[i];
        along += out[i] * off[i];
        across += off[i] * off[i];
    }
    across = sqrt(across);
    const double beside = across > 0 ? acos(fmax(-1, fmin(1, along / across))) : 0;
    const double spread = sin(angle) > sin(cell_rad) ? asin(sin(cell_rad) / sin(angle)) : GEO_PI;
    return fmax(0, cos(wall) * across * cos(fmax(0, beside - spread)) - sin(wall) * ahead) + place->uncertain_m;
}

/* As in sight.h and answer.h, by angles; gamma, far: of the direction's rays the one nearest to the line and no less
 * than the one farthest from it; off: see above. */
static struct reach plain_reach(const struct answer_query *q, const struct sight_place *place, double gamma,
                                double far, double off)
{
    const double wall = q->corridor ? 0 : q->half_angle_rad;
    if (!q->corridor && gamma <= wall)
        return (struct reach){.need_m = q->distance_m};
    if (!q->corridor)
        return (struct reach){.need_m = fmin(q->distance_m, off / sin(fmin(gamma - wall, GEO_PI / 2))),
                              .beside = true};
    if (gamma > GEO_PI / 2)
        return (struct reach){0};
    const double end = far < GEO_PI / 2 ? (q->distance_m + place->moved_m * (1 - cos(far))) / cos(far) : INFINITY;
    const double side = gamma > 0 ? (q->radius_m + off) / sin(gamma) : INFINITY;
    const double corner = hypot(q->distance_m + place->moved_m, q->radius_m + off);
    return (struct reach){.need_m = fmin(fmin(end, side), corner), .side = side < q->distance_m};
}

static double angle_of(const double a[3], const double b[3])
{
    return acos(fmax(-1, fmin(1, a[0] * b[0] + a[1] * b[1] + a[2] * b[2])));
}

/* State, age of the obstacle and water of a cone or corridor as they are after a look at each direction. */
static struct answer plain_line(const struct answer_query *q)
{
    struct answer a = {.state = ANSWER_CLEAR, .free_to_m = INFINITY, .range_m = INFINITY};
    struct picture_frame frame;
    struct sight_place place;
    double line[3];
    picture_get_frame(&picture, &frame);
    sight_locate(&picture, &frame, &limits, &now, &place);
    geo_direction(q->az_rad, q->el_rad, line);
    sight_to_grid(&frame, &now, q->ned, line);
    if (!q->corridor && place.moved_m > 0)
        a.blind_to_m = SIGHT_BESIDE * place.moved_m;
    for (uint32_t d = 0; d < rings.n; d++) {
        struct picture_entry e;
        struct sight s;
        const double more = q->ned ? 0 : place.turned_rad,
                     apart = geo_wrap_pi(atan2(line[1], line[0]) - atan2(axis[d][1], axis[d][0]));
        double v[3], az, el;
        geo_angles(axis[d], &az, &el);
        geo_direction(az + fmax(-place.adrift_rad, fmin(apart, place.adrift_rad)), el, v);
        const double angle = angle_of(v, line);
        const uint32_t ring = rings_ring(&rings, d);
        const struct cell_edge edge = cell_edge_of(&rings, ring);
        const double gamma = fmax(0, acos(fmin(1, cell_edge_nearest(&edge, v, line))) - more);
        const double cell_rad = fmin(sight_cell_reach(&rings, ring), GEO_PI / 2);
        const double off = towards(&place, line, v, angle, cell_rad, q->corridor ? 0 : q->half_angle_rad);
        const struct reach r = plain_reach(q, &place, gamma, gamma + 2 * (cell_rad + more), off);
        sight_look(&picture, d, &(struct sight_observer){&limits, &now, &place, q->near_m, r.need_m, NULL}, &e,
                   &s);
        const bool heard = s.reason == ANSWER_HEARD, good = heard && s.blind_m < r.need_m && s.clear_m >= r.need_m;
        const double around =
            q->half_angle_rad + asin(1 / SIGHT_BESIDE) + more + place.adrift_rad + rings.height_rad;
        if (r.need_m <= 0 || (!q->corridor && angle_of(axis[d], line) > around))
            continue;
        if (s.obstacle && s.near_m <= r.need_m && s.near_m < a.range_m) {
            a.state = ANSWER_BLOCKED;
            a.range_m = s.near_m;
            a.age_s = sight_seconds(NOW, s.obstacle->t_echo_ns);
        }
        if (r.beside) {
            a.blind_to_m =
                fmax(a.blind_to_m, heard && s.clear_m >= r.need_m ? fmin(r.need_m, s.blind_m) : r.need_m);
        } else if (r.side && ((heard && r.need_m <= s.blind_m) ||
                              (!good && r.need_m <= q->near_m - place.moved_m && r.need_m < s.hint_m))) {
            a.blind_to_m = fmax(a.blind_to_m, r.need_m);
        } else {
            a.blind_to_m = fmax(a.blind_to_m, s.blind_m);
            a.free_to_m = fmin(a.free_to_m, r.side && good ? INFINITY : s.clear_m);
            if (!good && a.state == ANSWER_CLEAR)
                a.state = ANSWER_UNKNOWN;
        }
    }
    if (a.blind_to_m >= q->distance_m && a.state == ANSWER_CLEAR)
        a.state = ANSWER_UNKNOWN;
    if (!isfinite(a.free_to_m) || a.free_to_m <= a.blind_to_m)
        a.free_to_m = 0;
    return a;
}

#define NEAR_M 1e-6 /* by angles or by their cosines: rounded otherwise */

static bool alike(const struct answer *a, const struct answer *slow)
{
    return a->state == slow->state && fabs(a->free_to_m - slow->free_to_m) < NEAR_M &&
           fabs(a->blind_to_m - slow->blind_to_m) < NEAR_M &&
           (a->state != ANSWER_BLOCKED || a->age_s == slow->age_s);
}

TEST(a_plain_walk_finds_the_same_cones_and_corridors)
{
    unsigned states[2][3] = {{0}}, differ = 0, short_of = 0;
    seed = test_seed();
    for (int i = 0; i < PICTURES; i++) {
        start();
        for (int j = 0; j < QUESTIONS; j++) {
            move();
            struct answer_query q = {.az_rad = uniform(0, GEO_TURN),
                                     .el_rad = uniform(-1.5, 1.5),
                                     .ned = one_in(2),
                                     .distance_m = uniform(0.5, 20),
                                     .corridor = one_in(2),
                                     .half_angle_rad = one_in(10) ? uniform(0, GEO_PI) : uniform(0, 0.3),
                                     .radius_m = uniform(0.1, 1),
                                     .near_m = uniform(0, 1)};
            struct answer fast;
            answer_direction(&picture, &limits, &now, &q, &fast);
            if (fast.reason == ANSWER_NO_FRAME || fast.reason == ANSWER_OUTSIDE)
                continue; /* that is not the directions' to tell */
            const struct answer slow = plain_line(&q);
            states[q.corridor][fast.state]++;
            differ += !alike(&fast, &slow);
            short_of += fast.state == ANSWER_CLEAR && fast.free_to_m < q.distance_m; /* it contradicts itself */
        }
    }
    for (int k = 0; k < 2; k++) {
        printf("# %s: clear %u, blocked %u, unknown %u; %u differ\n", k ? "corridors" : "cones",
               states[k][ANSWER_CLEAR], states[k][ANSWER_BLOCKED], states[k][ANSWER_UNKNOWN], differ);
        CHECK(states[k][ANSWER_BLOCKED] > 20 && states[k][ANSWER_UNKNOWN] > 50);
    }
    CHECK(states[0][ANSWER_CLEAR] + states[1][ANSWER_CLEAR] > 10);
    CHECK_INT(differ, 0);
    CHECK_INT(short_of, 0);
}

/* Somewhere in the question as seen from the vehicle, often in its wall; from the grid's centre. */
static void somewhere_in(const struct answer_query *q, const struct sight_place *place, double v[3])
{
    const double most = q->corridor ? q->radius_m : q->half_angle_rad, turn = uniform(0, GEO_TURN);
    const double wide = one_in(2) ? 0.999 * most : uniform(0, most), far_m = uniform(0.9, 0.999) * q->distance_m;
    const double ahead = q->corridor ? far_m : far_m * cos(wide), aside = q->corridor ? wide : far_m * sin(wide);
    double line[3], side[3], up[3];
    geo_direction(q->az_rad, q->el_rad, line);
    geo_direction(q->az_rad + GEO_PI / 2, 0, side);
    geo_direction(q->az_rad, q->el_rad + GEO_PI / 2, up);
    for (int i = 0; i < 3; i++)
        v[i] = place->offset_m[i] + ahead * line[i] + aside * (cos(turn) * side[i] + sin(turn) * up[i]);
}

/* All is free but for one small thing. */
static void put_one_thing(const double v[3])
{
    double az, el;
    start_with(rings_full(&rings, geo_rad(uniform(3, 15))), true);
    geo_angles(v, &az, &el);
    const uint32_t at = rings_index(&rings, az, el);
    picture_begin(&picture);
    for (uint32_t d = 0; d < rings.n; d++) {
        struct picture_entry e = {.free[0] = {.t_ping_ns = NOW, .to_m = 50}};
        if (d == at)
            e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = NOW,
                                                      .t_echo_ns = NOW,
                                                      .logodds = 4,
                                                      .near_m = (float)(geo_length(v) - 1e-4),
                                                      .range_m = (float)geo_length(v)};
        picture_set(&picture, d, &e);
    }
    picture_end(&picture);
}

TEST(nothing_in_a_cone_or_corridor_is_passed_over)
{
    seed = test_seed();
    for (int i = 0; i < 4000 && !test_case_failed; i++) {
        const struct answer_query q = {.az_rad = uniform(0, GEO_TURN),
                                       .el_rad = uniform(-1.5, 1.5),
                                       .ned = true,
                                       .distance_m = uniform(1, 10),
                                       .corridor = one_in(2),
                                       .half_angle_rad = uniform(0, 0.8),
                                       .radius_m = uniform(0.1, 1)};
        struct sight_place place = {.offset_m = {0}};
        double v[3];
        for (int k = 0; k < 3 && one_in(2); k++)
            place.offset_m[k] = uniform(-0.1, 0.1);
        somewhere_in(&q, &place, v);
        put_one_thing(v);
        memcpy(now.pose.position_m, place.offset_m, sizeof place.offset_m);
        struct answer a;
        answer_direction(&picture, &limits, &now, &q, &a);
        CHECK_INT(a.state, ANSWER_BLOCKED);
    }
}

/* Answers to all kinds of questions, one behind the other. */
struct answers {
    struct answer sector[ANSWER_SECTORS_MAX], cone, line;
};

static void ask_all(const struct ring_query *q, const double v[3], double reach_m, struct answers *out)
{
    struct answer_query query = {
        .ned = q->ned, .distance_m = reach_m, .half_angle_rad = 0.15, .radius_m = 0.5, .near_m = 0.7};
    geo_angles(v, &query.az_rad, &query.el_rad);
    memset(out, 0, sizeof *out);
    ask_ring(q, out->sector);
    answer_direction(&picture, &limits, &now, &query, &out->cone);
    query.corridor = true;
    answer_direction(&picture, &limits, &now, &query, &out->line);
}

TEST(a_blank_direction_is_one_that_says_nothing)
{
    static struct answers blank[QUESTIONS], looked;
    static struct ring_query q[QUESTIONS];
    static struct answer_now then[QUESTIONS];
    static double v[QUESTIONS][3], reach_m[QUESTIONS];
    unsigned differ = 0;
    seed = test_seed();
    for (int i = 0; i < PICTURES; i++) {
        start();
        for (int j = 0; j < QUESTIONS; j++) {
            move();
            then[j] = now;
            q[j] = any_ring();
            reach_m[j] = uniform(0.5, 20);
            geo_direction(uniform(0, GEO_TURN), uniform(-1.5, 1.5), v[j]);
            ask_all(&q[j], v[j], reach_m[j], &blank[j]);
        }
        leave_nothing_blank();
        for (int j = 0; j < QUESTIONS; j++) {
            now = then[j];
            ask_all(&q[j], v[j], reach_m[j], &looked);
            differ += memcmp(&blank[j], &looked, sizeof looked) != 0;
        }
    }
    CHECK_INT(differ, 0);
}

TEST(the_nearest_edge_is_told_of_each_direction)
{
    seed = test_seed();
    start();
    for (uint32_t d = 0; d < rings.n; d++) {
        const struct picture_entry e = heard(true, 0.7);
        double edge_m = INFINITY;
        picture_begin(&picture);
        picture_set(&picture, d, &e);
        picture_end(&picture);
        for (int k = 0; k < PICTURE_OBSTACLES && e.obstacle[k].logodds > 0; k++)
            edge_m = fmin(edge_m, (double)e.obstacle[k].near_m);
        CHECK(picture_edge_m(&picture, d) == edge_m);
        CHECK(!picture_blank(&picture, d));
    }
}

int main(void)
{
    RUN(a_plain_walk_finds_the_same_sectors);
    RUN(a_plain_walk_finds_the_same_cones_and_corridors);
    RUN(nothing_in_a_cone_or_corridor_is_passed_over);
    RUN(a_blank_direction_is_one_that_says_nothing);
    RUN(the_nearest_edge_is_told_of_each_direction);
    return test_end();
}
