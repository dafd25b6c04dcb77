/* SPDX-License-Identifier: MIT */
/* Rows of an image: whoever is slow gets every row once, the newest. */
#include "tests/lib/test.h"
#include "client/view/view_rows.h"

static struct view_rows rows;
static uint8_t out[VIEW_ROWS_BYTES];

/* An image of one row. */
static void take(double t_unix, double azimuth, double age, const char *samples)
{
    json_t *image =
        json_pack("{s:s, s:f, s:[{s:f, s:f, s:f, s:f, s:f, s:s, s:f, s:f, s:[{s:f, s:f, s:[s]}], s:f, s:s}]}",
                  "sensor", "head", "t_unix", t_unix, "rows", "azimuth_deg", azimuth, "width_deg", 2.0, "r0_m",
                  0.0, "r1_m", 20.0, "age_s", age, "samples", samples, "echo_m", 3.0, "near_m", 2.5, "echoes",
                  "range_m", 3.0, "confidence", 0.876, "marks", "ghost", "blind_m", 0.5, "state", "echo");

    CHECK(image != NULL);
    view_rows_take(&rows, image);
    json_decref(image);
}

static double f64(const uint8_t *at)
{
    double v;
    memcpy(&v, at, sizeof v);
    return v;
}

static float f32(const uint8_t *at)
{
    float v;
    memcpy(&v, at, sizeof v);
    return v;
}

static void begin(void)
{
    memset(&rows, 0, sizeof rows);
}

TEST(bytes)
{
    uint64_t seen = 0;
    begin();
    take(1000.5, 30, 0.25, "00ff7f");
    CHECK_INT(view_rows_part(&rows, &seen, out), 12 + 4 + 36 + 6 + 3);
    CHECK_INT(out[0], 1);
    CHECK_INT(out[1], 4);
    CHECK_INT(out[2] | out[3] << 8, 1);
    CHECK_NEAR(f64(out + 4), 1000.5, 0, 1e-9);
    CHECK(memcmp(out + 12, "head", 4) == 0);
    const uint8_t *row = out + 16;
    CHECK_NEAR(f64(row), 1000.25, 0, 1e-9);
    CHECK_NEAR(f32(row + 8), 30, 0, 0);
    CHECK_NEAR(f32(row + 12), 2, 0, 0);
    CHECK_NEAR(f32(row + 20), 20, 0, 0);
    CHECK_NEAR(f32(row + 24), 0.5, 0, 0);
    CHECK_NEAR(f32(row + 28), 2.5, 0, 0);
    CHECK_INT(row[32], 0);
    CHECK_INT(row[33], 1);
    CHECK_INT(row[34] | row[35] << 8, 3);
    CHECK_NEAR(f32(row + 36), 3, 0, 0);
    CHECK_INT(row[40], 2);
    CHECK_INT(row[41], 88);
    CHECK(row[42] == 0 && row[43] == 255 && row[44] == 127);
    CHECK_INT(view_rows_part(&rows, &seen, out), 0);
}

TEST(the_same_ping_is_told_once)
{
    uint64_t seen = 0;
    begin();
    take(1000, 30, 0.1, "00");
    take(1000.5, 30, 0.6, "00");
    CHECK(view_rows_part(&rows, &seen, out) > 0);
    take(1001, 30, 1.1, "00");
    CHECK_INT(view_rows_part(&rows, &seen, out), 0);
    take(1002, 30, 0.0, "01");
    CHECK(view_rows_part(&rows, &seen, out) > 0);
}

/* The slow one reads nothing for three turns, and gets each direction once, of the last turn. */
TEST(who_is_slow_gets_the_newest)
{
    uint64_t seen = 0;
    int n = 0, parts = 0;
    begin();
    for (int turn = 0; turn < 3; turn++)
        for (int k = 0; k < 100; k++)
            take(1000 + 100 * turn + k, 3.6 * k, 0, "00");
    while (view_rows_part(&rows, &seen, out) > 0) {
        n += out[2];
        parts++;
        CHECK(f64(out + 16) >= 1200);
    }
    CHECK_INT(n, 100);
    CHECK_INT(parts, (100 + VIEW_ROWS_PART - 1) / VIEW_ROWS_PART);
}

TEST(forgotten_rows_do_not_come_back)
{
    uint64_t seen = 0;
    begin();
    take(1000, 30, 0, "00");
    view_rows_forget(&rows);
    CHECK_INT(view_rows_part(&rows, &seen, out), 0);
    take(2000, 60, 0, "00");
    CHECK(view_rows_part(&rows, &seen, out) > 0);
    CHECK_INT(out[2], 1);
}

TEST(what_is_no_row)
{
    static const char *const texts[] = {
        "{}",
        "[]",
        "{\"rows\":1}",
        "{\"rows\":[1,{},null]}",
        "{\"t_unix\":1,\"rows\":[{\"azimuth_deg\":\"x\"}]}",
        "{\"t_unix\":1,\"rows\":[{\"azimuth_deg\":1,\"width_deg\":1,\"r0_m\":0,\"r1_m\":1}]}",
        "{\"rows\":[{\"azimuth_deg\":1,\"width_deg\":1,\"r0_m\":0,\"r1_m\":1,\"age_s\":0}]}"};
    uint64_t seen = 0;
    begin();
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        json_t *image = json_loads(texts[i], 0, NULL);
        view_rows_take(&rows, image);
        json_decref(image);
    }
    CHECK_INT(view_rows_part(&rows, &seen, out), 0);
}

/* The daemon sends them by azimuth; a head that turns back pings them the other way round. */
TEST(rows_of_one_answer_change_in_the_order_of_their_pings)
{
    static const char text[] =
        "{\"t_unix\":1000,\"rows\":["
        "{\"azimuth_deg\":1,\"width_deg\":1,\"r0_m\":0,\"r1_m\":1,\"age_s\":0.1,\"state\":\"silent\"},"
        "{\"azimuth_deg\":2,\"width_deg\":1,\"r0_m\":0,\"r1_m\":1,\"age_s\":0.3,\"state\":\"silent\"},"
        "{\"azimuth_deg\":3,\"width_deg\":1,\"r0_m\":0,\"r1_m\":1,\"age_s\":0.2,\"state\":\"silent\"}]}";
    static const float want[] = {2, 3, 1};
    json_t *image = json_loads(text, 0, NULL);

    begin();
    view_rows_take(&rows, image);
    json_decref(image);
    for (size_t i = 0; i < 3; i++) {
        CHECK_INT(rows.row[i].changed, i + 1);
        CHECK_NEAR(rows.row[i].az_deg, want[i], 0, 0);
    }
}

TEST(odd_and_wrong_digits_end_the_bins)
{
    uint64_t seen = 0;
    begin();
    take(1000, 30, 0, "0a1");
    take(1000, 60, 0, "0ax1");
    CHECK(view_rows_part(&rows, &seen, out) > 0);
    CHECK_INT(rows.row[0].n_bins, 1);
    CHECK_INT(rows.row[1].n_bins, 1);
}

TEST(more_bins_and_directions_than_there_is_room)
{
    static char samples[2 * (VIEW_ROW_BINS + 10) + 1];
    begin();
    memset(samples, '7', sizeof samples - 1);
    for (int k = 0; k < VIEW_ROWS_MAX + 50; k++)
        take(1000 + k, 0.1 * k, 0, samples);
    CHECK_INT(rows.change, VIEW_ROWS_MAX);
    CHECK_INT(rows.row[0].n_bins, VIEW_ROW_BINS);
    for (uint64_t seen = 0; view_rows_part(&rows, &seen, out) > 0;)
        CHECK(out[2] <= VIEW_ROWS_PART);
}

int main(void)
{
    RUN(bytes);
    RUN(the_same_ping_is_told_once);
    RUN(who_is_slow_gets_the_newest);
    RUN(forgotten_rows_do_not_come_back);
    RUN(what_is_no_row);
    RUN(rows_of_one_answer_change_in_the_order_of_their_pings);
    RUN(odd_and_wrong_digits_end_the_bins);
    RUN(more_bins_and_directions_than_there_is_room);
    return test_end();
}
