/* SPDX-License-Identifier: MIT */
#include "foxglove.h"

#include <stddef.h>

/* clang-format off */
#define FIELDS(...)             (const struct message_field[]){__VA_ARGS__ {.name = NULL}}
#define ONE(name_, n, kind_)    {.name = name_, .number = n, .kind = kind_},
#define MANY(name_, n, kind_)   {.name = name_, .number = n, .kind = kind_, .repeated = true},
#define PART(name_, n, of_)     {.name = name_, .number = n, .kind = MESSAGE_OBJECT, .of = of_},
#define PARTS(name_, n, of_)    {.name = name_, .number = n, .kind = MESSAGE_OBJECT, .of = of_, .repeated = true},
#define WORDS(name_, n, words_) {.name = name_, .number = n, .kind = MESSAGE_WORD, .words = words_},

static const struct message_type timestamp = {"google.protobuf.Timestamp", FIELDS(
    ONE("seconds", 1, MESSAGE_INT64)
    ONE("nanos", 2, MESSAGE_INT32))};

static const struct message_type duration = {"google.protobuf.Duration", FIELDS(
    ONE("seconds", 1, MESSAGE_INT64)
    ONE("nanos", 2, MESSAGE_INT32))};

static const struct message_type vector2 = {"foxglove.Vector2", FIELDS(
    ONE("x", 1, MESSAGE_DOUBLE)
    ONE("y", 2, MESSAGE_DOUBLE))};

static const struct message_type vector3 = {"foxglove.Vector3", FIELDS(
    ONE("x", 1, MESSAGE_DOUBLE)
    ONE("y", 2, MESSAGE_DOUBLE)
    ONE("z", 3, MESSAGE_DOUBLE))};

static const struct message_type point3 = {"foxglove.Point3", FIELDS(
    ONE("x", 1, MESSAGE_DOUBLE)
    ONE("y", 2, MESSAGE_DOUBLE)
    ONE("z", 3, MESSAGE_DOUBLE))};

static const struct message_type quaternion = {"foxglove.Quaternion", FIELDS(
    ONE("x", 1, MESSAGE_DOUBLE)
    ONE("y", 2, MESSAGE_DOUBLE)
    ONE("z", 3, MESSAGE_DOUBLE)
    ONE("w", 4, MESSAGE_DOUBLE))};

static const struct message_type pose = {"foxglove.Pose", FIELDS(
    PART("position", 1, &vector3)
    PART("orientation", 2, &quaternion))};

static const struct message_type color = {"foxglove.Color", FIELDS(
    ONE("r", 1, MESSAGE_DOUBLE)
    ONE("g", 2, MESSAGE_DOUBLE)
    ONE("b", 3, MESSAGE_DOUBLE)
    ONE("a", 4, MESSAGE_DOUBLE))};

static const struct message_type packed_field = {"foxglove.PackedElementField", FIELDS(
    ONE("name", 1, MESSAGE_TEXT)
    ONE("offset", 2, MESSAGE_FIXED32)
    WORDS("type", 3, "NumericType: UNKNOWN UINT8 INT8 UINT16 INT16 UINT32 INT32 FLOAT32 FLOAT64"))};

const struct message_type foxglove_point_cloud = {"foxglove.PointCloud", FIELDS(
    PART("timestamp", 1, &timestamp)
    ONE("frame_id", 2, MESSAGE_TEXT)
    PART("pose", 3, &pose)
    ONE("point_stride", 4, MESSAGE_FIXED32)
    PARTS("fields", 5, &packed_field)
    ONE("data", 6, MESSAGE_BYTES))};

const struct message_type foxglove_compressed_image = {"foxglove.CompressedImage", FIELDS(
    PART("timestamp", 1, &timestamp)
    ONE("data", 2, MESSAGE_BYTES)
    ONE("format", 3, MESSAGE_TEXT)
    ONE("frame_id", 4, MESSAGE_TEXT))};

const struct message_type foxglove_grid = {"foxglove.Grid", FIELDS(
    PART("timestamp", 1, &timestamp)
    ONE("frame_id", 2, MESSAGE_TEXT)
    PART("pose", 3, &pose)
    ONE("column_count", 4, MESSAGE_FIXED32)
    PART("cell_size", 5, &vector2)
    ONE("row_stride", 6, MESSAGE_FIXED32)
    ONE("cell_stride", 7, MESSAGE_FIXED32)
    PARTS("fields", 8, &packed_field)
    ONE("data", 9, MESSAGE_BYTES))};

const struct message_type foxglove_laser_scan = {"foxglove.LaserScan", FIELDS(
    PART("timestamp", 1, &timestamp)
    ONE("frame_id", 2, MESSAGE_TEXT)
    PART("pose", 3, &pose)
    ONE("start_angle", 4, MESSAGE_DOUBLE)
    ONE("end_angle", 5, MESSAGE_DOUBLE)
    MANY("ranges", 6, MESSAGE_DOUBLE)
    MANY("intensities", 7, MESSAGE_DOUBLE))};

static const struct message_type triangles = {"foxglove.TriangleListPrimitive", FIELDS(
    PART("pose", 1, &pose)
    PARTS("points", 2, &point3)
    PART("color", 3, &color)
    MANY("indices", 5, MESSAGE_FIXED32))};

static const struct message_type entity = {"foxglove.SceneEntity", FIELDS(
    PART("timestamp", 1, &timestamp)
    ONE("frame_id", 2, MESSAGE_TEXT)
    ONE("id", 3, MESSAGE_TEXT)
    PART("lifetime", 4, &duration)
    ONE("frame_locked", 5, MESSAGE_FLAG)
    PARTS("triangles", 12, &triangles))};

const struct message_type foxglove_scene_update = {"foxglove.SceneUpdate", FIELDS(
    PARTS("entities", 2, &entity))};

const struct message_type foxglove_pose_in_frame = {"foxglove.PoseInFrame", FIELDS(
    PART("timestamp", 1, &timestamp)
    ONE("frame_id", 2, MESSAGE_TEXT)
    PART("pose", 3, &pose))};

const struct message_type foxglove_frame_transform = {"foxglove.FrameTransform", FIELDS(
    PART("timestamp", 1, &timestamp)
    ONE("parent_frame_id", 2, MESSAGE_TEXT)
    ONE("child_frame_id", 3, MESSAGE_TEXT)
    PART("translation", 4, &vector3)
    PART("rotation", 5, &quaternion))};

const struct message_type foxglove_log = {"foxglove.Log", FIELDS(
    PART("timestamp", 1, &timestamp)
    WORDS("level", 2, "Level: UNKNOWN DEBUG INFO WARNING ERROR FATAL")
    ONE("message", 3, MESSAGE_TEXT)
    ONE("name", 4, MESSAGE_TEXT))};
