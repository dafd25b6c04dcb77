/* SPDX-License-Identifier: MIT */
/*
 * capture - the tool for capture files: `sonarctl capture import|info|repair|export`. Needs no daemon.
 */
#ifndef SONARD_CAPTURE_H
#define SONARD_CAPTURE_H

#include <stdio.h>

struct mcap_reader;

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

/** capture_open - open for reading; damage is told on standard error. NULL, which is told too. */
struct mcap_reader *capture_open(const char *path);

/** capture_text - print text from a file; what is not printable ASCII as \xNN. */
void capture_text(FILE *out, const char *text);

#endif
