/* SPDX-License-Identifier: MIT */
/* plan - see plan.h. */
#include "plan.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "drivers/devices/device.h"
#include "grid/geometry.h"

static void put_stage(struct plan *plan, enum plan_id id, int which, enum plan_proof proof, const char *why, ...)
    __attribute__((format(printf, 5, 6)));

/* PLAN_NONE: it is in. */
static void put_stage(struct plan *plan, enum plan_id id, int which, enum plan_proof proof, const char *why, ...)
{
    struct plan_stage *s = &plan->stage[plan->n++];
    va_list args;
    *s = (struct plan_stage){.id = id, .which = which, .in = proof == PLAN_NONE, .proof = proof};
    va_start(args, why);
    vsnprintf(s->why, sizeof s->why, why, args);
    va_end(args);
}

static bool has_server(const struct conf *conf)
{
    return strcmp(conf->server.socket, "none") != 0;
}

/* Images are made of single beams. */
static void put_cleanup(struct plan *plan, const struct conf_extract *c, const struct device_ops *ops, int i)
{
    if (c->median == CONF_MEDIAN_OFF && c->otsu == CONF_OFF && c->clahe == CONF_OFF && c->classes == CONF_OFF)
        put_stage(plan, PLAN_CLEANUP, i, PLAN_BOUNDED, "[extract] median, otsu, clahe and classes are off");
    else if (ops->max_beams != 1 || ops->max_bins <= 1 || ops->chooses)
        put_stage(plan, PLAN_CLEANUP, i, PLAN_IDENTICAL, "%s makes no image of single beams", ops->name);
    else
        put_stage(plan, PLAN_CLEANUP, i, PLAN_NONE, "[extract] asks for%s%s%s%s",
                  c->median != CONF_MEDIAN_OFF ? " median" : "", c->otsu == CONF_ON ? " otsu" : "",
                  c->clahe == CONF_ON ? " clahe" : "", c->classes == CONF_ON ? " classes" : "");
}

static void put_sonar(struct plan *plan, const struct conf *conf, int i)
{
    const struct conf_sonar *sonar = &conf->sonar[i];
    const struct device_ops *ops = device_find(sonar->device);
    plan->ranges[i] = device_key_find(ops, "amplitude") == NULL;
    put_stage(plan, PLAN_DEVICE, i, PLAN_NONE, "%s, up to %u x %u samples a ping", ops->name, ops->max_beams,
              ops->max_bins);
    if (ops->chooses)
        put_stage(plan, PLAN_EXTRACT, i, PLAN_NONE, "it sends the range that it has chosen in its intensities");
    else if (ops->max_bins > 1)
        put_stage(plan, PLAN_EXTRACT, i, PLAN_NONE, "it sends intensities");
    else
        put_stage(plan, PLAN_EXTRACT, i, PLAN_NONE, "it sends ready ranges: they are only checked");
    if (sonar->background[0])
        put_stage(plan, PLAN_BACKGROUND, i, PLAN_NONE, "[sonar %s] background names a template", sonar->name);
    else
        put_stage(plan, PLAN_BACKGROUND, i, PLAN_BOUNDED, "[sonar %s] background = none; made when one is learnt",
                  sonar->name);
    put_cleanup(plan, &conf->extract, ops, i);
    if (conf->extract.marks == CONF_ON)
        put_stage(plan, PLAN_MARKS, i, PLAN_NONE, "[extract] marks = on");
    else
        put_stage(plan, PLAN_MARKS, i, PLAN_BOUNDED, "[extract] marks = off");
    if (has_server(conf))
        put_stage(plan, PLAN_IMAGE, i, PLAN_NONE, "clients may ask for it");
    else
        put_stage(plan, PLAN_IMAGE, i, PLAN_IDENTICAL, "no socket: no client can ask for it");
}

static void put_grid(struct plan *plan, const struct conf_grid *grid, int which)
{
    const char *blank = grid->name[0] ? " " : "";
    put_stage(plan, PLAN_GRID, which, PLAN_NONE, "every answer about directions comes from it");
    if (grid->elevation == CONF_ELEVATION_FULL)
        put_stage(plan, PLAN_ELEVATION, which, PLAN_NONE, "[grid%s%s] elevation = full", blank, grid->name);
    else
        put_stage(plan, PLAN_ELEVATION, which, PLAN_BOUNDED,
                  "[grid%s%s] elevation = level: above and below are unknown", blank, grid->name);
    put_stage(plan, PLAN_MOTION, which, PLAN_NONE, "its centre follows the positions of the poses, if any");
    if (grid->relaxation > 0)
        put_stage(plan, PLAN_RELAXATION, which, PLAN_NONE, "[grid%s%s] relaxation = %g", blank, grid->name,
                  grid->relaxation);
    else
        put_stage(plan, PLAN_RELAXATION, which, PLAN_BOUNDED, "[grid%s%s] relaxation = 0", blank, grid->name);
}

static void put_map(struct plan *plan, const struct conf_map *map)
{
    if (map->voxel_m > 0)
        put_stage(plan, PLAN_MAP, 0, PLAN_NONE, "[map] voxel");
    else
        put_stage(plan, PLAN_MAP, 0, PLAN_BOUNDED, "[map] voxel = none: only directions are asked");
    if (map->voxel_m > 0 && map->directory[0])
        put_stage(plan, PLAN_SAVER, 0, PLAN_NONE, "[map] directory takes submaps when memory is low");
    else if (map->voxel_m > 0)
        put_stage(plan, PLAN_SAVER, 0, PLAN_BOUNDED, "[map] directory = none: the oldest submaps are forgotten");
    else
        put_stage(plan, PLAN_SAVER, 0, PLAN_IDENTICAL, "there is no map");
}

#define ROUND_RAD 1e-9 /* a sector that ends where it begins, but for rounding */

bool plan_is_steered(const struct conf *conf, int sonar)
{
    const struct conf_sonar *s = &conf->sonar[sonar];
    if (s->scan != CONF_SCAN_AUTO)
        return s->scan == CONF_SCAN_ACTIVE;
    return conf->vehicle.current_mps >= 0 && device_find(s->device)->steer && s->mode != CONF_MODE_TRANSMIT &&
           fabs(remainder(s->sector_rad[1] - s->sector_rad[0], GEO_TURN)) < ROUND_RAD;
}

static void put_process(struct plan *plan, const struct conf *conf)
{
    plan->steered = 0;
    for (int i = 0; i < conf->n_sonars; i++)
        plan->steered |= (uint64_t)plan_is_steered(conf, i) << i;
    if (plan->steered)
        put_stage(plan, PLAN_ACTIVE_SENSING, 0, PLAN_NONE, "[sonar NAME] scan = active, or auto");
    else
        put_stage(plan, PLAN_ACTIVE_SENSING, 0, PLAN_BOUNDED,
                  "no sonar has scan = active, or auto and could use it");
    if (conf->pipeline.threads > 0)
        put_stage(plan, PLAN_THREADS, 0, PLAN_NONE, "[pipeline] threads = %d", conf->pipeline.threads);
    else
        put_stage(plan, PLAN_THREADS, 0, PLAN_IDENTICAL,
                  "[pipeline] threads = 0: all work runs in the event loop");
    if (conf->record.directory[0])
        put_stage(plan, PLAN_RECORD, 0, PLAN_NONE, "[record] directory");
    else
        put_stage(plan, PLAN_RECORD, 0, PLAN_IDENTICAL, "[record] directory = none");
    if (has_server(conf))
        put_stage(plan, PLAN_SERVER, 0, PLAN_NONE, "[server] socket");
    else
        put_stage(plan, PLAN_SERVER, 0, PLAN_BOUNDED, "[server] socket = none: no clients");
}

void plan_make(const struct conf *conf, struct plan *plan)
{
    plan->n = 0;
    for (int i = 0; i < conf->n_sonars; i++)
        put_sonar(plan, conf, i);
    put_grid(plan, &conf->grid, 0);
    for (int i = 0; i < conf->n_more_grids; i++)
        put_grid(plan, &conf->more_grid[i], i + 1);
    put_stage(plan, PLAN_CLUSTERS, 0, PLAN_IDENTICAL, "made on request");
    put_stage(plan, PLAN_RECORDS, 0, PLAN_NONE, "what pings found free, for explain");
    put_map(plan, &conf->map);
    put_process(plan, conf);
}

bool plan_has(const struct plan *plan, enum plan_id id, int which)
{
    for (int i = 0; i < plan->n; i++)
        if (plan->stage[i].id == id && plan->stage[i].which == which)
            return plan->stage[i].in;
    return false;
}

const char *plan_name(enum plan_id id)
{
    static const char *const names[PLAN_IDS] = {[PLAN_DEVICE] = "device",
                                                [PLAN_EXTRACT] = "extract",
                                                [PLAN_BACKGROUND] = "background",
                                                [PLAN_CLEANUP] = "cleanup",
                                                [PLAN_MARKS] = "marks",
                                                [PLAN_IMAGE] = "image",
                                                [PLAN_GRID] = "grid",
                                                [PLAN_ELEVATION] = "elevation",
                                                [PLAN_MOTION] = "motion",
                                                [PLAN_RELAXATION] = "relaxation",
                                                [PLAN_CLUSTERS] = "clusters",
                                                [PLAN_RECORDS] = "records",
                                                [PLAN_MAP] = "map",
                                                [PLAN_SAVER] = "saver",
                                                [PLAN_ACTIVE_SENSING] = "sensing",
                                                [PLAN_THREADS] = "threads",
                                                [PLAN_RECORD] = "record",
                                                [PLAN_SERVER] = "server"};
    return names[id];
}

const char *plan_proof_name(enum plan_proof proof)
{
    static const char *const names[] = {
        [PLAN_NONE] = "-", [PLAN_IDENTICAL] = "identical", [PLAN_BOUNDED] = "bounded"};
    return names[proof];
}
