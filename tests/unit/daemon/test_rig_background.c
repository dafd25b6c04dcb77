/* SPDX-License-Identifier: MIT */
/* test_rig_background - a bar of the vehicle's own frame is learnt and masked; what lies behind it is unknown. */
#include "tests/lib/rig.h"

#include "daemon/background/template_file.h"

/* The bar: 20 degrees wide, 0.8 m away at 200 degrees; a pile of 0.4 m ahead to the right, at 5.9 m. */
#define BAR_DEG 200
#define PILE    "cylinder 6 2 0.4\n"
#define COLUMN  "cylinder -4.7 -1.7 1\n"
#define SHORT   "[grid]\nclear_for = 60 s\nforget = 60 s\n"

static void begin(const char *conf)
{
    rig_start(PILE COLUMN, conf);
    rig.sim.frame = (struct sim_frame){.azimuth_deg = BAR_DEG, .width_deg = 20, .range_m = 0.8};
}

/* A text of the result of a method; the next call ends it. */
static const char *text_of(const char *method, const char *params, const char *list, const char *name)
{
    static char text[200];
    json_t *result = rig_ask(method, "%s", params);
    const char *value = json_string_value(json_object_get(list ? json_object_get(result, list) : result, name));
    snprintf(text, sizeof text, "%s", value ? value : "none");
    json_decref(result);
    return text;
}

static double number_of(const char *list, const char *name)
{
    json_t *result = rig_ask("background", "%s", "");
    const json_t *value = json_object_get(json_object_get(result, list), name);
    const double n = json_is_number(value) ? json_number_value(value) : NAN;
    json_decref(result);
    return n;
}

static const char *state_at(int azimuth_deg, double distance_m)
{
    char params[100];
    snprintf(params, sizeof params, "\"azimuth_deg\":%d,\"distance_m\":%g,\"half_angle_deg\":1", azimuth_deg,
             distance_m);
    return text_of("blocked", params, NULL, "state");
}

static const char *reason_at(int azimuth_deg, double distance_m)
{
    char params[100];
    snprintf(params, sizeof params, "\"azimuth_deg\":%d,\"distance_m\":%g,\"half_angle_deg\":1", azimuth_deg,
             distance_m);
    return text_of("blocked", params, NULL, "reason");
}

static const char *background_state(void)
{
    return text_of("background", "", NULL, "state");
}

/* Is there a blind stretch over r_m in this row? */
static bool is_blind(const json_t *row, double r_m)
{
    bool blind = false;
    json_t *stretch;
    size_t i;
    json_array_foreach(json_object_get(row, "blind"), i, stretch) blind |=
        json_number_value(json_array_get(stretch, 0)) <= r_m &&
        json_number_value(json_array_get(stretch, 1)) >= r_m;
    return blind;
}

/* Blind from the bar on and behind it; in all other rows not there. */
static void check_picture(void)
{
    json_t *result = rig_ask("background", "%s", "\"picture\":\"yes\""), *row;
    unsigned blind = 0;
    size_t i;
    CHECK_INT(json_array_size(json_object_get(result, "rows")), 400);
    json_array_foreach(json_object_get(result, "rows"), i, row)
    {
        const double azimuth_deg = json_number_value(json_object_get(row, "azimuth_deg"));
        const double off_deg = fabs(remainder(azimuth_deg - BAR_DEG, 360));
        const char *samples = json_string_value(json_object_get(row, "samples"));
        CHECK_INT(json_integer_value(json_object_get(row, "pings")), 3);
        CHECK_NEAR(json_number_value(json_object_get(row, "width_deg")), 0.9, 1e-3, 0);
        CHECK_NEAR(json_number_value(json_object_get(row, "r1_m")), 10, 0.01, 0);
        CHECK(samples && strlen(samples) >= 200 && strspn(samples, "0123456789abcdef") == strlen(samples));
        CHECK(off_deg > 9.5 || is_blind(row, 0.85));
        CHECK(off_deg < 13 || !is_blind(row, 0.85));
        CHECK(!is_blind(row, 0.65)); /* but for what is near the head */
        blind += is_blind(row, 0.85);
    }
    CHECK(blind >= 20 && blind <= 30);
    json_decref(result);
}

/* A turn of the head has 400. */
static void pings(unsigned n)
{
    for (unsigned i = 0; i < n; i += 100)
        rig_run_pings(100);
}

TEST(a_bar_is_learnt_and_masked)
{
    begin(SHORT);
    CHECK_STR(background_state(), "none");
    pings(500);
    CHECK_STR(state_at(BAR_DEG, 1.5), "blocked");
    CHECK_STR(state_at(18, 7), "blocked");
    json_decref(rig_ask("background_learn", "%s", "\"pings\":3,\"motion\":\"any\""));
    pings(200);
    CHECK_STR(background_state(), "learning");
    CHECK_NEAR(number_of("learning", "pings"), 3, 0, 0);
    CHECK(number_of("learning", "progress") > 0 && number_of("learning", "progress") < 1);
    CHECK(number_of("learning", "taken") >= 199 && number_of("learning", "rows_full") == 0);
    CHECK_STR(text_of("background", "", "learning", "motion"), "not asked for: surroundings may be learnt, too");
    RIG_UNTIL(strcmp(background_state(), "in force") == 0, 400);
    CHECK(isnan(number_of("learning", "pings")));
    CHECK_NEAR(number_of("template", "rows_learnt"), 400, 0, 0);
    CHECK_NEAR(number_of("template", "clusters_kept"), 1, 0, 0);
    CHECK(strstr(text_of("background", "", NULL, "happened"), "learnt: loud clusters taken for the vehicle: 1, "));
    CHECK(number_of("template", "blind_cells") > 20);
    CHECK_STR(rig_status("background", true), "in force");
    rig_run(130); /* what was seen of it is forgotten */
    CHECK_STR(text_of("background", "", "template", "fits"), "yes");
    for (int azimuth_deg = 194; azimuth_deg <= 206; azimuth_deg += 4)
        CHECK_STR(state_at(azimuth_deg, 1.5), "unknown");
    CHECK(strstr(reason_at(BAR_DEG, 1.5), ": hidden by the background template"));
    CHECK(strstr(reason_at(BAR_DEG, 0.85), ": hidden by the background template"));
    CHECK(!strstr(reason_at(100, 12), "hidden"));
    CHECK_STR(state_at(18, 7), "blocked");
    CHECK_STR(state_at(100, 5), "clear");
    check_picture();
    json_decref(rig_ask("background_forget", "%s", ""));
    pings(500);
    CHECK_STR(background_state(), "none");
    CHECK_STR(state_at(BAR_DEG, 1.5), "blocked");
    rig_end();
}

/* Nothing is so loud: that is what open water gives, and no failure. */
TEST(no_part_of_the_vehicle_is_found)
{
    begin(SHORT "[background]\nmin_level = 255\n");
    rig_run_pings(1);
    json_decref(rig_ask("background_learn", "%s", "\"pings\":3,\"motion\":\"any\""));
    RIG_UNTIL(strcmp(background_state(), "in force") == 0, 400);
    CHECK_NEAR(number_of("template", "clusters_kept"), 0, 0, 0);
    CHECK(strstr(text_of("background", "", NULL, "happened"),
                 "learnt: no part of the vehicle found; loud clusters"));
    rig_end();
}

/* What stands still in the world looks like the vehicle to one that stands still. */
TEST(a_vehicle_that_stands_still_learns_nothing)
{
    begin("[pose]\nmax_age = 5 s\n");
    rig.pose_every_ns = RIG_S / 10;
    rig_run(1);
    json_decref(rig_ask("background_learn", "%s", "\"pings\":2"));
    pings(1300);
    CHECK_STR(background_state(), "learning");
    CHECK_STR(text_of("background", "", "learning", "motion"), "waiting for the vehicle to move");
    CHECK(number_of("learning", "unmoved") > 800 && number_of("learning", "rows_full") == 0);
    rig.turn_dps = 7; /* it turns: so does what is not of it */
    RIG_UNTIL(strcmp(background_state(), "in force") == 0, 600);
    CHECK_NEAR(number_of("template", "clusters_kept"), 1, 0, 0);
    rig_end();
}

TEST(without_a_pose_it_says_so)
{
    begin("");
    rig_run(2);
    json_decref(rig_ask("background_learn", "%s", "\"pings\":3"));
    rig_run_pings(20);
    CHECK_STR(text_of("background", "", "learning", "motion"),
              "unknown without a pose: surroundings may be learnt, too");
    json_decref(rig_ask("background_stop", "%s", ""));
    CHECK_STR(background_state(), "none");
    rig_end();
}

/* A rod that rings with the head, before a column. Its template is learnt, and written to `file`. */
static void learn_rod(const char *file)
{
    char conf[300];
    snprintf(conf, sizeof conf, "background = %s\n", file);
    begin(conf);
    rig.sim.frame.range_m = 0.22;
    rig_run_pings(1);
    json_decref(rig_ask("background_learn", "%s", "\"pings\":3,\"motion\":\"any\""));
    RIG_UNTIL(strcmp(background_state(), "in force") == 0, 400);
    size_t size;
    struct fault fault;
    uint8_t *bytes = template_encode(rig.d.templates.of[0].background, &size);
    CHECK(bytes && template_write(bytes, size, file, &fault));
    free(bytes);
    rig_end();
}

/* The water between rod and column is clear only where the template is promised to hold the vehicle alone. */
TEST(water_behind_a_part_that_rings)
{
    char file[] = "/tmp/sonard-rod-XXXXXX", conf[300];
    CHECK(close(mkstemp(file)) == 0 && unlink(file) == 0);
    learn_rod(file);
    for (int promised = 0; promised < 2; promised++) {
        snprintf(conf, sizeof conf, "background = %s\n" SHORT "[background]\nopen_water = %s\n", file,
                 promised ? "yes" : "no");
        begin(conf);
        rig.sim.frame.range_m = 0.22;
        pings(900);
        CHECK_STR(background_state(), "in force");
        CHECK_STR(state_at(BAR_DEG, 3), promised ? "clear" : "unknown");
        CHECK(promised ||
              strstr(reason_at(BAR_DEG, 3), ": hidden by a ring-down that is longer or louder than usual"));
        CHECK_STR(state_at(BAR_DEG, 5), "blocked");
        CHECK_STR(state_at(100, 5), "clear");
        rig_end();
    }
    unlink(file);
}

int main(void)
{
    RUN(a_bar_is_learnt_and_masked);
    RUN(no_part_of_the_vehicle_is_found);
    RUN(a_vehicle_that_stands_still_learns_nothing);
    RUN(without_a_pose_it_says_so);
    RUN(water_behind_a_part_that_rings);
    return test_end();
}
