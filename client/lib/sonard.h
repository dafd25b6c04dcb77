/* SPDX-License-Identifier: MIT */
/*
 * sonard.h - libsonard: ask a running sonard which water is free. See libsonard(3).
 *
 * Two ways of use. Waiting: sonard_call, sonard_next and the typed questions, each with a timeout. In a loop of one's
 * own, which never waits: sonard_connect with timeout 0, poll sonard_fd for sonard_events, sonard_send to ask,
 * sonard_take with timeout 0 for whatever came. The library has no thread, no globals and no signal handler; a client
 * belongs to one thread at a time.
 *
 * Methods, parameters and results are those of sonard-protocol(7), as JSON text. SI units; angles are degrees.
 */
#ifndef SONARD_H
#define SONARD_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define SONARD_DEFAULT_SOCKET "/run/sonard/sonard.sock"

enum sonard_status {
    SONARD_OK,
    SONARD_NO_DAEMON,     /* nobody listens at the path */
    SONARD_NO_PERMISSION, /* the socket is there, this user may not use it */
    SONARD_SILENT,        /* no answer within the timeout */
    SONARD_LOST,          /* the connection ended, or what came was no answer */
    SONARD_REFUSED,       /* the daemon answered with an error: rpc_code */
    SONARD_INVALID,       /* what was asked cannot be said: nothing was sent */
};

struct sonard_error {
    enum sonard_status status;
    int rpc_code;      /* SONARD_REFUSED only */
    char message[768]; /* one sentence */
};

struct sonard_client;

/* What the daemon said. */
struct sonard_message {
    int64_t id;       /* of the request that it answers; 0: of a watch, or an error about no request */
    int64_t watch;    /* the watch that it is of; 0: none */
    int64_t skipped;  /* answers of this watch that were left out before, because they were not read in time */
    const char *json; /* the result, until the next call with this client; NULL: refused */
    struct sonard_error refusal; /* SONARD_REFUSED when refused, otherwise all zeros */
};

/* ---- connection ---- */

/**
 * sonard_connect - to the socket at `path`; NULL: $SONARD_SOCKET, else SONARD_DEFAULT_SOCKET. NULL with *error set.
 * timeout_s holds for every later call that waits; 0: connect at once or not at all (SONARD_SILENT: the daemon takes no
 * new clients now). After SONARD_SILENT the connection may be used again; after SONARD_LOST make a new one.
 */
struct sonard_client *sonard_connect(const char *path, double timeout_s, struct sonard_error *error);

/** sonard_disconnect - ends every watch; NULL is fine. */
void sonard_disconnect(struct sonard_client *client);

/** sonard_fd - to poll for sonard_events; when ready, sonard_take with timeout_s 0 until it says SONARD_SILENT. */
int sonard_fd(const struct sonard_client *client);

/** sonard_events - POLLIN, and POLLOUT while requests wait to be written. */
short sonard_events(const struct sonard_client *client);

/* ---- any method ---- */

/**
 * sonard_call - call `method` with params, the text of a JSON object (NULL: none). The result as JSON text until the
 * next call with this client, or NULL with *error set. What watches say meanwhile is kept for sonard_next, the newest
 * 64; replies to sonard_send are thrown away.
 */
const char *sonard_call(struct sonard_client *client, const char *method, const char *params,
                        struct sonard_error *error);

/**
 * sonard_watch - have the daemon ask `method` by itself rate_hz times a second (0.1 to 50). The watch's number, or 0
 * with *error set.
 */
int64_t sonard_watch(struct sonard_client *client, const char *method, const char *params, double rate_hz,
                     struct sonard_error *error);

/** sonard_next - what a watch says next, waiting at most timeout_s (0: only what is there). False with *error set;
 * SONARD_SILENT: nothing came. */
bool sonard_next(struct sonard_client *client, double timeout_s, struct sonard_message *out,
                 struct sonard_error *error);

/**
 * sonard_send - ask without waiting: the number of the request, or 0 with *error set. What the daemon does not read at
 * once waits, up to 64 KiB; then SONARD_SILENT. params as in sonard_call.
 */
int64_t sonard_send(struct sonard_client *client, const char *method, const char *params,
                    struct sonard_error *error);

/**
 * sonard_take - the next message of any kind, waiting at most timeout_s (0: only what is there); writes what waits,
 * too. False with *error set; SONARD_SILENT: none came.
 */
bool sonard_take(struct sonard_client *client, double timeout_s, struct sonard_message *out,
                 struct sonard_error *error);

/* ---- what an autopilot asks ----
 *
 * Each waits for its answer. False with *error set; *out then says SONARD_UNKNOWN, or a speed of 0. A number that the
 * daemon does not know is NaN. sonard_read_... make the same of the JSON text of a result, from a watch or
 * sonard_take; false: it is none.
 */

/* Zero is unknown: what was never filled in is not clear. */
enum sonard_state { SONARD_UNKNOWN, SONARD_BLOCKED, SONARD_CLEAR };

enum sonard_frame { SONARD_BODY, SONARD_NED }; /* forward, right, down; or north, east, down */

#define SONARD_REASON_SIZE 256

#define SONARD_TARGET_SIZE 160

/*
 * What free and clear water is free of. Weaker obstacles and softer bottoms may be there: mud is no wall.
 */
struct sonard_target {
    char name[SONARD_TARGET_SIZE]; /* "wall", "20 dB below a wall"; empty: not told */
    double bottom_db;              /* the softest bottom, in dB below a wall; NaN: soft bottoms may be there */
};

struct sonard_blocked {
    enum sonard_state state;
    double range_m, range_sd_m; /* of the nearest obstacle; NaN unless blocked */
    double confidence;          /* 0 to 1 */
    double free_to_m;           /* the water is known to be free up to here */
    double blind_to_m;          /* nothing is known nearer than this */
    double age_s;               /* of the oldest evidence that counts; NaN: none */
    char reason[SONARD_REASON_SIZE];
    struct sonard_target target;
};

/* Water around a direction, from the vehicle to a distance. */
struct sonard_cone {
    double azimuth_deg, elevation_deg; /* of its axis, in the frame asked in */
    double half_angle_deg;             /* it opens so far to each side */
    double distance_m;
};

/** sonard_blocked - is the water of a cone free? */
bool sonard_blocked(struct sonard_client *client, enum sonard_frame frame, const struct sonard_cone *cone,
                    struct sonard_blocked *out, struct sonard_error *error);
bool sonard_read_blocked(const char *json, struct sonard_blocked *out);

#define SONARD_SECTORS_MAX 720

struct sonard_sector {
    enum sonard_state state;
    double azimuth_deg, width_deg; /* middle, clockwise from forward or north */
    double range_m;                /* of the nearest obstacle, at any distance; NaN: none */
    double free_to_m;
    double blind_to_m; /* nothing is known nearer than this: free and clear are so from here on */
    double age_s;      /* NaN: never looked at */
};

struct sonard_sectors {
    enum sonard_frame frame;
    double t_unix;
    double pose_age_s; /* NaN: no pose was given */
    /* nearer water is the vehicle's own; where blind_to_m is beyond it, the first water is unknown */
    double near_m;
    struct sonard_target target;
    int count; /* 0 when there is no answer */
    struct sonard_sector sector[SONARD_SECTORS_MAX];
};

/** sonard_sectors - the state all around in 1 to 720 sectors; distance_m 0: as far as the sonars hear. */
bool sonard_sectors(struct sonard_client *client, enum sonard_frame frame, int count, double distance_m,
                    struct sonard_sectors *out, struct sonard_error *error);
bool sonard_read_sectors(const char *json, struct sonard_sectors *out);

struct sonard_limit {
    double velocity_mps[3]; /* that may be flown, in the axes of the one asked for */
    double speed_mps;
    enum sonard_state limited_by; /* SONARD_CLEAR: nothing; else an obstacle or unknown water */
    double stop_m;                /* way that it takes to stand */
    double blocked_m;             /* to the obstacle; NaN: none */
    double free_m;                /* known to be free in front of the body and its margin */
    double age_s;                 /* of the oldest ping that counts; NaN: none */
    char reason[SONARD_REASON_SIZE];
    struct sonard_target target;
};

/** sonard_limit - the velocity made so short that the vehicle can still stop in water known to be free. */
bool sonard_limit(struct sonard_client *client, enum sonard_frame frame, const double velocity_mps[3],
                  struct sonard_limit *out, struct sonard_error *error);
bool sonard_read_limit(const char *json, struct sonard_limit *out);

struct sonard_collision {
    enum sonard_state state;       /* SONARD_CLEAR: as far as looked ahead */
    double time_s, time_sd_s;      /* until the earliest meeting; NaN unless blocked */
    double distance_m, confidence; /* NaN unless blocked */
    double unknown_after_s;        /* the corridor is unknown from then on; NaN: it is not */
    double age_s;
    char reason[SONARD_REASON_SIZE];
    struct sonard_target target;
};

/**
 * sonard_time_to_collision - when the body meets something at that velocity (NULL: that of the pose), as far as ahead_s
 * (0.1 to 3600).
 */
bool sonard_time_to_collision(struct sonard_client *client, enum sonard_frame frame, const double *velocity_mps,
                              double ahead_s, struct sonard_collision *out, struct sonard_error *error);
bool sonard_read_collision(const char *json, struct sonard_collision *out);

enum sonard_pose_part {
    SONARD_POSE_QUATERNION = 1,
    SONARD_POSE_POSITION = 2,
    SONARD_POSE_DEPTH = 4,
    SONARD_POSE_VELOCITY = 8,
    SONARD_POSE_TIME = 16,
    SONARD_POSE_ALTITUDE = 32,
    SONARD_POSE_SPEED_BOUND = 64,
    SONARD_POSE_PUSH = 128,
};

struct sonard_pose {
    unsigned has;           /* sonard_pose_part of what is given */
    double quaternion[4];   /* w, x, y, z: body to north-east-down */
    double position_m[3];   /* north, east, down */
    double depth_m;         /* below the surface */
    double velocity_mps[3]; /* north, east, down */
    double t_unix;          /* of the measurement; not given: now */
    double altitude_m;      /* above the bottom, straight down */
    double
        speed_bound_mps[2]; /* the most it has gone through the water since the bound before: level, up or down */
    double push_n[2];       /* which way the thrusters push, forward and to the right: guides where a head looks */
};

/** sonard_pose - tell where the vehicle is; waits for the daemon's word. */
bool sonard_pose(struct sonard_client *client, const struct sonard_pose *pose, struct sonard_error *error);

/** sonard_send_pose - as sonard_send: does not wait; the number of the request. */
int64_t sonard_send_pose(struct sonard_client *client, const struct sonard_pose *pose, struct sonard_error *error);

#ifdef __cplusplus
}
#endif

#endif
