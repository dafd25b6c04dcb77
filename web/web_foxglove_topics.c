/* SPDX-License-Identifier: MIT */
#include "web_foxglove_topics.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI          3.14159265358979323846
#define POINT_BYTES 17 /* float x, y, z, confidence; uchar doubt */
#define UINT8       1  /* of foxglove.NumericType */
#define FLOAT32     7

/* ---- schemas, as foxglove.dev has them ---- */

#define NUMBER_  "{\"type\":\"number\"}"
#define INTEGER_ "{\"type\":\"integer\"}"
#define STRING_  "{\"type\":\"string\"}"
#define DATA_    "{\"type\":\"string\",\"contentEncoding\":\"base64\"}"
#define TIME_                                                                                                     \
    "{\"type\":\"object\",\"title\":\"time\",\"properties\":{\"sec\":" INTEGER_ ",\"nsec\":" INTEGER_ "}}"
#define VECTOR3_                                                                                                  \
    "{\"type\":\"object\",\"title\":\"foxglove.Vector3\",\"properties\":{\"x\":" NUMBER_ ",\"y\":" NUMBER_        \
    ",\"z\":" NUMBER_ "}}"
#define VECTOR2_                                                                                                  \
    "{\"type\":\"object\",\"title\":\"foxglove.Vector2\",\"properties\":{\"x\":" NUMBER_ ",\"y\":" NUMBER_ "}}"
#define QUATERNION_                                                                                               \
    "{\"type\":\"object\",\"title\":\"foxglove.Quaternion\",\"properties\":{\"x\":" NUMBER_ ",\"y\":" NUMBER_     \
    ",\"z\":" NUMBER_ ",\"w\":" NUMBER_ "}}"
#define POSE_                                                                                                     \
    "{\"type\":\"object\",\"title\":\"foxglove.Pose\",\"properties\":{\"position\":" VECTOR3_                     \
    ",\"orientation\":" QUATERNION_ "}}"
#define FIELDS_                                                                                                   \
    "{\"type\":\"array\",\"items\":{\"type\":\"object\",\"title\":\"foxglove.PackedElementField\","               \
    "\"properties\":{"                                                                                            \
    "\"name\":" STRING_ ",\"offset\":" INTEGER_ ",\"type\":" INTEGER_ "}}}"
#define OBJECT_(title, properties) "{\"title\":\"" title "\",\"type\":\"object\",\"properties\":{" properties "}}"

static const char cloud_schema[] =
    OBJECT_("foxglove.PointCloud", "\"timestamp\":" TIME_ ",\"frame_id\":" STRING_ ",\"pose\":" POSE_
                                   ",\"point_stride\":" INTEGER_ ",\"fields\":" FIELDS_ ",\"data\":" DATA_);
static const char image_schema[] =
    OBJECT_("foxglove.RawImage",
            "\"timestamp\":" TIME_ ",\"frame_id\":" STRING_ ",\"width\":" INTEGER_ ",\"height\":" INTEGER_
            ",\"encoding\":" STRING_ ",\"step\":" INTEGER_ ",\"data\":" DATA_);
static const char grid_schema[] =
    OBJECT_("foxglove.Grid", "\"timestamp\":" TIME_ ",\"frame_id\":" STRING_ ",\"pose\":" POSE_
                             ",\"column_count\":" INTEGER_ ",\"cell_size\":" VECTOR2_ ",\"row_stride\":" INTEGER_
                             ",\"cell_stride\":" INTEGER_ ",\"fields\":" FIELDS_ ",\"data\":" DATA_);
static const char pose_schema[] =
    OBJECT_("foxglove.PoseInFrame", "\"timestamp\":" TIME_ ",\"frame_id\":" STRING_ ",\"pose\":" POSE_);
static const char transform_schema[] =
    OBJECT_("foxglove.FrameTransform",
            "\"timestamp\":" TIME_ ",\"parent_frame_id\":" STRING_ ",\"child_frame_id\":" STRING_
            ",\"translation\":" VECTOR3_ ",\"rotation\":" QUATERNION_);
static const char any_schema[] = "{\"type\":\"object\"}"; /* results: /api/openapi.json has their schemas */

/* ---- pieces ---- */

static double number(const json_t *object, const char *key)
{
    const json_t *value = json_object_get(object, key);

    return json_is_number(value) ? json_number_value(value) : NAN;
}

static json_t *time_of(double t_unix)
{
    const double s = t_unix > 0 && t_unix < 1e11 ? floor(t_unix) : 0;

    return json_pack("{s:I, s:I}", "sec", (json_int_t)s, "nsec", (json_int_t)((s > 0 ? t_unix - s : 0) * 1e9));
}

static json_t *base64(const uint8_t *bytes, size_t n)
{
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    char *text = malloc((n + 2) / 3 * 4 + 1), *at = text;
    json_t *string;

    if (!text)
        return NULL;
    for (size_t i = 0; i < n; i += 3) {
        const uint32_t three = (uint32_t)bytes[i] << 16 | (i + 1 < n ? (uint32_t)bytes[i + 1] << 8 : 0) |
                               (i + 2 < n ? bytes[i + 2] : 0);

        *at++ = digits[three >> 18];
        *at++ = digits[three >> 12 & 63];
        *at++ = i + 1 < n ? digits[three >> 6 & 63] : '=';
        *at++ = i + 2 < n ? digits[three & 63] : '=';
    }
    *at = '\0';
    string = json_string(text);
    free(text);
    return string;
}

static json_t *field(const char *name, int offset, int type)
{
    return json_pack("{s:s, s:i, s:i}", "name", name, "offset", offset, "type", type);
}

static json_t *pose(double x, double y, double z, double yaw_rad)
{
    return json_pack("{s:{s:f, s:f, s:f}, s:{s:f, s:f, s:f, s:f}}", "position", "x", x, "y", y, "z", z,
                     "orientation", "x", 0.0, "y", 0.0, "z", sin(yaw_rad / 2), "w", cos(yaw_rad / 2));
}

static void put_float(uint8_t *at, double v)
{
    const float f = (float)v;
    uint32_t bits;

    memcpy(&bits, &f, sizeof bits);
    for (int i = 0; i < 4; i++)
        at[i] = (uint8_t)(bits >> (8 * i));
}

/* ---- topics ---- */

/* The echoes of the last turn, as points around the vehicle. */
static json_t *make_echoes(const json_t *result, const struct web_rows *rows, double now_unix)
{
    static uint8_t points[WEB_ROWS_MAX * WEB_ROW_ECHOES * POINT_BYTES];
    size_t n = 0;

    (void)result, (void)now_unix;
    for (size_t i = 0; i < WEB_ROWS_MAX && rows->row[i].changed; i++) {
        const struct web_row *row = &rows->row[i];
        const double az = (double)row->az_deg * PI / 180;

        for (int k = 0; k < row->n_echoes; k++, n += POINT_BYTES) {
            put_float(points + n, (double)row->echo_m[k] * cos(az));
            put_float(points + n + 4, -(double)row->echo_m[k] * sin(az));
            put_float(points + n + 8, 0);
            put_float(points + n + 12, row->confidence[k] / 100.0);
            points[n + 16] = row->marks[k] != 0;
        }
    }
    return json_pack("{s:o, s:s, s:o, s:i, s:[o,o,o,o,o], s:o}", "timestamp", time_of(rows->t_unix), "frame_id",
                     "vehicle", "pose", pose(0, 0, 0, 0), "point_stride", POINT_BYTES, "fields",
                     field("x", 0, FLOAT32), field("y", 4, FLOAT32), field("z", 8, FLOAT32),
                     field("confidence", 12, FLOAT32), field("doubt", 16, UINT8), "data", base64(points, n));
}

static int by_azimuth(const void *a, const void *b)
{
    const struct web_row *const *x = a, *const *y = b;

    return ((*x)->az_deg > (*y)->az_deg) - ((*x)->az_deg < (*y)->az_deg);
}

/* The raw picture: a line of pixels per direction, by azimuth, nearest on the left. */
static json_t *make_image(const json_t *result, const struct web_rows *rows, double now_unix)
{
    static uint8_t pixels[WEB_ROWS_MAX * WEB_ROW_BINS];
    const struct web_row *sorted[WEB_ROWS_MAX];
    size_t n = 0, width = 1;

    (void)result, (void)now_unix;
    for (; n < WEB_ROWS_MAX && rows->row[n].changed; n++) {
        sorted[n] = &rows->row[n];
        width = sorted[n]->n_bins > width ? sorted[n]->n_bins : width;
    }
    qsort(sorted, n, sizeof *sorted, by_azimuth);
    memset(pixels, 0, n * width);
    for (size_t i = 0; i < n; i++)
        memcpy(pixels + i * width, sorted[i]->bin, sorted[i]->n_bins);
    return json_pack("{s:o, s:s, s:I, s:I, s:s, s:I, s:o}", "timestamp", time_of(rows->t_unix), "frame_id",
                     "vehicle", "width", (json_int_t)width, "height", (json_int_t)n, "encoding", "mono8", "step",
                     (json_int_t)width, "data", base64(pixels, n * width));
}

/* The level slice of the map: 0 unknown, 1 free, 2 occupied. Rows of a foxglove.Grid go up from its origin. */
static json_t *make_slice(const json_t *slice, const struct web_rows *none, double now_unix)
{
    static uint8_t cells[160 * 160];
    const json_t *rows = json_object_get(slice, "rows");
    const size_t n = json_array_size(rows);
    const double step = number(slice, "step_m"), north = number(slice, "north_m"), east = number(slice, "east_m");

    (void)none;
    if (n == 0 || n * n > sizeof cells || !isfinite(step + north + east))
        return NULL;
    memset(cells, 0, n * n);
    for (size_t i = 0; i < n; i++) {
        const char *row = json_string_value(json_array_get(rows, n - 1 - i));

        for (size_t k = 0; row && row[k] && k < n; k++)
            cells[i * n + k] = row[k] == '.' ? 1 : row[k] == '#' ? 2 : 0;
    }
    return json_pack("{s:o, s:s, s:o, s:I, s:{s:f, s:f}, s:I, s:i, s:[o], s:o}", "timestamp", time_of(now_unix),
                     "frame_id", "map", "pose",
                     pose(east - step / 2, north - step * ((double)n - 0.5), -number(slice, "depth_m"), 0),
                     "column_count", (json_int_t)n, "cell_size", "x", step, "y", step, "row_stride", (json_int_t)n,
                     "cell_stride", 1, "fields", field("state", 0, UINT8), "data", base64(cells, n * n));
}

/* East, north, up and the angle from east of a slice's vehicle; false: there is no pose. */
static bool place_of(const json_t *slice, double place[4])
{
    const json_t *vehicle = json_object_get(slice, "vehicle_m");
    const double heading = number(slice, "heading_deg");

    if (json_array_size(vehicle) != 3 || !isfinite(heading))
        return false;
    place[0] = json_number_value(json_array_get(vehicle, 1));
    place[1] = json_number_value(json_array_get(vehicle, 0));
    place[2] = -json_number_value(json_array_get(vehicle, 2));
    place[3] = (90 - heading) * PI / 180;
    return true;
}

static json_t *make_pose(const json_t *slice, const struct web_rows *none, double now_unix)
{
    double p[4];

    (void)none;
    if (!place_of(slice, p))
        return NULL;
    return json_pack("{s:o, s:s, s:o}", "timestamp", time_of(now_unix), "frame_id", "map", "pose",
                     pose(p[0], p[1], p[2], p[3]));
}

static json_t *make_transform(const json_t *slice, const struct web_rows *none, double now_unix)
{
    double p[4];

    (void)none;
    if (!place_of(slice, p))
        return NULL;
    return json_pack("{s:o, s:s, s:s, s:{s:f, s:f, s:f}, s:{s:f, s:f, s:f, s:f}}", "timestamp", time_of(now_unix),
                     "parent_frame_id", "map", "child_frame_id", "vehicle", "translation", "x", p[0], "y", p[1],
                     "z", p[2], "rotation", "x", 0.0, "y", 0.0, "z", sin(p[3] / 2), "w", cos(p[3] / 2));
}

static json_t *make_same(const json_t *result, const struct web_rows *none, double now_unix)
{
    (void)none, (void)now_unix;
    return json_incref((json_t *)result);
}

#define SLICE "{\"size_m\":40,\"cells\":160}"

const struct web_topic web_topics[] = {
    {"/sonar/echoes", "foxglove.PointCloud", cloud_schema, "image", "{}", make_echoes},
    {"/sonar/image", "foxglove.RawImage", image_schema, "image", "{}", make_image},
    {"/map/slice", "foxglove.Grid", grid_schema, "map_slice", SLICE, make_slice},
    {"/vehicle/pose", "foxglove.PoseInFrame", pose_schema, "map_slice", SLICE, make_pose},
    {"/tf", "foxglove.FrameTransform", transform_schema, "map_slice", SLICE, make_transform},
    {"/sonard/sectors", "sonard.sectors", any_schema, "sectors", "{}", make_same},
    {"/sonard/status", "sonard.status", any_schema, "status", "{}", make_same},
    {0},
};
