/* SPDX-License-Identifier: MIT */
/*
 * nmea_sim - a virtual compass and depth cell that speaks NMEA 0183 on a pseudo-terminal, for tests and for people
 * without one. Commands on standard input, one per line, each answered by one line on standard output.
 */
#include <poll.h>
#include <signal.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "core/fault.h"
#include "tests/sim/lib/console.h"
#include "tests/sim/lib/line.h"

#define NEVER -1.0

struct sim {
    struct line line;
    double heading_deg, magnetic_deg, depth_m; /* NEVER: not told */
    double rate_hz, turn_dps;
    long bad_checksum;
    unsigned long sentences;
};

static volatile sig_atomic_t stop_wanted;

static void on_stop(int signal)
{
    (void)signal;
    stop_wanted = 1;
}

static uint64_t clock_ns(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (uint64_t)t.tv_sec * 1000000000u + (uint64_t)t.tv_nsec;
}

/* The line itself does the faults of lines: drop, corrupt, cut, garbage, split. */
static void say(struct sim *s, const char *body)
{
    char text[128];
    unsigned sum = 0;
    for (const char *c = body; *c; c++)
        sum ^= (unsigned char)*c;
    sum ^= s->bad_checksum > 0;
    s->bad_checksum -= s->bad_checksum > 0;
    int n = snprintf(text, sizeof text, "$%s*%02X\r\n", body, sum);
    line_send(&s->line, (const uint8_t *)text, (size_t)n, clock_ns());
    s->sentences++;
}

static void say_all(struct sim *s)
{
    char body[96];
    if (s->heading_deg >= 0) {
        snprintf(body, sizeof body, "GPHDT,%.2f,T", s->heading_deg);
        say(s, body);
    }
    if (s->magnetic_deg >= 0) {
        snprintf(body, sizeof body, "HCHDG,%.1f,0.0,E,,", s->magnetic_deg);
        say(s, body);
    }
    if (s->depth_m >= 0) {
        snprintf(body, sizeof body, "SDDPT,%.2f,0.0", s->depth_m);
        say(s, body);
    }
}

static bool command(void *ctx, const char *text)
{
    struct sim *s = ctx;
    struct line_faults *f = &s->line.faults;
    char word[32] = "";
    struct fault fault;
    double a = 0;
    int n = sscanf(text, "%31s %lf", word, &a);
    const struct {
        const char *name;
        double *value;
    } values[] = {{"heading", &s->heading_deg},
                  {"magnetic", &s->magnetic_deg},
                  {"depth", &s->depth_m},
                  {"rate", &s->rate_hz},
                  {"turn", &s->turn_dps}};
    const struct {
        const char *name;
        uint64_t *count;
    } faults[] = {{"drop", &f->drop}, {"corrupt", &f->corrupt}, {"cut", &f->cut}, {"garbage", &f->garbage}};
    if (n < 1)
        return false;
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++)
        if (strcmp(word, values[i].name) == 0)
            return n == 2 ? (*values[i].value = a, true) : false;
    for (size_t i = 0; i < sizeof faults / sizeof faults[0]; i++)
        if (strcmp(word, faults[i].name) == 0)
            return *faults[i].count = n == 2 && a > 0 ? (uint64_t)a : 1, true;
    if (strcmp(word, "bad_checksum") == 0)
        s->bad_checksum = n == 2 ? (long)a : 1;
    else if (strcmp(word, "say") == 0 && strlen(text) > 4)
        say(s, text + 4);
    else if (strcmp(word, "split") == 0)
        f->split = true;
    else if (strcmp(word, "unplug") == 0)
        line_unplug(&s->line);
    else if (strcmp(word, "plug") == 0)
        return line_plug(&s->line, &fault);
    else
        return strcmp(word, "status") == 0 || (stop_wanted = strcmp(word, "quit") == 0);
    return true;
}

static const char *status(void *ctx)
{
    static char text[64];
    const struct sim *s = ctx;
    snprintf(text, sizeof text, "%lu sentences", s->sentences);
    return text;
}

static void run(struct sim *s)
{
    uint64_t next_ns = clock_ns();
    while (!stop_wanted) {
        uint64_t now_ns = clock_ns(), due_ns = line_pump(&s->line, now_ns);
        uint8_t waste[256];
        if (now_ns >= next_ns && line_connected(&s->line)) {
            say_all(s);
            s->heading_deg += s->heading_deg >= 0 ? s->turn_dps / s->rate_hz : 0;
            s->heading_deg -= s->heading_deg >= 360 ? 360 : 0;
        }
        if (now_ns >= next_ns)
            next_ns = now_ns + (uint64_t)(1e9 / s->rate_hz);
        line_read(&s->line, waste, sizeof waste, now_ns);
        if (next_ns < due_ns)
            due_ns = next_ns;
        struct pollfd input = {0, POLLIN, 0};
        if (poll(&input, 1, due_ns > now_ns ? (int)((due_ns - now_ns) / 1000000 + 1) : 0) > 0 &&
            !console_read(command, status, s))
            return;
    }
}

static const char usage[] =
    "nmea_sim LINK    a compass and depth cell on a pseudo-terminal named LINK\n\n"
    "Commands on standard input:\n"
    "  heading DEG, magnetic DEG, depth M     told in HDT, HDG, DPT; -1: not told (heading 0)\n"
    "  rate HZ, turn DEG/S                    (10, 0)\n"
    "  drop|corrupt|cut|garbage|bad_checksum [N]   of the next sentences, of the next bytes\n"
    "  split              one byte per write\n"
    "  say BODY           once, with $ and checksum added\n"
    "  unplug, plug       the adapter\n"
    "  status, quit\n";

int main(int argc, char **argv)
{
    static struct sim s = {.magnetic_deg = NEVER, .depth_m = NEVER, .rate_hz = 10};
    struct fault fault = {"the name is too long"};
    if (argc != 2) {
        fputs(usage, stderr);
        return 2;
    }
    if (!line_init(&s.line, argv[1], 0, 1) || !line_plug(&s.line, &fault)) {
        fprintf(stderr, "nmea_sim: %s\n", fault.text);
        return 1;
    }
    struct sigaction stop = {.sa_handler = on_stop};
    sigaction(SIGTERM, &stop, NULL);
    sigaction(SIGINT, &stop, NULL);
    printf("ready %s\n", argv[1]);
    fflush(stdout);
    run(&s);
    line_unplug(&s.line);
    return 0;
}
