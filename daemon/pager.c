/* SPDX-License-Identifier: MIT */
/* pager - see pager.h. */
#include "pager.h"

#include <dirent.h>
#include <errno.h>
#include <fcntl.h>
#include <fnmatch.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../grid/voxel/merge.h"
#include "../grid/voxel/voxpage.h"
#include "daemon.h"
#include "whole_file.h"

#define LOOK_EVERY_NS 250000000u

void pager_path(const char *folder, uint64_t id, char *path, size_t size)
{
    /* a dot: no name that a client may give */
    snprintf(path, size, "%.*s/.page-%llu.map", CONF_TEXT_MAX, folder, (unsigned long long)id);
}

/* ---- the thread ---- */

static void write_page(struct pager *p)
{
    p->good = whole_file_replace(p->path, p->bytes.bytes, p->bytes.size, MAP_FILE_MAGIC_BYTES, p->message,
                                 sizeof p->message);
}

static void read_page(struct pager *p)
{
    uint32_t n = 0;
    char why[300];
    p->bytes.bytes = whole_file_read(p->path, MAP_FILE_MAX, &p->bytes.size);
    if (!p->bytes.bytes)
        snprintf(why, sizeof why, "%s", strerror(errno));
    else
        p->good =
            map_file_check(p->bytes.bytes, p->bytes.size, &p->setting, &n, why, sizeof why) == MAP_GOOD && n == 1;
    if (!p->good)
        snprintf(p->message, sizeof p->message, "%.280s: %.100s", p->path, why);
}

static void *page_thread(void *arg)
{
    struct pager *p = arg;
    const uint64_t one = 1;
    if (p->state == PAGER_WRITING)
        write_page(p);
    else
        read_page(p);
    while (write(p->ended.fd, &one, sizeof one) < 0 && errno == EINTR) {
    }
    return NULL;
}

/* ---- what to do next ---- */

/* How much a submap is needed here. */
enum need { NEED_NONE, NEED_NEAR, NEED_ASKED };

static bool speaks_of(const struct voxmap *map, const struct voxmap_part *part, const struct lattice_place *place)
{
    const struct block_key key = merge_block_of(place->cell);
    return merge_speaks_of(map, part, &key);
}

/* Within half a submap of the vehicle: there the beams of its pings lie. */
static bool is_near(const struct voxmap_part *part, const struct lattice_place *vehicle)
{
    for (int a = 0; a < 2; a++)
        if (llabs(vehicle->cell[a] - part->moved_to.cell[a]) > part->map.box.size[a] / 4)
            return false;
    return true;
}

/* What has no tile where the question or the vehicle is could answer nothing there. */
static enum need need_of(const struct pager_errand *v, const struct voxmap *map, const struct voxmap_part *part)
{
    const double voxel_m = map->set.voxel_m;
    struct lattice_place place;
    if (v->wanted && lattice_place(v->wanted_m, voxel_m, &place) && speaks_of(map, part, &place))
        return NEED_ASKED;
    return v->placed && lattice_place(v->vehicle_m, voxel_m, &place) && is_near(part, &place) &&
                   speaks_of(map, part, &place)
               ? NEED_NEAR
               : NEED_NONE;
}

/* Low: the oldest goes of those that are needed least. The newest that is needed most comes back if memory is not low with it;
 * else one that is needed less makes room. */
static void look(void *ctx, const struct pipeline_owned *owned)
{
    struct pager_errand *v = ctx;
    const struct voxmap *map = &owned->map->map;
    const bool low = voxmap_low(map);
    const struct voxmap_part *due = NULL, *idle = NULL;
    enum need most = NEED_NONE, least = NEED_NONE;
    for (uint32_t i = 0; i < map->set.max_submaps; i++) {
        const struct voxmap_part *part = &map->part[i];
        if (!part->id || part == map->current)
            continue;
        const enum need need = need_of(v, map, part);
        if (part->away && need > NEED_NONE && (need > most || (need == most && part->id > due->id))) {
            due = part;
            most = need;
        } else if (!part->away && (!idle || need < least || (need == least && part->id < idle->id))) {
            idle = part;
            least = need;
        }
    }
    v->due = due != NULL;
    if (!low && due && (uint64_t)due->map.n_tiles + map->tiles.n / 4 < map->tiles.n_free)
        v->in = due->id;
    else if (idle && (low || least < most))
        v->out = idle->id;
    v->size = v->out ? voxpage_bytes(map, v->out) : 0;
}

static void pack(void *ctx, const struct pipeline_owned *owned)
{
    struct pager_errand *v = ctx;
    v->size = voxpage_pack(&owned->map->map, v->id, 0, v->room, v->size);
}

static void detach(void *ctx, const struct pipeline_owned *owned)
{
    struct pager_errand *v = ctx;
    v->done = voxpage_detach(&owned->map->map, v->id);
}

static void attach(void *ctx, const struct pipeline_owned *owned)
{
    struct pager_errand *v = ctx;
    struct map_page page = {0};
    v->done = map_file_page(v->bytes->bytes, v->bytes->size, &page) &&
              voxpage_attach(&owned->map->map, v->id, page.bytes, page.size, v->err, sizeof v->err);
}

static void drop(void *ctx, const struct pipeline_owned *owned)
{
    struct pager_errand *v = ctx;
    v->done = voxmap_drop(&owned->map->map, v->id);
}

/* ---- step by step ---- */

static void fault(struct daemon *d, const char *what, const char *why)
{
    d->pager.errors++;
    log_limited(loop_now(d->loop), LOG_ERR, LOG_ABOUT(.event = "map_page_failed"), "map: %s: %s", what, why);
}

static void rest(struct pager *p)
{
    free(p->bytes.bytes);
    p->bytes = (struct map_bytes){0};
    p->state = PAGER_IDLE;
}

/* The owner does a step; `then` has the next, unless the pager has ended. */
static void step(struct daemon *d, enum pager_state state, pipeline_owner_fn *fn, void (*then)(void *ctx))
{
    d->pager.state = state;
    pipeline_errand_then(d->pipeline, &d->pager.errand.errand, fn, then);
}

static bool has_ended(const struct pager_errand *v)
{
    return v->errand.state != ERRAND_DONE;
}

static void on_taken_out(void *ctx)
{
    struct pager_errand *v = ctx;
    v->d->pager.out += v->done;
    rest(&v->d->pager);
}

static void on_taken_in(void *ctx)
{
    struct pager_errand *v = ctx;
    v->d->pager.in += v->done;
    rest(&v->d->pager);
}

static void on_dropped(void *ctx)
{
    struct pager_errand *v = ctx;
    rest(&v->d->pager);
}

/* The thread has done its part. */
static void settle(struct daemon *d)
{
    struct pager *p = &d->pager;
    const bool wrote = p->state == PAGER_WRITING;
    pthread_join(p->thread, NULL);
    p->errand = (struct pager_errand){.d = d, .id = p->id, .bytes = &p->bytes};
    if (!p->good)
        fault(d, wrote ? "a submap cannot be put away" : "a submap cannot be brought back", p->message);
    if (p->good)
        step(d, PAGER_TAKING, wrote ? detach : attach, wrote ? on_taken_out : on_taken_in);
    else if (wrote)
        rest(p);
    else
        step(d, PAGER_TAKING, drop, on_dropped); /* what it knew is lost, what it heard stays in the way */
}

static void begin(struct daemon *d, enum pager_state what, uint64_t id)
{
    struct pager *p = &d->pager;
    p->state = what;
    p->id = id;
    p->good = false;
    p->newest = id > p->newest ? id : p->newest;
    pager_path(d->conf.map.directory, id, p->path, sizeof p->path);
    if (pthread_create(&p->thread, NULL, page_thread, p) != 0) {
        rest(p);
        fault(d, "paging", "cannot start a thread");
    } else if (d->replay) {
        settle(d);
    }
}

/* A closed submap never changes: what was packed is what is detached later. It may have gone since the look. */
static void on_packed(void *ctx)
{
    struct pager_errand *v = ctx;
    struct pager *p = &v->d->pager;
    if (has_ended(v) || !v->size) {
        rest(p);
        return;
    }
    map_file_take(&p->bytes, v->size);
    if (map_file_end(&p->bytes, NULL, 0)) {
        begin(v->d, PAGER_WRITING, v->id);
    } else {
        rest(p);
        fault(v->d, "a submap cannot be put away", "out of memory");
    }
}

static void pack_page(struct daemon *d, uint64_t id, size_t size)
{
    struct pager *p = &d->pager;
    uint8_t *room =
        map_file_begin(&p->bytes, &p->setting, &d->places.origin) ? map_file_room(&p->bytes, size) : NULL;
    if (!room) {
        rest(p);
        fault(d, "a submap cannot be put away", "out of memory");
        return;
    }
    memset(room, 0, size); /* its pages are faulted in here, not in the owner's thread */
    p->errand = (struct pager_errand){.d = d, .id = id, .room = room, .size = size};
    step(d, PAGER_PACKING, pack, on_packed);
}

/* A place that was asked for meanwhile is more wanted than the one before. */
static void on_looked(void *ctx)
{
    const struct pager_errand *v = ctx;
    struct daemon *d = v->d;
    struct pager *p = &d->pager;
    if (v->wanted && v->due && (v->in || v->out) && !p->wanted)
        pager_want(d, v->wanted_m);
    if (has_ended(v) || (!v->in && !v->size))
        rest(p);
    else if (v->in)
        begin(d, PAGER_READING, v->in);
    else
        pack_page(d, v->out, v->size);
}

static void on_timer(void *ctx, uint64_t now_ns)
{
    struct daemon *d = ctx;
    struct pager *p = &d->pager;
    struct pose pose;
    loop_arm(d->loop, &p->timer, now_ns + LOOK_EVERY_NS);
    if (p->state != PAGER_IDLE)
        return;
    p->errand = (struct pager_errand){.d = d, .wanted = p->wanted};
    p->errand.placed = pose_log_newest(&d->poses, &pose) && (pose.has & POSE_POSITION);
    memcpy(p->errand.vehicle_m, pose.position_m, sizeof pose.position_m);
    memcpy(p->errand.wanted_m, p->wanted_m, sizeof p->wanted_m);
    p->wanted = false;
    step(d, PAGER_LOOKING, look, on_looked);
}

static void on_ended(void *ctx, uint32_t events, uint64_t now_ns)
{
    struct daemon *d = ctx;
    uint64_t n;
    (void)events;
    (void)now_ns;
    const enum pager_state state = d->pager.state;
    if (read(d->pager.ended.fd, &n, sizeof n) == sizeof n && (state == PAGER_WRITING || state == PAGER_READING))
        settle(d);
}

/* ---- start and end ---- */

static int is_page(const struct dirent *entry)
{
    return fnmatch(".page-*.map", entry->d_name, 0) == 0 || fnmatch(".page-*.map.new", entry->d_name, 0) == 0;
}

/* Pages that a run left behind which did not end as it should: they are of no use to any other. */
static void remove_leftovers(struct pager *p, const char *folder)
{
    struct dirent **entry;
    const int n = scandir(folder, &entry, is_page, NULL);
    for (int i = 0; i < n; i++) {
        snprintf(p->path, sizeof p->path, "%.*s/%.39s", CONF_TEXT_MAX - 1, folder, entry[i]->d_name);
        unlink(p->path);
        free(entry[i]);
    }
    if (n > 0)
        log_line(LOG_NOTICE, "map_pages_removed", "map: %s: removed %d pages of an earlier run", folder, n);
    if (n >= 0)
        free(entry);
}

/* Pages of two daemons in one folder would overwrite each other. False: another daemon has it. A folder that cannot be
 * written to holds no pages. */
static bool lock_folder(struct pager *p, const char *folder, char *err, size_t err_size)
{
    snprintf(p->path, sizeof p->path, "%.*s/.lock", CONF_TEXT_MAX, folder);
    p->lock = open(p->path, O_RDWR | O_CREAT | O_CLOEXEC, 0640);
    if (p->lock < 0)
        return true;
    if (flock(p->lock, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        snprintf(err, err_size,
                 "map: another sonard uses the folder %.300s: want another directory in [map], or end it", folder);
        close(p->lock);
        return false;
    }
    remove_leftovers(p, folder);
    return true;
}

bool pager_start(struct daemon *d, char *err, size_t err_size)
{
    struct pager *p = &d->pager;
    p->ended = (struct loop_fd){.fd = -1, .ready = on_ended, .ctx = d};
    if (!pipeline_has_map(d->pipeline) || !d->conf.map.directory[0])
        return true;
    if (mkdir(d->conf.map.directory, 0750) != 0 && errno != EEXIST)
        log_line(LOG_WARNING, "map_failed", "map: nothing can be saved or put away: making the folder %s: %s",
                 d->conf.map.directory, strerror(errno));
    if (!lock_folder(p, d->conf.map.directory, err, err_size))
        return false;
    p->setting = pipeline_map_setting(d->pipeline);
    p->timer = (struct loop_timer){.fire = on_timer, .ctx = d};
    p->ended.fd = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
    if (p->ended.fd < 0 || !loop_add(d->loop, &p->ended, EPOLLIN)) {
        snprintf(err, err_size, "map: %s", strerror(errno));
        return false;
    }
    loop_arm(d->loop, &p->timer, loop_now(d->loop) + LOOK_EVERY_NS);
    return true;
}

void pager_want(struct daemon *d, const double place_m[3])
{
    d->pager.wanted = true;
    memcpy(d->pager.wanted_m, place_m, sizeof d->pager.wanted_m);
}

void pager_end(struct daemon *d)
{
    struct pager *p = &d->pager;
    if (!p->timer.fire)
        return;
    loop_arm(d->loop, &p->timer, LOOP_NEVER);
    if (p->state == PAGER_WRITING || p->state == PAGER_READING)
        pthread_join(p->thread, NULL);
    free(p->bytes.bytes);
    for (uint64_t id = 1; id <= p->newest; id++) {
        pager_path(d->conf.map.directory, id, p->path, sizeof p->path);
        unlink(p->path);
    }
    loop_remove(d->loop, &p->ended);
    close(p->ended.fd);
    if (p->lock >= 0)
        close(p->lock);
}
