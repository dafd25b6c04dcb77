/* SPDX-License-Identifier: MIT */
/*
 * bench_answers - how long a client waits for `blocked` and `sectors` while a multibeam of 512 beams x 1000 bins pings 40
 * times a second, beside a bare echo over a UNIX socket in the same run: all are asked in turns, so that they meet the
 * same load. The loop, the pipeline's threads and the echo are threads of this process. Aim: 99 % within three times the echo.
 */
#include <sys/socket.h>

#include "bench_daemon.h"

#define ASKED    4000 /* times each, 500 a second all together */
#define PAUSE_NS 2000000

/* The pipeline's threads may be given: 1 or 2. */
int main(int argc, char **argv)
{
    static const char *const lines[] = {
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"echo\",\"params\":{\"azimuth_deg\":10,\"distance_m\":5}}\n",
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"blocked\",\"params\":{\"azimuth_deg\":10,\"distance_m\":5}}\n",
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"sectors\"}\n",
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"nearest\"}\n",
        "{\"jsonrpc\":\"2.0\",\"id\":1,\"method\":\"limit\",\"params\":{\"velocity_mps\":[1,0,0]}}\n"};
    static const char *const names[] = {"echo", "blocked", "sectors", "nearest", "limit"};
    enum { KINDS = sizeof lines / sizeof lines[0] };
    static double took_us[KINDS][ASKED];
    const int threads = argc > 1 ? atoi(argv[1]) : 2;
    int pair[2];
    pthread_t echoer;
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair) != 0)
        return 1;
    daemon_start(threads, 0, 4);
    pthread_create(&echoer, NULL, echo, &pair[1]);
    const int fd = connect_to(server_path_name);
    for (int i = 0; i < ASKED; i++)
        for (int k = 0; k < KINDS; k++) {
            clock_nanosleep(CLOCK_MONOTONIC, 0, &(struct timespec){.tv_nsec = PAUSE_NS}, NULL);
            took_us[k][i] = ask(k ? fd : pair[0], lines[k]);
        }
    printf("%d questions of each kind, under %d pings a second of %d beams x %d bins, %d threads\n\n", ASKED,
           RATE_HZ, BEAMS, BINS, threads);
    printf("%-8s  %9s  %9s  %9s  %s\n", "", "median us", "99 % us", "most us", "99 % against the echo's");
    for (int k = 0; k < KINDS; k++)
        qsort(took_us[k], ASKED, sizeof(double), bench_by_size);
    const double echo_us = took_us[0][ASKED * 99 / 100];
    for (int k = 0; k < KINDS; k++)
        printf("%-8s  %9.1f  %9.1f  %9.1f  %.2f\n", names[k], took_us[k][ASKED / 2], took_us[k][ASKED * 99 / 100],
               took_us[k][ASKED - 1], took_us[k][ASKED * 99 / 100] / echo_us);
    shutdown(pair[0], SHUT_RDWR);
    pthread_join(echoer, NULL);
    daemon_stop();
    return 0;
}
