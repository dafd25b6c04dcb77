/* SPDX-License-Identifier: MIT */
/*
 * test_template - what is asked about a template without memory is refused, whichever allocation fails, and leaves
 * all as it was. The Makefile has this program's allocations come here first.
 */
#include "../lib/test.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "../../daemon/daemon.h"
#include "../../daemon/pipeline_state.h"
#include "../../daemon/template_file.h"
#include "../lib/plain_ping.h"

#define PINGS 3

void *__real_malloc(size_t size);
void *__real_calloc(size_t n, size_t size);
void *__wrap_malloc(size_t size);
void *__wrap_calloc(size_t n, size_t size);

static int until_none = -1; /* allocations that there is memory for; below 0: for all */

static bool there_is_memory(void)
{
    if (until_none < 0 || until_none-- > 0)
        return true;
    until_none = 0;
    errno = ENOMEM;
    return false;
}

void *__wrap_malloc(size_t size)
{
    return there_is_memory() ? __real_malloc(size) : NULL;
}

void *__wrap_calloc(size_t n, size_t size)
{
    return there_is_memory() ? __real_calloc(n, size) : NULL;
}

static struct daemon d;
static struct template *const t = &d.template[0];
static char path[] = "/tmp/sonard-template-XXXXXX";

static float bin_m = 0.1f;

static void feed(void)
{
    struct ping *ping = plain_ping(d.pipeline);
    ping->dr_m = bin_m;
    template_ping(&d, 0, ping);
    pipeline_submit(d.pipeline, ping);
}

static bool learn(char *err, size_t size)
{
    return template_learn(&d, 0, &(struct background_learn_conf){.pings = PINGS, .standing = true}, err, size);
}

static bool use(char *err, size_t size)
{
    return template_stop(&d, 0, true, err, size);
}

static bool give_up(char *err, size_t size)
{
    return template_stop(&d, 0, false, err, size);
}

static bool load(char *err, size_t size)
{
    enum template_fault fault;
    struct background *b = template_load(path, 64, &fault, err, size);
    return b && template_put(&d, 0, b, path, err, size);
}

static bool clear(char *err, size_t size)
{
    return template_clear(&d, 0, err, size);
}

static void begin(void)
{
    struct pipeline_conf c = {.queue = 4,
                              .max_beams = 1,
                              .max_samples = 100,
                              .max_bins = 100,
                              .n_sensors = 1,
                              .mount = {mount_identity},
                              .grid.sphere = {.angular_step_rad = geo_rad(10),
                                              .layers = {.r_max_m = 30, .dr_m = 0.5, .n_const = 29, .growth = 1.035},
                                              .max_cells = 1000,
                                              .forget_s = 160,
                                              .blocked_above = 0.6,
                                              .recentre_m = 0.1}};
    char err[200] = "";
    extract_defaults(&c.extract[0]);
    d = (struct daemon){.pipeline = pipeline_new(&c, err, sizeof err)};
    d.conf.n_sonars = 1;
    snprintf(d.conf.sonar[0].name, sizeof d.conf.sonar[0].name, "head");
    snprintf(d.conf.sonar[0].device, sizeof d.conf.sonar[0].device, "ping360");
    d.conf.background = (struct conf_background){.mask = 64, .min_points = 1, .neighbour_m = 1};
    template_start(&d);
    snprintf(d.conf.sonar[0].background, sizeof d.conf.sonar[0].background, "%s", path);
    feed();
}

static void end(void)
{
    pipeline_errands_end(d.pipeline);
    pipeline_free(d.pipeline);
    template_end(&d);
}

/* With memory for no allocation, for one, for two ...: refused for that, until it is done. */
static void refused_until_there_is_memory(bool (*ask)(char *err, size_t size))
{
    int refusals = 0;
    for (;; refusals++) {
        const struct template before = *t;
        const struct pipeline_background in_force = d.pipeline->background[0];
        char err[300] = "";
        until_none = refusals;
        const bool done = ask(err, sizeof err);
        until_none = -1;
        if (done)
            break;
        CHECK(strstr(err, "memory") != NULL);
        CHECK(t->background == before.background && t->view == before.view && t->learn == before.learn);
        CHECK(t->made == before.made && t->pings == before.pings && t->learning.pings == before.learning.pings);
        CHECK_STR(t->happened, before.happened);
        CHECK(memcmp(&d.pipeline->background[0], &in_force, sizeof in_force) == 0);
        feed();
        if (test_case_failed)
            return;
    }
    CHECK(refusals > 0);
    CHECK(d.pipeline->background[0].use == t->background && d.pipeline->background[0].learn == t->learn);
    CHECK(d.pipeline->background[0].view.level == t->view);
}

TEST(without_memory_nothing_changes)
{
    begin();
    refused_until_there_is_memory(learn);
    CHECK(t->learn && !t->background);
    for (int i = 0; i < PINGS; i++)
        feed();
    refused_until_there_is_memory(learn); /* another one, anew */
    CHECK_INT(t->pings, 0);
    for (int i = 0; i < PINGS; i++)
        feed();
    refused_until_there_is_memory(use);
    CHECK(t->background && !t->learn);
    CHECK_INT(t->made, 1);
    refused_until_there_is_memory(learn);
    refused_until_there_is_memory(give_up);
    CHECK(t->background && !t->learn);
    char err[300] = "";
    size_t size;
    uint8_t *bytes = template_encode(t->background, &size);
    unlink(path);
    CHECK(template_write(bytes, size, path, err, sizeof err));
    free(bytes);
    refused_until_there_is_memory(load);
    CHECK_INT(t->made, 2);
    refused_until_there_is_memory(clear);
    CHECK(!t->background && !t->view);
    end();
}

TEST(learning_goes_on_until_there_is_memory_for_the_template)
{
    begin();
    char err[300] = "";
    CHECK(learn(err, sizeof err));
    while (!strstr(t->happened, "out of memory")) {
        until_none = 0;
        feed();
        until_none = -1;
        CHECK(t->pings < 1000);
        if (test_case_failed)
            break;
    }
    CHECK(t->learn && !t->background);
    while (t->learn && t->pings < 1000)
        feed();
    CHECK(t->background && !t->learn);
    end();
}

static uint64_t taken(void)
{
    struct background_progress p;
    template_progress(&d, 0, &p);
    return p.taken;
}

/* The numbers are the learner's that learns now, not those of the one before. */
TEST(learning_begun_anew_has_not_come_far)
{
    char err[300];
    begin();
    CHECK(learn(err, sizeof err));
    CHECK_INT(taken(), 0);
    feed();
    feed();
    CHECK_INT(taken(), 2);
    CHECK(learn(err, sizeof err));
    CHECK_INT(taken(), 0);
    feed();
    CHECK_INT(taken(), 1);
    end();
}

/* A first ping of the range before, or another range meanwhile: learning goes on with the pings that come, or it would not end. */
TEST(learning_follows_another_range)
{
    char err[300];
    begin();
    bin_m = 0.2f;
    feed();
    CHECK(learn(err, sizeof err));
    bin_m = 0.1f;
    for (int i = 0; i < 63; i++)
        feed();
    bin_m = 0.2f; /* one that fits: they are not in a row */
    feed();
    CHECK_INT(taken(), 1);
    bin_m = 0.1f;
    for (int i = 0; i < 300 && t->learn; i++)
        feed();
    CHECK(t->background && !t->learn);
    CHECK(t->background && t->background->shape.dr_m == 0.1f);
    end();
}

int main(void)
{
    int fd = mkstemp(path);
    if (fd < 0)
        return 1;
    close(fd);
    RUN(without_memory_nothing_changes);
    RUN(learning_begun_anew_has_not_come_far);
    RUN(learning_follows_another_range);
    RUN(learning_goes_on_until_there_is_memory_for_the_template);
    unlink(path);
    return test_end();
}
