/* SPDX-License-Identifier: MIT */
/* test_rig_reload - what a reload says it has applied is in force: each key by what it does, not by what is stored. */
#include "tests/lib/rig.h"

#include <limits.h>
#include <sys/stat.h>

#include "core/log.h"
#include "daemon/options.h"

#define OLD "[pose]\nmax_age = 60 s\n"

static char conf_path[80];
static struct options options;

static void begin(const char *conf)
{
    rig_start("cylinder 5 0 0.5\n", conf);
    snprintf(conf_path, sizeof conf_path, "%s/sonard.conf", rig.dir);
    options = (struct options){.conf = conf_path, .threads = -1};
    rig_set_reload(&options);
}

static void end(void)
{
    unlink(conf_path);
    rig_end();
}

/* The file has these sections now; all that is new in it, `n` keys, is applied. */
static void reload_all(const char *sonar, const char *more, size_t n)
{
    FILE *f = fopen(conf_path, "w");
    CHECK(f != NULL);
    if (!f)
        return;
    fprintf(f, "%s%s", sonar, more);
    fclose(f);
    json_t *said = rig_ask("reload", "%s", "");
    CHECK_INT(json_array_size(json_object_get(said, "applied")), n);
    CHECK_INT(json_array_size(json_object_get(said, "needs_restart")), 0);
    json_decref(said);
}

static void reload(const char *more, size_t n)
{
    reload_all(RIG_SONAR, more, n);
}

static void pose_once(void)
{
    rig_tell_pose();
    rig_run(2);
}

static struct pose now(void)
{
    struct pose pose = pose_identity;
    pose_log_at(&rig.d.poses, rig_now_ns, &pose);
    return pose;
}

/* A vehicle that was last heard of a while ago may have gone and turned as fast as it ever does. */
TEST(max_speed_and_max_turn_bound_the_vehicle_at_once)
{
    begin(OLD);
    pose_once();
    reload(OLD "[vehicle]\nmax_speed = 1 m/s\nmax_turn = 10 deg\n", 2);
    const struct pose slow = now();
    CHECK(slow.uncertain_m > 1 && slow.uncertain_rad > geo_rad(10));
    reload(OLD "[vehicle]\nmax_speed = 4 m/s\nmax_turn = 30 deg\n", 2);
    const struct pose fast = now();
    CHECK_NEAR(fast.uncertain_m / slow.uncertain_m, 4, 1e-6, 0);
    CHECK_NEAR(fast.uncertain_rad / slow.uncertain_rad, 3, 1e-6, 0);
    end();
}

/* Of a vehicle without a position: how fast it goes off. */
TEST(max_speed_and_station_keeping_are_the_drift)
{
    begin("");
    reload("[vehicle]\nmax_speed = 2 m/s\n", 1);
    CHECK_NEAR(now().drift_mps, hypot(2, 2), 1e-9, 0); /* along and down */
    rig_run(1);
    const double before_m = now().drift_m[0];
    reload("[vehicle]\nmax_speed = 2 m/s\nstation_keeping = 0.5 m/s\n", 1);
    CHECK_NEAR(now().drift_mps, hypot(0.5, 0.5), 1e-9, 0);
    CHECK_NEAR(now().drift_m[0], before_m, 1e-9, 0); /* what it has drifted stays */
    rig_run(2);
    CHECK_NEAR(now().drift_m[0] - before_m, 1, 1e-6, 0);
    end();
}

TEST(heading_drift_counts_at_once)
{
    begin(OLD);
    pose_once();
    CHECK_NEAR(now().heading_radps, geo_rad(0.01), 1e-12, 0);
    reload(OLD "heading_drift = 3.6 deg/h\n", 1);
    CHECK_NEAR(now().heading_radps, geo_rad(0.001), 1e-12, 0);
    end();
}

TEST(max_age_makes_a_pose_old_and_young)
{
    begin(OLD);
    pose_once();
    CHECK(pose_log_fresh(&rig.d.poses, rig_now_ns));
    reload("[pose]\nmax_age = 1 s\n", 1);
    CHECK(!pose_log_fresh(&rig.d.poses, rig_now_ns));
    reload(OLD, 1);
    CHECK(pose_log_fresh(&rig.d.poses, rig_now_ns));
    end();
}

static double told(const char *method, const char *list, const char *name)
{
    json_t *reply = rig_ask(method, "%s", "");
    json_t *from = list ? json_array_get(json_object_get(reply, list), 0) : reply;
    const double value = json_number_value(json_object_get(from, name));
    json_decref(reply);
    return value;
}

TEST(limits_of_the_grid_and_of_questions_change)
{
    begin(OLD);
    reload(OLD "[grid]\nclear_for = 7 s\nmove_limit = 3 m\n[answers]\nlook_ahead = 6 m\n", 3);
    CHECK_NEAR(told("grid_list", "grids", "clear_for_s"), 7, 0, 0);
    CHECK_NEAR(pipeline_grid(rig.d.pipeline, 0)->setting.limits.move_limit_m, 3, 0, 0);
    CHECK_NEAR(told("sectors", NULL, "distance_m"), 6, 0, 0);
    end();
}

/* All around, and a little more: 400 pings of 0.9 degrees. */
static void head_turns(void)
{
    rig_run_pings(220);
    rig_run_pings(220);
}

static unsigned echoes(void)
{
    json_t *image = rig_ask("image", "%s", ""), *row;
    unsigned n = 0;
    size_t i;
    json_array_foreach(json_object_get(image, "rows"), i, row) n +=
        strcmp(json_string_value(json_object_get(row, "state")), "echo") == 0;
    json_decref(image);
    return n;
}

TEST(a_sonars_detector_begins_anew_with_its_new_key)
{
    begin(OLD);
    head_turns();
    CHECK(echoes() > 0);
    reload("ring_down = 9.5 m\n" OLD, 1); /* all echoes are nearer: at 4.5 m, and once more there and back */
    head_turns();
    CHECK_INT(echoes(), 0);
    end();
}

#define HEAD "[sonar front]\ndevice = ping360\nport = serial:/dev/rig:115200\nrange = "

static bool has_mode(const char *mode)
{
    json_t *reply = rig_ask("sensors", "%s", "");
    const json_t *sensor = json_array_get(json_object_get(reply, "sensors"), 0);
    const char *said = json_string_value(json_object_get(json_object_get(sensor, "tuning"), "mode"));
    const bool same = said && strcmp(said, mode) == 0;
    json_decref(reply);
    return same;
}

/* The head has it, scans on, and is not taken for one that another program has set; so in both modes. */
TEST(a_head_is_told_its_range_gain_and_mode)
{
    static const struct {
        const char *sonar;
        size_t n;
        double range_m;
        unsigned gain;
        const char *mode;
    } row[] = {
        {HEAD "4 m\n", 1, 4, 1, "auto"},
        {HEAD "4 m\ngain = 2\n", 1, 4, 2, "auto"},
        {HEAD "4 m\ngain = 2\nmode = request\n", 1, 4, 2, "request"},
        {HEAD "20 m\ngain = 0\nmode = request\n", 2, 20, 0, "request"},
        {HEAD "20 m\ngain = 0\nmode = transmit\n", 1, 20, 0, "transmit"},
    };
    begin(OLD);
    rig_run_pings(30);
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        const uint64_t restarts = rig_stats().device.restarts;
        reload_all(row[i].sonar, OLD, row[i].n);
        rig_run_pings(30);
        CHECK_NEAR(told("status", "sensors", "range_m"), row[i].range_m, 0.1, 0);
        CHECK_INT(rig.sim.head.settings.gain, row[i].gain);
        CHECK(has_mode(row[i].mode));
        CHECK(rig.sim.head.automatic == (strcmp(row[i].mode, "request") != 0));
        CHECK_INT(rig_stats().device.restarts, restarts);
        CHECK_INT(rig_stats().device.taken_over, 0);
        CHECK_INT(rig_stats().device.timeouts, 0);
    }
    end();
}

/* Farther than the grid reaches: nothing is said of what it does not keep. */
TEST(a_longer_range_makes_no_larger_grid)
{
    begin(OLD);
    head_turns();
    const double grid_m = told("grid_list", "grids", "range_m");
    reload_all(HEAD "40 m\n", OLD, 1);
    head_turns();
    CHECK_NEAR(told("status", "sensors", "range_m"), 40, 0.5, 0);
    CHECK_NEAR(told("grid_list", "grids", "range_m"), grid_m, 0, 0);
    json_t *reply = rig_ask("sectors", "%s", "\"distance_m\": 30"), *sector;
    size_t i;
    json_array_foreach(json_object_get(reply, "sectors"), i, sector)
        CHECK(json_number_value(json_object_get(sector, "free_to_m")) < grid_m + 0.2);
    json_decref(reply);
    end();
}

/* What the sonar detects, as status says; 0: not known. */
static double detects_db(void)
{
    json_t *reply = rig_ask("status", "%s", "");
    const json_t *sensor = json_array_get(json_object_get(reply, "sensors"), 0);
    const double db = json_number_value(json_object_get(json_object_get(sensor, "detects"), "level_db"));
    json_decref(reply);
    return db;
}

/* The old level is none of the new target's. */
TEST(what_is_detected_is_not_known_until_a_ping_comes_under_the_new_target)
{
    begin(OLD);
    head_turns();
    const double wall_db = detects_db();
    CHECK(wall_db < 0);
    reload(OLD "[extract]\ntarget = net\n", 1);
    CHECK_NEAR(detects_db(), 0, 0, 0);
    rig_run_pings(20);
    CHECK(detects_db() < wall_db - 3);
    end();
}

TEST(the_log_says_as_much_as_it_should)
{
    static const struct {
        const char *more;
        bool warning, info;
    } row[] = {{OLD "[log]\nlevel = err\n", false, false},
               {OLD "[log]\nlevel = warning\n", true, false},
               {OLD, true, true}};
    begin(OLD);
    for (size_t i = 0; i < sizeof row / sizeof row[0]; i++) {
        reload(row[i].more, 1);
        rig_log_begin();
        log_line(LOG_WARNING, "rig", "a warning");
        log_line(LOG_INFO, "rig", "an information");
        CHECK(rig_log_count("a warning") == row[i].warning);
        CHECK(rig_log_count("an information") == row[i].info);
        rig_log_end();
    }
    end();
}

/* Names are looked up by a thread of its own, which ends when it wants. */
TEST(who_may_change_something_is_looked_up_again)
{
    begin(OLD);
    rig_log_begin();
    reload(OLD "[server]\nchange = no-such-user\n", 1);
    for (int i = 0; i < 60000 && !rig_log_count("gives nobody a right"); i++) {
        rig_run(0.005);
        usleep(1000);
    }
    CHECK(rig_log_count("there is no user 'no-such-user' here: that gives nobody a right"));
    rig_log_end();
    end();
}

/* The reply to reload_check with that text for conf.d/NAME, refused or not; the caller's. */
static json_t *check_reply(const char *name, const char *text)
{
    struct json_out out = {0};
    struct rpc_error error = {0};
    char folder[PATH_MAX], file[PATH_MAX + 64];
    CHECK(realpath(rig.dir, folder) != NULL);
    snprintf(file, sizeof file, "%s/%s", folder, name);
    const bool good = reload_check(&rig.d.reload, file, text, &out, &error);
    json_t *reply = good ? json_loadb(out.bytes, out.n, 0, NULL) : json_string(error.message);
    free(out.bytes);
    return reply;
}

static void check_refused(const char *name, const char *text, const char *why)
{
    json_t *reply = check_reply(name, text);
    CHECK(json_is_string(reply) && strstr(json_string_value(reply), why) != NULL);
    json_decref(reply);
}

/* What a reload would say is told, and nothing is done and nothing logged. */
TEST(a_reload_can_be_tried)
{
    begin(OLD);
    reload("[grid]\nclear_for = 9 s\n", 2);
    char folder[96];
    snprintf(folder, sizeof folder, "%s/sonard.conf.d", rig.dir);
    CHECK(mkdir(folder, 0700) == 0);
    rig_log_begin();
    json_t *reply = check_reply("sonard.conf.d/web.conf", "[grid]\nclear_for = 7 s\n[map]\nvoxel = 1 m\n");
    CHECK_STR(json_string_value(json_array_get(json_object_get(reply, "applied"), 0)), "[grid] clear_for = 7 s");
    CHECK_STR(json_string_value(json_array_get(json_object_get(reply, "needs_restart"), 0)), "[map] voxel = 1 m");
    json_decref(reply);
    check_refused("sonard.conf.d/web.conf", "[grid]\nclear_for = 1 parsec\n", "web.conf:2: [grid] clear_for");
    check_refused("sonard.conf.d/web.conf", "[grid]\nforget = 20 s\nclear_for = 90 s\n", "does not go with");
    check_refused("elsewhere/web.conf", "[grid]\nclear_for = 7 s\n", "does not read");
    check_refused("sonard.conf.d/web", "[grid]\nclear_for = 7 s\n", "does not read");
    reply = rig_ask("reload_check", "\"file\":\"%s/web.conf\"", folder);
    CHECK_INT(json_array_size(json_object_get(reply, "applied")), 0);
    json_decref(reply);
    CHECK_INT(rig_log_count("reload"), 0);
    rig_log_end();
    CHECK_NEAR(told("grid_list", "grids", "clear_for_s"), 9, 0, 0);
    rmdir(folder);
    end();
}

int main(void)
{
    RUN(a_reload_can_be_tried);
    RUN(max_speed_and_max_turn_bound_the_vehicle_at_once);
    RUN(max_speed_and_station_keeping_are_the_drift);
    RUN(heading_drift_counts_at_once);
    RUN(max_age_makes_a_pose_old_and_young);
    RUN(limits_of_the_grid_and_of_questions_change);
    RUN(a_sonars_detector_begins_anew_with_its_new_key);
    RUN(a_head_is_told_its_range_gain_and_mode);
    RUN(a_longer_range_makes_no_larger_grid);
    RUN(what_is_detected_is_not_known_until_a_ping_comes_under_the_new_target);
    RUN(the_log_says_as_much_as_it_should);
    RUN(who_may_change_something_is_looked_up_again);
    return test_end();
}
