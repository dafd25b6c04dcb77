/* SPDX-License-Identifier: MIT */
/* test_segments - segments are rotated, complete by themselves, and a disk that fails stops the recording only. */
#include "daemon/record/segments.h"

#include <dirent.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/fault.h"
#include "drivers/capture/mcap.h"
#include "tests/lib/test.h"

#define SECOND      1000000000ull
#define UNIX_OFFSET (1700000000ull * SECOND) /* 2023-11-14 22:13:20 UTC */
#define CONF        "[sonar front]\ndevice = ping360\n"

static struct fault fault;
static char dir[64];

static struct segments *open_paused(uint64_t file_size, int files, bool paused)
{
    return segments_open(&(struct segments_conf){.directory = dir,
                                                 .file_size = file_size,
                                                 .files = files,
                                                 .conf_text = CONF,
                                                 .conf_size = strlen(CONF),
                                                 .unix_offset_ns = UNIX_OFFSET,
                                                 .paused = paused},
                         0, &fault);
}

static struct segments *open_segments(uint64_t file_size, int files)
{
    return open_paused(file_size, files, false);
}

static void make_dir(void)
{
    snprintf(dir, sizeof dir, "/tmp/test_parts.XXXXXX");
    if (!mkdtemp(dir))
        exit(2);
}

static int by_name(const struct dirent **a, const struct dirent **b)
{
    return strcmp((*a)->d_name, (*b)->d_name);
}

static int not_dot(const struct dirent *e)
{
    return e->d_name[0] != '.';
}

/* Names in the folder in order, joined with a space each. */
static const char *names(void)
{
    static char all[4096];
    struct dirent **list;
    int n = scandir(dir, &list, not_dot, by_name);
    all[0] = '\0';
    for (int i = 0; i < n; i++) {
        strncat(all, list[i]->d_name, sizeof all - strlen(all) - 1);
        strncat(all, i < n - 1 ? " " : "", sizeof all - strlen(all) - 1);
        free(list[i]);
    }
    if (n >= 0)
        free(list);
    return all;
}

static void remove_dir(void)
{
    char path[512];
    char *rest = NULL;
    for (char *name = strtok_r((char *)(uintptr_t)names(), " ", &rest); name; name = strtok_r(NULL, " ", &rest)) {
        snprintf(path, sizeof path, "%s/%s", dir, name);
        unlink(path);
    }
    rmdir(dir);
}

struct content {
    bool opened, conf;
    unsigned messages, front, last;
    uint64_t first_ns, first_since_ns;
    struct mcap_info info;
};

static struct content read_part(const char *name)
{
    struct content c = {0};
    struct mcap_message m;
    struct mcap_attachment a;
    char path[512];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    struct mcap_reader *r = mcap_open(path, NULL, NULL, &fault);
    if (!r)
        return c;
    c.opened = true;
    c.conf = mcap_find_attachment(r, "sonard.conf", &a, &fault) && a.size == strlen(CONF) &&
             memcmp(a.data, CONF, a.size) == 0;
    while (mcap_next(r, &m)) {
        if (c.messages++ == 0) {
            c.first_ns = m.log_ns;
            c.first_since_ns = m.publish_ns;
        }
        c.front += strcmp(m.channel->topic, "/front/rx") == 0;
        if (m.size >= sizeof c.last)
            memcpy(&c.last, m.data, sizeof c.last);
    }
    c.info = *mcap_info(r);
    mcap_close(r);
    return c;
}

static const struct record_time *at(uint64_t t_ns)
{
    static struct record_time then;
    then = (struct record_time){t_ns, t_ns};
    return &then;
}

/* n messages of 4 kB that do not compress, one each 10 ms; the first four bytes are the number. */
static unsigned feed(struct segments *segments, int channel, unsigned from, unsigned n)
{
    static uint8_t data[4096];
    uint64_t state = from;
    unsigned taken = 0;
    for (unsigned i = from; i < from + n; i++) {
        for (size_t k = 0; k < sizeof data; k += 8) {
            uint64_t v = test_random(&state);
            memcpy(data + k, &v, 8);
        }
        memcpy(data, &i, sizeof i);
        taken += segments_message(segments, channel, at(i * (SECOND / 100)), data, sizeof data);
        segments_tick(segments, i * (SECOND / 100));
    }
    return taken;
}

TEST(one_part_has_channels_configuration_and_unix_times)
{
    make_dir();
    struct segments *segments = open_segments(1 << 20, 8);
    int rx = segments_channel(segments, "/front/rx", "octet-stream"),
        pose = segments_channel(segments, "/pose", "json");
    CHECK(segments_message(segments, rx, &(struct record_time){5 * SECOND, 3 * SECOND}, "BR", 2));
    CHECK(segments_message(segments, pose, at(6 * SECOND), "{}", 2));
    segments_close(segments);
    CHECK_STR(names(), "sonard-20231114T221320Z-001.mcap");
    struct content c = read_part("sonard-20231114T221320Z-001.mcap");
    CHECK_INT(c.messages, 2);
    CHECK_INT(c.front, 1);
    CHECK_INT(c.first_ns, UNIX_OFFSET + 5 * SECOND);
    CHECK_INT(c.first_since_ns, UNIX_OFFSET + 3 * SECOND);
    CHECK(c.conf);
    CHECK(c.info.complete);
    remove_dir();
}

TEST(parts_are_rotated_by_size_and_complete_each)
{
    make_dir();
    struct segments *segments = open_segments(600000, 0);
    int rx = segments_channel(segments, "/front/rx", "octet-stream");
    CHECK_INT(feed(segments, rx, 0, 500), 500);
    unsigned n = (unsigned)segments_status(segments)->segments, total = 0;
    segments_close(segments);
    CHECK(n >= 3);
    for (unsigned i = 1; i <= n; i++) {
        char name[64];
        snprintf(name, sizeof name, "sonard-20231114T221320Z-%03u.mcap", i);
        struct content c = read_part(name);
        CHECK(c.opened && c.conf && c.info.complete);
        CHECK_INT(c.info.problems, 0);
        CHECK_INT(c.front, c.messages);
        CHECK(c.info.file_bytes < 600000 + MCAP_CHUNK_BYTES + 10000);
        total += c.messages;
    }
    CHECK_INT(total, 500);
    remove_dir();
}

TEST(oldest_of_our_parts_are_removed_and_nobody_elses)
{
    static const char *const other[] = {"notes.txt",
                                        "sonard-20200101T000000Z-001.mcap.bak",
                                        "sonard-2020-001.mcap",
                                        "sonard-20200101T000000Z-1.mcap",
                                        "sonard-20200101-000000Z-001.mcap",
                                        "sonard-20200101T000000Z-001.mcap"};
    make_dir();
    for (size_t i = 0; i < sizeof other / sizeof other[0]; i++) {
        char path[512];
        snprintf(path, sizeof path, "%s/%s", dir, other[i]);
        close(open(path, O_WRONLY | O_CREAT | O_CLOEXEC, 0600));
    }
    char folder[512];
    snprintf(folder, sizeof folder, "%s/sonard-20190101T000000Z-001.mcap", dir);
    CHECK(mkdir(folder, 0700) == 0);
    struct segments *segments = open_segments(300000, 2);
    feed(segments, segments_channel(segments, "/front/rx", "octet-stream"), 0, 450);
    CHECK_INT(segments_status(segments)->errors, 0);
    CHECK(rmdir(folder) == 0);
    unsigned n = (unsigned)segments_status(segments)->segments;
    char want[512];
    segments_close(segments);
    CHECK(n > 3);
    snprintf(want, sizeof want,
             "notes.txt sonard-2020-001.mcap sonard-20200101-000000Z-001.mcap "
             "sonard-20200101T000000Z-001.mcap.bak sonard-20200101T000000Z-1.mcap "
             "sonard-20231114T221320Z-%03u.mcap sonard-20231114T221320Z-%03u.mcap",
             n - 1, n);
    CHECK_STR(names(), want);
    remove_dir();
}

TEST(parts_from_the_future_do_not_push_out_this_run)
{
    char path[512];
    make_dir();
    snprintf(path, sizeof path, "%s/sonard-20991231T235959Z-001.mcap", dir);
    close(open(path, O_WRONLY | O_CREAT | O_CLOEXEC, 0600));
    struct segments *segments = open_segments(1 << 20, 1);
    segments_close(segments);
    CHECK_STR(names(), "sonard-20231114T221320Z-001.mcap");
    remove_dir();
}

TEST(second_start_in_the_same_second_takes_the_next_number)
{
    make_dir();
    segments_close(open_segments(1 << 20, 8));
    segments_close(open_segments(1 << 20, 8));
    CHECK_STR(names(), "sonard-20231114T221320Z-001.mcap sonard-20231114T221320Z-002.mcap");
    remove_dir();
}

TEST(process_that_dies_loses_the_last_second_only)
{
    make_dir();
    pid_t child = fork();
    if (child == 0) {
        struct segments *segments = open_segments(1 << 24, 8);
        int rx = segments_channel(segments, "/front/rx", "octet-stream");
        for (unsigned i = 0; i < 100; i++) {
            segments_message(segments, rx, at(i * (SECOND / 10)), &i, sizeof i);
            segments_tick(segments, i * (SECOND / 10));
        }
        _exit(0);
    }
    waitpid(child, NULL, 0);
    struct content c = read_part("sonard-20231114T221320Z-001.mcap");
    CHECK(c.messages >= 88 && c.messages < 100); /* 9.9 s at 10 a second */
    CHECK_INT(c.last, c.messages - 1);
    CHECK(!c.info.complete);
    CHECK_INT(c.info.left_out_bytes, 0);
    CHECK(c.conf);
    remove_dir();
}

TEST(full_disk_stops_recording_and_it_starts_again)
{
    struct rlimit old, small;
    make_dir();
    struct segments *segments = open_segments(1 << 24, 8);
    int rx = segments_channel(segments, "/front/rx", "octet-stream");
    signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old);
    small = old;
    small.rlim_cur = 700000;
    setrlimit(RLIMIT_FSIZE, &small);
    feed(segments, rx, 0, 250);
    const struct segments_status *status = segments_status(segments);
    CHECK(!status->recording);
    CHECK_INT(status->errors, 1);
    CHECK(strstr(status->error.text, "File too large") != NULL);
    CHECK_INT(status->messages, 250);
    setrlimit(RLIMIT_FSIZE, &old);

    struct content c = read_part("sonard-20231114T221320Z-001.mcap");
    CHECK(c.info.complete); /* there was room for the summary */
    CHECK_INT(c.messages + status->lost_messages, 250);

    CHECK(!segments_message(segments, rx, at(50 * SECOND), "x", 1));
    segments_tick(segments, 50 * SECOND);
    CHECK(!status->recording); /* before something is on disk */
    CHECK(segments_message(segments, rx, at(70 * SECOND), "x", 1));
    segments_close(segments);
    c = read_part("sonard-20231114T221320Z-002.mcap");
    CHECK(c.info.complete && c.conf);
    CHECK_INT(c.messages, 1);
    remove_dir();
}

TEST(folder_is_made_or_the_fault_is_said)
{
    make_dir();
    rmdir(dir);
    struct segments *segments = open_segments(1 << 20, 8);
    CHECK(segments != NULL);
    segments_close(segments);
    remove_dir();
    CHECK(segments_open(
              &(struct segments_conf){.directory = "/proc/no/such", .file_size = 1, .files = 1, .conf_text = ""},
              0, &fault) == NULL);
    CHECK_STR(fault.text, "recording to /proc/no/such: making the folder: No such file or directory");
}

TEST(message_over_the_limit_is_lost_and_counted)
{
    static uint8_t big[SEGMENTS_MESSAGE_BYTES + 1];
    make_dir();
    struct segments *segments = open_segments(1 << 24, 8);
    int rx = segments_channel(segments, "/front/rx", "octet-stream");
    CHECK(!segments_message(segments, rx, at(1), big, sizeof big));
    CHECK(segments_message(segments, rx, at(1), big, sizeof big - 1));
    CHECK(!segments_message(segments, rx + 1, at(1), big, 1));
    CHECK_INT(segments_status(segments)->lost_messages, 2);
    CHECK(segments_status(segments)->recording);
    segments_close(segments);
    remove_dir();
}

TEST(a_pause_completes_the_segment_and_the_next_one_goes_on)
{
    make_dir();
    struct segments *segments = open_paused(1 << 24, 8, true);
    const int rx = segments_channel(segments, "/front/rx", "octet-stream");
    CHECK_STR(names(), "");
    CHECK_INT(feed(segments, rx, 0, 10), 10);
    CHECK_INT(segments_status(segments)->messages, 0);
    segments_pause(segments, false, 0);
    CHECK(segments_status(segments)->recording);
    CHECK_INT(feed(segments, rx, 10, 10), 10);
    segments_pause(segments, true, SECOND);
    CHECK(!segments_status(segments)->recording);
    CHECK_INT(feed(segments, rx, 20, 10), 10);
    segments_pause(segments, false, SECOND);
    CHECK_INT(feed(segments, rx, 30, 5), 5);
    segments_close(segments);
    CHECK_STR(names(), "sonard-20231114T221320Z-001.mcap sonard-20231114T221321Z-001.mcap");
    const struct content first = read_part("sonard-20231114T221320Z-001.mcap"),
                         second = read_part("sonard-20231114T221321Z-001.mcap");
    CHECK(first.conf && second.conf);
    CHECK_INT(first.messages, 10);
    CHECK_INT(first.last, 19);
    CHECK_INT(second.messages, 5);
    CHECK_INT(second.last, 34);
    remove_dir();
}

/* A pilot's dives are kept, however many; a single one is limited as ever. */
TEST(on_request_no_recording_pushes_out_another)
{
    make_dir();
    struct segments *segments = open_paused(16384, 2, true);
    const int rx = segments_channel(segments, "/front/rx", "octet-stream");
    for (unsigned dive = 0; dive < 4; dive++) {
        segments_pause(segments, false, dive * SECOND);
        feed(segments, rx, dive * 100, dive == 3 ? 900 : 1);
        segments_pause(segments, true, dive * SECOND + 1);
    }
    segments_close(segments);
    CHECK(strstr(names(), "221320Z-001") && strstr(names(), "221321Z-001") && strstr(names(), "221322Z-001"));
    CHECK(!strstr(names(), "221323Z-001"));
    remove_dir();
}

TEST(after_a_pause_a_folder_that_has_gone_is_made_again)
{
    make_dir();
    struct segments *segments = open_segments(1 << 24, 8);
    const int rx = segments_channel(segments, "/front/rx", "octet-stream");
    segments_pause(segments, true, 0);
    CHECK_STR(names(), "");
    remove_dir();
    segments_pause(segments, false, SECOND);
    CHECK(segments_status(segments)->recording);
    CHECK_INT(feed(segments, rx, 100, 1), 1);
    CHECK_INT(segments_status(segments)->lost_messages, 0);
    segments_close(segments);
    remove_dir();
}

int main(void)
{
    RUN(one_part_has_channels_configuration_and_unix_times);
    RUN(parts_are_rotated_by_size_and_complete_each);
    RUN(oldest_of_our_parts_are_removed_and_nobody_elses);
    RUN(parts_from_the_future_do_not_push_out_this_run);
    RUN(second_start_in_the_same_second_takes_the_next_number);
    RUN(process_that_dies_loses_the_last_second_only);
    RUN(full_disk_stops_recording_and_it_starts_again);
    RUN(folder_is_made_or_the_fault_is_said);
    RUN(message_over_the_limit_is_lost_and_counted);
    RUN(a_pause_completes_the_segment_and_the_next_one_goes_on);
    RUN(on_request_no_recording_pushes_out_another);
    RUN(after_a_pause_a_folder_that_has_gone_is_made_again);
    return test_end();
}
