/* SPDX-License-Identifier: MIT */
#include "wiring.h"

#include <math.h>
#include <string.h>

#include "drivers/devices/device.h"

/* Half the height of the single row that a level scene keeps: within the fan of any sonar that scans the horizon. */
#define LEVEL_HALF_DEG 7.5

/* The farthest echo lies a little beyond the range asked for: heads round it up, sound is a little slower. */
#define REACH_FACTOR 1.05
#define REACH_MORE_M 1.0

#define MASK_BLOCKS_MAX 65536

static void mount_of(const struct conf_sonar *c, struct mount *m)
{
    memcpy(m->position_m, c->mount_m, sizeof m->position_m);
    quat_from_rpy(c->rotation_rad[0], c->rotation_rad[1], c->rotation_rad[2], m->attitude);
}

void wiring_extract(const struct conf *conf, int i, struct extract_conf *e)
{
    const struct conf_extract *c = &conf->extract;
    const struct conf_sonar *sonar = &conf->sonar[i];
    static const enum cfar_detector detectors[] = {
        [CONF_CA] = CFAR_CA, [CONF_GOCA] = CFAR_GOCA, [CONF_SOCA] = CFAR_SOCA, [CONF_OS] = CFAR_OS};
    static const enum extract_no_echo rules[] = {[CONF_NO_ECHO_MINIMUM] = EXTRACT_MINIMUM,
                                                 [CONF_NO_ECHO_HEARD] = EXTRACT_HEARD,
                                                 [CONF_NO_ECHO_RANGE] = EXTRACT_RANGE};
    static const int laws[] = {[CONF_AMPLITUDE_AUTO] = EXTRACT_LAW_OF_PING,
                               [CONF_AMPLITUDE_LINEAR] = AMPLITUDE_LINEAR,
                               [CONF_AMPLITUDE_POWER] = AMPLITUDE_POWER,
                               [CONF_AMPLITUDE_SQRT] = AMPLITUDE_SQRT,
                               [CONF_AMPLITUDE_LOG] = AMPLITUDE_LOG};
    *e = (struct extract_conf){.detector = detectors[c->detector],
                               .order = c->order == CONF_ORDER_PAPER ? EXTRACT_PAPER : EXTRACT_SAFE,
                               .false_alarm = c->false_alarm,
                               .window_m = c->window_m,
                               .guard_m = c->guard_m,
                               .rank = c->rank,
                               .floor_counts = (uint32_t)c->floor_counts,
                               .min_contrast_db = c->min_contrast_db,
                               .no_echo = rules[c->no_echo],
                               .target_db = c->target_db,
                               .bottom_db = c->bottom_db,
                               .minimum_range_m = c->minimum_range_m,
                               .learn_ring_down = c->learn_ring_down == CONF_ON,
                               .ring_down_m = sonar->ring_down_m,
                               .law = laws[sonar->amplitude],
                               .db_per_count = sonar->db_per_count};
}

void wiring_cleanup(const struct conf_extract *c, struct cleanup_conf *out)
{
    static const unsigned medians[] = {[CONF_MEDIAN_OFF] = 0, [CONF_MEDIAN_3] = 3, [CONF_MEDIAN_5] = 5};
    *out = (struct cleanup_conf){.median = medians[c->median],
                                 .otsu = c->otsu == CONF_ON,
                                 .clahe = c->clahe == CONF_ON,
                                 .clip = c->clahe_clip,
                                 .classes = c->classes == CONF_ON,
                                 .survivors = c->order == CONF_ORDER_PAPER};
}

/* forget = auto: so that a reflector that every other scan misses goes on blocking */
#define FORGET_LEAST_S 160.0
#define FORGET_TURNS   2.5

#define NO_SONAR_REACH_M 1.0 /* of a grid in which nothing will ever stand */

static void sphere_of(const struct conf *conf, const struct conf_grid *g, struct sphere_conf *s)
{
    double reach = g->range_max_m > 0 ? g->range_max_m : conf->n_sonars ? 0 : NO_SONAR_REACH_M;
    for (int i = 0; i < conf->n_sonars && g->range_max_m <= 0; i++)
        reach = fmax(reach, conf->sonar[i].range_m * REACH_FACTOR + REACH_MORE_M);
    /* Thin layers until one that grows by the same share of its range would be as thick. */
    double thin = g->growth > 1 ? ceil(1 / (g->growth - 1)) : 0;
    *s = (struct sphere_conf){.angular_step_rad = g->angular_step_rad,
                              .level = g->elevation == CONF_ELEVATION_LEVEL,
                              .level_half_rad = geo_rad(LEVEL_HALF_DEG),
                              .layers = {.r_max_m = reach,
                                         .dr_m = g->layer_m,
                                         .n_const = (uint32_t)fmin(thin, 1000),
                                         .growth = g->growth},
                              .max_cells = (uint32_t)g->max_cells,
                              .forget_s = g->forget_s > 0 ? g->forget_s : fmax(FORGET_LEAST_S, g->clear_for_s),
                              .forget_turns = g->forget_s > 0 ? 0 : FORGET_TURNS,
                              .blocked_above = g->blocked_above,
                              .recentre_m = fmax(0.05, 2 * g->layer_m),
                              .model = (enum sphere_model)g->sensor_model, /* the same order */
                              .update = (enum sphere_update)g->update,
                              .axes = (enum sphere_axes)g->axes, /* the same order */
                              .range_error = g->range_error,
                              .mask_reach = g->mask_reach,
                              .cluster_relaxation = g->cluster_relaxation,
                              .relaxation = g->relaxation};
}

/* Of a vehicle of which nobody says how fast it is. */
#define UNSAID_MPS 3.0

void wiring_drift(const struct conf *conf, struct pose_drift *out)
{
    const struct conf_vehicle *v = &conf->vehicle;
    const bool keeps = v->keep_mps >= 0, said = v->max_speed_mps > 0;
    *out = (struct pose_drift){.mps = keeps  ? v->keep_mps
                                      : said ? v->max_speed_mps
                                             : UNSAID_MPS,
                               .from_pose = !keeps && !said,
                               .keeps_heading = keeps,
                               .bounded = v->keep_mps == CONF_KEEP_AUTO && v->current_mps >= 0,
                               .water_mps = fmax(v->current_mps, 0),
                               .heading_radps = conf->pose.heading_drift_radps};
}

void wiring_pose_delay(const struct conf *conf, struct pose_log *poses)
{
    pose_log_set_delay(poses, (uint64_t)(conf->pose.delay_s[0] * 1e9), (uint64_t)(conf->pose.delay_s[1] * 1e9));
}

void wiring_grid(const struct conf *conf, const struct conf_grid *grid, struct grid_setting *out)
{
    *out =
        (struct grid_setting){.limits = {.clear_for_s = grid->clear_for_s,
                                         .move_limit_m = grid->move_limit_m > 0 ? grid->move_limit_m : INFINITY}};
    snprintf(out->name, sizeof out->name, "%s", grid->name[0] ? grid->name : CONF_MAIN_GRID);
    sphere_of(conf, grid, &out->sphere);
}

bool wiring_grids_fit(const struct conf *conf, const char *name, double bytes, struct fault *fault)
{
    if (bytes <= conf->grids.memory_bytes)
        return true;
    return fault_set(fault,
                     "[grids] memory: with grid %s all grids together would take %.1f MiB; wanted at most %g MiB",
                     name, bytes / 1048576, conf->grids.memory_bytes / 1048576);
}

static bool check_grids(const struct conf *conf, const struct pipeline_conf *pipeline, struct fault *fault)
{
    double all = 0;
    for (int i = 0; i <= pipeline->n_more_grids; i++) {
        const struct grid_setting *grid = i == 0 ? &pipeline->grid : &pipeline->more_grid[i - 1];
        const size_t bytes = sphere_bytes(&grid->sphere, fault);
        all += (double)bytes;
        if (!bytes || !wiring_grids_fit(conf, grid->name, all, fault))
            return false;
    }
    return true;
}

static bool check_map(const struct conf *conf, const struct pipeline_conf *pipeline, struct fault *fault)
{
    const struct conf_map *c = &conf->map;
    const struct voxmap_setting *s = &pipeline->voxels;
    struct fault why;
    if (s->side == 0 || s->side > VOXMAP_MAX_SIDE)
        return fault_set(
            fault,
            "[map] extent: a submap has more than %u tiles of %d voxels along its side; use a smaller "
            "extent%s or larger voxels than %g m",
            VOXMAP_MAX_SIDE, TILE_SIDE, c->extent_m > 0 ? "" : ", submap_distance or range", c->voxel_m);
    if (c->tolerance_m > c->voxel_m)
        return fault_set(fault, "[map] tolerance: %g m; expected at most one voxel, %g m", c->tolerance_m,
                         c->voxel_m);
    return voxmap_bytes(s, &why) > 0 || fault_set(fault, "[map] %s", why.text);
}

bool wiring_check(const struct conf *conf, const struct pipeline_conf *pipeline, struct fault *fault)
{
    return check_grids(conf, pipeline, fault) && (!pipeline->map || check_map(conf, pipeline, fault));
}

/* Of the memory an eighth at most goes into directories and an eighth into answers, the rest into tiles. */
static void map_of(const struct conf *conf, double reach_m, struct pipeline_conf *out)
{
    const struct conf_map *c = &conf->map;
    struct voxmap_setting *s = &out->voxels;
    const double share = c->memory_bytes / 8, planes = c->echoes == CONF_ON ? 2 : 1;
    *s = (struct voxmap_setting){
        .voxel_m = c->voxel_m,
        .height = (uint32_t)ceil(c->height_m / c->voxel_m),
        .keep_echoes = c->echoes == CONF_ON,
        .rule = {.threshold = (uint16_t)c->threshold, .echo_weight = (uint16_t)c->echo_weight},
        .tolerance_m = c->tolerance_m,
        .opening = c->opening,
        .weight_levels = (uint8_t)c->weight_levels,
        .body_radius_m = c->body_m,
        .submap_path_m = c->submap_distance_m,
        .submap_ns = c->submap_time_s > 0 ? (uint64_t)(c->submap_time_s * 1e9) : VOXMAP_NEVER,
        .half_life_ns = c->forget_s > 0 ? (uint64_t)(c->forget_s * 1e9) : VOXMAP_NEVER};
    s->side = c->extent_m > 0 ? (uint32_t)ceil(c->extent_m / c->voxel_m / TILE_SIDE)
                              : voxmap_side(reach_m, c->submap_distance_m, c->voxel_m);
    const double directory = (double)submap_bytes(s->side, s->height) + sizeof(struct voxmap_part);
    s->max_submaps = (uint32_t)fmin(fmax(share / directory, 2), VOXMAP_MAX_SUBMAPS);
    out->mask_blocks = 1024;
    while (out->mask_blocks < MASK_BLOCKS_MAX && (double)voxmask_bytes(2 * out->mask_blocks) <= share)
        out->mask_blocks *= 2;
    const double left = c->memory_bytes - s->max_submaps * directory - (double)voxmask_bytes(out->mask_blocks);
    const double tiles = left - (double)residual_bytes(residual_cells((size_t)fmax(left, 0)));
    s->n_tiles = (uint32_t)fmin(fmax(tiles / (TILE_SIDE * TILE_SIDE * s->height * planes), 0), 1e9);
}

_Static_assert(CONF_MAX_QUEUE <= PIPELINE_QUEUE_MAX, "every buffer has room in a ring");

void wiring_pipeline(const struct conf *conf, const struct plan *plan, bool patient, struct pipeline_conf *out)
{
    *out = (struct pipeline_conf){.threads = conf->pipeline.threads,
                                  .queue = (uint32_t)conf->pipeline.queue,
                                  .patient = patient,
                                  .marks = plan_has(plan, PLAN_MARKS, 0),
                                  .sound_mps = conf->water.sound_speed_mps,
                                  .image = plan_has(plan, PLAN_IMAGE, 0),
                                  .max_beams = 1, /* where there is no sonar */
                                  .max_bins = 1,
                                  .max_samples = 1,
                                  .n_sensors = conf->n_sonars};
    for (int i = 0; i < conf->n_sonars; i++) {
        const struct device_ops *ops = device_find(conf->sonar[i].device);
        uint32_t samples = ops->max_beams * ops->max_bins;
        out->beams[i] = ops->max_beams;
        out->max_beams = ops->max_beams > out->max_beams ? ops->max_beams : out->max_beams;
        out->max_bins = ops->max_bins > out->max_bins ? ops->max_bins : out->max_bins;
        out->max_samples = samples > out->max_samples ? samples : out->max_samples;
        mount_of(&conf->sonar[i], &out->mount[i]);
        out->shape[i] = ops->round ? CAST_CONE : conf->map.beam ? CAST_PYRAMID : CAST_WEDGE;
        wiring_extract(conf, i, &out->extract[i]);
        if (plan_has(plan, PLAN_CLEANUP, i))
            wiring_cleanup(&conf->extract, &out->cleanup[i]);
    }
    wiring_grid(conf, &conf->grid, &out->grid);
    out->n_more_grids = conf->n_more_grids;
    for (int i = 0; i < conf->n_more_grids; i++)
        wiring_grid(conf, &conf->more_grid[i], &out->more_grid[i]);
    out->map = plan_has(plan, PLAN_MAP, 0);
    if (out->map)
        map_of(conf, out->grid.sphere.layers.r_max_m, out);
}
