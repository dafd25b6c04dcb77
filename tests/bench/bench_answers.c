/* SPDX-License-Identifier: MIT */
/*
 * bench_answers - how long a client waits for `blocked`, `sectors`, `nearest` and `limit` while a multibeam of 512
 * beams x 1000 bins pings 40 times a second, beside a bare echo over a UNIX socket in the same run: all are asked in
 * turns, so that they meet the same load; with 0, 1 and 2 threads of the pipeline. The loop, those threads and the echo
 * are threads of this process. Aim: 99 % of `blocked` and `sectors` within three times the echo's. Beside other
 * programs the 99 % are theirs, unless all of this is put before them: chrt -f 10. What takes long is not asked in each
 * turn, so that all of it takes less than a minute of an idle machine.
 *
 *   bench_answers [TURNS [THREADS]]   20 to 4000 turns, and one number of threads, 0 to 2, not all
 *   bench_answers counted KIND [PINGS [TIMES]]
 *       20 times one of them, or 1 to 1000, without threads or sockets, for callgrind to count `counted`, after so many
 *       pings, 20 to 4000; from 192 on there are as many records as one sonar may have. Says what one takes of a
 *       processor
 */
#include <sys/socket.h>

#include "bench_answer.h"
#include "bench_daemon.h"

#define TURNS        1000 /* unless they are given */
#define TURNS_LEAST  20
#define TURNS_MOST   4000
#define PAUSE_NS     1000000
#define WARM_PINGS   20
#define COUNTED      20 /* times, for callgrind */
#define COUNTED_MOST 1000
#define PINGS_MOST   4000

static const struct {
    const char *name, *line;
    int every; /* asked in one of so many turns */
} kinds[] = {{"echo", QUESTION("echo", "\"azimuth_deg\":10,\"distance_m\":5"), 1},
             {"blocked", QUESTION("blocked", "\"azimuth_deg\":10,\"distance_m\":5"), 1},
             {"sectors", QUESTION("sectors", ""), 2},
             {"nearest", QUESTION("nearest", ""), 20},
             {"limit", QUESTION("limit", "\"velocity_mps\":[1,0,0]"), 4}};
enum { KINDS = sizeof kinds / sizeof kinds[0] };
static double took_us[KINDS][TURNS_MOST];
static int asked[KINDS];

static double quantile_us(int kind, double share)
{
    return took_us[kind][(int)(share * asked[kind])];
}

/* Of few answers a share that is none of them is not printed. */
static void print_against_echo(int threads)
{
    for (int k = 0; k < KINDS; k++)
        qsort(took_us[k], (size_t)asked[k], sizeof(double), bench_by_size);
    for (int k = 0; k < KINDS; k++) {
        printf("%7d  %-8s  %5d", threads, kinds[k].name, asked[k]);
        for (size_t i = 0; i < 3; i++) {
            static const double shares[] = {0.5, 0.99, 0.999};
            const double us = quantile_us(k, shares[i]);
            if ((1 - shares[i]) * asked[k] > 0.9)
                printf("  %9.1f  %7.2f", us, us / quantile_us(0, shares[i]));
        }
        printf("\n");
    }
    fflush(stdout);
}

/* Before the first pings there is nothing to be looked through. */
static void await_pings(void)
{
    struct picture_frame frame = {0};
    while (frame.pings < WARM_PINGS) {
        clock_nanosleep(CLOCK_MONOTONIC, 0, &(struct timespec){.tv_nsec = PAUSE_NS}, NULL);
        picture_get_frame(grid_picture(pipeline_grid(d.pipeline, 0)), &frame);
    }
}

static void with_threads(int threads, int turns)
{
    int pair[2];
    pthread_t echoer;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
        exit(1);
    daemon_start(threads, 0, 4);
    pthread_create(&echoer, NULL, echo, &pair[1]);
    const int fd = connect_to(server_path_name);
    await_pings();
    memset(asked, 0, sizeof asked);
    for (int i = 0; i < turns; i++)
        for (int k = 0; k < KINDS; k++)
            if (i % kinds[k].every == 0) {
                clock_nanosleep(CLOCK_MONOTONIC, 0, &(struct timespec){.tv_nsec = PAUSE_NS}, NULL);
                took_us[k][asked[k]++] = ask(k ? fd : pair[0], kinds[k].line);
            }
    print_against_echo(threads);
    shutdown(pair[0], SHUT_RDWR);
    pthread_join(echoer, NULL);
    close(pair[0]);
    close(pair[1]);
    close(fd);
    daemon_stop();
}

/* A function that callgrind sees by its name. */
__attribute__((noinline)) static void counted(const char *line, int times)
{
    static double us[COUNTED_MOST];
    for (int i = 0; i < times; i++) {
        const double began_ns = cpu_ns();
        bench_answer(&d, line);
        us[i] = (cpu_ns() - began_ns) * 1e-3;
    }
    printf("%.0f us of CPU each\n", median(us, (size_t)times));
}

static int count(const char *kind, int pings, int times)
{
    for (int k = 1; k < KINDS; k++)
        if (strcmp(kinds[k].name, kind) == 0) {
            daemon_make(0, 0);
            pose_log_init(&d.poses, UINT64_C(1000000000000)); /* under callgrind, too, it is fresh */
            for (int i = 0; i < pings; i++) {
                loop_turn(d.loop, 1);
                ping();
            }
            loop_turn(d.loop, 1);
            counted(kinds[k].line, times);
            pipeline_free(d.pipeline);
            loop_free(d.loop);
            return 0;
        }
    fprintf(stderr, "%s: no such question\n", kind);
    return 1;
}

int main(int argc, char **argv)
{
    if (argc >= 3 && strcmp(argv[1], "counted") == 0) {
        const int pings = argc > 3 ? atoi(argv[3]) : WARM_PINGS, times = argc > 4 ? atoi(argv[4]) : COUNTED;
        return count(argv[2],
                     pings < WARM_PINGS   ? WARM_PINGS
                     : pings > PINGS_MOST ? PINGS_MOST
                                          : pings,
                     times < 1              ? 1
                     : times > COUNTED_MOST ? COUNTED_MOST
                                            : times);
    }
    const int given = argc > 1 ? atoi(argv[1]) : TURNS, turns = given < TURNS_LEAST  ? TURNS_LEAST
                                                                : given > TURNS_MOST ? TURNS_MOST
                                                                                     : given;
    printf("%d turns, under %d pings a second of %d beams x %d bins\n\n", turns, RATE_HZ, BEAMS, BINS);
    printf("%7s  %-8s  %5s  %9s  %7s  %9s  %7s  %9s  %7s\n", "threads", "", "asked", "median us", "ratio",
           "99 % us", "ratio", "99.9 % us", "ratio");
    for (int threads = 0; threads <= 2; threads++)
        if (argc < 3 || atoi(argv[2]) == threads)
            with_threads(threads, turns);
    return 0;
}
