/* SPDX-License-Identifier: MIT */
/*
 * test_plan - what a configuration needs is in, what it does not need is out, for the reason and with the proof that
 * the plan gives; the wiring follows the plan; what is left out as identical changes no echo; bytes are exact.
 */
#include "tests/lib/test.h"

#include "config/conf_source.h"
#include "core/fault.h"
#include "daemon/plan_memory.h"
#include "daemon/settings.h"
#include "daemon/wiring.h"

#define SONAR "[sonar a]\ndevice = ping360\nport = serial:/dev/x:115200\n"

/* As the option --socket none makes it of SONAR. */
#define NO_SOCKET SONAR "\n"

static void print_fault(void *ctx, const char *message)
{
    (void)ctx;
    printf("%s\n", message);
    test_case_failed = true;
}

static void load(const char *text, struct conf *conf)
{
    struct conf_source *source;
    conf_load_text(conf, &source, &(struct conf_text){"test", text, strlen(text)}, &settings_checks, print_fault,
                   NULL);
    conf_source_free(source);
    if (strcmp(text, NO_SOCKET) == 0)
        snprintf(conf->server.socket, sizeof conf->server.socket, "none");
}

static const struct plan_stage *find(const struct plan *plan, enum plan_id id)
{
    for (int i = 0; i < plan->n; i++)
        if (plan->stage[i].id == id)
            return &plan->stage[i];
    printf("no %s in the plan\n", plan_name(id));
    test_case_failed = true;
    return &plan->stage[0];
}

static const struct {
    const char *name, *text;
    enum plan_id id;
    enum plan_proof proof;
    const char *why; /* a part of it */
} cases[] = {
    {"intensities are extracted", SONAR, PLAN_EXTRACT, PLAN_NONE, "intensities"},
    {"no clean-up asked for", SONAR, PLAN_CLEANUP, PLAN_BOUNDED, "are off"},
    {"classes are read", SONAR "[extract]\nmedian = 3\nclasses = on\n", PLAN_CLEANUP, PLAN_NONE, "median classes"},
    {"order paper reads it", SONAR "[extract]\norder = paper\nmedian = 3\n", PLAN_CLEANUP, PLAN_NONE, "median"},
    {"otsu is read", SONAR "[extract]\notsu = on\n", PLAN_CLEANUP, PLAN_NONE, "otsu"},
    {"ranges have no image", "[sonar a]\ndevice = ping1d\nport = serial:/dev/x:115200\n[extract]\nclasses = on\n",
     PLAN_CLEANUP, PLAN_IDENTICAL, "no image"},
    {"marks", SONAR, PLAN_MARKS, PLAN_NONE, "on"},
    {"no marks", SONAR "[extract]\nmarks = off\n", PLAN_MARKS, PLAN_BOUNDED, "marks = off"},
    {"an image for clients", SONAR, PLAN_IMAGE, PLAN_NONE, "clients"},
    {"nobody asks for the image", NO_SOCKET, PLAN_IMAGE, PLAN_IDENTICAL, "socket"},
    {"level", SONAR "[grid]\nelevation = level\n", PLAN_ELEVATION, PLAN_BOUNDED, "level"},
    {"a vehicle that may move", SONAR, PLAN_MOTION, PLAN_NONE, "positions"},
    {"no relaxation", SONAR, PLAN_RELAXATION, PLAN_BOUNDED, "relaxation = 0"},
    {"relaxation", SONAR "[grid]\nrelaxation = 0.5\n", PLAN_RELAXATION, PLAN_NONE, "relaxation = 0.5"},
    {"no map", SONAR, PLAN_MAP, PLAN_BOUNDED, "voxel = none"},
    {"a map", SONAR "[map]\nvoxel = 0.2 m\n", PLAN_MAP, PLAN_NONE, "voxel"},
    {"no map, no saver", SONAR, PLAN_SAVER, PLAN_IDENTICAL, "no map"},
    {"a map without files", SONAR "[map]\nvoxel = 0.2 m\n", PLAN_SAVER, PLAN_BOUNDED, "directory"},
    {"steered", SONAR "scan = active\n", PLAN_ACTIVE_SENSING, PLAN_NONE, "active"},
    {"steered, with a promise about the water", SONAR "[vehicle]\ncurrent = 0.1 m/s\n", PLAN_ACTIVE_SENSING,
     PLAN_NONE, "auto"},
    {"plain all the same", SONAR "scan = plain\n[vehicle]\ncurrent = 0.1 m/s\n", PLAN_ACTIVE_SENSING, PLAN_BOUNDED,
     "no sonar"},
    {"a sector is not steered", SONAR "sector = 300 60 deg\n[vehicle]\ncurrent = 0.1 m/s\n", PLAN_ACTIVE_SENSING,
     PLAN_BOUNDED, "no sonar"},
    {"one that pings by itself", SONAR "mode = transmit\n[vehicle]\ncurrent = 0.1 m/s\n", PLAN_ACTIVE_SENSING,
     PLAN_BOUNDED, "no sonar"},
    {"no head to steer", "[sonar a]\ndevice = ping1d\nport = serial:/dev/x:115200\n[vehicle]\ncurrent = 0.1 m/s\n",
     PLAN_ACTIVE_SENSING, PLAN_BOUNDED, "no sonar"},
    {"threads", SONAR "[pipeline]\nthreads = 2\n", PLAN_THREADS, PLAN_NONE, "2"},
    {"a template", SONAR "background = /var/lib/x.bg\n", PLAN_BACKGROUND, PLAN_NONE, "template"},
};

TEST(every_reason)
{
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct conf conf;
        struct plan plan;
        load(cases[i].text, &conf);
        plan_make(&conf, &plan);
        const struct plan_stage *s = find(&plan, cases[i].id);
        const bool good = s->proof == cases[i].proof && s->in == (s->proof == PLAN_NONE) &&
                          s->in == plan_has(&plan, s->id, s->which) && strstr(s->why, cases[i].why);
        if (!good)
            printf("%s: %s, %s\n", cases[i].name, plan_proof_name(s->proof), s->why);
        CHECK(good);
    }
}

TEST(the_wiring_follows_the_plan)
{
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        struct conf conf;
        struct plan plan;
        struct pipeline_conf p;
        load(cases[i].text, &conf);
        plan_make(&conf, &plan);
        wiring_pipeline(&conf, &plan, true, &p);
        CHECK_INT(p.image, plan_has(&plan, PLAN_IMAGE, 0));
        CHECK_INT(p.marks, plan_has(&plan, PLAN_MARKS, 0));
        CHECK_INT(p.map, plan_has(&plan, PLAN_MAP, 0));
        CHECK_INT(cleanup_wanted(&p.cleanup[0]), plan_has(&plan, PLAN_CLEANUP, 0));
        CHECK_INT(!p.grid.sphere.level, plan_has(&plan, PLAN_ELEVATION, 0));
        CHECK_INT(p.grid.sphere.relaxation > 0, plan_has(&plan, PLAN_RELAXATION, 0));
        CHECK_INT(p.threads > 0, plan_has(&plan, PLAN_THREADS, 0));
    }
}

/* What a grid is told, it gets. */
TEST(the_numbers_of_a_grid_arrive)
{
    struct conf conf;
    struct plan plan;
    struct pipeline_conf p;
    load(SONAR "[grid]\nangular_step = 3 deg\nlayer = 0.07 m\ngrowth = 1.05\nrange_error = 0.007\n"
               "mask_reach = 1.5\nrelaxation = 0.3\ncluster_relaxation = 0.4\nmax_cells = 2000\nblocked_above = "
               "0.7\nclear_for = 20 s\n"
               "forget = 90 s\nmove_limit = 0.4 m\nsensor_model = gauss\nupdate = max\n",
         &conf);
    plan_make(&conf, &plan);
    wiring_pipeline(&conf, &plan, true, &p);
    const struct sphere_conf *s = &p.grid.sphere;
    CHECK_NEAR(geo_deg(s->angular_step_rad), 3, 1e-12, 0);
    CHECK_NEAR(s->layers.dr_m, 0.07, 1e-12, 0);
    CHECK_NEAR(s->layers.growth, 1.05, 1e-12, 0);
    CHECK_NEAR(s->range_error, 0.007, 1e-12, 0);
    CHECK_NEAR(s->mask_reach, 1.5, 1e-12, 0);
    CHECK_NEAR(s->relaxation, 0.3, 1e-12, 0);
    CHECK_NEAR(s->cluster_relaxation, 0.4, 1e-12, 0);
    CHECK_NEAR(s->blocked_above, 0.7, 1e-12, 0);
    CHECK_NEAR(s->forget_s, 90, 1e-12, 0);
    CHECK_NEAR(s->forget_turns, 0, 0, 0);
    CHECK_NEAR(p.grid.limits.clear_for_s, 20, 1e-12, 0);
    CHECK_NEAR(p.grid.limits.move_limit_m, 0.4, 1e-12, 0);
    CHECK_INT(s->max_cells, 2000);
    CHECK_INT(s->model, SPHERE_GAUSS);
    CHECK_INT(s->update, SPHERE_MAX);
}

TEST(the_numbers_of_the_extraction_arrive)
{
    struct conf conf;
    struct extract_conf e;
    struct cleanup_conf c;
    load(SONAR "amplitude = log\ndecibels_per_count = 0.3 dB\nring_down = 0.6 m\n"
               "[extract]\ndetector = os\norder = paper\nfalse_alarm = 1e-4\nwindow = 0.5 m\nguard = 0.2 m\n"
               "rank = 0.6\nfloor = 9\nmin_contrast = 13 dB\nlearn_ring_down = on\nno_echo = range\n"
               "target = 3 dB\nbottom = 16 dB\nminimum_range = 0.9 m\n"
               "median = 5\notsu = on\nclahe = on\nclahe_clip = 3\nclasses = on\n",
         &conf);
    wiring_extract(&conf, 0, &e);
    CHECK_INT(e.detector, CFAR_OS);
    CHECK_INT(e.order, EXTRACT_PAPER);
    CHECK_NEAR(e.false_alarm, 1e-4, 1e-12, 0);
    CHECK_NEAR(e.window_m, 0.5, 1e-12, 0);
    CHECK_NEAR(e.guard_m, 0.2, 1e-12, 0);
    CHECK_NEAR(e.rank, 0.6, 1e-12, 0);
    CHECK_INT(e.floor_counts, 9);
    CHECK_NEAR(e.min_contrast_db, 13, 1e-12, 0);
    CHECK_INT(e.no_echo, EXTRACT_RANGE);
    CHECK_NEAR(e.target_db, 3, 1e-12, 0);
    CHECK_NEAR(e.bottom_db, 16, 1e-12, 0);
    CHECK_NEAR(e.minimum_range_m, 0.9, 1e-12, 0);
    CHECK(e.learn_ring_down);
    CHECK_NEAR(e.ring_down_m, 0.6, 1e-12, 0);
    CHECK_INT(e.law, AMPLITUDE_LOG);
    CHECK_NEAR(e.db_per_count, 0.3, 1e-12, 0);
    wiring_cleanup(&conf.extract, &c);
    CHECK(c.median == 5 && c.otsu && c.clahe && c.clip == 3 && c.classes && c.survivors);
    load(SONAR "[extract]\nmedian = 3\nclasses = on\n", &conf);
    wiring_extract(&conf, 0, &e);
    CHECK(e.detector == CFAR_SOCA && e.order == EXTRACT_SAFE && e.no_echo == EXTRACT_HEARD && !e.learn_ring_down);
    CHECK(e.law == EXTRACT_LAW_OF_PING && e.ring_down_m < 0);
    wiring_cleanup(&conf.extract, &c);
    CHECK(c.median == 3 && !c.otsu && !c.clahe && c.classes && !c.survivors);
}

static struct pose_drift drift_of(const char *text)
{
    struct conf conf;
    struct pose_drift drift;
    load(text, &conf);
    wiring_drift(&conf, &drift);
    return drift;
}

/* How fast a vehicle is taken to drift that nobody sees. */
TEST(the_drift_is_as_the_vehicle_says)
{
    struct pose_drift d = drift_of(SONAR);
    CHECK(d.mps == 3 && d.from_pose && !d.keeps_heading && !d.bounded);
    CHECK_NEAR(d.heading_radps, geo_rad(0.01), 1e-9, 0);
    d = drift_of(SONAR "[vehicle]\nmax_speed = 1.5 m/s\n[pose]\nheading_drift = 0.05 deg/s\n");
    CHECK(d.mps == 1.5 && !d.from_pose && !d.keeps_heading && !d.bounded);
    CHECK_NEAR(d.heading_radps, geo_rad(0.05), 1e-9, 0);
    d = drift_of(SONAR "[vehicle]\ncurrent = 0.2 m/s\n");
    CHECK(d.mps == 3 && d.bounded && d.water_mps == 0.2);
    d = drift_of(SONAR "[vehicle]\ncurrent = 0.2 m/s\nstation_keeping = 0.1 m/s\n");
    CHECK(d.mps == 0.1 && !d.from_pose && d.keeps_heading && !d.bounded);
}

TEST(the_numbers_of_a_map_arrive)
{
    static const struct {
        const char *text;
        int levels;
        enum cast_shape shape;
        bool good;
    } row[] = {{"", 1, CAST_WEDGE, true},
               {"weight_levels = 4\nbeam = pyramid\n", 4, CAST_PYRAMID, true},
               {"weight_levels = 8\nthreshold = 31\n", 8, CAST_WEDGE, true}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        struct conf conf;
        struct plan plan;
        struct pipeline_conf p;
        struct fault fault = {""};
        char text[256];
        snprintf(text, sizeof text, SONAR "[map]\nvoxel = 0.2 m\n%s", row[i].text);
        load(text, &conf);
        plan_make(&conf, &plan);
        wiring_pipeline(&conf, &plan, true, &p);
        CHECK_INT(p.voxels.weight_levels, row[i].levels);
        CHECK_INT(p.shape[0], row[i].shape);
        CHECK_INT(wiring_check(&conf, &p, &fault), row[i].good);
    }
}

/* The plan has room for the most that a configuration may ask for. */
TEST(the_largest_plan_fits)
{
    static struct conf conf;
    struct plan plan;
    load(SONAR, &conf);
    for (int i = 1; i < CONF_MAX_SONARS; i++)
        conf.sonar[i] = conf.sonar[0];
    conf.n_sonars = CONF_MAX_SONARS;
    conf.n_more_grids = CONF_MAX_GRIDS;
    plan_make(&conf, &plan);
    CHECK(plan.n <= PLAN_STAGES_MAX);
    CHECK_INT(plan.n, CONF_MAX_SONARS * 6 + (CONF_MAX_GRIDS + 1) * 4 + 8);
}

static double memory(const char *text)
{
    struct conf conf;
    struct plan plan;
    double bytes[PLAN_STAGES_MAX];
    load(text, &conf);
    plan_make(&conf, &plan);
    return plan_memory(&plan, &conf, bytes);
}

TEST(more_takes_more)
{
    static const struct {
        const char *less, *more;
    } pairs[] = {{SONAR "[grid]\nangular_step = 4 deg\n", SONAR "[grid]\nangular_step = 1 deg\n"},
                 {SONAR "[grid]\nelevation = level\n", SONAR},
                 {SONAR, SONAR "[grid]\nrelaxation = 0.5\n"},
                 {NO_SOCKET, SONAR},
                 {SONAR "[extract]\nmarks = off\n", SONAR},
                 {SONAR, SONAR "[extract]\nclasses = on\n"},
                 {SONAR "[extract]\nclasses = on\n", SONAR "[extract]\nclasses = on\nmedian = 5\n"},
                 {SONAR, SONAR "[map]\nvoxel = 0.2 m\n"}};
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        const double less = memory(pairs[i].less), more = memory(pairs[i].more);
        if (less >= more)
            printf("pair %zu: %g < %g\n", i, less, more);
        CHECK(less < more);
    }
    CHECK(memory(SONAR) == memory(SONAR "[extract]\ndetector = os\n"));
}

/* Bytes are those that are taken. */
TEST(bytes_are_exact)
{
    struct conf conf;
    struct plan plan;
    struct pipeline_conf p;
    double bytes[PLAN_STAGES_MAX];
    struct fault fault;
    load(SONAR "[extract]\nclasses = on\nmedian = 5\n[grid]\nrelaxation = 1\n", &conf);
    plan_make(&conf, &plan);
    plan_memory(&plan, &conf, bytes);
    wiring_pipeline(&conf, &plan, true, &p);
    double grid = 0;
    for (int k = 0; k < plan.n; k++) {
        if (plan.stage[k].id == PLAN_CLEANUP)
            CHECK_NEAR(bytes[k], cleanup_size(&p.cleanup[0], p.max_bins), 0, 0);
        if (plan.stage[k].in && plan.stage[k].id >= PLAN_GRID && plan.stage[k].id <= PLAN_RELAXATION)
            grid += bytes[k];
    }
    CHECK_NEAR(grid, sphere_bytes(&p.grid.sphere, &fault), 0, 0);
}

/* What is no whole number of voxels, or of tiles, is one more. */
TEST(a_map_is_no_smaller_than_asked)
{
    struct conf conf;
    struct plan plan;
    struct pipeline_conf p;
    load(SONAR "[map]\nvoxel = 0.2 m\nheight = 10.1 m\nextent = 52 m\n", &conf);
    plan_make(&conf, &plan);
    wiring_pipeline(&conf, &plan, true, &p);
    CHECK_INT(p.voxels.height, 51);
    CHECK(p.voxels.side * TILE_SIDE * 0.2 >= 52 && (p.voxels.side - 1) * TILE_SIDE * 0.2 < 52);
}

/* forget = auto: for some turns, and never for less than clear_for. */
TEST(what_is_forgotten_when_is_worked_out)
{
    static const struct {
        const char *grid;
        double forget_s, turns, slow_clear_s; /* the last with a head that turns in 100 s */
    } row[] = {{"", 160, 2.5, 150},
               {"clear_for = 200 s\n", 200, 2.5, 200},
               {"clear_for = 20 s\n", 160, 2.5, 20},
               {"forget = 90 s\n", 90, 0, 90}};
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        char text[200];
        struct conf conf;
        struct grid_setting g;
        snprintf(text, sizeof text, SONAR "[grid]\n%s", row[i].grid);
        load(text, &conf);
        wiring_grid(&conf, &conf.grid, &g);
        CHECK_NEAR(g.sphere.forget_s, row[i].forget_s, 1e-12, 0);
        CHECK_NEAR(g.sphere.forget_turns, row[i].turns, 0, 0);
        const double forget_s = sphere_forget_s(&g.sphere, 100);
        CHECK_NEAR(g.limits.clear_for_s > 0 ? g.limits.clear_for_s : answer_clear_for_s(100, forget_s),
                   row[i].slow_clear_s, 1e-12, 0);
    }
}

int main(void)
{
    RUN(every_reason);
    RUN(the_wiring_follows_the_plan);
    RUN(the_numbers_of_a_grid_arrive);
    RUN(the_numbers_of_the_extraction_arrive);
    RUN(the_drift_is_as_the_vehicle_says);
    RUN(the_numbers_of_a_map_arrive);
    RUN(the_largest_plan_fits);
    RUN(more_takes_more);
    RUN(bytes_are_exact);
    RUN(a_map_is_no_smaller_than_asked);
    RUN(what_is_forgotten_when_is_worked_out);
    return test_end();
}
