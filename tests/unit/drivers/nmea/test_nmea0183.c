/* SPDX-License-Identifier: MIT */
/* test_nmea0183 - sentences of the data sheets give their values; broken, foreign and empty ones give none. */
#include "drivers/nmea/nmea0183.h"

#include "grid/geometry.h"
#include "tests/lib/test.h"

static struct nmea_parser parser;

static int feed(const void *bytes, size_t n, struct nmea_value *values, int most)
{
    const uint8_t *b = bytes;
    int found = 0;
    struct nmea_value v;
    while (nmea_parser_next(&parser, &b, &n, &v))
        if (found++ < most)
            values[found - 1] = v;
    return found;
}

static const struct {
    const char *name, *line;
    unsigned has;
    double value; /* metres or degrees */
} sentences[] = {
    {"DPT, offset 0", "$INDPT,2.3,0.0*46", NMEA_DEPTH, 2.3},
    {"DPT, offset to the water line", "$SDDPT,7.25,0.50,100.0*51", NMEA_DEPTH, 7.75},
    {"DPT, offset to the keel", "$SDDPT,7.25,-0.50", NMEA_DEPTH, 7.25},
    {"DPT, no offset", "$SDDPT,7.25,", NMEA_DEPTH, 7.25},
    {"DPT, one field", "$SDDPT,7.25", NMEA_DEPTH, 7.25},
    {"DBT", "$SDDBT,7.8,f,2.4,M,1.3,F*0D", NMEA_DEPTH, 2.4},
    {"DBT, metres alone", "$SDDBT,,f,2.4,M,,F", NMEA_DEPTH, 2.4},
    {"HDT", "$GPHDT,274.07,T*03", NMEA_TRUE, 274.07},
    {"DPT, malformed offset", "$SDDPT,24.6,-1.-1,*4B", NMEA_DEPTH, 24.6},
    {"DBT, feet alone", "$SDDBT,10.0,f,,M,,F", NMEA_DEPTH, 3.048},
    {"DBT, fathoms alone", "$SDDBT,,f,,M,2.0,F", NMEA_DEPTH, 3.6576},
    {"THS", "$GNTHS,123.4,A*2D", NMEA_TRUE, 123.4},
    {"THS, estimated", "$GNTHS,123.4,E", NMEA_TRUE, 123.4},
    {"HDT, negative", "$GPHDT,-45.0,T", NMEA_TRUE, 315},
    {"a blank behind the checksum", "$GPHDT,274.07,T*03 ", NMEA_TRUE, 274.07},
    {"HDT, 360 is 0", "$GPHDT,360.0,T", NMEA_TRUE, 0},
    {"HDM", "$HCHDM,10.0,M", NMEA_MAGNETIC, 10},
    {"HDG with variation west", "$HCHDG,98.3,0.0,E,12.6,W*57", NMEA_TRUE, 85.7},
    {"HDG with both", "$HCHDG,98.3,1.5,W,12.6,E", NMEA_TRUE, 109.4},
    {"HDG across north", "$HCHDG,355.0,,,10.0,E", NMEA_TRUE, 5},
    {"HDG without variation", "$HCHDG,98.3,2.0,E,,", NMEA_MAGNETIC, 100.3},
    {"HDG short", "$HCHDG,98.3", NMEA_MAGNETIC, 98.3},
    {"small letters in the checksum", "$SDDBT,7.8,f,2.4,M,1.3,F*0d", NMEA_DEPTH, 2.4},
};

TEST(good_sentences)
{
    for (size_t i = 0; i < sizeof sentences / sizeof sentences[0]; i++) {
        char line[160];
        struct nmea_value v = {0};
        nmea_parser_init(&parser, false);
        int n = snprintf(line, sizeof line, "%s\r\n", sentences[i].line);
        int found = feed(line, (size_t)n, &v, 1);
        double got = v.has == NMEA_DEPTH ? v.depth_m : geo_deg(v.heading_rad);
        if (found != 1 || v.has != sentences[i].has || !(fabs(got - sentences[i].value) < 1e-9)) {
            printf("%s: %d values, has %u, %.9g, expected %.9g\n", sentences[i].name, found, v.has, got,
                   sentences[i].value);
            test_case_failed = true;
        }
    }
}

#define COUNT(field) offsetof(struct nmea_counts, field)

static const struct {
    const char *name, *line;
    bool required;
    size_t count; /* the counter that must be 1 */
} refused[] = {
    {"wrong checksum", "$GPHDT,274.07,T*04\r\n", false, COUNT(bad_checksum)},
    {"checksum of one digit", "$GPHDT,274.07,T*3\r\n", false, COUNT(bad_checksum)},
    {"checksum of three digits", "$GPHDT,274.07,T*031\r\n", false, COUNT(bad_checksum)},
    {"checksum that is none", "$GPHDT,274.07,T*-1\r\n", false, COUNT(bad_checksum)},
    {"checksum missing", "$GPHDT,274.07,T\r\n", true, COUNT(bad_checksum)},
    {"empty heading", "$GPHDT,,T\r\n", false, COUNT(not_available)},
    {"feet that are metres", "$SDDBT,7.8,M,,M,1.3,F\r\n", false, COUNT(bad_sentence)},
    {"THS, not valid", "$GNTHS,123.4,V\r\n", false, COUNT(not_available)},
    {"THS, simulator", "$GNTHS,123.4,S\r\n", false, COUNT(not_available)},
    {"THS without mode", "$GNTHS,123.4,\r\n", false, COUNT(not_available)},
    {"THS with another mode", "$GNTHS,123.4,X\r\n", false, COUNT(bad_sentence)},
    {"blanks and no checksum", "$GPHDT,274.07,T*  \r\n", false, COUNT(bad_checksum)},
    {"heading of the wrong kind", "$GPHDT,10.0,M\r\n", false, COUNT(bad_sentence)},
    {"heading beyond the circle", "$GPHDT,361.0,T\r\n", false, COUNT(bad_sentence)},
    {"negative heading", "$GPHDT,-181.0,T\r\n", false, COUNT(bad_sentence)},
    {"metres that are feet", "$SDDBT,7.8,f,2.4,f,1.3,F\r\n", false, COUNT(bad_sentence)},
    {"depth that is no number", "$SDDPT,7.2x,0\r\n", false, COUNT(bad_sentence)},
    {"nan", "$SDDPT,nan,0\r\n", false, COUNT(bad_sentence)},
    {"exponent", "$SDDPT,1e3,0\r\n", false, COUNT(bad_sentence)},
    {"a sign alone", "$SDDPT,-,0\r\n", false, COUNT(bad_sentence)},
    {"depth beyond the oceans", "$SDDPT,99999.0,0\r\n", false, COUNT(bad_sentence)},
    {"variation without a side", "$HCHDG,98.3,,,12.6,\r\n", false, COUNT(bad_sentence)},
    {"another sentence", "$GPGGA,1,2,3\r\n", false, COUNT(other)},
    {"proprietary", "$PDHDT,10.0,T\r\n", false, COUNT(other)},
    {"a longer name", "$XXHDTX,10.0,T\r\n", false, COUNT(other)},
    {"just a dollar", "$\r\n", false, COUNT(garbage_bytes)},
};

TEST(refused_sentences)
{
    for (size_t i = 0; i < sizeof refused / sizeof refused[0]; i++) {
        struct nmea_value v;
        nmea_parser_init(&parser, refused[i].required);
        int found = feed(refused[i].line, strlen(refused[i].line), &v, 1);
        uint64_t count = *(const uint64_t *)((const char *)&parser.counts + refused[i].count);
        if (found != 0 || count != 1) {
            printf("%s: %d values, counter %d\n", refused[i].name, found, (int)count);
            test_case_failed = true;
        }
    }
}

/* Displays and sounders without a bottom send these. */
TEST(a_depth_that_is_not_available_is_told)
{
    static const char *const lines[] = {"$SDDPT,,0.5\r\n", "$SDDPT\r\n", "$SDDBT,,f,,M,,F\r\n"};
    for (size_t i = 0; i < sizeof lines / sizeof *lines; i++) {
        struct nmea_value v;
        nmea_parser_init(&parser, false);
        CHECK_INT(feed(lines[i], strlen(lines[i]), &v, 1), 1);
        CHECK_INT(v.has, NMEA_NO_DEPTH);
        CHECK_INT(parser.counts.not_available, 1);
        CHECK_INT(parser.counts.values, 0);
    }
}

TEST(what_was_measured_is_kept_beside_the_offset)
{
    static const struct {
        const char *line, *name;
        double below_m, offset_m;
    } cases[] = {{"$SDDPT,7.25,0.50,100.0*51\r\n", "SDDPT", 7.25, 0.5},
                 {"$IIDPT,7.25,-0.50\r\n", "IIDPT", 7.25, -0.5},
                 {"$SDDPT,24.6,-1.-1,*4B\r\n", "SDDPT", 24.6, 0},
                 {"$SDDBT,7.8,f,2.4,M,1.3,F*0D\r\n", "SDDBT", 2.4, 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct nmea_value v = {0};
        nmea_parser_init(&parser, false);
        CHECK_INT(feed(cases[i].line, strlen(cases[i].line), &v, 1), 1);
        CHECK_NEAR(v.below_m, cases[i].below_m, 1e-9, 0);
        CHECK_NEAR(v.offset_m, cases[i].offset_m, 1e-9, 0);
        CHECK_STR(v.name, cases[i].name);
    }
}

TEST(odd_values_are_counted)
{
    static const char text[] = "$SDDPT,24.6,-1.-1,*4B\r\n$GPHDT,-45.0,T\r\n$SDDPT,7.25,0.5\r\n";
    struct nmea_value v[3];
    nmea_parser_init(&parser, false);
    CHECK_INT(feed(text, sizeof text - 1, v, 3), 3);
    CHECK_INT(parser.counts.odd, 2);
}

/* A sentence without its checksum, with it. */
static size_t sum_up(char *out, size_t room, char start, const char *body)
{
    unsigned sum = 0;
    for (const char *c = body; *c; c++)
        sum ^= (unsigned char)*c;
    return (size_t)snprintf(out, room, "%c%s*%02X", start, body, sum);
}

/* What else comes over the line of a boat. */
static const struct {
    const char *name, *line;
    unsigned sentences, bad_checksum;
} beside[] = {
    {"AIS", "!AIVDM,1,1,,A,13aGua?P00PHfERNFruh0?vN289E,0*36", 1, 0},
    {"AIS, damaged", "!AIVDM,1,1,,A,13aGua?P00PHfERNFruh0?vN289E,0*37", 0, 1},
    {"own ship", "!AIVDO,1,1,,,x,0*1D", 1, 0},
    {"encapsulated, without checksum", "!BSVDM,1,1,,A,x,0", 1, 0},
    {"an encapsulated sentence named like a depth", "!SDDPT,7.25,0.50,100.0*51", 1, 0},
    {"a tag block and AIS", "\\s:r003669945,c:1241544035*79\\!AIVDM,1,1,,A,x,0*5E", 1, 0},
    {"a tag block, damaged", "\\s:r003669945,c:1241544035*78\\!AIVDM,1,1,,A,x,0*5E", 1, 1},
    {"two tag blocks", "\\g:1-2-3*6D\\\\s:r1*0A\\$GPGGA,1,2,3*4A", 1, 0},
    {"a tag block alone", "\\s:r003669945,c:1241544035*79\\", 0, 0},
    {"a proprietary sentence", "$PASHR,1,2,3*44", 1, 0},
    {"a proprietary sentence without checksum", "$PFEC,GPatt,1,2", 1, 0},
    {"a proprietary sentence with the other starts in it", "$PTXT,a!b\\c*39", 1, 0},
    {"a query", "$CCGPQ,GGA*2B", 1, 0},
    {"a sentence with more fields than are kept", "$GPXXX,,,,,,,,,,,,,,,,,,,,,,,,,,,,,,*4F", 1, 0},
};

TEST(what_comes_beside_is_no_garbage)
{
    for (size_t i = 0; i < sizeof beside / sizeof *beside; i++) {
        struct nmea_value v;
        char text[200];
        const int n = snprintf(text, sizeof text, "%s\r\n$GPHDT,274.07,T*03\r\n", beside[i].line);
        nmea_parser_init(&parser, true);
        if (feed(text, (size_t)n, &v, 1) != 1 || parser.counts.garbage_bytes != 0 ||
            parser.counts.sentences != beside[i].sentences + 1u ||
            parser.counts.bad_checksum != beside[i].bad_checksum || parser.counts.no_checksum != 0) {
            printf("%s: %d garbage bytes, %d sentences, %d bad checksums\n", beside[i].name,
                   (int)parser.counts.garbage_bytes, (int)parser.counts.sentences,
                   (int)parser.counts.bad_checksum);
            test_case_failed = true;
        }
    }
}

TEST(a_value_behind_a_tag_block_is_taken)
{
    static const char text[] = "UdPbC\0\\s:SD0001,n:23*26\\$SDDPT,7.25,0.50,100.0*51\r\n"
                               "UdPbC\0\\s:SD0001,n:24*00\\$SDDPT,7.25,0.50,100.0*51\r\n";
    struct nmea_value v[2];
    nmea_parser_init(&parser, true);
    CHECK_INT(feed(text, sizeof text - 1, v, 2), 2);
    CHECK_NEAR(v[0].below_m, 7.25, 1e-9, 0);
    CHECK_NEAR(v[1].below_m, 7.25, 1e-9, 0);
    CHECK_INT(parser.counts.bad_checksum, 1);
    CHECK_INT(parser.counts.garbage_bytes, 0);
}

/* A list of satellites in view, of several hundred bytes. */
TEST(a_long_sentence_of_no_interest_is_one)
{
    char body[900] = "PUBX,03,40", text[1000];
    struct nmea_value v;
    for (int i = 0; i < 40; i++)
        strcat(body, ",23,-,,,45,010");
    const size_t n = sum_up(text, sizeof text - 2, '$', body);
    memcpy(text + n, "\r\n", 2);
    nmea_parser_init(&parser, true);
    CHECK_INT(feed(text, n + 2, &v, 1), 0);
    CHECK_INT(parser.counts.other, 1);
    CHECK_INT(parser.counts.garbage_bytes + parser.counts.overlong, 0);
}

/* What starts like traffic and is none. */
TEST(what_is_cut_off_or_no_text_is_garbage)
{
    static const struct {
        const char *text;
        unsigned n, garbage;
    } cases[] = {{"\\s:r1*3\r\n", 9, 7}, {"\\s:r\x01", 5, 5},   {"!AIV\xff", 5, 5},     {"UdPbD$GPHDT", 11, 5},
                 {"UUdPbC\0", 7, 1},     {"!AIV$GPHDT", 10, 4}, {"\\s:r$GPHDT", 10, 4}, {"UdPbC$GPHDT", 11, 5},
                 {"$ ls -l\r\n", 9, 7},  {"!~\n", 3, 2},        {"$Gp,1\n", 6, 5},      {"$\n", 2, 1},
                 {"$*00\r\n", 6, 4},     {"$,1*1D\n", 7, 6}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct nmea_value v;
        nmea_parser_init(&parser, true);
        feed(cases[i].text, cases[i].n, &v, 1);
        CHECK_INT(parser.counts.garbage_bytes, cases[i].garbage);
    }
}

TEST(an_overlong_line_costs_itself_only)
{
    char text[NMEA_LINE_MAX + 400];
    struct nmea_value v;
    memset(text, 'x', sizeof text);
    memcpy(text, "$GPHDT,", 7);
    memcpy(text + NMEA_LINE_MAX + 300, "\r\n$GPHDT,274.07,T*03\r\n", 23);
    nmea_parser_init(&parser, true);
    CHECK_INT(feed(text, NMEA_LINE_MAX + 322, &v, 1), 1);
    CHECK_INT(parser.counts.overlong, 1);
    CHECK_INT(parser.counts.garbage_bytes, NMEA_LINE_MAX + 300);
}

/* Each is the start of a line that never ends: a port that brings nothing else has the wrong baud rate. */
TEST(starts_without_an_end_are_garbage)
{
    char text[4 * (NMEA_LINE_MAX + 2)];
    struct nmea_value v;
    for (const char *start = "!\\"; *start; start++) {
        memset(text, *start == '!' ? '!' : 'x', sizeof text);
        for (size_t i = 0; i < sizeof text; i += NMEA_LINE_MAX + 2)
            text[i] = *start;
        nmea_parser_init(&parser, true);
        CHECK_INT(feed(text, sizeof text, &v, 1), 0);
        CHECK_INT(parser.counts.overlong, 4);
        CHECK_INT(parser.counts.garbage_bytes, sizeof text);
    }
}

TEST(a_line_of_just_the_limit_is_read)
{
    char text[NMEA_LINE_MAX + 72];
    struct nmea_value v;
    int n = snprintf(text, sizeof text, "$GPHDT,10.0,T,");
    memset(text + n, 'x', (size_t)(NMEA_LINE_MAX + 1 - n));
    memcpy(text + NMEA_LINE_MAX + 1, "\n", 2);
    nmea_parser_init(&parser, false);
    CHECK_INT(feed(text, NMEA_LINE_MAX + 2, &v, 1), 1);
    CHECK_INT(parser.counts.overlong, 0);
}

TEST(a_sentence_cut_off_by_the_next_is_dropped)
{
    static const char text[] = "$GPHDT,27$GPHDT,274.07,T*03\r\n";
    struct nmea_value v;
    nmea_parser_init(&parser, true);
    CHECK_INT(feed(text, sizeof text - 1, &v, 1), 1);
    CHECK_NEAR(geo_deg(v.heading_rad), 274.07, 1e-12, 0);
    CHECK_INT(parser.counts.garbage_bytes, 9);
}

TEST(a_reset_forgets_the_half_sentence)
{
    struct nmea_value v;
    nmea_parser_init(&parser, false);
    CHECK_INT(feed("$GPHDT,1", 8, &v, 1), 0);
    nmea_parser_reset(&parser);
    CHECK_INT(feed("0.0,T\r\n", 7, &v, 1), 0);
}

/* Sentences between noise, in any split: all values, in order. */
TEST(any_split_gives_the_same)
{
    uint64_t seed = test_seed();
    for (int round = 0; round < 200; round++) {
        char text[4096];
        size_t n = 0;
        int sent = 0;
        while (n < 3000) {
            for (uint64_t k = test_random(&seed) % 9; k > 0; k--)
                text[n++] = (char)(1 + test_random(&seed) % 35); /* below $ */
            n += (size_t)snprintf(text + n, sizeof text - n, "\n$GPHDT,%d.0,T\r\n", sent++ % 360);
        }
        nmea_parser_init(&parser, false);
        int found = 0;
        for (size_t at = 0; at < n;) {
            struct nmea_value v[256];
            size_t part = 1 + test_random(&seed) % 40;
            part = part < n - at ? part : n - at;
            int k = feed(text + at, part, v, 256);
            for (int i = 0; i < k; i++, found++)
                CHECK_NEAR(geo_deg(v[i].heading_rad), found % 360, 1e-9, 1e-9);
            at += part;
        }
        CHECK_INT(found, sent);
        if (test_case_failed)
            return;
    }
}

int main(void)
{
    RUN(good_sentences);
    RUN(refused_sentences);
    RUN(a_depth_that_is_not_available_is_told);
    RUN(what_was_measured_is_kept_beside_the_offset);
    RUN(odd_values_are_counted);
    RUN(what_comes_beside_is_no_garbage);
    RUN(a_value_behind_a_tag_block_is_taken);
    RUN(a_long_sentence_of_no_interest_is_one);
    RUN(what_is_cut_off_or_no_text_is_garbage);
    RUN(an_overlong_line_costs_itself_only);
    RUN(starts_without_an_end_are_garbage);
    RUN(a_line_of_just_the_limit_is_read);
    RUN(a_sentence_cut_off_by_the_next_is_dropped);
    RUN(a_reset_forgets_the_half_sentence);
    RUN(any_split_gives_the_same);
    return test_end();
}
