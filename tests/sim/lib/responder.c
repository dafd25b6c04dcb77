/* SPDX-License-Identifier: MIT */
/* responder - program of a virtual sonar; see responder.h. */
#include "responder.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "core/fault.h"
#include "pace.h"

#define STATUS_EVERY_NS 1000000000u
#define LINE_OPEN_NS    10000000u /* how often to look whether somebody has opened the line */
#define COMMAND_MAX     256

struct responder {
    const struct responder_ops *ops;
    struct line line;
    const char *link;
    unsigned baud;
    uint64_t seed;
    bool print;
};

static volatile sig_atomic_t stop_wanted;

static void on_stop(int signal)
{
    (void)signal;
    stop_wanted = 1;
}

static bool number_parse(const char *text, double lo, double hi, double *out)
{
    char *end;
    *out = strtod(text, &end);
    return end != text && *end == '\0' && *out >= lo && *out <= hi;
}

/* ---- faults of the line ---- */

enum fault_kind { FAULT_COUNT, FAULT_SECONDS, FAULT_SWITCH };

static const struct line_fault {
    const char *name, *what;
    enum fault_kind kind;
    size_t at; /* in struct line_faults */
} faults[] = {
    {"drop", "the next N frames are lost", FAULT_COUNT, offsetof(struct line_faults, drop)},
    {"corrupt", "the next N frames have a wrong byte", FAULT_COUNT, offsetof(struct line_faults, corrupt)},
    {"short", "the next N frames end in the middle", FAULT_COUNT, offsetof(struct line_faults, cut)},
    {"twice", "the next N frames are sent twice", FAULT_COUNT, offsetof(struct line_faults, twice)},
    {"swap", "the next N frames come behind the one that follows", FAULT_COUNT,
     offsetof(struct line_faults, swap)},
    {"garbage", "N random bytes before the next frame", FAULT_COUNT, offsetof(struct line_faults, garbage)},
    {"silent", "say nothing for S seconds", FAULT_SECONDS, offsetof(struct line_faults, silent_ns)},
    {"stall", "do not read the line for S seconds", FAULT_SECONDS, offsetof(struct line_faults, stall_ns)},
    {"flood", "random bytes without a pause for S seconds", FAULT_SECONDS, offsetof(struct line_faults, flood_ns)},
    {"split", "0 or 1: one byte per write", FAULT_SWITCH, offsetof(struct line_faults, split)},
};

#define N_FAULTS (sizeof faults / sizeof faults[0])

static void line_fault_set(struct line_faults *line, const struct line_fault *fault, double value, uint64_t now_ns)
{
    if (fault->kind == FAULT_SWITCH) {
        line->split = value != 0.0;
        return;
    }
    uint64_t *field = (uint64_t *)(void *)((char *)line + fault->at);
    *field = fault->kind == FAULT_COUNT ? (uint64_t)value : now_ns + (uint64_t)(value * 1e9);
}

/* ---- commands ---- */

static const struct responder_number *number_find(const struct responder *responder, const char *name)
{
    for (const struct responder_number *n = responder->ops->numbers; n->name != NULL; n++)
        if (strcmp(n->name, name) == 0)
            return n;
    return NULL;
}

static const struct line_fault *line_fault_find(const char *name)
{
    for (size_t i = 0; i < N_FAULTS; i++)
        if (strcmp(faults[i].name, name) == 0)
            return &faults[i];
    return NULL;
}

/* NAME X: NULL, or what would be right. */
static const char *command_set(struct responder *responder, const char *name, const char *text)
{
    static char want[128];
    const struct responder_number *number = number_find(responder, name);
    const struct line_fault *fault = line_fault_find(name);
    double value, lo = number ? number->lo : 0, hi = number ? number->hi : 60000;
    if (number == NULL && fault == NULL)
        return "no such command; --help lists them";
    if (!number_parse(text, lo, hi, &value)) {
        snprintf(want, sizeof want, "expected a number in [%g, %g]", lo, hi);
        return want;
    }
    if (number != NULL)
        *number->value = value;
    else
        line_fault_set(&responder->line.faults, fault, value, pace_ns());
    return NULL;
}

static const char *command_plug(struct responder *responder, bool in)
{
    static struct fault fault;
    if ((responder->line.fd >= 0) == in)
        return in ? "is plugged in already" : "is unplugged already";
    if (in)
        return line_plug(&responder->line, &fault) ? NULL : fault.text;
    line_unplug(&responder->line);
    return NULL;
}

static void command_run(struct responder *responder, char *text)
{
    char *save = NULL, *name = strtok_r(text, " \t\r", &save), *value = strtok_r(NULL, " \t\r", &save);
    const char *why;
    if (name == NULL)
        return;
    if (strcmp(name, "status") == 0) {
        printf("ok status ");
        responder->ops->print_status(stdout);
        printf(", %llu bytes sent\n", (unsigned long long)responder->line.sent_bytes);
        fflush(stdout);
        return;
    }
    if (strcmp(name, "quit") == 0) {
        stop_wanted = 1;
        why = NULL;
    } else if (strcmp(name, "plug") == 0 || strcmp(name, "unplug") == 0) {
        why = command_plug(responder, name[0] == 'p');
    } else {
        why = command_set(responder, name, value != NULL ? value : "");
    }
    if (why != NULL)
        printf("error: %s: %s\n", name, why);
    else
        printf("ok %s%s%s\n", name, value != NULL ? " " : "", value != NULL ? value : "");
    fflush(stdout);
}

/* Whole lines from standard input. False at its end: the sonar goes on without. */
static bool input_take(struct responder *responder)
{
    static char text[COMMAND_MAX];
    static size_t held;
    ssize_t n = read(STDIN_FILENO, text + held, sizeof text - 1 - held);
    if (n <= 0)
        return n < 0 && (errno == EINTR || errno == EAGAIN);
    held += (size_t)n;
    text[held] = '\0';
    for (char *newline; (newline = strchr(text, '\n')) != NULL;) {
        *newline = '\0';
        command_run(responder, text);
        held -= (size_t)(newline + 1 - text);
        memmove(text, newline + 1, held + 1);
    }
    if (held == sizeof text - 1)
        held = 0; /* no command is that long */
    return true;
}

/* ---- command line ---- */

static void print_help(const struct responder *responder)
{
    const struct responder_ops *ops = responder->ops;
    printf("%s - %s\n\nOptions:\n", ops->program, ops->about);
    if (!ops->udp_only)
        printf("  --link PATH         a symbolic link to its pseudo-terminal; removed at the end\n"
               "  --baud N            of the line; 0: as the host has set it (0)\n");
    printf("  --udp PORT          UDP port of 127.0.0.1; 0: any that is free\n"
           "  --seed N            of all that is random (1)\n"
           "  --print             status on standard error, every second\n"
           "  --help              this text\n\n"
           "Numbers: --NAME X at the start, NAME X on standard input while it runs, with their first values:\n");
    for (const struct responder_number *n = ops->numbers; n->name != NULL; n++)
        printf("  %-18s  %s (%g)\n", n->name, n->what, *n->value);
    printf("\nFaults, on standard input; each command is answered by \"ok COMMAND\" or \"error: WHY\":\n");
    for (size_t i = 0; i < N_FAULTS; i++)
        printf("  %-18s  %s\n", faults[i].name, faults[i].what);
    printf("  unplug, plug        take the wire away and put it back\n"
           "  status              what the sonar is doing\n"
           "  quit                end, as SIGTERM and SIGINT do\n");
}

__attribute__((noreturn)) static void die(const struct responder *responder, const char *what, const char *why)
{
    fprintf(stderr, "%s: %s: %s\n", responder->ops->program, what, why);
    exit(2);
}

static void options_parse(struct responder *responder, int argc, char **argv, int *udp_port)
{
    for (int i = 1; i < argc; i++) {
        const char *name = strncmp(argv[i], "--", 2) == 0 ? argv[i] + 2 : "";
        const char *text = i + 1 < argc ? argv[i + 1] : "";
        double value = 0.0;
        if (strcmp(name, "help") == 0) {
            print_help(responder);
            exit(0);
        }
        if (strcmp(name, "print") == 0) {
            responder->print = true;
            continue;
        }
        i++;
        if (strcmp(name, "link") == 0) {
            responder->link = text;
            continue;
        }
        const struct responder_number *number = number_find(responder, name);
        double hi = number != NULL ? number->hi : strcmp(name, "udp") == 0 ? 65535 : 4e6;
        if (!number_parse(text, number != NULL ? number->lo : 0, hi, &value))
            die(responder, argv[i - 1], "no such option, or no such number; --help tells the rest");
        if (number != NULL)
            *number->value = value;
        else if (strcmp(name, "udp") == 0)
            *udp_port = (int)value;
        else if (strcmp(name, "baud") == 0)
            responder->baud = (unsigned)value;
        else if (strcmp(name, "seed") == 0)
            responder->seed = (uint64_t)value;
        else
            die(responder, argv[i - 1], "no such option; --help lists them");
    }
}

/* ---- running ---- */

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

/* Take what the host sent, do what is due; when to do it again. */
static uint64_t turn(struct responder *responder, uint64_t now_ns)
{
    uint8_t bytes[4096];
    size_t n;
    while ((n = line_read(&responder->line, bytes, sizeof bytes, now_ns)) > 0)
        responder->ops->feed(&responder->line, bytes, n, now_ns);
    uint64_t due_ns = responder->ops->tick(&responder->line, now_ns);
    due_ns = earlier(due_ns, line_pump(&responder->line, now_ns));
    if (now_ns < responder->line.faults.stall_ns)
        return earlier(due_ns, responder->line.faults.stall_ns);
    return line_connected(&responder->line) ? due_ns : earlier(due_ns, now_ns + LINE_OPEN_NS);
}

static void run(struct responder *responder, const sigset_t *mask)
{
    bool input = true;
    uint64_t next_status_ns = 0;
    while (!stop_wanted) {
        uint64_t now_ns = pace_ns();
        if (responder->print && now_ns >= next_status_ns) {
            fprintf(stderr, "\r");
            responder->ops->print_status(stderr);
            fprintf(stderr, "\033[K");
            next_status_ns = now_ns + STATUS_EVERY_NS;
        }
        uint64_t due_ns = earlier(turn(responder, now_ns), now_ns + STATUS_EVERY_NS);
        /* A line that nobody has open, or that is stalled, would wake us without end. */
        const bool listens = line_connected(&responder->line) && pace_ns() >= responder->line.faults.stall_ns;
        if (pace_wait(input ? STDIN_FILENO : -1, listens ? responder->line.fd : -1, due_ns, mask))
            input = input_take(responder);
    }
    if (responder->print)
        fprintf(stderr, "\n");
}

/* Signals are let in only while waiting, so none is missed. */
static void signals_prepare(sigset_t *waiting)
{
    static const int ending[] = {SIGTERM, SIGINT, SIGHUP};
    struct sigaction action = {.sa_handler = on_stop};
    sigset_t blocked;
    sigemptyset(&blocked);
    for (int i = 0; i < 3; i++) {
        sigaddset(&blocked, ending[i]);
        sigaction(ending[i], &action, NULL);
    }
    sigprocmask(SIG_BLOCK, &blocked, waiting);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGTTIN, SIG_IGN); /* in the background of a shell reading fails, and all goes on without commands */
}

int responder_main(int argc, char **argv, const struct responder_ops *ops)
{
    static struct responder responder;
    sigset_t waiting;
    struct fault fault;
    int udp_port = ops->udp_port;
    responder.ops = ops;
    responder.seed = 1;
    options_parse(&responder, argc, argv, &udp_port);
    signals_prepare(&waiting);
    if (!line_init(&responder.line, responder.link, responder.baud, responder.seed))
        die(&responder, "--link", "the path is too long");
    line_use_udp(&responder.line, udp_port);
    if (!line_plug(&responder.line, &fault))
        die(&responder, "line", fault.text);
    ops->start(responder.seed, pace_ns());
    printf("ready %s\n",
           responder.link != NULL && udp_port == LINE_NO_UDP ? responder.link : responder.line.slave);
    fflush(stdout);
    run(&responder, &waiting);
    line_unplug(&responder.line);
    return 0;
}
