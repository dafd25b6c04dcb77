/* SPDX-License-Identifier: MIT */
/*
 * report_priced - the pings that the plan prices (daemon/plan_cost.h), of every sonar of a configuration in turn, through
 * the daemon's own pipeline, for callgrind to count what each stage takes: tests/bench/plan_error.py.
 *
 *   report_priced CONF PINGS [SPEED]   twice so many of each, in the same directions; between the two, cost_mark; prints
 *                                      nothing
 *
 * Noise, and one echo in every beam; a head steps on from ping to ping, a fan has its beams side by side over 120 degrees,
 * 25 pings a second. The vehicle knows its pose, and stands still or drives ahead at so many metres a second.
 */
#include <stdio.h>
#include <stdlib.h>

#include "../../daemon/plan_cost.h"
#include "../../daemon/settings.h"
#include "lib/cost.h"
#include "lib/dice.h"
#include "lib/scans.h"

#define PULSE_M 0.05
#define NOISE   20.0 /* counts */
#define ECHO    150.0
#define PING_NS UINT64_C(40000000)

static void fault(void *ctx, const char *message)
{
    (void)ctx;
    fprintf(stderr, "report_priced: %s\n", message);
    exit(1);
}

/* Beam by beam. */
static void sound(struct ping *p, struct dice *dice)
{
    uint8_t *sample = p->samples;
    const double near_m = PLAN_ECHO_AT * (double)p->dr_m * p->n_bins;

    for (uint32_t n = 0; n < p->n_beams * p->n_bins; n++) {
        const double beyond_m = (double)p->dr_m * (n % p->n_bins) - near_m;
        *sample++ = (uint8_t)(NOISE * dice_uniform(dice) + (beyond_m >= 0 && beyond_m < PULSE_M ? ECHO : 0));
    }
}

static void fill(struct ping *p, const struct conf_sonar *sonar, unsigned step)
{
    const struct plan_ping size = plan_ping(sonar);

    p->kind = (uint8_t)(size.bins > 1 ? PING_PROFILE : PING_RANGES);
    p->sample_bytes = 1;
    p->n_beams = (uint16_t)size.beams;
    p->n_bins = (uint32_t)size.bins;
    p->dr_m = (float)(sonar->range_m / size.bins);
    p->pulse_m = (float)PULSE_M;
    p->az_aperture_rad = (float)size.az_rad;
    p->el_aperture_rad = (float)size.el_rad;
    for (uint32_t b = 0; b < p->n_beams; b++) {
        const double fan_rad = PLAN_FAN_RAD * ((b + 0.5) / p->n_beams - 0.5);
        p->beam[b] =
            (struct ping_beam){.az_rad = (float)geo_wrap(p->n_beams > 1 ? fan_rad : step * sonar->step_rad),
                               .range_m = (float)(PLAN_ECHO_AT * sonar->range_m),
                               .range_sd_m = 0.02f,
                               .confidence = 0.9f};
    }
}

/* The n-th ping of all sonars. */
static void submit(struct pipeline *pipeline, const struct conf *conf, unsigned n, unsigned step, double speed_mps,
                   struct dice *dice)
{
    const double way_m = speed_mps * 1e-9 * (double)PING_NS * n;

    for (int i = 0; i < conf->n_sonars; i++) {
        struct ping *p = pipeline_begin(pipeline);
        p->t_ns = p->t_in_ns = p->pose.t_ns = (n + 1) * PING_NS;
        p->pose.has = POSE_ATTITUDE | POSE_POSITION | POSE_DEPTH;
        p->pose.position_m[0] = way_m;
        p->pose.path_m = way_m;
        p->seq = n + 1;
        p->sensor = (uint16_t)i;
        fill(p, &conf->sonar[i], step);
        if (p->kind == PING_PROFILE)
            sound(p, dice);
        pipeline_submit(pipeline, p);
    }
}

int main(int argc, char **argv)
{
    static struct conf conf;
    struct conf_source *source;
    struct dice dice = dice_of(1, 1);

    if (argc != 3 && argc != 4) {
        fprintf(stderr, "usage: report_priced CONF PINGS [SPEED]\n");
        return 2;
    }
    conf_load(&conf, &source, argv[1], &settings_checks, fault, NULL);
    conf_source_free(source);
    const unsigned pings = (unsigned)strtoul(argv[2], NULL, 10);
    const double speed_mps = argc > 3 ? strtod(argv[3], NULL) : 0;
    struct pipeline *pipeline = scans_start(&conf);
    for (unsigned n = 0; n < 2 * pings; n++) {
        if (n == pings)
            cost_mark();
        submit(pipeline, &conf, n, n % pings, speed_mps, &dice);
    }
    cost_mark();
    pipeline_free(pipeline);
    return 0;
}
