/* SPDX-License-Identifier: MIT */
/* map_steps - see map_steps.h. */
#include "map_steps.h"

#include <stdio.h>
#include <string.h>

/* ---- a copy ---- */

/* Ids of the submaps, oldest first. */
static uint32_t list_submaps(const struct voxmap *map, uint64_t id[VOXMAP_MAX_SUBMAPS])
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < map->set.max_submaps; i++) {
        const struct voxmap_part *part = &map->part[i];
        uint32_t at = n;
        if (!part->id)
            continue;
        for (; at > 0 && id[at - 1] > part->id; at--)
            id[at] = id[at - 1];
        id[at] = part->id;
        n++;
    }
    return n;
}

void map_steps_measure(void *map_job, const struct pipeline_owned *owned)
{
    struct map_job *job = map_job;
    struct map_steps *s = &job->steps;
    const struct voxmap *map = &owned->map->map;
    *s = (struct map_steps){.residual_size = map->residual.n};
    s->n = list_submaps(map, s->id);
    for (uint32_t i = 0; i < s->n; i++)
        s->wanted += map_file_bytes(voxpage_bytes(map, s->id[i]));
}

static void begin_copy(struct map_job *job, struct voxmap *map)
{
    struct map_steps *s = &job->steps;
    voxmap_pass(map, job->now_ns);
    s->n = list_submaps(map, s->id);
    s->started = true;
}

/* Pings may have made the map forget it meanwhile. False: the room is too small. */
static bool copy_submap(struct map_job *job, const struct voxmap *map, uint64_t id)
{
    const size_t size = voxpage_bytes(map, id);
    if (!size)
        return true;
    if (map_file_bytes(size) > job->steps.wanted)
        return false;
    job->steps.wanted -= map_file_bytes(size);
    map_file_take(&job->bytes, voxpage_pack(map, id, 0, map_file_room(&job->bytes, size), size));
    return true;
}

/* The residual is last, so that nothing is missing which a submap has lost meanwhile. */
static void end_copy(struct map_job *job, const struct voxmap *map)
{
    if (map->residual.any)
        memcpy(job->steps.residual, map->residual.count, map->residual.n);
    else
        job->steps.residual_size = 0;
    job->copied = true;
}

void map_steps_copy(void *map_job, const struct pipeline_owned *owned)
{
    struct map_job *job = map_job;
    struct map_steps *s = &job->steps;
    struct voxmap *map = &owned->map->map;
    if (!s->started)
        begin_copy(job, map);
    if (s->next == s->n)
        end_copy(job, map);
    else
        job->call.more = copy_submap(job, map, s->id[s->next++]);
}

/* ---- put in ---- */

/* Is every submap of the file of the map's kind? Told before anything is cleared for it. */
static bool is_alike(struct map_job *job, const struct voxmap *map)
{
    struct map_page page = {0};
    const char *why = NULL;
    while (!why && map_file_page(job->bytes.bytes, job->bytes.size, &page))
        why = voxpage_unlike(map, page.bytes, page.size);
    if (why)
        snprintf(job->message, sizeof job->message, "%.300s: %.250s", job->path, why);
    return !why;
}

void map_steps_put_in(void *map_job, const struct pipeline_owned *owned)
{
    struct map_job *job = map_job;
    struct map_steps *s = &job->steps;
    struct voxmap *map = &owned->map->map;
    struct fault why;
    if (!s->started) {
        if (!is_alike(job, map))
            return;
        voxmap_clear(map);
        voxmap_hold(map, true,
                    job->now_ns); /* poses may count from elsewhere than what is put in: the loop knows */
        *s = (struct map_steps){.started = true, .good = true};
    }
    if (map_file_page(job->bytes.bytes, job->bytes.size, &s->page)) {
        s->good = voxpage_add(map, s->page.bytes, s->page.size, &why) != 0;
        job->call.more = s->good;
    } else {
        const uint8_t *residual = map_file_residual(job->bytes.bytes, job->bytes.size, &s->residual_size);
        if (residual)
            voxmap_join_residual(map, residual, s->residual_size);
    }
    if (!s->good) {
        voxmap_clear(map);
        snprintf(job->message, sizeof job->message, "%.300s: %.250s; the map is empty now", job->path, why.text);
    }
}
