/* SPDX-License-Identifier: MIT */
/*
 * test_drift_words - how far a vehicle without a position may drift, and what would make that less, is told in one
 * sentence, and the metres in it are those that come true. The sonar's state is the test's own.
 */
#include "tests/lib/daemon_rig.h"

#define SECOND     1000000000ull
#define TURN_PINGS 144
#define PING_NS    (SECOND / 24) /* a turn takes 6 s */

#define CONF                                                                                                      \
    "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n"                                            \
    "[extract]\nminimum_range = 10 m\nno_echo = range\n[vehicle]\nmax_speed = 1.5 m/s\n"

#define LONGEST 239 /* bytes, for which the pilot's text and sonarctl's page have room */

static struct source_stats sonar = {.open = true, .device.state = DEVICE_RUNNING};

void __wrap_source_stats(const struct source *source, struct source_stats *out);
void __wrap_source_stats(const struct source *source, struct source_stats *out)
{
    (void)source;
    *out = sonar;
}

static uint32_t sent;
static bool turns; /* it is a head; else nobody says so, as of a fan */

/* What the poses carry, and how fast the vehicle is bounded to be, level and up or down; negative: no bound comes. */
static void go(uint32_t pings, unsigned has, double level_mps, double vertical_mps)
{
    for (uint32_t i = 0; i < pings; i++, sent++) {
        struct pose pose = pose_identity;
        loop_advance(d.loop, 100 * SECOND + sent * PING_NS);
        pose.t_ns = loop_now(d.loop);
        pose.has = has;
        CHECK(!has || pose_log_put(&d.poses, &pose));
        if (level_mps >= 0)
            CHECK(pose_log_bound(&d.poses, loop_now(d.loop), (double[]){level_mps, vertical_mps}));
        rig_send(&(struct rig_ping){.t_ns = loop_now(d.loop),
                                    .seq = sent + 1,
                                    .new_turn = sent % TURN_PINGS == 0,
                                    .head_units = turns ? sent % TURN_PINGS : 0,
                                    .head_turn = turns ? TURN_PINGS : 0,
                                    .az_rad = sent % TURN_PINGS * GEO_TURN / TURN_PINGS,
                                    .wide_deg = 3,
                                    .high_deg = 25});
    }
}

static void set_vehicle(double keep_mps, double max_mps, double current_mps)
{
    struct pose_drift drift;
    d.conf.vehicle.keep_mps = keep_mps;
    d.conf.vehicle.max_speed_mps = max_mps;
    d.conf.vehicle.current_mps = current_mps;
    wiring_drift(&d.conf, &drift);
    pose_log_set_drift(&d.poses, loop_now(d.loop), &drift);
}

static bool begin(double keep_mps, double max_mps, double current_mps)
{
    sent = 0;
    turns = true;
    if (!rig_start(CONF))
        return false;
    loop_advance(d.loop, 99 * SECOND);
    d.start_ns = loop_now(d.loop);
    set_vehicle(keep_mps, max_mps, current_mps);
    return true;
}

/* What status says; the same stands below a ring of which nothing is known. */
static const char *said(void)
{
    static char text[400];
    json_t *a = ask("status", json_object());
    snprintf(text, sizeof text, "%s", json_string_value(json_object_get(json_object_get(a, "pose"), "drift")));
    json_decref(a);
    CHECK(strlen(text) <= LONGEST);
    return text;
}

static const char *why_none_clear(const char *frame)
{
    const bool fixed = d.conf.vehicle.max_speed_mps <= 0; /* a drift takes a little at once */
    static char text[400];
    json_t *a = ask("sectors", json_pack("{s:s, s:f}", "frame", frame, "distance_m", fixed ? 9.0 : 9.99));
    const char *why = json_string_value(json_object_get(a, "why_none_clear"));
    snprintf(text, sizeof text, "%s", why ? why : "-");
    json_decref(a);
    CHECK(strlen(text) <= LONGEST);
    return text;
}

static void check_said(double keep_mps, double max_mps, unsigned has, const char *expected)
{
    CHECK(begin(keep_mps, max_mps, -1));
    go(2 * TURN_PINGS + 1, has, -1, -1);
    CHECK_STR(said(), expected);
    rig_end();
}

#define AUTO CONF_KEEP_AUTO
#define SEND "; send a position or velocity, or set "
#define KEEP "station_keeping in [vehicle]: with `station_keeping = 0.05 m/s` it would be "

/* Drift takes clear water away although nothing is missing of what was ever sent. */
TEST(poses_without_position_and_velocity_are_named)
{
    check_said(-1, 0, 0, ""); /* a fixed sonar */
    check_said(AUTO, 0, 0, "");
    check_said(-1, 0, POSE_ATTITUDE,
               "no position and no depth: 25.5 m of drift allowed for in a scan of 6 s" SEND "max_speed or " KEEP
               "0.4 m");
    check_said(AUTO, 0.5, POSE_ATTITUDE,
               "no position and no depth: 4.2 m of drift allowed for in a scan of 6 s" SEND KEEP "0.4 m");
    check_said(-1, 0.5, POSE_ATTITUDE | POSE_DEPTH,
               "no position: 3.0 m of drift allowed for in a scan of 6 s" SEND KEEP "0.3 m");
    check_said(
        AUTO, 0.5, POSE_DEPTH,
        "no attitude: the vehicle may have turned, so no direction is known; let the autopilot send ATTITUDE, or "
        "set station_keeping in [vehicle] where it neither moves nor turns");
    check_said(0.05, 0.5, POSE_ATTITUDE, "");
    check_said(-1, 0.5, POSE_ATTITUDE | POSE_VELOCITY, "");
    check_said(-1, 0.5, POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH, "");
}

/* Before a head has turned, the drift is a speed. */
TEST(before_the_first_turn_nothing_is_known_yet)
{
    CHECK(begin(AUTO, 1.5, -1));
    CHECK_STR(why_none_clear("body"), "nothing is known yet: no ping was received");
    go(12, POSE_ATTITUDE | POSE_DEPTH, -1, -1);
    CHECK_STR(why_none_clear("ned"), "nothing is clear yet: the first scan is not over");
    CHECK_STR(said(), "no position: 1.50 m/s of drift allowed for" SEND KEEP "0.05 m/s");
    go(2 * TURN_PINGS, POSE_ATTITUDE | POSE_DEPTH, -1, -1);
    char text[400];
    snprintf(text, sizeof text, "%s", said());
    CHECK(strstr(text, " of drift allowed for in a scan of 6 s; "));
    CHECK_STR(why_none_clear("ned"), text);
    CHECK_STR(why_none_clear("body"), text);
    loop_advance(d.loop, loop_now(d.loop) + 90 * SECOND);
    CHECK(strstr(why_none_clear("ned"), "s old (limit "));
    rig_end();
    CHECK(begin(-1, 0, -1)); /* no pose at all, and free water all around */
    go(2 * TURN_PINGS + 1, 0, -1, -1);
    CHECK_STR(why_none_clear("body"), "-");
    CHECK_STR(why_none_clear("ned"), "no attitude received, so north is unknown");
    rig_end();
}

/* A fan has no first scan: from its first ping on the drift is what is in the way. */
TEST(a_fan_has_no_first_scan)
{
    CHECK(begin(AUTO, 1.5, -1));
    turns = false;
    go(12, POSE_ATTITUDE | POSE_DEPTH, -1, -1);
    CHECK_STR(why_none_clear("ned"), said());
    CHECK_STR(said(), "no position: 1.50 m/s of drift allowed for" SEND KEEP "0.05 m/s");
    rig_end();
}

/* The figure behind a key is that which the drift has once the key is set. */
TEST(what_current_would_change_comes_true)
{
    static const struct {
        double keep_mps, level_mps, vertical_mps, current_mps;
        unsigned has;
        const char *keys, *metres;
    } rows[] = {
        {AUTO, 0.15, 0.05, -1, POSE_ATTITUDE | POSE_DEPTH, "set `current` in [vehicle]", "1.2 m"},
        {AUTO, 0.15, 0.05, -1, POSE_ATTITUDE, "set `current` in [vehicle]", "1.3 m"},
        {AUTO, 2.9, 0.5, -1, POSE_ATTITUDE | POSE_DEPTH, "set `current` in [vehicle]", "9.0 m"},
        {-1, 0.05, 0.05, -1, POSE_ATTITUDE | POSE_DEPTH, "set `station_keeping = auto` and `current` in", "0.6 m"},
        {-1, 0.05, 0.05, 0.3, POSE_ATTITUDE | POSE_DEPTH, "set `station_keeping = auto` in [vehicle]", "2.1 m"},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        char would[80];
        CHECK(begin(rows[i].keep_mps, 1.5, rows[i].current_mps));
        go(2 * TURN_PINGS + 1, rows[i].has, rows[i].level_mps, rows[i].vertical_mps);
        const double current_mps = rows[i].current_mps < 0 ? 0.05 : rows[i].current_mps;
        snprintf(would, sizeof would, "with `current = %g m/s` it would be %s, as the thrusters push now",
                 current_mps, rows[i].metres);
        CHECK(strstr(said(), would));
        CHECK(strstr(said(), rows[i].keys));
        set_vehicle(AUTO, 1.5, current_mps);
        go(2 * TURN_PINGS, rows[i].has, rows[i].level_mps, rows[i].vertical_mps);
        snprintf(would, sizeof would,
                 ": %s of drift allowed for in a scan of 6 s, by thrusters and `current`; a DVL", rows[i].metres);
        CHECK(strstr(said(), would));
        rig_end();
    }
}

/* A bridge to an autopilot says that there is a vehicle, before that sends anything: it is not fixed to a bench. */
TEST(a_vehicle_without_any_pose_is_not_fixed)
{
    for (int keeps = 0; keeps < 2; keeps++) {
        CHECK(begin(keeps ? 0 : AUTO, 0, -1));
        go(TURN_PINGS + 1, 0, -1, -1);
        CHECK_STR(why_none_clear("body"), "-");
        d.replay = false;
        json_decref(ask("pose", json_pack("{s:s}", "no_speed_bound", "vehicle")));
        go(TURN_PINGS, 0, -1, -1);
        CHECK(keeps ? strcmp(why_none_clear("body"), "-") == 0
                    : strncmp(why_none_clear("body"), "no attitude: the vehicle", 24) == 0);
        rig_end();
    }
}

/* ... with what to do about it. */
TEST(why_there_is_no_bound_is_said)
{
    static const struct {
        const char *word, *what;
    } rows[] = {
        {"messages", "SERVO_OUTPUT_RAW): let sonard-mavlink send"},
        {"rate", "come below 5 Hz: let sonard-mavlink ask for 20 Hz, or set SR0_RC_CHAN to 20"},
        {"parameters", "SERVOn_FUNCTION: let sonard-mavlink send"},
        {"frame", "does not know: frames 0 to 6"},
        {"motors", "(SERVOn_FUNCTION): each needs one"},
        {"sticks", "51 to 56): set it to 0"},
        {"pulses", "1900 us: see MOT_PWM_MIN"},
        {"clock", "clock jumps: see whether two"},
    };
    for (int known = 0; known < 2; known++)
        for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
            CHECK(begin(AUTO, 1.5, known ? 0.2 : -1));
            go(2 * TURN_PINGS + 1, POSE_ATTITUDE, 0.1, 0.1);
            go(24, POSE_ATTITUDE, -1, -1);
            d.replay = false;
            json_decref(ask("pose", json_pack("{s:s}", "no_speed_bound", rows[i].word)));
            CHECK(strstr(said(), rows[i].what));
            CHECK((strstr(said(), ", and set `current` in [vehicle]") == NULL) == known);
            rig_end();
        }
    CHECK(begin(AUTO, 1.5, 0.2));
    go(2 * TURN_PINGS + 1, POSE_ATTITUDE | POSE_DEPTH, 0.1, 0.1);
    go(TURN_PINGS, POSE_ATTITUDE | POSE_DEPTH, -1, -1);
    CHECK(strstr(said(), "; no bound of its speed comes: see whether sonard-mavlink still runs"));
    rig_end();
}

int main(void)
{
    RUN(poses_without_position_and_velocity_are_named);
    RUN(before_the_first_turn_nothing_is_known_yet);
    RUN(a_fan_has_no_first_scan);
    RUN(what_current_would_change_comes_true);
    RUN(a_vehicle_without_any_pose_is_not_fixed);
    RUN(why_there_is_no_bound_is_said);
    return test_end();
}
