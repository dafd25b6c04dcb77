/* SPDX-License-Identifier: MIT */
/* contest - see contest.h. */
#include "contest.h"

#include "rivals.h"
#include "shipped.h"

#define THRESHOLD_FROM_M 0.9
#define PING360_FROM_M   0.75

const char *const contest_name[CONTESTANTS] = {"sonard", "threshold", "SOCA", "ping360_sonar"};

/* In counts. */
static const struct {
    unsigned knobs, standard;
    double value[CONTEST_KNOBS];
} rivals[CONTESTANTS] = {
    [CONTEST_THRESHOLD] = {8, 3, {20, 30, 45, 60, 80, 110, 150, 200}},
    [CONTEST_SOCA] = {8, 4, {15, 25, 40, 60, 85, 110, 150, 200}},
    [CONTEST_PING360_SONAR] = {8, 6, {20, 40, 60, 90, 120, 160, 200, 240}},
};

static struct shipped *shipped[SHIPPED_KNOBS];

unsigned contest_knobs(enum contestant c)
{
    return c == CONTEST_SONARD ? SHIPPED_KNOBS : rivals[c].knobs;
}

unsigned contest_standard(enum contestant c)
{
    return c == CONTEST_SONARD ? shipped_knob_default : rivals[c].standard;
}

const char *contest_knob_name(enum contestant c)
{
    return c == CONTEST_SONARD ? shipped_knob_name : "counts";
}

double contest_knob(enum contestant c, unsigned k)
{
    return c == CONTEST_SONARD ? shipped_knob[k] : rivals[c].value[k];
}

void contest_make(uint32_t max_bins)
{
    for (unsigned k = 0; k < SHIPPED_KNOBS; k++)
        shipped[k] = shipped_make(shipped_knob[k], max_bins);
}

void contest_free(void)
{
    for (unsigned k = 0; k < SHIPPED_KNOBS; k++)
        shipped_free(shipped[k]);
}

void contest_begin(void)
{
    for (unsigned k = 0; k < SHIPPED_KNOBS; k++)
        shipped_begin(shipped[k]);
}

void contest_detect(enum contestant c, unsigned k, const struct ping *ping, struct beam_echoes *found)
{
    struct echoes echoes = {.max_beams = ping->n_beams, .beam = found};
    if (c == CONTEST_SONARD) {
        shipped_run(shipped[k], ping, &echoes);
        return;
    }
    for (unsigned b = 0; b < ping->n_beams; b++)
        if (c == CONTEST_SOCA)
            rivals_soca(ping, b, contest_knob(c, k), &found[b]);
        else
            rivals_threshold(ping, b, contest_knob(c, k),
                             c == CONTEST_THRESHOLD ? THRESHOLD_FROM_M : PING360_FROM_M, &found[b]);
}
