/* SPDX-License-Identifier: MIT */
/* When pings of other settings are a takeover, how often ours are sent again, and what is said. */
#include "drivers/devices/takeover.h"
#include "tests/lib/test.h"

#define SEC    1000000000ull
#define VALUES 12

static struct takeover takeover;
static struct device_status status;
static uint64_t now_ns;
static unsigned warnings, infos;
static char said[DEVICE_NOTE_MAX];

static void take_note(void *ctx, enum device_note level, const char *fmt, ...)
{
    va_list args;
    (void)ctx;
    va_start(args, fmt);
    vsnprintf(said, sizeof said, fmt, args);
    va_end(args);
    warnings += level == NOTE_WARNING;
    infos += level == NOTE_INFO;
}

static void begin(void)
{
    takeover = (struct takeover){0};
    status = (struct device_status){0};
    now_ns = 100 * SEC;
    warnings = infos = 0;
}

/* n pings, ten a second; how often the settings were to be sent again. */
static unsigned pings(unsigned n, long gain)
{
    const struct device_io io = {.note = take_note};
    const struct takeover_value value[] = {{"range", 1990, 2000, 20}, {"gain", gain, 3, 0}};
    unsigned sent = 0;
    for (unsigned i = 0; i < n; i++, now_ns += SEC / 10)
        sent += takeover_ping(&takeover, &status, value, 2, now_ns, &io);
    return sent;
}

TEST(a_few_pings_of_other_settings_are_none)
{
    begin();
    for (int i = 0; i < 20; i++) {
        CHECK_INT(pings(5, 1), 0);
        CHECK_INT(pings(10, 3), 0);
    }
    CHECK_INT(status.taken_over + warnings + infos, 0);
}

TEST(eight_in_a_row_are_one)
{
    begin();
    pings(100, 3);
    CHECK_INT(pings(7, 1), 0);
    CHECK_STR(status.other_settings, "");
    CHECK_INT(pings(1, 1), 1);
    CHECK_STR(status.other_settings, "gain 1 (sent 3)");
    CHECK_STR(said, "its settings are not the ones that were sent (another program?); sending them again: gain 1 "
                    "(sent 3)");
    CHECK_INT(warnings, 1);
    CHECK_INT(pings(5, 1), 0); /* what was on its way */
    CHECK_INT(pings(15, 3), 0);
    CHECK_STR(status.other_settings, "gain 1 (sent 3)");
    CHECK_INT(pings(1, 3), 0);
    CHECK_STR(status.other_settings, "");
    CHECK_INT(infos, 1);
}

TEST(those_who_take_turns_are_one)
{
    unsigned sent = 0;
    begin();
    for (int i = 0; i < 30; i++)
        sent += pings(1, 1) + pings(1, 3);
    CHECK_INT(status.taken_over, 1);
    CHECK_INT(warnings, 1);
    CHECK(sent >= 1);
}

TEST(in_vain_it_is_tried_less_and_less_often)
{
    begin();
    CHECK_INT(pings(8, 1), 1);
    CHECK_INT(pings(49, 1), 0); /* 5 s */
    CHECK_INT(pings(1, 1), 1);
    CHECK_INT(pings(99, 1), 0); /* 10 s */
    CHECK_INT(pings(1, 1), 1);
    CHECK_INT(pings(200, 1), 1);
    CHECK_INT(pings(400, 1), 1);
    CHECK_INT(pings(4000, 1), 10); /* 40 s */
    CHECK_INT(warnings, 1);
    CHECK_INT(status.taken_over, 1);
}

TEST(soon_again_is_not_said_again)
{
    begin();
    pings(8, 1);
    pings(100, 3);
    CHECK_INT(pings(8, 1), 1);
    CHECK_INT(status.taken_over, 2);
    CHECK_INT(warnings, 1);
    pings(700, 3); /* it was right for more than a minute */
    CHECK_INT(pings(8, 2), 1);
    CHECK_INT(status.taken_over, 3);
    CHECK_INT(warnings, 2);
}

TEST(what_was_before_the_port_was_opened_does_not_count)
{
    begin();
    pings(8, 1);
    takeover_forget(&takeover, &status);
    CHECK_STR(status.other_settings, "");
    now_ns += 10 * SEC;
    CHECK_INT(pings(7, 1), 0);
    CHECK_INT(pings(1, 1), 1);
    CHECK_INT(status.taken_over, 2);
}

TEST(a_list_that_is_too_long_is_cut)
{
    static const char name[] = "a_setting_with_a_very_long_name_indeed_that_no_protocol_would_ever_have";
    struct takeover_value value[VALUES];
    const struct device_io io = {.note = take_note};
    begin();
    for (int i = 0; i < VALUES; i++)
        value[i] = (struct takeover_value){name, 1000000 + i, -1, 0};
    for (int i = 0; i < 8; i++)
        takeover_ping(&takeover, &status, value, VALUES, now_ns, &io);
    CHECK_INT(strlen(status.other_settings), sizeof status.other_settings - 1);
    CHECK(strstr(said, status.other_settings) != NULL);
}

int main(void)
{
    RUN(a_few_pings_of_other_settings_are_none);
    RUN(eight_in_a_row_are_one);
    RUN(those_who_take_turns_are_one);
    RUN(in_vain_it_is_tried_less_and_less_often);
    RUN(soon_again_is_not_said_again);
    RUN(what_was_before_the_port_was_opened_does_not_count);
    RUN(a_list_that_is_too_long_is_cut);
    return test_end();
}
