/* SPDX-License-Identifier: MIT */
/* places - see places.h. */
#include "places.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "daemon.h"
#include "map_job.h"

#define LAST   "last"   /* the map that is kept */
#define BEFORE "before" /* what that name had before a run that did not load it */

/* ---- what the map has ---- */

static void look_for_submaps(void *ctx, struct pipeline_map *m)
{
    bool *any = ctx;
    for (uint32_t p = 0; p < m->map.set.max_submaps; p++)
        *any |= m->map.part[p].id != 0;
}

static bool any_submap(struct daemon *d)
{
    bool any = false;
    pipeline_visit_map(d->pipeline, look_for_submaps, &any);
    return any;
}

/* ---- where the map counts from ---- */

struct visit_hold {
    bool held;
    uint64_t now_ns;
};

static void hold(void *ctx, struct pipeline_map *m)
{
    const struct visit_hold *v = ctx;
    voxmap_hold(&m->map, v->held, v->now_ns);
}

/* Even where it stays as it is: pings that wait may have poses of before. */
static void settle_hold(struct daemon *d)
{
    struct places *p = &d->places;
    p->astray = !jumps_same(&p->counts_from, &p->jumps.sum);
    struct visit_hold v = {.held = p->astray || p->filling, .now_ns = loop_now(d->loop)};
    pipeline_visit_map(d->pipeline, hold, &v);
}

void places_trust(struct daemon *d, const struct jumps_sum *then)
{
    d->places.counts_from = *then;
    settle_hold(d);
}

/* ---- jobs ---- */

static void tell_loop(struct places_task *task)
{
    const uint64_t one = 1;
    while (write(task->news.fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
}

/* By the job's thread: the loop sends it, and goes on. */
static void ask_loop(struct places_job *job, pipeline_owner_fn *fn)
{
    struct places_task *task = (struct places_task *)job;
    atomic_store(&task->asked, fn);
    tell_loop(task);
    while (sem_wait(&task->answered) != 0) {
    }
}

/* By the loop, where nobody waits for it. */
static void ask_owner(struct places_job *job, pipeline_owner_fn *fn)
{
    const struct places_task *task = (struct places_task *)job;
    task->d->places.filling |= job->what == PLACES_LOAD;
    pipeline_errand_now(task->d->pipeline, &job->errand, fn);
}

static void *job_thread(void *arg)
{
    struct places_task *task = arg;
    map_job_run(&task->job);
    atomic_store(&task->ended, true);
    tell_loop(task);
    return NULL;
}

/* The owner has done what the job asked for. */
static void answer(struct places_task *task)
{
    task->copied |= task->job.copied;
    atomic_store(&task->asked, NULL);
    sem_post(&task->answered);
}

/* What the end of all errands has kept from being done is still asked for. */
static void on_errand(void *ctx)
{
    struct places_task *task = ctx;
    if (task->job.errand.state == ERRAND_DONE)
        answer(task);
}

/* What was put in counts from where poses did when it was asked for. */
static void settle_load(struct places_task *task)
{
    struct daemon *d = task->d;
    const bool filled = d->places.filling;
    d->places.filling = false;
    if (task->job.good)
        places_trust(d, &task->jumps);
    else if (d->places.astray && !any_submap(d)) /* nothing counts from elsewhere */
        places_trust(d, &d->places.jumps.sum);
    else if (filled)
        settle_hold(d);
}

/* The job is done. That the map was kept once more is no news. */
static void settle(struct places_task *task)
{
    struct places_job *job = &task->job;
    const bool quiet = task == &task->d->places.kept && job->what == PLACES_SAVE;
    if (job->what == PLACES_LOAD)
        settle_load(task);
    job->state = job->good ? PLACES_DONE : PLACES_FAILED;
    task->copied = true;
    task->d->places.changed |= job->what == PLACES_LOAD;
    log_line(!job->good ? LOG_ERR
             : quiet    ? LOG_DEBUG
                        : LOG_NOTICE,
             job->good ? "map_job_done" : "map_job_failed", "map: %s", job->message);
}

static void settle_ended(struct places_task *task)
{
    pthread_join(task->thread, NULL);
    settle(task);
}

static void on_news(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct places_task *task = ctx;
    struct daemon *d = task->d;
    uint64_t n;
    (void)events;
    (void)now_ns;
    while (read(task->news.fd, &n, sizeof n) < 0 && errno == EINTR) {
    }
    pipeline_owner_fn *fn = atomic_load(&task->asked);
    d->places.filling |= fn && task->job.what == PLACES_LOAD;
    if (fn)
        pipeline_errand_then(d->pipeline, &task->job.errand, fn, on_errand);
    else if (task->job.state == PLACES_RUNNING && atomic_load(&task->ended))
        settle_ended(task);
    if (d->server)
        server_go_on(d->server);
}

static bool prepare(struct places_task *task, enum places_what what, const char *name, const char *ending,
                    char *err, size_t err_size)
{
    struct daemon *d = task->d;
    const char *folder = d->conf.map.directory;
    struct places_job *job = &task->job;
    if (!folder[0])
        snprintf(err, err_size, "no folder is configured: set directory in [map]");
    else if (job->state == PLACES_RUNNING)
        snprintf(err, err_size, "another job is at work: %s", job->path);
    else if (task == &d->places.asked && what == PLACES_SAVE && d->places.save.fire && strcmp(name, LAST) == 0)
        snprintf(err, err_size, "the name '%s' is that of the map which save_every in [map] keeps: take another",
                 LAST);
    else {
        *job = (struct places_job){.what = what,
                                   .state = PLACES_IDLE,
                                   .ask = ask_owner,
                                   .now_ns = loop_now(d->loop),
                                   .setting = pipeline_map_setting(d->pipeline),
                                   .origin = d->places.origin,
                                   .t_unix_ns = loop_now(d->loop) + d->unix_offset_ns};
        snprintf(job->path, sizeof job->path, "%s/%s%s", folder, name, ending);
        snprintf(job->folder, sizeof job->folder, "%s", folder);
        task->jumps = d->places.jumps.sum;
        task->number++;
        task->copied = what == PLACES_LOAD;
        return true;
    }
    return false;
}

static bool begin(struct places_task *task, char *err, size_t err_size)
{
    struct places_job *job = &task->job;
    job->state = PLACES_RUNNING;
    job->ask = ask_loop;
    atomic_store(&task->ended, false);
    if (pthread_create(&task->thread, NULL, job_thread, task) == 0)
        return true;
    job->state = PLACES_FAILED;
    snprintf(job->message, sizeof job->message, "cannot start a thread");
    snprintf(err, err_size, "%s", job->message);
    return false;
}

bool places_name_good(const char *name)
{
    static const char letters[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";
    const size_t n = strlen(name);
    return n >= 1 && n <= PLACES_NAME_MAX && strspn(name, letters) == n;
}

bool places_save(struct daemon *d, const char *name, char *err, size_t err_size)
{
    struct places_task *task = &d->places.asked;
    return prepare(task, PLACES_SAVE, name, ".map", err, err_size) && begin(task, err, err_size);
}

bool places_export(struct daemon *d, const char *name, enum places_format format, char *err, size_t err_size)
{
    static const char *const endings[] = {[PLACES_PLY] = ".ply", [PLACES_MCAP] = ".mcap", [PLACES_BT] = ".bt"};
    struct places_task *task = &d->places.asked;
    if (!prepare(task, PLACES_EXPORT, name, endings[format], err, err_size))
        return false;
    task->job.format = format;
    return begin(task, err, err_size);
}

bool places_load(struct daemon *d, const char *name, char *err, size_t err_size)
{
    struct places_task *task = &d->places.asked;
    return prepare(task, PLACES_LOAD, name, ".map", err, err_size) && begin(task, err, err_size);
}

bool places_copied(const struct daemon *d, uint64_t number)
{
    const struct places_task *task = &d->places.asked;
    return task->copied || task->number != number;
}

/* ---- where poses count from ---- */

static void tell_hold(const struct places *p, bool was, const struct jump *jump)
{
    if (p->astray && !was)
        log_line(LOG_ERR, "map_held",
                 "map: the pose jumped by %.1f m level, %.1f m in depth and %.0f degrees: it counts from elsewhere, or is "
                 "wrong. Nothing is free in the map until it has jumped back, or map new, map forget or map load say "
                 "what is true",
                 jump->by[JUMPS_LEVEL], jump->by[JUMPS_DEPTH], geo_deg(jump->by[JUMPS_TURN]));
    else if (was && !p->astray)
        log_line(LOG_NOTICE, "map_let_go", "map: the pose has jumped back to where it can be: the map holds");
}

void places_pose(struct daemon *d, const struct pose *pose)
{
    struct places *p = &d->places;
    const struct conf_vehicle *c = &d->conf.vehicle;
    const struct places_job *job = &p->asked.job;
    const bool was = p->astray, loads = job->state == PLACES_RUNNING && job->what == PLACES_LOAD;
    struct jump jump;
    if (!pipeline_has_map(d->pipeline) ||
        !jumps_take(&p->jumps, pose, c->max_speed_mps, c->max_turn_radps, &jump))
        return;
    settle_hold(d);
    if (p->astray && !loads && !any_submap(d)) /* seen while nothing can enter it */
        places_trust(d, &p->jumps.sum);
    tell_hold(p, was, &jump);
}

/* ---- kept from one run to the next ---- */

static void count_pings(void *ctx, const struct pipeline_owned *owned)
{
    struct places_count *count = ctx;
    count->pings = owned->map->map.stats.pings;
}

static void not_kept(const char *why)
{
    log_line(LOG_ERR, "map_not_kept", "map: not kept: %s", why);
}

/* Prepares the job of `kept`, if the map has changed since that was done last. */
static bool prepare_kept(struct daemon *d)
{
    struct places *p = &d->places;
    char err[640];
    p->changed |= p->kept.job.state == PLACES_FAILED && p->kept.job.what == PLACES_SAVE;
    if (p->count.pings == p->saved_pings && !p->changed)
        return false;
    if (!prepare(&p->kept, PLACES_SAVE, LAST, ".map", err, sizeof err)) {
        not_kept(err);
        return false;
    }
    p->saved_pings = p->count.pings;
    p->changed = false;
    return true;
}

static void on_counted(void *ctx)
{
    struct daemon *d = ((struct places_count *)ctx)->d;
    char err[640];
    if (d->places.count.errand.state == ERRAND_DONE && prepare_kept(d) &&
        !begin(&d->places.kept, err, sizeof err))
        not_kept(err);
}

static void on_save(void *ctx, uint64_t now_ns)
{
    struct daemon *d = ctx;
    struct places_count *count = &d->places.count;
    const bool counting = count->errand.state == ERRAND_WAITS || count->errand.state == ERRAND_OUT;
    loop_arm(d->loop, &d->places.save, now_ns + (uint64_t)(d->conf.map.save_every_s * 1e9));
    if (!counting && d->places.kept.job.state != PLACES_RUNNING)
        pipeline_errand_then(d->pipeline, &count->errand, count_pings, on_counted);
}

/* Before the first ping: nobody waits for it. What was kept last is missing in a first run; a map of another name is not. */
static bool load(struct daemon *d, bool last)
{
    struct places_task *task = &d->places.kept;
    char err[640];
    if (!prepare(task, PLACES_LOAD, d->conf.map.load, ".map", err, sizeof err))
        return false;
    if (last && access(task->job.path, F_OK) != 0) {
        log_line(LOG_NOTICE, "map_empty", "map: begins empty: %s: %s", task->job.path, strerror(errno));
        return false;
    }
    map_job_run(&task->job);
    settle(task);
    d->places.changed &= !last;
    return task->job.state == PLACES_DONE;
}

/* A map that this run does not go on with is not replaced by it. */
static void move_last(struct daemon *d)
{
    const char *folder = d->conf.map.directory;
    char last[CONF_TEXT_MAX + 16], before[CONF_TEXT_MAX + 16];
    snprintf(last, sizeof last, "%s/%s.map", folder, LAST);
    snprintf(before, sizeof before, "%s/%s.map", folder, BEFORE);
    if (rename(last, before) == 0)
        log_line(LOG_NOTICE, "map_moved", "map: that of the run before is now %s", before);
    else if (errno != ENOENT)
        log_line(LOG_ERR, "map_not_kept", "map: moving %s to %s: %s", last, before, strerror(errno));
}

static void start_keeping(struct daemon *d)
{
    struct places *p = &d->places;
    const struct conf_map *c = &d->conf.map;
    const bool last = strcmp(c->load, LAST) == 0, loaded = c->load[0] && load(d, last);
    if (!(c->save_every_s > 0))
        return;
    if (!loaded || !last)
        move_last(d);
    p->count.d = d;
    p->save = (struct loop_timer){.fire = on_save, .ctx = d};
    loop_arm(d->loop, &p->save, loop_now(d->loop) + (uint64_t)(c->save_every_s * 1e9));
}

/* ---- start and end ---- */

static bool start_task(struct daemon *d, struct places_task *task)
{
    task->d = d;
    sem_init(&task->answered, 0, 0);
    task->news = (struct loop_fd){.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), .ready = on_news, .ctx = task};
    return task->news.fd >= 0 && loop_add(d->loop, &task->news, EPOLLIN);
}

bool places_start(struct daemon *d, char *err, size_t err_size)
{
    struct places *p = &d->places;
    jumps_init(&p->jumps, geo_rad(JUMPS_DEG));
    p->counts_from = p->jumps.sum;
    if (!pipeline_has_map(d->pipeline))
        return true;
    p->origin.run = loop_now(d->loop) + d->unix_offset_ns;
    snprintf(p->origin.name, sizeof p->origin.name, "%s", d->conf.map.origin);
    const struct voxmap_setting s = pipeline_map_setting(d->pipeline);
    log_line(LOG_INFO, "map_made",
             "map: voxels of %g m, submaps of %g m and %g m high, memory for %u tiles of up to %u a submap",
             s.voxel_m, s.side * TILE_SIDE * s.voxel_m, s.height * s.voxel_m, s.n_tiles, s.side * s.side);
    if (!start_task(d, &p->asked) || !start_task(d, &p->kept)) {
        snprintf(err, err_size, "map: %s", strerror(errno));
        return false;
    }
    if (!d->replay)
        start_keeping(d);
    return true;
}

/* The loop waits for the job, and has the owner do what it asks for. */
static void wait_for(struct places_task *task)
{
    struct pollfd news = {.fd = task->news.fd, .events = POLLIN};
    uint64_t n;
    while (task->job.state == PLACES_RUNNING) {
        pipeline_owner_fn *fn = atomic_load(&task->asked);
        if (fn) {
            ask_owner(&task->job, fn);
            answer(task);
        } else if (atomic_load(&task->ended)) {
            settle_ended(task);
        } else if (poll(&news, 1, -1) > 0 && read(news.fd, &n, sizeof n) < 0) {
            continue;
        }
    }
}

static void end_task(struct places_task *task)
{
    if (!task->d)
        return;
    if (task->news.fd >= 0) {
        loop_remove(task->d->loop, &task->news);
        close(task->news.fd);
    }
    sem_destroy(&task->answered);
}

void places_end(struct daemon *d)
{
    struct places *p = &d->places;
    wait_for(&p->asked);
    wait_for(&p->kept);
    if (p->save.fire) {
        loop_arm(d->loop, &p->save, LOOP_NEVER);
        pipeline_errand_now(d->pipeline, &p->count.errand, count_pings);
        if (prepare_kept(d)) {
            map_job_run(&p->kept.job);
            settle(&p->kept);
        }
    }
    end_task(&p->asked);
    end_task(&p->kept);
    free(p->frontier_memory);
}
