/* SPDX-License-Identifier: MIT */
/* sea - pings of a made-up sea; see sea.h. */
#include "sea.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "tests/water/scene.h"

#define MAX_RAYS      640
#define STEP_DEG      0.9
#define ABSORPTION    0.4 /* dB per metre, there and back */
#define RING_DB_PER_M 250.0
#define TAIL_STEPS    12
#define FRAME_DB      (-6.0)
#define BURST_DB      (-18.0)
#define RAISED_DB     18.0
#define STRAY_SHARE   0.001
#define STRAY_DB      (-48.0)

#define QUIET (-44.0) /* 20 counts of a Ping360 */
#define WALL  (-6.0)
#define USUAL WALL, 0, QUIET, -60, 0.2, 0, 0, 0

const struct sea_scene sea_scenes[] = {
    {"open", "open water, nothing within range", "", USUAL},
    {"wall close", "a wall at 0.45 m, hardly beyond the ring-down", "slope 0.45 0 0", USUAL},
    {"wall near", "a wall at 2 m, square on in the middle of the scan", "slope 2 0 0", USUAL},
    {"wall far", "a wall at 8 m", "slope 8 0 0", USUAL},
    {"wall 30", "a wall seen at 12 to 48 degrees off square", "slope 4 30 0", USUAL},
    {"wall 60", "a wall seen at 42 to 78 degrees off square", "slope 2.5 60 0", USUAL},
    {"weak wall", "a wall at 5 m, 16 dB fainter than the others", "slope 5 0 0", WALL - 16, 0, QUIET, -60, 0.2, 0,
     0, 0},
    {"pile", "a pile of 30 cm at 4 m in front of a wall at 8 m", "cylinder 4 0 0.15\nslope 8 0 0", USUAL},
    {"two close", "a pile of 30 cm whose front is 45 cm before a wall", "cylinder 4 0 0.15\nslope 4.3 0 0", USUAL},
    {"soft bottom",
     "a sloping bottom whose echo has no edge: it begins far out in the opening and decays over 40 cm",
     "slope 2.5 0 -60", WALL - 4, 0.4, QUIET, -60, 0.2, 0, 0, 0},
    {"reverberation", "a wall at 5 m behind strong reverberation that falls with range", "slope 5 0 0", WALL, 0,
     QUIET, -22, 0.2, 0, 0, 0},
    {"zero floor", "a wall at 8 m over zeros and stray counts", "slope 8 0 0", WALL, 0, -INFINITY, -100, 0.2, 0, 0,
     0},
    {"raised floor", "a wall at 8 m; one ping in five has 18 dB more noise", "slope 8 0 0", WALL, 0, QUIET, -60,
     0.2, 0.2, 0, 0},
    {"interference", "a wall at 8 m; bursts of other sound in one ping of six", "slope 8 0 0", WALL, 0, QUIET, -60,
     0.2, 0, 0.17, 0},
    {"ring-down", "a wall at 0.7 to 0.74 m, a transducer that rings to 0.35 m", "slope 0.7 0 0", WALL, 0, QUIET,
     -50, 0.35, 0, 0, 0},
    {"own frame", "the vehicle's own frame at 0.9 m in a quarter of the beams, a wall at 5 m", "slope 5 0 0", WALL,
     0, QUIET, -60, 0.2, 0, 0, 0.9},
};
_Static_assert(sizeof sea_scenes / sizeof sea_scenes[0] <= SEA_MAX_SCENES, "room in arrays of scenes");
const unsigned sea_scenes_n = sizeof sea_scenes / sizeof sea_scenes[0];

static const struct {
    uint32_t bins, turn, units_per_step;
    double bin_m, pulse_m;
    double one; /* the count of power 1 */
} heads[SOUND_HEADS] = {
    [SOUND_PING360] = {600, 400, 1, 0.02, 0.06, 255.0},
    [SOUND_MICRON] = {400, 6400, 16, 0.025, 0.075, 255.0 - 25.0 / SOUND_MICRON_DB},
};

/* Every scene has random numbers of its own. */
static uint64_t stream_of(const char *name)
{
    uint64_t hash = 14695981039346656037u;
    for (; *name; name++)
        hash = (hash ^ (uint8_t)*name) * 1099511628211u;
    return hash;
}

/* Parsing a scene's text takes longer than a beam; the last one is kept. */
static const struct place *shapes_of(const struct sea_scene *sea)
{
    static struct place scene;
    static const char *parsed;
    struct fault fault;
    if (parsed == sea->shapes)
        return &scene;
    if (!scene_parse(&scene, sea->name, sea->shapes, &fault)) {
        fprintf(stderr, "sea: %s\n", fault.text);
        exit(1);
    }
    parsed = sea->shapes;
    return &scene;
}

static void add_power(const struct ping *head, double range_m, double power, double *mean)
{
    const double bin = range_m / (round(1e9 * (double)head->dr_m) / 1e9); /* walls stand at round ranges */
    if (bin < head->n_bins)
        mean[(uint32_t)bin] += power;
}

/* A soft bottom's echo decays: quantiles of the exponential. */
static void add_surface(const struct sea_sound *sound, const struct ping *head, double range_m, double power,
                        double *mean)
{
    const int steps = sound->tail_m > 0.0 ? TAIL_STEPS : 1;
    for (int k = 0; k < steps; k++)
        add_power(head, range_m - (steps > 1 ? sound->tail_m * log1p(-(k + 0.5) / steps) : 0.0), power / steps,
                  mean);
}

/* With its second bounces. */
static void add_hit(const struct sea_sound *sound, const struct place *place, const struct ping *head,
                    const struct place_hit *hit, double weight, double *mean)
{
    const double square = sound->rough + (1.0 - sound->rough) * hit->cos_incidence;
    const double soft_db = hit->level ? place->level_db : 0.0;
    const double echo = weight * square * sound_power(sound->surface_db + soft_db - ABSORPTION * hit->range_m);
    const double back = sound->square_on > 0.0 ? hit->cos_incidence >= sound->square_on : pow(square, 8.0);
    const double bounce_m[2] = {2.0 * hit->range_m, hit->ghost_m};
    add_surface(sound, head, hit->range_m, echo, mean);
    for (int k = 0; k < 2; k++)
        if (sound->bounce_db[k] < 0.0)
            add_power(head, bounce_m[k],
                      echo * back * sound_power(sound->bounce_db[k] - ABSORPTION * (bounce_m[k] - hit->range_m)),
                      mean);
}

struct sea_met sea_surfaces(const struct sea_sound *sound, const struct place *place, const double from[3],
                            const double attitude[4], double t_s, const struct ping *head, double *mean)
{
    struct sea_met met = {INFINITY, INFINITY, 0.0};
    const int n_az = sound->rays_az, n_el = sound->rays_el;
    struct sound_ray fan[MAX_RAYS];
    double axis_m = INFINITY;
    sound_fan(sound->spread, 1.0, n_az, n_el, NULL, fan);
    for (int n = 0; n < n_az * n_el; n++) {
        const struct sound_ray *ray = &fan[n];
        struct place_hit hit;
        double in_beam[3], d[3];
        geo_direction(ray->az * (double)head->az_aperture_rad, ray->el * (double)head->el_aperture_rad, in_beam);
        quat_rotate(attitude, in_beam, d);
        if (!place_cast(place, from, d, t_s, &hit))
            continue;
        add_hit(sound, place, head, &hit, ray->weight * (double)(head->pulse_m / head->dr_m), mean);
        met.skirt_m = fmin(met.skirt_m, hit.range_m);
        if (fabs(ray->az) <= 0.5 && fabs(ray->el) <= 0.5) {
            met.nearest_m = fmin(met.nearest_m, hit.range_m);
            met.farthest_m = fmax(met.farthest_m, hit.range_m);
        }
        if (n == n_az / 2 * n_el + n_el / 2)
            axis_m = hit.range_m;
    }
    met.farthest_m = isfinite(axis_m) ? axis_m : met.farthest_m;
    return met;
}

/* What is no surface. */
static void disturb(const struct sea_scene *sea, enum sound_head head, bool framed, struct dice *dice,
                    double *mean)
{
    const bool raised = dice_uniform(dice) < sea->raised_share, burst = dice_uniform(dice) < sea->burst_share;
    const double burst_m = 2.0 + 8.0 * dice_uniform(dice), burst_end_m = burst_m + 1.0 + 2.0 * dice_uniform(dice);
    const double reverb_power = sound_power(sea->reverb_db);
    const double floor_power =
        isfinite(sea->floor_db) ? sound_power(sea->floor_db + (raised ? RAISED_DB : 0.0)) : 0.0;

    for (uint32_t i = 0; i < heads[head].bins; i++) {
        const double r_m = (i + 0.5) * heads[head].bin_m;
        mean[i] += floor_power + reverb_power / (fmax(r_m, 0.3) * fmax(r_m, 0.3) * fmax(r_m, 0.3));
        if (burst && r_m >= burst_m && r_m < burst_end_m)
            mean[i] += sound_power(BURST_DB);
    }
    if (sea->frame_m > 0.0 && framed)
        mean[(uint32_t)(sea->frame_m / heads[head].bin_m)] +=
            sound_power(FRAME_DB) * heads[head].pulse_m / heads[head].bin_m;
}

void sea_hear(const struct sea_scene *sea, enum sound_head head, bool framed, struct dice *dice, double *mean,
              uint8_t *samples)
{
    const uint32_t pulse = (uint32_t)(heads[head].pulse_m / heads[head].bin_m + 0.5);
    double complex field[SEA_MAX_BINS];
    disturb(sea, head, framed, dice, mean);
    for (uint32_t i = 0; i < heads[head].bins; i++)
        field[i] = sqrt(mean[i] / pulse) * dice_normal(dice);
    sound_pulse(field, heads[head].bins, pulse);
    for (uint32_t i = 0; i < heads[head].bins; i++) {
        const double ring_db = 10.0 - fmax(0.0, (i + 0.5) * heads[head].bin_m - sea->ring_m) * RING_DB_PER_M;
        const bool stray = !isfinite(sea->floor_db) && dice_uniform(dice) < STRAY_SHARE;
        const double power = sound_intensity(field[i]) + (stray ? sound_power(STRAY_DB) : 0.0) +
                             sound_power(ring_db - (head == SOUND_MICRON ? 10.0 : 0.0));
        samples[i] = sound_byte(sound_count(sound_heads[head].law, power, heads[head].one, SOUND_MICRON_DB));
    }
}

struct ping sea_ping_of(enum sound_head head)
{
    return (struct ping){
        .kind = PING_PROFILE,
        .law = (uint8_t)sound_heads[head].law,
        .sample_bytes = 1,
        .n_beams = 1,
        .n_bins = heads[head].bins,
        .db_per_count = (float)SOUND_MICRON_DB,
        .dr_m = (float)heads[head].bin_m,
        .pulse_m = (float)heads[head].pulse_m,
        .az_aperture_rad = (float)geo_rad(sound_heads[head].az_deg),
        .el_aperture_rad = (float)geo_rad(sound_heads[head].el_deg),
        .head_turn = heads[head].turn,
        .max_beams = 1,
        .max_samples = SEA_MAX_BINS,
    };
}

void sea_turn(const struct sea_sound *sound, const struct place *place, double yaw_rad, double longer, uint32_t i,
              struct dice *dice, struct sea_ping *out)
{
    const uint32_t turn = heads[SOUND_PING360].turn;
    double mean[SEA_MAX_BINS] = {0}, attitude[4];
    *out = (struct sea_ping){.ping = sea_ping_of(SOUND_PING360),
                             .axis.az_rad = (float)(GEO_TURN * (i % turn) / turn)};
    out->ping.dr_m *= (float)longer;
    out->ping.pulse_m *= (float)longer;
    out->ping.seq = i + 1;
    out->ping.head_units = i % turn;
    out->ping.flags = i % turn == 0 ? PING_NEW_TURN : 0;
    out->ping.pose = pose_identity;
    out->ping.pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    out->ping.beam = &out->axis;
    out->ping.samples = out->samples;
    quat_from_rpy(0.0, 0.0, yaw_rad + (double)out->axis.az_rad, attitude);
    out->met = sea_surfaces(sound, place, (const double[3]){0}, attitude, 0.0, &out->ping, mean);
    sea_hear(&sea_scenes[0], SOUND_PING360, false, dice, mean, out->samples);
}

void sea_listen(const struct sea_scene *scene, enum sound_head head, uint64_t seed, unsigned beam,
                struct sea_ping *out)
{
    struct dice dice = dice_of(seed * SOUND_HEADS + head, stream_of(scene->name) * SEA_BEAMS + beam);
    const int steps = (int)beam - SEA_BEAMS / 2;
    const uint32_t turn = heads[head].turn;
    const struct sea_sound sound = {
        .surface_db = scene->surface_db, .tail_m = scene->tail_m, .rays_az = 11, .rays_el = 41};
    double mean[SEA_MAX_BINS] = {0}, attitude[4];
    *out = (struct sea_ping){.ping = sea_ping_of(head), .axis.az_rad = (float)geo_rad(steps * STEP_DEG)};
    out->ping.t_ns = (seed * SEA_BEAMS + beam) * 50000000u;
    out->ping.seq = beam + 1;
    out->ping.head_units = (turn + (uint32_t)steps * heads[head].units_per_step) % turn;
    out->ping.beam = &out->axis;
    out->ping.samples = out->samples;
    quat_from_rpy(0.0, 0.0, geo_rad(steps * STEP_DEG), attitude);
    out->met = sea_surfaces(&sound, shapes_of(scene), (const double[3]){0}, attitude, 0.0, &out->ping, mean);
    if (out->met.nearest_m > heads[head].bins * heads[head].bin_m - heads[head].pulse_m)
        out->met.nearest_m = out->met.farthest_m = INFINITY;
    sea_hear(scene, head, beam >= SEA_BEAMS / 2 && beam < SEA_BEAMS * 3 / 4, &dice, mean, out->samples);
}
