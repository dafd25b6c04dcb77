/* SPDX-License-Identifier: MIT */
/* drawn - see drawn.h. */
#include "drawn.h"

#include "tests/sound/sound.h"

#define TIMING_STREAM 2000000u

/* No receiver of a recording is switched on later: the first zeros of a Micron, a SeaNet and an older Tritech head end
 * there, whatever their bins. A receiver that sleeps through its own ring-down is no head's. */
#define DEAD_MOST_M 0.1

const char *const drawn_class_name[DRAWN_CLASSES] = {"wall", "pile", "net", "line"};

/* How far the reference of a class lies below a wall seen square on, and how much faster it falls with range. */
static const struct {
    double below_db, per_decade_db;
} reference[DRAWN_CLASSES] = {[DRAWN_WALL] = {6.0, 0.0},
                              [DRAWN_PILE] = {12.0, 10.0},
                              [DRAWN_NET] = {18.0, 0.0},
                              [DRAWN_LINE] = {24.0, 10.0}};

/* ---- the head and its receiver ---- */

static void draw_axis(struct drawn_world *w, struct dice *d, double most_m, double least_bins, double most_bins,
                      double least_pulse_m)
{
    w->range_m = dice_scaled(d, 2.0, most_m);
    w->bins = (uint32_t)fmin(dice_between(d, least_bins, most_bins), w->range_m / 0.00165);
    w->pulse_m = fmax(least_pulse_m, w->range_m * dice_scaled(d, 0.0025, 0.01));
    w->pulse_bins = (uint32_t)fmax(1.0, round(w->pulse_m / (w->range_m / w->bins)));
    w->ping_s = 0.03 + w->range_m / 750.0;
}

static void draw_head(struct drawn_world *w, struct dice *d)
{
    const double kind = dice_uniform(d);
    w->beams = 1;
    w->db_per_count = SOUND_MICRON_DB;
    if (kind < 0.4) {
        w->head = "ping360";
        w->turn_units = 400;
        w->step_units = 1u << (unsigned)dice_between(d, 0, 3);
        w->az_aperture_rad = geo_rad(2.0);
        w->el_aperture_rad = geo_rad(25.0);
        w->law = dice_chance(d, 0.8) ? AMPLITUDE_SQRT : AMPLITUDE_LINEAR;
        draw_axis(w, d, 60.0, 400, DRAWN_MAX_BINS, 0.0075);
    } else if (kind < 0.75) {
        w->head = "micron";
        w->turn_units = 6400;
        w->step_units = 16u << (unsigned)dice_between(d, 0, 3);
        w->az_aperture_rad = geo_rad(3.0);
        w->el_aperture_rad = geo_rad(35.0);
        w->law = AMPLITUDE_LOG;
        w->four_bit = dice_chance(d, 0.3);
        w->low = dice_between(d, 0.0, 40.0);
        w->span = dice_between(d, 80.0, 200.0);
        draw_axis(w, d, 60.0, 100, 500, 0.03);
    } else {
        w->head = "multibeam";
        w->beams = DRAWN_MAX_BEAMS;
        w->az_aperture_rad = geo_rad(dice_scaled(d, 0.7, 2.0));
        w->el_aperture_rad = geo_rad(20.0);
        w->law = dice_chance(d, 0.5) ? AMPLITUDE_LINEAR : AMPLITUDE_SQRT;
        draw_axis(w, d, 40.0, 256, 700, 0.005);
    }
    w->pings = w->beams > 1 ? 4 : w->turn_units / w->step_units;
    w->beam_step_rad = w->beams > 1 ? geo_rad(1.5) : GEO_TURN * w->step_units / w->turn_units;
    w->told = w->law;
    if (dice_chance(d, 0.12))
        w->told = w->law == AMPLITUDE_SQRT     ? AMPLITUDE_LINEAR
                  : w->law == AMPLITUDE_LINEAR ? AMPLITUDE_SQRT
                                               : (dice_chance(d, 0.5) ? AMPLITUDE_SQRT : AMPLITUDE_LINEAR);
}

static void draw_receiver(struct drawn_world *w, struct dice *d)
{
    /* a scale of decibels is laid out so that walls come nowhere near its end */
    const double shift_db = w->law == AMPLITUDE_LOG ? -25.0 : 0.0;

    w->absorption = dice_scaled(d, 0.03, 0.3); /* dB per metre, one way */
    w->tvg_log = dice_between(d, 0.0, 40.0);
    w->tvg_per_m = dice_chance(d, 0.5) ? 2.0 * w->absorption : 0.0;
    w->gain_db = 6.0 * (floor(dice_between(d, 0.0, 3.0)) - 1.0);
    w->wall_db = shift_db + dice_between(d, -15.0, 6.0);
    w->noise_db = drawn_wall_db(w, w->range_m) - w->gain_db - dice_between(d, 12.0, 70.0);
    w->electronic_db = shift_db + dice_between(d, -90.0, -40.0);
    w->volume_db = w->wall_db - dice_between(d, 35.0, 75.0);
    w->stray_share = dice_chance(d, 0.3) ? 0.001 : 0.0;
    w->side_lobe_db = dice_between(d, -55.0, -28.0);
    w->multipath_db = dice_between(d, -35.0, -8.0);
    w->texture = dice_chance(d, 0.5) ? 0 : (int)dice_scaled(d, 1.0, 8.0);
    w->ring_m = fmin(dice_scaled(d, 0.2, 1.5), w->range_m / 3.0);
    w->ring_shape = dice_scaled(d, 0.5, 1.6);
    w->ripple_db = dice_between(d, 0.0, 4.0);
    w->ripple_m = dice_scaled(d, 0.02, 0.2);
    w->ripple_phase = dice_between(d, 0.0, GEO_TURN);
    w->ring_speckle = dice_between(d, 0.02, 0.3);
    w->dead_bins = dice_chance(d, 0.4) ? (unsigned)dice_between(d, 0.0, 4.0) : 0;
    w->dead_bins = (unsigned)fmin(w->dead_bins, DEAD_MOST_M / (w->range_m / w->bins));
    w->lost_share = dice_chance(d, 0.3) ? dice_between(d, 0.0, 0.05) : 0.0;
    w->dead_share = dice_chance(d, 0.1) ? 0.01 : 0.0;
    w->raised_share = dice_chance(d, 0.2) ? dice_between(d, 0.01, 0.15) : 0.0;
    w->raised_db = dice_between(d, 10.0, 25.0);
}

/* ---- the water ---- */

static void draw_sheet(struct dice *d, struct drawn_target *t, double distance_m)
{
    const double az = dice_between(d, 0.0, GEO_TURN);
    const double turn =
        dice_chance(d, 0.3) ? geo_rad(dice_between(d, 50.0, 80.0)) : 0.0; /* walls that are only seen askew */
    const double half_m = distance_m * dice_scaled(d, 0.15, 3.0);
    const double across[2] = {-sin(az + turn), cos(az + turn)};

    for (int i = 0; i < 2; i++) {
        const double middle = distance_m * (i ? sin(az) : cos(az));
        t->a_m[i] = middle - half_m * across[i];
        t->b_m[i] = middle + half_m * across[i];
    }
}

static void draw_post(struct drawn_world *w, struct dice *d, struct drawn_target *t, double distance_m)
{
    const double fan = w->turn_units ? GEO_TURN : w->beams * w->beam_step_rad, az = fan * (dice_uniform(d) - 0.5);
    t->a_m[0] = distance_m * cos(az);
    t->a_m[1] = distance_m * sin(az);
}

/* A wall or a net; or some piles or lines, which are narrow and would be in hardly any beam alone. */
static void draw_targets(struct drawn_world *w, struct dice *d)
{
    static const struct {
        double share, strength_db, scatter_db, coherent;
        int most;
    } kind[DRAWN_CLASSES] = {[DRAWN_WALL] = {0.4, -1.0, 3.0, 0.3, 1},
                             [DRAWN_PILE] = {0.65, -8.0, 3.0, 0.8, 4},
                             [DRAWN_NET] = {0.8, -14.0, 3.0, 0.0, 1},
                             [DRAWN_LINE] = {1.0, -20.0, 3.0, 0.8, 4}};
    const double which = dice_uniform(d);
    enum drawn_class class = DRAWN_WALL;

    while (which > kind[class].share)
        class ++;
    for (int n = (int)dice_between(d, 1.0, kind[class].most + 1.0); n > 0; n--) {
        struct drawn_target *t = &w->target[w->targets++];
        const double distance_m = dice_scaled(d, 0.7 * w->ring_m, 0.95 * w->range_m);
        t->class = class;
        t->strength_db = kind[class].strength_db + kind[class].scatter_db * dice_gauss(d);
        t->coherent = kind[class].coherent * dice_uniform(d);
        if (class == DRAWN_WALL || class == DRAWN_NET)
            draw_sheet(d, t, distance_m);
        else
            draw_post(w, d, t, distance_m);
    }
}

static void draw_tank(struct drawn_world *w, struct dice *d)
{
    const double az = dice_between(d, 0.0, GEO_TURN), u[2] = {cos(az), sin(az)}, v[2] = {-sin(az), cos(az)};
    const double side[4] = {dice_scaled(d, w->ring_m, w->range_m), dice_scaled(d, w->ring_m, w->range_m),
                            dice_scaled(d, w->ring_m, w->range_m), dice_scaled(d, w->ring_m, w->range_m)};
    const double strength_db = 2.0 * dice_gauss(d);
    for (int k = 0; k < 4; k++) { /* corners: (s0, s1), (s0, -s3), (-s2, -s3), (-s2, s1) */
        struct drawn_target *t = &w->target[w->targets++];
        const double corner[4][2] = {
            {side[0], side[1]}, {side[0], -side[3]}, {-side[2], -side[3]}, {-side[2], side[1]}};
        t->class = DRAWN_WALL;
        t->strength_db = strength_db;
        t->coherent = 0.3 * dice_uniform(d);
        for (int i = 0; i < 2; i++) {
            t->a_m[i] = corner[k][0] * u[i] + corner[k][1] * v[i];
            t->b_m[i] = corner[(k + 1) % 4][0] * u[i] + corner[(k + 1) % 4][1] * v[i];
        }
    }
}

static void draw_water(struct drawn_world *w, struct dice *d)
{
    if (dice_chance(d, 0.15))
        draw_tank(w, d);
    else if (dice_chance(d, 0.75))
        for (int n = 1 + (int)dice_between(d, 0.0, 3.0); n > 0; n--)
            draw_targets(w, d);
    if (dice_chance(d, 0.4))
        w->plane[w->planes++] = (struct drawn_plane){.depth_m = -dice_scaled(d, 0.3, 20.0),
                                                     .strength_db = dice_between(d, -15.0, 3.0)};
    if (dice_chance(d, 0.4))
        w->plane[w->planes++] =
            (struct drawn_plane){.depth_m = dice_scaled(d, 0.3, 20.0),
                                 .slope_rad = dice_chance(d, 0.4) ? geo_rad(dice_between(d, 3.0, 25.0)) : 0.0,
                                 .az_rad = dice_between(d, 0.0, GEO_TURN),
                                 .strength_db = dice_between(d, -25.0, -3.0)};
    for (double share = 0.25; w->others < DRAWN_MAX_OTHERS && dice_chance(d, share); share = 0.4) {
        const double period_s = dice_scaled(d, 0.03, 0.5);
        w->other[w->others++] = (struct drawn_other){.az_rad = dice_between(d, 0.0, GEO_TURN),
                                                     .period_s = period_s,
                                                     .phase_s = dice_between(d, 0.0, period_s),
                                                     .length_m = dice_chance(d, 0.85) ? dice_scaled(d, 0.02, 0.3)
                                                                                      : dice_between(d, 1.0, 6.0),
                                                     .level_db = w->wall_db + dice_between(d, -20.0, 10.0)};
    }
    w->frame = w->turn_units && dice_chance(d, 0.35);
    w->frame_az_rad = dice_between(d, 0.0, GEO_TURN);
    w->frame_half_rad = geo_rad(dice_between(d, 3.0, 70.0));
    w->frame_m = w->ring_m * dice_scaled(d, 0.7, 3.0);
    w->frame_db = w->wall_db + dice_between(d, -5.0, 15.0);
    w->shadow_db = dice_between(d, -60.0, -12.0);
    w->posed = dice_chance(d, 0.6);
    if (w->posed && dice_chance(d, 0.4)) {
        const double az = dice_between(d, 0.0, GEO_TURN), speed = dice_between(d, 0.02, 0.4);
        w->velocity_mps[0] = speed * cos(az);
        w->velocity_mps[1] = speed * sin(az);
    }
}

/* Who waits for a host pings late, by what the host's other work takes; a clock of its own is never late. */
static void draw_timing(struct drawn_world *w, struct dice *d)
{
    w->asked_late_s = dice_chance(d, 0.7) ? dice_scaled(d, 1e-4, 5e-3) : 0.0;
    w->dated_late_s = dice_scaled(d, 5e-5, 3e-3);
    for (unsigned k = 0; k < w->others; k++)
        w->other[k].late_s = dice_chance(d, 0.5) ? dice_scaled(d, 1e-4, 3e-3) : 0.0;
}

struct drawn_world drawn_world_of(uint64_t seed, unsigned number)
{
    struct drawn_world w = {.seed = seed, .number = number};
    struct dice d = dice_of(seed, number), timing = dice_of(seed, TIMING_STREAM + number);
    draw_head(&w, &d);
    draw_receiver(&w, &d);
    draw_water(&w, &d);
    draw_timing(&w, &timing);
    return w;
}

/* ---- levels ---- */

double drawn_gain_db(const struct drawn_world *w, double range_m)
{
    const double r_m = fmax(range_m, 0.1);
    return w->gain_db + w->tvg_log * log10(3.0 * r_m / w->range_m) + w->tvg_per_m * (r_m - w->range_m / 3.0);
}

double drawn_wall_db(const struct drawn_world *w, double range_m)
{
    const double r_m = fmax(range_m, 0.1);
    return w->wall_db - 20.0 * log10(3.0 * r_m / w->range_m) - 2.0 * w->absorption * (r_m - w->range_m / 3.0) +
           drawn_gain_db(w, range_m);
}

double drawn_reference_db(const struct drawn_world *w, enum drawn_class class, double range_m)
{
    return drawn_wall_db(w, range_m) - reference[class].below_db -
           reference[class].per_decade_db * log10(3.0 * fmax(range_m, 0.1) / w->range_m);
}

static double power_of(const struct drawn_world *w, double count)
{
    switch (w->law) {
    case AMPLITUDE_LINEAR:
        return count * count / (255.0 * 255.0);
    case AMPLITUDE_SQRT:
        return pow(count / 255.0, 4.0);
    case AMPLITUDE_LOG:
        return sound_power((count - 255.0) * w->db_per_count);
    case AMPLITUDE_POWER:
        break;
    }
    return count / 255.0;
}

/* Of four bits the device makes counts again: steps of a window, and full scale above it. */
static double sixteenth(const struct drawn_world *w, double count)
{
    return fmin(fmax(floor((count - w->low) / w->span * 15.0), 0.0), 15.0);
}

static double count_of_sixteenth(const struct drawn_world *w, double v)
{
    return v <= 0.0 ? 0.0 : v >= 15.0 ? 255.0 : fmin(round(w->low + w->span * v / 15.0), 255.0);
}

uint8_t drawn_count(const struct drawn_world *w, double power)
{
    const double count = sound_count(w->law, power, 255.0, w->db_per_count);
    if (w->four_bit)
        return (uint8_t)count_of_sixteenth(w, sixteenth(w, count));
    return sound_byte(count + 0.5);
}

double drawn_power_above(const struct drawn_world *w, uint8_t count)
{
    if (count == UINT8_MAX)
        return INFINITY;
    if (!w->four_bit)
        return power_of(w, count + 0.5);
    for (double v = 1.0; v <= 15.0; v++)
        if (count_of_sixteenth(w, v) > (double)count)
            return power_of(w, w->low + w->span * v / 15.0);
    return INFINITY;
}

/* ---- for people ---- */

void drawn_world_print(FILE *out, const struct drawn_world *w)
{
    static const char *const law_name[] = {"linear", "power", "sqrt", "log"};
    fprintf(out,
            "seed %llu world %u: %s %.1f m, %u bins, pulse %.3f m, %s%s told %s, TVG %.0f log, wall %.0f dB, "
            "noise %.0f dB at the end, ring-down to %.2f m, texture %d, side lobes %.0f dB;",
            (unsigned long long)w->seed, w->number, w->head, w->range_m, w->bins, w->pulse_m, law_name[w->law],
            w->four_bit ? " of 4 bits" : "", law_name[w->told], w->tvg_log, drawn_wall_db(w, w->range_m / 3.0),
            w->noise_db + w->gain_db, w->ring_m, w->texture, w->side_lobe_db);
    for (unsigned i = 0; i < w->targets; i++)
        fprintf(out, " %s", drawn_class_name[w->target[i].class]);
    for (unsigned i = 0; i < w->planes; i++)
        fprintf(out, " %s at %.1f m",
                w->plane[i].depth_m < 0.0     ? "surface"
                : w->plane[i].slope_rad > 0.0 ? "slope"
                                              : "bottom",
                w->plane[i].depth_m);
    for (unsigned i = 0; i < w->others; i++)
        fprintf(out, " other sonar %.3f s %.2f m %.0f dB", w->other[i].period_s, w->other[i].length_m,
                w->other[i].level_db);
    fprintf(out, "%s%s\n", w->frame ? " own parts" : "",
            hypot(w->velocity_mps[0], w->velocity_mps[1]) > 0.0 ? " moving" : "");
}
