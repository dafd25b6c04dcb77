/* SPDX-License-Identifier: MIT */
/*
 * capture - the tool for capture files: `sonarctl capture import|info|repair|export`. Needs no daemon.
 */
#ifndef SONARD_CAPTURE_H
#define SONARD_CAPTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

struct fault;
struct mcap_reader;
struct mcap_writer;

/**
 * capture_main - run `capture ...`; argv[0] is "capture". Exit status: 0 done, 1 failed or (info) damaged, 2 wrong
 * usage. Results go to standard output, sentences about faults to standard error.
 */
int capture_main(int argc, char **argv);

#define CAPTURE_SENSOR_MAX 31 /* characters of a sensor's name */

/** capture_failed - prints the sentence on standard error; 1, the exit status. */
__attribute__((format(printf, 1, 2))) int capture_failed(const char *fmt, ...);

/** capture_import - the command: the bytes of the recording as the channel /SENSOR/rx, with a configuration (NULL: one
 * for the device found). Its exit status, after a sentence. */
int capture_import(const char *in_path, const char *out_path, const char *sensor, const char *conf_path);

/** capture_info - what is in the capture `path`; 0, or 1 when it is damaged or unreadable. */
int capture_info(const char *path);

/**
 * capture_export - the capture `path` as comma-separated values, to `out_path` (a new file) or standard output.
 */
int capture_export(const char *path, const char *out_path);

/**
 * capture_add_pose - the capture `path` with the poses of the file `poses_path`, offset_s later than they say, as the
 * new file out_path. 0, or 1 after a message on standard error.
 */
int capture_add_pose(const char *path, const char *poses_path, const char *out_path, double offset_s);

/** capture_create - a new capture; message_bytes: its largest message, 0: the usual. NULL after a message. */
struct mcap_writer *capture_create(const char *path, size_t message_bytes);

/** capture_finish - closes it. ok false, with the fault set: what came before failed, and it is removed. 0, or 1. */
int capture_finish(struct mcap_writer *w, const char *path, bool ok, struct fault *fault);

/** capture_open - open for reading; damage is reported on standard error. NULL after a message there. */
struct mcap_reader *capture_open(const char *path);

/** capture_text - print text from a file; what is not printable ASCII as \xNN. */
void capture_text(FILE *out, const char *text);

#endif
