/* SPDX-License-Identifier: MIT */
#include "played.h"

#include <errno.h>
#include <limits.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "client/lib/sonard_json.h"
#include "leftover.h"

#define WAIT_S     600 /* for an answer: a jump may be long */
#define LOOK_NS    1000000
#define CONNECT_NS 20000000

static void pause_ns(long ns)
{
    nanosleep(&(struct timespec){.tv_nsec = ns}, NULL);
}

static void in_folder(const struct played *played, const char *name, char path[PATH_MAX])
{
    snprintf(path, PATH_MAX, "%s/%s", played->folder, name);
}

/* The one that was installed or built with this program, else the one that the search path has. */
static void run_daemon(char *const argv[])
{
    static const char *const places[] = {"", "../sbin/"};
    char own[PATH_MAX], path[PATH_MAX + 64];
    const ssize_t n = readlink("/proc/self/exe", own, sizeof own - 1);
    own[n > 0 ? n : 0] = '\0';
    const char *name = strrchr(own, '/');

    for (size_t i = 0; name && i < sizeof places / sizeof *places; i++) {
        snprintf(path, sizeof path, "%.*s%ssonard", (int)(name + 1 - own), own, places[i]);
        execv(path, argv);
    }
    execvp("sonard", argv);
}

static void become_daemon(const struct played *played, const char *capture, const char *conf)
{
    char socket[PATH_MAX];
    in_folder(played, "s", socket);
    const char *const argv[] = {"sonard", "--replay",         capture, "--stay", "--speed", "0.001", "--socket",
                                socket,   conf ? "-c" : NULL, conf,    NULL};

    prctl(PR_SET_PDEATHSIG, SIGTERM);
    dup2(played->log, STDERR_FILENO);
    run_daemon((char *const *)(uintptr_t)argv);
    fprintf(stderr, "sonard: %s\n", strerror(errno));
    _exit(127);
}

static void show_log(const struct played *played)
{
    char text[4096];
    lseek(played->log, 0, SEEK_SET);
    for (ssize_t n; (n = read(played->log, text, sizeof text)) > 0;)
        fwrite(text, 1, (size_t)n, stderr);
}

static bool daemon_failed(const struct played *played, const char *capture, struct fault *fault)
{
    show_log(played);
    return fault_set(fault, "%s: sonard, which replays it, has ended: see above", capture);
}

/* Whoever is connected needs no name of the socket: even a command that is killed leaves none. */
static void remove_folder(struct played *played)
{
    char socket[PATH_MAX];
    if (!played->folder[0])
        return;
    in_folder(played, "s", socket);
    unlink(socket);
    rmdir(played->folder);
    leftover_forget(socket);
    leftover_forget(played->folder);
    played->folder[0] = '\0';
}

static bool connect_to(struct played *played, const char *capture, struct fault *fault)
{
    char socket[PATH_MAX];
    struct sonard_error error;
    in_folder(played, "s", socket);

    while (!(played->client = sonard_connect(socket, WAIT_S, &error))) {
        if (waitpid(played->daemon, NULL, WNOHANG) == played->daemon) {
            played->daemon = 0;
            leftover_process(0);
            return daemon_failed(played, capture, fault);
        }
        pause_ns(CONNECT_NS);
    }
    remove_folder(played);
    return true;
}

/* Its state after the call; false: it gives none. */
static bool replay(struct played *played, json_t *params, bool *jumping, struct fault *fault)
{
    struct sonard_error error;
    json_t *state = sonard_json_call(played->client, "replay", params, &error);
    json_decref(params);
    if (!state)
        return fault_set(fault, "the replay cannot continue: %.200s", error.message);
    played->length_s = json_number_value(json_object_get(state, "length_s"));
    played->position_s = json_number_value(json_object_get(state, "position_s"));
    *jumping = json_is_true(json_object_get(state, "jumping"));
    json_decref(state);
    return true;
}

static bool make_folder(struct played *played, struct fault *fault)
{
    const char *temporary = getenv("TMPDIR");
    char socket[PATH_MAX];
    snprintf(played->folder, sizeof played->folder, "%s/sonarctl-XXXXXX",
             temporary && strlen(temporary) < 40 ? temporary : "/tmp");
    if (!mkdtemp(played->folder)) {
        fault_set(fault, "%s: %s", played->folder, strerror(errno));
        played->folder[0] = '\0';
        return false;
    }
    in_folder(played, "s", socket);
    return (leftover_name(played->folder) && leftover_name(socket)) ||
           fault_set(fault, "%s: %s", played->folder, strerror(errno));
}

static bool start_daemon(struct played *played, const char *capture, const char *conf, const sigset_t *signals,
                         struct fault *fault)
{
    played->log = memfd_create("log", MFD_CLOEXEC);
    played->daemon = played->log >= 0 ? fork() : -1;
    if (played->daemon == 0) {
        leftover_release(signals);
        become_daemon(played, capture, conf);
    }
    if (played->daemon < 0)
        return fault_set(fault, "cannot start sonard: %s", strerror(errno));
    leftover_process(played->daemon);
    return true;
}

bool played_start(struct played *played, const char *capture, const char *conf, struct fault *fault)
{
    sigset_t signals;
    bool jumping;
    *played = (struct played){.log = -1};
    leftover_hold(&signals);
    const bool started = make_folder(played, fault) && start_daemon(played, capture, conf, &signals, fault);
    leftover_release(&signals);
    return started && connect_to(played, capture, fault) &&
           replay(played, json_pack("{s:s}", "pause", "yes"), &jumping, fault);
}

bool played_go(struct played *played, double to_s, struct fault *fault)
{
    bool jumping;
    if (!replay(played, json_pack("{s:f}", "to_s", to_s), &jumping, fault))
        return false;
    while (jumping) {
        pause_ns(LOOK_NS);
        if (!replay(played, NULL, &jumping, fault))
            return false;
    }
    return true;
}

json_t *played_ask(struct played *played, const char *method, json_t *params)
{
    struct sonard_error error;
    return sonard_json_call(played->client, method, params, &error);
}

void played_stop(struct played *played)
{
    if (played->client)
        sonard_disconnect(played->client);
    if (played->daemon > 0) {
        kill(played->daemon, SIGTERM);
        waitpid(played->daemon, NULL, 0);
        leftover_process(0);
    }
    if (played->log >= 0)
        close(played->log);
    remove_folder(played);
}
