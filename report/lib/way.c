/* SPDX-License-Identifier: MIT */
/* way - a recorded way, for any configuration; see way.h. */
#include "way.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/fault.h"
#include "daemon/methods/environment.h"
#include "daemon/methods/verdict_job.h"
#include "daemon/wiring.h"
#include "tests/water/dice.h"
#include "grid/range/background_keep.h"
#include "grid/range/background_learn.h"
#include "tests/lib/ask_map.h"

#define RANGE_M   12.0
#define PING_NS   UINT64_C(70000000)
#define POSE_NS   UINT64_C(100000000)
#define BEGIN_NS  UINT64_C(1000000000000)
#define TURN      200 /* pings */
#define SCANS     2   /* that a template is learnt from, while it stands */
#define SPEED_MPS 0.15
#define YAW_RAD   0.35 /* to and fro, in YAW_S */
#define YAW_S     20.0
#define CLEAR_M   0.5 /* it stops where something is so near */
#define PAST_M    0.25
#define RODS      2
#define ROD_COUNT 230

static const double rod_deg[RODS][2] = {{36, 42}, {216, 222}}, rod_m[2] = {0.55, 0.7};

static void give_up(const char *what)
{
    fprintf(stderr, "way: %s\n", what);
    exit(1);
}

/* ---- recording ---- */

static void add_rods(struct way_ping *heard, double az_deg)
{
    for (int r = 0; r < RODS; r++)
        if (az_deg >= rod_deg[r][0] && az_deg <= rod_deg[r][1])
            memset(heard->samples + (int)(rod_m[0] / RANGE_M * WAY_BINS), ROD_COUNT,
                   (size_t)((rod_m[1] - rod_m[0]) / RANGE_M * WAY_BINS));
}

static void record_ping(struct way *way, unsigned seed, const double place_m[3], double heading_rad, uint64_t t_ns)
{
    const unsigned n = way->pings++, step = n % TURN;
    struct way_ping *heard = &way->ping[n];
    struct ping ping = {.max_beams = 1, .max_samples = WAY_BINS, .beam = &heard->beam, .samples = heard->samples};
    const struct pilot_shot shot = {.world = &way->world,
                                    .seed = seed,
                                    .mount = &mount_identity,
                                    .place_m = {place_m[0], place_m[1], place_m[2]},
                                    .heading_rad = heading_rad,
                                    .t_s = (double)(t_ns - BEGIN_NS) * 1e-9,
                                    .number = n + 1,
                                    .aimed = true,
                                    .head_units = step * 2,
                                    .range_m = RANGE_M,
                                    .new_turn = step == 0};
    pilot_sonar_hear(PILOT_PING360, &shot, &ping);
    ping.t_ns = ping.t_in_ns = t_ns;
    ping.seq = n + 1;
    add_rods(heard, step * 360.0 / TURN);
    heard->ping = ping;
}

static void record_truth(struct way *way, const double place_m[3], double heading_rad, uint64_t t_ns)
{
    double *wall_m = way->ask[way->asks].wall_m;
    way->ask[way->asks++].t_ns = t_ns;
    for (int s = 0; s < WAY_SECTORS; s++) {
        const struct place_fan fan = {
            heading_rad + GEO_TURN * s / WAY_SECTORS, 0, GEO_TURN / 2 / WAY_SECTORS, geo_rad(5), 5, 5};
        wall_m[s] = place_nearest(&way->world, place_m, &fan, (double)(t_ns - BEGIN_NS) * 1e-9);
    }
}

static void record_points(struct way *way, const double end_m[3], unsigned seed)
{
    struct dice dice = dice_of(seed, 77);
    for (unsigned i = 0; i < WAY_POINTS; i++) {
        const double share = dice_uniform(&dice), az = GEO_TURN * dice_uniform(&dice), r = 8 * dice_uniform(&dice);
        way->point_m[i][0] = share * end_m[0] + r * cos(az);
        way->point_m[i][1] = share * end_m[1] + r * sin(az);
        way->point_m[i][2] = 2 * dice_uniform(&dice) - 1;
    }
}

void way_record(struct way *way, unsigned seed, unsigned pings)
{
    struct pilot_vehicle v = {.place_m = {0, 0, 0}};
    struct pilot_instruments instruments;
    uint64_t pose_ns = BEGIN_NS;
    memset(way, 0, sizeof *way);
    way->world = place_of_pilot(seed % 2 ? PILOT_HARBOUR : PILOT_BASIN, seed, &pilot_hull, 1);
    pilot_instruments_init(&instruments, 0.5, dice_of(seed, 9));
    way->learnt = pings > SCANS * TURN ? SCANS * TURN : 0;
    for (uint64_t t_ns = BEGIN_NS; way->pings < pings; t_ns += PING_NS) {
        const double t_s = (double)(t_ns - BEGIN_NS) * 1e-9, dt_s = (double)PING_NS * 1e-9;
        const bool goes =
            way->pings >= way->learnt && place_clearance(&way->world, v.place_m, &pilot_hull, t_s) > CLEAR_M;
        v.velocity_mps[0] = goes ? SPEED_MPS : 0;
        v.place_m[0] += v.velocity_mps[0] * dt_s;
        v.heading_rad = YAW_RAD * sin(GEO_TURN * fmax(0, t_s - way->learnt * dt_s) / YAW_S);
        for (; pose_ns <= t_ns && way->poses < WAY_POSES; pose_ns += POSE_NS) {
            double heading_rad;
            struct pose *p = &way->pose[way->poses++];
            pilot_instruments_read(&instruments, &v, POSE_ATTITUDE | POSE_DEPTH | POSE_VELOCITY | POSE_POSITION,
                                   t_s, p, &heading_rad);
            p->t_ns = pose_ns;
        }
        record_ping(way, seed, v.place_m, v.heading_rad, t_ns);
        if (way->pings > way->learnt && way->asks < WAY_ASKS &&
            way->pings >= way->learnt + (pings - way->learnt) * (way->asks + 1) / WAY_ASKS)
            record_truth(way, v.place_m, v.heading_rad, t_ns);
    }
    record_points(way, v.place_m, seed);
}

/* ---- running ---- */

static void *room(size_t bytes)
{
    void *p = calloc(1, bytes);
    return p ? p : (give_up("no memory"), NULL);
}

static void start(struct methods_env *d, const struct conf *conf)
{
    struct pipeline_conf p;
    struct pose_drift unseen;
    struct fault fault = {""};
    memset(d, 0, sizeof *d);
    d->conf = *conf;
    d->replay = true;
    d->loop = loop_new(true);
    plan_make(&d->conf, &d->plan);
    wiring_pipeline(&d->conf, &d->plan, true, &p);
    p.threads = 0; /* the answers are the same */
    d->pipeline = d->loop ? pipeline_new(&p, &fault) : NULL;
    if (!d->pipeline)
        give_up(fault.text);
    memcpy(d->mount, p.mount, sizeof d->mount);
    pose_log_init(&d->poses, (uint64_t)(d->conf.pose.max_age_s * 1e9));
    pose_log_set_most(&d->poses, d->conf.vehicle.max_speed_mps, d->conf.vehicle.max_turn_radps);
    wiring_drift(&d->conf, &unseen);
    pose_log_set_drift(&d->poses, 0, &unseen);
    wiring_pose_delay(&d->conf, &d->poses);
}

static struct ping ping_of(const struct way_ping *heard)
{
    struct ping ping = heard->ping;
    ping.beam = (struct ping_beam *)&heard->beam;
    ping.samples = (uint8_t *)heard->samples;
    return ping;
}

/* As daemon/background/template.c has it. */
static struct background *template_of(const struct way *way, const struct conf_background *c)
{
    const struct background_learn_conf conf = {.pings = SCANS, .standing = true};
    const struct background_rule rule = {.neighbour_m = c->neighbour_m,
                                         .min_points = (uint32_t)c->min_points,
                                         .min_level = c->min_level,
                                         .extent_m = c->extent_m,
                                         .reach_m = c->reach_m,
                                         .share = c->share,
                                         .ring_m = c->ring_m};
    struct background_shape shape;
    struct background_kept kept;
    struct ping ping = ping_of(&way->ping[0]);
    if (!background_shape_of(&ping, &shape))
        give_up("no shape of a template");
    struct background_learn *learn =
        background_learn_init(room(background_learn_size(&shape, conf.pings)), &shape, &conf, &mount_identity);
    for (unsigned i = 0; i < way->learnt; i++) {
        ping = ping_of(&way->ping[i]);
        background_learn_take(learn, &ping);
    }
    struct background *b = background_init(room(background_size(&shape)), &shape, (uint8_t)c->mask);
    void *work = room(background_keep_size(&shape));
    background_learn_finish(learn, 1, b);
    background_keep(b, &rule, work, &kept);
    free(work);
    free(learn);
    return b;
}

__attribute__((noinline)) void way_enter(struct pipeline *pipeline, const struct way_ping *heard,
                                         const struct pose *pose)
{
    struct ping *ping = pipeline_begin(pipeline);
    struct ping now = heard->ping;
    now.max_beams = ping->max_beams;
    now.max_samples = ping->max_samples;
    now.beam = ping->beam;
    now.samples = ping->samples;
    now.beam[0] = heard->beam;
    memcpy(now.samples, heard->samples, WAY_BINS);
    now.pose = *pose;
    *ping = now;
    pipeline_submit(pipeline, ping);
}

static void judge_sectors(struct methods_env *d, const double *wall_m, struct way_tally *t)
{
    static struct verdict_job job;
    job = (struct verdict_job){
        .d = d,
        .grid = pipeline_grid(d->pipeline, 0),
        .query = {
            .around = true,
            .band = {.lo_rad = -geo_rad(5), .hi_rad = geo_rad(5), .reach_m = WAY_LOOK_M, .count = WAY_SECTORS}}};
    verdict_job_begin(&job);
    while (job.more && verdict_job_step(&job))
        ;
    for (size_t i = 0; i < WAY_SECTORS; i++) {
        const struct answer *said = verdict_of(&job.verdict, i);
        const double free_m = fmin(wall_m[i], WAY_LOOK_M),
                     to_m = said->state == ANSWER_CLEAR ? fmax(said->free_to_m, WAY_LOOK_M) : said->free_to_m;
        t->free_m += free_m;
        t->said_m += fmax(fmin(to_m, free_m), 0);
        if (wall_m[i] < WAY_LOOK_M - PAST_M) {
            t->in_way++;
            t->past += to_m > wall_m[i] + PAST_M;
        } else if (wall_m[i] > WAY_LOOK_M + PAST_M) {
            t->open++;
            t->false_block += said->state == ANSWER_BLOCKED;
            t->unknown += said->state == ANSWER_UNKNOWN;
        }
    }
}

#define LIMITS       12
#define WANTED_MPS   0.6
#define RADIUS_M     0.4 /* of the vehicle, which brakes ... */
#define BRAKING_MPS2 0.2 /* ... so well ... */
#define LATENCY_S    0.5 /* ... after so long */

static double ask_limit(struct methods_env *d, double azimuth_rad)
{
    const struct rpc_call call = {.daemon = d, .now_ns = loop_now(d->loop)};
    char line[200], *text = NULL;
    snprintf(line, sizeof line,
             "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"limit\",\"params\":{\"velocity_mps\":[%.9f,%.9f,0]}}",
             WANTED_MPS * cos(azimuth_rad), WANTED_MPS * sin(azimuth_rad));
    struct rpc_job *job = rpc_begin(&call, line, strlen(line));
    while (rpc_step(job, daemon_methods, &call))
        ;
    rpc_end(job, &text);
    json_t *reply = json_loads(text, 0, NULL);
    const double mps = json_number_value(json_object_get(json_object_get(reply, "result"), "speed_mps"));
    json_decref(reply);
    free(text);
    return mps;
}

static void judge_limits(struct methods_env *d, const double *wall_m, struct way_tally *t)
{
    for (int i = 0; i < LIMITS; i++) {
        const double mps = ask_limit(d, GEO_TURN * i / LIMITS),
                     stops_m = mps * LATENCY_S + mps * mps / (2 * BRAKING_MPS2);
        t->asked_limits++;
        t->limit_mps += mps;
        t->too_fast += stops_m > wall_m[i * WAY_SECTORS / LIMITS] - RADIUS_M;
    }
}

static double processor_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

struct asking {
    const struct way *way;
    struct way_tally *tally;
};

static void judge_map(void *ctx, struct pipeline_map *map)
{
    const struct asking *a = ctx;
    for (unsigned i = 0; i < WAY_POINTS; i++) {
        struct free_answer answer;
        const bool solid = place_clearance(&a->way->world, a->way->point_m[i], NULL, 0) < 0;
        const bool is_free =
            free_query_point(&map->mask, a->way->point_m[i], &answer) && answer.state == VOXEL_FREE;
        *(solid ? &a->tally->map_solid : &a->tally->map_open) += 1;
        *(solid ? &a->tally->map_false : &a->tally->map_said) += is_free;
    }
}

void way_run(const struct way *way, const struct conf *conf, bool learn, struct way_tally *tally)
{
    static struct methods_env d;
    static uint8_t level[WAY_BINS], blind[WAY_BINS];
    struct background *template = learn && way->learnt ? template_of(way, &conf->background) : NULL;
    unsigned pose = 0, ask = 0;
    start(&d, conf);
    if (template) {
        struct background_job job = {.call = {.extracts = true, .pipeline = d.pipeline},
                                     .background = {.use = template,
                                                    .view = {.level = level, .blind = blind},
                                                    .open_water = conf->background.open_water == 1}};
        pipeline_take_background(&job, NULL);
    }
    for (unsigned i = way->learnt; i < way->pings; i++) {
        const struct way_ping *heard = &way->ping[i];
        struct pose at;
        for (; pose < way->poses && way->pose[pose].t_ns <= heard->ping.t_ns; pose++)
            pose_log_put(&d.poses, &way->pose[pose]);
        loop_advance(d.loop, heard->ping.t_ns);
        at = pose_identity;
        pose_log_at(&d.poses, heard->ping.t_ns, &at);
        const double begin_ns = processor_ns();
        way_enter(d.pipeline, heard, &at);
        tally->ns += processor_ns() - begin_ns;
        tally->pings++;
        if (ask < way->asks && heard->ping.t_ns == way->ask[ask].t_ns) {
            judge_sectors(&d, way->ask[ask].wall_m, tally);
            judge_limits(&d, way->ask[ask++].wall_m, tally);
        }
    }
    if (pipeline_has_map(d.pipeline))
        owner_run_map_now(d.pipeline, judge_map, &(struct asking){way, tally});
    pipeline_free(d.pipeline);
    loop_free(d.loop);
    free(template);
}
