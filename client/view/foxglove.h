/* SPDX-License-Identifier: MIT */
/*
 * foxglove - the messages of Foxglove's schemas that are sent, with the names and numbers that these have at
 * docs.foxglove.dev/docs/visualization/message-schemas; fields that are never sent are left out.
 */
#ifndef SONARD_FOXGLOVE_H
#define SONARD_FOXGLOVE_H

#include "message.h"

extern const struct message_type foxglove_point_cloud, foxglove_compressed_image, foxglove_grid,
    foxglove_laser_scan, foxglove_scene_update, foxglove_pose_in_frame, foxglove_frame_transform, foxglove_log;

/* foxglove.NumericType, of the fields of a cloud or a grid. */
enum foxglove_numeric { FOXGLOVE_UINT8 = 1, FOXGLOVE_FLOAT32 = 7 };

/* Log.Level */
enum foxglove_level { FOXGLOVE_INFO = 2, FOXGLOVE_WARNING = 3 };

#endif
