/* SPDX-License-Identifier: MIT */
/* test_fault - sentences of any length: what does not fit is cut, never written behind the end. */
#include "tests/lib/test.h"

#include <string.h>

#include "core/fault.h"

static struct {
    struct fault fault;
    char behind;
} at = {.behind = '!'};

TEST(a_sentence_takes_the_place_of_the_one_before)
{
    CHECK(!fault_set(&at.fault, "port %s: %d of %d", "can0", 3, 4));
    CHECK_STR(at.fault.text, "port can0: 3 of 4");
    CHECK(!fault_set(&at.fault, "gone"));
    CHECK_STR(at.fault.text, "gone");
}

TEST(a_sentence_goes_on)
{
    fault_set(&at.fault, "no such device; there are:");
    CHECK(!fault_add(&at.fault, " %s", "micron"));
    CHECK(!fault_add(&at.fault, " %s", "ping360"));
    CHECK_STR(at.fault.text, "no such device; there are: micron ping360");
}

TEST(what_does_not_fit_is_cut)
{
    CHECK(!fault_set(&at.fault, "%*s", 2 * FAULT_TEXT_MAX, "x"));
    CHECK_INT(strlen(at.fault.text), FAULT_TEXT_MAX - 1);
    CHECK(!fault_add(&at.fault, "more"));
    CHECK_INT(strlen(at.fault.text), FAULT_TEXT_MAX - 1);
    fault_set(&at.fault, "%*s", FAULT_TEXT_MAX - 3, "x");
    fault_add(&at.fault, "abc");
    CHECK_STR(at.fault.text + FAULT_TEXT_MAX - 4, "xab");
    CHECK_INT(at.behind, '!');
}

int main(void)
{
    RUN(a_sentence_takes_the_place_of_the_one_before);
    RUN(a_sentence_goes_on);
    RUN(what_does_not_fit_is_cut);
    return test_end();
}
