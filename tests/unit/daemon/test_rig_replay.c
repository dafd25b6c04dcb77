/* SPDX-License-Identifier: MIT */
/*
 * test_rig_replay - a replay answers at any time what the daemon answered then, whatever befell the sonar: silence,
 * its port's loss, other settings, a steered scan, and poses that stop. Asked live and in the replay at the same times.
 */
#include "tests/lib/rig.h"

#include <dirent.h>

#include "daemon/options.h"

#define SCENE "box -6 9 -5 7 -20 20\ncylinder 4 1 0.5\n"
#define GRID  "[grid]\nangular_step = 6 deg\n"
#define WORLD                                                                                                     \
    "[answers]\nlook_ahead = 6 m\n[pose]\nmax_age = 3 s\n"                                                        \
    "[vehicle]\nmax_speed = 1 m/s\nmax_turn = 30 deg/s\n"

#define MOMENTS_MAX 64
#define SECTORS     24

/* What a client is told: of the sonar, and of all directions. */
struct told {
    char sonar[512], data[512];
    uint64_t heard; /* the pings until then, with their times and flags */
    struct sector {
        char state[16];
        double range_m, free_to_m, age_s;
    } sector[SECTORS];
};

static struct moment {
    uint64_t t_ns;
    struct told live;
    struct loop_timer timer;
} moment[MOMENTS_MAX];

static unsigned moments, offline, played;
static bool late; /* the capture begins in the middle of the dive */

/* In the world's axes and in the vehicle's in turn. */
static void ask_all(struct told *a, bool ned)
{
    json_t *reply, *s;
    size_t k;
    memset(a, 0, sizeof *a);
    a->heard = rig.heard;
    snprintf(a->sonar, sizeof a->sonar, "%s", rig_status("state", true));
    snprintf(a->data, sizeof a->data, "%s", rig_status("data", false));
    reply = rig_ask("sectors", "\"count\":%d,\"frame\":\"%s\"", SECTORS, ned ? "ned" : "body");
    json_array_foreach(json_object_get(reply, "sectors"), k, s)
    {
        struct sector *to = &a->sector[k];
        snprintf(to->state, sizeof to->state, "%s", json_string_value(json_object_get(s, "state")));
        to->range_m = json_number_value(json_object_get(s, "range_m"));
        to->free_to_m = json_number_value(json_object_get(s, "free_to_m"));
        to->age_s = json_number_value(json_object_get(s, "age_s"));
    }
    json_decref(reply);
}

static bool same(const struct sector *a, const struct sector *b)
{
    return strcmp(a->state, b->state) == 0 && a->range_m == b->range_m && a->age_s == b->age_s &&
           a->free_to_m == b->free_to_m;
}

/* Is the replay sure of nothing that was not known live? */
static void compare_late(const struct moment *m, const struct told *now)
{
    const bool live = strcmp(m->live.sonar, "running") == 0, replayed = strcmp(now->sonar, "running") == 0;
    CHECK(replayed == live);
    for (int i = 0; i < SECTORS; i++)
        CHECK(strcmp(now->sector[i].state, "clear") != 0 || strcmp(m->live.sector[i].state, "clear") == 0);
}

static void compare(const struct moment *m, const struct told *now)
{
    const double t_s = (double)(m->t_ns - RIG_EPOCH_NS - 100ull * RIG_S) * 1e-9;
    bool good = strcmp(m->live.sonar, now->sonar) == 0 && strcmp(m->live.data, now->data) == 0;
    if (!good)
        printf("at %.3f s: live %s, %s; replay %s, %s\n", t_s, m->live.sonar, m->live.data, now->sonar, now->data);
    if (m->live.heard != now->heard)
        printf("at %.3f s: other pings\n", t_s);
    good = good && m->live.heard == now->heard;
    for (int i = 0; i < SECTORS && good; i++) {
        const struct sector *a = &m->live.sector[i], *b = &now->sector[i];
        good = same(a, b);
        if (!good)
            printf("at %.3f s, sector %d: live %s %g %g %g, replay %s %g %g %g\n", t_s, i, a->state, a->range_m,
                   a->free_to_m, a->age_s, b->state, b->range_m, b->free_to_m, b->age_s);
    }
    CHECK(good);
}

/* Between two steps of the world, so that nothing else is at that time. */
static void ask_live(void)
{
    struct moment *m = &moment[moments++];
    rig_now_ns += RIG_STEP_NS / 5;
    m->t_ns = rig_now_ns + RIG_EPOCH_NS;
    ask_all(&m->live, moments % 2);
    offline += strcmp(m->live.sonar, "running") != 0;
}

/* Lets so many times so many seconds pass. */
static void run_and_ask(unsigned times, double s)
{
    while (times-- > 0) {
        rig_run(s);
        ask_live();
    }
}

static void on_moment(void *ctx, uint64_t now_ns)
{
    struct told now;
    const struct moment *m = ctx;
    (void)now_ns;
    ask_all(&now, (m - moment + 1) % 2);
    if (late)
        compare_late(m, &now);
    else
        compare(m, &now);
    played++;
}

static void arm_moments(void)
{
    for (unsigned i = 0; i < moments; i++) {
        moment[i].timer = (struct loop_timer){.fire = on_moment, .ctx = &moment[i]};
        loop_arm(rig.d.loop, &moment[i].timer, moment[i].t_ns);
    }
}

/* The newest capture in the folder; the others are removed. */
static void find_capture(const char *folder, char path[300])
{
    DIR *d = opendir(folder);
    char other[300];
    CHECK(d != NULL);
    for (struct dirent *e; d && (e = readdir(d));) {
        if (!strstr(e->d_name, ".mcap"))
            continue;
        snprintf(other, sizeof other, "%s/%s", folder, e->d_name);
        const bool newer = strcmp(other, path) > 0;
        if (newer ? path[0] : true)
            unlink(newer ? path : other);
        if (newer)
            snprintf(path, 300, "%s", other);
    }
    closedir(d);
}

/* A dive, live and again; `least` of its moments have the sonar offline. */
static void dive(const char *sonar, const char *vehicle, void (*go)(void), unsigned least)
{
    char folder[] = "/tmp/sonard-rig-XXXXXX", path[300] = "", conf[1000];
    snprintf(conf, sizeof conf, "%s%s%s", sonar, GRID WORLD, vehicle);
    CHECK(mkdtemp(folder) != NULL);
    moments = offline = played = 0;
    rig_captures = folder;
    rig_start(SCENE, conf);
    rig.pose_every_ns = RIG_S / 10;
    rig.turn_dps = 4;
    rig.north_mps = 0.05;
    go();
    rig_run(0.2); /* a message behind the last moment */
    rig_end();
    rig_captures = NULL;
    CHECK(offline >= least);
    find_capture(folder, path);
    rig_before_replay = arm_moments;
    rig_replay(path, conf);
    rig_before_replay = NULL;
    rig_end();
    CHECK_INT(played, moments);
    unlink(path);
    rmdir(folder);
}

/* Two of them, in which the head's line falls silent in the middle of a message, and its way after each. */
static void silences(void)
{
    run_and_ask(2, 8);
    for (int i = 0; i < 2; i++) {
        rig.sim.line.faults.cut = 1;
        rig_run(0.3);
        rig_command("silent 3600");
        run_and_ask(3, 0.7);
        rig_command("silent 0");
        run_and_ask(3, 1 + 0.7 * i);
    }
    run_and_ask(1, 8);
}

TEST(after_a_silence_the_same)
{
    dive("step = 3.6 deg\n", "", silences, 4);
}

TEST(after_a_silence_of_a_head_that_is_asked_the_same)
{
    dive("step = 3.6 deg\nmode = request\n", "", silences, 4);
}

/* Longer than water stays clear, and than the head takes all around. */
static void long_silence(void)
{
    run_and_ask(1, 15);
    rig_command("silent 3600");
    run_and_ask(3, 10);
    rig_command("silent 0");
    run_and_ask(5, 2.1);
}

TEST(of_a_head_that_answers_again_after_30_s_the_same)
{
    dive("step = 3.6 deg\n", "", long_silence, 3);
}

static void pulled_out(void)
{
    run_and_ask(2, 8);
    rig_unplug();
    run_and_ask(3, 1);
    rig_plug();
    run_and_ask(5, 1.3);
}

TEST(of_a_port_that_is_pulled_out_and_put_back_the_same)
{
    dive("step = 3.6 deg\n", "", pulled_out, 3);
}

/* The port is open and deaf until it is opened anew. */
static void deaf_port(void)
{
    run_and_ask(2, 8);
    rig_dead(true);
    run_and_ask(6, 2.5);
    run_and_ask(2, 2);
}

TEST(of_a_port_that_is_opened_anew_the_same)
{
    dive("step = 3.6 deg\n", "", deaf_port, 3);
}

static void poses_stop(void)
{
    rig.dated = true;
    run_and_ask(2, 8);
    rig.pose_every_ns = 0;
    run_and_ask(5, 1);
    rig.pose_every_ns = RIG_S / 10;
    rig.next_pose_ns = 0;
    run_and_ask(3, 1);
}

TEST(of_poses_that_stop_the_same)
{
    dive("step = 3.6 deg\n", "", poses_stop, 0);
}

/* The process is held up twice, once between its look and its read: bytes and poses wait, nobody knows since when. */
static void stalls(void)
{
    run_and_ask(1, 5);
    rig_hold(3);
    run_and_ask(2, 0.3);
    rig_hold_in_turn(1.5);
    run_and_ask(2, 0.7);
    rig_command("silent 3");
    rig_hold(2);
    run_and_ask(4, 0.6);
}

TEST(of_a_process_that_was_held_up_the_same)
{
    dive("step = 3.6 deg\n", "", stalls, 1);
}

/* In place of a client's poses. */
static void headings(void)
{
    static const char *const said[] = {"$GPHDT,200.0,T*37\r\n", "$GPHDT,210.0,T*36\r\n"};
    rig.pose_every_ns = 0;
    for (int i = 0; i < 12; i++) {
        CHECK_INT(write(rig.instrument, said[i % 2], strlen(said[i % 2])), strlen(said[i % 2]));
        rig_run(0.53);
    }
    run_and_ask(4, 1);
}

TEST(of_headings_of_an_instrument_that_stops_the_same)
{
    dive("step = 3.6 deg\n", RIG_NMEA, headings, 0);
}

static char conf_path[80];

static void load(const char *sonar, const char *grid, const char *more)
{
    FILE *f = fopen(conf_path, "w");
    CHECK(f != NULL);
    if (!f)
        return;
    fprintf(f,
            "[sonar front]\ndevice = ping360\nport = serial:/dev/rig:115200\nstep = 3.6 deg\n%s" GRID "%s" WORLD
            "%s",
            sonar, grid, more);
    fclose(f);
    json_decref(rig_ask("reload", "%s", ""));
}

/* The range is the head's, the target the extraction's, which learns anew, and how long water stays clear the grid's.
 * The turn of the mount needs a restart: it takes no effect, in the replay neither. */
static void reloads(void)
{
    static struct options options;
    snprintf(conf_path, sizeof conf_path, "%s/sonard.conf", rig.dir);
    options = (struct options){.conf = conf_path, .threads = -1};
    rig_set_reload(&options);
    run_and_ask(2, 8);
    load("range = 6 m\ngain = 2\nrotation = 0 0 30 deg\n", "", "");
    run_and_ask(3, 1);
    load("range = 6 m\ngain = 2\nmode = request\n", "clear_for = 5 s\n", "[extract]\ntarget = net\n");
    run_and_ask(3, 1.5);
    rig_command("silent 2");
    run_and_ask(4, 1);
    unlink(conf_path);
}

TEST(of_settings_that_are_reloaded_the_same)
{
    dive("step = 3.6 deg\n", "", reloads, 1);
}

/* It looks where the thrusters push: which bearings those are, the replay's own pictures do not decide. */
static void pushes(void)
{
    rig.unplaced = true;
    for (int i = 0; i < 28; i++) {
        json_decref(rig_ask("pose", "\"push_n\":[0,%d]", i < 8 || i > 18 ? 0 : -5));
        rig_run(1);
        if (i % 4 == 3)
            ask_live();
    }
    rig_command("silent 2");
    run_and_ask(4, 1);
}

TEST(of_a_head_that_is_steered_the_same)
{
    dive("step = 3.6 deg\n", "current = 0.05 m/s\n", pushes, 1);
}

/* A head that is silent when the recording begins, and long before. */
static void record_late(void)
{
    rig_run(14);
    record_pause(rig.d.record, true, rig_now_ns);
    rig_command("silent 3600");
    rig_run(4);
    record_pause(rig.d.record, false, rig_now_ns);
    rig_run(1.1); /* in which the state is told */
    run_and_ask(2, 0.4);
    rig_command("silent 0");
    run_and_ask(6, 1.3);
}

TEST(of_a_recording_that_begins_late_nothing_surer)
{
    late = true;
    dive("step = 3.6 deg\n", "", record_late, 2);
    late = false;
}

int main(void)
{
    RUN(after_a_silence_the_same);
    RUN(after_a_silence_of_a_head_that_is_asked_the_same);
    RUN(of_a_head_that_answers_again_after_30_s_the_same);
    RUN(of_a_port_that_is_pulled_out_and_put_back_the_same);
    RUN(of_a_port_that_is_opened_anew_the_same);
    RUN(of_poses_that_stop_the_same);
    RUN(of_a_process_that_was_held_up_the_same);
    RUN(of_headings_of_an_instrument_that_stops_the_same);
    RUN(of_settings_that_are_reloaded_the_same);
    RUN(of_a_head_that_is_steered_the_same);
    RUN(of_a_recording_that_begins_late_nothing_surer);
    return test_end();
}
