/* SPDX-License-Identifier: MIT */
/*
 * test_own_echo - which echoes are taken for the vehicle's own: looks made by hand, of a head that turns on a vehicle
 * that turns, among its own parts and things in the water.
 */
#include "tests/lib/test.h"

#include "grid/range/own_echo.h"

#define STEPS     200
#define WIDTH_DEG 3.0
#define OPEN_M    10.0f
#define LEVEL     5.0f

static struct own_echo own;
static struct pose pose;
static struct mount mount;
static struct beam_echoes beam;
static uint64_t t_ns, seed;
static float bin_m;

/* What is heard. */
static struct scene {
    double arc_deg[2], own_m; /* bearings of the head in which the vehicle's own part is; 0: none */
    double slope_m;           /* it is so much farther away at the end of the arc */
    double pile_deg, pile_m;  /* of the compass; 0: none */
    double tank_m;            /* radius of the round tank that the vehicle is in the middle of; 0: open water */
    double wall_m;            /* a wall that it follows to starboard; 0: none */
    double missed;            /* share of looks that show nothing */
    float level;
    float from_m, to_m; /* heard */
    double el_deg;      /* of the beams */
    float depth_m;      /* from an echo's near edge to its range */
} scene;

static void begin(void)
{
    own_echo_init(&own);
    pose = pose_identity;
    pose.has = POSE_ATTITUDE | POSE_POSITION;
    mount = mount_identity;
    t_ns = 1000000000;
    bin_m = 0.02f;
    scene = (struct scene){.level = LEVEL, .depth_m = 0.02f, .from_m = 0.3f, .to_m = OPEN_M};
}

static void face(double yaw_deg)
{
    quat_from_rpy(0, 0, geo_rad(yaw_deg), pose.attitude);
}

static double heading_deg(void)
{
    return geo_deg(2.0 * atan2(pose.attitude[3], pose.attitude[0]));
}

/* One beam with up to two echoes (0: no more), heard up to the first. */
static struct beam_echoes *look(double az_deg, double a_m, double b_m)
{
    struct echoes ping = {.t_ns = t_ns += 40000000,
                          .n_beams = 1,
                          .max_beams = 1,
                          .bin_m = bin_m,
                          .az_aperture_rad = (float)geo_rad(WIDTH_DEG),
                          .pose = pose,
                          .beam = &beam};
    const double range_m[] = {a_m, b_m};
    beam = (struct beam_echoes){.az_rad = (float)geo_rad(az_deg),
                                .el_rad = (float)geo_rad(scene.el_deg),
                                .heard_from_m = scene.from_m,
                                .heard_to_m = scene.to_m,
                                .state = BEAM_SILENT};
    for (int i = 0; i < 2 && range_m[i] > 0.0; i++) {
        const float near_m = (float)range_m[i] - scene.depth_m;
        beam.state = BEAM_ECHO;
        beam.heard_to_m = fminf(beam.heard_to_m, near_m);
        beam.echo[beam.n++] =
            (struct echo){.range_m = (float)range_m[i], .near_m = near_m, .strength = 10, .level = scene.level};
    }
    beam.free_to_m = beam.side_to_m = beam.heard_to_m;
    own_echo_run(&own, &ping, &mount);
    return &beam;
}

/* Range of the nearest thing in the water by the compass; 0: none. */
static double in_water_m(double az_deg)
{
    const double off_deg = geo_deg(geo_wrap_pi(geo_rad(az_deg - scene.pile_deg)));
    const double abeam = cos(geo_rad(az_deg - 90.0));
    if (scene.pile_m > 0.0 && fabs(off_deg) < 3.0)
        return scene.pile_m;
    if (scene.wall_m > 0.0 && abeam > 0.3)
        return scene.wall_m / abeam;
    return scene.tank_m;
}

static double own_m(double az_deg)
{
    const double into = (az_deg - scene.arc_deg[0]) / (scene.arc_deg[1] - scene.arc_deg[0]);
    return into >= 0.0 && into <= 1.0 ? scene.own_m + into * scene.slope_m : 0.0;
}

/* One turn of the head; how many echoes are marked as the vehicle's own. */
static int turn(void)
{
    int marked = 0;
    for (int i = 0; i < STEPS; i++) {
        const double az_deg = 360.0 * i / STEPS, water_m = in_water_m(az_deg + heading_deg());
        const double part_m = scene.own_m > 0.0 ? own_m(az_deg) : 0.0;
        const bool own_first = part_m > 0.0 && (water_m <= 0.0 || part_m <= water_m);
        const bool missed = test_uniform(&seed) < scene.missed;
        const double a_m = missed ? 0.0 : own_first ? part_m : water_m;
        const struct beam_echoes *b = look(az_deg, a_m, own_first && a_m > 0.0 ? water_m : 0.0);
        for (int k = 0; k < b->n; k++)
            marked += (b->echo[k].flags & ECHO_OWN) != 0;
    }
    return marked;
}

/* Turns of the head while the vehicle turns so far each time; the marks of the last. */
static int turns(int n, double by_deg)
{
    int marked = 0;
    for (int i = 0; i < n; i++) {
        face(heading_deg() + by_deg);
        marked = turn();
    }
    return marked;
}

static void frame_astern(void)
{
    scene.arc_deg[0] = 170.0;
    scene.arc_deg[1] = 190.0;
    scene.own_m = 0.7;
}

#define FRAME_BEAMS 11 /* of 1.8 degrees in the arc */

TEST(a_part_of_the_vehicle_is_its_own_once_the_vehicle_has_turned)
{
    begin();
    frame_astern();
    CHECK_INT(turn(), 0);
    CHECK_INT(turns(OWN_ECHO_PROOFS - 1, 40.0), 0);
    CHECK_INT(turns(1, 40.0), FRAME_BEAMS);
    CHECK_INT(own_echo_known(&own), FRAME_BEAMS);
    CHECK_INT(turns(5, 0.0), FRAME_BEAMS); /* and stays so while it stands still */
}

TEST(beside_a_vehicle_that_stands_still_nothing_is_learnt)
{
    begin();
    frame_astern();
    scene.pile_m = 1.0;
    CHECK_INT(turns(200, 0.0), 0);
    CHECK_INT(own_echo_known(&own), 0);
}

TEST(without_a_pose_nothing_is_learnt_or_marked)
{
    static const unsigned has[] = {0, POSE_ATTITUDE, POSE_POSITION, POSE_ATTITUDE | POSE_DEPTH};
    for (size_t i = 0; i < sizeof has / sizeof has[0]; i++) {
        begin();
        frame_astern();
        pose.has = has[i];
        CHECK_INT(turns(20, 40.0), 0);
        CHECK_INT(own_echo_known(&own), 0);
    }
    begin();
    frame_astern();
    pose.heading_adrift = true;
    CHECK_INT(turns(20, 40.0), 0);
    pose.heading_adrift = false;
    CHECK_INT(turns(6, 40.0), FRAME_BEAMS);
    pose.has = 0;
    CHECK_INT(turns(1, 40.0), 0);
}

/* The wall stays at the same bearings and ranges of the head while the vehicle goes along it. */
TEST(a_wall_that_the_vehicle_follows_is_not_its_own)
{
    begin();
    scene.wall_m = 0.8;
    for (int i = 0; i < 100; i++) {
        pose.position_m[0] += 0.3;
        CHECK_INT(turn(), 0);
    }
    CHECK_INT(own_echo_known(&own), 0);
}

/* Wherever it turns, every bearing of the head hears the wall at the same range. */
TEST(a_round_tank_around_a_turning_vehicle_is_not_its_own)
{
    begin();
    seed = test_seed();
    scene.tank_m = 1.2;
    scene.missed = 0.5; /* it is all but smooth */
    for (int i = 0; i < 300; i++)
        CHECK_INT(turns(1, 25.0), 0);
    CHECK_INT(own_echo_known(&own), 0);
}

/* A bearing that is deaf and says that it heard nothing contradicts the pile each time that the vehicle turns back. */
TEST(a_pile_that_a_deaf_bearing_does_not_show_is_not_the_vehicles_own)
{
    begin();
    for (int i = 0; i < 100; i++) {
        face(0.0);
        for (double az_deg = 80.0; az_deg < 100.0; az_deg += 1.8)
            CHECK_INT(look(az_deg, fabs(az_deg - 90.0) < 3.0 ? 1.0 : 0.0, 0.0)->echo[0].flags, 0);
        face(50.0);
        for (double az_deg = 30.0; az_deg < 50.0; az_deg += 1.8)
            look(az_deg, 0.0, 0.0);
    }
    CHECK_INT(own_echo_known(&own), 0);
}

/* Of mean 0 and variance 1, nearly normal. */
static double scatter(void)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++)
        sum += test_uniform(&seed);
    return sum;
}

/* As who inspects it goes: slowly, with the pile ahead all the time. Each second another place is told, 20 cm off. */
TEST(a_pile_that_the_vehicle_goes_round_is_not_its_own_though_its_place_is_rough)
{
    double off_m[2] = {0.0, 0.0};
    begin();
    seed = test_seed();
    scene.pile_m = 1.5;
    for (int i = 0; i < 150 * STEPS && !test_case_failed; i++) {
        const double az_deg = 360.0 * (i % STEPS) / STEPS;
        scene.pile_deg = 0.0764 * i;
        for (int k = 0; k < 2 && i % 25 == 0; k++)
            off_m[k] = 0.2 * scatter();
        face(scene.pile_deg);
        pose.position_m[0] = off_m[0] - scene.pile_m * cos(geo_rad(scene.pile_deg));
        pose.position_m[1] = off_m[1] - scene.pile_m * sin(geo_rad(scene.pile_deg));
        CHECK_INT(look(az_deg, in_water_m(az_deg + scene.pile_deg), 0.0)->echo[0].flags, 0);
    }
    CHECK_INT(own_echo_known(&own), 0);
}

TEST(an_uncertain_pose_proves_nothing)
{
    begin();
    frame_astern();
    pose.uncertain_m = 0.1;
    CHECK_INT(turns(20, 40.0), 0);
    begin();
    frame_astern();
    pose.uncertain_rad = geo_rad(1.0);
    CHECK_INT(turns(20, 40.0), 0);
    begin();
    frame_astern();
    for (int i = 0; i < 20; i++) { /* from elsewhere the place is seen from another side */
        pose.position_m[0] += 0.3;
        CHECK_INT(turns(1, 40.0), 0);
    }
    for (int withdrawn = 0; withdrawn < 2; withdrawn++) {
        begin();
        frame_astern();
        for (int i = 0; i < 20; i++) {
            pose.discontinuities += !withdrawn;
            pose.withdrawn += (uint64_t)withdrawn;
            CHECK_INT(turns(1, 40.0), 0);
        }
    }
    begin();
    frame_astern();
    for (int i = 0; i < 20; i++) {
        pose.drift_m[i % 2] += 0.2;
        CHECK_INT(turns(1, 40.0), 0);
    }
    begin();
    frame_astern();
    pose.heading_radps = geo_rad(0.5); /* half a beam width in 3 s */
    CHECK_INT(turns(20, 40.0), 0);
    begin();
    frame_astern();
    for (int i = 0; i < 20; i++) {
        t_ns += 400000000000;
        CHECK_INT(turns(1, 40.0), 0);
    }
}

TEST(proofs_begin_anew_where_another_bearing_shows_it)
{
    begin();
    frame_astern();
    turn();
    turns(OWN_ECHO_PROOFS - 1, 40.0);
    scene.pile_deg = 160.0 + 180.0;
    scene.pile_m = 0.75;
    turn();
    scene.pile_m = 0.0;
    face(160.0);
    look(180.0, 0.7, 0.0);
    turns(OWN_ECHO_PROOFS - 1, 40.0);
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, 0);
    CHECK_INT(look(171.0, 0.7, 0.0)->echo[0].flags, ECHO_OWN);
}

TEST(what_could_not_show_it_proves_nothing)
{
    for (int near = 0; near < 2; near++) {
        begin();
        frame_astern();
        *(near ? &scene.from_m : &scene.to_m) = near ? 0.75f : 0.65f;
        CHECK_INT(turns(20, 40.0), 0);
        CHECK_INT(own_echo_known(&own), 0);
    }
}

TEST(proofs_are_of_different_directions_and_times)
{
    begin();
    frame_astern();
    for (int i = 0; i < 50; i++)
        CHECK_INT(turns(1, i % 2 ? 50.0 : -50.0), 0);
    CHECK_INT(own_echo_known(&own), 0);

    begin(); /* within 80 degrees */
    frame_astern();
    for (int i = 0; i < 50; i++)
        CHECK_INT(turns(1, i % 8 < 4 ? 20.0 : -20.0), 0);
    CHECK_INT(own_echo_known(&own), 0);

    begin(); /* all of them against the looks of one turn */
    turn();
    for (double yaw_deg = 40.0; yaw_deg < 360.0; yaw_deg += 40.0) {
        face(yaw_deg);
        for (double az_deg = 171.0; az_deg <= 189.0; az_deg += 1.8)
            CHECK_INT(look(az_deg, 0.7, 0.0)->echo[0].flags, 0);
    }
    CHECK_INT(own_echo_known(&own), 0);
}

TEST(what_is_missed_once_before_it_is_known_begins_anew)
{
    begin();
    for (int i = 0; i < 20; i++) {
        frame_astern();
        turns(1, 40.0);
        scene.own_m = 0.0;
        turns(1, 0.0);
    }
    CHECK_INT(own_echo_known(&own), 0);
}

/* A beam that is blind says nothing, of the vehicle or of the water. */
TEST(blind_beams_change_nothing)
{
    begin();
    frame_astern();
    for (int i = 0; i < 6; i++) {
        turns(1, 40.0);
        for (int k = 0; k < STEPS; k++) {
            struct beam_echoes blind = {.az_rad = (float)geo_rad(360.0 * k / STEPS), .state = BEAM_BLIND};
            struct echoes ping = {
                .t_ns = t_ns += 1000000, .n_beams = 1, .bin_m = bin_m, .pose = pose, .beam = &blind};
            own_echo_run(&own, &ping, &mount);
        }
    }
    CHECK_INT(own_echo_known(&own), FRAME_BEAMS);
}

/* A head before the vehicle's middle swings round when the vehicle turns on the spot. */
TEST(the_head_is_where_it_is_mounted)
{
    begin();
    frame_astern();
    mount.position_m[0] = 0.4;
    CHECK_INT(turns(20, 40.0), 0);
    for (int i = 0; i < 20; i++) { /* the head stays where it is */
        const double yaw_rad = geo_rad(40.0 * i);
        face(40.0 * i);
        pose.position_m[0] = -0.4 * cos(yaw_rad);
        pose.position_m[1] = -0.4 * sin(yaw_rad);
        turn();
    }
    CHECK_INT(own_echo_known(&own), FRAME_BEAMS);
}

static void learn_frame(void)
{
    begin();
    frame_astern();
    turns(6, 40.0);
    CHECK_INT(own_echo_known(&own), FRAME_BEAMS);
}

TEST(what_is_nearer_louder_or_behind_is_as_before)
{
    learn_frame();
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, ECHO_OWN);
    CHECK_INT(look(180.0, 0.73, 0.0)->echo[0].flags, ECHO_OWN);
    CHECK_INT(look(180.0, 0.6, 0.0)->echo[0].flags, 0);
    CHECK_INT(look(180.0, 0.8, 0.0)->echo[0].flags, 0);
    CHECK_INT(look(180.0, 0.6, 0.7)->echo[0].flags, 0);
    CHECK_INT(beam.echo[1].flags, ECHO_OWN);
    CHECK_INT(look(180.0, 0.7, 2.0)->echo[0].flags, ECHO_OWN);
    CHECK_INT(beam.echo[1].flags, 0);
    CHECK_INT(look(90.0, 0.7, 0.0)->echo[0].flags, 0);
    scene.level = 2.1f * LEVEL;
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, 0);
    scene.level = 1.9f * LEVEL;
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, ECHO_OWN);
    scene.depth_m = 0.15f; /* it begins before it */
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, 0);
    scene.depth_m = 0.02f;
    scene.el_deg = 20.0;
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, 0);
}

TEST(its_level_is_the_loudest_of_the_proofs)
{
    begin();
    frame_astern();
    for (int i = 0; i < 6; i++) {
        scene.level = LEVEL * (float)(1.0 + 0.3 * i);
        turns(1, 40.0);
    }
    scene.level = 3.8f * LEVEL;
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, ECHO_OWN);
}

TEST(parts_of_the_vehicle_are_near)
{
    begin();
    frame_astern();
    scene.own_m = 2.9;
    CHECK_INT(turns(8, 40.0), FRAME_BEAMS);
    begin();
    frame_astern();
    scene.own_m = 3.1;
    CHECK_INT(turns(8, 40.0), 0);
}

TEST(an_echo_without_a_level_is_never_its_own)
{
    static const float level[] = {0.0f, INFINITY}; /* of a range that the sonar picked; saturated */
    for (int i = 0; i < 2; i++) {
        begin();
        frame_astern();
        scene.level = level[i];
        CHECK_INT(turns(20, 40.0), 0);
    }
    learn_frame();
    scene.level = INFINITY;
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, 0);
}

/* It is where the vehicle's own echo is, and another bearing has shown it. */
TEST(a_thing_in_the_water_at_the_same_place_is_not_marked)
{
    learn_frame();
    face(0.0);
    scene.pile_deg = 230.0;
    scene.pile_m = 0.75;
    turn();
    CHECK_INT(own_echo_known(&own), FRAME_BEAMS);
    face(50.0);
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, 0);
    CHECK_INT(own_echo_known(&own), FRAME_BEAMS);
    face(120.0);
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, ECHO_OWN);
}

TEST(what_is_not_heard_any_more_is_forgotten)
{
    learn_frame();
    look(180.0, 0.0, 0.0);
    look(180.0, 2.0, 0.0);
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, ECHO_OWN);
    look(180.0, 0.0, 0.0);
    look(180.0, 0.4, 0.0); /* it hides the frame */
    look(180.0, 0.0, 0.0);
    CHECK_INT(own_echo_known(&own), FRAME_BEAMS);
    scene.level = 3.0f * LEVEL; /* that is another echo */
    look(180.0, 0.7, 0.0);
    CHECK_INT(own_echo_known(&own), FRAME_BEAMS - 1);
    scene.level = LEVEL;
    CHECK_INT(look(180.0, 0.7, 0.0)->echo[0].flags, 0);
}

/* It fades in a turn or two, and whoever believed those would go through the frame's shadow. */
TEST(nothing_is_free_behind_what_is_missed_until_it_is_forgotten)
{
    learn_frame();
    for (int misses = 1; misses <= 3; misses++) {
        const struct beam_echoes *b = look(180.0, 0.0, 0.0);
        const float to_m = misses < 3 ? 0.68f : OPEN_M;
        CHECK_NEAR((double)b->free_to_m, (double)to_m, 0, 1e-3);
        CHECK_NEAR((double)b->side_to_m, (double)to_m, 0, 1e-3);
        CHECK_NEAR((double)b->heard_to_m, (double)to_m, 0, 1e-3);
        CHECK_NEAR((double)look(90.0, 0.0, 0.0)->free_to_m, (double)OPEN_M, 0, 1e-6);
    }
    CHECK_NEAR((double)look(170.0, 0.4, 0.0)->free_to_m, 0.38, 0, 1e-3); /* it hides the frame */
}

TEST(another_setting_begins_anew)
{
    learn_frame();
    bin_m = 0.05f;
    CHECK_INT(turns(1, 40.0), 0);
    CHECK_INT(own_echo_known(&own), 0);
}

/* Where the vehicle fills half of the turn its own parts look at each other's places: those at the ends come first. */
TEST(a_wide_part_is_learnt_from_its_ends)
{
    begin();
    scene.arc_deg[0] = 90.0;
    scene.arc_deg[1] = 270.0;
    scene.own_m = 0.7;
    CHECK(turns(10, 40.0) < 80);
    CHECK_INT(turns(90, 40.0), 101);
}

#define WALLS 4

/* A room of smooth walls around, seen only where they are nearly square to the beam, and piles, missed now and then. */
static struct room {
    double wall_m[WALLS], wall_deg[WALLS], shows_deg; /* from the middle, and which way */
    double pile_m[2][2], wide_m;
} room;

static void furnish(void)
{
    for (int k = 0; k < WALLS; k++) {
        room.wall_m[k] = 0.8 + 2.0 * test_uniform(&seed);
        room.wall_deg[k] = 360.0 / WALLS * (k + 0.6 * test_uniform(&seed));
    }
    room.shows_deg = 10.0 + 60.0 * test_uniform(&seed);
    for (int k = 0; k < 4; k++)
        room.pile_m[k / 2][k % 2] = 3.0 * test_uniform(&seed) - 1.5;
    room.wide_m = 0.05 + 0.2 * test_uniform(&seed);
}

/* Range of what a beam along the compass shows of the room; 0: nothing. */
static double in_room_m(double az_deg)
{
    const double c = cos(geo_rad(az_deg)), s = sin(geo_rad(az_deg));
    double at_m = INFINITY;
    for (int k = 0; k < WALLS; k++) {
        const double n[2] = {cos(geo_rad(room.wall_deg[k])), sin(geo_rad(room.wall_deg[k]))};
        const double toward = n[0] * c + n[1] * s;
        const double to_m =
            (room.wall_m[k] - n[0] * pose.position_m[0] - n[1] * pose.position_m[1]) / fmax(toward, 1e-9);
        if (toward > cos(geo_rad(room.shows_deg)))
            at_m = fmin(at_m, to_m);
    }
    for (int k = 0; k < 2; k++) {
        const double d[2] = {room.pile_m[k][0] - pose.position_m[0], room.pile_m[k][1] - pose.position_m[1]};
        const double along_m = d[0] * c + d[1] * s, aside_m = fabs(d[0] * s - d[1] * c);
        if (along_m > 0.0 && aside_m < room.wide_m)
            at_m = fmin(at_m, along_m);
    }
    return at_m > 0.3 && at_m < (double)OPEN_M ? at_m : 0.0;
}

TEST(nothing_in_the_water_is_ever_its_own)
{
    int marked = 0, shown = 0;
    begin();
    seed = test_seed();
    for (int n = 0; n < 60; n++) {
        begin();
        furnish();
        const double missed = 0.7 * test_uniform(&seed), by_deg = 90.0 * test_uniform(&seed),
                     by_m = 0.2 * test_uniform(&seed) * (n % 2);
        for (int i = 0; i < 60 * STEPS; i++) {
            const double az_deg = 360.0 * i / STEPS;
            face(heading_deg() + (2.0 * test_uniform(&seed) - 0.5) * by_deg / STEPS);
            for (int k = 0; k < 2; k++)
                pose.position_m[k] =
                    fmax(-0.5, fmin(0.5, pose.position_m[k] + (test_uniform(&seed) - 0.5) * by_m / 10));
            const double m = test_uniform(&seed) < missed ? 0.0 : in_room_m(az_deg + heading_deg());
            const struct beam_echoes *b = look(az_deg, m, 0.0);
            shown += b->n > 0 && m < 3.0;
            marked += b->n > 0 && (b->echo[0].flags & ECHO_OWN);
        }
    }
    CHECK(shown > 100000);
    CHECK_INT(marked, 0);
}

TEST(any_echoes_are_taken_and_only_their_marks_change)
{
    static struct beam_echoes many[64], before[64];
    begin();
    seed = test_seed();
    for (int k = 0; k < 3000; k++) {
        struct echoes ping = {.t_ns = test_random(&seed) % 3 ? t_ns += 1000000 : test_random(&seed),
                              .n_beams = (uint16_t)(test_random(&seed) % 64),
                              .bin_m = test_random(&seed) % 100 ? 0.05f : NAN,
                              .az_aperture_rad = (float)(8.0 * test_uniform(&seed) - 0.5),
                              .pose = pose,
                              .beam = many};
        face(360.0 * test_uniform(&seed));
        for (int b = 0; b < 64; b++) {
            many[b] = (struct beam_echoes){.az_rad = (float)(1e3 * (test_uniform(&seed) - 0.5)),
                                           .el_rad = (float)test_uniform(&seed),
                                           .heard_to_m = (float)(5.0 * test_uniform(&seed)),
                                           .state = (uint8_t)(test_random(&seed) % 3),
                                           .n = (uint8_t)(test_random(&seed) % (ECHOES_PER_BEAM + 1))};
            for (int i = 0; i < many[b].n; i++)
                many[b].echo[i] = (struct echo){.range_m = (float)(4.0 * test_uniform(&seed)),
                                                .near_m = (float)(4.0 * test_uniform(&seed)),
                                                .level = test_random(&seed) % 9 ? 1.0f : NAN};
        }
        memcpy(before, many, sizeof many);
        own_echo_run(&own, &ping, &mount);
        for (int b = 0; b < 64; b++)
            for (int i = 0; i < many[b].n; i++)
                many[b].echo[i].flags &= (uint8_t)~ECHO_OWN;
        CHECK(memcmp(before, many, sizeof many) == 0);
    }
}

int main(void)
{
    RUN(a_part_of_the_vehicle_is_its_own_once_the_vehicle_has_turned);
    RUN(beside_a_vehicle_that_stands_still_nothing_is_learnt);
    RUN(without_a_pose_nothing_is_learnt_or_marked);
    RUN(a_wall_that_the_vehicle_follows_is_not_its_own);
    RUN(a_round_tank_around_a_turning_vehicle_is_not_its_own);
    RUN(a_pile_that_a_deaf_bearing_does_not_show_is_not_the_vehicles_own);
    RUN(a_pile_that_the_vehicle_goes_round_is_not_its_own_though_its_place_is_rough);
    RUN(an_uncertain_pose_proves_nothing);
    RUN(proofs_begin_anew_where_another_bearing_shows_it);
    RUN(what_could_not_show_it_proves_nothing);
    RUN(proofs_are_of_different_directions_and_times);
    RUN(what_is_missed_once_before_it_is_known_begins_anew);
    RUN(blind_beams_change_nothing);
    RUN(the_head_is_where_it_is_mounted);
    RUN(what_is_nearer_louder_or_behind_is_as_before);
    RUN(its_level_is_the_loudest_of_the_proofs);
    RUN(parts_of_the_vehicle_are_near);
    RUN(an_echo_without_a_level_is_never_its_own);
    RUN(a_thing_in_the_water_at_the_same_place_is_not_marked);
    RUN(what_is_not_heard_any_more_is_forgotten);
    RUN(nothing_is_free_behind_what_is_missed_until_it_is_forgotten);
    RUN(another_setting_begins_anew);
    RUN(a_wide_part_is_learnt_from_its_ends);
    RUN(nothing_in_the_water_is_ever_its_own);
    RUN(any_echoes_are_taken_and_only_their_marks_change);
    return test_end();
}
