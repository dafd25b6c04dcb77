/* SPDX-License-Identifier: MIT */
/*
 * places - the map of places while the daemon runs: saves, loads and exports it on request, and keeps it from one run to
 * the next where that is configured. All in the loop's thread but one job of each kind at a time, which has a thread of
 * its own because it waits for the disk. The map itself belongs to the pipeline; it is visited in steps of one submap,
 * so that pings wait for the copying of one submap at most.
 */
#ifndef SONARD_PLACES_H
#define SONARD_PLACES_H

#include <pthread.h>
#include <stdbool.h>
#include <stdint.h>

#include "../config/conf.h"
#include "../grid/voxel/frontier.h"
#include "../grid/voxel/voxpage.h"
#include "loop.h"
#include "map_file.h"
#include "rpc.h"

struct daemon;

enum places_format { PLACES_PLY, PLACES_MCAP, PLACES_BT };
enum places_what { PLACES_SAVE, PLACES_LOAD, PLACES_EXPORT };
enum places_state { PLACES_IDLE, PLACES_RUNNING, PLACES_DONE, PLACES_FAILED };

/* A submap, and the head of its bytes. */
struct places_submap {
    uint64_t id;
    uint8_t head[VOXPAGE_HEAD];
};

/* The newest job. While it runs, its thread alone has what stands below `state`. */
struct places_job {
    enum places_what what;
    enum places_state state;
    enum places_format format;
    struct voxmap_setting setting;
    struct map_origin origin;
    char path[CONF_TEXT_MAX + 80];
    struct map_bytes bytes; /* the map as a file */
    char folder[CONF_TEXT_MAX];
    struct places_submap away[VOXMAP_MAX_SUBMAPS]; /* those of which only the pager's files know, oldest first */
    uint32_t n_away;
    uint32_t tiles, pages; /* of a loaded one */
    uint64_t t_unix_ns;
    bool good;
    char message[640]; /* what came of it, one sentence */
};

struct places_task {
    struct daemon *d;
    struct places_job job;
    pthread_t thread;
    struct loop_fd ended; /* an eventfd */
    uint64_t jumps;       /* of the position, when it was asked for */
};

/* The last position that the map's places count from, and whether what came since cannot be the vehicle's way. */
struct places_track {
    bool known, astray;
    double position_m[3];
    uint64_t t_ns;
    double reach_m; /* when astray: so far from there the vehicle can be */
};

struct places {
    struct places_track track;
    uint64_t jumps;                 /* of the position, since the start */
    struct map_origin origin;       /* what the places of this run count from */
    struct places_task asked, kept; /* by a client; by `save_every` and `load` in [map] */
    struct loop_timer save;
    uint64_t saved_pings;     /* in the map when it was kept last */
    bool changed;             /* since then, by other than pings */
    struct frontier frontier; /* of `surface`; its memory is NULL until somebody asks */
    void *frontier_memory;
};

/**
 * places_start - what jobs need; nothing without a map. The map that `load` names is in force when it returns. That which
 * was kept last, if it is not the one, is moved to before.map, so that the new run does not replace it. A map that cannot
 * be loaded is logged and no reason not to run. False with a sentence in err.
 */
bool places_start(struct daemon *d, char *err, size_t err_size);

/**
 * places_position - the vehicle's position was given. One that it cannot have come to (5 m, and `max_speed` in [vehicle] or
 * 10 m for each second, from the one before) means that positions count from another place: the map is held (voxmap_hold)
 * until they come back, or a client says what to do: map_new (it is the same place), map_forget or map_load.
 */
void places_position(struct daemon *d, const struct pose *pose);

/** places_trust - positions count from where the map does, from now on: said when there had been so many jumps (struct
 * places). Of a later one it says nothing, and changes nothing. */
void places_trust(struct daemon *d, uint64_t jumps);

#define PLACES_NAME_MAX (CONF_MAP_NAME_MAX - 1)

/** places_name_good - 1 to PLACES_NAME_MAX letters, digits, - and _: nothing that leaves the folder. */
bool places_name_good(const char *name);

/** places_end - waits for the jobs at work, and keeps the map where that is configured; before the pipeline ends. */
void places_end(struct daemon *d);

/*
 * What a client may ask for: false with a sentence in err, and nothing changed. The name is a good one;
 * the file is NAME.map (.ply, .mcap, .bt) in the configured folder. True: the job has begun.
 */
bool places_save(struct daemon *d, const char *name, char *err, size_t err_size);
bool places_load(struct daemon *d, const char *name, char *err, size_t err_size);
bool places_export(struct daemon *d, const char *name, enum places_format format, char *err, size_t err_size);

#define PLACES_MAX_M 1e8 /* that a client may name, from the origin */

/** places_there - is a map kept? False with a refusal in *error. */
bool places_there(const struct daemon *d, struct rpc_error *error);

/** places_whole_pose - the newest pose, if it is fresh and can tell where the body's places are. */
bool places_whole_pose(const struct daemon *d, struct pose *pose);

/* The methods of sonard-protocol(7) about it as a whole (places_methods.c); where_methods has those about a place. */
json_t *places_method_map(const struct rpc_call *call, json_t *params, struct rpc_error *error);
bool places_method_slice(const struct rpc_call *call, json_t *params, struct text *out, struct rpc_error *error);
json_t *places_method_new(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *places_method_forget(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *places_method_save(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *places_method_load(const struct rpc_call *call, json_t *params, struct rpc_error *error);
json_t *places_method_export(const struct rpc_call *call, json_t *params, struct rpc_error *error);

#endif
