/* SPDX-License-Identifier: MIT */
/* test_rig_dead_line - a port that is open and dead until it is closed and opened again, as a USB adapter is whose
 * transfers have stopped: it is opened anew before long, whoever it belongs to, and the log says so once. */
#include "tests/lib/rig.h"

#define BOX "box -6 7 -5 4 -20 20\n"

TEST(a_sonar_behind_a_dead_port_pings_again)
{
    rig_start(BOX, "");
    rig_log_begin();
    rig_run_pings(20);
    rig_dead(true);
    rig_run(9);
    CHECK_INT(rig_stats().reconnects, 0);
    rig_run(3);
    CHECK_INT(rig_stats().reconnects, 1);
    rig_run_pings(20);
    CHECK_STR(rig_status("state", true), "running");
    CHECK_INT(rig_log_count("closing and opening the port"), 1);
    CHECK_INT(rig_log_count("messages come in again"), 1);
    CHECK_INT(rig_log_count("lost"), 0);
    rig_log_end();
    rig_end();
}

/* A head without power looks the same from here. */
TEST(a_sonar_that_stays_silent_is_tried_ever_less_often_and_told_once)
{
    rig_start(BOX, "");
    rig_log_begin();
    rig_run_pings(20);
    rig_command("silent 1000");
    rig_run(8);
    CHECK_INT(rig_stats().reconnects, 0);
    rig_run(72); /* after 10, 30 and 70 s */
    CHECK_INT(rig_stats().reconnects, 3);
    CHECK_STR(rig_status("state", true), "silent");
    rig_run(240); /* and 150 and 310 s */
    CHECK_INT(rig_stats().reconnects, 5);
    CHECK_INT(rig_log_count("closing and opening the port"), 1);
    CHECK_INT(rig_log_count("retrying"), 1);
    rig_command("silent 0");
    RIG_UNTIL(strcmp(rig_status("state", true), "running") == 0, 20);
    CHECK_INT(rig_stats().reconnects, 5);
    rig_log_end();
    rig_end();
}

TEST(the_power_is_not_switched_before_the_port_was_opened_again)
{
    rig_start(BOX, "power = GPIO17\npower_cycle_after = 8 s\n");
    rig_run_pings(20);
    rig_dead(true);
    rig_run(6);
    CHECK_INT(rig_stats().reconnects, 1);
    rig_end();
}

/* Into the closed port, too. */
static void say(const char *text)
{
    send(rig.instrument, text, strlen(text), MSG_NOSIGNAL);
}

static uint64_t count(const char *name)
{
    json_t *status = rig_ask("status", "%s", "");
    const uint64_t n = (uint64_t)json_integer_value(json_object_get(json_object_get(status, "nmea"), name));
    json_decref(status);
    return n;
}

static void speak_for(unsigned seconds)
{
    for (unsigned i = 0; i < seconds; i++) {
        say("$GPHDT,90.0,T*0C\r\n");
        rig_run(1);
    }
}

TEST(an_instrument_behind_a_dead_port_is_heard_again)
{
    rig_start(BOX, RIG_NMEA);
    rig_log_begin();
    speak_for(20);
    const uint64_t values = count("values");
    rig.instrument_dead = true;
    speak_for(15);
    CHECK_INT(count("reconnects"), 1);
    CHECK(count("values") > values);
    CHECK_INT(rig_log_count("nmea: serial:/dev/nmea:4800: no message for 10 s"), 1);
    rig_log_end();
    rig_end();
}

TEST(an_instrument_that_never_spoke_is_let_alone)
{
    rig_start(BOX, RIG_NMEA);
    rig_run(300);
    CHECK_INT(count("reconnects"), 0);
    rig_end();
}

int main(void)
{
    RUN(a_sonar_behind_a_dead_port_pings_again);
    RUN(a_sonar_that_stays_silent_is_tried_ever_less_often_and_told_once);
    RUN(the_power_is_not_switched_before_the_port_was_opened_again);
    RUN(an_instrument_behind_a_dead_port_is_heard_again);
    RUN(an_instrument_that_never_spoke_is_let_alone);
    return test_end();
}
