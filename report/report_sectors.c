/* SPDX-License-Identifier: MIT */
/*
 * report_sectors - the ring of sectors that the whole daemon tells of drawn waters, after three turns, against the
 * truth: is what is clear said to be clear, is what is blocked by nothing, is anything called free that is not.
 * Beside it the same ring made of the last turn of each rival's beams. Heads that turn in steps
 * that leave no gap between their beams (what stands in a gap nobody knows), vehicles that stand or move slowly.
 *
 *   report_sectors table [FIRST [LAST]]  of seeds FIRST to LAST (1 to 8; quick: 1 and 2), for people
 *   report_sectors csv [FIRST [LAST]]    measure, method, percent
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "lib/contest.h"
#include "lib/drawn_sound.h"
#include "lib/scans.h"

#define WORLDS    36
#define SEEDS     8
#define SECTORS   72
#define LOOK_M    3.0 /* what a vehicle asks for */
#define PAST_M    0.25
#define SLACK_M   0.3
#define LEVEL_RAD 0.0873 /* up and down: 5 degrees */

/* What is true of a sector, of its beams in the last turn. */
struct truth {
    bool looked;
    double wall_m;       /* nearest that is heard like a wall */
    double solid_m;      /* nearest of anything, down to the beams' skirts */
    double from_m, to_m; /* a wall would be heard from and to here, without a gap, before anything solid */
};

/* What is said of it. */
struct said {
    enum answer_state state;
    double range_m, free_to_m;
};

struct count {
    unsigned sectors, clear, said_clear, said_blocked, blocked, of_nothing, wrong;
    double free_m, said_m;
};

static struct drawn_sound sound;
static struct truth truth[SECTORS];
static struct said said[CONTESTANTS][SECTORS];
static struct count counts[CONTESTANTS];

static unsigned sector_of(double az_rad)
{
    return (unsigned)(geo_wrap(az_rad) / GEO_TURN * SECTORS + 0.5) % SECTORS;
}

static double look_m(void)
{
    return fmin(LOOK_M, 0.8 * sound.world.range_m);
}

static void learn_truth(void)
{
    const struct drawn_truth *t = &sound.truth[0];
    struct truth *of = &truth[sector_of((double)sound.axis[0].az_rad)];
    const double cell_m = sound.world.range_m / HEARABLE_CELLS;
    int from = 0, to;

    while (from < HEARABLE_CELLS && !(t->hearable.cell[from] >> DRAWN_WALL & 1))
        from++;
    for (to = from; to < HEARABLE_CELLS && t->hearable.cell[to] >> DRAWN_WALL & 1;)
        to++;
    if (!of->looked)
        *of = (struct truth){true, INFINITY, INFINITY, 0.0, INFINITY};
    of->wall_m = fmin(of->wall_m, t->hearable.target_m[DRAWN_WALL]);
    of->solid_m = fmin(of->solid_m, t->skirt_m);
    of->from_m = fmax(of->from_m, from * cell_m);
    of->to_m = fmin(of->to_m, fmin(to * cell_m, t->skirt_m));
}

/* A rival's beam narrows what it says of the sector. */
static void learn_beam(struct said *of, bool first, const struct beam_echoes *b)
{
    if (first)
        *of = (struct said){ANSWER_CLEAR, INFINITY, INFINITY};
    if (b->n > 0)
        of->range_m = fmin(of->range_m, (double)b->echo[0].range_m);
    of->free_to_m = fmin(of->free_to_m, b->free_to_m > b->blind_m ? (double)b->free_to_m : 0.0);
    of->state = isfinite(of->range_m) ? ANSWER_BLOCKED : of->free_to_m >= look_m() ? ANSWER_CLEAR : ANSWER_UNKNOWN;
}

static void hear(struct pipeline *pipeline)
{
    struct ping *ping = pipeline_begin(pipeline);
    struct ping heard = sound.ping;
    struct beam_echoes found;

    heard.max_beams = ping->max_beams;
    heard.max_samples = ping->max_samples;
    heard.beam = ping->beam;
    heard.samples = ping->samples;
    memcpy(heard.samples, sound.samples, heard.n_bins);
    heard.beam[0] = sound.axis[0];
    *ping = heard;
    pipeline_submit(pipeline, ping);
    const unsigned sector = sector_of((double)sound.axis[0].az_rad);
    const bool last_turn = sound.turn == DRAWN_TURNS - 1, first = !truth[sector].looked;
    for (enum contestant c = CONTEST_THRESHOLD; c < CONTESTANTS && last_turn; c++) {
        contest_detect(c, contest_standard(c), &sound.ping, &found);
        learn_beam(&said[c][sector], first, &found);
    }
    if (last_turn)
        learn_truth();
}

static void ask(struct pipeline *pipeline, const struct conf *conf)
{
    const struct answer_conf limits = scans_limits(conf);
    const struct answer_now now = {
        .now_ns = sound.ping.t_in_ns, .pose_fresh = sound.world.posed, .pose = sound.ping.pose};
    struct answer answer[SECTORS];

    answer_sectors(
        pipeline_picture(pipeline), &limits, &now,
        &(struct answer_band){.lo_rad = -LEVEL_RAD, .hi_rad = LEVEL_RAD, .reach_m = look_m(), .count = SECTORS},
        answer);
    for (int i = 0; i < SECTORS; i++)
        said[CONTEST_SONARD][i] =
            (struct said){answer[i].state, answer[i].state == ANSWER_BLOCKED ? answer[i].range_m : INFINITY,
                          answer[i].free_to_m > answer[i].blind_to_m ? answer[i].free_to_m : 0.0};
}

static void count_sector(struct count *n, const struct truth *t, const struct said *s)
{
    const bool clear = t->to_m >= look_m() + SLACK_M && t->from_m < look_m();
    const bool near = s->state == ANSWER_BLOCKED && s->range_m < look_m();

    n->sectors++;
    n->clear += clear;
    n->said_clear += clear && !near && s->free_to_m >= look_m() - 1e-3;
    n->said_blocked += clear && near;
    n->blocked += s->state == ANSWER_BLOCKED;
    n->of_nothing += s->state == ANSWER_BLOCKED && s->range_m < t->solid_m - SLACK_M - sound.world.pulse_m;
    n->wrong += s->free_to_m > t->wall_m + PAST_M || (s->state == ANSWER_CLEAR && t->wall_m < look_m() - PAST_M);
    if (t->to_m > t->from_m) {
        n->free_m += t->to_m - t->from_m;
        n->said_m += fmax(0.0, fmin(s->free_to_m, t->to_m) - t->from_m);
    }
}

static void judge_world(uint64_t seed, unsigned number)
{
    static struct conf conf;

    drawn_sound_begin(&sound, seed, number);
    if (sound.world.beams > 1 || sound.world.beam_step_rad > (double)sound.ping.az_aperture_rad)
        return;
    memset(truth, 0, sizeof truth);
    contest_begin();
    scans_configure("", &conf);
    conf.sonar[0].range_m = fmax(0.75, sound.world.range_m);
    struct pipeline *pipeline = scans_start(&conf);
    while (drawn_sound_next(&sound))
        hear(pipeline);
    ask(pipeline, &conf);
    pipeline_free(pipeline);
    for (int i = 0; i < SECTORS; i++)
        for (int c = 0; c < CONTESTANTS && truth[i].looked; c++)
            count_sector(&counts[c], &truth[i], &said[c][i]);
}

/* ---- what is told ---- */

static double percent(double part, double whole)
{
    return whole > 0.0 ? 100.0 * part / whole : 0.0;
}

static double said_clear(const struct count *n)
{
    return percent(n->said_clear, n->clear);
}

static double said_blocked(const struct count *n)
{
    return percent(n->said_blocked, n->clear);
}

static double free_metres(const struct count *n)
{
    return percent(n->said_m, n->free_m);
}

static double blocked(const struct count *n)
{
    return percent(n->blocked, n->sectors);
}

static double of_nothing(const struct count *n)
{
    return percent(n->of_nothing, n->sectors);
}

static double wrong(const struct count *n)
{
    return percent(n->wrong, n->sectors);
}

static const struct {
    const char *name;
    double (*of)(const struct count *n);
} measures[] = {
    {"clear sectors said free to 3 m: %", said_clear},
    {"clear sectors said blocked before that: %", said_blocked},
    {"free metres said free: %", free_metres},
    {"sectors blocked at any range: %", blocked},
    {"sectors blocked by nothing: %", of_nothing},
    {"sectors with free water past a wall that is heard: %", wrong},
};
#define MEASURES (sizeof measures / sizeof measures[0])

static void print_table(void)
{
    printf("%u sectors, %u of them clear\n%-54s", counts[0].sectors, counts[0].clear, "");
    for (int c = 0; c < CONTESTANTS; c++)
        printf(" %13s", contest_name[c]);
    printf("\n");
    for (size_t m = 0; m < MEASURES; m++) {
        printf("%-54s", measures[m].name);
        for (int c = 0; c < CONTESTANTS; c++)
            printf(" %13.2f", measures[m].of(&counts[c]));
        printf("\n");
    }
}

static void print_csv(void)
{
    printf("measure,method,percent\n");
    for (size_t m = 0; m < MEASURES; m++)
        for (int c = 0; c < CONTESTANTS; c++)
            printf("%s,%s,%.3g\n", measures[m].name, contest_name[c], measures[m].of(&counts[c]));
}

int main(int argc, char **argv)
{
    const char *what = argc > 1 ? argv[1] : "";
    const bool quick = argc > 2 && strcmp(argv[2], "quick") == 0, given = argc > 2 && argv[2][0] <= '9';
    const uint64_t first = given ? strtoull(argv[2], NULL, 10) : 1, usual = given ? first : quick ? 2 : SEEDS;
    const uint64_t last = given && argc > 3 ? strtoull(argv[3], NULL, 10) : usual;

    if (strcmp(what, "table") != 0 && strcmp(what, "csv") != 0) {
        fprintf(stderr, "usage: report_sectors table|csv [FIRST [LAST] | quick]\n");
        return 2;
    }
    contest_make(DRAWN_MAX_BINS);
    for (uint64_t seed = first; seed <= last; seed++)
        for (unsigned n = 0; n < WORLDS; n++)
            judge_world(seed, n);
    contest_free();
    if (strcmp(what, "table") == 0)
        print_table();
    else
        print_csv();
    return 0;
}
