/* SPDX-License-Identifier: MIT */
/*
 * echolist_sim - a virtual sweep sonar whose receiver is sampled by a threshold circuit: scans a sector to and fro and
 * says the echoes of each ping in one line of text. The water's beam is that of ping360_sim.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "tests/sim/lib/twin.h"

#define BINS       1200
#define ECHOES_MAX 16
#define PULSE_S    200e-6
#define RING_M     0.6 /* the circuit is gated until the transducer has rung down */

static struct {
    double range_m, tilt_deg, from_deg, to_deg, step_deg, period_s;
    unsigned threshold; /* counts of 255 */
    bool checksum;
    double scan_deg;
    int direction;
    uint64_t due_ns;
} sonar = {.range_m = 20.0,
           .from_deg = -60.0,
           .to_deg = 60.0,
           .step_deg = 3.0,
           .period_s = 0.05,
           .threshold = 12,
           .checksum = true,
           .direction = 1};

static bool option(const char *name, const char *value)
{
    const struct {
        const char *name;
        double *value;
    } numbers[] = {{"--range", &sonar.range_m}, {"--tilt", &sonar.tilt_deg}, {"--from", &sonar.from_deg},
                   {"--to", &sonar.to_deg},     {"--step", &sonar.step_deg}, {"--period", &sonar.period_s}};
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++) {
        if (strcmp(name, numbers[i].name) == 0) {
            *numbers[i].value = strtod(value, NULL);
            return isfinite(*numbers[i].value) && sonar.range_m > 0 && sonar.period_s > 0;
        }
    }
    sonar.checksum = strcmp(value, "yes") == 0;
    return strcmp(name, "--checksum") == 0 && (sonar.checksum || strcmp(value, "no") == 0);
}

/* Time and height of every stretch above the threshold, as ",T,A" each; how many. */
static int list_echoes(const uint8_t *counts, char *text, size_t size)
{
    const double bin_m = sonar.range_m / BINS;
    size_t used = 0;
    int n = 0;
    text[0] = '\0';
    for (int i = (int)(RING_M / bin_m); i < BINS && n < ECHOES_MAX; i++) {
        if (counts[i] < sonar.threshold)
            continue;
        const int begin = i;
        unsigned peak = counts[i];
        for (; i < BINS && counts[i] >= sonar.threshold / 2; i++)
            peak = counts[i] > peak ? counts[i] : peak;
        used += (size_t)snprintf(text + used, size - used, ",%.1f,%.1f", (begin + 1) * bin_m * 2.0 / 1500.0 * 1e6,
                                 peak * 100.0 / 255.0);
        n++;
    }
    return n;
}

static void ping(uint64_t now_ns)
{
    uint8_t counts[BINS];
    char echoes[512], line[640];
    unsigned sum = 0;
    if (sonar.scan_deg + sonar.direction * sonar.step_deg > sonar.to_deg ||
        sonar.scan_deg + sonar.direction * sonar.step_deg < sonar.from_deg)
        sonar.direction = -sonar.direction;
    sonar.scan_deg += sonar.direction * sonar.step_deg;
    twin_listen(sonar.scan_deg, sonar.range_m, PULSE_S, BINS, 255, now_ns, counts);
    const int n_echoes = list_echoes(counts, echoes, sizeof echoes);
    size_t n = (size_t)snprintf(line, sizeof line, "$ECHO,%.1f,%.1f,%d%s", sonar.scan_deg, sonar.tilt_deg,
                                n_echoes, echoes);
    for (size_t i = 1; i < n; i++)
        sum ^= (unsigned char)line[i];
    if (sonar.checksum)
        n += (size_t)snprintf(line + n, sizeof line - n, "*%02X", sum);
    n += (size_t)snprintf(line + n, sizeof line - n, "\r\n");
    twin_send(line, n, now_ns);
}

static void feed(const uint8_t *bytes, size_t n, uint64_t now_ns)
{
    (void)bytes, (void)n, (void)now_ns; /* nobody tells it anything */
}

static uint64_t tick(uint64_t now_ns)
{
    if (now_ns >= sonar.due_ns) {
        sonar.due_ns = now_ns + (uint64_t)(sonar.period_s * 1e9);
        ping(now_ns);
    }
    return sonar.due_ns;
}

int main(int argc, char **argv)
{
    static const struct twin_ops ops = {
        .name = "echolist_sim",
        .what = "a virtual sweep sonar that says echo lists on a pseudo-terminal",
        .options = "  --range M          how far it listens (20)\n"
                   "  --from, --to DEG   ends of the scan (-60, 60)\n"
                   "  --step DEG         from ping to ping (3)\n"
                   "  --tilt DEG         that it says (0); the water's beam stays level\n"
                   "  --period S         between pings (0.05)\n"
                   "  --checksum yes|no  at the end of a line (yes)\n",
        .option = option,
        .feed = feed,
        .tick = tick,
    };
    return twin_main(argc, argv, &ops);
}
