/* SPDX-License-Identifier: MIT */
/* places - see places.h. */
#include "places.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "../grid/voxel/voxpage.h"
#include "daemon.h"
#include "map_job.h"

#define LAST   "last"   /* the map that is kept */
#define BEFORE "before" /* what that name had before a run that did not load it */

/* ---- the map, submap by submap ---- */

struct visit_list {
    uint64_t now_ns; /* the map is that of then */
    bool away;
    uint64_t id[VOXMAP_MAX_SUBMAPS]; /* those that are away, or those that are not; oldest first */
    uint32_t n;
    struct places_submap *heads; /* [VOXMAP_MAX_SUBMAPS], of the same; NULL: not wanted */
};

static void list_submaps(void *ctx, struct pipeline_map *m)
{
    struct visit_list *list = ctx;
    voxmap_pass(&m->map, list->now_ns);
    for (uint32_t i = 0; i < m->map.set.max_submaps; i++) {
        const struct voxmap_part *part = &m->map.part[i];
        uint32_t at = list->n;
        if (!part->id || part->away != list->away)
            continue;
        for (; at > 0 && list->id[at - 1] > part->id; at--)
            list->id[at] = list->id[at - 1];
        list->id[at] = part->id;
        list->n++;
    }
    for (uint32_t i = 0; list->heads && i < list->n; i++) {
        list->heads[i].id = list->id[i];
        voxpage_head(&m->map, list->id[i], list->heads[i].head);
    }
}

struct visit_pack {
    uint64_t id;
    uint8_t *room;
    size_t size, packed; /* packed 0: the room is too small */
};

static void measure_submap(void *ctx, struct pipeline_map *m)
{
    struct visit_pack *v = ctx;
    v->size = voxpage_bytes(&m->map, v->id);
}

static void pack_submap(void *ctx, struct pipeline_map *m)
{
    struct visit_pack *v = ctx;
    const size_t needed = voxpage_bytes(&m->map, v->id);
    v->packed = needed <= v->size ? voxpage_pack(&m->map, v->id, 0, v->room, needed) : 0;
    v->size = needed;
}

/* Pings may come between the measuring and the packing of the current submap: then it may have grown. */
static bool pack_one(struct daemon *d, uint64_t id, struct map_bytes *bytes)
{
    struct visit_pack v = {.id = id};
    pipeline_visit_map(d->pipeline, measure_submap, &v);
    while (v.size && !v.packed) {
        v.room = map_file_room(bytes, v.size);
        if (!v.room)
            return false;
        memset(v.room, 0, v.size); /* its pages are faulted in here, not in the owner's thread */
        pipeline_visit_map(d->pipeline, pack_submap, &v);
    }
    if (v.packed)
        map_file_take(bytes, v.packed);
    return true;
}

/* Counts of the veil, as far as there is one. */
struct visit_veil {
    uint8_t *count;
    uint32_t n;
};

static void copy_veil(void *ctx, struct pipeline_map *m)
{
    struct visit_veil *v = ctx;
    const struct veil *veil = &m->map.veil;
    if (v->count && veil->any)
        memcpy(v->count, veil->count, veil->n);
    v->n = v->count && !veil->any ? 0 : veil->n;
}

/* Last, so that nothing is missing which a submap has lost meanwhile. */
static bool pack_veil(struct daemon *d, struct map_bytes *bytes)
{
    struct visit_veil v = {.count = NULL};
    pipeline_visit_map(d->pipeline, copy_veil, &v);
    v.count = calloc(v.n, 1);
    if (!v.count)
        return false;
    pipeline_visit_map(d->pipeline, copy_veil, &v);
    const bool good = map_file_end(bytes, v.count, v.n);
    free(v.count);
    return good;
}

/* The whole map as a file's bytes. Each submap is of one moment; pings that come meanwhile are in the later ones. */
static bool pack_all(struct places_task *task)
{
    struct daemon *d = task->d;
    struct map_bytes *bytes = &task->job.bytes;
    const uint64_t now_ns = loop_now(d->loop);
    struct visit_list list = {.now_ns = now_ns};
    struct visit_list away = {.now_ns = now_ns, .away = true, .heads = task->job.away};
    if (!map_file_begin(bytes, &task->job.setting, &task->job.origin))
        return false;
    pipeline_visit_map(d->pipeline, list_submaps, &list);
    for (uint32_t i = 0; i < list.n; i++)
        if (!pack_one(d, list.id[i], bytes))
            return false;
    pipeline_visit_map(d->pipeline, list_submaps, &away);
    task->job.n_away = away.n;
    return pack_veil(d, bytes);
}

static void clear_map(void *ctx, struct pipeline_map *m)
{
    (void)ctx;
    voxmap_clear(&m->map);
}

struct visit_add {
    struct map_page page;
    bool added;
    char err[256];
};

static void add_submap(void *ctx, struct pipeline_map *m)
{
    struct visit_add *v = ctx;
    v->added = voxpage_add(&m->map, v->page.bytes, v->page.size, v->err, sizeof v->err) != 0;
}

static void add_veil(void *ctx, struct pipeline_map *m)
{
    const struct map_page *veil = ctx;
    voxmap_join_veil(&m->map, veil->bytes, (uint32_t)veil->size);
}

/* What was read replaces the map. */
static bool put_in(struct daemon *d, struct places_job *job)
{
    struct visit_add v = {.added = true};
    struct map_page veil;
    uint32_t n;
    pipeline_visit_map(d->pipeline, clear_map, NULL);
    while (v.added && map_file_page(job->bytes.bytes, job->bytes.size, &v.page))
        pipeline_visit_map(d->pipeline, add_submap, &v);
    veil.bytes = map_file_veil(job->bytes.bytes, job->bytes.size, &n);
    veil.size = n;
    if (veil.bytes)
        pipeline_visit_map(d->pipeline, add_veil, &veil);
    if (!v.added) {
        pipeline_visit_map(d->pipeline, clear_map, NULL);
        snprintf(job->message, sizeof job->message, "%.300s: %.250s; the map is empty now", job->path, v.err);
    }
    return v.added;
}

/* ---- jobs ---- */

static void *job_thread(void *arg)
{
    struct places_task *task = arg;
    const uint64_t one = 1;
    map_job_run(&task->job);
    while (write(task->ended.fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
    return NULL;
}

static void drop_bytes(struct places_job *job)
{
    free(job->bytes.bytes);
    job->bytes = (struct map_bytes){0};
}

/* The job is done; what was loaded becomes the map. That the map was kept once more is no news. */
static void settle(struct places_task *task)
{
    struct places_job *job = &task->job;
    const bool quiet = task == &task->d->places.kept && job->what == PLACES_SAVE;
    const bool good = job->good && (job->what != PLACES_LOAD || put_in(task->d, job));
    if (good && job->what == PLACES_LOAD)
        places_trust(task->d, task->jumps);
    drop_bytes(job);
    job->state = good ? PLACES_DONE : PLACES_FAILED;
    task->d->places.changed |= job->what == PLACES_LOAD;
    log_line(!good   ? LOG_ERR
             : quiet ? LOG_DEBUG
                     : LOG_NOTICE,
             good ? "map_job_done" : "map_job_failed", "map: %s", job->message);
}

static void on_ended(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct places_task *task = ctx;
    uint64_t n;
    (void)events;
    (void)now_ns;
    if (read(task->ended.fd, &n, sizeof n) != sizeof n || task->job.state != PLACES_RUNNING)
        return;
    pthread_join(task->thread, NULL);
    settle(task);
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
                                   .setting = pipeline_map_setting(d->pipeline),
                                   .origin = d->places.origin,
                                   .t_unix_ns = loop_now(d->loop) + d->unix_offset_ns};
        snprintf(job->path, sizeof job->path, "%s/%s%s", folder, name, ending);
        snprintf(job->folder, sizeof job->folder, "%s", folder);
        task->jumps = d->places.jumps;
        return true;
    }
    return false;
}

static bool begin(struct places_task *task, char *err, size_t err_size)
{
    struct places_job *job = &task->job;
    job->state = PLACES_RUNNING;
    if (pthread_create(&task->thread, NULL, job_thread, task) == 0)
        return true;
    job->state = PLACES_FAILED;
    drop_bytes(job);
    snprintf(job->message, sizeof job->message, "cannot start a thread");
    snprintf(err, err_size, "%s", job->message);
    return false;
}

static bool pack(struct places_task *task, char *err, size_t err_size)
{
    if (pack_all(task))
        return true;
    drop_bytes(&task->job);
    snprintf(err, err_size, "no memory for a copy of the map");
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
    return prepare(task, PLACES_SAVE, name, ".map", err, err_size) && pack(task, err, err_size) &&
           begin(task, err, err_size);
}

bool places_export(struct daemon *d, const char *name, enum places_format format, char *err, size_t err_size)
{
    static const char *const endings[] = {[PLACES_PLY] = ".ply", [PLACES_MCAP] = ".mcap", [PLACES_BT] = ".bt"};
    struct places_task *task = &d->places.asked;
    if (!prepare(task, PLACES_EXPORT, name, endings[format], err, err_size))
        return false;
    task->job.format = format;
    return pack(task, err, err_size) && begin(task, err, err_size);
}

bool places_load(struct daemon *d, const char *name, char *err, size_t err_size)
{
    struct places_task *task = &d->places.asked;
    return prepare(task, PLACES_LOAD, name, ".map", err, err_size) && begin(task, err, err_size);
}

/* ---- where positions count from ---- */

#define JUMP_M   5.0
#define JUMP_MPS 10.0 /* where [vehicle] does not say how fast it can be */

static void hold(void *ctx, struct pipeline_map *m)
{
    const struct places_track *track = ctx;
    voxmap_hold(&m->map, track->astray);
}

static void look_for_submaps(void *ctx, struct pipeline_map *m)
{
    bool *any = ctx;
    for (uint32_t p = 0; p < m->map.set.max_submaps; p++)
        *any |= m->map.part[p].id != 0;
}

static void go_astray(struct daemon *d, double far_m, double reach_m)
{
    struct places_track *t = &d->places.track;
    const struct places_job *job = &d->places.asked.job;
    bool any = job->state == PLACES_RUNNING && job->what == PLACES_LOAD;
    pipeline_visit_map(d->pipeline, look_for_submaps, &any);
    if (!any) /* nothing counts from the old place, or is about to */
        return;
    d->places.jumps++;
    t->astray = true;
    t->reach_m = reach_m;
    pipeline_visit_map(d->pipeline, hold, t);
    log_line(LOG_ERR, "map_held",
             "map: the position jumped by %.1f m: it counts from another place, or is wrong. Nothing is free in "
             "the map "
             "until it comes back, or map new, map forget or map load say what is true",
             far_m);
}

/* While astray its reach does not grow, or time alone would make every place one that it can have come to. */
void places_position(struct daemon *d, const struct pose *pose)
{
    struct places_track *t = &d->places.track;
    double way[3] = {0};
    if (!pipeline_has_map(d->pipeline) || (t->known && pose->t_ns < t->t_ns))
        return;
    for (int a = 0; t->known && a < 3; a++)
        way[a] = pose->position_m[a] - t->position_m[a];
    const double far_m = sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
    const double most_mps = d->conf.vehicle.max_speed_mps > 0 ? d->conf.vehicle.max_speed_mps : JUMP_MPS;
    const double reach_m = t->astray ? t->reach_m : JUMP_M + most_mps * (double)(pose->t_ns - t->t_ns) * 1e-9;
    if (far_m <= reach_m && t->astray) {
        places_trust(d, d->places.jumps);
        log_line(LOG_NOTICE, "map_let_go", "map: the position is again where it can be: the map holds");
    } else if (far_m > reach_m && !t->astray) {
        go_astray(d, far_m, reach_m);
    }
    if (t->astray)
        return;
    t->known = true;
    t->t_ns = pose->t_ns;
    memcpy(t->position_m, pose->position_m, sizeof t->position_m);
}

void places_trust(struct daemon *d, uint64_t jumps)
{
    struct places_track *t = &d->places.track;
    const bool was = t->astray;
    if (jumps != d->places.jumps)
        return;
    *t = (struct places_track){0};
    if (was)
        pipeline_visit_map(d->pipeline, hold, t);
}

/* ---- kept from one run to the next ---- */

static void count_pings(void *ctx, struct pipeline_map *m)
{
    uint64_t *pings = ctx;
    *pings = m->map.stats.pings;
}

/* Packs the map as the job of `kept`, if it has changed since that was done last. */
static bool pack_kept(struct daemon *d)
{
    struct places *p = &d->places;
    uint64_t pings = 0;
    char err[640];
    if (p->kept.job.state == PLACES_RUNNING)
        return false;
    p->changed |= p->kept.job.state == PLACES_FAILED && p->kept.job.what == PLACES_SAVE;
    pipeline_visit_map(d->pipeline, count_pings, &pings);
    if (pings == p->saved_pings && !p->changed)
        return false;
    if (!prepare(&p->kept, PLACES_SAVE, LAST, ".map", err, sizeof err) || !pack(&p->kept, err, sizeof err)) {
        log_line(LOG_ERR, "map_not_kept", "map: not kept: %s", err);
        return false;
    }
    p->saved_pings = pings;
    p->changed = false;
    return true;
}

static void on_save(void *ctx, uint64_t now_ns)
{
    struct daemon *d = ctx;
    char err[640];
    loop_arm(d->loop, &d->places.save, now_ns + (uint64_t)(d->conf.map.save_every_s * 1e9));
    if (pack_kept(d) && !begin(&d->places.kept, err, sizeof err))
        log_line(LOG_ERR, "map_not_kept", "map: not kept: %s", err);
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
    p->save = (struct loop_timer){.fire = on_save, .ctx = d};
    loop_arm(d->loop, &p->save, loop_now(d->loop) + (uint64_t)(c->save_every_s * 1e9));
}

/* ---- start and end ---- */

static bool start_task(struct daemon *d, struct places_task *task)
{
    task->d = d;
    task->ended = (struct loop_fd){.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC), .ready = on_ended, .ctx = task};
    return task->ended.fd >= 0 && loop_add(d->loop, &task->ended, EPOLLIN);
}

bool places_start(struct daemon *d, char *err, size_t err_size)
{
    struct places *p = &d->places;
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

static void end_task(struct places_task *task)
{
    struct daemon *d = task->d;
    if (!d)
        return;
    if (task->job.state == PLACES_RUNNING) {
        pthread_join(task->thread, NULL);
        log_line(task->job.good ? LOG_NOTICE : LOG_ERR, task->job.good ? "map_job_done" : "map_job_failed",
                 "map: %s", task->job.message);
    }
    drop_bytes(&task->job);
    if (task->ended.fd >= 0) {
        loop_remove(d->loop, &task->ended);
        close(task->ended.fd);
    }
}

void places_end(struct daemon *d)
{
    struct places *p = &d->places;
    end_task(&p->asked);
    if (p->save.fire) {
        if (p->kept.job.state == PLACES_RUNNING) {
            pthread_join(p->kept.thread, NULL);
            settle(&p->kept);
        }
        if (pack_kept(d)) {
            map_job_run(&p->kept.job);
            settle(&p->kept);
        }
        loop_arm(d->loop, &p->save, LOOP_NEVER);
    }
    end_task(&p->kept);
    free(p->frontier_memory);
}
