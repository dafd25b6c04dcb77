/* SPDX-License-Identifier: MIT */
/*
 * test_plan - what a configuration needs is in, what it does not need is out, for the reason and with the proof that the
 * plan gives; the wiring follows the plan; what is left out as identical changes no echo; costs go the right way.
 */
#include "../lib/test.h"

#include "../../config/conf_source.h"
#include "../../daemon/plan_cost.h"
#include "../../daemon/settings.h"
#include "../../daemon/wiring.h"

#define SONAR "[sonar a]\ndevice = ping360\nport = serial:/dev/x:115200\n"

/* As the option --socket none makes it of SONAR. */
#define NO_SOCKET SONAR "\n"

static void fault(void *ctx, const char *message)
{
    (void)ctx;
    printf("%s\n", message);
    test_case_failed = true;
}

static void load(const char *text, struct conf *conf)
{
    struct conf_source *source;
    conf_load_text(conf, &source, "test", text, strlen(text), &settings_checks, fault, NULL);
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
    {"no map, no pager", SONAR, PLAN_PAGER, PLAN_IDENTICAL, "no map"},
    {"a map without files", SONAR "[map]\nvoxel = 0.2 m\n", PLAN_PAGER, PLAN_BOUNDED, "directory"},
    {"steered", SONAR "scan = active\n", PLAN_ATTENTION, PLAN_NONE, "active"},
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
    CHECK_INT(plan.n, CONF_MAX_SONARS * 6 + (CONF_MAX_GRIDS + 1) * 4 + 7);
}

static struct plan_cost price(const char *text)
{
    struct conf conf;
    struct plan plan;
    struct plan_cost cost[PLAN_STAGES_MAX], all;
    load(text, &conf);
    plan_make(&conf, &plan);
    plan_price(&plan, &conf, cost, &all);
    for (int k = 0; k < plan.n; k++)
        CHECK((cost[k].instructions >= 0 || cost[k].instructions == -1) && cost[k].instructions < 1e12);
    return all;
}

TEST(more_costs_more)
{
    static const struct {
        const char *less, *more;
        bool bytes; /* too */
    } pairs[] = {{SONAR "[grid]\nangular_step = 4 deg\n", SONAR "[grid]\nangular_step = 1 deg\n", true},
                 {SONAR "[grid]\nelevation = level\n", SONAR, true},
                 {SONAR, SONAR "[grid]\nrelaxation = 0.5\n", true},
                 {NO_SOCKET, SONAR, true},
                 {SONAR, SONAR "[extract]\ndetector = os\n", false},
                 {SONAR, SONAR "[extract]\nclasses = on\n", true},
                 {SONAR "[extract]\nclasses = on\n", SONAR "[extract]\nclasses = on\nmedian = 5\n", true},
                 {SONAR, SONAR "[map]\nvoxel = 0.2 m\n", true},
                 {SONAR "[map]\nvoxel = 0.2 m\n", SONAR "[map]\nvoxel = 0.1 m\n", false},
                 {SONAR, SONAR "[grid]\nsensor_model = midpoint\n", false},
                 {SONAR "[grid]\nsensor_model = midpoint\n", SONAR "[grid]\nsensor_model = gauss\n", false}};
    for (size_t i = 0; i < sizeof pairs / sizeof pairs[0]; i++) {
        const struct plan_cost less = price(pairs[i].less), more = price(pairs[i].more);
        const bool good = less.instructions < more.instructions &&
                          (pairs[i].bytes ? less.bytes < more.bytes : less.bytes == more.bytes);
        if (!good)
            printf("pair %zu: %g < %g, %g < %g\n", i, less.instructions, more.instructions, less.bytes,
                   more.bytes);
        CHECK(good);
    }
}

/* Bytes are those that are taken. */
TEST(bytes_are_exact)
{
    struct conf conf;
    struct plan plan;
    struct pipeline_conf p;
    struct plan_cost cost[PLAN_STAGES_MAX], all;
    char err[160];
    load(SONAR "[extract]\nclasses = on\nmedian = 5\n[grid]\nrelaxation = 1\n", &conf);
    plan_make(&conf, &plan);
    plan_price(&plan, &conf, cost, &all);
    wiring_pipeline(&conf, &plan, true, &p);
    double grid = 0;
    for (int k = 0; k < plan.n; k++) {
        if (plan.stage[k].id == PLAN_CLEANUP)
            CHECK_NEAR(cost[k].bytes, cleanup_size(&p.cleanup[0], p.max_bins), 0, 0);
        if (plan.stage[k].in && plan.stage[k].id >= PLAN_GRID && plan.stage[k].id <= PLAN_RELAXATION)
            grid += cost[k].bytes;
    }
    CHECK_NEAR(grid, sphere_bytes(&p.grid.sphere, err, sizeof err), 0, 0);
}

int main(void)
{
    RUN(every_reason);
    RUN(the_wiring_follows_the_plan);
    RUN(the_largest_plan_fits);
    RUN(more_costs_more);
    RUN(bytes_are_exact);
    return test_end();
}
