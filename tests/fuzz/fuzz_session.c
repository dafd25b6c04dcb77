/* SPDX-License-Identifier: MIT */
/*
 * fuzz_session - any bytes as what a client sends to the whole daemon, with all its methods: it plays a capture of a
 * Ping360 in a round basin once, and stays. Every line that comes back is JSON, what the client asks last is answered
 * unless it had the capture played anew, and the next client is served.
 */
#include <dirent.h>
#include <fcntl.h>
#include <jansson.h>
#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include "daemon/replay.h"

static _Atomic unsigned anew; /* how often the capture was begun again */

static bool counted_again(struct replay *r, struct fault *fault)
{
    const bool again = replay_again(r, fault);
    anew += again;
    return again;
}

#define main         sonard_main
#define replay_again counted_again
#include "daemon/main.c"
#undef main
#undef replay_again

#include "drivers/capture/mcap.h"

#define START_NS   1700000000000000000u
#define BINS       200
#define ANGLES     400 /* of a turn */
#define TIDY_EVERY 100
#define PATIENCE   1000 /* times 10 ms */
#define ASK(id)    "\n{\"jsonrpc\":\"2.0\",\"id\":\"" id "\",\"method\":\"version\"}\n"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char conf_text[] = "[log]\nlevel = err\n"
                                "[sonar head]\ndevice = ping360\nport = serial:/dev/none:115200\nrange = 10 m\n"
                                "[vehicle]\nmax_speed = 1 m/s\n"
                                "[map]\nvoxel = 0.2 m\nmemory = 8 MiB\nextent = 40 m\ndirectory = ";

static char folder[] = "/tmp/sonard-fuzz-session-XXXXXX";
static char conf_path[64], capture_path[64], socket_path[64];

/* The maps and exports that the fuzzer asked for would fill the disk; all: the rest as well, and the folder. */
static void tidy(bool all)
{
    DIR *dir = opendir(folder);
    char file[300];
    for (const struct dirent *e; dir && (e = readdir(dir));) {
        const bool ours =
            strcmp(e->d_name, "conf") == 0 || strcmp(e->d_name, "a.mcap") == 0 || strcmp(e->d_name, "socket") == 0;
        snprintf(file, sizeof file, "%s/%s", folder, e->d_name);
        if (all || !ours)
            unlink(file);
    }
    if (dir)
        closedir(dir);
    if (all)
        rmdir(folder);
}

static void tidy_all(void)
{
    tidy(true);
}

static void put16(uint8_t *out, unsigned value)
{
    out[0] = (uint8_t)value;
    out[1] = (uint8_t)(value >> 8);
}

/* What a Ping360 sends of one ping: ring-down, silence, a wall, silence. Returns its bytes. */
static size_t frame(uint8_t out[22 + BINS + 2], unsigned angle)
{
    uint8_t *payload = out + 8;
    unsigned sum = 0;
    memcpy(out, "BR", 2);
    put16(out + 2, 14 + BINS);
    put16(out + 4, 2300);
    put16(out + 6, 2); /* from device 2 to 0 */
    put16(payload, 1); /* mode, gain */
    put16(payload + 2, angle);
    put16(payload + 4, 11);   /* transmit duration */
    put16(payload + 6, 2666); /* sample period */
    put16(payload + 8, 750);  /* frequency in kHz */
    put16(payload + 10, BINS);
    put16(payload + 12, BINS);
    memset(payload + 14, 10, BINS);
    memset(payload + 14, 255, 8);
    memset(payload + 14 + 120, 200, 4);
    for (size_t i = 0; i < 22 + BINS; i++)
        sum += out[i];
    put16(out + 22 + BINS, sum);
    return 22 + BINS + 2;
}

static void write_capture(void)
{
    struct fault fault;
    uint8_t bytes[22 + BINS + 2];
    const int fd = open(capture_path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    struct mcap_writer *w = fd >= 0 ? mcap_create(fd, &(struct mcap_options){.library = "fuzz"}, &fault) : NULL;
    if (!w)
        abort();
    const int rx = mcap_add_channel(w, "/head/rx", "octet-stream", NULL, 0, &fault);
    const int pose = mcap_add_channel(w, "/pose", "json", NULL, 0, &fault);
    for (unsigned k = 0; k < 2 * ANGLES; k++) {
        const uint64_t t_ns = START_NS + k * (uint64_t)30000000;
        char text[160];
        const int n =
            snprintf(text, sizeof text, "{\"t_unix\":%.6f,\"attitude_deg\":[0,0,90],\"position_m\":[%.3f,0,5]}",
                     (double)t_ns * 1e-9, 0.001 * k);
        struct mcap_message message = {
            .log_ns = t_ns, .publish_ns = t_ns, .data = (const uint8_t *)text, .size = (size_t)n};
        if (!mcap_write_message(w, pose, &message, &fault))
            abort();
        message.data = bytes;
        message.size = frame(bytes, k % ANGLES);
        if (!mcap_write_message(w, rx, &message, &fault))
            abort();
    }
    if (!mcap_finish(w, &fault))
        abort();
}

static void *daemon_thread(void *ctx)
{
    char *arguments[] = {"sonard", "-c",       conf_path,   "--replay", capture_path,
                         "--stay", "--socket", socket_path, NULL};
    (void)ctx;
    sonard_main((int)(sizeof arguments / sizeof *arguments) - 1, arguments);
    abort(); /* it stays */
}

/* -1: nobody listens yet. */
static int connected(void)
{
    struct sockaddr_un to = {.sun_family = AF_UNIX};
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
    snprintf(to.sun_path, sizeof to.sun_path, "%s", socket_path);
    if (fd >= 0 && connect(fd, (const struct sockaddr *)&to, sizeof to) == 0)
        return fd;
    close(fd);
    return -1;
}

static void send_all(int fd, const void *data, size_t n)
{
    for (const char *at = data; n > 0;) {
        const ssize_t sent = send(fd, at, n, MSG_NOSIGNAL);
        if (sent <= 0)
            return; /* it was cut off: judged by what it reads */
        at += sent;
        n -= (size_t)sent;
    }
}

/* Reads to the answer to the request with this id. *ended: the replay is over. False: the daemon has closed before. */
static bool read_to(FILE *in, const char *wanted, bool *ended)
{
    char *line = NULL;
    size_t room = 0;
    bool there = false;
    while (!there && getline(&line, &room, in) > 0) {
        json_t *answer = json_loads(line, 0, NULL);
        if (!answer)
            abort();
        const char *id = json_string_value(json_object_get(answer, "id"));
        const char *mode = json_string_value(json_object_get(json_object_get(answer, "result"), "mode"));
        *ended |= mode && strcmp(mode, "replay, ended") == 0;
        there = id && strcmp(id, wanted) == 0;
        json_decref(answer);
    }
    free(line);
    return there;
}

/* Waits until the daemon listens: a jump back ends that for a moment. */
static int connect_in_time(void)
{
    int fd, left = PATIENCE;
    while ((fd = connected()) < 0) {
        if (left-- == 0)
            abort();
        usleep(10000);
    }
    return fd;
}

/* The daemon has closed the connection: it is to begin anew. */
static void wait_for_it(unsigned before)
{
    for (int left = PATIENCE; anew == before; left--) {
        if (left == 0)
            abort();
        usleep(10000);
    }
}

/*
 * Is the replay over? Between the two last requests come the notifications of what is watched. That the last one is
 * answered is no promise that the daemon stays: it may be read in the same turn of the loop as a jump back, and the
 * loop ends behind that turn.
 */
static bool ask(const void *data, size_t size)
{
    const unsigned before = anew;
    const int fd = connect_in_time();
    bool ended = false;
    FILE *in = fdopen(fd, "r");
    if (!in)
        abort();
    send_all(fd, data, size);
    send_all(fd, ASK("all of it"), sizeof ASK("all of it") - 1);
    const bool all = read_to(in, "all of it", &ended);
    if (all)
        send_all(fd, ASK("the last"), sizeof ASK("the last") - 1);
    const bool last = all && read_to(in, "the last", &ended);
    if (!last && (all || size < RPC_LINE_MAX)) /* a longer line is cut off */
        wait_for_it(before);
    fclose(in);
    return ended;
}

/* The fuzzer's own timer is not to end a read with EINTR. */
static void restart_reads(void)
{
    struct sigaction action;
    sigaction(SIGALRM, NULL, &action);
    action.sa_flags |= SA_RESTART;
    sigaction(SIGALRM, &action, NULL);
}

static void start(void)
{
    static const char status[] = "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"status\"}";
    pthread_t thread;
    if (!mkdtemp(folder))
        abort();
    snprintf(conf_path, sizeof conf_path, "%s/conf", folder);
    snprintf(capture_path, sizeof capture_path, "%s/a.mcap", folder);
    snprintf(socket_path, sizeof socket_path, "%s/socket", folder);
    FILE *f = fopen(conf_path, "w");
    if (!f || fprintf(f, "%s%s\n", conf_text, folder) < 0 || fclose(f) != 0)
        abort();
    restart_reads();
    write_capture();
    atexit(tidy_all);
    if (pthread_create(&thread, NULL, daemon_thread, NULL) != 0)
        abort();
    while (!ask(status, sizeof status - 1))
        usleep(10000);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static unsigned asked;
    if (!conf_path[0])
        start();
    ask(data, size);
    if (++asked % TIDY_EVERY == 0)
        tidy(false);
    return 0;
}
