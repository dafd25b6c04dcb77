/* SPDX-License-Identifier: MIT */
/* saver - see saver.h. */
#include "saver.h"

#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/atomic_file.h"
#include "core/log.h"
#include "grid/voxel/voxpage.h"

#define LOOK_EVERY_NS 250000000u

/* ---- by the map's owner ---- */

static void look_at_memory(void *ctx, const struct pipeline_owned *owned)
{
    struct saver_submap *s = ctx;
    const struct voxmap *map = &owned->map->map;
    s->id = voxmap_low(map) ? voxmap_oldest(map) : 0;
    s->size = voxpage_bytes(map, s->id);
}

static void pack(void *ctx, const struct pipeline_owned *owned)
{
    struct saver_submap *s = ctx;
    s->size = voxpage_pack(&owned->map->map, s->id, 0, s->room, s->size);
}

static void drop_submap(void *ctx, const struct pipeline_owned *owned)
{
    const struct saver_submap *s = ctx;
    voxmap_drop(&owned->map->map, s->id);
}

/* ---- by the worker ---- */

static void write_file(void *ctx)
{
    struct saver *v = ctx;
    v->good = atomic_file_replace(v->path, v->bytes.bytes, v->bytes.size, MAP_FILE_MAGIC_BYTES, &v->fault);
}

/* ---- by the loop, step by step ---- */

static void rest(struct saver *v)
{
    free(v->bytes.bytes);
    v->bytes = (struct map_bytes){0};
    v->busy = false;
}

static void fail(struct saver *v, const char *why)
{
    v->errors++;
    log_limited(loop_now(v->env.loop), LOG_ERR, LOG_ABOUT(.event = "map_not_saved"),
                "map: memory is low and a submap cannot be saved: %s", why);
    rest(v);
}

/* All jobs have ended before this one was done. */
static bool has_ended(const struct saver_submap *s)
{
    return s->call.state != OWNER_JOB_DONE;
}

static void step(struct saver *v, pipeline_owner_fn *fn, void (*then)(void *ctx))
{
    owner_call(v->env.pipeline, &v->submap.call, fn, then);
}

static void on_dropped(void *ctx)
{
    const struct saver_submap *s = ctx;
    rest(s->saver);
}

static void on_written(void *ctx)
{
    struct saver *v = ctx;
    if (!v->good) {
        fail(v, v->fault.text);
        return;
    }
    v->saved++;
    log_line(LOG_NOTICE, "map_dropped", "map: memory is low: submap %llu is saved as %s; its echoes are kept",
             (unsigned long long)v->submap.id, v->path);
    step(v, drop_submap, on_dropped);
}

/* A closed submap never changes: what was packed is what is dropped later. It may have gone since the look. */
static void on_packed(void *ctx)
{
    const struct saver_submap *s = ctx;
    struct saver *v = s->saver;
    if (has_ended(s) || !s->size) {
        rest(v);
        return;
    }
    map_file_take(&v->bytes, s->size);
    snprintf(v->path, sizeof v->path, "%.*s/" SAVER_NAME "%u.map", CONF_TEXT_MAX, v->env.conf->directory,
             (unsigned)(v->saved % SAVER_FILES) + 1);
    if (map_file_end(&v->bytes, NULL, 0))
        worker_run(v->env.worker, &v->job, write_file, on_written, v);
    else
        fail(v, "out of memory");
}

static void pack_submap(struct saver *v)
{
    const struct voxmap_setting setting = pipeline_map_setting(v->env.pipeline);
    v->submap.room =
        map_file_begin(&v->bytes, &setting, v->env.origin) ? map_file_room(&v->bytes, v->submap.size) : NULL;
    if (!v->submap.room) {
        fail(v, "out of memory");
        return;
    }
    memset(v->submap.room, 0xff, v->submap.size); /* its pages are faulted in here, not in the owner's thread */
    step(v, pack, on_packed);
}

static void on_looked(void *ctx)
{
    const struct saver_submap *s = ctx;
    struct saver *v = s->saver;
    if (has_ended(s) || !s->id)
        rest(v);
    else if (v->env.replay)
        step(v, drop_submap, on_dropped);
    else
        pack_submap(v);
}

static void on_timer(void *ctx, uint64_t now_ns)
{
    struct saver *v = ctx;
    loop_arm(v->env.loop, &v->timer, now_ns + LOOK_EVERY_NS);
    if (v->busy)
        return;
    v->busy = true;
    v->submap = (struct saver_submap){.saver = v};
    step(v, look_at_memory, on_looked);
}

/* ---- start and end ---- */

/* Two daemons in one folder would replace each other's maps. False: another daemon has it. A folder that cannot be
 * written to holds no maps. */
static bool lock_folder(struct saver *v, const char *folder, struct fault *fault)
{
    snprintf(v->path, sizeof v->path, "%.*s/.lock", CONF_TEXT_MAX, folder);
    v->lock = open(v->path, O_RDWR | O_CREAT | O_CLOEXEC, 0640);
    if (v->lock < 0 || flock(v->lock, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK)
        return true;
    close(v->lock);
    return fault_set(
        fault, "map: another sonard uses the folder %.300s: set another directory in [map], or stop it", folder);
}

bool saver_start(struct saver *v, const struct saver_env *env, struct fault *fault)
{
    const char *folder = env->conf->directory;
    *v = (struct saver){.env = *env, .lock = -1};
    if (!pipeline_has_map(env->pipeline) || !folder[0])
        return true;
    if (mkdir(folder, 0750) != 0 && errno != EEXIST)
        log_line(LOG_WARNING, "map_failed", "map: nothing can be saved: making the folder %s: %s", folder,
                 strerror(errno));
    if (!lock_folder(v, folder, fault))
        return false;
    v->timer = (struct loop_timer){.fire = on_timer, .ctx = v};
    loop_arm(env->loop, &v->timer, loop_now(env->loop) + LOOK_EVERY_NS);
    return true;
}

void saver_end(struct saver *v)
{
    if (!v->timer.fire)
        return;
    loop_arm(v->env.loop, &v->timer, LOOP_NEVER);
    if (v->busy)
        worker_finish(v->env.worker);
    if (v->lock >= 0)
        close(v->lock);
}
