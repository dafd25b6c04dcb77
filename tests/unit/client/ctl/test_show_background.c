/* SPDX-License-Identifier: MIT */
/* test_show_background - a template in words and as a drawing: what is blind, what is open, and what nobody learnt. */
#include "client/ctl/show_background.h"
#include "tests/lib/test.h"

static char *text;
static size_t size;

static FILE *begin(void)
{
    free(text);
    text = NULL;
    return open_memstream(&text, &size);
}

/* Three directions of 20 degrees: ahead blind from 0.5 to 2 m, to starboard open, astern blind all the way to 5 m; to
 * port nobody looked. */
#define PICTURE                                                                                                   \
    "{\"rows\":[{\"azimuth_deg\":0,\"width_deg\":20,\"r0_m\":0,\"r1_m\":5,\"samples\":\"00ff\",\"blind\":[[0.5,"  \
    "2]]},"                                                                                                       \
    "{\"azimuth_deg\":90,\"width_deg\":20,\"r0_m\":0,\"r1_m\":5,\"samples\":\"0000\",\"blind\":[]},"              \
    "{\"azimuth_deg\":180,\"width_deg\":20,\"r0_m\":0,\"r1_m\":5,\"samples\":\"ffff\",\"blind\":[[0,5]]},"        \
    "{\"azimuth_deg\":\"x\",\"width_deg\":20,\"blind\":[[0,9]]}]}"

/* In the drawing, at so many metres ahead and to starboard: 31 lines are 12 m, and 62 columns. */
static char at(double ahead_m, double right_m)
{
    const int line = (int)lround(15 - ahead_m * 31 / 12), column = (int)lround(30 + right_m * 62 / 12);
    return text[line * 62 + column];
}

TEST(the_drawing_shows_each_direction)
{
    json_t *result = json_loads(PICTURE, 0, NULL);
    FILE *out = begin();
    CHECK(result != NULL);
    show_background_draw(out, result);
    fclose(out);
    CHECK(size > 31 * 62 && strstr(text, "forward is up, the rim is 6.00 m; # blind, . open, blank not learnt\n"));
    CHECK(at(0, 0) == '+');
    CHECK(at(1.2, 0) == '#' && at(3.5, 0) == '.' && at(5.5, 0) == '.');
    CHECK(at(0, 1.2) == '.' && at(0, 4) == '.');
    CHECK(at(-1.2, 0) == '#' && at(-4.5, 0) == '#' && at(-5.6, 0) == '.');
    CHECK(at(0, -3) == ' ' && at(3, 3) == ' ' && at(-3, -3) == ' ');
    json_decref(result);
}

TEST(without_a_template_nothing_is_drawn)
{
    json_t *result = json_loads("{\"rows\":[]}", 0, NULL);
    FILE *out = begin();
    show_background_draw(out, result);
    fclose(out);
    CHECK_STR(text, "no template is in force: nothing to draw\n");
    json_decref(result);
}

TEST(the_picture_reaches_beyond_what_is_blind)
{
    json_t *result = json_loads(PICTURE, 0, NULL);
    FILE *out = begin();
    CHECK(show_background_svg(out, result));
    fclose(out);
    CHECK(strstr(text, "the vehicle's own echoes"));
    CHECK(strstr(text, "6 m") && strstr(text, "</svg>"));
    json_decref(result);
}

#define STATE                                                                                                     \
    "{\"sensor\":\"head\",\"state\":\"in force\",\"file\":\"/x\\u001b.bg\",\"template\":{\"rows\":400,"           \
    "\"rows_learnt\":380,\"bins\":500,\"r0_m\":0,\"r1_m\":10,\"mask\":40,\"blind_cells\":77,\"fits\":\"yes\","    \
    "\"saved\":%s},\"learning\":%s,\"happened\":\"%s\"}"
#define LEARNING                                                                                                  \
    "{\"pings\":3,\"progress\":0.25,\"rows_seen\":200,\"rows_full\":50,\"motion\":\"pings are taken\"}"

static const char *state(const char *saved, const char *learning, const char *happened)
{
    char given[1000];
    snprintf(given, sizeof given, STATE, saved, learning, happened);

    json_t *result = json_loads(given, 0, NULL);
    FILE *out = begin();
    CHECK(result != NULL);
    show_background_state(out, result);
    fclose(out);
    json_decref(result);
    return text;
}

TEST(the_state_in_words)
{
    CHECK_STR(state("true", "null", ""), "sonar      head\n"
                                         "state      in force\n"
                                         "file       /x?.bg\n"
                                         "template   380 of 400 rows, 500 bins to 10.00 m, saved\n"
                                         "blind      77 cells above 40 counts\n"
                                         "fits       yes\n"
                                         "happened   nothing yet\n");
    state("false", LEARNING, "learnt");
    CHECK(strstr(text, "500 bins to 10.00 m, not saved\n"));
    CHECK(strstr(text, "learning    25 %: 50 of 200 rows have their 3 pings; pings are taken\n"));
    CHECK(strstr(text, "happened   learnt\n"));
}

int main(void)
{
    RUN(the_drawing_shows_each_direction);
    RUN(without_a_template_nothing_is_drawn);
    RUN(the_picture_reaches_beyond_what_is_blind);
    RUN(the_state_in_words);
    free(text);
    return test_end();
}
