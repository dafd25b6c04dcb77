/* SPDX-License-Identifier: MIT */
#include "view_topics.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "answer_type.h"
#include "foxglove.h"
#include "picture.h"

#define PI         3.14159265358979323846
#define SLICE_MAX  160  /* cells along a side */
#define PING_MAX   200  /* points of a ping */
#define RING_S     3    /* that a ring is shown for without another one */
#define BAND_LEAST 0.15 /* m: so wide is an obstacle in the ring at least */

/* ---- pieces ---- */

static double number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);
    return json_is_number(value) ? json_number_value(value) : NAN;
}

static const char *text(const json_t *object, const char *key)
{
    const char *value = json_string_value(json_object_get(object, key));
    return value ? value : "";
}

static json_t *time_of(double t_unix)
{
    const double t = t_unix > 0 && t_unix < 1e11 ? t_unix : 0, s = floor(t);
    return json_pack("{s:I, s:I}", "seconds", (json_int_t)s, "nanos", (json_int_t)((t - s) * 1e9));
}

static json_t *vector(double x, double y, double z)
{
    return json_pack("{s:f, s:f, s:f}", "x", x, "y", y, "z", z);
}

/* Of turns about forward, left and up, the last one first. */
static json_t *quaternion(double roll, double pitch, double yaw)
{
    const double cr = cos(roll / 2), sr = sin(roll / 2), cp = cos(pitch / 2), sp = sin(pitch / 2),
                 cy = cos(yaw / 2), sy = sin(yaw / 2);
    return json_pack("{s:f, s:f, s:f, s:f}", "x", sr * cp * cy - cr * sp * sy, "y", cr * sp * cy + sr * cp * sy,
                     "z", cr * cp * sy - sr * sp * cy, "w", cr * cp * cy + sr * sp * sy);
}

static json_t *level_pose(double x, double y, double z)
{
    return json_pack("{s:o, s:o}", "position", vector(x, y, z), "orientation", quaternion(0, 0, 0));
}

/* The bytes go to the message as they are. Where none were put there is no memory, and NULL is no text. */
static json_t *data_of(struct bytes *bytes)
{
    const char *text = bytes->size > 0 ? (const char *)bytes->data : "";
    json_t *data = bytes->failed ? NULL : json_stringn_nocheck(text, bytes->size);
    free(bytes->data);
    *bytes = (struct bytes){0};
    return data;
}

static void add_field(json_t *fields, const char *name, int offset, enum foxglove_numeric type)
{
    json_array_append_new(fields, json_pack("{s:s, s:i, s:i}", "name", name, "offset", offset, "type", type));
}

/* ---- pings and echoes ---- */

static json_t *cloud(double t_unix, int stride, json_t *fields, struct bytes *points)
{
    return json_pack("{s:o, s:s, s:o, s:i, s:o, s:o}", "timestamp", time_of(t_unix), "frame_id", "vehicle", "pose",
                     level_pose(0, 0, 0), "point_stride", stride, "fields", fields, "data", data_of(points));
}

/* The row that changed next; NULL: none did. */
static const struct view_row *next_row(const struct view_rows *rows, uint64_t seen)
{
    const struct view_row *next = NULL;
    for (size_t i = 0; i < VIEW_ROWS_MAX && rows->row[i].changed; i++)
        if (rows->row[i].changed > seen && (!next || rows->row[i].changed < next->changed))
            next = &rows->row[i];
    return next;
}

/* A ping as points along its beam, each the loudest of the bins that it stands for. */
static json_t *make_ping(const struct view_source *source, struct view_cursor *cursor)
{
    const struct view_row *row = next_row(source->rows, cursor->row);
    struct bytes points = {0};
    json_t *fields;
    if (!row)
        return NULL;
    cursor->row = row->changed;
    const int pool = (row->n_bins + PING_MAX - 1) / PING_MAX;
    const double az = (double)row->az_deg * PI / 180, bin_m = (double)(row->r1_m - row->r0_m) / row->n_bins;

    for (int i = 0; i < row->n_bins; i += pool) {
        const int n = row->n_bins - i < pool ? row->n_bins - i : pool;
        const double r_m = (double)row->r0_m + (i + n / 2.0) * bin_m;
        uint8_t most = 0;
        for (int k = i; k < i + n; k++)
            most = row->bin[k] > most ? row->bin[k] : most;
        bytes_float(&points, r_m * cos(az));
        bytes_float(&points, -r_m * sin(az));
        bytes_number(&points, most, 1);
    }
    fields = json_array();
    add_field(fields, "x", 0, FOXGLOVE_FLOAT32);
    add_field(fields, "y", 4, FOXGLOVE_FLOAT32);
    add_field(fields, "intensity", 8, FOXGLOVE_UINT8);
    return cloud(row->t_unix, 9, fields, &points);
}

/* The echoes of the last turn. */
static json_t *make_echoes(const struct view_source *source, struct view_cursor *cursor)
{
    const struct view_rows *rows = source->rows;
    struct bytes points = {0};
    json_t *fields = json_array();
    (void)cursor;
    for (size_t i = 0; i < VIEW_ROWS_MAX && rows->row[i].changed; i++) {
        const struct view_row *row = &rows->row[i];
        const double az = (double)row->az_deg * PI / 180;
        for (int k = 0; k < row->n_echoes; k++) {
            bytes_float(&points, (double)row->echo_m[k] * cos(az));
            bytes_float(&points, -(double)row->echo_m[k] * sin(az));
            bytes_float(&points, 0);
            bytes_float(&points, row->confidence[k] / 100.0);
            bytes_number(&points, row->marks[k] != 0, 1);
        }
    }
    add_field(fields, "x", 0, FOXGLOVE_FLOAT32);
    add_field(fields, "y", 4, FOXGLOVE_FLOAT32);
    add_field(fields, "z", 8, FOXGLOVE_FLOAT32);
    add_field(fields, "confidence", 12, FOXGLOVE_FLOAT32);
    add_field(fields, "doubt", 16, FOXGLOVE_UINT8);
    return cloud(rows->t_unix, 17, fields, &points);
}

static json_t *make_image(const struct view_source *source, struct view_cursor *cursor)
{
    struct bytes png = {0};
    (void)cursor;
    picture_png(source->rows, &png);
    return json_pack("{s:o, s:s, s:s, s:o}", "timestamp", time_of(source->rows->t_unix), "frame_id", "vehicle",
                     "format", "png", "data", data_of(&png));
}

/* ---- the map and the pose ---- */

/* The level slice: 0 unknown, 1 free, 2 occupied. Rows of a foxglove.Grid go up from its origin. */
static json_t *make_slice(const struct view_source *source, struct view_cursor *cursor)
{
    const json_t *slice = source->result, *rows = json_object_get(slice, "rows");
    const size_t n = json_array_size(rows);
    const double step = number(slice, "step_m"), north = number(slice, "north_m"), east = number(slice, "east_m");
    uint8_t cells[SLICE_MAX * SLICE_MAX] = {0};
    json_t *fields;
    (void)cursor;
    if (n == 0 || n > SLICE_MAX || !isfinite(step + north + east))
        return NULL;
    for (size_t i = 0; i < n; i++) {
        const char *row = json_string_value(json_array_get(rows, n - 1 - i));
        for (size_t k = 0; row && row[k] && k < n; k++)
            cells[i * n + k] = row[k] == '.' ? 1 : row[k] == '#' ? 2 : 0;
    }
    fields = json_array();
    add_field(fields, "state", 0, FOXGLOVE_UINT8);
    return json_pack("{s:o, s:s, s:o, s:I, s:{s:f, s:f}, s:I, s:i, s:o, s:o}", "timestamp",
                     time_of(source->now_unix), "frame_id", "map", "pose",
                     level_pose(east - step / 2, north - step * ((double)n - 0.5), -number(slice, "depth_m")),
                     "column_count", (json_int_t)n, "cell_size", "x", step, "y", step, "row_stride", (json_int_t)n,
                     "cell_stride", 1, "fields", fields, "data", json_stringn_nocheck((const char *)cells, n * n));
}

/* Where the vehicle is and how it lies, of a status; false: nobody has told all of it lately. */
static bool place_of(const json_t *status, json_t **position, json_t **orientation)
{
    const json_t *pose = json_object_get(status, "pose"), *place = json_object_get(pose, "position_m"),
                 *attitude = json_object_get(pose, "attitude_deg");
    double ned[3], rpy[3];
    if (json_array_size(place) != 3 || json_array_size(attitude) != 3)
        return false;
    for (size_t i = 0; i < 3; i++) {
        ned[i] = json_number_value(json_array_get(place, i));
        rpy[i] = json_number_value(json_array_get(attitude, i)) * PI / 180;
    }
    *position = vector(ned[1], ned[0], -ned[2]);
    *orientation = quaternion(rpy[0], -rpy[1], PI / 2 - rpy[2]);
    return true;
}

static json_t *make_pose(const struct view_source *source, struct view_cursor *cursor)
{
    json_t *position, *orientation;
    (void)cursor;
    if (!place_of(source->result, &position, &orientation))
        return NULL;
    return json_pack("{s:o, s:s, s:{s:o, s:o}}", "timestamp", time_of(number(source->result, "t_unix")),
                     "frame_id", "map", "pose", "position", position, "orientation", orientation);
}

static json_t *make_transform(const struct view_source *source, struct view_cursor *cursor)
{
    json_t *position, *orientation;
    (void)cursor;
    if (!place_of(source->result, &position, &orientation))
        return NULL;
    return json_pack("{s:o, s:s, s:s, s:o, s:o}", "timestamp", time_of(number(source->result, "t_unix")),
                     "parent_frame_id", "map", "child_frame_id", "vehicle", "translation", position, "rotation",
                     orientation);
}

/* ---- answers ---- */

/* The range of an obstacle, beyond the distance too; without one, infinite where the water is clear. */
static json_t *range_of(const json_t *sector)
{
    json_t *range = json_object_get(sector, "range_m");
    if (json_is_number(range))
        return json_incref(range);
    return strcmp(text(sector, "state"), "clear") == 0 ? json_string("inf") : json_null();
}

/* The same for readers who take infinity for free water up to far_m: no obstacle is beyond that. */
static json_t *judged_of(const json_t *sector, double far_m)
{
    const char *state = text(sector, "state");
    const double range_m = number(sector, "range_m");
    if (strcmp(state, "blocked") == 0 && isfinite(range_m))
        return json_real(fmin(range_m, far_m));
    return strcmp(state, "clear") == 0 ? json_string("inf") : json_null();
}

/* The nearest obstacle of each sector, counter-clockwise from astern. Foxglove knows nothing of far_m and judged. */
static json_t *make_scan(const struct view_source *source, struct view_cursor *cursor)
{
    const json_t *sectors = json_object_get(source->result, "sectors");
    const size_t n = json_array_size(sectors);
    const double width = 2 * PI / (double)n, start = -width * (double)(n / 2),
                 far_m = number(source->result, "distance_m");
    json_t *ranges, *judged;
    (void)cursor;
    if (n == 0 || !isfinite(far_m))
        return NULL;
    ranges = json_array();
    judged = json_array();
    for (size_t i = 0; i < n; i++) { /* sector k is k widths to starboard of the bow */
        const json_t *sector = json_array_get(sectors, (n + n / 2 - i) % n);

        json_array_append_new(ranges, range_of(sector));
        json_array_append_new(judged, judged_of(sector, far_m));
    }
    return json_pack("{s:o, s:s, s:o, s:f, s:f, s:o, s:f, s:o}", "timestamp",
                     time_of(number(source->result, "t_unix")), "frame_id", "vehicle", "pose", level_pose(0, 0, 0),
                     "start_angle", start, "end_angle", start + width * (double)(n - 1), "ranges", ranges, "far_m",
                     far_m, "judged", judged);
}

enum ring { RING_BLOCKED, RING_CLEAR, RING_UNKNOWN, RINGS };

static void add_point(json_t *points, double r_m, double az_deg)
{
    json_array_append_new(points, vector(r_m * cos(az_deg * PI / 180), -r_m * sin(az_deg * PI / 180), 0));
}

/* A piece of a ring as two triangles. */
static void add_piece(json_t *triangles, const json_t *sector, double from_m, double to_m)
{
    static const int corner[] = {0, 1, 2, 1, 3, 2};
    json_t *points = json_object_get(triangles, "points"), *indices = json_object_get(triangles, "indices");
    const size_t first = json_array_size(points);
    const double az = number(sector, "azimuth_deg"), half = number(sector, "width_deg") / 2;
    if (!isfinite(az + half + from_m + to_m) || from_m >= to_m)
        return;
    for (int i = 0; i < 4; i++)
        add_point(points, i & 1 ? to_m : from_m, i & 2 ? az + half : az - half);
    for (int i = 0; i < 6; i++)
        json_array_append_new(indices, json_integer((json_int_t)first + corner[i]));
}

static void add_sector(json_t *const ring[RINGS], const json_t *sector, double far_m)
{
    const char *state = text(sector, "state");
    const double range_m = number(sector, "range_m");
    if (isfinite(range_m))
        add_piece(ring[RING_BLOCKED], sector, range_m, fmax(far_m, range_m + BAND_LEAST));
    if (strcmp(state, "blocked") == 0)
        return;
    if (strcmp(state, "clear") == 0)
        add_piece(ring[RING_CLEAR], sector, number(sector, "blind_to_m"), far_m);
    else
        add_piece(ring[RING_UNKNOWN], sector, number(sector, "free_to_m"), far_m);
}

/* The sectors as far as they were judged: from an obstacle on, free water, and beyond what is known. Of an obstacle
 * farther away a band. */
static json_t *make_ring(const struct view_source *source, struct view_cursor *cursor)
{
    static const double colour[RINGS][4] = {{0.9, 0.1, 0.1, 0.8}, {0.1, 0.8, 0.3, 0.25}, {0.5, 0.5, 0.5, 0.35}};
    const json_t *sectors = json_object_get(source->result, "sectors"), *sector;
    json_t *ring[RINGS], *triangles = json_array();
    size_t k;
    (void)cursor;
    for (int i = 0; i < RINGS; i++)
        ring[i] = json_pack("{s:[], s:[], s:{s:f, s:f, s:f, s:f}}", "points", "indices", "color", "r",
                            colour[i][0], "g", colour[i][1], "b", colour[i][2], "a", colour[i][3]);
    json_array_foreach(sectors, k, sector) add_sector(ring, sector, number(source->result, "distance_m"));
    for (int i = 0; i < RINGS; i++) {
        json_object_set_new(ring[i], "pose", level_pose(0, 0, 0));
        json_array_append_new(triangles, ring[i]);
    }
    return json_pack("{s:[{s:o, s:s, s:s, s:{s:i}, s:b, s:o}]}", "entities", "timestamp",
                     time_of(number(source->result, "t_unix")), "frame_id", "vehicle", "id", "ring", "lifetime",
                     "seconds", RING_S, "frame_locked", 1, "triangles", triangles);
}

static json_t *make_same(const struct view_source *source, struct view_cursor *cursor)
{
    (void)cursor;
    return json_incref((json_t *)(uintptr_t)source->result);
}

/* ---- what is wrong, in sentences ---- */

/* The next of the sentences of a status that are not what was said under their name. */
static json_t *say(struct view_cursor *cursor, const json_t *status, const char *name, const char *sentence,
                   bool fine)
{
    if (!cursor->said)
        cursor->said = json_object();
    const char *before = text(cursor->said, name);

    if (strcmp(before, sentence) == 0)
        return NULL;
    json_object_set_new(cursor->said, name, json_string(sentence));
    return json_pack("{s:o, s:i, s:s, s:s}", "timestamp", time_of(number(status, "t_unix")), "level",
                     fine || !sentence[0] ? FOXGLOVE_INFO : FOXGLOVE_WARNING, "name", name, "message",
                     sentence[0] ? sentence : "no longer");
}

static json_t *say_sensor(struct view_cursor *cursor, const json_t *status, const json_t *sensor)
{
    static const char *const doubts[] = {"port_error", "hearing_doubt", "amplitude_doubt"};
    const char *state = text(sensor, "state"), *name = text(sensor, "name");
    char sentence[512], about[128];
    bool fine = strcmp(state, "running") == 0;
    size_t n = (size_t)snprintf(sentence, sizeof sentence, "%s", state);
    for (size_t i = 0; i < sizeof doubts / sizeof *doubts; i++) {
        const char *doubt = text(sensor, doubts[i]);
        if (doubt[0] && n < sizeof sentence) {
            n += (size_t)snprintf(sentence + n, sizeof sentence - n, "; %s", doubt);
            fine = false;
        }
    }
    snprintf(about, sizeof about, "sonar %s", name);
    return say(cursor, status, about, sentence, fine);
}

static json_t *make_log(const struct view_source *source, struct view_cursor *cursor)
{
    const json_t *status = source->result, *pose = json_object_get(status, "pose"), *sensor;
    const char *data = text(status, "data");
    json_t *log = say(cursor, status, "data", data, strcmp(data, "ok") == 0);
    size_t i;
    json_array_foreach(json_object_get(status, "sensors"), i, sensor) log =
        log ? log : say_sensor(cursor, status, sensor);
    log = log ? log : say(cursor, status, "pose", text(pose, "missing"), false);
    log = log ? log : say(cursor, status, "velocity", text(pose, "doubt"), false);
    return log ? log : say(cursor, status, "recording", text(json_object_get(status, "record"), "error"), false);
}

/* ---- the table ---- */

const struct view_topic view_topics[VIEW_TOPICS + 1] = {
    {"/sonar/ping", &foxglove_point_cloud, "image", "{}", 0, true, make_ping},
    {"/sonar/echoes", &foxglove_point_cloud, "image", "{}", 1, false, make_echoes},
    {"/sonar/image", &foxglove_compressed_image, "image", "{}", 1, false, make_image},
    {"/map/slice", &foxglove_grid, "map_slice", "{\"size_m\":40,\"cells\":160}", 2, false, make_slice},
    {"/vehicle/pose", &foxglove_pose_in_frame, "status", "{}", 0, false, make_pose},
    {"/tf", &foxglove_frame_transform, "status", "{}", 0, false, make_transform},
    {"/sonard/scan", &foxglove_laser_scan, "sectors", "{}", 0.5, false, make_scan},
    {"/sonard/ring", &foxglove_scene_update, "sectors", "{}", 1, false, make_ring},
    {"/sonard/log", &foxglove_log, "status", "{}", 0, true, make_log},
    {"/sonard/sectors", NULL, "sectors", "{}", 1, false, make_same},
    {"/sonard/status", NULL, "status", "{}", 1, false, make_same},
    {0},
};

const struct message_type *view_topic_type(const struct view_topic *topic)
{
    return topic->type ? topic->type : answer_type(topic->method);
}
