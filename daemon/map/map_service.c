/* SPDX-License-Identifier: MIT */
/* map_service - see map_service.h. */
#include "map_service.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/readable.h"
#include "core/log.h"
#include "map_job.h"
#include "saver.h"

#define LAST   "last"   /* the map that is kept */
#define BEFORE "before" /* what that name had before a run that did not load it */

/* ---- what the map has ---- */

static void look_for_submaps(void *ctx, struct pipeline_map *m)
{
    bool *any = ctx;
    for (uint32_t p = 0; p < m->map.set.max_submaps; p++)
        *any |= m->map.part[p].id != 0;
}

static bool any_submap(struct map_service *s)
{
    bool any = false;
    owner_run_map_now(s->env.pipeline, look_for_submaps, &any);
    return any;
}

/* ---- where the map counts from ---- */

struct hold_setting {
    bool held;
    uint64_t now_ns;
};

static void hold(void *ctx, struct pipeline_map *m)
{
    const struct hold_setting *v = ctx;
    voxmap_hold(&m->map, v->held, v->now_ns);
}

/* Even where it stays as it is: pings that wait may have poses of before. */
static void settle_hold(struct map_service *s)
{
    s->frame_lost = !discontinuity_same(&s->counts_from, &s->discontinuities.sum);
    struct hold_setting v = {.held = s->frame_lost || s->filling, .now_ns = loop_now(s->env.loop)};
    owner_run_map_now(s->env.pipeline, hold, &v);
}

void map_service_trust(struct map_service *s, const struct discontinuity_sum *then)
{
    s->counts_from = *then;
    settle_hold(s);
}

/* ---- jobs ---- */

/* What was put in counts from where poses did when it was asked for. */
static void settle_load(struct map_task *task)
{
    struct map_service *s = task->service;
    const bool filled = s->filling;
    s->filling = false;
    if (task->job.good)
        map_service_trust(s, &task->discontinuities);
    else if (s->frame_lost && !any_submap(s)) /* nothing counts from elsewhere */
        map_service_trust(s, &s->discontinuities.sum);
    else if (filled)
        settle_hold(s);
}

/* The job is done. That the map was kept once more is no news. */
static void settle_task(struct map_task *task)
{
    struct map_job *job = &task->job;
    const bool quiet = task == &task->service->kept && job->what == MAP_SERVICE_SAVE;
    if (job->what == MAP_SERVICE_LOAD)
        settle_load(task);
    job->state = job->good ? MAP_SERVICE_DONE : MAP_SERVICE_FAILED;
    readable(job->message);
    task->copied = true;
    task->service->changed |= job->what == MAP_SERVICE_LOAD;
    log_line(!job->good ? LOG_ERR
             : quiet    ? LOG_DEBUG
                        : LOG_NOTICE,
             job->good ? "map_job_done" : "map_job_failed", "map: %s", job->message);
    rpc_work_resume_all(&task->waiters);
}

static void go_on(struct map_task *task);

static void on_worker(void *ctx)
{
    go_on(ctx);
}

static void on_owner(void *ctx)
{
    struct map_task *task = ctx;
    if (task->job.call.state != OWNER_JOB_DONE)
        return;
    task->left = NULL;
    task->copied |= task->job.copied;
    if (task->copied)
        rpc_work_resume_all(&task->waiters);
    go_on(task);
}

/* The next step of a job, while the loop does other things. */
static void go_on(struct map_task *task)
{
    struct map_service *s = task->service;
    const struct map_job_step next = map_job_next(&task->job);
    task->left = next.owner;
    s->filling |= next.owner && task->job.what == MAP_SERVICE_LOAD;
    if (next.owner)
        owner_call(s->env.pipeline, &task->job.call, next.owner, on_owner);
    else if (next.worker)
        worker_run(s->env.worker, &task->worker, next.worker, on_worker, task);
    else
        settle_task(task);
}

/* The same of all that is left of it, while the loop waits: at the start and at the end. */
static void finish_task(struct map_task *task)
{
    struct map_service *s = task->service;
    struct map_job_step next = {.owner = task->left};
    if (!next.owner)
        next = map_job_next(&task->job);
    for (; next.owner || next.worker; next = map_job_next(&task->job)) {
        s->filling |= next.owner && task->job.what == MAP_SERVICE_LOAD;
        if (next.owner)
            owner_call_now(s->env.pipeline, &task->job.call, next.owner);
        else
            next.worker(&task->job);
    }
    task->left = NULL;
    settle_task(task);
}

static bool prepare(struct map_task *task, enum map_service_what what, const char *name, const char *ending,
                    struct fault *fault)
{
    struct map_service *s = task->service;
    const char *folder = s->env.conf->map.directory;
    struct map_job *job = &task->job;
    if (!folder[0])
        fault_set(fault, "no folder configured: set directory in [map]");
    else if (job->state == MAP_SERVICE_RUNNING)
        fault_set(fault, "another job is running: %s", job->path);
    else if (task == &s->asked && what == MAP_SERVICE_SAVE && s->save.fire && strcmp(name, LAST) == 0)
        fault_set(fault, "the name '%s' is that of the map which save_every in [map] keeps: take another", LAST);
    else if (what == MAP_SERVICE_SAVE && strncmp(name, SAVER_NAME, strlen(SAVER_NAME)) == 0)
        fault_set(fault, "names that begin with '%s' are those of submaps for which memory was low: take another",
                  SAVER_NAME);
    else {
        *job = (struct map_job){.what = what,
                                .state = MAP_SERVICE_IDLE,
                                .now_ns = loop_now(s->env.loop),
                                .setting = pipeline_map_setting(s->env.pipeline),
                                .origin = s->origin,
                                .t_unix_ns = loop_now(s->env.loop) + s->env.unix_offset_ns};
        snprintf(job->path, sizeof job->path, "%s/%s%s", folder, name, ending);
        snprintf(job->folder, sizeof job->folder, "%s", folder);
        task->discontinuities = s->discontinuities.sum;
        task->number++;
        task->copied = what == MAP_SERVICE_LOAD;
        return true;
    }
    return false;
}

static void begin_task(struct map_task *task)
{
    task->job.state = MAP_SERVICE_RUNNING;
    go_on(task);
}

static bool begin_plain(struct map_service *s, enum map_service_what what, const char *name, struct fault *fault)
{
    struct map_task *task = &s->asked;
    if (!prepare(task, what, name, ".map", fault))
        return false;
    begin_task(task);
    return true;
}

bool map_service_name_good(const char *name)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";
    const size_t n = strlen(name);
    return n >= 1 && n <= MAP_SERVICE_NAME_MAX && strspn(name, letters) == n;
}

bool map_service_save(struct map_service *s, const char *name, struct fault *fault)
{
    return begin_plain(s, MAP_SERVICE_SAVE, name, fault);
}

bool map_service_export(struct map_service *s, const char *name, enum map_service_format format,
                        struct fault *fault)
{
    static const char *const endings[] = {
        [MAP_SERVICE_PLY] = ".ply", [MAP_SERVICE_MCAP] = ".mcap", [MAP_SERVICE_BT] = ".bt"};
    struct map_task *task = &s->asked;
    if (!prepare(task, MAP_SERVICE_EXPORT, name, endings[format], fault))
        return false;
    task->job.format = format;
    begin_task(task);
    return true;
}

bool map_service_load(struct map_service *s, const char *name, struct fault *fault)
{
    return begin_plain(s, MAP_SERVICE_LOAD, name, fault);
}

bool map_service_copied(const struct map_service *s, uint64_t number)
{
    const struct map_task *task = &s->asked;
    return task->copied || task->number != number;
}

/* ---- where poses count from ---- */

static void tell_hold(const struct map_service *s, bool was, const struct jump *jump)
{
    if (s->frame_lost && !was)
        log_line(
            LOG_ERR, "map_held",
            "map: the pose jumped by %.1f m level, %.1f m in depth and %.0f degrees: it counts from elsewhere, or "
            "is wrong. Nothing is free in the map until it jumps back, or map new, map forget or map load confirm "
            "the origin",
            jump->by[DISCONTINUITY_LEVEL], jump->by[DISCONTINUITY_DEPTH], geo_deg(jump->by[DISCONTINUITY_TURN]));
    else if (was && !s->frame_lost)
        log_line(LOG_NOTICE, "map_let_go", "map: the pose has jumped back to where it can be: the map holds");
}

void map_service_pose(struct map_service *s, const struct pose *pose)
{
    const struct conf_vehicle *c = &s->env.conf->vehicle;
    const struct map_job *job = &s->asked.job;
    const bool was = s->frame_lost, loads = job->state == MAP_SERVICE_RUNNING && job->what == MAP_SERVICE_LOAD;
    struct jump jump;
    if (!pipeline_has_map(s->env.pipeline) ||
        !discontinuity_take(&s->discontinuities, pose, c->max_speed_mps, c->max_turn_radps, &jump))
        return;
    settle_hold(s);
    if (s->frame_lost && !loads && !any_submap(s)) /* seen while nothing can enter it */
        map_service_trust(s, &s->discontinuities.sum);
    tell_hold(s, was, &jump);
}

/* ---- kept from one run to the next ---- */

static void count_pings(void *ctx, const struct pipeline_owned *owned)
{
    struct map_service_count *count = ctx;
    count->pings = owned->map->map.stats.pings;
}

static void not_kept(const char *why)
{
    log_line(LOG_ERR, "map_not_kept", "map: not kept: %s", why);
}

/* Prepares the job of `kept`, if the map has changed since that was done last. */
static bool prepare_kept(struct map_service *s)
{
    struct fault fault;
    s->changed |= s->kept.job.state == MAP_SERVICE_FAILED && s->kept.job.what == MAP_SERVICE_SAVE;
    if (s->count.pings == s->saved_pings && !s->changed)
        return false;
    if (!prepare(&s->kept, MAP_SERVICE_SAVE, LAST, ".map", &fault)) {
        not_kept(fault.text);
        return false;
    }
    s->saved_pings = s->count.pings;
    s->changed = false;
    return true;
}

static void on_counted(void *ctx)
{
    struct map_service *s = ((struct map_service_count *)ctx)->service;
    if (s->count.call.state == OWNER_JOB_DONE && prepare_kept(s))
        begin_task(&s->kept);
}

static void on_save(void *ctx, uint64_t now_ns)
{
    struct map_service *s = ctx;
    struct map_service_count *count = &s->count;
    const bool counting = count->call.state == OWNER_JOB_WAITS || count->call.state == OWNER_JOB_OUT;
    loop_arm(s->env.loop, &s->save, now_ns + (uint64_t)(s->env.conf->map.save_every_s * 1e9));
    if (!counting && s->kept.job.state != MAP_SERVICE_RUNNING)
        owner_call(s->env.pipeline, &count->call, count_pings, on_counted);
}

/* Before the first ping: nobody waits for it. What was kept last is missing in a first run;
 * a map of another name is not. */
static bool load(struct map_service *s, bool last)
{
    struct map_task *task = &s->kept;
    struct fault fault;
    if (!prepare(task, MAP_SERVICE_LOAD, s->env.conf->map.load, ".map", &fault))
        return false;
    if (last && access(task->job.path, F_OK) != 0) {
        log_line(LOG_NOTICE, "map_empty", "map: starting empty: %s: %s", task->job.path, strerror(errno));
        return false;
    }
    finish_task(task);
    s->changed &= !last;
    return task->job.state == MAP_SERVICE_DONE;
}

/* A map that this run does not go on with is not replaced by it. */
static void move_last(struct map_service *s)
{
    const char *folder = s->env.conf->map.directory;
    char last[CONF_TEXT_MAX + 16], before[CONF_TEXT_MAX + 16];
    snprintf(last, sizeof last, "%s/%s.map", folder, LAST);
    snprintf(before, sizeof before, "%s/%s.map", folder, BEFORE);
    if (rename(last, before) == 0)
        log_line(LOG_NOTICE, "map_moved", "map: the previous run's map is now %s", before);
    else if (errno != ENOENT)
        log_line(LOG_ERR, "map_not_kept", "map: moving %s to %s: %s", last, before, strerror(errno));
}

static void start_keeping(struct map_service *s)
{
    const struct conf_map *c = &s->env.conf->map;
    const bool last = strcmp(c->load, LAST) == 0, loaded = c->load[0] && load(s, last);
    if (!(c->save_every_s > 0))
        return;
    if (!loaded || !last)
        move_last(s);
    s->count.service = s;
    s->save = (struct loop_timer){.fire = on_save, .ctx = s};
    loop_arm(s->env.loop, &s->save, loop_now(s->env.loop) + (uint64_t)(c->save_every_s * 1e9));
}

/* ---- start and end ---- */

void map_service_start(struct map_service *s, const struct map_service_env *env)
{
    s->env = *env;
    discontinuity_init(&s->discontinuities, geo_rad(DISCONTINUITY_DEG));
    s->counts_from = s->discontinuities.sum;
    if (!pipeline_has_map(s->env.pipeline))
        return;
    s->origin.run = loop_now(s->env.loop) + s->env.unix_offset_ns;
    snprintf(s->origin.name, sizeof s->origin.name, "%s", s->env.conf->map.origin);
    const struct voxmap_setting set = pipeline_map_setting(s->env.pipeline);
    log_line(LOG_INFO, "map_made",
             "map: voxels of %g m, submaps of %g m and %g m high, memory for %u tiles of up to %u a submap",
             set.voxel_m, set.side * TILE_SIDE * set.voxel_m, set.height * set.voxel_m, set.n_tiles,
             set.side * set.side);
    s->asked.service = s->kept.service = s;
    if (!s->env.replay)
        start_keeping(s);
}

void map_service_end(struct map_service *s)
{
    if (!s->asked.service)
        return;
    worker_finish(s->env.worker);
    if (s->asked.left)
        finish_task(&s->asked);
    if (s->kept.left)
        finish_task(&s->kept);
    if (s->save.fire) {
        loop_arm(s->env.loop, &s->save, LOOP_NEVER);
        owner_call_now(s->env.pipeline, &s->count.call, count_pings);
        if (prepare_kept(s))
            finish_task(&s->kept);
    }
    free(s->frontier_memory);
}
