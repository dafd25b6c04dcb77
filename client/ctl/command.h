/* SPDX-License-Identifier: MIT */
/*
 * command - what the commands of sonarctl share: what they run with, how they ask the daemon, print and end. Knows no
 * command; sonarctl.c has the table of them.
 */
#ifndef SONARD_COMMAND_H
#define SONARD_COMMAND_H

#include <jansson.h>
#include <stdbool.h>

#include "client/arguments.h"
#include "client/lib/sonard.h"

enum exit_status {
    EXIT_CLEAR = 0, /* and of everything else that went well */
    EXIT_BLOCKED = 1,
    EXIT_UNKNOWN = 2,
    EXIT_USAGE = 3,
    EXIT_NO_DAEMON = 4,
    EXIT_SILENT = 5,
    EXIT_REFUSED = 6,
    EXIT_OUTPUT = 7, /* the result could not be written */
};

struct command;

/* What a command runs with. */
struct context {
    const char *command;            /* its name */
    const struct command *commands; /* all of them, for the completion */
    struct arguments arguments;     /* its words; its options are the parameters of its method */
    struct sonard_client *client;   /* NULL until the first call */
    char socket[4096];              /* longer than any that works, so that its length is reported as it is */
    double timeout_s;
    bool json, colour;
};

/** command_fail - tells what went wrong with the daemon; returns the exit status. */
int command_fail(const struct sonard_error *error);

/** command_usage - tells what is wrong with the command line of a command (NULL: none); returns EXIT_USAGE. */
int command_usage(const char *command, const char *message);

/** command_azimuth - word `index` of the command line as AZ, degrees. False: it is none, and that is told. */
bool command_azimuth(const struct context *context, int index, double *azimuth_deg);

/** command_refuses_picture - pictures are SVG: true, with a message of usage, where the file's name (NULL: none) is
 * that of another kind, which no viewer would open. */
bool command_refuses_picture(const struct context *context, const char *path);

/** command_print - a result, as JSON or as a person reads it. */
void command_print(const struct context *context, const char *method, const json_t *result);

/** command_call - connects at the first call: faults of usage need no daemon. NULL: *status is what to exit
 * with, and a message was printed. */
json_t *command_call(struct context *context, const char *method, json_t *params, int *status);

/** command_call_and_print - both; the exit status. */
int command_call_and_print(struct context *context, const char *method, json_t *params);

/** command_write_plot - as SVG into a file, - for standard output. sectors NULL: image is a background template.
 * range_m: of the rim; 0: as far as the image reaches. heading_deg: see plot.h. */
int command_write_plot(const char *path, json_t *image, json_t *sectors, double range_m,
                       const double *heading_deg);

/* The commands: each is given its own words and options and returns the exit status. */

/* command_ask.c: what is asked of the daemon */
int command_method(struct context *context); /* the method of the command's name */
int command_blocked(struct context *context);
int command_explain(struct context *context);
int command_limit(struct context *context);
int command_version(struct context *context);
int command_call_any(struct context *context);
int command_watch(struct context *context);
int command_stats(struct context *context);
int command_pose(struct context *context);
int command_plot(struct context *context);
int command_record(struct context *context);

/* command_grid_export.c: every cell of the grid that the options name, into a file */
int command_grid_export(struct context *context, const char *path);

/* command_background.c, command_grid.c, command_map.c */
int command_background(struct context *context);
int command_grid(struct context *context);
int command_place(struct context *context); /* point, box and path */
int command_map(struct context *context);

/* command_top.c */
int command_top(struct context *context);

/* command_setup.c */
int command_setup(struct context *context);

/* command_complete.c: for the shells */
int command_complete(struct context *context);

#endif
