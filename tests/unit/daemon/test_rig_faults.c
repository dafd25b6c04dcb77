/* SPDX-License-Identifier: MIT */
/* test_rig_faults - what goes wrong with a sonar, its line and the poses: the right counter says what happened, what is
 * not known any more is unknown, and all goes on afterwards. */
#include "tests/lib/rig.h"

#define BOX "box -6 7 -5 4 -20 20\n"

#define COUNTERS 9

static const char *const counter_name[COUNTERS] = {"garbage_bytes", "bad_checksum", "bad_frame",
                                                   "lost_frames",   "nacks",        "timeouts",
                                                   "restarts",      "reconnects",   "dropped"};
enum { GARBAGE = 1, CHECKSUM = 2, FRAME = 4, LOST = 8, NACKS = 16, TIMEOUTS = 32, RESTARTS = 64 };

struct counters {
    uint64_t of[COUNTERS];
};

static struct counters counters(void)
{
    json_t *status = rig_ask("status", "%s", ""), *sonar = json_array_get(json_object_get(status, "sensors"), 0);
    struct counters c;
    for (int i = 0; i < COUNTERS; i++)
        c.of[i] = (uint64_t)json_integer_value(json_object_get(sonar, counter_name[i]));
    json_decref(status);
    return c;
}

/* What the sonar is told, which counters grow by how much at least, which others may grow. */
struct line_fault {
    const char *command, *then;
    double lasts_s;
    int grow[COUNTERS];
    unsigned may;
    bool exact; /* lost frames are counted one by one */
};

static const struct line_fault transmit[] = {
    {"drop 3", NULL, 0, {[3] = 3}, 0, true},
    {"corrupt 2", NULL, 0, {[1] = 2, [3] = 2}, GARBAGE, true},
    {"short 2", NULL, 0, {[0] = 1, [3] = 2}, CHECKSUM, true},
    {"garbage 500", NULL, 0, {[0] = 490}, CHECKSUM, false},
    {"split on", NULL, 0, {0}, 0, false},
    {"split off", NULL, 0, {0}, 0, false},
    {"stall 1", NULL, 1, {0}, 0, false},
    {"silent 2.5", NULL, 2.5, {[5] = 1, [6] = 1}, LOST, false},
    {"flood 0.5", NULL, 0.5, {[0] = 1000}, CHECKSUM | LOST | TIMEOUTS | RESTARTS, false},
    {"reboot", NULL, 0, {[5] = 1, [6] = 1}, LOST, false},
    {"nack 1", "reboot", 0, {[4] = 1}, TIMEOUTS | RESTARTS | LOST, false},
};

static const struct line_fault request[] = {
    {"drop 3", NULL, 0, {[3] = 3, [5] = 3}, 0, true},
    {"corrupt 2", NULL, 0, {[1] = 2, [3] = 2}, GARBAGE | TIMEOUTS, true},
    {"short 2", NULL, 0, {[0] = 1, [3] = 2}, CHECKSUM | TIMEOUTS, true},
    {"garbage 500", NULL, 0, {[0] = 490}, CHECKSUM, false},
    {"split on", NULL, 0, {0}, 0, false},
    {"split off", NULL, 0, {0}, 0, false},
    {"nack 2", NULL, 0, {[3] = 2, [4] = 2}, TIMEOUTS, false},
    {"stall 1", NULL, 1, {[3] = 1, [5] = 1}, RESTARTS, false},
    {"silent 2.5", NULL, 2.5, {[3] = 1, [5] = 1}, RESTARTS, false},
    {"flood 0.5", NULL, 0.5, {[0] = 1000}, CHECKSUM | LOST | TIMEOUTS | RESTARTS, false},
    {"reboot", NULL, 0, {0}, TIMEOUTS | LOST | RESTARTS, false},
};

static bool grown(const struct line_fault *f, const struct counters *before)
{
    const struct counters now = counters();
    bool all = true;
    for (int i = 0; i < COUNTERS; i++)
        all &= now.of[i] >= before->of[i] + (uint64_t)f->grow[i];
    return all;
}

static void play(const char *mode, const struct line_fault *f)
{
    const struct counters before = counters();
    rig_command(f->command);
    if (f->then)
        rig_command(f->then);
    rig_run(f->lasts_s);
    for (int i = 0; i < 200 && !grown(f, &before); i++)
        rig_run(0.1);
    RIG_UNTIL(strcmp(rig_status("state", true), "running") == 0, 20);
    rig_run_pings(25);
    const struct counters after = counters();
    for (int i = 0; i < COUNTERS; i++) {
        const int n = (int)(after.of[i] - before.of[i]);
        const bool may_grow = f->grow[i] || f->may & 1u << i;
        if (n < f->grow[i] || (n > 0 && !may_grow) || (f->exact && i == 3 && n != f->grow[i])) {
            printf("# %s, %s: %s grew by %d\n", mode, f->command, counter_name[i], n);
            CHECK(false);
        }
    }
}

static void faults_of(const char *mode, const struct line_fault *faults, size_t n)
{
    char conf[64];
    snprintf(conf, sizeof conf, "mode = %s\n", mode);
    rig_head.lag = 0;
    rig_start(BOX, conf);
    rig_run_pings(10);
    for (size_t i = 0; i < n; i++)
        play(mode, &faults[i]);
    rig_command("range 5"); /* by itself */
    RIG_UNTIL(fabs(rig_stats().device.range_m - 5) < 0.1, 10);
    rig_command("range 0");
    RIG_UNTIL(fabs(rig_stats().device.range_m - 10) < 0.1, 10);
    rig_end();
    rig_head.lag = 2;
}

TEST(faults_of_a_line_are_counted_and_outlived_by_a_head_that_scans)
{
    faults_of("transmit", transmit, sizeof transmit / sizeof transmit[0]);
}

TEST(faults_of_a_line_are_counted_and_outlived_by_a_head_that_is_asked)
{
    faults_of("request", request, sizeof request / sizeof request[0]);
}

/* Without a pose in between: a fixed sonar. */
TEST(a_sonar_that_is_lost_knows_nothing_free)
{
    rig_start("cylinder 6 2 0.4\n", "[vehicle]\nnear = 2 m\n");
    CHECK_INT(rig_states(), RIG_UNKNOWN);
    rig_run(70);
    CHECK((rig_states() & (RIG_CLEAR | RIG_BLOCKED)) == (RIG_CLEAR | RIG_BLOCKED));
    rig_command("silent 8");
    rig_run(3);
    CHECK(!(rig_states() & RIG_CLEAR));
    CHECK_STR(rig_status("data", false), "no data from the sonar");
    CHECK_INT(rig_stats().device.restarts, 1);
    RIG_UNTIL(strcmp(rig_status("data", false), "ok") == 0, 20);
    CHECK(rig_states() & RIG_CLEAR);
    rig_end();
}

/* It answers when it is set up, and soon no more: so it looks when another program is answered instead. */
TEST(a_sonar_whose_answers_get_lost_again_and_again_is_told)
{
    rig_start("cylinder 6 2 0.4\n", "");
    rig_run(30);
    for (int i = 0; i < 6; i++) {
        CHECK_STR(rig_status("data", false),
                  i < 3 ? "ok" : "answers of the sonar get lost: another program, or a poor line?");
        rig_command("silent 4");
        rig_run(4);
        rig_run_pings(5);
    }
    json_t *status = rig_ask("status", "%s", "");
    CHECK(json_is_true(json_object_get(json_array_get(json_object_get(status, "sensors"), 0), "contested")));
    json_decref(status);
    RIG_UNTIL(strcmp(rig_status("data", false), "ok") == 0, 60);
    rig_end();
}

/* The longest lists are of those that scan: the log has all of what status has. */
TEST(the_settings_of_others_are_logged_to_the_last)
{
    static const struct ping360_settings others = {
        .gain = 0, .transmit_us = 400, .sample_period = 30000, .frequency_khz = 1000, .n_samples = 1000};
    struct head *head = &rig.sim.head;
    rig_start("cylinder 6 2 0.4\n", "mode = transmit\n");
    rig_log_begin();
    rig_run_pings(20);
    head->settings = head->wanted = others;
    head->sweep = (struct ping360_sweep){.start = 180, .stop = 220, .step = 2};
    head->position = 0;
    head->conf.lag = 100; /* it keeps them for a while when ours are sent again */
    RIG_UNTIL(*rig_status("other_settings", true), 60);
    const char *all = rig_status("other_settings", true);
    CHECK(strstr(all, "gain_setting 0") && strstr(all, "num_steps 2 (sent 1)"));
    CHECK_INT(rig_log_count(all), 1);
    rig_log_end();
    rig_end();
}

TEST(a_port_that_is_pulled_is_tried_until_it_is_back)
{
    rig_start("cylinder 6 2 0.4\n", "");
    rig_run(70);
    for (uint64_t i = 1; i <= 3; i++) {
        rig_unplug();
        rig_run(0.1);
        CHECK_STR(rig_status("state", true), "no port");
        CHECK(!(rig_states() & RIG_CLEAR));
        rig_run(2.4);
        CHECK(strstr(rig_status("port_error", true), "/dev/rig"));
        rig_plug();
        const uint64_t pings = rig_stats().device.pings;
        RIG_UNTIL(rig_stats().device.pings > pings, 2);
        RIG_UNTIL(strcmp(rig_status("state", true), "running") == 0, 2);
        CHECK_STR(rig_status("port_error", true), "");
        CHECK_INT(rig_stats().reconnects, i);
    }
    rig_end();
}

TEST(a_message_that_the_loss_of_the_port_cuts_off_is_no_garbage)
{
    rig_start(BOX, "");
    rig_run_pings(5);
    uint64_t bytes = rig_stats().bytes_in;
    RIG_UNTIL(rig_stats().bytes_in > bytes, 1); /* in the middle of a message */
    const uint64_t garbage = rig_stats().device.garbage_bytes;
    rig_unplug();
    rig_run(0.1);
    CHECK(rig_stats().device.cut_bytes > 0);
    CHECK_INT(rig_stats().device.garbage_bytes, garbage);
    rig_end();
}

TEST(a_lost_pose_makes_all_unknown_until_the_next)
{
    rig_start(BOX, "[pose]\nmax_age = 1 s\n[grid]\nclear_for = 60 s\nforget = 160 s\n");
    rig.pose_every_ns = RIG_S / 10;
    rig_run(70);
    CHECK_INT(rig_states(), RIG_BLOCKED);
    rig.pose_every_ns = 0;
    rig_run(0.8);
    CHECK_INT(rig_states(), RIG_BLOCKED);
    for (double s = 1.2; s < 11; s += 0.5) {
        rig_run(s < 1.3 ? 0.4 : 0.5);
        CHECK_INT(rig_states(), RIG_UNKNOWN);
        CHECK_STR(rig_status("data", false), "the pose is too old");
        json_t *sectors = rig_ask("sectors", "%s", "");
        CHECK_NEAR(json_number_value(json_object_get(sectors, "pose_age_s")), s, 0, 0.12);
        json_decref(sectors);
    }
    CHECK_STR(rig_status("state", true), "running");
    rig.pose_every_ns = RIG_S / 10;
    rig_run(0.01);
    CHECK_INT(rig_states(), RIG_BLOCKED);
    rig_run(2);
    CHECK_INT(rig_states(), RIG_BLOCKED);
    rig_end();
}

static double number_of(const char *method, const char *params, const char *name)
{
    json_t *answer = rig_ask(method, "%s", params);
    const double value = json_number_value(json_object_get(answer, name));
    json_decref(answer);
    return value;
}

/* The attitude is still told, place and velocity are not: the vehicle is nearer to the wall by what it has gone. */
TEST(a_vehicle_whose_place_is_old_is_nearer_to_the_wall)
{
    rig_start(BOX, "[pose]\nmax_age = 5 s\n[vehicle]\nunknown = ignore\nslow = 0 m/s\n");
    rig_run(25);
    json_decref(rig_ask("pose", "\"attitude_deg\":[0,0,0],\"position_m\":[0,0,5],\"velocity_mps\":[0.5,0,0]"));
    rig_run(22);
    json_decref(rig_ask("pose", "\"attitude_deg\":[0,0,0],\"position_m\":[0,0,5],\"velocity_mps\":[0.5,0,0]"));
    const double time_s = number_of("time_to_collision", "\"velocity_mps\":[0.5,0,0]", "time_s");
    const double speed_mps = number_of("limit", "\"velocity_mps\":[3,0,0]", "speed_mps");
    rig_run(3);
    json_decref(rig_ask("pose", "\"attitude_deg\":[0,0,0]"));
    CHECK(time_s > 5);
    CHECK(number_of("time_to_collision", "\"velocity_mps\":[0.5,0,0]", "time_s") < time_s - 2.8);
    CHECK(number_of("limit", "\"velocity_mps\":[3,0,0]", "speed_mps") < speed_mps - 0.05);
    rig_end();
}

static bool velocity_doubted(void)
{
    json_t *status = rig_ask("status", "%s", "");
    const char *doubt = json_string_value(json_object_get(json_object_get(status, "pose"), "doubt"));
    const bool is = doubt && strstr(doubt, "exactly 0");
    CHECK(doubt != NULL);
    json_decref(status);
    return is;
}

/* It sinks by 0.1 m a second, and a DVL without bottom lock says that it stands still. */
TEST(zeros_of_a_vehicle_that_moves_are_told_in_status)
{
    rig_start(BOX, "");
    for (int i = 0; i < 10; i++) {
        rig_run(1);
        json_decref(
            rig_ask("pose", "\"attitude_deg\":[0,0,0],\"depth_m\":%.1f,\"velocity_mps\":[0,0,0]", 5 + 0.1 * i));
        CHECK_INT(velocity_doubted(), i >= 6);
    }
    json_decref(rig_ask("pose", "\"attitude_deg\":[0,0,0],\"depth_m\":6,\"velocity_mps\":[0,0,0.1]"));
    CHECK(!velocity_doubted());
    rig_end();
}

static bool may_go(double mps)
{
    return number_of("limit", "\"velocity_mps\":[1,0,0]", "speed_mps") >= mps;
}

/* `near` is about what no beam shows. A sonar that is offline shows nothing, however often it was everywhere. */
TEST(near_lets_nobody_drive_on_when_the_sonar_is_lost)
{
    rig_start(BOX, "[grid]\nelevation = level\n[vehicle]\nnear = 4.6 m\nslow = 0.1 m/s\n");
    rig.pose_every_ns = RIG_S / 10;
    rig_run(190); /* three turns */
    CHECK(may_go(1));
    rig_command("silent 8");
    rig_run(3);
    CHECK(may_go(0.099) && !may_go(0.101));
    RIG_UNTIL(may_go(1), 30); /* back in less than half a turn */
    rig_command("silent 200");
    rig_run(230);
    CHECK_STR(rig_status("state", true), "running");
    CHECK(!may_go(0.101)); /* it has yet to show what has come into its way */
    RIG_UNTIL(may_go(1), 150);
    rig_end();
}

int main(void)
{
    RUN(faults_of_a_line_are_counted_and_outlived_by_a_head_that_scans);
    RUN(faults_of_a_line_are_counted_and_outlived_by_a_head_that_is_asked);
    RUN(a_sonar_that_is_lost_knows_nothing_free);
    RUN(a_sonar_whose_answers_get_lost_again_and_again_is_told);
    RUN(the_settings_of_others_are_logged_to_the_last);
    RUN(a_port_that_is_pulled_is_tried_until_it_is_back);
    RUN(a_message_that_the_loss_of_the_port_cuts_off_is_no_garbage);
    RUN(a_lost_pose_makes_all_unknown_until_the_next);
    RUN(a_vehicle_whose_place_is_old_is_nearer_to_the_wall);
    RUN(zeros_of_a_vehicle_that_moves_are_told_in_status);
    RUN(near_lets_nobody_drive_on_when_the_sonar_is_lost);
    return test_end();
}
