/* SPDX-License-Identifier: MIT */
/* test_top - the frames of `sonarctl top`: cells, the ring, the panel, rates;
 * and that what is not known is not drawn clear. */
#include "client/ctl/canvas.h"
#include "client/ctl/top_ring.h"
#include "client/ctl/top_view.h"
#include "tests/lib/test.h"

static struct canvas canvas;

/* A row of the canvas as text; freed by the next call. */
static const char *row_of(int row, bool colour, bool unicode)
{
    static char *text;
    size_t size = 0;
    free(text);
    text = NULL;
    FILE *out = open_memstream(&text, &size);
    canvas_print_row(out, &canvas, row, colour, unicode);
    fclose(out);
    return text;
}

TEST(cells)
{
    canvas_clear(&canvas, 10, 3);
    CHECK_INT(canvas_text(&canvas, 8, 0, 99, CANVAS_RED, "abcdef"), 14); /* beyond the edge: left out */
    CHECK_STR(row_of(0, false, true), "        ab");
    CHECK_STR(row_of(0, true, true), "        \033[0;1;31mab\033[0m");
    canvas_text(&canvas, -1, 1, 4, CANVAS_PLAIN, "x\xc2\xb0\033[2J\xff");
    CHECK_STR(row_of(1, false, true), "\xc2\xb0?[");
    CHECK_STR(row_of(1, false, false), "??[");
    canvas_text(&canvas, 0, 1, 3, CANVAS_PLAIN, "\xc2\x9b\xe2\x82\xac");
    CHECK_STR(row_of(1, false, true), "?\xe2\x82\xac[");
    canvas_text(&canvas, 0, 1, 9, CANVAS_PLAIN, "\xf0\x9f"); /* cut in the middle */
    canvas_text(&canvas, 0, -1, 9, CANVAS_PLAIN, "above");
    canvas_text(&canvas, 0, 3, 9, CANVAS_PLAIN, "below");
    canvas_dot(&canvas, 0, 8, CANVAS_GREEN);
    canvas_dot(&canvas, 1, 11, CANVAS_GREEN);
    canvas_dot(&canvas, 2, 8, CANVAS_RED);
    canvas_dot(&canvas, 2, 9, CANVAS_GREEN); /* the heavier colour stays */
    canvas_dot(&canvas, -1, 8, CANVAS_RED);
    canvas_dot(&canvas, 20, 8, CANVAS_RED);
    canvas_dot(&canvas, 0, 12, CANVAS_RED);
    CHECK_STR(row_of(2, false, true), "\xe2\xa2\x81\xe2\xa0\x83");
    CHECK_STR(row_of(2, false, false), ".#");
    canvas_clear(&canvas, 100000, 100000);
    CHECK(canvas.columns == CANVAS_COLUMNS_MAX && canvas.rows == CANVAS_ROWS_MAX);
}

/* Four sectors: blocked ahead at 5 m, clear to starboard up to 8 m, unknown aft, a state of no name to port. */
#define FOUR                                                                                                      \
    "{\"frame\":\"body\",\"sectors\":[{\"state\":\"blocked\",\"azimuth_deg\":0,\"range_m\":5,\"free_to_m\":4},"   \
    "{\"state\":\"clear\",\"azimuth_deg\":90,\"range_m\":null,\"free_to_m\":8},"                                  \
    "{\"state\":\"unknown\",\"azimuth_deg\":180,\"range_m\":null,\"free_to_m\":0},{\"state\":\"free\",\"free_to_" \
    "m\":0}]}"

static int count_of(int row, char c)
{
    int n = 0;
    for (const char *s = row_of(row, false, false); *s; s++)
        n += *s == c;
    return n;
}

TEST(the_ring_tells_each_side)
{
    json_t *four = json_loads(FOUR, 0, NULL);
    canvas_clear(&canvas, 80, 24);
    top_ring_draw(&canvas, four, 10, 0, 0, 21);
    CHECK(count_of(0, '5') > 5 && count_of(0, 'c') == 0 && count_of(0, '?') == 0);
    CHECK(count_of(20, '?') > 5 && count_of(20, '5') == 0);
    CHECK_INT(canvas.cell[10][40].glyph, 'c');
    CHECK_INT(canvas.cell[10][0].glyph, '?');
    CHECK_INT(canvas.cell[10][20].glyph, '^');
    CHECK(count_of(5, '#') + count_of(6, '#') > 3); /* 5 m of 10 ahead */
    for (int row = 12; row < 20; row++)
        CHECK(!canvas.cell[row][19].dots && !canvas.cell[row][20].dots); /* nothing is drawn aft */
    CHECK(canvas.cell[10][30].dots || canvas.cell[10][31].dots);         /* free to starboard */
    CHECK(!canvas.cell[10][10].dots && !canvas.cell[10][11].dots);       /* and not to port */
    json_decref(four);
}

TEST(nothing_known_is_unknown_all_around)
{
    json_t *empty = json_loads("{\"sectors\":[]}", 0, NULL);
    for (int i = 0; i < 2; i++) {
        int unknown = 0;
        canvas_clear(&canvas, 80, 24);
        top_ring_draw(&canvas, i ? empty : NULL, 10, 0, 0, 21);
        for (int row = 0; row < 21; row++) {
            unknown += count_of(row, '?');
            CHECK(count_of(row, 'c') == 0 && count_of(row, '.') == 0);
        }
        CHECK(unknown > 50);
    }
    json_decref(empty);
}

#define STATUS                                                                                                    \
    "{\"version\":\"1\",\"mode\":\"live\",\"t_unix\":%d,\"data\":\"%s\",\"sensors\":[{\"name\":\"head\","         \
    "\"state\":\"%s\","                                                                                           \
    "\"device\":\"ping360\",\"range_m\":20,\"pings\":%d,\"last_ping_age_s\":0.5}],\"pose\":{\"age_s\":9,\"has\":" \
    "[\"depth\"]},"                                                                                               \
    "\"server\":{\"clients_now\":2,\"requests\":%d},\"pipeline\":{\"dropped\":3},\"leak\":{\"state\":\"wet\"}}"

static json_t *status(int t, const char *data, const char *state, int pings, int requests)
{
    char text[1000];
    snprintf(text, sizeof text, STATUS, t, data, state, pings, requests);
    return json_loads(text, 0, NULL);
}

static bool shows(const char *what)
{
    for (int row = 0; row < canvas.rows; row++)
        if (strstr(row_of(row, false, true), what))
            return true;
    printf("not shown: %s\n", what);
    return false;
}

TEST(rates_need_two_statuses)
{
    struct top_rates rates = {0};
    json_t *first = status(100, "ok", "running", 50, 1000), *second = status(102, "ok", "running", 80, 1010);
    json_t *other = status(104, "ok", "running", 5, 3);
    top_rates_take(&rates, first);
    CHECK(!rates.known);
    top_rates_take(&rates, second);
    CHECK(rates.known && rates.sensor[0].pings_ps == 15 && rates.requests_ps == 5);
    top_rates_take(&rates, second); /* the clock stands */
    CHECK(rates.sensor[0].pings_ps == 15);
    top_rates_take(&rates, other); /* another daemon, that counts anew */
    CHECK(isnan(rates.sensor[0].pings_ps) && isnan(rates.requests_ps));
    json_decref(first);
    json_decref(second);
    json_decref(other);
}

TEST(a_frame_says_what_is_wrong)
{
    struct top_rates rates = {0};
    json_t *sectors = json_loads(FOUR, 0, NULL),
           *bad = status(1700000000, "no data from the sonar", "no port", 0, 0);
    struct top_frame frame = {.sectors = sectors, .status = bad, .rates = &rates};
    canvas_clear(&canvas, 80, 24);
    top_view_draw(&canvas, &frame);
    CHECK(shows("NO NEW DATA: no data from the sonar"));
    CHECK(shows("! LEAK") && shows("! head: no port") && shows("! the pose is 9 s old") &&
          shows("! 3 pings dropped"));
    CHECK(shows("nearest  5.00 m at 0 deg") && shows("1 blocked  1 c  2 ?") && shows("2023-11-14") &&
          shows("edge 20 m"));
    frame = (struct top_frame){.fault = "no daemon answers", .rates = &rates};
    canvas_clear(&canvas, 80, 24);
    top_view_draw(&canvas, &frame);
    CHECK(shows("no daemon answers"));
    for (int row = 2; row < 23; row++)
        CHECK(count_of(row, 'c') == 0 && count_of(row, '.') == 0);
    json_decref(sectors);
    json_decref(bad);
}

TEST(a_blocked_side_says_at_how_many_metres)
{
    static const char *const ranges[] = {"0.99", "4", "9.99", "10", "1e300", "-1"};
    static const char marks[] = "049+++";
    char text[128];
    for (size_t i = 0; i < sizeof ranges / sizeof *ranges; i++) {
        snprintf(text, sizeof text, "{\"sectors\":[{\"state\":\"blocked\",\"range_m\":%s,\"free_to_m\":0}]}",
                 ranges[i]);
        json_t *sectors = json_loads(text, 0, NULL);
        canvas_clear(&canvas, 80, 24);
        top_ring_draw(&canvas, sectors, 0, 0, 0, 21);
        CHECK(count_of(0, marks[i]) > 5 && count_of(20, marks[i]) > 5);
        json_decref(sectors);
    }
}

TEST(a_pose_is_whole_at_80_columns)
{
    struct top_rates rates = {0};
    json_t *status =
        json_loads("{\"data\":\"ok\",\"pose\":{\"age_s\":0.1,\"has\":[\"attitude\",\"position\",\"depth\","
                   "\"velocity\"],\"attitude_deg\":[0,0,71.6]}}",
                   0, NULL);
    struct top_frame frame = {.status = status, .rates = &rates};

    canvas_clear(&canvas, 80, 24);
    top_view_draw(&canvas, &frame);
    CHECK(shows("pose     0.1 s attitude") && shows(" position") && shows(" depth") && shows(" velocity"));
    CHECK(shows("heading  072 from north"));
    json_decref(status);
}

/* Digits are never cut off: there are fewer columns instead, the longest time first. */
TEST(times_are_whole_at_any_width)
{
    struct top_rates rates = {0};
    json_t *status = json_loads("{\"data\":\"ok\"}", 0, NULL);
    json_t *stats = json_loads("{\"metrics\":[{\"name\":\"sonard_latency_seconds\",\"samples\":[{\"count\":9,"
                               "\"labels\":{\"stage\":\"request\"},\"p50_us\":41234,\"p99_us\":49876,"
                               "\"max_us\":5001777}]}]}",
                               0, NULL);
    struct top_frame frame = {.status = status, .stats = stats, .rates = &rates};
    for (int columns = 60; columns < 200; columns++) {
        canvas_clear(&canvas, columns, 40);
        top_view_draw(&canvas, &frame);
        for (int row = 0; row < 40; row++) {
            const char *line = strstr(row_of(row, false, false), "request  ");
            const int n = line ? (int)strlen(line) : 0;
            if (line)
                CHECK(n >= 23 && strcmp(line + n - 1, n > 31 ? "6" : n > 23 ? "4" : "7") == 0);
        }
    }
    CHECK(shows("5001777   41234   49876"));
    json_decref(stats);
    json_decref(status);
}

TEST(a_frame_says_what_takes_clear_water_away)
{
    struct top_rates rates = {0};
    json_t *status =
        json_loads("{\"data\":\"ok\",\"pose\":{\"drift\":\"no position and no velocity: ...\"},\"sensors\":[{"
                   "\"name\":\"head\",\"state\":\"running\",\"contested\":true}]}",
                   0, NULL);
    struct top_frame frame = {.status = status, .rates = &rates};

    canvas_clear(&canvas, 80, 24);
    top_view_draw(&canvas, &frame);
    CHECK(shows("! no position"));
    CHECK(shows("! head: answers get lost"));
    json_decref(status);
}

/* Text that is no number, members that are missing, any size:
 * nothing is written beyond an edge (the sanitizers look). */
TEST(any_size_and_any_answer)
{
    static const char *const answers[] = {
        "{}",
        "[]",
        "7",
        "{\"sectors\":7,\"sensors\":[7,{}],\"metrics\":[{\"samples\":[1]}]}",
        "{\"t_unix\":1e300,\"sensors\":[{\"range_m\":1e300,\"name\":\"\\u001b\"}]}",
        "{\"sectors\":[{\"state\":\"blocked\",\"range_m\":-1e300,\"free_to_m\":1e300}]}"};
    struct top_rates rates = {0};
    for (size_t i = 0; i < sizeof answers / sizeof *answers; i++) {
        json_t *answer = json_loads(answers[i], JSON_DECODE_ANY, NULL);
        const struct top_frame frame = {.sectors = answer, .status = answer, .stats = answer, .rates = &rates};
        top_rates_take(&rates, answer);
        for (int columns = 0; columns < 300; columns += 7) {
            for (int rows = 0; rows < 100; rows += 3) {
                canvas_clear(&canvas, columns, rows);
                top_view_draw(&canvas, &frame);
                for (int row = 0; row < canvas.rows; row++)
                    CHECK((int)strlen(row_of(row, false, false)) <= columns);
            }
        }
        json_decref(answer);
    }
}

int main(void)
{
    RUN(cells);
    RUN(the_ring_tells_each_side);
    RUN(nothing_known_is_unknown_all_around);
    RUN(rates_need_two_statuses);
    RUN(a_frame_says_what_is_wrong);
    RUN(a_blocked_side_says_at_how_many_metres);
    RUN(a_pose_is_whole_at_80_columns);
    RUN(times_are_whole_at_any_width);
    RUN(a_frame_says_what_takes_clear_water_away);
    RUN(any_size_and_any_answer);
    return test_end();
}
