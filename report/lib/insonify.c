/* SPDX-License-Identifier: MIT */
/* insonify - see insonify.h. */
#include "insonify.h"

#include <string.h>

#include "tests/sound/sound.h"

#define RAYS         21   /* across a beam, to 1.2 times its half-power width on either side */
#define LIFTS        5    /* ... and up, where it bends the echo's tail */
#define PLANE_RAYS   97   /* up and down, for what is seen at grazing angles */
#define SKIRT        1.2  /* of the half-power width: 35 dB down, two ways */
#define SIDE_FADE_DB 15.0 /* per radian off the axis */
#define FACETS       24   /* of a target, for side lobes */
#define SPECULAR_DB  8.0
#define SPECULAR_RAD 0.07
#define ASKEW_DB     (-15.0) /* what rough walls return at least */

const char *const insonify_cause_name[CAUSES] = {"noise",  "volume",    "ring-down", "own parts",  "plane",
                                                 "target", "side lobe", "multipath", "other sonar"};

static double ring_db(const struct drawn_world *w, double r_m)
{
    const double x = fmax(0.0, (r_m / w->ring_m - 0.25) / 0.75);
    return 15.0 - 85.0 * pow(x, w->ring_shape) +
           w->ripple_db * sin(GEO_TURN * r_m / w->ripple_m + w->ripple_phase);
}

void insonify_init(struct insonify *in, const struct drawn_world *w)
{
    in->world = w;
    in->bin_m = w->range_m / w->bins;
    in->electronic = (float)(sound_power(w->electronic_db) / w->pulse_bins);
    const double end_db = drawn_gain_db(w, w->range_m) - w->gain_db;
    for (uint32_t i = 0; i < w->bins; i++) {
        const double r_m = (i + 0.5) * in->bin_m, wall_db = drawn_wall_db(w, r_m);
        in->wall[i] = sound_power(wall_db);
        in->noise[i] = (float)(sound_power(w->noise_db + drawn_gain_db(w, r_m) - end_db) / w->pulse_bins);
        in->volume[i] = (float)(sound_power(wall_db + w->volume_db - w->wall_db) / w->pulse_bins);
        in->ring[i] = (float)sound_power(ring_db(w, r_m));
    }
}

void insonify_add(const struct insonify *in, float *mean, double from_m, double to_m, double power)
{
    const double end = in->world->bins, a = fmax(from_m / in->bin_m, 0.0), b = fmax(to_m / in->bin_m, a);
    if (a >= end)
        return;
    const uint32_t first = (uint32_t)a, last = (uint32_t)fmin(b, end - 1.0);
    if (last == first && b < end) {
        mean[first] += (float)power;
        return;
    }
    const double per_bin = power / fmax(b - a, 1.0);
    mean[first] += (float)(per_bin * (first + 1 - a));
    for (uint32_t i = first + 1; i < last; i++)
        mean[i] += (float)per_bin;
    if (last > first)
        mean[last] += (float)(per_bin * fmin(b - last, 1.0));
}

static double wall_power(const struct insonify *in, double r_m)
{
    const double at = r_m / in->bin_m;
    return at < in->world->bins ? in->wall[(uint32_t)at] : 0.0;
}

static bool is_sheet(const struct drawn_target *t)
{
    return t->class == DRAWN_WALL || t->class == DRAWN_NET;
}

/* Range along az to a wall or net, and the cosine of incidence; INFINITY: it is not met. */
static double sheet_range(const struct drawn_target *t, const double place[2], double az, double *cosine)
{
    const double u[2] = {cos(az), sin(az)}, a[2] = {t->a_m[0] - place[0], t->a_m[1] - place[1]};
    const double d[2] = {t->b_m[0] - t->a_m[0], t->b_m[1] - t->a_m[1]}, cross = u[0] * d[1] - u[1] * d[0];
    const double r = (a[0] * d[1] - a[1] * d[0]) / cross, s = (a[0] * u[1] - a[1] * u[0]) / cross;
    if (!(r > 0.0 && s >= 0.0 && s <= 1.0))
        return INFINITY;
    *cosine = fabs(cross) / hypot(d[0], d[1]);
    return r;
}

static double aspect(const struct drawn_target *t, double cosine)
{
    const double askew = acos(fmin(cosine, 1.0)) / SPECULAR_RAD;
    return fmax(cosine * cosine, sound_power(ASKEW_DB)) *
           (t->class == DRAWN_WALL ? sound_power(SPECULAR_DB * exp(-askew * askew)) : 1.0);
}

/* The power of target t at a range, all of it in the beam. */
static double target_power(const struct insonify *in, const struct drawn_target *t, double r_m)
{
    const double decade_db = is_sheet(t) ? 0.0 : 10.0 * log10(3.0 * fmax(r_m, 0.1) / in->world->range_m);
    return wall_power(in, r_m) * sound_power(t->strength_db - decade_db);
}

/* Of a target in the beam: from near to far at u beam widths off the axis. */
static void met(struct insonified *out, unsigned t, double u, double near_m, double far_m)
{
    out->skirt_m = fmin(out->skirt_m, near_m);
    if (fabs(u) > 0.5)
        return;
    out->near_m[t] = fmin(out->near_m[t], near_m);
    out->far_m[t] = fmax(out->far_m[t], far_m);
    out->solid_m = fmin(out->solid_m, near_m);
}

/* A part of a target's echo, stretched by what the beam reaches above and below. */
static void add_part(const struct insonify *in, struct insonified *out, unsigned t, double near_m, double far_m,
                     double power)
{
    double lift[LIFTS], sum = 0.0;
    for (int k = 0; k < LIFTS; k++)
        sum += lift[k] = sound_pattern(0.0, (k + 0.5) / LIFTS);
    for (int k = 0; k < LIFTS; k++) {
        const double low = cos(in->world->el_aperture_rad * k / LIFTS),
                     high = cos(in->world->el_aperture_rad * (k + 1) / LIFTS);
        insonify_add(in, out->target[t], near_m / low, far_m / high, power * lift[k] / sum);
    }
}

struct rays {
    struct sound_ray fan[RAYS];
    double opaque_m[RAYS], range_m[DRAWN_MAX_TARGETS][RAYS], cosine[DRAWN_MAX_TARGETS][RAYS];
};

static void cast(const struct insonify *in, const double place[2], double az, struct rays *rays)
{
    sound_fan(SOUND_EVEN, SKIRT, RAYS, 1, NULL, rays->fan);
    for (int k = 0; k < RAYS; k++) {
        const double ray_az = az + rays->fan[k].az * in->world->az_aperture_rad;
        rays->opaque_m[k] = INFINITY;
        for (unsigned t = 0; t < in->world->targets; t++)
            if (is_sheet(&in->world->target[t])) {
                rays->range_m[t][k] = sheet_range(&in->world->target[t], place, ray_az, &rays->cosine[t][k]);
                if (in->world->target[t].class == DRAWN_WALL)
                    rays->opaque_m[k] = fmin(rays->opaque_m[k], rays->range_m[t][k]);
            }
    }
}

static void glint_at(const struct insonify *in, struct insonified *out, unsigned t, double range_m, double power)
{
    if (power > 0.0 && range_m < in->world->range_m)
        out->glint[t] = (struct insonify_glint){(uint32_t)(range_m / in->bin_m), power};
}

static void add_sheet(const struct insonify *in, const struct rays *rays, unsigned t, double through,
                      struct insonified *out)
{
    const struct drawn_target *target = &in->world->target[t];
    double nearest_m = INFINITY, coherent = 0.0;
    for (int k = 0; k < RAYS; k++) {
        const double r_m = rays->range_m[t][k];
        if (r_m > rays->opaque_m[k] || r_m >= in->world->range_m)
            continue;
        const double last = k > 0 && isfinite(rays->range_m[t][k - 1]) ? rays->range_m[t][k - 1] : r_m;
        const double next = k < RAYS - 1 && isfinite(rays->range_m[t][k + 1]) ? rays->range_m[t][k + 1] : r_m;
        const double low_m = 0.5 * (r_m + fmin(last, next)), high_m = 0.5 * (r_m + fmax(last, next));
        const double power =
            through * target_power(in, target, r_m) * rays->fan[k].weight * aspect(target, rays->cosine[t][k]);
        met(out, t, rays->fan[k].az, r_m, r_m);
        add_part(in, out, t, fmin(low_m, r_m), fmax(high_m, r_m), power * (1.0 - target->coherent));
        coherent += power * target->coherent;
        nearest_m = fabs(rays->fan[k].az) <= 0.5 ? fmin(nearest_m, r_m) : nearest_m;
    }
    /* a plane answers in one piece only where it is square to the beam; elsewhere that part is lost */
    const double square = rays->cosine[t][RAYS / 2];
    if (isfinite(rays->range_m[t][RAYS / 2]) && square > cos(2.0 * SPECULAR_RAD))
        glint_at(in, out, t, nearest_m, coherent);
}

static void add_post(const struct insonify *in, const struct rays *rays, unsigned t, const double place[2],
                     double az_rad, double through, struct insonified *out)
{
    const struct drawn_target *target = &in->world->target[t];
    const double x = target->a_m[0] - place[0], y = target->a_m[1] - place[1], r_m = hypot(x, y);
    const double u = geo_wrap_pi(atan2(y, x) - az_rad) / in->world->az_aperture_rad;
    if (fabs(u) > SKIRT || r_m >= in->world->range_m)
        return;
    if (r_m > rays->opaque_m[(int)((u / SKIRT + 1.0) / 2.0 * (RAYS - 1) + 0.5)])
        return;
    const double power = through * target_power(in, target, r_m) * sound_pattern(u, 0.0);
    met(out, t, u, r_m, r_m);
    add_part(in, out, t, r_m, r_m, power * (1.0 - target->coherent));
    glint_at(in, out, t, r_m, power * target->coherent);
}

static void add_plane(const struct insonify *in, const struct drawn_plane *p, double az_rad, double end_m,
                      double through, struct insonified *out)
{
    const double rise = tan(p->slope_rad) * cos(az_rad - p->az_rad), half = SKIRT / (PLANE_RAYS - 1);
    struct sound_ray fan[PLANE_RAYS];
    sound_fan(SOUND_EVEN, SKIRT, 1, PLANE_RAYS, NULL, fan);
    for (int k = 0; k < PLANE_RAYS; k++) {
        const double u = fan[k].el, width = in->world->el_aperture_rad;
        /* downward; a surface lies above, and so both turn their signs */
        const double down = sin(u * width) + cos(u * width) * rise;
        const double r_m = p->depth_m / down;
        if (!(r_m > 0.0 && r_m < fmin(2.0 * in->world->range_m, end_m)))
            continue;
        const double near_m = fabs(p->depth_m) / (fabs(down) + half * width),
                     far_m = fabs(p->depth_m) / fmax(fabs(down) - half * width, 1e-3);
        const double grazing = fmin(fabs(down), 1.0);
        const double power = through * wall_power(in, fmin(r_m, in->world->range_m * 0.999)) *
                             sound_power(p->strength_db) * grazing * grazing * fan[k].weight;
        insonify_add(in, out->mean[CAUSE_PLANE], near_m, far_m, power);
        out->skirt_m = fmin(out->skirt_m, near_m);
        if (fabs(u) <= 0.5)
            out->plane_m = fmin(out->plane_m, r_m);
    }
    out->solid_m = fmin(out->solid_m, out->plane_m);
}

/* What other bearings send into the side lobes. */
static void add_side_lobes(const struct insonify *in, const double place[2], double az_rad, struct insonified *out)
{
    const struct drawn_world *w = in->world;
    for (unsigned t = 0; t < w->targets; t++) {
        const struct drawn_target *target = &w->target[t];
        const int facets = is_sheet(target) ? FACETS : 1;
        double last_m = 0.0, last_az = 0.0;
        for (int k = 0; k <= facets; k++) {
            const double s = is_sheet(target) ? (double)k / facets : 0.0;
            const double x = target->a_m[0] + s * (target->b_m[0] - target->a_m[0]) - place[0],
                         y = target->a_m[1] + s * (target->b_m[1] - target->a_m[1]) - place[1];
            const double r_m = hypot(x, y), az = atan2(y, x), off = fabs(geo_wrap_pi(az - az_rad));
            if (k > 0 && off > SKIRT * w->az_aperture_rad && fmin(r_m, last_m) < w->range_m) {
                const double width = is_sheet(target) ? fabs(geo_wrap_pi(az - last_az)) / w->az_aperture_rad : 1.0;
                const double along = hypot(x, y) > 0.0
                                         ? fabs(r_m - last_m) / fmax(r_m * fabs(geo_wrap_pi(az - last_az)), 1e-6)
                                         : 0.0; /* tangent of incidence */
                const double cosine = 1.0 / hypot(1.0, along);
                const double fade_db = -SIDE_FADE_DB * off;
                const double power = target_power(in, target, 0.5 * (r_m + last_m)) *
                                     (is_sheet(target) ? aspect(target, cosine) : 1.0) * width *
                                     sound_power(w->side_lobe_db + fade_db);
                insonify_add(in, out->mean[CAUSE_SIDE_LOBE], fmin(r_m, last_m), fmax(r_m, last_m), power);
            }
            last_m = r_m;
            last_az = az;
        }
    }
}

static void add_multipath(const struct insonify *in, unsigned t, struct insonified *out)
{
    const struct drawn_world *w = in->world;
    double power = out->glint[t].power;
    if (!isfinite(out->near_m[t]))
        return;
    for (uint32_t i = out->first[t]; i < out->end[t]; i++)
        power += (double)out->target[t][i];
    const double r_m = out->near_m[t];
    power *= sound_power(w->multipath_db);
    insonify_add(in, out->mean[CAUSE_MULTIPATH], 2.0 * r_m, 2.0 * out->far_m[t] + w->pulse_m, power);
    for (unsigned p = 0; p < w->planes; p++) {
        const double way_m = 0.5 * (r_m + hypot(r_m, 2.0 * w->plane[p].depth_m));
        insonify_add(in, out->mean[CAUSE_MULTIPATH], way_m, way_m + w->pulse_m, power);
    }
}

/* The vehicle's own part in the beam; how much of what comes from behind it is left. */
static double add_own_parts(const struct insonify *in, double az_rad, struct insonified *out)
{
    const struct drawn_world *w = in->world;
    if (!w->frame || fabs(geo_wrap_pi(az_rad - w->frame_az_rad)) > w->frame_half_rad)
        return 1.0;
    insonify_add(in, out->mean[CAUSE_OWN_PARTS], w->frame_m, w->frame_m + 0.05,
                 sound_power(w->frame_db + w->gain_db));
    out->skirt_m = fmin(out->skirt_m, w->frame_m);
    out->solid_m = fmin(out->solid_m, w->frame_m);
    out->shadowed = true;
    return sound_power(w->shadow_db);
}

void insonify_beam(const struct insonify *in, const double place[2], double az_rad, struct insonified *out)
{
    const struct drawn_world *w = in->world;
    struct rays rays;
    for (int c = 0; c < CAUSES; c++)
        memset(out->mean[c], 0, w->bins * sizeof(float));
    out->plane_m = out->solid_m = out->skirt_m = INFINITY;
    out->shadowed = false;
    for (uint32_t i = 0; i < w->bins; i++) {
        out->mean[CAUSE_NOISE][i] = in->noise[i] + in->electronic;
        out->mean[CAUSE_VOLUME][i] = in->volume[i];
        out->mean[CAUSE_RING][i] = in->ring[i] / (float)w->pulse_bins;
    }
    cast(in, place, az_rad, &rays);
    const double through = add_own_parts(in, az_rad, out);
    for (unsigned p = 0; p < w->planes; p++)
        add_plane(in, &w->plane[p], az_rad, rays.opaque_m[RAYS / 2], through, out);
    for (unsigned t = 0; t < w->targets; t++) {
        memset(out->target[t], 0, w->bins * sizeof(float));
        out->glint[t] = (struct insonify_glint){0};
        out->near_m[t] = INFINITY;
        out->far_m[t] = 0.0;
        if (is_sheet(&w->target[t]))
            add_sheet(in, &rays, t, through, out);
        else
            add_post(in, &rays, t, place, az_rad, through, out);
        for (out->first[t] = 0; out->first[t] < w->bins && out->target[t][out->first[t]] <= 0.0f;)
            out->first[t]++;
        for (out->end[t] = w->bins; out->end[t] > out->first[t] && out->target[t][out->end[t] - 1] <= 0.0f;)
            out->end[t]--;
        for (uint32_t i = out->first[t]; i < out->end[t]; i++)
            out->mean[CAUSE_TARGET][i] += out->target[t][i];
        if (out->glint[t].power > 0.0)
            out->mean[CAUSE_TARGET][out->glint[t].bin] += (float)out->glint[t].power;
        add_multipath(in, t, out);
    }
    add_side_lobes(in, place, az_rad, out);
}
