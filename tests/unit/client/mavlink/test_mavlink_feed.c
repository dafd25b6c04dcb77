/* SPDX-License-Identifier: MIT */
/*
 * test_mavlink_feed - the bridge's side to the daemon against a daemon of this test's own, in the same thread: that
 * this works shows that the feed never waits. The times that it is given are made up.
 */
#include "client/mavlink/mavlink_feed.h"

#include <math.h>

#include "tests/lib/daemon_here.h"

static void end_here(struct daemon_here *d, struct mavlink_feed *feed)
{
    mavlink_feed_close(feed);
    leave_here(d);
}

/* Connected, and all watches agreed to, at START; with that of a downward sonar where it has a name. */
static void begin_with(struct daemon_here *d, struct mavlink_feed *feed, const char *downward)
{
    const struct mavlink_feed_conf conf = {.socket = path, .rate_hz = 10, .downward = downward};
    listen_here(d);
    mavlink_feed_init(feed, &conf);
    feed->unix_offset_ns = OFFSET;
    mavlink_feed_connect(feed, START);
    CHECK(feed->client != NULL && !mavlink_feed_alive(feed, START));
    agree(d);
    mavlink_feed_read(feed, START);
    CHECK_INT(d->watches, downward ? 3 : 2);
    CHECK(mavlink_feed_alive(feed, START));
}

static void begin(struct daemon_here *d, struct mavlink_feed *feed)
{
    begin_with(d, feed, NULL);
}

TEST(answers_are_taken_and_grow_old)
{
    struct daemon_here d;
    struct mavlink_feed feed;
    begin(&d, &feed);
    CHECK(!mavlink_feed_answered(&feed, START) && mavlink_feed_reach_m(&feed) == 0);
    say_status(&d, 0.1, 0);
    say_sectors(&d, 7, 0.25, 0);
    mavlink_feed_read(&feed, START);
    CHECK(mavlink_feed_fresh(&feed, START) && mavlink_feed_reach_m(&feed) == 10);
    CHECK(feed.ring[0].sector[5].range_m == 7 && feed.evidence_ns == START - 250 * MS);
    CHECK(mavlink_feed_fresh(&feed, START + 999 * MS) && !mavlink_feed_answered(&feed, START + S));
    say_sectors(&d, 7, 2.75, 2.5); /* it goes on answering, but its sonar has fallen silent */
    mavlink_feed_read(&feed, START + 2500 * MS);
    CHECK(mavlink_feed_answered(&feed, START + 2500 * MS) && !mavlink_feed_fresh(&feed, START + 2500 * MS));
    end_here(&d, &feed);
}

TEST(a_silent_daemon_is_left_after_a_while_and_another_tried)
{
    struct daemon_here d;
    struct mavlink_feed feed;
    const struct mavlink_pose pose = {.t_ns = START, .has = MAVLINK_POSE_DEPTH, .depth_m = 3};
    begin(&d, &feed);
    say_sectors(&d, 7, 0.25, 0);
    mavlink_feed_read(&feed, START);
    mavlink_feed_pose(&feed, &pose, START);
    CHECK_INT(agree(&d), 1);
    mavlink_feed_read(&feed, START);
    CHECK_INT(feed.poses, 1);
    for (int i = 0; i < 200; i++) { /* silence from here on: what is kept back does not come in a flood later */
        mavlink_feed_pose(&feed, &pose, START + (uint64_t)i * 20 * MS);
        mavlink_feed_read(&feed, START + (uint64_t)i * 20 * MS);
    }
    CHECK(feed.client && !mavlink_feed_alive(&feed, START + 2 * S));
    CHECK_INT(feed.poses_held, 175);
    CHECK_INT(agree(&d), 25);
    mavlink_feed_read(&feed, START + 4 * S);
    CHECK(feed.poses == 26 && mavlink_feed_alive(&feed, START + 4 * S));
    mavlink_feed_read(&feed, START + 9 * S + 1);
    CHECK(!feed.client && strstr(feed.error.message, "is silent"));
    CHECK(!mavlink_feed_answered(&feed, START + 9 * S) && feed.ring[0].sector[5].state == MAVLINK_SECTOR_UNKNOWN);
    mavlink_feed_connect(&feed, START + 9 * S + 2);
    CHECK(!feed.client); /* not at once */
    mavlink_feed_connect(&feed, START + 11 * S);
    CHECK(feed.client != NULL);
    end_here(&d, &feed);
    mavlink_feed_connect(&feed, START + 20 * S);
    CHECK(!feed.client && feed.error.status == SONARD_NO_DAEMON);
}

TEST(what_waited_on_its_way_is_as_old_as_it_is)
{
    struct daemon_here d;
    struct mavlink_feed feed;
    begin(&d, &feed);
    say_sectors(&d, 7, 0.25, 0);
    mavlink_feed_read(&feed, START);
    say_sectors(&d, 6, 0.25, 0.1);
    say_sectors(&d, 5, 0.25, 0.2);
    mavlink_feed_read(&feed, START + 8 * S); /* we were stopped */
    CHECK(feed.ring[0].sector[5].range_m == 5);
    CHECK_NEAR((double)feed.evidence_ns, (double)(START - 50 * MS), 0, 1e4);
    CHECK(!mavlink_feed_answered(&feed, START + 8 * S));
    end_here(&d, &feed);
}

TEST(steps_of_the_calendar_change_nothing)
{
    static const double steps_s[] = {0.4, -0.4, 3600, -3600, 86400 * 365.0, -86400 * 365.0};
    struct daemon_here d;
    struct mavlink_feed feed;
    const struct mavlink_pose pose = {.t_ns = START + 50 * MS, .has = MAVLINK_POSE_DEPTH, .depth_m = 3};
    begin(&d, &feed);
    for (size_t i = 0; i < sizeof steps_s / sizeof *steps_s; i++) {
        feed.unix_offset_ns = OFFSET + (uint64_t)(int64_t)(steps_s[i] * 1e9);
        say_sectors(&d, 7, 0.25, steps_s[i]);
        mavlink_feed_read(&feed, START + 100 * MS);
        CHECK_NEAR((double)feed.level_ns, (double)START, 0, 1e4);
        CHECK_NEAR((double)feed.evidence_ns, (double)(START - 250 * MS), 0, 1e4);
        mavlink_feed_pose(&feed, &pose, START + 100 * MS);

        char asked[500] = "";
        CHECK(read(d.fd, asked, sizeof asked - 1) > 0);
        json_t *request = json_loads(asked, 0, NULL), *params = json_object_get(request, "params");
        CHECK_NEAR(json_real_value(json_object_get(params, "t_unix")), T_UNIX + 0.05 + steps_s[i], 0, 1e-5);
        json_decref(request);
    }
    end_here(&d, &feed);
}

TEST(a_replay_has_a_calendar_of_its_own)
{
    struct daemon_here d;
    struct mavlink_feed feed;
    begin(&d, &feed);
    d.replay = true;
    say_status(&d, 0.1, -1e8);
    say_sectors(&d, 7, 0.25, -1e8);
    mavlink_feed_read(&feed, START);
    CHECK(mavlink_feed_fresh(&feed, START));
    end_here(&d, &feed);
}

TEST(a_restarted_daemon_is_found_again)
{
    struct daemon_here d;
    struct mavlink_feed feed;
    begin(&d, &feed);
    say_sectors(&d, 7, 0.25, 0);
    mavlink_feed_read(&feed, START);
    close(d.fd);
    d.fd = -1;
    d.watches = 0;
    mavlink_feed_read(&feed, START + S);
    CHECK(!feed.client && strstr(feed.error.message, "ended the connection"));
    CHECK(!mavlink_feed_answered(&feed, START + S));
    mavlink_feed_connect(&feed, START + 3 * S);
    agree(&d);
    say_sectors(&d, 7, 0.25, 3);
    mavlink_feed_read(&feed, START + 3 * S);
    CHECK(mavlink_feed_answered(&feed, START + 3 * S));
    end_here(&d, &feed);
}

TEST(no_leak_is_too_short_to_be_seen)
{
    struct daemon_here d;
    struct mavlink_feed feed;
    begin(&d, &feed);
    say_status(&d, 0.1, 0);
    mavlink_feed_read(&feed, START);
    CHECK(feed.leak_ns == 0);
    d.leaks = 1; /* wet and dry again between two answers */
    say_status(&d, 0.1, 1);
    mavlink_feed_read(&feed, START + S);
    CHECK(feed.leak_ns == START + S && !feed.wet);
    say_status(&d, 0.1, 2);
    mavlink_feed_read(&feed, START + 2 * S);
    CHECK(feed.leak_ns == START + S); /* once */
    d.leaks = 0;
    say_status(&d, 0.1, 3);
    mavlink_feed_read(&feed, START + 3 * S);
    CHECK(feed.leak_ns == START + S); /* a daemon that has just started to count */
    d.leaks = 1;
    d.wet = true;
    say_status(&d, 0.1, 4);
    mavlink_feed_read(&feed, START + 4 * S);
    CHECK(feed.leak_ns == START + 4 * S && feed.wet);
    end_here(&d, &feed);
}

TEST(a_refusal_is_told)
{
    struct daemon_here d;
    struct mavlink_feed feed;
    const struct mavlink_feed_conf conf = {.socket = path, .rate_hz = 10, .downward = "nobody"};
    listen_here(&d);
    mavlink_feed_init(&feed, &conf);
    mavlink_feed_connect(&feed, START);
    d.fd = accept4(d.listener, NULL, NULL, SOCK_NONBLOCK);
    say(&d, json_pack("{s:{s:i, s:s}, s:n}", "error", "code", -32000, "message", "too many clients", "id"));
    mavlink_feed_read(&feed, START);
    CHECK(!feed.client);
    CHECK_STR(feed.error.message, "too many clients");
    end_here(&d, &feed);
}

TEST(each_downward_ping_is_taken_once)
{
    struct daemon_here d;
    struct mavlink_feed feed;
    begin_with(&d, &feed, "below");
    CHECK_INT(feed.below.t_ns, 0);
    say_below(&d, 6, 0.25, 0);
    mavlink_feed_read(&feed, START);
    CHECK_NEAR((double)feed.below.t_ns, (double)(START - 250 * MS), 0, 1e4);
    CHECK(feed.below.echo && feed.below.range_m == 6 && feed.below.blind_m == 0.5);
    CHECK_NEAR(feed.below.width_rad, 0.5235988, 0, 1e-6);
    say_below(&d, 9, 0.255, 0.01); /* older by less than ages are rounded to: the same ping */
    mavlink_feed_read(&feed, START + 10 * MS);
    CHECK(feed.below.range_m == 6);
    say_below(&d, -1, 0.1, 0.1); /* it could hear nothing */
    mavlink_feed_read(&feed, START + 100 * MS);
    CHECK(feed.below.range_m == 6);
    say_below(&d, 0, 0.1, 0.2); /* it could, and did not */
    mavlink_feed_read(&feed, START + 200 * MS);
    CHECK(!feed.below.echo);
    CHECK_NEAR((double)feed.below.t_ns, (double)(START + 100 * MS), 0, 1e4);
    end_here(&d, &feed);
}

int main(void)
{
    if (!make_directory())
        return 1;
    RUN(answers_are_taken_and_grow_old);
    RUN(a_silent_daemon_is_left_after_a_while_and_another_tried);
    RUN(what_waited_on_its_way_is_as_old_as_it_is);
    RUN(steps_of_the_calendar_change_nothing);
    RUN(a_replay_has_a_calendar_of_its_own);
    RUN(a_restarted_daemon_is_found_again);
    RUN(no_leak_is_too_short_to_be_seen);
    RUN(a_refusal_is_told);
    RUN(each_downward_ping_is_taken_once);
    rmdir(directory);
    return test_end();
}
