/* SPDX-License-Identifier: MIT */
/*
 * daemon_here - for tests of the MAVLink bridge: a daemon's socket in the test's own thread, which answers what the
 * test wants when it wants. The calendar says T_UNIX when the monotonic clock says START.
 */
#ifndef SONARD_TEST_DAEMON_HERE_H
#define SONARD_TEST_DAEMON_HERE_H

#include <math.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "client/mavlink/mavlink_feed.h"
#include "tests/lib/test.h"

#define MS     1000000ull
#define S      1000000000ull
#define START  (1000 * S)
#define T_UNIX 1.7e9 /* the calendar at START */
#define OFFSET (1700000000 * S - START)

static char directory[] = "/tmp/sonard-test-XXXXXX";
static char path[64];

static inline bool make_directory(void)
{
    const bool good = mkdtemp(directory) != NULL;
    snprintf(path, sizeof path, "%s/sonard.sock", directory);
    return good;
}

struct daemon_here {
    int listener, fd;
    json_int_t watches, leaks;
    double pose_unix;  /* t_unix of the last pose */
    double rolled;     /* the most that a pose was, by its quaternion's x */
    int clear;         /* so many sectors, the last ones */
    char no_bound[16]; /* why there is none, as told last */
    int bounds;        /* of its speed; the last one: */
    double bound_mps;
    int pushes; /* told with them */
    bool wet, replay;
    const char *drift; /* as status has it; NULL: none */
    bool bounded;
    int status_watch; /* what the client counts as its watch of status */
};

static void listen_here(struct daemon_here *d)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    *d = (struct daemon_here){.fd = -1, .status_watch = 2};
    snprintf(address.sun_path, sizeof address.sun_path, "%s", path);
    d->listener = socket(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0);
    CHECK(bind(d->listener, (struct sockaddr *)&address, sizeof address) == 0 && listen(d->listener, 1) == 0);
}

static void leave_here(struct daemon_here *d)
{
    if (d->fd >= 0)
        close(d->fd);
    close(d->listener);
    unlink(path);
}

static void say(const struct daemon_here *d, json_t *message)
{
    char *text = json_dumps(message, JSON_COMPACT);
    CHECK(write(d->fd, text, strlen(text)) == (ssize_t)strlen(text) && write(d->fd, "\n", 1) == 1);
    free(text);
    json_decref(message);
}

/* Reads what was asked and agrees to all of it; returns how many poses were among it. */
static int agree(struct daemon_here *d)
{
    static char asked[65536];
    int poses = 0;
    if (d->fd < 0)
        d->fd = accept4(d->listener, NULL, NULL, SOCK_NONBLOCK);
    const ssize_t n = read(d->fd, asked, sizeof asked - 1);
    asked[n > 0 ? n : 0] = '\0';
    for (char *line = strtok(asked, "\n"); line; line = strtok(NULL, "\n")) {
        json_t *request = json_loads(line, 0, NULL);
        const bool pose = strcmp(json_string_value(json_object_get(request, "method")), "pose") == 0;
        json_t *result =
            pose ? json_pack("{s:b}", "taken", 1) : json_pack("{s:I}", "watch", (json_int_t)++d->watches);

        const json_t *params = json_object_get(request, "params");
        const json_t *bound = json_object_get(params, "speed_bound_mps");
        if (pose && json_object_get(params, "no_speed_bound")) {
            snprintf(d->no_bound, sizeof d->no_bound, "%s",
                     json_string_value(json_object_get(params, "no_speed_bound")));
        } else if (bound) {
            d->bounds++;
            d->bound_mps = json_number_value(json_array_get(bound, 0));
            d->pushes += json_array_size(json_object_get(params, "push_n")) == 2;
        } else if (pose) {
            poses++;
            const json_t *x = json_array_get(json_object_get(params, "quaternion"), 1);
            d->pose_unix = json_number_value(json_object_get(params, "t_unix"));
            d->rolled = fmax(d->rolled, fabs(json_number_value(x)));
        }
        say(d, json_pack("{s:o, s:O}", "result", result, "id", json_object_get(request, "id")));
        json_decref(request);
    }
    return poses;
}

static void notify(const struct daemon_here *d, int watch, json_t *result)
{
    say(d, json_pack("{s:s, s:{s:i, s:o}}", "method", "watch", "params", "watch", watch, "result", result));
}

/* Blocked at range_m but for d->clear sectors, seen age_s ago; the daemon's clock says at_s after START. */
static void say_sectors(const struct daemon_here *d, double range_m, double age_s, double at_s)
{
    json_t *sectors = json_array();
    for (int i = 0; i < MAVLINK_SECTORS; i++) {
        const bool clear = i >= MAVLINK_SECTORS - d->clear;
        json_array_append_new(sectors, json_pack("{s:s, s:o, s:f, s:f, s:f}", "state", clear ? "clear" : "blocked",
                                                 "range_m", clear ? json_null() : json_real(range_m), "free_to_m",
                                                 clear ? 10.0 : 0.0, "blind_to_m", 0.0, "age_s", age_s));
    }
    notify(d, 1, json_pack("{s:f, s:o}", "t_unix", T_UNIX + at_s, "sectors", sectors));
}

/* To the third watch an echosounder's row: its ping is age_s old; echo_m 0: it heard nothing, negative: it is blind. */
static inline void say_below(const struct daemon_here *d, double echo_m, double age_s, double at_s)
{
    notify(d, 3,
           json_pack("{s:f, s:[{s:s, s:f, s:o, s:f, s:f}]}", "t_unix", T_UNIX + at_s, "rows", "state",
                     echo_m > 0    ? "echo"
                     : echo_m == 0 ? "silent"
                                   : "blind",
                     "age_s", age_s, "echo_m", echo_m > 0 ? json_real(echo_m) : json_null(), "width_deg", 30.0,
                     "blind_m", 0.5));
}

/* ping_age_s: negative: there was none. */
static void say_status(const struct daemon_here *d, double ping_age_s, double at_s)
{
    notify(d, d->status_watch,
           json_pack("{s:f, s:s, s:[{s:s, s:s, s:f, s:o}], s:{s:n, s:s, s:{s:s}}, s:{s:s, s:I}}", "t_unix",
                     T_UNIX + at_s, "mode", d->replay ? "replay, ended" : "live", "sensors", "name", "head",
                     "state", "running", "range_m", 10.0, "last_ping_age_s",
                     ping_age_s < 0 ? json_null() : json_real(ping_age_s), "pose", "age_s", "drift",
                     d->drift ? d->drift : "", "speed_bound", "state", d->bounded ? "used" : "not used", "leak",
                     "state", d->wet ? "wet" : "dry", "alarms", d->leaks));
}

#endif
