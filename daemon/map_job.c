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

#include "../drivers/mcap.h"
#include "../grid/voxel/voxpage.h"
#include "map_export.h"
#include "map_steps.h"
#include "pager.h"
#include "whole_file.h"

#define BLOCKS 4096 /* of mask and frontier that an export keeps */
#define MIB    (1 << 20)

/* ---- the map's copy ---- */

static void drop_bytes(struct places_job *job)
{
    free(job->bytes.bytes);
    free(job->steps.veil);
    job->bytes = (struct map_bytes){0};
    job->steps.veil = NULL;
}

/* The pages of the room are faulted in here, not in the owner's thread, and not with zeros, of which a compiler may make
 * calloc, which touches nothing. The map grows until it is copied. */
static bool make_room(struct places_job *job)
{
    struct map_steps *s = &job->steps;
    s->wanted += s->wanted / 8;
    uint8_t *room = map_file_begin(&job->bytes, &job->setting, &job->origin) ? map_file_room(&job->bytes, s->wanted)
                                                                             : NULL;
    s->veil = malloc(s->veil_size);
    if (!room || !s->veil)
        return false;
    memset(room, 0xff, s->wanted);
    memset(s->veil, 0xff, s->veil_size);
    return true;
}

/* What of the map is in memory. */
static bool copy_map(struct places_job *job)
{
    while (!job->copied) {
        drop_bytes(job);
        job->ask(job, map_steps_measure);
        if (!make_room(job))
            break;
        job->ask(job, map_steps_copy);
    }
    if (job->copied && map_file_end(&job->bytes, job->steps.veil, job->steps.veil_size))
        return true;
    snprintf(job->message, sizeof job->message, "no memory for a copy of the map");
    return false;
}

/* ---- save and load ---- */

static bool append_page(struct map_bytes *to, const struct map_page *page)
{
    uint8_t *room = map_file_room(to, page->size);
    if (!room)
        return false;
    memcpy(room, page->bytes, page->size);
    map_file_take(to, page->size);
    return true;
}

/* All submaps of a map's bytes. */
static bool append_map(struct map_bytes *to, const struct map_bytes *from)
{
    struct map_page page = {0};
    while (map_file_page(from->bytes, from->size, &page))
        if (!append_page(to, &page))
            return false;
    return true;
}

/* Its page is as old as its paging out: it has aged since, and may have been moved, which its new head says. */
static bool append_away(struct places_job *job, struct map_bytes *to, const struct places_submap *submap)
{
    char path[CONF_TEXT_MAX + 40], why[300] = "out of memory";
    struct map_bytes file = {0};
    struct map_page page = {0};
    uint32_t n;
    pager_path(job->folder, submap->id, path, sizeof path);
    file.bytes = whole_file_read(path, MAP_FILE_MAX, &file.size);
    if (!file.bytes)
        snprintf(why, sizeof why, "%s", strerror(errno));
    bool good = file.bytes &&
                map_file_check(file.bytes, file.size, &job->setting, &n, why, sizeof why) == MAP_GOOD &&
                map_file_page(file.bytes, file.size, &page) && page.size >= sizeof submap->head;
    if (good) {
        memcpy(file.bytes + (page.bytes - file.bytes), submap->head, sizeof submap->head);
        good = append_page(to, &page);
    }
    if (!good)
        snprintf(job->message, sizeof job->message, "%s: a part of the map that is on disk: %s", path, why);
    free(file.bytes);
    return good;
}

/* What the pager has put away belongs to the map as well. False: it cannot be had, and the job fails. */
static bool have_map(struct places_job *job)
{
    struct map_bytes all;
    if (!copy_map(job))
        return false;
    if (!job->n_away)
        return true;
    bool good = map_file_begin(&all, &job->setting, &job->origin);
    snprintf(job->message, sizeof job->message, "no memory for a copy of the map");
    for (uint32_t i = 0; good && i < job->n_away; i++)
        good = append_away(job, &all, &job->away[i]);
    uint32_t n;
    const uint8_t *veil = map_file_veil(job->bytes.bytes, job->bytes.size, &n);
    if (good && append_map(&all, &job->bytes) && map_file_end(&all, veil, n)) {
        free(job->bytes.bytes);
        job->bytes = all;
        return true;
    }
    free(all.bytes);
    return false;
}

static void save(struct places_job *job)
{
    if (!have_map(job))
        return;
    job->good = whole_file_replace(job->path, job->bytes.bytes, job->bytes.size, MAP_FILE_MAGIC_BYTES,
                                   job->message, sizeof job->message);
    if (job->good)
        snprintf(job->message, sizeof job->message, "saved as %s", job->path);
}

/* Tiles of all submaps; the checksum is right, so a bad one is somebody's work. */
static bool count_tiles(struct places_job *job)
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
static void say_missing(struct places_job *job)
{
    struct dirent **entry;
    const int n = scandir(job->folder, &entry, is_map, alphasort);
    size_t used = (size_t)snprintf(job->message, sizeof job->message, "%s: there is no such map; there %s",
                                   job->path, n > 0 ? "are:" : "is none yet");
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
static bool same_origin(const struct map_origin *ours, const struct map_origin *its, char *why, size_t why_size)
{
    *why = '\0';
    if (strcmp(ours->name, its->name) == 0) {
        if (!ours->name[0] && ours->run != its->run)
            snprintf(why, why_size,
                     ", made by another run: right only if positions count from the same place (origin in [map])");
        return true;
    }
    snprintf(why, why_size, "its places count from %s%.60s, ours from %s%.60s: origin in [map]",
             its->name[0] ? "" : "nobody knows where", its->name, ours->name[0] ? "" : "nobody knows where",
             ours->name);
    return false;
}

static void load(struct places_job *job)
{
    char why[280];
    enum map_fault fault = MAP_UNREAD;
    job->bytes.bytes = whole_file_read(job->path, MAP_FILE_MAX, &job->bytes.size);
    if (!job->bytes.bytes && errno == ENOENT) {
        say_missing(job);
        return;
    }
    if (!job->bytes.bytes) {
        snprintf(job->message, sizeof job->message, "%s: %s", job->path, strerror(errno));
        return;
    }
    fault = map_file_check(job->bytes.bytes, job->bytes.size, &job->setting, &job->pages, why, sizeof why);
    if (fault == MAP_GOOD && !count_tiles(job)) {
        snprintf(why, sizeof why, "the map is damaged: what should be a submap is none");
        fault = MAP_DAMAGED;
    }
    const struct map_origin its = fault == MAP_GOOD ? map_file_origin(job->bytes.bytes) : (struct map_origin){0};
    const uint32_t most = job->setting.n_tiles - job->setting.n_tiles / 4;
    if (fault == MAP_GOOD && (job->tiles > most || job->pages >= job->setting.max_submaps))
        snprintf(why, sizeof why, "%u submap%s of %u tiles are more than memory in [map] allows: %u and %u",
                 job->pages, job->pages == 1 ? "" : "s", job->tiles, job->setting.max_submaps - 1, most);
    else if (fault == MAP_GOOD)
        job->good = same_origin(&job->origin, &its, why, sizeof why);
    snprintf(job->message, sizeof job->message, job->good ? "loaded from %s%s" : "%s: %s", job->path, why);
    if (fault == MAP_DAMAGED)
        whole_file_set_aside(job->path, job->message, sizeof job->message);
    if (job->good)
        job->ask(job, map_steps_put_in);
    job->good &= job->steps.good;
}

/* ---- exports ---- */

/* The map anew, in memory of its own, so that nobody waits for an export. */
struct copy {
    struct voxmap map;
    struct voxmask mask;
    struct frontier frontier;
    void *memory[3];
};

static bool make_copy(struct places_job *job, struct copy *c, char *err, size_t err_size)
{
    struct map_page page = {0};
    struct voxmap_setting s = job->setting;
    uint32_t pages = 0, n;
    *c = (struct copy){0};
    snprintf(err, err_size, "the copy of the map is no map");
    if (map_file_check(job->bytes.bytes, job->bytes.size, &s, &pages, err, err_size) != MAP_GOOD ||
        !count_tiles(job))
        return false;
    if (pages == 0 || job->tiles == 0) {
        snprintf(err, err_size, "nothing is in the map yet");
        return false;
    }
    s.n_tiles = job->tiles;
    s.max_submaps = pages + 1;
    s.half_life_ns = VOXMAP_NEVER;
    const size_t size = voxmap_bytes(&s, err, err_size);
    c->memory[0] = size ? malloc(size) : NULL;
    c->memory[1] = malloc(voxmask_bytes(BLOCKS));
    c->memory[2] = malloc(frontier_bytes(BLOCKS));
    if (!c->memory[0] || !c->memory[1] || !c->memory[2]) {
        snprintf(err, err_size, "no memory for an export: %zu MiB", size / MIB);
        return false;
    }
    voxmap_init(&c->map, &s, c->memory[0]);
    voxmask_init(&c->mask, &c->map, c->memory[1], BLOCKS);
    frontier_init(&c->frontier, &c->mask, c->memory[2], BLOCKS);
    while (map_file_page(job->bytes.bytes, job->bytes.size, &page))
        if (!voxpage_add(&c->map, page.bytes, page.size, err, err_size))
            return false;
    const uint8_t *veil = map_file_veil(job->bytes.bytes, job->bytes.size, &n);
    if (veil)
        voxmap_join_veil(&c->map, veil, n);
    return true;
}

/* One message in a file of its own: made in memory, as the others are. */
static uint8_t *make_mcap(struct frontier *f, uint64_t t_unix_ns, size_t *size, char *err, size_t err_size)
{
    uint8_t *json = map_export_points(f, t_unix_ns, size, err, err_size), *file = NULL;
    const int fd = json ? memfd_create("map", MFD_CLOEXEC) : -1, copy = fd >= 0 ? dup(fd) : -1;
    const struct mcap_options options = {.library = "sonard " SONARD_VERSION,
                                         .compression = MCAP_ZSTD,
                                         .message_bytes = *size > MCAP_MESSAGE_BYTES ? *size : MCAP_MESSAGE_BYTES};
    struct mcap_writer *w = copy >= 0 ? mcap_create(fd, &options, err, err_size) : NULL;
    if (json && copy < 0)
        snprintf(err, err_size, "%s", strerror(errno));
    if (w) {
        const int schema =
            mcap_add_schema(w, "foxglove.PointCloud", "jsonschema", map_export_points_schema, err, err_size);
        const int channel =
            schema > 0 ? mcap_add_channel_of(w, schema, "/map/surface", "json", NULL, 0, err, err_size) : -1;
        char more[256];
        bool ok =
            channel >= 0 && mcap_write_message(w, channel, 0, t_unix_ns, t_unix_ns, json, *size, err, err_size);
        ok = mcap_finish(w, ok ? err : more, ok ? err_size : sizeof more) && ok;
        const off_t n = ok ? lseek(copy, 0, SEEK_END) : 0;
        file = n > 0 ? malloc((size_t)n) : NULL;
        if (ok && (!file || pread(copy, file, (size_t)n, 0) != n)) {
            free(file);
            file = NULL;
            snprintf(err, err_size, "out of memory");
        }
        *size = (size_t)n;
    }
    if (copy >= 0)
        close(copy);
    free(json);
    return file;
}

static uint8_t *make_export(const struct places_job *job, struct copy *copy, size_t *size, char *err,
                            size_t err_size)
{
    switch (job->format) {
    case PLACES_MCAP:
        return make_mcap(&copy->frontier, job->t_unix_ns, size, err, err_size);
    case PLACES_BT:
        return map_export_octomap(&copy->mask, size, err, err_size);
    case PLACES_PLY:
        break;
    }
    return map_export_ply(&copy->frontier, size, err, err_size);
}

static void export(struct places_job *job)
{
    static const size_t magic_bytes[] = {[PLACES_PLY] = 4, [PLACES_MCAP] = 8, [PLACES_BT] = 16};
    struct copy copy;
    uint8_t *bytes = NULL;
    size_t size = 0;
    char why[300];
    if (!have_map(job))
        return;
    if (!make_copy(job, &copy, why, sizeof why)) {
        snprintf(job->message, sizeof job->message, "%s: %s", job->path, why);
    } else if (!(bytes = make_export(job, &copy, &size, why, sizeof why))) {
        snprintf(job->message, sizeof job->message, "%s: %s", job->path, why);
    } else {
        job->good = whole_file_replace(job->path, bytes, size, magic_bytes[job->format], job->message,
                                       sizeof job->message);
        if (job->good)
            snprintf(job->message, sizeof job->message, "exported as %s", job->path);
    }
    free(bytes);
    for (int i = 0; i < 3; i++)
        free(copy.memory[i]);
}

void map_job_run(struct places_job *job)
{
    switch (job->what) {
    case PLACES_SAVE:
        save(job);
        break;
    case PLACES_LOAD:
        load(job);
        break;
    case PLACES_EXPORT:
        export(job);
        break;
    }
    drop_bytes(job);
}
