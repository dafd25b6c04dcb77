/* SPDX-License-Identifier: MIT */
/* test_rig_scene - what a vehicle that turns says of its surroundings, in its own axes and in the world's. */
#include "tests/lib/rig.h"

#define BOX "box -6 9 -5 4 -20 20\n"

static const double wall_m[4] = {9, 4, 6, 5}; /* to the north, east, south, west */

/* One sector of 5 degrees. */
static void check_wall(const char *frame, int azimuth_deg, double there_m)
{
    json_t *reply = rig_ask("sectors", "\"frame\":\"%s\",\"distance_m\":0", frame);
    json_t *sector = json_array_get(json_object_get(reply, "sectors"), (size_t)azimuth_deg / 5);
    CHECK_STR(json_string_value(json_object_get(sector, "state")), "blocked");
    CHECK_NEAR(json_number_value(json_object_get(sector, "range_m")), there_m, 0.035, 0.1);
    CHECK(json_number_value(json_object_get(sector, "free_to_m")) < there_m + 0.1);
    json_decref(reply);
}

/* yaw: of the vehicle, a multiple of 90 degrees. */
static void check_walls(int yaw_deg)
{
    for (int i = 0; i < 4; i++) {
        check_wall("ned", 90 * i, wall_m[i]);
        check_wall("body", (90 * i - yaw_deg + 360) % 360, wall_m[i]);
    }
}

TEST(what_was_seen_stays_where_it_is_when_the_vehicle_turns)
{
    rig_start(BOX, "[pose]\nmax_age = 0.8 s\n[vehicle]\nstation_keeping = 0 m/s\n[grid]\nforget = 160 s\n");
    rig.pose_every_ns = RIG_S / 10;
    rig_run(70);
    check_walls(0);
    rig_command("silent 4"); /* so all is memory */
    rig.turn_dps = 30;
    rig_run(3);
    rig.turn_dps = 0;
    rig_run(0.2);
    check_walls(90);
    rig_run(70); /* and now a turn of its head */
    check_walls(90);
    rig.turn_dps = -45; /* while it pings */
    rig_run(4);
    rig.turn_dps = 0;
    rig_run(70);
    check_walls(-90);
    rig.pose_every_ns = 0;
    rig_run(1);
    CHECK_INT(rig_states(), RIG_UNKNOWN);
    json_t *answer = rig_ask("blocked", "\"azimuth_deg\":0,\"distance_m\":1");
    const char *reason = json_string_value(json_object_get(answer, "reason"));
    CHECK(strstr(reason, "the pose is too old: the attitude from a client is ") == reason);
    json_decref(answer);
    rig.pose_every_ns = RIG_S / 10;
    rig_run(0.01);
    check_wall("ned", 0, 9);
    rig_end();
}

TEST(before_the_first_ping_all_is_unknown_and_what_no_beam_reaches_stays_so)
{
    rig_start(BOX, "");
    rig_run(0.05);
    CHECK_INT(rig_states(), RIG_UNKNOWN);
    json_t *answer = rig_ask("blocked", "\"azimuth_deg\":0,\"distance_m\":1");
    CHECK_STR(json_string_value(json_object_get(answer, "state")), "unknown");
    CHECK_STR(json_string_value(json_object_get(answer, "reason")), "no data from the sonar");
    json_decref(answer);
    rig_run(70);
    answer = rig_ask("blocked", "\"azimuth_deg\":0,\"elevation_deg\":60,\"distance_m\":1");
    CHECK_STR(json_string_value(json_object_get(answer, "state")), "unknown");
    CHECK_STR(json_string_value(json_object_get(answer, "reason")), "never observed");
    json_decref(answer);
    check_wall("body", 0, 9);
    rig_end();
}

#define SMALL    "mount = 0.2 0 0.1 m\n[vehicle]\nradius = 0.287 m\nheight = 0.25 m\nnear = 2.6 m\n"
#define HALF_M   0.287
#define SLOW_MPS 0.1

/* What is allowed to it straight ahead, and the stopping distance at that. */
static double allowed(double *stop_m)
{
    json_t *answer = rig_ask("limit", "\"velocity_mps\":[0.5,0,0]");
    const double speed_mps = json_number_value(json_object_get(answer, "speed_mps"));
    *stop_m = json_number_value(json_object_get(answer, "stop_m"));
    json_decref(answer);
    return speed_mps;
}

/* What was seen beyond `near` may have come nearer than it: the promise is about what no beam shows. */
TEST(near_is_no_promise_to_a_vehicle_that_may_have_moved)
{
    double stop_m;
    rig_start(BOX, SMALL);
    rig.pose_every_ns = RIG_S / 10;
    rig.unplaced = true;
    rig_run(28);
    for (int north_m = 1; north_m <= 8; north_m++) { /* towards the wall */
        char command[32];
        snprintf(command, sizeof command, "pose %d 0 0 0", north_m);
        rig_command(command);
        for (int i = 0; i < 10; i++) {
            rig_run(0.5);
            CHECK(allowed(&stop_m) <= SLOW_MPS || stop_m + HALF_M <= wall_m[0] - north_m);
        }
    }
    rig_end();
}

/* Every answer that may say clear or free names what it holds for. */
TEST(answers_name_their_target)
{
    static const struct {
        const char *method, *params;
    } ask[] = {{"blocked", "\"azimuth_deg\":0,\"distance_m\":3"},
               {"sectors", ""},
               {"nearest", ""},
               {"limit", "\"velocity_mps\":[1,0,0]"},
               {"limit", "\"velocity_mps\":[0,0,0]"},
               {"time_to_collision", "\"velocity_mps\":[1,0,0]"}};
    static const struct {
        const char *extract, *target;
        double bottom_db; /* 0: null */
    } conf[] = {{"", "wall", 15},
                {"[extract]\ntarget = net\nbottom = off\n", "net", 0},
                {"[extract]\nno_echo = range\n", "wall", 0}, /* looks for no bottom */
                {"[extract]\ntarget = 20 dB\nbottom = 20 dB\n", "20 dB below a wall", 20}};

    for (size_t c = 0; c < sizeof conf / sizeof *conf; c++) {
        rig_start(BOX, conf[c].extract);
        for (size_t k = 0; k < sizeof ask / sizeof *ask; k++) {
            json_t *answer = rig_ask(ask[k].method, "%s", ask[k].params);
            CHECK_STR(json_string_value(json_object_get(answer, "target")), conf[c].target);
            const json_t *bottom = json_object_get(answer, "bottom_db");
            CHECK(conf[c].bottom_db > 0 ? json_number_value(bottom) == conf[c].bottom_db : json_is_null(bottom));
            if (test_case_failed)
                printf("(%s)\n", ask[k].method);
            json_decref(answer);
        }
        json_t *of = rig_ask("explain", "\"azimuth_deg\":0,\"distance_m\":3");
        CHECK_STR(json_string_value(json_object_get(json_object_get(of, "answer"), "target")), conf[c].target);
        json_decref(of);
        rig_end();
    }
}

/* Which obstacles free water speaks of: of the prior, by the keys, until the sonar's own echoes say more. */
TEST(answers_say_which_obstacles_they_speak_of)
{
    rig_start(BOX, "[extract]\ntarget = pile\n");
    json_t *status = rig_ask("status", "%s", "");
    CHECK(json_is_null(json_object_get(json_array_get(json_object_get(status, "sensors"), 0), "detects")));
    json_decref(status);
    rig_run_pings(40);
    json_t *of = rig_ask("explain", "\"azimuth_deg\":0,\"distance_m\":3");
    const json_t *detects = json_array_get(json_object_get(of, "detects"), 0);
    CHECK_STR(json_string_value(json_object_get(detects, "sensor")), "front");
    CHECK_STR(json_string_value(json_object_get(detects, "target")), "pile");
    CHECK_STR(json_string_value(json_object_get(detects, "from")), "prior");
    CHECK(json_number_value(json_object_get(detects, "level_db")) < -27);
    CHECK(json_integer_value(json_object_get(detects, "counts")) > 0);
    json_decref(of);
    rig_end();
}

int main(void)
{
    RUN(what_was_seen_stays_where_it_is_when_the_vehicle_turns);
    RUN(near_is_no_promise_to_a_vehicle_that_may_have_moved);
    RUN(answers_name_their_target);
    RUN(answers_say_which_obstacles_they_speak_of);
    RUN(before_the_first_ping_all_is_unknown_and_what_no_beam_reaches_stays_so);
    return test_end();
}
