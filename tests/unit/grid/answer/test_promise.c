/* SPDX-License-Identifier: MIT */
/* test_promise - up to where `near` holds, by what the sonars look at and what was seen at a part of the horizon. */
#include "tests/lib/looks_rig.h"

#include "grid/answer/promise.h"
#include "grid/ping.h"

static void start(void)
{
    start_with(rings_full(&rings, geo_rad(3)), true);
}

static const struct promise_look unseen, seen_all = {.goes_on = true, .looked_m = 99};

static struct promise_look seen_to(double sure_m)
{
    return (struct promise_look){.sure_m = sure_m, .looked_m = 99};
}

/* clear_for_s: 0: as usual. */
static double promised_within(double clear_for_s, double az_deg, struct promise_look look, double near_m)
{
    struct picture_frame frame;
    struct sight_place place;
    struct answer_conf conf = limits;
    conf.clear_for_s = clear_for_s > 0 ? clear_for_s : conf.clear_for_s;
    picture_get_frame(&picture, &frame);
    sight_locate(&frame, &conf, &now, &place);
    struct promise p = promise_begin(&picture, &conf, &frame, &now, &place);
    return promise_m(&p, geo_rad(az_deg), &look, near_m);
}

static double promised(double az_deg, struct promise_look look, double near_m)
{
    return promised_within(0, az_deg, look, near_m);
}

TEST(near_is_no_leave_where_a_sonar_looks_and_has_not_looked)
{
    static const uint64_t ahead = UINT64_C(0xff000000000000ff);
    static const struct {
        double az_deg;
        uint64_t bearings;
        bool known;
    } row[] = {{0, ahead, false},
               {30, ahead, false},
               {30, 0, true}, /* no sonar looks there: as promised */
               {30, ~ahead, true},
               {-30, UINT64_MAX, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start();
        looks_at(row[i].bearings, 0, false);
        CHECK_NEAR(promised(row[i].az_deg, unseen, 3), row[i].known ? 3 : 0, 0, 1e-9);
        CHECK_NEAR(promised(row[i].az_deg, seen_all, 3), 3, 0, 1e-9);
    }
}

/* A level beam of a head; it hears nothing usable, or open water. */
static void look_once(struct bearings *b, unsigned sensor, double az_deg, double high_deg, bool deaf)
{
    struct beam_echoes beam = {.az_rad = (float)geo_rad(az_deg), .state = deaf ? BEAM_BLIND : BEAM_SILENT};
    const struct echoes e = {.t_ns = NOW,
                             .sensor = (uint16_t)sensor,
                             .n_beams = 1,
                             .turns = true,
                             .flags = az_deg == 0 ? PING_NEW_TURN : 0,
                             .az_aperture_rad = (float)geo_rad(3),
                             .el_aperture_rad = (float)geo_rad(high_deg),
                             .beam = &beam};
    beam.heard_to_m = beam.free_to_m = deaf ? 0 : 10;
    bearings_enter(b, &e, &mount_identity);
}

/* A head 25 degrees high goes round and hears nothing ahead, where a flat one does not look: with the vehicle tilted
 * that hears at no level bearing, and the other does as before. */
TEST(a_flat_head_takes_no_bearing_from_a_higher_one)
{
    for (int heads = 1; heads <= 2; heads++)
        for (double pitch_deg = 0; pitch_deg <= 12; pitch_deg += 2) {
            struct bearings b = {0};
            start();
            for (int k = 0; k < 3 * 120; k++) {
                const int deg = 3 * k % 360;
                look_once(&b, 0, deg, 25, deg < 90 || deg > 270);
                if (heads > 1)
                    look_once(&b, 1, 180 + deg / 6.0 - 30, 10.4, false);
            }
            tell_looks(&b, 6);
            quat_from_rpy(0, geo_rad(pitch_deg), 0, now.pose.attitude);
            CHECK_NEAR(promised(0, unseen, 3), pitch_deg > 12.5 - 3 ? 3 : 0, 0, 1e-9);
        }
}

/* What stood beyond near when a beam showed water has come nearer by the drift since. A deaf ping shows none. */
TEST(near_shrinks_as_a_vehicle_drifts)
{
    static const struct {
        double age_s;
        bool showed, turned;
        double known_m;
    } row[] = {{0, true, false, 3},  {9, true, false, 2.1}, {20, true, false, 1},
               {40, true, false, 0}, {0, false, false, 0},  {0, true, true, 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start();
        looks_at(UINT64_MAX, 0, false);
        now.pose.drift_mps = 0.1;
        now.pose.heading_adrift = row[i].turned;
        const struct promise_look look = {.showed = row[i].showed, .age_s = row[i].age_s, .looked_m = 99};
        CHECK_NEAR(promised(0, look, 3), row[i].known_m, 0, 1e-6);
    }
    now.pose.drift_mps = 0;
    now.pose.heading_adrift = false;
}

/*
 * Of a post 3 m away a beam showed water ahead right before, and now nothing of it is free there by the beams. A
 * vehicle that has drifted past the post has it ahead; not if all has been looked at since, or nobody looks there.
 */
TEST(what_was_shown_beside_may_have_come_ahead)
{
    static const struct {
        double az_deg, age_s, turn_s;
        uint64_t bearings;
        double known_m;
        double swept_deg; /* a head that went round before has looked no farther than this to each side for 12 s */
    } row[] = {{40, 4, 4, UINT64_MAX, 1.22, 0},      {-40, 4, 4, UINT64_MAX, 1.22, 0},
               {40, 1, 4, UINT64_MAX, 4, 0},         {90, 4, 4, UINT64_MAX, 4, 0},
               {90, 8, 4, UINT64_MAX, 0, 0},         {150, 8, 4, UINT64_MAX, 0, 0},
               {90, 8, 3, UINT64_MAX, 4, 0},         {90, 8, 3, UINT64_MAX, 0, 60},
               {90, 8, 4, 0xff000000000000ff, 4, 0}, {40, 4, 0, 0xff000000000000ff, 4, 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct picture_frame frame;
        struct picture_entry e = {0};
        start();
        looks_at(row[i].bearings, 0, false);
        picture_get_frame(&picture, &frame);
        frame.turn_s = row[i].turn_s;
        for (int k = 0; k < BEARINGS && row[i].swept_deg > 0; k++)
            if (fabs(geo_wrap_pi((k + 0.5) * GEO_TURN / BEARINGS)) > geo_rad(row[i].swept_deg))
                frame.looks.heard_ds[0][k] = 120;
        for (int k = 1; k < BEARINGS_SENSORS; k++)
            memset(frame.looks.heard_ds[k], 0xff, sizeof frame.looks.heard_ds[k]);
        now.pose.drift_mps = 0.5;
        const uint64_t t_ns = NOW - (uint64_t)(row[i].age_s * 1e9);
        e.obstacle[0] = (struct picture_obstacle){
            .t_ref_ns = t_ns, .t_echo_ns = t_ns, .logodds = 4, .near_m = 3, .range_m = 3, .sd_m = 0.05f};
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_set(&picture, rings_index(&rings, geo_rad(row[i].az_deg), geo_rad(1)), &e);
        picture_end(&picture);
        CHECK_NEAR(promised(0, (struct promise_look){.showed = true, .looked_m = 99}, 4), row[i].known_m, 0, 0.15);
    }
    now.pose.drift_mps = 0;
}

/* A head off the middle that sweeps to both sides of the bow: where along a bearing it looks. */
TEST(near_counts_where_a_head_looks)
{
    static const struct {
        double ahead_m, az_deg, yaw_deg, range_m;
        bool looks, passes; /* there; anywhere up to 3 m */
    } row[] = {{0.5, 0, 0, 0.45, false, true},   {0.5, 0, 0, 0.55, true, true},  {0.5, 60, 0, 0.7, false, true},
               {0.5, 60, 0, 1.4, true, true},    {0.5, 180, 0, 3, false, false}, {0.5, 180, 180, 0.55, true, true},
               {-0.5, 110, 0, 0.5, true, true},  {-0.5, 110, 0, 3, false, true}, {-0.5, 180, 0, 0.3, true, true},
               {-0.5, 180, 0, 0.6, false, true}, {0, 60, 0, 0.3, true, true},    {0, 110, 0, 0.3, false, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct picture_frame frame;
        struct sight_place place;
        start();
        looks_at(UINT64_C(0xffff) | UINT64_C(0xffff) << 48, 0, false);
        picture_get_frame(&picture, &frame);
        frame.looks.place_m[0][0] = row[i].ahead_m;
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_end(&picture);
        quat_from_rpy(0, 0, geo_rad(row[i].yaw_deg), now.pose.attitude);
        sight_locate(&frame, &limits, &now, &place);
        struct promise p = promise_begin(&picture, &limits, &frame, &now, &place);
        CHECK(promise_looks(&p, geo_rad(row[i].az_deg), row[i].range_m) == row[i].looks);
        CHECK(promise_passes(&p, geo_rad(row[i].az_deg), 3) == row[i].passes);
        const double most_m = promised(row[i].az_deg, (struct promise_look){.goes_on = true, .looked_m = 1}, 3);
        CHECK_NEAR(most_m, row[i].passes ? 1 : 3, 0, 1e-9);
    }
    quat_from_rpy(0, 0, 0, now.pose.attitude);
}

/* A lost ping leaves a piece of a direction's water, or none of it; in whatever turn. */
TEST(near_covers_no_lost_ping)
{
    static const struct {
        struct promise_look look;
        double known_m;
    } row[] = {{{.sure_m = 1.5, .looked_m = 9}, 3},
               {{.looked_m = 9}, 3},
               {{.sure_m = 3, .looked_m = 1.5}, 1.5},
               {{.sure_m = 1.5}, 0},
               {{.looked_m = 1.5}, 1.5},
               {{.goes_on = true, .looked_m = 1}, 1}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        for (int first_turns = 0; first_turns < 2; first_turns++) {
            start();
            looks_at(UINT64_MAX, 0, first_turns);
            CHECK_NEAR(promised(0, row[i].look, 3), row[i].known_m, 0, 1e-9);
        }
}

/* Nor of a vehicle that drifts, whatever water goes on behind. */
TEST(near_covers_no_lost_ping_adrift)
{
    static const struct promise_look row[] = {{.goes_on = true, .looked_m = 1}, {.showed = true, .looked_m = 1}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start();
        looks_at(UINT64_MAX, 0, false);
        now.pose.drift_mps = 0.1;
        CHECK_NEAR(promised(0, row[i], 3), 1, 0, 1e-9);
    }
    now.pose.drift_mps = 0;
}

/* Nor where a head is still to look, and beams from elsewhere saw the water behind. */
TEST(near_ends_before_what_nobody_looked_at_where_a_head_has_yet_to_look)
{
    struct picture_frame frame;
    start();
    looks_at(UINT64_MAX, 0, true);
    picture_get_frame(&picture, &frame);
    frame.looks.hears[0] = 0;
    picture_begin(&picture);
    picture_set_frame(&picture, &frame);
    picture_end(&picture);
    CHECK_NEAR(promised(0, (struct promise_look){.goes_on = true, .looked_m = 1}, 3), 1, 0, 1e-9);
    CHECK_NEAR(promised(0, (struct promise_look){.goes_on = true, .looked_m = 9}, 3), 3, 0, 1e-9);
    CHECK_NEAR(promised(0, (struct promise_look){.looked_m = 9}, 3), 0, 0, 1e-9);
}

/*
 * In a beam that does not turn nothing is promised: of a direction 13.5 degrees to the side, which it has just come to
 * look at, it has shown 1.5 m, or nothing. Up to 4.5 degrees from its edge no direction lies wholly in it.
 */
TEST(near_covers_no_water_in_a_beam_that_stays)
{
    static const struct {
        double bearing_deg, wide_deg, second_deg;
        uint64_t bearings;        /* at which a head, too, has looked twice */
        double axes_deg, yaw_deg; /* of the grid; of the body, since */
        double to_m;              /* free; 0: 1.5 m */
        bool blank, known;
    } row[] = {{.wide_deg = 40},
               {.wide_deg = 40, .blank = true},
               {.wide_deg = 40, .to_m = 3.5, .known = true},
               {.wide_deg = 40, .axes_deg = 30},
               {.wide_deg = 100},
               {.wide_deg = 360, .blank = true},
               {.wide_deg = 34, .known = true}, /* its edge */
               {.wide_deg = 20, .known = true}, /* beside it, as promised */
               {.wide_deg = 20, .blank = true, .known = true},
               {.wide_deg = 20, .yaw_deg = 9, .blank = true}, /* the vehicle has turned there */
               {.wide_deg = 40, .yaw_deg = -9, .blank = true, .known = true},
               {.bearing_deg = 13.5, .wide_deg = 5, .blank = true}, /* too narrow to free any */
               {.bearing_deg = -45, .wide_deg = 30, .second_deg = 20, .blank = true},
               {.bearing_deg = -45, .wide_deg = 30, .second_deg = 45, .blank = true, .known = true},
               {.wide_deg = 40, .bearings = UINT64_MAX, .known = true},
               {.wide_deg = 40, .bearings = UINT64_MAX, .blank = true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct picture_frame frame;
        start();
        looks_at(row[i].bearings, 0, false);
        picture_get_frame(&picture, &frame);
        frame.axes_rad = geo_rad(row[i].axes_deg);
        open_still(&frame.looks, row[i].bearing_deg, row[i].wide_deg);
        if (row[i].second_deg > 0)
            open_still(&frame.looks, row[i].second_deg, row[i].wide_deg);
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_end(&picture);
        quat_from_rpy(0, 0, geo_rad(row[i].yaw_deg), now.pose.attitude);
        const struct promise_look look = row[i].blank ? unseen : row[i].to_m > 3 ? seen_all : seen_to(1.5);
        const double most_m = promised(13.5 - row[i].axes_deg, look, 3);
        CHECK_NEAR(most_m, row[i].known ? 3 : row[i].blank ? 0 : 1.5, 0, 1e-9);
    }
}

/*
 * While the vehicle drifts, what stood beside such a beam may have come in, the farther in the nearer: there near holds
 * as beside it. 13.5 degrees to the side are 11.6, 26.4 or 0 from the edge, and so many times the drift is sin(that).
 */
TEST(near_holds_in_a_still_beam_as_far_as_drift_has_brought_its_edge)
{
    static const struct {
        double wide_deg, age_s;
        float to_m; /* as of the last ping; -1: it showed water, of which the vehicle may have drifted out */
        double known_m;
    } row[] = {{60, 2, -1, 0.99}, {60, 4, -1, 1.99}, {60, 2, 1.5f, 1.5}, {60, 4, 1.5f, 1.99}, {60, 0, -1, 0},
               {90, 4, -1, 0.9},  {90, 4, 0, 0},     {34, 2, -1, 2},     {360, 4, -1, 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct picture_frame frame;
        start();
        looks_at(0, 0, false);
        picture_get_frame(&picture, &frame);
        open_still(&frame.looks, 0, row[i].wide_deg);
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_end(&picture);
        now.pose.drift_mps = 0.1;
        const struct promise_look look = {.showed = row[i].to_m != 0,
                                          .sure_m = fmax(0, (double)row[i].to_m),
                                          .age_s = row[i].age_s,
                                          .looked_m = 99};
        CHECK_NEAR(fmin(promised(13.5, look, 3), 2), row[i].known_m, 0, 0.08);
    }
    now.pose.drift_mps = 0;
}

/* But not where a head looks: it has to have looked there. */
TEST(near_holds_at_no_edge_of_a_still_beam_where_a_head_has_yet_to_look)
{
    for (int head = 0; head < 2; head++) {
        struct picture_frame frame;
        start();
        looks_at(head ? UINT64_MAX : 0, 0, false);
        picture_get_frame(&picture, &frame);
        open_still(&frame.looks, 0, 60);
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_end(&picture);
        now.pose.drift_mps = 0.1;
        const struct promise_look look = {.showed = true, .goes_on = true, .age_s = 4, .looked_m = 0.5};
        CHECK_NEAR(promised(13.5, look, 3), head ? 0.5 : 1.99, 0, 0.08);
    }
    now.pose.drift_mps = 0;
}

/* The same where the last ping lies uncertainly, though it showed no water there; how long ago is not asked here. */
TEST(near_holds_in_a_still_beam_as_far_as_its_edge_is_uncertain)
{
    static const struct {
        double wide_deg, loose_m, loose_deg, known_m;
    } row[] = {{60, 0.2, 0, 0.99}, {60, 0.2, 6, 1.93}, {60, 0.2, 12, 3},
               {60, 0, 12, 0},     {90, 0.2, 0, 0.45}, {90, 0.2, 12, 0.80}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct picture_frame frame;
        start();
        looks_at(0, 0, false);
        picture_get_frame(&picture, &frame);
        open_still(&frame.looks, 0, row[i].wide_deg);
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_end(&picture);
        const struct promise_look look = {.loose_m = row[i].loose_m, .loose_rad = geo_rad(row[i].loose_deg)};
        CHECK_NEAR(promised(13.5, look, 3), row[i].known_m, 0, 0.08);
    }
}

/* A level direction that the fan has not freed, in that bearing: does near cover it? */
static bool near_covers(double az_deg, double roll_deg, double pitch_deg)
{
    quat_from_rpy(geo_rad(roll_deg), geo_rad(pitch_deg), 0, now.pose.attitude);
    const double most_m = promised(az_deg, unseen, 2);
    CHECK(most_m == 2 || most_m == 0);
    return most_m == 2;
}

/* However the mount or the vehicle tilts the fan, and however low its beams are. */
TEST(near_covers_no_place_at_which_a_still_fan_looks)
{
    static const struct {
        struct still_fan fan;
        double roll_deg, pitch_deg; /* of the vehicle */
        double az_deg;
        bool covered;
    } row[] = {{.fan = {.wide_deg = 120, .high_deg = 20}, .az_deg = 40},
               {.fan = {.wide_deg = 120, .high_deg = 20}, .az_deg = 75, .covered = true},
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = 9}, .az_deg = 0},
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = 20}, .az_deg = 0},
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = 20}, .az_deg = 12},
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = 20}, .az_deg = -12},
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = 20},
                .az_deg = 45,
                .covered = true}, /* it passes below */
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = -45}, .az_deg = 0},
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = 90}, .az_deg = 0},
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = 90}, .az_deg = 20, .covered = true},
               {.fan = {.wide_deg = 120, .high_deg = 8}, .az_deg = 30},
               {.fan = {.wide_deg = 120, .high_deg = 4}, .az_deg = 30},
               {.fan = {.wide_deg = 120, .high_deg = 1.5}, .az_deg = 30},
               {.fan = {.wide_deg = 120, .high_deg = 20, .pitch_deg = -30}, .az_deg = 0, .covered = true},
               {.fan = {.wide_deg = 120, .high_deg = 20, .pitch_deg = -30},
                .pitch_deg = 30,
                .az_deg = 0}, /* and the vehicle levels it */
               {.fan = {.wide_deg = 120, .high_deg = 20, .pitch_deg = -30}, .pitch_deg = 26, .az_deg = 0},
               {.fan = {.wide_deg = 120, .high_deg = 20}, .pitch_deg = 20, .az_deg = 0, .covered = true},
               {.fan = {.wide_deg = 120, .high_deg = 20}, .pitch_deg = 20, .az_deg = 58, .covered = true},
               {.fan = {.wide_deg = 120, .high_deg = 40}, .pitch_deg = 12, .az_deg = 0},
               {.fan = {.wide_deg = 120, .high_deg = 20}, .roll_deg = 20, .az_deg = 0},
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = 20}, .roll_deg = -20, .az_deg = 50}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings b = {0};
        start();
        look_with(&b, &row[i].fan);
        CHECK_INT(near_covers(row[i].az_deg, row[i].roll_deg, row[i].pitch_deg), row[i].covered);
    }
}

/* Its edges are angles at the sonar. Within near a place lies elsewhere as seen from the vehicle's middle. */
TEST(near_covers_no_place_at_which_a_fan_off_the_middle_looks)
{
    static const struct {
        struct still_fan fan;
        double az_deg;
        bool covered;
    } row[] = {
        {.fan = {.wide_deg = 60, .high_deg = 20}, .az_deg = 35, .covered = true},
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {-0.6, 0, 0}}, .az_deg = 31}, /* 24 degrees at 2 m */
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {-0.6, 0, 0}}, .az_deg = 60}, /* 21 at 0.25 m */
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0.4, 0, 0}}, .az_deg = 35, .covered = true},
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, 0.4, 0}}, .az_deg = 33}, /* 25 degrees */
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, 0.4, 0}}, .az_deg = -36, .covered = true},
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, -0.4, 0}}, .az_deg = -33},
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, 0, 0.4}},
         .az_deg = 20}}; /* of what stands there it sees the foot */
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings b = {0};
        start();
        look_with(&b, &row[i].fan);
        CHECK_INT(near_covers(row[i].az_deg, 0, 0), row[i].covered);
    }
}

/* The latest ping says where the sonar is. */
TEST(near_follows_a_still_fan_to_another_mount)
{
    static const struct still_fan before = {.wide_deg = 40, .high_deg = 20, .pitch_deg = -40},
                                  after = {.wide_deg = 40, .high_deg = 20},
                                  aside = {.wide_deg = 40, .high_deg = 20, .mount_m = {0, 0.5, 0}};
    struct bearings b = {0};
    start();
    look_with(&b, &before);
    CHECK(near_covers(0, 0, 0));
    look_with(&b, &after);
    CHECK(!near_covers(0, 0, 0) && near_covers(24, 0, 0));
    look_with(&b, &aside);
    CHECK(!near_covers(24, 0, 0));
    look_with(&b, &before);
    CHECK(near_covers(0, 0, 0) && near_covers(24, 0, 0));
}

#define FAN UINT64_C(0xff800000000001ff) /* 100 degrees about the bow */

/* What a head that is offline, or deaf there, has not shown it will not show. */
TEST(near_covers_nothing_more_where_no_sonar_hears)
{
    static const uint64_t all = UINT64_MAX;
    static const struct {
        uint64_t bearings, hears[2], lost; /* of two sonars */
        double drift_mps;
        bool blank, first_turns, known, none;
        double silent_s;   /* the first */
        uint16_t heard_ds; /* ago, by it, ... */
        double told_s;     /* ... as of so long ago */
        double turn_s, clear_for_s;
    } row[] = {{.bearings = FAN, .hears = {FAN}, .known = true},
               {.bearings = FAN, .hears = {FAN}, .lost = 1},
               {.bearings = FAN, .hears = {FAN}, .lost = 1, .blank = true},
               {.bearings = FAN, .hears = {FAN}, .lost = 2, .known = true}, /* another one */
               {.bearings = all, .hears = {all}, .known = true},
               {.bearings = all, .hears = {all}, .lost = 1},
               {.bearings = all, .hears = {~FAN}},
               {.bearings = all, .hears = {~FAN}, .blank = true},
               {.bearings = all, .hears = {FAN}, .known = true},
               {.bearings = all, .hears = {all}, .lost = 1, .first_turns = true},
               {.bearings = all, .hears = {all}, .drift_mps = 0.1, .known = true},
               {.bearings = all, .hears = {all}, .drift_mps = 0.1, .lost = 1},
               {.bearings = all, .hears = {all}, .drift_mps = 3, .lost = 1, .none = true},
               {.bearings = all, .hears = {FAN, all}, .lost = 1, .known = true},
               {.bearings = all, .hears = {FAN, all}, .lost = 2, .known = true},
               {.bearings = all, .hears = {FAN, all}, .lost = 3},
               {.bearings = all, .hears = {FAN, ~FAN}, .lost = 1},
               {.bearings = FAN, .hears = {FAN, FAN}, .lost = 2, .known = true},
               {.bearings = ~FAN, .hears = {~FAN}, .lost = 1, .known = true}, /* none looks there */
               {.bearings = all, .hears = {all}, .silent_s = 29, .known = true},
               {.bearings = all, .hears = {all}, .silent_s = 31},
               {.bearings = FAN, .hears = {FAN}, .silent_s = 31},
               {.bearings = all, .hears = {all, FAN}, .silent_s = 31, .known = true},
               {.bearings = all, .hears = {all}, .heard_ds = 299, .known = true},
               {.bearings = all, .hears = {all}, .heard_ds = 301},
               {.bearings = all, .hears = {all}, .heard_ds = 299, .told_s = 1},
               {.bearings = all, .hears = {all}, .heard_ds = 301, .turn_s = 20, .known = true},
               {.bearings = all, .hears = {all}, .heard_ds = 441, .turn_s = 20},
               {.bearings = all, .hears = {all}, .heard_ds = 299, .clear_for_s = 20}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct picture_frame frame;
        start();
        picture_get_frame(&picture, &frame);
        frame.looks = (struct bearings_looks){.bearings = {row[i].bearings},
                                              .t_ns = NOW - (uint64_t)(row[i].told_s * 1e9),
                                              .hears = {row[i].hears[0], row[i].hears[1]},
                                              .last_ns = {NOW - (uint64_t)(row[i].silent_s * 1e9), NOW},
                                              .level_rad = {geo_rad(10)},
                                              .gap_rad = {geo_rad(3)},
                                              .first_turns = row[i].first_turns};
        frame.looks.turn_s[0] = row[i].turn_s;
        frame.looks.back_ds[0] = BEARINGS_NEVER;
        for (int k = 0; k < BEARINGS; k++)
            frame.looks.heard_ds[0][k] = row[i].heard_ds;
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_end(&picture);
        now.lost = row[i].lost;
        now.pose.drift_mps = row[i].drift_mps;
        const struct promise_look look = {
            .looked_m = row[i].blank ? 0 : 99, .sure_m = row[i].blank ? 0 : 1.5, .showed = true, .age_s = 1};
        const double most_m = promised_within(row[i].clear_for_s, 13.5, look, 3);
        CHECK_NEAR(fmin(most_m, 2), row[i].known ? 2 : row[i].blank || row[i].none ? 0 : 1.5, 0, 0.1);
    }
    now.lost = 0;
    now.pose.drift_mps = 0;
}

TEST(what_a_fan_off_the_middle_showed_may_have_come)
{
    static const double side_m[] = {0, 0.4}, az[] = {20, 30};
    for (int i = 0; i < 2; i++) {
        struct bearings b = {0};
        const struct still_fan fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, side_m[i], 0}};
        start();
        look_with(&b, &fan);
        now.pose.drift_mps = 1.5;
        for (int k = -1; k <= 1; k += 2) {
            struct picture_entry e = {0};
            const uint64_t t_ns = NOW - SECOND / 10 * 9;
            e.obstacle[0] = (struct picture_obstacle){
                .t_ref_ns = t_ns, .t_echo_ns = t_ns, .logodds = 4, .near_m = 2, .range_m = 2, .sd_m = 0.05f};
            picture_begin(&picture);
            picture_set(&picture, rings_index(&rings, geo_rad(az[i]), geo_rad(1.5 * k)), &e);
            picture_end(&picture);
        }
        CHECK(promised(az[i] + 35, unseen, 2) < 0.95 && promised(az[i] + 38, unseen, 2) < 0.95);
    }
    now.pose.drift_mps = 0;
}

int main(void)
{
    RUN(near_is_no_leave_where_a_sonar_looks_and_has_not_looked);
    RUN(a_flat_head_takes_no_bearing_from_a_higher_one);
    RUN(near_shrinks_as_a_vehicle_drifts);
    RUN(what_was_shown_beside_may_have_come_ahead);
    RUN(near_counts_where_a_head_looks);
    RUN(near_covers_no_lost_ping);
    RUN(near_covers_no_lost_ping_adrift);
    RUN(near_ends_before_what_nobody_looked_at_where_a_head_has_yet_to_look);
    RUN(near_covers_no_water_in_a_beam_that_stays);
    RUN(near_holds_in_a_still_beam_as_far_as_drift_has_brought_its_edge);
    RUN(near_holds_at_no_edge_of_a_still_beam_where_a_head_has_yet_to_look);
    RUN(near_holds_in_a_still_beam_as_far_as_its_edge_is_uncertain);
    RUN(near_covers_no_place_at_which_a_still_fan_looks);
    RUN(near_covers_no_place_at_which_a_fan_off_the_middle_looks);
    RUN(near_follows_a_still_fan_to_another_mount);
    RUN(near_covers_nothing_more_where_no_sonar_hears);
    RUN(what_a_fan_off_the_middle_showed_may_have_come);
    return test_end();
}
