/* SPDX-License-Identifier: MIT */
/* The mirror with readers that come, go, sleep and write, and its link among files that are not its own. */
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "daemon/input/serial_mirror.h"
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

static char folder[] = "/tmp/sonard-mirror-XXXXXX";
static char path[64];
static struct fault fault;
static uint8_t buf[65536];

static struct serial_mirror *begin(void)
{
    unlink(path);
    struct serial_mirror *mirror = serial_mirror_open(path, &fault);
    if (!mirror) {
        printf("%s\n", fault.text);
        exit(1);
    }
    return mirror;
}

static int listen_to(void)
{
    int fd = open(path, O_RDWR | O_NOCTTY | O_NONBLOCK);
    CHECK(fd >= 0);
    return fd;
}

static struct serial_mirror_status status_of(const struct serial_mirror *mirror)
{
    struct serial_mirror_status s;
    serial_mirror_status(mirror, &s);
    return s;
}

static void mirror_text(struct serial_mirror *mirror, const char *text)
{
    serial_mirror_write(mirror, (const uint8_t *)text, strlen(text));
}

/* The kernel takes its time to carry bytes from one end to the other. */
static ssize_t hear(int fd)
{
    return patience_for(fd, POLLIN) ? read(fd, buf, sizeof buf) : 0;
}

TEST(a_reader_gets_every_byte)
{
    struct serial_mirror *mirror = begin();
    int fd = listen_to();
    uint8_t all[256];
    for (int i = 0; i < 256; i++)
        all[i] = (uint8_t)i;
    serial_mirror_write(mirror, all, sizeof all);
    CHECK_INT(hear(fd), 256);
    CHECK(memcmp(buf, all, 256) == 0);
    CHECK_INT(status_of(mirror).given, 256);
    close(fd);
    serial_mirror_close(mirror);
}

TEST(without_a_reader_nothing_is_kept)
{
    struct serial_mirror *mirror = begin();
    mirror_text(mirror, "before");
    int fd = listen_to();
    mirror_text(mirror, "during");
    CHECK_INT(hear(fd), 6);
    CHECK(memcmp(buf, "during", 6) == 0);
    CHECK_INT(status_of(mirror).dropped, 0);
    close(fd);
    serial_mirror_close(mirror);
}

TEST(readers_follow_one_another)
{
    struct serial_mirror *mirror = begin();
    for (int i = 0; i < 5; i++) {
        int fd = listen_to();
        mirror_text(mirror, "left over");
        mirror_text(mirror, ", all of it");
        close(fd);
        mirror_text(mirror, "nobody hears this");
        fd = listen_to();
        mirror_text(mirror, "new");
        CHECK_INT(hear(fd), 3);
        CHECK(memcmp(buf, "new", 3) == 0);
        close(fd);
        mirror_text(mirror, "nor this");
    }
    serial_mirror_close(mirror);
}

TEST(two_opens_at_a_time_and_one_goes)
{
    struct serial_mirror *mirror = begin();
    int a = listen_to(), b = listen_to();
    close(a);
    mirror_text(mirror, "still");
    CHECK_INT(hear(b), 5);
    close(b);
    serial_mirror_close(mirror);
}

TEST(a_reader_that_sleeps_holds_nobody_up)
{
    struct serial_mirror *mirror = begin();
    int fd = listen_to();
    for (int i = 0; i < 1000; i++)
        serial_mirror_write(mirror, buf, 1000);
    const struct serial_mirror_status s = status_of(mirror);
    CHECK_INT(s.given + s.dropped, 1000000);
    CHECK(s.given >= 1000 && s.dropped > 500000);
    size_t got = 0;
    for (ssize_t n; got < s.given && (n = hear(fd)) > 0;)
        got += (size_t)n;
    CHECK_INT(got, s.given);
    mirror_text(mirror, "awake");
    CHECK_INT(hear(fd), 5);
    close(fd);
    serial_mirror_close(mirror);
}

TEST(what_is_written_is_thrown_away)
{
    struct serial_mirror *mirror = begin();
    int fd = listen_to();
    CHECK_INT(write(fd, "stop\r\n\x03", 7), 7);
    WAIT_UNTIL((mirror_text(mirror, "x"), status_of(mirror).refused >= 7));
    CHECK_INT(status_of(mirror).refused, 7);
    for (uint64_t got = 0; got < status_of(mirror).given;) {
        const ssize_t n = hear(fd);
        for (ssize_t i = 0; i < n; i++)
            CHECK_INT(buf[i], 'x'); /* it is not echoed */
        got += n > 0 ? (uint64_t)n : status_of(mirror).given;
    }
    close(fd);
    serial_mirror_close(mirror);
}

TEST(the_link_goes_with_the_mirror)
{
    struct stat st;
    struct serial_mirror *mirror = begin();
    CHECK(stat(path, &st) == 0 && S_ISCHR(st.st_mode) && (st.st_mode & 0777) == 0660);
    serial_mirror_close(mirror);
    CHECK(lstat(path, &st) < 0);
    serial_mirror_close(NULL);
}

TEST(a_link_to_nowhere_is_replaced)
{
    CHECK(symlink("/dev/pts/999999", path) == 0);
    struct serial_mirror *mirror = serial_mirror_open(path, &fault);
    CHECK(mirror != NULL);
    int fd = listen_to();
    close(fd);
    serial_mirror_close(mirror);
}

TEST(what_is_not_ours_is_left_alone)
{
    struct stat st;
    struct serial_mirror *other = begin();
    CHECK(serial_mirror_open(path, &fault) == NULL); /* another daemon's living mirror */
    CHECK(strstr(fault.text, "remove it") != NULL);
    CHECK(stat(path, &st) == 0 && S_ISCHR(st.st_mode));
    serial_mirror_close(other);

    int file = open(path, O_CREAT | O_WRONLY, 0600);
    close(file);
    CHECK(serial_mirror_open(path, &fault) == NULL);
    CHECK(strstr(fault.text, "not a symbolic link") != NULL);
    CHECK(lstat(path, &st) == 0 && S_ISREG(st.st_mode));
    unlink(path);

    struct serial_mirror *mirror = begin();
    unlink(path);
    CHECK(symlink("/somewhere/else", path) == 0);
    serial_mirror_close(mirror);
    CHECK(lstat(path, &st) == 0);
    unlink(path);
}

TEST(places_where_no_link_can_be)
{
    CHECK(serial_mirror_open("/nowhere/at/all", &fault) == NULL);
    CHECK(strstr(fault.text, "/nowhere/at/all") != NULL);
    char longest[400];
    memset(longest, 'x', sizeof longest);
    longest[0] = '/';
    longest[399] = '\0';
    CHECK(serial_mirror_open(longest, &fault) == NULL);
    CHECK(strstr(fault.text, "longer") != NULL);
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
    RUN(the_link_goes_with_the_mirror);
    RUN(a_link_to_nowhere_is_replaced);
    RUN(what_is_not_ours_is_left_alone);
    RUN(places_where_no_link_can_be);
    unlink(path);
    rmdir(folder);
    return test_end();
}
