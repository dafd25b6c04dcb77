/* SPDX-License-Identifier: MIT */
/*
 * pilot_runs - many drives through worlds drawn at random (run.h), and what came of them: collisions, time to the goal
 * against a pilot who knows the world, what held the vehicle.
 *
 *   pilot_runs [DRIVES [SEED [FOLDER]]]   a line per drive, and tables; with a folder an SVG of the first 72 drives and
 *                                         of every collision
 *
 * PILOT_SETUP=number leaves out the other setups (enum pilot_setup), PILOT_NAV and PILOT_SONAR likewise the other poses
 * and sonars. PILOT_CONF=text is added to the configuration, PILOT_ONLY=number drives one, PILOT_TRACE=1 shows each
 * answer, PILOT_ASK='SECONDS {"jsonrpc":"2.0",...}' asks that then, too. The status is 1 when there was a collision.
 */
#include <stdlib.h>
#include <string.h>

#include "tally.h"
#include "track.h"

static struct pilot_tally tally;
static struct {
    char text[PILOT_REASON_SIZE];
    long n;
} reasons[40];

static void add_reasons(const struct pilot_result *r)
{
    for (int i = 0; i < PILOT_REASONS && r->reason[i].n; i++)
        for (size_t k = 0; k < sizeof reasons / sizeof *reasons; k++) {
            if (reasons[k].n == 0)
                memcpy(reasons[k].text, r->reason[i].text, sizeof reasons[k].text);
            if (strcmp(reasons[k].text, r->reason[i].text) == 0) {
                reasons[k].n += r->reason[i].n;
                break;
            }
        }
}

static void print_reasons(void)
{
    printf("\nheld by unknown water because\n");
    for (size_t k = 0; k < sizeof reasons / sizeof *reasons && reasons[k].n; k++)
        printf("%8ld  %s\n", reasons[k].n, reasons[k].text);
}

static void print_drive(unsigned number, const struct pilot_case *c, const struct pilot_result *r)
{
    char name[PILOT_NAME_SIZE];
    printf("%3u %-110s %s %5.0f s of %3.0f, unknown %3.0f %%, blocked %3.0f %%, least %.2f m", number,
           pilot_name(c, name), r->arrived ? "arrived" : "late   ", r->time_s, r->known_s,
           100 * r->share[PILOT_UNKNOWN], 100 * r->share[PILOT_BLOCKED], r->nearest_m);
    if (r->touched_mps >= 0)
        printf(", %s at %.2f m/s after %.1f s",
               r->collided ? "COLLIDED"
               : r->struck ? "STRUCK"
                           : "touched",
               r->touched_mps, r->end_s);
    if (r->struck)
        printf(", by a diver last in a beam %.1f s before", r->unseen_s);
    printf("%s%s\n", r->arrived ? "" : "; ", r->arrived ? "" : r->last);
    fflush(stdout);
}

#define DRAWN 72 /* every sonar in every place with all poses */

static void draw(const char *folder, unsigned number, const struct pilot_case *c, const struct pilot_result *r,
                 const struct pilot_track *track)
{
    char path[512];
    if (!folder || (number >= DRAWN && !r->collided && !r->struck))
        return;
    snprintf(path, sizeof path, "%s/pilot-%03u%s.svg", folder, number,
             r->collided ? "-collision"
             : r->struck ? "-struck"
                         : "");
    if (!track_write(path, c, r, track))
        perror(path);
}

/* Is it asked for by that variable, or nothing? */
static bool wanted(const char *variable, unsigned number)
{
    const char *only = getenv(variable);
    return !only || strtoul(only, NULL, 10) == number;
}

int main(int argc, char **argv)
{
    static struct pilot_track track;
    const unsigned drives = argc > 1 ? (unsigned)atoi(argv[1]) : DRAWN;
    const uint64_t seed = argc > 2 ? strtoull(argv[2], NULL, 10) : 20260101;
    const char *only = getenv("PILOT_ONLY"), *question = getenv("PILOT_ASK");
    for (unsigned i = only ? (unsigned)atoi(only) : 0; i < drives; i++) {
        struct pilot_case c;
        struct pilot_result r;
        pilot_draw_case(seed, i, &c);
        if (!wanted("PILOT_SETUP", c.setup) || !wanted("PILOT_NAV", c.nav) || !wanted("PILOT_SONAR", c.sonar))
            continue;
        c.conf = getenv("PILOT_CONF");
        c.trace = getenv("PILOT_TRACE") != NULL;
        c.question = question ? strchr(question, '{') : NULL;
        c.question_s = question ? atof(question) : 0;
        track.n = 0;
        if (pilot_run(&c, &r, &track)) {
            print_drive(i, &c, &r);
            pilot_tally_add(&tally, &c, &r);
            add_reasons(&r);
            draw(argc > 3 ? argv[3] : NULL, i, &c, &r, &track);
        }
        if (only)
            break;
    }
    pilot_tally_print(&tally, stdout);
    print_reasons();
    return tally.all.collided > 0;
}
