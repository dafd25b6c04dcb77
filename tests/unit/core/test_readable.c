/* SPDX-License-Identifier: MIT */
/* test_readable - text from outside becomes what JSON, terminals and logs take as it is. */
#include "tests/lib/test.h"

#include <jansson.h>
#include <string.h>

#include "core/fault.h"
#include "core/readable.h"

TEST(what_is_readable_stays_and_the_rest_is_marked)
{
    static const struct {
        const char *text, *want;
    } row[] = {
        {"", ""},
        {"a harbour ~", "a harbour ~"},
        {"Hafen-\xc3\xbc \xe2\x82\xac \xf0\x9f\x90\x9f", "Hafen-\xc3\xbc \xe2\x82\xac \xf0\x9f\x90\x9f"},
        {"a\nsonard: error: leak: water", "a?sonard: error: leak: water"},
        {"\x1b[2J\t\x7f", "?[2J??"},
        {"\xc2\x9b[2J", "??[2J"},          /* a control character of two bytes */
        {"a\xe2\x80\xa8z", "a???z"},       /* the line separator */
        {"Hafen-\xfc.map", "Hafen-?.map"}, /* Latin-1 */
        {"\xff\xfe", "??"},
        {"\xc0\xaf|\xc1\xbf", "??|??"}, /* longer than it must be */
        {"\xe0\x80\xaf|\xf0\x80\x80\xaf", "???|????"},
        {"\xed\xa0\x80|", "???|"},      /* half of a pair of UTF-16 */
        {"\xf4\x90\x80\x80|", "????|"}, /* beyond the last */
        {"a\xbf\xbf", "a??"},
        {"\xe2\x82|", "??|"},
        {"cut \xc3", "cut "},
        {"cut \xe2\x82", "cut "},
        {"cut \xf0\x9f\x90", "cut "},
        {"cut \xe2\xff", "cut ??"},
    };
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        char text[64];
        snprintf(text, sizeof text, "%s", row[i].text);
        readable(text);
        CHECK_STR(text, row[i].want);
    }
}

TEST(any_bytes_become_json)
{
    uint64_t random = test_seed();
    for (int round = 0; round < 200000; round++) {
        char text[24] = {0}, again[24];
        const size_t n = test_random(&random) % sizeof text;
        for (size_t i = 0; i < n; i++) {
            const uint64_t r = test_random(&random);
            text[i] = (char)(r % 3 ? 0x80 | r >> 8 : r >> 8);
        }
        readable(text);
        memcpy(again, text, sizeof again);
        readable(again);
        CHECK_STR(again, text);
        json_t *string = json_string(text);
        CHECK(string != NULL);
        json_decref(string);
        for (const char *c = text; *c; c++)
            CHECK((unsigned char)*c >= 0x20 && *c != 0x7f);
        if (test_case_failed)
            return;
    }
}

TEST(a_fault_that_is_too_long_ends_with_a_whole_character)
{
    static char name[2 * FAULT_TEXT_MAX];
    struct fault fault;
    for (size_t i = 0; i + 2 < sizeof name; i += 2)
        memcpy(name + i, "\xc3\xbc", 2);
    for (int pad = 0; pad < 2; pad++) {
        fault_set(&fault, "%.*s%s", pad, "x", name);
        CHECK_INT(strlen(fault.text), FAULT_TEXT_MAX - 1 - (FAULT_TEXT_MAX - 1 - pad) % 2);
    }
    fault_set(&fault, "x");
    fault_add(&fault, "%s", name);
    CHECK_INT(strlen(fault.text), FAULT_TEXT_MAX - 1);
    fault_set(&fault, "maps/a\nb\xfc.map: damaged");
    CHECK_STR(fault.text, "maps/a?b?.map: damaged");
}

int main(void)
{
    RUN(what_is_readable_stays_and_the_rest_is_marked);
    RUN(any_bytes_become_json);
    RUN(a_fault_that_is_too_long_ends_with_a_whole_character);
    return test_end();
}
