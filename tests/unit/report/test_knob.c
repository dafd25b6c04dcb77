/* SPDX-License-Identifier: MIT */
/* test_knob - rows of the report are called what they ran. */
#include "tests/lib/test.h"

#include <sys/wait.h>
#include <unistd.h>

#include "report/lib/knob.h"

static const char *configuration(const struct knob *knob)
{
    static char text[KNOB_TEXT_MAX];
    knob_configuration(knob, text);
    return text;
}

static const char *value(const struct knob *knob)
{
    static char text[KNOB_TEXT_MAX];
    knob_value(knob, text);
    return text;
}

static void test_a_row_without_a_value_has_the_shipped_one(void)
{
    const struct knob row = KNOB_KEY("extract", "no_echo", NULL);
    CHECK_STR(value(&row), "heard");
    CHECK_STR(configuration(&row), "[extract] no_echo = heard");
    CHECK(knob_is_default(&row));
}

static void test_a_row_has_its_own_value(void)
{
    const struct knob row = KNOB_KEY("extract", "no_echo", "minimum");
    struct conf conf;
    CHECK_STR(value(&row), "minimum");
    CHECK_STR(configuration(&row), "[extract] no_echo = minimum");
    CHECK(!knob_is_default(&row));
    knob_conf(&row, &conf);
    CHECK_INT(conf.extract.no_echo, CONF_NO_ECHO_MINIMUM);
}

static void test_what_else_is_set_is_told(void)
{
    const struct knob target = {
        .name = "target", .section = "extract", .value = "12 dB", .more = "[extract]\nbottom = off\n"};
    const struct knob sonar = KNOB_KEY("sonar", "ring_down", "0.5 m");
    const struct knob naive = {.name = "fixed_threshold", .label = "60 counts", .beside = "fixed threshold"};
    CHECK_STR(value(&target), "net");
    CHECK_STR(configuration(&target), "[extract] target = net; [extract] bottom = off");
    CHECK_STR(configuration(&sonar), "[sonar] ring_down = 0.5 m");
    CHECK_STR(value(&naive), "60 counts");
    CHECK_STR(configuration(&naive), "fixed threshold");
    CHECK(!knob_is_default(&naive));
}

/* What becomes of a program with these rows: its exit status. */
static int checked(const struct knob *knob, size_t n)
{
    int status = 0;
    const pid_t child = fork();
    if (child == 0) {
        fclose(stderr);
        knob_check(knob, n);
        _exit(0);
    }
    CHECK(child > 0 && waitpid(child, &status, 0) == child);
    return WEXITSTATUS(status);
}

static void test_two_rows_that_run_the_same_end_the_program(void)
{
    const struct knob right[] = {KNOB_KEY("extract", "no_echo", NULL), KNOB_KEY("extract", "no_echo", "minimum"),
                                 KNOB_KEY("extract", "target", NULL)};
    const struct knob same[] = {KNOB_KEY("extract", "no_echo", NULL), KNOB_KEY("extract", "no_echo", "heard")};
    const struct knob unlike[] = {{.name = "cleanup", .label = "none"}, {.name = "cleanup", .label = "all"}};
    const struct knob no_key[] = {KNOB_KEY("extract", "no_such_key", NULL)};
    CHECK_INT(checked(right, 3), 0);
    CHECK_INT(checked(same, 2), 1);
    CHECK_INT(checked(unlike, 2), 1);
    CHECK_INT(checked(no_key, 1), 1);
}

int main(void)
{
    RUN(a_row_without_a_value_has_the_shipped_one);
    RUN(a_row_has_its_own_value);
    RUN(what_else_is_set_is_told);
    RUN(two_rows_that_run_the_same_end_the_program);
    return test_end();
}
