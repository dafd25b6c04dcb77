/* SPDX-License-Identifier: MIT */
/*
 * test_conf_live - of a configuration that is read anew only what a running daemon can change takes the place of what
 * was, and every difference is told; a grid takes single keys by their names.
 */
#include "config/conf.h"

#include "core/fault.h"
#include "tests/lib/test.h"

#define HEAD "[sonar a]\ndevice = ping360\nport = serial:/dev/x:115200\n"

static char told[2000];

static void tell(void *ctx, const char *message)
{
    (void)ctx;
    snprintf(told + strlen(told), sizeof told - strlen(told), "%s\n", message);
}

static void tell_change(void *ctx, const char *section, const char *text, bool live)
{
    char line[600];
    CHECK(strstr(text, section) != NULL);
    snprintf(line, sizeof line, "%s%s", live ? "" : "not ", text);
    tell(ctx, line);
}

static void read_text(const char *text, struct conf *conf, struct conf_source **source)
{
    CHECK_INT(conf_load_text(conf, source, &(struct conf_text){"a.conf", text, strlen(text)}, NULL, tell, NULL),
              0);
}

/* What comes of a text that takes another's place, and what is told of it. */
static const char *take(const char *before, const char *after, struct conf *now)
{
    struct conf wanted;
    struct conf_source *sources[2];
    told[0] = '\0';
    read_text(before, now, &sources[0]);
    read_text(after, &wanted, &sources[1]);
    conf_take_live(now, &wanted, NULL, tell_change, NULL);
    conf_source_free(sources[0]);
    conf_source_free(sources[1]);
    return told;
}

TEST(live_keys_are_taken_and_others_are_named)
{
    struct conf now;
    CHECK_STR(take(HEAD, HEAD, &now), "");
    CHECK_STR(take(HEAD "[grid]\nclear_for = 20 s\n", HEAD "[grid]\nclear_for = 11 s\n", &now),
              "[grid] clear_for = 11 s\n");
    CHECK(now.grid.clear_for_s == 11);
    CHECK_STR(take(HEAD "range = 5 m\n", HEAD "range = 6 m\n[log]\nlevel = debug\n", &now),
              "not [sonar a] range = 6 m\n[log] level = debug\n");
    CHECK(now.sonar[0].range_m == 5);
}

static bool retunes_b(const struct conf *conf, int sonar, const char *key)
{
    return strcmp(conf->sonar[sonar].name, "b") == 0 && strcmp(key, "mode") != 0;
}

/* What a head is told is live where its device can be told, key by key. */
TEST(a_head_takes_what_its_device_can)
{
    static const struct conf_checks checks = {.retunes = retunes_b};
    const char *two = "[sonar %s]\ndevice = ping360\nport = serial:/dev/%s:115200\n%s";
    struct conf now, wanted;
    struct conf_source *source;
    char text[2][1000];
    for (int i = 0; i < 2; i++) {
        const char *keys = i ? "range = 6 m\ngain = 2\nmode = request\n" : "range = 5 m\n";
        int n = snprintf(text[i], sizeof text[i], two, "a", "a", keys);
        snprintf(text[i] + n, sizeof text[i] - (size_t)n, two, "b", "b", keys);
        read_text(text[i], i ? &wanted : &now, &source);
        conf_source_free(source);
    }
    told[0] = '\0';
    conf_take_live(&now, &wanted, &checks, tell_change, NULL);
    CHECK_STR(told,
              "not [sonar a] range = 6 m\n[sonar b] range = 6 m\nnot [sonar a] gain = 2\n[sonar b] gain = 2\n"
              "not [sonar a] mode = request\nnot [sonar b] mode = request\n");
    CHECK(now.sonar[0].range_m == 5 && now.sonar[0].gain < 0);
    CHECK(now.sonar[1].range_m == 6 && now.sonar[1].gain == 2 && now.sonar[1].mode == CONF_MODE_AUTO);
}

TEST(every_grid_has_its_own)
{
    struct conf now;
    CHECK_STR(take(HEAD "[grid far]\nrange = 100 m\n", HEAD "[grid far]\nrange = 90 m\nclear_for = 9 s\n", &now),
              "not [grid far] range = 90 m\n[grid far] clear_for = 9 s\n");
    CHECK(now.more_grid[0].clear_for_s == 9 && now.more_grid[0].range_max_m == 100 && now.grid.clear_for_s != 9);
}

TEST(other_sonars_or_grids_are_for_a_restart)
{
    struct conf now;
    CHECK_STR(take(HEAD, "[sonar b]\ndevice = ping360\nport = serial:/dev/x:115200\nrange = 9 m\n", &now),
              "not other sections [sonar NAME]\n");
    CHECK_STR(now.sonar[0].name, "a");
    CHECK_STR(take(HEAD, HEAD "[sonar b]\ndevice = ping360\nport = serial:/dev/y:115200\n", &now),
              "not other sections [sonar NAME]\n");
    CHECK_INT(now.n_sonars, 1);
    CHECK_STR(take(HEAD "[grid far]\nclear_for = 8 s\n", HEAD "[grid wide]\nclear_for = 9 s\n", &now),
              "not other sections [grid NAME]\n");
    CHECK_STR(take(HEAD "[grid far]\nclear_for = 8 s\n", HEAD, &now), "not other sections [grid NAME]\n");
    CHECK(now.n_more_grids == 1 && now.more_grid[0].clear_for_s == 8);
}

/* Each text is good by itself; of the two clear_for is live and forget is not. */
TEST(what_comes_of_both_must_go_together)
{
    struct conf now, wanted;
    struct conf_source *sources[2];
    read_text(HEAD "[grid]\nclear_for = 20 s\nforget = 60 s\n", &now, &sources[0]);
    read_text(HEAD "[grid]\nclear_for = 90 s\nforget = 300 s\n", &wanted, &sources[1]);
    CHECK_INT(conf_check_together(&wanted, sources[1], NULL, tell, NULL), 0);
    conf_take_live(&now, &wanted, NULL, tell_change, NULL);
    told[0] = '\0';
    CHECK_INT(conf_check_together(&now, sources[1], NULL, tell, NULL), 1);
    CHECK(strstr(told, "a.conf:") && strstr(told, "forget = 60 s") && strstr(told, "clear_for = 90 s"));
    conf_source_free(sources[0]);
    conf_source_free(sources[1]);
}

int main(void)
{
    RUN(live_keys_are_taken_and_others_are_named);
    RUN(a_head_takes_what_its_device_can);
    RUN(every_grid_has_its_own);
    RUN(other_sonars_or_grids_are_for_a_restart);
    RUN(what_comes_of_both_must_go_together);
    return test_end();
}
