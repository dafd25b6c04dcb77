/* SPDX-License-Identifier: MIT */
/*
 * test_view_topics - what viewers are told, of answers made here. Frames turn on the way: the vehicle's is forward,
 * left, up; the map's east, north, up.
 */
#include <math.h>

#include "client/view/picture.h"
#include "client/view/view_topics.h"
#include "tests/lib/test.h"

static struct view_rows rows;
static struct view_cursor cursor;

/* The next message of a topic; `result` is JSON and may be NULL. */
static json_t *made(const char *topic, const char *result)
{
    const struct view_topic *t = view_topics;
    while (t->topic && strcmp(t->topic, topic) != 0)
        t++;
    CHECK(t->topic != NULL);
    if (!t->topic)
        return NULL;
    json_t *given = result ? json_loads(result, 0, NULL) : NULL;
    CHECK(!result || given);
    const struct view_source source = {.result = given, .rows = &rows, .now_unix = 1700000000.25};
    json_t *message = t->make(&source, &cursor);
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

/* The bytes of "data"; how many there are. */
static size_t bytes_of(const json_t *message, uint8_t *out, size_t size)
{
    const json_t *data = json_object_get(message, "data");
    const size_t n = json_string_length(data);
    CHECK(json_is_string(data));
    memcpy(out, json_string_value(data), n < size ? n : size);
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
    rows.row[0] = (struct view_row){.changed = 1,
                                    .t_unix = 1700000001.25,
                                    .az_deg = 90,
                                    .width_deg = 2,
                                    .r1_m = 2,
                                    .n_echoes = 1,
                                    .echo_m = {2},
                                    .marks = {2},
                                    .confidence = {50},
                                    .n_bins = 2,
                                    .bin = {9, 8}};
    rows.row[1] = (struct view_row){.changed = 2,
                                    .t_unix = 1700000001.375,
                                    .az_deg = 0,
                                    .width_deg = 2,
                                    .r1_m = 6,
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
    CHECK_NEAR(number(message, "timestamp/seconds"), 1700000001, 0, 0);
    CHECK_NEAR(number(message, "timestamp/nanos"), 5e8, 0, 1e3);
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

/* Each ping once, the oldest first, as points in the middle of their bins. */
/* Viewers keep the last cloud, so that nothing is there has to be told, too. */
TEST(no_echo_and_no_bin_are_clouds_without_points)
{
    uint8_t none[1];
    two_rows();
    rows.row[0].n_echoes = rows.row[1].n_echoes = 0;
    json_t *message = made("/sonar/echoes", NULL);
    CHECK_INT(bytes_of(message, none, sizeof none), 0);
    json_decref(message);

    rows.row[0].n_bins = 0;
    cursor = (struct view_cursor){0};
    message = made("/sonar/ping", NULL);
    CHECK_INT(bytes_of(message, none, sizeof none), 0);
    json_decref(message);
}

TEST(pings_are_told_one_by_one)
{
    uint8_t points[3 * 9 + 1];
    two_rows();
    cursor = (struct view_cursor){0};
    json_t *first = made("/sonar/ping", NULL), *second = made("/sonar/ping", NULL);
    CHECK_NEAR(number(first, "timestamp/nanos"), 2.5e8, 0, 1e3);
    CHECK_INT(bytes_of(first, points, sizeof points), 2 * 9);
    CHECK_NEAR(f32(points), 0, 0, 1e-6);
    CHECK_NEAR(f32(points + 4), -0.5, 0, 1e-6);
    CHECK_INT(points[8], 9);
    CHECK_NEAR(f32(points + 9 + 4), -1.5, 0, 1e-6);
    CHECK_INT(bytes_of(second, points, sizeof points), 3 * 9);
    CHECK_NEAR(f32(points + 18), 5, 0, 1e-6);
    CHECK_INT(points[26], 3);
    CHECK(!made("/sonar/ping", NULL));
    rows.row[0].changed = 3;
    json_t *third = made("/sonar/ping", NULL);
    CHECK_INT(bytes_of(third, points, sizeof points), 2 * 9);
    CHECK(!made("/sonar/ping", NULL));
    json_decref(first);
    json_decref(second);
    json_decref(third);
}

/* Of more bins than points the loudest of each few is kept: no echo is lost. */
TEST(a_ping_of_many_bins_keeps_its_peaks)
{
    uint8_t points[200 * 9];
    two_rows();
    cursor = (struct view_cursor){0};
    rows.row[0].n_bins = VIEW_ROW_BINS;
    memset(rows.row[0].bin, 7, VIEW_ROW_BINS);
    rows.row[0].bin[100] = 200; /* of bins 99, 100 and 101 */
    json_t *message = made("/sonar/ping", NULL);
    CHECK_INT(bytes_of(message, points, sizeof points), 171 * 9);
    CHECK_INT(points[32 * 9 + 8], 7);
    CHECK_INT(points[33 * 9 + 8], 200);
    CHECK_NEAR(f32(points + 33 * 9 + 4), -2 * 100.5 / 512, 0, 1e-5);
    json_decref(message);
}

static uint8_t pixel(const uint8_t *pixels, double forward_m, double right_m)
{
    const double per_m = PICTURE_SIDE / 2.0 / picture_range_m(&rows);
    return pixels[(int)(PICTURE_SIDE / 2.0 - forward_m * per_m) * PICTURE_SIDE +
                  (int)(PICTURE_SIDE / 2.0 + right_m * per_m)];
}

TEST(the_picture_lies_in_the_plane_with_the_bow_up)
{
    static uint8_t pixels[PICTURE_SIDE * PICTURE_SIDE];
    two_rows();
    memcpy(rows.row[0].bin, (uint8_t[]){0, 255}, 2);
    memcpy(rows.row[1].bin, (uint8_t[]){100, 0, 200}, 3);
    picture_draw(&rows, pixels);
    CHECK_NEAR(picture_range_m(&rows), 6, 0, 0);
    CHECK_INT(pixel(pixels, 1, 0), 1 + 100 * 14 / 255);
    CHECK_INT(pixel(pixels, 3, 0), 1);
    CHECK_INT(pixel(pixels, 5, 0), 1 + 200 * 14 / 255);
    CHECK_INT(pixel(pixels, 0, 0.5), 1);
    CHECK_INT(pixel(pixels, 0, 1.5), 15);
    CHECK_INT(pixel(pixels, 0, 3), 0);  /* beyond its range */
    CHECK_INT(pixel(pixels, -3, 0), 0); /* not pinged */
    CHECK_INT(pixel(pixels, 3, 3), 0);
    json_t *message = made("/sonar/image", NULL);
    CHECK_STR(word(message, "format"), "png");
    CHECK(memcmp(json_string_value(at(message, "data")), "\x89PNG", 4) == 0);
    json_decref(message);
}

#define SLICE                                                                                                     \
    "{\"rows\":[\"#. \",\"...\",\"  #\"],\"step_m\":2,\"north_m\":10,\"east_m\":20,\"depth_m\":5,"                \
    "\"vehicle_m\":null,\"heading_deg\":null}"

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
    CHECK_NEAR(number(message, "timestamp/seconds"), 1700000000, 0, 0);
    CHECK_NEAR(number(message, "timestamp/nanos"), 2.5e8, 0, 1e3);
    json_decref(message);
    CHECK(!made("/map/slice", "{\"rows\":[],\"step_m\":2,\"north_m\":10,\"east_m\":20}"));
    CHECK(!made("/map/slice", "{\"rows\":[\"#\"],\"north_m\":10,\"east_m\":20}"));
}

#define STATUS(position, attitude)                                                                                \
    "{\"t_unix\":1700000002,\"pose\":{\"position_m\":" position ",\"attitude_deg\":" attitude "}}"

TEST(the_vehicle_is_east_north_up_and_turns_from_east)
{
    json_t *pose = made("/vehicle/pose", STATUS("[7,8,9]", "[0,0,30]")),
           *moved = made("/tf", STATUS("[7,8,9]", "[0,0,30]"));
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

/* With the bow to the east the two frames are parallel: what pitches up turns about left, backwards. */
TEST(roll_and_pitch_are_told)
{
    json_t *up = made("/tf", STATUS("[0,0,0]", "[0,60,90]")), *over = made("/tf", STATUS("[0,0,0]", "[60,0,90]"));
    CHECK_NEAR(number(up, "rotation/y"), -0.5, 0, 1e-9);
    CHECK_NEAR(number(up, "rotation/w"), sqrt(0.75), 0, 1e-9);
    CHECK_NEAR(number(over, "rotation/x"), 0.5, 0, 1e-9);
    CHECK_NEAR(number(over, "rotation/w"), sqrt(0.75), 0, 1e-9);
    json_decref(up);
    json_decref(over);
}

TEST(without_a_pose_no_place_is_told)
{
    static const char *const none[] = {STATUS("null", "[1,2,3]"), STATUS("[1,2,3]", "null"),
                                       STATUS("[1,2]", "[1,2,3]"), "{}"};
    for (size_t i = 0; i < sizeof none / sizeof none[0]; i++)
        CHECK(!made("/vehicle/pose", none[i]) && !made("/tf", none[i]));
}

#define SECTOR(az, state, range, free)                                                                            \
    "{\"azimuth_deg\":" az ",\"width_deg\":90,\"state\":\"" state "\",\"range_m\":" range ",\"free_to_m\":" free  \
    ",\"blind_to_m\":0.5}"
#define SECTORS                                                                                                   \
    "{\"t_unix\":1700000003,\"distance_m\":5,\"sectors\":[" SECTOR("0", "blocked", "4", "3") "," SECTOR(          \
        "90", "clear", "null", "5") "," SECTOR("180", "unknown", "null", "2") "," SECTOR("270", "blocked",        \
                                                                                         "null", "1") "]}"

static void check_scan(const char *sectors, const char *ranges)
{
    json_t *scan = made("/sonard/scan", sectors), *want = json_loads(ranges, 0, NULL);
    CHECK_NEAR(number(scan, "start_angle"), -M_PI, 0, 1e-9);
    CHECK_NEAR(number(scan, "end_angle"), M_PI / 2, 0, 1e-9);
    CHECK(want && json_equal(json_object_get(scan, "ranges"), want));
    json_decref(scan);
    json_decref(want);
}

/* For ROS: an obstacle beyond what was judged is there at the latest, and water beyond it is not clear. */
TEST(a_scan_knows_how_far_it_was_judged)
{
    json_t *scan = made("/sonard/scan",
                        "{\"distance_m\":5,\"sectors\":[" SECTOR("0", "blocked", "5.5", "4") "," SECTOR(
                            "90", "clear", "9", "9") "," SECTOR("180", "unknown", "4",
                                                                "2") "," SECTOR("270", "blocked", "3", "2") "]}"),
           *want = json_loads("[null,\"inf\",5.0,3.0]", 0, NULL);
    CHECK_NEAR(number(scan, "far_m"), 5, 0, 0);
    CHECK(want && json_equal(json_object_get(scan, "judged"), want));
    json_decref(scan);
    json_decref(want);
}

/* From astern to the left: port is at 90 degrees. An obstacle is shown wherever it is, behind unknown water too. */
TEST(a_scan_has_the_nearest_obstacle_else_infinity_for_clear_and_nothing_for_unknown)
{
    check_scan(SECTORS, "[null,\"inf\",4,null]");
    check_scan("{\"distance_m\":5,\"sectors\":[" SECTOR("0", "clear", "7", "7") "," SECTOR(
                   "90", "unknown", "8", "2") "," SECTOR("180", "clear", "9", "9") "," SECTOR("270", "blocked",
                                                                                              "3", "2") "]}",
               "[9,8,7,3]");
    CHECK(!made("/sonard/scan", "{\"t_unix\":1,\"sectors\":[]}"));
}

/* Of three colours: what is blocked from the obstacle on, clear water, and what lies behind what is known. */
TEST(a_ring_shows_how_far_each_sector_is_what)
{
    json_t *scene = made("/sonard/ring", SECTORS);
    const json_t *entity = json_array_get(json_object_get(scene, "entities"), 0),
                 *triangles = json_object_get(entity, "triangles");
    static const double from[] = {4, 0.5, 2}, cosine = M_SQRT1_2;
    static const double side[3][2] = {{1, 1}, {1, -1}, {-1, -1}}; /* of the first point: forward, left */
    CHECK_STR(word(entity, "frame_id"), "vehicle");
    CHECK_NEAR(number(entity, "lifetime/seconds"), 3, 0, 0);
    CHECK_INT(json_array_size(triangles), 3);
    for (size_t i = 0; i < 3; i++) {
        const json_t *list = json_array_get(triangles, i), *points = json_object_get(list, "points");
        CHECK_INT(json_array_size(points), 4);
        CHECK_INT(json_array_size(json_object_get(list, "indices")), 6);
        CHECK_NEAR(number(json_array_get(points, 0), "x"), side[i][0] * cosine * from[i], 0, 1e-9);
        CHECK_NEAR(number(json_array_get(points, 0), "y"), side[i][1] * cosine * from[i], 0, 1e-9);
        CHECK_NEAR(fabs(number(json_array_get(points, 3), "x")), cosine * 5, 0, 1e-9);
    }
    json_decref(scene);
}

/* A band of 15 cm, and before it the water as far as it was judged. */
TEST(a_ring_shows_obstacles_beyond_as_well)
{
    json_t *scene = made("/sonard/ring", "{\"distance_m\":5,\"sectors\":[" SECTOR(
                                             "0", "clear", "7", "5") "," SECTOR("180", "unknown", "8", "2") "]}");
    const json_t *triangles = json_object_get(json_array_get(json_object_get(scene, "entities"), 0), "triangles");
    const json_t *band = json_object_get(json_array_get(triangles, 0), "points");
    CHECK_INT(json_array_size(band), 8);
    CHECK_NEAR(number(json_array_get(band, 0), "x"), M_SQRT1_2 * 7, 0, 1e-9);
    CHECK_NEAR(number(json_array_get(band, 1), "x"), M_SQRT1_2 * 7.15, 0, 1e-9);
    CHECK_NEAR(number(json_array_get(band, 4), "x"), -M_SQRT1_2 * 8, 0, 1e-9);
    for (size_t i = 1; i < 3; i++)
        CHECK_INT(json_array_size(json_object_get(json_array_get(triangles, i), "points")), 4);
    json_decref(scene);
}

#define STATE(data, state, doubt)                                                                                 \
    "{\"t_unix\":1700000004,\"data\":\"" data "\",\"sensors\":[{\"name\":\"head\",\"state\":\"" state             \
    "\",\"hearing_doubt\":" doubt "}],\"pose\":{\"missing\":\"\",\"doubt\":\"\"}}"

static void check_log(const char *status, const char *name, const char *sentence, int level)
{
    json_t *log = made("/sonard/log", status);
    CHECK(log != NULL);
    CHECK_STR(word(log, "name"), name);
    CHECK_STR(word(log, "message"), sentence);
    CHECK_NEAR(number(log, "level"), level, 0, 0);
    json_decref(log);
}

/* Each sentence once, until there is another one of its name. */
TEST(the_log_has_what_changed)
{
    cursor = (struct view_cursor){0};
    check_log(STATE("ok", "running", "null"), "data", "ok", 2);
    check_log(STATE("ok", "running", "null"), "sonar head", "running", 2);
    CHECK(!made("/sonard/log", STATE("ok", "running", "null")));
    check_log(STATE("no data from the sonar", "silent", "null"), "data", "no data from the sonar", 3);
    check_log(STATE("no data from the sonar", "silent", "null"), "sonar head", "silent", 3);
    check_log(STATE("no data from the sonar", "running", "\"deaf\""), "sonar head", "running; deaf", 3);
    check_log(STATE("ok", "running", "\"deaf\""), "data", "ok", 2);
    CHECK(!made("/sonard/log", STATE("ok", "running", "\"deaf\"")));
    json_decref(cursor.said);
    cursor = (struct view_cursor){0};
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
    CHECK(number(message, "timestamp/seconds") == 0 && number(message, "timestamp/nanos") == 0);
    json_decref(message);
    rows.t_unix = 0.25; /* of a capture on a virtual clock */
    message = made("/sonar/image", NULL);
    CHECK(number(message, "timestamp/seconds") == 0 && number(message, "timestamp/nanos") == 2.5e8);
    json_decref(message);
}

int main(void)
{
    RUN(echoes_are_points_with_the_left_positive);
    RUN(no_echo_and_no_bin_are_clouds_without_points);
    RUN(pings_are_told_one_by_one);
    RUN(a_ping_of_many_bins_keeps_its_peaks);
    RUN(the_picture_lies_in_the_plane_with_the_bow_up);
    RUN(a_slice_is_turned_upside_down);
    RUN(the_vehicle_is_east_north_up_and_turns_from_east);
    RUN(roll_and_pitch_are_told);
    RUN(without_a_pose_no_place_is_told);
    RUN(a_scan_has_the_nearest_obstacle_else_infinity_for_clear_and_nothing_for_unknown);
    RUN(a_scan_knows_how_far_it_was_judged);
    RUN(a_ring_shows_how_far_each_sector_is_what);
    RUN(a_ring_shows_obstacles_beyond_as_well);
    RUN(the_log_has_what_changed);
    RUN(answers_pass_as_they_are);
    RUN(a_time_that_is_none_is_the_beginning);
    return test_end();
}
