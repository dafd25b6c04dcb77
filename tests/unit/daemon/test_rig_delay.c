/* SPDX-License-Identifier: MIT */
/*
 * test_rig_delay - a vehicle drives at a wall with an echosounder that smooths, so that its readings come late: nothing
 * beyond the wall is free, and the water before it still is; likewise while it turns. A capture of it gives the same
 * answers.
 */
#include "tests/lib/rig.h"

#include <dirent.h>

#define OPEN     "box -50 50 -50 50 -50 50\n" /* the scene of the rig's own head, which is not used */
#define WALL_M   12.0
#define GO_MPS   1.0
#define EVERY_NS (RIG_S / 10)
#define KEPT     4000
#define SMOOTHED "delay = 0.4 0.4 s\n"
#define WORLD    "[vehicle]\nmax_speed = 1.2 m/s\nmax_turn = 30 deg/s\nnear = 2 m\n[grid]\nrange = 15 m\n"

static double north_then_m[KEPT], yaw_then_deg[KEPT]; /* of every step of the clock */
static size_t steps;
static double late_s;
static uint64_t next_ns;

#define HALF_BEAM_DEG 15.0

#define PLATE_M        6.0
#define PLATE_HALF_DEG 20.0
static bool plate; /* before the wall, of which it hides so much */

static double heard_m(double north_m, double yaw_deg)
{
    const double off_deg = fabs(geo_deg(geo_wrap_pi(geo_rad(yaw_deg))));
    return plate && off_deg < PLATE_HALF_DEG + HALF_BEAM_DEG ? PLATE_M : WALL_M - north_m;
}

static void sounder_start(uint64_t now_ns)
{
    next_ns = now_ns;
    steps = 0;
}

static void sounder_turn(uint64_t now_ns)
{
    struct line *line = &rig.sim.line;
    char text[64];
    const size_t late = (size_t)(late_s * 1e9 / RIG_STEP_NS);
    yaw_then_deg[steps % KEPT] = rig.sim.pose.yaw_deg;
    north_then_m[steps++ % KEPT] = rig.north_m;
    if (now_ns >= next_ns && steps > late) {
        const size_t then = (steps - 1 - late) % KEPT;
        const double range_m = heard_m(north_then_m[then], yaw_then_deg[then]);
        unsigned sum = 0;
        int n = snprintf(text, sizeof text, "$SDDPT,%.2f,0.0", range_m);
        for (int i = 1; i < n; i++)
            sum ^= (unsigned char)text[i];
        n += snprintf(text + n, sizeof text - (size_t)n, "*%02X\r\n", sum);
        line_send(line, (const uint8_t *)text, (size_t)n, now_ns);
        next_ns = now_ns + EVERY_NS;
    }
    line_pump(line, now_ns);
}

static const struct rig_far sounder = {"nmea0183", sounder_start, sounder_turn};

static double free_at_m(int az_deg, double *age_s)
{
    json_t *reply = rig_ask("blocked", "\"azimuth_deg\":%d,\"frame\":\"ned\",\"distance_m\":%g,\"radius_m\":0.05",
                            az_deg, WALL_M);
    const json_t *to = json_object_get(reply, "free_to_m");
    const double m = json_is_number(to) ? json_number_value(to) : 0;
    if (age_s)
        *age_s = json_number_value(json_object_get(reply, "age_s"));
    json_decref(reply);
    return m;
}

static double free_to_m(double *age_s)
{
    return free_at_m(0, age_s);
}

/* The most that anything was free beyond the wall, and the least that was not free before it, on the way. */
static void drive(const char *conf, double *beyond_m, double *before_m)
{
    *beyond_m = -INFINITY;
    *before_m = 0;
    rig_start(OPEN, conf);
    rig.pose_every_ns = RIG_S / 20;
    rig_run(3);
    rig.north_mps = GO_MPS;
    for (int i = 0; i < 80; i++) {
        rig_run(0.1);
        const double over_m = free_to_m(NULL) - (WALL_M - rig.north_m);

        *beyond_m = fmax(*beyond_m, over_m);
        if (i > 10)
            *before_m = fmax(*before_m, -over_m);
    }
    rig.north_mps = 0;
}

TEST(nothing_is_free_beyond_a_wall_for_a_reading_that_comes_late)
{
    double beyond_m, before_m;
    rig_far = &sounder;
    for (late_s = 0; late_s < 0.85; late_s += 0.2) {
        drive(SMOOTHED WORLD, &beyond_m, &before_m);
        CHECK(beyond_m <= 0);
        CHECK(before_m <
              1.3); /* 0.8 m within which nobody knows, and what poses, cells and the range are off by */
        rig_end();
    }
    late_s = 0.8; /* were it not known: the fault that the key is for */
    drive("delay = 0 0 s\n" WORLD, &beyond_m, &before_m);
    CHECK(beyond_m > 0.5);
    rig_end();
    drive("delay = 0.8 0 s\n" WORLD, &beyond_m, &before_m); /* and known exactly */
    CHECK(beyond_m <= 0.05);
    CHECK(before_m < 0.6);
    rig_end();
}

/* The most that anything is free beyond the plate, while the vehicle turns past it and back. */
static double beyond_when_turning_m(const char *conf)
{
    double beyond_m = -INFINITY;
    rig_start(OPEN, conf);
    rig.pose_every_ns = RIG_S / 20;
    rig.sim.pose.yaw_deg = -70;
    rig_run(2);
    for (int i = 0; i < 110; i++) {
        rig.turn_dps = i < 55 ? 25 : -25;
        rig_run(0.1);
        for (int az_deg = -19; az_deg <= 19; az_deg += 2)
            beyond_m = fmax(beyond_m, free_at_m(az_deg, NULL) - PLATE_M);
    }
    rig.turn_dps = 0;
    rig_end();
    return beyond_m;
}

TEST(nothing_is_free_beyond_a_plate_while_a_late_sounder_turns)
{
    rig_far = &sounder;
    plate = true;
    for (late_s = 0; late_s < 0.85; late_s += 0.4)
        CHECK(beyond_when_turning_m(SMOOTHED WORLD) <= 0);
    late_s = 0.8;
    CHECK(beyond_when_turning_m("delay = 0 0 s\n" WORLD) > 1);
    const double known_m = beyond_when_turning_m("delay = 0.8 0 s\n" WORLD);
    CHECK(known_m <= 0 && known_m > -0.5);
    plate = false;
}

TEST(poses_that_come_late_are_dated_back_as_well)
{
    late_s = 0;
    rig_far = &sounder;
    rig_start(OPEN, "delay = 0 0 s\n" WORLD "[pose]\ndelay = 0.3 0.1 s\n");
    rig.pose_every_ns = RIG_S / 20;
    rig_run(1);
    CHECK(rig_now_ns - rig.d.poses.t_newest_ns >= 3 * RIG_S / 10);
    CHECK(rig_now_ns - rig.d.poses.t_newest_ns < 4 * RIG_S / 10);
    rig_end();
}

/* Standing still, only its age tells that a reading was dated back. */
TEST(a_reading_is_as_old_as_its_delay)
{
    double age_s;
    late_s = 0.4;
    rig_far = &sounder;
    rig_start(OPEN, SMOOTHED WORLD);
    rig.pose_every_ns = RIG_S / 20;
    rig_run(5);
    CHECK(free_to_m(&age_s) > 11);
    CHECK(age_s >= 0.4);
    rig_end();
    rig_start(OPEN, "delay = 0 0 s\n" WORLD);
    rig.pose_every_ns = RIG_S / 20;
    rig_run(5);
    CHECK(free_to_m(&age_s) > 11);
    CHECK(age_s < 0.2);
    rig_end();
}

static void find_capture(const char *folder, char path[300])
{
    DIR *d = opendir(folder);
    for (const struct dirent *e; d && (e = readdir(d));)
        if (strstr(e->d_name, ".mcap"))
            snprintf(path, 300, "%s/%s", folder, e->d_name);
    if (d)
        closedir(d);
}

/* Ranges where something is, and where water is free, of all sectors. */
static void put_sectors(char text[8192])
{
    json_t *reply = rig_ask("sectors", "\"distance_m\":0,\"frame\":\"ned\""), *s;
    size_t i, n = 0;
    json_array_foreach(json_object_get(reply, "sectors"), i, s) n +=
        (size_t)snprintf(text + n, 8192 - n, "%.4f %.4f;", json_number_value(json_object_get(s, "range_m")),
                         json_number_value(json_object_get(s, "free_to_m")));
    json_decref(reply);
}

/* The same answers with the configuration that it was made with, and others with another. */
TEST(a_replay_dates_back_as_its_configuration_says)
{
    static const char conf[] = SMOOTHED WORLD "[pose]\ndelay = 0.2 0.05 s\n";
    char folder[] = "/tmp/sonard-rig-XXXXXX", path[300] = "", live[8192] = "", again[8192] = "", other[8192] = "";
    CHECK(mkdtemp(folder) != NULL);
    late_s = 0.6;
    rig_far = &sounder;
    rig_captures = folder;
    rig_start(OPEN, conf);
    rig.dated = true;
    rig.pose_every_ns = RIG_S / 20;
    rig_run(3);
    rig.north_mps = GO_MPS;
    rig_run(5);
    const uint64_t last_ns = rig_stats().device.last_ping_ns;
    RIG_UNTIL(rig_stats().device.last_ping_ns > last_ns, 1);
    put_sectors(live);
    rig_end();
    rig_captures = NULL;
    find_capture(folder, path);
    rig_replay(path, conf);
    put_sectors(again);
    rig_end();
    CHECK_STR(again, live);
    rig_replay(path, "delay = 0 0 s\n" WORLD);
    put_sectors(other);
    rig_end();
    CHECK(strcmp(other, live) != 0);
    unlink(path);
    rmdir(folder);
}

int main(void)
{
    RUN(nothing_is_free_beyond_a_wall_for_a_reading_that_comes_late);
    RUN(nothing_is_free_beyond_a_plate_while_a_late_sounder_turns);
    RUN(poses_that_come_late_are_dated_back_as_well);
    RUN(a_reading_is_as_old_as_its_delay);
    RUN(a_replay_dates_back_as_its_configuration_says);
    return test_end();
}
