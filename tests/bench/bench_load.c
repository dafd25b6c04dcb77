/* SPDX-License-Identifier: MIT */
/*
 * bench_load - what clients do to one another while a multibeam of 512 beams x 1000 bins pings 40 times a second: how
 * long one waits for `blocked` while another asks a long question all the time, beside a bare echo over a UNIX socket;
 * and how many requests a second are held for 1 to 200 clients that ask as fast as they are answered, all the same or
 * each another question, and beside hogs (as many threads as CPUs that write memory without end).
 */
#include <sys/socket.h>

#include "bench_daemon.h"

#define ASKED    400 /* times each, unless it is given */
#define PAUSE_NS 2000000
#define VOXEL_M  0.2
#define WARM_NS  5000000000u
#define HELD_NS  1000000000u
#define CLIENTS  200
#define HOGS_MAX 8
#define HOG_SIZE (32 << 20)

static const char blocked[] = QUESTION("blocked", "\"azimuth_deg\":10,\"distance_m\":5");
static atomic_bool enough;
static int asked = ASKED;

static void pause_ns(long ns)
{
    clock_nanosleep(CLOCK_MONOTONIC, 0, &(struct timespec){.tv_sec = ns / 1000000000, .tv_nsec = ns % 1000000000},
                    NULL);
}

/* ---- beside long questions ---- */

struct asker {
    const char *line; /* NULL: nothing is asked */
    unsigned asked;
    double longest_us;
};

static void *ask_always(void *arg)
{
    struct asker *a = arg;
    const int fd = connect_to(server_path_name);
    while (!enough) {
        const double us = ask(fd, a->line);
        a->longest_us = us > a->longest_us ? us : a->longest_us;
        a->asked++;
    }
    close(fd);
    return NULL;
}

static void beside(const char *name, const char *line, int fd, int echo_fd)
{
    static double echo_us[ASKED], blocked_us[ASKED];
    struct asker asker = {.line = line};
    pthread_t thread;
    enough = false;
    longest_turn_ns = 0;
    if (line)
        pthread_create(&thread, NULL, ask_always, &asker);
    for (int i = 0; i < asked; i++) {
        pause_ns(PAUSE_NS);
        echo_us[i] = ask(echo_fd, blocked);
        pause_ns(PAUSE_NS);
        blocked_us[i] = ask(fd, blocked);
    }
    enough = true;
    if (line)
        pthread_join(thread, NULL);
    qsort(echo_us, (size_t)asked, sizeof(double), bench_by_size);
    qsort(blocked_us, (size_t)asked, sizeof(double), bench_by_size);
    printf("%-22s  %9.0f  %9.0f  %9.0f  %9.0f  %9.0f  %9.0f  %6u  %9.0f\n", name, echo_us[asked / 2],
           echo_us[asked * 99 / 100], blocked_us[asked / 2], blocked_us[asked * 99 / 100], blocked_us[asked - 1],
           (double)longest_turn_ns * 1e-3, asker.asked, asker.longest_us);
    fflush(stdout);
}

static void long_questions(void)
{
    static const struct {
        const char *name, *line;
    } rows[] = {
        {"(nothing)", NULL},
        {"surface", QUESTION("surface", "\"count\":1024")},
        {"map_slice", QUESTION("map_slice", "")},
        {"box, 1.7 M voxels", QUESTION("box", "\"from_m\":[-12,-12,-7],\"to_m\":[12,12,17]")},
        {"explain, 180 deg", QUESTION("explain", "\"azimuth_deg\":0,\"distance_m\":20,\"half_angle_deg\":180")},
        {"image", QUESTION("image", "")},
        {"clusters", QUESTION("clusters", "")},
        {"next_look", QUESTION("next_look", "")},
        {"nearest", QUESTION("nearest", "")}};
    int pair[2];
    pthread_t echoer;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
        exit(1);
    pthread_create(&echoer, NULL, echo, &pair[1]);
    const int fd = connect_to(server_path_name);
    pause_ns(WARM_NS);
    printf("microseconds from question to answer, %d times each, beside a client that asks a long question all "
           "the time\n\n",
           asked);
    printf("%-22s  %9s  %9s  %9s  %9s  %9s  %9s  %6s  %9s\n", "the other one asks", "echo", "echo 99 %", "blocked",
           "99 %", "most", "turn, CPU", "asked", "it waits");
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        beside(rows[i].name, rows[i].line, fd, pair[0]);
    close(fd);
    shutdown(pair[0], SHUT_RDWR);
    pthread_join(echoer, NULL);
}

/* ---- many clients ---- */

static void *hog(void *arg)
{
    static _Thread_local volatile unsigned char *memory;
    (void)arg;
    memory = need(HOG_SIZE);
    while (!enough)
        for (size_t i = 0; i < HOG_SIZE && !enough; i += 64)
            memory[i]++;
    free((void *)(uintptr_t)memory);
    return NULL;
}

static const char *const mixed[] = {blocked, QUESTION("sectors", ""), QUESTION("nearest", ""),
                                    QUESTION("limit", "\"velocity_mps\":[1,0,0]")};
enum { MIXED = sizeof mixed / sizeof mixed[0] };

/* Requests a second that n clients get answered, each with one question under way: of the first `kinds` in turn. */
static double held(const int *fd, int n, unsigned kinds)
{
    const uint64_t started_ns = loop_clock();
    unsigned answered = 0, asks = 0;
    while (loop_clock() < started_ns + HELD_NS) {
        for (int i = 0; i < n; i++)
            put_question(fd[i], mixed[asks++ % kinds]);
        for (int i = 0; i < n; i++)
            take_answer(fd[i]);
        answered += (unsigned)n;
    }
    return answered / ((double)(loop_clock() - started_ns) * 1e-9);
}

static void many_clients(void)
{
    static const int counts[] = {1, 2, 5, 10, 20, 50, 100, 200};
    static int fd[CLIENTS];
    pthread_t hogs[HOGS_MAX];
    const long cpus = sysconf(_SC_NPROCESSORS_ONLN), n_hogs = cpus < HOGS_MAX ? cpus : HOGS_MAX;
    enum { COUNTS = sizeof counts / sizeof counts[0] };
    double alone[COUNTS], each_another[COUNTS];
    for (int i = 0; i < CLIENTS; i++)
        fd[i] = connect_to(server_path_name);
    for (int i = 0; i < COUNTS; i++) {
        alone[i] = held(fd, counts[i], 1);
        each_another[i] = held(fd, counts[i], MIXED);
    }
    enough = false;
    for (long i = 0; i < n_hogs; i++)
        pthread_create(&hogs[i], NULL, hog, NULL);
    printf(
        "\nanswers a second, %d pings a second meanwhile; mixed: blocked, sectors, nearest and limit in turn\n\n"
        "%7s  %8s  %8s  %s\n",
        RATE_HZ, "clients", "blocked", "mixed", "blocked, with hogs");
    for (int i = 0; i < COUNTS; i++)
        printf("%7d  %8.0f  %8.0f  %8.0f\n", counts[i], alone[i], each_another[i], held(fd, counts[i], 1));
    enough = true;
    for (long i = 0; i < n_hogs; i++)
        pthread_join(hogs[i], NULL);
    for (int i = 0; i < CLIENTS; i++)
        close(fd[i]);
}

/* The pipeline's threads may be given, and how often each is asked beside a long question: 1 to 400. */
int main(int argc, char **argv)
{
    if (argc > 2 && atoi(argv[2]) > 0 && atoi(argv[2]) < ASKED)
        asked = atoi(argv[2]);
    daemon_start(argc > 1 ? atoi(argv[1]) : 2, VOXEL_M, CLIENTS + 4);
    long_questions();
    many_clients();
    daemon_stop();
    return 0;
}
