/* SPDX-License-Identifier: MIT */
/*
 * test_map_service - what clients ask of the map and change in it goes by jobs: what a position that jumps meanwhile
 * makes of it, what is left in the queue by those who go, and rights that end. And grids: what is dropped has its
 * memory until the owner lets it go.
 */
#include "tests/lib/held_owner.h"
#include "tests/lib/plain_ping.h"
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#include <math.h>
#include <unistd.h>

#include "core/fault.h"
#include "daemon/methods/environment.h"
#include "daemon/request_job.h"
#include "daemon/map/map_job.h"
#include "daemon/map/map_steps.h"
#include "daemon/methods/methods.h"
#include "daemon/pipeline/pipeline_state.h"

static struct methods_env d;
static struct worker *worker;
static struct request_jobs jobs;

static void start_service(void)
{
    const struct map_service_env env = {
        .loop = d.loop, .worker = worker, .pipeline = d.pipeline, .conf = &d.conf, .replay = d.replay};
    map_service_start(&d.map_service, &env);
}

static char folder[] = "/tmp/sonard-places-XXXXXX";

/* Of the runs that begin from now on: [map] load, and tiles along a side of a submap. */
static const char *load_name = "";
static uint32_t map_side = 4;

static void begin_with(int threads)
{
    struct pipeline_conf c = plain_pipeline(threads);
    struct fault fault = {""};
    strcpy(c.grid.name, "main");
    c.map = true;
    c.mask_blocks = 1024;
    c.voxels = (struct voxmap_setting){.voxel_m = 0.5,
                                       .side = map_side,
                                       .height = 40,
                                       .n_tiles = 28,
                                       .max_submaps = 4,
                                       .rule = {.threshold = 2, .echo_weight = 4},
                                       .opening = 1,
                                       .weight_levels = 1,
                                       .submap_path_m = INFINITY,
                                       .submap_ns = VOXMAP_NEVER,
                                       .half_life_ns = VOXMAP_NEVER};
    c.extract[0].no_echo = EXTRACT_RANGE; /* from the first ping on, without a baseline */
    d = (struct methods_env){.loop = loop_new(false), .pipeline = pipeline_new(&c, &fault)};
    snprintf(d.conf.map.directory, sizeof d.conf.map.directory, "%s", folder);
    snprintf(d.conf.map.load, sizeof d.conf.map.load, "%s", load_name);
    worker = worker_new(d.loop, &fault);
    if (!worker || !d.pipeline || !request_jobs_start(&jobs, d.loop, d.pipeline, &fault)) {
        printf("%s\n", fault.text);
        exit(1);
    }
    start_service();
}

static void begin(void)
{
    begin_with(1);
}

static void free_parts(void)
{
    worker_free(worker);
    pipeline_free(d.pipeline);
    loop_free(d.loop);
}

static void end(void)
{
    request_jobs_end(&jobs);
    map_service_end(&d.map_service);
    free_parts();
}

/* A request of a client. */
struct request {
    const char *method, *name; /* name: of a map; NULL: none */
    struct rpc_work work;
    const char *refusal; /* it may change nothing any more */
};

/* Its next part; true: it was the last. */
static bool go_on(struct request *r)
{
    const struct rpc_call call = {.daemon = &d, .work = &r->work, .refusal = r->refusal};
    struct rpc_error error = {0};
    struct json_out out = {0};
    json_t *params = r->name ? json_pack("{s:s}", "name", r->name) : NULL;
    const enum rpc_outcome outcome = rpc_answer(daemon_methods, &call, r->method, params, &out, &error);
    CHECK(outcome != RPC_FAILED);
    json_decref(params);
    free(out.bytes);
    return outcome == RPC_ANSWERED;
}

static void drop(struct request *r)
{
    rpc_work_end(&r->work);
}

static void finish(struct request *r)
{
    bool done = false;
    TURN_UNTIL(d.loop, (done = go_on(r)));
    CHECK(done);
    drop(r);
}

/* ---- a position that jumps ---- */

/* What a head hears: its own pulse that rings down, noise quieter than a bottom that never repeats, and an echo in the
 * four bins around `bin`. */
static void hear_echo(struct ping *ping, int bin)
{
    static const uint8_t ring[] = {250, 180, 90, 40, 20};
    static uint64_t noise = 1;
    uint8_t *sample = ping->samples;
    for (int i = 0; i < 100; i++)
        sample[i] = (uint8_t)(i < (int)sizeof ring ? ring[i]
                              : i / 4 == bin / 4   ? 250
                                                   : 1 + test_random(&noise) % 3);
}

/* The map is of there, and has an echo 8 m north of it. */
static void ping_from(double north_m, double east_m)
{
    struct ping *ping = plain_ping(d.pipeline);
    ping->pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping->pose.position_m[0] = north_m;
    ping->pose.position_m[1] = east_m;
    hear_echo(ping, 80);
    pipeline_submit(d.pipeline, ping);
    pipeline_drain(d.pipeline);
}

static void ping_at(double north_m)
{
    ping_from(north_m, 0);
}

static uint64_t t_ns;

static void tell(unsigned has, double north_m, double depth_m, double heading_deg)
{
    struct pose pose = {.t_ns = t_ns += 10000000, .position_m = {north_m, 0, depth_m}, .has = has};
    quat_from_rpy(0, 0, geo_rad(heading_deg), pose.attitude);
    map_service_pose(&d.map_service, &pose);
}

static void position(double north_m)
{
    tell(POSE_POSITION | POSE_DEPTH, north_m, 0, 0);
}

static void see_held(void *ctx, struct pipeline_map *m)
{
    *(bool *)ctx = m->map.held;
}

static bool is_held(void)
{
    bool held = false;
    owner_run_map_now(d.pipeline, see_held, &held);
    CHECK(held == d.map_service.frame_lost);
    return held;
}

static void count_submaps(void *ctx, struct pipeline_map *m)
{
    uint32_t *n = ctx;
    for (uint32_t p = 0; p < m->map.set.max_submaps; p++)
        *n += m->map.part[p].id != 0;
}

static bool any_submap(void)
{
    uint32_t n = 0;
    owner_run_map_now(d.pipeline, count_submaps, &n);
    return n > 0;
}

static struct request new_map(void)
{
    return (struct request){.method = "map_new"};
}

TEST(who_changes_the_map_says_that_its_places_hold)
{
    begin();
    ping_at(0);
    position(0);
    position(1000);
    CHECK(is_held());
    struct request r = new_map();
    CHECK(!go_on(&r));
    finish(&r);
    CHECK(!is_held());
    end();
}

/* Whether or not the position had jumped before, and had come back. */
TEST(of_a_jump_that_comes_later_it_says_nothing)
{
    for (int before = 0; before < 2; before++) {
        begin();
        ping_at(0);
        position(0);
        if (before)
            position(1000);
        CHECK(is_held() == before);
        struct request r = new_map();
        CHECK(!go_on(&r));
        position(0);
        CHECK(!is_held());
        position(2000);
        CHECK(is_held());
        finish(&r);
        CHECK(is_held());
        end();
    }
}

TEST(of_a_second_jump_it_says_nothing_either)
{
    begin();
    ping_at(0);
    position(0);
    position(1000);
    struct request r = new_map();
    CHECK(!go_on(&r));
    position(1010);
    position(2000);
    finish(&r);
    CHECK(is_held());
    r = new_map();
    CHECK(!go_on(&r));
    position(2001); /* it drives on */
    finish(&r);
    CHECK(!is_held());
    end();
}

static void go(double from_m, double to_m)
{
    for (double at_m = from_m; fabs(at_m - to_m) > 0.02; at_m += to_m > from_m ? 0.02 : -0.02)
        position(at_m);
}

/* It is as far off as it was, wherever it goes. */
TEST(who_drives_back_has_not_jumped_back)
{
    begin();
    ping_at(0);
    position(0);
    position(8);
    CHECK(is_held());
    go(8, 0);
    CHECK(is_held());
    go(0, -3);
    CHECK(is_held());
    position(-11);
    CHECK(!is_held());
    end();
}

/* How far it drove in the silence nobody knows, nor how far off it is when it seems to be back. */
TEST(after_jumps_in_a_long_silence_a_client_has_to_say)
{
    for (int long_one = 0; long_one < 2; long_one++) {
        begin();
        ping_at(0);
        position(0);
        t_ns += long_one ? 600000000 : 100000000;
        position(100);
        position(0);
        CHECK(is_held() == long_one);
        end();
    }
}

TEST(jumps_add_up)
{
    static const double at_m[] = {20, 12, 30, 10, 4};
    begin();
    ping_at(0);
    position(0);
    for (size_t i = 0; i < sizeof at_m / sizeof *at_m; i++) {
        position(at_m[i]);
        CHECK(is_held() == (at_m[i] > DISCONTINUITY_M));
    }
    position(10); /* it is held again, and the 4 m are not forgotten */
    CHECK(is_held());
    position(-6);
    CHECK(is_held());
    position(0);
    CHECK(!is_held());
    end();
}

TEST(a_jump_in_small_steps_is_one)
{
    begin();
    ping_at(0);
    for (int i = 0; i <= 20; i++)
        position(0.4 * i);
    CHECK(is_held());
    end();
}

/* Nothing but noise: each step is longer than the vehicle drives meanwhile. */
TEST(noise_is_no_jump)
{
    uint64_t seed = 3;
    begin();
    ping_at(0);
    for (int i = 0; i < 3000; i++)
        tell(POSE_POSITION | POSE_DEPTH | POSE_ATTITUDE, 4 * test_uniform(&seed), 4 * test_uniform(&seed),
             19 * test_uniform(&seed));
    CHECK(!is_held());
    end();
}

/* What the client says of the map tells nothing of what is said next. */
TEST(a_jump_right_after_a_word_is_one)
{
    begin();
    ping_at(0);
    position(0);
    struct request r = new_map();
    CHECK(!go_on(&r));
    finish(&r);
    position(1000);
    CHECK(is_held());
    r = new_map();
    CHECK(!go_on(&r));
    position(0); /* there it was right, and is no longer */
    finish(&r);
    CHECK(is_held());
    end();
}

TEST(depth_and_heading_jump_too)
{
    begin();
    d.conf.vehicle.max_speed_mps = 1;
    d.conf.vehicle.max_turn_radps = geo_rad(60);
    ping_at(0);
    tell(POSE_DEPTH, 0, 3, 0);
    tell(POSE_ATTITUDE, 0, 0, 355);
    tell(POSE_ATTITUDE, 0, 0, 10);
    CHECK(!is_held());
    for (int i = 0; i < 100; i++)
        tell(POSE_ATTITUDE, 0, 0, 10);
    tell(POSE_DEPTH, 0, 13, 0);
    CHECK(is_held());
    tell(POSE_ATTITUDE, 0, 0, 100);
    tell(POSE_DEPTH, 0, 3, 0);
    CHECK(is_held());
    tell(POSE_ATTITUDE, 0, 0, 10);
    CHECK(!is_held());
    end();
}

static void work_on(const char *method)
{
    struct request r = {.method = method, .name = "kept"};
    if (go_on(&r))
        drop(&r);
    else
        finish(&r);
}

/* ---- random voyages ---- */

/* A vehicle drives north and back before a wall, always heading for it, and its navigation errs;
 * time runs ten times a second. */
#define WALL_M   6.0
#define STEP_S   0.1
#define MOST_MPS 1.0

struct voyage {
    uint64_t seed, t_ns;
    double at_m;                      /* in truth */
    double off_m, deep_m, turned_deg; /* what the poses are off by, ... */
    double map_off[3];                /* ... and what they were when the map began */
    bool glided;                      /* the navigation took an error back so that nobody could see it */
    long free, wrong, held, jumps;
};

static double between(struct voyage *v, double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&v->seed);
}

static struct pose claimed(const struct voyage *v)
{
    struct pose p = pose_identity;
    p.t_ns = v->t_ns;
    p.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    p.position_m[0] = v->at_m + v->off_m;
    p.position_m[2] = v->deep_m;
    quat_from_rpy(0, 0, geo_rad(v->turned_deg), p.attitude);
    return p;
}

/* One step of time, at most 1 m/s. */
static void drive(struct voyage *v, bool told)
{
    v->t_ns += (uint64_t)(STEP_S * 1e9);
    v->at_m = fmax(-2.5, fmin(2.5, v->at_m + between(v, -1, 1) * STEP_S));
    const struct pose p = claimed(v);
    if (told)
        map_service_pose(&d.map_service, &p);
}

/* Pings are on their way while poses come. */
static void hear_wall(struct voyage *v)
{
    struct ping *ping = plain_ping(d.pipeline);
    const int bin = (int)((WALL_M - v->at_m) * 10);
    loop_turn(d.loop, 0);
    ping->t_ns = ping->t_in_ns = loop_now(d.loop);
    ping->pose = claimed(v);
    hear_echo(ping, bin);
    pipeline_submit(d.pipeline, ping);
}

struct looks {
    struct pose from;
    double free_m; /* the farthest place ahead that is free */
};

static void look_ahead(void *ctx, struct pipeline_map *m)
{
    struct looks *l = ctx;
    l->free_m = 0;
    for (double far_m = 0.25; far_m < 40; far_m += 0.25)
        for (int side = -1; side <= 1; side += 2) {
            const double ahead[3] = {far_m, 0.1 * side, 0.1 * side};
            double at_m[3];
            struct lattice_place place;
            quat_rotate(l->from.attitude, ahead, at_m);
            for (int i = 0; i < 3; i++)
                at_m[i] += l->from.position_m[i];
            lattice_place(at_m, m->map.set.voxel_m, &place);
            if (voxmask_at(&m->mask, place.cell) == VOXEL_FREE)
                l->free_m = far_m;
        }
}

/* A voxel's diagonal beyond the wall, and what jumps that take each other back may leave: they are of any size. */
static void judge(struct voyage *v)
{
    struct looks l = {.from = claimed(v)};
    pipeline_drain(d.pipeline);
    owner_run_map_now(d.pipeline, look_ahead, &l);
    v->held += d.map_service.frame_lost;
    v->free += l.free_m > 0;
    if (l.free_m <= WALL_M - v->at_m + 1 + DISCONTINUITY_M)
        return;
    v->wrong++;
    printf("free to %.2f m, the wall is %.2f m ahead; off by %.1f m, %.1f m deep, %.0f degrees\n", l.free_m,
           WALL_M - v->at_m, v->off_m, v->deep_m, v->turned_deg);
}

/* By more than the vehicle can have done since the pose before, and than what may go unnoticed. */
static double far(struct voyage *v, double gap_s)
{
    const double far_m = between(v, 2 * DISCONTINUITY_M, 30) + 2 * MOST_MPS * gap_s;
    return between(v, -1, 1) < 0 ? -far_m : far_m;
}

static void work(const char *method)
{
    struct request r = {.method = method};
    CHECK(!go_on(&r));
    finish(&r);
}

/* A client that knows says what is true of the map and of poses. */
static void set_right(struct voyage *v)
{
    const double off[3] = {v->off_m, v->deep_m, v->turned_deg};
    const bool same = memcmp(off, v->map_off, sizeof off) == 0;
    work(same ? "map_new" : "map_forget");
    memcpy(v->map_off, off, sizeof off);
    hear_wall(v); /* an empty map would count from wherever poses do next */
    pipeline_drain(d.pipeline);
}

/* The poses jump, in place, depth or heading, at once or in some steps, after a silence or none. */
static void err(struct voyage *v)
{
    const int silent = between(v, 0, 1) < 0.3 ? (int)between(v, 1, 30) : 0;
    const int steps = between(v, 0, 1) < 0.3 ? 4 : 1, what = (int)between(v, 0, 3);
    double *const of[] = {&v->off_m, &v->deep_m, &v->turned_deg};
    const double by = what < 2 ? far(v, silent * STEP_S) : between(v, 60, 170);
    v->jumps++;
    if (v->glided) /* or a jump of about the same size looks like the way back: only who knows can tell */
        set_right(v);
    v->glided = false;
    for (int i = 0; i < silent; i++)
        drive(v, false);
    for (int i = 0; i < steps; i++) {
        *of[what] += by / steps;
        drive(v, true);
    }
}

/* The navigation takes all of its error back, at once or so slowly that it is no jump; it drives on meanwhile. */
static void mend(struct voyage *v)
{
    const bool at_once = between(v, 0, 1) < 0.6;
    v->glided |= !at_once;
    while (!at_once && fabs(v->off_m) + fabs(v->deep_m) + fabs(v->turned_deg) > 0) {
        v->off_m -= fmax(-0.3, fmin(0.3, v->off_m));
        v->deep_m -= fmax(-0.3, fmin(0.3, v->deep_m));
        v->turned_deg -= fmax(-5, fmin(5, v->turned_deg));
        drive(v, true);
    }
    v->off_m = v->deep_m = v->turned_deg = 0;
    drive(v, true);
}

/* Whatever the poses do, when the daemon can see it: nothing is free beyond the wall. What clients say is true. */
TEST(nothing_is_free_behind_the_wall_on_random_voyages)
{
    struct voyage v = {.seed = test_seed()};
    for (int voyage = 0; voyage < 30; voyage++) {
        begin();
        d.conf.vehicle.max_speed_mps = MOST_MPS;
        d.conf.vehicle.max_turn_radps = geo_rad(60);
        v = (struct voyage){.seed = v.seed, .free = v.free, .wrong = v.wrong, .held = v.held, .jumps = v.jumps};
        drive(&v, true);
        set_right(&v);
        for (int i = 0; i < 300; i++) {
            const double what = between(&v, 0, 1);
            if (what < 0.04)
                err(&v);
            else if (what < 0.06)
                mend(&v);
            else if (what < 0.07)
                set_right(&v);
            else
                drive(&v, true);
            hear_wall(&v);
            if (i % 5 == 0)
                judge(&v);
        }
        end();
    }
    printf("# %ld looks of which %ld found water free, %ld a held map; %ld jumps\n", 30 * 60l, v.free, v.held,
           v.jumps);
    CHECK_INT(v.wrong, 0);
    CHECK(v.free > 100 && v.held > 100);
}

static void end_job_as(enum map_service_state state)
{
    TURN_UNTIL(d.loop, d.map_service.asked.job.state != MAP_SERVICE_RUNNING);
    CHECK_INT(d.map_service.asked.job.state, state);
}

static void end_job(void)
{
    end_job_as(MAP_SERVICE_DONE);
}

/* A file takes its time, and may be the first that there is. */
TEST(of_a_jump_while_a_map_is_loaded_the_file_says_nothing)
{
    char path[80];
    for (int i = 0; i < 3; i++) {
        const bool late = i > 0, empty = i > 1;
        begin();
        ping_at(0);
        work_on("map_save");
        end_job();
        if (empty) {
            struct request forget = {.method = "map_forget"};
            CHECK(!go_on(&forget));
            finish(&forget);
        }
        position(0);
        if (!late)
            position(1000);
        struct request r = {.method = "map_load", .name = "kept"};
        CHECK(!go_on(&r));
        if (late)
            position(1000);
        CHECK(is_held());
        finish(&r);
        end_job();
        CHECK(is_held() == late);
        end();
    }
    snprintf(path, sizeof path, "%s/kept.map", folder);
    CHECK_INT(unlink(path), 0);
}

/* Or the map that begins with the next ping would be held for the sake of nothing. */
TEST(an_empty_map_into_which_no_file_came_is_not_held)
{
    begin();
    position(0);
    struct request r = {.method = "map_load", .name = "none-of-this-name"};
    CHECK(!go_on(&r));
    position(1000);
    CHECK(is_held());
    finish(&r);
    end_job_as(MAP_SERVICE_FAILED);
    CHECK(!is_held());
    end();
}

/* The file looks good until its submaps are put in: they are of another size than configured. */
TEST(a_start_with_a_map_that_cannot_be_put_in_is_not_held)
{
    char path[80];
    begin();
    ping_at(0);
    work_on("map_save");
    end_job();
    end();
    load_name = "kept";
    map_side = 5;
    begin();
    CHECK_INT(d.map_service.kept.job.state, MAP_SERVICE_FAILED);
    CHECK(!is_held());
    end();
    load_name = "";
    map_side = 4;
    snprintf(path, sizeof path, "%s/kept.map", folder);
    CHECK_INT(unlink(path), 0);
}

/* What cannot take its place leaves the map as it was. */
TEST(a_map_of_another_kind_is_refused_and_the_map_stays)
{
    char path[80];
    begin();
    ping_at(0);
    work_on("map_save");
    end_job();
    end();
    map_side = 5;
    begin();
    ping_at(0);
    CHECK(any_submap());
    work_on("map_load");
    end_job_as(MAP_SERVICE_FAILED);
    CHECK(strstr(d.map_service.asked.job.message, "kept.map: made with another size of submaps") != NULL);
    CHECK(any_submap() && !is_held());
    end();
    map_side = 4;
    snprintf(path, sizeof path, "%s/kept.map", folder);
    CHECK_INT(unlink(path), 0);
}

/* ---- clients that go ---- */

static int waiting(void)
{
    int n = 0;
    for (const struct owner_job *e = d.pipeline->jobs.first; e; e = e->next)
        n++;
    return n;
}

/* Or those who come, ask and go could fill the memory, without a right to change anything. */
TEST(what_was_only_asked_is_not_done_for_those_who_have_gone)
{
    static const char *const asks[] = {"map", "map_submaps"};
    struct hold hold;
    begin();
    hold_owner(&hold, d.pipeline);
    for (int i = 0; i < 100; i++) {
        struct request r = {.method = asks[i % 2]};
        CHECK(!go_on(&r));
        CHECK_INT(waiting(), 1);
        drop(&r);
        CHECK_INT(waiting(), 0);
    }
    struct request changes = new_map();
    CHECK(!go_on(&changes));
    drop(&changes);
    CHECK_INT(waiting(), 1);
    sem_post(&hold.go);
    end();
}

/* Nobody is told that it was refused what has been done. */
TEST(who_may_change_nothing_any_more_is_told_what_came_of_it)
{
    begin();
    struct request r = new_map();
    CHECK(!go_on(&r));
    r.refusal = "no more";
    finish(&r);
    end();
}

/* ---- when memory is low ---- */

static void close_submap(void *ctx, struct pipeline_map *m)
{
    (void)ctx;
    voxmap_new(&m->map);
}

/* Three submaps, 100 m apart, and a fourth that is started: more than three quarters of the tiles. */
static void fill_map(void)
{
    for (int s = 0; s < 4; s++) {
        for (int i = 0; i < 25; i++)
            ping_from(100 * s + 6 * (i / 5 - 2), 6 * (i % 5 - 2));
        owner_run_map_now(d.pipeline, close_submap, NULL);
    }
}

static void turn_until(const uint64_t *count)
{
    TURN_UNTIL(d.loop, *count > 0);
    CHECK(*count > 0);
}

static void look_for_first(void *ctx, struct pipeline_map *m)
{
    bool *there = ctx;
    *there = voxmap_part(&m->map, 1) != NULL;
}

static bool has_first(void)
{
    bool there = false;
    owner_run_map_now(d.pipeline, look_for_first, &there);
    return there;
}

static void begin_saving(void)
{
    struct fault fault;
    begin();
    const struct saver_env env = {.loop = d.loop,
                                  .worker = worker,
                                  .pipeline = d.pipeline,
                                  .conf = &d.conf.map,
                                  .origin = &d.map_service.origin};
    CHECK(saver_start(&d.saver, &env, &fault));
}

static void end_saving(void)
{
    char lock[80];
    request_jobs_end(&jobs);
    map_service_end(&d.map_service);
    saver_end(&d.saver);
    CHECK(!d.saver.busy);
    free_parts();
    snprintf(lock, sizeof lock, "%s/.lock", folder);
    CHECK_INT(unlink(lock), 0);
}

static void remove_saved(unsigned n)
{
    char path[80];
    snprintf(path, sizeof path, "%s/" SAVER_NAME "%u.map", folder, n);
    CHECK_INT(unlink(path), 0);
}

/* The owner is busy, and the loop goes on; when it is let go the oldest submap goes to its file, from which it may be
 * loaded. */
TEST(the_oldest_submap_is_saved_once_and_dropped)
{
    struct hold hold;
    begin_saving();
    fill_map();
    hold_owner(&hold, d.pipeline);
    TURN_UNTIL(d.loop, d.saver.busy);
    CHECK(d.saver.busy && d.saver.saved == 0);
    sem_post(&hold.go);
    turn_until(&d.saver.saved);
    TURN_UNTIL(d.loop, !has_first());
    CHECK(!has_first());
    for (int i = 0; i < 100; i++) /* by then memory is not low any more */
        loop_turn(d.loop, 10000000);
    CHECK(d.saver.saved == 1 && d.saver.errors == 0);
    CHECK(!map_service_save(&d.map_service, SAVER_NAME "1", &(struct fault){""}));
    CHECK(map_service_load(&d.map_service, SAVER_NAME "1", &(struct fault){""}));
    end_job();
    CHECK(any_submap());
    end_saving();
    remove_saved(1);
}

/* What has no bytes yet goes to no disk, and what is not safe there is not dropped. */
TEST(at_the_end_no_submap_is_dropped_that_was_not_saved)
{
    struct hold hold;
    begin_saving();
    fill_map();
    hold_owner(&hold, d.pipeline);
    TURN_UNTIL(d.loop, d.saver.busy);
    CHECK(d.saver.busy);
    sem_post(&hold.go);
    request_jobs_end(&jobs);
    CHECK(has_first());
    CHECK_INT(d.saver.saved, 0);
    end_saving();
}

/* The disk refuses: it is told, tried again, and the map keeps the submap as long as it can. */
TEST(what_cannot_be_saved_is_not_dropped)
{
    begin_saving();
    fill_map();
    snprintf(d.conf.map.directory, sizeof d.conf.map.directory, "%s/none", folder);
    turn_until(&d.saver.errors);
    CHECK(has_first() && d.saver.saved == 0);
    snprintf(d.conf.map.directory, sizeof d.conf.map.directory, "%s", folder);
    turn_until(&d.saver.saved);
    end_saving();
    remove_saved(1);
}

/* ---- templates ---- */

/* A change that the extract stage has not heard of keeps what was before: there are never two of a sonar. */
TEST(changes_of_a_template_come_one_after_the_other)
{
    const struct background_shape shape = {
        .rows = 1, .bins = 4, .dr_m = 0.1f, .row_rad = 1, .law = AMPLITUDE_LINEAR};
    struct request forget[2] = {{.method = "background_forget"}, {.method = "background_forget"}};
    struct hold hold;
    struct fault fault;
    begin();
    d.conf.n_sonars = 1;
    snprintf(d.conf.sonar[0].device, sizeof d.conf.sonar[0].device, "ping360");
    d.templates.env = (struct template_env){.conf = &d.conf, .pipeline = d.pipeline};
    hold_owner(&hold, d.pipeline);
    CHECK(template_put(&d.templates, 0, background_init(malloc(background_size(&shape)), &shape, 64), "a file",
                       &fault));
    for (int i = 0; i < 2; i++) {
        CHECK(!go_on(&forget[i]));
        CHECK(forget[i].work.waits && !forget[i].work.state);
    }
    CHECK_INT(d.templates.of[0].handing, 1);
    CHECK(d.templates.of[0].background != NULL);
    drop(&forget[0]); /* its client has gone, and leaves nothing */
    sem_post(&hold.go);
    finish(&forget[1]);
    CHECK(d.templates.of[0].background == NULL);
    end();
    template_end(&d.templates);
}

/* ---- the map as a whole, to disk and back ---- */

/* What the map has. */
struct look {
    struct owner_job call;
    uint32_t submaps, tiles;
};

static void look(void *ctx, const struct pipeline_owned *owned)
{
    struct look *l = ctx;
    const struct voxmap *map = &owned->map->map;
    l->submaps = l->tiles = 0;
    for (uint32_t i = 0; i < map->set.max_submaps; i++)
        l->submaps += map->part[i].id != 0;
    l->tiles = map->tiles.n - map->tiles.n_free;
}

static struct look look_now(void)
{
    struct look l = {0};
    owner_call_now(d.pipeline, &l.call, look);
    return l;
}

/* Three submaps, of which the last is not closed. */
static void fill_a_little(void)
{
    for (int s = 0; s < 3; s++) {
        if (s)
            owner_run_map_now(d.pipeline, close_submap, NULL);
        ping_from(100 * s, 0);
    }
}

static void remove_map(const char *name)
{
    char path[120];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    CHECK_INT(unlink(path), 0);
}

static void turn(int n)
{
    for (int i = 0; i < n; i++)
        loop_turn(d.loop, 1000000);
}

/* While the owner is busy a request waits that needs it, and the loop for none. */
TEST(nobody_waits_while_a_map_is_copied_or_put_in)
{
    static const char *const methods[] = {"map_save", "map_export", "map_load"};
    begin();
    fill_a_little();
    for (int i = 0; i < 3; i++) {
        struct request r = {.method = methods[i], .name = "kept"};
        struct hold hold;
        hold_owner(&hold, d.pipeline);
        CHECK(!go_on(&r));
        turn(20);
        CHECK(!go_on(&r));
        CHECK_INT(d.map_service.asked.job.state, MAP_SERVICE_RUNNING);
        sem_post(&hold.go);
        finish(&r);
        end_job();
    }
    end();
    remove_map("kept.map");
    remove_map("kept.ply");
}

TEST(nobody_waits_while_a_map_is_kept)
{
    struct hold hold;
    begin();
    fill_a_little();
    d.conf.map.save_every_s = 0.01;
    map_service_end(&d.map_service); /* as it was started without */
    d.map_service = (struct map_service){0};
    start_service();
    hold_owner(&hold, d.pipeline);
    turn(50);
    CHECK_INT(d.map_service.kept.job.state, MAP_SERVICE_IDLE);
    sem_post(&hold.go);
    TURN_UNTIL(d.loop, d.map_service.kept.job.state == MAP_SERVICE_DONE);
    CHECK_INT(d.map_service.kept.job.state, MAP_SERVICE_DONE);
    ping_from(212, 12); /* kept at the end */
    const uint32_t all = look_now().tiles;
    end();
    begin();
    struct request r = {.method = "map_load", .name = "last"};
    CHECK(!go_on(&r));
    finish(&r);
    end_job();
    CHECK_INT(look_now().tiles, all);
    end();
    remove_map("last.map");
}

/* Though its owner had nothing to do until both were sent. */
TEST(what_a_client_does_next_is_not_in_what_it_saves)
{
    for (int threads = 0; threads <= 2; threads++) {
        begin_with(threads);
        fill_a_little();
        work_on("map_save");
        struct request forget = {.method = "map_forget"};
        if (go_on(&forget))
            drop(&forget);
        else
            finish(&forget);
        CHECK_INT(look_now().submaps, 0);
        end_job();
        work_on("map_load");
        end_job();
        CHECK_INT(look_now().submaps, 3);
        end();
    }
    remove_map("kept.map");
}

/* Or answers would be free of what the next submap says. */
TEST(nobody_sees_half_of_a_map_that_is_put_in)
{
    for (int threads = 0; threads <= 2; threads++) {
        begin_with(threads);
        fill_a_little();
        work_on("map_save");
        end_job();
        const uint32_t all = look_now().tiles;
        struct request r = {.method = "map_load", .name = "kept"};
        const bool answered = go_on(&r);
        while (d.map_service.asked.job.state == MAP_SERVICE_RUNNING) {
            struct look l = {0};
            while (!owner_poll(d.pipeline, &l.call, look))
                loop_turn(d.loop, 1000000);
            CHECK_INT(l.submaps, 3);
            CHECK_INT(l.tiles, all);
            loop_turn(d.loop, 1000000);
        }
        if (answered)
            drop(&r);
        else
            finish(&r);
        CHECK_INT(d.map_service.asked.job.state, MAP_SERVICE_DONE);
        end();
    }
    remove_map("kept.map");
}

/* What waits for the owner then is done, or the last that is kept would be half of a map. */
TEST(a_job_that_has_begun_is_done_at_the_end)
{
    begin();
    fill_a_little();
    work_on("map_save");
    end_job();
    struct hold hold;
    struct request r = {.method = "map_load", .name = "kept"}, forget = {.method = "map_forget"};
    CHECK(!go_on(&forget));
    finish(&forget);
    hold_owner(&hold, d.pipeline);
    CHECK(!go_on(&r));
    TURN_UNTIL(d.loop, waiting() >= 2); /* its answer, and the job */
    CHECK_INT(waiting(), 2);
    sem_post(&hold.go);
    drop(&r);
    request_jobs_end(&jobs);
    map_service_end(&d.map_service);
    CHECK_INT(d.map_service.asked.job.state, MAP_SERVICE_DONE);
    CHECK_INT(look_now().submaps, 3);
    free_parts();
    remove_map("kept.map");
}

static int measured;

/* The map grows whenever it has been measured, but for the third time. */
static void run_and_grow(struct map_job *job)
{
    struct map_job_step next;
    while (next = map_job_next(job), next.owner || next.worker) {
        if (next.owner)
            owner_call_now(d.pipeline, &job->call, next.owner);
        else
            next.worker(job);
        if (next.owner == map_steps_measure && ++measured < 3)
            for (int i = 0; i < 5; i++)
                ping_from(200 + 6 * (i - 2), 12 * (2 * measured - 3));
    }
}

TEST(a_map_that_outgrows_its_copy_is_copied_anew)
{
    begin();
    fill_a_little();
    static struct map_job job;
    job = (struct map_job){
        .what = MAP_SERVICE_SAVE, .now_ns = loop_now(d.loop), .setting = pipeline_map_setting(d.pipeline)};
    snprintf(job.path, sizeof job.path, "%s/kept.map", folder);
    measured = 0;
    run_and_grow(&job);
    CHECK(job.good);
    CHECK_INT(measured, 3);
    const uint32_t all = look_now().tiles;
    work_on("map_load");
    end_job();
    CHECK_INT(look_now().tiles, all);
    end();
    remove_map("kept.map");
}

struct half {
    bool any, held;
};

/* Of a map whose first submaps were 1 to 3. */
static void see_half(void *ctx, struct pipeline_map *m)
{
    struct half *half = ctx;
    *half = (struct half){.held = m->map.held};
    for (uint32_t i = 0; i < m->map.set.max_submaps; i++)
        half->any |= m->map.part[i].id > 3;
}

/* It counts from where poses did when it was asked for: to where they come back meanwhile it is not, at no moment. */
TEST(a_map_that_is_put_in_is_free_nowhere_else_than_where_it_was_asked_for)
{
    static const double meanwhile_m[] = {0, 2000}; /* back, or on to yet another place */
    for (int threads = 0; threads <= 2; threads++)
        for (int i = 0; i < 2; i++) {
            struct request r = {.method = "map_load", .name = "kept"};
            begin_with(threads);
            fill_a_little();
            work_on("map_save");
            end_job();
            position(0);
            position(1000);
            const bool answered = go_on(&r);
            position(meanwhile_m[i]);
            struct half half = {false, false};
            while (d.map_service.asked.job.state == MAP_SERVICE_RUNNING) {
                loop_turn(d.loop, 1000000);
                owner_run_map_now(d.pipeline, see_half, &half);
                CHECK(half.held || !half.any);
            }
            CHECK(half.any);
            if (answered)
                drop(&r);
            else
                finish(&r);
            CHECK(is_held());
            position(1000);
            CHECK(!is_held());
            end();
            if (test_case_failed)
                printf("(%d threads, to %g m)\n", threads, meanwhile_m[i]);
        }
    remove_map("kept.map");
}

int main(void)
{
    CHECK(mkdtemp(folder) != NULL);
    RUN(who_changes_the_map_says_that_its_places_hold);
    RUN(of_a_jump_that_comes_later_it_says_nothing);
    RUN(of_a_second_jump_it_says_nothing_either);
    RUN(who_drives_back_has_not_jumped_back);
    RUN(after_jumps_in_a_long_silence_a_client_has_to_say);
    RUN(jumps_add_up);
    RUN(a_jump_in_small_steps_is_one);
    RUN(noise_is_no_jump);
    RUN(a_jump_right_after_a_word_is_one);
    RUN(depth_and_heading_jump_too);
    RUN(nothing_is_free_behind_the_wall_on_random_voyages);
    RUN(of_a_jump_while_a_map_is_loaded_the_file_says_nothing);
    RUN(an_empty_map_into_which_no_file_came_is_not_held);
    RUN(a_start_with_a_map_that_cannot_be_put_in_is_not_held);
    RUN(a_map_of_another_kind_is_refused_and_the_map_stays);
    RUN(what_was_only_asked_is_not_done_for_those_who_have_gone);
    RUN(who_may_change_nothing_any_more_is_told_what_came_of_it);
    RUN(the_oldest_submap_is_saved_once_and_dropped);
    RUN(at_the_end_no_submap_is_dropped_that_was_not_saved);
    RUN(what_cannot_be_saved_is_not_dropped);
    RUN(changes_of_a_template_come_one_after_the_other);
    RUN(nobody_waits_while_a_map_is_copied_or_put_in);
    RUN(nobody_waits_while_a_map_is_kept);
    RUN(what_a_client_does_next_is_not_in_what_it_saves);
    RUN(nobody_sees_half_of_a_map_that_is_put_in);
    RUN(a_job_that_has_begun_is_done_at_the_end);
    RUN(a_map_that_outgrows_its_copy_is_copied_anew);
    RUN(a_map_that_is_put_in_is_free_nowhere_else_than_where_it_was_asked_for);
    CHECK_INT(rmdir(folder), 0);
    return test_end();
}
