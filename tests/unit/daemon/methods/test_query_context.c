/* SPDX-License-Identifier: MIT */
/*
 * test_query_context - what a lost sonar observed is unknown, whatever is asked, and an attitude that is too old is
 * none. The sonar's state is the test's own.
 */
#include "tests/lib/daemon_rig.h"

#define SECOND     1000000000ull
#define TURN_PINGS 144
#define PING_NS    (SECOND / 25)

#define CONF                                                                                                      \
    "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n"                                            \
    "[extract]\nminimum_range = 10 m\nno_echo = range\n"                                                          \
    "[vehicle]\nradius = 0.3 m\nheight = 0.2 m\nmargin = 0.1 m\nnear = 1.5 m\nunknown = stop\n"

/* How the sonar does; the linker calls this in the place of daemon/input/source.c's. */
static struct source_stats sonar;

void __wrap_source_stats(const struct source *source, struct source_stats *out);
void __wrap_source_stats(const struct source *source, struct source_stats *out)
{
    (void)source;
    *out = sonar;
}

static const struct source_stats online = {.open = true, .device.state = DEVICE_RUNNING};

/* A level head has heard free water all around. */
static bool begin(void)
{
    if (!rig_start(CONF))
        return false;
    for (uint32_t i = 0; i <= 2 * TURN_PINGS; i++)
        rig_send(&(struct rig_ping){.t_ns = 100 * SECOND + i * PING_NS,
                                    .seq = i + 1,
                                    .new_turn = i % TURN_PINGS == 0,
                                    .az_rad = i % TURN_PINGS * GEO_TURN / TURN_PINGS,
                                    .wide_deg = 3,
                                    .high_deg = 25});
    d.replay = false; /* where no sonar is ever lost */
    sonar = online;
    return true;
}

static bool is_clear(const char *method, json_t *params)
{
    json_t *a = ask(method, params), *sectors = json_object_get(a, "sectors");
    const bool clear = says(sectors ? json_array_get(sectors, 0) : a, "clear");
    CHECK(clear || says(sectors ? json_array_get(sectors, 0) : a, "unknown"));
    json_decref(a);
    return clear;
}

/* Farther than near promises. */
static bool may_go(void)
{
    json_t *a = ask("limit", json_pack("{s:[f, f, f]}", "velocity_mps", 0.9, 0.0, 0.0));
    const char *by = json_string_value(json_object_get(a, "limited_by"));
    const bool may = by && strcmp(by, "nothing") == 0;
    CHECK(may || (by && strcmp(by, "unknown") == 0));
    json_decref(a);
    return may;
}

/* How many of all answers are clear. */
static int clear_answers(void)
{
    return is_clear("blocked",
                    json_pack("{s:f, s:f, s:f}", "azimuth_deg", 0.0, "distance_m", 3.0, "half_angle_deg", 2.0)) +
           is_clear("blocked",
                    json_pack("{s:f, s:f, s:f}", "azimuth_deg", 0.0, "distance_m", 3.0, "radius_m", 0.3)) +
           is_clear("sectors", json_pack("{s:i, s:f}", "count", 8, "distance_m", 3.0)) +
           is_clear("nearest", json_pack("{s:f, s:[f, f]}", "distance_m", 3.0, "elevation_deg", -4.0, 4.0)) +
           is_clear("time_to_collision",
                    json_pack("{s:[f, f, f], s:f}", "velocity_mps", 0.5, 0.0, 0.0, "ahead_s", 5.0)) +
           may_go();
}

TEST(what_a_lost_sonar_observed_is_unknown)
{
    static const struct {
        const char *name;
        bool open;
        enum device_state state;
    } row[] = {{"its port is closed", false, DEVICE_RUNNING}, {"it is silent", true, DEVICE_SILENT}};
    if (!begin()) {
        CHECK(false);
        return;
    }
    CHECK_INT(clear_answers(), 6);
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        sonar = (struct source_stats){.open = row[i].open, .device.state = row[i].state};
        const int clear = clear_answers();
        if (clear != 0) {
            printf("%s: %d answers are clear\n", row[i].name, clear);
            test_case_failed = true;
        }
        json_t *a = ask("blocked", json_pack("{s:f, s:f}", "azimuth_deg", 0.0, "distance_m", 3.0));
        CHECK_STR(json_string_value(json_object_get(a, "reason")),
                  "sonar head, which covers this direction, is offline");
        json_decref(a);
    }
    sonar = online;
    CHECK_INT(clear_answers(), 6);
    rig_end();
}

/* Who reads it may not look at its age. */
TEST(an_attitude_that_is_too_old_is_none)
{
    struct pose pose = pose_identity;
    if (!begin()) {
        CHECK(false);
        return;
    }
    pose.t_ns = loop_now(d.loop);
    pose.has = POSE_ATTITUDE;
    CHECK(pose_log_put(&d.poses, &pose));
    for (int late = 0; late < 2; late++) {
        loop_advance(d.loop, pose.t_ns + (late ? 2 : 0) * SECOND); /* max_age is 1 s */
        json_t *a = ask("status", json_object()), *said = json_object_get(a, "pose");
        CHECK(late ? json_is_null(json_object_get(said, "attitude_deg"))
                   : json_array_size(json_object_get(said, "attitude_deg")) == 3);
        CHECK_NEAR(number(said, "age_s"), late ? 2 : 0, 0, 1e-3);
        json_decref(a);
    }
    rig_end();
}

/* Without being in the way of "data": that is of what was measured. */
TEST(settings_that_do_not_fit_are_in_the_status)
{
    if (!begin()) {
        CHECK(false);
        return;
    }
    for (int drifts = 0; drifts < 2; drifts++) {
        d.conf.pose.heading_drift_radps = drifts ? 1 : 0;
        json_t *a = ask("status", json_object()), *said = json_object_get(a, "misfits");
        CHECK_INT(json_array_size(said), drifts);
        CHECK(!drifts ||
              strstr(json_string_value(json_array_get(said, 0)), "[pose] heading_drift = 57.2958 deg/s"));
        json_decref(a);
    }
    rig_end();
}

/* What of a part's limit status says; negative: null. */
static double max_age_s(const char *part)
{
    json_t *a = ask("status", json_object());
    const json_t *limit = json_object_get(json_object_get(json_object_get(a, "pose"), "max_age_s"), part);
    const double s = json_is_null(limit) ? -1 : json_number_value(limit);
    CHECK(limit);
    json_decref(a);
    return s;
}

/* Of attitudes every two seconds, where it is known how far the vehicle can have gone and turned meanwhile. */
TEST(the_limit_of_a_pose_is_shown_as_it_is_in_force)
{
    CHECK(begin());
    pose_log_set_max_age(&d.poses, POSE_LOG_AUTO);
    pose_log_set_most(&d.poses, 1, 1);
    CHECK_NEAR(max_age_s("attitude"), -1, 0, 0);
    struct pose pose = pose_identity;
    pose.has = POSE_ATTITUDE;
    for (int i = 0; i < 8; i++) {
        loop_advance(d.loop, loop_now(d.loop) + 2 * SECOND);
        pose.t_ns = loop_now(d.loop);
        CHECK(pose_log_put(&d.poses, &pose));
        CHECK_NEAR(max_age_s("attitude"), i < 7 ? 1 : 6, 0, 1e-6);
    }
    CHECK_NEAR(max_age_s("depth"), -1, 0, 0);
    rig_end();
}

int main(void)
{
    RUN(what_a_lost_sonar_observed_is_unknown);
    RUN(an_attitude_that_is_too_old_is_none);
    RUN(settings_that_do_not_fit_are_in_the_status);
    RUN(the_limit_of_a_pose_is_shown_as_it_is_in_force);
    return test_end();
}
