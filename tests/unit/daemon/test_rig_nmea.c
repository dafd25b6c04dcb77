/* SPDX-License-Identifier: MIT */
/*
 * test_rig_nmea - headings that waited while the process was held up: nobody knows since when, so none is a pose. And
 * what else comes over the line: it is no reason to check the baud rate.
 */
#include "tests/lib/rig.h"

static void say(const char *text)
{
    CHECK_INT(write(rig.instrument, text, strlen(text)), strlen(text));
}

static double heading_deg(void)
{
    struct pose pose = pose_identity;
    pose_log_at(&rig.d.poses, rig_now_ns, &pose);
    const double *q = pose.attitude;
    return geo_deg(geo_wrap(2 * atan2(q[3], q[0])));
}

static uint64_t count(const char *name)
{
    json_t *status = rig_ask("status", "%s", "");
    const uint64_t n = (uint64_t)json_integer_value(json_object_get(json_object_get(status, "nmea"), name));
    json_decref(status);
    return n;
}

static void begin(void)
{
    rig_start("cylinder 5 0 0.5\n", RIG_NMEA "[pose]\nmax_age = 60 s\n");
    say("$GPHDT,90.0,T*0C\r\n");
    rig_run(0.1);
    CHECK_INT(count("values"), 1);
    CHECK_NEAR(heading_deg(), 90, 0, 1e-9);
}

TEST(what_waited_is_counted_and_not_used)
{
    begin();
    say("$GPHDT,200.0,T*37\r\n");
    rig_hold(5);
    say("$GPHDT,210.0,T*36\r\n");
    rig_run(0.1);
    CHECK_INT(count("late_bytes"), 2 * 19);
    CHECK_INT(count("values"), 1);
    CHECK_NEAR(heading_deg(), 90, 0, 1e-9);
    say("$GPHDT,200.0,T*37\r\n");
    rig_run(0.1);
    CHECK_INT(count("values"), 2);
    CHECK_INT(count("late_bytes"), 2 * 19);
    CHECK_NEAR(heading_deg(), 200, 0, 5); /* the turn since then goes on */
    rig_end();
}

/* A sentence whose end waited came as late as that, and its beginning belongs to no later end. */
TEST(half_a_sentence_that_waited_is_none)
{
    begin();
    say("$GPHDT,2");
    rig_run(0.1);
    say("00.0,T*37\r\n$GPHDT,1");
    rig_hold(5);
    rig_run(0.1);
    CHECK_INT(count("values"), 1);
    say("00.0,T*37\r\n"); /* behind the first half it would be whole */
    rig_run(0.1);
    CHECK_INT(count("values"), 1);
    CHECK_NEAR(heading_deg(), 90, 0, 1e-9);
    rig_end();
}

/* More than one read takes: the second one is in time, and what it reads is not. */
TEST(all_that_waited_is_left_out_however_much_it_is)
{
    enum { SENTENCES = 500 };
    static char text[19 * SENTENCES + 1];
    begin();
    for (int i = 0; i < SENTENCES; i++)
        memcpy(text + 19 * i, "$GPHDT,200.0,T*37\r\n", 19);
    say(text);
    rig_hold(5);
    rig_run(0.2);
    CHECK_INT(count("late_bytes"), SENTENCES * 19);
    CHECK_INT(count("values"), 1);
    CHECK_NEAR(heading_deg(), 90, 0, 1e-9);
    rig_end();
}

TEST(a_short_wait_makes_nothing_late)
{
    begin();
    say("$GPHDT,200.0,T*37\r\n");
    rig_hold(0.05);
    rig_run(0.1);
    CHECK_INT(count("late_bytes"), 0);
    CHECK_INT(count("values"), 2);
    CHECK_NEAR(heading_deg(), 200, 0, 1e-9);
    rig_end();
}

TEST(what_a_multiplexer_sends_beside_is_no_garbage)
{
    begin();
    rig_log_begin();
    for (int i = 0; i < 10; i++) {
        say("!AIVDM,1,1,,A,13aGua?P00PHfERNFruh0?vN289E,0*36\r\n\\s:r1*0A\\!AIVDM,1,1,,A,x,0*5E\r\n");
        rig_run(1);
    }
    CHECK_INT(count("garbage_bytes"), 0);
    CHECK_INT(count("bad_checksum"), 0);
    CHECK_INT(count("other"), 20);
    CHECK_INT(rig_log_count("discarded"), 0);
    CHECK_INT(rig_log_count("baud rate"), 0);
    rig_log_end();
    say("\\s:r1*0A\\$GPHDT,200.0,T*37\r\n");
    rig_run(0.1);
    CHECK_NEAR(heading_deg(), 200, 0, 5);
    rig_end();
}

int main(void)
{
    RUN(what_a_multiplexer_sends_beside_is_no_garbage);
    RUN(what_waited_is_counted_and_not_used);
    RUN(half_a_sentence_that_waited_is_none);
    RUN(all_that_waited_is_left_out_however_much_it_is);
    RUN(a_short_wait_makes_nothing_late);
    return test_end();
}
