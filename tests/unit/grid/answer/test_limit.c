/* SPDX-License-Identifier: MIT */
/* test_limit - corridors and the speed they allow: on pictures made by hand, and by their properties on random ones. */
#include "tests/lib/table.h"
#include "tests/lib/looks_rig.h"

#include "grid/answer/limit.h"

static const struct corridor_body small = {.radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 0.7};

static void start(void)
{
    start_with(rings_full(&rings, geo_rad(3)), false);
}

static void set(uint32_t d, double blind_m, double free_m, double near_m, double age_s)
{
    struct picture_entry e = {0};
    const uint64_t t_ns = NOW - (uint64_t)(age_s * 1e9);
    e.free[0] = (struct free_interval){.t_ping_ns = t_ns, .from_m = (float)blind_m, .to_m = (float)free_m};
    if (near_m > 0)
        e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = t_ns,
                                                  .t_echo_ns = t_ns,
                                                  .logodds = 4,
                                                  .near_m = (float)near_m,
                                                  .range_m = (float)near_m,
                                                  .sd_m = 0.05f};
    picture_begin(&picture);
    picture_set(&picture, d, &e);
    picture_end(&picture);
}

static void all_free(double free_m)
{
    for (uint32_t d = 0; d < rings.n; d++)
        set(d, 0.3, free_m, 0, 1);
}

static uint32_t at(double az_deg, double el_deg)
{
    return rings_index(&rings, geo_rad(az_deg), geo_rad(el_deg));
}

static struct corridor look_drifting(const struct corridor_body *body, double x, double y, double z, double most_m,
                                     const double drift_m[3])
{
    const struct corridor_query q = {
        .direction = {x, y, z}, .drift_m = {drift_m[0], drift_m[1], drift_m[2]}, .most_m = most_m};
    struct corridor c;
    corridor_look(&picture, &limits, &now, body, &q, &c);
    return c;
}

/* clear_for_s: 0: as usual. */
static struct corridor look_within(double clear_for_s, const struct corridor_body *body, double most_m)
{
    const struct corridor_query q = {.direction = {1, 0, 0}, .most_m = most_m};
    struct answer_conf conf = limits;
    struct corridor c;
    conf.clear_for_s = clear_for_s > 0 ? clear_for_s : conf.clear_for_s;
    corridor_look(&picture, &conf, &now, body, &q, &c);
    return c;
}

static struct corridor look(const struct corridor_body *body, double x, double y, double z, double most_m)
{
    return look_drifting(body, x, y, z, most_m, (const double[3]){0, 0, 0});
}

TEST(open_water_is_known_as_far_as_asked)
{
    start();
    all_free(20);
    const struct corridor c = look(&small, 1, 0, 0, 10);
    CHECK_NEAR(c.known_m, 10, 1e-9, 0);
    CHECK(isinf(c.blocked_m));
    CHECK_INT(c.reason, ANSWER_HEARD);
    CHECK_NEAR(c.front_m, 0.4, 1e-9, 0);
    CHECK_NEAR(c.age_s, 1, 1e-6, 0);
}

TEST(the_front_is_the_bodys_extent_along_the_line)
{
    start();
    all_free(20);
    CHECK_NEAR(look(&small, 0, 0, 2, 10).front_m, 0.3, 1e-9, 0); /* half height and margin */
    CHECK_NEAR(look(&small, 0, 3, 0, 10).front_m, 0.4, 1e-9, 0);
    CHECK_NEAR(look(&small, 1, 0, -1, 10).front_m, (0.3 + 0.2) / sqrt(2) + 0.1, 1e-9, 0);
}

static void forget(uint32_t d)
{
    picture_begin(&picture);
    picture_set(&picture, d, &(struct picture_entry){0});
    picture_end(&picture);
}

TEST(near_is_no_leave_where_a_sonar_looks_and_has_not_looked)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 3};
    static const uint64_t ahead = UINT64_C(0xff000000000000ff);
    static const struct {
        double az_deg, el_deg;
        uint64_t bearings;
        bool known;
    } row[] = {
        {0, 0, ahead, false}, {30, 0, ahead, false}, {30, 0, 0, true}, /* no sonar looks there: as promised */
        {60, 0, ahead, true},                                          /* beside the body's own front */
        {0, 30, ahead, true}, {30, 0, ~ahead, true}, {-30, 0, UINT64_MAX, false}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start();
        all_free(20);
        looks_at(row[i].bearings, 0, false);
        forget(at(row[i].az_deg, row[i].el_deg));
        const struct corridor c = look(&promised, 1, 0, 0, 2);
        CHECK_INT(c.reason, row[i].known ? ANSWER_HEARD : ANSWER_NEVER);
        CHECK(row[i].known ? c.known_m == 2 : c.known_m < c.front_m);
    }
}

/* What stood beyond near when a beam showed water has come nearer by the drift since. A deaf ping shows none. */
TEST(near_shrinks_as_a_vehicle_drifts)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 3};
    static const struct {
        double age_s;
        float to_m;
        bool turned;
        double known_m;
    } row[] = {{0, -1, false, 2},  {9, -1, false, 2}, {20, -1, false, 1},
               {40, -1, false, 0}, {0, 0, false, 0},  {0, -1, true, 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start();
        all_free(20);
        looks_at(UINT64_MAX, 0, false);
        now.pose.drift_mps = 0.1;
        now.pose.heading_adrift = row[i].turned;
        const struct picture_entry e = {
            .free = {{.t_ping_ns = NOW - (uint64_t)(row[i].age_s * 1e9) - 1, .to_m = row[i].to_m, .sensors = 1}}};
        picture_begin(&picture);
        picture_set(&picture, at(0, 0), &e);
        picture_end(&picture);
        CHECK_NEAR(look(&promised, 1, 0, 0, 2).known_m, row[i].known_m, 0, 0.05);
    }
}

/*
 * Of a post 3 m away a beam showed water ahead right before, and now nothing of it is free there by the beams. A
 * vehicle that has drifted past the post has it ahead; not if all has been looked at since, or nobody looks there.
 */
TEST(what_was_shown_beside_may_have_come_ahead)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 4};
    static const struct {
        double az_deg, age_s, turn_s;
        uint64_t bearings;
        double known_m;
        double swept_deg; /* a head that went round before has looked no farther than this to each side for 12 s */
    } row[] = {{40, 4, 4, UINT64_MAX, 1.22, 0},        {-40, 4, 4, UINT64_MAX, 1.22, 0},
               {40, 1, 4, UINT64_MAX, 2.5, 0},         {90, 4, 4, UINT64_MAX, 2.5, 0},
               {90, 8, 4, UINT64_MAX, 0, 0},           {150, 8, 4, UINT64_MAX, 0, 0},
               {90, 8, 3, UINT64_MAX, 2.5, 0},         {90, 8, 3, UINT64_MAX, 0, 60},
               {90, 8, 4, 0xff000000000000ff, 2.5, 0}, {40, 4, 0, 0xff000000000000ff, 2.5, 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct picture_frame frame;
        start();
        all_free(20);
        looks_at(row[i].bearings, 0, false);
        picture_get_frame(&picture, &frame);
        frame.turn_s = row[i].turn_s;
        for (int k = 0; k < BEARINGS && row[i].swept_deg > 0; k++)
            if (fabs(geo_wrap_pi((k + 0.5) * GEO_TURN / BEARINGS)) > geo_rad(row[i].swept_deg))
                frame.looks.heard_ds[0][k] = 120;
        for (int k = 1; k < BEARINGS_SENSORS; k++)
            memset(frame.looks.heard_ds[k], 0xff, sizeof frame.looks.heard_ds[k]);
        now.pose.drift_mps = 0.5;
        set(at(row[i].az_deg, 1), 0.3, 20, 3, row[i].age_s);
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_set(&picture, at(0, 1),
                    &(struct picture_entry){.free = {{.t_ping_ns = NOW - 1, .to_m = -1, .sensors = 1}}});
        picture_end(&picture);
        CHECK_NEAR(look(&promised, 1, 0, 0, 2.5).known_m, row[i].known_m, 0, 0.15);
    }
}

TEST(near_covers_what_lies_between_two_looks)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 3};
    for (int gap = 1; gap < 6; gap++) { /* cells of 3 degrees, looks 5.5 degrees apart */
        start();
        all_free(20);
        looks_at(UINT64_MAX, 5.5, false);
        for (int i = 0; i < gap; i++)
            forget(at(3 * i + 1.5, 0));
        CHECK_INT(look(&promised, 1, 0, 0, 2).reason, gap <= 4 ? ANSWER_HEARD : ANSWER_NEVER);
    }
}

/* A lost ping leaves a piece of a direction's water, or none of it (to_m = -1) where a side was in no beam. */
TEST(near_covers_no_lost_ping_in_the_first_turns)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 3};
    static const struct {
        double to_m, known_m;
        bool first_turns;
        double gap_deg, az_deg;
        enum answer_reason reason;
    } row[] = {{1.5, 1.5, true, 0, 0, ANSWER_BEYOND}, {1.5, 2, false, 0, 0, ANSWER_HEARD},
               {1.5, 2, true, 3, 0, ANSWER_HEARD},  /* the sonar's own gap between two beams */
               {1.5, 2, true, 0, 60, ANSWER_HEARD}, /* beside the body's own front */
               {3.5, 2, true, 0, 0, ANSWER_HEARD},    {-1, 0, true, 0, 0, ANSWER_BEYOND},
               {-1, 2, false, 0, 0, ANSWER_HEARD}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        start();
        all_free(20);
        looks_at(UINT64_MAX, row[i].gap_deg, row[i].first_turns);
        set(at(row[i].az_deg, 0), 0.3, row[i].to_m, 0, 1);
        const struct corridor c = look(&promised, 1, 0, 0, 2);
        CHECK_NEAR(c.known_m, row[i].known_m, 0, 0.02);
        CHECK_INT(c.reason, row[i].reason);
    }
}

/*
 * In a beam that does not turn nothing is promised: of a direction 13.5 degrees to the side, which it has just come to
 * look at, it has shown 1.5 m, or nothing. Up to 4.5 degrees from its edge no direction lies wholly in it.
 */
TEST(near_covers_no_water_in_a_beam_that_stays)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 3};
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
        start_with(rings_full(&rings, geo_rad(3)), true);
        all_free(20);
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
        const uint32_t there = at(13.5 - row[i].axes_deg, 0);
        if (row[i].blank)
            forget(there);
        else
            set(there, 0.1, row[i].to_m > 0 ? row[i].to_m : 1.5, 0, 1);
        const struct corridor c =
            look(&promised, cos(geo_rad(row[i].yaw_deg)), -sin(geo_rad(row[i].yaw_deg)), 0, 2);
        if (row[i].known)
            CHECK(c.reason == ANSWER_HEARD && c.known_m == 2);
        else
            CHECK(c.reason == (row[i].blank ? ANSWER_NEVER : ANSWER_BEYOND) &&
                  c.known_m < (row[i].blank ? 0.1 : 1.6));
        struct corridor_body larger = promised;
        larger.radius_m *= 3;
        const struct corridor by =
            look(&larger, cos(geo_rad(row[i].yaw_deg)), -sin(geo_rad(row[i].yaw_deg)), 0, 2);
        CHECK(by.known_m - by.front_m <= c.known_m - c.front_m);
    }
}

/*
 * While the vehicle drifts, what stood beside such a beam may have come in, the farther in the nearer: there near holds
 * as beside it. 13.5 degrees to the side are 11.6, 26.4 or 0 from the edge, and so many times the drift is sin(that).
 */
TEST(near_holds_in_a_still_beam_as_far_as_drift_has_brought_its_edge)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 3};
    static const struct {
        double wide_deg, age_s;
        float to_m; /* as of the last ping; -1: it showed water, of which the vehicle may have drifted out */
        double known_m;
    } row[] = {{60, 2, -1, 0.99}, {60, 4, -1, 1.99}, {60, 2, 1.5f, 1.5}, {60, 4, 1.5f, 1.99}, {60, 0, -1, 0},
               {90, 4, -1, 0.9},  {90, 4, 0, 0},     {34, 2, -1, 2},     {360, 4, -1, 0}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct picture_frame frame;
        start_with(rings_full(&rings, geo_rad(3)), true);
        all_free(20);
        looks_at(0, 0, false);
        picture_get_frame(&picture, &frame);
        open_still(&frame.looks, 0, row[i].wide_deg);
        const struct picture_entry e = {
            .free = {{.t_ping_ns = NOW - (uint64_t)(row[i].age_s * 1e9) - 1, .to_m = row[i].to_m, .sensors = 1}}};
        picture_begin(&picture);
        picture_set_frame(&picture, &frame);
        picture_set(&picture, at(13.5, 0), &e);
        picture_end(&picture);
        now.pose.drift_mps = 0.1;
        CHECK_NEAR(look(&promised, 1, 0, 0, 2).known_m, row[i].known_m, 0, 0.08);
    }
}

/* A level direction that the fan has not freed, in that bearing: does near cover it? */
static bool near_covers(double az_deg, double roll_deg, double pitch_deg)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 2};
    all_free(20);
    forget(at(az_deg, 1.5));
    forget(at(az_deg, -1.5));
    quat_from_rpy(geo_rad(roll_deg), geo_rad(pitch_deg), 0, now.pose.attitude);
    const struct corridor_query q = {
        .direction = {cos(geo_rad(az_deg)), sin(geo_rad(az_deg)), 0}, .ned = true, .most_m = 1.5};
    struct corridor c;
    corridor_look(&picture, &limits, &now, &promised, &q, &c);
    CHECK(c.reason == ANSWER_HEARD || (c.reason == ANSWER_NEVER && c.known_m < 0.1));
    return c.reason == ANSWER_HEARD;
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
               {.fan = {.wide_deg = 120, .high_deg = 20}, .pitch_deg = 20, .az_deg = 55, .covered = true},
               {.fan = {.wide_deg = 120, .high_deg = 40}, .pitch_deg = 12, .az_deg = 0},
               {.fan = {.wide_deg = 120, .high_deg = 20}, .roll_deg = 20, .az_deg = 0},
               {.fan = {.wide_deg = 120, .high_deg = 20, .roll_deg = 20}, .roll_deg = -20, .az_deg = 50}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings b = {0};
        start_with(rings_full(&rings, geo_rad(3)), true);
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
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {-0.6, 0, 0}}, .az_deg = 60, .covered = true},
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0.4, 0, 0}}, .az_deg = 35, .covered = true},
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, 0.4, 0}}, .az_deg = 33}, /* 25 degrees */
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, 0.4, 0}}, .az_deg = -36, .covered = true},
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, -0.4, 0}}, .az_deg = -33},
        {.fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, 0, 0.4}},
         .az_deg = 20}}; /* of what stands there it sees the foot */
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct bearings b = {0};
        start_with(rings_full(&rings, geo_rad(3)), true);
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
    start_with(rings_full(&rings, geo_rad(3)), true);
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
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 3};
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
        start_with(rings_full(&rings, geo_rad(3)), true);
        all_free(20);
        picture_get_frame(&picture, &frame);
        frame.looks = (struct bearings_looks){.bearings = row[i].bearings,
                                              .t_ns = NOW - (uint64_t)(row[i].told_s * 1e9),
                                              .hears = {row[i].hears[0], row[i].hears[1]},
                                              .last_ns = {NOW - (uint64_t)(row[i].silent_s * 1e9), NOW},
                                              .level_rad = geo_rad(10),
                                              .gap_rad = geo_rad(3),
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
        if (row[i].blank)
            forget(at(13.5, 0));
        else
            set(at(13.5, 0), 0.1, 1.5, 0, 1);
        const struct corridor c = look_within(row[i].clear_for_s, &promised, 2);
        if (row[i].known)
            CHECK(c.reason == ANSWER_HEARD && c.known_m == 2);
        else if (row[i].blank || row[i].none)
            CHECK(c.reason != ANSWER_HEARD && c.known_m < 0.1);
        else
            CHECK(c.reason != ANSWER_HEARD && c.known_m > 1.4 && c.known_m < 1.6);
    }
}

TEST(what_stands_in_the_tunnel_blocks_and_what_stands_beside_it_does_not)
{
    start();
    all_free(20);
    set(at(0, 0), 0.3, 4.9, 5, 2);
    struct corridor c = look(&small, 1, 0, 0, 10);
    CHECK_NEAR(c.blocked_m, 5, 0.02, 0);
    CHECK(c.blocked_m <= 5);
    CHECK_NEAR(c.blocked_age_s, 2, 1e-6, 0);
    CHECK_NEAR(c.blocked_sd_m, 0.05, 1e-6, 0);
    CHECK(c.known_m < 5);
    CHECK(isinf(look(&small, 0, 1, 0, 10).blocked_m));
    CHECK(isinf(look(&small, -1, 0, 0, 10).blocked_m));
    start();
    all_free(20);
    set(at(30, 0), 0.3, 4.9, 5, 2); /* 2.5 m to the side */
    CHECK(isinf(look(&small, 1, 0, 0, 10).blocked_m));
    CHECK(look(&small, 0.866, 0.5, 0, 10).blocked_m < 5.01);
    set(at(30, 0), 0.3, 0.5, 0.55,
        2); /* 0.48 m ahead, 0.28 m to the side: in the way of a round front, 0.4 m wide */
    c = look(&small, 1, 0, 0, 10);
    CHECK(c.blocked_m < 0.59 && c.blocked_m > 0.55);
}

/* The tunnel is around the vehicle, the rays begin at the grid's centre. */
TEST(a_vehicle_off_the_grids_centre_sweeps_its_own_tunnel)
{
    for (int side = -1; side <= 1; side += 2) {
        start_with(rings_full(&rings, geo_rad(3)), true);
        all_free(20);
        set(at(25 * side, 0), 0.3, 1.105, 1.2, 1); /* 1 m ahead, 0.47 m to the side of the centre */
        now.pose.position_m[1] = 0.1 * side;
        CHECK(look(&small, 1, 0, 0, 10).blocked_m < 1.4);
        now.pose.position_m[1] = -0.1 * side;
        CHECK(isinf(look(&small, 1, 0, 0, 10).blocked_m));
        now.pose.position_m[1] = 0;
        set(at(25 * side, 0), 0.3, 20, 0, 1);
        set(at(0, 20 * side), 0.3, 1.06, 1.1, 1); /* 1 m ahead, 0.36 m above or below */
        now.pose.position_m[2] = -0.1 * side;
        CHECK(look(&small, 1, 0, 0, 10).blocked_m < 1.4);
        now.pose.position_m[2] = 0.1 * side;
        CHECK(isinf(look(&small, 1, 0, 0, 10).blocked_m));
        now.pose.position_m[2] = 0;
    }
}

/* With near = auto: the tunnel up to the body's front, and nothing else. */
TEST(the_bodys_own_place_is_not_asked_for)
{
    struct corridor_body body = small;
    body.near_m = 0;
    body.own_margin_m = body.margin_m;
    start();
    all_free(20);
    CHECK_NEAR(look(&body, 1, 0, 0, 10).known_m, 10, 1e-9, 0);
    set(at(0, 0), 0.39, 20, 0, 1);
    CHECK_NEAR(look(&body, 1, 0, 0, 10).known_m, 10, 1e-9, 0);
    set(at(0, 0), 0.45, 20, 0, 1); /* blind beyond the front, which is at 0.4 m */
    CHECK_INT(look(&body, 1, 0, 0, 10).reason, ANSWER_BLIND);
    CHECK_NEAR(look(&body, 1, 0, 0, 10).known_m, 0.4, 0.01, 0);
    all_free(20);
    set(at(85, 0), 0.9, 20, 0, 1); /* a ray that leaves the tunnel beside the body */
    CHECK_NEAR(look(&body, 1, 0, 0, 10).known_m, 10, 1e-9, 0);
    start_with(rings_full(&rings, geo_rad(3)), true);
    all_free(20);
    now.pose.position_m[0] = 0.05; /* it has moved on since: its place has, too */
    set(at(0, 0), 0.44, 20, 0, 1);
    CHECK_NEAR(look(&body, 1, 0, 0, 10).known_m, 10, 1e-9, 0);
    now.pose.position_m[0] = 0;
}

TEST(water_that_nobody_heard_is_not_known)
{
    start();
    CHECK(look(&small, 1, 0, 0, 10).known_m < small.near_m);
    CHECK_INT(look(&small, 1, 0, 0, 10).reason, ANSWER_NEVER);
    all_free(6);
    struct corridor c = look(&small, 1, 0, 0, 10);
    CHECK(c.known_m <= 6 && c.known_m > 5.8);
    CHECK_INT(c.reason, ANSWER_BEYOND);
    set(at(0, 0), 0.3, 20, 0, 40); /* too long ago */
    CHECK_INT(look(&small, 1, 0, 0, 10).reason, ANSWER_STALE);
    CHECK(look(&small, 1, 0, 0, 10).known_m <= small.near_m);
    all_free(20);
    set(at(0, 0), 0.9, 20, 0, 1); /* its ring-down is longer than what is the vehicle's own place */
    CHECK_INT(look(&small, 1, 0, 0, 10).reason, ANSWER_BLIND);
    all_free(20);
    now.pose_fresh = false;
    CHECK(look(&small, 1, 0, 0, 10).known_m > 9.9); /* the axes are the body's: no pose is needed */
    const struct corridor_query q = {.direction = {1, 0, 0}, .ned = true, .most_m = 10};
    corridor_look(&picture, &limits, &now, &small, &q, &c);
    CHECK_INT(c.reason, ANSWER_NO_FRAME);
    CHECK_NEAR(c.known_m, 0, 0, 0);
}

/* One that never sufficed to block does, too; where it lies beyond what the tunnel sweeps it says nothing. */
TEST(an_echo_that_does_not_suffice_to_block_is_no_free_water)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 3};
    for (int beyond = 0; beyond < 2; beyond++) {
        start();
        all_free(20);
        picture_begin(&picture);
        picture_set(&picture, at(0, 0), &(struct picture_entry){.hint_m = beyond ? 4 : 1.5f});
        picture_end(&picture);
        const struct corridor c = look(&promised, 1, 0, 0, 2);
        CHECK_INT(c.reason, beyond ? ANSWER_HEARD : ANSWER_BEYOND);
        CHECK(isinf(c.blocked_m));
        CHECK(beyond ? c.known_m == 2 : c.known_m <= 1.5 && c.known_m > 1.4);
    }
}

/* An echo that has faded too far to block ends what is known, in the vehicle's own place too. */
TEST(a_faint_echo_near_by_is_no_free_water)
{
    start();
    all_free(20);
    struct picture_entry e = {0};
    e.free[0] = (struct free_interval){.t_ping_ns = NOW, .from_m = 0.65f, .to_m = 20};
    e.obstacle[0] = (struct picture_obstacle){.t_ref_ns = NOW,
                                              .t_echo_ns = NOW,
                                              .logodds = (float)picture.blocked_logodds / 2,
                                              .near_m = 0.5f,
                                              .range_m = 0.5f,
                                              .sd_m = 0.05f};
    picture_begin(&picture);
    picture_set(&picture, at(80, 0), &e); /* leaves the tunnel abeam, nearer than near_m */
    picture_end(&picture);
    CHECK(look(&small, 1, 0, 0, 10).known_m > 9.9);
    e.obstacle[0].near_m = e.obstacle[0].range_m = 0.35f; /* in the tunnel */
    picture_begin(&picture);
    picture_set(&picture, at(80, 0), &e);
    picture_end(&picture);
    const struct corridor c = look(&small, 1, 0, 0, 10);
    CHECK(c.known_m <= 0.35);
    CHECK(isinf(c.blocked_m));
    CHECK_INT(c.reason, ANSWER_BEYOND);

    e.obstacle[1] = e.obstacle[0]; /* a sure one behind it, beside the tunnel */
    e.obstacle[1].logodds = 4;
    e.obstacle[1].near_m = e.obstacle[1].range_m = 8;
    picture_begin(&picture);
    picture_set(&picture, at(80, 0), &e);
    picture_end(&picture);
    CHECK(look(&small, 1, 0, 0, 10).known_m <= 0.35);
}

static uint64_t state;

static double uniform(double lo, double hi)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return lo + (hi - lo) * (double)(state >> 11) * 0x1p-53;
}

/* By how much farther back than its foremost point an upright body with its margin begins at `beside_m` from the
 * line that slopes so (a sine): its cross-section there is a box. */
static double behind_front(const struct corridor_body *body, double slope, double front_m, double beside_m)
{
    const double wide = body->radius_m + body->margin_m, y = fmin(beside_m, wide);
    const double reach_m =
        sqrt(wide * wide - y * y) * sqrt(1 - slope * slope) + (body->half_height_m + body->margin_m) * fabs(slope);
    return fmax(0, front_m - reach_m);
}

/* Of a place that is y to the side, from a line that may be carried off so far. */
static double beside(double y, double carried_m)
{
    return fmax(0, fmax(y - fmax(carried_m, 0), fmin(carried_m, 0) - y));
}

/* Points of the tunnel, against what the picture holds along the ray through each. */
TEST(no_point_of_the_tunnel_is_worse_than_said)
{
    uint32_t seen_blocked = 0, seen_known = 0;
    state = 7;
    printf("seed %llu\n", (unsigned long long)state);
    for (int round = 0; round < 60; round++) {
        start();
        for (uint32_t d = 0; d < rings.n; d++) {
            const double near_m = uniform(0, 1) < 0.02 ? uniform(0.3, 12) : 0;
            set(d, 0.3, near_m > 0 ? near_m - 0.01 : uniform(0, 1) < 0.05 ? uniform(1, 9) : 15, near_m, 1);
        }
        const struct corridor_body body = {uniform(0, 0.8), uniform(0, 0.8), uniform(0, 0.3), round % 3 ? 1.7 : 0,
                                           0};
        const double el = asin(uniform(-1, 1)), az = uniform(0, GEO_TURN);
        double a[3], side[3], up[3];
        geo_direction(az, el, a);
        geo_direction(az + GEO_PI / 2, 0, side);
        geo_direction(az, el + GEO_PI / 2, up);
        const double off[2] = {round % 2 * uniform(-1, 1), round % 2 * uniform(-1, 1)};
        double drift[3];
        for (int i = 0; i < 3; i++)
            drift[i] = off[0] * side[i] + off[1] * up[i] + uniform(-1, 1) * a[i];
        const struct corridor c = look_drifting(&body, a[0], a[1], a[2], 10, drift);
        const double wide = body.radius_m + body.margin_m;
        const double high = body.half_height_m * fabs(cos(el)) + body.radius_m * fabs(sin(el)) + body.margin_m;
        for (int k = 0; k < 20000; k++) {
            const double carried = uniform(0, 1), x = uniform(0, 10);
            const double y = uniform(-wide, wide) + carried * off[0];
            const double z = uniform(-high, high) + carried * off[1];
            double v[3], p_az, p_el;
            for (int i = 0; i < 3; i++)
                v[i] = x * a[i] + y * side[i] + z * up[i];
            const double r = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
            geo_angles(v, &p_az, &p_el);
            struct picture_entry e;
            picture_get(&picture, rings_index(&rings, p_az, p_el), &e);
            const bool hit = e.obstacle[0].logodds > 0 && r > e.obstacle[0].near_m;
            const double share = e.obstacle[0].near_m / r;
            if (hit && share * x + behind_front(&body, sin(el), c.front_m, beside(share * y, off[0])) + 1e-6 <
                           c.blocked_m) {
                test_case_failed = true;
                printf("round %d: an obstacle stands before blocked_m\n", round);
                break;
            }
            const bool asked = body.near_m > 0 ? r > body.near_m : x > c.front_m;
            if (x + behind_front(&body, sin(el), c.front_m, beside(y, off[0])) < c.known_m && asked &&
                r > e.free[0].to_m + 1e-6) {
                test_case_failed = true;
                printf("round %d: water that nobody heard lies before known_m\n", round);
                break;
            }
        }
        seen_blocked += c.blocked_m < INFINITY;
        seen_known += c.known_m > 2;
    }
    CHECK(seen_blocked > 20);
    CHECK(seen_known > 5);
}

static void cross(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++)
        out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* The tunnel's axes in the grid's, in other words than the corridor's own: along, to the side, upwards. */
static void tunnel_of(const struct corridor_query *q, double axes[3][3], double drift_m[3])
{
    double body_up[3] = {0, 0, -1}, length = 0;
    memcpy(axes[0], q->direction, sizeof axes[0]);
    memcpy(drift_m, q->drift_m, sizeof q->drift_m);
    quat_rotate(now.pose.attitude, body_up, body_up);
    if (!q->ned) {
        quat_rotate(now.pose.attitude, axes[0], axes[0]);
        quat_rotate(now.pose.attitude, drift_m, drift_m);
    }
    cross(axes[0], body_up, axes[1]);
    for (int i = 0; i < 3; i++)
        length += axes[1][i] * axes[1][i];
    for (int i = 0; i < 3; i++)
        axes[1][i] /= sqrt(length);
    cross(axes[1], axes[0], axes[2]);
}

/* A vehicle that rolls and pitches, in a grid of the world's axes; every other one keeps a level row only. */
TEST(a_tilted_body_sweeps_no_water_that_is_worse_than_said)
{
    uint32_t seen_blocked = 0, seen_known = 0, seen_outside = 0;
    state = 41;
    printf("seed %llu\n", (unsigned long long)state);
    for (int round = 0; round < 120; round++) {
        const bool level = round % 2;
        start_with(level ? rings_level(&rings, geo_rad(3), geo_rad(uniform(10, 40)))
                         : rings_full(&rings, geo_rad(3)),
                   true);
        const double tilt = level ? 0.3 : 1;
        quat_from_rpy(uniform(-tilt, tilt), uniform(-tilt, tilt), uniform(0, GEO_TURN), now.pose.attitude);
        for (uint32_t d = 0; d < rings.n; d++) {
            const double near_m = uniform(0, 1) < 0.01 ? uniform(0.3, 12) : 0;
            set(d, 0.3, near_m > 0 ? near_m - 0.01 : 15, near_m, 1);
        }
        const struct corridor_body body = {uniform(0, 0.9), uniform(0, 0.9), uniform(0, 0.2),
                                           round % 3 ? uniform(1, 4) : 0, 0.2};
        struct corridor_query q = {.ned = round % 4 < 2, .most_m = 10};
        geo_direction(uniform(0, GEO_TURN), uniform(-0.2, 0.2), q.direction);
        for (int i = 0; i < 3; i++)
            q.drift_m[i] = uniform(-0.7, 0.7);
        for (int i = 0; i < 3;
             i++) /* since the grid was centred: what is abeam or near is known by so much less */
            now.pose.position_m[i] = round % 3 ? uniform(-0.1, 0.1) : 0;
        struct corridor c;
        corridor_look(&picture, &limits, &now, &body, &q, &c);

        double axes[3][3], drift_m[3], off[3] = {0}, slope = 0, body_up[3] = {0, 0, -1};
        tunnel_of(&q, axes, drift_m);
        quat_rotate(now.pose.attitude, body_up, body_up);
        for (int i = 0; i < 3; i++) {
            slope += axes[0][i] * body_up[i];
            for (int k = 1; k < 3; k++)
                off[k] += drift_m[i] * axes[k][i];
        }
        const double wide = body.radius_m + body.margin_m;
        const double high =
            body.half_height_m * sqrt(1 - slope * slope) + body.radius_m * fabs(slope) + body.margin_m;
        const double own_m = c.front_m - body.margin_m + body.own_margin_m;
        for (int k = 0; k < 20000 && !test_case_failed; k++) {
            const double carried = uniform(0, 1), x = uniform(0.2, 10);
            const double at_m[3] = {x, uniform(-wide, wide) + carried * off[1],
                                    uniform(-high, high) + carried * off[2]};
            double v[3], az, el;
            for (int i = 0; i < 3; i++)
                v[i] = at_m[0] * axes[0][i] + at_m[1] * axes[1][i] + at_m[2] * axes[2][i] + now.pose.position_m[i];
            const double r = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
            const double there_m = x + behind_front(&body, slope, c.front_m, beside(at_m[1], off[1]));
            geo_angles(v, &az, &el);
            const uint32_t d = rings_index(&rings, az, el);
            struct picture_entry e = {0};
            if (d != RINGS_NONE)
                picture_get(&picture, d, &e);
            if (e.obstacle[0].logodds > 0 && r > (double)e.obstacle[0].near_m)
                CHECK(c.blocked_m <= there_m + 1e-6);
            const bool asked = body.near_m > 0 ? r > body.near_m + 0.2 : x > own_m;
            if (there_m < c.known_m && asked)
                CHECK(d != RINGS_NONE && r <= (double)e.free[0].to_m + 1e-6);
        }
        seen_blocked += c.blocked_m < INFINITY;
        seen_known += c.known_m > 2;
        seen_outside += c.reason == ANSWER_OUTSIDE;
    }
    CHECK(seen_blocked > 10);
    CHECK(seen_known > 20);
    CHECK(seen_outside > 10);
}

TEST(a_wall_blocks_who_drifts_towards_it_and_nobody_else)
{
    start();
    all_free(20);
    for (double az = 20; az <= 80; az += 3)
        set(at(az, 0), 0.3, 0.99 / sin(geo_rad(az)), 1 / sin(geo_rad(az)), 1); /* 1 m to starboard */
    CHECK(isinf(look(&small, 1, 0, 0, 10).blocked_m));
    CHECK(look_drifting(&small, 1, 0, 0, 10, (const double[3]){0, 0.8, 0}).blocked_m < 3);
    CHECK(isinf(look_drifting(&small, 1, 0, 0, 10, (const double[3]){0, -0.8, 0}).blocked_m));
    CHECK(isinf(look_drifting(&small, 1, 0, 0, 10, (const double[3]){5, 0, 0}).blocked_m)); /* along: no matter */
}

TEST(more_drift_never_gives_more_water)
{
    state = 23;
    printf("seed %llu\n", (unsigned long long)state);
    uint32_t less = 0;
    for (int round = 0; round < 40; round++) {
        start();
        for (uint32_t d = 0; d < rings.n; d++) {
            const double near_m = uniform(0, 1) < 0.02 ? uniform(0.3, 12) : 0;
            set(d, 0.3, near_m > 0 ? near_m : uniform(0, 1) < 0.02 ? uniform(1, 9) : 15, near_m, uniform(0, 20));
        }
        double a[3], b[3], little[3], much[3];
        geo_direction(uniform(0, GEO_TURN), asin(uniform(-1, 1)), a);
        geo_direction(uniform(0, GEO_TURN), asin(uniform(-1, 1)), b);
        for (int k = 0; k < 50; k++) {
            const double factor = uniform(0, 3), share = uniform(0, 1);
            for (int i = 0; i < 3; i++) {
                much[i] = factor * b[i];
                little[i] = share * much[i];
            }
            const struct corridor with = look_drifting(&small, a[0], a[1], a[2], 10, much);
            const struct corridor without = look_drifting(&small, a[0], a[1], a[2], 10, little);
            CHECK(with.blocked_m <= without.blocked_m && with.known_m <= without.known_m);
            less += with.blocked_m < without.blocked_m || with.known_m < without.known_m;
        }
    }
    CHECK(less > 50);
}

/* ---- speed ---- */

static const struct limit_conf usual = {
    .braking_mps2 = 0.3, .latency_s = 0.5, .unknown = LIMIT_SLOW, .slow_mps = 0.1};

static struct corridor water(double blocked_m, double known_m, bool known)
{
    return (struct corridor){.front_m = 0.4,
                             .blocked_m = blocked_m,
                             .known_m = known_m,
                             .reason = known ? ANSWER_HEARD : ANSWER_BEYOND};
}

TEST(speeds_by_hand)
{
    static const struct {
        const char *name;
        double blocked_m, known_m;
        bool known;
        enum limit_unknown unknown;
        double asked, stale_s, want;
        enum limit_by by;
    } cases[] = {
        {"open water", INFINITY, 10, true, LIMIT_STOP, 1, 0, 1, LIMIT_BY_NOTHING},
        {"a wall far away", 9.4, 10, true, LIMIT_STOP, 1, 0, 1, LIMIT_BY_NOTHING},
        {"a wall: v/2 + v^2/0.6 = 1", 1.4, 10, true, LIMIT_STOP, 1, 0, 0.63899, LIMIT_BY_BLOCKED},
        {"the same, a second old: 1.5 v + v^2/0.6 = 1", 1.4, 10, true, LIMIT_STOP, 1, 1, 0.44582,
         LIMIT_BY_BLOCKED},
        {"at the wall", 0.4, 10, true, LIMIT_SLOW, 1, 0, 0, LIMIT_BY_BLOCKED},
        {"unknown: stop", INFINITY, 0, false, LIMIT_STOP, 1, 0, 0, LIMIT_BY_UNKNOWN},
        {"unknown: slow", INFINITY, 0, false, LIMIT_SLOW, 1, 0, 0.1, LIMIT_BY_UNKNOWN},
        {"unknown: slow, less asked", INFINITY, 0, false, LIMIT_SLOW, 0.05, 0, 0.05, LIMIT_BY_NOTHING},
        {"unknown: ignore", INFINITY, 0, false, LIMIT_IGNORE, 1, 0, 1, LIMIT_BY_NOTHING},
        {"unknown before a wall: ignore", 1.4, 0, false, LIMIT_IGNORE, 1, 0, 0.63899, LIMIT_BY_BLOCKED},
        {"unknown, and a wall too near for slow", 0.41, 0, false, LIMIT_SLOW, 1, 0, 0.01882, LIMIT_BY_BLOCKED},
        {"nothing asked", 0, 0, false, LIMIT_STOP, 0, 0, 0, LIMIT_BY_NOTHING},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct corridor c = water(cases[i].blocked_m, cases[i].known_m, cases[i].known);
        struct limit_conf conf = usual;
        struct limit out;
        conf.unknown = cases[i].unknown;
        limit_of(&conf, &c, cases[i].asked, cases[i].stale_s, &out);
        if (fabs(out.speed_mps - cases[i].want) > 1e-4 || out.by != cases[i].by) {
            printf("%s: %.5f m/s by %s\n", cases[i].name, out.speed_mps, limit_word(out.by));
            test_case_failed = true;
        }
    }
}

TEST(it_stands_in_known_water_never_gives_more_and_is_monotone)
{
    state = 11;
    printf("seed %llu\n", (unsigned long long)state);
    for (int k = 0; k < 200000; k++) {
        const struct limit_conf conf = {uniform(0.01, 3), uniform(0, 2), (enum limit_unknown)(k % 3),
                                        uniform(0, 0.5)};
        const double stale_s = uniform(0, 3), asked = uniform(0, 3);
        struct corridor c =
            water(uniform(0, 1) < 0.2 ? INFINITY : uniform(0, 9), uniform(0, 9), uniform(0, 1) < 0.3);
        struct limit a, b;
        limit_of(&conf, &c, asked, stale_s, &a);
        CHECK(a.speed_mps >= 0 && a.speed_mps <= asked);
        CHECK((a.by == LIMIT_BY_NOTHING) == (a.speed_mps >= asked));
        const double way =
            a.speed_mps * (conf.latency_s + stale_s) + a.speed_mps * a.speed_mps / (2 * conf.braking_mps2);
        CHECK(a.speed_mps == 0 || way <= c.blocked_m - c.front_m + 1e-9);
        if (conf.unknown == LIMIT_STOP && c.reason != ANSWER_HEARD)
            CHECK(a.speed_mps == 0 || way <= c.known_m - c.front_m + 1e-9);
        if (conf.unknown == LIMIT_SLOW && c.reason != ANSWER_HEARD)
            CHECK(a.speed_mps <= conf.slow_mps || way <= c.known_m - c.front_m + 1e-9);
        CHECK(a.unknown || c.reason == ANSWER_HEARD || a.speed_mps == 0 || way <= c.known_m - c.front_m + 1e-9);
        CHECK(!a.unknown || (c.reason != ANSWER_HEARD && conf.unknown != LIMIT_STOP));
        c.blocked_m += uniform(0, 1);
        c.known_m += uniform(0, 1);
        limit_of(&conf, &c, asked, stale_s, &b);
        CHECK(b.speed_mps >= a.speed_mps);
        limit_of(&conf, &c, asked, stale_s * 0.5, &a);
        CHECK(a.speed_mps >= b.speed_mps);
        /* looking no farther than the reach changes nothing */
        const double reach = limit_reach_m(&conf, c.front_m, asked, stale_s);
        struct corridor cut = c;
        if (cut.blocked_m > reach)
            cut.blocked_m = INFINITY;
        if (cut.known_m >= reach)
            cut.reason = ANSWER_HEARD;
        limit_of(&conf, &cut, asked, stale_s, &a);
        CHECK(fabs(a.speed_mps - b.speed_mps) < 1e-9);
        if (test_case_failed)
            return;
    }
}

/* Nobody has told for a while where the vehicle is: it is taken to be as near to the wall as it can be. */
TEST(what_it_may_have_moved_is_taken_off)
{
    const struct corridor_body body = {0.3, 0.3, 0, 0.5, 0};
    start_with(rings_full(&rings, geo_rad(3)), true);
    for (uint32_t d = 0; d < rings.n; d++)
        set(d, 0.3, 4.9, 5, 1);
    const struct corridor before = look(&body, 1, 0, 0, 10);
    now.pose.uncertain_m = 1;
    const struct corridor after = look(&body, 1, 0, 0, 10);
    now.pose.uncertain_m = 0;
    CHECK(before.blocked_m < 5 && after.blocked_m <= before.blocked_m - 1);
    CHECK(after.known_m <= before.known_m - 1);
}

TEST(the_remedy_names_the_poses_where_they_are_what_is_missing)
{
    static const struct {
        enum limit_by by;
        enum answer_reason reason;
        enum limit_pose pose;
        const char *said;
    } row[] = {{LIMIT_BY_BLOCKED, ANSWER_HEARD, LIMIT_POSE_PLACED, "or another direction"},
               {LIMIT_BY_BLOCKED, ANSWER_HEARD, LIMIT_POSE_NONE, "or poses with a position"},
               {LIMIT_BY_UNKNOWN, ANSWER_BEYOND, LIMIT_POSE_PLACED, "no_echo"},
               {LIMIT_BY_UNKNOWN, ANSWER_BEYOND, LIMIT_POSE_NONE, "poses with a position"},
               {LIMIT_BY_UNKNOWN, ANSWER_BEYOND, LIMIT_POSE_ADRIFT, "station_keeping"},
               {LIMIT_BY_UNKNOWN, ANSWER_NEVER, LIMIT_POSE_PLACED, "where no sonar looks, a larger near"},
               {LIMIT_BY_UNKNOWN, ANSWER_STALE, LIMIT_POSE_NONE, "clear_for"}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++)
        CHECK(strstr(limit_remedy(row[i].by, row[i].reason, row[i].pose), row[i].said) != NULL);
    CHECK_STR(limit_remedy(LIMIT_BY_NOTHING, ANSWER_HEARD, LIMIT_POSE_NONE), "");
}

TEST(what_a_fan_off_the_middle_showed_may_have_come)
{
    static const struct corridor_body promised = {
        .radius_m = 0.3, .half_height_m = 0.2, .margin_m = 0.1, .near_m = 2};
    static const double side_m[] = {0, 0.4}, az[] = {20, 30};
    for (int i = 0; i < 2; i++) {
        struct bearings b = {0};
        const struct still_fan fan = {.wide_deg = 60, .high_deg = 20, .mount_m = {0, side_m[i], 0}};
        start_with(rings_full(&rings, geo_rad(3)), true);
        all_free(20);
        look_with(&b, &fan);
        now.pose.drift_mps = 1.5;
        set(at(az[i], 1.5), 0.3, 20, 2, 0.9);
        set(at(az[i], -1.5), 0.3, 20, 2, 0.9);
        const double go[] = {az[i] + 35, az[i] + 38};
        for (int k = 0; k < 2; k++) {
            forget(at(go[k], 1.5));
            forget(at(go[k], -1.5));
            const struct corridor_query q = {
                .direction = {cos(geo_rad(go[k])), sin(geo_rad(go[k])), 0}, .ned = true, .most_m = 1.5};
            struct corridor c;
            corridor_look(&picture, &limits, &now, &promised, &q, &c);
            CHECK(c.known_m < 0.95);
        }
    }
    now.pose.drift_mps = 0;
}

int main(void)
{
    RUN(open_water_is_known_as_far_as_asked);
    RUN(the_front_is_the_bodys_extent_along_the_line);
    RUN(near_is_no_leave_where_a_sonar_looks_and_has_not_looked);
    RUN(near_shrinks_as_a_vehicle_drifts);
    RUN(what_was_shown_beside_may_have_come_ahead);
    RUN(near_covers_what_lies_between_two_looks);
    RUN(near_covers_no_lost_ping_in_the_first_turns);
    RUN(the_remedy_names_the_poses_where_they_are_what_is_missing);
    RUN(near_covers_no_water_in_a_beam_that_stays);
    RUN(near_holds_in_a_still_beam_as_far_as_drift_has_brought_its_edge);
    RUN(near_covers_no_place_at_which_a_still_fan_looks);
    RUN(near_covers_no_place_at_which_a_fan_off_the_middle_looks);
    RUN(what_a_fan_off_the_middle_showed_may_have_come);
    RUN(near_follows_a_still_fan_to_another_mount);
    RUN(near_covers_nothing_more_where_no_sonar_hears);
    RUN(what_stands_in_the_tunnel_blocks_and_what_stands_beside_it_does_not);
    RUN(a_vehicle_off_the_grids_centre_sweeps_its_own_tunnel);
    RUN(the_bodys_own_place_is_not_asked_for);
    RUN(water_that_nobody_heard_is_not_known);
    RUN(an_echo_that_does_not_suffice_to_block_is_no_free_water);
    RUN(a_faint_echo_near_by_is_no_free_water);
    RUN(no_point_of_the_tunnel_is_worse_than_said);
    RUN(a_tilted_body_sweeps_no_water_that_is_worse_than_said);
    RUN(a_wall_blocks_who_drifts_towards_it_and_nobody_else);
    RUN(more_drift_never_gives_more_water);
    RUN(speeds_by_hand);
    RUN(it_stands_in_known_water_never_gives_more_and_is_monotone);
    RUN(what_it_may_have_moved_is_taken_off);
    return test_end();
}
