/* SPDX-License-Identifier: MIT */
/* test_rig_deaf - a Ping360 whose receiver stops hearing returns what open water returns: it is not called clear. */
#include "tests/lib/rig.h"

#define BOX   "box -3 3 -3 3 -20 20\n"
#define STILL "[vehicle]\nnear = 1 m\nstation_keeping = 0 m/s\n"
#define TURN  70 /* seconds, and then some */

static int sectors(const char *state, double distance_m)
{
    json_t *reply = rig_ask("sectors", "\"distance_m\":%g", distance_m), *sector;
    size_t i;
    int n = 0;
    json_array_foreach(json_object_get(reply, "sectors"), i, sector) n +=
        strcmp(json_string_value(json_object_get(sector, "state")), state) == 0;
    json_decref(reply);
    return n;
}

static void check_doubt(const char *word)
{
    json_t *status = rig_ask("status", "%s", "");
    json_t *doubt = json_object_get(json_array_get(json_object_get(status, "sensors"), 0), "hearing_doubt");
    if (word && json_is_string(doubt) && !strstr(json_string_value(doubt), word))
        printf("%s\n", json_string_value(doubt));
    if (word)
        CHECK(json_is_string(doubt) && strstr(json_string_value(doubt), word));
    else
        CHECK(json_is_null(doubt));
    CHECK_STR(json_string_value(json_object_get(status, "data")),
              word ? "the sonar may hear nothing (hearing_doubt)" : "ok");
    json_decref(status);
}

/* A wall all around, which the head shows; then its receiver fails; then it is mended. */
static void fail_and_mend(const char *command, const char *word)
{
    rig_start(BOX, STILL);
    rig_run(TURN);
    CHECK_INT(sectors("blocked", 4.5), 72);
    const int before = sectors("clear", 3.2); /* towards the corners */
    check_doubt(NULL);
    rig_command(command);
    for (int i = 0; i < 8; i++) {
        rig_run(TURN / 4);
        CHECK_INT(sectors("clear", 4.5), 0);
        CHECK(sectors("clear", 3.2) <= before);
    }
    check_doubt(word);
    rig_command("hears 0");
    rig_run(strcmp(command, "hears 4") == 0 ? 2 * TURN
                                            : TURN); /* where walls come back: as long as it takes to hear all */
    check_doubt(NULL);
    CHECK_INT(sectors("blocked", 4.5), 72);
    CHECK_INT(sectors("clear", 2), 72);
    rig_end();
}

TEST(a_dead_transducer_clears_no_wall)
{
    fail_and_mend("hears 1", "ring-down");
}

TEST(a_stuck_receiver_clears_no_wall)
{
    fail_and_mend("hears 2", "vary");
}

TEST(zeros_clear_no_wall)
{
    fail_and_mend("hears 3", "ring-down");
}

/* The transmission comes through the cable's stump: loud first samples are no ring-down. */
TEST(a_cable_that_is_off_clears_no_wall)
{
    fail_and_mend("hears 5", "ring-down");
}

/* What rings and hears no echo is open water, but for walls that are gone on all sides at once. */
TEST(walls_that_are_gone_on_all_sides_are_a_doubt)
{
    fail_and_mend("hears 4", "gone at once");
}

/* In air a head has its ring-down, and no echo. */
TEST(out_of_the_water_nothing_is_clear)
{
    rig_start("", "mount = 0 0 -0.8 m\n[vehicle]\nnear = 2 m\n"); /* the vehicle is at the surface */
    rig.pose_every_ns = RIG_S / 10;
    rig_run(TURN);
    check_doubt("out of the water");
    CHECK_INT(sectors("clear", 4), 0);
    rig_end();
    rig_start("", "mount = 0 0 -0.2 m\n[vehicle]\nnear = 2 m\n"); /* give or take */
    rig.pose_every_ns = RIG_S / 10;
    rig_run(TURN);
    check_doubt(NULL);
    CHECK(sectors("clear", 4) > 0);
    rig_end();
}

/* Nothing is known of the head but that every head rings. */
TEST(a_head_that_never_heard_clears_nothing)
{
    static const int kinds[] = {1, 2, 3, 5};
    for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
        const int kind = kinds[k];
        char command[16];
        snprintf(command, sizeof command, "hears %d", kind);
        rig_start("", STILL);
        rig_command(command);
        rig_run(TURN);
        CHECK_INT(sectors("clear", 4), 0);
        check_doubt(kind == 2 ? "vary" : "ring-down");
        rig_command("hears 0");
        rig_run(kind == 5 ? 2 * TURN : TURN); /* its first pings have shown the shorter one to be usual */
        check_doubt(NULL);
        CHECK_INT(sectors("clear", 3), 72);
        rig_end();
    }
}

int main(void)
{
    RUN(a_dead_transducer_clears_no_wall);
    RUN(a_stuck_receiver_clears_no_wall);
    RUN(zeros_clear_no_wall);
    RUN(a_cable_that_is_off_clears_no_wall);
    RUN(walls_that_are_gone_on_all_sides_are_a_doubt);
    RUN(out_of_the_water_nothing_is_clear);
    RUN(a_head_that_never_heard_clears_nothing);
    return test_end();
}
