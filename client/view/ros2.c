/* SPDX-License-Identifier: MIT */
#include "ros2.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "bytes.h"

/* clang-format off */
#define FIELDS(...)           (const struct message_field[]){__VA_ARGS__ {.name = NULL}}
#define ONE(name_, kind_)     {.name = name_, .kind = kind_},
#define MANY(name_, kind_)    {.name = name_, .kind = kind_, .repeated = true},
#define PART(name_, of_)      {.name = name_, .kind = MESSAGE_OBJECT, .of = of_},
#define PARTS(name_, of_)     {.name = name_, .kind = MESSAGE_OBJECT, .of = of_, .repeated = true},

static const struct message_type stamp = {"builtin_interfaces/msg/Time", FIELDS(
    ONE("sec", MESSAGE_INT32)
    ONE("nanosec", MESSAGE_FIXED32))};

static const struct message_type header = {"std_msgs/msg/Header", FIELDS(
    PART("stamp", &stamp)
    ONE("frame_id", MESSAGE_TEXT))};

static const struct message_type point = {"geometry_msgs/msg/Point", FIELDS(
    ONE("x", MESSAGE_DOUBLE)
    ONE("y", MESSAGE_DOUBLE)
    ONE("z", MESSAGE_DOUBLE))};

static const struct message_type vector3 = {"geometry_msgs/msg/Vector3", FIELDS(
    ONE("x", MESSAGE_DOUBLE)
    ONE("y", MESSAGE_DOUBLE)
    ONE("z", MESSAGE_DOUBLE))};

static const struct message_type quaternion = {"geometry_msgs/msg/Quaternion", FIELDS(
    ONE("x", MESSAGE_DOUBLE)
    ONE("y", MESSAGE_DOUBLE)
    ONE("z", MESSAGE_DOUBLE)
    ONE("w", MESSAGE_DOUBLE))};

static const struct message_type pose = {"geometry_msgs/msg/Pose", FIELDS(
    PART("position", &point)
    PART("orientation", &quaternion))};

static const struct message_type pose_stamped = {"geometry_msgs/msg/PoseStamped", FIELDS(
    PART("header", &header)
    PART("pose", &pose))};

static const struct message_type transform = {"geometry_msgs/msg/Transform", FIELDS(
    PART("translation", &vector3)
    PART("rotation", &quaternion))};

static const struct message_type transform_stamped = {"geometry_msgs/msg/TransformStamped", FIELDS(
    PART("header", &header)
    ONE("child_frame_id", MESSAGE_TEXT)
    PART("transform", &transform))};

static const struct message_type transforms = {"tf2_msgs/msg/TFMessage", FIELDS(
    PARTS("transforms", &transform_stamped))};

static const struct message_type point_field = {"sensor_msgs/msg/PointField", FIELDS(
    ONE("name", MESSAGE_TEXT)
    ONE("offset", MESSAGE_FIXED32)
    ONE("datatype", MESSAGE_UINT8)
    ONE("count", MESSAGE_FIXED32))};

static const struct message_type point_cloud = {"sensor_msgs/msg/PointCloud2", FIELDS(
    PART("header", &header)
    ONE("height", MESSAGE_FIXED32)
    ONE("width", MESSAGE_FIXED32)
    PARTS("fields", &point_field)
    ONE("is_bigendian", MESSAGE_FLAG)
    ONE("point_step", MESSAGE_FIXED32)
    ONE("row_step", MESSAGE_FIXED32)
    ONE("data", MESSAGE_BYTES)
    ONE("is_dense", MESSAGE_FLAG))};

static const struct message_type laser_scan = {"sensor_msgs/msg/LaserScan", FIELDS(
    PART("header", &header)
    ONE("angle_min", MESSAGE_FLOAT)
    ONE("angle_max", MESSAGE_FLOAT)
    ONE("angle_increment", MESSAGE_FLOAT)
    ONE("time_increment", MESSAGE_FLOAT)
    ONE("scan_time", MESSAGE_FLOAT)
    ONE("range_min", MESSAGE_FLOAT)
    ONE("range_max", MESSAGE_FLOAT)
    MANY("ranges", MESSAGE_FLOAT)
    MANY("intensities", MESSAGE_FLOAT))};

static const struct message_type compressed_image = {"sensor_msgs/msg/CompressedImage", FIELDS(
    PART("header", &header)
    ONE("format", MESSAGE_TEXT)
    ONE("data", MESSAGE_BYTES))};

static const struct message_type map_meta_data = {"nav_msgs/msg/MapMetaData", FIELDS(
    PART("map_load_time", &stamp)
    ONE("resolution", MESSAGE_FLOAT)
    ONE("width", MESSAGE_FIXED32)
    ONE("height", MESSAGE_FIXED32)
    PART("origin", &pose))};

static const struct message_type occupancy_grid = {"nav_msgs/msg/OccupancyGrid", FIELDS(
    PART("header", &header)
    PART("info", &map_meta_data)
    ONE("data", MESSAGE_SIGNED_BYTES))};

static const struct message_type log_line = {"rcl_interfaces/msg/Log", FIELDS(
    PART("stamp", &stamp)
    ONE("level", MESSAGE_UINT8)
    ONE("name", MESSAGE_TEXT)
    ONE("msg", MESSAGE_TEXT)
    ONE("file", MESSAGE_TEXT)
    ONE("function", MESSAGE_TEXT)
    ONE("line", MESSAGE_FIXED32))};
/* clang-format on */

/* ---- conversion ---- */

static json_t *member(const json_t *message, const char *name)
{
    return json_object_get(message, name);
}

static json_t *stamp_of(const json_t *message)
{
    const json_t *t = member(message, "timestamp");
    return json_pack("{s:O, s:O}", "sec", member(t, "seconds"), "nanosec", member(t, "nanos"));
}

static json_t *header_of(const json_t *message, const char *frame)
{
    return json_pack("{s:o, s:O}", "stamp", stamp_of(message), "frame_id", member(message, frame));
}

#define FLOAT32 7 /* of sensor_msgs/PointField, as of Foxglove */

/* The numbers of sensor_msgs/PointField for those of Foxglove that are used. */
static int datatype(const json_t *foxglove)
{
    static const int types[] = {0, 2, 1, 4, 3, 6, 5, 7, 8};
    const json_int_t type = json_integer_value(foxglove);
    return type > 0 && type < (json_int_t)(sizeof types / sizeof *types) ? types[type] : 0;
}

static void add_field(json_t *fields, const char *name, json_int_t offset, int type)
{
    json_array_append_new(
        fields, json_pack("{s:s, s:I, s:i, s:i}", "name", name, "offset", offset, "datatype", type, "count", 1));
}

/* Points in a plane with a z of 0 behind each: readers of ROS want one. */
static json_t *with_z(const json_t *points, size_t stride)
{
    static const uint8_t zero[4];
    struct bytes out = {0};
    for (size_t at = 0; at + stride <= json_string_length(points); at += stride) {
        bytes_put(&out, json_string_value(points) + at, stride);
        bytes_put(&out, zero, sizeof zero);
    }
    json_t *data = out.failed ? NULL : json_stringn_nocheck(out.data ? (const char *)out.data : "", out.size);

    free(out.data);
    return data;
}

static json_t *to_cloud(const json_t *message)
{
    json_int_t step = json_integer_value(member(message, "point_stride"));
    json_t *fields = json_array(), *data = member(message, "data");
    const json_t *field;
    bool flat = true;
    size_t i;
    if (step <= 0 || !data) {
        json_decref(fields);
        return NULL;
    }
    json_array_foreach(member(message, "fields"), i, field)
    {
        const char *name = json_string_value(member(field, "name"));

        add_field(fields, name, json_integer_value(member(field, "offset")), datatype(member(field, "type")));
        flat = flat && strcmp(name, "z") != 0;
    }
    if (flat) {
        add_field(fields, "z", step, FLOAT32);
        data = with_z(data, (size_t)step);
        step += 4;
    } else {
        json_incref(data);
    }
    const json_int_t size = (json_int_t)json_string_length(data);

    return json_pack("{s:o, s:i, s:I, s:o, s:b, s:I, s:I, s:o, s:b}", "header", header_of(message, "frame_id"),
                     "height", 1, "width", size / step, "fields", fields, "is_bigendian", 0, "point_step", step,
                     "row_step", size, "data", data, "is_dense", 1);
}

/* Readers take infinity for free water up to the greatest range, so that is how far the sectors were judged. */
static json_t *to_scan(const json_t *message)
{
    const double first = json_number_value(member(message, "start_angle")),
                 last = json_number_value(member(message, "end_angle"));
    const size_t n = json_array_size(member(message, "judged"));
    return json_pack("{s:o, s:f, s:f, s:f, s:O, s:O}", "header", header_of(message, "frame_id"), "angle_min",
                     first, "angle_max", last, "angle_increment", n > 1 ? (last - first) / (double)(n - 1) : 0.0,
                     "range_max", member(message, "far_m"), "ranges", member(message, "judged"));
}

static json_t *to_image(const json_t *message)
{
    return json_pack("{s:o, s:O, s:O}", "header", header_of(message, "frame_id"), "format",
                     member(message, "format"), "data", member(message, "data"));
}

/* Per cent of being occupied; -1: unknown. */
static json_t *occupancy(const json_t *states)
{
    static const int8_t of[] = {-1, 0, 100};
    const size_t n = json_string_length(states);
    const uint8_t *state = (const uint8_t *)json_string_value(states);
    json_t *cells = NULL;
    char *data = malloc(n + 1);
    for (size_t i = 0; data && i < n; i++)
        data[i] = (char)of[state[i] < 3 ? state[i] : 0];
    if (data)
        cells = json_stringn_nocheck(data, n);
    free(data);
    return cells;
}

static json_t *to_grid(const json_t *message)
{
    const json_int_t columns = json_integer_value(member(message, "column_count"));
    const json_int_t cells = (json_int_t)json_string_length(member(message, "data"));
    return json_pack("{s:o, s:{s:o, s:O, s:I, s:I, s:O}, s:o}", "header", header_of(message, "frame_id"), "info",
                     "map_load_time", stamp_of(message), "resolution", member(member(message, "cell_size"), "x"),
                     "width", columns, "height", columns > 0 ? cells / columns : 0, "origin",
                     member(message, "pose"), "data", occupancy(member(message, "data")));
}

static json_t *to_pose(const json_t *message)
{
    return json_pack("{s:o, s:O}", "header", header_of(message, "frame_id"), "pose", member(message, "pose"));
}

static json_t *to_transforms(const json_t *message)
{
    return json_pack("{s:[{s:o, s:O, s:{s:O, s:O}}]}", "transforms", "header",
                     header_of(message, "parent_frame_id"), "child_frame_id", member(message, "child_frame_id"),
                     "transform", "translation", member(message, "translation"), "rotation",
                     member(message, "rotation"));
}

/* ROS counts levels in tens from DEBUG on, Foxglove in ones from UNKNOWN. */
static json_t *to_log(const json_t *message)
{
    return json_pack("{s:o, s:I, s:O, s:O}", "stamp", stamp_of(message), "level",
                     10 * json_integer_value(member(message, "level")), "name", member(message, "name"), "msg",
                     member(message, "message"));
}

static const struct ros2_topic topics[] = {
    {"/sonar/ping", &point_cloud, to_cloud},       {"/sonar/echoes", &point_cloud, to_cloud},
    {"/sonar/image", &compressed_image, to_image}, {"/map/slice", &occupancy_grid, to_grid},
    {"/vehicle/pose", &pose_stamped, to_pose},     {"/tf", &transforms, to_transforms},
    {"/sonard/scan", &laser_scan, to_scan},        {"/sonard/log", &log_line, to_log},
};

const struct ros2_topic *ros2_topic(const char *topic)
{
    for (size_t i = 0; i < sizeof topics / sizeof *topics; i++)
        if (strcmp(topics[i].topic, topic) == 0)
            return &topics[i];
    return NULL;
}
