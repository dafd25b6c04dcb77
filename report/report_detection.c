/* SPDX-License-Identifier: MIT */
/*
 * report_detection - the detector against the truth, in water that is drawn at random and tuned to nobody, beside
 * three plain ways to do it: how much of the free water is said to be free, what is called free behind a target,
 * what is an echo of nothing, what is found.
 *
 *   report_detection table [FIRST [LAST]]   of seeds FIRST to LAST (1 to 8; quick: 1 and 2), for people
 *   report_detection reach [FIRST [LAST]]   the same as CSV
 *   report_detection roc [FIRST [LAST]]     CSV: every method over its one knob, all seeds together
 *   report_detection cases [FIRST [LAST]]   CSV: every beam with free water claimed behind a target, and why
 *   report_detection echoes [FIRST [LAST]]  CSV: of each world, first echoes of nothing by cause, and free metres
 *   report_detection worlds [FIRST [LAST]]  what the worlds are
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lib/contest.h"
#include "lib/cost.h"
#include "lib/knob.h"
#include "lib/oracle.h"
#include "lib/shipped.h"
#include "lib/verdict.h"

#define WORLDS    36 /* of a seed */
#define SEEDS     8
#define MAX_SEEDS 64

#define ORACLE  CONTESTANTS /* the method that knows what no detector knows */
#define METHODS (CONTESTANTS + 1)

static const double oracle_factor[] = {1, 2, 4, 8, 16}; /* its knob */
#define ORACLE_KNOBS    5
#define ORACLE_STANDARD 1

static struct verdict verdicts[MAX_SEEDS][METHODS][CONTEST_KNOBS];
static struct drawn_sound sound;

static unsigned knobs_of(unsigned m)
{
    return m == ORACLE ? ORACLE_KNOBS : contest_knobs((enum contestant)m);
}

static unsigned standard_of(unsigned m)
{
    return m == ORACLE ? ORACLE_STANDARD : contest_standard((enum contestant)m);
}

static const char *name_of(unsigned m)
{
    return m == ORACLE ? "knows all" : contest_name[m];
}

/* ---- one world ---- */

struct listing {
    bool cases, echoes, every_knob;
};

static void list_case(unsigned beam, const struct beam_echoes *b)
{
    const struct drawn_world *w = &sound.world;
    const struct drawn_truth *truth = &sound.truth[beam];
    const double heard_m = truth->hearable.target_m[DRAWN_LINE];
    char echo[64] = "silent";
    int which = 0;
    if (!verdict_claims(b, heard_m + VERDICT_PAST_M))
        return;
    for (unsigned k = 0; k < w->targets; k++)
        which = truth->hearable.by_m[k] == heard_m ? (int)k : which;
    if (b->n > 0)
        snprintf(echo, sizeof echo, "%.2f m (%s)", (double)b->echo[0].range_m,
                 insonify_cause_name[drawn_sound_cause(&sound, beam, (double)b->echo[0].range_m)]);
    printf("%llu,%u,%s,%u,%u,%.1f,%s,%.2f,%.2f,%.2f,%.2f,%.2f,%s,%s%s\n", (unsigned long long)w->seed, w->number,
           w->head, sound.ping.seq, beam, geo_deg((double)b->az_rad), drawn_class_name[w->target[which].class],
           truth->near_m[which], heard_m, truth->far_m[which], (double)b->blind_m, (double)b->free_to_m, echo,
           w->told == w->law ? "" : "wrong law; ",
           heard_m < 1.3 * w->ring_m                   ? "near the ring-down"
           : (double)b->blind_m > truth->near_m[which] ? "blind to beyond it"
           : b->n == 0                                 ? "no echo"
                                                       : "an echo behind it");
}

static void list_echoes(const struct verdict *before, const struct verdict *v)
{
    const double beams = (double)(v->settled_beams - before->settled_beams);
    printf("%llu,%u,%s,%.0f", (unsigned long long)sound.world.seed, sound.world.number, sound.world.head, beams);
    for (int c = 0; c < CAUSES; c++)
        printf(",%llu", (unsigned long long)(v->nothing[c] - before->nothing[c]));
    for (int c = 0; c < DRAWN_CLASSES; c++) {
        double free_m = 0.0, said_m = 0.0;
        for (int moving = 0; moving < 2; moving++) {
            free_m += v->free_m[moving][c] - before->free_m[moving][c];
            said_m += v->said_m[moving][c] - before->said_m[moving][c];
        }
        printf(",%.1f,%.1f", free_m / beams, fabs(said_m / beams));
    }
    printf("\n");
}

static void detect(unsigned c, unsigned k, struct beam_echoes *found)
{
    if (c != ORACLE) {
        contest_detect((enum contestant)c, k, &sound.ping, found);
        return;
    }
    for (unsigned b = 0; b < sound.ping.n_beams; b++)
        oracle_detect(&sound, b, oracle_factor[k], &found[b]);
}

static void judge_ping(const struct listing *list, struct verdict verdict[METHODS][CONTEST_KNOBS],
                       struct verdict_sectors sectors[METHODS][CONTEST_KNOBS])
{
    static struct beam_echoes found[DRAWN_MAX_BEAMS];
    for (unsigned c = 0; c < METHODS; c++)
        for (unsigned k = 0; k < knobs_of(c); k++) {
            const bool standard = k == standard_of(c);
            if (!standard && !list->every_knob)
                continue;
            detect(c, k, found);
            for (unsigned b = 0; b < sound.ping.n_beams; b++) {
                verdict_beam(&verdict[c][k], &sectors[c][k], &sound, b, &found[b]);
                if (list->cases && standard && c == CONTEST_SONARD)
                    list_case(b, &found[b]);
            }
        }
}

static void judge_world(uint64_t seed, unsigned number, const struct listing *list,
                        struct verdict verdict[METHODS][CONTEST_KNOBS])
{
    static struct verdict before[METHODS][CONTEST_KNOBS];
    static struct verdict_sectors sectors[METHODS][CONTEST_KNOBS];
    const unsigned standard = contest_standard(CONTEST_SONARD);
    memcpy(before, verdict, sizeof before);
    memset(sectors, 0, sizeof sectors);
    contest_begin();
    drawn_sound_begin(&sound, seed, number);
    while (drawn_sound_next(&sound))
        judge_ping(list, verdict, sectors);
    for (unsigned c = 0; c < METHODS; c++)
        for (unsigned k = 0; k < knobs_of(c); k++)
            verdict_world(&verdict[c][k], &sectors[c][k], &before[c][k]);
    if (list->echoes)
        list_echoes(&before[CONTEST_SONARD][standard], &verdict[CONTEST_SONARD][standard]);
}

/* ---- what is told ---- */

static struct verdict pooled(unsigned c, unsigned k, unsigned seeds)
{
    struct verdict sum = {0};
    for (unsigned s = 0; s < seeds; s++)
        verdict_add(&sum, &verdicts[s][c][k]);
    return sum;
}

/* Of all seeds, and of the worst or the middle one. */
static void measure(const struct verdict_measure *m, unsigned c, unsigned seeds, double *all, double *one)
{
    const struct verdict sum = pooled(c, standard_of(c), seeds);
    double value[MAX_SEEDS];
    unsigned n = 0;
    for (unsigned s = 0; s < seeds; s++) {
        const double v = m->of(&verdicts[s][c][standard_of(c)], m->what);
        if (isfinite(v))
            value[n++] = m->scale * v;
    }
    cost_sort(value, n);
    *all = m->scale * m->of(&sum, m->what);
    *one = cost_quantile(value, n, m->worst_is_high ? 1.0 : 0.5);
}

/* What a fixed threshold says of the free water where it is wrong behind walls no oftener than so. */
static double threshold_at(double wrong, unsigned seeds)
{
    double best = 0.0;
    for (unsigned k = 0; k < contest_knobs(CONTEST_THRESHOLD); k++) {
        const struct verdict v = pooled(CONTEST_THRESHOLD, k, seeds);
        if (verdict_past(&v) <= wrong)
            best = fmax(best, verdict_free(&v));
    }
    return best;
}

static void print_table(uint64_t first, unsigned seeds)
{
    const struct verdict own = pooled(CONTEST_SONARD, contest_standard(CONTEST_SONARD), seeds);
    printf("seeds %llu to %llu, %u worlds each, %llu beams: of all seeds (of the worst or the middle seed)\n%-54s "
           "%6s",
           (unsigned long long)first, (unsigned long long)first + seeds - 1, WORLDS, (unsigned long long)own.beams,
           "", "aim");
    for (unsigned c = 0; c < METHODS; c++)
        printf(" %17s", name_of(c));
    for (unsigned r = 0; r < verdict_measures_n; r++) {
        printf("\n%-54s %6s", verdict_measures[r].name, verdict_measures[r].aim);
        for (unsigned c = 0; c < METHODS; c++) {
            double all, one;
            measure(&verdict_measures[r], c, seeds, &all, &one);
            printf(" %8.4g (%6.4g)", all, one);
        }
    }
    printf("\n%-54s %6s %8.4g\n", "free water of the best threshold no oftener wrong, %", "less",
           100.0 * threshold_at(verdict_past(&own), seeds));
}

/* A number of a CSV; nothing where nothing was there to be measured. */
static void print_field(double value)
{
    if (isfinite(value))
        printf(",%.4g", value);
    else
        printf(",");
}

static void print_reach(unsigned seeds)
{
    printf("measure,aim,method,all,seed\n");
    for (unsigned r = 0; r < verdict_measures_n; r++)
        for (unsigned c = 0; c < METHODS; c++) {
            double all, one;
            measure(&verdict_measures[r], c, seeds, &all, &one);
            printf("%s,%s,%s", verdict_measures[r].name, verdict_measures[r].aim, name_of(c));
            print_field(all);
            print_field(one);
            printf("\n");
        }
}

/* What the row ran, as knob.h has it of the shipped detector. */
static void print_configuration(unsigned m, unsigned k)
{
    char text[KNOB_TEXT_MAX];
    if (m == CONTEST_SONARD)
        shipped_configuration(contest_knob(CONTEST_SONARD, k), text);
    else
        snprintf(text, sizeof text, "%s of %g", name_of(m),
                 m == ORACLE ? oracle_factor[k] : contest_knob((enum contestant)m, k));
    printf(",\"%s\"", text);
}

static void print_roc(unsigned seeds)
{
    printf("method,knob,value,standard,configuration");
    for (unsigned r = 0; r < verdict_measures_n; r++)
        printf(",%s", verdict_measures[r].key);
    printf("\n");
    for (unsigned c = 0; c < METHODS; c++)
        for (unsigned k = 0; k < knobs_of(c); k++) {
            const struct verdict v = pooled(c, k, seeds);
            printf("%s,%s,%g,%d", name_of(c), c == ORACLE ? "factor" : contest_knob_name((enum contestant)c),
                   c == ORACLE ? oracle_factor[k] : contest_knob((enum contestant)c, k), k == standard_of(c));
            print_configuration(c, k);
            for (unsigned r = 0; r < verdict_measures_n; r++)
                print_field(verdict_measures[r].scale * verdict_measures[r].of(&v, verdict_measures[r].what));
            printf("\n");
        }
}

static void print_header(const struct listing *list)
{
    if (list->cases)
        printf(
            "seed,world,head,ping,beam,bearing_deg,target,near_m,heard_by_m,far_m,blind_m,free_to_m,first,why\n");
    if (!list->echoes)
        return;
    printf("seed,world,head,beams");
    for (int c = 0; c < CAUSES; c++)
        printf(",%s", insonify_cause_name[c]);
    for (int c = 0; c < DRAWN_CLASSES; c++)
        printf(",free_%s_m,said_%s_m", drawn_class_name[c], drawn_class_name[c]);
    printf("\n");
}

static void print_worlds(uint64_t first, unsigned seeds)
{
    for (unsigned i = 0; i < seeds * WORLDS; i++) {
        const struct drawn_world w = drawn_world_of(first + i / WORLDS, i % WORLDS);
        drawn_world_print(stdout, &w);
    }
}

static int usage(void)
{
    fprintf(stderr, "usage: report_detection table|reach|roc|cases|echoes|worlds [FIRST [LAST] | quick]\n");
    return 2;
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0, given = argc > 2 && argv[2][0] <= '9';
    const uint64_t first = given ? strtoull(argv[2], NULL, 10) : 1;
    const uint64_t usual = given ? first : quick ? 2 : SEEDS;
    const uint64_t last = given && argc > 3 ? strtoull(argv[3], NULL, 10) : usual;
    const struct listing list = {.cases = strcmp(what, "cases") == 0,
                                 .echoes = strcmp(what, "echoes") == 0,
                                 .every_knob = strcmp(what, "table") == 0 || strcmp(what, "roc") == 0};
    const bool reach = strcmp(what, "reach") == 0, worlds = strcmp(what, "worlds") == 0;
    if (!(list.cases || list.echoes || list.every_knob || reach || worlds) || last < first ||
        last - first >= MAX_SEEDS)
        return usage();
    const unsigned seeds = (unsigned)(last - first + 1);
    if (worlds) {
        print_worlds(first, seeds);
        return 0;
    }
    contest_make(DRAWN_MAX_BINS);
    print_header(&list);
    for (unsigned i = 0; i < seeds * WORLDS; i++)
        judge_world(first + i / WORLDS, i % WORLDS, &list, verdicts[i / WORLDS]);
    if (reach)
        print_reach(seeds);
    else if (strcmp(what, "table") == 0)
        print_table(first, seeds);
    else if (list.every_knob)
        print_roc(seeds);
    contest_free();
    return 0;
}
