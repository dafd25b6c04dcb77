/* SPDX-License-Identifier: MIT */
/* stable_asked - cases Q: questions at the ends of what can be asked. */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

#include "core/fault.h"
#include "grid/answer/limit.h"
#include "tests/lib/ask_map.h"
#include "asked.h"
#include "tests/water/dice.h"
#include "stable.h"
#include "stable_sphere.h"

static const struct sphere_conf usual = {.angular_step_rad = 2 * GEO_PI / 180,
                                         .layers = {.r_max_m = 30, .dr_m = 0.05, .n_const = 29, .growth = 1.035},
                                         .max_cells = 20000,
                                         .forget_s = 160,
                                         .blocked_above = 0.6,
                                         .recentre_m = 0.1};
static const struct answer_conf limits = {.clear_for_s = 30, .move_limit_m = 0.5};

#define LATER_S 20

static struct stable_sphere begin(void)
{
    struct stable_sphere s = stable_sphere(&usual);
    s.store = asked_store();
    return s;
}

static void end(struct stable_sphere *s)
{
    free(s->store);
    free(s->sphere);
}

static void ask_all(const struct stable_sphere *s, const struct obstacles_query *q, struct answer *parts)
{
    const struct asking asking = {sphere_picture(s->sphere),
                                  limits,
                                  {.now_ns = s->t_ns, .pose_fresh = true, .pose = s->pose},
                                  asked_near_m()};
    asked_of_store(&asking, s->store, q, parts);
}

static struct answer ask(const struct stable_sphere *s, double az_deg, double el_deg, double distance_m,
                         double half_deg)
{
    const struct obstacles_query q = {.line = {.az_rad = geo_rad(az_deg),
                                               .el_rad = geo_rad(el_deg),
                                               .distance_m = distance_m,
                                               .half_angle_rad = geo_rad(half_deg)}};
    struct answer a;
    ask_all(s, &q, &a);
    return a;
}

/* Nothing pinged: directions, sectors, places that are called anything but unknown. */
static void nothing(bool quick, struct stable_found *f)
{
    static struct answer sector[72];
    const struct obstacles_query around = {.around = true,
                                           .band = {.lo_rad = -0.2, .hi_rad = 0.2, .reach_m = 5, .count = 72}};
    struct stable_sphere s = begin();
    (void)quick;
    f->ours = 0;
    for (int az = 0; az < 360; az += 5)
        for (int el = -90; el <= 90; el += 15)
            f->ours += ask(&s, az, el, 5, 5).state != ANSWER_UNKNOWN;
    ask_all(&s, &around, sector);
    for (int k = 0; k < 72; k++)
        f->ours += sector[k].state != ANSWER_UNKNOWN;
    f->derived = true;
    f->naive = 72 * 13 + 72; /* distances that begin at the farthest range */
    end(&s);
}

/* An obstacle exactly as far as asked, next to it, at the pole and on the seam: answers that are not blocked. */
static void at_the_edge(bool quick, struct stable_found *f)
{
    static const double az_deg[] = {0, 359.9999, 180, 90, 0.0001};
    (void)quick;
    f->naive = f->ours = 0;
    for (size_t k = 0; k < sizeof az_deg / sizeof az_deg[0]; k++)
        for (double range_m = 0.4; range_m < 12; range_m *= 1.7) {
            struct stable_sphere s = begin();
            for (int n = 0; n < 3; n++)
                stable_ping(&s, az_deg[k], range_m, 0);
            f->ours += ask(&s, az_deg[k], 0, (float)range_m, 3).state != ANSWER_BLOCKED;
            f->ours += ask(&s, az_deg[k] - 360, 0, 100, 3).state != ANSWER_BLOCKED;
            f->ours += ask(&s, 0, 90, 100, 90).state != ANSWER_BLOCKED; /* from the pole down to the horizon */
            f->naive += !((float)range_m < (float)range_m);             /* range < distance asked */
            end(&s);
        }
}

/* The speed from which the vehicle can still stop, against long double; naive: -a t + sqrt(a^2 t^2 + 2 a s). */
static void speeds(bool quick, struct stable_found *f)
{
    static const double way[] = {0, -1, 1e-12, 1e-6, 1, 1e7, 1e300}, late[] = {0, 1e-9, 0.5, 1e4},
                        brake[] = {1e-6, 0.2, 1e3};
    (void)quick;
    f->naive = f->ours = 0;
    for (int w = 0; w < 7; w++)
        for (int l = 0; l < 4; l++)
            for (int b = 0; b < 3; b++) {
                const long double a = brake[b], t = late[l], s = way[w];
                const long double want = s > 0 ? 2 * s / (t + sqrtl(t * t + 2 * s / a)) : 0;
                const double got = limit_speed(brake[b], late[l], way[w]);
                const double plain =
                    -brake[b] * late[l] + sqrt(pow(brake[b] * late[l], 2) + 2 * brake[b] * way[w]);
                if (want == 0) {
                    f->ours = stable_worse(f->ours, fabs(got));
                    continue;
                }
                f->ours = stable_worse(f->ours, fabs((double)(got / want - 1)));
                f->naive = stable_worse(f->naive, fabs((double)(plain / want - 1)));
            }
}

/* ---- in the voxel map ---- */

struct sea_map {
    struct voxmap map;
    struct voxmask mask;
    void *memory[2];
};

/* A ball of free water of 3 m. */
static void open_water(struct sea_map *m)
{
    const struct voxmap_setting s = {.voxel_m = 0.1,
                                     .side = 8,
                                     .height = 80,
                                     .n_tiles = 400,
                                     .max_submaps = 8,
                                     .keep_echoes = true,
                                     .rule = {.threshold = 2, .echo_weight = 4},
                                     .opening = 1,
                                     .weight_levels = 1,
                                     .submap_path_m = INFINITY,
                                     .submap_ns = VOXMAP_NEVER,
                                     .half_life_ns = VOXMAP_NEVER};
    static const struct voxmap_sensor sensor = {.mount = {.attitude = {1, 0, 0, 0}}, .shape = CAST_WEDGE};
    struct beam_echoes beam = {.state = BEAM_SILENT};
    const struct echoes e = {.n_beams = 1,
                             .az_aperture_rad = 0.05f,
                             .el_aperture_rad = 0.5f,
                             .beam = &beam,
                             .pose = {.attitude = {1, 0, 0, 0},
                                      .position_m = {0.01, 0.01, 0.01},
                                      .has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH}};
    struct fault fault;
    m->memory[0] = stable_memory(voxmap_bytes(&s, &fault));
    m->memory[1] = stable_memory(voxmask_bytes(1024));
    voxmap_init(&m->map, &s, m->memory[0]);
    voxmask_init(&m->mask, &m->map, m->memory[1], 1024);
    voxmap_enter(&m->map, &e, &sensor);
    const struct lattice_place here = {{0, 0, 0}, {0.5, 0.5, 0.5}};
    m->map.current->map.now = ++m->map.change;
    submap_body(&m->map.current->map, &here, &here, 30, 9);
}

static void close_water(struct sea_map *m)
{
    free(m->memory[0]);
    free(m->memory[1]);
}

/* Corridors of length 0 to 1e160: answers that are neither right nor refused. Naive: d . d / |d|^2 in double. */
static void capsules(bool quick, struct stable_found *f)
{
    static const struct {
        double length_m;
        int want; /* 1: free, 0: refused */
    } row[] = {{0, 1},     {1e-320, 1}, {1e-160, 1},   {1e-9, 1}, {1, 1},
               {1e160, 0}, {1e308, 0},  {INFINITY, 0}, {NAN, 0}};
    struct sea_map m;

    (void)quick;
    open_water(&m);
    f->naive = f->ours = 0;
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const double l = row[i].length_m, way[2][3] = {{0, 0, 0}, {l, l, 0}};
        struct free_answer a;
        const bool answered = free_query_corridor(&m.mask, way, 2, 0.5, &a);
        f->ours += answered != (row[i].want == 1) || (answered && a.state != VOXEL_FREE);
        f->naive += !isfinite(0.3 * l / (l * l + l * l));
    }
    close_water(&m);
}

/* One nanosecond before the age limit of clear, and at it: wrong answers. Naive: seconds since start in float. */
static void ages(bool quick, struct stable_found *f)
{
    static const uint64_t started_s[] = {1, 1000, 100000, 31557600};
    (void)quick;
    f->naive = f->ours = 0;
    for (int k = 0; k < 4; k++) {
        struct stable_sphere s = begin();
        s.t_ns = started_s[k] * STABLE_SECOND;
        const uint64_t t0 = s.t_ns;
        for (double az = -12; az <= 12; az++)
            stable_ping(&s, az, 0, 10);
        for (int n = 0; n < 3; n++)
            stable_ping(&s, 90, 4, 0);
        s.t_ns = t0 + 30 * STABLE_SECOND - 1;
        f->ours += ask(&s, 0, 0, 8, 1).state != ANSWER_CLEAR;
        s.t_ns += 1;
        f->ours += ask(&s, 0, 0, 8, 1).state != ANSWER_UNKNOWN;
        f->ours += ask(&s, 90, 0, 8, 1).state != ANSWER_BLOCKED;
        const float then = (float)started_s[k], now = (float)((double)started_s[k] + 30.01);
        f->naive += !(now - then > 30);
        end(&s);
    }
}

/*
 * Growing what is asked never turns blocked or unknown into clear. Nor does time, but where a beam has passed since
 * the last echo: when that has faded, all that the water rests on must be newer. Naive: a ray along the axis, whatever
 * the width.
 */
static void monotone(bool quick, struct stable_found *f)
{
    struct dice dice = dice_of(6, 0);
    f->naive = f->ours = 0;
    for (int world = 0; world < (quick ? 5 : 40); world++) {
        struct stable_sphere s = begin();
        for (int n = 0; n < 400; n++) {
            s.t_ns += STABLE_SECOND / 20;
            const double az = 360 * dice_uniform(&dice);
            stable_ping(&s, az, dice_uniform(&dice) < 0.2 ? 1 + 8 * dice_uniform(&dice) : 0, 9);
        }
        for (int n = 0; n < 200; n++) {
            const double az = 360 * dice_uniform(&dice), d = 0.5 + 9 * dice_uniform(&dice),
                         half = 10 * dice_uniform(&dice);
            const struct answer less = ask(&s, az, 0, d, half);
            const enum answer_state wide = ask(&s, az, 0, d, half + 5 * dice_uniform(&dice)).state;
            const enum answer_state far = ask(&s, az, 0, d + dice_uniform(&dice), half).state;
            s.t_ns += LATER_S * STABLE_SECOND;
            const struct answer later = ask(&s, az, 0, d, half);
            s.t_ns -= LATER_S * STABLE_SECOND;
            const bool passed = less.state == ANSWER_BLOCKED && later.age_s < less.age_s + LATER_S;
            f->ours += less.state != ANSWER_CLEAR &&
                       (wide == ANSWER_CLEAR || far == ANSWER_CLEAR || (later.state == ANSWER_CLEAR && !passed));
            f->naive += less.state != ANSWER_CLEAR && ask(&s, az, 0, d, 0.01).state == ANSWER_CLEAR;
        }
        end(&s);
    }
}

const struct stable_case stable_asked[] = {
    {"Q1", "nothing pinged", "answers other than unknown", "distances that begin at the farthest", 0, nothing},
    {"Q2", "an obstacle exactly as far as asked; pole and seam", "not blocked", "range < distance", 0,
     at_the_edge},
    {"Q3", "ways of 1e-12 to 1e300 m, braking 1e-6 to 1e3", "relative error of the speed",
     "-a t + sqrt(a^2 t^2 + 2 a s)", 1e-9, speeds},
    {"Q4", "corridors of 0, 1e-160, 1e160 m, NaN", "wrong answers", "dot product over squared length", 0,
     capsules},
    {"Q5", "at the age limit and 1 ns before, up to a year after the start", "wrong answers", "seconds in float",
     0, ages},
    {"Q6", "wider, farther, later questions", "clear although the smaller was not", "a ray along the axis", 0,
     monotone},
    {0},
};
