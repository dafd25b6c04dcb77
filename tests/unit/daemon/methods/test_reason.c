/* SPDX-License-Identifier: MIT */
/* test_reason - the sentences that answers give as their reason name the thing and its figure. */
#include "tests/lib/test.h"

#include "daemon/methods/reason.h"

#include <math.h>
#include <string.h>

#define SECOND 1000000000ull

static struct methods_env env;

static void set_up(void)
{
    memset(&env, 0, sizeof env);
    env.loop = loop_new(true);
    env.conf.n_sonars = 2;
    strcpy(env.conf.sonar[0].name, "front");
    strcpy(env.conf.sonar[1].name, "down");
    env.conf.pose.max_age_s = 1;
    pose_log_init(&env.poses, SECOND);
}

/* The sentence for these, with everything else that a reason may have. */
static const char *said(enum answer_state state, enum answer_reason why, const struct answer_now *now)
{
    static char text[REASON_SIZE];
    return reason_sentence(&env, now,
                           &(struct reason){.state = state,
                                            .why = why,
                                            .range_m = 4.2,
                                            .free_to_m = 3.1099,
                                            .asked_m = 5,
                                            .blind_to_m = 0.7501,
                                            .age_s = 41.2,
                                            .clear_for_s = 40},
                           text);
}

TEST(each_names_its_figure)
{
    static const struct {
        enum answer_state state;
        enum answer_reason why;
        const char *want;
    } rows[] = {
        {ANSWER_BLOCKED, ANSWER_HEARD, "echo at 4.20 m"},
        {ANSWER_CLEAR, ANSWER_HEARD, "free up to 3.10 m"}, /* never more than was found */
        {ANSWER_UNKNOWN, ANSWER_BEYOND, "no obstacle detected; observed only to 3.10 m of 5.00 m"},
        {ANSWER_UNKNOWN, ANSWER_BOTTOM,
         "the bottom may begin there, by the altitude of 1.20 m; free up to 3.10 m of 5.00 m"},
        {ANSWER_UNKNOWN, ANSWER_BLIND, "inside the blind zone of the sonar, which ends at 0.76 m"},
        {ANSWER_UNKNOWN, ANSWER_STALE, "last scan of this direction is 41.2 s old (limit 40.0 s)"},
        {ANSWER_UNKNOWN, ANSWER_MOVED, "data outdated: the vehicle has moved since this direction was scanned"},
        {ANSWER_UNKNOWN, ANSWER_NEVER, "never observed"},
        {ANSWER_UNKNOWN, ANSWER_OUTSIDE, "outside the grid's coverage"},
        {ANSWER_UNKNOWN, ANSWER_NO_FRAME, "no attitude received, so north is unknown"},
        {ANSWER_UNKNOWN, ANSWER_NO_DATA, "no data from the sonar"},
    };
    struct answer_now now = {.pose = pose_identity};
    now.pose.altitude_m = 1.2;
    set_up();
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        CHECK_STR(said(rows[i].state, rows[i].why, &now), rows[i].want);
    loop_free(env.loop);
}

TEST(what_hides_the_water_is_named)
{
    struct answer_now now = {.pose = pose_identity};
    struct reason r = {.state = ANSWER_UNKNOWN,
                       .why = ANSWER_BEYOND,
                       .free_to_m = 0.75,
                       .asked_m = 1.5,
                       .age_s = 2,
                       .hidden = "hidden by the vehicle's own echo"};
    char text[REASON_SIZE];
    set_up();
    now.pose.drift_mps = 0.05;
    CHECK_STR(
        reason_sentence(&env, &now, &r, text),
        "no obstacle detected; observed only to 0.75 m of 1.50 m: hidden by the vehicle's own echo; no position "
        "and no depth: 0.1 m of drift allowed for");
    r.hidden = "";
    now.pose.drift_mps = 0;
    CHECK_STR(reason_sentence(&env, &now, &r, text), "no obstacle detected; observed only to 0.75 m of 1.50 m");
    loop_free(env.loop);
}

TEST(the_sonar_that_is_offline_is_named_when_it_is_one)
{
    struct answer_now now = {.pose = pose_identity, .lost = 1};
    set_up();
    CHECK_STR(said(ANSWER_UNKNOWN, ANSWER_SILENT, &now), "sonar front, which covers this direction, is offline");
    now.lost = 2;
    CHECK_STR(said(ANSWER_UNKNOWN, ANSWER_SILENT, &now), "sonar down, which covers this direction, is offline");
    now.lost = 3;
    CHECK_STR(said(ANSWER_UNKNOWN, ANSWER_SILENT, &now), "the sonar that covers this direction is offline");
    loop_free(env.loop);
}

TEST(figures_that_are_not_known_are_left_out)
{
    char text[REASON_SIZE];
    const struct answer_now now = {.pose = pose_identity};
    set_up();
    CHECK_STR(reason_sentence(&env, &now, &(struct reason){.state = ANSWER_CLEAR}, text), "free as far as asked");
    CHECK_STR(reason_sentence(&env, &now, &(struct reason){.state = ANSWER_UNKNOWN, .why = ANSWER_BEYOND}, text),
              "no obstacle detected, but not observed as far as asked");
    CHECK_STR(reason_sentence(&env, &now, &(struct reason){.state = ANSWER_UNKNOWN, .why = ANSWER_BLIND}, text),
              "inside the blind zone of the sonar");
    /* an age below the limit is that of something else */
    CHECK_STR(reason_sentence(&env, &now,
                              &(struct reason){.state = ANSWER_UNKNOWN, .why = ANSWER_STALE, .clear_for_s = 30},
                              text),
              "last scan of this direction is too old");
    CHECK_STR(said(ANSWER_UNKNOWN, ANSWER_POSE_LOST, &now), "the pose is too old");
    loop_free(env.loop);
}

TEST(an_old_pose_says_how_old_it_is)
{
    const struct answer_now now = {.pose = pose_identity};
    char text[REASON_SIZE];
    struct pose pose = pose_identity;
    set_up();
    pose.t_ns = SECOND;
    pose.has = POSE_ATTITUDE;
    CHECK(pose_log_put(&env.poses, &pose));
    loop_advance(env.loop, 1 * SECOND + 3200000000ull);
    CHECK_STR(said(ANSWER_UNKNOWN, ANSWER_POSE_LOST, &now),
              "the pose is too old: the attitude from the capture is 3.2 s old (limit 1 s)");
    /* and whoever names another figure, as `limit` does, says whose pose is missing too */
    CHECK(strstr(reason_cause(&env, &now, ANSWER_POSE_LOST, text), "the attitude from the capture is 3.2 s old"));
    CHECK_STR(reason_cause(&env, &now, ANSWER_NEVER, text), "never observed");
    loop_free(env.loop);
}

TEST(drift_is_named_beside_the_reason)
{
    struct answer_now now = {.pose = pose_identity};
    char text[REASON_SIZE];
    set_up();
    now.pose.drift_mps = 0.05;
    CHECK_STR(said(ANSWER_UNKNOWN, ANSWER_NEVER, &now),
              "never observed; no position and no depth: 2.1 m of drift allowed for");
    CHECK_STR(reason_with_pose(&now, "never observed", -1, text), "never observed");
    /* what was asked about is no end of the blind zone: drift alone may have taken it away */
    CHECK_STR(said(ANSWER_UNKNOWN, ANSWER_BLIND, &now),
              "water next to the vehicle: in the blind zone, or scanned too long ago; no position and no depth: "
              "2.1 m of drift allowed for");
    CHECK_STR(reason_cause(&env, &now, ANSWER_BLIND, text),
              "water next to the vehicle: in the blind zone, or scanned too long ago");
    now.pose.has = POSE_DEPTH;
    CHECK_STR(reason_with_pose(&now, "never observed", 2, text),
              "never observed; no position: 0.1 m of drift allowed for");
    now.pose.has = POSE_POSITION;
    CHECK_STR(reason_with_pose(&now, "never observed", 2, text),
              "never observed; no depth: 0.1 m of drift allowed for");
    now.pose.heading_adrift = true;
    CHECK_STR(reason_with_pose(&now, "never observed", -1, text),
              "never observed; no attitude: the vehicle may have turned");
    loop_free(env.loop);
}

TEST(an_old_pose_that_counts_says_what_it_leaves_open)
{
    struct answer_now now = {.pose = pose_identity, .pose_fresh = true};
    char text[REASON_SIZE];
    set_up();
    now.pose.uncertain_m = 0.1;
    now.pose.uncertain_rad = geo_rad(1);
    CHECK_STR(reason_with_pose(&now, "never observed", -1, text), "never observed");
    now.pose.uncertain_rad = geo_rad(62);
    CHECK_STR(reason_with_pose(&now, "never observed", -1, text),
              "never observed; since the last pose the vehicle may have turned 62 deg");
    now.pose.uncertain_m = 4.4;
    CHECK_STR(reason_with_pose(&now, "never observed", -1, text),
              "never observed; since the last pose the vehicle may have moved 4.4 m and turned 62 deg");
    now.pose.uncertain_rad = 0;
    CHECK_STR(said(ANSWER_BLOCKED, ANSWER_HEARD, &now),
              "echo at 4.20 m; since the last pose the vehicle may have moved 4.4 m");
    now.pose_fresh = false;
    CHECK_STR(said(ANSWER_BLOCKED, ANSWER_HEARD, &now), "echo at 4.20 m");
    loop_free(env.loop);
}

TEST(an_echo_beyond_what_was_asked_says_from_where_on_it_may_block)
{
    const struct answer_now now = {.pose = pose_identity};
    const struct reason far = {.state = ANSWER_BLOCKED, .range_m = 6, .near_m = 2.919, .asked_m = 3};
    char text[REASON_SIZE];
    set_up();
    CHECK_STR(reason_sentence(&env, &now, &far, text), "echo at 6.00 m, which may begin at 2.91 m");
    loop_free(env.loop);
}

/* The longest that there can be is whole. */
TEST(nothing_is_cut_off)
{
    struct answer_now now = {.pose = pose_identity, .lost = 1};
    set_up();
    memset(env.conf.sonar[0].name, 'x', sizeof env.conf.sonar[0].name - 1);
    now.pose.drift_mps = 5;
    now.pose.uncertain_m = 100;
    now.pose.uncertain_rad = GEO_PI;
    now.pose_fresh = true;
    const char *text = said(ANSWER_UNKNOWN, ANSWER_SILENT, &now);
    CHECK(strstr(text,
                 "is offline; no position and no depth: 206.0 m of drift allowed for; since the last pose the "
                 "vehicle may have moved 100.0 m and turned 180 deg"));
    text = said(ANSWER_UNKNOWN, ANSWER_MOVED, &now);
    CHECK(strstr(text, "was scanned; no position and no depth: 206.0 m of drift allowed for"));
    loop_free(env.loop);
}

int main(void)
{
    RUN(each_names_its_figure);
    RUN(what_hides_the_water_is_named);
    RUN(the_sonar_that_is_offline_is_named_when_it_is_one);
    RUN(figures_that_are_not_known_are_left_out);
    RUN(an_old_pose_says_how_old_it_is);
    RUN(drift_is_named_beside_the_reason);
    RUN(an_old_pose_that_counts_says_what_it_leaves_open);
    RUN(an_echo_beyond_what_was_asked_says_from_where_on_it_may_block);
    RUN(nothing_is_cut_off);
    return test_end();
}
