/* SPDX-License-Identifier: MIT */
/* test_capture_clock - what the notes of a capture say, and by which clock a pose of another log is dated. */
#include "client/ctl/capture_clock.h"

#include "tests/lib/test.h"

#define S     1000000000ll
#define START 5000ull /* s since 1970, of a capture of 100 s */
#define AHEAD 1790000000ll
#define LATE  2000000ll

static struct capture_clock clock_of;

static bool take(const char *topic, uint64_t t_s, const char *json)
{
    const struct mcap_channel channel = {.topic = topic, .encoding = "json"};
    return capture_clock_take(&clock_of, &(struct mcap_message){.channel = &channel,
                                                                .log_ns = t_s * S,
                                                                .data = (const uint8_t *)json,
                                                                .size = strlen(json)});
}

static int64_t date(int64_t unix_s)
{
    return capture_clock_date(&clock_of, unix_s * S, START * S, (START + 100) * S) / S;
}

TEST(without_notes_times_are_the_captures)
{
    clock_of = (struct capture_clock){0};
    CHECK_INT(capture_clock_ahead_ns(&clock_of), 0);
    CHECK_INT(date(START + 5), START + 5);
    CHECK_INT(date(AHEAD), AHEAD);
}

/* Set at 40 s and once more at 60 s. */
TEST(poses_of_either_clock_meet_the_capture)
{
    static const struct {
        const char *name;
        int64_t unix_s, want_s;
    } rows[] = {{"a right clock, before the step", (int64_t)START + AHEAD + LATE + 10, (int64_t)START + 10},
                {"a right clock, behind the steps", (int64_t)START + AHEAD + LATE + 90, (int64_t)START + 90},
                {"this computer, before the steps", (int64_t)START + 10, (int64_t)START + 10},
                {"this computer, between them", (int64_t)START + AHEAD + 50, (int64_t)START + 50},
                {"moved into the capture's time", (int64_t)START + 80, (int64_t)START + 80},
                {"before all of it", (int64_t)START + AHEAD + LATE - 100, (int64_t)START - 100},
                {"behind all of it", (int64_t)START + AHEAD + LATE + 200, (int64_t)START + 200}};
    clock_of = (struct capture_clock){0};
    CHECK(take("/clock", START + 40, "{\"ahead_ns\":1790000000000000000,\"was_ahead_ns\":0}"));
    CHECK(take("/clock", START + 60, "{\"ahead_ns\":1792000000000000000,\"was_ahead_ns\":1790000000000000000}"));
    CHECK(!take("/clock", START + 70, "{\"ahead_ns\":1792000000000000000,\"was_ahead_ns\":1792000000000000000}"));
    CHECK_INT(clock_of.n, 2);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        if (date(rows[i].unix_s) != rows[i].want_s) {
            printf("%s: %lld, want %lld\n", rows[i].name, (long long)date(rows[i].unix_s),
                   (long long)rows[i].want_s);
            test_case_failed = true;
        }
}

TEST(what_is_no_note_is_left_out)
{
    static const char *const texts[] = {"",
                                        "{}",
                                        "[1]",
                                        "{\"ahead_ns\":\"1\"}",
                                        "{\"ahead_ns\":1.5}",
                                        "{\"ahead_ns\":0}",
                                        "{\"ahead_ns\":9223372036854775807}",
                                        "{\"ahead_ns\":-9223372036854775808}",
                                        "{\"ahead_ns\":1",
                                        "{\"ahead_ns\":1,\"ahead_ns\":2}"};
    clock_of = (struct capture_clock){0};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        CHECK(!take("/clock", START, texts[i]));
    CHECK(!take("/pose", START, "{\"ahead_ns\":1}"));
    CHECK(!take("/clock", 9300000000u, "{\"ahead_ns\":1}"));
    CHECK_INT(clock_of.n, 0);
}

TEST(of_too_many_steps_the_newest_counts)
{
    clock_of = (struct capture_clock){0};
    for (unsigned i = 1; i <= 2 * CAPTURE_CLOCK_STEPS; i++) {
        char text[64];
        snprintf(text, sizeof text, "{\"ahead_ns\":%u000000000}", i);
        CHECK(take("/clock", START + i / 2, text));
    }
    CHECK_INT(clock_of.n, CAPTURE_CLOCK_STEPS);
    CHECK_INT(capture_clock_ahead_ns(&clock_of), 2 * CAPTURE_CLOCK_STEPS * S);
    CHECK_INT(date((int64_t)START + 2 * CAPTURE_CLOCK_STEPS + 50), START + 50);
}

TEST(extreme_times_do_not_overflow)
{
    clock_of = (struct capture_clock){0};
    CHECK(take("/clock", START, "{\"ahead_ns\":-4611686018427387903}"));
    CHECK(take("/clock", START, "{\"ahead_ns\":4611686018427387903}"));
    CHECK(take("/clock", START, "{\"ahead_ns\":-4611686018427387903}"));
    static const int64_t times[] = {0, INT64_MAX, INT64_MAX / 2, INT64_MAX / 2 + 1};
    for (size_t i = 0; i < sizeof times / sizeof *times; i++)
        capture_clock_date(&clock_of, times[i], 0, UINT64_MAX);
}

int main(void)
{
    RUN(without_notes_times_are_the_captures);
    RUN(poses_of_either_clock_meet_the_capture);
    RUN(what_is_no_note_is_left_out);
    RUN(of_too_many_steps_the_newest_counts);
    RUN(extreme_times_do_not_overflow);
    return test_end();
}
