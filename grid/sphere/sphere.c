/* SPDX-License-Identifier: MIT */
#include "sphere.h"

#include <math.h>
#include <string.h>

#include "grid/ping.h"
#include "course.h"
#include "motion.h"
#include "publish.h"
#include "relax.h"
#include "sensor.h"
#include "spread.h"

static size_t rounded(size_t n)
{
    return (n + 63) / 64 * 64;
}

/* Is there ever a direction to be relaxed? */
static bool relaxes(const struct sphere_conf *conf)
{
    return conf->relaxation > 0 || conf->cluster_relaxation > 0;
}

bool sphere_rings(const struct sphere_conf *c, struct rings *rings)
{
    return c->level ? rings_level(rings, c->angular_step_rad, c->level_half_rad)
                    : rings_full(rings, c->angular_step_rad);
}

size_t sphere_bytes(const struct sphere_conf *conf, struct fault *fault)
{
    struct rings rings;
    uint32_t layers = layers_count(&conf->layers);
    if (!sphere_rings(conf, &rings))
        fault_set(fault, "angular step of %g deg: wanted 0.25 to 90 deg", geo_deg(conf->angular_step_rad));
    else if (!layers || layers > LAYERS_MAX)
        fault_set(fault, "layers from %g to %g m, %g m thick, growth %g: wanted at most %u of them",
                  conf->layers.r_min_m, conf->layers.r_max_m, conf->layers.dr_m, conf->layers.growth, LAYERS_MAX);
    else if (conf->max_cells < 64 || conf->max_cells > 1u << 24)
        fault_set(fault, "%u cells: wanted 64 to 16777216", conf->max_cells);
    else if (!(conf->forget_s > 0 && conf->blocked_above > 0.5 && conf->blocked_above <= 0.99 &&
               conf->recentre_m > 0))
        fault_set(fault, "fading, threshold or recentring out of range");
    else if (!(conf->range_error >= 0 && conf->range_error <= 0.1))
        fault_set(fault, "range error of %g: wanted 0 to 0.1", conf->range_error);
    else if (conf->mask_reach != 0 && !(conf->mask_reach >= 1.2 && conf->mask_reach <= 4))
        fault_set(fault, "mask reach of %g standard deviations: wanted 1.2 to 4", conf->mask_reach);
    else if (!(conf->relaxation >= 0 && conf->relaxation <= 1))
        fault_set(fault, "relaxation of %g: wanted 0 to 1", conf->relaxation);
    else if (!(conf->cluster_relaxation >= 0 && conf->cluster_relaxation <= 1))
        fault_set(fault, "relaxation of clusters of %g: wanted 0 to 1", conf->cluster_relaxation);
    else
        return rounded(sizeof(struct sphere)) + rounded((layers + 1) * sizeof(double)) +
               rounded(cells_bytes(conf->max_cells, rings.n)) + rounded(rings.n * sizeof(struct direction)) +
               rounded(rings.n * sizeof(uint32_t)) + rounded(rings.n * sizeof(double[3])) +
               (conf->axes == SPHERE_COURSE
                    ? rounded(rings.n * sizeof(double[3])) + rounded(rings.n * sizeof(struct direction))
                    : 0) +
               rounded(rings.n_rings * sizeof(struct beam_cell)) +
               rounded(relaxes(conf) ? layers * sizeof(struct relaxed) : 0) + rounded(picture_bytes(rings.n));
    return 0;
}

static void *place(char **at, size_t n)
{
    void *p = *at;
    *at += rounded(n);
    return p;
}

static void forget_everything(struct sphere *s)
{
    cells_clear(&s->cells);
    s->nearest_m = INFINITY;
    s->n_dirty = s->rings.n;
    for (uint32_t d = 0, ring = 0; d < s->rings.n; d++) {
        ring += d == s->rings.start[ring + 1];
        s->direction[d] = (struct direction){.dirty = true, .ring = (uint16_t)ring};
        s->dirty[d] = d;
    }
    memset(s->turn_ms, 0, sizeof s->turn_ms);
    s->t_start_ns = s->t_centre_ns = 0;
    s->stats.pinged = 0;
    s->placed = false;
}

static void place_directions(struct sphere *s, double (*axis)[3])
{
    double az, el;
    for (uint32_t d = 0; d < s->rings.n; d++) {
        rings_centre(&s->rings, d, &az, &el);
        geo_direction(az, el, axis[d]);
    }
    for (uint32_t j = 0; j < s->rings.n_rings; j++) {
        rings_centre(&s->rings, s->rings.start[j], &az, &el);
        s->ring[j] = beam_cell_of(rings_width(&s->rings, j), s->rings.height_rad, el);
        s->widest_rad = fmax(s->widest_rad, s->ring[j].across_rad);
    }
    s->widest = (s->conf.mask_reach > 0 ? s->conf.mask_reach : 2) / SPREAD_HALF_POWER;
    s->reach_rad = rings_reach(&s->rings);
    s->nearer_share = cos(s->reach_rad);
}

/* From LOGODDS_MAX to blocked_logodds within what is set for heads that turn as they do. */
static double fade_s(const struct sphere *s)
{
    return sphere_forget_s(&s->conf, s->frame.turn_s) / log(LOGODDS_MAX / s->blocked_logodds);
}

struct sphere *sphere_init(void *memory, const struct sphere_conf *conf)
{
    char *at = memory;
    struct sphere *s = place(&at, sizeof *s);
    memset(s, 0, sizeof *s);
    s->conf = *conf;
    sphere_rings(conf, &s->rings);
    s->frame.recentre_m = conf->recentre_m;
    layers_init(&s->layers, &conf->layers, place(&at, (layers_count(&conf->layers) + 1) * sizeof(double)));
    cells_init(&s->cells, place(&at, cells_bytes(conf->max_cells, s->rings.n)), conf->max_cells, s->rings.n);
    s->direction = place(&at, s->rings.n * sizeof(struct direction));
    s->dirty = place(&at, s->rings.n * sizeof(uint32_t));
    double(*axis)[3] = place(&at, s->rings.n * sizeof *axis);
    s->axis = conf->axes == SPHERE_COURSE ? place(&at, s->rings.n * sizeof *axis) : axis;
    s->turned = conf->axes == SPHERE_COURSE ? place(&at, s->rings.n * sizeof *s->turned) : NULL;
    s->ring = place(&at, s->rings.n_rings * sizeof *s->ring);
    if (relaxes(conf))
        relax_init(s, place(&at, s->layers.n * sizeof(struct relaxed)));
    place_directions(s, axis);
    if (conf->axes == SPHERE_COURSE)
        memcpy(s->axis, axis, s->rings.n * sizeof *axis);
    s->blocked_logodds = log(conf->blocked_above / (1 - conf->blocked_above));
    s->fade_s = fade_s(s);
    picture_init(&s->picture, &s->rings, (const double(*)[3])axis, s->fade_s, s->blocked_logodds,
                 place(&at, picture_bytes(s->rings.n)));
    forget_everything(s);
    s->n_dirty = 0; /* the picture starts out the same */
    for (uint32_t d = 0; d < s->rings.n; d++)
        s->direction[d].dirty = false;
    return s;
}

struct picture *sphere_picture(struct sphere *s)
{
    return &s->picture;
}

void sphere_stats(const struct sphere *s, struct sphere_stats *out)
{
    *out = s->stats;
    out->cells = s->cells.used;
    out->directions = s->rings.n;
}

/* The attitude has jumped: in which directions the pings looked nobody knows. Echoes stay where they would be. */
static void heed_discontinuities(struct sphere *s, const struct pose *pose)
{
    if (pose->discontinuities == s->frame.discontinuities)
        return;
    s->frame.discontinuities = pose->discontinuities;
    s->stats.pinged = 0;
    for (uint32_t d = 0; d < s->rings.n; d++) {
        s->direction[d].t_look_ns = 0;
        state_mark(s, d);
    }
}

/* Poses were withdrawn: the axes are the body's until the next attitude, and nobody knows how they lay before. */
static void heed_withdrawal(struct sphere *s, const struct pose *pose)
{
    if (pose->withdrawn == s->frame.withdrawn)
        return;
    s->frame.withdrawn = pose->withdrawn;
    if (!s->frame.ned)
        return;
    forget_everything(s);
    s->frame.ned = 0;
    memset(s->frame.centre_m, 0, sizeof s->frame.centre_m);
    memset(s->anchor_m, 0, sizeof s->anchor_m);
    if (s->conf.axes == SPHERE_COURSE)
        course_end(s);
}

/* False when the ping cannot be placed. */
static bool set_axes(struct sphere *s, const struct pose *pose, uint64_t t_ns)
{
    heed_withdrawal(s, pose);
    if (pose->has & POSE_ATTITUDE) {
        if (!s->frame.ned) {
            forget_everything(s);
            s->frame.ned = 1;
        }
        heed_discontinuities(s, pose);
        motion_follow(s, pose, t_ns);
        if (s->conf.axes == SPHERE_COURSE)
            course_follow(s, pose);
        return true;
    }
    if (s->frame.ned)
        s->stats.no_attitude++;
    return !s->frame.ned;
}

#define WEEKS_MS (UINT32_C(1) << 31) /* 25 days */

/* Milliseconds in 32 bits last for 50 days: after 25 they are counted from 12 days later on.
 * What was before is as then. */
static void keep_counting(struct sphere *s, uint64_t t_ns)
{
    if (t_ns < s->t_start_ns + WEEKS_MS * UINT64_C(1000000))
        return;
    const uint64_t later_ms = (t_ns - s->t_start_ns) / 1000000 - WEEKS_MS / 2;
    s->t_start_ns += later_ms * 1000000;
    for (uint32_t i = 0; i < s->cells.room; i++) {
        uint32_t *first_ms = &s->cells.cell[i].t_first_ms;
        *first_ms = *first_ms > later_ms ? (uint32_t)(*first_ms - later_ms) : 0;
    }
    for (int k = 0; k < SPHERE_SENSORS; k++)
        s->turn_ms[k] = s->turn_ms[k] > later_ms ? (uint32_t)(s->turn_ms[k] - later_ms) : 0;
}

#define TURN_MOST_MS 600000u /* longer: the sonar was away */

/* A turn of that sensor is over: how long the longest of all sensors' last turns took. */
static void measure_turn(struct sphere *s, uint32_t sensor, uint32_t now_ms)
{
    const uint32_t took_ms = now_ms - s->turn_ms[sensor];
    if (!s->turn_ms[sensor] || took_ms > TURN_MOST_MS || s->away_sensors >> sensor & 1)
        return;
    s->turn_took_ms[sensor] = took_ms;
    uint32_t longest_ms = 0;
    for (int k = 0; k < SPHERE_SENSORS; k++)
        longest_ms = s->turn_took_ms[k] > longest_ms ? s->turn_took_ms[k] : longest_ms;
    s->frame.turn_s = longest_ms * 1e-3;
    s->fade_s = fade_s(s);
    picture_set_fade(&s->picture, s->fade_s);
}

static void begin_turn(struct sphere *s, const struct echoes *e)
{
    const uint32_t sensor = e->sensor % SPHERE_SENSORS;
    const uint64_t last_ns = s->bearings.sensor[e->sensor % BEARINGS_SENSORS].last_ns;
    if (!s->t_start_ns)
        s->t_start_ns = e->t_ns;
    keep_counting(s, e->t_ns);
    if (last_ns && e->t_ns > last_ns && e->t_ns - last_ns > BEARINGS_AWAY_NS)
        s->away_sensors |= UINT64_C(1) << sensor;
    if (!(e->flags & PING_NEW_TURN))
        return;
    measure_turn(s, sensor, state_ms(s, e->t_ns));
    s->turn_ms[sensor] = state_ms(s, e->t_ns);
    s->away_sensors &= ~(UINT64_C(1) << sensor);
    cells_forget_gone(&s->cells, sensor);
}

/* May the vehicle have gone there from the centre, by one pose after another? */
static bool is_near_centre(const struct sphere *s, const double position_m[3])
{
    double way_m[3];
    for (int i = 0; i < 3; i++)
        way_m[i] = position_m[i] - s->frame.centre_m[i];
    return geo_length(way_m) <= POSE_STEP_MOST_M;
}

void sphere_follow(struct sphere *s, const struct pose *pose)
{
    const uint64_t steps = s->stats.recentred;
    if (!s->frame.ned || s->drifts || pose->t_ns < s->frame.t_ping_ns ||
        pose->discontinuities != s->frame.discontinuities || pose->withdrawn != s->frame.withdrawn ||
        !is_near_centre(s, pose->position_m))
        return;
    motion_follow(s, pose, pose->t_ns);
    if (s->stats.recentred == steps)
        return;
    s->frame.path_m = pose->path_m;
    publish_changes(s, pose->t_ns);
}

void sphere_enter(struct sphere *s, const struct echoes *e, const struct mount *mount)
{
    s->heading_radps = e->pose.heading_radps;
    if (!set_axes(s, &e->pose, e->t_ns))
        return;
    motion_drifted(s, &e->pose);
    begin_turn(s, e);
    double turn[4], origin_m[3];
    memcpy(turn, mount->attitude, sizeof turn);
    memcpy(origin_m, mount->position_m, sizeof origin_m);
    if (s->frame.ned) {
        quat_multiply(e->pose.attitude, mount->attitude, turn);
        quat_rotate(e->pose.attitude, mount->position_m, origin_m);
        for (int i = 0; i < 3; i++)
            origin_m[i] += e->pose.position_m[i] - s->frame.centre_m[i];
    }
    sensor_enter(s, e, turn, origin_m);
    bearings_enter(&s->bearings, e, mount); /* of a vehicle that jumped, from there on */
    bearings_tell(&s->bearings, s->turn_took_ms, &s->frame.looks);
    publish_ping(s, e);
}

bool sphere_lock(struct sphere *s, uint32_t direction, double range_m, bool locked)
{
    int32_t layer = layers_index(&s->layers, range_m);
    if (direction >= s->rings.n || layer < 0)
        return false;
    uint32_t i = s->cells.first[direction];
    while (i != CELLS_NONE && s->cells.cell[i].layer != layer)
        i = s->cells.cell[i].next;
    if (i == CELLS_NONE)
        return false;
    s->cells.cell[i].state = locked ? CELL_LOCKED : CELL_LIVE;
    state_mark(s, direction);
    publish_changes(s, s->frame.t_ping_ns);
    return true;
}
