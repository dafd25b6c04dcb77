/* SPDX-License-Identifier: MIT */
/* test_rig_stall - a process that is held up for a while, by a stop signal or a busy machine, loses evidence and never
 * truth: what came meanwhile counts from when it came, or for no more than is known of that. */
#include "tests/lib/rig.h"

#include <dirent.h>

#define SCENE "cylinder 5 0 0.5\ncylinder -4 3 0.4\ncylinder 0 -7 0.5\ncylinder -5 -5 0.8\n"
#define POSES "[pose]\nmax_age = 1 s\n"

/* The grid's cells and the beam's width; and a pile of which only the side was observed yet lies its radius farther. */
#define FREE_M(range_m) (0.2 + 0.02 * (range_m))
#define FAR_M(range_m)  (0.5 + 0.02 * (range_m))

/* The nearest surface in a sector of 5 degrees, measured from the bow. */
static double nearest_m(double azimuth_deg)
{
    double nearest = INFINITY;
    for (int i = -5; i <= 5; i++) {
        const double az = geo_rad(azimuth_deg + rig.sim.pose.yaw_deg + i / 2.0);
        const double ahead[3] = {cos(az), sin(az), 0}, here[3] = {0, 0, 0};
        struct place_hit hit;
        if (place_cast(&rig.sim.scene, here, ahead, 0, &hit))
            nearest = fmin(nearest, hit.range_m);
    }
    return nearest;
}

struct claims {
    int blocked, clear, too_far, falsely_free;
};

/* What all sectors say now against what is there. */
static void judge(struct claims *c)
{
    json_t *reply = rig_ask("sectors", "\"distance_m\":0"), *sectors = json_object_get(reply, "sectors"), *s;
    size_t i;
    json_array_foreach(sectors, i, s)
    {
        const char *state = json_string_value(json_object_get(s, "state"));
        const double there_m = nearest_m(json_number_value(json_object_get(s, "azimuth_deg")));
        const double range_m = json_number_value(json_object_get(s, "range_m"));
        const double free_m = json_number_value(json_object_get(s, "free_to_m"));
        const bool blocked = strcmp(state, "blocked") == 0;
        c->blocked += blocked;
        c->clear += strcmp(state, "clear") == 0;
        c->too_far += blocked && range_m > there_m + FAR_M(there_m);
        c->falsely_free += free_m > there_m + FREE_M(there_m);
    }
    json_decref(reply);
}

struct drive {
    double turn_dps, hold_s;
    bool dated; /* poses have t_unix */
};

/* Twelve holds while the vehicle turns and its surroundings are new. */
static struct claims drive(const struct drive *how, void (*hold)(double s), struct source_stats *stats,
                           struct pipeline_stats *pipe)
{
    struct claims c = {0};
    rig_start(SCENE, POSES);
    rig.dated = how->dated;
    rig.pose_every_ns = RIG_S / 10;
    rig.turn_dps = how->turn_dps;
    rig_run(3);
    for (int i = 0; i < 12; i++) {
        hold(how->hold_s);
        for (int k = 0; k < 10; k++) {
            rig_run(0.2);
            judge(&c);
        }
    }
    *stats = rig_stats();
    pipeline_stats(rig.d.pipeline, pipe);
    rig_end();
    return c;
}

static void hear_nothing_false(void (*hold)(double s))
{
    static const struct drive how[] = {{16, 0.3, true},  {-13, 0.6, true}, {18, 0.9, true},
                                       {-9, 1.8, true},  {22, 2.1, true},  {15, 5, true},
                                       {15, 0.5, false}, {15, 1, false},   {-20, 2, false}};
    for (size_t i = 0; i < sizeof how / sizeof how[0]; i++) {
        struct source_stats stats;
        struct pipeline_stats pipe;
        const struct claims c = drive(&how[i], hold, &stats, &pipe);
        printf("# %g deg/s, held up %g s: %d blocked, %d clear, %d too far, %d falsely free; %llu of %llu pings "
               "undated\n",
               how[i].turn_dps, how[i].hold_s, c.blocked, c.clear, c.too_far, c.falsely_free,
               (unsigned long long)stats.undated_pings, (unsigned long long)stats.device.pings);
        CHECK_INT(c.too_far, 0);
        CHECK_INT(c.falsely_free, 0);
        CHECK(c.blocked > 250);
        CHECK(stats.undated_pings > 0 && pipe.submitted < stats.device.pings);
    }
}

TEST(a_turning_vehicle_hears_nothing_false)
{
    hear_nothing_false(rig_hold);
}

/* The clock that the loop read is old then, and the bytes are newer. */
TEST(nor_when_it_is_held_up_between_the_look_and_the_read)
{
    hear_nothing_false(rig_hold_in_turn);
}

/* Where the head looked is known, whenever it did. */
TEST(a_vehicle_that_does_not_turn_loses_no_ping)
{
    struct source_stats stats;
    struct pipeline_stats pipe;
    const struct claims c = drive(&(struct drive){0, 5, true}, rig_hold, &stats, &pipe);
    CHECK_INT(c.too_far, 0);
    CHECK_INT(c.falsely_free, 0);
    CHECK(c.clear > 500 && c.blocked > 500);
    CHECK(stats.undated_pings > 50);
    CHECK_INT(pipe.submitted, stats.device.pings);
}

TEST(who_is_in_time_doubts_no_ping)
{
    struct source_stats stats;
    struct pipeline_stats pipe;
    drive(&(struct drive){15, 0.05, true}, rig_hold, &stats, &pipe);
    CHECK_INT(stats.undated_pings, 0);
    CHECK_INT(pipe.submitted, stats.device.pings);
}

/* Its bytes wait to be read. */
TEST(a_sonar_is_not_given_up_for_silence_while_nobody_listens)
{
    static const double hold_s[] = {0.1, 1, 5, 20};
    rig_start(SCENE, POSES);
    rig_run(3);
    for (size_t i = 0; i < sizeof hold_s / sizeof hold_s[0]; i++) {
        const uint64_t pings = rig_stats().device.pings;
        rig_hold(hold_s[i]);
        rig_run(1);
        CHECK_INT(rig_stats().device.restarts, 0);
        CHECK_INT(rig_stats().device.timeouts, 0);
        CHECK(rig_stats().device.pings >= pings + 5);
    }
    rig_end();
}

/* What it sends next is asked for when its answer is read, however long before that came. */
TEST(nor_for_an_answer_that_waited_where_the_port_notes_when_it_came)
{
    static const double hold_s[] = {1, 5, 20};
    rig_start(SCENE, "mode = request\n" POSES);
    rig.noted = true;
    rig_run(3);
    CHECK_INT(rig_stats().device.timeouts, 0);
    for (size_t i = 0; i < sizeof hold_s / sizeof hold_s[0]; i++) {
        const uint64_t pings = rig_stats().device.pings;
        rig_hold(hold_s[i]);
        rig_run(1);
        CHECK_INT(rig_stats().device.restarts, 0);
        CHECK_INT(rig_stats().device.timeouts, 0);
        CHECK(rig_stats().device.pings >= pings + 3);
    }
    rig_end();
}

TEST(a_pose_that_tells_its_time_is_taken_however_late)
{
    rig_start(SCENE, POSES);
    rig.pose_every_ns = RIG_S / 10;
    rig.dated = true;
    rig.turn_dps = 20;
    rig_run(1);
    rig_hold(3);
    rig_run(0.02);
    CHECK_INT(rig.d.poses.refused, 0);
    struct pose p;
    CHECK(pose_log_at(&rig.d.poses, rig_now_ns - RIG_S, &p) && (p.has & POSE_ATTITUDE));
    double want[4];
    quat_from_rpy(0, 0, geo_rad(rig.sim.pose.yaw_deg - 20), want);
    for (int i = 0; i < 4; i++)
        CHECK_NEAR(p.attitude[i], want[i], 0, 1e-3);
    rig_end();
}

TEST(a_pose_without_a_time_is_not_taken_for_one_of_now)
{
    rig_start(SCENE, POSES);
    rig.pose_every_ns = RIG_S / 10;
    rig.turn_dps = 20;
    rig_run(1);
    CHECK_INT(rig.d.poses.refused, 0);
    const uint64_t taken = rig.d.poses.taken;
    rig_hold(3);
    rig.pose_every_ns = 0;
    rig_run(0.02);
    CHECK_INT(rig.d.poses.taken, taken);
    CHECK_INT(rig.d.poses.refused, 30);
    json_t *answer = rig_ask("pose", "\"attitude_deg\":[0,0,10]");
    CHECK(json_is_true(json_object_get(answer, "taken")));
    json_decref(answer);
    rig_end();
}

/* How many of the lines that the pilot gets say so. */
static int pilot_reads(const char *what)
{
    static char text[1 << 16];
    int n = 0;
    for (ssize_t got; (got = read(rig.pilot, text, sizeof text - 1)) > 0;) {
        text[got] = '\0';
        for (const char *p = text; (p = strstr(p, what)); p++)
            n++;
    }
    return n;
}

/* A client that reads no replies is not listened to meanwhile. */
TEST(nor_is_one_that_waited_behind_other_requests)
{
    static const char ask[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"sectors\",\"params\":{}}\n",
                      pose[] = "{\"jsonrpc\":\"2.0\",\"id\":2,\"method\":\"pose\",\"params\":"
                               "{\"attitude_deg\":[0,0,10]}}\n";
    int taken = 0;
    rig_start(SCENE, POSES);
    rig_run(1);
    for (int i = 0; i < 100; i++)
        CHECK_INT(write(rig.pilot, ask, sizeof ask - 1), sizeof ask - 1);
    CHECK_INT(write(rig.pilot, pose, sizeof pose - 1), sizeof pose - 1);
    rig_run(1);
    CHECK_INT(rig.d.poses.taken + rig.d.poses.refused, 0);
    for (int i = 0; i < 20; i++) {
        taken += pilot_reads("\"taken\":true");
        rig_run(0.02);
    }
    CHECK_INT(taken, 0);
    CHECK_INT(rig.d.poses.taken, 0);
    CHECK_INT(rig.d.poses.refused, 1);
    CHECK_INT(write(rig.pilot, pose, sizeof pose - 1), sizeof pose - 1);
    rig_run(0.02);
    CHECK_INT(rig.d.poses.taken, 1);
    rig_end();
}

/* It may have connected before. */
TEST(nor_is_the_first_of_a_client_that_waited_to_be_accepted)
{
    static const char pose[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"pose\",\"params\":"
                               "{\"attitude_deg\":[0,0,10]}}\n";
    rig_start(SCENE, POSES);
    rig_run(1);
    const int fd = rig_connect();
    CHECK_INT(write(fd, pose, sizeof pose - 1), sizeof pose - 1);
    rig_hold(2);
    rig_run(0.05);
    CHECK_INT(rig.d.poses.taken, 0);
    CHECK_INT(rig.d.poses.refused, 1);
    CHECK_INT(write(fd, pose, sizeof pose - 1), sizeof pose - 1);
    rig_run(0.05);
    CHECK_INT(rig.d.poses.taken, 1);
    close(fd);
    rig_end();
}

/* The name of the only capture in the folder. */
static void find_capture(const char *folder, char path[300])
{
    DIR *d = opendir(folder);
    CHECK(d != NULL);
    for (struct dirent *e; d && (e = readdir(d));)
        if (strstr(e->d_name, ".mcap"))
            snprintf(path, 300, "%s/%s", folder, e->d_name);
    closedir(d);
}

static void put_ranges(char text[4096])
{
    json_t *reply = rig_ask("sectors", "\"distance_m\":0"), *s;
    size_t i, n = 0;
    json_array_foreach(json_object_get(reply, "sectors"), i, s) n += (size_t)snprintf(
        text + n, 4096 - n, "%s %.6f %.6f\n", json_string_value(json_object_get(s, "state")),
        json_number_value(json_object_get(s, "range_m")), json_number_value(json_object_get(s, "free_to_m")));
    json_decref(reply);
}

/* A capture knows as little of the times as the daemon did that wrote it. */
TEST(a_replay_of_it_leaves_out_the_same_pings)
{
    char folder[] = "/tmp/sonard-rig-XXXXXX", path[300] = "", live[4096] = "", replayed[4096] = "";
    CHECK(mkdtemp(folder) != NULL);
    rig_captures = folder;
    rig_start(SCENE, POSES);
    rig.dated = true;
    rig.pose_every_ns = RIG_S / 10;
    rig.turn_dps = 10;
    for (int i = 0; i < 12; i++) {
        rig_run(1.5);
        rig_hold(0.2 * i);
    }
    rig_run(1);
    const uint64_t last_ns = rig_stats().device.last_ping_ns;
    RIG_UNTIL(rig_stats().device.last_ping_ns > last_ns, 1);
    const struct source_stats had = rig_stats();
    struct pipeline_stats pipe, pipe_again;
    pipeline_stats(rig.d.pipeline, &pipe);
    put_ranges(live);
    rig_end();
    rig_captures = NULL;
    find_capture(folder, path);
    rig_replay(path, POSES);
    pipeline_stats(rig.d.pipeline, &pipe_again);
    CHECK(had.undated_pings > 20 && pipe.submitted < had.device.pings);
    CHECK_INT(rig_stats().device.pings, had.device.pings);
    CHECK_INT(rig_stats().undated_pings, had.undated_pings);
    CHECK_INT(pipe_again.submitted, pipe.submitted);
    put_ranges(replayed);
    CHECK_STR(replayed, live);
    rig_end();
    unlink(path);
    rmdir(folder);
}

int main(void)
{
    RUN(a_turning_vehicle_hears_nothing_false);
    RUN(nor_when_it_is_held_up_between_the_look_and_the_read);
    RUN(a_vehicle_that_does_not_turn_loses_no_ping);
    RUN(who_is_in_time_doubts_no_ping);
    RUN(a_sonar_is_not_given_up_for_silence_while_nobody_listens);
    RUN(nor_for_an_answer_that_waited_where_the_port_notes_when_it_came);
    RUN(a_pose_that_tells_its_time_is_taken_however_late);
    RUN(a_pose_without_a_time_is_not_taken_for_one_of_now);
    RUN(nor_is_one_that_waited_behind_other_requests);
    RUN(nor_is_the_first_of_a_client_that_waited_to_be_accepted);
    RUN(a_replay_of_it_leaves_out_the_same_pings);
    return test_end();
}
