/* SPDX-License-Identifier: MIT */
/*
 * test_places - what clients ask of the map and change in it goes by errands: what a position that jumps meanwhile makes
 * of it, what is left in the queue by those who go, and rights that end. And grids: what is dropped has its memory until
 * the owner lets it go.
 */
#include "../lib/held_owner.h"
#include "../lib/plain_ping.h"
#include "../lib/test.h"

#include <unistd.h>

#include "../../daemon/daemon.h"
#include "../../daemon/errand.h"
#include "../../daemon/grid_methods.h"
#include "../../daemon/methods.h"
#include "../../daemon/pipeline_state.h"

static struct daemon d;

static char folder[] = "/tmp/sonard-places-XXXXXX";

static void begin(void)
{
    struct pipeline_conf c = {.threads = 1,
                              .queue = 4,
                              .max_beams = 1,
                              .max_samples = 100,
                              .max_bins = 100,
                              .n_sensors = 1,
                              .mount = {mount_identity},
                              .grid = {.name = "main",
                                       .sphere = {.angular_step_rad = geo_rad(10),
                                                  .layers = {.r_max_m = 30, .dr_m = 0.5, .n_const = 29, .growth = 1.035},
                                                  .max_cells = 1000,
                                                  .forget_s = 160,
                                                  .blocked_above = 0.6,
                                                  .recentre_m = 0.1}},
                              .map = true,
                              .mask_blocks = 1024,
                              .voxels = {.voxel_m = 0.5,
                                         .side = 4,
                                         .height = 40,
                                         .n_tiles = 60,
                                         .max_submaps = 4,
                                         .rule = {.threshold = 2, .echo_weight = 4},
                                         .opening = 1,
                                         .weight_levels = 1,
                                         .submap_path_m = INFINITY,
                                         .submap_ns = VOXMAP_NEVER,
                                         .half_life_ns = VOXMAP_NEVER}};
    char err[200] = "";
    extract_defaults(&c.extract[0]);
    d = (struct daemon){.loop = loop_new(false), .pipeline = pipeline_new(&c, err, sizeof err)};
    snprintf(d.conf.map.directory, sizeof d.conf.map.directory, "%s", folder);
    if (!d.pipeline || !errand_start(&d, err, sizeof err) || !places_start(&d, err, sizeof err)) {
        printf("%s\n", err);
        exit(1);
    }
}

static void end(void)
{
    errand_end(&d);
    places_end(&d);
    pipeline_free(d.pipeline);
    loop_free(d.loop);
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
    struct text out = {0};
    json_t *params = r->name ? json_pack("{s:s}", "name", r->name) : NULL;
    const bool good = rpc_answer(daemon_methods, &call, r->method, params, &out, &error);
    CHECK(good || error.code == RPC_UNFINISHED);
    json_decref(params);
    free(out.bytes);
    return error.code != RPC_UNFINISHED;
}

static void drop(struct request *r)
{
    if (r->work.state)
        r->work.drop(r->work.state);
    r->work = (struct rpc_work){0};
}

static void finish(struct request *r)
{
    bool done = false;
    for (int i = 0; i < 10000 && !done; i++) {
        loop_turn(d.loop, 10000000);
        done = go_on(r);
    }
    CHECK(done);
    drop(r);
}

/* ---- a position that jumps ---- */

/* The map is of there. */
static void ping_at(double north_m)
{
    struct ping *ping = plain_ping(d.pipeline);
    ping->pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
    ping->pose.position_m[0] = north_m;
    pipeline_submit(d.pipeline, ping);
    pipeline_drain(d.pipeline);
}

static void position(double north_m)
{
    static uint64_t t_ns;
    struct pose pose = pose_identity;
    pose.t_ns = t_ns += 10000000;
    pose.position_m[0] = north_m;
    places_position(&d, &pose);
}

static void see_held(void *ctx, struct pipeline_map *m)
{
    *(bool *)ctx = m->map.held;
}

static bool is_held(void)
{
    bool held = false;
    pipeline_visit_map(d.pipeline, see_held, &held);
    CHECK(held == d.places.track.astray);
    return held;
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

static void work_on(const char *method)
{
    struct request r = {.method = method, .name = "kept"};
    CHECK(!go_on(&r));
    finish(&r);
}

static void end_job(void)
{
    for (int i = 0; i < 10000 && d.places.asked.job.state == PLACES_RUNNING; i++)
        loop_turn(d.loop, 10000000);
    CHECK_INT(d.places.asked.job.state, PLACES_DONE);
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

/* ---- clients that go ---- */

static int waiting(void)
{
    int n = 0;
    for (const struct errand *e = d.pipeline->errands.first; e; e = e->next)
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

/* ---- grids ---- */

static bool is_room_for(size_t bytes)
{
    char err[200];
    return grid_has_room(&d, "next", bytes, err, sizeof err);
}

TEST(a_dropped_grid_has_its_memory_until_it_is_freed)
{
    char err[200];
    for (int gone = 0; gone < 2; gone++) {
        struct hold hold;
        begin();
        struct grid_setting setting = pipeline_grid(d.pipeline, 0)->setting;
        snprintf(setting.name, sizeof setting.name, "kept");
        struct grid_errand come = {.grid = grid_new(&setting, err, sizeof err)};
        const size_t bytes = come.grid->bytes;
        CHECK(pipeline_add_grid(d.pipeline, come.grid));
        while (!pipeline_errand(d.pipeline, &come.errand, pipeline_feed_grid))
            loop_turn(d.loop, 10000000);
        d.conf.grids.memory_bytes = 2 * (double)bytes;
        CHECK(is_room_for(0) && !is_room_for(1));
        hold_owner(&hold, d.pipeline);
        struct request r = {.method = "grid_drop", .name = "kept"};
        CHECK(!go_on(&r));
        CHECK(!pipeline_grid(d.pipeline, 1) && !is_room_for(1));
        if (gone)
            drop(&r);
        sem_post(&hold.go);
        if (!gone)
            finish(&r);
        for (int i = 0; i < 1000 && !is_room_for(bytes); i++)
            loop_turn(d.loop, 10000000);
        CHECK(is_room_for(bytes) && !is_room_for(bytes + 1));
        end();
    }
}

int main(void)
{
    CHECK(mkdtemp(folder) != NULL);
    RUN(who_changes_the_map_says_that_its_places_hold);
    RUN(of_a_jump_that_comes_later_it_says_nothing);
    RUN(of_a_jump_while_a_map_is_loaded_the_file_says_nothing);
    RUN(what_was_only_asked_is_not_done_for_those_who_have_gone);
    RUN(who_may_change_nothing_any_more_is_told_what_came_of_it);
    RUN(a_dropped_grid_has_its_memory_until_it_is_freed);
    CHECK_INT(rmdir(folder), 0);
    return test_end();
}
