/* SPDX-License-Identifier: MIT */
/*
 * places - the map of places while the daemon runs: saves, loads and exports it on request, and keeps it from one run to
 * the next where that is configured. All in the loop's thread but one job of each kind at a time, which has a thread of
 * its own because it waits for the disk. The map itself belongs to the pipeline: the loop sends what a job wants of it as
 * an errand in steps of one submap, so that pings wait for the copying of one submap at most, and the loop for nothing.
 */
#ifndef SONARD_PLACES_H
#define SONARD_PLACES_H

#include <pthread.h>
#include <semaphore.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdint.h>

#include "../config/conf.h"
#include "../grid/voxel/frontier.h"
#include "../grid/voxel/voxpage.h"
#include "jumps.h"
#include "loop.h"
#include "map_file.h"
#include "pipeline.h"
#include "rpc.h"

struct daemon;

enum places_format { PLACES_PLY, PLACES_MCAP, PLACES_BT };
enum places_what { PLACES_SAVE, PLACES_LOAD, PLACES_EXPORT };
enum places_state { PLACES_IDLE, PLACES_RUNNING, PLACES_DONE, PLACES_FAILED };

/* How far the map's owner has come with a map that is copied, or put in. */
struct map_steps {
    bool begun;
    uint64_t id[VOXMAP_MAX_SUBMAPS]; /* to be copied, oldest first, ... */
    uint32_t n, next;                /* ... and which is next */
    size_t wanted;                   /* bytes of all */
    uint8_t *veil;                   /* its counts */
    uint32_t veil_size;
    struct map_page page; /* put in last */
    bool good;
};

/* A submap, and the head of its bytes. */
struct places_submap {
    uint64_t id;
    uint8_t head[VOXPAGE_HEAD];
};

/* The newest job. While it runs, its thread alone has what stands below `format`, and while that waits for an errand, the
 * map's owner. */
struct places_job {
    struct errand errand;
    enum places_what what;
    enum places_state state;
    enum places_format format;
    void (*ask)(struct places_job *job, pipeline_owner_fn *fn); /* the map's owner does it with the job; waits */
    struct voxmap_setting setting;
    uint64_t now_ns; /* when it was asked for */
    struct map_origin origin;
    char path[CONF_TEXT_MAX + 80];
    struct map_bytes bytes; /* the map as a file */
    char folder[CONF_TEXT_MAX];
    struct map_steps steps;
    struct places_submap away[VOXMAP_MAX_SUBMAPS]; /* those of which only the pager's files know, oldest first */
    uint32_t n_away;
    bool copied; /* the map as it was is in `bytes` and `away` */
    uint32_t tiles, pages; /* of a loaded one */
    uint64_t t_unix_ns;
    bool good;
    char message[640]; /* what came of it, one sentence */
};

struct places_task {
    struct places_job job; /* its ask() knows where it lies */
    struct daemon *d;
    uint64_t number; /* of the job, counted from 1 */
    bool copied;     /* so is the map, or that will never be */
    pthread_t thread;
    struct loop_fd news;                /* an eventfd: the thread asks, or has ended */
    _Atomic(pipeline_owner_fn *) asked; /* what for; NULL: it does not */
    sem_t answered;
    atomic_bool ended;
    struct jumps_sum jumps; /* of the poses, when it was asked for */
};

/* How many pings the map has. */
struct places_count {
    struct errand errand;
    struct daemon *d;
    uint64_t pings;
};

struct places {
    struct jumps jumps;             /* of the poses, since the start */
    struct jumps_sum counts_from;   /* the map's places do: those until then */
    bool astray;                    /* poses count from elsewhere: the map is held, ... */
    bool filling;                   /* ... and stays so while a file is put in */
    struct map_origin origin;       /* what the places of this run count from */
    struct places_task asked, kept; /* by a client; by `save_every` and `load` in [map] */
    struct loop_timer save;
    struct places_count count; /* whether to keep it again */
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
 * places_pose - a pose was taken. One that the vehicle cannot have come or turned to (jumps.h; `max_speed` and `max_turn` in
 * [vehicle], or 10 m and a turn for each second) means that poses count from another place or north than the map: it is held
 * (voxmap_hold) until they have jumped back, or a client says what to do: map_new (it is the same place), map_forget or
 * map_load. A map in which nothing is counts from wherever poses do.
 */
void places_pose(struct daemon *d, const struct pose *pose);

/** places_trust - the map counts from where poses did when they had made these jumps. */
void places_trust(struct daemon *d, const struct jumps_sum *then);

#define PLACES_NAME_MAX (CONF_MAP_NAME_MAX - 1)

/** places_name_good - 1 to PLACES_NAME_MAX letters, digits, - and _: nothing that leaves the folder. */
bool places_name_good(const char *name);

/** places_end - waits for the jobs at work, and keeps the map where that is configured; before the pipeline ends. */
void places_end(struct daemon *d);

/*
 * What a client may ask for: false with a sentence in err, and nothing changed. The name is a good one;
 * the file is NAME.map (.ply, .mcap, .bt) in the configured folder. True: the job has begun. What is saved or exported is
 * the map as it is when places_copied says so: then server_go_on is called.
 */
bool places_save(struct daemon *d, const char *name, char *err, size_t err_size);
bool places_load(struct daemon *d, const char *name, char *err, size_t err_size);
bool places_export(struct daemon *d, const char *name, enum places_format format, char *err, size_t err_size);

/** places_copied - what comes now changes nothing any more of what the job of that number (of `asked`) saves or exports. */
bool places_copied(const struct daemon *d, uint64_t number);

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
