/* SPDX-License-Identifier: MIT */
/* test_capture_clock - what the notes of a capture say, and when it was what a log dates by one clock or another. */
#include "client/ctl/capture_clock.h"

#include "tests/lib/test.h"

#define S     1000000000ll
#define START 5000ull /* s since 1970 */
#define AHEAD 1790000000ll
#define LATE  2000000ll
#define NEVER (-1)

static struct capture_clock clock_of;

static bool take(const char *topic, uint64_t t_s, const char *json)
{
    const struct mcap_channel channel = {.topic = topic, .encoding = "json"};
    return capture_clock_take(&clock_of, &(struct mcap_message){.channel = &channel,
                                                                .log_ns = t_s * S,
                                                                .data = (const uint8_t *)json,
                                                                .size = strlen(json)});
}

static bool note(uint64_t t_s, int64_t was_s, int64_t ahead_s)
{
    char text[100];
    snprintf(text, sizeof text, "{\"ahead_ns\":%lld,\"was_ahead_ns\":%lld}", (long long)(ahead_s * S),
             (long long)(was_s * S));
    return take("/clock", t_s, text);
}

static int64_t date(enum capture_clock_of of, int64_t unix_s)
{
    uint64_t t_ns;
    return capture_clock_date(&clock_of, of, unix_s * S, &t_ns) ? (int64_t)(t_ns / S) : NEVER;
}

static void check_dates(size_t n, const int64_t rows[][4])
{
    for (size_t i = 0; i < n; i++)
        for (int of = CAPTURE_CLOCK_RIGHT; of <= CAPTURE_CLOCK_NONE; of++)
            if (date((enum capture_clock_of)of, rows[i][0]) != rows[i][1 + of]) {
                printf("%lld, clock %d: %lld, expected %lld\n", (long long)rows[i][0], of,
                       (long long)date((enum capture_clock_of)of, rows[i][0]), (long long)rows[i][1 + of]);
                test_case_failed = true;
            }
}

/* Set at 40 s by years and at 60 s by days. What the clock was set past, it never showed. */
TEST(each_clock_has_its_times)
{
    const int64_t start = START, once = start + AHEAD, twice = once + LATE;
    const int64_t rows[][4] = {
        {twice + 10, start + 10, NEVER, twice + 10}, {twice + 90, start + 90, start + 90, twice + 90},
        {once + 50, NEVER, start + 50, once + 50},   {once + 61, NEVER, NEVER, once + 61},
        {start + 10, NEVER, start + 10, start + 10}, {start - 10, NEVER, start - 10, start - 10},
        {start + 41, NEVER, NEVER, start + 41}};
    clock_of = (struct capture_clock){0};
    CHECK(note(START + 40, 0, AHEAD));
    CHECK(note(START + 60, AHEAD, AHEAD + LATE));
    CHECK(!note(START + 70, AHEAD + LATE, AHEAD + LATE));
    CHECK_INT(clock_of.n, 2);
    check_dates(sizeof rows / sizeof *rows, rows);
}

/* By 30 s at 40 s, and by 20 s back at 60 s: the newest that may be meant. */
TEST(small_steps_leave_no_doubt_of_one_clock)
{
    const int64_t start = START;
    const int64_t rows[][4] = {{start + 35, start + 25, start + 35, start + 35},
                               {start + 45, start + 35, NEVER, start + 45},
                               {start + 71, start + 61, start + 61, start + 71},
                               {start + 85, start + 75, start + 75, start + 85}};
    clock_of = (struct capture_clock){0};
    CHECK(note(START + 40, 0, 30));
    CHECK(note(START + 60, 30, 10));
    check_dates(sizeof rows / sizeof *rows, rows);
}

TEST(a_later_segment_says_what_was_before)
{
    const int64_t start = START;
    const int64_t rows[][4] = {{start + AHEAD, start, start, start + AHEAD}, {start, NEVER, NEVER, start}};
    clock_of = (struct capture_clock){0};
    CHECK_INT(capture_clock_ahead_ns(&clock_of), 0);
    CHECK(!clock_of.noted);
    CHECK(note(START + 1, AHEAD, AHEAD));
    CHECK(!note(START + 2, AHEAD, AHEAD));
    CHECK(clock_of.noted);
    CHECK_INT(clock_of.n, 0);
    CHECK_INT(capture_clock_ahead_ns(&clock_of), AHEAD * S);
    check_dates(2, rows);
}

TEST(what_is_no_note_is_left_out)
{
    static const char *const texts[] = {"",
                                        "{}",
                                        "[1]",
                                        "{\"ahead_ns\":1}",
                                        "{\"ahead_ns\":\"1\",\"was_ahead_ns\":0}",
                                        "{\"ahead_ns\":1.5,\"was_ahead_ns\":0}",
                                        "{\"ahead_ns\":1,\"was_ahead_ns\":null}",
                                        "{\"ahead_ns\":9223372036854775807,\"was_ahead_ns\":0}",
                                        "{\"ahead_ns\":0,\"was_ahead_ns\":-9223372036854775808}",
                                        "{\"ahead_ns\":-5001000000000,\"was_ahead_ns\":0}",
                                        "{\"ahead_ns\":1,\"was_ahead_ns\":0",
                                        "{\"ahead_ns\":1,\"ahead_ns\":2,\"was_ahead_ns\":0}"};
    clock_of = (struct capture_clock){0};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++)
        CHECK(!take("/clock", START, texts[i]));
    CHECK(!take("/pose", START, "{\"ahead_ns\":1,\"was_ahead_ns\":0}"));
    CHECK(!take("/clock", 9300000000u, "{\"ahead_ns\":1,\"was_ahead_ns\":0}"));
    CHECK(!clock_of.noted);
}

TEST(of_too_many_steps_the_newest_are_kept)
{
    const int64_t last = 2 * CAPTURE_CLOCK_STEPS;
    clock_of = (struct capture_clock){0};
    for (int64_t i = 1; i <= last; i++)
        CHECK(note(START + (uint64_t)i, i - 1, i));
    CHECK_INT(clock_of.n, CAPTURE_CLOCK_STEPS);
    CHECK_INT(clock_of.before_ns, CAPTURE_CLOCK_STEPS * S);
    CHECK_INT(clock_of.step[0].ahead_ns, (CAPTURE_CLOCK_STEPS + 1) * S);
    CHECK_INT(clock_of.step[0].from_ns, (START + CAPTURE_CLOCK_STEPS + 1) * S);
    CHECK_INT(capture_clock_ahead_ns(&clock_of), last * S);
}

TEST(extreme_times_do_not_overflow)
{
    static const int64_t times[] = {0, 1, INT64_MAX, INT64_MAX / 2, INT64_MAX / 2 + 1};
    uint64_t t_ns;
    clock_of = (struct capture_clock){0};
    CHECK(take("/clock", 0, "{\"ahead_ns\":0,\"was_ahead_ns\":-4611686018427387903}"));
    CHECK(take("/clock", 4611686018u, "{\"ahead_ns\":4611686018427387903,\"was_ahead_ns\":0}"));
    CHECK(take("/clock", 4611686018u, "{\"ahead_ns\":-4611686018000000000,\"was_ahead_ns\":0}"));
    for (size_t i = 0; i < sizeof times / sizeof *times; i++)
        for (int of = CAPTURE_CLOCK_RIGHT; of <= CAPTURE_CLOCK_NONE; of++)
            capture_clock_date(&clock_of, (enum capture_clock_of)of, times[i], &t_ns);
}

int main(void)
{
    RUN(each_clock_has_its_times);
    RUN(small_steps_leave_no_doubt_of_one_clock);
    RUN(a_later_segment_says_what_was_before);
    RUN(what_is_no_note_is_left_out);
    RUN(of_too_many_steps_the_newest_are_kept);
    RUN(extreme_times_do_not_overflow);
    return test_end();
}
