/* SPDX-License-Identifier: MIT */
/*
 * saver - keeps the voxel map within its memory: when it runs low, the oldest submap is saved once, as a map of its
 * own, and then dropped; the map remembers the echoes from there, and `map_load` brings the submap back. Pings wait for
 * the copying of a submap, and the loop for nothing. In a replay nothing is saved, so that the same capture gives the
 * same map and no file of a dive is replaced.
 *
 * A submap is dropped only when its file is safe. Where the disk refuses or is too slow, the map itself forgets the
 * oldest (voxmap_low). A folder belongs to one daemon: it holds a lock on the file .lock there.
 */
#ifndef SONARD_SAVER_H
#define SONARD_SAVER_H

#include <stdbool.h>
#include <stdint.h>

#include "config/conf.h"
#include "core/fault.h"
#include "core/loop.h"
#include "core/worker.h"
#include "daemon/pipeline/pipeline.h"
#include "map_file.h"

/* Files are NAME1.map to NAMEn.map, and then NAME1.map again: a disk is not filled without end. */
#define SAVER_NAME  "dropped-"
#define SAVER_FILES 64

/* A submap on its way to its file: of the map's owner while the job is out. */
struct saver_submap {
    struct owner_job call;
    struct saver *saver;
    uint64_t id;   /* 0: memory is not low, or the current one is alone */
    size_t size;   /* as packed; 0: it is gone */
    uint8_t *room; /* to be packed there */
};

/* What it needs; all of it outlives it. */
struct saver_env {
    struct loop *loop;
    struct worker *worker;
    struct pipeline *pipeline;
    const struct conf_map *conf;
    const struct map_origin *origin; /* what the map's places count from */
    bool replay;
};

struct saver {
    struct saver_env env;
    bool busy;
    struct saver_submap submap;
    struct loop_timer timer;
    struct worker_job job;
    struct map_bytes bytes; /* of the file */
    char path[CONF_TEXT_MAX + 40];
    bool good; /* it is written */
    struct fault fault;
    uint64_t saved, errors; /* submaps written, and not */
    int lock;               /* descriptor of the folder's lock; below 0: none */
};

/** saver_start - from here on submaps are saved. Nothing without a map or a folder. The folder is made if only its last
 * component is missing. False with a sentence in fault, also when another daemon uses the folder. */
bool saver_start(struct saver *v, const struct saver_env *env, struct fault *fault);

/** saver_end - waits for what is being written. After request_jobs_end. */
void saver_end(struct saver *v);

#endif
