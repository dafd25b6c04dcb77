/* SPDX-License-Identifier: MIT */
/* plan_cost - see plan_cost.h. tests/report/report_plan.c counts the same stages anew; the report has both. */
#include "plan_cost.h"

#include <math.h>
#include <string.h>

#include "../drivers/device.h"
#include "../grid/sphere/clusters.h"
#include "wiring.h"

/* Instructions for one bin: what tests/bench/plan_error.py counts on pings between walls and on noise; of the template, on the
 * former only. */
#define SOCA_BIN       84.0
#define CA_BIN         72.0
#define OS_BIN         1290.0
#define IMAGE_BIN      20.5
#define CLEANUP_BIN    30.0
#define OTSU_BIN       12.0
#define CLAHE_BIN      30.0
#define CLASSES_BIN    32.0
#define MEDIAN3_BIN    12.0
#define MEDIAN5_BIN    40.0
#define BACKGROUND_BIN 110.0 /* quiet beams are no longer done at once */

/* For one beam, and for one direction that a beam covers: what tests/bench/plan_error.py counts. */
#define EXTRACT_BEAM       300.0
#define CLAHE_BEAM         40000.0
#define IMAGE_BEAM         600.0
#define MARKS_BEAM         600.0
#define MARKS_WIDTH        1700.0 /* for a radian of the beam's width */
#define GRID_BEAM          12000.0
#define OPENING_DIRECTION  2400.0
#define MIDPOINT_DIRECTION 10500.0
#define GAUSS_DIRECTION    12500.0
#define RELAXED_DIRECTION  2100.0
#define TOUCHED_DIRECTION  700.0 /* no beam frees it: only its neighbours are marked */

/* The models with weak skirts find more echoes in a direction, the wider the beam: by this share for a radian of it. */
#define SKIRTS_WIDER 1.1

/* For one beam of a level grid, and for one direction of its single row. */
#define LEVEL_DEG      15.0 /* that row is so high */
#define LEVEL_BEAM     8000.0
#define LEVEL_OPENING  4500.0
#define LEVEL_MIDPOINT 11500.0
#define LEVEL_GAUSS    15500.0
#define LEVEL_RELAXED  1000.0
#define LEVEL_TOUCHED  220.0

/* For a step of the grid's centre: of what stands in it, and of each direction that was pinged. */
#define MOVED_GRID      500000.0
#define MOVED_DIRECTION 1650.0

/* The map: for one beam, for the columns of voxels that it stands over; for one echo, for the voxels across it and
 * for the columns before it. */
#define MAP_BEAM        3600.0
#define MAP_COLUMN      50.0
#define MAP_ECHO        5000.0
#define MAP_ECHO_ACROSS 1500.0
#define MAP_ECHO_COLUMN 32.0

/* Of a beam that lies on its side, whose ends stand upright (cast.h: bounds are then found column by column): for one column,
 * and for one voxel beside such an end that is asked about by itself. */
#define LYING_COLUMN 235.0
#define LYING_ASKED  118.0
#define LYING_MOST   0.02 /* of the cosine of its lean, squared, beyond the sine of half its height, squared */

/* Opening of a beam at half power, where the configuration does not say; instructions of the device for one bin and beam, as
 * tests/bench/bench_devices has their bytes come. */
static const struct head {
    const char *device;
    double az_deg, el_deg, bin, beam;
} heads[] = {{"ping360", 2, 25, 10.1, 500},     {"micron", 3, 35, 8, 300},
             {"imagenex852", 10, 10, 134, 700}, {"imagenex881a", 2.4, 22, 134, 700},
             {"ping1d", 30, 30, 0, 2900},       {"dronecan", 10, 10, 0, 4100},
             {"nmea2000", 20, 20, 0, 1100},     {"echolist", 6.5, 6.5, 0, 2800},
             {"surveyor", 1.0, 5.0, 0, 215},    {NULL, 10, 10, 10, 500}};

static const struct head *head_of(const struct conf_sonar *sonar)
{
    const struct head *h = heads;
    while (h->device && strcmp(h->device, sonar->device) != 0)
        h++;
    return h;
}

/* An echo list is of one beam, whatever it heard. */
struct plan_ping plan_ping(const struct conf_sonar *sonar)
{
    const struct device_ops *ops = device_find(sonar->device);
    const struct head *h = head_of(sonar);
    return (struct plan_ping){.beams = strcmp(sonar->device, "echolist") == 0 ? 1 : ops->max_beams,
                              .bins = ops->max_bins,
                              .az_rad = sonar->aperture_rad[0] > 0 ? sonar->aperture_rad[0] : geo_rad(h->az_deg),
                              .el_rad = sonar->aperture_rad[1] > 0 ? sonar->aperture_rad[1] : geo_rad(h->el_deg)};
}

/* The cosine of how far a head leans: 0 where its axis is level. */
static double upright(const struct conf_sonar *sonar)
{
    return fabs(cos(sonar->rotation_rad[0]) * cos(sonar->rotation_rad[1]));
}

/* An opening of so much across the head's axis and so much along it, as wide as it is to one who looks down on it. */
static double from_above(const struct conf_sonar *sonar, double across_rad, double along_rad)
{
    const double c = upright(sonar);
    return c * across_rad + sqrt(1 - c * c) * along_rad;
}

/* The ping as it lies in the water: a head on its side has its height for its width. */
static struct plan_ping as_mounted(const struct conf_sonar *sonar)
{
    struct plan_ping ping = plan_ping(sonar);
    const double az_rad = ping.az_rad, el_rad = ping.el_rad;
    ping.az_rad = from_above(sonar, az_rad, el_rad);
    ping.el_rad = from_above(sonar, el_rad, az_rad);
    return ping;
}

static double extract_bin(const struct conf_extract *c)
{
    return c->detector == CONF_OS ? OS_BIN : c->detector == CONF_SOCA ? SOCA_BIN : CA_BIN;
}

/* What is asked for; where nothing is, what the whole chain would cost. */
static double cleanup_beam(const struct conf_extract *c, double bins)
{
    const bool none =
        c->median == CONF_MEDIAN_OFF && c->otsu == CONF_OFF && c->clahe == CONF_OFF && c->classes == CONF_OFF;
    double sum = CLEANUP_BIN;
    if (none || c->median == CONF_MEDIAN_3)
        sum += MEDIAN3_BIN;
    if (c->median == CONF_MEDIAN_5)
        sum += MEDIAN5_BIN;
    if (none || c->otsu == CONF_ON)
        sum += OTSU_BIN;
    if (none || c->clahe == CONF_ON)
        sum += CLAHE_BIN + CLAHE_BEAM / bins;
    if (none || c->classes == CONF_ON)
        sum += CLASSES_BIN;
    return bins * sum;
}

/* ---- a sonar's stages ---- */

static double sonar_instructions(enum plan_id id, const struct conf *conf, int i)
{
    const struct plan_ping own = plan_ping(&conf->sonar[i]), *ping = &own;
    const struct head *head = head_of(&conf->sonar[i]);
    const double samples = ping->bins > 1 ? ping->beams * ping->bins : 0;
    switch (id) {
    case PLAN_DEVICE:
        return samples * head->bin + ping->beams * head->beam;
    case PLAN_EXTRACT:
        return samples * extract_bin(&conf->extract) + ping->beams * EXTRACT_BEAM;
    case PLAN_BACKGROUND:
        return samples * BACKGROUND_BIN;
    case PLAN_CLEANUP:
        return samples > 0 ? ping->beams * cleanup_beam(&conf->extract, ping->bins) : 0;
    case PLAN_MARKS:
        return ping->beams * (MARKS_BEAM + MARKS_WIDTH * ping->az_rad);
    default:
        return samples * IMAGE_BIN + ping->beams * IMAGE_BEAM;
    }
}

static double sonar_bytes(enum plan_id id, const struct conf *conf, int i)
{
    const struct device_ops *ops = device_find(conf->sonar[i].device);
    struct cleanup_conf all = {.median = 3, .otsu = true, .clahe = true, .classes = true, .clip = 2}, asked;
    switch (id) {
    case PLAN_DEVICE:
        return (double)ops->state_size;
    case PLAN_EXTRACT:
        return (double)extract_size(ops->max_bins);
    case PLAN_CLEANUP:
        wiring_cleanup(&conf->extract, &asked);
        return ops->max_bins > 1 ? (double)cleanup_size(cleanup_wanted(&asked) ? &asked : &all, ops->max_bins) : 0;
    case PLAN_MARKS:
        return (double)sizeof(struct marks);
    case PLAN_IMAGE:
        return (double)sizeof(struct image);
    default:
        return -1;
    }
}

/* ---- what all share ---- */

/* Directions that a beam covers: a single row of them, or as many as its height takes. */
static double directions(const struct plan_ping *ping, double step_rad, bool level)
{
    return (ping->az_rad / step_rad + 1) * (level ? 1 : ping->el_rad / step_rad + 1);
}

static double by_model(const struct conf_grid *g, double opening, double midpoint, double gauss)
{
    return g->sensor_model == CONF_OPENING ? opening : g->sensor_model == CONF_MIDPOINT ? midpoint : gauss;
}

/* A level grid never costs more than a full one. */
static double grid_ping(const struct plan_ping *ping, const struct conf_grid *g, bool level)
{
    const double step_rad = g->angular_step_rad, wider = 1 + SKIRTS_WIDER * ping->az_rad;
    const double columns = directions(ping, step_rad, true) - 1;
    const double full =
        GRID_BEAM + by_model(g, OPENING_DIRECTION, MIDPOINT_DIRECTION * wider, GAUSS_DIRECTION * wider) *
                        directions(ping, step_rad, false);
    const double row = LEVEL_BEAM + by_model(g, LEVEL_OPENING, LEVEL_MIDPOINT, LEVEL_GAUSS) * columns;
    return ping->beams * (level ? fmin(row, full) : full);
}

/*
 * Seen from above a beam is a sector, whose columns of voxels are bounded together. Where it lies on its side its ends stand
 * upright and bow: what lies between the bow and the plane that bounds it is asked voxel by voxel.
 */
static double map_ping(const struct conf_sonar *sonar, const struct conf_map *c)
{
    const struct plan_ping ping = plan_ping(sonar);
    const double range = sonar->range_m / c->voxel_m, sector = range * range / 2;
    const double free_el_rad = ping.el_rad * c->opening, end = sin(free_el_rad / 2), lean = upright(sonar);
    const double columns = from_above(sonar, ping.az_rad, free_el_rad) * sector;
    const double bow = ping.az_rad < GEO_PI / 2 ? end * (1 / cos(ping.az_rad / 2) - 1) * range : 0;
    const bool lying = lean * lean - end * end < LYING_MOST;
    const double free =
        lying ? LYING_COLUMN * columns + LYING_ASKED * 2 * ping.az_rad * sector * bow : MAP_COLUMN * columns;
    const double width_rad = from_above(sonar, ping.az_rad, ping.el_rad);
    const double echo = MAP_ECHO + MAP_ECHO_ACROSS * width_rad * range + MAP_ECHO_COLUMN * width_rad * sector;
    return ping.beams * (MAP_BEAM + free + (c->echoes == CONF_ON ? echo : 0));
}

static const struct conf_grid *grid_of(const struct conf *conf, int which)
{
    return which == 0 ? &conf->grid : &conf->more_grid[which - 1];
}

static double grid_bytes(const struct conf *conf, const struct conf_grid *grid)
{
    struct grid_setting setting;
    char err[160];
    wiring_grid(conf, grid, &setting);
    return (double)sphere_bytes(&setting.sphere, err, sizeof err);
}

static double grid_bytes_relaxed(const struct conf *conf, struct conf_grid grid, double relaxation)
{
    grid.relaxation = relaxation;
    return grid_bytes(conf, &grid);
}

/* Columns of directions that a ping covers: side by side beams of a fan cover some together. */
static double fan_columns(const struct plan_ping *ping, double step_rad)
{
    const double columns = directions(ping, step_rad, true);
    return fmin(ping->beams * columns, fmax(PLAN_FAN_RAD / step_rad, columns));
}

/* What the step towards neighbours adds: a direction is raised once, however many beams of a fan cover it, and only where
 * beams are wide enough to free it. */
static void relaxation_cost(const struct plan_stage *s, const struct conf *conf, struct plan_cost *out)
{
    const struct conf_grid *g = grid_of(conf, s->which);
    const bool level = g->elevation == CONF_ELEVATION_LEVEL;
    const double step_rad = g->angular_step_rad, least_rad = level ? geo_rad(LEVEL_DEG) : step_rad / 2;
    double most = 0;
    for (int i = 0; i < conf->n_sonars; i++) {
        const struct plan_ping ping = as_mounted(&conf->sonar[i]);
        const bool freed = ping.az_rad >= step_rad / 2 && ping.el_rad >= least_rad;
        const double columns = fan_columns(&ping, step_rad) + 1;
        const double row = (freed ? LEVEL_RELAXED : LEVEL_TOUCHED) * columns;
        const double full =
            (freed ? RELAXED_DIRECTION : TOUCHED_DIRECTION) * columns * (ping.el_rad / step_rad + 2);
        most = fmax(most, level ? row : full);
    }
    *out = (struct plan_cost){most, grid_bytes_relaxed(conf, *g, 1) - grid_bytes_relaxed(conf, *g, 0)};
}

/* A step of the centre: of every direction that was pinged, all around or as far as a fan goes. */
static void motion_cost(const struct plan_stage *s, const struct conf *conf, struct plan_cost *out)
{
    const struct conf_grid *g = grid_of(conf, s->which);
    const double step_rad = g->angular_step_rad;
    double pinged = 0;
    for (int i = 0; i < conf->n_sonars; i++) {
        const struct plan_ping ping = as_mounted(&conf->sonar[i]);
        const double columns = ping.beams > 1 ? fan_columns(&ping, step_rad) : GEO_TURN / step_rad;
        pinged += columns * (g->elevation == CONF_ELEVATION_LEVEL ? 1 : ping.el_rad / step_rad + 1);
    }
    *out = (struct plan_cost){MOVED_GRID + MOVED_DIRECTION * pinged, 0};
}

/* The elevations' share is what they add to a level grid. */
static void grid_cost(const struct plan_stage *s, const struct conf *conf, struct plan_cost *out)
{
    struct conf_grid level = *grid_of(conf, s->which), full = level;
    double most_level = 0, most_full = 0;
    level.relaxation = full.relaxation = 0; /* a stage of its own */
    level.elevation = CONF_ELEVATION_LEVEL;
    full.elevation = CONF_ELEVATION_FULL;
    for (int i = 0; i < conf->n_sonars; i++) {
        const struct plan_ping ping = as_mounted(&conf->sonar[i]);
        most_level = fmax(most_level, grid_ping(&ping, &level, true));
        most_full = fmax(most_full, grid_ping(&ping, &full, false));
    }
    *out = (struct plan_cost){most_level, grid_bytes(conf, &level)};
    if (s->id == PLAN_ELEVATION)
        *out = (struct plan_cost){most_full - most_level, grid_bytes(conf, &full) - out->bytes};
}

/* Of the main grid, once somebody asks. What they cost goes with what was heard. */
static void clusters_cost(const struct conf *conf, struct plan_cost *out)
{
    struct grid_setting setting;
    struct rings rings;
    wiring_grid(conf, &conf->grid, &setting);
    *out = (struct plan_cost){-1, -1};
    if (sphere_rings(&setting.sphere, &rings))
        out->bytes = (double)clusters_bytes(&rings, setting.sphere.max_cells);
}

static void map_cost(const struct conf *conf, struct plan_cost *out)
{
    *out = (struct plan_cost){-1, -1};
    if (conf->map.voxel_m <= 0)
        return;
    for (int i = 0; i < conf->n_sonars; i++)
        out->instructions = fmax(out->instructions, map_ping(&conf->sonar[i], &conf->map));
    out->bytes = conf->map.memory_bytes;
}

/* ---- all ---- */

static void price(const struct plan_stage *s, const struct conf *conf, struct plan_cost *out)
{
    *out = (struct plan_cost){-1, -1};
    if (s->id <= PLAN_IMAGE) {
        *out = (struct plan_cost){sonar_instructions(s->id, conf, s->which), sonar_bytes(s->id, conf, s->which)};
    } else if (s->id == PLAN_GRID || s->id == PLAN_ELEVATION) {
        grid_cost(s, conf, out);
    } else if (s->id == PLAN_MOTION) {
        motion_cost(s, conf, out);
    } else if (s->id == PLAN_RELAXATION) {
        relaxation_cost(s, conf, out);
    } else if (s->id == PLAN_CLUSTERS) {
        clusters_cost(conf, out);
    } else if (s->id == PLAN_MAP) {
        map_cost(conf, out);
    }
}

void plan_price(const struct plan *plan, const struct conf *conf, struct plan_cost cost[PLAN_STAGES_MAX],
                struct plan_cost *all)
{
    double of_sonar[CONF_MAX_SONARS] = {0}, of_all = 0, most = 0;
    *all = (struct plan_cost){0, 0};
    for (int k = 0; k < plan->n; k++) {
        const struct plan_stage *s = &plan->stage[k];
        price(s, conf, &cost[k]);
        if (!s->in)
            continue;
        *(s->id <= PLAN_IMAGE ? &of_sonar[s->which] : &of_all) += fmax(cost[k].instructions, 0);
        all->bytes += fmax(cost[k].bytes, 0);
    }
    for (int i = 0; i < conf->n_sonars; i++)
        most = fmax(most, of_sonar[i]);
    all->instructions = most + of_all;
}
