/* SPDX-License-Identifier: MIT */
/* run - see run.h. */
#include "run.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "core/fault.h"
#include "daemon/methods/environment.h"
#include "daemon/wiring.h"
#include "report/lib/dice.h"

#define SECOND       1000000000u
#define TICK_NS      20000000u  /* of the vehicle's motion */
#define POSE_NS      100000000u /* from one pose to the next; each comes a tick late */
#define ASK_NS       200000000u /* as in examples/autopilot.c */
#define WANTED_MPS   0.5
#define SLOW_MPS     0.1 /* as configured: so slow that touching something does no harm */
#define ARRIVED_M    0.5
#define ROOM_M       0.8 /* that somebody with a chart keeps, and half of it where there is no more */
#define ROOM_LEAST_M 0.4
#define MARGIN_M     0.35 /* as configured, and a little */
#define RING_DOWN_M  1.0  /* nothing is heard nearer */

const char *const pilot_nav_name[PILOT_NAVS] = {"position", "velocity", "attitude"};

const struct pilot_hull pilot_hull = {0.4, 0.25}; /* as configured */

/* ---- the vehicle ---- */

#define GAIN_HZ     3.0 /* of its speed controller */
#define LAG_S       0.2 /* of its thrusters */
#define THRUST_MPS2 0.3 /* at most; configured is what it can surely brake with */
#define TURN_RADPS  0.5
#define NOISE_M     0.02
#define NOISE_MPS   0.01
#define NOISE_RAD   0.005

struct vehicle {
    double place_m[3], velocity_mps[2], thrust_mps2[2]; /* over ground */
    double heading_rad;
    double current_mps[2];
    double command_mps[2]; /* north, east */
    double wanted_rad;
};

/* Over ground where it has something that tells its velocity, else through the water. */
static void steer(struct vehicle *v, bool over_ground, double dt_s)
{
    double wish[2];
    for (int k = 0; k < 2; k++)
        wish[k] = GAIN_HZ * (v->command_mps[k] - v->velocity_mps[k] + (over_ground ? 0 : v->current_mps[k]));
    const double much = fmax(1, hypot(wish[0], wish[1]) / THRUST_MPS2);
    for (int k = 0; k < 2; k++) {
        v->thrust_mps2[k] += (wish[k] / much - v->thrust_mps2[k]) * fmin(1, dt_s / LAG_S);
        v->velocity_mps[k] += v->thrust_mps2[k] * dt_s;
        v->place_m[k] += v->velocity_mps[k] * dt_s;
    }
    const double off = geo_wrap_pi(v->wanted_rad - v->heading_rad), most = TURN_RADPS * dt_s;
    v->heading_rad = geo_wrap(v->heading_rad + fmax(-most, fmin(most, off)));
}

/* ---- the daemon ---- */

struct drive {
    const struct pilot_case *c;
    struct methods_env *d;
    struct pilot_world world;
    struct vehicle v;
    struct dice dice;
    double route_m[PILOT_ROUTE_MAX][2];
    int corners, corner;
    double aside_rad, aside_until_s, stuck_since_s; /* of a pilot without a chart */
    double measured_rad;                            /* heading, as the compass says */
    uint32_t pings;
    struct pilot_result *result;
    struct pilot_track *track;
    long asked, held[3];
};

static double off(struct drive *r, double most)
{
    return most * (2 * dice_uniform(&r->dice) - 1);
}

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
    const int near = c->near_m > 0 ? snprintf(text + n, sizeof text - (size_t)n, "near = %.2f m\n", c->near_m) : 0;
    snprintf(text + n + near, sizeof text - (size_t)(n + near), "%s", c->conf ? c->conf : "");
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

static void tell_pose(struct drive *r, uint64_t t_ns)
{
    static const unsigned parts[PILOT_NAVS] = {[PILOT_POSITION] =
                                                   POSE_ATTITUDE | POSE_DEPTH | POSE_VELOCITY | POSE_POSITION,
                                               [PILOT_VELOCITY] = POSE_ATTITUDE | POSE_DEPTH | POSE_VELOCITY,
                                               [PILOT_ATTITUDE] = POSE_ATTITUDE | POSE_DEPTH};
    struct pose p = pose_identity;
    p.t_ns = t_ns;
    p.has = parts[r->c->nav];
    for (int k = 0; k < 2; k++) {
        p.position_m[k] = p.has & POSE_POSITION ? r->v.place_m[k] + off(r, NOISE_M) : 0;
        p.velocity_mps[k] = p.has & POSE_VELOCITY ? r->v.velocity_mps[k] + off(r, NOISE_MPS) : 0;
    }
    p.position_m[2] = r->v.place_m[2] + off(r, NOISE_M);
    r->measured_rad = r->v.heading_rad + off(r, NOISE_RAD);
    quat_from_rpy(off(r, NOISE_RAD), off(r, NOISE_RAD), r->measured_rad, p.attitude);
    pose_log_put(&r->d->poses, &p);
}

static void hear(struct drive *r, uint64_t t_ns, double t_s)
{
    struct ping *ping = pipeline_begin(r->d->pipeline);
    const double *mount = r->d->mount[0].position_m, c = cos(r->v.heading_rad), s = sin(r->v.heading_rad);
    const double place_m[3] = {r->v.place_m[0] + c * mount[0] - s * mount[1],
                               r->v.place_m[1] + s * mount[0] + c * mount[1], r->v.place_m[2] + mount[2]};
    ping->t_ns = ping->t_in_ns = t_ns;
    pilot_sonar_hear(r->c->sonar, &r->world, r->c->seed, place_m, r->v.heading_rad, t_s, r->pings, ping);
    pose_log_at(&r->d->poses, t_ns, &ping->pose);
    pipeline_submit(r->d->pipeline, ping);
}

/* The law of examples/autopilot.c: as fast as it may go into a direction of the body's. */
static double ask_limit(struct drive *r, double bearing_rad, enum pilot_held *held, char reason[PILOT_REASON_SIZE])
{
    const struct rpc_call call = {.daemon = r->d, .now_ns = loop_now(r->d->loop)};
    const double az = bearing_rad - r->measured_rad;
    char line[200], *text = NULL;
    const int n = snprintf(line, sizeof line,
                           "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"limit\",\"params\":{\"velocity_mps\":"
                           "[%.9f,%.9f,0]}}",
                           WANTED_MPS * cos(az), WANTED_MPS * sin(az));
    struct rpc_job *job = rpc_begin(&call, line, (size_t)n);
    while (rpc_step(job, daemon_methods, &call))
        ;
    rpc_end(job, &text);
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

/* Round a corner before the next one; without a chart straight for the goal, and aside for a while where that is
 * blocked. */
static double wanted_bearing(struct drive *r, double t_s)
{
    while (r->c->chart && r->corner < r->corners - 1 && distance_of(r, r->route_m[r->corner]) < 0.3)
        r->corner++;
    if (r->c->chart)
        return bearing_of(r, r->route_m[r->corner]);
    return bearing_of(r, r->world.goal_m) + (t_s < r->aside_until_s ? r->aside_rad : 0);
}

#define PATIENCE_S 4.0
#define ASIDE_S    8.0

static void lose_patience(struct drive *r, double t_s, double speed_mps)
{
    if (speed_mps > 0.02) {
        r->stuck_since_s = t_s;
        return;
    }
    if (t_s - r->stuck_since_s < PATIENCE_S)
        return;
    r->aside_rad = (dice_uniform(&r->dice) < 0.5 ? -1 : 1) * (0.8 + 1.6 * dice_uniform(&r->dice));
    r->aside_until_s = t_s + ASIDE_S;
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
    const double bearing = wanted_bearing(r, t_s), speed_mps = ask_limit(r, bearing, &held, reason);
    const bool facing = fabs(geo_wrap_pi(bearing - r->v.heading_rad)) < geo_rad(20);
    const double most_mps = r->c->heedless ? WANTED_MPS : speed_mps;
    const double go_mps = facing ? most_mps : fmin(most_mps, SLOW_MPS);
    r->v.wanted_rad = bearing;
    r->v.command_mps[0] = go_mps * cos(bearing);
    r->v.command_mps[1] = go_mps * sin(bearing);
    lose_patience(r, t_s, speed_mps);
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
    const double clear_m = pilot_world_clearance(&r->world, r->v.place_m, &pilot_hull, t_s);
    const double speed_mps = hypot(r->v.velocity_mps[0], r->v.velocity_mps[1]);
    out->nearest_m = fmin(out->nearest_m, clear_m);
    if (clear_m > 0)
        return;
    out->touched_mps = speed_mps;
    out->touched_s = t_s;
}

static double known_time_s(const struct drive *r)
{
    double way_m = 0, at_m[2] = {0, 0};
    for (int i = 0; i < r->corners; i++) {
        way_m += hypot(r->route_m[i][0] - at_m[0], r->route_m[i][1] - at_m[1]);
        memcpy(at_m, r->route_m[i], sizeof at_m);
    }
    return (way_m - ARRIVED_M) / WANTED_MPS + WANTED_MPS / THRUST_MPS2;
}

/* Until the sonar knows its baseline and has seen all around. */
static double begin_s(const struct pilot_case *c)
{
    return 1.2 * pilot_sonar_turn_s(c->sonar) + 4;
}

#define OUT_S 4.0

static void run(struct drive *r)
{
    const uint64_t from_ns = 100ull * SECOND;
    const double go_s = begin_s(r->c), out_s = go_s + 30 * dice_uniform(&r->dice),
                 mute_s = go_s + 30 * dice_uniform(&r->dice);
    uint64_t next_pose = from_ns, next_ping = from_ns + SECOND / 4, next_ask = from_ns + (uint64_t)(go_s * 1e9);
    const bool ground = r->c->nav != PILOT_ATTITUDE;
    for (uint64_t t = from_ns; !r->result->arrived; t += TICK_NS) {
        const double t_s = (double)(t - from_ns) * 1e-9;
        loop_advance(r->d->loop, t);
        steer(&r->v, ground, TICK_NS * 1e-9);
        watch(r, t_s);
        if (t_s > go_s + r->c->limit_s || r->result->touched_mps >= 0)
            break;
        for (; next_pose <= t; next_pose += POSE_NS)
            if (!r->c->faults || t_s < mute_s || t_s > mute_s + 1.5)
                tell_pose(r, next_pose);
        for (; next_ping <= t; next_ping += pilot_sonar_period_ns(r->c->sonar)) {
            r->pings++;
            if (!r->c->faults || (dice_uniform(&r->dice) > 0.05 && (t_s < out_s || t_s > out_s + OUT_S)))
                hear(r, t, t_s);
        }
        if (t >= next_ask) {
            fly(r, t_s);
            next_ask += ASK_NS;
            r->result->time_s = t_s - go_s;
        }
        r->result->arrived = distance_of(r, r->world.goal_m) < ARRIVED_M;
    }
}

/* What still carries a vehicle that was told to stop: it cannot help that. */
static double harmless_mps(const struct pilot_case *c)
{
    return 1.1 * SLOW_MPS + (c->nav == PILOT_ATTITUDE ? c->current_mps : 0.02);
}

double pilot_free_m(const struct pilot_case *c)
{
    return c->near_m > 0 ? RING_DOWN_M : MARGIN_M;
}

bool pilot_run(const struct pilot_case *c, struct pilot_result *result, struct pilot_track *track)
{
    struct drive *r = calloc(1, sizeof *r);
    struct methods_env *d = calloc(1, sizeof *d);
    if (!r || !d)
        abort();
    *r = (struct drive){.c = c, .d = d, .dice = dice_of(c->seed, 1000), .result = result, .track = track};
    *result = (struct pilot_result){.touched_mps = -1, .nearest_m = INFINITY};
    pilot_world_draw(&r->world, c->place, c->seed, &pilot_hull, pilot_free_m(c));
    for (double room_m = ROOM_M; r->corners == 0 && room_m >= ROOM_LEAST_M; room_m /= 2)
        r->corners = pilot_world_route(&r->world, &pilot_hull, room_m, r->route_m);
    const double to = GEO_TURN * dice_uniform(&r->dice);
    r->v.current_mps[0] = c->current_mps * cos(to);
    r->v.current_mps[1] = c->current_mps * sin(to);
    const bool drives = r->corners > 0 && start(d, c);
    if (drives) {
        result->known_s = known_time_s(r);
        run(r);
        for (int i = 0; i < 3; i++)
            result->share[i] = (double)r->held[i] / fmax(1, (double)r->asked);
        result->collided = result->touched_mps > harmless_mps(c);
        end(d);
    }
    free(d);
    free(r);
    return drives;
}

const char *pilot_name(const struct pilot_case *c, char text[128])
{
    snprintf(text, 128, "%s, %s, %s, %s%s, current %.2f, near %.1f, seed %llu", pilot_place_name[c->place],
             pilot_sonar_name[c->sonar], pilot_nav_name[c->nav], c->chart ? "chart" : "straight",
             c->faults ? ", faults" : "", c->current_mps, c->near_m, (unsigned long long)c->seed);
    return text;
}

void pilot_draw_case(uint64_t seed, unsigned number, struct pilot_case *c)
{
    struct dice dice = dice_of(seed, 2000 + number);
    *c = (struct pilot_case){.place = (enum pilot_place)(number % PILOT_PLACES),
                             .sonar = (enum pilot_sonar)(number / PILOT_PLACES % PILOT_SONARS),
                             .nav = (enum pilot_nav)(number / (PILOT_PLACES * PILOT_SONARS) % PILOT_NAVS),
                             .chart = dice_uniform(&dice) < 0.5,
                             .faults = dice_uniform(&dice) < 0.5,
                             .limit_s = 120,
                             .seed = seed + number};
    /* a promise that holds where all that stands reaches from the bottom to the surface */
    c->near_m = c->place != PILOT_HARBOUR && c->place != PILOT_SHAFT && dice_uniform(&dice) < 0.6 ? 3.4 : 0;
    c->current_mps = (c->nav == PILOT_ATTITUDE ? 0.08 : 0.2) * dice_uniform(&dice);
}
