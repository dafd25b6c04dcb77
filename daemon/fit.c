/* SPDX-License-Identifier: MIT */
#include "fit.h"

#include <math.h>
#include <stdio.h>

#include "core/fault.h"
#include "core/log.h"
#include "daemon/input/pose_log.h"
#include "drivers/devices/device.h"
#include "grid/answer/answer.h"
#include "grid/geometry.h"

#define EQUAL 1e-6 /* of angles and lengths that are equal but for rounding */

/* Half power, width and height; 0 where only the device itself can tell. */
struct fan {
    double wide_rad, high_rad;
};

static struct fan fan_of(const struct conf_sonar *c)
{
    const struct device_ops *ops = device_find(c->device);
    if (c->aperture_rad[0] > 0)
        return (struct fan){c->aperture_rad[0], c->aperture_rad[1]};
    return (struct fan){geo_rad(ops->beam_deg[0]), geo_rad(ops->beam_deg[1])};
}

static bool turns(const struct conf_sonar *c)
{
    const struct device_ops *ops = device_find(c->device);
    return ops->max_beams == 1 && !ops->axial;
}

static void judge_step(const struct conf_sonar *c, fit_fn tell, void *ctx)
{
    const double wide_rad = fan_of(c).wide_rad;
    struct fault f;
    if (!turns(c) || wide_rad <= 0 || c->step_rad <= wide_rad + EQUAL)
        return;
    fault_set(&f,
              "[sonar %s] step = %g deg is wider than the beam of %g deg: what stands between two beams is never "
              "observed; set it to at most %g deg",
              c->name, geo_deg(c->step_rad), geo_deg(wide_rad), geo_deg(wide_rad));
    tell(ctx, f.text);
}

/* Of a beam that never moves, unless the vehicle does, only directions that lie wholly in it are ever clear. */
#define CELLS_IN_A_BEAM 3.0

static void judge_cells(const struct conf *conf, const struct conf_sonar *c, fit_fn tell, void *ctx)
{
    const struct device_ops *ops = device_find(c->device);
    const struct fan fan = fan_of(c);
    const double most_rad = fmin(fan.wide_rad, fan.high_rad) / CELLS_IN_A_BEAM;
    struct fault f;
    if (!ops->axial || most_rad <= 0 || conf->grid.angular_step_rad <= most_rad + EQUAL)
        return;
    fault_set(&f,
              "[grid] angular_step = %g deg is too wide for sonar %s, whose beam of %g deg does not turn: next to "
              "nothing is ever clear; set it to at most %.2g deg",
              geo_deg(conf->grid.angular_step_rad), c->name, geo_deg(fmin(fan.wide_rad, fan.high_rad)),
              geo_deg(most_rad));
    tell(ctx, f.text);
}

/* So much of a beam's height, in directions, its edges do not free (docs/grid.md, Water near the vehicle). */
#define EDGE_CELLS 1.5

/* Nothing tells how late its readings are, neither a key nor anything published. */
static void judge_delay(const struct conf_sonar *c, fit_fn tell, void *ctx)
{
    const struct device_delay *delay = &device_find(c->device)->delay;
    struct fault f;
    if (!delay->assumed || c->delay_s[0] >= 0)
        return;
    fault_set(
        &f,
        "[sonar %s] delay = auto: how late the readings of %s come is not published; %g s, give or take %g s, "
        "is assumed, and a moving vehicle has that much less free space; measure it and set delay",
        c->name, c->device, delay->s, delay->uncertain_s);
    tell(ctx, f.text);
}

/*
 * From where on a level beam is as high as the vehicle with its margin, and one that does not turn as wide as it, too;
 * INFINITY: nowhere, or it is not level.
 */
static double opens_m(const struct conf *conf, const struct conf_sonar *c)
{
    const struct conf_vehicle *v = &conf->vehicle;
    const bool axial = device_find(c->device)->axial;
    const struct fan fan = fan_of(c);
    const double edge_rad = EDGE_CELLS * conf->grid.angular_step_rad;
    const double seen_rad = (axial ? fmin(fan.wide_rad, fan.high_rad) : fan.high_rad) / 2 - edge_rad;
    const double tilt_rad = fabs(remainder(c->rotation_rad[0], GEO_PI)) + fabs(c->rotation_rad[1]);
    if (tilt_rad > EQUAL || seen_rad <= EQUAL)
        return INFINITY;
    const double high_m = v->height_m / 2 + fabs(c->mount_m[2]), wide_m = v->radius_m + fabs(c->mount_m[1]);
    return ((axial ? fmax(high_m, wide_m) : high_m) + v->margin_m) / sin(fmin(seen_rad, GEO_PI / 2));
}

static void judge_near(const struct conf *conf, fit_fn tell, void *ctx)
{
    double from_m = INFINITY;
    struct fault f;
    for (int i = 0; i < conf->n_sonars; i++)
        from_m = fmin(from_m, opens_m(conf, &conf->sonar[i]));
    if (conf->vehicle.near_m <= 0 || !isfinite(from_m) || conf->vehicle.near_m >= from_m - EQUAL)
        return;
    fault_set(
        &f,
        "[vehicle] near = %g m ends before %.1f m, from where on the beams are as large as the vehicle: `limit` "
        "allows only slow; set near = %.1f m, if nothing closer is out of the sonars' sight",
        conf->vehicle.near_m, from_m, ceil(from_m * 10) / 10);
    tell(ctx, f.text);
}

static void judge_circle(const struct conf *conf, const struct conf_sonar *c, fit_fn tell, void *ctx)
{
    struct fault f;
    if (c->scan == CONF_SCAN_PLAIN || conf->grid.clear_for_s <= 0 || c->circle_s <= conf->grid.clear_for_s)
        return;
    fault_set(
        &f,
        "[grid] clear_for = %g s is shorter than circle = %g s of sonar %s: much of the circle stays unknown; "
        "set clear_for = auto",
        conf->grid.clear_for_s, c->circle_s, c->name);
    tell(ctx, f.text);
}

static void judge_scan(const struct conf *conf, const struct conf_sonar *c, fit_fn tell, void *ctx)
{
    struct fault f;
    if (conf->vehicle.current_mps < 0 || !turns(c) || device_find(c->device)->steer)
        return;
    fault_set(&f,
              "[sonar %s] %s cannot be sent to single bearings: it keeps its scan, and without a position the "
              "water ahead "
              "is known for as short a time as all other; want a sector ahead and a short range",
              c->name, c->device);
    tell(ctx, f.text);
}

/* clear_for at the least, as it is in force while no revolution was measured. */
static double clear_for_of(const struct conf_grid *grid)
{
    const double forget_s = grid->forget_s > 0 ? grid->forget_s : INFINITY;
    return grid->clear_for_s > 0 ? grid->clear_for_s : answer_clear_for_s(0, forget_s);
}

/* clear_for = auto goes no farther than forget. */
static void judge_forget(const struct conf_grid *grid, fit_fn tell, void *ctx)
{
    const double wanted_s = answer_clear_for_s(0, INFINITY), got_s = clear_for_of(grid);
    struct fault f;
    if (grid->clear_for_s > 0 || got_s >= wanted_s)
        return;
    fault_set(&f,
              "[grid%s%s] forget = %g s makes clear_for = auto %g s, too, instead of %g s or more: water is clear "
              "for no "
              "longer than an echo in it blocks; set forget = %g s, or clear_for = %g s if that is meant",
              grid->name[0] ? " " : "", grid->name, grid->forget_s, got_s, wanted_s, wanted_s, got_s);
    tell(ctx, f.text);
}

#define DRIFT_MOST_DEG 5.0 /* to both sides of what is asked: more than a usual cone is wide */

static void judge_drift(const struct conf *conf, fit_fn tell, void *ctx)
{
    const double clear_for_s = clear_for_of(&conf->grid);
    const double drift_deg = geo_deg(conf->pose.heading_drift_radps) * clear_for_s;
    struct fault f;
    if (drift_deg <= DRIFT_MOST_DEG + EQUAL)
        return;
    fault_set(&f,
              "[pose] heading_drift = %g deg/s: in the %g s of clear_for that is %.0f deg, which answers count to "
              "both sides; use a compass, or a shorter clear_for",
              geo_deg(conf->pose.heading_drift_radps), clear_for_s, drift_deg);
    tell(ctx, f.text);
}

/* A pose that is dated back is as old when it comes. auto grows with the poses' interval, which nobody knows here. */
static void judge_pose_delay(const struct conf *conf, fit_fn tell, void *ctx)
{
    const double auto_s = POSE_LOG_AUTO_LEAST_NS * 1e-9, delay_s = conf->pose.delay_s[0];
    const double max_age_s = conf->pose.max_age_s > 0 ? conf->pose.max_age_s : auto_s;
    struct fault f;
    if (delay_s <= 0 || delay_s < max_age_s - EQUAL)
        return;
    fault_set(
        &f,
        "[pose] delay = %g s: every pose is older than max_age = %g s before the next one comes, and nothing is "
        "clear; set max_age = %g s",
        delay_s, max_age_s, delay_s + auto_s);
    tell(ctx, f.text);
}

/* The vehicle is what its radius and height hold, and what is mounted on it is a part of it. */
static void judge_mount(const struct conf *conf, const char *section, const double mount_m[3], fit_fn tell,
                        void *ctx)
{
    const double aside_m = hypot(mount_m[0], mount_m[1]), above_m = fabs(mount_m[2]);
    const bool wide = aside_m > conf->vehicle.radius_m + EQUAL,
               high = above_m > conf->vehicle.height_m / 2 + EQUAL;
    struct fault f;
    if (!wide && !high)
        return;
    fault_set(
        &f,
        "[%s] mount = %g %g %g m: outside of the vehicle, whose %s is %g m; measure it again, or set [vehicle] "
        "%s = %g m at least, so that limit has room for it, too",
        section, mount_m[0], mount_m[1], mount_m[2], wide ? "radius" : "height",
        wide ? conf->vehicle.radius_m : conf->vehicle.height_m, wide ? "radius" : "height",
        wide ? ceil(aside_m * 100) / 100 : 2 * above_m);
    tell(ctx, f.text);
}

static void judge_mounts(const struct conf *conf, fit_fn tell, void *ctx)
{
    char section[CONF_NAME_MAX + 8];
    for (int i = 0; i < conf->n_sonars; i++) {
        snprintf(section, sizeof section, "sonar %s", conf->sonar[i].name);
        judge_mount(conf, section, conf->sonar[i].mount_m, tell, ctx);
    }
    judge_mount(conf, "depth", conf->depth.mount_m, tell, ctx);
}

void fit_judge(const struct conf *conf, fit_fn tell, void *ctx)
{
    judge_mounts(conf, tell, ctx);
    for (int i = 0; i < conf->n_sonars; i++) {
        judge_step(&conf->sonar[i], tell, ctx);
        judge_cells(conf, &conf->sonar[i], tell, ctx);
        judge_circle(conf, &conf->sonar[i], tell, ctx);
        judge_scan(conf, &conf->sonar[i], tell, ctx);
        judge_delay(&conf->sonar[i], tell, ctx);
    }
    judge_forget(&conf->grid, tell, ctx);
    for (int i = 0; i < conf->n_more_grids; i++)
        if (conf->more_grid[i].forget_s != conf->grid.forget_s ||
            conf->more_grid[i].clear_for_s != conf->grid.clear_for_s)
            judge_forget(&conf->more_grid[i], tell, ctx);
    judge_near(conf, tell, ctx);
    judge_drift(conf, tell, ctx);
    judge_pose_delay(conf, tell, ctx);
}

void fit_unchecked(const struct conf *conf, fit_fn tell, void *ctx)
{
    for (int i = 0; i < conf->n_sonars; i++) {
        struct fault f;
        if (device_find(conf->sonar[i].device)->max_bins > 1)
            continue;
        fault_set(&f,
                  "[sonar %s] %s sends ranges without samples: nothing shows that its receiver works, or that no "
                  "echo came before the range that it chose",
                  conf->sonar[i].name, conf->sonar[i].device);
        tell(ctx, f.text);
    }
}

static void log_one(void *ctx, const char *sentence)
{
    (void)ctx;
    log_line(LOG_WARNING, "misfit", "%s", sentence);
}

void fit_log(const struct conf *conf)
{
    fit_judge(conf, log_one, NULL);
}
