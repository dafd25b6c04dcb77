/* SPDX-License-Identifier: MIT */
/*
 * capture - the tool for capture files: `sonarctl capture import|info|repair|export`. Needs no daemon.
 */
#ifndef SONARD_CAPTURE_H
#define SONARD_CAPTURE_H

/**
 * capture_main - run `capture ...`; argv[0] is "capture". Exit status: 0 done, 1 failed or (info) damaged, 2 wrong
 * usage. Results go to standard output, sentences about faults to standard error.
 */
int capture_main(int argc, char **argv);

/** capture_info - what is in the capture `path`; 0, or 1 when it is damaged or unreadable. */
int capture_info(const char *path);

/**
 * capture_export - the capture `path` as comma-separated values, to `out_path` (a new file) or standard output.
 */
int capture_export(const char *path, const char *out_path);

enum capture_view_form { CAPTURE_VIEW_FOXGLOVE, CAPTURE_VIEW_ROS2 };

/**
 * capture_export_view - what viewers are shown of the capture `path`, as the new file out_path, for Foxglove or ROS 2.
 * conf: a configuration; NULL: the capture's own.
 */
int capture_export_view(const char *path, const char *out_path, enum capture_view_form form, const char *conf);

/**
 * capture_add_pose - the capture `path` with the poses of the file `poses_path`, offset_s later than they say, as the
 * new file out_path. 0, or 1 after a message on standard error.
 */
int capture_add_pose(const char *path, const char *poses_path, const char *out_path, double offset_s);

#endif
