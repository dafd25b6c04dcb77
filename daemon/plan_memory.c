/* SPDX-License-Identifier: MIT */
/* plan_memory - see plan_memory.h. */
#include "plan_memory.h"

#include <math.h>

#include "core/fault.h"
#include "drivers/devices/device.h"
#include "grid/range/lost_echo.h"
#include "wiring.h"

static double of_sonar(enum plan_id id, const struct conf *conf, int i)
{
    const struct device_ops *ops = device_find(conf->sonar[i].device);
    struct cleanup_conf all = {.median = 3, .otsu = true, .clahe = true, .classes = true, .clip = 2}, asked;
    switch (id) {
    case PLAN_DEVICE:
        return (double)ops->state_size;
    case PLAN_EXTRACT:
        return (double)(extract_size(ops->max_bins) + sizeof(struct lost_echo));
    case PLAN_CLEANUP:
        wiring_cleanup(&conf->extract, &asked);
        return ops->max_bins > 1 && !ops->chooses
                   ? (double)cleanup_size(cleanup_wanted(&asked) ? &asked : &all, ops->max_bins)
                   : 0;
    case PLAN_MARKS:
        return (double)(sizeof(struct marks) + sizeof(struct own_echo));
    case PLAN_IMAGE:
        return (double)sizeof(struct image);
    default:
        return -1;
    }
}

static double of_grid(const struct conf *conf, struct conf_grid grid, int elevation, double relaxation)
{
    struct grid_setting setting;
    struct fault fault;
    grid.elevation = elevation;
    grid.relaxation = relaxation;
    wiring_grid(conf, &grid, &setting);
    return (double)sphere_bytes(&setting.sphere, &fault);
}

/* A level grid without relaxation is one stage; what elevations add is another, and what relaxation adds to either. */
static double of_grid_stage(const struct plan_stage *s, const struct conf *conf)
{
    const struct conf_grid *grid = s->which == 0 ? &conf->grid : &conf->more_grid[s->which - 1];
    const double level = of_grid(conf, *grid, CONF_ELEVATION_LEVEL, 0);
    switch (s->id) {
    case PLAN_GRID:
        return level;
    case PLAN_ELEVATION:
        return of_grid(conf, *grid, CONF_ELEVATION_FULL, 0) - level;
    case PLAN_RELAXATION:
        return of_grid(conf, *grid, grid->elevation, 1) - of_grid(conf, *grid, grid->elevation, 0);
    default:
        return 0;
    }
}

/* Of the main grid, once somebody asks. */
static double of_clusters(const struct conf *conf)
{
    struct grid_setting setting;
    struct rings rings;
    wiring_grid(conf, &conf->grid, &setting);
    return sphere_rings(&setting.sphere, &rings) ? (double)grid_looks_bytes(&rings, setting.sphere.max_cells) : -1;
}

static double of_records(const struct plan *plan, const struct conf *conf)
{
    struct pipeline_conf pipeline;
    wiring_pipeline(conf, plan, false, &pipeline);
    return (double)pipeline_records_bytes(&pipeline);
}

static double of_stage(const struct plan *plan, const struct plan_stage *s, const struct conf *conf)
{
    if (s->id <= PLAN_IMAGE)
        return of_sonar(s->id, conf, s->which);
    if (s->id >= PLAN_GRID && s->id <= PLAN_RELAXATION)
        return of_grid_stage(s, conf);
    if (s->id == PLAN_CLUSTERS)
        return of_clusters(conf);
    if (s->id == PLAN_RECORDS)
        return of_records(plan, conf);
    return s->id == PLAN_MAP && conf->map.voxel_m > 0 ? conf->map.memory_bytes : -1;
}

double plan_memory(const struct plan *plan, const struct conf *conf, double bytes[PLAN_STAGES_MAX])
{
    double sum = 0;
    for (int k = 0; k < plan->n; k++) {
        bytes[k] = of_stage(plan, &plan->stage[k], conf);
        sum += plan->stage[k].in ? fmax(bytes[k], 0) : 0;
    }
    return sum;
}
