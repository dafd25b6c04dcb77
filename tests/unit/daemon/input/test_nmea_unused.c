/* SPDX-License-Identifier: MIT */
/* test_nmea_unused - sentences in, the reason why none of them is used out. */
#include "daemon/input/nmea_unused.h"

#include "tests/lib/test.h"

/* `times` the line, through a parser that wants checksums. */
static struct nmea_parser hear(const char *line, int times)
{
    struct nmea_parser p;
    nmea_parser_init(&p, true);
    for (int i = 0; i < times; i++) {
        const uint8_t *bytes = (const uint8_t *)line;
        size_t n = strlen(line);
        struct nmea_value v;
        CHECK(!nmea_parser_next(&p, &bytes, &n, &v));
    }
    return p;
}

TEST(the_reason_is_what_the_sentences_lack)
{
    static const struct {
        const char *line, *text;
    } cases[] = {
        {"", ""},
        {"$GPHDT,274.07,T\r\n", "40 sentences, none used: 40 without checksum (set checksum = optional)"},
        {"$GPHDT,274.07,T*04\r\n",
         "40 sentences, none used: 40 with a wrong checksum (check baud rate and wiring)"},
        {"$GPHDT,,T*1B\r\n", "40 sentences, none used: 40 with empty fields or marked as not valid"},
        {"$HETHS,99.5,V*0F\r\n", "40 sentences, none used: 40 with empty fields or marked as not valid"},
        {"$GPHDT,999,T*22\r\n", "40 sentences, none used: 40 with senseless values"},
        {"$GPZDA,,,,,,*48\r\n", "40 sentences, none used: 40 of other kinds (the last is GPZDA)"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const struct nmea_parser p = hear(cases[i].line, 40);
        const struct nmea_came before = {0}, now = {.counts = p.counts};
        struct fault text;
        nmea_unused_text(&before, &now, CONF_NMEA_HEADING, p.other, &text);
        CHECK_STR(text.text, cases[i].text);
    }
}

TEST(what_the_configuration_leaves_out_is_named)
{
    const struct nmea_came before = {.no_variation = 5, .excluded = 3};
    struct fault text;
    nmea_unused_text(&before, &(struct nmea_came){.no_variation = 7, .excluded = 3}, CONF_NMEA_HEADING, "", &text);
    CHECK_STR(text.text, "2 sentences, none used: 2 with a magnetic heading (set variation)");
    nmea_unused_text(&before, &(struct nmea_came){.no_variation = 5, .excluded = 4}, CONF_NMEA_HEADING, "", &text);
    CHECK_STR(text.text, "1 sentence, none used: 1 with a depth (left out by use = heading)");
    nmea_unused_text(&before, &(struct nmea_came){.no_variation = 6, .excluded = 4}, CONF_NMEA_DEPTH, "", &text);
    CHECK_STR(text.text, "2 sentences, none used: 1 with a heading (left out by use = depth), "
                         "1 with a magnetic heading (set variation)");
}

int main(void)
{
    RUN(the_reason_is_what_the_sentences_lack);
    RUN(what_the_configuration_leaves_out_is_named);
    return test_end();
}
