/* SPDX-License-Identifier: MIT */
/*
 * mavlink_feed - the daemon's side of the bridge: keeps a connection with watches on what the autopilot is to hear,
 * holds the newest answers, and hands poses over. Never waits for the daemon. Knows no MAVLink link. Times are
 * CLOCK_MONOTONIC nanoseconds.
 */
#ifndef SONARD_MAVLINK_FEED_H
#define SONARD_MAVLINK_FEED_H

#include <stdbool.h>
#include <stdint.h>

#include "mavlink_obstacles.h"
#include "mavlink_vehicle.h"
#include "client/lib/sonard_json.h"

#define MAVLINK_LAYERS      5 /* of 30 degrees of elevation each, as receivers keep 3D points */
#define MAVLINK_SENSORS_MAX 8

enum mavlink_watch {
    MAVLINK_WATCH_LEVEL, /* the ring at elevation 0 */
    MAVLINK_WATCH_LOWEST,
    MAVLINK_WATCH_LOW,
    MAVLINK_WATCH_HIGH,
    MAVLINK_WATCH_HIGHEST,
    MAVLINK_WATCH_STATUS,
    MAVLINK_WATCH_DOWNWARD,
    MAVLINK_WATCHES,
};

struct mavlink_feed_conf {
    const char *socket;
    double rate_hz;       /* of sectors and of the downward sonar; status comes more slowly */
    bool layers;          /* watch all five layers; otherwise the level one, 10 degrees high */
    bool north;           /* azimuth 0 is north */
    double distance_m;    /* how far to look; 0: as far as the sonars listen */
    const char *downward; /* name of a sonar that looks down; NULL: none */
};

struct mavlink_sensor {
    char name[32], state[32];
    double range_m;
    uint64_t ping_ns; /* of the newest; 0: none */
    bool deaf;        /* its pings do not show that its receiver hears */
};

/* What the downward sonar said last. */
struct mavlink_depth_below {
    uint64_t t_ns; /* 0: nothing yet */
    bool echo;     /* otherwise it received none */
    double range_m, width_rad;
    double blind_m; /* nearer than this it hears nothing */
};

#define MAVLINK_DRIFT_TEXT 240

struct mavlink_feed {
    struct mavlink_feed_conf conf;
    struct sonard_client *client; /* NULL: not connected */
    struct sonard_error error;    /* why the connection failed */
    uint64_t retry_ns, connected_ns;
    uint64_t heard_ns;                /* when the daemon said something, or was connected to */
    bool said_something;              /* since then */
    int64_t request[MAVLINK_WATCHES]; /* that asked for it; 0: not asked */
    int64_t watch[MAVLINK_WATCHES];   /* the daemon's number; -1: not watched */
    /* CLOCK_REALTIME minus CLOCK_MONOTONIC now, set by the owner: the calendar may be set */
    uint64_t unix_offset_ns;
    bool replay; /* the daemon plays a capture */
    struct mavlink_ring ring[MAVLINK_LAYERS];
    uint64_t level_ns;    /* when ring[MAVLINK_WATCH_LEVEL] came; 0: never */
    uint64_t evidence_ns; /* of the newest evidence in any ring; never falls */
    struct mavlink_sensor sensor[MAVLINK_SENSORS_MAX];
    int n_sensors;
    bool posed;        /* the daemon was given a pose at least once */
    double pose_age_s; /* when posed */
    /* how far a vehicle without a position may drift, and what to set, while no bound of its speed counts; or empty */
    char drift[MAVLINK_DRIFT_TEXT];
    bool wet;         /* the leak probe says so */
    json_int_t leaks; /* times that it became wet, by the daemon's reports */
    uint64_t leak_ns; /* when that grew last; 0: never */
    struct mavlink_depth_below below;
    struct sonard_error below_refused;         /* why there is none: no such sonar; all zeros: not refused */
    int64_t no_bound_id;                       /* of the request that told why there is no bound; 0: answered */
    int poses_waiting;                         /* handed over, and not answered yet */
    uint64_t poses, poses_refused, poses_held; /* held: kept back, since the daemon does not answer */
};

extern const double mavlink_layer_deg[MAVLINK_LAYERS]; /* elevation of each ring's middle */

void mavlink_feed_init(struct mavlink_feed *feed, const struct mavlink_feed_conf *conf);

/** mavlink_feed_connect - where there is no connection, try to make one and ask for the watches, once a second. */
void mavlink_feed_connect(struct mavlink_feed *feed, uint64_t now_ns);

/**
 * mavlink_feed_read - take what the daemon has sent. When the connection ends, or nothing came for five seconds, it is
 * closed, all rings are forgotten and error says why.
 */
void mavlink_feed_read(struct mavlink_feed *feed, uint64_t now_ns);

/** mavlink_feed_pose - hand a pose over; refusals, and those kept back from a daemon that is behind, are counted. */
void mavlink_feed_pose(struct mavlink_feed *feed, const struct mavlink_pose *pose, uint64_t now_ns);

/** mavlink_feed_no_bound - tell why there is no bound of the vehicle's speed: a word of no_speed_bound. */
void mavlink_feed_no_bound(struct mavlink_feed *feed, const char *word, uint64_t now_ns);

/** mavlink_feed_alive - did the daemon say anything within a second and a half? */
bool mavlink_feed_alive(const struct mavlink_feed *feed, uint64_t now_ns);

/** mavlink_feed_answered - is there an answer about the level ring that is at most a second old? */
bool mavlink_feed_answered(const struct mavlink_feed *feed, uint64_t now_ns);

/**
 * mavlink_feed_fresh - do the rings rest on a sonar that is alive: a ping within two seconds, and evidence that counts
 * in an answer of the last second?
 */
bool mavlink_feed_fresh(const struct mavlink_feed *feed, uint64_t now_ns);

/** mavlink_feed_reach_m - how far a clear sector is known to be clear; 0 while not known. */
double mavlink_feed_reach_m(const struct mavlink_feed *feed);

void mavlink_feed_close(struct mavlink_feed *feed);

#endif
