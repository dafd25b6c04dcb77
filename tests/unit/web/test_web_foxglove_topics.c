/* SPDX-License-Identifier: MIT */
/*
 * test_web_foxglove_topics - what is told to Foxglove, of answers made here. Frames turn on the way: the vehicle's is
 * forward, left, up; the map's east, north, up.
 */
#include "tests/lib/test.h"
#include "web/web_foxglove_topics.h"

static struct web_rows rows;

/* The message of a topic; `result` is JSON and may be NULL. */
static json_t *made(const char *topic, const char *result)
{
    const struct web_topic *t = web_topics;

    while (t->topic && strcmp(t->topic, topic) != 0)
        t++;
    CHECK(t->topic != NULL);
    if (!t->topic)
        return NULL;
    json_t *given = result ? json_loads(result, 0, NULL) : NULL;
    CHECK(!result || given);
    json_t *message = t->make(given, &rows, 1700000000.25);
    json_decref(given);
    return message;
}

/* The number or text at a way of names, "pose/position/x". */
static const json_t *at(const json_t *from, const char *way)
{
    char names[100];

    snprintf(names, sizeof names, "%s", way);
    for (char *name = strtok(names, "/"); name; name = strtok(NULL, "/"))
        from = json_object_get(from, name);
    return from;
}

static double number(const json_t *from, const char *way)
{
    const json_t *n = at(from, way);

    return json_is_number(n) ? json_number_value(n) : NAN;
}

static const char *word(const json_t *from, const char *way)
{
    const char *s = json_string_value(at(from, way));

    return s ? s : "none";
}

/* The bytes of "data", by RFC 4648, section 4; how many. */
static size_t bytes_of(const json_t *message, uint8_t *out, size_t size)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const char *text = word(message, "data");
    uint32_t held = 0;
    size_t n = 0, bits = 0;

    CHECK_INT(strlen(text) % 4, 0);
    for (; *text && *text != '='; text++) {
        const char *digit = strchr(digits, *text);

        CHECK(digit != NULL);
        held = held << 6 | (uint32_t)(digit ? digit - digits : 0);
        bits += 6;
        if (bits >= 8 && n < size) {
            bits -= 8;
            out[n++] = (uint8_t)(held >> bits);
        }
    }
    return n;
}

static float f32(const uint8_t *at)
{
    float v;

    memcpy(&v, at, sizeof v);
    return v;
}

/* Two rows of a turn: to starboard one echo in doubt at 2 m, ahead two at 3 and 4 m. */
static void two_rows(void)
{
    memset(&rows, 0, sizeof rows);
    rows.t_unix = 1700000001.5;
    rows.row[0] = (struct web_row){.changed = 1,
                                   .az_deg = 90,
                                   .n_echoes = 1,
                                   .echo_m = {2},
                                   .marks = {2},
                                   .confidence = {50},
                                   .n_bins = 2,
                                   .bin = {9, 8}};
    rows.row[1] = (struct web_row){.changed = 2,
                                   .az_deg = 0,
                                   .n_echoes = 2,
                                   .echo_m = {3, 4},
                                   .confidence = {100, 20},
                                   .n_bins = 3,
                                   .bin = {1, 2, 3}};
}

TEST(echoes_are_points_with_the_left_positive)
{
    static const float want[3][4] = {{0, -2, 0, 0.5f}, {3, 0, 0, 1}, {4, 0, 0, 0.2f}};
    uint8_t points[3 * 17 + 1];

    two_rows();
    json_t *message = made("/sonar/echoes", NULL);
    CHECK_STR(word(message, "frame_id"), "vehicle");
    CHECK_NEAR(number(message, "timestamp/sec"), 1700000001, 0, 0);
    CHECK_NEAR(number(message, "timestamp/nsec"), 5e8, 0, 1e3);
    CHECK_NEAR(number(message, "point_stride"), 17, 0, 0);
    CHECK_INT(bytes_of(message, points, sizeof points), 3 * 17);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 4; k++)
            CHECK_NEAR(f32(points + 17 * i + 4 * k), want[i][k], 0, 1e-6);
        CHECK_INT(points[17 * i + 16], i == 0); /* in doubt */
    }
    const json_t *fields = json_object_get(message, "fields");
    CHECK_INT(json_array_size(fields), 5);
    CHECK_STR(word(json_array_get(fields, 4), "name"), "doubt");
    CHECK_NEAR(number(json_array_get(fields, 4), "offset"), 16, 0, 0);
    json_decref(message);
}

TEST(the_picture_is_by_azimuth_and_short_lines_are_black_at_their_end)
{
    static const uint8_t want[] = {1, 2, 3, 9, 8, 0};
    uint8_t pixels[10];

    two_rows();
    json_t *message = made("/sonar/image", NULL);
    CHECK_NEAR(number(message, "width"), 3, 0, 0);
    CHECK_NEAR(number(message, "height"), 2, 0, 0);
    CHECK_NEAR(number(message, "step"), 3, 0, 0);
    CHECK_STR(word(message, "encoding"), "mono8");
    CHECK_INT(bytes_of(message, pixels, sizeof pixels), sizeof want);
    CHECK(memcmp(pixels, want, sizeof want) == 0);
    json_decref(message);
}

#define SLICE                                                                                                     \
    "{\"rows\":[\"#. \",\"...\",\"  #\"],\"step_m\":2,\"north_m\":10,\"east_m\":20,\"depth_m\":5,"                \
    "\"vehicle_m\":[7,8,9],\"heading_deg\":30}"

/* The daemon's rows go south from the middle of the north-western cell, Foxglove's north from the corner of the
 * south-western one. */
TEST(a_slice_is_turned_upside_down)
{
    static const uint8_t want[] = {0, 0, 2, 1, 1, 1, 2, 1, 0};
    uint8_t cells[10];
    json_t *message = made("/map/slice", SLICE);

    CHECK_INT(bytes_of(message, cells, sizeof cells), sizeof want);
    CHECK(memcmp(cells, want, sizeof want) == 0);
    CHECK_STR(word(message, "frame_id"), "map");
    CHECK_NEAR(number(message, "pose/position/x"), 19, 0, 1e-9);
    CHECK_NEAR(number(message, "pose/position/y"), 5, 0, 1e-9);
    CHECK_NEAR(number(message, "pose/position/z"), -5, 0, 1e-9);
    CHECK_NEAR(number(message, "column_count"), 3, 0, 0);
    CHECK_NEAR(number(message, "cell_size/x"), 2, 0, 0);
    CHECK_NEAR(number(message, "timestamp/sec"), 1700000000, 0, 0);
    CHECK_NEAR(number(message, "timestamp/nsec"), 2.5e8, 0, 1e3);
    json_decref(message);
    CHECK(!made("/map/slice", "{\"rows\":[],\"step_m\":2,\"north_m\":10,\"east_m\":20}"));
    CHECK(!made("/map/slice", "{\"rows\":[\"#\"],\"north_m\":10,\"east_m\":20}"));
}

TEST(the_vehicle_is_east_north_up_and_turns_from_east)
{
    json_t *pose = made("/vehicle/pose", SLICE), *moved = made("/tf", SLICE);
    const char *of[] = {"x", "y", "z"};
    const double want[] = {8, 7, -9};
    char way[40];

    for (int i = 0; i < 3; i++) {
        snprintf(way, sizeof way, "pose/position/%s", of[i]);
        CHECK_NEAR(number(pose, way), want[i], 0, 1e-9);
        snprintf(way, sizeof way, "translation/%s", of[i]);
        CHECK_NEAR(number(moved, way), want[i], 0, 1e-9);
    }
    /* 30 degrees from north to the right are 60 from east to the left */
    CHECK_NEAR(number(pose, "pose/orientation/z"), 0.5, 0, 1e-9);
    CHECK_NEAR(number(pose, "pose/orientation/w"), sqrt(0.75), 0, 1e-9);
    CHECK_NEAR(number(moved, "rotation/z"), 0.5, 0, 1e-9);
    CHECK_NEAR(number(moved, "rotation/w"), sqrt(0.75), 0, 1e-9);
    CHECK_STR(word(pose, "frame_id"), "map");
    CHECK_STR(word(moved, "parent_frame_id"), "map");
    CHECK_STR(word(moved, "child_frame_id"), "vehicle");
    json_decref(pose);
    json_decref(moved);
}

TEST(without_a_pose_no_place_is_told)
{
    static const char *const none[] = {"{\"vehicle_m\":null,\"heading_deg\":null}",
                                       "{\"vehicle_m\":[1,2,3],\"heading_deg\":null}",
                                       "{\"vehicle_m\":[1,2],\"heading_deg\":5}"};

    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++)
        CHECK(!made("/vehicle/pose", none[i]) && !made("/tf", none[i]));
}

TEST(answers_pass_as_they_are)
{
    json_t *message = made("/sonard/status", "{\"version\":\"1\",\"t\":2}");

    CHECK(json_object_size(message) == 2 && number(message, "t") == 2);
    json_decref(message);
}

TEST(a_time_that_is_none_is_the_beginning)
{
    two_rows();
    rows.t_unix = -1;
    json_t *message = made("/sonar/image", NULL);
    CHECK(number(message, "timestamp/sec") == 0 && number(message, "timestamp/nsec") == 0);
    json_decref(message);
}

int main(void)
{
    RUN(echoes_are_points_with_the_left_positive);
    RUN(the_picture_is_by_azimuth_and_short_lines_are_black_at_their_end);
    RUN(a_slice_is_turned_upside_down);
    RUN(the_vehicle_is_east_north_up_and_turns_from_east);
    RUN(without_a_pose_no_place_is_told);
    RUN(answers_pass_as_they_are);
    RUN(a_time_that_is_none_is_the_beginning);
    return test_end();
}
