/* SPDX-License-Identifier: MIT */
/* Which barometer is in the water: by what it reads, by the altitude that it follows, by its name; and what is said. */
#include <math.h>
#include <string.h>

#include "client/mavlink/mavlink_vehicle.h"
#include "tests/lib/test.h"

#define MS    1000000ull
#define S     1000000000ull
#define START (1000 * S)

#define M_PER_HPA (100 / (1025 * 9.80665))
#define AIR_HPA   1013.25

/* ---- bytes in, depths out ---- */

/*
 * Of an autopilot that was not ours: heartbeat, attitude and three pressures, 1013, 1016 and 1600 hPa, when it has been
 * up for 100 s, and for 101.1 s.
 */
static const char *const telemetry[2][5] = {
    {"FD 09 00 00 01 01 01 00 00 00 00 00 00 00 0C 03 51 04 03 55 A9",
     "FD 10 00 00 02 01 01 1E 00 00 A0 86 01 00 00 00 00 00 00 00 00 00 00 00 80 3F 52 AC",
     "FD 0E 00 00 03 01 01 1D 00 00 A0 86 01 00 00 40 7D 44 00 00 00 00 D0 07 BE EA",
     "FD 0E 00 00 04 01 01 89 00 00 A0 86 01 00 00 00 7E 44 00 00 00 00 D0 07 62 DD",
     "FD 0E 00 00 05 01 01 8F 00 00 A0 86 01 00 00 00 C8 44 00 00 00 00 D0 07 1F C2"},
    {"FD 09 00 00 06 01 01 00 00 00 00 00 00 00 0C 03 51 04 03 16 1B",
     "FD 10 00 00 07 01 01 1E 00 00 EC 8A 01 00 00 00 00 00 00 00 00 00 00 00 80 3F FB 89",
     "FD 0E 00 00 08 01 01 1D 00 00 EC 8A 01 00 00 40 7D 44 00 00 00 00 D0 07 D8 FE",
     "FD 0E 00 00 09 01 01 89 00 00 EC 8A 01 00 00 00 7E 44 00 00 00 00 D0 07 6C 7A",
     "FD 0E 00 00 0A 01 01 8F 00 00 EC 8A 01 00 00 00 C8 44 00 00 00 00 D0 07 C9 0B"}};

static void hear(struct mavlink_vehicle *vehicle, struct mavlink_parser *parser, const char *hex, uint64_t now_ns)
{
    uint8_t bytes[MAVLINK_FRAME_MAX];
    const uint8_t *at = bytes;
    size_t n = 0;
    unsigned byte;
    int used;
    struct mavlink_frame frame;
    for (; sscanf(hex, " %2x%n", &byte, &used) == 1; hex += used)
        bytes[n++] = (uint8_t)byte;
    CHECK(mavlink_parser_next(parser, &at, &n, &frame) && mavlink_vehicle_take(vehicle, &frame, now_ns));
}

/* The depth that the telemetry gives at last; NAN: none. */
static double depth_of_telemetry(int barometer, struct mavlink_vehicle *vehicle)
{
    const struct mavlink_vehicle_conf conf = {
        .barometer = barometer, .surface_hpa = AIR_HPA, .density_kgpm3 = 1025};
    struct mavlink_parser parser = {0};
    struct mavlink_pose pose = {0};
    mavlink_vehicle_init(vehicle, &conf);
    for (int i = 0; i < 5; i++)
        hear(vehicle, &parser, telemetry[0][i], START);
    mavlink_vehicle_pose(vehicle, START, &pose);
    CHECK_INT(pose.has & MAVLINK_POSE_DEPTH, barometer ? MAVLINK_POSE_DEPTH : 0); /* too soon to know */
    for (int i = 0; i < 5; i++)
        hear(vehicle, &parser, telemetry[1][i], START + 1100 * MS);
    hear(vehicle, &parser, telemetry[1][1], START + 1120 * MS);
    CHECK(mavlink_vehicle_pose(vehicle, START + 1120 * MS, &pose));
    return pose.has & MAVLINK_POSE_DEPTH ? pose.depth_m : NAN;
}

TEST(depth_is_that_of_the_barometer_in_the_water)
{
    struct mavlink_vehicle vehicle;
    char text[400];
    CHECK_NEAR(depth_of_telemetry(MAVLINK_BAROMETER_ANY, &vehicle), 5.837, 1e-3, 0);
    CHECK(!mavlink_vehicle_depth_doubtful(&vehicle, START + 2 * S));
    CHECK(mavlink_vehicle_depth_news(&vehicle, START + 2 * S, text, sizeof text));
    CHECK_STR(text, "depth from SCALED_PRESSURE3 (1600 hPa), which reads more than a hull holds");
    CHECK(!mavlink_vehicle_depth_news(&vehicle, START + 4 * S, text, sizeof text));

    CHECK_NEAR(depth_of_telemetry(3, &vehicle), 5.837, 1e-3, 0);
    CHECK(mavlink_vehicle_depth_news(&vehicle, START + 2 * S, text, sizeof text));
    CHECK_STR(text, "depth from SCALED_PRESSURE3 (1600 hPa), as --barometer says");
}

TEST(a_barometer_that_is_named_wrongly_is_used_with_a_warning)
{
    struct mavlink_vehicle vehicle;
    char text[400];
    CHECK_NEAR(depth_of_telemetry(2, &vehicle), 0.027, 0, 1e-3);
    CHECK_INT(mavlink_barometers_depth(&vehicle.barometers), 2);
    CHECK(mavlink_vehicle_depth_doubtful(&vehicle, START + 2 * S));
    CHECK(mavlink_vehicle_depth_news(&vehicle, START + 2 * S, text, sizeof text));
    CHECK(mavlink_vehicle_depth_news(&vehicle, START + 2 * S, text, sizeof text));
    CHECK_STR(text,
              "warning: barometers disagree: SCALED_PRESSURE2 (1016 hPa) and SCALED_PRESSURE3 (1600 hPa) are "
              "both in the water; is --barometer right?");
    CHECK(!mavlink_vehicle_depth_news(&vehicle, START + 4 * S, text, sizeof text));
}

/* ---- what the readings show ---- */

static struct mavlink_barometers barometers;
static uint64_t now_ns;

static void begin(int named)
{
    mavlink_barometers_init(&barometers, named, M_PER_HPA);
    now_ns = START;
}

/* For so long, five times a second, each moving evenly to this reading; 0: it says nothing. */
static void read_for(uint64_t ns, double hpa_1, double hpa_2, double hpa_3)
{
    const double to[MAVLINK_BAROMETERS] = {hpa_1, hpa_2, hpa_3};
    const unsigned n = (unsigned)(ns / (200 * MS));
    double from[MAVLINK_BAROMETERS];
    for (int i = 0; i < MAVLINK_BAROMETERS; i++)
        from[i] = barometers.of[i].t_ns ? barometers.of[i].hpa : to[i];
    for (unsigned k = 1; k <= n; k++) {
        now_ns += 200 * MS;
        for (int i = 0; i < MAVLINK_BAROMETERS; i++)
            if (to[i] > 0)
                mavlink_barometers_pressure(&barometers, i + 1, from[i] + (to[i] - from[i]) * k / n, now_ns);
    }
}

/* The vehicle sinks by 2.4 m in `ns`, as its altitude says; the barometers change by these. */
static void sink(enum mavlink_altitude from, uint64_t ns, const double change_hpa[MAVLINK_BAROMETERS])
{
    double start_hpa[MAVLINK_BAROMETERS];
    for (int i = 0; i < MAVLINK_BAROMETERS; i++)
        start_hpa[i] = barometers.of[i].hpa;
    for (unsigned k = 0; k <= 48; k++, now_ns += ns / 48) {
        for (int i = 0; i < MAVLINK_BAROMETERS; i++)
            if (start_hpa[i] > 0)
                mavlink_barometers_pressure(&barometers, i + 1, start_hpa[i] + change_hpa[i] * k / 48, now_ns);
        mavlink_barometers_altitude(&barometers, from, 3.7 - 0.05 * k, now_ns);
    }
}

TEST(at_the_surface_there_is_no_depth)
{
    char text[400];
    begin(MAVLINK_BAROMETER_ANY);
    read_for(5 * S, 1013, 1016, 1014);
    CHECK(!mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    read_for(300 * S, 1030, 1016, 1014); /* the hull heats up, as in a recording */
    CHECK_INT(mavlink_barometers_depth(&barometers), MAVLINK_BAROMETER_ANY);
    CHECK(mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    CHECK_STR(text,
              "no depth: it is not known which barometer is in the water until one follows the altitude or is "
              "3 m deep; --barometer 2 names SCALED_PRESSURE2; received: SCALED_PRESSURE (1030 hPa), "
              "SCALED_PRESSURE2 (1016 hPa), SCALED_PRESSURE3 (1014 hPa)");
    CHECK(!mavlink_barometers_news(&barometers, now_ns + 100 * S, text, sizeof text));
}

TEST(a_barometer_that_is_named_and_silent_is_told)
{
    char text[400];
    begin(3);
    read_for(12 * S, 1013, 1600, 0);
    CHECK_INT(barometers.used, 3);
    CHECK(mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    CHECK(strstr(text, "named by --barometer sends nothing") && strstr(text, "SCALED_PRESSURE2 (1600 hPa)"));
    read_for(S, 1013, 1600, 1600);
    CHECK(mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    CHECK(strstr(text, "depth from SCALED_PRESSURE3"));
}

TEST(what_no_hull_holds_is_water)
{
    static const struct {
        const char *name;
        double hpa[MAVLINK_BAROMETERS];
        uint64_t ns;
        int used;
    } rows[] = {
        {"the second", {1013, 1600, 0}, 2 * S, 2},
        {"the third", {1013, 1016, 1600}, 2 * S, 3},
        {"one alone", {0, 1400, 0}, 2 * S, 2},
        {"the first, which is often in the hull", {1600, 0, 0}, 2 * S, 1},
        {"shallow", {1013, 1290, 0}, 60 * S, MAVLINK_BAROMETER_ANY},
        {"for a moment only", {1013, 1016, 5000}, 600 * MS, MAVLINK_BAROMETER_ANY},
        {"two that agree", {1013, 1600, 1650}, 2 * S, 2},
        {"two that do not", {1013, 1600, 2000}, 2 * S, MAVLINK_BAROMETER_ANY},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        begin(MAVLINK_BAROMETER_ANY);
        read_for(rows[i].ns, rows[i].hpa[0], rows[i].hpa[1], rows[i].hpa[2]);
        if (mavlink_barometers_depth(&barometers) != rows[i].used)
            printf("# %s\n", rows[i].name);
        CHECK_INT(mavlink_barometers_depth(&barometers), rows[i].used);
    }
}

TEST(single_high_readings_are_not_added_up)
{
    begin(MAVLINK_BAROMETER_ANY);
    for (int i = 0; i < 20; i++) {
        read_for(200 * MS, 1013, 0, 0);
        mavlink_barometers_pressure(&barometers, 1, 5000, now_ns);
        mavlink_barometers_pressure(&barometers, 2, 5000, now_ns); /* once in ten seconds: what was in between? */
        now_ns += 10 * S;
    }
    CHECK_INT(mavlink_barometers_depth(&barometers), MAVLINK_BAROMETER_ANY);
}

TEST(the_one_that_was_in_the_water_stays_the_one_at_the_surface)
{
    begin(MAVLINK_BAROMETER_ANY);
    read_for(2 * S, 1013, 1016, 1600);
    read_for(60 * S, 1020, 1016, 1014);
    CHECK_INT(mavlink_barometers_depth(&barometers), 3);
}

TEST(the_one_that_follows_the_altitude_is_in_the_water)
{
    static const double water = 2.4 / M_PER_HPA;
    static const struct {
        const char *name;
        uint64_t ns;
        double change_hpa[MAVLINK_BAROMETERS];
        int used;
    } rows[] = {
        {"the third follows", 20 * S, {2, -1, water}, 3},
        {"in fresh water, by an autopilot that does not know", 20 * S, {2, 0.975 * water, 0}, 2},
        {"two follow", 20 * S, {2, water, 1.02 * water}, 2},
        {"none follows", 20 * S, {2, -1, 0}, MAVLINK_BAROMETER_ANY},
        {"half as much", 20 * S, {2, 0.5 * water, 0}, MAVLINK_BAROMETER_ANY},
        {"a hull that is pumped empty", 20 * S, {-2.0 * water, 0, 0}, MAVLINK_BAROMETER_ANY},
        {"so slowly that a hull may have heated up", 400 * S, {water, 0, 0}, MAVLINK_BAROMETER_ANY},
    };

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (int from = 0; from < MAVLINK_ALTITUDES; from++) {
            begin(MAVLINK_BAROMETER_ANY);
            read_for(S, 1013, 1016, 1014);
            sink((enum mavlink_altitude)from, rows[i].ns, rows[i].change_hpa);
            if (mavlink_barometers_depth(&barometers) != rows[i].used)
                printf("# %s\n", rows[i].name);
            CHECK_INT(mavlink_barometers_depth(&barometers), rows[i].used);
        }

    char text[400];

    begin(MAVLINK_BAROMETER_ANY);
    read_for(S, 1013, 1016, 1014);
    sink(MAVLINK_ALTITUDE_VFR_HUD, 20 * S, rows[0].change_hpa);
    CHECK(mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    CHECK(strstr(text, "depth from SCALED_PRESSURE3") && strstr(text, "follows the altitude"));
}

TEST(to_follow_once_is_chance)
{
    begin(MAVLINK_BAROMETER_ANY);
    for (int i = 0; i < 6; i++) { /* down with a wrong reading, up without */
        read_for(S, 1013, 1016, 0);
        mavlink_barometers_altitude(&barometers, MAVLINK_ALTITUDE_VFR_HUD, 0, now_ns);
        read_for(S, 1013 + 1.5 / M_PER_HPA, 1016, 0);
        mavlink_barometers_altitude(&barometers, MAVLINK_ALTITUDE_VFR_HUD, -1.5, now_ns);
        read_for(S, 1013 + 1.5 / M_PER_HPA, 1016, 0);
        mavlink_barometers_altitude(&barometers, MAVLINK_ALTITUDE_VFR_HUD, -3.0, now_ns);
    }
    CHECK_INT(mavlink_barometers_depth(&barometers), MAVLINK_BAROMETER_ANY);
}

TEST(an_altitude_that_jumps_is_followed_by_none)
{
    begin(MAVLINK_BAROMETER_ANY);
    for (int i = 0; i < 30; i++) {
        read_for(S, 1013, 1016, 0);
        mavlink_barometers_altitude(&barometers, MAVLINK_ALTITUDE_GLOBAL_POSITION, i % 2 ? 250.0 : -3.0, now_ns);
        mavlink_barometers_altitude(&barometers, MAVLINK_ALTITUDE_VFR_HUD, i % 3 ? NAN : 1.0 * i, now_ns);
    }
    CHECK_INT(mavlink_barometers_depth(&barometers), MAVLINK_BAROMETER_ANY);
}

TEST(two_in_the_water_that_disagree_are_a_warning_and_no_depth)
{
    char text[400];
    begin(MAVLINK_BAROMETER_ANY);
    read_for(3 * S, 1013, 1600, 1610);
    CHECK_INT(mavlink_barometers_depth(&barometers), 2);
    CHECK(mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    read_for(3 * S, 1013, 1600, 2000);
    CHECK_INT(mavlink_barometers_depth(&barometers), MAVLINK_BAROMETER_ANY);
    CHECK(mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    CHECK_STR(text,
              "warning: barometers disagree: SCALED_PRESSURE2 (1600 hPa) and SCALED_PRESSURE3 (2000 hPa) are "
              "both in the water; no depth until they agree; --barometer N says which is right");
    CHECK(!mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    read_for(3 * S, 1013, 2000, 2000);
    CHECK_INT(mavlink_barometers_depth(&barometers), 2);
    read_for(3 * S, 1013, 2000, 3000);
    CHECK_INT(mavlink_barometers_depth(&barometers), MAVLINK_BAROMETER_ANY);
    read_for(5 * S, 1013, 2000, 0); /* the other has gone, and says nothing any more */
    CHECK_INT(mavlink_barometers_depth(&barometers), 2);
}

TEST(another_vehicle_begins_anew_but_the_surface_stays)
{
    begin(MAVLINK_BAROMETER_ANY);
    read_for(S, 1013, 1021, 0);
    read_for(5 * S, 1013, 1600, 0);
    CHECK_INT(mavlink_barometers_depth(&barometers), 2);
    mavlink_barometers_forget(&barometers);
    read_for(400 * MS, 1013, 1600, 0);
    CHECK_INT(mavlink_barometers_depth(&barometers), MAVLINK_BAROMETER_ANY);
    read_for(2 * S, 1013, 1600, 0);
    CHECK_INT(mavlink_barometers_depth(&barometers), 2);
    CHECK_NEAR(barometers.of[1].first_hpa, 1021, 0, 0);
}

/* The last that was said up to now, "" for nothing; the readings go on 5 times a second. */
static const char *said_while(uint64_t ns, double hpa_1, double hpa_2, double hpa_3)
{
    static char text[400];
    char news[sizeof text];
    text[0] = '\0';
    for (uint64_t i = 0; i < ns / S; i++) {
        read_for(S, hpa_1, hpa_2, hpa_3);
        while (mavlink_barometers_news(&barometers, now_ns, news, sizeof news))
            memcpy(text, news, sizeof text);
    }
    return text;
}

TEST(one_that_has_died_is_given_up)
{
    static const char ended[] =
        "warning: SCALED_PRESSURE2 (1600 hPa), which gave the depth, is silent: no depth until it "
        "or another in the water reads";

    begin(MAVLINK_BAROMETER_ANY);
    CHECK_STR(said_while(3 * S, 1013, 1600, 0),
              "depth from SCALED_PRESSURE2 (1600 hPa), which reads more than a hull holds");
    CHECK_STR(said_while(5 * S, 1013, 0, 0), "");
    CHECK_INT(mavlink_barometers_depth(&barometers),
              2); /* a pause is no end; without a reading no depth comes of it */
    CHECK_STR(said_while(60 * S, 1013, 0, 0), ended);
    CHECK_INT(mavlink_barometers_depth(&barometers), MAVLINK_BAROMETER_ANY); /* and not of the hull */
    CHECK_STR(said_while(60 * S, 1013, 0, 1610),
              "depth from SCALED_PRESSURE3 (1610 hPa), which reads more than a hull holds");
    CHECK_INT(mavlink_barometers_depth(&barometers), 3);
    CHECK_STR(said_while(60 * S, 1013, 1600, 1610), ""); /* back, and not wanted */
    CHECK_INT(mavlink_barometers_depth(&barometers), 3);
}

TEST(another_in_the_water_takes_the_place_of_one_that_has_died)
{
    begin(MAVLINK_BAROMETER_ANY);
    said_while(3 * S, 1013, 1600, 1610);
    CHECK_INT(mavlink_barometers_depth(&barometers), 2);
    CHECK_STR(said_while(10 * S, 1013, 0, 1610),
              "depth from SCALED_PRESSURE3 (1610 hPa), which reads more than a hull holds");
    CHECK_INT(mavlink_barometers_depth(&barometers), 3);
}

TEST(one_that_has_died_and_comes_back_is_used_again)
{
    begin(MAVLINK_BAROMETER_ANY);
    said_while(3 * S, 1013, 1600, 0);
    CHECK(strstr(said_while(10 * S, 0, 0, 0), "is silent")); /* nothing else comes either */
    CHECK_STR(said_while(3 * S, 1013, 1600, 0),
              "depth from SCALED_PRESSURE2 (1600 hPa), which reads more than a hull holds");
    CHECK_INT(mavlink_barometers_depth(&barometers), 2);
}

TEST(one_that_is_named_and_has_died_is_waited_for)
{
    begin(2);
    CHECK_STR(
        said_while(3 * S, 1013, 1016, 1600),
        "warning: barometers disagree: SCALED_PRESSURE2 (1016 hPa) and SCALED_PRESSURE3 (1600 hPa) are both in "
        "the water; is --barometer right?");
    CHECK_STR(
        said_while(60 * S, 1013, 0, 1600),
        "warning: SCALED_PRESSURE2 (1016 hPa), which gave the depth, is silent: no depth until it reads again");
    CHECK_INT(mavlink_barometers_depth(&barometers), 2);
    CHECK_STR(said_while(3 * S, 1013, 1016, 0), "depth from SCALED_PRESSURE2 (1016 hPa), as --barometer says");
}

/* --surface-pressure first, of a vehicle that is under water when the bridge starts: its depth would be wrong. */
TEST(a_first_reading_that_is_no_air_is_no_surface)
{
    static const struct {
        double first_hpa;
        bool depth;
    } rows[] = {{1013, true}, {600, true}, {1100, true}, {1101, false}, {1600, false}, {299, false}};

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const struct mavlink_vehicle_conf conf = {.barometer = 2, .density_kgpm3 = 1025};
        struct mavlink_vehicle vehicle;
        struct mavlink_parser parser = {0};
        struct mavlink_pose pose = {0};
        char text[400];
        mavlink_vehicle_init(&vehicle, &conf);
        mavlink_barometers_pressure(&vehicle.barometers, 2, rows[i].first_hpa, START);
        for (int k = 0; k < 5; k++)
            hear(&vehicle, &parser, telemetry[0][k], START + S); /* 1016 hPa */
        mavlink_vehicle_pose(&vehicle, START + S, &pose);
        CHECK_INT(pose.has & MAVLINK_POSE_DEPTH, rows[i].depth ? MAVLINK_POSE_DEPTH : 0);
        CHECK(mavlink_vehicle_depth_news(&vehicle, START + S, text, sizeof text));
        CHECK_INT(
            strstr(text, "is no air pressure; start the bridge at the surface, or give --surface-pressure") !=
                NULL,
            !rows[i].depth);
        for (int k = 0; k < 2 && mavlink_vehicle_depth_news(&vehicle, START + S, text, sizeof text); k++)
            CHECK(!strstr(text, "is no air pressure"));
    }
}

/* ArduSub sets BARO_PRIMARY to its depth sensor: 1 on a stock BlueROV2, 2 on a board with two of its own, 0 without. */
TEST(the_autopilot_says_which_is_its_depth_sensor)
{
    static const struct {
        int primary;
        double hpa[MAVLINK_BAROMETERS];
        int used;
    } rows[] = {
        {1, {1013, 1030, 0}, 2},
        {2, {1013, 1013, 1030}, 3},
        {1, {1013, 0, 0}, MAVLINK_BAROMETER_ANY}, /* it sends nothing: the hull's does not take its place */
        {0, {1013, 1030, 0}, MAVLINK_BAROMETER_ANY},
        {3, {1013, 1030, 0}, MAVLINK_BAROMETER_ANY},
        {-1, {1013, 1030, 0}, MAVLINK_BAROMETER_ANY},
        {1, {1013, 1030, 1600}, MAVLINK_BAROMETER_ANY}, /* another in the water reads something else */
    };
    char text[400];

    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        begin(MAVLINK_BAROMETER_ANY);
        mavlink_barometers_primary(&barometers, rows[i].primary);
        read_for(3 * S, rows[i].hpa[0], rows[i].hpa[1], rows[i].hpa[2]);
        CHECK_INT(mavlink_barometers_depth(&barometers), rows[i].used);
    }
    begin(MAVLINK_BAROMETER_ANY);
    read_for(S, 1013, 1016, 1016);
    mavlink_barometers_primary(&barometers, 1);
    read_for(S, 1013, 1030, 1016);
    CHECK_INT(mavlink_barometers_depth(&barometers), 2);
    CHECK(mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    CHECK_STR(text, "depth from SCALED_PRESSURE2 (1030 hPa), the autopilot's depth sensor by BARO_PRIMARY");
    mavlink_barometers_primary(&barometers, 2); /* it has started anew, and found another */
    read_for(S, 1013, 1030, 1030);
    CHECK_INT(mavlink_barometers_depth(&barometers), 3);
    mavlink_barometers_unsay(&barometers);
    read_for(S, 1013, 1030, 1030);
    CHECK_INT(mavlink_barometers_depth(&barometers), MAVLINK_BAROMETER_ANY);
    begin(MAVLINK_BAROMETER_ANY);
    mavlink_barometers_primary(&barometers, 2);
    read_for(12 * S, 1013, 1016, 0);
    CHECK(mavlink_barometers_news(&barometers, now_ns, text, sizeof text));
    CHECK_STR(text,
              "no depth: the autopilot's depth sensor by BARO_PRIMARY sends nothing; received: SCALED_PRESSURE "
              "(1013 hPa), SCALED_PRESSURE2 (1016 hPa)");
    begin(1); /* the user knows better */
    mavlink_barometers_primary(&barometers, 1);
    read_for(S, 1013, 1030, 0);
    CHECK_INT(mavlink_barometers_depth(&barometers), 1);
}

/* By both names until it answers, then now and then; not for what the user has named. */
TEST(the_autopilot_is_asked_for_its_depth_sensor)
{
    int asked = 0;
    begin(2);
    CHECK(!mavlink_barometers_ask(&barometers));
    begin(MAVLINK_BAROMETER_ANY);
    CHECK_STR(mavlink_barometers_ask(&barometers), "BARO_PRIMARY");
    CHECK_STR(mavlink_barometers_ask(&barometers), "GND_PRIMARY");
    CHECK_STR(mavlink_barometers_ask(&barometers), "BARO_PRIMARY");
    CHECK(mavlink_barometers_is_primary("GND_PRIMARY") && !mavlink_barometers_is_primary("BARO_PRIMAR"));
    mavlink_barometers_primary(&barometers, 0);
    for (int i = 0; i < 600; i++)
        asked += mavlink_barometers_ask(&barometers) != NULL;
    CHECK_INT(asked, 20);
    mavlink_barometers_unsay(&barometers);
    CHECK(mavlink_barometers_ask(&barometers));
}

int main(void)
{
    RUN(depth_is_that_of_the_barometer_in_the_water);
    RUN(a_barometer_that_is_named_wrongly_is_used_with_a_warning);
    RUN(at_the_surface_there_is_no_depth);
    RUN(a_barometer_that_is_named_and_silent_is_told);
    RUN(what_no_hull_holds_is_water);
    RUN(single_high_readings_are_not_added_up);
    RUN(the_one_that_was_in_the_water_stays_the_one_at_the_surface);
    RUN(the_one_that_follows_the_altitude_is_in_the_water);
    RUN(to_follow_once_is_chance);
    RUN(an_altitude_that_jumps_is_followed_by_none);
    RUN(two_in_the_water_that_disagree_are_a_warning_and_no_depth);
    RUN(another_vehicle_begins_anew_but_the_surface_stays);
    RUN(one_that_has_died_is_given_up);
    RUN(another_in_the_water_takes_the_place_of_one_that_has_died);
    RUN(one_that_has_died_and_comes_back_is_used_again);
    RUN(one_that_is_named_and_has_died_is_waited_for);
    RUN(a_first_reading_that_is_no_air_is_no_surface);
    RUN(the_autopilot_says_which_is_its_depth_sensor);
    RUN(the_autopilot_is_asked_for_its_depth_sensor);
    return test_end();
}
