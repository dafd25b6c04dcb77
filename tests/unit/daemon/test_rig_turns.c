/* SPDX-License-Identifier: MIT */
/*
 * test_rig_turns - no question holds the loop up: every method, whose cells are all in use, at random and at its
 * greatest parameters. Each is answered here. Under callgrind every turn of the loop meanwhile is a dump with the
 * question in it, and tests/valgrind.sh counts its instructions.
 */
#include "tests/lib/rig.h"

#include "daemon/options.h"

#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#define COUNT()             CALLGRIND_START_INSTRUMENTATION
#define COUNT_FROM_HERE()   CALLGRIND_ZERO_STATS
#define COUNT_TO_HERE(name) CALLGRIND_DUMP_STATS_AT(name)
#else
#define COUNT()             ((void)0)
#define COUNT_FROM_HERE()   ((void)0)
#define COUNT_TO_HERE(name) ((void)(name))
#endif

#define FILL_BEAMS 64
#define FILL_PINGS 40000 /* more than any pool here has cells */
#define TURNS_MAX  20000 /* of one answer */
#define LINE_MAX   (RPC_LINE_MAX + 1)

static uint64_t random_state;

/* Whatever is done takes longer than clients have in a turn: every part of an answer is a turn of its own. */
static uint64_t slow_clock(void)
{
    static uint64_t ns;
    return ns += RIG_S;
}

/* ---- a grid with no cell left, and water all around ---- */

static struct beam_echoes any_beam(void)
{
    const float range_m = (float)(1 + 8.5 * test_uniform(&random_state));
    return (struct beam_echoes){.az_rad = (float)(GEO_TURN * test_uniform(&random_state)),
                                .el_rad = (float)asin(2 * test_uniform(&random_state) - 1),
                                .blind_m = 0.3f,
                                .free_to_m = range_m - 0.1f,
                                .heard_from_m = 0.3f,
                                .heard_to_m = 10,
                                .state = BEAM_ECHO,
                                .n = 1,
                                .echo = {{.range_m = range_m,
                                          .near_m = range_m - 0.1f,
                                          .sd_m = 0.02f,
                                          .level = 100,
                                          .strength = 100,
                                          .confidence = 0.9f}}};
}

static void enter_beams(struct grid *grid)
{
    static uint32_t seq;
    struct beam_echoes beam[FILL_BEAMS];
    struct echoes e = {.t_ns = rig_now_ns,
                       .seq = ++seq,
                       .n_beams = FILL_BEAMS,
                       .max_beams = FILL_BEAMS,
                       .range_max_m = 10,
                       .az_aperture_rad = (float)geo_rad(1),
                       .el_aperture_rad = (float)geo_rad(1),
                       .pose = pose_identity,
                       .beam = beam};
    pose_log_newest(&rig.d.poses, &e.pose);
    e.pose.has = POSE_ATTITUDE | POSE_POSITION;
    for (int b = 0; b < FILL_BEAMS; b++)
        beam[b] = any_beam();
    grid_enter(grid, &e, &mount_identity);
}

static void fill(void)
{
    struct grid *grid = pipeline_grid(rig.d.pipeline, 0);
    struct sphere_stats s = {.cells = 0};
    for (int i = 0; i < FILL_PINGS && s.cells_lost == 0; i++) {
        enter_beams(grid);
        grid_stats(grid, &s);
    }
    CHECK(s.cells_lost > 0);
}

/* ---- questions ---- */

static double between(double lo, double hi)
{
    return lo + (hi - lo) * test_uniform(&random_state);
}

static double near_by(double lo, double hi)
{
    return between(fmax(lo, -20), fmin(hi, 20));
}

/* At an end of its range, or where it matters: some metres around. */
static double some(double lo, double hi, bool greatest)
{
    const unsigned kind = (unsigned)(test_random(&random_state) % 4);
    return greatest || kind == 0 ? hi : kind == 1 ? lo : kind == 2 ? near_by(lo, hi) : between(lo, hi);
}

static json_t *numbers(const struct protocol_param *p, unsigned n, bool greatest)
{
    json_t *list = json_array();
    const bool close = test_random(&random_state) % 4 != 0;
    for (unsigned i = 0; i < n; i++)
        json_array_append_new(list,
                              json_real(close && p->type != PROTOCOL_NUMBERS ? near_by(p->lo, p->hi)
                                                                             : some(p->lo, p->hi, greatest)));
    return list;
}

static json_t *places(const struct protocol_param *p, bool greatest)
{
    json_t *list = json_array();
    const unsigned n = greatest ? p->count : 1 + (unsigned)(test_random(&random_state) % p->count);
    for (unsigned i = 0; i < n; i++)
        json_array_append_new(list, numbers(p, 3, false));
    return list;
}

static const char *any_word(const struct protocol_param *p, bool greatest)
{
    unsigned n = 0;
    while (p->words[n])
        n++;
    return p->words[greatest ? n - 1 : test_random(&random_state) % n];
}

/* NULL: what holds without it. */
static json_t *value_of(const struct protocol_param *p, bool greatest)
{
    switch (p->type) {
    case PROTOCOL_NUMBER:
        return json_real(some(p->lo, p->hi, greatest));
    case PROTOCOL_INTEGER:
        return json_integer((json_int_t)(greatest ? p->hi : between(p->lo, p->hi)));
    case PROTOCOL_NUMBERS:
        return numbers(p, p->count, greatest);
    case PROTOCOL_BAND:
        return json_pack("[f,f]", p->lo, p->hi);
    case PROTOCOL_PLACES:
        return places(p, greatest);
    case PROTOCOL_WORD:
        return json_string(any_word(p, greatest));
    case PROTOCOL_MAP:
        return json_string("turns");
    case PROTOCOL_METHOD:
        return json_string("version");
    default:
        return NULL;
    }
}

static json_t *params_of(const struct protocol_method *m, bool greatest)
{
    json_t *params = json_object();
    for (const struct protocol_param *p = m->params; p->name; p++) {
        const bool left = !greatest && p->need != PROTOCOL_REQUIRED && test_random(&random_state) % 3 == 0;
        json_t *value =
            left || (p->instead_of && json_object_get(params, p->instead_of)) ? NULL : value_of(p, greatest);
        if (value)
            json_object_set_new(params, p->name, value);
    }
    return params;
}

static int moves; /* of the grid's centre, one after each of the next turns in which a question is answered */

static void move_centre(void)
{
    struct picture *p = grid_picture(pipeline_grid(rig.d.pipeline, 0));
    struct picture_frame frame;
    picture_get_frame(p, &frame);
    frame.centre_m[0] = moves; /* another each time, though pings move it back */
    picture_begin(p);
    picture_set_frame(p, &frame);
    picture_end(p);
    moves--;
}

/* Turns the loop until the whole answer is there. True: it is a result. */
static bool ask_with(const char *method, json_t *params)
{
    static char line[LINE_MAX];
    size_t got = 0;
    json_t *request =
        json_pack("{s:s,s:i,s:s,s:o}", "jsonrpc", "2.0", "id", 1, "method", method, "params", params);
    const size_t n = json_dumpb(request, line, sizeof line - 2, JSON_COMPACT | JSON_REAL_PRECISION(6));
    json_decref(request);
    CHECK(n < sizeof line - 2);
    line[n] = '\n';
    line[n + 1] = '\0';
    CHECK_INT(write(rig.client, line, n + 1), n + 1);
    line[n < 300 ? n : 300] = '\0';
    for (int i = 0; i < TURNS_MAX && !memchr(rig.answer, '\n', got); i++) {
        COUNT_FROM_HERE();
        loop_turn(rig.d.loop, 0);
        COUNT_TO_HERE(line);
        if (moves > 0)
            move_centre();
        const ssize_t more = read(rig.client, rig.answer + got, sizeof rig.answer - got);
        got += more > 0 ? (size_t)more : 0;
    }
    CHECK(memchr(rig.answer, '\n', got) != NULL);
    json_t *reply = json_loadb(rig.answer, got, 0, NULL);
    const bool good = json_object_get(reply, "result") != NULL;
    CHECK(good || json_object_get(reply, "error"));
    json_decref(reply);
    rig.answer[0] = '\0';
    return good;
}

static void ask(const struct protocol_method *m, bool greatest)
{
    ask_with(m->name, params_of(m, greatest));
}

/* What is bounded by more than its parameters' ranges: close to the bound, where it is not refused. */
static void ask_greatest_of_map(void)
{
    CHECK(ask_with("path", json_pack("{s:[[f,f,f],[f,f,f]],s:f}", "points_m", -8.0, -8.0, 0.0, 8.0, 8.0, 1.0,
                                     "radius_m", 3.5)));
    CHECK(ask_with("map_slice", json_pack("{s:f,s:i}", "size_m", 249.0, "cells", 64)));
    CHECK(ask_with("map_slice", json_pack("{s:f,s:i}", "size_m", 31.0, "cells", 1)));
}

/* All cells; the greatest ranges alone hold none. */
static void lock_all(bool locked)
{
    CHECK(ask_with("grid_lock",
                   json_pack("{s:f,s:f,s:b}", "azimuth_deg", 0.0, "half_angle_deg", 180.0, "locked", locked)));
}

static void ask_all(enum protocol_right right, int times)
{
    for (const struct protocol_method *m = protocol_methods; m->name; m++) {
        if (m->right != right || strcmp(m->name, "watch") == 0 || strcmp(m->name, "unwatch") == 0)
            continue;
        ask(m, true);
        for (int i = 0; i < times; i++)
            ask(m, false);
    }
}

static void all_methods(const char *conf)
{
    const struct options no_file = {.conf = "/none/sonard.conf", .threads = -1};
    random_state = test_seed();
    rig_work_clock = slow_clock;
    rig_start("box -8 8 -8 8 -3 5\ncylinder 5 0 0.5\n", conf);
    rig.d.reload = (struct reload_env){.options = &no_file,
                                       .conf_name = no_file.conf,
                                       .conf = &rig.d.conf,
                                       .loop = rig.d.loop,
                                       .pipeline = rig.d.pipeline,
                                       .poses = &rig.d.poses,
                                       .server = rig.d.server};
    rig.pose_every_ns = RIG_S / 10;
    rig.turn_dps = 20;
    rig_run(40);
    fill();
    COUNT();
    ask_all(PROTOCOL_ASKS, 12);
    ask_greatest_of_map();
    lock_all(true);
    lock_all(false);
    ask_all(PROTOCOL_CHANGES, 0);
    rig_end();
}

#define FULL(step)                                                                                                \
    "[grid]\nangular_step = " step "\nelevation = full\n[map]\nvoxel = 0.1 m\nmemory = 64 MiB\nextent = 40 m\n"   \
    "height = 4 m\n"

TEST(two_degrees)
{
    all_methods(FULL("2 deg"));
}

TEST(one_degree)
{
    all_methods(FULL("1 deg"));
}

/* Its cells may have gone from where is yet to be looked to where was. */
TEST(a_lock_begins_anew_when_the_grid_moves_and_is_refused_when_that_does_not_end)
{
    rig_work_clock = slow_clock;
    rig_start("box -8 8 -8 8 -3 5\n", FULL("1 deg"));
    rig_run(10);
    moves = 3;
    lock_all(true);
    CHECK_INT(moves, 0);
    moves = TURNS_MAX;
    CHECK(!ask_with("grid_lock", json_pack("{s:f,s:f}", "azimuth_deg", 0.0, "half_angle_deg", 180.0)));
    CHECK(moves > 0 && moves < TURNS_MAX - 8);
    moves = 0;
    lock_all(true);
    rig_end();
}

int main(void)
{
    RUN(two_degrees);
    RUN(one_degree);
    RUN(a_lock_begins_anew_when_the_grid_moves_and_is_refused_when_that_does_not_end);
    return test_end();
}
