/* SPDX-License-Identifier: MIT */
/* test_dead_line - when a silent line is due to be closed and opened: in numbers, without a port. */
#include "daemon/input/dead_line.h"

#include "tests/lib/test.h"

#define SECOND 1000000000ull

static struct dead_line line;
static uint64_t now_ns;

static void begin(bool asked)
{
    line = (struct dead_line){.asked = asked};
    now_ns = 1000 * SECOND;
    dead_line_opened(&line, now_ns);
}

static bool look(bool heard)
{
    now_ns += DEAD_LINE_LOOK_NS;
    return dead_line_look(&line, now_ns, heard);
}

/* Seconds until it is due; 0: not within an hour. */
static unsigned due_after(void)
{
    for (unsigned s = 1; s <= 3600; s++)
        if (look(false))
            return s;
    return 0;
}

/* A message every so many seconds, n times; how often it was due meanwhile. */
static unsigned hear(unsigned every_s, unsigned n)
{
    unsigned due = 0;
    for (unsigned i = 1; i <= n * every_s; i++)
        due += look(i % every_s == 0);
    return due;
}

TEST(a_line_that_should_answer_is_due_after_10_s_and_ever_later)
{
    static const unsigned want[] = {10, 20, 40, 80, 160, 300, 300, 300};
    begin(true);
    for (int i = 0; i < 8; i++)
        CHECK_INT(due_after(), want[i]);
    CHECK(!look(true));
    CHECK_INT(due_after(), 10);
    dead_line_opened(&line, now_ns); /* pulled and plugged in */
    CHECK_INT(due_after(), 10);
}

TEST(a_slow_line_has_three_of_its_usual_intervals)
{
    begin(true);
    CHECK_INT(hear(8, 5), 0);
    CHECK_INT(due_after(), 24);
    CHECK_INT(due_after(), 48);
}

TEST(a_line_that_is_listened_to_is_judged_once_its_interval_is_known)
{
    begin(false);
    CHECK_INT(due_after(), 0); /* nothing was ever heard */
    CHECK_INT(hear(1, 5), 0);
    CHECK_INT(due_after(), 0); /* hardly anything */
    begin(false);
    CHECK_INT(hear(1, 20), 0);
    CHECK_INT(due_after(), 10);
    CHECK_INT(due_after(), 20);
    dead_line_opened(&line, now_ns);
    CHECK_INT(due_after(), 10); /* it is the same talker */
    begin(false);
    CHECK_INT(hear(60, 10), 0); /* once a minute */
    CHECK_INT(due_after(), 180);
}

TEST(a_talker_that_becomes_slower_is_soon_let_alone)
{
    begin(false);
    CHECK_INT(hear(1, 60), 0);
    CHECK(hear(45, 2) <= 4);
    CHECK_INT(hear(45, 20), 0);
    CHECK_INT(due_after(), 135);
}

/* As a sonar is that was switched off: it was not the line. */
TEST(a_long_silence_is_not_usual_for_ever)
{
    begin(true);
    CHECK_INT(hear(1, 60), 0);
    for (int s = 1; s < 3700; s++)
        look(false);
    CHECK(!look(true));
    CHECK_INT(hear(1, 300), 0);
    CHECK_INT(due_after(), 10);
    begin(false);
    CHECK_INT(hear(60, 300), 0); /* what is, is for ever */
    CHECK_INT(due_after(), 180);
}

TEST(what_opening_it_again_has_cured_says_nothing_of_the_talker)
{
    begin(true);
    CHECK_INT(hear(1, 60), 0);
    CHECK_INT(due_after(), 10);
    CHECK_INT(due_after(), 20);
    CHECK(!look(true));
    CHECK_INT(due_after(), 10);
}

TEST(before_the_power_is_switched_it_is_due)
{
    begin(true);
    line.first_ns = 3 * SECOND;
    CHECK_INT(due_after(), 3);
    CHECK_INT(due_after(), 6);
    CHECK_INT(hear(2, 5), 0);
    CHECK_INT(due_after(), 6); /* three intervals of 2 s */
    begin(true);
    line.first_ns = 60 * SECOND;
    CHECK_INT(due_after(), 10);
}

TEST(a_process_that_was_held_up_has_not_heard_silence)
{
    begin(true);
    CHECK_INT(hear(1, 20), 0);
    now_ns += 3600 * SECOND;
    CHECK(!look(false));
    CHECK(!look(true));
    CHECK_INT(due_after(), 10);
}

int main(void)
{
    RUN(a_line_that_should_answer_is_due_after_10_s_and_ever_later);
    RUN(a_slow_line_has_three_of_its_usual_intervals);
    RUN(a_line_that_is_listened_to_is_judged_once_its_interval_is_known);
    RUN(a_talker_that_becomes_slower_is_soon_let_alone);
    RUN(a_long_silence_is_not_usual_for_ever);
    RUN(what_opening_it_again_has_cured_says_nothing_of_the_talker);
    RUN(before_the_power_is_switched_it_is_due);
    RUN(a_process_that_was_held_up_has_not_heard_silence);
    return test_end();
}
