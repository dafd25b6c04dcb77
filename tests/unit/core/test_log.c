/* SPDX-License-Identifier: MIT */
/* test_log - lines of the log: to the journal as its native protocol has them, to standard error without it, and held
 * back by kind. Standard error is a file here. */
#include "tests/lib/test.h"

#include <fcntl.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "core/log.h"

#define SECOND 1000000000ull

static char folder[] = "/tmp/sonard-log-XXXXXX", file[64], place[64];
static int journal = -1, terminal;

/* Standard error goes to a file that JOURNAL_STREAM names; the journal's socket is there, or only the file. */
static void begin(bool listens)
{
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    struct stat st;
    char stream[64];
    snprintf(address.sun_path, sizeof address.sun_path, "%s", place);
    journal = -1;
    if (listens) {
        journal = socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
        CHECK(bind(journal, (struct sockaddr *)&address, sizeof address) == 0);
    }
    const int fd = open(file, O_RDWR | O_CREAT | O_TRUNC, 0600);
    terminal = dup(STDERR_FILENO);
    dup2(fd, STDERR_FILENO);
    close(fd);
    CHECK(fstat(STDERR_FILENO, &st) == 0);
    snprintf(stream, sizeof stream, "%llu:%llu", (unsigned long long)st.st_dev, (unsigned long long)st.st_ino);
    setenv("JOURNAL_STREAM", stream, 1);
    setenv("SONARD_JOURNAL", place, 1);
    log_set_level(LOG_INFO);
    log_open();
}

static void end(void)
{
    log_flush(UINT64_MAX);
    dup2(terminal, STDERR_FILENO);
    close(terminal);
    if (journal >= 0)
        close(journal);
    unlink(place);
    unlink(file);
}

/* The next entry, its NUL bytes kept; its length, 0: none is there. */
static size_t entry(char *bytes, size_t size)
{
    const ssize_t n = recv(journal, bytes, size - 1, 0);
    bytes[n > 0 ? n : 0] = '\0';
    return n > 0 ? (size_t)n : 0;
}

static const char *written(void)
{
    static char text[4096];
    const ssize_t n = pread(STDERR_FILENO, text, sizeof text - 1, 0);
    text[n > 0 ? n : 0] = '\0';
    return text;
}

TEST(an_entry_has_its_fields)
{
    char e[4096];
    begin(true);
    log_sonar(LOG_WARNING, "port_lost", "front", "%s: lost", "serial:x");
    CHECK(entry(e, sizeof e) > 0);
    CHECK(strstr(e, "MESSAGE=front: serial:x: lost\nPRIORITY=4\nSYSLOG_IDENTIFIER=sonard\nSONARD_EVENT=port_lost\n"
                    "SONARD_SONAR=front\nCODE_FILE=") == e);
    CHECK(strstr(e, "test_log.c\nCODE_LINE="));
    CHECK(strstr(e, "\nCODE_FUNC="));
    CHECK(!strstr(e, "SONARD_COUNT"));
    log_counted(LOG_ERR, "record_lost", 7, "seven");
    CHECK(entry(e, sizeof e) > 0);
    CHECK(strstr(e, "\nPRIORITY=3\n") && strstr(e, "\nSONARD_COUNT=7\n") && !strstr(e, "SONARD_SONAR"));
    log_line(LOG_DEBUG, "started", "below the level");
    CHECK_INT(entry(e, sizeof e), 0);
    CHECK_STR(written(), "");
    end();
}

TEST(a_line_feed_forges_no_field)
{
    static const char want[] = "MESSAGE=ends?PRIORITY=0?\nPRIORITY=6\n";
    char e[4096];
    begin(true);
    log_line(LOG_INFO, "device", "%s", "ends\nPRIORITY=0\n");
    CHECK(entry(e, sizeof e) >= sizeof want - 1);
    CHECK(memcmp(e, want, sizeof want - 1) == 0);
    end();
}

TEST(a_line_feed_forges_no_line)
{
    begin(false);
    log_line(LOG_INFO, "device", "%s", "maps/a\nsonard: error: leak: \xfc.map");
    CHECK_STR(written(), "<6>maps/a?sonard: error: leak: ?.map\n");
    end();
}

TEST(a_long_line_is_cut)
{
    char e[4096], most[3000];
    memset(most, 'x', sizeof most - 1);
    most[sizeof most - 1] = '\0';
    begin(true);
    log_sonar(LOG_INFO, "device", "front", "%s", most);
    CHECK(entry(e, sizeof e) > 0);
    CHECK_INT(strcspn(e, "\n"), strlen("MESSAGE=") + LOG_TEXT_MAX - 1);
    CHECK(strstr(e, "\nSONARD_SONAR=front\n") && strstr(e, "\nCODE_FUNC="));
    end();
}

TEST(without_the_journals_socket_priorities_go_to_standard_error)
{
    begin(false);
    log_sonar(LOG_NOTICE, "port_open", "front", "open");
    CHECK_STR(written(), "<5>front: open\n");
    end();
}

TEST(a_journal_that_ends_loses_no_line)
{
    char e[4096];
    begin(true);
    log_line(LOG_NOTICE, "started", "one");
    CHECK(entry(e, sizeof e) > 0);
    close(journal);
    journal = -1;
    log_line(LOG_NOTICE, "started", "two");
    CHECK_STR(written(), "<5>two\n");
    end();
}

TEST(somebody_elses_journal_gets_nothing)
{
    begin(true);
    setenv("JOURNAL_STREAM", "1:1", 1);
    log_open();
    char e[4096];
    log_line(LOG_NOTICE, "started", "in words");
    CHECK_INT(entry(e, sizeof e), 0);
    CHECK_STR(written(), "sonard: notice: in words\n");
    end();
}

static void say(uint64_t t_ns, const char *event, const char *sonar)
{
    log_limited(t_ns, LOG_WARNING, LOG_ABOUT(.event = event, .sonar = sonar), "x");
}

static int entries(void)
{
    char e[4096];
    int n = 0;
    while (entry(e, sizeof e))
        n++;
    return n;
}

TEST(of_each_kind_five_in_ten_seconds)
{
    char e[4096];
    begin(true);
    for (int i = 0; i < 12; i++)
        say(100 * SECOND, "device", "front");
    CHECK_INT(entries(), 5);
    say(100 * SECOND, "device", "rear"); /* another sonar's, another event's: kinds of their own */
    say(100 * SECOND, "client_cut", NULL);
    CHECK_INT(entries(), 2);
    log_flush(109 * SECOND);
    CHECK_INT(entries(), 0);
    log_flush(110 * SECOND); /* nothing more has to happen for the count to be said */
    CHECK(entry(e, sizeof e) > 0);
    CHECK(strstr(e, "MESSAGE=front: suppressed 7 similar \"device\" messages\nPRIORITY=4\n") == e);
    CHECK(strstr(e, "\nSONARD_EVENT=device\nSONARD_SONAR=front\nSONARD_COUNT=7\n"));
    CHECK_INT(entries(), 0);
    for (int i = 0; i < 12; i++)
        say(120 * SECOND, "device", "front");
    CHECK_INT(entries(), 5);
    say(131 * SECOND, "device", "front"); /* the count, then the line */
    CHECK_INT(entries(), 2);
    end();
}

TEST(more_kinds_than_are_watched_lose_no_count)
{
    char names[200][16], e[4096];
    unsigned long long lines = 0, held = 0;
    begin(true);
    for (int i = 0; i < 200; i++) {
        snprintf(names[i], sizeof names[i], "s%d", i);
        for (int k = 0; k < 8; k++) {
            say((uint64_t)(i + 1), "device", names[i]);
            while (entry(e, sizeof e)) { /* before the socket's queue is full */
                const char *count = strstr(e, "SONARD_COUNT=");
                held += count ? strtoull(count + strlen("SONARD_COUNT="), NULL, 10) : 0;
                lines += !count;
            }
        }
    }
    log_set_level(LOG_INFO);
    for (uint64_t t = 1; t <= 200; t++) {
        log_flush(t + 10 * SECOND);
        while (entry(e, sizeof e))
            held += strtoull(strstr(e, "SONARD_COUNT=") + strlen("SONARD_COUNT="), NULL, 10);
    }
    CHECK_INT(lines, 200 * 5);
    CHECK_INT(held, 200 * 3);
    end();
}

int main(void)
{
    if (!mkdtemp(folder))
        return 1;
    snprintf(file, sizeof file, "%s/stderr", folder);
    snprintf(place, sizeof place, "%s/journal", folder);
    RUN(an_entry_has_its_fields);
    RUN(a_line_feed_forges_no_field);
    RUN(a_line_feed_forges_no_line);
    RUN(a_long_line_is_cut);
    RUN(without_the_journals_socket_priorities_go_to_standard_error);
    RUN(a_journal_that_ends_loses_no_line);
    RUN(somebody_elses_journal_gets_nothing);
    RUN(of_each_kind_five_in_ten_seconds);
    RUN(more_kinds_than_are_watched_lose_no_count);
    rmdir(folder);
    return test_end();
}
