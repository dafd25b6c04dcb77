/* SPDX-License-Identifier: MIT */
/* test_template_keep - templates on their way to the disk: who waits for it, who gives up,
 * and what a reload changes. */
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#include <semaphore.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/fault.h"
#include "daemon/background/template_keep.h"
#include "daemon/background/template_file.h"

/* In the place of the C library's: a disk that confirms when it is told to. */
static sem_t asked, confirmed;
static bool slow;

int fsync(int fd)
{
    (void)fd;
    if (slow)
        sem_post(&asked);
    while (slow && sem_wait(&confirmed) != 0) {
    }
    return 0;
}

static struct conf conf;
static struct loop *loop;
static struct worker *worker;
static struct templates templates;
static struct template_keep keep;
static char folder[] = "/tmp/sonard-keep-XXXXXX", path[2][80];

/* One sonar with a template of a few cells. */
static void begin(void)
{
    const struct background_shape shape = {
        .rows = 1, .bins = 4, .dr_m = 0.1f, .row_rad = 1, .law = AMPLITUDE_LINEAR};
    struct fault fault;
    conf = (struct conf){0};
    templates = (struct templates){.env = {.conf = &conf}};
    keep = (struct template_keep){0};
    loop = loop_new(false);
    worker = worker_new(loop, &fault);
    conf.n_sonars = 1;
    snprintf(conf.sonar[0].name, sizeof conf.sonar[0].name, "head");
    snprintf(conf.sonar[0].background, sizeof conf.sonar[0].background, "%s", path[0]);
    templates.of[0].background = background_init(malloc(background_size(&shape)), &shape, 64);
    templates.of[0].made = 1;
    slow = true;
    template_keep_start(&keep, &(struct template_keep_env){
                                   .loop = loop, .worker = worker, .conf = &conf, .templates = &templates});
}

static void end(void)
{
    slow = false;
    template_keep_end(&keep);
    worker_free(worker);
    free(templates.of[0].background);
    loop_free(loop);
    for (int i = 0; i < 2; i++)
        unlink(path[i]);
}

/* Without that nothing of what follows can be tested. */
static void await_question(void)
{
    bool came = false;
    WAIT_UNTIL((came = sem_trywait(&asked) == 0));
    if (!came) {
        printf("FAIL nobody asks the disk to confirm\n");
        exit(1);
    }
}

/* The file, then its folder. */
static void confirm_file(void)
{
    for (int i = 0; i < 2; i++) {
        await_question();
        sem_post(&confirmed);
    }
}

static void turn_until(const bool *done)
{
    TURN_UNTIL(loop, *done);
}

TEST(the_loop_goes_on_until_the_disk_has_confirmed)
{
    struct template_wait saving;
    begin();
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &saving);
    loop_turn(loop, 0);
    CHECK(!saving.done && templates.of[0].in_file == 0);
    confirm_file();
    turn_until(&saving.done);
    CHECK(saving.done && saving.good && templates.of[0].in_file == 1);
    CHECK(access(path[0], F_OK) == 0);
    end();
}

/* What is learnt while a file is written is not in it: who asks then waits for the next. */
TEST(who_asks_meanwhile_gets_the_template_of_then)
{
    struct template_wait first, second;
    begin();
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &first);
    templates.of[0].made = 2;
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &second);
    confirm_file();
    turn_until(&first.done);
    CHECK(first.done && first.good && !second.done && templates.of[0].in_file == 1);
    confirm_file();
    turn_until(&second.done);
    CHECK(second.done && second.good && templates.of[0].in_file == 2);
    end();
}

TEST(who_gives_up_is_forgotten_and_the_file_is_written)
{
    struct template_wait gone, waits;
    begin();
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &gone);
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &waits);
    template_keep_forget(&gone);
    template_keep_forget(&waits);
    memset(&gone, 0xff, sizeof gone);
    memset(&waits, 0xff, sizeof waits);
    confirm_file();
    TURN_UNTIL(loop, !keep.running);
    CHECK(!keep.running && templates.of[0].in_file == 1);
    end();
}

TEST(without_a_template_nothing_is_saved)
{
    struct template_wait first, second;
    begin();
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &first);
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &second);
    struct background *taken = templates.of[0].background;
    templates.of[0].background = NULL; /* another client's doing */
    confirm_file();
    turn_until(&second.done);
    CHECK(first.done && first.good && second.done && !second.good);
    CHECK_STR(second.fault.text, "no template to save");
    templates.of[0].background = taken;
    end();
}

/* A reload copies the whole configuration, whether the key has changed or not. */
TEST(a_file_under_way_keeps_its_name)
{
    struct template_wait saving;
    begin();
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &saving);
    await_question();
    snprintf(conf.sonar[0].background, sizeof conf.sonar[0].background, "%s", path[1]);
    sem_post(&asked);
    confirm_file();
    turn_until(&saving.done);
    CHECK(saving.done && saving.good && access(path[0], F_OK) == 0 && access(path[1], F_OK) != 0);
    end();
}

static void save_now(void)
{
    struct template_wait saving;
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &saving);
    confirm_file();
    turn_until(&saving.done);
    CHECK(saving.good);
}

/* The pipeline has ended by then. */
TEST(what_is_being_read_at_the_end_is_put_nowhere)
{
    struct template_wait loading;
    begin();
    save_now();
    struct background *before = templates.of[0].background;
    template_keep_ask(&keep, 0, TEMPLATE_FROM_FILE, &loading);
    template_keep_forget(&loading);
    CHECK(keep.running);
    end();
    CHECK(templates.of[0].background == before);
}

/* Each in its turn: what was saved is what is loaded. */
TEST(a_load_waits_for_the_save_before_it)
{
    struct template_wait saving, loading;
    begin();
    template_keep_ask(&keep, 0, TEMPLATE_TO_FILE, &saving);
    template_keep_ask(&keep, 0, TEMPLATE_FROM_FILE, &loading);
    confirm_file();
    turn_until(&saving.done);
    CHECK(saving.done && saving.good && !loading.done);
    template_keep_forget(&loading);
    end();
}

TEST(a_load_of_no_file_says_so)
{
    struct template_wait loading;
    begin();
    template_keep_ask(&keep, 0, TEMPLATE_FROM_FILE, &loading);
    turn_until(&loading.done);
    CHECK(loading.done && !loading.good && strstr(loading.fault.text, path[0]));
    CHECK(templates.of[0].background != NULL);
    end();
}

int main(void)
{
    CHECK(mkdtemp(folder) != NULL);
    for (int i = 0; i < 2; i++)
        snprintf(path[i], sizeof path[i], "%s/%d.bg", folder, i);
    RUN(the_loop_goes_on_until_the_disk_has_confirmed);
    RUN(who_asks_meanwhile_gets_the_template_of_then);
    RUN(who_gives_up_is_forgotten_and_the_file_is_written);
    RUN(without_a_template_nothing_is_saved);
    RUN(a_file_under_way_keeps_its_name);
    RUN(what_is_being_read_at_the_end_is_put_nowhere);
    RUN(a_load_waits_for_the_save_before_it);
    RUN(a_load_of_no_file_says_so);
    CHECK_INT(rmdir(folder), 0);
    return test_end();
}
