/* SPDX-License-Identifier: MIT */
/* places - see places.h. */
#include "places.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "../grid/voxel/voxpage.h"
#include "daemon.h"
#include "map_job.h"

/* ---- the map, submap by submap ---- */

struct visit_list {
    bool away;
    struct places_submap submap[VOXMAP_MAX_SUBMAPS]; /* those that are away, or those that are not; oldest first */
    uint32_t n;
};

static void list_submaps(void *ctx, struct pipeline_map *m)
{
    struct visit_list *list = ctx;
    for (uint32_t i = 0; i < m->map.set.max_submaps; i++) {
        const struct voxmap_part *part = &m->map.part[i];
        uint32_t at = list->n;
        if (!part->id || part->away != list->away)
            continue;
        for (; at > 0 && list->submap[at - 1].id > part->id; at--)
            list->submap[at] = list->submap[at - 1];
        list->submap[at] = (struct places_submap){part->id, voxmap_shift(&m->map, part)};
        list->n++;
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

/* The whole map as a file's bytes. Each submap is of one moment; pings that come meanwhile are in the later ones. */
static bool pack_all(struct daemon *d, struct map_bytes *bytes)
{
    struct visit_list list = {.away = false}, away = {.away = true};
    if (!map_file_begin(bytes, &d->places.job.setting))
        return false;
    pipeline_visit_map(d->pipeline, list_submaps, &list);
    for (uint32_t i = 0; i < list.n; i++)
        if (!pack_one(d, list.submap[i].id, bytes))
            return false;
    pipeline_visit_map(d->pipeline, list_submaps, &away);
    memcpy(d->places.job.away, away.submap, sizeof away.submap);
    d->places.job.n_away = away.n;
    return map_file_end(bytes);
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

/* What was read replaces the map. */
static bool put_in(struct daemon *d, struct places_job *job)
{
    struct visit_add v = {.added = true};
    pipeline_visit_map(d->pipeline, clear_map, NULL);
    while (v.added && map_file_page(job->bytes.bytes, job->bytes.size, &v.page))
        pipeline_visit_map(d->pipeline, add_submap, &v);
    if (!v.added) {
        pipeline_visit_map(d->pipeline, clear_map, NULL);
        snprintf(job->message, sizeof job->message, "%.300s: %.250s; the map is empty now", job->path, v.err);
    }
    return v.added;
}

/* ---- jobs ---- */

static void *job_thread(void *arg)
{
    struct daemon *d = arg;
    const uint64_t one = 1;
    map_job_run(&d->places.job);
    while (write(d->places.ended.fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
    return NULL;
}

static void on_ended(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct daemon *d = ctx;
    struct places_job *job = &d->places.job;
    uint64_t n;
    (void)events;
    (void)now_ns;
    if (read(d->places.ended.fd, &n, sizeof n) != sizeof n || job->state != PLACES_RUNNING)
        return;
    pthread_join(d->places.thread, NULL);
    bool good = job->good && (job->what != PLACES_LOAD || put_in(d, job));
    free(job->bytes.bytes);
    job->bytes = (struct map_bytes){0};
    job->state = good ? PLACES_DONE : PLACES_FAILED;
    log_line(good ? LOG_NOTICE : LOG_ERR, "map: %s", job->message);
}

static bool prepare(struct daemon *d, enum places_what what, const char *name, const char *ending, char *err,
                    size_t err_size)
{
    const char *folder = d->conf.map.directory;
    struct places_job *job = &d->places.job;
    if (!folder[0])
        snprintf(err, err_size, "no folder is configured: set directory in [map]");
    else if (job->state == PLACES_RUNNING)
        snprintf(err, err_size, "another job is at work: %s", job->path);
    else {
        *job = (struct places_job){.what = what,
                                   .state = PLACES_IDLE,
                                   .setting = pipeline_map_setting(d->pipeline),
                                   .t_unix_ns = loop_now(d->loop) + d->unix_offset_ns};
        snprintf(job->path, sizeof job->path, "%s/%s%s", folder, name, ending);
        snprintf(job->folder, sizeof job->folder, "%s", folder);
        return true;
    }
    return false;
}

static bool begin(struct daemon *d, char *err, size_t err_size)
{
    struct places_job *job = &d->places.job;
    job->state = PLACES_RUNNING;
    if (pthread_create(&d->places.thread, NULL, job_thread, d) == 0)
        return true;
    job->state = PLACES_FAILED;
    free(job->bytes.bytes);
    job->bytes = (struct map_bytes){0};
    snprintf(job->message, sizeof job->message, "cannot start a thread");
    snprintf(err, err_size, "%s", job->message);
    return false;
}

static bool pack_and_begin(struct daemon *d, char *err, size_t err_size)
{
    struct places_job *job = &d->places.job;
    if (pack_all(d, &job->bytes))
        return begin(d, err, err_size);
    free(job->bytes.bytes);
    job->bytes = (struct map_bytes){0};
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
    return prepare(d, PLACES_SAVE, name, ".map", err, err_size) && pack_and_begin(d, err, err_size);
}

bool places_export(struct daemon *d, const char *name, enum places_format format, char *err, size_t err_size)
{
    static const char *const endings[] = {[PLACES_PLY] = ".ply", [PLACES_MCAP] = ".mcap", [PLACES_BT] = ".bt"};
    if (!prepare(d, PLACES_EXPORT, name, endings[format], err, err_size))
        return false;
    d->places.job.format = format;
    return pack_and_begin(d, err, err_size);
}

bool places_load(struct daemon *d, const char *name, char *err, size_t err_size)
{
    return prepare(d, PLACES_LOAD, name, ".map", err, err_size) && begin(d, err, err_size);
}

/* ---- start and end ---- */

bool places_start(struct daemon *d, char *err, size_t err_size)
{
    struct places *p = &d->places;
    p->ended = (struct loop_fd){.fd = -1, .ready = on_ended, .ctx = d};
    if (!pipeline_has_map(d->pipeline))
        return true;
    const struct voxmap_setting s = pipeline_map_setting(d->pipeline);
    log_line(LOG_INFO,
             "map: voxels of %g m, submaps of %g m and %g m high, memory for %u tiles of up to %u a submap",
             s.voxel_m, s.side * TILE_SIDE * s.voxel_m, s.height * s.voxel_m, s.n_tiles, s.side * s.side);
    p->ended.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (p->ended.fd >= 0 && loop_add(d->loop, &p->ended, EPOLLIN))
        return true;
    snprintf(err, err_size, "map: %s", strerror(errno));
    return false;
}

void places_end(struct daemon *d)
{
    struct places *p = &d->places;
    if (p->job.state == PLACES_RUNNING) {
        pthread_join(p->thread, NULL);
        log_line(p->job.good ? LOG_NOTICE : LOG_ERR, "map: %s", p->job.message);
    }
    free(p->job.bytes.bytes);
    if (p->ended.ctx && p->ended.fd >= 0) {
        loop_remove(d->loop, &p->ended);
        close(p->ended.fd);
    }
}
