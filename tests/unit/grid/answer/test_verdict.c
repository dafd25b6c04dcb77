/* SPDX-License-Identifier: MIT */
/*
 * test_verdict - what obstacles of a picture and records of free water are in the three words: clear is clear to every
 * shorter distance, `near` holds where a beam has looked, and each reason is told where it is the reason.
 */
#include "grid/answer/bottom.h"
#include "grid/answer/verdict.h"
#include "grid/ping.h"
#include "tests/lib/looks_rig.h"

#define TICK  (SECOND / 10)
#define BEAMS 32
#define OWN_M 0.5

static const struct store_conf conf = {.beams = {BEAMS, 1}, .spare = 1};
static struct store *store;
static struct store_list list;
static struct answer_conf by = {.clear_for_s = 30, .move_limit_m = INFINITY};
static struct beam_echoes beam[BEAMS];
static struct echoes ping;

/* A fan of 32 beams of 3 degrees ahead, 25 degrees high, that detects from 0.75 m on and hears nothing up to 10 m. */
static void begin(void)
{
    static void *memory;
    start_with(rings_full(&rings, geo_rad(3)), true);
    memory = memory ? memory : malloc(store_bytes(&conf));
    store = store_init(memory, &conf);
    by = (struct answer_conf){.clear_for_s = 30, .move_limit_m = INFINITY};
    now.pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping = (struct echoes){.n_beams = BEAMS,
                           .t_ns = NOW - SECOND,
                           .range_max_m = 10,
                           .az_aperture_rad = (float)geo_rad(3),
                           .el_aperture_rad = (float)geo_rad(25),
                           .beam = beam};
    for (int i = 0; i < BEAMS; i++)
        beam[i] = (struct beam_echoes){
            .az_rad = (float)geo_rad((i - (BEAMS - 1) / 2.0) * 3), .blind_m = 0.75f, .free_to_m = 10};
}

static void send(void)
{
    ping.seq++;
    ping.t_ns += TICK;
    ping.pose = now.pose;
    ping.pose.t_ns = ping.t_ns;
    store_enter(store, &ping, &mount_identity);
}

static void put_behind(double at_m, double logodds, double hint_m)
{
    struct picture_entry e = {.hint_m = (float)hint_m};
    e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = NOW,
                                              .t_echo_ns = NOW - SECOND,
                                              .logodds = (float)logodds,
                                              .near_m = (float)at_m,
                                              .range_m = (float)at_m};
    picture_begin(&picture);
    picture_set(&picture, rings_index(&rings, 0.01, 0.01), &e);
    picture_end(&picture);
}

/* An obstacle straight ahead, or an echo too little for one. */
static void put(double at_m, double logodds)
{
    put_behind(at_m, logodds, logodds > 0 ? 0 : at_m);
}

static const struct verdict *give(const struct obstacles_query *q)
{
    static struct verdict v;
    store_list(store, &list);
    const struct verdict_evidence evidence = {&picture, store, &list, &by, &now};
    for (bool more = verdict_begin(&v, &evidence, q, OWN_M); more;)
        more = verdict_step(&v);
    return &v;
}

static const struct answer *end(const struct obstacles_query *q)
{
    return verdict_of(give(q), 0);
}

static const struct answer *cone(double to_m, double near_m)
{
    return end(
        &(struct obstacles_query){.line = {.distance_m = to_m, .half_angle_rad = geo_rad(2.5), .near_m = near_m}});
}

static const struct answer *corridor(double to_m, double near_m)
{
    return end(&(struct obstacles_query){
        .line = {.distance_m = to_m, .corridor = true, .radius_m = 0.3, .near_m = near_m}});
}

/* The one ahead of eight. */
static const struct answer *sector(double to_m, double near_m)
{
    return end(&(struct obstacles_query){
        .around = true,
        .band = {.lo_rad = -geo_rad(2), .hi_rad = geo_rad(2), .reach_m = to_m, .near_m = near_m, .count = 8}});
}

typedef const struct answer *ask_fn(double to_m, double near_m);
static ask_fn *const asks[] = {cone, corridor, sector};

TEST(clear_to_a_distance_is_clear_to_every_shorter_one)
{
    begin();
    send();
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++)
        for (double to_m = 0.1; to_m < 12; to_m += 0.1) {
            const struct answer *a = asks[i](to_m, 1.5);
            CHECK(a->state == (to_m < 9.7 ? ANSWER_CLEAR : ANSWER_UNKNOWN) || (to_m >= 9.7 && to_m < 10));
            CHECK(a->state == ANSWER_CLEAR || a->reason == ANSWER_BEYOND);
            CHECK(a->state != ANSWER_CLEAR || fabs(a->confidence - (1 - a->age_s / 30)) < 1e-9);
            CHECK_NEAR(a->age_s, 0.9, 0, 1e-6);
            CHECK(a->range_m == 0);
        }
}

/* A narrow beam begins nearer than a wide one and ends before it: a narrow cone has a piece of water more. */
TEST(clear_to_a_cone_is_clear_to_a_narrower_one)
{
    begin();
    ping.n_beams = 1;
    ping.az_aperture_rad = (float)geo_rad(40);
    beam[0] = (struct beam_echoes){.blind_m = 1.5f, .free_to_m = 2.5f};
    send();
    ping.az_aperture_rad = (float)geo_rad(10);
    beam[0] = (struct beam_echoes){.blind_m = 0.75f, .free_to_m = 1};
    send();
    for (double half_deg = 8; half_deg > 0.5; half_deg /= 2) {
        const struct answer *a = end(&(struct obstacles_query){
            .line = {.distance_m = 2, .half_angle_rad = geo_rad(half_deg), .near_m = 3}});
        CHECK(a->state == ANSWER_CLEAR && a->free_to_m > 2);
    }
}

/* What lies behind an obstacle does not take the place of what lies before it. */
TEST(water_before_an_obstacle_is_told_whatever_is_free_behind_it)
{
    begin();
    ping.n_beams = 1;
    ping.az_aperture_rad = (float)geo_rad(40);
    beam[0] = (struct beam_echoes){.blind_m = 1.5f, .free_to_m = 2.5f};
    send();
    beam[0] = (struct beam_echoes){.blind_m = 0.75f, .free_to_m = 1};
    send();
    CHECK(cone(1.1, 3)->state == ANSWER_CLEAR);
    put(1.2, 4);
    CHECK_NEAR(cone(1.1, 3)->free_to_m, 1, 0, 0.05);
    CHECK(cone(1.1, 3)->state == ANSWER_UNKNOWN);
}

/* To the cone each ping shows one more piece of water. */
TEST(of_many_pieces_within_near_the_farthest_counts)
{
    begin();
    ping.n_beams = 1;
    for (int i = 14; i >= 0; i--) {
        ping.az_aperture_rad = (float)geo_rad(20 + i);
        beam[0] = (struct beam_echoes){.blind_m = 0.5f + 0.15f * (float)i, .free_to_m = 0.6f + 0.15f * (float)i};
        send();
    }
    CHECK(cone(2.6, 3)->state == ANSWER_CLEAR);
    CHECK(cone(2.8, 3)->state == ANSWER_UNKNOWN);
}

/* The line ahead goes from a beam of a sonar beside the vehicle, which ends, into the next one, which does not. */
TEST(water_within_near_goes_on_in_another_beam)
{
    const struct mount beside = {.attitude = {1, 0, 0, 0}, .position_m = {0, -0.5, 0}};
    begin();
    ping.az_aperture_rad = (float)geo_rad(10);
    ping.n_beams = 2;
    beam[0] = (struct beam_echoes){.az_rad = (float)geo_rad(25), .blind_m = 0.1f, .free_to_m = 5};
    beam[1] = (struct beam_echoes){.az_rad = (float)geo_rad(35),
                                   .blind_m = 0.1f,
                                   .free_to_m = 0.3f,
                                   .state = BEAM_ECHO,
                                   .n = 1,
                                   .echo = {{.range_m = 0.33f, .near_m = 0.3f, .confidence = 0.9f}}};
    ping.pose = now.pose;
    ping.pose.t_ns = ping.t_ns;
    store_enter(store, &ping, &beside);
    ping.n_beams = 1;
    beam[0] = (struct beam_echoes){.blind_m = 0.5f, .free_to_m = 0.7f};
    send();
    CHECK(cone(0.6, 1.5)->state == ANSWER_CLEAR);
    CHECK(cone(1.2, 1.5)->state == ANSWER_CLEAR);
    CHECK(cone(1.4, 1.5)->state == ANSWER_UNKNOWN);
}

TEST(what_is_next_to_the_vehicle_must_be_observed_or_promised)
{
    begin();
    send();
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++) {
        const struct answer *a = asks[i](5, OWN_M);
        CHECK(a->state == ANSWER_UNKNOWN && a->reason == ANSWER_BLIND);
        CHECK(a->blind_to_m >= 0.75 && a->blind_to_m < 2 && a->free_to_m > 4.9);
        a = asks[i](0.6, OWN_M);
        CHECK(a->state == ANSWER_UNKNOWN);
    }
}

/* With an echo nearer than `near` that is observed up to there. */
TEST(near_holds_up_to_what_is_observed)
{
    begin();
    for (int i = 0; i < BEAMS; i++) {
        beam[i].free_to_m = 2.9f;
        beam[i].n = 1;
    }
    send();
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++) {
        CHECK(asks[i](2, 4)->state == ANSWER_CLEAR);
        const struct answer *a = asks[i](3.5, 4);
        CHECK(a->state == ANSWER_UNKNOWN && a->reason == ANSWER_BEYOND && a->free_to_m > 2.5 && a->free_to_m < 3);
    }
}

/* Also where `near` promises it; and beyond the distance, in a cone or corridor, up to what ends it. */
TEST(water_is_told_from_where_it_was_observed)
{
    begin();
    send();
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++) {
        const struct answer *a = asks[i](5, 3);
        CHECK(a->state == ANSWER_CLEAR && a->blind_to_m >= 0.75);
        CHECK(a->blind_to_m <= 0.8125 || asks[i] == corridor);
        CHECK_NEAR(a->free_to_m, asks[i] == sector ? 5 : 9.9, 0, 0.15);
    }
    for (int i = 0; i < BEAMS; i++) {
        beam[i].free_to_m = 2;
        beam[i].n = 1;
    }
    send();
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++)
        CHECK(asks[i] == corridor || (asks[i](5, 3)->blind_to_m < 1 && asks[i](5, 3)->free_to_m > 1.9));
}

TEST(nothing_is_promised_where_nobody_looked)
{
    begin();
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++)
        CHECK(asks[i](1, 4)->state == ANSWER_UNKNOWN && asks[i](1, 4)->reason == ANSWER_NEVER);
}

TEST(blocked_is_an_obstacle_within_the_distance)
{
    begin();
    put(6, 2);
    send();
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++) {
        const struct answer *a = asks[i](7, 1.5);
        CHECK(a->state == ANSWER_BLOCKED && a->range_m == 6 && a->age_s == 1 && a->confidence > 0.5);
        CHECK(a->free_to_m <= 6 && a->free_to_m > 5.9);
        a = asks[i](5.5, 1.5);
        CHECK(a->state == ANSWER_CLEAR && a->range_m == (asks[i] == sector ? 6 : 0));
        CHECK(asks[i] == sector || (a->free_to_m > 5.9 && a->free_to_m <= 6));
    }
    put(1, 0); /* nearer than `near`, where no record tells of it */
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++)
        CHECK(asks[i](5, 1.5)->state == ANSWER_UNKNOWN && asks[i](0.9, 1.5)->reason != ANSWER_BEYOND);
}

/* Whatever stands behind it, beyond the distance. */
TEST(an_echo_within_near_that_is_too_little_to_block_bars_the_water)
{
    begin();
    send();
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++) {
        put_behind(9, 2, 1);
        CHECK_INT(asks[i](5, 1.5)->state, ANSWER_UNKNOWN);
        put_behind(9, 2, 0);
        CHECK_INT(asks[i](5, 1.5)->state, ANSWER_CLEAR);
    }
}

TEST(each_reason_is_told)
{
    begin();
    send();
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++) {
        by.clear_for_s = 0.5;
        CHECK(asks[i](5, 1.5)->reason == ANSWER_STALE && asks[i](5, 1.5)->age_s > 0.5);
        by.clear_for_s = 30;
        now.lost = 1;
        CHECK(asks[i](5, 1.5)->reason == ANSWER_SILENT);
        now.lost = 0;
        by.move_limit_m = 0.2;
        now.pose.path_m = 0.3;
        CHECK(asks[i](5, 1.5)->reason == ANSWER_MOVED);
        now.pose.path_m = 0;
        CHECK(asks[i](5, 1.5)->state == ANSWER_CLEAR);
        now.pose.uncertain_rad = geo_rad(20); /* the fan looks 12.5 degrees up and down */
        CHECK(asks[i](5, 1.5)->reason == ANSWER_NEVER);
        now.pose.uncertain_rad = 0;
        now.pose_fresh = false;
        CHECK(asks[i](5, 1.5)->reason == ANSWER_POSE_LOST);
        now.pose_fresh = true;
        now.pose.has |= POSE_ALTITUDE;
        now.pose.altitude_m = 0.8;
        CHECK(asks[i](5, 1.5)->reason == ANSWER_BOTTOM && asks[i](1.6, 1.5)->state == ANSWER_CLEAR);
        const struct answer *low = asks[i](5, 4); /* where `near` would promise more */
        CHECK(low->state == ANSWER_UNKNOWN && low->reason == ANSWER_BOTTOM);
        CHECK(low->free_to_m > 1.6 && low->free_to_m < 3.5 && low->blind_to_m < low->free_to_m);
        now.pose.altitude_m = 30;
        CHECK(asks[i](5, 1.5)->state == ANSWER_CLEAR);
        now.pose.has &= ~(unsigned)POSE_ALTITUDE;
    }
}

/* The sonars, as `near` has it: those that turn take so long for a turn, and have looked everywhere within 12 s, or
 * for so long no farther than that to each side. */
static void turn(double turn_s, double swept_deg)
{
    struct picture_frame frame;
    picture_get_frame(&picture, &frame);
    frame.turn_s = turn_s;
    for (int k = 0; k < BEARINGS && swept_deg > 0; k++)
        if (fabs(geo_wrap_pi((k + 0.5) * GEO_TURN / BEARINGS)) > geo_rad(swept_deg))
            frame.looks.heard_ds[0][k] = 120;
    for (int k = 1; k < BEARINGS_SENSORS; k++)
        memset(frame.looks.heard_ds[k], 0xff, sizeof frame.looks.heard_ds[k]);
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
}

/* A post of which there was an echo so long ago. */
static void put_post(double az_deg, double at_m, double age_s)
{
    struct picture_entry e = {0};
    const uint64_t t_ns = NOW - (uint64_t)(age_s * 1e9);
    e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = t_ns,
                                              .t_echo_ns = t_ns,
                                              .logodds = 4,
                                              .near_m = (float)at_m,
                                              .range_m = (float)at_m,
                                              .sd_m = 0.05f};
    picture_begin(&picture);
    picture_set(&picture, rings_index(&rings, geo_rad(az_deg), geo_rad(1)), &e);
    picture_end(&picture);
}

/*
 * Ahead the fan has just shown all that it can, which is nothing nearer than 1.5 m. Beside that a beam has shown a post
 * at 3 m, past which the vehicle may have drifted since; not if all has been looked at since, or nobody looks there.
 */
TEST(what_was_shown_beside_may_have_come_ahead)
{
    static const uint64_t all = UINT64_MAX, ahead = UINT64_C(0xff000000000000ff);
    static const struct {
        double az_deg, age_s, turn_s;
        uint64_t bearings;
        double come_m; /* negative: nothing has */
        double swept_deg;
    } row[] = {{40, 4, 4, all, 1, 0},    {-40, 4, 4, all, 1, 0},   {40, 1, 4, all, -1, 0}, {90, 4, 4, all, -1, 0},
               {90, 8, 4, all, 0, 0},    {150, 8, 4, all, 0, 0},   {90, 8, 3, all, -1, 0}, {90, 8, 3, all, 0, 60},
               {90, 8, 4, ahead, -1, 0}, {40, 4, 0, ahead, -1, 0}, {40, 4, 4, 0, -1, 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        begin();
        looks_at(row[i].bearings, 0, false);
        turn(row[i].turn_s, row[i].swept_deg);
        put_post(row[i].az_deg, 3, row[i].age_s);
        ping.el_aperture_rad = (float)geo_rad(60);
        for (int k = 0; k < BEAMS; k++)
            beam[k].blind_m = 1.5f;
        send();
        for (size_t k = 0; k < sizeof asks / sizeof *asks; k++)
            CHECK(asks[k](2.5, 4)->state == ANSWER_CLEAR);
        now.pose.drift_mps = 0.5;
        for (size_t k = 0; k < sizeof asks / sizeof *asks; k++)
            for (double to_m = 0.5; to_m < 2.6; to_m += 0.5) {
                const struct answer *a = asks[k](to_m, 4);
                CHECK_INT(a->state, row[i].come_m < 0 ? ANSWER_CLEAR : ANSWER_UNKNOWN);
                CHECK(a->state == ANSWER_CLEAR || (a->reason == ANSWER_MOVED && a->blind_to_m >= 1.5));
            }
        for (int k = 0; k < BEAMS; k++)
            beam[k].blind_m = 0.75f; /* now it shows that nothing has come */
        send();
        for (size_t k = 0; k < sizeof asks / sizeof *asks; k++)
            CHECK_INT(asks[k](2.5, 4)->state, row[i].come_m == 0 ? ANSWER_UNKNOWN : ANSWER_CLEAR);
    }
}

/* ---- axes, sectors and what they have to heed ---- */

/* The vehicle heads for 70 degrees, and the fan is free ahead of it alone. */
TEST(a_question_is_asked_in_its_own_axes)
{
    for (int ned = 0; ned < 2; ned++)
        for (int az_deg = -140; az_deg <= 140; az_deg += 70) {
            const bool free = az_deg == (ned ? 70 : 0);
            begin();
            quat_from_rpy(0, 0, geo_rad(70), now.pose.attitude);
            send();
            struct obstacles_query q = {.line = {.az_rad = geo_rad(az_deg),
                                                 .ned = ned,
                                                 .distance_m = 5,
                                                 .half_angle_rad = geo_rad(2.5),
                                                 .near_m = 1.5}};
            CHECK_INT(end(&q)->state, free ? ANSWER_CLEAR : ANSWER_UNKNOWN);
            q.line.corridor = true;
            q.line.radius_m = 0.3;
            CHECK_INT(end(&q)->state, free ? ANSWER_CLEAR : ANSWER_UNKNOWN);
            for (size_t count = 1; count < 3; count++) {
                q = (struct obstacles_query){.around = true,
                                             .band = {.ned = ned,
                                                      .lo_rad = -0.03,
                                                      .hi_rad = 0.03,
                                                      .from_rad = geo_rad(az_deg - 10),
                                                      .width_rad = geo_rad(20),
                                                      .reach_m = 5,
                                                      .near_m = 1.5,
                                                      .count = count}};
                const struct verdict *v = give(&q);
                for (size_t k = 0; k < count; k++)
                    CHECK_INT(verdict_of(v, k)->state, free ? ANSWER_CLEAR : ANSWER_UNKNOWN);
            }
            for (int size = 1; size < 4; size++) {
                q = (struct obstacles_query){
                    .moves = true, .move = {.body = {0.2, 0.1, 0.1}, .ned = ned, .most_m = 5, .near_m = 1.5}};
                geo_direction(geo_rad(az_deg), 0, q.move.direction);
                for (int i = 0; i < 3; i++)
                    q.move.direction[i] *= size;
                const struct corridor *c = verdict_corridor(give(&q));
                CHECK_INT(c->reason == ANSWER_HEARD, free);
                CHECK(free ? c->known_m == 5 : c->known_m < 1.6);
            }
        }
    quat_from_rpy(0, 0, 0, now.pose.attitude);
}

/* Picture and records are in the body's axes: whatever a pose has in the place of an attitude turns nothing, and an
 * altitude says nothing of where the bottom is. */
TEST(without_an_attitude_questions_are_asked_in_the_axes_of_the_body)
{
    begin();
    start_with(rings_full(&rings, geo_rad(3)), false);
    now.pose.has = 0;
    send();
    now.pose.has = POSE_ALTITUDE;
    now.pose.altitude_m = 0.3;
    quat_from_rpy(0, 0, geo_rad(120), now.pose.attitude);
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++)
        CHECK_INT(asks[i](5, 1.5)->state, ANSWER_CLEAR);
    const struct obstacles_query one = {
        .around = true,
        .band = {.lo_rad = -0.03, .hi_rad = 0.03, .width_rad = 0.1, .reach_m = 5, .near_m = 1.5, .count = 1}};
    CHECK_INT(end(&one)->state, ANSWER_CLEAR);
    const struct obstacles_query move = {
        .moves = true, .move = {.body = {0.2, 0.1, 0.1}, .direction = {1, 0, 0}, .most_m = 12, .near_m = 1.5}};
    const struct corridor *c = verdict_corridor(give(&move));
    CHECK(c->known_m > 9.5 && c->known_at[0] > 0.9);
    CHECK_INT(c->reason, ANSWER_BEYOND);
}

/* The middle beam of each sector hears nothing up to a range of its own. */
static void send_sectors(size_t count, double first_deg, double step_deg)
{
    begin();
    for (size_t k = 0; k < count; k++)
        for (int i = 0; i < BEAMS; i++)
            if (fabs(geo_deg(geo_wrap_pi((double)beam[i].az_rad - geo_rad(first_deg + (double)k * step_deg)))) <
                1.6)
                beam[i].free_to_m = (float)(3 + (double)k);
    send();
}

TEST(each_sector_is_told_of_its_own_water)
{
    for (int low = 0; low < 2; low++) { /* with the bottom below, which they all meet */
        struct obstacles_query q = {.around = true,
                                    .band = {.lo_rad = low ? -geo_rad(10) : -0.03,
                                             .hi_rad = 0.03,
                                             .from_rad = -geo_rad(45),
                                             .width_rad = geo_rad(90),
                                             .reach_m = 9,
                                             .near_m = 1.5,
                                             .count = 5}};
        send_sectors(5, -36, 18);
        now.pose.altitude_m = 0.5;
        now.pose.has |= low ? POSE_ALTITUDE : 0;
        const struct bottom bottom = bottom_below(0.5, 0, 0);
        for (int around = 0; around < 2; around++) {
            const double bottom_m = low ? bottom_reach_m(&bottom, sin(geo_rad(10))) : INFINITY;
            for (int alone = 0; alone < 2; alone++)
                for (size_t k = 0; k < 5; k++) {
                    struct obstacles_query one = q;
                    const double middle_deg = around ? 18 * ((double)k - 2) : -36 + 18 * (double)k;
                    size_t at = around ? (k + 18) % 20 : k;
                    if (alone) {
                        one.band.from_rad = geo_rad(middle_deg - 9);
                        one.band.width_rad = geo_rad(18);
                        one.band.count = 1;
                        at = 0;
                    }
                    const struct answer *a = verdict_of(give(&one), at);
                    CHECK(a->state == ANSWER_UNKNOWN);
                    CHECK(a->free_to_m <= fmin(3 + (double)k, bottom_m) &&
                          a->free_to_m > fmin(2.7 + (double)k, 0.9 * bottom_m));
                    CHECK_INT(a->reason, bottom_m < 2.7 + (double)k ? ANSWER_BOTTOM : ANSWER_BEYOND);
                }
            q.band.from_rad = q.band.width_rad = 0; /* all around, the first one ahead */
            q.band.count = 20;
        }
        now.pose.has &= ~(unsigned)POSE_ALTITUDE;
    }
}

/* Its water begins later than that of the others, so it is asked by itself: it is free as far as the others, or not. */
TEST(a_sector_that_begins_late_is_asked_where_it_is)
{
    for (int around = 0; around < 2; around++)
        for (int late = 0; late < 5; late++)
            for (int ends = 0; ends < 2; ends++) {
                begin();
                for (int i = 0; i < BEAMS; i++)
                    if (fabs(geo_deg(geo_wrap_pi((double)beam[i].az_rad - geo_rad(-36 + 18 * late)))) < 1.6) {
                        beam[i].blind_m = 1.3f;
                        beam[i].free_to_m = ends ? 3 : 10;
                    }
                send();
                struct obstacles_query q = {
                    .around = true, .band = {.lo_rad = -0.03, .hi_rad = 0.03, .reach_m = 5, .near_m = 1.5}};
                q.band.from_rad = around ? 0 : -geo_rad(45);
                q.band.width_rad = around ? 0 : geo_rad(90);
                q.band.count = around ? 20 : 5;
                const struct verdict *v = give(&q);
                for (int k = 0; k < 5; k++) {
                    const struct answer *a = verdict_of(v, (size_t)(around ? (k + 18) % 20 : k));
                    const bool unknown = k == late && ends;
                    CHECK_INT(a->state, unknown ? ANSWER_UNKNOWN : ANSWER_CLEAR);
                    CHECK(k == late ? a->blind_to_m >= 1.3 && a->blind_to_m < 1.5 : a->blind_to_m < 1);
                    CHECK(!unknown || (a->free_to_m <= 3 && a->free_to_m > 2.7));
                }
            }
}

/* One beam hears less far: of it, and of what was asked, is the direction in which the water ends. */
TEST(the_water_ends_in_a_direction_that_was_asked)
{
    for (int turned = 0; turned < 2; turned++)
        for (int i = 8; i < BEAMS - 8; i++) {
            const double short_deg = (i - (BEAMS - 1) / 2.0) * 3, heading_deg = turned ? 70 : 0;
            double asked[3], az, el;
            begin();
            quat_from_rpy(0, 0, geo_rad(heading_deg), now.pose.attitude);
            beam[i].free_to_m = 3;
            send();
            for (int k = -1; k <= 1; k++) {
                struct obstacles_query q = {.line = {.az_rad = geo_rad(short_deg + 3 * k),
                                                     .el_rad = geo_rad(2 * k),
                                                     .distance_m = 5,
                                                     .half_angle_rad = geo_rad(2.5),
                                                     .near_m = 1.5}};
                const struct verdict_part *part = &give(&q)->part[0];
                geo_direction(q.line.az_rad + geo_rad(heading_deg), q.line.el_rad, asked);
                geo_angles(part->end_at, &az, &el);
                CHECK_NEAR(geo_length(part->end_at), 1, 0, 1e-9);
                CHECK(geo_dot(part->end_at, asked) >= cos(geo_rad(2.5)) - 1e-9);
                CHECK(fabs(geo_wrap_pi(az - geo_rad(short_deg + heading_deg))) < geo_rad(2.5));
                CHECK(part->end_m <= 3 && part->end_m > 2.7);
                q = (struct obstacles_query){.around = true,
                                             .band = {.lo_rad = 0.05 * k - 0.02,
                                                      .hi_rad = 0.05 * k + 0.02,
                                                      .from_rad = geo_rad(short_deg + 3 * k - 2.5),
                                                      .width_rad = geo_rad(5),
                                                      .reach_m = 5,
                                                      .near_m = 1.5,
                                                      .count = 1}};
                part = &give(&q)->part[0];
                geo_angles(part->end_at, &az, &el);
                CHECK_NEAR(geo_length(part->end_at), 1, 0, 1e-9);
                CHECK(el >= q.band.lo_rad - 1e-9 && el <= q.band.hi_rad + 1e-9);
                CHECK(fabs(geo_wrap_pi(az - geo_rad(short_deg + 3 * k + heading_deg))) <= geo_rad(2.5) + 1e-9);
                CHECK(fabs(geo_wrap_pi(az - geo_rad(short_deg + heading_deg))) < geo_rad(2.5));
            }
        }
    quat_from_rpy(0, 0, 0, now.pose.attitude);
}

/* As low as the cone reaches, however uncertain its axes are. */
TEST(the_bottom_is_met_by_the_lowest_direction_of_a_cone)
{
    begin();
    send();
    now.pose.has |= POSE_ALTITUDE;
    now.pose.altitude_m = 0.7;
    const struct bottom bottom = bottom_below(0.7, 0, 0);
    for (int turned = 0; turned < 2; turned++)
        for (double down_deg = 1; down_deg < 6; down_deg += 0.0731) {
            now.pose.uncertain_rad = turned ? geo_rad(2) : 0;
            const struct obstacles_query q = {
                .line = {
                    .el_rad = -geo_rad(down_deg), .distance_m = 8, .half_angle_rad = geo_rad(2.5), .near_m = 1.5}};
            const double bottom_m = bottom_reach_m(&bottom, sin(geo_rad(down_deg + 2.5 + 2 * turned)));
            const struct answer *a = end(&q);
            CHECK(a->state == ANSWER_UNKNOWN && a->reason == ANSWER_BOTTOM);
            CHECK(a->free_to_m <= bottom_m && a->free_to_m > 0.85 * bottom_m);
        }
    now.pose.uncertain_rad = 0;
    now.pose.has &= ~(unsigned)POSE_ALTITUDE;
}

static uint64_t bottom_seed = 1;

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&bottom_seed);
}

/* A direction within so far of another one, as often at the rim as in the middle. */
static void beside(const double v[3], double most_rad, double out[3])
{
    double any[3], aside[3];
    geo_direction(between(0, GEO_TURN), between(-1, 1), any);
    for (int i = 0; i < 3; i++)
        aside[i] = any[(i + 1) % 3] * v[(i + 2) % 3] - any[(i + 2) % 3] * v[(i + 1) % 3];
    const double size = geo_length(aside), off = most_rad * fmin(1, between(0, 2));
    for (int i = 0; i < 3; i++)
        out[i] = cos(off) * v[i] + (size > 0 ? sin(off) / size * aside[i] : 0);
}

/* From the body's axes into NED, turned by up to so far from what the attitude says. */
static void turn_loosely(double most_rad, double v[3])
{
    double about[3];
    geo_direction(between(0, GEO_TURN), asin(between(-1, 1)), about);
    const double half = most_rad * fmin(1, between(0, 2)) / 2;
    const double turn[4] = {cos(half), sin(half) * about[0], sin(half) * about[1], sin(half) * about[2]};
    quat_rotate(now.pose.attitude, v, v);
    quat_rotate(turn, v, v);
}

static bool is_below(const struct bottom *bottom, const double v[3])
{
    const double size = geo_length(v);
    return size > 0 && size >= bottom_reach_m(bottom, v[2] / size);
}

/* A place in the question, in the body's axes, and how far the question is free at most if that is not. */
static double place_in(const struct obstacles_query *q, const double axis_at[3], double front_m, double at[3])
{
    const double along_m = between(0, 8);
    double any[3];
    geo_direction(between(0, GEO_TURN), asin(between(-1, 1)), any);
    if (q->around)
        geo_direction(q->band.from_rad + q->band.width_rad * between(0, 1),
                      fmax(q->band.lo_rad, between(q->band.lo_rad - 0.05, q->band.hi_rad)), at);
    else if (q->moves) {
        const struct corridor_body *body = &q->move.body;
        const double turn = between(0, GEO_TURN), off_m = body->radius_m * sqrt(between(0, 1));
        at[0] = off_m * cos(turn);
        at[1] = off_m * sin(turn);
        at[2] = body->half_height_m * between(-1, 1);
        for (int i = 0; i < 3; i++)
            at[i] += along_m * axis_at[i] + body->margin_m * any[i];
        return front_m + along_m;
    } else if (q->line.corridor) {
        const double along = geo_dot(any, axis_at), off_m = q->line.radius_m * sqrt(between(0, 1));
        const double size = sqrt(1 - along * along);
        for (int i = 0; i < 3; i++)
            at[i] = along_m * axis_at[i] + off_m / size * (any[i] - along * axis_at[i]);
        return along_m;
    } else
        beside(axis_at, q->line.half_angle_rad, at);
    for (int i = 0; i < 3; i++)
        at[i] *= along_m;
    return along_m;
}

/* Any direction that is asked, as far as the axes may be turned, may be the one that meets it; no other one does. */
TEST(no_question_goes_through_the_bottom_and_none_ends_above_it)
{
    int met = 0;
    begin();
    now.pose.has |= POSE_ALTITUDE;
    for (int k = 0; k < 160; k++) {
        const double half = geo_rad(between(0.5, 6)), loose = k % 3 ? geo_rad(between(0, 3)) : 0;
        const double az = between(-GEO_PI, GEO_PI), el = between(-0.7, 0.2), wide = geo_rad(between(1, 30));
        const struct obstacles_query kinds[] = {
            {.line = {.az_rad = az, .el_rad = el, .half_angle_rad = half, .distance_m = 8, .near_m = 1}},
            {.line = {.az_rad = az,
                      .el_rad = el,
                      .corridor = true,
                      .radius_m = between(0.1, 0.6),
                      .distance_m = 8,
                      .near_m = 1}},
            {.around = true,
             .band = {.lo_rad = el - half,
                      .hi_rad = el + half,
                      .from_rad = geo_wrap(az - wide / 2),
                      .width_rad = wide,
                      .reach_m = 8,
                      .near_m = 1,
                      .count = 1}},
            {.moves = true, .move = {.body = {0.3, 0.2, 0.1}, .most_m = 9, .near_m = 1}}};
        struct obstacles_query q = kinds[k % 4];
        double axis_at[3], at[3], least_m = INFINITY;
        geo_direction(az, el, axis_at);
        memcpy(q.move.direction, axis_at, sizeof axis_at);
        now.pose.uncertain_rad = loose;
        now.pose.altitude_m = between(0.2, 2);
        quat_from_rpy(between(-0.3, 0.3), between(-0.3, 0.3), between(-3, 3), now.pose.attitude);
        const struct bottom bottom = bottom_below(now.pose.altitude_m, 0, 0);
        const struct verdict *v = give(&q);
        for (int i = 0; i < 2000; i++) {
            const double free_m = place_in(&q, axis_at, v->corridor.front_m, at);
            turn_loosely(loose, at);
            if (is_below(&bottom, at))
                least_m = fmin(least_m, free_m);
        }
        met += least_m < 8;
        CHECK(least_m >= 8 || v->part[0].bottom_m <= least_m + 1e-9);
        if (k % 4 == 0) { /* half a degree: the last tile that touches it, and its middle */
            quat_rotate(now.pose.attitude, axis_at, axis_at);
            const double lowest = asin(axis_at[2]) + half + loose + geo_rad(0.5);
            CHECK(v->part[0].bottom_m >= bottom_reach_m(&bottom, sin(fmin(lowest, GEO_PI / 2))));
        }
    }
    CHECK(met > 80);
    now.pose.uncertain_rad = 0;
    now.pose.has &= ~(unsigned)POSE_ALTITUDE;
    quat_from_rpy(0, 0, 0, now.pose.attitude);
}

/* Also where that is nearer than `near`, from where on the water of a corridor is asked. */
TEST(the_bottom_that_reaches_into_a_corridors_side_ends_it)
{
    struct obstacles_query q = {.line = {.corridor = true, .radius_m = 0.5, .distance_m = 5, .near_m = 1.5}};
    begin();
    ping.el_aperture_rad = (float)geo_rad(120);
    send();
    now.pose.has |= POSE_ALTITUDE;
    for (int up_deg = 0; up_deg < 45; up_deg += 5)
        for (int low = 0; low < 2; low++) {
            now.pose.altitude_m = low ? 0.5 : 5;
            q.line.el_rad = geo_rad(up_deg);
            const struct answer *a = end(&q);
            CHECK_INT(a->state, low ? ANSWER_UNKNOWN : ANSWER_CLEAR);
            CHECK(!low || (a->reason == ANSWER_BOTTOM && a->free_to_m == 0));
        }
    now.pose.has &= ~(unsigned)POSE_ALTITUDE;
}

/* What may have come to any direction that is asked, as uncertain as the heading is, ends what is promised. */
TEST(near_holds_no_farther_than_to_what_may_have_come_into_any_of_it)
{
    int less = 0;
    for (int heading = 0; heading < 3; heading++) {
        const double axes_rad = heading == 2 ? 1.2 : 0; /* of a grid that is not turned to the north */
        begin();
        looks_at(UINT64_MAX, 0, false);
        turn(4, 0);
        turn_axes(axes_rad);
        put_post(40, 3, 4);
        now.pose.drift_mps = 0.5;
        now.pose.heading_radps = heading == 1 ? 0.004 : 0;
        struct obstacles_query sectors = {
            .around = true, .band = {.lo_rad = -0.03, .hi_rad = 0.03, .reach_m = 2.5, .near_m = 4, .count = 100}};
        sectors.band.from_rad = geo_rad(-20);
        sectors.band.width_rad = geo_rad(100);
        const struct verdict *all = give(&sectors);
        for (size_t n = 0; n < 100; n++) {
            const double part = geo_wrap(geo_rad((double)n - 19.5) - axes_rad) / GEO_TURN * PROMISE_PARTS;
            CHECK(all->part[n].promised_m <= fmax(all->horizon.promise.come_m[(int)part % PROMISE_PARTS], OWN_M));
        }
        for (double az_deg = -60; az_deg < 100; az_deg += 0.7) {
            struct obstacles_query q = {
                .line = {
                    .az_rad = geo_rad(az_deg), .distance_m = 2.5, .half_angle_rad = geo_rad(2.5), .near_m = 4}};
            for (int up = 0; up < 3; up++) {
                q.line.el_rad = geo_rad(40 * up);
                const struct verdict *v = give(&q);
                const double half = asin(sin(geo_rad(2.5)) / cos(q.line.el_rad)) + 30 * now.pose.heading_radps;
                for (double off = -half; off <= half; off += half / 8) {
                    const double part = geo_wrap(q.line.az_rad + off - axes_rad) / GEO_TURN * PROMISE_PARTS;
                    const double come_m = v->horizon.promise.come_m[(int)part % PROMISE_PARTS];
                    CHECK(v->part[0].promised_m <= fmax(come_m, OWN_M));
                    less += come_m < 4;
                }
            }
        }
    }
    now.pose.drift_mps = now.pose.heading_radps = 0;
    CHECK(less > 1000);
}

/* Of a fan of 96 degrees off the middle: in which directions it looks depends on how far away that is. */
TEST(near_holds_where_a_fan_off_the_middle_has_looked)
{
    static const struct {
        double mount_m[2], az_deg, near_m;
        bool looks;
    } row[] = {{{0, 0}, 40, 2, true},     {{0, 0}, 55, 2, false},    {{-0.6, 0}, 55, 2, true}, /* 43 degrees */
               {{-0.6, 0}, 55, 4, true},  {{0.4, 0}, 40, 2, false},                            /* 49 degrees */
               {{0.4, 0}, 40, 4, true},   {{0, 0.4}, 50, 2, true},   {{0, 0.4}, -42, 2, false},
               {{0, -0.4}, -50, 2, true}, {{0, -0.4}, 42, 2, false}, {{0, 0.4}, -42, 8, true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const struct mount mount = {.attitude = {1, 0, 0, 0},
                                    .position_m = {row[i].mount_m[0], row[i].mount_m[1]}};
        begin();
        ping.seq++;
        ping.pose = now.pose;
        ping.pose.t_ns = ping.t_ns;
        store_enter(store, &ping, &mount);
        for (double to_m = 0.6; to_m < 1.6; to_m += 0.3) {
            const struct answer *a = end(&(struct obstacles_query){.line = {.az_rad = geo_rad(row[i].az_deg),
                                                                            .distance_m = to_m,
                                                                            .half_angle_rad = geo_rad(1),
                                                                            .near_m = row[i].near_m}});
            CHECK_INT(a->state, row[i].looks ? ANSWER_CLEAR : ANSWER_UNKNOWN);
        }
    }
}

/* ---- a body that moves ---- */

static const struct corridor_body small = {.radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1};

static const struct corridor *way_down(const struct corridor_body *body, double az_deg, double down_deg,
                                       double to_m, double near_m)
{
    static struct verdict v;
    struct obstacles_query q = {.moves = true, .move = {.body = *body, .most_m = to_m, .near_m = near_m}};
    geo_direction(geo_rad(az_deg), geo_rad(-down_deg), q.move.direction);
    store_list(store, &list);
    const struct verdict_evidence evidence = {&picture, store, &list, &by, &now};
    for (bool more = verdict_begin(&v, &evidence, &q, OWN_M); more;)
        more = verdict_step(&v);
    return verdict_corridor(&v);
}

static const struct corridor *way(const struct corridor_body *body, double az_deg, double to_m, double near_m)
{
    return way_down(body, az_deg, 0, to_m, near_m);
}

/* The fan of these tests, as `near` knows it. */
static void look_on(void)
{
    struct bearings b = {0};
    look_with(&b, &(struct still_fan){.wide_deg = 96, .high_deg = 25});
}

TEST(a_body_goes_where_water_is_observed)
{
    begin();
    send();
    for (double to_m = 1; to_m < 12; to_m += 0.5) {
        const struct corridor *c = way(&small, 0, to_m, 1.5);
        CHECK_NEAR(c->known_m, fmin(to_m, 9.9), 0, 0.3);
        CHECK_INT(c->reason, c->known_m < to_m ? ANSWER_BEYOND : ANSWER_HEARD);
        CHECK(isinf(c->blocked_m) && c->blocked_age_s < 0);
        CHECK_NEAR(c->front_m, 0.4, 0, 1e-9);
        CHECK_NEAR(c->age_s, 1 - 0.1, 0, 1e-6);
    }
    put(6, 2);
    const struct corridor *c = way(&small, 0, 8, 1.5);
    CHECK(c->blocked_m <= 6 && c->blocked_m > 5.8 && c->confidence > 0.5 && c->blocked_at[0] > 0.9);
    put(1, 0); /* too little to block */
    c = way(&small, 0, 8, 1.5);
    CHECK(isinf(c->blocked_m) && c->reason == ANSWER_BEYOND && c->known_m <= 1 && c->known_m > 0.9);
}

TEST(a_direction_is_one_however_long)
{
    begin();
    for (int i = 0; i < BEAMS; i++)
        beam[i].free_to_m = (float)(2 + i % 7);
    send();
    for (int k = -30; k <= 30; k += 5) {
        struct obstacles_query q = {.moves = true, .move = {.body = small, .most_m = 6, .near_m = 1.5}};
        double known_m[2];
        for (int twice = 0; twice < 2; twice++) {
            geo_direction(geo_rad(k), 0, q.move.direction);
            for (int i = 0; i < 3; i++)
                q.move.direction[i] *= 1 + twice;
            known_m[twice] = verdict_corridor(give(&q))->known_m;
        }
        CHECK_NEAR(known_m[0], known_m[1], 0, 0.05);
    }
}

/* Within what the body sweeps, on the side where the water ends, in the axes that it was asked in. */
TEST(a_way_is_told_to_end_in_a_place_of_the_body)
{
    for (int ned = 0; ned < 2; ned++)
        for (int side = -1; side <= 1; side += 2)
            for (int up = 0; up < 3; up++) {
                begin();
                quat_from_rpy(0, 0, geo_rad(70), now.pose.attitude);
                for (int i = 0; i < BEAMS && up == 2; i++)
                    if (side * (double)beam[i].az_rad > 0)
                        beam[i].free_to_m = 6; /* on that side */
                send();
                const double el = up == 2 ? 0 : geo_rad(9 * side),
                             az = ned ? geo_rad(70) : 0; /* or out of the fan */
                struct obstacles_query q = {.moves = true, .move = {.ned = ned, .most_m = 8, .near_m = 5}};
                q.move.body = (struct corridor_body){0.4, 0.3, 0.1};
                geo_direction(az, el, q.move.direction);
                for (int i = 0; i < 3; i++) /* by a drift to the side and up it sweeps more */
                    q.move.drift_m[i] = up == 0 ? 0 : (i == 2 ? -0.2 : i == 1 ? 0.3 * cos(az) : -0.3 * sin(az));
                const struct verdict *v = give(&q);
                const struct corridor *c = verdict_corridor(v);
                const double *at = c->known_at, end_m = v->part[0].end_m;
                const double right[3] = {-sin(az), cos(az), 0},
                             above[3] = {-sin(el) * cos(az), -sin(el) * sin(az), -cos(el)};
                const double wide_m = 0.5 + (up == 0 ? 0 : 0.3), high_m = 0.3 + 0.5 + (up == 0 ? 0 : 0.3);
                CHECK(c->known_m < 8 && end_m >= c->known_m - 1e-9);
                CHECK_NEAR(geo_length(at), 1, 0, 1e-9);
                CHECK(geo_dot(at, q.move.direction) > 0);
                CHECK(fabs(geo_dot(at, right)) * end_m <= wide_m + 1e-9);
                CHECK(fabs(geo_dot(at, above)) * end_m <= high_m);
                CHECK(side * geo_dot(at, up == 2 ? right : above) > 0);
            }
    quat_from_rpy(0, 0, 0, now.pose.attitude);
}

TEST(a_larger_body_goes_no_farther)
{
    begin();
    for (int i = 0; i < BEAMS; i++)
        beam[i].free_to_m = (float)(2 + i % 7);
    send();
    look_on();
    for (int k = 0; k < 40; k++) {
        struct corridor_body body = {0.1, 0.1, 0};
        double before_m = INFINITY;
        for (int i = 0; i < 6; i++) {
            const struct corridor *c = way(&body, 2 * k - 40, 6, 1.5);
            CHECK(c->known_m - c->front_m <= before_m + 1e-9);
            before_m = c->known_m - c->front_m;
            body.radius_m += i % 3 == 0 ? 0.1 : 0;
            body.half_height_m += i % 3 == 1 ? 0.1 : 0;
            body.margin_m += i % 3 == 2 ? 0.1 : 0;
        }
    }
}

/* Where no sonar looks `near` is the operator's promise; where one does it must have looked. */
TEST(near_is_no_leave_to_go_where_a_sonar_has_not_looked)
{
    begin();
    send();
    CHECK_NEAR(way(&small, 180, 2, 3)->known_m, 2, 0, 1e-9);
    look_on();
    CHECK_NEAR(way(&small, 180, 2, 3)->known_m, 2, 0, 1e-9);
    CHECK_NEAR(way(&small, 0, 2, 3)->known_m, 2, 0, 1e-9);
    CHECK(way(&small, 0, 5, 3)->known_m == 5);
    CHECK(way(&small, 180, 5, 3)->known_m < 3.1 && way(&small, 180, 5, 3)->reason == ANSWER_NEVER);
    begin();
    for (int i = 15; i < 17; i++)
        beam[i].state = BEAM_BLIND, beam[i].free_to_m = 0;
    send();
    look_on();
    CHECK(way(&small, 0, 2, 3)->known_m < 0.1);
}

#define HEAD_STEP_DEG 1.8
#define ROPE_M        0.85 /* farther away something thicker than a rope of 2 cm fits into the gap of a lost ping */

/* A turn of a head ahead, whose beams overlap by a fifth of a degree, to the wall of a basin 2 m away; the compass is
 * 0.3 degrees off, one way and the other. */
static void turn_head(struct bearings *b, double lost_deg)
{
    const struct pose stays = now.pose;
    ping.n_beams = 1;
    ping.turns = true;
    ping.az_aperture_rad = (float)geo_rad(2);
    beam[0] = (struct beam_echoes){.blind_m = 0.75f, .free_to_m = 2, .n = 1, .echo = {{.range_m = 2}}};
    ping.seq += 100; /* it came from behind */
    for (int k = -50; k <= 50; k++) {
        beam[0].az_rad = (float)geo_wrap(geo_rad(HEAD_STEP_DEG * k));
        quat_from_rpy(0, 0, geo_rad(k % 2 ? 0.3 : -0.3), now.pose.attitude);
        ping.flags = k == -50 ? PING_NEW_TURN : 0;
        ping.seq++;
        ping.t_ns += TICK / 25;
        ping.pose = now.pose;
        ping.pose.t_ns = ping.t_ns;
        if (fabs(HEAD_STEP_DEG * k - lost_deg) < 0.1)
            continue;
        store_enter(store, &ping, &mount_identity);
        bearings_enter(b, &ping, &mount_identity);
    }
    now.pose = stays;
    tell_looks(b, 0);
}

/* Also in its first turn, be the bearings of its beams as uncertain as they may; where a ping was lost, another turn
 * has to show what is there. */
TEST(near_holds_where_a_head_has_looked)
{
    struct bearings b = {0};
    begin();
    turn_head(&b, 180);
    CHECK_NEAR(way(&small, 0, 1.9, 4)->known_m, 1.9, 0, 1e-9);
    for (double lost_deg = -18; lost_deg < 19; lost_deg += HEAD_STEP_DEG) {
        begin();
        b = (struct bearings){0};
        turn_head(&b, lost_deg);
        CHECK(way(&small, 0, 1.9, 4)->known_m < ROPE_M);
        turn_head(&b, lost_deg + 2 * HEAD_STEP_DEG);
        CHECK_NEAR(way(&small, 0, 1.9, 4)->known_m, 1.9, 0, 1e-9);
    }
}

/* What no beam showed may reach from the bottom to the surface: who dives, however steeply, comes no farther ahead than
 * on the level. Straight down nothing of it stands. */
TEST(near_is_no_leave_to_dive_past_what_nobody_has_looked_at)
{
    struct bearings b = {0};
    begin();
    looks_at(UINT64_MAX, 0, true);
    for (int down_deg = -85; down_deg < 86; down_deg += 5)
        CHECK(way_down(&small, 20, down_deg, 2.5, 3)->known_m < 0.1);
    CHECK_NEAR(way_down(&small, 20, 90, 2.5, 3)->known_m, 2.5, 0, 1e-9);
    begin();
    turn_head(&b, 180);
    for (int down_deg = -40; down_deg < 86; down_deg += 20)
        CHECK_NEAR(way_down(&small, 0, down_deg, 1.8, 3)->known_m, 1.8, 0, 1e-9);
    begin();
    send();
    look_on();
    now.pose.drift_mps = now.pose.drift_m[1] = 0.9; /* what stood beyond `near` may be 2.2 m ahead by now */
    for (int down_deg = 10; down_deg < 40; down_deg += 10)
        CHECK(way_down(&small, 0, down_deg, 3, 3)->known_m * cos(geo_rad(down_deg)) < 2.3);
    now.pose.drift_m[1] = 0;
    now.pose.drift_mps = 0;
}

/* A steep way goes no farther than a centimetre aside past what nobody has looked at: the steeper, the longer that
 * is. */
TEST(near_holds_as_long_as_a_dive_stays_in_its_place)
{
    static const double steep_deg[] = {89.9, 89.9999, 90, -89.9, -89.9999, -90};
    begin();
    looks_at(UINT64_MAX, 0, true);
    for (size_t i = 0; i < sizeof steep_deg / sizeof *steep_deg; i++)
        CHECK_NEAR(way_down(&small, 20, steep_deg[i], 2.5, 3)->known_m, 2.5, 0, 1e-9);
    for (double down_deg = 89.8; down_deg > 88.95; down_deg -= 0.1) {
        const double known_m = way_down(&small, 20, down_deg, 2.5, 3)->known_m,
                     least_m = fmin(0.9 * 0.01 / cos(geo_rad(down_deg)), 2.5);
        CHECK(known_m >= least_m && known_m * cos(geo_rad(down_deg)) < 0.01);
    }
}

static void go_ahead(double way_m)
{
    for (double left_m = way_m; left_m > 0; left_m -= POSE_STEP_MOST_M / 2) {
        now.pose.position_m[0] += fmin(left_m, POSE_STEP_MOST_M / 2);
        now.pose.path_m = now.pose.position_m[0];
        now.pose.t_ns = ping.t_ns;
        store_follow(store, &now.pose);
    }
}

/* What a beam heard before the vehicle came there: up to its echo and no farther. */
TEST(near_needs_no_look_from_elsewhere_unless_it_reached_there)
{
    static const struct {
        double way_m;
        bool known;
    } row[] = {{0, true}, {0.1, true}, {1.5, false}, {5, false}, {40, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings b = {0};
        begin();
        turn_head(&b, 180);
        go_ahead(row[i].way_m);
        turn_head(&b, 0);
        const double known_m = way(&small, 0, 1.9, 4)->known_m;
        CHECK(row[i].known ? known_m > 1.8 : known_m < ROPE_M);
    }
}

/* Where a head loses a ping, another look counts: not one that is too old, or from too far back, or of a sonar that is
 * offline. */
TEST(near_needs_a_look_that_counts)
{
    static const struct {
        double age_s, way_m, limit_m; /* of the other look; after the way a look is too far back */
        uint16_t sensor;              /* that looked */
        uint64_t lost;
        bool known;
    } row[] = {{28, 0, INFINITY, 0, 0, true},     {31, 0, INFINITY, 0, 0, false}, {400, 0, INFINITY, 0, 0, false},
               {5, 0.1, 0.2, 0, 0, true},         {5, 0.1, 0.05, 0, 0, false},    {5, 0, INFINITY, 1, 0, true},
               {5, 0, INFINITY, 1, 1 << 1, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings b = {0};
        begin();
        ping.sensor = row[i].sensor;
        ping.t_ns = NOW - (uint64_t)(row[i].age_s * 1e9);
        turn_head(&b, 180);
        go_ahead(row[i].way_m);
        by.move_limit_m = row[i].limit_m;
        ping.sensor = 0;
        ping.t_ns = NOW - SECOND;
        turn_head(&b, 0);
        now.lost = row[i].lost;
        const double known_m = way(&small, 0, 1.8, 4)->known_m;
        CHECK(row[i].known ? known_m == 1.8 : known_m < ROPE_M);
    }
    now.lost = 0;
}

static void begin_head(uint64_t age_ns)
{
    begin();
    ping.n_beams = 1;
    ping.turns = true;
    ping.az_aperture_rad = (float)geo_rad(2);
    ping.t_ns = NOW - age_ns;
    beam[0] = (struct beam_echoes){.blind_m = 0.75f, .free_to_m = 2, .n = 1, .echo = {{.range_m = 2}}};
}

/* At the ends of its sector a head that goes to and fro looks every other time. */
TEST(near_holds_for_a_head_that_goes_to_and_fro)
{
    enum { BEAMS_A_WAY = 50, WAY_S = 20, WAYS = 5 };
    struct bearings b = {0};
    begin_head(WAYS * WAY_S * SECOND + SECOND);
    by.clear_for_s = answer_clear_for_s(WAY_S, INFINITY);
    for (int i = 0; i < WAYS * BEAMS_A_WAY; i++) {
        const int along = i % BEAMS_A_WAY, k = i / BEAMS_A_WAY % 2 ? BEAMS_A_WAY - 1 - along : along;
        beam[0].az_rad = (float)geo_wrap(geo_rad(HEAD_STEP_DEG * (k - (BEAMS_A_WAY - 1) / 2.0)));
        ping.flags = along == 0 ? PING_NEW_TURN : 0;
        ping.t_ns += WAY_S * SECOND / BEAMS_A_WAY - TICK;
        send();
        bearings_enter(&b, &ping, &mount_identity);
        if (i < 3 * BEAMS_A_WAY || i % 7 != 0)
            continue;
        now.now_ns = ping.t_ns;
        tell_looks(&b, WAY_S);
        CHECK_NEAR(way(&small, 0, 1.8, 4)->known_m, 1.8, 0, 1e-9);
    }
    now.now_ns = NOW;
}

/* A look counts for 2.2 turns of its head, also where water is clear for less. */
TEST(near_holds_for_as_long_as_a_head_takes_to_turn)
{
    struct bearings b = {0};
    begin();
    ping.t_ns = NOW - 10 * SECOND;
    turn_head(&b, 180);
    by.clear_for_s = 5;
    for (double lost_s = 0; lost_s < 5; lost_s += 1) { /* behind */
        ping.t_ns = NOW - (uint64_t)((5 - lost_s) * 1e9);
        beam[0].az_rad = (float)geo_rad(170 + 2 * lost_s);
        send();
        bearings_enter(&b, &ping, &mount_identity);
    }
    tell_looks(&b, 5);
    CHECK_NEAR(way(&small, 0, 1.8, 4)->known_m, 1.8, 0, 1e-9);
    tell_looks(&b, 4);
    CHECK(way(&small, 0, 1.8, 4)->known_m < 0.1);
}

/* Another sonar's pings make water doubtful whose echoes may be forgotten; where a head has looked it has looked. */
TEST(near_holds_where_a_head_has_looked_before_a_fan_filled_the_store)
{
    struct bearings b = {0};
    struct mount aft = mount_identity;
    struct store_now at = {.now_ns = NOW, .pose = &now.pose, .clear_for_s = 30, .move_limit_m = INFINITY};
    static struct water_view view[ASK_RECORDS];
    int doubted = 0;
    begin();
    ping.sensor = 1;
    ping.t_ns = NOW - 12 * SECOND;
    turn_head(&b, 180);
    ping.sensor = 0;
    ping.n_beams = BEAMS;
    ping.turns = false;
    ping.az_aperture_rad = (float)geo_rad(3);
    ping.flags = 0;
    quat_from_rpy(0, 0, GEO_PI, aft.attitude);
    for (int k = 0; k < 220; k++) {
        for (int i = 0; i < BEAMS; i++)
            beam[i] = (struct beam_echoes){.az_rad = (float)geo_rad((i - (BEAMS - 1) / 2.0) * 3),
                                           .blind_m = 0.75f,
                                           .free_to_m = 5 + 0.3f * (float)((k + i) % 3),
                                           .n = 1,
                                           .echo = {{.range_m = 6}}};
        ping.seq++;
        ping.t_ns += SECOND / 20;
        ping.pose = now.pose;
        ping.pose.position_m[1] = 0.002 * (k % 40);
        ping.pose.t_ns = ping.t_ns;
        store_enter(store, &ping, &aft);
    }
    for (int i = store_view(store, &at, view); i-- > 0;)
        doubted += view[i].record->sensor == 1 && view[i].lost;
    CHECK(doubted > 10);
    CHECK_NEAR(way(&small, 0, 1.8, 4)->known_m, 1.8, 0, 1e-9);
}

/* ---- why, and from where on ---- */

/* A record of sonar 1: one beam ahead, free between the two ranges, so long ago. */
static void send_other(double blind_m, double free_to_m, double age_s)
{
    const struct echoes fan = ping;
    const struct beam_echoes first = beam[0];
    ping.sensor = 1;
    ping.n_beams = 1;
    ping.t_ns = NOW - (uint64_t)(age_s * 1e9) - TICK;
    ping.az_aperture_rad = (float)geo_rad(60);
    beam[0] = (struct beam_echoes){.blind_m = (float)blind_m, .free_to_m = (float)free_to_m};
    send();
    beam[0] = first;
    ping = fan;
    ping.seq += 10;
}

static void send_fan(double blind_m, double free_to_m)
{
    for (int i = 0; i < BEAMS; i++) {
        beam[i].blind_m = (float)blind_m;
        beam[i].free_to_m = (float)free_to_m;
        beam[i].n = free_to_m < 10;
    }
    send();
}

/* Water that begins a little beyond the distance is told, for that is what a larger `near` would need; none farther. */
TEST(water_that_begins_late_is_told_up_to_near_beyond_the_distance)
{
    for (double blind_m = 1.7; blind_m < 6; blind_m += 0.4)
        for (double to_m = 1; to_m < 4; to_m += 1)
            for (size_t i = 0; i < sizeof asks / sizeof *asks; i++) {
                begin();
                send_fan(blind_m, 10);
                const struct answer *a = asks[i](to_m, 1.5);
                CHECK_INT(a->state, ANSWER_UNKNOWN);
                if (asks[i] == corridor ? blind_m > to_m + 1.5 : fabs(blind_m - to_m - 1.5) > 0.4)
                    CHECK((a->free_to_m > 0) == (blind_m < to_m + 1.5));
                CHECK(a->free_to_m <= 0 || (a->blind_to_m >= blind_m && a->blind_to_m <= to_m + 1.5));
                CHECK(a->free_to_m <= 0 || asks[i] == corridor || a->blind_to_m < 1.15 * blind_m + 0.1);
            }
}

/* What ends nearer than the bottom is not ended by that. */
TEST(the_nearest_end_is_the_reason)
{
    begin();
    send_fan(0.75, 2);
    now.pose.has |= POSE_ALTITUDE;
    now.pose.altitude_m = 1.2; /* of a cone of 2.5 degrees from 4.9 m on */
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++)
        CHECK_INT(asks[i](8, 1.5)->reason, ANSWER_BEYOND);
    begin();
    send_fan(0.75, 10);
    now.pose.has |= POSE_ALTITUDE;
    for (size_t i = 0; i < sizeof asks / sizeof *asks; i++)
        CHECK_INT(asks[i](8, 1.5)->reason, ANSWER_BOTTOM);
    now.pose.has &= ~(unsigned)POSE_ALTITUDE;
}

/* By what the water would go on: the sonar's own state and time, and the way since its ping, with what is uncertain of
 * that. */
TEST(why_water_goes_on_no_more_is_told_of_the_record_that_has_it)
{
    static const struct {
        double age_s, way_m, uncertain_m;
        uint64_t lost;
        enum answer_reason why;
    } row[] = {{5, 0, 0, 1 << 1, ANSWER_SILENT}, {5, 0, 0, 1 << 2, ANSWER_HEARD}, {5, 0, 0, 0, ANSWER_HEARD},
               {31, 0, 0, 0, ANSWER_STALE},      {5, 0.1, 0, 0, ANSWER_HEARD},    {5, 0.25, 0, 0, ANSWER_MOVED},
               {5, 0.15, 0.1, 0, ANSWER_MOVED}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        begin();
        now.pose.path_m = now.pose.position_m[0] = 100;
        send_other(0.75, 10, row[i].age_s);
        go_ahead(row[i].way_m);
        now.pose.uncertain_m = row[i].uncertain_m;
        by.move_limit_m = 0.2;
        now.lost = row[i].lost;
        const struct answer *a = cone(5, 1.5);
        CHECK_INT(a->state, row[i].why == ANSWER_HEARD ? ANSWER_CLEAR : ANSWER_UNKNOWN);
        CHECK_INT(a->reason, row[i].why);
        CHECK_NEAR(a->age_s, row[i].age_s, 0, 1e-6);
    }
    now.lost = 0;
}

/* Of a body's way. Water that begins within four times `near` begins too late; what ends beyond `near` has ended. */
TEST(a_body_is_told_of_water_that_begins_too_late)
{
    static const struct {
        double blind_m, free_m, other_m; /* from where on another sonar has more; 0: none does */
        uint64_t lost;
        enum answer_reason why;
    } row[] = {{0.75, 1, 0, 0, ANSWER_BEYOND}, {0.75, 3, 4, 0, ANSWER_BEYOND}, {1.8, 10, 0, 0, ANSWER_BLIND},
               {5, 10, 0, 0, ANSWER_BLIND},    {7, 10, 0, 0, ANSWER_BEYOND},   {0.75, 10, 2, 1, ANSWER_SILENT}};
    for (size_t i = 0; i < sizeof row / sizeof *row; i++) {
        begin();
        if (row[i].other_m > 0)
            send_other(row[i].other_m, 10, 2);
        send_fan(row[i].blind_m, row[i].free_m);
        now.lost = row[i].lost;
        const struct corridor *c = way(&small, 0, 9, 1.5);
        CHECK(c->known_m < 3.1);
        CHECK_INT(c->reason, row[i].why);
    }
    now.lost = 0;
}

/* A head of long steps leaves gaps between its own beams; those of another one are lost pings all the same. */
TEST(near_covers_no_lost_ping_of_a_head_beside_a_coarser_one)
{
    struct bearings b = {0};
    begin();
    ping.sensor = 1;
    ping.n_beams = 1;
    ping.turns = true;
    ping.az_aperture_rad = (float)geo_rad(2);
    beam[0] = (struct beam_echoes){.blind_m = 0.75f, .free_to_m = 2, .n = 1, .echo = {{.range_m = 2}}};
    for (int k = 0; k <= 6; k++) {
        beam[0].az_rad = (float)geo_rad(120 + 20 * k);
        send();
        bearings_enter(&b, &ping, &mount_identity);
    }
    ping.sensor = 0;
    turn_head(&b, 0);
    CHECK(way(&small, 0, 1.9, 4)->known_m < ROPE_M);
}

/* A turn brings new water into the fan's sight, of which it has yet to show what is there. */
TEST(near_covers_no_water_that_a_turn_brings_into_a_still_beam)
{
    begin();
    send();
    look_on();
    CHECK_NEAR(way(&small, 0, 5, 3)->known_m, 5, 0, 1e-9);
    quat_from_rpy(0, 0, geo_rad(-60), now.pose.attitude);
    CHECK(way(&small, 0, 2, 3)->known_m < 0.1);
    send();
    CHECK_NEAR(way(&small, 0, 5, 3)->known_m, 5, 0, 1e-9);
}

/* Water that begins beyond `near`, or that is too old. */
/* What a beam showed it has shown, however far the vehicle may have sunk since: what stood beyond `near` then reaches
 * through the beam's height, and has come nearer by the drift at the most. */
TEST(near_holds_less_the_drift_for_who_has_sunk)
{
    begin();
    send();
    look_on();
    now.pose.drift_mps = 1;
    now.pose.drift_m[1] = 0.9;
    CHECK_NEAR(way(&small, 0, 1, 3)->known_m, 1, 0, 1e-9);
    CHECK(way(&small, 0, 4, 3)->known_m < 3 - 0.9 + 0.3);
    now.pose.drift_m[1] = now.pose.drift_mps = 0;
}

/* What stands where has to be of one picture with the grid's centre and axes: the next one may have others. */
TEST(what_may_have_come_is_told_by_the_picture_of_the_beginning)
{
    struct obstacles_query q = {.moves = true, .move = {.body = small, .most_m = 2, .near_m = 4}};
    static struct verdict v;
    double come_m[2];
    for (int later = 0; later < 2; later++) {
        begin();
        looks_at(UINT64_MAX, 0, false);
        now.pose.drift_mps = 0.5;
        q.move.direction[0] = 1;
        put(3.5, 4);
        store_list(store, &list);
        const struct verdict_evidence evidence = {&picture, store, &list, &by, &now};
        bool more = verdict_begin(&v, &evidence, &q, OWN_M);
        if (later) {
            const struct picture_entry nothing = {0};
            picture_begin(&picture);
            picture_set(&picture, rings_index(&rings, 0.01, 0.01), &nothing);
            picture_end(&picture);
        }
        while (more)
            more = verdict_step(&v);
        come_m[later] = v.horizon.promise.come_m[0];
    }
    now.pose.drift_mps = 0;
    CHECK(come_m[0] < 4);
    CHECK_NEAR(come_m[1], come_m[0], 0, 1e-9);
}

TEST(a_body_is_told_why_it_goes_no_farther)
{
    static const struct corridor_body thin = {0.05, 0.05, 0};
    begin();
    send();
    CHECK_INT(way(&thin, 0, 5, OWN_M)->reason, ANSWER_BLIND);
    CHECK(way(&thin, 0, 5, OWN_M)->known_m <= 0.75);
    by.clear_for_s = 0.5;
    CHECK_INT(way(&small, 0, 5, 1.5)->reason, ANSWER_STALE);
    by.clear_for_s = 30;
    now.lost = 1;
    CHECK_INT(way(&small, 0, 5, 1.5)->reason, ANSWER_SILENT);
    now.lost = 0;
    now.pose_fresh = false;
    CHECK(way(&small, 0, 5, 1.5)->reason == ANSWER_POSE_LOST && way(&small, 0, 5, 1.5)->known_m <= 0);
    CHECK_NEAR(way(&small, 0, 5, 1.5)->front_m, 0.4, 0, 1e-9);
    now.pose_fresh = true;
}

/* The bottom ends a dive, also where near promises water, and where nobody has looked. */
TEST(a_body_does_not_sink_into_the_bottom)
{
    begin();
    now.pose.has |= POSE_ALTITUDE;
    now.pose.altitude_m = 1.2;
    send();
    struct obstacles_query dive = {
        .moves = true, .move = {.body = small, .direction = {0, 0, 1}, .ned = true, .most_m = 1.6, .near_m = 2}};
    static struct verdict v;
    store_list(store, &list);
    const struct verdict_evidence evidence = {&picture, store, &list, &by, &now};
    for (bool more = verdict_begin(&v, &evidence, &dive, OWN_M); more;)
        more = verdict_step(&v);
    CHECK_INT(v.corridor.reason, ANSWER_BOTTOM);
    CHECK(v.corridor.known_m > 0.8 && v.corridor.known_m <= 1.2);
    CHECK_NEAR(v.corridor.front_m, 0.3, 0, 1e-9);
    CHECK_INT(way(&small, 0, 2, 2)->reason, ANSWER_HEARD);
    now.pose.altitude_m = 0.3; /* the body stands in it */
    CHECK(way(&small, 0, 2, 2)->reason == ANSWER_BOTTOM && way(&small, 0, 2, 2)->known_m < 0.1);
    now.pose.has &= ~(unsigned)POSE_ALTITUDE;
}

int main(void)
{
    RUN(clear_to_a_distance_is_clear_to_every_shorter_one);
    RUN(clear_to_a_cone_is_clear_to_a_narrower_one);
    RUN(water_before_an_obstacle_is_told_whatever_is_free_behind_it);
    RUN(of_many_pieces_within_near_the_farthest_counts);
    RUN(water_within_near_goes_on_in_another_beam);
    RUN(what_is_next_to_the_vehicle_must_be_observed_or_promised);
    RUN(near_holds_up_to_what_is_observed);
    RUN(water_is_told_from_where_it_was_observed);
    RUN(nothing_is_promised_where_nobody_looked);
    RUN(blocked_is_an_obstacle_within_the_distance);
    RUN(an_echo_within_near_that_is_too_little_to_block_bars_the_water);
    RUN(each_reason_is_told);
    RUN(what_was_shown_beside_may_have_come_ahead);
    RUN(a_question_is_asked_in_its_own_axes);
    RUN(without_an_attitude_questions_are_asked_in_the_axes_of_the_body);
    RUN(each_sector_is_told_of_its_own_water);
    RUN(a_sector_that_begins_late_is_asked_where_it_is);
    RUN(the_water_ends_in_a_direction_that_was_asked);
    RUN(the_bottom_is_met_by_the_lowest_direction_of_a_cone);
    RUN(no_question_goes_through_the_bottom_and_none_ends_above_it);
    RUN(the_bottom_that_reaches_into_a_corridors_side_ends_it);
    RUN(near_holds_no_farther_than_to_what_may_have_come_into_any_of_it);
    RUN(near_holds_where_a_fan_off_the_middle_has_looked);
    RUN(a_body_goes_where_water_is_observed);
    RUN(a_direction_is_one_however_long);
    RUN(a_way_is_told_to_end_in_a_place_of_the_body);
    RUN(a_larger_body_goes_no_farther);
    RUN(near_is_no_leave_to_go_where_a_sonar_has_not_looked);
    RUN(near_holds_where_a_head_has_looked);
    RUN(near_is_no_leave_to_dive_past_what_nobody_has_looked_at);
    RUN(near_needs_no_look_from_elsewhere_unless_it_reached_there);
    RUN(near_needs_a_look_that_counts);
    RUN(near_holds_as_long_as_a_dive_stays_in_its_place);
    RUN(near_holds_for_a_head_that_goes_to_and_fro);
    RUN(near_holds_for_as_long_as_a_head_takes_to_turn);
    RUN(near_holds_where_a_head_has_looked_before_a_fan_filled_the_store);
    RUN(water_that_begins_late_is_told_up_to_near_beyond_the_distance);
    RUN(the_nearest_end_is_the_reason);
    RUN(why_water_goes_on_no_more_is_told_of_the_record_that_has_it);
    RUN(a_body_is_told_of_water_that_begins_too_late);
    RUN(near_covers_no_lost_ping_of_a_head_beside_a_coarser_one);
    RUN(near_covers_no_water_that_a_turn_brings_into_a_still_beam);
    RUN(near_holds_less_the_drift_for_who_has_sunk);
    RUN(what_may_have_come_is_told_by_the_picture_of_the_beginning);
    RUN(a_body_is_told_why_it_goes_no_farther);
    RUN(a_body_does_not_sink_into_the_bottom);
    return test_end();
}
