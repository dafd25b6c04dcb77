/* SPDX-License-Identifier: MIT */
/* run - see run.h. */
#include "run.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "daemon/methods/environment.h"
#include "daemon/wiring.h"
#include "head.h"
#include "rover.h"

#define SECOND       1000000000u
#define TICK_NS      20000000u  /* of the vehicle's motion */
#define POSE_NS      100000000u /* from one pose to the next; each comes a tick late */
#define ASK_NS       200000000u /* as in examples/autopilot.c */
#define WANTED_MPS   0.5
#define MOST         4.0 /* times as long as a pilot who knows the world */
#define SLOW_MPS     0.1 /* as configured: so slow that touching something does no harm */
#define ARRIVED_M    0.5
#define ROOM_M       0.8 /* that somebody with a chart keeps, and less where there is no more */
#define ROOM_LEAST_M 0.45
#define MARGIN_M     0.35 /* as configured, and a little */
#define RING_DOWN_M  1.0  /* nothing is heard nearer */
#define CURRENT_MPS  0.08 /* as configured where nothing tells the speed */
#define CURRENT      "0.08 m/s"
#define STEP_RAD     (GEO_TURN / 200) /* of a head that is steered, as of the others */

const char *const pilot_nav_name[PILOT_NAVS] = {"position", "velocity", "attitude"};
const char *const pilot_setup_name[PILOT_SETUPS] = {"bare", "near", "near and level"};
const char *const pilot_fault_name[PILOT_FAULTS] = {"none",     "lost pings",   "silent sonar", "no poses",
                                                    "no speed", "origin moves", "other sonar"};

const struct place_hull pilot_hull = {0.4, 0.25}; /* as configured */

/* ---- the daemon ---- */

struct drive {
    const struct pilot_case *c;
    struct methods_env *d;
    struct place world;
    struct pilot_vehicle v;
    struct rover rover; /* with attitude alone it is one */
    struct pilot_head head;
    struct pilot_instruments instruments;
    struct dice dice;
    double route_m[PILOT_ROUTE_MAX][2];
    int corners, corner;
    double aside_rad, aside_s, aside_until_s, stuck_since_s;
    int stuck;           /* so often */
    double measured_rad; /* heading, as the compass says */
    double fault_s;      /* when the next fault begins */
    double diver_s;      /* when one was last in a beam */
    uint32_t pings;
    struct pilot_result *result;
    struct pilot_track *track;
    long asked, held[3];
};

static void tell_fault(void *ctx, const char *message)
{
    (void)ctx;
    fprintf(stderr, "%s\n", message);
}

static bool start(struct methods_env *d, const struct pilot_case *c)
{
    static const char vehicle[] =
        "[vehicle]\nradius = 0.4 m\nheight = 0.5 m\nmargin = 0.3 m\nmax_speed = 0.7 m/s\n"
        "max_turn = 45 deg\nbraking = 0.2 m/s2\nlatency = 0.5 s\nslow = 0.1 m/s\n";
    char text[1024];
    struct pipeline_conf p;
    struct conf_source *source;
    struct pose_drift unseen;
    struct fault fault = {""};
    const int n = snprintf(text, sizeof text, "%s%s", pilot_sonar_conf(c->sonar), vehicle);
    const double near_m = pilot_sonar_near_m(c->sonar);
    const int near = c->setup == PILOT_BARE || near_m <= 0
                         ? 0
                         : snprintf(text + n, sizeof text - (size_t)n, "near = %.2f m\n", near_m);
    snprintf(text + n + near, sizeof text - (size_t)(n + near), "%s%s%s",
             c->nav == PILOT_ATTITUDE ? "current = " CURRENT "\n" : "",
             c->setup == PILOT_LEVEL ? "[grid]\nelevation = level\n" : "", c->conf ? c->conf : "");
    if (conf_load_text(&d->conf, &source, &(struct conf_text){"pilot", text, strlen(text)}, NULL, tell_fault,
                       NULL) != 0)
        return false;
    conf_source_free(source);
    d->replay = true;
    d->loop = loop_new(true);
    plan_make(&d->conf, &d->plan);
    wiring_pipeline(&d->conf, &d->plan, true, &p);
    p.threads = 0;
    d->pipeline = pipeline_new(&p, &fault);
    if (!d->pipeline)
        fprintf(stderr, "%s\n", fault.text);
    memcpy(d->mount, p.mount, sizeof d->mount);
    pose_log_init(&d->poses, (uint64_t)(d->conf.pose.max_age_s * 1e9));
    pose_log_set_most(&d->poses, d->conf.vehicle.max_speed_mps, d->conf.vehicle.max_turn_radps);
    wiring_drift(&d->conf, &unseen);
    pose_log_set_drift(&d->poses, 0, &unseen);
    return d->loop && d->pipeline;
}

static void end(struct methods_env *d)
{
    pipeline_free(d->pipeline);
    loop_free(d->loop);
}

static bool at_fault(const struct drive *r, enum pilot_fault fault, double t_s, double long_s)
{
    return r->c->fault == fault && t_s > r->fault_s && t_s < r->fault_s + long_s;
}

#define SILENT_S   4.0
#define NO_POSE_S  2.5
#define NO_SPEED_S 4.0
#define JUMP_M     2.0
#define LOST       0.1
#define STRAY      0.02
#define FAULT_S    12.0 /* from one fault to the next, and as much again */

static bool knows_speed(const struct drive *r, double t_s)
{
    return r->c->nav != PILOT_ATTITUDE && !at_fault(r, PILOT_NO_SPEED, t_s, NO_SPEED_S);
}

static void fail(struct drive *r, double t_s)
{
    if (t_s > r->fault_s + fmax(SILENT_S, fmax(NO_POSE_S, NO_SPEED_S)))
        r->fault_s = t_s + FAULT_S * (1 + dice_uniform(&r->dice));
    if (r->c->fault != PILOT_JUMP || t_s < r->fault_s || r->instruments.jump_m[0] != 0)
        return;
    const double to = GEO_TURN * dice_uniform(&r->dice);
    r->instruments.jump_m[0] = JUMP_M * cos(to);
    r->instruments.jump_m[1] = JUMP_M * sin(to);
}

static void tell_pose(struct drive *r, uint64_t t_ns, double t_s)
{
    static const unsigned all[PILOT_NAVS] = {[PILOT_POSITION] =
                                                 POSE_ATTITUDE | POSE_DEPTH | POSE_VELOCITY | POSE_POSITION,
                                             [PILOT_VELOCITY] = POSE_ATTITUDE | POSE_DEPTH | POSE_VELOCITY,
                                             [PILOT_ATTITUDE] = POSE_ATTITUDE | POSE_DEPTH};
    const unsigned parts = all[r->c->nav] & ~(knows_speed(r, t_s) ? 0u : (unsigned)POSE_VELOCITY);
    struct pose p;
    if (at_fault(r, PILOT_NO_POSES, t_s, NO_POSE_S))
        return;
    pilot_instruments_read(&r->instruments, &r->v, parts, t_s, &p, &r->measured_rad);
    p.t_ns = t_ns;
    pose_log_put(&r->d->poses, &p);
}

static void look_for_divers(struct drive *r, const struct pilot_shot *shot)
{
    for (const struct place_shape *s = r->world.shape; s->kind != PLACE_END; s++) {
        const double at_m[2] = {s->p[0] + s->v[0] * shot->t_s, s->p[1] + s->v[1] * shot->t_s};
        if (place_moves(s) && pilot_sonar_points_at(r->c->sonar, shot, at_m, s->p[2]))
            r->diver_s = shot->t_s;
    }
}

/* A head that may be steered is sent to its next bearing. */
static void aim(struct drive *r, uint64_t t_ns, struct pilot_shot *shot)
{
    pilot_head_ping(&r->head, t_ns, &shot->head_units, &shot->new_turn);
    shot->head_units *= pilot_sonar_turn_units(r->c->sonar) / PING360_TURN;
    shot->range_m = r->d->conf.sonar[0].range_m;
    shot->aimed = true;
}

static void hear(struct drive *r, uint64_t t_ns, double t_s)
{
    struct pilot_shot shot = {.world = &r->world,
                              .seed = r->c->seed,
                              .mount = r->d->mount,
                              .heading_rad = r->v.heading_rad,
                              .t_s = t_s,
                              .number = ++r->pings,
                              .stray = r->c->fault == PILOT_STRAY ? STRAY : 0};
    if (r->d->plan.steered & 1)
        aim(r, t_ns, &shot);
    if (at_fault(r, PILOT_NO_SONAR, t_s, SILENT_S) ||
        (r->c->fault == PILOT_NO_PINGS && dice_uniform(&r->dice) < LOST))
        return;
    struct ping *ping = pipeline_begin(r->d->pipeline);
    memcpy(shot.place_m, r->v.place_m, sizeof shot.place_m);
    ping->t_ns = ping->t_in_ns = t_ns;
    pilot_sonar_hear(r->c->sonar, &shot, ping);
    look_for_divers(r, &shot);
    pose_log_at(&r->d->poses, t_ns, &ping->pose);
    pipeline_submit(r->d->pipeline, ping);
}

/* Of a rover the autopilot says what its thrusters do. */
static void go(struct drive *r, uint64_t t_ns, double t_s)
{
    double ground_mps[3];
    if (r->c->nav != PILOT_ATTITUDE) {
        pilot_vehicle_move(&r->v, knows_speed(r, t_s), TICK_NS * 1e-9);
        return;
    }
    if (rover_step(&r->rover, r->v.command_mps, r->v.wanted_rad, TICK_NS * 1e-9) &&
        !at_fault(r, PILOT_NO_POSES, t_s, NO_POSE_S)) {
        pose_log_bound(&r->d->poses, t_ns, r->rover.mps);
        push_put(&r->d->push, t_ns, r->rover.push_n);
    }
    rov_velocity(&r->rover.rov, ground_mps);
    memcpy(r->v.velocity_mps, ground_mps, sizeof r->v.velocity_mps);
    memcpy(r->v.place_m, r->rover.rov.place_m, sizeof r->v.place_m);
    r->v.heading_rad = geo_wrap(rover_heading(&r->rover));
}

/* What the daemon answers to a line; for the caller to free. */
static char *ask(struct drive *r, const char *line)
{
    const struct rpc_call call = {.daemon = r->d, .now_ns = loop_now(r->d->loop)};
    char *text = NULL;
    struct rpc_job *job = rpc_begin(&call, line, strlen(line));
    while (rpc_step(job, daemon_methods, &call))
        ;
    rpc_end(job, &text);
    return text;
}

/* The law of examples/autopilot.c: as fast as it may go into a direction of the body's. */
static double ask_limit(struct drive *r, double bearing_rad, enum pilot_held *held, char reason[PILOT_REASON_SIZE])
{
    const double az = bearing_rad - r->measured_rad;
    char line[200];
    snprintf(line, sizeof line,
             "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"limit\",\"params\":{\"velocity_mps\":"
             "[%.9f,%.9f,0]}}",
             WANTED_MPS * cos(az), WANTED_MPS * sin(az));
    char *text = ask(r, line);
    json_t *reply = json_loads(text, 0, NULL), *answer = json_object_get(reply, "result");
    const char *by = json_string_value(json_object_get(answer, "limited_by")),
               *why = json_string_value(json_object_get(answer, "reason"));
    const double speed_mps = json_number_value(json_object_get(answer, "speed_mps"));
    *held = !by || strcmp(by, "unknown") == 0 ? PILOT_UNKNOWN
            : strcmp(by, "blocked") == 0      ? PILOT_BLOCKED
                                              : PILOT_GOING;
    snprintf(reason, PILOT_REASON_SIZE, "%.*s", (int)strcspn(why ? why : "no answer", ":;"),
             why ? why : "no answer");
    snprintf(r->result->last, sizeof r->result->last, "%s", why ? why : "");
    json_decref(reply);
    free(text);
    return speed_mps;
}

/* ---- the pilot ---- */

static double bearing_of(const struct drive *r, const double place_m[2])
{
    return atan2(place_m[1] - r->v.place_m[1], place_m[0] - r->v.place_m[0]);
}

static double distance_of(const struct drive *r, const double place_m[2])
{
    return hypot(place_m[1] - r->v.place_m[1], place_m[0] - r->v.place_m[0]);
}

/* Round a corner before the next one; without a chart straight for the goal. */
static double way_bearing(struct drive *r)
{
    while (r->c->chart && r->corner < r->corners - 1 && distance_of(r, r->route_m[r->corner]) < 0.3)
        r->corner++;
    return bearing_of(r, r->c->chart ? r->route_m[r->corner] : r->world.to);
}

#define PATIENCE_S  4.0
#define ASIDE_S     8.0 /* at first; each time half as long again */
#define ASIDE_MORE  1.5
#define ASIDE_MAX_S 15.0
#define ASIDES      6 /* to each side */
#define ASIDE_RAD   geo_rad(30)
#define FORWARD     1.2  /* how much an equal speed is worth back (0.2) and ahead (2.2) ... */
#define DOUBT       0.25 /* ... and less ahead, more back, each time: out of where it came in */
#define TURNED      0.4  /* on the other side than the last time */
#define CAPRICE     0.4  /* so that it does not go to and fro for ever */
#define STANDS_MPS  0.02

/* Who may not go on asks how fast it may go elsewhere, and goes there for a while. */
static void look_aside(struct drive *r, double bearing, double t_s)
{
    enum pilot_held held;
    char reason[PILOT_REASON_SIZE];
    const double ahead = fmax(-1, 1 - DOUBT * r->stuck++);
    double best = 0, aside = 0;
    for (int k = -ASIDES; k <= ASIDES; k++) {
        const double aside_rad = k * ASIDE_RAD, side = k * r->aside_rad < 0 ? TURNED : 1;
        const double worth = ask_limit(r, bearing + aside_rad, &held, reason) * side *
                             (FORWARD + ahead * cos(aside_rad)) * (1 - CAPRICE * dice_uniform(&r->dice));
        if (worth <= best)
            continue;
        best = worth;
        aside = aside_rad;
    }
    r->aside_rad = aside;
    r->aside_until_s = t_s + r->aside_s;
    r->aside_s = fmin(ASIDE_MORE * r->aside_s, ASIDE_MAX_S);
}

static void lose_patience(struct drive *r, double bearing, double t_s, double speed_mps)
{
    if (speed_mps > STANDS_MPS)
        r->stuck_since_s = t_s;
    if (t_s - r->stuck_since_s < PATIENCE_S)
        return;
    look_aside(r, bearing, t_s);
    r->stuck_since_s = t_s;
}

static void count_reason(struct pilot_result *out, const char *text)
{
    for (int i = 0; i < PILOT_REASONS; i++) {
        if (out->reason[i].n == 0)
            snprintf(out->reason[i].text, sizeof out->reason[i].text, "%s", text);
        if (strcmp(out->reason[i].text, text) == 0) {
            out->reason[i].n++;
            return;
        }
    }
}

static void fly(struct drive *r, double t_s)
{
    enum pilot_held held;
    char reason[PILOT_REASON_SIZE];
    const double way = way_bearing(r), bearing = way + (t_s < r->aside_until_s ? r->aside_rad : 0);
    const double speed_mps = ask_limit(r, bearing, &held, reason);
    const bool facing = fabs(geo_wrap_pi(bearing - r->v.heading_rad)) < geo_rad(20);
    const double most_mps = r->c->heedless ? WANTED_MPS : speed_mps;
    const double go_mps = facing ? most_mps : fmin(most_mps, SLOW_MPS);
    r->v.wanted_rad = bearing;
    r->v.command_mps[0] = go_mps * cos(bearing);
    r->v.command_mps[1] = go_mps * sin(bearing);
    if (r->c->trace)
        printf("%6.1f s  north %6.2f m  east %6.2f m  bearing %4.0f  %.2f m/s  %s\n", t_s, r->v.place_m[0],
               r->v.place_m[1], geo_deg(bearing), speed_mps, r->result->last);
    if (r->c->question && t_s >= r->c->question_s && t_s < r->c->question_s + ASK_NS * 1e-9) {
        char *text = ask(r, r->c->question);
        printf("%6.1f s  heading %4.0f  %s\n", t_s, geo_deg(r->v.heading_rad), text);
        free(text);
    }
    lose_patience(r, way, t_s, speed_mps);
    held = speed_mps >= WANTED_MPS / 2 ? PILOT_GOING : held;
    r->asked++;
    r->held[held]++;
    if (held == PILOT_UNKNOWN)
        count_reason(r->result, reason);
    if (r->track && r->track->n < PILOT_TRACK_MAX) {
        r->track->at[r->track->n].x_m = (float)r->v.place_m[0];
        r->track->at[r->track->n].y_m = (float)r->v.place_m[1];
        r->track->at[r->track->n++].held = (uint8_t)held;
    }
}

/* ---- the drive ---- */

static void watch(struct drive *r, double t_s)
{
    struct pilot_result *out = r->result;
    const double clear_m = place_clearance(&r->world, r->v.place_m, &pilot_hull, t_s);
    const double speed_mps = hypot(r->v.velocity_mps[0], r->v.velocity_mps[1]);
    out->nearest_m = fmin(out->nearest_m, clear_m);
    out->end_s = t_s;
    if (clear_m > 0)
        return;
    const struct place still = place_still(&r->world);
    out->unseen_s = t_s - r->diver_s;
    out->struck = place_clearance(&still, r->v.place_m, &pilot_hull, t_s) > 0;
    out->touched_mps = speed_mps;
}

static double known_time_s(const struct drive *r)
{
    double way_m = 0, at_m[2] = {0, 0};
    for (int i = 0; i < r->corners; i++) {
        way_m += hypot(r->route_m[i][0] - at_m[0], r->route_m[i][1] - at_m[1]);
        memcpy(at_m, r->route_m[i], sizeof at_m);
    }
    return (way_m - ARRIVED_M) / WANTED_MPS + WANTED_MPS / PILOT_THRUST_MPS2;
}

/* Until the sonar knows its baseline and has seen all around. */
static double begin_s(const struct pilot_case *c)
{
    return 1.2 * pilot_sonar_turn_s(c->sonar) + 4;
}

static void run(struct drive *r)
{
    const uint64_t from_ns = 100ull * SECOND;
    const double go_s = begin_s(r->c), limit_s = r->c->limit_s > 0 ? r->c->limit_s : MOST * r->result->known_s;
    uint64_t next_pose = from_ns, next_ping = from_ns + SECOND / 4, next_ask = from_ns + (uint64_t)(go_s * 1e9),
             next_look = from_ns + ACTIVE_SENSING_TICK_NS;
    r->fault_s = go_s + FAULT_S * dice_uniform(&r->dice);
    for (uint64_t t = from_ns; !r->result->arrived; t += TICK_NS) {
        const double t_s = (double)(t - from_ns) * 1e-9;
        loop_advance(r->d->loop, t);
        fail(r, t_s);
        go(r, t, t_s);
        watch(r, t_s);
        if (t_s > go_s + limit_s || r->result->touched_mps >= 0)
            break;
        for (; next_pose <= t; next_pose += POSE_NS)
            tell_pose(r, next_pose, t_s);
        for (; next_ping <= t; next_ping += pilot_sonar_period_ns(r->c->sonar))
            hear(r, t, t_s);
        for (; next_look <= t; next_look += ACTIVE_SENSING_TICK_NS)
            pilot_head_steer(&r->head, r->d, t);
        if (t >= next_ask) {
            fly(r, t_s);
            next_ask += ASK_NS;
            r->result->time_s = t_s - go_s;
        }
        r->result->arrived = distance_of(r, r->world.to) < ARRIVED_M;
    }
}

/* What still carries a vehicle that was told to stop: it cannot help that. */
static double harmless_mps(const struct pilot_case *c)
{
    return 1.1 * SLOW_MPS + (c->nav == PILOT_ATTITUDE || c->fault == PILOT_NO_SPEED ? c->current_mps : 0.02);
}

double pilot_free_m(const struct pilot_case *c)
{
    return c->setup != PILOT_BARE ? RING_DOWN_M : MARGIN_M;
}

bool pilot_run(const struct pilot_case *c, struct pilot_result *result, struct pilot_track *track)
{
    struct drive *r = calloc(1, sizeof *r);
    struct methods_env *d = calloc(1, sizeof *d);
    if (!r || !d)
        abort();
    *r = (struct drive){
        .c = c, .d = d, .dice = dice_of(c->seed, 1000), .aside_s = ASIDE_S, .result = result, .track = track};
    *result = (struct pilot_result){.touched_mps = -1, .nearest_m = INFINITY};
    r->world = place_of_pilot(c->place, c->seed, &pilot_hull, pilot_free_m(c));
    for (double room_m = ROOM_M; r->corners == 0 && room_m >= ROOM_LEAST_M; room_m -= 0.1)
        r->corners = pilot_route(&r->world, &pilot_hull, room_m, r->route_m);
    pilot_instruments_init(&r->instruments, c->poor, dice_of(c->seed, 1001));
    const double to = GEO_TURN * dice_uniform(&r->dice);
    r->v.current_mps[0] = c->current_mps * cos(to);
    r->v.current_mps[1] = c->current_mps * sin(to);
    const bool drives = r->corners > 0 && start(d, c);
    if (drives) {
        pilot_head_start(&r->head, STEP_RAD);
        if (c->nav == PILOT_ATTITUDE)
            rover_start(&r->rover, c->seed, r->v.current_mps, CURRENT_MPS);
        result->known_s = known_time_s(r);
        run(r);
        for (int i = 0; i < 3; i++)
            result->share[i] = (double)r->held[i] / fmax(1, (double)r->asked);
        const bool hard = result->touched_mps > harmless_mps(c);
        result->collided = hard && !result->struck;
        result->struck = hard && result->struck;
        end(d);
    }
    free(d);
    free(r);
    return drives;
}

const char *pilot_name(const struct pilot_case *c, char text[PILOT_NAME_SIZE])
{
    snprintf(text, PILOT_NAME_SIZE, "%s, %s, %s, %s, %s, fault: %s, current %.2f, seed %llu",
             pilot_place_name[c->place], pilot_sonar_name[c->sonar], pilot_nav_name[c->nav],
             pilot_setup_name[c->setup], c->chart ? "chart" : "straight", pilot_fault_name[c->fault],
             c->current_mps, (unsigned long long)c->seed);
    return text;
}

/* Half of the drives have one, of those that such poses can have. */
static enum pilot_fault draw_fault(struct dice *dice, enum pilot_nav nav)
{
    if (dice_uniform(dice) < 0.5)
        return PILOT_SOUND;
    for (;;) {
        const enum pilot_fault fault = (enum pilot_fault)(1 + (int)((PILOT_FAULTS - 1) * dice_uniform(dice)));
        if ((fault != PILOT_JUMP || nav == PILOT_POSITION) && (fault != PILOT_NO_SPEED || nav != PILOT_ATTITUDE))
            return fault;
    }
}

/* near is a promise that holds where all that stands reaches from the bottom to the surface. */
static bool may_promise(const struct pilot_case *c)
{
    return c->place != PILOT_HARBOUR && c->place != PILOT_SHAFT && pilot_sonar_near_m(c->sonar) > 0;
}

#define PAIRS (PILOT_SONARS * PILOT_NAVS)

void pilot_draw_case(uint64_t seed, unsigned number, struct pilot_case *c)
{
    struct dice dice = dice_of(seed, 2000 + number);
    *c = (struct pilot_case){.place = (enum pilot_place)((number + number / PAIRS) % PILOT_PLACES),
                             .sonar = (enum pilot_sonar)(number % PILOT_SONARS),
                             .nav = (enum pilot_nav)(number / PILOT_SONARS % PILOT_NAVS),
                             .chart = dice_uniform(&dice) < 0.7,
                             .poor = dice_uniform(&dice),
                             .seed = seed + number};
    const double setup = dice_uniform(&dice);
    if (!may_promise(c) && setup < 0.8)
        c->sonar = PILOT_MATRIX; /* a level beam does not take a vehicle through such a place */
    if (may_promise(c))
        c->setup = setup < 0.1 ? PILOT_BARE : setup < 0.3 ? PILOT_NEAR : PILOT_LEVEL;
    c->fault = draw_fault(&dice, c->nav);
    c->current_mps = (c->nav == PILOT_ATTITUDE ? 0.08 : 0.2) * dice_uniform(&dice);
}
