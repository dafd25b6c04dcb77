/* SPDX-License-Identifier: MIT */
/*
 * map_service - the voxel map while the daemon runs: saves, loads and exports it on request, and keeps it from one run
 * to the next where that is configured. All in the loop's thread but the steps of one job of each kind at a time: the
 * worker waits for the disk, and the map's owner, the pipeline, copies or fills the map in jobs of one submap a
 * step, so that pings wait for the copying of one submap at most, and the loop for nothing.
 */
#ifndef SONARD_MAP_SERVICE_H
#define SONARD_MAP_SERVICE_H

#include <stdbool.h>
#include <stdint.h>

#include "config/conf.h"
#include "core/fault.h"
#include "grid/voxel/frontier.h"
#include "grid/voxel/voxpage.h"
#include "daemon/input/discontinuity.h"
#include "core/loop.h"
#include "core/worker.h"
#include "map_file.h"
#include "daemon/pipeline/pipeline.h"
#include "daemon/rpc/work.h"

enum map_service_format { MAP_SERVICE_PLY, MAP_SERVICE_MCAP, MAP_SERVICE_BT };
enum map_service_what { MAP_SERVICE_SAVE, MAP_SERVICE_LOAD, MAP_SERVICE_EXPORT };
enum map_service_state { MAP_SERVICE_IDLE, MAP_SERVICE_RUNNING, MAP_SERVICE_DONE, MAP_SERVICE_FAILED };

/* How far the map's owner has come with a map that is copied, or put in. */
struct map_steps {
    bool started;
    uint64_t id[VOXMAP_MAX_SUBMAPS]; /* to be copied, oldest first, ... */
    uint32_t n, next;                /* ... and which is next */
    size_t wanted;                   /* bytes of all */
    uint8_t *residual;               /* its counts */
    uint32_t residual_size;
    struct map_page page; /* put in last */
    bool good;
};

/* The step of a job that is being done, or was done last. */
enum map_job_at {
    MAP_JOB_BEGUN,
    MAP_JOB_MEASURED,
    MAP_JOB_ROOM,
    MAP_JOB_COPIED,
    MAP_JOB_WRITTEN,
    MAP_JOB_READ,
    MAP_JOB_PUT_IN,
    MAP_JOB_ENDED
};

/* The newest job. While a step of it is done, whoever does that alone has what stands below `format`. */
struct map_job {
    struct owner_job call;
    enum map_service_what what;
    enum map_service_state state;
    enum map_service_format format;
    enum map_job_at at;
    struct voxmap_setting setting;
    uint64_t now_ns; /* when it was asked for */
    struct map_origin origin;
    char path[CONF_TEXT_MAX + 80];
    struct map_bytes bytes; /* the map as a file */
    char folder[CONF_TEXT_MAX];
    struct map_steps steps;
    bool copied;           /* the map as it was is in `bytes` */
    uint32_t tiles, pages; /* of a loaded one */
    uint64_t t_unix_ns;
    bool good;
    char message[640]; /* what came of it, one sentence */
};

struct map_service;

struct map_task {
    struct map_job job;
    struct map_service *service;
    uint64_t number;            /* of the job, counted from 1 */
    bool copied;                /* so is the map, or that will never be */
    struct rpc_waiters waiters; /* requests, until it is copied */
    struct worker_job worker;
    pipeline_owner_fn *left; /* what the end of all jobs has kept from being done; NULL: nothing */
    struct discontinuity_sum discontinuities; /* of the poses, when it was asked for */
};

/* How many pings the map has. */
struct map_service_count {
    struct owner_job call;
    struct map_service *service;
    uint64_t pings;
};

/* What it needs; all of it outlives it. */
struct map_service_env {
    struct loop *loop;
    struct worker *worker;
    struct pipeline *pipeline;
    const struct conf *conf;
    uint64_t unix_offset_ns; /* Unix time = monotonic + this */
    bool replay;
};

struct map_service {
    struct map_service_env env;
    struct discontinuities discontinuities; /* of the poses, since the start */
    struct discontinuity_sum counts_from;   /* the map's places do: those until then */
    bool frame_lost;                        /* poses count from elsewhere: the map is held, ... */
    bool filling;                           /* ... and stays so while a file is put in */
    struct map_origin origin;               /* what the places of this run count from */
    struct map_task asked, kept;            /* by a client; by `save_every` and `load` in [map] */
    struct loop_timer save;
    struct map_service_count count; /* whether to keep it again */
    uint64_t saved_pings;           /* in the map when it was kept last */
    bool changed;                   /* since then, by other than pings */
    struct frontier frontier;       /* of `surface`; its memory is NULL until somebody asks */
    void *frontier_memory;
};

/**
 * map_service_start - what jobs need; nothing without a map. The map that `load` names is in force when it returns.
 * That which was kept last, if it is not the one, is moved to before.map, so that the new run does not replace it. A
 * map that cannot be loaded is logged and no reason not to run.
 */
void map_service_start(struct map_service *s, const struct map_service_env *env);

/**
 * map_service_pose - a pose was taken. One that the vehicle cannot have come or turned to (discontinuity.h;
 * `max_speed` and
 * `max_turn` in [vehicle], or 10 m and a turn for each second) means that poses count from another place or north than
 * the map: it is held (voxmap_hold) until they have jumped back, or a client says what to do: map_new (it is the same
 * place), map_forget or map_load. A map in which nothing is counts from wherever poses do.
 */
void map_service_pose(struct map_service *s, const struct pose *pose);

/** map_service_trust - the map counts from where poses did when they had made these jumps. */
void map_service_trust(struct map_service *s, const struct discontinuity_sum *then);

#define MAP_SERVICE_NAME_MAX (CONF_MAP_NAME_MAX - 1)

/** map_service_name_good - 1 to MAP_SERVICE_NAME_MAX letters, digits, - and _: nothing that leaves the folder. */
bool map_service_name_good(const char *name);

/** map_service_end - waits for the jobs at work, and keeps the map where that is configured;
 * before the pipeline ends. */
void map_service_end(struct map_service *s);

/*
 * What a client may ask for: false with a sentence in fault, and nothing changed. The name is a good one; the file is
 * NAME.map (.ply, .mcap, .bt) in the configured folder. True: the job has started. What is saved or exported is the map
 * as it is when map_service_copied says so: then the waiters are resumed.
 */
bool map_service_save(struct map_service *s, const char *name, struct fault *fault);
bool map_service_load(struct map_service *s, const char *name, struct fault *fault);
bool map_service_export(struct map_service *s, const char *name, enum map_service_format format,
                        struct fault *fault);

/** map_service_copied - what comes now changes nothing any more of what the job of that number (of
 * `asked`) saves or exports. */
bool map_service_copied(const struct map_service *s, uint64_t number);

#endif
