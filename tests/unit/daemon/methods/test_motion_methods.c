/* SPDX-License-Identifier: MIT */
/*
 * test_motion_methods - what `limit` gives as its reason where nothing limits, and that an echo nearer than `near`
 * blocks whatever is asked: a level head that stands still and hears free water, or one post.
 */
#include "tests/lib/daemon_rig.h"

#define SECOND     1000000000ull
#define TURN_PINGS 144
#define PING_NS    (SECOND / 25)

/* A fan of 25 degrees is as high as the body 2 m away; nearer than that the water below is known by promise alone. */
#define CONF(vehicle)                                                                                             \
    "[sonar head]\ndevice = echolist\nport = can:can0\nrange = 10 m\n"                                            \
    "[extract]\nminimum_range = 10 m\nno_echo = range\n"                                                          \
    "[vehicle]\nradius = 0.3 m\nheight = 0.2 m\nmargin = 0.1 m\n" vehicle

#define PROMISED "near = 2 m\n"

/* Two turns of the head, and the bow once more; post_m: range of what stands ahead, 0: nothing. */
static bool begin(const char *conf, double post_m)
{
    if (!rig_start(conf))
        return false;
    for (uint32_t i = 0; i <= 2 * TURN_PINGS; i++) {
        const uint32_t at = i % TURN_PINGS;
        rig_send(&(struct rig_ping){.t_ns = 100 * SECOND + i * PING_NS,
                                    .seq = i + 1,
                                    .new_turn = at == 0,
                                    .az_rad = at * GEO_TURN / TURN_PINGS,
                                    .wide_deg = 3,
                                    .high_deg = 25,
                                    .range_m = at == 0 ? post_m : 0});
    }
    return true;
}

static json_t *limit(double ahead_mps, double down_mps)
{
    return ask("limit", json_pack("{s:[f, f, f]}", "velocity_mps", ahead_mps, 0.0, down_mps));
}

TEST(the_reason_of_limit_is_what_the_configuration_makes_of_unknown_water)
{
    /* At 0.4 m/s it stops within 0.6 m. Nobody has heard how far it may go within clear_for, nor downwards. */
    static const struct {
        const char *conf;
        double ahead_mps, down_mps;
        const char *by, *reason;
    } row[] = {
        {CONF(PROMISED "unknown = stop\n"), 0.4, 0, "nothing", "free over the stopping distance of 0.60 m"},
        {CONF(PROMISED "unknown = slow\n"), 0.4, 0, "nothing", "free over the stopping distance of 0.60 m"},
        {CONF(PROMISED "unknown = ignore\n"), 0.4, 0, "nothing", "free over the stopping distance of 0.60 m"},
        {CONF("unknown = stop\n"), 0, 0.05, "unknown", "unknown beyond "},
        {CONF("unknown = slow\n"), 0, 0.4, "unknown", "unknown beyond "},
        {CONF("unknown = slow\n"), 0, 0.05, "nothing", "slow enough for unknown water: never observed"},
        {CONF("unknown = ignore\n"), 0, 0.4, "nothing", "unknown water is ignored: never observed"},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        if (!begin(row[i].conf, 0)) {
            CHECK(false);
            return;
        }
        json_t *a = limit(row[i].ahead_mps, row[i].down_mps);
        const char *by = json_string_value(json_object_get(a, "limited_by")),
                   *reason = json_string_value(json_object_get(a, "reason"));
        if (!by || !reason || strcmp(by, row[i].by) != 0 ||
            strncmp(reason, row[i].reason, strlen(row[i].reason)) != 0) {
            printf("row %zu: by %s: %s\n", i, by, reason);
            test_case_failed = true;
        }
        json_decref(a);
        rig_end();
    }
}

/* `near` promises that nothing stands there unheard; what was heard there is an obstacle. */
TEST(a_post_nearer_than_near_blocks_every_answer)
{
    static const double post_m[] = {0.35, 1, 1.9};
    for (size_t i = 0; i < sizeof post_m / sizeof post_m[0]; i++) {
        if (!begin(CONF(PROMISED "unknown = ignore\n"), post_m[i])) {
            CHECK(false);
            return;
        }
        json_t *a = limit(0.8, 0);
        CHECK_STR(json_string_value(json_object_get(a, "limited_by")), "blocked");
        CHECK_NEAR(number(a, "blocked_m"), post_m[i] - 0.4, 0, 0.1);
        json_decref(a);
        a = ask("time_to_collision",
                json_pack("{s:[f, f, f], s:f}", "velocity_mps", 0.5, 0.0, 0.0, "ahead_s", 5.0));
        CHECK(says(a, "blocked"));
        json_decref(a);
        a = ask("nearest", json_pack("{s:[f, f]}", "elevation_deg", -5.0, 5.0));
        CHECK(says(a, "blocked"));
        CHECK_NEAR(number(a, "range_m"), post_m[i], 0, 0.1);
        json_decref(a);
        a = ask("blocked", json_pack("{s:f, s:f, s:f}", "azimuth_deg", 0.0, "distance_m", 3.0, "radius_m", 0.3));
        CHECK(says(a, "blocked"));
        json_decref(a);
        a = ask("blocked",
                json_pack("{s:f, s:f, s:f}", "azimuth_deg", 0.0, "distance_m", 3.0, "half_angle_deg", 2.0));
        CHECK(says(a, "blocked"));
        json_decref(a);
        a = ask("sectors", json_pack("{s:i, s:f}", "count", 8, "distance_m", 3.0));
        CHECK(says(json_array_get(json_object_get(a, "sectors"), 0), "blocked"));
        json_decref(a);
        rig_end();
    }
}

int main(void)
{
    RUN(the_reason_of_limit_is_what_the_configuration_makes_of_unknown_water);
    RUN(a_post_nearer_than_near_blocks_every_answer);
    return test_end();
}
