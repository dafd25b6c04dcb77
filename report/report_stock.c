/* SPDX-License-Identifier: MIT */
/*
 * report_stock - a BlueROV2 without a DVL (config/scenes/bluerov2-stock.conf), in place and creeping ahead: how many of
 * the free metres within look_ahead are said to be free, and is anything said that is not.
 *
 * The vehicle is that of tests/lib/rov.h, in six degrees of freedom, in water that goes as fast as `current` promises
 * or less. Its pulses bound its speed as sonard-mavlink does it (speed_bound.h, VFR_HUD comes, a full battery, no
 * coasting test but where a row says so), and steer the head. Pings are those of tests/pilot, at the pace of the head's
 * motor and line; worlds are its harbours and basins. All goes through the daemon's pipeline and methods.
 *
 *   report_stock table [FIRST [LAST]]   of seeds FIRST to LAST (912101 to 912106; quick: 912101), for people
 *   report_stock csv [FIRST [LAST] | quick]
 *
 * STOCK_LINE=baud (921600) is the line of the head, STOCK_CONF=file another configuration.
 *
 * Free, for a sector of 5 degrees: from the ring-down to the nearest surface in the beam's height, or look_ahead.
 * False: a sector that says more than 0.25 m past a surface that stands within 5 degrees of level.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "daemon/methods/verdict_job.h"
#include "daemon/methods/query_context.h"
#include "drivers/devices/ping360.h"
#include "tests/lib/daemon_rig.h"
#include "tests/lib/rov.h"
#include "tests/pilot/head.h"
#include "tests/pilot/rov_bound.h"
#include "tests/pilot/run.h"

#define FIRST       912101u
#define SEEDS       6
#define SECTORS     72
#define RING_M      0.75
#define PAST_M      0.25
#define CLEAR_M     0.3 /* the vehicle stops being watched as near to something */
#define TICK_S      0.01
#define SAMPLE      5  /* ticks: ROV_BOUND_S */
#define POSE        10 /* ... and 10 poses */
#define LOOK        50
#define ASK         100
#define REST_S      40 /* idle, and at the end stabilised: the bound forgets the start; then ... */
#define MANOEUVRE_S 12 /* ... it does what it does, until it is ... */
#define WATCH_S     40 /* ... watched */

static const struct manoeuvre {
    const char *name;
    double current_mps;
    bool creeps, drag; /* goes ahead; its drag is as a coasting test has it */
    const char *key, *value;
} manoeuvres[] = {{"in place, 0.05 m/s", .current_mps = 0.05},
                  {"in place, 0.2 m/s", .current_mps = 0.2},
                  {"creeping, 0.05 m/s", .current_mps = 0.05, .creeps = true},
                  {"creeping, max_speed 0.3 m/s", 0.05, true, .key = "max_speed", .value = "0.3 m/s"},
                  {"in place, coasting test", .current_mps = 0.05, .drag = true},
                  {"in place, station_keeping", 0.05, .key = "station_keeping", .value = "0.05 m/s"}};
#define MANOEUVRES (sizeof manoeuvres / sizeof manoeuvres[0])

static const enum pilot_place where[] = {PILOT_HARBOUR, PILOT_BASIN};
#define PLACES (sizeof where / sizeof where[0])

struct count {
    unsigned sectors, wrong, clear, said_clear;
    double free_m, said_m, seen_m; /* said: up to free_to; seen: of that what is not nearer than blind_to */
    double bound_mps, speed_mps;
    unsigned asked;
};

static struct count counts[MANOEUVRES][PLACES];

struct dive {
    const struct manoeuvre *what;
    struct rov rov;
    struct rov_sticks sticks;
    struct place world;
    struct rov_bound bound;
    struct pilot_head head;
    double start_m[3]; /* where it was when the scene began */
    double t_s, speed_mps;
    double next_ping_s;
    uint32_t pings;
    double line_s;
    double look_m;
    uint64_t seed;
};

static double heading_of(const struct rov *r)
{
    double m[3][3];
    rov_axes(r, m);
    return atan2(m[1][0], m[0][0]);
}

static uint64_t ns_of(double t_s)
{
    return (uint64_t)((1000 + t_s) * 1e9);
}

/* As sonard-mavlink: the bound of the speed, and which way the thrusters push. */
static void sample(struct dive *v)
{
    double ground[3], mps[DRIFT_WAYS], n[2];
    rov_bound_sample(&v->bound, &v->rov, mps, n);
    pose_log_bound(&d.poses, ns_of(v->t_s), mps);
    push_put(&d.push, ns_of(v->t_s), n);
    rov_velocity(&v->rov, ground);
    v->speed_mps = hypot(ground[0], ground[1]);
}

static void tell_pose(const struct dive *v)
{
    struct pose p = pose_identity;
    p.t_ns = ns_of(v->t_s);
    p.has = POSE_ATTITUDE | POSE_DEPTH;
    quat_from_rpy(0, 0, heading_of(&v->rov), p.attitude);
    p.position_m[2] = v->rov.place_m[2];
    pose_log_put(&d.poses, &p);
}

static void place_of(const struct dive *v, double place_m[3])
{
    for (int i = 0; i < 3; i++)
        place_m[i] = v->rov.place_m[i] - v->start_m[i];
}

#define MOTOR_S     0.006 /* a gradian; and ... */
#define HEAD_S      0.018 /* ... from the last sample to the first byte (docs/devices/ping360.md) */
#define REPLY_BYTES 24    /* beside the samples */

static void hear(struct dive *v)
{
    const double range_m = d.conf.sonar[0].range_m;
    struct pilot_shot shot = {.world = &v->world,
                              .seed = v->seed,
                              .mount = d.mount,
                              .heading_rad = heading_of(&v->rov),
                              .t_s = v->t_s,
                              .number = ++v->pings,
                              .aimed = true,
                              .range_m = range_m};
    const int turns = pilot_head_ping(&v->head, ns_of(v->t_s), &shot.head_units, &shot.new_turn);
    place_of(v, shot.place_m);
    struct ping *ping = pipeline_begin(d.pipeline);
    ping->t_ns = ping->t_in_ns = ns_of(v->t_s);
    pilot_sonar_hear(PILOT_PING360, &shot, ping);
    pose_log_at(&d.poses, ping->t_ns, &ping->pose);
    pipeline_submit(d.pipeline, ping);
    v->next_ping_s = v->t_s + turns * MOTOR_S + HEAD_S + 2 * range_m / 1500 + v->line_s;
}

/* ---- what is said, and what is true ---- */

/* The nearest surface in a sector, up and down by so much, from a place of the vehicle's. */
static double nearest_m(const struct dive *v, const double from_m[3], double az_rad, double high_rad)
{
    return place_nearest(&v->world, from_m, &(struct place_fan){az_rad, 0, geo_rad(2.5), high_rad, 7, 13}, v->t_s);
}

static void look_around(struct dive *v, struct count *n)
{
    static struct verdict_job job;
    double place_m[3], head_m[3], attitude[4];
    place_of(v, place_m);
    quat_from_rpy(0, 0, heading_of(&v->rov), attitude);
    quat_rotate(attitude, d.mount[0].position_m, head_m);
    for (int i = 0; i < 3; i++)
        head_m[i] += place_m[i];
    job = (struct verdict_job){
        .d = &d,
        .grid = pipeline_grid(d.pipeline, 0),
        .query = {.around = true,
                  .band = {.lo_rad = -geo_rad(5), .hi_rad = geo_rad(5), .reach_m = v->look_m, .count = SECTORS}}};
    verdict_job_begin(&job);
    while (job.more && verdict_job_step(&job))
        ;
    for (size_t i = 0; i < SECTORS; i++) {
        const struct answer *said = verdict_of(&job.verdict, i);
        const double az = (double)i * GEO_TURN / SECTORS;
        if (v->what->creeps && fabs(geo_wrap_pi(az)) > geo_rad(30.1))
            continue;
        const double yaw = heading_of(&v->rov), wall_m = nearest_m(v, place_m, az + yaw, geo_rad(5));
        const double true_m = fmin(nearest_m(v, head_m, az + yaw, geo_rad(12.5)), v->look_m);
        const double to_m = said->state == ANSWER_CLEAR ? fmax(said->free_to_m, v->look_m) : said->free_to_m;
        n->sectors++;
        n->wrong += to_m > said->blind_to_m && wall_m > said->blind_to_m && to_m > wall_m + PAST_M;
        n->clear += true_m >= v->look_m;
        n->said_clear += true_m >= v->look_m && said->state == ANSWER_CLEAR;
        n->free_m += fmax(true_m - RING_M, 0);
        n->said_m += fmax(fmin(said->free_to_m, true_m) - RING_M, 0);
        n->seen_m += fmax(fmin(said->free_to_m, true_m) - fmax(said->blind_to_m, RING_M), 0);
    }
    n->asked++;
    n->speed_mps += v->speed_mps;
    n->bound_mps += job.now.pose.drift_mps > 0 && d.poses.unseen.goes_on ? d.poses.unseen.mps[DRIFT_LEVEL]
                                                                         : d.poses.unseen.set.mps;
}

/* ---- a dive ---- */

#define CONF_SIZE 8192

static void fail(const char *why)
{
    fprintf(stderr, "report_stock: %s; run it in the root of the tree\n", why);
    exit(2);
}

/* Of the file's text: that key has another value, or is the first of [vehicle]. */
static void set(char text[CONF_SIZE], const char *key, const char *value)
{
    char was[CONF_SIZE], line[100];
    snprintf(was, sizeof was, "%s", text);
    snprintf(line, sizeof line, "\n%s = ", key);
    char *at = strstr(was, line);
    const char *rest = at ? strchr(at + 1, '\n') : NULL;
    if (!at) {
        at = strstr(was, "\n[vehicle]\n");
        if (!at)
            fail("the configuration has no [vehicle]");
        rest = at += sizeof "\n[vehicle]" - 1;
    }
    snprintf(text, CONF_SIZE, "%.*s%s%s%s", (int)(at - was), was, line, value, rest ? rest : "\n");
}

/* The scene as it is shipped, in other water and with what else is promised. */
static const char *read_conf(const struct manoeuvre *what)
{
    static char text[CONF_SIZE];
    char value[20];
    const char *path = getenv("STOCK_CONF");
    FILE *f = fopen(path ? path : "config/scenes/bluerov2-stock.conf", "r");
    const size_t n = f ? fread(text, 1, sizeof text - 1, f) : 0;
    if (f)
        fclose(f);
    text[n] = '\0';
    snprintf(value, sizeof value, "%g m/s", what->current_mps);
    set(text, "current", value);
    if (what->key)
        set(text, what->key, what->value);
    return text;
}

/* B of `--drag 0,B`, as docs/without-a-dvl.md has it measured: coasting from 1 to 0.5 m/s. One of the drawn vehicles
 * has no water that moves with it, and is lighter than any real one: its mass counts. */
static double coasted(const struct rov *r)
{
    const double a = r->linear[0], b = r->square[0], m = r->mass[0];
    /* d of m v' = -a v - b v^2 between these speeds */
    const double d_m = b > 0 ? m / b * log((a + b) / (a + b / 2)) : m / a / 2;
    return 0.69 * fmin(15, m) / d_m;
}

static bool begin(struct dive *v, const struct manoeuvre *what, enum pilot_place place, uint64_t seed)
{
    const char *line = getenv("STOCK_LINE");
    if (!rig_start(read_conf(what)))
        return false;
    *v = (struct dive){.what = what,
                       .seed = seed,
                       .line_s = 10.0 * (PING360_SAMPLES_FEW + REPLY_BYTES) / (line ? atof(line) : 921600)};
    v->world = place_of_pilot(place, seed, &pilot_hull, 1);
    rov_start(&v->rov, seed, false, what->current_mps);
    v->rov.place_m[2] = v->sticks.depth_m = 10;
    v->sticks.levels = v->sticks.heads = v->sticks.deep = true;
    rov_bound_start(&v->bound, &v->rov);
    if (what->drag)
        v->bound.bound.conf.square_ns2pm2 = coasted(&v->rov);
    pilot_head_start(&v->head, d.conf.sonar[0].step_rad);
    v->look_m = query_look_ahead_m(&d);
    return true;
}

/* The stick of a creep lies between a tenth and a quarter, so that a vehicle goes 0.15 to 0.3 m/s or so. */
static void fly(struct dive *v)
{
    if (v->what->creeps && v->t_s > REST_S)
        v->sticks.axis[4] = 0.12 + 0.08 * (double)(v->seed % 7) / 6;
    if (v->t_s > REST_S - 15)
        rov_steer(&v->rov, &v->sticks);
}

static void watch(unsigned number, unsigned place, uint64_t seed)
{
    static struct dive v;
    const struct manoeuvre *what = &manoeuvres[number];
    struct count *n = &counts[number][place];
    if (!begin(&v, what, where[place], seed))
        exit(2);
    for (int k = 0; v.t_s < REST_S + MANOEUVRE_S + WATCH_S; k++) {
        double place_m[3];
        v.t_s = k * TICK_S;
        if (k % 2 == 0)
            fly(&v);
        rov_step(&v.rov, TICK_S);
        if (v.t_s < REST_S + (what->creeps ? MANOEUVRE_S / 2 : 0)) /* the scene begins where it then is */
            memcpy(v.start_m, v.rov.place_m, sizeof v.start_m);
        place_of(&v, place_m);
        place_m[2] = 0;
        if (place_clearance(&v.world, place_m, &pilot_hull, v.t_s) < CLEAR_M)
            break;
        loop_advance(d.loop, ns_of(v.t_s));
        if (k % SAMPLE == 0)
            sample(&v);
        if (k % POSE == 0)
            tell_pose(&v);
        if (k % LOOK == 0)
            pilot_head_steer(&v.head, &d, ns_of(v.t_s));
        if (v.t_s > 2 && v.t_s >= v.next_ping_s)
            hear(&v);
        const bool creeps = !what->creeps || (v.speed_mps > 0.12 && v.speed_mps < 0.35);
        if (k % ASK == 0 && v.t_s > REST_S + MANOEUVRE_S && creeps)
            look_around(&v, n);
    }
    rig_end();
}

static double percent(double part, double whole)
{
    return whole > 0 ? 100 * part / whole : 0;
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool csv = strcmp(what, "csv") == 0, quick = argc > 2 && strcmp(argv[2], "quick") == 0;
    const uint64_t first = argc > 2 && !quick ? strtoull(argv[2], NULL, 10) : FIRST;
    const uint64_t last = argc > 3 ? strtoull(argv[3], NULL, 10) : argc > 2 ? first : first + SEEDS - 1;
    if (!csv && strcmp(what, "table") != 0) {
        fputs("usage: report_stock table|csv [FIRST [LAST] | quick]\n", stderr);
        return 2;
    }
    puts(csv ? "vehicle,place,asked,speed_mps,bound_mps,said,seen,clear,false"
             : "vehicle                      place    asked  speed  bound   said free  and seen  clear sectors "
               "said  "
               "false");
    for (unsigned m = 0; m < MANOEUVRES; m++)
        for (unsigned p = 0; p < PLACES; p++) {
            for (uint64_t seed = first; seed <= last; seed++)
                watch(m, p, seed);
            const struct count *n = &counts[m][p];
            printf(csv ? "\"%s\",%s,%u,%.2f,%.2f,%.1f,%.1f,%.1f,%u\n"
                       : "%-28s %-8s %5u   %4.2f   %4.2f      %4.0f %%    %4.0f %%              %4.0f %%  %5u\n",
                   manoeuvres[m].name, pilot_place_name[where[p]], n->asked, n->speed_mps / fmax(1, n->asked),
                   n->bound_mps / fmax(1, n->asked), percent(n->said_m, n->free_m), percent(n->seen_m, n->free_m),
                   percent(n->said_clear, n->clear), n->wrong);
            fflush(stdout);
        }
    return 0;
}
