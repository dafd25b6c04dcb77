/* SPDX-License-Identifier: MIT */
/*
 * test_template - what is asked about a template without memory is refused, whichever allocation fails, and leaves
 * all as it was. The Makefile has this program's allocations come here first.
 */
#include "tests/lib/test.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/fault.h"
#include "daemon/background/template.h"
#include "daemon/pipeline/pipeline_state.h"
#include "daemon/background/template_file.h"
#include "tests/lib/plain_ping.h"

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

static const bool replay_ended = false;
static struct conf conf;
static struct mount mount = {.attitude = {1, 0, 0, 0}};
static struct pipeline *pipeline;
static struct templates templates;
static struct template *const t = &templates.of[0];
static char path[] = "/tmp/sonard-template-XXXXXX";

static float bin_m = 0.1f;

static void feed(void)
{
    struct ping *ping = plain_ping(pipeline);
    ping->dr_m = bin_m;
    template_ping(&templates, 0, ping);
    pipeline_submit(pipeline, ping);
}

static bool learn(struct fault *fault)
{
    return template_learn(&templates, 0, &(struct background_learn_conf){.pings = PINGS, .standing = true}, fault);
}

static bool use(struct fault *fault)
{
    return template_stop(&templates, 0, true, fault);
}

static bool give_up(struct fault *fault)
{
    return template_stop(&templates, 0, false, fault);
}

static bool load(struct fault *fault)
{
    enum template_fault kind;
    struct background *b = template_load(path, 64, &kind, fault);
    return b && template_put(&templates, 0, b, path, fault);
}

static bool clear(struct fault *fault)
{
    return template_clear(&templates, 0, fault);
}

static void begin(void)
{
    const struct pipeline_conf c = plain_pipeline(0);
    struct fault fault = {""};
    pipeline = pipeline_new(&c, &fault);
    conf = (struct conf){0};
    templates = (struct templates){0};
    conf.n_sonars = 1;
    snprintf(conf.sonar[0].name, sizeof conf.sonar[0].name, "head");
    snprintf(conf.sonar[0].device, sizeof conf.sonar[0].device, "ping360");
    conf.background = (struct conf_background){.mask = 64, .min_points = 1, .neighbour_m = 1};
    template_start(&templates,
                   &(struct template_env){
                       .conf = &conf, .mount = &mount, .pipeline = pipeline, .replay_ended = &replay_ended});
    snprintf(conf.sonar[0].background, sizeof conf.sonar[0].background, "%s", path);
    feed();
}

static void end(void)
{
    owner_jobs_end(pipeline);
    pipeline_free(pipeline);
    template_end(&templates);
}

/* With memory for no allocation, for one, for two ...: refused for that, until it is done. */
static void refused_until_there_is_memory(bool (*ask)(struct fault *fault))
{
    int refusals = 0;
    for (;; refusals++) {
        const struct template before = *t;
        const struct pipeline_background in_force = pipeline->background[0];
        struct fault fault = {""};
        until_none = refusals;
        const bool done = ask(&fault);
        until_none = -1;
        if (done)
            break;
        CHECK(strstr(fault.text, "memory") != NULL);
        CHECK(t->background == before.background && t->view == before.view && t->learn == before.learn);
        CHECK(t->made == before.made && t->pings == before.pings && t->learning.pings == before.learning.pings);
        CHECK_STR(t->happened, before.happened);
        CHECK(memcmp(&pipeline->background[0], &in_force, sizeof in_force) == 0);
        feed();
        if (test_case_failed)
            return;
    }
    CHECK(refusals > 0);
    CHECK(pipeline->background[0].use == t->background && pipeline->background[0].learn == t->learn);
    CHECK(pipeline->background[0].view.level == t->view);
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
    struct fault fault = {""};
    size_t size;
    uint8_t *bytes = template_encode(t->background, &size);
    unlink(path);
    CHECK(template_write(bytes, size, path, &fault));
    free(bytes);
    refused_until_there_is_memory(load);
    CHECK_INT(t->made, 2);
    refused_until_there_is_memory(clear);
    CHECK(!t->background && !t->view);
    end();
}

/* Is the template of these rows taken back from its file? */
static bool is_read_back(const struct background *b)
{
    struct fault fault;
    enum template_fault kind;
    size_t size;
    uint8_t *bytes = template_encode(b, &size);
    struct background *read = template_decode(bytes, size, 64, &kind, &fault);
    CHECK(read || kind == TEMPLATE_DAMAGED);
    const bool good = read != NULL;
    free(bytes);
    free(read);
    return good;
}

TEST(a_file_with_levels_of_a_row_that_was_not_learnt_is_damaged)
{
    struct fault fault;
    begin();
    CHECK(learn(&fault));
    for (int i = 0; i < PINGS; i++)
        feed();
    CHECK(use(&fault));
    struct background *b = t->background;
    const uint32_t last = b->shape.rows - 1;
    uint8_t *level = b->level + (size_t)last * b->shape.bins;
    memset(level, 0, b->shape.bins);
    b->learnt[last] = 0;
    CHECK(is_read_back(b));
    level[b->shape.bins - 1] = 1;
    CHECK(!is_read_back(b));
    b->learnt[last] = BACKGROUND_LEARNT_MAX;
    CHECK(is_read_back(b));
    b->learnt[last] = BACKGROUND_LEARNT_MAX + 1;
    CHECK(!is_read_back(b));
    b->learnt[last] = 1;
    end();
}

TEST(learning_goes_on_until_there_is_memory_for_the_template)
{
    begin();
    struct fault fault = {""};
    CHECK(learn(&fault));
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
    template_progress(&templates, 0, &p);
    return p.taken;
}

/* The numbers are the learner's that learns now, not those of the one before. */
TEST(learning_begun_anew_has_not_come_far)
{
    struct fault fault;
    begin();
    CHECK(learn(&fault));
    CHECK_INT(taken(), 0);
    feed();
    feed();
    CHECK_INT(taken(), 2);
    CHECK(learn(&fault));
    CHECK_INT(taken(), 0);
    feed();
    CHECK_INT(taken(), 1);
    end();
}

/* A first ping of the range before, or another range meanwhile:
 * learning goes on with the pings that come, or it would not end. */
TEST(learning_follows_another_range)
{
    struct fault fault;
    begin();
    bin_m = 0.2f;
    feed();
    CHECK(learn(&fault));
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
    RUN(a_file_with_levels_of_a_row_that_was_not_learnt_is_damaged);
    RUN(learning_begun_anew_has_not_come_far);
    RUN(learning_follows_another_range);
    RUN(learning_goes_on_until_there_is_memory_for_the_template);
    unlink(path);
    return test_end();
}
