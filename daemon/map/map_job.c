/* SPDX-License-Identifier: MIT */
/* map_job - see map_job.h. */
#include "map_job.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "core/fault.h"
#include "grid/voxel/voxpage.h"
#include "map_export.h"
#include "map_steps.h"
#include "core/atomic_file.h"

#define BLOCKS 4096 /* of mask and frontier that an export keeps */
#define MIB    (1 << 20)

/* ---- the map's copy ---- */

static void drop_bytes(struct map_job *job)
{
    free(job->bytes.bytes);
    free(job->steps.residual);
    job->bytes = (struct map_bytes){0};
    job->steps.residual = NULL;
}

/* The pages of the room are faulted in here, not in the owner's thread, and not with zeros, of which a compiler may
 * make calloc, which touches nothing. The map grows until it is copied. */
static void make_room(void *map_job)
{
    struct map_job *job = map_job;
    struct map_steps *s = &job->steps;
    s->wanted += s->wanted / 8;
    uint8_t *room =
        map_file_begin(&job->bytes, &job->setting, &job->origin) ? map_file_room(&job->bytes, s->wanted) : NULL;
    s->residual = malloc(s->residual_size);
    job->good = room && s->residual;
    if (!job->good)
        return;
    memset(room, 0xff, s->wanted);
    memset(s->residual, 0xff, s->residual_size);
}

static bool end_copy(struct map_job *job)
{
    return map_file_end(&job->bytes, job->steps.residual, job->steps.residual_size);
}

static const char no_room[] = "no memory for a copy of the map";

/* ---- save and load ---- */

static void replace_file(struct map_job *job, const uint8_t *bytes, size_t size, size_t magic_bytes,
                         const char *done)
{
    struct fault fault;
    job->good = atomic_file_replace(job->path, bytes, size, magic_bytes, &fault);
    if (job->good)
        snprintf(job->message, sizeof job->message, "%s as %s", done, job->path);
    else
        snprintf(job->message, sizeof job->message, "%s", fault.text);
}

static void save(struct map_job *job)
{
    replace_file(job, job->bytes.bytes, job->bytes.size, MAP_FILE_MAGIC_BYTES, "saved");
}

/* Tiles of all submaps; the checksum is right, so a bad one is somebody's work. */
static bool count_tiles(struct map_job *job)
{
    struct map_page page = {0};
    job->tiles = 0;
    while (map_file_page(job->bytes.bytes, job->bytes.size, &page)) {
        const uint32_t n = voxpage_tiles(page.bytes, page.size);
        if (n == TILE_NONE || n > UINT32_MAX - job->tiles)
            return false;
        job->tiles += n;
    }
    return true;
}

static int is_map(const struct dirent *entry)
{
    const size_t n = strlen(entry->d_name);
    return n > 4 && strcmp(entry->d_name + n - 4, ".map") == 0;
}

/* A name that is none is mostly a slip: says which there are, as far as there is room. */
static void say_missing(struct map_job *job)
{
    struct dirent **entry;
    const int n = scandir(job->folder, &entry, is_map, alphasort);
    size_t used = (size_t)snprintf(job->message, sizeof job->message, "%s: no such map; there %s", job->path,
                                   n > 0 ? "are:" : "is none yet");
    for (int i = 0; i < n; i++) {
        if (used < sizeof job->message)
            used += (size_t)snprintf(job->message + used, sizeof job->message - used, " %.*s",
                                     (int)strlen(entry[i]->d_name) - 4, entry[i]->d_name);
        free(entry[i]);
    }
    if (n >= 0)
        free(entry);
}

/* Do its places count from where ours do? False with a sentence in why; true with one when nobody knows. */
static bool same_origin(const struct map_origin *ours, const struct map_origin *its, struct fault *why)
{
    why->text[0] = '\0';
    if (strcmp(ours->name, its->name) == 0) {
        if (!ours->name[0] && ours->run != its->run)
            fault_set(
                why, ", made by another run: right only if positions count from the same place (origin in [map])");
        return true;
    }
    return fault_set(why, "its places count from %s%.60s, this run's from %s%.60s: origin in [map]",
                     its->name[0] ? "" : "nobody knows where", its->name,
                     ours->name[0] ? "" : "nobody knows where", ours->name);
}

/* All of the file, no bytes with errno; nothing of what cannot be a map that fits: false with a sentence in fault. */
static bool read_map(struct map_job *job, struct fault *fault)
{
    uint8_t head[MAP_FILE_HEAD_BYTES];
    size_t got, size;
    if (!atomic_file_look(job->path, head, sizeof head, &got, &size))
        return true;
    if (map_file_check_head(head, got, size, &job->setting, fault) != MAP_GOOD)
        return false;
    job->bytes.bytes = atomic_file_read(job->path, map_file_most(&job->setting), &job->bytes.size);
    return true;
}

static void load(void *map_job)
{
    struct map_job *job = map_job;
    struct fault why;
    enum map_fault kind = MAP_UNREAD;
    if (!read_map(job, &why)) {
        snprintf(job->message, sizeof job->message, "%.300s: %.300s", job->path, why.text);
        return;
    }
    if (!job->bytes.bytes && errno == ENOENT) {
        say_missing(job);
        return;
    }
    if (!job->bytes.bytes) {
        snprintf(job->message, sizeof job->message, "%s: %s", job->path, strerror(errno));
        return;
    }
    kind = map_file_check(job->bytes.bytes, job->bytes.size, &job->setting, &job->pages, &why);
    if (kind == MAP_GOOD && !count_tiles(job)) {
        fault_set(&why, "the map is damaged: what should be a submap is none");
        kind = MAP_DAMAGED;
    }
    const struct map_origin its = kind == MAP_GOOD ? map_file_origin(job->bytes.bytes) : (struct map_origin){0};
    const uint32_t most = job->setting.n_tiles - job->setting.n_tiles / 4;
    if (kind == MAP_GOOD && (job->tiles > most || job->pages >= job->setting.max_submaps))
        fault_set(&why, "%u submap%s of %u tiles are more than memory in [map] allows: %u and %u", job->pages,
                  job->pages == 1 ? "" : "s", job->tiles, job->setting.max_submaps - 1, most);
    else if (kind == MAP_GOOD)
        job->good = same_origin(&job->origin, &its, &why);
    if (kind == MAP_DAMAGED)
        atomic_file_set_aside(job->path, &why);
    snprintf(job->message, sizeof job->message, job->good ? "loaded from %s%s" : "%s: %s", job->path, why.text);
}

/* ---- exports ---- */

/* The map anew, in memory of its own, so that nobody waits for an export. */
struct copy {
    struct voxmap map;
    struct voxmask mask;
    struct frontier frontier;
    void *memory[3];
};

static bool make_copy(struct map_job *job, struct copy *c, struct fault *fault)
{
    struct map_page page = {0};
    struct voxmap_setting s = job->setting;
    uint32_t pages = 0, n;
    *c = (struct copy){0};
    fault_set(fault, "the copy of the map is damaged");
    if (map_file_check(job->bytes.bytes, job->bytes.size, &s, &pages, fault) != MAP_GOOD || !count_tiles(job))
        return false;
    if (pages == 0 || job->tiles == 0)
        return fault_set(fault, "the map is empty");
    s.n_tiles = job->tiles;
    s.max_submaps = pages + 1;
    s.half_life_ns = VOXMAP_NEVER;
    const size_t size = voxmap_bytes(&s, fault);
    c->memory[0] = size ? malloc(size) : NULL;
    c->memory[1] = malloc(voxmask_bytes(BLOCKS));
    c->memory[2] = malloc(frontier_bytes(BLOCKS));
    if (!c->memory[0] || !c->memory[1] || !c->memory[2])
        return fault_set(fault, "no memory for an export: %zu MiB", size / MIB);
    voxmap_init(&c->map, &s, c->memory[0]);
    voxmask_init(&c->mask, &c->map, c->memory[1], BLOCKS);
    frontier_init(&c->frontier, &c->mask, c->memory[2], BLOCKS);
    while (map_file_page(job->bytes.bytes, job->bytes.size, &page))
        if (!voxpage_add(&c->map, page.bytes, page.size, fault))
            return false;
    const uint8_t *residual = map_file_residual(job->bytes.bytes, job->bytes.size, &n);
    if (residual)
        voxmap_join_residual(&c->map, residual, n);
    return true;
}

/* Made in memory, as the others are. */
static uint8_t *make_mcap(struct frontier *f, uint64_t t_unix_ns, size_t *size, struct fault *fault)
{
    const int fd = memfd_create("map", MFD_CLOEXEC), copy = fd >= 0 ? dup(fd) : -1;
    uint8_t *file = NULL;
    if (copy < 0) {
        fault_set(fault, "%s", strerror(errno));
        if (fd >= 0)
            close(fd);
        return NULL;
    }
    const bool ok = map_export_points(f, t_unix_ns, "sonard " SONARD_VERSION, fd, fault);
    const off_t n = ok ? lseek(copy, 0, SEEK_END) : 0;
    file = n > 0 ? malloc((size_t)n) : NULL;
    if (ok && (!file || pread(copy, file, (size_t)n, 0) != n)) {
        free(file);
        file = NULL;
        fault_set(fault, "out of memory");
    }
    *size = (size_t)n;
    close(copy);
    return file;
}

static uint8_t *make_export(const struct map_job *job, struct copy *copy, size_t *size, struct fault *fault)
{
    switch (job->format) {
    case MAP_SERVICE_MCAP:
        return make_mcap(&copy->frontier, job->t_unix_ns, size, fault);
    case MAP_SERVICE_BT:
        return map_export_octomap(&copy->mask, size, fault);
    case MAP_SERVICE_PLY:
        break;
    }
    return map_export_ply(&copy->frontier, size, fault);
}

static void export(struct map_job *job)
{
    static const size_t magic_bytes[] = {[MAP_SERVICE_PLY] = 4, [MAP_SERVICE_MCAP] = 8, [MAP_SERVICE_BT] = 16};
    struct copy copy;
    uint8_t *bytes = NULL;
    size_t size = 0;
    struct fault why;
    if (!make_copy(job, &copy, &why)) {
        snprintf(job->message, sizeof job->message, "%s: %.299s", job->path, why.text);
    } else if (!(bytes = make_export(job, &copy, &size, &why))) {
        snprintf(job->message, sizeof job->message, "%s: %.299s", job->path, why.text);
    } else {
        replace_file(job, bytes, size, magic_bytes[job->format], "exported");
    }
    free(bytes);
    for (int i = 0; i < 3; i++)
        free(copy.memory[i]);
}

static void write_copy(void *map_job)
{
    struct map_job *job = map_job;
    job->good = false;
    if (!end_copy(job))
        snprintf(job->message, sizeof job->message, "%s", no_room);
    else if (job->what == MAP_SERVICE_SAVE)
        save(job);
    else
        export(job);
}

/* ---- step by step ---- */

static struct map_job_step after(struct map_job *job, enum map_job_at at, pipeline_owner_fn *owner,
                                 void (*worker)(void *map_job))
{
    job->at = at;
    if (at == MAP_JOB_ENDED)
        drop_bytes(job);
    return (struct map_job_step){owner, worker};
}

static struct map_job_step measure_map(struct map_job *job)
{
    drop_bytes(job);
    return after(job, MAP_JOB_MEASURED, map_steps_measure, NULL);
}

static struct map_job_step end_job(struct map_job *job)
{
    return after(job, MAP_JOB_ENDED, NULL, NULL);
}

struct map_job_step map_job_next(struct map_job *job)
{
    switch (job->at) {
    case MAP_JOB_BEGUN:
        return job->what == MAP_SERVICE_LOAD ? after(job, MAP_JOB_READ, NULL, load) : measure_map(job);
    case MAP_JOB_MEASURED:
        return after(job, MAP_JOB_ROOM, NULL, make_room);
    case MAP_JOB_ROOM:
        if (job->good)
            return after(job, MAP_JOB_COPIED, map_steps_copy, NULL);
        snprintf(job->message, sizeof job->message, "%s", no_room);
        return end_job(job);
    case MAP_JOB_COPIED:
        return job->copied ? after(job, MAP_JOB_WRITTEN, NULL, write_copy) : measure_map(job);
    case MAP_JOB_READ:
        return job->good ? after(job, MAP_JOB_PUT_IN, map_steps_put_in, NULL) : end_job(job);
    case MAP_JOB_PUT_IN:
        job->good = job->steps.good;
        return end_job(job);
    case MAP_JOB_WRITTEN:
    case MAP_JOB_ENDED:
        break;
    }
    return end_job(job);
}
