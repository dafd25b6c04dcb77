/* SPDX-License-Identifier: MIT */
/* When lost answers mean that another program speaks to a sonar, too, and what is said. */
#include "drivers/devices/contest.h"
#include "tests/lib/test.h"

#define SEC 1000000000ull

static struct contest contest;
static struct device_status status;
static uint64_t now_ns;
static unsigned warnings, infos;

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    (void)ctx, (void)fmt;
    warnings += level == NOTE_WARNING;
    infos += level == NOTE_INFO;
}

static void begin(void)
{
    contest = (struct contest){0};
    status = (struct device_status){0};
    now_ns = 100 * SEC;
    warnings = infos = 0;
}

/* n pings, ten a second, the first behind so many timeouts. */
static void pings(unsigned n, unsigned timeouts, bool polled)
{
    const struct device_io io = {.note = take_note};
    status.timeouts += timeouts;
    for (unsigned i = 0; i < n; i++, now_ns += SEC / 10)
        contest_ping(&contest, &status, polled, now_ns, &io);
}

/* It was set up anew, after so many timeouts, and sends n pings. */
static void restart(unsigned timeouts, unsigned n)
{
    status.restarts++;
    pings(n, timeouts, false);
}

TEST(a_head_that_answers_is_well)
{
    begin();
    pings(10000, 0, false);
    pings(10000, 0, true);
    status.restarts++; /* its settings were sent again */
    pings(1, 0, false);
    CHECK_INT(contest.level, 0);
    CHECK(!status.contested);
}

TEST(three_silences_with_few_pings_between_them_are_one)
{
    begin();
    pings(100, 0, false);
    restart(3, 5);
    restart(300, 5);
    CHECK(!status.contested);
    restart(3, 1);
    CHECK(status.contested);
    CHECK_INT(warnings, 1);
    for (unsigned i = 0; i < 100; i++)
        restart(3, 5);
    CHECK_INT(warnings + infos, 1);
    pings(59, 0, false);
    CHECK(status.contested);
    pings(1, 0, false);
    CHECK(!status.contested);
    CHECK_INT(warnings + infos, 2);
}

TEST(silences_with_many_pings_between_them_are_none)
{
    begin();
    for (unsigned i = 0; i < 100; i++)
        restart(3, 40);
    for (unsigned i = 0; i < 100; i++)
        pings(12, 1, false);
    CHECK(!status.contested);
    CHECK_INT(warnings, 0);
}

TEST(of_pings_that_are_asked_for_a_third_must_be_lost)
{
    begin();
    for (unsigned i = 0; i < 1000; i++)
        pings(5, 1, true);
    CHECK(!status.contested);
    for (unsigned i = 0; i < 32; i++)
        pings(2, 1, true);
    CHECK(status.contested);
}

TEST(what_was_late_is_not_lost)
{
    begin();
    for (unsigned i = 0; i < 1000; i++) {
        pings(1, 1, true);
        contest_late(&contest);
    }
    CHECK(!status.contested);
}

TEST(soon_again_is_not_said_again)
{
    begin();
    for (unsigned again = 0; again < 3; again++) {
        pings(1, 1000, true);
        CHECK(status.contested);
        CHECK_INT(warnings, 1 + again / 2);
        pings(again ? 700 : 100, 0, true);
        CHECK(!status.contested);
    }
}

TEST(what_was_before_the_port_was_opened_does_not_count)
{
    begin();
    restart(3, 1);
    restart(3, 1);
    status.timeouts += 100;
    status.restarts++;
    contest_forget(&contest, &status);
    pings(1, 0, false);
    CHECK_INT(contest.level, 0);
    restart(3, 1);
    CHECK(!status.contested);
}

int main(void)
{
    RUN(a_head_that_answers_is_well);
    RUN(three_silences_with_few_pings_between_them_are_one);
    RUN(silences_with_many_pings_between_them_are_none);
    RUN(of_pings_that_are_asked_for_a_third_must_be_lost);
    RUN(what_was_late_is_not_lost);
    RUN(soon_again_is_not_said_again);
    RUN(what_was_before_the_port_was_opened_does_not_count);
    return test_end();
}
