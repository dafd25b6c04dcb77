/* SPDX-License-Identifier: MIT */
/* The tap with readers that come, go, sleep and write, and its link among files that are not its own. */
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "../../daemon/tap.h"
#include "../lib/test.h"

static char folder[] = "/tmp/sonard-tap-XXXXXX";
static char path[64], err[512];
static uint8_t buf[65536];

static struct tap *begin(void)
{
    unlink(path);
    struct tap *tap = tap_open(path, err, sizeof err);
    if (!tap) {
        printf("%s\n", err);
        exit(1);
    }
    return tap;
}

static int listen_to(void)
{
    int fd = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK);
    CHECK(fd >= 0);
    return fd;
}

static struct tap_status status_of(const struct tap *tap)
{
    struct tap_status s;
    tap_status(tap, &s);
    return s;
}

static void mirror(struct tap *tap, const char *text)
{
    tap_mirror(tap, (const uint8_t *)text, strlen(text));
}

TEST(a_reader_gets_every_byte)
{
    struct tap *tap = begin();
    int fd = listen_to();
    uint8_t all[256];
    for (int i = 0; i < 256; i++)
        all[i] = (uint8_t)i;
    tap_mirror(tap, all, sizeof all);
    CHECK_INT(read(fd, buf, sizeof buf), 256);
    CHECK(memcmp(buf, all, 256) == 0);
    CHECK_INT(status_of(tap).given, 256);
    close(fd);
    tap_close(tap);
}

TEST(without_a_reader_nothing_is_kept)
{
    struct tap *tap = begin();
    mirror(tap, "before");
    int fd = listen_to();
    mirror(tap, "during");
    CHECK_INT(read(fd, buf, sizeof buf), 6);
    CHECK(memcmp(buf, "during", 6) == 0);
    CHECK_INT(status_of(tap).dropped, 0);
    close(fd);
    tap_close(tap);
}

TEST(readers_follow_one_another)
{
    struct tap *tap = begin();
    for (int i = 0; i < 5; i++) {
        int fd = listen_to();
        mirror(tap, "left over");
        mirror(tap, ", all of it");
        close(fd);
        mirror(tap, "nobody hears this");
        fd = listen_to();
        mirror(tap, "new");
        CHECK_INT(read(fd, buf, sizeof buf), 3);
        CHECK(memcmp(buf, "new", 3) == 0);
        close(fd);
        mirror(tap, "nor this");
    }
    tap_close(tap);
}

TEST(two_opens_at_a_time_and_one_goes)
{
    struct tap *tap = begin();
    int a = listen_to(), b = listen_to();
    close(a);
    mirror(tap, "still");
    CHECK_INT(read(b, buf, sizeof buf), 5);
    close(b);
    tap_close(tap);
}

TEST(a_reader_that_sleeps_holds_nobody_up)
{
    struct tap *tap = begin();
    int fd = listen_to();
    for (int i = 0; i < 1000; i++)
        tap_mirror(tap, buf, 1000);
    const struct tap_status s = status_of(tap);
    CHECK_INT(s.given + s.dropped, 1000000);
    CHECK(s.given >= 1000 && s.dropped > 500000);
    size_t got = 0;
    for (ssize_t n; (n = read(fd, buf, sizeof buf)) > 0;)
        got += (size_t)n;
    CHECK(got >= 1000 && got <= s.given);
    mirror(tap, "awake");
    CHECK_INT(read(fd, buf, sizeof buf), 5);
    close(fd);
    tap_close(tap);
}

TEST(what_is_written_is_thrown_away)
{
    struct tap *tap = begin();
    int fd = listen_to();
    CHECK_INT(write(fd, "stop\r\n\x03", 7), 7);
    mirror(tap, "x");
    CHECK_INT(read(fd, buf, sizeof buf), 1); /* and is not echoed */
    CHECK_INT(status_of(tap).refused, 7);
    close(fd);
    tap_close(tap);
}

TEST(the_link_goes_with_the_tap)
{
    struct stat st;
    struct tap *tap = begin();
    CHECK(stat(path, &st) == 0 && S_ISCHR(st.st_mode) && (st.st_mode & 0777) == 0660);
    tap_close(tap);
    CHECK(lstat(path, &st) < 0);
    tap_close(NULL);
}

TEST(a_link_to_nowhere_is_replaced)
{
    CHECK(symlink("/dev/pts/999999", path) == 0);
    struct tap *tap = tap_open(path, err, sizeof err);
    CHECK(tap != NULL);
    int fd = listen_to();
    close(fd);
    tap_close(tap);
}

TEST(what_is_not_ours_is_left_alone)
{
    struct stat st;
    struct tap *other = begin();
    CHECK(tap_open(path, err, sizeof err) == NULL); /* another daemon's living tap */
    CHECK(strstr(err, "remove it") != NULL);
    CHECK(stat(path, &st) == 0 && S_ISCHR(st.st_mode));
    tap_close(other);

    int file = open(path, O_CREAT | O_WRONLY, 0600);
    close(file);
    CHECK(tap_open(path, err, sizeof err) == NULL);
    CHECK(strstr(err, "no symbolic link") != NULL);
    CHECK(lstat(path, &st) == 0 && S_ISREG(st.st_mode));
    unlink(path);

    struct tap *tap = begin();
    unlink(path);
    CHECK(symlink("/somewhere/else", path) == 0);
    tap_close(tap);
    CHECK(lstat(path, &st) == 0);
    unlink(path);
}

TEST(places_where_no_link_can_be)
{
    CHECK(tap_open("/nowhere/at/all", err, sizeof err) == NULL);
    CHECK(strstr(err, "/nowhere/at/all") != NULL);
    char longest[400];
    memset(longest, 'x', sizeof longest);
    longest[0] = '/';
    longest[399] = '\0';
    CHECK(tap_open(longest, err, sizeof err) == NULL);
    CHECK(strstr(err, "longer") != NULL);
}

int main(void)
{
    if (!mkdtemp(folder))
        return 1;
    snprintf(path, sizeof path, "%s/front.tty", folder);
    RUN(a_reader_gets_every_byte);
    RUN(without_a_reader_nothing_is_kept);
    RUN(readers_follow_one_another);
    RUN(two_opens_at_a_time_and_one_goes);
    RUN(a_reader_that_sleeps_holds_nobody_up);
    RUN(what_is_written_is_thrown_away);
    RUN(the_link_goes_with_the_tap);
    RUN(a_link_to_nowhere_is_replaced);
    RUN(what_is_not_ours_is_left_alone);
    RUN(places_where_no_link_can_be);
    unlink(path);
    rmdir(folder);
    return test_end();
}
