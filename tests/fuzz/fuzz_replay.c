/* SPDX-License-Identifier: MIT */
/*
 * fuzz_replay - the whole daemon on a capture: four sonars, poses, a map and a coarse grid. What ports, clients and
 * triggers brought is any bytes at any time; sonard comes to the end of it, and every line of its answers is JSON.
 *
 * The input is a list of messages: a byte for the channel (low four bits) and the time since the one before (the
 * rest), a byte for the length, and so many bytes. The file that holds them is another fuzzer's (fuzz_mcap).
 */
#include <fcntl.h>
#include <jansson.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define main sonard_main
#include "daemon/main.c"
#undef main

#include "drivers/capture/mcap.h"

#define START_NS 1700000000000000000u

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char conf_text[] = "[log]\nlevel = err\n"
                                "[sonar head]\ndevice = ping360\nport = serial:/dev/none:115200\nrange = 20 m\n"
                                "[sonar fan]\ndevice = surveyor\nport = udp:127.0.0.1:1\nrange = 10 m\n"
                                "[sonar micron]\ndevice = micron\nport = serial:/dev/other:115200\nrange = 20 m\n"
                                "[sonar down]\ndevice = echolist\nport = udp:127.0.0.1:2\nrange = 10 m\n"
                                "[pipeline]\nqueue = 2\n[vehicle]\nmax_speed = 1 m/s\n"
                                "[map]\nvoxel = 0.5 m\nmemory = 8 MiB\nextent = 40 m\n"
                                "[grid]\nrange = 10 m\nangular_step = 10 deg\n";
static const char *const topics[] = {"/head/rx", "/fan/rx",  "/micron/rx",   "/down/rx",      "/pose",
                                     "/head/tx", "/trigger", "/fan/trigger", "/micron/events"};

#define TOPICS (sizeof topics / sizeof *topics)

static char folder[] = "/tmp/sonard-fuzz-replay-XXXXXX";
static char conf_path[64], capture_path[64], answers_path[64];

static void tidy(void)
{
    unlink(conf_path);
    unlink(capture_path);
    unlink(answers_path);
    rmdir(folder);
}

static void make_folder(void)
{
    if (!mkdtemp(folder))
        abort();
    atexit(tidy);
    snprintf(conf_path, sizeof conf_path, "%s/conf", folder);
    snprintf(capture_path, sizeof capture_path, "%s/a.mcap", folder);
    snprintf(answers_path, sizeof answers_path, "%s/answers", folder);
    FILE *f = fopen(conf_path, "w");
    if (!f || fputs(conf_text, f) == EOF || fclose(f) != 0)
        abort();
}

/* An event that is taken, of two bytes; any other text as it is. */
static size_t event_text(char *text, const uint8_t *b, size_t n)
{
    const struct source_event event = {.kind = (enum source_event_kind)(b[0] % (SOURCE_STATE + 1)),
                                       .to_rad = b[n - 1] / 50.0,
                                       .only = b[n - 1] & 1,
                                       .open = b[n - 1] % 7 != 0,
                                       .state = (enum device_state)(b[n - 1] % (DEVICE_SILENT + 1))};
    if (n == 2)
        return source_event_write(&event, text);
    memcpy(text, b, n);
    return n;
}

/* A pose that is taken, of six bytes; any other text as it is. */
static size_t pose_text(char *text, size_t room, uint64_t t_ns, const uint8_t *b, size_t n)
{
    if (n != 6) {
        memcpy(text, b, n);
        return n;
    }
    return (size_t)snprintf(text, room, "{\"t_unix\":%.6f,\"attitude_deg\":[%d,%d,%d],\"position_m\":[%d,%d,%d]}",
                            (double)t_ns * 1e-9, (int8_t)b[0], (int8_t)b[1] / 2, b[2], (int8_t)b[3], (int8_t)b[4],
                            b[5] / 8);
}

static void write_capture(const uint8_t *data, size_t size)
{
    struct fault fault;
    int channel[TOPICS];
    const int fd = open(capture_path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
    struct mcap_writer *w = fd >= 0 ? mcap_create(fd, &(struct mcap_options){.library = "fuzz"}, &fault) : NULL;
    if (!w)
        abort();
    for (size_t i = 0; i < TOPICS; i++)
        channel[i] = mcap_add_channel(w, topics[i], "octet-stream", NULL, 0, &fault);
    uint64_t t_ns = START_NS;
    for (size_t at = 0; at + 2 <= size;) {
        const size_t topic = (data[at] & 15) % TOPICS, left = size - at - 2;
        const size_t n = data[at + 1] < left ? data[at + 1] : left;
        char text[512];
        t_ns += (uint64_t)(data[at] >> 4) * (data[at] >> 4) * 10000000u;
        const bool pose = strcmp(topics[topic], "/pose") == 0;
        const bool event = n > 0 && strstr(topics[topic], "/events");
        const size_t written_n = pose    ? pose_text(text, sizeof text, t_ns, data + at + 2, n)
                                 : event ? event_text(text, data + at + 2, n)
                                         : n;
        const struct mcap_message message = {.log_ns = t_ns,
                                             .publish_ns = t_ns,
                                             .data = pose || event ? (const uint8_t *)text : data + at + 2,
                                             .size = written_n};
        if (!mcap_write_message(w, channel[topic], &message, &fault))
            abort();
        at += 2 + n;
    }
    if (!mcap_finish(w, &fault))
        abort();
}

static void check_answers(void)
{
    FILE *f = fopen(answers_path, "r");
    char *line = NULL;
    size_t room = 0;
    int n = 0;
    while (f && getline(&line, &room, f) > 0) {
        json_t *answer = json_loads(line, 0, NULL);
        if (!answer)
            abort();
        json_decref(answer);
        n++;
    }
    if (n == 0)
        abort(); /* it was not played */
    free(line);
    if (f)
        fclose(f);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (!conf_path[0])
        make_folder();
    write_capture(data, size);
    char *arguments[] = {"sonard",     "-c",      conf_path, "--replay", capture_path, "--answers",
                         answers_path, "--every", "5",       "--socket", "none",       NULL};
    optind = 0; /* from the beginning */
    sonard_main((int)(sizeof arguments / sizeof *arguments) - 1, arguments);
    check_answers();
    return 0;
}
