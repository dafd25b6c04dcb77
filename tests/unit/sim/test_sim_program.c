/* SPDX-License-Identifier: MIT */
/* test_sim_program - the virtual Ping360 as a program: a scripted exchange over its pseudo-terminal, its commands and
 * its faults. */
#include "tests/lib/patience.h"
#include "tests/lib/test.h"

#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <poll.h>
#include <signal.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include "drivers/devices/ping_frame.h"

static const struct ping360_settings settings_20m = {.mode = 1,
                                                     .gain = 1,
                                                     .angle = 200,
                                                     .transmit_us = 107,
                                                     .sample_period = 888,
                                                     .frequency_khz = 750,
                                                     .n_samples = 1200};

struct program {
    pid_t pid;
    int to, from; /* its standard input and output */
    char folder[64], link[80];
    char held[1024]; /* output not yet read as a line */
    size_t n;
};

/* One line of the program's output; empty after a long silence or at its end. */
static const char *program_line(struct program *p)
{
    static char line[256];
    char *newline;
    while ((newline = memchr(p->held, '\n', p->n)) == NULL) {
        ssize_t got = patience_for(p->from, POLLIN) ? read(p->from, p->held + p->n, sizeof p->held - p->n) : 0;
        if (got <= 0)
            return "";
        p->n += (size_t)got;
    }
    size_t length = (size_t)(newline - p->held);
    snprintf(line, sizeof line, "%.*s", (int)length, p->held);
    p->n -= length + 1;
    memmove(p->held, newline + 1, p->n);
    return line;
}

/* The sim stands beside this program. */
static void program_start(struct program *p)
{
    char self[PATH_MAX], path[PATH_MAX + 16];
    int to[2], from[2];
    ssize_t n = readlink("/proc/self/exe", self, sizeof self - 1);
    memset(p, 0, sizeof *p);
    self[n > 0 ? n : 0] = '\0';
    snprintf(path, sizeof path, "%s/ping360_sim", dirname(self));
    strcpy(p->folder, "/tmp/sonard-test-sim-XXXXXX");
    CHECK(mkdtemp(p->folder) != NULL);
    snprintf(p->link, sizeof p->link, "%s/tty", p->folder);
    if (pipe(to) != 0 || pipe(from) != 0 || (p->pid = fork()) < 0) {
        perror("program_start");
        exit(1);
    }
    if (p->pid == 0) {
        dup2(to[0], STDIN_FILENO);
        dup2(from[1], STDOUT_FILENO);
        close(to[0]);
        close(to[1]);
        close(from[0]);
        close(from[1]);
        execl(path, path, "--link", p->link, "--ms-per-gradian", "0", "--processing-ms", "0", (char *)NULL);
        perror(path);
        _exit(127);
    }
    close(to[0]);
    close(from[1]);
    p->to = to[1];
    p->from = from[0];
}

/* A command, and the line that answers it. */
static const char *program_say(struct program *p, const char *command)
{
    dprintf(p->to, "%s\n", command);
    return program_line(p);
}

/* access() would follow it to a terminal that is gone anyway. */
static bool link_exists(const struct program *p)
{
    char target[8];
    return readlink(p->link, target, sizeof target) >= 0;
}

/* Its exit status; the link must be gone. */
static int program_stop(struct program *p)
{
    int status;
    kill(p->pid, SIGTERM);
    waitpid(p->pid, &status, 0);
    close(p->to);
    close(p->from);
    CHECK(!link_exists(p));
    CHECK_INT(rmdir(p->folder), 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

static int host_open(const struct program *p)
{
    struct termios tio;
    int fd = open(p->link, O_RDWR | O_NOCTTY | O_NONBLOCK);
    if (fd >= 0 && tcgetattr(fd, &tio) == 0) {
        cfmakeraw(&tio);
        cfsetspeed(&tio, B921600);
        tcsetattr(fd, TCSANOW, &tio);
    }
    return fd;
}

/* Id of the next good frame; 0 when none comes, -1 when the line hangs up. */
static int host_frame(int fd, struct ping_parser *parser)
{
    uint8_t byte;
    struct ping_frame frame;
    while (patience_for(fd, POLLIN)) {
        const uint8_t *bytes = &byte;
        size_t n = 1;
        if (read(fd, &byte, 1) != 1)
            return -1;
        if (ping_parser_next(parser, &bytes, &n, 0, &frame))
            return frame.id;
    }
    return 0;
}

static void host_send(int fd, uint16_t request)
{
    uint8_t frame[PING_FRAME_MAX];
    size_t n = ping_encode_request(frame, sizeof frame, request);
    CHECK_INT(write(fd, frame, n), n);
}

static int host_ask(int fd, struct ping_parser *parser, uint16_t request)
{
    host_send(fd, request);
    return host_frame(fd, parser);
}

static int host_ping(int fd, struct ping_parser *parser)
{
    uint8_t frame[PING_FRAME_MAX];
    size_t n = ping360_encode_transducer(frame, sizeof frame, &settings_20m, true);
    if (write(fd, frame, n) != (ssize_t)n)
        return -1;
    return host_frame(fd, parser);
}

TEST(program_speaks_over_its_terminal_and_makes_faults)
{
    struct program p;
    struct ping_parser parser;
    char ready[128];
    ping_parser_init(&parser, PING_PAYLOAD_MAX);
    program_start(&p);
    snprintf(ready, sizeof ready, "ready %s", p.link);
    CHECK_STR(program_line(&p), ready);
    int fd = host_open(&p);
    CHECK(fd >= 0);
    CHECK_INT(host_ask(fd, &parser, PING_DEVICE_INFORMATION), PING_DEVICE_INFORMATION);
    CHECK_INT(host_ping(fd, &parser), PING360_DEVICE_DATA);

    CHECK_STR(program_say(&p, "split on"), "ok split on");
    CHECK_INT(host_ping(fd, &parser), PING360_DEVICE_DATA);
    CHECK_STR(program_say(&p, "nack 1"), "ok nack 1");
    CHECK_INT(host_ping(fd, &parser), PING_NACK);
    CHECK_STR(program_say(&p, "garbage 100"), "ok garbage 100");
    uint64_t garbage = parser.garbage_bytes;
    CHECK_INT(host_ping(fd, &parser), PING360_DEVICE_DATA);
    CHECK(parser.garbage_bytes >= garbage + 90);
    CHECK_STR(program_say(&p, "drop 1"), "ok drop 1");
    host_send(fd, PING_DEVICE_INFORMATION); /* is not answered: the next good frame is of the next request */
    CHECK_INT(host_ask(fd, &parser, PING_PROTOCOL_VERSION), PING_PROTOCOL_VERSION);
    CHECK_STR(program_say(&p, "corrupt 1"), "ok corrupt 1");
    host_send(fd, PING_PROTOCOL_VERSION);
    CHECK_INT(host_ask(fd, &parser, PING_DEVICE_INFORMATION), PING_DEVICE_INFORMATION);
    CHECK_STR(program_say(&p, "drop many"), "error: drop needs: drop N (0 to 1e+06)");
    CHECK_STR(program_say(&p, "dance"), "error: 'dance' is no command; --help lists them");
    close(fd);
    CHECK_INT(program_stop(&p), 0);
}

TEST(program_is_unplugged_and_plugged_in_again)
{
    struct program p;
    struct ping_parser parser;
    ping_parser_init(&parser, PING_PAYLOAD_MAX);
    program_start(&p);
    program_line(&p);
    int fd = host_open(&p);
    CHECK_INT(host_ask(fd, &parser, PING_DEVICE_INFORMATION), PING_DEVICE_INFORMATION);
    CHECK_STR(program_say(&p, "unplug"), "ok unplug");
    CHECK(!link_exists(&p));
    CHECK_INT(host_frame(fd, &parser), -1);
    close(fd);
    CHECK_STR(program_say(&p, "plug"), "ok plug");
    fd = host_open(&p);
    CHECK_INT(host_ask(fd, &parser, PING_DEVICE_INFORMATION), PING_DEVICE_INFORMATION);
    close(fd);
    CHECK_INT(program_stop(&p), 0);
}

int main(void)
{
    signal(SIGPIPE, SIG_IGN);
    RUN(program_speaks_over_its_terminal_and_makes_faults);
    RUN(program_is_unplugged_and_plugged_in_again);
    return test_end();
}
