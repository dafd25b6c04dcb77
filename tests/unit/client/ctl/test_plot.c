/* SPDX-License-Identifier: MIT */
/*
 * test_plot - the picture is well-formed XML whatever the daemon says, shows every beam, echo and sector that it was
 * given, and stays small.
 */
#include "client/ctl/plot.h"
#include "client/ctl/polar.h"

#include <ctype.h>

#include "tests/lib/test.h"

static char *draw(json_t *image, json_t *sectors, const char *title, double range_m)
{
    const struct plot_conf conf = {.title = title, .range_m = range_m};
    char *svg = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&svg, &size);
    CHECK(plot_svg(out, image, sectors, &conf));
    fclose(out);
    return svg;
}

/* Tags in balance, attributes quoted, no stray < or &, no control characters. Enough XML for what plot writes. */
static bool well_formed(const char *s)
{
    const char *open[32];
    size_t length[32], depth = 0, roots = 0;
    while (*s) {
        if (*s == '&') {
            const char *end = strchr(s, ';');
            if (!end || end - s > 6)
                return false;
            s = end + 1;
        } else if (strncmp(s, "<?", 2) == 0) {
            s = strstr(s, "?>") + 2;
        } else if (*s == '<') {
            const bool closing = s[1] == '/';
            const char *name = s + 1 + closing;
            size_t n = 0;
            while (isalnum((unsigned char)name[n]))
                n++;
            if (n == 0)
                return false;
            s = name + n;
            while (*s && *s != '>' && !(s[0] == '/' && s[1] == '>')) {
                if (*s == '"') {
                    s = strchr(s + 1, '"');
                    if (!s)
                        return false;
                } else if (*s == '<') {
                    return false;
                }
                s++;
            }
            if (!*s)
                return false;
            if (closing) {
                if (depth == 0 || length[depth - 1] != n || strncmp(open[depth - 1], name, n) != 0)
                    return false;
                depth--;
            } else if (*s != '/') {
                roots += depth == 0;
                if (depth == 32)
                    return false;
                open[depth] = name;
                length[depth++] = n;
            }
            s += *s == '/' ? 2 : 1;
        } else {
            if ((unsigned char)*s < 0x20 && *s != '\n')
                return false;
            s++;
        }
    }
    return depth == 0 && roots == 1;
}

static size_t occurrences(const char *text, const char *what)
{
    size_t n = 0;
    for (const char *at = strstr(text, what); at; at = strstr(at + 1, what))
        n++;
    return n;
}

static json_t *row(double azimuth_deg, double r1_m, const char *samples, double echo_m)
{
    return json_pack("{s:f, s:f, s:f, s:f, s:s, s:o, s:s}", "azimuth_deg", azimuth_deg, "width_deg", 2.0, "r0_m",
                     0.0, "r1_m", r1_m, "samples", samples, "echo_m", echo_m > 0 ? json_real(echo_m) : json_null(),
                     "state", echo_m > 0 ? "echo" : "silent");
}

static json_t *image_of(const char *sensor, json_t *rows)
{
    return json_pack("{s:s, s:f, s:o}", "sensor", sensor, "t_unix", 1710345016.5, "rows", rows);
}

TEST(the_checker_finds_what_is_not_xml)
{
    CHECK(well_formed("<a><b x=\"1\"/>&lt;</a>"));
    CHECK(!well_formed("<a><b></a></b>"));
    CHECK(!well_formed("<a>"));
    CHECK(!well_formed("<a x=\"1></a>"));
    CHECK(!well_formed("<a>1 < 2</a>"));
    CHECK(!well_formed("<a>this & that</a>"));
    CHECK(!well_formed("<a></a><a></a>"));
    CHECK(!well_formed("<a>\033</a>"));
}

TEST(beams_echoes_and_sectors_are_drawn)
{
    json_t *rows = json_array();
    for (int i = 0; i < 10; i++)
        json_array_append_new(rows, row(0.9 * i, 10, "00ff0080", i % 2 ? 7.5 : 0));
    json_t *image = image_of("front", rows);
    json_t *sectors = json_pack("{s:s, s:[{s:f, s:f, s:s, s:f}, {s:f, s:f, s:s}, {s:f, s:f, s:s}]}", "frame",
                                "body", "sectors", "azimuth_deg", 0.0, "width_deg", 120.0, "state", "blocked",
                                "range_m", 7.5, "azimuth_deg", 120.0, "width_deg", 120.0, "state", "clear",
                                "azimuth_deg", 240.0, "width_deg", 120.0, "state", "unknown");
    char *svg = draw(image, sectors, NULL, 0);

    CHECK(well_formed(svg));
    CHECK_INT(occurrences(svg, "r=\"14\""), 5);         /* echoes */
    CHECK_INT(occurrences(svg, "fill=\"#d8501f\""), 2); /* one sector, one legend */
    CHECK_INT(occurrences(svg, "fill=\"#0a5ea8\""), 2);
    CHECK_INT(occurrences(svg, "fill=\"url(#unknown)\""), 2);
    CHECK(strstr(svg, "sonar front"));
    CHECK(strstr(svg, "2024-03-13 15:50:16 UTC"));
    CHECK(strstr(svg, "rim at 10 m"));
    CHECK(strstr(svg, ">5 m<") || strstr(svg, ">4 m<"));
    free(svg);
    json_decref(image);
    json_decref(sectors);
}

/* A vehicle that heads east has north to port; there, and at no bearing's place without a heading. */
TEST(north_is_marked_where_the_heading_is_known)
{
    const double heading_deg = 90;
    struct plot_conf conf = {.heading_deg = &heading_deg};
    char *svg = NULL;
    size_t size = 0;
    FILE *out = open_memstream(&svg, &size);
    CHECK(plot_svg(out, NULL, NULL, &conf));
    fclose(out);
    CHECK(well_formed(svg));
    CHECK(strstr(svg, "heading 090°, N is north"));
    CHECK(strstr(svg, "<text class=\"north\" x=\"-3780\" y=\"60\">N</text>"));
    CHECK(!strstr(svg, ">270°<") && strstr(svg, ">090°<"));
    free(svg);
    svg = draw(NULL, NULL, NULL, 0);
    CHECK(!strstr(svg, ">N<") && !strstr(svg, "heading") && strstr(svg, ">270°<"));
    free(svg);
}

/* Echoes along the usual spoke: the labels go to the next one. */
TEST(ranges_are_not_written_over_echoes)
{
    json_t *image = image_of("front", json_pack("[o]", row(60, 10, "00", 4)));
    char *with = draw(image, NULL, NULL, 0), *without = draw(NULL, NULL, NULL, 10);
    CHECK(strstr(without, "<text x=\"1143\" y=\"-615\">4 m</text>"));
    CHECK(strstr(with, "<text x=\"1320\" y=\"45\">4 m</text>"));
    free(with);
    free(without);
    json_decref(image);
}

TEST(an_echo_stands_where_it_was_heard)
{
    json_t *image = image_of("front", json_pack("[o]", row(90, 10, "00", 5)));
    char *svg = draw(image, NULL, NULL, 0);
    CHECK(strstr(svg, "<circle cx=\"1650\" cy=\"0\" r=\"14\"/>")); /* starboard, half of 3300 tenths */
    free(svg);
    json_decref(image);
}

TEST(names_cannot_break_the_picture)
{
    json_t *image = image_of("a<b>&\"c'\n\x7f", json_array());
    char *svg = draw(image, NULL, NULL, 0);
    CHECK(well_formed(svg));
    CHECK(strstr(svg, "a&lt;b&gt;&amp;&quot;c'??"));
    free(svg);
    svg = draw(image, NULL, "</svg>", 0);
    CHECK(well_formed(svg));
    free(svg);
    json_decref(image);
}

TEST(nothing_and_nonsense_are_drawn_as_nothing)
{
    static const char *const images[] = {
        "null",
        "[]",
        "{}",
        "{\"rows\":7,\"sensor\":3,\"t_unix\":\"x\"}",
        "{\"rows\":[null,1,{},[],{\"azimuth_deg\":\"x\"}]}",
        "{\"rows\":[{\"azimuth_deg\":1e300}]}",
        "{\"rows\":[{\"azimuth_deg\":1,\"samples\":\"zz!\",\"r0_m\":0,\"r1_m\":1}]}",
        "{\"rows\":[{\"azimuth_deg\":1,\"samples\":\"ffff\",\"r0_m\":5,\"r1_m\":1}]}",
        "{\"rows\":[{\"azimuth_deg\":1,\"samples\":\"ffff\",\"r0_m\":0,\"r1_m\":1e-300}]}",
        "{\"rows\":[{\"azimuth_deg\":1,\"samples\":\"ffff\",\"r0_m\":-3,\"r1_m\":1e300,\"echo_m\":1e9}],\"t_"
        "unix\":1e300}",
        "{\"rows\":[{\"azimuth_deg\":0,\"samples\":\"ff\",\"r0_m\":0,\"r1_m\":1,\"width_deg\":1e9,\"echo_m\":-1}]"
        "}",
    };
    static const char *const sectors[] = {
        "null",
        "{\"sectors\":{}}",
        "{\"sectors\":[1,{},{\"azimuth_deg\":0,\"width_deg\":360,\"state\":\"</g>\"}]}",
        "{\"sectors\":[{\"azimuth_deg\":0,\"width_deg\":1e-9,\"state\":7}]}",
        "{\"sectors\":[{\"azimuth_deg\":-1e9,\"width_deg\":5,\"free_to_m\":1e-320}]}",
    };
    for (size_t i = 0; i < sizeof images / sizeof *images; i++) {
        for (size_t k = 0; k < sizeof sectors / sizeof *sectors; k++) {
            json_t *image = json_loads(images[i], JSON_DECODE_ANY, NULL);
            json_t *list = json_loads(sectors[k], JSON_DECODE_ANY, NULL);
            char *svg = draw(image, list, NULL, 0);
            CHECK(image && list && well_formed(svg));
            CHECK(!strstr(svg, "nan") && !strstr(svg, "inf"));
            free(svg);
            json_decref(image);
            json_decref(list);
        }
    }
}

TEST(a_turn_of_noise_stays_small)
{
    uint64_t seed = test_seed();
    json_t *rows = json_array();
    char samples[1025];
    for (int i = 0; i < 400; i++) {
        for (int k = 0; k < 1024; k++)
            samples[k] = "0123456789abcdef"[test_random(&seed) % 16];
        samples[1024] = '\0';
        json_array_append_new(rows, row(0.9 * i, 20, samples, 0));
    }
    json_t *image = image_of("front", rows);
    char *svg = draw(image, NULL, NULL, 0);

    CHECK(strlen(svg) < 1500000);
    CHECK(strlen(svg) > 100000);
    free(svg);
    json_decref(image);
}

/* Whatever is done to the resolution, the loudest sample stays loudest and in its place. */
TEST(the_loudest_sample_survives_resampling)
{
    uint64_t seed = test_seed();
    for (int round = 0; round < 200; round++) {
        const size_t n = test_random(&seed) % 700 + 1, at = test_random(&seed) % n;
        const double r1_m = 1 + 49 * test_uniform(&seed);
        char samples[1401];
        struct polar polar;
        for (size_t i = 0; i < n; i++)
            memcpy(samples + 2 * i, i == at ? "ff" : "10", 2);
        samples[2 * n] = '\0';
        json_t *image = image_of("x", json_pack("[o]", row(10, r1_m, samples, 0)));

        CHECK(polar_read(&polar, image, NULL, 0));
        CHECK_NEAR(polar.range_m, r1_m, 1e-12, 0);

        const int cell = (int)(((double)at + 0.5) / (double)n * POLAR_CELLS);

        CHECK_INT(polar.beam[0].cell[cell], POLAR_LEVELS);
        polar_free(&polar);
        json_decref(image);
    }
}

TEST(beams_reach_to_the_middle_between_neighbours_and_no_further)
{
    json_t *image =
        image_of("x", json_pack("[o,o,o]", row(359.5, 1, "ff", 0), row(0.5, 1, "ff", 0), row(100, 1, "ff", 0)));
    struct polar polar;

    CHECK(polar_read(&polar, image, NULL, 0));
    CHECK_NEAR(polar.beam[0].lo_deg, 0.0, 0, 1e-9); /* 0.5, neighbour 359.5 across north */
    CHECK_NEAR(polar.beam[0].hi_deg, 1.5, 0, 1e-9); /* its own width */
    CHECK_NEAR(polar.beam[2].hi_deg, 360.0, 0, 1e-9);
    polar_free(&polar);
    json_decref(image);
}

int main(void)
{
    RUN(the_checker_finds_what_is_not_xml);
    RUN(beams_echoes_and_sectors_are_drawn);
    RUN(north_is_marked_where_the_heading_is_known);
    RUN(ranges_are_not_written_over_echoes);
    RUN(an_echo_stands_where_it_was_heard);
    RUN(names_cannot_break_the_picture);
    RUN(nothing_and_nonsense_are_drawn_as_nothing);
    RUN(a_turn_of_noise_stays_small);
    RUN(the_loudest_sample_survives_resampling);
    RUN(beams_reach_to_the_middle_between_neighbours_and_no_further);
    return test_end();
}
